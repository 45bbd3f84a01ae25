//! Forces from outside: actuators, and wrenches on bodies.
//!
//! Source: MuJoCo 4.0 manual, Computation › Actuation model; XML reference › actuator; checked by running MuJoCo 4.0.0.

use std::f64::consts::TAU;

use super::links::NONE;
use super::spatial::{ang, join, lin};
use super::tendon;
use crate::data::Data;
use crate::math::{MIN_VAL, Quat, Vec3, Vec6, between, mat, quat, vec3};
use crate::model::{Activation, Actuator, JointKind, Model, Transmission};
use crate::state::State;

/// Actuator forces.
///
///     f = gain · u + bias,   gain, bias = c₀ + c₁ length + c₂ velocity,   bounded by a tendon's actuatorfrcrange,
///                                                                         then clamped to forcerange
///     qfrc = Σ f ∂length/∂q,   clamped to a joint's actuatorfrcrange
///
/// u is ctrl, clamped to ctrlrange, or of an actuator with dynamics its activation.
/// Reads: ctrl, act, qpos, qvel, poses. Writes: act_dot (na), actuator_input and actuator_force (one each),
/// qfrc_actuator (nv).
pub fn actuate(model: &Model, state: &State, data: &mut Data) {
    if model.actuators.is_empty() || !model.opt.flags.actuation {
        return;
    }
    rates(model, state, data);
    data.qfrc_actuator.fill(0.0);
    for (i, actuator) in model.actuators.iter().enumerate() {
        transmit(model, state, i, data);
        let (gain, bias) = (actuator.gain, actuator.bias);
        let rotary = rotary(model, actuator);
        let servo = rotary.is_some() && [gain[0], gain[1], gain[2]] == [-bias[1], 0.0, 0.0];
        let length = if servo || gain[1] != 0.0 || bias[1] != 0.0 { length(model, state, data, i) } else { 0.0 };
        let velocity = if gain[2] != 0.0 || bias[2] != 0.0 { velocity(model, state, data, i) } else { 0.0 };
        let mut input = match actuator.act {
            None => control(model, state, i),
            Some(act) if actuator.actearly => next(actuator, state.act[act], data.act_dot[act], data.timestep),
            Some(act) => state.act[act],
        };
        if let (true, Some(turn)) = (servo, rotary) {
            input = nearest(input, length, turn);
        }
        let affine = |c: [f64; 3]| c[0] + c[1] * length + c[2] * velocity;
        data.actuator_input[i] = input;
        data.actuator_force[i] = affine(gain) * input + affine(bias);
    }
    bound_tendons(model, data);
    for (i, actuator) in model.actuators.iter().enumerate() {
        let Data { plan, moments, qfrc_actuator, actuator_force, .. } = data;
        if let Some([low, high]) = actuator.forcerange {
            actuator_force[i] = actuator_force[i].clamp(low, high);
        }
        let force = actuator_force[i];
        match plan.moments[i] {
            None => {
                let (first, gear) = joint_gear(model, actuator);
                for (f, g) in qfrc_actuator[first..].iter_mut().zip(gear) {
                    *f += g * force;
                }
            }
            Some(at) => {
                for (f, g) in qfrc_actuator.iter_mut().zip(&moments[at..at + model.nv]) {
                    *f += g * force;
                }
            }
        }
    }
    compensate(data);
    let Data { plan, qfrc_actuator, .. } = data;
    for &(dof, [low, high]) in &plan.force_ranges {
        qfrc_actuator[dof] = qfrc_actuator[dof].clamp(low, high);
    }
}

/// Scales the forces of actuators on one tendon so that their sum is within its `actuatorfrcrange`.
fn bound_tendons(model: &Model, data: &mut Data) {
    let Data { plan, actuator_force, ten_bounded, .. } = data;
    for &(tendon, [low, high]) in &plan.tendon_ranges {
        let acts = |actuator: &Actuator| actuator.transmission == Transmission::Tendon(tendon);
        let pulls = || model.actuators.iter().zip(0..).filter(|(a, _)| acts(a)).map(|(_, i): (_, usize)| i);
        let sum: f64 = pulls().map(|i| actuator_force[i]).sum();
        let bounded = sum.clamp(low, high);
        ten_bounded[tendon] = sum <= low || sum >= high;
        if bounded != sum {
            pulls().for_each(|i| actuator_force[i] *= bounded / sum);
        }
    }
}

