//! One integrator at finer and finer knobs: its timestep, or the tolerance of its controlled steps.
//!
//!     two runs, knobs x₁ > x₂, apart by d:    e₂ = d / ((x₁/x₂)^p − 1),   e₁ = d + e₂,    e ~ xᵖ
//!
//! with the order p that three runs show. A run of an integrator of another order errs otherwise: how far the two are apart is
//! what the worse of them errs, or nearly so.

use super::{Choice, MOST_EVALUATIONS, SAMPLES, Stepping};
use crate::sweep::Case;
use crate::sweep::trajectory::{Pose, distance, poses};
use penny::contact::Law;
use penny::control::{Controlled, Effort, extent};
use penny::data::Data;
use penny::forward::{Method, ROUNDS, step};
use penny::integrate::Integrator;
use penny::state::State;

/// One run of a ladder.
pub struct Rung {
    pub knob: f64,
    pub samples: Vec<Vec<Pose>>,
    pub evaluations: usize,
    timestep: f64,
    steps: usize,
    /// Steps that it would have taken had it not ended early; 0 of controlled ones.
    planned: f64,
    effort: Option<Effort>,
    end: State,
    /// From the rung before, m; none for the first, and where one of the two ended early.
    difference: Option<f64>,
}

/// An integrator at finer and finer knobs.
pub struct Ladder {
    pub integrator: &'static Integrator,
    pub controlled: bool,
    pub rungs: Vec<Rung>,
    /// Evaluations of the first run at least, as far as is known.
    least: f64,
    /// No run was better than the one before, and how often.
    stuck: bool,
}

/// An error, and by how much it may be wrong.
#[derive(Clone, Copy, Debug)]
pub struct Bound {
    /// m
    pub error: f64,
    /// Factor.
    pub margin: f64,
}

impl Bound {
    /// m
    pub fn most(&self) -> f64 {
        self.error * self.margin
    }
}

/// What a ladder promises.
#[derive(Clone, Copy, Debug)]
pub struct Promise {
    /// Evaluations of the run that reaches the tolerance, or of the next that tells more.
    pub cost: f64,
    /// That run's knob.
    pub knob: f64,
}

/// How wrong an estimate may be; docs/accuracy.md counts how often it is wrong by more.
const PAIRED: f64 = 2.0;
/// The next knob is aimed at this part of the tolerance, so that the run after it is seldom needed.
const AIM: f64 = 0.8;
/// A finer knob is this much finer at least and at most: of timesteps, and of tolerances.
const FINER: [[f64; 2]; 2] = [[1.5, 16.0], [4.0, 100.0]];
/// Of the first two.
const SECOND: [f64; 2] = [2.0, 10.0];
/// Controlled steps begin with this many times the tolerance that is wanted.
const FIRST: f64 = 10.0;
/// But not with more than this part of the largest body's reach: that would be blind.
const COARSE: f64 = 0.01;
/// The order that is assumed where two runs are all there is: lower than any method's, so that the estimate is safe.
const UNSEEN: f64 = 0.5;
/// An order below this is none: the runs do not converge.
const NONE: f64 = 0.25;
/// No higher order is believed: where contacts begin and end runs may agree by accident, and seem to be of any order.
const MOST_ORDER: f64 = 1.0;

impl Ladder {
    pub fn new(integrator: &'static Integrator, controlled: bool) -> Ladder {
        Ladder { integrator, controlled, rungs: Vec::new(), least: 0.0, stuck: false }
    }

    /// Evaluations of the first run at least: of a step nearly as many as the order; infinite where there is to be none.
    pub fn least(&self) -> f64 {
        if self.stuck { f64::INFINITY } else { self.least.max(SAMPLES as f64 * f64::from(self.integrator.order)) }
    }

    /// The first knob.
    pub fn first(&self, case: &Case, tolerance: f64) -> f64 {
        if !self.controlled {
            return case.seconds / SAMPLES as f64;
        }
        let bodies = case.model.bodies.iter().filter(|b| b.tree.is_some());
        let reach = bodies.map(|b| extent(&case.model, b)).fold(0.0, f64::max);
        (FIRST * tolerance).min(COARSE * reach)
    }

    /// The order that the last three runs up to one show.
    fn order(&self, rung: usize) -> Option<f64> {
        let [.., first, before, last] = &self.rungs[..=rung] else { return None };
        let shown = (before.difference? / last.difference?).ln() / (first.knob / before.knob).ln();
        Some(shown.clamp(NONE, MOST_ORDER))
    }

    /// The error of a run by those of its own ladder.
    pub fn paired(&self, rung: usize) -> Bound {
        let rungs = &self.rungs;
        let finer = |k: usize| {
            let (before, last) = (rungs.get(k.checked_sub(1)?)?, rungs.get(k)?);
            let order = self.order(k).unwrap_or(UNSEEN);
            Some([last.difference?, (before.knob / last.knob).powf(order) - 1.0])
        };
        let as_fine = finer(rung).map_or(f64::INFINITY, |[d, grown]| d / grown);
        let as_coarse = finer(rung + 1).map_or(f64::INFINITY, |[d, grown]| d + d / grown);
        Bound { error: as_fine.min(as_coarse), margin: PAIRED }
    }

    /// The last run with this many times the effort.
    fn finer(&self, factor: f64) -> Option<Promise> {
        let last = self.rungs.last().filter(|_| !self.stuck)?;
        // What is spent grows with 1/knob, or of controlled steps with a root of it.
        let growth = if self.controlled { 1.0 / f64::from(self.integrator.order) } else { 1.0 };
        let spent = last.evaluations as f64;
        // What a run would have taken that diverged.
        let whole = if self.controlled { spent } else { spent / last.steps.max(1) as f64 * last.planned };
        let cost = whole * factor.powf(growth);
        (cost <= MOST_EVALUATIONS as f64).then_some(Promise { cost, knob: last.knob / factor })
    }

