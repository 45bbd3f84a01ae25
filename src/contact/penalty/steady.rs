//! The last step's forces, tried on free bodies: mostly they are still right.
//!
//! Whether they still solve the equations is seen without rows and without a matrix ([`crate::contact::free_bodies`]); the
//! residual is [`mod@super::residual`]'s. What it does not accept is solved the general way; a test compares the two. Worth it
//! (times MuJoCo's speed with it and without): a sphere that rolls 11.6 and 6.5, a box at rest 9.3 and 4.7, the tutorial's disk
//! 10.3 and 5.9, a T at rest 9.5 and 4.2, a stack of ten boxes at rest 4.6 and 3.3.
//!
//! The contacts' numbers lie side by side in arrays of L lanes, so that loops over them have a fixed length and fill vector
//! registers. Lanes beyond the last contact look like it, without force, and do not count.

use std::array::from_fn;

use super::residual::RELAXED;
use super::{Coefficients, SLIP, TOLERANCE};
use crate::contact::Task;
use crate::contact::free_bodies::{FreeBodies, Motion, Room, Side, first, second};
use crate::contact::impedance::{impedance, regularisation};
use crate::data::Contact;
use crate::math::{Vec3, Vec6};

/// Calls a function of DIM rows and L lanes with those that this many contacts of `condim` rows need.
macro_rules! laned {
    ($condim:expr, $count:expr, $function:ident($($argument:expr),*)) => {
        match ($condim, $count) {
            (1, 1) => $function::<1, 1>($($argument),*),
            (1, _) => $function::<1, 8>($($argument),*),
            (3, 1) => $function::<3, 1>($($argument),*),
            (3, 2..=4) => $function::<3, 4>($($argument),*),
            (3, _) => $function::<3, 8>($($argument),*),
            (4, 1) => $function::<4, 1>($($argument),*),
            (4, _) => $function::<4, 8>($($argument),*),
            (_, 1) => $function::<6, 1>($($argument),*),
            (_, 2) => $function::<6, 2>($($argument),*),
            _ => $function::<6, 8>($($argument),*),
        }
    };
}

/// The residual, if the forces that the contacts have solve the equations: then the accelerations of the movers are in the
/// room.
pub fn steady(
    task: &Task,
    coefficients: &[Coefficients],
    bodies: &FreeBodies,
    contacts: &mut [Contact],
    room: &mut Room,
) -> Option<f64> {
    if task.model.opt.flags.diagexact || task.settings.implicit {
        return None;
    }
    if let Some(tree) = bodies.single(contacts) {
        let which = bodies.contacts;
        let mix = contacts[which[0]].mix as usize;
        let condim = task.model.mixes[mix].condim;
        let (acceleration, residual) = laned!(condim, which.len(), tried(task, &coefficients[mix], which, contacts))?;
        room.acceleration[tree] = acceleration;
        return Some(residual);
    }

    of_many(task, coefficients, bodies, contacts, room)
}

/// [`steady`] for several bodies, or manifolds.
#[inline(never)]
fn of_many(
    task: &Task,
    coefficients: &[Coefficients],
    bodies: &FreeBodies,
    contacts: &mut [Contact],
    room: &mut Room,
) -> Option<f64> {
    let of = |which: &[usize], contacts: &[Contact]| {
        let mix = contacts[which[0]].mix as usize;
        (&coefficients[mix], task.model.mixes[mix].condim)
    };
    let root = |t: usize| task.model.trees[t].bodies.start;
    bodies.trees.iter().for_each(|&t| room.acceleration[t] = task.data.movers[root(t)].acc);
    let mut rest = bodies.contacts;
    room.manifolds.clear();
    while !rest.is_empty() {
        let which = FreeBodies::manifold(rest, contacts);
        rest = &rest[which.len()..];
        room.manifolds.push(which.len());
        match of(which, contacts).1 {
            1 => push::<1>(task, which, contacts, &mut room.acceleration),
            3 => push::<3>(task, which, contacts, &mut room.acceleration),
            _ => push::<6>(task, which, contacts, &mut room.acceleration),
        }
    }
    let mut misfit = Misfit::default();
    room.change.clear();
    rest = bodies.contacts;
    for i in 0..room.manifolds.len() {
        let which;
        (which, rest) = rest.split_at(room.manifolds[i]);
        let (own, condim) = of(which, contacts);
        misfit = misfit.and(laned!(condim, which.len(), asked(task, own, which, contacts, room))?);
        if misfit.most > HOPELESS * misfit.size {
            return None;
        }
    }
    let residual = misfit.residual()?;
    for (&c, change) in bodies.contacts.iter().zip(&room.change) {
        (0..6).for_each(|k| contacts[c].force[k] += RELAXED * change[k]);
    }
    Some(residual)
}

