//! How a point of a body moves where q̈ = 0: what J q̇ and J̇ q̇ are for its rows of J.

use super::bias::carrier;
use super::spatial::{ang, at, cross_motion, lin};
use crate::data::Data;
use crate::math::{Vec3, Vec6, vec3};
use crate::model::Model;

/// World axes.
#[derive(Clone, Copy, Debug)]
pub struct Carried {
    /// Of the point, m/s.
    pub velocity: Vec3,
    /// Of the point, m/s².
    pub acceleration: Vec3,
    /// Angular velocity of the body, rad/s.
    pub spin: Vec3,
    /// Angular acceleration of the body, rad/s².
    pub turn: Vec3,
}

/// The motion of the point of a body that is now at `point` (world, m), where q̈ = 0.
///
///     a_p = A + α × r + ω × v_p        A, α rate of the body's twist; r from its origin to the point
///
/// Reads: poses, cdof, qvel.
pub fn carried(model: &Model, data: &Data, qvel: &[f64], body: usize, point: &Vec3) -> Carried {
    let (mut v, mut a, mut arm) = (Vec6::zeros(), Vec6::zeros(), Vec3::zeros());
    if let Some(t) = model.bodies[body].tree {
        let tree = &model.trees[t];
        let root = tree.bodies.start;
        arm = point - data.xpos[root];
        if tree.free.is_some() {
            let qvel = &qvel[tree.dofs.clone()];
            let spin = data.xmat[root] * vec3(&qvel[3..]);
            let velocity = vec3(qvel) + spin.cross(&arm);
            // Neither the velocity of the origin nor the angular velocity in body axes changes.
            let acceleration = spin.cross(&spin.cross(&arm));
            return Carried { velocity, acceleration, spin, turn: Vec3::zeros() };
        }
        twist(model, data, qvel, model.bodies[body].weld, &mut v, &mut a);
    }
    let (v, a) = (at(&v, &arm), at(&a, &arm));
    let (spin, turn) = (ang(&v), ang(&a));
    Carried { velocity: lin(&v), acceleration: lin(&a) + spin.cross(&lin(&v)), spin, turn }
}

/// Twist of a body with joints and its rate, from the root on; see [`bias`](super::bias::bias).
fn twist(model: &Model, data: &Data, qvel: &[f64], body: usize, v: &mut Vec6, a: &mut Vec6) {
    let parent = model.bodies[model.bodies[body].parent].weld;
    if model.bodies[parent].tree.is_some() {
        twist(model, data, qvel, parent, v, a);
    }
    for joint in &model.joints[model.bodies[body].joints.clone()] {
        let d = joint.dofadr;
        let moved = (d..d + joint.kind.nv()).map(|d| data.cdof[d] * qvel[d]).sum::<Vec6>();
        *a += cross_motion(&carrier(joint, qvel, v), &moved);
        *v += moved;
    }
}
