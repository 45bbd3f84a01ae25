//! What `check` and `run` doubt: each doubt where it is due, and a scene next to it where it is not.

use std::path::Path;
use std::process::Command;

/// All that `penny` says about a scene of the tests' own.
fn said(text: &str, command: &str, args: &[&str]) -> String {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("doubts");
    std::fs::create_dir_all(&folder).expect("a folder");
    // One file for each text, since tests run side by side.
    let hash = text.bytes().fold(0xcbf29ce484222325u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x100000001b3));
    let path = folder.join(format!("{hash:x}.xml"));
    std::fs::write(&path, text).expect("a scene");
    of_file(&path, command, args)
}

fn of_file(path: &Path, command: &str, args: &[&str]) -> String {
    let mut penny = Command::new(env!("CARGO_BIN_EXE_penny"));
    let output = penny.arg(command).arg(path).args(args).current_dir(crate::ROOT).output().expect("penny starts");
    crate::said(&output)
}

/// `check` says a doubt about the text, and none once `right` stands in the place of `wrong`.
#[track_caller]
fn doubted(text: &str, wrong: &str, right: &str, parts: &[&str]) {
    assert!(text.contains(wrong), "{wrong}");
    let found = said(text, "check", &[]);
    for part in parts {
        assert!(found.contains(part), "`{part}` is missing in:\n{found}");
    }
    let fine = said(&text.replace(wrong, right), "check", &[]);
    assert!(fine.trim_end().ends_with(": fine"), "{right}:\n{fine}");
}

const ARM: &str = r#"<mujoco><compiler angle="ANGLE"/><worldbody><body name="arm" pos="0 0 1"><joint name="elbow" axis="0 1 0"
    range="RANGE" damping=".2"/><geom type="capsule" fromto="0 0 0 .3 0 0" size=".02" mass=".5"/></body></worldbody>
    <actuator><position name="servo" joint="elbow" kp="5" ctrlrange="CTRL"/></actuator></mujoco>"#;

fn arm(angle: &str, range: &str, ctrl: &str) -> String {
    ARM.replace("ANGLE", angle).replace("RANGE", range).replace("CTRL", ctrl)
}

#[test]
fn units_of_angles_are_doubted_both_ways() {
    let turns = "90 rad are 14.3 turns";
    doubted(
        &arm("degree", "-90 90", "-180 90"),
        "-180 90",
        "-3 3",
        &["servo on a hinge is in radians", "-3.142 1.571"],
    );
    doubted(
        &arm("radian", "-45 90", "-1 1"),
        "-45 90",
        "-.7 1.5",
        &[turns, "write `-0.7854 1.571`", "angle=\"degree\""],
    );
    doubted(&arm("degree", "-1.5708 1.5708", "-1 1"), "-1.5708 1.5708", "-90 90", &["looks like radians"]);
    let tilted = r#"<mujoco><compiler angle="radian"/><worldbody><body euler="0 30 0"><freejoint/><geom size=".1"/></body></worldbody></mujoco>"#;
    doubted(tilted, "0 30 0", "0 .5 0", &["`euler` looks like degrees"]);
    // A wheel of a few turns, a screw of many, a slide in metres.
    for range in ["-10 10", "-62.8 62.8"] {
        let found = said(&arm("radian", range, "-1 1"), "check", &[]);
        assert!(!found.contains("warning"), "{found}");
    }
    let slide = arm("radian", "-45 90", "-45 90").replace("axis=\"0 1 0\"", "type=\"slide\"");
    assert!(!said(&slide, "check", &[]).contains("warning"));
}

#[test]
fn other_units_are_doubted() {
    let ball = r#"<mujoco><option gravity="0 0 -9.81"/><worldbody><body name="ball"><freejoint/><geom size=".05" MASS/></body></worldbody></mujoco>"#;
    doubted(&ball.replace("MASS", "density=\"7.85\""), "7.85", "7850", &["7.85 g/cm³ are `7850`"]);
    doubted(&ball.replace("MASS", "mass=\"500\""), "500", ".5", &["ball weighs 500 kg in 524 cm³", "500 g are 0.5 kg"]);
}

