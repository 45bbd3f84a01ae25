//! `penny rollout`: many worlds of one scene, each with a start and parameters of its own, on all cores.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;

use super::Failure;
use super::accuracy::AccuracyArgs;
use super::files;
use super::format::{count, short, si};
use super::interrupt::Interrupt;
use super::scene::{self, LengthArgs, LimitArgs, MethodArgs, OverrideArgs, StartArgs};
use penny::Simulation;
#[cfg(feature = "parquet")]
use penny::draft::Draft;
use penny::model::Model;
use penny_lab::accuracy;
use penny_lab::names;
use penny_lab::record::{self, Quantity, Recorder};
use penny_lab::sweep::Case;

mod unfinished;
mod vary;

use unfinished::{Unfinished, settings};
use vary::{Slot, Vary, random};

#[derive(clap::Args)]
pub struct Args {
    /// MJCF file
    #[arg(value_name = "SCENE.xml")]
    scene: PathBuf,
    /// Worlds to run [default: 100]
    #[arg(long, value_name = "N", value_parser = scene::at_least_one, conflicts_with = "table")]
    worlds: Option<usize>,
    /// Give each world a number of its own, uniformly distributed: `qvel[0]=1..3`, `qpos[hinge]=0..1.57`, `ctrl[motor]=-1..1`,
    /// `friction[ground]=0.2..0.9` (or `friction` of all geoms), `solref[ball]=0.005..0.02` (its time constant),
    /// `mass[crate]=1..10`, `gravity[z]=-9.81..-1.62`, `timestep=0.001..0.004`. May be given several times
    #[arg(long, value_name = "NAME=A..B", value_parser = vary::parse, allow_hyphen_values = true)]
    vary: Vec<Vary>,
    /// A CSV file with a world in each row, and a column for each number, named as in --vary
    #[arg(long, value_name = "FILE.csv", conflicts_with = "vary")]
    table: Option<PathBuf>,
    /// Where the results go, one row for each world: CSV, or Parquet if the name ends in .parquet (a build with `--features
    /// parquet`)
    #[arg(long, short, value_name = "FILE.csv")]
    out: PathBuf,
    /// Continue an interrupted rollout: the worlds in the unfinished file are not run again. Scene and options must be those
    /// that it was begun with; only --worlds may be larger
    #[arg(long)]
    resume: bool,
    /// Seed of the random numbers: the same seed gives each world the same numbers, however many worlds there are
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Threads: at most one for each world, and at most one for each core or 16, whichever is more [default: all cores];
    /// results do not depend on it
    #[arg(long, value_name = "N", value_parser = scene::at_least_one)]
    threads: Option<usize>,
    /// Quantities at the end of each run to add as columns: names and groups as in `penny run --show`
    #[arg(long, value_name = "WHAT", value_delimiter = ',')]
    show: Vec<String>,
    #[command(flatten)]
    length: LengthArgs,
    #[command(flatten)]
    method: MethodArgs,
    #[command(flatten)]
    accuracy: AccuracyArgs,
    #[command(flatten)]
    start: StartArgs,
    #[command(flatten)]
    overrides: OverrideArgs,
    #[command(flatten)]
    limits: LimitArgs,
}

/// Without --worlds.
const WORLDS: usize = 100;
/// Worlds that a thread has at a time: between two such pieces rows are written.
const PIECE: usize = 16;
/// Threads that may be asked for where there are fewer cores.
const THREADS: usize = 16;

