//! The one table of MJCF: every element, where it may stand, its attributes, and what Penny makes of them.
//!
//! The reader checks files against it, takes defaults from it, and suggests names out of it. A valid name of
//! MJCF is never "unknown" here: what Penny does not use is *silent* when it changes no motion, *ignored* with a
//! warning, or *unsupported* with an error; the latter two say what is lost. Here are the columns; the rows are
//! in `table.rs`.

use std::borrow::Cow;
use std::ops::Deref;
use std::sync::LazyLock;

use super::defaults::ORIENTATIONS;
use crate::math::MIN_MU;

pub use super::table::SCHEMA;

/// A row: one element, or several that differ only in name.
pub struct Element {
    /// Its names, with blanks.
    pub names: &'static str,
    /// The elements it may stand in; `*` is all of them.
    pub parents: &'static str,
    /// Whether Penny has it.
    pub status: Status,
    /// At most one within its parent.
    pub once: bool,
    /// In groups, since some elements share some.
    pub attributes: &'static [&'static [Attribute]],
    /// Further valid attributes, which change no motion and whose values nobody looks at; `*` means that names are not checked.
    pub silent: &'static str,
}

/// An attribute.
#[derive(Clone, Copy)]
pub struct Attribute {
    /// Its name.
    pub name: &'static str,
    /// What its value is.
    pub kind: Kind,
    /// As it would be written; empty means "not given".
    pub default: &'static str,
    /// For people; the reader does not convert.
    pub unit: &'static str,
    /// What its numbers have to be.
    pub rule: Rule,
    /// What is probably not meant.
    pub lint: Lint,
    /// Whether Penny has it.
    pub status: Status,
    /// It has to be given.
    pub required: bool,
    /// May stand in a `<default>` class.
    pub in_default: bool,
}

