//! `penny explain`: what a scene requires, and what its numbers mean.

mod overview;

use std::path::PathBuf;

use self::overview::Limits;
use super::Failure;
use super::doubts;
use super::format::{count, short, si, table};
use super::scene::{self, LimitArgs, MethodArgs, OverrideArgs};
use penny::collision::exact;
use penny::contact::constants::{self, Spring};
use penny::contact::describe::{self, Ask, Creep};
use penny::contact::tutorial;
use penny::data::Data;
use penny::forward::Method;
use penny::integrate::{self, Integrator};
use penny::model::{Cone, GeomKind, Mix, Model};
use penny::state::State;
use penny_lab::explain::loads::{self, Loads};
use penny_lab::explain::probe::{self, IMPACT, LARGEST};
use penny_lab::explain::{self, Budget, Meaning, Touch, touches, trial_run, weight};
use penny_lab::names::{body as body_name, geom as geom_name};
use penny_lab::sweep::theory;

#[derive(clap::Args)]
pub struct Args {
    /// MJCF file
    #[arg(value_name = "SCENE.xml")]
    scene: PathBuf,
    #[command(flatten)]
    method: MethodArgs,
    #[command(flatten)]
    limits: LimitArgs,
    #[command(flatten)]
    overrides: OverrideArgs,
    /// Say everything: every contact under every law and integrator, all joints and actuators, however long it takes
    #[arg(long)]
    all: bool,
}

/// The slope on which creep is told, degrees.
const SLOPE: f64 = 5.0;
/// Real time for all that is tried, s; the development build is slower. Without bound with `--all`.
const TRYING: f64 = if cfg!(debug_assertions) { 8.0 } else { 0.4 };

pub fn explain(args: &Args) -> Result<(), Failure> {
    let mut model = scene::load(&args.scene, &args.limits)?;
    args.overrides.apply(&mut model)?;
    let model = model;
    let method = args.method.method(&model)?;
    println!("{}\n\nWhat the scene requires", args.scene.display());
    for [name, value] in requirements(&model) {
        println!("  {name:<12} {value}");
    }
    println!("  {:<12} {}, {}, {}", "method", method.contact.name, method.integrator.name, si(method.timestep, "s"));
    let budget = || if args.all { Budget::unlimited() } else { Budget::seconds(0.3 * TRYING) };
    let start = State::new(&model);
    doubts::find_contacts(&model, &start, &mut Data::for_poses(&model))
        .map_err(|crowd| Failure::Problem(format!("error: no step can be taken: {crowd}")))?;
    let touches = touches(&model);
    let groups = group(&touches);
    let loads = loads::settle(&model, &method, &start, &budget());
    let mut limits = Limits::default();
    limits.add_springs(&model, &method);
    print!("{}", overview::joints(&model, &method, &start, args.all, &mut limits));
    print!("{}", overview::ties(&model, &method, &start, args.all));
    let tried = budget();
    // Of a single kind of contact there is room for all that is known; of several, for a line each.
    let whole = args.all || groups.len() == 1;
    if groups.len() > 1 {
        print!("{}", overview::contacts(&model, &method, &groups, &loads, args.all, &tried, &mut limits));
    } else if let Some(group) = groups.first() {
        overview::limits_of(&model, &method, group, &loads, &tried, &mut limits);
    }
    if whole && !groups.is_empty() {
        println!("\nWhat its contacts mean");
        for group in &groups {
            print!("\n{}", meaning(&model, &method, &args.method, group));
            print!("{}", under_load(&model, &method, group, &loads));
            print!("\n{}", timesteps(&model, &method, &args.method, &group[0]));
            print!("\n{}", mapping(&model, &method, &group[0]));
        }
    }
    let unyielding = explain::unyielding(&model);
    if !unyielding.is_empty() {
        println!(
            "\nNo spring is given for {}: a push at its centre of mass moves neither of the two; elsewhere it may turn one.",
            names(&model, &unyielding)
        );
    }
    print!("{}", in_a_row(&model, &start));
    if whole && let Some(group) = groups.first() {
        print!("{}", mappings(&model, &method, group));
    }
    let trial = budget();
    let text = trial_run(&model, &method, &start, &trial, &mut limits);
    // "Gains no energy" would contradict what theory says of a scene that starts in equilibrium.
    let contradicts = limits.broken() && text.contains("gain no energy");
    if !text.is_empty() && !contradicts {
        print!("\n{text}");
    }
    print!("{}", limits.text(!tried.used_up()));
    if !args.all && (tried.used_up() || trial.used_up()) {
        println!("\nNot everything could be tried in {}: --all tries everything.", si(TRYING, "s"));
    } else if !whole && !groups.is_empty() {
        println!("\n--all says everything: every contact under every law and integrator.");
    }
    Ok(())
}

