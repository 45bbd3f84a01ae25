//! Floors, with their grid, paint and shadows: most pixels of a picture are floor, so a row of them is drawn at once.
//!
//! Everything here is in screen colours, not in linear light: a floor has no edges to mix, and a shadow that lets
//! the part k of the light through multiplies a screen colour by √k.

use std::ops::Range;

use super::draw::{Floor, Thing};
use super::project::Eye;
use super::raster::{HalfSpace, V3, larger};
use super::shadow::Shadow;

/// Two directions of a plane, as the picture's coordinates (x, y) see them.
///
/// The ray through (x, y) is d = d₀ + x dₓ + y d_y, so the point at depth w has on the plane the coordinate
///
///     u = u₀ + w (a x + b y + c)
///
/// and from one pixel to the next, with 1/w = α x + β y + γ,
///
///     ∂u/∂x = w (a − w α (a x + b y + c)),    ∂u/∂y = w (b − w β (a x + b y + c))
#[derive(Clone, Copy)]
struct Chart {
    /// u₀ and a, b, c for both directions.
    start: [f32; 2],
    slope: [[f32; 3]; 2],
    /// α, β, γ
    nearness: [f32; 3],
}

impl Chart {
    fn new(origin: &V3, axes: [V3; 2], eye: &Eye, nearness: [f32; 3]) -> Chart {
        let slope = axes.map(|u| {
            let (a, b) = (u.dot(&eye.right) / eye.focal, -u.dot(&eye.up) / eye.focal);
            [a, b, u.dot(&eye.forward) - a * eye.centre[0] - b * eye.centre[1]]
        });
        Chart { start: axes.map(|u| u.dot(&(eye.pos - origin))), slope, nearness }
    }

    #[inline]
    fn depth(&self, x: f32, y: f32) -> f32 {
        let [alpha, beta, gamma] = self.nearness;
        1.0 / larger(alpha * x + beta * y + gamma, 1e-9)
    }

    /// Coordinates of a point of the picture, m.
    #[inline]
    fn at(&self, x: f32, y: f32, depth: f32) -> [f32; 2] {
        [0, 1].map(|i| {
            let [a, b, c] = self.slope[i];
            self.start[i] + depth * (a * x + b * y + c)
        })
    }

    /// How far the coordinates change from a pixel to the next, m.
    #[inline]
    fn width(&self, x: f32, y: f32, depth: f32) -> [f32; 2] {
        let [alpha, beta, _] = self.nearness;
        [0, 1].map(|i| {
            let [a, b, c] = self.slope[i];
            let along = a * x + b * y + c;
            depth * ((a - depth * alpha * along).abs() + (b - depth * beta * along).abs())
        })
    }

    /// The columns of a row of the picture, out of `within`, where coordinate `i` is between `low` and `high`.
    ///
    ///     u ≥ low   ⇔   (u₀ − low) (α x + β y + γ) + a x + b y + c ≥ 0
    fn columns(&self, y: f32, i: usize, [low, high]: [f32; 2], within: Range<usize>) -> Range<usize> {
        let ([alpha, beta, gamma], [a, b, c]) = (self.nearness, self.slope[i]);
        let (constant, along) = (beta * y + gamma, b * y + c);
        let (above, below) = (self.start[i] - low, self.start[i] - high);
        let within = clip(within, above * alpha + a, above * constant + along);
        clip(within, -below * alpha - a, -below * constant - along)
    }
}

/// A floor of one picture.
pub struct Ground {
    color: [f32; 3],
    /// Fine ones; every fifth is strong.
    lines_per_m: f32,
    ink: f32,
    chart: Chart,
    paint: Vec<Patch>,
    fog: f32,
    horizon: [f32; 3],
    /// Where another floor would hide this one, differences of 1/depth: α, β, γ.
    before: Vec<[f32; 3]>,
}

/// A rectangle painted on a floor.
struct Patch {
    chart: Chart,
    half: [f32; 2],
    color: [f32; 4],
}

