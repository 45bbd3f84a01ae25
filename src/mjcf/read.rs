//! Checked document to [`Spec`]: classes resolved, defaults merged, frames unfolded.
//!
//! Values that [`super::check`] refused read as their defaults: the file has failed anyway.

use std::collections::BTreeMap;

use super::defaults::{self, Classes, MAIN, ORIENTATIONS, Value, Values};
use super::document::{Document, NodeId, Span};
use super::error::{Problem, ProblemKind};
use super::schema::{self, Element};
use super::spec::*;
use super::suggest::nearest;

/// Reads the scene below the `mujoco` element.
pub fn read(document: &Document, root: NodeId, problems: &mut Vec<Problem>) -> Spec {
    let sections = |name: &str| -> Vec<NodeId> {
        document.node(root).children.iter().copied().filter(|&n| document.node(n).name == name).collect()
    };
    let classes = Classes::read(document, &sections("default"), problems);
    let mut reader = Reader { document, classes, problems, autolimits: true };
    let compiler = reader.compiler(&sections("compiler"));
    reader.autolimits = compiler.autolimits;
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
        reader.children(section, &mut spec.world, &Context { class: MAIN, frames: &[], depth: 0 });
    }
    for node in sections("contact").into_iter().chain(sections("custom")).chain(sections("keyframe")) {
        reader.section(node, &mut spec);
    }
    for node in sections("actuator") {
        spec.actuators.extend(reader.actuators(node));
    }
    spec
}

struct Reader<'a> {
    document: &'a Document,
    classes: Classes,
    problems: &'a mut Vec<Problem>,
    autolimits: bool,
}

/// What surrounds an element.
#[derive(Clone, Copy)]
struct Context<'a> {
    /// The class of elements that name none.
    class: &'a str,
    /// The `<frame>`s between the body and the element, outermost first.
    frames: &'a [Pose],
    /// 0 in the world.
    depth: usize,
}

/// An element with its values: its own, its class's, or the schema's defaults.
struct Item {
    node: NodeId,
    row: &'static Element,
    values: Values,
}

impl Item {
    /// Whether the element or its class gives this.
    fn given(&self, name: &str) -> bool {
        self.values.contains_key(name)
    }

    fn default(&self, name: &str) -> &'static str {
        self.row.attribute(name).map_or("", |column| column.default)
    }

    fn numbers(&self, name: &str) -> Vec<f64> {
        let mut all = super::check::floats(self.default(name)).unwrap_or_default();
        if let Some(Value::Numbers(given)) = self.values.get(name) {
            if all.len() < given.len() {
                all = given.clone();
            } else {
                all[..given.len()].copy_from_slice(given);
            }
        }
        all
    }

    fn array<const N: usize>(&self, name: &str) -> [f64; N] {
        let mut array = [0.0; N];
        array.iter_mut().zip(self.numbers(name)).for_each(|(a, v)| *a = v);
        array
    }

    fn optional<const N: usize>(&self, name: &str) -> Option<[f64; N]> {
        self.given(name).then(|| self.array(name))
    }

    fn number(&self, name: &str) -> f64 {
        self.array::<1>(name)[0]
    }

    fn integer(&self, name: &str) -> i32 {
        self.number(name) as i32
    }

    fn word(&self, name: &str) -> &str {
        match self.values.get(name) {
            Some(Value::Text(text)) => text,
            _ => self.default(name),
        }
    }

    fn yes(&self, name: &str) -> bool {
        matches!(self.word(name), "true" | "enable")
    }

    /// `None` is "auto".
    fn maybe(&self, name: &str) -> Option<bool> {
        match self.word(name) {
            "true" => Some(true),
            "false" => Some(false),
            _ => None,
        }
    }

    fn name(&self) -> Option<String> {
        Some(self.word("name").to_string()).filter(|name| !name.is_empty())
    }

    fn orientation(&self) -> Orientation {
        match ORIENTATIONS.into_iter().find(|name| self.given(name)) {
            Some("quat") => Orientation::Quat(self.array("quat")),
            Some("axisangle") => Orientation::AxisAngle(self.array("axisangle")),
            Some("xyaxes") => Orientation::XyAxes(self.array("xyaxes")),
            Some("zaxis") => Orientation::ZAxis(self.array("zaxis")),
            Some("euler") => Orientation::Euler(self.array("euler")),
            _ => Orientation::None,
        }
    }

    fn pose(&self, frames: &[Pose]) -> Pose {
        Pose { pos: self.array("pos"), orientation: self.orientation(), frames: frames.to_vec() }
    }
}

