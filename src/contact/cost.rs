//! What one constraint costs: s(x), its force −∂s/∂x and its curvature ∂²s/∂x².
//!
//! `x = J a − a_ref` is how far a constraint's accelerations are from what it wants. For a contact its components
//! are normal, two tangential, torsional, two rolling, as many as `dim` says, under either kind of cone. A pyramid's
//! cost is a sum over its edges n ± μⱼtⱼ. Its rows of J stay those of the components: fewer, and where friction is
//! tiny and the edges are all but parallel, as in the tutorial's disk, no digits are lost in their differences. But
//! its x is kept edge by edge ([`Spread`]): on an edge that pushes it is R f, 4e-10 m/s² in the disk, and the sum of
//! two components of 1e2 m/s² would leave four digits of it.
//!
//! Coulomb friction under a given normal force n, the `penalty` law's, is a cost of its own ([`Kind::Coulomb`]).
//!
//! Source: MuJoCo 4.0 manual, Computation › Constraint model and Solver › Primal problem; the elliptic cost from
//! minimising over the cone in closed form.

/// The shape of s(x).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    /// Pushes, never pulls: s = D/2 min(x, 0)². Frictionless contacts and joint limits.
    #[default]
    OneSided,
    /// Resists either way, but with no more than `loss` (N or N m): s quadratic, linear beyond |x| = loss/D.
    Dry,
    /// Pushes and pulls: s = Σ Dₖ/2 xₖ² over all rows. Equalities.
    TwoSided,
    /// s = D/2 Σⱼ min(x₀ + μⱼxⱼ, 0)² + min(x₀ − μⱼxⱼ, 0)².
    Pyramid,
    /// s depends on where x lies: nothing inside the cone, quadratic far outside, and between these
    /// s = D (N − μ̃T)² / (2 μ̃² (1 + μ̃²)) with N = μ̃x₀, T = |μⱼxⱼ|.
    Ellipse,
    /// Normal and friction do not feel each other: D₀/2 min(x₀, 0)² for the normal, and for each of sliding, spinning
    /// and rolling Huber's function of the slip, quadratic up to the force that `limit` allows, a cone above:
    ///
    ///     s = D/2 T²  for D T ≤ n,     n T − n²/(2 D)  beyond,     T = |μⱼxⱼ| over the rows of the group
    ///
    /// with n the normal force `limit`. Its force −∂s/∂xⱼ is at most μⱼ n and opposes the slip.
    Coulomb,
}

/// A constraint's cost function.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cone {
    /// Which cost.
    pub kind: Kind,
    /// Components of x that count: 1, 3, 4 or 6.
    pub dim: usize,
    /// Inverse regularisations D = 1/R, kg (kg m² for angles). A pyramid has one for all its edges, in `d[0]`.
    ///
    /// The friction rows of [`Kind::Coulomb`] hold D of their group, of the slip times its coefficient.
    pub d: [f64; 6],
    /// Friction coefficients beside the components they belong to. In `mu[0]` a pyramid has nothing, an ellipse
    /// its regularised coefficient μ̃ = μ₁ √(R₁/R₀), dry friction its largest force.
    pub mu: [f64; 6],
    /// The normal force by which [`Kind::Coulomb`] limits friction, N.
    pub limit: f64,
    /// Rows from here to `dim` do not feel the acceleration: their x is the bias. (Counted from the end: 0 for none.)
    pub frozen: usize,
}

/// The friction rows of a contact that share a limit: sliding, spinning, rolling.
pub const GROUPS: [std::ops::Range<usize>; 3] = [1..3, 3..4, 4..6];

/// x, or its change, as s(x) takes it: component by component; of a pyramid edge by edge, n + μ₁t₁, n − μ₁t₁, n + μ₂t₂ …
pub type Spread = [f64; 10];

/// Which piece of s(x) a point is in: the same number means the same formula.
pub type Zone = u16;

/// No force.
pub const OUTSIDE: Zone = 0;
/// On the cone or limit.
pub const BETWEEN: Zone = 1;
/// Quadratic in all directions.
pub const INSIDE: Zone = 2;
/// Of [`Kind::Coulomb`]: sliding or rolling at the limit. (Bit 0: pushes; bit of a group's first row: at its limit.)
const TURNS: Zone = 1 << 1 | 1 << 4;

impl Cone {
    /// How many numbers of a [`Spread`] count.
    #[inline]
    pub fn width(&self) -> usize {
        if self.kind == Kind::Pyramid { 2 * (self.dim - 1) } else { self.dim }
    }

