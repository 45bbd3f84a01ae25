//! The 3-D picture in the window, and the mouse on it.

use std::sync::Arc;

use eframe::egui::{self, PointerButton};

use super::App;
use penny::math::Vec3;
use penny_view::controls::Grab;
use penny_view::draw::DrawList;
use penny_view::paint::{Image, Painter};
use penny_view::pick;

/// What a drag of the mouse's left button does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Drag {
    None,
    Orbit,
    /// Pulls a body in the plane through its point that faces the camera.
    Pull {
        body: usize,
        point: Vec3,
        depth: f64,
    },
}

/// rad per point
const ORBIT: f64 = 0.008;

/// Draws the picture into all that is left of the window and returns where that is.
pub fn show(app: &mut App, ui: &mut egui::Ui, elapsed: f64) -> egui::Rect {
    let rect = ui.available_rect_before_wrap();
    let response = ui.allocate_rect(rect, egui::Sense::click_and_drag());
    let scale = ui.ctx().pixels_per_point();
    let pixels = [(rect.width() * scale).round().max(1.0) as usize, (rect.height() * scale).round().max(1.0) as usize];
    mouse(app, ui, &response);
    let list = app.stage.draw();
    app.screen.show(ui, rect, pixels, &list);
    if let Some(shooting) = &mut app.shooting {
        shooting.offer(&list, &app.screen.image, elapsed);
    }
    rect
}

/// The 3-D picture on its way to the screen; all that can be used again is.
pub struct Screen {
    painter: Painter,
    image: Image,
    /// What egui was given; it lets go of it before the next frame.
    pixels: Arc<egui::ColorImage>,
    texture: Option<egui::TextureHandle>,
}

impl Screen {
    pub fn new() -> Screen {
        let threads = std::thread::available_parallelism().map_or(1, |n| n.get().min(4));
        Screen { painter: Painter::new(threads), image: Image::new(0, 0), pixels: Arc::default(), texture: None }
    }

    /// Pixels of the picture last shown.
    pub fn size(&self) -> [usize; 2] {
        [self.image.width, self.image.height]
    }

    fn show(&mut self, ui: &egui::Ui, rect: egui::Rect, size: [usize; 2], list: &DrawList) {
        if self.size() != size {
            self.image = Image::new(size[0], size[1]);
            self.pixels = Arc::new(egui::ColorImage::filled(size, egui::Color32::WHITE));
        }
        self.painter.paint(list, &mut self.image);
        let colors = self.image.rgba.as_chunks().0.iter().map(|[r, g, b, _]| egui::Color32::from_rgb(*r, *g, *b));
        Arc::make_mut(&mut self.pixels).pixels.iter_mut().zip(colors).for_each(|(pixel, color)| *pixel = color);
        let options = egui::TextureOptions::NEAREST;
        let texture = match &mut self.texture {
            Some(texture) => {
                texture.set(self.pixels.clone(), options);
                texture
            }
            none => none.insert(ui.ctx().load_texture("scene", self.pixels.clone(), options)),
        };
        let whole = egui::Rect::from_min_max(egui::pos2(0.0, 0.0), egui::pos2(1.0, 1.0));
        ui.painter().image(texture.id(), rect, whole, egui::Color32::WHITE);
    }
}

fn mouse(app: &mut App, ui: &egui::Ui, response: &egui::Response) {
    let size = [f64::from(response.rect.width()), f64::from(response.rect.height())];
    let at = response.interact_pointer_pos().map(|p| {
        let p = p - response.rect.min;
        [f64::from(p.x), f64::from(p.y)]
    });
    let delta = response.drag_delta();
    let (dx, dy) = (f64::from(delta.x), f64::from(delta.y));
    if response.drag_started_by(PointerButton::Primary) {
        app.drag = at.map_or(Drag::None, |at| take_hold(app, at, size));
    }
    if response.dragged_by(PointerButton::Primary) {
        match app.drag {
            Drag::Orbit => app.stage.film.camera.orbit(-dx * ORBIT, dy * ORBIT),
            Drag::Pull { body, point, depth } => {
                if let Some(at) = at {
                    let to = reach(app, at, size, depth);
                    app.stage.grab(Some(Grab { body, point, to }));
                }
            }
            Drag::None => {}
        }
    } else if app.drag != Drag::None {
        app.drag = Drag::None;
        app.stage.grab(None);
    }
    if response.dragged_by(PointerButton::Secondary) || response.dragged_by(PointerButton::Middle) {
        app.stage.film.camera.pan(-dx / size[1], dy / size[1]);
    }
    if response.hovered() {
        let (scroll, pinch) = ui.input(|i| (f64::from(i.smooth_scroll_delta().y), f64::from(i.zoom_delta())));
        app.stage.film.camera.zoom((-scroll * 0.0025).exp() / pinch);
    }
    // Where the eye may not go, the mouse does not lead it.
    let film = &mut app.stage.film;
    if let Some(floor) = film.floor {
        film.camera.stay_above(floor);
    }
}

/// A body under the mouse is pulled, anything else turns the camera.
fn take_hold(app: &mut App, at: [f64; 2], size: [f64; 2]) -> Drag {
    let stage = &app.stage;
    let poses = stage.session.poses(1.0);
    let camera = stage.film.eye(&poses.pos);
    let Some(hit) = pick::pick(&stage.session.model, &poses, &camera, at, size) else { return Drag::Orbit };
    let point = poses.quat[hit.body].inverse() * (hit.point - poses.pos[hit.body]);
    let depth = camera.axes().forward.dot(&(hit.point - camera.axes().eye));
    Drag::Pull { body: hit.body, point, depth }
}

/// The point under the mouse at a depth.
fn reach(app: &App, at: [f64; 2], size: [f64; 2], depth: f64) -> Vec3 {
    let camera = app.stage.film.eye(&app.stage.session.poses(1.0).pos);
    let (origin, direction) = camera.ray(at, size);
    origin + direction * (depth / direction.dot(&camera.axes().forward))
}
