//! What hostile or broken files can do: nothing but a report. The promises stand in docs/robustness.md.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use penny::mjcf::{self, Limits};

/// A folder of one test, empty.
pub fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("robustness").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}

pub fn write(path: &Path, text: &str) {
    std::fs::create_dir_all(path.parent().expect("in a folder")).expect("a folder");
    std::fs::write(path, text).expect("a file");
}

/// Runs `penny` in a folder.
pub fn penny_in(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_penny")).args(args).current_dir(folder).output().expect("penny starts")
}

pub fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout)
}

/// The codes of what is wrong with a file.
fn codes(path: &Path, limits: &Limits) -> Vec<&'static str> {
    match penny::load_within(path, limits) {
        Ok(_) => Vec::new(),
        Err(failure) => failure.problems.iter().map(|p| p.kind.code()).collect(),
    }
}

const BALL: &str = "<body pos='0 0 1'><freejoint/><geom size='.1'/></body>";

#[test]
fn one_budget_holds_for_a_scene_and_all_that_it_includes() {
    let folder = folder("budget");
    let main = folder.join("main.xml");
    // 15 files of 198 levels, each within the one before.
    for i in 0..15 {
        let (open, close) = ("<body>".repeat(196), "</body>".repeat(196));
        let inner = if i < 14 { format!("<include file='deep{}.xml'/>", i + 1) } else { "<geom size='1'/>".into() };
        write(&folder.join(format!("deep{i}.xml")), &format!("<mujocoinclude>{open}{inner}{close}</mujocoinclude>"));
    }
    write(&main, "<mujoco><worldbody><include file='deep0.xml'/></worldbody></mujoco>");
    assert_eq!(codes(&main, &Limits::default()), ["too-deep"]);
    // A chain of 4,300 includes.
    for i in 0..4300 {
        let text = format!("<mujocoinclude><include file='chain{}.xml'/></mujocoinclude>", i + 1);
        write(&folder.join(format!("chain{i}.xml")), &text);
    }
    write(&folder.join("chain4300.xml"), "<mujocoinclude/>");
    write(&main, "<mujoco><include file='chain0.xml'/></mujoco>");
    assert_eq!(codes(&main, &Limits::default()), ["too-deep"]);

    // Three files of four elements each.
    let ball = format!("<mujocoinclude>{BALL}</mujocoinclude>").replace("size", "name='g' size");
    (0..3).for_each(|i| write(&folder.join(format!("ball{i}.xml")), &ball.replace("'g'", &format!("'g{i}'"))));
    let includes: String = (0..3).map(|i| format!("<include file='ball{i}.xml'/>")).collect();
    let text = format!("<mujoco><worldbody>{includes}</worldbody></mujoco>");
    write(&main, &text);
    let total = text.len() + 3 * (ball.len() + 1);
    for (limit, enough) in [("depth", 6), ("includes", 3), ("bytes", total), ("elements", 11), ("names", 4)] {
        let within = |value: usize| {
            let mut limits = Limits::default();
            limits.set(limit, value).expect("a limit");
            penny::load_within(&main, &limits)
        };
        assert!(within(enough).is_ok(), "{limit}: {}", within(enough).unwrap_err());
        let report = within(enough - 1).expect_err(limit).to_string();
        assert_eq!(report.matches("error[").count(), 1, "{report}");
        let cure = format!("--limit {limit}={}", 2 * (enough - 1));
        assert!(report.contains(&cure), "`{cure}` is missing in:\n{report}");
    }
    let output = penny_in(&folder, &["check", "main.xml", "--limit", "includes=2"]);
    assert!(output.status.code() == Some(1) && said(&output).contains("more than 2 includes"), "{}", said(&output));
    assert_eq!(penny_in(&folder, &["check", "main.xml", "--limit", "depth=501"]).status.code(), Some(2));
}

#[test]
fn the_deepest_scene_fits_the_stack_of_a_thread() {
    let limits = Limits { depth: Limits::MOST_DEPTH, ..Limits::default() };
    let folder = folder("deep");
    // Bodies, frames and default classes; `mujoco`, the section and the innermost element are levels too.
    let n = Limits::MOST_DEPTH - 3;
    let nested = |open: &str, inner: &str, close: &str| format!("{}{inner}{}", open.repeat(n), close.repeat(n));
    let classes: String = (0..n).map(|i| format!("<default class='c{i}'>")).collect();
    let wrong = nested("<boddy>", "<geom sise='1'/>", "</boddy>");
    let body = nested("<body pos='0 0 1'>", "<geom size='.1'/>", "</body>");
    let texts = [
        format!("<mujoco><worldbody>{body}</worldbody></mujoco>"),
        format!(
            "<mujoco><worldbody>{}</worldbody></mujoco>",
            nested("<frame euler='0 0 1'>", "<geom size='1'/>", "</frame>")
        ),
        format!("<mujoco><worldbody>{wrong}</worldbody></mujoco>"),
        format!("<mujoco><default>{classes}<geom size='1'/>{}</default></mujoco>", "</default>".repeat(n)),
    ];
    let paths: Vec<PathBuf> = (0..texts.len()).map(|i| folder.join(format!("{i}.xml"))).collect();
    paths.iter().zip(&texts).for_each(|(path, text)| write(path, text));
    let thread = std::thread::Builder::new().stack_size(2 << 20).spawn(move || {
        paths.iter().map(|path| codes(path, &limits).first().copied().unwrap_or("fine")).collect::<Vec<_>>()
    });
    let found = thread.expect("a thread").join().expect("no overflow");
    assert_eq!(found, ["fine", "fine", "unknown-element", "fine"]);
}

