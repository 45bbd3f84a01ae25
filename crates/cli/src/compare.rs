//! `penny compare`: a scene beside the real MuJoCo.

use std::path::{Path, PathBuf};
use std::time::Instant;

use super::Failure;
use super::accuracy::{self, AccuracyArgs};
use super::bench::median;
use super::files;
use super::format::{count, short, si, table};
use super::mujoco::{MuJoCo, Scene, counterpart};
use super::scene::{self, LengthArgs, LimitArgs, MethodArgs, StartArgs};
use penny::contact::{Law, mujoco};
use penny::data::Data;
use penny::forward::{Method, step};
use penny::model::Model;
use penny::state::State;
use penny_lab::accuracy::horizon::{Growth, growth};
use penny_lab::accuracy::{Choice, Stepping};
use penny_lab::plot::palette::{CURVES, DASHES, INK};
use penny_lab::plot::{self, Axis, Figure, Layer, Line, Panel};
use penny_lab::record::coordinates;
use penny_lab::sweep::{Case, exact};

mod why;

#[derive(clap::Args)]
pub struct Args {
    /// MJCF file
    #[arg(value_name = "SCENE.xml")]
    scene: PathBuf,
    #[command(flatten)]
    length: LengthArgs,
    #[command(flatten)]
    method: MethodArgs,
    #[command(flatten)]
    accuracy: AccuracyArgs,
    #[command(flatten)]
    start: StartArgs,
    /// Draw the differences over time: a file that ends in .svg or .png
    #[arg(long, value_name = "FILE", value_parser = scene::picture)]
    plot: Option<PathBuf>,
    #[command(flatten)]
    limits: LimitArgs,
}

/// Positions that are kept of each run.
const MOST_NUMBERS: usize = 50_000_000;
/// Lines of the table over time.
const LINES: usize = 10;
/// A difference that one would call one, in units of qpos.
const DIFFERENT: f64 = 1e-6;
/// What every velocity of MuJoCo's start is changed by, to see whether MuJoCo repeats itself.
const KICK: f64 = 1e-13;

/// A law's run.
struct Rollout {
    /// qpos at the start and after every step, solved to rounding as MuJoCo's; fewer rows where it diverged.
    rows: Vec<Vec<f64>>,
    /// Time of a step as the scene is, and of one of MuJoCo's that was measured in turns with it: medians, s.
    pace: [f64; 2],
    /// The method that was chosen for an accuracy.
    chosen: Option<Choice>,
    /// How errors grow under the law; looked at where the run differs.
    growth: Option<Growth>,
}

/// Runs measured, at least, and until they have taken that many seconds.
const LEAST_RUNS: usize = 3;
const MOST_RUNS: usize = 15;
const BUDGET: f64 = 0.5;

pub fn compare(args: &Args) -> Result<(), Failure> {
    let path = &args.scene;
    let model = scene::load_apart(path, &args.limits, &[("--plot", args.plot.as_deref())])?;
    let method = args.method.method(&model)?;
    let start = args.start.state(&model)?;
    let steps = args.length.steps(method.timestep)?;
    if steps.saturating_mul(model.nq.max(1)) > MOST_NUMBERS {
        return Err(Failure::Usage(format!(
            "error: {steps} steps of {} numbers each are more than can be compared; the most is {}",
            model.nq,
            MOST_NUMBERS / model.nq.max(1)
        )));
    }
    if let Some(file) = &args.plot {
        files::writable(file)?;
    }

    let mut mujoco = MuJoCo::start()?;
    let question = Question { path, model: &model, method: &method, start: &start, steps };
    let theirs = question.ask(&mut mujoco)?;
    println!(
        "{}: {} of {}, {}",
        path.display(),
        count(steps, "step", "steps"),
        si(method.timestep, "s"),
        method.integrator.name
    );
    if !method.integrator.mjcf.contains(&counterpart(&model, &method).as_str()) {
        println!("  MuJoCo has no {}: it runs {}", method.integrator.name, counterpart(&model, &method));
    }
    if theirs.rows.len() <= steps {
        println!("  MuJoCo calls the run unstable after {}", si(theirs.rows.len() as f64 * method.timestep, "s"));
    }
    let laws = args.method.laws();
    let ours = laws
        .iter()
        .map(|&law| question.answer(law, args.accuracy.accuracy, &theirs.rows, &mut mujoco))
        .collect::<Result<Vec<Rollout>, Failure>>()?;

    println!("\nLargest |qpos difference| up to a time, m or rad (both solve to rounding: tolerance 0)");
    println!("{}", question.over_time(&laws, &ours, &theirs.rows));
    print!("{}", question.in_short(&laws, &ours, &theirs));
    println!("  (a difference counts above {DIFFERENT:e} m or rad; speed: medians, in turns with MuJoCo)");
    println!("\nDoes the difference matter");
    for (law, rollout) in laws.iter().zip(&ours) {
        let method = Method { contact: law, ..method };
        println!("  {}: {}", law.name, verdict(&model, &method, &start, rollout, &theirs.rows, &theirs.kicked));
    }
    println!("\nWhy");
    print!("{}", question.why(&laws, &ours, &theirs));
    if let Some(file) = &args.plot {
        chart(path, &model, &method, &theirs.rows, &laws, &ours, file)?;
    }
    let diverged: Vec<&str> =
        laws.iter().zip(&ours).filter(|(_, r)| r.rows.len() <= steps).map(|(law, _)| law.name).collect();
    match diverged[..] {
        [] => Ok(()),
        _ => Err(Failure::Problem(format!("error: the run diverged under {}", diverged.join(", ")))),
    }
}

