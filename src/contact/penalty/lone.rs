//! A free body that touches one plane, or one other thing that never moves: the inner loop of most scenes.
//!
//! All contacts of such a body share one frame D (rows: normal and two tangents, towards the body) and one recipe. So take the
//! body's linear motion along D and its angular motion in principal axes P, where M is diagonal:
//!
//!     linear = D v,   angular = Pᵀ ω
//!
//! Then the row of direction k has a 1 at linear place k (sliding) or nothing (spinning, rolling), and the angular
//! part q × p_k or p_k, with p = Pᵀ Dᵀ the frame in principal axes and q the arm of the contact there: three
//! products a row instead of six.

use super::drive::{Recipe, eigenvalues, friction, inverse_mass, piece};
use crate::contact::complementarity::Complementarity;
use crate::data::{Contact, Counts, Mover};
use crate::forward::Method;
use crate::math::{Mat3, Vec3, Vec6};
use crate::model::Model;

/// Three numbers and a zero, so that they fill vector registers.
type Four = [f64; 4];

/// Scratch for the contacts of one body.
#[derive(Clone, Debug, Default)]
pub struct Lone {
    points: Vec<Point>,
    /// A + R of the normals, their right-hand side and forces.
    a: Vec<f64>,
    b: Vec<f64>,
    f: Vec<f64>,
    solver: Complementarity,
}

/// One contact of the body.
#[derive(Clone, Copy, Debug, Default)]
struct Point {
    /// Angular part of J, and of J M⁻¹, of each row.
    jac: [Four; 6],
    heavy: [Four; 6],
    velocity: [f64; 6],
    force: [f64; 6],
    /// a_ref of the normal (m/s²) and R (1/kg).
    reference: f64,
    softness: f64,
    /// 1/λ of the sliding, spinning and rolling rows.
    stiff: [f64; 3],
}

/// Velocity or acceleration of the body in these coordinates.
#[derive(Clone, Copy, Debug)]
struct Motion {
    linear: [f64; 3],
    angular: Four,
}

/// The body as its contacts see it.
struct Body {
    com: Vec3,
    axes: Mat3,
    /// D and p, both as rows.
    frame: Mat3,
    local: Mat3,
    inverse_mass: f64,
    inverse_inertia: Four,
    velocity: Motion,
}

impl Body {
    /// In: `sign` +1 where the contacts' second geom is the body's, −1 where the first is.
    fn new(mover: &Mover, contact: &Contact, sign: f64) -> Body {
        let frame = contact.frame * sign;
        let m = mover.minv;
        Body {
            com: mover.com,
            axes: mover.axes,
            frame,
            local: frame * mover.axes,
            inverse_mass: m[0],
            inverse_inertia: [m[3], m[4], m[5], 0.0],
            velocity: Motion::new(&frame, &mover.vel),
        }
    }
}

impl Motion {
    fn new(frame: &Mat3, six: &Vec6) -> Motion {
        let linear = frame * Vec3::new(six[0], six[1], six[2]);
        Motion { linear: linear.into(), angular: [six[3], six[4], six[5], 0.0] }
    }
}

impl Lone {
    /// Solves for the forces of the contacts `order`, all on one free body, in one frame and of one recipe.
    ///
    /// In:  `mover` of the body; contacts with the last step's forces.
    /// Out: the change of the body's acceleration, to be added to `mover.acc`. Writes the contacts' forces.
    pub fn solve(
        &mut self,
        model: &Model,
        method: &Method,
        recipe: &Recipe,
        order: &[u32],
        mover: &Mover,
        contacts: &mut [Contact],
        counts: &mut Counts,
    ) -> Vec6 {
        counts.rows += recipe.dim * order.len();
        match recipe.dim {
            1 => self.solve_dim::<1>(model, method, recipe, order, mover, contacts, counts),
            3 => self.solve_dim::<3>(model, method, recipe, order, mover, contacts, counts),
            4 => self.solve_dim::<4>(model, method, recipe, order, mover, contacts, counts),
            _ => self.solve_dim::<6>(model, method, recipe, order, mover, contacts, counts),
        }
    }

    /// [`Lone::solve`] for contacts of DIM rows.
    fn solve_dim<const DIM: usize>(
        &mut self,
        model: &Model,
        method: &Method,
        recipe: &Recipe,
        order: &[u32],
        mover: &Mover,
        contacts: &mut [Contact],
        counts: &mut Counts,
    ) -> Vec6 {
        let n = order.len();
        self.reserve(n);
        let first = &contacts[order[0] as usize];
        let sign = if model.bodies[first.body[1] as usize].tree.is_some() { 1.0 } else { -1.0 };
        let body = Body::new(mover, first, sign);
        let smooth = Motion::new(&body.frame, &mover.acc);
        let mut acc = smooth;

        // Rows and references; the last step's friction acts from the start.
        for (point, &c) in self.points.iter_mut().zip(order) {
            point.fill::<DIM>(model, &contacts[c as usize], recipe, &body);
            for k in 1..DIM {
                point.push(&body, k, point.force[k], &mut acc);
            }
        }
        for _ in 0..method.rounds {
            counts.solves += self.normals(n, &body, &mut acc);
            for point in &mut self.points[..n] {
                point.slip::<DIM>(method, recipe, &body, &mut acc);
            }
        }
        for (point, &c) in self.points.iter().zip(order) {
            contacts[c as usize].force = point.force;
        }
        let linear = Vec3::from_fn(|i, _| acc.linear[i] - smooth.linear[i]);
        let linear = body.frame.tr_mul(&linear);
        let angular = |i: usize| acc.angular[i] - smooth.angular[i];
        Vec6::new(linear.x, linear.y, linear.z, angular(0), angular(1), angular(2))
    }

