//! The catalogue of everything that can be wrong with a file: one enum, one careful sentence each.

use quick_xml::escape::escape;

use super::document::Span;

/// Something wrong in a file, with its place.
#[derive(Clone, Debug)]
pub struct Problem {
    /// What is wrong; its `Display` is the message.
    pub kind: ProblemKind,
    /// Where.
    pub span: Span,
    /// Further places, each with what to say there ("first defined here").
    pub related: Vec<(Span, String)>,
    /// What to do, if it is known ("did you mean `friction`?").
    pub help: Option<String>,
    /// The same as changes of the text, where nothing is left to decide: all of them, or none.
    pub fix: Vec<Edit>,
}

/// A change of a file's text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Edit {
    /// What is replaced.
    pub span: Span,
    /// What stands there then, as XML.
    pub text: String,
}

impl Problem {
    /// A problem without further help.
    pub fn new(kind: ProblemKind, span: Span) -> Problem {
        Problem { kind, span, related: Vec::new(), help: None, fix: Vec::new() }
    }

    /// Adds what to do about it.
    pub fn help(mut self, help: impl Into<String>) -> Problem {
        self.help = Some(help.into());
        self
    }

    /// "did you mean …?", if there is something to suggest.
    pub fn suggest(mut self, name: Option<&str>) -> Problem {
        if let Some(name) = name {
            self.help = Some(format!("did you mean `{name}`?"));
        }
        self
    }

    /// "did you mean …?", and the change that writes it in the problem's place.
    pub fn correct(self, name: Option<&str>) -> Problem {
        let problem = self.suggest(name);
        let span = problem.span;
        problem.replace(span, name)
    }

    /// Adds advice about a value, with the change that follows it. `value`: its place, `word` that of the number meant.
    pub fn advise(self, advice: Advice, word: Option<Span>, value: Span) -> Problem {
        let (help, edit) = match advice {
            Advice::Text(help) => (help, None),
            Advice::Word(help, text) => (help, word.map(|word| (word, text))),
            Advice::Value(help, text) => (help, Some((value, text))),
        };
        let problem = if help.is_empty() { self } else { self.help(help) };
        match edit {
            Some((span, text)) => problem.replace(span, Some(&text)),
            None => problem,
        }
    }

    /// Adds a change: this text, if there is one, in place of what stands there.
    pub fn replace(mut self, span: Span, text: Option<&str>) -> Problem {
        self.fix.extend(text.map(|text| Edit { span, text: escape(text).into_owned() }));
        self
    }

    /// Adds a second place to look at.
    pub fn related(mut self, span: Span, label: impl Into<String>) -> Problem {
        self.related.push((span, label.into()));
        self
    }

    /// Whether it keeps the scene from being simulated.
    pub fn severity(&self) -> Severity {
        self.kind.severity()
    }
}

/// What to do about a number or a value, in words and, where nothing is left to decide, as text to write.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Advice {
    /// Words alone.
    Text(String),
    /// Words, and what to write instead of one number.
    Word(String, String),
    /// Words, and what to write instead of the whole value.
    Value(String, String),
}

impl Advice {
    /// The words.
    pub fn help(&self) -> &str {
        match self {
            Advice::Text(help) | Advice::Word(help, _) | Advice::Value(help, _) => help,
        }
    }
}

impl From<&str> for Advice {
    fn from(help: &str) -> Advice {
        Advice::Text(help.to_string())
    }
}

impl From<String> for Advice {
    fn from(help: String) -> Advice {
        Advice::Text(help)
    }
}

/// How bad a problem is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// The scene cannot be simulated as it is meant.
    Error,
    /// It can, but probably something else is meant.
    Warning,
}