/// What is compared: a scene under a method, from a start, over some steps.
struct Question<'a> {
    path: &'a Path,
    model: &'a Model,
    method: &'a Method,
    start: &'a State,
    steps: usize,
}

/// MuJoCo's runs: qpos at the start and after every step.
struct Theirs {
    /// Solved to rounding.
    rows: Vec<Vec<f64>>,
    /// The same from a start whose velocities differ by [`KICK`].
    kicked: Vec<Vec<f64>>,
    /// With the scene's own tolerance.
    hasty: Vec<Vec<f64>>,
}

impl Question<'_> {
    /// MuJoCo's runs. It is left at the start, ready to be timed.
    fn ask(&self, mujoco: &mut MuJoCo) -> Result<Theirs, Failure> {
        let load = |mujoco: &mut MuJoCo, start: &State, exact| {
            mujoco.load(&Scene::Path(self.path), self.model, self.method, start, exact)
        };
        load(mujoco, self.start, true)?;
        let rows = mujoco.rollout(self.steps, 1)?;
        let mut kicked = self.start.clone();
        kicked.qvel.iter_mut().for_each(|v| *v += KICK);
        load(mujoco, &kicked, true)?;
        let kicked = mujoco.rollout(self.steps, 1)?;
        load(mujoco, self.start, false)?;
        let hasty = mujoco.rollout(self.steps, 1)?;
        load(mujoco, self.start, false)?;
        mujoco.warm(0)?;
        Ok(Theirs { rows, kicked, hasty })
    }

    /// The run of one law; where an accuracy (m) is wanted, by the method that is found for it.
    fn answer(
        &self,
        contact: &'static Law,
        wanted: Option<f64>,
        theirs: &[Vec<f64>],
        mujoco: &mut MuJoCo,
    ) -> Result<Rollout, Failure> {
        let Question { model, start, steps, .. } = *self;
        let method = Method { contact, ..*self.method };
        let Some(wanted) = wanted else {
            let rows = rows(model, &method, start, steps);
            let growth = trusted(model, &method, start, &rows, theirs);
            let pace = pace(model, &method, start, steps, mujoco)?;
            return Ok(Rollout { rows, pace, chosen: None, growth });
        };
        let case = Case { model: exact(model), start: start.clone(), seconds: steps as f64 * method.timestep };
        let choice = accuracy::find(&case, &method, wanted)?;
        for [name, text] in accuracy::account(&choice, wanted) {
            println!("  {}: {name}: {text}", contact.name);
        }
        let before = Instant::now();
        let rows = accurate(&case, &choice, method.timestep, steps);
        let ours = before.elapsed().as_secs_f64() / steps.max(1) as f64;
        let growth = trusted(model, &method, start, &rows, theirs);
        let pace = [ours, pace(model, &method, start, steps, mujoco)?[1]];
        Ok(Rollout { rows, pace, chosen: Some(choice), growth })
    }

    /// The largest difference of each law up to some times, as a table.
    fn over_time(&self, laws: &[&Law], ours: &[Rollout], theirs: &[Vec<f64>]) -> String {
        let Question { method, start, steps, .. } = *self;
        let mut lines = vec![vec!["time s".to_owned()]];
        lines[0].extend(laws.iter().map(|law| law.name.to_owned()));
        let stride = steps.div_ceil(LINES).max(1);
        for i in (0..=steps).filter(|i| i % stride == 0 || *i == steps) {
            let mut line = vec![format!("{:.3}", start.time + i as f64 * method.timestep)];
            line.extend(ours.iter().map(|r| largest(r, theirs, i).map_or("–".to_owned(), |d| format!("{d:.1e}"))));
            lines.push(line);
        }
        table(&lines)
    }

    /// Where each run first differs, where most, and how fast it is: a table with a line for each law and one for MuJoCo
    /// with the scene's own tolerance.
    fn in_short(&self, laws: &[&Law], ours: &[Rollout], theirs: &Theirs) -> String {
        let Question { model, method, .. } = *self;
        let heading = ["", "first differs at", "in", "largest difference", "in", "a step", "times MuJoCo's speed"];
        let mut lines = vec![heading.map(str::to_owned).to_vec()];
        let mut add = |name: String, run: &[Vec<f64>], [pace, their_pace]: [f64; 2]| {
            let (when, what) = match first_different(run, &theirs.rows) {
                Some((i, coordinate)) => (si(i as f64 * method.timestep, "s"), coordinate_name(model, coordinate)),
                None => ("never".to_owned(), "–".to_owned()),
            };
            let (most, value) = match largest_difference(run, &theirs.rows) {
                (_, 0.0) => ("–".to_owned(), "0".to_owned()),
                (most, value) => (coordinate_name(model, most), format!("{value:.1e}")),
            };
            lines.push(vec![name, when, what, value, most, si(pace, "s"), short(their_pace / pace)]);
        };
        for (law, rollout) in laws.iter().zip(ours) {
            add(law.name.to_owned(), &rollout.rows, rollout.pace);
        }
        let pace = median(ours.iter().map(|r| r.pace[1]).collect());
        add(format!("MuJoCo, tolerance {:e}", model.opt.tolerance), &theirs.hasty, [pace; 2]);
        table(&lines)
    }

    /// Why each run differs, a line for each reason.
    fn why(&self, laws: &[&'static Law], ours: &[Rollout], theirs: &Theirs) -> String {
        let mut text = String::new();
        for (&contact, rollout) in laws.iter().zip(ours) {
            let method = Method { contact, ..*self.method };
            let diverged = rollout.rows.len() <= self.steps;
            if diverged {
                text += &format!(
                    "  {}: it diverged at {}: a smaller --timestep may help; the figures are those until then\n",
                    contact.name,
                    si(rollout.rows.len() as f64 * method.timestep, "s")
                );
            }
            if diverged && first_different(&rollout.rows, &theirs.rows).is_none() {
                continue;
            }
            for reason in why_different(self.model, &method, self.start, rollout, &theirs.rows, &theirs.kicked) {
                text += &format!("  {}: {reason}\n", contact.name);
            }
        }
        if first_different(&theirs.hasty, &theirs.rows).is_some() {
            text += &format!(
                "  MuJoCo, tolerance {:e}: solver tolerance: MuJoCo's solver stops early, and so does Penny's\n",
                self.model.opt.tolerance
            );
        }
        text
    }
}

