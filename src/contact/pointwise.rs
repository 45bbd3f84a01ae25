//! Laws in which each contact point pushes by itself: depth and rates in, force out.
//!
//! Such a law needs no more than a formula; [`solve`] does the rest of [`super::Law::solve`] for it.

use super::Task;
use super::island::{Island, Source};
use crate::data::{Contact, Outcome};
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
        let contact = &task.data.contacts[index];
        c.force = [0.0; 6];
        if contact.dist < 0.0 {
            let weights = contact.body.map(|b| task.model.bodies[b as usize].invweight0);
            c.force = force(&Point {
                contact,
                mix: &task.model.mixes[contact.mix as usize],
                depth: -contact.dist,
                velocity: c.velocity,
                inverse_mass: weights[0][0] + weights[1][0],
                inverse_inertia: weights[0][1] + weights[1][1],
            });
            c.force[c.cone.dim..].fill(0.0);
        }
    }
    island.push_forces()
}
