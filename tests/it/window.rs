//! The real window under a virtual display, with real key events. Run by `tests/window.sh`.

use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use penny::math::Vec3;
use penny_view::log::{Change, Log};
use penny_view::scene;
use penny_view::session::{Player, Session};

/// What the window draws beside the picture, in points: see `view::app`.
const VIEW: [f64; 2] = [1280.0 - 300.0, 720.0 - 190.0];

struct Ended(Child);

impl Drop for Ended {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn display() -> (Ended, String) {
    let mut server = Command::new("Xvfb")
        .args(["-displayfd", "1", "-screen", "0", "1280x720x24", "-nolisten", "tcp"])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("Xvfb is installed");
    let mut number = String::new();
    BufReader::new(server.stdout.take().expect("piped")).read_line(&mut number).expect("Xvfb says its number");
    (Ended(server), format!(":{}", number.trim()))
}

fn tool(display: &str, program: &str, args: &[&str]) -> String {
    let output = Command::new(program).args(args).env("DISPLAY", display).output().expect("installed");
    assert!(output.status.success(), "{program} {args:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).trim().to_owned()
}

fn wait(milliseconds: u64) {
    std::thread::sleep(Duration::from_millis(milliseconds));
}

/// Opens the window with these arguments in a folder, and gives it the keyboard.
fn play(display: &str, folder: &Path, args: &[&std::ffi::OsStr]) -> Ended {
    let mut command = Command::new(env!("CARGO_BIN_EXE_penny"));
    command.arg("play").args(args);
    open(display, folder, command)
}

/// Runs what opens the window, and gives it the keyboard.
fn open(display: &str, folder: &Path, mut command: Command) -> Ended {
    command.current_dir(folder).stderr(Stdio::piped());
    command.env("DISPLAY", display).env("LIBGL_ALWAYS_SOFTWARE", "1").env_remove("WAYLAND_DISPLAY");
    let penny = Ended(command.spawn().expect("built"));
    let window = tool(display, "xdotool", &["search", "--sync", "--onlyvisible", "--name", "^Penny$"]);
    tool(display, "xdotool", &["windowfocus", &window]);
    penny
}

/// Closes the window as a user does, and returns what it said.
fn close(display: &str, penny: &mut Ended) -> String {
    tool(display, "xdotool", &["key", "ctrl+q"]);
    let closing = Instant::now();
    while penny.0.try_wait().expect("a child").is_none() {
        assert!(closing.elapsed() < Duration::from_secs(20), "Ctrl+Q closes the window");
        wait(50);
    }
    let mut said = String::new();
    penny.0.stderr.take().expect("piped").read_to_string(&mut said).expect("text");
    said
}

/// Plays the recorded inputs and returns where the ball was after every step.
fn replayed(log: &Log, path: &Path) -> (Vec<Vec3>, Session) {
    let opened = penny_view::open::open(path).unwrap_or_else(|e| panic!("{e}"));
    let mut session = Session::from_log(log, opened.model, &opened.hash).expect("the same scene");
    let mut player = Player::new(log.clone());
    let mut places = vec![session.data.xpos[1]];
    while !player.finished(&session) {
        player.feed(&mut session).expect("undamaged");
        session.step().expect("stable");
        places.push(session.data.xpos[1]);
    }
    (places, session)
}

fn screenshot(display: &str, path: &Path) -> (usize, Vec<u8>) {
    let input = format!("{display}.0");
    let args = [
        "-y", "-loglevel", "error", "-f", "x11grab", "-video_size", "1280x720", "-i", &input, "-frames:v", "1",
        "-pix_fmt", "rgb24",
    ];
    tool(display, "ffmpeg", &[&args[..], &[path.to_str().expect("plain")]].concat());
    let decoder = png::Decoder::new(BufReader::new(std::fs::File::open(path).expect("taken")));
    let mut reader = decoder.read_info().expect("a PNG");
    let mut rgb = vec![0; reader.output_buffer_size().expect("small")];
    let width = reader.next_frame(&mut rgb).expect("a picture").width as usize;
    (width, rgb)
}

/// Middle and number of the pixels of a colour in the 3-D picture.
fn find((width, rgb): &(usize, Vec<u8>), is: fn(&[u8]) -> bool) -> (Vec3, usize) {
    let (mut sum, mut n) = (Vec3::zeros(), 0);
    for (i, _) in rgb.chunks(3).enumerate().filter(|(_, p)| is(p)) {
        let (x, y) = ((i % width) as f64, (i / width) as f64);
        if x < VIEW[0] && y < VIEW[1] {
            sum += Vec3::new(x, y, 0.0);
            n += 1;
        }
    }
    (sum / (n.max(1) as f64), n)
}

#[test]
#[ignore = "needs Xvfb, xdotool, ffmpeg and software GL: tests/window.sh"]
fn real_keys_move_the_ball_and_the_record_tells_how() {
    let scene = Path::new(crate::ROOT).join("tests/window.xml");
    let folder = std::env::temp_dir().join(format!("penny-window-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("writable");
    let run: PathBuf = folder.join("run.json");
    let (_server, display) = display();
    let mut penny = play(&display, &folder, &[scene.as_os_str(), "--record".as_ref(), run.as_os_str()]);
    wait(2500);
    tool(&display, "xdotool", &["keydown", "Up"]);
    wait(500);
    let shot = screenshot(&display, &folder.join("shot.png"));
    tool(&display, "xdotool", &["keyup", "Up"]);
    wait(300);
    tool(&display, "xdotool", &["key", "space"]);
    wait(500);
    let said = close(&display, &mut penny);
    println!("{said}");

    // The record, replayed, ends in the same bits …
    let log = Log::parse(&std::fs::read_to_string(&run).expect("recorded")).expect("own format");
    let (places, session) = replayed(&log, &scene);
    assert!(said.contains(&session.state_hash()), "the window ended in {said}, the replay in {}", session.summary());
    // … and the ball went into the picture, where the key pushes it.
    let camera = scene::framing(&session.model, &session.poses(1.0));
    let camera = penny_view::camera::Camera { azimuth: camera.azimuth, ..camera };
    let (right, ahead) = camera.ground();
    let way = places[places.len() - 1] - places[0];
    assert!(way.dot(&ahead) > 0.3 && way.dot(&right).abs() < 0.02 * way.dot(&ahead), "{way:?}");
    let pushes: Vec<f64> = log
        .inputs
        .iter()
        .filter_map(|i| match i.change {
            Change::Push { wrench, .. } => Some(Vec3::from_column_slice(&wrench[..3]).dot(&ahead)),
            _ => None,
        })
        .collect();
    assert!(pushes.iter().any(|f| (f - 0.5 * 9.81).abs() < 1e-9), "half its weight while the key is down: {pushes:?}");
    assert!(pushes.iter().any(|f| *f > 100.0), "the kick: {pushes:?}");

    // The screenshot has the ball where the replay has it at some moment of the push …
    let (ball, size) = find(&shot, |p| p[1] > p[0].saturating_add(50) && p[1] > p[2].saturating_add(40));
    assert!(size > 200, "{size} green pixels");
    let first = scene::framing(
        &session.model,
        &Session::new(
            session.model.clone(),
            session.method,
            penny::state::State::new(&session.model),
            Default::default(),
        )
        .poses(1.0),
    );
    let near =
        places.iter().filter_map(|p| first.project(p, VIEW)).map(|[x, y, _]| (Vec3::new(x, y, 0.0) - ball).norm());
    assert!(near.fold(f64::MAX, f64::min) < 12.0, "the ball is at {ball:?}");
    // … the arrow of the push behind it, nearer to the eye and so lower in the picture …
    let (arrow, size) = find(&shot, |p| p[0] > 150 && p[0] > p[1].saturating_add(90) && p[0] > p[2].saturating_add(60));
    assert!(size > 40, "{size} red pixels");
    assert!(arrow.y > ball.y - 5.0 && (arrow - ball).norm() < 250.0, "arrow {arrow:?}, ball {ball:?}");
    // … and the panel: light, with writing on it.
    let (width, rgb) = &shot;
    let panel: Vec<&[u8]> = rgb.chunks(3).enumerate().filter(|(i, _)| i % width > 1000).map(|(_, p)| p).collect();
    let light = panel.iter().filter(|p| p.iter().all(|&c| c > 200)).count();
    let dark = panel.iter().filter(|p| p.iter().all(|&c| c < 120)).count();
    assert!(light > panel.len() / 2 && dark > 500, "{light} light and {dark} dark of {}", panel.len());
    std::fs::remove_dir_all(&folder).expect("removable");
}

#[test]
#[ignore = "needs Xvfb, xdotool, ffmpeg and software GL: tests/window.sh"]
fn a_record_survives_the_end_of_the_program() {
    let folder = std::env::temp_dir().join(format!("penny-record-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("writable");
    let (scene, run) = (folder.join("scene.xml"), folder.join("run.json"));
    std::fs::copy(Path::new(crate::ROOT).join("tests/window.xml"), &scene).expect("there");
    let (_server, display) = display();
    for signal in ["-TERM", "-KILL"] {
        let _ = std::fs::remove_file(&run);
        let mut penny = play(&display, &folder, &[scene.as_os_str(), "--record".as_ref(), run.as_os_str()]);
        wait(2500);
        tool(&display, "xdotool", &["key", "space"]);
        wait(2000);
        Command::new("kill").arg(signal).arg(penny.0.id().to_string()).status().expect("kill");
        penny.0.wait().expect("it ends");
        let log = Log::parse(&std::fs::read_to_string(&run).expect("recorded")).expect("own format");
        // The kick was two seconds before the end, and is in what was kept a second before it.
        assert!(!log.inputs.is_empty(), "{signal}: {} steps", log.steps);
        let (places, _) = replayed(&log, &scene);
        assert_eq!(places.len() as u64, log.steps + 1, "{signal}");
    }
    std::fs::remove_dir_all(&folder).expect("removable");
}

#[test]
#[cfg(unix)]
#[ignore = "needs Xvfb, xdotool, ffmpeg and software GL: tests/window.sh"]
fn on_a_full_disk_the_old_record_stays_and_the_end_says_so() {
    let folder = std::env::temp_dir().join(format!("penny-full-{}", std::process::id()));
    std::fs::create_dir_all(folder.join("disk")).expect("writable");
    std::fs::copy(Path::new(crate::ROOT).join("tests/window.xml"), folder.join("scene.xml")).expect("there");
    // A disk of 64 kB, seen by this command alone.
    let small = |script: &str| {
        let mut command = Command::new("unshare");
        command.args(["-rm", "sh", "-c", &format!("mount -t tmpfs -o size=64k none disk && {script}")]);
        command
    };
    if !small("true").current_dir(&folder).status().is_ok_and(|status| status.success()) {
        eprintln!("skipped: this system allows no small disk of one's own");
        return;
    }
    let (_server, display) = display();
    let penny = env!("CARGO_BIN_EXE_penny");
    let script = format!(
        "{{ echo old > disk/run.json; head -c 70000 /dev/zero > disk/fill 2> /dev/null; \
            {penny} play scene.xml --record disk/run.json; echo code $? >&2; cp disk/run.json .; ls disk > left; }}"
    );
    let mut penny = open(&display, &folder, small(&script));
    wait(2500);
    let said = close(&display, &mut penny);
    assert!(said.contains("error: cannot write `disk/run.json`: No space left") && said.contains("code 1"), "{said}");
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).expect("copied");
    assert_eq!((read("run.json"), read("left")), ("old\n".to_owned(), "fill\nrun.json\n".to_owned()));
    std::fs::remove_dir_all(&folder).expect("removable");
}

#[test]
#[ignore = "needs Xvfb, xdotool, ffmpeg and software GL: tests/window.sh"]
fn a_saved_scene_is_loaded_again_and_a_key_films_it() {
    let green = |p: &[u8]| p[1] > p[0].saturating_add(50) && p[1] > p[2].saturating_add(40);
    let blue = |p: &[u8]| p[2] > p[0].saturating_add(60) && p[2] > p[1].saturating_add(60);
    let folder = std::env::temp_dir().join(format!("penny-reload-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("writable");
    let scene = folder.join("scene.xml");
    let text = std::fs::read_to_string(Path::new(crate::ROOT).join("tests/window.xml")).expect("there");
    std::fs::write(&scene, &text).expect("writable");
    let (_server, display) = display();
    let mut penny = play(&display, &folder, &[scene.as_os_str()]);
    wait(2500);
    let shot = |name: &str| screenshot(&display, &folder.join(name));
    assert!(find(&shot("before.png"), green).1 > 200, "the ball is green");
    // An editor saves another colour …
    std::fs::write(&scene, text.replace("0.1 0.75 0.2 1", "0.1 0.2 0.9 1")).expect("writable");
    wait(1500);
    let after = shot("after.png");
    assert!(find(&after, blue).1 > 200 && find(&after, green).1 == 0, "the ball is blue");
    // … and then a mistake: the report covers a part of the picture, the blue ball plays on.
    std::fs::write(&scene, text.replace("<freejoint/>", "<frejoint/>")).expect("writable");
    wait(1500);
    let wrong = shot("wrong.png");
    assert!(find(&wrong, green).1 == 0, "the mistake is not loaded");
    let differ = wrong.1.iter().zip(&after.1).filter(|(a, b)| a.abs_diff(**b) > 60).count();
    assert!(differ > 2000, "the report is seen: {differ} bytes differ");
    std::fs::write(&scene, &text).expect("writable");
    wait(1500);
    assert!(find(&shot("again.png"), green).1 > 200, "mended, the ball is green");
    // F9 films about a second.
    tool(&display, "xdotool", &["key", "F9"]);
    wait(1200);
    tool(&display, "xdotool", &["key", "F9"]);
    wait(1500);
    let said = close(&display, &mut penny);
    let film = folder.join("penny-1.mp4");
    let frames = ["-v", "error", "-count_frames", "-show_entries", "stream=nb_read_frames", "-of", "csv=p=0"];
    let frames = tool(&display, "ffprobe", &[&frames[..], &[film.to_str().expect("plain")]].concat());
    assert!(frames.parse::<usize>().is_ok_and(|n| n > 20), "{frames} frames filmed; {said}");
    std::fs::remove_dir_all(&folder).expect("removable");
}
