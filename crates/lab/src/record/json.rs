//! A recording as JSON: `{"model", "contact", "integrator", "timestep", "columns": […], "rows": [[…], …]}`.

use std::io::Result;

use super::{Lines, Quantity, Sample, columns, row};
use penny::forward::Method;
use penny::model::Model;
use penny::state::State;

/// Writes rows as they come; the file is valid JSON at any time. JSON has no number for what is not finite: it becomes
/// `null`.
pub struct Json {
    out: Lines,
    first: bool,
}

impl Json {
    pub fn new(out: Lines, model: &Model, method: &Method, quantities: &[Quantity]) -> Result<Json> {
        let mut head = serde_json::json!({
            "model": model.name,
            "contact": method.contact.name,
            "integrator": method.integrator.name,
            "timestep": method.timestep,
            "columns": columns(model, quantities),
        });
        if !quantities.is_empty() {
            // Of the chosen columns, the last ones.
            head["units"] = quantities.iter().map(|q| q.unit).collect();
        }
        // The object stays open: rows follow.
        let head = head.to_string();
        let head = format!("{},\"rows\":[", &head[..head.len() - 1]);
        Ok(Json { out: out.begin(&head, "\n]}\n")?, first: true })
    }

    pub fn write(&mut self, state: &State, sample: &Sample, values: &[f64]) -> Result<()> {
        let comma = if std::mem::take(&mut self.first) { "" } else { "," };
        let finite = |x: String| if x.contains(['N', 'i']) { "null".to_owned() } else { x };
        let row: Vec<String> = row(state, sample, values).map(finite).collect();
        self.out.push(&format!("{comma}\n[{}]", row.join(",")))
    }

    /// Writes rows that have waited for half a second.
    pub fn tick(&mut self) -> Result<()> {
        self.out.tick()
    }

    pub fn finish(self) -> Result<()> {
        self.out.finish()
    }
}
