//! Controlled steps, and the search for the cheapest method that has an accuracy.

use penny::contact;
use penny::control::{Controlled, Failed};
use penny::forward::{Method, ROUNDS};
use penny::integrate::{self, cash_karp, extrapolated};
use penny::model::Model;
use penny::state::State;
use penny_lab::accuracy::{self, Stepping, horizon};
use penny_lab::explain::Budget;
use penny_lab::sweep::Case;
use penny_lab::sweep::trajectory::distance;

use crate::sim::Sim;

fn model(path: &str) -> Model {
    let text = std::fs::read_to_string(crate::file(path)).expect(path);
    penny::parse(path, &text).unwrap_or_else(|failure| panic!("{failure}")).model
}

fn method(law: &str, integrator: &str, timestep: f64) -> Method {
    let contact = contact::by_name(law).expect("law");
    let integrator = integrate::by_name(integrator).expect("integrator");
    Method { contact, integrator, timestep, rounds: ROUNDS }
}

/// A mass on a spring, 10 rad/s, without and with a damper, and a top: their motion is known, or smooth.
const SPRING: &str = r#"<mujoco><option gravity="0 0 0"/><worldbody><body><joint type="slide" axis="1 0 0" stiffness="100"/>
    <geom size="0.1" mass="1" contype="0" conaffinity="0"/></body></worldbody></mujoco>"#;

/// The largest errors of q and v after one step from (1, 0), and what the integrator says of them.
fn one_step(integrator: &str, timestep: f64) -> [f64; 2] {
    let mut sim = Sim::with(Sim::new(SPRING).model, "penalty", integrator);
    sim.method.timestep = timestep;
    sim.state.qpos[0] = 1.0;
    sim.step();
    let (x, v) = ((10.0 * timestep).cos(), -10.0 * (10.0 * timestep).sin());
    // Velocities by 10 rad/s, so that both count alike.
    let error = (sim.state.qpos[0] - x).abs().max(0.1 * (sim.state.qvel[0] - v).abs());
    let estimate = sim.method.integrator.estimate.expect("an estimate");
    let [q, v] = estimate(&mut sim.data) else { panic!("two numbers for one dof") };
    [error, q.abs().max(0.1 * v.abs())]
}

#[test]
fn estimates_are_of_the_order_below_the_method_and_never_too_small() {
    for integrator in [&cash_karp::METHOD, &extrapolated::METHOD] {
        let [coarse, fine] = [0.02, 0.01].map(|h| one_step(integrator.name, h));
        let order = (coarse[1] / fine[1]).log2();
        let name = integrator.name;
        assert!((order - f64::from(integrator.order)).abs() < 0.2, "{name}: the estimate's order is {order}");
        assert!(fine[1] > fine[0], "{name}: error {:e}, estimate {:e}", fine[0], fine[1]);
        let order = (coarse[0] / fine[0]).log2();
        assert!(order > f64::from(integrator.order) + 0.8, "{name}: the local error's order is {order}");
    }
}

#[test]
fn looking_does_not_disturb_the_steps_and_rejected_steps_leave_nothing() {
    let model = model("models/box.xml");
    let start = State::new(&model);
    for law in contact::ALL {
        let method = Method { contact: law, ..method("penalty", "cash-karp", 1e-3) };
        let controlled = || Controlled::new(&model, &method, &start, 1e-6, 1.5).expect("a run");
        let (mut once, mut often) = (controlled(), controlled());
        let end = once.at(1.5, 100_000).expect("the end");
        for i in 1..=150 {
            let state = often.at(0.01 * f64::from(i), 100_000).expect("a look");
            assert_eq!(state.time, 0.01 * f64::from(i));
        }
        assert_eq!(once.effort(), often.effort(), "{}", law.name);
        assert_eq!(once.state().qpos, often.state().qpos, "{}", law.name);
        assert_eq!(end.qpos, often.state().qpos, "{}", law.name);
        assert!(once.effort().rejected > 0, "{}: nothing was taken back, so nothing was tested", law.name);
    }
}

#[test]
fn what_is_wanted_is_had() {
    for (scene, seconds) in [("box", 0.5), ("disk", 0.5), ("pendulum", 1.0), ("top", 0.5)] {
        let model = model(&format!("models/{scene}.xml"));
        let case = Case { start: State::new(&model), model, seconds };
        for law in ["penalty", "mujoco"] {
            let law = contact::by_name(law).expect("law");
            let choose = |wanted| accuracy::choose(&case, law, wanted, &Budget::unlimited());
            let truth = choose(1e-7).unwrap_or_else(|refusal| panic!("{scene}, {}: {refusal}", law.name));
            for wanted in [1e-2, 1e-4, 3e-6] {
                let choice = choose(wanted).unwrap_or_else(|refusal| panic!("{scene}, {}: {refusal}", law.name));
                let error = distance(&case.model, &choice.samples, &truth.samples).expect("both reach the end");
                assert!(error <= wanted, "{scene}, {}: {error:e} where {wanted:e} was wanted", law.name);
            }
        }
    }
}

