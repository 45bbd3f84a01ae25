//! `--accuracy`: the cheapest method that has it, what it costs, and for how long results can be trusted.

use std::time::Duration;

use super::Failure;
use super::format::{count, short, si};
use super::scene;
use indicatif::{ProgressBar, ProgressFinish};
use penny::control::{Controlled, Failed};
use penny::data::Data;
use penny::forward::{Method, step};
use penny::model::Model;
use penny::state::State;
use penny_lab::accuracy::horizon::{self, Growth};
use penny_lab::accuracy::{self, Choice, Refusal, Stepping};
use penny_lab::explain::Budget;
use penny_lab::sweep::Case;

#[derive(clap::Args, Clone)]
pub struct AccuracyArgs {
    /// Find the cheapest method that keeps every body this near to the contact law's exact motion over the whole run (m; rad
    /// times the body's reach), use it, and say what it costs
    #[arg(long, value_name = "M", value_parser = scene::length, allow_hyphen_values = true)]
    #[arg(conflicts_with_all = ["integrator", "rounds"])]
    pub accuracy: Option<f64>,
}

/// Real time that the search may take, s.
const SEARCH: f64 = 60.0;

/// What was chosen.
pub struct Chosen {
    /// The method; of controlled steps its timestep is that of the rows.
    pub method: Method,
    /// Steps, or rows.
    pub steps: usize,
    /// Tolerance of controlled steps (m), and how many there may be.
    pub controlled: Option<(f64, usize)>,
    /// Rows of the account.
    pub rows: Vec<[String; 2]>,
}

impl Chosen {
    /// What the command line asked for, without a search.
    pub fn asked(method: Method, steps: usize) -> Chosen {
        Chosen { method, steps, controlled: None, rows: Vec::new() }
    }
}

/// Finds the cheapest method of a law for an accuracy (m); `method` has the law and the scene's own integrator and timestep.
///
/// Errors: no method of the law has it; the message says until when one has.
pub fn find(case: &Case, method: &Method, wanted: f64) -> Result<Choice, Failure> {
    let _search = waiting(format!("looking for the cheapest method within {}", si(wanted, "m")));
    accuracy::choose(case, method.contact, wanted, &Budget::seconds(SEARCH)).map_err(|refusal| {
        let growth = horizon::growth(case, method, Stepping::Fixed(method.timestep)).ok();
        refused(&refusal, method, wanted, growth.as_ref())
    })
}

/// Finds the method for an accuracy (m) over a time (s); `method` has the law, and the timestep of the rows.
///
/// Errors: see [`find`].
pub fn choose(model: &Model, method: &Method, start: &State, seconds: f64, wanted: f64) -> Result<Chosen, Failure> {
    let case = Case { model: model.clone(), start: start.clone(), seconds };
    let choice = find(&case, method, wanted)?;
    let mut rows = account(&choice, wanted);
    let twin = waiting("measuring how fast errors grow".to_owned());
    // Where controlled steps are too many to be followed, the scene's own will do.
    let own = || horizon::growth(&case, method, Stepping::Fixed(method.timestep));
    if let Ok(growth) = horizon::growth(&case, &choice.method, choice.stepping).or_else(|_| own()) {
        rows.push(["trust".to_owned(), trusted(&growth, wanted, seconds)]);
    }
    twin.finish_and_clear();
    let steps = (seconds / method.timestep).round().max(1.0) as usize;
    Ok(match choice.stepping {
        Stepping::Fixed(_) => Chosen { method: choice.method, steps: choice.steps, controlled: None, rows },
        Stepping::Controlled(tolerance) => {
            let method = Method { integrator: choice.method.integrator, timestep: seconds / steps as f64, ..*method };
            Chosen { method, steps, controlled: Some((tolerance, choice.most_steps())), rows }
        }
    })
}

/// Says on a terminal what takes long, until it is dropped.
fn waiting(what: String) -> ProgressBar {
    let spinner = ProgressBar::new_spinner().with_message(what).with_finish(ProgressFinish::AndClear);
    spinner.enable_steady_tick(Duration::from_millis(200));
    spinner
}

