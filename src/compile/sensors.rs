//! Sensors: what they are about, and where their values go.

use super::layout::World;
use super::{Log, Names};
use crate::mjcf::{NodeId, ProblemKind, Spec, spec};
use crate::model::{Actuator, Joint, JointKind, Object, Sensor, SensorKind, Tendon};

pub fn sensors(world: &World, actuators: &[Actuator], tendons: &[Tendon], spec: &Spec, log: &mut Log) -> Vec<Sensor> {
    if spec.sensors.is_empty() {
        return Vec::new();
    }
    let names = [
        world.body_names(),
        world.geom_names(),
        world.site_names(),
        world.joint_names(),
        Names::new("actuator", actuators.iter().map(|a| a.name.as_str())),
        Names::new("tendon", tendons.iter().map(|t| t.name.as_str())),
    ];
    use SensorKind::{TendonLimitForce, TendonLimitPos, TendonLimitVel};
    let (mut sensors, mut adr) = (Vec::new(), 0);
    for s in &spec.sensors {
        let object = match s.object.1.as_str() {
            "" => Some(Object::World),
            _ => find(&names, &s.object, s.node, log),
        };
        let reference = s.reference.as_ref().map(|r| find(&names, r, s.node, log));
        let (Some(object), None | Some(Some(_))) = (object, reference) else { continue };
        if let Object::Joint(j) = object {
            check_joint(&world.joints[j], s, log);
        }
        if let Object::Tendon(t) = object
            && matches!(s.kind, TendonLimitPos | TendonLimitVel | TendonLimitForce)
            && tendons[t].range.is_none()
        {
            let what = format!("`{}` needs a tendon with limits", s.kind.name());
            log.value_error(s.node, "tendon", ProblemKind::Meaningless { what }, "");
        }
        let name = s.name.clone().unwrap_or_default();
        let (reference, cutoff, noise) = (reference.flatten(), s.cutoff, s.noise);
        sensors.push(Sensor { name, kind: s.kind, object, reference, cutoff, noise, adr });
        adr += s.kind.dim();
    }
    sensors
}

fn find(names: &[Names; 6], (of, name): &(String, String), node: NodeId, log: &mut Log) -> Option<Object> {
    let [bodies, geoms, sites, joints, actuators, tendons] = names;
    match of.as_str() {
        "body" => bodies.find(name, node, "objname", log).map(Object::Body),
        "xbody" => bodies.find(name, node, "objname", log).map(Object::Xbody),
        "geom" => geoms.find(name, node, "objname", log).map(Object::Geom),
        "site" => sites.find(name, node, "site", log).map(Object::Site),
        "joint" => joints.find(name, node, "joint", log).map(Object::Joint),
        "tendon" => tendons.find(name, node, "tendon", log).map(Object::Tendon),
        _ => actuators.find(name, node, "actuator", log).map(Object::Actuator),
    }
}

/// Some sensors are for some joints only.
fn check_joint(joint: &Joint, sensor: &spec::Sensor, log: &mut Log) {
    use SensorKind::*;
    let needs = match sensor.kind {
        BallQuat | BallAngVel if joint.kind != JointKind::Ball => "a ball joint",
        JointPos | JointVel | JointActuatorForce if !matches!(joint.kind, JointKind::Slide | JointKind::Hinge) => {
            "a slide or a hinge"
        }
        JointLimitPos | JointLimitVel | JointLimitForce if joint.range.is_none() => "a joint with limits",
        _ => return,
    };
    let what = format!("`{}` needs {needs}", sensor.kind.name());
    log.value_error(sensor.node, "joint", ProblemKind::Meaningless { what }, "");
}
