//! Normal forces of several contacts at once.

use crate::contact::rows::{Six, dot as along};
use crate::math::{divide_ldl, factor_ldl};

/// A: how the contacts' accelerations answer to their forces, 1/kg; symmetric and positive definite.
#[derive(Clone, Copy, Debug)]
pub enum Matrix<'a> {
    /// Row-major n × n.
    Dense(&'a [f64]),
    Star(Star<'a>),
}

/// Contacts that feel each other through one body only, as those of a tray feel the balls on it:
///
///     A = D + U M⁻¹ Uᵀ,     (A⁻¹ b)ᵢ = (bᵢ − uᵢ y)/Dᵢ  with  (M + Σ uᵢᵀuᵢ/Dᵢ) y = Σ uᵢᵀ bᵢ/Dᵢ
///
/// Work grows with n where that of a dense matrix grows with n³ (Woodbury's formula).
#[derive(Clone, Copy, Debug)]
pub struct Star<'a> {
    pub spokes: &'a [Spoke],
    /// M⁻¹ of the body, diagonal: 1/kg, 1/(kg m²).
    pub minv: Six,
}

/// One contact of a star.
#[derive(Clone, Copy, Debug, Default)]
pub struct Spoke {
    /// Row of the body's Jacobian.
    pub u: Six,
    /// D and 1/D, where D is the rest of A: the other body's share and the softness.
    pub own: f64,
    pub inverse: f64,
}

impl Matrix<'_> {
    /// out = A f
    pub fn times(&self, f: &[f64], out: &mut [f64]) {
        match self {
            Matrix::Dense(a) => {
                for (out, row) in out.iter_mut().zip(a.chunks_exact(f.len())) {
                    *out = dot(row, f);
                }
            }
            Matrix::Star(star) => {
                let hub = star.answer(f);
                for ((out, spoke), f) in out.iter_mut().zip(star.spokes).zip(f) {
                    *out = along(&spoke.u, &hub) + spoke.own * f;
                }
            }
        }
    }
}

impl Star<'_> {
    /// Acceleration of the body under the forces f: M⁻¹ Uᵀ f.
    fn answer(&self, f: &[f64]) -> Six {
        let mut sum = [0.0; 6];
        for (spoke, f) in self.spokes.iter().zip(f) {
            (0..6).for_each(|k| sum[k] += spoke.u[k] * f);
        }
        std::array::from_fn(|k| sum[k] * self.minv[k])
    }
}

/// Finds the forces f ≥ 0 with A f ≥ b and fᵀ(A f − b) = 0: every contact either pushes and reaches its reference
/// acceleration, or does not push and exceeds it.
///
/// Block principal pivoting: guess which contacts push, solve for them by Cholesky, then move every contact
/// whose force is negative, or whose acceleration is too small, to the other side. If the number of wrong
/// contacts stops shrinking, only the last wrong one moves (Murty's rule), which always ends.
///
/// Source: J. J. Júdice, F. M. Pires, Computers & Operations Research 21 (1994), 587–596.
#[derive(Clone, Debug, Default)]
pub struct Complementarity {
    pushes: Vec<bool>,
    wrong: Vec<bool>,
    /// First column of each row of a dense A that is not zero: nothing to the left of it fills in.
    start: Vec<usize>,
    factor: Vec<f64>,
    /// Factor of M + Σ uᵢᵀuᵢ/Dᵢ of a star.
    hub: [Six; 6],
}

impl Complementarity {
    /// In:  `b` (n); `again` if `a` is that of the last call: then its factor may serve again.
    /// Out: `f` (n). Returns the number of linear systems solved.
    pub fn solve(&mut self, a: Matrix, b: &[f64], f: &mut [f64], again: bool) -> usize {
        let n = b.len();
        if again && self.pushes.len() == n {
            self.substitute(a, b, f);
            if self.find_wrong(a, b, f) == 0 {
                return 1;
            }
        }
        // Mostly all push, and there are few: a loop of fixed length.
        let at_once = match (a, n) {
            (Matrix::Dense(a), 1) => all_push::<1>(a, b, f),
            (Matrix::Dense(a), 2) => all_push::<2>(a, b, f),
            (Matrix::Dense(a), 3) => all_push::<3>(a, b, f),
            (Matrix::Dense(a), 4) => all_push::<4>(a, b, f),
            _ => false,
        };
        if at_once {
            self.pushes.clear();
            return 1;
        }
        self.pushes.clear();
        self.pushes.resize(n, true);
        if let Matrix::Dense(a) = a {
            self.factor.resize(n * n, 0.0);
            self.start.clear();
            self.start.extend((0..n).map(|i| a[i * n..i * n + i].iter().position(|x| *x != 0.0).unwrap_or(i)));
        }
        let (mut fewest, mut patience) = (n + 1, 3);
        let mut solves = 0;
        loop {
            match a {
                Matrix::Dense(a) => self.factor_dense(a),
                Matrix::Star(star) => self.factor_star(star),
            }
            self.substitute(a, b, f);
            solves += 1;
            let count = self.find_wrong(a, b, f);
            if count == 0 || solves > 50 * n {
                f.iter_mut().for_each(|f| *f = f.max(0.0));
                return solves;
            }
            let all = if count < fewest {
                (fewest, patience) = (count, 3);
                true
            } else {
                patience -= 1;
                patience >= 0
            };
            for (pushes, _) in self.pushes.iter_mut().zip(&self.wrong).rev().filter(|(_, wrong)| **wrong) {
                *pushes ^= true;
                if !all {
                    break;
                }
            }
        }
    }

