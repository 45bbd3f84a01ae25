//! The rows W of an island's constraints and their products.
//!
//! Each constraint has `dim` rows on one tree or on two, in the coordinates of [`super::unit_mass`], row-major. With them
//! Newton's matrix is
//!
//!     H = 1 + Wᵀ C W        C: one small matrix a constraint

use super::block_factor::{BlockFactor, Shape};
use super::curvature::{Curvature, TURNS};
use super::six::Six;

/// Unknowns of a free body, and of every smaller tree with its padding.
pub const SIX: usize = 6;
pub type Row = [f64; SIX];

/// The part of a constraint's rows that belongs to one tree: `dim` rows of `n` numbers.
#[derive(Clone, Copy, Debug, Default)]
pub struct Part {
    /// The tree's number in the island, and its place in the island's vectors.
    pub unit: usize,
    pub at: usize,
    pub n: usize,
    /// Start of the first row in the numbers.
    pub start: usize,
}

/// Where the parts of a constraint lie, and where their products go in H.
///
/// Tendons can hold more than two trees together: then the parts beyond the second are in [`Rows::more`], one after the
/// other.
#[derive(Clone, Copy, Debug, Default)]
pub struct Parts {
    parts: [Part; 2],
    count: usize,
    dim: usize,
    diagonal: [usize; 2],
    /// Block of the two parts, and which of them has its rows: the tree that is eliminated first.
    off: usize,
    first: usize,
    /// Where its further parts begin, and how many there are.
    more: [usize; 2],
}

impl Parts {
    pub fn new(dim: usize) -> Parts {
        Parts { dim, ..Parts::default() }
    }

    pub fn push(&mut self, part: Part) {
        self.parts[self.count] = part;
        self.count += 1;
    }

    pub fn list(&self) -> &[Part] {
        &self.parts[..self.count]
    }

    pub fn is_full(&self) -> bool {
        self.count == 2
    }
}

/// The rows of all constraints.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    parts: Vec<Parts>,
    /// Those from `used` on are left over from larger islands.
    numbers: Vec<f64>,
    used: usize,
    /// C W of one constraint.
    product: Vec<f64>,
    /// Parts of constraints on more than two trees.
    more: Vec<Part>,
}

impl Rows {
    /// Makes room for that many constraints with that many numbers in all, on trees of at most `widest` unknowns.
    pub fn reserve(&mut self, constraints: usize, numbers: usize, widest: usize) {
        self.parts.reserve(constraints);
        self.numbers.reserve(numbers);
        self.product.reserve(6 * widest);
    }

    pub fn reset(&mut self) {
        self.parts.clear();
        self.more.clear();
        self.used = 0;
    }

    /// Room for the rows of a part, with what larger islands left in it.
    pub fn room(&mut self, unit: usize, at: usize, n: usize, dim: usize) -> Part {
        let start = self.used;
        self.used += dim * n;
        if self.numbers.len() < self.used {
            self.numbers.resize(self.used, 0.0);
        }
        Part { unit, at, n, start }
    }

    pub fn push(&mut self, parts: Parts) {
        self.parts.push(parts);
    }

    /// Adds a part beyond the second.
    pub fn push_more(&mut self, parts: &mut Parts, part: Part) {
        if parts.more[1] == 0 {
            parts.more[0] = self.more.len();
        }
        parts.more[1] += 1;
        self.more.push(part);
    }

    /// The trees of constraint i.
    pub fn parts(&self, i: usize) -> impl Iterator<Item = &Part> {
        self.all(&self.parts[i])
    }

    fn all<'a>(&'a self, parts: &'a Parts) -> impl Iterator<Item = &'a Part> {
        parts.list().iter().chain(self.beyond(parts))
    }

    fn beyond(&self, parts: &Parts) -> &[Part] {
        &self.more[parts.more[0]..][..parts.more[1]]
    }

    /// `dim` rows of a part.
    #[inline]
    pub fn of(&self, part: &Part, dim: usize) -> &[f64] {
        &self.numbers[part.start..][..dim * part.n]
    }

    #[inline]
    pub fn of_mut(&mut self, part: &Part, dim: usize) -> &mut [f64] {
        &mut self.numbers[part.start..][..dim * part.n]
    }

    /// W v of one constraint.
    #[inline]
    pub fn products(&self, parts: &Parts, v: &[f64]) -> [f64; 6] {
        let mut sum = [0.0; 6];
        for part in self.all(parts) {
            let (rows, v) = (self.of(part, parts.dim), &v[part.at..][..part.n]);
            if let Ok(v) = <&Row>::try_from(v) {
                for (out, row) in sum.iter_mut().zip(rows.as_chunks::<SIX>().0) {
                    *out += dot_six(row, v);
                }
            } else {
                for (out, row) in sum.iter_mut().zip(rows.chunks_exact(part.n)) {
                    *out += dot_even(row, v);
                }
            }
        }
        sum
    }

