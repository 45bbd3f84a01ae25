//! Symmetric matrices of a tree, stored without what is zero: their factor, and systems solved with it.
//!
//! Entry (i, k) is not zero only where dof i is on the way from the root to dof k, or k on the way to i. Row k holds
//! the dofs on its way, the root's first and k itself last; the row of the p-th of them is then as long as the first
//! p entries and in the same order. So elimination subtracts the start of a row from a whole row, and nothing has to
//! be searched. Rows are filled up to an even length, and what is worked on two by two may spill into the filling.
//!
//! Source: Featherstone, Rigid Body Dynamics Algorithms (2008), §6.5 (LTDL).

use std::ops::{Mul, Range, SubAssign};

use super::links::NONE;

/// Does something with a length, compiled for each short one: loops of a known length need not count.
macro_rules! by_length {
    ($length:expr, $n:ident => $work:expr) => {
        $crate::dynamics::factor::by_length!($length, $n => $work, 0 1 2 3 4 5 6 7 8)
    };
    ($length:expr, $n:ident => $work:expr, $($short:literal)*) => {
        match $length {
            $($short => {
                let $n = $short;
                $work
            })*
            $n => $work,
        }
    };
}
pub(crate) use by_length;

/// Where the entries are: the same for every such matrix of a model.
#[derive(Clone, Debug, Default)]
pub struct Pattern {
    /// One row a dof; those of free bodies are empty.
    rows: Vec<Row>,
    entries: Vec<Entry>,
}

#[derive(Clone, Copy, Debug, Default)]
pub struct Row {
    /// Index of the first entry: even.
    pub start: usize,
    /// Number of entries; the last is the diagonal's.
    len: usize,
}

#[derive(Clone, Copy, Debug, Default)]
pub struct Entry {
    /// The dof of its column, counted in the tree.
    pub column: usize,
    /// Where the row of that dof starts, in pairs.
    pub pair: usize,
}

impl Row {
    pub fn entries(&self) -> Range<usize> {
        self.start..self.start + self.len
    }
    pub fn diagonal(&self) -> usize {
        self.start + self.len - 1
    }
    fn beside_diagonal(&self) -> Range<usize> {
        self.start..self.diagonal()
    }
}

