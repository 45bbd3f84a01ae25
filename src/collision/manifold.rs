//! Contact manifolds of convex shapes: the faces and edges that face each other, and the points that stand for where
//! they overlap.

use super::convex::Core;
use super::{Hit, Hits};
use crate::math::Vec3;
use crate::model::GeomKind;

type Vec2 = nalgebra::Vector2<f64>;

/// Parts within this angle of facing each other are compared (sine; 8°). Points above the margin drop out by
/// themselves, so the angle only has to be larger than what a resting body leans by.
const TILT: f64 = 0.14;
/// sin² of the angle within which two round sides count as parallel and touch in two points, as two capsules do
/// ([`super::capsule`]). MuJoCo has one point for them even where they are parallel, anywhere along them.
const PARALLEL: f64 = 1e-8;

/// A cap that leans by less than this (sine) lies flat.
const FLAT: f64 = 1e-6;
/// cos and sin of 22.5°.
const RIM: [f64; 2] = [0.923_879_532_511_286_7, 0.382_683_432_365_089_8];

/// The feature of a shape that faces a direction.
pub(super) enum Facing {
    /// Round or pointed: touches in one point.
    Point,
    /// An edge of a box, or the line along a capsule's or cylinder's side.
    Edge(Vec3, Vec3),
    /// Corners of a box's face, in a cycle.
    Quad([Vec3; 4]),
    /// Centre and radius of a cylinder's cap, and four points of its rim: the one furthest along the direction first;
    /// where the cap is flat, MuJoCo's.
    Disc(Vec3, f64, [Vec3; 4]),
}

impl Facing {
    /// The feature of a shape centred at `center` that faces the unit direction `d`.
    pub fn new(core: &Core, center: &Vec3, d: &Vec3) -> Facing {
        let (size, mat) = (core.shape.size, core.shape.mat);
        let l = mat.tr_mul(d);
        let world = |local: Vec3| center + mat * local;
        let flat = |k: usize| l[k] * l[k] > 1.0 - TILT * TILT;
        match core.kind {
            GeomKind::Capsule if l.z.abs() < TILT => {
                let side = d * core.radius;
                let end = core.shape.axis(2) * size.y;
                Facing::Edge(center - end + side, center + end + side)
            }
            GeomKind::Cylinder if flat(2) => {
                let z = size.y.copysign(l.z);
                // Flat, the furthest point is noise. MuJoCo's cap has 16 corners, of which it keeps four; of equally
                // good squares mostly this one, in the cylinder's own axes.
                let lean = Vec2::new(l.x, l.y);
                let u = if lean.norm() > FLAT { lean.normalize() } else { Vec2::new(-RIM[0], -RIM[1] * z.signum()) };
                let turn = if lean.norm() > FLAT { 1.0 } else { z.signum() };
                let u = u * size.x;
                let rim = [(u.x, u.y), (-u.y * turn, u.x * turn), (-u.x, -u.y), (u.y * turn, -u.x * turn)];
                Facing::Disc(world(Vec3::new(0.0, 0.0, z)), size.x, rim.map(|(x, y)| world(Vec3::new(x, y, z))))
            }
            GeomKind::Cylinder if l.z.abs() < TILT => {
                let side = Vec2::new(l.x, l.y).normalize() * size.x;
                Facing::Edge(world(Vec3::new(side.x, side.y, -size.y)), world(Vec3::new(side.x, side.y, size.y)))
            }
            GeomKind::Box => {
                let corner = Vec3::from_fn(|k, _| size[k].copysign(l[k]));
                let at = |flips: &[usize]| {
                    let mut c = corner;
                    flips.iter().for_each(|&k| c[k] = -c[k]);
                    world(c)
                };
                if let Some(k) = (0..3).find(|&k| flat(k)) {
                    let (i, j) = ((k + 1) % 3, (k + 2) % 3);
                    return Facing::Quad([at(&[]), at(&[i]), at(&[i, j]), at(&[j])]);
                }
                match (0..3).find(|&k| l[k].abs() < TILT) {
                    Some(k) => Facing::Edge(at(&[]), at(&[k])),
                    None => Facing::Point,
                }
            }
            _ => Facing::Point,
        }
    }