/// What an attribute's value is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The element's own name, unique among the elements of this kind.
    Name(&'static str),
    /// The name of an element of this kind.
    Reference(&'static str),
    /// The name of an element whose kind this other attribute says, in MJCF's words: see [`kind_named`].
    ReferenceBy(&'static str),
    /// The name of a default class.
    Class,
    /// Any text.
    Text,
    /// One of these words.
    Keyword(&'static [&'static str]),
    /// This many numbers; fewer than the maximum leave the rest at its default.
    Numbers(usize, usize),
    /// Whole numbers: how many at least and at most.
    Integers(usize, usize),
}

/// What every number of a value must be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// Finite.
    Finite,
    /// Any number but NaN.
    MayBeInfinite,
    /// Above zero.
    Positive,
    /// Zero or more.
    NotNegative,
    /// One of these.
    OneOf(&'static [i32]),
    /// This or more.
    AtLeast(i32),
}

/// Which numbers MuJoCo takes without a word although they are seldom meant: a warning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lint {
    /// Nothing.
    None,
    /// Each number counts as the nearest within its bounds.
    Clamped(&'static [(f64, f64)]),
    /// A smaller one counts as this. 0 does too, but is not flagged: it says "none", which this is as good as (at 1e-5
    /// gravity brakes by 0.1 mm/s²), the tutorial's disk has it, and `explain` shows what it becomes.
    Raised(f64),
    /// From 0 to 1; pictures cut off what is beyond.
    Colour,
    /// Seconds; from this many on.
    TooLong(f64),
    /// kg/m³; what looks like g/cm³ is too little.
    Density,
}

/// Whether Penny has an element or attribute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// It has.
    Supported,
    /// Valid, and without influence on the motion.
    Silent,
    /// A warning that says what is lost.
    Ignored(&'static str),
    /// An error that says what is lost, and what to do instead; for an attribute only where it differs from the default.
    Unsupported(&'static str, &'static str),
}

pub(super) const BOOL: &[&str] = &["false", "true"];
pub(super) const AUTO: &[&str] = &["false", "true", "auto"];
pub(super) const ENABLE: &[&str] = &["disable", "enable"];

pub(super) const fn attribute(name: &'static str, kind: Kind, default: &'static str, unit: &'static str) -> Attribute {
    let (rule, lint, status) = (Rule::Finite, Lint::None, Status::Supported);
    let in_default = !matches!(kind, Kind::Name(_) | Kind::Reference(_) | Kind::ReferenceBy(_) | Kind::Class);
    Attribute { name, kind, default, unit, rule, lint, status, required: false, in_default }
}
pub(super) const fn number(name: &'static str, default: &'static str, unit: &'static str) -> Attribute {
    attribute(name, Kind::Numbers(1, 1), default, unit)
}
pub(super) const fn numbers(name: &'static str, count: usize, default: &'static str, unit: &'static str) -> Attribute {
    attribute(name, Kind::Numbers(count, count), default, unit)
}
pub(super) const fn up_to(name: &'static str, count: usize, default: &'static str, unit: &'static str) -> Attribute {
    attribute(name, Kind::Numbers(1, count), default, unit)
}
pub(super) const fn list(name: &'static str, unit: &'static str) -> Attribute {
    attribute(name, Kind::Numbers(1, usize::MAX), "", unit)
}
pub(super) const fn integer(name: &'static str, default: &'static str) -> Attribute {
    attribute(name, Kind::Integers(1, 1), default, "")
}
pub(super) const fn keyword(name: &'static str, words: &'static [&'static str], default: &'static str) -> Attribute {
    attribute(name, Kind::Keyword(words), default, "")
}
pub(super) const fn text(name: &'static str) -> Attribute {
    attribute(name, Kind::Text, "", "")
}
pub(super) const fn name(of: &'static str) -> Attribute {
    attribute("name", Kind::Name(of), "", "")
}
pub(super) const fn reference(name: &'static str, of: &'static str) -> Attribute {
    attribute(name, Kind::Reference(of), "", "")
}
pub(super) const fn reference_by(name: &'static str, by: &'static str) -> Attribute {
    attribute(name, Kind::ReferenceBy(by), "", "")
}
/// Numbers for the user, which change no motion; how many there can be, `<size nuser_…>` says.
pub(super) const fn user() -> Attribute {
    list("user", "").without_effect()
}
/// Attributes of one kind that change no motion: what a picture, a search or a memory has them for may be infinite.
pub(super) const fn silent_all<const N: usize>(names: [&'static str; N], kind: Kind) -> [Attribute; N] {
    let mut all = [attribute("", kind, "", "").may_be_infinite().without_effect(); N];
    let mut i = 0;
    while i < N {
        all[i].name = names[i];
        i += 1;
    }
    all
}
pub(super) const fn class(name: &'static str) -> Attribute {
    attribute(name, Kind::Class, "", "")
}
pub(super) const fn flag(name: &'static str, default: &'static str) -> Attribute {
    keyword(name, ENABLE, default)
}
pub(super) const fn solref(name: &'static str) -> Attribute {
    up_to(name, 2, "0.02 1", "s, 1 or −1/s², −1/s")
}
pub(super) const fn solimp(name: &'static str) -> Attribute {
    // dmin, dmax, width, midpoint, power. Source: MuJoCo 4.0, mjMINIMP and mjMAXIMP.
    const BOUNDS: &[(f64, f64)] =
        &[(1e-4, 0.9999), (1e-4, 0.9999), (0.0, f64::INFINITY), (1e-4, 0.9999), (1.0, f64::INFINITY)];
    up_to(name, 5, "0.9 0.95 0.001 0.5 2", "1, 1, m, 1, 1").lint(Lint::Clamped(BOUNDS))
}
/// Friction coefficients of contacts. Source: MuJoCo 4.0, mjMINMU.
pub(super) const fn friction(name: &'static str, count: usize, default: &'static str, unit: &'static str) -> Attribute {
    up_to(name, count, default, unit).not_negative().lint(Lint::Raised(MIN_MU))
}

impl Attribute {
    pub(super) const fn rule(mut self, rule: Rule) -> Attribute {
        self.rule = rule;
        self
    }
    pub(super) const fn lint(mut self, lint: Lint) -> Attribute {
        self.lint = lint;
        self
    }
    pub(super) const fn positive(self) -> Attribute {
        self.rule(Rule::Positive)
    }
    pub(super) const fn not_negative(self) -> Attribute {
        self.rule(Rule::NotNegative)
    }
    pub(super) const fn may_be_infinite(self) -> Attribute {
        self.rule(Rule::MayBeInfinite)
    }
    pub(super) const fn required(mut self) -> Attribute {
        self.required = true;
        self
    }
    pub(super) const fn in_default(mut self) -> Attribute {
        self.in_default = true;
        self
    }
    /// Valid, and without influence on the motion.
    pub(super) const fn without_effect(mut self) -> Attribute {
        self.status = Status::Silent;
        self
    }
    pub(super) const fn unsupported(mut self, lost: &'static str, help: &'static str) -> Attribute {
        self.status = Status::Unsupported(lost, help);
        self
    }
    pub(super) const fn ignored(mut self, lost: &'static str) -> Attribute {
        self.status = Status::Ignored(lost);
        self
    }
}

pub(super) const fn element(
    names: &'static str,
    parents: &'static str,
    attributes: &'static [&'static [Attribute]],
) -> Element {
    Element { names, parents, status: Status::Supported, once: false, attributes, silent: "" }
}
/// An element that changes no motion.
pub(super) const fn silent(names: &'static str, parents: &'static str, silent: &'static str) -> Element {
    Element { names, parents, status: Status::Silent, once: false, attributes: &[], silent }
}
/// An element that Penny lacks; nothing inside it is checked.
pub(super) const fn unsupported(
    names: &'static str,
    parents: &'static str,
    lost: &'static str,
    help: &'static str,
) -> Element {
    Element { names, parents, status: Status::Unsupported(lost, help), once: false, attributes: &[], silent: "*" }
}

impl Element {
    pub(super) const fn once(mut self) -> Element {
        self.once = true;
        self
    }
    /// Further attributes that change no motion.
    pub(super) const fn and(mut self, silent: &'static str) -> Element {
        self.silent = silent;
        self
    }
    pub(super) const fn typed(mut self, attributes: &'static [&'static [Attribute]]) -> Element {
        self.attributes = attributes;
        self
    }
    pub(super) const fn ignored(mut self, lost: &'static str) -> Element {
        self.status = Status::Ignored(lost);
        self
    }
}

impl Element {
    /// Whether this is one of its names.
    pub fn is(&self, name: &str) -> bool {
        self.names.split_ascii_whitespace().any(|n| n == name)
    }

    /// Whether it may stand in an element of that name.
    pub fn stands_in(&self, parent: &str) -> bool {
        self.parents.split_ascii_whitespace().any(|p| p == parent || p == "*")
    }

    /// Its attribute of that name.
    pub fn attribute(&self, name: &str) -> Option<&'static Attribute> {
        self.typed_attributes().find(|a| a.name == name)
    }

    /// Its attributes that Penny reads.
    pub fn typed_attributes(&self) -> impl Iterator<Item = &'static Attribute> {
        self.attributes.iter().copied().flatten()
    }

    /// Whether this is a valid attribute that changes no motion.
    pub fn is_silent(&self, attribute: &str) -> bool {
        self.silent == "*" || self.silent.split_ascii_whitespace().any(|n| n == attribute)
    }

    /// All attributes there are, for suggestions.
    pub fn attribute_names(&self) -> impl Iterator<Item = &'static str> {
        self.typed_attributes().map(|a| a.name).chain(self.silent.split_ascii_whitespace())
    }
}

