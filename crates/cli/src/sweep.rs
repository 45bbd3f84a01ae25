//! `penny sweep`: accuracy against cost of every method, and maps of stability.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Value, json};

mod files;
mod floors;
mod summary;

use self::files::{Earlier, Files, PICTURES, cannot};
use super::Failure;
use super::format::{file_name, short, si, table};
use super::map;
use super::mujoco::{MuJoCo, Scene};
use super::scene::{self, LimitArgs, StartArgs};
use penny::contact::{self, Law};
use penny::draft::lock;
use penny::forward::Method;
use penny::integrate::{self, Integrator};
use penny::model::Model;
use penny_lab::plot;
use penny_lab::sweep::diagram::{Words, work_precision};
use penny_lab::sweep::grid::{self, Row, Target, cheapest};
use penny_lab::sweep::reference::{self, Reference};
use penny_lab::sweep::trajectory::{SAMPLES, distance, fit};
use penny_lab::sweep::{Case, truth};
use penny_view::open::open_within;

#[derive(clap::Args)]
pub struct Args {
    /// MJCF file; with --summary any number of them
    #[arg(value_name = "SCENE.xml", required = true)]
    scenes: Vec<PathBuf>,
    /// For each scene the cheapest method for 1e-2, 1e-4 and 1e-6 m, and what --accuracy takes: a table, a CSV file and one picture
    #[arg(long, conflicts_with_all = ["truth", "timesteps", "resume", "map", "integrators"])]
    summary: bool,
    /// Directory for CSV, JSON, SVG and PNG [default: sweep-SCENE]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Contact laws, separated by commas, or `all` [default: all]
    #[arg(long, value_name = "LAWS", value_delimiter = ',', value_parser = scene::laws_parser())]
    laws: Vec<String>,
    /// Integrators, separated by commas [default: all]
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = scene::integrator_parser())]
    integrators: Vec<String>,
    /// Timesteps in seconds: a list `1e-3,1e-4`, or LOW..HIGH, or LOW..HIGH:COUNT, log-spaced; each is changed to the
    /// nearest that divides an eighth of --time into whole steps [default: 1e-5..0.1:9]
    #[arg(long, value_name = "S", value_parser = timesteps, allow_negative_numbers = true)]
    timesteps: Option<Timesteps>,
    /// Simulated time in seconds
    #[arg(long, value_name = "S", value_parser = scene::positive, default_value_t = 1.0, allow_negative_numbers = true)]
    time: f64,
    /// What errors are measured against
    #[arg(long, value_enum, default_value_t = Truth::Converged)]
    truth: Truth,
    /// Most Newton steps of the penalty law in each timestep
    #[arg(long, value_name = "N", default_value_t = penny::forward::ROUNDS, value_parser = scene::at_least_one)]
    rounds: usize,
    #[command(flatten)]
    start: StartArgs,
    /// Continue an interrupted sweep in the same directory (without it, an earlier sweep there is moved aside)
    #[arg(long)]
    resume: bool,
    /// Draw a map of stability over two of timestep, stiffness, damping, mass, mass-ratio, speed, friction instead;
    /// each may carry a range: timestep=1e-4..1,stiffness. It has the scene's contact law unless --laws names others.
    /// Each run takes --time, or 400 steps where that is longer
    #[arg(long, value_name = "X,Y", value_parser = map::axes, conflicts_with_all = ["truth", "timesteps", "resume"])]
    map: Option<map::Axes>,
    /// Cells of a map in each direction, at most 1000
    #[arg(long, value_name = "N", default_value_t = 32, value_parser = cells, requires = "map")]
    cells: usize,
    #[command(flatten)]
    limits: LimitArgs,
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
    let count = scene::at_least_one(count)?;
    if count > MOST_TIMESTEPS {
        return Err(format!("must be at most {MOST_TIMESTEPS} timesteps"));
    }
    Ok(Timesteps::Span(low, high, count))
}

fn cells(text: &str) -> Result<usize, String> {
    scene::at_least_one(text).ok().filter(|n| *n <= MOST_CELLS).ok_or(format!("must be from 1 to {MOST_CELLS}"))
}

