//! From a wanted accuracy to the cheapest method that has it, and what bounds it.
//!
//!     Case, tolerance ─ ladders of runs, finer and finer → Choice: method, estimated error, cost
//!                     └ twin runs → how fast errors grow (`horizon`)
//!
//! A ladder is one integrator with knobs x₀ > x₁ > …: its timestep, or where it controls its steps their tolerance. How far
//! two neighbouring runs are apart tells what the finer one errs:
//!
//!     d_k = |run_k − run_(k−1)|,   error of run_k  e_k = d_k / ((x_(k−1)/x_k)^p − 1),   e ~ xᵖ
//!
//! with the order p that the last three runs show. That predicts which knob reaches the tolerance, and at what cost. The
//! ladder whose prediction is cheapest takes the next step, until a run has an error, with a margin, within the tolerance.
//! Cost is counted in evaluations of the accelerations, so that the same scene gives the same choice on every machine.
//!
//! Source: E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, §II.4 (Richardson).

pub mod horizon;

use std::fmt;

use super::explain::Budget;
use super::sweep::Case;
use super::sweep::trajectory::{Pose, distance, poses};
use penny::contact::Law;
use penny::control::{Controlled, Effort};
use penny::data::Data;
use penny::forward::{Method, ROUNDS, step};
use penny::integrate::{self, Integrator};

/// Times at which runs are compared, besides the start.
pub const SAMPLES: usize = 64;

/// How a run goes forward.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stepping {
    /// Steps of this length, s.
    Fixed(f64),
    /// Steps whose estimated error is within this, m.
    Controlled(f64),
}

/// A method that has the wanted accuracy.
#[derive(Clone, Debug)]
pub struct Choice {
    /// Its timestep is that of fixed steps, or the first of controlled ones, s.
    pub method: Method,
    /// Fixed or controlled steps.
    pub stepping: Stepping,
    /// Estimated largest error of any body at any of the samples, m.
    pub error: f64,
    /// Steps of the run, and evaluations of the accelerations.
    pub steps: usize,
    /// See `steps`.
    pub evaluations: usize,
    /// What was kept and taken back, where steps are controlled.
    pub effort: Option<Effort>,
    /// By how much the cost grows when the accuracy is to be ten times better.
    pub tenfold: f64,
    /// Evaluations of all runs that led here.
    pub trial: usize,
    /// Positions at the samples, of the run that was chosen.
    pub samples: Vec<Vec<Pose>>,
}

/// No method has the wanted accuracy within the bounds of the search.
#[derive(Clone, Debug)]
pub struct Refusal {
    /// Until when the best two runs agree to the tolerance, s after the start.
    pub until: f64,
    /// The smallest error that was reached, m; infinite where nothing was.
    pub reached: f64,
    /// The method that reached it.
    pub by: &'static str,
    /// Whether the errors no longer became smaller; otherwise time or memory ran out.
    pub stuck: bool,
    /// Evaluations of all runs.
    pub trial: usize,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let why =
            if self.stuck { "finer steps no longer come nearer to one another" } else { "the search's time is over" };
        write!(f, "{why}; the best was {} with an error of about {:.1e} m", self.by, self.reached)
    }
}

/// One run of a ladder.
struct Rung {
    knob: f64,
    timestep: f64,
    samples: Vec<Vec<Pose>>,
    steps: usize,
    evaluations: usize,
    effort: Option<Effort>,
    /// From the rung before, m; none for the first, and where one of the two ended early.
    difference: Option<f64>,
}

/// An integrator at finer and finer knobs.
struct Ladder {
    integrator: &'static Integrator,
    controlled: bool,
    rungs: Vec<Rung>,
    /// It costs more than another promises.
    given_up: bool,
}

/// What a ladder promises.
#[derive(Clone, Copy, Debug)]
struct Prediction {
    /// Error of the last rung, m.
    error: f64,
    /// e ~ knobᵖ.
    order: f64,
    /// Evaluations that it will take to reach the tolerance, and the next knob.
    cost: f64,
    knob: f64,
    stuck: bool,
}

