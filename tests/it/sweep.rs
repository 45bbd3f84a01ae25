//! Sweeps and maps: orders, limits, references, and the command line around them.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use penny::forward::Method;
use penny::model::Model;
use penny::state::State;
use penny::{contact, integrate};
use penny_lab::sweep::grid::{self, Row, Target};
use penny_lab::sweep::map::{self, Setting};
use penny_lab::sweep::{Case, reference, theory};

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
    let truth = reference::converged(&case, &contact::ALL[..1], 1e-4, |_| ()).swap_remove(0).expect("a reference");
    assert!(truth.uncertainty < 1e-11, "{:e}", truth.uncertainty);
    let target = Target::Poses([(contact::ALL[0].name, truth)].into());
    for integrator in integrate::ALL {
        // Small enough for the leading term, large enough to stay above rounding.
        let fine = if integrator.order > 4 { 1.0 / 96.0 } else { 1.0 / 512.0 };
        let found = rows(&case, &target, integrator, &grid::timesteps(&case, fine, 4.0 * fine, 2));
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
            let method = Method { contact: contact::ALL[0], integrator, timestep, rounds: penny::forward::ROUNDS };
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
            method: Method { contact: contact::ALL[0], integrator, timestep, rounds: penny::forward::ROUNDS },
        })
    };
    assert_eq!(class("semi-implicit-euler", 0.01), map::Class::Stable);
    // h ω = 1.9: less than four steps a period.
    assert_eq!(class("semi-implicit-euler", 0.19), map::Class::Rattling);
    assert_eq!(class("explicit-euler", 1e-3), map::Class::Gaining);
    assert_eq!(class("semi-implicit-euler", 0.3), map::Class::Diverging);
}

fn setting(case: &Case, integrator: &'static integrate::Integrator, timestep: f64) -> Setting {
    let contact = contact::by_name("penalty").expect("law");
    Setting { case: case.clone(), method: Method { contact, integrator, timestep, rounds: penny::forward::ROUNDS } }
}

fn disk(seconds: f64) -> Case {
    let model = penny::load(&crate::file("models/disk.xml")).unwrap_or_else(|e| panic!("{e}")).model;
    let start = State::new(&model);
    Case { model, start, seconds }
}

#[test]
fn what_a_landing_threw_up_is_not_stable_because_it_flies() {
    let axes = ["timestep", "stiffness"].map(|name| map::quantity(name).expect(name));
    let setting = setting(&disk(1.0), &integrate::semi_implicit_euler::METHOD, 1e-3);
    // Thrown up with 50 times its energy in the first quarter, it has the same energy ever after.
    assert_eq!(map::classify(&map::at(&setting, axes, [6e-3, 3.16e5])), map::Class::Gaining);
    assert_eq!(map::classify(&map::at(&setting, axes, [1e-3, 3.16e5])), map::Class::Stable);
}

#[test]
fn a_map_runs_for_its_time_and_knows_what_never_lands() {
    // It lands after 0.404 s, which at this step takes more than 4000 of them.
    for (seconds, flies) in [(0.39, true), (0.41, false)] {
        let setting = setting(&disk(seconds), &integrate::semi_implicit_euler::METHOD, 9e-5);
        assert_eq!(map::touches_nothing(&setting), flies, "{seconds}");
    }
    // Beyond its limit the contact throws the disk; the run has to be long enough to see it.
    let mut soft = setting(&disk(0.6), &integrate::explicit_euler::METHOD, 9e-5);
    soft.case.model.edit(|m| m.mixes.iter_mut().for_each(|mix| mix.solref = [-1e9, -10.0])).expect("finite");
    assert!(map::unstable(map::classify(&soft)));
}

#[test]
fn what_starts_in_equilibrium_is_nudged_out_of_it() {
    let case = case(SPRING, &[0.0], 1.0);
    let spring = &theory::joint_springs(&case.model)[0];
    let integrator = &integrate::semi_implicit_euler::METHOD;
    let limit = theory::limit(integrator, spring).expect("known to the theory");
    let unstable = |h: f64| map::unstable(map::classify(&setting(&case, integrator, h)));
    assert!(!unstable(0.99 * limit) && unstable(1.01 * limit));
}

#[test]
fn a_limit_is_the_first_one() {
    let pocket = |h: f64| h < 1.0 || (3.0..90.0).contains(&h);
    let first = map::boundary([0.01, 100.0], pocket).expect("a limit");
    assert!((first - 1.0).abs() < 1e-3, "{first}");
}

