//! What an accuracy costs in a scene: by the cheapest fixed steps, which one would have to know, and by what is chosen.
//!
//! The truth is a run whose steps are made finer until two agree; how far they are apart is its uncertainty. Where that passes a
//! tenth of the accuracy that is wanted, the comparison ends: beyond nothing can be told.

use super::{Choice, Refusal, SAMPLES, choose};
use crate::explain::Budget;
use crate::sweep::Case;
use crate::sweep::trajectory::{Pose, distance, poses};
use penny::contact::Law;
use penny::control::Controlled;
use penny::data::Data;
use penny::forward::{Method, ROUNDS, step};
use penny::integrate;

/// Poses at the samples.
pub type Samples = Vec<Vec<Pose>>;

/// A run that counts as the truth.
#[derive(Clone, Debug)]
pub struct Truth {
    /// (`SAMPLES`)
    pub samples: Samples,
    /// By how much it may be wrong up to each sample, m.
    pub uncertainty: Vec<f64>,
}

/// Fixed steps.
#[derive(Clone, Copy, Debug)]
pub struct Fixed {
    /// Name of the integrator.
    pub integrator: &'static str,
    /// s
    pub timestep: f64,
    /// Of the accelerations, in the whole run.
    pub evaluations: usize,
}

/// What an accuracy costs.
#[derive(Clone, Debug)]
pub struct Price {
    /// m
    pub wanted: f64,
    /// Time over which it was compared, s: until the truth is uncertain.
    pub seconds: f64,
    /// The truth over that time, where it is known.
    pub truth: Option<Samples>,
    /// What `--accuracy` finds, and its distance from the truth, m; `None` where the truth is not known for long enough.
    pub chosen: Option<Result<(Choice, f64), Refusal>>,
    /// The cheapest of all integrators with 64, 128, 256 … steps; `None` if none was found below `most` evaluations.
    pub fixed: Option<Fixed>,
}

/// Part of an accuracy that the truth may be uncertain by.
const SURE: f64 = 0.1;
/// Part of the time that is too short to say anything.
const SHORT: f64 = 0.01;
/// Tolerances of controlled runs for the truth, in parts of the accuracy.
const FINE: [f64; 5] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6];

/// The prices of accuracies (m), the largest first, by runs of at most `most` evaluations; `budget` makes that of each search.
pub fn prices(case: &Case, law: &'static Law, wanted: &[f64], most: usize, budget: &dyn Fn() -> Budget) -> Vec<Price> {
    let least = wanted.iter().copied().fold(f64::INFINITY, f64::min);
    let whole = truth(case, law, least, most);
    let price = |wanted: f64| {
        let sure = |u: &&f64| **u <= SURE * wanted;
        let samples = whole.as_ref().map_or(0, |truth| truth.uncertainty.iter().take_while(sure).count());
        let part = samples as f64 / SAMPLES as f64;
        let short = Case { seconds: part * case.seconds, ..case.clone() };
        let known = match &whole {
            Some(truth) if samples == SAMPLES => Some(truth.clone()),
            Some(_) if part >= SHORT => truth(&short, law, wanted, most),
            _ => None,
        };
        let mut price = Price { wanted, seconds: short.seconds, truth: None, chosen: None, fixed: None };
        let Some(truth) = known else { return price };
        let chosen = choose(&short, law, wanted, &budget());
        // Beyond what the search took it does not matter what others take.
        let most = chosen.as_ref().map_or(most, |choice| choice.trial.min(most));
        price.fixed = cheapest(&short, law, wanted, &truth.samples, most);
        price.chosen = Some(chosen.map(|choice| {
            let error = distance(&short.model, &choice.samples, &truth.samples).unwrap_or(f64::INFINITY);
            (choice, error)
        }));
        price.truth = Some(truth.samples);
        price
    };
    wanted.iter().map(|wanted| price(*wanted)).collect()
}

/// The truth for an accuracy (m): the best that controlled steps of ever smaller tolerance have, or fixed ones of ever more
/// steps; `None` where no two runs reach the end.
pub fn truth(case: &Case, law: &'static Law, wanted: f64, most: usize) -> Option<Truth> {
    let case = &case.exact();
    let mut search = Best { case, sure: SURE * wanted, best: None };
    if search.add(&mut FINE.into_iter().map(|part| controlled(case, law, part * wanted, most))) {
        return search.best;
    }
    for integrator in integrate::ALL.iter().filter(|i| !i.implicit && [1, 4].contains(&i.order)) {
        let fixed = |each: usize| {
            let timestep = case.seconds / (each * SAMPLES) as f64;
            fixed(case, &Method { contact: law, integrator, timestep, rounds: ROUNDS }, each, most)
        };
        if search.add(&mut (6..).map(|i| fixed(1 << i).map(|(samples, _)| samples))) {
            break;
        }
    }
    search.best
}

