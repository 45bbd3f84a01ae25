//! The inertia matrix M(q) by the composite rigid body algorithm.
//!
//! Source: Featherstone, Rigid Body Dynamics Algorithms (2008), ch. 6; MuJoCo 4.0 manual, Computation › Inertia.

use super::plan::NONE;
use super::spatial::{Inertia, dot};
use crate::data::Data;
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
/// Reads: cinert, cdof. Writes: crb (bodies with joints), the tree's block of qm (both triangles) and of qm_rows.
pub fn matrix(model: &Model, t: usize, data: &mut Data) {
    let Data { plan, qm, qm_rows, m_adr, cinert, crb, cdof, .. } = data;
    let (tree, links, pattern) = (&model.trees[t], plan.links_of(t), &plan.pattern);
    let (n, first) = (tree.dofs.len(), tree.dofs.start);
    for link in links {
        crb[link.body] = cinert[link.body];
    }
    for link in links.iter().rev().filter(|link| link.parent != NONE) {
        let beyond = crb[link.body];
        crb[link.parent].add(&beyond);
    }
    let cdof = &cdof[tree.dofs.clone()];
    let qm = &mut qm[m_adr[t]..m_adr[t] + n * n];
    // The first three axes of a free joint are the world's.
    let world = if model.joints[model.dofs[first].joint].kind == JointKind::Free { 3 } else { 0 };
    for link in links {
        for j in link.dofs.start - first..link.dofs.end - first {
            let force = crb[link.body].mul(&cdof[j]);
            let row = &pattern.rows(&tree.dofs)[j];
            for (p, (m, entry)) in qm_rows[row.entries()].iter_mut().zip(pattern.entries(row)).enumerate() {
                let i = entry.column;
                *m = if p < world { force[p] } else { dot(&cdof[i], &force) };
                if i == j {
                    *m += model.dofs[first + j].armature;
                }
                qm[j * n + i] = *m;
                qm[i * n + j] = *m;
            }
        }
    }
}
