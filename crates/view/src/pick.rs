//! What is under the mouse.

use super::camera::Camera;
use super::session::Poses;
use penny::math::{self, Vec3};
use penny::model::{Geom, GeomKind, Model};

/// A point of a moving body that a ray meets.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    pub body: usize,
    /// World, m.
    pub point: Vec3,
}

/// The first moving body on the ray through a pixel.
pub fn pick(model: &Model, poses: &Poses, camera: &Camera, pixel: [f64; 2], size: [f64; 2]) -> Option<Hit> {
    let (origin, direction) = camera.ray(pixel, size);
    let hit = |geom: &Geom| {
        let (p, q) = (poses.pos[geom.body], poses.quat[geom.body]);
        let turn = math::mat(&(q * geom.quat)).transpose();
        let (o, d) = (turn * (origin - p - q * geom.pos), turn * direction);
        march(geom, &o, &d).map(|t| (t, geom.body))
    };
    let moving = model.geoms.iter().filter(|g| model.bodies[g.body].tree.is_some());
    let (t, body) = moving.filter_map(hit).min_by(|a, b| a.0.total_cmp(&b.0))?;
    let body = model.bodies[body].weld;
    Some(Hit { body, point: origin + direction * t })
}

/// Distance along a ray to a geom, in the geom's frame: steps as long as the way is surely free (sphere tracing).
fn march(geom: &Geom, origin: &Vec3, direction: &Vec3) -> Option<f64> {
    let close = 1e-3 * geom.rbound.max(1e-6);
    // Start where the ray enters the bounding sphere.
    let b = origin.dot(direction);
    let inside = b * b - origin.norm_squared() + (1.05 * geom.rbound).powi(2);
    if inside < 0.0 {
        return None;
    }
    let (mut t, end) = ((-b - inside.sqrt()).max(0.0), -b + inside.sqrt());
    for _ in 0..96 {
        let free = distance(geom, &(origin + direction * t));
        if free < close {
            return Some(t);
        }
        t += free;
        if t > end {
            break;
        }
    }
    None
}

/// Distance from a point to a geom's surface, in its frame; at most the true one. m.
fn distance(geom: &Geom, p: &Vec3) -> f64 {
    let size = &geom.size;
    match geom.kind {
        GeomKind::Plane => f64::MAX,
        GeomKind::Sphere => p.norm() - size.x,
        GeomKind::Capsule => (p - Vec3::new(0.0, 0.0, p.z.clamp(-size.y, size.y))).norm() - size.x,
        GeomKind::Ellipsoid => (p.component_div(size).norm() - 1.0) * size.min(),
        GeomKind::Cylinder => {
            let (side, end) = (p.xy().norm() - size.x, p.z.abs() - size.y);
            side.max(end).min(0.0) + side.max(0.0).hypot(end.max(0.0))
        }
        GeomKind::Box => {
            let out = p.abs() - size;
            out.max().min(0.0) + out.map(|x| x.max(0.0)).norm()
        }
    }
}
