//! Rows until all are there, and the settings that they were run with, by which another rollout is recognised.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufRead, BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::{Args, Plan, Values};
use crate::Failure;
use crate::files;
use penny::draft;
use penny::forward::Method;
use penny::model::Model;
use penny::state::State;
use penny_view::fnv::Fnv;

/// Settings that are compared as a hash, and what is said where it differs.
const HASHES: [(&str, &str); 4] = [
    (SCENE, "the scene has changed since"),
    (OVERRIDES, "--friction, --solref, --solimp or --gravity was different"),
    (START, "--key, --load-state, --qpos, --qvel or --ctrl was different"),
    (TABLE, "--table was different, or had other columns or values"),
];
const SCENE: &str = "scene";
const OVERRIDES: &str = "overrides";
const START: &str = "start";
const TABLE: &str = "table";

/// The two files beside the one to be.
pub struct Unfinished {
    out: PathBuf,
    pub rows: PathBuf,
    settings: PathBuf,
}

impl Unfinished {
    pub fn of(out: &Path) -> Unfinished {
        let name = out.file_name().unwrap_or_default().to_string_lossy();
        let rows = out.with_file_name(format!("{name}.unfinished"));
        Unfinished { out: out.to_owned(), rows, settings: out.with_file_name(format!("{name}.unfinished.json")) }
    }

    /// The rows, begun anew or to be gone on with, and how many worlds they have.
    ///
    /// Errors: they cannot be read or written; another rollout writes them; there are some and nobody said what is to become of
    /// them; they are of another rollout; all that is to be continued is finished.
    pub fn open(
        &self,
        settings: &Value,
        header: &str,
        resume: bool,
        worlds: usize,
    ) -> Result<(BufWriter<File>, usize), Failure> {
        let path = &self.rows;
        let cannot = |e: io::Error| files::cannot_write(path, &e);
        if !path.exists() {
            if resume && self.out.exists() {
                let why = format!(
                    "error: {} is finished, so there is nothing to continue: leave --resume out to replace it, or name another \
                     --out",
                    self.out.display()
                );
                return Err(Failure::Usage(why));
            }
            // The settings first: there are no rows without, whenever this ends.
            draft::write(&self.settings, format!("{settings:#}\n"))
                .map_err(|e| files::cannot_write(&self.settings, &e))?;
            let file = OpenOptions::new().append(true).create_new(true).open(path).inspect_err(|e| {
                // Not another rollout's that came first.
                if e.kind() != io::ErrorKind::AlreadyExists {
                    self.remove();
                }
            });
            let file = file.map_err(cannot)?;
            draft::lock(&file).map_err(cannot)?;
            let mut out = BufWriter::new(file);
            writeln!(out, "{header}").map_err(cannot).inspect_err(|_| self.remove())?;
            return Ok((out, 0));
        }
        if !resume {
            if let Ok(file) = File::open(path) {
                draft::lock(&file).map_err(cannot)?;
            }
            let why = format!(
                "error: {} is there, from a rollout that was interrupted: --resume continues it; remove it to begin anew",
                path.display()
            );
            return Err(Failure::Usage(why));
        }
        self.recognise(settings)?;
        // Whole lines only: the last one may have been cut.
        let unread =
            |e: io::Error| Failure::Problem(format!("error: cannot read `{}`: {}", path.display(), penny::reason(e)));
        let mut reader = BufReader::new(File::open(path).map_err(unread)?);
        let (mut line, mut length, mut rows) = (Vec::new(), 0, 0);
        while reader.read_until(b'\n', &mut line).map_err(unread)? > 0 && line.ends_with(b"\n") {
            let right = match length {
                0 => line.trim_ascii_end() == header.as_bytes(),
                _ => line.starts_with(format!("{rows},").as_bytes()),
            };
            if !right {
                return Err(self.another("its columns or worlds are different"));
            }
            rows += usize::from(length > 0);
            length += line.len() as u64;
            line.clear();
        }
        if rows > worlds {
            return Err(self.another(&format!("it has {rows} worlds already, now there are {worlds}")));
        }
        let file = OpenOptions::new().append(true).open(path).map_err(cannot)?;
        draft::lock(&file).map_err(cannot)?;
        file.set_len(length).map_err(cannot)?;
        let mut out = BufWriter::new(file);
        if length == 0 {
            writeln!(out, "{header}").map_err(cannot)?;
        }
        Ok((out, rows))
    }