    /// Room for n contacts.
    fn reserve(&mut self, n: usize) {
        if self.points.len() < n {
            self.points.resize(n, Point::default());
            self.a.resize(n * n, 0.0);
            self.b.resize(n, 0.0);
            self.f.resize(n, 0.0);
        }
    }

    /// Normal forces of all points, friction given; `acc` follows them. Returns the number of solves.
    fn normals(&mut self, n: usize, body: &Body, acc: &mut Motion) -> usize {
        let points = &mut self.points[..n];
        for p in points.iter_mut() {
            p.push(body, 0, -p.force[0], acc);
        }
        if let [p] = points {
            let inverse = body.inverse_mass + dot(&p.jac[0], &p.heavy[0]);
            p.force[0] = ((p.reference - p.along(0, acc)) / (inverse + p.softness)).max(0.0);
            p.push(body, 0, p.force[0], acc);
            return 1;
        }
        let a = &mut self.a[..n * n];
        for (i, p) in points.iter().enumerate() {
            for (j, q) in points[..i].iter().enumerate() {
                let x = body.inverse_mass + dot(&p.heavy[0], &q.jac[0]);
                a[i * n + j] = x;
                a[j * n + i] = x;
            }
            a[i * n + i] = body.inverse_mass + dot(&p.heavy[0], &p.jac[0]) + p.softness;
            self.b[i] = p.reference - p.along(0, acc);
        }
        let f = &mut self.f[..n];
        let solves = self.solver.solve(a, &self.b[..n], f);
        for (p, f) in points.iter_mut().zip(f) {
            p.push(body, 0, *f, acc);
            p.force[0] = *f;
        }
        solves
    }
}

impl Point {
    /// Everything about a contact that the rounds need; the normal force starts from nothing.
    #[inline]
    fn fill<const DIM: usize>(&mut self, model: &Model, contact: &Contact, recipe: &Recipe, body: &Body) {
        // The body's own surface lies half the penetration beyond the contact point, along D's normal.
        let normal = body.frame.row(0).transpose();
        let arm = body.axes.tr_mul(&(contact.pos + normal * (0.5 * contact.dist) - body.com));
        for k in 0..DIM {
            let p = body.local.row(k % 3).transpose();
            let x = if k < 3 { arm.cross(&p) } else { p };
            self.jac[k] = [x.x, x.y, x.z, 0.0];
            self.heavy[k] = std::array::from_fn(|i| self.jac[k][i] * body.inverse_inertia[i]);
            self.velocity[k] = self.along(k, &body.velocity);
        }
        let compliance = |k: usize, l: usize| {
            let linear = if k == l && k < 3 { body.inverse_mass } else { 0.0 };
            linear + dot(&self.jac[k], &self.heavy[l])
        };
        self.stiff = eigenvalues(DIM, compliance).map(|x| 1.0 / x);
        let inverse = if model.opt.flags.diagexact { compliance(0, 0) } else { inverse_mass(model, contact) };
        (self.reference, self.softness) = recipe.normal(contact.dist, self.velocity[0], inverse);
        self.force = contact.force;
        self.force[0] = 0.0;
    }

    /// J_k · motion
    #[inline(always)]
    fn along(&self, k: usize, motion: &Motion) -> f64 {
        let linear = if k < 3 { motion.linear[k] } else { 0.0 };
        linear + dot(&self.jac[k], &motion.angular)
    }

    /// acc += M⁻¹ J_kᵀ f
    #[inline(always)]
    fn push(&self, body: &Body, k: usize, f: f64, acc: &mut Motion) {
        if k < 3 {
            acc.linear[k] += body.inverse_mass * f;
        }
        for i in 0..4 {
            acc.angular[i] += self.heavy[k][i] * f;
        }
    }

    /// Lets friction oppose the slip, the normal given. Rolling and spinning first: sliding has the last word.
    #[inline]
    fn slip<const DIM: usize>(&mut self, method: &Method, recipe: &Recipe, body: &Body, acc: &mut Motion) {
        if DIM >= 6 {
            self.slip_piece::<2, 4>(method, recipe, self.stiff[2], body, acc);
        }
        if DIM >= 4 {
            self.slip_piece::<1, 3>(method, recipe, self.stiff[1], body, acc);
        }
        if DIM >= 3 {
            self.slip_piece::<2, 1>(method, recipe, self.stiff[0], body, acc);
        }
    }

    /// [`Point::slip`] for the N rows from FIRST on.
    #[inline(always)]
    fn slip_piece<const N: usize, const FIRST: usize>(
        &mut self,
        method: &Method,
        recipe: &Recipe,
        stiff: f64,
        body: &Body,
        acc: &mut Motion,
    ) {
        let force: [f64; N] = piece(&self.force, FIRST);
        let velocity = piece(&self.velocity, FIRST);
        let along = std::array::from_fn(|k| self.along(FIRST + k, acc));
        let per_limit = piece(&recipe.per_limit, FIRST - 1);
        let next = friction::<N>(method, self.force[0], per_limit, stiff, force, velocity, along);
        for k in 0..N {
            self.push(body, FIRST + k, next[k] - force[k], acc);
            self.force[FIRST + k] = next[k];
        }
    }
}

#[inline(always)]
fn dot(a: &Four, b: &Four) -> f64 {
    (a[0] * b[0] + a[2] * b[2]) + (a[1] * b[1] + a[3] * b[3])
}