impl Pattern {
    /// In: the dofs of each tree that has a matrix; the next dof towards the root for each dof, or [`NONE`].
    pub fn new<'a>(trees: impl Iterator<Item = &'a Range<usize>>, dof_parent: &[usize]) -> Pattern {
        let mut pattern = Pattern { rows: vec![Row::default(); dof_parent.len()], entries: Vec::new() };
        let Pattern { rows, entries } = &mut pattern;
        for dofs in trees {
            for k in dofs.clone() {
                let start = entries.len();
                rows[k].start = start;
                let mut d = k;
                while d != NONE {
                    entries.push(Entry { column: d - dofs.start, pair: rows[d].start / 2 });
                    d = dof_parent[d];
                }
                entries[start..].reverse();
                rows[k].len = entries.len() - start;
                entries.resize(entries.len().next_multiple_of(2), Entry::default());
            }
        }
        pattern
    }

    /// How many numbers a matrix has.
    pub fn size(&self) -> usize {
        self.entries.len()
    }

    /// The rows of a tree.
    pub fn rows(&self, dofs: &Range<usize>) -> &[Row] {
        &self.rows[dofs.clone()]
    }

    /// The dofs on the way from the root to a dof: the entries of its row.
    pub fn way(&self, dof: usize) -> &[Entry] {
        self.entries(&self.rows[dof])
    }

    /// The entries of a row.
    pub fn entries(&self, row: &Row) -> &[Entry] {
        &self.entries[row.entries()]
    }

    /// The entries of a row but the diagonal's.
    pub fn beside_diagonal(&self, row: &Row) -> &[Entry] {
        &self.entries[row.beside_diagonal()]
    }

    /// The numbers of a tree's matrix.
    pub fn block(&self, dofs: &Range<usize>) -> Range<usize> {
        let (first, last) = (self.rows[dofs.start], self.rows[dofs.end - 1]);
        first.start..(last.start + last.len).next_multiple_of(2)
    }

    /// Factors the matrix of a tree in place, H = Lᵀ D L, L unit lower triangular, and reduces x ← L⁻ᵀ x on the way.
    ///
    ///     for k from the leaves to the root, for i on its way:   H_ij ← H_ij − H_ki H_kj / H_kk,  j on the way to i
    ///                                                            x_i ← x_i − H_ki x_k / H_kk
    ///
    /// L is kept beside the diagonal, 1/D on it. In: `x` holds the tree's dofs.
    pub fn factor(&self, dofs: &Range<usize>, h: &mut [f64], x: &mut [f64]) {
        let (h, x) = (h.as_chunks_mut::<2>().0, &mut x[..dofs.len()]);
        for (k, row) in self.rows(dofs).iter().enumerate().rev() {
            let (before, own) = h.split_at_mut(row.start / 2);
            let way = &self.entries[row.beside_diagonal()];
            by_length!(way.len(), n => {
                eliminate(&way[..n], before, &mut own[..n / 2 + 1]);
                let own_x = x[k];
                for (l, entry) in own.as_flattened().iter().zip(&way[..n]) {
                    x[entry.column] -= l * own_x;
                }
            });
        }
    }

    /// Factors a matrix of this pattern in place, H = Lᵀ D L, L unit lower triangular.
    ///
    /// L is kept beside the diagonal, 1/D on it.
    pub fn factor_alone(&self, dofs: &Range<usize>, h: &mut [f64]) {
        let h = h.as_chunks_mut::<2>().0;
        for row in self.rows(dofs).iter().rev() {
            let (before, own) = h.split_at_mut(row.start / 2);
            let way = &self.entries[row.beside_diagonal()];
            by_length!(way.len(), n => eliminate(&way[..n], before, &mut own[..n / 2 + 1]));
        }
    }

    /// Factors a matrix of this pattern that is not symmetric, H = Uᵀ D L, both unit lower triangular.
    ///
    /// In: `low` holds H on and below the diagonal, `up` on and above it, transposed. Out: L and U beside the diagonal, 1/D on
    /// it.
    pub fn factor_general(&self, dofs: &Range<usize>, low: &mut [f64], up: &mut [f64]) {
        let (low, up) = (low.as_chunks_mut::<2>().0, up.as_chunks_mut::<2>().0);
        for row in self.rows(dofs).iter().rev() {
            let (low_before, low) = low.split_at_mut(row.start / 2);
            let (up_before, up) = up.split_at_mut(row.start / 2);
            let way = &self.entries[row.beside_diagonal()];
            by_length!(way.len(), n => {
                let (way, low, up) = (&way[..n], &mut low[..n / 2 + 1], &mut up[..n / 2 + 1]);
                let inverse = 1.0 / low.as_flattened()[n];
                subtract(way, up, inverse, low, low_before);
                subtract(way, low, inverse, up, up_before);
                for own in [low, up] {
                    own.iter_mut().for_each(|[a, b]| (*a, *b) = (*a * inverse, *b * inverse));
                    own.as_flattened_mut()[n] = inverse;
                }
            });
        }
    }

    /// x ← L⁻¹ D⁻¹ x with what [`factor`](Pattern::factor) left in `h` and `x`: the rest of x ← H⁻¹ x.
    pub fn substitute(&self, dofs: &Range<usize>, h: &[f64], x: &mut [f64]) {
        let x = &mut x[..dofs.len()];
        for (k, row) in self.rows(dofs).iter().enumerate() {
            let (l, way) = (&h[row.entries()], &self.entries[row.beside_diagonal()]);
            let mut sum = x[k] * l[way.len()];
            by_length!(way.len(), n => for (l, entry) in l[..n].iter().zip(&way[..n]) {
                sum -= x[entry.column] * l;
            });
            x[k] = sum;
        }
    }

    /// x ← U⁻ᵀ x with the factor of [`factor_general`](Pattern::factor_general); L is U of a symmetric matrix.
    pub fn reduce_one(&self, dofs: &Range<usize>, up: &[f64], x: &mut [f64]) {
        let x = &mut x[..dofs.len()];
        for (k, row) in self.rows(dofs).iter().enumerate().rev() {
            let (u, way, own) = (&up[row.entries()], &self.entries[row.beside_diagonal()], x[k]);
            by_length!(way.len(), n => for (u, entry) in u[..n].iter().zip(&way[..n]) {
                x[entry.column] -= u * own;
            });
        }
    }

    /// x ← L⁻ᵀ x with the factor of [`factor`](Pattern::factor), in D columns side by side; most of x may be zero, as on
    /// a chain of the tree.
    pub fn reduce<const D: usize>(&self, dofs: &Range<usize>, h: &[f64], x: &mut [[f64; D]]) {
        for (k, row) in self.rows(dofs).iter().enumerate().rev() {
            let own = x[k];
            if own == [0.0; D] {
                continue;
            }
            for (l, entry) in h[row.beside_diagonal()].iter().zip(&self.entries[row.beside_diagonal()]) {
                let x = &mut x[entry.column];
                (0..D).for_each(|d| x[d] -= l * own[d]);
            }
        }
    }

    /// x·H⁻¹ x = Σ y_k²/D_k, y = L⁻ᵀ x, of D columns that are zero but on the way to dof `last` (counted in the tree). The
    /// work grows with the length of that way, not with the tree. Leaves `x` zero.
    pub fn weigh<const D: usize>(&self, dofs: &Range<usize>, h: &[f64], last: usize, x: &mut [[f64; D]]) -> [f64; D] {
        let rows = self.rows(dofs);
        let mut sum = [0.0; D];
        for entry in self.entries(&rows[last]).iter().rev() {
            let (row, own) = (&rows[entry.column], std::mem::replace(&mut x[entry.column], [0.0; D]));
            for (l, entry) in h[row.beside_diagonal()].iter().zip(&self.entries[row.beside_diagonal()]) {
                let x = &mut x[entry.column];
                (0..D).for_each(|d| x[d] -= l * own[d]);
            }
            (0..D).for_each(|d| sum[d] += own[d] * own[d] * h[row.diagonal()]);
        }
        sum
    }

    /// x ← H⁻¹ x with the factor of [`factor`](Pattern::factor): x ← L⁻ᵀ x, then D⁻¹ x, then L⁻¹ x.
    ///
    /// In: `x` holds the tree's dofs, in one column or several side by side.
    pub fn solve<T: Column>(&self, dofs: &Range<usize>, h: &[f64], x: &mut [T]) {
        for (k, row) in self.rows(dofs).iter().enumerate().rev() {
            let own = x[k];
            for (l, entry) in h[row.beside_diagonal()].iter().zip(&self.entries[row.beside_diagonal()]) {
                x[entry.column] -= own * *l;
            }
        }
        for (k, row) in self.rows(dofs).iter().enumerate() {
            let mut sum = x[k] * h[row.diagonal()];
            for (l, entry) in h[row.beside_diagonal()].iter().zip(&self.entries[row.beside_diagonal()]) {
                sum -= x[entry.column] * *l;
            }
            x[k] = sum;
        }
    }
}