    /// The next run where nothing is known.
    pub fn second(&self) -> Option<Promise> {
        self.finer(SECOND[usize::from(self.controlled)])
    }

    /// What it takes to come from an error (m) of the last run to the tolerance; `None` if it cannot, or has not begun.
    pub fn promise(&self, error: f64, tolerance: f64) -> Option<Promise> {
        let last = self.rungs.last()?;
        let [least, most] = FINER[usize::from(self.controlled)];
        // The first controlled run is told from the others by their errors, not by its own.
        if last.samples.len() < SAMPLES || !error.is_finite() || self.controlled && self.rungs.len() == 1 {
            return self.second();
        }
        let order = self.order(self.rungs.len() - 1).unwrap_or(1.0);
        let wanted = (error / (AIM * tolerance)).powf(1.0 / order).max(least);
        let cost = self.finer(wanted)?.cost;
        Some(Promise { cost, ..self.finer(wanted.min(most))? })
    }

    /// Takes the next run, or gives up where it takes more than `most` evaluations. Out: its evaluations.
    pub fn climb(&mut self, case: &Case, law: &'static Law, knob: f64, most: usize) -> usize {
        let mut rung = self.run(case, law, knob, most);
        let evaluations = rung.evaluations;
        if evaluations > most {
            self.least = 2.0 * evaluations as f64;
            self.stuck = !self.rungs.is_empty() || most >= MOST_EVALUATIONS;
            return evaluations;
        }
        let whole = |rung: &&Rung| rung.samples.len() == SAMPLES;
        let last = self.rungs.last().filter(whole);
        rung.difference = last.and_then(|last| distance(&case.model, &last.samples, &rung.samples));
        self.rungs.push(rung);
        let k = self.rungs.len() - 1;
        // Once may be an accident.
        self.stuck |= k > 3 && [k - 1, k].iter().all(|k| self.order(*k).is_some_and(|order| order <= NONE));
        evaluations
    }

    fn run(&self, case: &Case, law: &'static Law, knob: f64, most: usize) -> Rung {
        let mut method = Method { contact: law, integrator: self.integrator, timestep: knob, rounds: ROUNDS };
        if self.controlled {
            method.timestep = case.model.opt.timestep;
            controlled(case, &method, knob, most)
        } else {
            let each = (case.seconds / knob / SAMPLES as f64).round().max(1.0) as usize;
            method.timestep = case.seconds / (each * SAMPLES) as f64;
            fixed(case, &method, each, most)
        }
    }

    /// One of the runs as what is chosen.
    pub fn choice(&self, rung: usize, law: &'static Law, error: f64, trial: usize) -> Choice {
        let order = self.order(rung).unwrap_or(1.0);
        let rung = &self.rungs[rung];
        let growth = if self.controlled { 1.0 / f64::from(self.integrator.order) } else { 1.0 };
        Choice {
            method: Method { contact: law, integrator: self.integrator, timestep: rung.timestep, rounds: ROUNDS },
            stepping: if self.controlled { Stepping::Controlled(rung.knob) } else { Stepping::Fixed(rung.timestep) },
            error,
            steps: rung.steps,
            evaluations: rung.evaluations,
            effort: rung.effort,
            tenfold: 10f64.powf(growth / order),
            trial,
            samples: rung.samples.clone(),
            end: rung.end.clone(),
        }
    }
}

/// A run; it ends early where it diverges or takes more than `most` evaluations.
fn fixed(case: &Case, method: &Method, each: usize, most: usize) -> Rung {
    let (mut state, mut data, mut scratch) = (case.start.clone(), Data::new(&case.model), Data::new(&case.model));
    let (mut samples, mut steps, mut evaluations) = (Vec::new(), 0, 0);
    'run: for _ in 0..SAMPLES {
        for _ in 0..each {
            if evaluations > most || step(&case.model, method, &mut state, &mut data).is_err() {
                break 'run;
            }
            steps += 1;
            evaluations += data.counts.forwards;
        }
        samples.push(poses(&case.model, &state.qpos, &mut scratch));
    }
    let (timestep, planned) = (method.timestep, (each * SAMPLES) as f64);
    Rung { knob: timestep, timestep, samples, steps, planned, evaluations, effort: None, end: state, difference: None }
}

/// See [`fixed`].
fn controlled(case: &Case, method: &Method, tolerance: f64, most: usize) -> Rung {
    let mut scratch = Data::new(&case.model);
    let (start, end) = (case.start.time, case.start.time + case.seconds);
    let (mut samples, mut effort, mut last) = (Vec::new(), Effort::default(), case.start.clone());
    if let Ok(mut run) = Controlled::new(&case.model, method, &case.start, tolerance, end) {
        'run: for i in 1..=SAMPLES {
            let time = start + case.seconds * i as f64 / SAMPLES as f64;
            while run.state().time < time {
                if run.effort().evaluations > most || run.advance().is_err() {
                    break 'run;
                }
            }
            let Ok(state) = run.at(time, usize::MAX) else { break };
            samples.push(poses(&case.model, &state.qpos, &mut scratch));
            last = state;
        }
        effort = run.effort();
    }
    let (steps, timestep) = (effort.steps + effort.rejected, method.timestep);
    // A look takes two evaluations.
    let evaluations = effort.evaluations + 2 * samples.len();
    let effort = Some(effort);
    Rung { knob: tolerance, timestep, samples, steps, planned: 0.0, evaluations, effort, end: last, difference: None }
}
