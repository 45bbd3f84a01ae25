//! Factorisation of a matrix made of blocks, most of them zero: Cholesky's where it is symmetric, LU where it is not.
//!
//! A block row belongs to one moving tree; two trees share a block if a constraint connects them. Trees are
//! eliminated in the order of fewest neighbours, which keeps the factor sparse.
//!
//! Rows are not exchanged: where a pivot is zero there are numbers that are not finite.
//!
//! Source: George and Liu, Computer Solution of Large Sparse Positive Definite Systems, 1981, chapter 5
//! (minimum degree), here with one bit per pair of trees.

/// H = Lᵀ U, both upper triangular with the same diagonal but for signs; L = U where H is symmetric. Block row k holds the diagonal
/// block and those to its right, each row-major.
#[derive(Clone, Debug, Default)]
pub struct BlockFactor {
    /// Size of each block row, and its place in a vector: in the caller's numbering.
    n: Vec<usize>,
    at: Vec<usize>,
    /// Neighbours not yet eliminated, one bit each, `words` words a row.
    neighbours: Vec<u64>,
    words: usize,
    /// Elimination order, and its inverse.
    order: Vec<usize>,
    rank: Vec<usize>,
    /// For the k-th eliminated: its blocks are `first[k]..first[k + 1]` in `column` and `offset`; the first is
    /// the diagonal, the others follow in the order of elimination.
    first: Vec<usize>,
    /// The caller's number of the block's column.
    column: Vec<usize>,
    offset: Vec<usize>,
    /// Of U, and of L unless that is the same.
    upper: Vec<f64>,
    lower: Vec<f64>,
    /// How many numbers either has.
    size: usize,
}

/// What is factored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// The upper triangle, in [`BlockFactor::upper`], says all.
    Symmetric,
    /// The blocks below the diagonal are in [`BlockFactor::lower`], transposed.
    General,
}

/// Block rows up to which there is room for a full factor from the start; beyond, it grows as it must.
const FULL: usize = 64;

impl BlockFactor {
    /// Makes room for that many block rows with that many rows in all.
    pub fn reserve(&mut self, count: usize, size: usize) {
        for list in [&mut self.n, &mut self.at, &mut self.order, &mut self.rank] {
            list.reserve(count);
        }
        self.first.reserve(count + 1);
        self.neighbours.reserve(count * count.div_ceil(64));
        if count <= FULL {
            self.column.reserve(count * (count + 1) / 2);
            self.offset.reserve(count * (count + 1) / 2);
            self.upper.reserve(size * size);
            self.lower.reserve(size * size);
        }
    }

    /// Starts anew with block rows of the given sizes and no connections.
    pub fn reset(&mut self, sizes: impl Iterator<Item = usize>) {
        self.n.clear();
        self.at.clear();
        let mut at = 0;
        for n in sizes {
            self.n.push(n);
            self.at.push(at);
            at += n;
        }
        self.words = self.n.len().div_ceil(64);
        self.neighbours.clear();
        self.neighbours.resize(self.words * self.n.len(), 0);
    }

    /// Says that the block (i, j) is not zero.
    pub fn connect(&mut self, i: usize, j: usize) {
        self.neighbours[i * self.words + j / 64] |= 1 << (j % 64);
        self.neighbours[j * self.words + i / 64] |= 1 << (i % 64);
    }

    /// Finds the order of elimination and the places of all blocks of the factor.
    pub fn analyse(&mut self) {
        let count = self.n.len();
        self.order.clear();
        self.first.clear();
        self.column.clear();
        self.offset.clear();
        self.rank.clear();
        self.rank.resize(count, usize::MAX);
        let mut size = 0;
        for k in 0..count {
            let next = self.fewest_neighbours();
            self.rank[next] = k;
            self.order.push(next);
            self.first.push(self.column.len());
            self.push_block(next, next, &mut size);
            for j in (0..count).filter(|&j| j != next) {
                if self.neighbours[next * self.words + j / 64] >> (j % 64) & 1 == 1 {
                    self.push_block(next, j, &mut size);
                }
            }
            self.eliminate(next);
        }
        self.first.push(self.column.len());
        for k in 0..count {
            self.sort_by_rank(self.first[k] + 1, self.first[k + 1], k);
        }
        self.size = size;
    }

    fn push_block(&mut self, row: usize, column: usize, size: &mut usize) {
        self.column.push(column);
        self.offset.push(*size);
        *size += self.n[row] * self.n[column];
    }

