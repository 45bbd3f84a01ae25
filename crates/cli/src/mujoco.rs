//! The real MuJoCo, through Python: a child that answers over a pipe.

use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

use serde_json::{Value, json};

use super::Failure;
use penny::forward::Method;
use penny::model::Model;
use penny::state::State;

const SCRIPT: &str = include_str!("mujoco.py");
/// Penny compares itself with this version.
const VERSION: &str = "4.0.0";
const INSTALL: &str = "  help: python3 -m venv .venv && .venv/bin/pip install mujoco==4.0.0\n  \
                       Penny finds .venv/bin/python by itself; elsewhere set PENNY_PYTHON=path/to/python";

/// How long Python may take to start, and to answer: a fixed part and a part for each step.
const START: Duration = Duration::from_secs(30);
const ANSWER: (Duration, Duration) = (Duration::from_secs(60), Duration::from_millis(5));
/// Bytes of an answer: a fixed part, and a part for each number that was asked for.
const MOST_BYTES: (usize, usize) = (1 << 20, 32);

pub struct MuJoCo {
    child: Child,
    requests: ChildStdin,
    /// The lines that the child writes, read by a thread of their own, so that waiting for one can end.
    answers: Receiver<String>,
    /// The longest line that is read. Longer ones are cut.
    most: Arc<AtomicUsize>,
    /// Numbers of a state: its positions.
    nq: usize,
}

/// Hands on lines, each cut at `most` bytes; ends with the output or after a line that was cut.
fn lines(output: ChildStdout, most: &AtomicUsize, send: &Sender<String>) {
    let mut output = BufReader::new(output);
    loop {
        let mut line = Vec::new();
        // Nothing comes before it was asked for; so the limit is that of this answer once its first byte is here.
        if output.fill_buf().is_ok_and(<[u8]>::is_empty) {
            return;
        }
        let limit = most.load(Ordering::SeqCst);
        let read = output.by_ref().take(limit as u64).read_until(b'\n', &mut line);
        let whole = line.last() == Some(&b'\n');
        if read.is_err() || send.send(String::from_utf8_lossy(&line).into_owned()).is_err() || !whole {
            return;
        }
    }
}

