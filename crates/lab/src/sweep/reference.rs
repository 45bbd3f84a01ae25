//! What the runs of a sweep are compared with.

use serde::{Deserialize, Serialize};

use super::trajectory::{self, Pose, distance, fit};
use super::{Case, on_all_cores};
use crate::plot::number;
use penny::contact::Law;
use penny::data::Data;
use penny::forward::Method;
use penny::integrate::{self, Integrator};

/// A trajectory that counts as the truth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    pub samples: Vec<Vec<Pose>>,
    /// Change when its own timestep was halved, m: smaller errors mean nothing.
    pub uncertainty: f64,
    /// What it is: "rk4 at 2.5 µs".
    pub about: String,
    /// s
    pub timestep: f64,
}

/// Steps that a reference may take.
const MOST_STEPS: f64 = 2e6;
/// Its timestep is this much smaller than the smallest of the sweep.
const FINER: f64 = 4.0;

/// Timestep of the references of a sweep whose smallest timestep is given, s.
pub fn timestep(case: &Case, smallest: f64) -> f64 {
    (smallest / FINER).max(case.seconds / MOST_STEPS)
}

/// Steps of all runs that [`converged`] takes for this many laws.
pub fn work(case: &Case, laws: usize, smallest: f64) -> u64 {
    let steps = case.seconds / timestep(case, smallest);
    (1.5 * steps * (laws * CANDIDATES.len()) as f64) as u64
}

/// Integrators that a reference may use.
const CANDIDATES: [&Integrator; 2] = [&integrate::rk4::METHOD, &integrate::semi_implicit_euler::METHOD];

/// Each law at a much smaller timestep, by the integrator that changes least when that timestep is doubled. On all
/// cores; `finished` is told the steps of each run.
///
/// Out: by law; `None` where it diverges even there.
pub fn converged(
    case: &Case,
    laws: &[&'static Law],
    smallest: f64,
    finished: impl Fn(u64) + Sync,
) -> Vec<Option<Reference>> {
    let fine = timestep(case, smallest);
    let mut runs = Vec::new();
    for &contact in laws {
        for integrator in CANDIDATES {
            runs.extend([fine, 2.0 * fine].map(|h| Method {
                contact,
                integrator,
                timestep: fit(case.seconds, h).0,
                rounds: penny::forward::ROUNDS,
            }));
        }
    }
    let samples = on_all_cores(runs.len(), |i| {
        let samples = trajectory::run(case, &runs[i]).samples;
        finished((case.seconds / runs[i].timestep) as u64);
        samples
    });
    let mut found = samples.chunks_exact(2).zip(runs.chunks_exact(2)).map(|(pair, runs)| {
        let uncertainty = distance(&case.model, &pair[0], &pair[1])?;
        (pair[0].len() == trajectory::SAMPLES).then(|| Reference {
            samples: pair[0].clone(),
            uncertainty,
            about: format!("{} at h = {} s", runs[0].integrator.name, number(fine)),
            timestep: fine,
        })
    });
    let best = |_: &&'static Law| {
        let candidates: Vec<_> = found.by_ref().take(CANDIDATES.len()).flatten().collect();
        candidates.into_iter().min_by(|a, b| a.uncertainty.total_cmp(&b.uncertainty))
    };
    laws.iter().map(best).collect()
}

/// Poses of a run that something else made, from its qpos at the samples (the start first).
pub fn from_qpos(case: &Case, rows: &[Vec<f64>]) -> Vec<Vec<Pose>> {
    let mut scratch = Data::new(&case.model);
    rows.iter().skip(1).map(|qpos| trajectory::poses(&case.model, qpos, &mut scratch)).collect()
}
