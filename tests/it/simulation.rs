//! The library's one way in: what is read, changed, saved and refused, and MuJoCo doing the same.

use std::error::Error;

use penny::forward::{Method, StepError};
use penny::mjcf::Failure;
use penny::model::{ContactOverride, Parts};
use penny::simulation::Change;
use penny::snapshot::Damaged;
use penny::state::State;
use penny::{Batch, Simulation, contact, integrate};
use serde_json::Value;

const SCENE: &str = include_str!("../client/scene.xml");

fn simulation(law: &str) -> Simulation {
    let mut sim = Simulation::from_xml(SCENE).unwrap_or_else(|e| panic!("{e}"));
    sim.set_law(law).expect("a law");
    // MuJoCo's law to rounding.
    sim.edit(|m| (m.opt.tolerance, m.opt.iterations) = (0.0, 100)).expect("finite");
    sim
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(|x| x.as_f64().expect("a number")).collect()
}

fn close(what: &str, found: &[f64], wanted: &[f64], tolerance: f64) {
    let off = found.iter().zip(wanted).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(found.len() == wanted.len() && off <= tolerance, "{what}: off by {off:e}: {found:?}, not {wanted:?}");
}

/// What tests/golden/topics/simulation.py does before each phase.
fn change(sim: &mut Simulation, phase: &str) -> Result<(), Box<dyn Error>> {
    match phase {
        "start" => {}
        "gravity" => sim.set_gravity([1.5, -0.5, -3.7])?,
        "friction" => {
            for geom in ["ground", "crate"] {
                sim.set_friction(geom, [0.1, 0.001, 0.0001])?;
            }
        }
        "solref" => sim.set_solref("crate", [0.05, 0.6])?,
        "mass" => {
            for body in ["crate", "bob"] {
                sim.set_mass(body, 3.0 * sim.body(body)?.mass())?;
            }
        }
        "push" => sim.push("crate", [4.0, 2.0, 1.0], [0.1, 0.2, 0.3])?,
        "release" => {
            sim.clear_forces();
            sim.set_ctrl("drive", 0.4)?;
        }
        "timestep" => sim.set_timestep(0.001)?,
        "key" => sim.reset_to("thrown")?,
        other => panic!("{other}"),
    }
    Ok(())
}

#[test]
fn a_run_that_is_changed_as_it_goes_is_mujocos() {
    let golden: Value = serde_json::from_str(include_str!("../golden/simulation.json")).expect("JSON");
    let steps = golden["steps"].as_u64().expect("a number") as usize;
    let mut sim = simulation("mujoco");
    for phase in golden["phases"].as_array().expect("phases") {
        let name = phase["name"].as_str().expect("a name");
        change(&mut sim, name).unwrap_or_else(|e| panic!("{name}: {e}"));
        sim.step_n(steps).expect("stable");
        close(name, &sim.state().qpos, &numbers(&phase["qpos"]), 1e-10);
        close(name, &sim.state().qvel, &numbers(&phase["qvel"]), 1e-9);
        let force = sim.contact_force("crate", "ground").expect("two geoms");
        close(name, &force, &numbers(&phase["force"]), 1e-7);
    }
}

