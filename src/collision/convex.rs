//! Pairs without a closed form: distance and normal of two convex shapes from their support functions.
//!
//! The support point of a shape in direction d is its point furthest along d. Shapes are apart by the largest
//! s(n) = n·(x₂(−n) − x₁(n)) over all unit n, x₁ and x₂ being support points; touching shapes have s < 0, and the
//! largest s is minus the least depth. Spheres and capsules enter as a point and a segment with a radius around.
//!
//! - Apart: the algorithm of Gilbert, Johnson and Keerthi (IEEE J. Robotics and Automation 4, 1988).
//! - Touching: the second shape is pushed out along a guess of the normal, just so far that they are apart; the
//!   closest points then give a better normal, and so on. With penetration d and radius of curvature R the error
//!   shrinks by d/R each time, so resting contacts take one or two rounds. The first guess is the best of the
//!   shapes' own axes and the line of centres.
//!
//! What touches is a point, or, where flat or straight parts face each other, the overlap of these parts
//! ([`super::manifold`]). Distance and normal are those of the geometry; which points stand for an area is a matter
//! of choice, so they differ from MuJoCo's, whose own distances here are those of 35 iterations at most.

use super::manifold::Facing;
use super::{Hit, Hits, Placed};
use crate::math::{MIN_VAL, Vec3};
use crate::model::GeomKind;

/// A shape reduced to its core: a sphere to its centre, a capsule to its segment.
pub(super) struct Core<'a> {
    pub kind: GeomKind,
    pub shape: &'a Placed<'a>,
    /// Radius around the core, m.
    pub radius: f64,
}

impl Core<'_> {
    fn new<'a>(kind: GeomKind, shape: &'a Placed<'a>) -> Core<'a> {
        let round = matches!(kind, GeomKind::Sphere | GeomKind::Capsule);
        Core { kind, shape, radius: if round { shape.size.x } else { 0.0 } }
    }

    /// The core's point furthest along d, relative to its centre, world axes.
    pub fn support(&self, d: &Vec3) -> Vec3 {
        let size = self.shape.size;
        let d = self.shape.mat.tr_mul(d);
        let local = match self.kind {
            GeomKind::Capsule => Vec3::new(0.0, 0.0, size.y.copysign(d.z)),
            GeomKind::Ellipsoid => {
                let scaled = d.component_mul(size);
                scaled.component_mul(size) / scaled.norm().max(f64::MIN_POSITIVE)
            }
            GeomKind::Cylinder => {
                let across = (d.x * d.x + d.y * d.y).sqrt().max(f64::MIN_POSITIVE);
                Vec3::new(d.x / across * size.x, d.y / across * size.x, size.y.copysign(d.z))
            }
            GeomKind::Box => Vec3::new(size.x.copysign(d.x), size.y.copysign(d.y), size.z.copysign(d.z)),
            GeomKind::Plane | GeomKind::Sphere => return Vec3::zeros(),
        };
        self.shape.mat * local
    }
}

/// Two cores; `between` leads from the first centre to the second.
struct Two<'a> {
    a: Core<'a>,
    b: Core<'a>,
    between: Vec3,
    /// What lengths are compared with, m.
    scale: f64,
}

/// A point of the difference of the two cores, and the points it is the difference of (from each centre).
#[derive(Clone, Copy)]
struct Vertex {
    w: Vec3,
    a: Vec3,
    b: Vec3,
}

impl Two<'_> {
    fn support(&self, n: &Vec3, push: &Vec3) -> Vertex {
        let (a, b) = (self.a.support(n), self.b.support(&-n));
        Vertex { w: self.between + push + b - a, a, b }
    }

    /// s(n), without the radii.
    fn separation(&self, n: &Vec3) -> f64 {
        n.dot(&self.support(n, &Vec3::zeros()).w)
    }
}

/// Closest points of the cores (from each centre), and the unit normal between them.
struct Closest {
    a: Vec3,
    b: Vec3,
    normal: Vec3,
}

