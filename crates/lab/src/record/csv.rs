//! A recording as CSV: a header line, then a line a state.

use std::io::Result;

use super::{Lines, Sample, columns, row};
use penny::model::Model;
use penny::state::State;

/// Writes rows as they come, so that a run that ends early leaves what it had. Names and numbers need no quotes.
pub struct Csv {
    out: Lines,
}

impl Csv {
    pub fn new(out: Lines, model: &Model) -> Result<Csv> {
        let header = columns(model).join(",") + "\n";
        Ok(Csv { out: out.begin(&header, "")? })
    }

    pub fn write(&mut self, state: &State, sample: &Sample) -> Result<()> {
        let row: Vec<String> = row(state, sample).collect();
        self.out.push(&(row.join(",") + "\n"))
    }

    pub fn finish(self) -> Result<()> {
        self.out.finish()
    }
}
