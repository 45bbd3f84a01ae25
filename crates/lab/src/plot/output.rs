//! A figure as a file: SVG text, or PNG bytes.

use plotters::backend::{BitMapBackend, SVGBackend};

use super::Figure;
use super::canvas::{Canvas, Result, Target, UNITS};
use super::draw::{Layout, draw};

/// Pixels of a PNG per px of the page.
const DENSITY: usize = 2;
/// The PNG is drawn this many times larger and then averaged: plotters' thick lines have hard edges.
const SUPERSAMPLING: usize = UNITS as usize / DENSITY;

fn units(size: [f64; 2]) -> [usize; 2] {
    // A whole number of px, so that every pixel of the PNG has all its samples.
    size.map(|s| s.ceil() as usize * UNITS as usize)
}

pub fn svg(figure: &Figure) -> Result<String> {
    let layout = Layout::new(figure);
    let [width, height] = units(layout.size);
    let mut text = String::new();
    let mut canvas = Canvas::new(SVGBackend::with_string(&mut text, (width as u32, height as u32)), Target::Svg)?;
    draw(figure, &layout, &mut canvas)?;
    canvas.finish()?;
    // The page's size in px; the coordinates inside stay in units.
    let [w, h] = [width, height].map(|u| u / UNITS as usize);
    Ok(text.replacen(&format!("width=\"{width}\" height=\"{height}\""), &format!("width=\"{w}\" height=\"{h}\""), 1))
}

pub fn png(figure: &Figure) -> Result<Vec<u8>> {
    let layout = Layout::new(figure);
    let [width, height] = units(layout.size);
    let mut pixels = vec![0; width * height * 3];
    let mut canvas =
        Canvas::new(BitMapBackend::with_buffer(&mut pixels, (width as u32, height as u32)), Target::Bitmap)?;
    draw(figure, &layout, &mut canvas)?;
    canvas.finish()?;
    encode(&shrink(&pixels, [width, height]), [width / SUPERSAMPLING, height / SUPERSAMPLING])
}

/// Averages squares of 2 × 2 samples. Most of a chart is paper: a build for development is ten times faster where squares
/// of one colour are only copied.
fn shrink(samples: &[u8], [width, height]: [usize; 2]) -> Vec<u8> {
    const { assert!(SUPERSAMPLING == 2) };
    let bytes = 3 * width;
    let mut out = vec![0; bytes / 2 * (height / 2)];
    for (y, to) in out.chunks_exact_mut(bytes / 2).enumerate() {
        let (above, below) = samples[2 * y * bytes..][..2 * bytes].split_at(bytes);
        let alike = above == below;
        let mut x = 0;
        while x < width / 2 {
            let (i, o) = (6 * x, 3 * x);
            let run = if alike { same(&above[i..]) } else { 0 };
            if run > 0 {
                to[o..o + 3 * run].copy_from_slice(&above[i..i + 3 * run]);
                x += run;
                continue;
            }
            for c in o..o + 3 {
                let i = c + o;
                let sum = u32::from(above[i]) + u32::from(above[i + 3]) + u32::from(below[i]) + u32::from(below[i + 3]);
                to[c] = (sum / 4) as u8;
            }
            x += 1;
        }
    }
    out
}

/// Pairs of samples that have all one colour, of those that come first: a power of two, or 0 if there are fewer than 16.
fn same(row: &[u8]) -> usize {
    let mut n = 0;
    for power in 4..12 {
        let bytes = 6 << power;
        // Shifted by one sample it is the same.
        if bytes > row.len() || row[..bytes - 3] != row[3..bytes] {
            break;
        }
        n = 1 << power;
    }
    n
}