/// From here on the other contacts are not looked at: none of them does so much more that this could be within the tolerance. Only
/// work depends on it: a stack of ten that settles takes 60.5 instead of 64.0 million instructions for 200 steps, a falling pile of
/// 100 the same within 0.1 %.
const HOPELESS: f64 = 1e5 * TOLERANCE;

/// The bodies of a manifold that move.
#[inline(always)]
fn bodies<'a, const DIM: usize>(task: &Task<'a>, contact: &Contact) -> impl Iterator<Item = Side<'a>> {
    std::iter::once(first::<DIM>(task, contact)).chain(second::<DIM>(task, contact))
}

/// What the contacts of a manifold do with the forces that they have, added to the accelerations of the movers.
fn push<const DIM: usize>(task: &Task, which: &[usize], contacts: &[Contact], acceleration: &mut [Vec6]) {
    for side in bodies::<DIM>(task, &contacts[which[0]]) {
        let (mut total, mut torque) = (Vec3::zeros(), Vec3::zeros());
        for &c in which {
            let Contact { force, .. } = &contacts[c];
            let f = Vec3::from_fn(|k, _| if k < DIM { force[k] } else { 0.0 });
            total += f;
            torque += side.arm(&contacts[c]).cross(&f);
            (3..DIM).for_each(|k| torque[k - 3] += force[k]);
        }
        acceleration[side.tree] += side.acceleration(&total, &torque);
    }
}

/// How far the forces of a manifold are from what their formulas ask for at the accelerations in the room; `change` gets the
/// differences. `None` where friction has no mass to act on.
fn asked<const DIM: usize, const L: usize>(
    task: &Task,
    own: &Coefficients,
    which: &[usize],
    contacts: &[Contact],
    room: &mut Room,
) -> Option<Misfit> {
    let mut manifold = Manifold::<DIM, L>::new(own, which, contacts);
    let (mut vel, mut acc) = (Seen::default(), Seen::default());
    for side in bodies::<DIM>(task, &contacts[which[0]]) {
        let arm = manifold.add(task, &side, which, contacts);
        vel.add(&side.motion(&side.mover.vel), &arm);
        acc.add(&side.motion(&room.acceleration[side.tree]), &arm);
    }
    let (check, misfit) = manifold.check(own, 1.0 / task.settings.timestep, &vel, &acc)?;
    let change = |i: usize| from_fn(|k| if k < DIM { check.wish[k][i] - manifold.force[k][i] } else { 0.0 });
    room.change.extend((0..manifold.count).map(change));
    Some(misfit)
}

/// The acceleration of a free body's mover and the residual, if the forces of its one manifold, of at most L contacts of DIM
/// rows, solve the equations.
fn tried<const DIM: usize, const L: usize>(
    task: &Task,
    own: &Coefficients,
    which: &[usize],
    contacts: &mut [Contact],
) -> Option<(Vec6, f64)> {
    let body = first::<DIM>(task, &contacts[which[0]]);
    let mut manifold = Manifold::<DIM, L>::new(own, which, contacts);
    let arm = manifold.add(task, &body, which, contacts);
    let force = &manifold.force;

    // What their forces do together.
    let (mut total, mut torque) = (Vec3::zeros(), Vec3::zeros());
    for i in 0..L {
        let f: Vec3 = Vec3::from_fn(|k, _| if k < DIM { force[k][i] } else { 0.0 });
        total += f;
        torque += Vec3::new(arm[0][i], arm[1][i], arm[2][i]).cross(&f);
        (3..DIM).for_each(|k| torque[k - 3] += force[k][i]);
    }
    let acceleration = body.mover.acc + body.acceleration(&total, &torque);
    let (mut vel, mut acc) = (Seen::default(), Seen::default());
    vel.add(&body.motion(&body.mover.vel), &arm);
    acc.add(&body.motion(&acceleration), &arm);

    let (check, misfit) = manifold.check(own, 1.0 / task.settings.timestep, &vel, &acc)?;
    let residual = misfit.residual()?;
    // Part of the way to what was wished for (Jacobi), for the next step: else an error within the tolerance would stay.
    for (i, &c) in which.iter().enumerate().take(L) {
        (0..DIM).for_each(|k| contacts[c].force[k] += (check.wish[k][i] - force[k][i]) / L as f64);
    }
    Some((acceleration, residual))
}

