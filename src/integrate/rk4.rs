use super::{Integrator, displace, rotations};
use crate::data::Data;
use crate::forward::{Method, forward};
use crate::math::{Vec3, vec3};
use crate::model::Model;
use crate::state::State;

pub const METHOD: Integrator = Integrator {
    name: "rk4",
    mjcf: &["RK4"],
    order: 4,
    about: "Runge–Kutta of fourth order, four evaluations a step: nearly conserves energy",
    advance,
};

/// Fractions of the step at which stages 2 to 4 stand, and the weights of all four in the result.
const STAGE: [f64; 3] = [0.5, 0.5, 1.0];
const WEIGHT: [f64; 4] = [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];

/// The classical Runge–Kutta method of fourth order, on rotations as Munthe-Kaas has it.
///
///     stage i:  q_i = q ⊕ h c_i v_(i−1),   v_i = v + h c_i a_(i−1),   a_i = a(q_i, v_i)
///     v ← v + h Σ b_i a_i,   q ← q ⊕ h Σ b_i k_i
///     k_i = v_i, but for angular velocities k_i = dexp⁻¹(θ_i, ω_i),   θ_i = h c_i ω_(i−1)
///
/// Source: MuJoCo 4.0 manual, Computation › Numerical integration; Munthe-Kaas, BIT 38 (1998).
fn advance(model: &Model, method: &Method, state: &mut State, data: &mut Data) {
    let (h, time) = (method.timestep, state.time);
    forward(model, method, state, data);
    state.remember(data);
    let Data { stages, qacc, .. } = data;
    stages.qpos.copy_from_slice(&state.qpos);
    stages.qvel.copy_from_slice(&state.qvel);
    for (i, (v, a)) in state.qvel.iter().zip(qacc.iter()).enumerate() {
        stages.vel[i] = WEIGHT[0] * v;
        stages.acc[i] = WEIGHT[0] * a;
    }
    for (c, b) in STAGE.into_iter().zip(&WEIGHT[1..]) {
        let step = c * h;
        state.time = time + step;
        state.qpos.copy_from_slice(&data.stages.qpos);
        displace(model, &mut state.qpos, &state.qvel, step);
        // The rotation that led here is still in qvel: correct with it while the new velocity replaces it.
        let Data { stages, qacc, .. } = data;
        for d in rotations(model) {
            let theta = step * vec3(&state.qvel[d..]);
            let next = Vec3::from_fn(|i, _| stages.qvel[d + i] + step * qacc[d + i]);
            let correction = dexp_inv(&theta, &next) - next;
            for i in 0..3 {
                stages.vel[d + i] += b * correction[i];
            }
        }
        for i in 0..model.nv {
            state.qvel[i] = stages.qvel[i] + step * qacc[i];
            stages.vel[i] += b * state.qvel[i];
        }
        forward(model, method, state, data);
        for (sum, a) in data.stages.acc.iter_mut().zip(&data.qacc) {
            *sum += b * a;
        }
    }
    let stages = &data.stages;
    state.qpos.copy_from_slice(&stages.qpos);
    displace(model, &mut state.qpos, &stages.vel, h);
    for i in 0..model.nv {
        state.qvel[i] = stages.qvel[i] + h * stages.acc[i];
    }
    state.time = time + h;
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
