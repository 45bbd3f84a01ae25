//! The classical Runge–Kutta method of fourth order, MuJoCo's `RK4`.

use super::{DampedSpring, Integrator, Matrix2, add_scaled, displace};
use crate::data::Data;
use crate::dynamics::actuation;
use crate::forward::{Method, begin, forward};
use crate::math::{Vec3, vec3};
use crate::model::{JointKind, Model};
use crate::state::{Start, State};

/// The record.
pub const METHOD: Integrator = Integrator {
    name: "rk4",
    mjcf: &["RK4"],
    order: 4,
    about: "Runge–Kutta of fourth order, four evaluations a step: nearly conserves energy",
    implicit: false,
    implicit_dampers: super::Dampers::None,
    advance,
    amplification: Some(amplification),
};

/// 1 + hL + (hL)²/2 + (hL)³/6 + (hL)⁴/24,   L = [0, 1; −ω², −2ζω]
fn amplification(spring: &DampedSpring, h: f64) -> Matrix2 {
    let l = [[0.0, h], [-h * spring.stiffness(), -h * spring.damping()]];
    let mut term: Matrix2 = [[1.0, 0.0], [0.0, 1.0]];
    let mut sum = term;
    for n in 1..=4 {
        let [a, b] = l;
        term = term.map(|t| [0, 1].map(|j| (t[0] * a[j] + t[1] * b[j]) / f64::from(n)));
        for (s, t) in sum.iter_mut().flatten().zip(term.iter().flatten()) {
            *s += t;
        }
    }
    sum
}

/// Fractions of the step at which stages 2 to 4 stand, and the weights of all four in the result.
const STAGE: [f64; 3] = [0.5, 0.5, 1.0];
const WEIGHT: [f64; 4] = [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];

/// The classical Runge–Kutta method of fourth order, on rotations as Munthe-Kaas has it.
///
///     stage i:  q_i = q ⊕ h c_i k_(i−1),   v_i = v + h c_i a_(i−1),   a_i = a(q_i, v_i)
///     k_i = v_i, but for angular velocities k_i = dexp⁻¹(h c_i k_(i−1), v_i)
///     v ← v + h Σ b_i a_i,   q ← q ⊕ h Σ b_i k_i
///
/// The rotation h c_i k_(i−1) that leads to stage i is no small one, so the angular velocity found there (body axes
/// of the stage) is not the rate of a rotation vector counted from q: dexp⁻¹ makes it one. As in MuJoCo the corrected
/// rate k_i enters the sum *and* leads to stage i + 1. Contacts and their forces are found anew at every stage.
///
/// Source: MuJoCo 4.0 manual, Computation › Numerical integration; Munthe-Kaas, BIT 38 (1998).
fn advance(model: &Model, method: &Method, state: &mut State, data: &mut Data) {
    let (h, time) = (method.timestep, state.time);
    begin(model, method, state, data);
    let Data { stages: s, qacc, act_dot, .. } = data;
    s.act.copy_from_slice(&state.act);
    s.act_dot.fill(0.0);
    add_scaled(&mut s.act_dot, WEIGHT[0], act_dot);
    s.qpos.copy_from_slice(&state.qpos);
    s.qvel.copy_from_slice(&state.qvel);
    s.rate.copy_from_slice(&state.qvel);
    s.vel.fill(0.0);
    s.acc.fill(0.0);
    add_scaled(&mut s.vel, WEIGHT[0], &s.rate);
    add_scaled(&mut s.acc, WEIGHT[0], qacc);
    for (c, b) in STAGE.into_iter().zip(&WEIGHT[1..]) {
        let step = c * h;
        let Data { stages: s, qacc, act_dot, .. } = data;
        state.time = time + step;
        state.act.copy_from_slice(&s.act);
        add_scaled(&mut state.act, step, act_dot);
        state.qpos.copy_from_slice(&s.qpos);
        displace(model, &mut state.qpos, &s.rate, step);
        state.qvel.copy_from_slice(&s.qvel);
        add_scaled(&mut state.qvel, step, qacc);
        correct(model, &state.qvel, step, &mut s.rate);
        forward(model, method, state, data);
        let Data { stages: s, qacc, act_dot, .. } = data;
        add_scaled(&mut s.act_dot, *b, act_dot);
        add_scaled(&mut s.vel, *b, &s.rate);
        add_scaled(&mut s.acc, *b, qacc);
    }
    let s = &data.stages;
    state.act.copy_from_slice(&s.act);
    actuation::advance(model, &s.act_dot, h, &mut state.act);
    state.qpos.copy_from_slice(&s.qpos);
    displace(model, &mut state.qpos, &s.vel, h);
    state.qvel.copy_from_slice(&s.qvel);
    add_scaled(&mut state.qvel, h, &s.acc);
    if method.contact.start == Start::Acceleration {
        // As MuJoCo: its solver starts from the last stage.
        state.qacc_warmstart.copy_from_slice(&data.qacc);
    }
    state.time = time + h;
}

/// The rates k of a stage from its velocities; `rate` holds those of the stage before, which led here in `step`.
fn correct(model: &Model, qvel: &[f64], step: f64, rate: &mut [f64]) {
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
fn dexp_inv(theta: &Vec3, omega: &Vec3) -> Vec3 {
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
