//! Playing without a window: sessions, the game, pictures, videos.

use std::path::Path;
use std::time::Duration;

use penny::math::{Vec3, Vec6};
use penny_view::camera::Camera;
use penny_view::clock::Clock;
use penny_view::controls::Grab;
use penny_view::film::Film;
use penny_view::game::{Game, LEVELS, Outcome, Rules, best, report};
use penny_view::log::{Change, Log, Start};
use penny_view::session::{Player, Session};
use penny_view::stage::{Held, Stage};
use penny_view::{open, pick, scene};

const HOUR: Duration = Duration::from_secs(3600);

pub fn session(path: &str) -> Session {
    let path = &crate::file(path);
    let opened = open::open(path).unwrap_or_else(|report| panic!("{report}"));
    open::session(opened, path, 1).expect("known law and integrator")
}

/// A session of a scene given as text.
pub fn written(text: &str) -> Session {
    let opened = open::open_text("test.xml", text).unwrap_or_else(|report| panic!("{report}"));
    open::session(opened, Path::new("test.xml"), 0).expect("known law and integrator")
}

const BALL: &str = r#"<mujoco><option timestep="0.001"/><worldbody><geom type="plane" size="1 1 1" friction="0.5 0.01 0.01" condim="6"/>
    <body name="ball" pos="0 0 0.11"><freejoint/><geom type="sphere" size="0.11" mass="0.41" friction="0.5 0.01 0.01" condim="6"/></body>
    </worldbody></mujoco>"#;

/// A game played by a script at a frame rate; keys change at given times.
fn played(fps: f64) -> Stage {
    let mut stage = Stage::new(session("models/goal.xml"), 5, None, true);
    for frame in 0..(2.5 * fps) as usize {
        let time = frame as f64 / fps;
        let forward = if (0.4..0.9).contains(&time) { 1.0 } else { 0.0 };
        let right = if (0.7..1.0).contains(&time) { -1.0 } else { 0.0 };
        stage.hold(Held { right, forward, turn: forward, strong: time > 0.8 });
        if frame == (1.2 * fps) as usize {
            stage.kick(true);
        }
        stage.tick(1.0 / fps, HOUR);
    }
    stage
}

#[test]
fn a_recorded_session_plays_again_bit_for_bit_at_any_frame_rate() {
    let stage = played(60.0);
    let text = stage.session.log().to_json();
    let log = Log::parse(&text).expect("own format");
    assert_eq!(log, stage.session.log(), "the file keeps every bit");
    assert!(log.inputs.len() > 4, "keys and kick were written down: {:?}", log.inputs);

    for fps in [7.0, 24.0, 144.0] {
        let again = session("models/goal.xml");
        let again = Session::from_log(&log, again.model, &log.scene_hash).expect("same scene");
        let mut replay = Stage::new(again, 0, None, false);
        replay.replay(Player::new(log.clone()));
        while !replay.paused {
            replay.tick(1.0 / fps, HOUR);
        }
        assert_eq!(replay.session.state_hash(), stage.session.state_hash(), "{fps} frames a second");
    }

    let mut filmed = Session::from_log(&log, session("models/goal.xml").model, &log.scene_hash).expect("same scene");
    let mut player = Player::new(log.clone());
    let mut film = Film::new(&filmed, Camera::default(), None, 25.0, 1.0);
    for i in 0..film.frames_to_end(log.duration()) {
        film.frame(i, &mut filmed, Some(&mut player)).expect("no divergence");
    }
    assert_eq!(filmed.state_hash(), stage.session.state_hash(), "in a film");
}

#[test]
fn a_session_computes_what_a_plain_run_computes() {
    let mut session = session("models/goal_2d.xml");
    session
        .change(Change::State(Start {
            time: 0.0,
            qpos: vec![0.0, 0.5, 0.0],
            qvel: vec![2.0, 0.0, 0.0],
            ctrl: vec![],
            whole: None,
        }))
        .expect("fits");
    let (model, method, mut state) = (session.model.clone(), session.method, session.state.clone());
    let mut data = penny::data::Data::new(&model);
    for _ in 0..1500 {
        session.step().expect("stable");
        penny::forward::step(&model, &method, &mut state, &mut data).expect("stable");
    }
    assert_eq!(session.state.qpos, state.qpos);
    assert_eq!(session.state.qvel, state.qvel);
}

