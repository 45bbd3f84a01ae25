//! What is to be seen: a list of things, without any idea of physics or of pixels.

use super::camera::Camera;
use super::mesh::Shape;
use super::raster::{M3, V3};

/// How a thing joins the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// Hides what is behind it.
    Solid,
    /// Lets what is behind it shine through, by the alpha of its colour.
    Glass,
    /// An explanation (arrow, trail): always seen, faintly where something solid is in front of it.
    Note,
}

/// A shape to draw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thing {
    pub shape: Shape,
    pub size: V3,
    pub pos: V3,
    /// Columns are the shape's axes.
    pub mat: M3,
    /// Red, green, blue, opacity; 0 to 1, as a screen shows them.
    pub color: [f32; 4],
    pub layer: Layer,
    /// Octants in two tones (or the dark patches of a white ball), so that rotation is seen.
    pub checker: bool,
    /// Casts a shadow on planes.
    pub shadow: bool,
    /// Lies on a floor like paint, and is drawn with it.
    pub paint: bool,
}

/// An endless plane with a grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Floor {
    pub pos: V3,
    /// Columns: two directions of the grid, and the normal.
    pub mat: M3,
    pub color: [f32; 3],
    /// Distance between the grid's lines, m; every fifth one is stronger.
    pub grid: f32,
    /// How dark they are, 0 to 1.
    pub ink: f32,
}

/// A line through points of the world, of a width in pixels.
#[derive(Clone, Debug)]
pub struct Trail {
    pub points: Vec<V3>,
    pub color: [f32; 4],
    pub width: f32,
}

/// Everything that one picture shows.
#[derive(Clone, Debug)]
pub struct DrawList {
    pub camera: Camera,
    pub floors: Vec<Floor>,
    pub things: Vec<Thing>,
    pub trails: Vec<Trail>,
}

impl DrawList {
    pub fn new(camera: Camera) -> DrawList {
        DrawList { camera, floors: Vec::new(), things: Vec::new(), trails: Vec::new() }
    }

    /// An arrow from `from` along `vector`, both in m, as a shaft and a tip. Nothing if it is too short to see.
    pub fn arrow(&mut self, from: V3, vector: V3, radius: f32, color: [f32; 4]) {
        let length = vector.norm();
        if length.is_nan() || length < 2.0 * radius {
            return;
        }
        let tip = (5.0 * radius).min(0.6 * length);
        let shaft = length - tip;
        let z = vector / length;
        let mat = axes_along(z);
        let note = |shape, size, pos| Thing {
            shape,
            size,
            pos,
            mat,
            color,
            layer: Layer::Note,
            checker: false,
            shadow: false,
            paint: false,
        };
        let shaft_at = from + z * (0.5 * shaft);
        self.things.push(note(Shape::Cylinder, V3::new(radius, 0.5 * shaft, 0.0), shaft_at));
        let tip_at = from + z * (shaft + 0.5 * tip);
        self.things.push(note(Shape::Cone, V3::new(2.4 * radius, 0.5 * tip, 0.0), tip_at));
    }
}

/// Axes whose third is `z` (a unit vector).
pub fn axes_along(z: V3) -> M3 {
    let helper = if z.x.abs() < 0.6 { V3::x() } else { V3::y() };
    let x = helper.cross(&z).normalize();
    M3::from_columns(&[x, z.cross(&x), z])
}
