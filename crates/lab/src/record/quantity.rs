//! Quantities by name: `crate.z`, `hinge`, `ground–crate.fn`; what `--show` chooses from.
//!
//! | name | what | unit |
//! |---|---|---|
//! | `BODY.x`, `.y`, `.z` | origin of the body's frame, world | m |
//! | `BODY.vx`, `.vy`, `.vz`, `.speed` | its velocity, world axes | m/s |
//! | `BODY.roll`, `.pitch`, `.yaw` | orientation: turns about the world's x, then y, then z axis | rad |
//! | `BODY.wx`, `.wy`, `.wz`, `.spin` | angular velocity, world axes | rad/s |
//! | `JOINT`, `JOINT.v` | value and speed of a slide or hinge joint | m or rad, and per s |
//! | `JOINT.limit` | force of its limit, positive away from it | N or N m |
//! | `ACTUATOR.ctrl`, `.force` | control as it counts (within `ctrlrange`), force before the gear | 1, N or N m |
//! | `A–B.fn`, `A–B.ft` | normal force and size of the sliding friction, summed over the contacts of A and B | N |
//! | `A–B.1.fn`, `A–B.1.ft` | of the first contact of A and B; and so on | N |
//! | `SENSOR`, or `SENSOR.x`, `.y`, `.z` | what the scene's sensors measure | the sensor's |
//! | `energy`, `kinetic`, `potential` | of all that moves | J |
//!
//! A and B are moving bodies, or geoms of what never moves. Contact forces are those that the law gives at the very state.

use std::collections::BTreeMap;

use super::Sample;
use crate::names;
use penny::collision::MAX_HITS;
use penny::data::{Contact, Data, JointRowKind};
use penny::dynamics;
use penny::kind::SensorKind;
use penny::math::{Vec3, Vec6};
use penny::model::{GeomKind, Joint, JointKind, Model, Object, Sensor, Transmission};
use penny::state::State;

/// One number of a state, with its name and unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    pub name: String,
    pub unit: &'static str,
    pub group: Group,
    source: Source,
}

/// Quantities that can be asked for together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    Position,
    Velocity,
    Rotation,
    Joints,
    /// Sums over the contacts of two bodies, and of joint limits.
    Forces,
    /// Contact by contact.
    Contacts,
    Actuators,
    Sensors,
    Energy,
}

/// The groups by the words that `--show` takes.
pub const GROUPS: [(&str, Group); 9] = [
    ("position", Group::Position),
    ("velocity", Group::Velocity),
    ("rotation", Group::Rotation),
    ("joints", Group::Joints),
    ("forces", Group::Forces),
    ("contacts", Group::Contacts),
    ("actuators", Group::Actuators),
    ("sensors", Group::Sensors),
    ("energy", Group::Energy),
];

#[derive(Clone, Copy, Debug, PartialEq)]
enum Source {
    Qpos(usize),
    Qvel(usize),
    Position(usize, usize),
    Velocity(usize, usize),
    Speed(usize),
    Angle(usize, usize),
    Angular(usize, usize),
    Spin(usize),
    /// The joint.
    Limit(usize),
    Ctrl(usize),
    Force(usize),
    /// Of all contacts of two sides, or of one of them.
    Normal([Side; 2], Option<usize>),
    Friction([Side; 2], Option<usize>),
    /// Index into `sensordata`.
    Sensor(usize),
    Energy,
    Kinetic,
    Potential,
}

/// What touches: a body that moves (with all that is welded to it), or a geom of what never moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Side {
    Geom(usize),
    Body(usize),
}

impl Side {
    pub fn of(model: &Model, geom: usize) -> Side {
        match model.bodies[model.geoms[geom].body].weld {
            0 => Side::Geom(geom),
            body => Side::Body(body),
        }
    }

    pub fn name(self, model: &Model) -> String {
        match self {
            Side::Geom(geom) => names::geom(model, geom),
            Side::Body(body) => names::body(model, body),
        }
    }
}

