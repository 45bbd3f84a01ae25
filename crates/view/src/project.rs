//! From the world to the picture: the eye, and things as triangles, sorted into bands of rows.

use super::draw::{DrawList, Thing};
use super::mesh;
use super::paint::BAND_ROWS;
use super::raster::{HalfSpace, Triangle, V3};

/// Nothing nearer than this is drawn, m.
pub const NEAR: f32 = 0.02;

/// The camera in single precision, and the picture's middle and focal length in pixels.
#[derive(Clone, Copy)]
pub struct Eye {
    pub pos: V3,
    pub right: V3,
    pub up: V3,
    pub forward: V3,
    pub focal: f32,
    pub centre: [f32; 2],
}

impl Eye {
    pub fn new(list: &DrawList, width: usize, height: usize) -> Eye {
        let axes = list.camera.axes();
        let f = |v: penny::math::Vec3| V3::new(v.x as f32, v.y as f32, v.z as f32);
        Eye {
            pos: f(axes.eye),
            right: f(axes.right),
            up: f(axes.up),
            forward: f(axes.forward),
            focal: 0.5 * height as f32 / (0.5 * list.camera.fovy as f32).tan(),
            centre: [0.5 * width as f32, 0.5 * height as f32],
        }
    }

    /// Direction whose component along `forward` is 1, through a point of the picture.
    pub fn direction(&self, x: f32, y: f32) -> V3 {
        self.forward + self.right * ((x - self.centre[0]) / self.focal) - self.up * ((y - self.centre[1]) / self.focal)
    }

    /// Right, up and depth of a point of the world.
    pub fn see(&self, p: &V3) -> V3 {
        let d = p - self.pos;
        V3::new(d.dot(&self.right), d.dot(&self.up), d.dot(&self.forward))
    }

    fn screen(&self, seen: &V3) -> [f32; 2] {
        [self.centre[0] + self.focal * seen.x / seen.z, self.centre[1] - self.focal * seen.y / seen.z]
    }
}

/// Triangles of one layer and, for each band, which of them reach into it.
pub struct Bin {
    pub triangles: Vec<Triangle>,
    pub bands: Vec<Vec<u32>>,
    /// The columns that the triangles of each band reach.
    pub columns: Vec<[f32; 2]>,
}

impl Bin {
    pub fn new(bands: usize) -> Bin {
        Bin { triangles: Vec::new(), bands: vec![Vec::new(); bands], columns: vec![[f32::MAX, f32::MIN]; bands] }
    }

    fn push(&mut self, t: Triangle) {
        let [p, q, r] = t.at;
        // Most back faces, before anything is done for them.
        if (r[0] - p[0]) * (q[1] - p[1]) < (q[0] - p[0]) * (r[1] - p[1]) {
            return;
        }
        let y = t.at.map(|p| p[1]);
        let low = y[0].min(y[1]).min(y[2]) - 1.0;
        let high = y[0].max(y[1]).max(y[2]) + 1.0;
        let last = self.bands.len() as f32 * BAND_ROWS as f32 - 1.0;
        if high < 0.0 || low > last || low.is_nan() {
            return;
        }
        let index = self.triangles.len() as u32;
        self.triangles.push(t);
        let band = |y: f32| (y.clamp(0.0, last) as usize) / BAND_ROWS;
        let x = t.at.map(|p| p[0]);
        let (left, right) = (x[0].min(x[1]).min(x[2]) - 1.0, x[0].max(x[1]).max(x[2]) + 1.0);
        for i in band(low)..=band(high) {
            self.bands[i].push(index);
            self.columns[i] = [self.columns[i][0].min(left), self.columns[i][1].max(right)];
        }
    }
}

