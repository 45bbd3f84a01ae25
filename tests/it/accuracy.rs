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
    let (mut all, mut beyond) = (0, Vec::new());
    for (scene, seconds) in [("box", 0.5), ("disk", 0.5), ("pendulum", 1.0), ("top", 0.5)] {
        let model = model(&format!("models/{scene}.xml"));
        let case = Case { start: State::new(&model), model, seconds };
        for law in ["penalty", "mujoco"] {
            let law = contact::by_name(law).expect("law");
            let choose = |wanted| accuracy::choose(&case, law, wanted, &Budget::unlimited());
            let truth = choose(1e-6).unwrap_or_else(|refusal| panic!("{scene}, {}: {refusal}", law.name));
            for wanted in [1e-2, 1e-4, 1e-5] {
                let choice = choose(wanted).unwrap_or_else(|refusal| panic!("{scene}, {}: {refusal}", law.name));
                let error = distance(&case.model, &choice.samples, &truth.samples).expect("both reach the end");
                all += 1;
                beyond.extend((error > wanted).then(|| format!("{scene}, {}: {error:e} of {wanted:e}", law.name)));
            }
        }
    }
    assert!(beyond.is_empty(), "{beyond:?} of {all}");
}

/// A look between two steps is as good as a step that ends there: a top, whose rotations do not commute, and a spring.
#[test]
fn looks_between_steps_are_as_exact_as_the_steps() {
    let spring = Sim::new(SPRING);
    let mut pulled = spring.state.clone();
    pulled.qpos[0] = 1.0;
    let top = model("models/top.xml");
    let (start, key) = (State::new(&top), top.keyframes.first().map(|key| State::at(&top, key)));
    for (model, start) in [(&spring.model, &pulled), (&top, key.as_ref().unwrap_or(&start))] {
        let run = |tolerance| {
            Controlled::new(model, &method("penalty", "cash-karp", 1e-3), start, tolerance, 1.0).expect("a run")
        };
        let (mut coarse, mut fine) = (run(1e-6), run(1e-12));
        for i in 1..=997 {
            let time = f64::from(i) / 997.0;
            let [looked, exact] = [&mut coarse, &mut fine].map(|run| run.at(time, 100_000).expect("a look"));
            let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            let (q, v) = (apart(&looked.qpos, &exact.qpos), apart(&looked.qvel, &exact.qvel));
            assert!(q < 2e-5 && v < 1e-3, "{time} s: {q:e}, {v:e}");
        }
        assert!(coarse.effort().steps < 997 / 2, "most looks fall on steps: {:?}", coarse.effort());
    }
}

/// In steps longer than half its time constant a contact is softer than the scene says (`refsafe`): no controlled step of
/// MuJoCo's law may take that for the truth. The disk sinks by 5 µm, and would by centimetres.
#[test]
fn long_steps_do_not_soften_contacts() {
    let model = model("models/disk_traction.xml");
    let start = State::new(&model);
    let mut run = Controlled::new(&model, &method("mujoco", "cash-karp", 1e-3), &start, 1e-4, 10.0).expect("a run");
    let end = run.at(10.0, 100_000).expect("the end");
    assert!((end.qpos[2] - 0.1999).abs() < 1e-3, "{} m high", end.qpos[2]);
}

/// A slide beyond its limit from 0.20 s to 0.24 s, in a step that could go from 0.16 s to 0.47 s: only evaluations inside it see that.
#[test]
fn controlled_steps_see_what_touches_between_their_ends() {
    let text = r#"<mujoco><worldbody><body><joint type="slide" axis="0 0 1" range="-9 0.3"/>
        <geom size="0.05" mass="1" contype="0" conaffinity="0"/></body></worldbody></mujoco>"#;
    let mut sim = Sim::with(Sim::new(text).model, "mujoco", "rk4");
    sim.state.qvel[0] = 2.5;
    let controlled = method("mujoco", "cash-karp", 2e-3);
    let mut run = Controlled::new(&sim.model, &controlled, &sim.state, 1e-3, 1.0).expect("a run");
    let end = run.at(1.0, 1000).expect("the end");
    sim.method.timestep = 1e-4;
    (0..10_000).for_each(|_| sim.step());
    // Without the limit it ends 0.33 m higher.
    assert!((end.qpos[0] - sim.state.qpos[0]).abs() < 2e-3, "{} and {}", end.qpos[0], sim.state.qpos[0]);
}

