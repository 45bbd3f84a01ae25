//! `penny run`: simulates a scene, tells about it, and writes it down where asked.

use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

mod summary;
mod table;
pub mod warnings;

use self::table::Table;
use self::warnings::{EnergyGain, Overlap};
use super::accuracy::{self, AccuracyArgs, Chosen, Stepper};
use super::doubts;
use super::explain::{hopping, largest_timestep, requirements};
use super::files;
use super::format::{count, short, si};
use super::interrupt::Interrupt;
use super::scene::{self, LengthArgs, LimitArgs, MethodArgs, OverrideArgs, StartArgs};
use super::{Failure, Report};
use penny::control::Failed;
use penny::data::Data;
use penny::draft::Draft;
use penny::forward::{Method, StepError};
use penny::model::Model;
use penny::state::State;
use penny_lab::explain::{self, Budget, Touch, probe};
use penny_lab::record::{self, Balance, Csv, Json, Lines, Picture, Quantity, Recorder, Sample};
use penny_lab::sweep::theory;
use penny_lab::{names, plot};

#[derive(clap::Args)]
pub struct Args {
    /// MJCF file
    #[arg(value_name = "SCENE.xml")]
    scene: PathBuf,
    #[command(flatten)]
    length: LengthArgs,
    /// Write every N-th step into the files of --csv, --json and --plot
    #[arg(long, value_name = "N", default_value_t = 1)]
    #[arg(value_parser = scene::at_least_one, allow_negative_numbers = true)]
    every: usize,
    #[command(flatten)]
    method: MethodArgs,
    #[command(flatten)]
    accuracy: AccuracyArgs,
    #[command(flatten)]
    start: StartArgs,
    #[command(flatten)]
    overrides: OverrideArgs,
    /// What to show: names (`crate.z`, `hinge`, `ground-crate.fn`) or groups (position, velocity, rotation, joints, forces,
    /// contacts, actuators, sensors, energy, all), with commas between them. It chooses the table's columns and what --plot draws, and
    /// adds columns of these names to --csv and --json
    #[arg(long, value_name = "WHAT", value_delimiter = ',')]
    show: Vec<String>,
    /// Write the state at the end of the run, for --load-state
    #[arg(long, value_name = "FILE|-", conflicts_with = "accuracy")]
    save_state: Option<PathBuf>,
    /// Write the trajectory as CSV; `-` is standard output
    #[arg(long, value_name = "FILE|-")]
    csv: Option<PathBuf>,
    /// Write the trajectory as JSON; `-` is standard output. The file is valid even if the run is interrupted
    #[arg(long, value_name = "FILE|-")]
    json: Option<PathBuf>,
    /// Write the trajectory as Parquet, with the columns of --csv (a build with `--features parquet`)
    #[arg(long, value_name = "FILE|-")]
    parquet: Option<PathBuf>,
    /// Draw position, energy, penetration and phase over time, or what --show names: a file that ends in .svg or .png
    #[arg(long, value_name = "FILE", value_parser = scene::picture)]
    plot: Option<PathBuf>,
    #[command(flatten)]
    limits: LimitArgs,
}

/// Lines of the table over time.
const LINES: usize = 10;
/// Looks at the energy in a run, at least.
const LOOKS: usize = 200;
/// Steps between two looks at the clock.
const BATCH: usize = 4096;
/// Real time for what is tried before the first step, s; the development build is slower.
const TRYING: f64 = if cfg!(debug_assertions) { 4.0 } else { 0.2 };
/// Whose limit it is where a trial run found it.
const THE_SCENE: &str = "the scene";
/// A run that takes longer than this shows its progress.
const PATIENCE: Duration = Duration::from_secs(1);