#[test]
fn logs_of_other_scenes_and_damaged_logs_are_refused() {
    let log = played(30.0).session.log();
    let other = Session::from_log(&log, session("models/goal.xml").model, "another hash");
    assert!(other.is_err_and(|e| e.contains("not the file")));
    assert!(Log::parse("{}").is_err());
    assert!(
        Log::parse(&log.to_json().replace("\"penny_run\": 1", "\"penny_run\": 9")).is_err_and(|e| e.contains("format"))
    );
    let mut mixed = log.clone();
    mixed.inputs.reverse();
    assert!(Log::parse(&mixed.to_json()).is_err_and(|e| e.contains("order")));
    let mut short = log.clone();
    short.start.qpos.pop();
    let refused = Session::from_log(&short, session("models/goal.xml").model, &log.scene_hash);
    assert!(refused.is_err_and(|e| e.contains("does not fit")));
}

#[test]
fn the_clock_hands_out_all_time_whatever_the_frames() {
    for frames in [7, 60, 997] {
        let mut clock = Clock::default();
        let steps: usize = (0..frames).map(|_| clock.steps(0.6 / frames as f64, 0.001)).sum();
        // Rounding may hold back the very last step.
        assert!((599..=600).contains(&steps), "{frames} frames gave {steps} steps");
    }
    let mut clock = Clock::at(100.0);
    assert_eq!(clock.steps(0.01, 0.001), 1000, "fast forward");
    assert!(clock.steps(60.0, 0.001) <= 10_000, "a stall is not caught up with");
}

#[test]
fn keys_push_where_the_camera_looks() {
    let mut stage = Stage::new(written(BALL), 0, None, false);
    stage.film.camera.azimuth = 0.0;
    stage.hold(Held { right: 1.0, ..Held::default() });
    stage.step();
    let push = stage.session.pushed(1);
    assert!(push[1] < -0.5 && push[0].abs() < 1e-12, "looking along +x, right is −y: {push:?}");
    stage.hold(Held::default());
    stage.step();
    assert_eq!(stage.session.pushed(1), Vec6::zeros(), "released");
    stage.hold(Held { turn: 1.0, ..Held::default() });
    stage.step();
    assert!(stage.session.pushed(1)[5] > 0.0, "Q turns to the left");
}

#[test]
fn a_kick_is_an_impulse_whatever_the_timestep() {
    for h in [0.0005, 0.002, 0.02] {
        let mut stage = Stage::new(written(BALL), 0, None, false);
        stage.change(Change::Gravity([0.0; 3]));
        stage.change(Change::Timestep(h));
        stage.heading = Some(Vec3::x());
        stage.kick(false);
        (0..40).for_each(|_| assert!(stage.step()));
        // Kicked in flight: mass times 5 m/s, exact but for rounding.
        assert!((stage.session.balance.impulse.x - 0.41 * 5.0).abs() < 1e-12, "h = {h}");
    }
}

#[test]
fn the_mouse_pulls_a_body_to_where_it_points() {
    let mut stage = Stage::new(written(BALL), 0, None, false);
    stage.change(Change::Gravity([0.0; 3]));
    let to = Vec3::new(0.3, -0.2, 0.5);
    stage.grab(Some(Grab { body: 1, point: Vec3::zeros(), to }));
    (0..3000).for_each(|_| assert!(stage.step()));
    let at = stage.session.data.xpos[1];
    // 36 time constants of the critically damped spring.
    assert!((at - to).norm() < 1e-6, "{at:?}");
    stage.grab(None);
    assert_eq!(stage.session.pushed(1), Vec6::zeros());
}

#[test]
fn the_energy_balance_closes_and_knows_rolling_from_sliding() {
    let mut session = written(BALL);
    let rolling = Start {
        time: 0.0,
        qpos: vec![0.0, 0.0, 0.10998, 1.0, 0.0, 0.0, 0.0],
        qvel: vec![2.0, 0.0, 0.0, 0.0, 2.0 / 0.11, 0.0],
        ctrl: vec![],
        whole: None,
    };
    session.change(Change::State(rolling)).expect("fits");
    (0..1000).for_each(|_| session.step().expect("stable"));
    let balance = session.balance.clone();
    // Rolling friction takes δ/r · m g for each metre rolled.
    let distance = session.state.qpos[0];
    let expected = 0.01 / 0.11 * 0.41 * 9.81 * distance;
    assert!((balance.rolling / expected - 1.0).abs() < 0.03, "{} against {expected}", balance.rolling);
    assert!(balance.sliding.abs() < 0.02 * balance.rolling, "sliding {}", balance.sliding);
    // What is left over: the compliance of the contact as the ball settles.
    assert!(balance.other().abs() < 0.02 * balance.lost(), "{balance:?}");
}

