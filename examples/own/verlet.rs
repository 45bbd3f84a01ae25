//! The integrator; see `own_integrator.rs`.

use penny::data::Data;
use penny::forward::{Method, forward};
use penny::integrate::{DampedSpring, Integrator, Matrix2, displace};
use penny::model::Model;
use penny::state::State;

pub static METHOD: Integrator = Integrator {
    name: "verlet",
    mjcf: &[],
    order: 2,
    about: "velocity Verlet: symplectic, of second order, two evaluations a step",
    implicit: false,
    implicit_dampers: penny::integrate::Dampers::None,
    advance,
    amplification: Some(amplification),
    estimate: None,
};

fn advance(model: &Model, method: &Method, state: &mut State, data: &mut Data) {
    let h = method.timestep;
    forward(model, method, state, data);
    // Scratch of the integrators: acceleration and velocity at the start, and the velocity in the middle of the step.
    data.stages.acc.copy_from_slice(&data.qacc);
    data.stages.qvel.copy_from_slice(&state.qvel);
    data.stages.rate.copy_from_slice(&state.qvel);
    kick(&mut data.stages.rate, 0.5 * h, &data.qacc);
    displace(model, &mut state.qpos, &data.stages.rate, h);
    kick(&mut state.qvel, h, &data.qacc);
    state.time += h;
    forward(model, method, state, data);
    state.remember(method.contact.start, data);
    state.qvel.copy_from_slice(&data.stages.qvel);
    kick(&mut state.qvel, 0.5 * h, &data.stages.acc);
    kick(&mut state.qvel, 0.5 * h, &data.qacc);
}

/// v ← v + t a
fn kick(v: &mut [f64], t: f64, a: &[f64]) {
    v.iter_mut().zip(a).for_each(|(v, a)| *v += t * a);
}

/// The step on a damped spring, a = −k x − c v, for (x, v) = (1, 0) and (0, 1).
fn amplification(spring: &DampedSpring, h: f64) -> Matrix2 {
    let (k, c) = (spring.stiffness(), spring.damping());
    let step = |x: f64, v: f64| {
        let a = -k * x - c * v;
        let x = x + h * (v + 0.5 * h * a);
        let after = -k * x - c * (v + h * a);
        [x, v + 0.5 * h * (a + after)]
    };
    let (first, second) = (step(1.0, 0.0), step(0.0, 1.0));
    [[first[0], second[0]], [first[1], second[1]]]
}
