//! A [`DrawList`] as a picture: sky and floors first, row by row; then the things on them, band by band: find what each
//! sample sees, and colour the pixels that are more than background.
//!
//! Colours are mixed in linear light (a screen value squared, close to sRGB), so that edges are smooth without
//! looking thin. Bands do not depend on one another: the pixels are the same whatever the number of threads.

use std::ops::Range;
use std::sync::Mutex;

use super::camera::Camera;
use super::draw::{DrawList, Floor, Layer, Thing};
use super::ground::{Row, WHOLE};
use super::project::{Bin, Eye, half_space, segment, triangles};
use super::raster::{Band, HalfSpace, NOTHING, SAMPLES, V3};
use super::shade::{BandLight, Shader, linear};

/// A picture: rows from the top, four bytes (red, green, blue, 255) a pixel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    pub width: usize,
    pub height: usize,
    pub rgba: Vec<u8>,
}

impl Image {
    pub fn new(width: usize, height: usize) -> Image {
        Image { width, height, rgba: vec![255; width * height * 4] }
    }
    pub fn pixel(&self, x: usize, y: usize) -> [u8; 3] {
        let i = 4 * (y * self.width + x);
        [self.rgba[i], self.rgba[i + 1], self.rgba[i + 2]]
    }
}

/// Rows drawn at a time: few enough that their samples stay in the second-level cache.
pub const BAND_ROWS: usize = 16;
/// Towards the light.
pub const LIGHT: [f32; 3] = [-0.36, -0.48, 0.8];
/// How much of a note shines through what hides it.
const HIDDEN_NOTE: f32 = 0.28;

/// Everything about one picture that its bands share.
struct Frame<'a> {
    shader: Shader<'a>,
    planes: Vec<HalfSpace>,
    /// Ids below this are floors.
    floors: u32,
    layers: [Bin; 3],
    width: usize,
}

/// What a thread needs to draw bands.
struct Scratch {
    layers: [Band; 3],
    row: Row,
    /// The pixels of a row that are more than background: a bit each.
    touched: Vec<u64>,
}

/// The samples of a band, layer by layer; none where a layer is empty.
struct Layers<'a>([Option<&'a Band>; 3]);

type Samples<'a> = (&'a [u32; SAMPLES], &'a [f32; SAMPLES]);

impl Layers<'_> {
    /// What a layer has in pixel `k`, if anything.
    #[inline]
    fn at(&self, layer: usize, k: usize) -> Option<Samples<'_>> {
        self.0[layer].filter(|b| b.id[k] != [NOTHING; SAMPLES]).map(|b| (&b.id[k], &b.inverse_depth[k]))
    }

    /// The bits of the pixels of a row in which any layer may have something.
    fn touched(&self, row: usize, bits: &mut [u64]) {
        bits.fill(0);
        for band in self.0.iter().flatten() {
            bits.iter_mut().zip(band.touched(row)).for_each(|(all, own)| *all |= own);
        }
    }
}

/// Draws pictures one after another, and keeps what the next one may need as well.
pub struct Painter {
    /// Of each thread.
    scratch: Vec<Scratch>,
    /// The last picture's sky and floors, as bytes, and what they follow from.
    background: Vec<u8>,
    view: Option<View>,
}

/// What sky and floors, with their paint but without shadows, follow from.
#[derive(PartialEq)]
struct View {
    size: [usize; 2],
    camera: Camera,
    floors: Vec<Floor>,
    paint: Vec<Thing>,
}

impl View {
    fn of(list: &DrawList, size: [usize; 2]) -> View {
        let paint = list.things.iter().filter(|thing| thing.paint).copied().collect();
        View { size, camera: list.camera, floors: list.floors.clone(), paint }
    }
}

/// Draws one picture. `threads` only changes how long it takes.
pub fn paint(list: &DrawList, width: usize, height: usize, threads: usize) -> Image {
    let mut image = Image::new(width, height);
    Painter::new(threads).paint(list, &mut image);
    image
}

impl Painter {
    pub fn new(threads: usize) -> Painter {
        let scratch = (0..threads.max(1)).map(|_| Scratch::new(0)).collect();
        Painter { scratch, background: Vec::new(), view: None }
    }

