//! Velocities of bodies, and the forces that hold them on their way: recursive Newton–Euler.
//!
//! Source: Featherstone, Rigid Body Dynamics Algorithms (2008), ch. 5; MuJoCo 4.0 manual, Computation › Bias force.

use super::spatial::{at, cross_force, cross_motion, join};
use crate::data::Data;
use crate::math::{Vec3, Vec6};
use crate::model::{JointKind, Model, Tree};

/// Twist of every body of a tree, and the velocity of its movers.
///
///     V_b = V_parent + Σ S_j q̇_j
///
/// Reads: cdof, qvel. Writes: cvel (bodies of the tree), vel of the movers.
pub fn velocities(model: &Model, tree: &Tree, qvel: &[f64], data: &mut Data) {
    let origin = data.xpos[tree.bodies.start];
    for b in tree.bodies.clone() {
        let body = &model.bodies[b];
        let mut v = if b == tree.bodies.start { Vec6::zeros() } else { data.cvel[body.parent] };
        for d in body.dofs.clone() {
            v += data.cdof[d] * qvel[d];
        }
        data.cvel[b] = v;
        if body.weld == b {
            data.movers[b].vel = at(&v, &(data.movers[b].com - origin));
        }
    }
}

/// Bias forces of a tree: what the joints must exert so that qacc = 0.
///
///     A_b = A_parent + Σ V × S_j q̇_j,   A_root = −gravity
///     F_b = I_b A_b + V_b ×* I_b V_b + Σ F_child
///     bias_j = S_j · F_b
///
/// V is the twist before the joint's own motion: its axis moves with what comes before it.
/// Reads: cdof, cinert, cvel, qvel. Writes: cacc, cfrc (bodies of the tree), qfrc_bias.
pub fn bias(model: &Model, tree: &Tree, gravity: &Vec3, qvel: &[f64], data: &mut Data) {
    let root = tree.bodies.start;
    for b in tree.bodies.clone() {
        let body = &model.bodies[b];
        let (mut v, mut a) = if b == root {
            (Vec6::zeros(), join(&-gravity, &Vec3::zeros()))
        } else {
            (data.cvel[body.parent], data.cacc[body.parent])
        };
        for joint in &model.joints[body.joints.clone()] {
            let moved: Vec6 = (joint.dofadr..joint.dofadr + joint.kind.nv()).map(|d| data.cdof[d] * qvel[d]).sum();
            // A free joint's translation is along world axes, which nothing carries along.
            let carried = if joint.kind == JointKind::Free {
                let slide =
                    Vec6::new(qvel[joint.dofadr], qvel[joint.dofadr + 1], qvel[joint.dofadr + 2], 0.0, 0.0, 0.0);
                cross_motion(&slide, &moved)
            } else {
                cross_motion(&v, &moved)
            };
            a += carried;
            v += moved;
        }
        data.cacc[b] = a;
        data.cfrc[b] = data.cinert[b].mul(&a) + cross_force(&v, &data.cinert[b].mul(&v));
    }
    for b in tree.bodies.clone().rev() {
        let force = data.cfrc[b];
        for d in model.bodies[b].dofs.clone() {
            data.qfrc_bias[d] = data.cdof[d].dot(&force);
        }
        if b != root {
            data.cfrc[model.bodies[b].parent] += force;
        }
    }
}

/// J(com)·qacc_smooth of the movers of a tree, as [`velocities`] with accelerations in place of velocities.
///
/// Reads: cdof, qacc_smooth. Writes: cacc (bodies of the tree), acc of the movers.
pub fn accelerations(model: &Model, tree: &Tree, data: &mut Data) {
    let origin = data.xpos[tree.bodies.start];
    for b in tree.bodies.clone() {
        let body = &model.bodies[b];
        let mut a = if b == tree.bodies.start { Vec6::zeros() } else { data.cacc[body.parent] };
        for d in body.dofs.clone() {
            a += data.cdof[d] * data.qacc_smooth[d];
        }
        data.cacc[b] = a;
        if body.weld == b {
            data.movers[b].acc = at(&a, &(data.movers[b].com - origin));
        }
    }
}
