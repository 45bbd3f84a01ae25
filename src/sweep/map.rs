//! Stability maps: what becomes of a scene over two of its quantities, and the limit that theory predicts.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::Case;
use super::theory::{self, Spring};
use crate::data::Data;
use crate::dynamics::energy;
use crate::forward::{Method, step};
use crate::model::Model;
use crate::state::State;

/// What becomes of a run, from harmless to bad. The criteria are in [`classify`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    Stable,
    Rattling,
    Gaining,
    Diverging,
}

impl Class {
    pub const ALL: [Class; 4] = [Class::Stable, Class::Rattling, Class::Gaining, Class::Diverging];

    pub fn name(self) -> &'static str {
        ["stable", "rattling", "energy-gaining", "diverging"][self as usize]
    }

    /// The criterion, in words.
    pub fn criterion(self) -> &'static str {
        [
            "none of the others",
            "the velocity reverses in more than a quarter of the steps, and motion goes on",
            "more energy in the last quarter than in the first, by over 1 % of the kinetic energy",
            "the run ends with the divergence report, or with 1000 times the energy",
        ][self as usize]
    }
}

/// A scene and a method, with a quantity set.
#[derive(Clone)]
pub struct Setting {
    pub case: Case,
    pub method: Method,
}

/// Something that a map can have on an axis.
pub struct Quantity {
    pub name: &'static str,
    /// With its unit.
    pub label: &'static str,
    /// Range where the command line names none: absolute, or around the scene's own value.
    pub range: Range,
    /// The scene's own value; `Err` says why the scene has none.
    pub get: fn(&Setting) -> Result<f64, &'static str>,
    pub set: fn(&mut Setting, f64),
}

#[derive(Clone, Copy)]
pub enum Range {
    Absolute(f64, f64),
    Around(f64, f64),
}

pub const QUANTITIES: &[Quantity] = &[
    Quantity {
        name: "timestep",
        label: "timestep h [s]",
        range: Range::Absolute(1e-4, 1.0),
        get: |s| Ok(s.method.timestep),
        set: |s, h| s.method.timestep = h,
    },
    Quantity {
        name: "stiffness",
        label: "stiffness k [N/m or N m/rad]",
        range: Range::Around(1e-2, 1e2),
        get: |s| Ok(stiffness(&s.case.model)?.0),
        set: |s, k| set_spring(&mut s.case.model, Some(k), None),
    },
    Quantity {
        name: "damping",
        label: "damping ratio ζ",
        range: Range::Absolute(1e-2, 1e1),
        get: |s| Ok(stiffness(&s.case.model)?.1),
        set: |s, zeta| set_spring(&mut s.case.model, None, Some(zeta)),
    },
    Quantity {
        name: "mass",
        label: "mass m [kg]",
        range: Range::Around(1e-2, 1e2),
        get: |s| mass(&s.case.model, 0).ok_or("nothing in the scene moves"),
        set: |s, m| {
            let factor = m / mass(&s.case.model, 0).unwrap_or(m);
            (0..s.case.model.trees.len()).for_each(|tree| scale_mass(&mut s.case.model, tree, factor));
        },
    },
    Quantity {
        name: "mass-ratio",
        label: "mass ratio m₂/m₁",
        range: Range::Absolute(1e-3, 1e3),
        get: |s| {
            let second = mass(&s.case.model, 1).ok_or("the scene has only one body that moves by itself")?;
            Ok(second / mass(&s.case.model, 0).unwrap_or(second))
        },
        set: |s, ratio| {
            let model = &mut s.case.model;
            if let (Some(first), Some(second)) = (mass(model, 0), mass(model, 1)) {
                scale_mass(model, 1, ratio * first / second);
            }
        },
    },
    Quantity {
        name: "speed",
        label: "speed at the start v [m/s]",
        range: Range::Absolute(1e-2, 1e3),
        get: |s| match speed(&s.case.start) {
            0.0 => Err("the scene starts at rest: give it a direction with --qvel or --key"),
            v => Ok(v),
        },
        set: |s, v| {
            let factor = v / speed(&s.case.start);
            s.case.start.qvel.iter_mut().for_each(|x| *x *= factor);
        },
    },
    Quantity {
        name: "friction",
        label: "sliding friction μ",
        range: Range::Absolute(1e-2, 1e1),
        get: |s| s.case.model.mixes.first().map(|m| m.friction[0]).ok_or("nothing in the scene can touch"),
        set: |s, mu| {
            s.case.model.mixes.iter_mut().for_each(|mix| mix.friction[..2].fill(mu));
            s.case.model.tutorial.mu = s.case.model.tutorial.mu.map(|_| mu);
        },
    },
];

