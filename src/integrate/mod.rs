//! Integrators. The list [`ALL`] is the only place that knows their names.

pub mod cash_karp;
pub mod explicit_euler;
pub mod extrapolated;
pub mod implicit_euler;
pub mod implicitfast;
pub mod rk4;
pub mod semi_implicit_euler;

use crate::contact;
use crate::math::{Quat, Vec3, between, exp, quat, vec3, wxyz};
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
    &cash_karp::METHOD,
    &extrapolated::METHOD,
];

/// The integrator of that CLI name or MJCF keyword.
pub fn by_name(name: &str) -> Option<&'static Integrator> {
    ALL.iter().copied().find(|i| i.name == name || i.mjcf.contains(&name))
}

/// The first integrator that estimates its error, for where the one there is does not; `None` where it does.
pub fn controllable(integrator: &Integrator) -> Option<&'static Integrator> {
    ALL.iter().copied().find(|i| i.estimate.is_some()).filter(|_| integrator.estimate.is_none())
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

/// The velocity that leads from one position to another in a time of 1: a = b ⊕ difference.
///
///     numbers a − b,   quaternions log(b⁻¹ a) in body axes
pub fn difference(model: &Model, a: &[f64], b: &[f64], out: &mut [f64]) {
    let rotation = |a: &[f64], b: &[f64]| between(&quat(b), &quat(a));
    for joint in &model.joints {
        let (q, v) = (joint.qposadr, joint.dofadr);
        match joint.kind {
            JointKind::Free => {
                out[v..v + 3].copy_from_slice((vec3(&a[q..]) - vec3(&b[q..])).as_slice());
                out[v + 3..v + 6].copy_from_slice(rotation(&a[q + 3..], &b[q + 3..]).as_slice());
            }
            JointKind::Ball => out[v..v + 3].copy_from_slice(rotation(&a[q..], &b[q..]).as_slice()),
            JointKind::Slide | JointKind::Hinge => out[v] = a[q] - b[q],
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

/// The rates k of a stage from its velocities; `rate` holds those of the stage before, which led here in `step` (s).
fn rotation_rates(model: &Model, qvel: &[f64], step: f64, rate: &mut [f64]) {
    for joint in &model.joints {
        let (first, n) = (joint.dofadr, joint.kind.nv());
        // The numbers that are not an angular velocity come first.
        let linear = if matches!(joint.kind, JointKind::Free | JointKind::Ball) { n - 3 } else { n };
        rate[first..first + linear].copy_from_slice(&qvel[first..first + linear]);
        if linear < n {
            let spin = first + linear..first + n;
            let k = dexp_inv(&(step * vec3(&rate[spin.clone()])), &vec3(&qvel[spin.clone()]));
            rate[spin].copy_from_slice(k.as_slice());
        }
    }
}

/// The rate of a rotation vector θ at which exp θ turns with the angular velocity ω (body axes).
///
///     dexp⁻¹(θ, ω) = ω + ½ θ × ω + (1/θ²) (1 − (θ/2) cot(θ/2)) θ × (θ × ω)
///
/// The last coefficient is 1/12 + θ²/720 + θ⁴/30240 + … .
pub(crate) fn dexp_inv(theta: &Vec3, omega: &Vec3) -> Vec3 {
    let square = theta.norm_squared();
    let coefficient = if square < 1e-3 {
        1.0 / 12.0 + square / 720.0 * (1.0 + square / 42.0 * (1.0 + square / 40.0))
    } else {
        let half = 0.5 * square.sqrt();
        (1.0 - half / half.tan()) / square
    };
    let cross = theta.cross(omega);
    omega + 0.5 * cross + coefficient * theta.cross(&cross)
}

/// The angular velocity ω (body axes) at which exp θ turns when the rotation vector θ changes at a rate k.
///
///     dexp(θ, k) = k − (1 − cos θ)/θ² θ × k + (θ − sin θ)/θ³ θ × (θ × k)
pub(crate) fn dexp(theta: &Vec3, rate: &Vec3) -> Vec3 {
    let square = theta.norm_squared();
    let [first, second] = if square < 1e-3 {
        [0.5 - square / 24.0 * (1.0 - square / 30.0), 1.0 / 6.0 - square / 120.0 * (1.0 - square / 42.0)]
    } else {
        let angle = square.sqrt();
        [(1.0 - angle.cos()) / square, (angle - angle.sin()) / (square * angle)]
    };
    let cross = theta.cross(rate);
    rate - first * cross + second * theta.cross(&cross)
}
