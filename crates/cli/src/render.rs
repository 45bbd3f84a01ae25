//! `penny render`: pictures and videos without a display.

use std::path::{Path, PathBuf};

use indicatif::{ProgressBar, ProgressStyle};

use super::Failure;
use super::accuracy::{self, AccuracyArgs};
use super::files;
use super::format::{short, si};
use super::play::{opened, recorded};
use super::scene::{DEFAULT_TIME, LimitArgs, MOST_STEPS, MethodArgs, StartArgs};
use penny::draft::Draft;
use penny::forward::Method;
use penny_lab::accuracy::Stepping;
use penny_lab::sweep::Case;
use penny_view::film::Film;
use penny_view::log::{Change, Log};
use penny_view::paint::{Image, Painter};
use penny_view::scene;
use penny_view::session::{Player, Session, Source};
use penny_view::video::{Format, Shape, Video};

#[derive(clap::Args)]
pub struct Args {
    /// MJCF file, or a session recorded by `penny play --record`
    #[arg(value_name = "SCENE.xml|run.json")]
    input: PathBuf,
    /// File to write: .gif, .png (the last picture), .apng, .mp4 or .webm (these two through ffmpeg)
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Write the state at the end of the film, for --load-state
    #[arg(long, value_name = "FILE")]
    save_state: Option<PathBuf>,
    /// Pixels [default: 640x480, with --panel 1280x720]
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<[usize; 2]>,
    /// Frames per second [default: 50, .apng 30, .mp4 and .webm 60]
    #[arg(long, value_name = "N", value_parser = positive, allow_hyphen_values = true)]
    fps: Option<f64>,
    /// Begin after this many simulated seconds; what comes before is computed, but not shown
    #[arg(long, value_name = "S", value_parser = positive, allow_hyphen_values = true)]
    from: Option<f64>,
    /// Simulated seconds to show [default: 3, or the recorded session to its end]
    #[arg(long, value_name = "S", value_parser = positive, allow_hyphen_values = true)]
    time: Option<f64>,
    /// Simulated seconds per second of film
    #[arg(long, value_name = "X", default_value_t = 1.0, value_parser = positive, allow_hyphen_values = true)]
    speed: f64,
    /// Camera: azimuth and elevation in degrees, distance and target in m [default: all that moves is in view]
    #[arg(long, value_name = "A,E[,D[,X,Y,Z]]", allow_hyphen_values = true)]
    camera: Option<String>,
    /// Body that the camera follows, or `none` [default: the only one that moves]
    #[arg(long, value_name = "BODY")]
    follow: Option<String>,
    /// No arrows, no trails
    #[arg(long)]
    plain: bool,
    /// With side panel and plots, as `penny play` shows them
    #[arg(long)]
    panel: bool,
    #[command(flatten)]
    method: MethodArgs,
    #[command(flatten)]
    accuracy: AccuracyArgs,
    #[command(flatten)]
    start: StartArgs,
    #[command(flatten)]
    limits: LimitArgs,
}

/// Nine hours of film at 30 frames a second.
const MOST_FRAMES: usize = 1_000_000;

