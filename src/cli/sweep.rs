//! `penny sweep`: accuracy against cost of every method, and maps of stability.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Value, json};

use super::Failure;
use super::format::{short, si, table};
use super::mujoco::{MuJoCo, Scene};
use super::scene::{self, StartArgs};
use crate::contact::{self, Law};
use crate::forward::Method;
use crate::integrate::{self, Integrator};
use crate::model::Model;
use crate::plot;
use crate::sweep::diagram::{Words, work_precision};
use crate::sweep::grid::{self, Row, Target, cheapest};
use crate::sweep::reference::{self, Reference, converged};
use crate::sweep::trajectory::{SAMPLES, distance, fit};
use crate::sweep::{Case, truth};

#[derive(clap::Args)]
pub struct Args {
    /// MJCF file
    #[arg(value_name = "SCENE.xml")]
    scene: PathBuf,
    /// Directory for CSV, JSON, SVG and PNG [default: sweep-SCENE]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Contact laws, with commas [default: all]
    #[arg(long, value_name = "LAWS", value_delimiter = ',', value_parser = scene::law_parser())]
    laws: Vec<String>,
    /// Integrators, with commas [default: all]
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = scene::integrator_parser())]
    integrators: Vec<String>,
    /// Timesteps in seconds: a list `1e-3,1e-4`, or LOW..HIGH, or LOW..HIGH:COUNT, log-spaced [default: 1e-5..0.1:9]
    #[arg(long, value_name = "S", value_parser = timesteps, allow_negative_numbers = true)]
    timesteps: Option<Timesteps>,
    /// Simulated time in seconds
    #[arg(long, value_name = "S", value_parser = scene::positive, default_value_t = 1.0, allow_negative_numbers = true)]
    time: f64,
    /// What errors are measured against
    #[arg(long, value_enum, default_value_t = Truth::Converged)]
    truth: Truth,
    /// Rounds of normals and friction in the penalty law
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = scene::at_least_one)]
    rounds: usize,
    #[command(flatten)]
    start: StartArgs,
    /// Go on with an interrupted sweep in the same directory
    #[arg(long)]
    resume: bool,
    /// Draw the map of stability over two of timestep, stiffness, damping, mass, mass-ratio, speed, friction instead;
    /// each may carry a range: timestep=1e-4..1,stiffness
    #[arg(long, value_name = "X,Y", value_parser = super::map::axes)]
    map: Option<super::map::Axes>,
    /// Cells of a map in each direction
    #[arg(long, value_name = "N", default_value_t = 32, value_parser = scene::at_least_one)]
    cells: usize,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Truth {
    /// The same law at a much smaller timestep, with a check that it has converged
    Converged,
    /// MuJoCo 4.0.0 at a much smaller timestep, through Python
    Mujoco,
    /// The closed form that the scene names: <custom><text name="penny.truth" data="…"/>
    Analytic,
}

#[derive(Clone)]
enum Timesteps {
    List(Vec<f64>),
    Span(f64, f64, usize),
}

const DEFAULT_TIMESTEPS: Timesteps = Timesteps::Span(1e-5, 0.1, 9);
/// Accuracies for which the cheapest method is named.
const TOLERANCES: [f64; 3] = [1e-2, 1e-4, 1e-6];

fn timesteps(text: &str) -> Result<Timesteps, String> {
    let Some((low, rest)) = text.split_once("..") else {
        return text.split(',').map(scene::positive).collect::<Result<_, _>>().map(Timesteps::List);
    };
    let (high, count) = rest.split_once(':').unwrap_or((rest, "9"));
    let (low, high) = (scene::positive(low)?, scene::positive(high)?);
    if low >= high {
        return Err("the first timestep of a range must be the smaller one".to_owned());
    }
    Ok(Timesteps::Span(low, high, scene::at_least_one(count)?))
}

impl Args {
    fn laws(&self, model: &Model) -> Vec<&'static Law> {
        let named: Vec<_> = self.laws.iter().filter_map(|name| contact::by_name(name)).collect();
        match named.is_empty() {
            false => named,
            // Without contacts the laws are one and the same.
            true if contactless(model) => contact::ALL.iter().copied().take(1).collect(),
            true => contact::ALL.to_vec(),
        }
    }

    fn integrators(&self) -> Vec<&'static Integrator> {
        let named: Vec<_> = self.integrators.iter().filter_map(|name| integrate::by_name(name)).collect();
        if named.is_empty() { integrate::ALL.to_vec() } else { named }
    }

    fn directory(&self) -> PathBuf {
        let stem = self.scene.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        self.out.clone().unwrap_or_else(|| format!("sweep-{stem}").into())
    }
}

