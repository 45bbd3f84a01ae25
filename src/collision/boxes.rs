//! Box against box: the axis along which the boxes overlap least, then the points where they touch.
//!
//! Two boxes are apart if one of 15 axes separates them: three face normals of each and nine products of their
//! edges (separating-axis theorem). The axis of largest separation says what touches:
//!
//! - a face normal: the facing face of the other box, clipped by the four sides of this face, each vertex nearer
//!   than the margin being a contact (Sutherland and Hodgman, 1974);
//! - a product of two edges: one contact midway between the closest points of these edges.
//!
//! A face wins near-ties, because several points hold a box better than one: an edge axis must be better by 1e-6
//! of its separation, and by 5 % of the face's where the two axes are within 8° of each other.
//!
//! Source: MuJoCo 4.0 (box-box collider rewritten in 3.12), thresholds confirmed by running it.
//!
//! Features: a corner of the first box (0–7, bit 0 is x), a corner of the second (8–15), or two crossing edges.

use super::{Hit, Hits, Placed};
use crate::math::{MIN_VAL, Mat3, Vec3};

/// Slack of the separation tests for rounding, per half-size.
const ROUNDING: f64 = 1e-13;
/// sin² of the angle between edges below which their product is noise.
const PARALLEL: f64 = 1e-16;
/// What an edge axis must be better by than a face axis, relative.
const EDGE_BIAS: f64 = 1e-6;
/// An edge axis this close (cosine) to the best face axis must be better by [`ALIAS_BIAS`] of the separation.
const ALIAS: f64 = 0.99;
const ALIAS_BIAS: f64 = 0.05;
/// Component of the separating axis below which both corners support it.
const AMBIGUOUS: f64 = 1e-9;
/// Clipped vertices closer than the root of this, relative to the face, are one.
const DUPLICATE: f64 = 1e-14;
/// A vertex this close to a corner, relative to the half-size, is named after the corner.
const AT_CORNER: f64 = 1.0 - 1e-6;

/// Each axis with the two that follow it.
const CYCLES: [[usize; 3]; 3] = [[0, 1, 2], [1, 2, 0], [2, 0, 1]];

/// The two boxes seen from each other.
struct Boxes<'a> {
    a: &'a Placed<'a>,
    b: &'a Placed<'a>,
    /// Axes of b (columns) in a.
    rot: Mat3,
    /// Centre of b in a, and of a in b.
    b_in_a: Vec3,
    a_in_b: Vec3,
}

/// What the axis of largest separation belongs to.
#[derive(Clone, Copy)]
enum Axis {
    FaceOfA(usize),
    FaceOfB(usize),
    /// Edges along these axes of a and b.
    Edges(usize, usize),
}

pub fn box_box(a: &Placed, b: &Placed, margin: f64, out: &mut Hits) {
    let between = b.pos - a.pos;
    let boxes =
        Boxes { a, b, rot: a.mat.tr_mul(b.mat), b_in_a: a.mat.tr_mul(&between), a_in_b: b.mat.tr_mul(&(-between)) };
    let slack = margin + ROUNDING * (a.size.sum() + b.size.sum());
    match separation(&boxes, slack) {
        None => {}
        Some(Axis::FaceOfA(i)) => face_contacts(&boxes, true, i, margin, out),
        Some(Axis::FaceOfB(j)) => face_contacts(&boxes, false, j, margin, out),
        Some(Axis::Edges(i, j)) => edge_contact(&boxes, i, j, slack, out),
    }
}

