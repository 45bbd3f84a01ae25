//! A capsule against a box: up to two balls on the capsule's segment against the box.
//!
//! In the box's axes the segment is p + s h, −1 ≤ s ≤ 1. The first ball is where the segment comes nearest to the
//! box's surface. The second is where the segment leaves the face or edge that it lies along, so that a capsule
//! can rest on a box; there is none where it points away from the box.
//!
//! Source: behaviour of MuJoCo 4.0's capsule-box collider, including what it does where this is a matter of choice.

use super::sphere::ball_box;
use super::{Hit, Hits, Placed};
use crate::math::{MIN_VAL, Vec3};

/// The capsule's segment and the box's half-sizes, in the box's axes.
struct Segment {
    p: Vec3,
    h: Vec3,
    /// Half-length of the segment, m.
    len: f64,
    size: Vec3,
}

/// Where the segment is nearest to the box.
enum Nearest {
    /// An end is over the face of this axis.
    Face(usize),
    /// An end is inside the box.
    Inside,
    /// A corner (bit k: positive along k).
    Corner(usize),
    /// Inside the edge along `axis` from the corner with bit `axis` clear; at `at` on it, from −1 to 1.
    Edge { axis: usize, corner: usize, at: f64 },
}

/// Features: 0 for the ball nearer to the −axis end, 1 for the other; a single one counts by its half.
pub fn capsule_box(capsule: &Placed, cuboid: &Placed, margin: f64, out: &mut Hits) {
    let (r, len) = (capsule.size.x, capsule.size.y);
    let half = capsule.axis(2) * len;
    let segment = Segment {
        p: cuboid.mat.tr_mul(&(capsule.pos - cuboid.pos)),
        h: cuboid.mat.tr_mul(&half),
        len,
        size: *cuboid.size,
    };
    if (0..3).any(|k| segment.p[k].abs() - segment.h[k].abs() - segment.size[k] > r + margin) {
        return;
    }
    let Some((s, nearest)) = segment.nearest() else { return };
    let step = segment.second(s, &nearest);
    let mut touch = |at: f64, feature: u32| {
        if let Some(hit) = ball_box(&(capsule.pos + half * at), r, cuboid, margin) {
            out.push(Hit { feature, ..hit });
        }
    };
    match step {
        None => touch(s, u32::from(s > 0.0)),
        Some(step) => {
            let forward = u32::from(step > 0.0);
            touch(s, 1 - forward);
            touch(s + step, forward);
        }
    }
}

impl Segment {
    /// The point of the segment nearest to the box: an end over a face, or a point over one of the twelve edges.
    fn nearest(&self) -> Option<(f64, Nearest)> {
        let mut best = f64::INFINITY;
        let mut found = None;
        for s in [-1.0, 1.0] {
            let end = self.p + self.h * s;
            let beyond = Vec3::from_fn(|k, _| end[k] - end[k].clamp(-self.size[k], self.size[k]));
            let mut outside = (0..3).filter(|&k| beyond[k] != 0.0);
            let nearest = match (outside.next(), outside.next()) {
                (None, _) => Nearest::Inside,
                (Some(k), None) => Nearest::Face(k),
                _ => continue,
            };
            let dist2 = beyond.norm_squared();
            if dist2 < best {
                best = dist2;
                found = Some((s, nearest));
            }
        }
        for axis in 0..3 {
            let e = self.size[axis];
            let (ee, hh, b) = (e * e, self.len * self.len, -e * self.h[axis]);
            let det = ee * hh - b * b;
            if det.abs() < MIN_VAL {
                continue;
            }
            for corner in (0..8).filter(|corner| corner >> axis & 1 == 0) {
                let (dist2, s, nearest) = self.to_edge(axis, corner, [ee, hh, b, 1.0 / det]);
                if dist2 < best - MIN_VAL {
                    best = dist2;
                    found = Some((s, nearest));
                }
            }
        }
        found
    }