/// The two sides of a contact, in its geoms' order.
pub fn sides(model: &Model, geom: [usize; 2]) -> [Side; 2] {
    geom.map(|g| Side::of(model, g))
}

/// `ground–crate`
pub fn pair_name(model: &Model, sides: [Side; 2]) -> String {
    sides.map(|s| s.name(model)).join("–")
}

impl Quantity {
    /// What it is at the state that `data` was brought to by a whole `forward`.
    pub(super) fn value(&self, model: &Model, state: &State, data: &Data, sample: &Sample) -> f64 {
        match self.source {
            Source::Qpos(i) => state.qpos[i],
            Source::Qvel(i) => state.qvel[i],
            Source::Position(body, axis) => data.xpos[body][axis],
            Source::Velocity(body, axis) => twist(model, state, data, body)[axis],
            Source::Speed(body) => twist(model, state, data, body).fixed_rows::<3>(0).norm(),
            Source::Angle(body, axis) => {
                let (roll, pitch, yaw) = data.xquat[body].euler_angles();
                [roll, pitch, yaw][axis]
            }
            Source::Angular(body, axis) => twist(model, state, data, body)[3 + axis],
            Source::Spin(body) => twist(model, state, data, body).fixed_rows::<3>(3).norm(),
            Source::Limit(joint) => {
                let rows = data.joint_rows.iter().filter(|r| r.joint == joint && r.kind != JointRowKind::DryFriction);
                rows.map(|r| r.force).sum()
            }
            Source::Ctrl(i) => clamped(model, i, state.ctrl[i]),
            Source::Force(i) => data.actuator_force[i],
            Source::Normal(pair, which) => of_pair(model, data, pair, which).map(|c| c.force[0]).sum(),
            Source::Friction(pair, which) => friction(of_pair(model, data, pair, which)),
            Source::Sensor(i) => data.sensordata[i],
            Source::Energy => sample.energy,
            Source::Kinetic => sample.kinetic,
            Source::Potential => sample.energy - sample.kinetic,
        }
    }
}

/// A control as it counts: within the actuator's `ctrlrange`.
pub fn clamped(model: &Model, actuator: usize, ctrl: f64) -> f64 {
    match model.actuators[actuator].ctrlrange {
        Some([low, high]) if model.opt.flags.clampctrl => ctrl.max(low).min(high),
        _ => ctrl,
    }
}

/// Velocity of the origin of a body's frame and angular velocity, world axes.
fn twist(model: &Model, state: &State, data: &Data, body: usize) -> Vec6 {
    at_point(model, state, data, body, &data.xpos[body])
}

/// Velocity of a point of a body, world, m/s. Reads: what `forward` leaves at the state.
pub fn velocity(model: &Model, state: &State, data: &Data, body: usize, point: &Vec3) -> Vec3 {
    at_point(model, state, data, body, point).fixed_rows::<3>(0).into_owned()
}

/// J q̇ at a point of a body.
fn at_point(model: &Model, state: &State, data: &Data, body: usize, point: &Vec3) -> Vec6 {
    let Some(t) = model.bodies[body].tree else { return Vec6::zeros() };
    let dofs = model.trees[t].dofs.clone();
    let mut columns = vec![Vec6::zeros(); dofs.len()];
    dynamics::jacobian(model, data, body, point, &mut columns);
    columns.iter().zip(&state.qvel[dofs]).map(|(column, v)| column * *v).sum()
}

/// The contacts of two sides, or the one of that number.
fn of_pair<'a>(
    model: &'a Model,
    data: &'a Data,
    pair: [Side; 2],
    which: Option<usize>,
) -> impl Iterator<Item = &'a Contact> {
    let here = move |c: &&Contact| {
        let found = sides(model, c.geom.map(|g| g as usize));
        found == pair || found == [pair[1], pair[0]]
    };
    let contacts = data.contacts.iter().filter(here);
    let (skip, take) = which.map_or((0, usize::MAX), |i| (i, 1));
    contacts.skip(skip).take(take)
}

