//! Numbers and conventions, named once.
//!
//! Everything inside Penny is f64, SI and radians. Quaternions are written [w, x, y, z] in files and in
//! `qpos`, as in MuJoCo; nalgebra stores them otherwise, so convert only through this module.
//! Six-vectors (twists, wrenches, free-joint velocities) hold the **linear part first**, then the angular
//! part: the order of a free joint in `qvel` and of MuJoCo's `xfrc_applied`.

use std::f64::consts::PI;

/// Three numbers: x, y, z.
pub type Vec3 = nalgebra::Vector3<f64>;
/// 3 × 3.
pub type Mat3 = nalgebra::Matrix3<f64>;
/// Linear part, angular part.
pub type Vec6 = nalgebra::Vector6<f64>;
/// 6 × 6.
pub type Mat6 = nalgebra::Matrix6<f64>;
/// A rotation.
pub type Quat = nalgebra::UnitQuaternion<f64>;

/// MuJoCo's `mjMINVAL`: below this a length, mass or denominator counts as zero.
pub const MIN_VAL: f64 = 1e-15;

/// MuJoCo's `mjMINMU`: friction coefficients of contacts are at least this.
pub const MIN_MU: f64 = 1e-5;

/// A quaternion from [w, x, y, z], normalised; a zero quaternion becomes the identity, as in MuJoCo.
#[inline]
pub fn quat(wxyz: &[f64]) -> Quat {
    let [w, x, y, z] = [wxyz[0], wxyz[1], wxyz[2], wxyz[3]];
    let q = nalgebra::Quaternion::new(w, x, y, z);
    let square = (w * w + y * y) + (x * x + z * z);
    // |q|² − 1 is twice |q| − 1: no root is needed to see that a quaternion is fine.
    if (square - 1.0).abs() <= 2.0 * MIN_VAL {
        Quat::new_unchecked(q)
    } else if square < MIN_VAL * MIN_VAL {
        Quat::identity()
    } else {
        Quat::new_unchecked(q / square.sqrt())
    }
}

/// The four numbers [w, x, y, z] of a quaternion, as `qpos` holds them.
#[inline]
pub fn wxyz(q: &Quat) -> [f64; 4] {
    [q.w, q.i, q.j, q.k]
}

/// Rotation matrix of a unit quaternion: maps local vectors to the parent's axes.
#[inline]
pub fn mat(q: &Quat) -> Mat3 {
    q.to_rotation_matrix().into_inner()
}

/// The rotation by the vector `theta` (axis times angle, rad), exact at any angle.
///
///     exp θ = [cos |θ|/2, θ/|θ| sin |θ|/2]
///
/// Up to 0.4 rad, more than a step should turn, by power series: what they leave out is below 1e-17.
#[inline]
pub fn exp(theta: &Vec3) -> Quat {
    let xx = 0.25 * theta.norm_squared();
    let (cos, sinc) = if xx < 0.04 {
        (series(xx, &COS), series(xx, &SINC))
    } else {
        let x = xx.sqrt();
        let (sin, cos) = x.sin_cos();
        (cos, sin / x)
    };
    let v = theta * (0.5 * sinc);
    Quat::new_unchecked(nalgebra::Quaternion::new(cos, v.x, v.y, v.z))
}

/// The rotation vector from `a` to `b`, shorter than half a turn: log(a⁻¹ b).
pub fn between(a: &Quat, b: &Quat) -> Vec3 {
    let d = a.inverse() * b;
    let v = Vec3::new(d.i, d.j, d.k);
    let sine = v.norm();
    if sine < MIN_VAL {
        return Vec3::zeros();
    }
    let mut angle = 2.0 * sine.atan2(d.w);
    if angle > PI {
        angle -= 2.0 * PI;
    }
    v * (angle / sine)
}

/// [`exp`] of an angle (rad) about a unit axis, for steps: small angles by series.
#[inline]
pub fn turn(axis: &Vec3, angle: f64) -> Quat {
    let (sin, cos) = sin_cos(0.5 * angle);
    Quat::new_unchecked(nalgebra::Quaternion::new(cos, axis.x * sin, axis.y * sin, axis.z * sin))
}

/// The same for poses in files: exact to the last bit at any angle, and normalised.
pub fn axis_angle(axis: &Vec3, angle: f64) -> Quat {
    let (sin, cos) = (0.5 * angle).sin_cos();
    quat(&[cos, axis.x * sin, axis.y * sin, axis.z * sin])
}

/// Product of turns by three angles (rad) about the axes that `sequence` names: x, y, z about the turned axes, each
/// factor on the right; X, Y, Z about the fixed ones, on the left.
pub fn euler(sequence: &[u8; 3], angles: &[f64; 3]) -> Quat {
    sequence.iter().zip(angles).fold(Quat::identity(), |q, (letter, angle)| {
        let axis = match letter.to_ascii_lowercase() {
            b'x' => Vec3::x(),
            b'y' => Vec3::y(),
            _ => Vec3::z(),
        };
        let factor = axis_angle(&axis, *angle);
        if letter.is_ascii_lowercase() { q * factor } else { factor * q }
    })
}