/// A change is as good as a file that says so from the start: the next steps have the same bits, under every law.
#[test]
fn a_change_takes_effect_at_the_next_step_under_every_law() {
    type Set = fn(&mut Simulation);
    let changed: [(&str, &str, Set); 5] = [
        ("<worldbody>", r#"<option gravity="1 2 -3"/><worldbody>"#, |s| s.set_gravity([1.0, 2.0, -3.0]).expect("g")),
        (r#"name="ground""#, r#"name="ground" friction="2 .1 .1""#, |s| {
            s.set_friction("ground", [2.0, 0.1, 0.1]).expect("μ")
        }),
        (r#"name="crate" type="box""#, r#"name="crate" type="box" solref=".1 .3""#, |s| {
            s.set_solref("crate", [0.1, 0.3]).expect("solref")
        }),
        (r#"size="0.08" pos="0.05 0 -0.4" mass="0.5""#, r#"size="0.08" pos="0.05 0 -0.4" mass="0.8""#, |s| {
            s.set_mass("bob", 0.8).expect("a mass")
        }),
        (r#"axis="1 0 0" damping="0.2""#, r#"axis="1 0 0" damping="0.9""#, |s| {
            s.edit(|m: &mut Parts| {
                let dof = m.joints.iter().find(|j| j.name == "rail").expect("rail").dofadr;
                m.dofs[dof].damping = 0.9;
            })
            .expect("damping")
        }),
    ];
    for law in contact::ALL {
        for (old, new, set) in changed {
            let mut told = simulation(law.name);
            told.step_n(60).expect("stable");
            // So that the crate slides, and the cart runs.
            (told.state_mut().qvel[0], told.state_mut().qvel[6]) = (1.0, 1.0);
            let text = SCENE.replace(old, new);
            assert_ne!(text, SCENE, "{old}");
            let mut written = Simulation::from_xml(&text).unwrap_or_else(|e| panic!("{e}"));
            written.set_law(law.name).expect("a law");
            written.edit(|m| (m.opt.tolerance, m.opt.iterations) = (0.0, 100)).expect("finite");
            written.restore(&told.save()).expect("the same lists");
            let mut untold = told.clone();
            set(&mut told);
            told.step_n(5).expect("stable");
            untold.step_n(5).expect("stable");
            written.step_n(5).expect("stable");
            close(new, &told.state().qvel, &written.state().qvel, 1e-13);
            assert_ne!(untold.state().qvel, told.state().qvel, "{}: {new} has no effect", law.name);
        }
    }
}

#[test]
fn a_saved_state_goes_on_with_the_same_bits() {
    for law in contact::ALL {
        for integrator in integrate::ALL {
            let mut sim = simulation(law.name);
            sim.set_integrator(integrator.name).expect("an integrator");
            sim.set_timestep(5e-4).expect("a step");
            sim.push("crate", [3.0, 1.0, 0.0], [0.0, 0.0, 0.15]).expect("a push");
            sim.step_n(150).unwrap_or_else(|e| panic!("{} {}: {e}", law.name, integrator.name));
            let saved = sim.save();
            let bytes = State::from_bytes(&saved.to_bytes()).expect("a state");
            let json = serde_json::to_string(&saved).expect("finite numbers");
            let json: State = serde_json::from_str(&json).expect("a state");
            let mut other = simulation(law.name);
            other.set_integrator(integrator.name).expect("an integrator");
            other.set_timestep(5e-4).expect("a step");
            sim.step_n(50).expect("stable");
            for state in [&bytes, &json] {
                other.restore(state).expect("a state of this model");
                other.step_n(50).expect("stable");
                assert_eq!(other.save(), sim.save(), "{} {}", law.name, integrator.name);
            }
        }
    }
}

/// A scene may give the course's law numbers of its own; what is set overrules them.
#[test]
fn what_is_set_overrules_the_scenes_numbers_for_the_courses_law() {
    let xml = SCENE.replace(
        "<worldbody>",
        r#"<custom><numeric name="penny.mu" data="0.3"/><numeric name="penny.k" data="3000"/>
           <numeric name="penny.c" data="50"/></custom><worldbody>"#,
    );
    let changed: [fn(&mut Simulation); 2] = [
        |sim| sim.set_friction("ground", [2.0, 0.1, 0.1]).expect("friction"),
        |sim| sim.set_solref("crate", [0.1, 0.3]).expect("solref"),
    ];
    for set in changed {
        let mut told = Simulation::from_xml(&xml).unwrap_or_else(|e| panic!("{e}"));
        told.set_law("tutorial").expect("a law");
        told.step_n(60).expect("stable");
        told.state_mut().qvel[0] = 1.0;
        let mut untold = told.clone();
        set(&mut told);
        told.step_n(5).expect("stable");
        untold.step_n(5).expect("stable");
        assert_ne!(told.state().qvel, untold.state().qvel);
    }
}

