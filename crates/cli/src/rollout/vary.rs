//! What can differ from world to world: `qvel[0]=1..3`.

use super::{bodies, named};
use crate::format::{short, si};
use crate::scene::MOST_STEPS;
use penny::Simulation;
use penny::model::{Joint, Model};
use penny_lab::names;
use penny_view::random;

/// A number and its range.
#[derive(Clone, Debug)]
pub struct Vary {
    pub name: String,
    pub range: [f64; 2],
}

/// `NAME=A..B`
pub fn parse(text: &str) -> Result<Vary, String> {
    let (name, range) = text.split_once('=').ok_or("must be NAME=A..B, such as qvel[0]=1..3")?;
    let (a, b) = range.split_once("..").ok_or("must be a range A..B, such as 1..3")?;
    let number = |text: &str| match text.trim().parse::<f64>() {
        Ok(x) if x.is_finite() => Ok(x),
        _ => Err(format!("`{text}` is not a finite number")),
    };
    let range = [number(a)?, number(b)?];
    if range[0] > range[1] {
        return Err(format!("{a} is above {b}: the smaller number comes first"));
    }
    if !(range[1] - range[0]).is_finite() {
        return Err(format!("{a} and {b} are too far apart: their difference is not finite"));
    }
    Ok(Vary { name: name.trim().to_owned(), range })
}

/// Where a number goes in a world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Slot {
    Qpos(usize),
    Qvel(usize),
    Ctrl(usize),
    /// Of one geom, or of all.
    Friction(Option<usize>),
    Solref(Option<usize>),
    Mass(usize),
    Gravity(usize),
    Timestep,
}

impl Slot {
    /// Errors: there is no such number; the message says which there are.
    pub fn find(text: &str, model: &Model) -> Result<Slot, String> {
        let (kind, key) = match text.split_once('[') {
            Some((kind, rest)) => {
                let key = rest.strip_suffix(']').ok_or_else(|| format!("`{text}` lacks its `]`"))?;
                (kind, Some(key))
            }
            None => (text, None),
        };
        let needed = |what: &str| key.ok_or_else(|| format!("`{kind}` needs {what} in brackets, such as {kind}[0]"));
        let entry = |what: &str, len: usize, name: &dyn Fn(usize) -> String, has: String| {
            let key = needed(what)?;
            let by_index = || key.parse().ok().filter(|i| *i < len);
            let found = (0..len).find(|&i| name(i) == key && !key.is_empty()).or_else(by_index);
            found.ok_or_else(|| format!("`{text}`: the scene has no {what} `{key}`; {has}"))
        };
        let geom = |_: &str| {
            let name = |i: usize| model.geoms[i].name.clone();
            let has = || named((0..model.geoms.len()).map(|g| names::geom(model, g)));
            key.map(|_| entry("geom", model.geoms.len(), &name, has())).transpose()
        };
        match kind {
            "qpos" => coordinate(text, needed("a number or joint")?, model, true).map(Slot::Qpos),
            "qvel" => coordinate(text, needed("a number or joint")?, model, false).map(Slot::Qvel),
            "ctrl" => {
                let name = |i: usize| model.actuators[i].name.clone();
                let has = named((0..model.actuators.len()).map(|a| names::actuator(model, a)));
                entry("actuator", model.actuators.len(), &name, has).map(Slot::Ctrl)
            }
            "friction" => geom("friction").map(Slot::Friction),
            "solref" => geom("solref").map(Slot::Solref),
            "mass" => {
                let name = |i: usize| model.bodies[i].name.clone();
                match entry("body", model.bodies.len(), &name, bodies(model))? {
                    0 => Err(format!("`{text}`: the world does not move, whatever its mass: name another body")),
                    body => Ok(Slot::Mass(body)),
                }
            }
            "gravity" => match needed("an axis")? {
                "x" | "0" => Ok(Slot::Gravity(0)),
                "y" | "1" => Ok(Slot::Gravity(1)),
                "z" | "2" => Ok(Slot::Gravity(2)),
                other => Err(format!("`{text}`: gravity has x, y and z, no `{other}`")),
            },
            "timestep" if key.is_none() => Ok(Slot::Timestep),
            _ => Err(format!(
                "`{text}` cannot be varied; what can: qpos[…], qvel[…], ctrl[…], friction[…], solref[…], mass[…], \
                 gravity[…], timestep"
            )),
        }
    }

    /// Whether two slots have a number in common.
    pub fn overlaps(self, other: Slot) -> bool {
        match (self, other) {
            (Slot::Friction(a), Slot::Friction(b)) | (Slot::Solref(a), Slot::Solref(b)) => {
                a.is_none() || b.is_none() || a == b
            }
            _ => self == other,
        }
    }