/// How deep a contact goes under the load that it carries once the scene has settled, where that is not its own weight.
fn under_load(model: &Model, method: &Method, group: &[Touch], loads: &Loads) -> String {
    let heaviest = group.iter().max_by(|a, b| loads.of(a.geom).total_cmp(&loads.of(b.geom)));
    let Some(touch) = heaviest else { return String::new() };
    let (load, own) = (loads.of(touch.geom), touch.mass * weight(model));
    if load == 0.0 || (load / own - 1.0).abs() < 0.05 {
        return String::new();
    }
    // Without gravity there is none.
    let times = if own > 0.0 { format!(", {} times its own weight", short(load / own)) } else { String::new() };
    let depth = explain::depth_under(model, method, touch, load);
    let depth =
        depth.map_or_else(String::new, |depth| format!(": {} deep under {}", si(depth, "m"), method.contact.name));
    format!(
        "  it carries {} once the scene has settled ({} of simulated time){times}{depth}\n",
        si(load, "N"),
        si(loads.seconds, "s")
    )
}

/// The plan of a scene in words: what moves, what can touch, what else a step has to compute.
pub fn requirements(model: &Model) -> Vec<[String; 2]> {
    let requires = &model.requires;
    let mut rows = vec![["moves".to_owned(), moves(model)], ["can touch".to_owned(), can_touch(model)]];
    let inexact = requires.colliders.iter().filter(|[a, b]| !exact(*a, *b)).map(shapes).collect::<Vec<_>>().join(", ");
    if !inexact.is_empty() {
        rows.push([String::new(), format!("contact points may differ from MuJoCo's: {inexact}")]);
    }
    let also: Vec<String> = [
        (requires.limits, "joint limit", "joint limits"),
        (requires.springs, "spring", "springs"),
        (requires.dampers, "damper", "dampers"),
        (requires.frictionloss, "joint with dry friction", "joints with dry friction"),
        (requires.armature, "joint with armature", "joints with armature"),
        (requires.tendons, "tendon", "tendons"),
        (requires.equalities, "equality", "equalities"),
        (requires.actuators, "actuator", "actuators"),
    ]
    .into_iter()
    .filter(|(n, ..)| *n > 0)
    .map(|(n, one, many)| count(n, one, many))
    .collect();
    if !also.is_empty() {
        rows.push(["also".to_owned(), also.join(", ")]);
    }
    rows
}

fn moves(model: &Model) -> String {
    let requires = &model.requires;
    if requires.moving_bodies == 0 {
        return "nothing".to_owned();
    }
    let mut parts = vec![
        count(requires.moving_bodies, "body", "bodies")
            + &format!(" with {}", count(model.nv, "degree of freedom", "degrees of freedom")),
    ];
    if requires.free_trees > 0 {
        let all = requires.articulated_trees == 0;
        parts.push(format!("{} free (closed form)", if all { "all".into() } else { requires.free_trees.to_string() }));
    }
    for (i, tree) in model.trees.iter().enumerate().filter(|(_, t)| t.free.is_none()) {
        let joints: Vec<&str> =
            model.joints.iter().filter(|j| tree.bodies.contains(&j.body)).map(|j| j.kind.name()).collect();
        let turn = if tree.rotates { "" } else { "; never turns" };
        parts.push(format!("{} on {}{turn}", body_name(model, tree.bodies.start), joints.join(" + ")));
        if i >= 5 {
            parts.push("…".to_owned());
            break;
        }
    }
    parts.join("; ")
}

