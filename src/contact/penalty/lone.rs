//! A free body that touches one plane, or one other thing that never moves: the inner loop of most scenes.
//!
//! All contacts of such a body share one frame D (rows: normal n and two tangents s and t, towards the body) and one
//! recipe. In the coordinates of D everything is short. The point at r from the centre of mass has
//!
//!     velocity  v + ω × r,     acceleration  a + α × r                     (m/s and m/s²; J̇ qvel is omitted)
//!
//! and a force f and a torque τ there change the body's acceleration by
//!
//!     a += f / m,     α += W (r × f + τ),     W = D I⁻¹ Dᵀ
//!
//! So normals at r and q feel each other by
//!
//!     A = 1/m + (r × n)ᵀ W (q × n),     with r = (x, y, z):  r × n = (0, z, −y),  r × s = (−z, 0, x),  r × t = (y, −x, 0)
//!
//! Spinning and rolling are the body's own α, the same at every contact.
//!
//! The contacts' numbers lie side by side in arrays of L lanes, so that the loops over them have a fixed length and
//! fill vector registers. Lanes beyond the last contact stay empty.

use super::Touch;
use super::drive::{Recipe, friction, inverse_mass, largest_eigenvalue};
use crate::collision::frame;
use crate::contact::complementarity::{Complementarity, Matrix, all_push};
use crate::data::{Contact, Mover};
use crate::forward::Method;
use crate::math::{Mat3, Vec3, Vec6};
use crate::model::Model;

/// Most contacts of a lone body; more are solved as coupled ones.
pub const MOST: usize = 8;

/// Rounds for a body some of whose contacts are new, and have no friction of the last step to start from: with one,
/// a block let go on a slope of 35° rocks for 20 ms, and slides 5 mm too far in a second.
const COLD_ROUNDS: usize = 8;

type Three = [f64; 3];

/// What the contacts of one body have in common.
pub struct Task<'a> {
    pub model: &'a Model,
    pub method: &'a Method,
    pub recipe: &'a Recipe,
    /// Its contacts, at most [`MOST`].
    pub touches: &'a [Touch],
    pub mover: &'a Mover,
}

impl Task<'_> {
    /// Solves for the forces of the contacts, all in one frame and of one recipe.
    ///
    /// In:  contacts with the last step's forces.
    /// Out: the change of the body's acceleration, to be added to `mover.acc`, and the number of linear systems
    ///      solved. Writes the contacts' forces.
    pub fn solve(&self, contacts: &mut [Contact], solver: &mut Complementarity) -> (Vec6, usize) {
        match self.touches.len() {
            1 => self.solve_lanes::<1>(contacts, solver),
            2 => self.solve_lanes::<2>(contacts, solver),
            3..=4 => self.solve_lanes::<4>(contacts, solver),
            _ => self.solve_lanes::<MOST>(contacts, solver),
        }
    }

    fn solve_lanes<const L: usize>(&self, contacts: &mut [Contact], solver: &mut Complementarity) -> (Vec6, usize) {
        match self.recipe.dim {
            1 => self.solve_dim::<L, 1>(contacts, solver),
            3 => self.solve_dim::<L, 3>(contacts, solver),
            4 => self.solve_dim::<L, 4>(contacts, solver),
            _ => self.solve_dim::<L, 6>(contacts, solver),
        }
    }

    /// For up to L contacts of DIM rows.
    fn solve_dim<const L: usize, const DIM: usize>(
        &self,
        contacts: &mut [Contact],
        solver: &mut Complementarity,
    ) -> (Vec6, usize) {
        let body = Body::new::<DIM>(self.model, self.method, self.mover, &contacts[self.touches[0].contact as usize]);
        let smooth = body.motion(&self.mover.acc);
        let mut acc = smooth;
        let mut points = Points::<L>::empty();
        points.fill::<DIM>(self, contacts, &body);
        // The last step's friction acts from the start.
        points.push_friction::<DIM>(&body, &mut acc);
        let mut solves = 0;
        let (mut round, mut rounds) = (0, self.method.rounds);
        while round < rounds {
            if round > 0 {
                points.push_normals(&body, -1.0, &mut acc);
            }
            solves += points.solve_normals(&body, &acc, solver);
            points.push_normals(&body, 1.0, &mut acc);
            if round == 0 && DIM > 1 && points.any_starts() {
                rounds *= COLD_ROUNDS;
            }
            if !points.slide_at_once::<DIM>(self.method, self.recipe, &body, &mut acc) {
                for i in 0..points.n {
                    points.slip::<DIM>(i, self.method, self.recipe, &body, &mut acc);
                }
            }
            round += 1;
        }
        for (i, touch) in self.touches.iter().enumerate().take(L) {
            contacts[touch.contact as usize].force = std::array::from_fn(|k| points.force[k][i]);
        }
        let minus = |a: Three, b: Three| Vec3::new(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
        let linear = body.frame.tr_mul(&minus(acc.linear, smooth.linear));
        let angular = body.axes.tr_mul(&minus(acc.angular, smooth.angular));
        (Vec6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z), solves)
    }
}

