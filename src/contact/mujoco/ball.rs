//! A ball that touches one thing that never moves: the law's forces by formulas.
//!
//! Of a ball whose centre is its centre of mass, of mass m and moment of inertia I, a force along the normal turns nothing, one
//! across it moves nothing along it, and a torque about it does neither: J M⁻¹ Jᵀ of normal, two tangents and spin is diagonal,
//!
//!     A = diag(1/m, A_t, A_t, 1/I),   A_t = 1/m + ρ²/I          ρ from the centre to the contact point, m
//!
//! and so the convex problem falls apart. With x what is wanted of the accelerations without forces ([`Cone`]), R the softness:
//!
//!     no friction:     N = −x₀ / (A₀ + R) where that pushes
//!     elliptic cone, friction the same both ways, in the plane of normal and slip:
//!         sticks       N = −x₀ / (A₀ + R₀),  f = −x_t / (A_t + R₁)          where |f| ≤ μ N
//!         slips        N = (μ |x_t| − x₀) / (A₀ + μ² A_t + (1 + μ̃²) R₀),  f = −μ N x_t/|x_t|
//!     pyramidal cone:  the edges n ± μⱼ tⱼ of each j, where the normal ends at acceleration −y, push with
//!         Pⱼ = max(0, (y + gⱼ) / (R + μⱼ² Aⱼ), 2 y / R),   gⱼ = μⱼ |xⱼ|     neither, one, both of them
//!         y = −x₀ − A₀ Σ Pⱼ
//!
//! The last is one equation in y, of straight pieces that only become steeper: Newton's method ends on the right one.
//!
//! Nothing is needed of the last step. Where rolling rubs too, or spin under an elliptic cone, there are no such formulas.

use super::Coefficients;
use super::coefficients::inverse_mass;
use crate::contact::cost::{Cone, Kind};
use crate::contact::{Task, islands::Alone};
use crate::data::Contact;
use crate::dynamics::spatial::{ang, join, lin};
use crate::math::{Vec3, Vec6};
use crate::model::{self, Mix, Model};

/// Whether the formulas are for contacts of that mix.
pub fn has(model: &Model, mix: &Mix) -> bool {
    let cone = match (model.opt.cone, mix.condim) {
        (_, 1) => true,
        (model::Cone::Pyramidal, condim) => condim <= 4,
        (model::Cone::Elliptic, condim) => condim == 3 && mix.friction[0] == mix.friction[1],
    };
    cone && !model.opt.flags.diagexact && model.opt.noslip_iterations == 0
}

/// The acceleration of the ball's mover. Writes the contact's forces.
#[inline(always)]
pub fn push(task: &Task, own: &Coefficients, alone: &Alone, contact: &mut Contact) -> Vec6 {
    match task.model.mixes[contact.mix as usize].condim {
        1 => push_rows::<1>(task, own, alone, contact),
        3 => push_rows::<3>(task, own, alone, contact),
        _ => push_rows::<4>(task, own, alone, contact),
    }
}

/// [`push`] for a contact of DIM rows.
#[inline(always)]
fn push_rows<const DIM: usize>(task: &Task, own: &Coefficients, alone: &Alone, contact: &mut Contact) -> Vec6 {
    let mover = &task.data.movers[task.model.trees[alone.tree].bodies.start];
    // Rows n, s, t against the thing that does not move.
    let frame = if alone.side == 1 { contact.frame } else { -contact.frame };
    let arm = contact.pos - mover.com;
    let (w, alpha) = (mover.axes * ang(&mover.vel), mover.axes * ang(&mover.acc));
    let (v, a) = (frame * (lin(&mover.vel) + w.cross(&arm)), frame * (lin(&mover.acc) + alpha.cross(&arm)));
    let n = frame.row(0).transpose();
    let about = |turn: &Vec3| if DIM > 3 { n.dot(turn) } else { 0.0 };
    let (mut cone, mut bias) = (Cone { dim: DIM, ..Cone::default() }, [0.0; 6]);
    let inverse = inverse_mass(task.model, contact);
    own.fill(contact.dist, inverse, &[v.x, v.y, v.z, about(&w), 0.0, 0.0], &mut cone, &mut bias);
    let x = [a.x + bias[0], a.y + bias[1], a.z + bias[2], about(&alpha) + bias[3]];
    let (per_mass, per_inertia) = (mover.minv[0], mover.minv[3]);
    let across = per_mass + arm.norm_squared() * per_inertia;
    let inverse = [per_mass, across, across, per_inertia];
    let force = match cone.kind {
        Kind::Ellipse => ellipse(&cone, &x, &inverse),
        Kind::Pyramid if DIM == 3 => pyramid::<2>(&cone, &x, &inverse),
        Kind::Pyramid => pyramid::<3>(&cone, &x, &inverse),
        _ => [(-x[0] / (per_mass + 1.0 / cone.d[0])).max(0.0), 0.0, 0.0, 0.0],
    };
    contact.force[..4].copy_from_slice(&force);
    let f = frame.tr_mul(&Vec3::new(force[0], force[1], force[2]));
    let mut torque = arm.cross(&f);
    if DIM > 3 {
        torque += n * force[3];
    }
    mover.acc + join(&(f * per_mass), &(mover.axes.tr_mul(&torque) * per_inertia))
}

