//! One run: where everything was at a few times, and how well the contacts kept their laws.

use serde::{Deserialize, Serialize};

use super::Case;
use crate::explain::joints;
use penny::control::extent;
use penny::data::{Contact, Data};
use penny::dynamics::{self, energy};
use penny::forward::{Method, StepError, step};
use penny::math::{Quat, Vec3, quat, vec3};
use penny::model::Model;
use penny::state::State;

/// Times at which trajectories are compared, besides the start.
pub const SAMPLES: usize = 8;

/// A body somewhere.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(into = "[f64; 7]", from = "[f64; 7]")]
pub struct Pose {
    /// Centre of mass, m.
    pub com: Vec3,
    pub quat: Quat,
}

/// x, y, z, and the quaternion w, x, y, z.
impl From<Pose> for [f64; 7] {
    fn from(Pose { com, quat }: Pose) -> [f64; 7] {
        [com.x, com.y, com.z, quat.w, quat.i, quat.j, quat.k]
    }
}

impl From<[f64; 7]> for Pose {
    fn from(numbers: [f64; 7]) -> Pose {
        Pose { com: vec3(&numbers), quat: quat(&numbers[3..]) }
    }
}

/// What a run showed.
#[derive(Clone, Debug)]
pub struct Trajectory {
    /// Poses of the moving bodies at the samples; fewer where the run diverged.
    pub samples: Vec<Vec<Pose>>,
    pub measures: Measures,
    pub failed: Option<StepError>,
}

/// Residuals of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measures {
    /// Energy at the end less that at the start, over the largest kinetic energy.
    pub energy_change: f64,
    /// Largest energy less that at the start, over the largest kinetic energy.
    pub energy_gain: f64,
    /// Deepest contact, m.
    pub penetration: f64,
    /// Mean over the steps of Σ F_n |dist|, J: a rigid contact pushes only at distance 0.
    pub complementarity: f64,
    /// Largest excess of friction over its cone, (|F_t| − μ F_n)/F_n.
    pub cone: f64,
}

/// The timestep nearest to the wanted one that reaches every sample with whole steps, and the steps between samples.
///
/// Out: s, steps.
pub fn fit(seconds: f64, timestep: f64) -> (f64, usize) {
    let each = (seconds / timestep / SAMPLES as f64).round().max(1.0) as usize;
    (seconds / (each * SAMPLES) as f64, each)
}

/// Runs a case. The method's timestep must come from [`fit`].
pub fn run(case: &Case, method: &Method) -> Trajectory {
    let (_, each) = fit(case.seconds, method.timestep);
    let (mut state, mut data, mut scratch) = (case.start.clone(), Data::new(&case.model), Data::new(&case.model));
    // Actuators hold their controls: what they do is a potential, and no instability.
    let energy = |state: &State, scratch: &mut Data| {
        let mut e = energy::energy(&case.model, state, scratch);
        e.potential += joints::actuator_potential(&case.model, state);
        e
    };
    let mut energies = vec![energy(&state, &mut scratch)];
    let mut found = Trajectory { samples: Vec::new(), measures: Measures::default(), failed: None };
    let mut steps = 0;
    'run: for _ in 0..SAMPLES {
        for i in 0..each {
            if let Err(error) = step(&case.model, method, &mut state, &mut data) {
                found.failed = Some(error);
                break 'run;
            }
            steps += 1;
            contacts(&case.model, &data.contacts, &mut found.measures);
            // Sixty-four energies a run, or one a step where there are fewer steps.
            if i % each.div_ceil(64 / SAMPLES) == 0 || i + 1 == each {
                energies.push(energy(&state, &mut scratch));
            }
        }
        found.samples.push(poses(&case.model, &state.qpos, &mut scratch));
    }
    let total = |e: &energy::Energy| e.kinetic + e.potential;
    let scale = energies.iter().map(|e| e.kinetic).fold(f64::MIN_POSITIVE, f64::max);
    let (first, last) = (total(&energies[0]), total(&energies[energies.len() - 1]));
    let measures = &mut found.measures;
    measures.energy_change = (last - first) / scale;
    // What drives a scene without a potential cannot be told from an error: only divergence is.
    let judged = if joints::have_potential(&case.model) { 1.0 } else { 0.0 };
    measures.energy_gain = judged * (energies.iter().map(total).fold(first, f64::max) - first) / scale;
    measures.complementarity /= f64::from(steps.max(1));
    found
}

fn contacts(model: &Model, contacts: &[Contact], measures: &mut Measures) {
    for contact in contacts {
        let [normal, t1, t2, ..] = contact.force;
        measures.penetration = measures.penetration.max(-contact.dist);
        measures.complementarity += normal * contact.dist.abs();
        if normal > 0.0 {
            let excess = t1.hypot(t2) / normal - model.mixes[contact.mix as usize].friction[0];
            measures.cone = measures.cone.max(excess);
        }
    }
}

/// Where the moving bodies are.
pub fn poses(model: &Model, qpos: &[f64], scratch: &mut Data) -> Vec<Pose> {
    dynamics::kinematics(model, qpos, scratch);
    let data = &*scratch;
    moving(model).map(|b| Pose { com: dynamics::xipos(model, data, b), quat: data.xquat[b] }).collect()
}

fn moving(model: &Model) -> impl Iterator<Item = usize> + '_ {
    (0..model.bodies.len()).filter(|&b| model.bodies[b].tree.is_some())
}

/// How far a sequence of poses is from another: the largest distance of any body at any sample.
///
///     e² = |Δcom|² + (ρ Δangle)²,   ρ: reach of the body's geoms about its frame
///
/// Out: m; `None` if one of the two ended early.
pub fn distance(model: &Model, a: &[Vec<Pose>], b: &[Vec<Pose>]) -> Option<f64> {
    if a.len() != b.len() {
        return None;
    }
    let radii: Vec<f64> = moving(model).map(|b| extent(model, &model.bodies[b])).collect();
    let pairs = a.iter().flatten().zip(b.iter().flatten()).zip(radii.iter().cycle());
    let mut errors = pairs.map(|((a, b), r)| (a.com - b.com).norm().hypot(r * a.quat.angle_to(&b.quat)));
    errors.try_fold(0.0, |largest: f64, e| e.is_finite().then(|| largest.max(e)))
}