    /// x, or a change of x, from its components; what does not count is left as it is.
    #[inline(always)]
    pub fn spread(&self, x: &[f64; 6], out: &mut Spread) {
        if self.kind == Kind::Pyramid {
            for j in 1..self.dim {
                let slip = self.mu[j] * x[j];
                (out[2 * j - 2], out[2 * j - 1]) = (x[0] + slip, x[0] - slip);
            }
        } else {
            out[..6].copy_from_slice(x);
        }
    }

    /// Cost s(x), and the force f = −∂s/∂x on the components.
    ///
    /// In:  `x` in m/s² and rad/s².
    /// Out: cost; `force` in N and N m; the zone of `x`.
    #[inline]
    pub fn cost(&self, x: &Spread, force: &mut [f64; 6]) -> (f64, Zone) {
        match self.kind {
            Kind::OneSided => {
                let x = x[0].min(0.0);
                force[0] = -self.d[0] * x;
                (0.5 * self.d[0] * x * x, Zone::from(x < 0.0))
            }
            Kind::Dry => {
                let (d, loss) = (self.d[0], self.mu[0]);
                let f = d * x[0];
                force[0] = -f.clamp(-loss, loss);
                if f.abs() < loss {
                    (0.5 * f * x[0], INSIDE)
                } else {
                    (loss * (x[0].abs() - 0.5 * loss / d), Zone::from(f > 0.0))
                }
            }
            Kind::TwoSided => {
                let mut cost = 0.0;
                for k in 0..self.dim {
                    force[k] = -self.d[k] * x[k];
                    cost -= 0.5 * force[k] * x[k];
                }
                (cost, INSIDE)
            }
            Kind::Pyramid => self.cost_of_pyramid(x, force),
            Kind::Ellipse => self.cost_of_ellipse(x, force),
            Kind::Coulomb => self.cost_of_coulomb(x, force),
        }
    }

    #[inline]
    fn cost_of_coulomb(&self, x: &Spread, force: &mut [f64; 6]) -> (f64, Zone) {
        let normal = x[0].min(0.0);
        force[0] = -self.d[0] * normal;
        let (mut cost, mut zone) = (0.5 * self.d[0] * normal * normal, Zone::from(normal < 0.0));
        for group in self.groups() {
            let (d, square) = (self.d[group.start], self.square(x, &group));
            if d * d * square <= self.limit * self.limit {
                group.for_each(|k| force[k] = -d * self.mu[k] * self.mu[k] * x[k]);
                cost += 0.5 * d * square;
            } else {
                let t = square.sqrt();
                zone |= 1 << group.start;
                // Alone, a slip to the left is another piece than one to the right.
                zone |= Zone::from(group.len() == 1 && x[group.start] < 0.0) << 6;
                group.for_each(|k| force[k] = -self.limit / t * self.mu[k] * self.mu[k] * x[k]);
                cost += self.limit * (t - 0.5 * self.limit / d);
            }
        }
        (cost, zone)
    }

    /// The groups of friction rows that there are.
    #[inline(always)]
    pub fn groups(&self) -> impl Iterator<Item = std::ops::Range<usize>> {
        let dim = self.dim;
        GROUPS.into_iter().take_while(move |group| group.end <= dim)
    }

    /// T² of a group of friction rows.
    #[inline(always)]
    pub fn square(&self, x: &Spread, group: &std::ops::Range<usize>) -> f64 {
        group.clone().map(|k| self.mu[k] * self.mu[k] * x[k] * x[k]).sum()
    }

    #[inline(always)]
    pub fn cost_of_pyramid(&self, x: &Spread, force: &mut [f64; 6]) -> (f64, Zone) {
        let d = self.d[0];
        let (mut cost, mut normal, mut zone) = ([0.0; 2], [0.0; 2], 0);
        for (pair, j) in x.as_chunks::<2>().0.iter().zip(1..self.dim) {
            zone = (zone << 2) | (Zone::from(pair[0] < 0.0) << 1) | Zone::from(pair[1] < 0.0);
            let pair = pair.map(|x| x.min(0.0));
            for k in 0..2 {
                cost[k] += pair[k] * pair[k];
                normal[k] += pair[k];
            }
            force[j] = -d * self.mu[j] * (pair[0] - pair[1]);
        }
        force[0] = -d * (normal[0] + normal[1]);
        (0.5 * d * (cost[0] + cost[1]), zone)
    }

