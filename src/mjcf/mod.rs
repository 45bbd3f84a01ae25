//! MJCF text to a checked, typed scene: the only part of Penny that knows XML.

pub mod document;
pub mod error;
pub mod spec;

pub use document::{Document, NodeId, Span};
pub use error::{Problem, ProblemKind, Severity};
pub use spec::Spec;
