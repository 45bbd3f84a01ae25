//! The load that each contact really carries: found by letting the scene settle.

use std::collections::BTreeMap;

use super::Budget;
use penny::data::Data;
use penny::forward::{Method, step};
use penny::model::Model;
use penny::state::State;

/// Simulated time after which a scene counts as settled, s.
const SETTLING: f64 = 4.0;
/// The last part of it, in which forces are averaged.
const LAST: f64 = 0.25;
/// Steps between two looks at the clock.
const STRIDE: usize = 16;

/// Mean normal forces of pairs of geoms over the end of a run from `start`, N.
#[derive(Clone, Debug, Default)]
pub struct Loads {
    pairs: BTreeMap<[usize; 2], f64>,
    /// How long was simulated, s; 0 if the run failed.
    pub seconds: f64,
}

impl Loads {
    pub fn of(&self, geom: [usize; 2]) -> f64 {
        self.pairs.get(&geom).copied().unwrap_or(0.0)
    }
}

/// Lets the scene run for [`SETTLING`], or as far as the budget goes: then the forces are those of the last quarter.
pub fn settle(model: &Model, method: &Method, start: &State, budget: &Budget) -> Loads {
    let (mut state, mut data) = (start.clone(), Data::new(model));
    let steps = (SETTLING / method.timestep).ceil() as usize;
    // Sums over stretches of a sixteenth, so that the last quarter is known wherever the run ends.
    let stretch = (steps / 16).max(1);
    let mut sums: Vec<(usize, BTreeMap<[usize; 2], f64>)> = Vec::new();
    let mut taken = 0;
    for i in 0..steps {
        if (i % STRIDE == 0 && !budget.left()) || step(model, method, &mut state, &mut data).is_err() {
            break;
        }
        if i % stretch == 0 {
            sums.push((0, BTreeMap::new()));
        }
        let Some((count, sum)) = sums.last_mut() else { break };
        *count += 1;
        for contact in data.contacts.iter().filter(|c| c.force[0] != 0.0) {
            *sum.entry(contact.geom.map(|g| g as usize)).or_default() += contact.force[0];
        }
        taken = i + 1;
    }
    let last = ((sums.len() as f64 * LAST).ceil() as usize).max(1);
    let counted = &sums[sums.len().saturating_sub(last)..];
    let count: usize = counted.iter().map(|(n, _)| n).sum();
    let mut pairs = BTreeMap::new();
    for (geom, force) in counted.iter().flat_map(|(_, sum)| sum) {
        *pairs.entry(*geom).or_default() += force / count.max(1) as f64;
    }
    Loads { pairs, seconds: taken as f64 * method.timestep }
}
