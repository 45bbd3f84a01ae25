//! Springs and dampers in joints and tendons. Source: MuJoCo 4.0 manual, Computation › Passive forces.

use super::fluid;
use super::spatial::lin;
use super::tendon;
use crate::data::Data;
use crate::math::{between, quat, vec3};
use crate::model::{Joint, JointKind, Model};

/// Spring and damper forces.
///
///     slide, hinge:  f = −k (q − springref) − d q̇
///     ball:          f = −k log(q₀⁻¹ q) − d ω           (body axes)
///     free:          f = −k (p − p₀), then as ball       (p₀, q₀ from qpos0)
///     tendon:        Jᵀ f                                 f: see [`tendon::passive`]
///
/// Reads: qpos, qvel, tendons. Writes: qfrc_passive (nv).
pub fn passive(model: &Model, qpos: &[f64], qvel: &[f64], data: &mut Data) {
    let Data { plan, qfrc_passive, .. } = data;
    let tendons = &plan.pulling_tendons;
    if plan.springs.is_empty()
        && plan.dampers.is_empty()
        && plan.gravcomp.is_empty()
        && plan.fluid.is_empty()
        && tendons.is_empty()
    {
        return;
    }
    qfrc_passive.fill(0.0);
    for &j in &plan.springs {
        let joint = &model.joints[j];
        let (stretch, n) = stretch(model, joint, qpos);
        for i in 0..n {
            qfrc_passive[joint.dofadr + i] = -joint.stiffness * stretch[i];
        }
    }
    for &d in &plan.dampers {
        qfrc_passive[d] -= model.dofs[d].damping * qvel[d];
    }
    for k in 0..data.plan.pulling_tendons.len() {
        let i = data.plan.pulling_tendons[k];
        let force = tendon::passive(model, data, i);
        tendon::push(&data.plan.tendons[i], &data.ten_j, force, &mut data.qfrc_passive);
    }
    if !data.plan.gravcomp.is_empty() {
        compensate(model, data);
    }
    if !data.plan.fluid.is_empty() {
        fluid::drag(model, qvel, data);
    }
}

/// Compensation of gravity: −m g `gravcomp` at the centre of mass of each body that has some.
///
/// Dofs whose actuators bear it get it there. Writes: qfrc_gravcomp. Adds to: qfrc_passive.
fn compensate(model: &Model, data: &mut Data) {
    let mut force = std::mem::take(&mut data.qfrc_gravcomp);
    force.fill(0.0);
    for &b in &data.plan.gravcomp {
        let lift = -model.bodies[b].gravcomp * model.bodies[b].mass * model.opt.gravity;
        let com = super::xipos(model, data, b);
        super::each_column(model, data, b, &com, |d, column| force[d] += lin(&column).dot(&lift));
    }
    for (d, f) in force.iter().enumerate() {
        if !model.joints[model.dofs[d].joint].actgravcomp {
            data.qfrc_passive[d] += f;
        }
    }
    data.qfrc_gravcomp = force;
}

/// How far a joint's spring is from rest (m, rad), and how many numbers that is.
pub fn stretch(model: &Model, joint: &Joint, qpos: &[f64]) -> ([f64; 6], usize) {
    let q = &qpos[joint.qposadr..];
    let rest = &model.qpos0[joint.qposadr..];
    match joint.kind {
        JointKind::Slide | JointKind::Hinge => ([q[0] - joint.springref, 0.0, 0.0, 0.0, 0.0, 0.0], 1),
        JointKind::Ball => {
            let r = between(&quat(&rest[..4]), &quat(&q[..4]));
            ([r.x, r.y, r.z, 0.0, 0.0, 0.0], 3)
        }
        JointKind::Free => {
            let p = vec3(q) - vec3(rest);
            let r = between(&quat(&rest[3..7]), &quat(&q[3..7]));
            ([p.x, p.y, p.z, r.x, r.y, r.z], 6)
        }
    }
}
