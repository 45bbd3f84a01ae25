//! Options that several commands share: which scene, computed how, started where, for how long.

use std::ffi::OsStr;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::error::{ContextKind, ContextValue};
use clap::{Arg, Command};

use super::Failure;
use super::files;
use super::format::{short, si};
use penny::Scene;
use penny::contact::{self, Law};
use penny::forward::{Method, ROUNDS};
use penny::integrate::{self, Integrator};
use penny::math::MIN_MU;
use penny::mjcf::{self, Limits};
use penny::model::{Joint, JointKind, Keyframe, Model, Parts};
use penny::state::State;

/// s
pub const DEFAULT_TIME: f64 = 3.0;
/// More would take longer than a day even where a step takes 0.1 µs.
pub const MOST_STEPS: usize = 1_000_000_000_000;

/// What a scene may take, and where it may read.
#[derive(clap::Args, Clone, Default)]
pub struct LimitArgs {
    /// Raise a limit of the scene and its includes together: depth [default: 200], includes [1000], bytes [134217728],
    /// elements [2000000], names [1000000] or contacts [1000000]
    #[arg(long = "limit", value_name = "NAME=N", value_parser = limit, help_heading = "Reading")]
    limits: Vec<(String, usize)>,
    /// Also read files outside the scene's folder that a scene or a session names
    #[arg(long, help_heading = "Reading")]
    allow_outside: bool,
}

impl LimitArgs {
    pub fn limits(&self) -> Limits {
        let mut limits = Limits { outside: self.allow_outside, ..Limits::default() };
        for (name, value) in &self.limits {
            // Checked when it was parsed.
            let _ = limits.set(name, *value);
        }
        limits
    }
}

fn limit(text: &str) -> Result<(String, usize), String> {
    let (name, value) = text.split_once('=').ok_or("must be NAME=N, such as depth=400")?;
    let value = value.parse().map_err(|_| format!("`{value}` is not a whole number"))?;
    Limits::default().set(name, value)?;
    Ok((name.to_owned(), value))
}

#[derive(clap::Args, Clone)]
pub struct MethodArgs {
    /// Contact law [default: the scene's, else penalty]
    #[arg(long, value_name = "LAW", value_parser = law_parser())]
    contact: Option<String>,
    /// Integrator [default: the scene's]
    #[arg(long, value_name = "NAME", value_parser = integrator_parser())]
    integrator: Option<String>,
    /// Timestep in seconds [default: the scene's]
    #[arg(long, value_name = "S", value_parser = positive, allow_hyphen_values = true)]
    pub timestep: Option<f64>,
    /// Most Newton steps that the penalty law takes to find the forces of a timestep; fewer are faster where forces change
    /// quickly, but leave a residual, which the run reports
    #[arg(long, value_name = "N", default_value_t = ROUNDS, value_parser = at_least_one, allow_negative_numbers = true)]
    rounds: usize,
}

#[derive(clap::Args, Clone)]
pub struct StartArgs {
    /// Start from this keyframe, by name or index (a scene's keyframes are applied only where named)
    #[arg(long, value_name = "NAME|INDEX", allow_negative_numbers = true)]
    key: Option<String>,
    /// Start from a state that --save-state wrote: the run goes on with the same bits
    #[arg(long, value_name = "FILE", conflicts_with = "key")]
    load_state: Option<PathBuf>,
    /// Start at these positions (all of qpos)
    #[arg(long, value_name = "\"…\"", value_parser = numbers, allow_hyphen_values = true)]
    qpos: Option<Numbers>,
    /// Start with these velocities (all of qvel)
    #[arg(long, value_name = "\"…\"", value_parser = numbers, allow_hyphen_values = true)]
    qvel: Option<Numbers>,
    /// Hold the actuators at these controls (all of ctrl)
    #[arg(long, value_name = "\"…\"", value_parser = numbers, allow_hyphen_values = true)]
    ctrl: Option<Numbers>,
}

