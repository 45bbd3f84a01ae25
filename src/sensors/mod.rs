//! Sensors: what a scene measures in every step.
//!
//! They belong to the state in which a step begins: forces and accelerations are those that act there. Only implicit
//! integrators, whose forces are those at the end of a step, measure there. A scene without sensors does nothing here.
//!
//! | file | what |
//! |---|---|
//! | `joints` | joints, tendons, their limits, actuators |
//! | `frames` | poses, velocities and accelerations of bodies, geoms and sites |
//! | `forces` | force and torque between a body and its parent, touch |
//! | `subtree` | centre of mass and momentum of a body and what hangs on it |
//! | `around` | range finder, magnetometer, whether something is within a site, clock, energies |
//! | `motion` | twists and accelerations of all bodies |
//!
//! Source: MuJoCo 4.0 manual, XML reference › sensor; signs and frames checked by running MuJoCo 4.0.0.

mod around;
mod forces;
mod frames;
mod joints;
mod motion;
mod subtree;

use crate::contact::Law;
use crate::data::Data;
use crate::dynamics::energy;
use crate::kind::SensorKind;
use crate::model::{Model, Object, Sensor};
use crate::state::State;
pub(crate) use motion::{Motion, each_wrench};

/// Measures everything that the scene's sensors ask for.
///
/// Reads:  the state, and what [`forward`](crate::forward::forward) found at it with this law. Writes: `sensordata`,
///         which has MuJoCo's layout: one sensor after the other, [`Sensor::adr`] says where.
/// Clips:  to `cutoff` where that is above zero: to ±cutoff, or from above what is never negative.
/// Noise:  none; as in MuJoCo 4.0 `noise` is a number for whoever uses the values.
#[inline]
pub fn sense(model: &Model, law: &Law, state: &State, data: &mut Data) {
    if !model.sensors.is_empty() && model.opt.flags.sensor {
        sense_all(model, law, state, data);
    }
}

fn sense_all(model: &Model, law: &Law, state: &State, data: &mut Data) {
    let mut values = std::mem::take(&mut data.sensordata);
    let mut motion = std::mem::take(data.scratch.get::<Motion>());
    motion.update(model, law, state, data);
    for sensor in &model.sensors {
        let out = &mut values[sensor.adr..sensor.adr + sensor.kind.dim()];
        measure(model, state, data, &motion, sensor, out);
        clip(sensor, out);
    }
    *data.scratch.get() = motion;
    if model.sensors.iter().any(|s| matches!(s.kind, SensorKind::PotentialEnergy | SensorKind::KineticEnergy)) {
        let energy = energy::energy(model, state, data);
        for sensor in &model.sensors {
            match sensor.kind {
                SensorKind::PotentialEnergy => {
                    values[sensor.adr] = energy.potential + energy::potential_of_fixed(model, data);
                }
                SensorKind::KineticEnergy => values[sensor.adr] = energy.kinetic,
                _ => continue,
            }
            clip(sensor, &mut values[sensor.adr..sensor.adr + 1]);
        }
    }
    data.sensordata = values;
}

/// The values of the sensor of that name in the last [`sense`].
pub fn values<'a>(model: &Model, data: &'a Data, name: &str) -> Option<&'a [f64]> {
    let sensor = model.sensors.iter().find(|s| s.name == name)?;
    data.sensordata.get(sensor.adr..sensor.adr + sensor.kind.dim())
}

fn measure(model: &Model, state: &State, data: &Data, motion: &Motion, sensor: &Sensor, out: &mut [f64]) {
    use SensorKind::*;
    match (sensor.kind, sensor.object) {
        (JointPos | JointVel | JointActuatorForce | BallQuat | BallAngVel, Object::Joint(j)) => {
            joints::joint(model, state, data, sensor.kind, j, out);
        }
        (JointLimitPos | JointLimitVel | JointLimitForce, Object::Joint(j)) => {
            out[0] = joints::limit(state, data, sensor.kind, j);
        }
        (TendonPos | TendonVel | TendonActuatorForce, Object::Tendon(t)) => {
            out[0] = joints::tendon(model, data, sensor.kind, t);
        }
        (TendonLimitPos | TendonLimitVel | TendonLimitForce, Object::Tendon(t)) => {
            out[0] = joints::tendon_limit(state, data, sensor.kind, t);
        }
        (ActuatorPos | ActuatorVel | ActuatorForce, Object::Actuator(a)) => {
            out[0] = joints::actuator(model, state, data, sensor.kind, a);
        }
        (FramePos | FrameQuat | FrameXAxis | FrameYAxis | FrameZAxis, object) => {
            frames::pose(model, data, sensor.kind, object, sensor.reference, out);
        }
        (FrameLinVel | FrameAngVel, object) => {
            frames::velocity(model, data, motion, sensor.kind, object, sensor.reference, out);
        }
        (FrameLinAcc | FrameAngAcc | Velocimeter | Gyro | Accelerometer, object) => {
            frames::at_object(model, data, motion, sensor.kind, object, out);
        }
        (Force | Torque, Object::Site(site)) => forces::between(model, data, motion, sensor.kind, site, out),
        (Touch, Object::Site(site)) => out[0] = forces::touch(model, data, site),
        (SubtreeCom | SubtreeLinVel | SubtreeAngMom, Object::Body(body) | Object::Xbody(body)) => {
            subtree::measure(model, data, motion, sensor.kind, body, out);
        }
        (RangeFinder, Object::Site(site)) => out[0] = around::range(model, data, site),
        (Magnetometer, Object::Site(site)) => around::magnetic(model, data, site, out),
        (InsideSite, object) => {
            let Some(Object::Site(site)) = sensor.reference else { return };
            out[0] = around::inside(model, data, object, site);
        }
        (Clock, _) => out[0] = state.time,
        _ => {}
    }
}

fn clip(sensor: &Sensor, values: &mut [f64]) {
    let cutoff = sensor.cutoff;
    if cutoff > 0.0 && sensor.kind.clips() {
        let low = if sensor.kind.positive() { f64::NEG_INFINITY } else { -cutoff };
        values.iter_mut().for_each(|x| *x = x.max(low).min(cutoff));
    }
}
