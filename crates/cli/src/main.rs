//! The command line: one file a command. A command's report goes to standard output, or to standard error where `-` asks
//! for data on standard output; warnings, progress and errors always go to standard error.

/// As the standard library's, but does not panic where standard error is closed or full: nobody is left to be told.
/// Text of files and of other programs gives no commands to the terminal.
macro_rules! eprint {
    ($($text:tt)*) => {
        $crate::say(&format!($($text)*))
    };
}

/// As [`eprint`], with the end of the line.
macro_rules! eprintln {
    ($($text:tt)*) => {
        $crate::say(&(format!($($text)*) + "\n"))
    };
}

/// As [`eprint`], to standard output: for reports. Whoever stops reading (`| head`) has enough.
macro_rules! print {
    ($($text:tt)*) => {{
        use std::io::Write as _;
        let _ = std::io::stdout().write_all(penny::mjcf::printable(&format!($($text)*)).as_bytes());
    }};
}

/// As [`print`], with the end of the line.
macro_rules! println {
    ($($text:tt)*) => {
        print!("{}\n", format!($($text)*))
    };
}

mod accuracy;
mod bench;
mod check;
mod compare;
mod convert;
mod doubts;
mod explain;
mod files;
mod format;
mod interrupt;
mod map;
mod mujoco;
mod play;
mod render;
mod rollout;
mod run;
mod scene;
mod sweep;

use std::alloc::System;
use std::ffi::OsString;
use std::io::{IsTerminal, Write};
use std::path::Path;
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{Parser, Subcommand};
use penny::mjcf::printable;
use stats_alloc::{INSTRUMENTED_SYSTEM, StatsAlloc};

/// Counts, so that `penny bench` can show that a step does not allocate.
#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// A pocket-sized rigid-body simulator that reads MuJoCo's MJCF files.
#[derive(Parser)]
#[command(name = "penny", version, arg_required_else_help = true)]
#[command(override_usage = "penny SCENE.xml [OPTIONS]      the same as penny run\n       penny COMMAND …")]
#[command(after_help = "penny COMMAND --help lists the options of a command.")]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Simulate a scene (`run` may be left out: `penny SCENE.xml`)
    Run(run::Args),
    /// Report every problem of scene files; exit code 1 if there is an error
    Check(check::Args),
    /// Write a scene as canonical MJCF: classes, frames, replicas and includes resolved
    Convert(convert::Args),
    /// Say what a scene requires, and what its numbers mean in SI units
    Explain(explain::Args),
    /// Run a scene beside the real MuJoCo: differences and speed
    Compare(compare::Args),
    /// Measure nanoseconds per step of every law and integrator
    Bench(bench::Args),
    /// The interactive simulator and the game
    Play(play::Args),
    /// Pictures and videos, without a display
    Render(render::Args),
    /// Error against cost of every method, and stability maps
    Sweep(sweep::Args),
    /// Many worlds of a scene, each with a start and parameters of its own, on all cores
    Rollout(rollout::Args),
}

/// Where a command's report goes.
#[derive(Clone, Copy)]
enum Report {
    StandardOutput,
    /// Standard output has data.
    StandardError,
}

impl Report {
    fn print(self, text: &str) {
        match self {
            Report::StandardOutput => print!("{text}"),
            Report::StandardError => eprint!("{text}"),
        }
    }
}

/// Why a command ended early. Each holds all that there is to say.
enum Failure {
    /// The scene or the run has a problem: exit code 1.
    Problem(String),
    /// The command line asks for what cannot be: exit code 2.
    Usage(String),
    /// The scene has a problem, and the report says all: exit code 1.
    Told,
    /// A signal ended it, and all was told: this exit code.
    Interrupted(u8),
    /// Whoever read the output has enough (`| head`): nothing to say.
    Closed,
}

impl From<std::io::Error> for Failure {
    fn from(error: std::io::Error) -> Failure {
        match error.kind() {
            std::io::ErrorKind::BrokenPipe => Failure::Closed,
            _ => Failure::Problem(format!("error: {}", penny::reason(error))),
        }
    }
}