    /// Orders the blocks of a row as their columns are eliminated, and lays them out anew.
    fn sort_by_rank(&mut self, from: usize, to: usize, k: usize) {
        let BlockFactor { column, rank, offset, n, order, .. } = self;
        column[from..to].sort_unstable_by_key(|&j| rank[j]);
        for b in from..to {
            offset[b] = offset[b - 1] + n[order[k]] * n[column[b - 1]];
        }
    }

    fn fewest_neighbours(&self) -> usize {
        let degree = |i: usize| -> u32 {
            self.neighbours[i * self.words..(i + 1) * self.words].iter().map(|w| w.count_ones()).sum()
        };
        let rest = (0..self.n.len()).filter(|&i| self.rank[i] == usize::MAX);
        rest.min_by_key(|&i| degree(i)).unwrap_or(0)
    }

    /// Makes the neighbours of `gone` neighbours of one another.
    fn eliminate(&mut self, gone: usize) {
        let words = self.words;
        for b in self.first[self.first.len() - 1] + 1..self.column.len() {
            let i = self.column[b];
            for w in 0..words {
                self.neighbours[i * words + w] |= self.neighbours[gone * words + w];
            }
            self.neighbours[i * words + i / 64] &= !(1 << (i % 64));
            self.neighbours[i * words + gone / 64] &= !(1 << (gone % 64));
        }
    }

    /// Where block (i, j) starts in [`BlockFactor::upper`], and whether it is stored as (j, i) instead.
    pub fn place(&self, i: usize, j: usize) -> (usize, bool) {
        let (ri, rj) = (self.rank[i], self.rank[j]);
        let (k, other, swapped) = if ri <= rj { (ri, rj, false) } else { (rj, ri, true) };
        let row = &self.column[self.first[k]..self.first[k + 1]];
        let found = row.binary_search_by_key(&other, |&c| self.rank[c]).unwrap_or(0);
        (self.offset[self.first[k] + found], swapped)
    }

    /// Starts with the unit matrix.
    pub fn unit(&mut self, shape: Shape) {
        self.upper.clear();
        self.upper.resize(self.size, 0.0);
        self.lower.clear();
        if shape == Shape::General {
            self.lower.resize(self.size, 0.0);
        }
        for (&first, &row) in self.first.iter().zip(&self.order) {
            let (at, n) = (self.offset[first], self.n[row]);
            self.upper[at..at + n * n].iter_mut().step_by(n + 1).for_each(|h| *h = 1.0);
        }
    }

    /// The numbers of the blocks on the diagonal and above, and of those below, transposed (nothing if symmetric).
    pub fn blocks(&mut self) -> (&mut [f64], &mut [f64]) {
        (&mut self.upper, &mut self.lower)
    }

    /// Replaces the matrix by its factor. The diagonal is stored inverted.
    pub fn factor(&mut self) {
        let BlockFactor { upper, lower, .. } = self;
        let (mut upper, mut lower) = (std::mem::take(upper), std::mem::take(lower));
        for k in 0..self.order.len() {
            let n = self.n[self.order[k]];
            let (first, end) = (self.first[k], self.first[k + 1]);
            let start = self.offset[first];
            let stop = if end < self.offset.len() { self.offset[end] } else { upper.len() };
            let at = |b: usize| self.offset[b] - start - n * n;
            let (row, rest) = upper[start..].split_at_mut(stop - start);
            let (diagonal, right) = row.split_at_mut(n * n);
            if lower.is_empty() {
                factor_symmetric(diagonal, n);
                for b in first + 1..end {
                    divide_block(diagonal, n, &mut right[at(b)..][..n * self.n[self.column[b]]]);
                }
                self.update(k, |bi, bj, target, width| {
                    subtract_product(&mut rest[target - stop..], &right[at(bi)..], &right[at(bj)..], n, width);
                });
            } else {
                let (row, low_rest) = lower[start..].split_at_mut(stop - start);
                let (low_diagonal, low) = row.split_at_mut(n * n);
                factor_general(diagonal, low_diagonal, n);
                for b in first + 1..end {
                    let range = at(b)..at(b) + n * self.n[self.column[b]];
                    divide_block(low_diagonal, n, &mut right[range.clone()]);
                    divide_block(diagonal, n, &mut low[range]);
                }
                self.update(k, |bi, bj, target, width| {
                    subtract_product(&mut rest[target - stop..], &low[at(bi)..], &right[at(bj)..], n, width);
                    if bi != bj {
                        subtract_product(&mut low_rest[target - stop..], &right[at(bi)..], &low[at(bj)..], n, width);
                    }
                });
            }
        }
        (self.upper, self.lower) = (upper, lower);
    }

