//! `penny check`: every problem of scene files, for people and for programs, and the changes that mend what can be mended.

mod report;

use std::io::IsTerminal;
use std::path::{Path, PathBuf};

use self::report::Found;
use super::Failure;
use super::files;
use super::format::count;
use super::run::warnings::Overlap;
use super::scene::LimitArgs;
use penny::Scene;
use penny::data::Data;
use penny::mjcf::{self, Document, Fixed, Severity};
use penny::model::Model;
use penny::state::State;

#[derive(clap::Args)]
pub struct Args {
    /// MJCF files
    #[arg(value_name = "SCENE.xml", required = true)]
    scenes: Vec<PathBuf>,
    /// Show as a diff the changes that would mend misspelt or renamed names and numbers in another unit
    #[arg(long)]
    fix: bool,
    /// Make these changes, each file in one go, and check again
    #[arg(long, requires = "fix")]
    write: bool,
    /// Write all problems as JSON to standard output
    #[arg(long, conflicts_with_all = ["sarif", "fix"])]
    json: bool,
    /// Write all problems as SARIF 2.1.0 to standard output, for editors and continuous integration
    #[arg(long, conflicts_with = "fix")]
    sarif: bool,
    /// Exit with code 1 if there are warnings, too
    #[arg(long, value_name = "warnings", value_parser = ["warnings"])]
    deny: Option<String>,
    #[command(flatten)]
    limits: LimitArgs,
}

pub fn check(args: &Args) -> Result<(), Failure> {
    if args.json || args.sarif {
        let all: Vec<Found> = args.scenes.iter().map(|path| find(path, args)).collect();
        let value = if args.json { report::json(&all) } else { report::sarif(&all) };
        println!("{value:#}");
        return if all.iter().any(|found| args.refuses(found)) { Err(Failure::Told) } else { Ok(()) };
    }
    let colour = std::io::stderr().is_terminal();
    let mut refused = Vec::new();
    for path in &args.scenes {
        let (file, mut found) = (path.display(), find(path, args));
        let mut proposed = Vec::new();
        if args.fix {
            proposed = mjcf::fixed(&found.document, &found.problems);
            for fixed in &proposed {
                print!("{}", fixed.diff(&found.document));
            }
        }
        if args.write && !proposed.is_empty() {
            write(&found.document, &proposed)?;
            let changes = proposed.iter().map(|fixed| fixed.edits.len()).sum();
            println!("{file}: {} written", count(changes, "change", "changes"));
            found = find(path, args);
            proposed.clear();
        }
        let mut text = mjcf::render(&found.document, &found.problems, colour).trim_end().to_owned();
        for doubt in &found.doubts {
            text = format!("{text}\n\n{}", doubt.trim_end());
        }
        let text = text.trim_start();
        let is_bad = found.count(Severity::Error) > 0;
        if args.refuses(&found) {
            let fine = if is_bad { "" } else { "fine, but for " };
            refused.push(format!("{text}\n\n{file}: {fine}{}\n", counts(&found)));
        } else {
            if !text.is_empty() {
                eprintln!("{text}\n");
            }
            match found.count(Severity::Warning) {
                0 => println!("{file}: fine"),
                n => println!("{file}: fine, with {}", count(n, "warning", "warnings")),
            }
        }
        if !proposed.is_empty() {
            println!("{file}: --fix --write makes the changes");
        }
    }
    if refused.is_empty() { Ok(()) } else { Err(Failure::Problem(refused.join("\n"))) }
}

impl Args {
    fn refuses(&self, found: &Found) -> bool {
        found.count(Severity::Error) > 0 || (self.deny.is_some() && found.count(Severity::Warning) > 0)
    }
}