/// What an `objtype` or `reftype` names, as references call it.
pub fn kind_named(objtype: &str) -> Option<&'static str> {
    let kinds = ["body", "geom", "site", "camera", "joint", "tendon", "actuator"];
    if objtype == "xbody" { Some("body") } else { kinds.into_iter().find(|kind| *kind == objtype) }
}

/// A row as the reader uses it, for every element of a file: columns are found by name at once, and defaults are read.
pub struct Row {
    element: &'static Element,
    columns: Vec<Column>,
    places: Names,
    /// The columns that have to be given.
    pub required: Vec<&'static str>,
}

/// A column of a [`Row`].
pub struct Column {
    attribute: &'static Attribute,
    /// The default as numbers; empty if it is none.
    pub numbers: Vec<f64>,
    /// Whether this is one of the ways to write an orientation.
    pub orientation: bool,
}

impl Deref for Row {
    type Target = Element;

    fn deref(&self) -> &Element {
        self.element
    }
}

impl Deref for Column {
    type Target = Attribute;

    fn deref(&self) -> &Attribute {
        self.attribute
    }
}

impl Row {
    /// No row has more columns.
    pub const COLUMNS: usize = 64;

    fn new(element: &'static Element) -> Row {
        let column = |attribute: &'static Attribute| Column {
            attribute,
            numbers: super::check::floats(attribute.default).unwrap_or_default(),
            orientation: ORIENTATIONS.contains(&attribute.name),
        };
        let columns: Vec<Column> = element.typed_attributes().map(column).collect();
        assert!(columns.len() <= Row::COLUMNS, "`{}` has {} columns", element.names, columns.len());
        let places = Names::of(columns.iter().map(|column| column.name));
        let required = columns.iter().filter(|column| column.required).map(|column| column.name).collect();
        Row { element, columns, places, required }
    }

    /// Its columns, in the order of the table.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// The number of a column. Inlined, so that a name in the source is hashed when it is compiled.
    #[inline(always)]
    pub fn place(&self, name: &str) -> Option<usize> {
        self.places.find(name)
    }

    /// The column of that name.
    pub fn attribute(&self, name: &str) -> Option<&Column> {
        self.place(name).map(|i| &self.columns[i])
    }
}

