//! Document against schema: every name, count, keyword and number, each problem at its place.

use std::cell::OnceCell;
use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

use super::defaults::{MAIN, ORIENTATIONS};
use super::document::{Attribute, Document, NodeId, Span};
use super::error::{Advice, Problem, ProblemKind};
use super::files;
use super::limits::Limits;
use super::lints;
use super::nearest::nearest;
use super::parse::raise;
use super::removed;
use super::schema::{self, Column, Kind, Lint, Row, Rule, Status};
use super::suggestions;

/// Finds whatever is wrong with the names and values of a document.
///
/// `whole`: the XML was intact, so that what is missing from the document is missing from the file.
/// The second part of the value is what is defined.
pub fn check<'a>(document: &'a Document, whole: bool, limits: &'a Limits) -> (Vec<Problem>, Names<'a>) {
    let Some(root) = document.root() else {
        return Default::default();
    };
    let mut check = Check {
        document,
        whole,
        limits,
        problems: Vec::new(),
        names: Names::default(),
        references: Vec::new(),
        suggestions: SUGGESTIONS,
    };
    check.note(CLASS, MAIN, Span::default());
    let name = &*document.node(root).name;
    if name != "mujoco" {
        let problem = Problem::new(ProblemKind::NotMjcf { found: name.to_string() }, document.span(root));
        let near = nearest(name, ["mujoco"]);
        return (vec![document.rename(problem.suggest(near), root, near)], Names::default());
    }
    check.element(root, schema::root(), "mujoco", "");
    if whole {
        check.all_references();
        check.problems.extend(files::missing(document, root));
    }
    (check.problems, check.names)
}

/// What is defined.
#[derive(Default)]
pub struct Names<'a> {
    /// By what it is.
    kinds: BTreeMap<&'static str, Named<'a>>,
    /// How many names there are.
    count: usize,
}

#[derive(Default)]
struct Named<'a> {
    /// Where each name is given first.
    places: HashMap<&'a str, Span>,
    sorted: OnceCell<Vec<&'a str>>,
}

impl<'a> Names<'a> {
    /// Adds a name. Out: where it was given before, if it was.
    fn add(&mut self, what: &'static str, name: &'a str, span: Span) -> Option<Span> {
        match self.kinds.entry(what).or_default().places.entry(name) {
            Entry::Occupied(given) => Some(*given.get()),
            Entry::Vacant(place) => {
                place.insert(span);
                self.count += 1;
                None
            }
        }
    }

    /// Whether something of that name is defined.
    pub fn has(&self, what: &str, name: &str) -> bool {
        (what == "body" && name == "world") || self.kinds.get(what).is_some_and(|of| of.places.contains_key(name))
    }

    /// All names of a kind, in order; asked for when nothing is added any more.
    pub fn sorted(&self, what: &str) -> &[&'a str] {
        let sort = |of: &Named<'a>| {
            let mut sorted: Vec<&str> = of.places.keys().copied().collect();
            sorted.sort_unstable();
            sorted
        };
        self.kinds.get(what).map_or(&[], |of| of.sorted.get_or_init(|| sort(of)))
    }
}

/// Takes attributes out that are empty where a number or a name should be: MuJoCo reads them as not given. A reference that a
/// class may give stays: empty, it takes back what the class gives.
pub fn forget_empty(document: &mut Document) {
    let blank = |a: &Attribute| a.value.trim().is_empty();
    let Some(root) = document.root().filter(|_| document.attributes.iter().any(blank)) else { return };
    let mut open = vec![(root, Some(schema::root()))];
    while let Some((id, row)) = open.pop() {
        let node = &mut document.nodes[id.0 as usize];
        let counts = |column: &Column| match column.kind {
            Kind::Numbers(..) | Kind::Integers(..) | Kind::Name(_) => true,
            Kind::Reference(_) => !column.in_default,
            _ => false,
        };
        let meant = |a: &Attribute| row.and_then(|row| row.attribute(&a.name)).is_some_and(counts);
        // What is left moves to the front of the element's part of the list.
        let Range { start, end } = node.attributes;
        let mut left = start;
        for i in start..end {
            let attribute = &document.attributes[i as usize];
            if !(blank(attribute) && meant(attribute)) {
                document.attributes.swap(left as usize, i as usize);
                left += 1;
            }
        }
        node.attributes.end = left;
        let (name, children) = (&document.node(id).name, &document.node(id).children);
        open.extend(children.iter().map(|&child| (child, schema::find(name, &document.node(child).name))));
    }
}