pub fn run(args: &Args) -> Result<(), Failure> {
    let written = [
        ("--csv", &args.csv),
        ("--json", &args.json),
        ("--parquet", &args.parquet),
        ("--plot", &args.plot),
        ("--save-state", &args.save_state),
    ];
    let written = written.map(|(option, path)| (option, path.as_deref()));
    let data_out = written.iter().any(|(_, path)| *path == Some(Path::new("-")));
    let report = if data_out { Report::StandardError } else { Report::StandardOutput };
    let mut model = scene::load_apart(&args.scene, &args.limits, &written)?;
    args.overrides.apply(&mut model)?;
    let model = model;
    let method = args.method.method(&model)?;
    let mut state = args.start.state(&model)?;
    let steps = args.length.steps(method.timestep)?;
    let chosen = match args.accuracy.accuracy {
        Some(_) if args.length.counted() => {
            let why = "error: --accuracy finds the steps itself: give --time instead of --steps";
            return Err(Failure::Usage(why.to_owned()));
        }
        None => Chosen::asked(method, steps),
        Some(wanted) => accuracy::choose(&model, &method, &state, steps as f64 * method.timestep, wanted)?,
    };
    let Chosen { method, steps, controlled, rows: chosen } = chosen;
    let shown = record::chosen(&model, &args.show).map_err(|e| Failure::Usage(format!("error: --show: {e}")))?;
    for (_, path) in written {
        path.map_or(Ok(()), files::writable)?;
    }
    let interrupt = Interrupt::watch()?;
    let mut outputs = Outputs::open(args, &model, &method, &shown)?;
    let drawn = outputs.picture.as_ref().map(Picture::quantities).unwrap_or_default();
    let mut recorder = Recorder::new(&model);
    let first = recorder.sample(&model, &state);
    let overlap = Overlap::find(&model, recorder.contacts());
    let touches = explain::touches(&model);
    let budget = Budget::seconds(TRYING);
    let (mut text, limit) = account(&args.scene, &model, &method, &state, steps, &touches, &budget);
    for [name, value] in chosen {
        text += &row(&name, &value);
    }
    report.print(&text);
    for doubt in before(&model, &method, &state, &limit, &budget, overlap.as_ref()) {
        eprintln!("{doubt}");
    }

    let mut table = Table::new(&model, &shown);
    let mut data = Data::new(&model);
    let mut stepper = Stepper::new(&model, &method, &state, steps, controlled)?;
    let [stride, look] = [LINES, LOOKS].map(|n| steps.div_ceil(n).max(1));
    let progress = Progress::new(steps);
    let mut elapsed = Duration::ZERO;
    let mut failed = None;
    let mut energy = EnergyGain::new(&model, &first);
    let mut balance = Balance::new(&model, method.integrator);
    let mut last = first;
    let mut overflow = None;
    let mut fast: Option<String> = None;
    let mut i = 0;
    loop {
        let (written, listed) = (outputs.any() && i % args.every == 0, i % stride == 0 || i == steps);
        let looked = i % look == 0 || i == steps;
        if written || listed || looked {
            let sample = recorder.sample(&model, &state);
            if written {
                let values = recorder.values(&model, &method, &state, &sample, &shown);
                outputs.write(&state, &sample, &values)?;
                if let Some(picture) = &mut outputs.picture {
                    let values = recorder.values(&model, &method, &state, &sample, &drawn);
                    picture.push(&state, &sample, &values);
                }
            }
            if listed {
                let values = recorder.values(&model, &method, &state, &sample, table.quantities());
                table.push(&state, &sample, values);
            }
            if looked {
                recorder.forces(&model, &method, &state);
                energy.enter(&model, &state, &sample, recorder.data());
                if fast.is_none() {
                    let left = (steps - i) as f64 * method.timestep;
                    fast = doubts::tunnels(&model, &method, &state, recorder.data(), &touches, left);
                    eprint!("{}", fast.as_deref().unwrap_or_default());
                }
            }
            if !sample.energy.is_finite() {
                overflow = overflow.or(Some(state.time));
            }
            last = sample;
        }
        if i == steps {
            break;
        }
        // On to the next step that something is done at.
        let row = if outputs.any() { args.every } else { BATCH };
        // Where steps take long, the clock is looked at more often.
        let batch = (PATIENCE.as_secs_f64() / 4.0 * i as f64 / elapsed.as_secs_f64().max(1e-9)) as usize;
        let batch = if i == 0 { 1 } else { batch.clamp(1, BATCH) };
        let until = [row, stride, look, batch].map(|n| (i / n + 1) * n).into_iter().min().unwrap_or(steps).min(steps);
        let before = Instant::now();
        let outcome = (i..until).try_for_each(|i| {
            balance.before(&state);
            let outcome = stepper.step(&model, &method, i + 1, &mut state, &mut data);
            balance.after(&model, &state, &data, method.timestep);
            outcome
        });
        elapsed += before.elapsed();
        outputs.tick()?;
        if let Err(error) = outcome {
            failed = Some(error);
            break;
        }
        i = until;
        progress.at(i, elapsed);
        if interrupt.code().is_some() {
            last = recorder.sample(&model, &state);
            break;
        }
    }
    progress.finish();
    if interrupt.code().is_some() && i < steps {
        eprintln!("warning: interrupted at {}, after {i} of {}", si(state.time, "s"), count(steps, "step", "steps"));
    }
    let steps = i;
    report.print(&format!("\n{}", table.text(&model)));
    let picture = outputs.finish()?;
    if let (Some(path), Some(picture)) = (&args.plot, picture) {
        let how = format!("{}, {}, h = {}", method.contact.name, method.integrator.name, si(method.timestep, "s"));
        let start = args.start.told();
        let how = if start.is_empty() { how } else { format!("{how}; start: {start}") };
        let figure = picture.figure(&args.scene.display().to_string(), &how);
        plot::save(&figure, path).map_err(|e| Failure::Problem(format!("error: {e}")))?;
    }
    if let Some(error) = failed {
        return Err(Failure::Problem(self::report(&model, &method, &data, &error)));
    }
    if let Some(path) = &args.save_state {
        files::write_state(path, &model, &method, &state)?;
    }
    if steps > 0 {
        recorder.forces(&model, &method, &state);
        report.print(&summary::contacts(&model, recorder.data()));
        // Controlled steps end between the rows: what they did is not in the balance.
        let balance = controlled.is_none().then_some(&balance);
        report.print(&summary::energy(&model, &first, &last, energy.kinetic(), balance));
        // Of controlled steps only the rows are counted here.
        let unit = if controlled.is_some() { ["row", "rows"] } else { ["step", "steps"] };
        report.print(&format!("  {}\n", pace(steps, unit, method.timestep, elapsed)));
        eprint!("{}", super::explain::unsolved(&data, &method, steps));
    }
    if let Some(time) = overflow {
        eprintln!(
            "warning: from {} on the energy is too large a number, more than 1.8e308 J: it is `inf` in CSV and `null` in \
             JSON; check masses, sizes and speeds",
            si(time, "s")
        );
    }
    if energy.grew() {
        eprintln!("{}", energy.told(&model, &method, overlap.as_ref(), limit.as_ref(), data.unconverged));
    }
    interrupt.code().map_or(Ok(()), |code| Err(Failure::Interrupted(code)))
}

