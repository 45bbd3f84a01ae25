//! What a model looks like: geoms at poses, and arrows for what one cannot see. Only reads.

use super::camera::Camera;
use super::draw::{DrawList, Floor, Layer, Thing, axes_along};
use super::energy_balance::contact_force;
use super::mesh::Shape;
use super::raster::{M3, V3};
use super::session::{Poses, Session};
use penny::data::Data;
use penny::dynamics::tendon;
use penny::math::{self, Mat3, Vec3};
use penny::model::{Geom, GeomKind, JointKind, Model, Path, Tendon};

pub const NORMAL_FORCE: [f32; 4] = [0.16, 0.45, 0.86, 1.0];
pub const FRICTION_FORCE: [f32; 4] = [0.93, 0.53, 0.10, 1.0];
pub const APPLIED_FORCE: [f32; 4] = [0.85, 0.13, 0.25, 1.0];
pub const VELOCITY: [f32; 4] = [0.10, 0.62, 0.32, 1.0];
const CONTACT_POINT: [f32; 4] = [0.98, 0.85, 0.15, 1.0];

/// The floor where the file leaves it grey.
const FLOOR: [f32; 3] = [0.925, 0.932, 0.945];
/// Bodies whose colour the file leaves at MJCF's grey, so that they can be told apart.
const PALETTE: [[f32; 3]; 8] = [
    [0.23, 0.45, 0.80],
    [0.90, 0.42, 0.20],
    [0.25, 0.62, 0.40],
    [0.70, 0.35, 0.62],
    [0.88, 0.68, 0.18],
    [0.25, 0.65, 0.70],
    [0.80, 0.30, 0.34],
    [0.45, 0.45, 0.52],
];
/// Radius (m, MuJoCo's) and colour of strings.
const STRING: f32 = 3e-3;
const STRING_COLOR: [f32; 4] = [0.35, 0.33, 0.32, 1.0];
/// A geom thinner than this that never moves is paint on the floor, m.
const PAINT: f64 = 5e-3;

fn f32s(v: &Vec3) -> V3 {
    V3::new(v.x as f32, v.y as f32, v.z as f32)
}

fn f32m(m: &Mat3) -> M3 {
    m.map(|x| x as f32)
}

fn position(poses: &Poses, geom: &Geom) -> (Vec3, Mat3) {
    let (p, q) = (poses.pos[geom.body], poses.quat[geom.body]);
    (p + q * geom.pos, math::mat(&(q * geom.quat)))
}

/// All geoms of the model at the poses.
pub fn draw(model: &Model, poses: &Poses, camera: Camera) -> DrawList {
    let mut list = DrawList::new(camera);
    for geom in &model.geoms {
        let (pos, mat) = position(poses, geom);
        match shape(geom.kind) {
            None => list.floors.push(Floor {
                pos: f32s(&pos),
                mat: f32m(&mat),
                color: floor_color(&geom.rgba),
                grid: grid(camera.distance),
                ink: if grey(&geom.rgba) { 1.0 } else { 0.3 },
            }),
            Some(shape) => list.things.push(thing(model, geom, shape, &pos, &mat)),
        }
    }
    visuals(&mut list, model, poses);
    strings(&mut list, model, poses);
    list
}

/// Meshes that are only seen, triangle by triangle; of those that cannot be read, [`unseen`] tells.
fn visuals(list: &mut DrawList, model: &Model, poses: &Poses) {
    for visual in &model.visuals {
        let (p, q) = (poses.pos[visual.body], poses.quat[visual.body]);
        let (pos, mat) = (f32s(&(p + q * visual.pos)), f32m(&math::mat(&(q * visual.quat))));
        let color = color_of(visual.rgba, visual.body);
        for face in visual.mesh.faces().unwrap_or_default() {
            let [a, b, c] = face.map(|corner| mat * V3::from(corner));
            let (along, across) = (b - a, c - a);
            let longest = along.norm().max(across.norm());
            let Some(normal) = along.cross(&across).try_normalize(1e-20) else { continue };
            list.things.push(Thing {
                shape: Shape::Facet,
                size: V3::repeat(longest),
                pos: pos + a,
                mat: M3::from_columns(&[along / longest, across / longest, normal]),
                color,
                layer: if color[3] < 0.999 { Layer::Glass } else { Layer::Solid },
                checker: false,
                shadow: false,
                paint: false,
            });
        }
    }
}

