//! Laws in which each contact point pushes by itself: depth and rates in, force out.
//!
//! Such a law needs no more than a formula; [`solve`] does the rest of [`super::Law::solve`] for it, [`solve_alone`] of
//! [`super::Law::shortcut`].

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
    /// MuJoCo's estimates of the pair's inverse mass and inertia (`invweight0` of the two bodies), 1/kg, 1/(kg m²).
    pub inverse_mass: f64,
    /// The same for spin, 1/(kg m²).
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

/// [`solve`] for one free body and its contacts with what never moves, for [`super::Law::shortcut`]: Newton and Euler, without
/// rows.
///
///     v_p = σ (v + ω × r, ω),     M⁻¹ Jᵀ (f, τ) = σ (Σ f/m, W Σ (r × f + τ))        as in [`super::single_body`]
///
/// Worth it: nanoseconds a step with rows and without, sphere 304 and 212, box 488 and 326. Out: the acceleration of the mover. Writes: the contacts' forces.
pub fn solve_alone(
    task: &Task,
    tree: usize,
    which: &[usize],
    contacts: &mut [Contact],
    force: impl Fn(&Point) -> [f64; 6],
) -> Vec6 {
    let Task { model, settings, data, .. } = *task;
    let root = model.trees[tree].bodies.start;
    let mover = &data.movers[root];
    let (v, w) = (lin(&mover.vel), mover.axes * ang(&mover.vel));
    let (mut total, mut torque) = (Vec3::zeros(), Vec3::zeros());
    for &c in which {
        let c = &mut contacts[c];
        let dim = model.mixes[c.mix as usize].condim;
        let sign = if c.body[1] as usize == root { 1.0 } else { -1.0 };
        let mut arm = c.pos - mover.com;
        if settings.law.lever == Lever::Surface {
            arm += c.frame.row(0).transpose() * (0.5 * sign * c.dist);
        }
        let slip = c.frame * (v + w.cross(&arm)) * sign;
        let turn = if dim > 3 { c.frame * w * sign } else { Vec3::zeros() };
        let mut velocity = [slip.x, slip.y, slip.z, turn.x, turn.y, turn.z];
        velocity[dim..].fill(0.0);
        c.force = at(task, c, dim, velocity, &force);
        let f = c.frame.tr_mul(&vec3(&c.force)) * sign;
        total += f;
        torque += arm.cross(&f);
        if dim > 3 {
            torque += c.frame.tr_mul(&vec3(&c.force[3..])) * sign;
        }
    }
    mover.acc + join(&total, &mover.axes.tr_mul(&torque)).component_mul(&mover.minv)
}

/// The force of one contact of `dim` rows, none where it does not touch.
#[inline(always)]
fn at(task: &Task, contact: &Contact, dim: usize, velocity: [f64; 6], force: impl Fn(&Point) -> [f64; 6]) -> [f64; 6] {
    if contact.dist >= 0.0 {
        return [0.0; 6];
    }
    let weights = contact.body.map(|b| task.model.bodies[b as usize].invweight0);
    let mut force = force(&Point {
        contact,
        mix: &task.model.mixes[contact.mix as usize],
        depth: -contact.dist,
        velocity,
        inverse_mass: weights[0][0] + weights[1][0],
        inverse_inertia: weights[0][1] + weights[1][1],
    });
    force[dim..].fill(0.0);
    force
}
