//! Every warning in one table: a scene in which it is due, and the scene beside it in which it is not.
//!
//! The sources are read for what can be warned of: a warning without a row fails.

use std::path::{Path, PathBuf};
use std::process::Command;

use penny::mjcf::{self, Severity};

/// A warning of the reader: its code, or the reason in `ignored: reason`; a scene with a gap `@`; what in the gap is
/// wrong; what is right; and words that the warning has.
const OF_FILES: &[(&str, &str, &str, &str, &str)] = &[
    (
        "stray-text",
        "<mujoco>@<worldbody>@BALL</worldbody></mujoco>",
        "| ",
        "",
        "has no meaning in MJCF (here and in one more place)",
    ),
    ("control-character", ONE, "name='a&#27;b'", "name='a[b'", "U+001B gives commands to a terminal"),
    (
        "orientation-lost",
        ONE,
        "type='capsule' fromto='0 0 0 1 0 0' euler='0 90 0'",
        "type='capsule' fromto='0 0 0 1 0 0'",
        "no effect beside `fromto`",
    ),
    ("range-lost", HINGE, "range='90 -90'", "range='-90 90'", "`range` limits nothing"),
    (
        "pair-at-rest",
        "<mujoco><worldbody><geom name='a' size='1'/><geom name='b' size='1'/><body pos='9 0 0'><freejoint/><geom name='c' size='1'/></body></worldbody><contact><pair geom1='a' geom2='@'/></contact></mujoco>",
        "b",
        "c",
        "never move against one another",
    ),
    ("mixed-solref", ONE, "solref='-100 1'", "solref='-100 -1'", "`solref` mixes the two formats: -100 1"),
    (
        "nothing-moves",
        "<mujoco><worldbody><body>@<geom size='.1'/></body></worldbody></mujoco>",
        "",
        "<freejoint/>",
        "no body has a joint",
    ),
    (
        "keyframe-short",
        KEY,
        "qpos='0 0 1'",
        "qpos='0 0 1 1 0 0 0'",
        "has 7 numbers, but 3 are given: MuJoCo fills it up",
    ),
    ("keyframe-quaternion", KEY, "qpos='0 0 1 0 0 0 0'", "qpos='0 0 1 0 0 0 1'", "is 0 0 0 0"),
    ("clamped", ONE, "solimp='.9 1 .001'", "solimp='.9 .9999 .001'", "`solimp` 1 counts as 0.9999"),
    ("raised", ONE, "friction='1e-7'", "friction='0'", "`friction` 1e-7 counts as 0.00001"),
    ("colour-cut", ONE, "rgba='255 128 0 1'", "rgba='1 .5 0 1'", "divide by 255: `1 0.5 0 1`"),
    ("colour-cut", ONE, "rgba='2 0 0 1'", "rgba='1 0 0 1'", "1 is full brightness"),
    (
        "long-timestep",
        "<mujoco><option timestep='@'/><worldbody>BALL</worldbody></mujoco>",
        "2",
        ".002",
        "2 ms are `0.002`",
    ),
    ("looks-like-radians", HINGE, "range='-1.5708 1.5708'", "range='-1.5 1.5'", "write `-90 90`"),
    (
        "looks-like-degrees",
        "<mujoco><compiler angle='radian'/><worldbody><body><joint @/><geom size='.1'/></body></worldbody></mujoco>",
        "range='-45 45'",
        "range='-6.28 6.28'",
        "write `-0.7854 0.7854`",
    ),
    ("servo-in-degrees", SERVO, "ctrlrange='-90 90'", "ctrlrange='-1.57 1.57'", "servo on a hinge is in radians"),
    ("impedance-falls", ONE, "solimp='.95 .9 .001'", "solimp='.9 .95 .001'", "`0.9 0.95 0.001` rises"),
    ("solref-swapped", ONE, "solref='1 .02'", "solref='.02 1'", "`0.02 1`"),
    ("friction-swapped", ONE, "friction='.005 1 .0001'", "friction='1 .005 .0001'", "`1 0.005 0.0001`"),
    ("light-density", ONE, "density='2.7'", "density='2700'", "2.7 g/cm³ are `2700`"),
    (
        "Penny has no cameras that measure",
        SENSOR,
        "<framepos objtype='camera' objname='eye'/>",
        "<framepos objtype='site' objname='tip'/>",
        "`framepos` is ignored",
    ),
    (
        "Penny gives the distance only",
        SENSOR,
        "<rangefinder site='tip' data='dist dir'/>",
        "<rangefinder site='tip' data='dist'/>",
        "`data` is ignored",
    ),
    (
        "Penny asks only whether the origin is inside",
        SENSOR,
        "<insidesite site='tip' objtype='site' objname='tip' enclosed='true'/>",
        "<insidesite site='tip' objtype='site' objname='tip' enclosed='false'/>",
        "`enclosed` is ignored",
    ),
    (
        "Penny does not measure this; the other sensors are not affected",
        SENSOR,
        "<distance geom1='ball' geom2='floor'/>",
        "<touch site='tip'/>",
        "`distance` is ignored",
    ),
    (
        "the values come without delay",
        SENSOR,
        "<touch site='tip' delay='.1' nsample='9'/>",
        "<touch site='tip' delay='0'/>",
        "`delay` is ignored",
    ),
    (
        "the values come in every step",
        SENSOR,
        "<touch site='tip' interval='.1 0' nsample='9'/>",
        "<touch site='tip'/>",
        "`interval` is ignored",
    ),
];

