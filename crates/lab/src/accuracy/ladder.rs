//! One integrator at finer and finer knobs: its timestep, or the tolerance of its controlled steps.
//!
//!     two runs, knobs x₁ > x₂, apart by d:    e₂ = d / ((x₁/x₂)^p − 1),   e₁ = d + e₂,    e ~ xᵖ
//!
//! with the order p that three runs show. Where things touch two runs may agree by accident, both missing the same landing, so
//! that a run of fixed steps is compared with the two before it, whose steps are r and s times as long:
//!
//!     apart by d and c:    e = ½ (d / (r^p − 1) + c / (s^p − 1)),    1 ≤ p ≤ 2
//!
//! with the lesser of the orders that the last three runs and the three before them show.

use super::between::Between;
use super::{Choice, MOST_EVALUATIONS, SAMPLES, Stepping};
use crate::sweep::Case;
use crate::sweep::trajectory::{Pose, distance, poses};
use penny::contact::Law;
use penny::control::{Controlled, Effort, extent, safe};
use penny::data::Data;
use penny::forward::{Method, ROUNDS, forward, step};
use penny::integrate::Integrator;
use penny::state::State;

/// One run of a ladder.
pub struct Rung {
    pub knob: f64,
    pub samples: Vec<Vec<Pose>>,
    pub evaluations: usize,
    /// Evaluations of looks between its steps (see `between`), which the method that is chosen does not take.
    looks: usize,
    /// It has every n-th of the samples; n is more than 1 where steps are longer than the time between samples.
    stride: usize,
    timestep: f64,
    steps: usize,
    /// Steps that it would have taken had it not ended early; 0 of controlled ones.
    planned: f64,
    effort: Option<Effort>,
    end: State,
    /// Nothing touched, and no constraint acted, at any step and at the end: the motion has all its derivatives.
    pub smooth: bool,
    /// Something may have touched between two steps: it tells nothing.
    blind: bool,
    /// From the rung before, m; none for the first, and where one of the two ended early.
    difference: Option<f64>,
    /// Runs with larger knobs, the next one last: how many times as large, and how far off they are, m.
    coarser: Vec<[f64; 2]>,
}

impl Rung {
    /// Whether it reached the end.
    fn whole(&self) -> bool {
        self.samples.len() * self.stride == SAMPLES
    }

    /// How far another is from it where both have samples, m; `None` where one ended early.
    fn distance(&self, case: &Case, other: &Rung) -> Option<f64> {
        let stride = self.stride.max(other.stride);
        let common = |rung: &Rung| -> Vec<Vec<Pose>> {
            let each = stride / rung.stride;
            rung.samples.iter().skip(each - 1).step_by(each).cloned().collect()
        };
        if self.whole() && other.whole() { distance(&case.model, &common(self), &common(other)) } else { None }
    }
}

/// An integrator at finer and finer knobs.
pub struct Ladder<'c> {
    pub integrator: &'static Integrator,
    pub controlled: bool,
    pub rungs: Vec<Rung>,
    /// A controlled run on its way.
    paused: Option<Paused<'c>>,
    /// There is to be no further run: the last ones were no better, or took too much.
    stuck: bool,
    /// The longest step in which nothing that touches is softer than the scene says, s.
    safe: f64,
    /// Size of the largest body, m.
    reach: f64,
}

/// A controlled run that is not at its end: what it took so far tells what it will take.
struct Paused<'c> {
    run: Controlled<'c>,
    knob: f64,
    trace: Trace,
    last: State,
}

/// An error as it is estimated, and what it may be at most, m.
#[derive(Clone, Copy, Debug)]
pub struct Bound {
    pub error: f64,
    pub most: f64,
}

/// What a ladder promises: a guess, which need not be safe.
#[derive(Clone, Copy, Debug)]
pub struct Promise {
    /// Evaluations of the run that reaches the tolerance, or of the next that tells more.
    pub cost: f64,
    /// That run's knob.
    pub knob: f64,
}

// What each of these is worth, in searches with other values: docs/accuracy.md, "The search's constants".

