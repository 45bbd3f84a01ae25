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

use crate::model::Model;
use crate::state::State;

/// A scene, where it starts, and how long it runs.
#[derive(Clone, Debug)]
pub struct Case {
    pub model: Model,
    pub start: State,
    /// s
    pub seconds: f64,
}