pub fn rollout(args: &Args) -> Result<(), Failure> {
    let as_parquet = can_be_written(&args.out)?;
    if as_parquet && !cfg!(feature = "parquet") {
        let why = "error: --out: this penny was built without Parquet: `cargo run --features parquet -- rollout …` builds it; \
                   a name that ends in .csv needs nothing";
        return Err(Failure::Problem(why.to_owned()));
    }
    let written = [("--out", Some(args.out.as_path()))];
    files::apart(args.table.as_slice(), &written)?;
    let read = scene::load_apart(&args.scene, &args.limits, &written)?;
    let mut model = read.clone();
    args.overrides.apply(&mut model)?;
    let method = args.method.method(&model)?;
    let start = args.start.state(&model)?;
    let steps = args.length.steps(method.timestep)?;
    let seconds = steps as f64 * method.timestep;
    let shown = record::chosen(&model, &args.show).map_err(|e| Failure::Usage(format!("error: --show: {e}")))?;
    let mut base = Simulation::new(model.clone(), method);
    // The start is the model's: it was checked when it was read.
    base.restore(&start).map_err(|e| Failure::Problem(format!("error: {e}")))?;
    let plan = Plan::new(args, &base, seconds)?;
    let wanted = args.accuracy.accuracy;
    let header = header(&plan, wanted.is_some(), &model, &shown);
    let unfinished = Unfinished::of(&args.out);
    let settings = settings(args, [&read, &model], &method, &start, seconds, &plan);
    let (out, done) = unfinished.open(&settings, &header, args.resume, plan.worlds)?;
    let interrupt = Interrupt::watch()?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads(args.threads, plan.worlds - done)).build();
    let pool = pool.map_err(|e| Failure::Problem(format!("error: no threads: {e}")))?;

    let before = Instant::now();
    let run = |world: usize| plan.run(world, &base, seconds, &shown, wanted, &interrupt);
    let (world, failures) = write_rows(done..plan.worlds, run, &pool, out, &unfinished, &interrupt)?;
    let elapsed = before.elapsed().as_secs_f64();
    if let Some(code) = interrupt.code().filter(|_| world < plan.worlds) {
        eprintln!(
            "warning: interrupted after {world} of {}: they are in {}; go on with --resume",
            count(plan.worlds, "world", "worlds"),
            unfinished.rows.display()
        );
        return Err(Failure::Interrupted(code));
    }
    if as_parquet {
        to_parquet(&unfinished.rows, &args.out).map_err(|e| files::cannot_write(&args.out, &e))?;
        unfinished.remove();
    } else {
        unfinished.keep()?;
    }
    let ran = plan.worlds - done;
    println!(
        "{} of {}, {}: {} in {}, {} a world and step",
        count(plan.worlds, "world", "worlds"),
        si(seconds, "s"),
        args.out.display(),
        count(ran, "was run", "were run"),
        si(elapsed, "s"),
        si(elapsed / (ran * steps).max(1) as f64, "s")
    );
    if failures > 0 {
        match wanted {
            None => eprintln!("warning: {failures} of {ran} diverged: the column `failed` has the time, s"),
            Some(wanted) => eprintln!(
                "warning: {failures} of {ran} were refused: no method has {}; the column `failed` has the time until which one \
                 has, s, and the rest of the row is the start",
                si(wanted, "m")
            ),
        }
    }
    Ok(())
}

/// Runs the worlds, a piece at a time on all threads, and writes their rows in order. Out: the first world that has no row,
/// and how many failed.
///
/// Errors: a row cannot be written, or a world cannot have its numbers; where that is known from the first piece on, nothing
/// is left of the rollout.
fn write_rows(
    worlds: Range<usize>,
    run: impl Fn(usize) -> Result<Option<(String, bool)>, Failure> + Sync,
    pool: &rayon::ThreadPool,
    mut out: BufWriter<File>,
    unfinished: &Unfinished,
    interrupt: &Interrupt,
) -> Result<(usize, usize), Failure> {
    let progress = bar(worlds.end, worlds.start);
    let (mut failures, mut world) = (0, worlds.start);
    while world < worlds.end && interrupt.code().is_none() {
        let piece = world..(world + PIECE * pool.current_num_threads()).min(worlds.end);
        let rows: Vec<_> = pool.install(|| piece.clone().into_par_iter().map(&run).collect());
        for row in rows {
            // The first world's that cannot be, whichever thread was first.
            let row = row.inspect_err(|_| {
                if piece.start == 0 {
                    unfinished.remove()
                }
            })?;
            // Up to the first one that a signal ended.
            let Some((row, failed)) = row else { break };
            failures += usize::from(failed);
            writeln!(out, "{row}").map_err(|e| files::cannot_write(&unfinished.rows, &e))?;
            world += 1;
        }
        out.flush().map_err(|e| files::cannot_write(&unfinished.rows, &e))?;
        progress.set_position(world as u64);
    }
    progress.finish_and_clear();
    Ok((world, failures))
}

