//! `penny explain`: what a scene requires, and what its numbers mean.

use super::Failure;
use std::path::PathBuf;

use super::format::{count, short, si, table};
use super::scene::{self, MethodArgs};
use crate::collision::exact;
use crate::contact::constants::{self, Spring};
use crate::contact::{penalty, tutorial};
use crate::data::Data;
use crate::explain::probe::{LARGEST, largest_timestep as probe};
use crate::explain::{Touch, rehearsal, touches, weight};
use crate::forward::Method;
use crate::model::{Cone, GeomKind, Mix, Model};
use crate::state::State;
use crate::sweep::theory;

#[derive(clap::Args)]
pub struct Args {
    /// MJCF file
    #[arg(value_name = "SCENE.xml")]
    scene: PathBuf,
    #[command(flatten)]
    method: MethodArgs,
}

/// The slope on which creep is told, degrees.
const SLOPE: f64 = 5.0;

pub fn explain(args: &Args) -> Result<(), Failure> {
    let model = scene::load(&args.scene)?;
    let method = args.method.method(&model)?;
    eprintln!("{}\n\nWhat the scene requires", args.scene.display());
    for [name, value] in requirements(&model) {
        eprintln!("  {name:<12} {value}");
    }
    eprintln!("  {:<12} {}, {}, {}", "method", method.contact.name, method.integrator.name, si(method.timestep, "s"));
    let groups = group(&touches(&model, &method));
    if groups.is_empty() {
        return Ok(());
    }
    eprintln!("\nWhat its contacts mean");
    for group in &groups {
        eprint!("\n{}", meaning(&model, &method, &args.method, group));
        eprint!("\n{}", timesteps(&model, &method, &args.method, &group[0]));
        eprint!("\n{}", mapping(&model, &method, &group[0]));
    }
    eprint!("\n{}", mappings(&model, &method, &groups[0]));
    eprint!("\n{}", rehearsed(&model, &method));
    Ok(())
}

