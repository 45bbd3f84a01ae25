//! What `--accuracy` finds, beside what it promised and beside fixed steps: every scene in `models/`, twenty random trees of joints, and twenty random heaps of things that touch, under `penalty` and `mujoco`,
//! at 1 cm, 0.1 mm and 1 µm over ten seconds. Writes the figures of docs/accuracy.md.
//!
//!     cargo run --release --example accuracy [NAME…]        only scenes whose name begins so: nothing is written
//!     cargo run --release --example accuracy extremes       the table of long runs and extremes
//!
//! The truth is a run of controlled steps whose tolerance is made ten times smaller until two agree; how far they are apart is
//! its uncertainty. Where it passes a tenth of the accuracy that is wanted, at the latest, the run ends: beyond nothing can
//! be told. The cheapest fixed method is that of the fewest evaluations among all integrators with 64, 128, 256 … steps.

use std::error::Error;
use std::fmt::Write;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use penny::contact::{self, Law};
use penny::data::Data;
use penny::forward::{Method, ROUNDS, step};
use penny::integrate::{self, cash_karp};
use penny::state::State;
use penny_lab::accuracy::survey::{Price, prices};
use penny_lab::explain::Budget;
use penny_lab::sweep::Case;
use penny_lab::sweep::trajectory::{distance, poses};

mod extremes;
mod oracle;
mod scenes;

/// s
const TIME: f64 = 10.0;
const WANTED: [f64; 3] = [1e-2, 1e-4, 1e-6];
const LAWS: [&str; 2] = ["penalty", "mujoco"];
/// Evaluations of a run for the truth, or of fixed steps.
const MOST: usize = 100_000;
/// Real time of a search, as `penny sweep --summary` has it, s.
const SEARCH: f64 = 10.0;
const DOCS: &str = "docs/accuracy.md";
/// What the figures stand behind.
const HEADING: &str = "## What was reached\n";

/// One search, and what it is compared with.
struct Line {
    scene: String,
    law: &'static str,
    price: Price,
    /// Where fixed steps are within what the search took.
    proof: Option<oracle::Proof>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let only: Vec<String> = std::env::args().skip(1).collect();
    if only == ["extremes"] {
        return extremes::print();
    }
    let mut cases = scenes::all(TIME)?;
    cases.retain(|(name, _)| only.is_empty() || only.iter().any(|only| name.starts_with(only)));
    let jobs: Vec<_> = cases.iter().flat_map(|case| LAWS.map(|law| (case, law))).collect();
    let (next, found) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..cores {
            scope.spawn(|| {
                while let Some(((name, case), law)) = jobs.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let Some(law) = contact::by_name(law) else { continue };
                    let lines = lines(name, case, law);
                    lines.iter().for_each(|line| eprintln!("{}", line.row()));
                    if let Ok(mut found) = found.lock() {
                        found.push((jobs.iter().position(|(case, l)| case.0 == *name && *l == law.name), lines));
                    }
                }
            });
        }
    });
    let mut found = found.into_inner()?;
    found.sort_by_key(|(place, _)| *place);
    let lines: Vec<Line> = found.into_iter().flat_map(|(_, lines)| lines).collect();
    let text = figures(&lines, &orders()?);
    println!("{text}");
    if only.is_empty() {
        let docs = std::fs::read_to_string(DOCS)?;
        let (before, _) = docs.split_once(HEADING).ok_or("docs/accuracy.md has no place for the figures")?;
        std::fs::write(DOCS, format!("{before}{HEADING}\n{text}"))?;
    }
    Ok(())
}

fn lines(name: &str, case: &Case, law: &'static Law) -> Vec<Line> {
    let prices = prices(case, law, &WANTED, MOST, &|| Budget::seconds(SEARCH));
    let line = |price: Price| {
        let short = Case { seconds: price.seconds, ..case.clone() };
        let known = price.truth.as_ref().zip(price.fixed);
        let proof = known.map(|(truth, f)| oracle::cheapest(&short, law, price.wanted, truth, f.evaluations));
        Line { scene: name.to_owned(), law: law.name, price, proof }
    };
    prices.into_iter().map(line).collect()
}

