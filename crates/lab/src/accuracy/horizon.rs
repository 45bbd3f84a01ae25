//! How fast a small difference grows in a scene, and so for how long a result can be trusted.
//!
//!     δ(t) = twin ⊖ run, set back to 1e-9 m at every sample;    growth G(t) = Π |δ| after / |δ| before
//!
//! An error made at time s is G(t)/G(s) times as large at time t: beyond the time where the rounding of numbers, grown by G,
//! passes a tolerance, no method has it.
//!
//! A force that jumps with the sign of a velocity (the tutorial law's rolling friction) makes twins part that no error
//! would: where runs of other steps agree, they are right and the twins are not.
//!
//! Source: G. Benettin, L. Galgani, A. Giorgilli, J.-M. Strelcyn, Meccanica 15 (1980), 9–30 (largest Lyapunov exponent).

use super::{SAMPLES, Stepping};
use crate::sweep::Case;
use penny::control::{Controlled, Failed, sizes};
use penny::data::Data;
use penny::forward::{Method, step};
use penny::integrate::{difference, displace};
use penny::model::Model;
use penny::state::State;

/// How a small difference grew.
#[derive(Clone, Debug, Default)]
pub struct Growth {
    /// Times of the samples, s after the start.
    pub times: Vec<f64>,
    /// ln G at each of them.
    pub log: Vec<f64>,
}

/// The first difference, m.
const APART: f64 = 1e-9;
/// What rounding makes of a position in a step or a few, m per m of size.
const ROUNDING: f64 = 1e-15;

impl Growth {
    /// Lyapunov exponent over the second half of the run, 1/s: the growth of ln |δ|.
    pub fn exponent(&self) -> f64 {
        let (Some(last), half) = (self.log.len().checked_sub(1), self.log.len() / 2) else { return 0.0 };
        if last == half { 0.0 } else { (self.log[last] - self.log[half]) / (self.times[last] - self.times[half]) }
    }

    /// The time in which errors double where they grow fastest, over an eighth of the run, s; `None` where they do not.
    pub fn doubling(&self) -> Option<f64> {
        let window = (self.log.len() / 8).max(1);
        let over = |i: usize| [self.log[i] - self.log[i - window], self.times[i] - self.times[i - window]];
        // A step may be longer than the time between two samples.
        let rates = (window..self.log.len()).map(over).filter(|[_, time]| *time > 0.0).map(|[log, time]| log / time);
        let fastest = rates.fold(0.0, f64::max);
        (fastest > 0.0).then(|| std::f64::consts::LN_2 / fastest)
    }

    /// What rounding alone makes of a position by the end of the run, m.
    pub fn floor(&self) -> f64 {
        let (mut least, mut most) = (0.0f64, 0.0f64);
        for log in &self.log {
            least = least.min(*log);
            most = most.max(log - least);
        }
        ROUNDING * most.exp()
    }

    /// Until when rounding alone stays within a tolerance (m), s after the start; `None` if for the whole run.
    pub fn horizon(&self, tolerance: f64) -> Option<f64> {
        // What was made when errors had shrunk most grows from there.
        let mut least = 0.0f64;
        self.times.iter().zip(&self.log).find_map(|(t, log)| {
            least = least.min(*log);
            (ROUNDING.ln() + log - least > tolerance.ln()).then_some(*t)
        })
    }
}

/// Parts of a step that the twins take. Where springs are stiff, controlled steps of an explicit method are as long as its
/// stability allows, or longer while what grows is below the tolerance: so the steps are those for a tolerance below
/// [`APART`], and a part of them.
const PARTS: usize = 4;

/// Controlled steps that the twins follow at most.
const MOST_STEPS: usize = 20_000;

/// Runs a case twice, 1e-9 m apart, with the steps of a method that resolves its motion, each in [`PARTS`].
///
/// Errors: a run diverged.
pub fn growth(case: &Case, method: &Method, stepping: Stepping) -> Result<Growth, Failed> {
    let case = &case.exact();
    let model = &case.model;
    let (start, end) = (case.start.time, case.start.time + case.seconds);
    let mut guide = match stepping {
        Stepping::Fixed(_) => None,
        Stepping::Controlled(_) => Some(Controlled::new(model, method, &case.start, 0.1 * APART, end)?),
    };
    let (mut run, mut twin) = (case.start.clone(), case.start.clone());
    let mut data = [Data::new(model), Data::new(model)];
    let sizes = sizes(model, &case.start.qpos, &mut data[0]);
    let mut apart = vec![0.0; 2 * model.nv];
    fresh(&mut apart);
    // A velocity counts by what it moves until the next sample.
    let each = case.seconds / SAMPLES as f64;
    let mut found = Growth::default();
    let mut log = 0.0;
    for i in 1..=SAMPLES {
        place(model, &run, &mut twin, &sizes, each, &mut apart);
        // The last step may end a little before the sample.
        while run.time < start + (i as f64 - 1e-6) * each {
            let timestep = match &mut guide {
                None => method.timestep,
                Some(guide) => {
                    guide.advance()?;
                    let taken = guide.effort().steps;
                    if taken > MOST_STEPS {
                        return Err(Failed::TooManySteps(MOST_STEPS, guide.state().time));
                    }
                    guide.state().time - run.time
                }
            };
            let part = Method { timestep: timestep / PARTS as f64, ..*method };
            for _ in 0..PARTS {
                let [a, b] = &mut data;
                step(model, &part, &mut run, a).map_err(Failed::Step)?;
                step(model, &part, &mut twin, b).map_err(Failed::Step)?;
            }
        }
        let (q, v) = apart.split_at_mut(model.nv);
        difference(model, &twin.qpos, &run.qpos, q);
        v.iter_mut().zip(twin.qvel.iter().zip(&run.qvel)).for_each(|(d, (a, b))| *d = a - b);
        let size = norm(&apart, &sizes, each);
        log += (size.max(ROUNDING) / APART).ln();
        found.times.push(run.time - start);
        found.log.push(log);
    }
    Ok(found)
}

/// Puts the twin at [`APART`] from the run, along `apart`.
fn place(model: &Model, run: &State, twin: &mut State, sizes: &[f64], time: f64, apart: &mut [f64]) {
    let scale = APART / norm(apart, sizes, time).max(f64::MIN_POSITIVE);
    apart.iter_mut().for_each(|x| *x *= scale);
    let (q, v) = apart.split_at(model.nv);
    twin.copy_from(run);
    displace(model, &mut twin.qpos, q, 1.0);
    twin.qvel.iter_mut().zip(v).for_each(|(twin, v)| *twin += v);
}

/// A direction that is none of the scene's own.
fn fresh(apart: &mut [f64]) {
    apart.iter_mut().enumerate().for_each(|(i, x)| *x = (1.0 + (i + 1) as f64 * 0.7548776662466927).fract() - 0.5);
}

/// m; velocities by the way that they make in a time, s.
fn norm(apart: &[f64], sizes: &[f64], time: f64) -> f64 {
    let (q, v) = apart.split_at(sizes.len());
    q.iter().zip(v).zip(sizes).map(|((q, v), size)| (q * size).powi(2) + (time * v * size).powi(2)).sum::<f64>().sqrt()
}