    /// W v of constraint i.
    pub fn products_of(&self, i: usize, v: &[f64]) -> [f64; 6] {
        self.products(&self.parts[i], v)
    }

    /// W v, handed out constraint by constraint.
    #[inline]
    pub fn multiply(&self, v: &[f64], mut take: impl FnMut(usize, [f64; 6])) {
        if let Ok(v) = <&Row>::try_from(v) {
            // One free body or small tree.
            let (v, numbers) = (*v, self.numbers.as_chunks::<SIX>().0);
            for (i, parts) in self.parts.iter().enumerate() {
                let mut product = [0.0; 6];
                let rows = &numbers[parts.parts[0].start / SIX..];
                product.iter_mut().zip(rows).take(parts.dim).for_each(|(out, row)| *out = dot_six(row, &v));
                take(i, product);
            }
            return;
        }
        for (i, parts) in self.parts.iter().enumerate() {
            take(i, self.products(parts, v));
        }
    }

    /// w += Wᵀ f
    #[inline]
    pub fn add_forces<'a>(&self, forces: impl Iterator<Item = &'a [f64; 6]>, w: &mut [f64]) {
        if let Ok(w) = <&mut Row>::try_from(&mut *w) {
            let (mut sum, numbers) = (*w, self.numbers.as_chunks::<SIX>().0);
            for (f, parts) in forces.zip(&self.parts) {
                let rows = &numbers[parts.parts[0].start / SIX..];
                for (row, f) in rows.iter().zip(f).take(parts.dim) {
                    (0..SIX).for_each(|i| sum[i] += f * row[i]);
                }
            }
            *w = sum;
            return;
        }
        for (f, parts) in forces.zip(&self.parts) {
            for part in self.all(parts) {
                let (rows, w) = (self.of(part, parts.dim), &mut w[part.at..][..part.n]);
                if let Ok(w) = <&mut Row>::try_from(&mut *w) {
                    let mut sum = *w;
                    for (row, f) in rows.as_chunks::<SIX>().0.iter().zip(f) {
                        (0..SIX).for_each(|i| sum[i] += f * row[i]);
                    }
                    *w = sum;
                } else {
                    for (row, f) in rows.chunks_exact(part.n).zip(f).filter(|(_, f)| **f != 0.0) {
                        add_even(w, *f, row);
                    }
                }
            }
        }
    }

    /// Finds which trees share constraints, the order of elimination, and where the constraints' products go in H.
    ///
    /// In: the unknowns of each tree.
    pub fn analyse(&mut self, blocks: &mut BlockFactor, sizes: impl Iterator<Item = usize>) {
        blocks.reset(sizes);
        for p in self.parts.iter().filter(|p| p.count == 2) {
            blocks.connect(p.parts[0].unit, p.parts[1].unit);
            let more = &self.more[p.more[0]..][..p.more[1]];
            for (i, part) in more.iter().enumerate() {
                for other in p.list().iter().chain(&more[..i]) {
                    blocks.connect(part.unit, other.unit);
                }
            }
        }
        blocks.analyse();
        for p in &mut self.parts {
            for i in 0..p.count {
                p.diagonal[i] = blocks.place(p.parts[i].unit, p.parts[i].unit).0;
            }
            if p.count == 2 {
                let swapped;
                (p.off, swapped) = blocks.place(p.parts[0].unit, p.parts[1].unit);
                p.first = usize::from(swapped);
            }
        }
    }

    /// H = 1 + Wᵀ C W of an island of six unknowns.
    pub fn fill_six(&self, curvatures: &[Curvature], six: &mut Six, shape: Shape) {
        let numbers = self.numbers.as_chunks::<SIX>().0;
        six.unit();
        for (curvature, parts) in curvatures.iter().zip(&self.parts) {
            six.add(curvature, &numbers[parts.parts[0].start / SIX..][..parts.dim], shape);
        }
    }

    /// H = 1 + Wᵀ C W. Comes after [`Rows::analyse`].
    pub fn fill(&mut self, curvatures: &[Curvature], blocks: &mut BlockFactor, shape: Shape) {
        blocks.unit(shape);
        let (upper, lower) = blocks.blocks();
        let Rows { parts, numbers, product, .. } = self;
        for (curvature, parts) in curvatures.iter().zip(&*parts) {
            if matches!(curvature, Curvature::Zero) {
                continue;
            }
            let dim = parts.dim;
            let rows = |part: &Part| &numbers[part.start..][..dim * part.n];
            for (right, part) in parts.list().iter().enumerate() {
                // C W of the right part, and with the left part's rows a block of H.
                let n = part.n;
                product.resize(dim * n, 0.0);
                multiply_curvature(curvature, rows(part), dim, n, product);
                let triangle = shape == Shape::Symmetric;
                add_square(&mut upper[parts.diagonal[right]..], rows(part), product, dim, n, triangle);
                if parts.count == 2 {
                    let left = &parts.parts[1 - right];
                    if right != parts.first {
                        add_product(&mut upper[parts.off..], rows(left), product, dim, [left.n, n]);
                    } else if shape == Shape::General {
                        add_product(&mut lower[parts.off..], product, rows(left), dim, [n, left.n]);
                    }
                }
            }
        }
        if !self.more.is_empty() {
            self.fill_more(curvatures, blocks, shape);
        }
    }

    /// The rest of H: the blocks of parts beyond the second.
    #[cold]
    fn fill_more(&self, curvatures: &[Curvature], blocks: &mut BlockFactor, shape: Shape) {
        let mut product = Vec::new();
        let wide = self.parts.iter().zip(curvatures).filter(|(parts, _)| parts.more[1] > 0);
        for (parts, curvature) in wide.filter(|(_, c)| !matches!(c, Curvature::Zero)) {
            let dim = parts.dim;
            for (r, right) in self.all(parts).enumerate() {
                let n = right.n;
                product.resize(dim * n, 0.0);
                multiply_curvature(curvature, self.of(right, dim), dim, n, &mut product);
                // Those of the first two parts are there already.
                for (_, left) in self.all(parts).enumerate().filter(|(l, _)| r.max(*l) >= 2) {
                    let (at, swapped) = blocks.place(left.unit, right.unit);
                    let (upper, lower) = blocks.blocks();
                    if left.unit == right.unit {
                        add_square(&mut upper[at..], self.of(left, dim), &product, dim, n, shape == Shape::Symmetric);
                    } else if !swapped {
                        add_product(&mut upper[at..], self.of(left, dim), &product, dim, [left.n, n]);
                    } else if shape == Shape::General {
                        add_product(&mut lower[at..], &product, self.of(left, dim), dim, [n, left.n]);
                    }
                }
            }
        }
    }
}