/// The most certain of pairs of runs.
struct Best<'c> {
    case: &'c Case,
    sure: f64,
    best: Option<Truth>,
}

impl Best<'_> {
    /// Compares finer and finer runs. Out: whether the best is sure to the end.
    fn add(&mut self, runs: &mut dyn Iterator<Item = Option<Samples>>) -> bool {
        let mut before: Option<Samples> = None;
        for samples in runs {
            let Some(samples) = samples.filter(|samples| samples.len() == SAMPLES) else { break };
            let Some(coarse) = before.replace(samples.clone()) else { continue };
            let mut worst = 0.0f64;
            let mut grown = |i: usize| {
                let apart = distance(&self.case.model, &coarse[i..=i], &samples[i..=i]);
                worst = worst.max(apart.unwrap_or(f64::INFINITY));
                worst
            };
            let uncertainty: Vec<f64> = (0..SAMPLES).map(&mut grown).collect();
            // The one that is sure for longest.
            let rank = |u: &[f64]| (u.iter().filter(|u| **u <= self.sure).count(), -u[SAMPLES - 1]);
            if self.best.as_ref().is_none_or(|had| rank(&uncertainty) > rank(&had.uncertainty)) {
                self.best = Some(Truth { samples, uncertainty });
            }
            if worst <= self.sure {
                return true;
            }
        }
        false
    }
}

/// The cheapest fixed steps within an error (m) of the truth; `None` beyond `most` evaluations.
pub fn cheapest(case: &Case, law: &'static Law, wanted: f64, truth: &Samples, most: usize) -> Option<Fixed> {
    let mut best: Option<Fixed> = None;
    for integrator in integrate::ALL {
        let mut each = 1;
        loop {
            let timestep = case.seconds / (each * SAMPLES) as f64;
            let method = Method { contact: law, integrator, timestep, rounds: ROUNDS };
            let most = best.map_or(most, |best| best.evaluations);
            let Some((samples, evaluations)) = fixed(case, &method, each, most) else { break };
            if distance(&case.model, &samples, truth).is_some_and(|error| error <= wanted) {
                best = Some(Fixed { integrator: integrator.name, timestep, evaluations });
                break;
            }
            each *= 2;
        }
    }
    best
}

/// Poses and evaluations of fixed steps, fewer where they diverge; `None` if they take more than `most`.
fn fixed(case: &Case, method: &Method, each: usize, most: usize) -> Option<(Samples, usize)> {
    let (mut state, mut data, mut scratch) = (case.start.clone(), Data::new(&case.model), Data::new(&case.model));
    let (mut samples, mut evaluations) = (Vec::new(), 0);
    if each * SAMPLES > most {
        return None;
    }
    'run: for _ in 0..SAMPLES {
        for _ in 0..each {
            if step(&case.model, method, &mut state, &mut data).is_err() {
                break 'run;
            }
            evaluations += data.counts.forwards;
            if evaluations > most {
                return None;
            }
        }
        samples.push(poses(&case.model, &state.qpos, &mut scratch));
    }
    Some((samples, evaluations))
}

/// Poses of controlled steps; `None` if they fail or take more than `most` evaluations.
fn controlled(case: &Case, law: &'static Law, tolerance: f64, most: usize) -> Option<Samples> {
    // Of those that estimate their error the one of the highest order.
    let integrator = integrate::ALL.iter().filter(|i| i.estimate.is_some()).max_by_key(|i| i.order)?;
    let method = Method { contact: law, integrator, timestep: case.model.opt.timestep, rounds: ROUNDS };
    let (start, end) = (case.start.time, case.start.time + case.seconds);
    let mut run = Controlled::new(&case.model, &method, &case.start, tolerance, end).ok()?;
    let (mut samples, mut scratch) = (Vec::new(), Data::new(&case.model));
    for i in 1..=SAMPLES {
        let time = start + case.seconds * i as f64 / SAMPLES as f64;
        while run.state().time < time {
            run.advance().ok()?;
            if run.effort().evaluations > most {
                return None;
            }
        }
        let state = run.at(time, usize::MAX).ok()?;
        samples.push(poses(&case.model, &state.qpos, &mut scratch));
    }
    Some(samples)
}
