//! What people who simulate for a living or a course asked about: for each kind of question the scene that stands for it
//! and three more.

use std::path::{Path, PathBuf};
use std::process::Command;

use penny::contact;
use penny::mjcf;
use penny::model::Model;
use penny::state::State;
use penny_lab::record;
use serde::Deserialize;

use crate::sim::Sim;

/// A scene's text in a file of its own.
fn file(text: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("cases");
    std::fs::create_dir_all(&folder).expect("a folder");
    // One file for each text, since tests run side by side.
    let hash = text.bytes().fold(0xcbf29ce484222325u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x100000001b3));
    let path = folder.join(format!("{hash:x}.xml"));
    std::fs::write(&path, text).expect("a scene");
    path
}

/// What a command says of a scene.
fn said(command: &str, text: &str, args: &[&str]) -> String {
    let mut penny = Command::new(env!("CARGO_BIN_EXE_penny"));
    let output = penny.arg(command).arg(file(text)).args(args).current_dir(crate::ROOT).output();
    crate::said(&output.expect("penny starts"))
}

#[track_caller]
fn has(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "`{part}` is missing in\n{text}");
    }
}

fn world(inside: &str) -> String {
    format!("<mujoco><worldbody>{inside}</worldbody></mujoco>")
}

const PLANE: &str = "<geom name='ground' type='plane' size='5 5 .1'/>";

fn free(name: &str, pos: &str, geom: &str) -> String {
    format!("<body name='{name}' pos='{pos}'><freejoint/><geom name='{name}' {geom}/></body>")
}

/// The largest of the velocities.
fn fastest(sim: &Sim) -> f64 {
    sim.state.qvel.iter().fold(0.0, |m: f64, v| m.max(v.abs()))
}

/// How far anything has gone from where it began, x and y of free bodies only.
fn aside(sim: &Sim) -> f64 {
    let start = State::new(&sim.model).qpos;
    let of = |(q, s): (&[f64], &[f64])| (q[0] - s[0]).abs().max((q[1] - s[1]).abs());
    sim.state.qpos.chunks(7).zip(start.chunks(7)).map(of).fold(0.0, f64::max)
}

#[derive(Deserialize)]
struct Golden {
    name: String,
    xml: String,
    refused: Option<String>,
    #[serde(default)]
    nkey: usize,
    #[serde(default)]
    qpos1: Vec<f64>,
    #[serde(default)]
    qvel1: Vec<f64>,
    #[serde(default)]
    qpos199: Vec<f64>,
    #[serde(default)]
    qvel199: Vec<f64>,
}

