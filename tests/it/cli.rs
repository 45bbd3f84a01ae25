//! The command line, used as a user does.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// Runs `penny` in the repository's folder.
fn penny(args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_penny"));
    command.args(args).current_dir(env!("CARGO_MANIFEST_DIR"));
    command.output().expect("penny starts")
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).expect("UTF-8")
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).expect("UTF-8")
}

/// What a command says when it ends with that exit code.
#[track_caller]
fn says(args: &[&str], code: i32) -> String {
    let output = penny(args);
    assert_eq!(output.status.code(), Some(code), "penny {args:?}\n{}", stderr(&output));
    stderr(&output)
}

#[track_caller]
fn assert_has(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "`{part}` is missing in:\n{text}");
    }
}

/// A scene file of this test's own.
fn scene(name: &str, text: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("cli");
    std::fs::create_dir_all(&folder).expect("a folder for scenes");
    let path = folder.join(name);
    std::fs::write(&path, text).expect("a scene file");
    path
}

/// Rows of a CSV, header left out.
fn rows(csv: &str) -> Vec<Vec<f64>> {
    csv.lines().skip(1).map(|l| l.split(',').map(|x| x.parse().expect("a number")).collect()).collect()
}

#[test]
fn a_run_tells_its_story_on_standard_error_only() {
    let output = penny(&["models/disk.xml"]);
    assert!(output.status.success() && output.stdout.is_empty());
    assert_has(
        &stderr(&output),
        &[
            "models/disk.xml",
            "1 body",
            "plane–cylinder",
            "condim 6",
            "penalty",
            "semi-implicit-euler",
            "1 ms, 3000 steps",
        ],
    );
    assert_has(&stderr(&output), &["energy J", "penetration", "contacts", "real time", "ζ", "no spring alone limits"]);
    assert_has(
        &says(&["models/point_mass.xml"], 0),
        &["x m", "z m", "k 2.5 kN/m", "alone is stable up to 36", "margin 36"],
    );
}

#[test]
fn csv_has_the_initial_state_first_and_then_every_nth_step() {
    let output = penny(&["models/box.xml", "--steps", "25", "--every", "10", "--csv", "-"]);
    let csv = stdout(&output);
    assert_eq!(csv.lines().next(), Some("time,qpos0,qpos1,qpos2,qvel0,qvel1,qvel2,energy,penetration,contacts"));
    let times: Vec<f64> = rows(&csv).iter().map(|r| r[0]).collect();
    assert_eq!(times.len(), 3);
    // Sums of ten steps of 1 ms: a few roundings.
    assert!(times.iter().zip([0.0, 0.01, 0.02]).all(|(a, b)| (a - b).abs() < 1e-15), "{times:?}");
    assert_eq!(rows(&csv)[0][1..=3], [0.0, 0.5, 0.4]);
    for number in csv.lines().skip(1).flat_map(|l| l.split(',').take(9)) {
        let digits = number.split('e').next().into_iter().flat_map(str::chars).filter(char::is_ascii_digit).count();
        assert_eq!(digits, 17, "{number}");
    }
}

#[test]
fn run_may_be_left_out_and_the_same_run_gives_the_same_bytes() {
    let long = penny(&["run", "models/balls.xml", "--key", "break", "--time", "0.5", "--csv", "-"]);
    let short = penny(&["models/balls.xml", "--key", "0", "--steps", "500", "--csv", "-"]);
    assert!(long.status.success() && long.stdout.len() > 100_000);
    assert!(long.stdout == short.stdout, "two equal runs differ");
}

#[test]
fn json_holds_what_csv_holds() {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("pendulum.json");
    let file = path.to_str().expect("UTF-8");
    let output = penny(&["models/pendulum.xml", "--steps", "20", "--csv", "-", "--json", file]);
    let json: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&path).expect("the file")).expect("valid JSON");
    assert_eq!(json["contact"], "penalty");
    assert_eq!(json["columns"][1], "qpos0");
    let csv = rows(&stdout(&output));
    assert_eq!(csv.len(), 21);
    for (i, row) in csv.iter().enumerate() {
        let same = row.iter().enumerate().all(|(j, x)| json["rows"][i][j].as_f64() == Some(*x));
        assert!(same, "row {i}");
    }
}

#[test]
fn keyframes_are_applied_only_where_named() {
    let speed = |args: &[&str]| {
        let all = [&["models/circle.xml", "--steps", "0", "--csv", "-"], args].concat();
        rows(&stdout(&penny(&all)))[0][4]
    };
    assert_eq!(speed(&[]), 0.0);
    assert_eq!(speed(&["--key", "slide"]), 2.0);
    assert_eq!(speed(&["--key", "slide", "--qvel", "-1, 0 0"]), -1.0);
    assert_has(&says(&["models/circle.xml", "--key", "sliide"], 2), &["no keyframe `sliide`", "slide"]);
}

