//! MP4 without ffmpeg: Cisco's OpenH264, built from source by the cargo feature `h264`.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use muxide::api::{Muxer, MuxerBuilder, VideoCodec};
use openh264::OpenH264API;
use openh264::encoder::{Encoder, EncoderConfig, FrameRate, FrameType, IntraFramePeriod, QpRange, RateControlMode};
use openh264::formats::{RgbaSliceU8, YUVBuffer};

use super::{Shape, failed};
use crate::paint::Image;

/// Quantiser between 0 (all of the picture) and 51: no difference that one sees.
const QUALITY: u8 = 20;
/// Seconds between pictures that one can jump to.
const JUMP: f64 = 2.0;

pub struct H264 {
    path: PathBuf,
    encoder: Encoder,
    muxer: Muxer<BufWriter<File>>,
    fps: f64,
    count: usize,
}

impl H264 {
    pub fn create(path: &Path, shape: Shape) -> Result<H264, String> {
        let file = File::create(path).map_err(|e| failed(path, e))?;
        let config = EncoderConfig::new()
            .max_frame_rate(FrameRate::from_hz(shape.fps as f32))
            .rate_control_mode(RateControlMode::Off)
            .qp(QpRange::new(QUALITY, QUALITY))
            .skip_frames(false)
            .intra_frame_period(IntraFramePeriod::from_num_frames((JUMP * shape.fps).ceil() as u32));
        let encoder = Encoder::with_api_config(OpenH264API::from_source(), config).map_err(|e| failed(path, e))?;
        let [width, height] = even(shape.width, shape.height);
        let muxer = MuxerBuilder::new(BufWriter::new(file))
            .video(VideoCodec::H264, width as u32, height as u32, shape.fps)
            .build()
            .map_err(|e| failed(path, e))?;
        Ok(H264 { path: path.to_owned(), encoder, muxer, fps: shape.fps, count: 0 })
    }

    pub fn push(&mut self, image: &Image) -> Result<(), String> {
        let [width, height] = even(image.width, image.height);
        let padded = (width, height) != (image.width, image.height);
        let yuv =
            if padded { planes(&pad(image, width, height), width, height) } else { planes(&image.rgba, width, height) };
        let coded = self.encoder.encode(&yuv).map_err(|e| failed(&self.path, e))?;
        let key = matches!(coded.frame_type(), FrameType::IDR | FrameType::I);
        let time = self.count as f64 / self.fps;
        self.count += 1;
        self.muxer.write_video(time, &coded.to_vec(), key).map_err(|e| failed(&self.path, e))
    }

    pub fn finish(self) -> Result<(), String> {
        self.muxer.finish().map_err(|e| failed(&self.path, e))
    }
}

/// H.264 halves the colours' resolution: both sides must be even.
fn even(width: usize, height: usize) -> [usize; 2] {
    [width.next_multiple_of(2), height.next_multiple_of(2)]
}

fn planes(rgba: &[u8], width: usize, height: usize) -> YUVBuffer {
    YUVBuffer::from_rgba8_source(RgbaSliceU8::new(rgba, (width, height)))
}

/// The picture with its last column and row repeated where that is needed.
fn pad(image: &Image, width: usize, height: usize) -> Vec<u8> {
    let row = |y: usize| &image.rgba[4 * y * image.width..4 * (y + 1) * image.width];
    let mut padded = Vec::with_capacity(4 * width * height);
    for y in 0..height {
        let row = row(y.min(image.height - 1));
        padded.extend_from_slice(row);
        padded.extend_from_slice(&row[row.len() - 4 * (width - image.width)..]);
    }
    padded
}
