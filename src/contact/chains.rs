//! Rows of constraints that each act on one chain of one tree: from its root to the body that is touched, or to the joint that
//! is limited. The way of robots that stand on what never moves.
//!
//! A row of J has entries for the dofs of its chain only, and so has the row of W: L⁻ᵀ leads towards the root. WᵀCW then has
//! entries where M has some, and so has the factor of H = 1 + Wᵀ C W: the [`Pattern`] of M.
//!
//! Worth it: a step of Gymnasium's ant at rest on four feet takes 65,000 instructions with it, 74,000 without.
//!
//! Numbers are kept dof by dof, those of a constraint's rows side by side and filled up with zeros to a width of 1, 4 or 6.

use std::ops::Range;

use super::block_factor::Shape;
use super::curvature::{Curvature, TURNS};
use crate::dynamics::factor::{Entry, Pattern, by_length};

/// Where the rows of one constraint are.
#[derive(Clone, Copy, Debug, Default)]
struct Chain {
    dim: usize,
    /// Numbers a dof.
    width: usize,
    /// Number of dofs.
    len: usize,
    /// Where the numbers, and the dofs, of the chain begin.
    start: usize,
    way: usize,
}

/// The rows of all constraints of an island, and its matrix.
#[derive(Clone, Debug, Default)]
pub struct Chains {
    chains: Vec<Chain>,
    /// What larger islands left behind is kept: it is overwritten.
    numbers: Vec<f64>,
    used: usize,
    /// The dofs of each chain.
    ways: Vec<Entry>,
    /// H, then its factor, on and below the diagonal, and on and above it.
    low: Vec<f64>,
    up: Vec<f64>,
    general: bool,
}

/// The width that has room for `dim` rows.
fn width(dim: usize) -> usize {
    match dim {
        1 => 1,
        3 | 4 => 4,
        _ => 6,
    }
}

/// Calls a kernel with the width of a constraint.
macro_rules! by_width {
    ($width:expr, $kernel:ident($($argument:expr),*)) => {
        match $width {
            1 => $kernel::<1>($($argument),*),
            4 => $kernel::<4>($($argument),*),
            _ => $kernel::<6>($($argument),*),
        }
    };
}

impl Chains {
    /// Makes room for that many constraints with that many dofs in all, and matrices of a pattern.
    pub fn reserve(&mut self, constraints: usize, dofs: usize, dim: usize, pattern: &Pattern) {
        self.chains.reserve(constraints);
        self.numbers.reserve(dofs * width(dim));
        self.ways.reserve(dofs);
        self.low.resize(pattern.size(), 0.0);
        self.up.resize(pattern.size(), 0.0);
    }

    pub fn reset(&mut self) {
        self.chains.clear();
        self.ways.clear();
        self.used = 0;
    }