    /// Finds the contacts that are on the wrong side, and how many they are.
    fn find_wrong(&mut self, a: Matrix, b: &[f64], f: &[f64]) -> usize {
        let n = b.len();
        let hub = match a {
            Matrix::Dense(_) => [0.0; 6],
            Matrix::Star(star) => star.answer(f),
        };
        self.wrong.clear();
        self.wrong.extend(self.pushes.iter().enumerate().map(|(i, pushes)| {
            if *pushes {
                return f[i] < 0.0;
            }
            let reached = match a {
                Matrix::Dense(a) => dot(&a[i * n..i * n + n], f),
                Matrix::Star(star) => along(&star.spokes[i].u, &hub),
            };
            // A contact that rests exactly at its reference may stay on either side.
            reached < b[i] - 1e-14 * b[i].abs()
        }));
        self.wrong.iter().filter(|wrong| **wrong).count()
    }

    /// A = L Lᵀ on the pushing contacts. The other rows of L are zero, so that indices need no translation.
    fn factor_dense(&mut self, a: &[f64]) {
        let Complementarity { pushes, start, factor, .. } = self;
        let n = pushes.len();
        for i in 0..n {
            factor[i * n + start[i]..=i * n + i].fill(0.0);
            if !pushes[i] {
                continue;
            }
            let mut pivot = a[i * n + i];
            for j in start[i]..i {
                let from = start[i].max(start[j]);
                let l = (a[i * n + j] - dot(&factor[i * n + from..i * n + j], &factor[j * n + from..j * n + j]))
                    * factor[j * n + j];
                factor[i * n + j] = l;
                pivot -= l * l;
            }
            // The diagonal holds 1/L_ii. Rounding may leave a redundant contact without a pivot: it carries nothing.
            factor[i * n + i] = if pivot > 1e-15 * a[i * n + i] { 1.0 / pivot.sqrt() } else { 0.0 };
        }
    }

    /// M + Σ uᵢᵀuᵢ/Dᵢ over the pushing contacts.
    fn factor_star(&mut self, star: Star) {
        self.hub = [[0.0; 6]; 6];
        for k in 0..6 {
            self.hub[k][k] = 1.0 / star.minv[k];
        }
        for (spoke, _) in star.spokes.iter().zip(&self.pushes).filter(|(_, pushes)| **pushes) {
            for (row, u) in self.hub.iter_mut().zip(&spoke.u) {
                let scaled = u * spoke.inverse;
                (0..6).for_each(|k| row[k] += scaled * spoke.u[k]);
            }
        }
        factor_ldl(&mut self.hub);
    }

    /// f of the contacts that push, from A f = b restricted to them; zero for the others.
    fn substitute(&self, a: Matrix, b: &[f64], f: &mut [f64]) {
        let Complementarity { pushes, start, factor, hub, .. } = self;
        let n = b.len();
        if let Matrix::Star(star) = a {
            let mut y = [0.0; 6];
            for (i, spoke) in star.spokes.iter().enumerate() {
                f[i] = if pushes[i] { b[i] * spoke.inverse } else { 0.0 };
                (0..6).for_each(|k| y[k] += spoke.u[k] * f[i]);
            }
            divide_ldl(hub, &mut y);
            for (i, spoke) in star.spokes.iter().enumerate().filter(|(i, _)| pushes[*i]) {
                f[i] -= along(&spoke.u, &y) * spoke.inverse;
            }
            return;
        }
        for i in 0..n {
            f[i] = (b[i] - dot(&factor[i * n + start[i]..i * n + i], &f[start[i]..i])) * factor[i * n + i];
        }
        for i in (0..n).rev() {
            f[i] *= factor[i * n + i];
            let (x, row) = (f[i], &factor[i * n + start[i]..i * n + i]);
            for (f, l) in f[start[i]..i].iter_mut().zip(row) {
                *f -= l * x;
            }
        }
    }
}

/// a · b, summed in four columns, which fill vector registers.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a, b) = (a.as_chunks::<4>(), b.as_chunks::<4>());
    let mut sum = [0.0; 4];
    for (a, b) in a.0.iter().zip(b.0) {
        for i in 0..4 {
            sum[i] += a[i] * b[i];
        }
    }
    let rest: f64 = a.1.iter().zip(b.1).map(|(a, b)| a * b).sum();
    (sum[0] + sum[2]) + (sum[1] + sum[3]) + rest
}

/// The factor of A for N contacts that all push, as they mostly do: few enough for loops of fixed length.
pub struct AllPush<const N: usize>([[f64; N]; N]);

