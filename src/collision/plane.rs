//! A plane against everything else. It is a half-space: size does not limit it, and its inside is below.
//!
//! In all formulas n is the plane's z axis, p a point in it, c the other shape's centre, and h = n·(c − p).
//! A point of the other shape at height d above the plane touches at d, midway: shifted by −n d/2.

use super::{Hit, Hits, Placed};
use crate::math::{MIN_VAL, Vec3};

/// The point `x` of a shape, at height `dist` above a plane with normal n.
fn hit(x: Vec3, normal: &Vec3, dist: f64, feature: u32) -> Hit {
    Hit { dist, pos: x - normal * (0.5 * dist), normal: *normal, tangent: Vec3::zeros(), feature }
}

/// d = h − r, at c − n r.
pub fn plane_sphere(plane: &Placed, sphere: &Placed, margin: f64, out: &mut Hits) {
    let n = plane.axis(2);
    let r = sphere.size.x;
    let dist = n.dot(&(sphere.pos - plane.pos)) - r;
    if dist <= margin {
        out.push(hit(sphere.pos - n * r, &n, dist, 0));
    }
}

/// A sphere at each end, +axis first. The first tangent follows the capsule's axis.
///
/// Feature: 0 for the +axis end, 1 for the other.
pub fn plane_capsule(plane: &Placed, capsule: &Placed, margin: f64, out: &mut Hits) {
    let n = plane.axis(2);
    let axis = capsule.axis(2);
    let (r, half) = (capsule.size.x, axis * capsule.size.y);
    let h = n.dot(&(capsule.pos - plane.pos)) - r;
    let rise = n.dot(&half);
    for (feature, sign) in [(0, 1.0), (1, -1.0)] {
        let dist = h + sign * rise;
        if dist <= margin {
            let end = capsule.pos + half * sign - n * r;
            out.push(Hit { tangent: axis, ..hit(end, &n, dist, feature) });
        }
    }
}

/// The lowest point of an ellipsoid with half-sizes S = diag(size), m being −n in its own axes:
///
///     x = c + R S² m / |S m|,     d = h − |S m|
pub fn plane_ellipsoid(plane: &Placed, ellipsoid: &Placed, margin: f64, out: &mut Hits) {
    let n = plane.axis(2);
    let scaled = -ellipsoid.mat.tr_mul(&n).component_mul(ellipsoid.size);
    let depth = scaled.norm();
    let dist = n.dot(&(ellipsoid.pos - plane.pos)) - depth;
    if dist <= margin {
        let lowest = ellipsoid.mat * ellipsoid.size.component_mul(&scaled) / depth;
        out.push(hit(ellipsoid.pos + lowest, &n, dist, 0));
    }
}

/// Up to four points: the lowest point of the disc nearer to the plane, the lowest of the other disc, and two
/// that make an equilateral triangle with the first, so that a coin can lie flat.
///
///     a = half axis, turned towards the plane        u = radius along −n, orthogonal to the axis
///     x₁ = c + a + u,   x₂ = c − a + u,   x₃,₄ = c + a − u/2 ± w,   w = (√3/2) r unit(u × a)
///
/// Without x₁ there is no contact. Feature: bit 0 is the disc (0 at +axis), the rest 0 for the lowest point, 1 and
/// 2 for the other two.
pub fn plane_cylinder(plane: &Placed, cylinder: &Placed, margin: f64, out: &mut Hits) {
    let n = plane.axis(2);
    let (r, half) = (cylinder.size.x, cylinder.size.y);
    let mut axis = cylinder.axis(2);
    let mut slope = n.dot(&axis);
    let near = u32::from(slope > 0.0);
    if near == 1 {
        axis = -axis;
        slope = -slope;
    }
    let h = n.dot(&(cylinder.pos - plane.pos));
    let down = axis * slope - n;
    let len2 = down.norm_squared();
    // A disc exactly parallel to the plane has no lowest point: then any will do.
    let (u, fall) = if len2 >= MIN_VAL * MIN_VAL {
        let scale = r / len2.sqrt();
        (down * scale, scale * len2)
    } else {
        (cylinder.axis(0) * r, 0.0)
    };
    let rise = slope * half;
    if h + rise - fall > margin {
        return;
    }
    let a = axis * half;
    out.push(hit(cylinder.pos + a + u, &n, h + rise - fall, near));
    if h - rise - fall <= margin {
        out.push(hit(cylinder.pos - a + u, &n, h - rise - fall, near ^ 1));
    }
    let dist = h + rise + 0.5 * fall;
    if dist <= margin {
        // u and the axis are orthogonal, so their product has length r.
        let w = u.cross(&axis) * (0.75f64.sqrt());
        let foot = cylinder.pos + a - u * 0.5;
        out.push(hit(foot + w, &n, dist, 2 + near));
        out.push(hit(foot - w, &n, dist, 4 + near));
    }
}

/// The corners below the centre and nearer than the margin, in index order (bit 0 is x, 1 is y, 2 is z), at most
/// four. Feature: the corner's index.
pub fn plane_box(plane: &Placed, cuboid: &Placed, margin: f64, out: &mut Hits) {
    let n = plane.axis(2);
    let h = n.dot(&(cuboid.pos - plane.pos));
    let edge = [0, 1, 2].map(|i| cuboid.axis(i) * cuboid.size[i]);
    let rise = edge.map(|e| n.dot(&e));
    if h - rise[0].abs() - rise[1].abs() - rise[2].abs() > margin {
        return;
    }
    // Height above the centre, and place, of the middles of the four edges along z; half of z leads to their ends.
    let [x, y, z] = edge;
    let [left, right] = [cuboid.pos - x, cuboid.pos + x];
    let middle = [left - y, right - y, left + y, right + y];
    let rises = [-rise[0] - rise[1], rise[0] - rise[1], -rise[0] + rise[1], rise[0] + rise[1]];
    let up: [f64; 8] = std::array::from_fn(|c| if c < 4 { rises[c] - rise[2] } else { rises[c - 4] + rise[2] });
    let low = (0..).zip(up).filter(|(_, up)| (*up <= 0.0) & (h + up <= margin));
    for (corner, up) in low.take(4) {
        let end = middle[corner as usize % 4];
        out.push(hit(if corner < 4 { end - z } else { end + z }, &n, h + up, corner));
    }
}
