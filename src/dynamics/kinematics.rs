//! Positions: where bodies, joints and geoms are in the world. Source: MuJoCo 4.0 manual, Computation › Kinematics.

use super::plan::Posed;
use super::spatial::join;
use crate::data::Data;
use crate::math::{Mat3, Vec3, Vec6, exp, mat, quat, vec3};
use crate::model::{JointKind, Model, Tree};

/// Poses of a tree that is not one free body, and the axes of its dofs.
///
/// From the parent's pose each joint in turn moves the body: a slide along its axis, a hinge or ball by a
/// rotation that leaves the joint's anchor where it is; q is measured from `qpos0`.
///
/// Reads: qpos. Writes: xpos, xquat, xmat, xanchor, xaxis of the tree; cdof; com of its movers.
pub fn articulated(model: &Model, tree: &Tree, qpos: &[f64], data: &mut Data) {
    for b in tree.bodies.clone() {
        if !tree.rotates {
            sliding_body(model, b, qpos, data);
        } else if model.bodies[b].joints.is_empty() {
            weld(model, b, data);
        } else {
            body(model, b, qpos, data);
        }
    }
    if tree.rotates {
        axes(model, tree, data);
    }
}

/// A body that is fixed to its parent.
pub fn weld(model: &Model, b: usize, data: &mut Data) {
    let body = &model.bodies[b];
    data.xpos[b] = data.xpos[body.parent] + data.xmat[body.parent] * body.pos;
    data.xquat[b] = data.xquat[body.parent] * body.quat;
    data.xmat[b] = mat(&data.xquat[b]);
}

/// A body with joints.
fn body(model: &Model, b: usize, qpos: &[f64], data: &mut Data) {
    let body = &model.bodies[b];
    let mut pos = data.xpos[body.parent] + data.xmat[body.parent] * body.pos;
    let mut rot = data.xquat[body.parent] * body.quat;
    for j in body.joints.clone() {
        let joint = &model.joints[j];
        let q = &qpos[joint.qposadr..];
        if joint.kind == JointKind::Free {
            pos = vec3(q);
            rot = quat(&q[3..7]);
            data.xanchor[j] = pos;
            data.xaxis[j] = joint.axis;
            continue;
        }
        let anchor = pos + rot * joint.pos;
        let axis = rot * joint.axis;
        data.xanchor[j] = anchor;
        data.xaxis[j] = axis;
        match joint.kind {
            JointKind::Slide => pos += axis * (q[0] - model.qpos0[joint.qposadr]),
            JointKind::Hinge => rot *= exp(&(joint.axis * (q[0] - model.qpos0[joint.qposadr]))),
            JointKind::Ball | JointKind::Free => rot *= quat(&q[0..4]),
        }
        if joint.kind != JointKind::Slide {
            pos = anchor - rot * joint.pos;
        }
    }
    data.xpos[b] = pos;
    data.xquat[b] = quat(&[rot.w, rot.i, rot.j, rot.k]);
    data.xmat[b] = mat(&data.xquat[b]);
    data.movers[b].com = pos + data.xmat[b] * body.ipos;
}

/// A body of a tree that only slides: its axes are those it had when the [`Data`] was made.
fn sliding_body(model: &Model, b: usize, qpos: &[f64], data: &mut Data) {
    let body = &model.bodies[b];
    let mut pos = data.xpos[body.parent] + data.xmat[body.parent] * body.pos;
    for j in body.joints.clone() {
        let joint = &model.joints[j];
        data.xanchor[j] = pos + data.xmat[b] * joint.pos;
        pos += data.xaxis[j] * (qpos[joint.qposadr] - model.qpos0[joint.qposadr]);
    }
    data.xpos[b] = pos;
    data.movers[b].com = pos + data.xmat[b] * body.ipos;
}

/// What each dof of a tree moves: a twist about the origin of the tree's first body.
///
///     slide [a, 0],   rotation about a through p: [(p − o) × a, a]
///
/// Free joint: three world axes, then the body's axes through its origin; ball: the body's axes.
/// Reads: poses. Writes: cdof (nv).
fn axes(model: &Model, tree: &Tree, data: &mut Data) {
    let origin = data.xpos[tree.bodies.start];
    for j in super::joints_of(model, tree) {
        let joint = &model.joints[j];
        let arm = data.xanchor[j] - origin;
        let dof = joint.dofadr;
        match joint.kind {
            JointKind::Slide => data.cdof[dof] = join(&data.xaxis[j], &Vec3::zeros()),
            JointKind::Hinge => data.cdof[dof] = join(&arm.cross(&data.xaxis[j]), &data.xaxis[j]),
            JointKind::Ball | JointKind::Free => {
                let rotation = dof + joint.kind.nv() - 3;
                for i in 0..3 {
                    let axis = data.xmat[joint.body].column(i).into_owned();
                    data.cdof[rotation + i] = join(&arm.cross(&axis), &axis);
                }
                if joint.kind == JointKind::Free {
                    for i in 0..3 {
                        data.cdof[dof + i] = Vec6::ith(i, 1.0);
                    }
                }
            }
        }
    }
}

/// Orientations, joint axes and `cdof` of a tree that only slides: none of them ever changes.
pub fn sliding_axes(model: &Model, tree: &Tree, data: &mut Data) {
    for b in tree.bodies.clone() {
        weld(model, b, data);
        for j in model.bodies[b].joints.clone() {
            data.xaxis[j] = data.xmat[b] * model.joints[j].axis;
        }
    }
    axes(model, tree, data);
}

/// Poses of geoms from those of their bodies.
pub fn geoms(posed: &[Posed], xpos: &[Vec3], xmat: &[Mat3], geom_xpos: &mut [Vec3], geom_xmat: &mut [Mat3]) {
    for g in posed {
        (geom_xpos[g.geom], geom_xmat[g.geom]) = if g.aligned {
            (xpos[g.body], xmat[g.body])
        } else {
            (xpos[g.body] + xmat[g.body] * g.pos, xmat[g.body] * g.mat)
        };
    }
}