/// The estimate may be wrong by this factor; docs/accuracy.md counts how often it is wrong by more.
const MARGIN: f64 = 2.0;
/// A finer knob is this much finer at least and at most: of timesteps, and of tolerances.
const FINER: [[f64; 2]; 2] = [[1.5, 8.0], [4.0, 1000.0]];
/// The order that is assumed where two runs are all there is: lower than any method's, so that the estimate is safe.
const UNSEEN: f64 = 0.5;
/// An order below this is none: the runs do not converge.
const NONE: f64 = 0.25;
/// A run of more evaluations is not tried.
const MOST_EVALUATIONS: usize = 3_000_000;

/// The cheapest method of a law whose error is within `tolerance` (m, and rad times a body's reach) over the run.
///
/// Errors: none has, or none that can be found within the budget.
pub fn choose(case: &Case, law: &'static Law, tolerance: f64, budget: &Budget) -> Result<Choice, Refusal> {
    // Controlled steps first: they start at the tolerance itself, and what they promise bounds what others may try.
    let mut ladders: Vec<Ladder> = integrate::ALL
        .iter()
        .flat_map(|&integrator| {
            let fixed = Ladder { integrator, controlled: false, rungs: Vec::new(), given_up: false };
            let controlled = Ladder { integrator, controlled: true, rungs: Vec::new(), given_up: false };
            [Some(fixed), integrator.estimate.map(|_| controlled)]
        })
        .flatten()
        .collect();
    ladders.sort_by_key(|l| (!l.controlled, l.integrator.implicit));
    let mut trial = 0;
    loop {
        let costs = ladders.iter().enumerate().map(|(i, l)| (i, l.predict(tolerance)));
        let open = costs.filter(|(i, p)| !ladders[*i].given_up && !p.stuck && p.cost.is_finite());
        let best = open.min_by(|a, b| a.1.cost.total_cmp(&b.1.cost));
        let most = best.map_or(usize::MAX, |(_, p)| p.cost as usize);
        // Two rungs of each first, of those that may be cheaper than the best: without them nothing can be told.
        let young = ladders.iter().position(|l| l.rungs.len() < 2 && !l.given_up);
        let next = young.or(best.map(|(i, _)| i));
        let Some(i) = next.filter(|_| budget.left()) else {
            return Err(refusal(case, &ladders, tolerance, trial, next.is_none()));
        };
        let ladder = &mut ladders[i];
        let most = if ladder.rungs.len() < 2 { most.min(MOST_EVALUATIONS) } else { 2 * MOST_EVALUATIONS };
        trial += ladder.climb(case, law, tolerance, most);
        // The cheapest of those that are good enough.
        let good = |l: &&Ladder| l.rungs.len() > 1 && MARGIN * l.predict(tolerance).error <= tolerance;
        if ladders.iter().all(|l| l.rungs.len() > 1 || l.given_up)
            && let Some(best) = ladders.iter().filter(good).min_by_key(|l| l.rungs[l.rungs.len() - 1].evaluations)
        {
            return Ok(best.choice(law, tolerance, trial));
        }
    }
}

impl Ladder {
    /// Takes the next run, or gives up where it takes more than `most` evaluations. Out: its evaluations.
    fn climb(&mut self, case: &Case, law: &'static Law, tolerance: f64, most: usize) -> usize {
        let [least, _] = FINER[usize::from(self.controlled)];
        let knob = match &self.rungs[..] {
            [] if self.controlled => tolerance,
            [] => case.seconds / SAMPLES as f64,
            [only] => only.knob / (2.0 * least),
            _ => self.predict(tolerance).knob,
        };
        let mut rung = self.run(case, law, knob, most);
        if rung.evaluations > most {
            self.given_up = true;
            return rung.evaluations;
        }
        rung.difference = self.rungs.last().and_then(|last| distance(&case.model, &last.samples, &rung.samples));
        let evaluations = rung.evaluations;
        self.rungs.push(rung);
        evaluations
    }

