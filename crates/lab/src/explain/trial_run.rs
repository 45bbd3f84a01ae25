//! Whether a run would gain energy from nowhere, found by trying: the start of the run, simulated before it is told.
//!
//! A limit of one contact's spring ([`super::probe`]) knows nothing of a body that tilts between several contacts, of
//! impacts, or of friction that changes its sign in every step.

use super::{Budget, joints};
use penny::data::Data;
use penny::dynamics::{self, energy};
use penny::forward::{Method, forward, step};
use penny::model::Model;
use penny::state::State;

/// A trial run ends after this many evaluations of the forces on one tree: a few hundredths of a second of computing.
const MOST_FORWARDS: usize = 20_000;
/// And after so long, s: some scenes take long to show it.
const LONGEST: f64 = 10.0;
/// Steps between two looks at the energy.
const STRIDE: usize = 8;
/// Timesteps tried below one that gains energy, each this much smaller than the one before.
const SMALLER: f64 = 0.8;
const TRIES: usize = 24;

/// The largest timestep of those tried at which the start of the run gains no energy; `None` if the method's own is
/// fine, 0 if none was found.
///
/// Controls stay as they are at the start, and what they do is weighed as a potential; `None` if some actuator has none. Also `None` where the budget ends
/// before anything is found.
///
/// Out: s.
pub fn largest_timestep(model: &Model, method: &Method, start: &State, budget: &Budget) -> Option<f64> {
    let gains = |h: f64| gains(model, &Method { timestep: h, ..*method }, start, budget);
    if model.nv == 0 || !joints::have_potential(model) || !gains(method.timestep) {
        return None;
    }
    // Two in a row: what lies between chance and the limit may pass once.
    let (mut h, mut passed) = (method.timestep, None);
    for _ in 0..TRIES {
        h *= SMALLER;
        if !budget.left() {
            return passed;
        }
        match passed {
            _ if gains(h) => passed = None,
            None => passed = Some(h),
            Some(_) => return Some(h),
        }
    }
    Some(0.0)
}

/// Whether more energy is gained than the integration error explains.
///
///     E − E₀ > S₀ + T/5 + 2 M g h (v + g h),     T = M v²/2 the largest kinetic energy so far
///
/// What is pressed or stretched at the start gives back S₀ = Σ F d at most ([`stored`]).
/// Semi-implicit Euler holds the energy at half steps, where M g v h/2 is uncertain.
fn gains(model: &Model, method: &Method, start: &State, budget: &Budget) -> bool {
    let (mut state, mut data, mut looked) = (start.clone(), Data::new(model), Data::new(model));
    let (h, g) = (method.timestep, dynamics::gravity(model).norm());
    let mass: f64 = model.bodies.iter().filter(|b| b.tree.is_some()).map(|b| b.mass).sum();
    let mut sum = |state: &State| {
        let energy = energy::energy(model, state, &mut looked);
        (energy.kinetic, energy.kinetic + energy.potential + joints::actuator_potential(model, state))
    };
    let (mut most, before) = sum(&state);
    forward(model, method, &state, &mut data);
    let before = before + stored(&data);
    let steps = (LONGEST / h).ceil() as usize;
    let mut forwards = 0;
    for i in 1..=steps {
        if step(model, method, &mut state, &mut data).is_err() {
            return true;
        }
        forwards += data.counts.forwards * model.trees.len();
        let last = i == steps || forwards > MOST_FORWARDS;
        if i % STRIDE == 0 || last {
            if !budget.left() {
                return false;
            }
            let (kinetic, now) = sum(&state);
            most = f64::max(most, kinetic);
            let speed = (2.0 * most / mass).sqrt();
            let within_error = now - before <= 0.2 * most + 2.0 * mass * g * h * (speed + g * h);
            if !within_error {
                return true;
            }
        }
        if last {
            break;
        }
    }
    false
}

/// At most what contacts, limits and equalities can give back: Σ |F d|, J. Reads: what `forward` leaves.
pub fn stored(data: &Data) -> f64 {
    let contacts = data.contacts.iter().map(|c| c.force[0] * c.dist);
    let limits = data.joint_rows.iter().map(|row| row.force * row.violation);
    let ties = data.ties.iter().flat_map(|tie| (0..tie.dim).map(|i| tie.force[i] * tie.violation[i]));
    contacts.chain(limits).chain(ties).map(f64::abs).sum()
}
