//! Accuracy against cost: what each contact law, integrator and timestep buys, and where it blows up.
//!
//!     Case × Method ─ trajectory → measures ┐
//!     Case ─ reference or closed form → truth ┴→ Row ─ table, diagram
//!
//! Not part of a step: all of this only runs and looks.

pub mod cost;
pub mod diagram;
pub mod formulas;
pub mod grid;
pub mod map;
pub mod reference;
pub mod theory;
pub mod trajectory;
pub mod truth;
pub mod validation;

use std::sync::atomic::{AtomicUsize, Ordering};

use penny::model::Model;
use penny::state::State;

/// A scene, where it starts, and how long it runs.
#[derive(Clone, Debug)]
pub struct Case {
    pub model: Model,
    pub start: State,
    /// s
    pub seconds: f64,
}

impl Case {
    /// The same with contact forces solved to rounding: what the scene's `tolerance` lets a solver leave is more than runs differ by that
    /// are the truth, or twins.
    pub(crate) fn exact(&self) -> Case {
        Case { model: exact(&self.model), ..self.clone() }
    }
}

/// The model with contact forces solved to rounding.
pub fn exact(model: &Model) -> Model {
    let mut exact = model.clone();
    let changed = exact.edit(|m| (m.opt.tolerance, m.opt.iterations) = (0.0, m.opt.iterations.max(100)));
    debug_assert!(changed.is_ok(), "{changed:?}");
    exact
}

/// f(0), f(1), … f(count − 1), computed on all cores, in order.
fn on_all_cores<T: Send>(count: usize, f: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let worker = || {
        let take = || Some(next.fetch_add(1, Ordering::Relaxed)).filter(|i| *i < count);
        std::iter::from_fn(take).map(|i| (i, f(i))).collect::<Vec<_>>()
    };
    let mut found: Vec<_> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..cores).map(|_| scope.spawn(worker)).collect();
        let joined = workers.into_iter().map(|w| w.join());
        joined.flat_map(|part| part.unwrap_or_else(|panic| std::panic::resume_unwind(panic))).collect()
    });
    found.sort_by_key(|(i, _)| *i);
    found.into_iter().map(|(_, value)| value).collect()
}
