//! How bodies hang together: found once for a model.

use std::ops::Range;

use crate::math::{Mat3, Quat, Sym3, Vec3, mat, point_mass};
use crate::model::{JointKind, Model, Tree};

/// No dof, no body.
pub const NONE: usize = usize::MAX;

/// The joints of a tree.
pub fn joints_of(model: &Model, tree: &Tree) -> Range<usize> {
    model.dofs[tree.dofs.start].joint..model.dofs[tree.dofs.end - 1].joint + 1
}

/// A body with joints, and all that is welded to it, as one rigid body.
#[derive(Clone, Debug)]
pub struct Link {
    pub body: usize,
    /// The body with joints that carries this one; [`NONE`] for the first of a tree.
    pub parent: usize,
    pub joints: Range<usize>,
    pub dofs: Range<usize>,
    /// kg
    pub mass: f64,
    /// Centre of mass (m) and inertia about it (kg m²) in the frame of `body`.
    pub com: Vec3,
    pub inertia: Sym3,
    /// Inertia about the centre of mass and the direction of the hinges, of a tree that moves in a plane; otherwise 0.
    pub turning: f64,
}

/// How a body hangs on its parent.
#[derive(Clone, Debug)]
pub enum Mount {
    /// Its frame is the parent's.
    Same,
    Welded,
    /// On one hinge and nothing else. In a box: most bodies of large scenes are free.
    Hinge(Box<Hinge>),
    /// On any other joints.
    Joints,
}

#[derive(Clone, Debug)]
pub struct Hinge {
    pub joint: usize,
    pub qposadr: usize,
    /// q at which the body is turned as its file says, rad.
    pub rest: f64,
    /// The anchor in the parent's frame, and in the body's, m.
    pub anchor: Vec3,
    pub pos: Vec3,
    /// The anchor is the body's origin.
    pub centred: bool,
    /// How the body is turned in its parent at rest; `None`: not at all.
    pub quat: Option<Quat>,
    /// Unit axis in the body's frame.
    pub axis: Vec3,
}

/// The links of a tree.
pub fn links(model: &Model, tree: &Tree) -> Vec<Link> {
    let jointed = |b: &usize| model.bodies[*b].weld == *b;
    let mut welded = vec![Vec::new(); tree.bodies.len()];
    for b in tree.bodies.clone().filter(|b| !jointed(b)) {
        welded[model.bodies[b].weld - tree.bodies.start].push(b);
    }
    let link = |b: usize| {
        let body = &model.bodies[b];
        let parent = if b == tree.bodies.start { NONE } else { model.bodies[body.parent].weld };
        let (mass, com, inertia) = rigid(model, b, &welded[b - tree.bodies.start]);
        Link { body: b, parent, joints: body.joints.clone(), dofs: body.dofs.clone(), mass, com, inertia, turning: 0.0 }
    };
    tree.bodies.clone().filter(jointed).map(link).collect()
}

/// Mass, centre of mass and inertia about it of a body with joints and what is welded to it, in the body's frame.
///
///     m = Σ mᵢ,   c = Σ mᵢ cᵢ / m,   I = Σ Rᵢ Iᵢ Rᵢᵀ − mᵢ [cᵢ − c]²
fn rigid(model: &Model, first: usize, welded: &[usize]) -> (f64, Vec3, Sym3) {
    let mut parts: Vec<(usize, Vec3, Mat3)> = vec![(first, Vec3::zeros(), Mat3::identity())];
    for &b in welded {
        let body = &model.bodies[b];
        // A parent comes before its children, and is welded to the same body.
        if let Ok(parent) = parts.binary_search_by_key(&body.parent, |part| part.0) {
            let (_, pos, axes) = parts[parent];
            parts.push((b, pos + axes * body.pos, axes * mat(&body.quat)));
        }
    }
    let centres = parts.iter().map(|(b, pos, axes)| (model.bodies[*b].mass, pos + axes * model.bodies[*b].ipos));
    let mass: f64 = centres.clone().map(|(m, _)| m).sum();
    let com = match &parts[..] {
        [_] => model.bodies[first].ipos,
        _ if mass > 0.0 => centres.clone().map(|(m, c)| m * c).sum::<Vec3>() / mass,
        _ => Vec3::zeros(),
    };
    let mut inertia = Sym3::default();
    for ((b, _, axes), (m, c)) in parts.iter().zip(centres) {
        let body = &model.bodies[*b];
        inertia.add(&Sym3::from_principal(&body.inertia, &(axes * mat(&body.iquat))));
        inertia.add(&point_mass(m, &(c - com)));
    }
    (mass, com, inertia)
}

/// How each body is turned in the world in `qpos0`.
pub fn orientations(model: &Model) -> Vec<Mat3> {
    let mut turned = vec![Mat3::identity(); model.bodies.len()];
    for (b, body) in model.bodies.iter().enumerate().skip(1) {
        turned[b] = turned[body.parent] * mat(&body.quat);
    }
    turned
}

/// How body `b` hangs on its parent.
pub fn mount(model: &Model, b: usize) -> Mount {
    let body = &model.bodies[b];
    let turned = body.quat != Quat::identity();
    match &model.joints[body.joints.clone()] {
        [] if turned || body.pos != Vec3::zeros() => Mount::Welded,
        [] => Mount::Same,
        [joint] if joint.kind == JointKind::Hinge => Mount::Hinge(Box::new(Hinge {
            joint: body.joints.start,
            qposadr: joint.qposadr,
            rest: model.qpos0[joint.qposadr],
            anchor: body.pos + body.quat * joint.pos,
            pos: joint.pos,
            centred: joint.pos == Vec3::zeros(),
            quat: turned.then_some(body.quat),
            axis: joint.axis,
        })),
        _ => Mount::Joints,
    }
}
