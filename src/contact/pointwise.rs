//! Laws in which each contact point pushes by itself: depth and rates in, force out.
//!
//! Such a law needs no more than a formula; [`solve`] does the rest of [`super::Law::solve`] for it, [`solve_free`] of
//! [`super::Law::shortcut`].

use super::free_bodies::{FreeBodies, Room};
use super::impedance::noticeable;
use super::island::{Island, Source};
use super::{Lever, Task};
use crate::data::{Contact, Outcome};
use crate::dynamics::spatial::{ang, join, lin};
use crate::math::{Vec3, Vec6, vec3};
use crate::model::Mix;

/// One contact point that is in touch, as a formula sees it.
#[derive(Clone, Copy, Debug)]
pub struct Point<'a> {
    /// The contact.
    pub contact: &'a Contact,
    /// Its parameters.
    pub mix: &'a Mix,
    /// d, m; above 0.
    pub depth: f64,
    /// Velocities along the contact's directions: separation and two of slip where the law's forces act
    /// ([`super::Lever`]), m/s; spin about the normal and two of roll, rad/s. Beyond condim they are 0.
    pub velocity: [f64; 6],
    /// MuJoCo's estimate of the pair's inverse mass (`invweight0` of the two bodies), where it is one ([`noticeable`]), 1/kg.
    pub inverse_mass: f64,
    /// And for spin, 1/(kg m²).
    pub inverse_inertia: f64,
}

/// Asks `force` for the force of each contact point, and lets all of them act.
///
/// In: the force on geom 1 along the contact's directions: normal, two tangential, N; torsional, two rolling, N m.
///     Entries beyond condim do not act.
pub fn solve(task: &Task, island: &mut Island, force: impl Fn(&Point) -> [f64; 6]) -> Outcome {
    for i in 0..island.sources.len() {
        let (Source::Contact(index), c) = (island.sources[i], &mut island.constraints[i]) else { continue };
        c.force = at(task, &task.data.contacts[index], c.cone.dim, c.velocity, &force);
    }
    island.push_forces()
}

/// [`solve`] for free bodies, for [`super::Law::shortcut`]: Newton and Euler, without rows ([`super::free_bodies`]).
///
///     v_p = Σ σ (v + ω × r, ω),     M⁻¹ Jᵀ (f, τ) = σ (Σ f/m, W Σ (r × f + τ))        over the one or two that move
///
/// Worth it: nanoseconds a step with rows and without, sphere 304 and 212, box 488 and 326. Writes: the contacts' forces, and
/// the accelerations of the movers.
pub fn solve_free(
    task: &Task,
    bodies: &FreeBodies,
    contacts: &mut [Contact],
    room: &mut Room,
    force: impl Fn(&Point) -> [f64; 6],
) {
    let Task { model, settings, data, .. } = *task;
    let mover = |t: usize| &data.movers[model.trees[t].bodies.start];
    bodies.trees.iter().for_each(|&t| room.pushed[t] = Vec6::zeros());
    for &c in bodies.contacts {
        let c = &mut contacts[c];
        let dim = model.mixes[c.mix as usize].condim;
        let trees = c.body.map(|b| model.bodies[b as usize].tree);
        let at_surface = settings.law.lever == Lever::Surface && trees.iter().any(Option::is_none);
        let arm = |side: usize, t: usize| {
            let sign = if side == 1 { 1.0 } else { -1.0 };
            let mut arm = c.pos - mover(t).com;
            if at_surface {
                arm += c.frame.row(0).transpose() * (0.5 * sign * c.dist);
            }
            (sign, arm)
        };
        let mut velocity = [0.0; 6];
        for (side, t) in trees.iter().enumerate().filter_map(|(side, t)| Some((side, (*t)?))) {
            let (sign, arm) = arm(side, t);
            let (v, w) = (lin(&mover(t).vel), mover(t).axes * ang(&mover(t).vel));
            let slip = c.frame * (v + w.cross(&arm)) * sign;
            let turn = if dim > 3 { c.frame * w * sign } else { Vec3::zeros() };
            (0..3).for_each(|k| (velocity[k], velocity[3 + k]) = (velocity[k] + slip[k], velocity[3 + k] + turn[k]));
        }
        velocity[dim..].fill(0.0);
        let own = at(task, c, dim, velocity, &force);
        for (side, t) in trees.iter().enumerate().filter_map(|(side, t)| Some((side, (*t)?))) {
            let (sign, arm) = arm(side, t);
            let f = c.frame.tr_mul(&vec3(&own)) * sign;
            let mut torque = arm.cross(&f);
            if dim > 3 {
                torque += c.frame.tr_mul(&vec3(&own[3..])) * sign;
            }
            room.pushed[t] += join(&f, &torque);
        }
        c.force = own;
    }
    for &t in bodies.trees {
        let (force, mover) = (room.pushed[t], mover(t));
        let turned = join(&lin(&force), &mover.axes.tr_mul(&ang(&force)));
        room.acceleration[t] = mover.acc + turned.component_mul(&mover.minv);
    }
}

/// The force of one contact of `dim` rows, none where it does not touch.
#[inline(always)]
fn at(task: &Task, contact: &Contact, dim: usize, velocity: [f64; 6], force: impl Fn(&Point) -> [f64; 6]) -> [f64; 6] {
    if contact.dist >= 0.0 {
        return [0.0; 6];
    }
    // Of the bodies that touch, which may be welded to those that move.
    let weights = contact.geom.map(|g| task.model.bodies[task.model.geoms[g as usize].body].invweight0);
    let inverse_mass = weights[0][0] + weights[1][0];
    let turned = |side: usize| {
        let lever = contact.pos - task.data.movers[contact.body[side] as usize].com;
        weights[side][1] * lever.norm_squared()
    };
    let mut force = force(&Point {
        contact,
        mix: &task.model.mixes[contact.mix as usize],
        depth: -contact.dist,
        velocity,
        inverse_mass: noticeable(inverse_mass, inverse_mass + turned(0) + turned(1)),
        inverse_inertia: weights[0][1] + weights[1][1],
    });
    force[dim..].fill(0.0);
    force
}