#[test]
fn a_scene_that_diverges_stops_and_says_so() {
    let mut stage = Stage::new(written(BALL), 0, None, false);
    stage.session.push(1, Vec6::new(1e300, 0.0, 0.0, 0.0, 0.0, 0.0)).expect("finite");
    assert!(!(0..3).all(|_| {
        let fine = stage.session.step();
        stage.message = fine.as_ref().err().map_or_else(String::new, |d| stage.session.failure(d));
        fine.is_ok()
    }));
    assert!(stage.message.contains("diverged") && stage.message.contains("ball"), "{}", stage.message);
    assert!(stage.session.state.qpos.iter().all(|x| x.is_finite()), "the state before the step is kept");
}

#[test]
fn a_goal_and_a_fair_push_are_decided_to_the_millimetre() {
    let rules = Rules::of(&session("models/goal.xml").model).expect("a goal");
    let r = rules.radius;
    let at = |x: f64, y: f64, z: f64| Vec3::new(x, y, z);
    assert!(rules.may_push(&at(-1.0 - r - 1e-3, 0.0, r)), "1 mm outside of 1 m");
    assert!(!rules.may_push(&at(-1.0 - r + 1e-3, 0.0, r)), "1 mm inside of 1 m");
    let before = at(r - 0.02, 0.0, 0.5);
    assert_eq!(rules.decide(&before, &at(r - 1e-3, 0.0, 0.5)), None, "1 mm short of the line");
    assert_eq!(rules.decide(&before, &at(r + 1e-3, 0.0, 0.5)), Some(Outcome::Goal), "1 mm over the line");
    assert_eq!(
        rules.decide(&at(r - 0.02, 1.499, 0.5), &at(r + 0.02, 1.499, 0.5)),
        Some(Outcome::Goal),
        "inside the post"
    );
    assert_eq!(
        rules.decide(&at(r - 0.02, 1.501, 0.5), &at(r + 0.02, 1.501, 0.5)),
        Some(Outcome::Wide),
        "outside the post"
    );
    assert_eq!(
        rules.decide(&at(r - 0.02, 0.0, 1.999), &at(r + 0.02, 0.0, 1.999)),
        Some(Outcome::Goal),
        "under the bar"
    );
    assert_eq!(rules.decide(&at(r - 0.02, 0.0, 2.001), &at(r + 0.02, 0.0, 2.001)), Some(Outcome::Wide), "over the bar");
    // Between two steps the ball moves sideways: what counts is where it is when it crosses.
    assert_eq!(rules.decide(&at(r - 0.01, 1.48, 0.5), &at(r + 0.03, 1.52, 0.5)), Some(Outcome::Goal));
}

/// Serves, puts the ball somewhere with some velocity, and plays without touching a key.
fn shot(level: usize, at: Vec3, velocity: Vec3) -> Option<Outcome> {
    let mut stage = Stage::new(session(&format!("models/{}", LEVELS[level].scene)), 3, Some(level), true);
    let mut start = Start::of(&stage.session.state);
    if stage.session.model.nv == 3 {
        (start.qpos[0], start.qpos[1]) = (at.x + 5.0, at.z - 0.2);
        (start.qvel[0], start.qvel[1], start.qvel[2]) = (velocity.x, velocity.z, velocity.x / 0.2);
    } else {
        start.qpos[..3].copy_from_slice(at.as_slice());
        start.qvel[..3].copy_from_slice(velocity.as_slice());
        start.qvel[3..6].copy_from_slice(&[0.0; 3]);
    }
    stage.session.change(Change::State(start)).expect("fits");
    for _ in 0..16_000 {
        stage.step();
        if let Some(outcome) = stage.game.as_ref().and_then(|g| g.outcome) {
            return Some(outcome);
        }
    }
    None
}

#[test]
fn kicks_end_as_they_should_on_every_level() {
    let fast = Vec3::new(10.0, 0.0, 0.0);
    for level in [0, 1] {
        assert_eq!(shot(level, Vec3::new(-2.0, 0.0, 0.11), fast), Some(Outcome::Goal), "straight in");
        assert_eq!(shot(level, Vec3::new(-2.0, 1.8, 0.11), fast), Some(Outcome::Wide), "past the post");
        assert_eq!(shot(level, Vec3::new(-2.0, 0.0, 2.4), fast), Some(Outcome::Wide), "over the bar");
        assert_eq!(shot(level, Vec3::new(-2.0, 1.55, 0.5), fast), Some(Outcome::Stopped), "back from the post");
        assert_eq!(
            shot(level, Vec3::new(-3.0, 0.0, 0.11), Vec3::new(0.8, 0.0, 0.0)),
            Some(Outcome::Stopped),
            "too slow"
        );
    }
    assert_eq!(shot(2, Vec3::new(-2.0, 1.1, 0.11), fast), Some(Outcome::Goal), "past the keeper");
    assert_ne!(shot(2, Vec3::new(-1.2, 0.1, 0.11), fast), Some(Outcome::Goal), "at the keeper");
    assert_eq!(shot(3, Vec3::new(-2.0, 0.0, 0.2), Vec3::new(4.0, 0.0, 0.0)), Some(Outcome::Goal), "under the bar");
    assert_eq!(shot(3, Vec3::new(-1.0, 0.0, 1.6), Vec3::new(8.0, 0.0, 0.0)), Some(Outcome::Wide), "over the bar");
}

