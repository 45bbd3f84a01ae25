//! Tendons and equalities.

use super::layout::World;
use super::{Log, Names};
use crate::contact::ties;
use crate::data::Data;
use crate::dynamics::blocks::Block;
use crate::dynamics::{self, tendon};
use crate::math::{Quat, Vec3, quat, vec3};
use crate::mjcf::{NodeId, ProblemKind, Spec, spec};
use crate::model::{Anchor, Equality, EqualityKind, GeomKind, JointKind, Model, Path, Tendon, Waypoint};

/// The tendons; what depends on the pose of the scene, [`fill`] adds.
pub fn tendons(world: &World, spec: &Spec, log: &mut Log) -> Vec<Tendon> {
    if spec.tendons.is_empty() {
        return Vec::new();
    }
    let names = Passed { joints: world.joint_names(), sites: world.site_names(), geoms: world.geom_names() };
    spec.tendons.iter().map(|t| tendon(world, &names, t, spec, log)).collect()
}

/// What tendons can name.
struct Passed<'a> {
    joints: Names<'a>,
    sites: Names<'a>,
    geoms: Names<'a>,
}

fn tendon(world: &World, names: &Passed, t: &spec::Tendon, spec: &Spec, log: &mut Log) -> Tendon {
    let path = match &t.path {
        spec::Path::Fixed(parts) => Path::Fixed(fixed(world, names, parts, log)),
        spec::Path::Spatial(points) => Path::Spatial(spatial(world, names, points, t.armature != 0.0, log)),
    };
    let autolimits = spec.compiler.autolimits;
    let mut applies = |attribute: &str, range: Option<[f64; 2]>, limited: Option<bool>| {
        if range.is_some() && limited.is_none() && !autolimits {
            let help = "say whether it is limited, or drop `autolimits=\"false\"` from `<compiler>`";
            log.value_error(t.node, attribute, ProblemKind::RangeWithoutLimited, help);
        }
        range.filter(|_| limited != Some(false))
    };
    let range = applies("range", t.range, t.limited);
    let forces = t.actuatorfrcrange.filter(|range| *range != [0.0, 0.0]);
    let actfrcrange = applies("actuatorfrcrange", forces, t.actuatorfrclimited);
    if forces.is_none() && t.actuatorfrclimited == Some(true) {
        log.error(t.node, ProblemKind::LimitedWithoutRange, "add `actuatorfrcrange=\"low high\"`");
    } else if let Some([low, high]) = actfrcrange.filter(|[low, high]| low >= high) {
        let help = "give the smaller number first";
        log.value_error(t.node, "actuatorfrcrange", ProblemKind::RangeEmpty { low, high }, help);
    } else if let Some([low, high]) = actfrcrange.filter(|[low, high]| *low > 0.0 || *high < 0.0) {
        // The forces of all its actuators are scaled into it, which no factor does that keeps their directions.
        let (rule, word) = ("a range with 0 in it".into(), format!("{low} {high}"));
        let problem = ProblemKind::OutOfRange { attribute: "actuatorfrcrange".into(), rule, word };
        log.value_error(t.node, "actuatorfrcrange", problem, "MuJoCo refuses it, too");
    }
    Tendon {
        name: t.name.clone().unwrap_or_default(),
        path,
        range,
        margin: t.margin,
        solref_limit: t.solreflimit,
        solimp_limit: t.solimplimit,
        solref_friction: t.solreffriction,
        solimp_friction: t.solimpfriction,
        stiffness: t.stiffness,
        lengthspring: t.springlength,
        damping: t.damping,
        frictionloss: t.frictionloss,
        armature: t.armature,
        actfrcrange,
        length0: 0.0,
        invweight0: 0.0,
        width: t.width,
        rgba: t.rgba,
    }
}

fn fixed(world: &World, names: &Passed, parts: &[(NodeId, String, f64)], log: &mut Log) -> Vec<(usize, f64)> {
    let mut found = Vec::new();
    for (node, name, coef) in parts {
        let Some(j) = names.joints.find(name, *node, "joint", log) else { continue };
        scalar(world, j, *node, "joint", log);
        found.push((j, *coef));
    }
    found
}