/// A scene as MuJoCo gets it.
pub enum Scene<'a> {
    Path(&'a Path),
    Text(&'a str),
}

impl MuJoCo {
    /// Starts Python and checks MuJoCo's version.
    pub fn start() -> Result<MuJoCo, Failure> {
        let python = python();
        // MuJoCo writes its log into the working directory: not the user's.
        let child = Command::new(&python)
            .args(["-c", SCRIPT])
            .current_dir(std::env::temp_dir())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        let missing =
            |why: String| Failure::Problem(format!("error: MuJoCo {VERSION} is needed, but {why}\n{INSTALL}"));
        let mut child = child.map_err(|e| missing(format!("{} does not start: {e}", python.display())))?;
        let (Some(requests), Some(answers)) = (child.stdin.take(), child.stdout.take()) else {
            return Err(missing("its pipes are closed".to_owned()));
        };
        let most = Arc::new(AtomicUsize::new(MOST_BYTES.0));
        let (send, received) = channel();
        let limit = most.clone();
        std::thread::spawn(move || lines(answers, &limit, &send));
        let mut mujoco = MuJoCo { child, requests, answers: received, most, nq: 0 };
        let hello = mujoco.answer(START).map_err(|why| match why {
            Failure::Problem(why) if why.contains("did not answer") => {
                missing(format!("{} did not answer within {} s", python.display(), START.as_secs()))
            }
            _ => missing(format!("{} has none", python.display())),
        })?;
        match hello["version"].as_str() {
            Some(VERSION) => Ok(mujoco),
            found => Err(missing(format!("{} has {}", python.display(), found.unwrap_or("none")))),
        }
    }

    /// Loads a scene and puts it into a state. `exact`: solver tolerance 0 instead of the scene's.
    pub fn load(
        &mut self,
        scene: &Scene,
        model: &Model,
        method: &Method,
        state: &State,
        exact: bool,
    ) -> Result<(), Failure> {
        let mut request = json!({
            "do": "load",
            "timestep": method.timestep,
            "integrator": counterpart(model, method),
            "exact": exact,
            "time": state.time,
            "qpos": state.qpos,
            "qvel": state.qvel,
            "ctrl": state.ctrl,
        });
        match scene {
            Scene::Path(path) => request["path"] = json!(std::fs::canonicalize(path)?),
            Scene::Text(text) => request["xml"] = json!(text),
        }
        self.nq = model.nq;
        self.ask(request, 0, 0).map(|_| ())
    }

    /// qpos at the start and after every `every` steps; shorter where MuJoCo called the run unstable.
    pub fn rollout(&mut self, steps: usize, every: usize) -> Result<Vec<Vec<f64>>, Failure> {
        let answer = self.ask(
            json!({ "do": "rollout", "steps": steps, "every": every }),
            steps,
            (steps / every.max(1) + 1).saturating_mul(self.nq + 1),
        )?;
        let row = |row: &Value| row.as_array().map(|r| r.iter().filter_map(Value::as_f64).collect());
        Ok(answer["rows"].as_array().map(|rows| rows.iter().filter_map(row).collect()).unwrap_or_default())
    }

    /// Steps to a typical state, from which batches start.
    pub fn warm(&mut self, steps: usize) -> Result<(), Failure> {
        self.ask(json!({ "do": "warm", "steps": steps }), steps, 0).map(|_| ())
    }

    /// Nanoseconds of `steps` steps from the state that [`MuJoCo::warm`] left, measured inside Python: of one world, or of
    /// all of `worlds` on this many threads.
    pub fn batch(&mut self, steps: usize, worlds: Option<[usize; 2]>) -> Result<f64, Failure> {
        let [worlds, threads] = worlds.unwrap_or_default();
        let request = json!({ "do": "batch", "steps": steps, "worlds": worlds, "threads": threads });
        let answer = self.ask(request, steps.saturating_mul(worlds.max(1)), 0)?;
        answer["ns"].as_f64().ok_or_else(|| gone("its answer has no time"))
    }

    /// `steps` that it will take, and `numbers` that the answer will have.
    fn ask(&mut self, request: Value, steps: usize, numbers: usize) -> Result<Value, Failure> {
        let most = MOST_BYTES.0.saturating_add(MOST_BYTES.1.saturating_mul(numbers));
        self.most.store(most, Ordering::SeqCst);
        writeln!(self.requests, "{request}").map_err(|e| gone(&e.to_string()))?;
        let steps = u32::try_from(steps).unwrap_or(u32::MAX);
        self.answer(ANSWER.0 + ANSWER.1.saturating_mul(steps))
    }

    fn answer(&mut self, patience: Duration) -> Result<Value, Failure> {
        let line = self.answers.recv_timeout(patience).map_err(|e| match e {
            RecvTimeoutError::Timeout => gone(&format!("it did not answer within {} s", patience.as_secs())),
            RecvTimeoutError::Disconnected => gone("it stopped answering"),
        })?;
        let answer: Value =
            serde_json::from_str(&line).map_err(|_| gone("its answer cannot be read, or is too long"))?;
        match answer["error"].as_str() {
            Some(error) => {
                let error: String = error.chars().take(2000).collect();
                Err(Failure::Problem(format!("error: MuJoCo says: {error}")))
            }
            None => Ok(answer),
        }
    }
}

impl Drop for MuJoCo {
    fn drop(&mut self) {
        // It waits for the next request; nothing is lost.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn gone(why: &str) -> Failure {
    Failure::Problem(format!("error: MuJoCo's Python process failed: {why}"))
}

/// MuJoCo's keyword for the integrator; the scene's own where MuJoCo has no such integrator.
pub fn counterpart(model: &Model, method: &Method) -> String {
    let own = &model.opt.integrator;
    let listed = method.integrator.mjcf;
    if listed.contains(&own.as_str()) { own.clone() } else { listed.first().unwrap_or(&own.as_str()).to_string() }
}

/// `PENNY_PYTHON`, or a virtual environment here, or the system's.
fn python() -> PathBuf {
    let here = || std::env::current_dir().ok().map(|d| d.join(".venv/bin/python")).filter(|p| p.exists());
    let named = std::env::var_os("PENNY_PYTHON").map(PathBuf::from);
    // The child starts elsewhere: a relative path must not depend on it.
    let named = named.map(|p| if p.components().count() > 1 { std::path::absolute(&p).unwrap_or(p) } else { p });
    named.or_else(here).unwrap_or_else(|| PathBuf::from("python3"))
}