fn can_touch(model: &Model) -> String {
    let requires = &model.requires;
    if requires.pairs == 0 && requires.swept == 0 {
        return "nothing: a step does no contact work".to_owned();
    }
    let mut parts = vec![count(requires.pairs, "pair", "pairs")];
    if requires.swept > 0 {
        parts.push(format!("and {} geoms that are sorted in each step to find more", requires.swept));
    }
    let friction = match requires.condim {
        1 => "no friction",
        3 => "sliding friction",
        4 => "sliding and torsional friction",
        _ => "sliding, torsional and rolling friction",
    };
    let kinds: Vec<String> = requires.colliders.iter().map(shapes).collect();
    format!("{}: {}; {friction} (condim {})", parts.join(" "), kinds.join(", "), requires.condim)
}

/// "plane–box"
fn shapes([a, b]: &[GeomKind; 2]) -> String {
    format!("{}–{}", a.name(), b.name())
}

/// Pairs that mean the same, together.
pub fn group(touches: &[Touch]) -> Vec<Vec<Touch>> {
    let same = |a: &Touch, b: &Touch| {
        let close = |x: f64, y: f64| (x - y).abs() <= 1e-9 * x.abs();
        a.mix == b.mix
            && a.points == b.points
            && a.rests == b.rests
            && close(a.mass, b.mass)
            && close(a.estimate, b.estimate)
    };
    let mut groups: Vec<Vec<Touch>> = Vec::new();
    for touch in touches {
        match groups.iter_mut().find(|g| same(&g[0], touch)) {
            Some(group) => group.push(touch.clone()),
            None => groups.push(vec![touch.clone()]),
        }
    }
    groups
}

/// One line a group: the spring that the law of `method` makes of it.
pub fn springs(model: &Model, method: &Method, touches: &[Touch]) -> Vec<String> {
    let line = |group: &Vec<Touch>| {
        let touch = &group[0];
        let meaning = explain::meaning(model, method, touch, 0.0);
        let own = meaning.formulas.springs.map(|[rest, _]| rest);
        let Some(spring) = own.or(meaning.measured.map(|m| m.spring)) else {
            return format!("{}: {} gives no formula, and holds no weight", names(model, group), method.contact.name);
        };
        let each =
            if touch.points > 1 && (own.is_none() || meaning.formulas.each_point) { " at each point" } else { "" };
        format!(
            "{}{each}: k {}, c {}, ω {}, ζ {}{}",
            names(model, group),
            si(spring.k, "N/m"),
            si(spring.c, "N s/m"),
            si(spring.omega(), "rad/s"),
            defined(spring.zeta(), &short),
            if own.is_some() { "" } else { " (measured at rest; the law gives no formula)" }
        )
    };
    group(touches).iter().map(line).collect()
}

/// The order in which contacts are tried.
mod largest {
    use super::{Ask, Method, Model, Touch};

    /// Groups of contacts, the stiffest first; those without a formula before all.
    pub fn stiffest_first(model: &Model, method: &Method, groups: &[Vec<Touch>]) -> Vec<Vec<Touch>> {
        let omega = |g: &Vec<Touch>| {
            let ask = Ask { model, touch: &g[0], timestep: method.timestep, slope: 0.0 };
            (method.contact.describe)(&ask).springs.map_or(f64::INFINITY, |[rest, hard]| rest.omega().max(hard.omega()))
        };
        let mut sorted = groups.to_vec();
        sorted.sort_by(|a, b| omega(b).total_cmp(&omega(a)));
        sorted
    }
}

/// The smallest of the largest stable timesteps of pairs and of joints' springs and servos, s, and whose it is. Where the
/// budget ends, the stiffest contacts have been tried.
pub fn largest_timestep(model: &Model, method: &Method, touches: &[Touch], budget: &Budget) -> Option<(f64, String)> {
    let of_joint = |spring: theory::Spring| Some((theory::limit(method.integrator, &spring)?, spring.name));
    let mut limits: Vec<(f64, String)> =
        theory::joint_springs(model).into_iter().filter_map(of_joint).filter(|(limit, _)| limit.is_finite()).collect();
    let groups = largest::stiffest_first(model, method, &group(touches));
    for group in groups.iter().take(20).take_while(|_| budget.left()) {
        limits.extend(probe::largest_timestep(model, method, &group[0]).map(|limit| (limit, names(model, group))));
    }
    limits.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))
}

