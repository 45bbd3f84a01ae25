//! Penny: a pocket-sized rigid-body simulator that reads MuJoCo's MJCF files.
//!
//!     MJCF text ─ mjcf → Document (spans) → Spec (typed, defaults merged) ─ compile → Model (SI, immutable)
//!     step(&Model, &Method, &mut State, &mut Data):  detect → smooth dynamics → contact law → integrate

pub mod cli;
pub mod collision;
pub mod compile;
pub mod contact;
pub mod data;
pub mod dynamics;
pub mod forward;
pub mod integrate;
pub mod math;
pub mod mjcf;
pub mod model;
pub mod state;
pub mod view;