    /// The edges of a pyramid that will carry force if it slips: x with no other edges. `None` where it will not slip, or is
    /// no pyramid.
    ///
    /// It slips where what would stop the slip is more than friction can be, |xⱼ|/Aⱼⱼ > μⱼ |x₀|/A₀₀, and then the edge that is
    /// violated most carries all of the force.
    ///
    /// In: `x` without forces; `inverse` masses A of the components' rows.
    pub fn likely(&self, x: &Spread, inverse: &[f64; 6]) -> Option<Spread> {
        if self.kind != Kind::Pyramid {
            return None;
        }
        let (edges, dim) = (&x[..self.width()], self.dim);
        let most = (0..edges.len()).fold(0, |most, edge| if edges[edge] < edges[most] { edge } else { most });
        let slips = |j: usize| {
            let (sum, difference) = (x[2 * j - 2] + x[2 * j - 1], x[2 * j - 2] - x[2 * j - 1]);
            difference.abs() * inverse[0] > self.mu[j] * self.mu[j] * inverse[j] * sum.abs()
        };
        if edges[most] >= 0.0 || !(1..dim).any(slips) {
            return None;
        }
        let mut alone = [0.0; 10];
        alone[most] = edges[most];
        Some(alone)
    }

    #[inline]
    fn cost_of_ellipse(&self, x: &Spread, force: &mut [f64; 6]) -> (f64, Zone) {
        let (zone, n, t) = self.zone_of_ellipse(x);
        match zone {
            OUTSIDE => {
                *force = [0.0; 6];
                (0.0, zone)
            }
            INSIDE => {
                let mut cost = 0.0;
                for j in 0..self.dim {
                    force[j] = -self.d[j] * x[j];
                    cost -= 0.5 * force[j] * x[j];
                }
                (cost, zone)
            }
            _ => {
                let (mu, dm) = (self.mu[0], self.middle());
                let gap = n - mu * t;
                force[0] = -dm * gap * mu;
                for j in 1..self.dim {
                    // −∂s/∂xⱼ = D' (N − μ̃T) μ̃ ∂T/∂xⱼ
                    force[j] = dm * gap * mu * self.mu[j] * self.mu[j] * x[j] / t;
                }
                (0.5 * dm * gap * gap, zone)
            }
        }
    }

    /// The zone, N and T of a point under an elliptic cone.
    #[inline]
    pub fn zone_of_ellipse(&self, x: &Spread) -> (Zone, f64, f64) {
        let mu = self.mu[0];
        let n = mu * x[0];
        let mut squares = 0.0;
        for j in 1..self.dim {
            let u = self.mu[j] * x[j];
            squares += u * u;
        }
        let t = squares.sqrt();
        let zone = if n >= mu * t {
            OUTSIDE
        } else if mu * n + t <= 0.0 {
            INSIDE
        } else {
            BETWEEN
        };
        (zone, n, t)
    }

    /// The weight between the zones, D / (μ̃² (1 + μ̃²)).
    #[inline]
    pub fn middle(&self) -> f64 {
        let square = self.mu[0] * self.mu[0];
        self.d[0] / (square * (1.0 + square))
    }

    /// Whether s is quadratic (or linear) throughout a zone.
    #[inline]
    pub fn is_quadratic(&self, zone: Zone) -> bool {
        match self.kind {
            Kind::Ellipse => zone != BETWEEN,
            // Friction in a plane turns with the slip.
            Kind::Coulomb => zone & TURNS == 0 || self.limit == 0.0,
            _ => true,
        }
    }

