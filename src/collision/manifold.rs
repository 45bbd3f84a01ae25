//! Contact manifolds of convex shapes: where a flat or straight part of one lies on a flat part of the other, and which
//! points stand for it.
//!
//! - Two faces that look at each other: the overlap of the two polygons, of which up to four corners are kept.
//! - A line of one (a capsule's or cylinder's side, an edge of a box) along a face of the other: the ends of what is
//!   over the face.
//! - All else touches in one point.
//!
//! Which faces and lines come into question follows from the support points where the search for the contact ended: a
//! box's faces through all of them, a cylinder's cap if all are on its rim, a box's edge between two. A cap is a
//! polygon of 16 corners.
//!
//! Source: all of these choices are MuJoCo 4.0's, found by running it: which angles count as flat, which four corners,
//! in which order; also what looks accidental (a line that only one end of which is deep enough may give the same
//! point twice; a contact's normal is the second shape's face normal even where another separates the shapes better).

use super::gjk::{Convex, Vertex};
use super::{Hit, Hits};
use crate::math::Vec3;
use crate::model::GeomKind;

/// Faces within this angle of facing each other lie flat (cosine; 5.13°).
const FLAT: f64 = 0.996;
/// A line within this angle of a face lies along it (sine; 5.09°).
const ALONG: f64 = 0.0888;

/// The contact as the search found it: one point.
pub(super) struct Touch<'a> {
    pub shapes: [Convex<'a>; 2],
    /// Unit, from the first shape to the second.
    pub normal: Vec3,
    /// The touching points, each from its shape's centre, half the margin outside.
    pub on: [Vec3; 2],
    /// Signed distance, m.
    pub dist: f64,
    pub margin: f64,
}

/// The feature of a contact that is no part of an area or a line.
pub const POINT: u32 = 255;

/// Adds the contact's points.
///
/// In: `vertices`, the one to three support points where the search ended, the newest first.
pub(super) fn spread(touch: &Touch, vertices: &[Vertex], out: &mut Hits) {
    let [a, b] = &touch.shapes;
    let straight = |c: &Convex| matches!(c.kind, GeomKind::Capsule | GeomKind::Cylinder | GeomKind::Box);
    let before = out.as_slice().len();
    if straight(a) && straight(b) {
        touch.area(vertices, out);
    }
    if out.as_slice().len() == before {
        let [p, q] = touch.on;
        let pos = (a.shape.pos + p + b.shape.pos + q) * 0.5;
        out.push(Hit { dist: touch.dist, pos, normal: touch.normal, tangent: Vec3::zeros(), feature: POINT });
    }
}

