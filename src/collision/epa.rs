//! How deep two convex shapes are in each other: the point of their difference's surface that is nearest to the origin.
//!
//! A polytope inside the difference, whose corners are support points, holds the origin. In each step its face nearest
//! to the origin gets a new corner above it, the support point along the face's normal: what the new corner sees of the
//! polytope is replaced by faces that lead to it. The nearest face is a lower bound of the depth; the support point along
//! its normal, an upper one. Where they meet to the tolerance, or after [`STEPS`], the nearest face is the answer: depth
//! and normal are the face's, so they are short of the truth by up to the tolerance and its root.
//!
//! Source: van den Bergen, Proximity queries and penetration depth computation on 3D game objects (2001). The polytope it
//! begins with and when it stops are MuJoCo 4.0's, as found by running it step by step.

use super::gjk::{Difference, STEPS, Simplex, TOLERANCE, Vertex, foot_on_plane};
use crate::math::{MIN_VAL, Vec3};

const MOST_VERTICES: usize = 5 + STEPS;
/// Euler: a polytope of n corners has at most 2 n − 4 triangles.
const MOST_FACES: usize = 2 * MOST_VERTICES - 4;

/// A triangle: its corners, the faces beyond its edges (edge k leads from corner k to the next), and the origin's foot on
/// its plane.
#[derive(Clone, Copy)]
struct Face {
    corners: [u8; 3],
    beyond: [u8; 3],
    foot: Vec3,
    /// |foot|², m²
    far2: f64,
    alive: bool,
    /// May be the nearest: it is no nearer than a face that was replaced and no further than the upper bound.
    candidate: bool,
}

struct Polytope {
    vertices: [Vertex; MOST_VERTICES],
    vertex_count: usize,
    faces: [Face; MOST_FACES],
    face_count: usize,
    /// Places of faces that are gone.
    free: [u8; MOST_FACES],
    free_count: usize,
    candidates: [u8; MOST_FACES],
    candidate_count: usize,
    /// The depth is no more than this, m.
    most: f64,
}

/// The nearest face of the surface.
pub(super) struct Deepest {
    /// From the origin to the surface, m: its direction is the contact's normal, its length the depth.
    pub foot: Vec3,
    /// Corners of the face, the newest first.
    pub vertices: [Vertex; 3],
    /// Of the corners, at the foot.
    pub weights: [f64; 3],
}

/// Closer than this to the origin (squared, m²) a face of the first polytope cannot be: MuJoCo begins with the face's
/// triangle then.
const ON_FACE2: f64 = TOLERANCE * TOLERANCE;

/// Nearer than this to the triangle that the search for the distance ended with, m, the origin is on it; else one of the
/// tetrahedra on it has to hold the origin, or the shapes merely touch. They also do if the surface is that near.
const ON_SIMPLEX: f64 = 1e-14;

/// The depth's direction from a simplex whose hull holds the origin, to rounding.
///
/// None if the shapes merely touch: no polytope around the origin can be made of their difference.
pub(super) fn deepest(difference: &Difference, simplex: &Simplex) -> Option<Deepest> {
    let v = &simplex.vertices;
    let mut polytope = match simplex.len {
        2 => Polytope::around_segment(difference, v[0], v[1])?,
        3 => Polytope::around_triangle(difference, [v[0], v[1], v[2]])?,
        4 => Polytope::tetrahedron(difference, v)?,
        _ => return None,
    };
    polytope.expand(difference)
}

impl Polytope {
    fn new(vertices: &[Vertex]) -> Polytope {
        let none =
            Face { corners: [0; 3], beyond: [0; 3], foot: Vec3::zeros(), far2: 0.0, alive: false, candidate: false };
        let mut polytope = Polytope {
            vertices: [Vertex::default(); MOST_VERTICES],
            vertex_count: vertices.len(),
            faces: [none; MOST_FACES],
            face_count: 0,
            free: [0; MOST_FACES],
            free_count: 0,
            candidates: [0; MOST_FACES],
            candidate_count: 0,
            most: f64::INFINITY,
        };
        polytope.vertices[..vertices.len()].copy_from_slice(vertices);
        polytope
    }