/// Numbers of the scene that are replaced for one run.
#[derive(clap::Args, Clone)]
pub struct OverrideArgs {
    /// Friction of all contacts instead of the scene's: sliding, torsional, rolling; the last ones may be left out
    #[arg(long, value_name = "\"…\"", value_parser = coefficients, allow_hyphen_values = true)]
    friction: Option<Numbers>,
    /// solref of all contacts: timeconst and dampratio, or -stiffness and -damping
    #[arg(long, value_name = "\"…\"", value_parser = two_numbers, allow_hyphen_values = true)]
    solref: Option<Numbers>,
    /// solimp of all contacts, five numbers or the first of them
    #[arg(long, value_name = "\"…\"", value_parser = impedance, allow_hyphen_values = true)]
    solimp: Option<Numbers>,
    /// Gravity, m/s²
    #[arg(long, value_name = "\"x y z\"", value_parser = three_numbers, allow_hyphen_values = true)]
    gravity: Option<Numbers>,
}

impl OverrideArgs {
    /// Replaces the numbers in a compiled scene, those of `<pair>`s too.
    ///
    /// Errors: wrong usage, if a number is none that the scene can have.
    pub fn apply(&self, model: &mut Model) -> Result<(), Failure> {
        let set = |given: &Option<Numbers>, to: &mut [f64]| {
            let Some(Numbers(given)) = given else { return };
            to.iter_mut().zip(given).for_each(|(to, x)| *to = *x);
        };
        let wrong = |why| Failure::Usage(format!("error: {why}"));
        let of_geoms = |m: &mut Parts| {
            for geom in &mut m.geoms {
                set(&self.friction, &mut geom.friction);
                set(&self.solref, &mut geom.solref);
                set(&self.solimp, &mut geom.solimp);
            }
            set(&self.gravity, m.opt.gravity.as_mut_slice());
        };
        model.edit(of_geoms).map_err(wrong)?;
        let of_contacts = |m: &mut Parts| {
            for mix in &mut m.mixes {
                let [slide, _, spin, roll, _] = mix.friction;
                let mut friction = [slide, spin, roll];
                set(&self.friction, &mut friction);
                if self.friction.is_some() {
                    let [slide, spin, roll] = friction.map(|mu| mu.max(MIN_MU));
                    mix.friction = [slide, slide, spin, roll, roll];
                }
                set(&self.solref, &mut mix.solref);
                set(&self.solref, &mut mix.solreffriction);
                set(&self.solimp, &mut mix.solimp);
            }
            // What was not given stays the scene's.
            match &self.friction {
                Some(Numbers(given)) if given.len() == 3 => m.tutorial.follow_friction(),
                Some(_) => m.tutorial.mu = None,
                None => {}
            }
            if self.solref.is_some() {
                m.tutorial.follow_solref();
            }
        };
        if self.friction.is_some() || self.solref.is_some() || self.solimp.is_some() {
            model.edit(of_contacts).map_err(wrong)?;
        }
        Ok(())
    }
}

#[derive(clap::Args, Clone)]
pub struct LengthArgs {
    /// Simulated time in seconds [default: 3]
    #[arg(long, value_name = "S", value_parser = positive, allow_hyphen_values = true, conflicts_with = "steps")]
    time: Option<f64>,
    /// Number of steps instead of a time
    #[arg(long, value_name = "N", value_parser = whole::<usize>, allow_negative_numbers = true)]
    steps: Option<usize>,
}

/// Numbers between blanks or commas.
#[derive(Clone, Debug)]
pub struct Numbers(Vec<f64>);

impl MethodArgs {
    /// Whether the command line asks for any method of its own.
    pub fn given(&self) -> bool {
        self.contact.is_some() || self.integrator.is_some() || self.timestep.is_some() || self.rounds != ROUNDS
    }

