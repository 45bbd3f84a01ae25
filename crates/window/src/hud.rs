//! Words over the picture: what happened, the score, and the physics of a shot.

use eframe::egui::{self, Color32, RichText};

use super::{App, keys};
use penny_view::game::{LEVELS, Outcome, ROUND};

pub fn show(app: &App, ui: &mut egui::Ui, rect: egui::Rect) {
    let ctx = ui.ctx().clone();
    let stage = &app.stage;
    if !stage.message.is_empty() {
        card(&ctx, "message", rect.left_top() + egui::vec2(12.0, 12.0), |ui| {
            ui.label(RichText::new(&stage.message).size(15.0).strong());
        });
    }
    if app.hint {
        card(&ctx, "hint", rect.left_top() + egui::vec2(12.0, 52.0), |ui| {
            ui.label(keys::FIRST);
        });
    }
    if let Some(game) = &stage.game {
        let level = LEVELS[game.level];
        card(&ctx, "score", egui::pos2(rect.right() - 218.0, rect.top() + 12.0), |ui| {
            ui.set_width(190.0);
            ui.label(RichText::new(format!("{} points", game.points)).size(20.0).strong());
            ui.label(format!("{} of {} shots in · level {}", game.goals, game.played(), level.name));
            let at = game.rules.distance(&game.rules.centre(&stage.session));
            let fair = game.rules.may_push(&game.rules.centre(&stage.session));
            let color = if fair { Color32::from_rgb(30, 120, 50) } else { Color32::from_rgb(190, 40, 40) };
            let place = if at < 0.0 { "past" } else { "to" };
            let time = game.time(&stage.session).min(ROUND);
            ui.colored_label(color, format!("{:.2} m {place} the line · {time:.1} of {ROUND} s", at.abs()));
            if let Some(best) = app.best.first() {
                ui.weak(format!("best: {} points in {:.1} s", best.points, best.time));
            }
        });
    }
    if !stage.shots.is_empty() {
        shots(app, &ctx, rect);
    }
    if stage.pace.late && !stage.paused {
        card(&ctx, "late", egui::pos2(rect.left() + 12.0, rect.bottom() - 44.0), |ui| {
            ui.colored_label(
                Color32::from_rgb(190, 40, 40),
                format!("too slow for this machine: runs at {:.2} × real time", stage.pace.factor),
            );
        });
    }
}

/// After a shot: the same kick under every law.
fn shots(app: &App, ctx: &egui::Context, rect: egui::Rect) {
    let rows = app.stage.shots.len() as f32;
    let at = egui::pos2(rect.left() + 12.0, rect.bottom() - 74.0 - 20.0 * rows);
    card(ctx, "shots", at, |ui| {
        let impulse = app.stage.shots[0].balance.impulse.norm();
        ui.strong(format!("your pushes: {impulse:.2} N s; the same under each law, and the energy lost:"));
        egui::Grid::new("shots").num_columns(7).spacing([14.0, 3.0]).show(ui, |ui| {
            for title in ["law", "outcome", "after", "fastest", "sliding", "rolling", "other"] {
                ui.weak(title);
            }
            ui.end_row();
            for shot in &app.stage.shots {
                ui.label(shot.law);
                let color =
                    if shot.outcome == Outcome::Goal { Color32::from_rgb(30, 120, 50) } else { Color32::DARK_GRAY };
                ui.colored_label(color, shot.outcome.name());
                ui.label(format!("{:.3} s", shot.time));
                ui.label(format!("{:.2} m/s", shot.fastest));
                let balance = &shot.balance;
                for lost in [balance.sliding, balance.rolling + balance.spinning, balance.other()] {
                    // Adding zero turns a rounded −0 into 0.
                    ui.label(format!("{:.3} J", (lost * 1e3).round() / 1e3 + 0.0));
                }
                ui.end_row();
            }
        });
    });
}

fn card(ctx: &egui::Context, name: &str, at: egui::Pos2, content: impl FnOnce(&mut egui::Ui)) {
    egui::Area::new(egui::Id::unique(name)).fixed_pos(at).interactable(false).show(ctx, |ui| {
        let fill = Color32::from_rgba_unmultiplied(255, 255, 255, 225);
        ui.style_mut().wrap_mode = Some(egui::TextWrapMode::Extend);
        egui::Frame::new().fill(fill).corner_radius(6.0).inner_margin(egui::Margin::symmetric(10, 6)).show(ui, content);
    });
}
