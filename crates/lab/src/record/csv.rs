//! A recording as CSV: a header line, then a line a state.

use std::io::Result;

use super::{Lines, Quantity, Sample, columns, row};
use penny::model::Model;
use penny::state::State;

/// Writes rows as they come, so that a run that ends early leaves what it had.
pub struct Csv {
    out: Lines,
}

impl Csv {
    pub fn new(out: Lines, model: &Model, quantities: &[Quantity]) -> Result<Csv> {
        let names: Vec<String> = columns(model, quantities).iter().map(|name| quoted(name)).collect();
        let header = names.join(",") + "\n";
        Ok(Csv { out: out.begin(&header, "")? })
    }

    pub fn write(&mut self, state: &State, sample: &Sample, values: &[f64]) -> Result<()> {
        let row: Vec<String> = row(state, sample, values).collect();
        self.out.push(&(row.join(",") + "\n"))
    }

    /// Writes rows that have waited for half a second.
    pub fn tick(&mut self) -> Result<()> {
        self.out.tick()
    }

    pub fn finish(self) -> Result<()> {
        self.out.finish()
    }
}

/// A name as CSV has it (RFC 4180): in quotes if it holds a comma, a quote or the end of a line.
pub fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) { format!("\"{}\"", name.replace('"', "\"\"")) } else { name.to_owned() }
}