/// Reports a joint whose position is no single number.
fn scalar(world: &World, joint: usize, node: NodeId, attribute: &str, log: &mut Log) {
    let kind = world.joints[joint].kind;
    if !matches!(kind, JointKind::Slide | JointKind::Hinge) {
        let what = format!("the position of a {} joint is not one number", kind.name());
        log.value_error(node, attribute, ProblemKind::Meaningless { what }, "name a slide or a hinge");
    }
}

fn spatial(
    world: &World,
    Passed { sites, geoms, .. }: &Passed,
    points: &[(NodeId, spec::Waypoint)],
    inert: bool,
    log: &mut Log,
) -> Vec<Waypoint> {
    let mut found = Vec::new();
    for (node, point) in points {
        match point {
            spec::Waypoint::Site(name) => found.extend(sites.find(name, *node, "site", log).map(Waypoint::Site)),
            spec::Waypoint::Pulley(divisor) => found.push(Waypoint::Pulley(*divisor)),
            spec::Waypoint::Geom { geom: name, side } => {
                let side = side.as_ref().map(|name| sites.find(name, *node, "sidesite", log));
                let Some(geom) = geoms.find(name, *node, "geom", log) else { continue };
                if !matches!(world.geoms[geom].kind, GeomKind::Sphere | GeomKind::Cylinder) {
                    let what = format!("a tendon cannot go round a {}", world.geoms[geom].kind.name());
                    log.value_error(*node, "geom", ProblemKind::Meaningless { what }, "name a sphere or a cylinder");
                }
                if inert {
                    let what = "a tendon with `armature` cannot go round a geom".to_string();
                    log.error(*node, ProblemKind::Meaningless { what }, "leave the `armature` or the geom out");
                }
                found.push(Waypoint::Geom { geom, side: side.flatten() });
            }
        }
    }
    found
}

/// The equalities; where the anchors of bodies are, [`fill`] finds.
pub fn equalities(world: &World, tendons: &[Tendon], spec: &Spec, log: &mut Log) -> Vec<Equality> {
    if spec.equalities.is_empty() {
        return Vec::new();
    }
    let (joints, bodies, sites) = (world.joint_names(), world.body_names(), world.site_names());
    let tendons = Names::new("tendon", tendons.iter().map(|t| t.name.as_str()));
    let mut found = Vec::new();
    for e in &spec.equalities {
        let mut pair = |names: &Names, (first, second): &(String, Option<String>), attributes: [&str; 2]| {
            let one = names.find(first, e.node, attributes[0], log);
            let other = second.as_ref().map(|name| names.find(name, e.node, attributes[1], log));
            match (one, other) {
                (Some(one), None) => Some((one, None)),
                (Some(one), Some(Some(other))) => Some((one, Some(other))),
                _ => None,
            }
        };
        let kind = match &e.kind {
            spec::EqualityKind::Joint { joints: names, polycoef } => {
                let Some(pair) = pair(&joints, names, ["joint1", "joint2"]) else { continue };
                scalar(world, pair.0, e.node, "joint1", log);
                pair.1.into_iter().for_each(|j| scalar(world, j, e.node, "joint2", log));
                EqualityKind::Joint { joints: pair, polycoef: *polycoef }
            }
            spec::EqualityKind::Tendon { tendons: names, polycoef } => {
                let Some(pair) = pair(&tendons, names, ["tendon1", "tendon2"]) else { continue };
                EqualityKind::Tendon { tendons: pair, polycoef: *polycoef }
            }
            spec::EqualityKind::Sites { sites: names, torquescale } => {
                let first = sites.find(&names[0], e.node, "site1", log);
                let second = sites.find(&names[1], e.node, "site2", log);
                let (Some(first), Some(second)) = (first, second) else { continue };
                held([Anchor::Site(first), Anchor::Site(second)], torquescale.map(|scale| (scale, false)))
            }
            spec::EqualityKind::Bodies { body1, body2, anchor, weld } => {
                let names = (body1.clone(), Some(body2.clone().unwrap_or_else(|| "world".into())));
                let Some((first, Some(second))) = pair(&bodies, &names, ["body1", "body2"]) else { continue };
                let at = |body, pos, quat| Anchor::Body { body, pos, quat };
                let (zero, none) = (Vec3::zeros(), Quat::identity());
                let given = Vec3::from(*anchor);
                match weld {
                    None => held([at(first, given, none), at(second, zero, none)], None),
                    Some(weld) => {
                        let pose = (vec3(&weld.relpose), quat(&weld.relpose[3..]));
                        let follows = weld.relpose[3..] == [0.0; 4];
                        held([at(first, pose.0, pose.1), at(second, given, none)], Some((weld.torquescale, follows)))
                    }
                }
            }
        };
        check_two(&kind, e.node, log);
        let (name, active) = (e.name.clone().unwrap_or_default(), e.active);
        found.push(Equality { name, active, kind, solref: e.solref, solimp: e.solimp });
    }
    found
}

