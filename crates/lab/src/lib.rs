//! The laboratory: what is measured on Penny's engine, and drawn as charts.
//!
//!     Model + Method ─ explain → what the numbers mean, and where they lead
//!     Case + Method ─ sweep → errors and costs, stability maps, closed forms
//!     State ─ record → CSV, JSON, charts, saved states
//!     Figure ─ plot → SVG, PNG

pub mod accuracy;
pub mod explain;
pub mod names;
pub mod plot;
pub mod record;
pub mod sweep;