/// Names and their numbers, found by length and three letters: the names are the schema's, which has few that share these.
struct Names {
    /// A number more than that of the name whose letters lead here, or of one that found its place taken; 0: none.
    slots: Vec<u16>,
    /// Each once.
    names: Vec<&'static str>,
}

impl Names {
    /// The numbers are those of the iterator; of a name that comes twice, its first.
    fn of(list: impl Iterator<Item = &'static str>) -> Names {
        let names: Vec<&'static str> = list.collect();
        let mut names = Names { slots: vec![0; (4 * names.len()).next_power_of_two()], names };
        for i in 0..names.names.len() {
            if let Err(slot) = names.look_up(names.names[i]) {
                names.slots[slot] = i as u16 + 1;
            }
        }
        names
    }

    #[inline(always)]
    fn find(&self, name: &str) -> Option<usize> {
        self.look_up(name).ok()
    }

    /// The number of a name, or where it would be.
    #[inline(always)]
    fn look_up(&self, name: &str) -> Result<usize, usize> {
        let mask = self.slots.len() - 1;
        let (n, [a, b, c]) = match name.as_bytes() {
            [a, .., b, c] => (name.len(), [*a, *b, *c]),
            [a, c] => (2, [*a, 0, *c]),
            [a] => (1, [*a, 0, 0]),
            [] => (0, [0; 3]),
        };
        // Their product with the golden ratio spreads them over the upper bits (Knuth, TAOCP 3, 6.4).
        let key = u32::from_le_bytes([a, b, c, n as u8]).wrapping_mul(0x9e37_79b1);
        let mut slot = (key >> 16) as usize & mask;
        // A quarter of the slots is taken at most.
        while let Some(i) = usize::from(self.slots[slot]).checked_sub(1) {
            if self.names[i] == name {
                return Ok(i);
            }
            slot = (slot + 1) & mask;
        }
        Err(slot)
    }
}

/// The table as it is looked up.
struct Tables {
    /// Of elements and attributes.
    names: Names,
    /// The rows of each name, each with the elements that it may stand in.
    rows: Vec<Vec<(Vec<&'static str>, &'static Row)>>,
}

static ROWS: LazyLock<Vec<Row>> = LazyLock::new(|| SCHEMA.iter().map(Row::new).collect());

static TABLES: LazyLock<Tables> = LazyLock::new(|| {
    let of = |row: &'static Row| row.names.split_ascii_whitespace().chain(row.attribute_names());
    let names = Names::of(ROWS.iter().flat_map(of));
    let mut rows = vec![Vec::new(); names.names.len()];
    for row in ROWS.iter() {
        for name in row.names.split_ascii_whitespace().filter_map(|name| names.find(name)) {
            rows[name].push((row.parents.split_ascii_whitespace().collect(), row));
        }
    }
    Tables { names, rows }
});

/// The outermost element.
pub fn root() -> &'static Row {
    &ROWS[0]
}

/// The element of that name inside that parent.
pub fn find(parent: &str, name: &str) -> Option<&'static Row> {
    let rows = &TABLES.rows[TABLES.names.find(name)?];
    rows.iter().find(|(parents, _)| parents.iter().any(|p| *p == parent || *p == "*")).map(|(_, row)| *row)
}

/// A name without a copy of its own, if the table has it.
pub(super) fn name_of(name: &str) -> Cow<'static, str> {
    match TABLES.names.find(name) {
        Some(known) => Cow::Borrowed(TABLES.names.names[known]),
        None => Cow::Owned(name.to_string()),
    }
}

/// The names of all elements that may stand in that parent.
pub fn children(parent: &str) -> impl Iterator<Item = &'static str> {
    SCHEMA.iter().filter(move |row| row.stands_in(parent)).flat_map(|row| row.names.split_ascii_whitespace())
}

/// Where elements of that name may stand.
pub fn homes(name: &str) -> Vec<&'static str> {
    let mut homes: Vec<_> =
        SCHEMA.iter().filter(|row| row.is(name)).flat_map(|row| row.parents.split_ascii_whitespace()).collect();
    homes.dedup();
    homes
}