/// The names of the columns, as CSV.
fn header(plan: &Plan, to_an_accuracy: bool, model: &Model, shown: &[Quantity]) -> String {
    let mut names = vec!["world".to_owned()];
    names.extend(plan.names.iter().cloned());
    names.push("failed".to_owned());
    if to_an_accuracy {
        names.extend(["method", "evaluations", "error m"].map(str::to_owned));
    }
    names.extend(record::columns(model, shown));
    names.iter().map(|name| record::quoted(name)).collect::<Vec<_>>().join(",")
}

/// Checks the name of the results. Out: whether they are Parquet.
///
/// Errors: wrong usage, if it is none that they can have.
fn can_be_written(out: &Path) -> Result<bool, Failure> {
    let end = out.extension().map(|end| end.to_string_lossy().to_lowercase()).unwrap_or_default();
    let name = out.display();
    let why = if out == Path::new("-") {
        "error: --out: rows cannot go to standard output, since --resume goes on with them: name a file, such as worlds.csv"
            .to_owned()
    } else if end == "json" {
        format!("error: --out: `{name}` would be CSV: give a name that ends in .csv or .parquet")
    } else if out.exists() && !out.is_file() {
        format!("error: --out: `{name}` is not a file that can be replaced: name another one, such as worlds.csv")
    } else {
        return Ok(end == "parquet");
    };
    Err(Failure::Usage(why))
}

/// How many threads run this many worlds; 0 is what rayon takes for all cores.
fn threads(asked: Option<usize>, worlds: usize) -> usize {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    match asked {
        None if worlds >= cores => 0,
        asked => asked.unwrap_or(cores).min(cores.max(THREADS)).min(worlds.max(1)),
    }
}

/// Which numbers each world gets.
struct Plan {
    worlds: usize,
    /// As columns.
    names: Vec<String>,
    slots: Vec<Slot>,
    /// Ranges of random numbers, or the table's rows.
    values: Values,
}

enum Values {
    Random { ranges: Vec<[f64; 2]>, seed: u64 },
    Table(Vec<Vec<f64>>),
}

impl Plan {
    /// For worlds that begin as `base` and run for a time (s).
    ///
    /// Errors: what is varied is not there, twice there, or would have a number that it cannot have.
    fn new(args: &Args, base: &Simulation, seconds: f64) -> Result<Plan, Failure> {
        let (names, worlds, values) = match &args.table {
            None => {
                let names: Vec<String> = args.vary.iter().map(|v| v.name.clone()).collect();
                let ranges = args.vary.iter().map(|v| v.range).collect();
                (names, args.worlds.unwrap_or(WORLDS), Values::Random { ranges, seed: args.seed })
            }
            Some(path) => {
                let (names, rows) = table(path, base.model())?;
                (names, rows.len(), Values::Table(rows))
            }
        };
        let wrong = |why: String| Failure::Usage(format!("error: {why}"));
        let slots = names.iter().map(|name| Slot::find(name, base.model())).collect::<Result<Vec<_>, _>>();
        let plan = Plan { worlds, names, slots: slots.map_err(wrong)?, values };
        plan.each_once().map_err(wrong)?;
        if plan.slots.contains(&Slot::Timestep) {
            let why = if args.accuracy.accuracy.is_some() {
                "--accuracy finds the timestep itself: leave out timestep, or --accuracy"
            } else if args.method.timestep.is_some() {
                "--timestep and timestep set the same number: leave one out"
            } else if args.length.counted() {
                "worlds of different timesteps run for the same time, not for the same --steps: give --time"
            } else {
                ""
            };
            if !why.is_empty() {
                return Err(wrong(why.to_owned()));
            }
        }
        plan.check(args, base, seconds)?;
        Ok(plan)
    }

    /// Errors: two names are of one number.
    fn each_once(&self) -> Result<(), String> {
        for (i, slot) in self.slots.iter().enumerate() {
            if let Some(j) = (0..i).find(|&j| slot.overlaps(self.slots[j])) {
                return Err(format!("`{}` and `{}` set the same number: leave one out", self.names[j], self.names[i]));
            }
        }
        Ok(())
    }