    /// How to compute the scene: what was asked for, else what the scene says, else the defaults.
    pub fn method(&self, model: &Model) -> Result<Method, Failure> {
        let law = self.contact.as_deref().or(model.contact_law()).unwrap_or(contact::default().name);
        let integrator = self.integrator.as_deref().unwrap_or(&model.opt.integrator);
        Ok(Method {
            contact: contact::by_name(law)
                .ok_or_else(|| unknown("contact law", law, contact::ALL.iter().map(|l| l.name)))?,
            integrator: integrate::by_name(integrator)
                .ok_or_else(|| unknown("integrator", integrator, integrate::ALL.iter().map(|i| i.name)))?,
            timestep: self.timestep.unwrap_or(model.opt.timestep),
            rounds: self.rounds,
        })
    }

    /// The laws to look at where several are shown: the one asked for, or all.
    pub fn laws(&self) -> Vec<&'static Law> {
        let asked = |law: &&Law| self.contact.as_deref().is_none_or(|name| law.name == name);
        contact::ALL.iter().copied().filter(asked).collect()
    }

    /// The integrators to look at where several are shown: the one asked for, or all.
    pub fn integrators(&self) -> Vec<&'static Integrator> {
        match &self.integrator {
            Some(name) => integrate::by_name(name).into_iter().collect(),
            None => integrate::ALL.to_vec(),
        }
    }
}

/// A scene names a law or an integrator that Penny does not have.
fn unknown<'a>(what: &str, name: &str, known: impl Iterator<Item = &'a str>) -> Failure {
    let known: Vec<&str> = known.collect();
    Failure::Problem(format!("error: the scene asks for the {what} `{name}`; Penny has {}", known.join(", ")))
}

impl StartArgs {
    /// Whether the command line asks for any start of its own.
    pub fn given(&self) -> bool {
        self.key.is_some()
            || self.load_state.is_some()
            || self.qpos.is_some()
            || self.qvel.is_some()
            || self.ctrl.is_some()
    }

    /// The options given, as one would type them; empty if there are none.
    pub fn told(&self) -> String {
        let numbers = |name: &str, given: &Option<Numbers>| {
            let Numbers(x) = given.as_ref()?;
            Some(format!("--{name} \"{}\"", x.iter().map(f64::to_string).collect::<Vec<_>>().join(" ")))
        };
        let key = self.key.as_ref().map(|key| format!("--key {key}"));
        let state = self.load_state.as_ref().map(|path| format!("--load-state {}", path.display()));
        let all = [key, state, numbers("qpos", &self.qpos), numbers("qvel", &self.qvel), numbers("ctrl", &self.ctrl)];
        all.into_iter().flatten().collect::<Vec<_>>().join(" ")
    }

    /// Where the run begins.
    pub fn state(&self, model: &Model) -> Result<State, Failure> {
        let mut state = State::new(model);
        if let Some(key) = &self.key {
            apply_key(model, key, &mut state)?;
        }
        if let Some(path) = &self.load_state {
            state = load_state(model, path)?;
        }
        set("qpos", &self.qpos, &mut state.qpos, || joint_list(model, qpos_names))?;
        set("qvel", &self.qvel, &mut state.qvel, || joint_list(model, qvel_names))?;
        set("ctrl", &self.ctrl, &mut state.ctrl, || {
            model.actuators.iter().map(|a| a.name.clone()).collect::<Vec<_>>().join(", ")
        })?;
        Ok(state)
    }
}

/// Reads a saved state.
///
/// Errors: it cannot be read, or is not of this scene.
fn load_state(model: &Model, path: &Path) -> Result<State, Failure> {
    let cannot = |why: String| Failure::Problem(format!("error: cannot start from `{}`: {why}", path.display()));
    let text = std::fs::read_to_string(path).map_err(|e| cannot(penny::reason(e)))?;
    penny_lab::record::read_state(model, &text).map_err(cannot)
}

