//! A scene on one screen: a line for each kind of contact, joint, limit and actuator, and the one number that limits most.

use super::{largest, names, origin};
use crate::format::{count, short, si, table};
use penny::forward::Method;
use penny::model::{JointKind, Model};
use penny::state::State;
use penny_lab::explain::joints::{self, Coordinate};
use penny_lab::explain::loads::Loads;
use penny_lab::explain::ties;
use penny_lab::explain::{self, Budget, Touch, probe};
use penny_lab::names;
use penny_lab::sweep::theory;

/// Lines of a kind without `--all`; where there are more, the first few.
const LINES: usize = 8;
const FEW: usize = 5;
/// A contact that goes deeper than this part of the smaller shape is told as a limit of the scene.
const DEEP: f64 = 0.05;
/// A margin beyond this is no limit.
const FAR: f64 = 20.0;
/// Masses in contact whose ratio is told.
const RATIO: f64 = 100.0;

/// What limits a scene, each with how much: below 1 it does not work.
#[derive(Default)]
pub struct Limits {
    found: Vec<(f64, String)>,
}

impl Limits {
    fn add(&mut self, margin: f64, text: String) {
        self.found.push((margin, text));
    }

    /// Adds the largest stable timesteps of springs and limits of joints and tendons, by theory.
    pub fn add_springs(&mut self, model: &Model, method: &Method) {
        let (h, integrator) = (method.timestep, method.integrator);
        let other =
            super::stable_by_theory(model, method).map_or_else(String::new, |name| format!(" or --integrator {name}"));
        for (name, limit) in theory::limits(model, integrator).into_iter().filter(|(_, limit)| limit.is_finite()) {
            let cure = if limit < h { format!(": --timestep {:.0e}{other}", 0.5 * limit) } else { String::new() };
            self.add(
                limit / h,
                format!(
                    "{name}: stable up to a timestep of {} with {}, {} times this one ({}){cure}",
                    si(limit, "s"),
                    integrator.name,
                    short(limit / h),
                    si(h, "s")
                ),
            );
        }
    }

    /// Adds a start that gains energy beyond a timestep of `limit` (s), as trial runs found.
    pub fn add_start(&mut self, method: &Method, limit: f64) {
        let (h, integrator) = (method.timestep, method.integrator.name);
        let smaller = if limit > 0.0 {
            format!("; with {} it does not", si(limit, "s"))
        } else {
            " and with each smaller one tried".to_owned()
        };
        self.add(
            limit / h,
            format!("its start: it gains energy with {integrator} at this timestep ({}){smaller}", si(h, "s")),
        );
    }

    /// The one that limits most; that there is none, if there is none and all was tried.
    pub fn text(&self, all_tried: bool) -> String {
        let Some((margin, text)) = self.found.iter().min_by(|a, b| a.0.total_cmp(&b.0)) else {
            if !all_tried {
                return String::new();
            }
            return "\nNothing limits this scene: no spring or servo is stiff for its timestep, and no load goes deep.\n".to_owned();
        };
        let heading = if *margin > FAR {
            "Nothing limits this scene; the nearest limit is"
        } else {
            "What limits this scene most"
        };
        format!("\n{heading}\n  {text}\n")
    }

    /// Whether something is beyond its limit.
    pub fn broken(&self) -> bool {
        self.found.iter().any(|(margin, _)| *margin < 1.0)
    }
}

/// The largest stable timestep in a cell.
fn stable(limit: Option<f64>) -> String {
    match limit {
        None => "not tried".to_owned(),
        Some(0.0) => "none".to_owned(),
        Some(h) if h >= probe::LARGEST => "any step".to_owned(),
        Some(h) => si(h, "s"),
    }
}

