//! The last step's acceleration, tried on one free body against things that never move: mostly it is still good enough.
//!
//! It is what [`newton::minimise`](crate::contact::newton::minimise) does with a warm start, found without rows and without a
//! matrix ([`crate::contact::single_body`]). What it does not accept is solved the general way; a test compares the two. Worth
//! it (times MuJoCo's speed with it and without): a sphere that rolls 9.2 and 6.5, a box at rest 7.5 and 4.9, a T at rest 7.4
//! and 4.6.

use super::{Coefficients, stop};
use crate::contact::cost::{Cone, Kind};
use crate::contact::mujoco::coefficients::inverse_mass;
use crate::contact::single_body::{SingleBody, alike};
use crate::contact::{Lever, Task, unit_mass};
use crate::data::Contact;
use crate::math::{Vec3, Vec6};

/// The acceleration of the body's mover, if it was good enough, and the residual. Writes the contacts' forces.
///
/// In: the tree's contacts that push; all in one frame and of one mix, under an explicit integrator.
pub fn steady(
    task: &Task,
    coefficients: &[Coefficients],
    tree: usize,
    which: &[usize],
    contacts: &mut [Contact],
) -> Option<(Vec6, f64)> {
    let (mix, stop) = (contacts[which[0]].mix as usize, stop(task.model));
    let never = !stop.warm || stop.tolerance == 0.0 || task.model.opt.flags.diagexact || task.settings.implicit;
    if never || !alike(which, contacts) {
        return None;
    }
    match task.model.mixes[mix].condim {
        1 => tried::<1>(task, &coefficients[mix], stop.tolerance, tree, which, contacts),
        3 => tried::<3>(task, &coefficients[mix], stop.tolerance, tree, which, contacts),
        4 => tried::<4>(task, &coefficients[mix], stop.tolerance, tree, which, contacts),
        _ => tried::<6>(task, &coefficients[mix], stop.tolerance, tree, which, contacts),
    }
}

/// [`steady`] for contacts of DIM rows.
fn tried<const DIM: usize>(
    task: &Task,
    own: &Coefficients,
    tolerance: f64,
    t: usize,
    which: &[usize],
    contacts: &mut [Contact],
) -> Option<(Vec6, f64)> {
    let Task { model, data, state, .. } = *task;
    let tree = &model.trees[t];
    let free = tree.free.as_ref()?;
    let root = tree.bodies.start;
    let mover = &data.movers[root];
    let guess =
        Vec6::from(unit_mass::acceleration_of_mover(t, free, tree, data, &state.qacc_warmstart[tree.dofs.clone()]));
    let body = SingleBody::new::<DIM>(mover, root, &contacts[which[0]], Lever::Midpoint);
    let (vel, acc) = (body.motion(&mover.vel), body.motion(&guess));

    // What the contacts' forces at that acceleration do together.
    let (mut cone, mut bias) = (Cone { dim: DIM, ..Cone::default() }, [0.0; 6]);
    let mut x = [0.0; 10];
    let (mut total, mut torque) = (Vec3::zeros(), Vec3::zeros());
    for &c in which {
        let c = &mut contacts[c];
        let arm = body.arm(c);
        let v = vel.along(&arm);
        own.fill(c.dist, inverse_mass(model, c), &v, &mut cone, &mut bias);
        let a = acc.along(&arm);
        cone.spread(&std::array::from_fn(|k| a[k] + bias[k]), &mut x);
        // They are found anew where they are not accepted.
        let force = &mut c.force;
        if cone.kind == Kind::Pyramid {
            // As `cost`, but with a number of edges that the compiler knows.
            cone.cost_of_pyramid(&x, force);
        } else {
            cone.cost(&x, force);
        }
        let f = Vec3::new(force[0], force[1], force[2]);
        total += f;
        torque += arm.cross(&f) + Vec3::new(force[3], force[4], force[5]);
    }

    // The gradient M (a − a₀) − Jᵀ f, as a force, and its square in coordinates of unit mass.
    let mass = Vec6::new(free.mass, free.mass, free.mass, free.inertia.x, free.inertia.y, free.inertia.z);
    let off = guess - mover.acc - body.acceleration(&total, &torque);
    let gradient = off.component_mul(&mass);
    let scale = 1.0 / mass.sum();
    let residual = scale * gradient.norm();
    if !(residual < tolerance && 0.5 * scale * gradient.dot(&off) < tolerance) {
        return None;
    }
    Some((guess, residual))
}