/// All that is doubtful before the first step.
fn before(
    model: &Model,
    method: &Method,
    state: &State,
    limit: &Limit,
    budget: &Budget,
    overlap: Option<&Overlap>,
) -> Vec<String> {
    let mut list = doubts::of_start(model, state, "at the start");
    list.extend(doubts::of_scene(model));
    list.extend(doubts::quaternions(model, state));
    // What lies deep in one another is thrown apart at any timestep.
    let limit = &limit.clone().filter(|(_, whose)| overlap.is_none() || whose != THE_SCENE);
    let told = scene::clamped_controls(model, state) + &warning(model, method, state, limit, budget);
    list.extend(told.lines().map(str::to_owned));
    list.extend(overlap.map(|o| o.warning(model)));
    list
}

/// The same for who does not run the scene here.
#[cfg(feature = "play")]
pub fn doubtful(model: &Model, method: &Method, state: &State) -> Vec<String> {
    let mut recorder = Recorder::new(model);
    recorder.sample(model, state);
    let overlap = Overlap::find(model, recorder.contacts());
    let (touches, budget) = (explain::touches(model), Budget::seconds(TRYING));
    let limit = largest_timestep(model, method, &touches, &budget);
    let limit = limit.filter(|(limit, _)| *limit < explain::probe::LARGEST);
    let limit = safe(model, method, state, limit, &budget);
    before(model, method, state, &limit, &budget, overlap.as_ref())
}

/// The largest safe timestep, s, and whose it is, where the run's own is beyond it.
type Limit = Option<(f64, String)>;