const ONE: &str = "<mujoco><worldbody><body><freejoint/><geom size='.1' @/></body></worldbody></mujoco>";
const HINGE: &str = "<mujoco><worldbody><body><joint @/><geom size='.1'/></body></worldbody></mujoco>";
const KEY: &str = "<mujoco><worldbody>BALL</worldbody><keyframe><key @/></keyframe></mujoco>";
const SERVO: &str = "<mujoco><worldbody><body><joint name='j'/><geom size='.1'/></body></worldbody><actuator><position name='servo' joint='j' @/></actuator></mujoco>";
const SENSOR: &str = "<mujoco><worldbody><geom name='floor' type='plane' size='1 1 1'/><camera name='eye'/><body pos='0 0 1'><freejoint/><geom name='ball' size='.1'/><site name='tip'/></body></worldbody><sensor>@</sensor></mujoco>";

/// A scene with its gap filled.
fn filled(scene: &str, with: &str) -> String {
    scene.replace('@', with).replace("BALL", "<body pos='0 0 .5'><freejoint/><geom name='ball' size='.1'/></body>")
}

#[test]
fn every_warning_of_the_reader_is_given_where_it_is_due_only() {
    for (id, scene, wrong, right, words) in OF_FILES {
        let read = |with: &str| {
            let text = filled(scene, with);
            let scene = penny::parse("scene.xml", &text).unwrap_or_else(|failure| panic!("{id}: {failure}"));
            assert!(scene.warnings.iter().all(|w| w.severity() == Severity::Warning));
            (scene.warnings.len(), mjcf::render(&scene.document, &scene.warnings, false))
        };
        let (n, report) = read(wrong);
        let told = if id.contains(' ') { format!("is ignored: {id}") } else { format!("warning[{id}]: ") };
        assert!(n == 1 && report.contains(&told) && report.contains(words), "{id}: {n} warnings\n{report}");
        let (n, report) = read(right);
        assert_eq!(n, 0, "{id}: `{right}` is right\n{report}");
    }
}

