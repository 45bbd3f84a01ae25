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

    // compile
    #[error("the `{attribute}` of this {element} has no direction: {why}")]
    NoDirection { element: String, attribute: String, why: String },
    #[error("a {shape} needs {needs} numbers in `size`, but has {given}")]
    SizeMissing { shape: &'static str, needs: usize, given: usize },
    #[error("the {what} of a {shape} must be above zero, not {value}")]
    SizeNotPositive { shape: &'static str, what: &'static str, value: f64 },
    #[error("a {shape} cannot be placed by `fromto`")]
    FromtoShape { shape: &'static str },
    #[error("a plane cannot move, but {body} does")]
    PlaneMoves { body: String },
    #[error("a body can have 6 degrees of freedom, but the joints of this one have {dofs}")]
    TooManyDofs { dofs: usize },
    #[error("a joint that turns cannot follow a ball joint of the same body")]
    TurnAfterBall,
    #[error("the motions that the joints allow are not independent")]
    JointsDependent,
    #[error("`range` is given, but nothing says that it applies")]
    RangeWithoutLimited,
    #[error("the range of a ball joint starts at 0, not {low}")]
    BallRangeStart { low: f64 },
    #[error("the range {low} to {high} is empty")]
    RangeEmpty { low: f64, high: f64 },
    #[error("limited, but without a range")]
    LimitedWithoutRange,
    #[error("`{attribute}` must not be negative, but is {value}")]
    NegativeMass { attribute: &'static str, value: f64 },
    #[error("{body} moves, but has no mass")]
    MovingWithoutMass { body: String },
    #[error("{body} moves, but has no inertia")]
    MovingWithoutInertia { body: String },
    #[error("no rigid body has the principal moments {a}, {b}, {c}")]
    InertiaImpossible { a: f64, b: f64, c: f64 },
    #[error("no rigid body has this inertia: one of its principal moments is {moment}")]
    InertiaNotPositive { moment: f64 },
    #[error("no {of} is named `{name}`")]
    NoSuchName { of: &'static str, name: String },
    #[error("a geom cannot touch itself")]
    PairOfOne,
    #[error("these two geoms are a `<pair>` already")]
    PairTwice,
    #[error("this pair can never do anything")]
    PairAtRest,
    #[error("Penny cannot find contacts between {first} and {second}")]
    NoCollider { first: &'static str, second: &'static str },
    #[error("`{attribute}` of this scene has {needs} numbers, but the keyframe gives {given}")]
    KeyframeCount { attribute: &'static str, needs: usize, given: usize },
    #[error("`{name}` must be one number, zero or more")]
    NotOneCoefficient { name: String },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    Error,
    Warning,
}