/// A name that is given twice is swept once.
fn each_once(names: &[String]) -> impl Iterator<Item = &String> {
    names.iter().enumerate().filter(|(i, name)| !names[..*i].contains(name)).map(|(_, name)| name)
}

const MOST_TIMESTEPS: usize = 1000;
/// Of one run; its truth takes some times as many.
const MOST_STEPS: f64 = 1e10;
/// A million runs.
const MOST_CELLS: usize = 1000;

impl Args {
    fn laws(&self, model: &Model) -> Vec<&'static Law> {
        let named = each_once(&self.laws).filter_map(|name| contact::by_name(name));
        let all = self.laws.is_empty() || self.laws.iter().any(|name| name == "all");
        let mut laws: Vec<_> = if all { contact::ALL.to_vec() } else { named.collect() };
        // Without contacts the laws are one and the same.
        laws.truncate(if contactless(model) { 1 } else { laws.len() });
        laws
    }

    /// The laws of a map: those that were named, else the scene's.
    fn mapped(&self, model: &Model) -> Vec<&'static Law> {
        let laws = self.laws(model);
        let own = model.contact_law().unwrap_or(contact::default().name);
        match contact::by_name(own) {
            Some(own) if self.laws.is_empty() => vec![own],
            _ => laws,
        }
    }

    /// The timesteps to run, s; and, for those that were asked for, a sentence about what became of them.
    fn timesteps(&self, case: &Case) -> (Vec<f64>, String) {
        let asked = match self.timesteps.clone().unwrap_or(DEFAULT_TIMESTEPS) {
            Timesteps::Span(low, high, count) => grid::spaced(low, high, count),
            Timesteps::List(list) => list,
        };
        let fitted = |h: &f64| fit(case.seconds, *h).0;
        let changed = |h: &&f64| (fitted(h) / **h - 1.0).abs() > 0.01;
        let changed: Vec<String> = asked
            .iter()
            .filter(changed)
            .map(|h| format!("{} to {}", si(*h, "s"), si(fitted(h), "s")))
            .filter(|_| self.timesteps.is_some())
            .collect();
        let note = match changed.is_empty() {
            true => String::new(),
            false => format!(
                "timesteps changed, so that a whole number makes an eighth of {}: {}\n",
                si(case.seconds, "s"),
                changed.join(", ")
            ),
        };
        let mut list: Vec<f64> = asked.iter().map(fitted).collect();
        list.sort_by(f64::total_cmp);
        list.dedup();
        (list, note)
    }

    /// Errors: wrong usage, if nobody could wait for a run of this many steps.
    fn can_wait(&self, model: &Model) -> Result<(), Failure> {
        let smallest = match self.timesteps.as_ref().unwrap_or(&DEFAULT_TIMESTEPS) {
            _ if self.map.is_some() => model.opt.timestep,
            Timesteps::Span(low, ..) => *low,
            Timesteps::List(list) => list.iter().copied().fold(f64::INFINITY, f64::min),
        };
        if self.time / smallest <= MOST_STEPS {
            return Ok(());
        }
        Err(Failure::Usage(format!(
            "error: {} at a timestep of {} makes {} steps, more than can be run; the limit is {}",
            si(self.time, "s"),
            si(smallest, "s"),
            short(self.time / smallest),
            short(MOST_STEPS),
        )))
    }

    fn integrators(&self) -> Vec<&'static Integrator> {
        let named: Vec<_> = each_once(&self.integrators).filter_map(|name| integrate::by_name(name)).collect();
        if named.is_empty() { integrate::ALL.to_vec() } else { named }
    }

    /// What a sweep's rows depend on: an interrupted one goes on with the same only.
    fn settings(&self, case: &Case) -> Result<Value, Failure> {
        Ok(json!({
            "scene": self.scene().file_name().map(|n| n.to_string_lossy()), "model": case.model.name,
            "hash": open_within(self.scene(), &self.limits.limits()).map_err(Failure::Problem)?.hash,
            "time": self.time, "truth": truth_name(self.truth), "rounds": self.rounds,
            "qpos": case.start.qpos, "qvel": case.start.qvel, "ctrl": case.start.ctrl,
        }))
    }

    /// The scene, where there is one.
    fn scene(&self) -> &Path {
        self.scenes.first().map_or(Path::new(""), PathBuf::as_path)
    }

    fn directory(&self) -> PathBuf {
        let stem = self.scene().file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        self.out.clone().unwrap_or_else(|| format!("sweep-{stem}").into())
    }
}

