//! Every key in one list: what it does, and what the help says.

use eframe::egui::{self, Key};

use super::{App, Wish};
use penny_view::game::LEVELS;
use penny_view::stage::Held;

/// What a key does. Held keys act as long as they are down.
#[derive(Clone, Copy)]
enum Act {
    Push(f64, f64),
    Turn(f64),
    Do(fn(&mut App)),
    Select,
}

struct Binding {
    keys: &'static [Key],
    shown: &'static str,
    about: &'static str,
    act: Act,
}

const fn bind(keys: &'static [Key], shown: &'static str, about: &'static str, act: Act) -> Binding {
    Binding { keys, shown, about, act }
}

/// Entries without a text belong to the one before them.
const BINDINGS: &[Binding] = &[
    bind(
        &[Key::ArrowUp, Key::W],
        "arrows, W A S D",
        "push the selected body, as the camera sees it",
        Act::Push(0.0, 1.0),
    ),
    bind(&[Key::ArrowDown, Key::S], "", "", Act::Push(0.0, -1.0)),
    bind(&[Key::ArrowLeft, Key::A], "", "", Act::Push(-1.0, 0.0)),
    bind(&[Key::ArrowRight, Key::D], "Shift", "push and kick stronger", Act::Push(1.0, 0.0)),
    bind(&[Key::Space], "Space", "kick where you last pushed", Act::Do(|app| app.stage.kick(false))),
    bind(&[Key::C], "C", "chip: kick upwards as well", Act::Do(|app| app.stage.kick(true))),
    bind(&[Key::Q], "Q  E", "turn about the vertical", Act::Turn(1.0)),
    bind(&[Key::E], "", "", Act::Turn(-1.0)),
    bind(&[Key::P], "P", "pause", Act::Do(|app| app.stage.paused = !app.stage.paused)),
    bind(&[Key::Period], ".", "one step", Act::Do(one_step)),
    bind(&[Key::R], "R", "start again; in the game, the next pass", Act::Do(|app| app.stage.reset())),
    bind(
        &[Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6, Key::Num7, Key::Num8, Key::Num9],
        "1 … 9",
        "select a body",
        Act::Select,
    ),
    bind(&[Key::F], "F", "follow the selected body", Act::Do(follow)),
    bind(&[Key::Home], "Home", "look as at the start", Act::Do(|app| app.stage.home())),
    bind(&[Key::G], "G", "ghost: the same under another contact law", Act::Do(|app| app.stage.next_ghost())),
    bind(&[Key::X], "X", "contact points and forces", Act::Do(|app| app.stage.film.notes.contacts ^= true)),
    bind(&[Key::V], "V", "velocity arrows", Act::Do(|app| app.stage.film.notes.velocity ^= true)),
    bind(&[Key::B], "B", "push arrows", Act::Do(|app| app.stage.film.notes.pushes ^= true)),
    bind(&[Key::T], "T", "trails", Act::Do(|app| app.stage.film.notes.trail ^= true)),
    bind(&[Key::Minus], "−  +", "slow motion and fast forward", Act::Do(|app| speed(app, 0.5))),
    bind(&[Key::Plus, Key::Equals], "", "", Act::Do(|app| speed(app, 2.0))),
    bind(&[Key::L], "L", "the game's next level", Act::Do(next_level)),
    bind(&[Key::H], "H", "hide panel and plots", Act::Do(|app| app.panel ^= true)),
    bind(
        &[Key::F5],
        "F5",
        "save this session, to replay it bit for bit",
        Act::Do(|app| app.wish = Some(Wish::SaveRun)),
    ),
    bind(&[Key::F9], "F9", "film the picture; again to stop", Act::Do(|app| app.film())),
    bind(&[Key::F1], "F1", "this help", Act::Do(|app| app.help ^= true)),
    // The window itself closes.
    bind(&[], "Ctrl+Q", "close", Act::Select),
];

/// The keys that one needs first, on the first screen.
pub const FIRST: &str = "arrows push · Shift stronger · Space kicks · C chips · R again · P pause · F1 all keys";

/// What the mouse does, for the help.
const MOUSE: &[(&str, &str)] = &[
    ("drag a body", "pull it with a spring"),
    ("drag elsewhere", "turn the camera"),
    ("right drag", "move the camera"),
    ("wheel", "nearer and farther"),
];

/// Does what the keys say in this frame.
pub fn read(app: &mut App, ctx: &egui::Context) {
    if ctx.egui_wants_keyboard_input() || ctx.input(|i| i.modifiers.command) {
        app.stage.hold(Held::default());
        return;
    }
    let mut held = Held { strong: ctx.input(|i| i.modifiers.shift), ..Held::default() };
    let mut pressed = Vec::new();
    ctx.input(|input| {
        for binding in BINDINGS {
            let down = binding.keys.iter().any(|k| input.key_down(*k) || input.key_pressed(*k));
            match binding.act {
                Act::Push(right, forward) if down => {
                    (held.right, held.forward) = (held.right + right, held.forward + forward)
                }
                Act::Turn(turn) if down => held.turn += turn,
                Act::Do(act) if binding.keys.iter().any(|k| input.key_pressed(*k)) => pressed.push(act),
                _ => {}
            }
        }
    });
    app.hint &= held == Held::default() && pressed.is_empty();
    app.stage.hold(held);
    if let Some(n) = number(ctx) {
        app.stage.select(n);
    }
    for act in pressed {
        act(app);
    }
}

fn number(ctx: &egui::Context) -> Option<usize> {
    let keys = BINDINGS.iter().find(|b| matches!(b.act, Act::Select))?.keys;
    ctx.input(|i| keys.iter().position(|k| i.key_pressed(*k))).map(|i| i + 1)
}

fn one_step(app: &mut App) {
    app.stage.paused = true;
    app.stage.step();
}

fn follow(app: &mut App) {
    let stage = &mut app.stage;
    let body = stage.film.follow.is_none().then_some(stage.controls.body).filter(|&b| b > 0);
    stage.film.set_follow(&stage.session, body);
}

fn speed(app: &mut App, factor: f64) {
    app.stage.clock.speed = (app.stage.clock.speed * factor).clamp(0.01, 100.0);
}

fn next_level(app: &mut App) {
    if let Some(game) = &app.stage.game {
        app.wish = Some(Wish::Level((game.level + 1) % LEVELS.len()));
    }
}

/// The overlay that lists all keys.
pub fn help(app: &mut App, ctx: &egui::Context) {
    let mut open = true;
    let window = egui::Window::new("Keys").open(&mut open).collapsible(false).resizable(false);
    window.anchor(egui::Align2::CENTER_CENTER, [0.0, 0.0]).show(ctx, |ui| {
        egui::Grid::new("keys").num_columns(2).spacing([24.0, 5.0]).show(ui, |ui| {
            let keys = BINDINGS.iter().filter(|b| !b.shown.is_empty()).map(|b| (b.shown, b.about));
            for (keys, about) in keys.chain(MOUSE.iter().copied()) {
                ui.strong(keys);
                ui.label(about);
                ui.end_row();
            }
        });
        if app.stage.game.is_some() {
            ui.separator();
            ui.label(penny_view::game::scoring());
        }
    });
    app.help = open;
}
