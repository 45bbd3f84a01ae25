//! `penny run`: simulates a scene, tells about it, and writes it down where asked.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

mod outputs;
mod summary;
mod table;
pub mod warnings;
mod watch;

use self::outputs::Outputs;
use self::warnings::Overlap;
use self::watch::Watch;
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
use penny::forward::{Method, StepError};
use penny::model::Model;
use penny::state::State;
use penny_lab::explain::{self, Budget, Touch, probe};
use penny_lab::record::{self, Balance, Recorder};
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
    /// contacts, actuators, sensors, energy, all), separated by commas. Selects the table's columns and what --plot draws, and adds
    /// these columns to --csv and --json
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
    let outputs = Outputs::open(args, &model, &method, &shown)?;
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

    let watch = Watch::new(&model, &method, steps, args.every, &touches, &shown, outputs, recorder, first);
    let mut ran = simulate(&model, &method, &mut state, steps, controlled, watch, &interrupt)?;
    report.print(&format!("\n{}", ran.watch.table.text(&model)));
    let picture = ran.watch.outputs.finish()?;
    if let (Some(path), Some(picture)) = (&args.plot, picture) {
        let how = format!("{}, {}, h = {}", method.contact.name, method.integrator.name, si(method.timestep, "s"));
        let start = args.start.told();
        let how = if start.is_empty() { how } else { format!("{how}; start: {start}") };
        let figure = picture.figure(&args.scene.display().to_string(), &how);
        plot::save(&figure, path).map_err(|e| Failure::Problem(format!("error: {e}")))?;
    }
    if let Some(error) = ran.failed {
        return Err(Failure::Problem(self::report(&model, &method, &ran.data, &error)));
    }
    if let Some(path) = &args.save_state {
        files::write_state(path, &model, &method, &state)?;
    }
    if ran.steps > 0 {
        ran.watch.recorder.forces(&model, &method, &state);
        report.print(&summary::contacts(&model, ran.watch.recorder.data()));
        // Controlled steps end between the rows: what they did is not in the balance.
        let balance = controlled.is_none().then_some(&ran.balance);
        let kinetic = ran.watch.energy.kinetic();
        report.print(&summary::energy(&model, &first, &ran.watch.last, kinetic, balance));
        // Of controlled steps only the rows are counted here.
        let unit = if controlled.is_some() { ["row", "rows"] } else { ["step", "steps"] };
        report.print(&format!("  {}\n", pace(ran.steps, unit, method.timestep, ran.elapsed)));
        eprint!("{}", super::explain::unsolved(&ran.data, &method, ran.steps));
    }
    if let Some(time) = ran.watch.overflow {
        eprintln!(
            "warning: from {} on the energy is too large a number, more than 1.8e308 J: it is `inf` in CSV and `null` in \
             JSON; check masses, sizes and speeds",
            si(time, "s")
        );
    }
    if ran.watch.energy.grew() {
        let unconverged = ran.data.unconverged;
        eprintln!("{}", ran.watch.energy.told(&model, &method, overlap.as_ref(), limit.as_ref(), unconverged));
    }
    interrupt.code().map_or(Ok(()), |code| Err(Failure::Interrupted(code)))
}

/// What a run left.
struct Ran<'a> {
    watch: Watch<'a>,
    /// As the last step left it.
    data: Data,
    balance: Balance,
    /// Steps that were taken.
    steps: usize,
    /// Real time that they took.
    elapsed: Duration,
    /// Why it ended early, if a step failed.
    failed: Option<Failed>,
}

/// Takes the steps, and lets `watch` look at the states between them.
///
/// Errors: an output could not be written. A step that fails ends the run, which is told.
fn simulate<'a>(
    model: &'a Model,
    method: &'a Method,
    state: &mut State,
    steps: usize,
    controlled: Option<(f64, usize)>,
    mut watch: Watch<'a>,
    interrupt: &Interrupt,
) -> Result<Ran<'a>, Failure> {
    let mut data = Data::new(model);
    let mut stepper = Stepper::new(model, method, state, steps, controlled)?;
    let mut balance = Balance::new(model, method.integrator);
    let progress = Progress::new(steps);
    let (mut elapsed, mut failed, mut i) = (Duration::ZERO, None, 0);
    loop {
        watch.look(i, state)?;
        if i == steps {
            break;
        }
        // Where steps take long, the clock is looked at more often.
        let batch = (PATIENCE.as_secs_f64() / 4.0 * i as f64 / elapsed.as_secs_f64().max(1e-9)) as usize;
        let batch = if i == 0 { 1 } else { batch.clamp(1, BATCH) };
        let until = watch.next(i).min((i / batch + 1) * batch).min(steps);
        let before = Instant::now();
        let outcome = (i..until).try_for_each(|i| {
            balance.before(state);
            let outcome = stepper.step(model, method, i + 1, state, &mut data);
            balance.after(model, state, &data, method.timestep);
            outcome
        });
        elapsed += before.elapsed();
        watch.outputs.tick()?;
        if let Err(error) = outcome {
            failed = Some(error);
            break;
        }
        i = until;
        progress.at(i, elapsed);
        if interrupt.code().is_some() {
            watch.last = watch.recorder.sample(model, state);
            break;
        }
    }
    progress.finish();
    if interrupt.code().is_some() && i < steps {
        eprintln!("warning: interrupted at {}, after {i} of {}", si(state.time, "s"), count(steps, "step", "steps"));
    }
    Ok(Ran { watch, data, balance, steps: i, elapsed, failed })
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
            "it has no joint limits and no dry friction of joints: those of the scene have no effect".into(),
        ]);
    }
    let tied = model.tendons.iter().any(|t| t.range.is_some() || t.frictionloss > 0.0);
    if !method.contact.joints && (tied || model.requires.equalities > 0) {
        rows.push([
            String::new(),
            "it has no equalities and no limits and dry friction of tendons: those of the scene have no effect".into(),
        ]);
    }
    if model.opt.noslip_iterations > 0 && (method.contact.name != "mujoco" || method.integrator.implicit) {
        rows.push([
            String::new(),
            "it has no second pass over friction: the scene's noslip_iterations have no effect".into(),
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
                "{touch}: none; the formula says {} deep, but a step falls by g h² = {}: it hops, from {} off to {} deep (see explain)",
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
        let what = format!(
            "not all contacts and starts could be tried in {}: penny explain --all tries everything",
            si(TRYING, "s")
        );
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
