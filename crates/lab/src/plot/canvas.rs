//! Lines, areas, markers and text in px on a page, through either of plotters' backends.

use std::sync::LazyLock;

use ab_glyph::{Font, FontRef, GlyphId, PxScale, ScaleFont, point};
use plotters::backend::DrawingBackend;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontStyle, IntoFont, RGBColor, ShapeStyle, TextStyle, register_font};

use super::palette::{Marker, Rgb};

/// plotters draws at whole units; this many of them are one px.
pub const UNITS: f64 = 4.0;

/// Name under which plotters knows the font, and what an SVG asks for where DejaVu is not installed.
const FAMILY: &str = "DejaVu Sans,Verdana,sans-serif";

/// Height of ordinary text, px.
pub const TEXT: f64 = 13.0;

const NORMAL: &[u8] = include_bytes!("font/DejaVuSans.ttf");
const BOLD: &[u8] = include_bytes!("font/DejaVuSans-Bold.ttf");

/// The normal and the bold face; `None` if the program was built with a broken font.
static FACES: LazyLock<Option<[FontRef<'static>; 2]>> = LazyLock::new(|| {
    register_font(FAMILY, FontStyle::Normal, NORMAL).ok()?;
    register_font(FAMILY, FontStyle::Bold, BOLD).ok()?;
    Some([FontRef::try_from_slice(NORMAL).ok()?, FontRef::try_from_slice(BOLD).ok()?])
});

/// Glyphs of GNU Unifont for what those faces do not have, in 256 × 256 cells of 16 × 16 bits: Unicode's first plane;
/// and below, a bit each, which of them are marks that go 8 and 16 pixels back over the letter before them.
const FALLBACK: &[u8] = include_bytes!("font/fallback.png");

static GLYPHS: LazyLock<Option<Vec<u8>>> = LazyLock::new(|| {
    let mut reader = png::Decoder::new(std::io::Cursor::new(FALLBACK)).read_info().ok()?;
    let mut bits = vec![0; reader.output_buffer_size()?];
    reader.next_frame(&mut bits).ok()?;
    Some(bits)
});

/// A glyph of 16 rows of bits, the highest at the left, ink is 1.
struct Bitmap {
    rows: [u16; 16],
    /// 8 or 16 of them are used.
    width: usize,
    /// A mark: this many pixels back, and what comes next takes its place.
    back: usize,
}

impl Bitmap {
    /// Rows above the line that letters stand on.
    const ASCENT: f64 = 14.0;

    /// Of a character that no font has: an empty box.
    const BOX: Bitmap = {
        let mut rows = [0x4200; 16];
        (rows[0], rows[1], rows[2], rows[14], rows[15]) = (0, 0, 0, 0, 0);
        (rows[3], rows[13]) = (0x7e00, 0x7e00);
        Bitmap { rows, width: 8, back: 0 }
    };

    /// What stands for a character that DejaVu Sans does not have.
    fn of(c: char) -> Bitmap {
        let code = c as usize;
        let Some(bits) = GLYPHS.as_ref().filter(|_| code < 1 << 16) else { return Bitmap::BOX };
        let at = |y: usize| 512 * (16 * (code >> 8) + y) + 2 * (code & 255);
        let rows = std::array::from_fn(|y| !u16::from_be_bytes([bits[at(y)], bits[at(y) + 1]]));
        // Punctuation of East Asia leaves half of its square free.
        let wide = rows.iter().any(|row: &u16| row & 255 != 0) || (0x3000..0x3040).contains(&code);
        let mark =
            |set: usize| bits[512 * (4096 + 16 * set + (code >> 12)) + (code & 0xfff) / 8] >> (7 - code % 8) & 1 == 0;
        let back = if mark(0) { 8 } else { 16 * usize::from(mark(1)) };
        let empty = rows == [0; 16] && !c.is_whitespace();
        if empty { Bitmap::BOX } else { Bitmap { rows, width: if wide { 16 } else { 8 }, back } }
    }

    /// Parts of an em to the next letter.
    fn advance(&self) -> f64 {
        if self.back > 0 { 0.0 } else { self.width as f64 / 16.0 }
    }
}

/// What the backend writes. plotters draws thick lines with spikes and text with uneven gaps into a bitmap, so there
/// both are drawn here.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Target {
    Svg,
    Bitmap,
}

pub struct Canvas<B: DrawingBackend> {
    backend: B,
    target: Target,
}

/// How a text hangs on its point.
#[derive(Clone, Copy)]
pub enum Anchor {
    Left,
    Middle,
    Right,
}

/// A text's look.
#[derive(Clone, Copy)]
pub struct Type {
    pub size: f64,
    pub bold: bool,
    pub color: Rgb,
    pub anchor: Anchor,
}

pub type Result<T> = std::result::Result<T, String>;

fn units([x, y]: [f64; 2]) -> (i32, i32) {
    let whole = |v: f64| (v * UNITS).round().clamp(-1e6, 1e6) as i32;
    (whole(x), whole(y))
}

