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

use super::constants::{self, Spring};
use super::describe::{Ask, Creep, Description, Touch, Unlike};
use super::island::Island;
use super::per_mix::PerMix;
use super::pointwise::{self, Point};
use super::{Law, Lever, Task, impedance};
use crate::data::{Outcome, Scratchpad};
use crate::model::{Mix, Model};
use crate::state::Start;

/// The record.
pub static LAW: Law = Law {
    name: "tutorial",
    about: "the course's penalty law: k d + c max(0, -v), tanh friction",
    joints: false,
    start: Start::Nothing,
    by_timestep: false,
    nearer: "",
    lever: Lever::Surface,
    solve,
    pose: None,
    shortcut: Some(|task, own, bodies, contacts, room| {
        let formulas = own.get::<PerMix<Formula>>().of(task, Formula::new);
        let force = |point: &Point| formulas[point.contact.mix as usize].force(point);
        pointwise::solve_free(task, bodies, contacts, room, force);
        Some(0.0)
    }),
    balls: None,
    friction,
    describe,
    unlike: Some(Unlike {
        normal: own_spring,
        friction: "tutorial's is −μ F_n tanh(α v), which creeps where it should hold; MuJoCo's is a damper",
    }),
};

/// Steepness of the friction law where the scene gives no `penny.alpha`, s/m: full friction from about 2 cm/s on.
pub const DEFAULT_ALPHA: f64 = 100.0;

/// ε of the torques under an implicit integrator.
const IMPLICIT_SPIN: f64 = 1e-3;

/// Stiffness k (N/m) and damping c (N s/m) of one contact point.
///
/// In: `inverse_mass` of the pair, 1/kg (sum of the bodies' `invweight0`).
pub fn spring_damper(model: &Model, mix: &Mix, inverse_mass: f64, timestep: f64) -> (f64, f64) {
    let reference = reference(model, mix, timestep);
    let k = model.tutorial.k.unwrap_or(reference.stiffness / inverse_mass);
    let c = model.tutorial.c.unwrap_or(reference.damping / inverse_mass);
    (k, c)
}

/// K = k/m and B = c/m: with solimp = (d, d) and d → 1 MuJoCo's reference is the spring and damper of unit mass.
fn reference(model: &Model, mix: &Mix, timestep: f64) -> impedance::Reference {
    impedance::Reference::new(&mix.solref, &[1.0; 5], timestep, model.opt.flags.refsafe)
}

/// Spring and damper of one of a pair's contact points, with its share of the mass that the pair carries.
pub fn spring(model: &Model, touch: &Touch, timestep: f64) -> Spring {
    let (k, c) = spring_damper(model, &model.mixes[touch.mix], touch.estimate / touch.mass, timestep);
    Spring { mass: touch.share(), k, c }
}

/// Coefficients of friction: `penny.mu` and `penny.mu_roll` where the scene has them.
fn friction(model: &Model, mix: &Mix) -> [f64; 5] {
    let [slide_1, slide_2, spin, roll_1, roll_2] = mix.friction;
    let (mu, roll) = (model.tutorial.mu, model.tutorial.mu_roll);
    [mu.unwrap_or(slide_1), mu.unwrap_or(slide_2), spin, roll.unwrap_or(roll_1), roll.unwrap_or(roll_2)]
}

/// Spring and damper of one contact point, with its share of the mass.
///
///     depth at rest = m g / k
///     restitution, creep: [`constants::tutorial_restitution`], [`constants::tutorial_creep`]
fn describe(ask: &Ask) -> Description {
    let Ask { model, touch, timestep, slope } = *ask;
    let mix = &model.mixes[touch.mix];
    let spring = spring(model, touch, timestep);
    let alpha = model.tutorial.alpha.unwrap_or(DEFAULT_ALPHA);
    let creep = constants::tutorial_creep(friction(model, mix)[0], alpha, slope);
    Description {
        springs: Some([spring; 2]),
        each_point: true,
        approach_only: true,
        restitution: Some(constants::tutorial_restitution(spring.zeta())),
        rest_depth: Some(spring.mass * ask.gravity() / spring.k),
        creep: Some(creep.map_or(Creep::Slides, Creep::At)),
    }
}

