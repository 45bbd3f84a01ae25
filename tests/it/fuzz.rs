//! Fuzzing: what nobody would write must give a report or a run, never a panic, a hang or a silent NaN.
//!
//! Five targets, each a function of one seed: bytes → document; schema-driven MJCF → model → steps under every law;
//! trees of includes; recorded sessions; command lines. The default suite gives each a moment; for longer runs:
//!
//!     PENNY_FUZZ=3600 PENNY_FUZZ_FROM=1000000 cargo test --profile fuzz --test it fuzz -- --nocapture
//!
//! `PENNY_FUZZ`: seconds for each target. `PENNY_FUZZ_FROM`: the first seed. A failure names its target and seed;
//! `PENNY_FUZZ=0 PENNY_FUZZ_FROM=seed` runs that one again. Files in tests/fuzz are what once went wrong, and they are
//! mutated along with the models and the files of the reader's tests.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use penny::data::Data;
use penny::forward::{Method, step};
use penny::mjcf::schema::{self, Element, Kind, Rule, Status};
use penny::mjcf::{self, Limits};
use penny::model::Model;
use penny::state::State;
use penny::{contact, integrate};
use penny_view::log::Log;
use penny_view::session::{Player, Session, Source};

use crate::random_scene::Random;

/// An input may take so much processor time, s. In a release build none takes more than one.
const LONGEST: f64 = 20.0;
/// The whole process, so each input, may have so much memory, kB.
const MEMORY: u64 = 256 << 10;
/// A scene that touches at more points is not run.
const MOST_CONTACTS: usize = 300;
/// No further step is taken after so much processor time, s.
const ENOUGH: f64 = 0.3;
/// And a report may have so many bytes.
const REPORT: usize = 150_000;

fn setting(name: &str) -> Option<f64> {
    std::env::var(name).ok()?.parse().ok()
}

/// Names the input that was at work when a test failed.
struct Input(&'static str, u64);

impl Drop for Input {
    fn drop(&mut self) {
        if std::thread::panicking() {
            eprintln!("PENNY_FUZZ=0 PENNY_FUZZ_FROM={} cargo test --test it fuzz::{} fails again", self.1, self.0);
        }
    }
}

/// Processor time of this thread, s: what an input takes on a machine that others use too. Where it is not told, the
/// time since `start`.
fn spent(start: Instant) -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = told.and_then(|text| text.split(' ').next()?.parse::<f64>().ok());
    nanoseconds.map_or(start.elapsed().as_secs_f64(), |ns| ns * 1e-9)
}

/// The most memory that this process has had, kB, where the system tells.
fn peak() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    status.lines().find(|line| line.starts_with("VmHWM"))?.split_whitespace().nth(1)?.parse().ok()
}

/// Gives a target one seed after the other until its time is over, and says every minute where it is.
fn fuzz(name: &'static str, mut target: impl FnMut(u64)) {
    let seconds = setting("PENNY_FUZZ").unwrap_or(0.5);
    let from = setting("PENNY_FUZZ_FROM").unwrap_or(0.0) as u64;
    let start = Instant::now();
    let (mut seed, mut longest, mut minutes) = (from, (0.0, from), 1);
    let mut before = spent(start);
    loop {
        let input = Input(name, seed);
        target(seed);
        let after = spent(start);
        if after - before > longest.0 {
            longest = (after - before, seed);
        }
        assert!(longest.0 < LONGEST, "{name}: seed {seed} takes {:.1} s", longest.0);
        before = after;
        seed += 1;
        let over = start.elapsed().as_secs_f64() >= seconds;
        if over || start.elapsed().as_secs() >= 60 * minutes {
            minutes += 1;
            let peak = peak().unwrap_or(0);
            let (took, by) = longest;
            eprintln!("fuzz::{name}: {} inputs, the longest {took:.3} s (seed {by}), {peak} kB", seed - from);
            assert!(peak < MEMORY, "{name}: an input before seed {seed} takes {peak} kB");
        }
        drop(input);
        if over {
            break;
        }
    }
}

