//! A free body that touches only what never moves: everything in its own six coordinates.
//!
//! In a free body's coordinates (linear part in world axes, angular part in principal axes, at the centre of
//! mass) M is diagonal, so a row J is one six, and M⁻¹Jᵀ its product with the six inverse inertias.

use super::drive::{Recipes, eigenvalues, friction, inverse_mass, piece};
use crate::contact::{complementarity, surface_points};
use crate::data::{Contact, Data, Mover};
use crate::dynamics::free;
use crate::forward::Method;
use crate::math::{Vec3, Vec6};
use crate::model::Model;

type Six = [f64; 6];

/// Scratch for the contacts of one body.
#[derive(Clone, Debug, Default)]
pub struct Lone {
    points: Vec<Point>,
    a: Vec<f64>,
    b: Vec<f64>,
    f: Vec<f64>,
    pushes: Vec<bool>,
    factor: Vec<f64>,
}

/// One contact of the body.
#[derive(Clone, Copy, Debug, Default)]
struct Point {
    /// J of the rows in use.
    rows: [Six; 6],
    velocity: Six,
    force: Six,
    /// a_ref of the normal, m/s².
    reference: f64,
    /// R of the normal, 1/kg.
    softness: f64,
    /// Largest eigenvalue of A of the sliding, spinning and rolling rows.
    lambda: [f64; 3],
}

impl Lone {
    /// Solves for the forces of the contacts `order`, all on one free body.
    ///
    /// Reads: movers, contacts (with the last step's forces). Writes: forces of the contacts, qacc of the body.
    pub fn solve(&mut self, model: &Model, method: &Method, recipes: &Recipes, order: &[u32], data: &mut Data) {
        let n = order.len();
        if self.b.len() < n {
            self.points.resize(n, Point::default());
            self.a.resize(n * n, 0.0);
            self.factor.resize(n * n, 0.0);
            self.b.resize(n, 0.0);
            self.f.resize(n, 0.0);
            self.pushes.resize(n, true);
        }
        let first = &data.contacts[order[0] as usize];
        let side = usize::from(model.bodies[first.body[1] as usize].tree.is_some());
        let root = first.body[side] as usize;
        let mover = data.movers[root];
        let minv: Six = mover.minv.into();
        let vel: Six = mover.vel.into();
        let mut acc: Six = mover.acc.into();

        // Rows and references; the last step's friction acts from the start.
        for (i, &c) in order.iter().enumerate() {
            let contact = &data.contacts[c as usize];
            let recipe = recipes.of(contact);
            let point = &mut self.points[i];
            point.fill(model, contact, recipe.dim, &mover, &minv, &vel);
            let inverse = if model.opt.flags.diagexact {
                weighted(&minv, &point.rows[0], &point.rows[0])
            } else {
                inverse_mass(model, contact)
            };
            (point.reference, point.softness) = recipe.normal(contact.dist, point.velocity[0], inverse);
            for k in 1..recipe.dim {
                add(&mut acc, &minv, &point.rows[k], point.force[k]);
            }
            data.counts.rows += recipe.dim;
        }

        for _ in 0..method.rounds {
            self.normals(n, &minv, &mut acc, &mut data.counts.solves);
            for (i, &c) in order.iter().enumerate() {
                let recipe = recipes.of(&data.contacts[c as usize]);
                self.points[i].slip(method, recipe.dim, &recipe.limits, &minv, &mut acc);
            }
        }

        for (point, &c) in self.points.iter().zip(order) {
            data.contacts[c as usize].force = point.force;
        }
        let dofs = model.bodies[root].dofs.start;
        if let Some(free) = model.bodies[root].tree.and_then(|t| model.trees[t].free.as_ref()) {
            let change = Vec6::from(acc) - mover.acc;
            let change = free::generalized(free, &data.xmat[root], &change);
            for i in 0..6 {
                data.qacc[dofs + i] += change[i];
            }
        }
    }