pub fn render(args: &Args) -> Result<(), Failure> {
    let format = Format::of(&args.output).map_err(usage)?;
    let (mut session, player, mut read) = session(args)?;
    read.push(args.input.clone());
    files::apart(&read, &[("--output", Some(&args.output)), ("--save-state", args.save_state.as_deref())])?;
    args.save_state.as_deref().map_or(Ok(()), files::writable)?;
    let recorded = player.as_ref().map(|p| p.log().duration());
    let from = args.from.unwrap_or(0.0);
    if let Some(all) = recorded.filter(|all| from >= *all) {
        let why = format!("error: --from {from} is after the end of the session: it lasts {}", si(all, "s"));
        return Err(Failure::Usage(why));
    }
    let duration = args.time.or(recorded.map(|all| all - from)).unwrap_or(DEFAULT_TIME);
    // Of a single picture the second frame is the end, whatever the time.
    let usual = if format == Format::Png { args.speed / duration } else { format.usual_fps() };
    let fps = args.fps.unwrap_or(usual);
    let film = film(args, &session, fps)?;
    let whole = recorded.is_some() && args.time.is_none();
    let frames = if whole { film.frames_to_end(duration) } else { film.frames(duration) };
    let [width, height] = args.size.unwrap_or(if args.panel { [1280, 720] } else { [640, 480] });
    let most = if session.method.timestep > 0.0 { MOST_STEPS as f64 * session.method.timestep } else { 0.0 };
    if frames > MOST_FRAMES || duration + from > most {
        let steps = (duration + from) / session.method.timestep;
        return Err(Failure::Usage(format!(
            "error: {} makes {} frames of {} steps; the most are {} frames and {} steps",
            si(duration, "s"),
            short(frames as f64),
            short(steps),
            short(MOST_FRAMES as f64),
            short(MOST_STEPS as f64)
        )));
    }
    // Written beside, as ffmpeg does too, until it is whole.
    let draft = Draft::new(&args.output).map_err(|e| files::cannot_write(&args.output, &e))?;
    // The user knows the file by its own name.
    let unfinished = draft.path().display().to_string();
    let cannot = |why: String| problem(why.replace(&unfinished, &args.output.display().to_string()));
    let mut video = Video::create(draft.path(), Shape { width, height, fps, frames }).map_err(cannot)?;
    let bar = ProgressBar::new(frames as u64);
    // The template is constant and right.
    if let Ok(style) = ProgressStyle::with_template("  {bar:40} {pos}/{len} frames, {eta} left") {
        bar.set_style(style);
    }
    // Of a single picture only the last frame is drawn.
    let first = if format == Format::Png { frames - 1 } else { 0 };
    let mut write = |image: &Image| {
        bar.inc(1);
        video.push(image).map_err(cannot)
    };
    session = if args.panel {
        with_panel(session, player, (film, from), first..frames, [width, height], &mut write)?
    } else {
        let (mut film, mut player) = (film, player);
        let threads = std::thread::available_parallelism().map_or(1, |n| n.get().min(8));
        film.skip(from, &mut session, player.as_mut()).map_err(problem)?;
        let (mut painter, mut image) = (Painter::new(threads), Image::new(width, height));
        for i in first..frames {
            let list = film.frame(i, &mut session, player.as_mut()).map_err(problem)?;
            painter.paint(&list, &mut image);
            write(&image)?;
        }
        session
    };
    video.finish().map_err(cannot)?;
    draft.keep().map_err(|e| files::cannot_write(&args.output, &e))?;
    bar.finish_and_clear();
    if let Some(path) = &args.save_state {
        files::write_state(path, &session.model, &session.method, &session.state)?;
    }
    println!("{}: {}", args.output.display(), counted(frames - first, fps));
    println!("{}", session.summary());
    Ok(())
}

fn counted(frames: usize, fps: f64) -> String {
    if frames == 1 { "one picture".to_owned() } else { format!("{frames} frames, {:.2} s", frames as f64 / fps) }
}

/// The session to film, what drives it if it was recorded, and the files that were read.
fn session(args: &Args) -> Result<(Session, Option<Player>, Vec<PathBuf>), Failure> {
    if args.input.extension().is_some_and(|e| e == "json") {
        if args.method.given() || args.start.given() || args.accuracy.accuracy.is_some() {
            let why = "error: a recorded session brings its own method and start; these options are for scenes";
            return Err(Failure::Usage(why.to_owned()));
        }
        let (session, player, files) = recorded(&args.input, &args.limits.limits())?;
        return Ok((session, Some(player), files));
    }
    let opened = opened(&args.input, &args.limits.limits())?;
    let (method, state) = (args.method.method(&opened.model)?, args.start.state(&opened.model)?);
    let source = Source { path: args.input.display().to_string(), hash: opened.hash, seed: 0, text: Some(opened.text) };
    let Some(wanted) = args.accuracy.accuracy else {
        return Ok((Session::new(opened.model, method, state, source), None, opened.files));
    };
    let seconds = args.from.unwrap_or(0.0) + args.time.unwrap_or(DEFAULT_TIME);
    let case = Case { model: opened.model, start: state, seconds };
    let choice = accuracy::find(&case, &method, wanted)?;
    for [name, text] in accuracy::account(&choice, wanted) {
        println!("{name}: {text}");
    }
    // Controlled steps end at each of the scene's own.
    let (timestep, tolerance) = match choice.stepping {
        Stepping::Fixed(timestep) => (timestep, 0.0),
        Stepping::Controlled(tolerance) => (method.timestep, tolerance),
    };
    let method = Method { timestep, ..choice.method };
    let mut session = Session::new(case.model, method, case.start, source);
    session.change(Change::Accuracy(tolerance)).map_err(problem)?;
    Ok((session, None, opened.files))
}

