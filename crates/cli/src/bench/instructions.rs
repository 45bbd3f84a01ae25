//! `--instructions`: how many instructions of the processor a step takes, counted by valgrind's callgrind.
//!
//! Unlike a time it is the same on a busy machine. `penny bench` calls itself under callgrind, with `--counted` beside its own
//! arguments: one method of one scene, once as far as the state that is measured from and once this many steps further. The
//! difference is what the steps took.

use std::io::ErrorKind;
use std::process::{Command, Stdio};
use std::str::FromStr;

use super::Failure;

/// What a counted child does.
#[derive(Clone, Copy, Debug)]
pub struct Counted {
    /// Which of the methods of all scenes, in the order of the report.
    pub method: usize,
    /// Steps after the state that is measured from.
    pub steps: usize,
}

impl FromStr for Counted {
    type Err = String;

    fn from_str(text: &str) -> Result<Counted, String> {
        let number = |text: &str| text.parse().map_err(|_| "METHOD:STEPS, as penny bench itself writes it".to_owned());
        let (method, steps) = text.split_once(':').unwrap_or((text, ""));
        Ok(Counted { method: number(method)?, steps: number(steps)? })
    }
}

/// Instructions of one of this many steps.
pub fn per_step(method: usize, steps: usize) -> Result<f64, Failure> {
    let [before, after] = [0, steps].map(|steps| run(Counted { method, steps }));
    Ok((after? - before?) as f64 / steps as f64)
}

/// All instructions of a child.
fn run(counted: Counted) -> Result<i64, Failure> {
    let program =
        std::env::current_exe().map_err(|e| problem(format!("the program itself is not to be found: {e}")))?;
    // Right behind the word `bench`: what follows may end in names of files.
    let mut arguments = std::env::args_os().skip(1);
    let mut command = Command::new("valgrind");
    command.args(["--tool=callgrind", "--callgrind-out-file=/dev/null"]).arg(program).args(arguments.next());
    command.args(["--counted", &format!("{}:{}", counted.method, counted.steps)]).args(arguments).stdin(Stdio::null());
    let output = command.output().map_err(|e| match e.kind() {
        ErrorKind::NotFound => problem(
            "--instructions needs valgrind, which is not there\n  help: install it (apt install valgrind), or leave \
             --instructions out"
                .to_owned(),
        ),
        _ => problem(format!("valgrind does not start: {e}")),
    })?;
    let text = String::from_utf8_lossy(&output.stderr);
    let collected = text.lines().find_map(|line| line.split_once("Collected : ")?.1.trim().parse().ok());
    match collected {
        Some(sum) if output.status.success() => Ok(sum),
        _ => Err(problem(format!("valgrind did not count ({}):\n{}", output.status, text.trim_end()))),
    }
}

fn problem(text: String) -> Failure {
    Failure::Problem(format!("error: {text}"))
}