/// What is computed, how, and how far from its limit.
fn account(
    path: &Path,
    model: &Model,
    method: &Method,
    start: &State,
    steps: usize,
    touches: &[Touch],
    budget: &Budget,
) -> (String, Limit) {
    let mut rows: Vec<[String; 2]> = requirements(model);
    rows.push(["contact law".into(), format!("{}: {}", method.contact.name, method.contact.about)]);
    if !method.contact.joints && model.requires.limits + model.requires.frictionloss > 0 {
        rows.push([
            String::new(),
            "it has no joint limits and no dry friction of joints: those of the scene do nothing".into(),
        ]);
    }
    let tied = model.tendons.iter().any(|t| t.range.is_some() || t.frictionloss > 0.0);
    if !method.contact.joints && (tied || model.requires.equalities > 0) {
        rows.push([
            String::new(),
            "it has no equalities and no limits and dry friction of tendons: those of the scene do nothing".into(),
        ]);
    }
    if model.opt.noslip_iterations > 0 && (method.contact.name != "mujoco" || method.integrator.implicit) {
        rows.push([
            String::new(),
            "it has no second pass over friction: the scene's noslip_iterations do nothing".into(),
        ]);
    }
    rows.push(["integrator".into(), format!("{}: {}", method.integrator.name, method.integrator.about)]);
    for line in super::explain::springs(model, method, touches).into_iter().take(4) {
        rows.push(["spring".into(), line]);
    }
    for (touch, hop) in hopping(model, method, touches, budget) {
        let probe::Hop { rest, depth: [low, high], fall } = hop;
        rows.push([
            "rest".into(),
            format!(
                "{touch}: none; by its formula {} deep, but a step falls g h² = {}: it hops, {} off to {} deep (see explain)",
                si(rest, "m"),
                si(fall, "m"),
                si(-low, "m"),
                si(high, "m")
            ),
        ]);
    }
    let mut step = format!("{}, {}", si(method.timestep, "s"), count(steps, "step", "steps"));
    let limit = largest_timestep(model, method, touches, budget);
    if let Some((limit, names)) = &limit {
        step += &match limit {
            limit if *limit >= explain::probe::LARGEST => "; no spring alone limits it".to_owned(),
            _ => format!(
                "; {names} alone is stable up to {}: margin {}",
                si(*limit, "s"),
                short(limit / method.timestep)
            ),
        };
    }
    rows.push(["step".into(), step]);
    // A limit of the probe's own is none of the scene's.
    let limit = limit.filter(|(limit, _)| *limit < explain::probe::LARGEST);
    let limit = safe(model, method, start, limit, budget);
    if budget.used_up() {
        let what =
            format!("not all contacts and starts could be tried in {}: penny explain --all tries all", si(TRYING, "s"));
        rows.push(["left out".into(), what]);
    }
    if !model.keyframes.is_empty() {
        rows.push(["keyframes".into(), format!("{}: start from one with --key", scene::keys(model))]);
    }
    let mut text = format!("{}\n", path.display());
    for [name, value] in rows {
        text += &row(&name, &value);
    }
    (text, limit)
}

/// A line of the account.
fn row(name: &str, value: &str) -> String {
    format!("  {name:<12} {value}\n")
}

/// The largest timestep that bears both a spring alone and the start of the run, tried out, and whose it is; `None` if
/// the run's own does.
fn safe(model: &Model, method: &Method, start: &State, limit: Limit, budget: &Budget) -> Limit {
    // Where the smallest step tried gains, too, the timestep is not the cause: a start deep in the ground, for instance.
    let trial_run = |timestep: f64| {
        let limit = explain::trial_run::largest_timestep(model, &Method { timestep, ..*method }, start, budget);
        limit.filter(|limit| *limit > 0.0)
    };
    // Of a contact it is the stiffest way in which it can be touched; what is not touched so in this run is no matter.
    let contact = |(_, names): &(f64, String)| theory::joint_springs(model).iter().all(|s| s.name != *names);
    match limit.filter(|(limit, _)| *limit < method.timestep) {
        Some(limit)
            if contact(&limit) && limit.0 > 0.0 && trial_run(method.timestep).is_none() && !budget.used_up() =>
        {
            None
        }
        Some((limit, names)) if limit > 0.0 => Some((trial_run(rounded_down(limit)).unwrap_or(limit), names)),
        Some(none) => Some(none),
        None => trial_run(method.timestep).map(|limit| (limit, THE_SCENE.to_owned())),
    }
}

