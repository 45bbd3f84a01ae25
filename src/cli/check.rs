//! `penny check`: every problem of scene files.

use std::path::PathBuf;

use super::format::count;
use super::{Failure, scene};

#[derive(clap::Args)]
pub struct Args {
    /// MJCF files
    #[arg(value_name = "SCENE.xml", required = true)]
    scenes: Vec<PathBuf>,
}

pub fn check(args: &Args) -> Result<(), Failure> {
    let mut reports = Vec::new();
    for path in &args.scenes {
        match scene::read(path) {
            Ok(read) if read.count == 0 => eprintln!("{}: fine", path.display()),
            Ok(read) => {
                eprintln!(
                    "{}\n{}: fine, with {}",
                    read.warnings,
                    path.display(),
                    count(read.count, "warning", "warnings")
                )
            }
            Err(Failure::Problem(report)) => reports.push(report),
            Err(other) => return Err(other),
        }
    }
    if reports.is_empty() { Ok(()) } else { Err(Failure::Problem(reports.join("\n"))) }
}
