//! The cheapest proof: what a search would cost that knows beforehand which two runs to take.
//!
//!     d, how far two runs are apart:   d ≤ wanted,   or of one integrator, with knobs x₁ > x₂:   d / ((x₁/x₂)^p − 1) ≤ wanted
//!
//! One of the two is within what is wanted of the truth, which a search does not know. The estimate has no margin, and p is the
//! order that the integrator has where nothing touches (1 of tolerances): a search that tells errors by comparing runs is
//! cheaper only by runs between those that are tried here.
//!
//! A search that knows the integrator, but not its step, comes to the finer run of two by halving steps, and takes as much
//! again for that: 1 + 1/2 + 1/4 + … = 2. Of controlled steps two runs are enough.

use penny::contact::Law;
use penny::control::Controlled;
use penny::data::Data;
use penny::forward::{Method, ROUNDS, step};
use penny::integrate::{self, Integrator};
use penny_lab::accuracy::SAMPLES;
use penny_lab::accuracy::survey::Samples;
use penny_lab::sweep::Case;
use penny_lab::sweep::trajectory::{distance, poses};

/// Fixed steps in a run that are longer than the time between samples, and fixed steps a sample.
const LONG: [usize; 3] = [8, 16, 32];
const EACH: [usize; 2] = [2, 3];
/// Tolerances of controlled runs, in parts of what is wanted: powers of √10.
const TOLERANCES: std::ops::Range<i32> = -6..7;

/// A run that may be one of the two.
struct Run {
    integrator: &'static Integrator,
    controlled: bool,
    /// Timestep or tolerance.
    knob: f64,
    samples: Samples,
    /// Samples of the truth for each of its own.
    stride: usize,
    evaluations: usize,
    /// Whether it is within what is wanted.
    good: bool,
}

/// Looks for the cheapest two.
struct Search<'c> {
    case: &'c Case,
    law: &'static Law,
    wanted: f64,
    truth: &'c Samples,
    runs: Vec<Run>,
    /// Evaluations of what it is compared with.
    fixed: usize,
    best: Proof,
}

/// Evaluations of the cheapest two runs, and of the cheapest ladder to such runs of one integrator.
#[derive(Clone, Copy)]
pub struct Proof {
    pub two: usize,
    pub ladder: usize,
}

/// Nothing is sought beyond this many times the cheapest fixed steps.
const MOST: usize = 4;

/// The cheapest proofs of an accuracy (m), beside fixed steps that took this many evaluations; what is not found is `MOST` times that.
pub fn cheapest(case: &Case, law: &'static Law, wanted: f64, truth: &Samples, fixed: usize) -> Proof {
    let best = Proof { two: MOST * fixed, ladder: MOST * fixed };
    let mut search = Search { case, law, wanted, truth, runs: Vec::new(), fixed, best };
    for integrator in integrate::ALL.iter().filter(|i| i.estimate.is_some()) {
        for power in TOLERANCES.rev() {
            if !search.controlled(integrator, wanted * 10f64.powf(0.5 * f64::from(power))) {
                break;
            }
        }
    }
    // Coarse ones of all integrators first: they bound what others may take.
    let doubled = (0..usize::BITS - 8).flat_map(|k| EACH.map(|each| (SAMPLES / 2 * each) << k));
    let doubled = doubled.filter(|steps| steps % SAMPLES == 0);
    let mut left: Vec<&'static Integrator> = integrate::ALL.to_vec();
    for steps in LONG.into_iter().chain(doubled) {
        left.retain(|integrator| search.fixed(integrator, steps));
    }
    search.best
}

impl Search<'_> {
    /// A run of more evaluations is of no use.
    fn most(&self) -> usize {
        self.best.two.max(self.fixed + 1)
    }

    fn method(&self, integrator: &'static Integrator, timestep: f64) -> Method {
        Method { contact: self.law, integrator, timestep, rounds: ROUNDS }
    }

    /// Tries a run of this many steps. Out: whether a finer one may still be of use.
    fn fixed(&mut self, integrator: &'static Integrator, steps: usize) -> bool {
        let case = self.case;
        let (stride, each) = ((SAMPLES / steps).max(1), (steps / SAMPLES).max(1));
        let method = self.method(integrator, case.seconds / steps as f64);
        let (mut state, mut data, mut scratch) = (case.start.clone(), Data::new(&case.model), Data::new(&case.model));
        let (mut samples, mut evaluations) = (Vec::new(), 0);
        for i in 1..=steps {
            if step(&case.model, &method, &mut state, &mut data).is_err() {
                return true;
            }
            evaluations += data.counts.forwards;
            if evaluations >= self.most() {
                return false;
            }
            if i % each == 0 {
                samples.push(poses(&case.model, &state.qpos, &mut scratch));
            }
        }
        self.add(Run {
            integrator,
            controlled: false,
            knob: method.timestep,
            samples,
            stride,
            evaluations,
            good: false,
        });
        true
    }

    /// The same of steps of controlled size.
    fn controlled(&mut self, integrator: &'static Integrator, knob: f64) -> bool {
        let (case, method) = (self.case, self.method(integrator, self.case.model.opt.timestep));
        let (start, end) = (case.start.time, case.start.time + case.seconds);
        let Ok(mut run) = Controlled::new(&case.model, &method, &case.start, knob, end) else { return false };
        let (mut samples, mut scratch) = (Vec::new(), Data::new(&case.model));
        for i in 1..=SAMPLES {
            let time = start + case.seconds * i as f64 / SAMPLES as f64;
            while run.state().time < time {
                if run.advance().is_err() || run.effort().evaluations + run.looks() >= self.most() {
                    return false;
                }
            }
            let Ok(state) = run.at(time, usize::MAX) else { return false };
            samples.push(poses(&case.model, &state.qpos, &mut scratch));
        }
        let evaluations = run.effort().evaluations + run.looks();
        self.add(Run { integrator, controlled: true, knob, samples, stride: 1, evaluations, good: false });
        true
    }

    /// Compares a run with the truth and with all others.
    fn add(&mut self, mut run: Run) {
        let error = distance(&self.case.model, &run.samples, self.truth);
        run.good = run.stride == 1 && error.is_some_and(|error| error <= self.wanted);
        for other in &self.runs {
            let both = other.evaluations + run.evaluations;
            if !(run.good || other.good) || !self.shows(&run, other) {
                continue;
            }
            self.best.two = self.best.two.min(both);
            if other.integrator.name == run.integrator.name && other.controlled == run.controlled {
                let ladder = if run.controlled { both } else { 2 * run.evaluations.max(other.evaluations) };
                self.best.ladder = self.best.ladder.min(ladder);
            }
        }
        self.runs.push(run);
    }

    /// Whether two runs show that the finer one is within what is wanted.
    fn shows(&self, a: &Run, b: &Run) -> bool {
        let stride = a.stride.max(b.stride);
        let common = |run: &Run| -> Samples {
            let each = stride / run.stride;
            run.samples.iter().skip(each - 1).step_by(each).cloned().collect()
        };
        let Some(apart) = distance(&self.case.model, &common(a), &common(b)) else { return false };
        let (fine, coarse) = if a.knob < b.knob { (a, b) } else { (b, a) };
        let alike = a.integrator.name == b.integrator.name && a.controlled == b.controlled && fine.good;
        let order = if a.controlled { 1.0 } else { f64::from(a.integrator.order) };
        apart <= self.wanted || alike && apart <= self.wanted * ((coarse.knob / fine.knob).powf(order) - 1.0)
    }
}
