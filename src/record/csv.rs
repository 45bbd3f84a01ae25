//! A recording as CSV: a header line, then a line a state.

use std::io::{Result, Write};

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
        out.write_record(columns(model))?;
        Ok(Csv { out })
    }

    pub fn write(&mut self, state: &State, sample: &Sample) -> Result<()> {
        Ok(self.out.write_record(row(state, sample))?)
    }

    pub fn finish(mut self) -> Result<()> {
        self.out.flush()
    }
}
