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

/// Also where a file is small: n balls in one place are n (n − 1)/2 contacts.
#[test]
fn contacts_have_a_budget_too() {
    let folder = folder("crowd");
    let heap = |balls: usize| {
        let body = "<body><freejoint/><geom size='0.1'/></body>".repeat(balls);
        format!("<mujoco><worldbody>{body}</worldbody></mujoco>")
    };
    // Few geoms, whose pairs are all listed, and many.
    for balls in [20, 40] {
        let pairs = balls * (balls - 1) / 2;
        for (contacts, fits) in [(pairs, true), (pairs - 1, false)] {
            let limits = Limits { contacts, ..Limits::default() };
            let scene = penny::parse_within("heap.xml", &heap(balls), &limits).expect("a scene");
            let method = penny::forward::Method::of(&scene.model);
            let mut sim = penny::Simulation::new(scene.model, method);
            match sim.step() {
                Ok(()) => assert!(fits, "{balls} balls"),
                Err(error) => assert!(!fits && error.to_string().contains(&format!("more than {contacts} contacts"))),
            }
        }
    }
    write(&folder.join("heap.xml"), &heap(13_000));
    let begun = std::time::Instant::now();
    for command in [&["check", "heap.xml", "--deny", "warnings"][..], &["heap.xml"], &["explain", "heap.xml"]] {
        let output = penny_in(&folder, command);
        let said = said(&output);
        assert!(said.contains("more than 1000000 contacts"), "{command:?}: {said}");
        assert_eq!(output.status.code(), Some(1), "{command:?}: {said}");
    }
    assert!(begun.elapsed().as_secs() < 60, "{:?}", begun.elapsed());
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
        // Nor when a scene that is played is read again.
        write(&folder.join("played.xml"), &format!("<mujoco><worldbody>{BALL}</worldbody></mujoco>"));
        let opened = penny_view::open::open(&folder.join("played.xml")).expect("fine");
        std::fs::remove_file(folder.join("played.xml")).expect("there");
        assert!(Command::new("mkfifo").arg(&opened.files[0]).status().expect("mkfifo").success());
        let again = penny_view::open::open(&opened.files[0]).err().expect("refused");
        assert!(again.contains("error[not-a-file]"), "{again}");
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

/// Starts `penny` in a folder, to be interrupted; its warnings go to a file beside the folder.
///
/// A shell's job in the background ignores Ctrl-C, and what it starts does: `env` undoes that.
fn started(folder: &Path, args: &[&str]) -> std::process::Child {
    let quiet = std::process::Stdio::null;
    let mut command = Command::new("env");
    command.args(["--default-signal=INT", env!("CARGO_BIN_EXE_penny")]);
    let told = std::fs::File::create(folder.with_extension("told")).expect("a file");
    command.args(args).current_dir(folder).stdout(quiet()).stderr(told).spawn().expect("penny starts")
}

/// Rows of a CSV and of a JSON that are whole; panics if anything is not.
fn whole_rows(csv: &Path, json: &Path) -> [usize; 2] {
    let text = std::fs::read_to_string(csv).expect("the CSV");
    assert!(text.ends_with('\n'), "a line is cut: {:?}", text.lines().last());
    let columns = text.lines().next().map_or(0, |line| line.split(',').count());
    let whole = |line: &str| line.split(',').filter(|x| x.parse::<f64>().is_ok()).count() == columns;
    assert!(text.lines().skip(1).all(whole), "{text}");
    let value: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(json).expect("the JSON")).expect("valid JSON");
    [text.lines().count() - 1, value["rows"].as_array().map_or(0, Vec::len)]
}

