//! The colour of a point: its thing's pattern, the light, the floor's grid and shadows.

use super::draw::{DrawList, Thing};
use super::ground::{Ground, Row};
use super::mesh::{self, Shape};
use super::paint::{LIGHT, linear_rgb};
use super::project::{Eye, NEAR};
use super::raster::{HalfSpace, V3};
use super::shadow::Shadow;

/// Screen value to linear light.
pub fn linear(c: f32) -> f32 {
    c * c
}

pub const HORIZON: [f32; 3] = [0.945, 0.955, 0.97];
const ZENITH: [f32; 3] = [0.68, 0.78, 0.90];
/// The twelve corners of an icosahedron are (0, ±1, ±φ) and its rotations: where a football has its dark patches.
const PHI: f32 = 1.618_034;

pub struct Shader<'a> {
    list: &'a DrawList,
    eye: Eye,
    light: V3,
    /// Half-way between light and eye would change over the picture; this is close enough for a highlight.
    halfway: V3,
    shadows: Vec<Shadow>,
    /// Rows and columns that each shadow reaches in the picture.
    reach: Vec<[f32; 4]>,
    /// By floor; none where the eye is below it.
    grounds: Vec<Option<Ground>>,
}

/// The shadows that reach into a band.
pub struct BandLight {
    near: Vec<Near>,
}

/// A shadow, its floor, and the columns it can reach.
struct Near {
    shadow: usize,
    floor: usize,
    from: f32,
    to: f32,
}

impl<'a> Shader<'a> {
    /// `planes` are the floors in the picture: 1/depth by floor.
    pub fn new(list: &'a DrawList, eye: Eye, planes: &[HalfSpace], size: [usize; 2]) -> Shader<'a> {
        let shadows = shadows(list);
        let fog = 1.0 / (22.0 * list.camera.distance as f32).max(5.0);
        let ground = |i: usize| {
            let plane = planes.iter().position(|p| p.id == i as u32)?;
            Some(Ground::new(&list.floors[i], &list.things, &eye, planes, plane, fog))
        };
        let light = V3::from(LIGHT).normalize();
        let reach = shadows.iter().map(|s| reach(s, list, &eye, size)).collect();
        Shader {
            list,
            eye,
            light,
            halfway: (light - eye.forward).normalize(),
            shadows,
            reach,
            grounds: (0..list.floors.len()).map(ground).collect(),
        }
    }

    pub fn band(&self, top: usize, rows: usize) -> BandLight {
        let (top, bottom) = (top as f32, (top + rows) as f32);
        let near = self
            .reach
            .iter()
            .enumerate()
            .filter(|(_, r)| r[2] < bottom && r[3] > top)
            .map(|(i, r)| Near { shadow: i, floor: self.shadows[i].floor, from: r[0], to: r[1] })
            .collect();
        BandLight { near }
    }

    /// The sky in a row: its colour follows the ray's slope.
    fn sky(&self, y: f32) -> V3 {
        let d = self.eye.direction(self.eye.centre[0], y);
        let slope = (d.z / d.norm()).clamp(0.0, 1.0);
        linear_rgb(&HORIZON).lerp(&linear_rgb(&ZENITH), (1.6 * slope).min(1.0))
    }

    /// Sky and floors: a row of the picture before anything stands on it.
    pub fn background(&self, y: f32, row: &mut Row) {
        let sky = self.sky(y);
        for c in 0..3 {
            row[c].fill(sky[c].sqrt());
        }
        self.grounds.iter().flatten().for_each(|ground| ground.row(y, row));
    }

    /// Lays the shadows of all things over a row of the background.
    pub fn darken(&self, y: f32, band: &BandLight, pixels: &mut [[u8; 4]]) {
        for near in &band.near {
            if let Some(ground) = &self.grounds[near.floor] {
                ground.shade(&self.shadows[near.shadow], y, pixels);
            }
        }
    }

    pub fn opacity(&self, id: u32) -> f32 {
        match self.find(id) {
            Found::Thing(thing) => thing.color[3],
            Found::Trail(color) => color[3],
            Found::Floor(_) => 1.0,
        }
    }

    /// Linear colour of a thing, a trail or a floor that is seen at a point of the picture.
    pub fn color(&self, id: u32, inverse_depth: f32, at: [f32; 2], band: &BandLight) -> V3 {
        match self.find(id) {
            Found::Trail(color) => linear_rgb(color),
            Found::Floor(i) => self.floor(i, 1.0 / inverse_depth.max(1e-9), at, band),
            Found::Thing(thing) => self.thing(thing, 1.0 / inverse_depth.max(1e-9), at),
        }
    }

    fn find(&self, id: u32) -> Found<'a> {
        let (floors, things) = (self.list.floors.len(), self.list.things.len());
        match id as usize {
            i if i < floors => Found::Floor(i),
            i if i < floors + things => Found::Thing(&self.list.things[i - floors]),
            i => Found::Trail(&self.list.trails[i - floors - things].color),
        }
    }

