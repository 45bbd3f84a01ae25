//! The plane in which a tree moves, if it moves in one; twists, wrenches and inertias in it, three numbers each.
//!
//! The formulas stand in [`planar`](super::planar), which uses them.

use super::links::{Link, joints_of};
use super::spatial::{ang, lin};
use crate::math::{Mat3, Vec3, Vec6};
use crate::model::{JointKind, Model, Tree};

/// How far from a plane a direction may be: what rounding does to one.
const FLAT: f64 = 1e-14;

/// The plane of a tree.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    e1: Vec3,
    e2: Vec3,
    n: Vec3,
}

pub type Planar = [f64; 3];

/// Inertia about o: m, h, J.
#[derive(Clone, Copy, Debug, Default)]
pub struct Disk {
    pub mass: f64,
    pub h: [f64; 2],
    pub turning: f64,
}

/// What the passes work on, by dof and by body.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    pub axes: Vec<Planar>,
    pub bodies: Vec<Moving>,
}

/// Twist, acceleration, force and inertia of a link; in the end force and inertia with all that hangs on it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Moving {
    pub vel: Planar,
    pub acc: Planar,
    pub force: Planar,
    pub inertia: Disk,
}

impl Scratch {
    pub fn new(model: &Model) -> Scratch {
        Scratch { axes: vec![[0.0; 3]; model.nv], bodies: vec![Moving::default(); model.bodies.len()] }
    }
}

impl Plane {
    /// The plane in which a tree moves, if it moves in one and can turn. Writes: turning of the links.
    ///
    /// `turned`: how each body is turned in the world in `qpos0`.
    pub fn of(model: &Model, tree: &Tree, turned: &[Mat3], links: &mut [Link]) -> Option<Plane> {
        // What hangs on a mocap body may be turned with it.
        if model.bodies[model.bodies[tree.bodies.start].parent].weld != 0 {
            return None;
        }
        let joints = &model.joints[joints_of(model, tree)];
        let axis = |kind| move |j: &&crate::model::Joint| j.kind == kind;
        let direction = |j: &crate::model::Joint| turned[j.body] * j.axis;
        let n = direction(joints.iter().find(axis(JointKind::Hinge))?);
        let flat = joints.iter().all(|j| match j.kind {
            JointKind::Hinge => direction(j).cross(&n).norm() <= FLAT,
            JointKind::Slide => direction(j).dot(&n).abs() <= FLAT,
            JointKind::Ball | JointKind::Free => false,
        });
        let across = if n.x.abs() < 0.9 { Vec3::x() } else { Vec3::y() };
        let e1 = (across - n * across.dot(&n)).normalize();
        for link in links {
            link.turning = n.dot(&link.inertia.turned(&turned[link.body]).mul(&n));
        }
        flat.then(|| Plane { e1, e2: n.cross(&e1), n })
    }

    pub fn twist(&self, v: &Vec6) -> Planar {
        let [x, y] = self.point(&lin(v));
        [x, y, self.n.dot(&ang(v))]
    }

    pub fn point(&self, r: &Vec3) -> [f64; 2] {
        [self.e1.dot(r), self.e2.dot(r)]
    }
}

impl Disk {
    pub fn new(mass: f64, [x, y]: [f64; 2], central: f64) -> Disk {
        let h = [mass * x, mass * y];
        Disk { mass, h, turning: central + h[0] * x + h[1] * y }
    }

    pub fn add(&mut self, other: &Disk) {
        self.mass += other.mass;
        self.h = [self.h[0] + other.h[0], self.h[1] + other.h[1]];
        self.turning += other.turning;
    }

    pub fn mul(&self, [x, y, w]: &Planar) -> Planar {
        let [h1, h2] = self.h;
        [self.mass * x - h2 * w, self.mass * y + h1 * w, h1 * y - h2 * x + self.turning * w]
    }
}

pub fn dot(a: &Planar, b: &Planar) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub fn add(a: &mut Planar, b: &Planar) {
    *a = [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
}
