//! Closed forms of mechanics that more than one place needs.

use std::f64::consts::PI;

/// Complete elliptic integral of the first kind of modulus k, by the arithmetic-geometric mean.
///
///     K(k) = ∫ dφ / √(1 − k² sin² φ),  φ = 0 … π/2
///          = π / (2 agm(1, √(1 − k²)))
///
/// Source: Abramowitz, Stegun, 17.6.
pub fn elliptic_k(k: f64) -> f64 {
    let (mut a, mut b) = (1.0, (1.0 - k * k).sqrt());
    while (a - b).abs() > 1e-15 * a {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    PI / (2.0 * a)
}

/// Period of a free body about its middle axis.
///
///     T = 4 K(k) / p,   p² = (I₃ − I₂)(M² − 2 E I₁)/(I₁ I₂ I₃),
///     k² = (I₂ − I₁)(2 E I₃ − M²) / ((I₃ − I₂)(M² − 2 E I₁)),    I₁ < I₂ < I₃, M² > 2 E I₂
///
/// and with 1 and 3 exchanged where M² < 2 E I₂.
///
/// In:     principal moments in ascending order, kg m², and the angular velocity about them, rad/s.
/// Source: Landau, Lifshitz, Mechanics, §37.
pub fn free_period(inertia: [f64; 3], omega: [f64; 3]) -> f64 {
    let sum = |f: fn(f64, f64) -> f64| (0..3).map(|i| f(inertia[i], omega[i])).sum::<f64>();
    let (twice_energy, momentum2) = (sum(|i, w| i * w * w), sum(|i, w| i * i * w * w));
    let [mut i1, i2, mut i3] = inertia;
    if momentum2 < twice_energy * i2 {
        (i1, i3) = (i3, i1);
    }
    let low = momentum2 - twice_energy * i1;
    let p = ((i3 - i2) * low / (i1 * i2 * i3)).abs().sqrt();
    let k2 = (i2 - i1) * (twice_energy * i3 - momentum2) / ((i3 - i2) * low);
    4.0 * elliptic_k(k2.sqrt()) / p
}

/// Acceleration of a round body along a plane.
///
///     rolls:  a = s / (1 + k)          if s ≤ μ n (1 + k)/k
///     slips:  a = s − μ n              otherwise
///
/// In:     `along` s and `onto` n: force per mass along and onto the plane, m/s²; `k` = I/(m R²).
/// Source: Goldstein, Classical Mechanics.
pub fn rolling_acceleration(along: f64, onto: f64, k: f64, mu: f64) -> f64 {
    if along <= mu * onto * (1.0 + k) / k { along / (1.0 + k) } else { along - mu * onto }
}

/// A round body that starts to slide without spin, until and after it rolls.
#[derive(Clone, Copy, Debug)]
pub struct SlideToRoll {
    /// m/s
    pub v0: f64,
    /// k = I/(m R²)
    pub k: f64,
    /// μ g, m/s²
    pub braking: f64,
}

impl SlideToRoll {
    /// v∞ = v₀ / (1 + k)
    pub fn end_speed(&self) -> f64 {
        self.v0 / (1.0 + self.k)
    }
    /// t* = v₀ k / ((1 + k) μ g)
    pub fn slip_end(&self) -> f64 {
        self.v0 * self.k / ((1.0 + self.k) * self.braking)
    }
    /// x = ½ (v₀ + v∞) t* + v∞ (t − t*), for t ≥ t*
    pub fn path(&self, time: f64) -> f64 {
        let (end, slip) = (self.end_speed(), self.slip_end());
        0.5 * slip * (self.v0 + end) + end * (time - slip)
    }
}

/// Slow steady precession of a top on its tip.
///
///     I₁ Ω² cos θ − I₃ ω₃ Ω + m g l = 0
///
/// In:     `transverse` I₁ about the tip, kg m²; `moment` = m g l, N m; `spin` ω₃ about the axis, rad/s.
/// Source: Goldstein, Classical Mechanics, §5.7.
pub fn top_precession(transverse: f64, axial: f64, spin: f64, moment: f64, theta: f64) -> f64 {
    let (a, b) = (transverse * theta.cos(), axial * spin);
    (b - (b * b - 4.0 * a * moment).sqrt()) / (2.0 * a)
}

/// Precession of a disk that rolls on its edge while its centre rests.
///
///     Ω² = m g (a cos α − b sin α) / (sin α (I₁ cos α − I₃ (b/a) sin α))
///
/// For a thin disk Ω² sin α = 4 g / a.
/// In:     radius a and half thickness b, m; I₁ across and I₃ along the axis, kg m²; `tilt` α against the ground.
/// Source: Moffatt, Nature 404 (2000), extended to a thickness: the centre and the touching point rest, so ω lies on
///         the line through them, and L turns about the vertical with Ω under the torque of the weight.
pub fn euler_disk([a, b]: [f64; 2], [i1, i3]: [f64; 2], weight: f64, tilt: f64) -> f64 {
    let (sin, cos) = tilt.sin_cos();
    (weight * (a * cos - b * sin) / (sin * (i1 * cos - i3 * b / a * sin))).sqrt()
}

/// SimBenchmark's rolling test: accelerations of a pushed plate and of the n balls that roll on it.
///
///     f₁ = μ (M + n m) g,   f₂ = (F − f₁)/M / ((1 + 1/k)/m + n/M),   a_plate = (F − f₁ − n f₂)/M,   a_ball = f₂/m
///
/// In:     masses M and m, kg; push F, N; μ between plate and ground; k = I/(m R²) of a ball.
/// Source: SimBenchmark, RSL, ETH Zürich.
pub fn rolling_plate(plate: f64, ball: f64, n: f64, push: f64, mu: f64, gravity: f64, k: f64) -> [f64; 2] {
    let f1 = mu * (plate + n * ball) * gravity;
    let f2 = (push - f1) / plate / ((1.0 + 1.0 / k) / ball + n / plate);
    [(push - f1 - n * f2) / plate, f2 / ball]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elliptic_integral_at_known_places() {
        assert!((elliptic_k(0.0) - PI / 2.0).abs() < 1e-15);
        // Γ(1/4)² / (4 √π)
        assert!((elliptic_k(0.5f64.sqrt()) - 1.854_074_677_301_371_9).abs() < 1e-14);
    }

    #[test]
    fn a_thin_euler_disk_is_moffatts() {
        let (a, g, tilt) = (0.1, 9.81, 0.3f64);
        let omega = euler_disk([a, 0.0], [0.25 * a * a, 0.5 * a * a], g, tilt);
        assert!((omega * omega * tilt.sin() * a / (4.0 * g) - 1.0).abs() < 1e-14);
    }
}
