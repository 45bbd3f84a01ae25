//! Cholesky factorisation of a symmetric positive definite matrix made of blocks, most of them zero.
//!
//! A block row belongs to one moving tree; two trees share a block if a constraint connects them. Trees are
//! eliminated in the order of fewest neighbours, which keeps the factor sparse.
//!
//! Source: George and Liu, Computer Solution of Large Sparse Positive Definite Systems, 1981, chapter 5
//! (minimum degree), here with one bit per pair of trees.

/// H = Uᵀ U. Block row k of U holds the diagonal block and those to its right, each row-major.
#[derive(Clone, Debug, Default)]
pub struct BlockCholesky {
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
    values: Vec<f64>,
}

/// Block rows up to which there is room for a full factor from the start; beyond, it grows as it must.
const FULL: usize = 64;

impl BlockCholesky {
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
            self.values.reserve(size * size);
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
        self.values.resize(size, 0.0);
    }

    fn push_block(&mut self, row: usize, column: usize, size: &mut usize) {
        self.column.push(column);
        self.offset.push(*size);
        *size += self.n[row] * self.n[column];
    }

    /// Orders the blocks of a row as their columns are eliminated, and lays them out anew.
    fn sort_by_rank(&mut self, from: usize, to: usize, k: usize) {
        let BlockCholesky { column, rank, offset, n, order, .. } = self;
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

    /// Where block (i, j) starts in [`BlockCholesky::values`], and whether it is stored as (j, i) instead.
    pub fn place(&self, i: usize, j: usize) -> (usize, bool) {
        let (ri, rj) = (self.rank[i], self.rank[j]);
        let (k, other, swapped) = if ri <= rj { (ri, rj, false) } else { (rj, ri, true) };
        let row = &self.column[self.first[k]..self.first[k + 1]];
        let found = row.binary_search_by_key(&other, |&c| self.rank[c]).unwrap_or(0);
        (self.offset[self.first[k] + found], swapped)
    }

    pub fn values(&mut self) -> &mut [f64] {
        &mut self.values
    }

    /// Replaces the matrix by its factor. The diagonal of U is stored inverted.
    pub fn factor(&mut self) {
        for k in 0..self.order.len() {
            let n = self.n[self.order[k]];
            let (first, end) = (self.first[k], self.first[k + 1]);
            let start = self.offset[first];
            let stop = if end < self.offset.len() { self.offset[end] } else { self.values.len() };
            let (row, rest) = self.values[start..].split_at_mut(stop - start);
            let (diagonal, right) = row.split_at_mut(n * n);
            factor_dense(diagonal, n);
            for b in first + 1..end {
                let width = self.n[self.column[b]];
                let at = self.offset[b] - start - n * n;
                divide_block(diagonal, n, &mut right[at..at + n * width]);
            }
            // Every pair of blocks (k, i), (k, j) changes block (i, j); its columns are among those of row i.
            for bi in first + 1..end {
                let ki = self.rank[self.column[bi]];
                let ni = self.n[self.column[bi]];
                let ui = &right[self.offset[bi] - start - n * n..][..n * ni];
                let mut target = self.first[ki];
                for bj in bi..end {
                    let nj = self.n[self.column[bj]];
                    while self.column[target] != self.column[bj] {
                        target += 1;
                    }
                    let uj = &right[self.offset[bj] - start - n * n..][..n * nj];
                    let at = self.offset[target] - stop;
                    subtract_product(&mut rest[at..at + ni * nj], ui, uj, n);
                }
            }
        }
    }

    /// x = H⁻¹ x
    pub fn divide(&self, x: &mut [f64]) {
        for k in 0..self.order.len() {
            let (n, at) = (self.n[self.order[k]], self.at[self.order[k]]);
            divide_vector_transposed(self.block(self.first[k], n, n), n, &mut x[at..at + n]);
            for b in self.first[k] + 1..self.first[k + 1] {
                let (width, to) = (self.n[self.column[b]], self.at[self.column[b]]);
                let (own, other) = two(x, at, n, to, width);
                subtract_transposed(self.block(b, n, width), own, other);
            }
        }
        for k in (0..self.order.len()).rev() {
            let (n, at) = (self.n[self.order[k]], self.at[self.order[k]]);
            for b in self.first[k] + 1..self.first[k + 1] {
                let (width, from) = (self.n[self.column[b]], self.at[self.column[b]]);
                let (own, other) = two(x, at, n, from, width);
                subtract_vector(self.block(b, n, width), own, other);
            }
            divide_vector(self.block(self.first[k], n, n), n, &mut x[at..at + n]);
        }
    }

    fn block(&self, b: usize, n: usize, width: usize) -> &[f64] {
        &self.values[self.offset[b]..][..n * width]
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

/// Defines a function on blocks together with its body for free bodies, nearly all there is: the compiler unrolls
/// the loops of six.
macro_rules! kernel {
    ($(#[$doc:meta])* $name:ident ( $($arg:ident : $type:ty),* ) sizes ( $($n:ident = $size:expr),* ) $body:block) => {
        $(#[$doc])*
        fn $name($($arg: $type),*) {
            #[inline(always)]
            fn any($($arg: $type,)* $($n: usize),*) $body
            let sizes = [$($size),*];
            if sizes.iter().all(|&n| n == 6) {
                $(let $n = 6;)*
                any($($arg,)* $($n),*)
            } else {
                let [$($n),*] = sizes;
                any($($arg,)* $($n),*)
            }
        }
    };
}

kernel! {
    /// U of a dense block, in its upper triangle; the diagonal holds 1/Uᵢᵢ.
    factor_dense(a: &mut [f64], size: usize) sizes (n = size) {
        let _ = size;
        let a = &mut a[..n * n];
        for i in 0..n {
            for k in 0..i {
                let factor = a[k * n + i];
                for j in i..n {
                    a[i * n + j] -= factor * a[k * n + j];
                }
            }
            let inverse = 1.0 / a[i * n + i].sqrt();
            a[i * n + i] = inverse;
            for j in i + 1..n {
                a[i * n + j] *= inverse;
            }
        }
    }
}

kernel! {
    /// B = U⁻ᵀ B with U n × n, B n × width.
    divide_block(u: &[f64], size: usize, b: &mut [f64]) sizes (n = size, width = b.len() / size) {
        let _ = size;
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
}

kernel! {
    /// x = U⁻ᵀ x
    divide_vector_transposed(u: &[f64], size: usize, x: &mut [f64]) sizes (n = size) {
        let _ = size;
        let (u, x) = (&u[..n * n], &mut x[..n]);
        for i in 0..n {
            x[i] *= u[i * n + i];
            for j in i + 1..n {
                x[j] -= u[i * n + j] * x[i];
            }
        }
    }
}

kernel! {
    /// x = U⁻¹ x
    divide_vector(u: &[f64], size: usize, x: &mut [f64]) sizes (n = size) {
        let _ = size;
        let (u, x) = (&u[..n * n], &mut x[..n]);
        for i in (0..n).rev() {
            for j in i + 1..n {
                x[i] -= u[i * n + j] * x[j];
            }
            x[i] *= u[i * n + i];
        }
    }
}

kernel! {
    /// y = y − Uᵀ x
    subtract_transposed(u: &[f64], x: &[f64], y: &mut [f64]) sizes (n = x.len(), width = y.len()) {
        let (u, x, y) = (&u[..n * width], &x[..n], &mut y[..width]);
        for i in 0..n {
            for j in 0..width {
                y[j] -= u[i * width + j] * x[i];
            }
        }
    }
}

kernel! {
    /// x = x − U y
    subtract_vector(u: &[f64], x: &mut [f64], y: &[f64]) sizes (n = x.len(), width = y.len()) {
        let (u, x, y) = (&u[..n * width], &mut x[..n], &y[..width]);
        for i in 0..n {
            for j in 0..width {
                x[i] -= u[i * width + j] * y[j];
            }
        }
    }
}

kernel! {
    /// C = C − Aᵀ B with A n × ni, B n × nj.
    subtract_product(c: &mut [f64], a: &[f64], b: &[f64], size: usize)
    sizes (n = size, ni = a.len() / size, nj = b.len() / size) {
        let _ = size;
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
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain with a loop and blocks of several sizes, against the dense solution.
    #[test]
    fn solves_what_the_dense_matrix_solves() {
        let sizes = [6, 2, 6, 1, 6, 3];
        let pairs = [(0, 1), (1, 2), (2, 3), (3, 4), (4, 0), (2, 5), (5, 0)];
        let total: usize = sizes.iter().sum();
        let at: Vec<usize> = sizes.iter().scan(0, |sum, n| Some(std::mem::replace(sum, *sum + n))).collect();
        let mut dense = nalgebra::DMatrix::<f64>::identity(total, total) * 9.0;
        let mut blocks = BlockCholesky::default();
        blocks.reset(sizes.iter().copied());
        for &(i, j) in &pairs {
            blocks.connect(i, j);
        }
        blocks.analyse();
        blocks.values().fill(0.0);
        for (i, j) in (0..sizes.len()).map(|i| (i, i)).chain(pairs) {
            let (start, swapped) = blocks.place(i, j);
            for a in 0..sizes[i] {
                for b in 0..sizes[j] {
                    let value = if i == j && a == b { 9.0 } else { ((a + b + i * j) as f64).sin() };
                    dense[(at[i] + a, at[j] + b)] = value;
                    dense[(at[j] + b, at[i] + a)] = value;
                    let place = if swapped { b * sizes[i] + a } else { a * sizes[j] + b };
                    blocks.values()[start + place] = value;
                }
            }
        }
        let mut x: Vec<f64> = (0..total).map(|i| (i as f64).cos()).collect();
        let right = nalgebra::DVector::from_column_slice(&x);
        blocks.factor();
        blocks.divide(&mut x);
        let back = dense * nalgebra::DVector::from_column_slice(&x);
        assert!((back - right).amax() < 1e-13, "a system of 24 unknowns solved to rounding");
    }
}