/// A folder for the small files of a target, in memory where the system has such a place; removed at the end.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Scratch {
        let memory = Path::new("/dev/shm").join(format!("penny-fuzz-{}-{name}", std::process::id()));
        Scratch(if std::fs::create_dir(&memory).is_ok() { memory } else { crate::robustness::folder(name) })
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn pick<'a, T>(random: &mut Random, of: &'a [T]) -> &'a T {
    &of[random.below(of.len())]
}

/// All small files of the repository that are, or nearly are, MJCF.
fn corpus() -> Vec<String> {
    let mut files: Vec<PathBuf> = Vec::new();
    for folder in ["tests/fuzz", "tests/mjcf/good", "tests/mjcf/bad", "models"] {
        let entries = std::fs::read_dir(crate::file(folder)).expect("a folder");
        files.extend(entries.map(|entry| entry.expect("a file").path()));
    }
    files.retain(|path| path.extension().is_some_and(|e| e == "xml"));
    files.sort();
    let text = |path: &PathBuf| String::from_utf8_lossy(&std::fs::read(path).expect("readable")).into_owned();
    files.iter().map(text).filter(|text| text.len() < 20_000).collect()
}

/// What is put into texts: XML's own signs, numbers at the edges, commands to terminals.
const WORDS: &[&str] = &[
    "<",
    ">",
    "/>",
    "</",
    "\"",
    "'",
    "=",
    "&",
    "&#0;",
    "&#27;[2J",
    "&lt;",
    "<!--",
    "-->",
    "<![CDATA[",
    "]]>",
    "<?xml?>",
    "<!DOCTYPE a>",
    "\0",
    "\u{1b}[31m",
    "\u{202e}",
    "\u{feff}",
    "−",
    "1e308",
    "-1e308",
    "1e-320",
    "nan",
    "inf",
    "-0",
    "0",
    "-1",
    "1e300 1e300 1e300",
    "2147483648",
    "99999999999999999999",
    "<mujoco>",
    "</mujoco>",
    "<worldbody>",
    "<body>",
    "</body>",
    "<geom size='1'/>",
    "<freejoint/>",
    "<include file='x.xml'/>",
    "<replicate count='9'>",
    "</replicate>",
    "<default class='a'>",
    "</default>",
    "<frame euler='1 2 3'>",
    "</frame>",
    "name='a'",
    "class='a'",
    "\n",
    " ",
    "\t",
];