/// The meshes that pictures of a model lack, and why: a line each.
pub fn unseen(model: &Model) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for visual in &model.visuals {
        if let Err(why) = visual.mesh.faces() {
            let line = format!("pictures lack the mesh `{}`: {why}", visual.mesh.path.display());
            if !lines.contains(&line) {
                lines.push(line);
            }
        }
    }
    lines
}

/// Spatial tendons, from point to point; what goes round a geom is drawn through it.
fn strings(list: &mut DrawList, model: &Model, poses: &Poses) {
    let spatial = |t: &Tendon| matches!(t.path, Path::Spatial(_));
    if !model.tendons.iter().any(spatial) {
        return;
    }
    let xmat = poses.quat.iter().map(math::mat).collect();
    let data = Data { xpos: poses.pos.clone(), xmat, ..Data::default() };
    for tendon in &model.tendons {
        let Path::Spatial(points) = &tendon.path else { continue };
        tendon::each_segment(model, &data, points, |segment| {
            let [from, to] = segment.points;
            let length = (to - from).norm();
            if length > 0.0 {
                list.things.push(Thing {
                    shape: Shape::Capsule,
                    size: V3::new(STRING, 0.5 * length as f32, 0.0),
                    pos: f32s(&(0.5 * (from + to))),
                    mat: axes_along(f32s(&((to - from) / length))),
                    color: STRING_COLOR,
                    layer: Layer::Solid,
                    checker: false,
                    shadow: true,
                    paint: false,
                });
            }
        });
    }
}

/// The same scene elsewhere, as a translucent ghost in one colour. Only what moves.
pub fn ghost(list: &mut DrawList, model: &Model, poses: &Poses, color: [f32; 3]) {
    for geom in model.geoms.iter().filter(|g| model.bodies[g.body].tree.is_some()) {
        let (pos, mat) = position(poses, geom);
        if let Some(shape) = shape(geom.kind) {
            let [r, g, b] = color;
            let body = thing(model, geom, shape, &pos, &mat);
            list.things.push(Thing { color: [r, g, b, 0.38], layer: Layer::Glass, shadow: false, ..body });
        }
    }
}

fn thing(model: &Model, geom: &Geom, shape: Shape, pos: &Vec3, mat: &Mat3) -> Thing {
    let still = model.bodies[geom.body].tree.is_none();
    let thin = (0..3).any(|i| geom.size[i] < PAINT && mat[(2, i)].abs() > 0.999);
    let paint = still && shape == Shape::Box && thin && on_floor(model, pos);
    let color = body_color(geom);
    // A spoke as thick as its disk would lie in the disk's surface: it is drawn a little fatter.
    let size = if !still && marker(geom) {
        geom.size.map_with_location(|i, _, s| if i == 0 { 1.2 * s } else { s })
    } else {
        geom.size
    };
    Thing {
        shape,
        size: f32s(&size),
        pos: f32s(pos),
        mat: f32m(mat),
        color,
        layer: if color[3] < 0.999 { Layer::Glass } else { Layer::Solid },
        checker: !still && !marker(geom),
        shadow: !paint && color[3] > 0.6,
        paint,
    }
}

/// A shape that belongs to no body; `None` for a plane. In: size and pose, m; axes in columns; colour and opacity.
pub fn alone(kind: GeomKind, size: &Vec3, pos: &Vec3, mat: &Mat3, color: [f32; 4]) -> Option<Thing> {
    let layer = if color[3] < 0.999 { Layer::Glass } else { Layer::Solid };
    let (size, pos, mat, shadow) = (f32s(size), f32s(pos), f32m(mat), color[3] > 0.6);
    Some(Thing { shape: shape(kind)?, size, pos, mat, color, layer, checker: false, shadow, paint: false })
}

/// Whether a point is in a level plane.
fn on_floor(model: &Model, pos: &Vec3) -> bool {
    let level = |g: &&Geom| g.kind == GeomKind::Plane && (g.quat * Vec3::z()).z > 1.0 - 1e-9;
    model.geoms.iter().filter(|g| g.body == 0).filter(level).any(|g| (g.pos.z - pos.z).abs() < PAINT)
}

