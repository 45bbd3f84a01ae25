//! What `penny explain` says, against closed forms.

use penny::contact::{self, constants, tutorial};
use penny::data::Data;
use penny::forward::{Method, step};
use penny::integrate;
use penny::model::Model;
use penny::state::State;
use penny_lab::explain::{self, Touch, joints, probe, trial_run};
use penny_lab::sweep::theory;

/// A ball of 2 kg over a plane, with this solref and custom section.
fn ball(solref: &str, custom: &str) -> Model {
    let text = format!(
        r#"<mujoco><option cone="elliptic"/><custom>{custom}</custom>
           <default><geom solref="{solref}" solimp="0.95 0.95 0.001"/></default>
           <worldbody>
             <geom type="plane" size="1 1 1"/>
             <body pos="0 0 0.2"><freejoint/><geom size="0.1" mass="2"/></body>
           </worldbody></mujoco>"#
    );
    penny::parse("ball.xml", &text).unwrap_or_else(|e| panic!("{e}")).model
}

fn method(law: &str, integrator: &str) -> Method {
    Method {
        contact: contact::by_name(law).expect("a law"),
        integrator: integrate::by_name(integrator).expect("an integrator"),
        timestep: 0.002,
        rounds: penny::forward::ROUNDS,
    }
}

fn only_touch(model: &Model) -> Touch {
    let touches = explain::touches(model);
    assert_eq!(touches.len(), 1);
    touches[0].clone()
}

#[test]
fn a_ball_on_the_ground_means_mujocos_spring() {
    let (tau, zeta, m): (f64, f64, f64) = (0.1, 0.2, 2.0);
    let touch = only_touch(&ball("0.1 0.2", ""));
    let [spring, _] = touch.springs(&ball("0.1 0.2", ""), 0.002);
    // Roundings of a few multiplications.
    assert!((touch.mass - m).abs() < 1e-12 && (touch.estimate - 1.0).abs() < 1e-12);
    assert!((spring.k - m / (tau * zeta).powi(2)).abs() < 1e-9 * spring.k);
    assert!((spring.c - 2.0 * m / tau).abs() < 1e-12 * spring.c);
    let depth = touch.rest_depth(&ball("0.1 0.2", ""), 0.002);
    assert!((depth - 0.05 * 9.81 * (tau * zeta).powi(2)).abs() < 1e-12 * depth.max(1e-3), "{depth}");
}

#[test]
fn a_box_means_four_points_and_a_planar_body_its_own_estimate() {
    let scene = |joints: &str| {
        let text = format!(
            r#"<mujoco><worldbody><geom type="plane" size="1 1 1"/>
               <body pos="0 0 0.2">{joints}<geom type="box" size="0.2 0.1 0.1" mass="3"/></body></worldbody></mujoco>"#
        );
        only_touch(&penny::parse("box.xml", &text).unwrap_or_else(|e| panic!("{e}")).model)
    };
    let free = scene("<freejoint/>");
    assert_eq!((free.points, free.rests), (4, true));
    assert!((free.mass - 3.0).abs() < 1e-12 && (free.estimate - 1.0).abs() < 1e-12);
    // A corner at (a, b) from the centre: A = 1/m + b²/Ix + a²/Iy, I = m/3 (…): 1/m (1 + 3 b²/(b²+c²) + 3 a²/(a²+c²)).
    let a = (1.0 + 3.0 * 0.01 / 0.02 + 3.0 * 0.04 / 0.05) / 3.0;
    assert!((free.lightest - 1.0 / (4.0 * a)).abs() < 1e-12, "{}", free.lightest);
    let slides = r#"<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>"#;
    let planar = scene(&format!("{slides}<joint axis='0 1 0'/>"));
    // MuJoCo's mean over three directions knows that one of them is fixed: 2/(3m) instead of 1/m.
    assert!((planar.mass - 3.0).abs() < 1e-12 && (planar.estimate - 2.0 / 3.0).abs() < 1e-12);
}