/// The axis of largest separation, or none if the boxes are further apart than `slack`.
fn separation(boxes: &Boxes, slack: f64) -> Option<Axis> {
    let (sa, sb) = (boxes.a.size, boxes.b.size);
    let abs = boxes.rot.abs();
    let mut face = f64::NEG_INFINITY;
    let mut face_axis = Axis::FaceOfA(0);
    for i in 0..3 {
        let radius = abs[(i, 0)] * sb.x + abs[(i, 1)] * sb.y + abs[(i, 2)] * sb.z;
        let sep = boxes.b_in_a[i].abs() - sa[i] - radius;
        if sep > slack {
            return None;
        }
        if sep > face {
            (face, face_axis) = (sep, Axis::FaceOfA(i));
        }
    }
    for j in 0..3 {
        let radius = abs[(0, j)] * sa.x + abs[(1, j)] * sa.y + abs[(2, j)] * sa.z;
        let sep = boxes.a_in_b[j].abs() - sb[j] - radius;
        if sep > slack {
            return None;
        }
        if sep > face {
            (face, face_axis) = (sep, Axis::FaceOfB(j));
        }
    }
    let mut best = face;
    let mut edges = None;
    for i in CYCLES {
        for j in CYCLES {
            let (gap, norm2) = edge_gap(boxes, &abs, i, j);
            // gap / norm ≤ best, without the root: squares keep the order if they keep the sign.
            if norm2 < PARALLEL || gap * gap.abs() <= best * best.abs() * norm2 {
                continue;
            }
            let sep = gap / norm2.sqrt();
            if sep > slack {
                return None;
            }
            if sep - EDGE_BIAS * sep.abs() > best && sep > face {
                best = sep;
                edges = Some((i[0], j[0]));
            }
        }
    }
    let Some((i, j)) = edges else { return Some(face_axis) };
    let normal = edge_axis(&boxes.rot, i, j);
    let along_face = match face_axis {
        Axis::FaceOfB(f) => boxes.rot.column(f).dot(&normal),
        Axis::FaceOfA(f) | Axis::Edges(f, _) => normal[f],
    };
    if along_face.abs() > ALIAS && best < face + ALIAS_BIAS * face.abs() + MIN_VAL {
        return Some(face_axis);
    }
    Some(Axis::Edges(i, j))
}

/// Separation along m = e_i × R_j times |m|, and |m|².
///
///     sep |m| = |m·p| − Σ_{k≠i} a_k |m_k| − Σ_{k≠j} b_k |m·R_k|,     |m·R_k| = |(R_j × R_k)_i| = |R_il|
///
/// with p the centre and R_k the axes of b in a, a_k and b_k half-sizes, l the third axis beside j and k.
fn edge_gap(boxes: &Boxes, abs: &Mat3, [i, i1, i2]: [usize; 3], [j, j1, j2]: [usize; 3]) -> (f64, f64) {
    let (m1, m2) = (-boxes.rot[(i2, j)], boxes.rot[(i1, j)]);
    let reach = boxes.a.size[i1] * abs[(i2, j)]
        + boxes.a.size[i2] * abs[(i1, j)]
        + boxes.b.size[j1] * abs[(i, j2)]
        + boxes.b.size[j2] * abs[(i, j1)];
    ((m1 * boxes.b_in_a[i1] + m2 * boxes.b_in_a[i2]).abs() - reach, m1 * m1 + m2 * m2)
}

/// unit(e_i × R e_j), in a's axes.
fn edge_axis(rot: &Mat3, i: usize, j: usize) -> Vec3 {
    let (i1, i2) = ((i + 1) % 3, (i + 2) % 3);
    let mut m = Vec3::zeros();
    m[i1] = -rot[(i2, j)];
    m[i2] = rot[(i1, j)];
    m / m.norm()
}

/// One contact midway between the closest points of the edges that support the axis.
fn edge_contact(boxes: &Boxes, i: usize, j: usize, slack: f64, out: &mut Hits) {
    let (sa, sb, rot) = (boxes.a.size, boxes.b.size, &boxes.rot);
    let mut axis = edge_axis(rot, i, j);
    if axis.dot(&boxes.b_in_a) < 0.0 {
        axis = -axis;
    }
    let axis_b = rot.tr_mul(&axis);
    // Middle of the supporting edge of each box, in its own axes. Where a component of the axis is all but zero
    // both signs support it: keep the pair of edges whose closest points are closest.
    let mut best = f64::INFINITY;
    let mut closest = (Vec3::zeros(), Vec3::zeros(), 0);
    for a_mid in supports(&axis, i, sa).into_iter().flatten() {
        for b_mid in supports(&-axis_b, j, sb).into_iter().flatten() {
            let from = rot * b_mid + boxes.b_in_a;
            let (s, t) = closest_on_edges(&(from - a_mid), i, sa[i], &rot.column(j).into_owned(), sb[j]);
            let mut x = a_mid;
            x[i] += s;
            let y = from + rot.column(j) * t;
            let gap2 = (y - x).norm_squared();
            if gap2 < best {
                best = gap2;
                closest = (x, y, crossing(edge_id(i, corner_id(&a_mid)), edge_id(j, corner_id(&b_mid))));
            }
        }
    }
    let (x, y, feature) = closest;
    let dist = axis.dot(&(y - x));
    if dist > slack {
        return;
    }
    let pos = boxes.a.pos + boxes.a.mat * ((x + y) * 0.5);
    out.push(Hit { dist, pos, normal: boxes.a.mat * axis, tangent: Vec3::zeros(), feature });
}