/// Contacts, a line for each kind, the stiffest first.
pub fn contacts(
    model: &Model,
    method: &Method,
    groups: &[Vec<Touch>],
    loads: &Loads,
    all: bool,
    budget: &Budget,
    limits: &mut Limits,
) -> String {
    let heading = ["contact", "k", "c", "ω", "ζ", "restitution", "load", "depth", "stable up to"];
    let mut rows = vec![heading.map(str::to_owned).to_vec()];
    let mut origins = Vec::new();
    let sorted = largest::stiffest_first(model, method, groups);
    let shown = if all { sorted.len() } else { LINES };
    for group in sorted.iter().take(shown) {
        let [cells, origin] = line(model, method, group, loads, budget, limits);
        rows.push(cells);
        origins.extend(origin);
    }
    let mut text = format!(
        "\nContacts under {}: {} in {}\n{}",
        method.contact.name,
        count(groups.iter().map(Vec::len).sum(), "pair", "pairs"),
        count(groups.len(), "kind", "kinds"),
        table(&rows)
    );
    if sorted.len() > shown {
        text += &format!("  and {} more, less stiff: --all\n", sorted.len() - shown);
    }
    if loads.seconds > 0.0 {
        text += &format!("  load: once the scene has settled, after {} of simulated time\n", si(loads.seconds, "s"));
    }
    for origin in origins.iter().take(if all { origins.len() } else { 3 }) {
        text += &format!("  {origin}\n");
    }
    text
}

/// What a kind of contact adds to the limits of the scene.
pub fn limits_of(model: &Model, method: &Method, group: &[Touch], loads: &Loads, budget: &Budget, limits: &mut Limits) {
    line(model, method, group, loads, budget, limits);
}

fn line(
    model: &Model,
    method: &Method,
    group: &[Touch],
    loads: &Loads,
    budget: &Budget,
    limits: &mut Limits,
) -> [Vec<String>; 2] {
    let name = names(model, group);
    let touch = group.iter().max_by(|a, b| loads.of(a.geom).total_cmp(&loads.of(b.geom))).unwrap_or(&group[0]);
    let ask = penny::contact::describe::Ask { model, touch, timestep: method.timestep, slope: 0.0 };
    let formulas = (method.contact.describe)(&ask);
    let spring = formulas.springs.map(|[rest, _]| rest);
    let cell = |x: Option<String>| x.unwrap_or_else(|| "–".to_owned());
    let load = loads.of(touch.geom);
    let depth = if load > 0.0 { explain::depth_under(model, method, touch, load) } else { None };
    let limit = if budget.left() { probe::largest_timestep(model, method, touch) } else { None };
    let h = method.timestep;
    let (solref, softer) = (model.mixes[touch.mix].solref, softer(model, method, touch));
    if let Some(limit) = limit.filter(|limit| *limit < probe::LARGEST) {
        limits.add(
            limit / h,
            format!(
                "the stiffness of {name}: stable up to a timestep of {}, {} times this one ({}){}",
                si(limit, "s"),
                short(limit / h),
                si(h, "s"),
                softer.map_or_else(String::new, |what| format!("; {what} in solref makes it softer"))
            ),
        );
    }
    let radii = touch.geom.iter().map(|&g| model.geoms[g].rbound).filter(|r| *r > 0.0);
    let size = radii.fold(f64::INFINITY, f64::min);
    let masses = touch.geom.map(|g| model.bodies[model.bodies[model.geoms[g].body].weld].mass);
    let lighter = masses.into_iter().filter(|m| *m > 0.0).fold(touch.mass, f64::min);
    let ratio = load / (lighter * explain::weight(model));
    if let Some(depth) = depth.filter(|depth| *depth > DEEP * size) {
        // Without gravity the load is no weight.
        let why = if ratio > RATIO && ratio.is_finite() {
            format!(" (mass ratio {} : 1; stiffness follows the lighter one)", short(ratio))
        } else {
            String::new()
        };
        let cure = if solref[0] > 0.0 && softer.is_some() {
            format!("; --solref \"{} {}\" makes it a tenth", short(solref[0] / 10f64.sqrt()), short(solref[1]))
        } else {
            String::new()
        };
        limits.add(
            0.1 * DEEP * size / depth,
            format!("the depth of {name}: {} under its load of {}{why}{cure}", si(depth, "m"), si(load, "N")),
        );
    }
    // Without stiffness there is no damping ratio, no restitution and no depth at rest.
    let known = |x: &f64| x.is_finite();
    let cells = vec![
        name.clone(),
        cell(spring.map(|s| si(s.k, "N/m"))),
        cell(spring.map(|s| si(s.c, "N s/m"))),
        cell(spring.map(|s| si(s.omega(), "rad/s"))),
        cell(spring.map(|s| s.zeta()).filter(known).map(short)),
        cell(formulas.restitution.filter(known).map(short)),
        if load > 0.0 { si(load, "N") } else { "none".to_owned() },
        cell(depth.filter(known).map(|d| si(d, "m"))),
        stable(limit),
    ];
    [cells, origin(model, touch).map(|origin| format!("{name}: {origin}")).into_iter().collect()]
}