impl Line {
    fn row(&self) -> String {
        let Line { scene, law, price, proof } = self;
        let proof = proof.map_or_else(|| "– | –".to_owned(), |p| format!("{} | {}", p.two, p.ladder));
        let fixed = || price.fixed.map_or_else(|| "–".to_owned(), |f| format!("{} ({})", f.evaluations, f.integrator));
        let rest = match &price.chosen {
            None => "no truth | | | | | | | |".to_owned(),
            Some(Err(refusal)) => format!("refused: {refusal} | | | | | {} | {proof} |", fixed()),
            Some(Ok((choice, error))) => {
                let how = if choice.effort.is_some() { "controlled" } else { "fixed" };
                let by = choice.method.integrator.name;
                let cost = format!("{} | {} | {}", choice.evaluations, choice.trial, fixed());
                format!("{error:.1e} | {:.1e} | {by}, {how} | {cost} | {proof} |", choice.error)
            }
        };
        format!("| {scene} | {law} | {:.0e} | {:.2} | {rest}", price.wanted, price.seconds)
    }
}

/// Kinds of scenes, by how their names begin.
fn kind(line: &Line) -> &'static str {
    ["joints-", "contact-"].into_iter().find(|kind| line.scene.starts_with(kind)).unwrap_or("models/")
}

/// All that docs/accuracy.md says in numbers.
fn figures(lines: &[Line], orders: &str) -> String {
    let mut text = String::from(
        "`cargo run --release --example accuracy` writes what follows. `joints-N` are random chains of joints with actuators,\n\
         `contact-N` random things thrown on the ground. A run ends, before ten seconds, where the truth is uncertain by a tenth of\n\
         what is wanted: at the trust horizon, or where sticking under `penalty` takes more than the evaluations of the truth.\n\n",
    );
    text += "| scenes | wanted m | searches | no truth | refused | within | up to 10 times | beyond | run cheaper than fixed steps | \
             search cheaper | at most twice | three times | four times | search and the run again at most twice | median | \
             two runs at most twice | ladder at most twice |\n\
             |---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
    for kind_of in ["models/", "joints-", "contact-", "ten seconds", "all"] {
        for wanted in WANTED {
            let whole = |l: &Line| kind_of == "ten seconds" && l.price.seconds == TIME;
            let of = |l: &&Line| (kind_of == "all" || whole(l) || kind(l) == kind_of) && l.price.wanted == wanted;
            text += &count(kind_of, Some(wanted), &lines.iter().filter(of).collect::<Vec<_>>());
        }
    }
    text += &count("all", None, &lines.iter().collect::<Vec<_>>());
    text += &lost(lines);
    text += &ratios(lines);
    text += &rejected(lines);
    text += orders;
    text += "\n### Every search\n\n\"error\" is the distance from the truth, \"promised\" the estimate; \"run\", \"search\" and \
             \"fixed steps\" are\nevaluations, the search with the run that it chose. –: no fixed steps are cheaper than the \
             search. \"two runs\" and\n\"ladder\" are the cheapest proofs, by one who knows the two runs to compare, or the \
             integrator, beforehand; four times the\nfixed steps: none was found that is cheaper than that.\n\n";
    text += "| scene | law | wanted m | time s | error m | promised m | by | run | search | fixed steps | two runs | ladder |\n\
             |---|---|---|---|---|---|---|---|---|---|---|---|\n";
    for line in lines {
        let _ = writeln!(text, "{}", line.row());
    }
    text
}

