//! What people ask of a run: forces of contacts, rotations, joints, and a state to go on from.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use penny_lab::record::{self, Recorder};
use serde::Deserialize;

use crate::sim::Sim;

fn penny(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_penny")).args(args).current_dir(crate::ROOT).output().expect("penny starts")
}

fn file(name: &str, text: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("answers");
    std::fs::create_dir_all(&folder).expect("a folder");
    let path = folder.join(name);
    std::fs::write(&path, text).expect("a file");
    path
}

/// The named columns of a run's CSV.
fn columns(scene: &Path, args: &[&str], names: &[&str]) -> Vec<Vec<f64>> {
    let (path, show) = (scene.display().to_string(), names.join(","));
    let output = penny(&[&[&path[..], "--csv", "-", "--show", &show], args].concat());
    assert!(output.status.success(), "{}", crate::said(&output));
    let csv = String::from_utf8(output.stdout).expect("UTF-8");
    let header: Vec<&str> = csv.lines().next().expect("a header").split(',').collect();
    let places: Vec<usize> = names
        .iter()
        .map(|name| {
            header
                .iter()
                .position(|h| h.replace('–', "-") == name.replace('–', "-"))
                .unwrap_or_else(|| panic!("no {name} in {header:?}"))
        })
        .collect();
    let row = |line: &str| {
        let cells: Vec<f64> = line.split(',').map(|x| x.parse().expect("a number")).collect();
        places.iter().map(|i| cells[*i]).collect()
    };
    csv.lines().skip(1).map(row).collect()
}

#[track_caller]
fn near(found: f64, right: f64, tolerance: f64) {
    assert!((found - right).abs() <= tolerance * right.abs().max(1e-3), "{found} instead of {right}");
}

const GROUND: &str = r#"<geom name="ground" type="plane" size="9 9 1"/>"#;

fn crate_of(name: &str, mass: f64, z: f64) -> String {
    format!(
        r#"<body name="{name}" pos="0 0 {z}"><freejoint/><geom name="{name}" type="box" size=".25 .25 .25" mass="{mass}"/></body>"#
    )
}

/// Weight, slope and stack, at rest: the law only sets how deep.
#[test]
fn contact_forces_are_those_of_statics() {
    let crate_ = crate_of("crate", 8.0, 0.249);
    let scene = |bodies: &str| format!("<mujoco><worldbody>{GROUND}{bodies}</worldbody></mujoco>");
    let (one, two) = (scene(&crate_), scene(&format!("{crate_}{}", crate_of("lid", 3.0, 0.747))));
    let (one, two) = (file("crate.xml", &one), file("stack.xml", &two));
    for law in ["penalty", "mujoco"] {
        let last = |scene: &Path, args: &[&str], names: &[&str]| {
            let rows =
                columns(scene, &[&["--contact", law, "--every", "5000", "--steps", "5000"], args].concat(), names);
            rows.last().expect("rows").clone()
        };
        let weight = last(&one, &[], &["ground–crate.fn", "ground–crate.1.fn", "ground–crate.4.fn", "ground–crate.ft"]);
        near(weight[0], 78.48, 1e-7);
        near(weight[1], 19.62, 1e-7);
        near(weight[2], 19.62, 1e-7);
        assert!(weight[3] < 1e-7, "{weight:?}");
        let slope = last(&one, &["--gravity", "3 0 -9"], &["ground–crate.fn", "ground–crate.ft"]);
        near(slope[0], 72.0, 1e-6);
        near(slope[1], 24.0, 1e-6);
        let stack = last(&two, &[], &["ground–crate.fn", "crate–lid.fn"]);
        near(stack[0], 11.0 * 9.81, 1e-6);
        near(stack[1], 3.0 * 9.81, 1e-6);
    }
}

/// A bead at the end of a rotating rod: its stop pulls with m ω² r.
#[test]
fn a_limit_carries_the_centripetal_force() {
    let text = r#"<mujoco><option gravity="0 0 0" timestep="0.001"/><default><geom contype="0" conaffinity="0"/></default><worldbody>
        <body name="rod"><joint name="turn" axis="0 0 1"/><geom size=".1" mass="1000"/>
        <body name="bead" pos=".5 0 0"><joint name="bead" type="slide" axis="1 0 0" range="-1 0" damping="5"/>
        <geom size=".01" mass=".2"/></body></body></worldbody></mujoco>"#;
    let path = file("bead.xml", text);
    let rows = columns(&path, &["--qvel", "4 0", "--time", "4"], &["bead.limit", "turn.v", "bead"]);
    let [force, speed, stretch] = rows.last().expect("rows")[..] else { panic!() };
    near(force, 0.2 * speed * speed * (0.5 + stretch), 1e-9);
    assert!(force > 1.0);
}

