//! The window: owns the files (scene, recorded inputs) and gives the rest to [`App`].

use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::SystemTime;

use eframe::egui;

use super::{App, Wish, free_name, say};
use penny::mjcf::Limits;
use penny_view::game::LEVELS;
use penny_view::open;
use penny_view::session::Session;
use penny_view::stage::Stage;

/// What a window is opened with.
pub struct Open {
    pub path: PathBuf,
    pub stage: Stage,
    /// Files that the scene was read from.
    pub files: Vec<PathBuf>,
    /// What the scene may take when it is read again.
    pub limits: Limits,
    /// Where the session's inputs go when the window is closed.
    pub record: Option<PathBuf>,
    /// What else is done then.
    ///
    /// Errors: one sentence, with which the program ends.
    pub last: Option<Last>,
}

/// Done with the session when the window is closed.
pub type Last = Box<dyn Fn(&Session) -> Result<(), String>>;

struct Window {
    app: App,
    path: PathBuf,
    limits: Limits,
    /// Steps that the record has.
    recorded: u64,
    /// When it was written, s.
    kept: f64,
    record: Option<PathBuf>,
    last: Option<Last>,
    /// What could not be written in the end.
    unwritten: Rc<RefCell<Vec<String>>>,
    watched: Vec<(PathBuf, Option<SystemTime>)>,
    looked: f64,
    /// Frames shown, and for how long, s.
    frames: u64,
    shown: f64,
    /// The report of a scene that could not be reloaded.
    problem: Option<String>,
}

/// The scene's file is looked at this often, s.
const LOOK: f64 = 0.25;
/// Run-time libraries of the window, as Debian names them.
const LIBRARIES: &str = "libx11-6 libx11-xcb1 libxcursor1 libxi6 libxkbcommon0 libxkbcommon-x11-0 libgl1 libegl1";

/// Opens the window and returns when it is closed.
///
/// Errors: one sentence that says what is missing and names the way without a window, or what could not be written in the end.
pub fn run(open: Open) -> Result<(), String> {
    check_display()?;
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default().with_inner_size([1280.0, 720.0]).with_title("Penny"),
        persist_window: false,
        // Costs a software renderer more than it shows.
        dithering: false,
        ..eframe::NativeOptions::default()
    };
    let window = Window::new(open);
    let unwritten = window.unwritten.clone();
    let is_open = Arc::new(AtomicBool::new(false));
    let opens = is_open.clone();
    let start = move || {
        eframe::run_native(
            "Penny",
            options,
            Box::new(move |context| {
                // From here on a panic is a defect of Penny's, and is reported as such.
                drop(std::panic::take_hook());
                opens.store(true, Ordering::Relaxed);
                theme(&context.egui_ctx);
                Ok(Box::new(window))
            }),
        )
    };
    // winit panics where a library is missing: that becomes the same sentence as every other failure.
    std::panic::set_hook(Box::new(|_| {}));
    let ended = std::panic::catch_unwind(std::panic::AssertUnwindSafe(start));
    drop(std::panic::take_hook());
    match ended {
        Ok(Ok(())) if unwritten.borrow().is_empty() => Ok(()),
        Ok(Ok(())) => Err(unwritten.borrow().join("\nerror: ")),
        Ok(Err(error)) => Err(cannot(&error.to_string())),
        Err(panic) if is_open.load(Ordering::Relaxed) => std::panic::resume_unwind(panic),
        Err(panic) => {
            let said = panic.downcast_ref::<String>().cloned();
            Err(cannot(&said.or_else(|| panic.downcast_ref::<&str>().map(|s| (*s).to_owned())).unwrap_or_default()))
        }
    }
}

/// On Linux a window needs a display server.
fn check_display() -> Result<(), String> {
    let set = |name: &str| std::env::var_os(name).is_some_and(|v| !v.is_empty());
    if cfg!(target_os = "linux") && !set("DISPLAY") && !set("WAYLAND_DISPLAY") && !set("WAYLAND_SOCKET") {
        return Err("there is no display to open a window on (DISPLAY and WAYLAND_DISPLAY are not set); \
                    `penny render SCENE.xml -o out.gif` makes pictures and videos without one"
            .to_owned());
    }
    Ok(())
}

fn cannot(why: &str) -> String {
    let why = reason(why);
    format!(
        "cannot open a window: {why}; it needs a display with OpenGL and, on Debian, the packages {LIBRARIES}; \
         `penny render SCENE.xml -o out.gif` makes pictures and videos without them"
    )
}

/// The first line of an error, without the place in winit's source and without glutin's list of wishes.
fn reason(why: &str) -> &str {
    let why = why.lines().next().unwrap_or("").trim_end_matches('.');
    let why = why.rsplit_once(".rs:").and_then(|(_, rest)| rest.split_once(": ")).map_or(why, |(_, said)| said);
    why.split(" matching the template: ").next().unwrap_or(why)
}

/// What is behind everything. Panels leave it as it is: to fill half of the window again costs a software renderer as
/// much as the picture in the other half.
const PAPER: egui::Color32 = egui::Color32::WHITE;

pub fn theme(ctx: &egui::Context) {
    ctx.set_theme(egui::Theme::Light);
    ctx.style_mut_of(egui::Theme::Light, |style| style.visuals.panel_fill = egui::Color32::TRANSPARENT);
}