    /// Adds a constraint of `dim` rows with the products of its wrenches and the twists of the dofs on its way.
    ///
    /// Out: its rows' products with two vectors, v and a.
    ///
    /// In: `twist` of a dof counted in the tree.
    pub fn push<'a, const N: usize>(
        &mut self,
        way: &[Entry],
        wrenches: &[[f64; N]],
        twist: impl Fn(usize) -> &'a [f64; N],
        v: &[f64],
        a: &[f64],
    ) -> [[f64; 6]; 2] {
        /// Wrenches side by side, as the rows are.
        #[inline(always)]
        fn kernel<'a, const N: usize, const W: usize>(
            numbers: &mut [f64],
            way: &[Entry],
            wrenches: &[[f64; N]],
            twist: impl Fn(usize) -> &'a [f64; N],
            v: &[f64],
            a: &[f64],
        ) -> [[f64; 6]; 2] {
            let mut side = [[0.0; W]; N];
            for (k, wrench) in wrenches.iter().take(W).enumerate() {
                (0..N).for_each(|i| side[i][k] = wrench[i]);
            }
            let mut sums = [[0.0; W]; 2];
            for (x, entry) in numbers.as_chunks_mut::<W>().0.iter_mut().zip(way) {
                let twist = twist(entry.column);
                let mut row = [0.0; W];
                for (side, twist) in side.iter().zip(twist) {
                    (0..W).for_each(|k| row[k] += side[k] * twist);
                }
                let [v, a] = [v[entry.column], a[entry.column]];
                for k in 0..W {
                    sums[0][k] += row[k] * v;
                    sums[1][k] += row[k] * a;
                }
                *x = row;
            }
            sums.map(|sum| std::array::from_fn(|k| if k < W { sum[k] } else { 0.0 }))
        }
        let (start, width) = self.add(way, wrenches.len());
        let numbers = &mut self.numbers[start..][..way.len() * width];
        match width {
            1 => kernel::<N, 1>(numbers, way, wrenches, twist, v, a),
            4 => kernel::<N, 4>(numbers, way, wrenches, twist, v, a),
            _ => kernel::<N, 6>(numbers, way, wrenches, twist, v, a),
        }
    }

    /// Adds a row with the given numbers for its last dofs.
    pub fn push_joint(&mut self, way: &[Entry], entries: &[f64]) {
        let (start, _) = self.add(way, 1);
        let row = &mut self.numbers[start..][..way.len()];
        let (before, last) = row.split_at_mut(way.len() - entries.len());
        before.fill(0.0);
        last.copy_from_slice(entries);
    }

    fn add(&mut self, way: &[Entry], dim: usize) -> (usize, usize) {
        let (start, width) = (self.used, width(dim));
        self.chains.push(Chain { dim, width, len: way.len(), start, way: self.ways.len() });
        self.ways.extend_from_slice(way);
        self.used += way.len() * width;
        if self.numbers.len() < self.used {
            self.numbers.resize(self.used, 0.0);
        }
        (start, width)
    }

    /// Turns the rows that were added last from those of J into those of W = J S⁻¹.
    ///
    /// In: the factor of M; scale of the tree's dofs.
    pub fn scale_last(&mut self, factor: &[f64], scale: &[f64]) {
        #[inline(always)]
        fn kernel<const W: usize>(numbers: &mut [f64], way: &[Entry], factor: &[f64], scale: &[f64]) {
            let x = numbers.as_chunks_mut::<W>().0;
            for p in (0..x.len()).rev() {
                let (before, own) = x.split_at_mut(p);
                let (own, entry) = (&mut own[0], &way[p]);
                let l = &factor[2 * entry.pair..][..p];
                by_length!(p, n => for (x, l) in before[..n].iter_mut().zip(&l[..n]) {
                    (0..W).for_each(|k| x[k] -= l * own[k]);
                });
                own.iter_mut().for_each(|x| *x *= scale[entry.column]);
            }
        }
        let c = self.chains[self.chains.len() - 1];
        let (numbers, way) = (&mut self.numbers[c.start..][..c.len * c.width], &self.ways[c.way..][..c.len]);
        by_width!(c.width, kernel(numbers, way, factor, scale));
    }

    fn parts(&self, c: &Chain) -> (&[f64], &[Entry]) {
        (&self.numbers[c.start..][..c.len * c.width], &self.ways[c.way..][..c.len])
    }

    /// |e₀ W₀ + e₁ W₁|² of constraint i.
    pub fn square(&self, i: usize, e: [f64; 2]) -> f64 {
        let c = &self.chains[i];
        let second = |x: &[f64]| if c.dim > 1 { e[1] * x[1] } else { 0.0 };
        self.parts(c).0.chunks_exact(c.width).map(|x| (e[0] * x[0] + second(x)).powi(2)).sum()
    }

    /// |W_k|² of each row of constraint i.
    pub fn squares(&self, i: usize) -> [f64; 6] {
        let (c, mut sum) = (&self.chains[i], [0.0; 6]);
        for x in self.parts(c).0.chunks_exact(c.width) {
            sum.iter_mut().zip(x).for_each(|(sum, x)| *sum += x * x);
        }
        sum
    }

    /// W v, handed out constraint by constraint.
    #[inline]
    pub fn multiply(&self, v: &[f64], mut take: impl FnMut(usize, [f64; 6])) {
        #[inline(always)]
        fn kernel<const W: usize>(numbers: &[f64], way: &[Entry], v: &[f64]) -> [f64; 6] {
            let mut sum = [0.0; W];
            for (x, entry) in numbers.as_chunks::<W>().0.iter().zip(way) {
                let v = v[entry.column];
                (0..W).for_each(|k| sum[k] += x[k] * v);
            }
            std::array::from_fn(|k| if k < W { sum[k] } else { 0.0 })
        }
        for (i, c) in self.chains.iter().enumerate() {
            let (numbers, way) = self.parts(c);
            take(i, by_width!(c.width, kernel(numbers, way, v)));
        }
    }

    /// w += Wᵀ f
    #[inline]
    pub fn add_forces<'a>(&self, forces: impl Iterator<Item = &'a [f64; 6]>, w: &mut [f64]) {
        #[inline(always)]
        fn kernel<const W: usize>(numbers: &[f64], way: &[Entry], dim: usize, f: &[f64; 6], w: &mut [f64]) {
            let f: [f64; W] = std::array::from_fn(|k| if k < dim { f[k] } else { 0.0 });
            for (x, entry) in numbers.as_chunks::<W>().0.iter().zip(way) {
                w[entry.column] += dot(&f, x);
            }
        }
        for (f, c) in forces.zip(&self.chains) {
            let (numbers, way) = self.parts(c);
            by_width!(c.width, kernel(numbers, way, c.dim, f, w));
        }
    }

    /// Factors H = 1 + Wᵀ C W.
    pub fn factor(&mut self, pattern: &Pattern, dofs: &Range<usize>, curvatures: &[Curvature], shape: Shape) {
        let mut low = std::mem::take(&mut self.low);
        let mut up = std::mem::take(&mut self.up);
        let block = pattern.block(dofs);
        low[block.clone()].fill(0.0);
        pattern.rows(dofs).iter().for_each(|row| low[row.diagonal()] = 1.0);
        self.general = shape == Shape::General;
        if self.general {
            up[block.clone()].copy_from_slice(&low[block]);
        }
        let other = if self.general { &mut up[..] } else { &mut [] };
        for (curvature, c) in curvatures.iter().zip(&self.chains) {
            if !matches!(curvature, Curvature::Zero) {
                let (numbers, way) = self.parts(c);
                by_width!(c.width, add_curvature(&mut low, other, numbers, way, curvature, c.dim));
            }
        }
        if self.general {
            pattern.factor_general(dofs, &mut low, &mut up)
        } else {
            pattern.factor_alone(dofs, &mut low)
        }
        (self.low, self.up) = (low, up);
    }

    /// x ← H⁻¹ x
    pub fn divide(&self, pattern: &Pattern, dofs: &Range<usize>, x: &mut [f64]) {
        pattern.reduce_one(dofs, if self.general { &self.up } else { &self.low }, x);
        pattern.substitute(dofs, &self.low, x);
    }
}