    /// Errors: an end of a range, or a cell of a table, is no number that the scene can have.
    fn check(&self, args: &Args, base: &Simulation, seconds: f64) -> Result<(), Failure> {
        let places = || self.slots.iter().zip(&self.names);
        match &self.values {
            Values::Random { ranges, .. } => {
                for ((slot, name), range) in places().zip(ranges) {
                    for x in *range {
                        let set = slot.check(base.model(), x, seconds).and_then(|()| slot.set(&mut base.clone(), x));
                        set.map_err(|why| Failure::Usage(format!("error: --vary {name}: {}: {why}", short(x))))?;
                    }
                }
            }
            Values::Table(rows) => {
                let path = args.table.as_deref().unwrap_or(Path::new("")).display();
                for (i, row) in rows.iter().enumerate() {
                    for ((slot, name), x) in places().zip(row) {
                        let wrong = |why| {
                            let row = i + 1;
                            Failure::Problem(format!("error: --table {path}: row {row}: {name}: {}: {why}", short(*x)))
                        };
                        slot.check(base.model(), *x, seconds).map_err(wrong)?;
                    }
                }
            }
        }
        Ok(())
    }

    fn seed(&self) -> Option<u64> {
        match &self.values {
            Values::Random { ranges, seed } => Some(*seed).filter(|_| !ranges.is_empty()),
            Values::Table(_) => None,
        }
    }

    fn numbers(&self, world: usize) -> Vec<f64> {
        match &self.values {
            Values::Table(rows) => rows[world].clone(),
            Values::Random { ranges, seed } => {
                let number = |(i, [a, b]): (usize, &[f64; 2])| a + (b - a) * random(*seed, world, i);
                ranges.iter().enumerate().map(number).collect()
            }
        }
    }

    /// Runs a world for a time (s), to an accuracy (m) if one is wanted. Out: its row, and whether it failed; `None` if a
    /// signal came meanwhile.
    ///
    /// Errors: a number that the scene cannot have.
    fn run(
        &self,
        world: usize,
        base: &Simulation,
        seconds: f64,
        shown: &[Quantity],
        wanted: Option<f64>,
        interrupt: &Interrupt,
    ) -> Result<Option<(String, bool)>, Failure> {
        let interrupted = || interrupt.code().is_some();
        if interrupted() {
            return Ok(None);
        }
        let numbers = self.numbers(world);
        let mut sim = base.clone();
        for ((slot, name), x) in self.slots.iter().zip(&self.names).zip(&numbers) {
            let wrong = |why| Failure::Problem(format!("error: world {world}: {name} = {}: {why}", short(*x)));
            slot.set(&mut sim, *x).map_err(wrong)?;
        }
        let mut row = vec![world.to_string()];
        row.extend(numbers.iter().map(|x| format!("{x:.16e}")));
        let failed = match wanted {
            None => {
                let steps = (seconds / sim.method().timestep).round() as usize;
                let mut failed = None;
                for _ in 0..steps {
                    if interrupted() {
                        return Ok(None);
                    }
                    if let Err(error) = sim.step() {
                        failed = Some(error.time());
                        break;
                    }
                }
                row.push(failed.map_or_else(String::new, |time| time.to_string()));
                failed
            }
            Some(wanted) => {
                let case = Case { model: sim.model().clone(), start: sim.state().clone(), seconds };
                // Without a clock: a world's row is the same on every machine.
                match accuracy::choose(&case, sim.method().contact, wanted, &interrupt.budget()) {
                    Ok(choice) => {
                        let how = if choice.effort.is_some() { " controlled" } else { "" };
                        let (by, error) = (choice.method.integrator.name, format!("{:.1e}", choice.error));
                        row.extend([String::new(), format!("{by}{how}"), choice.evaluations.to_string(), error]);
                        sim.restore(&choice.end).map_err(|e| Failure::Problem(format!("error: world {world}: {e}")))?;
                        None
                    }
                    Err(_) if interrupted() => return Ok(None),
                    Err(refusal) => {
                        row.extend([refusal.until.to_string(), "refused".to_owned()]);
                        row.extend([refusal.trial.to_string(), format!("{:.1e}", refusal.reached)]);
                        Some(refusal.until)
                    }
                }
            }
        };
        let (model, method, state) = (sim.model(), sim.method(), sim.state());
        let mut recorder = Recorder::new(model);
        let sample = recorder.sample(model, state);
        let values = recorder.values(model, method, state, &sample, shown);
        row.extend(record::row(state, &sample, &values));
        Ok(Some((row.join(","), failed.is_some())))
    }
}

