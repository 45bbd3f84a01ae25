//! Checked document to [`Spec`]: classes resolved, defaults merged, frames unfolded.
//!
//! Values that [`super::check`] refused read as their defaults: the file has failed anyway.

use std::collections::BTreeMap;

use super::bodies::{Context, no_frames};
use super::defaults::{self, Classes, MAIN, Values};
use super::document::{Document, NodeId, Span};
use super::error::{Problem, ProblemKind};
use super::item::Item;
use super::lints;
use super::nearest::nearest;
use super::schema::{self, Element};
use super::spec::*;

/// Reads the scene below the `mujoco` element.
pub fn read(document: &Document, root: NodeId, problems: &mut Vec<Problem>) -> Spec {
    let sections = |name: &str| -> Vec<NodeId> {
        document.node(root).children.iter().copied().filter(|&n| document.node(n).name == name).collect()
    };
    let mut reader = Reader { document, problems, degree: true, inertiafromgeom: None, classes: Classes::default() };
    let compiler = reader.compiler(&sections("compiler"));
    reader.degree = compiler.degree;
    reader.inertiafromgeom = compiler.inertiafromgeom;
    reader.classes = Classes::read(document, &sections("default"), compiler.degree, reader.problems);
    let options = sections("option");
    let mut spec = Spec {
        model_name: document.attribute(root, "model").map_or(String::new(), |a| a.value.clone()),
        compiler,
        option: reader.option(&options),
        flags: reader.flags(&options),
        world: Body { name: Some("world".to_string()), ..Body::default() },
        pairs: Vec::new(),
        excludes: Vec::new(),
        actuators: Vec::new(),
        keyframes: Vec::new(),
        numerics: Vec::new(),
        texts: Vec::new(),
    };
    for section in sections("worldbody") {
        spec.world.node = section;
        reader.children(section, &mut spec.world, &Context { class: MAIN, frames: &no_frames(), depth: 0 });
    }
    for node in sections("contact").into_iter().chain(sections("custom")).chain(sections("keyframe")) {
        reader.section(node, &mut spec);
    }
    for node in sections("actuator") {
        spec.actuators.extend(reader.actuators(node));
    }
    spec
}

pub struct Reader<'a> {
    pub document: &'a Document,
    pub problems: &'a mut Vec<Problem>,
    /// `<compiler angle>`
    degree: bool,
    /// `<compiler inertiafromgeom>`
    pub inertiafromgeom: Option<bool>,
    classes: Classes,
}

