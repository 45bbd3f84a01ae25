//! A rigid body on a free joint: everything in closed form, no inertia matrix.
//!
//! R body to world, c centre of mass and P principal axes in the body's frame, ω angular velocity and α angular
//! acceleration, m mass, I principal moments. `qvel` holds the velocity of the body's origin (world axes) and ω
//! (body axes); so does `qacc`, with the time derivatives of these numbers.

use super::kinematics::weld;
use super::spatial::{ang, join, lin};
use crate::data::Data;
use crate::math::{Mat3, Vec3, Vec6, mat, quat, vec3};
use crate::model::{FreeBody, Model, Tree};
use crate::state::State;

/// What never changes: the inverse inertia of the body as a mover.
pub fn prepare(free: &FreeBody) -> Vec6 {
    join(&Vec3::from_element(1.0 / free.mass), &free.inertia.map(|i| 1.0 / i))
}

/// Pose of the body and of what is welded to it.
///
/// Reads: qpos. Writes: xpos, xquat, xmat of the tree; com and axes of its mover.
pub fn place(model: &Model, t: usize, free: &FreeBody, qpos: &[f64], data: &mut Data) {
    let tree = &model.trees[t];
    let root = tree.bodies.start;
    let q = &qpos[tree.qpos.start..tree.qpos.start + 7];
    let (pos, rot) = (vec3(q), quat(&q[3..7]));
    let axes = mat(&rot);
    data.xpos[root] = pos;
    data.xquat[root] = rot;
    data.xmat[root] = axes;
    let mover = &mut data.movers[root];
    if data.plan.aligned[t] {
        mover.com = pos;
        mover.axes = axes;
    } else {
        mover.com = pos + axes * free.com;
        mover.axes = axes * free.axes;
    }
    for b in root + 1..tree.bodies.end {
        weld(model, b, data);
    }
}

/// Twist of the mover: velocity of the centre of mass, angular velocity in principal axes.
///
///     v_c = v + R (ω × c),   ω_p = Pᵀ ω
pub fn velocity(free: &FreeBody, qvel: &[f64], xmat: &Mat3) -> Vec6 {
    let w = vec3(&qvel[3..]);
    join(&(vec3(qvel) + xmat * w.cross(&free.com)), &free.axes.tr_mul(&w))
}

/// Velocity, and acceleration without contact: Newton and Euler.
///
///     a_c = g + F/m,    I α_p = τ_p − ω_p × I ω_p
///     Mover.acc = [a_c − R (ω × (ω × c)), α_p]          (J(com)·qacc: without the J̇·qvel term)
///
/// In:     `wrench`: force (N, world axes) and torque about the centre of mass (N m, principal axes).
/// Reads:  qvel. Writes: vel and acc of the mover, qacc_smooth, qacc.
pub fn accelerate(
    model: &Model,
    t: usize,
    free: &FreeBody,
    gravity: &Vec3,
    wrench: Option<Vec6>,
    qvel: &[f64],
    data: &mut Data,
) {
    let tree = &model.trees[t];
    let aligned = data.plan.aligned[t];
    let qvel = &qvel[tree.dofs.start..tree.dofs.start + 6];
    let xmat = &data.xmat[tree.bodies.start];
    let mover = &mut data.movers[tree.bodies.start];
    mover.vel = if aligned { Vec6::from_column_slice(qvel) } else { velocity(free, qvel, xmat) };
    let wp = ang(&mover.vel);
    let mut torque = free.inertia.component_mul(&wp).cross(&wp);
    let mut acc = *gravity;
    if let Some(wrench) = wrench {
        acc += lin(&wrench) / free.mass;
        torque += ang(&wrench);
    }
    let alpha = ang(&mover.minv).component_mul(&torque);
    let qacc = if aligned {
        mover.acc = join(&acc, &alpha);
        mover.acc
    } else {
        let w = vec3(&qvel[3..]);
        mover.acc = join(&(acc - xmat * w.cross(&w.cross(&free.com))), &alpha);
        generalized(free, xmat, &mover.acc)
    };
    let dofs = tree.dofs.start..tree.dofs.start + 6;
    data.qacc_smooth[dofs.clone()].copy_from_slice(qacc.as_slice());
    data.qacc[dofs].copy_from_slice(qacc.as_slice());
}

/// Acceleration (or impulse response) of the free joint from that of its mover.
///
///     α = P α_p,   a = a_c − R (α × c)
pub fn generalized(free: &FreeBody, xmat: &Mat3, acc: &Vec6) -> Vec6 {
    let alpha = free.axes * ang(acc);
    join(&(lin(acc) - xmat * alpha.cross(&free.com)), &alpha)
}

/// Everything that pushes the body but gravity: actuators and forces on its joint, wrenches on it and on what is welded
/// to it.
///
/// Out: force (N, world axes) and torque about the centre of mass (N m, principal axes).
pub fn wrench(model: &Model, tree: &Tree, free: &FreeBody, state: &State, data: &Data) -> Vec6 {
    let root = tree.bodies.start;
    let arm = data.xmat[root] * free.com;
    // Generalized forces of the joint: force at the origin (world axes), torque (body axes).
    let mut q = Vec6::from_column_slice(&data.qfrc_actuator[tree.dofs.clone()]);
    if !state.qfrc_applied.is_empty() {
        q += Vec6::from_column_slice(&state.qfrc_applied[tree.dofs.clone()]);
    }
    let mut force = lin(&q);
    let mut torque = data.xmat[root] * ang(&q) - arm.cross(&force);
    for b in tree.bodies.clone().take(state.xfrc_applied.len().saturating_sub(root)) {
        let applied = &state.xfrc_applied[b];
        let offset = super::xipos(model, data, b) - data.movers[root].com;
        force += lin(applied);
        torque += ang(applied) + offset.cross(&lin(applied));
    }
    join(&force, &data.movers[root].axes.tr_mul(&torque))
}