    /// Errors: the rows that are there had other settings, or it is not known which.
    fn recognise(&self, settings: &Value) -> Result<(), Failure> {
        let unknown = |why: &str| {
            let (rows, settings) = (self.rows.display(), self.settings.display());
            let help = format!("remove {rows} to begin anew");
            Failure::Usage(format!(
                "error: {rows} cannot be continued: {settings}, which says how its worlds were run, {why}; {help}"
            ))
        };
        let text = fs::read_to_string(&self.settings).map_err(|_| unknown("cannot be read"))?;
        let before: Value = serde_json::from_str(&text).map_err(|_| unknown("is damaged"))?;
        let had = before.as_object().ok_or_else(|| unknown("is damaged"))?;
        // Of a scene that has changed the rest differs, too.
        let keys = settings.as_object().into_iter().flatten().map(|(key, _)| key.as_str());
        let mut keys = HASHES.iter().map(|(hash, _)| *hash).chain(keys);
        let Some(key) = keys.find(|key| had.get(*key) != settings.get(*key)) else { return Ok(()) };
        Err(self.another(&match HASHES.iter().find(|(hash, _)| *hash == key) {
            Some((_, what)) => (*what).to_owned(),
            None => format!("it had {key} {}, now {}", told(&before[key]), told(&settings[key])),
        }))
    }

    fn another(&self, what: &str) -> Failure {
        let path = self.rows.display();
        let help = "give what it was begun with, remove it to begin anew, or name another --out";
        Failure::Usage(format!("error: {path} is of another rollout: {what}; {help}"))
    }

    /// The rows are the result.
    pub fn keep(&self) -> Result<(), Failure> {
        fs::rename(&self.rows, &self.out).map_err(|e| files::cannot_write(&self.out, &e))?;
        self.remove();
        Ok(())
    }

    /// The rows first: none are left without their settings.
    pub fn remove(&self) {
        for path in [&self.rows, &self.settings] {
            let _ = fs::remove_file(path);
        }
    }
}

/// As one would type it.
fn told(value: &Value) -> String {
    match value {
        Value::Null => "none".to_owned(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

/// All that rows depend on, but the number of worlds, which may grow. Numbers are texts: as many digits as tell them apart.
///
/// In: the scene as it was read, with its overrides, how it is computed, its start, and for how long (s).
pub fn settings(
    args: &Args,
    [read, model]: [&Model; 2],
    method: &Method,
    start: &State,
    seconds: f64,
    plan: &Plan,
) -> Value {
    let random = match &plan.values {
        Values::Random { ranges, .. } => {
            let range = |(name, [a, b]): (&String, &[f64; 2])| format!("{name}={a}..{b}");
            plan.names.iter().zip(ranges).map(range).collect::<Vec<_>>().join(" ")
        }
        Values::Table(_) => String::new(),
    };
    let hash = |thing: &dyn std::fmt::Debug| Fnv::of_debug(thing).to_string();
    let table = match &plan.values {
        Values::Table(rows) => Some(hash(&(&plan.names, rows))),
        Values::Random { .. } => None,
    };
    json!({
        SCENE: hash(&**read),
        OVERRIDES: hash(&**model),
        START: hash(start),
        TABLE: table,
        "--contact": method.contact.name,
        "--integrator": method.integrator.name,
        "--timestep": method.timestep.to_string(),
        "--rounds": method.rounds.to_string(),
        "--time": seconds.to_string(),
        "--accuracy": args.accuracy.accuracy.map(|m| m.to_string()),
        "--vary": Some(random).filter(|text| !text.is_empty()),
        "--seed": plan.seed().map(|seed| seed.to_string()),
    })
}