/// Triangles of a thing in the picture.
pub fn triangles(thing: &Thing, eye: &Eye, id: u32, bin: &mut Bin) {
    let centre = eye.see(&thing.pos);
    let (scale, end) = mesh::scale(thing.shape, &thing.size);
    let radius = scale.norm() + end;
    if centre.z + radius < NEAR {
        return;
    }
    let pixels = scale.max() * eye.focal / centre.z.max(NEAR + radius);
    let mesh = mesh::mesh(thing.shape, pixels);
    let seen: Vec<V3> = mesh
        .vertices
        .iter()
        .map(|(d, side)| {
            let local = V3::from(*d).component_mul(&scale) + V3::new(0.0, 0.0, side * end);
            eye.see(&(thing.mat * local + thing.pos))
        })
        .collect();
    for t in &mesh.triangles {
        polygon(&t.map(|i| seen[i as usize]), eye, id, bin);
    }
}

/// A convex polygon, cut at the near plane and drawn as a fan.
fn polygon(points: &[V3], eye: &Eye, id: u32, bin: &mut Bin) {
    let mut cut = [V3::zeros(); 5];
    let mut n = 0;
    for i in 0..points.len() {
        let (p, q) = (points[i], points[(i + 1) % points.len()]);
        if p.z >= NEAR {
            cut[n] = p;
            n += 1;
        }
        if (p.z >= NEAR) != (q.z >= NEAR) {
            cut[n] = p.lerp(&q, (NEAR - p.z) / (q.z - p.z));
            n += 1;
        }
    }
    for i in 2..n {
        let corners = [cut[0], cut[i - 1], cut[i]];
        bin.push(Triangle { at: corners.map(|c| eye.screen(&c)), inverse_depth: corners.map(|c| 1.0 / c.z), id });
    }
}

/// One piece of a trail: a strip as wide in pixels at both ends.
pub fn segment(pair: &[V3], width: f32, eye: &Eye, id: u32, bin: &mut Bin) {
    let (mut p, mut q) = (eye.see(&pair[0]), eye.see(&pair[1]));
    if p.z < NEAR && q.z < NEAR {
        return;
    }
    if p.z < NEAR {
        p = q.lerp(&p, (q.z - NEAR) / (q.z - p.z));
    } else if q.z < NEAR {
        q = p.lerp(&q, (p.z - NEAR) / (p.z - q.z));
    }
    let (a, b) = (eye.screen(&p), eye.screen(&q));
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    let length = dx.hypot(dy).max(1e-6);
    // A little longer than the piece, so that pieces overlap at the joints.
    let (tx, ty) = (0.3 * width * dx / length, 0.3 * width * dy / length);
    let (nx, ny) = (0.5 * width * dy / length, -0.5 * width * dx / length);
    let (wa, wb) = (1.0 / p.z, 1.0 / q.z);
    let corners = [
        ([a[0] - tx + nx, a[1] - ty + ny], wa),
        ([a[0] - tx - nx, a[1] - ty - ny], wa),
        ([b[0] + tx - nx, b[1] + ty - ny], wb),
        ([b[0] + tx + nx, b[1] + ty + ny], wb),
    ];
    // Either winding may be the front one: the rasteriser drops the other.
    for [i, j, k] in [[0, 1, 2], [0, 2, 3], [2, 1, 0], [3, 2, 0]] {
        bin.push(Triangle {
            at: [corners[i].0, corners[j].0, corners[k].0],
            inverse_depth: [corners[i].1, corners[j].1, corners[k].1],
            id,
        });
    }
}

/// 1/depth of a floor over the picture; none if the eye is below it.
///
///     n · (eye + t d(x, y) − p) = 0,   1/t = n · d / (n · (p − eye))
pub fn half_space(list: &DrawList, eye: &Eye, floor: usize) -> Option<HalfSpace> {
    let n = V3::from(list.floors[floor].mat.column(2));
    let height = n.dot(&(list.floors[floor].pos - eye.pos));
    if height >= 0.0 {
        return None;
    }
    let a = n.dot(&eye.right) / eye.focal / height;
    let b = -n.dot(&eye.up) / eye.focal / height;
    let c = n.dot(&eye.forward) / height - a * eye.centre[0] - b * eye.centre[1];
    Some(HalfSpace { abc: [a, b, c], id: floor as u32 })
}
