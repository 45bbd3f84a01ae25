//! How the forces of one constraint change with its accelerations: small matrices C, and their products with rows.

use super::cost::{Cone, INSIDE, Kind, OUTSIDE, Spread};

/// How forces answer to accelerations, a matrix C = −∂f/∂x: the second derivatives of s(x), or, where friction is limited
/// by a normal force that changes too, not symmetric.
// On the stack of every solve: a box would allocate in a step.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Copy, Debug)]
pub enum Curvature {
    /// No curvature.
    Zero,
    /// Its diagonal.
    Diagonal([f64; 6]),
    /// Symmetric, with nothing but its diagonal and its first row and column.
    Arrow {
        /// The diagonal.
        diagonal: [f64; 6],
        /// The first row, from the second number on.
        first: [f64; 6],
    },
    /// All of it.
    Full([[f64; 6]; 6]),
}

impl Curvature {
    /// C v of the first `dim` components.
    #[inline]
    pub fn times(&self, v: &[f64; 6], dim: usize) -> [f64; 6] {
        let mut out = [0.0; 6];
        match self {
            Curvature::Zero => {}
            Curvature::Diagonal(d) => (0..dim).for_each(|k| out[k] = d[k] * v[k]),
            Curvature::Arrow { diagonal, first } => {
                out[0] = diagonal[0] * v[0];
                for k in 1..dim {
                    out[0] += first[k] * v[k];
                    out[k] = first[k] * v[0] + diagonal[k] * v[k];
                }
            }
            Curvature::Full(full) => (0..dim).for_each(|k| out[k] = (0..dim).map(|j| full[k][j] * v[j]).sum()),
        }
        out
    }

    /// C, written out.
    pub fn matrix(&self) -> [[f64; 6]; 6] {
        match self {
            Curvature::Full(full) => *full,
            _ => std::array::from_fn(|k| self.times(&std::array::from_fn(|j| f64::from(u8::from(j == k))), 6)),
        }
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
        let mut full = [[0.0; 6]; 6];
        if x[0] < 0.0 {
            full[0][0] = self.d[0];
        }
        if self.frozen > 0 {
            return Curvature::Full(full);
        }
        for group in self.groups() {
            let (d, square) = (self.d[group.start], self.square(x, &group));
            let weight = |k: usize| self.mu[k] * self.mu[k];
            if d * d * square <= self.limit * self.limit {
                group.for_each(|k| full[k][k] = d * weight(k));
            } else if group.len() == 2 {
                // n T'' = n/T (μ² − w wᵀ),  wₖ = μₖ²xₖ/T
                let (a, b, turn) = (group.start, group.start + 1, self.limit / square.sqrt());
                let both = turn * weight(a) * weight(b) / square;
                full[a][a] = both * x[b] * x[b];
                full[b][b] = both * x[a] * x[a];
                full[a][b] = -both * x[a] * x[b];
                full[b][a] = full[a][b];
            }
        }
        Curvature::Full(full)
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
        if diagonal[0] == 0.0 { Curvature::Zero } else { Curvature::Arrow { diagonal, first } }
    }

    fn curvature_of_ellipse(&self, x: &Spread) -> Curvature {
        let (zone, n, t) = self.zone_of_ellipse(x);
        match zone {
            OUTSIDE => Curvature::Zero,
            INSIDE => Curvature::Diagonal(self.d),
            _ => {
                let (mu, dm) = (self.mu[0], self.middle());
                let gap = n - mu * t;
                // s = D'/2 g², g = N − μ̃T: s'' = D' (g' g'ᵀ + g g''), where T' = w, T'' = (μ² − w wᵀ) / T.
                let mut w = [0.0; 6];
                for j in 1..self.dim {
                    w[j] = self.mu[j] * self.mu[j] * x[j] / t;
                }
                let mut full = [[0.0; 6]; 6];
                full[0][0] = dm * mu * mu;
                for j in 1..self.dim {
                    full[0][j] = -dm * mu * mu * w[j];
                    full[j][0] = full[0][j];
                    for k in 1..=j {
                        let own = if j == k { self.mu[j] * self.mu[j] } else { 0.0 };
                        full[j][k] = dm * mu * (mu * w[j] * w[k] - gap * (own - w[j] * w[k]) / t);
                        full[k][j] = full[j][k];
                    }
                }
                Curvature::Full(full)
            }
        }
    }
}
