//! Masses and inertia of the bodies.

use super::inertia::{self, Piece};
use super::layout::{World, label, no_direction};
use super::{Log, frames};
use crate::math::{self, MIN_VAL, Mat3, Quat, Vec3};
use crate::mjcf::{ProblemKind, Spec, spec};
use crate::model::{Body, Dof, FreeBody, Geom, Joint, JointKind, Tree};

/// Geoms up to this mass do not count, kg.
///
/// Source: checked by running MuJoCo 4.0.0.
const LEAST_MASS: f64 = 1e-14;

/// Fills everything about mass into a scene that is laid out: bodies and free bodies.
pub fn fill(world: &mut World, spec: &Spec, log: &mut Log) {
    let mut pieces = Vec::new();
    for id in 1..world.bodies.len() {
        fill_body(world, id, &spec.compiler, &mut pieces, log);
    }
    if !log.errors.is_empty() {
        return;
    }
    scale_to_total(&mut world.bodies, spec.compiler.settotalmass);
    // What moves with each body that has joints: whether any of it has mass and inertia.
    let mut enough = vec![false; world.bodies.len()];
    for body in world.bodies.iter().filter(|b| b.mass >= MIN_VAL && b.inertia.min() >= MIN_VAL) {
        enough[body.weld] = true;
    }
    for id in (1..world.bodies.len()).filter(|&id| !enough[id]) {
        check_moving(world, id, log);
    }
    if !log.errors.is_empty() {
        return;
    }
    for t in 0..world.trees.len() {
        world.trees[t].free = free_body(&world.trees[t], &world.bodies, &world.joints, &world.dofs);
    }
}

/// Mass and inertia of one body: from `<inertial>` or from its geoms, then the bounds of `<compiler>`. `pieces`: a buffer.
fn fill_body(world: &mut World, id: usize, compiler: &spec::Compiler, pieces: &mut Vec<Principal>, log: &mut Log) {
    let spec = world.body_specs[id];
    geom_pieces(world, id, compiler, pieces);
    let infer = compiler.inertiafromgeom.unwrap_or(spec.inertial.is_none());
    let found = match (&spec.inertial, infer && !pieces.is_empty()) {
        (_, true) => match from_geoms(pieces) {
            Some(found) => found,
            None => return log.error(spec.node, ProblemKind::MassOverflow, "check the sizes, positions and densities"),
        },
        (Some(inertial), false) => match from_inertial(inertial, compiler, log) {
            Some(found) => found,
            None => return,
        },
        // MuJoCo gives a body without mass its pose as written, without the frames around it, for inertial frame: invweight0
        // is taken there, and so is what `boundmass` gives it. An orientation that is none was reported before.
        (None, false) => {
            let own = spec::Pose { frames: [].into(), ..spec.pose.clone() };
            let (ipos, iquat) = frames::pose(&own, compiler).unwrap_or((Vec3::zeros(), Quat::identity()));
            Principal { mass: 0.0, ipos, iquat, moments: Vec3::zeros() }
        }
    };
    let mut moments = found.moments.map(|i| i.max(compiler.boundinertia));
    let [a, b, c] = moments.into();
    let possible = |largest: f64, others: f64| others >= largest * (1.0 - 1e-12);
    if !(possible(a, b + c) && possible(b, a + c) && possible(c, a + b)) {
        if !compiler.balanceinertia {
            let node = spec.inertial.as_ref().map_or(spec.node, |i| i.node);
            let help = "each must be at most the sum of the other two; `<compiler balanceinertia=\"true\"/>` \
                        replaces all three by their mean";
            return log.error(node, ProblemKind::InertiaImpossible { a, b, c }, help);
        }
        moments = Vec3::repeat((a + b + c) / 3.0);
    }
    let body = &mut world.bodies[id];
    body.mass = found.mass.max(compiler.boundmass);
    (body.ipos, body.iquat, body.inertia) = (found.ipos, found.iquat, moments);
}

/// A rigid piece along its principal axes.
#[derive(Clone, Copy)]
struct Principal {
    mass: f64,
    ipos: Vec3,
    iquat: Quat,
    moments: Vec3,
}

