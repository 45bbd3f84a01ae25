//! How lightly each body and joint moves at `qpos0`: the scale of constraint softness.

use nalgebra::{Cholesky, DMatrix, Dyn};

use super::inertia;
use crate::math::{self, Mat3, Quat, Vec3};
use crate::model::{Body, Dof, Joint, JointKind, Tree};

/// Fills `invweight0` of the bodies and dofs of one tree.
///
///     M = Σ_b J_bᵀ diag(m, I) J_b + diag(armature),   A_b = J_b M⁻¹ J_bᵀ   at qpos0, J_b at the centre of mass
///     invweight0(body) = (mean of the three translational, mean of the three rotational diagonals of A_b)
///     invweight0(dof)  = diagonal of M⁻¹; for free and ball joints the mean of each block of three
///
/// At qpos0 every joint is at its reference, so bodies have the poses of the file. A lone body that only slides
/// along its principal axes is a case of its own in MuJoCo: 1/m for the body and every dof, whatever the armature.
///
/// Errors: the index of the first dof that moves nothing the dofs before it do not move: M is singular.
///
/// Source: MuJoCo manual, Computation › Constraint model › Diagonal regularizer.
pub fn fill(tree: &Tree, bodies: &mut [Body], joints: &[Joint], dofs: &mut [Dof]) -> Result<(), usize> {
    let jacobians = jacobians(tree, bodies, joints);
    let n = tree.dofs.len();
    let mut m = DMatrix::zeros(n, n);
    for (b, (j, body_tensor)) in tree.bodies.clone().zip(&jacobians) {
        let (linear, angular) = (j.rows(0, 3), j.rows(3, 3));
        m += bodies[b].mass * linear.transpose() * linear + angular.transpose() * body_tensor * angular;
    }
    for (i, dof) in dofs[tree.dofs.clone()].iter().enumerate() {
        m[(i, i)] += dof.armature;
    }
    let factor = factor(&m).map_err(|i| tree.dofs.start + i)?;
    if slides_simply(tree, bodies, joints) {
        let light = 1.0 / bodies[tree.bodies.start].mass;
        bodies[tree.bodies.start].invweight0 = [light, 0.0];
        dofs[tree.dofs.clone()].iter_mut().for_each(|dof| dof.invweight0 = light);
        return Ok(());
    }

    for (b, (j, _)) in tree.bodies.clone().zip(&jacobians) {
        let a = j * factor.solve(&j.transpose());
        let mean = |k: usize| (a[(k, k)] + a[(k + 1, k + 1)] + a[(k + 2, k + 2)]) / 3.0;
        bodies[b].invweight0 = [mean(0), mean(3)];
    }
    let inverse = factor.inverse();
    for (i, dof) in dofs[tree.dofs.clone()].iter_mut().enumerate() {
        let joint = &joints[dof.joint];
        let block = match joint.kind {
            JointKind::Free | JointKind::Ball => 3,
            JointKind::Slide | JointKind::Hinge => 1,
        };
        let in_joint = tree.dofs.start + i - joint.dofadr;
        let first = i - in_joint % block;
        dof.invweight0 = (first..first + block).map(|k| inverse[(k, k)]).sum::<f64>() / block as f64;
    }
    Ok(())
}

/// MuJoCo's `body_simple` 2: one body, its inertial frame its own, joints that slide along axes of that frame.
fn slides_simply(tree: &Tree, bodies: &[Body], joints: &[Joint]) -> bool {
    let body = &bodies[tree.bodies.start];
    let along_axis = |j: &Joint| j.axis.iter().filter(|x| **x != 0.0).count() == 1 && j.pos == Vec3::zeros();
    tree.bodies.len() == 1
        && body.ipos == Vec3::zeros()
        && body.iquat.w.abs() == 1.0
        && joints[body.joints.clone()].iter().all(|j| j.kind == JointKind::Slide && along_axis(j))
}

/// Cholesky factor; Errors: the first dof whose pivot is nothing but rounding.
fn factor(m: &DMatrix<f64>) -> Result<Cholesky<f64, Dyn>, usize> {
    let n = m.nrows();
    let found = Cholesky::new(m.clone()).filter(|c| (0..n).all(|i| c.l_dirty()[(i, i)].powi(2) > 1e-13 * m[(i, i)]));
    found.ok_or_else(|| {
        (0..n)
            .find(|&i| {
                let part = Cholesky::new(m.view((0, 0), (i + 1, i + 1)).into_owned());
                part.is_none_or(|c| c.l_dirty()[(i, i)].powi(2) <= 1e-13 * m[(i, i)])
            })
            .unwrap_or(0)
    })
}

/// Per body of the tree: velocity of its centre of mass and of its turning per unit of each dof's velocity
/// (6 × dofs of the tree), and its inertia. All in the frame of the tree's root: what is made of them does not
/// depend on where the tree stands, and so keeps its digits far from the world's origin.
fn jacobians(tree: &Tree, bodies: &[Body], joints: &[Joint]) -> Vec<(DMatrix<f64>, Mat3)> {
    let start = tree.bodies.start;
    // The motion that one unit of each dof's velocity causes: (linear at the frame's origin, angular).
    let mut poses = Vec::with_capacity(tree.bodies.len());
    let mut fields: Vec<(Vec3, Vec3)> = Vec::with_capacity(tree.dofs.len());
    let mut out = Vec::with_capacity(tree.bodies.len());
    for b in tree.bodies.clone() {
        let body = &bodies[b];
        let (pos, quat) = match body.parent.checked_sub(start) {
            Some(parent) => {
                let (parent_pos, parent_quat): (Vec3, Quat) = poses[parent];
                (parent_pos + parent_quat * body.pos, parent_quat * body.quat)
            }
            None => (Vec3::zeros(), Quat::identity()),
        };
        poses.push((pos, quat));
        for joint in &joints[body.joints.clone()] {
            let axis = quat * joint.axis;
            let anchor = pos + quat * joint.pos;
            let turn = |axis: Vec3| (anchor.cross(&axis), axis);
            match joint.kind {
                JointKind::Slide => fields.push((axis, Vec3::zeros())),
                JointKind::Hinge => fields.push(turn(axis)),
                JointKind::Ball => fields.extend(math::mat(&quat).column_iter().map(|c| turn(c.into_owned()))),
                JointKind::Free => {
                    fields.extend(Mat3::identity().column_iter().map(|c| (c.into_owned(), Vec3::zeros())));
                    let about = |axis: Vec3| (pos.cross(&axis), axis);
                    fields.extend(math::mat(&quat).column_iter().map(|c| about(c.into_owned())));
                }
            }
        }
        let com = pos + quat * body.ipos;
        let mut jacobian = DMatrix::zeros(6, tree.dofs.len());
        for dof in ancestors(bodies, b, start).flat_map(|a| bodies[a].dofs.clone()) {
            let (linear, angular) = fields[dof - tree.dofs.start];
            let k = dof - tree.dofs.start;
            jacobian.fixed_view_mut::<3, 1>(0, k).copy_from(&(linear + angular.cross(&com)));
            jacobian.fixed_view_mut::<3, 1>(3, k).copy_from(&angular);
        }
        out.push((jacobian, inertia::tensor(&body.inertia, &(quat * body.iquat))));
    }
    out
}

/// A body and its ancestors, down to body number `start`.
fn ancestors(bodies: &[Body], body: usize, start: usize) -> impl Iterator<Item = usize> {
    std::iter::successors(Some(body), |&b| Some(bodies[b].parent)).take_while(move |&b| b >= start && b > 0)
}
