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
    for y in y0..y1 {
        for x in x0..x1 {
            let (px, py) = (x as f32 + 0.5, y as f32 + 0.5);
            // A pixel on an edge that two triangles share belongs to the one that has it on its left.
            let w =
                [edge(v[1].pos, v[2].pos, px, py), edge(v[2].pos, v[0].pos, px, py), edge(v[0].pos, v[1].pos, px, py)]
                    .map(|w| w / area);
            if w.iter().any(|w| *w < 0.0) || px < clip.min.x || py < clip.min.y || px > clip.max.x || py > clip.max.y {
                continue;
            }
            blend(image, x, y, shade(v, w, texture));
        }
    }
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

fn blend(image: &mut Image, x: usize, y: usize, color: [f32; 4]) {
    let at = 4 * (y * image.width + x);
    for c in 0..3 {
        let under = f32::from(image.rgba[at + c]) * (1.0 - color[3] / 255.0);
        image.rgba[at + c] = (color[c] + under + 0.5) as u8;
    }
}