/// Default classes are names too.
const CLASS: &str = "default class";

struct Check<'a> {
    document: &'a Document,
    whole: bool,
    problems: Vec<Problem>,
    limits: &'a Limits,
    names: Names<'a>,
    /// What is referred to: (what, name, where).
    references: Vec<(&'static str, &'a str, Span)>,
    /// Names that may still be compared with misspelt ones.
    suggestions: usize,
}

/// More comparisons of names are not made: who misspells thousands of them does not read a suggestion for each.
const SUGGESTIONS: usize = 50_000;

impl<'a> Check<'a> {
    fn report(&mut self, kind: ProblemKind, span: Span) {
        self.problems.push(Problem::new(kind, span));
    }

    /// The nearest of some names, while suggestions are still looked for.
    fn nearest<'n>(&mut self, name: &str, candidates: impl IntoIterator<Item = &'n str>) -> Option<&'n str> {
        nearest_of(&mut self.suggestions, name, candidates)
    }

    /// `name` is the element's name as it should be spelt.
    fn element(&mut self, node: NodeId, row: &'static Row, name: &str, parent: &str) {
        let element = self.document.node(node);
        match row.status {
            Status::Ignored(lost) => {
                self.report(ProblemKind::Ignored { name: element.name.to_string(), lost: lost.into() }, element.span);
            }
            Status::Unsupported(lost, help) => {
                let kind = ProblemKind::Unsupported { name: element.name.to_string(), lost: lost.into() };
                self.problems.push(Problem::new(kind, element.span).help(help));
                return self.names_of(node, parent);
            }
            Status::Supported | Status::Silent => {}
        }
        let in_default = parent == "default" && name != "default";
        for attribute in self.document.attributes(node) {
            self.attribute(node, attribute, name, row, in_default);
        }
        self.one_orientation(node);
        self.one_damping(node);
        if in_default {
            self.range_of_class(node, name);
        }
        if name == "default" {
            self.class(node, parent);
        }
        if !in_default && self.whole {
            self.required(node, row, name);
            self.implied_name(node, name);
        }
        self.children(node, row, name);
    }

    fn children(&mut self, node: NodeId, row: &'static Row, parent: &str) {
        let mut once: BTreeMap<&str, Span> = BTreeMap::new();
        for &child in &self.document.node(node).children {
            let element = self.document.node(child);
            let known = schema::find(parent, &element.name).map(|row| (row, &*element.name));
            // What is inside a misspelt element is judged as if it were spelt well.
            let Some((child_row, name)) = known.or_else(|| self.unknown_element(parent, row, child)) else {
                self.names_of(child, parent);
                continue;
            };
            // A class may hold each element once, but the top-level class may be written in several places.
            let unique = child_row.once || (parent == "default" && name != "default");
            if unique && let Some(first) = once.insert(name, element.span) {
                let kind = ProblemKind::RepeatedElement { parent: parent.into(), element: name.into() };
                self.problems.push(Problem::new(kind, element.span).related(first, "first one here"));
            }
            self.element(child, child_row, name, parent);
        }
    }

    /// Reports an element that may not stand there; gives the one that was probably meant.
    fn unknown_element(&mut self, parent: &str, row: &Row, node: NodeId) -> Option<(&'static Row, &'static str)> {
        if row.silent == "*" {
            return None;
        }
        let element = self.document.node(node).name.to_string();
        let span = self.document.span(node);
        if let Some(cure) = removed::element(parent, &element) {
            let kind = ProblemKind::UnknownElement { parent: parent.to_string(), element };
            self.problems.push(Problem::new(kind, span).help(cure));
            return None;
        }
        let near = self.nearest(&element, schema::children(parent));
        let homes = schema::homes(&element);
        let parent = parent.to_string();
        self.problems.push(if near.is_none() && !homes.is_empty() {
            let homes = or(homes.iter().map(|home| format!("`{home}`")));
            Problem::new(ProblemKind::MisplacedElement { parent: parent.clone(), element }, span)
                .help(format!("it belongs in {homes}"))
        } else {
            let problem = Problem::new(ProblemKind::UnknownElement { parent: parent.clone(), element }, span);
            self.document.rename(problem.suggest(near), node, near)
        });
        near.and_then(|near| schema::find(&parent, near).map(|row| (row, near)))
    }

    fn attribute(
        &mut self,
        node: NodeId,
        attribute: &'a Attribute,
        element: &str,
        row: &'static Row,
        in_default: bool,
    ) {
        let Some(column) = row.attribute(&attribute.name) else {
            if !row.is_silent(&attribute.name) {
                let (element, name) = (element.to_string(), attribute.name.to_string());
                let removed = removed::attribute(&element, attribute);
                // What is there already is not what was meant.
                let document = self.document;
                let free = |other: &&str| document.attribute(node, other).is_none();
                let meant = ELSEWHERE.iter().find(|(word, _)| *word == name).map(|(_, meant)| *meant);
                let near = match meant.filter(|meant| row.attribute(meant).is_some()) {
                    Some(meant) => Some(meant).filter(free),
                    None => self.nearest(&name, row.attribute_names().filter(free)),
                };
                let of_joints = element == "freejoint"
                    && schema::find("body", "joint").is_some_and(|j| j.attribute(&name).is_some());
                match near.and_then(|near| row.attribute(near)).map(|column| column.kind) {
                    Some(Kind::Name(what)) => self.note(what, &attribute.value, attribute.value_span),
                    Some(Kind::Text) if element == "default" => {
                        self.note(CLASS, &attribute.value, attribute.value_span)
                    }
                    _ => {}
                }
                let kind = ProblemKind::UnknownAttribute { element, attribute: name };
                let problem = Problem::new(kind, attribute.name_span);
                if let Some((cure, edit)) = removed {
                    return self.problems.push(Problem { fix: edit.into_iter().collect(), ..problem.help(cure) });
                }
                self.problems.push(match near {
                    Some(_) => problem.correct(near),
                    None if of_joints => problem.help("`<joint type=\"free\" …>` has it"),
                    _ => problem,
                });
            }
            return;
        };
        if in_default && !column.in_default {
            let (element, attribute_name) = (element.to_string(), attribute.name.to_string());
            return self.report(ProblemKind::NotInDefault { element, attribute: attribute_name }, attribute.name_span);
        }
        match column.kind {
            Kind::Name(_) if attribute.value.is_empty() => {}
            Kind::Name(what) => self.define(what, &attribute.value, attribute.value_span),
            Kind::Reference(_) if matches!(column.status, Status::Unsupported(..)) => {}
            // What a class names matters only to elements that end up with it: the reader sees which.
            Kind::Reference(_) if in_default || attribute.value.is_empty() => {}
            Kind::ReferenceBy(by) => self.reference_by(node, attribute, by),
            Kind::Class => self.references.push((CLASS, &attribute.value, attribute.value_span)),
            Kind::Reference(what) => self.references.push((what, &attribute.value, attribute.value_span)),
            Kind::Text => {}
            Kind::Keyword(words) => self.keyword(attribute, words),
            Kind::Numbers(min, max) => self.numbers(attribute, column, min, max),
            Kind::Integers(min, max) => self.integers(attribute, column, min, max),
        }
        self.status(attribute, column);
    }

    /// A name whose kind another attribute says.
    fn reference_by(&mut self, node: NodeId, attribute: &'a Attribute, by: &str) {
        if let Some(kind) = self.document.attribute(node, by)
            && let Some(what) = schema::kind_named(&kind.value)
        {
            self.references.push((what, &attribute.value, attribute.value_span));
        }
    }

    /// An attribute that Penny does not honour matters only where it differs from the default.
    fn status(&mut self, attribute: &Attribute, column: &Column) {
        if matches!(column.status, Status::Supported | Status::Silent) {
            return;
        }
        let same = match column.kind {
            Kind::Numbers(..) | Kind::Integers(..) => {
                let default = &column.numbers;
                floats(&attribute.value).is_some_and(|v| !default.is_empty() && default.starts_with(&v))
            }
            _ => &*attribute.value == column.default,
        };
        if same {
            return;
        }
        let name = attribute.name.to_string();
        match column.status {
            Status::Ignored(lost) => {
                self.report(ProblemKind::Ignored { name, lost: lost.into() }, attribute.name_span);
            }
            Status::Unsupported(lost, help) => {
                let kind = ProblemKind::Unsupported { name, lost: lost.into() };
                self.problems.push(Problem::new(kind, attribute.name_span).help(help));
            }
            Status::Supported | Status::Silent => {}
        }
    }

    /// At most one orientation, in whatever form.
    fn one_orientation(&mut self, node: NodeId) {
        let element = self.document.node(node);
        let mut own = self.document.attributes(node).iter().filter(|a| ORIENTATIONS.contains(&&*a.name));
        if let (Some(first), Some(second)) = (own.next(), own.next()) {
            let kind = ProblemKind::SeveralOrientations { element: element.name.to_string() };
            let problem = Problem::new(kind, second.name_span);
            self.problems.push(problem.related(first.name_span, "first one here"));
        }
    }

    /// The damping of a servo in one form, whatever the numbers.
    fn one_damping(&mut self, node: NodeId) {
        let own = |name: &str| self.document.attribute(node, name);
        if let (Some(_), Some(kv)) = (own("dampratio"), own("kv")) {
            let element = self.document.node(node).name.to_string();
            let kind = ProblemKind::Conflict { element, one: "dampratio".into(), other: "kv".into() };
            let help = "either says how the actuator is damped";
            self.problems.push(Problem::new(kind, kv.name_span).help(help));
        }
    }

    /// What a class says of an actuator's range, which is wrong even where nothing uses the class.
    fn range_of_class(&mut self, node: NodeId, element: &str) {
        let document = self.document;
        let own = |name: &str| document.attribute(node, name);
        let some = |name: &str, is: fn(f64) -> bool| {
            let numbers = own(name).and_then(|own| floats(&own.value));
            numbers.is_some_and(|numbers| numbers.into_iter().any(is))
        };
        let range = if element == "intvelocity" { "actrange" } else { "ctrlrange" };
        let Some(span) = own(range).map(|own| own.name_span) else { return };
        if matches!(element, "position" | "intvelocity")
            && some("inheritrange", |x| x > 0.0)
            && some(range, |x| x != 0.0)
        {
            let kind =
                ProblemKind::Conflict { element: element.into(), one: "inheritrange".into(), other: range.into() };
            self.problems.push(Problem::new(kind, span).help("either says the range"));
        }
        if element == "damper" && some(range, |x| x < 0.0) {
            let what = "a damper takes no negative control".to_string();
            let problem = Problem::new(ProblemKind::Meaningless { what }, span);
            self.problems.push(problem.help("give a range from zero upwards"));
        }
    }

    /// The class that a `<default>` opens.
    fn class(&mut self, node: NodeId, parent: &str) {
        let class = self.document.attribute(node, "class").filter(|a| !a.value.is_empty());
        match (class, parent) {
            (Some(class), "mujoco") if &*class.value != MAIN => {
                let kind = ProblemKind::MainRenamed { name: class.value.to_string() };
                self.problems.push(
                    Problem::new(kind, class.value_span).help("put the class into a `<default>` inside this one"),
                );
                // Whoever uses the class is not to blame.
                self.note(CLASS, &class.value, class.value_span);
            }
            (Some(_), "mujoco") | (None, "mujoco") => {}
            (Some(class), _) if &*class.value == MAIN => {
                let kind = ProblemKind::DuplicateName { what: CLASS.into(), name: class.value.to_string() };
                self.problems.push(Problem::new(kind, class.value_span).help("`main` is the outermost class"));
            }
            (Some(class), _) => self.define(CLASS, &class.value, class.value_span),
            (None, _) => {
                let kind = ProblemKind::MissingAttribute { element: "default".into(), attribute: "class".into() };
                self.report(kind, self.document.span(node));
            }
        }
    }

    /// The name of what is not understood, and the names inside it, still count as defined: who refers to them is not to blame.
    fn names_of(&mut self, node: NodeId, parent: &str) {
        let document = self.document;
        let element = &*document.node(node).name;
        if let Some(name) = document.attribute(node, "name") {
            let named = |row: &schema::Element| match row.attribute("name").map(|column| column.kind) {
                Some(Kind::Name(what)) => Some(what),
                _ => None,
            };
            let own = schema::SCHEMA.iter().filter(|row| row.is(element)).find_map(named);
            let siblings = schema::SCHEMA.iter().filter(|row| own.is_none() && row.stands_in(parent)).filter_map(named);
            for what in own.into_iter().chain(siblings) {
                self.note(what, &name.value, name.value_span);
            }
        }
        for &child in &document.node(node).children {
            self.names_of(child, element);
        }
    }

    /// A name that is there, where it was not before.
    fn note(&mut self, what: &'static str, name: &'a str, span: Span) {
        self.names.add(what, name, span);
    }

    fn define(&mut self, what: &'static str, name: &'a str, span: Span) {
        let first = self.names.add(what, name, span);
        let taken = || ProblemKind::DuplicateName { what: what.into(), name: name.into() };
        if what == "body" && name == "world" {
            self.problems.push(Problem::new(taken(), span).help("`world` is the name of `worldbody`"));
        } else if let Some(first) = first {
            self.problems.push(Problem::new(taken(), span).related(first, "first named here"));
        } else if self.names.count == self.limits.names + 1 {
            let limit = self.limits.names;
            let problem = Problem::new(ProblemKind::OverLimit { what: "names", limit }, span);
            self.problems.push(problem.help(raise("names", limit)));
        }
    }

    /// Assets without a name are called after their file.
    fn implied_name(&mut self, node: NodeId, element: &str) {
        let what = match element {
            "mesh" => "mesh",
            "hfield" => "height field",
            "texture" => "texture",
            _ => return,
        };
        if self.document.attribute(node, "name").is_none()
            && let Some(file) = self.document.attribute(node, "file")
            && let Some(stem) = std::path::Path::new(&*file.value).file_stem().and_then(|stem| stem.to_str())
        {
            self.note(what, stem, file.value_span);
        }
    }

    fn required(&mut self, node: NodeId, row: &'static Row, element: &str) {
        for &attribute in &row.required {
            if self.document.attribute(node, attribute).is_none() {
                let kind = ProblemKind::MissingAttribute { element: element.into(), attribute: attribute.into() };
                self.report(kind, self.document.span(node));
            }
        }
    }

    fn all_references(&mut self) {
        for (what, name, span) in std::mem::take(&mut self.references) {
            self.unknown(what, name, span);
        }
    }

    /// A reference to something that is not defined.
    fn unknown(&mut self, what: &'static str, name: &str, span: Span) {
        if self.names.has(what, name) {
            return;
        }
        let defined = self.names.sorted(what);
        let near = nearest_of(&mut self.suggestions, name, defined.iter().copied());
        let help = match near {
            Some(near) => format!("did you mean `{near}`?"),
            None if what == "material" => format!("add `<material name=\"{name}\"/>` to `<asset>`"),
            None => match defined.len() {
                0 => format!("no {what} has a name here"),
                1..=5 => format!("there is {}", or(defined.iter().map(|n| format!("`{n}`")))),
                _ => String::new(),
            },
        };
        // `wheel3` is not `wheel2` misspelt: it is missing.
        let unnumbered = |name: &str| name.replace(|c: char| c.is_ascii_digit(), "");
        let near = near.filter(|near| unnumbered(near) != unnumbered(name)).map(str::to_string);
        let name = name.to_string();
        let kind = match what {
            CLASS => ProblemKind::UnknownClass { name },
            _ => ProblemKind::UnknownReference { what: what.into(), name },
        };
        let problem = Problem::new(kind, span).replace(span, near.as_deref());
        self.problems.push(if help.is_empty() { problem } else { problem.help(help) });
    }

    fn keyword(&mut self, attribute: &Attribute, words: &[&'static str]) {
        if words.contains(&&*attribute.value) {
            return;
        }
        let kind =
            ProblemKind::UnknownKeyword { attribute: attribute.name.to_string(), value: attribute.value.to_string() };
        let problem = Problem::new(kind, attribute.value_span);
        if let Some(cure) = removed::value(&attribute.name, &attribute.value) {
            return self.problems.push(problem.help(cure));
        }
        let near = self.nearest(&attribute.value, words.iter().copied());
        self.problems.push(match near {
            Some(near) => problem.correct(Some(near)),
            None => problem.help(format!("it can be {}", or(words.iter().map(|w| format!("`{w}`"))))),
        });
    }

    fn numbers(&mut self, attribute: &Attribute, column: &Column, min: usize, max: usize) {
        self.words(attribute, column, (min, max), "number", |word, i| match word.parse::<f64>() {
            Err(_) => {
                let help = suggestions::number(word, suggestions::unit_of(column.unit, i));
                Err(Box::new((ProblemKind::NotANumber { word: word.into() }, help)))
            }
            Ok(value) if value.is_infinite() && !word.to_ascii_lowercase().contains("inf") => Err(Box::new((
                ProblemKind::NumberTooLarge { word: word.into() },
                "the largest is about `1.8e308`".into(),
            ))),
            Ok(value) => Ok(value),
        });
    }

    fn integers(&mut self, attribute: &Attribute, column: &Column, min: usize, max: usize) {
        self.words(attribute, column, (min, max), "whole number", |word, _| {
            let digits = word.trim_start_matches(['+', '-']).chars().all(|c| c.is_ascii_digit());
            match word.parse::<i64>() {
                Ok(value) if i32::try_from(value).is_ok() => Ok(value as f64),
                Err(_) if !digits || word.len() <= 9 => {
                    Err(Box::new((ProblemKind::NotAnInteger { word: word.into() }, suggestions::integer(word))))
                }
                _ => {
                    let help = format!("the largest is `{}`", i32::MAX).into();
                    Err(Box::new((ProblemKind::NumberTooLarge { word: word.into() }, help)))
                }
            }
        });
    }

    /// Every word of a value as a number, what that must be, and how many there are. `read`: a word as one, by its index.
    fn words(
        &mut self,
        attribute: &Attribute,
        column: &Column,
        (min, max): (usize, usize),
        what: &str,
        read: impl Fn(&str, usize) -> Result<f64, Box<(ProblemKind, Advice)>>,
    ) {
        if self.separators(attribute, min, max) {
            return;
        }
        let all = linted(attribute, column);
        let mut found = 0;
        for (i, word) in attribute.value.split_ascii_whitespace().enumerate() {
            found = i + 1;
            match read(word, i) {
                Ok(value) => self.rule(attribute, column, &all, value, word, i),
                Err(wrong) => self.wrong(wrong.0, attribute, i, wrong.1),
            }
        }
        self.count(attribute, column, found, (min, max), what);
    }

    /// A problem with the `index`-th word of a value.
    fn wrong(&mut self, kind: ProblemKind, attribute: &Attribute, index: usize, help: impl Into<Advice>) {
        let place = self.document.word_span(attribute, index);
        // Among entities a word has no place of its own.
        let word = Some(place).filter(|place| *place != attribute.value_span || index == 0 && attribute.is_plain());
        self.problems.push(Problem::new(kind, place).advise(help.into(), word, attribute.value_span));
    }

    /// Reports commas and the like among numbers; `false` if there are none, or if more than that is wrong.
    fn separators(&mut self, attribute: &Attribute, min: usize, max: usize) -> bool {
        let strange = |c: char| matches!(c, ',' | ';') || (c.is_whitespace() && !c.is_ascii());
        let plain = |c: u8| c.is_ascii() && !matches!(c, b',' | b';');
        if attribute.value.bytes().all(plain) || !attribute.value.contains(strange) {
            return false;
        }
        let Some(advice) = suggestions::separators(&attribute.value, min, max) else {
            return false;
        };
        let kind = ProblemKind::Separators { attribute: attribute.name.to_string() };
        let value = attribute.value_span;
        self.problems.push(Problem::new(kind, value).advise(advice, None, value));
        true
    }

    /// What a number must be, and then whether it is likely to be meant. `all`: [`linted`].
    fn rule(&mut self, attribute: &Attribute, column: &Column, all: &[f64], value: f64, word: &str, index: usize) {
        let rule = match column.rule {
            Rule::MayBeInfinite if !value.is_nan() => return,
            _ if !value.is_finite() => {
                let kind = ProblemKind::NotFinite { attribute: attribute.name.to_string(), word: word.to_string() };
                let help = suggestions::a_number(suggestions::unit_of(column.unit, index));
                return self.wrong(kind, attribute, index, help);
            }
            Rule::Positive if value <= 0.0 => "positive".to_string(),
            Rule::NotNegative if value < 0.0 => "zero or positive".to_string(),
            Rule::AtLeast(least) if value < f64::from(least) => format!("{least} or more"),
            Rule::OneOf(list) if !list.iter().any(|&n| f64::from(n) == value) => or(list.iter().map(i32::to_string)),
            _ => return self.lint(attribute, column, all, word, index),
        };
        let positive =
            Some(word.trim_start_matches('-')).filter(|_| value < 0.0 && !matches!(column.rule, Rule::OneOf(_)));
        let kind = ProblemKind::OutOfRange { attribute: attribute.name.to_string(), rule, word: word.to_string() };
        let advice = match positive {
            Some(word) => Advice::Word(format!("did you mean `{word}`?"), word.to_string()),
            None => hint(column).unwrap_or_default().into(),
        };
        self.wrong(kind, attribute, index, advice);
    }

    fn lint(&mut self, attribute: &Attribute, column: &Column, all: &[f64], word: &str, index: usize) {
        if let Some((kind, help)) = lints::number(column.lint, &attribute.name, index, word, all) {
            self.wrong(kind, attribute, index, help);
        }
    }

    /// How many numbers were found, and how many there may be.
    fn count(&mut self, attribute: &Attribute, column: &Column, found: usize, (min, max): (usize, usize), what: &str) {
        if (min..=max).contains(&found) {
            return;
        }
        let plural = |n: usize| if n == 1 { format!("{n} {what}") } else { format!("{n} {what}s") };
        let expected = match (min, max) {
            (1, usize::MAX) => format!("at least 1 {what}"),
            _ if min == max => plural(max),
            _ => format!("{min} to {}", plural(max)),
        };
        let found_words = if found == 1 { "1 is".to_string() } else { format!("{found} are") };
        // Too many: point at the first that is too many.
        let mut span = attribute.value_span;
        if found > max {
            span.start = self.document.word_span(attribute, max).start;
        }
        let kind = ProblemKind::WrongCount { attribute: attribute.name.to_string(), expected, found: found_words };
        let problem = Problem::new(kind, span);
        self.problems.push(Problem { help: hint(column), ..problem });
    }
}