fn mutated(random: &mut Random, corpus: &[String]) -> String {
    let mut bytes = pick(random, corpus).clone().into_bytes();
    for _ in 0..1 + random.below(8) {
        let at = random.below(bytes.len() + 1);
        let to = (at + random.below(40)).min(bytes.len());
        match random.below(7) {
            0 if at < bytes.len() => bytes[at] = random.below(256) as u8,
            1 => drop(bytes.drain(at..to)),
            2 => {
                let part = bytes[at..to].to_vec();
                let n = if random.chance(0.05) { 300 } else { 1 + random.below(4) };
                bytes.splice(at..at, part.repeat(n));
            }
            3 | 4 => drop(bytes.splice(at..at, pick(random, WORDS).bytes())),
            5 => drop(bytes.splice(at..to, pick(random, WORDS).bytes())),
            _ => {
                let other = pick(random, corpus).as_bytes();
                let from = random.below(other.len());
                let part = &other[from..(from + random.below(400)).min(other.len())];
                bytes.splice(at..at, part.iter().copied());
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// A report is bounded, and gives no commands.
fn reported(failure: &mjcf::Failure) {
    let report = failure.to_string();
    assert!(!failure.problems.is_empty() && report.len() < REPORT, "{} bytes", report.len());
    let command = report.chars().find(|c| c.is_control() && *c != '\n' && *c != '\t');
    assert!(command.is_none(), "{command:?} in {report:?}");
    for problem in &failure.problems {
        let file = &failure.document.files[problem.span.file as usize];
        assert!(problem.span.start <= problem.span.end, "{problem:?}");
        assert!(problem.span.end as usize <= file.text.len(), "{problem:?} is not in its file");
    }
}

/// Small budgets, so that they are met.
fn limits(random: &mut Random) -> Limits {
    let mut limits = Limits { depth: 60, elements: 3000, ..Limits::default() };
    if random.chance(0.05) {
        limits.set(Limits::NAMES[random.below(5)], random.below(30)).expect("a limit");
    }
    limits
}

#[test]
fn documents() {
    let corpus = corpus();
    fuzz("documents", |seed| {
        let random = &mut Random::new(seed);
        let text = mutated(random, &corpus);
        match penny::parse_within("fuzz.xml", &text, &limits(random)) {
            Ok(scene) => run(random, &scene.model, 2),
            Err(failure) => reported(&failure),
        }
    });
}

/// What once went wrong goes right, as it is.
#[test]
fn what_went_wrong_once() {
    for entry in std::fs::read_dir(crate::file("tests/fuzz")).expect("a folder") {
        let path = entry.expect("a file").path();
        match penny::load_within(&path, &Limits::default()) {
            Ok(scene) => (0..20).for_each(|seed| run(&mut Random::new(seed), &scene.model, 4)),
            Err(failure) => reported(&failure),
        }
    }
}

/// A few steps under every law; what comes out are numbers, or an error. A step may look for the contacts a hundred times
/// (implicit Euler, extrapolated), so the contacts bound its work: many shapes put into each other are not run.
fn run(random: &mut Random, model: &Model, steps: usize) {
    if model.nv > 200 || model.geoms.len() > 300 {
        return;
    }
    let mut data = Data::new(model);
    let state = State::new(model);
    penny::dynamics::kinematics(model, &state.qpos, &mut data);
    penny::collision::detect(model, &mut data);
    if data.contacts.len() > MOST_CONTACTS {
        return;
    }
    let start = Instant::now();
    let before = spent(start);
    for law in contact::ALL {
        let integrator = pick(random, integrate::ALL);
        let method = Method { contact: law, integrator, timestep: model.opt.timestep, rounds: 100 };
        let mut state = State::new(model);
        if random.chance(0.5) {
            state.qvel.iter_mut().for_each(|v| *v = random.within(-3.0, 3.0));
        }
        for _ in 0..steps {
            if spent(start) - before > ENOUGH {
                return;
            }
            if step(model, &method, &mut state, &mut data).is_err() {
                break;
            }
            let numbers = state.qpos.iter().chain(&state.qvel).chain([&state.time]);
            assert!(numbers.into_iter().all(|x| x.is_finite()), "{} with {}: {state:?}", law.name, integrator.name);
        }
    }
}

/// Writes MJCF out of the schema: elements where they may stand, attributes of the right kind, now and then odd ones.
struct Writer<'r> {
    random: &'r mut Random,
    text: String,
    left: usize,
    names: usize,
}

impl Writer<'_> {
    fn element(&mut self, parent: &str, name: &str, depth: usize) {
        let Some(row) = schema::find(parent, name).filter(|_| self.left > 0) else { return };
        if matches!(row.status, Status::Unsupported(..)) && self.random.chance(0.98) {
            return;
        }
        self.left -= 1;
        let _ = write!(self.text, "<{name}");
        let in_default = parent == "default";
        for column in row.typed_attributes() {
            let seldom = match (column.status, column.kind, column.name) {
                (Status::Unsupported(..), ..) | (_, Kind::Reference(_) | Kind::ReferenceBy(_), _) => 0.01,
                (_, _, "quat" | "axisangle" | "xyaxes" | "zaxis" | "fromto" | "fullinertia" | "limited") => 0.01,
                _ => 0.12,
            };
            let wanted = column.required || matches!(column.name, "size" | "type" | "diaginertia");
            if (wanted || self.random.chance(seldom)) && (!in_default || column.in_default) {
                let value = self.value(row, column);
                let _ = write!(self.text, " {}=\"{value}\"", column.name);
            }
        }
        self.text.push('>');
        if depth < 12 {
            if name == "body" {
                let free = if parent == "worldbody" { "freejoint" } else { "joint" };
                let joint = *pick(self.random, &["joint", "joint", free, "geom"]);
                self.element(name, joint, depth + 1);
                self.element(name, "geom", depth + 1);
            }
            let children: Vec<&str> = schema::children(name).collect();
            let favourites =
                ["body", "geom", "joint", "frame", "replicate", "site", "key", "pair", "motor", "position"];
            for _ in 0..self.random.below(4) {
                let child = match children.iter().find(|c| favourites.contains(c) && self.random.chance(0.3)) {
                    Some(child) => child,
                    None if children.is_empty() => break,
                    None => pick(self.random, &children),
                };
                if *child != "include" {
                    self.element(name, child, depth + 1);
                }
            }
        }
        let _ = write!(self.text, "</{name}>");
    }

    fn value(&mut self, row: &Element, column: &schema::Attribute) -> String {
        if self.random.chance(0.003) {
            return pick(self.random, WORDS).replace(['<', '"', '&'], "");
        }
        match column.kind {
            Kind::Name(_) => {
                self.names += 1;
                format!("n{}", if self.random.chance(0.05) { 1 } else { self.names })
            }
            Kind::Reference(_) | Kind::ReferenceBy(_) => format!("n{}", 1 + self.random.below(self.names.max(1))),
            Kind::Class => "main".to_owned(),
            Kind::Text => "xyz".to_owned(),
            Kind::Keyword(words) if row.is("geom") && column.name == "type" => {
                let simple = ["sphere", "capsule", "box", "cylinder", "ellipsoid"];
                let simple: Vec<&str> = words.iter().copied().filter(|w| simple.contains(w)).collect();
                (*pick(self.random, &simple)).to_owned()
            }
            Kind::Keyword(_) if row.is("joint") && column.name == "type" => {
                (*pick(self.random, &["hinge", "slide", "ball"])).to_owned()
            }
            Kind::Keyword(words) => (*pick(self.random, words)).to_owned(),
            Kind::Numbers(..) if column.name.contains("range") => "-0.5 0.7".to_owned(),
            Kind::Numbers(..) if column.name.contains("solimp") => "0.8 0.9 0.01".to_owned(),
            Kind::Numbers(least, most) => {
                let n = if column.name == "size" {
                    3
                } else {
                    least + self.random.below(most.min(7) + 1 - least.min(most.min(7)))
                };
                let numbers: Vec<String> = (0..n.clamp(1, 12)).map(|_| self.number(column)).collect();
                numbers.join(" ")
            }
            Kind::Integers(least, _) => {
                let mut number = || match column.rule {
                    Rule::OneOf(list) => *pick(self.random, list),
                    _ => self.random.below(6) as i32 - 1,
                };
                (0..least.max(1)).map(|_| number().to_string()).collect::<Vec<_>>().join(" ")
            }
        }
    }

    fn number(&mut self, column: &schema::Attribute) -> String {
        let edges = ["0", "-1", "1e-300", "1e300", "1e-12", "1e12", "inf", "1e308"];
        if self.random.chance(0.005) {
            return (*pick(self.random, &edges)).to_owned();
        }
        let x = match (column.name, column.rule) {
            ("diaginertia", _) => self.random.within(1.0, 1.5),
            ("count", _) => return (1 + self.random.below(4)).to_string(),
            ("timestep", _) => self.random.within(1e-4, 1e-2),
            (_, Rule::Positive | Rule::NotNegative) => self.random.within(0.01, 1.5),
            ("size", _) => self.random.within(0.05, 0.5),
            _ => self.random.within(-1.0, 1.5),
        };
        format!("{x:.3}")
    }
}

#[test]
fn models() {
    let (mut compiled, mut refused) = (0, std::collections::BTreeMap::new());
    fuzz("models", |seed| {
        let random = &mut Random::new(seed);
        let mut writer = Writer { left: 3 + random.below(40), random, text: "<mujoco>".into(), names: 0 };
        let top: Vec<&str> = schema::children("mujoco").filter(|name| *name != "include").collect();
        for _ in 0..writer.random.below(3) {
            let section = *pick(writer.random, &top);
            writer.element("mujoco", section, 0);
        }
        writer.text.push_str("<worldbody><geom type='plane' size='1 1 1'/>");
        for _ in 0..1 + writer.random.below(4) {
            writer.element("worldbody", "body", 0);
        }
        writer.text.push_str("</worldbody></mujoco>");
        let text = std::mem::take(&mut writer.text);
        match penny::parse_within("fuzz.xml", &text, &limits(random)) {
            Ok(scene) => {
                compiled += 1;
                run(random, &scene.model, 4);
            }
            Err(failure) => {
                reported(&failure);
                for problem in failure.problems.iter().filter(|p| p.severity() == mjcf::Severity::Error) {
                    *refused.entry(problem.kind.code()).or_insert(0) += 1;
                }
            }
        }
    });
    eprintln!("fuzz::models: {compiled} of them ran; what was wrong with the others: {refused:?}");
}

#[test]
fn includes() {
    let all = Scratch::new("includes");
    let folder = all.0.join("scene");
    std::fs::create_dir_all(folder.join("parts/more")).expect("a folder");
    std::fs::write(all.0.join("secret.xml"), "<mujoco><geom name='the secret' size='x'/></mujoco>").expect("a file");
    let places = ["main.xml", "a.xml", "b.xml", "parts/a.xml", "parts/c.xml", "parts/more/a.xml"];
    let odd =
        ["../secret.xml", "parts/../../secret.xml", "/etc/passwd", "parts", "", ".", "..", "no.xml", "../scene/a.xml"];
    fuzz("includes", |seed| {
        let random = &mut Random::new(seed);
        for place in places {
            let mut text = String::from("<mujoco><worldbody>");
            for _ in 0..random.below(4) {
                let file = if random.chance(0.3) { pick(random, &odd) } else { pick(random, &places) };
                let _ = write!(text, "<body><include file='{file}'/></body>");
            }
            let _ = write!(text, "</worldbody></mujoco>{}", if random.chance(0.05) { "<" } else { "" });
            std::fs::write(folder.join(place), text).expect("a file");
        }
        if let Err(failure) = penny::load_within(&folder.join("main.xml"), &limits(random)) {
            reported(&failure);
            assert!(!failure.to_string().contains("the secret"), "{failure}");
        }
    });
}

#[test]
fn sessions() {
    let text = "<mujoco><worldbody><geom type='plane' size='1 1 1'/><body pos='0 0 1'><freejoint/><geom size='.1'/></body>\
                </worldbody></mujoco>";
    let model = penny::parse("fuzz.xml", text).expect("fine").model;
    let source = Source { path: "fuzz.xml".into(), hash: "0".into(), seed: 0, text: None };
    let method = penny_view::open::method(&model).expect("fine");
    let mut session = Session::new(model.clone(), method, State::new(&model), source);
    use penny_view::log::Change;
    let changes = [
        Change::Push { body: 1, wrench: [1.0; 6] },
        Change::Contact("mujoco".into()),
        Change::Integrator("rk4".into()),
        Change::Timestep(1e-3),
        Change::Rounds(3),
        Change::Integrator("cash-karp".into()),
        Change::Accuracy(1e-6),
        Change::Gravity([0.0, 0.0, -1.0]),
        Change::Solref([0.02, 1.0]),
        Change::Friction([1.0, 0.1, 0.1]),
    ];
    for change in changes {
        session.change(change).expect("fine");
        session.step().expect("fine");
    }
    let text = session.log().to_json();
    let words =
        ["0", "-1", "1e300", "18446744073709551615", "null", "[]", "{}", "\"\"", "1e-300", "1.5", "true", "]", ","];
    fuzz("sessions", |seed| {
        let random = &mut Random::new(seed);
        let mut text = text.clone();
        for _ in 0..1 + random.below(3) {
            // A number, a word or a sign becomes another one.
            let ends: Vec<(usize, char)> =
                text.char_indices().filter(|(_, c)| !c.is_alphanumeric() && *c != '.').collect();
            let i = random.below(ends.len() - 1);
            let (from, to) = (ends[i].0 + ends[i].1.len_utf8(), ends[i + 1].0);
            text.replace_range(from.min(to)..to, words[random.below(words.len())]);
        }
        let Ok(log) = Log::parse(&text) else { return };
        let Ok(mut session) = Session::from_log(&log, model.clone(), "0") else { return };
        let mut player = Player::new(log);
        for _ in 0..20 {
            if player.finished(&session) || player.feed(&mut session).is_err() || session.step().is_err() {
                break;
            }
            assert!(session.state.qpos.iter().chain(&session.state.qvel).all(|x| x.is_finite()), "{text}");
        }
        assert!(player.log().duration() >= 0.0, "{text}");
    });
}

#[test]
fn command_lines() {
    let scratch = Scratch::new("lines");
    let folder = &scratch.0;
    std::fs::copy(crate::file("models/box.xml"), folder.join("box.xml")).expect("a scene");
    std::fs::write(folder.join("bad.xml"), "<mujoco><geom/></mujoco>").expect("a scene");
    let commands = ["run", "check", "explain", "render", "sweep", "compare", "play", "", "help", "box.xml"];
    let options = [
        "--time", "--steps", "--every", "--contact", "--integrator", "--timestep", "--rounds", "--key", "--qpos",
        "--qvel", "--ctrl", "--csv", "--json", "--plot", "--save-state", "--load-state", "--show", "--friction",
        "--solref", "--gravity", "--limit", "--allow-outside", "--size", "--fps", "--speed", "--camera", "--follow",
        "-o", "--out", "--timesteps", "--laws", "--map", "--cells", "--truth", "--resume", "--help", "--version",
        "--replay",
    ];
    let values = [
        "0",
        "1",
        "-1",
        "1e300",
        "nan",
        "inf",
        "1e-300",
        "0.01",
        "x.csv",
        "x.json",
        "x.svg",
        "x.gif",
        "x.png",
        "box.xml",
        "-",
        "/dev/full",
        "no/such",
        "penalty",
        "rk4",
        "64x48",
        "1e-3..1e-2:2",
        "timestep,stiffness",
        "1 2 3",
        "",
        "a=b",
        "depth=3",
        "\u{1b}[2J",
        "99999999999999999999",
        ",",
        "=",
        "..",
        "∞",
    ];
    fuzz("command_lines", |seed| {
        let random = &mut Random::new(seed);
        let mut args = vec![*pick(random, &commands)];
        args.push(*pick(random, &["box.xml", "box.xml", "box.xml", "bad.xml", "no.xml", "x.json", "."]));
        // So that what is fine is short.
        args.extend(if args[0] == "run" || args[0] == "box.xml" { ["--steps", "3"] } else { ["--time", "0.01"] });
        for _ in 0..random.below(4) {
            args.push(*pick(random, &options));
            if random.chance(0.8) {
                args.push(*pick(random, &values));
            }
        }
        let mut command = Command::new(env!("CARGO_BIN_EXE_penny"));
        command.args(&args).current_dir(folder).env("PENNY_PYTHON", "/bin/false").env_remove("DISPLAY");
        command.env_remove("WAYLAND_DISPLAY").stdin(Stdio::null()).stdout(Stdio::null());
        let said = std::fs::File::create(folder.join("said.txt")).expect("a file");
        let mut child = command.stderr(said).spawn().expect("it starts");
        let start = Instant::now();
        let code = loop {
            match child.try_wait().expect("a child") {
                Some(status) => break status.code(),
                // Somebody may want a long run or a large picture.
                None if start.elapsed() > Duration::from_secs(2) => {
                    child.kill().and_then(|()| child.wait()).expect("it ends");
                    break Some(0);
                }
                None => std::thread::sleep(Duration::from_micros(300)),
            }
        };
        let said = std::fs::read_to_string(folder.join("said.txt")).unwrap_or_default();
        assert!(code.is_some_and(|code| (0..=2).contains(&code)), "penny {args:?}: {code:?}\n{said}");
        assert!(!said.contains("panicked") && !said.contains('\u{1b}'), "penny {args:?}\n{said}");
        std::fs::copy(crate::file("models/box.xml"), folder.join("box.xml")).expect("a scene");
        clear(folder);
    });
}

/// Removes what a command wrote.
fn clear(folder: &Path) {
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        let (path, name) = (entry.path(), entry.file_name());
        if name == "box.xml" || name == "bad.xml" {
            continue;
        }
        let _ = if path.is_dir() { std::fs::remove_dir_all(&path) } else { std::fs::remove_file(&path) };
    }
}
