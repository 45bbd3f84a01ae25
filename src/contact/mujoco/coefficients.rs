//! What MuJoCo makes of a contact's parameters: its cone, its softness, the accelerations that it asks for.

use crate::contact::Task;
use crate::contact::cost::{Cone, Kind};
use crate::contact::impedance::{self, Reference};
use crate::contact::newton::Constraint;
use crate::data::Contact;
use crate::model::{self, Mix, Model};

/// What all contacts of a mix have in common.
#[derive(Clone, Copy, Debug)]
pub struct Coefficients {
    kind: Kind,
    mu: [f64; 6],
    /// D of each row over D of the normal (elliptic).
    weight: [f64; 6],
    /// Inverse mass of the row that sets R, over that of the normal: the first edge of a pyramid is n + μ₁t₁.
    slant: f64,
    /// R over that of this row.
    softening: f64,
    solimp: [f64; 5],
    normal: Reference,
    /// B of the friction rows, 1/s.
    damping: f64,
    margin: f64,
    /// Depth over which it switches on, m.
    onset: f64,
    /// Whether forces are asked for at the end of a step.
    implicit: bool,
}

impl Coefficients {
    /// Regularisation of a contact's rows, from that of the normal R₀ = (1 − d)/d A:
    ///
    ///     elliptic:   R₁ = R₀ / impratio,  Rⱼ = R₁ μ₁²/μⱼ²,  μ̃ = μ₁ √(R₁/R₀)
    ///     pyramidal:  R  = 2 μ̃² (1 − d)/d A (1 + μ₁²)   for every edge n ± μⱼtⱼ
    ///
    /// In:     `onset` in m, see [`impedance::onset`].
    /// Source: MuJoCo 4.0 manual, Computation › Solver › Friction cones; the factors by experiment.
    pub fn new(mix: &Mix, task: &Task, onset: f64) -> Coefficients {
        let (opt, timestep) = (&task.model.opt, task.settings.timestep);
        let kind = match opt.cone {
            _ if mix.condim == 1 => Kind::OneSided,
            model::Cone::Pyramidal => Kind::Pyramid,
            model::Cone::Elliptic => Kind::Ellipse,
        };
        let regular = mix.friction[0] / opt.impratio.sqrt();
        let mut mu = [0.0; 6];
        let mut weight = [1.0; 6];
        mu[1..].copy_from_slice(&mix.friction);
        for j in 1..6 {
            weight[j] = mu[j] * mu[j] / (regular * regular);
        }
        let (mut slant, mut softening) = (1.0, 1.0);
        match kind {
            Kind::Ellipse => mu[0] = regular,
            Kind::Pyramid => {
                slant = 1.0 + mu[1] * mu[1];
                softening = 2.0 * regular * regular;
            }
            _ => {}
        }
        let solimp = impedance::clamp(&mix.solimp);
        let reference = |solref| Reference::new(solref, &solimp, timestep, opt.flags.refsafe);
        // The edges of a pyramid mix normal and friction, so its friction has no reference of its own.
        let own = kind == Kind::Ellipse && (mix.solreffriction[0] > 0.0) == (mix.solreffriction[1] > 0.0);
        let friction = if own { &mix.solreffriction } else { &mix.solref };
        Coefficients {
            kind,
            mu,
            weight,
            slant,
            softening,
            solimp,
            normal: reference(&mix.solref),
            damping: reference(friction).damping,
            margin: mix.margin,
            onset,
            implicit: task.settings.implicit,
        }
    }

    /// Fills cone and bias of a contact.
    ///
    ///     r = dist − margin,   x₀ = J₀ a + B v₀ + K d(r) r,   xⱼ = Jⱼ a + B v_j
    ///
    /// In: `dist` in m; `v` J v; `inverse` A of the normal, 1/kg (of the pyramid's first edge over `slant` with `diagexact`).
    #[inline(always)]
    pub fn fill(&self, dist: f64, inverse: f64, v: &[f64; 6], cone: &mut Cone, bias: &mut [f64; 6]) {
        let r = dist - self.margin;
        let d = impedance::impedance(&self.solimp, r);
        let inverse = inverse * self.slant;
        let least = impedance::least_regularisation(self.implicit, inverse);
        let stiff = 1.0 / (impedance::regularisation(d, inverse) * self.softening).max(least);
        self.shape(stiff, cone);
        bias[0] = -self.normal.acceleration(d, r, v[0]);
        (1..cone.dim).for_each(|j| bias[j] = self.damping * v[j]);
    }

    /// Fills the cone of a contact. In: D of the normal, kg.
    #[inline(always)]
    pub fn shape(&self, stiff: f64, cone: &mut Cone) {
        cone.kind = self.kind;
        cone.mu = self.mu;
        cone.d[0] = stiff;
        (1..cone.dim).for_each(|j| cone.d[j] = stiff * self.weight[j]);
    }

    /// Whether a contact at that distance only just switches on.
    pub fn switches_on(&self, dist: f64) -> bool {
        self.margin - dist < self.onset
    }

    /// Lets a contact that only just switches on ask for a share s of the change of acceleration, so that its forces
    /// are that share of what they would be.
    ///
    ///     x = J a + s bias − (1 − s) J a_smooth
    pub fn switch_on(&self, dist: f64, c: &mut Constraint) {
        let share = impedance::share(self.margin - dist, self.onset);
        for (bias, a) in c.bias.iter_mut().zip(&c.smooth) {
            *bias = share * *bias - (1.0 - share) * a;
        }
    }

    /// What A of the normal must be replaced by so that the row that sets R has its exact J M⁻¹ Jᵀ.
    ///
    /// In: `inverse(e)` the inverse mass seen by the row e₀ J₀ + e₁ J₁.
    pub fn exact(&self, mut inverse: impl FnMut([f64; 2]) -> f64) -> f64 {
        match self.kind {
            Kind::Pyramid => inverse([1.0, self.mu[1]]) / self.slant,
            _ => inverse([1.0, 0.0]),
        }
    }
}

/// Sum of the inverse masses that MuJoCo attributes to the two bodies of a contact at `qpos0`, 1/kg.
#[inline]
pub fn inverse_mass(model: &Model, contact: &Contact) -> f64 {
    let of = |side: usize| model.bodies[model.geoms[contact.geom[side] as usize].body].invweight0[0];
    of(0) + of(1)
}