/// How wrong the estimate may be where the motion is smooth, and of controlled steps where something touches. That of fixed steps there
/// is believed as it is.
const MARGIN: [f64; 2] = [1.05, 2.0];
/// A finer knob is this much finer at least and at most: of timesteps where something touches and where nothing does, and of
/// tolerances.
const FINER: [[f64; 2]; 3] = [[2.0, 4.0], [1.5, 8.0], [4.0, 100.0]];
/// The second run takes this many times the effort of the first.
const DOUBLE: f64 = 2.0;
/// The second tolerance is this part of what is wanted.
const SECOND: f64 = 0.75;
/// The first one is no larger than this part of the largest body's reach: that would be blind.
const COARSE: f64 = 0.1;
/// The order that is assumed where two controlled runs are all there is.
const UNSEEN: f64 = 0.75;
/// The first of fixed steps, in samples; the second have half of that, and the third an eighth. Those of higher order begin with
/// [`DOUBLE`], and halve it.
const FEW: f64 = 8.0;
/// Fixed steps that diverge are followed by ones this many times shorter, and so are the first that do not: there is little between
/// steps that diverge and steps that are good.
const ONSET: f64 = 1.3;
/// This many of the first runs may be too coarse to come nearer to one another.
const BLIND: usize = 5;
/// An order below this is none: the runs do not converge.
const NONE: f64 = 0.25;
/// Where things touch and steps are so long that `refsafe` makes them softer, they sink by what grows with the step's square.
const SOFT: f64 = 2.0;
/// However far apart their tolerances are, of two controlled runs the distance of the finer one is this many times what it errs at most where
/// things touch.
const NEARER: f64 = 3.0;

/// Of the largest body, m.
pub fn reach(case: &Case) -> f64 {
    let bodies = case.model.bodies.iter().filter(|b| b.tree.is_some());
    bodies.map(|b| extent(&case.model, b)).fold(0.0, f64::max)
}

/// The order p that three runs with knobs x₁ > x₂ > x₃ show, apart by d₁ and d₂:   d₁ / d₂ = (x₁^p − x₂^p) / (x₂^p − x₃^p)
fn order([a, b, c]: [f64; 3], [coarse, fine]: [f64; 2]) -> f64 {
    let ratio = |p: f64| ((a / b).powf(p) - 1.0) / (1.0 - (c / b).powf(p));
    let (mut low, mut high) = (0.01, 10.0);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if ratio(middle) < coarse / fine { low = middle } else { high = middle }
    }
    low
}