/// Adds WᵀCW of one constraint to the lower triangle of H, and to the transposed upper one unless `up` is empty.
#[inline(always)]
fn add_curvature<const W: usize>(
    low: &mut [f64],
    up: &mut [f64],
    numbers: &[f64],
    way: &[Entry],
    curvature: &Curvature,
    dim: usize,
) {
    let x = numbers.as_chunks::<W>().0;
    let narrow = |v: &[f64; 6]| -> [f64; W] { std::array::from_fn(|k| if k < dim { v[k] } else { 0.0 }) };
    match curvature {
        Curvature::Zero => {}
        Curvature::Diagonal(d) => {
            let d = narrow(d);
            add_to_both(low, up, x, way, |own| std::array::from_fn(|k| d[k] * own[k]));
        }
        Curvature::Arrow { diagonal, first, square } => {
            let (d, first) = (narrow(diagonal), narrow(first));
            add_to_both(low, up, x, way, |own| {
                let sum = dot(&first, own);
                let both = own[0] + square * sum;
                std::array::from_fn(|k| d[k] * own[k] + if k == 0 { sum } else { first[k] * both })
            });
        }
        Curvature::Limited { diagonal, normal, turn } => {
            let (d, normal) = (narrow(diagonal), narrow(normal));
            let turned = |own: &[f64; W]| -> [f64; W] {
                let mut out = std::array::from_fn(|k| d[k] * own[k]);
                for ([k, l], turn) in TURNS.into_iter().zip(turn).filter(|([_, l], _)| *l < W) {
                    out[k] += turn * own[l];
                    out[l] += turn * own[k];
                }
                out
            };
            let product = |own: &[f64; W]| -> [f64; W] {
                let mut out = turned(own);
                (1..W).for_each(|k| out[k] += normal[k] * own[0]);
                out
            };
            if up.is_empty() {
                add_products(low, x, way, product);
            } else {
                add_products(up, x, way, product);
                // W_p · (C W_q) = W_q · (Cᵀ W_p)
                add_products(low, x, way, |own| {
                    let mut out = turned(own);
                    out[0] += dot(&normal, own);
                    out
                });
            }
        }
    }
}