/// An integrator under which all springs and limits of joints and tendons are stable at this timestep, by theory.
fn stable_by_theory(model: &Model, method: &Method) -> Option<&'static str> {
    let stable = |i: &&&Integrator| {
        i.name != method.integrator.name && theory::limits(model, i).iter().all(|(_, limit)| *limit > method.timestep)
    };
    [&integrate::implicitfast::METHOD, &integrate::implicit_euler::METHOD].iter().find(|i| stable(i)).map(|i| i.name)
}

/// An integrator under which a start that is unstable now gains nothing at the same timestep, by theory and tried out.
pub fn stable_integrator(model: &Model, method: &Method, start: &State, budget: &Budget) -> Option<&'static str> {
    let stable = |integrator: &&&'static Integrator| {
        let other = Method { integrator, ..*method };
        let theory = theory::joint_springs(model)
            .iter()
            .all(|s| theory::limit(integrator, s).is_none_or(|limit| limit > method.timestep));
        theory
            && integrator.name != method.integrator.name
            && budget.left()
            && trial_run::largest_timestep(model, &other, start, budget).is_none()
            && !budget.used_up()
    };
    // The cheapest first.
    let order = [integrate::implicitfast::METHOD.name, integrate::implicit_euler::METHOD.name];
    order.iter().filter_map(|name| integrate::ALL.iter().find(|i| i.name == *name)).find(stable).map(|i| i.name)
}

/// Said after a run in which some step's equations were not solved; empty otherwise.
pub fn unsolved(data: &Data, method: &Method, steps: usize) -> String {
    let mut text = String::new();
    if data.unsolved > 0 {
        let n = data.unsolved;
        text += &format!(
            "  in {n} of {steps} steps Newton's method of the implicit step did not converge: the forces at its last guess acted\n"
        );
    }
    if data.unconverged > 0 {
        let n = data.unconverged;
        let nearer = method.contact.nearer;
        text += &format!("  in {n} of {steps} steps the contact forces did not converge: {nearer}\n");
    }
    text
}

/// One column a law: what it makes of the pair's numbers.
fn meaning(model: &Model, method: &Method, asked: &MethodArgs, group: &[Touch]) -> String {
    let touch = &group[0];
    let points = if touch.points > 1 { format!(", {} points when it lies flat", touch.points) } else { String::new() };
    let text = format!(
        "{}: {}{points}\n{}",
        names(model, group),
        parameters(&model.mixes[touch.mix]),
        origin(model, touch).map_or_else(String::new, |origin| format!("  {origin}\n"))
    );
    let mut rows: Vec<Vec<String>> = [
        "",
        "mass m",
        "stiffness k",
        "damping c",
        "frequency ω = √(k/m)",
        "damping ratio ζ = c/(2√(km))",
        "coefficient of restitution (fast impact)",
        "depth at rest",
        &format!("creep on a slope of {SLOPE}°"),
    ]
    .map(|name| vec![name.to_owned()])
    .to_vec();
    let mut silent = Vec::new();
    for contact in asked.laws() {
        let law = Method { contact, ..*method };
        let cells = column(model, &law, touch);
        if cells.iter().any(|cell| cell.ends_with(MEASURED)) {
            silent.push(contact.name);
        }
        for (row, cell) in rows.iter_mut().zip(cells) {
            row.push(cell);
        }
    }
    if !touch.rests || weight(model) == 0.0 {
        rows.truncate(7);
    } else if model.mixes[touch.mix].condim == 1 {
        rows.truncate(8);
    }
    let mut text = text + &table(&rows);
    if !silent.is_empty() {
        text += &format!(
            "  {MEASURED} {} gives no formula; measured: one point with its share of the mass, at rest; c on approach; an \
             impact at {}\n",
            silent.join(", "),
            si(IMPACT, "m/s")
        );
    }
    for contact in asked.laws() {
        text += &never_rests(model, &Method { contact, ..*method }, touch).unwrap_or_default();
    }
    text
}