fn count(kind: &str, wanted: Option<f64>, lines: &[&Line]) -> String {
    let wanted = wanted.map_or_else(|| "all".to_owned(), |wanted| format!("{wanted:.0e}"));
    let chosen = |l: &&&Line| matches!(l.price.chosen, Some(Ok(_)));
    let number = |what: &dyn Fn(&Line) -> bool| lines.iter().filter(|l| what(l)).count();
    let error = |l: &Line| match &l.price.chosen {
        Some(Ok((_, error))) => error / l.price.wanted,
        _ => f64::NAN,
    };
    let cost = |l: &Line, of: &dyn Fn(usize, usize) -> usize| match (&l.price.chosen, l.price.fixed) {
        (Some(Ok((choice, _))), Some(fixed)) => of(choice.evaluations, choice.trial) as f64 / fixed.evaluations as f64,
        (Some(Ok(_)), None) => 0.0,
        _ => f64::NAN,
    };
    let share =
        |n: usize| format!("{n} ({:.0} %)", 100.0 * n as f64 / lines.iter().filter(chosen).count().max(1) as f64);
    let proof = |l: &Line, of: &dyn Fn(oracle::Proof) -> usize| match (l.proof, l.price.fixed, &l.price.chosen) {
        (Some(proof), Some(fixed), Some(Ok(_))) => of(proof) as f64 / fixed.evaluations as f64,
        (None, None, Some(Ok(_))) => 0.0,
        _ => f64::NAN,
    };
    let searches = lines.iter().map(|l| cost(l, &|_, search| search));
    let mut ratios: Vec<f64> = searches.filter(|ratio| !ratio.is_nan()).collect();
    ratios.sort_by(f64::total_cmp);
    let median = ratios.get(ratios.len() / 2).copied().unwrap_or(f64::NAN);
    format!(
        "| {kind} | {wanted} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {median:.2} | {} | {} |\n",
        lines.len(),
        number(&|l| l.price.chosen.is_none()),
        number(&|l| matches!(l.price.chosen, Some(Err(_)))),
        share(number(&|l| error(l) <= 1.0)),
        number(&|l| error(l) > 1.0 && error(l) <= 10.0),
        number(&|l| error(l) > 10.0),
        share(number(&|l| cost(l, &|run, _| run) < 1.0)),
        share(number(&|l| cost(l, &|_, search| search) < 1.0)),
        share(number(&|l| cost(l, &|_, search| search) <= 2.0)),
        share(number(&|l| cost(l, &|_, search| search) <= 3.0)),
        share(number(&|l| cost(l, &|_, search| search) <= 4.0)),
        share(number(&|l| cost(l, &|run, search| run + search) <= 2.0)),
        share(number(&|l| proof(l, &|p| p.two) <= 2.0)),
        share(number(&|l| proof(l, &|p| p.ladder) <= 2.0)),
    )
}

/// Where the cost goes that is more than twice that of the cheapest fixed steps.
fn lost(lines: &[Line]) -> String {
    let mut text = String::from(
        "\n### Searches that cost more than twice the cheapest fixed steps\n\nMedians, in evaluations of the cheapest fixed steps; \
         and of which integrator these are.\n\n| wanted m | searches | run | other runs | run at most 1.2 times | run more than \
         twice | cheapest fixed steps |\n|---|---|---|---|---|---|---|\n",
    );
    for wanted in WANTED {
        let of =
            lines.iter().filter(|l| l.price.wanted == wanted).filter_map(|l| match (&l.price.chosen, l.price.fixed) {
                (Some(Ok((choice, _))), Some(fixed)) => {
                    let times = |evaluations: usize| evaluations as f64 / fixed.evaluations as f64;
                    let found = [times(choice.evaluations), times(choice.trial - choice.evaluations)];
                    (found[0] + found[1] > 2.0).then_some((found, fixed.integrator))
                }
                _ => None,
            });
        let of: Vec<_> = of.collect();
        let median = |part: usize| {
            let mut all: Vec<f64> = of.iter().map(|(found, _)| found[part]).collect();
            all.sort_by(f64::total_cmp);
            all.get(all.len() / 2).copied().unwrap_or(f64::NAN)
        };
        let runs = |what: &dyn Fn(f64) -> bool| of.iter().filter(|([run, _], _)| what(*run)).count();
        let by = |i: &&integrate::Integrator| (of.iter().filter(|(_, by)| *by == i.name).count(), i.name);
        let mut by: Vec<_> = integrate::ALL.iter().map(by).filter(|(n, _)| *n > 0).collect();
        by.sort_by_key(|(n, _)| usize::MAX - n);
        let by: Vec<String> = by.iter().map(|(n, name)| format!("{n} {name}")).collect();
        let _ = writeln!(
            text,
            "| {wanted:.0e} | {} | {:.2} | {:.2} | {} | {} | {} |",
            of.len(),
            median(0),
            median(1),
            runs(&|run| run <= 1.2),
            runs(&|run| run > 2.0),
            by.join(", ")
        );
    }
    text
}

