//! How MuJoCo's `solref` and `solimp` turn into a spring, a damper and a softness. All contact laws use this.
//!
//! Source: MuJoCo 4.0 manual, Modeling › Solver parameters; every formula re-checked against 4.0.0 by running it.

use crate::math::MIN_VAL;

/// MuJoCo's bounds of `d0`, `dwidth` and `midpoint` (`mjMINIMP`, `mjMAXIMP`).
pub const MIN_IMP: f64 = 1e-4;
/// The upper bound.
pub const MAX_IMP: f64 = 0.9999;

/// `solimp` within the bounds that MuJoCo imposes: d0, dwidth, midpoint in [1e-4, 0.9999]; width ≥ 0; power ≥ 1.
pub fn clamp(solimp: &[f64; 5]) -> [f64; 5] {
    let [d0, dwidth, width, midpoint, power] = *solimp;
    let bound = |d: f64| d.clamp(MIN_IMP, MAX_IMP);
    [bound(d0), bound(dwidth), width.max(0.0), bound(midpoint), power.max(1.0)]
}

/// Constraint impedance d(r): how strongly a violation r is opposed.
///
///     x = |r| / width
///     y = xᵖ / midᵖ⁻¹                      for x ≤ mid
///     y = 1 − (1 − x)ᵖ / (1 − mid)ᵖ⁻¹      otherwise (1 beyond x = 1)
///     d = d0 + y (dwidth − d0)
///
/// A width of zero gives the mean of d0 and dwidth.
///
/// In:     `solimp` from [`clamp`]: dimensionless, but `width` has the unit of r (m or rad).
/// Out:    d, dimensionless, between d0 and dwidth.
/// Source: MuJoCo 4.0 manual, Modeling › Solver parameters › Impedance.
#[inline]
pub fn impedance(solimp: &[f64; 5], r: f64) -> f64 {
    let [d0, dwidth, width, mid, power] = *solimp;
    if d0 == dwidth || width <= MIN_VAL {
        return 0.5 * (d0 + dwidth);
    }
    let x = r.abs() / width;
    let y = if x >= 1.0 {
        1.0
    } else if power == 1.0 {
        x
    } else if power == 2.0 {
        // The default, without two calls of pow.
        if x <= mid { x * x / mid } else { 1.0 - (1.0 - x) * (1.0 - x) / (1.0 - mid) }
    } else {
        any_power(x, mid, power)
    };
    d0 + y * (dwidth - d0)
}

/// y of any power. Not inlined: the compiler would take `pow` out of loops in which it is never called.
#[inline(never)]
fn any_power(x: f64, mid: f64, power: f64) -> f64 {
    if x <= mid {
        x.powf(power) / mid.powf(power - 1.0)
    } else {
        1.0 - (1.0 - x).powf(power) / (1.0 - mid).powf(power - 1.0)
    }
}

/// The spring and the damper of a constraint, per unit of effective mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference {
    /// K, 1/s²; the spring is K d(r).
    pub stiffness: f64,
    /// B, 1/s
    pub damping: f64,
}

impl Reference {
    /// Spring and damper that `solref` asks for.
    ///
    ///     solref = (τ, ζ), both positive:   K = 1 / (dwidth τ ζ)²,   B = 2 / (dwidth τ)
    ///     solref = (−k, −b), none positive: K = k / dwidth²,         B = b / dwidth
    ///
    /// With `refsafe` τ is at least 2 `timestep`: a stiffer spring could not be integrated. The second form is
    /// left alone. A pair of other signs means the default (0.02, 1), as in MuJoCo.
    ///
    /// In:     τ in s, ζ dimensionless; k in 1/s², b in 1/s; `solimp` from [`clamp`]; `timestep` in s.
    /// Source: MuJoCo 4.0 manual, Modeling › Solver parameters › Reference; the signs by experiment.
    pub fn new(solref: &[f64; 2], solimp: &[f64; 5], timestep: f64, refsafe: bool) -> Reference {
        let [mut first, mut second] = *solref;
        if (first > 0.0) != (second > 0.0) {
            (first, second) = (0.02, 1.0);
        }
        let dwidth = solimp[1];
        if first <= 0.0 {
            // Not −second, which would be −0 without damping.
            return Reference { stiffness: -first / (dwidth * dwidth), damping: (0.0 - second) / dwidth };
        }
        let tau = if refsafe { first.max(2.0 * timestep) } else { first };
        let root = dwidth * tau * second;
        Reference { stiffness: 1.0 / (root * root).max(MIN_VAL), damping: 2.0 / (dwidth * tau).max(MIN_VAL) }
    }

    /// The acceleration at which a constraint is content.
    ///
    ///     a_ref = −B v − K d(r) r
    ///
    /// In:  `r` violation (m or rad; negative in penetration), `v` its rate, `d` = d(r).
    /// Out: m/s² or rad/s².
    #[inline]
    pub fn acceleration(&self, d: f64, r: f64, v: f64) -> f64 {
        -self.damping * v - self.stiffness * d * r
    }
}