    /// Errors: the number means nothing there, in a world that runs for a time (s); the message says why.
    pub fn check(self, model: &Model, x: f64, seconds: f64) -> Result<(), String> {
        match self {
            Slot::Friction(_) if x < 0.0 => Err("friction is 0 or more".to_owned()),
            Slot::Solref(geom) => match geoms(geom, model).find(|&g| (x > 0.0) != (model.geoms[g].solref[1] > 0.0)) {
                Some(g) if x > 0.0 => Err(format!(
                    "{} has solref as (-stiffness, -damping), so the first number is at most 0",
                    names::geom(model, g)
                )),
                Some(_) => Err("the time constant of solref must be above 0".to_owned()),
                None => Ok(()),
            },
            Slot::Mass(body) if x <= 0.0 && model.bodies[body].tree.is_some() => {
                Err("the mass of a body that moves must be above 0".to_owned())
            }
            Slot::Timestep if x <= 0.0 => Err("a timestep must be above 0".to_owned()),
            Slot::Timestep if seconds > 0.0 && (seconds / x).round() < 1.0 => {
                Err(format!("{} is too short for such a step: give a longer --time", si(seconds, "s")))
            }
            Slot::Timestep if seconds / x > MOST_STEPS as f64 => Err(format!(
                "{} would take {} steps; the most is {}",
                si(seconds, "s"),
                short(seconds / x),
                short(MOST_STEPS as f64)
            )),
            _ => Ok(()),
        }
    }

    /// Errors: the scene cannot have that number; the message says why.
    pub fn set(self, sim: &mut Simulation, x: f64) -> Result<(), String> {
        let text = |e: &dyn std::fmt::Display| e.to_string();
        match self {
            Slot::Qpos(i) => sim.state_mut().qpos[i] = x,
            Slot::Qvel(i) => sim.state_mut().qvel[i] = x,
            Slot::Ctrl(i) => sim.state_mut().ctrl[i] = x,
            Slot::Friction(geom) => {
                for g in geoms(geom, sim.model()) {
                    let [_, spin, roll] = sim.model().geoms[g].friction;
                    sim.set_friction(g, [x, spin, roll]).map_err(|e| text(&e))?;
                }
            }
            Slot::Solref(geom) => {
                for g in geoms(geom, sim.model()) {
                    let [_, ratio] = sim.model().geoms[g].solref;
                    sim.set_solref(g, [x, ratio]).map_err(|e| text(&e))?;
                }
            }
            Slot::Mass(body) => sim.set_mass(body, x).map_err(|e| text(&e))?,
            Slot::Gravity(axis) => {
                let mut gravity: [f64; 3] = sim.model().opt.gravity.into();
                gravity[axis] = x;
                sim.set_gravity(gravity).map_err(|e| text(&e))?;
            }
            Slot::Timestep => sim.set_timestep(x).map_err(|e| text(&e))?,
        }
        Ok(())
    }
}

fn geoms(one: Option<usize>, model: &Model) -> std::ops::Range<usize> {
    one.map_or(0..model.geoms.len(), |g| g..g + 1)
}

/// A place in qpos or qvel: by the name of a joint that has one number, or by number.
fn coordinate(text: &str, key: &str, model: &Model, position: bool) -> Result<usize, String> {
    let len = if position { model.nq } else { model.nv };
    let first = |joint: &Joint| if position { joint.qposadr } else { joint.dofadr };
    let named_so = || model.joints.iter().filter(|j| j.name == key && !key.is_empty());
    if let Some(joint) = named_so().find(|j| j.kind.nv() == 1) {
        return Ok(first(joint));
    }
    if let Ok(i) = key.parse::<usize>() {
        return if i < len { Ok(i) } else { Err(format!("`{text}`: the scene has {len} numbers, from 0 on")) };
    }
    Err(match named_so().next() {
        Some(joint) => {
            format!("`{text}`: `{key}` has several numbers, from {} on: name one by its index", first(joint))
        }
        None => {
            let has = named(model.joints.iter().map(|j| j.name.clone()).filter(|n| !n.is_empty()));
            format!("`{text}`: the scene has no joint `{key}`; {has}")
        }
    })
}

/// A number from 0 to 1 that belongs to a seed, a world and a place.
pub fn random(seed: u64, world: usize, place: usize) -> f64 {
    let mut x = seed;
    for part in [world as u64, place as u64] {
        x = random::mix(x.wrapping_add(part.wrapping_add(1).wrapping_mul(random::STEP)));
    }
    (x >> 11) as f64 / (1u64 << 53) as f64
}