/// What in `solref` makes a contact softer; `None` where the law does not take its spring from there.
fn softer(model: &Model, method: &Method, touch: &Touch) -> Option<&'static str> {
    let timeconst = model.mixes[touch.mix].solref[0] > 0.0;
    let mut other = model.clone();
    // Far beyond what REFSAFE makes of it.
    other.edit(|m| m.mixes[touch.mix].solref[0] *= if timeconst { 100.0 } else { 0.01 }).ok()?;
    let stiffness = |model: &Model| {
        let ask = penny::contact::describe::Ask { model, touch, timestep: method.timestep, slope: 0.0 };
        (method.contact.describe)(&ask).springs.map(|[rest, _]| rest.k)
    };
    let what = if timeconst { "a larger timeconst" } else { "a smaller stiffness" };
    (stiffness(&other) < stiffness(model)).then_some(what)
}

/// Springs, dampers and limits of tendons, and equalities: a line each.
pub fn ties(model: &Model, method: &Method, start: &State, all: bool) -> String {
    let row = |tie: ties::Tie| {
        let [mass, k, c] = if tie.turns { ["kg m²", "N m/rad", "N m s/rad"] } else { ["kg", "N/m", "N s/m"] };
        let (spring, some) = (&tie.spring, |text: String, is: bool| if is { text } else { NONE.to_owned() });
        let swings = spring.k > 0.0;
        let [omega, zeta] = [si(spring.omega(), "rad/s"), short(spring.zeta())].map(|text| some(text, swings));
        let [k, c] = [some(si(spring.k, k), swings), some(si(spring.c, c), spring.c > 0.0)];
        vec![tie.name, si(spring.mass, mass), k, c, omega, zeta]
    };
    let rows = ties::ties(model, method, start).into_iter().map(row).collect();
    let title = "Tendons and equalities (moves: the mass that MuJoCo takes for what they hold)";
    section(title, &["", "moves", "k", "c", "ω", "ζ"], rows, all)
}

/// Joints with springs, dampers or servos, their limits, and the actuators.
pub fn joints(model: &Model, method: &Method, start: &State, all: bool, limits: &mut Limits) -> String {
    let weights = joints::weights(model, method, start);
    let list: Vec<Coordinate> = (0..model.joints.len()).filter_map(|j| joints::coordinate(model, j)).collect();
    let springs = theory::joint_springs(model);
    let page = JointPage { model, method, weights: &weights, list: &list, springs: &springs, all };
    [page.held(), page.limited(limits), page.driven()].concat()
}

/// What is told of the slides and hinges of a scene.
struct JointPage<'a> {
    model: &'a Model,
    method: &'a Method,
    /// The force that weight puts on each dof at the start, N or N m (nv).
    weights: &'a [f64],
    list: &'a [Coordinate],
    /// Springs and dampers of joints, as theory sees them.
    springs: &'a [theory::Spring],
    /// Every line, not the first few of each table.
    all: bool,
}

