//! Spec to Model: frames, inertia, pairs, what a step needs.
//!
//! Whatever can be wrong with a scene is found here at the latest; a [`Model`] is valid by construction.

mod canonical;
mod controls;
mod edit;
mod frames;
mod inertia;
mod invweight;
mod layout;
mod masses;
mod pairs;
mod requirements;
mod sensors;
mod ties;

use std::collections::{BTreeMap, BTreeSet};

pub use canonical::canonical;
pub use edit::Invalid;
pub(crate) use layout::label;

use crate::contact;
use crate::integrate;
use crate::math::MIN_MU;
use crate::mjcf::{Document, NodeId, PENNY_TRUTHS, Problem, ProblemKind, Span, Spec, spec};
use crate::model::{ContactOverride, Flags, Model, Options, Parts, TutorialParams};

/// Compiles a checked scene.
///
/// Errors: every problem that only shows when the scene is put together (missing size, zero mass, a pair of
/// geoms without collider …), each with its place. The second part of the value are warnings.
pub fn compile(document: &Document, spec: &Spec) -> Result<(Model, Vec<Problem>), Vec<Problem>> {
    let mut log = Log { document, errors: Vec::new(), warnings: Vec::new() };
    let mut world = layout::lay_out(spec, &mut log);
    if log.errors.is_empty() {
        masses::fill(&mut world, spec, &mut log);
    }
    let opt = options(spec);
    let (pairs, mixes) = pairs::find(&world, spec, opt.contact_override, &mut log);
    let mut tendons = ties::tendons(&world, spec, &mut log);
    let equalities = ties::equalities(&world, &tendons, spec, &mut log);
    let actuators = controls::actuators(&world, &tendons, spec, &mut log);
    controls::closed_forms(&mut world, &tendons, &actuators);
    if opt.medium() {
        world.trees.iter_mut().for_each(|tree| tree.free = None);
    }
    if log.errors.is_empty() {
        controls::rotors(&mut world, &mut tendons, &actuators);
    }
    ties::closed_forms(&mut world, &tendons);
    let keyframes = controls::keyframes(&world, spec, &mut log);
    let sensors = sensors::sensors(&world, &actuators, &tendons, spec, &mut log);
    let tutorial = tutorial_params(spec, &mut log);
    check_settings(spec, &mut log);
    if !log.errors.is_empty() {
        return Err(log.errors);
    }

    let mut parts = Parts {
        name: spec.model_name.clone(),
        nq: world.qpos0.len(),
        nv: world.dofs.len(),
        opt,
        bodies: world.bodies,
        joints: world.joints,
        dofs: world.dofs,
        geoms: world.geoms,
        sites: world.sites,
        cameras: world.cameras,
        visuals: world.visuals,
        na: actuators.iter().filter(|a| a.act.is_some()).count(),
        tendons,
        equalities,
        actuators,
        mocap: world.mocap,
        nsensordata: sensors.iter().map(|s| s.kind.dim()).sum(),
        sensors,
        trees: world.trees,
        pairs,
        mixes,
        keyframes,
        numerics: spec.numerics.iter().map(|n| (n.name.clone(), n.data.clone())).collect(),
        texts: spec.texts.iter().map(|t| (t.name.clone(), t.data.clone())).collect(),
        tutorial,
        qpos0: world.qpos0,
        requires: Default::default(),
    };
    parts.requires = requirements::requirements(&parts);
    let mut model = Model::new(parts);
    ties::fill(&mut model);
    if let Err(dof) = invweight::fill(&mut model) {
        let joint = world.joint_specs[model.dofs[dof].joint];
        let help = "its motion is one that other joints already allow: remove it, turn its axis, or give it `armature`";
        log.error(joint.node, ProblemKind::JointsDependent, help);
        return Err(log.errors);
    }
    ties::weigh(&mut model);
    controls::fill(&mut model, &world.joint_specs, spec);
    check_integrator(&model, spec, &mut log);
    if model.nv == 0 {
        let (node, help) = match spec.world.children.first() {
            Some(body) => (body.node, "give the body that should move a `<freejoint/>`"),
            None => (spec.world.node, "put a `<body>` with a `<freejoint/>` and a `<geom>` into `<worldbody>`"),
        };
        log.warning(node, ProblemKind::NothingMoves, help);
    }
    if log.errors.is_empty() { Ok((model, log.warnings)) } else { Err(log.errors) }
}

