//! Penny's own law: MuJoCo's spring and damper at each contact, and Coulomb friction that opposes slip.
//!
//! **What it is.** The accelerations a are those that make this sum least,
//!
//!     ½ (a − a₀)ᵀ M (a − a₀)  +  Σ normals 1/(2 R) min(0, J_n a − a_ref)²  +  Σ friction H(J_t a + v_t/h; μ n)
//!
//! with n the normal force that the solution itself has, and the forces are minus the terms' derivatives:
//!
//!     n = max(0, (a_ref − J_n a) / R)              N      spring and damper, pushes only
//!     f = −(J_t a + v_t/h) / (ε λ)  if μ n allows  N      nearly no slip at the end of the step, or else
//!     f = −μ n s/|s|,  s = v_t + h J_t a           N      the limit, against the slip
//!
//! M is the inertia matrix, a₀ the acceleration without constraints, J the constraints' rows, v = J qvel, h the timestep.
//! a_ref = −B v_n − K d r and R = (1 − d)/d A are MuJoCo's ([`super::impedance`]), so that one contact without friction
//! is MuJoCo's; in scenes with a pyramidal cone R is multiplied by μ²(1 + μ²)/(condim − 1), the rest state of its
//! 2 (condim − 1) edges, so that depths at rest are, too. H is Huber's function of the slip, isotropic, so that friction
//! has no preferred direction: quadratic up to the limit, a cone above. Its stiffness 1/(ε λ), ε = 1e-5, leaves a slip of
//! ε λ f h: a box on a slope creeps by 1e-5 g h sin θ. λ is the inverse mass that friction meets, from the bodies'
//! `invweight0`. Spinning (μ_spin, m) and rolling (μ_roll, m) are further groups of friction with limits of their own;
//! friction of unlike coefficients has an elliptic limit and acts along its steepest descent. A joint's limit is a
//! normal, its dry friction a friction whose limit is `frictionloss`. An equality is a normal that pulls as well as it
//! pushes,
//!
//!     f = (a_ref − J a) / R              N      spring and damper of its `solref` and `solimp`, both ways
//!
//! which is MuJoCo's; limits and dry friction of tendons are those of joints.
//!
//! The normals do not feel the slip but through M: sliding contacts do not hop, as MuJoCo's do. Friction acts at the
//! body's own surface ([`Lever::Surface`]).
//!
//! **How it is solved.** The last step's forces are the first guess, and mostly still right: every force is what its formula
//! asks of a = a₀ + M⁻¹ Jᵀ f to [`TOLERANCE`] of the largest ([`mod@residual`]). If they are not, these are tried one after
//! another:
//!
//! 1. [`semismooth::follow`]: on the pieces of the equations that the last step's forces are on (who pushes, who sticks or
//!    slips) they are linear, but for friction that turns. One linear system solves them, and one more for each piece that ends
//!    on the way from the last step to this one.
//! 2. [`semismooth::descend`]: Newton's method, which converges quadratically where friction turns.
//! 3. [`interior`]: an interior-point method, from no forces.
//!
//! [`Method::rounds`](crate::method::Method::rounds) bounds the linear systems; the residual that is left is in
//! `data.solver`.
//!
//! With large friction the equations may have several solutions (Painlevé): which one is found depends on the last step's
//! forces as long as they lead to one. In a dense pile that is being pressed together the rounds may be too few: then the forces
//! are those of the interior-point method that came nearest, within their limits; bodies creep, and the pile settles.
//!
//! **Under an implicit integrator** the law is asked for the forces at a velocity that is already that of the end of the
//! step. There friction depends on this velocity alone,
//!
//!     f = −v_t/(ε h λ) within the limit,   ε = 1e-3        (a body at rest on a slope creeps by ε h g sin θ)
//!
//! and normals switch on over a small depth ([`super::impedance::onset`]).
//!
//! Source: the cost of the normals is MuJoCo's (manual, Computation › Constraint model); friction limited by a normal
//! force that is found along with it: J. Haslinger, "Approximation of the Signorini problem with friction, obeying the
//! Coulomb law", Math. Meth. Appl. Sci. 5 (1983), 422–437.

mod ball;
pub(super) mod interior;
pub mod residual;
mod semismooth;
mod steady;