fn encode(pixels: &[u8], [width, height]: [usize; 2]) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    // Charts are flat: trying every filter makes them no smaller.
    encoder.set_compression(png::Compression::Fast);
    encoder.set_filter(png::Filter::Up);
    // So that a page at 96 px an inch prints at its size.
    let per_metre = (96.0 * DENSITY as f64 / 0.0254) as u32;
    let unit = png::Unit::Meter;
    encoder.set_pixel_dims(Some(png::PixelDimensions { xppu: per_metre, yppu: per_metre, unit }));
    let mut writer = encoder.write_header().map_err(|e| e.to_string())?;
    writer.write_image_data(pixels).map_err(|e| e.to_string())?;
    writer.finish().map_err(|e| e.to_string())?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::palette::{CURVES, MARKERS};
    use crate::plot::{Axis, Layer, Line, Panel};

    fn figure() -> Figure {
        let points = (0..50).map(|i| [f64::from(i) * 0.1, (f64::from(i) * 0.1).sin()]).collect();
        let line = Line::new("angle of the pendulum", CURVES[1], points).marked(MARKERS[0]);
        Figure::new(
            "A <title>",
            "",
            vec![Panel::new("", Axis::linear("t [s]"), Axis::linear("θ [rad]"), vec![Layer::Line(line)])],
        )
    }

    #[test]
    fn an_svg_names_its_curves_and_axes_and_keeps_text_as_text() {
        let text = svg(&figure()).expect("the figure draws");
        for part in ["A &lt;title&gt;", "angle of the pendulum", "t [s]", "θ [rad]", "#D55E00"] {
            assert!(text.contains(part), "no {part}");
        }
    }

    /// Dark pixels of a page without curves, and its width.
    fn ink(title: &str) -> (usize, u32) {
        let bytes = png(&Figure::new(title, "", Vec::new())).expect("it draws");
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().expect("a PNG");
        let mut pixels = vec![0; reader.output_buffer_size().expect("it fits")];
        reader.next_frame(&mut pixels).expect("one frame");
        (pixels.chunks(3).filter(|p| p.iter().all(|c| *c < 120)).count(), reader.info().width)
    }

    #[test]
    fn names_in_any_script_are_drawn() {
        let empty = ink("").0;
        // Each letter differs from the box of what no font has.
        let boxes = |n: usize| ink(&"\u{10ffff}".repeat(n)).0 - empty;
        assert!(boxes(2) > 20, "a box is seen");
        let scripts = ["дом", "σπίτι", "房子", "いえ", "집은", "בית", "بيت", "घर", "บ้าน", "տուն", "სახლი", "ቤት"];
        for name in scripts {
            let drawn = ink(name).0 - empty;
            assert!(drawn > 30 && drawn != boxes(name.chars().count()), "{name}: {drawn}");
        }
        let wide = |title: &str| ink(title).1;
        assert!(wide(&"房".repeat(200)) > wide(&"房".repeat(150)) + 800, "they take their place");
    }

    #[test]
    fn shrinking_averages_squares() {
        let (width, height) = (200, 4);
        let sample =
            |i: usize| if i.is_multiple_of(7) || !(90..600).contains(&(i % 600)) { (i * 37 % 251) as u8 } else { 9 };
        for sample in [&sample as &dyn Fn(usize) -> u8, &|_| 200] {
            let samples: Vec<u8> = (0..width * height * 3).map(sample).collect();
            let at = |x: usize, y: usize, c: usize| u32::from(samples[3 * (y * width + x) + c]);
            let small = shrink(&samples, [width, height]);
            for (i, found) in small.iter().enumerate() {
                let (x, y, c) = (i / 3 % 100, i / 300, i % 3);
                let sum: u32 = [(0, 0), (1, 0), (0, 1), (1, 1)].iter().map(|(i, j)| at(2 * x + i, 2 * y + j, c)).sum();
                assert_eq!(u32::from(*found), sum / 4, "{x} {y}");
            }
        }
    }

    #[test]
    fn a_png_has_the_pages_size_and_the_curves_colour() {
        let bytes = png(&figure()).expect("the figure draws");
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().expect("a PNG");
        let mut pixels = vec![0; reader.output_buffer_size().expect("it fits")];
        reader.next_frame(&mut pixels).expect("one frame");
        let page = Layout::new(&figure()).size;
        let info = reader.info();
        assert_eq!([info.width as usize, info.height as usize], page.map(|s| s as usize * DENSITY));
        assert!(pixels.chunks(3).filter(|p| **p == CURVES[1]).count() > 500, "the curve is missing");
    }
}
