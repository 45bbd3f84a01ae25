//! The side panel: the method and the numbers of the physics, changeable while it runs.

use eframe::egui::{self, RichText};

use super::{App, Wish, color};
use penny::{contact, integrate};
use penny_view::log::Change;
use penny_view::scene;

pub const WIDTH: f32 = 300.0;
/// m
const FIRST_ACCURACY: f64 = 1e-4;
const ACCURACY: &str = "split every step into steps of controlled size, none of which errs by more";

pub fn show(app: &mut App, ui: &mut egui::Ui) {
    ui.add_space(6.0);
    title(app, ui);
    ui.separator();
    ui.spacing_mut().slider_width = 78.0;
    method(app, ui);
    ui.separator();
    physics(app, ui);
    ui.separator();
    speed(app, ui);
    ui.separator();
    notes(app, ui);
    ui.separator();
    files(app, ui);
}

fn title(app: &mut App, ui: &mut egui::Ui) {
    let stage = &mut app.stage;
    let name = if stage.session.model.name.is_empty() { "scene" } else { &stage.session.model.name };
    ui.label(RichText::new(name).size(18.0).strong());
    ui.horizontal(|ui| {
        if ui.button(if stage.paused { "run" } else { "pause" }).clicked() {
            stage.paused ^= true;
        }
        if ui.button("one step").clicked() {
            stage.paused = true;
            stage.step();
        }
        if ui.button("again").clicked() {
            stage.reset();
        }
        ui.label(format!("{:.2} s", stage.session.state.time));
    });
}

fn method(app: &mut App, ui: &mut egui::Ui) {
    let stage = &mut app.stage;
    let method = stage.session.method;
    let mut changes = Vec::new();
    egui::Grid::new("method").num_columns(2).spacing([10.0, 5.0]).show(ui, |ui| {
        ui.label("contact law");
        choice(ui, "law", method.contact.name, contact::ALL.iter().map(|l| (l.name, l.about)), |name| {
            changes.push(Change::Contact(name.to_owned()));
        });
        ui.end_row();
        ui.label("ghost");
        let ghost = stage.ghost.as_ref().map_or("none", |g| g.method.contact.name);
        let others = contact::ALL.iter().map(|l| (l.name, l.about)).filter(|l| l.0 != method.contact.name);
        let mut wanted = None;
        choice(ui, "ghost", ghost, std::iter::once(("none", "only one law")).chain(others), |name| wanted = Some(name));
        ui.end_row();
        ui.label("integrator");
        choice(ui, "integrator", method.integrator.name, integrate::ALL.iter().map(|i| (i.name, i.about)), |name| {
            changes.push(Change::Integrator(name.to_owned()));
        });
        ui.end_row();
        ui.label("timestep");
        let mut h = method.timestep * 1e3;
        let slider = egui::Slider::new(&mut h, 0.05..=50.0).logarithmic(true).suffix(" ms");
        if ui.add(slider).changed() {
            changes.push(Change::Timestep(h * 1e-3));
        }
        ui.end_row();
        ui.label("accuracy");
        ui.horizontal(|ui| {
            let accuracy = stage.session.accuracy();
            let mut controlled = accuracy > 0.0;
            let mut wanted = if controlled { accuracy } else { FIRST_ACCURACY };
            if ui.checkbox(&mut controlled, "").on_hover_text(ACCURACY).changed() {
                // By the integrator there is, if it estimates its error.
                if let Some(other) = integrate::controllable(method.integrator).filter(|_| controlled) {
                    changes.push(Change::Integrator(other.name.to_owned()));
                }
                changes.push(Change::Accuracy(if controlled { FIRST_ACCURACY } else { 0.0 }));
            }
            let slider = egui::Slider::new(&mut wanted, 1e-9..=1e-2).logarithmic(true);
            let slider = slider.custom_formatter(|x, _| format!("{x:.0e} m"));
            if ui.add_enabled(controlled, slider).changed() {
                changes.push(Change::Accuracy(wanted));
            }
        });
        ui.end_row();
        if let Some(name) = wanted {
            stage.set_ghost(Some(name).filter(|n| *n != "none"));
        }
    });
    changes.into_iter().for_each(|change| stage.change(change));
}