/// Whether a law's difference from MuJoCo matters: beside what halving the timestep changes, and beside how far MuJoCo is
/// from itself after an invisible kick.
fn verdict(
    model: &Model,
    method: &Method,
    start: &State,
    ours: &Rollout,
    theirs: &[Vec<f64>],
    kicked: &[Vec<f64>],
) -> String {
    let steps = ours.rows.len() - 1;
    if ours.rows.len() < theirs.len() {
        return format!("yes: it diverges after {}", si(steps as f64 * method.timestep, "s"));
    }
    // What comes later than rounding needs to grow to a difference tells nothing.
    let horizon = ours.growth.as_ref().and_then(|growth| growth.horizon(DIFFERENT));
    let trusted = horizon.map_or(steps, |time| ((time / method.timestep) as usize).min(steps));
    let told_horizon = || {
        let doubling = ours.growth.as_ref().and_then(Growth::doubling).map_or_else(String::new, |d| si(d, "s"));
        format!(
            "the trust horizon, {}: there rounding alone, doubled every {doubling} where it grows fastest, has become \
             {DIFFERENT:e}, and nobody can say who is right",
            si(trusted as f64 * method.timestep, "s")
        )
    };
    if let Some((first, _)) = first_different(&ours.rows, theirs).filter(|(first, _)| *first > trusted) {
        let first = si(first as f64 * method.timestep, "s");
        return format!("no: it first differs after {first}, beyond {}", told_horizon());
    }
    let (most, apart) = largest_difference(&ours.rows[..=trusted], theirs);
    let until = if trusted < steps { format!(" (up to {})", told_horizon()) } else { String::new() };
    if apart <= DIFFERENT {
        return format!("no: it is below {DIFFERENT:e} in all coordinates");
    }
    let unit = coordinates(model).get(most).map_or("", |c| c.unit);
    let told = |x: f64| if unit == "1" { short(x) } else { si(x, unit) };
    let place = coordinate_name(model, most);
    let (_, itself) = largest_difference(&kicked[..kicked.len().min(trusted + 1)], theirs);
    if itself > 0.3 * apart {
        return format!(
            "no: the motion is chaotic; MuJoCo, kicked by {KICK:e}, ends {} from its own run, and this law {} from it",
            told(itself),
            told(apart)
        );
    }
    let half = Method { timestep: 0.5 * method.timestep, ..*method };
    let (own, whose) = match &ours.chosen {
        Some(choice) => (choice.error, "this law's run errs by about"),
        None => {
            let finer: Vec<Vec<f64>> = rows(model, &half, start, 2 * trusted).into_iter().step_by(2).collect();
            let own = if finer.len() > trusted { largest_difference(&ours.rows[..=trusted], &finer).1 } else { 0.0 };
            (own, "halving the timestep changes this law's own run by")
        }
    };
    let way = ours.rows[..=trusted]
        .iter()
        .map(|q| q[most])
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    let share = apart / (way.1 - way.0).max(f64::MIN_POSITIVE);
    if own >= 0.5 * apart {
        return format!("no: {} in {place}, and {whose} {}{until}", told(apart), told(own));
    }
    // Steps that were chosen may be finer than MuJoCo's.
    let theirs_own =
        if ours.chosen.is_some() { error_of_steps(model, method, start, &theirs[..=trusted]) } else { 0.0 };
    if theirs_own >= 0.5 * apart {
        let h = si(method.timestep, "s");
        return format!(
            "no: {} in {place}, and MuJoCo's steps of {h} err by about {}{until}",
            told(apart),
            told(theirs_own)
        );
    }
    let way = if share < 1e3 { format!(", {} % of what it moves", short(100.0 * share)) } else { String::new() };
    if share < 0.01 {
        return format!("little: {} in {place}{way}; {whose} {}{until}", told(apart), told(own));
    }
    format!("yes: {} in {place}{way}, while {whose} only {}: the laws differ{until}", told(apart), told(own))
}

