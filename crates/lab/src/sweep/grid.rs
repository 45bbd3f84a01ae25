//! Every law × integrator × timestep of a case: accuracy on all cores, then cost by itself.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;

use serde::{Deserialize, Serialize};

use super::Case;
use super::cost;
use super::reference::Reference;
use super::trajectory::{self, distance, fit};
use super::truth::Truth;
use penny::contact::Law;
use penny::forward::Method;
use penny::integrate::Integrator;

/// What a sweep compares with.
pub enum Target {
    /// Poses, by contact law where each has its own.
    Poses(BTreeMap<&'static str, Reference>),
    Exact(&'static Truth),
}

/// One method's result: a row of the table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    pub law: String,
    pub integrator: String,
    /// s
    pub timestep: f64,
    pub steps: usize,
    /// Against the target, in its unit; none where the run diverged.
    pub error: Option<f64>,
    /// Filled in by the second pass.
    pub ns_per_step: Option<f64>,
    pub ns_per_simulated_second: Option<f64>,
    pub energy_change: f64,
    pub energy_gain: f64,
    /// m
    pub penetration: f64,
    /// J
    pub complementarity: f64,
    pub cone: f64,
    pub stable: bool,
    /// s
    pub diverged_at: Option<f64>,
}

/// This many numbers from one to another, log-spaced.
pub fn spaced(smallest: f64, largest: f64, count: usize) -> Vec<f64> {
    let ratio = (largest / smallest).powf(1.0 / (count.max(2) - 1) as f64);
    (0..count).map(|i| smallest * ratio.powi(i as i32)).collect()
}

/// Log-spaced timesteps that reach every sample, s.
pub fn timesteps(case: &Case, smallest: f64, largest: f64, count: usize) -> Vec<f64> {
    let mut list: Vec<f64> = spaced(smallest, largest, count).iter().map(|h| fit(case.seconds, *h).0).collect();
    list.dedup();
    list
}

/// All combinations, those of the most steps first, so that the cores finish together.
pub fn methods(
    laws: &[&'static Law],
    integrators: &[&'static Integrator],
    timesteps: &[f64],
    rounds: usize,
) -> Vec<Method> {
    let mut list = Vec::new();
    for &timestep in timesteps {
        for &contact in laws {
            list.extend(integrators.iter().map(|&integrator| Method { contact, integrator, timestep, rounds }));
        }
    }
    list.sort_by(|a, b| a.timestep.total_cmp(&b.timestep));
    list
}

/// Runs the methods on all cores and hands over each row as it is finished.
pub fn accuracy(case: &Case, target: &Target, methods: &[Method], mut finished: impl FnMut(Row)) {
    let next = AtomicUsize::new(0);
    let (send, receive) = mpsc::channel();
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..cores {
            let (send, next) = (send.clone(), &next);
            scope.spawn(move || {
                while let Some(method) = methods.get(next.fetch_add(1, Ordering::Relaxed)) {
                    if send.send(row(case, target, method)).is_err() {
                        return;
                    }
                }
            });
        }
        drop(send);
        receive.into_iter().for_each(&mut finished);
    });
}

/// Energy gained beyond this, in units of the largest kinetic energy, is not stable.
const GAIN: f64 = 0.1;

fn row(case: &Case, target: &Target, method: &Method) -> Row {
    let run = trajectory::run(case, method);
    let measures = run.measures;
    let error = match target {
        Target::Poses(references) => references
            .get(method.contact.name)
            .and_then(|reference| distance(&case.model, &run.samples, &reference.samples)),
        Target::Exact(truth) => (truth.exact)(case, method)
            .and_then(|exact| Some((truth.measure(case, method).ok()? - exact).abs()))
            .filter(|e| e.is_finite()),
    };
    Row {
        law: method.contact.name.to_owned(),
        integrator: method.integrator.name.to_owned(),
        timestep: method.timestep,
        steps: (case.seconds / method.timestep).round() as usize,
        error,
        ns_per_step: None,
        ns_per_simulated_second: None,
        energy_change: measures.energy_change,
        energy_gain: measures.energy_gain,
        penetration: measures.penetration,
        complementarity: measures.complementarity,
        cone: measures.cone,
        stable: run.failed.is_none() && measures.energy_gain < GAIN,
        diverged_at: run.failed.map(|error| error.time()),
    }
}

/// Times the steps of each row's method, one after the other.
pub fn costs(case: &Case, methods: &[Method], rows: &mut [Row], mut finished: impl FnMut(&[Row])) {
    let mut places: BTreeMap<&str, Vec<_>> = BTreeMap::new();
    for i in 0..rows.len() {
        let Some(method) = methods.iter().find(|m| is_of(&rows[i], m)) else { continue };
        if rows[i].ns_per_step.is_none() {
            let states = places.entry(method.contact.name).or_insert_with(|| {
                let timestep = fit(case.seconds, case.model.opt.timestep).0;
                cost::places(case, &Method { timestep, ..*method })
            });
            let ns = cost::ns_per_step(case, method, states);
            rows[i].ns_per_step = Some(ns);
            rows[i].ns_per_simulated_second = Some(ns / method.timestep);
        }
        finished(rows);
    }
}

/// Whether a row is about a method.
pub fn is_of(row: &Row, method: &Method) -> bool {
    row.law == method.contact.name
        && row.integrator == method.integrator.name
        && (row.timestep / method.timestep - 1.0).abs() < 1e-9
}

impl Row {
    /// (cost in s per simulated second, error): what a work–precision diagram shows of a stable run.
    pub fn place(&self) -> Option<[f64; 2]> {
        self.stable.then_some(())?;
        Some([self.ns_per_simulated_second? * 1e-9, self.error?])
    }
}

/// The rows that no other row beats in both cost and error, cheapest first.
pub fn pareto(rows: &[Row]) -> Vec<&Row> {
    let mut placed: Vec<(&Row, [f64; 2])> = rows.iter().filter_map(|r| Some((r, r.place()?))).collect();
    placed.sort_by(|a, b| a.1[0].total_cmp(&b.1[0]).then(a.1[1].total_cmp(&b.1[1])));
    let mut best = f64::INFINITY;
    placed.retain(|(_, [_, error])| {
        let better = *error < best;
        best = best.min(*error);
        better
    });
    placed.into_iter().map(|(row, _)| row).collect()
}

/// The cheapest row that is at least that accurate.
pub fn cheapest(rows: &[Row], tolerance: f64) -> Option<&Row> {
    let good = rows.iter().filter(|r| r.place().is_some_and(|[_, error]| error <= tolerance));
    good.min_by(|a, b| {
        a.ns_per_simulated_second.partial_cmp(&b.ns_per_simulated_second).unwrap_or(std::cmp::Ordering::Equal)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(cost: f64, error: f64) -> Row {
        Row {
            law: "a".into(),
            integrator: "b".into(),
            timestep: 1.0,
            steps: 1,
            error: Some(error),
            ns_per_step: Some(cost),
            ns_per_simulated_second: Some(cost),
            energy_change: 0.0,
            energy_gain: 0.0,
            penetration: 0.0,
            complementarity: 0.0,
            cone: 0.0,
            stable: true,
            diverged_at: None,
        }
    }

    #[test]
    fn the_front_holds_what_nothing_beats_and_the_cheapest_is_on_it() {
        let rows = [row(3.0, 0.1), row(1.0, 0.5), row(2.0, 0.6), row(5.0, 0.1), row(9.0, 0.01)];
        let front: Vec<f64> = pareto(&rows).iter().map(|r| r.ns_per_step.unwrap_or(0.0)).collect();
        assert_eq!(front, [1.0, 3.0, 9.0]);
        assert_eq!(cheapest(&rows, 0.2).and_then(|r| r.ns_per_step), Some(3.0));
        assert_eq!(cheapest(&rows, 1e-3), None);
        let unstable = Row { stable: false, ..row(0.1, 1e-9) };
        assert_eq!(cheapest(&[unstable], 1.0), None);
    }
}
