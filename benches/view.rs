//! How fast the view is: `cargo bench --bench view`, or a part of it: `cargo bench --bench view picture`.
//!
//! Of every time the best of many tries is printed beside the median: what else runs on the machine can only make it
//! longer. On Linux the time of a single thread is its time on a processor, without the time that others took. The last
//! part opens the real window under Xvfb with software GL, as `tests/window.sh` does; it needs `--features play`, and is
//! left out where Xvfb or xdotool is not installed.

use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use penny_view::open;
use penny_view::paint::{Image, Painter};
use penny_view::stage::{Held, Stage};

/// Ten bodies that fall on one another, with timestep 0.001.
fn ten_bodies() -> String {
    let kinds = ["type=\"sphere\" size=\"0.1\"", "type=\"box\" size=\"0.1 0.08 0.06\""];
    let body = |i: usize| {
        let (x, y, z) = (0.3 * (i % 4) as f64, 0.3 * (i / 4 % 2) as f64, 0.2 + 0.25 * (i / 8) as f64);
        let geom = kinds[i % 2];
        format!("<body name=\"b{i}\" pos=\"{x} {y} {z}\"><freejoint/><geom {geom} mass=\"1\"/></body>\n")
    };
    let bodies: String = (0..10).map(body).collect();
    format!(
        "<mujoco model=\"ten bodies\"><option timestep=\"0.001\"/><worldbody>\n\
         <geom type=\"plane\" size=\"5 5 1\"/>\n{bodies}</worldbody></mujoco>\n"
    )
}

/// Time that this thread has been on a processor, s, where the system tells.
fn on_processor() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(text.split(' ').next()?.parse::<f64>().ok()? * 1e-9)
}

/// Does something in some batches and prints how long one took: best and median batch, ms. `alone`: in this thread only.
fn time(what: &str, batches: usize, each: usize, alone: bool, mut act: impl FnMut()) -> f64 {
    let begun = Instant::now();
    let wall = || begun.elapsed().as_secs_f64();
    let now = || if alone { on_processor().unwrap_or_else(wall) } else { wall() };
    let mut tries: Vec<f64> = (0..batches)
        .map(|_| {
            let from = now();
            (0..each).for_each(|_| act());
            (now() - from) * 1e3 / each as f64
        })
        .collect();
    tries.sort_by(f64::total_cmp);
    println!("  {what:40} {:8.3} ms  (median {:.3} ms)", tries[0], tries[batches / 2]);
    tries[0]
}

fn stage(path: &Path) -> Stage {
    let opened = open::open(path).unwrap_or_else(|report| panic!("{report}"));
    let session = open::session(opened, path, 1).expect("known law and integrator");
    Stage::new(session, 1, None, true)
}

fn pictures(name: &str, path: &Path) {
    println!("{name}: the picture");
    let mut stage = stage(path);
    (0..600).for_each(|_| assert!(stage.step()));
    stage.hold(Held { forward: 1.0, ..Held::default() });
    stage.step();
    let mut list = stage.draw();
    for ([width, height], threads) in [([1280, 720], 1), ([1280, 720], 2), ([980, 530], 1), ([980, 530], 2)] {
        let (mut painter, mut image) = (Painter::new(threads), Image::new(width, height));
        let mut picture = |turn: f64, what: &str| {
            let what = format!("{width}×{height}, {what}, {threads} thread{}", if threads == 1 { "" } else { "s" });
            time(&what, 8, 20, threads == 1, || {
                list.camera.azimuth += turn;
                painter.paint(&list, &mut image);
            });
        };
        picture(0.0, "camera at rest");
        picture(1e-4, "camera turns");
    }
}

fn steps(name: &str, path: &Path) {
    println!("{name}: a second of simulation, at timestep 0.001");
    let mut stage = stage(path);
    let each = time("1000 steps with energy balance, history and referee", 10, 10, true, || {
        (0..1000).for_each(|_| assert!(stage.step()));
    });
    println!("  {:40} {:8.0} × real time", "", 1e3 / each);
}

