//! Inertia matrix and bias forces of a tree that moves in a plane: the passes of [`inertia`](super::inertia) and
//! [`bias`](super::bias) with three numbers in place of six.
//!
//! All hinges have the direction n, all slides are orthogonal to it. With two more axes e₁, e₂ that make a right-handed
//! frame with n, and about the origin o of the tree's first body,
//!
//!     twist V = [v₁, v₂, ω],   wrench F = [f₁, f₂, τ],   dof S = [s₁, s₂, a]
//!     I V = [m v₁ − h₂ ω, m v₂ + h₁ ω, h₁ v₂ − h₂ v₁ + J ω],   h = m (com − o),   J = I_c + m |com − o|²
//!     V × S = [v₂ a − ω s₂, ω s₁ − v₁ a, 0],   V ×* F = [−ω f₂, ω f₁, v₁ f₂ − v₂ f₁]
//!
//! Source: Featherstone, Rigid Body Dynamics Algorithms (2008), §2.16.

use super::inertia::fill;
use super::links::{Link, NONE};
use super::plane::{Disk, Moving, Plane, Scratch, add, dot};
use crate::data::Data;
use crate::math::Vec3;
use crate::model::Model;

/// Bias forces, as [`bias`](super::bias::bias), and the inertias that [`matrix`] needs.
///
/// Reads: xpos, xmat, cdof, qvel. Writes: the planar scratch, qfrc_bias.
pub fn bias(model: &Model, t: usize, plane: &Plane, gravity: &Vec3, qvel: &[f64], data: &mut Data) {
    let Data { plan, xpos, xmat, cdof, qfrc_bias, planar: Scratch { axes, bodies }, .. } = data;
    let (links, origin) = (plan.links_of(t), xpos[model.trees[t].bodies.start]);
    let [up1, up2] = plane.point(&-gravity);
    for link in links {
        let (mut vel, mut acc) = match link.parent {
            NONE => ([0.0; 3], [up1, up2, 0.0]),
            parent => (bodies[parent].vel, bodies[parent].acc),
        };
        let dofs = link.dofs.clone();
        for ((axis, s), rate) in axes[dofs.clone()].iter_mut().zip(&cdof[dofs.clone()]).zip(&qvel[dofs]) {
            *axis = plane.twist(s);
            let moved @ [s1, s2, a] = axis.map(|s| s * rate);
            let [v1, v2, w] = vel;
            add(&mut acc, &[v2 * a - w * s2, w * s1 - v1 * a, 0.0]);
            add(&mut vel, &moved);
        }
        let com = xpos[link.body] - origin + xmat[link.body] * link.com;
        let inertia = Disk::new(link.mass, plane.point(&com), link.turning);
        let ([v1, v2, w], [p1, p2, _]) = (vel, inertia.mul(&vel));
        let mut force = inertia.mul(&acc);
        add(&mut force, &[-w * p2, w * p1, v1 * p2 - v2 * p1]);
        bodies[link.body] = Moving { vel, acc, force, inertia };
    }
    for link in links.iter().rev() {
        let Moving { force, inertia, .. } = bodies[link.body];
        for (bias, axis) in qfrc_bias[link.dofs.clone()].iter_mut().zip(&axes[link.dofs.clone()]) {
            *bias = dot(axis, &force);
        }
        if link.parent != NONE {
            let parent = &mut bodies[link.parent];
            add(&mut parent.force, &force);
            parent.inertia.add(&inertia);
        }
    }
}

/// M, as [`inertia::matrix`](super::inertia::matrix), from what [`bias`] has left.
///
/// Writes: the tree's block of qm_rows.
pub fn matrix(model: &Model, t: usize, data: &mut Data) {
    let Data { plan, qm_rows, planar: Scratch { axes, bodies }, .. } = data;
    let tree = &model.trees[t];
    let axes = &axes[tree.dofs.clone()];
    let force = |link: &Link, j: usize| bodies[link.body].inertia.mul(&axes[j]);
    fill(model, t, plan, qm_rows, force, |i, force| dot(&axes[i], force));
}
