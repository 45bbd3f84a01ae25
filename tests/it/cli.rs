//! The command line, used as a user does.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::Duration;

/// Runs `penny` in the repository's folder.
fn penny(args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_penny"));
    command.args(args).current_dir(crate::ROOT);
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
    crate::said(&output)
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
fn a_report_goes_to_standard_output_unless_data_goes_there() {
    let data = penny(&["models/disk.xml", "--steps", "2", "--csv", "-"]);
    assert!(stdout(&data).starts_with("time,qpos0") && stderr(&data).contains("energy J"), "{}", crate::said(&data));
    for command in ["explain", "check"] {
        let output = penny(&[command, "models/disk.xml"]);
        assert!(output.stderr.is_empty() && stdout(&output).contains("disk"), "{command}");
    }
    let output = penny(&["models/disk.xml"]);
    assert!(output.status.success() && output.stderr.is_empty());
    assert_has(
        &stdout(&output),
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
    assert_has(&stdout(&output), &["energy J", "penetration", "contacts", "real time", "ζ", "no spring alone limits"]);
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
    let text = std::fs::read_to_string(crate::file("models/point_mass.xml")).expect("the model");
    let path = scene("stiff.xml", &text.replace("data=\"2500\"", "data=\"1e14\""));
    let output = penny(&[path.to_str().expect("UTF-8"), "--csv", "-"]);
    assert_eq!(output.status.code(), Some(1));
    assert_has(&stderr(&output), &["diverged at 0.1", "of mass", "ground – point", "help:", "--timestep"]);
    let rows = rows(&stdout(&output));
    assert!(rows.len() > 50 && rows.iter().flatten().all(|x| x.is_finite()), "{} rows", rows.len());
}

/// With a full disk behind standard error there is nobody to tell: that is no reason to panic.
#[cfg(target_os = "linux")]
#[test]
fn a_closed_or_full_stream_is_no_error() {
    for args in [&["explain", "models/disk.xml"][..], &["models/disk.xml", "--steps", "1"]] {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").expect("Linux has it");
        let mut command = Command::new(env!("CARGO_BIN_EXE_penny"));
        let other = full.try_clone().expect("a second one");
        command.args(args).current_dir(crate::ROOT).stderr(full).stdout(other);
        assert_eq!(command.status().expect("penny starts").code(), Some(0), "{args:?}");
    }
}

#[test]
fn no_file_overwrites_the_scene_or_another() {
    let text = std::fs::read_to_string(crate::file("models/disk.xml")).expect("the model");
    let path = scene("kept.xml", &text);
    let file = path.to_str().expect("UTF-8");
    // The same file by another way.
    let detour = file.replace("kept.xml", "../cli/kept.xml");
    assert_has(&says(&[file, "--csv", &detour], 2), &["--csv would overwrite", "name another file"]);
    assert_eq!(std::fs::read_to_string(&path).expect("the scene"), text);
    let both = file.replace("kept.xml", "both.out");
    assert_has(&says(&[file, "--csv", &both, "--json", &both], 2), &["--csv and --json both write to", "both.out"]);
    assert!(!Path::new(&both).exists());
    assert_has(&says(&[file, "--csv", "-", "--json", "-"], 2), &["standard output"]);
    says(&[file, "--csv", "/dev/null", "--json", "/dev/null", "--steps", "1"], 0);
    assert_has(&says(&[file, "--csv", "/dev/stdout", "--steps", "1"], 0), &["time,qpos0"]);
}

/// Who reads a named pipe has all rows of it at the first opening; of a full device one hears that it is full.
#[test]
#[cfg(unix)]
fn a_pipe_is_opened_once_and_a_full_device_is_full() {
    let pipe = Path::new(env!("CARGO_TARGET_TMPDIR")).join("rows.pipe");
    let _ = std::fs::remove_file(&pipe);
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().expect("mkfifo").success());
    let name = pipe.to_str().expect("UTF-8").to_owned();
    let reader = std::thread::spawn(move || {
        let rows = std::fs::read_to_string(&pipe).expect("text");
        // Who opens it again waits for a reader.
        if rows.is_empty() {
            let _ = std::fs::read(&pipe);
        }
        rows
    });
    says(&["models/disk.xml", "--csv", &name, "--steps", "3"], 0);
    assert_eq!(reader.join().expect("no panic").lines().count(), 1 + 4);
    if Path::new("/dev/full").exists() {
        assert_has(&says(&["models/disk.xml", "--csv", "/dev/full"], 1), &["cannot write `/dev/full`: No space left"]);
    }
}

#[test]
fn what_cannot_be_written_is_said_before_the_run_and_names_the_file() {
    let json = Path::new(env!("CARGO_TARGET_TMPDIR")).join("never.json");
    let args = ["models/disk.xml", "--json", json.to_str().expect("UTF-8"), "--plot", "/no/such/x.png"];
    let text = says(&args, 1);
    assert_has(&text, &["error: cannot write `/no/such/x.png`: "]);
    assert!(!text.contains("os error") && !text.contains("energy J") && !json.exists(), "{text}");
    assert_has(&says(&["models/disk.xml", "--csv", "/no/such/x.csv"], 1), &["error: cannot write `/no/such/x.csv`: "]);
}

#[test]
fn files_of_a_run_that_is_interrupted_are_whole() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let [csv, json] = ["cut.csv", "cut.json"].map(|name| folder.join(name));
    let mut command = Command::new(env!("CARGO_BIN_EXE_penny"));
    [&csv, &json].into_iter().for_each(|path| _ = std::fs::remove_file(path));
    // The system may cut a write at a page's end if the program is killed in it. So few rows that they are written twice
    // a second, and the end comes between.
    command
        .args(["models/box.xml", "--time", "1e6", "--every", "5000"])
        .arg("--csv")
        .arg(&csv)
        .arg("--json")
        .arg(&json);
    let mut child =
        command.current_dir(crate::ROOT).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts");
    let size = |path: &PathBuf| std::fs::metadata(path).map_or(0, |m| m.len());
    while size(&csv) < 4000 || size(&json) < 4000 {
        std::thread::sleep(Duration::from_millis(1));
    }
    std::thread::sleep(Duration::from_millis(100));
    child.kill().and_then(|()| child.wait()).expect("it ends");
    let text = std::fs::read_to_string(&json).expect("the file");
    let value: serde_json::Value = serde_json::from_str(&text).expect("valid JSON");
    assert!(value["rows"].as_array().is_some_and(|rows| rows.len() > 10));
    let text = std::fs::read_to_string(&csv).expect("the file");
    assert!(text.ends_with('\n') && rows(&text).iter().all(|row| row.len() == 10));
    [csv, json].iter().for_each(|path| std::fs::remove_file(path).expect("it is there"));
}