    /// Adds the points where two features overlap, seen along n, and returns the smallest distance among them: infinite
    /// if they touch in a point at most.
    ///
    /// Numbered: points of the first 0–3, of the second 4–7, where their borders cross 8 and up.
    pub fn overlap(facing: &[Facing; 2], n: &Vec3, margin: f64, out: &mut Hits) -> f64 {
        let before = out.as_slice().len();
        let view = View::new(facing, n, margin);
        match facing {
            [Facing::Point, _] | [_, Facing::Point] => {}
            [Facing::Edge(a, b), Facing::Edge(c, d)] => view.side_by_side([a, b, c, d], out),
            [Facing::Edge(a, b), face] => view.on_face([a, b], face, 0, out),
            [face, Facing::Edge(a, b)] => view.on_face([a, b], face, 4, out),
            [a, b] => view.faces(a, b, out),
        }
        out.as_slice()[before..].iter().map(|hit| hit.dist).fold(f64::INFINITY, f64::min)
    }

    fn points(&self) -> &[Vec3] {
        match self {
            Facing::Quad(corners) => corners,
            Facing::Disc(_, _, rim) => rim,
            _ => &[],
        }
    }
}

/// Two features seen along the normal: positions in the plane across it, heights along it.
struct View<'a> {
    facing: &'a [Facing; 2],
    normal: &'a Vec3,
    /// Axes of the plane.
    axes: [Vec3; 2],
    margin: f64,
}

