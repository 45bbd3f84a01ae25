//! The tree of bodies: frames unfolded, joints and geoms with their classes' values.

use std::sync::Arc;

use super::defaults::{MAIN, ORIENTATIONS};
use super::document::NodeId;
use super::error::{Problem, ProblemKind};
use super::files;
use super::item::Item;
use super::read::Reader;
use super::schema;
use super::spec::*;
use crate::math::{Vec3, quat};

/// What surrounds an element.
#[derive(Clone, Copy)]
pub struct Context<'a> {
    /// The class of elements that name none.
    pub class: &'a str,
    /// The `<frame>`s between the body and the element, outermost first.
    pub frames: &'a Arc<[Pose]>,
    /// 0 in the world.
    pub depth: usize,
}

/// Where a geom is and how large, and whose values it has.
const PLACE: &[&str] =
    &["pos", "size", "name", "type", "class", "fromto", "quat", "axisangle", "xyaxes", "zaxis", "euler"];

/// For what stands in no `<frame>`.
pub fn no_frames() -> Arc<[Pose]> {
    Arc::new([])
}

impl Reader<'_> {
    /// What stands in a body or in one of its frames. It calls itself for every level, so its own frame on the stack is to
    /// be small: what does not is not made part of it.
    pub fn children(&mut self, node: NodeId, body: &mut Body, context: &Context) {
        let is_body = |child: &&NodeId| self.document.node(**child).name == "body";
        let nodes = &self.document.node(node).children;
        let bodies = nodes.iter().filter(is_body).count();
        if body.children.is_empty() {
            body.children.reserve_exact(bodies);
        }
        for &child in nodes {
            match &*self.document.node(child).name {
                "body" => {
                    if let Some(child) = self.body(child, context) {
                        body.children.push(child);
                    }
                }
                "frame" => self.frame(child, body, context),
                // It holds a frame for each replica.
                "replicate" => self.children(child, body, context),
                "site" => body.sites.extend(self.site(child, context)),
                "camera" => body.cameras.extend(self.camera(child, context)),
                "inertial" | "joint" | "freejoint" if context.depth == 0 => {
                    let element = self.document.node(child).name.to_string();
                    let kind = ProblemKind::NotInWorld { element };
                    let problem = Problem::new(kind, self.document.span(child));
                    self.problems.push(problem.help("put it into a `<body>`"));
                }
                "inertial" => self.inertial(child, body, context),
                "joint" => self.joint(child, body, context),
                "freejoint" => self.freejoint(child, body, context),
                "geom" => self.geom(child, body, context),
                _ => {}
            }
        }
    }

    fn body(&mut self, node: NodeId, context: &Context) -> Option<Body> {
        let item = self.item(node, "body", MAIN)?;
        let mut body = Body {
            node,
            name: item.name(),
            pose: item.pose(context.frames),
            mocap: item.yes("mocap"),
            gravcomp: item.number("gravcomp"),
            ..Body::default()
        };
        if body.mocap && context.depth > 0 {
            let what = "only a body directly in `worldbody` can be placed from outside".to_string();
            let problem = Problem::new(ProblemKind::Meaningless { what }, self.document.name_span(node, "mocap"));
            self.problems.push(problem);
        }
        let class = Some(item.word("childclass")).filter(|c| !c.is_empty()).unwrap_or(context.class);
        let frames = self.no_frames.clone();
        self.children(node, &mut body, &Context { class, frames: &frames, depth: context.depth + 1 });
        Some(body)
    }

    #[inline(never)]
    fn frame(&mut self, node: NodeId, body: &mut Body, context: &Context) {
        let Some(item) = self.item(node, "body", MAIN) else {
            return;
        };
        let mut frames = context.frames.to_vec();
        frames.push(item.pose(&no_frames()));
        let own = [item.word("childclass"), item.word("class")].into_iter().find(|c| !c.is_empty());
        let class = own.unwrap_or(context.class);
        self.children(node, body, &Context { class, frames: &frames.into(), depth: context.depth });
    }

    #[inline(never)]
    fn inertial(&mut self, node: NodeId, body: &mut Body, context: &Context) {
        let Some(item) = self.item(node, "body", MAIN) else { return };
        // Of two in different frames MuJoCo takes what the second leaves out from the first, in the second's frame.
        if let Some(first) = &body.inertial {
            let kind = ProblemKind::RepeatedElement { parent: "body".into(), element: "inertial".into() };
            let first = self.document.span(first.node);
            self.problems.push(Problem::new(kind, self.document.span(node)).related(first, "first one here"));
        }
        if item.given("fullinertia") {
            let other = ["diaginertia"].into_iter().chain(ORIENTATIONS).find(|name| item.given(name));
            if let Some(other) = other {
                self.conflict(node, "fullinertia", other, "`fullinertia` needs neither principal moments nor axes");
            }
        }
        body.inertial = Some(Box::new(Inertial {
            node,
            pos: item.array("pos"),
            orientation: item.orientation(),
            mass: item.number("mass"),
            diaginertia: item.optional("diaginertia"),
            fullinertia: item.optional("fullinertia"),
            frames: context.frames.clone(),
        }));
    }

    #[inline(never)]
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
                let lost = "only its first coefficient would count";
                let kind = ProblemKind::Unsupported { name: name.into(), lost: lost.into() };
                self.problems.push(Problem::new(kind, self.document.value_span(node, name)).help("give one number"));
            }
        }
        if kind != JointKind::Free {
            self.limits(&item);
        }
        let given = item.array::<2>("springdamper");
        if given != [0.0; 2] && given.iter().any(|x| *x <= 0.0) {
            let rule = "two positive numbers".to_string();
            let word = format!("{} {}", given[0], given[1]);
            let kind = ProblemKind::OutOfRange { attribute: "springdamper".into(), rule, word };
            self.report(kind, self.document.value_span(node, "springdamper"));
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
            springdamper: item.optional("springdamper").filter(|given| *given != [0.0; 2]),
            actuatorfrcrange: item.optional("actuatorfrcrange"),
            actuatorfrclimited: item.maybe("actuatorfrclimited"),
            actuatorgravcomp: item.yes("actuatorgravcomp"),
            range: item.optional("range"),
            limited: item.maybe("limited"),
            margin: item.number("margin"),
            solreflimit: item.array("solreflimit"),
            solimplimit: item.array("solimplimit"),
            solreffriction: item.array("solreffriction"),
            solimpfriction: item.array("solimpfriction"),
            frames: context.frames.clone(),
        };
        self.add_joint(joint, body, context);
    }

    /// A free joint takes nothing from the joints' default classes.
    #[inline(never)]
    fn freejoint(&mut self, node: NodeId, body: &mut Body, context: &Context) {
        let Some(item) = self.item(node, "body", MAIN) else { return };
        if item.maybe("align") == Some(true) {
            let lost = "the body would keep its frame".to_string();
            let kind = ProblemKind::Unsupported { name: "align".into(), lost };
            self.problems.push(Problem::new(kind, self.document.name_span(node, "align")).help("leave it out"));
        }
        let (name, frames) = (item.name(), context.frames.clone());
        if let Some(free) = &self.free {
            let joint = Joint { node, name, frames, ..free.clone() };
            return self.add_joint(joint, body, context);
        }
        let Some(row) = schema::find("body", "joint") else { return };
        let plain = Item::plain(node, row);
        let joint = Joint {
            node,
            name: None,
            kind: JointKind::Free,
            pos: [0.0; 3],
            axis: plain.array("axis"),
            springref: 0.0,
            reference: 0.0,
            stiffness: 0.0,
            damping: 0.0,
            armature: 0.0,
            frictionloss: 0.0,
            springdamper: None,
            actuatorfrcrange: None,
            actuatorfrclimited: None,
            actuatorgravcomp: false,
            range: None,
            limited: None,
            margin: 0.0,
            solreflimit: plain.array("solreflimit"),
            solimplimit: plain.array("solimplimit"),
            solreffriction: plain.array("solreffriction"),
            solimpfriction: plain.array("solimpfriction"),
            frames: no_frames(),
        };
        self.free = Some(joint.clone());
        let joint = Joint { name, frames, ..joint };
        self.add_joint(joint, body, context);
    }

    fn add_joint(&mut self, joint: Joint, body: &mut Body, context: &Context) {
        let span = self.document.span(joint.node);
        if body.mocap && body.joints.is_empty() {
            let what = "a body that is placed from outside (`mocap`) has no joints".to_string();
            self.report(ProblemKind::Meaningless { what }, span);
        }
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
        body.joints.reserve_exact(usize::from(body.joints.is_empty()));
        body.joints.push(joint);
    }

    // Geoms.

    #[inline(never)]
    fn geom(&mut self, node: NodeId, body: &mut Body, context: &Context) {
        let Some(item) = self.item(node, "body", context.class) else { return };
        let Some(kind) = self.geom_kind(&item, body.node, context) else {
            return body.visuals.extend(self.visual(&item, context));
        };
        if item.given("fromto") {
            self.fromto(&item);
        }
        let rest = if item.says_only(PLACE) {
            // The rest is its class's: mostly that of the geom before.
            match &self.alike {
                Some((class, geom)) if Arc::ptr_eq(class, &item.inherited) => geom.clone(),
                _ => self.alike.insert((item.inherited.clone(), Reader::unplaced(&item))).1.clone(),
            }
        } else {
            Reader::unplaced(&item)
        };
        // Most bodies have one; they are large.
        body.geoms.reserve_exact(usize::from(body.geoms.is_empty()));
        body.geoms.push(Geom {
            node,
            name: item.name(),
            kind,
            pose: item.pose(context.frames),
            fromto: item.optional("fromto").map(Box::new),
            size: item.array("size"),
            sizes: item.count("size"),
            ..rest
        });
    }

    /// A geom of which everything is read but [`PLACE`].
    fn unplaced(item: &Item) -> Geom {
        Geom {
            node: item.node,
            name: None,
            kind: GeomKind::Sphere,
            pose: Pose::default(),
            fromto: None,
            size: [0.0; 3],
            sizes: 0,
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
            fluid: (item.word("fluidshape") == "ellipsoid").then(|| Box::new(item.array("fluidcoef"))),
            rgba: item.array::<4>("rgba").map(|c| c as f32),
        }
    }

    /// A mesh that is only seen, if pictures can show it.
    fn visual(&mut self, item: &Item, context: &Context) -> Option<Visual> {
        let fitted = simple_shape(item.word("type")).is_some();
        if !fitted && item.word("type") != "mesh" {
            return None;
        }
        let mesh = self.mesh(item.word("mesh"));
        if !fitted && !mesh.as_ref().is_some_and(|mesh| Mesh::is_known(&mesh.path)) {
            let lost = "pictures show only meshes from OBJ and STL files; the motion is the same".to_string();
            let kind = ProblemKind::Ignored { name: "mesh".into(), lost };
            self.report(kind, self.document.value_span(item.node, "mesh"));
        }
        Some(Visual {
            node: item.node,
            name: item.name(),
            pose: item.pose(context.frames),
            mesh,
            fitted,
            contype: item.integer("contype") as u32,
            conaffinity: item.integer("conaffinity") as u32,
            rgba: item.array::<4>("rgba").map(|c| c as f32),
        })
    }

    /// The mesh of that name, if it has a file.
    fn mesh(&mut self, name: &str) -> Option<Mesh> {
        if !self.meshes.contains_key(name) {
            let mesh = self.find_mesh(name);
            self.meshes.insert(name.to_string(), mesh);
        }
        self.meshes.get(name)?.clone()
    }

    fn find_mesh(&mut self, name: &str) -> Option<Mesh> {
        let document = self.document;
        let children = |node: NodeId, of: &'static str| {
            document.node(node).children.iter().copied().filter(move |&n| document.node(n).name == of)
        };
        let named = |node: &NodeId| match document.attribute(*node, "name") {
            Some(own) => &*own.value == name,
            None => document.attribute(*node, "file").is_some_and(|file| {
                std::path::Path::new(&*file.value).file_stem().is_some_and(|stem| stem.to_str() == Some(name))
            }),
        };
        let meshes = children(document.root()?, "asset").flat_map(|asset| children(asset, "mesh"));
        let node = meshes.into_iter().find(named)?;
        let (_, file) = files::files_of(document, node).into_iter().find(|(attribute, _)| *attribute == "file")?;
        let item = self.item(node, "asset", MAIN)?;
        let path = document.files.first()?.path.parent()?.join(file);
        let [scale, refpos] = ["scale", "refpos"].map(|name| Vec3::from(item.array::<3>(name)));
        Some(Mesh::new(path, scale, refpos, quat(&item.array::<4>("refquat"))))
    }

    fn site(&mut self, node: NodeId, context: &Context) -> Option<Site> {
        let item = self.item(node, "body", context.class)?;
        if item.given("fromto") {
            self.fromto(&item);
        }
        if item.word("type") == "mesh" && !item.given("mesh") {
            let kind = ProblemKind::MissingAttribute { element: "site".into(), attribute: "mesh".into() };
            self.report(kind, self.document.span(node));
        }
        Some(Site {
            node,
            name: item.name(),
            kind: simple_shape(item.word("type")).filter(|_| !item.given("mesh")),
            pose: item.pose(context.frames),
            fromto: item.optional("fromto"),
            size: item.array("size"),
        })
    }

    fn camera(&mut self, node: NodeId, context: &Context) -> Option<Camera> {
        let item = self.item(node, "body", context.class)?;
        let mode = match item.word("mode") {
            "track" => CameraMode::Track,
            "trackcom" => CameraMode::TrackCom,
            "targetbody" => CameraMode::TargetBody,
            "targetbodycom" => CameraMode::TargetBodyCom,
            _ => CameraMode::Fixed,
        };
        let target = item.given("target").then(|| item.word("target").to_owned());
        let pose = item.pose(context.frames);
        Some(Camera { node, name: item.name(), mode, target, fovy: item.number("fovy"), pose })
    }

    /// The shape; `None` for one that Penny lacks, which is an error unless the geom is only there to be seen.
    fn geom_kind(&mut self, item: &Item, body: NodeId, context: &Context) -> Option<GeomKind> {
        let name = item.word("type");
        let kind = simple_shape(name);
        // A simple shape with a `mesh` takes its size from that mesh.
        if kind.is_some() && !item.given("mesh") {
            return kind;
        }
        let (attribute, name) = if kind.is_some() { ("mesh", "mesh") } else { ("type", name) };
        let touches = item.integer("contype") != 0 || item.integer("conaffinity") != 0;
        let lost = match (touches, self.is_weightless(item, body, context)) {
            (false, true) => return None,
            // When all geoms are there, the compiler sees whether anything can touch it.
            (true, true) if name == "mesh" => return None,
            (true, _) => "nothing would touch it",
            (false, false) => "its mass and inertia would be missing",
        };
        let kind = ProblemKind::Unsupported { name: name.into(), lost: lost.into() };
        let span = self.document.value_span(item.node, attribute);
        let mesh = self.mesh(item.word("mesh")).filter(|_| name == "mesh");
        self.problems.push(Problem::new(kind, span).help(instead_of(mesh.as_ref())));
        None
    }

    /// Whether the geom's mass counts nowhere: it has none, or it is fixed, or `<inertial>` says it all.
    fn is_weightless(&self, item: &Item, body: NodeId, context: &Context) -> bool {
        let none = |name: &str| item.given(name) && item.number(name) == 0.0;
        let children = &self.document.node(body).children;
        let inertial = children.iter().any(|&child| self.document.node(child).name == "inertial");
        let replaced = inertial && self.inertiafromgeom != Some(true);
        context.depth == 0 || none("mass") || none("density") || replaced
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

    pub(super) fn conflict(&mut self, node: NodeId, one: &str, other: &str, help: &str) {
        let element = self.document.node(node).name.to_string();
        let kind = ProblemKind::Conflict { element, one: one.into(), other: other.into() };
        self.problems.push(Problem::new(kind, self.document.name_span(node, other)).help(help));
    }

    /// A range that must limit has to increase; one that may limit and does not increase is lost.
    fn limits(&mut self, item: &Item) {
        let [low, high] = item.array("range");
        let own = self.document.attribute(item.node, "range").is_some();
        let (kind, help) = match item.maybe("limited") {
            // A ball joint takes its range for 0 0 and is held where it is.
            Some(true) if item.word("type") == "ball" => return,
            Some(true) if !item.given("range") => (ProblemKind::LimitedWithoutRange, "add `range=\"low high\"`"),
            Some(true) if low >= high => (ProblemKind::RangeEmpty { low, high }, "give the smaller number first"),
            None if low > high && own => (ProblemKind::RangeLost, "give the smaller number first"),
            _ => return,
        };
        self.problems.push(Problem::new(kind, self.document.value_span(item.node, "range")).help(help));
    }
}

/// Which shapes will do where a mesh may not be.
pub fn instead_of(mesh: Option<&Mesh>) -> String {
    let Some((centre, half)) = mesh.and_then(Mesh::bounds) else {
        return "use a plane, sphere, capsule, ellipsoid, cylinder or box".to_string();
    };
    let numbers = |v: Vec3| v.iter().map(|x| short(*x)).collect::<Vec<_>>().join(" ");
    format!(
        "a box as large has `type=\"box\" size=\"{}\"`, its centre at {} of the geom's frame; or use a plane, sphere, \
         capsule, ellipsoid or cylinder",
        numbers(half),
        numbers(centre)
    )
}

fn simple_shape(keyword: &str) -> Option<GeomKind> {
    use GeomKind::{Box, Capsule, Cylinder, Ellipsoid, Plane, Sphere};
    [Plane, Sphere, Capsule, Ellipsoid, Cylinder, Box].into_iter().find(|kind| kind.name() == keyword)
}

/// With three digits.
fn short(x: f64) -> String {
    let short = format!("{x:.2e}").parse::<f64>().unwrap_or(x);
    if short.abs() < 1e-6 { "0".to_string() } else { short.to_string() }
}
