//! Who looks at the states of a run: its files, its table, and what warns of energy and speed.

use super::BATCH;
use super::outputs::Outputs;
use super::table::Table;
use super::warnings::EnergyGain;
use crate::Failure;
use crate::doubts;
use penny::forward::Method;
use penny::model::Model;
use penny::state::State;
use penny_lab::explain::Touch;
use penny_lab::record::{Picture, Quantity, Recorder, Sample};

/// Lines of the table over time.
const LINES: usize = 10;
/// Looks at the energy in a run, at least.
pub const LOOKS: usize = 200;

/// Looks at the states of a run as often as each of its readers needs them.
pub struct Watch<'a> {
    model: &'a Model,
    method: &'a Method,
    steps: usize,
    /// Steps between rows of the files, lines of the table, and looks at the energy.
    every: usize,
    stride: usize,
    look: usize,
    touches: &'a [Touch],
    /// Quantities in the files, and in the chart.
    shown: &'a [Quantity],
    drawn: Vec<Quantity>,
    pub outputs: Outputs<'a>,
    pub recorder: Recorder,
    pub table: Table,
    pub energy: EnergyGain,
    /// The last state that was looked at.
    pub last: Sample,
    /// From when on the energy was no number, s.
    pub overflow: Option<f64>,
    /// The warning of what is too fast, once it was given.
    fast: Option<String>,
}

impl<'a> Watch<'a> {
    /// For a run of `steps` steps with a row for every `every` of them; `first` is its start.
    pub fn new(
        model: &'a Model,
        method: &'a Method,
        steps: usize,
        every: usize,
        touches: &'a [Touch],
        shown: &'a [Quantity],
        outputs: Outputs<'a>,
        recorder: Recorder,
        first: Sample,
    ) -> Watch<'a> {
        let [stride, look] = [LINES, LOOKS].map(|n| steps.div_ceil(n).max(1));
        let drawn = outputs.picture.as_ref().map(Picture::quantities).unwrap_or_default();
        let (table, energy) = (Table::new(model, shown), EnergyGain::new(model, &first));
        let (last, overflow, fast) = (first, None, None);
        Watch {
            model,
            method,
            steps,
            every,
            stride,
            look,
            touches,
            shown,
            drawn,
            outputs,
            recorder,
            table,
            energy,
            last,
            overflow,
            fast,
        }
    }

    /// The first step after `i` at which there is something to do.
    pub fn next(&self, i: usize) -> usize {
        let row = if self.outputs.any() { self.every } else { BATCH };
        [row, self.stride, self.look].into_iter().fold(usize::MAX, |next, n| next.min((i / n + 1) * n))
    }

    /// Looks at the state after step `i`.
    ///
    /// Errors: a file could not be written.
    pub fn look(&mut self, i: usize, state: &State) -> Result<(), Failure> {
        let (model, method) = (self.model, self.method);
        let ends = i == self.steps;
        let written = self.outputs.any() && i.is_multiple_of(self.every);
        let (listed, looked) = (i.is_multiple_of(self.stride) || ends, i.is_multiple_of(self.look) || ends);
        if !(written || listed || looked) {
            return Ok(());
        }
        let sample = self.recorder.sample(model, state);
        if written {
            let values = self.recorder.values(model, method, state, &sample, self.shown);
            self.outputs.write(state, &sample, &values)?;
            if let Some(picture) = &mut self.outputs.picture {
                let values = self.recorder.values(model, method, state, &sample, &self.drawn);
                picture.push(state, &sample, &values);
            }
        }
        if listed {
            let values = self.recorder.values(model, method, state, &sample, self.table.quantities());
            self.table.push(state, &sample, values);
        }
        if looked {
            self.recorder.forces(model, method, state);
            self.energy.enter(model, state, &sample, self.recorder.data());
            if self.fast.is_none() {
                let left = (self.steps - i) as f64 * method.timestep;
                self.fast = doubts::tunnels(model, method, state, self.recorder.data(), self.touches, left);
                eprint!("{}", self.fast.as_deref().unwrap_or_default());
            }
        }
        if !sample.energy.is_finite() {
            self.overflow = self.overflow.or(Some(state.time));
        }
        self.last = sample;
        Ok(())
    }
}