/// A row of the picture while it is made: screen colours, red, green and blue.
pub type Row = [Vec<f32>; 3];

impl Ground {
    /// The floor that `planes[index]` shows; `things` may hold its paint.
    pub fn new(floor: &Floor, things: &[Thing], eye: &Eye, planes: &[HalfSpace], index: usize, fog: f32) -> Ground {
        let nearness = planes[index].abc;
        let others = planes.iter().enumerate().filter(|(i, _)| *i != index);
        Ground {
            color: floor.color,
            lines_per_m: 1.0 / floor.grid,
            ink: floor.ink,
            chart: Chart::new(&floor.pos, [0, 1].map(|i| floor.mat.column(i).into()), eye, nearness),
            paint: things.iter().filter_map(|thing| Patch::new(thing, floor, eye, nearness)).collect(),
            fog,
            horizon: super::shade::HORIZON,
            before: others.map(|(_, p)| [0, 1, 2].map(|k| nearness[k] - p.abc[k])).collect(),
        }
    }

    /// The floor's own coordinates of a point of the picture, m.
    #[inline]
    pub fn place(&self, x: f32, y: f32, depth: f32) -> [f32; 2] {
        self.chart.at(x, y, depth)
    }

    /// Screen colour at a point of the picture, where shadows leave the factor `open`.
    pub fn color(&self, x: f32, y: f32, depth: f32, open: f32) -> [f32; 3] {
        let grid = Grid::new(self, x, y, depth);
        let light = grid.light(self.chart.at(x, y, depth));
        let mut color = self.color.map(|c| c * light);
        for patch in &self.paint {
            let cover = patch.cover(x, y, depth, patch.per_width(x, y));
            (0..3).for_each(|c| color[c] += (patch.color[c] - color[c]) * cover);
        }
        let haze = self.haze(depth);
        [0, 1, 2].map(|c| color[c] * open * (1.0 - haze) + self.horizon[c] * haze)
    }

    /// How much of the horizon lies over the floor at a depth.
    #[inline]
    fn haze(&self, depth: f32) -> f32 {
        let far = depth * self.fog;
        far * far / (1.0 + far * far)
    }

    /// The columns of a row of the picture in which the floor is seen.
    fn seen(&self, y: f32, width: usize) -> Range<usize> {
        let [alpha, beta, gamma] = self.chart.nearness;
        let above = clip(0..width, alpha, beta * y + gamma - 1e-9);
        self.before.iter().fold(above, |seen, [a, b, c]| clip(seen, *a, b * y + c))
    }

    /// Draws the floor with its grid and paint into a row of the picture.
    pub fn row(&self, y: f32, row: &mut Row) {
        let seen = self.seen(y, row[0].len());
        self.bare(y, seen.clone(), row);
        self.paint.iter().for_each(|patch| self.patch(patch, y, seen.clone(), row));
    }

    /// Colour, grid and haze.
    fn bare(&self, y: f32, seen: Range<usize>, row: &mut Row) {
        for start in seen.clone().step_by(LANES) {
            let n = (seen.end - start).min(LANES);
            let (light, haze) = self.lanes(start as f32 + 0.5, y);
            for (c, row) in row.iter_mut().enumerate() {
                let (color, horizon) = (self.color[c] * (1.0 - haze), self.horizon[c] * haze);
                let row = &mut row[start..start + n];
                match <&mut [f32; LANES]>::try_from(&mut *row) {
                    Ok(row) => (0..LANES).for_each(|l| row[l] = light[l] * color + horizon),
                    Err(_) => row.iter_mut().zip(light).for_each(|(row, light)| *row = light * color + horizon),
                }
            }
        }
    }