#[test]
fn a_law_that_leaves_something_of_the_scene_out_says_so() {
    let path = scene(
        "limited.xml",
        r#"<mujoco><worldbody><body><joint range="-30 30"/><geom type="capsule" fromto="0 0 0 .5 0 0" size=".05"/></body></worldbody></mujoco>"#,
    );
    let run = |law: &str| says(&[path.to_str().expect("utf-8"), "--contact", law, "--steps", "1"], 0);
    assert_has(&run("tutorial"), &["no joint limits"]);
    assert!(!run("penalty").contains("no joint limits"));
}

#[test]
fn wrong_usage_is_explained_and_exits_with_2() {
    assert_has(&says(&[], 2), &["penny SCENE.xml", "check", "explain", "compare", "bench"]);
    assert_has(&says(&["models/disk.xml", "--contact", "penality"], 2), &["penality", "tutorial", "penalty"]);
    assert_has(&says(&["models/disk.xml", "--integrator", "euler"], 2), &["semi-implicit-euler", "rk4"]);
    assert_has(&says(&["models/disk.xml", "--time", "1", "--steps", "3"], 2), &["--time", "--steps"]);
    assert_has(&says(&["models/disk.xml", "--timestep", "0"], 2), &["above 0"]);
    assert_has(&says(&["models/disk.xml", "--qvel", "1 two"], 2), &["`two` is not a finite number"]);
    assert_has(
        &says(&["models/disk.xml", "--qvel", "2 0 0"], 2),
        &["--qvel has 3 numbers, but this scene has 6", "vx vy vz wx wy wz"],
    );
    assert_has(&says(&["models/box.xml", "--qpos", "1"], 2), &["1 number,", "3: x, z, theta"]);
}

#[test]
fn a_bad_scene_exits_with_1_and_says_where() {
    assert_has(&says(&["no/such.xml"], 1), &["no/such.xml"]);
    let path = scene("typo.xml", "<mujoco>\n <worldbody>\n  <geom sise=\"1\"/>\n </worldbody>\n</mujoco>\n");
    let file = path.to_str().expect("UTF-8");
    for command in ["run", "check", "explain"] {
        assert_has(&says(&[command, file], 1), &["typo.xml:3:9", "sise", "size"]);
    }
    let all = says(&["check", "models/disk.xml", file, "no/such.xml"], 1);
    assert_has(&all, &["models/disk.xml: fine", "typo.xml:3:9", "no/such.xml"]);
    says(&["check", "models/disk.xml", "models/box.xml"], 0);
}

#[test]
fn a_diverging_run_says_what_when_where_and_keeps_its_rows() {
    let text = std::fs::read_to_string("models/point_mass.xml").expect("the model");
    let path = scene("stiff.xml", &text.replace("data=\"2500\"", "data=\"1e14\""));
    let output = penny(&[path.to_str().expect("UTF-8"), "--csv", "-"]);
    assert_eq!(output.status.code(), Some(1));
    assert_has(&stderr(&output), &["diverged at 0.1", "of mass", "ground – point", "help:", "--timestep"]);
    let rows = rows(&stdout(&output));
    assert!(rows.len() > 50 && rows.iter().flatten().all(|x| x.is_finite()), "{} rows", rows.len());
}

#[test]
fn explain_says_what_is_required_and_what_the_numbers_mean() {
    let text = says(&["explain", "models/point_mass.xml"], 0);
    // k = 2500 N/m and c = 20 N s/m on 1 kg: omega = 50 rad/s, zeta = 0.2, mg/k = 3.92 mm; the tutorial's solref is
    // off by 1/zeta² = 25 in stiffness and 1/zeta = 5 in damping.
    assert_has(&text, &["2.5 kN/m", "20 N s/m", "50 rad/s", "0.2", "3.92 mm"]);
    assert_has(&text, &["\"0.1 0.2\"", "25 times the stiffness", "5 times the damping"]);
    assert_has(&text, &["never turns", "largest stable timestep", "explicit-euler", "rk4"]);
    assert_has(&says(&["explain", "models/pendulum.xml"], 0), &["nothing", "no contact work"]);
    let can = "<body><freejoint/><geom type='cylinder' size='.1 .1'/></body>";
    let arm = "<body pos='9 0 0'><joint range='-30 30' stiffness='1'/><geom size='.1' contype='0'/></body>";
    let text = format!("<mujoco><worldbody>{can}{can}{arm}</worldbody></mujoco>");
    let cans = scene("cans.xml", &text);
    let text = says(&["explain", cans.to_str().expect("UTF-8")], 0);
    assert_has(&text, &["may differ from MuJoCo's: cylinder–cylinder", "1 joint limit, 1 spring"]);
}

