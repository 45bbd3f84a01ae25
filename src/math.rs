//! Numbers and conventions, named once.
//!
//! Everything inside Penny is f64, SI and radians. Quaternions are written [w, x, y, z] in files and in
//! `qpos`, as in MuJoCo; nalgebra stores them otherwise, so convert only through this module.
//! Six-vectors (twists, wrenches, free-joint velocities) hold the **linear part first**, then the angular
//! part: the order of a free joint in `qvel` and of MuJoCo's `xfrc_applied`.

pub type Vec3 = nalgebra::Vector3<f64>;
pub type Mat3 = nalgebra::Matrix3<f64>;
pub type Vec6 = nalgebra::Vector6<f64>;
pub type Mat6 = nalgebra::Matrix6<f64>;
pub type Quat = nalgebra::UnitQuaternion<f64>;

/// MuJoCo's `mjMINVAL`: below this a length, mass or denominator counts as zero.
pub const MIN_VAL: f64 = 1e-15;

/// A quaternion from [w, x, y, z], normalised; a zero quaternion becomes the identity, as in MuJoCo.
pub fn quat(wxyz: &[f64]) -> Quat {
    let q = nalgebra::Quaternion::new(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
    let norm = q.norm();
    if norm < MIN_VAL {
        Quat::identity()
    } else if (norm - 1.0).abs() > MIN_VAL {
        Quat::new_unchecked(q / norm)
    } else {
        Quat::new_unchecked(q)
    }
}

/// The four numbers [w, x, y, z] of a quaternion, as `qpos` holds them.
pub fn wxyz(q: &Quat) -> [f64; 4] {
    [q.w, q.i, q.j, q.k]
}

/// Rotation matrix of a unit quaternion: maps local vectors to the parent's axes.
pub fn mat(q: &Quat) -> Mat3 {
    q.to_rotation_matrix().into_inner()
}

/// The rotation by the vector `theta` (axis times angle, rad), exact at any angle.
///
///     exp θ = [cos |θ|/2, θ/|θ| sin |θ|/2]
///
/// Up to half a radian, which is what a step turns, by the power series of cos x and sin x / x to the last bit.
pub fn exp(theta: &Vec3) -> Quat {
    let xx = 0.25 * theta.norm_squared();
    let (cos, sinc) = if xx < 0.0625 {
        (
            1.0 - xx / 2.0
                * (1.0 - xx / 12.0 * (1.0 - xx / 30.0 * (1.0 - xx / 56.0 * (1.0 - xx / 90.0 * (1.0 - xx / 132.0))))),
            1.0 - xx / 6.0 * (1.0 - xx / 20.0 * (1.0 - xx / 42.0 * (1.0 - xx / 72.0 * (1.0 - xx / 110.0)))),
        )
    } else {
        let x = xx.sqrt();
        let (sin, cos) = x.sin_cos();
        (cos, sin / x)
    };
    let v = theta * (0.5 * sinc);
    Quat::new_unchecked(nalgebra::Quaternion::new(cos, v.x, v.y, v.z))
}

/// The 3-vector at `s[0..3]`.
pub fn vec3(s: &[f64]) -> Vec3 {
    Vec3::new(s[0], s[1], s[2])
}

/// The matrix of `v ×`.
pub fn cross(v: &Vec3) -> Mat3 {
    Mat3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}
