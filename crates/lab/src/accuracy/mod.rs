//! From a wanted accuracy to the cheapest method that has it, and what bounds it.
//!
//!     Case, tolerance ─ ladders of runs, finer and finer → Choice: method, estimated error, cost
//!                     └ twin runs → how fast errors grow (`horizon`)
//!
//! A ladder is one integrator with knobs x₀ > x₁ > …: its timestep, or where it controls its steps their tolerance. What a run
//! errs is told by how far it is from the others of its ladder (`ladder`), and guessed by how far it is from runs of integrators of
//! other order, which err otherwise. How errors shrink from knob to knob predicts which knob reaches the tolerance, and at what
//! cost; what the beginning of a controlled run took predicts what the whole will. The ladder whose prediction is cheapest takes the
//! next run, or goes on with its own, until a run has an error within the tolerance. Cost is counted in evaluations of the
//! accelerations, so that the same scene gives the same choice on every machine.
//!
//! Source: E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, §II.4 (Richardson).

mod between;
pub mod horizon;
mod ladder;
mod run;
pub mod survey;

pub use self::run::Run;

use std::fmt;

use self::ladder::{Ladder, reach};
use super::explain::Budget;
use super::sweep::Case;
use super::sweep::trajectory::{Pose, distance};
use penny::contact::Law;
use penny::control::Effort;
use penny::forward::Method;
use penny::integrate::{self, Integrator};
use penny::state::State;

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
    /// Steps of the run.
    pub steps: usize,
    /// Evaluations of the accelerations in the run.
    pub evaluations: usize,
    /// What was kept and taken back, where steps are controlled.
    pub effort: Option<Effort>,
    /// By how much the cost grows when the accuracy is to be ten times better.
    pub tenfold: f64,
    /// Evaluations of all runs of the search, the chosen one among them.
    pub trial: usize,
    /// Positions at the samples, of the run that was chosen.
    pub samples: Vec<Vec<Pose>>,
    /// Where that run ended.
    pub end: State,
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
        if self.reached.is_infinite() {
            return write!(f, "{why}, and of no method is the error known");
        }
        write!(f, "{why}; the best was {} with an error of about {:.1e} m", self.by, self.reached)
    }
}

// What each of these is worth: docs/accuracy.md, "The search's constants".

/// Runs of this many evaluations at most are cheap: fixed steps that diverge are made shorter up to there, and those of the
/// highest order are not tried where controlled ones promise as much.
const CHEAP: f64 = 8.0 * SAMPLES as f64;
/// The beginning of a run of controlled steps, which tells its cost, takes this many.
const TASTE: usize = SAMPLES;
/// No other steps are tried while the first ladder promises to arrive by this many times what was spent.
const SOON: f64 = 8.0;
/// A run of more evaluations is not tried.
const MOST_EVALUATIONS: usize = 3_000_000;
/// Nor a search of more.
const MOST_TRIAL: usize = 8_000_000;

/// The cheapest method of a law whose error is within `tolerance` (m, and rad times a body's reach) over the run.
///
/// Errors: none has, or none that can be found within the budget.
pub fn choose(case: &Case, law: &'static Law, tolerance: f64, budget: &Budget) -> Result<Choice, Refusal> {
    let mut search = Search { case, law, tolerance, ladders: ladders(case), trial: 0 };
    loop {
        if let Some(choice) = search.good() {
            return Ok(choice);
        }
        let next = search.next();
        let Some((ladder, knob, most)) = next.filter(|_| budget.left() && search.trial < MOST_TRIAL) else {
            return Err(search.refusal(next.is_none()));
        };
        search.climb(ladder, knob, most);
    }
}

/// Fixed steps that are the cheapest and the most stable of their cost, all that can be controlled, and fixed ones of the highest
/// order.
fn ladders<'c>(case: &Case) -> Vec<Ladder<'c>> {
    let cheap = |i: &&'static Integrator| (i.implicit, i.order, usize::MAX - i.implicit_dampers as usize);
    let fixed = integrate::ALL.iter().copied().min_by_key(cheap).map(|i| Ladder::new(case, i, false));
    let controlled = integrate::ALL.iter().filter(|i| i.estimate.is_some()).map(|i| Ladder::new(case, i, true));
    let high = integrate::ALL.iter().copied().max_by_key(|i| i.order).map(|i| Ladder::new(case, i, false));
    fixed.into_iter().chain(controlled).chain(high).collect()
}

/// All runs so far.
struct Search<'c> {
    case: &'c Case,
    law: &'static Law,
    tolerance: f64,
    ladders: Vec<Ladder<'c>>,
    trial: usize,
}

