//! How the forces of one constraint change with its accelerations: small matrices C, and their products with rows.

use super::cost::{Cone, INSIDE, Kind, OUTSIDE, Spread};

/// How forces answer to accelerations, a matrix C = −∂f/∂x: the second derivatives of s(x), or, where friction is limited
/// by a normal force that changes too, not symmetric.
#[derive(Clone, Copy, Debug)]
pub enum Curvature {
    /// No curvature.
    Zero,
    /// Its diagonal.
    Diagonal([f64; 6]),
    /// Symmetric: its diagonal, its first row and column, and among the others a multiple of the products of these.
    ///
    ///     C₀₀ = d₀,   C₀ₖ = Cₖ₀ = rₖ,   Cₖₗ = dₖ δₖₗ + ρ rₖ rₗ
    Arrow {
        /// d
        diagonal: [f64; 6],
        /// r, from the second number on.
        first: [f64; 6],
        /// ρ
        square: f64,
    },
    /// Friction that feels the normal force, which does not feel it: its diagonal, its first column, and what the two rows of
    /// sliding and the two of rolling have to do with each other.
    Limited {
        /// The diagonal.
        diagonal: [f64; 6],
        /// The first column, from the second number on.
        normal: [f64; 6],
        /// C₁₂ = C₂₁, C₄₅ = C₅₄
        turn: [f64; 2],
    },
}

/// The pairs of rows that turn into each other.
pub const TURNS: [[usize; 2]; 2] = [[1, 2], [4, 5]];

impl Curvature {
    /// C v of the first `dim` components.
    #[inline]
    pub fn times(&self, v: &[f64; 6], dim: usize) -> [f64; 6] {
        let mut out = [0.0; 6];
        match self {
            Curvature::Zero => {}
            Curvature::Diagonal(d) => (0..dim).for_each(|k| out[k] = d[k] * v[k]),
            Curvature::Arrow { diagonal, first, square } => {
                let sum: f64 = (1..dim).map(|k| first[k] * v[k]).sum();
                out[0] = diagonal[0] * v[0] + sum;
                (1..dim).for_each(|k| out[k] = diagonal[k] * v[k] + first[k] * (v[0] + square * sum));
            }
            Curvature::Limited { diagonal, normal, turn } => {
                out[0] = diagonal[0] * v[0];
                (1..dim).for_each(|k| out[k] = diagonal[k] * v[k] + normal[k] * v[0]);
                for ([k, l], turn) in TURNS.into_iter().zip(turn).filter(|([_, l], _)| *l < dim) {
                    out[k] += turn * v[l];
                    out[l] += turn * v[k];
                }
            }
        }
        out
    }

    /// C, written out.
    pub fn matrix(&self) -> [[f64; 6]; 6] {
        let columns: [_; 6] =
            std::array::from_fn(|l| self.times(&std::array::from_fn(|j| f64::from(u8::from(j == l))), 6));
        std::array::from_fn(|k| std::array::from_fn(|l| columns[l][k]))
    }
}

impl Cone {
    /// Second derivatives of s at `x`, between its components.
    #[inline]
    pub fn curvature(&self, x: &Spread) -> Curvature {
        let d = self.d[0];
        match self.kind {
            Kind::OneSided if x[0] < 0.0 => Curvature::Diagonal([d, 0.0, 0.0, 0.0, 0.0, 0.0]),
            Kind::Dry if self.frozen == 0 && (d * x[0]).abs() < self.mu[0] => {
                Curvature::Diagonal([d, 0.0, 0.0, 0.0, 0.0, 0.0])
            }
            Kind::OneSided | Kind::Dry => Curvature::Zero,
            Kind::TwoSided => Curvature::Diagonal(self.d),
            Kind::Pyramid => self.curvature_of_pyramid(x),
            Kind::Ellipse => self.curvature_of_ellipse(x),
            Kind::Coulomb => self.curvature_of_coulomb(x),
        }
    }