/// A number of a contact, or none: without stiffness it has no damping ratio, no restitution and no depth at rest.
fn defined(x: f64, write: &dyn Fn(f64) -> String) -> String {
    if x.is_finite() { write(x) } else { "none".to_owned() }
}

/// Marks what is measured since the law gives no formula.
const MEASURED: char = '*';

/// The same pair under the law of `method`, in the order of the rows of [`meaning`].
pub fn column(model: &Model, method: &Method, touch: &Touch) -> [String; 9] {
    let Meaning { formulas, measured } = explain::meaning(model, method, touch, SLOPE.to_radians());
    // A number by formula, else as measured, else none.
    let cell = |formula: Option<f64>, shown: Option<f64>, write: &dyn Fn(f64) -> String| match (formula, shown) {
        (Some(x), _) => defined(x, write),
        (None, Some(x)) => format!("{} {MEASURED}", defined(x, write)),
        (None, None) => "no formula".to_owned(),
    };
    let of_spring = |get: fn(&Spring) -> f64, write: &dyn Fn(f64) -> String| {
        cell(formulas.springs.map(|[rest, _]| get(&rest)), measured.map(|m| get(&m.spring)), write)
    };
    let creep = match formulas.creep {
        Some(Creep::Sticks) => "none".to_owned(),
        Some(Creep::At(v)) if v.is_finite() => si(v, "m/s"),
        Some(Creep::Slides | Creep::At(_)) => "slides".to_owned(),
        None => "no formula".to_owned(),
    };
    let each_point = formulas.each_point || formulas.springs.is_none();
    let name = method.contact.name;
    [
        if each_point && touch.points > 1 { format!("{name} (a point)") } else { name.to_owned() },
        of_spring(|s| s.mass, &|m| si(m * 1e3, "g")),
        of_spring(|s| s.k, &|k| si(k, "N/m")),
        of_spring(|s| s.c, &|c| si(c, "N s/m")),
        of_spring(Spring::omega, &|w| si(w, "rad/s")),
        of_spring(Spring::zeta, &short),
        cell(formulas.restitution, measured.map(|m| m.restitution), &short),
        cell(formulas.rest_depth, measured.map(|m| m.rest_depth), &|d| si(d, "m")),
        creep,
    ]
}

/// The first groups of pairs on which a body hops instead of resting, and how.
pub fn hopping(model: &Model, method: &Method, touches: &[Touch], budget: &Budget) -> Vec<(String, probe::Hop)> {
    let of = |group: Vec<Touch>| Some((names(model, &group), probe::hop(model, method, &group[0])?));
    group(touches).into_iter().take(4).take_while(|_| budget.left()).filter_map(of).collect()
}

/// Says so where a body never comes to rest on the contact, but hops within what a step's fall gives.
fn never_rests(model: &Model, method: &Method, touch: &Touch) -> Option<String> {
    let probe::Hop { rest, depth: [low, high], fall } = probe::hop(model, method, touch)?;
    let help = match probe::calm_timestep(model, method, touch) {
        Some(h) => format!("--timestep {} rests, as may a softer contact (larger timeconst, smaller solimp)", short(h)),
        None => "try a softer contact: a larger timeconst in solref, a smaller dwidth in solimp".to_owned(),
    };
    let ask = Ask { model, touch, timestep: method.timestep, slope: 0.0 };
    // The pyramid's edges make contacts of MuJoCo's kind rest higher, where μ is small.
    let own = (method.contact.describe)(&ask).springs;
    let pyramid = constants::softness(&model.mixes[touch.mix], model.opt.cone, model.opt.impratio, 1.0, 1) < 1.0;
    let cone =
        if pyramid && own == describe::soft(&ask).springs { ", or cone=\"elliptic\", which rests deeper" } else { "" };
    Some(format!(
        "  {}: {} for rest is little beside the fall g h² = {} of one step: a body that has left the ground once does not come to rest, \
         but hops from {} off to {} into it. {help}{cone}\n",
        method.contact.name,
        si(rest, "m"),
        si(fall, "m"),
        si(-low, "m"),
        si(high, "m")
    ))
}

