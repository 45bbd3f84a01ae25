//! The inertia matrix M(q) by the composite rigid body algorithm, and its factor.
//!
//! Source: Featherstone, Rigid Body Dynamics Algorithms (2008), ch. 6; MuJoCo 4.0 manual, Computation › Inertia.

use std::ops::{Mul, SubAssign};

use super::plan::NONE;
use super::spatial::Inertia;
use crate::data::Data;
use crate::math::{Mat3, Vec6, mat};
use crate::model::{Model, Tree};

/// Inertia of each body of a tree about the origin of its first body.
///
/// Reads: xpos, xmat. Writes: cinert (bodies of the tree).
pub fn bodies(model: &Model, tree: &Tree, data: &mut Data) {
    let origin = data.xpos[tree.bodies.start];
    for b in tree.bodies.clone() {
        let body = &model.bodies[b];
        let com = data.xpos[b] + data.xmat[b] * body.ipos - origin;
        let axes = data.xmat[b] * mat(&body.iquat);
        let central: Mat3 = axes * Mat3::from_diagonal(&body.inertia) * axes.transpose();
        data.cinert[b] = Inertia::new(body.mass, &com, &central);
    }
}

/// M of one tree: what the bodies beyond dof j resist when it accelerates, as felt by it and by the dofs before it.
///
///     M_ij = S_i · I_j S_j   for i on the way from j to the root,   I_j = Σ inertia of the bodies that j moves
///     M_jj += armature
///
/// Reads: cinert, cdof. Writes: crb (bodies of the tree), the tree's block of qm (both triangles).
pub fn matrix(model: &Model, t: usize, data: &mut Data) {
    let tree = &model.trees[t];
    let (n, first, adr) = (tree.dofs.len(), tree.dofs.start, data.m_adr[t]);
    for b in tree.bodies.clone() {
        data.crb[b] = data.cinert[b];
    }
    for b in tree.bodies.clone().skip(1).rev() {
        let beyond = data.crb[b];
        data.crb[model.bodies[b].parent].add(&beyond);
    }
    let qm = &mut data.qm[adr..adr + n * n];
    for j in tree.dofs.clone() {
        let force = data.crb[model.dofs[j].body].mul(&data.cdof[j]);
        let mut i = j;
        while i != NONE {
            let m = data.cdof[i].dot(&force);
            qm[(j - first) * n + i - first] = m;
            qm[(i - first) * n + j - first] = m;
            i = data.plan.dof_parent[i];
        }
        qm[(j - first) * (n + 1)] += model.dofs[j].armature;
    }
}

/// Factors a symmetric positive definite matrix in place: H = Lᵀ D L, L unit lower triangular.
///
/// Eliminating from the leaves to the root fills nothing in, so only the entries of dofs on the way to the root
/// are touched. L is kept below the diagonal; 1/D on the diagonal.
///
/// In:     `h` (n × n, row-major), `parent` of dof `first + i` for each i.
/// Source: Featherstone (2008), §6.5 (LTDL).
pub fn factor(h: &mut [f64], n: usize, first: usize, parent: &[usize]) {
    for k in (0..n).rev() {
        let inverse = 1.0 / h[k * n + k];
        let mut i = parent[first + k];
        while i != NONE {
            let a = h[k * n + i - first] * inverse;
            let mut j = i;
            while j != NONE {
                h[(i - first) * n + j - first] -= a * h[k * n + j - first];
                j = parent[j];
            }
            h[k * n + i - first] = a;
            i = parent[i];
        }
        h[k * n + k] = inverse;
    }
}

/// What [`solve`] can work on: a number of each dof, or several numbers, solved for at once.
pub trait Column: Copy + SubAssign + Mul<f64, Output = Self> {}

impl Column for f64 {}
impl Column for Vec6 {}

/// x ← H⁻¹ x with the factor of [`factor`]: x ← L⁻ᵀ x, then D⁻¹ x, then L⁻¹ x.
pub fn solve<T: Column>(h: &[f64], n: usize, first: usize, parent: &[usize], x: &mut [T]) {
    let (h, parent, x) = (&h[..n * n], &parent[first..first + n], &mut x[..n]);
    for (k, row) in h.chunks_exact(n).enumerate().rev() {
        let own = x[k];
        let mut i = parent[k];
        while i != NONE {
            x[i - first] -= own * row[i - first];
            i = parent[i - first];
        }
    }
    for (k, row) in h.chunks_exact(n).enumerate() {
        let mut sum = x[k] * row[k];
        let mut i = parent[k];
        while i != NONE {
            sum -= x[i - first] * row[i - first];
            i = parent[i - first];
        }
        x[k] = sum;
    }
}
