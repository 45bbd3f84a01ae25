//! `<default>` classes: a tree in which a child copies its parent and then overrides.

use std::collections::BTreeMap;
use std::ops::Deref;
use std::sync::Arc;

use super::document::{Document, NodeId};
use super::error::{Problem, ProblemKind};
use super::lints;
use super::schema::{self, Kind, Row};
use super::shortcuts;

/// A value as it was read.
#[derive(Clone, Debug, PartialEq)]
pub enum Value<'a> {
    Numbers(Vec<f64>),
    Text(&'a str),
    /// What is inherited is taken back.
    Nothing,
}

/// Values by attribute, each once. They are few.
#[derive(Clone, Debug, Default)]
pub struct Values<'a>(Vec<(&'static str, Value<'a>)>);

impl<'a> Values<'a> {
    pub fn get(&self, name: &str) -> Option<&Value<'a>> {
        self.0.iter().find(|(of, _)| *of == name).map(|(_, value)| value)
    }

    fn take(&mut self, name: &str) -> Option<Value<'a>> {
        let at = self.0.iter().position(|(of, _)| *of == name)?;
        Some(self.0.swap_remove(at).1)
    }

    pub fn put(&mut self, name: &'static str, value: Value<'a>) {
        self.take(name);
        self.0.push((name, value));
    }

    /// Those whose names are so.
    pub fn only(&self, keep: impl Fn(&str) -> bool) -> Values<'a> {
        Values(self.0.iter().filter(|(name, _)| keep(name)).cloned().collect())
    }
}

impl<'a> Deref for Values<'a> {
    type Target = [(&'static str, Value<'a>)];

    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

/// For each class, what it gives each element.
#[derive(Clone, Debug, Default)]
pub struct Classes<'a> {
    classes: BTreeMap<&'a str, Class<'a>>,
    /// What is given where no class says anything.
    nothing: Arc<Values<'a>>,
}

/// By element.
pub type Class<'a> = BTreeMap<&'a str, Arc<Values<'a>>>;

pub const MAIN: &str = "main";

impl<'a> Classes<'a> {
    /// Reads all `<default>` sections; what is wrong with their names was reported by [`super::check`].
    ///
    /// `degree`: angles are in degrees.
    pub fn read(document: &'a Document, sections: &[NodeId], degree: bool, problems: &mut Vec<Problem>) -> Classes<'a> {
        let mut classes = Classes { classes: BTreeMap::from([(MAIN, Class::default())]), nothing: Arc::default() };
        for &section in sections {
            classes.class(document, section, MAIN, &Class::default(), degree, problems);
        }
        classes
    }

    /// `outer`: what the class has from the one around it.
    fn class(
        &mut self,
        document: &'a Document,
        node: NodeId,
        name: &'a str,
        outer: &Class<'a>,
        degree: bool,
        problems: &mut Vec<Problem>,
    ) {
        let (nested, own): (Vec<NodeId>, Vec<NodeId>) =
            document.node(node).children.iter().partition(|&&child| document.node(child).name == "default");
        // First what this class says itself: its children start from that, wherever they stand.
        for child in own {
            let element = &document.node(child).name;
            if let Some(row) = schema::find("default", element) {
                let class = self.classes.entry(name).or_default();
                let values = Arc::make_mut(class.entry(element).or_default());
                overlay(document, child, row, &Values::default(), values, problems);
                let kind = match values.get("type") {
                    Some(Value::Text(kind)) => kind,
                    _ => "",
                };
                let lint = if degree { lints::radians } else { lints::degrees };
                lint(document, child, row, kind, problems);
                shortcuts::share(class, element, outer);
            }
        }
        for child in nested {
            let class = document.attribute(child, "class");
            let Some(class) = class.filter(|a| !self.classes.contains_key(&*a.value)) else {
                continue;
            };
            let inherited = self.classes.get(name).cloned().unwrap_or_default();
            self.classes.insert(&class.value, inherited.clone());
            self.class(document, child, &class.value, &inherited, degree, problems);
        }
    }

    /// What a class gives an element; nothing if there is no such class.
    pub fn values(&self, class: &str, parent: &str, element: &str) -> Arc<Values<'a>> {
        let element = match parent {
            // What they tie together has its own defaults elsewhere.
            "fixed" | "spatial" => return self.nothing.clone(),
            "tendon" | "equality" => parent,
            _ => element,
        };
        self.classes.get(class).and_then(|c| c.get(element)).unwrap_or(&self.nothing).clone()
    }
}