impl Touch<'_> {
    /// The points of an area or a line of contact; none if the shapes touch in a point.
    fn area(&self, vertices: &[Vertex], out: &mut Hits) {
        let [a, b] = &self.shapes;
        let [of_a, of_b] = [Part::new(a, vertices, |v| v.a), Part::new(b, vertices, |v| v.b)];
        for above in of_b.faces.iter().flatten() {
            for below in of_a.faces.iter().flatten() {
                if above.normal.dot(&below.normal) < -FLAT {
                    return self.face_on_face(below, above, out);
                }
            }
        }
        for face in of_b.faces.iter().flatten() {
            if let Some(line) = self.side(&of_a, vertices, face)
                && line.direction().dot(&face.normal).abs() < ALONG
            {
                return self.line_on_face(line, face, 1, out);
            }
        }
        if let Some(line) = of_b.edge(b, vertices) {
            for face in of_a.faces.iter().flatten() {
                if line.direction().dot(&face.normal).abs() < ALONG {
                    return self.line_on_face(line, face, 0, out);
                }
            }
        }
    }

    /// The line along the first shape's side that faces a face of the second.
    fn side(&self, part: &Part, vertices: &[Vertex], face: &Face) -> Option<Polygon> {
        let a = &self.shapes[0];
        match a.kind {
            // Through the touching point, without the margin.
            GeomKind::Capsule => Some(along_axis(a, &(self.on[0] + face.normal * (0.5 * self.margin)), false)),
            GeomKind::Cylinder => Some(along_axis(a, &on_side(a, &vertices[0].a), part.corners[0] == 1)),
            _ => None,
        }
    }

    /// Two faces: the second one's corners over the first, and where their borders cross.
    ///
    /// A corner's place is seen along the first face's normal, its distance along the second's, which is the contact's.
    fn face_on_face(&self, first: &Face, second: &Face, out: &mut Hits) {
        let border = first.polygon(&self.shapes[0]);
        let mut polygon = second.polygon(&self.shapes[1]);
        let (low, high) = (border.points[0], self.seen_from_first(&polygon.points[0]));
        polygon.points.iter_mut().for_each(|p| *p = self.seen_from_first(p));
        polygon.clip(&border, &first.normal);
        let normal = -second.normal;
        let dist = |p: &Vec3| (high - p).dot(&normal);
        polygon.each(|p| *p -= first.normal * (*p - low).dot(&first.normal));
        polygon.keep(|p| dist(p) <= self.margin);
        polygon.keep_four();
        for k in 0..polygon.len {
            let p = polygon.points[k];
            self.push(p + normal * (0.5 * dist(&p)), dist(&p), normal, polygon.names[k], out);
        }
    }

    /// A line of one shape along a face of the other, `owner`: the ends of what is over the face. The normal is the
    /// face's.
    fn line_on_face(&self, mut line: Polygon, face: &Face, owner: usize, out: &mut Hits) {
        let mut border = face.polygon(&self.shapes[owner]);
        let of_second = if owner == 1 { &mut border } else { &mut line };
        of_second.each(|p| *p = self.seen_from_first(p));
        line.clip(&border, &face.normal);
        let dist = |p: &Vec3| (p - border.points[0]).dot(&face.normal);
        line.keep(|p| dist(p) <= self.margin);
        line.keep_two();
        let normal = if owner == 1 { -face.normal } else { face.normal };
        for k in 0..line.len {
            let p = line.points[k];
            self.push(p - face.normal * (0.5 * dist(&p)), dist(&p), normal, line.names[k], out);
        }
    }

    /// From the first shape's centre, what is given from the second's.
    fn seen_from_first(&self, p: &Vec3) -> Vec3 {
        self.shapes[1].shape.pos - self.shapes[0].shape.pos + p
    }

    fn push(&self, from_first: Vec3, dist: f64, normal: Vec3, feature: u32, out: &mut Hits) {
        let pos = self.shapes[0].shape.pos + from_first;
        out.push(Hit { dist, pos, normal, tangent: Vec3::zeros(), feature });
    }
}

/// What of a shape the support points lie on.
struct Part {
    /// Of each support point: which corner of a box it is (bit k: positive along k), which end of a capsule or cylinder
    /// (1 at the positive end).
    corners: [u8; 3],
    count: usize,
    /// The faces that hold them all.
    faces: [Option<Face>; 3],
}

/// A face of a box, or a cylinder's cap.
struct Face {
    axis: usize,
    positive: bool,
    /// Outward.
    normal: Vec3,
}

impl Part {
    fn new(shape: &Convex, vertices: &[Vertex], point: impl Fn(&Vertex) -> Vec3) -> Part {
        let mut part = Part { corners: [0; 3], count: vertices.len().min(3), faces: [None, None, None] };
        let axes = if shape.kind == GeomKind::Box { 0..3 } else { 2..3 };
        for (k, vertex) in vertices.iter().take(3).enumerate() {
            let local = shape.shape.mat.tr_mul(&point(vertex));
            part.corners[k] = axes.clone().map(|axis| u8::from(local[axis] > 0.0) << (axis - axes.start)).sum();
        }
        if shape.kind != GeomKind::Capsule {
            for axis in axes.clone() {
                let positive = |&corner: &u8| corner >> (axis - axes.start) & 1 == 1;
                let first = positive(&part.corners[0]);
                if part.used().iter().all(|corner| positive(corner) == first) {
                    let normal = shape.shape.axis(axis) * if first { 1.0 } else { -1.0 };
                    part.faces[axis] = Some(Face { axis, positive: first, normal });
                }
            }
        }
        part
    }

    fn used(&self) -> &[u8] {
        &self.corners[..self.count]
    }

