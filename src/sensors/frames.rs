//! Poses, velocities and accelerations of bodies, geoms and sites.

use super::motion::Motion;
use crate::data::Data;
use crate::kind::SensorKind;
use crate::math::{Mat3, Quat, Vec3, mat, wxyz};
use crate::model::{Model, Object};

/// Where an object is: its body, its origin (m), its orientation. World.
pub fn place(model: &Model, data: &Data, object: Object) -> (usize, Vec3, Quat) {
    let (body, pos, quat) = match object {
        Object::Body(b) => (b, model.bodies[b].ipos, model.bodies[b].iquat),
        Object::Geom(g) => (model.geoms[g].body, model.geoms[g].pos, model.geoms[g].quat),
        Object::Site(s) => (model.sites[s].body, model.sites[s].pos, model.sites[s].quat),
        Object::Xbody(b) => (b, Vec3::zeros(), Quat::identity()),
        Object::Joint(_) | Object::Actuator(_) | Object::Tendon(_) | Object::World => {
            (0, Vec3::zeros(), Quat::identity())
        }
    };
    (body, data.xpos[body] + data.xmat[body] * pos, data.xquat[body] * quat)
}

/// The same with a rotation matrix.
pub fn frame(model: &Model, data: &Data, object: Object) -> (usize, Vec3, Mat3) {
    let (body, pos, quat) = place(model, data, object);
    (body, pos, mat(&quat))
}

/// Position, orientation or an axis of an object, as seen from the reference.
///
///     Rᵣᵀ (x − xᵣ),   qᵣ⁻¹ q,   Rᵣᵀ axis
pub fn pose(model: &Model, data: &Data, kind: SensorKind, object: Object, reference: Option<Object>, out: &mut [f64]) {
    let (_, pos, quat) = place(model, data, object);
    let (_, ref_pos, ref_quat) = place(model, data, reference.unwrap_or(Object::World));
    let axis = |i: usize| mat(&ref_quat).tr_mul(&mat(&quat).column(i).into_owned());
    let seen = match kind {
        SensorKind::FrameQuat => return out.copy_from_slice(&wxyz(&(ref_quat.inverse() * quat))),
        SensorKind::FramePos => mat(&ref_quat).tr_mul(&(pos - ref_pos)),
        SensorKind::FrameXAxis => axis(0),
        SensorKind::FrameYAxis => axis(1),
        _ => axis(2),
    };
    out.copy_from_slice(seen.as_slice());
}

/// Velocity of an object as seen from the reference, which may turn.
///
///     Rᵣᵀ (v − vᵣ − ωᵣ × (x − xᵣ)),   Rᵣᵀ (ω − ωᵣ)
pub fn velocity(
    model: &Model,
    data: &Data,
    motion: &Motion,
    kind: SensorKind,
    object: Object,
    reference: Option<Object>,
    out: &mut [f64],
) {
    let (body, pos, _) = place(model, data, object);
    let (v, w) = motion.velocity_at(body, &pos);
    let (ref_body, ref_pos, axes) = frame(model, data, reference.unwrap_or(Object::World));
    let (ref_v, ref_w) = motion.velocity_at(ref_body, &ref_pos);
    let seen = match kind {
        SensorKind::FrameLinVel => v - ref_v - ref_w.cross(&(pos - ref_pos)),
        _ => w - ref_w,
    };
    out.copy_from_slice(axes.tr_mul(&seen).as_slice());
}

/// Accelerations less gravity in world axes; of a site also velocities and acceleration in its own.
pub fn at_object(model: &Model, data: &Data, motion: &Motion, kind: SensorKind, object: Object, out: &mut [f64]) {
    let (body, pos, axes) = frame(model, data, object);
    let measured = match kind {
        SensorKind::FrameLinAcc => motion.acceleration_at(body, &pos).0,
        SensorKind::FrameAngAcc => motion.acceleration_at(body, &pos).1,
        SensorKind::Velocimeter => axes.tr_mul(&motion.velocity_at(body, &pos).0),
        SensorKind::Gyro => axes.tr_mul(&motion.velocity_at(body, &pos).1),
        _ => axes.tr_mul(&motion.acceleration_at(body, &pos).0),
    };
    out.copy_from_slice(measured.as_slice());
}