/// The commonest slip of all.
#[test]
fn a_scene_without_a_joint_is_warned_about_and_has_no_nan() {
    let text = std::fs::read_to_string(crate::file("models/disk.xml")).expect("the model");
    let without: String = text.lines().filter(|l| !l.contains("<freejoint")).map(|l| format!("{l}\n")).collect();
    let path = scene("still.xml", &without);
    for command in ["check", "run"] {
        let text = says(&[command, path.to_str().expect("UTF-8")], 0);
        assert_has(&text, &["nothing in this scene moves", "<body", "<freejoint/>"]);
        assert!(!text.contains("NaN"), "{text}");
    }
    let empty = scene("nothing.xml", "<mujoco/>");
    assert_has(&says(&["check", empty.to_str().expect("UTF-8")], 0), &["nothing in this scene moves", "<worldbody>"]);
}

#[test]
fn numbers_below_zero_are_told_what_they_must_be() {
    for (option, number, rule) in [
        ("--time", "-1", "above 0"),
        ("--timestep", "-1e-3", "above 0"),
        ("--steps", "-3", "0 or more"),
        ("--every", "-1", "above 0"),
        ("--rounds", "-1", "above 0"),
        ("--key", "-1", "no keyframe `-1`"),
    ] {
        assert_has(&says(&["models/disk.xml", option, number], 2), &[number, rule]);
    }
    for option in ["--fps", "--speed", "--time"] {
        assert_has(&says(&["render", "models/disk.xml", "-o", "x.gif", option, "-1e1"], 2), &["-1e1", "above 0"]);
    }
    assert_has(&says(&["play", "models/disk.xml", "--seed", "-1"], 2), &["-1", "0 or more"]);
}