/// out = C J
#[inline]
fn multiply_curvature(curvature: &Curvature, jac: &[f64], dim: usize, n: usize, out: &mut [f64]) {
    #[inline(always)]
    fn kernel(curvature: &Curvature, jac: &[f64], dim: usize, out: &mut [f64], n: usize) {
        match curvature {
            Curvature::Zero => out.fill(0.0),
            Curvature::Diagonal(d) => {
                for ((out, row), d) in out.chunks_exact_mut(n).zip(jac.chunks_exact(n)).zip(d) {
                    (0..n).for_each(|i| out[i] = d * row[i]);
                }
            }
            Curvature::Arrow { diagonal, first, square } => {
                let (own, others) = out.split_at_mut(n);
                let (normal, rest) = jac.split_at(n);
                own.fill(0.0);
                for (row, first) in rest.chunks_exact(n).zip(&first[1..]) {
                    (0..n).for_each(|i| own[i] += first * row[i]);
                }
                for (k, (out, row)) in (1..).zip(others.chunks_exact_mut(n).zip(rest.chunks_exact(n))) {
                    (0..n).for_each(|i| out[i] = diagonal[k] * row[i] + first[k] * (normal[i] + square * own[i]));
                }
                (0..n).for_each(|i| own[i] += diagonal[0] * normal[i]);
            }
            Curvature::Limited { diagonal, normal, turn } => {
                let (own, others) = out.split_at_mut(n);
                (0..n).for_each(|i| own[i] = diagonal[0] * jac[i]);
                for (k, (out, row)) in (1..).zip(others.chunks_exact_mut(n).zip(jac[n..].chunks_exact(n))) {
                    (0..n).for_each(|i| out[i] = diagonal[k] * row[i] + normal[k] * jac[i]);
                }
                for ([k, l], turn) in TURNS.into_iter().zip(turn).filter(|([_, l], turn)| *l < dim && **turn != 0.0) {
                    for i in 0..n {
                        out[k * n + i] += turn * jac[l * n + i];
                        out[l * n + i] += turn * jac[k * n + i];
                    }
                }
            }
        }
    }
    sized!(n, n => kernel(curvature, jac, dim, out, n));
}