    /// What the grid leaves of the colour in the pixels from x on, and the haze over them. Haze and a pixel's width are
    /// taken from the middle one; plain arithmetic on local arrays without branches, so that the compiler does several
    /// pixels at once.
    #[inline]
    fn lanes(&self, x: f32, y: f32) -> ([f32; LANES], f32) {
        let middle = x + 0.5 * LANES as f32;
        let depth = self.chart.depth(middle, y);
        let grid = Grid::new(self, middle, y, depth);
        let chart = self.chart;
        let mut light = [0.0; LANES];
        for (l, light) in light.iter_mut().enumerate() {
            let x = x + l as i32 as f32;
            *light = grid.light(chart.at(x, y, chart.depth(x, y)));
        }
        (light, self.haze(depth))
    }

    /// Paints a rectangle into a row.
    fn patch(&self, patch: &Patch, y: f32, seen: Range<usize>, row: &mut Row) {
        // The widest pixel of the row, so that no half-covered one is left out.
        let ends = [seen.start, seen.end].map(|x| patch.chart.width(x as f32, y, patch.chart.depth(x as f32, y)));
        let mut columns = seen;
        for i in 0..2 {
            let reach = patch.half[i] + 0.5 * larger(ends[0][i], ends[1][i]);
            columns = patch.chart.columns(y, i, [-reach, reach], columns);
        }
        for start in columns.clone().step_by(LANES) {
            let end = (start + LANES).min(columns.end);
            let middle = 0.5 * (start + end) as f32;
            let (per_width, haze) = (patch.per_width(middle, y), self.haze(patch.chart.depth(middle, y)));
            let mut cover = [0.0; LANES];
            for (l, cover) in cover.iter_mut().enumerate() {
                let x = (start as f32 + 0.5) + l as i32 as f32;
                *cover = patch.cover(x, y, patch.chart.depth(x, y), per_width);
            }
            for (c, row) in row.iter_mut().enumerate() {
                let paint = patch.color[c] * (1.0 - haze) + self.horizon[c] * haze;
                row[start..end].iter_mut().zip(cover).for_each(|(color, cover)| *color += (paint - *color) * cover);
            }
        }
    }

    /// Lays a shadow over a row of the picture; the haze in front of the floor stays. Between the ends of a few pixels everything is
    /// taken as straight.
    pub fn shade(&self, shadow: &Shadow, y: f32, pixels: &mut [[u8; 4]]) {
        let seen = self.seen(y, pixels.len());
        let [u, v] = [0, 1].map(|i| [shadow.from[i], shadow.from[i] + shadow.size[i]]);
        let columns = self.chart.columns(y, 1, v, self.chart.columns(y, 0, u, seen));
        for start in columns.clone().step_by(LANES) {
            let end = (start + LANES).min(columns.end);
            let [(from, depth), (to, _)] = [start, end].map(|x| {
                let x = x as f32 + 0.5;
                let depth = self.chart.depth(x, y);
                (shadow.texel(self.chart.at(x, y, depth)), depth)
            });
            let step = [0, 1].map(|i| (to[i] - from[i]) / (end - start) as f32);
            let haze = self.horizon.map(|h| 255.0 * h * self.haze(depth));
            for (i, pixel) in pixels[start..end].iter_mut().enumerate() {
                let i = i as i32 as f32;
                let open = shadow.open([from[0] + i * step[0], from[1] + i * step[1]]);
                for c in 0..3 {
                    let old = pixel[c] as i32 as f32;
                    pixel[c] = (haze[c] + (old - haze[c]) * open + WHOLE).to_bits() as u8;
                }
            }
        }
    }
}

/// The grid's lines around a pixel: how wide the pixel is there, seen from the lines.
struct Grid {
    lines_per_m: f32,
    /// For fine and strong lines, in both directions: 1/width in their own unit, and how dark they are.
    fine: [[f32; 2]; 2],
    strong: [[f32; 2]; 2],
}