/// Regularisation R: the inverse mass that a row's softness adds.
///
///     R = A (1 − d) / d,   at least 1e-15
///
/// In:     `d` = d(r); `a` the row's inverse mass J M⁻¹ Jᵀ or MuJoCo's estimate of it (`diagApprox`), 1/kg.
/// Out:    1/kg (or 1/(kg m²) for a row of an angle).
/// Source: MuJoCo 4.0 manual, Computation › Constraint model › Parameters.
#[inline]
pub fn regularisation(d: f64, a: f64) -> f64 {
    (a * (1.0 - d) / d).max(MIN_VAL)
}

/// The least softness R of a row of inverse mass A, 1/kg.
///
///     explicit integrators: 0                implicit ones: 1e-5 A
///
/// An implicit step knows a row's force as x/R, where x, what is left of accelerations that cancel, has their rounding:
/// 1e-16 of them, and that of a distance over the depth in which a contact switches on ([`onset`]). A row that gives way by
/// 1e-5 of what its force does keeps enough digits. MuJoCo's largest d is 0.9999, R = 1e-4 A: only tiny friction under a pyramidal cone
/// asks for less.
///
/// In: `a` in 1/kg.
#[inline]
pub fn least_regularisation(implicit: bool, a: f64) -> f64 {
    if implicit { 1e-5 * a } else { 0.0 }
}

/// The inverse mass that a constraint meets, 1/kg.
///
///     A = Σ w                  w, w_r: `invweight0` of the bodies, 1/kg and 1/(kg m²)
///     A = Σ w + w_r |r|²       where the first is nothing against that; r from the centre of mass to the contact, m
///
/// MuJoCo's estimate A is that of the centre of mass, of which a joint through it (a seesaw's) leaves nothing, or its rounding.
/// What that is a measure for, such as a stiffness in N/m, would be infinite. A joint that misses the centre by e leaves e²/|r|² of
/// the second: less than 1e-9 is a miss by 3e-5 of the arm.
///
/// In: `estimate`, the first; `there`, the second, or what the constraint's rows have.
#[inline]
pub fn noticeable(estimate: f64, there: f64) -> f64 {
    if estimate < 1e-9 * there { there } else { estimate }
}

/// Depth over which a contact switches on, m.
///
///     explicit integrators: 0                implicit ones: w = 0.1 g h²
///
/// A contact's force jumps from nothing to all at touch. Where the force at the end of the step is asked for, there
/// may be no such end: without the force the body is in contact, with it it is not. Then it ends at the touch, with
/// part of the force. So that a solver finds this end, the force grows over a depth w, a fifth of what gravity
/// does in one step.
///
/// In: `gravity` g, m/s².
pub fn onset(implicit: bool, timestep: f64, gravity: f64) -> f64 {
    if implicit { 0.1 * gravity * timestep * timestep } else { 0.0 }
}

/// Share of its force that a contact at a depth (m) has, with w from [`onset`].
#[inline(always)]
pub fn share(depth: f64, onset: f64) -> f64 {
    if depth < onset { depth / onset } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn impedance_runs_from_d0_to_dwidth_through_the_midpoint() {
        for power in [1.0, 2.0, 3.5] {
            let s = clamp(&[0.8, 0.95, 0.01, 0.3, power]);
            assert_eq!(impedance(&s, 0.0), 0.8);
            assert_eq!(impedance(&s, -0.02), 0.95);
            // y(mid) = mid from either side: the two branches meet.
            assert!((impedance(&s, -0.003) - (0.8 + 0.3 * 0.15)).abs() < 1e-15);
            assert!((impedance(&s, -0.003 * (1.0 + 1e-12)) - impedance(&s, -0.003)).abs() < 1e-12);
        }
        assert_eq!(impedance(&clamp(&[0.8, 0.9, 0.0, 0.5, 2.0]), -1.0), 0.5 * (0.8 + 0.9));
    }

    #[test]
    fn direct_and_standard_references_agree_where_they_mean_the_same() {
        let s = clamp(&[0.9, 0.95, 0.001, 0.5, 2.0]);
        let (tau, zeta) = (0.02, 0.7);
        let standard = Reference::new(&[tau, zeta], &s, 0.002, true);
        let direct = Reference::new(&[-1.0 / (tau * zeta).powi(2), -2.0 / tau], &s, 0.002, true);
        assert!((standard.stiffness / direct.stiffness - 1.0).abs() < 1e-14);
        assert!((standard.damping / direct.damping - 1.0).abs() < 1e-14);
    }

    #[test]
    fn refsafe_keeps_the_time_constant_above_two_steps() {
        let s = clamp(&[0.9, 0.95, 0.001, 0.5, 2.0]);
        assert_eq!(Reference::new(&[1e-5, 1.0], &s, 0.01, true), Reference::new(&[0.02, 1.0], &s, 0.01, false));
        assert!(Reference::new(&[1e-5, 1.0], &s, 0.01, false).stiffness > 1e9);
    }
}