fn parameters(mix: &Mix) -> String {
    let join = |numbers: &[f64]| numbers.iter().map(|x| short(*x)).collect::<Vec<_>>().join(" ");
    format!(
        "condim {}, friction {}, solref {}, solimp {}",
        mix.condim,
        join(&[mix.friction[0], mix.friction[2], mix.friction[3]]),
        join(&mix.solref),
        join(&mix.solimp)
    )
}

/// Where a contact's friction and reference come from, if its two geoms differ: "friction 1: the larger of floor 1, puck 0.1".
pub fn origin(model: &Model, touch: &Touch) -> Option<String> {
    let mix = &model.mixes[touch.mix];
    let pair = model.pairs.listed.iter().find(|p| p.geom == touch.geom)?;
    if pair.given.is_some() {
        return Some("all of it from a <pair>".to_owned());
    }
    let [a, b] = touch.geom.map(|g| &model.geoms[g]);
    let [a_name, b_name] = touch.geom.map(|g| geom_name(model, g));
    let same = a.friction == b.friction && a.solref == b.solref && a.solimp == b.solimp;
    if same || model.opt.contact_override.is_some() {
        return None;
    }
    if a.priority != b.priority {
        let name = if a.priority > b.priority { a_name } else { b_name };
        return Some(format!("friction, solref and solimp of {name}, which has the higher priority"));
    }
    let mut parts = Vec::new();
    if a.friction[0] != b.friction[0] {
        let [fa, fb] = [a, b].map(|g| short(g.friction[0]));
        parts.push(format!("friction {}: the larger of {a_name} {fa}, {b_name} {fb}", short(mix.friction[0])));
    }
    let pair_of = |x: &[f64]| x.iter().take(2).map(|x| short(*x)).collect::<Vec<_>>().join(" ");
    let how = |direct: bool| match (direct, a.solmix == b.solmix) {
        (true, _) => "the smaller of",
        (false, true) => "mean of",
        (false, false) => "mean, weighted by solmix, of",
    };
    if a.solref != b.solref {
        let direct = a.solref[0] <= 0.0 || b.solref[0] <= 0.0;
        parts.push(format!(
            "solref {}: {} two, {a_name} {}, {b_name} {}",
            pair_of(&mix.solref),
            how(direct),
            pair_of(&a.solref),
            pair_of(&b.solref)
        ));
    }
    if a.solimp != b.solimp {
        parts.push(format!(
            "solimp {}: {} two, {a_name} {}, {b_name} {}",
            pair_of(&mix.solimp),
            how(false),
            pair_of(&a.solimp),
            pair_of(&b.solimp)
        ));
    }
    (!parts.is_empty()).then(|| parts.join("; "))
}

/// Says so where a blow would be shared out among bodies that touch in a row.
pub fn in_a_row(model: &Model, start: &State) -> String {
    let row = |row: Vec<usize>| {
        let names: Vec<String> = row.iter().take(6).map(|&b| body_name(model, b)).collect();
        format!(
            "\n{}{} touch in a row. An impact along it acts on all of them at once, since the springs of all their\ncontacts \
             yield together (in MuJoCo too): a Newton's cradle needs gaps of some millimetres to pass it on.\n",
            names.join(", "),
            if row.len() > names.len() { " …" } else { "" }
        )
    };
    explain::rows_in_touch(model, start).into_iter().map(row).collect()
}

/// What the start of the scene, tried out, says about the timestep.
fn trial_run(model: &Model, method: &Method, start: &State, budget: &Budget, limits: &mut Limits) -> String {
    let (law, integrator, h) = (method.contact.name, method.integrator.name, si(method.timestep, "s"));
    let tried = format!("Its first seconds, tried with {law}, {integrator} and a step of {h}");
    let found = trial_run::largest_timestep(model, method, start, budget);
    // A spring beyond its limit says why.
    if let Some(limit) = found.filter(|_| !limits.broken()) {
        limits.add_start(method, limit);
    }
    match found {
        None if budget.used_up() => String::new(),
        None => format!("{tried}, gain no energy.\n"),
        Some(0.0) => format!("{tried}, gain energy; with each smaller step tried, too.\n"),
        Some(limit) => format!("{tried}, gain energy; with {} they do not.\n", si(limit, "s")),
    }
}

