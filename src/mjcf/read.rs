//! Checked document to [`Spec`]: classes resolved, defaults merged, frames unfolded.
//!
//! Values that [`super::check`] refused read as their defaults: the file has failed anyway.

use std::collections::BTreeMap;

use super::bodies::{Context, no_frames};
use super::check::Names;
use super::defaults::{self, Classes, MAIN, Value, Values};
use super::document::{Document, NodeId, Span};
use super::error::{Problem, ProblemKind};
use super::item::Item;
use super::lints;
use super::nearest::nearest;
use super::schema::{self, Kind, Row};
use super::spec::*;
use std::sync::Arc;

/// Reads the scene below the `mujoco` element.
pub fn read<'a>(document: &'a Document, root: NodeId, names: Names<'a>, problems: &'a mut Vec<Problem>) -> Spec {
    let sections = |name: &str| -> Vec<NodeId> {
        document.node(root).children.iter().copied().filter(|&n| document.node(n).name == name).collect()
    };
    let mut reader = Reader::new(document, names, problems);
    reader.users = reader.users(&sections("size"));
    let compiler = reader.compiler(&sections("compiler"));
    reader.degree = compiler.degree;
    reader.inertiafromgeom = compiler.inertiafromgeom;
    reader.classes = Classes::read(document, &sections("default"), compiler.degree, reader.problems);
    let options = sections("option");
    let option = reader.option(&options);
    let mut spec = Spec {
        model_name: document.attribute(root, "model").map_or(String::new(), |a| a.value.to_string()),
        compiler,
        option,
        flags: reader.flags(&options),
        world: Body { name: Some("world".to_string()), ..Body::default() },
        pairs: Vec::new(),
        excludes: Vec::new(),
        tendons: Vec::new(),
        equalities: Vec::new(),
        actuators: Vec::new(),
        sensors: Vec::new(),
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
    for node in sections("tendon") {
        spec.tendons.extend(reader.tendons(node));
    }
    for node in sections("equality") {
        spec.equalities.extend(reader.equalities(node));
    }
    for node in sections("actuator") {
        spec.actuators.extend(reader.actuators(node));
    }
    for node in sections("sensor") {
        spec.sensors.extend(reader.sensors(node));
    }
    // `<size nkey>` adds keyframes that say nothing.
    if let Some(size) = reader.merged(&sections("size"), "mujoco", "size") {
        let (wanted, node) = (size.integer("nkey").max(0) as usize, size.node);
        if wanted > MAX_KEYS {
            let rule = format!("at most {MAX_KEYS}");
            let kind = ProblemKind::OutOfRange { attribute: "nkey".into(), rule, word: wanted.to_string() };
            reader.report(kind, document.value_span(node, "nkey"));
        }
        let wanted = wanted.min(MAX_KEYS);
        spec.keyframes.resize_with(spec.keyframes.len().max(wanted), || Keyframe { node, ..Keyframe::default() });
    }
    spec
}

/// What `<compiler>` says, problems aside.
pub fn compiler(document: &Document) -> Compiler {
    let children = document.root().map_or(&[][..], |root| &document.node(root).children);
    let nodes: Vec<NodeId> = children.iter().copied().filter(|&n| document.node(n).name == "compiler").collect();
    Reader::new(document, Names::default(), &mut Vec::new()).compiler(&nodes)
}

pub struct Reader<'a> {
    pub document: &'a Document,
    /// What is defined.
    names: Names<'a>,
    pub problems: &'a mut Vec<Problem>,
    /// `<compiler angle>`
    degree: bool,
    /// `<compiler inertiafromgeom>`
    pub inertiafromgeom: Option<bool>,
    classes: Classes<'a>,
    /// For what stands in no `<frame>`.
    pub no_frames: Arc<[Pose]>,
    /// What all free joints have in common, once there was one.
    pub free: Option<Joint>,
    /// The values of a class, and what a geom has from them: those of the last geom that said no more than where it is.
    pub alike: Option<(Arc<Values<'a>>, Geom)>,
    /// Meshes by name, those that were asked for.
    pub meshes: BTreeMap<String, Option<Mesh>>,
    /// `<size>`: how many `user` numbers an element may have, and the attribute that says so, by element.
    users: BTreeMap<&'static str, (&'static str, usize)>,
}

impl<'a> Reader<'a> {
    fn new(document: &'a Document, names: Names<'a>, problems: &'a mut Vec<Problem>) -> Reader<'a> {
        let (classes, meshes, users, free, alike) = Default::default();
        let no_frames = no_frames();
        Reader {
            document,
            names,
            problems,
            degree: true,
            inertiafromgeom: None,
            classes,
            no_frames,
            meshes,
            users,
            free,
            alike,
        }
    }
}

impl<'a> Reader<'a> {
    pub fn report(&mut self, kind: ProblemKind, span: Span) {
        self.problems.push(Problem::new(kind, span));
    }

