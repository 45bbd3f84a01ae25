//! One step on one page.
//!
//!     M q̈ + c = τ + Jᵀ f
//!
//! M inertia matrix, c bias forces (gravity, Coriolis, centrifugal), τ springs, dampers, actuators and applied forces, J
//! rows of the constraints (contacts, limits, dry friction, equalities), f their forces. [`forward`] finds q̈ at a state,
//! pass by pass, and an integrator moves the state along.

use std::fmt;

use crate::collision;
use crate::contact;
use crate::data::{Counts, Data};
pub use crate::diverged::Diverged;
use crate::diverged::{diverged, sane};
use crate::dynamics;
pub use crate::method::{Method, ROUNDS};
use crate::model::Model;
use crate::sensors;
use crate::state::{State, WrongState};

/// Advances the state by one timestep.
///
/// As in MuJoCo, poses, contacts and forces in `data` are then those that the integrator evaluated last: at the beginning of
/// the step, at the last stage of a Runge–Kutta method, at the end of an implicit step. [`forward`] brings them up to date.
///
/// Errors: see [`StepError`]. Where the run diverged or had too many contacts, the state is what the failed step left;
/// otherwise it is as it was.
pub fn step(model: &Model, method: &Method, state: &mut State, data: &mut Data) -> Result<(), StepError> {
    check(model, method, state)?;
    data.follow(model);
    data.counts = Counts::default();
    let time = state.time;
    (method.integrator.advance)(model, method, state, data);
    data.unconverged += usize::from(data.counts.unconverged > 0 || data.solver.residual > CONVERGED);
    if data.counts.crowded > 0 {
        return Err(StepError::Crowded { time, most: model.pairs.most_contacts });
    }
    let placed = || sane(state.mocap_pos.as_flattened()) & sane(state.mocap_quat.as_flattened());
    if sane(&state.qpos) & sane(&state.qvel) & sane(&data.qacc) & (model.mocap.is_empty() || placed()) {
        Ok(())
    } else {
        Err(StepError::Diverged(diverged(model, state, data)))
    }
}

/// Why a step could not be taken.
#[derive(Clone, Debug, PartialEq)]
pub enum StepError {
    /// A position, velocity or acceleration, or the pose of a mocap body, is not finite or beyond 1e10 (MuJoCo's bound).
    Diverged(Diverged),
    /// More contacts than the scene may have ([`crate::mjcf::Limits::contacts`]).
    Crowded {
        /// When the step began, s.
        time: f64,
        /// The most that it may have.
        most: usize,
    },
    /// The timestep is not above zero, s.
    Timestep(f64),
    /// The state does not belong to this model.
    State(WrongState),
}

impl fmt::Display for StepError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            StepError::Diverged(diverged) => diverged.fmt(f),
            StepError::Crowded { time, most } => write!(
                f,
                "there are more than {most} contacts, or pairs of geoms near one another, in the step from {time:.6} s: begin \
                 with them apart, let fewer touch (`contype`, `conaffinity`), or raise the limit: `--limit contacts={}`",
                most.saturating_mul(2)
            ),
            StepError::Timestep(h) => write!(f, "a timestep of {h} s: it has to be above zero"),
            StepError::State(wrong) => wrong.fmt(f),
        }
    }
}

impl std::error::Error for StepError {}

impl StepError {
    /// Simulated time until which the run was good, s; 0 where it could not begin.
    pub fn time(&self) -> f64 {
        match self {
            StepError::Diverged(diverged) => diverged.time,
            StepError::Crowded { time, .. } => *time,
            StepError::Timestep(_) | StepError::State(_) => 0.0,
        }
    }
}

impl From<Diverged> for StepError {
    fn from(diverged: Diverged) -> StepError {
        StepError::Diverged(diverged)
    }
}

/// Whether timestep and state suit the model.
#[inline]
fn check(model: &Model, method: &Method, state: &State) -> Result<(), StepError> {
    let h = method.timestep;
    if !(h > 0.0 && h < f64::INFINITY) {
        return Err(StepError::Timestep(h));
    }
    state.suits(model).map_err(StepError::State)
}

/// A step whose contact forces are left with a larger residual than this counts as unconverged: under `penalty` 0.01 % of
/// the largest acceleration that a contact causes, under `mujoco` 1e-4 m/s².
const CONVERGED: f64 = 1e-4;

/// What a step begins with, unless it is implicit: [`forward`] at the state, the sensors there, and what the next step's
/// contact law starts from.
pub fn begin(model: &Model, method: &Method, state: &mut State, data: &mut Data) {
    forward(model, method, state, data);
    sensors::sense(model, method.contact, state, data);
    state.remember(method.contact.start, data);
}

/// Forces and accelerations at the state: everything but the integration.
///
/// | pass | reads | writes |
/// |---|---|---|
/// | `kinematics` | qpos | poses of bodies and geoms, twists of the dofs |
/// | `detect` | poses | contacts |
/// | `smooth` | qpos, qvel, ctrl, applied forces, poses | M and its factor, c, τ, qacc_smooth = M⁻¹ (τ − c) |
/// | `constrain` | contacts, qacc_smooth, qvel, the last step's forces | f, qfrc_constraint = Jᵀ f, qacc |
pub fn forward(model: &Model, method: &Method, state: &State, data: &mut Data) {
    data.follow(model);
    data.counts.forwards += 1;
    data.timestep = method.timestep;
    if !model.mocap.is_empty() {
        dynamics::mocap(model, state, data);
    }
    dynamics::kinematics(model, &state.qpos, data);
    collision::detect(model, data);
    dynamics::smooth(model, state, data);
    contact::constrain(model, &method.settings(), state, data);
    data.counts.unconverged += usize::from(!method.integrator.implicit && data.solver.residual > CONVERGED);
}