/// The largest stable timestep of every law and integrator, measured.
fn timesteps(model: &Model, method: &Method, asked: &MethodArgs, touch: &Touch) -> String {
    let integrators = asked.integrators();
    let mut rows = vec![vec!["largest stable timestep of this contact alone".to_owned()]];
    rows[0].extend(integrators.iter().map(|i| i.name.to_owned()));
    let mut softens = false;
    for contact in asked.laws() {
        let mut row = vec![contact.name.to_owned()];
        row.extend(integrators.iter().map(|&integrator| {
            match probe::largest_timestep(model, &Method { contact, integrator, ..*method }, touch) {
                None => "–".to_owned(),
                Some(0.0) => "none".to_owned(),
                Some(limit) if limit >= LARGEST => {
                    softens |= !integrator.implicit;
                    "no limit found".to_owned()
                }
                Some(limit) => si(limit, "s"),
            }
        }));
        rows.push(row);
    }
    let what = "  alone: moving along its normal only. Tilting, impacts and friction may bear less\n";
    let why =
        "  no limit found: with a longer step REFSAFE makes the contact softer (timeconst is at least two steps)\n";
    table(&rows) + what + if softens { why } else { "" }
}

/// The tutorial's spring of all points together: they carry the whole mass.
fn total_spring(model: &Model, method: &Method, touch: &Touch) -> Spring {
    let point = tutorial::spring(model, touch, method.timestep);
    let n = touch.points as f64;
    Spring { mass: touch.mass, k: n * point.k, c: n * point.c }
}

/// What the tutorial's formula for solref would have made of the tutorial's k and c.
fn mapping(model: &Model, method: &Method, touch: &Touch) -> String {
    let spring = total_spring(model, method, touch);
    if spring.k == 0.0 {
        return "  without stiffness it holds no weight; no timeconst means that\n".to_owned();
    }
    if spring.c == 0.0 {
        return format!(
            "  solref for k = {} without damping: \"-{} 0\", which is -k/m and -c/m; no timeconst means it\n",
            si(spring.k, "N/m"),
            short(spring.k / spring.mass)
        );
    }
    let (right, tutorial) = (spring.solref(), spring.tutorial_solref());
    let got = Spring::of_solref(spring.mass, tutorial);
    let numbers = |[tau, zeta]: [f64; 2]| format!("\"{} {}\"", short(tau), short(zeta));
    let mut text = format!(
        "  solref for k = {}, c = {}: {} by timeconst = 2m/c, dampratio = c/(2√(mk))\n",
        si(spring.k, "N/m"),
        si(spring.c, "N s/m"),
        numbers(right)
    );
    text += &if (spring.zeta() - 1.0).abs() < 1e-6 {
        "  the tutorial's timeconst = √(m/k) is the same here, since ζ = 1\n".to_owned()
    } else {
        format!(
            "  the tutorial's timeconst = √(m/k) gives {}: {} times the stiffness, {} times the damping, {} times the frequency\n",
            numbers(tutorial),
            short(got.k / spring.k),
            short(got.c / spring.c),
            short(got.omega() / spring.omega())
        )
    };
    if model.opt.cone == Cone::Pyramidal && model.mixes[touch.mix].condim > 1 && touch.rests {
        text += "  the pyramidal cone makes this contact rest higher than solimp says; cone=\"elliptic\" does not\n";
    }
    text
}