/// 100 m onto 1e9 N/m; undamped, so that the energy says how good the bounce was.
#[test]
fn a_fall_onto_something_hard_is_within_tolerance_by_few_steps() {
    let sim = Sim::new(
        r#"<mujoco><worldbody><geom type="plane" size="1 1 1"/><body pos="0 0 100.1"><joint type="slide" axis="0 0 1"/>
        <geom size="0.1" mass="1" solref="-1e9 0" solimp="0.99 0.99 0.001"/></body></worldbody></mujoco>"#,
    );
    let method = method("mujoco", "cash-karp", 1e-3);
    let energy = |state: &State| 9.81 * (100.0 + state.qpos[0]) + 0.5 * state.qvel[0].powi(2);
    let mut run = Controlled::new(&sim.model, &method, &sim.state, 1e-9, 9.0).expect("a run");
    let end = run.at(9.0, 100_000).unwrap_or_else(|failed| panic!("{failed}"));
    assert!((energy(&end) / 981.0 - 1.0).abs() < 1e-6, "energy {}", energy(&end));
    assert!(run.effort().steps < 5000, "{:?}", run.effort());
}

/// A ball that bounces without loss on a fixed ball: from x to the side it comes back at
///
///     u' = u + a x,   x' = x + T u',     a = 2 v/R,  T = 2 v/g,  R the distance of the centres
///
/// so a difference grows by λ = 1 + a T/2 + √((a T/2)² + a T) a bounce, in a time T.
#[test]
fn the_growth_of_errors_of_a_ball_on_a_ball_is_the_closed_form_s() {
    let sim = Sim::new(
        r#"<mujoco><worldbody><geom size="0.5" solref="-1e7 0" solimp="0.99 0.99 0.001"/>
        <body pos="0 0 1.1"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>
        <geom size="0.1" mass="1" condim="1" solref="-1e7 0" solimp="0.99 0.99 0.001"/></body></worldbody></mujoco>"#,
    );
    let (g, distance, height) = (9.81, 0.6, 0.5);
    let v = f64::sqrt(2.0 * g * height);
    let (a, period) = (2.0 * v / distance, 2.0 * v / g);
    let half = 0.5 * a * period;
    let exponent = (1.0 + half + (half * half + 2.0 * half).sqrt()).ln() / period;
    let case = Case { start: sim.state, model: sim.model, seconds: 14.0 * period };
    let growth =
        horizon::growth(&case, &method("mujoco", "cash-karp", 1e-3), Stepping::Controlled(1e-9)).expect("a run");
    let found = growth.exponent();
    assert!((found / exponent - 1.0).abs() < 0.1, "{found} where {exponent} is right");
    let horizon = growth.horizon(1e-6).expect("a horizon");
    let said = (1e-6f64 / 1e-15).ln() / exponent;
    assert!((horizon / said - 1.0).abs() < 0.4, "horizon {horizon} where about {said} is right");
}

#[test]
fn what_nothing_can_give_is_refused_with_the_time_until_which_it_can_be_had() {
    let sim = Sim::new(
        r#"<mujoco><worldbody><body><joint axis="0 1 0"/><geom type="capsule" fromto="0 0 0 1 0 0" size="0.02" contype="0"
        conaffinity="0"/><body pos="1 0 0"><joint axis="0 1 0"/><geom type="capsule" fromto="0 0 0 1 0 0" size="0.02"
        contype="0" conaffinity="0"/></body></body></worldbody></mujoco>"#,
    );
    let case = Case { start: sim.state, model: sim.model, seconds: 60.0 };
    let refusal = accuracy::choose(&case, contact::default(), 1e-8, &Budget::unlimited()).expect_err("it is chaotic");
    assert!(refusal.until > 1.0 && refusal.until < 40.0, "{refusal:?}");
}

#[test]
fn a_run_that_cannot_be_is_told() {
    let sim = Sim::new(SPRING);
    let fails = |integrator: &str, tolerance: f64, end: f64| {
        Controlled::new(&sim.model, &method("penalty", integrator, 1e-3), &sim.state, tolerance, end).err()
    };
    assert_eq!(fails("rk4", 1e-3, 1.0), Some(Failed::NoEstimate("rk4")));
    assert!(matches!(fails("cash-karp", 1e-3, -1.0), Some(Failed::Step(_))));
    for tolerance in [0.0, -1.0, f64::NAN] {
        assert!(matches!(fails("cash-karp", tolerance, 1.0), Some(Failed::Tolerance(_))), "{tolerance}");
    }
    let method = method("penalty", "cash-karp", 1e-3);
    let mut run = Controlled::new(&sim.model, &method, &sim.state, 1e-3, 1.0).expect("a run");
    run.at(0.9, 1000).expect("a look");
    for time in [-0.1, 0.0, 1.5, f64::NAN] {
        assert!(matches!(run.at(time, 1000), Err(Failed::Outside(..))), "{time}");
    }
    run.at(1.0, 1000).expect("the end");
    let mut run = Controlled::new(&sim.model, &method, &sim.state, 1e-12, 10.0).expect("a run");
    assert!(matches!(run.at(10.0, 5), Err(Failed::TooManySteps(5, _))));
}