    /// The element with the values of its class: its own `class`, else the one around it.
    pub fn item(&mut self, node: NodeId, parent: &str, class: &str) -> Option<Item<'a>> {
        let element = &self.document.node(node).name;
        let row = schema::find(parent, element).filter(|row| !matches!(row.status, schema::Status::Unsupported(..)))?;
        let class = self.document.attribute(node, "class").map_or(class, |a| &*a.value);
        let item = self.overlaid(node, row, self.classes.values(class, parent, element));
        let lint = if self.degree { lints::radians } else { lints::degrees };
        lint(self.document, node, row, item.word("type"), self.problems);
        self.inherited_references(&item);
        self.user_numbers(&item);
        Some(item)
    }

    /// What an element's class refers to must be there as soon as the element is.
    fn inherited_references(&mut self, item: &Item) {
        for (name, value) in item.inherited.iter() {
            if let Some(Kind::Reference(what)) = item.row.attribute(name).map(|column| column.kind)
                && let Value::Text(name_given) = value
                && self.document.attribute(item.node, name).is_none()
                && !self.names.has(what, name_given)
            {
                let near = nearest(name_given, self.names.sorted(what).iter().copied());
                let kind = ProblemKind::UnknownReference { what: what.into(), name: name_given.to_string() };
                let element = &self.document.node(item.node).name;
                let problem = Problem::new(kind, self.document.span(item.node))
                    .help(format!("a default class gives it to this {element}"));
                self.problems.push(problem.suggest(near));
            }
        }
    }

    fn user_numbers(&mut self, item: &Item) {
        if self.users.is_empty() {
            return;
        }
        let element = &*self.document.node(item.node).name;
        let Some(&(size, most)) = self.users.get(element) else { return };
        let found = item.numbers("user").len();
        if found > most {
            let plural = if most == 1 { "" } else { "s" };
            let expected = format!("at most {most} number{plural} by `<size {size}>`");
            let found = format!("{found} are");
            let kind = ProblemKind::WrongCount { attribute: "user".into(), expected, found };
            self.report(kind, self.document.value_span(item.node, "user"));
        }
    }

