//! Laws in which each contact point pushes by itself: depth and rates in, force out.
//!
//! Such a law needs no more than a formula; [`solve`] does the rest of [`super::Law::solve`] for it.

use super::rows::NONE;
use super::surface_points;
use crate::data::{Contact, Data};
use crate::model::{Mix, Model};
use crate::state::State;

/// One contact point that is in touch, as a formula sees it.
#[derive(Clone, Copy, Debug)]
pub struct Point<'a> {
    pub contact: &'a Contact,
    pub mix: &'a Mix,
    /// d, m; above 0.
    pub depth: f64,
    /// Velocities along the contact's directions: separation and two of slip at the touching surface, m/s; spin about
    /// the normal and two of roll, rad/s. Beyond condim they are 0.
    pub velocity: [f64; 6],
    /// MuJoCo's estimate of the pair's inverse mass, 1/kg.
    pub inverse_mass: f64,
}

/// Asks `force` for the force of each contact point, and lets all of them act.
///
/// In:     the force on geom 1 along the contact's directions: normal, two tangential, N; torsional, two rolling, N m.
///         Entries beyond condim do not act.
/// Reads:  contacts, movers, qacc_smooth. Writes: qacc, qfrc_constraint, the forces of the contacts.
pub fn solve(model: &Model, state: &State, data: &mut Data, force: impl Fn(&Point) -> [f64; 6]) {
    let mut rows = std::mem::take(&mut data.rows);
    rows.begin(model);
    data.qacc.copy_from_slice(&data.qacc_smooth);
    data.qfrc_constraint.fill(0.0);
    for c in 0..data.contacts.len() {
        let contact = data.contacts[c];
        let mix = &model.mixes[contact.mix as usize];
        let depth = -contact.dist;
        let dim = if depth > 0.0 { mix.condim } else { 0 };
        rows.push(model, &state.qvel, data, &contact, dim, surface_points(&contact, model));
        data.counts.rows += dim;
        if dim == 0 || rows.contacts[c].parts[0].tree == NONE {
            continue;
        }
        let inverse_mass = contact.body.iter().map(|&b| model.bodies[b as usize].invweight0[0]).sum();
        let velocity = rows.velocities(c);
        let mut force = force(&Point { contact: &contact, mix, depth, velocity, inverse_mass });
        force[dim..].fill(0.0);
        rows.push_forces(c, 0, &force[..dim]);
        data.contacts[c].force = force;
    }
    rows.finish(model, data);
    data.rows = rows;
}
