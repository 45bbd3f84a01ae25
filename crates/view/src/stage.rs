//! Everything that a player sees and does, without a window: keys in, pictures and numbers out.

use std::time::{Duration, Instant};

use super::camera::Camera;
use super::clock::Clock;
use super::controls::{Controls, Grab};
use super::draw::DrawList;
use super::film::Film;
use super::game::report::{self, Shot};
use super::game::{Game, Outcome};
use super::history::History;
use super::log::Change;
use super::open::{self, Opened};
use super::scene;
use super::session::{Player, Session, Source};
use penny::contact;
use penny::math::{Vec3, Vec6};
use penny::model::Model;
use penny::state::State;

pub struct Stage {
    pub session: Session,
    pub controls: Controls,
    pub clock: Clock,
    pub paused: bool,
    pub film: Film,
    pub history: History,
    pub game: Option<Game>,
    /// The last shot of the game under every law.
    pub shots: Vec<Shot>,
    /// The same scene under a second law, pushed alike.
    pub ghost: Option<Session>,
    /// A recorded session that plays on.
    pub player: Option<Player>,
    /// The last thing worth saying.
    pub message: String,
    /// What is doubtful about the scene and its start, until the player has read it.
    pub warnings: Vec<String>,
    pub pace: Pace,
    /// Where a kick goes: the last direction pushed, or into the picture.
    pub heading: Option<Vec3>,
    home: Camera,
}

/// How fast the simulation runs.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pace {
    /// Mean cost of a step, s.
    pub step: f64,
    /// Simulated time per wall time, smoothed over about half a second.
    pub factor: f64,
    /// The machine did not manage what the clock asked for.
    pub late: bool,
}

/// Directions that keys hold down: right, forward and turning left, each −1, 0 or 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Held {
    pub right: f64,
    pub forward: f64,
    pub turn: f64,
    pub strong: bool,
}

/// Colour of the ghost.
const GHOST: [f32; 3] = [0.55, 0.30, 0.75];
/// A chip kick goes up this much for each unit along.
const CHIP: f64 = 0.55;

impl Stage {
    /// A stage to play on: a scene with a goal is a game if `play` is set.
    pub fn new(session: Session, seed: u64, level: Option<usize>, play: bool) -> Stage {
        let level = level.unwrap_or_else(|| Game::first_level(&session));
        let game = play.then(|| Game::new(&session, level, seed)).flatten();
        let home = scene::first_look(&session);
        let body = game.as_ref().map_or_else(|| first_moving(&session.model), |g| g.rules.ball);
        let film = Film::new(&session, home, None, 60.0, 1.0);
        let mut stage = Stage {
            history: History::new(),
            controls: Controls::new(body),
            clock: Clock::default(),
            paused: false,
            film,
            game,
            shots: Vec::new(),
            ghost: None,
            player: None,
            message: String::new(),
            warnings: Vec::new(),
            pace: Pace::default(),
            heading: None,
            home,
            session,
        };
        stage.serve();
        stage
    }

    /// A stage that a film is made of: what is seen is in the film's hands.
    pub fn watch(session: Session, film: Film, player: Option<Player>) -> Stage {
        let mut stage = Stage::new(session, 0, None, false);
        stage.film = film;
        stage.player = player;
        stage.paused = true;
        stage
    }

    /// Takes the steps up to a frame of the film.
    ///
    /// Errors: the simulation diverged, or a recorded session is damaged.
    pub fn advance(&mut self, frame: usize) -> Result<(), String> {
        while self.film.wants_step(frame, &self.session) {
            if !self.step() {
                let over = self.player.as_ref().is_some_and(|p| p.finished(&self.session));
                return if over { Ok(()) } else { Err(self.message.clone()) };
            }
            self.film.stepped(self.session.method.timestep);
        }
        Ok(())
    }

    /// Takes the steps of the first `seconds` of simulated time, which nobody looks at.
    ///
    /// Errors: as [`advance`](Stage::advance).
    pub fn skip(&mut self, seconds: f64) -> Result<(), String> {
        let mut skipped = 0.0;
        while skipped < seconds - 1e-9 * self.session.method.timestep {
            if !self.step() {
                return Err(self.message.clone());
            }
            skipped += self.session.method.timestep;
        }
        self.history = History::new();
        self.film.begin_again(&self.session);
        Ok(())
    }

    /// Plays a recorded session instead of the keyboard.
    pub fn replay(&mut self, player: Player) {
        self.game = None;
        self.player = Some(player);
        self.message = "replaying a recorded session".to_owned();
    }