/// Reports an equality of something with itself, which MuJoCo refuses, too.
fn check_two(kind: &EqualityKind, node: NodeId, log: &mut Log) {
    let (itself, help) = match kind {
        EqualityKind::Joint { joints: (one, other), .. } | EqualityKind::Tendon { tendons: (one, other), .. } => {
            (Some(*one) == *other, "name two different ones, or leave the second out")
        }
        EqualityKind::Connect(anchors) | EqualityKind::Weld { anchors, .. } => match anchors {
            [Anchor::Body { body: one, .. }, Anchor::Body { body: other, .. }] => {
                (one == other, "name two different bodies; without `body2` the second is the world")
            }
            [one, other] => (one == other, "name two different sites"),
        },
    };
    if itself {
        log.error(node, ProblemKind::Meaningless { what: "this equality holds something to itself".into() }, help);
    }
}

/// A `connect`, or a `weld` with its torquescale and whether its first frame follows from the second.
fn held(anchors: [Anchor; 2], weld: Option<(f64, bool)>) -> EqualityKind {
    match weld {
        None => EqualityKind::Connect(anchors),
        Some((torquescale, follows)) => EqualityKind::Weld { anchors, torquescale, follows },
    }
}

/// What follows from the pose of the scene:
///
///     lengths of tendons at qpos0, and where asked for of their springs with every joint at its springref
///     anchors: of `connect` the second's, of `weld` without `relpose` the first's frame, so that they agree at qpos0
pub fn fill(model: &mut Model) {
    if model.tendons.is_empty() && model.equalities.is_empty() {
        return;
    }
    let mut data = Data::new(model);
    let mut rest = model.qpos0.clone();
    for joint in model.joints.iter().filter(|j| matches!(j.kind, JointKind::Slide | JointKind::Hinge)) {
        rest[joint.qposadr] = joint.springref;
    }
    let mut lengths_at = |qpos: &[f64]| {
        dynamics::kinematics(model, qpos, &mut data);
        tendon::tendons(model, qpos, &vec![0.0; model.nv], &mut data);
        data.ten_length.clone()
    };
    let (slack, lengths) = (lengths_at(&rest), lengths_at(&model.qpos0));
    place(model, &data);
    let parts = model.parts_mut();
    for (i, t) in parts.tendons.iter_mut().enumerate() {
        t.length0 = lengths[i];
        if t.lengthspring == [-1.0, -1.0] {
            t.lengthspring = [slack[i]; 2];
        }
    }
}

/// Finds the lengths of tendons at `qpos0` anew.
pub fn measure(model: &mut Model) {
    if model.tendons.is_empty() {
        return;
    }
    let mut data = Data::new(model);
    let qpos0 = model.qpos0.clone();
    dynamics::kinematics(model, &qpos0, &mut data);
    tendon::tendons(model, &qpos0, &vec![0.0; model.nv], &mut data);
    model.parts_mut().tendons.iter_mut().zip(&data.ten_length).for_each(|(t, length)| t.length0 = *length);
}