/// Size of the sum of the sliding friction, as vectors: opposite forces cancel.
fn friction<'a>(contacts: impl Iterator<Item = &'a Contact>) -> f64 {
    let sum: Vec3 = contacts.map(|c| c.frame.tr_mul(&Vec3::new(0.0, c.force[1], c.force[2]))).sum();
    sum.norm()
}

/// All quantities of a scene that are known in advance. (Of very many geoms, pairs are found as they come near: their
/// forces can only be asked for by name.)
pub fn quantities(model: &Model) -> Vec<Quantity> {
    const AXES: [&str; 3] = ["x", "y", "z"];
    let mut list = Vec::new();
    let mut add = |name: String, unit, group, source| list.push(Quantity { name, unit, group, source });
    for (j, joint) in model.joints.iter().enumerate() {
        let hinge = match joint.kind {
            JointKind::Slide => false,
            JointKind::Hinge => true,
            JointKind::Free | JointKind::Ball => continue,
        };
        let name = names::joint(model, j);
        let units = if hinge { ["rad", "rad/s", "N m"] } else { ["m", "m/s", "N"] };
        add(name.clone(), units[0], Group::Joints, Source::Qpos(joint.qposadr));
        add(format!("{name}.v"), units[1], Group::Joints, Source::Qvel(joint.dofadr));
        if joint.range.is_some() {
            add(format!("{name}.limit"), units[2], Group::Forces, Source::Limit(j));
        }
    }
    for body in (0..model.bodies.len()).filter(|&b| model.bodies[b].tree.is_some()) {
        let name = names::body(model, body);
        for (i, axis) in AXES.into_iter().enumerate() {
            add(format!("{name}.{axis}"), "m", Group::Position, Source::Position(body, i));
        }
        for (i, axis) in AXES.into_iter().enumerate() {
            add(format!("{name}.v{axis}"), "m/s", Group::Velocity, Source::Velocity(body, i));
        }
        add(format!("{name}.speed"), "m/s", Group::Velocity, Source::Speed(body));
        if !model.bodies[body].tree.is_some_and(|t| model.trees[t].rotates) {
            continue;
        }
        for (i, angle) in ["roll", "pitch", "yaw"].into_iter().enumerate() {
            add(format!("{name}.{angle}"), "rad", Group::Rotation, Source::Angle(body, i));
        }
        for (i, axis) in AXES.into_iter().enumerate() {
            add(format!("{name}.w{axis}"), "rad/s", Group::Rotation, Source::Angular(body, i));
        }
        add(format!("{name}.spin"), "rad/s", Group::Rotation, Source::Spin(body));
    }
    for (pair, points) in pairs(model) {
        let name = pair_name(model, pair);
        add(format!("{name}.fn"), "N", Group::Forces, Source::Normal(pair, None));
        add(format!("{name}.ft"), "N", Group::Forces, Source::Friction(pair, None));
        for i in 0..points {
            add(format!("{name}.{}.fn", i + 1), "N", Group::Contacts, Source::Normal(pair, Some(i)));
            add(format!("{name}.{}.ft", i + 1), "N", Group::Contacts, Source::Friction(pair, Some(i)));
        }
    }
    for (i, actuator) in model.actuators.iter().enumerate() {
        let name = names::actuator(model, i);
        let unit = match actuator.transmission {
            Transmission::Joint(j) | Transmission::JointInParent(j) if !turns(&model.joints[j]) => "N",
            Transmission::Site { .. } | Transmission::Tendon(_) | Transmission::SliderCrank { .. } => "N",
            _ => "N m",
        };
        add(format!("{name}.ctrl"), "", Group::Actuators, Source::Ctrl(i));
        add(format!("{name}.force"), unit, Group::Actuators, Source::Force(i));
    }
    for (i, sensor) in model.sensors.iter().enumerate() {
        let name = if sensor.name.is_empty() { format!("{} {i}", sensor.kind.name()) } else { sensor.name.clone() };
        let parts: &[&str] = match sensor.kind.dim() {
            1 => &[""],
            3 => &[".x", ".y", ".z"],
            _ => &[".qw", ".qx", ".qy", ".qz"],
        };
        for (k, part) in parts.iter().enumerate() {
            add(format!("{name}{part}"), unit(model, sensor), Group::Sensors, Source::Sensor(sensor.adr + k));
        }
    }
    add("energy".to_owned(), "J", Group::Energy, Source::Energy);
    add("kinetic".to_owned(), "J", Group::Energy, Source::Kinetic);
    add("potential".to_owned(), "J", Group::Energy, Source::Potential);
    list
}