/// Its spring and damper on the scene's first mix, in words.
fn own_spring(model: &Model, timestep: f64) -> String {
    let mass = model.bodies.iter().map(|b| b.invweight0[0]).find(|&w| w > 0.0).unwrap_or(1.0);
    let from = |given: Option<f64>| if given.is_some() { "from <custom>" } else { "from solref" };
    let (k, c) = spring_damper(model, &model.mixes[0], mass, timestep);
    let ([k, c], given) = ([k, c].map(|x| format!("{x:.2e}")), [model.tutorial.k, model.tutorial.c].map(from));
    format!(
        "tutorial has its own law: F = k d + c max(0, −v) with k = {k} N/m ({}) and c = {c} N s/m ({}), no solimp, no \
         damping on the way out",
        given[0], given[1]
    )
}

/// What all contacts of a mix have in common.
#[derive(Clone, Copy, Debug)]
struct Formula {
    /// Spring and damper of unit mass, and those that the scene gives.
    reference: impedance::Reference,
    k: Option<f64>,
    c: Option<f64>,
    /// Sliding, spinning (m), rolling (m).
    friction: [f64; 3],
    /// s/m
    alpha: f64,
    /// Depth over which it switches on, m.
    onset: f64,
    /// 1/(ε h), 1/s; infinite under an explicit integrator.
    steep: f64,
}

impl Formula {
    fn new(mix: &Mix, task: &Task, onset: f64) -> Formula {
        let Task { model, settings, .. } = *task;
        let [mu, _, spin, roll, _] = friction(model, mix);
        Formula {
            reference: reference(model, mix, settings.timestep),
            k: model.tutorial.k,
            c: model.tutorial.c,
            friction: [mu, spin, roll],
            alpha: model.tutorial.alpha.unwrap_or(DEFAULT_ALPHA),
            onset,
            steep: if settings.implicit { 1.0 / (IMPLICIT_SPIN * settings.timestep) } else { f64::INFINITY },
        }
    }

    #[inline(always)]
    fn force(&self, point: &Point) -> [f64; 6] {
        let (v, [mu, spin, roll]) = (&point.velocity, self.friction);
        let k = self.k.unwrap_or(self.reference.stiffness / point.inverse_mass);
        let c = self.c.unwrap_or(self.reference.damping / point.inverse_mass);
        let normal = (k * point.depth + c * (-v[0]).max(0.0)) * impedance::share(point.depth, self.onset);
        let speed = v[1].hypot(v[2]);
        let sliding = if speed > 0.0 { -mu * normal * (self.alpha * speed).tanh() / speed } else { 0.0 };
        // Torque per angular velocity near zero, N m s.
        let steep = self.steep / point.inverse_inertia;
        let [spinning] = opposing([v[3]], spin * normal, steep);
        let [roll_1, roll_2] = opposing([v[4], v[5]], roll * normal, steep);
        [normal, sliding * v[1], sliding * v[2], spinning, roll_1, roll_2]
    }
}

fn solve(task: &Task, own: &mut Scratchpad, island: &mut Island) -> Outcome {
    let formulas = own.get::<PerMix<Formula>>().of(task, Formula::new);
    pointwise::solve(task, island, |point| formulas[point.contact.mix as usize].force(point))
}

/// Torque of size `limit` against an angular velocity, less where that is nearly zero: −min(limit, steep |ω|) ω/|ω|.
///
/// In: N m, N m s; `steep` may be infinite. At rest there is none.
fn opposing<const N: usize>(w: [f64; N], limit: f64, steep: f64) -> [f64; N] {
    let speed = w.iter().map(|w| w * w).sum::<f64>().sqrt();
    if speed > 0.0 { w.map(|w| -w * (limit / speed).min(steep)) } else { [0.0; N] }
}