fn patiently(what: &str, done: impl Fn() -> bool) {
    let start = std::time::Instant::now();
    while !done() {
        assert!(start.elapsed().as_secs() < 60, "{what}");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
}

/// One of two runs into one file ended well without its rows.
#[test]
#[cfg(unix)]
fn what_another_process_writes_is_left_to_it() {
    let folder = folder("busy");
    write(&folder.join("scene.xml"), &format!("<mujoco><worldbody>{BALL}</worldbody></mujoco>"));
    let csv = folder.join("x.csv");
    let run = || {
        let mut command = Command::new(env!("CARGO_BIN_EXE_penny"));
        command
            .args(["scene.xml", "--steps", "3", "--csv", "x.csv"])
            .current_dir(&folder)
            .output()
            .expect("penny starts")
    };
    let draft = penny::draft::Draft::new(&csv).expect("a draft");
    let mut rows = draft.open().expect("a file");
    let said = crate::said(&run());
    assert!(said.contains("cannot write `x.csv`: another process is writing it"), "{said}");
    std::io::Write::write_all(&mut rows, b"a row\n").and_then(|()| draft.keep()).expect("a row");
    let output = run();
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(std::fs::read_to_string(&csv).expect("the file"), "a row\n");
    drop(rows);
    assert!(run().status.success() && std::fs::read_to_string(&csv).expect("the file").lines().count() == 5);
}

#[test]
#[cfg(unix)]
fn an_interruption_leaves_the_old_file_or_a_whole_new_one() {
    let folder = folder("interrupted");
    write(&folder.join("scene.xml"), &format!("<mujoco><worldbody>{BALL}</worldbody></mujoco>"));
    let [csv, json, svg] = ["x.csv", "x.json", "x.svg"].map(|name| folder.join(name));
    let told = || std::fs::read_to_string(folder.with_extension("told")).expect("warnings");
    for (signal, code) in [("-INT", 130), ("-TERM", 143)] {
        [&csv, &json, &svg].into_iter().for_each(|path| write(path, "old"));
        let args =
            ["scene.xml", "--time", "1e5", "--every", "7", "--csv", "x.csv", "--json", "x.json", "--plot", "x.svg"];
        let mut child = started(&folder, &args);
        let size = |path: &Path| std::fs::metadata(path).map_or(0, |m| m.len());
        patiently("rows come", || size(&csv) > 20_000 && size(&json) > 20_000);
        let kill = Command::new("kill").arg(signal).arg(child.id().to_string()).status().expect("kill");
        assert!(kill.success() && child.wait().expect("it ends").code() == Some(code), "{signal}");
        let rows = whole_rows(&csv, &json);
        assert!(rows.iter().all(|&n| n > 20), "{signal}: {rows:?}");
        assert!(told().contains("warning: interrupted at "), "{signal}: {}", told());
        assert!(std::fs::read_to_string(&svg).expect("drawn").ends_with("</svg>\n"), "{signal}");
        assert_eq!(std::fs::read_dir(&folder).expect("there").count(), 4, "nothing else is left");
    }
    // The worlds that a rollout had stay.
    let worlds = ["rollout", "scene.xml", "--worlds", "1000000", "--vary", "gravity[z]=-9..-1", "--out", "w.csv"];
    let mut child = started(&folder, &worlds);
    let unfinished = folder.join("w.csv.unfinished");
    patiently("rows come", || std::fs::metadata(&unfinished).is_ok_and(|m| m.len() > 0));
    Command::new("kill").arg("-INT").arg(child.id().to_string()).status().expect("kill");
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
    assert!(told().contains("warning: interrupted after ") && told().contains("--resume"), "{}", told());
    for file in [unfinished, folder.join("w.csv.unfinished.json")] {
        std::fs::remove_file(file).expect("it is there");
    }
    // The old film stays while a new one is made.
    write(&folder.join("film.gif"), "old");
    let mut child = started(&folder, &["render", "scene.xml", "-o", "film.gif", "--time", "1e3"]);
    patiently("it begins", || folder.join("film.unfinished.gif").exists());
    Command::new("kill").arg(child.id().to_string()).status().expect("kill");
    child.wait().expect("it ends");
    assert_eq!(std::fs::read_to_string(folder.join("film.gif")).expect("the old one"), "old");
    // A map is written anew after each method: what is there is whole.
    let floor = "<geom type='plane' size='1 1 1'/>";
    write(&folder.join("falls.xml"), &format!("<mujoco><worldbody>{floor}{BALL}</worldbody></mujoco>"));
    for signal in ["-INT", "-TERM"] {
        let out = folder.join(format!("map{signal}"));
        let to = out.display().to_string();
        let grid = ["--map", "timestep,stiffness", "--cells", "3", "--time", "0.1", "--out", &to];
        let mut child = started(&folder, &[&["sweep", "falls.xml"], &grid[..]].concat());
        let file = |end: &str| out.join(format!("map-timestep-stiffness.{end}"));
        patiently("the first map", || file("json").exists());
        Command::new("kill").arg(signal).arg(child.id().to_string()).status().expect("kill");
        child.wait().expect("it ends");
        let json = std::fs::read_to_string(file("json")).expect("the map");
        serde_json::from_str::<serde_json::Value>(&json).expect("valid JSON");
        if file("svg").exists() {
            assert!(std::fs::read_to_string(file("svg")).expect("drawn").ends_with("</svg>\n"), "{signal}");
        }
    }
    // The rows that a sweep had are whole, and it goes on from them.
    for signal in ["-INT", "-TERM"] {
        let out = folder.join(format!("sweep{signal}"));
        let to = out.display().to_string();
        let sweep = |steps: &str, more: &[&str]| {
            let args = ["sweep", "scene.xml", "--laws", "penalty", "--time", "0.3", "--timesteps", steps, "--out", &to];
            started(&folder, &[&args[..], more].concat())
        };
        let mut child = sweep("1e-3,1e-7", &[]);
        let csv = out.join("sweep.csv");
        let lines = || std::fs::read_to_string(&csv).map_or(0, |text| text.lines().count());
        patiently("rows come", || lines() >= 2);
        Command::new("kill").arg(signal).arg(child.id().to_string()).status().expect("kill");
        assert!(!child.wait().expect("it ends").success(), "{signal}");
        let text = std::fs::read_to_string(&csv).expect("the table");
        let columns = |line: &str| line.split(',').count();
        assert!(
            text.ends_with('\n')
                && text.lines().all(|l| columns(l) == columns(&text[..text.find('\n').expect("a line")]))
        );
        let json = std::fs::read_to_string(out.join("sweep.json")).expect("what was swept");
        serde_json::from_str::<serde_json::Value>(&json).expect("valid JSON");
    }
}

#[test]
fn rows_are_in_the_file_within_a_second() {
    let folder = folder("flushed");
    write(&folder.join("scene.xml"), &format!("<mujoco><worldbody>{BALL}</worldbody></mujoco>"));
    // A row takes tens of milliseconds, and 8 kB of rows some seconds.
    let args = ["scene.xml", "--time", "1e6", "--every", "50000", "--csv", "x.csv"];
    let mut child = started(&folder, &args);
    let lines = || std::fs::read_to_string(folder.join("x.csv")).map_or(0, |text| text.lines().count());
    patiently("the first rows", || lines() >= 3);
    let before = lines();
    std::thread::sleep(std::time::Duration::from_millis(1500));
    let after = lines();
    child.kill().and_then(|()| child.wait()).expect("it ends");
    assert!(after > before, "{before} rows, and {after} later");
}

#[test]
#[cfg(unix)]
fn on_a_full_disk_the_rows_that_had_room_are_whole() {
    let folder = folder("full");
    let disk = folder.join("disk");
    write(&folder.join("scene.xml"), &format!("<mujoco><worldbody>{BALL}</worldbody></mujoco>"));
    write(&disk.join("not mounted"), "");
    let penny = env!("CARGO_BIN_EXE_penny");
    // A disk of 64 kB, seen by these commands alone.
    let script = format!(
        "mount -t tmpfs -o size=64k none disk || exit 99; echo old > disk/x.csv; echo old > disk/film.gif; \
         {penny} scene.xml --time 100 --csv disk/x.csv --json disk/x.json --plot disk/x.svg; echo code $?; \
         mkdir out; cp disk/* out; head -c 70000 /dev/zero > disk/fill 2>/dev/null; \
         echo old > out/y.csv; cp out/y.csv disk/x.csv; {penny} scene.xml --csv disk/x.csv; echo code $?; cp disk/x.csv out/y.csv; \
         {penny} render scene.xml -o disk/film.gif --time 0.2; echo code $?; cp disk/film.gif out; \
         {penny} sweep scene.xml --out disk/sweep --time 0.1; echo code $?; ls disk/sweep disk/*.unfinished*"
    );
    let mut command = Command::new("unshare");
    let output = command.args(["-rm", "sh", "-c", &script]).current_dir(&folder).output();
    let Some(output) = output.ok().filter(|output| output.status.code() != Some(99) && !output.stdout.is_empty())
    else {
        eprintln!("skipped: this system allows no small disk of one's own");
        return;
    };
    let text = said(&output);
    assert!(text.matches("code 1").count() == 4 && text.contains("No space left"), "{text}");
    assert!(!text.contains("film.unfinished"), "{text}");
    let out = |name: &str| folder.join("out").join(name);
    let rows = whole_rows(&out("x.csv"), &out("x.json"));
    assert!(rows.iter().all(|&n| n > 20), "{rows:?}");
    assert_eq!(std::fs::read_to_string(out("film.gif")).expect("the old one"), "old\n");
    assert!(!out("x.svg").exists() && !out("x.unfinished.csv").exists(), "nothing half there");
}

#[test]
fn outputs_are_checked_before_the_first_is_touched() {
    let folder = folder("outputs");
    let floor = "<mujoco><geom type='plane' size='1 1 1'/></mujoco>";
    write(&folder.join("parts/floor.xml"), floor);
    let text = format!("<mujoco><worldbody><include file='parts/floor.xml'/>{BALL}</worldbody></mujoco>");
    write(&folder.join("scene.xml"), &text);
    write(&folder.join("sweep.csv"), &text.replace("parts/", "parts/../parts/"));
    write(&folder.join("x.csv"), "old");
    let refused = |args: &[&str], part: &str| {
        let output = penny_in(&folder, args);
        let text = said(&output);
        assert!(output.status.code().is_some_and(|code| code > 0) && text.contains(part), "{args:?}: {text}");
    };
    refused(&["scene.xml", "--csv", "x.csv", "--json", "no/such.json"], "cannot write `no/such.json`");
    refused(&["scene.xml", "--csv", "x.csv", "--save-state", "parts"], "cannot write `parts`");
    refused(&["scene.xml", "--csv", "parts/floor.xml"], "would overwrite");
    refused(&["render", "scene.xml", "-o", "parts/floor.gif/../floor.xml"], "floor.xml");
    refused(&["sweep", "sweep.csv", "--out", "."], "would overwrite");
    #[cfg(unix)]
    {
        std::fs::hard_link(folder.join("scene.xml"), folder.join("same.csv")).expect("a link");
        std::fs::hard_link(folder.join("parts/floor.xml"), folder.join("floor.gif")).expect("a link");
        std::os::unix::fs::symlink("parts/floor.xml", folder.join("link.svg")).expect("a link");
        refused(&["scene.xml", "--csv", "same.csv"], "would overwrite");
        refused(&["scene.xml", "--plot", "link.svg"], "would overwrite");
        refused(&["render", "scene.xml", "-o", "floor.gif"], "would overwrite");
        // A link to an old file stays a link.
        std::os::unix::fs::symlink("x.csv", folder.join("link.csv")).expect("a link");
        assert!(penny_in(&folder, &["scene.xml", "--steps", "1", "--csv", "link.csv"]).status.success());
        assert!(std::fs::read_link(folder.join("link.csv")).is_ok());
        assert!(std::fs::read_to_string(folder.join("x.csv")).expect("there").starts_with("time,"));
        // And one to a file that does not exist yet, over two folders.
        std::os::unix::fs::symlink("parts/next.csv", folder.join("new.csv")).expect("a link");
        std::os::unix::fs::symlink("../new.txt", folder.join("parts/next.csv")).expect("a link");
        assert!(penny_in(&folder, &["scene.xml", "--steps", "1", "--csv", "new.csv"]).status.success());
        assert!(std::fs::read_link(folder.join("parts/next.csv")).is_ok());
        assert!(std::fs::read_to_string(folder.join("new.txt")).expect("there").starts_with("time,"));
        std::os::unix::fs::symlink("round.csv", folder.join("round.csv")).expect("a link");
        refused(&["scene.xml", "--csv", "round.csv"], "cannot write `round.csv`");
    }
    assert_eq!(std::fs::read_to_string(folder.join("parts/floor.xml")).expect("there"), floor);
    assert_eq!(std::fs::read_to_string(folder.join("scene.xml")).expect("there"), text);
}

#[test]
fn counts_that_nobody_can_wait_for_are_refused_at_once() {
    let folder = folder("counts");
    write(&folder.join("scene.xml"), &format!("<mujoco><worldbody>{BALL}</worldbody></mujoco>"));
    let start = std::time::Instant::now();
    for args in [
        &["scene.xml", "--time", "1e300"][..],
        &["scene.xml", "--steps", "18446744073709551615"],
        &["render", "scene.xml", "-o", "x.gif", "--time", "1e300"],
        &["render", "scene.xml", "-o", "x.gif", "--fps", "1e300"],
        &["render", "scene.xml", "-o", "x.gif", "--time", "1", "--timestep", "1e-300"],
        &["render", "scene.xml", "-o", "x.gif", "--speed", "1e-300"],
        &["render", "scene.xml", "-o", "x.png", "--speed", "1e300", "--time", "1e300"],
        &["sweep", "scene.xml", "--timesteps", "1e-4..1e-2:1000000000"],
        &["sweep", "scene.xml", "--timesteps", "1e-300..1e-2:3"],
        &["sweep", "scene.xml", "--time", "1e300"],
        &["sweep", "scene.xml", "--map", "timestep,stiffness", "--time", "1e300"],
    ] {
        let output = penny_in(&folder, args);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {}", said(&output));
        assert!(!folder.join("x.gif").exists() && !folder.join("sweep-scene").exists(), "{args:?} leaves files");
    }
    let log = |steps: &str, more: &str| {
        format!(
            "{{\"penny_run\":1,\"scene\":\"scene.xml\",\"scene_hash\":\"0\",\"seed\":0,\"contact\":\"penalty\",\
             \"integrator\":\"rk4\",\"timestep\":0.002,\"rounds\":1,\"steps\":{steps},\"inputs\":[{more}],\
             \"start\":{{\"time\":0,\"qpos\":[],\"qvel\":[],\"ctrl\":[]}}}}"
        )
    };
    let input = "{\"step\":1e300,\"change\":{\"timestep\":1}}";
    for text in [log("1000000000000000000", ""), log("1e300", ""), log("9", input)] {
        write(&folder.join("run.json"), &text);
        let output = penny_in(&folder, &["render", "run.json", "-o", "x.gif"]);
        assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    }
    assert!(start.elapsed().as_secs() < 30, "each takes a moment");
}

#[test]
fn an_energy_that_overflows_is_reported() {
    let folder = folder("overflow");
    let text = "<mujoco><worldbody><body pos='0 0 1000'><freejoint/><geom size='.1' mass='1e307'/></body></worldbody></mujoco>";
    write(&folder.join("heavy.xml"), text);
    let text = said(&penny_in(&folder, &["heavy.xml", "--steps", "3", "--csv", "x.csv"]));
    assert!(text.contains("warning: from 0 s on the energy is too large a number"), "{text}");
}

#[test]
fn a_damaged_best_list_is_kept_aside() {
    let folder = folder("best");
    let path = folder.join("best.json");
    for (n, damaged) in ["best.damaged.json", "best.damaged-1.json"].iter().enumerate() {
        write(&path, &format!("[{{\"points\": {n}"));
        assert!(penny_view::game::best::load(&path).is_empty());
        let kept = std::fs::read_to_string(folder.join(damaged)).expect("kept");
        assert_eq!(kept, format!("[{{\"points\": {n}"));
        assert!(!path.exists());
    }
}

/// A program that takes MuJoCo's place and never answers, or never ends.
#[test]
#[cfg(unix)]
fn a_foreign_python_is_not_waited_for_and_not_believed() {
    let folder = folder("python");
    write(&folder.join("scene.xml"), &format!("<mujoco><worldbody>{BALL}</worldbody></mujoco>"));
    for (name, script, part) in [
        ("flood", "exec cat /dev/zero", "has none"),
        ("commands", "printf '{\"version\": \"\\033[2J\"}\\n'; exec cat", "has"),
        ("quits", "exit 3", "has none"),
    ] {
        let path = folder.join(name);
        write(&path, &format!("#!/bin/sh\n{script}\n"));
        use std::os::unix::fs::PermissionsExt;
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).expect("executable");
        let mut command = Command::new(env!("CARGO_BIN_EXE_penny"));
        let output = command.args(["compare", "scene.xml"]).current_dir(&folder).env("PENNY_PYTHON", &path).output();
        let output = output.expect("penny starts");
        assert!(output.status.code() == Some(1) && said(&output).contains(part), "{name}: {}", said(&output));
        assert!(!said(&output).contains('\u{1b}'), "{name}: {}", said(&output));
    }
}