/// Said before the first step where the timestep is beyond what the springs bear.
fn warning(model: &Model, method: &Method, start: &State, limit: &Limit, budget: &Budget) -> String {
    let integrator = method.integrator.name;
    match limit {
        Some((0.0, names)) => {
            format!("warning: {names} is unstable at any timestep with {integrator}: take another --integrator\n")
        }
        Some((limit, names)) if names == THE_SCENE && *limit < method.timestep && warnings::gains_anyway(method) => {
            format!(
                "warning: {integrator} adds energy to every oscillation, at any timestep; at {} it is much: take \
                 --integrator semi-implicit-euler or rk4\n",
                si(method.timestep, "s")
            )
        }
        Some((limit, names)) if *limit < method.timestep => {
            let other = super::explain::stable_integrator(model, method, start, budget);
            let other = other.map_or_else(String::new, |other| {
                format!(", or --integrator {other}, stable at {}", si(method.timestep, "s"))
            });
            // Far below its limit already an oscillation loses and regains much of its energy.
            let springs = theory::joint_springs(model);
            let alone = springs.iter().find(|s| s.name == *names).and_then(|s| theory::limit(method.integrator, s));
            let bears = match alone {
                Some(alone) if alone > 1.2 * limit => {
                    format!("it is stable up to {} with {integrator}, and gains no energy up to", si(alone, "s"))
                }
                _ => format!("the largest stable one with {integrator} is"),
            };
            format!(
                "warning: {names} is unstable at this timestep of {}; {bears} {}: --timestep {:.1e}{other}\n",
                si(method.timestep, "s"),
                si(*limit, "s"),
                rounded_down(*limit)
            )
        }
        _ => String::new(),
    }
}

/// Two digits, never above the number.
fn rounded_down(x: f64) -> f64 {
    let unit = 10f64.powf(x.log10().floor() - 1.0);
    (x / unit).floor() * unit
}

fn pace(steps: usize, [one, many]: [&str; 2], timestep: f64, elapsed: Duration) -> String {
    let seconds = elapsed.as_secs_f64();
    let real = steps as f64 * timestep / seconds;
    format!(
        "{} in {}: {} a {one}, {}× real time",
        count(steps, one, many),
        si(seconds, "s"),
        si(seconds / steps as f64, "s"),
        short(real)
    )
}

/// What went wrong, where and when, and what to do about it.
fn report(model: &Model, method: &Method, data: &Data, error: &Failed) -> String {
    let Failed::Step(StepError::Diverged(diverged)) = error else { return format!("error: {error}") };
    let body = names::body(model, diverged.body);
    let mut text = format!(
        "error: the run diverged at {:.6} s: {}[{}] of {body} is {:.3e}\n",
        diverged.time, diverged.quantity, diverged.index, diverged.value
    );
    if let Some(contact) = diverged.contact.and_then(|c| data.contacts.get(c)) {
        let [a, b] = contact.geom.map(|g| names::geom(model, g as usize));
        text += &format!("  its deepest contact: {a} – {b}, {} deep\n", si(-contact.dist, "m"));
    }
    let touches = explain::touches(model);
    text += &match largest_timestep(model, method, &touches, &Budget::seconds(TRYING)) {
        Some((limit, names)) if limit > 0.0 && limit < method.timestep.min(explain::probe::LARGEST) => format!(
            "  help: {names} is stable up to a timestep of {}, and this one is {}: try --timestep {:.1e}",
            si(limit, "s"),
            si(method.timestep, "s"),
            rounded_down(0.5 * limit)
        ),
        _ => format!("  help: try a smaller step (--timestep {:.1e}) or another integrator", 0.1 * method.timestep),
    };
    text
}