/// Collects problems; nothing stops at the first.
struct Log<'a> {
    document: &'a Document,
    errors: Vec<Problem>,
    warnings: Vec<Problem>,
}

impl Log<'_> {
    /// Something wrong with an element as a whole.
    fn error(&mut self, node: NodeId, kind: ProblemKind, help: impl Into<String>) {
        let span = self.document.span(node);
        self.errors.push(problem(kind, span, help));
    }

    /// Something wrong with the value of an attribute.
    fn value_error(&mut self, node: NodeId, attribute: &str, kind: ProblemKind, help: impl Into<String>) {
        let span = self.document.value_span(node, attribute);
        self.errors.push(problem(kind, span, help));
    }

    /// Something that MuJoCo accepts, but that does not do what it seems to.
    fn warning(&mut self, node: NodeId, kind: ProblemKind, help: impl Into<String>) {
        let span = self.document.span(node);
        self.warnings.push(problem(kind, span, help));
    }

    /// The same about the value of an attribute.
    fn value_warning(&mut self, node: NodeId, attribute: &str, kind: ProblemKind, help: impl Into<String>) {
        let span = self.document.value_span(node, attribute);
        self.warnings.push(problem(kind, span, help));
    }

    /// "Look here as well", for the error reported last.
    fn related(&mut self, node: NodeId, label: impl Into<String>) {
        let span = self.document.span(node);
        if let Some(last) = self.errors.last_mut() {
            last.related.push((span, label.into()));
        }
    }
}

fn problem(kind: ProblemKind, span: Span, help: impl Into<String>) -> Problem {
    let help = help.into();
    Problem { help: (!help.is_empty()).then_some(help), ..Problem::new(kind, span) }
}

/// Elements of one kind that others refer to by name.
struct Names<'a> {
    /// The kind: "body", "geom", "tendon" …
    of: &'static str,
    index: BTreeMap<&'a str, usize>,
    /// Names of what is in the file, but not in the model: meshes.
    only_seen: BTreeSet<&'a str>,
}

impl<'a> Names<'a> {
    fn new(of: &'static str, names: impl Iterator<Item = &'a str>) -> Names<'a> {
        let named = names.enumerate().filter(|(_, name)| !name.is_empty());
        Names { of, index: named.map(|(i, name)| (name, i)).collect(), only_seen: BTreeSet::new() }
    }

    /// The index of the element that an attribute names.
    fn find(&self, name: &str, node: NodeId, attribute: &str, log: &mut Log) -> Option<usize> {
        let found = self.index.get(name).copied();
        if found.is_none() {
            let kind = ProblemKind::UnknownReference { what: self.of.into(), name: name.into() };
            let seen = self.only_seen.contains(name);
            let help = if seen {
                "the geom of that name is a mesh, which is only seen: nothing touches or measures it"
            } else {
                ""
            };
            log.value_error(node, attribute, kind, help);
        }
        found
    }
}

fn options(spec: &Spec) -> Options {
    let option = &spec.option;
    let flag = |name: &str| spec.flags.get(name).copied().unwrap_or(true);
    Options {
        timestep: option.timestep,
        gravity: option.gravity.into(),
        integrator: option.integrator.clone(),
        cone: option.cone,
        impratio: option.impratio,
        tolerance: option.tolerance,
        iterations: option.iterations,
        noslip_iterations: option.noslip_iterations,
        noslip_tolerance: option.noslip_tolerance,
        flags: Flags {
            constraint: flag("constraint"),
            equality: flag("equality"),
            frictionloss: flag("frictionloss"),
            limit: flag("limit"),
            contact: flag("contact"),
            spring: flag("spring"),
            damper: flag("damper"),
            gravity: flag("gravity"),
            clampctrl: flag("clampctrl"),
            warmstart: flag("warmstart"),
            filterparent: flag("filterparent"),
            actuation: flag("actuation"),
            refsafe: flag("refsafe"),
            eulerdamp: flag("eulerdamp"),
            diagexact: spec.flags.get("diagexact").copied().unwrap_or(false),
            sensor: flag("sensor"),
            island: flag("island"),
        },
        contact_override: spec.flags.get("override").copied().unwrap_or(false).then_some(ContactOverride {
            friction: option.o_friction.map(|mu| mu.max(MIN_MU)),
            solref: option.o_solref,
            solimp: option.o_solimp,
            margin: option.o_margin,
        }),
        density: option.density,
        viscosity: option.viscosity,
        wind: option.wind.into(),
        magnetic: option.magnetic.into(),
    }
}

