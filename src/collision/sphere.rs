//! A sphere against spheres, capsules, cylinders and boxes: the nearest point of the other shape.

use super::{Hit, Hits, Placed};
use crate::math::{MIN_VAL, Vec3};

/// Two balls: centre, radius and the axis that decides when the centres coincide.
///
///     d = |c₂ − c₁| − r₁ − r₂,     n = unit(c₂ − c₁),     x = c₁ + n (r₁ + d/2)
///
/// With coinciding centres n is the unit product of the shapes' z axes, or else the world's x axis.
pub(super) fn balls(a: &Placed, c1: &Vec3, r1: f64, b: &Placed, c2: &Vec3, r2: f64, margin: f64) -> Option<Hit> {
    let between = c2 - c1;
    let reach = margin + r1 + r2;
    let len2 = between.norm_squared();
    if len2 > reach * reach {
        return None;
    }
    let len = len2.sqrt();
    let normal = if len >= MIN_VAL {
        between / len
    } else {
        a.axis(2).cross(&b.axis(2)).try_normalize(MIN_VAL).unwrap_or(Vec3::x())
    };
    let dist = len - r1 - r2;
    Some(Hit { dist, pos: c1 + normal * (r1 + 0.5 * dist), normal, tangent: Vec3::zeros(), feature: 0 })
}

fn push(out: &mut Hits, hit: Option<Hit>) {
    if let Some(hit) = hit {
        out.push(hit);
    }
}

pub fn sphere_sphere(a: &Placed, b: &Placed, margin: f64, out: &mut Hits) {
    push(out, balls(a, a.pos, a.size.x, b, b.pos, b.size.x, margin));
}

/// The nearest point of the capsule's segment, as a ball.
pub fn sphere_capsule(sphere: &Placed, capsule: &Placed, margin: f64, out: &mut Hits) {
    let axis = capsule.axis(2);
    let half = capsule.size.y;
    let along = axis.dot(&(sphere.pos - capsule.pos)).clamp(-half, half);
    let nearest = capsule.pos + axis * along;
    push(out, balls(sphere, sphere.pos, sphere.size.x, capsule, &nearest, capsule.size.x, margin));
}

/// Beside the cylinder its axis is a ball of its radius, above or below it a cap is a plane, elsewhere the rim is a
/// point. A centre inside goes out through the nearer of side and cap.
pub fn sphere_cylinder(sphere: &Placed, cylinder: &Placed, margin: f64, out: &mut Hits) {
    let (radius, half) = (cylinder.size.x, cylinder.size.y);
    let r = sphere.size.x;
    let axis = cylinder.axis(2);
    let from = sphere.pos - cylinder.pos;
    let along = axis.dot(&from);
    // Not to the last bit: that is decided below.
    if along.abs() > (half + r + margin) * (1.0 + 1e-12) {
        return;
    }
    let out_of_axis = from - axis * along;
    let beside2 = out_of_axis.norm_squared();
    let (mut side, mut cap) = (along.abs() < half, beside2 < radius * radius);
    if side && cap {
        cap = half - along.abs() < radius - beside2.sqrt();
        side = !cap;
    }
    if side {
        let foot = cylinder.pos + axis * along;
        push(out, balls(sphere, sphere.pos, r, cylinder, &foot, radius, margin));
    } else if cap {
        let up = if along > 0.0 { axis } else { -axis };
        // As MuJoCo rounds it: of things that stand exactly on each other the last bit decides.
        let dist = up.dot(&(sphere.pos - (cylinder.pos + up * half))) - r;
        if dist <= margin {
            let pos = sphere.pos - up * (r + 0.5 * dist);
            out.push(Hit { dist, pos, normal: -up, tangent: Vec3::zeros(), feature: 0 });
        }
    } else {
        let rim = cylinder.pos + axis * half.copysign(along) + out_of_axis * (radius / beside2.sqrt());
        push(out, balls(sphere, sphere.pos, r, cylinder, &rim, 0.0, margin));
    }
}

/// A ball against a box: the nearest point of the box; from inside, out through the nearest face.
///
/// In the box's axes, with centre c and q = c clamped to the box:
///
///     outside:  d = |c − q| − r,     n = unit(q − c),   x midway between q and c + n r
///     inside:   d = −(depth below the nearest face) − r,   n into the box, away from that face
pub(super) fn ball_box(center: &Vec3, r: f64, cuboid: &Placed, margin: f64) -> Option<Hit> {
    let c = cuboid.mat.tr_mul(&(center - cuboid.pos));
    let size = cuboid.size;
    let q = Vec3::new(c.x.clamp(-size.x, size.x), c.y.clamp(-size.y, size.y), c.z.clamp(-size.z, size.z));
    let to_box = q - c;
    let len2 = to_box.norm_squared();
    let reach = margin + r;
    if len2 > reach * reach {
        return None;
    }
    let (n, dist, x) = if len2 > MIN_VAL * MIN_VAL {
        let len = len2.sqrt();
        let n = to_box / len;
        (n, len - r, (q + c + n * r) * 0.5)
    } else {
        let (face, depth) = nearest_face(&c, size);
        let n = Vec3::ith(face / 2, if face % 2 == 0 { 1.0 } else { -1.0 });
        (n, -depth - r, c + n * (0.5 * (r - depth)))
    };
    let pos = cuboid.pos + cuboid.mat * x;
    Some(Hit { dist, pos, normal: cuboid.mat * n, tangent: Vec3::zeros(), feature: 0 })
}

/// The face nearest to a point inside the box, of −x +x −y +y −z +z the first, and how far it is.
fn nearest_face(c: &Vec3, size: &Vec3) -> (usize, f64) {
    let mut best = (0, f64::INFINITY);
    for face in 0..6 {
        let i = face / 2;
        let depth = if face % 2 == 0 { size[i] + c[i] } else { size[i] - c[i] };
        if depth.abs() < best.1 {
            best = (face, depth.abs());
        }
    }
    best
}

pub fn sphere_box(sphere: &Placed, cuboid: &Placed, margin: f64, out: &mut Hits) {
    push(out, ball_box(sphere.pos, sphere.size.x, cuboid, margin));
}
