//! Where shapes touch: one file a shape, one table [`collider`].
//!
//! Contact points, their order, frames and signs are MuJoCo's: the normal points from the first geom to the
//! second, `dist` is negative in penetration, and the point lies midway between the two surfaces. Pairs for which
//! MuJoCo has no closed form either are found by its search ([`convex`]): they agree as far as MuJoCo agrees with itself
//! when a last digit changes ([`exact`]).

mod boxes;
pub mod broad_phase;
mod capsule;
mod capsule_box;
mod convex;
pub mod detect;
mod epa;
mod gjk;
mod manifold;
mod plane;
pub mod ray;
mod sphere;

use crate::math::{Mat3, Vec3};
use crate::model::{GeomKind, Model, Pair};
use broad_phase::BroadPhase;

pub use detect::detect;
pub use manifold::POINT;

/// What the search for contacts keeps between steps.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    hits: Hits,
    broad_phase: BroadPhase,
    last: detect::Framed,
}

/// How many contacts to have room for: all that the listed pairs can have, and for each geom of the broad phase as
/// many as it has in a heap.
pub fn room(model: &Model) -> usize {
    let sphere = |g: &usize| model.geoms[*g].kind == GeomKind::Sphere;
    let most = |pair: &Pair| if pair.geom.iter().any(sphere) { 1 } else { MAX_HITS };
    model.pairs.listed.iter().map(most).sum::<usize>() + MAX_HITS * model.pairs.swept.len()
}

/// A shape where it is: size as in [`crate::model::Geom`], centre and axes in the world.
#[derive(Clone, Copy, Debug)]
pub struct Placed<'a> {
    /// As in [`Geom`](crate::model::Geom), m.
    pub size: &'a Vec3,
    /// Centre in the world, m.
    pub pos: &'a Vec3,
    /// Columns are the shape's axes.
    pub mat: &'a Mat3,
}

impl Placed<'_> {
    /// The shape's i-th axis in the world.
    fn axis(&self, i: usize) -> Vec3 {
        self.mat.column(i).into_owned()
    }
}

/// One point of contact.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Signed distance, m; negative in penetration.
    pub dist: f64,
    /// Midway between the two surfaces, world, m.
    pub pos: Vec3,
    /// Unit, from the first shape to the second.
    pub normal: Vec3,
    /// First tangent, where the pair of shapes prescribes one (not necessarily orthogonal to the normal);
    /// zero where it does not.
    pub tangent: Vec3,
    /// Which corner, end or edge point this is: the same number for the same feature in every step.
    pub feature: u32,
}

/// The largest number of points two shapes can touch in.
pub const MAX_HITS: usize = 8;

/// Contact points of one pair, without allocation.
#[derive(Clone, Debug)]
pub struct Hits {
    len: usize,
    hits: [Hit; MAX_HITS],
}

impl Default for Hits {
    fn default() -> Hits {
        let none = Hit { dist: 0.0, pos: Vec3::zeros(), normal: Vec3::zeros(), tangent: Vec3::zeros(), feature: 0 };
        Hits { len: 0, hits: [none; MAX_HITS] }
    }
}

impl Hits {
    /// Forgets all of them.
    pub fn clear(&mut self) {
        self.len = 0;
    }
    /// Adds a point; beyond [`MAX_HITS`] points it is dropped, as in MuJoCo.
    pub fn push(&mut self, hit: Hit) {
        if self.len < MAX_HITS {
            self.hits[self.len] = hit;
            self.len += 1;
        }
    }
    /// All of them, in the order in which they were found.
    pub fn as_slice(&self) -> &[Hit] {
        &self.hits[..self.len]
    }
}

/// Finds the points where two shapes are closer than `margin` (m) and appends them to the list.
pub type Collider = fn(a: &Placed, b: &Placed, margin: f64, out: &mut Hits);

/// The collider for two kinds, the lower kind first; `None` if Penny has none.
pub fn collider(a: GeomKind, b: GeomKind) -> Option<Collider> {
    COLLIDERS[a as usize][b as usize]
}

/// By the kinds, in their order: looked up for each pair that is near, in every step.
static COLLIDERS: [[Option<Collider>; 6]; 6] = {
    use GeomKind::*;
    let kinds = [Plane, Sphere, Capsule, Ellipsoid, Cylinder, Box];
    let mut table = [[None; 6]; 6];
    let mut i = 0;
    while i < 36 {
        table[i / 6][i % 6] = serving(kinds[i / 6], kinds[i % 6]);
        i += 1;
    }
    table
};

