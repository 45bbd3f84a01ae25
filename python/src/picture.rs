//! Pictures of a scene, drawn on the CPU by `penny-view`.

use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use penny::data::Data;
use penny::math::{Mat3, Vec3};
use penny::model::{GeomKind, Path};
use penny::quantities;
use penny_view::camera::Camera;
use penny_view::depth;
use penny_view::draw::Thing;
use penny_view::paint;
use penny_view::scene::{self, Scale};
use penny_view::session::Poses;
use penny_view::video;
use pyo3::exceptions::{PyIndexError, PyNotImplementedError, PyValueError};
use pyo3::prelude::*;

use crate::data::{Core, MjData};

/// Where a picture is taken from: a camera of the scene, or lookat (m), distance (m), azimuth, elevation and vertical
/// field of view (degrees).
#[derive(FromPyObject)]
pub enum From {
    Camera(usize),
    Free([f64; 7]),
}

fn poses(core: &Core) -> Poses {
    Poses { pos: core.data.xpos.clone(), quat: core.data.xquat.clone() }
}

fn eye(core: &Core, from: &From) -> PyResult<Camera> {
    match *from {
        From::Camera(i) => {
            let Some(camera) = core.model.cameras.get(i) else {
                return Err(PyIndexError::new_err(format!("camera {i}: there are {}", core.model.cameras.len())));
            };
            let (pos, axes) = quantities::camera(&core.model, &Data::new(&core.model), &core.data, i);
            // How far it looks decides about grid and haze: to where the scene is.
            let distance = (scene::framing(&core.model, &poses(core)).target - pos).norm().max(0.1);
            Ok(Camera::at(&pos, &axes, distance, camera.fovy))
        }
        From::Free([x, y, z, distance, azimuth, elevation, fovy]) => {
            if !(distance > 0.0 && fovy > 0.0 && fovy < 180.0) {
                return Err(PyValueError::new_err(
                    "a camera has a distance above 0 m and a fovy between 0 and 180 degrees",
                ));
            }
            let [azimuth, elevation, fovy] = [azimuth, elevation, fovy].map(f64::to_radians);
            Ok(Camera { target: Vec3::new(x, y, z), distance, azimuth, elevation, fovy, ..Camera::default() })
        }
    }
}

/// A shape that a program has added: `mjtGeom`, size (m; round ones: radius, radius, half-length), place (m), axes in rows,
/// colour and opacity.
type Added = (i64, [f64; 3], [f64; 3], [f64; 9], [f32; 4]);

fn alone(&(kind, [x, y, z], pos, mat, rgba): &Added) -> Option<Thing> {
    let (kind, size) = match kind {
        2 => (GeomKind::Sphere, [x, y, z]),
        3 => (GeomKind::Capsule, [x, z, 0.0]),
        4 => (GeomKind::Ellipsoid, [x, y, z]),
        5 => (GeomKind::Cylinder, [x, z, 0.0]),
        6 => (GeomKind::Box, [x, y, z]),
        _ => return None,
    };
    scene::alone(kind, &size.into(), &pos.into(), &Mat3::from_row_slice(&mat), rgba)
}

/// A picture of the scene as it was at the last step or `mj_forward`: (height, width, 3), uint8, rows from the top.
///
/// In: the groups of geoms to be seen; whether contact points and forces are shown; what else is.
#[pyfunction]
#[pyo3(signature = (d, width, height, camera, groups, contacts, added=vec![]))]
#[allow(clippy::too_many_arguments)]
pub fn _paint<'py>(
    py: Python<'py>,
    d: &Bound<'py, MjData>,
    width: usize,
    height: usize,
    camera: From,
    groups: Vec<bool>,
    contacts: bool,
    added: Vec<Added>,
) -> PyResult<Bound<'py, PyArray3<u8>>> {
    check_size(width, height)?;
    let data = d.try_borrow()?;
    let core = &data.core;
    let camera = eye(core, &camera)?;
    let rgb = py.detach(|| {
        let mut list = scene::draw(&core.model, &poses(core), camera);
        let of = |planes: bool| core.model.geoms.iter().filter(move |g| (g.kind == GeomKind::Plane) == planes);
        let [mut floors, mut things] =
            [true, false].map(|p| of(p).map(|g| shown(&groups, g.group)).collect::<Vec<_>>().into_iter());
        list.floors.retain(|_| floors.next().unwrap_or(true));
        list.things.retain(|_| things.next().unwrap_or(true));
        if contacts {
            scene::contacts(&mut list, &core.data, &Scale::of(&core.model));
        }
        list.things.extend(added.iter().filter_map(alone));
        let image = paint::paint(&list, width, height, 1);
        image.rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect::<Vec<u8>>()
    });
    PyArray1::from_vec(py, rgb).reshape([height, width, 3])
}

