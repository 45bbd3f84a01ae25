//! Stability maps: what becomes of a scene over two of its quantities, and the limit that theory predicts.

use super::theory::{self, Spring};
use super::{Case, on_all_cores};
use crate::explain::joints;
use penny::data::Data;
use penny::dynamics::energy;
use penny::forward::{Method, forward, step};
use penny::model::{Model, Parts};
use penny::state::State;

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
            "in the last quarter more energy than at the start or in the first quarter, by 1 % of what can move, \
             or hops that grow",
            "the run ends with the divergence report, or gains 1000 times what can move",
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
            change(&mut s.case.model, |m| {
                m.mixes.iter_mut().for_each(|mix| mix.friction[..2].fill(mu));
                m.tutorial.mu = m.tutorial.mu.map(|_| mu);
            });
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

/// Changes the model. The values on a map's axes are positive and finite: nothing that a model refuses.
fn change(model: &mut Model, how: impl FnOnce(&mut Parts)) {
    let changed = model.edit(how);
    debug_assert!(changed.is_ok(), "{changed:?}");
}

/// All masses and moments of a tree times a factor.
fn scale_mass(model: &mut Model, tree: usize, factor: f64) {
    change(model, |m| {
        let tree = &m.trees[tree];
        for body in &mut m.bodies[tree.bodies.clone()] {
            body.mass *= factor;
            body.inertia *= factor;
        }
        for dof in &mut m.dofs[tree.dofs.clone()] {
            dof.armature *= factor;
        }
    });
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
        return change(model, |m| {
            let joints = m.joints.iter_mut().filter(|j| j.stiffness > 0.0);
            for (joint, spring) in joints.zip(&springs) {
                let dof = &mut m.dofs[joint.dofadr];
                joint.stiffness = k.unwrap_or(joint.stiffness);
                let critical = 2.0 * (joint.stiffness / dof.invweight0).sqrt();
                dof.damping = zeta.unwrap_or(spring.zeta) * critical;
            }
        });
    }
    let mass = mass(model, 0).unwrap_or(1.0);
    change(model, |m| {
        for mix in &mut m.mixes {
            let [omega, own] = natural(&mix.solref);
            let omega = k.map_or(omega, |k| (k / mass).sqrt());
            let zeta = zeta.unwrap_or(own);
            mix.solref = [-omega * omega, -2.0 * zeta * omega];
            mix.solreffriction = mix.solref;
            m.tutorial.k = Some(mass * omega * omega);
            m.tutorial.c = Some(2.0 * zeta * mass * omega);
        }
    });
}

/// The fewest steps of a run that is classified: growth needs some to show.
pub const FEWEST: usize = 400;

