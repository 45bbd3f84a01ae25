//! Newton's matrix H = 1 + Wᵀ C W of an island of six unknowns, one free body or one small tree: arrays of fixed size instead
//! of blocks.
//!
//! It does what [`super::block_factor`] does for one block, in a third of the instructions (a step of the tutorial's disk: 1,130
//! instead of 3,400, of which half are for filling H).

use super::block_factor::Shape;
use super::curvature::Curvature;
use super::rows::{Row, SIX};

/// H, or its factors: H = L U, L below the diagonal (with ones on it), U above, the inverse of U's diagonal on it.
#[derive(Clone, Debug, Default)]
pub struct Six {
    h: [Row; SIX],
}

impl Six {
    /// Starts with the unit matrix.
    pub fn unit(&mut self) {
        self.h = [[0.0; SIX]; SIX];
        (0..SIX).for_each(|i| self.h[i][i] = 1.0);
    }

    /// H += Wᵀ C W of one constraint. Of a symmetric H the upper triangle counts.
    #[inline]
    pub fn add(&mut self, curvature: &Curvature, w: &[Row], shape: Shape) {
        let mut outer = |row: &Row, product: &Row| match shape {
            Shape::Symmetric => add_outer::<true>(&mut self.h, row, product),
            Shape::General => add_outer::<false>(&mut self.h, row, product),
        };
        match curvature {
            Curvature::Zero => {}
            Curvature::Diagonal(d) => {
                for (row, d) in w.iter().zip(d).filter(|(_, d)| **d != 0.0) {
                    outer(row, &row.map(|w| d * w));
                }
            }
            Curvature::Arrow { diagonal, first } => {
                let Some((normal, rest)) = w.split_first() else { return };
                let mut sum = normal.map(|w| diagonal[0] * w);
                for ((row, d), f) in rest.iter().zip(&diagonal[1..]).zip(&first[1..]).filter(|((_, d), _)| **d != 0.0) {
                    (0..SIX).for_each(|i| sum[i] += f * row[i]);
                    outer(row, &std::array::from_fn(|i| d * row[i] + f * normal[i]));
                }
                outer(normal, &sum);
            }
            Curvature::Full(full) => {
                for (row, c) in w.iter().zip(full) {
                    let mut product = [0.0; SIX];
                    for (row, c) in w.iter().zip(c).filter(|(_, c)| **c != 0.0) {
                        (0..SIX).for_each(|i| product[i] += c * row[i]);
                    }
                    outer(row, &product);
                }
            }
        }
    }

    /// Replaces H by its factors. Rows are not exchanged.
    pub fn factor(&mut self, shape: Shape) {
        match shape {
            Shape::Symmetric => eliminate::<true>(&mut self.h),
            Shape::General => eliminate::<false>(&mut self.h),
        }
    }

    /// x = H⁻¹ x
    #[inline]
    pub fn divide(&self, x: &mut Row) {
        let h = &self.h;
        for i in 0..SIX {
            for j in i + 1..SIX {
                x[j] -= h[j][i] * x[i];
            }
        }
        for i in (0..SIX).rev() {
            for j in i + 1..SIX {
                x[i] -= h[i][j] * x[j];
            }
            x[i] *= h[i][i];
        }
    }
}

/// H += a bᵀ, in pairs of numbers, as the machine works; of a symmetric H the upper triangle.
#[inline(always)]
fn add_outer<const SYMMETRIC: bool>(h: &mut [Row; SIX], a: &Row, b: &Row) {
    for i in 0..SIX {
        for j in if SYMMETRIC { i / 2 * 2 } else { 0 }..SIX {
            h[i][j] += a[i] * b[j];
        }
    }
}

/// Gauss's elimination; of a symmetric H the upper triangle is read.
#[inline(always)]
fn eliminate<const SYMMETRIC: bool>(h: &mut [Row; SIX]) {
    for i in 0..SIX {
        let own = h[i];
        let inverse = 1.0 / own[i];
        for j in i + 1..SIX {
            let factor = inverse * if SYMMETRIC { own[j] } else { h[j][i] };
            for k in if SYMMETRIC { j / 2 * 2 } else { i.next_multiple_of(2) }..SIX {
                h[j][k] -= factor * own[k];
            }
            h[j][i] = factor;
        }
        h[i][i] = inverse;
    }
}

#[cfg(test)]
mod tests {
    use std::array::from_fn;

    use super::*;
    use crate::math::{Mat6, Vec6};

    /// Every kind of curvature, symmetric and not, against the dense matrix.
    #[test]
    fn solves_what_the_dense_matrix_solves() {
        let number = |k: usize| (k as f64 * 1.7).sin();
        let w: [Row; SIX] = from_fn(|k| from_fn(|i| number(7 * k + i)));
        let diagonal = from_fn(|k| 2.0 + number(k));
        let first = from_fn(|k| if k == 0 { 0.0 } else { 0.3 * number(k) });
        let skew = |part: f64| {
            Curvature::Full(from_fn(|k| {
                from_fn(|j| if k == j { 3.0 } else { 0.2 * number(k + j) + part * number(6 * k + j) })
            }))
        };
        let symmetric =
            [Curvature::Zero, Curvature::Diagonal(diagonal), Curvature::Arrow { diagonal, first }, skew(0.0)];
        for (shape, last) in [(Shape::Symmetric, skew(0.0)), (Shape::General, skew(0.2))] {
            let (mut six, mut dense) = (Six::default(), Mat6::identity());
            six.unit();
            for (curvature, dim) in symmetric.iter().chain([&last]).zip([6, 1, 6, 3, 6]) {
                six.add(curvature, &w[..dim], shape);
                let rows = Mat6::from_fn(|k, i| if k < dim { w[k][i] } else { 0.0 });
                let c = curvature.matrix();
                dense += rows.transpose() * Mat6::from_fn(|k, j| c[k][j]) * rows;
            }
            let right: Row = from_fn(number);
            let mut x = right;
            six.factor(shape);
            six.divide(&mut x);
            let off = (dense * Vec6::from(x) - Vec6::from(right)).amax();
            assert!(off < 1e-12, "{shape:?}: {off:e}");
        }
    }
}
