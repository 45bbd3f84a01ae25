//! Triangles to samples: which thing is nearest at four points of every pixel.
//!
//! The picture is made band by band, so that depth and ids stay in the cache. A sample keeps only 1/depth and
//! the number of the thing seen; colours come later, once per pixel and thing (see [`super::paint`]).
//! 1/depth is affine in the picture's coordinates, so planes and triangles interpolate it exactly.

use std::ops::Range;

pub type V3 = nalgebra::Vector3<f32>;
pub type M3 = nalgebra::Matrix3<f32>;

/// Samples of a pixel.
pub const SAMPLES: usize = 4;
/// Their places in the pixel (from its centre): a rotated grid, so that nearly level edges are smooth too.
const OFFSET_X: [f32; SAMPLES] = [-0.125, 0.375, -0.375, 0.125];
const OFFSET_Y: [f32; SAMPLES] = [-0.375, -0.125, 0.125, 0.375];

/// Nothing was drawn there.
pub const NOTHING: u32 = u32::MAX;

/// A triangle in the picture: pixels, and 1/depth (1/m) at each corner.
#[derive(Clone, Copy, Debug)]
pub struct Triangle {
    pub at: [[f32; 2]; 3],
    pub inverse_depth: [f32; 3],
    pub id: u32,
}

/// A plane in the picture: 1/depth = a x + b y + c, seen where that is positive.
#[derive(Clone, Copy, Debug)]
pub struct HalfSpace {
    pub abc: [f32; 3],
    pub id: u32,
}

impl HalfSpace {
    /// Puts the plane into the samples of the pixel at (x, y) where it is nearer than what is there.
    #[inline]
    pub fn cover(&self, [x, y]: [f32; 2], ids: &mut [u32; SAMPLES], inverse_depths: &mut [f32; SAMPLES]) {
        let [a, b, c] = self.abc;
        let centre = a * x + b * y + c;
        for s in 0..SAMPLES {
            let w = centre + a * OFFSET_X[s] + b * OFFSET_Y[s];
            if w > inverse_depths[s] {
                (ids[s], inverse_depths[s]) = (self.id, w);
            }
        }
    }
}

/// Depth and ids of some rows of the picture.
pub struct Band {
    pub width: usize,
    pub rows: usize,
    /// First row in the picture.
    pub top: usize,
    pub inverse_depth: Vec<[f32; SAMPLES]>,
    pub id: Vec<[u32; SAMPLES]>,
    /// A bit for every pixel in which something may be seen, row by row.
    touched: Vec<u64>,
}

impl Band {
    pub fn new(width: usize, rows: usize) -> Band {
        let n = width * rows;
        let touched = vec![0; width.div_ceil(64) * rows];
        Band { width, rows, top: 0, inverse_depth: vec![[0.0; SAMPLES]; n], id: vec![[NOTHING; SAMPLES]; n], touched }
    }

    /// The bits of the pixels of a row in which something may be seen, 64 a word.
    pub fn touched(&self, row: usize) -> &[u64] {
        let words = self.width.div_ceil(64);
        &self.touched[row * words..(row + 1) * words]
    }

    fn touch(&mut self, row: usize, pixels: Range<usize>) {
        let words = self.width.div_ceil(64);
        let (first, last) = (pixels.start / 64, (pixels.end - 1) / 64);
        for word in first..=last {
            let from = if word == first { pixels.start % 64 } else { 0 };
            let to = if word == last { (pixels.end - 1) % 64 } else { 63 };
            self.touched[row * words + word] |= (u64::MAX << from) & (u64::MAX >> (63 - to));
        }
    }

    /// Empties the given columns of the band and moves it to the rows from `top`.
    pub fn clear(&mut self, top: usize, columns: Range<usize>) {
        self.top = top;
        self.touched.fill(0);
        for row in 0..self.rows {
            let line = row * self.width + columns.start..row * self.width + columns.end;
            self.inverse_depth[line.clone()].fill([0.0; SAMPLES]);
            self.id[line].fill([NOTHING; SAMPLES]);
        }
    }

    /// Draws a triangle that is counter-clockwise on the screen (y down: positive area as computed here).
    pub fn triangle(&mut self, t: &Triangle) {
        let Some(setup) = Setup::new(t) else { return };
        let bottom = (self.top + self.rows) as f32;
        let (y0, y1) = (setup.min[1].max(self.top as f32), setup.max[1].min(bottom - 1.0));
        let (x0, x1) = (setup.min[0].max(0.0), setup.max[0].min(self.width as f32 - 1.0));
        if y0 > y1 || x0 > x1 {
            return;
        }
        let top = setup.at(x0 + 0.5, y0 + 0.5);
        let pixels = (x1 - x0) as usize + 1;
        for y in y0 as usize..=y1 as usize {
            let start = top.down((y - y0 as usize) as f32, &setup);
            let (skip, len) = start.span(&setup, pixels);
            if len == 0 {
                continue;
            }
            self.touch(y - self.top, x0 as usize + skip..x0 as usize + skip + len);
            let first = (y - self.top) * self.width + x0 as usize + skip;
            let pixels = first..first + len;
            let depths = &mut self.inverse_depth[pixels.clone()];
            let ids = &mut self.id[pixels];
            // Without branches, so that the compiler does all samples of a pixel at once.
            for (k, (depth, id)) in depths.iter_mut().zip(ids).enumerate() {
                let k = (skip + k) as f32;
                let e = [0, 1, 2].map(|i| start.edge[i] + k * setup.edge[i][0]);
                let w = start.inverse_depth + k * setup.inverse_depth[0];
                let (old, mut nearest, mut seen) = (*depth, [0.0; SAMPLES], *id);
                for s in 0..SAMPLES {
                    let inside = [0, 1, 2].map(|i| e[i] + setup.lane[i][s]);
                    let inside = smaller(smaller(inside[0], inside[1]), inside[2]) >= 0.0;
                    nearest[s] = larger(old[s], if inside { w + setup.lane[3][s] } else { 0.0 });
                }
                for s in 0..SAMPLES {
                    seen[s] = if nearest[s] > old[s] { t.id } else { seen[s] };
                }
                (*depth, *id) = (nearest, seen);
            }
        }
    }
}