#[test]
fn gravity_is_doubted_in_millimetres_and_upwards() {
    let ball = r#"<mujoco><option gravity="0 0 -9810"/><worldbody><body><freejoint/><geom size=".05"/></body></worldbody></mujoco>"#;
    doubted(ball, "-9810", "-9.81", &["gravity is 9810 m/s²", "9810 mm/s² are 9.81"]);
    doubted(&ball.replace("-9810", "9.81"), "9.81", "-24.8", &["gravity points up", "write -9.81"]);
    let big = ball.replace("-9810", "-9.81").replace("size=\".05\"", "type=\"box\" size=\"100 50 20\"");
    doubted(&big, "100 50 20", ".1 .05 .02", &["lengths are in m", "mm are"]);
}

#[test]
fn an_impedance_that_falls_with_depth_is_doubted() {
    let cube =
        r#"<mujoco><worldbody><body><freejoint/><geom size=".1" solimp="0.98 0.9 0.002"/></body></worldbody></mujoco>"#;
    doubted(cube, "0.98 0.9", "0.9 0.98", &["falls from 0.98 to 0.9", "`0.9 0.98 0.002` rises"]);
    doubted(&cube.replace("0.98 0.9 0.002", ".97"), ".97", ".92", &["falls from 0.97 to 0.95"]);
    // Without a width d is dmax at any depth.
    assert!(!said(&cube.replace("0.98 0.9 0.002", ".98 .9 0"), "check", &[]).contains("falls"));
}

#[test]
fn typographic_signs_are_named() {
    let text =
        r#"<mujoco><worldbody><geom pos="0 0 ‑0.5" size=".1"/><geom pos="0 0 －1" size=".1"/></worldbody></mujoco>"#;
    let found = said(text, "check", &[]);
    assert!(found.contains("did you mean `-0.5`?") && found.contains("did you mean `-1`?"), "{found}");
    for quoted in ["“0 0 1”", "„0 0 1“", "‘0 0 1’"] {
        let found =
            said(&format!("<mujoco><worldbody><geom pos={quoted} size=\".1\"/></worldbody></mujoco>"), "check", &[]);
        assert!(found.contains("is a typographic quote") && found.contains(": 1 error"), "{found}");
    }
}

#[test]
fn what_is_too_light_for_mujoco_is_said_to_be() {
    let worm = r#"<mujoco><worldbody><body name="head"><freejoint/><geom size="4e-5"/></body></worldbody></mujoco>"#;
    let found = said(worm, "check", &[]);
    assert!(
        found.contains("too little inertia for MuJoCo: 1.7e-19 kg m²") && !found.contains("without weight"),
        "{found}"
    );
    let bound = worm.replace("<worldbody>", "<compiler boundinertia=\"1e-14\"/><worldbody>");
    assert!(!said(&bound, "check", &[]).contains("error"));
}

/// What MuJoCo 4.0.0 does of it, and what is said.
#[test]
fn gravity_is_compensated_only_where_some_body_has_it_above_0() {
    let falls = |first: f64, second: f64| {
        let body = |z: f64, comp: f64| {
            let inside = "<joint type='slide' axis='0 0 1'/><geom size='.1'/>";
            format!("<body pos='0 0 {z}' gravcomp='{comp}'>{inside}</body>")
        };
        let text = format!("<mujoco><worldbody>{}{}</worldbody></mujoco>", body(0.0, first), body(9.0, second));
        let mut sim = crate::sim::Sim::new(&text);
        sim.step();
        let told = said(&text, "check", &[]).contains("has no effect, as in MuJoCo");
        ([0, 1].map(|d| (sim.data.qacc[d] / 9.81 * 1e9).round() / 1e9), told)
    };
    assert_eq!(falls(-1.0, 0.0), ([-1.0, -1.0], true));
    assert_eq!(falls(-1.0, 0.5), ([-2.0, -0.5], false));
}