/// The course's timeconst = √(m/k) at damping ratios 0.2, 1 and 3: k/ζ², c/ζ, ω/ζ.
#[test]
fn explain_tabulates_what_the_tutorials_solref_gets_wrong() {
    let text = says(&["explain", "models/point_mass.xml"], 0);
    for row in [
        ["0.2", "100 ms", "20 ms", "25 k", "5 c", "5 ω"],
        ["1", "20 ms", "20 ms", "1 k", "1 c", "1 ω"],
        ["3", "6.67 ms", "20 ms", "0.111 k", "0.333 c", "0.333 ω"],
    ] {
        let line = text.lines().find(|l| l.trim_start().starts_with(&format!("{} ", row[0])) && l.ends_with('ω'));
        assert_has(line.unwrap_or_else(|| panic!("no row {row:?} in\n{text}")), &row);
    }
}

#[test]
fn compare_without_mujoco_says_how_to_install_it() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_penny"));
    command.args(["compare", "models/disk.xml"]).env("PENNY_PYTHON", "no-such-python");
    let output = command.current_dir(env!("CARGO_MANIFEST_DIR")).output().expect("penny starts");
    assert_eq!(output.status.code(), Some(1));
    assert_has(&stderr(&output), &["MuJoCo 4.0.0 is needed", "pip install mujoco==4.0.0", "PENNY_PYTHON"]);
}

/// With MuJoCo at hand (`PENNY_PYTHON`), a pendulum swings as it does there.
#[test]
fn compare_measures_the_difference_from_mujoco() {
    if std::env::var_os("PENNY_PYTHON").is_none() {
        return;
    }
    let text = says(&["compare", "models/pendulum.xml", "--contact", "penalty"], 0);
    assert_has(&text, &["Largest |qpos difference|", "penalty", "never", "MuJoCo"]);
    let text = says(&["compare", "models/disk.xml", "--qvel", "2 0 0 0 10 0", "--steps", "1000"], 0);
    assert_has(&text, &["Why", "penalty: friction:", "disk", "mujoco: no difference", "tutorial: its own law"]);
    assert_has(&text, &["tolerance 1e-8: solver tolerance"]);
    let text = says(&["compare", "models/box.xml", "--integrator", "explicit-euler", "--steps", "10"], 0);
    assert_has(&text, &["integrator: MuJoCo has no explicit-euler and runs Euler"]);
}

/// A thousand steps, or as many as take 2 ms, from where a second of simulated time has led.
#[test]
fn no_step_after_the_first_allocates() {
    let mut measured = 0;
    for scene in ["models/stack.xml", "models/box.xml", "models/top.xml"] {
        let text = says(&["bench", scene], 0);
        // law, integrator, time and its unit, contacts, allocations, hash
        for cells in text.lines().map(|l| l.split_whitespace().collect::<Vec<_>>()).filter(|cells| cells.len() == 7) {
            assert_eq!(cells[5], "0", "allocations in {scene} under {cells:?}");
            measured += 1;
        }
    }
    let methods = penny::contact::ALL.len() * penny::integrate::ALL.len();
    assert_eq!(measured, 3 * methods, "some method was not measured");
}

/// Trees with joints and free bodies in one island, with the diagonal of J M⁻¹ Jᵀ computed anew at every contact.
#[test]
fn the_mujoco_law_does_not_allocate_in_the_steps_of_an_island_of_many_trees() {
    let text = r#"<mujoco><option><flag diagexact="enable"/></option><worldbody><geom type="plane" size="9 9 1"/>
        <body pos="0 0 .1"><joint axis="0 1 0" range="-150 150" frictionloss=".1"/>
          <geom type="capsule" fromto="0 0 0 .3 0 0" size=".04"/>
          <body pos=".3 0 0"><joint axis="0 1 0"/><geom type="capsule" fromto="0 0 0 .3 0 0" size=".04"/></body></body>
        <body pos=".25 0 .25"><freejoint/><geom type="box" size=".2 .1 .05"/></body>
        <body pos=".25 0 .36"><freejoint/><geom type="sphere" size=".06"/></body></worldbody></mujoco>"#;
    let path = scene("island.xml", text).display().to_string();
    for integrator in ["semi-implicit-euler", "rk4", "implicitfast"] {
        let text = says(&["bench", &path, "--contact", "mujoco", "--integrator", integrator], 0);
        let row = text.lines().find(|l| l.contains(integrator)).unwrap_or_else(|| panic!("{text}"));
        let cells: Vec<&str> = row.split_whitespace().collect();
        assert_eq!((cells[0], cells.len()), ("mujoco", 7), "{row}");
        assert_eq!(cells[5], "0", "allocations: {row}");
        assert!(cells[4].parse::<usize>().is_ok_and(|contacts| contacts > 1), "contacts: {row}");
    }
}

#[test]
fn a_reader_that_leaves_early_is_no_error() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_penny"));
    command.args(["models/box.xml", "--csv", "-"]).current_dir(env!("CARGO_MANIFEST_DIR"));
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("penny starts");
    drop(child.stdout.take());
    assert!(child.wait().expect("it ends").success());
}
