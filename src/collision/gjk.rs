//! The distance of two convex shapes, or a simplex of their difference that holds the origin.
//!
//! The support point of a shape in direction d is its point furthest along d. The difference A − B of two shapes is the
//! set of all a − b; it holds the origin if the shapes overlap, and else its point nearest to the origin is as far from
//! it as the shapes are apart. The algorithm keeps a simplex of points of the difference: in each step it adds the
//! support point towards the origin and keeps the face that is nearest to the origin.
//!
//! Source: Gilbert, Johnson and Keerthi, IEEE J. Robotics and Automation 4 (1988); the nearest point of a simplex by
//! signed volumes: Montanari, Petrinic and Barbieri, ACM Trans. Graphics 36 (2017). Where it begins and when it stops is
//! MuJoCo 4.0's, as found by running it step by step (`ccd_iterations` 1, 2, 3, …).

use super::Placed;
use crate::math::{MIN_VAL, Mat3, Vec3};
use crate::model::GeomKind;

/// Steps of the search for the distance, and as many of the search for the depth: MuJoCo's `ccd_iterations`.
pub(super) const STEPS: usize = 35;
/// What distance and depth are exact to, m: MuJoCo's `ccd_tolerance`.
pub(super) const TOLERANCE: f64 = 1e-6;

/// A shape as a convex set: a core and a radius around it.
#[derive(Clone, Copy)]
pub(super) struct Convex<'a> {
    pub kind: GeomKind,
    pub shape: &'a Placed<'a>,
    /// Radius around the core, m: at least half the margin.
    pub radius: f64,
}

impl<'a> Convex<'a> {
    /// A sphere is a point, a capsule a segment, with their radius around; all others are their own core. Half the
    /// margin is around each.
    pub fn new(kind: GeomKind, shape: &'a Placed<'a>, margin: f64) -> Convex<'a> {
        let round = matches!(kind, GeomKind::Sphere | GeomKind::Capsule);
        Convex { kind, shape, radius: 0.5 * margin + if round { shape.size.x } else { 0.0 } }
    }

    /// The core's support point in the unit direction d, from the shape's centre, world axes.
    fn support(&self, d: &Vec3) -> Vec3 {
        let size = self.shape.size;
        let d = self.shape.mat.tr_mul(d);
        let end = |size: f64, d: f64| if d < 0.0 { -size } else { size };
        let local = match self.kind {
            GeomKind::Capsule => Vec3::new(0.0, 0.0, end(size.y, d.z)),
            GeomKind::Ellipsoid => {
                let scaled = d.component_mul(size);
                (scaled / scaled.norm()).component_mul(size)
            }
            GeomKind::Cylinder => {
                let across = (d.x * d.x + d.y * d.y).sqrt();
                let (x, y) = if across > MIN_VAL { (d.x / across * size.x, d.y / across * size.x) } else { (0.0, 0.0) };
                Vec3::new(x, y, end(size.y, d.z))
            }
            GeomKind::Box => Vec3::new(end(size.x, d.x), end(size.y, d.y), end(size.z, d.z)),
            GeomKind::Plane | GeomKind::Sphere => return Vec3::zeros(),
        };
        self.shape.mat * local
    }
}

/// A point of the difference, and the points it is the difference of (each from its shape's centre).
#[derive(Clone, Copy, Default)]
pub(super) struct Vertex {
    pub w: Vec3,
    pub a: Vec3,
    pub b: Vec3,
}

/// The difference of two shapes, or of their cores.
pub(super) struct Difference<'a> {
    pub shapes: [Convex<'a>; 2],
    /// From the second centre to the first.
    pub between: Vec3,
    /// 0 for the cores, 1 for the shapes with all that is around them.
    pub whole: f64,
}

impl Difference<'_> {
    /// The difference's support point in the unit direction d.
    pub fn support(&self, d: &Vec3) -> Vertex {
        let [a, b] = self.shapes;
        let a = a.support(d) + d * (self.whole * a.radius);
        let b = b.support(&-d) - d * (self.whole * b.radius);
        Vertex { w: a - b + self.between, a, b }
    }
}

/// Up to four points of the difference, and the weights of the point of their hull that is nearest to the origin.
#[derive(Clone, Default)]
pub(super) struct Simplex {
    pub len: usize,
    pub vertices: [Vertex; 4],
    weights: [f64; 4],
}

impl Simplex {
    fn push(&mut self, vertex: Vertex) {
        self.vertices[self.len] = vertex;
        self.len += 1;
    }

    pub fn mean(&self, of: impl Fn(&Vertex) -> Vec3) -> Vec3 {
        (0..self.len).map(|k| of(&self.vertices[k]) * self.weights[k]).sum()
    }

    /// Finds the nearest point and keeps the vertices that carry it.
    fn reduce(&mut self) {
        let w = self.vertices.map(|vertex| vertex.w);
        let weights = match self.len {
            1 => [1.0, 0.0, 0.0, 0.0],
            2 => {
                let [a, b] = on_segment(&w[0], &w[1]);
                [a, b, 0.0, 0.0]
            }
            3 => {
                let [a, b, c] = on_triangle(&w[0], &w[1], &w[2]);
                [a, b, c, 0.0]
            }
            _ => on_tetrahedron(&w),
        };
        let n = std::mem::take(&mut self.len);
        for (k, &weight) in weights.iter().enumerate().take(n) {
            if weight != 0.0 {
                self.vertices[self.len] = self.vertices[k];
                self.weights[self.len] = weight;
                self.len += 1;
            }
        }
    }
}

