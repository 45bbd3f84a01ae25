//! Extremes: physics that must still hold far from ordinary numbers, and a divergence report where it cannot.

use penny::contact::constants::Spring;
use penny::contact::describe::Ask;
use penny::contact::{self, Law};
use penny::data::Data;
use penny::dynamics::energy;
use penny::forward::{Method, StepError, step};
use penny::integrate;
use penny::model::Model;
use penny::state::State;
use penny_lab::explain;
use penny_lab::sweep::theory;

use crate::sim::Sim;

struct Run {
    model: Model,
    method: Method,
    state: State,
    data: Data,
}

impl Run {
    fn new(xml: &str, law: &'static Law, timestep: f64) -> Run {
        let mut model = penny::parse("extremes.xml", xml).unwrap_or_else(|e| panic!("{e}")).model;
        // MuJoCo's tolerance is relative to the scene's inertia: at its default a ball of 1e4 m rests 0.7 % off.
        model.edit(|m| m.opt.tolerance = 0.0).expect("finite");
        let integrator = integrate::by_name(&model.opt.integrator).expect("integrator");
        let (state, data) = (State::new(&model), Data::new(&model));
        Run {
            method: Method { contact: law, integrator, timestep, rounds: penny::forward::ROUNDS },
            model,
            state,
            data,
        }
    }

    fn with(mut self, qvel: &[f64]) -> Run {
        self.state.qvel.copy_from_slice(qvel);
        self
    }

    /// Runs; whatever comes of it, no number is lost in silence.
    fn steps(&mut self, steps: usize) -> Result<(), StepError> {
        for _ in 0..steps {
            step(&self.model, &self.method, &mut self.state, &mut self.data)?;
            let numbers = self.state.qpos.iter().chain(&self.state.qvel);
            assert!(numbers.into_iter().all(|x| x.is_finite()), "a number was lost without a report: {:?}", self.state);
        }
        Ok(())
    }

    #[track_caller]
    fn seconds(&mut self, seconds: f64) {
        let steps = (seconds / self.method.timestep).round() as usize;
        let law = self.method.contact.name;
        self.steps(steps).unwrap_or_else(|diverged| panic!("{law}, h {}: {diverged:?}", self.method.timestep));
    }

    fn energy(&self) -> f64 {
        let e = energy::energy(&self.model, &self.state, &mut Data::new(&self.model));
        e.kinetic + e.potential
    }
}

/// The spring that a law makes of a ball of 1 kg with this solref, and the one that MuJoCo does.
fn springs(law: &'static Law, solref: &str) -> (Option<[Spring; 2]>, [Spring; 2]) {
    let run = Run::new(&ball("", &format!(r#"solref="{solref}""#), r#"size="0.1" mass="1""#), law, 2e-3);
    let touch = explain::touches(&run.model).swap_remove(0);
    let ask = Ask { model: &run.model, touch: &touch, timestep: 2e-3, slope: 0.0 };
    ((law.describe)(&ask).springs, touch.springs(&run.model, 2e-3))
}

/// The laws that take a contact's parameters from solref and solimp, as MuJoCo does.
fn laws() -> impl Iterator<Item = &'static Law> {
    let soft = |law: &&'static Law| {
        let (own, soft) = springs(law, "0.02 1");
        own == Some(soft)
    };
    contact::ALL.iter().copied().filter(soft)
}

/// Those and all others whose spring follows the scene's solref: bounds that fit the scene's contacts fit theirs.
fn laws_of_the_scene() -> impl Iterator<Item = &'static Law> {
    contact::ALL.iter().copied().filter(|law| springs(law, "0.02 1").0 != springs(law, "0.1 1").0)
}

#[test]
fn the_laws_that_are_tested_here_are_those_that_follow_the_scene() {
    assert!(laws().count() >= 2 && laws_of_the_scene().count() > laws().count());
}

fn ball(option: &str, geom: &str, body: &str) -> String {
    format!(
        r#"<mujoco><option cone="elliptic" {option}/><default><geom {geom}/></default><worldbody>
           <geom type="plane" size="1 1 1"/><body pos="0 0 0.2"><freejoint/><geom type="sphere" {body}/></body>
           </worldbody></mujoco>"#
    )
}