/// The body as its contacts see it.
struct Body {
    com: Vec3,
    frame: Mat3,
    /// From principal axes to the frame.
    axes: Mat3,
    /// 1/m
    inverse_mass: f64,
    /// W
    w: [Three; 3],
    velocity: Motion,
    /// Angular velocity per timestep, rad/s².
    drift: Three,
    /// 1/λ of spinning and of rolling, kg m².
    stiff: [f64; 2],
}

/// Velocity or acceleration of the body.
#[derive(Clone, Copy)]
struct Motion {
    linear: Three,
    angular: Three,
}

/// The contacts.
struct Points<const L: usize> {
    n: usize,
    /// Those that did not push in the last step.
    new: [bool; L],
    /// r, m.
    arm: [[f64; L]; 3],
    /// Velocity along the normal, m/s; and along s and t, per timestep: m/s².
    approach: [f64; L],
    drift: [[f64; L]; 2],
    force: [[f64; L]; 6],
    /// W (r × n), W (r × s), W (r × t): angular acceleration per force.
    turn: [[[f64; L]; 3]; 3],
    /// a_ref of the normal (m/s²) and R (1/kg).
    reference: [f64; L],
    softness: [f64; L],
    /// 1/λ of the sliding rows, kg.
    stiff: [f64; L],
}

impl Body {
    fn new<const DIM: usize>(model: &Model, method: &Method, mover: &Mover, contact: &Contact) -> Body {
        let sign = if model.bodies[contact.body[1] as usize].tree.is_some() { 1.0 } else { -1.0 };
        // A frictionless contact comes without tangents, which tilting needs nevertheless.
        let frame = if DIM > 1 { contact.frame } else { frame(&contact.frame.row(0).transpose(), &Vec3::zeros()) };
        let frame = frame * sign;
        let axes = frame * mover.axes;
        let inverse_inertia = [mover.minv[3], mover.minv[4], mover.minv[5]];
        let heavy: [Three; 3] = std::array::from_fn(|i| std::array::from_fn(|k| axes[(i, k)] * inverse_inertia[k]));
        let element = |i: usize, j| (0..3).map(|k| heavy[i][k] * axes[(j, k)]).sum();
        let [xx, yy, zz] = [0, 1, 2].map(|i| element(i, i));
        let [xy, xz, yz] = [element(0, 1), element(0, 2), element(1, 2)];
        let spinning = if DIM >= 4 { 1.0 / xx } else { 0.0 };
        let rolling = if DIM >= 6 { 1.0 / largest_eigenvalue(yy, zz, yz) } else { 0.0 };
        let w = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
        let velocity = Motion { linear: [0.0; 3], angular: [0.0; 3] };
        let (com, inverse_mass) = (mover.com, mover.minv[0]);
        let (drift, stiff) = ([0.0; 3], [spinning, rolling]);
        let mut body = Body { com, frame, axes, inverse_mass, w, velocity, drift, stiff };
        body.velocity = body.motion(&mover.vel);
        if DIM >= 4 {
            body.drift = body.velocity.angular.map(|w| w / method.timestep);
        }
        body
    }