/// No constraint of any kind: then all laws are one and the same.
fn contactless(model: &Model) -> bool {
    let requires = &model.requires;
    let tied = model.tendons.iter().any(|t| t.range.is_some() || t.frictionloss > 0.0);
    requires.pairs + requires.swept + requires.limits + requires.frictionloss + requires.equalities == 0 && !tied
}

pub fn sweep(args: &Args) -> Result<(), Failure> {
    if args.summary {
        return summary::summary(args);
    }
    if args.scenes.len() > 1 {
        return Err(Failure::Usage("error: one scene at a time, or --summary for several".to_owned()));
    }
    let directory = args.directory();
    let written: Vec<PathBuf> = files::ALL.iter().map(|file| directory.join(file)).collect();
    let written: Vec<_> = written.iter().map(|path| ("--out", Some(path.as_path()))).collect();
    let model = scene::load_apart(args.scene(), &args.limits, &written)?;
    args.can_wait(&model)?;
    let start = args.start.state(&model)?;
    let case = Case { model, start, seconds: args.time };
    if let Some(axes) = &args.map {
        let request = map::Request {
            path: args.scene(),
            laws: args.mapped(&case.model),
            integrators: args.integrators(),
            case,
            rounds: args.rounds,
            cells: args.cells,
            directory: &directory,
        };
        return map::map(&request, axes);
    }
    let (list, changed) = args.timesteps(&case);
    eprint!("{changed}");
    let laws = args.laws(&case.model);
    let methods = grid::methods(&laws, &args.integrators(), &list, args.rounds);
    let smallest = list.iter().copied().fold(f64::INFINITY, f64::min);

    let settings = args.settings(&case)?;
    let earlier = if args.resume { Earlier::read(&directory, &settings)? } else { Earlier::default() };
    let is_new = !directory.exists();
    fs::create_dir_all(&directory).map_err(cannot(&directory))?;
    // As long as the sweep runs. Where a folder cannot be opened, such as on Windows, it has no lock.
    let open = fs::File::open(&directory).ok();
    open.as_ref().map_or(Ok(()), lock).map_err(cannot(&directory))?;
    // Only with a truth at hand is anything of an earlier sweep touched.
    let found = target(args, &case, &laws, smallest, &earlier.references);
    if found.is_err() && is_new {
        let _ = fs::remove_dir(&directory);
    }
    let (target, notes, unit) = found?;
    let mut files = Files::open(&directory, settings, &target, earlier, args.resume)?;
    let rows = fill(&case, &target, &methods, &mut files, &directory)?;

    let name = args.scene().display().to_string();
    let uncertainty = uncertainties(&target);
    let found = floors::floors(&case, &target, &laws, smallest, &unit, contactless(&case.model));
    let notes = [notes, found.notes].concat();
    let words = Words {
        title: format!("What accuracy costs: {}", file_name(args.scene())),
        subtitle: format!("{} of simulated time\n{}", si(args.time, "s"), notes.join("\n")),
        error: unit.clone(),
    };
    let figure = work_precision(&rows, words, &found.levels);
    for file in PICTURES {
        plot::save(&figure, &directory.join(file)).map_err(|e| Failure::Problem(format!("error: {e}")))?;
    }
    let recommended =
        recommendations(&rows, &unit, &uncertainty, contactless(&case.model), args.truth == Truth::Converged);
    files.finish(&notes, &rows)?;
    print!("{name}, {}\n{}\n{recommended}", si(args.time, "s"), notes.join("\n"));
    println!("{}: sweep.csv, sweep.json, sweep.svg, sweep.png", directory.display());
    Ok(())
}

