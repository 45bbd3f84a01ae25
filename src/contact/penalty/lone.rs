//! A free body that touches one plane, or one other thing that never moves: the inner loop of most scenes.
//!
//! All contacts of such a body share one frame D (rows: normal n and two tangents s and t, towards the body) and one
//! recipe. In the coordinates of D everything is short. The point at r = (x, y, z) from the centre of mass has
//!
//!     velocity  v + ω × r,     acceleration  a + α × r                     (m/s and m/s²; J̇ qvel is omitted)
//!
//! and a force f = (f_n, f_s, f_t) and a torque τ there change the body's acceleration by
//!
//!     a += f / m,     α += W (r × f + τ),     W = D I⁻¹ Dᵀ,     r × f = (y f_t − z f_s,  z f_n − x f_t,  x f_s − y f_n)
//!
//! So normals at r and q feel each other by
//!
//!     A = 1/m + (r × n)ᵀ W (q × n)
//!
//! and friction at r answers to itself by
//!
//!     A_ss = 1/m + z² W_nn − 2 x z W_nt + x² W_tt,          A_tt = 1/m + y² W_nn − 2 x y W_ns + x² W_ss,
//!     A_st = x (z W_ns + y W_nt) − y z W_nn − x² W_st
//!
//! Spinning and rolling are the body's own α, the same at every contact.
//!
//! The contacts' numbers lie side by side in arrays of L lanes, so that the loops over them have a fixed length and
//! fill vector registers. Lanes beyond the last contact stay empty.

use super::drive::{Recipe, friction, inverse_mass};
use crate::collision::frame;
use crate::contact::complementarity::{AllPush, Complementarity, Matrix};
use crate::contact::rows::largest_eigenvalue;
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
    pub mover: &'a Mover,
}