    /// The mover's velocity or acceleration, in the frame.
    fn motion(&self, six: &Vec6) -> Motion {
        let linear = self.frame * Vec3::new(six[0], six[1], six[2]);
        let angular = self.axes * Vec3::new(six[3], six[4], six[5]);
        Motion { linear: linear.into(), angular: angular.into() }
    }
}

impl<const L: usize> Points<L> {
    fn empty() -> Points<L> {
        Points {
            n: 0,
            new: [false; L],
            arm: [[0.0; L]; 3],
            approach: [0.0; L],
            drift: [[0.0; L]; 2],
            force: [[0.0; L]; 6],
            turn: [[[0.0; L]; 3]; 3],
            reference: [0.0; L],
            softness: [0.0; L],
            stiff: [0.0; L],
        }
    }

    /// Everything about the contacts that the rounds need, with the last step's friction; normals start from nothing.
    #[inline(always)]
    fn fill<const DIM: usize>(&mut self, task: &Task, contacts: &[Contact], body: &Body) {
        let p = self;
        p.n = task.touches.len().min(L);
        for (i, touch) in task.touches.iter().enumerate().take(L) {
            let contact = &contacts[touch.contact as usize];
            // The body's own surface lies half the penetration beyond the contact point, along the normal.
            let arm = body.frame * (contact.pos - body.com);
            (p.arm[0][i], p.arm[1][i], p.arm[2][i]) = (arm.x + 0.5 * contact.dist, arm.y, arm.z);
            p.new[i] = contact.force[0] == 0.0;
            for k in 1..DIM {
                p.force[k][i] = contact.force[k];
            }
        }
        let (w, m) = (&body.w, body.inverse_mass);
        for i in 0..L {
            let [x, y, z] = lane(&p.arm, i);
            for j in 0..3 {
                p.turn[0][j][i] = w[j][1] * z - w[j][2] * y;
                p.turn[1][j][i] = w[j][2] * x - w[j][0] * z;
                p.turn[2][j][i] = w[j][0] * y - w[j][1] * x;
            }
            let (s, t) = (lane(&p.turn[1], i), lane(&p.turn[2], i));
            let off = x * t[2] - z * t[0];
            p.stiff[i] = 1.0 / largest_eigenvalue(m + x * s[2] - z * s[0], m + y * t[0] - x * t[1], off);
            let [n, s, t] = body.velocity.at([x, y, z]);
            p.approach[i] = n;
            (p.drift[0][i], p.drift[1][i]) = (s / task.method.timestep, t / task.method.timestep);
        }
        let exact = task.model.opt.flags.diagexact;
        let (mut geom, mut inverse) = ([u32::MAX; 2], 0.0);
        for (i, touch) in task.touches.iter().enumerate().take(L) {
            let contact = &contacts[touch.contact as usize];
            if exact {
                inverse = p.compliance(body, i, i);
            } else if geom != contact.geom {
                (geom, inverse) = (contact.geom, inverse_mass(task.model, contact));
            }
            (p.reference[i], p.softness[i]) = task.recipe.normal(contact.dist, p.approach[i], inverse);
        }
    }

    /// A between the normals of two contacts, 1/kg.
    #[inline(always)]
    fn compliance(&self, body: &Body, i: usize, j: usize) -> f64 {
        body.inverse_mass + self.arm[2][i] * self.turn[0][1][j] - self.arm[1][i] * self.turn[0][2][j]
    }