/// The difference's point nearest to the origin, and its simplex: shorter than the tolerance, the shapes overlap. None if
/// it is further away than `reach` (m).
pub(super) fn nearest(difference: &Difference, reach: f64) -> Option<(Vec3, Simplex)> {
    let mut simplex = Simplex::default();
    // With one centre for both any direction will do.
    let mut x = if difference.between.norm() < MIN_VAL { Vec3::x() } else { difference.between };
    for _ in 0..STEPS {
        let len2 = x.norm_squared();
        if len2 < MIN_VAL * MIN_VAL {
            break;
        }
        let next = difference.support(&(x / -len2.sqrt()));
        // No point of the difference is nearer than along/|x|, so |x|² can fall by the rest at most.
        let along = x.dot(&next.w);
        if len2 - along < 0.5 * TOLERANCE * TOLERANCE {
            break;
        }
        if along > 0.0 && along * along > reach * reach * len2 {
            return None;
        }
        simplex.push(next);
        simplex.reduce();
        let nearer = simplex.mean(|v| v.w);
        let still = (nearer - x).norm() < MIN_VAL;
        x = nearer;
        if still || simplex.len == 4 {
            break;
        }
    }
    Some((x, simplex))
}

fn same_sign(a: f64, b: f64) -> bool {
    (a > 0.0 && b > 0.0) || (a < 0.0 && b < 0.0)
}

/// Weights of the point of ab nearest to the origin; b's where the line's is beyond an end, since b is the newer.
///
/// The lengths are measured along the axis in which the segment is longest: o is the origin's foot on the line,
///
///     weights (o − b)/(a − b), (a − o)/(a − b)
fn on_segment(a: &Vec3, b: &Vec3) -> [f64; 2] {
    let ab = b - a;
    let foot = b - ab * (b.dot(&ab) / ab.norm_squared());
    let k = ab.iamax();
    let whole = a[k] - b[k];
    let (of_a, of_b) = (foot[k] - b[k], a[k] - foot[k]);
    if same_sign(whole, of_a) && same_sign(whole, of_b) { [of_a / whole, of_b / whole] } else { [0.0, 1.0] }
}

/// The foot of the origin on the plane of a triangle, from the corner whose edges give a usable normal.
pub(super) fn foot_on_plane(a: &Vec3, b: &Vec3, c: &Vec3) -> Option<Vec3> {
    let [ab, ac, bc] = [b - a, c - a, c - b];
    for (n, corner) in [(bc.cross(&ab), b), (ab.cross(&ac), a), (ac.cross(&bc), c)] {
        let (height, nn) = (n.dot(corner), n.norm_squared());
        if nn == 0.0 {
            return None;
        }
        if height != 0.0 && nn > MIN_VAL {
            return Some(n * (height / nn));
        }
    }
    let n = (c - a).cross(&(c - b));
    Some(n * (n.dot(c) / n.norm_squared()))
}

/// Weights of the point of a triangle nearest to the origin: areas seen along the axis that shows it largest.
fn on_triangle(a: &Vec3, b: &Vec3, c: &Vec3) -> [f64; 3] {
    let Some(foot) = foot_on_plane(a, b, c) else {
        let [a, b] = on_segment(a, b);
        return [a, b, 0.0];
    };
    let area = |p: &Vec3, q: &Vec3, r: &Vec3| (q - p).cross(&(r - p));
    let whole = area(a, b, c);
    let k = whole.iamax();
    let parts = [area(&foot, b, c)[k], area(a, &foot, c)[k], area(a, b, &foot)[k]];
    if parts.iter().all(|&part| same_sign(whole[k], part)) {
        return parts.map(|part| part / whole[k]);
    }
    // Beyond an edge: the best of the edges that it is beyond.
    let corners = [a, b, c];
    let mut best = ([0.0, 0.0, 1.0], f64::INFINITY);
    for (out, [i, j]) in [[1, 2], [0, 2], [0, 1]].into_iter().enumerate() {
        if !same_sign(whole[k], parts[out]) {
            let [p, q] = on_segment(corners[i], corners[j]);
            let far = (corners[i] * p + corners[j] * q).norm_squared();
            if far < best.1 {
                let mut weights = [0.0; 3];
                (weights[i], weights[j]) = (p, q);
                best = (weights, far);
            }
        }
    }
    best.0
}

/// Weights of the point of a tetrahedron nearest to the origin: signed volumes.
fn on_tetrahedron(w: &[Vec3; 4]) -> [f64; 4] {
    let volume = |i: usize, j: usize, k: usize| Mat3::from_columns(&[w[i], w[j], w[k]]).determinant();
    let parts = [-volume(1, 2, 3), volume(0, 2, 3), -volume(0, 1, 3), volume(0, 1, 2)];
    let whole: f64 = parts.iter().sum();
    if parts.iter().all(|&part| same_sign(whole, part)) {
        return parts.map(|part| part / whole);
    }
    let mut best = ([0.0, 0.0, 0.0, 1.0], f64::INFINITY);
    for (out, face) in [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]].into_iter().enumerate() {
        if !same_sign(whole, parts[out]) {
            let [i, j, k] = face;
            let found = on_triangle(&w[i], &w[j], &w[k]);
            let far = (w[i] * found[0] + w[j] * found[1] + w[k] * found[2]).norm_squared();
            if far < best.1 {
                let mut weights = [0.0; 4];
                for (index, weight) in face.into_iter().zip(found) {
                    weights[index] = weight;
                }
                best = (weights, far);
            }
        }
    }
    best.0
}
