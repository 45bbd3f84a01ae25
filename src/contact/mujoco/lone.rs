//! One tree of at most six degrees of freedom against what does not move: arrays of fixed size.

use super::cone::Curvature;
use super::solver::{Constraint, Into, Space};
use crate::math::{divide_ldl, factor_ldl};

type Row = [f64; 6];

/// Most unknowns of a tree that is solved here.
pub const SIX: usize = 6;

/// M of the tree.
pub trait Mass {
    /// M v
    fn times(&self, v: &Row) -> Row;
    /// v = M⁻¹ v
    fn divide(&self, v: &mut Row);
    fn trace(&self) -> f64;
    /// Lower triangle of M, with ones on the diagonal of what is not used.
    fn matrix(&self) -> [Row; 6];
}

/// A free body in the coordinates of its mover: kg three times, and the principal moments, kg m².
pub struct Diagonal(pub Row);

impl Mass for Diagonal {
    #[inline]
    fn times(&self, v: &Row) -> Row {
        std::array::from_fn(|i| self.0[i] * v[i])
    }
    #[inline]
    fn divide(&self, v: &mut Row) {
        for i in 0..6 {
            v[i] /= self.0[i];
        }
    }
    #[inline]
    fn trace(&self) -> f64 {
        self.0.iter().sum()
    }
    #[inline]
    fn matrix(&self) -> [Row; 6] {
        let mut h = [[0.0; 6]; 6];
        for i in 0..6 {
            h[i][i] = self.0[i];
        }
        h
    }
}

/// A tree of n ≤ 6 dofs: M, row-major (n × n). Unknowns from n on stay zero.
pub struct Dense<'a> {
    pub n: usize,
    pub qm: &'a [f64],
}

impl Mass for Dense<'_> {
    #[inline]
    fn times(&self, v: &Row) -> Row {
        let mut out = [0.0; 6];
        for (out, row) in out.iter_mut().zip(self.qm.chunks_exact(self.n)) {
            *out = row.iter().zip(v).map(|(m, v)| m * v).sum();
        }
        out
    }
    fn divide(&self, v: &mut Row) {
        let mut l = self.matrix();
        factor_ldl(&mut l);
        divide_ldl(&l, v);
    }
    #[inline]
    fn trace(&self) -> f64 {
        self.qm.iter().step_by(self.n + 1).sum()
    }
    #[inline]
    fn matrix(&self) -> [Row; 6] {
        let mut h = Diagonal([1.0; 6]).matrix();
        for (h, row) in h.iter_mut().zip(self.qm.chunks_exact(self.n)) {
            h[..self.n].copy_from_slice(row);
        }
        h
    }
}

/// M and J of the problem.
pub struct Lone<'a, M> {
    pub m: M,
    /// Rows of each constraint.
    pub jac: &'a [[Row; 6]],
}

#[inline]
fn dot(a: &Row, b: &Row) -> f64 {
    (a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3]) + (a[4] * b[4] + a[5] * b[5])
}

impl<M: Mass> Space for Lone<'_, M> {
    type Vector = Row;

    #[inline]
    fn multiply_m(&self, v: &Row, out: &mut Row) {
        *out = self.m.times(v);
    }

    #[inline]
    fn divide_m(&self, v: &mut Row) {
        self.m.divide(v);
    }

    #[inline]
    fn trace_m(&self) -> f64 {
        self.m.trace()
    }

    #[inline]
    fn multiply_j(&self, v: &Row, into: Into, constraints: &mut [Constraint]) {
        for (c, jac) in constraints.iter_mut().zip(self.jac) {
            let mut product = [0.0; 6];
            for k in 0..c.cone.dim {
                product[k] = dot(&jac[k], v);
            }
            c.set(into, product);
        }
    }

    #[inline]
    fn subtract_forces(&self, constraints: &[Constraint], g: &mut Row) {
        for (c, jac) in constraints.iter().zip(self.jac) {
            for k in 0..c.cone.dim {
                for i in 0..6 {
                    g[i] -= c.force[k] * jac[k][i];
                }
            }
        }
    }

    fn newton(&mut self, constraints: &[Constraint], g: &Row, p: &mut Row) {
        let mut h = self.m.matrix();
        for (c, jac) in constraints.iter().zip(self.jac) {
            let curvature = c.cone.curvature(&c.x);
            if !matches!(curvature, Curvature::Zero) {
                add_curvature(&curvature, &jac[..c.cone.dim], &mut h);
            }
        }
        factor_ldl(&mut h);
        for i in 0..6 {
            p[i] = -g[i];
        }
        divide_ldl(&h, p);
    }
}

/// H += Jᵀ C J. Of H only the lower triangle counts; rows are added in pairs of numbers, as the machine does.
#[inline]
fn add_curvature(curvature: &Curvature, jac: &[Row], h: &mut [Row; 6]) {
    for (k, row) in jac.iter().enumerate() {
        let Some(product) = curvature.times(k, jac) else { continue };
        for i in 0..6 {
            for j in 0..(i | 1) + 1 {
                h[i][j] += row[i] * product[j];
            }
        }
    }
}