    fn tetrahedron(difference: &Difference, v: &[Vertex; 4]) -> Option<Polytope> {
        let mut polytope = Polytope::new(v);
        let faces = [([0, 1, 2], [1, 3, 2]), ([0, 3, 1], [2, 3, 0]), ([0, 2, 3], [0, 3, 1]), ([3, 2, 1], [2, 0, 1])];
        let nearest = polytope.begin(&faces)?;
        if polytope.faces[nearest].far2 < ON_FACE2 {
            let triangle = faces[nearest].0.map(|k| v[k as usize]);
            polytope.most = along_axes(difference);
            return Polytope::around_triangle(difference, triangle).or(Some(polytope));
        }
        Some(polytope)
    }

    /// Two tetrahedra on a triangle that holds the origin: their other corners lie along its normal, to either side.
    fn around_triangle(difference: &Difference, [a, b, c]: [Vertex; 3]) -> Option<Polytope> {
        let n = normal(&[a, b, c])?;
        let mut polytope = Polytope::new(&[a, b, c, difference.support(&-n), difference.support(&n)]);
        polytope.most = along_axes(difference);
        let faces = [
            ([3, 0, 1], [1, 3, 2]),
            ([3, 2, 0], [2, 4, 0]),
            ([3, 1, 2], [0, 5, 1]),
            ([4, 1, 0], [5, 0, 4]),
            ([4, 0, 2], [3, 1, 5]),
            ([4, 2, 1], [4, 2, 3]),
        ];
        let nearest = polytope.begin(&faces)?;
        let on_triangle = foot_on_plane(&a.w, &b.w, &c.w)?.norm() < ON_SIMPLEX;
        let inside = on_triangle || polytope.holds_origin([[0, 1, 2, 3], [0, 1, 2, 4]]);
        (inside && polytope.faces[nearest].far2 >= MIN_VAL * MIN_VAL).then_some(polytope)
    }

    /// Two tetrahedra on a triangle around a segment that holds the origin: its corners lie 120° apart across the
    /// segment, the first along the product of the segment and the world's axis that it is least along.
    fn around_segment(difference: &Difference, a: Vertex, b: Vertex) -> Option<Polytope> {
        let along = (b.w - a.w).try_normalize(MIN_VAL)?;
        let first = Vec3::ith(along.iamin(), 1.0).cross(&along).normalize();
        let turned = |d: &Vec3| along.cross(d) * 0.75f64.sqrt() - d * 0.5;
        let second = turned(&first);
        let around = [first, second, turned(&second)].map(|d| difference.support(&d));
        let v = [a, b, around[0], around[1], around[2]];
        let mut polytope = Polytope::new(&v);
        polytope.most = along_axes(difference);
        let faces = [
            ([0, 2, 3], [1, 3, 2]),
            ([0, 4, 2], [2, 4, 0]),
            ([0, 3, 4], [0, 5, 1]),
            ([1, 3, 2], [5, 0, 4]),
            ([1, 2, 4], [3, 1, 5]),
            ([1, 4, 3], [4, 2, 3]),
        ];
        let nearest = polytope.begin(&faces)?;
        if polytope.faces[nearest].far2 < MIN_VAL * MIN_VAL {
            return Polytope::around_triangle(difference, faces[nearest].0.map(|k| v[k as usize]));
        }
        polytope.holds_origin([[0, 2, 3, 4], [1, 2, 3, 4]]).then_some(polytope)
    }