    /// Finds the normal forces, friction given; none of them acts yet. Returns the number of systems solved.
    #[inline(always)]
    fn solve_normals(&mut self, body: &Body, acc: &Motion, solver: &mut Complementarity) -> usize {
        let mut b = [0.0; L];
        for i in 0..L {
            b[i] = self.reference[i] - acc.at(lane(&self.arm, i))[0];
        }
        if L == 1 {
            self.force[0][0] = (b[0] / (self.compliance(body, 0, 0) + self.softness[0])).max(0.0);
            return 1;
        }
        let mut a = [[0.0; L]; L];
        for i in 0..L {
            for j in 0..L {
                a[i][j] = self.compliance(body, i, j);
            }
            a[i][i] += self.softness[i];
        }
        for empty in self.n..L {
            a.iter_mut().for_each(|row| row[empty] = 0.0);
            a[empty] = [0.0; L];
            a[empty][empty] = 1.0;
            b[empty] = 0.0;
        }
        if all_push::<L>(a.as_flattened(), &b, &mut self.force[0]) {
            return 1;
        }
        solver.solve(Matrix::Dense(a.as_flattened()), &b, &mut self.force[0], false)
    }

    /// Whether any contact pushes that did not in the last step.
    #[inline(always)]
    fn any_starts(&self) -> bool {
        (0..L).any(|i| self.new[i] && self.force[0][i] > 0.0)
    }

    /// Lets the normal forces act, times `sign`.
    #[inline(always)]
    fn push_normals(&self, body: &Body, sign: f64, acc: &mut Motion) {
        for i in 0..L {
            let f = sign * self.force[0][i];
            acc.linear[0] += f * body.inverse_mass;
            acc.turn(f, lane(&self.turn[0], i));
        }
    }

    /// Lets the friction forces act.
    #[inline(always)]
    fn push_friction<const DIM: usize>(&self, body: &Body, acc: &mut Motion) {
        for k in 1..DIM {
            for i in 0..L {
                let f = self.force[k][i];
                if k < 3 {
                    acc.linear[k] += f * body.inverse_mass;
                    acc.turn(f, lane(&self.turn[k], i));
                } else {
                    acc.turn(f, body.w[k - 3]);
                }
            }
        }
    }

    /// Lets friction at contact i oppose the slip, the normal given. Rolling and spinning first: sliding has the last
    /// word.
    #[inline(always)]
    fn slip<const DIM: usize>(&mut self, i: usize, method: &Method, recipe: &Recipe, body: &Body, acc: &mut Motion) {
        let (drift, turn) = (&body.drift, &acc.angular);
        if DIM >= 6 {
            let along = [turn[1], turn[2]];
            let [f, g] = self.change::<2, 4>(i, method, recipe, body.stiff[1], [drift[1], drift[2]], along);
            acc.turn(f, body.w[1]);
            acc.turn(g, body.w[2]);
        }
        if DIM >= 4 {
            let [f] = self.change::<1, 3>(i, method, recipe, body.stiff[0], [drift[0]], [acc.angular[0]]);
            acc.turn(f, body.w[0]);
        }
        if DIM >= 3 {
            let [_, along_s, along_t] = acc.at(lane(&self.arm, i));
            let drift = [self.drift[0][i], self.drift[1][i]];
            let [f, g] = self.change::<2, 1>(i, method, recipe, self.stiff[i], drift, [along_s, along_t]);
            acc.linear[1] += f * body.inverse_mass;
            acc.linear[2] += g * body.inverse_mass;
            acc.turn(f, lane(&self.turn[1], i));
            acc.turn(g, lane(&self.turn[2], i));
        }
    }