    /// First and second derivative of s(x + α y) with respect to α.
    #[inline]
    pub fn along(&self, x: &Spread, y: &Spread, alpha: f64) -> (f64, f64) {
        let d = self.d[0];
        match self.kind {
            Kind::OneSided => {
                let z = x[0] + alpha * y[0];
                if z < 0.0 { (d * z * y[0], d * y[0] * y[0]) } else { (0.0, 0.0) }
            }
            Kind::Dry => {
                let f = d * (x[0] + alpha * y[0]);
                let loss = self.mu[0];
                if f.abs() < loss { (f * y[0], d * y[0] * y[0]) } else { (f.clamp(-loss, loss) * y[0], 0.0) }
            }
            Kind::TwoSided => {
                let rows = || (0..self.dim).map(|k| (self.d[k] * y[k], x[k] + alpha * y[k], y[k]));
                (rows().map(|(dy, z, _)| dy * z).sum(), rows().map(|(dy, _, y)| dy * y).sum())
            }
            Kind::Pyramid => {
                let (mut first, mut second) = ([0.0; 2], [0.0; 2]);
                let pairs = x.as_chunks::<2>().0.iter().zip(y.as_chunks::<2>().0);
                for (x, y) in pairs.take(self.dim - 1) {
                    for k in 0..2 {
                        let z = x[k] + alpha * y[k];
                        let pushed = if z < 0.0 { y[k] } else { 0.0 };
                        first[k] += z * pushed;
                        second[k] += y[k] * pushed;
                    }
                }
                (d * (first[0] + first[1]), d * (second[0] + second[1]))
            }
            Kind::Ellipse => self.along_ellipse(x, y, alpha),
            Kind::Coulomb => self.along_coulomb(x, y, alpha),
        }
    }

    fn along_coulomb(&self, x: &Spread, y: &Spread, alpha: f64) -> (f64, f64) {
        let z: Spread = std::array::from_fn(|k| x[k] + alpha * y[k]);
        let (mut first, mut second) = (0.0, 0.0);
        if z[0] < 0.0 {
            (first, second) = (self.d[0] * z[0] * y[0], self.d[0] * y[0] * y[0]);
        }
        for group in self.groups() {
            let (d, square, rate) = (self.d[group.start], self.square(&z, &group), self.square(y, &group));
            let turn: f64 = group.map(|k| self.mu[k] * self.mu[k] * z[k] * y[k]).sum();
            if d * d * square <= self.limit * self.limit {
                first += d * turn;
                second += d * rate;
            } else {
                let t = square.sqrt();
                first += self.limit * turn / t;
                // T'' = (|v|² − (u·v)²/T²)/T
                second += self.limit * (rate - turn * turn / square).max(0.0) / t;
            }
        }
        (first, second)
    }

