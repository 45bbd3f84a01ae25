//! What makes a start questionable, said before the first step: `penny check` asks about the scene's own start and its
//! keyframes, `penny run` about the start of the run.

use std::f64::consts::PI;

use super::format::{short, si};
use penny::collision;
use penny::contact::describe::{Ask, Touch};
use penny::data::Data;
use penny::dynamics;
use penny::forward::{Method, StepError};
use penny::model::{GeomKind, JointKind, Model};
use penny::state::State;
use penny_lab::explain;
use penny_lab::names;
use penny_lab::record::clamped;

/// Joints named in one warning.
const NAMED: usize = 3;

/// Warnings about a start; `when` says which one ("at the start", "in keyframe `up`").
pub fn of_start(model: &Model, state: &State, when: &str) -> Vec<String> {
    let mut list = Vec::new();
    list.extend(beyond_limits(model, state, when));
    list.extend(targets(model, state, when));
    list
}

/// Warnings about the scene as a whole.
pub fn of_scene(model: &Model) -> Vec<String> {
    let mut list = Vec::new();
    list.extend(gravity(model));
    list.extend(heavier(model));
    list.extend(driving(model));
    list.extend(masses(model));
    list
}

/// The contacts where a scene starts, in `data`.
///
/// Errors: there are more than it may have, and no step can be taken.
pub fn find_contacts(model: &Model, start: &State, data: &mut Data) -> Result<(), StepError> {
    dynamics::mocap(model, start, data);
    dynamics::kinematics(model, &start.qpos, data);
    collision::detect(model, data);
    let most = model.pairs.most_contacts;
    match data.counts.crowded {
        0 => Ok(()),
        _ => Err(StepError::Crowded { time: start.time, most }),
    }
}

/// Joints that begin beyond their limits: the limit throws them back.
fn beyond_limits(model: &Model, state: &State, when: &str) -> Option<String> {
    let beyond = |j: &usize| {
        let joint = &model.joints[*j];
        let [low, high] = joint.range?;
        if !matches!(joint.kind, JointKind::Slide | JointKind::Hinge) || !model.opt.flags.limit {
            return None;
        }
        let q = state.qpos[joint.qposadr];
        // Of a hundredth or two of the range nobody notices the push: straight knees whose range ends at -2°.
        let slack = 0.02 * (high - low) + 1e-9;
        let unit = if joint.kind == JointKind::Hinge { "rad" } else { "m" };
        (q < low - slack || q > high + slack).then(|| {
            format!(
                "{} at {} {unit}, its range is {} to {}",
                names::joint(model, *j),
                short(q),
                short(low),
                short(high)
            )
        })
    };
    let all: Vec<String> = (0..model.joints.len()).filter_map(|j| beyond(&j)).collect();
    several(&all).map(|list| {
        format!("warning: beyond its limits {when}: {list}; the limit will throw it back (check the unit and `ref`)")
    })
}

/// Servos whose control asks for a place that their joint cannot reach, by far: mostly degrees.
fn targets(model: &Model, state: &State, when: &str) -> Option<String> {
    let far = |i: usize| {
        let a = &model.actuators[i];
        let j = a.transmission.joint()?;
        let joint = &model.joints[j];
        let place = a.bias[1] < 0.0 && (a.gain[0] + a.bias[1]).abs() <= 1e-9 * a.gain[0].abs() && a.gear[0] != 0.0;
        if !place || joint.kind != JointKind::Hinge {
            return None;
        }
        let target = clamped(model, i, state.ctrl[i]) / a.gear[0];
        (target.abs() > 4.0 * PI).then(|| {
            let name = names::actuator(model, i);
            format!(
                "{name} asks for {} rad, {} turns of {}",
                short(target),
                short(target.abs() / (2.0 * PI)),
                names::joint(model, j)
            )
        })
    };
    let all: Vec<String> = (0..model.actuators.len()).filter_map(far).collect();
    several(&all).map(|list| {
        format!(
            "warning: {when} {list}: controls of servos are in radians, whatever `angle` says; divide degrees by 57.3"
        )
    })
}