/// Largest difference of a force from what is asked of it, and what it is measured by: m/s².
#[derive(Clone, Copy, Default)]
struct Misfit {
    most: f64,
    size: f64,
}

impl Misfit {
    /// The larger of two; not a number if one is none.
    fn and(self, other: Misfit) -> Misfit {
        let most = if other.most.is_nan() { other.most } else { self.most.max(other.most) };
        Misfit { most, size: self.size.max(other.size) }
    }

    /// The residual, if it is within the tolerance.
    fn residual(&self) -> Option<f64> {
        let Misfit { most, size } = *self;
        if most > TOLERANCE * size || most.is_nan() {
            return None;
        }
        Some(if most == 0.0 { 0.0 } else { most / size })
    }
}

/// Contacts of one frame and one mix, side by side.
struct Manifold<const DIM: usize, const L: usize> {
    count: usize,
    /// r, m, and d(r).
    violation: [f64; L],
    impedance: [f64; L],
    /// The forces that they have: N, N m.
    force: [[f64; L]; DIM],
    /// Inverse masses of normal and sliding, 1/kg, and of spinning and rolling, 1/(kg m²).
    linear: [f64; L],
    sliding: [f64; L],
    angular: [f64; L],
}

impl<const DIM: usize, const L: usize> Manifold<DIM, L> {
    #[inline(always)]
    fn new(own: &Coefficients, which: &[usize], contacts: &[Contact]) -> Self {
        let count = which.len().min(L);
        let (mut violation, mut force) = ([0.0; L], [[0.0; L]; DIM]);
        for i in 0..L {
            let c = &contacts[which[i.min(count - 1)]];
            violation[i] = c.dist - own.margin;
            (0..DIM).for_each(|k| force[k][i] = if i < count { c.force[k] } else { 0.0 });
        }
        // So early because it divides, which the processor does beside all that follows: 3 to 5 % of a step of one body.
        let impedance = violation.map(|r| impedance(&own.solimp, r));
        Manifold { count, violation, impedance, force, linear: [0.0; L], sliding: [0.0; L], angular: [0.0; L] }
    }

    /// Adds the inverse masses of a body. Out: the arms of the contacts from it, by component.
    #[inline(always)]
    fn add(&mut self, task: &Task, side: &Side, which: &[usize], contacts: &[Contact]) -> [[f64; L]; 3] {
        let mut arm = [[0.0; L]; 3];
        for i in 0..L {
            let c = &contacts[which[i.min(self.count - 1)]];
            let r = side.arm(c);
            (0..3).for_each(|k| arm[k][i] = r[k]);
            let geom = &task.model.geoms[c.geom[side.side] as usize];
            let [linear, angular] = task.model.bodies[geom.body].invweight0;
            self.linear[i] += linear;
            self.sliding[i] += linear + angular * (c.pos - side.mover.com).norm_squared();
            self.angular[i] += angular;
        }
        arm
    }