/// The collider of any two convex shapes.
pub(super) fn convex(kinds: [GeomKind; 2], a: &Placed, b: &Placed, margin: f64, out: &mut Hits) {
    let scale = a.size.sum() + b.size.sum();
    let two = Two { a: Core::new(kinds[0], a), b: Core::new(kinds[1], b), between: b.pos - a.pos, scale };
    let round = two.a.radius + two.b.radius;
    let mut start = [two.between.try_normalize(MIN_VAL).unwrap_or(Vec3::x()); 7];
    for k in 0..3 {
        start[1 + k] = towards(a.axis(k), &two.between);
        start[4 + k] = towards(b.axis(k), &two.between);
    }
    let mut guess = (f64::NEG_INFINITY, Vec3::x());
    for n in start {
        let s = two.separation(&n);
        if s > round + margin {
            return;
        }
        if s > guess.0 {
            guess = (s, n);
        }
    }
    let mut simplex = Simplex::new(two.support(&guess.1, &Vec3::zeros()));
    let found = apart(&two, &mut simplex, &Vec3::zeros()).or_else(|| pushed_apart(&two, guess));
    let Some(closest) = found else { return };
    let n = closest.normal;
    let dist = two.separation(&n) - round;
    if dist > margin - TOUCH * scale {
        return;
    }
    // The points of curved shapes that lean may miss the deepest one.
    let facing = [Facing::new(&two.a, a.pos, &n), Facing::new(&two.b, b.pos, &-n)];
    if Facing::overlap(&facing, &n, margin, out) <= dist + 1e-3 * (margin - dist) + TOUCH * scale {
        return;
    }
    let (x, y) = (a.pos + closest.a + n * two.a.radius, b.pos + closest.b - n * two.b.radius);
    out.push(Hit { dist, pos: (x + y) * 0.5, normal: n, tangent: Vec3::zeros(), feature: DEEPEST });
}

/// Depth, per size, from which shapes count as touching: those that stand exactly on each other, a turret on its base,
/// do not, whatever the last bits say.
///
/// Source: MuJoCo 4.0, where of 150 stacks of either kind none is in contact as written; contact begins at a depth of
/// 1e-15 to 3e-15 m for a cylinder on a box, 1e-15 to 6e-12 m for cylinders, 2e-12 to 6e-12 m for ellipsoids.
const TOUCH: f64 = 1e-12;

/// Feature of the deepest point, where it is none of the points of an area.
const DEEPEST: u32 = 16;

fn towards(axis: Vec3, direction: &Vec3) -> Vec3 {
    if axis.dot(direction) < 0.0 { -axis } else { axis }
}

/// Gap between shapes pushed apart, per size.
const GAP: f64 = 1e-4;

/// Rounds of pushing apart; contacts as deep as the shape is round need the most.
const MOST_ROUNDS: usize = 30;

/// The normal of least depth near the guess (its separation and direction).
fn pushed_apart(two: &Two, (mut best, mut normal): (f64, Vec3)) -> Option<Closest> {
    let mut found = None;
    let mut simplex = Simplex::new(two.support(&normal, &Vec3::zeros()));
    for _ in 0..MOST_ROUNDS {
        // A gap far above rounding, so that the normal between the closest points is exact, and far below any radius.
        let push = normal * (GAP * two.scale - best);
        let closest = apart(two, &mut simplex, &push)?;
        let s = two.separation(&closest.normal);
        let better = s > best + 1e-13 * two.scale;
        if better || found.is_none() {
            (best, normal) = (s, closest.normal);
            found = Some(closest);
        }
        if !better {
            break;
        }
    }
    found
}

/// Steps of the distance algorithm; boxes need about five, round shapes up to thirty.
const MOST_STEPS: usize = 60;

/// The closest points of the cores, the second moved by `push`; none if they overlap.
///
/// Starts from the simplex of a similar problem and leaves its own.
fn apart(two: &Two, simplex: &mut Simplex, push: &Vec3) -> Option<Closest> {
    for vertex in &mut simplex.vertices {
        vertex.w = two.between + push + vertex.b - vertex.a;
    }
    if !simplex.reduce() {
        *simplex = Simplex::new(simplex.vertices[0]);
    }
    let mut v = simplex.point();
    let mut separated = false;
    for _ in 0..MOST_STEPS {
        let len2 = v.norm_squared();
        // Closer than rounding is overlap.
        if len2 <= 1e-24 * (1.0 + two.between.norm_squared()) {
            return None;
        }
        let next = two.support(&(v / len2.sqrt()), push);
        // No point of the difference is nearer along v than v itself, to rounding: done.
        let along = v.dot(&next.w);
        separated |= along > 0.0;
        if len2 - along <= 1e-14 * two.scale * len2.sqrt() {
            break;
        }
        let before = simplex.clone();
        simplex.push(next);
        let inside = !simplex.reduce();
        if inside && !separated {
            return None;
        }
        // Of shapes that some plane separates, a flat simplex may still seem to hold the origin: rounding, so done.
        let nearer = simplex.point();
        if inside || nearer.norm_squared() >= len2 {
            *simplex = before;
            break;
        }
        v = nearer;
    }
    let mut closest = Closest { a: Vec3::zeros(), b: Vec3::zeros(), normal: v / v.norm() };
    for k in 0..simplex.len {
        closest.a += simplex.vertices[k].a * simplex.weights[k];
        closest.b += simplex.vertices[k].b * simplex.weights[k];
    }
    Some(closest)
}