/// Runs a setting for its time, or [`FEWEST`] steps where that is longer, and says what becomes of it.
///
///     P = T₀ + V₀ + S₀ + max (U₀ − U)   what can move: motion, joint springs, contacts at the start, and what fell
///
///     diverging         a step fails, or  E − E₀ > 1000 P
///     energy-gaining    min E > E₀ + S₀ + 0.01 P      in the last quarter, while nothing touches
///                  or   max E > max E of the first quarter + 0.01 max(P, T of the first half)     in the last quarter
///                  or   max E > min E of the third quarter + 0.1 T of the second half   in the last quarter, both
///                       while nothing touches, if something touches in between: a hop higher than one before it
///     rattling          v · v′ < 0 from one step to the next in over a quarter of the last quarter's steps, and
///                       max T > 1e-6 P there
///     stable            none of these
///
/// E = T + U is the energy of motion, weight and joint springs, J. What contacts store is not in it: so E is looked at
/// while nothing touches. V₀ is the joint springs' part of U₀, and S₀ = Σ ½ F d what the contacts store at the start,
/// by their forces and depths.
///
/// What starts in equilibrium, where even an unstable integrator stays, is nudged by [`NUDGE`].
pub fn classify(setting: &Setting) -> Class {
    let Setting { case, method } = setting;
    let model = &case.model;
    let steps = ((case.seconds / method.timestep).ceil() as usize).max(FEWEST);
    let (mut state, mut data, mut scratch) = (case.start.clone(), Data::new(model), Data::new(model));
    forward(model, method, &state, &mut scratch);
    let stored: f64 = scratch.contacts.iter().map(|c| 0.5 * c.force[0] * (-c.dist).max(0.0)).sum();
    let calm = 1e-6 * crate::explain::weight(model).max(1.0);
    if state.qvel.iter().all(|v| *v == 0.0) && scratch.qacc.iter().all(|a| a.abs() < calm) {
        state.qvel.fill(NUDGE);
    }

    let mut weightless = model.clone();
    change(&mut weightless, |m| m.opt.flags.gravity = false);
    let springs = energy::energy(&weightless, &state, &mut scratch).potential;
    let start = energy::energy(model, &state, &mut scratch);
    let driven = joints::actuator_potential(model, &state);
    let first = start.kinetic + start.potential + stored;
    let at_hand = start.kinetic + springs + stored + least(model, method.timestep);
    let mut fallen = 0.0f64;
    let mut quarters = [Quarter::default(); 4];
    quarters[0].highest = first;
    let (mut reversals, mut touched) = (0, false);
    let mut before = state.qvel.clone();
    for i in 0..steps {
        let mut e = energy::energy(model, &state, &mut scratch);
        // Actuators hold their controls: what they do is a potential.
        e.potential += joints::actuator_potential(model, &state) - driven;
        fallen = fallen.max(start.potential - e.potential);
        if step(model, method, &mut state, &mut data).is_err()
            || e.kinetic + e.potential - first > 1e3 * (at_hand + fallen)
        {
            return Class::Diverging;
        }
        let touches = data.contacts.iter().any(|c| c.force[0] > 0.0);
        // An integrator leaves the contacts of its first or of its last look at a step.
        quarters[4 * i / steps].push(&e, touches || touched);
        touched = touches;
        let reverses = before.iter().zip(&state.qvel).map(|(a, b)| a * b).sum::<f64>() < 0.0;
        reversals += usize::from(reverses && 4 * i / steps == 3);
        before.copy_from_slice(&state.qvel);
    }

    let [early, _, third, last] = quarters;
    let movable = at_hand + fallen;
    let fastest = |quarters: &[Quarter]| quarters.iter().map(|q| q.kinetic).fold(0.0, f64::max);
    let lowest = if last.free[0].is_finite() { last.free[0] } else { last.lowest };
    let hop = last.free[1] - third.free[0];
    let hops = third.touched || last.touched;
    let gains = lowest > first + 0.01 * movable
        || last.highest > early.highest + 0.01 * movable.max(fastest(&quarters[..2]))
        || hops && hop > (0.1 * fastest(&quarters[2..])).max(1e-6 * movable);
    if gains && joints::have_potential(model) {
        Class::Gaining
    } else if reversals > steps / 16 && last.kinetic > 1e-6 * movable {
        Class::Rattling
    } else {
        Class::Stable
    }
}

/// Velocity that disturbs an equilibrium, m/s or rad/s.
const NUDGE: f64 = 1e-3;

/// Energies of a quarter of a run, J.
#[derive(Clone, Copy)]
struct Quarter {
    lowest: f64,
    highest: f64,
    /// Lowest and highest while nothing touches.
    free: [f64; 2],
    /// Highest of motion.
    kinetic: f64,
    touched: bool,
}

impl Default for Quarter {
    fn default() -> Quarter {
        let (low, high) = (f64::INFINITY, f64::NEG_INFINITY);
        Quarter { lowest: low, highest: high, free: [low, high], kinetic: 0.0, touched: false }
    }
}

impl Quarter {
    fn push(&mut self, energy: &energy::Energy, touches: bool) {
        let total = energy.kinetic + energy.potential;
        (self.lowest, self.highest) = (self.lowest.min(total), self.highest.max(total));
        if !touches {
            self.free = [self.free[0].min(total), self.free[1].max(total)];
        }
        self.kinetic = self.kinetic.max(energy.kinetic);
        self.touched |= touches;
    }
}

