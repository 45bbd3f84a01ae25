//! `<default>` classes: a tree in which a child copies its parent and then overrides.

use std::collections::BTreeMap;

use super::document::{Document, NodeId};
use super::error::{Problem, ProblemKind};
use super::lints;
use super::schema::{self, Element, Kind};

/// A value as it was read.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    Numbers(Vec<f64>),
    Text(String),
}

/// Values by attribute.
pub type Values = BTreeMap<&'static str, Value>;

/// For each class, what it gives each element.
#[derive(Clone, Debug, Default)]
pub struct Classes {
    classes: BTreeMap<String, Class>,
}

type Class = BTreeMap<String, Values>;

pub const MAIN: &str = "main";

impl Classes {
    /// Reads all `<default>` sections; what is wrong with their names was reported by [`super::check`].
    ///
    /// `degree`: angles are in degrees.
    pub fn read(document: &Document, sections: &[NodeId], degree: bool, problems: &mut Vec<Problem>) -> Classes {
        let mut classes = Classes { classes: BTreeMap::from([(MAIN.to_string(), Class::default())]) };
        for &section in sections {
            classes.class(document, section, MAIN, degree, problems);
        }
        classes
    }

    fn class(&mut self, document: &Document, node: NodeId, name: &str, degree: bool, problems: &mut Vec<Problem>) {
        let (nested, own): (Vec<NodeId>, Vec<NodeId>) =
            document.node(node).children.iter().partition(|&&child| document.node(child).name == "default");
        // First what this class says itself: its children start from that, wherever they stand.
        for child in own {
            let element = &document.node(child).name;
            if let Some(row) = schema::find("default", element) {
                let class = self.classes.entry(name.to_string()).or_default();
                let values = class.entry(family(element)).or_default();
                overlay(document, child, row, values, problems);
                let lint = if degree { lints::radians } else { lints::degrees };
                lint(document, child, row, values, problems);
            }
        }
        for child in nested {
            let Some(class) = document.attribute(child, "class").filter(|a| !self.classes.contains_key(&a.value))
            else {
                continue;
            };
            let inherited = self.classes.get(name).cloned().unwrap_or_default();
            self.classes.insert(class.value.clone(), inherited);
            self.class(document, child, &class.value, degree, problems);
        }
    }

    /// What a class gives an element; nothing if there is no such class.
    pub fn values(&self, class: &str, parent: &str, element: &str) -> Values {
        let family = match parent {
            // What they tie together has its own defaults elsewhere.
            "fixed" | "spatial" => return Values::new(),
            "tendon" | "equality" => parent.to_string(),
            _ => family(element),
        };
        self.classes.get(class).and_then(|c| c.get(&family)).cloned().unwrap_or_default()
    }
}

/// The kinds of actuator share one set of defaults, as in MuJoCo.
pub fn family(element: &str) -> String {
    match element {
        "motor" | "position" | "velocity" | "intvelocity" | "damper" | "cylinder" | "general" => "actuator".to_string(),
        _ => element.to_string(),
    }
}

/// A solref is either two positive numbers (timeconst, dampratio) or two that are not (−stiffness, −damping).
fn mixed_solref(document: &Document, node: NodeId, values: &Values, problems: &mut Vec<Problem>) {
    for attribute in &document.node(node).attributes {
        if !attribute.name.contains("solref") {
            continue;
        }
        if let Some(Value::Numbers(v)) = values.get(attribute.name.as_str())
            && v.len() == 2
            && (v[0] > 0.0) != (v[1] > 0.0)
        {
            let kind =
                ProblemKind::MixedSolref { attribute: attribute.name.clone(), value: format!("{} {}", v[0], v[1]) };
            problems.push(Problem::new(kind, attribute.value_span).help("MuJoCo and Penny use `0.02 1` instead"));
        }
    }
}

/// Puts an element's own values over those it inherits.
///
/// As in MuJoCo, a shorter list of numbers replaces only the leading ones, and one form of orientation replaces
/// whichever form was inherited. Values that are no numbers, or too many, are left out: they were reported.
pub fn overlay(
    document: &Document,
    node: NodeId,
    row: &'static Element,
    values: &mut Values,
    problems: &mut Vec<Problem>,
) {
    let attributes = &document.node(node).attributes;
    if attributes.iter().any(|a| ORIENTATIONS.contains(&a.name.as_str())) {
        ORIENTATIONS.iter().for_each(|name| {
            values.remove(name);
        });
    }
    for attribute in attributes {
        let Some(column) = row.attribute(&attribute.name) else {
            continue;
        };
        match column.kind {
            Kind::Numbers(_, max) | Kind::Integers(_, max) => {
                let Some(own) = super::check::floats(&attribute.value).filter(|v| v.len() <= max) else {
                    continue;
                };
                let mut all = match values.remove(column.name) {
                    Some(Value::Numbers(inherited)) if max < usize::MAX => inherited,
                    _ => super::check::floats(column.default).unwrap_or_default(),
                };
                if all.len() < own.len() {
                    all = own;
                } else {
                    all[..own.len()].copy_from_slice(&own);
                }
                values.insert(column.name, Value::Numbers(all));
            }
            Kind::Keyword(words) if !words.contains(&attribute.value.as_str()) => {}
            Kind::Reference(_) if attribute.value.is_empty() => {
                values.remove(column.name);
            }
            _ => {
                values.insert(column.name, Value::Text(attribute.value.clone()));
            }
        }
    }
    mixed_solref(document, node, values, problems);
    lints::falling_impedance(document, node, values, problems);
    lints::swapped(document, node, values, problems);
}

/// The five ways to write an orientation.
pub const ORIENTATIONS: [&str; 5] = ["quat", "axisangle", "xyaxes", "zaxis", "euler"];