/// Depths and ids of geoms.
type Depths<'py> = (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray2<i32>>);

/// Depth (m, float32) of what the middle of each pixel sees, (height, width), rows from the top, and which geom that is
/// (int32; −1: a mesh that is only seen, or nothing up to `far`, whose depth is `far`).
///
/// In: the groups of geoms to be seen; nearest and farthest depth, m.
#[pyfunction]
#[pyo3(signature = (d, width, height, camera, groups, near, far))]
#[allow(clippy::too_many_arguments)]
pub fn _depth<'py>(
    py: Python<'py>,
    d: &Bound<'py, MjData>,
    width: usize,
    height: usize,
    camera: From,
    groups: Vec<bool>,
    near: f64,
    far: f64,
) -> PyResult<Depths<'py>> {
    check_size(width, height)?;
    if !(near > 0.0 && far > near) {
        return Err(PyValueError::new_err(format!("depths from {near} m to {far} m")));
    }
    let data = d.try_borrow()?;
    let core = &data.core;
    if core.model.tendons.iter().any(|t| matches!(t.path, Path::Spatial(_))) {
        return Err(PyNotImplementedError::new_err("Penny's pictures of depth and segments have no spatial tendons"));
    }
    let lacking = scene::unseen(&core.model);
    if !lacking.is_empty() {
        return Err(PyValueError::new_err(lacking.join("\n")));
    }
    let camera = eye(core, &camera)?;
    let seen = py.detach(|| {
        let shown = |i: usize| shown(&groups, core.model.geoms[i].group);
        depth::depths(&core.model, &poses(core), &camera, [width, height], near..far, shown)
    });
    let depths = seen.iter().map(|s| s.depth as f32).collect();
    let ids = seen.iter().map(|s| s.geom.map_or(-1, |i| i as i32)).collect();
    let shape = [height, width];
    Ok((PyArray1::from_vec(py, depths).reshape(shape)?, PyArray1::from_vec(py, ids).reshape(shape)?))
}

fn check_size(width: usize, height: usize) -> PyResult<()> {
    if width == 0 || height == 0 || width.saturating_mul(height) > 1 << 26 {
        return Err(PyValueError::new_err(format!("a picture of {width} × {height} pixels")));
    }
    Ok(())
}

/// Whether geoms of a group are to be seen; of no known group they are.
fn shown(groups: &[bool], group: i32) -> bool {
    usize::try_from(group).ok().and_then(|g| groups.get(g)).copied().unwrap_or(true)
}

/// A camera that shows all that moves: lookat (m), distance (m), azimuth, elevation, vertical field of view (degrees).
#[pyfunction]
pub fn _framing(d: &Bound<MjData>) -> PyResult<[f64; 7]> {
    let data = d.try_borrow()?;
    let Camera { target, distance, azimuth, elevation, fovy, .. } =
        scene::framing(&data.core.model, &poses(&data.core));
    let [azimuth, elevation, fovy] = [azimuth, elevation, fovy].map(f64::to_degrees);
    Ok([target.x, target.y, target.z, distance, azimuth, elevation, fovy])
}

/// Writes pictures, each (height, width, 3) and uint8, as a video: .gif, .apng, .png (the last one), and with ffmpeg .mp4
/// and .webm.
#[pyfunction]
#[pyo3(signature = (path, frames, fps=None))]
pub fn save_video(
    path: std::path::PathBuf,
    frames: Vec<numpy::PyReadonlyArray3<u8>>,
    fps: Option<f64>,
) -> PyResult<()> {
    let wrong = |why: String| PyValueError::new_err(why);
    let Some((height, width, _)) = frames.first().map(|f| f.as_array().dim()) else {
        return Err(wrong("no pictures".into()));
    };
    let fps = match fps {
        Some(fps) if !(fps > 0.0 && fps.is_finite()) => return Err(wrong("fps is above zero".into())),
        Some(fps) => fps,
        None => video::Format::of(&path).map_err(wrong)?.usual_fps(),
    };
    let shape = video::Shape { width, height, fps, frames: frames.len() };
    let mut file = video::Video::create(&path, shape).map_err(wrong)?;
    for frame in &frames {
        let pixels = frame.as_array();
        if pixels.dim() != (height, width, 3) {
            return Err(wrong("all pictures are (height, width, 3), and of one size".into()));
        }
        let mut image = paint::Image::new(width, height);
        let colours = pixels.iter().copied().collect::<Vec<u8>>();
        for (to, from) in image.rgba.chunks_exact_mut(4).zip(colours.chunks_exact(3)) {
            to[..3].copy_from_slice(from);
        }
        file.push(&image).map_err(wrong)?;
    }
    file.finish().map_err(wrong)
}