/// Normal and friction under an elliptic cone.
#[inline(always)]
fn ellipse(cone: &Cone, x: &[f64; 4], inverse: &[f64; 4]) -> [f64; 4] {
    let (mu, soft) = (cone.mu[1], 1.0 / cone.d[0]);
    let square = x[1] * x[1] + x[2] * x[2];
    let (normal, hold) = (-x[0] / (inverse[0] + soft), 1.0 / (inverse[1] + 1.0 / cone.d[1]));
    if normal >= 0.0 && hold * hold * square <= mu * mu * normal * normal {
        return [normal, -hold * x[1], -hold * x[2], 0.0];
    }
    let slip = square.sqrt();
    let met = inverse[0] + mu * mu * inverse[1] + (1.0 + cone.mu[0] * cone.mu[0]) * soft;
    let normal = ((mu * slip - x[0]) / met).max(0.0);
    // Where nothing slips nothing pushes here.
    let per_slip = if normal > 0.0 { mu * normal / slip } else { 0.0 };
    [normal, -per_slip * x[1], -per_slip * x[2], 0.0]
}

/// Normal and friction under a pyramidal cone of PAIRS pairs of edges.
#[inline(always)]
fn pyramid<const PAIRS: usize>(cone: &Cone, x: &[f64; 4], inverse: &[f64; 4]) -> [f64; 4] {
    // Mostly all edges push: it sticks.
    let soft = 1.0 / cone.d[0];
    let normal = -x[0] / (inverse[0] + soft / (2 * PAIRS) as f64);
    let (mut force, mut sticks) = ([normal, 0.0, 0.0, 0.0], true);
    for j in 1..=PAIRS {
        let (mu, hold) = (cone.mu[j], stuck(cone.mu[j], x[j], soft, inverse[j]));
        force[j] = -hold;
        sticks &= hold.abs() * PAIRS as f64 <= mu * normal;
    }
    if sticks { force } else { slipping::<PAIRS>(cone, x, inverse) }
}

/// Friction of a pair of edges that both push, μ times the difference of their forces.
#[inline(always)]
fn stuck(mu: f64, x: f64, soft: f64, inverse: f64) -> f64 {
    2.0 * mu * mu * x / (soft + 2.0 * mu * mu * inverse)
}

/// What pushes of a pair of edges n ± μ t.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Edges {
    Neither,
    One,
    Both,
}

/// [`pyramid`] where not all edges push.
///
/// The unknown is u = y + g, with y = −g where the stiffest of the pairs that push begins to: there y mostly is nearly −g, and of
/// the difference, R times a force, few digits would be left.
fn slipping<const PAIRS: usize>(cone: &Cone, x: &[f64; 4], inverse: &[f64; 4]) -> [f64; 4] {
    let (soft, both) = (1.0 / cone.d[0], 2.0 * cone.d[0]);
    let (mut pull, mut one) = ([0.0; PAIRS], [0.0; PAIRS]);
    for j in 0..PAIRS {
        let mu = cone.mu[j + 1];
        pull[j] = mu * x[j + 1].abs();
        one[j] = 1.0 / (soft + mu * mu * inverse[j + 1]);
    }
    let (mut edges, mut pushes) = ([Edges::Both; PAIRS], [0.0; PAIRS]);
    // Newton's steps pass each kink once.
    for _ in 0..2 * PAIRS + 2 {
        // Of each pair the slope, and the −y where it begins.
        let pieces: [(f64, f64); PAIRS] = std::array::from_fn(|j| match edges[j] {
            Edges::Neither => (0.0, 0.0),
            Edges::One => (one[j], pull[j]),
            Edges::Both => (both, 0.0),
        });
        let (_, g) = pieces.iter().fold((0.0, 0.0), |most, piece| if piece.0 > most.0 { *piece } else { most });
        // Slope of Σ Pⱼ, and its value at u = 0.
        let (mut slope, mut start) = (0.0, 0.0);
        for (own, from) in pieces {
            (slope, start) = (slope + own, start + own * (from - g));
        }
        let u = (g - x[0] - inverse[0] * start) / (1.0 + inverse[0] * slope);
        let last = edges;
        for j in 0..PAIRS {
            let [single, double] = [one[j] * (u + (pull[j] - g)), both * (u - g)];
            (edges[j], pushes[j]) = match double >= single {
                _ if single.max(double) <= 0.0 => (Edges::Neither, 0.0),
                true => (Edges::Both, double),
                false => (Edges::One, single),
            };
        }
        if edges == last {
            break;
        }
    }
    let mut force = [pushes.iter().sum(), 0.0, 0.0, 0.0];
    for j in 1..=PAIRS {
        let (mu, x) = (cone.mu[j], x[j]);
        force[j] = match edges[j - 1] {
            Edges::Neither => 0.0,
            Edges::One => -mu * pushes[j - 1] * x.signum(),
            Edges::Both => -stuck(mu, x, soft, inverse[j]),
        };
    }
    force
}
