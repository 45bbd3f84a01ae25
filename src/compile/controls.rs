//! Actuators and keyframes: what refers to joints and to the state.

use super::layout::{self, World};
use super::{Log, Names, ties};
use crate::data::Data;
use crate::dynamics::{self, actuation};
use crate::math;
use crate::mjcf::{Edit, ProblemKind, Spec, lints, spec};
use crate::model::{Activation, Actuator, Dof, Joint, JointKind, Keyframe, Model, Parts, Tendon, Transmission};
use crate::state::State;

/// The actuators; what depends on the inertia of the scene, [`fill`] adds.
pub fn actuators(world: &World, tendons: &[Tendon], spec: &Spec, log: &mut Log) -> Vec<Actuator> {
    if spec.actuators.is_empty() {
        return Vec::new();
    }
    let targets = Targets {
        joints: world.joint_names(),
        sites: world.site_names(),
        tendons: Names::new("tendon", tendons.iter().map(|t| t.name.as_str())),
    };
    let mut actuators = Vec::new();
    let mut na = 0;
    for a in &spec.actuators {
        let autolimits = spec.compiler.autolimits;
        let transmission = targets.transmission(a, log);
        let (mut ctrlrange, mut actrange) = (a.ctrlrange, a.actrange);
        // A `general` may have it from the class of a servo without being one.
        if let Some(transmission) = transmission.filter(|_| a.inheritrange > 0.0 && a.gain == [-a.bias[1], 0.0, 0.0]) {
            let inherited = inherited(world, tendons, a, transmission, log);
            *(if a.activation == Activation::Integrator { &mut actrange } else { &mut ctrlrange }) = inherited;
        }
        let ctrlrange = range(a, "ctrlrange", ctrlrange, a.ctrllimited, autolimits, log);
        let forcerange = range(a, "forcerange", a.forcerange, a.forcelimited, autolimits, log);
        let actrange = range(a, "actrange", actrange, a.actlimited, autolimits, log);
        let Some(transmission) = transmission else { continue };
        if (a.damping, a.armature) != (0.0, 0.0) {
            check_rotor(world, tendons, a, transmission, log);
        }
        if let (Some([low, high]), Transmission::Joint(joint) | Transmission::JointInParent(joint)) =
            (a.ctrlrange, transmission)
            && a.bias[1] < 0.0
            && world.joints[joint].kind == JointKind::Hinge
        {
            servo_in_degrees(a, [low, high], log);
        }
        let act = (a.activation != Activation::None).then_some(na);
        na += usize::from(act.is_some());
        // Some damping that is to be found, for the time being.
        let damped = a.dampratio > 0.0 && a.bias[2] == 0.0;
        let bias = if damped { [a.bias[0], a.bias[1], -1.0] } else { a.bias };
        actuators.push(Actuator {
            name: a.name.clone().unwrap_or_default(),
            kind: a.kind,
            transmission,
            gear: a.gear,
            ctrlrange,
            forcerange,
            activation: a.activation,
            act,
            actrange,
            actearly: a.actearly,
            gain: a.gain,
            bias,
            damping: a.damping,
            armature: a.armature,
        });
    }
    actuators
}

/// What an actuator can act on, by name.
struct Targets<'a> {
    joints: Names<'a>,
    sites: Names<'a>,
    tendons: Names<'a>,
}

impl Targets<'_> {
    /// What an actuator acts on; `None` if a name was not found, which is reported.
    fn transmission(&self, a: &spec::Actuator, log: &mut Log) -> Option<Transmission> {
        let mut site = |name: &str, attribute: &str| self.sites.find(name, a.node, attribute, log);
        match &a.transmission {
            spec::Transmission::Site { site: name, reference } => {
                let at = site(name, "site")?;
                let reference = match reference {
                    Some(name) => Some(site(name, "refsite")?),
                    None => None,
                };
                Some(Transmission::Site { site: at, reference })
            }
            spec::Transmission::SliderCrank { crank, slider, rod } => {
                let (crank, slider) = (site(crank, "cranksite"), site(slider, "slidersite"));
                Some(Transmission::SliderCrank { crank: crank?, slider: slider?, rod: *rod })
            }
            spec::Transmission::Joint(name) => self.joints.find(name, a.node, "joint", log).map(Transmission::Joint),
            spec::Transmission::JointInParent(name) => {
                self.joints.find(name, a.node, "jointinparent", log).map(Transmission::JointInParent)
            }
            spec::Transmission::Tendon(name) => {
                self.tendons.find(name, a.node, "tendon", log).map(Transmission::Tendon)
            }
            spec::Transmission::None => None,
        }
    }
}

