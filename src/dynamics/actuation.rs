//! Forces from outside: actuators, and wrenches on bodies.
//!
//! Source: MuJoCo 4.0 manual, Computation › Actuation model; XML reference › actuator.

use super::links::NONE;
use super::passive::between;
use super::spatial::{ang, join, lin};
use crate::data::Data;
use crate::math::{Quat, Vec6, quat};
use crate::model::{Actuator, JointKind, Model};
use crate::state::State;

/// Actuator forces.
///
///     f = gain·ctrl + bias₀ + bias₁·length + bias₂·velocity,   clamped to forcerange
///     qfrc = gear·f,   length = gear·q,   velocity = gear·q̇
///
/// q of a ball joint is its rotation vector; a free joint has length 0. ctrl is clamped to ctrlrange first.
/// Reads: ctrl, qpos, qvel. Writes: actuator_force (one each), qfrc_actuator (nv).
pub fn actuate(model: &Model, state: &State, data: &mut Data) {
    if model.actuators.is_empty() || !model.opt.flags.actuation {
        return;
    }
    data.qfrc_actuator.fill(0.0);
    for (i, actuator) in model.actuators.iter().enumerate() {
        let joint = &model.joints[actuator.joint];
        let gear = gear(model, actuator);
        let mut ctrl = state.ctrl[i];
        if let (Some([low, high]), true) = (actuator.ctrlrange, model.opt.flags.clampctrl) {
            ctrl = ctrl.max(low).min(high);
        }
        let [constant, length_gain, velocity_gain] = actuator.bias;
        if joint.kind == JointKind::Ball && actuator.gain == -length_gain {
            ctrl = nearest(ctrl, length(model, actuator, &state.qpos), gear);
        }
        let mut force = actuator.gain * ctrl + constant;
        if velocity_gain != 0.0 {
            force += velocity_gain * velocity(model, actuator, &state.qvel);
        }
        if length_gain != 0.0 {
            force += length_gain * length(model, actuator, &state.qpos);
        }
        if let Some([low, high]) = actuator.forcerange {
            force = force.max(low).min(high);
        }
        data.actuator_force[i] = force;
        for (f, g) in data.qfrc_actuator[joint.dofadr..].iter_mut().zip(gear) {
            *f += g * force;
        }
    }
}

/// The setpoint of a position servo that turns a ball joint, on the circle: of all that differ by full turns the one
/// nearest to the length.
fn nearest(setpoint: f64, length: f64, gear: &[f64]) -> f64 {
    let turn = std::f64::consts::TAU * gear.iter().map(|g| g * g).sum::<f64>().sqrt();
    if turn > 0.0 { setpoint + turn * ((length - setpoint) / turn).round() } else { setpoint }
}

/// The gear numbers that count: one for each dof of the joint.
pub fn gear<'a>(model: &Model, actuator: &'a Actuator) -> &'a [f64] {
    &actuator.gear[..model.joints[actuator.joint].kind.nv()]
}

/// gear·q̇, with ω in body axes.
pub fn velocity(model: &Model, actuator: &Actuator, qvel: &[f64]) -> f64 {
    let first = model.joints[actuator.joint].dofadr;
    gear(model, actuator).iter().zip(&qvel[first..]).map(|(g, v)| g * v).sum()
}

/// gear·q; q of a ball joint is its rotation vector, a free joint has length 0.
pub fn length(model: &Model, actuator: &Actuator, qpos: &[f64]) -> f64 {
    let joint = &model.joints[actuator.joint];
    let q = &qpos[joint.qposadr..];
    match joint.kind {
        JointKind::Slide | JointKind::Hinge => actuator.gear[0] * q[0],
        JointKind::Ball => {
            let r = between(&Quat::identity(), &quat(&q[..4]));
            actuator.gear[0] * r.x + actuator.gear[1] * r.y + actuator.gear[2] * r.z
        }
        JointKind::Free => 0.0,
    }
}

/// The derivative of an actuator's force by its velocity: zero where the force is clamped.
pub fn velocity_gain(actuator: &Actuator, force: f64) -> f64 {
    match actuator.forcerange {
        Some([low, high]) if force <= low || force >= high => 0.0,
        _ => actuator.bias[2],
    }
}

/// Adds the generalized force of a wrench on a body of a tree that is not a free body.
///
///     qfrc_j += S_j · F   for every dof j that moves the body
///
/// In: force (N) and torque (N m) at the body's centre of mass, world axes. Writes: qfrc_smooth.
pub fn apply(model: &Model, body: usize, wrench: &Vec6, data: &mut Data) {
    let Some(t) = model.bodies[body].tree else { return };
    let arm = super::xipos(model, data, body) - data.xpos[model.trees[t].bodies.start];
    let force = lin(wrench);
    let about = join(&force, &(ang(wrench) + arm.cross(&force)));
    let mut d = super::last_dof(model, body);
    while d != NONE {
        data.qfrc_smooth[d] += data.cdof[d].dot(&about);
        d = data.plan.dof_parent[d];
    }
}
