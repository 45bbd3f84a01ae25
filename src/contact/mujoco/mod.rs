//! MuJoCo's contact model: soft constraints, posed as a convex problem and solved by Newton's method.
//!
//!     a = argmin ½ (a − a₀)ᵀ M (a − a₀) + Σ s(J a − a_ref)
//!
//! [`coefficients`] says what each constraint asks for, [`cost`](super::cost) what it costs to deny it,
//! [`newton`] finds the accelerations that cost least.
//!
//! With `tolerance` 0 accelerations and the forces of each contact are MuJoCo's to rounding.
//!
//! Source: MuJoCo 4.0 manual, Computation › Constraint model and Constraint solver; formulas re-checked against
//! 4.0.0 by running it.

pub(crate) mod coefficients;
pub mod efc;

use super::cost::Kind;
use super::describe::{self, Description};
use super::impedance;
use super::island::{Island, Source};
use super::newton::{self, Constraint, Stop};
use super::per_mix::PerMix;
use super::{Law, Lever, Task};
use crate::data::{JointRow, JointRowKind, Outcome, Scratchpad};
use crate::model::Model;
use crate::state::Start;
use coefficients::Coefficients;

/// The record.
pub static LAW: Law = Law {
    name: "mujoco",
    about: "MuJoCo's soft constraints: the same forces as MuJoCo to rounding, by Newton's method on a convex problem",
    joints: true,
    start: Start::Acceleration,
    lever: Lever::Midpoint,
    solve,
    pose: Some(pose),
    shortcut: None,
    friction: |_, mix| mix.friction,
    describe: |ask| Description { creep: Some(describe::soft_creep(ask)), ..describe::soft(ask) },
    unlike: None,
};

fn solve(task: &Task, own: &mut Scratchpad, island: &mut Island) -> Outcome {
    pose(task, own, island);
    island.guess(task.model, task.data, &task.state.qacc_warmstart);
    newton::minimise(task, island, &stop(task.model))
}

/// Turns the island's constraints into terms of the convex problem.
fn pose(task: &Task, own: &mut Scratchpad, island: &mut Island) {
    let coefficients = own.get::<PerMix<Coefficients>>().of(task, Coefficients::new);
    for i in 0..island.sources.len() {
        match island.sources[i] {
            Source::Contact(index) => {
                let contact = &task.data.contacts[index];
                let own = &coefficients[contact.mix as usize];
                let inverse = if task.model.opt.flags.diagexact {
                    own.exact(|e| island.inverse_mass(i, e))
                } else {
                    coefficients::inverse_mass(task.model, contact)
                };
                own.fill(contact.dist, inverse, &mut island.constraints[i]);
                if own.switches_on(contact.dist) {
                    own.switch_on(contact.dist, &mut island.constraints[i]);
                }
            }
            Source::Joint(index) => joint(&task.data.joint_rows[index], &mut island.constraints[i]),
        }
    }
}

/// A joint limit or dry friction:
///
///     limit:         x = J q̈ + B v + K d(r) r,   pushes only
///     dry friction:  x = q̈ + B q̇,                with no more than its largest force
///
/// Source: MuJoCo 4.0 manual, Computation › Constraint model.
pub fn joint(row: &JointRow, c: &mut Constraint) {
    c.cone.kind = if row.kind == JointRowKind::DryFriction { Kind::Dry } else { Kind::OneSided };
    c.cone.d[0] = 1.0 / impedance::regularisation(row.impedance, row.inverse);
    c.cone.mu[0] = row.loss;
    c.bias[0] = -row.reference.acceleration(row.impedance, row.violation, c.velocity[0]);
}

/// When to stop: what the scene says.
fn stop(model: &Model) -> Stop {
    let opt = &model.opt;
    Stop { tolerance: opt.tolerance, iterations: opt.iterations, warm: opt.flags.warmstart }
}
