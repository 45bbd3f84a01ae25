//! What the numbers of a contact mean: stiffness, damping, frequency, sink, bounce and creep, as pure formulas.
//!
//! For people, not for the step: `penny explain` and the tests use these, no contact law does.

use std::f64::consts::PI;

use super::impedance::{Reference, clamp, impedance};
use crate::model::{Cone, Mix};

/// Mass that two bodies put against each other.
///
///     m = 1 / (1/m₁ + 1/m₂)
///
/// In:  inverse masses along the contact's normal, 1/kg; 0 for what cannot move.
/// Out: kg; infinite if neither can move.
pub fn effective_mass(inverse: [f64; 2]) -> f64 {
    1.0 / (inverse[0] + inverse[1])
}

/// A spring and a damper with the mass that they carry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// kg
    pub mass: f64,
    /// N/m
    pub k: f64,
    /// N s/m
    pub c: f64,
}

impl Spring {
    /// Angular frequency without damping.
    ///
    ///     ω = √(k / m)
    ///
    /// Out: rad/s.
    pub fn omega(&self) -> f64 {
        (self.k / self.mass).sqrt()
    }

    /// Damping ratio: below 1 it swings, above 1 it creeps back.
    ///
    ///     ζ = c / (2 √(k m))
    pub fn zeta(&self) -> f64 {
        self.c / (2.0 * (self.k * self.mass).sqrt())
    }

    /// The `solref` that means this spring where the impedance is 1.
    ///
    ///     timeconst = 2 m / c = 1 / (ζ ω),   dampratio = c / (2 √(m k))
    ///
    /// Out:    s, dimensionless.
    /// Source: MuJoCo 4.0 manual, Modeling › Solver parameters › Reference.
    pub fn solref(&self) -> [f64; 2] {
        [2.0 * self.mass / self.c, self.zeta()]
    }

    /// The `solref` that the tutorial computes for this spring; right for ζ = 1 only.
    ///
    ///     timeconst = √(m / k),   dampratio = c / (2 √(m k))
    ///
    /// Out:    s, dimensionless.
    /// Source: the tutorial, MuJoCo Configuration.
    pub fn tutorial_solref(&self) -> [f64; 2] {
        [1.0 / self.omega(), self.zeta()]
    }

    /// The spring that MuJoCo makes of a `solref` at impedance 1.
    ///
    ///     k = m / (τ ζ)²,   c = 2 m / τ
    ///
    /// In:     `solref` = (τ, ζ): s, dimensionless.
    /// Source: MuJoCo 4.0 manual, Modeling › Solver parameters › Reference.
    pub fn of_solref(mass: f64, [tau, zeta]: [f64; 2]) -> Spring {
        Spring { mass, k: mass / (tau * zeta).powi(2), c: 2.0 * mass / tau }
    }
}

/// The share of the speed that a spring-damper without tension gives back, in an impact so fast that weight does
/// not matter (v ≫ g/ω).
///
///     ζ < 1:  e = exp(−(ζ/s) (π − atan2(2 ζ s, 1 − 2 ζ²))),            s = √(1 − ζ²)
///     ζ > 1:  e = exp(−(ζ/s) ln((ζ + s) / (ζ − s))),                   s = √(ζ² − 1)
///
/// Contact ends where the force is zero, not where the spring is straight.
/// Source: Schwager, Pöschel, Granular Matter 9 (2007), eq. 21 and 22.
pub fn restitution(zeta: f64) -> f64 {
    let s = (1.0 - zeta * zeta).abs().sqrt();
    if s < 1e-6 {
        return (-2.0_f64).exp();
    }
    let phase = if zeta < 1.0 {
        PI - f64::atan2(2.0 * zeta * s, 1.0 - 2.0 * zeta * zeta)
    } else {
        // ζ − s = 1 / (ζ + s), without the cancellation.
        2.0 * (zeta + s).ln()
    };
    (-zeta / s * phase).exp()
}

/// The same for the tutorial's law, whose damper acts on approach only.
///
///     ζ < 1:  e = exp(−(ζ/s) arccos ζ),     s = √(1 − ζ²)
///     ζ > 1:  e = exp(−(ζ/s) arcosh ζ),     s = √(ζ² − 1)
///
/// Derivation: the damped spring is pressed to d = (v/ω) e, and leaves undamped with e v = ω d.
pub fn tutorial_restitution(zeta: f64) -> f64 {
    let s = (1.0 - zeta * zeta).abs().sqrt();
    if s < 1e-6 {
        return (-1.0_f64).exp();
    }
    let phase = if zeta < 1.0 { zeta.acos() } else { zeta.acosh() };
    (-zeta / s * phase).exp()
}

