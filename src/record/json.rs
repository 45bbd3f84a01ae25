//! A recording as JSON: `{"model", "contact", "integrator", "timestep", "columns": […], "rows": [[…], …]}`.

use std::io::{Result, Write};

use super::{Sample, columns, row};
use crate::forward::Method;
use crate::model::Model;
use crate::state::State;

/// Writes each row as it comes. JSON has no number for what is not finite: it becomes `null`.
pub struct Json<W: Write> {
    out: W,
    first: bool,
}

impl<W: Write> Json<W> {
    pub fn new(mut out: W, model: &Model, method: &Method) -> Result<Json<W>> {
        let head = serde_json::json!({
            "model": model.name,
            "contact": method.contact.name,
            "integrator": method.integrator.name,
            "timestep": method.timestep,
            "columns": columns(model),
        });
        // The object stays open: rows follow.
        let head = head.to_string();
        write!(out, "{},\"rows\":[", &head[..head.len() - 1])?;
        Ok(Json { out, first: true })
    }

    pub fn write(&mut self, state: &State, sample: &Sample) -> Result<()> {
        let comma = if std::mem::take(&mut self.first) { "" } else { "," };
        let finite = |x: String| if x.contains(['N', 'i']) { "null".to_owned() } else { x };
        let row: Vec<String> = row(state, sample).map(finite).collect();
        write!(self.out, "{comma}\n[{}]", row.join(","))
    }

    pub fn finish(mut self) -> Result<()> {
        writeln!(self.out, "\n]}}")?;
        self.out.flush()
    }
}