/// The middle of the edge along axis `along` that lies furthest in direction `toward`, and, where that is
/// ambiguous, its neighbour.
fn supports(toward: &Vec3, along: usize, size: &Vec3) -> [Option<Vec3>; 2] {
    let mut mid = Vec3::zeros();
    let mut neighbour = None;
    for k in [(along + 1) % 3, (along + 2) % 3] {
        mid[k] = if toward[k] >= 0.0 { size[k] } else { -size[k] };
    }
    for k in [(along + 2) % 3, (along + 1) % 3] {
        if toward[k].abs() < AMBIGUOUS {
            let mut other = mid;
            other[k] = -other[k];
            neighbour = Some(other);
        }
    }
    [Some(mid), neighbour]
}

/// Closest points s e_i and e + t d of two edges of half-lengths `sa`, `sb`, as parameters (s, t).
fn closest_on_edges(e: &Vec3, i: usize, sa: f64, d: &Vec3, sb: f64) -> (f64, f64) {
    let cos = d[i];
    let sin2 = 1.0 - cos * cos;
    let along = d.dot(e);
    let s = if sin2 < MIN_VAL { 0.0 } else { (e[i] - cos * along) / sin2 };
    let t = (cos * s.clamp(-sa, sa) - along).clamp(-sb, sb);
    ((e[i] + cos * t).clamp(-sa, sa), t)
}

/// A polygon: x and y in the reference face, height above it, and (u, v) from −1 to 1 on the incident face.
struct Polygon {
    len: usize,
    vertices: [[f64; 5]; 8],
}

impl Polygon {
    /// Cuts off what is beyond sign · v[coord] = limit.
    fn clip(&mut self, coord: usize, sign: f64, limit: f64) {
        let mut beyond = [0.0; 8];
        let mut inside = true;
        for (b, v) in beyond.iter_mut().zip(&self.vertices[..self.len]) {
            *b = sign * v[coord] - limit;
            inside &= *b <= 0.0;
        }
        if inside {
            return;
        }
        let old = self.vertices;
        let n = std::mem::take(&mut self.len);
        for k in 0..n {
            let next = if k + 1 == n { 0 } else { k + 1 };
            let (p, q) = (beyond[k], beyond[next]);
            if p <= 0.0 {
                self.push(old[k]);
            }
            if p * q < 0.0 {
                let t = p / (p - q);
                self.push(std::array::from_fn(|c| old[k][c] + t * (old[next][c] - old[k][c])));
            }
        }
    }

    fn push(&mut self, vertex: [f64; 5]) {
        if self.len < 8 {
            self.vertices[self.len] = vertex;
            self.len += 1;
        }
    }
}