fn style(color: Rgb, width: f64, filled: bool) -> ShapeStyle {
    let [r, g, b] = color;
    ShapeStyle { color: RGBColor(r, g, b).into(), filled, stroke_width: (width * UNITS).round().max(1.0) as u32 }
}

fn text_style(look: Type) -> TextStyle<'static> {
    let [r, g, b] = look.color;
    let weight = if look.bold { FontStyle::Bold } else { FontStyle::Normal };
    let h = match look.anchor {
        Anchor::Left => HPos::Left,
        Anchor::Middle => HPos::Center,
        Anchor::Right => HPos::Right,
    };
    // plotters divides a font's size by 1.24 when it writes SVG.
    let font = (FAMILY, look.size * UNITS * 1.24, weight).into_font();
    TextStyle { color: RGBColor(r, g, b).to_backend_color(), ..TextStyle::from(font) }.pos(Pos::new(h, VPos::Center))
}

/// The face of a text, and its scale at this many pixels per px.
fn face(look: Type, density: f64) -> Option<(&'static FontRef<'static>, PxScale)> {
    let face = &FACES.as_ref()?[usize::from(look.bold)];
    // ab_glyph measures a font by its height, type by its em.
    let em = face.units_per_em()?;
    Some((face, PxScale::from((look.size * density) as f32 * face.height_unscaled() / em)))
}

/// Width of a text, px.
pub fn text_width(text: &str, look: Type) -> f64 {
    let Some((face, scale)) = face(look, 1.0) else { return 0.0 };
    let font = face.as_scaled(scale);
    let advance = |c| match font.glyph_id(c) {
        GlyphId(0) => Bitmap::of(c).advance() * look.size,
        glyph => f64::from(font.h_advance(glyph)),
    };
    text.chars().map(advance).sum()
}

impl<B: DrawingBackend> Canvas<B> {
    pub fn new(backend: B, target: Target) -> Result<Canvas<B>> {
        match *FACES {
            Some(_) => Ok(Canvas { backend, target }),
            None => Err("the built-in font does not load".to_owned()),
        }
    }

    pub fn finish(mut self) -> Result<()> {
        self.backend.present().map_err(|e| e.to_string())
    }

    /// An open line.
    pub fn path(&mut self, points: &[[f64; 2]], color: Rgb, width: f64) -> Result<()> {
        if self.target == Target::Bitmap && width * UNITS > 1.5 {
            return self.stroke(points, color, width);
        }
        let points: Vec<_> = points.iter().map(|p| units(*p)).collect();
        self.backend.draw_path(points, &style(color, width, false)).map_err(|e| e.to_string())
    }

    /// A line as a rectangle for each segment, with round joints.
    fn stroke(&mut self, points: &[[f64; 2]], color: Rgb, width: f64) -> Result<()> {
        for (i, pair) in points.windows(2).enumerate() {
            let ([x0, y0], [x1, y1]) = (pair[0], pair[1]);
            let length = (x1 - x0).hypot(y1 - y0);
            if length == 0.0 {
                continue;
            }
            let (dx, dy) = (0.5 * width * (y1 - y0) / length, -0.5 * width * (x1 - x0) / length);
            self.area(&[[x0 + dx, y0 + dy], [x1 + dx, y1 + dy], [x1 - dx, y1 - dy], [x0 - dx, y0 - dy]], color)?;
            if i > 0 && width > 1.0 {
                self.disk([x0, y0], 0.5 * width, color)?;
            }
        }
        Ok(())
    }

    fn disk(&mut self, center: [f64; 2], radius: f64, color: Rgb) -> Result<()> {
        let radius = (radius * UNITS).round() as u32;
        self.backend.draw_circle(units(center), radius, &style(color, 0.0, true), true).map_err(|e| e.to_string())
    }

    /// A line in dashes and gaps of these lengths; solid if there are none.
    pub fn dashed(&mut self, points: &[[f64; 2]], color: Rgb, width: f64, pattern: &[f64]) -> Result<()> {
        if pattern.is_empty() {
            return self.path(points, color, width);
        }
        for dash in dashes(points, pattern) {
            self.path(&dash, color, width)?;
        }
        Ok(())
    }

    pub fn rect(&mut self, [x0, y0, x1, y1]: [f64; 4], color: Rgb) -> Result<()> {
        let (a, b) = (units([x0, y0]), units([x1, y1]));
        self.backend.draw_rect(a, b, &style(color, 0.0, true), true).map_err(|e| e.to_string())
    }

    pub fn area(&mut self, points: &[[f64; 2]], color: Rgb) -> Result<()> {
        let points: Vec<_> = points.iter().map(|p| units(*p)).collect();
        self.backend.fill_polygon(points, &style(color, 0.0, true)).map_err(|e| e.to_string())
    }