#[test]
fn the_ball_cannot_be_pushed_near_the_goal_nor_anything_else_at_all() {
    let mut stage = Stage::new(session("models/goal_keeper.xml"), 3, Some(2), true);
    let wrench = Vec6::new(1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    let game = stage.game.clone().expect("a game");
    let keeper = stage.session.model.bodies.iter().position(|b| b.name == "keeper").expect("a keeper");
    assert_eq!(game.allow(&stage.session, keeper, wrench), Vec6::zeros());
    assert_eq!(game.allow(&stage.session, game.rules.ball, wrench), wrench);
    let mut start = Start::of(&stage.session.state);
    start.qpos[0] = -1.0 - game.rules.radius + 1e-3;
    stage.session.change(Change::State(start)).expect("fits");
    assert_eq!(game.allow(&stage.session, game.rules.ball, wrench), Vec6::zeros());
}

#[test]
fn passes_follow_from_the_seed_and_roll() {
    let pass = |seed: u64| {
        let mut session = session("models/goal.xml");
        let mut game = Game::new(&session, 1, seed).expect("a game");
        game.serve(&mut session).expect("serves");
        session.state
    };
    assert_eq!(pass(7), pass(7));
    assert_ne!(pass(7).qpos, pass(8).qpos);
    for seed in 0..200 {
        let state = pass(seed);
        let (v, w) = (Vec3::from_column_slice(&state.qvel[..3]), Vec3::from_column_slice(&state.qvel[3..6]));
        // Velocity of the lowest point: v + ω × (0, 0, −r).
        assert!((v + w.cross(&Vec3::new(0.0, 0.0, -0.11))).norm() < 1e-12, "seed {seed} slips");
        assert!(state.qpos[0] < -3.0 && v.norm() > 2.5, "seed {seed} comes from {:?}", state.qpos);
    }
}

#[test]
fn after_a_shot_the_same_kick_is_shown_under_every_law() {
    let stage = played(60.0);
    let game = stage.game.as_ref().expect("a game");
    let shots = report::report(game, &stage.session);
    let own = &shots[0];
    assert_eq!(own.law, stage.session.method.contact.name, "the played law first");
    assert!(shots.len() > 1, "and others");
    assert_eq!(own.balance.impulse, shots[1].balance.impulse, "pushed alike");
    if let Some(outcome) = game.outcome {
        assert_eq!(own.outcome, outcome, "the shot is the one that was played");
    }
}

#[test]
fn the_best_list_is_sorted_and_short() {
    let entry = |points, time| best::Entry { points, level: "pass".into(), time, law: "penalty".into(), seed: 0 };
    let mut list = Vec::new();
    for i in 0..12 {
        best::insert(&mut list, entry(100 + i, 3.0));
    }
    assert_eq!(list.len(), 10);
    assert_eq!(best::insert(&mut list, entry(111, 2.0)), Some(0), "the quicker of equals comes first");
    assert_eq!(best::insert(&mut list, entry(1, 1.0)), None);
    let path = std::env::temp_dir().join(format!("penny-best-{}", std::process::id())).join("best.json");
    best::save(&path, &list).expect("writable");
    assert_eq!(best::load(&path), list);
    std::fs::remove_dir_all(path.parent().expect("a folder")).expect("removable");
    assert!(best::load(&path).is_empty(), "no list yet");
}

#[test]
fn a_reloaded_scene_keeps_the_view_and_the_choices() {
    let mut stage = Stage::new(written(BALL), 0, None, false);
    stage.film.camera.distance = 7.5;
    stage.change(Change::Contact("tutorial".into()));
    (0..10).for_each(|_| assert!(stage.step()));
    stage.reload(open::open_text("test.xml", &BALL.replace("0.41", "0.82")).expect("fine"));
    assert_eq!(stage.film.camera.distance, 7.5);
    assert_eq!(stage.session.method.contact.name, "tutorial");
    assert_eq!((stage.session.model.bodies[1].mass, stage.session.steps), (0.82, 0));
}

#[test]
fn what_is_drawn_in_the_middle_is_picked_in_the_middle() {
    let session = written(BALL);
    let poses = session.poses(1.0);
    let camera = scene::framing(&session.model, &poses);
    let at = camera.project(&poses.pos[1], [640.0, 480.0]).expect("in front");
    let hit = pick::pick(&session.model, &poses, &camera, [at[0], at[1]], [640.0, 480.0]).expect("the ball");
    assert_eq!(hit.body, 1);
    // Marching stops within a thousandth of the radius.
    assert!(((hit.point - poses.pos[1]).norm() - 0.11).abs() < 2e-4);
    assert!(pick::pick(&session.model, &poses, &camera, [5.0, 5.0], [640.0, 480.0]).is_none(), "beside it");
}

#[test]
fn a_camera_is_read_from_text() {
    let camera = Camera::default().parse("90,-10,3,1,2,0.5").expect("six numbers");
    assert!((camera.azimuth - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    assert_eq!((camera.distance, camera.target), (3.0, Vec3::new(1.0, 2.0, 0.5)));
    for wrong in ["", "1", "1,2,3,4", "a,b", "nan,0", "90,20,0", "90,20,-1"] {
        assert!(Camera::default().parse(wrong).is_err(), "{wrong}");
    }
}

#[test]
#[cfg(target_os = "linux")]
fn without_a_display_play_names_the_way_without() {
    for display in [None, Some(":4711")] {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_penny"));
        command.args(["play", "models/goal.xml"]).current_dir(crate::ROOT);
        for name in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
            command.env_remove(name);
        }
        let output = command.envs(display.map(|name| ("DISPLAY", name))).output().expect("built");
        let said = crate::said(&output);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains("penny render") && said.trim_end().lines().count() == 1, "{said}");
        assert!(!said.contains(".rs"), "places in other people's sources help nobody: {said}");
    }
}

#[test]
fn a_recorded_run_is_rendered_from_the_command_line() {
    let stage = played(60.0);
    let folder = std::env::temp_dir().join(format!("penny-run-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("writable");
    let (run, png) = (folder.join("run.json"), folder.join("run.png"));
    std::fs::write(&run, stage.session.log().to_json()).expect("writable");
    let render = |more: &[&str]| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_penny"));
        command.arg("render").arg(&run).arg("-o").arg(&png).args(["--size", "64x48"]).args(more);
        command.output().expect("built")
    };
    let output = render(&[]);
    let said = crate::said(&output);
    assert!(output.status.success() && said.contains(&stage.session.state_hash()), "{said}");
    assert_eq!(render(&["--contact", "tutorial"]).status.code(), Some(2), "a recorded session brings its own law");
    std::fs::remove_dir_all(&folder).expect("removable");
}

/// Beside the panel there may be no room for plots, or for a picture.
#[test]
#[cfg(feature = "play")]
fn the_window_may_be_of_any_size() {
    use penny_window::{App, headless::Headless};
    for size in [[16, 16], [300, 100], [321, 243], [402, 190], [500, 8]] {
        let mut app = App::new(Stage::new(written(BALL), 0, None, false));
        let mut window = Headless::new(size[0], size[1]);
        for _ in 0..3 {
            let image = window.frame(&mut app, 1.0 / 60.0, Vec::new());
            assert_eq!([image.width, image.height], size);
        }
    }
}

/// A key pressed in a frame pushes in the steps of that frame, and its arrow is in that frame's picture.
#[test]
#[cfg(feature = "play")]
fn a_key_acts_within_its_frame() {
    use penny_window::egui::{Event, Key, Modifiers};
    use penny_window::{App, headless::Headless};
    let mut app = App::new(Stage::new(written(BALL), 0, None, false));
    let mut window = Headless::new(640, 480);
    let key = |pressed: bool| Event::Key {
        key: Key::ArrowUp,
        physical_key: None,
        pressed,
        repeat: false,
        modifiers: Modifiers::NONE,
    };
    // egui lays out in its first pass and knows sizes in the second.
    window.frame(&mut app, 0.0, Vec::new());
    window.frame(&mut app, 1.0 / 60.0, Vec::new());
    let before = app.stage.session.steps;
    let image = window.frame(&mut app, 1.0 / 60.0, vec![key(true)]);
    let steps = app.stage.session.steps;
    assert!(steps >= before + 16, "a sixtieth of a second is 16 steps of 1 ms");
    let log = app.stage.session.log();
    assert_eq!(log.inputs[0].step, before, "the push holds from the frame's first step on: {:?}", log.inputs);
    // 16 steps of half the weight: m Δv = F t.
    let speed = app.stage.session.balance.impulse.norm() / 0.41;
    let expected = 0.5 * 9.81 * (steps - before) as f64 * 1e-3;
    assert!((speed - expected).abs() < 1e-12, "{speed} m/s, expected {expected}");
    let red = |p: &[u8]| p[0] > 150 && p[0] > p[1].saturating_add(90) && p[0] > p[2].saturating_add(60);
    assert!(image.rgba.chunks(4).filter(|p| red(p)).count() > 20, "the arrow is seen at once");
    window.frame(&mut app, 1.0 / 60.0, vec![key(false)]);
    let last = app.stage.session.log().inputs.pop().expect("released");
    assert_eq!(last.step, steps, "and it ends as promptly");
}

#[test]
fn every_level_opens_from_its_own_file() {
    for (file, level) in [("goal.xml", "pass"), ("goal_keeper.xml", "keeper"), ("goal_2d.xml", "circle")] {
        let stage = Stage::new(session(&format!("models/{file}")), 1, None, true);
        let game = stage.game.expect("a game");
        assert_eq!((LEVELS[game.level].name, game.played()), (level, 0), "{file}");
    }
}

#[test]
fn a_replay_can_be_trimmed() {
    let log = played(60.0).session.log();
    let filmed = |from: f64, frame: usize| {
        let mut session =
            Session::from_log(&log, session("models/goal.xml").model, &log.scene_hash).expect("same scene");
        let (mut player, mut film) =
            (Player::new(log.clone()), Film::new(&session, Camera::default(), None, 25.0, 1.0));
        film.skip(from, &mut session, Some(&mut player)).expect("no divergence");
        film.frame(frame, &mut session, Some(&mut player)).expect("no divergence");
        session.state_hash()
    };
    // The last 1.3 of 2.5 s.
    assert_eq!(filmed(1.2, 10), filmed(0.0, 40));
    assert_eq!(filmed(1.2, 33), filmed(0.0, 63), "to the end");
}

#[test]
fn the_camera_stays_above_the_floor() {
    let mut stage = Stage::new(written(BALL), 0, None, false);
    stage.film.camera =
        Camera { target: Vec3::new(0.0, 0.0, -1.0), distance: 2.0, elevation: 1.5, ..Camera::default() };
    let pos = stage.session.poses(1.0).pos;
    let eye = stage.film.eye(&pos).axes().eye;
    assert!(eye.z > 0.03, "{eye:?}");
    // Whoever looks down anyway sees what he asked for.
    stage.film.camera = Camera::default();
    assert_eq!(stage.film.eye(&pos), Camera::default());
    let mut space = Stage::new(
        written(&BALL.replace("type=\"plane\" size=\"1 1 1\"", "size=\"1\" pos=\"0 0 -9\"")),
        0,
        None,
        false,
    );
    space.film.camera.elevation = 1.5;
    assert_eq!(space.film.eye(&pos).elevation, 1.5, "no floor, no bound");
}

/// A session carries its scene: it can be drawn in a folder where the files never were; a changed text is not taken for it.
#[test]
fn a_session_carries_its_scene() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("carried");
    std::fs::create_dir_all(&folder).expect("a folder");
    let elsewhere = folder.join("elsewhere");
    std::fs::create_dir_all(elsewhere.join("parts")).expect("a folder");
    let (floor, ball) = BALL.split_once("<body").expect("a body");
    let write = |file: &str, text: &str| std::fs::write(elsewhere.join(file), text).expect("a file");
    write(
        "ball.xml",
        &format!(
            "{floor}<!-- <include file='no.xml'/> --><include file='parts/ball.xml'></include></worldbody></mujoco>"
        ),
    );
    write("parts/ball.xml", "<?xml version='1.0'?>\n<mujoco><include file='parts/inner.xml'/></mujoco>");
    write("parts/inner.xml", &format!("<mujoco><body{}</mujoco>", ball.split("</worldbody>").next().expect("a body")));
    let opened = open::open(&elsewhere.join("ball.xml")).expect("a scene");
    std::fs::remove_dir_all(&elsewhere).expect("it is there");
    let mut session = open::session(opened, Path::new("elsewhere/ball.xml"), 0).expect("a session");
    (0..20).for_each(|_| session.step().expect("a step"));
    let log = session.log();
    let render = |log: &Log| {
        std::fs::write(folder.join("run.json"), log.to_json()).expect("a file");
        let mut penny = std::process::Command::new(env!("CARGO_BIN_EXE_penny"));
        let args = ["render", "run.json", "-o", "run.png", "--size", "64x48"];
        penny.args(args).current_dir(&folder).output().expect("penny starts")
    };
    let output = render(&log);
    assert!(output.status.success() && folder.join("run.png").exists(), "{}", crate::said(&output));
    let changed = Log { scene_text: log.scene_text.map(|text| text.replace("0.41", "4.1")), ..log };
    assert!(!render(&changed).status.success());
}

/// A run that is stopped, played on and recorded, filmed from the record and run on has the bits of one that is not: under
/// every law and integrator, with states from file to file.
#[test]
fn a_saved_state_goes_through_play_with_the_same_bits() {
    use penny_lab::record::{read_state, write_state};
    let text = r#"<mujoco><option timestep="0.002"/><worldbody><geom type="plane" size="5 5 .1"/>
        <body pos="0 0 .11" euler="0 0 10"><freejoint/><geom type="box" size=".1 .1 .1"/></body>
        <body pos=".05 0 .32" euler="0 0 20"><freejoint/><geom type="box" size=".1 .1 .1"/></body>
        <body pos="-.4 0 .5"><joint name="j" axis="0 1 0" frictionloss=".02" range="-50 20"/><geom type="capsule" fromto="0 0 0 .3 0 0" size=".02"/></body>
        </worldbody><actuator><general joint="j" dyntype="filter" dynprm=".1" gainprm="3"/></actuator></mujoco>"#;
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("played_on");
    std::fs::create_dir_all(&folder).expect("a folder");
    std::fs::write(folder.join("test.xml"), text).expect("a scene");
    for (law, integrator) in penny::contact::ALL.iter().flat_map(|l| penny::integrate::ALL.iter().map(move |i| (l, i)))
    {
        let begun = |saved: Option<&str>| {
            let Session { model, method, mut state, source, .. } = written(text);
            if let Some(saved) = saved {
                state = read_state(&model, saved).expect("a state of this scene");
            }
            state.ctrl[0] = 0.5;
            let method = penny::forward::Method { contact: law, integrator, ..method };
            Session::new(model, method, state, source)
        };
        let steps = |session: &mut Session, n: usize| (0..n).for_each(|_| session.step().expect("stable"));
        let saved = |s: &Session| write_state(&s.model, &s.method, &s.state).expect("finite");
        let (mut whole, mut first) = (begun(None), begun(None));
        steps(&mut whole, 90);
        steps(&mut first, 40);
        let mut played = begun(Some(&saved(&first)));
        steps(&mut played, 30);
        let log = Log::parse(&played.log().to_json()).expect("own format");
        let session = written(text);
        let hash = session.source.hash.clone();
        let mut again = Session::from_log(&log, session.model, &hash).expect("its scene");
        steps(&mut again, 30);
        assert_eq!(again.state, played.state, "{} {}", law.name, integrator.name);
        steps(&mut again, 20);
        assert_eq!(again.state, whole.state, "{} {}", law.name, integrator.name);
        if (law.name, integrator.name) != ("penalty", "semi-implicit-euler") {
            continue;
        }
        // The same from file to file, each command a process of its own.
        std::fs::write(folder.join("run.json"), log.to_json()).expect("a file");
        let penny = |args: &[&str]| {
            let mut penny = std::process::Command::new(env!("CARGO_BIN_EXE_penny"));
            let output = penny.args(args).current_dir(&folder).output().expect("penny starts");
            assert!(output.status.success(), "{}", crate::said(&output));
            String::from_utf8(output.stdout).expect("UTF-8")
        };
        penny(&["render", "run.json", "-o", "run.png", "--size", "64x48", "--save-state", "played.json"]);
        assert_eq!(std::fs::read_to_string(folder.join("played.json")).expect("written"), saved(&played));
        let end = penny(&["run", "test.xml", "--load-state", "played.json", "--steps", "20", "--save-state", "-"]);
        assert_eq!(end, saved(&whole));
    }
}

/// A cube of 12 triangles from the origin to (1, 1, 1), as OBJ.
const CUBE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nf 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\n\
                    f 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

#[test]
fn a_mesh_that_is_only_seen_is_drawn_where_its_body_is() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("visual");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("cube.obj"), CUBE).unwrap();
    std::fs::write(folder.join("broken.stl"), "no triangles").unwrap();
    std::fs::write(folder.join("other.msh"), "").unwrap();
    let scene_with = |geoms: &str| {
        let text = format!(
            "<mujoco><asset><mesh file='cube.obj' scale='0.2 0.2 0.4'/><mesh file='broken.stl'/><mesh file='other.msh'/></asset>
             <worldbody><body pos='0 0 1' euler='0 0 90'><freejoint/><geom size='0.01' pos='0 0 -1'/>{geoms}</body></worldbody></mujoco>"
        );
        let path = folder.join("scene.xml");
        std::fs::write(&path, text).unwrap();
        open::open(&path)
    };
    let seen = "type='mesh' mass='0' contype='0' conaffinity='0'";
    let opened = scene_with(&format!("<geom {seen} mesh='cube' pos='0.1 0 0' rgba='1 0 0 1'/>")).unwrap();
    assert_eq!(opened.warnings, "");
    let session = open::session(opened, Path::new("scene.xml"), 0).unwrap();
    let poses = session.poses(0.0);
    let list = scene::draw(&session.model, &poses, Camera::default());
    let facets: Vec<_> = list.things.iter().filter(|t| t.color == [1.0, 0.0, 0.0, 1.0]).collect();
    assert_eq!(facets.len(), 12);
    // Turned by a quarter: x of the mesh is y of the world.
    let corners =
        || facets.iter().flat_map(|t| [t.pos, t.pos + t.mat.column(0) * t.size.x, t.pos + t.mat.column(1) * t.size.x]);
    let bound = |axis: usize, pick: fn(f32, f32) -> f32| corners().map(|c| c[axis]).reduce(pick).unwrap();
    for (axis, low, high) in [(0, -0.2, 0.0), (1, 0.1, 0.3), (2, 1.0, 1.4)] {
        let found = [bound(axis, f32::min), bound(axis, f32::max)];
        assert!((found[0] - low).abs() < 1e-6 && (found[1] - high).abs() < 1e-6, "{axis}: {found:?}");
    }
    // Every face looks outwards.
    let middle = penny_view::V3::new(-0.1, 0.2, 1.2);
    assert!(facets.iter().all(|t| (t.pos - middle).dot(&t.mat.column(2).into_owned()) > 0.0));

    // What cannot be drawn is said: forms that are not read at once, broken files where somebody looks.
    let warned = |geom: &str| scene_with(geom).unwrap_or_else(|report| panic!("{report}")).warnings;
    assert!(
        warned(&format!("<geom {seen} mesh='other'/>")).contains("pictures show only meshes from OBJ and STL files")
    );
    assert!(warned(&format!("<geom {seen} mesh='broken'/>")).contains("broken.stl`: its triangles cannot be read"));

    // What masks or `<exclude>` keep from all else is only seen, too.
    let with_others = |geom: &str, others: &str, contact: &str| {
        let text = format!(
            "<mujoco><asset><mesh name='m' file='cube.obj'/></asset><worldbody>{others}<body name='a'><freejoint/>
             <inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/><geom name='m' type='mesh' mesh='m' {geom}/>
             <geom size='1'/></body></worldbody><contact>{contact}</contact></mujoco>"
        );
        let path = folder.join("scene.xml");
        std::fs::write(&path, text).unwrap();
        open::open(&path).err()
    };
    let ball = "<body name='b' pos='9 0 0'><freejoint/><geom name='ball' size='1'/></body>";
    let twin = "<body name='b'><freejoint/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/><geom type='mesh' mesh='m'/></body>";
    let apart = "<exclude body1='a' body2='b'/>";
    for (geom, others, contact) in
        [("", "", ""), ("", ball, apart), ("contype='2' conaffinity='2'", ball, ""), ("", twin, apart)]
    {
        assert_eq!(with_others(geom, others, contact), None);
    }
    for (geom, others, contact) in
        [("", ball, ""), ("contype='2'", ball, ""), ("", twin, ""), ("", "<geom type='plane' size='1 1 1'/>", "")]
    {
        let report = with_others(geom, others, contact).expect("an error");
        assert!(report.contains("nothing would touch it"), "{report}");
    }
    let report = with_others("", ball, &format!("{apart}<pair geom1='m' geom2='ball'/>")).expect("an error");
    assert!(report.contains("the geom of that name is a mesh"), "{report}");

    // One that touches or weighs is refused, and a box as large is proposed.
    let report = scene_with("<geom name='hull' type='mesh' mesh='cube'/>").err().unwrap();
    assert!(report.contains("error[unsupported]: `mesh` is not supported: nothing would touch it"), "{report}");
    assert!(
        report.contains("scene.xml:2:") && report.contains("size=\"0.1 0.1 0.2\"`, its centre at 0.1 0.1 0.2"),
        "{report}"
    );
    let report = scene_with("<geom type='mesh' mesh='cube' contype='0' conaffinity='0'/>").err().unwrap();
    assert!(report.contains("its mass and inertia would be missing"), "{report}");
}