/// Writes to standard error what has no commands for a terminal, but the colours of reports where it is one.
fn say(text: &str) {
    let mut error = std::io::stderr().lock();
    if !std::io::stderr().is_terminal() {
        let _ = error.write_all(printable(text).as_bytes());
        return;
    }
    // A colour: ESC [ digits and semicolons m.
    for (i, part) in text.split("\u{1b}[").enumerate() {
        let code = part.find('m').filter(|&m| part[..m].bytes().all(|b| b.is_ascii_digit() || b == b';'));
        let before = match (i, code) {
            (0, _) => "",
            (_, Some(_)) => "\u{1b}[",
            (_, None) => "\\u{1b}[",
        };
        let _ = error.write_all(before.as_bytes()).and_then(|()| error.write_all(printable(part).as_bytes()));
    }
}

/// How often memory was allocated so far; `bench` reports the difference.
fn allocations() -> usize {
    let stats = ALLOCATOR.stats();
    stats.allocations + stats.reallocations
}

/// Lets what is freed serve again: the C library gives large pieces back to the system, and pays for each page of the next
/// one anew, until it has seen one as large as it goes (32 MiB) freed. This one is never touched.
fn keep_memory() {
    drop(std::hint::black_box(Vec::<u8>::with_capacity(31 << 20)));
}

fn main() -> ExitCode {
    keep_memory();
    let args = with_command(std::env::args_os().collect());
    let cli = Cli::try_parse_from(&args).unwrap_or_else(|error| {
        let _ = error.print();
        if let Some(tip) = unquoted(&args).filter(|_| error.kind() == ErrorKind::UnknownArgument) {
            eprintln!("\n  tip: {tip}");
        }
        std::process::exit(error.exit_code())
    });
    let outcome = match &cli.command {
        Command::Run(args) => run::run(args),
        Command::Check(args) => check::check(args),
        Command::Convert(args) => convert::convert(args),
        Command::Explain(args) => explain::explain(args),
        Command::Compare(args) => compare::compare(args),
        Command::Bench(args) => bench::bench(args, allocations),
        Command::Play(args) => play::play(args),
        Command::Render(args) => render::render(args),
        Command::Sweep(args) => sweep::sweep(args),
        Command::Rollout(args) => rollout::rollout(args),
    };
    let (text, code) = match outcome {
        Ok(()) | Err(Failure::Closed) => return ExitCode::SUCCESS,
        Err(Failure::Told) => return ExitCode::from(1),
        Err(Failure::Interrupted(code)) => return ExitCode::from(code),
        Err(Failure::Problem(text)) => (text, 1),
        Err(Failure::Usage(text)) => (text, 2),
    };
    eprintln!("{}", text.trim_end());
    ExitCode::from(code)
}

/// What to write where an option of several numbers was given them without quotes: `--qvel 2 0 0`.
fn unquoted(args: &[OsString]) -> Option<String> {
    let words: Vec<_> = args.iter().map(|a| a.to_string_lossy()).collect();
    let at = words.iter().position(|w| {
        matches!(&w[..], "--qpos" | "--qvel" | "--ctrl" | "--friction" | "--solref" | "--solimp" | "--gravity")
    })?;
    let numbers: Vec<_> = words[at + 1..].iter().take_while(|w| w.parse::<f64>().is_ok()).map(|w| &w[..]).collect();
    (numbers.len() > 1).then(|| format!("quote the numbers: {} \"{}\"", words[at], numbers.join(" ")))
}

/// Inserts `run` where the first argument is no command but a file or an option.
fn with_command(mut args: Vec<OsString>) -> Vec<OsString> {
    let own = ["-h", "--help", "-V", "--version"];
    let is_run = args.get(1).is_some_and(|first| {
        let text = first.to_string_lossy();
        let option = text.starts_with('-') && !own.contains(&text.as_ref());
        // A word that is neither stays: the command line's parser knows how to suggest the nearest command.
        option || text.contains(['.', '/', '\\']) || Path::new(first).exists()
    });
    if is_run {
        args.insert(1, "run".into());
    }
    args
}
