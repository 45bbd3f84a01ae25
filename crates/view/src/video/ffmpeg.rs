//! MP4 and WebM through the ffmpeg program, which reads raw pictures from a pipe.

use std::io::{ErrorKind, Read, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use super::Shape;
use crate::paint::Image;

/// Arguments that choose codec and quality.
pub const H264: &[&str] = &["-c:v", "libx264", "-preset", "veryfast", "-crf", "18", "-movflags", "+faststart"];
pub const VP9: &[&str] = &["-c:v", "libvpx-vp9", "-crf", "28", "-b:v", "0", "-row-mt", "1", "-cpu-used", "4"];

/// Whether the program is there.
pub fn has_ffmpeg() -> bool {
    let quiet = Command::new("ffmpeg").arg("-version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    quiet.is_ok_and(|status| status.success())
}

pub struct Ffmpeg {
    child: Child,
}

impl Ffmpeg {
    pub fn start(path: &Path, shape: Shape, codec: &[&str]) -> Result<Ffmpeg, String> {
        let child = Command::new("ffmpeg")
            .args(["-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgba"])
            .args(["-s", &format!("{}x{}", shape.width, shape.height), "-r", &shape.fps.to_string(), "-i", "-"])
            // Players expect colours at half resolution, and so an even number of pixels.
            .args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"])
            .args(codec)
            .arg(path)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn();
        child.map(|child| Ffmpeg { child }).map_err(|e| match e.kind() {
            ErrorKind::NotFound => format!(
                "`{}` needs the program ffmpeg (Debian: apt install ffmpeg, macOS: brew install ffmpeg, Windows: winget \
                 install ffmpeg); without it, name a .gif or .apng instead",
                path.display()
            ),
            _ => format!("cannot start ffmpeg: {e}"),
        })
    }

    pub fn push(&mut self, image: &Image) -> Result<(), String> {
        let Some(pipe) = self.child.stdin.as_mut() else { return Ok(()) };
        match pipe.write_all(&image.rgba) {
            Ok(()) => Ok(()),
            Err(_) => Err(self.complaint()),
        }
    }

    pub fn finish(mut self) -> Result<(), String> {
        drop(self.child.stdin.take());
        match self.child.wait() {
            Ok(status) if status.success() => Ok(()),
            _ => Err(self.complaint()),
        }
    }

    /// What ffmpeg said.
    fn complaint(&mut self) -> String {
        drop(self.child.stdin.take());
        let mut said = String::new();
        if let Some(stderr) = self.child.stderr.as_mut() {
            // What cannot be read is just not repeated.
            let _ = stderr.read_to_string(&mut said);
        }
        format!("ffmpeg failed: {}", said.trim().lines().last().unwrap_or("it gave no reason"))
    }
}