    /// Every pair of blocks (k, i), (k, j) changes block (i, j); its columns are among those of row i.
    ///
    /// Out: for each pair the two blocks, the place of the third in `upper`, and its size.
    fn update(&self, k: usize, mut change: impl FnMut(usize, usize, usize, [usize; 2])) {
        let (first, end) = (self.first[k], self.first[k + 1]);
        for bi in first + 1..end {
            let i = self.column[bi];
            let mut target = self.first[self.rank[i]];
            for bj in bi..end {
                while self.column[target] != self.column[bj] {
                    target += 1;
                }
                change(bi, bj, self.offset[target], [self.n[i], self.n[self.column[bj]]]);
            }
        }
    }

    /// x = H⁻¹ x
    pub fn divide(&self, x: &mut [f64]) {
        let lower = if self.lower.is_empty() { &self.upper } else { &self.lower };
        for k in 0..self.order.len() {
            let (n, at) = (self.n[self.order[k]], self.at[self.order[k]]);
            divide_vector_transposed(self.block(lower, self.first[k], n, n), n, &mut x[at..at + n]);
            for b in self.first[k] + 1..self.first[k + 1] {
                let (width, to) = (self.n[self.column[b]], self.at[self.column[b]]);
                let (own, other) = two(x, at, n, to, width);
                subtract_transposed(self.block(lower, b, n, width), own, other);
            }
        }
        for k in (0..self.order.len()).rev() {
            let (n, at) = (self.n[self.order[k]], self.at[self.order[k]]);
            for b in self.first[k] + 1..self.first[k + 1] {
                let (width, from) = (self.n[self.column[b]], self.at[self.column[b]]);
                let (own, other) = two(x, at, n, from, width);
                subtract_vector(self.block(&self.upper, b, n, width), own, other);
            }
            divide_vector(self.block(&self.upper, self.first[k], n, n), n, &mut x[at..at + n]);
        }
    }

    fn block<'a>(&self, numbers: &'a [f64], b: usize, n: usize, width: usize) -> &'a [f64] {
        &numbers[self.offset[b]..][..n * width]
    }
}

/// The parts of a vector that start at `a` and `b` and do not overlap.
fn two(x: &mut [f64], a: usize, na: usize, b: usize, nb: usize) -> (&mut [f64], &mut [f64]) {
    if a < b {
        let (low, high) = x.split_at_mut(b);
        (&mut low[a..a + na], &mut high[..nb])
    } else {
        let (low, high) = x.split_at_mut(a);
        (&mut high[..na], &mut low[b..b + nb])
    }
}

/// U of a symmetric dense block of even size, in its upper triangle; the diagonal holds 1/Uᵢᵢ.
fn factor_symmetric(a: &mut [f64], n: usize) {
    fn kernel<const N: usize>(a: &mut [f64]) {
        let rows = a.as_chunks_mut::<N>().0;
        for i in 0..N {
            let mut own = rows[i];
            let inverse = 1.0 / own[i].sqrt();
            own.iter_mut().for_each(|u| *u *= inverse);
            for j in i + 1..N {
                subtract(&mut rows[j], own[j], &own, j);
            }
            own[i] = inverse;
            rows[i] = own;
        }
    }
    fn any(a: &mut [f64], n: usize) {
        for i in 0..n {
            let (own, rest) = a[i * n..].split_at_mut(n);
            let inverse = 1.0 / own[i].sqrt();
            own[i..].iter_mut().for_each(|u| *u *= inverse);
            own[i] = inverse;
            for (j, row) in (i + 1..n).zip(rest.chunks_exact_mut(n)) {
                row[j..].iter_mut().zip(&own[j..]).for_each(|(row, u)| *row -= own[j] * u);
            }
        }
    }
    match n {
        6 => kernel::<6>(a),
        8 => kernel::<8>(a),
        10 => kernel::<10>(a),
        12 => kernel::<12>(a),
        14 => kernel::<14>(a),
        16 => kernel::<16>(a),
        n => any(&mut a[..n * n], n),
    }
}

