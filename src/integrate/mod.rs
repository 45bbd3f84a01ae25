//! Integrators. The list [`ALL`] is the only place that knows their names.

pub mod explicit_euler;
pub mod implicit_euler;
pub mod implicitfast;
pub mod rk4;
pub mod semi_implicit_euler;

use crate::data::Data;
use crate::forward::Method;
use crate::math::{Quat, exp, quat, vec3, wxyz};
use crate::model::{JointKind, Model};
use crate::state::State;

/// An integrator.
pub struct Integrator {
    /// CLI name.
    pub name: &'static str,
    /// MJCF keywords that select it.
    pub mjcf: &'static [&'static str],
    /// Global order on smooth systems; a test measures it.
    pub order: u8,
    /// One line for `--help`, plots and docs.
    pub about: &'static str,
    /// The contact law is asked for the forces at the end of the step: velocities are then not extrapolated.
    pub implicit: bool,
    /// One step of `method.timestep`: advances time, qpos, qvel and the warm starts.
    pub advance: fn(&Model, &Method, &mut State, &mut Data),
    /// What a step h (s) makes of a damped spring: (x, v) ← A(h) (x, v), row by row. `None`: the method gives no formula,
    /// and theory says nothing about its timestep.
    pub amplification: Option<fn(&DampedSpring, h: f64) -> Matrix2>,
}

/// A 2 × 2 matrix, row by row.
pub type Matrix2 = [[f64; 2]; 2];

/// A damped spring of unit mass, as theory asks an integrator about it.
///
///     v̇ = −ω² x − 2 ζ ω v
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DampedSpring {
    /// rad/s
    pub omega: f64,
    /// Damping ratio.
    pub zeta: f64,
    /// Its damper is a joint's, which some integrators take implicitly; contacts' dampers are explicit.
    pub joint: bool,
}

impl DampedSpring {
    /// ω², 1/s²
    pub fn stiffness(&self) -> f64 {
        self.omega * self.omega
    }
    /// 2 ζ ω, 1/s
    pub fn damping(&self) -> f64 {
        2.0 * self.zeta * self.omega
    }
}

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
