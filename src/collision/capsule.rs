//! A capsule against a capsule: the closest points of two segments, as balls.

use super::sphere::balls;
use super::{Hits, Placed};

/// sin² of the angle between axes below which capsules count as parallel and touch in two points.
const PARALLEL: f64 = 1e-8;

/// One contact at the closest points of the two segments c₁ + s a₁, |s| ≤ h₁, and c₂ + t a₂, |t| ≤ h₂; two for
/// parallel capsules, at the ends of the stretch where they lie side by side.
///
///     s = (d₁ − b d₂) / sin²,     t = (b d₁ − d₂) / sin²,     b = a₁·a₂,  dᵢ = aᵢ·(c₂ − c₁)
///
/// then clipped to the segments, each clip solving for the other anew. Parallel: from the larger of −h₁ and
/// d₁ − h₂ to the smaller of h₁ and d₁ + h₂.
///
/// Features: 0; of parallel capsules 1 at the lower end along the first axis, 2 at the upper.
pub fn capsule_capsule(a: &Placed, b: &Placed, margin: f64, out: &mut Hits) {
    let (axis1, h1) = (a.axis(2), a.size.y);
    let (axis2, h2) = (b.axis(2), b.size.y);
    let between = b.pos - a.pos;
    let cos = axis1.dot(&axis2);
    let (d1, d2) = (axis1.dot(&between), axis2.dot(&between));
    let sin2 = axis1.cross(&axis2).norm_squared();

    let mut touch = |s: f64, t: f64, feature: u32| {
        let (x, y) = (a.pos + axis1 * s, b.pos + axis2 * t);
        if let Some(hit) = balls(a, &x, a.size.x, b, &y, b.size.x, margin) {
            out.push(super::Hit { feature, ..hit });
        }
    };
    if sin2 >= PARALLEL {
        let s = ((d1 - cos * d2) / sin2).clamp(-h1, h1);
        let t = cos * s - d2;
        if t.abs() <= h2 {
            touch(s, t, 0);
        } else {
            let t = t.clamp(-h2, h2);
            touch((d1 + cos * t).clamp(-h1, h1), t, 0);
        }
    } else {
        // The end of the second segment that is lower (then upper) along the first axis, if it lies beside the
        // first segment; otherwise the first segment's end.
        for (feature, end) in [(1, -h2.copysign(cos)), (2, h2.copysign(cos))] {
            let s = d1 + cos * end;
            if s.abs() <= h1 {
                touch(s, end, feature);
            } else {
                let s = s.clamp(-h1, h1);
                touch(s, (cos * s - d2).clamp(-h2, h2), feature);
            }
        }
    }
}