    #[inline]
    fn curvature_of_coulomb(&self, x: &Spread) -> Curvature {
        let (mut diagonal, mut turn) = ([0.0; 6], [0.0; 2]);
        if x[0] < 0.0 {
            diagonal[0] = self.d[0];
        }
        let groups = self.groups().filter(|_| self.frozen == 0);
        for group in groups {
            let (d, square) = (self.d[group.start], self.square(x, &group));
            let weight = |k: usize| self.mu[k] * self.mu[k];
            if d * d * square <= self.limit * self.limit {
                group.for_each(|k| diagonal[k] = d * weight(k));
            } else if group.len() == 2 {
                // n T'' = n/T (μ² − w wᵀ),  wₖ = μₖ²xₖ/T
                let (a, b, length) = (group.start, group.start + 1, square.sqrt());
                let both = self.limit / length * weight(a) * weight(b) / square;
                diagonal[a] = both * x[b] * x[b];
                diagonal[b] = both * x[a] * x[a];
                turn[usize::from(a > 1)] = -both * x[a] * x[b];
            }
        }
        Curvature::Limited { diagonal, normal: [0.0; 6], turn }
    }

    #[inline]
    fn curvature_of_pyramid(&self, x: &Spread) -> Curvature {
        let d = self.d[0];
        // D for each edge that pushes; per friction direction the sum and the difference of its two edges.
        let (mut diagonal, mut first) = ([0.0; 6], [0.0; 6]);
        for (pair, j) in x.as_chunks::<2>().0.iter().zip(1..self.dim) {
            let [plus, minus] = pair.map(|x| if x < 0.0 { d } else { 0.0 });
            diagonal[0] += plus + minus;
            diagonal[j] = self.mu[j] * self.mu[j] * (plus + minus);
            first[j] = self.mu[j] * (plus - minus);
        }
        if diagonal[0] == 0.0 { Curvature::Zero } else { Curvature::Arrow { diagonal, first, square: 0.0 } }
    }

    fn curvature_of_ellipse(&self, x: &Spread) -> Curvature {
        let (zone, n, t) = self.zone_of_ellipse(x);
        match zone {
            OUTSIDE => Curvature::Zero,
            INSIDE => Curvature::Diagonal(self.d),
            _ => {
                let (mu, dm) = (self.mu[0], self.middle());
                // s = D'/2 g², g = N − μ̃T: s'' = D' (g' g'ᵀ + g g''), where T' = w, wₖ = μₖ²xₖ/T, T'' = (μ² − w wᵀ) / T.
                let (normal, turn) = (dm * mu * mu, -dm * mu * (n - mu * t) / t);
                let (mut diagonal, mut first) = ([0.0; 6], [0.0; 6]);
                diagonal[0] = normal;
                for j in 1..self.dim {
                    diagonal[j] = turn * self.mu[j] * self.mu[j];
                    first[j] = -normal * self.mu[j] * self.mu[j] * x[j] / t;
                }
                Curvature::Arrow { diagonal, first, square: (normal - turn) / (normal * normal) }
            }
        }
    }
}

/// One of each kind for `dim` components, for tests; the last is not symmetric (where there is friction).
#[cfg(test)]
pub fn examples(dim: usize) -> [Curvature; 5] {
    let number = |k: usize| (k as f64 * 1.7).sin();
    let within = |first: usize, of: &dyn Fn(usize) -> f64| -> [f64; 6] {
        std::array::from_fn(|k| if (first..dim).contains(&k) { of(k) } else { 0.0 })
    };
    let (diagonal, first) = (within(0, &|k| 2.0 + number(k)), within(1, &|k| 0.3 * number(k + 1)));
    let turn = [(2, 0.2), (5, -0.3)].map(|(last, turn)| if last < dim { turn } else { 0.0 });
    [
        Curvature::Zero,
        Curvature::Diagonal(diagonal),
        Curvature::Arrow { diagonal, first, square: 0.4 },
        Curvature::Limited { diagonal, normal: [0.0; 6], turn },
        Curvature::Limited { diagonal, normal: first, turn },
    ]
}
