//! The shortest way of a string round a sphere or a cylinder, or through it.
//!
//! Everything happens in a plane: of a sphere the one through its centre and both ends, of a cylinder the one across its
//! axis, along which the string climbs evenly. In the plane, with the centre as origin and r the radius,
//!
//!     w   angle that the string turns about the centre: from d₀ to d₁, or with a side point s from d₀ to s and on to d₁
//!     φ   angle to where it leaves or meets the circle, cos φᵢ = r/|dᵢ|
//!     it touches the circle where |w| > φ₀ + φ₁, along an arc r (|w| − φ₀ − φ₁); otherwise it is straight
//!
//! With s the string goes the way of the polyline d₀ s d₁: it has the same winding about the centre. With s inside the
//! shape the string has to pass through the shape: it is straight where that does, else it touches the circle in one point,
//! where it is shortest.
//!
//! Source: MuJoCo 4.0 manual, XML reference › tendon › spatial › geom; lengths agree with 4.0.0 to rounding. MuJoCo's points
//! of strings inside are themselves 3e-7 of the radius off.

use crate::math::{MIN_VAL, Mat3, Vec3};

/// What a string meets: a frame, and the radius of the ball or of the cylinder along z.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    pub pos: Vec3,
    pub axes: Mat3,
    pub radius: f64,
    pub cylinder: bool,
}

/// Where a string touches a shape, and how long it lies on it (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    pub points: [Vec3; 2],
    pub length: f64,
}

type Vec2 = nalgebra::Vector2<f64>;

/// The way from one end to the other; `None` if it is straight. World, m.
pub fn wrap(shape: &Shape, ends: [Vec3; 2], side: Option<Vec3>) -> Option<Touch> {
    let local = |p: &Vec3| shape.axes.tr_mul(&(p - shape.pos));
    let [p0, p1] = ends.map(|p| local(&p));
    if p0.norm() < MIN_VAL || p1.norm() < MIN_VAL || shape.radius < MIN_VAL {
        return None;
    }
    let [x, y] = if shape.cylinder { [Vec3::x(), Vec3::y()] } else { plane(&p0, &p1) };
    let flat = |p: &Vec3| Vec2::new(p.dot(&x), p.dot(&y));
    let [d0, d1] = [flat(&p0), flat(&p1)];
    let side = side.map(|s| local(&s));
    let (arc, t0, t1) = match side {
        Some(s) if s.norm() < shape.radius => inside(&d0, &d1, shape.radius)?,
        _ => around(&d0, &d1, side.as_ref().map(flat), shape.radius)?,
    };
    let mut points = [t0, t1].map(|t| x * t.x + y * t.y);
    let mut length = arc;
    if shape.cylinder {
        let (first, last) = ((d0 - t0).norm(), (d1 - t1).norm());
        let climb = (p1.z - p0.z) / (first + arc + last);
        points[0].z = p0.z + climb * first;
        points[1].z = p0.z + climb * (first + arc);
        length = arc.hypot(climb * arc);
    }
    Some(Touch { points: points.map(|p| shape.pos + shape.axes * p), length })
}

/// Two axes of the plane through the origin and both points; any plane where they are in line with it.
fn plane(p0: &Vec3, p1: &Vec3) -> [Vec3; 2] {
    let x = p0.normalize();
    let mut normal = p0.cross(p1);
    if normal.norm() < MIN_VAL {
        let mut across = Vec3::repeat(1.0);
        across[x.iamax()] = 0.0;
        normal = x.cross(&across);
    }
    [x, normal.cross(&x).normalize()]
}

/// Angle from a to b, within half a turn.
fn angle(a: &Vec2, b: &Vec2) -> f64 {
    a.perp(b).atan2(a.dot(b))
}

/// r times the direction of v, turned by an angle.
fn turned(v: &Vec2, by: f64, r: f64) -> Vec2 {
    let (v, (sin, cos)) = (v * (r / v.norm()), by.sin_cos());
    Vec2::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y)
}

/// Length of the arc, and its ends.
fn around(d0: &Vec2, d1: &Vec2, side: Option<Vec2>, r: f64) -> Option<(f64, Vec2, Vec2)> {
    if d0.norm() < r || d1.norm() < r {
        return None;
    }
    let turn = match side {
        Some(s) => angle(d0, &s) + angle(&s, d1),
        None => angle(d0, d1),
    };
    let [leave, meet] = [d0, d1].map(|d| (d.norm_squared() - r * r).sqrt().atan2(r));
    let arc = turn.abs() - leave - meet;
    (arc > 0.0).then(|| (r * arc, turned(d0, leave.copysign(turn), r), turned(d1, (-meet).copysign(-turn), r)))
}

/// The point of the circle over which the way from outside to outside is shortest, where the straight one passes by.
///
///     f(φ) = −u₀·t − u₁·t = 0        t tangent at φ, u unit vectors from the point to the ends; f grows from d₀ to d₁
fn inside(d0: &Vec2, d1: &Vec2, r: f64) -> Option<(f64, Vec2, Vec2)> {
    if d0.norm() <= r || d1.norm() <= r {
        return None;
    }
    let along = d1 - d0;
    let share = -along.dot(d0) / along.norm_squared();
    if share > 0.0 && share < 1.0 && (d0 + along * share).norm() <= r {
        return None;
    }
    let total = angle(d0, d1);
    let at = |phi: f64| turned(d0, phi.copysign(total), r);
    let slope = |phi: f64| {
        let p = at(phi);
        let t = Vec2::new(-p.y, p.x).normalize() * total.signum();
        [d0, d1].map(|d| -(d - p).normalize().dot(&t)).iter().sum::<f64>()
    };
    // Halving to the last digit: it has no cases, and few scenes have such a string.
    let (mut low, mut high) = (0.0, total.abs());
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            let p = at(middle);
            return Some((0.0, p, p));
        }
        if slope(middle) < 0.0 { low = middle } else { high = middle }
    }
}
