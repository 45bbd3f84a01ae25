//! A free body that touches only what never moves: everything in its own six coordinates.
//!
//! In a free body's coordinates (linear part in world axes, angular part in principal axes, at the centre of
//! mass) M is diagonal, so a row J is one six, and M⁻¹Jᵀ its product with the six inverse inertias. This is the
//! inner loop of most scenes: every row is formed once, together with its M⁻¹Jᵀ.

use super::drive::{Recipe, Recipes, eigenvalues, friction, inverse_mass, piece};
use crate::contact::complementarity;
use crate::data::{Contact, Counts, Mover};
use crate::forward::Method;
use crate::math::{Mat3, Vec3, vec3};
use crate::model::{GeomKind, Model};

type Six = [f64; 6];

/// Scratch for the contacts of one body.
#[derive(Clone, Debug, Default)]
pub struct Lone {
    points: Vec<Point>,
    /// A + R of the normals, their right-hand side, forces, and what [`complementarity`] needs.
    a: Vec<f64>,
    b: Vec<f64>,
    f: Vec<f64>,
    pushes: Vec<bool>,
    factor: Vec<f64>,
}

/// One contact of the body.
#[derive(Clone, Copy, Debug, Default)]
struct Point {
    rows: [Row; 6],
    force: Six,
    /// a_ref of the normal (m/s²) and R (1/kg).
    reference: f64,
    softness: f64,
    /// 1/λ of the sliding, spinning and rolling rows.
    stiff: [f64; 3],
}

/// One direction of a contact.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    jac: Six,
    /// M⁻¹ Jᵀ
    heavy: Six,
    velocity: f64,
}

/// A body as its contacts see it.
struct Body<'a> {
    mover: &'a Mover,
    minv: Six,
    vel: Six,
    /// Index of the body's geom in the contacts.
    side: usize,
}

impl Lone {
    /// Solves for the forces of the contacts `order`, all on one free body.
    ///
    /// In:  `mover` of the body; contacts with the last step's forces.
    /// Out: the body's acceleration, as in `mover.acc`. Writes the contacts' forces.
    pub fn solve(
        &mut self,
        model: &Model,
        method: &Method,
        recipes: &Recipes,
        order: &[u32],
        mover: &Mover,
        contacts: &mut [Contact],
        counts: &mut Counts,
    ) -> Six {
        let n = order.len();
        if self.points.len() < n {
            self.points.resize(n, Point::default());
            self.a.resize(n * n, 0.0);
            self.factor.resize(n * n, 0.0);
            self.b.resize(n, 0.0);
            self.f.resize(n, 0.0);
            self.pushes.resize(n, true);
        }
        let side = usize::from(contacts[order[0] as usize].body[0] == 0 || !moves(model, contacts, order[0], 0));
        let body = Body { mover, minv: mover.minv.into(), vel: mover.vel.into(), side };
        let mut acc: Six = mover.acc.into();

        // Rows and references; the last step's friction acts from the start.
        let mut last = u32::MAX;
        let mut frame = Mat3::zeros();
        for (point, &c) in self.points.iter_mut().zip(order) {
            let contact = &contacts[c as usize];
            let recipe = recipes.of(contact);
            // The points of a plane share its frame.
            if contact.geom[0] != last || model.geoms[last as usize].kind != GeomKind::Plane {
                last = contact.geom[0];
                frame = local_frame(contact, &body);
            }
            point.fill(model, contact, recipe, &frame, &body);
            for k in 1..recipe.dim {
                add(&mut acc, &point.rows[k].heavy, point.force[k]);
            }
            counts.rows += recipe.dim;
        }
        for _ in 0..method.rounds {
            counts.solves += self.normals(n, &mut acc);
            for (point, &c) in self.points.iter_mut().zip(order) {
                point.slip(method, recipes.of(&contacts[c as usize]), &mut acc);
            }
        }
        for (point, &c) in self.points.iter().zip(order) {
            contacts[c as usize].force = point.force;
        }
        acc
    }

    /// Normal forces of all points, friction given; `acc` follows them. Returns the number of solves.
    fn normals(&mut self, n: usize, acc: &mut Six) -> usize {
        let points = &mut self.points[..n];
        if let [p] = points {
            let inverse = dot(&p.rows[0].jac, &p.rows[0].heavy);
            let wanted = p.reference - dot(&p.rows[0].jac, acc) + inverse * p.force[0];
            let force = (wanted / (inverse + p.softness)).max(0.0);
            add(acc, &p.rows[0].heavy, force - p.force[0]);
            p.force[0] = force;
            return 1;
        }
        let a = &mut self.a[..n * n];
        for (i, p) in points.iter().enumerate() {
            add(acc, &p.rows[0].heavy, -p.force[0]);
            for (j, q) in points[..i].iter().enumerate() {
                let x = dot(&p.rows[0].heavy, &q.rows[0].jac);
                a[i * n + j] = x;
                a[j * n + i] = x;
            }
            a[i * n + i] = dot(&p.rows[0].heavy, &p.rows[0].jac) + p.softness;
        }
        for (b, p) in self.b.iter_mut().zip(points.iter()) {
            *b = p.reference - dot(&p.rows[0].jac, acc);
        }
        let f = &mut self.f[..n];
        let solves = complementarity::solve(a, &self.b[..n], f, &mut self.pushes[..n], &mut self.factor[..n * n]);
        for (p, f) in points.iter_mut().zip(f) {
            add(acc, &p.rows[0].heavy, *f);
            p.force[0] = *f;
        }
        solves
    }
}

