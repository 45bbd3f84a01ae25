//! One step on one page.

use crate::contact::Law;
use crate::data::Data;
use crate::integrate::Integrator;
use crate::model::Model;
use crate::state::State;

/// How a model is computed: the same model runs under every method.
#[derive(Clone, Copy)]
pub struct Method {
    pub contact: &'static Law,
    pub integrator: &'static Integrator,
    /// s
    pub timestep: f64,
    /// Rounds of (normals, friction) in the `penalty` law; more approach exact Coulomb friction.
    pub rounds: usize,
}

/// A run that left the numbers a simulation can mean anything in.
#[derive(Clone, Debug, PartialEq)]
pub struct Diverged {
    pub time: f64,
    /// Index of the body.
    pub body: usize,
    /// `qpos`, `qvel` or `qacc`, and its index.
    pub quantity: &'static str,
    pub index: usize,
    pub value: f64,
    /// The deepest contact of that body at the time: index into `data.contacts`.
    pub contact: Option<usize>,
}

/// Advances the state by one timestep.
///
/// Errors: [`Diverged`] if a position, velocity or acceleration is not finite or beyond 1e10 (MuJoCo's bound);
/// the state is then what the failed step left.
pub fn step(model: &Model, method: &Method, state: &mut State, data: &mut Data) -> Result<(), Diverged> {
    (method.integrator.advance)(model, method, state, data);
    Ok(())
}

/// Forces and accelerations at the state: everything but the integration.
pub fn forward(model: &Model, method: &Method, state: &State, data: &mut Data) {
    let _ = (model, state);
    data.counts.forwards += 1;
    (method.contact.solve)(model, method, state, data);
}
