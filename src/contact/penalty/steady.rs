//! The last step's forces, tried on one free body against things that never move: mostly they are still right.
//!
//! Whether they still solve the equations is seen without rows and without a matrix ([`crate::contact::single_body`]); the
//! residual is [`mod@super::residual`]'s. What it does not accept is solved the general way; a test compares the two. Worth it
//! (times MuJoCo's speed with it and without): a sphere that rolls 11.6 and 6.5, a box at rest 9.3 and 4.7, the tutorial's disk
//! 10.3 and 5.9, a T at rest 9.5 and 4.2.
//!
//! The contacts' numbers lie side by side in arrays of L lanes, so that loops over them have a fixed length and fill vector
//! registers. Lanes beyond the last contact look like it, without force, and do not count.

use std::array::from_fn;

use super::{Coefficients, SLIP, TOLERANCE};
use crate::contact::impedance::{impedance, regularisation};
use crate::contact::single_body::{Motion, SingleBody, alike};
use crate::contact::{Lever, Task};
use crate::data::Contact;
use crate::math::{Vec3, Vec6};

/// The acceleration of the body's mover, if the forces that the contacts have solve the equations, and the residual.
///
/// In: the tree's contacts that push; all in one frame and of one mix, at most [`MOST`](super::super::single_body::MOST),
/// under an explicit integrator.
pub fn steady(
    task: &Task,
    coefficients: &[Coefficients],
    tree: usize,
    which: &[usize],
    contacts: &mut [Contact],
) -> Option<(Vec6, f64)> {
    let mix = contacts[which[0]].mix as usize;
    if task.model.opt.flags.diagexact || task.settings.implicit || !alike(which, contacts) {
        return None;
    }
    let own = &coefficients[mix];
    match (task.model.mixes[mix].condim, which.len()) {
        (1, 1) => tried::<1, 1>(task, own, tree, which, contacts),
        (1, _) => tried::<1, 8>(task, own, tree, which, contacts),
        (3, 1) => tried::<3, 1>(task, own, tree, which, contacts),
        (3, 2..=4) => tried::<3, 4>(task, own, tree, which, contacts),
        (3, _) => tried::<3, 8>(task, own, tree, which, contacts),
        (4, 1) => tried::<4, 1>(task, own, tree, which, contacts),
        (4, _) => tried::<4, 8>(task, own, tree, which, contacts),
        (_, 1) => tried::<6, 1>(task, own, tree, which, contacts),
        (_, 2) => tried::<6, 2>(task, own, tree, which, contacts),
        _ => tried::<6, 8>(task, own, tree, which, contacts),
    }
}

