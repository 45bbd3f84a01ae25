//! The last step's acceleration, tried on free bodies: mostly it is still good enough.
//!
//! It is what [`newton::minimise`](crate::contact::newton::minimise) does with a warm start, found without rows and without a
//! matrix ([`crate::contact::free_bodies`]). What it does not accept is solved the general way; a test compares the two. Worth
//! it (times MuJoCo's speed with it and without): a box at rest 11.4 and 6.6, a T at rest 10.6 and 5.7, a stack of ten boxes at rest
//! 5.8 and 3.7.

use super::{Coefficients, stop};
use crate::contact::cost::{Cone, Kind, Spread};
use crate::contact::free_bodies::{FreeBodies, Room, first, second};
use crate::contact::mujoco::coefficients::inverse_mass;
use crate::contact::{Task, newton, unit_mass};
use crate::data::Contact;
use crate::math::{Vec3, Vec6};

/// Calls a function of DIM rows with those of a contact.
macro_rules! by_condim {
    ($condim:expr, $function:ident::<$two:ident>($($argument:expr),*)) => {
        match $condim {
            1 => $function::<1, $two>($($argument),*),
            3 => $function::<3, $two>($($argument),*),
            4 => $function::<4, $two>($($argument),*),
            _ => $function::<6, $two>($($argument),*),
        }
    };
}

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
    if bodies.single(contacts).is_some() {
        tried::<false>(task, coefficients, bodies, contacts, room, stop.tolerance)
    } else {
        tried::<true>(task, coefficients, bodies, contacts, room, stop.tolerance)
    }
}

/// [`steady`] of one body and one manifold, or, with SEVERAL, of more.
#[inline(always)]
fn tried<const SEVERAL: bool>(
    task: &Task,
    coefficients: &[Coefficients],
    bodies: &FreeBodies,
    contacts: &mut [Contact],
    room: &mut Room,
    tolerance: f64,
) -> Option<f64> {
    let Room { acceleration, pushed, manifolds, tried, .. } = room;
    for &t in bodies.trees {
        acceleration[t] = last(task, t)?;
        pushed[t] = Vec6::zeros();
    }
    manifolds.clear();
    tried.clear();
    let mut rest = bodies.contacts;
    while !rest.is_empty() {
        let which = if SEVERAL { FreeBodies::manifold(rest, contacts) } else { rest };
        rest = &rest[which.len()..];
        manifolds.push(which.len());
        let mix = contacts[which[0]].mix as usize;
        let own = &coefficients[mix];
        let (at, add) = (|t: usize| &acceleration[t], |t: usize, a: Vec6| pushed[t] += a);
        by_condim!(task.model.mixes[mix].condim, push::<SEVERAL>(task, own, which, contacts, at, add, tried));
    }
    let mut gradient = Gradient::default();
    for &t in bodies.trees {
        pushed[t] = acceleration[t] - task.data.movers[task.model.trees[t].bodies.start].acc - pushed[t];
        gradient.add(task, t, &pushed[t]);
    }
    let residual = gradient.residual(tolerance)?;
    if residual > newton::LEFT * tolerance {
        lean::<SEVERAL>(task, coefficients, bodies, contacts, room, gradient.square);
    }
    Some(residual)
}

/// What [`newton::minimise`] does with a warm start that is good enough. In: the gradient's square.
#[cold]
fn lean<const SEVERAL: bool>(
    task: &Task,
    coefficients: &[Coefficients],
    bodies: &FreeBodies,
    contacts: &[Contact],
    room: &mut Room,
    square: f64,
) {
    let Room { acceleration, pushed: off, manifolds, tried, .. } = room;
    let (mut second, mut rest, mut tried) = (0.0, bodies.contacts, &tried[..]);
    for &count in &*manifolds {
        let (which, here) = (rest.split_off(..count), tried.split_off(..count));
        let (Some(which), Some(here)) = (which, here) else { break };
        let mix = contacts[which[0]].mix as usize;
        second += by_condim!(
            task.model.mixes[mix].condim,
            bent::<SEVERAL>(task, &coefficients[mix], which, contacts, off, here)
        );
    }
    for &t in bodies.trees {
        acceleration[t] -= off[t] * (square / (square + second));
    }
}

/// Second derivative of the cost of a manifold of contacts along a change of its bodies' accelerations.
fn bent<const DIM: usize, const TWO: bool>(
    task: &Task,
    own: &Coefficients,
    which: &[usize],
    contacts: &[Contact],
    change: &[Vec6],
    tried: &[(f64, Spread)],
) -> f64 {
    let one = first::<DIM>(task, &contacts[which[0]]);
    let other = if TWO { second::<DIM>(task, &contacts[which[0]]) } else { None };
    let sides = [Some(one), other];
    let moved = sides.each_ref().map(|side| side.as_ref().map(|side| (side, side.motion(&change[side.tree]))));
    let (mut cone, mut y) = (Cone { dim: DIM, ..Cone::default() }, [0.0; 10]);
    let along = |(&c, (stiff, x)): (&usize, &(f64, Spread))| {
        let mut sum = [0.0; 6];
        for (side, motion) in moved.iter().flatten() {
            let product = motion.along(&side.arm(&contacts[c]));
            (0..6).for_each(|k| sum[k] += product[k]);
        }
        own.shape(*stiff, &mut cone);
        cone.spread(&sum, &mut y);
        cone.along(x, &y, 0.0).1
    };
    which.iter().zip(tried).map(along).sum()
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
    /// Adds a body. In: a − a₀ − M⁻¹ Jᵀ f.
    #[inline(always)]
    fn add(&mut self, task: &Task, t: usize, off: &Vec6) {
        let tree = &task.model.trees[t];
        let mover = &task.data.movers[tree.bodies.start];
        let mass = match &tree.free {
            Some(free) => Vec6::new(free.mass, free.mass, free.mass, free.inertia.x, free.inertia.y, free.inertia.z),
            None => mover.minv.map(|minv| if minv > 0.0 { 1.0 / minv } else { 0.0 }),
        };
        self.trace += mass.sum();
        self.square += off.component_mul(&mass).dot(off);
    }

    /// The residual, if it is within the tolerance.
    #[inline(always)]
    fn residual(&self, tolerance: f64) -> Option<f64> {
        let residual = (self.square / self.trace).sqrt();
        (residual < tolerance).then_some(residual)
    }
}

/// Finds the forces of a manifold of contacts of DIM rows at the accelerations of its bodies, and adds what they do. `TWO`: it may be
/// that two of them move.
fn push<'a, const DIM: usize, const TWO: bool>(
    task: &Task,
    own: &Coefficients,
    which: &[usize],
    contacts: &mut [Contact],
    acceleration: impl Fn(usize) -> &'a Vec6,
    mut add: impl FnMut(usize, Vec6),
    tried: &mut Vec<(f64, Spread)>,
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
        tried.push((cone.d[0], x));
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
