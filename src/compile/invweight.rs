//! How lightly each body and joint moves at `qpos0`: the scale of constraint softness.

use crate::data::Data;
use crate::dynamics::{self, plan};
use crate::math::{Vec3, Vec6};
use crate::model::{self, FreeBody, JointKind, Model, Tree};

/// Fills `invweight0` of all bodies and dofs.
///
///     A_b = J_b M⁻¹ J_bᵀ at qpos0, J_b the Jacobian of the body's centre of mass
///     invweight0(body) = (mean of the three translational, mean of the three rotational diagonals of A_b)
///     invweight0(dof)  = diagonal of M⁻¹; for free and ball joints the mean of each block of three
///
/// Errors: the index of a dof that moves nothing the other dofs of its tree do not move: M is singular.
///
/// Source: MuJoCo manual, Computation › Constraint model › Diagonal regularizer.
pub fn fill(model: &mut Model) -> Result<(), usize> {
    // Free bodies need none of it.
    let articulated = model.trees.iter().any(|tree| tree.free.is_none());
    let mut data = if articulated { Data::without_contacts(model) } else { Data::default() };
    for t in 0..model.trees.len() {
        if let Some(free) = model.trees[t].free.clone() {
            fill_free(model, t, &free);
            continue;
        }
        dynamics::inertia_matrix(model, t, &mut data);
        check_pivots(&model.trees[t], &data)?;
        if slides_simply(model, &model.trees[t]) {
            fill_simple(model, t);
        } else {
            fill_articulated(model, t, &data);
        }
    }
    Ok(())
}

/// A rigid body of mass m and inertia I, seen at r from its centre of mass along the unit vectors e:
///
///     A_ee = 1/m + (r × e)·I⁻¹(r × e)
fn fill_free(model: &mut Model, t: usize, free: &FreeBody) {
    let lightness = |point: Vec3| {
        let arm = free.axes.transpose() * (point - free.com);
        let turning = |e: Vec3| arm.cross(&e).component_div(&free.inertia).dot(&arm.cross(&e));
        1.0 / free.mass + (turning(Vec3::x()) + turning(Vec3::y()) + turning(Vec3::z())) / 3.0
    };
    let rotational = free.inertia.map(|i| 1.0 / i).mean();
    let Tree { bodies, dofs, .. } = &model.trees[t];
    let (bodies, dofs) = (bodies.clone(), dofs.clone());
    let root = (Vec3::zeros(), crate::math::Quat::identity());
    // Of the bodies behind the root.
    let mut poses = Vec::new();
    for b in bodies.clone() {
        let body = &model.bodies[b];
        let (pos, quat) = match b - bodies.start {
            0 => root,
            _ => {
                let above = body.parent - bodies.start;
                let (pos, quat) = above.checked_sub(1).map_or(root, |i| poses[i]);
                poses.push((pos + quat * body.pos, quat * body.quat));
                poses[poses.len() - 1]
            }
        };
        model.parts_mut().bodies[b].invweight0 = [lightness(pos + quat * model.bodies[b].ipos), rotational];
    }
    for (i, dof) in model.parts_mut().dofs[dofs].iter_mut().enumerate() {
        dof.invweight0 = if i < 3 { lightness(Vec3::zeros()) } else { rotational };
    }
}

/// MuJoCo's `body_simple` 2: [`plan::simple`], and its joints only slide.
fn slides_simply(model: &Model, tree: &Tree) -> bool {
    let joints = &model.joints[model.bodies[tree.bodies.start].joints.clone()];
    plan::simple(model, tree) && joints.iter().all(|j| j.kind == JointKind::Slide) && !inert(model, tree)
}

/// Whether a tendon with inertia touches the tree.
fn inert(model: &Model, tree: &Tree) -> bool {
    let of = |t: &model::Tendon| t.bodies(&model.joints, &model.sites, &model.geoms);
    model.tendons.iter().filter(|t| t.armature != 0.0).flat_map(of).any(|b| tree.bodies.contains(&b))
}

/// A case of its own in MuJoCo: 1/m for the body and every dof, whatever the armature.
fn fill_simple(model: &mut Model, t: usize) {
    let body = model.trees[t].bodies.start;
    let light = 1.0 / model.bodies[body].mass;
    model.parts_mut().bodies[body].invweight0 = [light, 0.0];
    let dofs = model.trees[t].dofs.clone();
    model.parts_mut().dofs[dofs].iter_mut().for_each(|dof| dof.invweight0 = light);
}

fn fill_articulated(model: &mut Model, t: usize, data: &Data) {
    let Tree { bodies, dofs, .. } = model.trees[t].clone();
    let pattern = &data.plan.pattern;
    let mut jacobian = vec![[0.0; 6]; dofs.len()];
    for b in bodies {
        let mut last = 0;
        dynamics::each_column(model, data, b, &dynamics::xipos(model, data, b), |d, column| {
            jacobian[d - dofs.start] = column.into();
            last = last.max(d - dofs.start);
        });
        let diagonal = Vec6::from(pattern.weigh(&dofs, &data.qld, last, &mut jacobian));
        model.parts_mut().bodies[b].invweight0 =
            [diagonal.fixed_rows::<3>(0).mean(), diagonal.fixed_rows::<3>(3).mean()];
    }
    let mut unit = vec![[0.0]; dofs.len()];
    for d in 0..dofs.len() {
        unit[d] = [1.0];
        let [light] = pattern.weigh(&dofs, &data.qld, d, &mut unit);
        model.parts_mut().dofs[dofs.start + d].invweight0 = light;
    }
    for joint in dynamics::joints_of(model, &model.trees[t]) {
        let model::Joint { kind, dofadr, .. } = model.joints[joint];
        if matches!(kind, JointKind::Free | JointKind::Ball) {
            for block in model.parts_mut().dofs[dofadr..dofadr + kind.nv()].chunks_mut(3) {
                let mean = block.iter().map(|dof| dof.invweight0).sum::<f64>() / 3.0;
                block.iter_mut().for_each(|dof| dof.invweight0 = mean);
            }
        }
    }
}

/// Errors: the last dof whose pivot is nothing but rounding. M is factored from the last dof on, so that nothing is known of
/// those before it.
fn check_pivots(tree: &Tree, data: &Data) -> Result<(), usize> {
    let rows = data.plan.pattern.rows(&tree.dofs);
    // The factor holds the inverse of each pivot.
    let sound = |at: usize| 1.0 / data.qld[at] > 1e-13 * data.qm_rows[at];
    match rows.iter().rposition(|row| !sound(row.diagonal())) {
        Some(i) => Err(tree.dofs.start + i),
        None => Ok(()),
    }
}