#[test]
fn a_link_in_its_mount_is_doubted_with_a_cure_that_it_has() {
    let link = r#"<mujoco><worldbody><body name="mount" pos="0 0 1.5"><geom name="housing" type="cylinder" size=".05 .05"/>
        <body name="link"><joint axis="0 1 0"/><geom name="rod" type="capsule" size=".03" fromto="0 0 0 .3 0 -.4"/></body></body></worldbody></mujoco>"#;
    let cure = r#"<contact><exclude body1="link" body2="mount"/></contact>"#;
    doubted(
        link,
        "</mujoco>",
        &format!("{cure}</mujoco>"),
        &["rod and housing overlap by", "a joint holds them together", cure],
    );
    assert!(said(link, "run", &["--steps", "1"]).contains(cure));
    let ball = r#"<mujoco><worldbody><geom name="ground" type="plane" size="1 1 1"/><body pos="0 0 .05"><freejoint/><geom size=".1"/></body></worldbody></mujoco>"#;
    doubted(ball, "0 0 .05", "0 0 .1", &["begin with them apart"]);
}

#[test]
fn a_start_beyond_limits_and_quaternions_of_no_length_are_doubted() {
    let mut joint = arm("degree", "20 90", "-1 1");
    doubted(&joint, "20 90", "-20 90", &["beyond its limits at the start: elbow at 0 rad, its range is 0.349 to 1.57"]);
    joint = arm("degree", "-20 90", "-1 1")
        .replace("</mujoco>", r#"<keyframe><key name="up" qpos="2"/></keyframe></mujoco>"#);
    doubted(&joint, "qpos=\"2\"", "qpos=\"1.5\"", &["in keyframe up: elbow at 2 rad"]);
    // A straight knee, two degrees beyond its range, is no throw. What holds in several starts is said once.
    assert!(!said(&arm("degree", "2 160", "-1 1"), "check", &[]).contains("beyond"));
    let both = arm("degree", "20 90", "-1 1").replace(
        "</mujoco>",
        r#"<keyframe><key qpos="0"/><key qpos="1"/><key name="down" qpos="0"/></keyframe></mujoco>"#,
    );
    let found = said(&both, "check", &[]);
    assert!(found.contains("at the start and in keyframes 0, down: elbow at 0 rad"), "{found}");
    assert_eq!(found.matches("beyond").count(), 1, "{found}");
    let ball = r#"<mujoco><worldbody><body name="ball"><freejoint/><geom size=".1"/></body></worldbody>
        <keyframe><key qpos="0 0 1 0 0 0 0"/></keyframe></mujoco>"#;
    doubted(
        ball,
        "0 0 1 0 0 0 0",
        "0 0 1 .7071 .7071 0 0",
        &["quaternion of body `ball` is 0 0 0 0", "counts as `1 0 0 0`"],
    );
    let ball = &ball.split("<keyframe>").next().map_or_else(String::new, |ball| format!("{ball}</mujoco>"));
    let found = said(ball, "run", &["--qpos", "0 0 1 0 0 0 0", "--steps", "1"]);
    assert!(found.contains("warning: the quaternion of ball is 0 0 0 0"), "{found}");
    assert!(!said(ball, "run", &["--steps", "1"]).contains("quaternion"));
}

#[test]
fn a_control_that_counts_as_less_is_told() {
    let text = arm("degree", "-90 90", "-1 1");
    assert!(said(&text, "run", &["--ctrl", "5", "--steps", "1"]).contains("ctrl 5 of servo counts as 1"));
    assert!(!said(&text, "run", &["--ctrl", "1", "--steps", "1"]).contains("counts as"));
    let open = text.replace("ctrlrange=\"-1 1\"", "");
    let found = said(&open, "run", &["--ctrl", "45", "--steps", "1"]);
    assert!(found.contains("servo asks for 45 rad, 7.16 turns of elbow"), "{found}");
    assert!(!said(&open, "run", &["--ctrl", "6", "--steps", "1"]).contains("asks for"));
    let key = text.replace("</mujoco>", r#"<keyframe><key name="far" ctrl="3"/></keyframe></mujoco>"#);
    doubted(&key, "ctrl=\"3\"", "ctrl=\"1\"", &["ctrl 3 of servo counts as 1", "keyframe far"]);
}

const WRIST: &str = r#"<mujoco><compiler angle="radian"/><option timestep="0.002" gravity="0 0 0"/><worldbody><body name="wrist">
    <joint name="roll" axis="0 0 1"/><inertial pos="0 0 0" mass="0.4" diaginertia="4e-4 4e-4 4e-4"/></body></worldbody>
    <actuator><position name="servo" joint="roll" kp="400" kv="40"/></actuator></mujoco>"#;

/// kv/I = 1e5 /s, so h < 2e-5 s; what takes kv implicitly is stable at 2 ms.
#[test]
fn a_servo_too_stiff_for_the_timestep_is_told_before_the_run() {
    let found = said(WRIST, "run", &["--ctrl", ".5", "--time", ".1"]);
    let warning = "servo of joint roll is unstable at this timestep of 2 ms; the largest stable one with semi-implicit-euler is 20 µs";
    assert!(found.contains(warning) && found.contains("--integrator implicitfast, stable at 2 ms"), "{found}");
    let advised = said(WRIST, "run", &["--ctrl", ".5", "--time", ".1", "--integrator", "implicitfast"]);
    assert!(!advised.contains("warning") && !advised.contains("error"), "{advised}");
    let advised = said(WRIST, "run", &["--ctrl", ".5", "--time", ".1", "--timestep", "1.9e-5"]);
    assert!(!advised.contains("warning") && !advised.contains("error"), "{advised}");
    // A stiff spring of the joint itself, and a servo that is not stiff.
    let spring = WRIST
        .replace("axis=\"0 0 1\"", "axis=\"0 0 1\" stiffness=\"4000\"")
        .replace("kp=\"400\" kv=\"40\"", "kp=\"1\"");
    assert!(said(&spring, "run", &["--steps", "1"]).contains("joint roll is unstable"));
    let soft = WRIST.replace("kp=\"400\" kv=\"40\"", "kp=\"4\" kv=\".04\"");
    assert!(!said(&soft, "run", &["--ctrl", ".5", "--time", ".1"]).contains("warning"));
}

#[test]
fn explicit_euler_is_named_where_it_is_the_cause() {
    let text = r#"<mujoco><option timestep="0.02"/><worldbody><body pos="0 0 2"><joint axis="0 1 0"/><geom type="capsule"
        fromto="0 0 0 0 0 -1" size=".05" mass="1" contype="0"/></body></worldbody></mujoco>"#;
    let found = said(text, "run", &["--integrator", "explicit-euler", "--qpos", "2"]);
    assert!(
        found.contains("explicit-euler adds energy to every oscillation") && !found.contains("too long"),
        "{found}"
    );
    let found = said(text, "run", &["--integrator", "semi-implicit-euler", "--qpos", "2"]);
    assert!(!found.contains("warning"), "{found}");
}

/// 30 m/s for 2 ms are 60 mm, and v/(e ω) = 0.22 m.
#[test]
fn what_would_pass_through_a_wall_is_told_and_the_advice_stops_it() {
    let text = r#"<mujoco><option gravity="0 0 0"/><worldbody><geom name="wall" type="box" size=".005 1 1" pos="1 0 0"/>
        <body name="ball"><freejoint/><geom name="ball" size=".02" mass=".01"/></body></worldbody></mujoco>"#;
    let run = |args: &[&str]| said(text, "run", &[&["--time", ".1"], args].concat());
    let found = run(&["--qvel", "30 0 0 0 0 0"]);
    assert!(found.contains("60 mm in one step") && found.contains("221 mm deep"), "{found}");
    assert!(found.contains("a total thickness of 50 mm"), "{found}");
    let found = run(&["--qvel", "30 0 0 0 0 0", "--timestep", "1e-4"]);
    assert!(found.contains("221 mm deep") && !found.contains("in one step"), "{found}");
    let found = run(&["--qvel", "30 0 0 0 0 0", "--solref", "0.001 1", "--timestep", "2e-4"]);
    assert!(!found.contains("warning"), "{found}");
    for calm in ["3 0 0 0 0 0", "-30 0 0 0 0 0", "0 30 0 0 0 0"] {
        assert!(!run(&["--qvel", calm]).contains("warning"), "{calm}");
    }
}

/// Energy is weighed against the least that there was: a coin that settles and dances again.
#[test]
fn energy_that_comes_back_is_told() {
    let coin = r#"<mujoco><option timestep="0.001" cone="elliptic"/><default><geom friction="0.3 0.0005 0.00005" condim="6" solref="0.005 1"/></default>
        <worldbody><geom name="table" type="plane" size="1 1 .1"/><body name="coin" pos="0 0 0.01215"><freejoint/>
        <geom name="coin" type="cylinder" size="0.01213 0.000875" mass="0.00567"/></body>
        <body pos="0 0 -9"><geom size="1"/></body></worldbody></mujoco>"#;
    let start = ["--qpos", "0 0 0.01215 0.71934 0.69466 0 0", "--qvel", "0 0 0 0 40 0"];
    let found = said(coin, "run", &[&start[..], &["--contact", "tutorial"]].concat());
    assert!(found.contains("the energy grew from"), "{found}");
    let found = said(coin, "run", &start);
    assert!(!found.contains("energy grew"), "{found}");
}

/// A motor's work is no instability: x(1 s) = F t²/(2 m) = 0.5 m.
#[test]
fn a_driven_scene_is_swept_as_stable() {
    let text = r#"<mujoco><option gravity="0 0 0"/><worldbody><body><joint type="slide" axis="1 0 0"/><geom type="box" size=".1 .1 .1" mass="1"/>
        </body></worldbody><actuator><motor/></actuator></mujoco>"#.replace("<motor/>", "<motor joint=\"x\"/>").replace("<joint type", "<joint name=\"x\" type");
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("driven");
    let out = out.to_str().expect("UTF-8");
    let found = said(&text, "sweep", &["--ctrl", "1", "--out", out, "--timesteps", "1e-2,1e-3", "--laws", "all"]);
    assert!(!found.contains("unstable") && found.contains("rk4"), "{found}");
    std::fs::remove_dir_all(out).expect("it is there");
}

/// The scenes of this repository, each from all its starts.
#[test]
fn nothing_is_doubted_in_models() {
    for entry in std::fs::read_dir(crate::file("models")).expect("a folder") {
        let path = entry.expect("a file").path();
        let found = of_file(&path, "check", &[]);
        assert!(found.trim_end().ends_with(": fine"), "{}:\n{found}", path.display());
        let model = penny::load(&path).unwrap_or_else(|e| panic!("{e}")).model;
        let keys = (0..model.keyframes.len()).map(|i| vec!["--key".to_owned(), i.to_string()]);
        for key in keys.chain([Vec::new()]) {
            let mut args = vec!["--steps", "200"];
            args.extend(key.iter().map(String::as_str));
            let found = of_file(&path, "run", &args);
            assert!(!found.contains("warning"), "{} {key:?}:\n{found}", path.display());
        }
    }
}

/// What `explain` says of joints, limits, servos and loads, against closed forms.
#[test]
fn explain_knows_servos_limits_and_loads() {
    let line = |text: &str, begin: &str| {
        let mut lines = text.lines().map(|l| l.split_whitespace().collect::<Vec<_>>().join(" "));
        lines.find(|l| l.starts_with(begin)).unwrap_or_else(|| panic!("no `{begin}` in\n{text}"))
    };
    let wrist = said(WRIST, "explain", &[]);
    // ω = √(400/4e-4), ζ = 40/(2 √(400 · 4e-4)), h < 2(√(ζ² + 1) − ζ)/ω.
    assert_eq!(line(&wrist, "servo "), "servo roll 400 N m/rad 40 N m s/rad 1 krad/s 50 0 rad 20 µs");
    assert!(
        wrist.contains("servo of joint roll: stable up to a timestep of 20 µs") && wrist.contains("implicitfast"),
        "{wrist}"
    );

    // 0.5 kg at 0.15 m on kp 5: m g l/kp = 0.147 rad.
    let arm = said(&arm("degree", "-90 90", "-1 1"), "explain", &[]);
    assert!(line(&arm, "servo ").contains("147 mrad"), "{arm}");

    // kp (1 − 0.3) = 350 N on the stop.
    let rail = r#"<mujoco><worldbody><body><joint name="rail" type="slide" axis="1 0 0" range="-0.3 0.3"/><geom type="box" size=".05 .05 .05" mass="1"/>
        </body></worldbody><actuator><position name="drive" joint="rail" kp="500" ctrlrange="-1 1"/></actuator></mujoco>"#;
    let found = line(&said(rail, "explain", &[]), "rail -0.3");
    assert_eq!(found, "rail -0.3 to 0.3 m 2.5 kN/m 100 N s/m 50 rad/s 1 350 N of drive 7 mm");
    let end = said(rail, "run", &["--ctrl", "1", "--time", "2"]);
    let last = end.lines().rfind(|l| l.trim_start().starts_with("2.000")).expect("a line").to_owned();
    let goes: f64 = last.split_whitespace().nth(1).expect("a cell").parse().expect("a number");
    // The servo has let go by 2 % of it there.
    assert!((goes - 0.3069).abs() < 2e-4, "{last}");

    let heavy = r#"<mujoco><worldbody><geom name="ground" type="plane" size="2 2 .1"/>
        <body name="light" pos="0 0 0.1"><freejoint/><geom name="light" type="box" size="0.1 0.1 0.1" mass="1"/></body>
        <body name="heavy" pos="0 0 0.301"><freejoint/><geom name="heavy" type="box" size="0.1 0.1 0.1" mass="1000"/></body></worldbody></mujoco>"#;
    let found = said(heavy, "explain", &[]);
    // 1001 kg · 9.81 m/s².
    assert!(line(&found, "ground – light").contains("9.82 kN 49"), "{found}");
    assert!(found.contains("mass ratio 1001 : 1") && found.contains("the depth of ground – light: 49"), "{found}");
}

#[test]
fn explain_says_where_contact_parameters_come_from() {
    let text = r#"<mujoco><worldbody><geom name="floor" type="plane" size="2 2 .1" friction="1" solref=".02 1"/>
        <body pos="0 0 .1"><freejoint/><geom name="puck" type="box" size=".1 .1 .1" friction=".1" solref=".01 1"/></body></worldbody></mujoco>"#;
    let found = said(text, "explain", &[]);
    assert!(found.contains("friction 1: the larger of floor 1, puck 0.1"), "{found}");
    assert!(found.contains("solref 0.015 1: mean of two, floor 0.02 1, puck 0.01 1"), "{found}");
    let one = text.replace("solref=\".01 1\"", "solref=\".01 1\" priority=\"1\"");
    assert!(said(&one, "explain", &[]).contains("of puck, which has the higher priority"));
}

/// Fits a screen, and says so where something was left out.
#[test]
fn explain_of_an_arm_fits_a_screen() {
    let mut bodies = String::new();
    for _ in 0..5 {
        bodies = format!(
            "<body pos='0 0 .3' euler='0 .4 0'><joint axis='0 1 0'/><geom fromto='0 0 0 0 0 .3' size='.04'/>{bodies}</body>"
        );
    }
    let text = format!(
        "<mujoco><compiler angle='radian'/><default><joint damping='2' range='-3.14 3.14'/><geom type='capsule' mass='2'/></default>
         <worldbody><geom type='plane' size='2 2 .1'/><body pos='0 0 .15'><joint axis='0 0 1'/><geom fromto='0 0 0 0 0 .1' size='.06'/>{bodies}</body>
         </worldbody></mujoco>"
    );
    let found = said(&text, "explain", &[]);
    let n = found.lines().count();
    assert!(
        n <= 50 && found.contains("hinge 5") && found.contains("(5 more alike)") && found.contains("--all"),
        "{n} lines:\n{found}"
    );
}

/// Numbers of a right scene, each made wrong (unit, sign, order, power of ten): `check` and `explain` lead to it.
#[test]
fn one_wrong_number_is_led_to() {
    let right = r#"<mujoco><compiler angle="degree"/><option timestep="0.002" gravity="0 0 -9.81"/><worldbody>
        <geom name="floor" type="plane" size="3 3 .1" solref="0.02 1" solimp="0.9 0.95 0.001" friction="1 0.005 0.0001"/>
        <body name="arm" pos="0 0 1"><joint name="elbow" axis="0 1 0" range="-90 90" damping="0.2"/>
          <geom name="rod" type="capsule" fromto="0 0 0 .3 0 0" size=".02" density="1100"/></body>
        <body name="crate" pos="1 0 .1"><freejoint/><geom name="crate" type="box" size=".1 .1 .1" mass="2" solref="0.02 1"/></body>
        </worldbody><actuator><position name="servo" joint="elbow" kp="20" kv="1" ctrlrange="-1.5 1.5"/></actuator></mujoco>"#;
    let all = |text: &str| said(text, "check", &[]) + &said(text, "explain", &[]);
    assert!(!all(right).contains("warning"), "{}", all(right));
    for (from, to, says) in [
        // Units.
        ("range=\"-90 90\"", "range=\"-1.5708 1.5708\"", "`range` looks like radians"),
        ("ctrlrange=\"-1.5 1.5\"", "ctrlrange=\"-90 90\"", "servo on a hinge is in radians"),
        ("density=\"1100\"", "density=\"1.1\"", "1.1 g/cm³ are `1100`"),
        ("mass=\"2\"", "mass=\"2000\"", "crate weighs 2000 kg"),
        ("0 0 -9.81", "0 0 -9810", "gravity is 9810 m/s²"),
        ("timestep=\"0.002\"", "timestep=\"2\"", "a timestep of 2 s"),
        ("size=\".1 .1 .1\"", "size=\"100 100 100\"", "crate is 346 m across"),
        ("mass=\"2\"", "mass=\"0.002\"", "crate weighs 0.002 kg in 8 l"),
        ("size=\".1 .1 .1\"", "size=\".0001 .0001 .0001\"", "no material is so dense: crate"),
        // Signs.
        ("0 0 -9.81", "0 0 9.81", "gravity points up"),
        ("range=\"-90 90\"", "range=\"20 90\"", "beyond its limits at the start: elbow"),
        ("pos=\"1 0 .1\"", "pos=\"1 0 -.1\"", "floor and crate overlap by 200 mm"),
        // Order.
        ("0.9 0.95 0.001", "0.95 0.9 0.001", "falls from 0.95 to 0.9"),
        ("mass=\"2\" solref=\"0.02 1\"", "mass=\"2\" solref=\"1 0.02\"", "did you mean `0.02 1`?"),
        ("1 0.005 0.0001", "0.005 1 0.0001", "did you mean `1 0.005 0.0001`?"),
        ("range=\"-90 90\"", "range=\"90 -90\"", "`range` limits nothing"),
        // Powers of ten.
        ("kv=\"1\"", "kv=\"1000\"", "servo of joint elbow: stable up to a timestep of"),
        ("pos=\"1 0 .1\"", "pos=\"1 0 .01\"", "floor and crate overlap by 90 mm"),
        ("mass=\"2\" solref=\"0.02 1\"", "mass=\"2\" solref=\"2 1\"", "the depth of floor – crate"),
    ] {
        assert!(right.contains(from), "{from}");
        let found = all(&right.replace(from, to));
        assert!(found.contains(says), "{from} as {to}: `{says}` is missing in\n{found}");
    }
}

/// Thrust on a free body has no potential here: what it gains is no error, and nothing is said of it.
#[test]
fn what_drives_without_a_potential_is_not_judged() {
    let text = r#"<mujoco><option gravity="0 0 0"/><worldbody><body name="rocket"><joint name="free" type="free"/><geom size=".1" mass="1"/></body></worldbody>
        <actuator><motor joint="free" gear="0 0 1 0 0 0"/></actuator></mujoco>"#;
    let found = said(text, "run", &["--ctrl", "5", "--time", "1"]);
    assert!(!found.contains("warning") && found.contains("actuators +12.5 J"), "{found}");
}