use super::cost::{GROUPS, Kind};
use super::describe::{self, Creep, Description, Unlike};
use super::impedance::{Reference, clamp, impedance, least_regularisation, noticeable, regularisation, share};
use super::island::{Island, Source};
use super::islands;
use super::mujoco::coefficients::inverse_mass;
use super::newton::{self, Constraint, Stop};
use super::per_mix::PerMix;
use super::{Balls, Law, Lever, Task};
use crate::data::{JointRow, JointRowKind, Outcome, Scratchpad, Tie, TieKind};
use crate::model::{Cone, Mix};
use crate::state::Start;
use residual::{relax, residual};

/// The record.
pub static LAW: Law = Law {
    name: "penalty",
    about: "spring-dampers from solref and solimp, Coulomb friction against the slip; all forces solved together",
    joints: true,
    start: Start::Forces,
    by_timestep: true,
    nearer: "--rounds allows more Newton steps",
    lever: Lever::Surface,
    solve,
    pose: Some(pose),
    shortcut: Some(|task, own, bodies, contacts, room| {
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
    describe: |ask| Description {
        // But for ε, its friction stops the slip at the end of the step.
        creep: Some(if ask.slides(ask.model.mixes[ask.touch.mix].friction[0]) { Creep::Slides } else { Creep::Sticks }),
        ..describe::soft(ask)
    },
    unlike: Some(Unlike {
        normal: |_, _| "friction elsewhere in the island changes them otherwise than in MuJoCo".to_owned(),
        friction: "MuJoCo softens friction (its R) and lets it change the normal force, penalty does neither",
    }),
};

/// Residual at which the forces count as solved, relative to the largest acceleration that a normal force causes.
pub const TOLERANCE: f64 = 1e-11;

/// ε of friction: slip that is left where friction sticks, relative to what the force would do in a step. The smaller, the
/// sharper the kink of the cost between sticking and slipping, on which Newton's method can get stuck. Of 1499 random
/// scenes written in seven ways (tests/it/invariance.rs), this many agree to 1e-9 in the worst of the seven:
///
///     ε         1e-3   1e-5   1e-7   1e-9
///     scenes    1487   1488   1485   1479
///
/// and at 1e-5 a box on a slope creeps by 7e-8 m/s (20°, 2 ms), where MuJoCo's creeps by 1e-3 m/s.
const SLIP: f64 = 1e-5;

/// The same under an implicit integrator.
const IMPLICIT_SLIP: f64 = 1e-3;

/// MuJoCo's estimate of an inverse mass counts as rounding where it is less than this of what friction meets: a centre of mass beside
/// the axle by 3e-4 of the wheel's radius. A wheel of 0.2 m pressed in by 1 cm that should stand turns at these speeds, rad/s,
///
///     beside the axle by, m     1e-6    1e-5    6e-5    1e-4    1e-3    1e-2
///     0                         1e-3    0.6     0.2     0.1     0.01    1e-3
///     1e-7                      1e-10   8e-10   5e-9    0.1     0.01    1e-3
///     1e-5                      1e-10   8e-10   5e-9    8e-9    0.01    1e-3
///
/// and with more of it what is meant to be off its axle would lose MuJoCo's normal force (8e8 N at 1 mm).
const NOTHING: f64 = 1e-7;

/// What all contacts of a mix have in common.
#[derive(Clone, Copy, Debug)]
pub struct Coefficients {
    friction: [f64; 5],
    /// The same, over the first of each group's.
    scale: [f64; 5],
    solimp: [f64; 5],
    spring: Reference,
    margin: f64,
    /// Depth over which it switches on, m.
    onset: f64,
    /// What MuJoCo's pyramid does to R at rest; 1 for other contacts.
    stiffening: f64,
}

impl Coefficients {
    fn new(mix: &Mix, task: &Task, onset: f64) -> Coefficients {
        let opt = &task.model.opt;
        let solimp = clamp(&mix.solimp);
        let mu2 = mix.friction[0] * mix.friction[0];
        let pyramid = opt.cone == Cone::Pyramidal && mix.condim > 1;
        Coefficients {
            friction: mix.friction,
            scale: std::array::from_fn(|k| mix.friction[k] / mix.friction[[0, 0, 2, 3, 3][k]]),
            solimp,
            spring: Reference::new(&mix.solref, &solimp, task.settings.timestep, opt.flags.refsafe),
            margin: mix.margin,
            onset,
            stiffening: if pyramid { mu2 / opt.impratio * (1.0 + mu2) / (mix.condim - 1) as f64 } else { 1.0 },
        }
    }
}

fn solve(task: &Task, own: &mut Scratchpad, island: &mut Island) -> Outcome {
    pose(task, own, island);
    island.constraints.iter_mut().for_each(Constraint::begin);
    let (rounds, implicit) = (task.settings.rounds, task.settings.implicit);
    let mut outcome = Outcome { iterations: 0, residual: residual(island) };
    if outcome.residual <= TOLERANCE {
        relax(&mut island.constraints);
    } else {
        if !implicit {
            outcome = semismooth::follow(task, island, FOLLOW.min(rounds));
            if outcome.residual > TOLERANCE {
                let most = DESCEND.min(rounds - outcome.iterations);
                outcome = outcome.then(semismooth::descend(task, island, outcome.residual, most));
            }
        }
        if outcome.residual > TOLERANCE && outcome.iterations < rounds {
            outcome = outcome.then(interior::solve(task, island, rounds - outcome.iterations));
        }
    }
    // Accelerations are always those that the forces cause, converged or not.
    std::mem::swap(&mut island.w, &mut island.p);
    outcome
}

/// The same forces by [`interior`] alone: another way, for tests to compare with.
pub fn solve_anew(task: &Task, own: &mut Scratchpad, island: &mut Island) -> Outcome {
    pose(task, own, island);
    island.constraints.iter_mut().for_each(Constraint::begin);
    let outcome = interior::solve(task, island, task.settings.rounds);
    std::mem::swap(&mut island.w, &mut island.p);
    outcome
}

/// The forces that make the sum least under the limits of friction that [`solve`] finds, which are those of [`solve`]: the law's
/// definition, for tests to compare with.
pub fn solve_as_defined(task: &Task, own: &mut Scratchpad, island: &mut Island) -> Outcome {
    let outcome = solve(task, own, island);
    island.constraints.iter_mut().for_each(|c| c.cone.limit = c.force[0]);
    newton::minimise(task, island, &Stop { tolerance: 0.0, iterations: task.settings.rounds, warm: true });
    outcome
}

/// Steps in a row of Newton's method on the way of the interior-point method: it is quadratic or of no use.
const MOST: usize = 4;

/// Steps of Newton's method at most, where it begins with the last step's forces. Without a watchdog, in 500 steps of a falling
/// heap of 30 shapes, 12 leave 334 of 6,834 islands to the interior-point method, 25 leave 255 and save 4 % of the linear systems;
/// of a pile that is pressed together they save none.
const DESCEND: usize = 12;

/// Ends of pieces that are passed at most. Of 1,000 steps in which Gymnasium's walker falls and lies 900 pass none, 88 up to
/// three, the others up to seven.
const FOLLOW: usize = 10;

/// The terms of the sum.
fn pose(task: &Task, own: &mut Scratchpad, island: &mut Island) {
    let coefficients = own.get::<PerMix<Coefficients>>().of(task, Coefficients::new);
    for i in 0..island.sources.len() {
        match island.sources[i] {
            Source::Contact(index) => contact(task, coefficients, island, i, index),
            Source::Joint(index) => {
                let row = &task.data.joint_rows[index];
                joint(task, row, &mut island.constraints[i]);
                if row.kind != JointRowKind::DryFriction {
                    super::mujoco::soften_exactly(task, island, i, row.impedance);
                }
            }
            Source::Tie(index) => {
                let row = &task.data.ties[index];
                let there = island.inverse_masses(i)[..3].iter().fold(0.0, |m: f64, x| m.max(*x));
                tie(task, row, noticeable(row.inverse[0], there), &mut island.constraints[i]);
                if row.kind != TieKind::DryFriction {
                    super::mujoco::soften_exactly(task, island, i, row.impedance);
                }
            }
        }
    }
}

/// The terms of one contact.
fn contact(task: &Task, coefficients: &[Coefficients], island: &mut Island, i: usize, index: usize) {
    let Task { model, data, settings, .. } = *task;
    let contact = &data.contacts[index];
    let own = &coefficients[contact.mix as usize];
    let inverse =
        if model.opt.flags.diagexact { island.inverse_mass(i, [1.0, 0.0]) } else { inverse_mass(model, contact) };
    let (mut push, mut spin) = (0.0, 0.0);
    for side in 0..2 {
        let lever = contact.pos - data.movers[contact.body[side] as usize].com;
        let [linear, angular] = model.bodies[model.geoms[contact.geom[side] as usize].body].invweight0;
        push += linear + angular * lever.norm_squared();
        spin += angular;
    }
    let met = noticeable(inverse, push);
    // A wheel on an axle: the normal force moves nothing or little, friction much, and of MuJoCo's estimate there is only rounding.
    // The normal force would be up to 1e16 N, beside which friction is none: it is as soft as for a body that moves along its normal
    // as this one does along the surface.
    let inverse = if inverse < NOTHING * push && island.constraints[i].cone.dim > 1 {
        let rows = island.inverse_masses(i);
        let along = rows[1].max(rows[2]);
        if inverse < NOTHING * along && rows[0] < along { along } else { inverse }
    } else {
        inverse
    };
    let c = &mut island.constraints[i];
    let r = contact.dist - own.margin;
    let d = impedance(&own.solimp, r);
    c.force = contact.force;
    c.cone.kind = Kind::Coulomb;
    c.cone.mu[1..].copy_from_slice(&own.friction);
    let least = least_regularisation(settings.implicit, met);
    c.cone.d[0] = 1.0 / (regularisation(d, inverse) * own.stiffening).max(least);
    c.bias[0] = -own.spring.acceleration(d, r, c.velocity[0]);
    c.inverse = [met, 0.0, 0.0, 0.0];
    if own.onset > -r {
        // A share of the force: of the change that it causes.
        let share = share(-r, own.onset);
        c.bias[0] = share * c.bias[0] - (1.0 - share) * c.smooth[0];
    }
    if c.cone.dim == 1 {
        return;
    }
    c.inverse = [met, push, spin, spin];
    friction(settings.timestep, settings.implicit, 1, c);
}

/// A joint limit or dry friction.
fn joint(task: &Task, row: &JointRow, c: &mut Constraint) {
    super::mujoco::joint(row, c);
    c.inverse[0] = row.inverse;
    c.force[0] = row.force;
    if row.kind == JointRowKind::DryFriction {
        dry(task, row.inverse, c);
    }
}

/// An equality, or a limit or the dry friction of a tendon, of that inverse mass.
fn tie(task: &Task, tie: &Tie, inverse: f64, c: &mut Constraint) {
    super::mujoco::tie(tie, c);
    c.inverse = [inverse, tie.inverse[1], 0.0, 0.0];
    c.force = tie.force;
    if tie.kind == TieKind::DryFriction {
        dry(task, inverse, c);
    }
}

/// Dry friction that stops the motion at the end of the step if its limit allows.
fn dry(task: &Task, inverse: f64, c: &mut Constraint) {
    let (h, implicit) = (task.settings.timestep, task.settings.implicit);
    c.bias[0] = c.velocity[0] / h;
    c.cone.d[0] = 1.0 / (if implicit { IMPLICIT_SLIP } else { SLIP } * inverse);
    c.cone.frozen = usize::from(implicit);
}

/// D and bias of the friction rows of a contact, from `first` on.
fn friction(timestep: f64, implicit: bool, first: usize, c: &mut Constraint) {
    let slip = if implicit { IMPLICIT_SLIP } else { SLIP };
    c.cone.frozen = if implicit { c.cone.dim - first } else { 0 };
    for k in first..c.cone.dim {
        c.bias[k] = c.velocity[k] / timestep;
    }
    for (group, &inverse) in GROUPS.into_iter().zip(&c.inverse[1..]) {
        let mu = c.cone.mu[group.start];
        // Nothing that could move has no friction.
        let d = if inverse > 0.0 { 1.0 / (slip * inverse * mu * mu) } else { 0.0 };
        group.for_each(|k| c.cone.d[k] = d);
    }
}