/// Every scene of tests/golden/topics/cases.py under MuJoCo's law: after one step and after 200, or refused.
#[test]
fn what_mujoco_makes_of_them_penny_makes_of_them() {
    let text = std::fs::read_to_string(crate::file("tests/golden/cases.json")).expect("golden data");
    let scenes: Vec<Golden> = serde_json::from_str(&text).expect("JSON");
    let mut wrong = String::new();
    for Golden { name, xml, refused, nkey, qpos1, qvel1, qpos199, qvel199 } in scenes {
        match (penny::parse("case.xml", &xml), refused) {
            (Err(_), Some(_)) => continue,
            (Ok(_), Some(refused)) => wrong += &format!("{name}: {xml}\n  is refused by MuJoCo: {refused}\n"),
            (Err(failure), None) => wrong += &format!("{name}: {xml}\n{failure}\n"),
            (Ok(_), None) => {
                let mut sim = Sim::law(&xml, "mujoco");
                let exact = sim.model.requires.colliders.iter().all(|[a, b]| penny::collision::exact(*a, *b));
                assert_eq!(sim.model.keyframes.len(), nkey, "{xml}");
                if let Some(key) = sim.model.keyframes.first() {
                    sim.state = State::at(&sim.model, key);
                }
                for (steps, qpos, qvel) in [(1, qpos1, qvel1), (199, qpos199, qvel199)] {
                    (0..steps).for_each(|_| sim.step());
                    let ours = sim.state.qpos.iter().chain(&sim.state.qvel);
                    let off = ours.zip(qpos.iter().chain(&qvel)).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
                    // Rounding, and what 200 steps of impacts make of it; where contacts hang on the last bits, one step.
                    let allowed = match (steps, exact) {
                        (1, _) => 1e-11,
                        (_, true) => 1e-8,
                        (_, false) => 0.1,
                    };
                    if off > allowed || sim.state.qpos.len() != qpos.len() {
                        wrong += &format!("{name}: {xml}\n  off by {off:e} after {steps} steps\n");
                    }
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

/// v = ω r, and no rolling friction: it goes on. Under every law, whichever geom comes first.
#[test]
fn what_rolls_goes_on_rolling() {
    let floor = "<geom type='box' size='9 9 .1' pos='0 0 -.1'/>";
    let ball = |z: f64| free("b", &format!("0 0 {z}"), "size='.05'");
    let cases = [
        (format!("{floor}{}", ball(0.0499)), [0.3, 6.0]),
        (format!("{}{floor}", ball(0.0499)), [0.3, 6.0]),
        (format!("{}<body>{floor}</body>", ball(0.0499)), [-0.5, -10.0]),
        (format!("<geom type='cylinder' size='9 .1' pos='0 0 -.1'/>{}", ball(0.0499)), [1.0, 20.0]),
    ];
    for ((inside, [v, w]), law) in cases.iter().flat_map(|case| contact::ALL.iter().map(move |law| (case, law))) {
        let mut sim = Sim::law(&world(inside), law.name);
        (sim.state.qvel[0], sim.state.qvel[4]) = (*v, *w);
        sim.run(1.0);
        let [v_end, w_end] = [sim.state.qvel[0], sim.state.qvel[4]];
        // The settling of the start presses on the rim: 0.3 % under MuJoCo's law; the course's rests 4 mm deep, and rolls
        // on the radius that is left.
        let allowed = if law.name == "tutorial" { 0.1 } else { 5e-3 };
        assert!(
            (v_end / v - 1.0).abs() < allowed && (w_end / w - 1.0).abs() < allowed,
            "{}: {v_end} {w_end}\n{inside}",
            law.name
        );
    }
}

/// A seesaw turns about its centre of mass, of which `invweight0` says that it does not move: the ground and an equality hold
/// it all the same, hardly otherwise than one whose pivot is a micrometre beside. Under every law.
#[test]
fn what_turns_about_its_centre_of_mass_can_be_touched_and_held() {
    let seesaw = |beside: f64| {
        let plank = format!("<geom type='box' size='1 .1 .02' pos='{beside} 0 0'/>");
        let plank = format!("<body pos='0 0 .3'><joint axis='0 1 0'/>{plank}</body>");
        world(&format!("{PLANE}{plank}{}", free("kid", ".6 0 .5", "size='.1' mass='20'")))
    };
    for law in contact::ALL {
        let [exact, beside] = [0.0, 1e-6].map(|beside| {
            let mut sim = Sim::law(&seesaw(beside), law.name);
            sim.run(0.5);
            sim.state.qpos
        });
        assert!(
            exact[0] > 0.2 && exact.iter().zip(&beside).all(|(a, b)| (a - b).abs() < 1e-2),
            "{}: {exact:?}",
            law.name
        );
    }
    let held =
        "<mujoco><worldbody><body name='a'><joint axis='0 1 0'/><geom type='box' size='.5 .05 .02'/></body></worldbody>
        <equality><connect body1='a' anchor='.4 0 0'/></equality></mujoco>";
    let [penalty, mujoco] = ["penalty", "mujoco"].map(|law| {
        let mut sim = Sim::law(held, law);
        sim.state.qvel[0] = 1.0;
        sim.run(0.1);
        sim.state.qpos[0]
    });
    assert!(penalty != 0.0 && (penalty - mujoco).abs() < 1e-9, "{penalty} {mujoco}");
}

/// A tendon within one body moves nothing, whatever limits it and rubs in it. Under every law.
#[test]
fn a_tendon_that_moves_nothing_has_no_force() {
    let ball = |tendon: &str| {
        let inside = "<freejoint/><geom size='.1'/><site name='a'/><site name='b' pos='.1 0 0'/>";
        format!(
            "<mujoco><worldbody>{PLANE}<body pos='0 0 .2'>{inside}</body></worldbody><tendon><spatial {tendon}>
            <site site='a'/><site site='b'/></spatial></tendon></mujoco>"
        )
    };
    for law in contact::ALL {
        let [free, tied] = ["", "range='0 .05' frictionloss='1'"].map(|tendon| {
            let mut sim = Sim::law(&ball(tendon), law.name);
            sim.run(0.5);
            sim.state.qpos
        });
        assert_eq!(free, tied, "{}", law.name);
    }
}

/// `explain` tells why a pair is not among the springs, and `run` what ends the search for forces under its own law.
#[test]
fn what_has_no_spring_and_what_did_not_converge_are_told() {
    let plank = "<body pos='0 0 .3'><joint axis='0 1 0'/><geom name='plank' type='box' size='1 .1 .02'/></body>";
    has(&said("explain", &world(&format!("{PLANE}{plank}")), &[]), &["No spring is given for ground – plank"]);
    let tumbling = world(&format!("{PLANE}{}", free("crate", "0 0 .1", "type='box' size='.1 .1 .1'")));
    let tumbling = tumbling.replace("<worldbody>", "<option iterations='1'/><worldbody>");
    let kick = ["--time", ".1", "--qvel", "1 0 0 5 3 2"];
    has(
        &said("run", &tumbling, &[&kick[..], &["--contact", "mujoco"]].concat()),
        &["did not converge: the `iterations`"],
    );
    has(&said("run", &tumbling, &[&kick[..], &["--rounds", "1"]].concat()), &["did not converge: --rounds"]);
    // In whichever stage of the step that was: here in the first, and in the last nothing touches.
    let leaving = ["--rounds", "1", "--steps", "1", "--qvel", "3.1 .49 .41 3.5 -.47 -1", "--integrator", "rk4"];
    has(&said("run", &tumbling.replace("0 0 .1'", "0 0 .0999'"), &leaving), &["in 1 of 1 steps"]);
}

/// What stands on something static rests, wherever in the file that is.
#[test]
fn what_is_fixed_may_be_listed_last() {
    let table = "<body name='table'><geom type='box' size='.3 .3 .3'/></body>";
    for inside in [
        format!("<body pos='0 0 .36' euler='.05 0 0'><freejoint/><geom type='box' size='.06 .06 .06'/></body>{table}"),
        format!("<body pos='0 0 .4' euler='0 .05 0'><freejoint/><geom type='cylinder' size='.06 .1'/></body>{table}"),
        format!(
            "{}{}{table}",
            free("low", "0 0 .36", "type='box' size='.06 .06 .06'"),
            free("high", ".01 0 .46", "type='box' size='.04 .04 .04'")
        ),
        format!(
            "{}<body pos='0 0 -.5'><body pos='0 0 .5'><geom type='box' size='.3 .3 .3'/></body></body>",
            free("b", ".1 .1 .3499", "type='capsule' size='.05 .08' euler='90 0 0'")
        ),
    ] {
        for law in ["penalty", "mujoco"] {
            let mut sim = Sim::law(&world(&inside), law);
            let start = sim.state.qpos.clone();
            sim.run(3.0);
            let fallen = (start[2] - sim.state.qpos[2]).abs();
            assert!(fastest(&sim) < 1e-4 && aside(&sim) < 1e-3 && fallen < 2e-3, "{law}: {:?}\n{inside}", sim.state);
        }
    }
}

/// Heavy things rest on light ones, under 1000 : 1 and more.
#[test]
fn the_heavy_rests_on_the_light() {
    let cube = "type='box' size='.1 .1 .1' mass=";
    let beam = |mass: &str| {
        free("l", "-.2 0 .1", &format!("{cube}'1'"))
            + &free("r", ".2 0 .1", &format!("{cube}'1'"))
            + &free("beam", "0 0 .251", &format!("type='box' size='.3 .1 .05' mass='{mass}'"))
    };
    // How long it rests, s, and whether it sinks so deep that `explain` says why.
    for (bodies, time, deep) in [
        (
            free("light", "0 0 .1", &format!("{cube}'1'")) + &free("heavy", "0 0 .301", &format!("{cube}'1000'")),
            9.0,
            true,
        ),
        (
            free("light", "0 0 .1", "type='cylinder' size='.1 .1' mass='1'")
                + &free("heavy", "0 0 .301", &format!("{cube}'200'")),
            9.0,
            true,
        ),
        (beam("200"), 9.0, false),
        // Of 400 kg and more it begins to sway when it has rested for a second or two, by rounding alone, as in MuJoCo.
        (beam("800"), 2.0, true),
        (
            free("a", "0 0 .1", &format!("{cube}'1'"))
                + &free("b", "0 0 .3", &format!("{cube}'10'"))
                + &free("c", "0 0 .5", &format!("{cube}'1000'")),
            9.0,
            true,
        ),
    ] {
        let text = world(&format!("{PLANE}{bodies}"));
        let mut sim = Sim::law(&text, "penalty");
        sim.run(time);
        assert!(fastest(&sim) < 1e-3 && aside(&sim) < 1e-3, "{:?}\n{text}", sim.state);
        if deep {
            has(&said("explain", &text, &[]), &["mass ratio", "the depth of "]);
        }
    }
}

/// The work of an actuator is no instability: sweeps of driven scenes are stable, and the motion is the closed form's.
#[test]
fn what_is_driven_is_not_unstable() {
    let cart = "<body><joint name='j' type='slide' axis='1 0 0'/><geom type='box' size='.1 .1 .1' mass='1'/></body>";
    let wheel = "<body><joint name='j' axis='0 0 1'/><inertial pos='0 0 0' mass='1' diaginertia='.5 .5 .5'/><geom size='.1'/></body>";
    let lift = "<body><joint name='j' type='slide' axis='0 0 1'/><geom size='.1' mass='2'/></body>";
    // x = F t²/(2 m); φ = M t²/(2 I); the same against the weight; v = u (1 − e^(−kv t/m)), x = u (t − (1 − e^(−kv t/m)) m/kv).
    let braked = 3.0 * (1.0 - (1.0 - (-2.0f64).exp()) / 2.0);
    for (body, actuator, ctrl, gravity, x) in [
        (cart, "<motor joint='j'/>", "1", 0.0, 0.5),
        (wheel, "<motor joint='j' gear='2'/>", "0.25", 0.0, 0.5),
        (lift, "<motor joint='j'/>", "39.62", -9.81, 5.0),
        (cart, "<velocity joint='j' kv='2'/>", "3", 0.0, braked),
    ] {
        let text = format!(
            "<mujoco><option gravity='0 0 {gravity}'/><worldbody>{body}</worldbody><actuator>{actuator}</actuator></mujoco>"
        );
        let mut sim = Sim::new(&text.replace("<option", "<option integrator='RK4'"));
        sim.state.ctrl[0] = ctrl.parse().expect("a number");
        sim.run(1.0);
        assert!((sim.state.qpos[0] - x).abs() < 1e-9 * x, "{} {x}", sim.state.qpos[0]);
        let out = file(&text).with_extension("out");
        let args = [
            "--ctrl",
            ctrl,
            "--time",
            "1",
            "--timesteps",
            "1e-2,1e-3",
            "--laws",
            "penalty",
            "--out",
            out.to_str().expect("UTF-8"),
        ];
        let found = said("sweep", &text, &args);
        assert!(!found.contains("unstable") && found.contains("rk4"), "{found}");
        std::fs::remove_dir_all(out).expect("it is there");
    }
}

/// A servo too stiff for the step is told before the run, with what would do.
#[test]
fn stiff_servos_are_told_with_their_limit() {
    let hinge = |mass: &str| {
        format!(
            "<body><joint name='j' axis='0 0 1'/><inertial pos='0 0 0' mass='.4' diaginertia='{mass} {mass} {mass}'/></body>"
        )
    };
    let slide = "<body><joint name='j' type='slide' axis='1 0 0'/><geom size='.1' mass='.1'/></body>".to_owned();
    // Semi-implicit Euler with the servo's own damping explicit: h < 2 (√(ζ² + 1) − ζ)/ω.
    for (body, actuator, m, kp, kv) in [
        (hinge("4e-4"), "<position name='servo' joint='j' kp='400' kv='40'/>", 4e-4, 400.0, 40.0),
        (hinge("1e-4"), "<position name='servo' joint='j' kp='900'/>", 1e-4, 900.0, 0.0),
        (slide, "<position name='servo' joint='j' kp='1e4' kv='900' gear='2'/>", 0.1, 4e4, 3600.0),
        (
            hinge("1e-3"),
            "<general name='servo' joint='j' biastype='affine' gainprm='300' biasprm='0 -300 -30'/>",
            1e-3,
            300.0,
            30.0,
        ),
    ] {
        let text = format!(
            "<mujoco><option gravity='0 0 0'/><worldbody>{body}</worldbody><actuator>{actuator}</actuator></mujoco>"
        );
        let (omega, zeta) = (f64::sqrt(kp / m), kv / (2.0 * f64::sqrt(kp * m)));
        let limit = 2.0 * (f64::sqrt(zeta * zeta + 1.0) - zeta) / omega;
        let found = said("run", &text, &["--ctrl", ".1", "--time", ".05"]);
        has(&found, &["warning: servo of joint j is unstable at this timestep of 2 ms", "stable at 2 ms"]);
        let advised = |option: &str| {
            let word = found.split(option).nth(1).and_then(|rest| rest.trim().split([' ', ',', '\n']).next());
            word.unwrap_or_else(|| panic!("no {option} in\n{found}")).to_owned()
        };
        let [step, integrator] = ["--timestep", "--integrator"].map(advised);
        let told: f64 = step.parse().unwrap_or_else(|_| panic!("{found}"));
        // Without damping an oscillation loses and regains much of its energy long before it is unstable.
        let bears = if kv > 0.0 { told > 0.8 * limit } else { found.contains("stable up to 667 µs") };
        assert!(told <= limit && bears, "{told} {limit}\n{found}");
        for advice in [["--timestep", &step], ["--integrator", &integrator]] {
            let found = said("run", &text, &[&["--ctrl", ".1", "--time", ".05"], &advice[..]].concat());
            assert!(!found.contains("warning") && !found.contains("error"), "{advice:?}\n{found}");
        }
    }
}

/// Rotation is shown where a scene rotates, and small numbers keep their digits.
#[test]
fn what_spins_is_seen_to_spin() {
    let coin = "<option gravity='0 0 0'/><worldbody><body name='coin'><freejoint/><geom type='cylinder' size='.01213 .000875' mass='.00567'/></body></worldbody>";
    let handle = "<option gravity='0 0 0'/><worldbody><body name='handle'><freejoint/><geom type='cylinder' fromto='0 -.1 0 0 .1 0' size='.02'/><geom type='cylinder' fromto='0 0 0 .12 0 0' size='.02'/></body></worldbody>";
    let wheel = "<worldbody><body name='wheel'><joint name='axle' axis='0 1 0'/><geom type='cylinder' size='.1 .02' euler='90 0 0'/></body></worldbody>";
    let gimbal = "<option gravity='0 0 0'/><worldbody><body name='rotor'><joint type='ball'/><geom type='box' size='.1 .1 .02'/></body></worldbody>";
    for (scene, qvel, column, right) in [
        (coin, "0 0 0 0 0 40", "spin rad/s", 40.0),
        (handle, "0 0 0 0 7 0", "spin rad/s", 7.0),
        (wheel, "5", "axle rad", 5.0),
        (gimbal, "0 0 3", "spin rad/s", 3.0),
    ] {
        let text = format!("<mujoco>{scene}</mujoco>");
        let found = said("run", &text, &["--qvel", qvel, "--time", "1"]);
        let heading = found.lines().find(|l| l.trim_start().starts_with("time s")).unwrap_or_else(|| panic!("{found}"));
        assert!(heading.contains(column), "{found}");
        let svg = file(&text).with_extension("svg");
        said("run", &text, &["--qvel", qvel, "--time", ".1", "--plot", svg.to_str().expect("UTF-8")]);
        let svg = std::fs::read_to_string(svg).expect("a picture");
        assert!(svg.contains("rotation [rad/s]") || svg.contains("joints [rad"), "{column}");
        let last = found.lines().rfind(|l| l.trim_start().starts_with("1.000")).expect("a row").to_owned();
        let cells: Vec<f64> = last.split_whitespace().filter_map(|x| x.parse().ok()).collect();
        assert!(cells.iter().any(|x| (x - right).abs() < 1e-3), "{right}\n{found}");
    }
    // ½ I ω² = ½ (m r²/2) ω² = 0.167 mJ, shown with digits.
    let found = said("run", &format!("<mujoco>{coin}</mujoco>"), &["--qvel", "0 0 0 0 0 40", "--time", "1"]);
    has(&found, &["energy µJ", "333.71"]);
}

/// Where explicit Euler adds the energy, it is named, and no spring that is not there.
#[test]
fn explicit_euler_is_the_cause_where_there_are_no_springs() {
    let rod = |inner: &str| {
        format!(
            "<body pos='0 0 -1'><joint axis='0 1 0'/><geom type='capsule' fromto='0 0 0 0 0 -1' size='.05' mass='1'/>{inner}</body>"
        )
    };
    let ball = "<body pos='0 0 2'><joint type='ball'/><geom type='capsule' fromto='0 0 0 .5 0 0' size='.05'/></body>"
        .to_owned();
    let slides = "<body><joint type='slide' axis='1 0 0'/><geom size='.1' mass='1'/><body><joint axis='0 1 0'/><geom size='.1' pos='0 0 -.5' mass='1'/></body></body>".to_owned();
    for (body, qpos) in [(rod(&rod("")), "2 .5"), (rod(""), "2"), (ball, ".7071 0 0 .7071"), (slides, "0 1")] {
        let text =
            world(&body).replace("<worldbody>", "<option timestep='.02'><flag contact='disable'/></option><worldbody>");
        let found = said("run", &text, &["--qpos", qpos, "--integrator", "explicit-euler"]);
        has(&found, &["the energy grew", "explicit-euler adds energy to every oscillation"]);
        assert!(!found.contains("too long"), "{found}");
        let found = said("run", &text, &["--qpos", qpos, "--integrator", "rk4"]);
        assert!(!found.contains("warning"), "{found}");
    }
}

/// Energy is weighed against the least that there was, without what cannot move.
#[test]
fn energy_that_comes_from_nowhere_is_told_whatever_stands_by() {
    let pendulum = "<body name='p' pos='0 0 1'><joint axis='0 1 0'/><geom type='capsule' fromto='0 0 0 0 0 -.2' size='.01' mass='.01' contype='0' conaffinity='0'/></body>";
    let boulder = "<body pos='9 0 -9'><geom size='2'/></body>";
    let other = "<body pos='3 0 0'><joint type='slide' axis='1 0 0'/><geom size='.05' mass='.01'/></body>";
    for beside in ["", boulder, "<body pos='0 0 90'><body><geom size='5'/></body></body>", other] {
        let text = world(&format!("{pendulum}{beside}")).replace("<worldbody>", "<option timestep='.01'/><worldbody>");
        let start = if beside == other { ["--qvel", "9 0"] } else { ["--qvel", "9"] };
        let found = said("run", &text, &[&start[..], &["--integrator", "explicit-euler", "--time", "2"]].concat());
        has(&found, &["the energy grew from"]);
        let found = said("run", &text, &[&start[..], &["--integrator", "rk4", "--time", "2"]].concat());
        assert!(!found.contains("warning"), "{found}");
    }
}

/// MuJoCo looks in the main file's folder, then in the including file's.
#[test]
fn included_files_are_found_where_mujoco_finds_them() {
    let root = Path::new(env!("CARGO_TARGET_TMPDIR")).join("cases").join("included");
    let put = |path: &str, text: &str| {
        let path = root.join(path);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(path, text).expect("a file");
    };
    put("parts/body.xml", "<mujocoinclude><body name='near'><freejoint/><geom size='.1'/></body></mujocoinclude>");
    put("parts/through.xml", "<mujocoinclude><include file='body.xml'/></mujocoinclude>");
    put("parts/deep/two.xml", "<mujocoinclude><include file='../through.xml'/></mujocoinclude>");
    put("parts/deep/one.xml", "<mujocoinclude><include file='two.xml'/></mujocoinclude>");
    put("parts/both.xml", "<mujocoinclude><include file='other.xml'/></mujocoinclude>");
    put("parts/other.xml", "<mujocoinclude><body name='near'><freejoint/><geom size='.1'/></body></mujocoinclude>");
    put("other.xml", "<mujocoinclude><body name='main'><freejoint/><geom size='.1'/></body></mujocoinclude>");
    for (file, name) in [
        ("parts/through.xml", "near"),
        ("parts/body.xml", "near"),
        ("parts/both.xml", "main"),
        ("parts/deep/one.xml", "near"),
    ] {
        put("scene.xml", &world(&format!("<include file='{file}'/>")));
        let scene = penny::load(&root.join("scene.xml")).unwrap_or_else(|failure| panic!("{file}: {failure}"));
        assert_eq!(scene.model.bodies[1].name, name, "{file}");
    }
}

/// `check` names the attribute, and says nothing once it is right.
#[track_caller]
fn doubted(cases: &[(&str, &str, &str, &str)]) {
    for (scene, wrong, right, words) in cases {
        let text = |gap: &str| scene.replace('@', gap);
        has(&said("check", &text(wrong), &[]), &[words, "warning"]);
        let fine = said("check", &text(right), &[]);
        assert!(fine.trim_end().ends_with(": fine"), "{fine}");
    }
}

#[test]
fn degrees_where_radians_are_due_are_doubted() {
    const RADIAN: &str =
        "<mujoco><compiler angle='radian'/><worldbody><body @<geom size='.1'/></body></worldbody></mujoco>";
    const SERVO: &str =
        "<mujoco><worldbody><body><joint name='j'/><geom size='.1'/></body></worldbody><actuator>@</actuator></mujoco>";
    const KEY: &str = "<mujoco><worldbody><body><joint name='j'/><geom size='.1'/></body></worldbody><actuator><position name='s' joint='j' kp='9'/></actuator><keyframe><key name='up' ctrl='@'/></keyframe></mujoco>";
    doubted(&[
        (
            SERVO,
            "<position joint='j' ctrlrange='-90 90'/>",
            "<position joint='j' ctrlrange='-1.57 1.57'/>",
            "90 rad are 14.3 turns",
        ),
        (RADIAN, "><joint range='-45 90'/>", "><joint range='-.785 1.57'/>", "`range` looks like degrees"),
        (RADIAN, "euler='0 30 0'><joint/>", "euler='0 .5236 0'><joint/>", "`euler` looks like degrees"),
        (RADIAN, "axisangle='0 0 1 45'><joint/>", "axisangle='0 0 1 .785'><joint/>", "`axisangle` looks like degrees"),
        (KEY, "45", ".785", "in keyframe up s asks for 45 rad"),
        (
            SERVO,
            "<general joint='j' gainprm='9' biastype='affine' biasprm='0 -9' ctrlrange='0 180'/>",
            "<general joint='j' gainprm='9' biastype='affine' biasprm='0 -9' ctrlrange='0 3.14'/>",
            "servo on a hinge is in radians",
        ),
    ]);
}

#[test]
fn an_impedance_that_falls_is_doubted_wherever_it_is_written() {
    const SCENE: &str = "<mujoco><default><default class='c'>@</default></default><worldbody><geom name='f' type='plane' size='1 1 1'/><body pos='0 0 1'><joint axis='0 1 0' range='-9 9' class='c'/><geom name='g' size='.1' class='c'/></body></worldbody></mujoco>";
    doubted(&[
        (SCENE, "<geom solimp='.98 .9 .002'/>", "<geom solimp='.9 .98 .002'/>", "`0.9 0.98 0.002` rises"),
        (
            SCENE,
            "<joint solimplimit='.95 .8 .01'/>",
            "<joint solimplimit='.8 .95 .01'/>",
            "`solimplimit` falls from 0.95 to 0.8",
        ),
        (
            SCENE,
            "<joint frictionloss='.1' solimpfriction='.99 .9'/>",
            "<joint frictionloss='.1' solimpfriction='.9 .99'/>",
            "`solimpfriction` falls",
        ),
        (
            "<mujoco><worldbody><geom name='f' type='plane' size='1 1 1'/><body pos='0 0 1'><freejoint/><geom name='g' size='.1'/></body></worldbody><contact><pair geom1='f' geom2='g' solimp='@'/></contact></mujoco>",
            ".97",
            ".94",
            "falls from 0.97 to 0.95",
        ),
    ]);
}

/// A control beyond its range is told, and `explain` knows k, c and depth of the limit under the servo's force.
#[test]
fn what_is_cut_off_is_told_and_limits_are_explained() {
    // (joint, actuator, ctrl, words, what presses): 1 kg and 1 kg m²; k = 1/(d τ² ζ²)·m, from solref 0.02 1 and d = 0.95.
    for (kind, range, actuator, ctrl, told, force) in [
        ("slide", "-.3 .3", "position kp='500' ctrlrange='-1 1'", "5", "ctrl 5 of a counts as 1", "350 N of a"),
        ("slide", "0 .5", "motor gear='3' ctrlrange='-2 2'", "-7", "ctrl -7 of a counts as -2", "6 N of a"),
        (
            "hinge",
            "-57.29578 57.29578",
            "position kp='90' ctrlrange='-3 3'",
            "4",
            "ctrl 4 of a counts as 3",
            "180 N m of a",
        ),
        (
            "slide",
            "-.3 .3",
            "position kp='500' ctrlrange='-1 1' forcerange='-20 20'",
            "2",
            "ctrl 2 of a counts as 1",
            "20 N of a",
        ),
    ] {
        let text = format!(
            "<mujoco><option gravity='0 0 0'/><worldbody><body><joint name='j' type='{kind}' axis='0 0 1' range='{range}'/>
             <inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body></worldbody><actuator><{actuator} name='a' joint='j'/></actuator></mujoco>"
        );
        has(&said("run", &text, &["--ctrl", ctrl, "--steps", "1"]), &[told]);
        has(&said("explain", &text, &[]), &["Limits of joints", force]);
        // Where it comes to rest beyond its stop is where `explain` says.
        let found = said("explain", &text, &[]);
        let line = found.lines().find(|l| l.contains(force)).expect("a line");
        let mut words = line.split_whitespace().rev();
        let (unit, number) = (words.next().expect("a unit"), words.next().expect("a number"));
        let scale = if unit.starts_with(['m']) && unit.len() > 1 {
            1e-3
        } else if unit.starts_with('µ') {
            1e-6
        } else {
            1.0
        };
        let depth = number.parse::<f64>().expect("a number") * scale;
        let mut sim = Sim::new(&text);
        sim.state.ctrl[0] = ctrl.parse().expect("a number");
        sim.run(4.0);
        let [low, high] = sim.model.joints[0].range.expect("a range");
        let beyond = (sim.state.qpos[0] - high).max(low - sim.state.qpos[0]);
        assert!((beyond - depth).abs() < 0.05 * depth, "{beyond} {depth}\n{found}");
    }
}

/// What would pass through something thin is told before it does.
#[test]
fn what_is_too_fast_to_be_stopped_is_told() {
    let wall = "<geom name='wall' type='box' size='.005 1 1' pos='1 0 0'/>";
    let door = "<body pos='1 0 0'><joint axis='0 0 1'/><geom name='wall' type='box' size='.005 1 1' mass='9'/></body>";
    let other = free("wall", "2 0 0", "size='.02'");
    for (inside, geom, fast, calm) in [
        (wall, "size='.02'", "30 0 0 0 0 0", "3 0 0 0 0 0"),
        (wall, "type='box' size='.02 .02 .02'", "60 0 0 0 0 0", "2 0 0 0 0 0"),
        (door, "type='capsule' size='.01 .05'", "40 0 0 0 0 0", "1 0 0 0 0 0"),
        (&other, "size='.02'", "50 0 0 0 0 0", "1 0 0 0 0 0"),
    ] {
        let text = world(&format!("{}{inside}", free("b", "0 0 0", geom)))
            .replace("<worldbody>", "<option gravity='0 0 0'/><worldbody>");
        let run = |qvel: &str| {
            let nv = penny::parse("s.xml", &text).unwrap_or_else(|e| panic!("{e}")).model.nv;
            let qvel = qvel.split(' ').map(str::to_owned).chain(std::iter::repeat("0".to_owned())).take(nv);
            said("run", &text, &["--time", ".05", "--qvel", &qvel.collect::<Vec<_>>().join(" ")])
        };
        let found = run(fast);
        has(&found, &["approach at", "in one step can jump over that", "comes out on the other side"]);
        let found = run(calm);
        assert!(!found.contains("warning"), "{found}");
    }
}

/// Forces that hold a load, by statics: named quantities of a run's end.
#[test]
fn loads_are_read_in_the_summary() {
    let g = 9.81;
    let crate_ = free("crate", "0 0 .2499", "type='box' size='.25 .25 .25' mass='8'");
    let ball = free("ball", "0 0 .0999", "size='.1' mass='3'");
    let beam = "<geom name='l' type='box' size='.05 .3 .05' pos='-.4 0 .05'/><geom name='r' type='box' size='.05 .3 .05' pos='.4 0 .05'/>";
    let beam = format!("{beam}{}", free("beam", "0 0 .1499", "type='box' size='.5 .1 .05' mass='12'"));
    let tripod = format!(
        "{PLANE}<body name='t' pos='0 0 .0999'><freejoint/><geom name='a' size='.1' pos='.3 0 0' mass='2'/><geom name='b' size='.1' pos='-.15 .26 0' mass='2'/><geom name='c' size='.1' pos='-.15 -.26 0' mass='2'/></body>"
    );
    for (inside, gravity, pairs) in [
        (format!("{PLANE}{crate_}"), "0 0 -9.81", vec![("ground–crate: normal ", 8.0 * g)]),
        (format!("{PLANE}{ball}"), "0 0 -9.81", vec![("ground–ball: normal ", 3.0 * g)]),
        (beam, "0 0 -9.81", vec![("l–beam: normal ", 6.0 * g), ("r–beam: normal ", 6.0 * g)]),
        (tripod, "0 0 -9.81", vec![("ground–t: normal ", 6.0 * g)]),
        (format!("{PLANE}{crate_}"), "3 0 -9", vec![("normal ", 72.0), (", friction ", 24.0)]),
    ] {
        let text = world(&inside).replace("<worldbody>", &format!("<option gravity='{gravity}'/><worldbody>"));
        let found = said("run", &text, &["--time", "5"]);
        for (words, force) in pairs {
            let told = found.split(words).nth(1).unwrap_or_else(|| panic!("no `{words}` in\n{found}"));
            let told: f64 = told.split(' ').next().expect("a number").parse().unwrap_or_else(|_| panic!("{found}"));
            assert!((told / force - 1.0).abs() < 1e-3, "{told} {force}\n{found}");
        }
    }
}

/// A state that is saved half-way and loaded goes on with the same bits, whatever it holds.
#[test]
fn a_run_goes_on_from_a_saved_state() {
    let stacked = format!(
        "{PLANE}{}{}",
        free("a", "0 0 .11", "type='box' size='.1 .1 .1' euler='0 0 10'"),
        free("b", ".05 0 .32", "type='box' size='.1 .1 .1' euler='0 0 20'")
    );
    let swing = "<body pos='-.4 0 .5'><joint name='j' axis='0 1 0' damping='.01' frictionloss='.02' range='-50 20'/><geom type='capsule' fromto='0 0 0 .3 0 0' size='.02'/><site name='tip' pos='.3 0 0'/></body>";
    let scenes = [
        world(&format!("{stacked}{swing}")),
        world(&format!("{PLANE}{swing}")).replace("</mujoco>", "<actuator><general joint='j' dyntype='filter' dynprm='.1' gainprm='3'/></actuator></mujoco>"),
        world(&format!("<site name='top' pos='-.2 0 .9'/>{swing}<body name='hand' mocap='true' pos='0 0 .4'><geom size='.05'/></body>{}", free("b", "0 0 .6", "size='.05'")))
            .replace("</mujoco>", "<tendon><spatial range='0 .5' stiffness='3' damping='.1'><site site='top'/><site site='tip'/></spatial></tendon></mujoco>"),
        world(&format!("{PLANE}<body name='one' pos='0 0 .3'><joint name='j' axis='0 1 0'/><geom type='capsule' fromto='0 0 0 .3 0 0' size='.02'/><body name='two' pos='.3 0 0'><joint axis='0 1 0'/><geom type='capsule' fromto='0 0 0 .3 0 0' size='.02'/></body></body>"))
            .replace("</mujoco>", "<equality><connect body1='two' anchor='.3 0 0'/></equality></mujoco>"),
    ];
    for text in scenes {
        let model: Model = penny::parse("s.xml", &text).unwrap_or_else(|e| panic!("{e}\n{text}")).model;
        for (law, integrator) in contact::ALL.iter().flat_map(|l| penny::integrate::ALL.iter().map(move |i| (l, i))) {
            let sim = || {
                let mut sim = Sim::with(model.clone(), law.name, integrator.name);
                sim.state.ctrl.iter_mut().for_each(|c| *c = 0.5);
                sim
            };
            let (mut whole, mut first, mut second) = (sim(), sim(), sim());
            (0..60).for_each(|_| whole.step());
            (0..35).for_each(|_| first.step());
            let saved = record::write_state(&first.model, &first.method, &first.state).expect("finite numbers");
            second.state = record::read_state(&second.model, &saved).expect("a state of this scene");
            (0..25).for_each(|_| second.step());
            assert_eq!(second.state, whole.state, "{} {}\n{text}", law.name, integrator.name);
        }
    }
}

/// Signs that look like a minus and quotes of a word processor: one error each, with the cure.
#[test]
fn typographic_signs_are_one_error_each() {
    for sign in ['‑', '–', '—', '−', '－'] {
        let found = said("check", &world(&format!("<geom pos='0 0 {sign}0.5' size='.1'/>")), &[]);
        has(&found, &["did you mean `-0.5`?", ": 1 error"]);
    }
    for [open, close] in [['“', '”'], ['„', '“'], ['‘', '’'], ['«', '»']] {
        let found = said("check", &world(&format!("<geom pos={open}0 0 1{close} size='.1'/>")), &[]);
        has(&found, &["is a typographic quote", ": 1 error"]);
    }
}

/// What MuJoCo has removed is told with the version and what to write.
#[test]
fn removed_names_are_told_with_their_cure() {
    for (text, words) in [
        ("<mujoco><compiler coordinate='global'/></mujoco>", "MuJoCo 2.3.4 has removed it"),
        ("<mujoco><option collision='predefined'/></mujoco>", "MuJoCo 3.0.0 has removed it"),
        ("<mujoco><option><flag sensornoise='enable'/></option></mujoco>", "MuJoCo 3.1.4 has removed it"),
        ("<mujoco><option apirate='100'/></mujoco>", "MuJoCo 3.3.7 has removed it"),
        ("<mujoco><compiler convexhull='true'/></mujoco>", "MuJoCo 3.2.5 has removed it"),
    ] {
        let report = mjcf::parse("old.xml", text).expect_err("refused").to_string();
        has(&report, &[words]);
        assert_eq!(report.matches("error[").count(), 1, "{report}");
    }
}

/// A sensor of nothing is an error of `check`, with what there is.
#[test]
fn a_reference_to_nothing_is_told_with_what_there_is() {
    let arm = "<worldbody><body name='arm'><joint name='j1'/><geom size='.1'/><site name='tip'/></body></worldbody><actuator><motor name='motor_1' joint='j1'/></actuator>";
    for (sensor, words) in [
        ("<actuatorfrc actuator='motor1'/>", "did you mean `motor_1`?"),
        ("<jointpos joint='j2'/>", "did you mean `j1`?"),
        ("<gyro site='top'/>", "did you mean `tip`?"),
        ("<framepos objtype='body' objname='Arm'/>", "did you mean `arm`?"),
    ] {
        let found = said("check", &format!("<mujoco>{arm}<sensor>{sensor}</sensor></mujoco>"), &[]);
        has(&found, &[words, ": 1 error"]);
    }
}

/// What is too light for MuJoCo is told with its cure.
#[test]
fn what_is_too_light_is_told() {
    for (body, words) in [
        ("<freejoint/><geom size='4e-5'/>", "1.7e-19 kg m²"),
        ("<freejoint/><inertial pos='0 0 0' mass='1e-3' diaginertia='1e-16 1e-16 1e-16'/>", "1.0e-16 kg m²"),
        ("<joint/><geom type='box' size='3e-5 3e-5 3e-5'/>", "kg m²"),
        ("<freejoint/><geom size='.1' mass='1e-16'/>", "too little mass"),
    ] {
        let found = said("check", &world(&format!("<body name='tiny'>{body}</body>")), &[]);
        has(&found, &["tiny", "too little", words, "the least is 1e-15", "1 error"]);
    }
    let text = world("<body><freejoint/><geom size='4e-5'/></body>");
    let cured = text.replace("<worldbody>", "<compiler boundinertia='1e-14'/><worldbody>");
    assert!(said("check", &cured, &[]).trim_end().ends_with(": fine"));
}

/// A link in its own mount: `check` and `run` tell it, and the cure that they name cures it.
#[test]
fn a_link_in_its_mount_is_told_with_its_cure() {
    let housing = "<geom name='housing' type='cylinder' size='.05 .05'/>";
    let rod = "<geom name='rod' type='capsule' size='.03' fromto='0 0 0 .3 0 -.4'/>";
    for (joint, housing) in [
        ("<joint axis='0 1 0'/>", housing),
        ("<joint type='ball'/>", "<geom name='housing' size='.06'/>"),
        ("<joint type='slide' axis='0 0 1'/>", "<geom name='housing' type='box' size='.05 .05 .05'/>"),
        ("<joint axis='0 1 0'/><joint axis='1 0 0'/>", "<geom name='housing' type='capsule' size='.05 .1'/>"),
    ] {
        let text =
            world(&format!("<body name='mount' pos='0 0 1.5'>{housing}<body name='link'>{joint}{rod}</body></body>"));
        let cure = "<contact><exclude body1=\"link\" body2=\"mount\"/></contact>";
        let other = "<contact><exclude body1=\"mount\" body2=\"link\"/></contact>";
        for command in ["check", "run"] {
            let found = said(command, &text, if command == "run" { &["--steps", "1"] } else { &[] });
            has(&found, &["overlap by", "a joint holds them together"]);
            assert!(found.contains(cure) || found.contains(other), "{found}");
        }
        let cured = text.replace("</mujoco>", &format!("{cure}</mujoco>"));
        assert!(said("check", &cured, &[]).trim_end().ends_with(": fine"));
    }
}

/// `explain` fits a screen for arms and hands, grouped by what is alike, and says what limits most.
#[test]
fn explain_of_what_has_many_joints_fits_a_screen() {
    let chain = |n: usize, joint: &str| {
        (0..n).fold(String::new(), |inner, _| format!("<body pos='0 0 .3' euler='0 20 0'>{joint}<geom type='capsule' fromto='0 0 0 0 0 .3' size='.04' mass='2'/>{inner}</body>"))
    };
    let hinge = "<joint axis='0 1 0' damping='2' armature='.01' range='-170 170'/>";
    let arm = chain(6, hinge);
    let leg = |i: usize| {
        format!(
            "<body pos='{} {} 0'><joint name='hip{i}' axis='0 0 1' range='-30 30'/><geom type='capsule' fromto='0 0 0 .2 0 -.1' size='.02'/><body pos='.2 0 -.1'><joint name='knee{i}' axis='0 1 0' range='0 90'/><geom type='capsule' fromto='0 0 0 .1 0 -.2' size='.02'/></body></body>",
            0.2 - 0.2 * (i / 2) as f64,
            0.3 * (i % 2) as f64
        )
    };
    let hexapod = format!(
        "<body pos='0 0 .5'><freejoint/><geom type='box' size='.2 .1 .05'/>{}</body>",
        (0..6).map(leg).collect::<String>()
    );
    let servos: String =
        (0..6).map(|i| format!("<position joint='hip{i}' kp='20'/><position joint='knee{i}' kp='20'/>")).collect();
    let gantry = format!(
        "<body><joint type='slide' axis='1 0 0' range='-1 1'/><geom size='.1'/><body><joint type='slide' axis='0 1 0' range='-1 1'/><geom size='.1'/>{}</body></body>",
        chain(5, "<joint axis='0 1 0'/>")
    );
    for (bodies, actuators) in [
        (arm, String::new()),
        (chain(7, "<joint type='ball' damping='1'/>"), String::new()),
        (hexapod, servos),
        (gantry, String::new()),
    ] {
        let text = world(&format!("{PLANE}<body pos='0 0 .2'>{bodies}</body>")).replace(
            "<body pos='0 0 .2'><body pos='0 0 .5'><freejoint/>",
            "<body pos='0 0 .7'><freejoint/><geom size='.05'/><body>",
        );
        let text = text.replace("</mujoco>", &format!("<actuator>{actuators}</actuator></mujoco>"));
        let found = said("explain", &text, &[]);
        let n = found.lines().count();
        assert!(n <= 50 && found.contains("--all"), "{n} lines\n{found}");
    }
}