/// A solref is either two positive numbers (timeconst, dampratio) or two that are not (−stiffness, −damping).
fn mixed_solref(document: &Document, node: NodeId, values: &Values, problems: &mut Vec<Problem>) {
    for attribute in document.attributes(node) {
        if !attribute.name.contains("solref") {
            continue;
        }
        if let Some(Value::Numbers(v)) = values.get(&attribute.name)
            && v.len() == 2
            && (v[0] > 0.0) != (v[1] > 0.0)
        {
            let kind =
                ProblemKind::MixedSolref { attribute: attribute.name.to_string(), value: format!("{} {}", v[0], v[1]) };
            problems.push(Problem::new(kind, attribute.value_span).help("MuJoCo and Penny use `0.02 1` instead"));
        }
    }
}

/// Puts an element's own values over those it inherits. Whether it has an orientation of its own.
///
/// As in MuJoCo, a shorter list of numbers replaces only the leading ones, and one form of orientation replaces
/// whichever form was inherited. Values that are no numbers, or too many, are left out: they were reported.
pub fn overlay<'a>(
    document: &'a Document,
    node: NodeId,
    row: &'static Row,
    inherited: &Values<'a>,
    own: &mut Values<'a>,
    problems: &mut Vec<Problem>,
) -> bool {
    let attributes = document.attributes(node);
    let turned = attributes.iter().any(|a| ORIENTATIONS.contains(&&*a.name));
    if turned {
        own.0.retain(|(name, _)| !ORIENTATIONS.contains(name));
    }
    let mut doubtful = false;
    own.0.reserve_exact(attributes.len());
    for attribute in attributes {
        let Some(column) = row.attribute(&attribute.name) else {
            continue;
        };
        match column.kind {
            Kind::Numbers(_, max) | Kind::Integers(_, max) => {
                let Some(mut all) = super::check::floats(&attribute.value).filter(|v| v.len() <= max) else {
                    continue;
                };
                let name = &attribute.name;
                doubtful |= name.starts_with("sol") || name.starts_with("o_sol") || *name == "friction";
                let before = own.take(column.name);
                let rest = match before.as_ref().or_else(|| inherited.get(column.name)) {
                    Some(Value::Numbers(inherited)) if max < usize::MAX => inherited,
                    _ => &column.numbers,
                };
                all.extend(rest.iter().skip(all.len()));
                own.0.push((column.name, Value::Numbers(all)));
            }
            Kind::Keyword(words) if !words.contains(&&*attribute.value) => {}
            Kind::Reference(_) if attribute.value.is_empty() => {
                own.take(column.name);
                own.0.push((column.name, Value::Nothing));
            }
            _ => {
                own.take(column.name);
                own.0.push((column.name, Value::Text(&attribute.value)));
            }
        }
    }
    let value = |name: &str| document.attribute(node, name).map(|own| &*own.value);
    for name in shortcuts::replaced(&document.node(node).name, value) {
        own.put(name, Value::Nothing);
    }
    if doubtful {
        mixed_solref(document, node, own, problems);
        lints::falling_impedance(document, node, own, problems);
        lints::swapped(document, node, own, problems);
    }
    turned
}

/// The five ways to write an orientation.
pub const ORIENTATIONS: [&str; 5] = ["quat", "axisangle", "xyaxes", "zaxis", "euler"];