fn contactless(model: &Model) -> bool {
    let plan = &model.plan;
    plan.pairs + plan.swept + plan.limits + plan.frictionloss == 0
}

pub fn sweep(args: &Args) -> Result<(), Failure> {
    let model = scene::load(&args.scene)?;
    let start = args.start.state(&model)?;
    let case = Case { model, start, seconds: args.time };
    let directory = args.directory();
    if let Some(axes) = &args.map {
        let laws = args.laws(&case.model);
        return super::map::map(&args.scene, case, &laws, &args.integrators(), axes, args.cells, &directory);
    }
    let list = match args.timesteps.clone().unwrap_or(DEFAULT_TIMESTEPS) {
        Timesteps::Span(low, high, count) => grid::timesteps(&case, low, high.min(args.time / SAMPLES as f64), count),
        Timesteps::List(list) => list.into_iter().map(|h| fit(args.time, h).0).collect(),
    };
    let laws = args.laws(&case.model);
    let methods = grid::methods(&laws, &args.integrators(), &list, args.rounds);
    let smallest = list.iter().copied().fold(f64::INFINITY, f64::min);

    let settings = json!({
        "scene": args.scene.file_name().map(|n| n.to_string_lossy()), "model": case.model.name,
        "time": args.time, "truth": truth_name(args.truth), "rounds": args.rounds,
        "qpos": case.start.qpos, "qvel": case.start.qvel, "ctrl": case.start.ctrl,
    });
    let mut files = Files::open(&directory, &settings, args.resume)?;
    let todo: Vec<Method> = methods.iter().copied().filter(|m| !files.rows.iter().any(|r| grid::is_of(r, m))).collect();
    if todo.len() < methods.len() {
        eprintln!(
            "{}: {} of {} rows are there already",
            directory.display(),
            methods.len() - todo.len(),
            methods.len()
        );
    }

    let bar = bar("finding the truth", 0);
    let (target, notes, unit) = target(args, &case, &laws, smallest)?;
    bar.finish_and_clear();
    let bar = self::bar("accuracy", work(&todo));
    let mut problem = None;
    grid::accuracy(&case, &target, &todo, |row| {
        bar.inc(row.steps as u64);
        problem = files.append(row).err().or(problem.take());
    });
    bar.finish_and_clear();
    problem.take().map_or(Ok(()), |e| Err(Failure::from(e)))?;

    let bar = self::bar("cost", files.rows.len() as u64);
    let mut rows = std::mem::take(&mut files.rows);
    rows.sort_by(|a, b| (&a.law, &a.integrator).cmp(&(&b.law, &b.integrator)).then(a.timestep.total_cmp(&b.timestep)));
    grid::costs(&case, &methods, &mut rows, |rows| {
        bar.inc(1);
        problem = files.rewrite(rows).err().or(problem.take());
    });
    bar.finish_and_clear();
    problem.map_or(Ok(()), |e| Err(Failure::from(e)))?;

    let name = args.scene.display().to_string();
    let uncertainty = uncertainties(&target);
    let words = Words {
        title: format!("What accuracy costs: {name}"),
        subtitle: format!("{} of simulated time\n{}", si(args.time, "s"), notes.join("\n")),
        error: unit.clone(),
    };
    let figure = work_precision(&rows, words, &uncertainty);
    for file in ["sweep.svg", "sweep.png"] {
        plot::save(&figure, &directory.join(file)).map_err(|e| Failure::Problem(format!("error: {e}")))?;
    }
    let recommended = recommendations(&rows, &unit, &uncertainty);
    files.finish(&settings, &notes, &rows)?;
    eprint!("{name}, {}\n{}\n{recommended}", si(args.time, "s"), notes.join("\n"));
    eprintln!("{}: sweep.csv, sweep.json, sweep.svg, sweep.png", directory.display());
    Ok(())
}

fn truth_name(truth: Truth) -> &'static str {
    match truth {
        Truth::Converged => "converged",
        Truth::Mujoco => "mujoco",
        Truth::Analytic => "analytic",
    }
}

/// Work of a pass, in steps.
fn work(methods: &[Method]) -> u64 {
    methods.iter().map(|m| (1.0 / m.timestep) as u64).sum()
}