/// Runs the methods that have no row yet, on all cores, and writes their rows; then times all of them, one after the other.
///
/// Out: the rows, by law, integrator and timestep.
///
/// Errors: they cannot be written.
fn fill(
    case: &Case,
    target: &Target,
    methods: &[Method],
    files: &mut Files,
    directory: &Path,
) -> Result<Vec<Row>, Failure> {
    let todo: Vec<Method> = methods.iter().copied().filter(|m| !files.rows.iter().any(|r| grid::is_of(r, m))).collect();
    let place = directory.display();
    if todo.len() < methods.len() {
        eprintln!("{place}: {} of {} rows are there already", methods.len() - todo.len(), methods.len());
    }
    if !todo.is_empty() {
        eprintln!("{place}: rows are written as they are computed; --resume continues an interrupted sweep");
    }
    let progress = bar("accuracy", work(&todo));
    let mut problem = None;
    grid::accuracy(case, target, &todo, |row| {
        progress.inc(row.steps as u64);
        problem = files.append(row).err().or(problem.take());
    });
    progress.finish_and_clear();
    problem.take().map_or(Ok(()), |e| Err(Failure::from(e)))?;

    let progress = bar("cost", files.rows.len() as u64);
    let mut rows = std::mem::take(&mut files.rows);
    rows.sort_by(|a, b| (&a.law, &a.integrator).cmp(&(&b.law, &b.integrator)).then(a.timestep.total_cmp(&b.timestep)));
    grid::costs(case, methods, &mut rows, |rows| {
        progress.inc(1);
        problem = files.rewrite(rows).err().or(problem.take());
    });
    progress.finish_and_clear();
    problem.map_or(Ok(()), |e| Err(Failure::from(e)))?;
    Ok(rows)
}

/// Names and what each needs, a line each.
fn list(known: &[Vec<String>]) -> String {
    let width = known.iter().map(|line| line[0].len()).max().unwrap_or(0);
    known.iter().map(|line| format!("  {:width$}  {}\n", line[0], line[1])).collect()
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
    known: &BTreeMap<String, Reference>,
) -> Result<(Target, Vec<String>, String), Failure> {
    let position = "position [m]".to_owned();
    // One that was found before, if it is fine enough.
    let known =
        |law: &Law, timestep: f64| known.get(law.name).filter(|r| r.timestep <= timestep * (1.0 + 1e-9)).cloned();
    match args.truth {
        Truth::Converged => {
            let fine = reference::timestep(case, smallest);
            let (mut references, mut notes) = (BTreeMap::new(), Vec::new());
            let missing: Vec<_> = laws.iter().copied().filter(|law| known(law, fine).is_none()).collect();
            let bar = bar("truth", reference::work(case, missing.len(), smallest).max(1));
            let found = reference::converged(case, &missing, smallest, |steps| bar.inc(steps));
            bar.finish_and_clear();
            let found: BTreeMap<_, _> = missing.iter().map(|law| law.name).zip(found).collect();
            for law in laws {
                let Some(found) = known(law, fine).or_else(|| found.get(law.name).cloned().flatten()) else {
                    notes.push(format!("{}: no reference, it diverges even at the smallest timestep", law.name));
                    continue;
                };
                let name = if contactless(&case.model) { "all laws (nothing touches)" } else { law.name };
                notes.push(format!(
                    "{name}: reference solution: {}, uncertainty {} m",
                    found.about,
                    plot::number(found.uncertainty)
                ));
                references.insert(law.name, found);
            }
            Ok((Target::Poses(references), notes, position))
        }
        Truth::Mujoco => {
            let fine = (smallest / 2.0).max(args.time / 2e5);
            let bar = bar("finding the truth", 0);
            let found = match laws.iter().find_map(|law| known(law, fine)) {
                Some(found) => found,
                None => mujoco(args, case, fine)?,
            };
            bar.finish_and_clear();
            let note =
                format!("reference solution: {}, uncertainty {} m", found.about, plot::number(found.uncertainty));
            let references = laws.iter().map(|law| (law.name, found.clone())).collect();
            Ok((Target::Poses(references), vec![note], position))
        }
        Truth::Analytic => {
            let name = truth::of(&case.model).ok_or_else(|| {
                let known = truth::ALL.iter().map(|t| vec![t.name.to_owned(), t.needs.to_owned()]).collect::<Vec<_>>();
                Failure::Usage(format!(
                    "error: the scene names no closed form: add \
                     <custom><text name=\"penny.truth\" data=\"…\"/></custom> with one of these, or use --truth converged\n{}",
                    list(&known)
                ))
            })?;
            let found = truth::by_name(name).ok_or_else(|| {
                Failure::Problem(format!("error: the scene names the closed form `{name}`, which Penny does not have"))
            })?;
            let method = grid::methods(laws, &args.integrators(), &[smallest], args.rounds);
            let method = method.first().ok_or_else(|| Failure::Usage("error: no method to run".to_owned()))?;
            let exact = found.of(case, method).map_err(|why| Failure::Problem(format!("error: {why}")))?;
            let note = format!("reference: {}: {} = {}", found.about, found.quantity, short(exact));
            Ok((Target::Exact(found), vec![note], found.quantity.to_owned()))
        }
    }
}