    /// Normal forces of all points, friction given; `acc` follows them.
    fn normals(&mut self, n: usize, minv: &Six, acc: &mut Six, solves: &mut usize) {
        let points = &mut self.points[..n];
        for (i, p) in points.iter().enumerate() {
            add(acc, minv, &p.rows[0], -p.force[0]);
            let heavy: Six = std::array::from_fn(|k| p.rows[0][k] * minv[k]);
            for (j, q) in points[..i].iter().enumerate() {
                let a = dot(&heavy, &q.rows[0]);
                self.a[i * n + j] = a;
                self.a[j * n + i] = a;
            }
            self.a[i * n + i] = dot(&heavy, &p.rows[0]) + p.softness;
            self.pushes[i] = true;
        }
        for (b, p) in self.b.iter_mut().zip(points.iter()) {
            *b = p.reference - dot(&p.rows[0], acc);
        }
        let (a, f) = (&self.a[..n * n], &mut self.f[..n]);
        *solves += complementarity::solve(a, &self.b[..n], f, &mut self.pushes[..n], &mut self.factor[..n * n]);
        for (p, f) in points.iter_mut().zip(&self.f) {
            add(acc, minv, &p.rows[0], *f);
            p.force[0] = *f;
        }
    }
}

impl Point {
    /// Rows, velocities and compliances of a contact; the normal force starts from nothing.
    #[inline]
    fn fill(&mut self, model: &Model, contact: &Contact, dim: usize, mover: &Mover, minv: &Six, vel: &Six) {
        let side = usize::from(model.bodies[contact.body[1] as usize].tree.is_some());
        let sign = if side == 1 { 1.0 } else { -1.0 };
        let arm = surface_points(contact, model)[side] - mover.com;
        for k in 0..dim {
            let d = contact.frame.row(k % 3).transpose() * sign;
            let (lin, ang) = if k < 3 { (d, arm.cross(&d)) } else { (Vec3::zeros(), d) };
            let ang = mover.axes.tr_mul(&ang);
            self.rows[k] = [lin.x, lin.y, lin.z, ang.x, ang.y, ang.z];
            self.velocity[k] = dot(&self.rows[k], vel);
        }
        self.lambda = eigenvalues(dim, |k, l| weighted(minv, &self.rows[k], &self.rows[l]));
        self.force = contact.force;
        self.force[0] = 0.0;
    }

    /// Lets friction oppose the slip, the normal given. Rolling and spinning first: sliding has the last word.
    #[inline]
    fn slip(&mut self, method: &Method, dim: usize, limits: &[f64; 5], minv: &Six, acc: &mut Six) {
        if dim >= 6 {
            self.slip_piece::<2>(4, method, limits, self.lambda[2], minv, acc);
        }
        if dim >= 4 {
            self.slip_piece::<1>(3, method, limits, self.lambda[1], minv, acc);
        }
        if dim >= 3 {
            self.slip_piece::<2>(1, method, limits, self.lambda[0], minv, acc);
        }
    }

    #[inline(always)]
    fn slip_piece<const N: usize>(
        &mut self,
        first: usize,
        method: &Method,
        limits: &[f64; 5],
        lambda: f64,
        minv: &Six,
        acc: &mut Six,
    ) {
        let force: [f64; N] = piece(&self.force, first);
        let along = std::array::from_fn(|k| dot(&self.rows[first + k], acc));
        let velocity = piece(&self.velocity, first);
        let next = friction::<N>(method, self.force[0], piece(limits, first - 1), lambda, force, velocity, along);
        for k in 0..N {
            add(acc, minv, &self.rows[first + k], next[k] - force[k]);
            self.force[first + k] = next[k];
        }
    }
}

#[inline(always)]
fn dot(a: &Six, b: &Six) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + (a[3] * b[3] + a[4] * b[4] + a[5] * b[5])
}

/// a M⁻¹ bᵀ
#[inline(always)]
fn weighted(minv: &Six, a: &Six, b: &Six) -> f64 {
    dot(&std::array::from_fn(|k| a[k] * minv[k]), b)
}

/// acc += M⁻¹ rowᵀ f
#[inline(always)]
fn add(acc: &mut Six, minv: &Six, row: &Six, f: f64) {
    for k in 0..6 {
        acc[k] += minv[k] * row[k] * f;
    }
}