/// The plan of a scene in words: what moves, what can touch, what else a step has to compute.
pub fn requirements(model: &Model) -> Vec<[String; 2]> {
    let plan = &model.plan;
    let mut rows = vec![["moves".to_owned(), moves(model)], ["can touch".to_owned(), can_touch(model)]];
    let inexact = plan.colliders.iter().filter(|[a, b]| !exact(*a, *b)).map(shapes).collect::<Vec<_>>().join(", ");
    if !inexact.is_empty() {
        rows.push([String::new(), format!("contact points may differ from MuJoCo's: {inexact}")]);
    }
    let also: Vec<String> = [
        (plan.limits, "joint limit", "joint limits"),
        (plan.springs, "spring", "springs"),
        (plan.dampers, "damper", "dampers"),
        (plan.frictionloss, "joint with dry friction", "joints with dry friction"),
        (plan.armature, "joint with armature", "joints with armature"),
        (plan.actuators, "actuator", "actuators"),
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
    let plan = &model.plan;
    if plan.moving_bodies == 0 {
        return "nothing".to_owned();
    }
    let mut parts = vec![
        count(plan.moving_bodies, "body", "bodies")
            + &format!(" with {}", count(model.nv, "degree of freedom", "degrees of freedom")),
    ];
    if plan.free_trees > 0 {
        let all = plan.articulated_trees == 0;
        parts.push(format!("{} free (closed form)", if all { "all".into() } else { plan.free_trees.to_string() }));
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
    let plan = &model.plan;
    if plan.pairs == 0 && plan.swept == 0 {
        return "nothing: a step does no contact work".to_owned();
    }
    let mut parts = vec![count(plan.pairs, "pair", "pairs")];
    if plan.swept > 0 {
        parts.push(format!("and {} geoms that are sorted in each step to find more", plan.swept));
    }
    let friction = match plan.condim {
        1 => "no friction",
        3 => "sliding friction",
        4 => "sliding and torsional friction",
        _ => "sliding, torsional and rolling friction",
    };
    let kinds: Vec<String> = plan.colliders.iter().map(shapes).collect();
    format!("{}: {}; {friction} (condim {})", parts.join(" "), kinds.join(", "), plan.condim)
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
        let (spring, each) = if method.contact.name == tutorial::LAW.name {
            (touch.tutorial_spring(model, method.timestep), if touch.points > 1 { " at each point" } else { "" })
        } else {
            (touch.springs(model, method.timestep)[0], "")
        };
        format!(
            "{}{each}: k {}, c {}, ω {}, ζ {}",
            names(model, group),
            si(spring.k, "N/m"),
            si(spring.c, "N s/m"),
            si(spring.omega(), "rad/s"),
            short(spring.zeta())
        )
    };
    group(touches).iter().map(line).collect()
}

/// The smallest of the largest stable timesteps of pairs and of joints' springs, s, and whose it is.
pub fn largest_timestep(model: &Model, method: &Method, touches: &[Touch]) -> Option<(f64, String)> {
    let of_pair = |g: &Vec<Touch>| Some((probe(model, method, &g[0])?, names(model, g)));
    let of_joint = |spring: theory::Spring| Some((theory::limit(method.integrator, &spring)?, spring.name));
    let pairs = group(touches).into_iter().take(20).filter_map(|g| of_pair(&g)).collect::<Vec<_>>();
    let joints = theory::joint_springs(model).into_iter().filter_map(of_joint);
    joints.chain(pairs).min_by(|a, b| a.0.total_cmp(&b.0))
}

/// Said after a run in which `implicit-euler` could not solve every step's equation; empty otherwise.
pub fn unsolved(data: &Data, steps: usize) -> String {
    match data.unsolved {
        0 => String::new(),
        n => format!(
            "  in {n} of {steps} steps no end of the step fitted its forces: those of the nearest guess acted\n"
        ),
    }
}

/// One column a law: what it makes of the pair's numbers.
fn meaning(model: &Model, method: &Method, asked: &MethodArgs, group: &[Touch]) -> String {
    let touch = &group[0];
    let points = if touch.points > 1 { format!(", {} points when it lies flat", touch.points) } else { String::new() };
    let text = format!("{}: {}{points}\n", names(model, group), parameters(&model.mixes[touch.mix]));
    let mut rows: Vec<Vec<String>> = [
        "",
        "mass m",
        "stiffness k",
        "damping c",
        "frequency ω = √(k/m)",
        "damping ratio ζ = c/(2√(km))",
        "share of a fast impact's speed given back",
        "depth at rest",
        &format!("creep on a slope of {SLOPE}°"),
    ]
    .map(|name| vec![name.to_owned()])
    .to_vec();
    for law in asked.laws() {
        for (row, cell) in rows.iter_mut().zip(column(model, method, touch, law.name)) {
            row.push(cell);
        }
    }
    if !touch.rests || weight(model) == 0.0 {
        rows.truncate(7);
    } else if model.mixes[touch.mix].condim == 1 {
        rows.truncate(8);
    }
    text + &table(&rows)
}

/// The same pair under one law, in the order of the rows of [`meaning`].
fn column(model: &Model, method: &Method, touch: &Touch, law: &str) -> [String; 9] {
    let mix = &model.mixes[touch.mix];
    let slope = SLOPE.to_radians();
    let is_tutorial = law == tutorial::LAW.name;
    let (spring, restitution, sink) = if is_tutorial {
        let spring = touch.tutorial_spring(model, method.timestep);
        (spring, constants::tutorial_restitution(spring.zeta()), spring.mass * weight(model) / spring.k)
    } else {
        let [rest, hard] = touch.springs(model, method.timestep);
        (rest, constants::restitution(hard.zeta()), touch.rest_depth(model, method.timestep))
    };
    let mu = if is_tutorial { model.tutorial.mu.unwrap_or(mix.friction[0]) } else { mix.friction[0] };
    let alpha = model.tutorial.alpha.unwrap_or(tutorial::DEFAULT_ALPHA);
    let creep = match constants::tutorial_creep(mu, alpha, slope) {
        None => "slides".to_owned(),
        Some(v) if is_tutorial => si(v, "m/s"),
        // Its friction acts on the velocity at the end of the step: it sticks.
        Some(_) if law == penalty::LAW.name => "none".to_owned(),
        Some(_) => si(touch.creep(model, method.timestep, slope), "m/s"),
    };
    let name = if is_tutorial && touch.points > 1 { format!("{law} (a point)") } else { law.to_owned() };
    [
        name,
        si(spring.mass * 1e3, "g"),
        si(spring.k, "N/m"),
        si(spring.c, "N s/m"),
        si(spring.omega(), "rad/s"),
        short(spring.zeta()),
        short(restitution),
        si(sink, "m"),
        creep,
    ]
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

/// What the start of the scene, tried out, says about the timestep.
fn rehearsed(model: &Model, method: &Method) -> String {
    let (law, integrator, h) = (method.contact.name, method.integrator.name, si(method.timestep, "s"));
    let start = State::new(model);
    let tried = format!("Its first seconds, tried with {law}, {integrator} and a step of {h}");
    match rehearsal::largest_timestep(model, method, &start) {
        None if !model.actuators.is_empty() => String::new(),
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
            match probe(model, &Method { contact, integrator, ..*method }, touch) {
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
    let point = touch.tutorial_spring(model, method.timestep);
    let n = touch.points as f64;
    Spring { mass: touch.mass, k: n * point.k, c: n * point.c }
}

/// What the tutorial's formula for solref would have made of the tutorial's k and c.
fn mapping(model: &Model, method: &Method, touch: &Touch) -> String {
    let spring = total_spring(model, method, touch);
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

/// The tutorial's formula for `solref` beside the right one, over damping ratios.
fn mappings(model: &Model, method: &Method, group: &[Touch]) -> String {
    let spring = total_spring(model, method, &group[0]);
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
        "The tutorial's solref is right at a damping ratio ζ of 1 only. For m = {}, k = {} ({}):\n\n{}",
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

pub fn geom_name(model: &Model, geom: usize) -> String {
    let g = &model.geoms[geom];
    if g.name.is_empty() { format!("{} {geom}", g.kind.name()) } else { g.name.clone() }
}

pub fn body_name(model: &Model, body: usize) -> String {
    let name = &model.bodies[body].name;
    if name.is_empty() { format!("body {body}") } else { name.clone() }
}
