//! MuJoCo's `implicitfast`: semi-implicit Euler with the derivatives of forces by velocity, but for Coriolis forces.

use super::{Integrator, add_scaled, displace, semi_implicit_euler};
use crate::data::Data;
use crate::dynamics::factor::Row;
use crate::dynamics::plan::Plan;
use crate::dynamics::{actuation, fluid, tendon};
use crate::forward::{Method, begin};
use crate::math::{Mat3, Mat6, Vec3, Vec6, cross, vec3};
use crate::model::{FreeBody, JointKind, Model, Tree};
use crate::state::State;

/// The record.
pub const METHOD: Integrator = Integrator {
    name: "implicitfast",
    mjcf: &["implicitfast", "implicit"],
    order: 1,
    about: "semi-implicit Euler, with dampers, actuators and the gyroscopic force of free bodies implicit",
    implicit: false,
    implicit_dampers: super::Dampers::JointsAndActuators,
    advance,
    amplification: Some(semi_implicit_euler::amplification),
    estimate: None,
};

/// Whether this integrator does for a model what MuJoCo does under the MJCF keyword.
///
/// `implicit` differs from `implicitfast` in that trees with several joints get the derivative of their Coriolis
/// and centripetal forces too; for one hinge, for slides, and for a free body the two are the same.
pub fn supports(model: &Model, keyword: &str) -> bool {
    let same = |t: &Tree| t.free.is_some() || !t.rotates || t.dofs.len() == 1 || lone_free(model, t);
    keyword != "implicit" || model.trees.iter().all(same)
}

/// Implicit in velocity.
///
///     M̂ dv = h M qacc,   M̂ = M + h D,   D = −∂(forces)/∂v,   v ← v + dv,   q ← q ⊕ h v
///
/// D holds dampers, actuators and the drag of a medium, and for a body on a free joint the derivative of its bias force.
/// Source: MuJoCo 4.0 manual, Computation › Numerical integration › Integrators, Gyroscopic derivatives.
fn advance(model: &Model, method: &Method, state: &mut State, data: &mut Data) {
    let h = method.timestep;
    begin(model, method, state, data);
    data.stages.acc.copy_from_slice(&data.qacc);
    for (t, tree) in model.trees.iter().enumerate() {
        match &tree.free {
            Some(free) => gyroscopic(tree, free, &state.qvel, h, data),
            None if lone_free(model, tree) => free_joint(model, t, &state.qvel, h, data),
            None if data.plan.implicit[t] => articulated(model, t, &state.qvel, h, data),
            None => {}
        }
    }
    add_scaled(&mut state.qvel, h, &data.stages.acc);
    displace(model, &mut state.qpos, &state.qvel, h);
    actuation::advance(model, &data.act_dot, h, &mut state.act);
    state.time += h;
}

/// Implicit acceleration of a free body, from its ordinary one.
///
///     (I + h ([ω] I − [I ω])) α̂ = I α                               principal axes
///     â = a + R ((α − α̂) × c + h ((ω × c) × α̂ + ω × (c × α̂)))       c: centre of mass in the body's frame
///
/// which is M̂⁻¹ M qacc with the 6 × 6 matrix of the free joint eliminated by hand.
/// Reads: qacc. Writes: acc of the stages.
fn gyroscopic(tree: &Tree, free: &FreeBody, qvel: &[f64], h: f64, data: &mut Data) {
    let dofs = tree.dofs.clone();
    let w = vec3(&qvel[dofs.start + 3..dofs.end]);
    let wp = free.axes.tr_mul(&w);
    let alpha = vec3(&data.qacc[dofs.start + 3..dofs.end]);
    let matrix = gyro_matrix(&free.inertia, &wp, h);
    let rhs = free.inertia.component_mul(&free.axes.tr_mul(&alpha));
    let implicit = free.axes * solve3(&matrix, &rhs);
    let c = &free.com;
    let shift = (alpha - implicit).cross(c) + h * (w.cross(c).cross(&implicit) + w.cross(&c.cross(&implicit)));
    let shift = data.xmat[tree.bodies.start] * shift;
    for i in 0..3 {
        data.stages.acc[dofs.start + i] += shift[i];
        data.stages.acc[dofs.start + 3 + i] = implicit[i];
    }
}

/// I + h ([ω] I − [I ω]) for a diagonal I.
fn gyro_matrix(inertia: &Vec3, w: &Vec3, h: f64) -> Mat3 {
    let i = Mat3::from_diagonal(inertia);
    i + h * (cross(w) * i - cross(&inertia.component_mul(w)))
}

/// A⁻¹ b by Cramer's rule.
fn solve3(a: &Mat3, b: &Vec3) -> Vec3 {
    let (c0, c1, c2) = (a.column(0), a.column(1), a.column(2));
    let c12 = c1.cross(&c2);
    let det = c0.dot(&c12);
    Vec3::new(b.dot(&c12), c0.dot(&b.cross(&c2)), c0.dot(&c1.cross(b))) / det
}

/// Whether all that moves in the tree is one body on a free joint.
fn lone_free(model: &Model, tree: &Tree) -> bool {
    tree.dofs.len() == 6 && model.joints[model.dofs[tree.dofs.start].joint].kind == JointKind::Free
}

/// Implicit acceleration of a tree, by its inertia matrix.
fn articulated(model: &Model, t: usize, qvel: &[f64], h: f64, data: &mut Data) {
    let dofs = &model.trees[t].dofs;
    implicit_matrix(model, t, qvel, h, data);
    let Data { plan, stages, qfrc_smooth, qfrc_constraint, .. } = data;
    let acc = &mut stages.acc[dofs.clone()];
    for (i, d) in dofs.clone().enumerate() {
        acc[i] = qfrc_smooth[d] + qfrc_constraint[d];
    }
    plan.pattern.factor(dofs, &mut stages.qh, acc);
    plan.pattern.substitute(dofs, &stages.qh, acc);
}