/// The geoms of a body that have mass and count: group within `inertiagrouprange`.
fn geom_pieces(world: &World, id: usize, compiler: &spec::Compiler, pieces: &mut Vec<Principal>) {
    let [low, high] = compiler.inertiagrouprange;
    pieces.clear();
    for g in world.bodies[id].geoms.clone() {
        let (geom, spec) = (&world.geoms[g], world.geom_specs[g]);
        let piece = geom_piece(geom, spec);
        if piece.mass > LEAST_MASS && (low..=high).contains(&geom.group) {
            pieces.push(piece);
        }
    }
}

fn geom_piece(geom: &Geom, spec: &spec::Geom) -> Principal {
    let extent = inertia::extent(geom.kind, &geom.size, spec.shellinertia);
    let mass = if extent > 0.0 { spec.mass.unwrap_or(spec.density * extent) } else { 0.0 };
    let moments = inertia::moments(geom.kind, &geom.size, mass, spec.shellinertia);
    Principal { mass, ipos: geom.pos, iquat: geom.quat, moments }
}

/// One geom is taken as it is; several are combined and turned to principal axes. `None`: numbers overflow.
fn from_geoms(pieces: &[Principal]) -> Option<Principal> {
    if let [one] = pieces {
        return (one.mass.is_finite() && one.moments.iter().all(|i| i.is_finite())).then_some(*one);
    }
    let pieces: Vec<Piece> = pieces.iter().map(|p| piece(p.mass, p.ipos, &p.iquat, &p.moments)).collect();
    let whole = inertia::combine(&pieces);
    let (moments, _, iquat) = inertia::principal(&whole.tensor)?;
    Some(Principal { mass: whole.mass, ipos: whole.com, iquat, moments })
}

fn piece(mass: f64, com: Vec3, quat: &Quat, moments: &Vec3) -> Piece {
    Piece { mass, com, tensor: inertia::tensor(moments, quat) }
}

/// What `<inertial>` says; without an inertia, the moments are zero. `None` after a report.
fn from_inertial(inertial: &spec::Inertial, compiler: &spec::Compiler, log: &mut Log) -> Option<Principal> {
    let mut moments = inertial.diaginertia.map_or(Vec3::zeros(), Vec3::from);
    let mut turn = Quat::identity();
    if let Some([xx, yy, zz, xy, xz, yz]) = inertial.fullinertia {
        let (values, _, axes) = inertia::principal(&Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz))?;
        if values.z <= 0.0 {
            let help = "the order is M11 M22 M33 M12 M13 M23, and all principal moments must be above zero";
            let kind = ProblemKind::InertiaNotPositive { moment: values.z };
            log.value_error(inertial.node, "fullinertia", kind, help);
            return None;
        }
        (moments, turn) = (values, axes);
    }
    let placed = frames::orientation(&inertial.orientation, compiler)
        .and_then(|own| frames::in_frames(&inertial.frames, (Vec3::from(inertial.pos), own * turn), compiler));
    match placed {
        Ok((ipos, iquat)) => Some(Principal { mass: inertial.mass, ipos, iquat, moments }),
        Err(what) => {
            no_direction(inertial.node, what, log);
            None
        }
    }
}

/// `<compiler settotalmass>`: all masses and inertias by the same factor. Negative: as they are.
fn scale_to_total(bodies: &mut [Body], total: f64) {
    let sum: f64 = bodies.iter().map(|b| b.mass).sum();
    if total > 0.0 && sum > 0.0 {
        let scale = (total / sum).max(MIN_VAL);
        for body in bodies {
            body.mass *= scale;
            body.inertia *= scale;
        }
    }
}

const LARGER_UNITS: &str =
    "take larger units (1 mm as 1, and gravity to match), or set `boundmass` and `boundinertia` in `<compiler>`";

