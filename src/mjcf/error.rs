//! The catalogue of everything that can be wrong with a file: one enum, one careful sentence each.

use super::document::Span;

/// Something wrong in a file, with its place.
#[derive(Clone, Debug)]
pub struct Problem {
    pub kind: ProblemKind,
    pub span: Span,
    /// Further places, each with what to say there ("first defined here").
    pub related: Vec<(Span, String)>,
    /// The cure, if one is known ("did you mean `friction`?").
    pub help: Option<String>,
}

/// Every kind of problem. `code()` is the stable name in brackets: `error[unknown-attribute]`.
#[derive(Clone, Debug, thiserror::Error)]
pub enum ProblemKind {
    #[error("`{element}` has no attribute `{attribute}`")]
    UnknownAttribute { element: String, attribute: String },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    Error,
    Warning,
}