#[test]
fn a_run_that_nobody_could_wait_for_is_refused() {
    for option in [["--time", "1e300"], ["--timestep", "1e-300"], ["--steps", "9000000000000000"]] {
        assert_has(&says(&["models/disk.xml", option[0], option[1]], 2), &["steps", "the most is"]);
    }
    let short = says(&["models/disk.xml", "--time", "1e-9"], 2);
    assert_has(&short, &["1 ns is too short for a timestep of 1 ms", "--timestep"]);
}

#[test]
fn energy_from_nowhere_is_told_with_its_cause() {
    let text = std::fs::read_to_string(crate::file("models/disk.xml")).expect("the model");
    let change = |name: &str, from: &str, to: &str| {
        assert!(text.contains(from));
        scene(name, &text.replace(from, to)).display().to_string()
    };
    // In the ground to its middle: thrown out.
    let half = says(&[&change("half.xml", "pos=\"0 0 1.0\"", "pos=\"0 0 0\"")], 0);
    let warning = "warning: ground and disk_geom overlap by 200 mm at the start";
    assert_has(&half, &[warning, "the energy grew from 0 J to", "overlapped by 200 mm at the start"]);
    assert!(half.find(warning) < half.find("time s"), "said after the run:\n{half}");
    let stiff = says(&[&change("stiff_disk.xml", "solref=\"0.01 1.0\"", "solref=\"-1e9 -100\"")], 0);
    assert_has(&stiff, &["the energy grew from 9.79 J to", "the timestep is too long for ground – disk_geom"]);
    let swing = says(&["models/pendulum.xml", "--integrator", "explicit-euler", "--time", "20"], 0);
    assert_has(
        &swing,
        &["the energy grew from 15.9 J to 18.4 J", "explicit-euler adds energy to every oscillation", "rk4"],
    );
    for fine in [&["models/disk.xml"][..], &["models/pendulum.xml"], &["models/stack.xml", "--key", "push"]] {
        let text = says(fine, 0);
        assert!(!text.contains("energy grew") && !text.contains("overlap"), "{text}");
    }
}

#[test]
fn the_picture_of_a_run_says_how_it_began_and_has_both_energies() {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("run.svg");
    let draw = |args: &[&str]| {
        says(&[args, &["--steps", "500", "--plot", path.to_str().expect("UTF-8")]].concat(), 0);
        let svg = std::fs::read_to_string(&path).expect("the picture");
        // One text after another, without markup.
        let texts = svg.split('>').map(|part| part.split('<').next().unwrap_or("").trim());
        texts.filter(|text| !text.is_empty()).map(|text| format!("{text}\n")).collect::<String>()
    };
    let text = draw(&["models/disk_traction.xml", "--key", "roll"]);
    assert_has(&text, &["--key roll", "\nkinetic\n", "\npotential\n", "\nsum\n", "x of disk [m]"]);
    assert!(!text.contains("\ny\n") && text.contains("\nz\n"), "nothing happens along y:\n{text}");
    assert_has(&draw(&["models/top.xml", "--qvel", "0 0 100"]), &["--qvel", "0 0 100", "no phase picture"]);
}

/// No clock runs while a film is drawn, and the panel needs room.
#[cfg(feature = "play")]
#[test]
fn a_picture_with_the_panel_is_large_enough_for_it() {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("panel.png");
    let args = ["render", "models/disk.xml", "--panel", "--time", "0.02", "-o", path.to_str().expect("UTF-8")];
    says(&args, 0);
    let file = std::io::BufReader::new(std::fs::File::open(&path).expect("the picture"));
    let reader = png::Decoder::new(file).read_info().expect("a PNG");
    assert_eq!((reader.info().width, reader.info().height), (1280, 720));
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
    let output = command.current_dir(crate::ROOT).output().expect("penny starts");
    assert_eq!(output.status.code(), Some(1));
    assert_has(&stderr(&output), &["MuJoCo 4.0.0 is needed", "pip install mujoco==4.0.0", "PENNY_PYTHON"]);
}

/// With MuJoCo at hand (`PENNY_PYTHON`), a pendulum swings as it does there.
const DOUBLE_PENDULUM: &str = r#"<mujoco><option integrator="RK4"/><worldbody><body><joint axis="0 1 0"/>
    <geom type="capsule" fromto="0 0 0 1 0 0" size="0.02" contype="0" conaffinity="0"/><body pos="1 0 0"><joint axis="0 1 0"/>
    <geom type="capsule" fromto="0 0 0 1 0 0" size="0.02" contype="0" conaffinity="0"/></body></body></worldbody></mujoco>"#;