#[test]
fn includes_are_looked_for_as_mujoco_does() {
    // In the main file's folder, then in the including file's.
    let folder = folder("include");
    write(&folder.join("main.xml"), "<mujoco><worldbody><include file='parts/arm.xml'/></worldbody></mujoco>");
    write(
        &folder.join("parts/arm.xml"),
        "<mujoco><include file='more/a.xml'/><include file='b.xml'/><include file='../c.xml'/></mujoco>",
    );
    write(&folder.join("parts/more/a.xml"), "<mujoco><geom name='a' size='1'/></mujoco>");
    write(&folder.join("parts/b.xml"), "<mujoco><geom name='b of parts' size='1'/></mujoco>");
    write(&folder.join("b.xml"), "<mujoco><geom name='b' size='1'/></mujoco>");
    write(&folder.join("c.xml"), "<mujoco><geom name='c' size='1'/></mujoco>");
    let scene = penny::load(&folder.join("main.xml")).unwrap_or_else(|e| panic!("{e}"));
    let names: Vec<&str> = scene.model.geoms.iter().map(|g| g.name.as_str()).collect();
    assert_eq!(names, ["a", "b", "c"]);
    for source in &scene.document.files {
        assert!(source.path.is_file(), "{} is where it was read", source.path.display());
    }
}

#[test]
fn a_scene_reads_regular_files_of_its_own_folder_only() {
    let all = folder("outside");
    let folder = all.join("scene");
    write(&all.join("secret.xml"), "top secret <words>");
    write(&all.join("secrets.txt"), "");
    write(&all.join("fine.xml"), "<mujoco><geom size='1'/></mujoco>");
    let include = |file: &str| {
        let text = format!("<mujoco><worldbody><include file='{file}'/></worldbody></mujoco>");
        write(&folder.join("main.xml"), &text);
        penny_in(&folder, &["check", "main.xml"])
    };
    let absolute = all.join("secret.xml").display().to_string();
    let mut cases =
        vec!["../secret.xml", "../secrte.xml", "nowhere/../../secret.xml", &absolute, "/etc/passwd", "/dev"];
    #[cfg(unix)]
    {
        include("");
        std::os::unix::fs::symlink("../secret.xml", folder.join("link.xml")).expect("a link");
        std::os::unix::fs::symlink("..", folder.join("up")).expect("a link");
        cases.extend(["link.xml", "up/secret.xml", "up/nothing.xml"]);
    }
    for file in cases {
        let output = include(file);
        let text = said(&output);
        assert!(output.status.code() == Some(1) && text.contains("error[outside]"), "{file}: {text}");
        assert!(text.contains("--allow-outside") && !text.contains("words"), "{file}: {text}");
        assert!(!text.contains("secret.xml`?") && !text.contains("secrets"), "{file}: no suggestion: {text}");
    }
    include("../fine.xml");
    let output = penny_in(&folder, &["check", "main.xml", "--allow-outside"]);
    assert!(output.status.success(), "{}", said(&output));

    // What is no regular file is not even opened: a pipe would wait for ever.
    #[cfg(unix)]
    {
        let pipe = folder.join("pipe.xml");
        assert!(Command::new("mkfifo").arg(&pipe).status().expect("mkfifo").success());
        let _socket = std::os::unix::net::UnixListener::bind(folder.join("socket.xml")).expect("a socket");
        for file in ["pipe.xml", "socket.xml"] {
            for output in [include(file), penny_in(&folder, &["check", file])] {
                assert!(said(&output).contains("error[not-a-file]"), "{file}: {}", said(&output));
            }
        }
        let output = penny_in(&folder, &["check", "/dev/zero"]);
        assert!(said(&output).contains("error[not-a-file]"), "{}", said(&output));
    }
}

#[test]
fn a_recorded_session_brings_no_foreign_scene() {
    let all = folder("session");
    let run = all.join("session/run.json");
    write(&all.join("session/scene.xml"), &format!("<mujoco><worldbody>{BALL}</worldbody></mujoco>"));
    write(&all.join("secret.xml"), "<secret words='here'/>");
    let log = |scene: &str| {
        serde_json::json!({
            "penny_run": 1, "scene": scene, "scene_hash": "0", "seed": 0, "contact": "penalty",
            "integrator": "semi-implicit-euler", "timestep": 0.002, "rounds": 100, "steps": 1, "inputs": [],
            "start": { "time": 0.0, "qpos": [], "qvel": [], "ctrl": [] },
        })
    };
    let secret = all.join("secret.xml").display().to_string();
    for scene in ["../secret.xml", &secret, "/dev/zero"] {
        write(&run, &log(scene).to_string());
        let output = penny_in(&all.join("session"), &["render", "run.json", "-o", "x.png"]);
        let text = said(&output);
        assert!(output.status.code() == Some(1) && text.contains("--allow-outside"), "{scene}: {text}");
        assert!(!text.contains("words") && !text.contains("mujoco"), "{scene}: {text}");
    }
    write(&run, &log("scene.xml").to_string());
    let text = said(&penny_in(&all.join("session"), &["render", "run.json", "-o", "x.png"]));
    assert!(text.contains("is not the file that this session was recorded with"), "{text}");
}

