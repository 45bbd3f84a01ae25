//! Poses: five ways to write an orientation, degrees or radians, `<frame>` elements and `fromto`.

use crate::math::{self, Mat3, Quat, Vec3};
use crate::mjcf::spec::{Compiler, Orientation, Pose};

/// Below this length a direction in a file counts as none, and below this sine two directions as the same.
///
/// Source: checked by running MuJoCo 4.0.0.
pub const EPS: f64 = 1e-7;

/// What is wrong with a direction that is shorter.
pub const TOO_SHORT: &str = "its length is below 1e-7";

/// An attribute that should name a direction, but does not.
#[derive(Clone, Copy, Debug)]
pub struct NoDirection {
    pub attribute: &'static str,
    pub why: &'static str,
    /// It stands in a `<frame>` around the element.
    pub in_frame: bool,
}

impl NoDirection {
    pub fn new(attribute: &'static str, why: &'static str) -> NoDirection {
        NoDirection { attribute, why, in_frame: false }
    }
}

/// Pose of an item in its body's frame: every `<frame>` around it, outermost first, then its own pose.
pub fn pose(pose: &Pose, compiler: &Compiler) -> Result<(Vec3, Quat), NoDirection> {
    let own = (Vec3::from(pose.pos), orientation(&pose.orientation, compiler)?);
    in_frames(&pose.frames, own, compiler)
}

/// Takes a pose inside `<frame>` elements (outermost first) to the body's frame.
pub fn in_frames(frames: &[Pose], inner: (Vec3, Quat), compiler: &Compiler) -> Result<(Vec3, Quat), NoDirection> {
    frames.iter().rev().try_fold(inner, |(pos, quat), frame| {
        let turned = orientation(&frame.orientation, compiler);
        let (frame_pos, frame_quat) =
            (Vec3::from(frame.pos), turned.map_err(|what| NoDirection { in_frame: true, ..what })?);
        Ok((frame_pos + frame_quat * pos, frame_quat * quat))
    })
}

/// The rotation that an orientation attribute describes.
///
///     axisangle (a, θ)   turn by θ about a
///     euler              product of turns about the axes of `eulerseq`: lower case about the turned axes
///                        (each factor on the right), upper case about the fixed ones (on the left)
///     xyaxes             x as given, y made orthogonal to it, z = x × y
///     zaxis              the smallest turn that brings +Z there
///
/// Source: MuJoCo manual, Modeling › Frame orientations.
pub fn orientation(given: &Option<Box<Orientation>>, compiler: &Compiler) -> Result<Quat, NoDirection> {
    let Some(orientation) = given else { return Ok(Quat::identity()) };
    let unit = |attribute: &'static str, v: Vec3| {
        if v.norm() < EPS { Err(NoDirection::new(attribute, TOO_SHORT)) } else { Ok(v / v.norm()) }
    };
    let radian = |angle: f64| if compiler.degree { angle.to_radians() } else { angle };
    Ok(match **orientation {
        Orientation::Quat(q) => {
            if nalgebra::Vector4::from(q).norm() < math::MIN_VAL {
                return Err(NoDirection::new("quat", "its length is zero"));
            }
            math::quat(&q)
        }
        Orientation::AxisAngle([x, y, z, angle]) => {
            math::axis_angle(&unit("axisangle", Vec3::new(x, y, z))?, radian(angle))
        }
        Orientation::ZAxis(z) => from_z(&unit("zaxis", Vec3::from(z))?),
        Orientation::XyAxes([a, b, c, d, e, f]) => {
            let x = unit("xyaxes", Vec3::new(a, b, c))?;
            let y = Vec3::new(d, e, f);
            let y = y - x * x.dot(&y);
            if y.norm() < EPS {
                return Err(NoDirection::new("xyaxes", "its two axes are parallel"));
            }
            let y = y / y.norm();
            from_columns(&Mat3::from_columns(&[x, y, x.cross(&y)]))
        }
        Orientation::Euler(angles) => math::euler(&compiler.eulerseq, &angles.map(radian)),
    })
}

/// The smallest turn that brings +Z onto the unit vector `z`; half a turn about X where z is −Z up to [`EPS`].
///
///     axis = Z × z / |Z × z|,   angle = atan2(|Z × z|, z·Z)
pub fn from_z(z: &Vec3) -> Quat {
    let across = Vec3::z().cross(z);
    let sin = across.norm();
    let (axis, sin) = if sin < EPS { (Vec3::x(), 0.0) } else { (across / sin, sin) };
    math::axis_angle(&axis, sin.atan2(z.z))
}

/// The rotation whose matrix has the given orthonormal, right-handed columns.
pub fn from_columns(m: &Mat3) -> Quat {
    Quat::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(*m))
}

/// A geom stretched between two points: centre, orientation, half-length (m).
///
/// Its Z axis points from the **second** point to the first: so does MuJoCo 4.0.0, against its own manual.
pub fn fromto(p: &[f64; 6]) -> Result<(Vec3, Quat, f64), NoDirection> {
    let (a, b) = (math::vec3(&p[..3]), math::vec3(&p[3..]));
    let length = (a - b).norm();
    if length < EPS {
        return Err(NoDirection::new("fromto", "its two points coincide"));
    }
    Ok((0.5 * (a + b), from_z(&((a - b) / length)), 0.5 * length))
}