impl Reader<'_> {
    pub fn report(&mut self, kind: ProblemKind, span: Span) {
        self.problems.push(Problem::new(kind, span));
    }

    /// The element with the values of its class: its own `class`, else the one around it.
    pub fn item(&mut self, node: NodeId, parent: &str, class: &str) -> Option<Item> {
        let element = &self.document.node(node).name;
        let row = schema::find(parent, element).filter(|row| !matches!(row.status, schema::Status::Unsupported(..)))?;
        let class = self.document.attribute(node, "class").map_or(class, |a| a.value.as_str());
        let item = self.overlaid(node, row, self.classes.values(class, element));
        if self.degree {
            lints::radians(self.document, node, row, &item.values, self.problems);
        }
        Some(item)
    }

    fn overlaid(&mut self, node: NodeId, row: &'static Element, mut values: Values) -> Item {
        defaults::overlay(self.document, node, row, &mut values, self.problems);
        Item { node, row, values }
    }

    /// Several elements that count as one: later values replace earlier ones.
    fn merged(&mut self, nodes: &[NodeId], parent: &str, element: &str) -> Option<Item> {
        let row = schema::find(parent, element)?;
        let values = nodes.iter().fold(Values::new(), |values, &node| self.overlaid(node, row, values).values);
        Some(Item { node: nodes.last().copied().unwrap_or_default(), row, values })
    }

    // Settings.

    fn compiler(&mut self, nodes: &[NodeId]) -> Compiler {
        let Some(item) = self.merged(nodes, "mujoco", "compiler") else { unreachable!("the schema has `compiler`") };
        let sequence: Vec<u8> = item.word("eulerseq").bytes().collect();
        let eulerseq = <[u8; 3]>::try_from(sequence).ok().filter(|s| s.iter().all(|c| b"xyzXYZ".contains(c)));
        if eulerseq.is_none() {
            let kind = ProblemKind::OutOfRange {
                attribute: "eulerseq".into(),
                rule: "three of the letters x, y, z, X, Y, Z".into(),
                word: format!("`{}`", item.word("eulerseq")),
            };
            self.report(kind, self.document.value_span(item.node, "eulerseq"));
        }
        let [first, last] = item.array("inertiagrouprange");
        Compiler {
            degree: item.word("angle") == "degree",
            eulerseq: eulerseq.unwrap_or(*b"xyz"),
            autolimits: item.yes("autolimits"),
            inertiafromgeom: item.maybe("inertiafromgeom"),
            inertiagrouprange: [first as i32, last as i32],
            balanceinertia: item.yes("balanceinertia"),
            boundmass: item.number("boundmass"),
            boundinertia: item.number("boundinertia"),
            settotalmass: item.number("settotalmass"),
        }
    }

    fn option(&mut self, nodes: &[NodeId]) -> OptionSpec {
        let Some(item) = self.merged(nodes, "mujoco", "option") else { unreachable!("the schema has `option`") };
        OptionSpec {
            node: nodes.last().copied(),
            timestep: item.number("timestep"),
            gravity: item.array("gravity"),
            integrator: item.word("integrator").to_string(),
            cone: if item.word("cone") == "elliptic" { Cone::Elliptic } else { Cone::Pyramidal },
            impratio: item.number("impratio"),
            tolerance: item.number("tolerance"),
            iterations: item.number("iterations") as usize,
            o_margin: item.number("o_margin"),
            o_solref: item.array("o_solref"),
            o_solimp: item.array("o_solimp"),
            o_friction: item.array("o_friction"),
        }
    }

    fn flags(&mut self, options: &[NodeId]) -> BTreeMap<&'static str, bool> {
        let nodes: Vec<NodeId> =
            options.iter().flat_map(|&option| self.document.node(option).children.iter().copied()).collect();
        let Some(item) = self.merged(&nodes, "option", "flag") else { unreachable!("the schema has `flag`") };
        item.row.typed_attributes().map(|column| (column.name, item.yes(column.name))).collect()
    }

    // Contacts, data, actuators.

    fn section(&mut self, node: NodeId, spec: &mut Spec) {
        let section = &self.document.node(node).name;
        for &child in &self.document.node(node).children {
            let Some(item) = self.item(child, section, MAIN) else {
                continue;
            };
            match self.document.node(child).name.as_str() {
                "pair" => spec.pairs.push(pair(&item)),
                "exclude" => spec.excludes.push(Exclude {
                    node: child,
                    body1: item.word("body1").to_string(),
                    body2: item.word("body2").to_string(),
                }),
                "numeric" => spec.numerics.extend(self.numeric(&item)),
                "text" => spec.texts.extend(self.text(&item)),
                "key" => spec.keyframes.push(keyframe(&item)),
                _ => {}
            }
        }
    }

    fn numeric(&mut self, item: &Item) -> Option<Numeric> {
        let name = item.name()?;
        self.penny_name(item.node, &name, ("numeric", PENNY_NUMERICS), ("text", PENNY_TEXTS));
        let mut data = item.numbers("data");
        let size = item.number("size") as usize;
        if data.is_empty() && size == 0 {
            let kind = ProblemKind::MissingAttribute { element: "numeric".into(), attribute: "data".into() };
            self.report(kind, self.document.span(item.node));
        }
        if size > 0 && data.len() > size {
            let kind = ProblemKind::WrongCount {
                attribute: "data".into(),
                expected: format!("as many numbers as `size` says, {size}"),
                found: format!("{} are", data.len()),
            };
            self.report(kind, self.document.value_span(item.node, "data"));
        }
        if size > MAX_NUMERIC {
            let rule = format!("at most {MAX_NUMERIC}");
            let kind = ProblemKind::OutOfRange { attribute: "size".into(), rule, word: size.to_string() };
            self.report(kind, self.document.value_span(item.node, "size"));
            return None;
        }
        data.resize(data.len().max(size), 0.0);
        Some(Numeric { node: item.node, name, data })
    }

    fn text(&mut self, item: &Item) -> Option<Text> {
        let name = item.name()?;
        self.penny_name(item.node, &name, ("text", PENNY_TEXTS), ("numeric", PENNY_NUMERICS));
        let data = item.word("data").to_string();
        if data.is_empty() && item.given("data") {
            let kind = ProblemKind::EmptyValue { attribute: "data".into() };
            self.report(kind, self.document.value_span(item.node, "data"));
        }
        Some(Text { node: item.node, name, data })
    }

    /// A name that is to mean something to Penny does: among those of its own element, else perhaps of the other.
    fn penny_name(
        &mut self,
        node: NodeId,
        name: &str,
        (what, known): (&str, &[&'static str]),
        (other, others): (&str, &[&'static str]),
    ) {
        if name.starts_with("penny.") && !known.contains(&name) {
            let kind = ProblemKind::UnknownPennyName { what: what.into(), name: name.into() };
            let problem = Problem::new(kind, self.document.value_span(node, "name"));
            let near = |names: &[&'static str]| nearest(name, names.iter().copied());
            let help = if others.contains(&name) {
                problem.help(format!("it is a {other}: write `<{other} name=\"{name}\" data=…/>`"))
            } else if let Some(near) = near(known) {
                problem.suggest(Some(near))
            } else if let Some(near) = near(others) {
                problem.help(format!("did you mean `<{other} name=\"{near}\" data=…/>`?"))
            } else {
                problem.help(format!("there is {}", known.join(", ")))
            };
            self.problems.push(help);
        }
    }

    fn actuators(&mut self, section: NodeId) -> Vec<Actuator> {
        let nodes = &self.document.node(section).children;
        nodes.iter().filter_map(|&node| self.actuator(node)).collect()
    }

    fn actuator(&mut self, node: NodeId) -> Option<Actuator> {
        let item = self.item(node, "actuator", MAIN)?;
        let element = self.document.node(node).name.clone();
        let (kp, kv) = (item.number("kp"), item.number("kv"));
        let (kind, gain, bias) = match element.as_str() {
            "motor" => (ActuatorKind::Motor, 1.0, [0.0; 3]),
            "position" => (ActuatorKind::Position, kp, [0.0, -kp, -kv]),
            "velocity" => (ActuatorKind::Velocity, kv, [0.0, 0.0, -kv]),
            _ => (ActuatorKind::General, item.array::<10>("gainprm")[0], self.bias(&item)),
        };
        if item.word("joint").is_empty()
            && !item.row.typed_attributes().any(|c| targets_other(c.name) && item.given(c.name))
        {
            let kind = ProblemKind::MissingAttribute { element, attribute: "joint".into() };
            self.report(kind, self.document.span(node));
        }
        Some(Actuator {
            node,
            name: item.name(),
            kind,
            joint: item.word("joint").to_string(),
            gear: item.array("gear"),
            ctrlrange: item.optional("ctrlrange"),
            ctrllimited: item.maybe("ctrllimited"),
            forcerange: item.optional("forcerange"),
            forcelimited: item.maybe("forcelimited"),
            gain,
            bias,
        })
    }

    fn bias(&mut self, item: &Item) -> [f64; 3] {
        match item.word("biastype") {
            "none" => [0.0; 3],
            "affine" => item.array("biasprm"),
            other => {
                let lost = "the bias force would be missing".to_string();
                let kind = ProblemKind::Unsupported { name: other.into(), lost };
                let span = self.document.value_span(item.node, "biastype");
                self.problems.push(Problem::new(kind, span).help("use `none` or `affine`"));
                [0.0; 3]
            }
        }
    }
}

/// Transmissions that Penny lacks; using one was reported.
fn targets_other(attribute: &str) -> bool {
    matches!(attribute, "jointinparent" | "tendon" | "site" | "refsite" | "slidersite" | "cranksite" | "body")
}

const MAX_NUMERIC: usize = 1_000_000;

/// `<custom>` numerics and texts that mean something to Penny.
pub const PENNY_NUMERICS: &[&str] = &["penny.k", "penny.c", "penny.alpha", "penny.mu", "penny.mu_roll", "penny.goal"];
pub const PENNY_TEXTS: &[&str] = &["penny.contact", "penny.truth", "penny.level"];

/// What `penny.truth` may be. The laboratory knows what each is; that it knows these and no others, a test of it tells.
pub const PENNY_TRUTHS: &[&str] = &[
    "fall",
    "fall-steps",
    "spring",
    "dry-spring",
    "pendulum-period",
    "slide-to-roll-speed",
    "slip-end",
    "slide-to-roll-path",
    "incline",
    "push",
    "rolling-resistance",
    "spin-down",
    "restitution",
    "collision",
    "cradle",
    "rest-depth",
    "creep",
    "block-acceleration",
    "block-path",
    "block-path-steps",
    "contact-share",
    "friction-ratio",
    "stop-path",
    "stop-path-steps",
    "stop-time",
    "topple",
    "load-share",
    "free-energy",
    "free-momentum",
    "free-period",
    "top-period",
    "euler-disk",
    "rolling-plate",
];

fn pair(item: &Item) -> Pair {
    Pair {
        node: item.node,
        geom1: item.word("geom1").to_string(),
        geom2: item.word("geom2").to_string(),
        condim: item.integer("condim").max(0) as usize,
        friction: item.array("friction"),
        solref: item.array("solref"),
        solreffriction: item.array("solreffriction"),
        solimp: item.array("solimp"),
        margin: item.number("margin"),
        gap: item.number("gap"),
    }
}

fn keyframe(item: &Item) -> Keyframe {
    let list = |name: &str| item.given(name).then(|| item.numbers(name));
    Keyframe {
        node: item.node,
        name: item.name(),
        time: item.number("time"),
        qpos: list("qpos"),
        qvel: list("qvel"),
        ctrl: list("ctrl"),
    }
}