/// Warns where the `ctrlrange` of a position servo looks like degrees.
fn servo_in_degrees(actuator: &spec::Actuator, range: [f64; 2], log: &mut Log) {
    let gear = actuator.gear[0];
    let largest = if range[0].abs() > range[1].abs() { range[0] } else { range[1] };
    if gear.abs() != 1.0 || !lints::looks_like_degrees(largest, 2.0) || range.iter().any(|x| x.fract() != 0.0) {
        return;
    }
    let kind = ProblemKind::ServoInDegrees { word: largest.to_string(), turns: lints::turned(largest) };
    let meant = format!("{} {}", lints::in_radians(range[0]), lints::in_radians(range[1]));
    let own = log.document.attribute(actuator.node, "ctrlrange").map(|own| own.value_span);
    log.value_warning(actuator.node, "ctrlrange", kind, format!("write `{meant}`"));
    // What a class gives, it may give to others, too.
    if let (Some(own), Some(last)) = (own, log.warnings.last_mut()) {
        last.fix.push(Edit { span: own, text: meant });
    }
}

/// The range of a servo from that of its joint: about its middle, `inheritrange` times as wide.
fn inherited(
    world: &World,
    tendons: &[Tendon],
    a: &spec::Actuator,
    transmission: Transmission,
    log: &mut Log,
) -> Option<[f64; 2]> {
    let range = match transmission {
        Transmission::Joint(j) | Transmission::JointInParent(j) => world.joints[j].range,
        Transmission::Tendon(t) => tendons[t].range,
        Transmission::Site { .. } | Transmission::SliderCrank { .. } => None,
    };
    let Some([low, high]) = range.filter(|range| range.iter().all(|end| end.is_finite())) else {
        let what = "`inheritrange` needs a position servo on a joint or tendon with a finite `range`".to_string();
        log.value_error(a.node, "inheritrange", ProblemKind::Meaningless { what }, "give the range itself");
        return None;
    };
    let (middle, half) = (0.5 * (low + high), 0.5 * a.inheritrange * (high - low));
    Some([middle - half, middle + half])
}

/// What an actuator adds to its target is known for slides and hinges.
fn check_rotor(world: &World, tendons: &[Tendon], a: &spec::Actuator, transmission: Transmission, log: &mut Log) {
    if let Transmission::Tendon(t) = transmission
        && a.armature != 0.0
        && tendons[t].goes_round()
    {
        let what =
            "a tendon that goes round a geom cannot have `armature`, neither its own nor its actuator's".to_string();
        log.value_error(a.node, "armature", ProblemKind::Meaningless { what }, "leave it out");
    }
    if !bears_rotor(&world.joints, transmission) {
        let attribute = if a.damping == 0.0 { "armature" } else { "damping" };
        let lost = "Penny has it for actuators on slides, hinges and tendons only".to_string();
        let kind = ProblemKind::Unsupported { name: attribute.into(), lost };
        log.value_error(a.node, attribute, kind, "leave it out");
    }
}

/// Whether what an actuator acts on can have its damping and armature.
pub fn bears_rotor(joints: &[Joint], transmission: Transmission) -> bool {
    match transmission {
        Transmission::Joint(j) | Transmission::JointInParent(j) => joints[j].kind.nv() == 1,
        Transmission::Tendon(_) => true,
        Transmission::Site { .. } | Transmission::SliderCrank { .. } => false,
    }
}

/// Damping and armature of actuators, which their joints and tendons get times gear².
pub fn rotors(world: &mut World, tendons: &mut [Tendon], actuators: &[Actuator]) {
    for actuator in actuators {
        add_rotor(&world.joints, &mut world.dofs, tendons, actuator, actuator.rotor());
    }
}

/// The same after a change: what is more than before.
pub fn geared(before: &Parts, parts: &mut Parts) {
    for (now, old) in parts.actuators.iter().zip(&before.actuators).filter(|(now, old)| now.rotor() != old.rotor()) {
        let ([damping, armature], [damped, inert]) = (now.rotor(), old.rotor());
        add_rotor(&parts.joints, &mut parts.dofs, &mut parts.tendons, now, [damping - damped, armature - inert]);
    }
}

/// No armature is below 0, whatever rounding leaves of one that is taken away.
fn add_rotor(
    joints: &[Joint],
    dofs: &mut [Dof],
    tendons: &mut [Tendon],
    actuator: &Actuator,
    [damping, armature]: [f64; 2],
) {
    match actuator.transmission {
        Transmission::Joint(j) | Transmission::JointInParent(j) => {
            let dof = &mut dofs[joints[j].dofadr];
            dof.damping += damping;
            dof.armature = (dof.armature + armature).max(0.0);
        }
        Transmission::Tendon(t) => {
            tendons[t].damping[0] += damping;
            tendons[t].armature = (tendons[t].armature + armature).max(0.0);
        }
        _ => {}
    }
}