/// MuJoCo at a timestep smaller than the sweep's smallest, and at twice that: with the scene's integrator and with RK4,
/// of which the one counts that changes least.
fn mujoco(args: &Args, case: &Case, fine: f64) -> Result<Reference, Failure> {
    let mut mujoco = MuJoCo::start()?;
    let mut best: Option<Reference> = None;
    let own = integrate::by_name(&case.model.opt.integrator);
    for integrator in own.into_iter().chain([&integrate::rk4::METHOD]) {
        let mut run = |h: f64| {
            let (timestep, each) = fit(args.time, h);
            let method = Method { contact: contact::ALL[0], integrator, timestep, rounds: penny::forward::ROUNDS };
            mujoco.load(&Scene::Path(args.scene()), &case.model, &method, &case.start, true)?;
            mujoco.rollout(each * SAMPLES, each).map(|rows| reference::from_qpos(case, &rows))
        };
        let (samples, coarser) = (run(fine)?, run(2.0 * fine)?);
        let difference = distance(&case.model, &samples, &coarser).filter(|_| samples.len() == SAMPLES);
        if let Some(uncertainty) = difference.filter(|u| best.as_ref().is_none_or(|b| *u < b.uncertainty)) {
            let about = format!("MuJoCo 4.0.0 with {} at h = {} s", integrator.name, plot::number(fine));
            best = Some(Reference { samples, uncertainty, about, timestep: fine });
        }
    }
    best.ok_or_else(|| Failure::Problem("error: MuJoCo's own run is unstable: it is no reference".to_owned()))
}

fn uncertainties(target: &Target) -> BTreeMap<String, f64> {
    match target {
        Target::Poses(references) => references.iter().map(|(law, r)| ((*law).to_owned(), r.uncertainty)).collect(),
        Target::Exact(_) => BTreeMap::new(),
    }
}

/// The cheapest method for each accuracy, as a table. `contactless`: the laws are one and the same.
fn recommendations(
    rows: &[Row],
    unit: &str,
    uncertainty: &BTreeMap<String, f64>,
    contactless: bool,
    own_truths: bool,
) -> String {
    let mut lines = vec![
        ["error at most", "cheapest method", "timestep", "error", "a step", "times real time"]
            .map(str::to_owned)
            .to_vec(),
    ];
    for tolerance in TOLERANCES {
        let mut line = vec![format!("{tolerance:.0e}")];
        match cheapest(rows, tolerance) {
            Some(row) => line.extend([
                if contactless { row.integrator.clone() } else { format!("{} with {}", row.law, row.integrator) },
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
    let doubtful = uncertainty.iter().filter(|(_, u)| **u > TOLERANCES[2]).map(|(law, u)| format!("{law} {u:.1e} m"));
    let doubtful: Vec<_> = doubtful.collect();
    if !doubtful.is_empty() {
        text += &format!(
            "  (smaller errors are below the uncertainty of the reference solution: {})\n",
            doubtful.join(", ")
        );
    }
    if own_truths && rows.iter().any(|r| r.law != rows[0].law) {
        text += "  Each law is compared with its own reference solution: this ranks methods by cost, not laws by accuracy.\n";
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