#[test]
fn a_choice_runs_again_and_ends_where_its_trial_did() {
    let model = model("models/box.xml");
    let case = Case { start: State::new(&model), model, seconds: 0.5 };
    for (law, wanted) in [("mujoco", 1e-4), ("penalty", 1e-2)] {
        let law = contact::by_name(law).expect("law");
        let choice = accuracy::choose(&case, law, wanted, &Budget::unlimited()).expect("a choice");
        let states = choice.states(&case, &[0.1, 0.25, 0.5]).expect("states");
        assert_eq!(states.iter().map(|s| s.time).collect::<Vec<_>>()[..2], [0.1, 0.25]);
        let ends = states[2].qpos.iter().zip(&choice.end.qpos);
        assert!(ends.clone().all(|(a, b)| (a - b).abs() < 1e-12), "{:?}", ends.collect::<Vec<_>>());
        assert!(choice.states(&case, &[f64::INFINITY]).is_err(), "there is no state at the end of time");
    }
}

/// A ball that long steps carry through a thin wall, one that they carry past the ceiling it grazes, a rod that grazes its joint's
/// limit, and what only comes near, against steps of 10 µs.
#[test]
fn what_is_touched_between_two_steps_is_not_missed() {
    const WALL: &str = r#"<mujoco><option gravity="0 0 0"/><worldbody><geom type="box" size="0.005 1 1" pos="1 0 0"/>
        <body><joint type="slide" axis="1 0 0"/><geom size="0.02" mass="0.01"/></body></worldbody></mujoco>"#;
    const CEILING: &str = r#"<mujoco><worldbody><geom type="box" size="1 1 0.05" pos="0 0 0.6"/>
        <body><joint type="slide" axis="0 0 1"/><geom size="0.05" mass="1"/></body></worldbody></mujoco>"#;
    const LIMIT: &str = r#"<mujoco><worldbody><body><joint axis="0 1 0" range="-90 29.3"/>
        <geom type="capsule" fromto="0 0 0 0 0 -1" size="0.02"/></body></worldbody></mujoco>"#;
    // Limits without a shape, which steps of any length may cross.
    const SLIDE: &str = r#"<mujoco><worldbody><body><joint type="slide" axis="0 0 1" range="-9 0.3"/>
        <geom size="0.05" mass="1" contype="0" conaffinity="0"/></body></worldbody></mujoco>"#;
    const TENDON: &str = r#"<mujoco><worldbody><site name="a" pos="0 0 1"/><body pos="0 0 0.5"><joint type="slide" axis="0 0 1"/>
        <geom size="0.05" mass="1"/><site name="b"/></body></worldbody>
        <tendon><spatial range="0.2 9"><site site="a"/><site site="b"/></spatial></tendon></mujoco>"#;
    let scenes = [
        (SLIDE, 0.0, 2.5),
        (SLIDE, 0.0, 2.6),
        (TENDON, 0.0, 2.6),
        (WALL, 0.0, 2.0),
        (WALL, 0.0, 5.0),
        (CEILING, 0.0, 3.05),
        (CEILING, 0.0, 3.2),
        (LIMIT, -0.51, 0.0),
        (LIMIT, -0.52, 0.0),
    ];
    for (text, q, v) in scenes {
        let mut sim = Sim::with(Sim::new(text).model, "mujoco", "rk4");
        (sim.state.qpos[0], sim.state.qvel[0]) = (q, v);
        let case = Case { start: sim.state.clone(), model: sim.model.clone(), seconds: 1.0 };
        let law = contact::by_name("mujoco").expect("law");
        let choice = accuracy::choose(&case, law, 1e-3, &Budget::unlimited());
        let choice = choice.unwrap_or_else(|refusal| panic!("{text} from {q} at {v}: {refusal}"));
        sim.method.timestep = 1e-5;
        (0..100_000).for_each(|_| sim.step());
        let error = (choice.end.qpos[0] - sim.state.qpos[0]).abs();
        // Searches err by up to 2.9 times what is wanted where things touch; what misses a touch errs by 20 times that and more.
        assert!(error <= 3e-3, "{text} from {q} at {v}: {error:e} by {}", choice.method.integrator.name);
    }
}

