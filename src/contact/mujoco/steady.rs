//! The last step's acceleration, tried on free bodies: mostly it is still good enough.
//!
//! It is what [`newton::minimise`](crate::contact::newton::minimise) does with a warm start, found without rows and without a
//! matrix ([`crate::contact::free_bodies`]). What it does not accept is solved the general way; a test compares the two. Worth
//! it (times MuJoCo's speed with it and without): a sphere that rolls 9.2 and 6.5, a box at rest 7.5 and 4.9, a T at rest 7.4
//! and 4.6, a stack of ten boxes at rest 4.7 and 3.6.

use super::{Coefficients, stop};
use crate::contact::cost::{Cone, Kind};
use crate::contact::free_bodies::{FreeBodies, Room, first, second};
use crate::contact::mujoco::coefficients::inverse_mass;
use crate::contact::{Task, unit_mass};
use crate::data::Contact;
use crate::math::{Vec3, Vec6};

/// Whether the last step's accelerations are good enough: then they are in the room, and this is the residual. Writes the
/// contacts' forces.
pub fn steady(
    task: &Task,
    coefficients: &[Coefficients],
    bodies: &FreeBodies,
    contacts: &mut [Contact],
    room: &mut Room,
) -> Option<f64> {
    let Task { model, settings, .. } = *task;
    let stop = stop(model);
    if !stop.warm || stop.tolerance == 0.0 || model.opt.flags.diagexact || settings.implicit {
        return None;
    }
    let Room { acceleration, pushed, .. } = room;
    let mut gradient = Gradient::default();
    if let Some(t) = bodies.single(contacts) {
        let guess = last(task, t)?;
        let mut only = Vec6::zeros();
        push::<false>(task, coefficients, bodies.contacts, contacts, |_| &guess, |_, a| only = a);
        gradient.add(task, t, &guess, &only);
        acceleration[t] = guess;
        return gradient.residual(stop.tolerance);
    }
    for &t in bodies.trees {
        acceleration[t] = last(task, t)?;
        pushed[t] = Vec6::zeros();
    }
    let mut rest = bodies.contacts;
    while !rest.is_empty() {
        let which = FreeBodies::manifold(rest, contacts);
        rest = &rest[which.len()..];
        push::<true>(task, coefficients, which, contacts, |t| &acceleration[t], |t, a| pushed[t] += a);
    }
    for &t in bodies.trees {
        gradient.add(task, t, &acceleration[t], &pushed[t]);
    }
    gradient.residual(stop.tolerance)
}

/// The last step's acceleration, of the mover.
fn last(task: &Task, t: usize) -> Option<Vec6> {
    let tree = &task.model.trees[t];
    let guess = &task.state.qacc_warmstart[tree.dofs.clone()];
    match &tree.free {
        Some(free) => Some(unit_mass::acceleration_of_mover(t, free, tree, task.data, guess).into()),
        None => Some(task.data.plan.uncoupled[t].as_ref()?.motion(guess)),
    }
}

/// The gradient M (a − a₀) − Jᵀ f.
#[derive(Default)]
struct Gradient {
    /// Trace of M, kg.
    trace: f64,
    /// Its square in coordinates of unit mass.
    square: f64,
}

impl Gradient {
    /// Adds a body with its acceleration a and with M⁻¹ Jᵀ f.
    #[inline(always)]
    fn add(&mut self, task: &Task, t: usize, a: &Vec6, pushed: &Vec6) {
        let tree = &task.model.trees[t];
        let mover = &task.data.movers[tree.bodies.start];
        let mass = match &tree.free {
            Some(free) => Vec6::new(free.mass, free.mass, free.mass, free.inertia.x, free.inertia.y, free.inertia.z),
            None => mover.minv.map(|minv| if minv > 0.0 { 1.0 / minv } else { 0.0 }),
        };
        let off = a - mover.acc - pushed;
        self.trace += mass.sum();
        self.square += off.component_mul(&mass).dot(&off);
    }

    /// The residual, if it is within the tolerance.
    #[inline(always)]
    fn residual(&self, tolerance: f64) -> Option<f64> {
        let residual = (self.square / self.trace).sqrt();
        (residual < tolerance).then_some(residual)
    }
}

/// Finds the forces of a manifold of contacts at the accelerations of its bodies, and adds what they do. `TWO`: it may be that two
/// of them move.
#[inline(always)]
fn push<'a, const TWO: bool>(
    task: &Task,
    coefficients: &[Coefficients],
    which: &[usize],
    contacts: &mut [Contact],
    acceleration: impl Fn(usize) -> &'a Vec6,
    add: impl FnMut(usize, Vec6),
) {
    let mix = contacts[which[0]].mix as usize;
    let own = &coefficients[mix];
    match task.model.mixes[mix].condim {
        1 => push_rows::<1, TWO>(task, own, which, contacts, acceleration, add),
        3 => push_rows::<3, TWO>(task, own, which, contacts, acceleration, add),
        4 => push_rows::<4, TWO>(task, own, which, contacts, acceleration, add),
        _ => push_rows::<6, TWO>(task, own, which, contacts, acceleration, add),
    }
}

/// [`push`] for contacts of DIM rows.
fn push_rows<'a, const DIM: usize, const TWO: bool>(
    task: &Task,
    own: &Coefficients,
    which: &[usize],
    contacts: &mut [Contact],
    acceleration: impl Fn(usize) -> &'a Vec6,
    mut add: impl FnMut(usize, Vec6),
) {
    let one = first::<DIM>(task, &contacts[which[0]]);
    let other = if TWO { second::<DIM>(task, &contacts[which[0]]) } else { None };
    let [vel, acc] = [one.motion(&one.mover.vel), one.motion(acceleration(one.tree))];
    let other_motions = other.as_ref().map(|o| [o.motion(&o.mover.vel), o.motion(acceleration(o.tree))]);
    let (mut cone, mut bias, mut x) = (Cone { dim: DIM, ..Cone::default() }, [0.0; 6], [0.0; 10]);
    let (mut total, mut torque, mut other_torque) = (Vec3::zeros(), Vec3::zeros(), Vec3::zeros());
    for &c in which {
        let c = &mut contacts[c];
        let arm = one.arm(c);
        let (mut v, mut a) = (vel.along(&arm), acc.along(&arm));
        let mut other_arm = Vec3::zeros();
        if let (Some(other), Some([vel, acc])) = (&other, &other_motions) {
            other_arm = other.arm(c);
            let (more_v, more_a) = (vel.along(&other_arm), acc.along(&other_arm));
            (0..6).for_each(|k| (v[k], a[k]) = (v[k] + more_v[k], a[k] + more_a[k]));
        }
        own.fill(c.dist, inverse_mass(task.model, c), &v, &mut cone, &mut bias);
        cone.spread(&std::array::from_fn(|k| a[k] + bias[k]), &mut x);
        // They are found anew where they are not accepted.
        let force = &mut c.force;
        if cone.kind == Kind::Pyramid {
            // As `cost`, but with a number of edges that the compiler knows.
            cone.cost_of_pyramid(&x, force);
        } else {
            cone.cost(&x, force);
        }
        let (f, about) = (Vec3::new(force[0], force[1], force[2]), Vec3::new(force[3], force[4], force[5]));
        total += f;
        torque += arm.cross(&f) + about;
        if other.is_some() {
            other_torque += other_arm.cross(&f) + about;
        }
    }
    add(one.tree, one.acceleration(&total, &torque));
    if let Some(other) = &other {
        add(other.tree, other.acceleration(&total, &other_torque));
    }
}