/// Warns of controls beyond `ctrlrange`, which count as its nearer end.
pub fn clamped_controls(model: &Model, state: &State) -> String {
    let mut text = String::new();
    for (i, ctrl) in state.ctrl.iter().enumerate() {
        let used = penny_lab::record::clamped(model, i, *ctrl);
        if used != *ctrl {
            let name = penny_lab::names::actuator(model, i);
            text += &format!(
                "warning: ctrl {} of {name} counts as {}: its ctrlrange ends there\n",
                short(*ctrl),
                short(used)
            );
        }
    }
    text
}

fn apply_key(model: &Model, key: &str, state: &mut State) -> Result<(), Failure> {
    let by_name = model.keyframes.iter().find(|k| k.name == key && !key.is_empty());
    let by_index = || key.parse::<usize>().ok().and_then(|i| model.keyframes.get(i));
    let Some(found) = by_name.or_else(by_index) else {
        let has = if model.keyframes.is_empty() { "it has none".into() } else { format!("it has {}", keys(model)) };
        return Err(Failure::Usage(format!("error: the scene has no keyframe `{key}`: {has}")));
    };
    *state = State::at(model, found);
    Ok(())
}

/// The keyframes by name, or by number where they have none.
pub fn keys(model: &Model) -> String {
    let name = |(i, k): (usize, &Keyframe)| if k.name.is_empty() { i.to_string() } else { k.name.clone() };
    model.keyframes.iter().enumerate().map(name).collect::<Vec<_>>().join(", ")
}

/// Replaces a vector of the state by what the command line gave.
fn set(name: &str, given: &Option<Numbers>, to: &mut [f64], meaning: impl Fn() -> String) -> Result<(), Failure> {
    let Some(Numbers(given)) = given else { return Ok(()) };
    if given.len() != to.len() {
        let meaning = if to.is_empty() { String::new() } else { format!(": {}", meaning()) };
        let n = given.len();
        return Err(Failure::Usage(format!(
            "error: --{name} has {n} number{}, but this scene has {}{meaning}",
            if n == 1 { "" } else { "s" },
            to.len(),
        )));
    }
    to.copy_from_slice(given);
    Ok(())
}

/// What each number of `qpos` or `qvel` is: "disk (vx vy vz wx wy wz), …".
fn joint_list(model: &Model, names: fn(JointKind) -> &'static str) -> String {
    let one = |j: &Joint| {
        let name = if j.name.is_empty() { &model.bodies[j.body].name } else { &j.name };
        match names(j.kind) {
            "" => name.clone(),
            parts => format!("{name} ({parts})"),
        }
    };
    let mut list: Vec<String> = model.joints.iter().take(6).map(one).collect();
    if model.joints.len() > list.len() {
        list.push(format!("and {} more joints", model.joints.len() - list.len()));
    }
    list.join(", ")
}

fn qpos_names(kind: JointKind) -> &'static str {
    match kind {
        JointKind::Free => "x y z and quaternion w x y z",
        JointKind::Ball => "quaternion w x y z",
        JointKind::Slide | JointKind::Hinge => "",
    }
}

fn qvel_names(kind: JointKind) -> &'static str {
    match kind {
        JointKind::Free => "vx vy vz wx wy wz",
        JointKind::Ball => "wx wy wz",
        JointKind::Slide | JointKind::Hinge => "",
    }
}

impl LengthArgs {
    /// Whether a number of steps was asked for.
    pub fn counted(&self) -> bool {
        self.steps.is_some()
    }