impl<const N: usize> AllPush<N> {
    /// Nothing if A is singular but for rounding. In: `a(i, j)` the elements of A on and below its diagonal.
    #[inline(always)]
    pub fn new(a: impl Fn(usize, usize) -> f64) -> Option<AllPush<N>> {
        let mut l = [[0.0; N]; N];
        for i in 0..N {
            for j in 0..=i {
                l[i][j] = a(i, j);
            }
        }
        let own: [f64; N] = std::array::from_fn(|i| l[i][i]);
        factor_ldl(&mut l);
        let sound = |i: usize| (l[i][i] > 0.0) & (own[i] * l[i][i] < 1e15);
        (0..N).fold(true, |all, i| all & sound(i)).then_some(AllPush(l))
    }

    /// f from A f = b; nothing if some contact would have to pull.
    #[inline(always)]
    pub fn forces(&self, b: &[f64; N]) -> Option<[f64; N]> {
        let mut f = *b;
        divide_ldl(&self.0, &mut f);
        f.iter().fold(true, |all, f| all & (*f >= 0.0)).then_some(f)
    }
}

/// [`AllPush`] for a row-major A; says whether they do.
fn all_push<const N: usize>(a: &[f64], b: &[f64], f: &mut [f64]) -> bool {
    let b = std::array::from_fn(|i| b[i]);
    let forces = AllPush::<N>::new(|i, j| a[i * N + j]).and_then(|factor| factor.forces(&b));
    forces.inspect(|x| f.copy_from_slice(x)).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers between −1 and 1, always the same.
    fn sequence() -> impl FnMut() -> f64 {
        let mut seed = 1u64;
        move || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 33) as f64 / (1u64 << 30) as f64 - 1.0
        }
    }

    /// A star and the same matrix written out must give the same forces, whoever pushes.
    #[test]
    fn a_star_is_the_matrix_it_stands_for() {
        let mut random = sequence();
        for case in 0..300 {
            let n = 1 + case % 9;
            let minv: Six = std::array::from_fn(|_| 1.1 + random());
            let spokes: Vec<Spoke> = (0..n)
                .map(|_| {
                    let own = if case % 2 == 0 { 1.1 + random() } else { 0.01 };
                    Spoke { u: std::array::from_fn(|_| random()), own, inverse: 1.0 / own }
                })
                .collect();
            let mut dense = vec![0.0; n * n];
            for (i, a) in spokes.iter().enumerate() {
                for (j, b) in spokes.iter().enumerate() {
                    dense[i * n + j] = (0..6).map(|k| a.u[k] * minv[k] * b.u[k]).sum();
                }
                dense[i * n + i] += a.own;
            }
            let b: Vec<f64> = (0..n).map(|_| random() + 0.3).collect();
            let answer = |matrix: Matrix| {
                let (mut f, mut product) = (vec![0.0; n], vec![0.0; n]);
                Complementarity::default().solve(matrix, &b, &mut f, false);
                matrix.times(&f, &mut product);
                [f, product].concat()
            };
            let (star, dense) = (answer(Matrix::Star(Star { spokes: &spokes, minv })), answer(Matrix::Dense(&dense)));
            let size = dense.iter().fold(1.0f64, |m, x| m.max(x.abs()));
            for (a, b) in star.iter().zip(&dense) {
                assert!((a - b).abs() < 1e-10 * size, "case {case}: {star:?}, written out {dense:?}");
            }
        }
    }

    /// Every A, b drawn from a fixed sequence: the answer must satisfy the definition itself.
    #[test]
    fn answers_satisfy_complementarity() {
        let mut random = sequence();
        for case in 0..500 {
            let n = 1 + case % 8;
            // Rank three plus a small diagonal: four corners of a box.
            let g: Vec<[f64; 3]> = (0..n).map(|_| std::array::from_fn(|_| random())).collect();
            let soft = if case % 2 == 0 { 0.05 } else { 1e-9 };
            let a: Vec<f64> = (0..n * n)
                .map(|k| {
                    let (i, j) = (k / n, k % n);
                    (0..3).map(|d| g[i][d] * g[j][d]).sum::<f64>() + if i == j { soft } else { 0.0 }
                })
                .collect();
            let b: Vec<f64> = (0..n).map(|_| random()).collect();
            let mut f = vec![0.0; n];
            let mut solver = Complementarity::default();
            // Then with the same matrix: a little beside, where the factor serves again, and far off.
            let beside = b.iter().map(|b| b * 1.01).collect();
            let far = b.iter().map(|b| 0.5 - b).collect();
            for (turn, b) in [b, beside, far].into_iter().enumerate() {
                solver.solve(Matrix::Dense(&a), &b, &mut f, turn > 0);
                let scale = 1.0 + f.iter().fold(0.0f64, |m, x| m.max(*x));
                for i in 0..n {
                    let excess = (0..n).map(|j| a[i * n + j] * f[j]).sum::<f64>() - b[i];
                    let place = format!("case {case} turn {turn}: f {f:?} excess {excess}");
                    assert!(f[i] >= 0.0 && excess > -1e-6 * scale, "{place}");
                    assert!((f[i] * excess).abs() < 1e-6 * scale * scale, "{place}");
                }
            }
        }
    }
}