/// A warning of a command: words that it has in the source; the command and its options; a scene; in either a gap `@`;
/// what in the gap is wrong; what is right; and words that the warning has.
///
/// The first rows begin with "warning:" and are found in the sources; of the others the report alone has something to say.
type OfRuns = (&'static str, &'static [&'static str], &'static str, &'static str, &'static str, &'static str);
const OF_RUNS: &[OfRuns] = &[
    (
        "is not a whole number of steps",
        &["run", "--time", "@"],
        OPEN,
        "0.005",
        "0.006",
        "the run ends at 6 ms: 5 ms is not a whole number of steps of 2 ms",
    ),
    (
        "MuJoCo keeps this number",
        &["run", "--solimp", "@ 0.95"],
        OPEN,
        "9",
        "0.9",
        "--solimp 9 counts as 0.9999: MuJoCo keeps this number between 0.0001 and 0.9999",
    ),
    (
        "has no effect, as in MuJoCo",
        &["check"],
        "<mujoco><worldbody><body name='ball' gravcomp='-1'><freejoint/><geom size='.1'/></body><body pos='1 0 0' gravcomp='@'><geom size='.1'/></body></worldbody></mujoco>",
        "0",
        "1",
        "the `gravcomp` of ball has no effect",
    ),
    (
        "drives what moves instead of braking it",
        &["check"],
        HINGE,
        "damping='-1'",
        "damping='0'",
        "damping below 0 drives what moves instead of braking it: hinge 0",
    ),
    (
        "the limit will throw it back",
        &["check"],
        HINGE,
        "range='20 90'",
        "range='-20 90'",
        "beyond its limits at the start: hinge 0 at 0 rad",
    ),
    (
        "controls of servos are in radians",
        &["run", "--ctrl", "@"],
        OPEN,
        "45",
        "3",
        "servo asks for 45 rad, 7.16 turns",
    ),
    (
        "the Earth's: it is in m/s²",
        &["check"],
        "<mujoco><option gravity='0 0 @'/><worldbody>BALL</worldbody></mujoco>",
        "-9810",
        "-24.8",
        "gravity is 9810 m/s², 1000 times",
    ),
    (
        "gravity points up",
        &["check"],
        "<mujoco><option gravity='0 0 @'/><worldbody>BALL</worldbody></mujoco>",
        "9.81",
        "-9.81",
        "write -9.81",
    ),
    ("lighter than air", &["check"], ONE, "mass='.001'", "mass='.01'", "weighs 0.001 kg in 4.19 l, 0.239 kg/m³"),
    ("no material is so dense", &["check"], ONE, "mass='500'", "mass='50'", "weighs 500 kg in 4.19 l"),
    (
        "lengths are in m",
        &["check"],
        "<mujoco><worldbody><body><freejoint/><geom type='box' size='@' mass='2'/></body></worldbody></mujoco>",
        "100 50 20",
        ".1 .05 .02",
        "227 mm are 0.227 m",
    ),
    ("it counts as 1 0 0 0", &["run", "--qpos", "@"], BALL, "0 0 1 0 0 0 0", "0 0 1 0 0 0 1", "is 0 0 0 0"),
    (
        "it counts as scaled to 1",
        &["run", "--qpos", "@"],
        BALL,
        "0 0 1 2 0 0 0",
        "0 0 1 .7071 .7071 0 0",
        "has length 2",
    ),
    (
        "total thickness",
        &["run", "--time", ".1", "--qvel", "@ 0 0 0 0 0"],
        WALL,
        "30",
        "3",
        "60 mm in one step can jump over that",
    ),
    (
        "its ctrlrange ends there",
        &["run", "--ctrl", "@"],
        "<mujoco><worldbody><body><joint name='j'/><geom size='.1'/></body></worldbody><actuator><motor name='m' joint='j' ctrlrange='-1 1'/></actuator></mujoco>",
        "5",
        "1",
        "ctrl 5 of m counts as 1",
    ),
    (
        "is unstable at any timestep with",
        &["run", "--integrator", "@"],
        "<mujoco><worldbody><body><joint stiffness='10'/><geom size='.1'/></body></worldbody></mujoco>",
        "explicit-euler",
        "semi-implicit-euler",
        "take another --integrator",
    ),
    (
        "adds energy to every oscillation, at any timestep; at",
        &["run", "--integrator", "@", "--qpos", "2"],
        PENDULUM,
        "explicit-euler",
        "rk4",
        "--integrator semi-implicit-euler or rk4",
    ),
    (
        "is unstable at this timestep of",
        &["run", "--timestep", "@"],
        "<mujoco><worldbody><body><joint name='j'/><geom size='.1' mass='1'/></body></worldbody><actuator><position joint='j' kp='400' kv='40'/></actuator></mujoco>",
        "2e-3",
        "1e-4",
        "or --integrator implicitfast, stable at 2 ms",
    ),
    (
        "times the radius of the smaller",
        &["check"],
        "<mujoco><worldbody><geom name='floor' type='plane' size='1 1 1'/><body pos='0 0 @'><freejoint/><geom name='ball' size='.1'/></body></worldbody></mujoco>",
        ".05",
        ".1",
        "floor and ball overlap by 50 mm",
    ),
    ("no step can be taken", &["check", "--limit", "contacts=@"], CRATE, "3", "4", "there are more than 3 contacts"),
    (
        "the energy grew from",
        &["run", "--time", "3", "--integrator", "@", "--qpos", "2"],
        PENDULUM,
        "explicit-euler",
        "rk4",
        "at any timestep: take --integrator semi-implicit-euler or rk4",
    ),
    (
        "the energy is too large a number",
        &["run", "--steps", "1"],
        ONE,
        "mass='1e307' pos='0 0 1000'",
        "mass='1'",
        "`inf` in CSV",
    ),
    (
        "were refused: no method has",
        &[
            "rollout", "--out", "%/worlds.csv", "--worlds", "1", "--vary", "qvel[0]=0..1", "--time", ".1",
            "--accuracy", "@",
        ],
        FALL,
        "1e-18",
        "1e-3",
        "no method has 1.00e-18 m",
    ),
    (
        "diverged: the column `failed`",
        &[
            "rollout", "--out", "%/worlds.csv", "--worlds", "2", "--vary", "qpos[j]=1..2", "--time", "50",
            "--integrator", "@",
        ],
        STIFF,
        "explicit-euler",
        "semi-implicit-euler",
        "2 of 2 diverged",
    ),
    (
        "so the map shows the flight alone",
        &[
            "sweep",
            "--map",
            "timestep=1e-3..2e-3,mass=1..2",
            "--cells",
            "1",
            "--laws",
            "penalty",
            "--integrators",
            "rk4",
            "--out",
            "%/map",
            "--time",
            "@",
        ],
        FALL,
        ".1",
        ".4",
        "give it more time",
    ),
    // Reports.
    (
        "steps the contact forces did not converge",
        &["run", "--rounds", "@", "--qvel", "1 0 0 0 0 2"],
        CRATE,
        "1",
        "50",
        "--rounds allows more",
    ),
    (
        "touch in a row",
        &["explain"],
        "<mujoco><worldbody><body name='a'><freejoint/><geom size='.1'/></body><body name='b' pos='.2 0 0'><freejoint/><geom size='.1'/></body><body name='c' pos='@ 0 0'><freejoint/><geom size='.1'/></body></worldbody></mujoco>",
        ".4",
        ".41",
        "a, b, c touch in a row",
    ),
    ("for rest is little beside the fall", &["explain", "--timestep", "@"], MARBLE, "1e-3", "1e-4", "hops from"),
    ("but a step falls by g h²", &["run", "--timestep", "@"], MARBLE, "1e-3", "1e-4", "it hops"),
    (
        "it has no joint limits and no dry friction of joints",
        &["run", "--contact", "@"],
        LIMITED,
        "tutorial",
        "penalty",
        "those of the scene have no effect",
    ),
];

const OPEN: &str = "<mujoco><worldbody><body><joint name='j'/><geom size='.1'/></body></worldbody><actuator><position name='servo' joint='j' kp='.1'/></actuator></mujoco>";
const BALL: &str = "<mujoco><worldbody>BALL</worldbody></mujoco>";
const WALL: &str = "<mujoco><option gravity='0 0 0'/><worldbody><geom name='wall' type='box' size='.005 1 1' pos='1 0 0'/><body><freejoint/><geom name='ball' size='.02' mass='.01'/></body></worldbody></mujoco>";
const PENDULUM: &str = "<mujoco><option timestep='.02'/><worldbody><body><joint axis='0 1 0'/><geom type='capsule' fromto='0 0 0 0 0 -1' size='.05'/></body></worldbody></mujoco>";
const CRATE: &str = "<mujoco><worldbody><geom type='plane' size='1 1 1'/><body pos='0 0 .1'><freejoint/><geom type='box' size='.1 .1 .1'/></body></worldbody></mujoco>";
const LIMITED: &str = "<mujoco><worldbody><body><joint range='-30 30'/><geom size='.1'/></body></worldbody></mujoco>";
const MARBLE: &str = "<mujoco><default><geom condim='6' friction='.5 .0001 .002' solref='.1 .2' solimp='.95 .95 .001'/></default><worldbody><geom type='plane' size='5 5 .1'/><body pos='0 0 .2'><joint type='slide' axis='0 0 1'/><geom size='.2' mass='1'/></body></worldbody></mujoco>";

const STIFF: &str = "<mujoco><option timestep='.1'/><worldbody><body><joint name='j' stiffness='20'/><geom size='.1' mass='1'/><geom size='.1' pos='.5 0 0' mass='1'/></body></worldbody></mujoco>";
const FALL: &str = "<mujoco><worldbody><geom type='plane' size='1 1 1'/><body name='b' pos='0 0 .5'><joint type='slide' axis='0 0 1'/><geom size='.1'/></body></worldbody></mujoco>";

/// What one command says of a scene; `%` is a folder to write to.
fn said(command: &[&str], text: &str, gap: &str) -> String {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("due");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    let path = folder.join("scene.xml");
    std::fs::write(&path, text).expect("a scene");
    let mut penny = Command::new(env!("CARGO_BIN_EXE_penny"));
    let options =
        command[1..].iter().map(|option| option.replace('@', gap).replace('%', &folder.display().to_string()));
    let output =
        penny.arg(command[0]).arg(&path).args(options).current_dir(crate::ROOT).output().expect("penny starts");
    let said = crate::said(&output);
    assert!(output.status.success(), "{said}");
    said
}

#[test]
fn every_warning_of_a_command_is_given_where_it_is_due_only() {
    for (id, command, scene, wrong, right, words) in OF_RUNS {
        let [found, fine] = [wrong, right].map(|gap| said(command, &filled(scene, gap), gap));
        let line = found.lines().find(|line| line.contains(id));
        assert!(line.is_some() && found.contains(words), "{id}: `{wrong}`\n{found}");
        let warns = line.is_some_and(|line| line.starts_with("warning"));
        let due = if warns { "warning" } else { id };
        assert!(!fine.contains(id) && !fine.contains(due), "{id}: `{right}`\n{fine}");
    }
}

/// What comes of a signal is tested in `robustness`.
const OF_SIGNALS: [&str; 2] = ["interrupted at", "interrupted after"];

#[test]
fn no_warning_is_without_a_row() {
    // The reader's: its own list of what is a warning, and the names of its variants.
    let source = std::fs::read_to_string(crate::file("src/mjcf/error.rs")).expect("the catalogue");
    let list =
        source.split("=> Severity::Warning").next().and_then(|s| s.rsplit("match self {").next()).expect("a list");
    let variants: Vec<&str> = list
        .split('|')
        .filter_map(|part| part.split_whitespace().find(|w| w.starts_with(char::is_uppercase)))
        .collect();
    assert!(variants.len() > 15, "{variants:?}");
    for variant in variants {
        let named = |line: &&str| line.trim_start().split(' ').next() == Some(variant) && line.contains("=> \"");
        let code = source.lines().find(named).and_then(|line| line.split('"').nth(1)).expect("a code");
        assert!(code == "ignored" || OF_FILES.iter().any(|row| row.0 == code), "`{code}` has no row");
    }
    for path in sources("src/mjcf") {
        let text = std::fs::read_to_string(&path).expect("a source");
        for lost in text.split(".ignored(\"").skip(1).filter_map(|part| part.split('"').next()) {
            assert!(OF_FILES.iter().any(|row| row.0 == lost), "{}: `{lost}` has no row", path.display());
        }
    }
    // The commands': every text that begins with the word.
    let mut found = 0;
    for path in sources("crates/cli/src") {
        let text = std::fs::read_to_string(&path).expect("a source").replace("\\\n", "");
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        for literal in text.split("\"warning: ").skip(1) {
            let literal = literal.replace("\\\"", "'");
            let literal = literal.split('"').next().unwrap_or_default();
            if literal.is_empty() {
                continue;
            }
            found += 1;
            let row = OF_RUNS.iter().map(|row| row.0).chain(OF_SIGNALS).any(|words| literal.contains(words));
            assert!(row, "{}: `warning: {literal}` has no row", path.display());
        }
    }
    assert!(found >= 18, "{found}");
}

/// All source files in a folder of the repository.
fn sources(folder: &str) -> Vec<PathBuf> {
    let entries =
        std::fs::read_dir(crate::file(folder)).expect("a folder").map(|entry| entry.expect("an entry").path());
    entries
        .flat_map(|path| {
            let inner = path.strip_prefix(crate::ROOT).expect("inside").display().to_string();
            if path.is_dir() { sources(&inner) } else { vec![path] }
        })
        .collect()
}
