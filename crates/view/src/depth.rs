//! Pictures of depth: which geom the middle of each pixel sees, and how far before the eye it is.
//!
//!     p(z) = eye + z d,    d · forward = 1:    the z at which the ray meets a surface is its depth
//!
//! Every shape is met where its equation says, to rounding; the triangles of [`paint`](super::paint) are for the eye.

use std::ops::Range;

use super::camera::{Axes, Camera};
use super::session::Poses;
use penny::collision::ray;
use penny::math::{self, Mat3, Vec3};
use penny::model::{GeomKind, Model};

/// What the middle of a pixel sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Along the line of sight, not along the pixel's ray, m.
    pub depth: f64,
    /// `None`: a mesh that is only seen, or nothing as far as the eye sees.
    pub geom: Option<usize>,
}

/// A pinhole camera's picture, and between which depths it sees, m.
struct Frustum {
    axes: Axes,
    size: [usize; 2],
    /// Focal length, pixels.
    focal: f64,
    range: Range<f64>,
}

/// Row by row from the top what each pixel sees between the depths of `range`, m; where it sees nothing, `range.end`.
///
/// Surfaces are seen from outside only. In: which geoms are shown; those without opacity never are.
pub fn depths(
    model: &Model,
    poses: &Poses,
    camera: &Camera,
    size: [usize; 2],
    range: Range<f64>,
    shown: impl Fn(usize) -> bool,
) -> Vec<Seen> {
    let focal = 0.5 * size[1] as f64 / (0.5 * camera.fovy).tan();
    let frustum = Frustum { axes: camera.axes(), size, focal, range };
    let nothing = Seen { depth: frustum.range.end, geom: None };
    let mut picture = vec![nothing; size[0] * size[1]];
    for (i, geom) in model.geoms.iter().enumerate().filter(|(i, g)| g.rgba[3] != 0.0 && shown(*i)) {
        let (p, q) = (poses.pos[geom.body], poses.quat[geom.body]);
        let (pos, axes) = (p + q * geom.pos, math::mat(&(q * geom.quat)));
        let plane = geom.kind == GeomKind::Plane;
        let radius = if plane { f64::INFINITY } else { geom.rbound };
        let meet = |from: &Vec3, d: &Vec3| ray::own(geom.kind, &geom.size, from, d);
        frustum.draw(&mut picture, Some(i), &pos, radius, &frustum.seen_from(&pos, &axes), |from, d| {
            // Of a closed surface that is met ahead and behind the inside would be seen.
            let met = meet(from, d)?;
            let inside = !plane && from.norm() <= radius && meet(from, &-d).is_some();
            (!inside).then_some(met)
        });
    }
    for visual in model.visuals.iter().filter(|v| v.rgba[3] != 0.0) {
        let (p, q) = (poses.pos[visual.body], poses.quat[visual.body]);
        let (pos, axes) = (p + q * visual.pos, math::mat(&(q * visual.quat)));
        let own = frustum.seen_from(&pos, &axes);
        for face in visual.mesh.faces().unwrap_or_default() {
            let corners = face.map(|c| Vec3::from(c.map(f64::from)));
            let middle = corners.iter().sum::<Vec3>() / 3.0;
            let radius = corners.iter().map(|c| (c - middle).norm()).fold(0.0, f64::max);
            frustum.draw(&mut picture, None, &(pos + axes * middle), radius, &own, |from, d| front(&corners, from, d));
        }
    }
    picture
}

impl Frustum {
    /// The eye and its axes in the frame of a thing.
    fn seen_from(&self, pos: &Vec3, axes: &Mat3) -> Axes {
        let Axes { eye, right, up, forward } = self.axes;
        let turned = |v: Vec3| axes.tr_mul(&v);
        Axes { eye: turned(eye - pos), right: turned(right), up: turned(up), forward: turned(forward) }
    }

    /// Puts what `meet` finds into the pixels that a sphere about the thing reaches, where it is nearest.
    ///
    /// In: centre and radius of the sphere; `own`, the eye in the thing's frame, in which `meet` gets its rays.
    fn draw(
        &self,
        picture: &mut [Seen],
        geom: Option<usize>,
        centre: &Vec3,
        radius: f64,
        own: &Axes,
        meet: impl Fn(&Vec3, &Vec3) -> Option<f64>,
    ) {
        let [columns, rows] = self.reach(centre, radius);
        let Axes { eye, right, up, forward } = own;
        let middle = self.size.map(|n| 0.5 * n as f64);
        for row in rows {
            for column in columns.clone() {
                let x = (column as f64 + 0.5 - middle[0]) / self.focal;
                let y = (row as f64 + 0.5 - middle[1]) / self.focal;
                let d = forward + right * x - up * y;
                let Some(t) = meet(&(eye + d * self.range.start), &d) else { continue };
                let pixel = &mut picture[row * self.size[0] + column];
                let depth = self.range.start + t;
                if depth < pixel.depth {
                    *pixel = Seen { depth, geom };
                }
            }
        }
    }

    /// Columns and rows of the pixels that a sphere can be seen in.
    ///
    ///     (x ± r)/z over all z of the sphere: greatest at z − r where x ± r is on the side of the sign, else at z + r
    fn reach(&self, centre: &Vec3, radius: f64) -> [Range<usize>; 2] {
        let Axes { eye, right, up, forward } = self.axes;
        let seen = [right, -up, forward].map(|axis| axis.dot(&(centre - eye)));
        let [near, far] = [seen[2] - radius, seen[2] + radius];
        if far < self.range.start {
            return [0..0, 0..0];
        }
        [0, 1].map(|i| {
            let n = self.size[i];
            if near.is_nan() || near <= 1e-3 * radius {
                return 0..n;
            }
            let edge = |sign: f64| {
                let out = seen[i] + sign * radius;
                0.5 * n as f64 + self.focal * out / if sign * out > 0.0 { near } else { far }
            };
            let pixel = |x: f64| x.clamp(0.0, n as f64) as usize;
            pixel(edge(-1.0).floor())..pixel(edge(1.0).ceil())
        })
    }
}

/// How far along a ray a triangle's front is met, in units of the direction's length.
///
///     o + t d = a + u (b − a) + v (c − a),    u ≥ 0, v ≥ 0, u + v ≤ 1
///
/// Source: Möller and Trumbore, Fast, minimum storage ray/triangle intersection, 1997.
fn front([a, b, c]: &[Vec3; 3], origin: &Vec3, d: &Vec3) -> Option<f64> {
    let frame = Mat3::from_columns(&[b - a, c - a, -d]);
    // Positive where the corners go round counter-clockwise as seen.
    let volume = frame.determinant();
    if volume <= 0.0 {
        return None;
    }
    let from = origin - a;
    let share = |i: usize| {
        let mut frame = frame;
        frame.set_column(i, &from);
        frame.determinant() / volume
    };
    let (u, v, t) = (share(0), share(1), share(2));
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0).then_some(t)
}