/// U of a dense block of even size in its upper triangle, L in that of `low`.
fn factor_general(a: &mut [f64], low: &mut [f64], n: usize) {
    fn kernel<const N: usize>(a: &mut [f64], low: &mut [f64]) {
        let (rows, low) = (a.as_chunks_mut::<N>().0, low.as_chunks_mut::<N>().0);
        for i in 0..N {
            let mut own = rows[i];
            // A pivot may be negative: then L has the sign.
            let inverse = 1.0 / own[i].abs().sqrt();
            let signed = inverse.copysign(own[i]);
            own.iter_mut().for_each(|u| *u *= signed);
            low[i][i] = signed;
            for j in i + 1..N {
                let factor = rows[j][i] * inverse;
                low[i][j] = factor;
                subtract(&mut rows[j], factor, &own, i);
            }
            own[i] = inverse;
            rows[i] = own;
        }
    }
    fn any(a: &mut [f64], low: &mut [f64], n: usize) {
        for i in 0..n {
            let (own, rest) = a[i * n..].split_at_mut(n);
            let inverse = 1.0 / own[i].abs().sqrt();
            let signed = inverse.copysign(own[i]);
            own[i + 1..].iter_mut().for_each(|u| *u *= signed);
            (own[i], low[i * n + i]) = (inverse, signed);
            for (j, row) in (i + 1..n).zip(rest.chunks_exact_mut(n)) {
                let factor = row[i] * inverse;
                low[i * n + j] = factor;
                row[i + 1..].iter_mut().zip(&own[i + 1..]).for_each(|(row, u)| *row -= factor * u);
            }
        }
    }
    match n {
        6 => kernel::<6>(a, low),
        8 => kernel::<8>(a, low),
        10 => kernel::<10>(a, low),
        12 => kernel::<12>(a, low),
        14 => kernel::<14>(a, low),
        16 => kernel::<16>(a, low),
        n => any(&mut a[..n * n], &mut low[..n * n], n),
    }
}

/// row −= factor own, at least from column `from` on: one of two lengths that the compiler knows. What is before is never
/// read again.
#[inline(always)]
fn subtract<const N: usize>(row: &mut [f64; N], factor: f64, own: &[f64; N], from: usize) {
    let half = N / 4 * 2;
    if from < half {
        (0..N).for_each(|k| row[k] -= factor * own[k]);
    } else {
        (half..N).for_each(|k| row[k] -= factor * own[k]);
    }
}

/// B = U⁻ᵀ B with U n × n, B n × width.
fn divide_block(u: &[f64], n: usize, b: &mut [f64]) {
    #[inline(always)]
    fn kernel(u: &[f64], b: &mut [f64], n: usize, width: usize) {
        let (u, b) = (&u[..n * n], &mut b[..n * width]);
        for i in 0..n {
            for k in 0..i {
                let factor = u[k * n + i];
                for j in 0..width {
                    b[i * width + j] -= factor * b[k * width + j];
                }
            }
            for j in 0..width {
                b[i * width + j] *= u[i * n + i];
            }
        }
    }
    let width = b.len() / n;
    if [n, width] == [6, 6] { kernel(u, b, 6, 6) } else { kernel(u, b, n, width) }
}

/// x = U⁻ᵀ x
fn divide_vector_transposed(u: &[f64], n: usize, x: &mut [f64]) {
    #[inline(always)]
    fn kernel(u: &[f64], x: &mut [f64], n: usize) {
        let (u, x) = (&u[..n * n], &mut x[..n]);
        for i in 0..n {
            x[i] *= u[i * n + i];
            for j in i + 1..n {
                x[j] -= u[i * n + j] * x[i];
            }
        }
    }
    sized!(n, n => kernel(u, x, n));
}

/// x = U⁻¹ x
fn divide_vector(u: &[f64], n: usize, x: &mut [f64]) {
    #[inline(always)]
    fn kernel(u: &[f64], x: &mut [f64], n: usize) {
        let (u, x) = (&u[..n * n], &mut x[..n]);
        for i in (0..n).rev() {
            for j in i + 1..n {
                x[i] -= u[i * n + j] * x[j];
            }
            x[i] *= u[i * n + i];
        }
    }
    sized!(n, n => kernel(u, x, n));
}

/// y = y − Uᵀ x
fn subtract_transposed(u: &[f64], x: &[f64], y: &mut [f64]) {
    #[inline(always)]
    fn kernel(u: &[f64], x: &[f64], y: &mut [f64], n: usize, width: usize) {
        let (u, x, y) = (&u[..n * width], &x[..n], &mut y[..width]);
        for i in 0..n {
            for j in 0..width {
                y[j] -= u[i * width + j] * x[i];
            }
        }
    }
    if [x.len(), y.len()] == [6, 6] { kernel(u, x, y, 6, 6) } else { kernel(u, x, y, x.len(), y.len()) }
}