impl JointPage<'_> {
    /// Joints: what holds them where.
    fn held(&self) -> String {
        let row = |c: &Coordinate| {
            let [mass, k, damping, place, force] = self.units(c);
            let joint = &self.model.joints[c.joint];
            let [omega, zeta] = frequency(c);
            vec![
                names::joint(self.model, c.joint),
                si(c.mass, mass),
                if c.stiffness() > 0.0 { si(c.stiffness(), k) } else { NONE.to_owned() },
                if c.damping() != 0.0 { si(c.damping(), damping) } else { NONE.to_owned() },
                omega,
                zeta,
                if c.joint_stiffness > 0.0 { si(joint.springref, place) } else { NONE.to_owned() },
                si(self.weight(c), force),
            ]
        };
        let rows: Vec<Vec<String>> = self.list.iter().map(row).collect();
        let rows = if self.all { rows } else { grouped(rows, 1) };
        let heading = ["joint", "moves", "k", "c", "ω", "ζ", "spring at rest", "weight"];
        section("Joints (weight: its force on the joint at the start)", &heading, rows, self.all)
    }

    /// Limits: how far beyond them a joint goes. Those that are alike together, by the one that is pushed farthest.
    fn limited(&self, limits: &mut Limits) -> String {
        struct Limit {
            names: Vec<String>,
            range: String,
            omega: f64,
            zeta: f64,
            depth: f64,
            cells: Vec<String>,
        }
        let (model, h) = (self.model, self.method.timestep);
        let mut alike: Vec<Limit> = Vec::new();
        for c in self.list {
            let [_, k, damping, place, force_unit] = self.units(c);
            let joint = &model.joints[c.joint];
            let (Some([low, high]), Some(spring)) = (joint.range, joints::limit_spring(model, c.joint, h)) else {
                continue;
            };
            let (force, whose) = strongest(model, c, self.weights[joint.dofadr]);
            let depth = joints::limit_depth(model, c.joint, force, h);
            let name = names::joint(model, c.joint);
            if depth > DEEP * (high - low) {
                limits.add(
                    0.1 * DEEP * (high - low) / depth,
                    format!(
                        "the limit of {name}: {whose} pushes {} beyond it; a smaller timeconst in solreflimit stiffens it",
                        si(depth, place)
                    ),
                );
            }
            let range = format!("{} to {} {place}", short(low), short(high));
            let (omega, zeta) = (spring.omega(), spring.zeta());
            let beyond =
                if force < 1e-9 { "nothing".to_owned() } else { format!("{} of {whose}", si(force, force_unit)) };
            let cells = vec![
                si(spring.k, k),
                si(spring.c, damping),
                si(omega, "rad/s"),
                short(zeta),
                beyond,
                if force < 1e-9 { NONE.to_owned() } else { si(depth, place) },
            ];
            let close = |a: f64, b: f64| (a - b).abs() <= 1e-6 * b;
            let same = |l: &&mut Limit| !self.all && l.range == range && close(l.omega, omega) && close(l.zeta, zeta);
            match alike.iter_mut().find(same) {
                Some(limit) if depth > limit.depth => {
                    limit.names.insert(0, name);
                    (limit.depth, limit.cells) = (depth, cells);
                }
                Some(limit) => limit.names.push(name),
                None => alike.push(Limit { names: vec![name], range, omega, zeta, depth, cells }),
            }
        }
        let row = |limit: Limit| {
            let name = match &limit.names[..] {
                [first, rest @ ..] if !rest.is_empty() => format!("{first} ({} more alike)", rest.len()),
                names => names.concat(),
            };
            [vec![name, limit.range], limit.cells].concat()
        };
        let heading = ["limit of", "range", "k", "c", "ω", "ζ", "pressed by", "goes beyond by"];
        section("Limits of joints", &heading, alike.into_iter().map(row).collect(), self.all)
    }

    /// Actuators as servos.
    fn driven(&self) -> String {
        let mut rows = Vec::new();
        for c in self.list.iter().filter(|c| !c.servos.is_empty()) {
            let [_, k, damping, place, _] = self.units(c);
            let [omega, zeta] = frequency(c);
            let name = c.name(self.model);
            let spring = self.springs.iter().find(|s| s.name == name);
            let limit = spring.and_then(|s| theory::limit(self.method.integrator, s));
            for s in &c.servos {
                let servo = s.stiffness > 0.0;
                rows.push(vec![
                    names::actuator(self.model, s.actuator),
                    names::joint(self.model, c.joint),
                    if servo { si(s.stiffness, k) } else { NONE.to_owned() },
                    if s.damping > 0.0 { si(s.damping, damping) } else { NONE.to_owned() },
                    if servo { omega.clone() } else { NONE.to_owned() },
                    if servo { zeta.clone() } else { NONE.to_owned() },
                    if servo { si(self.weight(c).abs() / c.stiffness(), place) } else { NONE.to_owned() },
                    limit.filter(|limit| limit.is_finite()).map_or("any step".to_owned(), |limit| si(limit, "s")),
                ]);
            }
        }
        let rows = if self.all { rows } else { grouped(rows, 2) };
        let heading = ["actuator", "on", "kp", "kv", "ω", "ζ", "sag under the weight", "stable up to"];
        section("Actuators (kp, kv with their gear, on the joint)", &heading, rows, self.all)
    }

    /// Units of mass, stiffness, damping, position and force.
    fn units(&self, c: &Coordinate) -> [&'static str; 5] {
        let hinge = self.model.joints[c.joint].kind == JointKind::Hinge;
        if hinge { ["kg m²", "N m/rad", "N m s/rad", "rad", "N m"] } else { ["kg", "N/m", "N s/m", "m", "N"] }
    }

    /// The force of weight on a joint at the start, N or N m.
    fn weight(&self, c: &Coordinate) -> f64 {
        clean(self.weights[self.model.joints[c.joint].dofadr])
    }
}

