//! Rays: how far along one a shape's surface is, and whether a point is within a shape.
//!
//! Source: MuJoCo 4.0 manual, API reference › Ray casting; checked by running MuJoCo 4.0.0.

use crate::math::{MIN_VAL, Mat3, Vec3};
use crate::model::GeomKind;

/// Distance along a ray to the first point of a shape's surface, in units of the direction's length: the least t ≥ 0 with
/// `origin` + t `direction` on the surface. From inside, the surface is met as well.
///
/// A plane is met on its front only, within its half-sizes where these are above zero.
/// In: `size` as in [`Geom::size`](crate::model::Geom::size), pose of the shape, all in the world, m.
pub fn distance(kind: GeomKind, size: &Vec3, pos: &Vec3, mat: &Mat3, origin: &Vec3, direction: &Vec3) -> Option<f64> {
    own(kind, size, &mat.tr_mul(&(origin - pos)), &mat.tr_mul(direction))
}

/// The same for a ray from `p` along `v` in the shape's own frame.
pub fn own(kind: GeomKind, size: &Vec3, p: &Vec3, v: &Vec3) -> Option<f64> {
    match kind {
        GeomKind::Plane => plane(size, p, v),
        GeomKind::Sphere => first(roots(v, p, size.x * size.x)),
        GeomKind::Capsule => capsule(size, p, v),
        GeomKind::Ellipsoid => first(roots(&v.component_div(size), &p.component_div(size), 1.0)),
        GeomKind::Cylinder => cylinder(size, p, v),
        GeomKind::Box => faces(size, p, v),
    }
}

/// The two t, in order, at which |p + t v|² = `square`; none where the line passes by.
fn roots(v: &Vec3, p: &Vec3, square: f64) -> Option<[f64; 2]> {
    quadratic(v.norm_squared(), v.dot(p), p.norm_squared() - square)
}

/// The solutions of a t² + 2 b t + c = 0, in order.
fn quadratic(a: f64, b: f64, c: f64) -> Option<[f64; 2]> {
    let square = b * b - a * c;
    if square < MIN_VAL || a < MIN_VAL {
        return None;
    }
    let root = square.sqrt();
    Some([(-b - root) / a, (-b + root) / a])
}

fn first(roots: Option<[f64; 2]>) -> Option<f64> {
    roots?.into_iter().find(|t| *t >= 0.0)
}

fn least(found: impl Iterator<Item = f64>) -> Option<f64> {
    found.filter(|t| *t >= 0.0).min_by(f64::total_cmp)
}

fn plane(size: &Vec3, p: &Vec3, v: &Vec3) -> Option<f64> {
    if v.z > -MIN_VAL {
        return None;
    }
    let t = -p.z / v.z;
    let within = |i: usize| size[i] <= 0.0 || (p[i] + t * v[i]).abs() <= size[i];
    (t >= 0.0 && within(0) && within(1)).then_some(t)
}

/// The round side of a capsule or cylinder: x² + y² = r² where |z| ≤ half-length.
fn side(size: &Vec3, p: &Vec3, v: &Vec3) -> impl Iterator<Item = f64> {
    let a = v.x * v.x + v.y * v.y;
    let b = v.x * p.x + v.y * p.y;
    let c = p.x * p.x + p.y * p.y - size.x * size.x;
    let (z, slope, half) = (p.z, v.z, size.y);
    quadratic(a, b, c).into_iter().flatten().filter(move |t| (z + t * slope).abs() <= half)
}

fn capsule(size: &Vec3, p: &Vec3, v: &Vec3) -> Option<f64> {
    let caps = [1.0, -1.0].into_iter().flat_map(|end| {
        let centre = Vec3::new(0.0, 0.0, end * size.y);
        let beyond = move |t: &f64| end * (p.z + t * v.z) >= size.y;
        roots(v, &(p - centre), size.x * size.x).into_iter().flatten().filter(beyond)
    });
    least(side(size, p, v).chain(caps))
}

fn cylinder(size: &Vec3, p: &Vec3, v: &Vec3) -> Option<f64> {
    let discs = [-1.0, 1.0].into_iter().filter_map(|end| {
        let t = (v.z.abs() > MIN_VAL).then(|| (end * size.y - p.z) / v.z)?;
        let (x, y) = (p.x + t * v.x, p.y + t * v.y);
        (x * x + y * y <= size.x * size.x).then_some(t)
    });
    least(side(size, p, v).chain(discs))
}

fn faces(size: &Vec3, p: &Vec3, v: &Vec3) -> Option<f64> {
    let met = (0..3).filter(|&i| v[i].abs() > MIN_VAL).flat_map(|i| {
        [-1.0, 1.0].into_iter().filter_map(move |end| {
            let t = (end * size[i] - p[i]) / v[i];
            let within = |j: usize| (p[j] + t * v[j]).abs() <= size[j];
            (within((i + 1) % 3) && within((i + 2) % 3)).then_some(t)
        })
    });
    least(met)
}

/// Whether a point (world, m) is within a shape.
pub fn inside(kind: GeomKind, size: &Vec3, pos: &Vec3, mat: &Mat3, point: &Vec3) -> bool {
    let p = mat.tr_mul(&(point - pos));
    match kind {
        GeomKind::Plane => p.z < 0.0,
        GeomKind::Sphere => p.norm() < size.x,
        GeomKind::Capsule => (p - Vec3::new(0.0, 0.0, p.z.clamp(-size.y, size.y))).norm() < size.x,
        GeomKind::Ellipsoid => p.component_div(size).norm() < 1.0,
        GeomKind::Cylinder => p.z.abs() < size.y && p.x.hypot(p.y) < size.x,
        GeomKind::Box => (0..3).all(|i| p[i].abs() < size[i]),
    }
}
