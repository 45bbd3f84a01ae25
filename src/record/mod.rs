//! Quantities over time: what a run leaves behind. Not part of a step.

mod csv;
mod json;
mod picture;

pub use csv::Csv;
pub use json::Json;
pub use picture::Picture;

use crate::collision;
use crate::data::Data;
use crate::dynamics::{self, energy};
use crate::math::Vec3;
use crate::model::Model;
use crate::state::State;

/// What there is to know about a state, besides the state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Kinetic and potential energy of all that moves, J.
    pub energy: f64,
    /// Depth of the deepest contact, m; 0 without contact.
    pub penetration: f64,
    /// Contact points found.
    pub contacts: usize,
    /// Centre of mass of all that moves, m, and its speed, m/s.
    pub com: Vec3,
    pub speed: f64,
}

/// Measures states. It has a [`Data`] of its own, so looking at a run does not change it.
#[derive(Clone, Debug)]
pub struct Recorder {
    data: Data,
    /// Of all that moves, kg.
    mass: f64,
}

impl Recorder {
    pub fn new(model: &Model) -> Recorder {
        let mass = moving(model).map(|b| model.bodies[b].mass).sum();
        Recorder { data: Data::new(model), mass }
    }

    /// Measures one state, contacts at that very state included (a step's own contacts are those before it).
    pub fn sample(&mut self, model: &Model, state: &State) -> Sample {
        let data = &mut self.data;
        let energy = energy::energy(model, state, data);
        let momentum = energy::momentum(model, state, data);
        collision::detect(model, data);
        let deepest = data.contacts.iter().map(|c| c.dist).fold(0.0, f64::min);
        let com: Vec3 =
            moving(model).map(|b| model.bodies[b].mass * dynamics::xipos(model, data, b)).sum::<Vec3>() / self.mass;
        Sample {
            energy: energy.kinetic + energy.potential,
            penetration: deepest.abs(),
            contacts: data.contacts.len(),
            com,
            speed: momentum.linear.norm() / self.mass,
        }
    }
}

/// The bodies that move.
fn moving(model: &Model) -> impl Iterator<Item = usize> + '_ {
    (0..model.bodies.len()).filter(|&b| model.bodies[b].tree.is_some())
}

/// Names of the columns of a recording, in order.
pub fn columns(model: &Model) -> Vec<String> {
    let mut names = vec!["time".to_owned()];
    names.extend((0..model.nq).map(|i| format!("qpos{i}")));
    names.extend((0..model.nv).map(|i| format!("qvel{i}")));
    names.extend(["energy", "penetration", "contacts"].map(str::to_owned));
    names
}

/// A number with 17 significant digits: read back, it is the same number.
fn digits(x: f64) -> String {
    format!("{x:.16e}")
}

/// One row, as text, in the order of [`columns`].
fn row(state: &State, sample: &Sample) -> impl Iterator<Item = String> {
    let numbers = [state.time].into_iter().chain(state.qpos.clone()).chain(state.qvel.clone());
    let more = [sample.energy, sample.penetration];
    numbers.chain(more).map(digits).chain([sample.contacts.to_string()])
}