    /// Steps of that length; warns where they end at another time than was asked for, by a thousandth of it.
    ///
    /// Errors: wrong usage, if there are more than [`MOST_STEPS`], or a time in which there is none.
    pub fn steps(&self, timestep: f64) -> Result<usize, Failure> {
        let time = self.time.unwrap_or(DEFAULT_TIME);
        let steps = self.steps.map_or_else(|| (time / timestep).round(), |n| n as f64);
        let h = si(timestep, "s");
        if steps == 0.0 && self.steps.is_none() {
            let time = si(time, "s");
            let why = format!(
                "error: {time} is too short for a timestep of {h}: give a longer --time or a smaller --timestep"
            );
            return Err(Failure::Usage(why));
        }
        if steps <= MOST_STEPS as f64 {
            if self.time.is_some() && (steps * timestep - time).abs() > 1e-3 * time {
                let [end, time] = [steps * timestep, time].map(|t| si(t, "s"));
                eprintln!("warning: the run ends at {end}: {time} is not a whole number of steps of {h}");
            }
            return Ok(steps as usize);
        }
        let help = match self.steps {
            Some(_) => "--steps".to_owned(),
            None => format!("{} at a timestep of {h}", si(time, "s")),
        };
        Err(Failure::Usage(format!(
            "error: {help} makes {} steps; the most is {}",
            short(steps),
            short(MOST_STEPS as f64),
        )))
    }
}

/// A scene, and what it was warned about.
pub struct Read {
    pub document: mjcf::Document,
    pub model: Model,
    /// The scene's own and those that it includes.
    pub files: Vec<PathBuf>,
    /// The report, for people.
    pub warnings: String,
    pub count: usize,
}

/// Reads and compiles a scene.
///
/// Errors: the report of all that is wrong with it.
pub fn read(path: &Path, limits: &Limits) -> Result<Read, Failure> {
    let colour = std::io::stderr().is_terminal();
    match penny::load_within(path, limits) {
        Ok(Scene { document, model, warnings }) => {
            let files = document.files.iter().map(|source| source.path.clone()).collect();
            let text = mjcf::render(&document, &warnings, colour);
            Ok(Read { document, model, files, warnings: text, count: warnings.len() })
        }
        Err(failure) => Err(Failure::Problem(mjcf::render(&failure.document, &failure.problems, colour))),
    }
}

/// Reads a scene to work with; warnings are printed.
pub fn load(path: &Path, limits: &LimitArgs) -> Result<Model, Failure> {
    load_apart(path, limits, &[])
}

/// Reads a scene to work with, which is apart from the files to write (each with the option that names it).
pub fn load_apart(path: &Path, limits: &LimitArgs, written: &[(&str, Option<&Path>)]) -> Result<Model, Failure> {
    let read = read(path, &limits.limits())?;
    files::apart(&read.files, written)?;
    if read.count > 0 {
        eprintln!("{}", read.warnings);
    }
    Ok(read.model)
}

pub fn law_parser() -> impl TypedValueParser<Value = String> {
    PossibleValuesParser::new(contact::ALL.iter().map(|l| PossibleValue::new(l.name).help(l.about)))
}

/// Where several may be named.
pub fn laws_parser() -> impl TypedValueParser<Value = String> {
    let laws = contact::ALL.iter().map(|l| PossibleValue::new(l.name).help(l.about));
    PossibleValuesParser::new(laws.chain([PossibleValue::new("all").help("each of them")]))
}

pub fn integrator_parser() -> impl TypedValueParser<Value = String> {
    IntegratorParser
}

/// An integrator by its own or by MJCF's name; a misspelt one gets the nearest as a tip.
#[derive(Clone)]
struct IntegratorParser;

impl IntegratorParser {
    fn values() -> impl Iterator<Item = PossibleValue> {
        integrate::ALL.iter().map(|i| PossibleValue::new(i.name).help(i.about).aliases(i.mjcf.iter().copied()))
    }
}

impl TypedValueParser for IntegratorParser {
    type Value = String;

