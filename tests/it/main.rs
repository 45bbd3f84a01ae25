//! All integration tests in one binary: linking costs more than running. It belongs to the package of the command line
//! (`crates/cli`), because only there Cargo tells where `penny` is.

use std::path::{Path, PathBuf};

/// The repository's folder: `models`, `tests` and `docs` are here, and `penny` is started here.
pub const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// A file or folder of the repository.
pub fn file(path: &str) -> PathBuf {
    Path::new(ROOT).join(path)
}

/// All that a command said: warnings and errors, then its report.
pub fn said(output: &std::process::Output) -> String {
    let [errors, report] = [&output.stderr, &output.stdout].map(|text| String::from_utf8_lossy(text).into_owned());
    errors + &report
}

mod accuracy;
mod answers;
mod bad_input;
mod cases;
mod cli;
mod collision;
mod compile;
mod conservation;
mod contact_forces;
mod doubts;
mod examples;
mod explain;
mod extremes;
mod features;
mod fuzz;
mod implicit;
mod invariance;
mod layers;
mod models;
mod mujoco_law;
mod own;
mod penalty;
mod picture;
mod random_scene;
mod reader;
mod robustness;
mod rollout;
mod sim;
mod simulation;
mod smooth;
mod sweep;
mod trade;
mod tutorial;
mod validation;
mod view;
mod warnings;
#[cfg(feature = "play")]
mod window;