/// Joints whose actuators bear the compensation of gravity.
fn compensate(data: &mut Data) {
    let Data { plan, qfrc_actuator, qfrc_gravcomp, .. } = data;
    for &d in &plan.borne {
        qfrc_actuator[d] += qfrc_gravcomp[d];
    }
}

/// A control, clamped to its range; NaN stays NaN, so that the step fails.
fn control(model: &Model, state: &State, i: usize) -> f64 {
    match (model.actuators[i].ctrlrange, model.opt.flags.clampctrl) {
        (Some([low, high]), true) => state.ctrl[i].clamp(low, high),
        _ => state.ctrl[i],
    }
}

/// How activations change.
///
///     integrator ȧ = u,   filter ȧ = (u − a)/τ
///
/// Reads: ctrl, act. Writes: act_dot.
pub fn rates(model: &Model, state: &State, data: &mut Data) {
    if !model.opt.flags.actuation {
        return;
    }
    for (i, actuator) in model.actuators.iter().enumerate() {
        if let Some(act) = actuator.act {
            let u = control(model, state, i);
            data.act_dot[act] = match actuator.activation {
                Activation::None => 0.0,
                Activation::Integrator => u,
                Activation::Filter(tau) | Activation::ExactFilter(tau) => (u - state.act[act]) / tau.max(MIN_VAL),
            };
        }
    }
}

/// Moves the activations along their rates for a time h. Where actuation is disabled they stay what they are, even beyond
/// their range.
pub fn advance(model: &Model, act_dot: &[f64], h: f64, act: &mut [f64]) {
    if act.is_empty() || !model.opt.flags.actuation {
        return;
    }
    for actuator in &model.actuators {
        if let Some(i) = actuator.act {
            act[i] = next(actuator, act[i], act_dot[i], h);
        }
    }
}

/// The activation after a time h.
///
///     a + h ȧ,   of an exact filter a + ȧ τ (1 − exp(−h/τ)),   clamped to actrange
fn next(actuator: &Actuator, act: f64, rate: f64, h: f64) -> f64 {
    let next = match actuator.activation {
        Activation::ExactFilter(tau) => {
            let tau = tau.max(MIN_VAL);
            act + rate * tau * (1.0 - (-h / tau).exp())
        }
        _ => act + h * rate,
    };
    match actuator.actrange {
        Some([low, high]) => next.clamp(low, high),
        None => next,
    }
}

/// What a full turn changes of the length of an actuator that turns something in all three directions.
fn rotary(model: &Model, actuator: &Actuator) -> Option<f64> {
    let axis = match actuator.transmission {
        Transmission::Joint(j) | Transmission::JointInParent(j) if model.joints[j].kind == JointKind::Ball => {
            vec3(&actuator.gear)
        }
        Transmission::Site { reference: Some(_), .. } if actuator.gear[..3] == [0.0; 3] => vec3(&actuator.gear[3..]),
        _ => return None,
    };
    Some(TAU * axis.norm()).filter(|turn| *turn > 0.0)
}

/// The setpoint of a position servo on the circle: of all that differ by full turns the one nearest to the length.
fn nearest(setpoint: f64, length: f64, turn: f64) -> f64 {
    setpoint + turn * ((length - setpoint) / turn).round()
}

/// First dof and gear of an actuator that acts on the axes of a joint: a number for each dof.
pub fn joint_gear<'a>(model: &Model, actuator: &'a Actuator) -> (usize, &'a [f64]) {
    match actuator.transmission {
        Transmission::Joint(j) | Transmission::JointInParent(j) => {
            (model.joints[j].dofadr, &actuator.gear[..model.joints[j].kind.nv()])
        }
        Transmission::Site { .. } | Transmission::Tendon(_) | Transmission::SliderCrank { .. } => (0, &[]),
    }
}