#[test]
fn what_a_map_sets_is_what_the_theory_sees() {
    let setting = Setting {
        case: case(SPRING, &[1.0], 1.0),
        method: Method {
            contact: contact::ALL[0],
            integrator: integrate::ALL[0],
            timestep: 1e-3,
            rounds: penny::forward::ROUNDS,
        },
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
    command.args(args).current_dir(crate::ROOT);
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
    let said = crate::said(&first);
    assert!(first.status.success(), "{said}");
    assert!(said.contains("cheapest method") && said.contains("rk4"), "{said}");
    assert!(!said.contains("penalty"), "nothing touches, so no law is better: {said}");
    for file in ["sweep.csv", "sweep.json", "sweep.svg", "sweep.png"] {
        assert!(Path::new(out).join(file).exists(), "{file}");
    }
    let svg = std::fs::read_to_string(Path::new(out).join("sweep.svg")).expect("the picture");
    assert!(svg.contains("What accuracy costs: scene.xml"), "a title holds no path");
    assert!(svg.contains("methods, which were unstable"), "what is not drawn is said");
    let csv = Path::new(out).join("sweep.csv");
    let whole = std::fs::read_to_string(&csv).expect("the table");
    assert_eq!(whole.lines().count(), 1 + 3 * integrate::ALL.len());

    // As after an interruption: about half of the rows, the last one torn.
    let rows = whole.lines().count() - 1;
    let left = rows / 2;
    let half: String = whole.lines().take(left + 2).collect::<Vec<_>>().join("\n");
    std::fs::write(&csv, &half[..half.len() - 5]).expect("the table");
    let again = penny(&[&args[..], &["--resume"]].concat());
    let said = crate::said(&again);
    assert!(again.status.success() && said.contains(&format!("{left} of {rows} rows are there already")), "{said}");
    let resumed = std::fs::read_to_string(&csv).expect("the table");
    assert_eq!(resumed.lines().count(), whole.lines().count());

    let resume = |args: &[&str], part: &str, code: i32| {
        let output = penny(&[args, &["--resume"]].concat());
        let said = crate::said(&output);
        assert!(output.status.code() == Some(code) && said.contains(part), "{part}: {said}");
        assert_eq!(std::fs::read_to_string(&csv).expect("the table"), resumed, "{part}");
    };
    resume(&[&args[..], &["--time", "2"]].concat(), "it had time 1.0, now 2.0", 2);
    std::fs::write(&scene, SPRING.replace("stiffness=\"100\"", "stiffness=\"101\"")).expect("a scene");
    resume(&args, "the scene has changed", 2);
    std::fs::write(Path::new(out).join("sweep.json"), "{").expect("damage");
    resume(&args, "sweep.json is damaged", 1);
    let nowhere = folder.join("nowhere");
    let away = [&args[..args.len() - 1], &[nowhere.to_str().expect("UTF-8")]].concat();
    resume(&away, "no sweep", 2);
    assert!(!nowhere.exists(), "--resume left an empty folder");

    // Without --resume: kept until there is a truth, then moved aside.
    let failed = penny(&["sweep", &scene, "--truth", "mujoco", "--out", out]);
    assert_eq!(failed.status.code(), Some(1));
    assert_eq!(
        std::fs::read_to_string(&csv).expect("the table"),
        resumed,
        "a sweep that cannot run takes nothing away"
    );
    #[cfg(unix)]
    {
        let running = std::fs::File::open(out).expect("a folder");
        running.lock().expect("nobody else has it");
        let beside = penny(&args);
        assert!(beside.status.code() == Some(1) && crate::said(&beside).contains("another process is writing it"));
    }
    let anew = penny(&args);
    assert!(anew.status.success(), "{}", crate::said(&anew));
    let kept = Path::new(out).join("earlier-1/sweep.csv");
    assert_eq!(std::fs::read_to_string(kept).expect("the earlier table"), resumed);
}

/// A tie is a constraint, of which one law knows nothing.
#[test]
fn laws_differ_where_nothing_touches_but_something_is_tied() {
    let folder = folder("tied");
    let text = r#"<mujoco><worldbody><body><joint name="a" axis="0 1 0"/><geom size="0.1" contype="0" conaffinity="0"/></body>
        <body pos="1 0 0"><joint name="b" axis="0 1 0"/><geom size="0.1" pos="0.1 0 0" contype="0" conaffinity="0"/></body>
        </worldbody><equality><joint joint1="a" joint2="b"/></equality></mujoco>"#;
    let (scene, out) = (scene(&folder, text), folder.join("out"));
    let out = out.to_str().expect("UTF-8");
    let said = crate::said(&penny(&["sweep", &scene, "--time", "0.1", "--timesteps", "1e-3..1e-2:2", "--out", out]));
    let csv = std::fs::read_to_string(Path::new(out).join("sweep.csv")).expect("the table");
    assert!(csv.contains("tutorial") && csv.contains("penalty") && !said.contains("nothing touches"), "{said}\n{csv}");
}

#[test]
fn what_is_named_twice_is_swept_once() {
    let out = folder("twice");
    let args = ["sweep", "models/box.xml", "--time", "0.01", "--timesteps", "1e-3,1e-3", "--laws", "tutorial,tutorial"];
    let output = penny(&[&args[..], &["--integrators", "rk4,rk4", "--out", out.to_str().expect("UTF-8")]].concat());
    assert!(output.status.success(), "{}", crate::said(&output));
    let text = std::fs::read_to_string(out.join("sweep.csv")).expect("rows");
    assert_eq!(text.lines().count(), 2, "{text}");
}

#[test]
fn a_sweep_says_what_its_numbers_are_worth() {
    let folder = folder("worth");
    let out = folder.join("out");
    let out = out.to_str().expect("UTF-8");
    let args = ["sweep", "models/disk.xml", "--laws", "penalty,tutorial", "--integrators", "rk4", "--time", "0.5"];
    let args = [&args[..], &["--timesteps", "5,1e-3", "--out", out]].concat();
    let output = penny(&args);
    let said = crate::said(&output);
    assert!(output.status.success(), "{said}");
    for part in ["5 s to 62.5 ms", "its own reference", "the uncertainty of the reference solution", "tutorial"] {
        assert!(said.contains(part), "{part}: {said}");
    }
    // The truth is kept: what is written there is what a resumed sweep goes by.
    let json = Path::new(out).join("sweep.json");
    let text = std::fs::read_to_string(&json).expect("the sweep");
    let about = if text.contains("\"about\": \"rk4") { "\"about\": \"rk4" } else { "\"about\": \"semi" };
    std::fs::write(&json, text.replace(about, "\"about\": \"oracle")).expect("the sweep");
    let output = penny(&[&args[..], &["--resume"]].concat());
    let said = crate::said(&output);
    assert!(output.status.success() && said.contains("oracle") && said.contains("4 of 4 rows"), "{said}");
}

#[test]
fn a_summary_has_the_cheapest_method_of_each_scene() {
    let folder = folder("summary");
    let (scene, out) = (scene(&folder, SPRING), folder.join("out"));
    let args =
        ["sweep", "models/pendulum.xml", &scene, "--summary", "--time", "0.5", "--out", out.to_str().expect("UTF-8")];
    let output = penny(&args);
    let said = crate::said(&output);
    assert!(output.status.success() && said.contains("pendulum.xml") && said.contains("cash-karp"), "{said}");
    let csv = std::fs::read_to_string(out.join("summary.csv")).expect("the table");
    assert_eq!(csv.lines().count(), 1 + 2 * 3, "{csv}");
    for row in csv.lines().skip(1) {
        let cells: Vec<&str> = row.split(',').collect();
        let [wanted, error] = [cells[2], cells[11]].map(|cell| cell.parse::<f64>().expect("a number"));
        assert!(error <= wanted, "{row}");
    }
    assert!(out.join("summary.png").exists());
    let output = penny(&["sweep", "models/pendulum.xml", "models/box.xml"]);
    assert!(!output.status.success() && crate::said(&output).contains("--summary"), "{}", crate::said(&output));
}

/// The tutorial's contact is another spring than MuJoCo's: at any step its law errs by as much.
#[test]
fn a_sweep_draws_the_floor_under_a_law() {
    let folder = folder("floor");
    let out = folder.join("out");
    let args = ["sweep", "models/disk.xml", "--time", "0.5", "--timesteps", "1e-3,1e-2", "--integrators", "rk4"];
    let output = penny(&[&args[..], &["--laws", "penalty,tutorial", "--out", out.to_str().expect("UTF-8")]].concat());
    let said = crate::said(&output);
    assert!(output.status.success() && said.contains("the law nearest to it"), "{said}");
    let svg = std::fs::read_to_string(out.join("sweep.svg")).expect("the picture");
    assert!(svg.contains("from tutorial") && svg.contains("from penalty"), "no floors");
}

#[test]
fn a_map_is_drawn_with_its_limits() {
    let folder = folder("map");
    let (scene, out) = (scene(&folder, SPRING), folder.join("out"));
    let out = out.to_str().expect("UTF-8");
    // With and without the timestep among the axes.
    for (map, name, of) in [
        ("timestep=1e-2..1,stiffness=10..1000", "map-timestep-stiffness.json", "timestep"),
        ("mass=1e-6..1e-2,damping=0.01..1", "map-mass-damping.json", "mass"),
    ] {
        let output = penny(&["sweep", &scene, "--key", "pulled", "--map", map, "--cells", "6", "--out", out]);
        let said = crate::said(&output);
        assert!(output.status.success(), "{said}");
        let text = std::fs::read_to_string(Path::new(out).join(name)).expect("the map");
        let map: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        let methods = map["methods"].as_array().expect("methods");
        assert_eq!((methods.len(), &map["finished"]), (integrate::ALL.len(), &true.into()));
        let mut compared = 0;
        for limit in
            methods.iter().filter(|m| m["limits_of"] == of).flat_map(|m| m["limits"].as_array().expect("limits"))
        {
            if let (Some(theory), Some(measured)) = (limit["theory"].as_f64(), limit["measured"].as_f64()) {
                // As the issue allows.
                assert!((measured / theory - 1.0).abs() < 0.02, "{name}: {limit}");
                compared += 1;
            }
        }
        assert!(compared >= 2 * 6, "{name}: {compared}");
    }
    let svg = std::fs::read_to_string(Path::new(out).join("map-timestep-stiffness.svg")).expect("the picture");
    assert!(svg.contains("timestep h [s]") && svg.contains("diverging"));
}

#[test]
fn runs_are_drawn() {
    let file = folder("plot").join("run.svg");
    let output = penny(&["run", "models/disk.xml", "--time", "0.6", "--plot", file.to_str().expect("UTF-8")]);
    assert!(output.status.success(), "{}", crate::said(&output));
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
        (vec!["--map", "timestep,stiffness", "--truth", "converged"], 2, "--truth"),
        (vec!["--map", "timestep,stiffness", "--timesteps", "1e-3"], 2, "--timesteps"),
        (vec!["--map", "timestep,stiffness", "--resume"], 2, "--resume"),
        (vec!["--map", "timestep,stiffness", "--cells", "10000000000"], 2, "from 1 to 1000"),
        (vec!["--map", "timestep,friction"], 1, "nothing in the scene can touch"),
        (vec!["--map", "timestep,speed"], 1, "starts at rest"),
        (vec!["--out", "/dev/null/folder"], 1, "cannot write"),
    ] {
        let out = folder.join("out");
        let fixed = ["sweep", &scene];
        let place = if args.contains(&"--out") { vec![] } else { vec!["--out", out.to_str().expect("UTF-8")] };
        let output = penny(&[&fixed[..], &args, &place].concat());
        let said = crate::said(&output);
        assert_eq!(output.status.code(), Some(code), "{args:?}: {said}");
        assert!(said.contains(part) && said.contains("error"), "{args:?}: {said}");
    }
    let output = penny(&["sweep", &wrong, "--truth", "analytic", "--out", folder.to_str().expect("UTF-8")]);
    let said = crate::said(&output);
    assert!(output.status.code() == Some(1) && said.contains("did you mean `spring`?"), "{said}");
}

#[test]
fn a_run_beyond_its_limit_is_warned_before_the_first_step() {
    let folder = folder("warned");
    let scene = scene(&folder, SPRING);
    // h ω < 2 (√1.01 + 0.1) = 2.21, ω = 10 rad/s.
    for (timestep, integrator, warned) in
        [("0.5", "semi-implicit-euler", true), ("0.2", "semi-implicit-euler", false), ("0.5", "implicit-euler", false)]
    {
        let output = penny(&["run", &scene, "--timestep", timestep, "--integrator", integrator]);
        let said = crate::said(&output);
        let has = said.contains("warning: joint x is unstable at this timestep");
        assert!(has == warned && (!warned || said.contains("--timestep 2.2e-1")), "{timestep} {integrator}: {said}");
        assert!(!warned || said.find("warning") < said.find("time s"), "too late: {said}");
    }
    let undamped = self::scene(&self::folder("undamped"), &SPRING.replace("damping=\"2\"", ""));
    let output = penny(&["run", &undamped, "--integrator", "explicit-euler"]);
    let said = crate::said(&output);
    assert!(said.contains("is unstable at any timestep with explicit-euler"), "{said}");
}
