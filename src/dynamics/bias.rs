//! Velocities of bodies, and the forces that hold them on their way: recursive Newton–Euler.
//!
//! Source: Featherstone, Rigid Body Dynamics Algorithms (2008), ch. 5; MuJoCo 4.0 manual, Computation › Bias force.

use super::links::NONE;
use super::spatial::{at, cross_force, cross_motion, dot, join};
use crate::data::Data;
use crate::math::{Vec3, Vec6, vec3};
use crate::model::{Joint, JointKind, Model};

/// Twist of every body of a tree, and the velocity of its movers.
///
///     V_b = V_parent + Σ S_j q̇_j
///
/// Reads: cdof, qvel. Writes: cvel (bodies of the tree), vel of the movers.
pub fn velocities(model: &Model, t: usize, qvel: &[f64], data: &mut Data) {
    let Data { plan, xpos, cdof, cvel, movers, .. } = data;
    let origin = xpos[model.trees[t].bodies.start];
    for link in plan.links_of(t) {
        let mut v = if link.parent == NONE { Vec6::zeros() } else { cvel[link.parent] };
        for (s, rate) in cdof[link.dofs.clone()].iter().zip(&qvel[link.dofs.clone()]) {
            v += s * *rate;
        }
        cvel[link.body] = v;
        let mover = &mut movers[link.body];
        mover.vel = at(&v, &(mover.com - origin));
    }
    for &b in plan.welded_in(t) {
        cvel[b] = cvel[model.bodies[b].weld];
    }
}

/// The twist that carries the axes of a joint along: V before the joint's own motion. A free joint's translation is along
/// world axes, which nothing carries along.
///
/// In: V of what comes before the joint, whose first dof has the velocity `qvel[dofadr]`.
#[inline]
pub fn carrier(joint: &Joint, qvel: &[f64], v: &Vec6) -> Vec6 {
    match joint.kind {
        JointKind::Free => join(&vec3(&qvel[joint.dofadr..]), &Vec3::zeros()),
        _ => *v,
    }
}

/// Bias forces of a tree: what the joints must exert so that qacc = 0.
///
///     A_b = A_parent + Σ V × S_j q̇_j,   A_root = −gravity
///     F_b = I_b A_b + V_b ×* I_b V_b + Σ F_child
///     bias_j = S_j · F_b
///
/// V × S_j q̇_j is taken with the [`carrier`] of the joint: its axis moves with what comes before it.
/// Reads: cdof, cinert, qvel. Writes: cvel (bodies of the tree), vel of the movers; cacc, cfrc (bodies with joints), qfrc_bias.
pub fn bias(model: &Model, t: usize, gravity: &Vec3, qvel: &[f64], data: &mut Data) {
    let Data { plan, xpos, movers, cdof, cvel, cacc, cfrc, cinert, qfrc_bias, .. } = data;
    let (links, origin) = (plan.links_of(t), xpos[model.trees[t].bodies.start]);
    for link in links {
        let (mut v, mut a) = match link.parent {
            NONE => (Vec6::zeros(), join(&-gravity, &Vec3::zeros())),
            parent => (cvel[parent], cacc[parent]),
        };
        for joint in &model.joints[link.joints.clone()] {
            let d = joint.dofadr;
            let mut moved = cdof[d] * qvel[d];
            for d in d + 1..d + joint.kind.nv() {
                moved += cdof[d] * qvel[d];
            }
            a += cross_motion(&carrier(joint, qvel, &v), &moved);
            v += moved;
        }
        let inertia = &cinert[link.body];
        cvel[link.body] = v;
        let mover = &mut movers[link.body];
        mover.vel = at(&v, &(mover.com - origin));
        cacc[link.body] = a;
        cfrc[link.body] = inertia.mul(&a) + cross_force(&v, &inertia.mul(&v));
    }
    for link in links.iter().rev() {
        let force = cfrc[link.body];
        for (bias, s) in qfrc_bias[link.dofs.clone()].iter_mut().zip(&cdof[link.dofs.clone()]) {
            *bias = dot(s, &force);
        }
        if link.parent != NONE {
            cfrc[link.parent] += force;
        }
    }
    for &b in plan.welded_in(t) {
        cvel[b] = cvel[model.bodies[b].weld];
    }
}
