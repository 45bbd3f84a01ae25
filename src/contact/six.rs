//! Newton's matrix H = 1 + Wᵀ C W of an island of six unknowns, one free body or one small tree: arrays of fixed size instead
//! of blocks.
//!
//! It does what [`super::block_factor`] does for one block, in a third of the instructions (a step of the tutorial's disk: 1,130
//! instead of 3,400, of which half are for filling H).

use super::block_factor::Shape;
use super::curvature::{Curvature, TURNS};
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
        // C W
        let mut products = [[0.0; SIX]; SIX];
        match curvature {
            Curvature::Zero => return,
            Curvature::Diagonal(d) => {
                for ((product, row), d) in products.iter_mut().zip(w).zip(d) {
                    *product = row.map(|w| d * w);
                }
            }
            Curvature::Arrow { diagonal, first, square } => {
                let Some((normal, rest)) = w.split_first() else { return };
                let mut sum = [0.0; SIX];
                for (row, first) in rest.iter().zip(&first[1..]) {
                    (0..SIX).for_each(|i| sum[i] += first * row[i]);
                }
                products[0] = std::array::from_fn(|i| diagonal[0] * normal[i] + sum[i]);
                let both: Row = std::array::from_fn(|i| normal[i] + square * sum[i]);
                for (k, row) in (1..).zip(rest) {
                    products[k] = std::array::from_fn(|i| diagonal[k] * row[i] + first[k] * both[i]);
                }
            }
            Curvature::Limited { diagonal, normal, turn } => {
                for (k, (product, row)) in products.iter_mut().zip(w).enumerate() {
                    *product = row.map(|w| diagonal[k] * w);
                    if k > 0 {
                        (0..SIX).for_each(|i| product[i] += normal[k] * w[0][i]);
                    }
                }
                for ([k, l], turn) in TURNS.into_iter().zip(turn).filter(|([_, l], _)| *l < w.len()) {
                    for i in 0..SIX {
                        products[k][i] += turn * w[l][i];
                        products[l][i] += turn * w[k][i];
                    }
                }
            }
        }
        match shape {
            Shape::Symmetric => add_products::<true>(&mut self.h, w, &products),
            Shape::General => add_products::<false>(&mut self.h, w, &products),
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

/// H += Σ a bᵀ of rows a and b; of a symmetric H the upper triangle.
#[inline(always)]
fn add_products<const SYMMETRIC: bool>(h: &mut [Row; SIX], a: &[Row], b: &[Row; SIX]) {
    add_to_two::<0, 0>(h, a, b);
    if SYMMETRIC {
        add_to_two::<2, 2>(h, a, b);
        add_to_two::<4, 4>(h, a, b);
    } else {
        add_to_two::<2, 0>(h, a, b);
        add_to_two::<4, 0>(h, a, b);
    }
}

/// The same for two rows of H, which stay in registers, from a column on.
#[inline(always)]
fn add_to_two<const ROW: usize, const COLUMN: usize>(h: &mut [Row; SIX], a: &[Row], b: &[Row; SIX]) {
    let mut two = [h[ROW], h[ROW + 1]];
    for (a, b) in a.iter().zip(b) {
        for (i, own) in two.iter_mut().enumerate() {
            (COLUMN..SIX).for_each(|j| own[j] += a[ROW + i] * b[j]);
        }
    }
    [h[ROW], h[ROW + 1]] = two;
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

    use super::super::curvature::examples;
    use super::*;
    use crate::math::{Mat6, Vec6};

    /// Every kind of curvature, symmetric and not, against the dense matrix.
    #[test]
    fn solves_what_the_dense_matrix_solves() {
        let number = |k: usize| (k as f64 * 1.7).sin();
        let w: [Row; SIX] = from_fn(|k| from_fn(|i| number(7 * k + i)));
        for (shape, kinds) in [(Shape::Symmetric, 4), (Shape::General, 5)] {
            let (mut six, mut dense) = (Six::default(), Mat6::identity());
            six.unit();
            for dim in [1, 3, 4, 6] {
                for curvature in &examples(dim)[..kinds] {
                    six.add(curvature, &w[..dim], shape);
                    let rows = Mat6::from_fn(|k, i| if k < dim { w[k][i] } else { 0.0 });
                    let c = curvature.matrix();
                    dense += rows.transpose() * Mat6::from_fn(|k, j| c[k][j]) * rows;
                }
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
