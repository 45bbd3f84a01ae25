//! A rigid body on a free joint: everything in closed form, no inertia matrix.
//!
//! R body to world, c centre of mass and P principal axes in the body's frame, ω angular velocity and α angular
//! acceleration, m mass, I principal moments. `qvel` holds the velocity of the body's origin (world axes) and ω
//! (body axes); so does `qacc`, with the time derivatives of these numbers.

use super::kinematics::weld;
use super::spatial::{ang, join, lin};
use crate::data::{Data, Mover};
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
pub fn place(model: &Model, tree: &Tree, free: &FreeBody, qpos: &[f64], data: &mut Data) {
    let root = tree.bodies.start;
    let q = &qpos[tree.qpos.start..tree.qpos.start + 7];
    let (pos, rot) = (vec3(q), quat(&q[3..7]));
    let axes = mat(&rot);
    data.xpos[root] = pos;
    data.xquat[root] = rot;
    data.xmat[root] = axes;
    let mover = &mut data.movers[root];
    mover.com = pos + axes * free.com;
    mover.axes = axes * free.axes;
    for b in root + 1..tree.bodies.end {
        weld(model, b, data);
    }
}

/// Twist of the mover: velocity of the centre of mass, angular velocity in principal axes.
///
///     v_c = v + R (ω × c),   ω_p = Pᵀ ω
pub fn velocity(tree: &Tree, free: &FreeBody, qvel: &[f64], xmat: &Mat3, mover: &mut Mover) {
    let v = &qvel[tree.dofs.start..tree.dofs.start + 6];
    let w = vec3(&v[3..]);
    mover.vel = join(&(vec3(v) + xmat * w.cross(&free.com)), &free.axes.tr_mul(&w));
}

/// Acceleration without contact: Newton and Euler.
///
///     a_c = g + F/m,    I α_p = τ_p − ω_p × I ω_p
///     Mover.acc = [a_c − R (ω × (ω × c)), α_p]          (J(com)·qacc: without the J̇·qvel term)
///
/// In:     `wrench`: force (N, world axes) and torque about the centre of mass (N m, principal axes).
/// Reads:  qvel. Writes: vel and acc of the mover, qacc_smooth.
pub fn accelerate(tree: &Tree, free: &FreeBody, gravity: &Vec3, wrench: Option<Vec6>, qvel: &[f64], data: &mut Data) {
    let root = tree.bodies.start;
    let xmat = &data.xmat[root];
    let mover = &mut data.movers[root];
    velocity(tree, free, qvel, xmat, mover);
    let wp = ang(&mover.vel);
    let mut torque = free.inertia.component_mul(&wp).cross(&wp);
    let mut acc = *gravity;
    if let Some(wrench) = wrench {
        acc += lin(&wrench) / free.mass;
        torque += ang(&wrench);
    }
    let w = vec3(&qvel[tree.dofs.start + 3..tree.dofs.start + 6]);
    acc -= xmat * w.cross(&w.cross(&free.com));
    mover.acc = join(&acc, &ang(&mover.minv).component_mul(&torque));
    let qacc = generalized(free, xmat, &mover.acc);
    data.qacc_smooth[tree.dofs.start..tree.dofs.start + 6].copy_from_slice(qacc.as_slice());
}

/// Acceleration (or impulse response) of the free joint from that of its mover.
///
///     α = P α_p,   a = a_c − R (α × c)
pub fn generalized(free: &FreeBody, xmat: &Mat3, acc: &Vec6) -> Vec6 {
    let alpha = free.axes * ang(acc);
    join(&(lin(acc) - xmat * alpha.cross(&free.com)), &alpha)
}

/// Everything that pushes the body but gravity: actuators on its joint, wrenches on it and on what is welded to it.
///
/// Out: force (N, world axes) and torque about the centre of mass (N m, principal axes).
pub fn wrench(model: &Model, tree: &Tree, free: &FreeBody, state: &State, data: &Data) -> Vec6 {
    let root = tree.bodies.start;
    let arm = data.xmat[root] * free.com;
    // Generalized forces of the joint: force at the origin (world axes), torque (body axes).
    let q = &data.qfrc_actuator[tree.dofs.start..tree.dofs.start + 6];
    let mut force = vec3(q);
    let mut torque = data.xmat[root] * vec3(&q[3..]) - arm.cross(&force);
    for b in tree.bodies.clone().take(state.xfrc_applied.len().saturating_sub(root)) {
        let applied = &state.xfrc_applied[b];
        let offset = super::xipos(model, data, b) - data.movers[root].com;
        force += lin(applied);
        torque += ang(applied) + offset.cross(&lin(applied));
    }
    join(&force, &data.movers[root].axes.tr_mul(&torque))
}