struct Ended(Child);

impl Drop for Ended {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A virtual display of the window's size, and its name.
fn display() -> Option<(Ended, String)> {
    let args = ["-displayfd", "1", "-screen", "0", "1280x720x24", "-nolisten", "tcp"];
    let server = Command::new("Xvfb").args(args).stdout(Stdio::piped()).stderr(Stdio::null()).spawn();
    let mut server = Ended(server.ok()?);
    let mut number = String::new();
    BufReader::new(server.0.stdout.take()?).read_line(&mut number).ok()?;
    Some((server, format!(":{}", number.trim())))
}

/// Processor time that a process has used, s, where the system tells (in hundredths of a second).
fn cpu_time(process: u32) -> Option<f64> {
    let text = std::fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    let fields: Vec<&str> = text.rsplit_once(')')?.1.split_whitespace().collect();
    Some((fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?) / 100.0)
}

fn window(name: &str, path: &Path) {
    println!("{name}: the window at 1280×720 with two live plots, Xvfb and software GL, 10 s");
    if !cfg!(feature = "play") {
        return println!("  left out: this is a build without the window (`--features play`)");
    }
    let Some((_server, display)) = display() else {
        return println!("  left out: Xvfb is not installed");
    };
    let xdotool = |args: &[&str]| Command::new("xdotool").args(args).env("DISPLAY", &display).output();
    let mut command = Command::new(env!("CARGO_BIN_EXE_penny"));
    command.arg("play").arg(path).env("DISPLAY", &display).env("LIBGL_ALWAYS_SOFTWARE", "1");
    command.env_remove("WAYLAND_DISPLAY").env("XDG_DATA_HOME", std::env::temp_dir()).stderr(Stdio::piped());
    let mut penny = Ended(command.spawn().expect("built"));
    let Ok(found) = xdotool(&["search", "--sync", "--onlyvisible", "--name", "^Penny$"]) else {
        return println!("  left out: xdotool is not installed");
    };
    let id = String::from_utf8_lossy(&found.stdout).trim().to_owned();
    xdotool(&["windowfocus", &id]).expect("installed");
    // A key is held, so that there is an arrow to draw and the plots have something to show.
    xdotool(&["keydown", "Up"]).expect("installed");
    std::thread::sleep(Duration::from_secs(11));
    let cost = cpu_time(penny.0.id());
    xdotool(&["keyup", "Up"]).expect("installed");
    xdotool(&["key", "ctrl+q"]).expect("installed");
    let mut said = String::new();
    penny.0.stderr.take().expect("piped").read_to_string(&mut said).expect("text");
    said.lines().for_each(|line| println!("  {line}"));
    let frames = said.lines().rev().find_map(|line| line.split(" frames, ").next()?.trim().parse::<f64>().ok());
    if let (Some(seconds), Some(frames)) = (cost, frames) {
        println!("  {:.1} ms of processor time a frame, all threads, start included", seconds * 1e3 / frames);
    }
}

fn main() {
    let chosen: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let wanted = |part: &str| chosen.is_empty() || chosen.iter().any(|c| c == part);
    let goal = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/goal.xml");
    let ten: PathBuf = std::env::temp_dir().join(format!("penny-ten-bodies-{}.xml", std::process::id()));
    std::fs::write(&ten, ten_bodies()).expect("writable");
    let scenes = [("goal.xml", &goal), ("ten bodies", &ten)];
    if wanted("picture") {
        scenes.iter().for_each(|(name, path)| pictures(name, path));
    }
    if wanted("steps") {
        steps("ten bodies", &ten);
    }
    if wanted("window") {
        scenes.iter().for_each(|(name, path)| window(name, path));
    }
    std::fs::remove_file(&ten).expect("removable");
}
