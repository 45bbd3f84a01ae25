//! `penny explain`: what a scene requires, and what its numbers mean.

use super::Failure;
use std::path::PathBuf;

use super::format::{count, short, si, table};
use super::scene::{self, MethodArgs};
use crate::collision;
use crate::contact::constants::{self, Spring};
use crate::contact::{penalty, tutorial};
use crate::explain::probe::{LARGEST, largest_timestep as probe};
use crate::explain::{Touch, touches, weight};
use crate::forward::Method;
use crate::model::{Cone, GeomKind, JointKind, Mix, Model};
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
        let exact = |t: &Touch| collision::exact(model.geoms[t.geom[0]].kind, model.geoms[t.geom[1]].kind);
        if !group.iter().all(exact) {
            eprintln!("  MuJoCo has no closed form for these shapes: its contact points may be others than Penny's");
        }
        eprint!("\n{}", timesteps(&model, &method, &args.method, &group[0]));
        eprint!("\n{}", mapping(&model, &method, &group[0]));
    }
    Ok(())
}

/// The plan of a scene in words: what moves, what can touch, what is left out.
pub fn requirements(model: &Model) -> Vec<[String; 2]> {
    let mut rows = vec![["moves".to_owned(), moves(model)], ["can touch".to_owned(), can_touch(model)]];
    let limits = model.joints.iter().filter(|j| j.range.is_some()).count();
    let dry = model.dofs.iter().filter(|d| d.frictionloss > 0.0).count();
    let also: Vec<String> = [
        (limits, "joint limit", "joint limits"),
        (dry, "joint with dry friction", "joints with dry friction"),
        (model.actuators.len(), "actuator", "actuators"),
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
    let moving = model.bodies.iter().filter(|b| b.tree.is_some()).count();
    let free = model.trees.iter().filter(|t| t.free.is_some()).count();
    let mut parts = vec![
        count(moving, "body", "bodies")
            + &format!(" with {}", count(model.nv, "degree of freedom", "degrees of freedom")),
    ];
    if free > 0 {
        parts.push(format!(
            "{} free (closed form)",
            if free == model.trees.len() { "all".into() } else { free.to_string() }
        ));
    }
    for (i, tree) in model.trees.iter().enumerate().filter(|(_, t)| t.free.is_none()) {
        let joints: Vec<&str> =
            model.joints.iter().filter(|j| tree.bodies.contains(&j.body)).map(|j| joint_kind(j.kind)).collect();
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
    let (listed, swept) = (&model.pairs.listed, &model.pairs.swept);
    if listed.is_empty() && swept.is_empty() {
        return "nothing: a step does no contact work".to_owned();
    }
    let mut parts = vec![count(listed.len(), "pair", "pairs")];
    if !swept.is_empty() {
        parts.push(format!("and {} geoms that are sorted in each step to find more", swept.len()));
    }
    let mut kinds: Vec<String> = listed.iter().map(|p| p.geom.map(|g| kind(model.geoms[g].kind)).join("–")).collect();
    kinds.sort();
    kinds.dedup();
    let condim = model.mixes.iter().map(|m| m.condim).max().unwrap_or(1);
    let friction = match condim {
        1 => "no friction",
        3 => "sliding friction",
        4 => "sliding and torsional friction",
        _ => "sliding, torsional and rolling friction",
    };
    format!("{}: {}; {friction} (condim {condim})", parts.join(" "), kinds.join(", "))
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

/// The largest stable timestep of every law and integrator, measured.
fn timesteps(model: &Model, method: &Method, asked: &MethodArgs, touch: &Touch) -> String {
    let integrators = asked.integrators();
    let mut rows = vec![vec!["largest stable timestep".to_owned()]];
    rows[0].extend(integrators.iter().map(|i| i.name.to_owned()));
    for contact in asked.laws() {
        let mut row = vec![contact.name.to_owned()];
        row.extend(integrators.iter().map(|&integrator| {
            match probe(model, &Method { contact, integrator, ..*method }, touch) {
                None => "–".to_owned(),
                Some(limit) if limit >= LARGEST => "any".to_owned(),
                Some(limit) => si(limit, "s"),
            }
        }));
        rows.push(row);
    }
    table(&rows)
}

/// What the tutorial's formula for solref would have made of the tutorial's k and c.
fn mapping(model: &Model, method: &Method, touch: &Touch) -> String {
    let point = touch.tutorial_spring(model, method.timestep);
    // All points together carry the whole mass.
    let n = touch.points as f64;
    let spring = Spring { mass: touch.mass, k: n * point.k, c: n * point.c };
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
    if g.name.is_empty() { format!("{} {geom}", kind(g.kind)) } else { g.name.clone() }
}

pub fn body_name(model: &Model, body: usize) -> String {
    let name = &model.bodies[body].name;
    if name.is_empty() { format!("body {body}") } else { name.clone() }
}

fn kind(kind: GeomKind) -> &'static str {
    match kind {
        GeomKind::Plane => "plane",
        GeomKind::Sphere => "sphere",
        GeomKind::Capsule => "capsule",
        GeomKind::Ellipsoid => "ellipsoid",
        GeomKind::Cylinder => "cylinder",
        GeomKind::Box => "box",
    }
}

fn joint_kind(kind: JointKind) -> &'static str {
    match kind {
        JointKind::Free => "free",
        JointKind::Ball => "ball",
        JointKind::Slide => "slide",
        JointKind::Hinge => "hinge",
    }
}