/// A wall may stand elsewhere than in the file: it is a mocap body.
#[test]
fn what_is_touched_may_stand_where_the_state_says() {
    const SCENE: &str = r#"<mujoco><option gravity="0 0 0"/><worldbody>
        <body mocap="true" pos="90 0 0"><geom type="box" size="0.005 1 1"/></body>
        <body><joint type="slide" axis="1 0 0"/><geom size="0.02" mass="0.01"/></body></worldbody></mujoco>"#;
    let mut sim = Sim::new(SCENE);
    (sim.state.qvel[0], sim.state.mocap_pos[0]) = (5.0, [1.055, 0.0, 0.0]);
    let case = Case { start: sim.state.clone(), model: sim.model.clone(), seconds: 1.0 };
    let choice = accuracy::choose(&case, contact::default(), 1e-3, &Budget::unlimited());
    let x = choice.unwrap_or_else(|refusal| panic!("{refusal}")).end.qpos[0];
    sim.method.timestep = 1e-5;
    (0..100_000).for_each(|_| sim.step());
    // It is slowed down to half its speed.
    assert!((x - sim.state.qpos[0]).abs() < 3e-3, "{x} m, not {} m", sim.state.qpos[0]);
}

/// A ball that rolls, and so touches in every step, is not carried through a wall of a millimetre either.
#[test]
fn what_touches_the_ground_does_not_pass_through_a_wall() {
    const SCENE: &str = r#"<mujoco><default><geom solref="0.002 1"/></default><worldbody><geom type="plane" size="9 9 1"/>
        <geom type="box" size="0.0005 1 1" pos="1 0 1"/>
        <body pos="0 0 0.005"><freejoint/><geom size="0.005" mass="1"/></body></worldbody></mujoco>"#;
    for v in [2.0, 3.0] {
        let mut sim = Sim::new(SCENE);
        sim.state.qvel[0] = v;
        let case = Case { start: sim.state, model: sim.model, seconds: 1.0 };
        let choice = accuracy::choose(&case, contact::default(), 1e-2, &Budget::unlimited());
        let choice = choice.unwrap_or_else(|refusal| panic!("at {v}: {refusal}"));
        let x = choice.end.qpos[0];
        assert!((0.95..1.0).contains(&x), "at {v}: {x} m by {}", choice.method.integrator.name);
    }
}

