use super::{Integrator, displace};
use crate::data::Data;
use crate::forward::{Method, forward};
use crate::model::Model;
use crate::state::State;

pub const METHOD: Integrator = Integrator {
    name: "explicit-euler",
    mjcf: &[],
    order: 1,
    about: "old velocity moves, old force accelerates: gains energy; only to see why nobody uses it",
    advance,
};

/// Explicit Euler.
///
///     q ← q ⊕ h v,   v ← v + h a(q, v)
fn advance(model: &Model, method: &Method, state: &mut State, data: &mut Data) {
    let h = method.timestep;
    forward(model, method, state, data);
    state.remember(data);
    displace(model, &mut state.qpos, &state.qvel, h);
    for (v, a) in state.qvel.iter_mut().zip(&data.qacc) {
        *v += h * a;
    }
    state.time += h;
}