    /// Makes the first faces, and gives the one nearest to the origin. None if one has no area.
    fn begin(&mut self, faces: &[([u8; 3], [u8; 3])]) -> Option<usize> {
        for &(corners, beyond) in faces {
            let k = self.place();
            self.faces[k] = self.face(corners, beyond)?;
            self.admit(k);
        }
        (0..faces.len()).min_by(|&i, &j| self.faces[i].far2.total_cmp(&self.faces[j].far2))
    }

    /// Whether the origin is in one of two tetrahedra.
    fn holds_origin(&self, tetrahedra: [[usize; 4]; 2]) -> bool {
        tetrahedra.into_iter().any(|t| tetrahedron_holds_origin(&t.map(|k| self.vertices[k].w)))
    }

    fn face(&self, corners: [u8; 3], beyond: [u8; 3]) -> Option<Face> {
        let [a, b, c] = corners.map(|k| self.vertices[k as usize].w);
        let foot = foot_on_plane(&c, &b, &a)?;
        Some(Face { corners, beyond, foot, far2: foot.norm_squared(), alive: true, candidate: false })
    }

    /// A place for one more face.
    fn place(&mut self) -> usize {
        if self.free_count > 0 {
            self.free_count -= 1;
            return self.free[self.free_count] as usize;
        }
        self.face_count += 1;
        self.face_count - 1
    }

    fn admit(&mut self, k: usize) {
        self.faces[k].candidate = true;
        self.candidates[self.candidate_count] = k as u8;
        self.candidate_count += 1;
    }

    fn remove(&mut self, k: usize) {
        self.faces[k].alive = false;
        self.free[self.free_count] = k as u8;
        self.free_count += 1;
        if self.faces[k].candidate
            && let Some(at) = self.candidates[..self.candidate_count].iter().position(|&c| c as usize == k)
        {
            self.candidate_count -= 1;
            self.candidates[at] = self.candidates[self.candidate_count];
        }
    }

    fn expand(&mut self, difference: &Difference) -> Option<Deepest> {
        let mut best: Option<Face> = None;
        let mut upper = f64::INFINITY;
        for _ in 0..STEPS {
            let near = |&k: &u8| self.faces[k as usize].far2;
            let candidates = self.candidates[..self.candidate_count].iter();
            let Some(&k) = candidates.min_by(|i, j| near(i).total_cmp(&near(j))) else { break };
            let face = self.faces[k as usize];
            if face.far2 > upper * upper {
                break;
            }
            if face.far2 < ON_SIMPLEX * ON_SIMPLEX {
                return None;
            }
            let lower = face.far2.sqrt();
            let next = difference.support(&(face.foot / lower));
            let beyond = face.foot.dot(&next.w) / lower;
            upper = upper.min(beyond);
            best = Some(face);
            if beyond - lower < TOLERANCE || self.vertex_count == MOST_VERTICES {
                break;
            }
            let newest = self.vertex_count;
            self.vertices[newest] = next;
            self.vertex_count += 1;
            self.replace_seen(k as usize, newest, [face.far2, upper * upper])?;
        }
        // Deeper than the shapes can be in each other: the first polytope was flat.
        best.filter(|face| face.far2.sqrt() <= self.most + TOLERANCE).map(|face| self.answer(&face))
    }

    /// Replaces all faces that the newest vertex sees by faces that lead to it. None if rounding broke the polytope.
    fn replace_seen(&mut self, nearest: usize, newest: usize, [low, high]: [f64; 2]) -> Option<()> {
        let w = self.vertices[newest].w;
        self.remove(nearest);
        let mut horizon = Horizon { len: 0, edges: [(0, 0); MOST_VERTICES] };
        for edge in 0..3 {
            let (next, back) = self.across(nearest, edge)?;
            if self.faces[next].alive {
                self.seen(next, back, &w, &mut horizon)?;
            }
        }
        let n = horizon.len;
        if n < 3 || self.free_count + (MOST_FACES - self.face_count) < n {
            return None;
        }
        let mut places = [0u8; MOST_VERTICES];
        for place in &mut places[..n] {
            *place = self.place() as u8;
        }
        for (i, &(edge_of, edge)) in horizon.edges[..n].iter().enumerate() {
            let old = &mut self.faces[edge_of as usize];
            let (from, to) = (old.corners[edge as usize], old.corners[(edge as usize + 1) % 3]);
            old.beyond[edge as usize] = places[i];
            let beside = [places[(i + n - 1) % n], edge_of, places[(i + 1) % n]];
            let face = self.face([newest as u8, to, from], beside)?;
            self.faces[places[i] as usize] = face;
            if low <= face.far2 && face.far2 <= high {
                self.admit(places[i] as usize);
            }
        }
        Some(())
    }