    fn floor(&self, index: usize, depth: f32, [x, y]: [f32; 2], band: &BandLight) -> V3 {
        let Some(ground) = &self.grounds[index] else { return V3::zeros() };
        let at = ground.place(x, y, depth);
        let mut open = 1.0;
        for near in band.near.iter().filter(|n| x >= n.from && x <= n.to && n.floor == index) {
            let shadow = &self.shadows[near.shadow];
            open *= shadow.open(shadow.texel(at));
        }
        linear_rgb(&ground.color(x, y, depth, open))
    }

    fn thing(&self, thing: &Thing, depth: f32, at: [f32; 2]) -> V3 {
        let d = self.eye.direction(at[0], at[1]);
        let p = self.eye.pos + d * depth;
        let mut base = linear_rgb(&thing.color);
        let local = thing.mat.transpose() * (p - thing.pos);
        let n = mesh::normal(thing.shape, &thing.size, &local);
        let n = (thing.mat * n).try_normalize(1e-12).unwrap_or_else(V3::z);
        if thing.checker {
            base *= pattern(thing, &local, depth / self.eye.focal);
        }
        let diffuse = n.dot(&self.light).max(0.0);
        let sky = 0.5 + 0.5 * n.z;
        let mut highlight = n.dot(&self.halfway).max(0.0);
        for _ in 0..5 {
            highlight *= highlight;
        }
        let graze = 1.0 + n.dot(&d) / d.norm();
        let lit = base * (0.34 + 0.20 * sky + 0.62 * diffuse);
        lit + V3::repeat(0.16 * highlight + 0.05 * graze * graze * graze)
    }
}

enum Found<'a> {
    Floor(usize),
    Thing(&'a Thing),
    Trail(&'a [f32; 4]),
}

/// Brightness of a thing's pattern at a point of its surface; `pixel` is a pixel's width there, m.
fn pattern(thing: &Thing, p: &V3, pixel: f32) -> f32 {
    let white = thing.color[0].min(thing.color[1]).min(thing.color[2]) > 0.9;
    if thing.shape == Shape::Sphere && white {
        return football(p, thing.size.x, pixel);
    }
    let soft = |c: f32| (c / pixel).clamp(-1.0, 1.0);
    // A disk's two faces look alike; everything else alternates in all octants.
    let axial = if thing.shape == Shape::Cylinder && thing.size.y < 0.5 * thing.size.x { 1.0 } else { soft(p.z) };
    let s = soft(p.x) * soft(p.y) * axial;
    0.77 + 0.23 * s
}

fn football(p: &V3, radius: f32, pixel: f32) -> f32 {
    let a = V3::new(p.x.abs(), p.y.abs(), p.z.abs()) / radius;
    let norm = (1.0 + PHI * PHI).sqrt();
    let cos = (a.y + PHI * a.z).max(a.z + PHI * a.x).max(a.x + PHI * a.y) / norm;
    // Patches of 21° around each corner.
    let inside = (cos - 0.9336) * radius / (0.36 * pixel.max(1e-9));
    1.0 - 0.88 * (0.5 + 0.5 * inside).clamp(0.0, 1.0)
}

/// The part of the picture that a shadow can reach: from x, to x, from y, to y.
fn reach(shadow: &Shadow, list: &DrawList, eye: &Eye, size: [usize; 2]) -> [f32; 4] {
    let floor = &list.floors[shadow.floor];
    let mut r = [f32::MAX, f32::MIN, f32::MAX, f32::MIN];
    for (i, j) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
        let local = V3::new(shadow.from[0] + i * shadow.size[0], shadow.from[1] + j * shadow.size[1], 0.0);
        let seen = eye.see(&(floor.mat * local + floor.pos));
        if seen.z < NEAR {
            return [0.0, size[0] as f32, 0.0, size[1] as f32];
        }
        let (x, y) = (eye.centre[0] + eye.focal * seen.x / seen.z, eye.centre[1] - eye.focal * seen.y / seen.z);
        r = [r[0].min(x), r[1].max(x), r[2].min(y), r[3].max(y)];
    }
    r
}

/// The light's shadows, sharp, and the sky's, wide and right below each thing.
fn shadows(list: &DrawList) -> Vec<Shadow> {
    let light = V3::from(LIGHT).normalize();
    let mut shadows = Vec::new();
    for (i, floor) in list.floors.iter().enumerate() {
        let normal = V3::from(floor.mat.column(2));
        for thing in list.things.iter().filter(|t| t.shadow) {
            if light.dot(&normal) > 0.2 {
                shadows.extend(Shadow::new(thing, i, floor, &light, 0.14, 0.42));
            }
            shadows.extend(Shadow::new(thing, i, floor, &normal, 0.9, 0.4));
        }
    }
    shadows
}