    /// Draws the list over all of a picture.
    pub fn paint(&mut self, list: &DrawList, image: &mut Image) {
        let (width, height) = (image.width, image.height);
        if width == 0 || height == 0 {
            return;
        }
        let frame = Frame::new(list, width, height);
        let view = Some(View::of(list, [width, height]));
        let fresh = self.view != view;
        self.view = view;
        self.background.resize(image.rgba.len(), 255);
        let bytes = BAND_ROWS * width * 4;
        let bands = Mutex::new(image.rgba.chunks_mut(bytes).zip(self.background.chunks_mut(bytes)).enumerate());
        let work = |scratch: &mut Scratch| {
            if scratch.row[0].len() != width {
                *scratch = Scratch::new(width);
            }
            loop {
                let next = bands.lock().ok().and_then(|mut bands| bands.next());
                let Some((index, (rows, background))) = next else { break };
                if fresh {
                    frame.background(index, background, &mut scratch.row);
                }
                rows.copy_from_slice(background);
                frame.band(index, rows, scratch);
            }
        };
        let [own, others @ ..] = &mut self.scratch[..] else { return };
        std::thread::scope(|scope| {
            for scratch in others {
                scope.spawn(|| work(scratch));
            }
            work(own);
        });
    }
}

impl Scratch {
    fn new(width: usize) -> Scratch {
        Scratch {
            layers: [0; 3].map(|_| Band::new(width, BAND_ROWS)),
            row: [0; 3].map(|_| vec![0.0; width]),
            touched: vec![0; width.div_ceil(64)],
        }
    }
}

impl<'a> Frame<'a> {
    fn new(list: &'a DrawList, width: usize, height: usize) -> Frame<'a> {
        let eye = Eye::new(list, width, height);
        let bands = height.div_ceil(BAND_ROWS);
        let mut layers = [0; 3].map(|_| Bin::new(bands));
        let mut id = list.floors.len() as u32;
        for thing in &list.things {
            // Paint is drawn with its floor.
            if !thing.paint {
                triangles(thing, &eye, id, &mut layers[thing.layer as usize]);
            }
            id += 1;
        }
        for trail in &list.trails {
            for pair in trail.points.windows(2) {
                segment(pair, trail.width, &eye, id, &mut layers[Layer::Note as usize]);
            }
            id += 1;
        }
        let planes: Vec<_> = (0..list.floors.len()).filter_map(|i| half_space(list, &eye, i)).collect();
        let floors = list.floors.len() as u32;
        Frame { shader: Shader::new(list, eye, &planes, [width, height]), planes, floors, layers, width }
    }

    /// Sky and floors of a band.
    fn background(&self, index: usize, rows: &mut [u8], line: &mut Row) {
        for (row, out) in rows.chunks_mut(self.width * 4).enumerate() {
            self.shader.background((index * BAND_ROWS + row) as f32 + 0.5, line);
            encode(line, out);
        }
    }

    /// Draws one band over its background.
    fn band(&self, index: usize, rows: &mut [u8], scratch: &mut Scratch) {
        let top = index * BAND_ROWS;
        let light = self.shader.band(top, BAND_ROWS);
        let layers = self.sample(index, top, self.columns(index), &mut scratch.layers);
        for (row, out) in rows.chunks_mut(self.width * 4).enumerate() {
            let y = (top + row) as f32 + 0.5;
            let (pixels, _) = out.as_chunks_mut::<4>();
            self.shader.darken(y, &light, pixels);
            layers.touched(row, &mut scratch.touched);
            self.between_floors(y, &mut scratch.touched);
            for (word, bits) in scratch.touched.iter().enumerate() {
                let mut bits = *bits;
                while bits != 0 {
                    let x = 64 * word + bits.trailing_zeros() as usize;
                    bits &= bits - 1;
                    let seen = [0, 1, 2].map(|layer| layers.at(layer, row * self.width + x));
                    let [red, green, blue, _] = pixels[x].map(|c| linear(f32::from(c) / 255.0));
                    let color = self.pixel(seen, [x as f32 + 0.5, y], &V3::new(red, green, blue), &light);
                    (0..3).for_each(|c| pixels[x][c] = byte(color[c].sqrt()) as u8);
                }
            }
        }
    }

    /// The columns that the triangles of a band reach.
    fn columns(&self, index: usize) -> Range<usize> {
        let span = self.layers.iter().map(|bin| bin.columns[index]).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        let [from, to] = span.unwrap_or([0.0; 2]);
        let from = (from.max(0.0) as usize).min(self.width);
        from..((to.max(0.0) as usize).saturating_add(1)).min(self.width).max(from)
    }

    /// Adds the bits of the pixels in which two floors meet: the background has only one of them.
    fn between_floors(&self, y: f32, touched: &mut [u64]) {
        if self.planes.len() < 2 {
            return;
        }
        for x in 0..self.width {
            let (mut ids, mut depths) = ([NOTHING; SAMPLES], [0.0; SAMPLES]);
            self.planes.iter().for_each(|plane| plane.cover([x as f32 + 0.5, y], &mut ids, &mut depths));
            touched[x / 64] |= u64::from(ids != [ids[0]; SAMPLES]) << (x % 64);
        }
    }

    /// Finds what each sample of a band sees.
    fn sample<'s>(&self, index: usize, top: usize, columns: Range<usize>, scratch: &'s mut [Band; 3]) -> Layers<'s> {
        let mut layers = [None; 3];
        for ((bin, band), layer) in self.layers.iter().zip(scratch).zip(&mut layers) {
            if bin.bands[index].is_empty() {
                continue;
            }
            band.clear(top, columns.clone());
            for &t in &bin.bands[index] {
                band.triangle(&bin.triangles[t as usize]);
            }
            *layer = Some(&*band);
        }
        Layers(layers)
    }

    /// Linear colour of a pixel from its samples; `bare` is that of the background.
    fn pixel(&self, [solid, glass, note]: [Option<Samples>; 3], at: [f32; 2], bare: &V3, light: &BandLight) -> V3 {
        let (mut ids, mut depths) = solid.map_or(([NOTHING; SAMPLES], [0.0; SAMPLES]), |(ids, depths)| (*ids, *depths));
        self.planes.iter().for_each(|plane| plane.cover(at, &mut ids, &mut depths));
        // Of one floor the background already has the colour.
        let floors = if self.planes.len() > 1 { 0 } else { self.floors };
        let mut samples = [*bare; SAMPLES];
        each(&ids, &depths, |id, depth, which| {
            if id != NOTHING && id >= floors {
                let color = self.shader.color(id, depth, at, light);
                which.iter().for_each(|&s| samples[s] = color);
            }
        });
        for (over, hidden) in [(glass, 0.0), (note, HIDDEN_NOTE)] {
            if let Some(over) = over {
                self.over(over, &depths, hidden, at, light, &mut samples);
            }
        }
        samples.iter().sum::<V3>() / SAMPLES as f32
    }

    /// Lays a see-through layer over the samples; only the share `hidden` of it where something solid is nearer.
    fn over(
        &self,
        (ids, depths): Samples,
        solid: &[f32; SAMPLES],
        hidden: f32,
        at: [f32; 2],
        light: &BandLight,
        samples: &mut [V3; SAMPLES],
    ) {
        each(ids, depths, |id, depth, which| {
            if id == NOTHING {
                return;
            }
            let color = self.shader.color(id, depth, at, light);
            let opacity = self.shader.opacity(id);
            for &s in which {
                let alpha = if solid[s] > depths[s] { opacity * hidden } else { opacity };
                samples[s] += (color - samples[s]) * alpha;
            }
        });
    }
}

