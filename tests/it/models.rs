//! The scenes of `models/`: MuJoCo loads them too, and they run under every law and integrator.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use penny::contact;
use penny::data::Data;
use penny::forward::{Method, step};
use penny::integrate;
use penny::model::Model;
use penny::state::{Start, State};
use serde_json::Value;

fn folder() -> PathBuf {
    Path::new(crate::ROOT).join("models")
}

fn load(name: &str) -> Model {
    let scene = penny::load(&folder().join(name)).unwrap_or_else(|e| panic!("{name}:\n{e}"));
    assert!(scene.warnings.is_empty(), "{name}: {:?}", scene.warnings);
    scene.model
}

/// The names of all scenes, in order.
fn names() -> Vec<String> {
    let entries = std::fs::read_dir(folder()).expect("models/");
    let mut names: Vec<String> = entries.map(|e| e.expect("an entry").file_name().to_string_lossy().into()).collect();
    names.retain(|n| n.ends_with(".xml"));
    names.sort();
    names
}

/// The method that the command line takes by default.
fn method(model: &Model) -> Method {
    Method {
        contact: contact::by_name(model.contact_law().unwrap_or("penalty")).expect("a law"),
        integrator: integrate::by_name(&model.opt.integrator).expect("an integrator"),
        timestep: model.opt.timestep,
        rounds: penny::forward::ROUNDS,
    }
}

/// Starts of a scene: as it stands, and each keyframe.
fn starts(model: &Model) -> Vec<(String, State)> {
    let mut starts = vec![("qpos0".to_owned(), State::new(model))];
    for key in &model.keyframes {
        let mut state = State::new(model);
        state.qpos.clone_from(&key.qpos);
        state.qvel.clone_from(&key.qvel);
        state.ctrl.clone_from(&key.ctrl);
        starts.push((key.name.clone(), state));
    }
    starts
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(|x| x.as_f64().expect("a number")).collect()
}

fn strings(value: &Value) -> Vec<&str> {
    value.as_array().expect("a list").iter().map(|x| x.as_str().expect("a text")).collect()
}

#[test]
fn mujoco_loads_every_scene_and_reads_the_same_in_it() {
    let golden = std::fs::read_to_string(folder().with_file_name("tests").join("golden/models.json")).expect("golden");
    let golden: Value = serde_json::from_str(&golden).expect("JSON");
    let scenes = golden["scenes"].as_array().expect("scenes");
    assert_eq!(scenes.iter().map(|s| s["name"].as_str().expect("a name")).collect::<Vec<_>>(), names());
    for scene in scenes {
        let name = scene["name"].as_str().expect("a name");
        let model = load(name);
        assert_eq!(
            (Some(model.nq as u64), Some(model.nv as u64)),
            (scene["nq"].as_u64(), scene["nv"].as_u64()),
            "{name}"
        );
        assert_eq!(Some(model.opt.timestep), scene["timestep"].as_f64(), "{name}");
        assert_eq!(
            model.bodies.iter().skip(1).map(|b| b.name.as_str()).collect::<Vec<_>>(),
            strings(&scene["body"])[1..],
            "{name}"
        );
        assert_eq!(model.geoms.iter().map(|g| g.name.as_str()).collect::<Vec<_>>(), strings(&scene["geom"]), "{name}");
        let close = |ours: &[f64], theirs: &Value| {
            let theirs = numbers(theirs);
            // Last bits of a volume or of a quaternion made from angles.
            ours.len() == theirs.len() && ours.iter().zip(theirs).all(|(a, b)| (a - b).abs() < 1e-14)
        };
        assert!(close(&model.qpos0, &scene["qpos0"]), "{name}: qpos0 {:?}", model.qpos0);
        let masses: Vec<f64> = model.bodies.iter().map(|b| b.mass).collect();
        assert!(close(&masses, &scene["body_mass"]), "{name}: masses {masses:?}");
        let keys = scene["keys"].as_array().expect("keys");
        assert_eq!(model.keyframes.len(), keys.len(), "{name}");
        for (ours, theirs) in model.keyframes.iter().zip(keys) {
            assert_eq!(Some(ours.name.as_str()), theirs["name"].as_str(), "{name}");
            assert!(
                close(&ours.qpos, &theirs["qpos"]) && close(&ours.qvel, &theirs["qvel"]),
                "{name} key {}",
                ours.name
            );
        }
    }
}