fn several(all: &[String]) -> Option<String> {
    let more = if all.len() > NAMED { format!(", and {} more", all.len() - NAMED) } else { String::new() };
    (!all.is_empty()).then(|| all[..all.len().min(NAMED)].join(", ") + &more)
}

/// Gravity in another unit, or upwards.
fn gravity(model: &Model) -> Option<String> {
    let (g, z) = (explain::weight(model), dynamics::gravity(model).z);
    if g > 300.0 {
        return Some(format!(
            "warning: gravity is {} m/s², {} times the Earth's: it is in m/s² (and lengths are in m); 9810 mm/s² are 9.81",
            short(g),
            short(g / 9.81)
        ));
    }
    (z > 5.0).then(|| format!("warning: gravity points up, along +z ({} m/s²): write -{}", short(z), short(z)))
}

/// Bodies that are to be heavier than they are, of which MuJoCo takes no notice.
fn heavier(model: &Model) -> Option<String> {
    let body = model.bodies.iter().position(|body| body.gravcomp < 0.0)?;
    model.bodies.iter().all(|body| body.gravcomp <= 0.0).then(|| {
        format!(
            "warning: the `gravcomp` of {} has no effect, as in MuJoCo: below 0 it counts only where that of some body is above 0",
            names::body(model, body)
        )
    })
}

/// Dampers that push along instead of braking.
fn driving(model: &Model) -> Option<String> {
    let joints = (0..model.joints.len()).filter(|&j| model.dofs[model.joints[j].dofadr].damping < 0.0);
    let tendons = (0..model.tendons.len()).filter(|&t| model.tendons[t].damping[0] < 0.0);
    let joints = joints.map(|j| names::joint(model, j));
    let all: Vec<String> = joints.chain(tendons.map(|t| names::tendon(model, t))).collect();
    let list = several(&all).filter(|_| model.opt.flags.damper)?;
    Some(format!("warning: damping below 0 drives what moves instead of braking it: {list}"))
}

