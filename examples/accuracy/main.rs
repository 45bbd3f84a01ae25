//! What `--accuracy` finds, beside what it promised and beside fixed steps: every scene in models/ (and those named on the
//! command line) under `penalty` and `mujoco`, at 1 cm, 0.1 mm and 1 µm. docs/accuracy.md has the result.
//!
//!     cargo run --release --example accuracy [SCENE.xml …]
//!
//! The truth is the same search for an accuracy of 10 nm (0.1 µm where that is refused), whose own error it estimates. The
//! cheapest fixed method is that of the fewest evaluations among all integrators with timesteps from a 64th of the run down,
//! halved until the error is small enough.

use std::error::Error;

use penny::contact::{self, Law};
use penny::data::Data;
use penny::forward::{Method, ROUNDS, step};
use penny::integrate;
use penny::state::State;
use penny_lab::accuracy::{Choice, SAMPLES, choose};
use penny_lab::explain::Budget;
use penny_lab::sweep::Case;
use penny_lab::sweep::trajectory::{Pose, distance, poses};

/// s
const TIME: f64 = 0.8;
const WANTED: [f64; 3] = [1e-2, 1e-4, 1e-6];
/// m
const TRUTHS: [f64; 2] = [1e-8, 1e-7];
/// Real time of one search, s.
const SEARCH: f64 = 6.0;
/// Evaluations of the fixed methods that are tried.
const MOST: usize = 400_000;

fn main() -> Result<(), Box<dyn Error>> {
    let mut files: Vec<_> = std::fs::read_dir("models")?.map(|e| e.map(|e| e.path())).collect::<Result<_, _>>()?;
    files.sort();
    files.extend(std::env::args().skip(1).map(Into::into));
    let (mut within, mut near, mut beyond, mut refused, mut cheaper, mut twice, mut all) = (0, 0, 0, 0, 0, 0, 0);
    println!("| scene | law | wanted m | error m | by | evaluations | search | fixed steps |");
    println!("|---|---|---|---|---|---|---|---|");
    for file in files.iter().filter(|f| f.extension().is_some_and(|e| e == "xml")) {
        let text = std::fs::read_to_string(file)?;
        let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let Ok(scene) = penny::parse(&file.display().to_string(), &text) else { continue };
        let case = Case { start: State::new(&scene.model), model: scene.model, seconds: TIME };
        for law in contact::ALL.iter().copied().filter(|law| ["penalty", "mujoco"].contains(&law.name)) {
            let found = |wanted| choose(&case, law, wanted, &Budget::seconds(SEARCH));
            let Some(truth) = TRUTHS.into_iter().find_map(|wanted| found(wanted).ok()) else {
                println!("| {name} | {} | {:.0e} | no truth | | | | |", law.name, TRUTHS[1]);
                continue;
            };
            for wanted in WANTED {
                all += 1;
                let choice = match found(wanted) {
                    Ok(choice) => choice,
                    Err(refusal) => {
                        refused += 1;
                        println!("| {name} | {} | {wanted:.0e} | refused: {refusal} | | | | |", law.name);
                        continue;
                    }
                };
                let error = distance(&case.model, &choice.samples, &truth.samples).unwrap_or(f64::INFINITY);
                within += usize::from(error <= wanted);
                near += usize::from(error > wanted && error <= 10.0 * wanted);
                beyond += usize::from(error > 10.0 * wanted);
                let fixed = cheapest(&case, law, wanted, &truth);
                let cost = choice.evaluations + choice.trial;
                cheaper += usize::from(fixed.as_ref().is_none_or(|(_, fixed)| choice.evaluations < *fixed));
                twice += usize::from(fixed.as_ref().is_none_or(|(_, fixed)| cost <= 2 * fixed));
                let fixed = fixed.map_or_else(|| format!("more than {MOST}"), |(by, n)| format!("{n} ({by})"));
                let by = choice.method.integrator.name;
                let how = if choice.effort.is_some() { "controlled" } else { "fixed" };
                let Choice { evaluations, trial, .. } = choice;
                println!(
                    "| {name} | {} | {wanted:.0e} | {error:.1e} | {by}, {how} | {evaluations} | {trial} | {fixed} |",
                    law.name
                );
            }
        }
    }
    println!(
        "\n{all} searches: error within what was wanted {within}, up to ten times {near}, beyond {beyond}, refused {refused};"
    );
    println!("the run cheaper than the cheapest fixed method {cheaper}, search and run at most twice it {twice}");
    Ok(())
}

/// The integrator and evaluations of the cheapest fixed steps within an error; `None` beyond [`MOST`].
fn cheapest(case: &Case, law: &'static Law, wanted: f64, truth: &Choice) -> Option<(&'static str, usize)> {
    let mut best: Option<(&'static str, usize)> = None;
    for integrator in integrate::ALL {
        let mut each = 1;
        loop {
            let method = Method { contact: law, integrator, timestep: TIME / (each * SAMPLES) as f64, rounds: ROUNDS };
            let most = best.map_or(MOST, |(_, n)| n);
            let Some((samples, evaluations)) = run(case, &method, each, most) else { break };
            if distance(&case.model, &samples, &truth.samples).is_some_and(|error| error <= wanted) {
                best = Some((integrator.name, evaluations));
                break;
            }
            each *= 2;
        }
    }
    best
}

/// Poses at the samples and evaluations; `None` if it takes more than `most`.
fn run(case: &Case, method: &Method, each: usize, most: usize) -> Option<(Vec<Vec<Pose>>, usize)> {
    let (mut state, mut data, mut scratch) = (case.start.clone(), Data::new(&case.model), Data::new(&case.model));
    let (mut samples, mut evaluations) = (Vec::new(), 0);
    if each * SAMPLES > most {
        return None;
    }
    'run: for _ in 0..SAMPLES {
        for _ in 0..each {
            if step(&case.model, method, &mut state, &mut data).is_err() {
                break 'run;
            }
            evaluations += data.counts.forwards;
            if evaluations > most {
                return None;
            }
        }
        samples.push(poses(&case.model, &state.qpos, &mut scratch));
    }
    Some((samples, evaluations))
}
