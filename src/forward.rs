//! One step on one page.
//!
//!     M q̈ + c = τ + Jᵀ f
//!
//! M inertia matrix, c bias forces (gravity, Coriolis, centrifugal), τ springs, dampers, actuators and applied forces, J
//! rows of contacts, joint limits and dry friction, f their forces. [`forward`] finds q̈ at a state, pass by pass, and an
//! integrator moves the state along.

use crate::collision;
use crate::contact;
use crate::data::{Counts, Data};
pub use crate::diverged::Diverged;
use crate::diverged::{diverged, sane};
use crate::dynamics;
pub use crate::method::{Method, ROUNDS};
use crate::model::Model;
use crate::state::State;

/// Advances the state by one timestep.
///
/// Errors: [`Diverged`] if a position, velocity or acceleration is not finite or beyond 1e10 (MuJoCo's bound);
/// the state is then what the failed step left.
pub fn step(model: &Model, method: &Method, state: &mut State, data: &mut Data) -> Result<(), Diverged> {
    data.counts = Counts::default();
    (method.integrator.advance)(model, method, state, data);
    data.unconverged += usize::from(data.solver.residual > CONVERGED);
    if sane(&state.qpos) & sane(&state.qvel) & sane(&data.qacc) { Ok(()) } else { Err(diverged(model, state, data)) }
}

/// A step whose contact forces are left with a larger residual than this counts as unconverged: a hundredth of a percent of
/// the weight that a contact carries.
const CONVERGED: f64 = 1e-4;

/// Forces and accelerations at the state: everything but the integration.
///
/// | pass | reads | writes |
/// |---|---|---|
/// | `kinematics` | qpos | poses of bodies and geoms, twists of the dofs |
/// | `detect` | poses | contacts |
/// | `smooth` | qpos, qvel, ctrl, applied forces, poses | M and its factor, c, τ, qacc_smooth = M⁻¹ (τ − c) |
/// | `constrain` | contacts, qacc_smooth, qvel, the last step's forces | f, qfrc_constraint = Jᵀ f, qacc |
pub fn forward(model: &Model, method: &Method, state: &State, data: &mut Data) {
    data.counts.forwards += 1;
    dynamics::kinematics(model, &state.qpos, data);
    collision::detect(model, data);
    dynamics::smooth(model, state, data);
    contact::constrain(model, &method.settings(), state, data);
}
