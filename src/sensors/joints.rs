//! Joints, tendons, their limits, and actuators.

use crate::contact::ties;
use crate::data::{Data, JointRowKind, Tie, TieKind};
use crate::dynamics::actuation;
use crate::kind::SensorKind;
use crate::math::{quat, wxyz};
use crate::model::{Actuator, Model, Transmission};
use crate::state::State;

/// Position (m, rad), velocity, force of all actuators (N, N m); of a ball joint its unit quaternion and its angular
/// velocity in the body's axes.
pub fn joint(model: &Model, state: &State, data: &Data, kind: SensorKind, joint: usize, out: &mut [f64]) {
    let joint = &model.joints[joint];
    let (q, v) = (&state.qpos[joint.qposadr..], &state.qvel[joint.dofadr..]);
    match kind {
        SensorKind::JointPos => out[0] = q[0],
        SensorKind::JointVel => out[0] = v[0],
        SensorKind::JointActuatorForce => out[0] = data.qfrc_actuator[joint.dofadr],
        SensorKind::BallQuat => out.copy_from_slice(&wxyz(&quat(&q[..4]))),
        _ => out.copy_from_slice(&v[..3]),
    }
}

/// The limit of a joint that is near: distance less margin (m, rad), its rate, the force of the limit (N, N m). Zero
/// where none is.
pub fn limit(state: &State, data: &Data, kind: SensorKind, joint: usize) -> f64 {
    let near = |row: &&crate::data::JointRow| row.joint == joint && row.kind != JointRowKind::DryFriction;
    let Some(row) = data.joint_rows.iter().find(near) else { return 0.0 };
    match kind {
        SensorKind::JointLimitPos => row.violation,
        SensorKind::JointLimitVel => row.entries[..row.n].iter().zip(&state.qvel[row.dof..]).map(|(j, v)| j * v).sum(),
        _ => row.force,
    }
}

/// Length, its rate, and the force of all actuators on a tendon.
pub fn tendon(model: &Model, data: &Data, kind: SensorKind, tendon: usize) -> f64 {
    let pulls = |a: &Actuator| a.transmission == Transmission::Tendon(tendon);
    match kind {
        SensorKind::TendonPos => data.ten_length[tendon],
        SensorKind::TendonVel => data.ten_velocity[tendon],
        _ => model.actuators.iter().zip(&data.actuator_force).filter(|(a, _)| pulls(a)).map(|(_, f)| f).sum(),
    }
}

/// The limit of a tendon that is near, as [`limit`].
pub fn tendon_limit(state: &State, data: &Data, kind: SensorKind, tendon: usize) -> f64 {
    let limit = |tie: &&Tie| tie.index == tendon && matches!(tie.kind, TieKind::LowerLimit | TieKind::UpperLimit);
    let Some(tie) = data.ties.iter().find(limit) else { return 0.0 };
    match kind {
        SensorKind::TendonLimitPos => tie.violation[0],
        SensorKind::TendonLimitVel => ties::velocity(data, tie, &state.qvel)[0],
        _ => tie.force[0],
    }
}

/// Length and velocity of the transmission, and the force before the gear.
pub fn actuator(model: &Model, state: &State, data: &Data, kind: SensorKind, actuator: usize) -> f64 {
    match kind {
        SensorKind::ActuatorPos => actuation::length(model, state, data, actuator),
        SensorKind::ActuatorVel => actuation::velocity(model, state, data, actuator),
        _ => data.actuator_force[actuator],
    }
}
