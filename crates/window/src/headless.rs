//! The interface without a window: egui's triangles drawn on the CPU.

use std::collections::HashMap;

use eframe::egui::epaint::{Mesh, Primitive, Vertex};
use eframe::egui::{self, TextureId};

use super::App;
use penny_view::paint::Image;

/// Draws an [`App`] into pictures.
pub struct Headless {
    ctx: egui::Context,
    textures: HashMap<TextureId, egui::ColorImage>,
    size: [usize; 2],
    time: f64,
}

impl Headless {
    pub fn new(width: usize, height: usize) -> Headless {
        let ctx = egui::Context::default();
        super::window::theme(&ctx);
        Headless { ctx, textures: HashMap::new(), size: [width, height], time: 0.0 }
    }

    /// The window's content after `elapsed` seconds and some events.
    pub fn frame(&mut self, app: &mut App, elapsed: f64, events: Vec<egui::Event>) -> Image {
        self.time += elapsed;
        let [width, height] = self.size;
        let screen = egui::Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(width as f32, height as f32));
        let input =
            egui::RawInput { screen_rect: Some(screen), time: Some(self.time), events, ..egui::RawInput::default() };
        let mut output = self.ctx.run_ui(input, |ui| app.ui(ui, elapsed));
        for (id, deltas) in std::mem::take(&mut output.textures_delta.set) {
            deltas.into_iter().for_each(|delta| self.update(id, delta));
        }
        let mut image = Image::new(width, height);
        let freed = std::mem::take(&mut output.textures_delta.free);
        for shape in self.ctx.tessellate(output.shapes, output.pixels_per_point) {
            if let Primitive::Mesh(mesh) = shape.primitive
                && let Some(texture) = self.textures.get(&mesh.texture_id)
            {
                draw(&mut image, &mesh, texture, &shape.clip_rect);
            }
        }
        for id in freed {
            self.textures.remove(&id);
        }
        image
    }

    fn update(&mut self, id: TextureId, delta: egui::epaint::ImageDelta) {
        let egui::ImageData::Color(part) = delta.image;
        match (delta.pos, self.textures.get_mut(&id)) {
            (Some([x, y]), Some(whole)) => {
                for row in 0..part.size[1] {
                    let to = (y + row) * whole.size[0] + x;
                    let from = row * part.size[0];
                    whole.pixels[to..to + part.size[0]].copy_from_slice(&part.pixels[from..from + part.size[0]]);
                }
            }
            _ => {
                self.textures.insert(id, (*part).clone());
            }
        }
    }
}

/// Draws textured triangles over the picture.
fn draw(image: &mut Image, mesh: &Mesh, texture: &egui::ColorImage, clip: &egui::Rect) {
    for corners in mesh.indices.chunks_exact(3) {
        let [a, b, c] = [0, 1, 2].map(|i| &mesh.vertices[corners[i] as usize]);
        triangle(image, [a, b, c], texture, clip);
    }
}

fn triangle(image: &mut Image, v: [&Vertex; 3], texture: &egui::ColorImage, clip: &egui::Rect) {
    let edge = |p: egui::Pos2, q: egui::Pos2, x: f32, y: f32| (q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x);
    let area = edge(v[0].pos, v[1].pos, v[2].pos.x, v[2].pos.y);
    if area == 0.0 || !area.is_finite() {
        return;
    }
    let low = |f: fn(egui::Pos2) -> f32| v.iter().map(|v| f(v.pos)).fold(f32::MAX, f32::min);
    let high = |f: fn(egui::Pos2) -> f32| v.iter().map(|v| f(v.pos)).fold(f32::MIN, f32::max);
    let x0 = low(|p| p.x).max(clip.min.x).max(0.0).floor() as usize;
    let y0 = low(|p| p.y).max(clip.min.y).max(0.0).floor() as usize;
    let x1 = (high(|p| p.x).min(clip.max.x).max(0.0).ceil() as usize).min(image.width);
    let y1 = (high(|p| p.y).min(clip.max.y).max(0.0).ceil() as usize).min(image.height);
    // A pixel on an edge that two triangles share belongs to the one that has it on its left.
    let weights = |x: usize, y: usize| {
        let (px, py) = (x as f32 + 0.5, y as f32 + 0.5);
        [edge(v[1].pos, v[2].pos, px, py), edge(v[2].pos, v[0].pos, px, py), edge(v[0].pos, v[1].pos, px, py)]
            .map(|w| w / area)
    };
    let inside = |x: usize, y: usize| {
        let (px, py) = (x as f32 + 0.5, y as f32 + 0.5);
        let clipped = px < clip.min.x || py < clip.min.y || px > clip.max.x || py > clip.max.y;
        !clipped && weights(x, y).iter().all(|w| *w >= 0.0)
    };
    let fill = Fill::of(v, texture);
    for y in y0..y1 {
        let Some((from, to)) = span([x0, x1], |x| weights(x, y), |x| inside(x, y)) else { continue };
        let row = &mut image.rgba[4 * (y * image.width + from)..4 * (y * image.width + to)];
        match fill {
            Fill::Plain(color) if color[3] == 255.0 => {
                let [r, g, b] = [0, 1, 2].map(|c| (color[c] + 0.5) as u8);
                row.chunks_exact_mut(4).for_each(|pixel| pixel[..3].copy_from_slice(&[r, g, b]));
            }
            Fill::Plain(color) => row.chunks_exact_mut(4).for_each(|pixel| blend(pixel, color)),
            Fill::Copy([ox, oy]) => {
                let [width, height] = texture.size;
                let line = (y as isize + oy).clamp(0, height as isize - 1) as usize;
                let line = &texture.pixels[line * width..(line + 1) * width];
                // A pixel at the rim may be half a texel beyond the texture.
                let column = |x: usize| (x as isize + ox).clamp(0, width as isize - 1) as usize;
                for (pixel, x) in row.chunks_exact_mut(4).zip(from..) {
                    let [r, g, b, a] = line[column(x)].to_array();
                    match a {
                        255 => pixel[..3].copy_from_slice(&[r, g, b]),
                        _ => blend(pixel, [r, g, b, a].map(f32::from)),
                    }
                }
            }
            Fill::Shaded => {
                for (pixel, x) in row.chunks_exact_mut(4).zip(from..) {
                    blend(pixel, shade(v, weights(x, y), texture));
                }
            }
        }
    }
}