    /// Whether each force is what its formula asks for, at these velocities and accelerations.
    #[inline(always)]
    fn check(
        &self,
        own: &Coefficients,
        per_step: f64,
        vel: &Seen<L>,
        acc: &Seen<L>,
    ) -> Option<(Check<DIM, L>, Misfit)> {
        let Manifold { count, violation: r, impedance: d, force, linear, sliding, angular } = self;
        if linear.contains(&0.0) {
            return None;
        }
        let (v, a) = (&vel.at, &acc.at);
        let reference: [f64; L] = from_fn(|i| own.spring.acceleration(d[i], r[i], v[0][i]));
        let softness: [f64; L] = from_fn(|i| regularisation(d[i], linear[i]) * own.stiffening);

        let mut check = Check { wish: [[0.0; L]; DIM], off: [0.0; L], size: [0.0; L] };
        let x: [f64; L] = from_fn(|i| a[0][i] - reference[i] + softness[i] * force[0][i]);
        check.wish[0] = from_fn(|i| (force[0][i] - x[i] / linear[i]).max(0.0));
        check.off = from_fn(|i| linear[i] * (force[0][i] - check.wish[0][i]).abs());
        check.size = from_fn(|i| (linear[i] * force[0][i].abs()).max(1e-4 * reference[i].abs()));
        if DIM >= 3 {
            let slip = [1, 2].map(|k: usize| from_fn(|i| a[k][i] + per_step * v[k][i]));
            check.friction(own, force, 1, slip, sliding);
        }
        if DIM >= 4 && !angular.contains(&0.0) {
            let turn = acc.angular + vel.angular * per_step;
            check.friction(own, force, 3, [[turn.x; L]], angular);
            if DIM >= 6 {
                check.friction(own, force, 4, [[turn.y; L], [turn.z; L]], angular);
            }
        }
        let mut misfit = Misfit::default();
        for i in 0..*count {
            misfit = misfit.and(Misfit { most: check.off[i], size: check.size[i] });
        }
        Some((check, misfit))
    }
}

/// What the contacts of a manifold see of the bodies' motion: of their surfaces against one another, by component, and of one
/// body turning against the other.
struct Seen<const L: usize> {
    at: [[f64; L]; 3],
    angular: Vec3,
}

impl<const L: usize> Default for Seen<L> {
    fn default() -> Self {
        Seen { at: [[0.0; L]; 3], angular: Vec3::zeros() }
    }
}

impl<const L: usize> Seen<L> {
    /// Adds the motion of a body, seen at these arms.
    #[inline(always)]
    fn add(&mut self, motion: &Motion, [x, y, z]: &[[f64; L]; 3]) {
        let Motion { linear: v, angular: w } = motion;
        for i in 0..L {
            self.at[0][i] += v.x + (w.y * z[i] - w.z * y[i]);
            self.at[1][i] += v.y + (w.z * x[i] - w.x * z[i]);
            self.at[2][i] += v.z + (w.x * y[i] - w.y * x[i]);
        }
        self.angular += w;
    }
}

/// What the contacts' formulas ask for, and how far that is from what they have.
struct Check<const DIM: usize, const L: usize> {
    wish: [[f64; L]; DIM],
    /// λ |f − wish| of each contact, and what it is measured by: m/s², rad/s².
    off: [f64; L],
    size: [f64; L],
}

impl<const DIM: usize, const L: usize> Check<DIM, L> {
    /// A group of N friction rows, from `first` on, with their slips per step and inverse masses λ.
    ///
    /// In slips and forces scaled by the rows' coefficients the limit is a circle.
    #[inline(always)]
    fn friction<const N: usize>(
        &mut self,
        own: &Coefficients,
        force: &[[f64; L]; DIM],
        first: usize,
        slip: [[f64; L]; N],
        inverse: &[f64; L],
    ) {
        let (mu, scale): (f64, [f64; N]) = (own.friction[first - 1], from_fn(|k| own.scale[first - 1 + k]));
        let mobility = inverse.map(|inverse| 1.0 / inverse);
        let scaled: [[f64; L]; N] = from_fn(|k| from_fn(|i| force[first + k][i] / scale[k]));
        let wanted: [[f64; L]; N] =
            from_fn(|k| from_fn(|i| scaled[k][i] * (1.0 - SLIP) - scale[k] * slip[k][i] * mobility[i]));
        let shrink: [f64; L] = from_fn(|i| {
            let (limit, square) = (mu * force[0][i], wanted.iter().map(|w| w[i] * w[i]).sum::<f64>());
            if square > limit * limit { limit / square.sqrt() } else { 1.0 }
        });
        for k in 0..N {
            for i in 0..L {
                let wish = wanted[k][i] * shrink[i];
                self.wish[first + k][i] = scale[k] * wish;
                self.off[i] = self.off[i].max(inverse[i] * (scaled[k][i] - wish).abs());
                self.size[i] = self.size[i].max(1e-4 * slip[k][i].abs());
            }
        }
    }
}
