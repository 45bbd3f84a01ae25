//! The grid of a floor: most pixels of a picture are floor, so it is prepared once and costs a few operations each.

use super::draw::Floor;
use super::paint::{Eye, linear_rgb};
use super::raster::V3;

/// A floor as the picture's coordinates (x, y) see it.
///
/// The ray through (x, y) is d = d₀ + x dₓ + y d_y, so the point at depth w has on the floor the coordinate
///
///     u = u₀ + w (a x + b y + c)
///
/// and from one pixel to the next, with 1/w = α x + β y + γ,
///
///     ∂u/∂x = w (a − w α (a x + b y + c)),    ∂u/∂y = w (b − w β (a x + b y + c))
#[derive(Clone, Copy)]
pub struct Ground {
    color: V3,
    /// Fine ones; every fifth is strong.
    lines_per_m: f32,
    ink: f32,
    /// u₀ and a, b, c for the two directions of the grid.
    start: [f32; 2],
    slope: [[f32; 3]; 2],
    /// α, β, γ
    pub inverse_depth: [f32; 3],
    fog: f32,
    horizon: V3,
}

impl Ground {
    pub fn new(floor: &Floor, eye: &Eye, inverse_depth: [f32; 3], fog: f32, horizon: V3) -> Ground {
        let direction = |i: usize| {
            let u = V3::from(floor.mat.column(i));
            let (a, b) = (u.dot(&eye.right) / eye.focal, -u.dot(&eye.up) / eye.focal);
            let c = u.dot(&eye.forward) - a * eye.centre[0] - b * eye.centre[1];
            (u.dot(&(eye.pos - floor.pos)), [a, b, c])
        };
        let ((u, u_slope), (v, v_slope)) = (direction(0), direction(1));
        Ground {
            color: linear_rgb(&floor.color),
            lines_per_m: 1.0 / floor.grid,
            ink: floor.ink,
            start: [u, v],
            slope: [u_slope, v_slope],
            inverse_depth,
            fog,
            horizon,
        }
    }

    /// The floor's coordinates and the pixel's widths there, m.
    #[inline]
    pub fn place(&self, x: f32, y: f32, depth: f32) -> ([f32; 2], [f32; 2]) {
        let [alpha, beta, _] = self.inverse_depth;
        let mut at = [0.0; 2];
        let mut width = [0.0; 2];
        for i in 0..2 {
            let [a, b, c] = self.slope[i];
            let along = a * x + b * y + c;
            at[i] = self.start[i] + depth * along;
            width[i] = depth * ((a - depth * alpha * along).abs() + (b - depth * beta * along).abs());
        }
        (at, width)
    }

    /// The light of the bare floor (1) less what its lines take, and how much of the horizon's haze lies over it.
    #[inline]
    fn ink_and_haze(&self, at: [f32; 2], width: [f32; 2], depth: f32) -> (f32, f32) {
        let (x, y) = (self.lines_per_m * at[0], self.lines_per_m * at[1]);
        let (wx, wy) = (self.lines_per_m * width[0], self.lines_per_m * width[1]);
        let minor = larger(lines(x, wx), lines(y, wy));
        let major = larger(lines(0.2 * x, 0.28 * wx), lines(0.2 * y, 0.28 * wy));
        let far = depth * self.fog;
        (1.0 - self.ink * larger(0.10 * minor, 0.30 * major), far * far / (1.0 + far * far))
    }

    /// Linear colour at a place, where `open` of the light arrives.
    #[inline]
    pub fn color(&self, at: [f32; 2], width: [f32; 2], depth: f32, open: f32) -> V3 {
        let (ink, haze) = self.ink_and_haze(at, width, depth);
        let color = self.color * (ink * open);
        color + (self.horizon - color) * haze
    }

    /// Colours a whole row of the picture where the floor is seen; `open` is the light that arrives at each pixel.
    pub fn row(&self, y: f32, open: &[f32], color: &mut [Vec<f32>; 3]) {
        let [red, green, blue] = color;
        let lanes = red.chunks_mut(LANES).zip(green.chunks_mut(LANES)).zip(blue.chunks_mut(LANES));
        for (i, (((red, green), blue), open)) in lanes.zip(open.chunks(LANES)).enumerate() {
            let (bare, haze) = self.lanes((i * LANES) as f32 + 0.5, y);
            for l in 0..red.len() {
                if haze[l] < 1.0 {
                    let light = bare[l] * open[l];
                    red[l] = self.color.x * light + self.horizon.x * haze[l];
                    green[l] = self.color.y * light + self.horizon.y * haze[l];
                    blue[l] = self.color.z * light + self.horizon.z * haze[l];
                }
            }
        }
    }

    /// Light and haze of the pixels from x on; a haze of 1 or more is above the horizon. Plain arithmetic on local
    /// arrays without branches, so that the compiler does several pixels at once.
    #[inline]
    fn lanes(&self, x: f32, y: f32) -> ([f32; LANES], [f32; LANES]) {
        let ground = *self;
        let [alpha, beta, gamma] = ground.inverse_depth;
        let (mut bare, mut haze) = ([0.0; LANES], [0.0; LANES]);
        for l in 0..LANES {
            let x = x + l as i32 as f32;
            let nearness = alpha * x + beta * y + gamma;
            let depth = 1.0 / larger(nearness, 1e-9);
            let (at, width) = ground.place(x, y, depth);
            let (ink, far) = ground.ink_and_haze(at, width, depth);
            bare[l] = ink * (1.0 - far);
            haze[l] = if nearness > 0.0 { far } else { 2.0 };
        }
        (bare, haze)
    }
}

/// Pixels done at once.
const LANES: usize = 8;

/// Maximum without regard to NaN: one instruction.
#[inline]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// A colour at a distance (in units of the fog's reach) fades into the horizon.
#[inline]
pub fn fog(color: V3, far: f32, horizon: &V3) -> V3 {
    let t = far * far / (1.0 + far * far);
    color + (horizon - color) * t
}

/// How much of a pixel is covered by lines one pixel wide at every whole number; `width` is the pixel's, in the same
/// unit. Fades out where lines would fall into neighbouring pixels.
#[inline]
fn lines(x: f32, width: f32) -> f32 {
    /// Adding and subtracting 1.5 · 2²³ rounds to the nearest whole number.
    const ROUND: f32 = 12_582_912.0;
    let distance = (x - ((x + ROUND) - ROUND)).abs();
    let cover = larger(1.0 - distance / larger(width, 1e-9), 0.0);
    let fade = larger(1.2 - 4.0 * width, 0.0);
    cover * if fade < 1.0 { fade } else { 1.0 }
}