/// One mass on a spring of 1e-2 to 1e10 N/m, and a light one between two heavy ones, a million times heavier.
#[test]
fn twelve_decades_of_stiffness_and_six_of_mass_are_within_tolerance_or_refused() {
    for exponent in (-2..=10).step_by(3) {
        let k = 10f64.powi(exponent);
        let sim = Sim::new(&SPRING.replace("\"100\"", &format!("\"{k}\"")));
        // A few periods, for the time that a run of 1 s has for the softest of them.
        let seconds = (20.0 / k.sqrt()).min(1.0);
        let mut start = sim.state.clone();
        start.qpos[0] = 0.1;
        let case = Case { start, model: sim.model, seconds };
        let choice = accuracy::choose(&case, contact::default(), 1e-4, &Budget::unlimited());
        let choice = choice.unwrap_or_else(|refusal| panic!("{k} N/m: {refusal}"));
        let error = (choice.end.qpos[0] - 0.1 * (k.sqrt() * seconds).cos()).abs();
        assert!(error <= 1e-4, "{k} N/m: {error:e}");
    }
    for ratio in [1e3, 1e6] {
        let sim = Sim::new(&format!(
            r#"<mujoco><worldbody><geom type="plane" size="1 1 1"/><body pos="0 0 0.1"><joint type="slide" axis="0 0 1"/>
            <geom size="0.1" mass="1" condim="1"/></body><body pos="0 0 0.31"><joint type="slide" axis="0 0 1"/>
            <geom size="0.1" mass="{ratio}" condim="1"/></body></worldbody></mujoco>"#
        ));
        let case = Case { start: sim.state, model: sim.model, seconds: 0.2 };
        let law = contact::by_name("mujoco").expect("law");
        let choose = |wanted| accuracy::choose(&case, law, wanted, &Budget::unlimited());
        match (choose(1e-4), choose(1e-6)) {
            (Ok(choice), Ok(truth)) => {
                let error = distance(&case.model, &choice.samples, &truth.samples).expect("both reach the end");
                assert!(error <= 1e-4, "{ratio}: {error:e}");
            }
            (Err(refusal), _) | (_, Err(refusal)) => assert!(refusal.trial < 40_000_000, "{refusal:?}"),
        }
    }
}

/// A ball that bounces to rest, each bounce shorter than the one before.
#[test]
fn bounces_without_end_come_to_rest_in_bounded_steps() {
    let sim = Sim::new(
        r#"<mujoco><worldbody><geom type="plane" size="1 1 1" solref="-1e6 -100"/><body pos="0 0 0.6">
        <joint type="slide" axis="0 0 1"/><geom size="0.1" mass="1" solref="-1e6 -100" condim="1"/></body></worldbody></mujoco>"#,
    );
    let start = sim.state.clone();
    let mut run = Controlled::new(&sim.model, &method("mujoco", "cash-karp", 1e-3), &start, 1e-8, 20.0).expect("a run");
    let end = run.at(20.0, 200_000).unwrap_or_else(|failed| panic!("{failed}"));
    assert!(end.qvel[0].abs() < 1e-5, "{:?} after {:?}", end.qvel, run.effort());
    assert_eq!(run.effort().forced, 0, "{:?}", run.effort());
}