    fn parse_ref(&self, cmd: &Command, arg: Option<&Arg>, value: &OsStr) -> Result<String, clap::Error> {
        PossibleValuesParser::new(Self::values()).parse_ref(cmd, arg, value).map_err(|mut error| {
            // clap compares with its own names only, and minds the case: `euler` is near to none of them.
            let names = integrate::ALL.iter().flat_map(|i| [i.name].into_iter().chain(i.mjcf.iter().copied()));
            if let Some(near) = mjcf::nearest(&value.to_string_lossy(), names) {
                error.insert(ContextKind::SuggestedValue, ContextValue::String(near.to_owned()));
            }
            error
        })
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(Self::values()))
    }
}

pub fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if x.is_finite() && x > 0.0 => Ok(x),
        _ => Err("must be a number of seconds above 0".to_owned()),
    }
}

/// For `--accuracy`.
pub fn length(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if x.is_finite() && x > 0.0 => Ok(x),
        _ => Err("must be a length in m above 0".to_owned()),
    }
}

/// A file that a chart can be written to.
pub fn picture(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    if penny_lab::plot::can_save(&path) { Ok(path) } else { Err("must end in .svg or .png".to_owned()) }
}

pub fn at_least_one(text: &str) -> Result<usize, String> {
    match text.parse::<usize>() {
        Ok(n) if n > 0 => Ok(n),
        _ => Err("must be a whole number above 0".to_owned()),
    }
}

/// For `--steps` and the like.
pub fn whole<N: std::str::FromStr>(text: &str) -> Result<N, String> {
    text.parse().map_err(|_| "must be a whole number, 0 or more".to_owned())
}

/// One to three coefficients of friction.
fn coefficients(text: &str) -> Result<Numbers, String> {
    let numbers = counted(text, 1..=3)?;
    if numbers.0.iter().all(|x| *x >= 0.0) { Ok(numbers) } else { Err("friction is 0 or more".to_owned()) }
}

fn two_numbers(text: &str) -> Result<Numbers, String> {
    let numbers = counted(text, 2..=2)?;
    match numbers.0[..] {
        [a, b] if (a > 0.0) == (b > 0.0) => Ok(numbers),
        _ => Err("either both are above 0 (timeconst, dampratio), or both at most 0 (-stiffness, -damping)".to_owned()),
    }
}

fn three_numbers(text: &str) -> Result<Numbers, String> {
    counted(text, 3..=3)
}

/// Numbers of solimp. What MuJoCo keeps within bounds is kept there, with a warning, as in a file.
fn impedance(text: &str) -> Result<Numbers, String> {
    const BOUNDS: [(f64, f64); 5] =
        [(1e-4, 0.9999), (1e-4, 0.9999), (0.0, f64::INFINITY), (1e-4, 0.9999), (1.0, f64::INFINITY)];
    let mut numbers = counted(text, 1..=5)?;
    for (x, (low, high)) in numbers.0.iter_mut().zip(BOUNDS) {
        let bounded = x.clamp(low, high);
        // A dmin of 0 is as good as 0.0001.
        if bounded != *x && *x != 0.0 {
            let range =
                if high.is_finite() { format!("between {low} and {high}") } else { format!("at {low} or more") };
            eprintln!("warning: --solimp {x} counts as {bounded}: MuJoCo keeps this number {range}");
        }
        *x = bounded;
    }
    Ok(numbers)
}

fn counted(text: &str, count: std::ops::RangeInclusive<usize>) -> Result<Numbers, String> {
    let numbers = numbers(text)?;
    if count.contains(&numbers.0.len()) {
        return Ok(numbers);
    }
    let (low, high) = (count.start(), count.end());
    let most = if low == high { String::new() } else { format!(" to {high}") };
    Err(format!("takes {low}{most} numbers, in quotes"))
}

fn numbers(text: &str) -> Result<Numbers, String> {
    let one = |word: &str| match word.parse::<f64>() {
        Ok(x) if x.is_finite() => Ok(x),
        _ => Err(format!("`{word}` is not a finite number")),
    };
    let words = text.split(|c: char| c.is_whitespace() || c == ',').filter(|w| !w.is_empty());
    words.map(one).collect::<Result<_, _>>().map(Numbers)
}
