//! `penny bench`: nanoseconds per step, beside MuJoCo's if asked.
//!
//! Each scene runs for a second of simulated time, and the state it has reached is kept. Batches of steps start from
//! that state again and again; the median of the batches counts. `--window 0..2` measures the first two seconds instead:
//! what a step costs depends on what touches, and two engines need not touch alike. With `--against mujoco` every batch is followed by
//! one of MuJoCo's `mj_step(nstep)`, so that both see the same machine. `--worlds 1024` measures this many copies of the scene
//! in one batch on all cores, beside MuJoCo's `rollout` on as many threads. `--instructions` counts what the processor does, which
//! is the same however busy the machine is.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use super::Failure;
use super::format::{count, short, si, table};
use super::mujoco::{MuJoCo, Scene};
use super::scene::{self, LimitArgs, MethodArgs, StartArgs};
use penny::Batch;
use penny::Simulation;
use penny::data::Data;
use penny::forward::{Method, step};
use penny::model::Model;
use penny::state::State;
use penny_view::fnv::Fnv;

mod instructions;
mod scenes;

use instructions::Counted;

#[derive(clap::Args)]
pub struct Args {
    /// MJCF files [default: a set of small scenes]
    #[arg(value_name = "SCENE.xml")]
    scenes: Vec<PathBuf>,
    /// Measure this engine as well, in turns: mujoco
    #[arg(long, value_name = "ENGINE", value_parser = ["mujoco"])]
    against: Option<String>,
    /// Measure the steps between two simulated times, in seconds [default: up to 1000 steps from 1 s on]
    #[arg(long, value_name = "FROM..TO", value_parser = window)]
    window: Option<Window>,
    /// Step this many copies of the scene at once, on --threads; MuJoCo by its `rollout`
    #[arg(long, value_name = "N", value_parser = scene::at_least_one)]
    worlds: Option<usize>,
    /// Threads for --worlds [default: all cores]
    #[arg(long, value_name = "N", value_parser = scene::at_least_one, requires = "worlds")]
    threads: Option<usize>,
    /// Count the instructions of a step as well, with valgrind: about a hundred times slower than timing it
    #[arg(long, conflicts_with = "worlds")]
    instructions: bool,
    /// What it calls itself with under valgrind: take these steps and say nothing
    #[arg(long, hide = true, value_name = "METHOD:STEPS")]
    counted: Option<Counted>,
    #[command(flatten)]
    method: MethodArgs,
    #[command(flatten)]
    start: StartArgs,
    #[command(flatten)]
    limits: LimitArgs,
}

/// From one simulated time to another, s.
#[derive(Clone, Copy)]
struct Window {
    from: f64,
    to: f64,
}

impl Window {
    fn steps(&self, method: &Method) -> usize {
        (steps_to(method, self.to) - steps_to(method, self.from)).max(1)
    }
}

fn window(text: &str) -> Result<Window, String> {
    let (from, to) = text.split_once("..").ok_or("must be FROM..TO, such as 0..2")?;
    let [from, to] = [from, to].map(|x| x.parse::<f64>().ok().filter(|x| x.is_finite() && *x >= 0.0));
    match (from, to) {
        (Some(from), Some(to)) if from < to => Ok(Window { from, to }),
        _ => Err("must be two times in seconds, the smaller one first, such as 0..2".to_owned()),
    }
}

/// Simulated time to a typical state, s.
const WARM_UP: f64 = 1.0;
/// Least wall time to spend on batches of one method.
const BUDGET: Duration = Duration::from_millis(100);
const LEAST_BATCHES: usize = 15;
/// Steps of a batch at most: further from the kept state it would no longer be typical.
const LARGEST_BATCH: usize = 1000;
/// The same of many worlds, on one thread: to begin and end threads does not count then.
const CROWD_BATCH: Duration = Duration::from_millis(200);
/// Steps that show whether a method is worth waiting for, and how long they may take.
const TRIAL: usize = 5;
const PATIENCE: Duration = Duration::from_millis(100);
/// Steps whose instructions are counted: as many on every machine.
const COUNTED: usize = 100;
/// Wall time that a batch should take.
const BATCH: Duration = Duration::from_millis(2);

/// A scene to measure, with the state it starts from.
struct Case {
    name: String,
    /// What MuJoCo loads.
    source: Source,
    model: Model,
    start: State,
}

enum Source {
    Path(PathBuf),
    Text(String),
}

/// What came of one method on one scene.
enum Outcome {
    Measured(Measured),
    Diverges,
    /// ns a step, roughly.
    TooSlow(f64),
}

struct Measured {
    /// Medians, ns a step.
    ours: f64,
    theirs: Option<f64>,
    /// A step.
    instructions: Option<f64>,
    contacts: usize,
    /// Memory allocations in a whole batch of steps.
    allocations: usize,
    /// Of the kept state: after a fixed number of steps, however fast the machine is.
    hash: u64,
}