/// Height of the highest level plane of the world, m.
pub fn floor(model: &Model) -> Option<f64> {
    let level = |g: &&Geom| g.kind == GeomKind::Plane && g.body == 0 && (g.quat * Vec3::z()).z > 1.0 - 1e-9;
    model.geoms.iter().filter(level).map(|g| g.pos.z).reduce(f64::max)
}

/// A geom that touches nothing marks the body's rotation itself.
fn marker(geom: &Geom) -> bool {
    geom.contype == 0 && geom.conaffinity == 0
}

fn shape(kind: GeomKind) -> Option<Shape> {
    Some(match kind {
        GeomKind::Plane => return None,
        GeomKind::Sphere => Shape::Sphere,
        GeomKind::Capsule => Shape::Capsule,
        GeomKind::Ellipsoid => Shape::Ellipsoid,
        GeomKind::Cylinder => Shape::Cylinder,
        GeomKind::Box => Shape::Box,
    })
}

fn body_color(geom: &Geom) -> [f32; 4] {
    color_of(geom.rgba, geom.body)
}

fn color_of(rgba: [f32; 4], body: usize) -> [f32; 4] {
    if rgba == [0.5, 0.5, 0.5, 1.0] && body > 0 {
        let [r, g, b] = PALETTE[(body - 1) % PALETTE.len()];
        return [r, g, b, 1.0];
    }
    rgba
}

/// A coloured plane keeps its colour; a grey one takes the light theme's.
fn floor_color(rgba: &[f32; 4]) -> [f32; 3] {
    if grey(rgba) { FLOOR } else { [rgba[0], rgba[1], rgba[2]] }
}

fn grey(rgba: &[f32; 4]) -> bool {
    (rgba[0] - rgba[1]).abs() < 0.02 && (rgba[1] - rgba[2]).abs() < 0.02
}

/// Distance of the fine lines: 1 m, or that times or over a power of five, so that a view shows some dozens.
fn grid(distance: f64) -> f32 {
    let power = (distance / 12.0).log(5.0).ceil().clamp(-6.0, 6.0);
    5f64.powf(power) as f32
}

/// Arrows and points of one picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Notes {
    pub contacts: bool,
    pub velocity: bool,
    pub pushes: bool,
    pub trail: bool,
}

impl Notes {
    pub const NONE: Notes = Notes { contacts: false, velocity: false, pushes: false, trail: false };
}

impl Default for Notes {
    fn default() -> Notes {
        Notes { contacts: true, velocity: false, pushes: true, trail: true }
    }
}

/// Lengths that suit a scene: how long an arrow for one weight and for one m/s is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Typical size of what moves, m.
    pub size: f64,
    /// m per N
    pub force: f64,
    /// m per (m/s), that is s.
    pub velocity: f64,
}

impl Scale {
    pub fn of(model: &Model) -> Scale {
        let sizes: Vec<f64> =
            model.geoms.iter().filter(|g| model.bodies[g.body].tree.is_some()).map(|g| g.rbound).collect();
        let size = (sizes.iter().sum::<f64>() / sizes.len().max(1) as f64).max(1e-3);
        let size = if size.is_finite() { size } else { 0.1 };
        let heaviest = model.bodies.iter().map(|b| b.mass).fold(0.0, f64::max).max(1e-9);
        let weight = heaviest * if model.opt.gravity.norm() > 1e-6 { model.opt.gravity.norm() } else { 9.81 };
        Scale { size, force: 2.0 * size / weight, velocity: size.max(0.05) * 0.8 }
    }

    fn radius(&self) -> f32 {
        (0.055 * self.size) as f32
    }

    /// An arrow no longer than some sizes of the scene: beyond, it grows like a logarithm.
    fn arrow(&self, vector: Vec3) -> V3 {
        let (length, long) = (vector.norm(), 4.0 * self.size);
        let shown = if length > long { long * (1.0 + (length / long).ln()) } else { length };
        f32s(&(vector * (shown / length.max(1e-12))))
    }
}