#[test]
fn a_film_has_the_accuracy_that_is_wanted() {
    let out = scene("film.xml", "").with_extension("png").display().to_string();
    let text =
        says(&["render", "models/box.xml", "--accuracy", "1e-4", "--time", "0.5", "--size", "64x48", "-o", &out], 0);
    assert_has(&text, &["100 µm wanted", "evaluations", "one picture"]);
    let text = says(&["render", "models/box.xml", "--accuracy", "1e-4", "--integrator", "rk4", "-o", &out], 2);
    assert_has(&text, &["--accuracy", "--integrator"]);
    let text = says(&["run", "models/box.xml", "--accuracy", "1e-4", "--steps", "10"], 2);
    assert_has(&text, &["--time instead of --steps"]);
}

#[test]
fn compare_measures_the_difference_from_mujoco() {
    if std::env::var_os("PENNY_PYTHON").is_none() {
        return;
    }
    let text = says(&["compare", "models/pendulum.xml", "--contact", "penalty"], 0);
    assert_has(&text, &["Largest |qpos difference|", "penalty", "never", "MuJoCo"]);
    let text = says(&["compare", "models/disk.xml", "--qvel", "2 0 0 0 10 0", "--steps", "1000"], 0);
    assert_has(&text, &["Why", "penalty: friction:", "disk", "mujoco: no difference", "tutorial has its own law"]);
    assert_has(&text, &["tolerance 1e-8: solver tolerance"]);
    assert_has(&text, &["Does the difference matter", "mujoco: no: it is below 1e-6", "tutorial: yes: "]);
    let text = says(&["compare", "models/pendulum.xml", "--contact", "penalty", "--accuracy", "1e-5"], 0);
    assert_has(&text, &["10 µm wanted", "penalty: no: ", "and MuJoCo's steps of 2 ms err by about"]);
    // Rounding alone parts the two after some thirty seconds: that is no disagreement.
    let path = scene("chaos.xml", DOUBLE_PENDULUM).display().to_string();
    let text = says(&["compare", &path, "--time", "45", "--timestep", "0.01", "--contact", "penalty"], 0);
    assert!(text.contains("trust horizon") || text.contains("is chaotic"), "{text}");
    let text = says(&["compare", "models/box.xml", "--integrator", "explicit-euler", "--steps", "10"], 0);
    assert_has(&text, &["integrator: MuJoCo has no explicit-euler and runs Euler"]);
    let fast = ["bench", "models/pendulum.xml", "--against", "mujoco", "--window", "0..0.1", "--contact", "penalty"];
    assert_has(&says(&[&fast[..], &["--integrator", "cash-karp"]].concat(), 0), &["MuJoCo has no cash-karp"]);
    assert!(!says(&[&fast[..], &["--integrator", "rk4"]].concat(), 0).contains("has no"));
    let text = std::fs::read_to_string(crate::file("models/point_mass.xml")).expect("the model");
    let path = scene("compared.xml", &text.replace("data=\"2500\"", "data=\"1e14\"")).display().to_string();
    let text = says(&["compare", &path, "--contact", "tutorial"], 1);
    assert_has(&text, &["tutorial: it diverged at", "--timestep", "error: the run diverged under tutorial"]);
    assert!(!text.contains("no difference"), "{text}");
}

/// A thousand steps, or as many as take 2 ms, from where a second of simulated time has led.
#[test]
fn no_step_after_the_first_allocates() {
    let mut measured = 0;
    for scene in ["models/stack.xml", "models/box.xml", "models/top.xml"] {
        let text = says(&["bench", scene], 0);
        assert!(!text.contains("MuJoCo") && text.contains("allocations: of memory"), "{text}");
        // law, integrator, time and its unit, contacts, allocations, hash
        for cells in text.lines().map(|l| l.split_whitespace().collect::<Vec<_>>()).filter(|cells| cells.len() == 7) {
            assert_eq!(cells[5], "0", "allocations in {scene} under {cells:?}");
            measured += 1;
        }
    }
    let methods = penny::contact::ALL.len() * penny::integrate::ALL.len();
    assert_eq!(measured, 3 * methods, "some method was not measured");
}