/// `implicit` is the same as `implicitfast` for free bodies and single joints only.
fn check_integrator(model: &Model, spec: &Spec, log: &mut Log) {
    if let (true, "implicit", Some(node)) = (model.opt.medium(), spec.option.integrator.as_str(), spec.option.node) {
        let lost = "the forces of the medium would not be implicit".into();
        let kind = ProblemKind::Unsupported { name: spec.option.integrator.clone(), lost };
        log.value_error(
            node,
            "integrator",
            kind,
            "write `implicitfast`, `Euler` or `RK4`, or leave `density` and `viscosity` out",
        );
    }
    let name = &spec.option.integrator;
    if let (false, Some(node)) = (integrate::implicitfast::supports(model, name), spec.option.node) {
        let lost = "Coriolis forces between joints would not be implicit".into();
        let kind = ProblemKind::Unsupported { name: name.clone(), lost };
        log.value_error(node, "integrator", kind, "write `implicitfast`, or `RK4` for fast motion");
    }
}

/// Choices that the reader accepts, but that name nothing Penny has.
fn check_settings(spec: &Spec, log: &mut Log) {
    let name = &spec.option.integrator;
    if let (None, Some(node)) = (integrate::by_name(name), spec.option.node) {
        let known: Vec<&str> = integrate::ALL.iter().flat_map(|i| i.mjcf.iter().copied()).collect();
        let lost = "the scene would be integrated otherwise".into();
        let kind = ProblemKind::Unsupported { name: name.clone(), lost };
        log.value_error(node, "integrator", kind, format!("the integrators are {}", known.join(", ")));
    }
    let laws: Vec<&str> = contact::ALL.iter().map(|law| law.name).collect();
    for text in &spec.texts {
        let name = text.data.clone();
        let (known, kind, all) = match text.name.as_str() {
            "penny.contact" => (&laws[..], ProblemKind::UnknownLaw { name }, "the laws are"),
            "penny.truth" => (PENNY_TRUTHS, ProblemKind::UnknownTruth { name }, "the closed forms are"),
            _ => continue,
        };
        if !known.contains(&text.data.as_str()) {
            let help = match crate::mjcf::nearest(&text.data, known.iter().copied()) {
                Some(near) => format!("did you mean `{near}`?"),
                None => format!("{all} {}", known.join(", ")),
            };
            log.value_error(text.node, "data", kind, help);
        }
    }
}

/// `<custom><numeric name="penny.k" data="2500"/>` and its like.
fn tutorial_params(spec: &Spec, log: &mut Log) -> TutorialParams {
    let mut params = TutorialParams::default();
    for numeric in &spec.numerics {
        let field = match numeric.name.as_str() {
            "penny.k" => &mut params.k,
            "penny.c" => &mut params.c,
            "penny.alpha" => &mut params.alpha,
            "penny.mu" => &mut params.mu,
            "penny.mu_roll" => &mut params.mu_roll,
            _ => continue,
        };
        match numeric.data[..] {
            [value] if value >= 0.0 => *field = Some(value),
            _ => unusable_numeric(numeric, log),
        }
    }
    params
}

fn unusable_numeric(numeric: &spec::Numeric, log: &mut Log) {
    let kind = ProblemKind::NotOneCoefficient { name: numeric.name.clone() };
    log.value_error(numeric.node, "data", kind, "give a single number, zero or more");
}