/// x = x − U y
fn subtract_vector(u: &[f64], x: &mut [f64], y: &[f64]) {
    #[inline(always)]
    fn kernel(u: &[f64], x: &mut [f64], y: &[f64], n: usize, width: usize) {
        let (u, x, y) = (&u[..n * width], &mut x[..n], &y[..width]);
        for i in 0..n {
            for j in 0..width {
                x[i] -= u[i * width + j] * y[j];
            }
        }
    }
    if [x.len(), y.len()] == [6, 6] { kernel(u, x, y, 6, 6) } else { kernel(u, x, y, x.len(), y.len()) }
}

/// C = C − Aᵀ B with A n × ni, B n × nj; the slices begin with them.
fn subtract_product(c: &mut [f64], a: &[f64], b: &[f64], n: usize, [ni, nj]: [usize; 2]) {
    /// Two free bodies, most of the work in a pile: two rows at a time stay in registers, which takes 0.79 of the instructions of
    /// one row after the other (a pile of 100; three at a time 0.80).
    fn six(c: &mut [[f64; 6]], a: &[[f64; 6]], b: &[[f64; 6]]) {
        for i in [0, 2, 4] {
            let mut rows = [c[i], c[i + 1]];
            for (a, b) in a[..6].iter().zip(&b[..6]) {
                for (row, factor) in rows.iter_mut().zip([a[i], a[i + 1]]) {
                    (0..6).for_each(|j| row[j] -= factor * b[j]);
                }
            }
            [c[i], c[i + 1]] = rows;
        }
    }
    if [n, ni, nj] == [6, 6, 6] {
        return six(c[..36].as_chunks_mut().0, a[..36].as_chunks().0, b[..36].as_chunks().0);
    }
    let (c, a, b) = (&mut c[..ni * nj], &a[..n * ni], &b[..n * nj]);
    for k in 0..n {
        for i in 0..ni {
            let factor = a[k * ni + i];
            for j in 0..nj {
                c[i * nj + j] -= factor * b[k * nj + j];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain with a loop and blocks of several sizes, against the dense solution.
    #[test]
    fn solves_what_the_dense_matrix_solves() {
        for shape in [Shape::Symmetric, Shape::General] {
            let sizes = [6, 8, 6, 10, 6, 18];
            let pairs = [(0, 1), (1, 2), (2, 3), (3, 4), (4, 0), (2, 5), (5, 0)];
            let total: usize = sizes.iter().sum();
            let at: Vec<usize> = sizes.iter().scan(0, |sum, n| Some(std::mem::replace(sum, *sum + n))).collect();
            let mut dense = nalgebra::DMatrix::<f64>::identity(total, total) * 9.0;
            let mut factor = BlockFactor::default();
            factor.reset(sizes.iter().copied());
            for &(i, j) in &pairs {
                factor.connect(i, j);
            }
            factor.analyse();
            factor.unit(shape);
            // Element (a, b) of block (i, j) of the matrix.
            let element = |i: usize, j: usize, a: usize, b: usize| {
                let own = if i == j && a == b { 9.0 } else { 0.0 };
                let skew = if shape == Shape::General { (i as f64 - j as f64) + (a as f64 - b as f64) } else { 0.0 };
                own + 0.1 * ((a + b + i * j + i + j) as f64).sin() + 0.02 * skew
            };
            for (i, j) in (0..sizes.len()).map(|i| (i, i)).chain(pairs) {
                let (start, swapped) = factor.place(i, j);
                let (upper, lower) = factor.blocks();
                let (i, j) = if swapped { (j, i) } else { (i, j) };
                for a in 0..sizes[i] {
                    for b in 0..sizes[j] {
                        dense[(at[i] + a, at[j] + b)] = element(i, j, a, b);
                        dense[(at[j] + b, at[i] + a)] = element(j, i, b, a);
                        upper[start + a * sizes[j] + b] = element(i, j, a, b);
                        if shape == Shape::General && i != j {
                            lower[start + a * sizes[j] + b] = element(j, i, b, a);
                        }
                    }
                }
            }
            let mut x: Vec<f64> = (0..total).map(|i| (i as f64).cos()).collect();
            let right = nalgebra::DVector::from_column_slice(&x);
            factor.factor();
            factor.divide(&mut x);
            let back = dense * nalgebra::DVector::from_column_slice(&x);
            assert!((back - right).amax() < 1e-12, "{shape:?}: a system of 54 unknowns solved to rounding");
        }
    }
}