/// What MuJoCo's run errs by for its steps alone, about: twice what half of them change, by its law and its integrator, which
/// Penny has to rounding. Their first order is assumed: of a higher one it is more than they err.
fn error_of_steps(model: &Model, method: &Method, start: &State, theirs: &[Vec<f64>]) -> f64 {
    let Some(integrator) = penny::integrate::by_name(&counterpart(model, method)) else { return 0.0 };
    let half = Method { contact: &mujoco::LAW, integrator, timestep: 0.5 * method.timestep, ..*method };
    let finer: Vec<Vec<f64>> = rows(model, &half, start, 2 * (theirs.len() - 1)).into_iter().step_by(2).collect();
    if finer.len() < theirs.len() { 0.0 } else { 2.0 * largest_difference(theirs, &finer).1 }
}

/// What is known of why a run has left MuJoCo's.
fn why_different(
    model: &Model,
    method: &Method,
    start: &State,
    ours: &Rollout,
    theirs: &[Vec<f64>],
    kicked: &[Vec<f64>],
) -> Vec<String> {
    let Some((steps, _)) = first_different(&ours.rows, theirs) else {
        return vec![format!("no difference above {DIFFERENT:e}")];
    };
    let mut reasons = Vec::new();
    let other = counterpart(model, method);
    if !method.integrator.mjcf.contains(&other.as_str()) {
        reasons.push(format!("integrator: MuJoCo has no {} and runs {other}", method.integrator.name));
    }
    if ours.chosen.is_some() {
        let (_, apart) = largest_difference(&ours.rows, theirs);
        let of_steps = error_of_steps(model, method, start, &theirs[..ours.rows.len().min(theirs.len())]);
        if of_steps >= 0.1 * apart {
            let h = si(method.timestep, "s");
            reasons.push(format!(
                "steps: MuJoCo's, of {h}, are not chosen for the accuracy; it errs by about {of_steps:.1e} for them"
            ));
        }
    }
    reasons.extend(why::reasons(model, method, start, steps));
    if method.contact.name == mujoco::LAW.name && first_different(kicked, theirs).is_some() {
        let (_, apart) = largest_difference(kicked, theirs);
        reasons.push(format!(
            "rounding grows: MuJoCo itself, all velocities off by {KICK:e}, is up to {apart:.1e} from itself"
        ));
    }
    if reasons.is_empty() {
        reasons.push("not known".to_owned());
    }
    reasons
}

