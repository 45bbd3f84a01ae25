//! A contact law and an integrator that are not in the library go through all that looks at methods: the examples
//! `own_law` and `own_integrator`, each one file and one record.

use penny::contact::{self, Law, describe};
use penny::data::Data;
use penny::forward::{Method, step};
use penny::integrate;
use penny::model::Model;
use penny::state::State;
use penny_lab::explain::{self, probe};
use penny_lab::sweep::map::{self, Setting};
use penny_lab::sweep::{Case, theory};

#[path = "../../examples/own/hunt_crossley.rs"]
mod hunt_crossley;
#[path = "../../examples/own/verlet.rs"]
mod verlet;

static SILENT: Law = Law { name: "silent", describe: describe::nothing, ..hunt_crossley::LAW };

fn model(xml: &str) -> Model {
    penny::parse("own.xml", xml).unwrap_or_else(|e| panic!("{e}")).model
}

fn ball() -> Model {
    model(
        r#"<mujoco><worldbody><geom type="plane" size="1 1 1"/>
           <body pos="0 0 0.101"><freejoint/><geom size="0.1" mass="1"/></body></worldbody></mujoco>"#,
    )
}

fn method(contact: &'static Law) -> Method {
    let integrator = integrate::by_name("semi-implicit-euler").expect("an integrator");
    Method { contact, integrator, timestep: 1e-3, rounds: penny::forward::ROUNDS }
}

#[test]
fn an_own_law_rests_where_its_record_and_where_the_measurement_say() {
    let model = ball();
    let own = method(&hunt_crossley::LAW);
    let touch = explain::touches(&model).swap_remove(0);
    let formulas = explain::meaning(&model, &own, &touch, 0.1).formulas;
    let silent = explain::meaning(&model, &method(&SILENT), &touch, 0.1);
    assert_eq!(silent.formulas, describe::Description::default());
    let measured = silent.measured.expect("it holds a weight");
    let (mut state, mut data) = (State::new(&model), Data::new(&model));
    for _ in 0..20_000 {
        step(&model, &own, &mut state, &mut data).unwrap_or_else(|e| panic!("{e}"));
    }
    let depth = 0.1 - state.qpos[2];
    // What is left of the bounce after 20 s.
    assert!((formulas.rest_depth.expect("a formula") / depth - 1.0).abs() < 1e-3, "{depth}");
    let close = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-3;
    assert!(close(measured.rest_depth, depth) && !measured.approach_only, "{measured:?}");
    let [spring, _] = formulas.springs.expect("a formula");
    assert!(close(measured.spring.k, spring.k) && close(measured.spring.c, spring.c), "{measured:?} {spring:?}");
    // Both halves of an impact do the same work on the spring, ∫ k √d³ dd:  v − ln(1 + c v)/c = −u − ln(1 − c u)/c.
    let (c, v, u) = (0.3, probe::IMPACT, measured.restitution * probe::IMPACT);
    let work = [v - (1.0 + c * v).ln() / c, -u - (1.0 - c * u).ln() / c];
    // The step of the impact is halved until e changes by less than 1e-4; the work goes with e².
    assert!((work[1] / work[0] - 1.0).abs() < 1e-3, "{measured:?} {work:?}");
}

#[test]
fn an_own_laws_largest_timestep_is_measured_and_by_theory() {
    let model = ball();
    for contact in [&hunt_crossley::LAW, &SILENT] {
        let method = method(contact);
        let touch = explain::touches(&model).swap_remove(0);
        let measured = probe::largest_timestep(&model, &method, &touch).expect("a limit");
        let springs = theory::springs(&model, &method);
        assert_eq!(springs.len(), usize::from(contact.name != "silent"), "no spring is made up");
        for spring in springs {
            let theory = theory::limit(method.integrator, &spring).expect("a limit");
            // The search stops at 0.5 %; growth so close to the limit takes longer than the steps it looks at.
            assert!((measured / theory - 1.0).abs() < 0.02, "{measured} {theory}");
        }
    }
}

#[test]
fn an_own_integrator_has_order_and_limit_of_its_record() {
    let spring = model(
        r#"<mujoco><option gravity="0 0 0"/><worldbody><body>
           <joint type="slide" axis="1 0 0" stiffness="100" damping="2"/>
           <geom size="0.1" mass="1" contype="0" conaffinity="0"/></body></worldbody></mujoco>"#,
    );
    let mut start = State::new(&spring);
    start.qpos[0] = 1.0;
    let own = |timestep: f64| Method { integrator: &verlet::METHOD, timestep, ..method(contact::default()) };
    let limit = theory::limit(&verlet::METHOD, &theory::joint_springs(&spring)[0]).expect("an amplification");
    let case = Case { model: spring, start, seconds: 1.0 };
    let unstable = |h: f64| map::unstable(map::classify(&Setting { case: case.clone(), method: own(h) }));
    assert!(!unstable(0.99 * limit) && unstable(1.01 * limit), "{limit}");
    // ẍ = −100 x − 2 ẋ from (1, 0): e^−t (cos wt + sin wt / w), w = √99.
    let (w, t) = (99f64.sqrt(), 1.0);
    let exact = f64::exp(-t) * ((w * t).cos() + (w * t).sin() / w);
    let error = |steps: usize| {
        let (mut state, mut data) = (case.start.clone(), Data::new(&case.model));
        for _ in 0..steps {
            step(&case.model, &own(1.0 / steps as f64), &mut state, &mut data).unwrap_or_else(|e| panic!("{e}"));
        }
        (state.qpos[0] - exact).abs()
    };
    let order = (error(1000) / error(2000)).log2();
    assert!((order - f64::from(verlet::METHOD.order)).abs() < 0.1, "{order}");
}

/// A damper that acts on approach only: the piecewise map of the theory against runs of the law itself.
#[test]
fn the_tutorial_laws_limit_is_that_of_a_damper_on_approach_only() {
    let model = model(
        r#"<mujoco><custom><numeric name="penny.k" data="2500"/><numeric name="penny.c" data="20"/></custom>
           <worldbody><geom type="plane" size="1 1 1"/>
           <body pos="0 0 0.2"><freejoint/><geom size="0.1" mass="1"/></body></worldbody></mujoco>"#,
    );
    let mut compared = 0;
    for &integrator in integrate::ALL.iter().chain(&[&verlet::METHOD as &integrate::Integrator]) {
        let method = Method { integrator, ..method(contact::by_name("tutorial").expect("a law")) };
        let touch = explain::touches(&model).swap_remove(0);
        let spring = theory::springs(&model, &method).swap_remove(0);
        assert!(spring.approach_only);
        let Some(theory) = theory::limit(integrator, &spring) else { continue };
        let measured = probe::largest_timestep(&model, &method, &touch).expect("a limit");
        if theory.is_infinite() {
            // An extrapolated step from before the damper ends to behind it can gain, which no single map tells.
            assert!(measured == probe::LARGEST || integrator.order > 1, "{}: {measured}", integrator.name);
            continue;
        }
        // Several stages see several signs of the velocity, where the theory takes the one at the start of the step.
        let tolerance = if integrator.order > 1 { 0.1 } else { 0.02 };
        assert!((measured / theory - 1.0).abs() < tolerance, "{}: {measured} {theory}", integrator.name);
        compared += 1;
    }
    assert!(compared >= 3);
}