/// Whether what acts on a joint is a torque.
fn turns(joint: &Joint) -> bool {
    matches!(joint.kind, JointKind::Hinge | JointKind::Ball)
}

/// Of a sensor's numbers.
fn unit(model: &Model, sensor: &Sensor) -> &'static str {
    use SensorKind::*;
    let rotary = match sensor.object {
        Object::Joint(j) => turns(&model.joints[j]),
        Object::Actuator(a) => model.actuators[a].transmission.joint().is_some_and(|j| turns(&model.joints[j])),
        _ => false,
    };
    match sensor.kind {
        Touch | Force => "N",
        Torque => "N m",
        Accelerometer | FrameLinAcc => "m/s²",
        Velocimeter | FrameLinVel | SubtreeLinVel => "m/s",
        Gyro | FrameAngVel | BallAngVel => "rad/s",
        FrameAngAcc => "rad/s²",
        RangeFinder | FramePos | SubtreeCom => "m",
        SubtreeAngMom => "kg m²/s",
        JointPos | ActuatorPos | JointLimitPos => {
            if rotary {
                "rad"
            } else {
                "m"
            }
        }
        JointVel | ActuatorVel | JointLimitVel => {
            if rotary {
                "rad/s"
            } else {
                "m/s"
            }
        }
        JointActuatorForce | ActuatorForce | JointLimitForce => {
            if rotary {
                "N m"
            } else {
                "N"
            }
        }
        TendonPos | TendonLimitPos => "m",
        TendonVel | TendonLimitVel => "m/s",
        TendonActuatorForce | TendonLimitForce => "N",
        PotentialEnergy | KineticEnergy => "J",
        Clock => "s",
        Magnetometer | BallQuat | FrameQuat | FrameXAxis | FrameYAxis | FrameZAxis | InsideSite => "",
    }
}

/// The pairs of sides that can touch and are known in advance, in order of their first contact, and the most contacts that
/// each can have.
pub fn pairs(model: &Model) -> Vec<([Side; 2], usize)> {
    let mut order: Vec<([Side; 2], usize)> = Vec::new();
    let mut place: BTreeMap<[Side; 2], usize> = BTreeMap::new();
    for pair in &model.pairs.listed {
        let sides = sides(model, pair.geom);
        let [a, b] = sides;
        let at = *place.entry([a.min(b), a.max(b)]).or_insert_with(|| {
            order.push((sides, 0));
            order.len() - 1
        });
        order[at].1 += most_points(pair.kind);
    }
    order
}

/// The most points in which two shapes touch.
fn most_points(kinds: [GeomKind; 2]) -> usize {
    match kinds {
        [GeomKind::Sphere, _] | [GeomKind::Plane, GeomKind::Sphere | GeomKind::Ellipsoid] => 1,
        [GeomKind::Plane, GeomKind::Capsule] => 2,
        [GeomKind::Plane, _] => 4,
        _ => MAX_HITS,
    }
}

