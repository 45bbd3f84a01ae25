//! The interface on a [`Stage`]: keys, mouse, panels and plots, in egui. The same code draws the window and, on the
//! CPU, the pictures of `penny render --panel`.

mod camera_shot;
pub mod headless;
mod hud;
pub mod keys;
mod panel;
mod plots;
mod view;
pub mod window;

use std::io::Write;
use std::path::PathBuf;
use std::time::Duration;

pub use eframe::egui;

use camera_shot::Shooting;
use penny_view::game::{self, best};
use penny_view::stage::Stage;

/// Everything that the interface remembers.
pub struct App {
    pub stage: Stage,
    pub help: bool,
    /// The keys that one needs first are named, until one is pressed.
    pub hint: bool,
    pub panel: bool,
    /// The plots shown, as indices into [`penny_view::history::PLOTS`].
    plots: [usize; 2],
    screen: view::Screen,
    /// The body that the mouse turned the camera instead of holding, or holds at a depth.
    drag: view::Drag,
    shooting: Option<Shooting>,
    best: Vec<best::Entry>,
    /// Goals already entered into the list.
    entered: u64,
    /// What only the one who owns files can do, asked for by a key.
    pub wish: Option<Wish>,
}

/// What the interface cannot do itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wish {
    SaveRun,
    /// Another level of the game, as an index into its list.
    Level(usize),
}

/// The longest that a frame may compute steps: what is left of a sixtieth of a second after drawing.
const BUDGET: Duration = Duration::from_millis(9);

impl App {
    pub fn new(stage: Stage) -> App {
        App {
            stage,
            help: false,
            hint: false,
            panel: true,
            plots: [0, 2],
            screen: view::Screen::new(),
            drag: view::Drag::None,
            shooting: None,
            best: best::path().map(|path| best::load(&path)).unwrap_or_default(),
            entered: 0,
            wish: None,
        }
    }

    /// One frame: input, the steps that are due after `elapsed` seconds, then the picture.
    pub fn ui(&mut self, ui: &mut egui::Ui, elapsed: f64) {
        keys::read(self, ui.ctx());
        self.stage.tick(elapsed, BUDGET);
        self.enter_goal();
        if self.panel {
            egui::Panel::right("panel").exact_size(panel::WIDTH).resizable(false).show(ui, |ui| panel::show(self, ui));
            egui::Panel::bottom("plots")
                .exact_size(plots::HEIGHT)
                .resizable(false)
                .show(ui, |ui| plots::show(self, ui));
        }
        egui::CentralPanel::no_frame().show(ui, |ui| {
            let rect = view::show(self, ui, elapsed);
            hud::show(self, ui, rect);
        });
        if self.help {
            keys::help(self, ui.ctx());
        }
    }

    /// Starts or stops filming the picture into a file.
    pub fn film(&mut self) {
        match self.shooting.take() {
            Some(shooting) => self.stage.message = shooting.finish(),
            None => match Shooting::start(self.screen.size()) {
                Ok(shooting) => {
                    self.stage.message = format!("filming into {}", shooting.path.display());
                    self.shooting = Some(shooting);
                }
                Err(problem) => self.stage.message = problem,
            },
        }
    }

    /// Ends what is still being written.
    pub fn close(&mut self) {
        if let Some(shooting) = self.shooting.take() {
            say(&shooting.finish());
        }
    }

    /// A new goal goes into the best-of list.
    fn enter_goal(&mut self) {
        let Some(game) = self.stage.game.as_ref().filter(|g| g.goals > self.entered) else { return };
        self.entered = game.goals;
        let entry = best::Entry {
            points: game.worth(),
            level: game::LEVELS[game.level].name.to_owned(),
            time: game.time(&self.stage.session),
            law: self.stage.session.method.contact.name.to_owned(),
            seed: game.seed,
        };
        let place = best::insert(&mut self.best, entry);
        let saved = best::path().map(|path| best::save(&path, &self.best));
        if let (Some(place), Some(Ok(()))) = (place, saved) {
            self.stage.message += &format!("; number {} of your best", place + 1);
        }
    }
}

/// The first name of that kind which is not taken: `penny-1.gif`, `penny-2.gif` …
pub fn free_name(stem: &str, ending: &str) -> PathBuf {
    let name = |n: usize| PathBuf::from(format!("{stem}-{n}.{ending}"));
    (1..).map(name).find(|path| !path.exists()).unwrap_or_else(|| name(0))
}

fn color(c: [f32; 4]) -> egui::Color32 {
    let byte = |v: f32| (v * 255.0).round() as u8;
    egui::Color32::from_rgb(byte(c[0]), byte(c[1]), byte(c[2]))
}

/// A line for people. Where standard error is closed or full, nobody is left to be told.
fn say(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}
