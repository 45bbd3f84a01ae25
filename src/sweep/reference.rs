//! What the runs of a sweep are compared with.

use super::Case;
use super::trajectory::{self, Pose, distance, fit};
use crate::contact::Law;
use crate::data::Data;
use crate::forward::Method;
use crate::integrate::{self, Integrator};
use crate::plot::number;

/// A trajectory that counts as the truth.
#[derive(Clone, Debug)]
pub struct Reference {
    pub samples: Vec<Vec<Pose>>,
    /// Change when its own timestep was halved, m: smaller errors mean nothing.
    pub uncertainty: f64,
    /// What it is: "rk4 at 2.5 µs".
    pub about: String,
}

/// Steps that a reference may take.
const MOST_STEPS: f64 = 2e6;
/// Its timestep is this much smaller than the smallest of the sweep.
const FINER: f64 = 4.0;

/// The law at a much smaller timestep, by the integrator that changes least when that timestep is doubled.
///
/// `None` if the law diverges even there.
pub fn converged(case: &Case, law: &'static Law, smallest: f64) -> Option<Reference> {
    let fine = (smallest / FINER).max(case.seconds / MOST_STEPS);
    let candidates = [integrate::rk4::METHOD.name, integrate::semi_implicit_euler::METHOD.name];
    let of = |name: &&str| reference(case, law, integrate::by_name(name)?, fine);
    candidates.iter().filter_map(of).min_by(|a, b| a.uncertainty.total_cmp(&b.uncertainty))
}

fn reference(case: &Case, contact: &'static Law, integrator: &'static Integrator, fine: f64) -> Option<Reference> {
    let run = |h: f64| {
        let (timestep, _) = fit(case.seconds, h);
        trajectory::run(case, &Method { contact, integrator, timestep, rounds: ROUNDS }).samples
    };
    let (samples, coarser) = (run(fine), run(2.0 * fine));
    let uncertainty = distance(&case.model, &samples, &coarser)?;
    let complete = samples.len() == trajectory::SAMPLES;
    complete.then(|| Reference {
        samples,
        uncertainty,
        about: format!("{} at h = {} s", integrator.name, number(fine)),
    })
}

/// Rounds of the penalty law in a reference.
const ROUNDS: usize = 1;

/// Poses of a run that something else made, from its qpos at the samples (the start first).
pub fn from_qpos(case: &Case, rows: &[Vec<f64>]) -> Vec<Vec<Pose>> {
    let mut scratch = Data::new(&case.model);
    rows.iter().skip(1).map(|qpos| trajectory::poses(&case.model, qpos, &mut scratch)).collect()
}
