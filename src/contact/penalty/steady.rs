//! The last step's forces, tried on one free body against things that never move: mostly they are still right.
//!
//! A body that rests, slides, or rolls on needs the same forces in every step. Whether they still solve the equations is
//! seen without rows and without a matrix, in the contact's own coordinates: axes n, s, t of its frame, r the arm from
//! the centre of mass, W the inverse inertia and m the mass,
//!
//!     a = a₀ + σ Σ f/m,   α = α₀ + σ W Σ (r × f + τ),     σ = 1 if the body is the second of the two, else −1
//!
//! and the residual is [`mod@super::residual`]'s. What it does not accept is solved the general way; a test compares the
//! two. Worth it (`penny bench --against mujoco`, times MuJoCo's speed with it and without): a sphere that rolls 9.1 and
//! 7.2, a box at rest 7.7 and 4.9, the tutorial's disk 8.3 and 5.2, a T at rest 7.9 and 4.4.

use super::{Coefficients, TOLERANCE};
use crate::contact::Task;
use crate::contact::cost::GROUPS;
use crate::contact::impedance::{impedance, regularisation, share};
use crate::contact::mujoco::coefficients::inverse_mass;
use crate::data::Contact;
use crate::math::{Mat3, Vec3, Vec6};

/// Most contacts that are tried.
pub const MOST: usize = 8;

/// The acceleration of the body's mover, if the forces that the contacts have solve the equations.
///
/// In: the tree's contacts that push; all in one frame and of one mix, at most [`MOST`], under an explicit integrator.
pub fn steady(
    task: &Task,
    coefficients: &[Coefficients],
    tree: usize,
    which: &[usize],
    contacts: &mut [Contact],
) -> Option<Vec6> {
    let first = &contacts[which[0]];
    let alike = |c: &Contact| c.mix == first.mix && c.frame == first.frame && c.body == first.body;
    let flags = &task.model.opt.flags;
    if which.len() > MOST || flags.diagexact || task.settings.implicit {
        return None;
    }
    if !which[1..].iter().all(|&c| alike(&contacts[c])) {
        return None;
    }
    let own = &coefficients[first.mix as usize];
    match (task.model.mixes[first.mix as usize].condim, which.len()) {
        (1, 1) => tried::<1, 1>(task, own, tree, which, contacts),
        (1, _) => tried::<1, MOST>(task, own, tree, which, contacts),
        (3, 1) => tried::<3, 1>(task, own, tree, which, contacts),
        (3, 2..=4) => tried::<3, 4>(task, own, tree, which, contacts),
        (3, _) => tried::<3, MOST>(task, own, tree, which, contacts),
        (4, 1) => tried::<4, 1>(task, own, tree, which, contacts),
        (4, _) => tried::<4, MOST>(task, own, tree, which, contacts),
        (_, 1) => tried::<6, 1>(task, own, tree, which, contacts),
        (_, 2) => tried::<6, 2>(task, own, tree, which, contacts),
        _ => tried::<6, MOST>(task, own, tree, which, contacts),
    }
}

