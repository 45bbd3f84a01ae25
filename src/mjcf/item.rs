//! An element with its values, typed on demand.
//!
//! What takes a name is inlined for the sake of [`Row::place`].

use std::sync::Arc;

use super::defaults::{ORIENTATIONS, Value, Values};
use super::document::NodeId;
use super::schema::Row;
use super::spec::{Orientation, Pose};

/// An element with its values: its own, its class's, or the schema's defaults.
pub struct Item<'a> {
    pub node: NodeId,
    pub row: &'static Row,
    /// What its class gives it.
    pub inherited: Arc<Values<'a>>,
    /// What it says itself, laid over what it inherits.
    own: Values<'a>,
    /// Where the value of each column is.
    at: [Place; Row::COLUMNS],
    /// Whether some orientation is given.
    oriented: bool,
}

#[derive(Clone, Copy)]
enum Place {
    Default,
    Inherited(u8),
    Own(u8),
}

impl<'a> Item<'a> {
    /// `own`: laid over `inherited`. `turned`: it has an orientation of its own, in whatever form, and inherits none.
    pub fn new(node: NodeId, row: &'static Row, inherited: Arc<Values<'a>>, own: Values<'a>, turned: bool) -> Item<'a> {
        let (mut at, mut oriented) = ([Place::Default; Row::COLUMNS], turned);
        for (i, (name, _)) in inherited.iter().enumerate() {
            if let Some(place) = row.place(name).filter(|&place| !(turned && row.columns()[place].orientation)) {
                at[place] = Place::Inherited(i as u8);
                oriented |= row.columns()[place].orientation;
            }
        }
        for (i, (name, _)) in own.iter().enumerate() {
            if let Some(place) = row.place(name) {
                at[place] = Place::Own(i as u8);
            }
        }
        Item { node, row, inherited, own, at, oriented }
    }

    /// An element that says nothing.
    pub fn plain(node: NodeId, row: &'static Row) -> Item<'a> {
        Item::new(node, row, Arc::default(), Values::default(), false)
    }

    /// Whether the element itself gives none but these.
    pub fn says_only(&self, names: &[&str]) -> bool {
        self.own.iter().all(|(name, _)| names.contains(name))
    }

    /// What is given for the attribute of that name; `column` is its place.
    fn value(&self, name: &str, column: Option<usize>) -> Option<&Value<'a>> {
        // Kinds of actuator share what they inherit.
        let Some(column) = column else { return self.inherited.get(name) };
        match self.at[column] {
            Place::Default => None,
            Place::Inherited(i) => Some(&self.inherited[usize::from(i)].1),
            Place::Own(i) => Some(&self.own[usize::from(i)].1),
        }
    }

    /// Whether the element or its class gives this.
    #[inline(always)]
    pub fn given(&self, name: &str) -> bool {
        !matches!(self.value(name, self.row.place(name)), None | Some(Value::Nothing))
    }

    /// The default, and what is given in place of its first numbers.
    #[inline(always)]
    fn parts(&self, name: &str) -> (&[f64], Option<&[f64]>) {
        self.parts_at(name, self.row.place(name))
    }

    fn parts_at(&self, name: &str, column: Option<usize>) -> (&[f64], Option<&[f64]>) {
        let default = column.map_or(&[][..], |column| &self.row.columns()[column].numbers);
        match self.value(name, column) {
            Some(Value::Numbers(given)) => (default, Some(given)),
            _ => (default, None),
        }
    }

    pub fn numbers(&self, name: &str) -> Vec<f64> {
        let (default, given) = self.parts(name);
        let given = given.unwrap_or_default();
        [given, default.get(given.len()..).unwrap_or_default()].concat()
    }

    /// How many numbers are given, or are the default.
    #[inline(always)]
    pub fn count(&self, name: &str) -> usize {
        let (default, given) = self.parts(name);
        default.len().max(given.map_or(0, <[f64]>::len))
    }

    #[inline(always)]
    pub fn array<const N: usize>(&self, name: &str) -> [f64; N] {
        let (default, given) = self.parts(name);
        array([default, given.unwrap_or_default()])
    }

    #[inline(always)]
    pub fn optional<const N: usize>(&self, name: &str) -> Option<[f64; N]> {
        let (default, given) = self.parts(name);
        given.map(|given| array([default, given]))
    }

    #[inline(always)]
    pub fn number(&self, name: &str) -> f64 {
        self.array::<1>(name)[0]
    }

    #[inline(always)]
    pub fn integer(&self, name: &str) -> i32 {
        self.number(name) as i32
    }

    #[inline(always)]
    pub fn word(&self, name: &str) -> &str {
        self.word_at(name, self.row.place(name))
    }

    fn word_at(&self, name: &str, column: Option<usize>) -> &str {
        match self.value(name, column) {
            Some(Value::Text(text)) => text,
            _ => column.map_or("", |column| self.row.columns()[column].default),
        }
    }

    #[inline(always)]
    pub fn yes(&self, name: &str) -> bool {
        matches!(self.word(name), "true" | "enable")
    }

    /// `None` is "auto".
    pub fn maybe(&self, name: &str) -> Option<bool> {
        match self.word(name) {
            "true" => Some(true),
            "false" => Some(false),
            _ => None,
        }
    }

    pub fn name(&self) -> Option<String> {
        Some(self.word("name").to_string()).filter(|name| !name.is_empty())
    }

    pub fn orientation(&self) -> Option<Box<Orientation>> {
        let form = ORIENTATIONS.into_iter().filter(|_| self.oriented).find(|name| self.given(name))?;
        Some(Box::new(match form {
            "quat" => Orientation::Quat(self.array("quat")),
            "axisangle" => Orientation::AxisAngle(self.array("axisangle")),
            "xyaxes" => Orientation::XyAxes(self.array("xyaxes")),
            "zaxis" => Orientation::ZAxis(self.array("zaxis")),
            _ => Orientation::Euler(self.array("euler")),
        }))
    }

    pub fn pose(&self, frames: &Arc<[Pose]>) -> Pose {
        Pose { pos: self.array("pos"), orientation: self.orientation(), frames: frames.clone() }
    }
}

/// Each part over the one before.
fn array<const N: usize>(parts: [&[f64]; 2]) -> [f64; N] {
    let mut array = [0.0; N];
    for part in parts {
        array.iter_mut().zip(part).for_each(|(a, v)| *a = *v);
    }
    array
}