/// Minimum without regard to NaN: one instruction.
#[inline]
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Maximum without regard to NaN: one instruction.
#[inline]
pub fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// A triangle's three edge functions and its 1/depth, each with gradient, and their changes to each sample.
struct Setup {
    origin: [f64; 2],
    constant: [f64; 3],
    edge: [[f32; 2]; 3],
    inverse_depth: [f32; 3],
    lane: [[f32; SAMPLES]; 4],
    /// The largest change of each edge function to a sample, and pixels to the right per its unit.
    reach: [f32; 3],
    per_slope: [f32; 3],
    min: [f32; 2],
    max: [f32; 2],
}

/// The functions at the first pixel of a row.
#[derive(Clone, Copy)]
struct RowStart {
    edge: [f32; 3],
    inverse_depth: f32,
}

impl Setup {
    /// Edge function of the edge from p to q, positive inside: e(x, y) = A (x − pₓ) + B (y − p_y).
    fn new(t: &Triangle) -> Option<Setup> {
        let p = t.at.map(|[x, y]| [f64::from(x), f64::from(y)]);
        // Twice the signed area; y points down, so a front face has a negative one in the usual sense.
        let area = (p[2][0] - p[0][0]) * (p[1][1] - p[0][1]) - (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]);
        if area <= 1e-9 || !area.is_finite() {
            return None;
        }
        let origin = p[0];
        let (mut edge, mut constant) = ([[0.0; 2]; 3], [0.0; 3]);
        for i in 0..3 {
            let (from, to) = (p[i], p[(i + 1) % 3]);
            let (a, b) = (to[1] - from[1], from[0] - to[0]);
            edge[i] = [a as f32, b as f32];
            // A hair wider than it is, so that no sample falls between two triangles.
            constant[i] = 1e-4 - (a * (from[0] - origin[0]) + b * (from[1] - origin[1]));
        }
        // Barycentric weights: edge i is opposite to corner i + 2.
        let iw = t.inverse_depth.map(f64::from);
        let gradient = |axis: usize| (0..3).map(|i| f64::from(edge[i][axis]) * iw[(i + 2) % 3]).sum::<f64>() / area;
        let inverse_depth = [gradient(0) as f32, gradient(1) as f32, iw[0] as f32];
        let lanes = |g: [f32; 2]| [0, 1, 2, 3].map(|s| g[0] * OFFSET_X[s] + g[1] * OFFSET_Y[s]);
        let lane = [lanes(edge[0]), lanes(edge[1]), lanes(edge[2]), lanes([inverse_depth[0], inverse_depth[1]])];
        let reach = [0, 1, 2].map(|i| lane[i].iter().fold(f32::MIN, |m, &l| m.max(l)));
        let per_slope = edge.map(|[a, _]| 1.0 / a);
        let bound = |axis: usize, f: fn(f64, f64) -> f64| f(f(p[0][axis], p[1][axis]), p[2][axis]);
        let min = [0, 1].map(|axis| (bound(axis, f64::min) - 0.5).floor() as f32);
        let max = [0, 1].map(|axis| (bound(axis, f64::max) + 0.5).floor() as f32);
        Some(Setup { origin, constant, edge, inverse_depth, lane, reach, per_slope, min, max })
    }

    fn at(&self, x: f32, y: f32) -> RowStart {
        let (dx, dy) = (f64::from(x) - self.origin[0], f64::from(y) - self.origin[1]);
        let edge = [0, 1, 2]
            .map(|i| (f64::from(self.edge[i][0]) * dx + f64::from(self.edge[i][1]) * dy + self.constant[i]) as f32);
        let [gx, gy, w0] = self.inverse_depth.map(f64::from);
        RowStart { edge, inverse_depth: (gx * dx + gy * dy + w0) as f32 }
    }
}

impl RowStart {
    /// The functions some rows further down.
    #[inline]
    fn down(&self, rows: f32, setup: &Setup) -> RowStart {
        let edge = [0, 1, 2].map(|i| self.edge[i] + rows * setup.edge[i][1]);
        RowStart { edge, inverse_depth: self.inverse_depth + rows * setup.inverse_depth[1] }
    }

    /// Pixels to skip, and pixels to draw, out of `n`: no sample outside that span can be inside all edges.
    #[inline]
    fn span(&self, setup: &Setup, n: usize) -> (usize, usize) {
        let (mut from, mut to) = (0.0f32, n as f32);
        for i in 0..3 {
            let slope = setup.edge[i][0];
            let reach = self.edge[i] + setup.reach[i];
            let at = -reach * setup.per_slope[i];
            if slope > 0.0 {
                from = from.max(at - 1.0);
            } else if slope < 0.0 {
                to = to.min(at + 2.0);
            } else if reach < 0.0 {
                return (0, 0);
            }
        }
        let (from, to) = (from.min(n as f32) as usize, to.max(0.0) as usize);
        (from, to.min(n).saturating_sub(from))
    }
}