/// The quantity of that name.
pub fn quantity(name: &str) -> Option<&'static Quantity> {
    QUANTITIES.iter().find(|q| q.name == name)
}

/// The fastest velocity at the start.
fn speed(start: &State) -> f64 {
    start.qvel.iter().fold(0.0, |a: f64, v| a.max(v.abs()))
}

fn mass(model: &Model, tree: usize) -> Option<f64> {
    let bodies = model.trees.get(tree)?.bodies.clone();
    Some(model.bodies[bodies].iter().map(|b| b.mass).sum())
}

/// All masses and moments of a tree times a factor, and what follows from them.
fn scale_mass(model: &mut Model, tree: usize, factor: f64) {
    let tree = &mut model.trees[tree];
    if let Some(free) = &mut tree.free {
        free.mass *= factor;
        free.inertia *= factor;
    }
    for body in &mut model.bodies[tree.bodies.clone()] {
        body.mass *= factor;
        body.inertia *= factor;
        body.invweight0 = body.invweight0.map(|x| x / factor);
    }
    for dof in &mut model.dofs[tree.dofs.clone()] {
        dof.armature *= factor;
        dof.invweight0 /= factor;
    }
}

/// Stiffness and damping ratio of the scene's springs: of its joints, or else of its contacts.
fn stiffness(model: &Model) -> Result<(f64, f64), &'static str> {
    if let Some(joint) = model.joints.iter().find(|j| j.stiffness > 0.0) {
        let zeta = theory::joint_springs(model).first().map_or(0.0, |s| s.zeta);
        return Ok((joint.stiffness, zeta));
    }
    let mix = model.mixes.first().ok_or("the scene has neither joint springs nor contacts")?;
    let [omega, zeta] = natural(&mix.solref);
    Ok((mass(model, 0).unwrap_or(1.0) * omega * omega, zeta))
}

/// ω (rad/s) and ζ of a solref, at impedance 1.
fn natural([first, second]: &[f64; 2]) -> [f64; 2] {
    if *first > 0.0 {
        return [1.0 / (first * second), *second];
    }
    let omega = (-first).sqrt();
    [omega, -second / (2.0 * omega)]
}

/// Sets the stiffness or the damping ratio of the joints' springs, or else of the contacts, and keeps the other one.
/// Contacts get solref in its direct form, which REFSAFE leaves alone.
fn set_spring(model: &mut Model, k: Option<f64>, zeta: Option<f64>) {
    let springs = theory::joint_springs(model);
    if !springs.is_empty() {
        let joints = model.joints.iter_mut().filter(|j| j.stiffness > 0.0);
        for (joint, spring) in joints.zip(&springs) {
            let dof = &mut model.dofs[joint.dofadr];
            joint.stiffness = k.unwrap_or(joint.stiffness);
            let critical = 2.0 * (joint.stiffness / dof.invweight0).sqrt();
            dof.damping = zeta.unwrap_or(spring.zeta) * critical;
        }
        return;
    }
    let m = mass(model, 0).unwrap_or(1.0);
    for mix in &mut model.mixes {
        let [omega, own] = natural(&mix.solref);
        let omega = k.map_or(omega, |k| (k / m).sqrt());
        let zeta = zeta.unwrap_or(own);
        mix.solref = [-omega * omega, -2.0 * zeta * omega];
        mix.solreffriction = mix.solref;
        model.tutorial.k = Some(m * omega * omega);
        model.tutorial.c = Some(2.0 * zeta * m * omega);
    }
}

/// Steps of a run that is classified: as many as its time needs, within these.
const STEPS: [f64; 2] = [400.0, 4_000.0];