fn moves(model: &Model, contacts: &[Contact], c: u32, side: usize) -> bool {
    model.bodies[contacts[c as usize].body[side] as usize].tree.is_some()
}

/// The contact's directions in the body's axes, as columns; they point from the other geom to the body's.
#[inline]
fn local_frame(contact: &Contact, body: &Body) -> Mat3 {
    let frame = body.mover.axes.tr_mul(&contact.frame.transpose());
    if body.side == 1 { frame } else { -frame }
}

impl Point {
    /// Everything about a contact that the rounds need; the normal force starts from nothing.
    #[inline]
    fn fill(&mut self, model: &Model, contact: &Contact, recipe: &Recipe, frame: &Mat3, body: &Body) {
        let sign = if body.side == 1 { 1.0 } else { -1.0 };
        // The body's own surface lies half the penetration beyond the contact point.
        let normal = vec3(&[contact.frame[(0, 0)], contact.frame[(0, 1)], contact.frame[(0, 2)]]);
        let arm = contact.pos + normal * (0.5 * sign * contact.dist) - body.mover.com;
        let arm = body.mover.axes.tr_mul(&arm);
        let dim = recipe.dim;
        for k in 0..dim {
            let local = vec3(frame.column(k % 3).as_slice());
            let (lin, ang) = if k < 3 {
                let row = contact.frame.row(k);
                (Vec3::new(row[0], row[1], row[2]) * sign, arm.cross(&local))
            } else {
                (Vec3::zeros(), local)
            };
            let jac = [lin.x, lin.y, lin.z, ang.x, ang.y, ang.z];
            let heavy = std::array::from_fn(|i| jac[i] * body.minv[i]);
            self.rows[k] = Row { jac, heavy, velocity: dot(&jac, &body.vel) };
        }
        let rows = &self.rows;
        let lambda = eigenvalues(dim, |k, l| dot(&rows[k].jac, &rows[l].heavy));
        self.stiff = lambda.map(|x| 1.0 / x);
        let inverse =
            if model.opt.flags.diagexact { dot(&rows[0].jac, &rows[0].heavy) } else { inverse_mass(model, contact) };
        (self.reference, self.softness) = recipe.normal(contact.dist, rows[0].velocity, inverse);
        self.force = contact.force;
        self.force[0] = 0.0;
    }

    /// Lets friction oppose the slip, the normal given. Rolling and spinning first: sliding has the last word.
    #[inline]
    fn slip(&mut self, method: &Method, recipe: &Recipe, acc: &mut Six) {
        if recipe.dim >= 6 {
            self.slip_piece::<2>(4, method, recipe, self.stiff[2], acc);
        }
        if recipe.dim >= 4 {
            self.slip_piece::<1>(3, method, recipe, self.stiff[1], acc);
        }
        if recipe.dim >= 3 {
            self.slip_piece::<2>(1, method, recipe, self.stiff[0], acc);
        }
    }

    #[inline(always)]
    fn slip_piece<const N: usize>(
        &mut self,
        first: usize,
        method: &Method,
        recipe: &Recipe,
        stiff: f64,
        acc: &mut Six,
    ) {
        let force: [f64; N] = piece(&self.force, first);
        let velocity = std::array::from_fn(|k| self.rows[first + k].velocity);
        let along = std::array::from_fn(|k| dot(&self.rows[first + k].jac, acc));
        let limits = piece(&recipe.per_limit, first - 1);
        let next = friction::<N>(method, self.force[0], limits, stiff, force, velocity, along);
        for k in 0..N {
            add(acc, &self.rows[first + k].heavy, next[k] - force[k]);
            self.force[first + k] = next[k];
        }
    }
}

#[inline(always)]
fn dot(a: &Six, b: &Six) -> f64 {
    // Two lanes of three.
    (a[0] * b[0] + a[2] * b[2] + a[4] * b[4]) + (a[1] * b[1] + a[3] * b[3] + a[5] * b[5])
}

/// acc += M⁻¹ Jᵀ f
#[inline(always)]
fn add(acc: &mut Six, heavy: &Six, f: f64) {
    for k in 0..6 {
        acc[k] += heavy[k] * f;
    }
}
