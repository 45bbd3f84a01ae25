//! `penny play`: the interactive simulator and the game.

use std::path::{Path, PathBuf};

use super::Failure;
use super::files;
use super::render::{beside, read_log};
use super::scene::{LimitArgs, MethodArgs, StartArgs, positive, whole};
use penny::mjcf::Limits;
use penny_view::game::LEVELS;
use penny_view::open::{self, Opened};
use penny_view::session::{Player, Session};

#[derive(clap::Args)]
pub struct Args {
    /// MJCF file; models/goal.xml is the game
    #[arg(value_name = "SCENE.xml", required_unless_present = "replay")]
    scene: Option<PathBuf>,
    /// Write the session's inputs to this file when the window is closed
    #[arg(long, value_name = "run.json")]
    record: Option<PathBuf>,
    /// Write the state when the window is closed, for --load-state
    #[arg(long, value_name = "FILE")]
    save_state: Option<PathBuf>,
    /// Play a recorded session again, bit for bit
    #[arg(long, value_name = "run.json", conflicts_with = "scene")]
    replay: Option<PathBuf>,
    /// Begin the replay after this many simulated seconds; what comes before is computed, but not shown
    #[arg(long, value_name = "S", value_parser = positive, requires = "replay", allow_hyphen_values = true)]
    from: Option<f64>,
    /// Seed of the game's passes
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole::<u64>, allow_negative_numbers = true)]
    seed: u64,
    /// Level of the game: still, pass, keeper, circle
    #[arg(long, value_name = "NAME")]
    level: Option<String>,
    /// Show the same scene under this law as a ghost
    #[arg(long, value_name = "LAW")]
    ghost: Option<String>,
    #[command(flatten)]
    method: MethodArgs,
    #[command(flatten)]
    start: StartArgs,
    #[command(flatten)]
    limits: LimitArgs,
}

/// Opens a scene; its warnings are printed.
pub fn opened(path: &Path, limits: &Limits) -> Result<Opened, Failure> {
    let opened = open::open_within(path, limits).map_err(Failure::Problem)?;
    if !opened.warnings.is_empty() {
        eprint!("{}", opened.warnings);
    }
    Ok(opened)
}

/// A recorded session before its first step, and what drives it. It carries its scene. A scene outside the session's folder is taken if it
/// is the very file that the session was recorded with; of another one nothing is told.
pub fn recorded(path: &Path, limits: &Limits) -> Result<(Session, Player, Vec<PathBuf>), Failure> {
    let log = read_log(path)?;
    let scene = beside(&log.scene, path);
    // Where the file is not, or is another one by now: the scene that the session carries.
    let elsewhere = || open::open_within(&scene, limits).map_or(true, |opened| opened.hash != log.scene_hash);
    let carried = log.carried().filter(|_| elsewhere());
    let opened = if let Some(text) = carried {
        let mut opened = open::open_text(&log.scene, text).map_err(Failure::Problem)?;
        opened.files.clear();
        opened
    } else if limits.outside || files::inside(&scene, path) {
        opened(&scene, limits)?
    } else {
        let same = open::open_within(&scene, limits).ok().filter(|opened| opened.hash == log.scene_hash);
        same.ok_or_else(|| {
            Failure::Problem(format!(
                "error: {}: its scene `{}` lies outside the session's folder, and is not the file that it was recorded \
                 with\n  help: if you trust the session: --allow-outside",
                path.display(),
                log.scene
            ))
        })?
    };
    let session = Session::from_log(&log, opened.model, &opened.hash)
        .map_err(|e| Failure::Problem(format!("error: {}: {e}", path.display())))?;
    Ok((session, Player::new(log), opened.files))
}

fn level(name: &str) -> Result<usize, Failure> {
    LEVELS.iter().position(|l| l.name == name).ok_or_else(|| {
        let names: Vec<&str> = LEVELS.iter().map(|l| l.name).collect();
        Failure::Usage(format!("error: there is no level `{name}`: there is {}", names.join(", ")))
    })
}