/// The names and rows of a table.
///
/// Errors: it cannot be read, a name is of nothing that can be varied, a row has another length, or a cell is no number.
fn table(path: &Path, model: &Model) -> Result<(Vec<String>, Vec<Vec<f64>>), Failure> {
    let wrong = |why: String| Failure::Problem(format!("error: --table {}: {why}", path.display()));
    let unread = |e: csv::Error| {
        wrong(match e.kind() {
            csv::ErrorKind::Utf8 { .. } => "it is not text in UTF-8".to_owned(),
            _ => penny::reason(e),
        })
    };
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).flexible(true).from_path(path).map_err(unread)?;
    let names: Vec<String> = reader.headers().map_err(unread)?.iter().map(str::to_owned).collect();
    names.iter().try_for_each(|name| Slot::find(name, model).map(drop)).map_err(wrong)?;
    let mut rows = Vec::new();
    for (line, record) in reader.records().enumerate() {
        let (row, record) = (line + 1, record.map_err(unread)?);
        if record.len() != names.len() {
            let (cells, columns) = (count(record.len(), "cell", "cells"), count(names.len(), "column", "columns"));
            return Err(wrong(format!("row {row} has {cells}, but the table {columns}")));
        }
        let number = |(name, cell): (&String, &str)| match cell.parse::<f64>() {
            Ok(x) if x.is_finite() => Ok(x),
            _ => Err(wrong(format!("row {row}: {name}: `{cell}` is not a finite number"))),
        };
        rows.push(names.iter().zip(&record).map(number).collect::<Result<_, _>>()?);
    }
    if rows.is_empty() { Err(wrong("it has no rows, so there is no world".to_owned())) } else { Ok((names, rows)) }
}

/// The rows that were written as CSV, as Parquet: the same numbers, bit for bit.
#[cfg(feature = "parquet")]
fn to_parquet(csv: &Path, out: &Path) -> std::io::Result<()> {
    let mut reader = csv::Reader::from_path(csv)?;
    let column = |name: &str| {
        let cells = match name {
            "world" | "evaluations" | "contacts" => record::Cells::Integers,
            "method" => record::Cells::Text,
            _ => record::Cells::Numbers,
        };
        (name.to_owned(), cells)
    };
    let columns: Vec<_> = reader.headers()?.iter().map(column).collect();
    let rows = reader.into_records().map(|row| Ok(row?.iter().map(str::to_owned).collect()));
    let draft = Draft::new(out)?;
    record::write_table(Box::new(draft.open()?), &columns, rows)?;
    draft.keep()
}

/// What stands in its place in a build without.
#[cfg(not(feature = "parquet"))]
fn to_parquet(_: &Path, _: &Path) -> std::io::Result<()> {
    Err(std::io::ErrorKind::Unsupported.into())
}

/// Drawn where standard error is a terminal.
fn bar(worlds: usize, done: usize) -> ProgressBar {
    let bar = ProgressBar::new(worlds as u64);
    if let Ok(style) = ProgressStyle::with_template("  {wide_bar} {pos} of {len} worlds, {eta} to go") {
        bar.set_style(style);
    }
    bar.set_position(done as u64);
    bar
}

/// "hinge" for a joint without a name of its own.
fn named(list: impl Iterator<Item = String>) -> String {
    let list: Vec<String> = list.take(8).collect();
    if list.is_empty() { "it has none".to_owned() } else { format!("it has {}", list.join(", ")) }
}

/// What the model's bodies are called, for messages.
fn bodies(model: &Model) -> String {
    named((1..model.bodies.len()).map(|b| names::body(model, b)))
}