/// A body with joints must have mass and inertia, itself or in bodies welded to it: this one has neither.
fn check_moving(world: &World, id: usize, log: &mut Log) {
    let body = &world.bodies[id];
    if body.joints.is_empty() {
        return;
    }
    // What is there is below MuJoCo's least, mjMINVAL.
    let tiny = [(body.mass, "mass", "kg"), (body.inertia.min(), "inertia", "kg m²")];
    if let Some((value, what, unit)) = tiny.into_iter().find(|(x, ..)| *x > 0.0 && *x < MIN_VAL) {
        let value = format!("{value:.1e} {unit}");
        let kind = ProblemKind::MovingTooLight { body: label("body", &body.name, id), what, value };
        log.error(world.body_specs[id].node, kind, LARGER_UNITS);
        return;
    }
    let geoms: f64 = body.geoms.clone().map(|g| geom_piece(&world.geoms[g], world.geom_specs[g]).mass).sum();
    if body.mass == 0.0 && geoms > 0.0 && geoms <= LEAST_MASS {
        let value = format!("{geoms:.1e} kg in geoms, which count from {:e} on", LEAST_MASS);
        let kind = ProblemKind::MovingTooLight { body: label("body", &body.name, id), what: "mass", value };
        log.error(world.body_specs[id].node, kind, LARGER_UNITS);
        return;
    }
    let kind = if body.mass < MIN_VAL {
        ProblemKind::MovingWithoutMass { body: label("body", &body.name, id) }
    } else {
        ProblemKind::MovingWithoutInertia { body: label("body", &body.name, id) }
    };
    let spec = world.body_specs[id];
    let help = match &spec.inertial {
        Some(_) => "give `<inertial>` a `mass` and a `diaginertia` above zero".into(),
        None if body.geoms.is_empty() => "give it a geom or an `<inertial>`".into(),
        None => weightless_geoms(world, id),
    };
    let node = spec.inertial.as_ref().map_or(spec.node, |i| i.node);
    log.error(node, kind, help);
    for joint in spec.joints.iter().take(1) {
        log.related(joint.node, "moved by this joint");
    }
}

fn weightless_geoms(world: &World, id: usize) -> String {
    let kinds: Vec<&str> = world.bodies[id].geoms.clone().map(|g| world.geoms[g].kind.name()).collect();
    format!(
        "its {} without weight: check `mass`, `density` and `inertiagrouprange`",
        match kinds[..] {
            [one] => format!("only geom ({one}) is"),
            _ => format!("{} geoms are all", kinds.len()),
        }
    )
}

/// The closed form of a tree that is one rigid body on a free joint. Armature, dampers, springs and dry
/// friction on that joint need the general path.
pub fn free_body(tree: &Tree, bodies: &[Body], joints: &[Joint], dofs: &[Dof]) -> Option<FreeBody> {
    let root = &bodies[tree.bodies.start];
    let joint = &joints[root.joints.start];
    // A change of the model may give them to one of the six.
    let bare = |dof: &Dof| dof.damping == 0.0 && dof.armature == 0.0 && dof.frictionloss == 0.0;
    let plain = joint.stiffness == 0.0 && dofs[tree.dofs.clone()].iter().all(bare);
    if joint.kind != JointKind::Free || tree.dofs.len() != 6 || !plain {
        return None;
    }
    let massive = |b: &&Body| b.mass > 0.0;
    let bodies = &bodies[tree.bodies.clone()];
    if bodies.iter().any(|b| b.gravcomp != 0.0) {
        return None;
    }
    if bodies.iter().filter(massive).count() == 1 && root.mass > 0.0 {
        return Some(FreeBody { mass: root.mass, com: root.ipos, axes: math::mat(&root.iquat), inertia: root.inertia });
    }
    // Bodies welded to the root: each in the root's frame.
    let mut poses = vec![(Vec3::zeros(), Quat::identity())];
    let mut pieces = vec![piece(root.mass, root.ipos, &root.iquat, &root.inertia)];
    for body in &bodies[1..] {
        let (pos, quat) = poses[body.parent - tree.bodies.start];
        let pose = (pos + quat * body.pos, quat * body.quat);
        poses.push(pose);
        pieces.push(piece(body.mass, pose.0 + pose.1 * body.ipos, &(pose.1 * body.iquat), &body.inertia));
    }
    let whole = inertia::combine(&pieces);
    let (inertia, axes, _) = inertia::principal(&whole.tensor)?;
    Some(FreeBody { mass: whole.mass, com: whole.com, axes, inertia })
}
