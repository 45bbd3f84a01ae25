//! Implicit Euler's steps h and h/2 extrapolated to step 0: second order, for stiff springs, with an estimate of its error.

use super::{Integrator, difference, displace, implicit_euler};
use crate::data::Data;
use crate::forward::Method;
use crate::model::Model;
use crate::state::State;

/// The record.
pub const METHOD: Integrator = Integrator {
    name: "extrapolated-euler",
    mjcf: &[],
    order: 2,
    about: "implicit Euler with h and twice with h/2, extrapolated to second order; the difference estimates the error",
    implicit: true,
    implicit_dampers: super::Dampers::JointsAndActuators,
    advance,
    // 2 A(h/2)² − A(h), A implicit Euler's
    amplification: Some(|spring, h| {
        let euler = implicit_euler::amplification;
        let (whole, half) = (euler(spring, h), euler(spring, 0.5 * h));
        let square = |i: usize, j: usize| half[i][0] * half[0][j] + half[i][1] * half[1][j];
        [0, 1].map(|i| [0, 1].map(|j| 2.0 * square(i, j) - whole[i][j]))
    }),
    estimate: Some(|data| &data.scratch.get::<Ends>().error),
};

/// Where one step of h leads, and how far two of h/2 are from there.
#[derive(Clone, Debug, Default)]
struct Ends {
    coarse: Option<State>,
    /// q along the dofs, then v (2 nv).
    error: Vec<f64>,
}

/// One step.
///
///     y₁ one implicit step of h,  y₂ two of h/2:     y ← y₂ ⊕ (y₂ ⊖ y₁),     error: y₂ ⊖ y₁
///
/// Implicit Euler's local error is c h² + O(h³), so y₁ errs by c h² and y₂ by c h²/2. At h → ∞ the factor is 0: it damps
/// what it does not resolve, as implicit Euler does.
///
/// Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, §IV.9.
fn advance(model: &Model, method: &Method, state: &mut State, data: &mut Data) {
    let (time, nv) = (state.time, model.nv);
    let mut ends = data.scratch.take::<Ends>();
    let mut coarse = ends.coarse.take().unwrap_or_else(|| state.clone());
    coarse.copy_from(state);
    implicit_euler::advance(model, method, &mut coarse, data);
    let half = Method { timestep: 0.5 * method.timestep, ..*method };
    for _ in 0..2 {
        implicit_euler::advance(model, &half, state, data);
    }
    ends.error.clear();
    ends.error.resize(2 * nv, 0.0);
    let (position, velocity) = ends.error.split_at_mut(nv);
    difference(model, &state.qpos, &coarse.qpos, position);
    for i in 0..nv {
        velocity[i] = state.qvel[i] - coarse.qvel[i];
        state.qvel[i] += velocity[i];
    }
    displace(model, &mut state.qpos, position, 1.0);
    for (fine, coarse) in state.act.iter_mut().zip(&coarse.act) {
        *fine += *fine - coarse;
    }
    state.time = time + method.timestep;
    ends.coarse = Some(coarse);
    data.scratch.put(ends);
}
