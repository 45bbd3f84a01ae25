//! Cash and Karp's Runge–Kutta method of fifth order, with an embedded one of fourth order that estimates its error.

use super::{DampedSpring, Integrator, Matrix2, add_scaled, displace, rotation_rates};
use crate::data::Data;
use crate::dynamics::actuation;
use crate::forward::{Method, begin, forward};
use crate::model::Model;
use crate::state::{Start, State};

/// The record.
pub const METHOD: Integrator = Integrator {
    name: "cash-karp",
    mjcf: &[],
    order: 5,
    about: "Runge–Kutta of fifth order, six evaluations a step, and an estimate of its error",
    implicit: false,
    implicit_dampers: super::Dampers::None,
    advance,
    amplification: Some(amplification),
    estimate: Some(|data| &data.scratch.get::<Stages>().error),
};

/// Where the stages stand, in steps.
const C: [f64; 6] = [0.0, 1.0 / 5.0, 3.0 / 10.0, 3.0 / 5.0, 1.0, 7.0 / 8.0];
/// What leads to stage i: weights of the stages before it.
const A: [[f64; 5]; 6] = [
    [0.0; 5],
    [1.0 / 5.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0],
    [3.0 / 10.0, -9.0 / 10.0, 6.0 / 5.0, 0.0, 0.0],
    [-11.0 / 54.0, 5.0 / 2.0, -70.0 / 27.0, 35.0 / 27.0, 0.0],
    [1631.0 / 55296.0, 175.0 / 512.0, 575.0 / 13824.0, 44275.0 / 110592.0, 253.0 / 4096.0],
];
/// Weights of the result, of fifth order, and of the embedded one, of fourth.
const B: [f64; 6] = [37.0 / 378.0, 0.0, 250.0 / 621.0, 125.0 / 594.0, 0.0, 512.0 / 1771.0];
const B_EMBEDDED: [f64; 6] = [2825.0 / 27648.0, 0.0, 18575.0 / 48384.0, 13525.0 / 55296.0, 277.0 / 14336.0, 1.0 / 4.0];

/// What the stages found, and the start of the step.
#[derive(Clone, Debug, Default)]
struct Stages {
    qpos: Vec<f64>,
    qvel: Vec<f64>,
    act: Vec<f64>,
    /// Rates of the position (nv), accelerations (nv) and rates of the activations (na) of each stage.
    rate: [Vec<f64>; 6],
    acc: [Vec<f64>; 6],
    act_dot: [Vec<f64>; 6],
    /// The displacement that leads to a stage, or to the end (nv).
    turn: Vec<f64>,
    act_sum: Vec<f64>,
    /// The result less the embedded one: q, then v (2 nv).
    error: Vec<f64>,
}

/// One step; rotations as in [`super::rk4`], after Munthe-Kaas.
///
///     stage i:  q_i = q ⊕ θ_i,  θ_i = h Σ a_ij k_j,   v_i = v + h Σ a_ij a_j,   a_i = a(q_i, v_i)
///     k_i = v_i, but for angular velocities k_i = dexp⁻¹(θ_i, v_i)
///     v ← v + h Σ b_i a_i,   q ← q ⊕ h Σ b_i k_i,   error: the same sums with b − b̂
///
/// The method was made for right-hand sides that change suddenly, which contacts do.
///
/// Source: J. R. Cash, A. H. Karp, ACM Transactions on Mathematical Software 16 (1990), 201–222; Munthe-Kaas, BIT 38 (1998).
fn advance(model: &Model, method: &Method, state: &mut State, data: &mut Data) {
    let (h, time, nv) = (method.timestep, state.time, model.nv);
    begin(model, method, state, data);
    let mut s = data.scratch.take::<Stages>();
    s.qpos.clone_from(&state.qpos);
    s.qvel.clone_from(&state.qvel);
    s.act.clone_from(&state.act);
    s.rate[0].clone_from(&state.qvel);
    s.acc[0].clone_from(&data.qacc);
    s.act_dot[0].clone_from(&data.act_dot);
    for i in 1..6 {
        state.time = time + C[i] * h;
        s.displace(model, &A[i][..i], h, state);
        for (act, before) in state.act.iter_mut().zip(&s.act) {
            *act = *before;
        }
        (0..i).for_each(|j| add_scaled(&mut state.act, h * A[i][j], &s.act_dot[j]));
        s.rate[i].clone_from(&s.turn);
        rotation_rates(model, &state.qvel, 1.0, &mut s.rate[i]);
        forward(model, method, state, data);
        s.acc[i].clone_from(&data.qacc);
        s.act_dot[i].clone_from(&data.act_dot);
    }
    s.error.clear();
    s.error.resize(2 * nv, 0.0);
    let (position, velocity) = s.error.split_at_mut(nv);
    for i in 0..6 {
        add_scaled(position, h * (B[i] - B_EMBEDDED[i]), &s.rate[i]);
        add_scaled(velocity, h * (B[i] - B_EMBEDDED[i]), &s.acc[i]);
    }
    s.displace(model, &B, h, state);
    s.act_sum.clear();
    s.act_sum.resize(model.na, 0.0);
    (0..6).for_each(|i| add_scaled(&mut s.act_sum, B[i], &s.act_dot[i]));
    state.act.copy_from_slice(&s.act);
    actuation::advance(model, &s.act_sum, h, &mut state.act);
    if method.contact.start == Start::Acceleration {
        state.qacc_warmstart.copy_from_slice(&data.qacc);
    }
    state.time = time + h;
    data.scratch.put(s);
}

impl Stages {
    /// q ⊕ h Σ w k and v + h Σ w a from the start of the step; the displacement is left in `turn`.
    fn displace(&mut self, model: &Model, weights: &[f64], h: f64, state: &mut State) {
        let Stages { qpos, qvel, rate, acc, turn, .. } = self;
        turn.clear();
        turn.resize(model.nv, 0.0);
        state.qvel.copy_from_slice(qvel);
        for (i, w) in weights.iter().enumerate() {
            add_scaled(turn, h * w, &rate[i]);
            add_scaled(&mut state.qvel, h * w, &acc[i]);
        }
        state.qpos.copy_from_slice(qpos);
        displace(model, &mut state.qpos, turn, 1.0);
    }
}

/// The method on ẏ = L y, column by column of A(h).
fn amplification(spring: &DampedSpring, h: f64) -> Matrix2 {
    let rate = |[x, v]: [f64; 2]| [v, -spring.stiffness() * x - spring.damping() * v];
    let mut matrix = [[0.0; 2]; 2];
    for column in 0..2 {
        let start = [f64::from(column == 0), f64::from(column == 1)];
        let mut k = [[0.0; 2]; 6];
        let along = |weights: &[f64], k: &[[f64; 2]; 6]| {
            [0, 1].map(|n| start[n] + h * weights.iter().zip(k).map(|(w, k)| w * k[n]).sum::<f64>())
        };
        for i in 0..6 {
            k[i] = rate(along(&A[i][..i.min(5)], &k));
        }
        let end = along(&B, &k);
        matrix[0][column] = end[0];
        matrix[1][column] = end[1];
    }
    matrix
}