/// A ball in a rotating arm leans on the arm's end: m ω² r, under both laws that follow the scene, solved to rounding.
#[test]
fn a_contact_carries_the_centripetal_force() {
    let text = r#"<mujoco><option gravity="0 0 0" timestep="0.001" tolerance="0"/><worldbody>
        <body name="arm"><joint name="turn" axis="0 0 1"/><geom size=".1" mass="1000" contype="0"/><geom name="end" type="box" size=".05 .1 .1" pos=".6 0 0"/>
        <body name="ball" pos=".5 0 0"><joint name="ball" type="slide" axis="1 0 0" damping="5"/><geom name="ball" size=".05" mass=".2"/></body></body>
        </worldbody><contact><pair geom1="end" geom2="ball" condim="1"/></contact></mujoco>"#;
    let path = file("drum.xml", text);
    for law in ["penalty", "mujoco"] {
        let rows =
            columns(&path, &["--qvel", "4 0", "--time", "4", "--contact", law], &["arm-ball.fn", "turn.v", "ball"]);
        let [force, speed, slid] = rows.last().expect("rows")[..] else { panic!() };
        near(force, 0.2 * speed * speed * (0.5 + slid), 1e-9);
        assert!(force > 1.0 && slid > 0.0);
    }
}

/// The scale under a crate, and a gyro in it.
#[test]
fn sensors_are_columns_too() {
    let text = format!(
        r#"<mujoco><worldbody>{GROUND}<body name="crate" pos="0 0 .249"><freejoint/><geom name="crate" type="box" size=".25 .25 .25" mass="8"/>
        <site name="sole" pos="0 0 -.25" size=".5"/></body></worldbody>
        <sensor><touch name="scale" site="sole"/><gyro name="gyro" site="sole"/></sensor></mujoco>"#
    );
    let path = file("scale.xml", &text);
    let rows = columns(&path, &["--every", "1500"], &["scale", "gyro.z", "ground–crate.fn"]);
    let [scale, turn, normal] = rows.last().expect("rows")[..] else { panic!() };
    near(scale, 78.48, 1e-6);
    near(normal, scale, 1e-12);
    assert!(turn.abs() < 1e-9);
    let json = penny(&[&path.display().to_string(), "--steps", "1", "--json", "-", "--show", "sensors"]);
    let json: serde_json::Value = serde_json::from_slice(&json.stdout).expect("JSON");
    assert_eq!(json["units"], serde_json::json!(["N", "rad/s", "rad/s", "rad/s"]));
}