    pub fn marker(&mut self, kind: Marker, [x, y]: [f64; 2], color: Rgb) -> Result<()> {
        let at = |dx: f64, dy: f64| [x + dx, y + dy];
        match kind {
            Marker::Circle => self.disk([x, y], 3.5, color),
            Marker::Square => self.rect([x - 3.1, y - 3.1, x + 3.1, y + 3.1], color),
            Marker::Triangle => self.area(&[at(-4.0, 3.2), at(4.0, 3.2), at(0.0, -4.2)], color),
            Marker::Diamond => self.area(&[at(-4.3, 0.0), at(0.0, 4.3), at(4.3, 0.0), at(0.0, -4.3)], color),
            Marker::Cross => {
                self.path(&[at(-3.2, -3.2), at(3.2, 3.2)], color, 1.8)?;
                self.path(&[at(-3.2, 3.2), at(3.2, -3.2)], color, 1.8)
            }
            Marker::Plus => {
                self.path(&[at(-4.2, 0.0), at(4.2, 0.0)], color, 1.8)?;
                self.path(&[at(0.0, -4.2), at(0.0, 4.2)], color, 1.8)
            }
        }
    }

    /// A text whose middle line runs through the point.
    pub fn text(&mut self, text: &str, at: [f64; 2], look: Type) -> Result<()> {
        match self.target {
            Target::Svg => self.backend.draw_text(text, &text_style(look), units(at)).map_err(|e| e.to_string()),
            Target::Bitmap => self.glyphs(text, at, look),
        }
    }

    fn glyphs(&mut self, text: &str, [x, y]: [f64; 2], look: Type) -> Result<()> {
        let Some((face, scale)) = face(look, UNITS) else { return Ok(()) };
        let start = match look.anchor {
            Anchor::Left => x,
            Anchor::Middle => x - 0.5 * text_width(text, look),
            Anchor::Right => x - text_width(text, look),
        };
        // The baseline is half the height of an x, .55 em in DejaVu, below the middle line; as SVG's 0.5ex.
        let (mut pen, base) = ((start * UNITS) as f32, ((y + 0.275 * look.size) * UNITS) as f32);
        let font = face.as_scaled(scale);
        for c in text.chars() {
            let id = font.glyph_id(c);
            if id == GlyphId(0) {
                let bitmap = Bitmap::of(c);
                let x = f64::from(pen) / UNITS - bitmap.back as f64 / 16.0 * look.size;
                let place = [x, f64::from(base) / UNITS];
                self.bitmap(&bitmap, place, look)?;
                pen += (bitmap.advance() * look.size * UNITS) as f32;
                continue;
            }
            let glyph = id.with_scale_and_position(scale, point(pen, base));
            pen += font.h_advance(glyph.id);
            if let Some(outline) = face.outline_glyph(glyph) {
                self.glyph(&outline, look.color)?;
            }
        }
        Ok(())
    }

    /// Draws a glyph whose line begins at a point, px.
    fn bitmap(&mut self, bitmap: &Bitmap, [x, y]: [f64; 2], look: Type) -> Result<()> {
        let pixel = look.size / 16.0;
        for (i, row) in bitmap.rows.iter().enumerate() {
            let top = y + (i as f64 - Bitmap::ASCENT) * pixel;
            let ink = |j: usize| j < 16 && row >> (15 - j) & 1 == 1;
            let mut from = 0;
            for j in 0..=16 {
                if ink(j) {
                    continue;
                }
                if j > from {
                    let [left, right] = [from, j].map(|j| x + j as f64 * pixel);
                    self.rect([left, top, right, top + pixel], look.color)?;
                }
                from = j + 1;
            }
        }
        Ok(())
    }

    fn glyph(&mut self, outline: &ab_glyph::OutlinedGlyph, rgb: Rgb) -> Result<()> {
        let (bounds, mut problem) = (outline.px_bounds(), None);
        outline.draw(|x, y, cover| {
            let at = (bounds.min.x as i32 + x as i32, bounds.min.y as i32 + y as i32);
            let color = RGBColor(rgb[0], rgb[1], rgb[2]).mix(f64::from(cover.min(1.0))).to_backend_color();
            if let Err(e) = self.backend.draw_pixel(at, color) {
                problem = Some(e.to_string());
            }
        });
        problem.map_or(Ok(()), Err)
    }
}

/// Cuts a line into dashes; `pattern` alternates dash and gap.
fn dashes(points: &[[f64; 2]], pattern: &[f64]) -> Vec<Vec<[f64; 2]>> {
    let (mut all, mut current) = (Vec::new(), Vec::new());
    let (mut index, mut left) = (0, pattern[0]);
    for pair in points.windows(2) {
        let ([x0, y0], [x1, y1]) = (pair[0], pair[1]);
        let length = (x1 - x0).hypot(y1 - y0);
        let point = |s: f64| [x0 + (x1 - x0) * s / length, y0 + (y1 - y0) * s / length];
        let mut done = 0.0;
        while length > 0.0 && done < length {
            if index % 2 == 0 && current.is_empty() {
                current.push(point(done));
            }
            let part = left.min(length - done);
            (done, left) = (done + part, left - part);
            if index % 2 == 0 {
                current.push(point(done));
            }
            if left <= 0.0 {
                if index % 2 == 0 {
                    all.push(std::mem::take(&mut current));
                }
                index = (index + 1) % pattern.len();
                left = pattern[index];
            }
        }
    }
    if current.len() > 1 {
        all.push(current);
    }
    all
}