    fn along_ellipse(&self, x: &Spread, y: &Spread, alpha: f64) -> (f64, f64) {
        let mut z = [0.0; 10];
        for j in 0..self.dim {
            z[j] = x[j] + alpha * y[j];
        }
        let (zone, n, t) = self.zone_of_ellipse(&z);
        let (mut first, mut second) = (0.0, 0.0);
        match zone {
            OUTSIDE => {}
            INSIDE => {
                for j in 0..self.dim {
                    first += self.d[j] * z[j] * y[j];
                    second += self.d[j] * y[j] * y[j];
                }
            }
            _ => {
                let (mu, dm) = (self.mu[0], self.middle());
                let (mut uv, mut vv) = (0.0, 0.0);
                for j in 1..self.dim {
                    let v = self.mu[j] * y[j];
                    uv += self.mu[j] * z[j] * v;
                    vv += v * v;
                }
                let (gap, turn) = (n - mu * t, uv / t);
                let rate = mu * (y[0] - turn);
                first = dm * gap * rate;
                second = dm * (rate * rate - mu * gap * (vv - turn * turn) / t);
            }
        }
        (first, second)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One cone of each shape, with points in all its zones.
    fn cases() -> Vec<(Cone, [f64; 6])> {
        let mu = [0.4, 0.5, 0.7, 0.02, 0.01, 0.03];
        let d = [3.0, 5.0, 2.0, 0.4, 0.3, 0.2];
        let points = [
            [-1.0, 0.3, -0.2, 0.5, 0.1, -0.7],
            [0.1, 2.0, -1.0, 3.0, 5.0, 4.0],
            [-0.2, 2.0, 1.0, 9.0, -5.0, 4.0],
            [3.0, 0.5, 1.0, 1.0, 1.0, 1.0],
            [-2.0, 0.1, 0.1, 0.1, 0.1, 0.1],
        ];
        let mut cases = Vec::new();
        for (kind, dims) in [
            (Kind::OneSided, &[1][..]),
            (Kind::Dry, &[1]),
            (Kind::TwoSided, &[1, 3, 6]),
            (Kind::Pyramid, &[3, 4, 6]),
            (Kind::Ellipse, &[3, 4, 6]),
            (Kind::Coulomb, &[1, 3, 4, 6]),
        ] {
            for &dim in dims {
                for x in points {
                    // On an elliptic cone the pieces of s only meet if Rⱼ μⱼ² is the same for all friction rows.
                    let mut d = d;
                    if kind == Kind::Ellipse {
                        for j in 1..6 {
                            d[j] = d[0] * mu[j] * mu[j] / (mu[0] * mu[0]);
                        }
                    }
                    if kind == Kind::Coulomb {
                        (d[2], d[5]) = (d[1], d[4]);
                    }
                    cases.push((Cone { kind, dim, d, mu, limit: 0.8, frozen: 0 }, x));
                }
            }
        }
        cases
    }

    fn spread(cone: &Cone, x: &[f64; 6]) -> Spread {
        let mut out = [0.0; 10];
        cone.spread(x, &mut out);
        out
    }

    fn cost(cone: &Cone, x: &[f64; 6]) -> (f64, [f64; 6]) {
        let mut force = [0.0; 6];
        let (s, _) = cone.cost(&spread(cone, x), &mut force);
        (s, force)
    }

    #[test]
    fn force_is_minus_the_gradient_and_curvature_its_derivative() {
        let h = 1e-5; // truncation h² ~ 1e-10, rounding 1e-16/h ~ 1e-11
        for (cone, x) in cases() {
            let full = cone.curvature(&spread(&cone, &x)).matrix();
            let (_, force) = cost(&cone, &x);
            for j in 0..cone.dim {
                let (mut up, mut down) = (x, x);
                up[j] += h;
                down[j] -= h;
                let ((s1, f1), (s0, f0)) = (cost(&cone, &up), cost(&cone, &down));
                assert!((-(s1 - s0) / (2.0 * h) - force[j]).abs() < 1e-8, "{cone:?} {x:?} force {j}");
                for i in 0..cone.dim {
                    let slope = -(f1[i] - f0[i]) / (2.0 * h);
                    assert!((slope - full[i][j]).abs() < 1e-7, "{cone:?} {x:?} curvature {i} {j}");
                }
            }
        }
    }

    #[test]
    fn derivatives_along_a_line_are_those_of_the_cost() {
        let y = [0.3, -0.4, 0.8, 0.6, -0.2, 1.1];
        for (cone, x) in cases() {
            for alpha in [0.0, 0.4] {
                let (first, second) = cone.along(&spread(&cone, &x), &spread(&cone, &y), alpha);
                let h = 1e-5; // as above
                let at = |a: f64| cost(&cone, &std::array::from_fn(|j| x[j] + a * y[j])).0;
                assert!((first - (at(alpha + h) - at(alpha - h)) / (2.0 * h)).abs() < 1e-8, "{cone:?} {x:?}");
                let slope = |a: f64| cone.along(&spread(&cone, &x), &spread(&cone, &y), a).0;
                assert!((second - (slope(alpha + h) - slope(alpha - h)) / (2.0 * h)).abs() < 1e-7, "{cone:?} {x:?}");
            }
        }
    }

    #[test]
    fn forces_stay_in_their_cone() {
        for (cone, x) in cases() {
            let (_, f) = cost(&cone, &x);
            let used: f64 = match cone.kind {
                Kind::OneSided => 0.0,
                Kind::TwoSided => continue,
                Kind::Coulomb => {
                    for group in cone.groups() {
                        let used = group.map(|k| (f[k] / cone.mu[k]).powi(2)).sum::<f64>().sqrt();
                        assert!(used <= cone.limit * (1.0 + 1e-12), "{cone:?} {x:?}: {f:?}");
                    }
                    continue;
                }
                Kind::Dry => {
                    assert!(f[0].abs() <= cone.mu[0]);
                    continue;
                }
                Kind::Pyramid => (1..cone.dim).map(|j| (f[j] / cone.mu[j]).abs()).sum(),
                Kind::Ellipse => (1..cone.dim).map(|j| (f[j] / cone.mu[j]).powi(2)).sum::<f64>().sqrt(),
            };
            assert!(f[0] >= 0.0 && used <= f[0] * (1.0 + 1e-12), "{cone:?} {x:?}: {f:?}");
        }
    }

    #[test]
    fn zones_name_the_pieces() {
        let (cone, _) = cases().into_iter().find(|(c, _)| c.kind == Kind::Ellipse).unwrap();
        let mut f = [0.0; 6];
        for (x, zone) in [([1.0, 0.0, 0.0], OUTSIDE), ([-1.0, 0.0, 0.0], INSIDE), ([0.0, 1.0, 0.0], BETWEEN)] {
            assert_eq!(cone.cost(&spread(&cone, &[x[0], x[1], x[2], 0.0, 0.0, 0.0]), &mut f).1, zone);
        }
    }
}
