//! One step on one page.

use crate::collision;
use crate::contact::{self, Law};
use crate::data::{Contact, Counts, Data};
use crate::dynamics;
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
    /// Newton steps that the `penalty` law takes at most, in each island; see [`ROUNDS`].
    pub rounds: usize,
}

/// What [`Method::rounds`] is without a wish: far more than a scene needs.
pub const ROUNDS: usize = 100;

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
    data.counts = Counts::default();
    (method.integrator.advance)(model, method, state, data);
    if sane(&state.qpos) & sane(&state.qvel) & sane(&data.qacc) { Ok(()) } else { Err(diverged(model, state, data)) }
}

/// Forces and accelerations at the state: everything but the integration.
pub fn forward(model: &Model, method: &Method, state: &State, data: &mut Data) {
    data.counts.forwards += 1;
    dynamics::kinematics(model, &state.qpos, data);
    collision::detect(model, data);
    dynamics::smooth(model, method, state, data);
    contact::constrain(model, method, state, data);
}

/// MuJoCo's bound on positions, velocities and accelerations.
const HUGE: f64 = 1e10;

/// A sum of squares is quick to find, and is neither infinite nor NaN if no number is. Only if it is large, look closer.
fn sane(numbers: &[f64]) -> bool {
    numbers.iter().map(|x| x * x).sum::<f64>() <= HUGE * HUGE || numbers.iter().all(|x| x.abs() <= HUGE)
}

/// Says which number left the bounds, and whose it is.
#[cold]
fn diverged(model: &Model, state: &State, data: &Data) -> Diverged {
    let quantities = [("qpos", &state.qpos), ("qvel", &state.qvel), ("qacc", &data.qacc)];
    let (quantity, index, value) = quantities
        .into_iter()
        .find_map(|(name, x)| Some(name).zip(x.iter().position(|x| !sane(&[*x]))).map(|(n, i)| (n, i, x[i])))
        .unwrap_or(("qpos", 0, f64::NAN));
    let body = match quantity {
        "qpos" => model.joints.iter().rev().find(|j| j.qposadr <= index).map_or(0, |j| j.body),
        _ => model.dofs[index].body,
    };
    let of_body = |c: &Contact| c.body.contains(&(body as u32));
    let deepest = |a: &usize, b: &usize| data.contacts[*a].dist.total_cmp(&data.contacts[*b].dist);
    let contact = (0..data.contacts.len()).filter(|&c| of_body(&data.contacts[c])).min_by(deepest);
    Diverged { time: state.time, body, quantity, index, value, contact }
}