    /// The edge of a box between two corners, the line on a cylinder between both rims.
    fn edge(&self, shape: &Convex, vertices: &[Vertex]) -> Option<Polygon> {
        let first = self.corners[0];
        let other = *self.used().iter().find(|&&corner| corner != first)?;
        match shape.kind {
            GeomKind::Cylinder => Some(along_axis(shape, &on_side(shape, &vertices[0].b), first == 1)),
            GeomKind::Box if self.used().iter().all(|&corner| corner == first || corner == other) => {
                let size = shape.shape.size;
                let at = |corner: u8| {
                    let end = |k: usize| if corner >> k & 1 == 1 { size[k] } else { -size[k] };
                    shape.shape.mat * Vec3::new(end(0), end(1), end(2))
                };
                Some(Polygon::line([at(first), at(other)], [u32::from(first), u32::from(other)]))
            }
            _ => None,
        }
    }
}

/// The point of a cylinder's side out from its axis through p, at the middle of its height.
fn on_side(shape: &Convex, p: &Vec3) -> Vec3 {
    let axis = shape.shape.axis(2);
    let out = p - axis * p.dot(&axis);
    out * (shape.shape.size.x / out.norm().max(f64::MIN_POSITIVE))
}

/// The line through a point as long as the shape's axis and beside it, from its positive or its negative end.
fn along_axis(shape: &Convex, through: &Vec3, from_positive: bool) -> Polygon {
    let axis = shape.shape.axis(2);
    let beside = through - axis * through.dot(&axis);
    let half = axis * if from_positive { shape.shape.size.y } else { -shape.shape.size.y };
    let first = u32::from(from_positive);
    Polygon::line([beside + half, beside - half], [first, 1 - first])
}

/// Areas this close, relative, are the same: of a cap that lies flat as a whole MuJoCo takes whichever four corners the last
/// bits make larger, a square where the cap is not turned; Penny takes that square however it is turned.
const SAME_AREA: f64 = 1e-9;

/// cos and sin of multiples of 22.5°.
const RIM: [[f64; 2]; 4] = [
    [1.0, 0.0],
    [0.923_879_532_511_286_7, 0.382_683_432_365_089_8],
    [std::f64::consts::FRAC_1_SQRT_2, std::f64::consts::FRAC_1_SQRT_2],
    [0.382_683_432_365_089_8, 0.923_879_532_511_286_7],
];

/// Corners of a box's face along +x, +y and +z, by the signs of the two other coordinates; clockwise from outside.
const CORNERS: [[[f64; 2]; 4]; 3] = [
    [[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]],
    [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]],
    [[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]],
];
/// The same for the faces along −x, −y and −z.
const OPPOSITE: [[[f64; 2]; 4]; 3] = [
    [[1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]],
    [[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]],
    [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]],
];

impl Face {
    /// Its corners from the shape's centre, clockwise seen from outside.
    fn polygon(&self, shape: &Convex) -> Polygon {
        let (size, mat) = (shape.shape.size, shape.shape.mat);
        let mut polygon = Polygon::default();
        let sign = if self.positive { 1.0 } else { -1.0 };
        if shape.kind == GeomKind::Cylinder {
            for k in 0..16 {
                let [mut x, mut y] = RIM[k % 4];
                for _ in 0..k / 4 {
                    (x, y) = (-y, x);
                }
                polygon.push(mat * Vec3::new(size.x * x, -sign * size.x * y, sign * size.y), k as u32);
            }
        } else {
            let (i, j) = [(1, 2), (0, 2), (0, 1)][self.axis];
            let corners = if self.positive { CORNERS } else { OPPOSITE }[self.axis];
            for (k, [u, v]) in corners.into_iter().enumerate() {
                let mut corner = Vec3::zeros();
                corner[self.axis] = sign * size[self.axis];
                corner[i] = u * size[i];
                corner[j] = v * size[j];
                polygon.push(mat * corner, k as u32);
            }
        }
        polygon
    }
}

/// A polygon's or a line's corners, and what each is.
struct Polygon {
    len: usize,
    points: [Vec3; 32],
    /// A corner of the polygon as it was: its number there; a place where a side of another cut it: 16 + twice the
    /// side's number, and one more where it leaves the other.
    names: [u32; 32],
}