/// Energies below this are rounding, or what gravity does within a step, J.
fn least(model: &Model, timestep: f64) -> f64 {
    let weight = crate::explain::weight(model);
    let within = 1e-9 * weight + 0.5 * (weight * timestep).powi(2);
    model.bodies.iter().map(|b| b.mass * within).sum::<f64>().max(1e-15)
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
    let classes = on_all_cores(x.len() * y.len(), |i| {
        let class = classify(&at(setting, axes, [x[i % x.len()], y[i / x.len()]]));
        finished();
        class
    });
    Map { x: x.to_vec(), y: y.to_vec(), classes }
}

/// Whether a scene in which things can touch runs for its time without that they do.
pub fn touches_nothing(setting: &Setting) -> bool {
    let Setting { case, method } = setting;
    if case.model.requires.pairs + case.model.requires.swept == 0 {
        return false;
    }
    let (mut state, mut data) = (case.start.clone(), Data::new(&case.model));
    (0..(case.seconds / method.timestep).ceil() as usize)
        .all(|_| step(&case.model, method, &mut state, &mut data).is_ok() && data.contacts.is_empty())
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
    let radius = |s: &Spring| theory::radius(setting.method.integrator, s, setting.method.timestep);
    springs.iter().filter_map(radius).reduce(f64::max)
}

/// Where a property that holds at one end of a range first changes, from `low` on: by equal ratios, then by bisection.
///
/// `None` if it never changes.
pub fn boundary([low, high]: [f64; 2], holds: impl Fn(f64) -> bool) -> Option<f64> {
    let start = holds(low);
    let at = |i: usize| low * (high / low).powf(i as f64 / SCAN as f64);
    let i = (1..=SCAN).find(|&i| holds(at(i)) != start)?;
    Some(bisect(at(i - 1), at(i), |y| holds(y) == start))
}

/// Places that [`boundary`] looks at first: beyond the first change a property may come back.
const SCAN: usize = 48;

/// Where a property that holds at `good` and not at `bad` ends, to 1 part in 1000 of their ratio.
fn bisect(mut good: f64, mut bad: f64, holds: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..10 {
        let middle = (good * bad).sqrt();
        if holds(middle) { good = middle } else { bad = middle }
    }
    (good * bad).sqrt()
}

/// The limit at one value of the other quantity: by theory and as measured.
pub struct Limit {
    pub at: f64,
    pub theory: Option<f64>,
    pub measured: Option<f64>,
}

/// Rows or columns of a map at which limits are looked for, about.
const PROBES: usize = 12;

/// Limits along one axis (0 or 1) of a map: where theory's growth begins, and where the map's runs start to gain
/// energy, seen from its stable end and refined by bisection between two cells.
pub fn limits(setting: &Setting, axes: [&Quantity; 2], map: &Map, along: usize) -> Vec<Limit> {
    let (values, others) = if along == 0 { (&map.x, &map.y) } else { (&map.y, &map.x) };
    let span = [values[0], values[values.len() - 1]];
    let limit = |i: usize| {
        let set = |value: f64| {
            let mut pair = [others[i]; 2];
            pair[along] = value;
            at(setting, axes, pair)
        };
        let calm = |value: f64| predicted(&set(value)).is_none_or(|r| r <= theory::GROWS);
        let class = |j: usize| map.classes[if along == 0 { i * map.x.len() + j } else { j * map.x.len() + i }];
        let end = values.len() - 1;
        let order: Vec<usize> = if unstable(class(0)) { (0..=end).rev().collect() } else { (0..=end).collect() };
        let first = order.iter().position(|&j| unstable(class(j))).filter(|&n| n > 0);
        let measured =
            first.map(|n| bisect(values[order[n - 1]], values[order[n]], |value| !unstable(classify(&set(value)))));
        Limit { at: others[i], theory: boundary(span, calm), measured }
    };
    (0..others.len()).step_by(others.len().div_ceil(PROBES)).map(limit).collect()
}