/// Stiffness and damping that follow from inertia at `qpos0`.
///
///     springdamper (τ, ζ) of a joint:   k = m/(τ ζ)²,   d = 2 m/τ,    m = 1/(mean of the joint's `invweight0`)
///     dampratio ζ of an actuator:       kv = 2 ζ √(kp m),             m = 1/(J M⁻¹ Jᵀ),   J = ∂length/∂q
///
/// What an actuator does not move, up to rounding, it does not damp.
///
/// Source: MuJoCo 4.0 manual, XML reference › joint, position; checked by running MuJoCo 4.0.0.
pub fn fill(model: &mut Model, world: &[&spec::Joint], spec: &Spec) {
    let ratios = spec.actuators.iter().map(|a| a.dampratio);
    if ratios.clone().all(|ratio| ratio == 0.0) && world.iter().all(|joint| joint.springdamper.is_none()) {
        return;
    }
    let (mut data, state) = (Data::new(model), State::new(model));
    for t in 0..model.trees.len() {
        if model.trees[t].free.is_none() {
            dynamics::inertia_matrix(model, t, &mut data);
        }
    }
    let mass_inverse = |row: &[f64]| -> f64 {
        let of_tree =
            |(t, tree): (usize, &crate::model::Tree)| ties::inverse_mass(model, &data, t, &row[tree.dofs.clone()]);
        model.trees.iter().enumerate().map(of_tree).sum()
    };
    let mut springs = Vec::new();
    for (j, joint) in world.iter().enumerate() {
        let Some([tau, zeta]) = joint.springdamper else { continue };
        let dofs = model.joints[j].dofadr..model.joints[j].dofadr + model.joints[j].kind.nv();
        let inverse = model.dofs[dofs.clone()].iter().map(|d| d.invweight0).sum::<f64>() / dofs.len() as f64;
        springs.push((j, dofs, 1.0 / (inverse * (tau * zeta).powi(2)), 2.0 / (inverse * tau)));
    }
    let mut gains = Vec::new();
    for (i, ratio) in ratios.enumerate().filter(|(_, ratio)| *ratio > 0.0) {
        let mut moving = Data::new(model);
        let row = actuation::moment(model, &state, &mut moving, i);
        let inverse = mass_inverse(&row);
        let kp = model.actuators[i].gain[0];
        gains.push((i, if inverse > math::MIN_VAL { 2.0 * ratio * (kp / inverse).max(0.0).sqrt() } else { 0.0 }));
    }
    let parts = model.parts_mut();
    for (j, dofs, stiffness, damping) in springs {
        parts.joints[j].stiffness = stiffness;
        // Beside that of actuators.
        parts.dofs[dofs].iter_mut().for_each(|dof| dof.damping += damping);
    }
    for (i, kv) in gains {
        parts.actuators[i].bias[2] = -kv;
    }
}

/// A free joint whose actuator depends on its velocity is no case for the closed form: `implicitfast` couples its
/// six dofs.
pub fn closed_forms(world: &mut World, tendons: &[Tendon], actuators: &[Actuator]) {
    for actuator in actuators.iter().filter(|a| a.depends_on_velocity()) {
        for body in actuator.transmission.bodies(&world.joints, &world.sites, &world.geoms, tendons) {
            if let Some(tree) = world.bodies[body].tree {
                world.trees[tree].free = None;
            }
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
    let places: Vec<f64> =
        world.mocap.iter().flat_map(|&b| world.bodies[b].pos.iter().copied().collect::<Vec<_>>()).collect();
    let turns: Vec<f64> = world.mocap.iter().flat_map(|&b| math::wxyz(&world.bodies[b].quat)).collect();
    let na = spec.actuators.iter().filter(|a| a.activation != Activation::None).count();
    for key in &spec.keyframes {
        let mut numbers = |attribute: &'static str, given: &Option<Vec<f64>>, default: Vec<f64>| match given {
            None => default,
            Some(values) if values.len() <= default.len() => {
                if values.len() < default.len() {
                    let rest = match attribute {
                        "qpos" => "`qpos0`",
                        "mpos" | "mquat" => "where the bodies stand",
                        _ => "zeros",
                    };
                    let (needs, given) = (layout::numbers(default.len()), layout::given(values.len()));
                    let problem = ProblemKind::KeyframeShort { attribute, needs, given };
                    let help = format!("the rest is from {rest}; {}", meaning(world, attribute));
                    log.value_warning(key.node, attribute, problem, help);
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
        let act = numbers("act", &key.act, vec![0.0; na]);
        numbers("plastic", &key.plastic, Vec::new());
        let mocap_pos = numbers("mpos", &key.mpos, places.clone()).as_chunks().0.to_vec();
        let mocap_quat = numbers("mquat", &key.mquat, turns.clone()).as_chunks().0.to_vec();
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
        let (name, time) = (key.name.clone().unwrap_or_default(), key.time);
        keyframes.push(Keyframe { name, time, qpos, qvel, ctrl, act, mocap_pos, mocap_quat });
    }
    keyframes
}

/// Which numbers a keyframe needs, joint by joint.
fn meaning(world: &World, attribute: &str) -> String {
    const SHOWN: usize = 8;
    match attribute {
        "ctrl" => return "one number for each actuator".into(),
        "act" => return "one number for each actuator with dynamics".into(),
        "plastic" => return "one number for each joint that yields, and there is none: leave it out".into(),
        "mpos" => return "three numbers for each mocap body".into(),
        "mquat" => return "four numbers for each mocap body".into(),
        _ => {}
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
