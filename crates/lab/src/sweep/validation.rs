//! The closed forms as a table: truth, MuJoCo's recorded value, and what each contact law makes of it.

use serde::Deserialize;

use super::Case;
use super::cost;
use super::truth::{self, Truth};
use penny::contact::Law;
use penny::forward::Method;
use penny::integrate;
use penny::state::State;

/// A recorded case: `tests/golden/validation.json`.
#[derive(Deserialize)]
pub struct Record {
    pub name: String,
    pub truth: String,
    /// s
    pub seconds: f64,
    pub exact: f64,
    /// What MuJoCo 4.0.0 makes of it at tolerance 0.
    pub mujoco: f64,
    /// Of one of its steps, on the machine that recorded it.
    pub measured_ns: f64,
    pub xml: String,
}

/// A recorded case, ready to run.
pub struct Ready<'a> {
    pub record: &'a Record,
    pub case: Case,
    pub truth: &'static Truth,
}

impl Record {
    /// Compiles the scene and puts it at its start.
    pub fn ready(&self) -> Result<Ready<'_>, String> {
        let model = penny::parse(&self.name, &self.xml).map_err(|failure| failure.to_string())?.model;
        let truth = truth::by_name(&self.truth).ok_or_else(|| format!("no closed form `{}`", self.truth))?;
        let mut start = State::new(&model);
        if let Some(key) = model.keyframes.first() {
            start.qpos.clone_from(&key.qpos);
            start.qvel.clone_from(&key.qvel);
            start.ctrl.clone_from(&key.ctrl);
        }
        Ok(Ready { record: self, case: Case { model, start, seconds: self.seconds }, truth })
    }
}

impl Ready<'_> {
    /// The scene's own integrator and timestep under a law.
    pub fn method(&self, contact: &'static Law) -> Option<Method> {
        let opt = &self.case.model.opt;
        Some(Method {
            contact,
            integrator: integrate::by_name(&opt.integrator)?,
            timestep: opt.timestep,
            rounds: penny::forward::ROUNDS,
        })
    }

    /// Nanoseconds of one step under the method.
    pub fn cost(&self, method: &Method) -> f64 {
        cost::ns_per_step(&self.case, method, &cost::places(&self.case, method))
    }

    /// What the law makes of it; infinite where the run diverges.
    pub fn value(&self, method: &Method) -> f64 {
        self.truth.measure(&self.case, method).unwrap_or(f64::INFINITY)
    }
}