/// What was chosen and what it costs, for a report.
pub fn account(choice: &Choice, wanted: f64) -> Vec<[String; 2]> {
    let steps = match (choice.stepping, choice.effort) {
        (Stepping::Controlled(tolerance), Some(effort)) => format!(
            "{}, {} of controlled size, each within {}; {} taken back{}",
            choice.method.integrator.name,
            count(effort.steps, "step", "steps"),
            si(tolerance, "m"),
            effort.rejected,
            if effort.forced > 0 { format!("; {} at the shortest step", effort.forced) } else { String::new() }
        ),
        _ => format!(
            "{}, {} of {}",
            choice.method.integrator.name,
            count(choice.steps, "step", "steps"),
            si(choice.method.timestep, "s")
        ),
    };
    let evaluations = |n: f64| format!("{} evaluations", short(n));
    let cost = choice.evaluations as f64;
    vec![
        ["accuracy".into(), format!("{} wanted, about {} expected: {steps}", si(wanted, "m"), si(choice.error, "m"))],
        [
            "cost".into(),
            format!(
                "{}, and {} to find the method; ten times better takes {} times that, ten times worse {}",
                evaluations(cost),
                short(choice.trial as f64),
                short(choice.tenfold),
                short(1.0 / choice.tenfold)
            ),
        ],
    ]
}

/// "errors double in 80 ms where they grow fastest", of a run that has the accuracy.
fn trusted(growth: &Growth, wanted: f64, seconds: f64) -> String {
    match growth.doubling().filter(|d| *d < seconds) {
        None => "errors do not grow".to_owned(),
        // Two runs with other steps agree all the same: what the twins saw is a jump of a force, and no error grows so.
        Some(_) if growth.horizon(wanted).is_some() => format!("runs with other steps agree to {}", si(wanted, "m")),
        Some(doubling) => format!("errors double in {} where they grow fastest", si(doubling, "s")),
    }
}

fn refused(refusal: &Refusal, method: &Method, wanted: f64, growth: Option<&Growth>) -> Failure {
    let mut text = format!(
        "error: no method of the {} law has an accuracy of {} over this time: {refusal}",
        method.contact.name,
        si(wanted, "m")
    );
    if refusal.until > 0.0 {
        text +=
            &format!("\n  help: two runs agree to it for {}: --time {}", si(refusal.until, "s"), short(refusal.until));
    }
    if let Some(doubling) = growth.and_then(Growth::doubling) {
        text += &format!("\n  errors double in {} where they grow fastest", si(doubling, "s"));
    }
    if let Some(horizon) = growth.and_then(|g| g.horizon(wanted)) {
        text += &format!(
            "; rounding alone passes {} after {}, and no method gives more",
            si(wanted, "m"),
            si(horizon, "s")
        );
    }
    Failure::Problem(text)
}

/// How the run goes from row to row.
pub enum Stepper<'m> {
    Fixed,
    Controlled { run: Box<Controlled<'m>>, start: f64, most: usize },
}

impl<'m> Stepper<'m> {
    /// Errors: the start does not suit the model.
    pub fn new(
        model: &'m Model,
        method: &Method,
        start: &State,
        steps: usize,
        controlled: Option<(f64, usize)>,
    ) -> Result<Stepper<'m>, Failure> {
        let Some((tolerance, most)) = controlled else { return Ok(Stepper::Fixed) };
        let end = start.time + steps as f64 * method.timestep;
        let run = Controlled::new(model, method, start, tolerance, end);
        let run = run.map_err(|e| Failure::Problem(format!("error: {e}")))?;
        Ok(Stepper::Controlled { run: Box::new(run), start: start.time, most })
    }

    /// To row `row`, one further than the last for fixed steps.
    pub fn step(
        &mut self,
        model: &Model,
        method: &Method,
        row: usize,
        state: &mut State,
        data: &mut Data,
    ) -> Result<(), Failed> {
        match self {
            Stepper::Fixed => step(model, method, state, data).map_err(Failed::Step),
            Stepper::Controlled { run, start, most } => {
                *state = run.at(*start + row as f64 * method.timestep, *most)?;
                Ok(())
            }
        }
    }
}