fn find(path: &Path, args: &Args) -> Found {
    let scene = path.display().to_string();
    match penny::load_within(path, &args.limits.limits()) {
        Ok(Scene { mut document, model, warnings: problems }) => {
            // Where there is nothing to show, its memory serves what comes.
            if problems.is_empty() {
                document = Document::default();
            }
            Found { scene, document, problems, doubts: doubts(&model) }
        }
        Err(failure) => Found { scene, document: failure.document, problems: failure.problems, doubts: Vec::new() },
    }
}

/// Writes the files, each in one go.
///
/// Errors: one cannot be written, or is no longer what was read.
fn write(document: &Document, all: &[Fixed]) -> Result<(), Failure> {
    for fixed in all {
        let source = &document.files[fixed.file];
        let cannot = |e| files::cannot_write(&source.path, &e);
        let now = std::fs::read_to_string(&source.path).map_err(cannot)?;
        // A byte order mark is no part of the text that was read.
        let mark = if now.starts_with('\u{feff}') { "\u{feff}" } else { "" };
        if now[mark.len()..] != *source.text {
            let why = format!("error: `{}` has changed meanwhile: check it again", source.name);
            return Err(Failure::Problem(why));
        }
        files::write(&source.path, &format!("{mark}{}", fixed.text))?;
    }
    Ok(())
}

/// What only shows where the scene begins: overlaps, joints beyond their limits, in the scene's own start and in keyframes.
fn doubts(model: &Model) -> Vec<String> {
    let mut list = super::doubts::of_scene(model);
    let (mut data, start) = (Data::for_poses(model), State::new(model));
    if let Err(crowd) = super::doubts::find_contacts(model, &start, &mut data) {
        list.push(format!("warning: no step can be taken: {crowd}"));
    }
    list.extend(Overlap::find(model, &data.contacts).map(|overlap| overlap.warning(model)));
    let at = list.len();
    let mut places: Vec<(String, Vec<String>)> = Vec::new();
    grouped(&mut places, model, &start, None);
    for (i, key) in model.keyframes.iter().enumerate() {
        let mut state = start.clone();
        (state.qpos, state.qvel, state.ctrl) = (key.qpos.clone(), key.qvel.clone(), key.ctrl.clone());
        let name = if key.name.is_empty() { i.to_string() } else { key.name.clone() };
        grouped(&mut places, model, &state, Some(&name));
        let clamped = super::scene::clamped_controls(model, &state);
        list.extend(clamped.lines().map(|line| format!("{line} (keyframe {name})")));
    }
    let told = |(doubt, places): (String, Vec<String>)| {
        let (start, keys): (Vec<_>, Vec<_>) = places.into_iter().partition(String::is_empty);
        let keys = match keys.len() {
            0 => None,
            1 => Some(format!("in keyframe {}", keys[0])),
            _ => Some(format!("in keyframes {}", keys.join(", "))),
        };
        let start = (!start.is_empty()).then(|| "at the start".to_owned());
        doubt.replace(PLACE, &start.into_iter().chain(keys).collect::<Vec<_>>().join(" and "))
    };
    list.splice(at..at, places.into_iter().map(told));
    list
}

/// Stands for where a doubt holds; no name has it.
const PLACE: &str = "\0";

/// Adds a start (a keyframe's, or the scene's own without a name) to what is doubtful in others alike.
fn grouped(places: &mut Vec<(String, Vec<String>)>, model: &Model, state: &State, key: Option<&str>) {
    for doubt in super::doubts::of_start(model, state, PLACE) {
        let key = key.unwrap_or_default().to_owned();
        match places.iter_mut().find(|(other, _)| *other == doubt) {
            Some((_, places)) => places.push(key),
            None => places.push((doubt, vec![key])),
        }
    }
}

/// "2 errors, 1 warning"; what there is none of is left out.
fn counts(found: &Found) -> String {
    let of = |severity| found.count(severity);
    let parts = [(of(Severity::Error), "error", "errors"), (of(Severity::Warning), "warning", "warnings")];
    parts.into_iter().filter(|(n, ..)| *n > 0).map(|(n, one, many)| count(n, one, many)).collect::<Vec<_>>().join(", ")
}