#[test]
fn what_is_no_saved_state_is_refused() {
    let bytes = simulation("penalty").save().to_bytes();
    assert_eq!(State::from_bytes(b"<mujoco/>"), Err(Damaged::Foreign));
    for cut in [9, bytes.len() - 8, bytes.len() - 1] {
        assert_eq!(State::from_bytes(&bytes[..cut]), Err(Damaged::Length), "{cut}");
    }
    let mut long = bytes.clone();
    long[16..24].copy_from_slice(&u64::MAX.to_le_bytes());
    assert_eq!(State::from_bytes(&long), Err(Damaged::Length));
    let mut ball =
        Simulation::from_xml("<mujoco><worldbody><body><freejoint/><geom size='1'/></body></worldbody></mujoco>")
            .expect("a scene");
    let error = ball.restore(&simulation("penalty").save()).expect_err("another scene");
    assert_eq!(error.to_string(), "qpos has 14 numbers where the model has 7: it is not a state of this model");
}

/// Each of these was once taken without a word.
#[test]
fn what_cannot_be_is_an_error_where_it_enters() {
    let mut sim = simulation("penalty");
    for h in [-0.002, 0.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(sim.set_timestep(h), Err(StepError::Timestep(_))));
        let method = Method { timestep: h, ..*sim.method() };
        let (mut state, mut data) = (sim.save(), sim.data().clone());
        let error = penny::forward::step(sim.model(), &method, &mut state, &mut data).expect_err("no timestep");
        assert!(error.to_string().contains("above zero"), "{error}");
    }
    let untouched = sim.save();
    sim.state_mut().xfrc_applied = vec![Default::default(); 2];
    let error: Box<dyn Error> = Box::new(sim.step().expect_err("two of seven bodies"));
    assert_eq!(error.to_string(), "xfrc_applied has 2 numbers where the model has 6: it is not a state of this model");
    assert!(matches!(sim.push("crate", [1.0; 3], [0.0; 3]), Err(Change::Invalid(_))));
    sim.restore(&untouched).expect("its own state");
    sim.state_mut().qpos.pop();
    assert!(sim.push("crate", [1.0; 3], [0.0; 3]).is_err() && sim.energy().kinetic.is_nan());
    let last = sim.model().joints.len() - 1;
    assert!(sim.joint(last).expect("a joint").qpos().is_empty());
    sim.state_mut().ctrl.clear();
    assert!(matches!(sim.set_ctrl("drive", 1.0), Err(Change::Invalid(_))));
    sim.restore(&untouched).expect("its own state");
    assert!(matches!(sim.set_ctrl("drive", f64::NAN), Err(Change::Invalid(_))));
    assert!(matches!(sim.set_friction("crate", [-1.0, 0.0, 0.0]), Err(Change::Invalid(_))));
    assert!(sim.set_gravity([0.0, f64::INFINITY, 0.0]).is_err());
    assert!(sim.set_mass("crate", -1.0).is_err() && sim.set_mass("lift", 0.0).is_err());
    assert!(sim.edit(|m| m.geoms[1].contype = 2).is_err(), "what can touch what is compiled");
    assert_eq!(
        sim.body("crat").err().expect("no such body").to_string(),
        "there is no body `crat`: did you mean `crate`?"
    );
    assert!(sim.geom(99).is_err() && sim.joint("").is_err() && sim.reset_to("thrwn").is_err());
    let error = sim.set_law("pennalty").expect_err("no such law");
    assert_eq!(error.nearest.as_deref(), Some("penalty"));
    // Nothing of all that has changed anything.
    sim.step().expect("a step");
    let mut clean = simulation("penalty");
    clean.step().expect("a step");
    assert_eq!(sim.save(), clean.save());
}

/// Nothing would touch the body any more.
#[test]
fn a_mocap_body_has_a_pose() {
    let mut sim = Simulation::from_xml(
        "<mujoco><worldbody><body name='hand' mocap='true'><geom size='.1'/></body>
        <body pos='0 0 1'><freejoint/><geom size='.1'/></body></worldbody></mujoco>",
    )
    .expect("a scene");
    sim.state_mut().mocap_pos[0][2] = f64::NAN;
    let error = sim.step().expect_err("no place").to_string();
    assert!(error.contains("mocap_pos[2] of body 1 is NaN"), "{error}");
    sim.reset();
    sim.state_mut().mocap_quat[0][3] = f64::INFINITY;
    let error = sim.step().expect_err("no direction").to_string();
    assert!(error.contains("mocap_quat[3] of body 1 is inf"), "{error}");
}