/// Finds the anchors of equalities at `qpos0` anew.
pub fn hang(model: &mut Model) {
    if model.equalities.is_empty() {
        return;
    }
    let mut data = Data::new(model);
    dynamics::kinematics(model, &model.qpos0, &mut data);
    place(model, &data);
}

/// Anchors of bodies that follow from the other one's. Reads: poses at `qpos0`.
fn place(model: &mut Model, data: &Data) {
    let kinds: Vec<EqualityKind> = model.equalities.iter().map(|e| placed(model, data, e.kind)).collect();
    model.parts_mut().equalities.iter_mut().zip(kinds).for_each(|(e, kind)| e.kind = kind);
}

fn placed(model: &Model, data: &Data, kind: EqualityKind) -> EqualityKind {
    // The frame of an anchor in a body.
    let seen = |from: Anchor, body: usize, pos: bool| {
        let (_, point, turn) = ties::place(model, data, &from);
        let local = data.xmat[body].tr_mul(&(point - data.xpos[body]));
        let quat = data.xquat[body].inverse() * turn;
        Anchor::Body { body, pos: local, quat: if pos { Quat::identity() } else { quat } }
    };
    match kind {
        EqualityKind::Connect([first, Anchor::Body { body, .. }]) => {
            EqualityKind::Connect([first, seen(first, body, true)])
        }
        EqualityKind::Weld { anchors: [Anchor::Body { body, .. }, second], torquescale, follows: true } => {
            EqualityKind::Weld { anchors: [seen(second, body, false), second], torquescale, follows: true }
        }
        _ => kind,
    }
}

/// Fills `invweight0` of tendons, J M⁻¹ Jᵀ at `qpos0`. Reads: those numbers of M.
pub fn weigh(model: &mut Model) {
    if model.tendons.is_empty() {
        return;
    }
    let mut data = Data::new(model);
    for t in 0..model.trees.len() {
        if model.trees[t].free.is_none() {
            dynamics::inertia_matrix(model, t, &mut data);
        }
    }
    let inverse = |i: usize| -> f64 {
        let of =
            |block: &Block| inverse_mass(model, &data, block.tree, &data.ten_j[block.at..block.at + block.dofs.len()]);
        data.plan.tendons[i].iter().map(of).sum()
    };
    let all: Vec<f64> = (0..model.tendons.len()).map(inverse).collect();
    model.parts_mut().tendons.iter_mut().zip(all).for_each(|(t, inverse)| t.invweight0 = inverse);
}

/// J M⁻¹ Jᵀ of a row over the dofs of a tree.
///
///     free body: |f|²/m + (Pᵀ(τ − c × Rᵀf))² / I        f force at its origin (world), τ torque (body)
///
/// Reads: xmat; of a tree that is not a free body qld.
pub fn inverse_mass(model: &Model, data: &Data, t: usize, row: &[f64]) -> f64 {
    let tree = &model.trees[t];
    if let Some(free) = &tree.free {
        let force = vec3(row);
        let local = data.xmat[tree.bodies.start].tr_mul(&force);
        let turn = free.axes.tr_mul(&(vec3(&row[3..]) - free.com.cross(&local)));
        return force.norm_squared() / free.mass + turn.component_div(&free.inertia).dot(&turn);
    }
    if row.iter().all(|x| *x == 0.0) {
        return 0.0;
    }
    let mut solved = row.to_vec();
    dynamics::solve_m(model, data, t, &mut solved);
    row.iter().zip(&solved).map(|(a, b)| a * b).sum()
}

/// Trees on which tendons exert forces that depend on position or velocity are no closed forms.
pub fn closed_forms(world: &mut World, tendons: &[Tendon]) {
    for tendon in tendons.iter().filter(|t| t.acts()) {
        for body in tendon.bodies(&world.joints, &world.sites, &world.geoms) {
            if let Some(tree) = world.bodies[body].tree {
                world.trees[tree].free = None;
            }
        }
    }
}