impl Window {
    fn new(open: Open) -> Window {
        let watched = open.files.into_iter().map(|f| (f.clone(), modified(&f))).collect();
        let mut app = App::new(open.stage);
        app.hint = app.stage.player.is_none();
        Window {
            app,
            path: open.path,
            limits: open.limits,
            recorded: 0,
            kept: 0.0,
            record: open.record,
            last: open.last,
            unwritten: Rc::default(),
            watched,
            looked: 0.0,
            frames: 0,
            shown: 0.0,
            problem: None,
        }
    }

    /// Reads the scene again if one of its files was saved.
    fn look(&mut self, now: f64) {
        if now - self.looked < LOOK {
            return;
        }
        self.looked = now;
        self.keep_record(now);
        let mut saved = false;
        for (file, time) in &mut self.watched {
            let changed = modified(file);
            if changed.is_some() && changed != *time {
                *time = changed;
                saved = true;
            }
        }
        if !saved {
            return;
        }
        match open::open_within(&self.path, &self.limits) {
            Ok(opened) => {
                self.problem = None;
                self.keep_run();
                self.watch(opened.files.clone());
                self.app.stage.reload(opened);
            }
            Err(report) => self.problem = Some(report),
        }
    }

    fn watch(&mut self, files: Vec<PathBuf>) {
        self.watched = files.into_iter().map(|f| (f.clone(), modified(&f))).collect();
    }

    fn grant(&mut self, wish: Wish) {
        match wish {
            Wish::SaveRun => {
                let path = free_name("penny", "json");
                self.app.stage.message = match self.write_run(&path) {
                    Ok(()) => format!("saved; replay with: penny play --replay {}", path.display()),
                    Err(problem) => problem,
                };
            }
            Wish::Level(level) => self.level(level),
        }
    }

    fn write_run(&self, path: &Path) -> Result<(), String> {
        let text = self.app.stage.session.log().to_json();
        penny::draft::write(path, text).map_err(|e| format!("cannot write `{}`: {}", path.display(), penny::reason(e)))
    }

    /// With `--record`, what was played until now is in the file, whatever ends the program.
    fn keep_record(&mut self, now: f64) {
        let steps = self.app.stage.session.steps;
        if let Some(path) = &self.record
            && steps != self.recorded
            && now - self.kept >= 0.75
        {
            // A problem is told when the window is closed.
            let _ = self.write_run(path);
            (self.recorded, self.kept) = (steps, now);
        }
    }

    /// Another scene begins: with `--record`, what was played until now goes beside the file that will hold the rest.
    fn keep_run(&self) {
        let Some(record) = &self.record else { return };
        let stem = record.with_extension("");
        let path = free_name(&stem.to_string_lossy(), "json");
        match self.write_run(&path) {
            Ok(()) => say(&format!("{}: the session until now", path.display())),
            Err(problem) => say(&format!("error: {problem}")),
        }
    }

    fn level(&mut self, level: usize) {
        let path = self.path.with_file_name(LEVELS[level].scene);
        let old = &self.app.stage;
        let seed = old.game.as_ref().map_or(0, |g| g.seed);
        let opened = open::open_within(&path, &self.limits).and_then(|opened| {
            let files = opened.files.clone();
            let session = open::session(opened, &path, seed)?;
            Ok((Stage::new(session, seed, Some(level), true), files))
        });
        match opened {
            Ok((mut stage, files)) => {
                if let (Some(new), Some(old)) = (&mut stage.game, &old.game) {
                    (new.points, new.goals, new.rounds) = (old.points, old.goals, old.played() + 1);
                }
                self.keep_run();
                self.app.stage = stage;
                self.path = path;
                self.watch(files);
            }
            Err(problem) => self.app.stage.message = problem,
        }
    }
}

impl eframe::App for Window {
    fn clear_color(&self, _visuals: &egui::Visuals) -> [f32; 4] {
        PAPER.to_normalized_gamma_f32()
    }

    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        let (now, elapsed) = ui.input(|i| (i.time, f64::from(i.unstable_dt)));
        self.look(now);
        // The first second is spent on opening.
        if now > 1.0 {
            self.frames += 1;
            self.shown += elapsed;
        }
        if ui.input(|i| i.modifiers.command && i.key_pressed(egui::Key::Q)) {
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close);
        }
        self.app.ui(ui, elapsed);
        if let Some(wish) = self.app.wish.take() {
            self.grant(wish);
        }
        let mut read = false;
        if !self.app.stage.warnings.is_empty() {
            let window = egui::Window::new("Warnings").resizable(true).default_width(560.0);
            window.default_pos([24.0, 110.0]).show(ui.ctx(), |ui| {
                self.app.stage.warnings.iter().for_each(|warning| drop(ui.label(warning)));
                read = ui.button("go on").clicked();
            });
        }
        if read {
            self.app.stage.warnings.clear();
        }
        if let Some(report) = &self.problem {
            let window = egui::Window::new("The saved scene has problems; the old one goes on").resizable(true);
            window.default_width(700.0).show(ui.ctx(), |ui| ui.monospace(report));
        }
        ui.ctx().request_repaint();
    }

    fn on_exit(&mut self, _gl: Option<&eframe::glow::Context>) {
        self.app.close();
        say(&self.app.stage.session.summary());
        say(&format!("{} frames, {:.1} a second", self.frames, self.frames as f64 / self.shown.max(1e-9)));
        let record = self.record.as_ref().map(|path| self.write_run(path));
        let last = self.last.as_ref().map(|last| last(&self.app.stage.session));
        self.unwritten.borrow_mut().extend([record, last].into_iter().flatten().filter_map(Result::err));
    }
}

fn modified(path: &Path) -> Option<SystemTime> {
    std::fs::metadata(path).and_then(|m| m.modified()).ok()
}
