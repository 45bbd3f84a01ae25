//! One free body against what does not move: six unknowns, arrays of fixed size.

use super::cone::Curvature;
use super::solver::{Constraint, Into, Space};

type Row = [f64; 6];

/// M and J of one free body in the coordinates of its mover, where M is diagonal.
pub struct Free<'a> {
    /// kg, kg, kg, and the principal moments, kg m².
    pub m: Row,
    /// Rows of each constraint.
    pub jac: &'a [[Row; 6]],
}

#[inline]
fn dot(a: &Row, b: &Row) -> f64 {
    (a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3]) + (a[4] * b[4] + a[5] * b[5])
}

impl Space for Free<'_> {
    type Vector = Row;

    #[inline]
    fn multiply_m(&self, v: &Row, out: &mut Row) {
        for i in 0..6 {
            out[i] = self.m[i] * v[i];
        }
    }

    #[inline]
    fn divide_m(&self, v: &mut Row) {
        for i in 0..6 {
            v[i] /= self.m[i];
        }
    }

    #[inline]
    fn trace_m(&self) -> f64 {
        self.m.iter().sum()
    }

    #[inline]
    fn multiply_j(&self, v: &Row, into: Into, constraints: &mut [Constraint]) {
        for (c, jac) in constraints.iter_mut().zip(self.jac) {
            for k in 0..c.cone.dim {
                let product = dot(&jac[k], v);
                match into {
                    Into::X => c.x[k] = product + c.bias[k],
                    Into::Y => c.y[k] = product,
                }
            }
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
        let mut h = [[0.0; 6]; 6];
        for i in 0..6 {
            h[i][i] = self.m[i];
        }
        for (c, jac) in constraints.iter().zip(self.jac) {
            add_curvature(&c.cone.curvature(&c.x), jac, c.cone.dim, &mut h);
        }
        factor(&mut h);
        for i in 0..6 {
            p[i] = -g[i];
        }
        divide(&h, p);
    }
}

/// H += Jᵀ C J, the lower triangle.
#[inline]
fn add_curvature(curvature: &Curvature, jac: &[Row; 6], dim: usize, h: &mut [Row; 6]) {
    match curvature {
        Curvature::Zero => {}
        Curvature::Diagonal(d) => {
            for k in 0..dim {
                for i in 0..6 {
                    let w = d[k] * jac[k][i];
                    for j in 0..=i {
                        h[i][j] += w * jac[k][j];
                    }
                }
            }
        }
        Curvature::Full(full) => {
            for k in 0..dim {
                let mut row = [0.0; 6];
                for l in 0..dim {
                    for j in 0..6 {
                        row[j] += full[k][l] * jac[l][j];
                    }
                }
                for i in 0..6 {
                    for j in 0..=i {
                        h[i][j] += jac[k][i] * row[j];
                    }
                }
            }
        }
    }
}

/// Cholesky factor L of a positive definite matrix, in its lower triangle; the diagonal holds 1/Lᵢᵢ.
#[inline]
fn factor(h: &mut [Row; 6]) {
    for j in 0..6 {
        let mut pivot = h[j][j];
        for k in 0..j {
            pivot -= h[j][k] * h[j][k];
        }
        let inverse = 1.0 / pivot.sqrt();
        h[j][j] = inverse;
        for i in j + 1..6 {
            let mut sum = h[i][j];
            for k in 0..j {
                sum -= h[i][k] * h[j][k];
            }
            h[i][j] = sum * inverse;
        }
    }
}

/// x = (L Lᵀ)⁻¹ x
#[inline]
fn divide(l: &[Row; 6], x: &mut Row) {
    for i in 0..6 {
        for k in 0..i {
            x[i] -= l[i][k] * x[k];
        }
        x[i] *= l[i][i];
    }
    for i in (0..6).rev() {
        for k in i + 1..6 {
            x[i] -= l[k][i] * x[k];
        }
        x[i] *= l[i][i];
    }
}