/// The quantities that words name: groups, `all`, or names (where `-` does for `–`), each once, in the order of the words.
///
/// Errors: a word that names nothing, and the nearest name.
pub fn chosen(model: &Model, words: &[String]) -> Result<Vec<Quantity>, String> {
    let all = quantities(model);
    let plain = |name: &str| name.replace('–', "-");
    let mut found: Vec<Quantity> = Vec::new();
    for word in words.iter().map(|w| w.trim()).filter(|w| !w.is_empty()) {
        let group = GROUPS.iter().find(|(name, _)| *name == word).map(|(_, group)| *group);
        let takes = |q: &&Quantity| plain(&q.name) == plain(word) || word == "all" || group == Some(q.group);
        let new: Vec<Quantity> = all.iter().filter(takes).filter(|q| !found.contains(q)).cloned().collect();
        let known = group.is_some() || word == "all" || all.iter().any(|q| plain(&q.name) == plain(word));
        found.extend(new);
        if !known {
            found.push(pair_by_name(model, word).ok_or_else(|| unknown(&all, word))?);
        }
    }
    Ok(found)
}

/// `A–B.fn` of two sides whose pair is not known in advance.
fn pair_by_name(model: &Model, word: &str) -> Option<Quantity> {
    let (pair, what) = word.rsplit_once('.')?;
    let bodies = (1..model.bodies.len()).filter(|&b| model.bodies[b].weld == b).map(Side::Body);
    let fixed = (0..model.geoms.len()).map(|g| Side::of(model, g)).filter(|s| matches!(s, Side::Geom(_)));
    let all: Vec<Side> = bodies.chain(fixed).collect();
    let named = |name: &str| all.iter().copied().find(|s| s.name(model) == name);
    let split = |dash: char| {
        let mut places = pair.match_indices(dash);
        places.find_map(|(i, dash)| Some([named(&pair[..i])?, named(&pair[i + dash.len()..])?]))
    };
    let pair = split('–').or_else(|| split('-'))?;
    let source = match what {
        "fn" => Source::Normal(pair, None),
        "ft" => Source::Friction(pair, None),
        _ => return None,
    };
    let name = format!("{}.{what}", pair_name(model, pair));
    Some(Quantity { name, unit: "N", group: Group::Forces, source })
}

fn unknown(all: &[Quantity], word: &str) -> String {
    let groups = GROUPS.iter().map(|(name, _)| *name).chain(["all"]);
    let near = penny::mjcf::nearest(word, all.iter().map(|q| q.name.as_str()).chain(groups.clone()));
    let near = near.map_or_else(|| "there".to_owned(), |near| format!("did you mean `{near}`? There"));
    let examples: Vec<&str> = all.iter().map(|q| q.name.as_str()).take(6).collect();
    format!(
        "the scene has no quantity `{word}`: {near} are the groups {}, and single ones: {}{}",
        groups.collect::<Vec<_>>().join(", "),
        examples.join(", "),
        if all.len() > examples.len() { ", …" } else { "" }
    )
}

/// What a table shows where nobody chose: joints and the spin of a single body, and the loads of contacts. The table itself
/// chooses among them by what happened.
pub fn usual(model: &Model) -> Vec<Quantity> {
    const MOST: usize = 64;
    // The only joint of all, if it turns freely.
    let turns = match &model.joints[..] {
        [j] if matches!(j.kind, JointKind::Free | JointKind::Ball) => Some(j.body),
        _ => None,
    };
    let takes = |q: &Quantity| match q.source {
        Source::Qpos(_) => q.group == Group::Joints,
        Source::Spin(body) => turns == Some(body),
        Source::Normal(_, None) => true,
        _ => false,
    };
    let all = quantities(model);
    let mut list: Vec<Quantity> = Vec::new();
    for group in [Group::Joints, Group::Rotation, Group::Forces] {
        list.extend(all.iter().filter(|q| q.group == group && takes(q)).take(MOST).cloned());
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;
    use penny::math::Quat;

    #[test]
    fn roll_pitch_yaw_turn_about_the_worlds_axes() {
        let turn = |axis: usize, angle: f64| {
            let mut r = Vec3::zeros();
            r[axis] = angle;
            penny::math::exp(&r)
        };
        let q: Quat = turn(2, 0.3) * turn(1, 0.2) * turn(0, 0.1);
        let (roll, pitch, yaw) = q.euler_angles();
        assert!((roll - 0.1).abs() + (pitch - 0.2).abs() + (yaw - 0.3).abs() < 1e-14);
    }
}