#[test]
fn every_scene_runs_a_second_under_every_law_and_integrator() {
    for name in names() {
        let model = load(&name);
        for (start, state) in starts(&model) {
            for &contact in contact::ALL {
                for &integrator in integrate::ALL {
                    let method = Method { contact, integrator, ..self::method(&model) };
                    // Keyframes with the scene's own integrator only: the rest would cost and show little more.
                    if start != "qpos0" && integrator.name != self::method(&model).integrator.name {
                        continue;
                    }
                    let (mut state, mut data) = (state.clone(), Data::new(&model));
                    let steps = (1.0 / method.timestep).round() as usize;
                    let outcome = (0..steps).try_for_each(|_| step(&model, &method, &mut state, &mut data));
                    let what = format!("{name} ({start}) under {}, {}", contact.name, integrator.name);
                    assert!(outcome.is_ok(), "{what}: {outcome:?}");
                    // Nothing is thrown off the ground or through it; without tendons the balls of a cradle fall.
                    let falls = !contact.joints && model.tendons.iter().any(|t| t.range.is_some());
                    assert!(falls || data.xpos.iter().all(|p| p.z.abs() < 2.0), "{what}: {:?}", data.xpos);
                }
            }
        }
    }
}

/// What every step of every scene does: (pairs at most, rows of a contact at most, evaluations of the forces).
const WORK: &[(&str, usize, usize, usize)] = &[
    ("arm.xml", 1, 3, 1),
    ("balls.xml", 9, 6, 1),
    ("box.xml", 1, 3, 1),
    ("circle.xml", 1, 6, 1),
    ("cradle.xml", 10, 1, 4),
    ("disk.xml", 1, 6, 1),
    ("disk_traction.xml", 1, 6, 1),
    ("diver.xml", 0, 0, 1),
    ("four_bar.xml", 0, 0, 1),
    ("goal.xml", 8, 6, 1),
    ("goal_2d.xml", 3, 6, 1),
    ("goal_keeper.xml", 9, 6, 1),
    ("pendulum.xml", 0, 0, 1),
    ("point_mass.xml", 1, 3, 1),
    ("stack.xml", 6, 3, 1),
    ("tee.xml", 2, 3, 1),
    ("top.xml", 0, 0, 4),
];

#[test]
fn a_step_does_only_what_the_scene_requires() {
    assert_eq!(WORK.iter().map(|w| w.0.to_owned()).collect::<Vec<_>>(), names());
    for &(name, pairs, rows, forwards) in WORK {
        let model = load(name);
        let slides = ["point_mass.xml", "goal_keeper.xml"].contains(&name);
        assert_eq!(model.trees.iter().all(|t| t.rotates), !slides, "{name}: what turns");
        for &contact in contact::ALL {
            let method = Method { contact, ..method(&model) };
            let (mut state, mut data) = (State::new(&model), Data::new(&model));
            let mut touched = false;
            for _ in 0..(1.0 / method.timestep) as usize {
                step(&model, &method, &mut state, &mut data).expect("stable");
                let counts = data.counts;
                let what = format!("{name} under {} at {}: {counts:?}", contact.name, state.time);
                assert!(counts.pairs <= pairs * forwards, "{what}");
                assert_eq!(counts.forwards, forwards, "{what}");
                // A limit of each tendon, three rows of an equality.
                let tied = forwards * (model.tendons.len() + 3 * model.equalities.len());
                assert!(counts.rows <= rows * counts.contacts + tied, "{what}");
                assert!(tied + counts.contacts > 0 || (counts.rows, counts.solves) == (0, 0), "{what}");
                // What starts from nothing is a formula: it solves nothing.
                assert!(contact.start != Start::Nothing || counts.solves == 0, "{what}");
                touched |= counts.contacts > 0;
            }
            // The arm's finger touches the table only where its servos press it down, balls that hang only where one swings.
            let apart = ["arm.xml", "cradle.xml"].contains(&name);
            assert_eq!(touched, pairs > 0 && !apart, "{name} under {}", contact.name);
        }
    }
}