/// A sensor called as its joint, and the energy, which every table has: each column has a name of its own, as pandas, polars and
/// Parquet want it. Blanks after commas do no harm.
#[test]
fn every_column_has_a_name_of_its_own() {
    let text = r#"<mujoco><worldbody><body name="b"><joint name="j" type="ball"/><geom size=".1"/><body name="arm">
        <joint name="elbow"/><geom size=".1"/></body></body></worldbody>
        <sensor><jointpos name="elbow" joint="elbow"/><jointlimitpos name="turn" joint="j"/></sensor></mujoco>"#;
    let text = text.replace(r#"type="ball""#, r#"type="ball" range="0 90""#);
    let path = file("twice.xml", &text).display().to_string();
    let json = penny(&[&path, "--steps", "1", "--json", "-", "--show", "elbow, energy,turn"]);
    let json: serde_json::Value = serde_json::from_slice(&json.stdout).expect("JSON");
    let columns: Vec<_> = json["columns"].as_array().expect("names").iter().filter_map(|c| c.as_str()).collect();
    let last = ["energy", "penetration", "contacts", "elbow", "elbow.2", "energy.2", "kinetic", "potential", "turn"];
    assert!(columns.ends_with(&last), "{columns:?}");
    assert_eq!(json["units"], serde_json::json!(["rad", "rad", "J", "J", "J", "rad"]));
}

/// MuJoCo's potential energy is that of all bodies, also of those that stand still.
#[test]
fn the_potential_energy_that_a_sensor_measures_is_mujocos() {
    let text = r#"<mujoco><worldbody><body pos="0 0 1"><freejoint/><geom size=".1" mass="2"/></body>
        <body pos="0 0 -1"><geom size=".1" pos="0 0 .25" mass="3"/></body></worldbody>
        <sensor><e_potential name="u"/></sensor></mujoco>"#;
    let rows = columns(&file("potential.xml", text), &["--steps", "1"], &["u"]);
    near(rows[0][0], 9.81 * (2.0 - 3.0 * 0.75), 1e-12);
}

#[derive(Deserialize)]
struct Golden {
    name: String,
    xml: String,
    qpos: Vec<f64>,
    qvel: Vec<f64>,
    contacts: Vec<Forces>,
}

#[derive(Deserialize)]
struct Forces {
    normal: f64,
    friction: f64,
}

/// `mj_contactForce`, contact by contact: 1e-9 of the largest.
#[test]
fn contact_forces_are_mujocos() {
    let text = std::fs::read_to_string(crate::file("tests/golden/forces.json")).expect("golden data");
    let scenes: Vec<Golden> = serde_json::from_str(&text).expect("JSON");
    let mut compared = 0;
    for Golden { name, xml, qpos, qvel, contacts } in scenes {
        let mut sim = Sim::law(&xml, "mujoco");
        (sim.state.qpos, sim.state.qvel) = (qpos, qvel);
        let mut recorder = Recorder::new(&sim.model);
        let sample = recorder.sample(&sim.model, &sim.state);
        let shown = record::chosen(&sim.model, &["contacts".to_owned()]).expect("a group");
        let values = recorder.values(&sim.model, &sim.method, &sim.state, &sample, &shown);
        let pushing = |what: &str| {
            let named = shown.iter().zip(&values).filter(|(q, _)| q.name.ends_with(what));
            named.map(|(_, v)| *v).collect::<Vec<f64>>()
        };
        let largest = contacts.iter().fold(0.0, |m: f64, c| m.max(c.normal));
        // MuJoCo's list, and each pair's slots in the same order, the empty ones left out.
        let normals: Vec<f64> = pushing(".fn").into_iter().filter(|f| *f != 0.0).collect();
        let frictions: Vec<f64> = pushing(".ft").into_iter().filter(|f| *f != 0.0).collect();
        let theirs: Vec<&Forces> = contacts.iter().filter(|c| c.normal != 0.0).collect();
        assert_eq!(normals.len(), theirs.len(), "{name}: {values:?}");
        for (i, c) in theirs.iter().enumerate() {
            assert!((normals[i] - c.normal).abs() < 1e-9 * largest, "{name} {i}: {} {}", normals[i], c.normal);
            let friction = frictions.get(i).copied().unwrap_or(0.0);
            assert!((friction - c.friction).abs() < 1e-9 * largest, "{name} {i}: {friction} {}", c.friction);
            compared += 1;
        }
    }
    assert!(compared >= 12, "{compared}");
}

#[test]
fn the_table_shows_what_matters_in_the_scene() {
    let heading = |args: &[&str]| {
        let said = crate::said(&penny(args));
        said.lines().find(|l| l.trim_start().starts_with("time s")).unwrap_or_else(|| panic!("{said}")).to_owned()
    };
    let path = file(
        "table.xml",
        &format!("<mujoco><worldbody>{GROUND}{}</worldbody></mujoco>", crate_of("crate", 8.0, 0.249)),
    );
    let path = path.display().to_string();
    assert!(heading(&[&path]).contains("ground–crate.fn N"), "a crate its load");
    assert!(heading(&["models/top.xml", "--key", "spin"]).contains("spin rad/s"), "a top its spin");
    assert!(heading(&["models/pendulum.xml"]).contains("rad"), "a pendulum its angle");
    let chosen = heading(&[&path, "--show", "crate.wx,ground-crate.fn,energy"]);
    let words = ["crate.wx rad/s", "ground–crate.fn N", "energy J", "kinetic "];
    assert!(words.iter().all(|w| chosen.contains(w)) && !chosen.contains("penetration"), "{chosen}");
    let said = crate::said(&penny(&[&path, "--show", "all"]));
    let wide = said.lines().map(|l| l.chars().count()).max();
    assert!(wide < Some(140) && said.contains("more of what was asked for do not fit here"), "{said}");
    let wrong = penny(&[&path, "--show", "crate.zz"]);
    let said = crate::said(&wrong);
    assert!(
        wrong.status.code() == Some(2) && said.contains("did you mean `crate.") && said.contains("forces"),
        "{said}"
    );
    let svg = Path::new(env!("CARGO_TARGET_TMPDIR")).join("shown.svg");
    penny(&[&path, "--steps", "100", "--show", "forces", "--plot", svg.to_str().expect("UTF-8")]);
    let svg = std::fs::read_to_string(&svg).expect("a picture");
    assert!(svg.contains("ground–crate.fn") && svg.contains("forces [N]") && !svg.contains("Phase"));
}

/// A contract: without `--show` a recording is what it was; with it, columns are added at the end.
/// The same numbers as in CSV, bit for bit, in columns of the same names; an old file stays until the new one is whole.
#[test]
fn parquet_holds_what_csv_holds() {
    let scene = file(
        "columns.xml",
        &format!("<mujoco><worldbody>{GROUND}{}</worldbody></mujoco>", crate_of("crate", 2.0, 0.3)),
    );
    let [csv, table] = ["columns.csv", "columns.parquet"].map(|name| scene.with_file_name(name));
    std::fs::write(&table, "old").expect("a file");
    let paths = [&scene, &csv, &table].map(|path| path.display().to_string());
    let args = [&paths[0], "--steps", "500", "--show", "crate.wz,ground-crate.fn", "--csv", &paths[1]];
    let output = penny(&[&args[..], &["--parquet", &paths[2]]].concat());
    #[cfg(not(feature = "parquet"))]
    {
        assert!(output.status.code() == Some(1) && crate::said(&output).contains("built without"));
        assert_eq!(std::fs::read_to_string(&table).expect("there"), "old");
    }
    #[cfg(feature = "parquet")]
    {
        use parquet::file::reader::{FileReader, SerializedFileReader};
        use parquet::record::Field;
        assert!(output.status.success(), "{}", crate::said(&output));
        let text = std::fs::read_to_string(&csv).expect("written");
        let reader = SerializedFileReader::new(std::fs::File::open(&table).expect("there")).expect("Parquet");
        let mut rows = reader.get_row_iter(None).expect("rows");
        let names: Vec<&str> = text.lines().next().expect("a header").split(',').collect();
        for line in text.lines().skip(1) {
            let row = rows.next().expect("as many rows").expect("a row");
            assert!(row.get_column_iter().map(|(name, _)| name.as_str()).eq(names.iter().copied()));
            for ((name, field), cell) in row.get_column_iter().zip(line.split(',')) {
                let right: f64 = cell.parse().expect("a number");
                match field {
                    Field::Double(x) => assert_eq!(x.to_bits(), right.to_bits(), "{name}"),
                    Field::Long(n) => assert!(*n as f64 == right && name == "contacts", "{name}"),
                    other => panic!("{name}: {other:?}"),
                }
            }
        }
        assert!(rows.next().is_none());
    }
}

#[test]
fn named_columns_come_after_all_others_and_only_where_asked() {
    let csv = |args: &[&str]| {
        let output = penny(&[&["models/box.xml", "--steps", "1", "--csv", "-"], args].concat());
        String::from_utf8(output.stdout).expect("UTF-8").lines().map(str::to_owned).collect::<Vec<_>>()
    };
    let (plain, more) = (csv(&[]), csv(&["--show", "all"]));
    assert_eq!(plain[0], "time,qpos0,qpos1,qpos2,qvel0,qvel1,qvel2,energy,penetration,contacts");
    assert!(plain.iter().zip(&more).all(|(a, b)| b.starts_with(a) && b.len() > a.len()), "{more:?}");
}

/// Half-way through, saved by one process and loaded by another: the same bits as without a stop.
#[test]
fn a_saved_state_goes_on_with_the_same_bits() {
    let text = r#"<mujoco><option timestep="0.002"/><worldbody><geom name="floor" type="plane" size="5 5 .1"/>
        <body name="a" pos="0 0 .11" euler="0 0 10"><freejoint/><geom name="a" type="box" size=".1 .1 .1"/></body>
        <body name="b" pos=".05 0 .32" euler="0 0 20"><freejoint/><geom name="b" type="box" size=".1 .1 .1"/></body>
        <body name="c" pos="-.4 0 .5"><joint name="swing" axis="0 1 0" damping=".01" frictionloss=".02" range="-50 20"/>
        <geom name="rod" type="capsule" fromto="0 0 0 .3 0 0" size=".02"/></body></worldbody>
        <actuator><motor name="m" joint="swing" gear="2" ctrlrange="-1 1"/></actuator></mujoco>"#;
    for law in penny::contact::ALL {
        for integrator in penny::integrate::ALL {
            let sim = || {
                let mut sim = Sim::with(Sim::new(text).model, law.name, integrator.name);
                sim.state.ctrl[0] = 0.5;
                sim
            };
            let steps = |sim: &mut Sim, n: usize| (0..n).for_each(|_| sim.step());
            let (mut whole, mut first, mut second) = (sim(), sim(), sim());
            steps(&mut whole, 120);
            steps(&mut first, 70);
            let saved = record::write_state(&first.model, &first.method, &first.state).expect("finite numbers");
            second.state = record::read_state(&second.model, &saved).expect("a state of this scene");
            assert_eq!(second.state, first.state);
            steps(&mut second, 50);
            assert_eq!(second.state, whole.state, "{} {}", law.name, integrator.name);
        }
    }
    // In other processes.
    let scene = file("restart.xml", text).display().to_string();
    let end = |args: &[&str]| {
        let output = penny(&[&["run", &scene, "--save-state", "-"][..], args].concat());
        assert!(output.status.success(), "{}", crate::said(&output));
        String::from_utf8(output.stdout).expect("UTF-8")
    };
    let whole = end(&["--ctrl", ".5", "--steps", "120"]);
    let saved = file("half.json", &end(&["--ctrl", ".5", "--steps", "70"])).display().to_string();
    assert!(whole == end(&["--load-state", &saved, "--steps", "50"]), "{whole}");
    let saved = file("pendulum.json", "").display().to_string();
    let save = ["--steps", "3", "--save-state", &saved];
    penny(&[&["models/pendulum.xml"], &save[..]].concat());
    for (scene, says) in
        [(&scene[..], "a state of another scene: it has 2 bodies"), ("models/disk.xml", "another scene")]
    {
        let output = penny(&[scene, "--load-state", &saved]);
        assert!(output.status.code() == Some(1) && crate::said(&output).contains(says), "{}", crate::said(&output));
    }
    let output = penny(&["models/disk.xml", "--load-state", "models/disk.xml"]);
    assert!(
        output.status.code() == Some(1) && crate::said(&output).contains("it is not JSON"),
        "{}",
        crate::said(&output)
    );
}

/// A motor's work, a damper's and friction's loss, against closed forms.
#[test]
fn the_summary_says_where_the_energy_went() {
    let push = r#"<mujoco><option gravity="0 0 0"/><worldbody><body><joint name="x" type="slide" axis="1 0 0"/>
        <geom type="box" size=".1 .1 .1" mass="2"/></body></worldbody><actuator><motor joint="x"/></actuator></mujoco>"#;
    let push = file("push.xml", push).display().to_string();
    // F = 3 N for 1 s on 2 kg: F² t²/(2 m) = 2.25 J.
    let said = crate::said(&penny(&[&push, "--ctrl", "3", "--time", "1"]));
    assert!(said.contains("energy 0 J to 2.25 J: actuators +2.25 J, drift 0 J") && !said.contains("warning"), "{said}");
    let slide = format!("<mujoco><worldbody>{GROUND}{}</worldbody></mujoco>", crate_of("crate", 2.0, 0.25));
    let slide = file("slide.xml", &slide).display().to_string();
    // v²/(2 μ g) of way at μ m g: all of m v²/2 = 1 J.
    let said = crate::said(&penny(&[&slide, "--friction", "0.5", "--qvel", "1 0 0 0 0 0"]));
    let friction = said.split("(friction about ").nth(1).unwrap_or_else(|| panic!("{said}"));
    let joules: f64 = friction.split(' ').next().expect("a number").parse().expect("a number");
    assert!((joules + 1.0).abs() < 0.02, "{said}");
    // A ball sinks in oil: v = u (1 − e^(−t/τ)), u = m g/c, τ = m/c, c = 3π β d, d = r √2.4 the width of the box that stands
    // for the ball. The oil takes ∫ c v² = c u² (t − 2 τ (1 − e^(−t/τ)) + τ/2 (1 − e^(−2t/τ))).
    let ball = r#"<mujoco><option viscosity="5" integrator="RK4"/><worldbody><body><freejoint/><geom size=".1" mass="1"/></body></worldbody></mujoco>"#;
    let said = crate::said(&penny(&[&file("oil.xml", ball).display().to_string(), "--time", "1"]));
    let c = 3.0 * std::f64::consts::PI * 5.0 * 0.1 * 2.4f64.sqrt();
    let (u, tau) = (9.81 / c, 1.0 / c);
    let took = c * u * u * (1.0 - 2.0 * tau * (1.0 - (-c).exp()) + 0.5 * tau * (1.0 - (-2.0 * c).exp()));
    assert!(said.contains(&format!("the medium -{took:.1} J, drift")), "{took} {said}");
    // A tendon with the damping c on a mass m: m v²/2 (1 − e^(−2ct/m)), whatever the integrator.
    let string = r#"<mujoco><option gravity="0 0 0"/><worldbody><body><joint name="x" type="slide" axis="1 0 0"/><geom size=".1" mass="1"/></body></worldbody>
        <tendon><fixed damping="2"><joint joint="x" coef="1"/></fixed></tendon></mujoco>"#;
    let string = file("string.xml", string).display().to_string();
    for integrator in ["Euler", "rk4", "implicitfast"] {
        let said = crate::said(&penny(&[&string, "--qvel", "1", "--time", "1", "--integrator", integrator]));
        // What a fourth order sums by the ends of its steps is of second order.
        let drift = if integrator == "rk4" { "dampers -491 mJ" } else { "dampers -491 mJ, drift 0 J" };
        assert!(said.contains(drift), "{integrator}: {said}");
    }
    // A ball on a string is held by it: what a stretched string gives at the start is no drift.
    let string = r#"<mujoco><option timestep="0.0005" integrator="RK4"/><worldbody><site name="hook" pos="0 0 .5"/>
        <body pos="0 0 -.001"><joint type="slide" axis="0 0 1"/><geom size=".05" mass="4"/><site name="ball"/></body></worldbody>
        <tendon><spatial range="0 .5" limited="true" solreflimit="-1e5 -10"><site site="hook"/><site site="ball"/></spatial></tendon></mujoco>"#;
    let said = crate::said(&penny(&[
        &file("hung.xml", string).display().to_string(),
        "--time",
        ".3",
        "--integrator",
        "Euler",
    ]));
    let drift = said.split("drift ").nth(1).unwrap_or_else(|| panic!("{said}"));
    assert!(said.contains("contacts, limits and equalities +156 mJ") && !said.contains("warning"), "{said}");
    assert!(drift.contains("µJ (0."), "{said}");
    // 1 kg without weight rises by 1 m.
    let lift = r#"<mujoco><worldbody><body gravcomp="1"><joint type="slide" axis="0 0 1"/><geom size=".1" mass="1"/></body></worldbody></mujoco>"#;
    let said = crate::said(&penny(&[&file("lift.xml", lift).display().to_string(), "--qvel", "1", "--time", "1"]));
    assert!(said.contains("gravity compensation +9.81 J, drift 0 J"), "{said}");
}

#[test]
fn numbers_of_a_scene_can_be_replaced_for_a_run() {
    let scene = format!("<mujoco><worldbody>{GROUND}{}</worldbody></mujoco>", crate_of("crate", 2.0, 0.25));
    let scene = file("replaced.xml", &scene);
    let way = |args: &[&str]| {
        let args = [&["--qvel", "1 0 0 0 0 0", "--every", "1500"], args].concat();
        columns(&scene, &args, &["crate.x"]).last().expect("rows")[0]
    };
    // v²/(2 μ g)
    near(way(&["--friction", "0.2"]), 1.0 / (0.4 * 9.81), 0.03);
    near(way(&["--friction", "0.2", "--gravity", "0 0 -1.62"]), 1.0 / (0.4 * 1.62), 0.05);
    let depth =
        |solref: &str| columns(&scene, &["--solref", solref, "--every", "1500"], &["crate.z"]).last().expect("rows")[0];
    assert!(depth("0.1 1") < 0.25 - 1e-3 && depth("0.02 1") > 0.25 - 2e-4);
    let wrong = penny(&[&scene.display().to_string(), "--solref", "0.1"]);
    assert!(wrong.status.code() == Some(2) && crate::said(&wrong).contains("takes 2 numbers"));
    let wrong = penny(&["models/disk.xml", "--qvel", "2", "0", "0"]);
    assert!(crate::said(&wrong).contains(r#"quote the numbers: --qvel "2 0 0""#), "{}", crate::said(&wrong));
    assert!(penny(&["help"]).status.success());
}