/// The products of a symmetric C, in both triangles unless `up` is empty.
#[inline(always)]
fn add_to_both<const W: usize>(
    low: &mut [f64],
    up: &mut [f64],
    x: &[[f64; W]],
    way: &[Entry],
    product: impl Fn(&[f64; W]) -> [f64; W],
) {
    add_products(low, x, way, &product);
    if !up.is_empty() {
        add_products(up, x, way, &product);
    }
}

/// h_pq += W_q · `product` (W_p) for q ≤ p.
#[inline(always)]
fn add_products<const W: usize>(h: &mut [f64], x: &[[f64; W]], way: &[Entry], product: impl Fn(&[f64; W]) -> [f64; W]) {
    for (p, (own, entry)) in x.iter().zip(way).enumerate() {
        let product = product(own);
        let row = &mut h[2 * entry.pair..][..p + 1];
        by_length!(p + 1, n => for (h, x) in row[..n].iter_mut().zip(&x[..n]) {
            *h += dot(&product, x);
        });
    }
}

/// Σ aₖ bₖ, in two sums.
#[inline(always)]
fn dot<const W: usize>(a: &[f64; W], b: &[f64; W]) -> f64 {
    let mut sum = [0.0; 2];
    for (a, b) in a.as_chunks::<2>().0.iter().zip(b.as_chunks::<2>().0) {
        sum[0] += a[0] * b[0];
        sum[1] += a[1] * b[1];
    }
    if W % 2 == 1 { sum[0] + sum[1] + a[W - 1] * b[W - 1] } else { sum[0] + sum[1] }
}

#[cfg(test)]
mod tests {
    use super::super::curvature::examples;
    use super::*;

    /// Wᵀ C W of one constraint on a chain of five dofs, in both triangles and in one, against C written out.
    #[test]
    fn what_a_constraint_adds_is_that_of_its_matrix() {
        let way: Vec<Entry> = (0..5).map(|p| Entry { column: p, pair: 3 * p }).collect();
        for dim in [1, 3, 4, 6] {
            let w: Vec<f64> = (0..5 * width(dim)).map(|i| (i as f64 * 0.9).sin()).collect();
            for (kind, curvature) in examples(dim).iter().enumerate() {
                let c = curvature.matrix();
                let wanted = |p: usize, q: usize| -> f64 {
                    let row = |p: usize| &w[p * width(dim)..][..dim];
                    let products = |k: usize| (0..dim).map(|l| c[k][l] * row(q)[l]).sum::<f64>();
                    (0..dim).map(|k| row(p)[k] * products(k)).sum()
                };
                for general in [false, true].into_iter().filter(|general| *general || kind < 4) {
                    let (mut low, mut up) = ([0.0; 30], [0.0; 30]);
                    let other = if general { &mut up[..] } else { &mut [] };
                    by_width!(width(dim), add_curvature(&mut low, other, &w, &way, curvature, dim));
                    for (p, q) in (0..5).flat_map(|p| (0..=p).map(move |q| (p, q))) {
                        let at = 6 * p + q;
                        let off = [low[at] - wanted(p, q), if general { up[at] - wanted(q, p) } else { 0.0 }];
                        assert!(off.iter().all(|off| off.abs() < 1e-13), "{curvature:?}, {p}, {q}: {off:?}");
                    }
                }
            }
        }
    }
}
