//! The pass-and-kick game: rules, levels, score. It watches a [`Session`] step by step and
//! knows no window.

pub mod best;
pub mod report;
mod rules;

pub use rules::{Outcome, Rules};

use std::path::Path;

use super::log::{Change, Start};
use super::session::Session;
use penny::math::{Vec3, Vec6};
use penny::state::State;

/// A level: a scene in the same folder, and how the ball comes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Level {
    pub name: &'static str,
    pub about: &'static str,
    pub scene: &'static str,
    pub pass: bool,
}

pub const LEVELS: &[Level] = &[
    Level { name: "still", about: "the ball lies still", scene: "goal.xml", pass: false },
    Level { name: "pass", about: "a teammate passes", scene: "goal.xml", pass: true },
    Level { name: "keeper", about: "a pass, and a keeper in the goal", scene: "goal_keeper.xml", pass: true },
    Level { name: "circle", about: "the tutorial's rolling circle, from the side", scene: "goal_2d.xml", pass: true },
];

/// A round ends after this long, s.
pub const ROUND: f64 = 15.0;
/// A ball slower than this after the shot has stopped, m/s.
const STOPPED: f64 = 0.05;
/// Points of a goal for each level, and for each metre beyond [`rules::FAIR`] at the last push.
const POINTS: [f64; 2] = [100.0, 20.0];

/// One round after another.
#[derive(Clone, Debug)]
pub struct Game {
    pub rules: Rules,
    /// Index into [`LEVELS`].
    pub level: usize,
    pub seed: u64,
    /// Rounds begun, goals scored, points collected.
    pub rounds: u64,
    pub goals: u64,
    pub points: u64,
    pub outcome: Option<Outcome>,
    /// Where and when this round began.
    pub start: State,
    pub start_step: u64,
    /// Distance of the ball from the line at the last push of this round, m.
    pub shot_from: Option<f64>,
    last: Vec3,
}

impl Game {
    /// The game of a scene that has a goal (`<custom><numeric name="penny.goal" …>`); none for other scenes.
    pub fn new(session: &Session, level: usize, seed: u64) -> Option<Game> {
        let rules = Rules::of(&session.model)?;
        let last = rules.centre(session);
        let start = session.state.clone();
        let (rounds, goals, points) = (0, 0, 0);
        let start_step = session.steps;
        Some(Game {
            rules,
            level,
            seed,
            rounds,
            goals,
            points,
            outcome: None,
            start,
            start_step,
            shot_from: None,
            last,
        })
    }

    /// The level that a scene opens with: that of its file, and of those the one that the scene names.
    pub fn first_level(session: &Session) -> usize {
        let file = Path::new(&session.source.path).file_name();
        let own = |level: &Level| file.is_some_and(|name| name == level.scene);
        let named = |level: &Level| session.model.texts.get("penny.level").is_some_and(|name| name == level.name);
        let find = |wanted: &dyn Fn(&Level) -> bool| LEVELS.iter().position(wanted);
        find(&|level| own(level) && named(level)).or_else(|| find(&own)).or_else(|| find(&named)).unwrap_or(0)
    }

    /// Starts the next round: the ball where the level and the seed put it.
    pub fn serve(&mut self, session: &mut Session) -> Result<(), String> {
        let mut state = State::new(&session.model);
        let key = session.model.keyframes.iter().find(|k| k.name == "start");
        if let Some(key) = key {
            state.qpos.clone_from(&key.qpos);
            state.qvel.clone_from(&key.qvel);
        }
        if LEVELS[self.level].pass {
            self.rules.pass(&session.model, self.seed.wrapping_add(self.rounds), &mut state);
        }
        session.push(self.rules.ball, Vec6::zeros())?;
        session.change(Change::State(Start::of(&state)))?;
        self.rounds += 1;
        self.outcome = None;
        self.shot_from = None;
        self.start = state;
        self.start_step = session.steps;
        self.last = self.rules.centre(session);
        Ok(())
    }

    /// The push that the rules let through for the next step: none on anything but the ball, none within 1 m of
    /// the line, none after the whistle.
    pub fn allow(&self, session: &Session, body: usize, wrench: Vec6) -> Vec6 {
        let fair =
            body == self.rules.ball && self.outcome.is_none() && self.rules.may_push(&self.rules.centre(session));
        if fair { wrench } else { Vec6::zeros() }
    }

    /// Watches a step that has just been taken. Returns the outcome in the step that decides the round.
    pub fn watch(&mut self, session: &Session) -> Option<Outcome> {
        let now = self.rules.centre(session);
        let before = std::mem::replace(&mut self.last, now);
        if self.outcome.is_some() {
            return None;
        }
        if session.pushed(self.rules.ball) != Vec6::zeros() {
            self.shot_from = Some(self.rules.distance(&before));
        }
        let over = self.rules.decide(&before, &now).or_else(|| self.stopped(session, &before, &now))?;
        self.outcome = Some(over);
        if over == Outcome::Goal {
            self.goals += 1;
            self.points += self.worth();
        }
        Some(over)
    }

    /// Rounds that are over.
    pub fn played(&self) -> u64 {
        self.rounds - u64::from(self.outcome.is_none())
    }

    /// Points of a goal; [`scoring`] says how in words.
    pub fn worth(&self) -> u64 {
        let far = (self.shot_from.unwrap_or(rules::FAIR) - rules::FAIR).max(0.0);
        (POINTS[0] * (self.level + 1) as f64 + POINTS[1] * far) as u64
    }

    /// Whether the round has lasted for its time.
    pub fn late(&self, session: &Session) -> bool {
        self.time(session) > ROUND
    }

    /// Time since the serve, s.
    pub fn time(&self, session: &Session) -> f64 {
        session.state.time - self.start.time
    }

    fn stopped(&self, session: &Session, before: &Vec3, now: &Vec3) -> Option<Outcome> {
        let still = (now - before).norm() < STOPPED * session.method.timestep;
        let pushed = session.pushed(self.rules.ball) != Vec6::zeros();
        let late = self.late(session);
        // A ball that has come too near to be pushed and stops there is lost as well.
        let ended = still && !pushed && (self.shot_from.is_some() || !self.rules.may_push(now));
        (late || ended).then_some(Outcome::Stopped)
    }
}

/// The rules in words, for the help.
pub fn scoring() -> String {
    let [level, metre] = POINTS;
    format!(
        "a goal: {level} points × the level (1 to {}) + {metre} for each metre beyond {} m from the line at the last push\n\
         nothing may be pushed nearer than {} m; a round ends with the ball over the line, at rest, or after {ROUND} s",
        LEVELS.len(),
        rules::FAIR,
        rules::FAIR
    )
}