/// A change numbers the parameters of contacts anew; contacts had the old numbers, or were gone.
#[test]
fn what_is_read_after_a_change_is_that_of_the_changed_scene() {
    let mut sim = Simulation::from_xml(
        "<mujoco><worldbody><geom name='floor' type='plane' size='1 1 1'/>
        <body name='a' pos='0 0 .1'><freejoint/><geom name='a' size='.1' mass='1'/></body>
        <body name='b' pos='1 0 .1'><freejoint/><geom name='b' size='.1' mass='1' friction='2'/></body></worldbody></mujoco>",
    )
    .expect("a scene");
    sim.step_n(100).expect("steps");
    let mut plain = sim.clone();
    let friction = |sim: &Simulation| sim.contacts().map(|c| c.friction_coefficient()).collect::<Vec<_>>();
    assert_eq!(friction(&sim), [1.0, 2.0]);
    sim.set_friction("b", [0.5, 0.005, 0.0001]).expect("friction");
    assert_eq!(friction(&sim), [1.0, 1.0]);
    sim.set_mass("a", 2.0).expect("a mass");
    sim.energy();
    assert!((sim.contact_force("a", "floor").expect("geoms")[2] - 2.0 * 9.81).abs() < 1e-3);
    // To read it changes nothing.
    plain.set_friction("b", [0.5, 0.005, 0.0001]).expect("friction");
    plain.set_mass("a", 2.0).expect("a mass");
    for sim in [&mut sim, &mut plain] {
        sim.step_n(10).expect("steps");
    }
    assert_eq!(sim.save(), plain.save());
}

const BOX: &str = "<mujoco><worldbody><geom name='floor' type='plane' size='1 1 1'/><body name='post'/>
    <body name='box' pos='0 0 .1'><freejoint/><geom name='box' type='box' size='.1 .1 .1'/></body>
    <body name='arm' pos='1 0 1'><joint name='arm' axis='0 1 0' range='-90 90'/><geom name='arm' size='.05' pos='.3 0 0'/></body>
    </worldbody><actuator><motor name='arm' joint='arm' ctrlrange='-1 1' forcerange='-1 1'/></actuator>
    <equality><weld name='weld' body1='box'/></equality>
    <keyframe><key name='start'/></keyframe></mujoco>";