    /// Lets all contacts slide at once, if none of them sticks: while each has all the friction it can have, none has to
    /// wait for what the others leave, and the numbers of all lie side by side. Returns whether they do.
    ///
    ///     f ← μ f_n g / |g|,   g = f − s / (h λ)      N, with s/h = drift + acceleration (m/s²), as in [`friction`]
    ///
    /// Looks closer only where the first one slid in the last step.
    #[inline(always)]
    fn slide_at_once<const DIM: usize>(
        &mut self,
        method: &Method,
        recipe: &Recipe,
        body: &Body,
        acc: &mut Motion,
    ) -> bool {
        if L == 1 || DIM != 3 || method.integrator.implicit {
            return false;
        }
        let normal = self.force[0];
        let share2 = |s: f64, t: f64| {
            let (s, t) = (s * recipe.per_limit[0], t * recipe.per_limit[1]);
            s * s + t * t
        };
        if share2(self.force[1][0], self.force[2][0]) <= 0.9 * normal[0] * normal[0] {
            return false;
        }
        let (mut next, mut all) = ([[0.0; L]; 2], true);
        for i in 0..L {
            let [_, s, t] = acc.at(lane(&self.arm, i));
            next[0][i] = self.force[1][i] - (self.drift[0][i] + s) * self.stiff[i];
            next[1][i] = self.force[2][i] - (self.drift[1][i] + t) * self.stiff[i];
        }
        for i in 0..self.n {
            all &= share2(next[0][i], next[1][i]) > normal[i] * normal[i];
        }
        if !all {
            return false;
        }
        for i in 0..L {
            // Empty lanes have no normal force.
            let share2 = share2(next[0][i], next[1][i]).max(f64::MIN_POSITIVE);
            let scale = normal[i] / share2 * share2.sqrt();
            for (k, next) in next.iter_mut().enumerate() {
                next[i] *= scale;
                let change = next[i] - self.force[1 + k][i];
                self.force[1 + k][i] = next[i];
                next[i] = change;
            }
        }
        for k in 0..2 {
            acc.linear[1 + k] += total(&next[k]) * body.inverse_mass;
        }
        for j in 0..3 {
            let (s, t) = (&self.turn[1][j], &self.turn[2][j]);
            acc.angular[j] += total(&std::array::from_fn::<_, L, _>(|i| next[0][i] * s[i] + next[1][i] * t[i]));
        }
        true
    }

    /// Sets the friction of the N rows from FIRST on, `drift` and `along` being theirs. Returns its change.
    #[inline(always)]
    fn change<const N: usize, const FIRST: usize>(
        &mut self,
        i: usize,
        method: &Method,
        recipe: &Recipe,
        stiff: f64,
        drift: [f64; N],
        along: [f64; N],
    ) -> [f64; N] {
        let force: [f64; N] = std::array::from_fn(|k| self.force[FIRST + k][i]);
        let per_limit = std::array::from_fn(|k| recipe.per_limit[FIRST - 1 + k]);
        let next = friction::<N>(method, self.force[0][i], per_limit, stiff, force, drift, along);
        for k in 0..N {
            self.force[FIRST + k][i] = next[k];
        }
        std::array::from_fn(|k| next[k] - force[k])
    }
}

impl Motion {
    /// Of the point at `arm`.
    #[inline(always)]
    fn at(&self, arm: Three) -> Three {
        let ([x, y, z], w, r) = (self.linear, self.angular, arm);
        [x + w[1] * r[2] - w[2] * r[1], y + w[2] * r[0] - w[0] * r[2], z + w[0] * r[1] - w[1] * r[0]]
    }

    /// Adds `f` times `turn`.
    #[inline(always)]
    fn turn(&mut self, f: f64, turn: Three) {
        for k in 0..3 {
            self.angular[k] += f * turn[k];
        }
    }
}

/// Sum of all lanes, even and odd ones apart: two numbers in a register.
#[inline(always)]
fn total<const L: usize>(x: &[f64; L]) -> f64 {
    let mut sum = [0.0; 2];
    for i in 0..L {
        sum[i % 2] += x[i];
    }
    sum[0] + sum[1]
}

/// The three numbers of contact i.
#[inline(always)]
fn lane<const L: usize>(x: &[[f64; L]; 3], i: usize) -> Three {
    [x[0][i], x[1][i], x[2][i]]
}
