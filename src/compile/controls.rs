//! Actuators and keyframes: what refers to joints and to the state.

use super::Log;
use super::layout::{self, World};
use crate::math;
use crate::mjcf::{ProblemKind, Spec, lints, spec};
use crate::model::{Actuator, JointKind, Keyframe};

pub fn actuators(world: &World, spec: &Spec, log: &mut Log) -> Vec<Actuator> {
    let joints = world.joint_names();
    let mut actuators = Vec::new();
    for a in &spec.actuators {
        let ctrlrange = range(a, "ctrlrange", a.ctrlrange, a.ctrllimited, spec.compiler.autolimits, log);
        let forcerange = range(a, "forcerange", a.forcerange, a.forcelimited, spec.compiler.autolimits, log);
        let Some(joint) = joints.find(&a.joint, a.node, "joint", log) else { continue };
        if let Some([low, high]) = a.ctrlrange
            && a.bias[1] < 0.0
            && world.joints[joint].kind == JointKind::Hinge
        {
            servo_in_degrees(a, [low, high], log);
        }
        actuators.push(Actuator {
            name: a.name.clone().unwrap_or_default(),
            kind: a.kind,
            joint,
            gear: a.gear,
            ctrlrange,
            forcerange,
            gain: a.gain,
            bias: a.bias,
        });
    }
    actuators
}

/// Warns where the `ctrlrange` of a position servo looks like degrees.
fn servo_in_degrees(actuator: &spec::Actuator, range: [f64; 2], log: &mut Log) {
    let gear = actuator.gear[0];
    let largest = if range[0].abs() > range[1].abs() { range[0] } else { range[1] };
    if gear.abs() != 1.0 || !lints::looks_like_degrees(largest, 2.0) || range.iter().any(|x| x.fract() != 0.0) {
        return;
    }
    let kind = ProblemKind::ServoInDegrees { word: largest.to_string(), turns: lints::turned(largest) };
    let help = format!("write `{} {}`", lints::in_radians(range[0]), lints::in_radians(range[1]));
    log.value_warning(actuator.node, "ctrlrange", kind, help);
}

/// A free joint whose actuator depends on its velocity is no case for the closed form: `implicitfast` couples its
/// six dofs.
pub fn closed_forms(world: &mut World, actuators: &[Actuator]) {
    for actuator in actuators.iter().filter(|a| a.bias[2] != 0.0) {
        if let Some(tree) = world.bodies[world.joints[actuator.joint].body].tree {
            world.trees[tree].free = None;
        }
    }
}

/// A range that applies: given, and neither switched off nor left open by `autolimits="false"`.
fn range(
    actuator: &spec::Actuator,
    attribute: &str,
    given: Option<[f64; 2]>,
    limited: Option<bool>,
    autolimits: bool,
    log: &mut Log,
) -> Option<[f64; 2]> {
    let given = given.filter(|r| *r != [0.0, 0.0]);
    match (given, limited) {
        (_, Some(false)) | (None, None) => None,
        (None, Some(true)) => {
            let help = format!("add `{attribute}=\"low high\"`");
            log.error(actuator.node, ProblemKind::LimitedWithoutRange, help);
            None
        }
        (Some(_), None) if !autolimits => {
            let help = "say whether it is limited, or drop `autolimits=\"false\"` from `<compiler>`";
            log.value_error(actuator.node, attribute, ProblemKind::RangeWithoutLimited, help);
            None
        }
        (Some([low, high]), _) if low >= high => {
            let problem = ProblemKind::RangeEmpty { low, high };
            log.value_error(actuator.node, attribute, problem, "give the smaller number first");
            None
        }
        (given, _) => given,
    }
}

/// Keyframes, filled up from `qpos0`; quaternions normalised.
pub fn keyframes(world: &World, spec: &Spec, log: &mut Log) -> Vec<Keyframe> {
    let mut keyframes = Vec::new();
    for key in &spec.keyframes {
        let mut numbers = |attribute: &'static str, given: &Option<Vec<f64>>, default: Vec<f64>| match given {
            None => default,
            Some(values) if values.len() <= default.len() => {
                if values.len() < default.len() {
                    let rest = if attribute == "qpos" { "`qpos0`" } else { "zeros" };
                    let (needs, given) = (layout::numbers(default.len()), layout::given(values.len()));
                    let problem = ProblemKind::KeyframeShort { attribute, needs, given, rest };
                    log.value_warning(key.node, attribute, problem, meaning(world, attribute));
                }
                let mut filled = default;
                filled[..values.len()].copy_from_slice(values);
                filled
            }
            Some(values) => {
                let problem = ProblemKind::KeyframeCount {
                    attribute,
                    needs: layout::numbers(default.len()),
                    given: layout::given(values.len()),
                };
                log.value_error(key.node, attribute, problem, meaning(world, attribute));
                default
            }
        };
        let mut qpos = numbers("qpos", &key.qpos, world.qpos0.clone());
        let qvel = numbers("qvel", &key.qvel, vec![0.0; world.dofs.len()]);
        let ctrl = numbers("ctrl", &key.ctrl, vec![0.0; spec.actuators.len()]);
        for joint in &world.joints {
            let quat = match joint.kind {
                JointKind::Free => joint.qposadr + 3,
                JointKind::Ball => joint.qposadr,
                JointKind::Slide | JointKind::Hinge => continue,
            };
            let length = qpos[quat..quat + 4].iter().map(|x| x * x).sum::<f64>().sqrt();
            // To a hundredth it is rounding of what someone typed.
            if (length - 1.0).abs() > 0.01 {
                let joint = layout::label("body", &world.bodies[joint.body].name, joint.body);
                let (why, help) = match length {
                    l if l < math::MIN_VAL => ("is 0 0 0 0", "it counts as `1 0 0 0`, no rotation"),
                    _ => ("is not of length 1", "it counts as scaled to length 1; w comes first"),
                };
                let kind = ProblemKind::KeyframeQuaternion { joint, why: why.into() };
                log.value_warning(key.node, "qpos", kind, help);
            }
            let unit = math::wxyz(&math::quat(&qpos[quat..quat + 4]));
            qpos[quat..quat + 4].copy_from_slice(&unit);
        }
        keyframes.push(Keyframe { name: key.name.clone().unwrap_or_default(), time: key.time, qpos, qvel, ctrl });
    }
    keyframes
}

/// Which numbers a keyframe needs, joint by joint.
fn meaning(world: &World, attribute: &str) -> String {
    const SHOWN: usize = 8;
    if attribute == "ctrl" {
        return "one number for each actuator".into();
    }
    let (free, ball) = match attribute {
        "qpos" => ("x y z, quaternion w x y z", "quaternion w x y z"),
        _ => ("velocity x y z, angular velocity x y z", "angular velocity x y z"),
    };
    let mut parts: Vec<String> = Vec::new();
    for (i, joint) in world.joints.iter().enumerate().take(SHOWN) {
        let numbers = match joint.kind {
            JointKind::Free => free,
            JointKind::Ball => ball,
            JointKind::Slide | JointKind::Hinge => "one number",
        };
        parts.push(format!("{} ({numbers})", layout::label("joint", &joint.name, i)));
    }
    if world.joints.len() > SHOWN {
        parts.push("…".into());
    }
    format!("in order: {}", if parts.is_empty() { "nothing, since nothing moves".into() } else { parts.join("; ") })
}