/// Up to four points and the weights of the point of their hull that is nearest to the origin.
#[derive(Clone)]
struct Simplex {
    len: usize,
    vertices: [Vertex; 4],
    weights: [f64; 4],
}

impl Simplex {
    fn new(vertex: Vertex) -> Simplex {
        Simplex { len: 1, vertices: [vertex; 4], weights: [1.0, 0.0, 0.0, 0.0] }
    }

    fn push(&mut self, vertex: Vertex) {
        self.vertices[self.len] = vertex;
        self.len += 1;
    }

    fn point(&self) -> Vec3 {
        (0..self.len).map(|k| self.vertices[k].w * self.weights[k]).sum()
    }

    /// Finds the nearest point and drops the vertices that do not carry it. False if the origin is inside.
    fn reduce(&mut self) -> bool {
        let w = self.vertices.map(|vertex| vertex.w);
        let weights = match self.len {
            1 => [1.0, 0.0, 0.0, 0.0],
            2 => {
                let t = on_segment(&w[0], &w[1]);
                [1.0 - t, t, 0.0, 0.0]
            }
            3 => {
                let [x, y, z] = on_triangle(&w[0], &w[1], &w[2]);
                [x, y, z, 0.0]
            }
            _ => match on_tetrahedron(&w) {
                Some(weights) => weights,
                None => return false,
            },
        };
        let n = std::mem::take(&mut self.len);
        for (k, &weight) in weights.iter().enumerate().take(n) {
            if weight > 0.0 {
                self.vertices[self.len] = self.vertices[k];
                self.weights[self.len] = weight;
                self.len += 1;
            }
        }
        true
    }
}

/// Weight of b at the point of ab nearest to the origin.
fn on_segment(a: &Vec3, b: &Vec3) -> f64 {
    let ab = b - a;
    (-a.dot(&ab) / ab.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
}

/// Weights of the point of a triangle nearest to the origin.
///
///     inside: each weight is n·(the two other corners' product), n = (b − a) × (c − a)
///
/// and where one is negative the nearest point lies on an edge.
fn on_triangle(a: &Vec3, b: &Vec3, c: &Vec3) -> [f64; 3] {
    let n = (b - a).cross(&(c - a));
    let weights = [n.dot(&b.cross(c)), n.dot(&c.cross(a)), n.dot(&a.cross(b))];
    let sum = weights[0] + weights[1] + weights[2];
    if weights.iter().all(|&x| x > 0.0) && sum > 0.0 {
        return weights.map(|x| x / sum);
    }
    let (ab, bc, ca) = (on_segment(a, b), on_segment(b, c), on_segment(c, a));
    let edges = [[1.0 - ab, ab, 0.0], [0.0, 1.0 - bc, bc], [ca, 0.0, 1.0 - ca]];
    let far = |w: &[f64; 3]| (a * w[0] + b * w[1] + c * w[2]).norm_squared();
    edges.into_iter().min_by(|x, y| far(x).total_cmp(&far(y))).unwrap_or(edges[0])
}

/// Weights of the point of a tetrahedron nearest to the origin; none if it holds the origin. The last vertex is new:
/// the origin is not beyond the face that was there before.
fn on_tetrahedron(w: &[Vec3; 4]) -> Option<[f64; 4]> {
    let mut best: Option<([f64; 4], f64)> = None;
    let mut inside = true;
    for [i, j, k, opposite] in [[0, 1, 3, 2], [1, 2, 3, 0], [2, 0, 3, 1]] {
        let n = (w[j] - w[i]).cross(&(w[k] - w[i]));
        let (origin, other) = (-n.dot(&w[i]), n.dot(&(w[opposite] - w[i])));
        if origin * other > 0.0 {
            continue;
        }
        inside = false;
        let face = on_triangle(&w[i], &w[j], &w[k]);
        let far = (w[i] * face[0] + w[j] * face[1] + w[k] * face[2]).norm_squared();
        if best.is_none_or(|(_, nearest)| far < nearest) {
            let mut weights = [0.0; 4];
            for (index, weight) in [i, j, k].into_iter().zip(face) {
                weights[index] = weight;
            }
            best = Some((weights, far));
        }
    }
    if inside { None } else { best.map(|(weights, _)| weights) }
}