/// Every kind of problem. [`ProblemKind::code`] is the stable name in brackets: `error[unknown-attribute]`.
#[derive(Clone, Debug, thiserror::Error)]
// The message of each variant says what it is.
#[allow(missing_docs)]
pub enum ProblemKind {
    // The file.
    #[error("cannot read `{file}`: {why}")]
    CannotRead { file: String, why: String },
    #[error("`{file}` is a folder, not a file")]
    IsFolder { file: String },
    #[error("`{file}` is not text in UTF-8: byte 0x{byte:02X} in line {line}, column {column}")]
    NotUtf8 { file: String, byte: u8, line: usize, column: usize },
    #[error("`{file}` is not a regular file")]
    NotAFile { file: String },
    #[error("`{file}` lies outside the scene's folder")]
    Outside { file: String },
    #[error("the scene has more than {limit} {what}, includes counted in")]
    OverLimit { what: &'static str, limit: usize },
    #[error("a byte 0, which no text has")]
    NulByte,
    #[error("`{file}` has no element `<mujoco>`")]
    EmptyFile { file: String },

    // XML.
    #[error("{what}")]
    BrokenXml { what: String },
    #[error("`<{element}>` is never closed")]
    UnclosedElement { element: String },
    #[error("`</{element}>` closes nothing")]
    UnmatchedEnd { element: String },
    #[error("text outside the outermost element")]
    TextOutside,
    #[error("a second outermost element `{element}`")]
    SecondRoot { element: String },
    #[error("elements are nested more than {limit} deep, includes counted in")]
    TooDeep { limit: usize },
    #[error("attribute `{attribute}` is given twice")]
    DuplicateAttribute { attribute: String },
    #[error("{what}")]
    BadEntity { what: String },
    #[error("the character U+{code:04X} gives commands to a terminal: it counts as text here, `{shown}`")]
    ControlCharacter { code: u32, shown: String },
    #[error("text between elements has no meaning in MJCF{}", elsewhere(*more))]
    StrayText { more: usize },
    #[error("this is not an MJCF file: its outermost element is `{found}`, not `mujoco`")]
    NotMjcf { found: String },
    #[error("`{file}` includes itself")]
    IncludeCycle { file: String },
    #[error("`{file}` is included a second time")]
    IncludeTwice { file: String },
    #[error("the included file `{file}` has no elements to insert")]
    IncludeEmpty { file: String },

    // Names.
    #[error("`{parent}` has no element `{element}`")]
    UnknownElement { parent: String, element: String },
    #[error("`{element}` cannot stand in `{parent}`")]
    MisplacedElement { parent: String, element: String },
    #[error("`{parent}` can have only one `{element}`")]
    RepeatedElement { parent: String, element: String },
    #[error("`{element}` has no attribute `{attribute}`")]
    UnknownAttribute { element: String, attribute: String },
    #[error("`{element}` in a default class has no attribute `{attribute}`")]
    NotInDefault { element: String, attribute: String },
    #[error("`{element}` needs the attribute `{attribute}`")]
    MissingAttribute { element: String, attribute: String },
    #[error("there is no {what} `{name}`")]
    UnknownReference { what: String, name: String },
    #[error("there is no default class `{name}`")]
    UnknownClass { name: String },
    #[error("a second {what} is named `{name}`")]
    DuplicateName { what: String, name: String },
    #[error("the top-level default class is `main` and cannot be called `{name}`")]
    MainRenamed { name: String },
    #[error("Penny has no {what} `{name}` of its own")]
    UnknownPennyName { what: String, name: String },

    // Values.
    #[error("`{attribute}` cannot be `{value}`")]
    UnknownKeyword { attribute: String, value: String },
    #[error("`{attribute}` takes {expected}, but {found} given")]
    WrongCount { attribute: String, expected: String, found: String },
    #[error("`{word}` is not a number")]
    NotANumber { word: String },
    #[error("`{word}` is not a whole number")]
    NotAnInteger { word: String },
    #[error("`{word}` is too large a number")]
    NumberTooLarge { word: String },
    #[error("`{attribute}` must be finite, not {word}")]
    NotFinite { attribute: String, word: String },
    #[error("`{attribute}` must be {rule}, not {word}")]
    OutOfRange { attribute: String, rule: String, word: String },
    #[error("`{attribute}` is empty")]
    EmptyValue { attribute: String },
    #[error("`{attribute}` is not written as MJCF writes numbers")]
    Separators { attribute: String },

    // Values that are valid, and seldom meant.
    #[error("`{attribute}` {word} counts as {used}: MuJoCo keeps this number {}", bounds(*low, *high))]
    Clamped { attribute: String, word: String, used: f64, low: f64, high: f64 },
    #[error("`{attribute}` {word} counts as {used}, the least that MuJoCo's contacts have")]
    Raised { attribute: String, word: String, used: String },
    #[error("`{attribute}` runs from 0 to 1, and pictures cut {word} off")]
    ColourCut { attribute: String, word: String },
    #[error("a timestep of {word} s is longer than most motions take")]
    LongTimestep { word: String },
    #[error("`{attribute}` looks like radians, but angles are in degrees here")]
    LooksLikeRadians { attribute: String },
    #[error("`{attribute}` looks like degrees, but angles are in radians here: {word} rad are {turns} turns")]
    LooksLikeDegrees { attribute: String, word: String, turns: String },
    #[error("`ctrlrange` of a servo on a hinge is in radians, whatever `angle` says: {word} rad are {turns} turns")]
    ServoInDegrees { word: String, turns: String },
    #[error("`{attribute}` falls from {first} to {second} with depth: the deeper the contact, the softer it is")]
    ImpedanceFalls { attribute: String, first: f64, second: f64 },
    #[error(
        "`{attribute}` has a timeconst of {timeconst} s and a dampratio of {dampratio}: it gives way slowly, and swings long"
    )]
    SolrefSwapped { attribute: String, timeconst: f64, dampratio: f64 },
    #[error(
        "`friction` has a sliding coefficient of {sliding} and a torsional one of {torsional} m: it slides, but hardly spins"
    )]
    FrictionSwapped { sliding: f64, torsional: f64 },
    #[error("a density of {word} kg/m³ is hardly meant: water has 1000")]
    LightDensity { word: String },
    #[error("the quaternion of {joint} {why}")]
    KeyframeQuaternion { joint: String, why: String },

    #[error("{what}")]
    Meaningless { what: String },

    // What Penny leaves out.
    #[error("`{name}` is not supported: {lost}")]
    Unsupported { name: String, lost: String },
    #[error("`{name}` is ignored: {lost}")]
    Ignored { name: String, lost: String },

    // Elements that contradict each other.
    #[error("`{element}` has more than one orientation")]
    SeveralOrientations { element: String },
    #[error("`{element}` has both `{one}` and `{other}`")]
    Conflict { element: String, one: String, other: String },
    #[error("the orientation has no effect beside `fromto`")]
    OrientationLost,
    #[error("`{element}` cannot stand in the world itself")]
    NotInWorld { element: String },
    #[error("a free joint must belong to a body directly in `worldbody`")]
    FreeJointNested,
    #[error("a free joint must be its body's only joint")]
    FreeJointNotAlone,
    #[error("`range` limits nothing, because it does not increase")]
    RangeLost,
    #[error("`{attribute}` mixes the two formats: {value}")]
    MixedSolref { attribute: String, value: String },

    // What only shows when the scene is put together (reported by `compile`).
    #[error("the `{attribute}` of this {element} has no direction: {why}")]
    NoDirection { element: String, attribute: String, why: String },
    #[error("a {shape} needs {needs} in `size`, but {given} given")]
    SizeMissing { shape: &'static str, needs: String, given: String },
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
    #[error("the mass or the inertia of this body is too large a number")]
    MassOverflow,
    #[error("{body} moves, but has no mass")]
    MovingWithoutMass { body: String },
    #[error("{body} moves, but has no inertia")]
    MovingWithoutInertia { body: String },
    #[error("{body} moves, but has too little {what} for MuJoCo: {value}, and the least is 1e-15")]
    MovingTooLight { body: String, what: &'static str, value: String },
    #[error("no rigid body has the principal moments {a}, {b}, {c}")]
    InertiaImpossible { a: f64, b: f64, c: f64 },
    #[error("no rigid body has this inertia: one of its principal moments is {moment}")]
    InertiaNotPositive { moment: f64 },
    #[error("a geom cannot touch itself")]
    PairOfOne,
    #[error("these two geoms are a `<pair>` already")]
    PairTwice,
    #[error("more than {limit} pairs of a plane and another geom could touch")]
    TooManyPairs { limit: usize },
    #[error("the geoms of this scene have more than {limit} different sets of contact parameters")]
    TooManyClasses { limit: usize },
    #[error("this pair does nothing: its geoms never move against one another")]
    PairAtRest,
    #[error("`{attribute}` of this scene has {needs}, but {given} given")]
    KeyframeCount { attribute: &'static str, needs: String, given: String },
    #[error("`{attribute}` of this scene has {needs}, but {given} given: MuJoCo fills it up")]
    KeyframeShort { attribute: &'static str, needs: String, given: String },
    #[error("`{name}` must be one number, zero or more")]
    NotOneCoefficient { name: String },
    #[error("`{name}` is not a contact law")]
    UnknownLaw { name: String },
    #[error("`{name}` is not a closed form that Penny knows")]
    UnknownTruth { name: String },
    #[error("nothing in this scene moves: no body has a joint")]
    NothingMoves,
}

impl ProblemKind {
    /// The stable name in brackets.
    pub fn code(&self) -> &'static str {
        use ProblemKind::*;
        match self {
            CannotRead { .. } => "cannot-read",
            IsFolder { .. } => "is-folder",
            NotUtf8 { .. } => "not-utf8",
            NotAFile { .. } => "not-a-file",
            Outside { .. } => "outside",
            OverLimit { .. } => "over-limit",
            NulByte => "nul-byte",
            EmptyFile { .. } => "empty-file",
            BrokenXml { .. } => "broken-xml",
            UnclosedElement { .. } => "unclosed-element",
            UnmatchedEnd { .. } => "unmatched-end",
            TextOutside => "text-outside",
            SecondRoot { .. } => "second-root",
            TooDeep { .. } => "too-deep",
            DuplicateAttribute { .. } => "duplicate-attribute",
            BadEntity { .. } => "bad-entity",
            ControlCharacter { .. } => "control-character",
            StrayText { .. } => "stray-text",
            NotMjcf { .. } => "not-mjcf",
            IncludeCycle { .. } => "include-cycle",
            IncludeTwice { .. } => "include-twice",
            IncludeEmpty { .. } => "include-empty",
            UnknownElement { .. } => "unknown-element",
            MisplacedElement { .. } => "misplaced-element",
            RepeatedElement { .. } => "repeated-element",
            UnknownAttribute { .. } => "unknown-attribute",
            NotInDefault { .. } => "not-in-default",
            MissingAttribute { .. } => "missing-attribute",
            UnknownReference { .. } => "unknown-reference",
            UnknownClass { .. } => "unknown-class",
            DuplicateName { .. } => "duplicate-name",
            MainRenamed { .. } => "main-renamed",
            UnknownPennyName { .. } => "unknown-penny-name",
            UnknownKeyword { .. } => "unknown-keyword",
            WrongCount { .. } => "wrong-count",
            NotANumber { .. } => "not-a-number",
            NotAnInteger { .. } => "not-an-integer",
            NumberTooLarge { .. } => "number-too-large",
            NotFinite { .. } => "not-finite",
            OutOfRange { .. } => "out-of-range",
            EmptyValue { .. } => "empty-value",
            Separators { .. } => "separators",
            Clamped { .. } => "clamped",
            Raised { .. } => "raised",
            ColourCut { .. } => "colour-cut",
            LongTimestep { .. } => "long-timestep",
            LooksLikeRadians { .. } => "looks-like-radians",
            Meaningless { .. } => "meaningless",
            LooksLikeDegrees { .. } => "looks-like-degrees",
            ServoInDegrees { .. } => "servo-in-degrees",
            ImpedanceFalls { .. } => "impedance-falls",
            SolrefSwapped { .. } => "solref-swapped",
            FrictionSwapped { .. } => "friction-swapped",
            LightDensity { .. } => "light-density",
            KeyframeQuaternion { .. } => "keyframe-quaternion",
            Unsupported { .. } => "unsupported",
            Ignored { .. } => "ignored",
            SeveralOrientations { .. } => "several-orientations",
            Conflict { .. } => "conflict",
            OrientationLost => "orientation-lost",
            NotInWorld { .. } => "not-in-world",
            FreeJointNested => "free-joint-nested",
            FreeJointNotAlone => "free-joint-not-alone",
            RangeLost => "range-lost",
            MixedSolref { .. } => "mixed-solref",
            NoDirection { .. } => "no-direction",
            SizeMissing { .. } => "size-missing",
            SizeNotPositive { .. } => "size-not-positive",
            FromtoShape { .. } => "fromto-shape",
            PlaneMoves { .. } => "plane-moves",
            TooManyDofs { .. } => "too-many-dofs",
            TurnAfterBall => "turn-after-ball",
            JointsDependent => "joints-dependent",
            RangeWithoutLimited => "range-without-limited",
            BallRangeStart { .. } => "ball-range-start",
            RangeEmpty { .. } => "range-empty",
            LimitedWithoutRange => "limited-without-range",
            MassOverflow => "mass-overflow",
            MovingWithoutMass { .. } => "moving-without-mass",
            MovingWithoutInertia { .. } => "moving-without-inertia",
            MovingTooLight { .. } => "moving-too-light",
            InertiaImpossible { .. } => "inertia-impossible",
            InertiaNotPositive { .. } => "inertia-not-positive",
            PairOfOne => "pair-of-one",
            PairTwice => "pair-twice",
            TooManyPairs { .. } => "too-many-pairs",
            TooManyClasses { .. } => "too-many-classes",
            PairAtRest => "pair-at-rest",
            KeyframeCount { .. } => "keyframe-count",
            KeyframeShort { .. } => "keyframe-short",
            NotOneCoefficient { .. } => "not-one-coefficient",
            UnknownLaw { .. } => "unknown-law",
            UnknownTruth { .. } => "unknown-truth",
            NothingMoves => "nothing-moves",
        }
    }

    /// Whether it keeps the scene from being simulated.
    pub fn severity(&self) -> Severity {
        use ProblemKind::*;
        match self {
            StrayText { .. }
            | ControlCharacter { .. }
            | Ignored { .. }
            | OrientationLost
            | RangeLost
            | PairAtRest
            | MixedSolref { .. }
            | NothingMoves
            | KeyframeShort { .. }
            | Clamped { .. }
            | Raised { .. }
            | ColourCut { .. }
            | LongTimestep { .. }
            | LooksLikeRadians { .. }
            | LooksLikeDegrees { .. }
            | ServoInDegrees { .. }
            | ImpedanceFalls { .. }
            | SolrefSwapped { .. }
            | FrictionSwapped { .. }
            | LightDensity { .. }
            | KeyframeQuaternion { .. } => Severity::Warning,
            _ => Severity::Error,
        }
    }
}

fn bounds(low: f64, high: f64) -> String {
    if high.is_finite() { format!("between {low} and {high}") } else { format!("at {low} or above") }
}

fn elsewhere(more: usize) -> String {
    match more {
        0 => String::new(),
        1 => " (here and in one more place)".to_string(),
        _ => format!(" (here and in {more} more places)"),
    }
}