pub fn bench(args: &Args, allocations: fn() -> usize) -> Result<(), Failure> {
    if let Some(counted) = args.counted {
        return take(args, counted);
    }
    if cfg!(debug_assertions) {
        eprintln!("note: this is a development build; cargo run --release -- bench measures the real speed\n");
    }
    let mut mujoco = args.against.as_ref().map(|_| MuJoCo::start()).transpose()?;
    let crowd = args.worlds.map(|worlds| Crowd::new(worlds, args.threads)).transpose()?;
    let (cases, laws, integrators) = (cases(args)?, args.method.laws(), args.method.integrators());
    let bar = ProgressBar::new((cases.len() * laws.len() * integrators.len()) as u64);
    // The template is constant and right.
    if let Ok(style) = ProgressStyle::with_template("  {wide_bar} {pos} of {len} methods, {eta} to go") {
        bar.set_style(style);
    }
    let mut number = 0;
    for case in cases {
        let mut heading = vec!["law", "integrator", "step"];
        if args.instructions {
            heading.push("instructions");
        }
        if mujoco.is_some() {
            heading.extend(["MuJoCo", "times its speed"]);
        }
        heading.extend(["contacts", "allocations", "hash"]);
        let mut rows = vec![heading.into_iter().map(str::to_owned).collect::<Vec<_>>()];
        for &contact in &laws {
            for &integrator in &integrators {
                let method = Method { contact, integrator, ..args.method.method(&case.model)? };
                let mut row = vec![contact.name.to_owned(), integrator.name.to_owned()];
                row.extend(match measure(&case, &method, args.window, crowd.as_ref(), mujoco.as_mut(), allocations)? {
                    Outcome::Measured(mut measured) => {
                        if args.instructions {
                            let steps = args.window.map_or(COUNTED, |window| window.steps(&method));
                            measured.instructions = Some(instructions::per_step(number, steps)?);
                        }
                        cells(&measured)
                    }
                    Outcome::Diverges => vec!["diverges".to_owned()],
                    Outcome::TooSlow(ns) => vec![format!("about {}", si(ns * 1e-9, "s"))],
                });
                rows.push(row);
                number += 1;
                bar.inc(1);
            }
        }
        bar.suspend(|| {
            let crowd = crowd.as_ref().map_or_else(String::new, Crowd::to_string);
            println!("{}: {}{crowd}", case.name, count(case.model.nv, "degree of freedom", "degrees of freedom"));
            println!("{}", table(&rows));
        });
    }
    bar.finish_and_clear();
    let other: Vec<&str> = integrators.iter().filter(|i| i.mjcf.is_empty()).map(|i| i.name).collect();
    if mujoco.is_some() && !other.is_empty() {
        println!("MuJoCo has no {}: there it runs the scene's own integrator", other.join(", "));
    }
    println!(
        "contacts: after the last step measured; allocations: of memory, in all steps of a batch;\nhash: of the state \
         where measuring begins ({} s), so that two machines or builds can tell whether they compute the same",
        args.window.map_or(WARM_UP, |w| w.from)
    );
    Ok(())
}

fn cells(m: &Measured) -> Vec<String> {
    let mut cells = vec![si(m.ours * 1e-9, "s")];
    cells.extend(m.instructions.map(|n| format!("{n:.0}")));
    if let Some(theirs) = m.theirs {
        cells.extend([si(theirs * 1e-9, "s"), short(theirs / m.ours)]);
    }
    cells.extend([m.contacts.to_string(), m.allocations.to_string(), format!("{:016x}", m.hash)]);
    cells
}

/// Takes the steps that are counted.
fn take(args: &Args, counted: Counted) -> Result<(), Failure> {
    let (laws, integrators) = (args.method.laws(), args.method.integrators());
    let (case, method) =
        (counted.method / (laws.len() * integrators.len()), counted.method % (laws.len() * integrators.len()));
    let Some(case) = cases(args)?.into_iter().nth(case) else { return Ok(()) };
    let (contact, integrator) = (laws[method / integrators.len()], integrators[method % integrators.len()]);
    let method = Method { contact, integrator, ..args.method.method(&case.model)? };
    let (mut state, mut data) = (case.start, Data::new(&case.model));
    let steps = warm_up(&method, args.window).saturating_add(counted.steps);
    let taken = (0..steps).try_for_each(|_| step(&case.model, &method, &mut state, &mut data));
    taken.map_err(|e| Failure::Problem(format!("error: {e}")))
}

/// Steps to the state that is measured from.
fn warm_up(method: &Method, window: Option<Window>) -> usize {
    steps_to(method, window.map_or(WARM_UP, |w| w.from))
}

fn steps_to(method: &Method, time: f64) -> usize {
    (time / method.timestep).round() as usize
}

fn cases(args: &Args) -> Result<Vec<Case>, Failure> {
    if args.scenes.is_empty() {
        return scenes::all();
    }
    let case = |path: &PathBuf| {
        let model = scene::load(path, &args.limits)?;
        let start = args.start.state(&model)?;
        Ok(Case { name: path.display().to_string(), source: Source::Path(path.clone()), model, start })
    };
    args.scenes.iter().map(case).collect()
}