/// A cylinder that stands, a capsule on its end and a box on an edge touch at the points at which they come to rest.
#[test]
fn what_never_turns_touches_as_it_stands() {
    for (geom, points) in [
        (r#"type="cylinder" size=".1 .1""#, 3),
        (r#"type="capsule" size=".1 .1""#, 1),
        (r#"type="box" size=".1 .1 .1" euler="45 0 0""#, 2),
    ] {
        let text = format!(
            r#"<mujoco><option cone="elliptic"/><worldbody><geom type="plane" size="1 1 1"/><body pos="0 0 .3">
               <joint type="slide" axis="0 0 1"/><geom {geom} mass="2"/></body></worldbody></mujoco>"#
        );
        let model = penny::parse("stands.xml", &text).unwrap_or_else(|e| panic!("{e}")).model;
        let touch = only_touch(&model);
        let (mut state, mut data) = (State::new(&model), Data::new(&model));
        for _ in 0..2000 {
            step(&model, &method("mujoco", "Euler"), &mut state, &mut data).unwrap_or_else(|e| panic!("{e}"));
        }
        let (depth, told) = (-data.contacts[0].dist, touch.rest_depth(&model, 0.002));
        assert!(touch.points == points && data.contacts.len() == points, "{geom}: {touch:?}");
        assert!((told / depth - 1.0).abs() < 1e-6, "{geom}: {told} {depth}");
    }
}

#[test]
fn the_measured_timestep_limit_is_the_closed_form() {
    for (solref, zeta) in [("0.1 0.2", 0.2), ("-2500 -20", 0.2), ("-2500 -100", 1.0)] {
        let model = ball(solref, "");
        let touch = only_touch(&model);
        let [spring, _] = touch.springs(&model, 0.002);
        assert!((spring.zeta() / zeta - 1.0).abs() < 0.03, "{spring:?}");
        let limit = |name: &str| probe::largest_timestep(&model, &method("penalty", name), &touch).expect("a limit");
        // The search stops at 0.5 %; growth so close to the limit takes longer than the steps it looks at.
        let close = |a: f64, b: f64| (a / b - 1.0).abs() < 0.02;
        let semi = constants::semi_implicit_limit(spring.omega(), spring.zeta());
        assert!(close(limit("semi-implicit-euler"), semi), "{solref}: {} for {semi}", limit("semi-implicit-euler"));
        let explicit = 2.0 * spring.zeta().min(1.0) / spring.omega();
        assert!(close(limit("explicit-euler"), explicit), "{solref}: {} for {explicit}", limit("explicit-euler"));
        assert_eq!(limit("implicit-euler"), probe::LARGEST, "{solref}");
    }
}

#[test]
fn the_tutorials_spring_is_a_point_of_what_the_scene_says() {
    let model = ball("0.02 1", r#"<numeric name="penny.k" data="5000"/><numeric name="penny.c" data="40"/>"#);
    let spring = tutorial::spring(&model, &only_touch(&model), 0.002);
    assert_eq!((spring.k, spring.c), (5000.0, 40.0));
    assert!((spring.omega() - 50.0).abs() < 1e-12 && (spring.zeta() - 0.2).abs() < 1e-12);
}

#[test]
fn a_spring_without_damper_has_a_limit_and_an_integrator_that_gains_has_none() {
    for (law, solref, custom) in [
        ("penalty", "-2500 0", ""),
        ("tutorial", "0.02 1", r#"<numeric name="penny.k" data="5000"/><numeric name="penny.c" data="0"/>"#),
    ] {
        let model = ball(solref, custom);
        let touch = only_touch(&model);
        let omega = if law == "tutorial" { 50.0 } else { touch.springs(&model, 0.002)[0].omega() };
        let limit = |name: &str| probe::largest_timestep(&model, &method(law, name), &touch).expect("a limit");
        // The search stops at 0.5 %.
        assert!((limit("semi-implicit-euler") * omega / 2.0 - 1.0).abs() < 0.02, "{law}");
        assert_eq!(limit("explicit-euler"), 0.0, "{law}");
    }
}

#[test]
fn the_tiniest_mass_has_a_limit() {
    let custom = r#"<numeric name="penny.k" data="2500"/><numeric name="penny.c" data="20"/>"#;
    let limits = [1.0, 1e-12].map(|mass| {
        let mut model = ball("0.02 1", custom);
        let touch = Touch { mass, lightest: mass, ..only_touch(&model) };
        model.edit(|m| m.mixes[touch.mix].condim = 1).expect("a condim");
        probe::largest_timestep(&model, &method("tutorial", "semi-implicit-euler"), &touch)
    });
    assert!(limits[0].is_some_and(|h| h > 1e-2) && limits[1].is_some_and(|h| h < 1e-6), "{limits:?}");
}

/// Where the fall of a step is more than the depth at rest, a body hops for ever, about as far as it is said to.
#[test]
fn what_hops_for_ever_is_said_to() {
    let model = scene("circle");
    let method = Method { timestep: 1e-3, ..method("penalty", "semi-implicit-euler") };
    let touch = only_touch(&model);
    let hop = probe::hop(&model, &method, &touch).expect("it hops");
    assert!((hop.rest - 8.18e-6).abs() < 1e-8 && (hop.fall - 9.81e-6).abs() < 1e-12, "{hop:?}");
    let (mut state, mut data) = (State::new(&model), Data::new(&model));
    let mut deepest = f64::NEG_INFINITY;
    for i in 0..20_000 {
        step(&model, &method, &mut state, &mut data).unwrap_or_else(|e| panic!("{e}"));
        if i >= 15_000 {
            deepest = deepest.max(0.2 - data.xpos[1].z);
        }
    }
    // Falls of one step or of two: which one it ends with depends on the height that it came from.
    let said = hop.depth[1];
    assert!(deepest > 0.4 * said && deepest < 2.2 * said && deepest > 5.0 * hop.rest, "{deepest} {hop:?}");
    let calm = probe::calm_timestep(&model, &method, &touch).expect("a timestep at which it rests");
    assert!(calm < 1e-3 && probe::hop(&model, &Method { timestep: calm, ..method }, &touch).is_none());
    // Deep enough in the ground, it rests.
    let mut elliptic = scene("circle");
    elliptic.edit(|m| m.opt.cone = penny::model::Cone::Elliptic).expect("a cone");
    assert!(probe::hop(&elliptic, &Method { timestep: 1e-3, ..method }, &touch).is_none());
}

/// A Newton's cradle without gaps, with gaps, and a stack.
#[test]
fn bodies_that_touch_in_a_row_are_named() {
    let balls = |step: [f64; 3]| {
        let ball = |i: usize| {
            let [x, y, z] = step.map(|s| s * i as f64);
            format!(r#"<body pos="{x} {y} {z}"><freejoint/><geom size="0.05" mass="1"/></body>"#)
        };
        let text = format!("<mujoco><worldbody>{}</worldbody></mujoco>", (0..4).map(ball).collect::<String>());
        let model = penny::parse("row.xml", &text).unwrap_or_else(|e| panic!("{e}")).model;
        explain::rows_in_touch(&model, &State::new(&model))
    };
    assert_eq!(balls([0.1, 0.0, 0.0]), [[1, 2, 3, 4]]);
    assert_eq!(balls([0.06, 0.08, 0.0]), [[1, 2, 3, 4]]);
    assert!(balls([0.102, 0.0, 0.0]).is_empty(), "gaps");
    assert!(balls([0.0, 0.0, 0.1]).is_empty(), "a stack");
}

fn scene(name: &str) -> Model {
    let text =
        std::fs::read_to_string(crate::file(&format!("models/{name}.xml"))).unwrap_or_else(|e| panic!("{name}: {e}"));
    penny::parse(name, &text).unwrap_or_else(|e| panic!("{e}")).model
}

/// Tilting between several contacts and impacts gain energy where one contact alone would bear any step.
#[test]
fn a_trial_run_finds_what_one_contact_alone_does_not_show() {
    for (name, law, h) in [("disk", "tutorial", 0.004), ("stack", "tutorial", 0.006), ("tee", "penalty", 0.1)] {
        let model = scene(name);
        let largest = |timestep: f64| {
            let method = Method { timestep, ..method(law, "semi-implicit-euler") };
            trial_run::largest_timestep(&model, &method, &State::new(&model), &explain::Budget::unlimited())
        };
        let safe = largest(h).unwrap_or_else(|| panic!("{name}: gains energy and is not told"));
        assert!(safe > 1e-4 && safe < h, "{name}: {safe}");
        assert_eq!(largest(0.001), None, "{name}: is fine at its own timestep");
    }
}

/// A small push at rest dies below the limit that theory gives, and grows above it.
#[test]
fn springs_of_tendons_and_limits_of_joints_and_tendons_are_stable_up_to_their_limits() {
    let soft = r#"solimplimit=".95 .95 .001" solreflimit="-2e4 -60""#;
    let scenes = [
        ("spring of tendon t", "", r#"stiffness="2e4" damping="60""#.to_owned(), 2.0 * 9.81 / 2e4),
        ("limit of tendon t", "", format!(r#"range="0 9" {soft}"#), 0.05 * 9.81 / 2e4),
        ("the limit of joint x", &*format!(r#"range="0 9" {soft}"#), String::new(), 0.05 * 9.81 / 2e4),
    ];
    for (name, joint, tendon, rest) in scenes {
        let text = format!(
            r#"<mujoco><worldbody><body><joint name="x" type="slide" axis="0 0 1" {joint}/><geom size=".1" mass="2"/></body>
               </worldbody><tendon><fixed name="t" {tendon}><joint joint="x" coef="1"/></fixed></tendon></mujoco>"#
        );
        let model = penny::parse("spring.xml", &text).unwrap_or_else(|e| panic!("{e}")).model;
        for integrator in ["semi-implicit-euler", "implicitfast", "rk4"] {
            let method = method("mujoco", integrator);
            let limits = theory::limits(&model, method.integrator);
            let [(found, limit)] = &limits[..] else { panic!("{limits:?}") };
            assert_eq!(found, name);
            let grows = |timestep: f64| {
                let (mut state, mut data) = (State::new(&model), Data::new(&model));
                let method = Method { timestep, ..method };
                (state.qpos[0], state.qvel[0]) = (-rest, 1e-7);
                let mut speeds = Vec::new();
                for _ in 0..3000 {
                    if step(&model, &method, &mut state, &mut data).is_err() {
                        return true;
                    }
                    speeds.push(state.qvel[0].abs());
                }
                speeds[2900..].iter().any(|v| *v > 1e-7)
            };
            assert!(!grows(0.98 * limit) && grows(1.02 * limit), "{name}, {integrator}: {limit}");
        }
    }
}

/// What `gravcomp` carries is no weight for a servo, an actuator has its own gains only, and what is disabled does nothing.
#[test]
fn servos_have_their_own_gains_and_hold_what_gravcomp_leaves() {
    let model = |flags: &str| {
        let text = format!(
            r#"<mujoco><option><flag {flags}/></option><worldbody><body gravcomp="0.75">
               <joint name="x" type="slide" axis="0 0 1" range="-1 1"/><geom size=".1" mass="4"/></body></worldbody>
               <actuator><motor name="m" joint="x"/><position name="p" joint="x" kp="100" gear="2"/>
               <velocity name="v" joint="x" kv="3"/></actuator></mujoco>"#
        );
        penny::parse("servos.xml", &text).unwrap_or_else(|e| panic!("{e}")).model
    };
    let driven = model("");
    let weights = joints::weights(&driven, &method("penalty", "Euler"), &State::new(&driven));
    assert!((weights[0] + 9.81).abs() < 1e-12, "{weights:?}");
    let x = joints::coordinate(&driven, 0).expect("a slide");
    let gains: Vec<_> = x.servos.iter().map(|s| [s.stiffness, s.damping]).collect();
    assert_eq!((gains, x.name(&driven)), (vec![[0.0; 2], [400.0, 0.0], [0.0, 3.0]], "p of joint x".to_owned()));
    let free = model(r#"actuation="disable" limit="disable""#);
    assert!(joints::coordinate(&free, 0).is_some_and(|x| x.servos.is_empty() && x.stiffness() == 0.0));
    assert!(joints::limit_spring(&free, 0, 0.002).is_none());
}