/// The files, or standard output, that the run is written to.
struct Outputs<'a> {
    csv: Option<(&'a Path, Csv)>,
    json: Option<(&'a Path, Json)>,
    table: Option<(&'a Path, Columns)>,
    picture: Option<Picture>,
}

impl Outputs<'_> {
    fn open<'a>(args: &'a Args, model: &Model, method: &Method, shown: &[Quantity]) -> Result<Outputs<'a>, Failure> {
        let csv = |path: &'a PathBuf| {
            let csv = create(path).and_then(|out| Csv::new(out, model, shown));
            csv.map(|csv| (path.as_path(), csv)).map_err(|e| files::cannot_write(path, &e))
        };
        let json = |path: &'a PathBuf| {
            let json = create(path).and_then(|out| Json::new(out, model, method, shown));
            json.map(|json| (path.as_path(), json)).map_err(|e| files::cannot_write(path, &e))
        };
        Ok(Outputs {
            csv: args.csv.as_ref().map(csv).transpose()?,
            json: args.json.as_ref().map(json).transpose()?,
            table: args
                .parquet
                .as_deref()
                .map(|path| Columns::open(path, model, method, shown).map(|columns| (path, columns)))
                .transpose()?,
            picture: args.plot.as_ref().map(|_| Picture::new(model, shown)),
        })
    }

    fn any(&self) -> bool {
        self.csv.is_some() || self.json.is_some() || self.table.is_some() || self.picture.is_some()
    }

    fn write(&mut self, state: &State, sample: &Sample, values: &[f64]) -> Result<(), Failure> {
        if let Some((path, csv)) = &mut self.csv {
            csv.write(state, sample, values).map_err(|e| files::cannot_write(path, &e))?;
        }
        if let Some((path, json)) = &mut self.json {
            json.write(state, sample, values).map_err(|e| files::cannot_write(path, &e))?;
        }
        if let Some((path, table)) = &mut self.table {
            table.write(state, sample, values).map_err(|e| files::cannot_write(path, &e))?;
        }
        Ok(())
    }

    /// Writes rows that have waited for half a second.
    fn tick(&mut self) -> Result<(), Failure> {
        if let Some((path, csv)) = &mut self.csv {
            csv.tick().map_err(|e| files::cannot_write(path, &e))?;
        }
        if let Some((path, json)) = &mut self.json {
            json.tick().map_err(|e| files::cannot_write(path, &e))?;
        }
        Ok(())
    }

    /// Completes the files; what is left is to draw the picture.
    fn finish(self) -> Result<Option<Picture>, Failure> {
        if let Some((path, csv)) = self.csv {
            csv.finish().map_err(|e| files::cannot_write(path, &e))?;
        }
        if let Some((path, json)) = self.json {
            json.finish().map_err(|e| files::cannot_write(path, &e))?;
        }
        if let Some((path, table)) = self.table {
            table.finish().map_err(|e| files::cannot_write(path, &e))?;
        }
        Ok(self.picture)
    }
}

/// A file of columns, complete at its end.
#[cfg(feature = "parquet")]
struct Columns {
    draft: Option<Draft>,
    columns: record::Parquet,
}

#[cfg(feature = "parquet")]
impl Columns {
    fn open(path: &Path, model: &Model, method: &Method, shown: &[Quantity]) -> Result<Columns, Failure> {
        let open = || {
            let draft = if path == Path::new("-") { None } else { Some(Draft::new(path)?) };
            let out: Box<dyn io::Write + Send> = match &draft {
                None => Box::new(io::stdout()),
                Some(draft) => Box::new(draft.open()?),
            };
            Ok(Columns { draft, columns: record::Parquet::new(out, model, method, shown)? })
        };
        open().map_err(|e: io::Error| files::cannot_write(path, &e))
    }

    fn write(&mut self, state: &State, sample: &Sample, values: &[f64]) -> io::Result<()> {
        self.columns.write(state, sample, values)
    }

    fn finish(self) -> io::Result<()> {
        self.columns.finish()?;
        self.draft.map_or(Ok(()), Draft::keep)
    }
}

/// What stands in its place in a build without.
#[cfg(not(feature = "parquet"))]
enum Columns {}

#[cfg(not(feature = "parquet"))]
impl Columns {
    fn open(_: &Path, _: &Model, _: &Method, _: &[Quantity]) -> Result<Columns, Failure> {
        let why = "error: --parquet: this penny was built without it: `cargo run --features parquet -- SCENE.xml --parquet \
                   FILE` builds it; --csv and --json need nothing";
        Err(Failure::Problem(why.to_owned()))
    }

    fn write(&mut self, _: &State, _: &Sample, _: &[f64]) -> io::Result<()> {
        match *self {}
    }

    fn finish(self) -> io::Result<()> {
        match self {}
    }
}

fn create(path: &Path) -> io::Result<Lines> {
    if path == Path::new("-") { Ok(Lines::stream(io::stdout())) } else { Lines::file(Draft::new(path)?) }
}

/// A bar on the terminal, once the run takes longer than [`PATIENCE`].
struct Progress {
    bar: ProgressBar,
}

impl Progress {
    fn new(steps: usize) -> Progress {
        let bar = ProgressBar::hidden();
        bar.set_length(steps as u64);
        if let Ok(style) = ProgressStyle::with_template("  {wide_bar} {percent} %, {eta} to go") {
            bar.set_style(style);
        }
        Progress { bar }
    }

    fn at(&self, step: usize, elapsed: Duration) {
        if elapsed < PATIENCE {
            return;
        }
        if self.bar.is_hidden() {
            // Draws only if standard error is a terminal.
            self.bar.set_draw_target(indicatif::ProgressDrawTarget::stderr());
        }
        self.bar.set_position(step as u64);
    }

    fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