    /// Squared distance to an edge, where on the segment, and where on the box.
    ///
    /// The edge is m + x e with e along `axis`. Both parameters at the minimum of |m + x e − p − s h|²:
    ///
    ///     x = (H u − b v)/(E H − b²),   s = (E v − b u)/(E H − b²)
    ///     E = e², H = h², b = −e·h, u = −e·(m − p), v = h·(m − p)
    ///
    /// then x is clipped and s solved for anew, then s is clipped and x solved for and clipped. An edge parameter
    /// that was once clipped counts as the corner.
    /// `[E, H, b, 1/(E H − b²)]` are the same for the four edges along an axis.
    fn to_edge(&self, axis: usize, corner: usize, [ee, hh, b, inverse]: [f64; 4]) -> (f64, f64, Nearest) {
        let mut middle = Vec3::from_fn(|k, _| if corner >> k & 1 == 1 { self.size[k] } else { -self.size[k] });
        middle[axis] = 0.0;
        let from = middle - self.p;
        let e = self.size[axis];
        let (u, v) = (-e * from[axis], self.h.dot(&from));
        let mut x = (hh * u - b * v) * inverse;
        let mut s = (ee * v - b * u) * inverse;
        let mut end = 0.0;
        if x.abs() > 1.0 {
            x = 1f64.copysign(x);
            end = x;
            s = (v - b * x) / hh;
        }
        if s.abs() > 1.0 {
            s = 1f64.copysign(s);
            x = (u - b * s) / ee;
            if x.abs() > 1.0 {
                x = 1f64.copysign(x);
                end = x;
            }
        }
        let mut gap = from - self.h * s;
        gap[axis] += e * x;
        let nearest = if end == 0.0 {
            Nearest::Edge { axis, corner, at: x }
        } else {
            Nearest::Corner(corner | usize::from(end > 0.0) << axis)
        };
        (gap.norm_squared(), s, nearest)
    }

    /// How far along the segment from `s` the second ball is, if there is one.
    fn second(&self, s: f64, nearest: &Nearest) -> Option<f64> {
        match *nearest {
            Nearest::Inside => None,
            Nearest::Face(face) => Some(self.across_face(s, face)),
            Nearest::Corner(corner) => self.second_from_corner(s, corner),
            Nearest::Edge { axis, corner, at } => self.second_from_edge(s, axis, corner, at),
        }
    }

    /// Parameter distance in which the segment crosses the box along axis k.
    fn crossing(&self, k: usize) -> f64 {
        2.0 * self.size[k] / self.h[k].abs()
    }

    /// Bit k is set where moving along +h goes inwards from that corner along k.
    fn inwards(&self, corner: usize) -> usize {
        let direction = (0..3).fold(0, |bits, k| bits | usize::from(self.h[k] > 0.0) << k);
        direction ^ corner
    }

    /// From an end over a face to the other end, or to where the segment leaves the face's sides.
    fn across_face(&self, s: f64, face: usize) -> f64 {
        let toward = -s;
        let end = self.p + self.h * s;
        let mut step: f64 = 2.0;
        for k in (0..3).filter(|&k| k != face) {
            for side in [self.size[k], -self.size[k]] {
                let t = (side - end[k]) / self.h[k] * toward;
                if t > 0.0 && t < step {
                    step = t;
                }
            }
        }
        step * toward
    }

    /// From a corner along the edge or across the face that the segment lies along: the one direction that goes
    /// inwards where the other two go outwards, if it is steep; else the opposite way.
    fn second_from_corner(&self, s: f64, corner: usize) -> Option<f64> {
        let inwards = self.inwards(corner);
        let (single, toward) = match inwards {
            1 | 2 | 4 => (inwards, 1.0),
            3 | 5 | 6 => (7 - inwards, -1.0),
            _ => return None,
        };
        let k = single.trailing_zeros() as usize;
        if self.h[k] * self.h[k] > 0.5 * self.len * self.len {
            Some(toward * (1.0 - toward * s).min(self.crossing(k)))
        } else {
            let step = (1.0 + toward * s).min(self.crossing((k + 1) % 3)).min(self.crossing((k + 2) % 3));
            Some(-toward * step)
        }
    }

    /// From the inside of an edge across the face that the segment is more nearly parallel to, to the segment's
    /// end or where it leaves the face.
    fn second_from_edge(&self, s: f64, axis: usize, corner: usize, at: f64) -> Option<f64> {
        let inwards = self.inwards(corner) & !(1 << axis);
        if inwards.count_ones() != 1 {
            return None;
        }
        let (k1, k2) = ((axis + 1) % 3, (axis + 2) % 3);
        let across = if self.h[k1].abs() > self.h[k2].abs() { k1 } else { k2 };
        let forward = inwards == 1 << across;
        let toward = if forward { 1.0 } else { -1.0 };
        let rest = if (self.h[axis] > 0.0) == forward { 1.0 - at } else { 1.0 + at };
        let step = (1.0 - toward * s).min(self.crossing(across)).min(self.size[axis] * rest / self.h[axis].abs());
        Some(toward * step)
    }
}
