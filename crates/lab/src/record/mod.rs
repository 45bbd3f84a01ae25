//! Quantities over time: what a run leaves behind. Not part of a step.

mod balance;
mod csv;
mod json;
mod lines;
#[cfg(feature = "parquet")]
mod parquet;
mod picture;
mod quantity;
mod saved;

pub use balance::Balance;
pub use csv::{Csv, quoted};
pub use json::Json;
pub use lines::Lines;
#[cfg(feature = "parquet")]
pub use parquet::{Cells, Parquet, write_table};
pub use picture::Picture;
pub use quantity::{
    GROUPS, Group, Quantity, Side, chosen, clamped, pair_name, pairs, quantities, sides, usual, velocity,
};
pub use saved::{read_state, write_state};

use std::collections::BTreeSet;

use crate::names;
use penny::collision;
use penny::data::{Contact, Data};
use penny::dynamics::{self, energy};
use penny::forward::{Method, forward};
use penny::math::Vec3;
use penny::model::{JointKind, Model};
use penny::sensors;
use penny::state::State;

/// What there is to know about a state, besides the state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Kinetic and potential energy of all that moves, J.
    pub energy: f64,
    /// The kinetic part of it, J.
    pub kinetic: f64,
    /// Depth of the deepest contact, m; 0 without contact.
    pub penetration: f64,
    /// Contact points found.
    pub contacts: usize,
    /// Centre of mass of all that moves, m, and its speed, m/s; 0 where nothing moves.
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
        let moment: Vec3 = moving(model).map(|b| model.bodies[b].mass * dynamics::xipos(model, data, b)).sum();
        let per_mass = if self.mass > 0.0 { 1.0 / self.mass } else { 0.0 };
        Sample {
            energy: energy.kinetic + energy.potential,
            kinetic: energy.kinetic,
            penetration: deepest.abs(),
            contacts: data.contacts.len(),
            com: moment * per_mass,
            speed: momentum.linear.norm() * per_mass,
        }
    }

    /// The values of quantities at the state, contact forces as the law of `method` gives them there.
    pub fn values(
        &mut self,
        model: &Model,
        method: &Method,
        state: &State,
        sample: &Sample,
        quantities: &[Quantity],
    ) -> Vec<f64> {
        if quantities.is_empty() {
            return Vec::new();
        }
        self.forces(model, method, state);
        quantities.iter().map(|q| q.value(model, state, &self.data, sample)).collect()
    }

    /// Finds the forces of the law of `method` at the state, and what sensors measure there.
    pub fn forces(&mut self, model: &Model, method: &Method, state: &State) {
        forward(model, method, state, &mut self.data);
        sensors::sense(model, method.contact, state, &mut self.data);
    }

    /// What is known of the state that was measured last; forces after [`forces`](Recorder::forces).
    pub fn data(&self) -> &Data {
        &self.data
    }

    /// The contacts of the state that was measured last.
    pub fn contacts(&self) -> &[Contact] {
        &self.data.contacts
    }
}

/// The bodies that move.
fn moving(model: &Model) -> impl Iterator<Item = usize> + '_ {
    (0..model.bodies.len()).filter(|&b| model.bodies[b].tree.is_some())
}

/// One number of qpos.
#[derive(Clone, Debug, PartialEq)]
pub struct Coordinate {
    /// `z of disk`
    pub name: String,
    /// m, rad, or 1 for quaternions
    pub unit: &'static str,
    /// Index of its own velocity in qvel; quaternions have none.
    pub qvel: Option<usize>,
}

/// What each number of qpos is (nq).
pub fn coordinates(model: &Model) -> Vec<Coordinate> {
    // Axis and unit; how many of them have a velocity of their own.
    const FREE: [(&str, &str); 7] = [
        ("x of ", "m"),
        ("y of ", "m"),
        ("z of ", "m"),
        ("quaternion w of ", "1"),
        ("quaternion x of ", "1"),
        ("quaternion y of ", "1"),
        ("quaternion z of ", "1"),
    ];
    let mut list = Vec::new();
    for joint in &model.joints {
        let body = &model.bodies[joint.body].name;
        // A free body is known by its own name, a joint by the joint's.
        let whole = matches!(joint.kind, JointKind::Free | JointKind::Ball);
        let given = if whole { [body, &joint.name] } else { [&joint.name, body] };
        let named = given.into_iter().find(|name| !name.is_empty());
        let name = named.map_or_else(|| names::body(model, joint.body), String::clone);
        let (parts, own): (&[(&str, &str)], usize) = match joint.kind {
            JointKind::Free => (&FREE, 3),
            JointKind::Ball => (&FREE[3..], 0),
            JointKind::Slide => (&[("", "m")], 1),
            JointKind::Hinge => (&[("", "rad")], 1),
        };
        for (i, (axis, unit)) in parts.iter().enumerate() {
            let qvel = (i < own).then_some(joint.dofadr + i);
            list.push(Coordinate { name: format!("{axis}{name}"), unit, qvel });
        }
    }
    list
}

/// Names of the columns of a recording, in order; the quantities that were chosen come last. Each name stands once, as readers of
/// tables ask for: what is called as a column before it, such as a sensor like its joint, is `name.2`, and so on.
pub fn columns(model: &Model, quantities: &[Quantity]) -> Vec<String> {
    let mut names = vec!["time".to_owned()];
    names.extend((0..model.nq).map(|i| format!("qpos{i}")));
    names.extend((0..model.nv).map(|i| format!("qvel{i}")));
    names.extend(["energy", "penetration", "contacts"].map(str::to_owned));
    let mut taken: BTreeSet<String> = names.iter().cloned().collect();
    for quantity in quantities {
        let numbered = (2..).map(|i| format!("{}.{i}", quantity.name));
        let free = std::iter::once(quantity.name.clone()).chain(numbered).find(|name| taken.insert(name.clone()));
        names.extend(free);
    }
    names
}

/// A number with 17 significant digits: read back, it is the same number.
fn digits(x: f64) -> String {
    format!("{x:.16e}")
}

/// One row, as text, in the order of [`columns`].
pub fn row(state: &State, sample: &Sample, values: &[f64]) -> impl Iterator<Item = String> {
    let numbers = [state.time].into_iter().chain(state.qpos.clone()).chain(state.qvel.clone());
    let more = [sample.energy, sample.penetration];
    let own = numbers.chain(more).map(digits).chain([sample.contacts.to_string()]);
    own.chain(values.iter().map(|x| digits(*x)).collect::<Vec<_>>())
}