/// Runs a setting and says what becomes of it; the criteria are those of [`Class::criterion`].
pub fn classify(setting: &Setting) -> Class {
    let Setting { case, method } = setting;
    let model = &case.model;
    let steps = (case.seconds / method.timestep).clamp(STEPS[0], STEPS[1]) as usize;
    let (mut state, mut data, mut scratch) = (case.start.clone(), Data::new(model), Data::new(model));
    let start = energy::energy(model, &state, &mut scratch);
    let total = |e: &energy::Energy| e.kinetic + e.potential;
    let mut quarters = [f64::NEG_INFINITY; 4];
    quarters[0] = total(&start);
    let (mut scale, mut late, mut reversals) = (start.kinetic.max(least(model)), 0.0f64, 0usize);
    let mut before = state.qvel.clone();
    for i in 0..steps {
        if step(model, method, &mut state, &mut data).is_err() {
            return Class::Diverging;
        }
        let e = energy::energy(model, &state, &mut scratch);
        let quarter = 4 * i / steps;
        quarters[quarter] = quarters[quarter].max(total(&e));
        if quarter < 2 {
            scale = scale.max(e.kinetic);
        } else if quarter == 3 {
            late = late.max(e.kinetic);
            reversals += usize::from(before.iter().zip(&state.qvel).map(|(a, b)| a * b).sum::<f64>() < 0.0);
        }
        if total(&e) - total(&start) > 1e3 * scale.min(start_scale(&start, model)) {
            return Class::Diverging;
        }
        before.copy_from_slice(&state.qvel);
    }
    if quarters[3] > quarters[0] + 0.01 * scale {
        Class::Gaining
    } else if reversals > steps / 16 && late > 1e-6 * scale {
        Class::Rattling
    } else {
        Class::Stable
    }
}

/// Energies below this are rounding, J.
fn least(model: &Model) -> f64 {
    let weight = crate::explain::weight(model);
    model.bodies.iter().map(|b| 1e-9 * b.mass * weight).sum::<f64>().max(1e-15)
}

fn start_scale(start: &energy::Energy, model: &Model) -> f64 {
    (start.kinetic + start.potential.abs()).max(1e6 * least(model))
}

/// Whether energy comes from nowhere.
pub fn unstable(class: Class) -> bool {
    class >= Class::Gaining
}

/// A map over two quantities.
pub struct Map {
    /// Values at the cells' centres, ascending.
    pub x: Vec<f64>,
    pub y: Vec<f64>,
    /// Row by row from low y.
    pub classes: Vec<Class>,
}

/// Classifies all cells, on all cores; `finished` is told after each.
pub fn map(setting: &Setting, axes: [&Quantity; 2], x: &[f64], y: &[f64], finished: impl Fn() + Sync) -> Map {
    let next = AtomicUsize::new(0);
    let count = x.len() * y.len();
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let worker = || {
        let mut found = Vec::new();
        loop {
            let i = next.fetch_add(1, Ordering::Relaxed);
            if i >= count {
                return found;
            }
            found.push((i, classify(&at(setting, axes, [x[i % x.len()], y[i / x.len()]]))));
            finished();
        }
    };
    let mut classes = vec![Class::Stable; count];
    std::thread::scope(|scope| {
        let handles: Vec<_> = (0..cores).map(|_| scope.spawn(worker)).collect();
        for (i, class) in handles.into_iter().filter_map(|h| h.join().ok()).flatten() {
            classes[i] = class;
        }
    });
    Map { x: x.to_vec(), y: y.to_vec(), classes }
}

/// The setting with both quantities set. Springs come last: their damping ratio depends on the mass.
pub fn at(setting: &Setting, axes: [&Quantity; 2], values: [f64; 2]) -> Setting {
    let mut own = setting.clone();
    let mut order = [(axes[0], values[0]), (axes[1], values[1])];
    order.sort_by_key(|(q, _)| ["stiffness", "damping"].contains(&q.name));
    // The damping ratio is that of the scene, also where the mass changes under its damper.
    let zeta = stiffness(&setting.case.model).map(|s| s.1);
    for (quantity, value) in order {
        (quantity.set)(&mut own, value);
    }
    if let (Ok(zeta), false) = (zeta, order.iter().any(|(q, _)| q.name == "damping"))
        && order.iter().any(|(q, _)| q.name == "stiffness")
    {
        set_spring(&mut own.case.model, None, Some(zeta));
    }
    own
}

/// Largest growth per step that theory sees in a setting: above 1 it is unstable.
pub fn predicted(setting: &Setting) -> Option<f64> {
    let springs: Vec<Spring> = theory::springs(&setting.case.model, &setting.method);
    let radius = |s: &Spring| theory::radius(setting.method.integrator.name, s, setting.method.timestep);
    springs.iter().filter_map(radius).reduce(f64::max)
}

/// Where along y, at one x, a property that holds at low y stops to hold; by bisection of the logarithm.
///
/// `None` if it holds nowhere or everywhere in the range.
pub fn boundary([low, high]: [f64; 2], holds: impl Fn(f64) -> bool) -> Option<f64> {
    let (mut good, mut bad) = (low, high);
    let upward = holds(low);
    if upward == holds(high) {
        return None;
    }
    for _ in 0..14 {
        let middle = (good * bad).sqrt();
        if holds(middle) == upward { good = middle } else { bad = middle }
    }
    Some((good * bad).sqrt())
}