#[test]
fn a_report_is_bounded() {
    let report = |text: &str| mjcf::parse("scene.xml", text).expect_err("wrong").to_string();
    let geoms = |n: usize, attributes: &dyn Fn(usize) -> String, end: &str| {
        let geoms: String = (0..n).map(|i| format!("<geom {}/>{end}", attributes(i))).collect();
        format!("<mujoco><worldbody>{geoms}</worldbody></mujoco>")
    };
    // All on one line: 4,000 names that are taken, and as many errors that differ.
    let taken = report(&geoms(4000, &|_| "name='a' size='1'".into(), ""));
    assert!(taken.contains("the same in 3998 more places") && taken.len() < 4000, "{}", taken.len());
    let wrong = report(&geoms(4000, &|i| format!("size='1' mass='x{i}'"), ""));
    assert_eq!(wrong.matches("error[").count(), 50, "{wrong}");
    assert!(wrong.contains("and 3950 more errors") && wrong.len() < 40_000, "{}", wrong.len());
    let widest = wrong.lines().map(|line| line.chars().count()).max().unwrap_or(0);
    assert!(widest < 200, "{widest}");
    // The column is the file's, also where the line is cut.
    let text = geoms(4000, &|i| format!("size='1' mass='{}'", if i == 3000 { "x" } else { "1" }), "");
    let column = text.find("'x'").expect("there") + 2;
    assert!(report(&text).contains(&format!("scene.xml:1:{column}\n")), "{}", report(&text));
    // Errors are shown rather than warnings.
    let text = geoms(200, &|i| format!("size='1' rgba='2 0 0 {i}'"), "\n").replace("rgba='2 0 0 199'", "mass='x'");
    assert!(report(&text).contains("`x` is not a number"), "{}", report(&text));
    // A word of a megabyte is not repeated.
    let word = report(&geoms(1, &|_| format!("size='1' mass='{}'", "x".repeat(1 << 20)), ""));
    assert!(word.len() < 4000, "{}", word.len());
}

#[test]
fn text_of_a_file_gives_no_commands_to_a_terminal() {
    let folder = folder("escape");
    let hostile = "&#27;[31mj&#10;forged line&#x9b;2J&#x202e;";
    let text = format!(
        "<mujoco model='{hostile}'>\u{1b}[2J<worldbody><body name='{hostile}' pos='0 0 1'><joint name='{hostile}' \
         type='slide' axis='0 0 1'/><geom name='{hostile}' size='.1'/></body><geom name='\u{1b}[7mfloor' \
         type='plane' size='1 1 1'/></worldbody><keyframe><key name='{hostile}'/></keyframe></mujoco>"
    );
    write(&folder.join("scene.xml"), &text);
    write(&folder.join("wrong.xml"), &text.replace("slide", "\u{1b}[5m").replace("size", "\u{1b}[5m"));
    let commands = |text: &str| text.contains(|c: char| (c.is_control() && c != '\n' && c != '\t') || c == '\u{202e}');
    for args in [
        &["check", "scene.xml"][..],
        &["check", "wrong.xml"],
        &["check", "\u{1b}[31mnot there.xml"],
        &["scene.xml", "--steps", "20", "--csv", "x.csv", "--json", "x.json", "--plot", "x.svg"],
        &["explain", "scene.xml"],
        &["scene.xml", "--key", "nothing"],
        &["scene.xml", "--qpos", "1 2 3"],
    ] {
        let text = said(&penny_in(&folder, args));
        assert!(!commands(&text), "{args:?}: {text:?}");
        assert!(!text.lines().any(|line| line.starts_with("forged")), "{args:?}: {text}");
    }
    for file in ["x.csv", "x.json", "x.svg"] {
        let text = std::fs::read_to_string(folder.join(file)).expect("written");
        assert!(!commands(&text), "{file}");
    }
}

#[test]
fn a_byte_0_is_an_error_at_its_place() {
    let report =
        mjcf::parse("nul.xml", "<mujoco>\n<worldbody>\0</worldbody></mujoco>").expect_err("refused").to_string();
    assert!(report.contains("error[nul-byte]") && report.contains("nul.xml:2:12"), "{report}");
    let report = mjcf::parse("nul.xml", "<mujoco model='a&#0;b'/>").expect_err("refused").to_string();
    assert!(report.contains("error[bad-entity]"), "{report}");
}
