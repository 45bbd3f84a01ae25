//! `penny rollout`: a world's result is its own, whatever runs beside it, and nothing is lost.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn penny(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_penny")).current_dir(crate::ROOT).args(args).output().expect("penny starts")
}

fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("rollout-{name}"));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}

const VARY: [&str; 8] = [
    "--vary",
    "qvel[0]=1..3",
    "--vary",
    "friction[ground]=0.2..0.9",
    "--vary",
    "timestep=0.001..0.002",
    "--vary",
    "gravity[z]=-10..-9",
];

/// The rows of a rollout of models/box.xml.
fn rows(out: &std::path::Path, more: &[&str]) -> String {
    let path = out.to_str().expect("text");
    let run = penny(&[&["rollout", "models/box.xml", "--time", "0.1", "--out", path][..], &VARY, more].concat());
    assert!(run.status.success(), "{}", crate::said(&run));
    std::fs::read_to_string(out).expect("rows")
}

#[test]
fn a_world_has_the_same_bits_at_any_count_of_threads_and_worlds() {
    let folder = folder("bits");
    let one = rows(&folder.join("one.csv"), &["--worlds", "40", "--threads", "1"]);
    let two = rows(&folder.join("two.csv"), &["--worlds", "40", "--threads", "2"]);
    let more = rows(&folder.join("more.csv"), &["--worlds", "50"]);
    assert_eq!(one, two);
    assert!(more.starts_with(&one), "worlds depend on how many there are");
    assert_eq!(one.lines().count(), 41);
    let other = rows(&folder.join("other.csv"), &["--worlds", "40", "--seed", "1"]);
    assert_ne!(one, other, "the seed has no effect");
    // A world alone, through `penny run`, is the same.
    let row: Vec<&str> = one.lines().nth(1).expect("a row").split(',').collect();
    let header: Vec<&str> = one.lines().next().expect("a header").split(',').collect();
    let value = |name: &str| row[header.iter().position(|h| *h == name).unwrap_or_else(|| panic!("no {name}"))];
    assert_eq!(value("failed"), "");
    assert!((1.0..3.0).contains(&value("qvel[0]").parse::<f64>().expect("a number")));
}

#[test]
fn a_table_gives_each_world_what_its_row_says() {
    let folder = folder("table");
    let (table, out) = (folder.join("table.csv"), folder.join("out.csv"));
    std::fs::write(&table, "qvel[0],mass[box]\n1,1\n2,1\n").expect("a table");
    let run = penny(&[
        "rollout",
        "models/box.xml",
        "--steps",
        "10",
        "--gravity",
        "0 0 0",
        "--table",
        table.to_str().expect("text"),
        "-o",
        out.to_str().expect("text"),
    ]);
    assert!(run.status.success(), "{}", crate::said(&run));
    let text = std::fs::read_to_string(&out).expect("rows");
    let speeds: Vec<f64> =
        text.lines().skip(1).map(|l| l.split(',').nth(1).expect("a cell").parse().expect("a number")).collect();
    assert_eq!(speeds, [1.0, 2.0]);
}

/// `penny`, on its way, without a word.
fn started(args: &[&str]) -> std::process::Child {
    let quiet = std::process::Stdio::null;
    let mut command = Command::new(env!("CARGO_BIN_EXE_penny"));
    command.current_dir(crate::ROOT).args(args).stdout(quiet()).stderr(quiet()).spawn().expect("penny starts")
}

/// Starts a rollout and ends it as a power failure would, with some rows written; the last one is cut then.
fn killed(args: &[&str], out: &Path) {
    let unfinished = beside(out, ".unfinished");
    let mut child = started(args);
    patiently("rows come", || std::fs::read_to_string(&unfinished).is_ok_and(|text| text.lines().count() > 1));
    child.kill().and_then(|()| child.wait()).expect("it ends");
    let text = std::fs::read_to_string(&unfinished).expect("rows");
    std::fs::write(&unfinished, &text[..text.len() - 5]).expect("a file");
}