#[cfg(feature = "play")]
pub fn play(args: &Args) -> Result<(), Failure> {
    use penny::contact;
    use penny_view::session::Source;
    use penny_view::stage::Stage;
    use penny_window::window::{Last, Open, run};
    let limits = args.limits.limits();
    let chosen = args.level.as_deref().map(level).transpose()?;
    if let Some(name) = args.ghost.as_deref().filter(|name| contact::by_name(name).is_none()) {
        let names: Vec<&str> = contact::ALL.iter().map(|l| l.name).collect();
        return Err(Failure::Usage(format!("error: there is no contact law `{name}`: there is {}", names.join(", "))));
    }
    let read: Vec<PathBuf> = args.scene.iter().chain(&args.replay).cloned().collect();
    let written = [("--record", args.record.as_deref()), ("--save-state", args.save_state.as_deref())];
    let apart = |read: &[PathBuf]| files::apart(read, &written);
    apart(&read)?;
    written.iter().try_for_each(|(_, path)| path.map_or(Ok(()), files::writable))?;
    let (path, files, mut stage) = match (&args.replay, &args.scene) {
        (Some(run), _) => {
            let (session, player, read) = recorded(run, &limits)?;
            apart(&read)?;
            let path = PathBuf::from(&session.source.path);
            let mut stage = Stage::new(session, 0, None, false);
            stage.replay(player);
            stage.skip(args.from.unwrap_or(0.0)).map_err(|e| Failure::Problem(format!("error: {e}")))?;
            (path, Vec::new(), stage)
        }
        (None, Some(scene)) => {
            let path = chosen.map_or_else(|| scene.clone(), |level| scene.with_file_name(LEVELS[level].scene));
            let opened = opened(&path, &limits)?;
            apart(&opened.files)?;
            let (method, state) = (args.method.method(&opened.model)?, args.start.state(&opened.model)?);
            let source = Source {
                path: path.display().to_string(),
                hash: opened.hash,
                seed: args.seed,
                text: Some(opened.text),
            };
            let warnings = super::run::doubtful(&opened.model, &method, &state);
            warnings.iter().for_each(|warning| eprintln!("{warning}"));
            let session = Session::new(opened.model, method, state, source);
            let mut stage = Stage::new(session, args.seed, chosen, true);
            // Those of the text first, each in its whole.
            let of_text = Some(opened.warnings.trim_end().to_owned()).filter(|text| !text.is_empty());
            stage.warnings = of_text.into_iter().chain(warnings).collect();
            (path, opened.files, stage)
        }
        (None, None) => return Err(Failure::Usage("error: name a scene: penny play SCENE.xml".to_owned())),
    };
    stage.set_ghost(args.ghost.as_deref());
    let last = args.save_state.clone().map(|path| -> Last {
        Box::new(move |session| match files::write_state(&path, &session.model, &session.method, &session.state) {
            Err(Failure::Problem(text) | Failure::Usage(text)) => Err(text.trim_start_matches("error: ").to_owned()),
            _ => Ok(()),
        })
    });
    run(Open { path, stage, files, limits, record: args.record.clone(), last })
        .map_err(|e| Failure::Problem(format!("error: {e}")))
}

#[cfg(not(feature = "play"))]
pub fn play(args: &Args) -> Result<(), Failure> {
    let _ = (
        &args.scene, &args.replay, &args.from, &args.record, &args.save_state, &args.seed, &args.ghost, &args.method,
        &args.start, &args.limits,
    );
    args.level.as_deref().map(level).transpose()?;
    Err(Failure::Problem(
        "error: this penny was built without the window: `cargo run --features play -- play SCENE.xml` builds it; \
         `penny render SCENE.xml -o out.gif` makes pictures and videos without it"
            .to_owned(),
    ))
}
