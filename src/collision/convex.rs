//! Pairs without a closed form: any two convex shapes, by their support functions.
//!
//! Cores that are apart ([`super::gjk`]) give the distance and the normal directly: the radii are around them. Where they
//! overlap, the depth is that of the whole shapes ([`super::epa`]). What touches is a point, or, where flat or straight
//! parts face each other, up to four points that stand for where these parts overlap ([`super::manifold`]).
//!
//! All of it is MuJoCo 4.0's, to the tolerance to which it computes: its search for the depth ends 1e-6 m short of the
//! surface, or after 35 steps, so a normal may be off by 1e-3 rad; so is Penny's, by the same, because it takes the
//! same steps. `tests/collision/pairs.md` says how far the two agree.

use super::epa::deepest;
use super::gjk::{Convex, Difference, TOLERANCE, nearest};
use super::manifold::{Touch, spread};
use super::{Hits, Placed};
use crate::math::Vec3;
use crate::model::GeomKind;

/// The collider of any two convex shapes.
pub(super) fn convex(kinds: [GeomKind; 2], a: &Placed, b: &Placed, margin: f64, out: &mut Hits) {
    let shapes = [Convex::new(kinds[0], a, margin), Convex::new(kinds[1], b, margin)];
    let mut difference = Difference { shapes, between: a.pos - b.pos, whole: 0.0 };
    let reach = shapes[0].radius + shapes[1].radius;
    let touching = margin - TOUCH * (a.size.sum() + b.size.sum());
    if reach > 0.0 {
        let Some((x, simplex)) = nearest(&difference, reach) else { return };
        let gap = x.norm();
        if gap > TOLERANCE {
            if gap > reach {
                return;
            }
            let normal = x / -gap;
            let [p, q] = [simplex.mean(|v| v.a), simplex.mean(|v| v.b)];
            let on = [p + normal * shapes[0].radius, q - normal * shapes[1].radius];
            let touch = Touch { shapes, normal, on, dist: gap - reach + margin, margin };
            if touch.dist <= touching {
                spread(&touch, &simplex.vertices[..simplex.len], out);
            }
            return;
        }
    }
    difference.whole = 1.0;
    let Some((x, simplex)) = nearest(&difference, 0.0) else { return };
    if x.norm() > TOLERANCE {
        return;
    }
    let Some(found) = deepest(&difference, &simplex) else { return };
    let depth = found.foot.norm();
    let mean = |of: fn(&super::gjk::Vertex) -> Vec3| -> Vec3 {
        found.vertices.iter().zip(found.weights).map(|(v, weight)| of(v) * weight).sum()
    };
    let on = [mean(|v| v.a), mean(|v| v.b)];
    let touch = Touch { shapes, normal: found.foot / depth, on, dist: margin - depth, margin };
    if touch.dist <= touching {
        spread(&touch, &found.vertices, out);
    }
}

/// Depth, per size, from which shapes count as touching: those that stand exactly on each other, a turret on its base,
/// do not, whatever the last bits say.
///
/// Source: MuJoCo 4.0, where contact begins at about that depth. Up to its tolerance of 1e-6 m it may also report one
/// point whose normal leads the wrong way, about as often as none; Penny has none there.
const TOUCH: f64 = 1e-13;