    fn predict(&self, tolerance: f64) -> Prediction {
        let [least, most] = FINER[usize::from(self.controlled)];
        // What is spent grows with 1/knob, or of controlled steps with a root of it.
        let growth = if self.controlled { 1.0 / f64::from(self.integrator.order) } else { 1.0 };
        let [.., before, last] = &self.rungs[..] else {
            return Prediction { error: f64::INFINITY, order: 1.0, cost: f64::INFINITY, knob: 0.0, stuck: false };
        };
        let ratio = before.knob / last.knob;
        let spent = last.evaluations as f64;
        let Some(difference) = last.difference else {
            // It still diverges: as if it took a thousandth of the timestep.
            let (knob, stuck) = (last.knob / most, last.evaluations >= MOST_EVALUATIONS);
            return Prediction { error: f64::INFINITY, order: 1.0, cost: spent * most, knob, stuck };
        };
        let nominal = if self.controlled { 1.0 } else { f64::from(self.integrator.order) };
        let shown = match &self.rungs[..] {
            [.., first, _, _] => before.difference.map(|d| (d / difference).ln() / (first.knob / before.knob).ln()),
            _ => None,
        };
        let order = shown.unwrap_or(UNSEEN).clamp(NONE, nominal);
        let error = difference / (ratio.powf(order) - 1.0);
        let wanted = (1.5 * MARGIN * error / tolerance).powf(1.0 / order);
        let knob = last.knob / wanted.clamp(least, most);
        let stuck = order <= NONE && self.rungs.len() > 4 || spent * wanted.powf(growth) > MOST_EVALUATIONS as f64;
        Prediction { error, order, cost: spent * wanted.powf(growth), knob, stuck }
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

    fn choice(&self, law: &'static Law, tolerance: f64, trial: usize) -> Choice {
        let Prediction { error, order, .. } = self.predict(tolerance);
        let rung = &self.rungs[self.rungs.len() - 1];
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
        }
    }
}

/// A run; it ends early where it diverges or takes more than `most` evaluations.
fn fixed(case: &Case, method: &Method, each: usize, most: usize) -> Rung {
    let (mut state, mut data, mut scratch) = (case.start.clone(), Data::new(&case.model), Data::new(&case.model));
    let mut rung = Rung {
        knob: method.timestep,
        timestep: method.timestep,
        samples: Vec::new(),
        steps: 0,
        evaluations: 0,
        effort: None,
        difference: None,
    };
    'run: for _ in 0..SAMPLES {
        for _ in 0..each {
            if rung.evaluations > most || step(&case.model, method, &mut state, &mut data).is_err() {
                break 'run;
            }
            rung.steps += 1;
            rung.evaluations += data.counts.forwards;
        }
        rung.samples.push(poses(&case.model, &state.qpos, &mut scratch));
    }
    rung
}

/// See [`fixed`].
fn controlled(case: &Case, method: &Method, tolerance: f64, most: usize) -> Rung {
    let mut scratch = Data::new(&case.model);
    let (start, end) = (case.start.time, case.start.time + case.seconds);
    let mut samples = Vec::new();
    let mut effort = Effort::default();
    if let Ok(mut run) = Controlled::new(&case.model, method, &case.start, tolerance, end) {
        'run: for i in 1..=SAMPLES {
            let time = start + case.seconds * i as f64 / SAMPLES as f64;
            while run.state().time < time {
                if run.effort().evaluations > most || run.advance().is_err() {
                    break 'run;
                }
            }
            let Ok(state) = run.at(time, MOST_EVALUATIONS) else { break };
            samples.push(poses(&case.model, &state.qpos, &mut scratch));
        }
        effort = run.effort();
    }
    let (steps, evaluations) = (effort.steps + effort.rejected, effort.evaluations);
    let timestep = method.timestep;
    Rung { knob: tolerance, timestep, samples, steps, evaluations, effort: Some(effort), difference: None }
}

/// What the ladders reached.
fn refusal(case: &Case, ladders: &[Ladder], tolerance: f64, trial: usize, stuck: bool) -> Refusal {
    let mut found = Refusal { until: 0.0, reached: f64::INFINITY, by: "none", stuck, trial };
    for ladder in ladders {
        let [.., before, last] = &ladder.rungs[..] else { continue };
        let error = ladder.predict(tolerance).error;
        if error < found.reached {
            (found.reached, found.by) = (error, ladder.integrator.name);
        }
        let agree = |i: &usize| {
            let range = *i..*i + 1;
            let both = before.samples.get(range.clone()).zip(last.samples.get(range));
            both.and_then(|(a, b)| distance(&case.model, a, b)).is_some_and(|d| d <= tolerance)
        };
        let together = (0..SAMPLES).take_while(agree).count();
        found.until = found.until.max(case.seconds * together as f64 / SAMPLES as f64);
    }
    found
}