/// From the start, the state that is measured from is the start: its hash is the same under all methods.
#[test]
fn bench_measures_the_times_it_is_asked_for() {
    let text = says(&["bench", "models/point_mass.xml", "--window", "0..0.1", "--contact", "tutorial"], 0);
    let hashes: std::collections::BTreeSet<_> = text
        .lines()
        .filter(|l| l.trim_start().starts_with("tutorial"))
        .filter_map(|l| l.split_whitespace().last())
        .collect();
    assert_eq!(hashes.len(), 1, "{text}");
    // Many worlds begin in the same state.
    let many = [
        "bench",
        "models/point_mass.xml",
        "--window",
        "0..0.1",
        "--contact",
        "tutorial",
        "--worlds",
        "3",
        "--threads",
        "2",
    ];
    let crowd = says(&many, 0);
    assert!(hashes.iter().all(|hash| crowd.contains(hash)), "{crowd}");
    assert_has(&crowd, &["3 worlds on 2 threads"]);
    for wrong in ["1..0", "-1..2", "1", "0..x"] {
        assert_has(&says(&["bench", &format!("--window={wrong}")], 2), &["--window", "0..2"]);
    }
}

/// In place of valgrind stands a program that runs the child and says that it took 1000 instructions and 7 for each step and each
/// method before it.
#[test]
fn bench_counts_instructions_where_valgrind_is() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("counts");
    std::fs::create_dir_all(&folder).expect("a folder");
    let valgrind = folder.join("valgrind");
    let script = r#"#!/bin/sh
shift 2
"$@" >&2 || exit 1
echo "==1== Collected : $((1000 + (7 + ${4%:*}) * ${4#*:}))" >&2
"#;
    std::fs::write(&valgrind, script).expect("a file");
    std::fs::set_permissions(&valgrind, std::os::unix::fs::PermissionsExt::from_mode(0o755)).expect("a program");
    let bench = |path: &std::ffi::OsStr| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_penny"));
        command.args([
            "bench",
            "--contact",
            "tutorial",
            "--instructions",
            "--window",
            "0..0.1",
            "--",
            "models/point_mass.xml",
        ]);
        command.env("PATH", path).current_dir(crate::ROOT).output().expect("penny starts")
    };
    let path = std::env::join_paths([folder.clone(), "/bin".into(), "/usr/bin".into()]).expect("a path");
    let counted = bench(&path);
    let text = String::from_utf8_lossy(&counted.stdout);
    for (i, integrator) in penny::integrate::ALL.iter().enumerate() {
        let row =
            text.lines().find(|l| l.contains(&format!(" {} ", integrator.name))).unwrap_or_else(|| panic!("{text}"));
        // law, integrator, time and its unit, instructions
        let cells: Vec<&str> = row.split_whitespace().collect();
        assert_eq!(cells[4], (7 + i).to_string(), "{row}");
    }
    let missing = bench("/nowhere".as_ref());
    assert_has(&String::from_utf8_lossy(&missing.stderr), &["needs valgrind", "apt install valgrind"]);
    assert_eq!(missing.status.code(), Some(1));
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
    command.args(["models/box.xml", "--csv", "-"]).current_dir(crate::ROOT);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("penny starts");
    drop(child.stdout.take());
    assert!(child.wait().expect("it ends").success());
}

#[test]
fn a_scene_is_converted_to_one_file_without_classes() {
    let cube = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    let mesh = scene("convert_cube.obj", cube);
    let source = scene(
        "convert.xml",
        "<mujoco><asset><mesh file='convert_cube.obj'/></asset><default><geom rgba='1 0 0 1'/></default><worldbody>
         <frame pos='0 0 1'><body name='b'><freejoint/><geom size='0.1'/>
         <geom type='mesh' mesh='convert_cube' mass='0' contype='0' conaffinity='0'/></body></frame></worldbody></mujoco>",
    );
    let text = stdout(&penny(&["convert", source.to_str().unwrap()]));
    assert_has(
        &text,
        &[
            "<mesh file=\"convert_cube.obj\"/>",
            "<body name=\"b\" pos=\"0 0 1\" quat=\"1 0 0 0\">",
            "<geom size=\"0.1\" rgba=\"1 0 0 1\"/>",
        ],
    );
    // In another folder the mesh has another name, and is found.
    let elsewhere = mesh.with_file_name("convert_to").join("out.xml");
    std::fs::create_dir_all(elsewhere.parent().unwrap()).unwrap();
    assert!(penny(&["convert", source.to_str().unwrap(), "-o", elsewhere.to_str().unwrap()]).status.success());
    assert_has(&std::fs::read_to_string(&elsewhere).unwrap(), &["file=\"../convert_cube.obj\""]);
    assert_has(&says(&["check", elsewhere.to_str().unwrap()], 0), &["fine"]);
    assert_has(&says(&["convert", "models/box.xml", "-o", "models/box.xml"], 2), &["would overwrite"]);
    assert_has(&says(&["convert", "tests/mjcf/bad/zero_mass.xml"], 1), &["error[moving-without-mass]"]);
}