/// Copies of a scene that are stepped together.
struct Crowd {
    worlds: usize,
    pool: rayon::ThreadPool,
}

impl Crowd {
    fn new(worlds: usize, threads: Option<usize>) -> Result<Crowd, Failure> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0)).build();
        Ok(Crowd { worlds, pool: pool.map_err(|e| Failure::Problem(format!("error: no threads: {e}")))? })
    }

    /// Takes n steps in each world, from a state; `None` if one diverges.
    fn advance(&self, batch: &mut Batch, from: &State, n: usize) -> Option<Duration> {
        batch.worlds_mut().iter_mut().try_for_each(|world| world.restore(from)).ok()?;
        let before = Instant::now();
        let failed = self.pool.install(|| batch.step_n(n));
        (failed == 0).then(|| before.elapsed())
    }
}

impl std::fmt::Display for Crowd {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let threads = count(self.pool.current_num_threads(), "thread", "threads");
        write!(f, ", {} on {threads}, time a world and step", count(self.worlds, "world", "worlds"))
    }
}

/// Measures one method.
fn measure(
    case: &Case,
    method: &Method,
    window: Option<Window>,
    crowd: Option<&Crowd>,
    mut mujoco: Option<&mut MuJoCo>,
    allocations: fn() -> usize,
) -> Result<Outcome, Failure> {
    let model = &case.model;
    let (mut state, mut data) = (case.start.clone(), Data::new(model));
    let mut advance = |state: &mut State, n: usize| {
        let before = Instant::now();
        let outcome = (0..n).try_for_each(|_| step(model, method, state, &mut data));
        outcome.ok().map(|()| before.elapsed())
    };

    let warm_up = warm_up(method, window);
    let Some(pace) = advance(&mut state, TRIAL) else { return Ok(Outcome::Diverges) };
    if pace > PATIENCE {
        return Ok(Outcome::TooSlow(pace.as_nanos() as f64 / TRIAL as f64));
    }
    state.copy_from(&case.start);
    let Some(pace) = advance(&mut state, warm_up) else { return Ok(Outcome::Diverges) };
    let kept = state.clone();
    let steps = match window {
        Some(window) => window.steps(method),
        None => {
            let (time, worlds, least) = crowd.map_or((BATCH, 1, 10), |crowd| (CROWD_BATCH, crowd.worlds, 1));
            let steps = time.as_secs_f64() / (pace.as_secs_f64() / warm_up.max(1) as f64 * worlds as f64);
            (steps as usize).clamp(least, LARGEST_BATCH)
        }
    };
    if let Some(mujoco) = mujoco.as_deref_mut() {
        let scene = match &case.source {
            Source::Path(path) => Scene::Path(path),
            Source::Text(text) => Scene::Text(text),
        };
        mujoco.load(&scene, model, method, &case.start, false)?;
        mujoco.warm(warm_up)?;
    }

    let mut batch = crowd.map(|crowd| Batch::new(&Simulation::new(model.clone(), *method), crowd.worlds));
    let mut run = |state: &mut State| match (crowd, &mut batch) {
        (Some(crowd), Some(batch)) => crowd.advance(batch, &kept, steps),
        _ => {
            state.copy_from(&kept);
            advance(state, steps)
        }
    };
    let worlds = crowd.map(|crowd| [crowd.worlds, crowd.pool.current_num_threads()]);
    let all_steps = (steps * worlds.map_or(1, |[worlds, _]| worlds)) as f64;

    // Once unmeasured, for the caches; and for what each batch leaves behind. Worlds make room in their first step.
    if crowd.is_some() && run(&mut state).is_none() {
        return Ok(Outcome::Diverges);
    }
    let before = allocations();
    if run(&mut state).is_none() {
        return Ok(Outcome::Diverges);
    }
    let allocated = allocations() - before;

    let (mut ours, mut theirs) = (Vec::new(), Vec::new());
    let began = Instant::now();
    while ours.len() < LEAST_BATCHES || began.elapsed() < BUDGET {
        let Some(time) = run(&mut state) else { return Ok(Outcome::Diverges) };
        ours.push(time.as_nanos() as f64 / all_steps);
        if let Some(mujoco) = mujoco.as_deref_mut() {
            theirs.push(mujoco.batch(steps, worlds)? / all_steps);
        }
    }
    let contacts = batch.as_ref().map_or(data.contacts.len(), |batch| batch.worlds()[0].data().contacts.len());
    Ok(Outcome::Measured(Measured {
        ours: median(ours),
        theirs: (!theirs.is_empty()).then(|| median(theirs)),
        instructions: None,
        contacts,
        allocations: allocated,
        hash: hash(&kept),
    }))
}

/// The middle one of at least one value.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// FNV-1a over the bits of qpos and qvel: equal states, equal hashes.
fn hash(state: &State) -> u64 {
    Fnv::of(state.qpos.iter().chain(&state.qvel).flat_map(|x| x.to_bits().to_le_bytes())).0
}
