//! GIF: only what changed from picture to picture, in a palette that is renewed when it no longer fits.

use std::borrow::Cow;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use super::palette::{COLORS, Palette};
use super::{Shape, failed, lzw};
use crate::paint::Image;

/// A shown colour may be this far off (largest channel, of 255) before a pixel is drawn again …
const CLOSE: u8 = 5;
/// … and a palette is renewed when this share of the pixels is further off than `FAR`.
const FAR: u8 = 16;
const MISFITS: f64 = 0.001;
/// The index that means "as before".
const SAME: u8 = COLORS as u8;

pub struct Gif {
    path: PathBuf,
    encoder: gif::Encoder<BufWriter<File>>,
    fps: f64,
    count: usize,
    palette: Option<Palette>,
    /// Colours on the screen now.
    shown: Vec<[u8; 3]>,
    /// The last picture.
    before: Vec<u8>,
}

/// GIF's time counts in these, s; programs show 0 and 1 of them as 10.
const TICK: f64 = 0.01;

impl Gif {
    pub fn create(path: &Path, shape: Shape) -> Result<Gif, String> {
        if shape.fps > 50.0 {
            return Err(format!("GIF shows at most 50 frames a second, not {}", shape.fps));
        }
        let (Ok(width), Ok(height)) = (u16::try_from(shape.width), u16::try_from(shape.height)) else {
            return Err(format!("GIF holds at most 65535 pixels a side, not {}×{}", shape.width, shape.height));
        };
        let file = File::create(path).map_err(|e| failed(path, e))?;
        let mut encoder = gif::Encoder::new(BufWriter::new(file), width, height, &[]).map_err(|e| failed(path, e))?;
        encoder.set_repeat(gif::Repeat::Infinite).map_err(|e| failed(path, e))?;
        Ok(Gif {
            path: path.to_owned(),
            encoder,
            fps: shape.fps,
            count: 0,
            palette: None,
            shown: Vec::new(),
            before: Vec::new(),
        })
    }

    pub fn push(&mut self, image: &Image) -> Result<(), String> {
        let row = 4 * image.width;
        // Whether each row is the last picture's.
        let same: Vec<bool> = match self.count {
            0 => vec![false; image.height],
            _ => {
                image.rgba.chunks_exact(row).zip(self.before.chunks_exact(row)).map(|(now, then)| now == then).collect()
            }
        };
        let fits = self.palette.as_mut().is_some_and(|p| fits(p, image, &same));
        let mut palette = match self.palette.take() {
            Some(palette) if fits => palette,
            _ => Palette::of(&image.rgba),
        };
        if self.shown.is_empty() {
            self.shown = vec![[0; 3]; image.width * image.height];
        }
        let first = self.count == 0;
        let mut buffer = Vec::with_capacity(self.shown.len());
        let rows = image.rgba.chunks_exact(row).zip(self.shown.chunks_exact_mut(image.width));
        for ((row, shown), same) in rows.zip(same) {
            if same && fits {
                buffer.resize(buffer.len() + image.width, SAME);
                continue;
            }
            for (pixel, shown) in row.chunks_exact(4).zip(shown) {
                let rgb = [pixel[0], pixel[1], pixel[2]];
                let off = (0..3).map(|i| shown[i].abs_diff(rgb[i])).max().unwrap_or(0);
                if off <= CLOSE && !first {
                    buffer.push(SAME);
                    continue;
                }
                let (index, _) = palette.find(rgb);
                let color = palette.colors[index as usize];
                buffer.push(if color == *shown && !first { SAME } else { index });
                *shown = color;
            }
        }
        self.before.clone_from(&image.rgba);
        let frame = self.frame(image, &buffer, palette.bytes());
        self.palette = Some(palette);
        self.count += 1;
        self.encoder.write_lzw_pre_encoded_frame(&frame).map_err(|e| failed(&self.path, e))
    }

    pub fn finish(self) -> Result<(), String> {
        let path = self.path;
        let file = self.encoder.into_inner().map_err(|e| failed(&path, e))?;
        file.into_inner().map(drop).map_err(|e| failed(&path, e))
    }

    /// The part of the picture that changed.
    fn frame(&self, image: &Image, buffer: &[u8], palette: Vec<u8>) -> gif::Frame<'static> {
        let (mut left, mut right, mut top, mut bottom) = (image.width, 0, image.height, 0);
        for (y, row) in buffer.chunks_exact(image.width).enumerate() {
            if let Some(first) = row.iter().position(|&p| p != SAME) {
                let last = row.iter().rposition(|&p| p != SAME).unwrap_or(first);
                (left, right, top, bottom) = (left.min(first), right.max(last), top.min(y), y);
            }
        }
        if left > right {
            (left, right, top, bottom) = (0, 0, 0, 0);
        }
        let rows = buffer.chunks_exact(image.width).skip(top).take(bottom + 1 - top);
        let mut part = Vec::with_capacity((right + 1 - left) * (bottom + 1 - top));
        rows.for_each(|row| part.extend_from_slice(&row[left..=right]));
        let ticks = |n: usize| (n as f64 / self.fps / TICK).round();
        gif::Frame {
            delay: (ticks(self.count + 1) - ticks(self.count)) as u16,
            dispose: gif::DisposalMethod::Keep,
            transparent: Some(SAME),
            left: left as u16,
            top: top as u16,
            width: (right + 1 - left) as u16,
            height: (bottom + 1 - top) as u16,
            palette: Some(padded(palette)),
            buffer: Cow::Owned(lzw::encode(&part, SAME)),
            ..gif::Frame::default()
        }
    }
}

/// All 256 entries, so that the index that means "as before" exists.
fn padded(mut palette: Vec<u8>) -> Vec<u8> {
    palette.resize(3 * 256, 0);
    palette
}

/// Whether a palette still shows a picture well, but for the rows that are as before.
fn fits(palette: &mut Palette, image: &Image, same: &[bool]) -> bool {
    let rows = image.rgba.chunks_exact(4 * image.width).zip(same).filter(|(_, same)| !**same);
    // Every third pixel tells enough.
    let pixels = rows.flat_map(|(row, _)| row.chunks_exact(4).step_by(3));
    let far = pixels.filter(|p| palette.find([p[0], p[1], p[2]]).1 > FAR).count();
    far as f64 <= MISFITS * (image.width * image.height / 3) as f64
}
