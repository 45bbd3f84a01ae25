//! What a body's parent exerts on it, and what touches it.

use super::frames::frame;
use super::motion::Motion;
use crate::collision::ray;
use crate::data::Data;
use crate::dynamics::spatial::{ang, lin};
use crate::kind::SensorKind;
use crate::model::{Model, Object};

/// Force (N) or torque about the site (N m) that the parent exerts on the site's body and all that hangs on it, in the
/// site's axes.
pub fn between(model: &Model, data: &Data, motion: &Motion, kind: SensorKind, site: usize, out: &mut [f64]) {
    let (body, pos, axes) = frame(model, data, Object::Site(site));
    let wrench = &motion.force[body];
    let exerted = match kind {
        SensorKind::Force => lin(wrench),
        _ => ang(wrench) - (pos - motion.origin[body]).cross(&lin(wrench)),
    };
    out.copy_from_slice(axes.tr_mul(&exerted).as_slice());
}

/// Sum of the normal forces (N) of contacts of the site's body that are within the site, or whose normal meets it.
pub fn touch(model: &Model, data: &Data, site: usize) -> f64 {
    let (body, pos, axes) = frame(model, data, Object::Site(site));
    let Some(kind) = model.sites[site].kind else { return 0.0 };
    let size = &model.sites[site].size;
    let mut sum = 0.0;
    for contact in data.contacts.iter().filter(|c| c.force[0] > 0.0) {
        let bodies = contact.geom.map(|g| model.geoms[g as usize].body);
        if !bodies.contains(&body) {
            continue;
        }
        let normal = contact.frame.row(0).transpose();
        let ray = if bodies[1] == body { -normal } else { normal };
        if ray::distance(kind, size, &pos, &axes, &contact.pos, &ray).is_some() {
            sum += contact.force[0];
        }
    }
    sum
}
