//! Explicit Euler: q ← q ⊕ h v, v ← v + h a, both from the start of the step.

use super::{Integrator, add_scaled, displace};
use crate::data::Data;
use crate::dynamics::actuation;
use crate::forward::{Method, begin};
use crate::model::Model;
use crate::state::State;

/// The record.
pub const METHOD: Integrator = Integrator {
    name: "explicit-euler",
    mjcf: &[],
    order: 1,
    about: "position by the old velocity, velocity by the old force: gains energy; for comparison only",
    implicit: false,
    implicit_dampers: super::Dampers::None,
    advance,
    // [1, h; −hω², 1 − 2ζωh]
    amplification: Some(|s, h| [[1.0, h], [-h * s.stiffness(), 1.0 - h * s.damping()]]),
    estimate: None,
};

/// Explicit Euler.
///
///     q ← q ⊕ h v,   v ← v + h a(q, v)
fn advance(model: &Model, method: &Method, state: &mut State, data: &mut Data) {
    let h = method.timestep;
    begin(model, method, state, data);
    displace(model, &mut state.qpos, &state.qvel, h);
    add_scaled(&mut state.qvel, h, &data.qacc);
    actuation::advance(model, &data.act_dot, h, &mut state.act);
    state.time += h;
}