impl Default for Polygon {
    fn default() -> Polygon {
        Polygon { len: 0, points: [Vec3::zeros(); 32], names: [0; 32] }
    }
}

impl Polygon {
    fn line(ends: [Vec3; 2], names: [u32; 2]) -> Polygon {
        let mut line = Polygon::default();
        line.push(ends[0], names[0]);
        line.push(ends[1], names[1]);
        line
    }

    fn direction(&self) -> Vec3 {
        (self.points[1] - self.points[0]).normalize()
    }

    fn push(&mut self, point: Vec3, name: u32) {
        if self.len < self.points.len() {
            (self.points[self.len], self.names[self.len]) = (point, name);
            self.len += 1;
        }
    }

    fn each(&mut self, change: impl Fn(&mut Vec3)) {
        self.points[..self.len].iter_mut().for_each(change);
    }

    fn keep(&mut self, wanted: impl Fn(&Vec3) -> bool) {
        let n = std::mem::take(&mut self.len);
        for k in 0..n {
            if wanted(&self.points[k]) {
                self.push(self.points[k], self.names[k]);
            }
        }
    }

    /// What of it is over a polygon with this normal: side by side, what is beyond the side is cut off.
    ///
    /// Source: Sutherland and Hodgman, Communications of the ACM 17 (1974).
    fn clip(&mut self, border: &Polygon, normal: &Vec3) {
        for side in 0..border.len {
            let from = border.points[side];
            let inward = (border.points[(side + 1) % border.len] - from).cross(normal);
            let inside = |p: &Vec3| (p - from).dot(&inward);
            let mut rest = Polygon::default();
            for k in 0..self.len {
                let next = (k + 1) % self.len;
                let (p, q) = (self.points[k], self.points[next]);
                let (at_p, at_q) = (inside(&p), inside(&q));
                if at_p * at_q < 0.0 {
                    let name = 16 + 2 * side as u32 + u32::from(at_p > 0.0);
                    rest.push(p + (q - p) * (at_p / (at_p - at_q)), name);
                }
                if at_q >= 0.0 {
                    rest.push(q, self.names[next]);
                }
            }
            *self = rest;
        }
    }

    /// Of more than two points the first and the one furthest from it.
    fn keep_two(&mut self) {
        if self.len > 2 {
            let first = self.points[0];
            let far = |k: &usize| (self.points[*k] - first).norm_squared();
            let furthest = (1..self.len).rev().max_by(|i, j| far(i).total_cmp(&far(j))).unwrap_or(1);
            (self.points[1], self.names[1]) = (self.points[furthest], self.names[furthest]);
            self.len = 2;
        }
    }

    /// Of more than four corners a quadrilateral of large area.
    ///
    ///     area = |(c − a) × (d − b)| / 2
    ///
    /// For each a in turn d moves on as long as the area grows or stays, after each of its moves first c, then b as well.
    /// That finds a local maximum; two corners may be the same.
    fn keep_four(&mut self) {
        if self.len <= 4 {
            return;
        }
        let n = self.len;
        let area = |q: &[usize; 4]| {
            let [a, b, c, d] = q.map(|k| self.points[k]);
            (c - a).cross(&(d - b)).norm()
        };
        let mut q = [0, 1, 2, 3];
        let mut largest = area(&q);
        let (mut best, mut moves) = (q, 0);
        let mut advance = |q: &mut [usize; 4], k: usize| {
            let mut next = *q;
            next[k] = (next[k] + 1) % n;
            let larger = area(&next);
            let grows = larger > largest * (1.0 - SAME_AREA) && moves < 8 * n;
            moves += 1;
            if grows {
                (*q, largest, best) = (next, larger, next);
            }
            grows
        };
        for a in 0..n {
            q[0] = a;
            while advance(&mut q, 3) {
                while advance(&mut q, 2) {}
                while advance(&mut q, 1) {}
            }
            for k in 1..4 {
                if q[k] != q[k - 1] {
                    break;
                }
                q[k] = (q[k] + 1) % n;
            }
        }
        let (points, names) = (best.map(|k| self.points[k]), best.map(|k| self.names[k]));
        self.points[..4].copy_from_slice(&points);
        self.names[..4].copy_from_slice(&names);
        self.len = 4;
    }
}