impl<'c> Ladder<'c> {
    pub fn new(case: &Case, integrator: &'static Integrator, controlled: bool) -> Ladder<'c> {
        Ladder {
            integrator,
            controlled,
            rungs: Vec::new(),
            paused: None,
            stuck: false,
            safe: safe(&case.model),
            reach: reach(case),
        }
    }

    /// Whether a first run was not given up.
    pub fn may_begin(&self) -> bool {
        !self.stuck
    }

    /// Whether no run was begun.
    pub fn unbegun(&self) -> bool {
        self.rungs.is_empty() && self.paused.is_none()
    }

    /// Whether a run of steps that are not shorter than the time between samples reached the end.
    pub fn any_long(&self) -> bool {
        self.rungs.iter().any(|rung| rung.whole() && rung.steps <= SAMPLES)
    }

    /// Whether a run reached the end.
    pub fn any_whole(&self) -> bool {
        self.rungs.iter().any(Rung::whole)
    }

    /// Whether two runs tell what steps cost.
    pub fn known(&self) -> bool {
        self.rungs.last().is_some_and(|last| last.difference.is_some())
    }

    /// How much finer the second run is.
    fn apart(&self) -> f64 {
        match self.rungs.last() {
            _ if self.controlled => DOUBLE.powi(i32::from(self.integrator.order)),
            Some(last) if last.stride > 2 && last.stride < FEW as usize => last.stride as f64,
            _ => DOUBLE,
        }
    }

    /// The first knob.
    pub fn first(&self, case: &Case, tolerance: f64) -> f64 {
        if !self.controlled {
            let few = if self.integrator.order > 1 { DOUBLE } else { FEW };
            return case.seconds / SAMPLES as f64 * few;
        }
        (SECOND * self.apart() * tolerance).min(COARSE * self.reach)
    }

    /// Whether a run and the one before it are smooth.
    fn smooth(&self, rung: usize) -> bool {
        let both = self.rungs.get(rung.saturating_sub(1)..=rung);
        both.is_some_and(|both| both.iter().all(|r| r.smooth))
    }

    /// How wrong the estimate of a run may be.
    fn margin(&self, rung: usize) -> f64 {
        match (self.smooth(rung), self.controlled) {
            (true, _) => MARGIN[0],
            (false, true) => MARGIN[1],
            (false, false) => 1.0,
        }
    }

    /// The order that is believed of the last three runs up to one: of tolerances, and where contacts begin and end, no more
    /// than 1, for there runs may agree by accident, and seem to be of any order.
    fn order(&self, rung: usize) -> Option<f64> {
        let most = match (self.controlled, self.smooth(rung)) {
            (false, true) => f64::from(self.integrator.order),
            (false, false) if self.rungs[rung].timestep > self.safe => SOFT,
            _ => 1.0,
        };
        Some(self.shown(rung)?.clamp(NONE, most))
    }

    /// The order that is believed of two runs alone: of fixed steps one less than in theory.
    fn unseen(&self) -> f64 {
        if self.controlled { UNSEEN } else { (f64::from(self.integrator.order) - 1.0).max(1.0) }
    }

    /// What a run of fixed steps errs where things touch, by the two before it.
    fn touching(&self, rung: usize) -> Option<f64> {
        let [.., far, near] = self.rungs[rung].coarser[..] else { return None };
        let orders = [rung - 1, rung].map(|k| self.order(k).unwrap_or(1.0).max(1.0));
        let error = |[ratio, apart]: [f64; 2]| apart / (ratio.powf(orders[0].min(orders[1])) - 1.0);
        Some(0.5 * (error(near) + error(far)))
    }

    /// The order that they show.
    fn shown(&self, rung: usize) -> Option<f64> {
        let [.., first, before, last] = &self.rungs[..=rung] else { return None };
        Some(order([first.knob, before.knob, last.knob], [before.difference?, last.difference?]))
    }

    /// The error of a run by the others: by coarser ones, or by the next finer one.
    pub fn bound(&self, rung: usize) -> Bound {
        let rungs = &self.rungs;
        // How far run k is from the one before it, and what it errs.
        let finer = |k: usize| {
            let (before, last) = (rungs.get(k.checked_sub(1)?)?, rungs.get(k)?);
            let (apart, smooth) = (last.difference?, self.smooth(k));
            if !self.controlled && !smooth {
                return Some((apart, self.touching(k)?));
            }
            let order = self.order(k).unwrap_or_else(|| self.unseen());
            let gain = (before.knob / last.knob).powf(order) - 1.0;
            let error = match (self.controlled, smooth) {
                // Two that agree may miss a landing alike: neither errs less than its tolerance.
                (true, false) => (apart / gain.min(NEARER)).max(last.knob),
                (true, true) => apart / gain,
                (false, _) => {
                    let near = last.coarser.iter().filter(|[_, apart]| *apart <= self.reach);
                    let errors = near.map(|[ratio, apart]| apart / (ratio.powf(order.max(1.0)) - 1.0));
                    errors.fold(apart / gain, f64::min)
                }
            };
            Some((apart, error))
        };
        let none = Bound { error: f64::INFINITY, most: f64::INFINITY };
        if rungs[rung].stride > 1 || rungs[rung].blind {
            return none;
        }
        let bound = |k: usize, error: f64| Bound { error, most: self.margin(k) * error };
        let as_fine = finer(rung).map(|(_, error)| bound(rung, error));
        let as_coarse = finer(rung + 1).map(|(apart, error)| bound(rung + 1, apart + error));
        [as_fine, as_coarse].into_iter().flatten().fold(none, |a, b| if b.most < a.most { b } else { a })
    }

    /// The last run with this many times the effort.
    fn finer(&self, factor: f64) -> Option<Promise> {
        let last = self.rungs.last().filter(|_| !self.stuck)?;
        // What is spent grows with 1/knob, or of controlled steps with a root of it.
        let growth = if self.controlled { 1.0 / f64::from(self.integrator.order) } else { 1.0 };
        // Without the one at the end.
        let spent = (last.evaluations - 1) as f64;
        // What a run would have taken that diverged.
        let whole = if self.controlled { spent } else { spent / last.steps.max(1) as f64 * last.planned };
        let cost = whole * factor.powf(growth);
        (cost <= MOST_EVALUATIONS as f64).then_some(Promise { cost, knob: last.knob / factor })
    }

    /// The next run where nothing is known: of fixed steps that diverge, or just do not, those a little shorter.
    pub fn second(&self) -> Option<Promise> {
        let [.., last] = &self.rungs[..] else { return None };
        let ratio = match &self.rungs[..] {
            _ if self.controlled || last.stride > 1 => return self.finer(self.apart()),
            rungs if rungs.iter().rev().take(2).any(|rung| !rung.whole()) => ONSET,
            _ => DOUBLE,
        };
        let each = last.planned / SAMPLES as f64;
        self.finer((ratio * each).round().max(each + 1.0) / each)
    }

    /// What it takes to come from an error of the last run to the tolerance (m); `None` if it cannot, or has not begun.
    pub fn promise(&self, case: &Case, error: f64, tolerance: f64) -> Option<Promise> {
        if let Some(paused) = &self.paused {
            let (done, effort) = (paused.part(case), paused.evaluations());
            let whole = effort / done.max(1e-9);
            let next = if self.rungs.is_empty() { DOUBLE * whole } else { 0.0 };
            return Some(Promise { cost: whole - effort + next, knob: paused.knob });
        }
        let last = self.rungs.last()?;
        // The first run is told from the others by their errors, not by its own.
        if !last.whole() || !error.is_finite() || self.rungs.len() == 1 {
            return self.second();
        }
        let k = self.rungs.len() - 1;
        // What the finer of two runs errs by the order in theory.
        let theory = f64::from(self.integrator.order);
        let touching = !self.controlled && !self.smooth(k);
        let [least, most] = FINER[if self.controlled { 2 } else { usize::from(!touching) }];
        let ratio = self.rungs[k - 1].knob / last.knob;
        let apart = last.difference.filter(|_| !self.controlled);
        let error = apart.map_or(error, |apart| error.min(apart / (ratio.powf(theory) - 1.0)));
        // Runs that are farther apart than things are large tell nothing.
        let error = if touching { error.min(self.reach) } else { error };
        let order = match self.shown(k) {
            // What comes to rest is forgotten.
            Some(shown) if touching => shown.max(1.0),
            _ => self.order(k).unwrap_or(if self.controlled { 1.0 } else { theory }),
        };
        // A little more than is needed, lest that be found a little too little.
        let margin = if self.controlled { self.margin(k) } else { self.margin(k).powi(2) };
        let wanted = (margin * error / tolerance).powf(1.0 / order).max(least);
        // Too far to arrive: but a finer run tells until when there is agreement.
        let cost = self.finer(wanted).map_or(f64::INFINITY, |promise| promise.cost);
        Some(Promise { cost, ..self.finer(wanted.min(most))? })
    }

    /// Takes the next run, or goes on with the one that was begun. One of controlled steps pauses after `most` evaluations, of
    /// fixed ones it is given up. Out: evaluations.
    pub fn climb(&mut self, case: &'c Case, law: &'static Law, knob: f64, most: usize) -> usize {
        let mut method = Method { contact: law, integrator: self.integrator, timestep: knob, rounds: ROUNDS };
        if self.controlled {
            method.timestep = case.model.opt.timestep;
            let Some(mut paused) = self.paused.take().or_else(|| Paused::new(case, &method, knob)) else {
                self.stuck = true;
                return 0;
            };
            let (before, looked) = (paused.evaluations(), paused.trace.looks());
            let done = paused.go_on(case, before + most as f64);
            let taken = (paused.evaluations() - before) as usize + paused.trace.looks() - looked;
            if done {
                self.add(case, paused.rung(case, &method));
                return taken + 1;
            }
            if paused.evaluations() < MOST_EVALUATIONS as f64 {
                self.paused = Some(paused);
            } else {
                self.stuck = true;
            }
            return taken;
        }
        let between = case.seconds / SAMPLES as f64;
        let [each, stride] = [between / knob, knob / between].map(|n| n.round().max(1.0) as usize);
        method.timestep = between * stride as f64 / each as f64;
        let rung = fixed(case, &method, [each, stride], most);
        let (evaluations, looks) = (rung.evaluations, rung.looks);
        if evaluations > most {
            self.stuck = true;
        } else {
            self.add(case, rung);
        }
        evaluations + looks
    }

    fn add(&mut self, case: &Case, rung: Rung) {
        // The last one may be one that is coarser than the one before.
        let k = self.rungs.partition_point(|r| r.knob >= rung.knob);
        self.rungs.insert(k, rung);
        for k in k..self.rungs.len().min(k + 2) {
            let before = k.checked_sub(1).map(|before| &self.rungs[before]);
            self.rungs[k].difference = before.and_then(|before| before.distance(case, &self.rungs[k]));
        }
        for k in k..self.rungs.len() {
            let last = &self.rungs[k];
            let apart = |rung: &Rung| Some([rung.knob / last.knob, rung.distance(case, last)?]);
            self.rungs[k].coarser = self.rungs[..k].iter().filter_map(apart).collect();
        }
        let k = self.rungs.len() - 1;
        // Once may be an accident, and large tolerances blind.
        self.stuck |= k > BLIND
            && !self.rungs[k].blind
            && [k - 1, k].iter().all(|k| self.order(*k).is_some_and(|order| order <= NONE));
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

/// What a run has shown so far.
struct Trace {
    samples: Vec<Vec<Pose>>,
    smooth: bool,
    blind: bool,
    between: Option<Between>,
    /// Its steps are so short that nothing passes through anything, as controlled ones are.
    short: bool,
}

impl Trace {
    fn new(case: &Case, short: bool) -> Trace {
        Trace { samples: Vec::new(), smooth: true, blind: false, between: Between::new(case), short }
    }

    /// Evaluations of looks between its steps.
    fn looks(&self) -> usize {
        self.between.as_ref().map_or(0, |between| between.evaluations)
    }

    /// In: whether a constraint acted in the step, and its two ends.
    fn step(&mut self, touched: bool, method: &Method, [before, after]: [&State; 2]) {
        self.smooth &= !touched;
        let asked = !self.blind && (self.smooth || !self.short);
        if let Some(between) = self.between.as_mut().filter(|_| asked) {
            self.blind = between.missed(method, before, after, !self.smooth);
        }
    }

    /// The run at its end. In: evaluations of its steps.
    fn rung(self, case: &Case, method: &Method, knob: f64, evaluations: usize, end: State) -> Rung {
        let looks = self.looks();
        let Trace { samples, blind, .. } = self;
        Rung {
            knob,
            samples,
            evaluations: evaluations + 1,
            looks,
            stride: 1,
            timestep: method.timestep,
            steps: 0,
            planned: 0.0,
            effort: None,
            smooth: self.smooth && !blind && ends_free(case, method, &end),
            end,
            blind,
            difference: None,
            coarser: Vec::new(),
        }
    }
}

/// A run of this many steps for this many samples; it ends early where it diverges or takes more than `most` evaluations.
fn fixed(case: &Case, method: &Method, [each, stride]: [usize; 2], most: usize) -> Rung {
    let (mut state, mut data, mut scratch) = (case.start.clone(), Data::new(&case.model), Data::new(&case.model));
    let (mut trace, mut before, mut steps, mut evaluations) = (Trace::new(case, false), state.clone(), 0, 0);
    'run: for _ in 0..SAMPLES / stride {
        for _ in 0..each {
            if evaluations > most || step(&case.model, method, &mut state, &mut data).is_err() {
                break 'run;
            }
            steps += 1;
            evaluations += data.counts.forwards;
            trace.step(data.counts.constrained(), method, [&before, &state]);
            if trace.between.is_some() {
                before.copy_from(&state);
            }
        }
        trace.samples.push(poses(&case.model, &state.qpos, &mut scratch));
    }
    let planned = (each * SAMPLES / stride) as f64;
    Rung { stride, steps, planned, ..trace.rung(case, method, method.timestep, evaluations, state) }
}

impl<'c> Paused<'c> {
    fn new(case: &'c Case, method: &Method, tolerance: f64) -> Option<Paused<'c>> {
        let end = case.start.time + case.seconds;
        let run = Controlled::new(&case.model, method, &case.start, tolerance, end).ok()?;
        Some(Paused { run, knob: tolerance, trace: Trace::new(case, true), last: case.start.clone() })
    }

    fn evaluations(&self) -> f64 {
        (self.run.effort().evaluations + self.run.looks()) as f64
    }

    /// Part of the time that is done.
    fn part(&self, case: &Case) -> f64 {
        (self.run.state().time - case.start.time) / case.seconds
    }

    /// Out: whether it is at its end, or cannot go on.
    fn go_on(&mut self, case: &Case, most: f64) -> bool {
        let mut scratch = Data::new(&case.model);
        while self.trace.samples.len() < SAMPLES {
            let done = (self.trace.samples.len() + 1) as f64 / SAMPLES as f64;
            let time = case.start.time + case.seconds * done;
            while self.run.state().time < time {
                if self.evaluations() >= most {
                    return false;
                }
                if self.run.advance().is_err() {
                    return true;
                }
                let Paused { run, trace, .. } = self;
                trace.step(run.touched(), run.method(), [run.before(), run.state()]);
            }
            let Ok(state) = self.run.at(time, usize::MAX) else { return true };
            self.trace.samples.push(poses(&case.model, &state.qpos, &mut scratch));
            self.last = state;
        }
        true
    }

    fn rung(self, case: &Case, method: &Method) -> Rung {
        let (evaluations, effort) = (self.evaluations() as usize, self.run.effort());
        let rung = self.trace.rung(case, method, self.knob, evaluations, self.last);
        Rung { steps: effort.steps + effort.rejected, effort: Some(effort), ..rung }
    }
}

/// Whether no constraint acts where a run ends: what began in the last step shows there.
fn ends_free(case: &Case, method: &Method, end: &State) -> bool {
    let mut data = Data::new(&case.model);
    forward(&case.model, method, end, &mut data);
    !data.counts.constrained()
}
