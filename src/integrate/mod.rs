//! Integrators. The list [`ALL`] is the only place that knows their names.

pub mod explicit_euler;
pub mod implicit_euler;
pub mod implicitfast;
pub mod rk4;
pub mod semi_implicit_euler;

use crate::contact;
use crate::math::{Quat, exp, quat, vec3, wxyz};
pub use crate::method::{DampedSpring, Dampers, Integrator, Matrix2};
use crate::method::{Method, ROUNDS};
use crate::model::{JointKind, Model};

/// All integrators.
pub const ALL: &[&Integrator] = &[
    &explicit_euler::METHOD,
    &semi_implicit_euler::METHOD,
    &implicit_euler::METHOD,
    &rk4::METHOD,
    &implicitfast::METHOD,
];

/// The integrator of that CLI name or MJCF keyword.
pub fn by_name(name: &str) -> Option<&'static Integrator> {
    ALL.iter().copied().find(|i| i.name == name || i.mjcf.contains(&name))
}

impl Method {
    /// The contact law, integrator and timestep that a scene names; defaults where it names none.
    pub fn of(model: &Model) -> Method {
        let law = model.contact_law().and_then(contact::by_name).unwrap_or(contact::default());
        // The compiler has let no other name pass.
        let integrator = by_name(&model.opt.integrator).unwrap_or(&semi_implicit_euler::METHOD);
        Method { contact: law, integrator, timestep: model.opt.timestep, rounds: ROUNDS }
    }
}

/// Moves the position along a velocity for a time h.
///
///     q ← q ⊕ h v:   numbers q + h v,   quaternions q · exp(h ω), ω in body axes
pub fn displace(model: &Model, qpos: &mut [f64], vel: &[f64], h: f64) {
    for tree in &model.trees {
        let (q, v) = (tree.qpos.start, tree.dofs.start);
        if tree.free.is_some() {
            displace_free(&mut qpos[q..q + 7], &vel[v..v + 6], h);
            continue;
        }
        for joint in &model.joints[crate::dynamics::joints_of(model, tree)] {
            let (q, v) = (joint.qposadr, joint.dofadr);
            match joint.kind {
                JointKind::Free => displace_free(&mut qpos[q..q + 7], &vel[v..v + 6], h),
                JointKind::Ball => displace_quat(&mut qpos[q..q + 4], &vel[v..v + 3], h),
                JointKind::Slide | JointKind::Hinge => qpos[q] += h * vel[v],
            }
        }
    }
}

fn displace_free(q: &mut [f64], v: &[f64], h: f64) {
    for i in 0..3 {
        q[i] += h * v[i];
    }
    displace_quat(&mut q[3..7], &v[3..6], h);
}

fn displace_quat(q: &mut [f64], w: &[f64], h: f64) {
    let turned: Quat = quat(q) * exp(&(h * vec3(w)));
    q.copy_from_slice(&wxyz(&turned));
}

/// y ← y + a x, in pairs: what is written two by two can be read back two by two without waiting.
fn add_scaled(y: &mut [f64], a: f64, x: &[f64]) {
    let (pairs, rest) = y.as_chunks_mut::<2>();
    let (x_pairs, x_rest) = x.as_chunks::<2>();
    for (y, x) in pairs.iter_mut().zip(x_pairs) {
        y[0] += a * x[0];
        y[1] += a * x[1];
    }
    for (y, x) in rest.iter_mut().zip(x_rest) {
        *y += a * x;
    }
}