#[test]
fn explain_tells_tendons_and_equalities_as_springs() {
    let bar = says(&["explain", "models/four_bar.xml"], 0);
    assert_has(&bar, &["Tendons and equalities", "connect"]);
    assert!(!says(&["explain", "models/arm.xml"], 0).contains("Tendons and equalities"));
}

/// Where the run warns, `explain` does not say that nothing limits the scene; of a scene without motion it says nothing.
#[test]
fn explain_finds_what_makes_a_scene_unstable() {
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("tether.xml");
    let explained = |text: &str| {
        std::fs::write(&path, text).unwrap_or_else(|e| panic!("{e}"));
        says(&["explain", path.to_str().expect("UTF-8")], 0)
    };
    let tether = explained(
        r#"<mujoco><worldbody><body><joint name="x" type="slide" axis="0 0 1"/><geom size=".1" mass="1"/></body></worldbody>
           <tendon><fixed name="t" stiffness="1.1e6"><joint joint="x" coef="1"/></fixed></tendon></mujoco>"#,
    );
    assert_has(&tether, &["What limits this scene most\n  spring of tendon t: stable up to a timestep of 1.91 ms"]);
    let still = explained(r#"<mujoco><worldbody><geom size=".1"/></worldbody></mujoco>"#);
    assert!(!still.contains("gain energy"), "{still}");
}

/// What helps is in `solref` only where the law reads it, and is said in its words.
#[test]
fn explain_tells_of_solref_where_it_helps() {
    let stiff = |model: &str, cure: &str| {
        let text = says(&["explain", model], 0);
        let line = text.lines().find(|line| line.contains("the stiffness of ")).expect("a contact limits it");
        assert!(line.contains("stable up to a timestep of") && line.ends_with(cure), "{line}");
    };
    stiff("models/goal_2d.xml", "times this one (1 ms)");
    stiff("models/cradle.xml", "; a smaller stiffness in solref makes it softer");
}

#[test]
fn explain_has_no_numbers_that_are_none() {
    // Pressed by a spring, without a weight.
    let pressed = scene(
        "pressed.xml",
        "<mujoco><option gravity='0 0 0'/><worldbody><geom type='plane' size='1 1 1'/><body pos='0 0 0.1'>\
           <joint type='slide' axis='0 0 1' stiffness='100' springref='-0.1' damping='5'/><geom size='0.1'/>\
         </body></worldbody></mujoco>",
    );
    let pressed = pressed.to_str().expect("text");
    for args in [
        &["models/box.xml", "--solref", "0 0"][..],
        &["models/box.xml", "--solref", "0 -5"],
        &["models/box.xml", "--solref", "0 -5", "--all"],
        &[pressed, "--all"],
    ] {
        let run = penny(&[&["explain"], args].concat());
        let said = crate::said(&run);
        let wrong = said.split_whitespace().find(|word| ["NaN", "inf", "-inf"].contains(word));
        assert!(run.status.success() && wrong.is_none(), "{args:?}: {said}");
    }
}

#[test]
fn a_picture_is_of_the_time_that_was_asked_for() {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("at.png");
    let path = path.to_str().expect("text");
    for (more, told) in [(&["--time", "0.013"][..], "13 steps"), (&["--time", "0.013", "--from", "0.01"], "23 steps")] {
        let args = ["render", "models/box.xml", "--size", "16x16", "-o", path];
        let said = crate::said(&penny(&[&args[..], more].concat()));
        assert_has(&said, &["one picture", told]);
    }
}