/// A top that sleeps upright: ten minutes in the long form, ten seconds here, are a rotation about one axis.
#[test]
fn a_spinning_top_stays_within_tolerance() {
    let sim = Sim::new(
        r#"<mujoco><worldbody><body><joint type="ball"/><geom type="ellipsoid" size="0.1 0.1 0.05" pos="0 0 0.1" mass="1"
        contype="0" conaffinity="0"/></body></worldbody></mujoco>"#,
    );
    let seconds = if std::env::var_os("PENNY_LONG").is_some() { 600.0 } else { 10.0 };
    let mut start = sim.state.clone();
    start.qvel.copy_from_slice(&[0.0, 0.0, 100.0]);
    let mut run =
        Controlled::new(&sim.model, &method("penalty", "cash-karp", 1e-3), &start, 1e-9, seconds).expect("a run");
    let end = run.at(seconds, 10_000_000).unwrap_or_else(|failed| panic!("{failed}"));
    let half = 0.5 * 100.0 * seconds;
    let turned = 2.0 * (end.qpos[0] * half.sin() - end.qpos[3] * half.cos());
    assert!(turned.abs() < 1e-6 * seconds, "{turned:e} rad off: {:?}", end.qpos);
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

/// Two rods of 1 m, started level: the largest Lyapunov exponent of its motion, from a Runge–Kutta run of the textbook's equations
/// with the tangent flow, and so by another way than twins.
///
///     q̈ = M(q)⁻¹ (−C(q, q̇) − G(q)),   δ̇ = J δ by differences of the right-hand side,   λ = ln |δ|/t
///
/// Source: A. M. Calvão, T. J. P. Penna, European Journal of Physics 36 (2015), 045018 (exponents of double pendula).
#[test]
fn the_growth_of_errors_of_a_double_pendulum_is_its_lyapunov_exponent() {
    let sim = Sim::new(
        r#"<mujoco><worldbody><body><joint axis="0 1 0"/><inertial pos="0.5 0 0" mass="1" diaginertia="1e-9 0.0833333333 0.0833333333"/>
        <body pos="1 0 0"><joint axis="0 1 0"/><inertial pos="0.5 0 0" mass="1" diaginertia="1e-9 0.0833333333 0.0833333333"/>
        </body></body></worldbody></mujoco>"#,
    );
    let seconds = 60.0;
    let case = Case { start: sim.state.clone(), model: sim.model.clone(), seconds };
    let growth =
        horizon::growth(&case, &method("penalty", "cash-karp", 1e-3), Stepping::Controlled(1e-9)).expect("a run");
    let exponent = pendulum_exponent(seconds);
    let found = growth.log.last().expect("samples") / growth.times.last().expect("samples");
    assert!(exponent > 0.5, "it is chaotic: {exponent}");
    assert!((found / exponent - 1.0).abs() < 0.35, "{found} where {exponent} is right");
}

/// See above: a and b are the rods' angles from the vertical, b absolute; rods of 1 m and 1 kg.
fn pendulum_exponent(seconds: f64) -> f64 {
    let g = 9.81;
    let rate = |y: [f64; 4]| {
        let [a, b, u, v] = y;
        let (c, s) = ((a - b).cos(), (a - b).sin());
        // (1/3 + 1) ü + ½ c v̇ = −½ s v² − 3/2 g sin a;   ½ c u̇ + 1/3 v̇ = ½ s u² − ½ g sin b
        let (p, q) = (-0.5 * s * v * v - 1.5 * g * a.sin(), 0.5 * s * u * u - 0.5 * g * b.sin());
        let det = 4.0 / 9.0 - 0.25 * c * c;
        [u, v, (p / 3.0 - 0.5 * c * q) / det, (4.0 / 3.0 * q - 0.5 * c * p) / det]
    };
    let tangent = |y: [f64; 4], d: [f64; 4]| {
        let e = 1e-6;
        let [ahead, behind] = [e, -e].map(|e| rate(std::array::from_fn(|i| y[i] + e * d[i])));
        std::array::from_fn(|i| (ahead[i] - behind[i]) / (2.0 * e))
    };
    let along = |y: [f64; 4], h: f64, k: [f64; 4]| -> [f64; 4] { std::array::from_fn(|i| y[i] + h * k[i]) };
    let half = std::f64::consts::FRAC_PI_2;
    let (mut y, mut d, mut log) = ([half, half, 0.0, 0.0], [0.5, -0.3, 0.4, 0.2], 0.0);
    let (steps, norm) = ((seconds * 2000.0) as usize, |d: [f64; 4]| d.iter().map(|x| x * x).sum::<f64>().sqrt());
    log -= norm(d).ln();
    for _ in 0..steps {
        let h = seconds / steps as f64;
        let (k1, t1) = (rate(y), tangent(y, d));
        let (y2, d2) = (along(y, 0.5 * h, k1), along(d, 0.5 * h, t1));
        let (k2, t2) = (rate(y2), tangent(y2, d2));
        let (y3, d3) = (along(y, 0.5 * h, k2), along(d, 0.5 * h, t2));
        let (k3, t3) = (rate(y3), tangent(y3, d3));
        let (y4, d4) = (along(y, h, k3), along(d, h, t3));
        let (k4, t4) = (rate(y4), tangent(y4, d4));
        let sum = |k1: [f64; 4], k2: [f64; 4], k3: [f64; 4], k4: [f64; 4]| {
            std::array::from_fn(|i| (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]) / 6.0)
        };
        (y, d) = (along(y, h, sum(k1, k2, k3, k4)), along(d, h, sum(t1, t2, t3, t4)));
        let size = norm(d);
        log += size.ln();
        d = d.map(|x| x / size);
    }
    log / seconds
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