/// A table of the first few rows, or of all; empty without rows.
fn section(title: &str, heading: &[&str], rows: Vec<Vec<String>>, all: bool) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let shown = if all || rows.len() <= LINES { rows.len() } else { FEW };
    let more = rows.len() - shown;
    let heading = heading.iter().map(|&cell| cell.to_owned()).collect();
    let lines: Vec<_> = std::iter::once(heading).chain(rows.into_iter().take(shown)).collect();
    let more = if more > 0 { format!("  and {more} more: --all\n") } else { String::new() };
    format!("\n{title}\n{}{more}", table(&lines))
}

/// A cell for what is not there.
const NONE: &str = "–";

/// ω and ζ of what holds a joint, as cells.
fn frequency(c: &Coordinate) -> [String; 2] {
    if c.stiffness() > 0.0 { [si(c.omega(), "rad/s"), short(c.zeta())] } else { [NONE, NONE].map(str::to_owned) }
}

/// Rows that say the same from a column on, together: "hip0 (5 more alike)".
fn grouped(rows: Vec<Vec<String>>, from: usize) -> Vec<Vec<String>> {
    let mut groups: Vec<(Vec<String>, usize)> = Vec::new();
    for row in rows {
        match groups.iter_mut().find(|(first, _)| first[from..] == row[from..]) {
            Some((_, more)) => *more += 1,
            None => groups.push((row, 0)),
        }
    }
    let named = |(mut row, more): (Vec<String>, usize)| {
        if more > 0 {
            row[0] += &format!(" ({more} more alike)");
        }
        row
    };
    groups.into_iter().map(named).collect()
}

/// Zero where there is but rounding.
fn clean(x: f64) -> f64 {
    if x.abs() < 1e-12 { 0.0 } else { x }
}

/// The largest force that presses a joint against its limit, N or N m, and whose it is: an actuator's at the end of its
/// range, or the weight's.
fn strongest(model: &Model, c: &Coordinate, weight: f64) -> (f64, String) {
    let joint = &model.joints[c.joint];
    let [low, high] = joint.range.unwrap_or_default();
    let mut found = (weight.abs(), "the weight".to_owned());
    for i in c.servos.iter().map(|s| s.actuator) {
        let a = &model.actuators[i];
        let (gear, [ctrl_low, ctrl_high]) = (a.gear[0], a.ctrlrange.unwrap_or([0.0; 2]));
        for (ctrl, end) in [(ctrl_low, low), (ctrl_high, high), (ctrl_low, high), (ctrl_high, low)] {
            let mut force = a.gain[0] * ctrl + a.bias[0] + a.bias[1] * gear * end;
            if let Some([least, most]) = a.forcerange {
                force = force.clamp(least, most);
            }
            // Outwards only.
            let outward = if end == high { gear * force } else { -gear * force };
            if outward > found.0 {
                found = (outward, names::actuator(model, i));
            }
        }
    }
    found
}