/// Sine and cosine; small angles as in [`exp`].
#[inline]
fn sin_cos(x: f64) -> (f64, f64) {
    let xx = x * x;
    if xx < 0.04 { (x * series(xx, &SINC), series(xx, &COS)) } else { x.sin_cos() }
}

/// Power series of cos x and sin x / x in x²: (−1)ᵏ / (2k)! and (−1)ᵏ / (2k + 1)!.
const COS: [f64; 6] = [1.0, -1.0 / 2.0, 1.0 / 24.0, -1.0 / 720.0, 1.0 / 40320.0, -1.0 / 3628800.0];
const SINC: [f64; 6] = [1.0, -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0, 1.0 / 362880.0, -1.0 / 39916800.0];

/// Σ cₖ xᵏ, in pairs: half as long a chain of operations as Horner's rule.
#[inline]
fn series(x: f64, c: &[f64; 6]) -> f64 {
    let xx = x * x;
    (c[0] + c[1] * x) + xx * ((c[2] + c[3] * x) + xx * (c[4] + c[5] * x))
}

/// The 3-vector at `s[0..3]`.
#[inline]
pub fn vec3(s: &[f64]) -> Vec3 {
    Vec3::new(s[0], s[1], s[2])
}

/// A symmetric 3 × 3 matrix.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sym3 {
    /// Diagonal.
    pub xx: f64,
    /// Diagonal.
    pub yy: f64,
    /// Diagonal.
    pub zz: f64,
    /// Off the diagonal, twice in the matrix.
    pub xy: f64,
    /// Off the diagonal, twice in the matrix.
    pub xz: f64,
    /// Off the diagonal, twice in the matrix.
    pub yz: f64,
}

impl Sym3 {
    /// R diag(d) Rᵀ
    pub fn from_principal(d: &Vec3, r: &Mat3) -> Sym3 {
        Sym3 { xx: d.x, yy: d.y, zz: d.z, ..Sym3::default() }.turned(r)
    }

    /// R S Rᵀ
    #[inline]
    pub fn turned(&self, r: &Mat3) -> Sym3 {
        let row = |i: usize| Vec3::new(r[(i, 0)], r[(i, 1)], r[(i, 2)]);
        let (x, y, z) = (row(0), row(1), row(2));
        let (sx, sy, sz) = (self.mul(&x), self.mul(&y), self.mul(&z));
        Sym3 { xx: x.dot(&sx), yy: y.dot(&sy), zz: z.dot(&sz), xy: x.dot(&sy), xz: x.dot(&sz), yz: y.dot(&sz) }
    }

    /// Matrix times vector.
    #[inline]
    pub fn mul(&self, v: &Vec3) -> Vec3 {
        Vec3::new(
            self.xx * v.x + self.xy * v.y + self.xz * v.z,
            self.xy * v.x + self.yy * v.y + self.yz * v.z,
            self.xz * v.x + self.yz * v.y + self.zz * v.z,
        )
    }

    /// Sum.
    #[inline]
    pub fn add(&mut self, other: &Sym3) {
        self.xx += other.xx;
        self.yy += other.yy;
        self.zz += other.zz;
        self.xy += other.xy;
        self.xz += other.xz;
        self.yz += other.yz;
    }

    /// All nine numbers.
    pub fn mat(&self) -> Mat3 {
        Mat3::new(self.xx, self.xy, self.xz, self.xy, self.yy, self.yz, self.xz, self.yz, self.zz)
    }
}

/// Inertia about o of a point mass `m` at `c` from o: −m c×² = m (c² 1 − c cᵀ).
#[inline]
pub fn point_mass(m: f64, c: &Vec3) -> Sym3 {
    let h = m * c;
    let (xx, yy, zz) = (h.x * c.x, h.y * c.y, h.z * c.z);
    Sym3 { xx: yy + zz, yy: xx + zz, zz: xx + yy, xy: -h.x * c.y, xz: -h.x * c.z, yz: -h.y * c.z }
}

/// The matrix of `v ×`.
pub fn cross(v: &Vec3) -> Mat3 {
    Mat3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

/// H = L D Lᵀ of a symmetric positive definite H, of which only the lower triangle counts: L below the diagonal (on it
/// are ones), 1/D on it.
#[inline(always)]
pub fn factor_ldl<const N: usize>(h: &mut [[f64; N]; N]) {
    for j in 0..N {
        let inverse = 1.0 / h[j][j];
        for i in j + 1..N {
            let l = h[i][j] * inverse;
            for k in j + 1..=i {
                h[i][k] -= l * h[k][j];
            }
        }
        for i in j + 1..N {
            h[i][j] *= inverse;
        }
        h[j][j] = inverse;
    }
}

/// x = (L D Lᵀ)⁻¹ x
#[inline(always)]
pub fn divide_ldl<const N: usize>(l: &[[f64; N]; N], x: &mut [f64; N]) {
    for j in 0..N {
        for i in j + 1..N {
            x[i] -= l[i][j] * x[j];
        }
    }
    for i in 0..N {
        x[i] *= l[i][i];
    }
    for j in (0..N).rev() {
        for i in 0..j {
            x[i] -= l[j][i] * x[j];
        }
    }
}
