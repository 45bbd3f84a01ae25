//! The classical Runge–Kutta method of fourth order, MuJoCo's `RK4`.

use super::{DampedSpring, Integrator, Matrix2, add_scaled, displace, rotation_rates};
use crate::data::Data;
use crate::dynamics::actuation;
use crate::forward::{Method, begin, forward};
use crate::model::Model;
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
    estimate: None,
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
        rotation_rates(model, &state.qvel, step, &mut s.rate);
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