    /// Puts another version of the scene in place of this one. What the player chose stays: camera, notes, body, and
    /// law, integrator and timestep where they differ from the old file's.
    pub fn reload(&mut self, opened: Opened) {
        let Opened { model, hash, text, .. } = opened;
        let (old, now) = (self.session.original(), self.session.method);
        let (Ok(was), Ok(mut method)) = (open::method(old), open::method(&model)) else {
            self.message = "the saved scene asks for a law or an integrator that does not exist".to_owned();
            return;
        };
        if now.contact.name != was.contact.name {
            method.contact = now.contact;
        }
        if now.integrator.name != was.integrator.name {
            method.integrator = now.integrator;
        }
        if now.timestep != was.timestep {
            method.timestep = now.timestep;
        }
        let source = Source { hash, text: Some(text), ..self.session.source.clone() };
        let state = State::new(&model);
        self.session = Session::new(model, method, state, source);
        let notes = self.film.notes;
        self.film = Film::new(&self.session, self.film.camera, self.film.follow, self.film.fps, self.film.speed);
        self.film.notes = notes;
        if self.controls.body >= self.session.model.bodies.len() {
            self.controls.body = first_moving(&self.session.model);
        }
        self.player = None;
        self.game = self.game.take().and_then(|g| Game::new(&self.session, g.level, g.seed));
        self.serve();
        self.begin_again();
        self.message = "the scene was saved and is loaded again".to_owned();
    }

    /// Looks at the scene as at the start.
    pub fn home(&mut self) {
        self.film.camera = self.home;
        self.film.follow = None;
    }

    /// Takes the steps that are due after `elapsed` wall seconds, but stops after `budget` of computing.
    pub fn tick(&mut self, elapsed: f64, budget: Duration) {
        if self.paused {
            self.pace.factor = 0.0;
            return;
        }
        let due = self.clock.steps(elapsed, self.session.method.timestep);
        let begun = Instant::now();
        let mut taken = 0;
        while taken < due {
            if !self.step() {
                break;
            }
            taken += 1;
            if taken % 8 == 0 && begun.elapsed() > budget {
                break;
            }
        }
        self.measure(elapsed, taken, due, begun.elapsed().as_secs_f64());
    }

    /// Takes one step under the inputs of now; false if there was none to take.
    pub fn step(&mut self) -> bool {
        if let Some(player) = &mut self.player {
            if let Err(problem) = player.feed(&mut self.session) {
                self.stop(problem);
                return false;
            }
            if player.finished(&self.session) {
                self.stop("the recorded session is over".to_owned());
                return false;
            }
        } else {
            for (body, wrench) in self.controls.wrenches(&mut self.session) {
                self.push(body, wrench);
            }
        }
        if let Err(d) = self.session.step() {
            self.stop(self.session.failure(&d));
            return false;
        }
        self.step_ghost();
        self.history.record(&self.session, self.controls.body, &self.ghost);
        self.referee();
        true
    }

    /// What the keys hold down now, in the camera's horizontal frame.
    pub fn hold(&mut self, held: Held) {
        let (right, mut forward) = self.film.camera.ground();
        // In a scene that is flat like a picture, "forward" can only mean up.
        if scene::planar(&self.session.model) {
            forward = Vec3::z();
        }
        let direction = (right * held.right + forward * held.forward).try_normalize(1e-9).unwrap_or_else(Vec3::zeros);
        if direction.norm() > 0.0 {
            self.heading = Some(direction);
        }
        self.controls.direction = direction;
        self.controls.turn = held.turn;
        self.controls.strong = held.strong;
    }

    /// Kicks the selected body along the heading; `chip` lifts it.
    pub fn kick(&mut self, chip: bool) {
        let ahead = if scene::planar(&self.session.model) { Vec3::x() } else { self.film.camera.ground().1 };
        let mut heading = self.heading.unwrap_or(ahead);
        if chip {
            heading = (heading + Vec3::z() * CHIP).normalize();
        }
        self.controls.kick(&self.session, &heading);
    }

    /// Selects the n-th moving body, from 1.
    pub fn select(&mut self, n: usize) {
        let roots: Vec<usize> = self.session.model.trees.iter().map(|t| t.bodies.start).collect();
        if let Some(&body) = n.checked_sub(1).and_then(|i| roots.get(i)) {
            self.release();
            self.controls.body = body;
            self.history = History::new();
            self.message = format!("{} is selected", self.name(body));
        }
    }

    /// Starts again: the next pass in the game, else the beginning.
    pub fn reset(&mut self) {
        self.player = None;
        self.paused = false;
        if self.game.is_some() {
            self.serve();
        } else if let Err(problem) = self.session.restart() {
            self.message = problem;
        } else {
            self.release();
            self.message = String::new();
            self.begin_again();
        }
    }

    /// Changes something, and says so if it cannot be. The ghost keeps its own law.
    pub fn change(&mut self, change: Change) {
        if let Err(problem) = self.session.change(change.clone()) {
            self.message = problem;
            return;
        }
        if let Some(ghost) = self.ghost.as_mut().filter(|_| !matches!(change, Change::Contact(_))) {
            // What the session accepts its twin accepts too.
            let _ = ghost.change(change);
        }
    }

