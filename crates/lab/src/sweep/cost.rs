//! What a step costs, measured by itself: nothing else of the program runs meanwhile.

use std::time::Instant;

use super::Case;
use penny::data::Data;
use penny::forward::{Method, step};
use penny::state::State;

/// States of a run from which steps are timed.
const PLACES: usize = 8;
/// Steps timed from each.
const STEPS: usize = 48;
/// Repetitions, of which the median counts.
const REPEATS: usize = 7;

/// States along a run of the case, the start first: what a step costs depends on what touches.
pub fn places(case: &Case, method: &Method) -> Vec<State> {
    let (mut state, mut data) = (case.start.clone(), Data::new(&case.model));
    let steps = (case.seconds / method.timestep).round() as usize;
    let each = steps.div_ceil(PLACES).max(1);
    let mut places = vec![state.clone()];
    for i in 1..steps {
        if step(&case.model, method, &mut state, &mut data).is_err() {
            break;
        }
        if i % each == 0 {
            places.push(state.clone());
        }
    }
    places
}

/// Nanoseconds per step: median over repetitions of the mean over the places.
pub fn ns_per_step(case: &Case, method: &Method, places: &[State]) -> f64 {
    let mut data = Data::new(&case.model);
    let mut states = places.to_vec();
    let mut once = || {
        states.clone_from_slice(places);
        let (before, mut steps) = (Instant::now(), 0usize);
        for state in &mut states {
            for _ in 0..STEPS {
                steps += 1;
                if step(&case.model, method, state, &mut data).is_err() {
                    break;
                }
            }
        }
        before.elapsed().as_secs_f64() * 1e9 / steps as f64
    };
    once();
    let mut times: Vec<f64> = (0..REPEATS).map(|_| once()).collect();
    times.sort_by(f64::total_cmp);
    times[REPEATS / 2]
}