/// C += Aᵀ B with A and B dim × n; of a symmetric C (`triangle`) only the upper triangle counts.
#[inline]
fn add_square(c: &mut [f64], a: &[f64], b: &[f64], dim: usize, n: usize, triangle: bool) {
    /// D rows at once, in pairs of numbers, as the machine works.
    #[inline(always)]
    fn kernel<const D: usize>(c: &mut [f64], a: &[f64], b: &[f64], triangle: bool, n: usize) {
        let a: [&[f64]; D] = std::array::from_fn(|k| &a[k * n..][..n]);
        let b: [&[[f64; 2]]; D] = std::array::from_fn(|k| b[k * n..][..n].as_chunks().0);
        for (i, row) in c[..n * n].chunks_exact_mut(n).enumerate() {
            let factors: [f64; D] = std::array::from_fn(|k| a[k][i]);
            // A tree's other branches have zeros.
            if factors == [0.0; D] {
                continue;
            }
            let row = row.as_chunks_mut::<2>().0;
            for j in if triangle { i / 2 } else { 0 }..n / 2 {
                for (b, factor) in b.iter().zip(&factors) {
                    row[j][0] += factor * b[j][0];
                    row[j][1] += factor * b[j][1];
                }
            }
        }
    }
    sized!(n, n => match dim {
        1 => kernel::<1>(c, a, b, triangle, n),
        3 => kernel::<3>(c, a, b, triangle, n),
        4 => kernel::<4>(c, a, b, triangle, n),
        _ => kernel::<6>(c, a, b, triangle, n),
    });
}

/// C += Aᵀ B with A dim × ni, B dim × nj.
fn add_product(c: &mut [f64], a: &[f64], b: &[f64], dim: usize, [ni, nj]: [usize; 2]) {
    #[inline(always)]
    fn kernel(c: &mut [f64], a: &[f64], b: &[f64], dim: usize, ni: usize, nj: usize) {
        let c = &mut c[..ni * nj];
        for (a, b) in a[..dim * ni].chunks_exact(ni).zip(b.chunks_exact(nj)) {
            for (row, factor) in c.chunks_exact_mut(nj).zip(a).filter(|(_, factor)| **factor != 0.0) {
                (0..nj).for_each(|j| row[j] += factor * b[j]);
            }
        }
    }
    if [ni, nj] == [SIX, SIX] { kernel(c, a, b, dim, SIX, SIX) } else { kernel(c, a, b, dim, ni, nj) }
}

#[inline(always)]
pub fn dot_six(a: &Row, b: &Row) -> f64 {
    // In pairs of numbers, as the machine works.
    ((a[0] * b[0] + a[2] * b[2]) + a[4] * b[4]) + ((a[1] * b[1] + a[3] * b[3]) + a[5] * b[5])
}

/// Dot product of vectors of even length.
#[inline]
fn dot_even(a: &[f64], b: &[f64]) -> f64 {
    // Two sums: an addition need not wait for the one before.
    let mut sum = [0.0; 2];
    for (a, b) in a.as_chunks::<2>().0.iter().zip(b.as_chunks::<2>().0) {
        sum[0] += a[0] * b[0];
        sum[1] += a[1] * b[1];
    }
    sum[0] + sum[1]
}

/// y += factor x, of even length.
#[inline]
fn add_even(y: &mut [f64], factor: f64, x: &[f64]) {
    for (y, x) in y.as_chunks_mut::<2>().0.iter_mut().zip(x.as_chunks::<2>().0) {
        y[0] += factor * x[0];
        y[1] += factor * x[1];
    }
}

#[cfg(test)]
mod tests {
    use super::super::curvature::examples;
    use super::*;

    /// Every kind of C times rows of six numbers and of ten, against C written out.
    #[test]
    fn products_with_a_curvature_are_those_of_its_matrix() {
        for (n, dim) in [6, 10].into_iter().flat_map(|n| [1, 3, 4, 6].map(|dim| (n, dim))) {
            let jac: Vec<f64> = (0..dim * n).map(|i| (i as f64 * 0.9).sin()).collect();
            for curvature in examples(dim) {
                let (mut out, c) = (vec![f64::NAN; dim * n], curvature.matrix());
                multiply_curvature(&curvature, &jac, dim, n, &mut out);
                for (i, out) in out.iter().enumerate() {
                    let wanted: f64 = (0..dim).map(|l| c[i / n][l] * jac[l * n + i % n]).sum();
                    assert!((out - wanted).abs() < 1e-14, "{curvature:?}, {dim} rows of {n}: {out} and {wanted}");
                }
            }
        }
    }
}