    /// Shows the next other law as a ghost, or none after the last.
    pub fn next_ghost(&mut self) {
        let own = self.session.method.contact.name;
        let now = self.ghost.as_ref().map(|g| g.method.contact.name);
        let others: Vec<_> = contact::ALL.iter().filter(|law| law.name != own).collect();
        let next = match now {
            None => others.first(),
            Some(name) => others.iter().position(|law| law.name == name).and_then(|i| others.get(i + 1)),
        };
        self.set_ghost(next.map(|law| law.name));
    }

    /// A ghost under the law of that name, from the state of now.
    pub fn set_ghost(&mut self, law: Option<&str>) {
        self.ghost = law.and_then(contact::by_name).map(|law| {
            let method = penny::forward::Method { contact: law, ..self.session.method };
            Session::new(self.session.model.clone(), method, self.session.state.clone(), self.session.source.clone())
        });
        if let Some(ghost) = &self.ghost {
            self.message = format!("ghost: the same scene under the law `{}`", ghost.method.contact.name);
        }
    }

    /// Holds a point of a body with the mouse.
    pub fn grab(&mut self, grab: Option<Grab>) {
        if let (Some(old), None) = (self.controls.grab, grab) {
            self.push(old.body, Vec6::zeros());
        }
        self.controls.grab = grab;
    }

    pub fn name(&self, body: usize) -> String {
        let name = &self.session.model.bodies[body].name;
        if name.is_empty() { format!("body {body}") } else { name.clone() }
    }

    /// The picture of now.
    pub fn draw(&mut self) -> DrawList {
        let between = if self.paused { 1.0 } else { self.clock.between(self.session.method.timestep) };
        let mut list = self.film.draw(&self.session, between);
        if let Some(ghost) = &self.ghost {
            scene::ghost(&mut list, &ghost.model, &ghost.poses(between), GHOST);
        }
        if let Some(grab) = &self.controls.grab {
            self.film.spring(&mut list, &self.session, grab);
        }
        for (i, shot) in self.shots.iter().enumerate() {
            self.film.path(&mut list, &shot.path, i);
        }
        list
    }

    fn push(&mut self, body: usize, wrench: Vec6) {
        if body == 0 {
            return;
        }
        let wrench = self.game.as_ref().map_or(wrench, |game| game.allow(&self.session, body, wrench));
        if let Err(problem) = self.session.push(body, wrench) {
            self.message = problem;
        }
    }

    /// Lets go of everything.
    fn release(&mut self) {
        for body in 1..self.session.model.bodies.len() {
            self.push(body, Vec6::zeros());
        }
        self.controls = Controls::new(self.controls.body);
    }

    fn stop(&mut self, message: String) {
        self.message = message;
        self.paused = true;
    }

    fn step_ghost(&mut self) {
        let Some(ghost) = &mut self.ghost else { return };
        for (body, wrench) in self.session.state.xfrc_applied.iter().enumerate().skip(1) {
            let _ = ghost.push(body, *wrench);
        }
        if self.session.state.xfrc_applied.is_empty() {
            ghost.state.xfrc_applied.clear();
        }
        if ghost.step().is_err() {
            self.message = format!("under `{}` the simulation diverged: the ghost is gone", ghost.method.contact.name);
            self.ghost = None;
        }
    }

    fn serve(&mut self) {
        self.release();
        let Some(game) = &mut self.game else { return };
        self.message = match game.serve(&mut self.session) {
            Ok(()) => format!("round {}: {}", game.rounds, super::game::LEVELS[game.level].about),
            Err(problem) => problem,
        };
        self.begin_again();
    }

    fn begin_again(&mut self) {
        self.history = History::new();
        self.film.begin_again(&self.session);
        self.shots.clear();
        let law = self.ghost.as_ref().map(|g| g.method.contact.name);
        self.ghost = None;
        if law.is_some() {
            self.set_ghost(law);
        }
    }

    fn referee(&mut self) {
        let Some(game) = &mut self.game else { return };
        let Some(outcome) = game.watch(&self.session) else { return };
        self.message = match outcome {
            Outcome::Goal => format!("GOAL! {} points: the round is over; R for the next", game.worth()),
            Outcome::Wide => "wide: the round is over; R for the next".to_owned(),
            Outcome::Stopped if game.late(&self.session) => "time is up: the round is over; R for the next".to_owned(),
            Outcome::Stopped => "no goal, the ball has stopped: the round is over; R for the next".to_owned(),
        };
        self.shots = report::report(game, &self.session);
    }

    fn measure(&mut self, elapsed: f64, taken: usize, due: usize, spent: f64) {
        let blend = |old: f64, new: f64, weight: f64| old + (new - old) * weight.clamp(0.0, 1.0);
        if taken > 0 {
            self.pace.step = blend(self.pace.step, spent / taken as f64, if self.pace.step == 0.0 { 1.0 } else { 0.1 });
        }
        let simulated = taken as f64 * self.session.method.timestep;
        self.pace.factor = blend(self.pace.factor, simulated / elapsed.max(1e-6), 2.0 * elapsed);
        self.pace.late = taken < due;
    }
}

fn first_moving(model: &Model) -> usize {
    model.trees.first().map_or(0, |tree| tree.bodies.start)
}