/// The row ∂length/∂q of an actuator that does not act on the axes of a joint.
///
///     site:           Jᵀ [R g_lin, R g_ang],   R of the site, J its Jacobian
///     with refsite:   (J − J_ref)ᵀ [R g_lin, R g_ang],   R of the reference; without dofs that move both
///     jointinparent:  [g_lin, R⁻¹ g_ang],   R the rotation of the joint
///     tendon:         gear J
///     slider-crank:   gear (a·J_v (1 − a·v/s) + v·J_v/s + v·J_a (1 − a·v/s)),   see [`length`]
///
/// Reads: poses, cdof, tendons. Writes: moments.
fn transmit(model: &Model, state: &State, i: usize, data: &mut Data) {
    let (Some(at), actuator) = (data.plan.moments[i], &model.actuators[i]) else { return };
    let mut moments = std::mem::take(&mut data.moments);
    let row = &mut moments[at..at + model.nv];
    row.fill(0.0);
    match actuator.transmission {
        Transmission::Joint(_) => {}
        Transmission::JointInParent(j) => {
            let joint = &model.joints[j];
            let n = joint.kind.nv();
            let row = &mut row[joint.dofadr..joint.dofadr + n];
            row.copy_from_slice(&actuator.gear[..n]);
            if n >= 3 {
                let q = joint.qposadr + joint.kind.nq() - 4;
                let turned = quat(&state.qpos[q..q + 4]).inverse() * vec3(&actuator.gear[n - 3..]);
                row[n - 3..].copy_from_slice(turned.as_slice());
            }
        }
        Transmission::Site { site, reference } => {
            let frame = reference.unwrap_or(site);
            let axes = data.xmat[model.sites[frame].body] * mat(&model.sites[frame].quat);
            let wrench = join(&(axes * vec3(&actuator.gear)), &(axes * vec3(&actuator.gear[3..])));
            add_site(model, data, site, &wrench, 1.0, row);
            if let Some(reference) = reference {
                add_site(model, data, reference, &wrench, -1.0, row);
                let [a, b] = [site, reference].map(|s| super::last_dof(model, model.sites[s].body));
                clear_common(&data.plan.dof_parent, a, b, row);
            }
        }
        Transmission::Tendon(t) => tendon::push(&data.plan.tendons[t], &data.ten_j, actuator.gear[0], row),
        Transmission::SliderCrank { crank, slider, rod } => {
            let Crank { axis, arm, way, root, .. } = Crank::new(model, data, crank, slider, rod);
            let share = if root > 0.0 { 1.0 - way / root } else { 1.0 };
            let by_arm = if root > 0.0 { axis * share + arm / root } else { axis };
            let by_axis = arm * share;
            let gear = actuator.gear[0];
            let [(at_crank, crank), (at_slider, slider)] = [crank, slider].map(|s| {
                let site = &model.sites[s];
                (site.body, data.xpos[site.body] + data.xmat[site.body] * site.pos)
            });
            super::each_column(model, data, at_crank, &crank, |d, column| row[d] += gear * lin(&column).dot(&by_arm));
            super::each_column(model, data, at_slider, &slider, |d, column| {
                row[d] += gear * (ang(&column).cross(&axis).dot(&by_axis) - lin(&column).dot(&by_arm));
            });
        }
    }
    data.moments = moments;
}

/// Where a slider-crank is: a axis of the slider, v from the slider's site to the crank's, s root of (a·v)² + rod² − v·v; 0
/// where the rod is too short.
struct Crank {
    axis: Vec3,
    arm: Vec3,
    /// a·v
    way: f64,
    /// s
    root: f64,
}

impl Crank {
    fn new(model: &Model, data: &Data, crank: usize, slider: usize, rod: f64) -> Crank {
        let place = |s: usize| data.xpos[model.sites[s].body] + data.xmat[model.sites[s].body] * model.sites[s].pos;
        let arm = place(crank) - place(slider);
        let axis = data.xmat[model.sites[slider].body] * (model.sites[slider].quat * Vec3::z());
        let way = axis.dot(&arm);
        let root = (way * way + rod * rod - arm.norm_squared()).max(0.0).sqrt();
        Crank { axis, arm, way, root }
    }
}

/// row += sign Jᵀ wrench, J of the site's origin.
fn add_site(model: &Model, data: &Data, site: usize, wrench: &Vec6, sign: f64, row: &mut [f64]) {
    let site = &model.sites[site];
    let point = data.xpos[site.body] + data.xmat[site.body] * site.pos;
    super::each_column(model, data, site.body, &point, |d, column| row[d] += sign * column.dot(wrench));
}