impl View<'_> {
    fn new<'a>(facing: &'a [Facing; 2], normal: &'a Vec3, margin: f64) -> View<'a> {
        let x = normal.cross(&Vec3::ith(normal.iamin(), 1.0)).normalize();
        View { facing, normal, axes: [x, normal.cross(&x)], margin }
    }

    fn flat(&self, p: &Vec3) -> Vec2 {
        Vec2::new(self.axes[0].dot(p), self.axes[1].dot(p))
    }

    /// Height of a feature at a place of the plane: that of its plane, or of its line at the nearest point.
    fn height(&self, feature: &Facing, at: &Vec2) -> f64 {
        let (p, along) = match feature {
            Facing::Point => return 0.0,
            Facing::Edge(a, b) => {
                let (from, to) = (self.flat(a), self.flat(b) - self.flat(a));
                let t = to.dot(&(at - from)) / to.norm_squared().max(f64::MIN_POSITIVE);
                return self.normal.dot(a) + t * self.normal.dot(&(b - a));
            }
            Facing::Quad(c) => (c[0], (c[1] - c[0]).cross(&(c[3] - c[0]))),
            Facing::Disc(center, _, rim) => (*center, (rim[0] - center).cross(&(rim[1] - center))),
        };
        let d = at - self.flat(&p);
        let slope = self.flat(&along) / along.dot(self.normal);
        self.normal.dot(&p) - slope.dot(&d)
    }

    /// The point of a feature's plane at a place.
    fn lift(&self, feature: &Facing, at: &Vec2) -> Vec3 {
        self.axes[0] * at.x + self.axes[1] * at.y + self.normal * self.height(feature, at)
    }

    fn push(&self, at: &Vec2, feature: u32, out: &mut Hits) {
        let [low, high] = [0, 1].map(|k| self.height(&self.facing[k], at));
        let dist = high - low;
        if dist <= self.margin {
            let pos = self.axes[0] * at.x + self.axes[1] * at.y + self.normal * (0.5 * (low + high));
            out.push(Hit { dist, pos, normal: *self.normal, tangent: Vec3::zeros(), feature });
        }
    }

    /// Two edges: the ends of the stretch where they lie side by side, if they are parallel.
    fn side_by_side(&self, [a, b, c, d]: [&Vec3; 4], out: &mut Hits) {
        let (along, other) = (b - a, d - c);
        if along.cross(&other).norm_squared() > PARALLEL * along.norm_squared() * other.norm_squared() {
            return;
        }
        let from = self.flat(a);
        let along = self.flat(b) - from;
        let length2 = along.norm_squared();
        let place = |p: &Vec3| along.dot(&(self.flat(p) - from)) / length2;
        let (c, d) = (place(c), place(d));
        let (low, high) = (c.min(d).max(0.0), c.max(d).min(1.0));
        if low < high {
            self.push(&(from + along * low), 0, out);
            self.push(&(from + along * high), 1, out);
        }
    }

    /// An edge over a face: the ends of what is over it.
    fn on_face(&self, ends: [&Vec3; 2], face: &Facing, feature: u32, out: &mut Hits) {
        let [from, to] = ends.map(|p| self.flat(p));
        if let Some((low, high)) = self.clip(&from, &to, face) {
            self.push(&(from + (to - from) * low), feature, out);
            self.push(&(from + (to - from) * high), feature + 1, out);
        }
    }

    /// The part of an edge over a face, as parameters from 0 to 1.
    fn clip(&self, from: &Vec2, to: &Vec2, face: &Facing) -> Option<(f64, f64)> {
        let along = to - from;
        let (mut low, mut high) = (0.0f64, 1.0f64);
        match face {
            Facing::Quad(corners) => {
                let c = corners.map(|p| self.flat(&p));
                let turn = (c[1] - c[0]).perp(&(c[3] - c[0])).signum();
                for k in 0..4 {
                    // Inside is where turn · edge × (p − corner) ≥ 0.
                    let edge = (c[(k + 1) % 4] - c[k]) * turn;
                    let (start, rate) = (edge.perp(&(from - c[k])), edge.perp(&along));
                    match rate {
                        r if r > 0.0 => low = low.max(-start / r),
                        r if r < 0.0 => high = high.min(-start / r),
                        _ if start < 0.0 => return None,
                        _ => {}
                    }
                }
            }
            Facing::Disc(center, radius, _) => {
                let off = self.lift(face, from) - center;
                let along = self.lift(face, to) - center - off;
                let (a, b, c) = (along.norm_squared(), along.dot(&off), off.norm_squared() - radius * radius);
                let root = b * b - a * c;
                if root <= 0.0 || a == 0.0 {
                    return None;
                }
                low = low.max((-b - root.sqrt()) / a);
                high = high.min((-b + root.sqrt()) / a);
            }
            _ => return None,
        }
        (low < high).then_some((low, high))
    }

    /// Two faces: the points of each over the other, and where their borders cross.
    fn faces(&self, a: &Facing, b: &Facing, out: &mut Hits) {
        // Of two discs one inside the other, the inner one's points will do.
        if let (Facing::Disc(p, r, _), Facing::Disc(q, s, _)) = (a, b) {
            let apart = self.flat(&(q - p)).norm();
            if apart <= (r - s).abs() + 1e-6 * r {
                let (inner, feature) = if r <= s { (a, 0) } else { (b, 4) };
                for (k, p) in inner.points().iter().enumerate() {
                    self.push(&self.flat(p), feature + k as u32, out);
                }
                return;
            }
            self.crossing_circles(&self.flat(p), *r, &self.flat(q), *s, out);
        }
        for (k, p) in a.points().iter().enumerate().filter(|(_, p)| self.over(p, b)) {
            self.push(&self.flat(p), k as u32, out);
        }
        for (k, p) in b.points().iter().enumerate().filter(|(_, p)| self.over(p, a)) {
            self.push(&self.flat(p), 4 + k as u32, out);
        }
        let (quad, other) = match (a, b) {
            (Facing::Quad(c), other) | (other, Facing::Quad(c)) => (c.map(|p| self.flat(&p)), other),
            _ => return,
        };
        for k in 0..4 {
            let (from, to) = (quad[k], quad[(k + 1) % 4]);
            let Some((low, high)) = self.clip(&from, &to, other) else { continue };
            for (i, t) in [low, high].into_iter().enumerate().filter(|&(_, t)| t > 0.0 && t < 1.0) {
                self.push(&(from + (to - from) * t), 8 + 2 * k as u32 + i as u32, out);
            }
        }
    }

    /// Whether a point is over a face.
    fn over(&self, p: &Vec3, face: &Facing) -> bool {
        let p = self.flat(p);
        match face {
            Facing::Disc(center, radius, _) => (self.lift(face, &p) - center).norm_squared() <= radius * radius,
            Facing::Quad(corners) => {
                let c = corners.map(|p| self.flat(&p));
                let turn = (c[1] - c[0]).perp(&(c[3] - c[0])).signum();
                (0..4).all(|k| turn * (c[(k + 1) % 4] - c[k]).perp(&(p - c[k])) >= 0.0)
            }
            _ => false,
        }
    }

    fn crossing_circles(&self, p: &Vec2, r: f64, q: &Vec2, s: f64, out: &mut Hits) {
        let between = q - p;
        let d2 = between.norm_squared();
        let along = 0.5 * (1.0 + (r * r - s * s) / d2);
        let across2 = r * r / d2 - along * along;
        if across2 > 0.0 {
            let foot = p + between * along;
            let side = Vec2::new(-between.y, between.x) * across2.sqrt();
            self.push(&(foot + side), 8, out);
            self.push(&(foot - side), 9, out);
        }
    }
}