/// The tutorial's formula for `solref` beside the right one, over damping ratios; nothing where there is no stiffness.
fn mappings(model: &Model, method: &Method, group: &[Touch]) -> String {
    let spring = total_spring(model, method, &group[0]);
    if spring.k == 0.0 {
        return String::new();
    }
    let own = spring.zeta();
    let mut ratios = vec![0.2, 1.0, 3.0];
    ratios.retain(|ratio| (ratio - own).abs() > 1e-3);
    // Without damping there is no timeconst.
    if own > 0.0 {
        ratios.push(own);
    }
    ratios.sort_by(f64::total_cmp);
    let mut rows =
        vec![["ζ", "timeconst = 2m/c", "the tutorial's √(m/k)", "which means", "", ""].map(str::to_owned).to_vec()];
    for zeta in ratios {
        let spring = Spring { c: zeta * 2.0 * (spring.k * spring.mass).sqrt(), ..spring };
        let tutorial = spring.tutorial_solref();
        let got = Spring::of_solref(spring.mass, tutorial);
        rows.push(vec![
            if zeta == own { format!("{} (as here)", short(zeta)) } else { short(zeta) },
            si(spring.solref()[0], "s"),
            si(tutorial[0], "s"),
            format!("{} k", short(got.k / spring.k)),
            format!("{} c", short(got.c / spring.c)),
            format!("{} ω", short(got.omega() / spring.omega())),
        ]);
    }
    format!(
        "\nThe tutorial's solref is right at a damping ratio ζ of 1 only. For m = {}, k = {} ({}):\n\n{}",
        si(spring.mass * 1e3, "g"),
        si(spring.k, "N/m"),
        names(model, group),
        table(&rows)
    )
}

/// "ground – disk_geom", or "ground – low, middle, high".
fn names(model: &Model, group: &[Touch]) -> String {
    const SHOWN: usize = 3;
    let [first, second] = group[0].geom;
    let same_first = group.iter().all(|t| t.geom[0] == first);
    let mut list: Vec<String> = if same_first {
        group.iter().take(SHOWN).map(|t| geom_name(model, t.geom[1])).collect()
    } else {
        let pair = |t: &Touch| t.geom.map(|g| geom_name(model, g)).join(" – ");
        group.iter().take(SHOWN).map(pair).collect()
    };
    if group.len() > SHOWN {
        list.push(format!("{} more", group.len() - SHOWN));
    }
    match (same_first, group.len()) {
        (true, 1) => format!("{} – {}", geom_name(model, first), geom_name(model, second)),
        (true, _) => format!("{} – {}", geom_name(model, first), list.join(", ")),
        _ => list.join(", "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use penny::contact::{Law, describe};
    use penny::integrate;

    /// The course's law, from a record that says nothing of it.
    static SILENT: Law = Law { name: "silent", describe: describe::nothing, ..tutorial::LAW };

    #[test]
    fn a_law_without_formulas_is_measured_and_said_to_be() {
        let text = r#"<mujoco><custom><numeric name="penny.k" data="2500"/><numeric name="penny.c" data="20"/></custom>
            <worldbody><geom type="plane" size="1 1 1"/>
            <body pos="0 0 .2"><freejoint/><geom size=".1" mass="1"/></body></worldbody></mujoco>"#;
        let model = penny::parse("ball.xml", text).unwrap_or_else(|e| panic!("{e}")).model;
        let integrator = integrate::by_name("Euler").expect("an integrator");
        let columns = [&tutorial::LAW, &SILENT].map(|contact| {
            let method = Method { contact, integrator, timestep: 1e-3, rounds: penny::forward::ROUNDS };
            column(&model, &method, &touches(&model)[0])
        });
        // m g / k, not MuJoCo's 68 µm.
        assert_eq!((columns[0][7].as_str(), columns[1][7].as_str()), ("3.92 mm", "3.92 mm *"));
        for i in (1..8).filter(|i| *i != 6) {
            assert_eq!(format!("{} *", columns[0][i]), columns[1][i], "{columns:?}");
        }
        // What an impact gives back is measured at one speed, in finite steps.
        let [formula, measured] =
            [0, 1].map(|i| columns[i][6].trim_end_matches(" *").parse::<f64>().expect("a number"));
        assert!((formula - measured).abs() < 3e-3 && columns[1][6].ends_with(MEASURED), "{columns:?}");
        assert_eq!(columns[1][8], "no formula");
    }
}
