//! The live plots under the picture.

use eframe::egui;
use egui_plot::{Legend, Line, Plot, PlotPoints};

use super::App;
use penny_view::history::PLOTS;

pub const HEIGHT: f32 = 190.0;
const COLORS: [egui::Color32; 3] = [
    egui::Color32::from_rgb(38, 104, 196),
    egui::Color32::from_rgb(214, 110, 28),
    egui::Color32::from_rgb(140, 75, 185),
];
/// Time that a plot shows, s.
const SPAN: f64 = 6.0;

/// Width below which nothing is plotted, points.
const NARROW: f32 = 100.0;

pub fn show(app: &mut App, ui: &mut egui::Ui) {
    if ui.available_width() < NARROW {
        return;
    }
    ui.columns(2, |columns| {
        for (slot, ui) in columns.iter_mut().enumerate() {
            choose(app, ui, slot);
            plot(app, ui, slot);
        }
    });
}

fn choose(app: &mut App, ui: &mut egui::Ui, slot: usize) {
    ui.horizontal(|ui| {
        for (i, plot) in PLOTS.iter().enumerate() {
            ui.selectable_value(&mut app.plots[slot], i, plot.name);
        }
    });
}

fn plot(app: &App, ui: &mut egui::Ui, slot: usize) {
    let plot = &PLOTS[app.plots[slot]];
    let moments = &app.stage.history.moments;
    let now = moments.back().map_or(0.0, |m| m.time);
    let from = (now - SPAN).max(0.0);
    let widget = Plot::new(("plot", slot, plot.name))
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .show_background(false)
        .show_crosshair(false)
        .grid_color(egui::Color32::from_gray(205))
        .grid_fade(0.6)
        .set_margin_fraction(egui::vec2(0.0, 0.1))
        .include_x(from)
        .include_x(from + SPAN)
        .include_y(0.0)
        .y_axis_label(plot.unit)
        .legend(Legend::default().position(egui_plot::Corner::LeftTop));
    widget.show(ui, |ui| {
        for (line, color) in plot.lines.iter().zip(COLORS) {
            let shown = moments.iter().filter(|m| m.time >= from);
            let points: Vec<[f64; 2]> = shown.filter_map(|m| Some([m.time, (line.of)(m)?])).collect();
            if !points.is_empty() {
                ui.line(Line::new(line.name, PlotPoints::new(points)).color(color).width(1.6));
            }
        }
    });
}
