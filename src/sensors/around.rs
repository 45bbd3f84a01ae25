//! What is around a site.

use super::frames::{frame, place};
use crate::collision::ray;
use crate::data::Data;
use crate::model::{Model, Object};

/// Distance (m) from a site along its z axis to the next geom of another body that is not quite transparent; −1 if there
/// is none.
pub fn range(model: &Model, data: &Data, site: usize) -> f64 {
    let (body, origin, axes) = frame(model, data, Object::Site(site));
    let direction = axes.column(2).into_owned();
    let met = |(g, geom): (usize, &crate::model::Geom)| {
        let (_, pos, mat) = frame(model, data, Object::Geom(g));
        ray::distance(geom.kind, &geom.size, &pos, &mat, &origin, &direction)
    };
    let seen = |(_, geom): &(usize, &crate::model::Geom)| geom.body != body && geom.rgba[3] != 0.0;
    model.geoms.iter().enumerate().filter(seen).filter_map(met).min_by(f64::total_cmp).unwrap_or(-1.0)
}

/// `<option magnetic>` in the site's axes, T.
pub fn magnetic(model: &Model, data: &Data, site: usize, out: &mut [f64]) {
    let (_, _, axes) = frame(model, data, Object::Site(site));
    out.copy_from_slice(axes.tr_mul(&model.opt.magnetic).as_slice());
}

/// 1 if the object's origin is within the site, otherwise 0.
pub fn inside(model: &Model, data: &Data, object: Object, site: usize) -> f64 {
    let (_, point, _) = place(model, data, object);
    let (_, pos, axes) = frame(model, data, Object::Site(site));
    let site = &model.sites[site];
    let inside = site.kind.is_some_and(|kind| ray::inside(kind, &site.size, &pos, &axes, &point));
    f64::from(u8::from(inside))
}
