//! Soft shadows on planes: the outline of a convex shape, projected along the light, with a soft edge.

use super::draw::{Floor, Thing};
use super::ground::WHOLE;
use super::mesh;
use super::raster::V3;

/// Texels along each side of a shadow.
const TEXELS: usize = 40;

/// What one thing leaves of the light on a plane, as a small picture that lies on the plane.
pub struct Shadow {
    /// Index into the floors.
    pub floor: usize,
    /// Corner and extent of the picture on the plane, in its first two axes, m.
    pub from: [f32; 2],
    pub size: [f32; 2],
    texels_per_m: [f32; 2],
    /// The factor that is left of a screen colour.
    texels: Box<[[f32; TEXELS]; TEXELS]>,
}

impl Shadow {
    /// Shadow of `thing` on `floor` along the direction `light` (from the plane to the light, unit).
    ///
    /// The half-shadow is as wide as the sun's and sky's patch of light, `softness` (rad), makes it at the thing's
    /// height. None where the thing is far above the plane or below it.
    pub fn new(thing: &Thing, floor: usize, on: &Floor, light: &V3, softness: f32, strength: f32) -> Option<Shadow> {
        let to_plane = on.mat.transpose();
        let light = to_plane * light;
        let (scale, end) = mesh::scale(thing.shape, &thing.size);
        let (mut points, mut height, mut lowest) = (Vec::new(), 0.0f32, f32::MAX);
        let rows = &mesh::mesh(thing.shape, 12.0).vertices;
        for (direction, side) in rows {
            let local = V3::from(*direction).component_mul(&scale) + V3::new(0.0, 0.0, side * end);
            let p = to_plane * (thing.mat * local + thing.pos - on.pos);
            height += p.z / rows.len() as f32;
            lowest = lowest.min(p.z);
            points.push([p.x - light.x / light.z * p.z, p.y - light.y / light.z * p.z]);
        }
        let hull = hull(points);
        let extent =
            hull.iter().map(|p| p[0]).fold(f32::MIN, f32::max) - hull.iter().map(|p| p[0]).fold(f32::MAX, f32::min);
        if height <= 0.0 || lowest > 30.0 * extent.max(0.05) || hull.len() < 3 || !extent.is_finite() {
            return None;
        }
        let blur = softness * height.max(lowest) + 0.01 * extent;
        let fade = strength * (extent / (extent + 0.25 * lowest.max(0.0)));
        Some(bake(&hull, floor, blur, fade))
    }

    /// Where in the picture of the shadow a point of the plane is.
    #[inline]
    pub fn texel(&self, at: [f32; 2]) -> [f32; 2] {
        [0, 1].map(|i| (at[i] - self.from[i]) * self.texels_per_m[i])
    }

    /// The factor that is left of a screen colour there; at the rim, 1, where it is outside.
    #[inline]
    pub fn open(&self, [x, y]: [f32; 2]) -> f32 {
        const LAST: f32 = (TEXELS - 1) as f32;
        let floor = |x: f32| ((x - 0.5 + WHOLE).to_bits() as usize & 0xffff).min(TEXELS - 2);
        let inside = |x: f32| {
            let x = if x > 0.0 { x } else { 0.0 };
            if x < LAST { x } else { LAST }
        };
        let (x, y) = (inside(x), inside(y));
        let (i, j) = (floor(x), floor(y));
        let (fx, fy) = (x - i as i32 as f32, y - j as i32 as f32);
        let (upper, lower) = (&self.texels[j], &self.texels[j + 1]);
        let top = upper[i] + (upper[i + 1] - upper[i]) * fx;
        let bottom = lower[i] + (lower[i + 1] - lower[i]) * fx;
        top + (bottom - top) * fy
    }
}

fn bake(hull: &[[f32; 2]], floor: usize, blur: f32, strength: f32) -> Shadow {
    let bound = |axis: usize| {
        let low = hull.iter().map(|p| p[axis]).fold(f32::MAX, f32::min) - 1.2 * blur;
        let high = hull.iter().map(|p| p[axis]).fold(f32::MIN, f32::max) + 1.2 * blur;
        (low, high - low)
    };
    let ((x, w), (y, h)) = (bound(0), bound(1));
    // Unit normals of the outline's edges, pointing out.
    let edges: Vec<[f32; 3]> = (0..hull.len())
        .filter_map(|i| {
            let (p, q) = (hull[i], hull[(i + 1) % hull.len()]);
            let (dx, dy) = (q[0] - p[0], q[1] - p[1]);
            let length = dx.hypot(dy);
            (length > 0.0).then(|| [dy / length, -dx / length, (dy * p[0] - dx * p[1]) / length])
        })
        .collect();
    // A narrow thing cannot darken fully once the blur is wider than it is.
    let fill = (w.min(h) / (w.min(h) + 0.8 * blur)).min(1.0);
    let mut texels = Box::new([[1.0; TEXELS]; TEXELS]);
    for (j, row) in texels.iter_mut().enumerate() {
        let py = y + h * j as f32 / (TEXELS - 1) as f32;
        // Distance to the outline of a row of texels.
        let mut distance = [f32::MIN; TEXELS];
        for [nx, ny, offset] in &edges {
            let (first, step) = (nx * x + ny * py - offset, nx * w / (TEXELS - 1) as f32);
            for (i, distance) in distance.iter_mut().enumerate() {
                let d = first + step * i as i32 as f32;
                *distance = if d > *distance { d } else { *distance };
            }
        }
        *row = distance.map(|d| {
            let t = (0.5 - 0.5 * d / blur).clamp(0.0, 1.0);
            (1.0 - strength * fill * t * t * (3.0 - 2.0 * t)).sqrt()
        });
    }
    let texels_per_m = [w, h].map(|extent| (TEXELS - 1) as f32 / extent);
    Shadow { floor, from: [x, y], size: [w, h], texels_per_m, texels }
}

/// Convex hull, counter-clockwise (Andrew's monotone chain).
fn hull(mut points: Vec<[f32; 2]>) -> Vec<[f32; 2]> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let turn = |o: [f32; 2], a: [f32; 2], b: [f32; 2]| (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
    let half = |points: &mut dyn Iterator<Item = [f32; 2]>| {
        let mut chain: Vec<[f32; 2]> = Vec::new();
        for p in points {
            while chain.len() >= 2 && turn(chain[chain.len() - 2], chain[chain.len() - 1], p) <= 0.0 {
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut lower = half(&mut points.iter().copied());
    lower.extend(half(&mut points.iter().rev().copied()));
    lower
}