/// A row of screen colours as bytes, several at a time.
fn encode([red, green, blue]: &Row, out: &mut [u8]) {
    let (pixels, _) = out.as_chunks_mut::<4>();
    for (((pixel, red), green), blue) in pixels.iter_mut().zip(red).zip(green).zip(blue) {
        *pixel = (byte(*red) | byte(*green) << 8 | byte(*blue) << 16 | 0xff00_0000).to_le_bytes();
    }
}

/// A screen colour between 0 and 1 as a whole number between 0 and 255.
#[inline]
fn byte(v: f32) -> u32 {
    let v = if v > 0.0 { v } else { 0.0 };
    let v = if v < 1.0 { v } else { 1.0 };
    (v * 255.0 + WHOLE).to_bits() & 0xff
}

/// Calls `f(id, mean 1/depth, samples)` once for each thing seen in a pixel.
#[inline]
fn each(ids: &[u32; SAMPLES], depths: &[f32; SAMPLES], mut f: impl FnMut(u32, f32, &[usize])) {
    // Most pixels see one thing only.
    if *ids == [ids[0]; SAMPLES] {
        return f(ids[0], 0.25 * (depths[0] + depths[1] + depths[2] + depths[3]), &[0, 1, 2, 3]);
    }
    let mut done = [false; SAMPLES];
    for first in 0..SAMPLES {
        if done[first] {
            continue;
        }
        let (mut which, mut n, mut sum) = ([0; SAMPLES], 0, 0.0);
        for s in first..SAMPLES {
            if ids[s] == ids[first] && !done[s] {
                done[s] = true;
                which[n] = s;
                n += 1;
                sum += depths[s];
            }
        }
        f(ids[first], sum / n as f32, &which[..n]);
    }
}

/// A screen colour in linear light.
pub(super) fn linear_rgb(c: &[f32]) -> V3 {
    V3::new(linear(c[0]), linear(c[1]), linear(c[2]))
}