fn boxed() -> Simulation {
    Simulation::from_xml(BOX).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn structure_cannot_be_edited() {
    let changes: [fn(&mut Parts); 14] = [
        |m| m.mixes.clear(),
        |m| m.pairs.listed.clear(),
        |m| m.pairs.listed[0].mix = 99,
        |m| m.pairs.swept.push(0),
        |m| m.trees[0].dofs = 0..99,
        |m| m.sites.clear(),
        |m| m.cameras.clear(),
        |m| m.tendons.clear(),
        |m| m.equalities.clear(),
        |m| m.actuators[0].activation = penny::model::Activation::Integrator,
        |m| m.keyframes[0].qpos.clear(),
        |m| m.mocap.push(1),
        |m| m.na = 3,
        |m| m.opt.flags.filterparent = false,
    ];
    let mut sim = boxed();
    let start = sim.save();
    for (i, change) in changes.into_iter().enumerate() {
        let nothing = matches!(i, 5..=7);
        assert_eq!(sim.edit(change).is_ok(), nothing, "{i}");
        sim.step().expect("stable");
    }
    sim.restore(&start).expect("its own state");
    // Contacts that were not compiled cannot be switched on; those that were, can.
    for (flag, ok) in [("enable", true), ("disable", false)] {
        let text = BOX.replace("<worldbody>", &format!("<option><flag contact='{flag}'/></option><worldbody>"));
        let mut sim = Simulation::from_xml(&text).unwrap_or_else(|e| panic!("{e}"));
        sim.edit(|m| m.opt.flags.contact = false).expect("off");
        assert_eq!(sim.edit(|m| m.opt.flags.contact = true).is_ok(), ok);
    }
}

#[test]
fn every_number_is_looked_at() {
    let nan = f64::NAN;
    type Set = fn(&mut Parts, f64);
    let numbers: [Set; 22] = [
        |m, x| m.actuators[0].gain[0] = x,
        |m, x| m.actuators[0].bias[1] = x,
        |m, x| m.actuators[0].ctrlrange = Some([x, 1.0]),
        |m, x| m.actuators[0].forcerange = Some([-1.0, x]),
        |m, x| m.geoms[0].pos.x = x,
        |m, x| m.geoms[1].margin = x,
        |m, x| m.geoms[1].size.x = x,
        |m, x| m.bodies[2].gravcomp = x,
        |m, x| m.bodies[2].ipos.y = x,
        |m, x| m.bodies[2].invweight0[0] = x,
        |m, x| m.joints[1].axis.y = x,
        |m, x| m.joints[1].range = Some([x, 1.0]),
        |m, x| m.joints[1].solref_limit[1] = x,
        |m, x| m.mixes[0].margin = x,
        |m, x| m.mixes[0].gap = x,
        |m, x| m.mixes[0].friction[4] = x,
        |m, x| m.mixes[0].solimp[2] = x,
        |m, x| m.tutorial.k = Some(x),
        |m, x| m.opt.magnetic.z = x,
        |m, x| m.opt.noslip_tolerance = x,
        |m, x| m.keyframes[0].qvel[0] = x,
        |m, x| m.qpos0[0] = x,
    ];
    let mut sim = boxed();
    for (i, set) in numbers.into_iter().enumerate() {
        let error = sim.edit(|m| set(m, nan)).expect_err(&i.to_string());
        assert!(error.to_string().contains("cannot be NaN"), "{i}: {error}");
    }
    type Change = fn(&mut Parts);
    let others: [(Change, &str); 9] = [
        (|m| m.actuators[0].forcerange = Some([1.0, -1.0]), "forcerange of actuator `arm` cannot be 1 -1: give the"),
        (|m| m.actuators[0].ctrlrange = Some([1.0, -1.0]), "ctrlrange of actuator `arm` cannot be 1 -1"),
        (|m| m.joints[1].range = Some([1.0, -1.0]), "range of joint `arm` cannot be 1 -1"),
        (|m| m.joints[1].axis *= 2.0, "axis of joint `arm` cannot have length 2"),
        (|m| m.geoms[1].solref = [-0.05, 1.0], "solref of geom `box` cannot be -0.05 1: either both"),
        (|m| m.mixes[0].solref = [0.0, 1.0], "solref of mix 0 cannot be 0 1"),
        (|m| m.tutorial.mu = Some(-1.0), "penny.mu cannot be -1: it is zero or above"),
        (|m| m.opt.impratio = 0.0, "impratio cannot be 0: it is above zero"),
        (|m| m.opt.integrator = "eulr".into(), "the integrator cannot be `eulr`: Penny has"),
    ];
    for (change, wanted) in others {
        let error = sim.edit(change).expect_err(wanted).to_string();
        assert!(error.starts_with(wanted), "{error}");
    }
    sim.edit(|m| m.joints[1].range = Some([f64::NEG_INFINITY, 1.0])).expect("no lower limit");
    sim.edit(|m| m.actuators[0].gain[0] = 2.0).expect("a gain");
    sim.step_n(10).expect("stable");
}

/// What the reader takes with a warning does not stand in the way of other changes.
#[test]
fn what_a_file_may_have_can_stay() {
    let text = BOX.replace("name='box' type='box'", "name='box' solref='0.02 -1' type='box'");
    let mut sim = Simulation::from_xml(&text).unwrap_or_else(|e| panic!("{e}"));
    sim.set_gravity([0.0, 0.0, -1.0]).expect("gravity");
    assert!(sim.set_solref("box", [0.03, -1.0]).is_err());
}

#[test]
fn setters_refuse_what_would_have_no_effect() {
    let mut sim = boxed();
    for solref in [[0.0, 1.0], [-0.05, 1.0], [0.02, 0.0], [f64::NAN, 1.0]] {
        assert!(matches!(sim.set_solref("box", solref), Err(Change::Invalid(_))), "{solref:?}");
    }
    for mass in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        for body in ["box", "arm"] {
            assert!(matches!(sim.set_mass(body, mass), Err(Change::Invalid(_))), "{body} {mass}");
        }
    }
    for body in ["world", "post"] {
        assert!(matches!(sim.set_mass(body, 5.0), Err(Change::Invalid(_))), "{body}");
        assert!(matches!(sim.push(body, [1.0; 3], [0.0; 3]), Err(Change::Invalid(_))), "{body}");
    }
    let error = sim.set_mass("post", 5.0).expect_err("fixed");
    assert_eq!(error.to_string(), "a mass has no effect on body `post`: no joint moves it");
    let error = sim.edit(|m| m.opt.timestep = 0.1).expect_err("the method's");
    assert_eq!(error.to_string(), "the timestep is the method's: change it by `set_timestep`");
    assert!(sim.edit(|m| m.opt.integrator = "RK4".into()).is_err());
    assert!(sim.edit(|m| drop(m.texts.insert("penny.contact".into(), "tutorial".into()))).is_err());
    sim.step().expect("a step");
    let mut clean = boxed();
    clean.step().expect("a step");
    assert_eq!(sim.save(), clean.save());
    // Of a model alone, it is what a method begins with.
    let mut model = boxed().model().clone();
    model.edit(|m| m.opt.timestep = 0.1).expect("a timestep");
    assert_eq!(Method::of(&model).timestep, 0.1);
    model.edit(|m| m.opt.integrator = "implicit".into()).expect("as good as implicitfast");
    let error = model.edit(|m| m.opt.density = 1.0).expect_err("forces of the medium");
    assert!(error.to_string().starts_with("the integrator cannot be `implicit`"), "{error}");
}