/// Contact points, with the normal and the friction force on the body that moves.
pub fn contacts(list: &mut DrawList, data: &Data, scale: &Scale) {
    for contact in &data.contacts {
        let sign = if contact.body[1] == 0 { -1.0 } else { 1.0 };
        let (normal, friction) = contact_force(&contact.frame, &contact.force);
        if normal.norm() == 0.0 {
            continue;
        }
        let (at, radius) = (f32s(&contact.pos), scale.radius());
        list.things.push(note(Shape::Sphere, V3::repeat(1.3 * radius), at, CONTACT_POINT));
        list.arrow(at, scale.arrow(normal * (sign * scale.force)), radius, NORMAL_FORCE);
        list.arrow(at, scale.arrow(friction * (sign * scale.force)), radius, FRICTION_FORCE);
    }
}

/// The velocity of a point, as an arrow from it.
pub fn velocity(list: &mut DrawList, at: &Vec3, velocity: &Vec3, scale: &Scale) {
    list.arrow(f32s(at), scale.arrow(velocity * scale.velocity), scale.radius(), VELOCITY);
}

/// A push on a body. The arrow ends at the body, as a hand would.
pub fn push(list: &mut DrawList, at: &Vec3, force: &Vec3, scale: &Scale) {
    let arrow = scale.arrow(force * scale.force);
    list.arrow(f32s(at) - arrow - arrow.normalize() * scale.size as f32, arrow, 1.5 * scale.radius(), APPLIED_FORCE);
}

/// A spring from a point of a body to the mouse.
pub fn spring(list: &mut DrawList, from: &Vec3, to: &Vec3, scale: &Scale) {
    list.things.push(note(Shape::Sphere, V3::repeat(1.6 * scale.radius()), f32s(from), APPLIED_FORCE));
    list.arrow(f32s(from), f32s(&(to - from)), 0.7 * scale.radius(), APPLIED_FORCE);
}

fn note(shape: Shape, size: V3, pos: V3, color: [f32; 4]) -> Thing {
    let mat = M3::identity();
    Thing { shape, size, pos, mat, color, layer: Layer::Note, checker: false, shadow: false, paint: false }
}

/// A camera that shows all that moves, from the side for a scene in the x-z plane.
pub fn framing(model: &Model, poses: &Poses) -> Camera {
    let mut camera = Camera::default();
    let moving: Vec<(Vec3, f64)> = model
        .geoms
        .iter()
        .filter(|g| model.bodies[g.body].tree.is_some())
        .map(|g| (position(poses, g).0, g.rbound))
        .collect();
    if moving.is_empty() {
        return camera;
    }
    let bound = |sign: f64| {
        let along = |i: usize| moving.iter().map(|(p, r)| sign * p[i] + r).fold(f64::MIN, f64::max) * sign;
        Vec3::new(along(0), along(1), along(2))
    };
    let (mut low, high) = (bound(-1.0), bound(1.0));
    // Whatever is in the air will come down.
    if model.geoms.iter().any(|g| g.kind == GeomKind::Plane) {
        low.z = low.z.min(0.0);
    }
    let extent = (high - low).norm().max(1e-2);
    camera.target = 0.5 * (low + high);
    camera.distance = (1.5 * extent).max(0.3);
    if planar(model) {
        camera.azimuth = 90f64.to_radians();
        camera.elevation = -8f64.to_radians();
        camera.distance = (1.9 * extent).max(0.3);
    }
    camera
}

/// The camera that a scene is first seen by: a pitch from behind the ball, anything else as it fits the picture.
pub fn first_look(session: &Session) -> Camera {
    let model = &session.model;
    let Some(&[line, ..]) = model.numerics.get("penny.goal").map(Vec::as_slice) else {
        return framing(model, &session.poses(1.0));
    };
    let (target, distance, azimuth, elevation) = if planar(model) {
        (Vec3::new(line - 2.2, 0.0, 0.9), 8.5, 90f64, -7f64)
    } else {
        (Vec3::new(line - 2.6, 0.0, 0.3), 7.2, 18f64, -24f64)
    };
    let (azimuth, elevation) = (azimuth.to_radians(), elevation.to_radians());
    Camera { target, distance, azimuth, elevation, ..Camera::default() }
}

/// Whether everything moves in the x-z plane: slides along x and z, hinges about y.
pub fn planar(model: &Model) -> bool {
    let flat = |j: &penny::model::Joint| match j.kind {
        JointKind::Slide => j.axis.y.abs() < 1e-9,
        JointKind::Hinge => j.axis.y.abs() > 1.0 - 1e-9,
        JointKind::Free | JointKind::Ball => false,
    };
    !model.joints.is_empty() && model.joints.iter().all(flat)
}