/// The row ∂length/∂q of an actuator (nv). Not for a step. Reads: poses.
pub fn moment(model: &Model, state: &State, data: &mut Data, i: usize) -> Vec<f64> {
    transmit(model, state, i, data);
    let mut row = vec![0.0; model.nv];
    match data.plan.moments[i] {
        Some(at) => row.copy_from_slice(&data.moments[at..at + model.nv]),
        None => {
            let (first, gear) = joint_gear(model, &model.actuators[i]);
            row[first..first + gear.len()].copy_from_slice(gear);
        }
    }
    row
}

/// Zeros where a dof moves what both `a` and `b` move.
fn clear_common(dof_parent: &[usize], a: usize, b: usize, row: &mut [f64]) {
    let way = |mut d: usize| {
        std::iter::from_fn(move || {
            let here = (d != NONE).then_some(d)?;
            d = dof_parent[d];
            Some(here)
        })
    };
    for d in way(a).filter(|d| way(b).any(|other| other == *d)) {
        row[d] = 0.0;
    }
}

/// ∂length/∂q · q̇; 0 where actuation is disabled, as in MuJoCo.
pub fn velocity(model: &Model, state: &State, data: &Data, i: usize) -> f64 {
    if !model.opt.flags.actuation {
        return 0.0;
    }
    let product = |row: &[f64], v: &[f64]| row.iter().zip(v).map(|(g, v)| g * v).sum();
    match data.plan.moments[i] {
        Some(at) => product(&data.moments[at..at + model.nv], &state.qvel),
        None => {
            let (first, gear) = joint_gear(model, &model.actuators[i]);
            product(gear, &state.qvel[first..])
        }
    }
}

/// The length of an actuator's transmission, m or rad times gear.
///
///     slide, hinge  gear q,   ball  gear · rotation vector,   free joint, site  0
///     site with refsite  g_lin · R_refᵀ (x − x_ref) + g_ang · rotation vector from the reference to the site
///     tendon        gear L
///     slider-crank  gear (a·v − √((a·v)² + rod² − v·v))      a axis of the slider, v from the slider to the crank
pub fn length(model: &Model, state: &State, data: &Data, i: usize) -> f64 {
    let actuator = &model.actuators[i];
    let gear = &actuator.gear;
    match actuator.transmission {
        Transmission::Joint(j) | Transmission::JointInParent(j) => {
            let joint = &model.joints[j];
            let q = &state.qpos[joint.qposadr..];
            match joint.kind {
                JointKind::Slide | JointKind::Hinge => gear[0] * q[0],
                JointKind::Ball => vec3(gear).dot(&between(&Quat::identity(), &quat(&q[..4]))),
                JointKind::Free => 0.0,
            }
        }
        Transmission::Site { reference: None, .. } => 0.0,
        Transmission::Tendon(t) => gear[0] * data.ten_length[t],
        Transmission::SliderCrank { crank, slider, rod } => {
            let crank = Crank::new(model, data, crank, slider, rod);
            gear[0] * (crank.way - crank.root)
        }
        Transmission::Site { site, reference: Some(reference) } => {
            let [(x, q), (x_ref, q_ref)] = [site, reference].map(|s| {
                let site = &model.sites[s];
                (data.xpos[site.body] + data.xmat[site.body] * site.pos, data.xquat[site.body] * site.quat)
            });
            vec3(gear).dot(&(q_ref.inverse() * (x - x_ref))) + vec3(&gear[3..]).dot(&between(&q_ref, &q))
        }
    }
}

/// The derivative of an actuator's force by its velocity: zero where the force, or that of its joint, is clamped.
///
/// Reads: actuator_input, actuator_force, qfrc_actuator, ten_bounded.
pub fn velocity_gain(model: &Model, data: &Data, i: usize) -> f64 {
    let actuator = &model.actuators[i];
    let clamped = |range: Option<[f64; 2]>, force: f64| range.is_some_and(|[low, high]| force <= low || force >= high);
    if clamped(actuator.forcerange, data.actuator_force[i]) {
        return 0.0;
    }
    if let Transmission::Joint(j) | Transmission::JointInParent(j) = actuator.transmission {
        let joint = &model.joints[j];
        if clamped(joint.actfrcrange, data.qfrc_actuator[joint.dofadr]) {
            return 0.0;
        }
    }
    if let Transmission::Tendon(t) = actuator.transmission
        && data.ten_bounded[t]
    {
        return 0.0;
    }
    actuator.bias[2] + actuator.gain[2] * data.actuator_input[i]
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
