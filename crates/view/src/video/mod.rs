//! Pictures to files: PNG, animated PNG and GIF by crates, MP4 and WebM by ffmpeg where it is installed, else MP4 by the
//! optional feature `h264`.

mod ffmpeg;
mod gif;
#[cfg(feature = "h264")]
mod h264;
mod lzw;
mod palette;
mod png;

use std::path::Path;

use super::paint::Image;
use ffmpeg::has_ffmpeg;

/// A kind of file, chosen by its name's ending.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// One picture.
    Png,
    Apng,
    Gif,
    Mp4,
    Webm,
}

/// By ending.
const FORMATS: [(&str, Format); 5] =
    [("gif", Format::Gif), ("png", Format::Png), ("apng", Format::Apng), ("mp4", Format::Mp4), ("webm", Format::Webm)];

impl Format {
    /// Errors: one sentence that lists the endings.
    pub fn of(path: &Path) -> Result<Format, String> {
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
        let found = FORMATS.iter().find(|(name, _)| *name == ending).map(|(_, format)| *format);
        found.ok_or_else(|| {
            let known: Vec<String> = FORMATS.iter().map(|(name, _)| format!(".{name}")).collect();
            format!("`{}` must end in one of {}", path.display(), known.join(", "))
        })
    }

    /// Frames per second where the user names none. GIF counts in hundredths of a second.
    pub fn usual_fps(self) -> f64 {
        match self {
            Format::Mp4 | Format::Webm => 60.0,
            Format::Gif | Format::Png => 50.0,
            Format::Apng => 30.0,
        }
    }
}

/// Whether MP4 can be written here.
pub fn has_mp4() -> bool {
    cfg!(feature = "h264") || has_ffmpeg()
}

/// A file that pictures are appended to.
pub enum Video {
    Png(png::Still),
    Apng(png::Animated),
    Gif(Box<gif::Gif>),
    Ffmpeg(ffmpeg::Ffmpeg),
    #[cfg(feature = "h264")]
    H264(Box<h264::H264>),
}

/// What is known before the first picture.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    pub width: usize,
    pub height: usize,
    pub fps: f64,
    pub frames: usize,
}

impl Video {
    /// Errors: one sentence if the file cannot be made, or something is not installed.
    pub fn create(path: &Path, shape: Shape) -> Result<Video, String> {
        Ok(match Format::of(path)? {
            Format::Png => Video::Png(png::Still::new(path)),
            Format::Apng => Video::Apng(png::Animated::create(path, shape)?),
            Format::Gif => Video::Gif(Box::new(gif::Gif::create(path, shape)?)),
            #[cfg(feature = "h264")]
            Format::Mp4 if !has_ffmpeg() => Video::H264(Box::new(h264::H264::create(path, shape)?)),
            Format::Mp4 => Video::Ffmpeg(ffmpeg::Ffmpeg::start(path, shape, ffmpeg::H264)?),
            Format::Webm => Video::Ffmpeg(ffmpeg::Ffmpeg::start(path, shape, ffmpeg::VP9)?),
        })
    }

    pub fn push(&mut self, image: &Image) -> Result<(), String> {
        match self {
            Video::Png(still) => still.push(image),
            Video::Apng(file) => file.push(image),
            Video::Gif(file) => file.push(image),
            Video::Ffmpeg(pipe) => pipe.push(image),
            #[cfg(feature = "h264")]
            Video::H264(file) => file.push(image),
        }
    }

    /// Writes what is still open. A video that is dropped without this may be cut short.
    pub fn finish(self) -> Result<(), String> {
        match self {
            Video::Png(still) => still.finish(),
            Video::Apng(file) => file.finish(),
            Video::Gif(file) => file.finish(),
            Video::Ffmpeg(pipe) => pipe.finish(),
            #[cfg(feature = "h264")]
            Video::H264(file) => file.finish(),
        }
    }
}

/// A sentence about a file that could not be written.
fn failed(path: &Path, error: impl std::fmt::Display) -> String {
    format!("cannot write `{}`: {}", path.display(), penny::reason(error))
}
