//! Inertia matrix and bias forces of a tree that moves in a plane: the passes of [`inertia`](super::inertia) and
//! [`bias`](super::bias) with three numbers in place of six.
//!
//! All hinges have the direction n, all slides are orthogonal to it. With two more axes e₁, e₂ that make a right-handed
//! frame with n, and about the origin o of the tree's first body,
//!
//!     twist V = [v₁, v₂, ω],   wrench F = [f₁, f₂, τ],   dof S = [s₁, s₂, a]
//!     I V = [m v₁ − h₂ ω, m v₂ + h₁ ω, h₁ v₂ − h₂ v₁ + J ω],   h = m (com − o),   J = I_c + m |com − o|²
//!     V × S = [v₂ a − ω s₂, ω s₁ − v₁ a, 0],   V ×* F = [−ω f₂, ω f₁, v₁ f₂ − v₂ f₁]
//!
//! Source: Featherstone, Rigid Body Dynamics Algorithms (2008), §2.16.

use super::inertia::fill;
use super::links::{Link, orientations};
use super::plan::NONE;
use super::spatial::{ang, lin};
use crate::data::Data;
use crate::math::{Vec3, Vec6};
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

type Planar = [f64; 3];

/// Inertia about o: m, h, J.
#[derive(Clone, Copy, Debug, Default)]
struct Disk {
    mass: f64,
    h: [f64; 2],
    turning: f64,
}

/// What the passes work on, by dof and by body.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    axes: Vec<Planar>,
    bodies: Vec<Moving>,
}

/// Twist, acceleration, force and inertia of a link; in the end force and inertia with all that hangs on it.
#[derive(Clone, Copy, Debug, Default)]
struct Moving {
    vel: Planar,
    acc: Planar,
    force: Planar,
    inertia: Disk,
}

impl Scratch {
    pub fn new(model: &Model) -> Scratch {
        Scratch { axes: vec![[0.0; 3]; model.nv], bodies: vec![Moving::default(); model.bodies.len()] }
    }
}

impl Plane {
    /// The plane in which a tree moves, if it moves in one and can turn. Writes: turning of the links.
    pub fn of(model: &Model, tree: &Tree, links: &mut [Link]) -> Option<Plane> {
        let turned = orientations(model);
        let joints = &model.joints[super::joints_of(model, tree)];
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

    fn twist(&self, v: &Vec6) -> Planar {
        let [x, y] = self.point(&lin(v));
        [x, y, self.n.dot(&ang(v))]
    }

    fn point(&self, r: &Vec3) -> [f64; 2] {
        [self.e1.dot(r), self.e2.dot(r)]
    }
}

impl Disk {
    fn new(mass: f64, [x, y]: [f64; 2], central: f64) -> Disk {
        let h = [mass * x, mass * y];
        Disk { mass, h, turning: central + h[0] * x + h[1] * y }
    }

    fn add(&mut self, other: &Disk) {
        self.mass += other.mass;
        self.h = [self.h[0] + other.h[0], self.h[1] + other.h[1]];
        self.turning += other.turning;
    }

    fn mul(&self, [x, y, w]: &Planar) -> Planar {
        let [h1, h2] = self.h;
        [self.mass * x - h2 * w, self.mass * y + h1 * w, h1 * y - h2 * x + self.turning * w]
    }
}

fn dot(a: &Planar, b: &Planar) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn add(a: &mut Planar, b: &Planar) {
    *a = [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
}

/// Bias forces, as [`bias`](super::bias::bias), and the inertias that [`matrix`] needs.
///
/// Reads: xpos, xmat, cdof, qvel. Writes: the planar scratch, qfrc_bias.
pub fn bias(model: &Model, t: usize, plane: &Plane, gravity: &Vec3, qvel: &[f64], data: &mut Data) {
    let Data { plan, xpos, xmat, cdof, qfrc_bias, planar: Scratch { axes, bodies }, .. } = data;
    let (links, origin) = (plan.links_of(t), xpos[model.trees[t].bodies.start]);
    let [up1, up2] = plane.point(&-gravity);
    for link in links {
        let (mut vel, mut acc) = match link.parent {
            NONE => ([0.0; 3], [up1, up2, 0.0]),
            parent => (bodies[parent].vel, bodies[parent].acc),
        };
        let dofs = link.dofs.clone();
        for ((axis, s), rate) in axes[dofs.clone()].iter_mut().zip(&cdof[dofs.clone()]).zip(&qvel[dofs]) {
            *axis = plane.twist(s);
            let moved @ [s1, s2, a] = axis.map(|s| s * rate);
            let [v1, v2, w] = vel;
            add(&mut acc, &[v2 * a - w * s2, w * s1 - v1 * a, 0.0]);
            add(&mut vel, &moved);
        }
        let com = xpos[link.body] - origin + xmat[link.body] * link.com;
        let inertia = Disk::new(link.mass, plane.point(&com), link.turning);
        let ([v1, v2, w], [p1, p2, _]) = (vel, inertia.mul(&vel));
        let mut force = inertia.mul(&acc);
        add(&mut force, &[-w * p2, w * p1, v1 * p2 - v2 * p1]);
        bodies[link.body] = Moving { vel, acc, force, inertia };
    }
    for link in links.iter().rev() {
        let Moving { force, inertia, .. } = bodies[link.body];
        for (bias, axis) in qfrc_bias[link.dofs.clone()].iter_mut().zip(&axes[link.dofs.clone()]) {
            *bias = dot(axis, &force);
        }
        if link.parent != NONE {
            let parent = &mut bodies[link.parent];
            add(&mut parent.force, &force);
            parent.inertia.add(&inertia);
        }
    }
}

/// M, as [`inertia::matrix`](super::inertia::matrix), from what [`bias`] has left.
///
/// Writes: the tree's block of qm (both triangles) and of qm_rows.
pub fn matrix(model: &Model, t: usize, data: &mut Data) {
    let Data { plan, qm, qm_rows, m_adr, planar: Scratch { axes, bodies }, .. } = data;
    let tree = &model.trees[t];
    let axes = &axes[tree.dofs.clone()];
    let force = |link: &Link, j: usize| bodies[link.body].inertia.mul(&axes[j]);
    fill(model, t, plan, qm_rows, &mut qm[m_adr[t]..], force, |i, force| dot(&axes[i], force));
}