/// The facing face of the incident box, clipped by the sides of the reference face: axis `f` of box a or b.
fn face_contacts(boxes: &Boxes, a_is_reference: bool, f: usize, margin: f64, out: &mut Hits) {
    let (reference, incident, center, rot) = if a_is_reference {
        (boxes.a, boxes.b, &boxes.b_in_a, boxes.rot)
    } else {
        (boxes.b, boxes.a, &boxes.a_in_b, boxes.rot.transpose())
    };
    let sign = if center[f] >= 0.0 { 1.0 } else { -1.0 };
    let (fx, fy) = ((f + 1) % 3, (f + 2) % 3);

    // The incident face: the one most opposed to the reference normal.
    let mut g = 0;
    for k in 1..3 {
        if rot[(f, k)].abs() > rot[(f, g)].abs() {
            g = k;
        }
    }
    let g_sign = if sign * rot[(f, g)] > 0.0 { -1.0 } else { 1.0 };
    let (gu, gv) = ((g + 1) % 3, (g + 2) % 3);

    // Its centre and half edges, as (x, y, height).
    let seen = |v: Vec3| Vec3::new(v[fx], v[fy], sign * v[f]);
    let mut middle = seen(center + rot.column(g) * (g_sign * incident.size[g]));
    middle.z -= reference.size[f];
    let du = seen(rot.column(gu) * incident.size[gu]);
    let dv = seen(rot.column(gv) * incident.size[gv]);
    let vertex = |u: f64, v: f64| {
        let p = middle + du * u + dv * v;
        [p.x, p.y, p.z, u, v]
    };
    let none = [0.0; 5];
    let corners = [vertex(1.0, 1.0), vertex(-1.0, 1.0), vertex(-1.0, -1.0), vertex(1.0, -1.0), none, none, none, none];
    let mut polygon = Polygon { len: 4, vertices: corners };

    let (sx, sy) = (reference.size[fx], reference.size[fy]);
    polygon.clip(0, 1.0, sx);
    polygon.clip(0, -1.0, sx);
    polygon.clip(1, 1.0, sy);
    polygon.clip(1, -1.0, sy);

    let normal = reference.axis(f) * if a_is_reference { sign } else { -sign };
    let duplicate = DUPLICATE * (sx * sx + sy * sy);
    let vertices = &polygon.vertices[..polygon.len];
    for (k, &[x, y, dist, u, v]) in vertices.iter().enumerate() {
        let twin = |q: &[f64; 5]| q[2] <= margin && (q[0] - x).powi(2) + (q[1] - y).powi(2) < duplicate;
        if dist > margin || vertices[..k].iter().any(twin) {
            continue;
        }
        let mut local = Vec3::zeros();
        local[fx] = x;
        local[fy] = y;
        local[f] = sign * (reference.size[f] + 0.5 * dist);
        let on_reference = OnFace { f, sign, x: x / sx, y: y / sy };
        let on_incident = OnFace { f: g, sign: g_sign, x: u, y: v };
        let feature = if a_is_reference { name(on_reference, on_incident) } else { name(on_incident, on_reference) };
        out.push(Hit { dist, pos: reference.pos + reference.mat * local, normal, tangent: Vec3::zeros(), feature });
    }
}

/// A point on the face ±f of a box; x and y from −1 to 1 along the next two axes.
#[derive(Clone, Copy)]
struct OnFace {
    f: usize,
    sign: f64,
    x: f64,
    y: f64,
}

impl OnFace {
    fn nearest_corner(self) -> u32 {
        let bit = |k: usize, positive: bool| u32::from(positive) << (k % 3);
        bit(self.f, self.sign > 0.0) | bit(self.f + 1, self.x > 0.0) | bit(self.f + 2, self.y > 0.0)
    }
    fn at_corner(self) -> bool {
        self.x.abs().min(self.y.abs()) > AT_CORNER
    }
    fn nearest_edge(self) -> u32 {
        let along = if self.x.abs() > self.y.abs() { self.f + 2 } else { self.f + 1 };
        edge_id(along % 3, self.nearest_corner())
    }
}

/// The feature of a point on a face of each box. It does not depend on which of the two is the reference, nor, for
/// boxes of one size stacked exactly, on the last bits.
fn name(a: OnFace, b: OnFace) -> u32 {
    if a.at_corner() {
        a.nearest_corner()
    } else if b.at_corner() {
        8 + b.nearest_corner()
    } else {
        crossing(a.nearest_edge(), b.nearest_edge())
    }
}

/// Bit k is set where component k is positive.
fn corner_id(p: &Vec3) -> u32 {
    u32::from(p.x > 0.0) | u32::from(p.y > 0.0) << 1 | u32::from(p.z > 0.0) << 2
}

/// The edge along an axis through a corner: 0–23.
fn edge_id(along: usize, corner: u32) -> u32 {
    8 * along as u32 + (corner & !(1 << along))
}

fn crossing(edge_a: u32, edge_b: u32) -> u32 {
    16 + 24 * edge_a + edge_b
}
