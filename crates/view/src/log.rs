//! What was done to a simulation, step by step: enough to play it again bit for bit.

use serde::{Deserialize, Serialize};

use super::fnv::Fnv;
use penny::state::State;

/// A recorded session, as `run.json` holds it.
///
/// Floats are written with all their digits and read back exactly.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Log {
    /// Version of this format.
    pub penny_run: u32,
    /// The scene file, as it was given.
    pub scene: String,
    /// FNV-1a of the scene's text, in hexadecimal: a replay of another scene is refused.
    pub scene_hash: String,
    /// The scene itself with all that it includes, so that the session can be played where its files are not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene_text: Option<String>,
    /// Seed of the game's pass.
    pub seed: u64,
    /// How the first step was computed.
    pub contact: String,
    pub integrator: String,
    /// s
    pub timestep: f64,
    pub rounds: usize,
    pub start: Start,
    /// Steps taken.
    pub steps: u64,
    /// In the order of their steps.
    pub inputs: Vec<Input>,
}

/// The state that the session began in.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Start {
    pub time: f64,
    pub qpos: Vec<f64>,
    pub qvel: Vec<f64>,
    pub ctrl: Vec<f64>,
    /// The whole of it, where there is more to it: activations, mocap bodies, what the contact law starts from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub whole: Option<Box<State>>,
}

impl Start {
    pub fn of(state: &State) -> Start {
        let State { act, mocap_pos, eq_active, xfrc_applied, qfrc_applied, qacc_warmstart, warm, .. } = state;
        let zero = |x: &f64| *x == 0.0;
        let lists = mocap_pos.is_empty() && eq_active.is_empty() && xfrc_applied.is_empty() && qfrc_applied.is_empty();
        let plain = lists && warm.is_empty() && act.iter().all(zero) && qacc_warmstart.iter().all(zero);
        Start {
            time: state.time,
            qpos: state.qpos.clone(),
            qvel: state.qvel.clone(),
            ctrl: state.ctrl.clone(),
            whole: (!plain).then(|| Box::new(state.clone())),
        }
    }
}

/// A change that holds from step number `step` on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Input {
    pub step: u64,
    #[serde(flatten)]
    pub change: Change,
}

/// What a player can change while the simulation runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Change {
    /// Force (N) and torque (N m) on a body at its centre of mass, world axes, until changed.
    Push {
        body: usize,
        wrench: [f64; 6],
    },
    Contact(String),
    Integrator(String),
    /// s
    Timestep(f64),
    Rounds(usize),
    /// Of a step, m: every step is made of controlled ones that err no more, by an integrator that estimates its error;
    /// 0: it is one step of the integrator.
    Accuracy(f64),
    /// m/s²
    Gravity([f64; 3]),
    /// Of all contacts.
    Solref([f64; 2]),
    /// Of all contacts: sliding (1), torsional (m), rolling (m).
    Friction([f64; 3]),
    /// To another state; steps go on counting.
    State(Start),
}

/// A session of more steps was never played: eleven days at a timestep of 1 ms.
pub const MOST_STEPS: u64 = 1_000_000_000;

/// The version of [`Log`] that this program writes and reads.
pub const VERSION: u32 = 1;

impl Log {
    /// Errors: one sentence that says what is wrong with the text.
    pub fn parse(text: &str) -> Result<Log, String> {
        let log: Log = serde_json::from_str(text).map_err(|e| format!("this is not a recorded session: {e}"))?;
        if log.penny_run != VERSION {
            return Err(format!("this session has format {}, and this penny reads format {VERSION}", log.penny_run));
        }
        if log.steps > MOST_STEPS {
            return Err(format!("this session says that it has {} steps; the most is {MOST_STEPS}", log.steps));
        }
        let timesteps = log.inputs.iter().filter_map(|input| match input.change {
            Change::Timestep(h) => Some(h),
            _ => None,
        });
        if let Some(h) = timesteps.chain([log.timestep]).find(|h| !(h.is_finite() && *h > 0.0)) {
            return Err(format!("this session is damaged: it has a timestep of {h} s"));
        }
        if log.inputs.windows(2).any(|pair| pair[0].step > pair[1].step) {
            return Err("this session is damaged: its inputs are not in the order of their steps".to_owned());
        }
        Ok(log)
    }

    /// The scene that it carries, if that is what it was recorded with.
    pub fn carried(&self) -> Option<&str> {
        let text = self.scene_text.as_deref()?;
        (Fnv::of(text.bytes()).to_string() == self.scene_hash).then_some(text)
    }

    /// Simulated time that all steps together cover, s.
    pub fn duration(&self) -> f64 {
        let (mut h, mut from, mut sum) = (self.timestep, 0, 0.0);
        for input in &self.inputs {
            if let Change::Timestep(next) = input.change {
                let step = input.step.min(self.steps);
                sum += h * step.saturating_sub(from) as f64;
                (h, from) = (next, step);
            }
        }
        sum + h * self.steps.saturating_sub(from) as f64
    }

    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default()
    }
}
