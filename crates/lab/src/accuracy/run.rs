//! A chosen method carried out: the states at the times that are asked for.

use super::{Choice, Stepping};
use crate::sweep::Case;
use penny::control::{Controlled, Failed};
use penny::data::Data;
use penny::forward::{Method, StepError, step};
use penny::model::Model;
use penny::state::State;

/// A run by the method of a [`Choice`]. Its steps do not depend on the times at which one looks.
pub struct Run<'m> {
    model: &'m Model,
    method: Method,
    way: Way<'m>,
}

enum Way<'m> {
    /// Where the last step began and where it led, for steps and for looks.
    Fixed(Box<[(State, Data); 2]>),
    /// And the most steps that it may take.
    Controlled(Box<Controlled<'m>>, usize),
}

/// A controlled run that takes more than this many times the steps of its trial is given up: it is another motion.
const MORE: usize = 10;

impl Choice {
    /// How many controlled steps a run may take before it is given up.
    pub fn most_steps(&self) -> usize {
        MORE * self.steps.max(1)
    }

    /// The run that was chosen, or one from another start or for another time (s).
    ///
    /// Errors: start or time do not suit the model.
    pub fn run<'m>(&self, model: &'m Model, start: &State, seconds: f64) -> Result<Run<'m>, Failed> {
        let way = match self.stepping {
            Stepping::Fixed(_) => {
                start.suits(model).map_err(|wrong| Failed::Step(StepError::State(wrong)))?;
                Way::Fixed(Box::new([0, 1].map(|_| (start.clone(), Data::new(model)))))
            }
            Stepping::Controlled(tolerance) => {
                let run = Controlled::new(model, &self.method, start, tolerance, start.time + seconds)?;
                Way::Controlled(Box::new(run), self.most_steps())
            }
        };
        Ok(Run { model, method: self.method, way })
    }

    /// The states of a case at times that only grow, s.
    ///
    /// Errors: a step failed; a time is before the one before it, or behind the end of controlled steps.
    pub fn states(&self, case: &Case, times: &[f64]) -> Result<Vec<State>, Failed> {
        let mut run = self.run(&case.model, &case.start, case.seconds)?;
        times.iter().map(|time| run.at(*time)).collect()
    }
}

/// Part of a step that is none.
const NOTHING: f64 = 1e-6;

impl Run<'_> {
    /// The state at a finite time, not before the one asked for last, s.
    ///
    /// Errors: see [`Choice::states`].
    pub fn at(&mut self, time: f64) -> Result<State, Failed> {
        let Run { model, method, way } = self;
        let [(before, look), (state, data)] = match way {
            Way::Controlled(run, most) => return run.at(time, *most),
            Way::Fixed(ends) => &mut **ends,
        };
        let tiny = NOTHING * method.timestep;
        if !time.is_finite() || time < before.time - tiny {
            return Err(Failed::Outside(time, [before.time, f64::INFINITY]));
        }
        while state.time < time - tiny {
            before.copy_from(state);
            step(model, method, state, data).map_err(Failed::Step)?;
        }
        let part = time - before.time;
        if (state.time - time).abs() <= tiny || part <= tiny {
            let at = if part <= tiny { &*before } else { &*state };
            return Ok(State { time, ..at.clone() });
        }
        let mut found = before.clone();
        step(model, &Method { timestep: part, ..*method }, &mut found, look).map_err(Failed::Step)?;
        Ok(found)
    }
}