/// `<flag override>` would overrule what is set.
#[test]
fn contacts_that_are_overridden_are_set_by_an_edit() {
    let option = "<option o_friction='.5 .5 .01 .01 .01'><flag override='enable'/></option><worldbody>";
    let mut sim = Simulation::from_xml(&BOX.replace("<worldbody>", option)).unwrap_or_else(|e| panic!("{e}"));
    let error = sim.set_friction("box", [0.1; 3]).expect_err("overridden").to_string();
    assert!(error.starts_with("the friction of geom `box` has no effect: the scene overrides"), "{error}");
    assert!(sim.set_solref("box", [0.1, 1.0]).is_err());
    sim.edit(|m| m.opt.contact_override = m.opt.contact_override.map(|o| ContactOverride { friction: [0.1; 5], ..o }))
        .expect("friction");
    assert_eq!(sim.model().mixes[0].friction, [0.1; 5]);
}

/// As the compiler does: `implicitfast` couples the six degrees of freedom.
#[test]
fn a_free_body_that_gets_a_velocity_gain_has_no_closed_form() {
    let motor = "<actuator><motor name='thrust' joint='free' gear='0 0 1 0 0 0'/>";
    let text = BOX.replace("<freejoint/>", "<freejoint name='free'/>").replace("<actuator>", motor);
    let mut sim = Simulation::from_xml(&text).unwrap_or_else(|e| panic!("{e}"));
    let free = |sim: &Simulation| sim.model().trees.iter().any(|tree| tree.free.is_some());
    assert!(free(&sim));
    sim.edit(|m| m.actuators[0].bias[2] = -1.0).expect("a damper");
    assert!(!free(&sim));
    sim.step_n(10).expect("stable");
}

#[test]
fn a_start_value_counts_from_the_next_reset() {
    let mut sim = boxed();
    sim.edit(|m| m.equalities[0].active = false).expect("a start value");
    assert!(sim.state().eq_active[0]);
    sim.reset();
    assert!(!sim.state().eq_active[0]);
}

#[test]
fn a_failed_world_runs_again_after_a_reset() {
    let sim = boxed();
    let start = sim.save();
    let begin: [fn(&mut Simulation, &State); 4] = [
        |world, _| world.reset(),
        |world, start| world.restore(start).expect("its own state"),
        |world, _| world.reset_to("start").expect("a key"),
        |world, _| *world = boxed(),
    ];
    let mut alone = sim.clone();
    alone.step_n(20).expect("stable");
    for begin in begin {
        let mut batch = Batch::new(&sim, 2);
        batch.worlds_mut()[1].state_mut().qvel[0] = 1e12;
        assert_eq!(batch.step_n(20), 1);
        assert!(batch.failure(1).is_some());
        assert_eq!(Batch::new(&batch.worlds()[1], 1).failure(0), None);
        begin(&mut batch.worlds_mut()[1], &start);
        assert_eq!(batch.failure(1), None);
        assert_eq!(batch.step_n(20), 0);
        assert_eq!(batch.worlds()[1].save(), alone.save());
    }
}

