//! A recording as CSV: a header line, then a line a state.

use std::io::{Error, Result, Write};

use super::{Sample, columns, row};
use crate::model::Model;
use crate::state::State;

/// Writes each row as it comes, so that a run that ends early leaves what it had.
pub struct Csv<W: Write> {
    out: csv::Writer<W>,
}

impl<W: Write> Csv<W> {
    pub fn new(out: W, model: &Model) -> Result<Csv<W>> {
        let mut out = csv::Writer::from_writer(out);
        out.write_record(columns(model)).map_err(plain)?;
        Ok(Csv { out })
    }

    pub fn write(&mut self, state: &State, sample: &Sample) -> Result<()> {
        self.out.write_record(row(state, sample)).map_err(plain)
    }

    pub fn finish(mut self) -> Result<()> {
        self.out.flush()
    }
}

/// The error of the file or pipe itself, so that its kind can be asked.
fn plain(error: csv::Error) -> Error {
    match error.into_kind() {
        csv::ErrorKind::Io(error) => error,
        other => Error::other(format!("{other:?}")),
    }
}