/// Moving bodies whose mass does not go with their size.
fn masses(model: &Model) -> Vec<String> {
    // Osmium, the densest element, has 22 600 kg/m³; air 1.2.
    const DENSEST: f64 = 1e5;
    const LIGHTEST: f64 = 0.5;
    let (mut dense, mut light, mut large) = (Vec::new(), Vec::new(), Vec::new());
    for (b, body) in model.bodies.iter().enumerate() {
        let geoms = &model.geoms[body.geoms.clone()];
        if body.tree.is_none() || body.joints.is_empty() || geoms.is_empty() {
            continue;
        }
        let volume: f64 = geoms.iter().map(|g| volume(g.kind, g.size.as_slice())).sum();
        let across = 2.0 * geoms.iter().map(|g| g.rbound).fold(0.0, f64::max);
        let density = body.mass / volume;
        let name = || names::body(model, b);
        // Links of robots are often drawn smaller or larger than they are; what flies alone is what it looks like.
        let alone = body.tree.is_some_and(|t| model.trees[t].free.is_some() && model.trees[t].bodies.len() == 1);
        if volume > 0.0 && (body.mass >= 10.0 || alone) && density > DENSEST {
            dense.push(format!(
                "{} weighs {} kg in {}, {} kg/m³ ({} g are {} kg)",
                name(),
                short(body.mass),
                litres(volume),
                short(density),
                short(body.mass),
                short(body.mass / 1e3)
            ));
        } else if across <= 20.0 && alone && density < LIGHTEST {
            light.push(format!(
                "{} weighs {} kg in {}, {} kg/m³",
                name(),
                short(body.mass),
                litres(volume),
                short(density)
            ));
        } else if across > 20.0 && (body.mass > 1e6 || density < LIGHTEST) {
            large.push(format!(
                "{} is {} across and weighs {} kg ({} mm are {} m)",
                name(),
                si(across, "m"),
                short(body.mass),
                short(across),
                short(1e-3 * across)
            ));
        }
    }
    [
        several(&dense).map(|list| format!("warning: masses are in kg, and no material is so dense: {list}")),
        several(&light).map(|list| format!("warning: masses are in kg and lengths in m; lighter than air: {list}")),
        several(&large).map(|list| format!("warning: lengths are in m: {list}")),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// m³
fn volume(kind: GeomKind, size: &[f64]) -> f64 {
    let [a, b, c] = [size[0], size[1], size[2]];
    match kind {
        GeomKind::Plane => 0.0,
        GeomKind::Sphere => 4.0 / 3.0 * PI * a * a * a,
        GeomKind::Capsule => PI * a * a * (2.0 * b + 4.0 / 3.0 * a),
        GeomKind::Ellipsoid => 4.0 / 3.0 * PI * a * b * c,
        GeomKind::Cylinder => 2.0 * PI * a * a * b,
        GeomKind::Box => 8.0 * a * b * c,
    }
}

fn litres(volume: f64) -> String {
    if volume >= 1e-3 { format!("{} l", short(volume * 1e3)) } else { format!("{} cm³", short(volume * 1e6)) }
}

/// Quaternions of a start that are not of length 1; those of a scene are checked where it is compiled.
pub fn quaternions(model: &Model, state: &State) -> Vec<String> {
    let mut list = Vec::new();
    for (j, joint) in model.joints.iter().enumerate() {
        let at = match joint.kind {
            JointKind::Free => joint.qposadr + 3,
            JointKind::Ball => joint.qposadr,
            JointKind::Slide | JointKind::Hinge => continue,
        };
        let q = &state.qpos[at..at + 4];
        let length = q.iter().map(|x| x * x).sum::<f64>().sqrt();
        let name = if joint.name.is_empty() { names::body(model, joint.body) } else { names::joint(model, j) };
        if length < 1e-15 {
            list.push(format!("warning: the quaternion of {name} is 0 0 0 0: it counts as 1 0 0 0, no rotation"));
        } else if (length - 1.0).abs() > 0.01 {
            list.push(format!(
                "warning: the quaternion of {name} has length {}: it counts as scaled to 1",
                short(length)
            ));
        }
    }
    list
}

/// What flies so fast that contacts cannot stop it.
///
/// Two ways through a wall, for two shapes of thickness t together (the least of each):
///
///     v h > t           it is on one side before a step and on the other after it
///     v/(e ω) > t/2     its contact gives way by more than half (ζ = 1): it comes out on the other side
///
/// with v the speed of approach and ω that of the contact pressed hard. Checked are pairs that are on their way to each
/// other within `seconds`, planes left out, since one cannot pass them.
///
/// Reads: kinematics in `data` at the state, and its accelerations' factor (`forward`).
pub fn tunnels(
    model: &Model,
    method: &Method,
    state: &State,
    data: &Data,
    touches: &[Touch],
    seconds: f64,
) -> Option<String> {
    let of = |touch: &Touch| {
        let tunnel = Tunnel::of(model, method, touch, approach(model, state, data, touch, seconds)?)?;
        Some(tunnel.told(model, method, touch))
    };
    touches.iter().find_map(of)
}

/// Two shapes on their way to each other: speed (m/s), and thickness of both together (m).
struct Approach {
    speed: f64,
    thickness: f64,
}

/// How the shapes of a pair approach, if they will meet within `seconds` on straight ways.
fn approach(model: &Model, state: &State, data: &Data, touch: &Touch, seconds: f64) -> Option<Approach> {
    let half = |g: usize| {
        let size = &model.geoms[g].size;
        match model.geoms[g].kind {
            GeomKind::Plane => f64::INFINITY,
            GeomKind::Sphere | GeomKind::Capsule => size.x,
            GeomKind::Cylinder => size.x.min(size.y),
            GeomKind::Ellipsoid | GeomKind::Box => size.min(),
        }
    };
    let place = |g: usize| {
        let body = model.geoms[g].body;
        let at = data.xpos[body] + data.xmat[body] * model.geoms[g].pos;
        (at, penny_lab::record::velocity(model, state, data, body, &at))
    };
    let [a, b] = touch.geom;
    let thickness = 2.0 * (half(a) + half(b));
    if !thickness.is_finite() {
        return None;
    }
    let ((pa, va), (pb, vb)) = (place(a), place(b));
    let (apart, closing) = (pb - pa, va - vb);
    let speed = closing.norm();
    let reach = model.geoms[a].rbound + model.geoms[b].rbound;
    let along = apart.dot(&closing) / speed.max(f64::MIN_POSITIVE);
    let miss = (apart.norm_squared() - along * along).max(0.0).sqrt();
    let meets = along > 0.0 && miss <= reach && along - reach <= speed * seconds;
    meets.then_some(Approach { speed, thickness })
}

/// An impact that goes through.
struct Tunnel {
    approach: Approach,
    /// How deep the contact lets it go, m; 0 where its law has no formula.
    depth: f64,
    /// By one step, and by the depth.
    passes: bool,
    sinks: bool,
}

impl Tunnel {
    /// `None` where the contact stops it.
    fn of(model: &Model, method: &Method, touch: &Touch, approach: Approach) -> Option<Tunnel> {
        let Approach { speed, thickness: t } = approach;
        // Too slow for either way, unless 1/ω is above 4 s: nearly all pairs.
        if speed * method.timestep < 0.2 * t && speed * 0.3 < 0.1 * t {
            return None;
        }
        let ask = Ask { model, touch, timestep: method.timestep, slope: 0.0 };
        let spring = (method.contact.describe)(&ask).springs.map(|[_, hard]| hard);
        let depth = spring.map_or(0.0, |s| impact_depth(speed, s.omega(), s.zeta()));
        let (passes, sinks) = (speed * method.timestep > t, depth > 0.5 * t);
        (passes || sinks).then_some(Tunnel { approach, depth, passes, sinks })
    }

    /// The warning, with a timestep of which five make the thickness, and a contact that gives way by a quarter of it.
    fn told(&self, model: &Model, method: &Method, touch: &Touch) -> String {
        let Tunnel { approach: Approach { speed, thickness: t }, depth, passes, sinks } = *self;
        let [a_name, b_name] = touch.geom.map(|g| names::geom(model, g));
        let mut text = format!(
            "warning: {b_name} and {a_name} approach at {}, and have a total thickness of {}",
            si(speed, "m/s"),
            si(t, "m")
        );
        if passes {
            text += &format!(
                ": {} in one step can jump over that (--timestep {:.0e})",
                si(speed * method.timestep, "m"),
                0.2 * t / speed
            );
        }
        if sinks {
            let mix = &model.mixes[touch.mix];
            let tau = 0.25 * t / depth;
            text += &format!(
                "{} at solref {} {} this impact goes {} deep",
                if passes { "; and" } else { ":" },
                short(mix.solref[0]),
                short(mix.solref[1]),
                si(depth, "m")
            );
            if mix.solref[0] > 0.0 {
                let solref = rounded(mix.solref[0] * tau);
                text += &format!(
                    ", so it comes out on the other side (--solref \"{solref} {}\" --timestep {:.0e})",
                    short(mix.solref[1]),
                    (0.2 * solref).min(0.2 * t / speed)
                );
            }
        }
        text + "\n"
    }
}

/// One digit, for advice.
fn rounded(x: f64) -> f64 {
    format!("{x:.0e}").parse().unwrap_or(x)
}

/// How deep an impact of speed v goes into a damped spring, without weight, m.
///
///     ζ < 1:  v/ω exp(−ζ φ/s),  s = √(1 − ζ²), φ = atan(s/ζ);     ζ = 1: v/(e ω);     ζ > 1: s = √(ζ² − 1), φ = atanh(s/ζ)
fn impact_depth(v: f64, omega: f64, zeta: f64) -> f64 {
    let s = (1.0 - zeta * zeta).abs().sqrt();
    let exponent = match zeta {
        z if s < 1e-6 => z,
        z if z < 1.0 => z * (s / z).atan() / s,
        z => z * (s / z).atanh() / s,
    };
    v / omega * (-exponent).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_impact_goes_as_deep_as_its_damped_spring_lets_it() {
        for zeta in [0.2, 1.0, 2.5] {
            let (v, omega, h) = (3.0, 50.0, 1e-7);
            let (mut x, mut speed) = (0.0, v);
            while speed > 0.0 {
                speed -= h * (omega * omega * x + 2.0 * zeta * omega * speed);
                x += h * speed;
            }
            assert!((impact_depth(v, omega, zeta) / x - 1.0).abs() < 1e-4, "{zeta}");
        }
    }
}