fn patiently(what: &str, done: impl Fn() -> bool) {
    let start = std::time::Instant::now();
    while !done() {
        assert!(start.elapsed().as_secs() < 60, "{what}");
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
}

fn beside(out: &Path, end: &str) -> PathBuf {
    PathBuf::from(format!("{}{end}", out.display()))
}

/// Of as many worlds as are wanted: killed while the first pieces are there.
fn begun(out: &Path, more: &[&str]) {
    let path = out.to_str().expect("text");
    let length = ["rollout", "models/box.xml", "--time", "0.1", "--worlds", "1000000", "--threads", "1", "--out", path];
    killed(&[&length[..], &VARY, more].concat(), out);
}

#[test]
fn what_was_interrupted_goes_on_and_ends_the_same() {
    let folder = folder("resume");
    let out = folder.join("cut.csv");
    begun(&out, &[]);
    let unfinished = std::fs::read_to_string(beside(&out, ".unfinished")).expect("rows");
    let worlds = (unfinished.lines().count() + 20).to_string();
    let whole = rows(&folder.join("whole.csv"), &["--worlds", &worlds]);
    let path = out.to_str().expect("text");
    let anew = penny(
        &[&["rollout", "models/box.xml", "--time", "0.1", "--out", path, "--worlds", &worlds][..], &VARY].concat(),
    );
    assert_eq!(anew.status.code(), Some(2));
    assert!(crate::said(&anew).contains("--resume"), "{}", crate::said(&anew));
    assert_eq!(rows(&out, &["--worlds", &worlds, "--resume", "--threads", "2"]), whole);
    assert_eq!(std::fs::read_dir(&folder).expect("there").count(), 2, "something else is left");
}

/// Both wrote their worlds, so that many were there twice.
#[test]
#[cfg(unix)]
fn what_is_being_written_is_not_gone_on_with() {
    let folder = folder("busy");
    let out = folder.join("out.csv");
    begun(&out, &[]);
    let unfinished = beside(&out, ".unfinished");
    let rows = std::fs::read(&unfinished).expect("rows");
    let other = std::fs::File::open(&unfinished).expect("rows");
    other.lock().expect("nobody else has them");
    let path = out.to_str().expect("text");
    let args = ["rollout", "models/box.xml", "--time", "0.1", "--worlds", "1000000", "--out", path];
    for more in [&["--resume"][..], &[]] {
        let run = penny(&[&args[..], &VARY, more].concat());
        let said = crate::said(&run);
        assert!(run.status.code() == Some(1) && said.contains("another process is writing it"), "{more:?}: {said}");
        assert_eq!(std::fs::read(&unfinished).expect("rows"), rows, "{more:?}");
    }
}

#[test]
fn what_is_finished_or_damaged_is_not_gone_on_with() {
    let folder = folder("finished");
    let out = folder.join("out.csv");
    let whole = rows(&out, &["--worlds", "3"]);
    let refused = |told: &str| {
        let path = out.to_str().expect("text");
        let run = penny(&["rollout", "models/box.xml", "--time", "0.1", "--out", path, "--worlds", "9", "--resume"]);
        assert!(run.status.code() == Some(2) && crate::said(&run).contains(told), "{told}: {}", crate::said(&run));
        assert_eq!(std::fs::read_to_string(&out).expect("rows"), whole, "{told}");
    };
    refused("out.csv is finished");
    let unfinished = beside(&out, ".unfinished");
    begun(&out, &[]);
    std::fs::write(&unfinished, b"\xff\xfe\n").expect("a file");
    let path = out.to_str().expect("text");
    let args = ["rollout", "models/box.xml", "--time", "0.1", "--out", path, "--resume"];
    let run = penny(&[&args[..], &VARY].concat());
    assert!(run.status.code() == Some(2) && crate::said(&run).contains("its columns"), "{}", crate::said(&run));
    assert_eq!(std::fs::read(&unfinished).expect("rows"), b"\xff\xfe\n");
}

#[test]
fn another_rollout_is_not_gone_on_with() {
    let folder = folder("another");
    let [scene, out, table] = ["box.xml", "out.csv", "table.csv"].map(|name| folder.join(name));
    let [path, to, listed] = [&scene, &out, &table].map(|path| path.to_str().expect("text"));
    let text = std::fs::read_to_string(crate::file("models/box.xml")).expect("the scene");
    std::fs::write(&scene, &text).expect("a scene");
    let begin = ["rollout", path, "--out", to];
    let vary = ["--time", "0.1", "--vary", "qvel[0]=1..3"];
    killed(&[&begin[..], &vary, &["--worlds", "1000000", "--threads", "1"]].concat(), &out);
    let unfinished = std::fs::read_to_string(beside(&out, ".unfinished")).expect("rows");
    let refused = |args: &[&str], told: &str| {
        let run = penny(&[&begin[..], args, &["--resume"]].concat());
        let said = crate::said(&run);
        assert!(run.status.code() == Some(2) && said.contains(told), "{args:?}: {said}");
        assert_eq!(std::fs::read_to_string(beside(&out, ".unfinished")).expect("rows"), unfinished, "{args:?}");
    };
    for (more, told) in [
        (&["--seed", "1"][..], "--seed 0, now 1"),
        (&["--contact", "mujoco"], "--contact tutorial, now mujoco"),
        (&["--integrator", "rk4"], "--integrator semi-implicit-euler, now rk4"),
        (&["--timestep", "0.002"], "--timestep 0.001, now 0.002"),
        (&["--rounds", "1"], "--rounds"),
        (&["--gravity", "0 0 -1"], "--gravity"),
        (&["--solref", "0.1 1"], "--solref"),
        (&["--qvel", "0 1 0"], "--qvel"),
        (&["--worlds", "1"], "worlds already, now there are 1"),
        (&["--show", "energy"], "columns"),
    ] {
        refused(&[&vary[..], more].concat(), told);
    }
    refused(&["--time", "0.2", "--vary", "qvel[0]=1..3"], "--time 0.1, now 0.2");
    refused(&["--steps", "101", "--vary", "qvel[0]=1..3"], "--time 0.1, now 0.101");
    refused(&["--time", "0.1", "--vary", "qvel[0]=1..3.5"], "--vary qvel[0]=1..3, now qvel[0]=1..3.5");
    refused(&[&vary[..], &["--accuracy", "1e-3"]].concat(), "--accuracy none, now 0.001");
    std::fs::write(&table, "qvel[0]\n1\n").expect("a table");
    refused(&["--time", "0.1", "--table", listed], "--table was different");
    std::fs::write(&scene, text.replace("mass=\"1\"", "mass=\"2\"")).expect("a scene");
    refused(&vary, "the scene has changed since");
    std::fs::write(&scene, &text).expect("a scene");
    std::fs::remove_file(beside(&out, ".unfinished.json")).expect("it is there");
    refused(&vary, "remove");
}

#[test]
fn another_table_is_not_gone_on_with() {
    let folder = folder("tables");
    let [out, table] = ["out.csv", "table.csv"].map(|name| folder.join(name));
    let [to, listed] = [&out, &table].map(|path| path.to_str().expect("text"));
    let rows = |first: &str| format!("qvel[0]\n{first}\n{}", "1\n".repeat(20_000));
    std::fs::write(&table, rows("1")).expect("a table");
    let args = ["rollout", "models/box.xml", "--time", "0.1", "--threads", "1", "--out", to, "--table", listed];
    killed(&args, &out);
    std::fs::write(&table, rows("2")).expect("a table");
    let run = penny(&[&args[..], &["--resume"]].concat());
    assert!(
        run.status.code() == Some(2) && crate::said(&run).contains("--table was different"),
        "{}",
        crate::said(&run)
    );
}

#[test]
fn what_cannot_be_varied_is_told() {
    let out = folder("told").join("out.csv");
    let out = out.to_str().expect("text");
    for (vary, told) in [
        ("qvel[9]=1..2", "numbers"),
        ("qvel[nobody]=1..2", "no joint `nobody`"),
        ("friction[]=1..2", "no geom ``"),
        ("mass[crate]=1..2", "no body `crate`"),
        ("friction[x]=1..2", "no geom `x`"),
        ("colour=1..2", "cannot be varied"),
        ("qvel[0]=2..1", "comes first"),
        ("qvel[0]=2", "range"),
        ("qvel[0]=-1e308..1e308", "too far apart"),
        ("mass[box]=0..1", "mass[box]: 0: the mass of a body that moves must be above 0"),
        ("mass[box]=-2..-1", "above 0"),
        ("mass[world]=1..2", "the world does not move"),
        ("mass[0]=1..2", "the world does not move"),
        ("solref=-1..1", "solref: -1: the time constant of solref must be above 0"),
        ("solref[box]=0..0", "above 0"),
        ("friction=-1..1", "0 or more"),
        ("timestep=0..0.001", "above 0"),
        ("timestep=0.001..1", "too short for such a step"),
        ("timestep=1e-300..0.001", "the most is"),
    ] {
        let run = penny(&["rollout", "models/box.xml", "--time", "0.01", "--out", out, "--vary", vary]);
        assert!(!run.status.success(), "{vary}");
        assert!(crate::said(&run).contains(told), "{vary}: {}", crate::said(&run));
        assert!(!std::path::Path::new(&format!("{out}.unfinished")).exists(), "{vary}: something is left behind");
    }
}

/// As `--key` has it.
#[test]
fn a_name_that_is_a_number_comes_before_an_index() {
    let folder = folder("numbers");
    let [scene, out] = ["scene.xml", "out.csv"].map(|name| folder.join(name));
    let body = |name: &str| format!("<body><joint name='{name}' type='slide'/><geom size='1' contype='0'/></body>");
    let text = format!("<mujoco><worldbody>{}{}{}</worldbody></mujoco>", body("1"), body("0"), body("x"));
    std::fs::write(&scene, text).expect("a scene");
    let [scene, to] = [&scene, &out].map(|path| path.to_str().expect("text"));
    let vary = ["qvel[1]=1..1", "qvel[0]=2..2", "qvel[2]=3..3"].map(|vary| ["--vary", vary]).concat();
    let args = ["rollout", scene, "--worlds", "1", "--gravity", "0 0 0", "--steps", "1", "--out", to];
    let run = penny(&[&args[..], &vary].concat());
    assert!(run.status.success(), "{}", crate::said(&run));
    let text = std::fs::read_to_string(&out).expect("rows");
    let cell = |name: &str| {
        let [names, row] = [0, 1].map(|line| text.lines().nth(line).expect("a line").split(',').collect::<Vec<_>>());
        row[names.iter().position(|n| *n == name).expect("a column")].parse::<f64>().expect("a number")
    };
    assert_eq!(["qvel0", "qvel1", "qvel2"].map(cell), [1.0, 2.0, 3.0]);
}

/// Runs a rollout of models/box.xml that is refused at once, and leaves nothing.
fn refused(name: &str, args: &[&str], told: &str) {
    let folder = folder(name);
    let out = folder.join("out.csv");
    let out = ["--out", out.to_str().expect("text")];
    let out = if args.contains(&"-o") { &[][..] } else { &out[..] };
    let run = penny(&[&["rollout", "models/box.xml", "--worlds", "1"], out, args].concat());
    let said = crate::said(&run);
    assert!(run.status.code() == Some(2) && said.contains(told), "{args:?}: {said}");
    assert_eq!(std::fs::read_dir(&folder).expect("there").count(), 0, "{args:?}: something is left behind");
}

#[test]
fn one_number_is_varied_once() {
    for (one, two) in [
        ("qvel[0]", "qvel[0]"),
        ("qvel[0]", "qvel[x]"),
        ("mass[box]", "mass[1]"),
        ("friction", "friction[ground]"),
        ("solref[box]", "solref"),
    ] {
        let [a, b] = [one, two].map(|name| format!("{name}=1..2"));
        refused("once", &["--vary", &a, "--vary", &b], &format!("`{one}` and `{two}` set the same number"));
    }
}

#[test]
fn a_table_has_numbers_that_mean_something() {
    let folder = folder("cells");
    let [table, out] = ["table.csv", "out.csv"].map(|name| folder.join(name));
    for (text, told) in [
        ("qvel[x],qvel[0]\n1,2\n", "`qvel[x]` and `qvel[0]` set the same number"),
        ("solref[box]\n0.1\n-1\n", "row 2: solref[box]: -1: the time constant"),
        ("mass[box]\n0\n", "row 1: mass[box]: 0: the mass"),
        ("mass[world]\n1\n", "the world does not move"),
        ("qvel[0];qvel[1]\n1;2\n", "table.csv: `qvel[0];qvel[1]`"),
        ("world,qvel[0]\n0,1\n", "table.csv: `world` cannot be varied"),
        ("qvel[0],qvel[1]\n1,2\n3\n", "table.csv: row 2 has 1 cell, but the table 2 columns"),
    ] {
        std::fs::write(&table, text).expect("a table");
        let [listed, to] = [&table, &out].map(|path| path.to_str().expect("text"));
        let run = penny(&["rollout", "models/box.xml", "--time", "0.01", "--out", to, "--table", listed]);
        assert!(!run.status.success() && crate::said(&run).contains(told), "{text}: {}", crate::said(&run));
        assert_eq!(std::fs::read_dir(&folder).expect("there").count(), 1, "{text}: something is left behind");
    }
}

#[test]
fn a_table_is_not_overwritten() {
    let table = folder("overwritten").join("table.csv");
    std::fs::write(&table, "qvel[x]\n1\n").expect("a table");
    let path = table.to_str().expect("text");
    let run = penny(&["rollout", "models/box.xml", "--time", "0.01", "--out", path, "--table", path]);
    assert!(run.status.code() == Some(2) && crate::said(&run).contains("would overwrite"), "{}", crate::said(&run));
    assert_eq!(std::fs::read_to_string(&table).expect("the table"), "qvel[x]\n1\n");
}

/// Stiffness and damping are numbers at most 0, as the scene has them.
#[test]
fn solref_is_varied_as_the_scene_has_it() {
    let folder = folder("stiffness");
    let out = folder.join("out.csv");
    let run = |vary: &str| {
        let path = out.to_str().expect("text");
        let more = ["--solref", "-1000 -10", "--steps", "1", "--worlds", "1", "--out", path, "--vary", vary];
        penny(&[&["rollout", "models/box.xml"], &more[..]].concat())
    };
    let right = run("solref=-2000..-1000");
    assert!(right.status.success(), "{}", crate::said(&right));
    let wrong = run("solref=0.01..0.02");
    assert!(crate::said(&wrong).contains("at most 0"), "{}", crate::said(&wrong));
}

#[test]
fn what_makes_no_sense_is_refused() {
    let cases: [(&[&str], &str); 8] = [
        (&["-o", "-"], "name a file"),
        (&["-o", "target/x.json"], ".csv or .parquet"),
        (&["-o", "models"], "is not a file that can be replaced"),
        (&["--timestep", "10", "--time", "1"], "give a longer --time or a smaller --timestep"),
        (&["--accuracy", "1e-3", "--vary", "timestep=0.001..0.002"], "leave out timestep"),
        (&["--time", "0.1", "--vary", "timestep=0.001..0.5"], "too short for such a step"),
        (&["--timestep", "0.001", "--vary", "timestep=0.001..0.002"], "--timestep and timestep set the same number"),
        (&["--steps", "10", "--vary", "timestep=0.001..0.002"], "give --time"),
    ];
    for (args, told) in cases {
        refused("sense", args, told);
    }
}

/// A world of a day is ended by the first signal; the worlds before it stay.
#[test]
#[cfg(unix)]
fn a_long_world_is_ended_by_a_signal() {
    let folder = folder("long");
    let [table, out] = ["table.csv", "out.csv"].map(|name| folder.join(name));
    // The second world has a thousand times as many steps, the third a day of them.
    std::fs::write(&table, "timestep\n1\n0.001\n1e-10\n1\n").expect("a table");
    let [listed, to] = [&table, &out].map(|path| path.to_str().expect("text"));
    let args = ["rollout", "models/box.xml", "--time", "1", "--threads", "1", "--table", listed, "--out", to];
    let told = folder.join("told");
    let mut child = Command::new(env!("CARGO_BIN_EXE_penny"))
        .current_dir(crate::ROOT)
        .args(args)
        .stderr(std::fs::File::create(&told).expect("a file"))
        .spawn()
        .expect("penny starts");
    patiently("it begins", || beside(&out, ".unfinished").exists());
    std::thread::sleep(std::time::Duration::from_millis(1000));
    let kill = Command::new("kill").arg("-TERM").arg(child.id().to_string()).status().expect("kill");
    let since = std::time::Instant::now();
    assert!(kill.success() && child.wait().expect("it ends").code() == Some(143));
    assert!(since.elapsed().as_secs() < 5, "it goes on after a signal");
    let told = std::fs::read_to_string(told).expect("warnings");
    assert!(told.contains("interrupted after 2 of 4 worlds"), "{told}");
    let rows = std::fs::read_to_string(beside(&out, ".unfinished")).expect("rows");
    let worlds: Vec<_> = rows.lines().map(|line| line.split(',').next().unwrap_or_default()).collect();
    assert_eq!(worlds, ["world", "0", "1"]);
}

/// A machine is not asked for more threads than it has use for.
#[test]
#[cfg(target_os = "linux")]
fn threads_are_no_more_than_have_work() {
    let folder = folder("threads");
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    for (worlds, most) in [("3", 3), ("1000000", cores.max(16))] {
        let out = folder.join(format!("{worlds}.csv"));
        let to = out.to_str().expect("text");
        let args = [
            "rollout", "models/box.xml", "--steps", "1000000000", "--threads", "100000", "--worlds", worlds, "--out",
            to,
        ];
        let mut child = started(&args);
        let tasks = || std::fs::read_dir(format!("/proc/{}/task", child.id())).map_or(0, Iterator::count);
        patiently("threads come", || tasks() > most.min(3));
        std::thread::sleep(std::time::Duration::from_millis(200));
        let count = tasks();
        child.kill().and_then(|()| child.wait()).expect("it ends");
        // The main one, and the progress bar's or the signals'.
        assert!(count <= most + 3, "{worlds}: {count} threads");
    }
}

#[test]
fn each_world_has_the_accuracy_that_is_wanted_by_a_method_of_its_own() {
    let folder = folder("accuracy");
    let last = |accuracy: &str| -> Vec<[f64; 2]> {
        let more = ["--worlds", "3", "--contact", "mujoco", "--accuracy", accuracy, "--time", "0.5"];
        let text = std::fs::read_to_string({
            let out = folder.join(format!("{accuracy}.csv"));
            let path = out.to_str().expect("text");
            let vary = ["--vary", "qvel[0]=1..3"];
            let run = penny(&[&["rollout", "models/box.xml", "--out", path][..], &vary, &more].concat());
            assert!(run.status.success(), "{}", crate::said(&run));
            out
        });
        let text = text.expect("rows");
        assert!(text.starts_with("world,qvel[0],failed,method,evaluations,error m,"), "{text}");
        let place = |name: &str| text.lines().next().and_then(|head| head.split(',').position(|c| c == name));
        let places = ["qpos0", "qpos1"].map(|name| place(name).unwrap_or_else(|| panic!("no {name}: {text}")));
        let numbers = |row: &str| places.map(|i| row.split(',').nth(i).and_then(|c| c.parse().ok()).expect("a number"));
        text.lines().skip(1).map(numbers).collect()
    };
    let (coarse, fine) = (last("1e-3"), last("1e-5"));
    for (coarse, fine) in coarse.iter().zip(&fine) {
        let apart = coarse.iter().zip(fine).map(|(a, b): (&f64, &f64)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart > 0.0 && apart <= 1e-3, "{coarse:?} {fine:?}");
    }
}

/// The same cells as CSV, bit for bit, empty ones as nulls; worlds that diverge and methods of an accuracy among them.
#[test]
fn parquet_holds_what_csv_holds() {
    let folder = folder("parquet");
    let [csv, table] = ["rows.csv", "rows.parquet"].map(|name| folder.join(name));
    let run = |out: &std::path::Path| {
        let path = out.to_str().expect("text");
        penny(&[
            "rollout", "models/box.xml", "--time", "0.1", "--worlds", "5", "--accuracy", "1e-3", "--vary",
            "qvel[0]=1..3", "--out", path,
        ])
    };
    let written = run(&csv);
    assert!(written.status.success(), "{}", crate::said(&written));
    let output = run(&table);
    #[cfg(not(feature = "parquet"))]
    assert!(
        output.status.code() == Some(1) && crate::said(&output).contains("built without Parquet") && !table.exists()
    );
    #[cfg(feature = "parquet")]
    {
        use parquet::file::reader::{FileReader, SerializedFileReader};
        use parquet::record::Field;
        assert!(output.status.success(), "{}", crate::said(&output));
        let text = std::fs::read_to_string(&csv).expect("rows");
        let reader = SerializedFileReader::new(std::fs::File::open(&table).expect("there")).expect("Parquet");
        let mut rows = reader.get_row_iter(None).expect("rows");
        let names: Vec<&str> = text.lines().next().expect("a header").split(',').collect();
        for line in text.lines().skip(1) {
            let row = rows.next().expect("as many rows").expect("a row");
            assert!(row.get_column_iter().map(|(name, _)| name.as_str()).eq(names.iter().copied()));
            for ((name, field), cell) in row.get_column_iter().zip(line.split(',')) {
                let same = match field {
                    Field::Null => cell.is_empty() && name == "failed",
                    Field::Double(x) => cell.parse() == Ok(*x),
                    Field::Long(n) => cell.parse() == Ok(*n),
                    Field::Str(text) => cell == text && name == "method",
                    other => panic!("{name}: {other:?}"),
                };
                assert!(same, "{name}: {field:?} and {cell}");
            }
        }
        assert!(rows.next().is_none());
        assert_eq!(std::fs::read_dir(&folder).expect("there").count(), 2, "something else is left");
    }
}