#[test]
#[cfg(unix)]
#[ignore = "waits for 30 s: cargo test --test it never_answers -- --ignored"]
fn a_python_that_never_answers_is_given_up() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder("python-silent");
    write(&folder.join("scene.xml"), &format!("<mujoco><worldbody>{BALL}</worldbody></mujoco>"));
    let path = folder.join("silent");
    write(&path, "#!/bin/sh\nexec sleep 600\n");
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).expect("executable");
    let mut command = Command::new(env!("CARGO_BIN_EXE_penny"));
    let output = command.args(["compare", "scene.xml"]).current_dir(&folder).env("PENNY_PYTHON", &path).output();
    let output = output.expect("penny starts");
    assert!(output.status.code() == Some(1) && said(&output).contains("within 30 s"), "{}", said(&output));
}

/// Ten boxes under an implicit integrator: without a budget, trying took half a minute.
#[test]
fn what_is_tried_before_the_first_step_has_a_budget() {
    use penny_lab::explain::{Budget, trial_run};
    let boxes: String = (0..10)
        .map(|i| {
            format!("<body pos='0 0 {}'><freejoint/><geom type='box' size='.1 .1 .1'/></body>", 0.1 + 0.2 * i as f64)
        })
        .collect();
    let text = format!("<mujoco><worldbody><geom type='plane' size='1 1 1'/>{boxes}</worldbody></mujoco>");
    let model = penny::parse("boxes.xml", &text).expect("fine").model;
    let integrator = penny::integrate::by_name("implicit-euler").expect("there");
    let method = penny::forward::Method { integrator, ..penny_view::open::method(&model).expect("fine") };
    let budget = Budget::seconds(0.0);
    let state = penny::state::State::new(&model);
    assert_eq!(trial_run::largest_timestep(&model, &method, &state, &budget), None);
    assert!(budget.used_up(), "what was left out is known");
}