#[test]
fn what_cannot_matter_is_not_computed() {
    let counts = |geoms: &str, condim: usize| {
        let text = format!(
            r#"<mujoco><default><geom condim="{condim}"/></default><worldbody>
               <geom type="plane" size="1 1 1"/>{geoms}
               <body pos="0 0 0.099"><freejoint/><geom size="0.1"/></body></worldbody></mujoco>"#
        );
        let model = penny::parse("scene.xml", &text).unwrap_or_else(|e| panic!("{e}")).model;
        let mut data = Data::new(&model);
        step(&model, &method(&model), &mut State::new(&model), &mut data).expect("stable");
        (data.counts.pairs, data.counts.contacts, data.counts.rows)
    };
    assert_eq!(counts("", 1), (1, 1, 1), "no friction rows at condim 1");
    assert_eq!(counts("", 6), (1, 1, 6));
    // A post that stands in the ground cannot move, and the ball is far from it.
    assert_eq!(counts(r#"<geom type="box" pos="5 0 0" size="0.1 0.1 1"/>"#, 1), (1, 1, 1), "what is fixed, or far");
}

/// Samples of each scene at least. Where MuJoCo does not repeat itself a run is cut short, and there is another one
/// from a start that it does repeat.
const LEAST_SAMPLES: usize = 60;

/// The scenes from all their starts under every integrator that MuJoCo has too, two seconds, both to rounding.
#[test]
fn whole_runs_are_mujocos_under_every_integrator() {
    let golden = include_str!("../golden/models_law.json");
    let golden: Value = serde_json::from_str(golden).expect("JSON");
    let (mut report, mut samples) = (String::new(), BTreeMap::new());
    for run in golden["runs"].as_array().expect("runs") {
        let (name, integrator) = (run["name"].as_str().expect("a name"), run["integrator"].as_str().expect("a name"));
        let mut model = load(name);
        model.edit(|m| (m.opt.tolerance, m.opt.iterations) = (0.0, 100)).expect("finite");
        let law = contact::by_name("mujoco").expect("the law");
        let integrator = integrate::by_name(integrator).expect("MuJoCo's integrators are Penny's");
        let method = Method { contact: law, integrator, ..method(&model) };
        let start = run["start"].as_u64().map_or(0, |key| key as usize + 1);
        let (label, mut state) = starts(&model).swap_remove(start);
        state.qvel = numbers(&run["qvel"]);
        let mut data = Data::new(&model);
        let (every, tolerance) = (run["every"].as_u64().expect("a number"), run["tolerance"].as_f64().expect("m"));
        for (i, there) in run["qpos"].as_array().expect("rows").iter().enumerate() {
            (0..every).for_each(|_| step(&model, &method, &mut state, &mut data).expect("stable"));
            *samples.entry(name.to_owned()).or_insert(0) += 1;
            let off = state.qpos.iter().zip(numbers(there)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            if off > tolerance {
                report += &format!("{name} ({label}), {}: {off:.1e} off in sample {i}\n", integrator.name);
                break;
            }
        }
    }
    assert!(report.is_empty(), "\n{report}");
    assert_eq!(samples.keys().cloned().collect::<Vec<_>>(), names());
    assert!(samples.values().all(|&n| n >= LEAST_SAMPLES), "{samples:?}");
}

/// A published crate can hold only files of its own: the benchmark's disk is a copy.
#[test]
fn the_benchmark_measures_the_disk_of_the_models() {
    let read = |path| std::fs::read_to_string(crate::file(path)).expect(path);
    assert_eq!(read("crates/cli/src/bench/disk.xml"), read("models/disk.xml"));
}