fn film(args: &Args, session: &Session, fps: f64) -> Result<Film, Failure> {
    let model = &session.model;
    let follow = match args.follow.as_deref() {
        Some("none") => None,
        Some(name) => Some(model.bodies.iter().position(|b| b.name == name).ok_or_else(|| {
            let names: Vec<&str> = model.bodies.iter().skip(1).map(|b| b.name.as_str()).collect();
            Failure::Usage(format!("error: there is no body `{name}` to follow: there is {}", names.join(", ")))
        })?),
        None => match &model.trees[..] {
            [only] if args.camera.is_none() && !model.numerics.contains_key("penny.goal") => Some(only.bodies.start),
            _ => None,
        },
    };
    let mut camera = scene::first_look(session);
    if let Some(text) = &args.camera {
        camera = camera.parse(text).map_err(usage)?;
    }
    let mut film = Film::new(session, camera, follow, fps, args.speed);
    if args.plain {
        film.notes = scene::Notes::NONE;
    }
    Ok(film)
}

#[cfg(feature = "play")]
fn with_panel(
    session: Session,
    player: Option<Player>,
    (film, from): (Film, f64),
    frames: std::ops::Range<usize>,
    [width, height]: [usize; 2],
    write: &mut dyn FnMut(&Image) -> Result<(), Failure>,
) -> Result<Session, Failure> {
    use penny_view::stage::Stage;
    use penny_window::{App, headless::Headless};
    let mut stage = Stage::watch(session, film, player);
    stage.skip(from).map_err(problem)?;
    // Plots need the steps before the first picture too.
    let mut window = Headless::new(width, height);
    let skipped = frames.start;
    stage.advance(skipped).map_err(problem)?;
    let mut app = App::new(stage);
    for i in frames {
        if i > skipped {
            app.stage.advance(i).map_err(problem)?;
        }
        // egui lays out in its first pass and knows sizes in the second.
        for _ in 0..if i == skipped { 2 } else { 0 } {
            window.frame(&mut app, 0.0, Vec::new());
        }
        write(&window.frame(&mut app, 0.0, Vec::new()))?;
    }
    Ok(app.stage.session)
}

#[cfg(not(feature = "play"))]
fn with_panel(
    _: Session,
    _: Option<Player>,
    _: (Film, f64),
    _: std::ops::Range<usize>,
    _: [usize; 2],
    _: &mut dyn FnMut(&Image) -> Result<(), Failure>,
) -> Result<Session, Failure> {
    Err(Failure::Usage(
        "error: --panel needs a penny with the window: `cargo run --features play -- render …` builds it".to_owned(),
    ))
}

fn size(text: &str) -> Result<[usize; 2], String> {
    let wrong = || format!("a size is WIDTHxHEIGHT with 16 to 8192 pixels each, not `{text}`");
    let (w, h) = text.split_once(['x', 'X', '×']).ok_or_else(wrong)?;
    let side = |s: &str| s.trim().parse().ok().filter(|n| (16..=8192).contains(n)).ok_or_else(wrong);
    Ok([side(w)?, side(h)?])
}

fn positive(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|x: &f64| x.is_finite() && *x > 0.0).ok_or_else(|| "must be a number above 0".to_owned())
}

fn problem(text: String) -> Failure {
    Failure::Problem(format!("error: {text}"))
}

fn usage(text: String) -> Failure {
    Failure::Usage(format!("error: {text}"))
}

/// A path as one reads it from a log: as it stands, or beside the log.
pub fn beside(path: &str, log: &Path) -> PathBuf {
    let path = PathBuf::from(path);
    if path.exists() { path } else { log.parent().unwrap_or(Path::new("")).join(path.file_name().unwrap_or_default()) }
}

/// Reads a recorded session's file.
pub fn read_log(path: &Path) -> Result<Log, Failure> {
    let text = std::fs::read_to_string(path)
        .map_err(|e| problem(format!("cannot read `{}`: {}", path.display(), penny::reason(e))))?;
    Log::parse(&text).map_err(|e| problem(format!("{}: {e}", path.display())))
}