impl Search<'_> {
    /// How far a run may be from the truth, as a guess: by its own ladder, and by how far it is from runs of integrators of other
    /// order, which err otherwise.
    fn guess(&self, ladder: usize, rung: usize) -> f64 {
        let of = &self.ladders[ladder];
        let samples = &of.rungs[rung].samples;
        let others = self.ladders.iter().filter(|l| l.integrator.order != of.integrator.order);
        let apart =
            others.flat_map(|l| &l.rungs).filter_map(|other| distance(&self.case.model, samples, &other.samples));
        apart.fold(of.bound(rung).most, f64::min)
    }

    /// The cheapest run that is good enough.
    fn good(&self) -> Option<Choice> {
        let all = self.ladders.iter().enumerate().flat_map(|(i, l)| (0..l.rungs.len()).map(move |k| (i, k)));
        let bounded = all.map(|(i, k)| (i, k, self.ladders[i].bound(k)));
        let good = bounded.filter(|(.., bound)| bound.most <= self.tolerance);
        let (i, k, bound) = good.min_by_key(|(i, k, _)| self.ladders[*i].rungs[*k].evaluations)?;
        Some(self.ladders[i].choice(k, self.law, bound.error, self.trial))
    }

    /// The next ladder to climb, its knob, and the evaluations that the run may take:
    ///
    /// 1. Fixed steps: two runs, and cheap ones until they do not diverge.
    /// 2. What is known is tried where it promises to arrive soon.
    /// 3. Otherwise the others begin, so that they promise something too.
    /// 4. What promises most goes on, until another promises more; what it takes is asked again where the whole search has doubled.
    fn next(&self) -> Option<(usize, f64, usize)> {
        let (fixed, spent, last) = (&self.ladders[0], self.trial as f64, self.ladders.len() - 1);
        let begin = |i: usize, most: usize| Some((i, self.ladders[i].first(self.case, self.tolerance), most));
        let climb = |i: usize, to: ladder::Promise| Some((i, to.knob, MOST_EVALUATIONS));
        let unbegun = |i: &usize| self.ladders[*i].unbegun() && self.ladders[*i].may_begin();
        if unbegun(&0) {
            return begin(0, MOST_EVALUATIONS);
        }
        let few = fixed.rungs.len() == 1 || !fixed.any_whole();
        if let (true, Some(second)) = (few, fixed.second().filter(|p| p.cost <= CHEAP)) {
            return climb(0, second);
        }

        let promise = |i: usize| self.promise(i).map(|p| (i, p));
        let mut all: Vec<(usize, ladder::Promise)> = (0..=last).filter_map(promise).collect();
        all.sort_by(|a, b| a.1.cost.total_cmp(&b.1.cost));
        let best =
            |among: &dyn Fn(usize) -> bool| all.iter().find(|(i, _)| among(*i)).map_or(f64::INFINITY, |b| b.1.cost);
        let smooth = fixed.rungs.last().is_some_and(|last| last.smooth);
        let soon = |cost: f64| cost <= SOON * spent.max(SAMPLES as f64);
        // One run of long steps tells less than the beginnings of others.
        let told = fixed.known() || !fixed.any_long();
        if told && self.untried() && soon(best(&|_| true)) {
            let (i, next) = *all.first()?;
            return climb(i, next);
        }

        // The beginning of a run of controlled steps tells its cost.
        let taste = |implicit: bool| {
            let this = |i: &usize| {
                unbegun(i) && self.ladders[*i].controlled && self.ladders[*i].integrator.implicit == implicit
            };
            (1..last).find(this).and_then(|i| begin(i, TASTE))
        };
        if let Some(found) = taste(false) {
            return Some(found);
        }
        // Two runs of the highest order tell its cost, of smooth motion in which long steps do not diverge.
        if smooth && fixed.any_long() && !(told && soon(best(&|i| i == 0))) {
            let high = &self.ladders[last];
            if unbegun(&last) && best(&|i| self.ladders[i].controlled) > CHEAP {
                return begin(last, MOST_EVALUATIONS);
            }
            if let Some(second) = high.second().filter(|_| high.rungs.len() == 1 && high.any_whole()) {
                return climb(last, second);
            }
        }
        let dear = all.first().is_none_or(|(best, promise)| *best == 0 && !soon(promise.cost));
        if let Some(found) = taste(true).filter(|_| dear) {
            return Some(found);
        }
        let (i, next) = *all.first()?;
        if !self.ladders[i].controlled {
            return climb(i, next);
        }
        let other = all.get(1).map_or(f64::INFINITY, |(_, promise)| promise.cost);
        Some((i, next.knob, other.min(spent).min(MOST_EVALUATIONS as f64) as usize))
    }

    /// Whether there was no run of controlled steps.
    fn untried(&self) -> bool {
        self.ladders.iter().all(|l| !l.controlled || l.unbegun())
    }

    /// What a ladder promises; that of the highest order nothing while its steps diverge. Of the first, where two runs do not tell
    /// enough yet, at least as many as what is wanted goes into the largest body.
    fn promise(&self, i: usize) -> Option<ladder::Promise> {
        let of = &self.ladders[i];
        if i + 1 == self.ladders.len() && !of.any_whole() {
            return None;
        }
        let error = of.rungs.len().checked_sub(1).map_or(f64::INFINITY, |last| self.guess(i, last));
        let promise = of.promise(self.case, error, self.tolerance)?;
        let least = if i == 0 && !of.known() { reach(self.case) / self.tolerance } else { 0.0 };
        Some(ladder::Promise { cost: promise.cost.max(least), ..promise })
    }

    fn climb(&mut self, i: usize, knob: f64, most: usize) {
        self.trial += self.ladders[i].climb(self.case, self.law, knob, most);
    }

    /// What the ladders reached.
    fn refusal(&self, stuck: bool) -> Refusal {
        let mut found = Refusal { until: 0.0, reached: f64::INFINITY, by: "none", stuck, trial: self.trial };
        for ladder in &self.ladders {
            let [.., before, last] = &ladder.rungs[..] else { continue };
            if before.samples.len() != last.samples.len() {
                continue;
            }
            let error = ladder.bound(ladder.rungs.len() - 1).error;
            if error < found.reached {
                (found.reached, found.by) = (error, ladder.integrator.name);
            }
            let agree = |i: &usize| {
                let range = *i..*i + 1;
                let both = before.samples.get(range.clone()).zip(last.samples.get(range));
                both.and_then(|(a, b)| distance(&self.case.model, a, b)).is_some_and(|d| d <= self.tolerance)
            };
            let together = (0..SAMPLES).take_while(agree).count();
            found.until = found.until.max(self.case.seconds * together as f64 / SAMPLES as f64);
        }
        found
    }
}