/// What errors are measured against, what there is to say about it, and what the error is of.
fn target(
    args: &Args,
    case: &Case,
    laws: &[&'static Law],
    smallest: f64,
) -> Result<(Target, Vec<String>, String), Failure> {
    let position = "position [m]".to_owned();
    match args.truth {
        Truth::Converged => {
            let (mut references, mut notes) = (BTreeMap::new(), Vec::new());
            for law in laws {
                let Some(found) = converged(case, law, smallest) else {
                    notes.push(format!("{}: no reference, it diverges even at the smallest timestep", law.name));
                    continue;
                };
                let name = if contactless(&case.model) { "all laws (nothing touches)" } else { law.name };
                notes.push(format!(
                    "{name}: truth is {}, uncertain by {} m",
                    found.about,
                    plot::number(found.uncertainty)
                ));
                references.insert(law.name, found);
            }
            Ok((Target::Poses(references), notes, position))
        }
        Truth::Mujoco => {
            let found = mujoco(args, case, smallest)?;
            let note = format!("truth is {}, uncertain by {} m", found.about, plot::number(found.uncertainty));
            let references = laws.iter().map(|law| (law.name, found.clone())).collect();
            Ok((Target::Poses(references), vec![note], position))
        }
        Truth::Analytic => {
            let known = || truth::ALL.iter().map(|t| t.name).collect::<Vec<_>>().join(", ");
            let name = truth::of(&case.model).ok_or_else(|| {
                Failure::Usage(format!(
                    "error: the scene names no closed form: add <custom><text name=\"penny.truth\" data=\"…\"/></custom> \
                     with one of {}, or use --truth converged",
                    known()
                ))
            })?;
            let found = truth::by_name(name).ok_or_else(|| {
                Failure::Problem(format!("error: the scene names the closed form `{name}`; Penny has {}", known()))
            })?;
            let method = grid::methods(laws, &args.integrators(), &[smallest], args.rounds);
            let exact = method.first().and_then(|m| (found.exact)(case, m)).ok_or_else(|| {
                Failure::Problem(format!("error: the scene is not what the closed form `{name}` is about"))
            })?;
            let note = format!("truth is {}: {} = {}", found.about, found.quantity, short(exact));
            Ok((Target::Exact(found), vec![note], found.quantity.to_owned()))
        }
    }
}

/// MuJoCo at a timestep smaller than the sweep's smallest, and at twice that.
fn mujoco(args: &Args, case: &Case, smallest: f64) -> Result<Reference, Failure> {
    let mut mujoco = MuJoCo::start()?;
    let integrator = integrate::by_name(&case.model.opt.integrator)
        .ok_or_else(|| Failure::Problem(format!("error: unknown integrator `{}`", case.model.opt.integrator)))?;
    let fine = (smallest / 2.0).max(args.time / 2e5);
    let mut run = |h: f64| {
        let (timestep, each) = fit(args.time, h);
        let method = Method { contact: contact::ALL[0], integrator, timestep, rounds: 1 };
        mujoco.load(&Scene::Path(&args.scene), &case.model, &method, &case.start, true)?;
        mujoco.rollout(each * SAMPLES, each).map(|rows| reference::from_qpos(case, &rows))
    };
    let (samples, coarser) = (run(fine)?, run(2.0 * fine)?);
    let uncertainty = distance(&case.model, &samples, &coarser)
        .filter(|_| samples.len() == SAMPLES)
        .ok_or_else(|| Failure::Problem("error: MuJoCo's own run is unstable: it is no reference".to_owned()))?;
    Ok(Reference { samples, uncertainty, about: format!("MuJoCo 4.0.0 at h = {} s", plot::number(fine)) })
}

fn uncertainties(target: &Target) -> BTreeMap<String, f64> {
    match target {
        Target::Poses(references) => references.iter().map(|(law, r)| ((*law).to_owned(), r.uncertainty)).collect(),
        Target::Exact(_) => BTreeMap::new(),
    }
}

/// The cheapest method for each accuracy, as a table.
fn recommendations(rows: &[Row], unit: &str, uncertainty: &BTreeMap<String, f64>) -> String {
    let mut lines = vec![
        ["error at most", "cheapest method", "timestep", "error", "a step", "times real time"]
            .map(str::to_owned)
            .to_vec(),
    ];
    for tolerance in TOLERANCES {
        let mut line = vec![format!("{tolerance:.0e}")];
        match cheapest(rows, tolerance) {
            Some(row) => line.extend([
                format!("{} with {}", row.law, row.integrator),
                si(row.timestep, "s"),
                format!("{:.1e}", row.error.unwrap_or(f64::NAN)),
                si(row.ns_per_step.unwrap_or(f64::NAN) * 1e-9, "s"),
                short(1e9 / row.ns_per_simulated_second.unwrap_or(f64::NAN)),
            ]),
            None => line.push("none of these".to_owned()),
        }
        lines.push(line);
    }
    let unstable = rows.iter().filter(|r| !r.stable).count();
    let mut text = format!("\nError of {unit}\n{}", table(&lines));
    if let Some((law, u)) = uncertainty.iter().find(|(_, u)| **u > TOLERANCES[2]) {
        text += &format!("  (the truth for {law} is itself uncertain by {u:.1e} m)\n");
    }
    if unstable > 0 {
        text += &format!("  {unstable} of {} methods were unstable\n", rows.len());
    }
    text + "\n"
}

fn bar(what: &'static str, length: u64) -> ProgressBar {
    let bar = if length == 0 { ProgressBar::new_spinner() } else { ProgressBar::new(length) };
    let template = if length == 0 { "  {msg} …" } else { "  {msg:<10} {wide_bar} {percent} %, {eta} to go" };
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar.set_message(what);
    bar.tick();
    bar
}

/// What a sweep writes while it runs.
struct Files {
    csv: PathBuf,
    json: PathBuf,
    rows: Vec<Row>,
}

impl Files {
    /// Makes the directory; with `resume` reads the rows that are there.
    fn open(directory: &Path, settings: &Value, resume: bool) -> Result<Files, Failure> {
        let cannot =
            |e: std::io::Error| Failure::Problem(format!("error: {} cannot be written: {e}", directory.display()));
        fs::create_dir_all(directory).map_err(cannot)?;
        let mut files =
            Files { csv: directory.join("sweep.csv"), json: directory.join("sweep.json"), rows: Vec::new() };
        if resume {
            files.resume(settings)?;
        }
        let document = json!({ "settings": settings, "finished": false });
        fs::write(&files.json, format!("{document:#}\n")).map_err(cannot)?;
        files.rewrite(&files.rows.clone()).map_err(cannot)?;
        Ok(files)
    }

    fn resume(&mut self, settings: &Value) -> Result<(), Failure> {
        let directory = self.csv.parent().map(|p| p.display().to_string()).unwrap_or_default();
        let text = fs::read_to_string(&self.json)
            .map_err(|_| Failure::Usage(format!("error: there is no sweep in {directory} to resume")))?;
        let before: Value = serde_json::from_str(&text).unwrap_or_default();
        if before["settings"] != *settings {
            let text = format!("error: the sweep in {directory} had other settings: {}", before["settings"]);
            return Err(Failure::Usage(text));
        }
        let mut reader = csv::Reader::from_path(&self.csv).map_err(|e| Failure::Problem(format!("error: {e}")))?;
        // The last line may be half a line.
        self.rows = reader.deserialize().filter_map(Result::ok).collect();
        Ok(())
    }

    fn append(&mut self, row: Row) -> std::io::Result<()> {
        let mut file = fs::OpenOptions::new().append(true).open(&self.csv)?;
        file.write_all(&lines(std::slice::from_ref(&row), self.rows.is_empty())?)?;
        self.rows.push(row);
        Ok(())
    }

    /// All rows anew, in one go: an interruption leaves the old file or the new one.
    fn rewrite(&self, rows: &[Row]) -> std::io::Result<()> {
        let aside = self.csv.with_extension("csv.new");
        fs::write(&aside, lines(rows, true)?)?;
        fs::rename(aside, &self.csv)
    }

    fn finish(&self, settings: &Value, notes: &[String], rows: &[Row]) -> Result<(), Failure> {
        let document = json!({ "settings": settings, "finished": true, "truth": notes, "rows": rows });
        fs::write(&self.json, format!("{document:#}\n")).map_err(Failure::from)
    }
}

fn lines(rows: &[Row], header: bool) -> std::io::Result<Vec<u8>> {
    let mut writer = csv::WriterBuilder::new().has_headers(header).from_writer(Vec::new());
    rows.iter().try_for_each(|row| writer.serialize(row))?;
    writer.into_inner().map_err(|e| std::io::Error::other(e.to_string()))
}