/// [`steady`] for at most L contacts of DIM rows.
#[inline]
fn tried<const DIM: usize, const L: usize>(
    task: &Task,
    own: &Coefficients,
    tree: usize,
    which: &[usize],
    contacts: &mut [Contact],
) -> Option<Vec6> {
    let Task { model, data, settings, .. } = *task;
    let root = model.trees[tree].bodies.start;
    let mover = &data.movers[root];
    let first = &contacts[which[0]];
    let side = usize::from(first.body[1] as usize == root);
    let sign = if side == 1 { 1.0 } else { -1.0 };
    let n = which.len();

    // The body in the contact's axes.
    let frame =
        if DIM > 1 { first.frame } else { crate::collision::frame(&first.frame.row(0).transpose(), &Vec3::zeros()) };
    let axes = frame * mover.axes;
    let inverse_inertia = Vec3::new(mover.minv[3], mover.minv[4], mover.minv[5]);
    let w: Mat3 = axes * Mat3::from_diagonal(&inverse_inertia) * axes.transpose();
    let parts = |v: &Vec6| (frame * Vec3::new(v[0], v[1], v[2]), axes * Vec3::new(v[3], v[4], v[5]));
    let ((vel, omega), (mut acc, mut alpha)) = (parts(&mover.vel), parts(&mover.acc));

    // Their arms, and what their forces do together.
    let (mut arm, mut lever2) = ([Vec3::zeros(); L], [0.0; L]);
    let (mut force, mut torque) = (Vec3::zeros(), Vec3::zeros());
    for i in 0..n.min(L) {
        let c = &contacts[which[i]];
        let lever = c.pos - mover.com;
        lever2[i] = lever.norm_squared();
        arm[i] = frame * lever;
        // The body's own surface.
        arm[i].x += sign * 0.5 * c.dist;
        let f = if DIM > 1 { Vec3::new(c.force[0], c.force[1], c.force[2]) } else { Vec3::new(c.force[0], 0.0, 0.0) };
        force += f;
        torque += arm[i].cross(&f);
        if DIM > 3 {
            torque.x += c.force[3];
        }
        if DIM > 4 {
            torque.y += c.force[4];
            torque.z += c.force[5];
        }
    }
    acc += force * (sign * mover.minv[0]);
    alpha += w * torque * sign;

    // Whether each force is what its formula asks for.
    let per_step = 1.0 / settings.timestep;
    let [linear, angular] = model.bodies[model.geoms[first.geom[side] as usize].body].invweight0;
    let (mut most, mut scale) = (0.0f64, 0.0f64);
    let mut wishes = [[0.0; DIM]; L];
    for i in 0..n.min(L) {
        let c = &contacts[which[i]];
        let body = model.geoms[c.geom[side] as usize].body;
        let [linear, angular] = if body == model.geoms[first.geom[side] as usize].body {
            [linear, angular]
        } else {
            model.bodies[body].invweight0
        };
        let inverse = if linear == 0.0 { inverse_mass(model, c) } else { linear };
        let v = (vel + omega.cross(&arm[i])) * sign;
        let a = (acc + alpha.cross(&arm[i])) * sign;
        let r = c.dist - own.margin;
        let d = impedance(&own.solimp, r) * share(-r, own.onset);
        let softness = regularisation(d, inverse) * own.stiffening;
        let reference = own.spring.acceleration(d, r, v.x);
        let x = a.x - reference;
        wishes[i][0] = (c.force[0] - (x + softness * c.force[0]) / inverse).max(0.0);
        most = most.max(inverse * (c.force[0] - wishes[i][0]).abs());
        scale = scale.max(inverse * c.force[0].abs()).max(1e-4 * reference.abs());
        if DIM == 1 {
            continue;
        }
        let slip = v * per_step;
        let (spin, turn) = (omega * (sign * per_step), alpha * sign);
        let slips = [a.y + slip.y, a.z + slip.z, turn.x + spin.x, turn.y + spin.y, turn.z + spin.z];
        let inverses = [linear + angular * lever2[i], angular, angular];
        for (group, inverse) in GROUPS.into_iter().zip(inverses) {
            if group.end > DIM || inverse == 0.0 {
                break;
            }
            let (mut square, mut wanted) = (0.0, [0.0; 2]);
            let mu = own.friction[group.start - 1];
            for (wanted, k) in wanted.iter_mut().zip(group.clone()) {
                // In slips and forces scaled by the rows' coefficients the limit is a circle.
                let ratio = own.friction[k - 1] / mu;
                *wanted = c.force[k] / ratio * (1.0 - super::SLIP) - ratio * slips[k - 1] / inverse;
                square += *wanted * *wanted;
                scale = scale.max(1e-4 * slips[k - 1].abs());
            }
            let limit = mu * c.force[0];
            let shrink = if square > limit * limit { limit / square.sqrt() } else { 1.0 };
            for (wanted, k) in wanted.iter().zip(group) {
                let ratio = own.friction[k - 1] / mu;
                wishes[i][k] = wanted * shrink * ratio;
                most = most.max(inverse * (c.force[k] / ratio - wanted * shrink).abs());
            }
        }
    }
    if most > TOLERANCE * scale || most.is_nan() {
        return None;
    }
    // Part of the way to what was wished for (Jacobi), for the next step: else an error within the tolerance would stay.
    for (wish, &c) in wishes.iter().zip(which) {
        for (f, wish) in contacts[c].force.iter_mut().zip(wish) {
            *f += (wish - *f) / L as f64;
        }
    }
    let (a, turn) = (frame.tr_mul(&acc), axes.tr_mul(&alpha));
    Some(Vec6::new(a.x, a.y, a.z, turn.x, turn.y, turn.z))
}
