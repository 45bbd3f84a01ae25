//! What a run writes: CSV, JSON, Parquet, and the states that a chart is drawn from.

use std::io;
use std::path::{Path, PathBuf};

use super::Args;
use crate::Failure;
use crate::files;
use penny::draft::Draft;
use penny::forward::Method;
use penny::model::Model;
use penny::state::State;
#[cfg(feature = "parquet")]
use penny_lab::record;
use penny_lab::record::{Csv, Json, Lines, Picture, Quantity, Sample};

/// The files, or standard output, that the run is written to.
pub struct Outputs<'a> {
    csv: Option<(&'a Path, Csv)>,
    json: Option<(&'a Path, Json)>,
    columns: Option<(&'a Path, Columns)>,
    /// What a chart will be drawn from.
    pub picture: Option<Picture>,
}

impl Outputs<'_> {
    pub fn open<'a>(
        args: &'a Args,
        model: &Model,
        method: &Method,
        shown: &[Quantity],
    ) -> Result<Outputs<'a>, Failure> {
        let csv = |path: &'a PathBuf| {
            let csv = create(path).and_then(|out| Csv::new(out, model, shown));
            csv.map(|csv| (path.as_path(), csv)).map_err(|e| files::cannot_write(path, &e))
        };
        let json = |path: &'a PathBuf| {
            let json = create(path).and_then(|out| Json::new(out, model, method, shown));
            json.map(|json| (path.as_path(), json)).map_err(|e| files::cannot_write(path, &e))
        };
        Ok(Outputs {
            csv: args.csv.as_ref().map(csv).transpose()?,
            json: args.json.as_ref().map(json).transpose()?,
            columns: args
                .parquet
                .as_deref()
                .map(|path| Columns::open(path, model, method, shown).map(|columns| (path, columns)))
                .transpose()?,
            picture: args.plot.as_ref().map(|_| Picture::new(model, shown)),
        })
    }

    pub fn any(&self) -> bool {
        self.csv.is_some() || self.json.is_some() || self.columns.is_some() || self.picture.is_some()
    }

    pub fn write(&mut self, state: &State, sample: &Sample, values: &[f64]) -> Result<(), Failure> {
        if let Some((path, csv)) = &mut self.csv {
            csv.write(state, sample, values).map_err(|e| files::cannot_write(path, &e))?;
        }
        if let Some((path, json)) = &mut self.json {
            json.write(state, sample, values).map_err(|e| files::cannot_write(path, &e))?;
        }
        if let Some((path, columns)) = &mut self.columns {
            columns.write(state, sample, values).map_err(|e| files::cannot_write(path, &e))?;
        }
        Ok(())
    }

    /// Writes rows that have waited for half a second.
    pub fn tick(&mut self) -> Result<(), Failure> {
        if let Some((path, csv)) = &mut self.csv {
            csv.tick().map_err(|e| files::cannot_write(path, &e))?;
        }
        if let Some((path, json)) = &mut self.json {
            json.tick().map_err(|e| files::cannot_write(path, &e))?;
        }
        Ok(())
    }

    /// Completes the files; what is left is to draw the picture.
    pub fn finish(self) -> Result<Option<Picture>, Failure> {
        if let Some((path, csv)) = self.csv {
            csv.finish().map_err(|e| files::cannot_write(path, &e))?;
        }
        if let Some((path, json)) = self.json {
            json.finish().map_err(|e| files::cannot_write(path, &e))?;
        }
        if let Some((path, columns)) = self.columns {
            columns.finish().map_err(|e| files::cannot_write(path, &e))?;
        }
        Ok(self.picture)
    }
}

/// A file of columns, complete at its end.
#[cfg(feature = "parquet")]
struct Columns {
    draft: Option<Draft>,
    columns: record::Parquet,
}

#[cfg(feature = "parquet")]
impl Columns {
    fn open(path: &Path, model: &Model, method: &Method, shown: &[Quantity]) -> Result<Columns, Failure> {
        let open = || {
            let draft = if path == Path::new("-") { None } else { Some(Draft::new(path)?) };
            let out: Box<dyn io::Write + Send> = match &draft {
                None => Box::new(io::stdout()),
                Some(draft) => Box::new(draft.open()?),
            };
            Ok(Columns { draft, columns: record::Parquet::new(out, model, method, shown)? })
        };
        open().map_err(|e: io::Error| files::cannot_write(path, &e))
    }

    fn write(&mut self, state: &State, sample: &Sample, values: &[f64]) -> io::Result<()> {
        self.columns.write(state, sample, values)
    }

    fn finish(self) -> io::Result<()> {
        self.columns.finish()?;
        self.draft.map_or(Ok(()), Draft::keep)
    }
}

/// What stands in its place in a build without.
#[cfg(not(feature = "parquet"))]
enum Columns {}

#[cfg(not(feature = "parquet"))]
impl Columns {
    fn open(_: &Path, _: &Model, _: &Method, _: &[Quantity]) -> Result<Columns, Failure> {
        let why = "error: --parquet: this penny was built without it: `cargo run --features parquet -- SCENE.xml --parquet \
                   FILE` builds it; --csv and --json need nothing";
        Err(Failure::Problem(why.to_owned()))
    }

    fn write(&mut self, _: &State, _: &Sample, _: &[f64]) -> io::Result<()> {
        match *self {}
    }

    fn finish(self) -> io::Result<()> {
        match self {}
    }
}

fn create(path: &Path) -> io::Result<Lines> {
    if path == Path::new("-") { Ok(Lines::stream(io::stdout())) } else { Lines::file(Draft::new(path)?) }
}
