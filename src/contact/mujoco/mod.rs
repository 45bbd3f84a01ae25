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

mod ball;
pub(crate) mod coefficients;
pub mod efc;
mod noslip;
mod steady;

use super::cost::Kind;
use super::describe::{self, Ask, Description};
use super::impedance;
use super::island::{Island, Source};
use super::islands;
use super::newton::{self, Constraint, Stop};
use super::per_mix::PerMix;
use super::{Balls, Law, Lever, Task};
use crate::data::{JointRow, JointRowKind, Outcome, Scratchpad, Tie, TieKind};
use crate::model::Model;
use crate::state::Start;
use coefficients::Coefficients;

/// The record.
pub static LAW: Law = Law {
    name: "mujoco",
    about: "MuJoCo's soft constraints: the same forces as MuJoCo to rounding, by Newton's method on a convex problem",
    joints: true,
    start: Start::Acceleration,
    by_timestep: false,
    nearer: "the `iterations` and `tolerance` of the scene's `<option>` say when Newton's method ends",
    lever: Lever::Midpoint,
    solve,
    pose: Some(pose),
    shortcut: Some(|task, own, bodies, contacts, room| {
        if task.model.opt.noslip_iterations > 0 {
            return None;
        }
        steady::steady(task, own.get::<PerMix<Coefficients>>().of(task, Coefficients::new), bodies, contacts, room)
    }),
    balls: Some(Balls {
        has: ball::has,
        solve: |task, own, alone, contacts, room| {
            let coefficients = own.get::<PerMix<Coefficients>>().of(task, Coefficients::new);
            islands::push_each(alone, coefficients, contacts, room, |own, alone, c| ball::push(task, own, alone, c));
        },
    }),
    friction: |_, mix| mix.friction,
    describe,
    unlike: None,
};

fn describe(ask: &Ask) -> Description {
    // How far sweeps without regularisation come, no formula says.
    let creep = (ask.model.opt.noslip_iterations == 0).then(|| describe::soft_creep(ask));
    Description { creep, ..describe::soft(ask) }
}

fn solve(task: &Task, own: &mut Scratchpad, island: &mut Island) -> Outcome {
    pose(task, own, island);
    let stop = stop(task.model);
    if stop.warm {
        island.guess(task.model, task.data, &task.state.qacc_warmstart);
    }
    let outcome = newton::minimise(task, island, &stop);
    if task.model.opt.noslip_iterations > 0 {
        noslip::sweep(task, island);
    }
    outcome
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
                let Constraint { velocity, cone, bias, .. } = &mut island.constraints[i];
                own.fill(contact.dist, inverse, velocity, cone, bias);
                if own.switches_on(contact.dist) {
                    own.switch_on(contact.dist, &mut island.constraints[i]);
                }
            }
            Source::Joint(index) => {
                joint(&task.data.joint_rows[index], &mut island.constraints[i]);
                soften_exactly(task, island, i, task.data.joint_rows[index].impedance);
            }
            Source::Tie(index) => {
                tie(&task.data.ties[index], &mut island.constraints[i]);
                soften_exactly(task, island, i, task.data.ties[index].impedance);
            }
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

/// An equality, or a limit or the dry friction of a tendon:
///
///     equality:      x = J q̈ + J̇ q̇ + B v + K d(r) r,   pushes and pulls; d of the norm of all rows' r
///     the others:    as of joints
pub fn tie(tie: &Tie, c: &mut Constraint) {
    c.cone.kind = match tie.kind {
        TieKind::Equality => Kind::TwoSided,
        TieKind::DryFriction => Kind::Dry,
        TieKind::LowerLimit | TieKind::UpperLimit => Kind::OneSided,
    };
    for k in 0..tie.dim {
        c.cone.d[k] = 1.0 / impedance::regularisation(tie.impedance, tie.inverse[k / 3]);
        c.bias[k] = tie.drift[k] - tie.reference.acceleration(tie.impedance, tie.violation[k], c.velocity[k]);
    }
    c.cone.mu[0] = tie.loss;
}

/// With `diagexact` the regularisation of a joint's or tendon's rows, or of an equality's, is that of their own J M⁻¹ Jᵀ.
pub fn soften_exactly(task: &Task, island: &mut Island, i: usize, impedance: f64) {
    if task.model.opt.flags.diagexact {
        for k in 0..island.constraints[i].cone.dim {
            let inverse = island.inverse_mass_of_row(i, k);
            island.constraints[i].cone.d[k] = 1.0 / impedance::regularisation(impedance, inverse);
        }
    }
}

/// When to stop: what the scene says.
fn stop(model: &Model) -> Stop {
    let opt = &model.opt;
    Stop { tolerance: opt.tolerance, iterations: opt.iterations, warm: opt.flags.warmstart }
}