/// The differences over time, and the coordinate that moves most under every law.
fn chart(
    path: &Path,
    model: &Model,
    method: &Method,
    theirs: &[Vec<f64>],
    laws: &[&'static Law],
    ours: &[Rollout],
    file: &Path,
) -> Result<(), Failure> {
    let time = |i: usize| i as f64 * method.timestep;
    let span = |c: usize| {
        let ends = theirs.iter().fold((f64::MAX, f64::MIN), |(low, high), q| (low.min(q[c]), high.max(q[c])));
        ends.1 - ends.0
    };
    let widest = (0..model.nq).max_by(|&a, &b| span(a).total_cmp(&span(b))).unwrap_or(0);
    let course = |rows: &[Vec<f64>]| rows.iter().enumerate().map(|(i, q)| [time(i), q[widest]]).collect();
    let mut courses = vec![Layer::Line(Line::new("MuJoCo", INK, course(theirs)).wide(6.0))];
    let mut differences = Vec::new();
    for (i, (law, rollout)) in laws.iter().zip(ours).enumerate() {
        // Each narrower than the one under it: curves that agree are seen all the same.
        let width = 4.0 - 1.25 * i as f64;
        let line = |points| Layer::Line(Line::new(law.name, CURVES[i], points).dashed(DASHES[i]).wide(width));
        let pairs = rollout.rows.iter().zip(theirs).enumerate();
        differences.push(line(pairs.map(|(i, (a, b))| [time(i), worst(a, b).1]).collect()));
        courses.push(line(course(&rollout.rows)));
    }
    let axis = || Axis::linear("time [s]").tight();
    let difference = Axis { range: [Some(1e-17), None], ..Axis::log("largest |qpos difference| [m or rad]") };
    let name = coordinates(model).get(widest).map_or_else(String::new, |c| format!("{} [{}]", c.name, c.unit));
    let panels = vec![
        Panel::new("Difference from MuJoCo", axis(), difference, differences),
        Panel::new("What moves most", axis(), Axis::linear(name), courses),
    ];
    let how = format!("{}, h = {}; MuJoCo 4.0.0 solving to rounding", method.integrator.name, si(method.timestep, "s"));
    let figure = Figure { panel_size: [340.0, 300.0], ..Figure::new(path.display().to_string(), how, panels) };
    plot::save(&figure, file).map_err(|e| Failure::Problem(format!("error: {e}")))
}

/// The rows of a run by the method that was chosen; they end early where it fails.
fn accurate(case: &Case, choice: &Choice, timestep: f64, steps: usize) -> Vec<Vec<f64>> {
    let mut rows = vec![case.start.qpos.clone()];
    let Ok(mut run) = choice.run(&case.model, &case.start, case.seconds) else { return rows };
    let states = (1..=steps).map_while(|i| run.at(case.start.time + i as f64 * timestep).ok());
    rows.extend(states.map(|state| state.qpos));
    rows
}

/// How errors grow under a law, if its run differs.
fn trusted(model: &Model, method: &Method, start: &State, rows: &[Vec<f64>], theirs: &[Vec<f64>]) -> Option<Growth> {
    first_different(rows, theirs)?;
    let case = Case { model: model.clone(), start: start.clone(), seconds: (rows.len() - 1) as f64 * method.timestep };
    growth(&case, method, Stepping::Fixed(method.timestep)).ok()
}

/// Penny's run, solved to rounding as MuJoCo's; it ends early where it diverges.
fn rows(model: &Model, method: &Method, start: &State, steps: usize) -> Vec<Vec<f64>> {
    let exact = exact(model);
    let (mut state, mut data) = (start.clone(), Data::new(&exact));
    let mut rows = vec![state.qpos.clone()];
    while rows.len() <= steps && step(&exact, method, &mut state, &mut data).is_ok() {
        rows.push(state.qpos.clone());
    }
    rows
}

/// Seconds that a step of Penny's run takes with the scene's own tolerance, and one of MuJoCo's: both runs in turns, so
/// that both see the same machine, and the medians. A run that diverges is measured as far as it goes.
fn pace(model: &Model, method: &Method, start: &State, steps: usize, mujoco: &mut MuJoCo) -> Result<[f64; 2], Failure> {
    let mut data = Data::new(model);
    let (mut ours, mut theirs, mut spent) = (Vec::new(), Vec::new(), 0.0);
    while ours.len() < LEAST_RUNS || (spent < BUDGET && ours.len() < MOST_RUNS) {
        let mut state = start.clone();
        let before = Instant::now();
        let taken = (0..steps).take_while(|_| step(model, method, &mut state, &mut data).is_ok()).count();
        let seconds = before.elapsed().as_secs_f64();
        // The step that diverges takes its time too.
        ours.push(seconds / (taken + 1).min(steps).max(1) as f64);
        let their_seconds = mujoco.batch(steps, None)? * 1e-9;
        theirs.push(their_seconds / steps.max(1) as f64);
        spent += seconds + their_seconds;
    }
    Ok([median(ours), median(theirs)])
}

/// The coordinate that differs most, and by how much.
fn worst(a: &[f64], b: &[f64]) -> (usize, f64) {
    let differences = a.iter().zip(b).map(|(x, y)| (x - y).abs()).enumerate();
    differences.max_by(|x, y| x.1.total_cmp(&y.1)).unwrap_or((0, 0.0))
}

/// Largest difference in the steps up to `i`; `None` where one of the two did not get there.
fn largest(ours: &Rollout, theirs: &[Vec<f64>], i: usize) -> Option<f64> {
    let pairs = ours.rows.get(..=i)?.iter().zip(theirs.get(..=i)?);
    Some(pairs.map(|(a, b)| worst(a, b).1).fold(0.0, f64::max))
}

/// The first step that differs by more than [`DIFFERENT`], and the coordinate that does.
fn first_different(ours: &[Vec<f64>], theirs: &[Vec<f64>]) -> Option<(usize, usize)> {
    let mut pairs = ours.iter().zip(theirs).map(|(a, b)| worst(a, b)).enumerate();
    pairs.find(|(_, (_, d))| *d > DIFFERENT).map(|(i, (coordinate, _))| (i, coordinate))
}

/// The coordinate that ever differs most, and by how much.
fn largest_difference(ours: &[Vec<f64>], theirs: &[Vec<f64>]) -> (usize, f64) {
    let steps = ours.iter().zip(theirs).map(|(a, b)| worst(a, b));
    steps.max_by(|x, y| x.1.total_cmp(&y.1)).unwrap_or((0, 0.0))
}

/// `z of disk`
fn coordinate_name(model: &Model, coordinate: usize) -> String {
    coordinates(model).get(coordinate).map_or_else(|| format!("qpos[{coordinate}]"), |c| c.name.clone())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Semi-implicit Euler falls g h t/2 too far, and halving the steps shows half of that.
    #[test]
    fn the_error_of_steps_is_told_from_half_of_them() {
        let text = r#"<mujoco><worldbody><body><joint type="slide" axis="0 0 1"/><geom size="0.1"/></body></worldbody></mujoco>"#;
        let model = penny::parse("scene.xml", text).unwrap_or_else(|e| panic!("{e}")).model;
        let integrator = penny::integrate::by_name("Euler").expect("an integrator");
        let method = Method { contact: &mujoco::LAW, integrator, timestep: 0.002, rounds: penny::forward::ROUNDS };
        let start = State::new(&model);
        let theirs = rows(&model, &method, &start, 500);
        let error = error_of_steps(&model, &method, &start, &theirs);
        assert!((error - 9.81 * 0.002 * 0.5).abs() < 1e-9, "{error}");
    }
}
