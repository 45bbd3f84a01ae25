//! A body whose dofs do not feel one another: a point mass, a box in a plane, a wheel that rolls along a line.
//!
//! Its joints, one at least, slide along different axes of the world, and the last of them may turn it about such an axis through
//! its centre of mass. Then its inertia matrix is diagonal and never changes, its bias force is its weight, and each dof is one number of
//! the motion [v, ω] of its centre of mass:
//!
//!     M_d = m + armature (slide),  a · I a + armature (hinge about a)
//!     [v, ω]_k(d) = s_d q̇_d,  s_d = ±1,     and the other numbers of [v, ω] are zero
//!
//! Contacts see it as they see a free body ([`crate::contact::free_bodies`]), in some directions without inverse mass.

use super::links::Link;
use crate::math::{Mat3, Vec3, Vec6};
use crate::model::{JointKind, Model, Tree};

/// How far the centre of mass may be from the hinge, over the radius of gyration: what rounding does to it.
const CENTRED: f64 = 1e-15;

/// Where the dofs of a tree stand in the motion of its body.
#[derive(Clone, Debug)]
pub struct Uncoupled {
    /// k and s of each dof.
    along: Vec<(usize, f64)>,
}

impl Uncoupled {
    /// Those of a tree, if its dofs are uncoupled.
    ///
    /// In: the tree's links; `turned` how each body is turned in the world in `qpos0`.
    pub fn of(model: &Model, tree: &Tree, links: &[Link], turned: &[Mat3]) -> Option<Uncoupled> {
        let [link] = links else { return None };
        let body = &model.bodies[link.body];
        // What hangs on a mocap body may be turned with it.
        if tree.bodies.len() > 1 || model.bodies[body.parent].weld != 0 {
            return None;
        }
        let joints = &model.joints[link.joints.clone()];
        let mut along: Vec<(usize, f64)> = Vec::with_capacity(joints.len());
        for (i, joint) in joints.iter().enumerate() {
            let first = match joint.kind {
                JointKind::Slide => 0,
                JointKind::Hinge if i + 1 == joints.len() && centred(link, joint.pos, joint.axis) => 3,
                _ => return None,
            };
            let direction = turned[link.body] * joint.axis;
            let axis = (0..3).find(|&k| direction == Vec3::ith(k, direction[k]) && direction[k].abs() == 1.0)?;
            if along.iter().any(|(k, _)| *k == first + axis) {
                return None;
            }
            along.push((first + axis, direction[axis]));
        }
        // What only turns has its own softness of contacts (`penalty`): of its inverse mass only rounding is left.
        along.first().filter(|(k, _)| *k < 3)?;
        Some(Uncoupled { along })
    }

    /// [v, ω] of the dofs' velocities; their accelerations and forces likewise, as no axis of a dof ever turns.
    #[inline(always)]
    pub fn motion(&self, dofs: &[f64]) -> Vec6 {
        let mut motion = Vec6::zeros();
        self.along.iter().zip(dofs).for_each(|((k, sign), number)| motion[*k] = sign * number);
        motion
    }

    /// The dofs' numbers of a motion, or of a force and a torque.
    #[inline(always)]
    pub fn on_dofs(&self, motion: &Vec6, dofs: &mut [f64]) {
        self.along.iter().zip(dofs).for_each(|((k, sign), number)| *number = sign * motion[*k]);
    }

    /// What never changes: the inverse inertia of the body as a mover. In: the diagonal of M.
    pub fn prepare(&self, diagonal: impl Iterator<Item = f64>) -> Vec6 {
        let mut minv = Vec6::zeros();
        self.along.iter().zip(diagonal).for_each(|((k, _), m)| minv[*k] = 1.0 / m);
        minv
    }
}

/// Whether a hinge passes through the centre of mass.
fn centred(link: &Link, pos: Vec3, axis: Vec3) -> bool {
    let off = (link.com - pos).cross(&axis).norm_squared();
    off * link.mass <= CENTRED * CENTRED * axis.dot(&link.inertia.mul(&axis))
}
