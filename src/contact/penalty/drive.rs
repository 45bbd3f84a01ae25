//! What drives one contact: reference, softness and limits, the same for lone bodies and coupled trees.

use crate::contact::impedance::{Reference, clamp, impedance, onset, regularisation, share};
use crate::data::Contact;
use crate::dynamics;
use crate::forward::Method;
use crate::model::{Cone, Mix, Model};

/// ε of friction under an implicit integrator.
const IMPLICIT_SLIP: f64 = 1e-3;

/// What all contacts of a mix have in common.
#[derive(Clone, Copy, Debug)]
pub struct Recipe {
    pub dim: usize,
    /// Normal force per largest force or torque along each friction row: two sliding (1), spinning (1/m), two
    /// rolling (1/m).
    pub per_limit: [f64; 5],
    solimp: [f64; 5],
    spring: Reference,
    margin: f64,
    /// Depth over which it switches on, m.
    onset: f64,
    /// What MuJoCo's pyramid does to R at rest; 1 for other contacts.
    stiffening: f64,
}

/// One recipe per mix of the model, for one timestep and kind of integrator.
#[derive(Clone, Debug, Default)]
pub struct Recipes {
    timestep: f64,
    implicit: bool,
    all: Vec<Recipe>,
}

impl Recipes {
    /// Computes the recipes anew if there are none yet or the method has changed.
    pub fn refresh(&mut self, model: &Model, method: &Method) {
        let (timestep, implicit) = (method.timestep, method.integrator.implicit);
        if self.timestep != timestep || self.implicit != implicit || self.all.len() != model.mixes.len() {
            (self.timestep, self.implicit) = (timestep, implicit);
            let onset = onset(implicit, timestep, dynamics::gravity(model).norm());
            self.all.clear();
            self.all.extend(model.mixes.iter().map(|mix| Recipe::new(mix, model, timestep, onset)));
        }
    }

    #[inline(always)]
    pub fn of(&self, contact: &Contact) -> &Recipe {
        &self.all[contact.mix as usize]
    }
}

impl Recipe {
    fn new(mix: &Mix, model: &Model, timestep: f64, onset: f64) -> Recipe {
        let solimp = clamp(&mix.solimp);
        let mu2 = mix.friction[0] * mix.friction[0];
        let pyramid = model.opt.cone == Cone::Pyramidal && mix.condim > 1;
        Recipe {
            dim: mix.condim,
            per_limit: mix.friction.map(|mu| 1.0 / mu),
            solimp,
            spring: Reference::new(&mix.solref, &solimp, timestep, model.opt.flags.refsafe),
            margin: mix.margin,
            onset,
            stiffening: if pyramid { mu2 / model.opt.impratio * (1.0 + mu2) / (mix.condim - 1) as f64 } else { 1.0 },
        }
    }

    /// Whether a contact pushes, or is merely near.
    #[inline(always)]
    pub fn reaches(&self, contact: &Contact) -> bool {
        contact.dist < self.margin
    }

    /// Impedance d at a distance, less where the contact only just switches on.
    #[inline(always)]
    pub fn impedance(&self, dist: f64) -> f64 {
        impedance(&self.solimp, dist - self.margin) * share(self.margin - dist, self.onset)
    }

    /// The acceleration that spring and damper ask for, m/s².
    ///
    /// In: `d` from [`Recipe::impedance`]; `velocity` along the normal, m/s.
    #[inline(always)]
    pub fn reference(&self, d: f64, dist: f64, velocity: f64) -> f64 {
        self.spring.acceleration(d, dist - self.margin, velocity)
    }

    /// R of the normal, 1/kg. In: `inverse_mass` A of the normal row or MuJoCo's estimate of it, 1/kg.
    #[inline(always)]
    pub fn softness(&self, d: f64, inverse_mass: f64) -> f64 {
        regularisation(d, inverse_mass) * self.stiffening
    }
}

/// MuJoCo's estimate of a contact's inverse mass: that of its two bodies in `qpos0`, 1/kg.
#[inline(always)]
pub fn inverse_mass(model: &Model, contact: &Contact) -> f64 {
    let of = |side: usize| model.bodies[model.geoms[contact.geom[side] as usize].body].invweight0[0];
    of(0) + of(1)
}

/// The next force of one piece of friction; see the law's description.
///
/// In: `normal` force; `per_limit` of the piece's rows, normal force per largest force; `stiff` = 1/λ, the inverse of
///     the largest eigenvalue of their block of A (kg or kg m²); `force` and `acceleration` along them, and `drift` =
///     v_t/h, the acceleration that the slip of now amounts to in one step.
#[inline(always)]
pub fn friction<const N: usize>(
    method: &Method,
    normal: f64,
    per_limit: [f64; N],
    stiff: f64,
    force: [f64; N],
    drift: [f64; N],
    acceleration: [f64; N],
) -> [f64; N] {
    let next: [f64; N] = if method.integrator.implicit {
        drift.map(|d| -d * stiff / IMPLICIT_SLIP)
    } else {
        std::array::from_fn(|k| force[k] - (drift[k] + acceleration[k]) * stiff)
    };
    // Inside the ellipse with half-axes limit · normal, or on it.
    let share2: f64 = (0..N).map(|k| (next[k] * per_limit[k]) * (next[k] * per_limit[k])).sum();
    if share2 > normal * normal { onto(next, normal, share2) } else { next }
}

/// The force brought back onto the ellipse. Not inlined: root and division would be computed for all that stick, too.
#[inline(never)]
fn onto<const N: usize>(force: [f64; N], normal: f64, share2: f64) -> [f64; N] {
    let scale = normal / share2.sqrt();
    force.map(|f| f * scale)
}

/// The entries of one piece.
#[inline(always)]
pub fn piece<const N: usize>(x: &[f64], first: usize) -> [f64; N] {
    std::array::from_fn(|k| x[first + k])
}