impl Task<'_> {
    /// Solves for the forces of the contacts, at most [`MOST`], all in one frame and of one recipe.
    ///
    /// In:  contacts with the last step's forces.
    /// Out: the change of the body's acceleration, to be added to `mover.acc`; the number of rows and of linear systems
    ///      solved. Writes the contacts' forces.
    pub fn solve(&self, contacts: &mut [Contact], solver: &mut Complementarity) -> (Vec6, usize, usize) {
        // Which of them push.
        let (mut all, mut n) = ([0; MOST], 0);
        for (i, contact) in contacts.iter().enumerate().take(MOST) {
            all[n] = i;
            n += usize::from(self.recipe.reaches(contact));
        }
        let touches = &all[..n];
        let (change, solves) = match n {
            1 => self.solve_lanes::<1>(contacts, touches, solver),
            2 => self.solve_lanes::<2>(contacts, touches, solver),
            3..=4 => self.solve_lanes::<4>(contacts, touches, solver),
            _ => self.solve_lanes::<MOST>(contacts, touches, solver),
        };
        (change, n * self.recipe.dim, solves)
    }

    fn solve_lanes<const L: usize>(
        &self,
        contacts: &mut [Contact],
        touches: &[usize],
        solver: &mut Complementarity,
    ) -> (Vec6, usize) {
        match self.recipe.dim {
            1 => self.solve_dim::<L, 1>(contacts, touches, solver),
            3 => self.solve_dim::<L, 3>(contacts, touches, solver),
            4 => self.solve_dim::<L, 4>(contacts, touches, solver),
            _ => self.solve_dim::<L, 6>(contacts, touches, solver),
        }
    }

    /// For up to L contacts of DIM rows.
    fn solve_dim<const L: usize, const DIM: usize>(
        &self,
        contacts: &mut [Contact],
        touches: &[usize],
        solver: &mut Complementarity,
    ) -> (Vec6, usize) {
        // Divisions and roots take long: what need not wait for them comes right after them.
        let body = Body::new::<DIM>(self.model, self.mover, &contacts[0]);
        let mut points = Points::<L, DIM>::new(self, contacts, touches, &body);
        let factor = points.factor(&body);
        let (smooth, velocity) = (body.motion(&self.mover.acc), body.motion(&self.mover.vel));
        points.drive(self.recipe, &velocity);
        let drift = velocity.times(1.0 / self.method.timestep);
        let mut acc = smooth;
        // The last step's friction acts from the start.
        points.push_friction(&body, &mut acc);
        let mut solves = 0;
        let implicit = self.method.integrator.implicit;
        // An implicit step needs forces that follow from its end alone, not from the last step's.
        let (mut round, mut rounds) = (0, self.method.rounds * if implicit { COLD_ROUNDS } else { 1 });
        while round < rounds {
            if round > 0 {
                points.push_normals(&body, -1.0, &mut acc);
            }
            solves += points.solve_normals(&body, &factor, &acc, solver);
            if round == 0 && DIM > 1 {
                points.stiffen(&body);
            }
            points.push_normals(&body, 1.0, &mut acc);
            if round == 0 && DIM > 1 && !implicit && points.any_starts() {
                rounds *= COLD_ROUNDS;
            }
            if !points.slide_at_once(self.method, self.recipe, &body, &drift, &mut acc) {
                for i in 0..points.n {
                    points.slip(i, self.method, self.recipe, &body, &drift, &mut acc);
                }
            }
            round += 1;
        }
        for (i, &touch) in touches.iter().enumerate().take(L) {
            contacts[touch].force = std::array::from_fn(|k| if k < DIM { points.force[k][i] } else { 0.0 });
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
    /// 1/λ of spinning and of rolling, kg m².
    stiff: [f64; 2],
}

/// Velocity or acceleration of the body; or its *drift*, the velocity per timestep (m/s², rad/s²), which is what friction
/// would have to stop.
#[derive(Clone, Copy)]
struct Motion {
    linear: Three,
    angular: Three,
}

/// The contacts: L of them, each with DIM rows.
struct Points<const L: usize, const DIM: usize> {
    n: usize,
    /// r, m.
    arm: [[f64; L]; 3],
    force: [[f64; L]; DIM],
    /// The last step's normal force: zero for contacts that are new.
    before: [f64; L],
    /// m
    dist: [f64; L],
    /// Impedance d, and R of the normal (1/kg).
    impedance: [f64; L],
    softness: [f64; L],
    /// a_ref of the normal, m/s².
    reference: [f64; L],
    /// 1/λ of the sliding rows, kg.
    stiff: [f64; L],
}

impl Body {
    #[inline(always)]
    fn new<const DIM: usize>(model: &Model, mover: &Mover, contact: &Contact) -> Body {
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
        Body { com: mover.com, frame, axes, inverse_mass: mover.minv[0], w, stiff: [spinning, rolling] }
    }

    /// The mover's velocity or acceleration, in the frame.
    #[inline(always)]
    fn motion(&self, six: &Vec6) -> Motion {
        let linear = self.frame * Vec3::new(six[0], six[1], six[2]);
        let angular = self.axes * Vec3::new(six[3], six[4], six[5]);
        Motion { linear: linear.into(), angular: angular.into() }
    }

    /// W (r × n), its part along s and t: the angular acceleration that a normal force of 1 N at `arm` causes.
    #[inline(always)]
    fn tilt(&self, [_, y, z]: Three) -> [f64; 2] {
        [self.w[1][1] * z - self.w[1][2] * y, self.w[1][2] * z - self.w[2][2] * y]
    }

    /// A between the normal at `arm` and one that causes `tilt`, 1/kg.
    #[inline(always)]
    fn compliance(&self, [_, y, z]: Three, tilt: [f64; 2]) -> f64 {
        self.inverse_mass + z * tilt[0] - y * tilt[1]
    }
}

impl<const L: usize, const DIM: usize> Points<L, DIM> {
    /// Where the contacts are, how soft they are, and the last step's forces.
    #[inline(always)]
    fn new(task: &Task, contacts: &[Contact], touches: &[usize], body: &Body) -> Self {
        let n = touches.len().min(L);
        // Empty lanes look like the last contact, but without forces.
        let of = |i: usize| &contacts[touches[i.min(n - 1)]];
        let (mut at, mut dist, mut force) = ([[0.0; L]; 3], [0.0; L], [[0.0; L]; DIM]);
        for i in 0..L {
            let contact = of(i);
            (0..3).for_each(|k| at[k][i] = contact.pos[k] - body.com[k]);
            dist[i] = contact.dist;
            (0..DIM).for_each(|k| force[k][i] = if i < n { contact.force[k] } else { 0.0 });
        }
        let before = force[0];
        let mut arm = [[0.0; L]; 3];
        for i in 0..L {
            for k in 0..3 {
                let [a, b, c] = [body.frame[(k, 0)], body.frame[(k, 1)], body.frame[(k, 2)]];
                arm[k][i] = a * at[0][i] + b * at[1][i] + c * at[2][i];
            }
            // The body's own surface lies half the penetration beyond the contact point, along the normal.
            arm[0][i] += 0.5 * dist[i];
        }
        let (mut impedance, mut softness) = ([0.0; L], [0.0; L]);
        let (mut geom, mut inverse) = ([u32::MAX; 2], 0.0);
        for i in 0..L {
            let contact = of(i);
            if task.model.opt.flags.diagexact {
                inverse = body.compliance(lane(&arm, i), body.tilt(lane(&arm, i)));
            } else if geom != contact.geom {
                (geom, inverse) = (contact.geom, inverse_mass(task.model, contact));
            }
            impedance[i] = task.recipe.impedance(dist[i]);
            softness[i] = task.recipe.softness(impedance[i], inverse);
        }
        Points { n, arm, force, before, dist, impedance, softness, reference: [0.0; L], stiff: [0.0; L] }
    }

    /// The element of A + R between the normals i and j, 1/kg.
    #[inline(always)]
    fn element(&self, body: &Body, i: usize, j: usize) -> f64 {
        let soft = if i == j { self.softness[i] } else { 0.0 };
        body.compliance(lane(&self.arm, i), body.tilt(lane(&self.arm, j))) + soft
    }

    /// A + R of the normals, factored; nothing where there are fewer contacts than lanes.
    #[inline(always)]
    fn factor(&self, body: &Body) -> Option<AllPush<L>> {
        if self.n == L { AllPush::new(|i, j| self.element(body, i, j)) } else { None }
    }

    /// Finds a_ref of the normals.
    #[inline(always)]
    fn drive(&mut self, recipe: &Recipe, velocity: &Motion) {
        for i in 0..L {
            let [approach, ..] = velocity.at(lane(&self.arm, i));
            self.reference[i] = recipe.reference(self.impedance[i], self.dist[i], approach);
        }
    }

    /// Finds 1/λ of the sliding rows.
    #[inline(always)]
    fn stiffen(&mut self, body: &Body) {
        let ([[nn, ns, nt], [_, ss, st], [_, _, tt]], m) = (body.w, body.inverse_mass);
        for i in 0..L {
            let [x, y, z] = lane(&self.arm, i);
            let own_s = m + z * (z * nn - 2.0 * x * nt) + x * x * tt;
            let own_t = m + y * (y * nn - 2.0 * x * ns) + x * x * ss;
            let off = z * (x * ns - y * nn) + x * (y * nt - x * st);
            self.stiff[i] = 1.0 / largest_eigenvalue(own_s, own_t, off);
        }
    }

    /// Finds the normal forces, friction given; none of them acts yet. Returns the number of systems solved.
    #[inline(always)]
    fn solve_normals(
        &mut self,
        body: &Body,
        factor: &Option<AllPush<L>>,
        acc: &Motion,
        solver: &mut Complementarity,
    ) -> usize {
        let mut b = [0.0; L];
        for i in 0..L {
            b[i] = self.reference[i] - acc.at(lane(&self.arm, i))[0];
        }
        if let Some(f) = factor.as_ref().and_then(|factor| factor.forces(&b)) {
            self.force[0] = f;
            return 1;
        }
        let n = self.n;
        let mut dense = [[0.0; L]; L];
        let dense = &mut dense.as_flattened_mut()[..n * n];
        for (k, element) in dense.iter_mut().enumerate() {
            *element = self.element(body, k / n, k % n);
        }
        solver.solve(Matrix::Dense(dense), &b[..n], &mut self.force[0][..n], false)
    }

    /// Whether any contact pushes that did not in the last step.
    #[inline(always)]
    fn any_starts(&self) -> bool {
        (0..L).fold(false, |any, i| any | (self.before[i] == 0.0) & (self.force[0][i] > 0.0))
    }

    /// Lets the normal forces act, times `sign`.
    #[inline(always)]
    fn push_normals(&self, body: &Body, sign: f64, acc: &mut Motion) {
        let (f, [_, y, z]) = (&self.force[0], &self.arm);
        acc.linear[0] += sign * total(f) * body.inverse_mass;
        let (s, t) = (sign * product(f, z), sign * product(f, y));
        for k in 0..3 {
            acc.angular[k] += s * body.w[k][1] - t * body.w[k][2];
        }
    }

    /// Lets the friction forces act.
    #[inline(always)]
    fn push_friction(&self, body: &Body, acc: &mut Motion) {
        if DIM >= 3 {
            self.push_sliding(body, &self.force[1], &self.force[2], acc);
        }
        for k in 3..DIM {
            acc.turn(total(&self.force[k]), &body.w[k - 3]);
        }
    }

    /// Lets forces along s and t act at the contacts.
    #[inline(always)]
    fn push_sliding(&self, body: &Body, f: &[f64; L], g: &[f64; L], acc: &mut Motion) {
        let [x, y, z] = &self.arm;
        acc.linear[1] += total(f) * body.inverse_mass;
        acc.linear[2] += total(g) * body.inverse_mass;
        let n: [f64; L] = std::array::from_fn(|i| y[i] * g[i] - z[i] * f[i]);
        let torque = [total(&n), product(x, g), product(x, f)];
        for (acc, w) in acc.angular.iter_mut().zip(&body.w) {
            *acc += torque[0] * w[0] - torque[1] * w[1] + torque[2] * w[2];
        }
    }

    /// Lets friction at contact i oppose the slip, the normal given. Rolling and spinning first: sliding has the last
    /// word.
    #[inline(always)]
    fn slip(&mut self, i: usize, method: &Method, recipe: &Recipe, body: &Body, drift: &Motion, acc: &mut Motion) {
        let (spin, turn) = (&drift.angular, &acc.angular);
        if DIM >= 6 {
            let along = [turn[1], turn[2]];
            let [f, g] = self.change::<2, 4>(i, method, recipe, body.stiff[1], [spin[1], spin[2]], along);
            acc.turn(f, &body.w[1]);
            acc.turn(g, &body.w[2]);
        }
        if DIM >= 4 {
            let [f] = self.change::<1, 3>(i, method, recipe, body.stiff[0], [spin[0]], [acc.angular[0]]);
            acc.turn(f, &body.w[0]);
        }
        if DIM >= 3 {
            let [x, y, z] = lane(&self.arm, i);
            let ([_, s, t], [_, drift_s, drift_t]) = (acc.at([x, y, z]), drift.at([x, y, z]));
            let [f, g] = self.change::<2, 1>(i, method, recipe, self.stiff[i], [drift_s, drift_t], [s, t]);
            acc.linear[1] += f * body.inverse_mass;
            acc.linear[2] += g * body.inverse_mass;
            acc.turn(y * g - z * f, &body.w[0]);
            acc.turn(-x * g, &body.w[1]);
            acc.turn(x * f, &body.w[2]);
        }
    }

    /// Lets all contacts slide at once, if none of them sticks: while each has all the friction it can have, none has to
    /// wait for what the others leave, and the numbers of all lie side by side. Returns whether they do.
    ///
    ///     f ← μ f_n g / |g|,   g = f − s / (h λ)      N, with s/h = drift + acceleration (m/s²), as in [`friction`]
    ///
    /// Looks closer only where the first one slid in the last step.
    #[inline(always)]
    fn slide_at_once(
        &mut self,
        method: &Method,
        recipe: &Recipe,
        body: &Body,
        drift: &Motion,
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
        let slip = Motion {
            linear: std::array::from_fn(|k| drift.linear[k] + acc.linear[k]),
            angular: std::array::from_fn(|k| drift.angular[k] + acc.angular[k]),
        };
        let (mut f, mut g, mut share) = ([0.0; L], [0.0; L], [0.0; L]);
        for i in 0..L {
            let [_, s, t] = slip.at(lane(&self.arm, i));
            f[i] = self.force[1][i] - s * self.stiff[i];
            g[i] = self.force[2][i] - t * self.stiff[i];
            share[i] = share2(f[i], g[i]);
        }
        if (0..self.n).any(|i| share[i] <= normal[i] * normal[i]) {
            return false;
        }
        for i in 0..L {
            // Empty lanes have no normal force.
            let share = share[i].max(f64::MIN_POSITIVE);
            let scale = normal[i] / share * share.sqrt();
            (f[i], g[i]) = (f[i] * scale, g[i] * scale);
        }
        let last = [self.force[1], self.force[2]];
        (self.force[1], self.force[2]) = (f, g);
        let change = |new: &[f64; L], last: &[f64; L]| std::array::from_fn(|i| new[i] - last[i]);
        self.push_sliding(body, &change(&f, &last[0]), &change(&g, &last[1]), acc);
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
    fn at(&self, [x, y, z]: Three) -> Three {
        let (v, w) = (self.linear, self.angular);
        [v[0] + w[1] * z - w[2] * y, v[1] + w[2] * x - w[0] * z, v[2] + w[0] * y - w[1] * x]
    }

    #[inline(always)]
    fn times(&self, s: f64) -> Motion {
        Motion { linear: self.linear.map(|x| x * s), angular: self.angular.map(|x| x * s) }
    }

    /// Adds `f` times `turn`.
    #[inline(always)]
    fn turn(&mut self, f: f64, turn: &Three) {
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

/// x · y
#[inline(always)]
fn product<const L: usize>(x: &[f64; L], y: &[f64; L]) -> f64 {
    total(&std::array::from_fn::<_, L, _>(|i| x[i] * y[i]))
}

/// The three numbers of contact i.
#[inline(always)]
fn lane<const L: usize>(x: &[[f64; L]; 3], i: usize) -> Three {
    [x[0][i], x[1][i], x[2][i]]
}