/// How a contact of MuJoCo's kind carries a body: what mass it moves, and how much softer than its impedance says.
#[derive(Clone, Copy, Debug)]
pub struct Carried {
    /// 1/A: mass that the contact's normal really moves, kg.
    pub mass: f64,
    /// Factor on R/A = (1 − d)/d; see [`softness`].
    pub softness: f64,
}

/// How R/A of the normal differs from (1 − d)/d.
///
///     s = q · diagApprox / A / n
///     q = 1                                       elliptic cone, or condim 1
///     q = μ² (1 + μ²) / ((condim − 1) impratio)   pyramidal cone: its edges share the normal force
///
/// In:     `estimate` = diagApprox/A: MuJoCo's estimate of the inverse mass over the true one, dimensionless;
///         `points`: contacts of this kind under the body.
/// Source: MuJoCo 4.0 manual, Computation › Constraint model; the pyramid's factor from its 2 (condim − 1) edges
///         with R = 2 μ²/impratio (1 − d)/d diagApprox (1 + μ²) each.
pub fn softness(mix: &Mix, cone: Cone, impratio: f64, estimate: f64, points: usize) -> f64 {
    let mu2 = mix.friction[0] * mix.friction[0];
    let q = match cone {
        Cone::Pyramidal if mix.condim > 1 => mu2 * (1.0 + mu2) / ((mix.condim - 1) as f64 * impratio),
        _ => 1.0,
    };
    q * estimate / points as f64
}

/// The spring of a contact in the `penalty` and `mujoco` laws, at depth r.
///
///     F = m w (K d r + B v + g),   w = A / (A + R) = 1 / (1 + s (1 − d)/d)
///     k = m w d K,   c = m w B
///
/// With s = 1 the weight w is the impedance d itself. The term m w g is why the body sinks far less than m g / k.
///
/// In:     `depth` r in m, v the speed of approach; `timestep` in s, for REFSAFE.
/// Source: MuJoCo 4.0 manual, Modeling › Solver parameters; K, B: [`Reference`], d: [`impedance`].
pub fn spring(mix: &Mix, carried: Carried, depth: f64, timestep: f64, refsafe: bool) -> Spring {
    let solimp = clamp(&mix.solimp);
    let reference = Reference::new(&mix.solref, &solimp, timestep, refsafe);
    let d = impedance(&solimp, depth);
    let w = 1.0 / (1.0 + carried.softness * (1.0 - d) / d);
    Spring {
        mass: carried.mass,
        k: carried.mass * w * d * reference.stiffness,
        c: carried.mass * w * reference.damping,
    }
}

/// How deep a body rests in the ground under the `penalty` and `mujoco` laws.
///
///     K d(r) r = s g (1 − d(r)) / d(r)
///
/// For constant d and s = 1: r = (1 − d) m g / k. The mass cancels.
///
/// In:  `gravity` along the normal, m/s².
/// Out: m.
pub fn rest_depth(mix: &Mix, softness: f64, gravity: f64, timestep: f64, refsafe: bool) -> f64 {
    let solimp = clamp(&mix.solimp);
    let k = Reference::new(&mix.solref, &solimp, timestep, refsafe).stiffness;
    let excess = |r: f64| {
        let d = impedance(&solimp, r);
        k * d * r - softness * gravity * (1.0 - d) / d
    };
    let soft = solimp[0].min(solimp[1]);
    let (mut low, mut high) = (0.0, softness * gravity * (1.0 - soft) / (soft * soft * k));
    // The excess grows with r: halve the bracket until it has no middle.
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return middle;
        }
        if excess(middle) < 0.0 { low = middle } else { high = middle }
    }
}

/// Speed at which a body creeps down a slope that it should stick to: MuJoCo's friction is a damper.
///
///     v = t (1 − d)/d g / (B impratio)
///     t = sin θ                                            elliptic
///     t = (1 + μ²) sin θ                                   pyramidal, tan θ ≤ μ / (condim − 1)
///     t = 2 (1 + μ²) (sin θ − μ (cos θ − sin θ/μ) / (2 (condim − 2)))     pyramidal, steeper: an edge has let go
///
/// In:     `slope` θ in rad, below arctan μ; `depth` at which it rests, m; `estimate` = diagApprox/A, `points` as in
///         [`softness`].
/// Out:    m/s.
/// Source: at rest the friction rows say R F_t = B v with F_t = m g sin θ; the pyramid's edges n ± μ t carry
///         N/(2 (condim − 1)) ± F_t/(2 μ) each. Checked against MuJoCo 4.0.0.
pub fn creep(mix: &Mix, scene: &Scene, estimate: f64, points: usize, depth: f64, slope: f64) -> f64 {
    let solimp = clamp(&mix.solimp);
    let b = Reference::new(&mix.solreffriction, &solimp, scene.timestep, scene.refsafe).damping;
    let d = impedance(&solimp, depth);
    let (mu, (sin, cos)) = (mix.friction[0], slope.sin_cos());
    let t = match scene.cone {
        Cone::Elliptic => sin,
        Cone::Pyramidal if slope.tan() <= mu / (mix.condim - 1) as f64 => (1.0 + mu * mu) * sin,
        Cone::Pyramidal => 2.0 * (1.0 + mu * mu) * (sin - mu * (cos - sin / mu) / (2.0 * (mix.condim as f64 - 2.0))),
    };
    t * (1.0 - d) / d * scene.gravity * estimate / (b * scene.impratio * points as f64)
}