    /// Reads `<size nuser_…>`, as far as it limits something.
    fn users(&mut self, nodes: &[NodeId]) -> BTreeMap<&'static str, (&'static str, usize)> {
        let Some(item) = self.merged(nodes, "mujoco", "size") else { unreachable!("the schema has `size`") };
        let elements = |names: &'static str| schema::children(names).collect::<Vec<_>>();
        let (actuators, sensors, tendons) = (elements("actuator"), elements("sensor"), elements("tendon"));
        let each: [(&'static str, &[&'static str]); 8] = [
            ("nuser_body", &["body"]),
            ("nuser_jnt", &["joint"]),
            ("nuser_geom", &["geom"]),
            ("nuser_site", &["site"]),
            ("nuser_cam", &["camera"]),
            ("nuser_tendon", &tendons),
            ("nuser_actuator", &actuators),
            ("nuser_sensor", &sensors),
        ];
        let limited = each.iter().filter(|(size, _)| item.integer(size) >= 0);
        let rows = limited.flat_map(|&(size, of)| of.iter().map(move |&element| (element, size)));
        rows.map(|(element, size)| (element, (size, item.integer(size) as usize))).collect()
    }

    fn overlaid(&mut self, node: NodeId, row: &'static Row, inherited: Arc<Values<'a>>) -> Item<'a> {
        let mut own = Values::default();
        let turned = defaults::overlay(self.document, node, row, &inherited, &mut own, self.problems);
        Item::new(node, row, inherited, own, turned)
    }

    /// Several elements that count as one: later values replace earlier ones.
    fn merged(&mut self, nodes: &[NodeId], parent: &str, element: &str) -> Option<Item<'a>> {
        let row = schema::find(parent, element)?;
        let mut values = Values::default();
        for &node in nodes {
            defaults::overlay(self.document, node, row, &Values::default(), &mut values, self.problems);
        }
        Some(Item::new(nodes.last().copied().unwrap_or_default(), row, Arc::default(), values, false))
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
            noslip_iterations: item.number("noslip_iterations") as usize,
            noslip_tolerance: item.number("noslip_tolerance"),
            magnetic: item.array("magnetic"),
            density: item.number("density"),
            viscosity: item.number("viscosity"),
            wind: item.array("wind"),
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
            match &*self.document.node(child).name {
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
                problem.correct(Some(near))
            } else if let Some(near) = near(others) {
                problem.help(format!("did you mean `<{other} name=\"{near}\" data=…/>`?"))
            } else {
                problem.help(format!("there is {}", known.join(", ")))
            };
            self.problems.push(help);
        }
    }

    fn sensors(&mut self, section: NodeId) -> Vec<Sensor> {
        let nodes = &self.document.node(section).children;
        nodes.iter().filter_map(|&node| self.sensor(node)).collect()
    }

    /// `None` for what Penny does not measure, which the check has said.
    fn sensor(&mut self, node: NodeId) -> Option<Sensor> {
        let element = &self.document.node(node).name;
        let item = self.item(node, "sensor", MAIN)?;
        let kind = SensorKind::ALL.iter().copied().find(|kind| kind.name() == element)?;
        let word = |name: &str| item.word(name).to_string();
        let named = |of: &str| (of.to_string(), word(of));
        let object = ["joint", "actuator", "tendon", "body"].into_iter().find(|of| item.given(of));
        let (object, reference) = match object {
            Some(of) => (named(of), None),
            _ if item.given("objname") => {
                let pair = [("reftype", "refname"), ("refname", "reftype")];
                if let Some((_, missing)) = pair.into_iter().find(|(a, b)| item.given(a) && !item.given(b)) {
                    let kind =
                        ProblemKind::MissingAttribute { element: element.to_string(), attribute: missing.into() };
                    self.report(kind, self.document.span(node));
                }
                let reference = item.given("refname").then(|| (word("reftype"), word("refname")));
                let within = item.given("site").then(|| named("site"));
                ((word("objtype"), word("objname")), within.or(reference))
            }
            None => (named("site"), None),
        };
        self.history(&item);
        let absent = item.row.attribute("site").is_some() && !item.given("site");
        if absent && item.row.attribute("camera").is_some() && !item.given("camera") {
            let kind = ProblemKind::MissingAttribute { element: element.to_string(), attribute: "site".into() };
            self.report(kind, self.document.span(node));
        }
        let unmeasured =
            absent || item.yes("enclosed") || item.word("data") != item.row.attribute("data").map_or("", |c| c.default);
        let camera = [Some(&object), reference.as_ref()].into_iter().flatten().any(|(of, _)| of == "camera");
        if camera {
            let lost = "Penny has no cameras that measure; the other sensors are not affected".to_string();
            let kind = ProblemKind::Ignored { name: element.to_string(), lost };
            self.report(kind, self.document.span(node));
        }
        if unmeasured || camera {
            return None;
        }
        if item.number("cutoff") > 0.0 && !kind.clips() {
            let what = "`cutoff` has no meaning for unit vectors and quaternions".to_string();
            let kind = ProblemKind::Meaningless { what };
            self.problems.push(Problem::new(kind, self.document.name_span(node, "cutoff")).help("leave it out"));
        }
        let (cutoff, noise) = (item.number("cutoff"), item.number("noise"));
        Some(Sensor { node, name: item.name(), kind, object, reference, cutoff, noise })
    }

    /// When a sensor measures, and how late it says so: what Penny leaves out has to be right all the same.
    fn history(&mut self, item: &Item) {
        let [period, phase] = item.array("interval");
        if period < 0.0 || phase > 0.0 || period > 0.0 && phase <= -period {
            let what = "`interval` is a period, and a phase above minus this period and not above zero".to_string();
            self.meaningless(item.node, "interval", what, "");
        }
        if item.number("delay") > 0.0 && item.integer("nsample") <= 0 {
            let what = "what is delayed needs room for its history".to_string();
            self.meaningless(item.node, "delay", what, "add an `nsample`, or leave `delay` out");
        }
    }

    fn actuators(&mut self, section: NodeId) -> Vec<Actuator> {
        let nodes = &self.document.node(section).children;
        nodes.iter().filter_map(|&node| self.actuator(node)).collect()
    }

    fn actuator(&mut self, node: NodeId) -> Option<Actuator> {
        let item = self.item(node, "actuator", MAIN)?;
        let element = self.document.node(node).name.to_string();
        let (kp, kv) = (item.number("kp"), item.number("kv"));
        let (mut dampratio, inheritrange) = (item.number("dampratio"), item.number("inheritrange"));
        let servo = ([kp, 0.0, 0.0], [0.0, -kp, -kv]);
        let filter = item.number("timeconst");
        let (kind, (gain, mut bias), activation) = match element.as_str() {
            "motor" => (ActuatorKind::Motor, ([1.0, 0.0, 0.0], [0.0; 3]), Activation::None),
            "position" if filter > 0.0 => (ActuatorKind::Position, servo, Activation::ExactFilter(filter)),
            "position" => (ActuatorKind::Position, servo, Activation::None),
            "velocity" => (ActuatorKind::Velocity, ([kv, 0.0, 0.0], [0.0, 0.0, -kv]), Activation::None),
            "intvelocity" => (ActuatorKind::IntVelocity, servo, Activation::Integrator),
            "damper" => (ActuatorKind::Damper, ([0.0, 0.0, -kv], [0.0; 3]), Activation::None),
            "cylinder" => {
                let circle = 0.25 * std::f64::consts::PI * item.number("diameter").powi(2);
                let area = if item.given("diameter") { circle } else { item.number("area") };
                (ActuatorKind::Cylinder, ([area, 0.0, 0.0], item.array("bias")), Activation::Filter(filter))
            }
            _ => (ActuatorKind::General, (self.gain(&item), self.bias(&item)), self.activation(&item)),
        };
        // As in MuJoCo, a servo whose damping has the wrong sign has a damping ratio.
        if element == "general" && bias[1] == -gain[0] && bias[2] > 0.0 {
            dampratio = std::mem::take(&mut bias[2]);
        }
        if element == "damper" && item.array::<2>("ctrlrange").iter().any(|x| *x < 0.0) {
            let what = "a damper takes no negative control".to_string();
            self.meaningless(node, "ctrlrange", what, "give a range from zero upwards");
        }
        if element == "damper" && kv < 0.0 && self.document.attribute(node, "kv").is_none() {
            let what = "a damper has no negative damping, which its class gives".to_string();
            self.meaningless(node, "kv", what, "give it a `kv`");
        }
        let range = match element.as_str() {
            "position" => Some("ctrlrange"),
            "intvelocity" => Some("actrange"),
            // Of others the one from the joint counts.
            _ => None,
        };
        if let Some(range) = range.filter(|range| inheritrange > 0.0 && item.array(range) != [0.0; 2]) {
            self.conflict(node, "inheritrange", range, "either says the range");
        }
        if activation == Activation::None && (item.maybe("actlimited") == Some(true) || item.given("actrange")) {
            let what = "an actuator without dynamics has no activation".to_string();
            self.meaningless(node, "actrange", what, "give it a `dyntype`");
        }
        if element == "intvelocity" && item.maybe("actlimited") == Some(false) && item.given("actrange") {
            let what =
                "MuJoCo limits the activation of an `intvelocity` to its `actrange` whatever this says".to_string();
            self.meaningless(node, "actlimited", what, "leave `actrange` out, or write `actlimited=\"true\"`");
        }
        if item.array::<3>("damping")[1..] != [0.0; 2] {
            let lost = "only its first coefficient would count".to_string();
            let kind = ProblemKind::Unsupported { name: "damping".into(), lost };
            self.problems.push(Problem::new(kind, self.document.value_span(node, "damping")).help("give one number"));
        }
        Some(Actuator {
            node,
            name: item.name(),
            kind,
            transmission: self.transmission(&item, &element),
            gear: item.array("gear"),
            ctrlrange: item.optional("ctrlrange"),
            // A damper needs a range.
            ctrllimited: if element == "damper" { Some(true) } else { item.maybe("ctrllimited") },
            forcerange: item.optional("forcerange"),
            forcelimited: item.maybe("forcelimited"),
            actrange: item.optional("actrange"),
            // MuJoCo switches this off for `general` only.
            actlimited: item.maybe("actlimited").filter(|limited| *limited || element == "general"),
            activation,
            actearly: item.yes("actearly"),
            gain,
            bias,
            dampratio,
            inheritrange,
            damping: item.array::<3>("damping")[0],
            armature: item.number("armature"),
        })
    }

    /// Of several things to act on MuJoCo takes the last in this order, without a word.
    fn transmission(&mut self, item: &Item, element: &str) -> Transmission {
        let word = |name: &str| item.word(name).to_string();
        if item.given("refsite") && !item.given("site") {
            self.meaningless(item.node, "refsite", "`refsite` needs a `site`".to_string(), "");
        }
        let targets = ["joint", "jointinparent", "tendon", "cranksite", "site"];
        let mut given: Vec<&str> = targets.into_iter().filter(|name| item.given(name)).collect();
        let target = given.pop();
        for other in given {
            let lost = format!("the actuator acts on its `{}`", target.unwrap_or_default());
            let kind = ProblemKind::Ignored { name: other.to_string(), lost };
            self.report(kind, self.document.name_span(item.node, other));
        }
        let own = |name: &&str| self.document.attribute(item.node, name).is_some();
        if let Some(other) = target.filter(|target| *target != "cranksite")
            && let Some(own) = ["slidersite", "cranklength"].into_iter().find(own)
        {
            let what = format!("`{own}` belongs to a slider-crank, but this actuator has a `{other}`");
            self.meaningless(item.node, own, what, "keep one of the two");
        }
        match target {
            Some("joint") => Transmission::Joint(word("joint")),
            Some("jointinparent") => Transmission::JointInParent(word("jointinparent")),
            Some("tendon") => Transmission::Tendon(word("tendon")),
            Some("site") => {
                Transmission::Site { site: word("site"), reference: item.given("refsite").then(|| word("refsite")) }
            }
            Some(_) => self.slider_crank(item, element),
            None if item.given("slidersite") => self.slider_crank(item, element),
            None => {
                if !item.row.typed_attributes().any(|c| targets_other(c.name) && item.given(c.name)) {
                    let kind = ProblemKind::MissingAttribute { element: element.into(), attribute: "joint".into() };
                    self.report(kind, self.document.span(item.node));
                }
                Transmission::None
            }
        }
    }

    fn slider_crank(&mut self, item: &Item, element: &str) -> Transmission {
        if let Some(missing) = ["cranksite", "slidersite", "cranklength"].into_iter().find(|name| !item.given(name)) {
            let kind = ProblemKind::MissingAttribute { element: element.into(), attribute: missing.into() };
            let problem = Problem::new(kind, self.document.span(item.node));
            self.problems.push(problem.help("a slider-crank has a crank, a slider and a rod between them"));
            return Transmission::None;
        }
        let rod = item.number("cranklength");
        if rod <= 0.0 {
            let (attribute, rule) = ("cranklength".to_string(), "positive".to_string());
            let kind = ProblemKind::OutOfRange { attribute, rule, word: rod.to_string() };
            self.report(kind, self.document.value_span(item.node, "cranklength"));
        }
        Transmission::SliderCrank {
            crank: item.word("cranksite").to_string(),
            slider: item.word("slidersite").to_string(),
            rod,
        }
    }

    fn meaningless(&mut self, node: NodeId, attribute: &str, what: String, help: &str) {
        let problem = Problem::new(ProblemKind::Meaningless { what }, self.document.name_span(node, attribute));
        self.problems.push(if help.is_empty() { problem } else { problem.help(help) });
    }

    fn activation(&mut self, item: &Item) -> Activation {
        let [tau] = item.array("dynprm");
        let (given, has) = (item.integer("actdim"), i32::from(item.word("dyntype") != "none"));
        if given != -1 && given != has {
            let what = format!("an actuator of this `dyntype` has {} activation", if has == 0 { "no" } else { "one" });
            self.meaningless(item.node, "actdim", what, "leave it out");
        }
        match item.word("dyntype") {
            "none" => Activation::None,
            "integrator" => Activation::Integrator,
            "filter" => Activation::Filter(tau),
            "filterexact" => Activation::ExactFilter(tau),
            _ => {
                self.unknown_type(item, "dyntype", "use `none`, `integrator`, `filter` or `filterexact`");
                Activation::None
            }
        }
    }

    fn gain(&mut self, item: &Item) -> [f64; 3] {
        match item.word("gaintype") {
            "fixed" => [item.array::<10>("gainprm")[0], 0.0, 0.0],
            "affine" => item.array("gainprm"),
            _ => {
                self.unknown_type(item, "gaintype", "use `fixed` or `affine`");
                [0.0; 3]
            }
        }
    }

    fn bias(&mut self, item: &Item) -> [f64; 3] {
        match item.word("biastype") {
            "none" => [0.0; 3],
            "affine" => item.array("biasprm"),
            _ => {
                self.unknown_type(item, "biastype", "use `none` or `affine`");
                [0.0; 3]
            }
        }
    }

    fn unknown_type(&mut self, item: &Item, attribute: &str, help: &str) {
        let lost = "the actuator's force would be missing".to_string();
        let kind = ProblemKind::Unsupported { name: item.word(attribute).into(), lost };
        self.problems.push(Problem::new(kind, self.document.value_span(item.node, attribute)).help(help));
    }
}

/// Transmissions that Penny lacks; using one was reported.
fn targets_other(attribute: &str) -> bool {
    attribute == "body"
}

const MAX_NUMERIC: usize = 1_000_000;
/// More empty keyframes than this nobody needs.
const MAX_KEYS: usize = 10_000;

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
        act: list("act"),
        mpos: list("mpos"),
        plastic: list("plastic"),
        mquat: list("mquat"),
    }
}
