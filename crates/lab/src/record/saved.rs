//! States as JSON, bit for bit: a run goes on from one as if it had never stopped.
//!
//!     {"penny_state": 1, "model": {…}, "method": {…}, "state": {"time", "qpos", "qvel", …}}
//!
//! A number is written with as many digits as tell it from its neighbours, and read back as the same bits. `model` says
//! what the numbers belong to: a state of another scene is refused, one of the same scene with another mass or friction is
//! not. `method` is for people: a run under another law or integrator may start from the state, too.

use serde::{Deserialize, Serialize};

use crate::names;
use penny::forward::Method;
use penny::model::Model;
use penny::state::State;

/// Of this layout of the file.
const VERSION: u32 = 1;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Saved {
    penny_state: u32,
    model: Shape,
    method: How,
    state: State,
}

/// What a state's numbers belong to.
#[derive(Serialize, Deserialize, PartialEq)]
struct Shape {
    name: String,
    joints: Vec<String>,
    actuators: usize,
    bodies: usize,
    geoms: usize,
}

#[derive(Serialize, Deserialize)]
struct How {
    contact: String,
    integrator: String,
    timestep: f64,
}

impl Shape {
    fn of(model: &Model) -> Shape {
        let joint = |j: usize| format!("{} {}", model.joints[j].kind.name(), names::joint(model, j));
        Shape {
            name: model.name.clone(),
            joints: (0..model.joints.len()).map(joint).collect(),
            actuators: model.actuators.len(),
            bodies: model.bodies.len(),
            geoms: model.geoms.len(),
        }
    }

    /// Why a state of the other shape does not fit this one.
    fn differs(&self, other: &Shape) -> Option<String> {
        let first = self.joints.iter().zip(&other.joints).find(|(a, b)| a != b);
        let counts = [
            (self.bodies, other.bodies, "bodies"),
            (self.joints.len(), other.joints.len(), "joints"),
            (self.actuators, other.actuators, "actuators"),
            (self.geoms, other.geoms, "geoms"),
        ];
        if let Some((here, there, what)) = counts.into_iter().find(|(a, b, _)| a != b) {
            return Some(format!("it has {there} {what} (the world among the bodies), this scene has {here}"));
        }
        first.map(|(here, there)| format!("its joint `{there}` is `{here}` in this scene"))
    }
}

/// The state as text.
///
/// Errors: none of the numbers of a run that has not diverged; else a number that JSON does not have.
pub fn write_state(model: &Model, method: &Method, state: &State) -> Result<String, String> {
    let placed = state.mocap_pos.iter().flatten().chain(state.mocap_quat.iter().flatten());
    let lists = [&state.qpos, &state.qvel, &state.ctrl, &state.act, &state.qacc_warmstart];
    let numbers = lists.into_iter().flatten().chain(placed);
    if !numbers.chain([&state.time]).all(|x| x.is_finite()) {
        return Err("the state has numbers that are not finite".to_owned());
    }
    let saved = Saved {
        penny_state: VERSION,
        model: Shape::of(model),
        method: How {
            contact: method.contact.name.to_owned(),
            integrator: method.integrator.name.to_owned(),
            timestep: method.timestep,
        },
        state: state.clone(),
    };
    serde_json::to_string(&saved).map(|text| text + "\n").map_err(|e| e.to_string())
}

/// The state of a text that [`write_state`] made.
///
/// Errors: what the text is instead, or why its state does not fit the model.
pub fn read_state(model: &Model, text: &str) -> Result<State, String> {
    let value: serde_json::Value = serde_json::from_str(text).map_err(|e| format!("it is not JSON: {e}"))?;
    match value.get("penny_state").and_then(serde_json::Value::as_u64) {
        Some(version) if version == u64::from(VERSION) => {}
        Some(version) => return Err(format!("its layout is {version}, and this Penny reads {VERSION}")),
        None => return Err("it is not a saved state: --save-state writes one".to_owned()),
    }
    let saved: Saved = serde_json::from_str(text).map_err(|e| format!("it is damaged: {e}"))?;
    if let Some(why) = Shape::of(model).differs(&saved.model) {
        return Err(format!("it is a state of another scene: {why}"));
    }
    saved.state.suits(model).map_err(|wrong| format!("it is damaged: {wrong}"))?;
    Ok(saved.state)
}
