//! What a sweep leaves in its directory, and how an interrupted one goes on.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::Failure;
use crate::files::cannot_write;
use penny::draft;
use penny_lab::sweep::grid::{Row, Target};
use penny_lab::sweep::reference::Reference;

/// What an earlier sweep left in a directory.
#[derive(Default)]
pub struct Earlier {
    rows: Vec<Row>,
    pub references: BTreeMap<String, Reference>,
}

impl Earlier {
    /// Errors: none is there, it is damaged, or it had other settings.
    pub fn read(directory: &Path, settings: &Value) -> Result<Earlier, Failure> {
        let place = directory.display();
        let text = fs::read_to_string(directory.join(JSON))
            .map_err(|_| Failure::Usage(format!("error: there is no sweep in {place} to resume")))?;
        let damaged = |file: &str, why: String| {
            let help = "leave out --resume to begin anew";
            Failure::Problem(format!("error: {} is damaged: {why}; {help}", directory.join(file).display()))
        };
        let before: Value = serde_json::from_str(&text).map_err(|e| damaged(JSON, e.to_string()))?;
        let Some(had) = before["settings"].as_object() else {
            return Err(damaged(JSON, "it has no settings".to_owned()));
        };
        if let Some((key, now)) =
            settings.as_object().into_iter().flatten().find(|(key, now)| had.get(*key) != Some(*now))
        {
            let then = had.get(key).unwrap_or(&Value::Null);
            let what = match key.as_str() {
                "hash" => "the scene has changed since".to_owned(),
                _ => format!("it had {key} {then}, now {now}"),
            };
            let help = "leave out --resume to begin anew, or name another --out";
            return Err(Failure::Usage(format!("error: the sweep in {place} is another one: {what}; {help}")));
        }
        let mut reader = csv::Reader::from_path(directory.join(CSV)).map_err(|e| damaged(CSV, e.to_string()))?;
        // The last line may be half a line.
        let rows = reader.deserialize().filter_map(Result::ok).collect();
        Ok(Earlier { rows, references: serde_json::from_value(before["references"].clone()).unwrap_or_default() })
    }
}

const CSV: &str = "sweep.csv";
const JSON: &str = "sweep.json";
/// All files of a sweep.
pub const ALL: [&str; 4] = [CSV, JSON, PICTURES[0], PICTURES[1]];
pub const PICTURES: [&str; 2] = ["sweep.svg", "sweep.png"];

/// Moves what an earlier sweep left into a folder of its own.
fn set_aside(directory: &Path) -> Result<(), Failure> {
    let rows = fs::read_to_string(directory.join(CSV)).map_or(0, |text| text.lines().skip(1).count());
    if rows == 0 {
        return Ok(());
    }
    let free = |n: &usize| !directory.join(format!("earlier-{n}")).exists();
    let Some(n) = (1..).find(free) else { return Ok(()) };
    let aside = directory.join(format!("earlier-{n}"));
    fs::create_dir(&aside).map_err(cannot(&aside))?;
    for file in [CSV, JSON].into_iter().chain(PICTURES).filter(|file| directory.join(file).exists()) {
        fs::rename(directory.join(file), aside.join(file)).map_err(cannot(&aside))?;
    }
    eprintln!("{}: the earlier sweep ({rows} rows) is now in {}", directory.display(), aside.display());
    Ok(())
}

/// Says of a path that it cannot be written, and why.
pub fn cannot(path: &Path) -> impl Fn(std::io::Error) -> Failure {
    move |e| cannot_write(path, &e)
}

/// What a sweep writes while it runs.
pub struct Files {
    csv: PathBuf,
    json: PathBuf,
    /// Settings and references.
    head: Value,
    pub rows: Vec<Row>,
}

impl Files {
    /// Begins anew, or goes on with what is there.
    pub fn open(
        directory: &Path,
        settings: Value,
        target: &Target,
        earlier: Earlier,
        resume: bool,
    ) -> Result<Files, Failure> {
        if !resume {
            set_aside(directory)?;
        }
        let references = match target {
            Target::Poses(references) => json!(references),
            Target::Exact(_) => json!({}),
        };
        let head = json!({ "settings": settings, "references": references });
        let files = Files { csv: directory.join(CSV), json: directory.join(JSON), head, rows: earlier.rows };
        files.write_json(false, &[], &[]).and_then(|()| files.rewrite(&files.rows)).map_err(cannot(directory))?;
        Ok(files)
    }

    pub fn append(&mut self, row: Row) -> std::io::Result<()> {
        let mut file = fs::OpenOptions::new().append(true).open(&self.csv)?;
        let whole = file.metadata()?.len();
        // No room: the last row is a whole one.
        let written = file.write_all(&lines(std::slice::from_ref(&row), self.rows.is_empty())?);
        written.inspect_err(|_| drop(file.set_len(whole)))?;
        self.rows.push(row);
        Ok(())
    }

    /// All rows anew.
    pub fn rewrite(&self, rows: &[Row]) -> std::io::Result<()> {
        draft::write(&self.csv, lines(rows, true)?)
    }

    fn write_json(&self, finished: bool, notes: &[String], rows: &[Row]) -> std::io::Result<()> {
        let mut document = self.head.clone();
        document["finished"] = json!(finished);
        document["truth"] = json!(notes);
        document["rows"] = json!(rows);
        draft::write(&self.json, format!("{document:#}\n"))
    }

    pub fn finish(&self, notes: &[String], rows: &[Row]) -> Result<(), Failure> {
        self.write_json(true, notes, rows).map_err(cannot(&self.json))
    }
}

fn lines(rows: &[Row], header: bool) -> std::io::Result<Vec<u8>> {
    let mut writer = csv::WriterBuilder::new().has_headers(header).from_writer(Vec::new());
    rows.iter().try_for_each(|row| writer.serialize(row))?;
    writer.into_inner().map_err(|e| std::io::Error::other(e.to_string()))
}