/// What of a scene enters [`creep`].
#[derive(Clone, Copy, Debug)]
pub struct Scene {
    /// Which friction cone.
    pub cone: Cone,
    /// Ratio of friction to normal impedance.
    pub impratio: f64,
    /// m/s²
    pub gravity: f64,
    /// s
    pub timestep: f64,
    /// Time constants are at least two timesteps.
    pub refsafe: bool,
}

/// The same under the tutorial's law, whose friction is −μ F_n tanh(α v).
///
///     v = artanh(tan θ / μ) / α
///
/// In:  `slope` θ in rad, `alpha` in s/m.
/// Out: m/s; `None` where it slides, tan θ ≥ μ.
pub fn tutorial_creep(mu: f64, alpha: f64, slope: f64) -> Option<f64> {
    let share = slope.tan() / mu;
    (share < 1.0).then(|| share.atanh() / alpha)
}

/// Largest stable timestep of a damped spring under the semi-implicit Euler method, if its spring does not change
/// with the step (REFSAFE off or not active).
///
///     |eigenvalues| ≤ 1  ⇔  ω h ≤ 2 (√(ζ² + 1) − ζ)  and  ζ ω h ≤ 1
///
/// Derivation: v ← v − h (ω² x + 2 ζ ω v), x ← x + h v has trace 2 − 2ζωh − ω²h² and determinant 1 − 2ζωh.
/// Out: s.
pub fn semi_implicit_limit(omega: f64, zeta: f64) -> f64 {
    // √(ζ² + 1) − ζ = 1 / (√(ζ² + 1) + ζ), without the cancellation; it implies ζ ω h < 1.
    2.0 / ((zeta * zeta + 1.0).sqrt() + zeta) / omega
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Impact of a spring-damper at 1 m/s without gravity, by tiny steps: speed at which the force ends.
    fn bounce(zeta: f64, damp_rebound: bool) -> f64 {
        let (h, mut x, mut v) = (1e-6, 0.0, 1.0);
        loop {
            let force = x + if v > 0.0 || damp_rebound { 2.0 * zeta * v } else { 0.0 };
            if force <= 0.0 || x < 0.0 {
                return -v;
            }
            v -= h * force;
            x += h * v;
        }
    }

    #[test]
    fn restitution_is_what_the_spring_gives_back() {
        // The first-order scheme errs by about h = 1e-6 times the duration.
        for zeta in [0.1, 0.3, 0.6, 0.9, 1.0, 1.2, 2.0] {
            assert!((restitution(zeta) - bounce(zeta, true)).abs() < 2e-5, "both ways, zeta {zeta}");
            assert!((tutorial_restitution(zeta) - bounce(zeta, false)).abs() < 2e-5, "approach only, zeta {zeta}");
        }
        assert!((restitution(0.3) - 0.451).abs() < 5e-4);
    }

    #[test]
    fn right_solref_gives_the_spring_back_and_the_tutorials_is_off_by_zeta() {
        for zeta in [0.2, 1.0, 3.0] {
            let spring = Spring { mass: 2.0, k: 5000.0, c: zeta * 2.0 * (2.0_f64 * 5000.0).sqrt() };
            let right = Spring::of_solref(spring.mass, spring.solref());
            assert!((right.k / spring.k - 1.0).abs() < 1e-12 && (right.c / spring.c - 1.0).abs() < 1e-12);
            let tutorial = Spring::of_solref(spring.mass, spring.tutorial_solref());
            assert!((tutorial.k / spring.k - zeta.powi(-2)).abs() < 1e-12 * zeta.powi(-2));
            assert!((tutorial.c / spring.c - 1.0 / zeta).abs() < 1e-12 / zeta);
        }
    }

    fn mix(condim: usize, mu: f64, solref: [f64; 2], solimp: [f64; 3]) -> Mix {
        let solimp = [solimp[0], solimp[1], solimp[2], 0.5, 2.0];
        let friction = [mu, mu, 0.005, 1e-4, 1e-4];
        Mix { condim, friction, solref, solreffriction: solref, solimp, margin: 0.0, gap: 0.0 }
    }

    #[test]
    fn rest_depth_is_what_mujoco_shows() {
        // MuJoCo 4.0.0, sphere at rest, timestep 2 ms; four digits were read off.
        let default = [0.9, 0.95, 0.001];
        for (mix, cone, expected) in [
            (mix(1, 1.0, [0.02, 1.0], default), Cone::Pyramidal, 3.672e-4),
            (mix(3, 1.0, [0.02, 1.0], default), Cone::Elliptic, 3.672e-4),
            (mix(3, 1.0, [0.02, 1.0], default), Cone::Pyramidal, 3.672e-4),
            (mix(3, 0.5, [0.02, 1.0], default), Cone::Pyramidal, 6.79e-5),
            (mix(3, 0.1, [0.02, 1.0], default), Cone::Pyramidal, 2.21e-6),
            (mix(6, 1.0, [0.02, 1.0], default), Cone::Pyramidal, 1.688e-4),
            (mix(1, 1.0, [0.02, 3.0], [0.95, 0.95, 0.001]), Cone::Pyramidal, 1.766e-3),
            (mix(1, 1.0, [0.01, 1.0], [0.99, 0.995, 0.001]), Cone::Pyramidal, 9.91e-6),
        ] {
            let depth = rest_depth(&mix, softness(&mix, cone, 1.0, 1.0, 1), 9.81, 0.002, true);
            assert!((depth / expected - 1.0).abs() < 2e-3, "{depth:e} for {mix:?} {cone:?}, MuJoCo {expected:e}");
        }
    }

    #[test]
    fn a_contact_with_constant_impedance_is_a_spring_of_the_written_numbers() {
        let (tau, zeta, d, m) = (0.02, 0.4, 0.95, 3.0);
        let mix = mix(1, 1.0, [tau, zeta], [d, d, 0.001]);
        let s = spring(&mix, Carried { mass: m, softness: 1.0 }, 1e-4, 0.002, true);
        // k = m d²/(d τ ζ)², c = 2 m d/(d τ)
        assert!((s.k - m / (tau * zeta).powi(2)).abs() < 1e-12 * s.k);
        assert!((s.c - 2.0 * m / tau).abs() < 1e-12 * s.c);
        assert!((s.zeta() - zeta).abs() < 1e-12);
        // Two equal bodies move half the mass of one.
        assert_eq!(effective_mass([1.0 / m, 1.0 / m]), m / 2.0);
        assert_eq!(effective_mass([1.0 / m, 0.0]), m);
    }

    #[test]
    fn creep_on_a_slope_is_mujocos() {
        // MuJoCo 4.0.0, tolerance 0: a sphere that cannot turn, at rest on 20°.
        for (cone, mu, impratio, expected) in [
            (Cone::Elliptic, 1.0, 1.0, 0.0016776088030124071),
            (Cone::Elliptic, 1.0, 10.0, 0.00016776088030124074),
            (Cone::Pyramidal, 1.0, 1.0, 0.0033552176060248134),
            (Cone::Pyramidal, 0.5, 1.0, 0.003410287820699722),
            (Cone::Pyramidal, 0.5, 4.0, 0.0008525719551749308),
        ] {
            let mix = mix(3, mu, [0.02, 1.0], [0.95, 0.95, 0.001]);
            let scene = Scene { cone, impratio, gravity: 9.81, timestep: 0.002, refsafe: true };
            let v = creep(&mix, &scene, 1.0, 1, 1e-4, 20f64.to_radians());
            assert!((v / expected - 1.0).abs() < 1e-9, "{cone:?} mu {mu} impratio {impratio}: {v}, MuJoCo {expected}");
        }
    }

    #[test]
    fn the_tutorials_friction_creeps_until_tanh_holds_the_weight() {
        let slope = 20f64.to_radians();
        assert_eq!(tutorial_creep(0.3, 10.0, slope), None);
        assert!(
            tutorial_creep(0.5, 10.0, slope).is_some_and(|v| ((10.0 * v).tanh() * 0.5 - slope.tan()).abs() < 1e-14)
        );
    }

    #[test]
    fn the_step_of_a_spring_is_stable_up_to_its_limit_and_not_beyond() {
        for zeta in [0.0, 0.2, 1.0, 3.0] {
            let limit = semi_implicit_limit(50.0, zeta);
            let grows = |h: f64| {
                let (mut x, mut v) = (1.0, 0.0);
                for _ in 0..20_000 {
                    v -= h * (2500.0 * x + 2.0 * zeta * 50.0 * v);
                    x += h * v;
                }
                f64::abs(x).partial_cmp(&1e3).is_none_or(|o| o.is_ge())
            };
            assert!(!grows(limit * 0.999) && grows(limit * 1.001), "zeta {zeta}");
        }
    }
}