/// What is in a triangle.
enum Fill {
    /// One colour: no texture, no gradient.
    Plain([f32; 4]),
    /// The texture's own pixels, moved by this many.
    Copy([isize; 2]),
    Shaded,
}

impl Fill {
    fn of(v: [&Vertex; 3], texture: &egui::ColorImage) -> Fill {
        let same_color = v[1..].iter().all(|p| p.color == v[0].color);
        if same_color && v[1..].iter().all(|p| p.uv == v[0].uv) {
            return Fill::Plain(shade(v, [1.0, 0.0, 0.0], texture));
        }
        // u = u₀ + (∂u/∂x) (x − x₀) + (∂u/∂y) (y − y₀), in texels; v likewise.
        let [d, e] = [1, 2].map(|i| v[i].pos - v[0].pos);
        let area = d.x * e.y - d.y * e.x;
        let (mut moved, mut copies) = ([0; 2], same_color && v[0].color == egui::Color32::WHITE);
        for axis in 0..2 {
            let texel = |i: usize| v[i].uv[axis] * texture.size[axis] as f32;
            let (a, b) = (texel(1) - texel(0), texel(2) - texel(0));
            let (along_x, along_y) = ((a * e.y - b * d.y) / area, (b * d.x - a * e.x) / area);
            let own = if axis == 0 { [along_x, along_y] } else { [along_y, along_x] };
            let shift = texel(0) - v[0].pos[axis];
            copies &= (own[0] - 1.0).abs() < 1e-4 && own[1].abs() < 1e-4 && (shift - shift.round()).abs() < 0.02;
            moved[axis] = shift.round() as isize;
        }
        if copies { Fill::Copy(moved) } else { Fill::Shaded }
    }
}

/// The pixels of a row that are inside: from … to. Found from the weights' zeros, then to the pixel.
fn span(
    [x0, x1]: [usize; 2],
    weights: impl Fn(usize) -> [f32; 3],
    inside: impl Fn(usize) -> bool,
) -> Option<(usize, usize)> {
    if x0 >= x1 {
        return None;
    }
    let (first, last) = (weights(x0), weights(x1 - 1));
    let n = (x1 - 1 - x0).max(1) as f32;
    let (mut from, mut to) = (0.0f32, n);
    for (a, b) in first.into_iter().zip(last) {
        match (a < 0.0, b < 0.0) {
            (true, true) => return None,
            (true, false) => from = from.max(n * a / (a - b)),
            (false, true) => to = to.min(n * a / (a - b)),
            (false, false) => {}
        }
    }
    let (mut from, mut to) = (x0 + (from as usize).saturating_sub(1), (x0 + to as usize + 2).min(x1));
    while from < to && !inside(from) {
        from += 1;
    }
    while to > from && !inside(to - 1) {
        to -= 1;
    }
    (from < to).then_some((from, to))
}

/// Colour (premultiplied, 0 to 255) of a point with weights `w`.
fn shade(v: [&Vertex; 3], w: [f32; 3], texture: &egui::ColorImage) -> [f32; 4] {
    let mix = |f: &dyn Fn(&Vertex) -> f32| w[0] * f(v[0]) + w[1] * f(v[1]) + w[2] * f(v[2]);
    let texel = sample(texture, mix(&|v| v.uv.x), mix(&|v| v.uv.y));
    [0, 1, 2, 3].map(|c| mix(&|v| f32::from(v.color.to_array()[c])) * texel[c] / 255.0)
}

/// The texture's colour between its four nearest texels.
fn sample(texture: &egui::ColorImage, u: f32, v: f32) -> [f32; 4] {
    let [width, height] = texture.size;
    let (x, y) = ((u * width as f32 - 0.5).max(0.0), (v * height as f32 - 0.5).max(0.0));
    let (i, j) = ((x as usize).min(width - 1), (y as usize).min(height - 1));
    let (fx, fy) = ((x - i as f32).clamp(0.0, 1.0), (y - j as f32).clamp(0.0, 1.0));
    let texel =
        |i: usize, j: usize| texture.pixels[j.min(height - 1) * width + i.min(width - 1)].to_array().map(f32::from);
    let (a, b, c, d) = (texel(i, j), texel(i + 1, j), texel(i, j + 1), texel(i + 1, j + 1));
    [0, 1, 2, 3].map(|k| (a[k] * (1.0 - fx) + b[k] * fx) * (1.0 - fy) + (c[k] * (1.0 - fx) + d[k] * fx) * fy)
}

/// Puts a premultiplied colour over a pixel.
fn blend(pixel: &mut [u8], color: [f32; 4]) {
    for c in 0..3 {
        let under = f32::from(pixel[c]) * (1.0 - color[3] / 255.0);
        pixel[c] = (color[c] + under + 0.5) as u8;
    }
}