#[test]
fn poses_lag_by_one_step_until_forward() {
    let mut sim = simulation("mujoco");
    sim.reset_to("thrown").expect("a key");
    let before = sim.body("crate").expect("a crate").position();
    sim.step().expect("a step");
    assert_eq!(sim.body("crate").expect("a crate").position(), before);
    sim.forward();
    assert_eq!(sim.body("crate").expect("a crate").position(), sim.joint("crate").expect("its joint").qpos()[..3]);
    close("velocity", &sim.body("crate").expect("a crate").velocity(), &sim.state().qvel[..3], 1e-15);
}

#[test]
fn forces_are_read_by_name() {
    for law in contact::ALL {
        let mut sim = simulation(law.name);
        sim.step_n(1500).expect("stable");
        let weight = 2.0 * 9.81;
        let up = sim.body("crate").expect("a crate").contact_force();
        close(law.name, &up, &[0.0, 0.0, weight], 1e-3);
        close(law.name, &sim.contact_force("crate", "ground").expect("geoms"), &up, 1e-12);
        close(law.name, &sim.contact_force("ground", "crate").expect("geoms"), &up.map(|f| -f), 1e-12);
        let carried: f64 = sim.contacts().filter(|t| t.names() == ["ground", "crate"]).map(|t| t.normal_force()).sum();
        close(law.name, &[carried], &[weight], 1e-3);
    }
}

#[test]
fn sensors_and_sites_are_read_by_name() {
    let mut sim = Simulation::from_path(crate::file("models/arm.xml")).unwrap_or_else(|e| panic!("{e}"));
    sim.step_n(10).expect("stable");
    sim.forward();
    for (index, sensor) in sim.model().sensors.iter().enumerate().filter(|(_, s)| !s.name.is_empty()) {
        let values = sim.sensor(sensor.name.as_str()).expect("a sensor");
        assert_eq!(values, &sim.data().sensordata[sensor.adr..][..values.len()], "{index}");
    }
    assert!(sim.model().sites.iter().all(|s| s.name.is_empty() || sim.site(s.name.as_str()).is_ok()));
    assert!(sim.sensor("no such").is_err() && sim.site(99).is_err());
}

/// A world in a batch has the bits that it has alone, on any number of threads, with a model of its own or without.
#[test]
fn a_world_in_a_batch_is_a_world_alone() {
    let vary = |i: usize, world: &mut Simulation| {
        world.state_mut().qvel[0] = 0.1 * i as f64;
        if i % 3 == 1 {
            world.set_friction("crate", [0.1 * i as f64, 0.005, 0.0001]).expect("friction");
        }
        if i == 5 {
            world.state_mut().qvel[1] = 1e12;
        }
    };
    for law in contact::ALL {
        let sim = simulation(law.name);
        let mut alone: Vec<Simulation> = vec![sim.clone(); 8];
        let ends: Vec<_> = alone
            .iter_mut()
            .enumerate()
            .map(|(i, world)| {
                vary(i, world);
                (world.step_n(100).err(), world.save())
            })
            .collect();
        for threads in [1, 2, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            let mut batch = Batch::new(&sim, 8);
            batch.worlds_mut().iter_mut().enumerate().for_each(|(i, world)| vary(i, world));
            let failed = pool.install(|| {
                batch.step_n(60);
                batch.step_n(40)
            });
            assert_eq!(failed, 1, "the fifth");
            for (i, (failure, state)) in ends.iter().enumerate() {
                assert_eq!(batch.failure(i), failure.as_ref(), "{} {i}", law.name);
                assert_eq!(batch.worlds()[i].save(), *state, "{} {i} on {threads} threads", law.name);
            }
        }
    }
}

/// An error of any kind can be handed on with `?`.
#[test]
fn every_error_is_an_error() {
    fn is_error<E: Error + Send + Sync + 'static>() {}
    is_error::<StepError>();
    is_error::<penny::diverged::Diverged>();
    is_error::<Change>();
    is_error::<penny::compile::Invalid>();
    is_error::<penny::state::WrongState>();
    is_error::<Damaged>();
    is_error::<Failure>();
}