/// Words for what MJCF calls otherwise, and whose nearest name in MJCF is something else.
const ELSEWHERE: &[(&str, &str)] = &[("kd", "kv")];

/// The nearest of some names, of which this many are `left` to be compared.
fn nearest_of<'n>(left: &mut usize, name: &str, candidates: impl IntoIterator<Item = &'n str>) -> Option<&'n str> {
    let mut seen = 0;
    let near = nearest(name, candidates.into_iter().take(*left).inspect(|_| seen += 1));
    *left -= seen;
    near
}

/// The numbers of an attribute that is to be looked at for what is probably not meant.
fn linted(attribute: &Attribute, column: &Column) -> Vec<f64> {
    if column.lint == Lint::None { Vec::new() } else { floats(&attribute.value).unwrap_or_default() }
}

/// What a column says of its numbers: their default and their unit.
fn hint(column: &Column) -> Option<String> {
    match (column.default, column.unit) {
        ("", "" | "1") => None,
        ("", unit) => Some(format!("in {unit}")),
        (default, "" | "1") => Some(format!("the default is `{default}`")),
        (default, unit) => Some(format!("the default is `{default}`, in {unit}")),
    }
}

/// "a, b or c"
fn or(words: impl Iterator<Item = String>) -> String {
    let words: Vec<String> = words.collect();
    match words.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
        _ => words.concat(),
    }
}

/// All words as numbers, if they all are.
pub fn floats(text: &str) -> Option<Vec<f64>> {
    text.split_ascii_whitespace().map(|word| word.parse().ok()).collect()
}
