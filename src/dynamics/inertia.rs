//! The inertia matrix M(q) by the composite rigid body algorithm.
//!
//! Source: Featherstone, Rigid Body Dynamics Algorithms (2008), ch. 6; MuJoCo 4.0 manual, Computation › Inertia.

use super::links::Link;
use super::links::NONE;
use super::plan::Plan;
use super::spatial::{Inertia, dot};
use crate::data::Data;
use crate::math::Vec6;
use crate::model::{JointKind, Model};

/// Inertia of each link of a tree about the origin of its first body.
///
///     R I Rᵀ about its centre of mass c, shifted by c − o
///
/// Reads: xpos, xmat. Writes: cinert (bodies with joints).
pub fn links(model: &Model, t: usize, data: &mut Data) {
    let Data { plan, xpos, xmat, cinert, .. } = data;
    let origin = xpos[model.trees[t].bodies.start];
    for link in plan.links_of(t) {
        let axes = &xmat[link.body];
        let com = xpos[link.body] - origin + axes * link.com;
        cinert[link.body] = Inertia::new(link.mass, &com, &link.inertia.turned(axes));
    }
}

/// M of one tree: what the bodies beyond dof j resist when it accelerates, as felt by it and by the dofs before it.
///
///     M_ij = S_i · I_j S_j   for i on the way from j to the root,   I_j = Σ inertia of the bodies that j moves
///     M_jj += armature
///
/// Reads: cinert, cdof. Writes: crb (bodies with joints), the tree's block of qm_rows.
pub fn matrix(model: &Model, t: usize, data: &mut Data) {
    let Data { plan, qm_rows, cinert, crb, cdof, .. } = data;
    let (tree, links) = (&model.trees[t], plan.links_of(t));
    for link in links {
        crb[link.body] = cinert[link.body];
    }
    for link in links.iter().rev().filter(|link| link.parent != NONE) {
        let beyond = crb[link.body];
        crb[link.parent].add(&beyond);
    }
    let cdof = &cdof[tree.dofs.clone()];
    // The first three axes of a free joint are the world's.
    let first = model.joints[model.dofs[tree.dofs.start].joint].kind;
    let world = if first == JointKind::Free { 3 } else { 0 };
    let force = |link: &Link, j: usize| crb[link.body].mul(&cdof[j]);
    let product = |i: usize, force: &Vec6| if i < world { force[i] } else { dot(&cdof[i], force) };
    fill(model, t, plan, qm_rows, force, product);
}

/// The entries of M, by the force I_j S_j and its products with S_i.
#[inline(always)]
pub fn fill<F>(
    model: &Model,
    t: usize,
    plan: &Plan,
    qm_rows: &mut [f64],
    force: impl Fn(&Link, usize) -> F,
    product: impl Fn(usize, &F) -> f64,
) {
    let (dofs, pattern) = (&model.trees[t].dofs, &plan.pattern);
    for link in plan.links_of(t) {
        for j in link.dofs.start - dofs.start..link.dofs.end - dofs.start {
            let force = force(link, j);
            let row = &pattern.rows(dofs)[j];
            for (m, entry) in qm_rows[row.entries()].iter_mut().zip(pattern.entries(row)) {
                *m = product(entry.column, &force);
            }
            qm_rows[row.diagonal()] += model.dofs[dofs.start + j].armature;
        }
    }
}

/// M of one tree as a dense matrix, row-major. Not for a step. Reads: qm_rows.
pub fn dense(model: &Model, data: &Data, t: usize, out: &mut [f64]) {
    let (dofs, pattern) = (&model.trees[t].dofs, &data.plan.pattern);
    let n = dofs.len();
    out[..n * n].fill(0.0);
    for (j, row) in pattern.rows(dofs).iter().enumerate() {
        for (m, entry) in data.qm_rows[row.entries()].iter().zip(pattern.entries(row)) {
            out[j * n + entry.column] = *m;
            out[entry.column * n + j] = *m;
        }
    }
}