const fn serving(a: GeomKind, b: GeomKind) -> Option<Collider> {
    use GeomKind::*;
    Some(match (a, b) {
        (Plane, Sphere) => plane::plane_sphere,
        (Plane, Capsule) => plane::plane_capsule,
        (Plane, Ellipsoid) => plane::plane_ellipsoid,
        (Plane, Cylinder) => plane::plane_cylinder,
        (Plane, Box) => plane::plane_box,
        (Sphere, Sphere) => sphere::sphere_sphere,
        (Sphere, Capsule) => sphere::sphere_capsule,
        (Sphere, Cylinder) => sphere::sphere_cylinder,
        (Sphere, Box) => sphere::sphere_box,
        (Capsule, Capsule) => capsule::capsule_capsule,
        (Capsule, Box) => capsule_box::capsule_box,
        (Box, Box) => boxes::box_box,
        (Sphere, Ellipsoid) => |a, b, margin, out| convex::convex([Sphere, Ellipsoid], a, b, margin, out),
        (Capsule, Ellipsoid) => |a, b, margin, out| convex::convex([Capsule, Ellipsoid], a, b, margin, out),
        (Capsule, Cylinder) => |a, b, margin, out| convex::convex([Capsule, Cylinder], a, b, margin, out),
        (Ellipsoid, Ellipsoid) => |a, b, margin, out| convex::convex([Ellipsoid, Ellipsoid], a, b, margin, out),
        (Ellipsoid, Cylinder) => |a, b, margin, out| convex::convex([Ellipsoid, Cylinder], a, b, margin, out),
        (Ellipsoid, Box) => |a, b, margin, out| convex::convex([Ellipsoid, Box], a, b, margin, out),
        (Cylinder, Cylinder) => |a, b, margin, out| convex::convex([Cylinder, Cylinder], a, b, margin, out),
        (Cylinder, Box) => |a, b, margin, out| convex::convex([Cylinder, Box], a, b, margin, out),
        _ => return None,
    })
}

/// Whether Penny's contacts of two kinds (the lower first) are MuJoCo's to rounding. The others are found by the same
/// search in the same steps, but some of them hang on the last bits, which may send it elsewhere: by up to 1e-5 rad and
/// 1e-6 m for round shapes, to other corners of an area where several are as good (`tests/collision/pairs.md`).
pub fn exact(a: GeomKind, b: GeomKind) -> bool {
    use GeomKind::*;
    !matches!(
        (a, b),
        (Sphere | Capsule | Ellipsoid, Ellipsoid)
            | (Capsule | Ellipsoid | Cylinder, Cylinder)
            | (Ellipsoid | Cylinder, Box)
    )
}

/// The contact frame: rows are the normal and two tangents.
///
///     t₁ = unit(t − (t·n) n),     t₂ = n × t₁
///
/// with t the pair's own tangent, or else the world's y axis, or its z axis where the normal is within 60° of y.
///
/// Source: MuJoCo 4.0 manual, Computation › Contact › frame; which axis is chosen was found by running it.
#[inline(always)]
pub fn frame(normal: &Vec3, tangent: &Vec3) -> Mat3 {
    let mut t = *tangent;
    if t.norm_squared() < 0.25 {
        t = if normal.y.abs() < 0.5 { Vec3::y() } else { Vec3::z() };
    }
    let along = t.dot(normal);
    if along != 0.0 {
        t -= normal * along;
        let square = t.norm_squared();
        t = if square > 1e-6 { t / square.sqrt() } else { short_tangent(&t, normal) };
    }
    let s = normal.cross(&t);
    Mat3::new(normal.x, normal.y, normal.z, t.x, t.y, t.z, s.x, s.y, s.z)
}

/// t₁ of a tangent that is nearly the normal, as a capsule standing upright prescribes it: of what is left of it, made to be across the
/// normal once more, for rounding (1e-16) is up to 1e-4 of what is left; or else, where rounding is all that is left, of the
/// world's x axis.
///
/// Source: the x axis by running MuJoCo, which takes it as it is, and rounding, too.
#[cold]
fn short_tangent(left: &Vec3, normal: &Vec3) -> Vec3 {
    let across = |t: Vec3| (t - normal * t.dot(normal)).try_normalize(1e-3);
    let left = left.try_normalize(1e-12).and_then(across);
    left.or_else(|| across(Vec3::x())).unwrap_or(Vec3::y())
}
