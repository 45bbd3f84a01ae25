//! `penny check`: every problem of scene files.

use std::io::IsTerminal;
use std::path::PathBuf;

use super::Failure;
use super::format::count;
use super::scene::LimitArgs;
use penny::mjcf::{self, Problem, Severity};

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
            Ok(scene) if scene.warnings.is_empty() => println!("{file}: fine"),
            Ok(scene) => {
                let report = mjcf::render(&scene.document, &scene.warnings, colour);
                eprintln!("{report}\n");
                println!("{file}: fine, with {}", counts(&scene.warnings));
            }
            Err(failure) => {
                let report = mjcf::render(&failure.document, &failure.problems, colour);
                refused.push(format!("{report}\n{file}: {}\n", counts(&failure.problems)));
            }
        }
    }
    if refused.is_empty() { Ok(()) } else { Err(Failure::Problem(refused.join("\n"))) }
}

/// "2 errors, 1 warning"; what there is none of is left out.
fn counts(problems: &[Problem]) -> String {
    let of = |severity| problems.iter().filter(|p| p.severity() == severity).count();
    let parts = [(of(Severity::Error), "error", "errors"), (of(Severity::Warning), "warning", "warnings")];
    parts.into_iter().filter(|(n, ..)| *n > 0).map(|(n, one, many)| count(n, one, many)).collect::<Vec<_>>().join(", ")
}