/// [`steady`] for at most L contacts of DIM rows.
fn tried<const DIM: usize, const L: usize>(
    task: &Task,
    own: &Coefficients,
    tree: usize,
    which: &[usize],
    contacts: &mut [Contact],
) -> Option<(Vec6, f64)> {
    let Task { model, data, settings, .. } = *task;
    let root = model.trees[tree].bodies.start;
    let mover = &data.movers[root];
    let body = SingleBody::new::<DIM>(mover, root, &contacts[which[0]], Lever::Surface);
    let n = which.len().min(L);

    let (mut dist, mut linear, mut angular, mut lever2) = ([0.0; L], [0.0; L], [0.0; L], [0.0; L]);
    let (mut arm, mut force) = ([[0.0; L]; 3], [[0.0; L]; DIM]);
    for i in 0..L {
        let c = &contacts[which[i.min(n - 1)]];
        let r = body.arm(c);
        (0..3).for_each(|k| arm[k][i] = r[k]);
        (0..DIM).for_each(|k| force[k][i] = if i < n { c.force[k] } else { 0.0 });
        (dist[i], lever2[i]) = (c.dist, (c.pos - mover.com).norm_squared());
        [linear[i], angular[i]] = model.bodies[model.geoms[c.geom[body.side] as usize].body].invweight0;
    }
    if linear.contains(&0.0) {
        return None;
    }

    let vel = body.motion(&mover.vel);
    let v = along(&vel, &arm);
    let r = dist.map(|dist| dist - own.margin);
    let d = r.map(|r| impedance(&own.solimp, r));
    let reference: [f64; L] = from_fn(|i| own.spring.acceleration(d[i], r[i], v[0][i]));
    let softness: [f64; L] = from_fn(|i| regularisation(d[i], linear[i]) * own.stiffening);
    let per_step = 1.0 / settings.timestep;
    let sliding = from_fn(|i| linear[i] + angular[i] * lever2[i]);
    let turns = !angular.contains(&0.0);

    // What their forces do together.
    let (mut total, mut torque) = (Vec3::zeros(), Vec3::zeros());
    for i in 0..L {
        let f: Vec3 = Vec3::from_fn(|k, _| if k < DIM { force[k][i] } else { 0.0 });
        total += f;
        torque += Vec3::new(arm[0][i], arm[1][i], arm[2][i]).cross(&f);
        (3..DIM).for_each(|k| torque[k - 3] += force[k][i]);
    }
    let acceleration = mover.acc + body.acceleration(&total, &torque);
    let acc = body.motion(&acceleration);
    let a = along(&acc, &arm);

    // Whether each is what its formula asks for.
    let mut check = Check { wish: [[0.0; L]; DIM], off: [0.0; L], size: [0.0; L] };
    let x: [f64; L] = from_fn(|i| a[0][i] - reference[i] + softness[i] * force[0][i]);
    check.wish[0] = from_fn(|i| (force[0][i] - x[i] / linear[i]).max(0.0));
    check.off = from_fn(|i| linear[i] * (force[0][i] - check.wish[0][i]).abs());
    check.size = from_fn(|i| (linear[i] * force[0][i].abs()).max(1e-4 * reference[i].abs()));
    if DIM >= 3 {
        let slip = [1, 2].map(|k: usize| from_fn(|i| a[k][i] + per_step * v[k][i]));
        check.friction(own, &force, 1, slip, &sliding);
    }
    if DIM >= 4 && turns {
        let turn = acc.angular + vel.angular * per_step;
        check.friction(own, &force, 3, [[turn.x; L]], &angular);
        if DIM >= 6 {
            check.friction(own, &force, 4, [[turn.y; L], [turn.z; L]], &angular);
        }
    }
    let (mut most, mut size) = (0.0f64, 0.0f64);
    for i in 0..n {
        (most, size) = (most.max(check.off[i]), size.max(check.size[i]));
    }
    if most > TOLERANCE * size || most.is_nan() {
        return None;
    }

    // Part of the way to what was wished for (Jacobi), for the next step: else an error within the tolerance would stay.
    for (i, &c) in which.iter().enumerate().take(L) {
        (0..DIM).for_each(|k| contacts[c].force[k] += (check.wish[k][i] - force[k][i]) / L as f64);
    }
    Some((acceleration, if most == 0.0 { 0.0 } else { most / size }))
}

/// Its linear part at each of the contacts, component by component.
#[inline(always)]
fn along<const L: usize>(motion: &Motion, [x, y, z]: &[[f64; L]; 3]) -> [[f64; L]; 3] {
    let Motion { linear: v, angular: w } = motion;
    [
        from_fn(|i| v.x + (w.y * z[i] - w.z * y[i])),
        from_fn(|i| v.y + (w.z * x[i] - w.x * z[i])),
        from_fn(|i| v.z + (w.x * y[i] - w.y * x[i])),
    ]
}

/// What the contacts' formulas ask for, and how far that is from what they have.
struct Check<const DIM: usize, const L: usize> {
    wish: [[f64; L]; DIM],
    /// λ |f − wish| of each contact, and what it is measured by: m/s², rad/s².
    off: [f64; L],
    size: [f64; L],
}

impl<const DIM: usize, const L: usize> Check<DIM, L> {
    /// A group of N friction rows, from `first` on, with their slips per step and inverse masses λ.
    ///
    /// In slips and forces scaled by the rows' coefficients the limit is a circle.
    #[inline(always)]
    fn friction<const N: usize>(
        &mut self,
        own: &Coefficients,
        force: &[[f64; L]; DIM],
        first: usize,
        slip: [[f64; L]; N],
        inverse: &[f64; L],
    ) {
        let (mu, scale): (f64, [f64; N]) = (own.friction[first - 1], from_fn(|k| own.scale[first - 1 + k]));
        let mobility = inverse.map(|inverse| 1.0 / inverse);
        let scaled: [[f64; L]; N] = from_fn(|k| from_fn(|i| force[first + k][i] / scale[k]));
        let wanted: [[f64; L]; N] =
            from_fn(|k| from_fn(|i| scaled[k][i] * (1.0 - SLIP) - scale[k] * slip[k][i] * mobility[i]));
        let shrink: [f64; L] = from_fn(|i| {
            let (limit, square) = (mu * force[0][i], wanted.iter().map(|w| w[i] * w[i]).sum::<f64>());
            if square > limit * limit { limit / square.sqrt() } else { 1.0 }
        });
        for k in 0..N {
            for i in 0..L {
                let wish = wanted[k][i] * shrink[i];
                self.wish[first + k][i] = scale[k] * wish;
                self.off[i] = self.off[i].max(inverse[i] * (scaled[k][i] - wish).abs());
                self.size[i] = self.size[i].max(1e-4 * slip[k][i].abs());
            }
        }
    }
}
