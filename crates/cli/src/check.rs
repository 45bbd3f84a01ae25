//! `penny check`: every problem of scene files.

use std::io::IsTerminal;
use std::path::PathBuf;

use super::Failure;
use super::format::count;
use super::run::warnings::Overlap;
use super::scene::LimitArgs;
use penny::mjcf::{self, Problem, Severity};
use penny::model::Model;
use penny::state::State;
use penny_lab::record::Recorder;

#[derive(clap::Args)]
pub struct Args {
    /// MJCF files
    #[arg(value_name = "SCENE.xml", required = true)]
    scenes: Vec<PathBuf>,
    #[command(flatten)]
    limits: LimitArgs,
}

pub fn check(args: &Args) -> Result<(), Failure> {
    let colour = std::io::stderr().is_terminal();
    let mut refused = Vec::new();
    for path in &args.scenes {
        let file = path.display();
        match penny::load_within(path, &args.limits.limits()) {
            Ok(scene) => {
                let doubts = doubts(&scene.model);
                if !scene.warnings.is_empty() {
                    eprintln!("{}\n", mjcf::render(&scene.document, &scene.warnings, colour).trim_end());
                }
                doubts.iter().for_each(|doubt| eprintln!("{}\n", doubt.trim_end()));
                let found = scene.warnings.len() + doubts.len();
                match found {
                    0 => println!("{file}: fine"),
                    _ => println!("{file}: fine, with {}", count(found, "warning", "warnings")),
                }
            }
            Err(failure) => {
                let report = mjcf::render(&failure.document, &failure.problems, colour);
                refused.push(format!("{report}\n{file}: {}\n", counts(&failure.problems)));
            }
        }
    }
    if refused.is_empty() { Ok(()) } else { Err(Failure::Problem(refused.join("\n"))) }
}

/// What only shows where the scene begins: overlaps, joints beyond their limits, in the scene's own start and in keyframes.
fn doubts(model: &Model) -> Vec<String> {
    let mut list = super::doubts::of_scene(model);
    let mut recorder = Recorder::new(model);
    let start = State::new(model);
    recorder.sample(model, &start);
    list.extend(Overlap::find(model, recorder.contacts()).map(|overlap| overlap.warning(model)));
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
fn counts(problems: &[Problem]) -> String {
    let of = |severity| problems.iter().filter(|p| p.severity() == severity).count();
    let parts = [(of(Severity::Error), "error", "errors"), (of(Severity::Warning), "warning", "warnings")];
    parts.into_iter().filter(|(n, ..)| *n > 0).map(|(n, one, many)| count(n, one, many)).collect::<Vec<_>>().join(", ")
}
