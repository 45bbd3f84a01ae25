//! Positions: where bodies, joints and geoms are in the world. Source: MuJoCo 4.0 manual, Computation › Kinematics.

use super::links::Mount;
use super::plan::Posed;
use super::spatial::join;
use crate::data::Data;
use crate::math::{Mat3, Quat, Vec3, Vec6, mat, quat, turn, vec3};
use crate::model::{JointKind, Model, Tree};

/// Poses of a tree that is not one free body, and the axes of its dofs.
///
/// From the parent's pose each joint in turn moves the body: a slide along its axis, a hinge or ball by a
/// rotation that leaves the joint's anchor where it is; q is measured from `qpos0`.
///
/// Reads: qpos. Writes: xpos, xquat, xmat, xanchor, xaxis of the tree; cdof; com of its movers. Not inlined: the loop over free
/// bodies stays small.
#[inline(never)]
pub fn articulated(model: &Model, t: usize, qpos: &[f64], data: &mut Data) {
    let tree = &model.trees[t];
    if !tree.rotates {
        tree.bodies.clone().for_each(|b| sliding_body(model, b, qpos, data));
        return;
    }
    for b in tree.bodies.clone() {
        if let Mount::Hinge(_) = data.plan.mounts[b] {
            hinged(model, b, qpos, data);
        } else if model.bodies[b].joints.is_empty() {
            weld(model, b, data);
        } else {
            body(model, b, qpos, data);
        }
    }
    let Data { plan, xpos, xmat, movers, .. } = data;
    for link in plan.links_of(t) {
        movers[link.body].com = xpos[link.body] + xmat[link.body] * model.bodies[link.body].ipos;
    }
    axes(model, tree, data);
}

/// A body that is fixed to its parent.
pub fn weld(model: &Model, b: usize, data: &mut Data) {
    let Data { plan, xpos, xquat, xmat, .. } = data;
    let body = &model.bodies[b];
    if let Mount::Same = plan.mounts[b] {
        (xpos[b], xquat[b], xmat[b]) = (xpos[body.parent], xquat[body.parent], xmat[body.parent]);
    } else {
        xpos[b] = xpos[body.parent] + xmat[body.parent] * body.pos;
        xquat[b] = xquat[body.parent] * body.quat;
        xmat[b] = mat(&xquat[b]);
    }
}

/// A body on one hinge, P being the parent: its anchor stays where P has it, its axis turns with it.
///
///     R = R_P R₀ exp(a (q − q₀)),   x = x_P + R_P anchor_P − R anchor
fn hinged(model: &Model, b: usize, qpos: &[f64], data: &mut Data) {
    let Data { plan, xpos, xquat, xmat, xanchor, xaxis, .. } = data;
    let Mount::Hinge(hinge) = &plan.mounts[b] else { return };
    let parent = model.bodies[b].parent;
    let anchor = xpos[parent] + xmat[parent] * hinge.anchor;
    let carried = hinge.quat.map_or(xquat[parent], |turned| xquat[parent] * turned);
    let rot = unit(carried * turn(&hinge.axis, qpos[hinge.qposadr] - hinge.rest));
    let axes = mat(&rot);
    xpos[b] = if hinge.centred { anchor } else { anchor - axes * hinge.pos };
    xquat[b] = rot;
    xmat[b] = axes;
    xanchor[hinge.joint] = anchor;
    xaxis[hinge.joint] = axes * hinge.axis;
}

/// A body with joints.
fn body(model: &Model, b: usize, qpos: &[f64], data: &mut Data) {
    let Data { xpos, xquat, xmat, xanchor, xaxis, .. } = data;
    let body = &model.bodies[b];
    let mut pos = xpos[body.parent] + xmat[body.parent] * body.pos;
    let mut rot = xquat[body.parent] * body.quat;
    for j in body.joints.clone() {
        let joint = &model.joints[j];
        let q = &qpos[joint.qposadr..];
        if joint.kind == JointKind::Free {
            pos = vec3(q);
            rot = quat(&q[3..7]);
            xanchor[j] = pos;
            xaxis[j] = joint.axis;
            continue;
        }
        let anchor = pos + rot * joint.pos;
        let axis = rot * joint.axis;
        xanchor[j] = anchor;
        xaxis[j] = axis;
        match joint.kind {
            JointKind::Slide => pos += axis * (q[0] - model.qpos0[joint.qposadr]),
            JointKind::Hinge => rot *= turn(&joint.axis, q[0] - model.qpos0[joint.qposadr]),
            JointKind::Ball | JointKind::Free => rot *= quat(&q[0..4]),
        }
        if joint.kind != JointKind::Slide {
            pos = anchor - rot * joint.pos;
        }
    }
    xpos[b] = pos;
    xquat[b] = unit(rot);
    xmat[b] = mat(&xquat[b]);
}

/// The same, its length corrected: rounding grows along a chain.
fn unit(q: Quat) -> Quat {
    quat(&[q.w, q.i, q.j, q.k])
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
    let Data { xpos, xmat, xanchor, xaxis, cdof, .. } = data;
    let origin = xpos[tree.bodies.start];
    for j in super::joints_of(model, tree) {
        let joint = &model.joints[j];
        let dof = joint.dofadr;
        match joint.kind {
            JointKind::Slide => cdof[dof] = join(&xaxis[j], &Vec3::zeros()),
            JointKind::Hinge => cdof[dof] = join(&(xanchor[j] - origin).cross(&xaxis[j]), &xaxis[j]),
            JointKind::Ball | JointKind::Free => {
                let rotation = dof + joint.kind.nv() - 3;
                let arm = xanchor[j] - origin;
                for i in 0..3 {
                    let axis = xmat[joint.body].column(i).into_owned();
                    cdof[rotation + i] = join(&arm.cross(&axis), &axis);
                }
                if joint.kind == JointKind::Free {
                    for i in 0..3 {
                        cdof[dof + i] = Vec6::ith(i, 1.0);
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
        let (origin, axes) = (&xpos[g.body], &xmat[g.body]);
        geom_xpos[g.geom] = if g.centred { *origin } else { origin + axes * g.pos };
        geom_xmat[g.geom] = if g.aligned { *axes } else { axes * g.mat };
    }
}
