//! The command line: one file a command. Data goes to standard output only where it was asked for; all else that is
//! said goes to standard error.

mod bench;
mod check;
mod compare;
mod explain;
mod format;
mod mujoco;
mod run;
mod scene;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// A pocket-sized rigid-body simulator that reads MuJoCo's MJCF files.
#[derive(Parser)]
#[command(name = "penny", version, arg_required_else_help = true)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
#[command(override_usage = "penny SCENE.xml [OPTIONS]\n       penny <COMMAND> …")]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    run: Option<run::Args>,
}

#[derive(Subcommand)]
enum Command {
    /// Simulate a scene (also without the word: `penny SCENE.xml`)
    Run(run::Args),
    /// Report every problem of scene files; exit code 1 if there is an error
    Check(check::Args),
    /// Say what a scene requires, and what its numbers mean in SI units
    Explain(explain::Args),
    /// Run a scene beside the real MuJoCo: differences and speed
    Compare(compare::Args),
    /// Measure nanoseconds per step of every law and integrator
    Bench(bench::Args),
}

/// Why a command ended early. Each holds all that there is to say.
enum Failure {
    /// The scene or the run has a problem: exit code 1.
    Problem(String),
    /// The command line asks for what cannot be: exit code 2.
    Usage(String),
}

impl From<std::io::Error> for Failure {
    fn from(error: std::io::Error) -> Failure {
        Failure::Problem(format!("error: {error}"))
    }
}

/// Runs the program. `allocations` tells how often memory was allocated so far; `bench` reports the difference.
pub fn main(allocations: fn() -> usize) -> ExitCode {
    let cli = Cli::parse();
    let outcome = match (cli.command, cli.run) {
        (Some(Command::Run(args)), _) | (None, Some(args)) => run::run(&args),
        (Some(Command::Check(args)), _) => check::check(&args),
        (Some(Command::Explain(args)), _) => explain::explain(&args),
        (Some(Command::Compare(args)), _) => compare::compare(&args),
        (Some(Command::Bench(args)), _) => bench::bench(&args, allocations),
        (None, None) => Err(Failure::Usage("error: name a scene: penny SCENE.xml".to_owned())),
    };
    let (text, code) = match outcome {
        Ok(()) => return ExitCode::SUCCESS,
        Err(Failure::Problem(text)) => (text, 1),
        Err(Failure::Usage(text)) => (text, 2),
    };
    eprintln!("{}", text.trim_end());
    ExitCode::from(code)
}