impl Reader<'_> {
    fn report(&mut self, kind: ProblemKind, span: Span) {
        self.problems.push(Problem::new(kind, span));
    }

    /// The element with the values of its class: its own `class`, else the one around it.
    fn item(&mut self, node: NodeId, parent: &str, class: &str) -> Option<Item> {
        let element = &self.document.node(node).name;
        let row = schema::find(parent, element).filter(|row| !matches!(row.status, schema::Status::Unsupported(..)))?;
        let class = self.document.attribute(node, "class").map_or(class, |a| a.value.as_str());
        let values = self.classes.values(class, element);
        Some(self.overlaid(node, row, values))
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
            alignfree: item.yes("alignfree"),
            discardvisual: item.yes("discardvisual"),
            fusestatic: item.yes("fusestatic"),
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

    // Bodies.

    /// What stands in a body or in one of its frames.
    fn children(&mut self, node: NodeId, body: &mut Body, context: &Context) {
        for &child in &self.document.node(node).children {
            match self.document.node(child).name.as_str() {
                "body" => {
                    if let Some(child) = self.body(child, context) {
                        body.children.push(child);
                    }
                }
                "frame" => self.frame(child, body, context),
                "inertial" | "joint" | "freejoint" if context.depth == 0 => {
                    let element = self.document.node(child).name.clone();
                    let kind = ProblemKind::NotInWorld { element };
                    let problem = Problem::new(kind, self.document.span(child));
                    self.problems.push(problem.help("put it into a `<body>`"));
                }
                "inertial" => body.inertial = self.inertial(child, context).or(body.inertial.take()),
                "joint" => self.joint(child, body, context),
                "freejoint" => self.freejoint(child, body, context),
                "geom" => {
                    if let Some(geom) = self.geom(child, context) {
                        body.geoms.push(geom);
                    }
                }
                _ => {}
            }
        }
    }

    fn body(&mut self, node: NodeId, context: &Context) -> Option<Body> {
        let item = self.item(node, "body", MAIN)?;
        self.one_orientation(node);
        let mut body = Body {
            node,
            name: item.name(),
            pose: item.pose(context.frames),
            mocap: item.yes("mocap"),
            gravcomp: item.number("gravcomp"),
            ..Body::default()
        };
        let class = Some(item.word("childclass")).filter(|c| !c.is_empty()).unwrap_or(context.class);
        self.children(node, &mut body, &Context { class, frames: &[], depth: context.depth + 1 });
        Some(body)
    }

    fn frame(&mut self, node: NodeId, body: &mut Body, context: &Context) {
        let Some(item) = self.item(node, "body", MAIN) else {
            return;
        };
        self.one_orientation(node);
        let mut frames = context.frames.to_vec();
        frames.push(item.pose(&[]));
        let own = [item.word("childclass"), item.word("class")].into_iter().find(|c| !c.is_empty());
        let class = own.unwrap_or(context.class);
        self.children(node, body, &Context { class, frames: &frames, depth: context.depth });
    }

    fn inertial(&mut self, node: NodeId, context: &Context) -> Option<Inertial> {
        let item = self.item(node, "body", MAIN)?;
        self.one_orientation(node);
        if item.given("fullinertia") {
            let other = ["diaginertia"].into_iter().chain(ORIENTATIONS).find(|name| item.given(name));
            if let Some(other) = other {
                self.conflict(node, "fullinertia", other, "`fullinertia` needs neither principal moments nor axes");
            }
        }
        Some(Inertial {
            node,
            pos: item.array("pos"),
            orientation: item.orientation(),
            mass: item.number("mass"),
            diaginertia: item.optional("diaginertia"),
            fullinertia: item.optional("fullinertia"),
            frames: context.frames.to_vec(),
        })
    }

    fn joint(&mut self, node: NodeId, body: &mut Body, context: &Context) {
        let Some(item) = self.item(node, "body", context.class) else {
            return;
        };
        let kind = match item.word("type") {
            "free" => JointKind::Free,
            "ball" => JointKind::Ball,
            "slide" => JointKind::Slide,
            _ => JointKind::Hinge,
        };
        for name in ["stiffness", "damping"] {
            if item.numbers(name)[1..].iter().any(|&c| c != 0.0) {
                let lost = "the force would be linear: its higher coefficients would be missing";
                let kind = ProblemKind::Unsupported { name: name.into(), lost: lost.into() };
                self.problems.push(Problem::new(kind, self.document.value_span(node, name)).help("give one number"));
            }
        }
        if kind != JointKind::Free {
            self.limits(&item);
        }
        let joint = Joint {
            node,
            name: item.name(),
            kind,
            pos: item.array("pos"),
            axis: item.array("axis"),
            springref: item.number("springref"),
            reference: item.number("ref"),
            stiffness: item.number("stiffness"),
            damping: item.number("damping"),
            armature: item.number("armature"),
            frictionloss: item.number("frictionloss"),
            range: item.optional("range"),
            limited: item.maybe("limited"),
            align: None,
            margin: item.number("margin"),
            solreflimit: item.array("solreflimit"),
            solimplimit: item.array("solimplimit"),
            solreffriction: item.array("solreffriction"),
            solimpfriction: item.array("solimpfriction"),
            frames: context.frames.to_vec(),
        };
        self.add_joint(joint, body, context);
    }

    /// A free joint takes nothing from the joints' default classes.
    fn freejoint(&mut self, node: NodeId, body: &mut Body, context: &Context) {
        let (Some(item), Some(row)) = (self.item(node, "body", MAIN), schema::find("body", "joint")) else {
            return;
        };
        let plain = Item { node, row, values: Values::new() };
        let joint = Joint {
            node,
            name: item.name(),
            kind: JointKind::Free,
            pos: [0.0; 3],
            axis: plain.array("axis"),
            springref: 0.0,
            reference: 0.0,
            stiffness: 0.0,
            damping: 0.0,
            armature: 0.0,
            frictionloss: 0.0,
            range: None,
            limited: None,
            align: item.maybe("align"),
            margin: 0.0,
            solreflimit: plain.array("solreflimit"),
            solimplimit: plain.array("solimplimit"),
            solreffriction: plain.array("solreffriction"),
            solimpfriction: plain.array("solimpfriction"),
            frames: context.frames.to_vec(),
        };
        self.add_joint(joint, body, context);
    }

    fn add_joint(&mut self, joint: Joint, body: &mut Body, context: &Context) {
        let span = self.document.span(joint.node);
        if joint.kind == JointKind::Free && context.depth > 1 {
            let problem = Problem::new(ProblemKind::FreeJointNested, span);
            let outer = self.document.span(body.node);
            self.problems.push(problem.related(outer, "this body stands in another body"));
        }
        if let Some(first) = body.joints.first() {
            let first_span = self.document.span(first.node);
            if joint.kind == JointKind::Free || first.kind == JointKind::Free {
                let problem = Problem::new(ProblemKind::FreeJointNotAlone, span);
                self.problems.push(problem.related(first_span, "first joint here"));
            }
        }
        body.joints.push(joint);
    }

    // Geoms.

    fn geom(&mut self, node: NodeId, context: &Context) -> Option<Geom> {
        let item = self.item(node, "body", context.class)?;
        self.one_orientation(node);
        let kind = self.geom_kind(&item)?;
        if item.given("fromto") {
            self.fromto(&item);
        }
        let size: Vec<f64> = item.numbers("size");
        Some(Geom {
            node,
            name: item.name(),
            kind,
            pose: item.pose(context.frames),
            fromto: item.optional("fromto"),
            size,
            mass: item.optional::<1>("mass").map(|[mass]| mass),
            density: item.number("density"),
            shellinertia: item.yes("shellinertia"),
            contype: item.integer("contype") as u32,
            conaffinity: item.integer("conaffinity") as u32,
            condim: item.integer("condim").max(0) as usize,
            group: item.integer("group"),
            priority: item.integer("priority"),
            friction: item.array("friction"),
            solmix: item.number("solmix"),
            solref: item.array("solref"),
            solimp: item.array("solimp"),
            margin: item.number("margin"),
            gap: item.number("gap"),
            rgba: item.array::<4>("rgba").map(|c| c as f32),
        })
    }

    /// The shape; `None` for one that Penny lacks, which is an error unless the geom is only there to be seen.
    fn geom_kind(&mut self, item: &Item) -> Option<GeomKind> {
        let name = item.word("type");
        let kind = match name {
            "plane" => Some(GeomKind::Plane),
            "sphere" => Some(GeomKind::Sphere),
            "capsule" => Some(GeomKind::Capsule),
            "ellipsoid" => Some(GeomKind::Ellipsoid),
            "cylinder" => Some(GeomKind::Cylinder),
            "box" => Some(GeomKind::Box),
            _ => None,
        };
        if kind.is_some() && !item.given("mesh") {
            return kind;
        }
        let weightless =
            [("mass", ""), ("density", "1000")].iter().any(|&(name, _)| item.given(name) && item.number(name) == 0.0);
        let touches = item.integer("contype") != 0 || item.integer("conaffinity") != 0;
        if touches || !weightless {
            let (attribute, name) = if kind.is_some() { ("mesh", "mesh") } else { ("type", name) };
            let lost = if touches { "nothing would touch it" } else { "its mass and inertia would be missing" };
            let kind = ProblemKind::Unsupported { name: name.into(), lost: lost.into() };
            let span = self.document.value_span(item.node, attribute);
            self.problems
                .push(Problem::new(kind, span).help("use a plane, sphere, capsule, ellipsoid, cylinder or box"));
        }
        None
    }

    fn fromto(&mut self, item: &Item) {
        let node = item.node;
        if item.array("pos") != [0.0; 3] {
            self.conflict(node, "fromto", "pos", "`fromto` says where the geom is");
        }
        let own = ORIENTATIONS.iter().find(|name| self.document.attribute(node, name).is_some());
        if let (Some(name), Some(_)) = (own, self.document.attribute(node, "fromto")) {
            self.report(ProblemKind::OrientationLost, self.document.name_span(node, name));
        }
    }

    // Rules shared by several elements.

    /// At most one orientation in the element itself.
    fn one_orientation(&mut self, node: NodeId) {
        let mut own = self.document.node(node).attributes.iter().filter(|a| ORIENTATIONS.contains(&a.name.as_str()));
        let Some(first) = own.next() else {
            return;
        };
        if let Some(second) = own.next() {
            let kind = ProblemKind::SeveralOrientations { element: self.document.node(node).name.clone() };
            let problem = Problem::new(kind, second.name_span);
            self.problems.push(problem.related(first.name_span, "first one here"));
        }
    }

    fn conflict(&mut self, node: NodeId, one: &str, other: &str, help: &str) {
        let element = self.document.node(node).name.clone();
        let kind = ProblemKind::Conflict { element, one: one.into(), other: other.into() };
        self.problems.push(Problem::new(kind, self.document.name_span(node, other)).help(help));
    }

    /// A range that must limit has to increase; one that may limit and does not increase is lost.
    fn limits(&mut self, item: &Item) {
        let [low, high] = item.array("range");
        let span = self.document.value_span(item.node, "range");
        match item.maybe("limited") {
            Some(true) if low >= high => self.report(ProblemKind::RangeEmpty { low, high }, span),
            None if low > high && self.document.attribute(item.node, "range").is_some() => {
                self.report(ProblemKind::RangeLost, span);
            }
            _ => {}
        }
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
        self.penny_name(item.node, "numeric", &name, PENNY_NUMERICS);
        let mut data = item.numbers("data");
        let size = item.number("size") as usize;
        if data.is_empty() && size == 0 {
            let kind = ProblemKind::MissingAttribute { element: "numeric".into(), attribute: "data".into() };
            self.report(kind, self.document.span(item.node));
        }
        if size > 0 && data.len() > size {
            let kind = ProblemKind::WrongCount {
                attribute: "data".into(),
                expected: format!("{size} numbers as `size` says"),
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
        self.penny_name(item.node, "text", &name, PENNY_TEXTS);
        let data = item.word("data").to_string();
        if data.is_empty() && item.given("data") {
            let kind = ProblemKind::EmptyValue { attribute: "data".into() };
            self.report(kind, self.document.value_span(item.node, "data"));
        }
        Some(Text { node: item.node, name, data })
    }

    fn penny_name(&mut self, node: NodeId, what: &str, name: &str, known: &[&'static str]) {
        if name.starts_with("penny.") && !known.contains(&name) {
            let kind = ProblemKind::UnknownPennyName { what: what.into(), name: name.into() };
            let problem = Problem::new(kind, self.document.value_span(node, "name"));
            let cure = match nearest(name, known.iter().copied()) {
                Some(near) => problem.suggest(Some(near)),
                None => problem.help(format!("there is {}", known.join(", "))),
            };
            self.problems.push(cure);
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