#[test]
fn stiffness_over_twelve_decades_is_stable_below_the_predicted_limit_and_never_lost_above() {
    for law in laws() {
        for decade in 0..=12 {
            let k = 10f64.powi(decade);
            let geom = format!(r#"solref="-{k} -{}" solimp=".95 .95 .001" condim="1""#, 2.0 * k.sqrt());
            let xml = ball("", &geom, r#"size="0.1" mass="1""#);
            let mut run = Run::new(&xml, law, 1e-3);
            let spring = &theory::springs(&run.model, &run.method)[0];
            let limit = theory::limit(run.method.integrator, spring).expect("known to the theory");
            let before = run.energy();
            let outcome = run.steps(3000);
            // Near the limit it may ring; a fifth below it nothing may be gained.
            if run.method.timestep < 0.8 * limit {
                assert!(outcome.is_ok() && run.energy() <= before, "{}: k {k:e}, limit {limit:e}", law.name);
            }
        }
    }
}

#[test]
fn an_elastic_collision_keeps_momentum_at_every_mass_ratio() {
    for law in laws() {
        for decade in [-9, -6, -3, 0, 3, 6, 9] {
            let m = 10f64.powi(decade);
            let xml = format!(
                r#"<mujoco><option gravity="0 0 0"/>
                <default><geom condim="1" solref="-1e4 0" solimp=".9999 .9999 .001"/></default><worldbody>
                <body><joint type="slide" axis="1 0 0"/><geom type="sphere" size="0.1" mass="1"/></body>
                <body pos=".201 0 0"><joint type="slide" axis="1 0 0"/><geom type="sphere" size="0.1" mass="{m}"/></body>
                </worldbody></mujoco>"#
            );
            let mut run = Run::new(&xml, law, 1e-4).with(&[1.0, 0.0]);
            run.seconds(0.1);
            let exact = [(1.0 - m) / (1.0 + m), 2.0 / (1.0 + m)];
            // The impedance of .9999 costs 1e-4, and a step of ω h = 0.01 another few 1e-3 of the relative speed.
            for (v, exact) in run.state.qvel.iter().zip(exact) {
                assert!((v - exact).abs() < 3e-3, "{}: ratio {m:e}: {v}, exact {exact}", law.name);
            }
            let momentum = run.state.qvel[0] + m * run.state.qvel[1];
            assert!((momentum - 1.0).abs() < 1e-9 * (1.0 + m), "{}: ratio {m:e}: {momentum}", law.name);
        }
    }
}

#[test]
fn free_fall_is_exact_at_every_timestep() {
    for h in [1e-7, 1e-5, 1e-3, 0.1, 1.0] {
        let xml = ball("", "", r#"size="0.1" contype="0" conaffinity="0""#);
        let mut run = Run::new(&xml, contact::ALL[0], h);
        let n = 1000.0;
        run.steps(1000).expect("free fall");
        let exact = 0.2 - 9.81 * h * h * n * (n + 1.0) / 2.0;
        // A thousand additions.
        assert!((run.state.qpos[2] - exact).abs() <= 1e-13 * exact.abs().max(0.2), "h {h}: {}", run.state.qpos[2]);
    }
}

#[test]
fn a_contact_that_refsafe_guards_gains_nothing_at_any_timestep() {
    for law in laws() {
        for h in [1e-5, 1e-3, 0.01, 0.1, 0.3, 1.0] {
            let mut run = Run::new(&ball("", r#"condim="3""#, r#"size="0.1" mass="1""#), law, h);
            // Semi-implicit Euler holds the energy at half steps: m g v h/2 of it is in doubt, v ≤ g h + √(2 g 0.1 m).
            let doubt = 9.81 * h * (9.81 * h + 1.5);
            let before = run.energy();
            run.steps(2000).unwrap_or_else(|d| panic!("{} h {h}: {d:?}", law.name));
            assert!(run.energy() <= before + doubt, "{} h {h}: {} J of {before} J", law.name, run.energy());
        }
    }
}

#[test]
fn nothing_falls_through_a_plane_at_any_speed() {
    for law in laws() {
        for speed in [1e2, 1e4, 1e6] {
            let mut run = Run::new(&ball("", r#"condim="1""#, r#"size="0.1" mass="1""#), law, 2e-3);
            run.state.qvel[2] = -speed;
            run.seconds(1.0);
            let (z, v) = (run.state.qpos[2], run.state.qvel[2]);
            assert!(z > -0.1 && v.abs() <= speed, "{} {speed:e} m/s: z {z}, v {v}", law.name);
        }
    }
}

#[test]
fn a_body_of_any_size_rests_at_the_same_depth() {
    // (1 − d) g (τζ)²: mass and size cancel.
    let depth = 0.05 * 9.81 * 0.02f64.powi(2);
    for law in laws() {
        for size in [1e-6, 1e-3, 1.0, 1e4] {
            let xml = format!(
                r#"<mujoco><option cone="elliptic"/><default><geom solimp=".95 .95 .001"/></default><worldbody>
                <geom type="plane" size="1 1 1"/><body pos="0 0 {size}"><freejoint/>
                <geom type="sphere" size="{size}" mass="1"/></body></worldbody></mujoco>"#
            );
            let mut run = Run::new(&xml, law, 2e-3);
            run.seconds(1.0);
            let found = size - run.state.qpos[2];
            // Cancellation: 1e-16 of the size.
            assert!((found - depth).abs() < 1e-9 * depth + 1e-14 * size, "{} {size:e} m: {found:e}", law.name);
        }
    }
}

#[test]
fn friction_of_zero_never_brakes_and_of_a_thousand_never_slips() {
    for law in laws() {
        let slide = |mu: f64| format!(r#"condim="3" friction="{mu} 0 0" solimp=".95 .95 .001""#);
        let mut run = Run::new(&ball("", &slide(0.0), r#"size="0.1" mass="1""#), law, 2e-3);
        run.state.qpos[2] = 0.0998;
        run.state.qvel[0] = 5.0;
        run.seconds(2.0);
        // MuJoCo's least friction is 1e-5: 1e-5 g t = 2e-4 m/s.
        assert!((run.state.qvel[0] - 5.0).abs() < 3e-4, "{}: {}", law.name, run.state.qvel[0]);
    }
    let slope = r#"gravity="5 0 -8.5""#;
    let penalty = contact::by_name("penalty").expect("law");
    let geom = r#"condim="3" friction="1000 0 0" solimp=".95 .95 .001""#;
    let mut run = Run::new(&ball(slope, geom, r#"size="0.1" mass="1""#), penalty, 2e-3);
    run.seconds(2.0);
    let slip = run.state.qvel[0] - 0.1 * run.state.qvel[4];
    assert!(slip.abs() < 1e-6 * run.state.qvel[0], "slip {slip:e}");
}

#[test]
fn gravity_of_nothing_and_of_a_thousand_earths() {
    for law in laws() {
        let body = r#"size="0.1" mass="1""#;
        let mut run = Run::new(&ball(r#"gravity="0 0 0""#, "", body), law, 2e-3);
        run.state.qvel[0] = 1.0;
        run.seconds(10.0);
        assert!((run.state.qpos[0] - 10.0).abs() < 1e-10 && run.state.qpos[2] == 0.2, "{}", law.name);
        let mut run = Run::new(&ball(r#"gravity="0 0 -1e4""#, r#"solimp=".95 .95 .001""#, body), law, 2e-3);
        run.seconds(2.0);
        let depth = 0.1 - run.state.qpos[2];
        assert!((depth - 0.05 * 1e4 * 0.02f64.powi(2)).abs() < 1e-9, "{}: {depth}", law.name);
    }
}

#[test]
fn a_body_that_starts_half_in_the_ground_is_pushed_out_and_rests() {
    for law in laws() {
        let xml = r#"<mujoco><option cone="elliptic"/><default><geom solimp=".95 .95 .001"/></default><worldbody>
            <geom type="plane" size="1 1 1"/><body><freejoint/><geom type="box" size=".1 .1 .1" mass="1"/></body>
            </worldbody></mujoco>"#;
        let mut run = Run::new(xml, law, 2e-3);
        let mut highest = 0.0f64;
        for _ in 0..2500 {
            run.steps(1).unwrap_or_else(|d| panic!("{}: {d:?}", law.name));
            highest = highest.max(run.state.qpos[2]);
        }
        // Critically damped, but it may leave the ground with what speed it has then: x/(e τ) at most.
        assert!(highest < 0.1 + (0.1f64 / 0.02 / 2.7).powi(2) / (2.0 * 9.81), "{}: thrown to {highest}", law.name);
        let depth = 0.1 - run.state.qpos[2];
        assert!((depth - 0.05 * 9.81 * 4e-4 / 4.0).abs() < 1e-8, "{}: rests {depth:e} deep", law.name);
    }
}

#[test]
fn spin_of_a_hundred_thousand_radians_a_second() {
    for law in laws() {
        let mut run = Run::new(&ball(r#"gravity="0 0 0""#, "", r#"size="0.1" mass="1""#), law, 1e-4);
        run.state.qvel[3..6].copy_from_slice(&[6e4, 8e4, 0.0]);
        run.seconds(1.0);
        let spin = (run.state.qvel[3].hypot(run.state.qvel[4]), run.state.qvel[5]);
        assert!((spin.0 - 1e5).abs() < 1e-4 && spin.1.abs() < 1e-4, "{}: {spin:?}", law.name);
        let norm: f64 = run.state.qpos[3..7].iter().map(|x| x * x).sum();
        assert!((norm - 1.0).abs() < 1e-12, "{}: quaternion {norm}", law.name);
    }
    // On the ground it drives off, and energy only falls.
    let penalty = contact::by_name("penalty").expect("law");
    let geom = r#"condim="3" friction="0.5 0 0""#;
    let mut run = Run::new(&ball("", geom, r#"size="0.1" mass="1""#), penalty, 1e-4);
    run.state.qpos[2] = 0.0998;
    run.state.qvel[4] = 1e5;
    let before = run.energy();
    run.seconds(2.0);
    assert!(run.energy() < before);
    // Friction is all that drives: μ g t.
    assert!((run.state.qvel[0] - 0.5 * 9.81 * 2.0).abs() < 0.01, "{}", run.state.qvel[0]);
}

#[test]
fn ten_minutes_leave_a_pendulum_its_energy_and_a_box_its_place() {
    let pendulum = r#"<mujoco><option integrator="RK4"/><worldbody><body><joint type="hinge" axis="0 1 0"/>
        <geom type="sphere" size=".1" pos="0 0 -1" mass="1" contype="0" conaffinity="0"/></body></worldbody></mujoco>"#;
    let mut run = Run::new(pendulum, contact::ALL[0], 2e-3);
    run.state.qpos[0] = 1.0;
    let before = run.energy();
    run.seconds(600.0);
    // RK4 loses about (ω h)⁶/144 a step: 6e-8 over 3e5 steps, of 4.5 J.
    assert!((run.energy() - before).abs() < 1e-6, "{:e}", run.energy() - before);

    let box_at_rest = r#"<mujoco><option cone="elliptic"/><worldbody><geom type="plane" size="1 1 1"/>
        <body pos="0 0 .0999"><freejoint/><geom type="box" size=".1 .1 .1" mass="1"/></body></worldbody></mujoco>"#;
    for law in laws() {
        let mut run = Run::new(box_at_rest, law, 2e-3);
        run.seconds(10.0);
        let rest = run.state.qpos.clone();
        run.seconds(590.0);
        let moved = rest.iter().zip(&run.state.qpos).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(moved < 1e-9, "{}: {moved:e}", law.name);
    }
}

#[test]
fn what_must_diverge_reports_what_and_when() {
    for law in contact::ALL {
        let xml = r#"<mujoco><option gravity="0 0 0"/><worldbody><body><joint type="slide" stiffness="1e6"/>
            <geom type="sphere" size=".1" mass="1"/></body></worldbody></mujoco>"#;
        let mut run = Run::new(xml, law, 0.01).with(&[1.0]);
        let error = run.steps(1000).expect_err("h ω = 10 is five times too much");
        let StepError::Diverged(diverged) = error else { panic!("{error}") };
        assert!(
            diverged.body == 1 && diverged.time > 0.0 && (diverged.value.is_nan() || diverged.value.abs() > 1e10),
            "{diverged:?}"
        );
    }
}

/// Forces that jump: dampers that switch on at touch, friction at first contact, torques with the sign of a spin. An
/// implicit step that finds no end for them must not forget gravity, or the ground.
#[test]
fn implicit_euler_comes_to_the_same_motion_where_forces_jump() {
    for (name, qvel) in [
        ("disk", [0.0; 6]),
        ("disk", [2.0, 0.0, 0.0, 0.0, 10.0, 0.0]),
        ("disk_traction", [2.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
    ] {
        let xml = std::fs::read_to_string(crate::file(&format!("models/{name}.xml"))).expect("a scene");
        for law in laws_of_the_scene() {
            let end = |integrator: &str, h: f64| {
                let mut run = Run::new(&xml, law, h).with(&qvel);
                run.method.integrator = integrate::by_name(integrator).expect("integrator");
                let before = run.energy();
                for _ in 0..10 {
                    run.seconds(0.1);
                    assert!(run.energy() <= before, "{name}, {}, h {h}: {} J of {before}", law.name, run.energy());
                }
                run.state.qpos
            };
            let (ours, truth) = (end("implicit-euler", 2e-3), end("semi-implicit-euler", 2e-5));
            let off = ours.iter().zip(&truth).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            // First order: at 2 m/s and 10 rad/s a step of 2 ms is worth a few mm.
            assert!(off < 3e-3, "{name} {qvel:?}, {}: off by {off}", law.name);
        }
    }
}

/// Tendons and equalities that can move nothing, up to rounding: within a body of two parts, to a hinge's axis, to a ball's centre.
/// Under every law all goes as without them. (Bodies were thrown kilometres away.)
#[test]
fn what_moves_nothing_up_to_rounding_does_nothing() {
    let bodies = [
        r#"<body pos="0 0 1" euler="10 20 30"><freejoint/><geom size=".1" pos=".05 .02 .03"/><site name="p" pos="-.036 -.13 -.116"/>
        <body name="b" pos="-.0873 -.2231 -.0774" euler="5 6 7"><geom size=".05" contype="0"/><site name="q" pos=".1 .03 .07"/></body></body>"#,
        r#"<body name="b" pos="0 0 1" euler="10 20 30"><joint axis="1 2 3" pos=".05 .02 .03"/><geom size=".1" pos=".25 .02 .03"/>
        <site name="p" pos=".15 .22 .33"/></body><site name="q" pos=".5 .3 2"/>"#,
        r#"<body name="b" pos="0 0 1" euler="10 20 30"><joint type="ball" pos=".05 .02 .03"/><geom size=".1" pos=".25 .02 .03"/>
        <site name="p" pos=".05 .02 .03"/></body><site name="q" pos=".5 .3 2"/>"#,
    ];
    let tendon = r#"<tendon><spatial name="t" frictionloss=".1467" range="0 .1"><site site="p"/><site site="q"/></spatial></tendon>
        <equality><tendon tendon1="t" polycoef=".1"/></equality>"#;
    for (i, body) in bodies.iter().enumerate() {
        for law in ["penalty", "mujoco", "tutorial"] {
            let run = |rest: &str| {
                let mut sim = Sim::law(&format!("<mujoco><worldbody>{body}</worldbody>{rest}</mujoco>"), law);
                sim.state.qvel.fill(1.0);
                sim.run(1.0);
                (sim.state.qpos, sim.data.ties.len())
            };
            assert_eq!(run(tendon), run(""), "scene {i}, {law}");
        }
    }
    // Two parts of one body, held together by a `connect` as well.
    let held = r#"<equality><connect body1="b" anchor=".1 .2 .3" body2="a"/></equality>"#;
    let parts = bodies[0].replacen("<body ", r#"<body name="a" "#, 1);
    let mut sim = Sim::law(&format!("<mujoco><worldbody>{parts}</worldbody>{held}</mujoco>"), "penalty");
    sim.state.qvel.fill(1.0);
    sim.run(0.1);
    assert!(sim.data.ties.is_empty());
}

/// A wheel on an axle that is pressed onto the ground: the normal force moves nothing, up to rounding or the last digits of a
/// drawing, and friction stops the wheel. (It was 1e16 N, and beside it the wheel turned to and fro for ever.)
#[test]
fn a_wheel_that_is_pressed_onto_the_ground_stands() {
    for frame in ["", r#"pos=".37 .21 .13" euler="13 27 41""#] {
        for miss in ["0", "1e-9", "1e-6", "1e-5"] {
            let text = format!(
                r#"<mujoco><option gravity="0 0 0"/><worldbody><frame {frame}><geom type="plane" size="1 1 1"/>
                <body pos=".123 .456 .19"><joint axis="0 1 0"/><geom size=".2" pos="{miss} 0 0"/></body></frame></worldbody></mujoco>"#
            );
            let mut sim = Sim::law(&text, "penalty");
            sim.state.qvel[0] = 1.0;
            for _ in 0..50 {
                sim.step();
                assert!(sim.state.qvel[0].abs() < 1e-3, "{miss} {frame}: {} at {}", sim.state.qvel[0], sim.state.time);
            }
        }
    }
}

/// An ellipsoid on a hinge through its centre, wedged against a box: friction has the longer arm, so that the normal force cannot push
/// it out. (It was 1e13 N, and the ellipsoid had 1.6 MJ after a step.)
#[test]
fn what_is_wedged_stays() {
    let mut sim = Sim::law(
        r#"<mujoco><option gravity="0 0 0"/><worldbody><geom type="box" size=".0912 .0673 .1319" pos="0.0511 -0.1041 -0.2645" quat="-0.0773 0.2236 0.9269 -0.2914"/>
        <body><joint/><geom type="ellipsoid" size=".1803 .0636 .1676"/></body></worldbody></mujoco>"#,
        "penalty",
    );
    for _ in 0..50 {
        sim.step();
        assert!(!sim.data.contacts.is_empty() && sim.state.qvel[0].abs() < 1e-3, "{}", sim.state.qvel[0]);
    }
}
