//! Sweeps and maps: orders, limits, references, and the command line around them.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use penny::forward::Method;
use penny::model::Model;
use penny::state::State;
use penny::sweep::grid::{self, Row, Target};
use penny::sweep::map::{self, Setting};
use penny::sweep::{Case, reference, theory};
use penny::{contact, integrate};

const SPRING: &str = r#"<mujoco model="spring"><option gravity="0 0 0"/>
  <custom><text name="penny.truth" data="spring"/></custom>
  <worldbody><body name="ball"><joint name="x" type="slide" axis="1 0 0" stiffness="100" damping="2"/>
    <geom type="sphere" size=".1" mass="1" contype="0" conaffinity="0"/></body></worldbody>
  <keyframe><key name="pulled" qpos="1"/></keyframe></mujoco>"#;

fn model(xml: &str) -> Model {
    penny::parse("sweep.xml", xml).unwrap_or_else(|e| panic!("{e}")).model
}

fn case(xml: &str, qpos: &[f64], seconds: f64) -> Case {
    let model = model(xml);
    let mut start = State::new(&model);
    start.qpos.copy_from_slice(qpos);
    Case { model, start, seconds }
}

fn rows(case: &Case, target: &Target, integrator: &'static integrate::Integrator, steps: &[f64]) -> Vec<Row> {
    let methods = grid::methods(&[contact::ALL[0]], &[integrator], steps, 1);
    let mut rows = Vec::new();
    grid::accuracy(case, target, &methods, |row| rows.push(row));
    rows.sort_by(|a, b| a.timestep.total_cmp(&b.timestep));
    rows
}

#[test]
fn slopes_are_the_integrators_orders() {
    let pendulum = r#"<mujoco><worldbody><body><joint type="hinge" axis="0 1 0"/>
      <inertial pos="0 0 -1" mass="1" diaginertia=".01 .01 .01"/><geom type="sphere" size=".1" contype="0" conaffinity="0"/>
      </body></worldbody></mujoco>"#;
    let case = case(pendulum, &[1.0], 1.0);
    let truth = reference::converged(&case, contact::ALL[0], 1e-4).expect("a reference");
    assert!(truth.uncertainty < 1e-11, "{:e}", truth.uncertainty);
    let target = Target::Poses([(contact::ALL[0].name, truth)].into());
    for integrator in integrate::ALL {
        // Small enough for the leading term, large enough to stay above rounding.
        let found = rows(&case, &target, integrator, &grid::timesteps(&case, 1.0 / 512.0, 1.0 / 128.0, 2));
        let error = |i: usize| found[i].error.unwrap_or_else(|| panic!("{} diverged", integrator.name));
        let slope = (error(1) / error(0)).ln() / (found[1].timestep / found[0].timestep).ln();
        assert!((slope - f64::from(integrator.order)).abs() < 0.2, "{}: {slope}", integrator.name);
    }
}

#[test]
fn measured_limits_are_the_theorys_on_the_damped_spring() {
    let case = case(SPRING, &[1.0], 1.0);
    let spring = &theory::joint_springs(&case.model)[0];
    assert!((spring.omega - 10.0).abs() < 1e-12 && (spring.zeta - 0.1).abs() < 1e-12);
    for &integrator in integrate::ALL {
        let limit = theory::limit(integrator, spring).expect("known to the theory");
        let unstable = |timestep: f64| {
            let method = Method { contact: contact::ALL[0], integrator, timestep, rounds: 1 };
            map::unstable(map::classify(&Setting { case: case.clone(), method }))
        };
        if limit.is_infinite() {
            assert!(!unstable(10.0), "{}", integrator.name);
            continue;
        }
        // The issue allows 2 %.
        assert!(!unstable(0.99 * limit) && unstable(1.01 * limit), "{}: {limit}", integrator.name);
    }
}

#[test]
fn a_map_knows_four_fates() {
    let case = case(&SPRING.replace("damping=\"2\"", ""), &[1.0], 1.0);
    let class = |integrator: &str, timestep: f64| {
        let integrator = integrate::by_name(integrator).expect("integrator");
        map::classify(&Setting {
            case: case.clone(),
            method: Method { contact: contact::ALL[0], integrator, timestep, rounds: 1 },
        })
    };
    assert_eq!(class("semi-implicit-euler", 0.01), map::Class::Stable);
    // h ω = 1.9: less than four steps a period.
    assert_eq!(class("semi-implicit-euler", 0.19), map::Class::Rattling);
    assert_eq!(class("explicit-euler", 1e-3), map::Class::Gaining);
    assert_eq!(class("semi-implicit-euler", 0.3), map::Class::Diverging);
}

#[test]
fn what_a_map_sets_is_what_the_theory_sees() {
    let setting = Setting {
        case: case(SPRING, &[1.0], 1.0),
        method: Method { contact: contact::ALL[0], integrator: integrate::ALL[0], timestep: 1e-3, rounds: 1 },
    };
    let quantity = |name: &str| map::quantity(name).expect(name);
    let set = map::at(&setting, [quantity("stiffness"), quantity("mass")], [400.0, 4.0]);
    let spring = &theory::joint_springs(&set.case.model)[0];
    // √(400/4), and the damping ratio kept.
    assert!((spring.omega - 10.0).abs() < 1e-12 && (spring.zeta - 0.1).abs() < 1e-12, "{spring:?}");
    let set = map::at(&setting, [quantity("damping"), quantity("timestep")], [0.5, 0.02]);
    assert!((theory::joint_springs(&set.case.model)[0].zeta - 0.5).abs() < 1e-12);
    assert_eq!(set.method.timestep, 0.02);
}

