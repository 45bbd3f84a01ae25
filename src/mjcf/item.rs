//! An element with its values, typed on demand.

use std::sync::Arc;

use super::check::floats;
use super::defaults::{ORIENTATIONS, Value, Values};
use super::document::NodeId;
use super::schema::Element;
use super::spec::{Orientation, Pose};

/// An element with its values: its own, its class's, or the schema's defaults.
pub struct Item {
    pub node: NodeId,
    pub row: &'static Element,
    pub values: Values,
}

impl Item {
    /// Whether the element or its class gives this.
    pub fn given(&self, name: &str) -> bool {
        self.values.contains_key(name)
    }

    fn default(&self, name: &str) -> &'static str {
        self.row.attribute(name).map_or("", |column| column.default)
    }

    pub fn numbers(&self, name: &str) -> Vec<f64> {
        let mut all = floats(self.default(name)).unwrap_or_default();
        if let Some(Value::Numbers(given)) = self.values.get(name) {
            if all.len() < given.len() {
                all = given.clone();
            } else {
                all[..given.len()].copy_from_slice(given);
            }
        }
        all
    }

    pub fn array<const N: usize>(&self, name: &str) -> [f64; N] {
        let mut array = [0.0; N];
        array.iter_mut().zip(self.numbers(name)).for_each(|(a, v)| *a = v);
        array
    }

    pub fn optional<const N: usize>(&self, name: &str) -> Option<[f64; N]> {
        self.given(name).then(|| self.array(name))
    }

    pub fn number(&self, name: &str) -> f64 {
        self.array::<1>(name)[0]
    }

    pub fn integer(&self, name: &str) -> i32 {
        self.number(name) as i32
    }

    pub fn word(&self, name: &str) -> &str {
        match self.values.get(name) {
            Some(Value::Text(text)) => text,
            _ => self.default(name),
        }
    }

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

    pub fn orientation(&self) -> Orientation {
        match ORIENTATIONS.into_iter().find(|name| self.given(name)) {
            Some("quat") => Orientation::Quat(self.array("quat")),
            Some("axisangle") => Orientation::AxisAngle(self.array("axisangle")),
            Some("xyaxes") => Orientation::XyAxes(self.array("xyaxes")),
            Some("zaxis") => Orientation::ZAxis(self.array("zaxis")),
            Some("euler") => Orientation::Euler(self.array("euler")),
            _ => Orientation::None,
        }
    }

    pub fn pose(&self, frames: &Arc<[Pose]>) -> Pose {
        Pose { pos: self.array("pos"), orientation: self.orientation(), frames: frames.clone() }
    }
}