/// M + h D of a tree, D from dampers of joints and tendons and from actuators whose force depends on velocity.
///
///     D = Σ damping_j e_j e_jᵀ + Σ damping J_tendonᵀ J_tendon − Σ (∂force/∂velocity) gear gearᵀ
///
/// Writes: qh of the stages.
fn implicit_matrix(model: &Model, t: usize, qvel: &[f64], h: f64, data: &mut Data) {
    let dofs = &model.trees[t].dofs;
    let mut qh = std::mem::take(&mut data.stages.qh);
    let Data { qm_rows, plan, moments, .. } = &*data;
    let (block, rows) = (plan.pattern.block(dofs), plan.pattern.rows(dofs));
    qh[block.clone()].copy_from_slice(&qm_rows[block]);
    for &d in plan.dampers.iter().filter(|d| dofs.contains(d)) {
        qh[rows[d - dofs.start].diagonal()] += h * model.dofs[d].damping;
    }
    if !plan.fluid.is_empty() && !lone_free(model, &model.trees[t]) {
        fluid::slopes(model, t, qvel, data, true, |d, e, slope| {
            let row = &rows[d - dofs.start];
            let at = plan.pattern.entries(row).iter().position(|entry| entry.column == e - dofs.start);
            if let Some(at) = at.filter(|_| e == d || !plan.simple[t]) {
                qh[row.entries()][at] -= h * slope;
            }
        });
    }
    let tendons = if model.opt.flags.damper { &plan.pulling_tendons[..] } else { &[] };
    for &i in tendons {
        let slope = tendon::damping(&model.tendons[i], data.ten_velocity[i]);
        let Some(own) = plan.tendons[i].iter().find(|block| block.tree == t) else { continue };
        let moment = &data.ten_j[own.at..own.at + dofs.len()];
        add_outer(plan, t, rows, -h * slope, moment, &mut qh);
    }
    let acting = if model.opt.flags.actuation { &model.actuators[..] } else { &[] };
    for (i, actuator) in acting.iter().enumerate() {
        let gain = actuation::velocity_gain(model, data, i);
        if gain == 0.0 {
            continue;
        }
        if let Some(at) = plan.moments[i] {
            let moment = &moments[at..at + model.nv][dofs.clone()];
            add_outer(plan, t, rows, -h * gain, moment, &mut qh);
            continue;
        }
        let (first, gear) = actuation::joint_gear(model, actuator);
        if dofs.contains(&first) {
            for (i, a) in gear.iter().enumerate() {
                let row = &rows[first - dofs.start + i];
                // The dofs of a joint follow one another on the way to the root.
                for (m, b) in qh[row.diagonal() - i..=row.diagonal()].iter_mut().zip(gear) {
                    *m -= h * gain * a * b;
                }
            }
        }
    }
    data.stages.qh = qh;
}

/// Adds factor · moment momentᵀ of a tree to its matrix, where that has entries.
fn add_outer(plan: &Plan, t: usize, rows: &[Row], factor: f64, moment: &[f64], qh: &mut [f64]) {
    for ((row, a), own) in rows.iter().zip(moment).zip(0..).filter(|((_, a), _)| **a != 0.0) {
        for (m, entry) in qh[row.entries()].iter_mut().zip(plan.pattern.entries(row)) {
            if entry.column == own || !plan.simple[t] {
                *m += factor * a * moment[entry.column];
            }
        }
    }
}

/// Implicit acceleration of a body on a free joint that has armature, a spring, a damper or an actuator.
///
/// With m, h = m R c and I₀ about the body's origin in its own axes, c₀ = h in them:
///
///     bias = [m R (ω × (ω × c)), ω × I₀ ω]
///     ∂bias/∂ω = [−R ([ω × c₀] + [ω] [c₀]), [ω] I₀ − [I₀ ω]]
fn free_joint(model: &Model, t: usize, qvel: &[f64], h: f64, data: &mut Data) {
    let tree = &model.trees[t];
    let (first, root) = (tree.dofs.start, tree.bodies.start);
    implicit_matrix(model, t, qvel, h, data);
    let w = vec3(&qvel[first + 3..first + 6]);
    let rot = data.xmat[root];
    let whole = data.crb[root];
    let (moment, inertia) = (rot.tr_mul(&whole.moment), rot.tr_mul(&whole.about.mat()) * rot);
    let linear = -rot * (cross(&w.cross(&moment)) + cross(&w) * cross(&moment));
    let angular = cross(&w) * inertia - cross(&(inertia * w));
    let mut matrix = Mat6::zeros();
    for (i, row) in data.plan.pattern.rows(&tree.dofs).iter().enumerate() {
        for (j, m) in data.stages.qh[row.entries()].iter().enumerate() {
            (matrix[(i, j)], matrix[(j, i)]) = (*m, *m);
        }
    }
    for i in 0..3 {
        for j in 0..3 {
            matrix[(i, 3 + j)] += h * linear[(i, j)];
            matrix[(3 + i, 3 + j)] += h * angular[(i, j)];
        }
    }
    fluid::slopes(model, t, qvel, data, false, |d, e, slope| matrix[(d - first, e - first)] -= h * slope);
    let force = Vec6::from_fn(|i, _| data.qfrc_smooth[first + i] + data.qfrc_constraint[first + i]);
    if let Some(acc) = matrix.lu().solve(&force) {
        data.stages.acc[first..first + 6].copy_from_slice(acc.as_slice());
    }
}
