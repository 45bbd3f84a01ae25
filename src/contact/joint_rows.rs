//! Constraints of joints: dry friction, and limits that are near. One row each, found in every step.

use super::Settings;
use super::impedance::{self, Reference};
use crate::data::{Data, JointRow, JointRowKind};
use crate::math::Vec3;
use crate::model::Model;
use crate::state::State;

/// Finds the rows of dry friction, then those of joint limits, in MuJoCo's order.
///
/// Writes: `data.joint_rows` (all but the forces).
pub fn find(model: &Model, settings: &Settings, state: &State, data: &mut Data) {
    let Data { joint_rows, plan, .. } = data;
    joint_rows.clear();
    for &dof in &plan.dry {
        joint_rows.push(dry_friction(model, settings.timestep, dof));
    }
    for &joint in &plan.limited {
        limits(model, settings.timestep, joint, state, joint_rows);
    }
}

/// The row of a dof with dry friction: J = 1, violation 0.
///
/// Source: MuJoCo 4.0 manual, Computation › Constraint model › Friction loss.
fn dry_friction(model: &Model, timestep: f64, dof: usize) -> JointRow {
    let d = &model.dofs[dof];
    let joint = &model.joints[d.joint];
    let solimp = impedance::clamp(&joint.solimp_friction);
    JointRow {
        kind: JointRowKind::DryFriction,
        joint: d.joint,
        dof,
        n: 1,
        entries: [1.0, 0.0, 0.0],
        violation: 0.0,
        impedance: impedance::impedance(&solimp, 0.0),
        reference: Reference::new(&joint.solref_friction, &solimp, timestep, model.opt.flags.refsafe),
        inverse: d.invweight0,
        loss: d.frictionloss,
        force: 0.0,
    }
}

/// The rows of a joint's limits that are nearer than its margin.
///
///     slide, hinge:  dist = q − lower, J = 1;   dist = upper − q, J = −1
///     ball:          dist = range − |θ|, J = −θ/|θ|      with θ the rotation vector
///
/// Source: MuJoCo 4.0 manual, Computation › Constraint model › Limit.
fn limits(model: &Model, timestep: f64, index: usize, state: &State, rows: &mut Vec<JointRow>) {
    let joint = &model.joints[index];
    let Some(range) = joint.range else { return };
    let mut push = |kind: JointRowKind, dist: f64, entries: [f64; 3]| {
        if dist >= joint.margin {
            return;
        }
        let solimp = impedance::clamp(&joint.solimp_limit);
        rows.push(JointRow {
            kind,
            joint: index,
            dof: joint.dofadr,
            n: joint.kind.nv(),
            entries,
            violation: dist - joint.margin,
            impedance: impedance::impedance(&solimp, dist - joint.margin),
            reference: Reference::new(&joint.solref_limit, &solimp, timestep, model.opt.flags.refsafe),
            inverse: model.dofs[joint.dofadr].invweight0,
            loss: 0.0,
            force: 0.0,
        });
    };
    let q = &state.qpos[joint.qposadr..];
    if joint.kind.nv() == 1 {
        push(JointRowKind::LowerLimit, q[0] - range[0], [1.0, 0.0, 0.0]);
        push(JointRowKind::UpperLimit, range[1] - q[0], [-1.0, 0.0, 0.0]);
    } else {
        let (axis, angle) = axis_angle(&q[..4]);
        push(JointRowKind::UpperLimit, range[0].max(range[1]) - angle, [-axis.x, -axis.y, -axis.z]);
    }
}

/// Unit axis and angle in [0, π] of a quaternion [w, x, y, z]; axis x where there is no rotation.
fn axis_angle(q: &[f64]) -> (Vec3, f64) {
    let v = Vec3::new(q[1], q[2], q[3]);
    let sin = v.norm();
    if sin < crate::math::MIN_VAL {
        return (Vec3::x(), 0.0);
    }
    let angle = 2.0 * sin.atan2(q[0]);
    let axis = v / sin;
    if angle > std::f64::consts::PI { (-axis, std::f64::consts::TAU - angle) } else { (axis, angle) }
}