/// Subtracts from the rows on the way of row k what it accounts for, and makes it a row of L and D.
#[inline(always)]
fn eliminate(way: &[Entry], before: &mut [[f64; 2]], own: &mut [[f64; 2]]) {
    let inverse = 1.0 / own.as_flattened()[way.len()];
    subtract(way, own, inverse, own, before);
    own.iter_mut().for_each(|[a, b]| (*a, *b) = (*a * inverse, *b * inverse));
    own.as_flattened_mut()[way.len()] = inverse;
}

/// The row of the p-th dof on the way less `scale` factors_p times the start of `own`. Two by two.
#[inline(always)]
fn subtract(way: &[Entry], factors: &[[f64; 2]], scale: f64, own: &[[f64; 2]], before: &mut [[f64; 2]]) {
    for (p, entry) in way.iter().enumerate() {
        let (pairs, scale) = (p / 2 + 1, factors[p / 2][p % 2] * scale);
        for (above, own) in before[entry.pair..entry.pair + pairs].iter_mut().zip(&own[..pairs]) {
            let ([a, b], [c, d]) = (*above, *own);
            *above = [a - scale * c, b - scale * d];
        }
    }
}

/// What [`Pattern::solve`] can work on: a number of each dof, or several numbers, solved for at once.
pub trait Column: Copy + SubAssign + Mul<f64, Output = Self> {}

impl Column for f64 {}
impl Column for crate::math::Vec6 {}