/// A histogram of estimate over true error.
fn ratios(lines: &[Line]) -> String {
    let bounds = [0.1, 0.5, 1.0, 3.0, 10.0, 100.0, f64::INFINITY];
    let ratio = |l: &Line| match &l.price.chosen {
        // Below this the truth itself is uncertain.
        Some(Ok((choice, error))) if *error > 1e-10 => Some(choice.error / error),
        _ => None,
    };
    let all: Vec<f64> = lines.iter().filter_map(ratio).collect();
    let mut text = String::from("\n### The estimate over the true error\n\n| ratio | searches |\n|---|---|\n");
    let mut low = 0.0;
    for high in bounds {
        let n = all.iter().filter(|r| **r > low && **r <= high).count();
        let _ = writeln!(text, "| {low} to {high} | {n} {}|", "█".repeat(n * 40 / all.len().max(1)));
        low = high;
    }
    text + "\nA search accepts an estimate up to what is wanted of fixed steps, up to half of it of controlled ones where something \
            touches,\nof smooth motion up to 0.95 times.\n"
}

/// The orders of the integrators that estimate their error, by fixed steps on smooth motion; the truth are those of fifth
/// order, four times finer than the finest.
fn orders() -> Result<String, Box<dyn Error>> {
    let mut text = String::from(
        "\n### Orders\n\nThe distance from the truth after a second of fixed steps, m, and the order that the last two show.\n\n\
         | integrator | scene | step s | error | half | a quarter | an eighth | order, theory | order, measured |\n\
         |---|---|---|---|---|---|---|---|---|\n",
    );
    for integrator in integrate::ALL.iter().filter(|i| i.estimate.is_some()) {
        for (scene, timestep) in [("pendulum", 0.04), ("top", 0.02)] {
            // Where both are asymptotic, and above rounding.
            let timestep = if integrator.order < 4 { timestep / 8.0 } else { timestep };
            let model = penny::load(std::path::Path::new(&format!("models/{scene}.xml")))?.model;
            let end = |integrator, timestep: f64| -> Result<_, Box<dyn Error>> {
                let method = Method { contact: contact::default(), integrator, timestep, rounds: ROUNDS };
                let (mut state, mut data) = (State::new(&model), Data::new(&model));
                for _ in 0..(1.0 / timestep).round() as usize {
                    step(&model, &method, &mut state, &mut data)?;
                }
                Ok(vec![poses(&model, &state.qpos, &mut data)])
            };
            let truth = end(&cash_karp::METHOD, timestep / 32.0)?;
            let error = |halved: i32| -> Result<f64, Box<dyn Error>> {
                let end = end(integrator, timestep * 0.5f64.powi(halved))?;
                Ok(distance(&model, &end, &truth).unwrap_or(f64::NAN))
            };
            let errors = [error(0)?, error(1)?, error(2)?, error(3)?];
            let [a, b, c, d] = errors.map(|e| format!("{e:.1e}"));
            let (name, order, shown) = (integrator.name, integrator.order, (errors[2] / errors[3]).log2());
            let _ = writeln!(text, "| {name} | {scene} | {timestep} | {a} | {b} | {c} | {d} | {order} | {shown:.2} |");
        }
    }
    Ok(text)
}

/// How many steps are taken back.
fn rejected(lines: &[Line]) -> String {
    let mut text = String::from(
        "\n### Steps taken back\n\n| scenes | kept | taken back | at the shortest step |\n|---|---|---|---|\n",
    );
    for kind_of in ["models/", "joints-", "contact-"] {
        let efforts = lines.iter().filter(|l| kind(l) == kind_of).filter_map(|l| match &l.price.chosen {
            Some(Ok((choice, _))) => choice.effort,
            _ => None,
        });
        let sums = efforts.fold([0; 3], |[a, b, c], e| [a + e.steps, b + e.rejected, c + e.forced]);
        let [steps, rejected, forced] = sums;
        let share = 100.0 * rejected as f64 / (steps + rejected).max(1) as f64;
        let _ = writeln!(text, "| {kind_of} | {steps} | {rejected} ({share:.0} %) | {forced} |");
    }
    text
}
