//! The course's contact law, to the letter.
//!
//! Every contact point with depth d > 0 pushes with
//!
//!     F_n = k d + c max(0, −v_n)            N; v_n separation speed, m/s: the damper works on approach only
//!     F_t = −μ F_n tanh(α |v_t|) v_t/|v_t|  N; v_t slip velocity at the touching surface, m/s
//!     τ_n = −μ_spin F_n sign(ω_n)           N m; about the normal, condim 4 and 6
//!     τ_t = −μ_roll F_n ω_t/|ω_t|           N m; about the tangents, condim 6
//!
//! k (N/m) and c (N s/m) come from `<custom>` numerics `penny.k` and `penny.c`; where the scene gives none, from
//! solref = (τ, ζ) and the effective mass m of the pair:
//!
//!     k = m / (τ ζ)²,   c = 2 m / τ         direct solref (−k', −b'):  k = m k',  c = m b'
//!
//! The force acts at the moving body's own surface, as in the course (r = R(θ) c for a corner, [0, −R] for the
//! circle); between two moving bodies it acts midway, so that action equals reaction.
//!
//! Under an implicit integrator the law is asked for the force at the end of the step, and a sign would not tell which
//! torque just ends a rotation. There both torques are steep lines through ω = 0, up to the limit,
//!
//!     τ = −min(μ F_n, |ω| / (ε h λ)) ω/|ω|,     ε = 1e-3
//!
//! with h the timestep and λ the inverse inertia of the two bodies (`invweight0`), 1/(kg m²): a thousandth of what a
//! step can change of ω. And contacts switch on over a small depth ([`impedance::onset`]).
//!
//! The course has no joints, so the law has neither their limits nor their dry friction.
//!
//! Source: C. Xing, Physics Simulation Tutorial (2025), Algorithms 1–4. Algorithm 1 as printed lets the damper
//! act without contact too; like the course's other algorithms, Penny applies it in contact only.

use super::island::{Island, Push, Source};
use super::newton::{Constraint, Outcome};
use super::{Law, Lever, Task, impedance};
use crate::data::Scratchpad;
use crate::dynamics;
use crate::model::{Mix, Model};
use crate::state::Start;

pub static LAW: Law = Law {
    name: "tutorial",
    about: "the course's penalty law: k d + c max(0, -v), tanh friction",
    joints: false,
    start: Start::Nothing,
    lever: Lever::Surface,
    solve,
    shortcut: None,
};

/// Steepness of the friction law where the scene gives no `penny.alpha`, s/m: full friction from about 2 cm/s on.
pub const DEFAULT_ALPHA: f64 = 100.0;

/// ε of the torques under an implicit integrator.
const IMPLICIT_SPIN: f64 = 1e-3;

/// Stiffness k (N/m) and damping c (N s/m) of one contact point.
///
/// In: `inverse_mass` of the pair, 1/kg (sum of the bodies' `invweight0`).
pub fn spring_damper(model: &Model, mix: &Mix, inverse_mass: f64, timestep: f64) -> (f64, f64) {
    // With solimp = (d, d) and d → 1 the reference is the spring and damper of unit mass: K = k/m, B = c/m.
    let rigid = [1.0; 5];
    let reference = impedance::Reference::new(&mix.solref, &rigid, timestep, model.opt.flags.refsafe);
    let k = model.tutorial.k.unwrap_or(reference.stiffness / inverse_mass);
    let c = model.tutorial.c.unwrap_or(reference.damping / inverse_mass);
    (k, c)
}

fn solve(task: &Task, _: &mut Scratchpad, island: &mut Island) -> Outcome {
    let onset = if task.method.integrator.implicit {
        impedance::onset(true, task.method.timestep, dynamics::gravity(task.model).norm())
    } else {
        0.0
    };
    for i in 0..island.sources.len() {
        if let Source::Contact(index) = island.sources[i] {
            island.constraints[i].force = force(task, onset, index, &island.constraints[i]);
        }
    }
    island.solve(task.model, task.data, Push)
}

/// The force of one contact: normal, sliding, spinning, rolling.
fn force(task: &Task, onset: f64, index: usize, c: &Constraint) -> [f64; 6] {
    let Task { model, method, data, .. } = *task;
    let contact = &data.contacts[index];
    let (mix, depth, dim, v) = (&model.mixes[contact.mix as usize], -contact.dist, c.cone.dim, &c.velocity);
    let mut force = [0.0; 6];
    if depth <= 0.0 {
        return force;
    }
    let weights = contact.body.map(|b| model.bodies[b as usize].invweight0);
    let (k, damping) = spring_damper(model, mix, weights[0][0] + weights[1][0], method.timestep);
    let normal = (k * depth + damping * (-v[0]).max(0.0)) * impedance::share(depth, onset);
    force[0] = normal;
    if dim >= 3 {
        let speed = v[1].hypot(v[2]);
        let mu = model.tutorial.mu.unwrap_or(mix.friction[0]);
        let alpha = model.tutorial.alpha.unwrap_or(DEFAULT_ALPHA);
        if speed > 0.0 {
            let friction = -mu * normal * (alpha * speed).tanh() / speed;
            (force[1], force[2]) = (friction * v[1], friction * v[2]);
        }
    }
    // Torque per angular velocity near zero, N m s.
    let steep = if method.integrator.implicit {
        1.0 / (IMPLICIT_SPIN * method.timestep * (weights[0][1] + weights[1][1]))
    } else {
        f64::INFINITY
    };
    if dim >= 4 {
        [force[3]] = opposing([v[3]], mix.friction[2] * normal, steep);
    }
    if dim >= 6 {
        let limit = model.tutorial.mu_roll.unwrap_or(mix.friction[3]) * normal;
        [force[4], force[5]] = opposing([v[4], v[5]], limit, steep);
    }
    force
}

/// Torque of size `limit` against an angular velocity, less where that is nearly zero: −min(limit, steep |ω|) ω/|ω|.
///
/// In: N m, N m s; `steep` may be infinite. At rest there is none.
fn opposing<const N: usize>(w: [f64; N], limit: f64, steep: f64) -> [f64; N] {
    let speed = w.iter().map(|w| w * w).sum::<f64>().sqrt();
    if speed > 0.0 { w.map(|w| -w * (limit / speed).min(steep)) } else { [0.0; N] }
}