/// Times of a debug build on a busy machine; what grows with the square of the number takes minutes.
#[test]
fn work_grows_with_the_file_only() {
    let many = |n: usize, each: &dyn Fn(usize) -> String| (0..n).map(each).collect::<String>();
    let world = |inner: &str| format!("<mujoco><worldbody>{inner}</worldbody></mujoco>");
    let geom = |i: usize| format!("<geom name='g{i}' size='.1'/>\n");
    let body = |i: usize| format!("<body pos='{i} 0 0'><freejoint/>{}</body>", geom(i));
    let cases = [
        ("bodies", world(&("<geom type='plane' size='1 1 1'/>".to_owned() + &many(15_000, &body)))),
        ("hinges", world(&many(20_000, &|i| format!("<body><joint/>{}</body>", geom(i))))),
        ("fixed geoms", world(&many(30_000, &geom))),
        ("masks that never match", world(&many(5_000, &body).replace("size", "contype='2' conaffinity='4' size"))),
        ("pairs", {
            let pair = |i: usize| format!("<pair geom1='g{i}' geom2='g{}'/>", (i * 7 + 1) % 5_000);
            let contact = format!("</worldbody><contact>{}</contact>", many(5_000, &pair));
            world(&many(5_000, &body)).replace("</worldbody>", &contact)
        }),
        ("tendons and cameras", {
            let arm = |i: usize| format!("<body name='b{i}'><joint name='j{i}'/>{}</body>", geom(i));
            let fixed = |i: usize| format!("<fixed><joint joint='j{i}' coef='1'/></fixed>");
            let camera = |i: usize| format!("<camera mode='targetbody' target='b{i}'/>");
            let tendon = format!("</worldbody><tendon>{}</tendon>", many(5_000, &fixed));
            world(&(many(5_000, &arm) + &many(5_000, &camera))).replace("</worldbody>", &tendon)
        }),
        ("bodies of one tree", {
            let arm = |i: usize| format!("<body pos='{i} 0 0'><joint/><geom size='.1' contype='0'/></body>");
            world(&format!("<body>{}<freejoint/><geom size='1'/></body>", many(8_000, &arm)))
        }),
        ("attributes", world(&format!("<geom size='1' {}/>", many(20_000, &|i| format!("a{i}='1' "))))),
        ("errors", world(&many(30_000, &|i| format!("<geom size='1' fricton{i}='1'/>\n")))),
        ("references", {
            let exclude = |i: usize| format!("<exclude body1='x{i}' body2='y{i}'/>");
            let contact = format!("</worldbody><contact>{}</contact>", many(10_000, &exclude));
            world(&many(5_000, &body)).replace("</worldbody>", &contact)
        }),
        ("names", world(&many(20_000, &|_| "<geom name='a' size='1'/>".to_owned()))),
        (
            "text",
            world(&(many(3_000, &|i| format!("<geom sise{i}='1'/>")) + &many(20_000, &|_| "x<geom size='1'/>".into()))),
        ),
        ("frames", {
            let (open, close) = ("<frame euler='1 2 3'>".repeat(150), "</frame>".repeat(150));
            world(&(open + &many(5_000, &geom) + &close))
        }),
        ("ends", format!("<mujoco>{}{}", "<a>".repeat(100), "</b>".repeat(30_000))),
        ("planes", world(&(many(1_500, &body) + &"<geom type='plane' size='1 1 1'/>".repeat(1_500)))),
    ];
    let mut slow = String::new();
    for (name, text) in cases {
        let start = std::time::Instant::now();
        let outcome = penny::parse("scene.xml", &text);
        let report = outcome.err().map_or(0, |failure| failure.to_string().len());
        let seconds = start.elapsed().as_secs_f64();
        eprintln!("{name}: {seconds:.2} s, {} kB, report of {report} bytes", text.len() / 1000);
        if seconds > 20.0 {
            slow += &format!("{name}: {seconds:.1} s\n");
        }
    }
    assert!(slow.is_empty(), "{slow}");
}