impl Grid {
    #[inline]
    fn new(ground: &Ground, x: f32, y: f32, depth: f32) -> Grid {
        let width = ground.chart.width(x, y, depth).map(|w| larger(w * ground.lines_per_m, 1e-9));
        Grid {
            lines_per_m: ground.lines_per_m,
            fine: width.map(|w| [1.0 / w, 0.05 * ground.ink * fade(w)]),
            strong: width.map(|w| [1.0 / (0.28 * w), 0.16 * ground.ink * fade(0.28 * w)]),
        }
    }

    /// What the lines leave of the floor's colour, at coordinates of the floor.
    #[inline]
    fn light(&self, at: [f32; 2]) -> f32 {
        let (u, v) = (self.lines_per_m * at[0], self.lines_per_m * at[1]);
        let fine = larger(line(u, self.fine[0]), line(v, self.fine[1]));
        let strong = larger(line(0.2 * u, self.strong[0]), line(0.2 * v, self.strong[1]));
        1.0 - larger(fine, strong)
    }
}

impl Patch {
    /// None if the thing is no paint, or lies on another floor.
    fn new(thing: &Thing, floor: &Floor, eye: &Eye, nearness: [f32; 3]) -> Option<Patch> {
        let normal = V3::from(floor.mat.column(2));
        let up = (0..3).find(|&i| thing.mat.column(i).dot(&normal).abs() > 0.999)?;
        if !thing.paint || (thing.pos - floor.pos).dot(&normal).abs() > 0.01 {
            return None;
        }
        let plane = [(up + 1) % 3, (up + 2) % 3];
        Some(Patch {
            chart: Chart::new(&thing.pos, plane.map(|i| thing.mat.column(i).into()), eye, nearness),
            half: plane.map(|i| thing.size[i]),
            color: thing.color,
        })
    }

    /// 1/width of a pixel, in both directions.
    #[inline]
    fn per_width(&self, x: f32, y: f32) -> [f32; 2] {
        self.chart.width(x, y, self.chart.depth(x, y)).map(|w| 1.0 / larger(w, 1e-9))
    }

    /// How much of a pixel the paint covers, given 1/width of the pixel.
    #[inline]
    fn cover(&self, x: f32, y: f32, depth: f32, per_width: [f32; 2]) -> f32 {
        let at = self.chart.at(x, y, depth);
        let part = |i: usize| {
            let inside = (self.half[i] - at[i].abs()) * per_width[i] + 0.5;
            let inside = larger(inside, 0.0);
            if inside < 1.0 { inside } else { 1.0 }
        };
        part(0) * part(1) * self.color[3]
    }
}

/// Pixels done at once.
const LANES: usize = 16;
/// Adding and subtracting 1.5 · 2²³ rounds to the nearest whole number; added to one from 0 to 255, it leaves that in
/// the lowest byte.
pub const WHOLE: f32 = 12_582_912.0;

/// The columns out of `within` at whose pixels' centres a x + b ≥ 0.
fn clip(within: Range<usize>, a: f32, b: f32) -> Range<usize> {
    let Range { start, end } = within;
    let edge = (-b / a - 0.5).clamp(-1.0, end as f32);
    if a > 0.0 {
        let start = start.max(edge.ceil().max(0.0) as usize);
        start..end.max(start)
    } else if a < 0.0 {
        start..end.min((edge.floor() + 1.0) as usize).max(start)
    } else if b >= 0.0 {
        start..end
    } else {
        start..start
    }
}

/// How strong lines at every whole number are where a pixel is `width` wide: they fade out where they would fall into
/// neighbouring pixels.
#[inline]
fn fade(width: f32) -> f32 {
    (1.2 - 4.0 * width).clamp(0.0, 1.0)
}

/// How much a pixel is darkened by lines one pixel wide at every whole number, given 1/width of the pixel and the
/// darkness of a whole line.
#[inline]
fn line(x: f32, [per_width, dark]: [f32; 2]) -> f32 {
    let distance = (x - ((x + WHOLE) - WHOLE)).abs();
    larger(1.0 - distance * per_width, 0.0) * dark
}