fn penny(args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_penny"));
    command.args(args).current_dir(env!("CARGO_MANIFEST_DIR"));
    // A Python without MuJoCo, wherever the test runs.
    command.env("PENNY_PYTHON", "/nonexistent/python").output().expect("penny starts")
}

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("sweep").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}

fn scene(folder: &Path, text: &str) -> String {
    let path = folder.join("scene.xml");
    std::fs::write(&path, text).expect("a scene");
    path.to_str().expect("UTF-8").to_owned()
}

#[test]
fn a_sweep_leaves_table_diagram_and_advice_and_goes_on_where_it_stopped() {
    let folder = folder("resume");
    let (scene, out) = (scene(&folder, SPRING), folder.join("out"));
    let out = out.to_str().expect("UTF-8");
    let args = ["sweep", &scene, "--key", "pulled", "--timesteps", "1e-3..1e-1:3", "--truth", "analytic", "--out", out];
    let first = penny(&args);
    let said = String::from_utf8_lossy(&first.stderr).into_owned();
    assert!(first.status.success() && first.stdout.is_empty(), "{said}");
    assert!(said.contains("cheapest method") && said.contains("rk4"), "{said}");
    for file in ["sweep.csv", "sweep.json", "sweep.svg", "sweep.png"] {
        assert!(Path::new(out).join(file).exists(), "{file}");
    }
    let csv = Path::new(out).join("sweep.csv");
    let whole = std::fs::read_to_string(&csv).expect("the table");
    assert_eq!(whole.lines().count(), 1 + 3 * integrate::ALL.len());

    // As after an interruption: half of the rows, the last one torn.
    let half: String = whole.lines().take(8).collect::<Vec<_>>().join("\n");
    std::fs::write(&csv, &half[..half.len() - 5]).expect("the table");
    let again = penny(&[&args[..], &["--resume"]].concat());
    let said = String::from_utf8_lossy(&again.stderr);
    assert!(again.status.success() && said.contains("6 of 15 rows are there already"), "{said}");
    let resumed = std::fs::read_to_string(&csv).expect("the table");
    assert_eq!(resumed.lines().count(), whole.lines().count());

    let other = penny(&[&args[..], &["--resume", "--time", "2"]].concat());
    assert_eq!(other.status.code(), Some(2), "other settings are another sweep");
}

#[test]
fn a_map_is_drawn_with_its_limits() {
    let folder = folder("map");
    let (scene, out) = (scene(&folder, SPRING), folder.join("out"));
    let out = out.to_str().expect("UTF-8");
    let map = "timestep=1e-2..1,stiffness=10..1000";
    let output = penny(&["sweep", &scene, "--key", "pulled", "--map", map, "--cells", "6", "--out", out]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let text = std::fs::read_to_string(Path::new(out).join("map-timestep-stiffness.json")).expect("the map");
    let map: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(map["integrators"].as_array().map(Vec::len), Some(integrate::ALL.len()));
    let svg = std::fs::read_to_string(Path::new(out).join("map-timestep-stiffness.svg")).expect("the picture");
    assert!(svg.contains("timestep h [s]") && svg.contains("diverging"));
}

#[test]
fn runs_are_drawn() {
    let file = folder("plot").join("run.svg");
    let output = penny(&["run", "models/disk.xml", "--time", "0.6", "--plot", file.to_str().expect("UTF-8")]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let svg = std::fs::read_to_string(file).expect("the picture");
    for part in ["Centre of mass", "Energy", "Deepest contact", "Phase", "time [s]"] {
        assert!(svg.contains(part), "{part}");
    }
}

#[test]
fn requests_that_cannot_be_are_refused_in_one_sentence() {
    let folder = folder("refused");
    let scene = scene(&folder, &SPRING.replace("penny.truth", "other"));
    let wrong = self::scene(&self::folder("wrong"), &SPRING.replace("data=\"spring\"", "data=\"sprung\""));
    for (args, code, part) in [
        (vec!["--laws", "coulomb"], 2, "coulomb"),
        (vec!["--integrators", "leapfrog"], 2, "leapfrog"),
        (vec!["--time", "-1"], 2, "above 0"),
        (vec!["--timesteps", "1e-2..1e-3"], 2, "smaller"),
        (vec!["--truth", "analytic"], 2, "names no closed form"),
        (vec!["--truth", "mujoco"], 1, "MuJoCo 4.0.0 is needed"),
        (vec!["--map", "timestep,colour"], 2, "`colour` is none of timestep"),
        (vec!["--map", "timestep"], 2, "two quantities"),
        (vec!["--map", "timestep,friction"], 1, "nothing in the scene can touch"),
        (vec!["--map", "timestep,speed"], 1, "starts at rest"),
        (vec!["--out", "/dev/null/folder"], 1, "cannot be written"),
    ] {
        let out = folder.join("out");
        let fixed = ["sweep", &scene, "--cells", "2"];
        let place = if args.contains(&"--out") { vec![] } else { vec!["--out", out.to_str().expect("UTF-8")] };
        let output = penny(&[&fixed[..], &args, &place].concat());
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{args:?}: {said}");
        assert!(said.contains(part) && said.contains("error"), "{args:?}: {said}");
    }
    let output = penny(&["sweep", &wrong, "--truth", "analytic", "--out", folder.to_str().expect("UTF-8")]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(1) && said.contains("the closed form `sprung`"), "{said}");
}
