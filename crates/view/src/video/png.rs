//! PNG, still and animated.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use super::{Shape, failed};
use crate::paint::Image;

/// Keeps the last picture and writes it at the end.
pub struct Still {
    path: PathBuf,
    last: Option<Image>,
}

impl Still {
    pub fn new(path: &Path) -> Still {
        Still { path: path.to_owned(), last: None }
    }

    pub fn push(&mut self, image: &Image) -> Result<(), String> {
        self.last = Some(image.clone());
        Ok(())
    }

    pub fn finish(self) -> Result<(), String> {
        let Some(image) = self.last else { return Ok(()) };
        let file = File::create(&self.path).map_err(|e| failed(&self.path, e))?;
        let encoder = encoder(BufWriter::new(file), image.width, image.height);
        let written = encoder.write_header().and_then(|mut w| {
            w.write_image_data(&rgb(&image))?;
            w.finish()
        });
        written.map_err(|e| failed(&self.path, e))
    }
}

/// An animated PNG: the same file with more pictures.
pub struct Animated {
    path: PathBuf,
    writer: png::Writer<BufWriter<File>>,
    left: usize,
}

impl Animated {
    pub fn create(path: &Path, shape: Shape) -> Result<Animated, String> {
        let file = File::create(path).map_err(|e| failed(path, e))?;
        let mut encoder = encoder(BufWriter::new(file), shape.width, shape.height);
        let milliseconds = (1000.0 / shape.fps).round().max(1.0) as u16;
        let writer = encoder
            .set_animated(shape.frames.max(1) as u32, 0)
            .and_then(|()| encoder.set_frame_delay(milliseconds, 1000))
            .and_then(|()| encoder.write_header());
        let writer = writer.map_err(|e| failed(path, e))?;
        Ok(Animated { path: path.to_owned(), writer, left: shape.frames.max(1) })
    }

    pub fn push(&mut self, image: &Image) -> Result<(), String> {
        if self.left == 0 {
            return Ok(());
        }
        self.left -= 1;
        self.writer.write_image_data(&rgb(image)).map_err(|e| failed(&self.path, e))
    }

    pub fn finish(self) -> Result<(), String> {
        self.writer.finish().map_err(|e| failed(&self.path, e))
    }
}

fn encoder<'a>(file: BufWriter<File>, width: usize, height: usize) -> png::Encoder<'a, BufWriter<File>> {
    let mut encoder = png::Encoder::new(file, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Balanced);
    encoder
}

fn rgb(image: &Image) -> Vec<u8> {
    image.rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect()
}