fn physics(app: &mut App, ui: &mut egui::Ui) {
    let stage = &mut app.stage;
    let model = &stage.session.model;
    let mut changes = Vec::new();
    egui::Grid::new("physics").num_columns(2).spacing([10.0, 5.0]).show(ui, |ui| {
        ui.label("gravity");
        let mut g = model.opt.gravity;
        if ui.add(egui::Slider::new(&mut g.z, -25.0..=5.0).suffix(" m/s²")).changed() {
            changes.push(Change::Gravity(g.into()));
        }
        ui.end_row();
        let Some(mix) = model.mixes.first() else { return };
        let (mut solref, [mut slide, _, mut spin, mut roll, _]) = (mix.solref, mix.friction);
        let mut changed = false;
        changed |= springs(ui, &mut solref);
        if changed {
            changes.push(Change::Solref(solref));
        }
        changed = false;
        ui.label("friction: sliding");
        changed |= ui.add(egui::Slider::new(&mut slide, 0.0..=2.0)).changed();
        ui.end_row();
        ui.label("… torsional");
        changed |= ui
            .add(egui::Slider::new(&mut spin, 0.0..=0.1).logarithmic(true).smallest_positive(1e-5).suffix(" m"))
            .changed();
        ui.end_row();
        ui.label("… rolling");
        changed |= ui
            .add(egui::Slider::new(&mut roll, 0.0..=0.1).logarithmic(true).smallest_positive(1e-5).suffix(" m"))
            .changed();
        ui.end_row();
        if changed {
            changes.push(Change::Friction([slide, spin, roll]));
        }
    });
    changes.into_iter().for_each(|change| stage.change(change));
}

/// Sliders of solref in the form that the scene has: time and ratio, or −k and −c for a unit of mass.
fn springs(ui: &mut egui::Ui, solref: &mut [f64; 2]) -> bool {
    let direct = solref[0] <= 0.0;
    let rows: [(&str, f64, std::ops::RangeInclusive<f64>, &str); 2] = if direct {
        [("solref: stiffness", -solref[0], 1.0..=1e6, " /s²"), ("… damping", -solref[1], 0.0..=1e4, " /s")]
    } else {
        [("solref: time", solref[0], 0.002..=0.2, " s"), ("… damping ratio", solref[1], 0.05..=5.0, "")]
    };
    let mut changed = false;
    for (i, (name, mut value, range, unit)) in rows.into_iter().enumerate() {
        ui.label(name);
        let slider = egui::Slider::new(&mut value, range).logarithmic(true).smallest_positive(1e-3).suffix(unit);
        // A number of the scene beyond the slider's ends stays what it is.
        let slider = slider.clamping(egui::SliderClamping::Edits);
        if ui.add(slider).changed() {
            solref[i] = if direct { -value } else { value };
            changed = true;
        }
        ui.end_row();
    }
    changed
}

fn speed(app: &mut App, ui: &mut egui::Ui) {
    let stage = &mut app.stage;
    ui.horizontal(|ui| {
        ui.label("speed");
        ui.add(egui::Slider::new(&mut stage.clock.speed, 0.01..=100.0).logarithmic(true).suffix(" ×"));
    });
    let pace = stage.pace;
    // A film is drawn without a clock.
    if pace.step > 0.0 {
        ui.label(format!("step {:.2} µs · runs at {:.2} × real time", pace.step * 1e6, pace.factor));
    }
}

fn notes(app: &mut App, ui: &mut egui::Ui) {
    let stage = &mut app.stage;
    let body = stage.controls.body;
    let selected = if body > 0 { format!("selected: {}", stage.name(body)) } else { "nothing moves".to_owned() };
    let notes = &mut stage.film.notes;
    egui::Grid::new("notes").num_columns(2).spacing([14.0, 4.0]).show(ui, |ui| {
        ui.checkbox(&mut notes.contacts, "contacts");
        ui.horizontal(|ui| {
            legend(ui, scene::NORMAL_FORCE, "normal");
            legend(ui, scene::FRICTION_FORCE, "friction");
        });
        ui.end_row();
        ui.checkbox(&mut notes.velocity, "velocity");
        legend(ui, scene::VELOCITY, "");
        ui.end_row();
        ui.checkbox(&mut notes.pushes, "pushes");
        legend(ui, scene::APPLIED_FORCE, "");
        ui.end_row();
        ui.checkbox(&mut notes.trail, "trails");
        ui.label(selected);
        ui.end_row();
    });
}

/// A patch of an arrow's colour, and what it stands for.
fn legend(ui: &mut egui::Ui, of: [f32; 4], name: &str) {
    let (rect, _) = ui.allocate_exact_size(egui::vec2(18.0, 6.0), egui::Sense::hover());
    ui.painter().rect_filled(rect, 2.0, color(of));
    ui.label(name);
}

fn files(app: &mut App, ui: &mut egui::Ui) {
    ui.horizontal(|ui| {
        let filming = app.shooting.is_some();
        if ui.button(if filming { "stop filming" } else { "film" }).clicked() {
            app.film();
        }
        if ui.button("save session").clicked() {
            app.wish = Some(Wish::SaveRun);
        }
        if ui.button("keys (F1)").clicked() {
            app.help ^= true;
        }
    });
}

/// A drop-down list; `chosen` is called with a name that differs from `now`.
fn choice(
    ui: &mut egui::Ui,
    id: &str,
    now: &str,
    names: impl Iterator<Item = (&'static str, &'static str)>,
    mut chosen: impl FnMut(&'static str),
) {
    egui::ComboBox::from_id_salt(id).width(140.0).selected_text(now).show_ui(ui, |ui| {
        for (name, about) in names {
            if ui.selectable_label(name == now, name).on_hover_text(about).clicked() && name != now {
                chosen(name);
            }
        }
    });
}