    /// The face beyond an edge, and which edge of that face it is.
    fn across(&self, face: usize, edge: usize) -> Option<(usize, usize)> {
        let next = self.faces[face].beyond[edge] as usize;
        let corner = self.faces[face].corners[(edge + 1) % 3];
        let back = self.faces[next].corners.iter().position(|&c| c == corner)?;
        Some((next, back))
    }

    /// Removes a face that w is above, and goes on beyond its other edges; else its edge belongs to the horizon.
    fn seen(&mut self, face: usize, edge: usize, w: &Vec3, horizon: &mut Horizon) -> Option<()> {
        let Face { foot, far2, .. } = self.faces[face];
        if foot.dot(w) - far2 <= SEEN {
            let slot = horizon.edges.get_mut(horizon.len)?;
            *slot = (face as u8, edge as u8);
            horizon.len += 1;
            return Some(());
        }
        self.remove(face);
        for edge in [(edge + 1) % 3, (edge + 2) % 3] {
            let (next, back) = self.across(face, edge)?;
            if self.faces[next].alive {
                self.seen(next, back, w, horizon)?;
            }
        }
        Some(())
    }

    fn answer(&self, face: &Face) -> Deepest {
        let vertices = face.corners.map(|k| self.vertices[k as usize]);
        let [a, b, c] = vertices.map(|v| v.w);
        let n = (b - a).cross(&(c - a));
        let p = face.foot;
        let of_a = n.dot(&(b - p).cross(&(c - p))) / n.norm_squared();
        let of_b = n.dot(&(c - p).cross(&(a - p))) / n.norm_squared();
        Deepest { foot: face.foot, vertices, weights: [of_a, of_b, 1.0 - of_a - of_b] }
    }
}

/// How far above a face's plane a point sees it, times the plane's distance, m².
const SEEN: f64 = 1e-14;

/// The border of what a new vertex sees, as edges of the faces that stay, in a cycle.
struct Horizon {
    len: usize,
    edges: [(u8, u8); MOST_VERTICES],
}

/// The least depth along one of the shapes' axes, m: no less than the depth.
fn along_axes(difference: &Difference) -> f64 {
    let axes = difference.shapes.iter().flat_map(|shape| (0..3).map(|k| shape.shape.axis(k)));
    let reach = |d: Vec3| difference.support(&d).w.dot(&d);
    axes.map(|axis| reach(axis).min(reach(-axis))).fold(f64::INFINITY, f64::min)
}

fn normal([a, b, c]: &[Vertex; 3]) -> Option<Vec3> {
    (b.w - a.w).cross(&(c.w - a.w)).try_normalize(MIN_VAL)
}

fn tetrahedron_holds_origin(w: &[Vec3; 4]) -> bool {
    let volume = |a: &Vec3, b: &Vec3, c: &Vec3| a.dot(&b.cross(c));
    let parts = [-volume(&w[1], &w[2], &w[3]), volume(&w[0], &w[2], &w[3]), -volume(&w[0], &w[1], &w[3])];
    let parts = [parts[0], parts[1], parts[2], volume(&w[0], &w[1], &w[2])];
    let whole: f64 = parts.iter().sum();
    // The origin may be on a face, to rounding.
    parts.iter().all(|&part| part / whole > -1e-12)
}
