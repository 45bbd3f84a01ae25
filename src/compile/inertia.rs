//! Mass, centre of mass and inertia: of the six shapes, of shells, of several together.

use std::f64::consts::PI;

use crate::math::{self, Mat3, Quat, Vec3};
use crate::model::GeomKind;

/// A rigid piece: mass (kg), centre of mass (m) and inertia about it (kg m²), in the frame it is part of.
#[derive(Clone, Copy, Debug, Default)]
pub struct Piece {
    pub mass: f64,
    pub com: Vec3,
    pub tensor: Mat3,
}

/// Several pieces as one.
///
///     m = Σ mᵢ,   c = Σ mᵢ cᵢ / m,   I = Σ Iᵢ + mᵢ (|dᵢ|² 1 − dᵢ dᵢᵀ),   dᵢ = cᵢ − c
///
/// Source: the parallel-axis theorem (Steiner).
pub fn combine(pieces: &[Piece]) -> Piece {
    let mass: f64 = pieces.iter().map(|p| p.mass).sum();
    if mass <= 0.0 {
        return Piece::default();
    }
    let com = pieces.iter().map(|p| p.com * p.mass).sum::<Vec3>() / mass;
    let tensor = pieces.iter().map(|p| p.tensor + steiner(p.mass, p.com - com)).sum();
    Piece { mass, com, tensor }
}

/// What a point mass (kg) at `d` (m) adds to the inertia about the origin.
pub fn steiner(mass: f64, d: Vec3) -> Mat3 {
    mass * (d.norm_squared() * Mat3::identity() - d * d.transpose())
}

/// R diag(I) Rᵀ: principal moments (kg m²) as a tensor in the frame in which `quat` turns the principal axes.
pub fn tensor(moments: &Vec3, quat: &Quat) -> Mat3 {
    let r = math::mat(quat);
    r * Mat3::from_diagonal(moments) * r.transpose()
}

/// Principal moments, largest first, the axes (columns, right-handed), and these as a quaternion. `None`: a number overflowed.
///
/// Jacobi's method: the largest element beside the diagonal is turned away until all are lost in rounding. Which of the axes'
/// two directions come out, which axes where moments are equal, and the quaternion's sign, is no matter of physics; a sensor of a
/// body's frame shows it, so turns and exchanges are MuJoCo's, and the quaternion is their product.
///
/// Source: G. H. Golub, C. F. Van Loan, Matrix Computations, §8.5; checked against `body_iquat` of MuJoCo 4.0.0.
pub fn principal(tensor: &Mat3) -> Option<(Vec3, Mat3, Quat)> {
    if !tensor.iter().all(|i| i.is_finite()) {
        return None;
    }
    let scale = tensor.amax();
    let (mut axes, mut quat) = (Mat3::identity(), Quat::identity());
    if scale == 0.0 {
        return Some((Vec3::zeros(), axes, quat));
    }
    let about = |axis: usize, angle: f64| math::exp(&Vec3::ith(axis, angle));
    let mut turned = tensor / scale;
    for _ in 0..MOST_TURNS {
        let beside = [(0, 1), (0, 2), (1, 2)].map(|(i, j)| (turned[(i, j)].abs(), i, j));
        // Of equal ones the last.
        let Some(&(largest, i, j)) = beside.iter().max_by(|a, b| a.0.total_cmp(&b.0)) else { break };
        if largest <= ROUNDING {
            break;
        }
        let tau = (turned[(j, j)] - turned[(i, i)]) / (2.0 * turned[(i, j)]);
        let tangent = 1.0f64.copysign(tau) / (tau.abs() + (1.0 + tau * tau).sqrt());
        let cos = 1.0 / tangent.hypot(1.0);
        let sin = tangent * cos;
        let moved = tangent * turned[(i, j)];
        (turned[(i, i)], turned[(j, j)]) = (turned[(i, i)] - moved, turned[(j, j)] + moved);
        let k = 3 - i - j;
        let (x, y) = (turned[(i, k)], turned[(j, k)]);
        let (x, y) = (cos * x - sin * y, sin * x + cos * y);
        for (place, value) in [((i, j), 0.0), ((i, k), x), ((j, k), y)] {
            turned[place] = value;
            turned[(place.1, place.0)] = value;
        }
        let (x, y) = (axes.column(i).into_owned(), axes.column(j).into_owned());
        axes.set_column(i, &(cos * x - sin * y));
        axes.set_column(j, &(sin * x + cos * y));
        quat *= about(k, if k == 1 { tangent.atan() } else { -tangent.atan() });
    }
    let mut moments = turned.diagonal();
    for i in [0, 1, 0] {
        if moments[i] + ROUNDING < moments[i + 1] {
            moments.swap_rows(i, i + 1);
            // A quarter turn about the third axis.
            axes.swap_columns(i, i + 1);
            axes.column_mut(i + 1).neg_mut();
            quat *= about((i + 2) % 3, 0.5 * PI);
        }
    }
    Some((moments * scale, axes, quat)).filter(|(moments, ..)| moments.iter().all(|i| i.is_finite()))
}

/// A dozen are enough: the elements beside the diagonal shrink quadratically.
const MOST_TURNS: usize = 100;
/// What is lost in rounding, against the largest element.
const ROUNDING: f64 = 1e-15;

/// Volume (m³) of a shape, or the area (m²) of its surface.
///
/// The ellipsoid's area is Thomsen's approximation with p = 1.6075 (error below 1.1 %), as MuJoCo's.
pub fn extent(kind: GeomKind, size: &Vec3, shell: bool) -> f64 {
    let (a, b, c) = (size.x, size.y, size.z);
    let (radius, length) = (a, 2.0 * b);
    match (kind, shell) {
        (GeomKind::Plane, _) => 0.0,
        (GeomKind::Sphere, false) => 4.0 / 3.0 * PI * radius.powi(3),
        (GeomKind::Sphere, true) => 4.0 * PI * radius.powi(2),
        (GeomKind::Capsule, false) => PI * radius.powi(2) * length + 4.0 / 3.0 * PI * radius.powi(3),
        (GeomKind::Capsule, true) => 2.0 * PI * radius * length + 4.0 * PI * radius.powi(2),
        (GeomKind::Cylinder, false) => PI * radius.powi(2) * length,
        (GeomKind::Cylinder, true) => 2.0 * PI * radius * length + 2.0 * PI * radius.powi(2),
        (GeomKind::Ellipsoid, false) => 4.0 / 3.0 * PI * a * b * c,
        (GeomKind::Ellipsoid, true) => {
            const P: f64 = 1.6075;
            let products = [a * b, b * c, c * a].map(|x| x.powf(P));
            4.0 * PI * (products.iter().sum::<f64>() / 3.0).powf(1.0 / P)
        }
        (GeomKind::Box, false) => 8.0 * a * b * c,
        (GeomKind::Box, true) => 8.0 * (a * b + b * c + c * a),
    }
}

/// Principal moments (kg m²) about the centre of a shape of mass M (kg), along its own axes.
///
/// Solid bodies: the textbook formulas. Shells: a thin layer of the same mass everywhere on the surface.
///
/// Source: MuJoCo manual, XML reference › geom › mass, density, shellinertia.
pub fn moments(kind: GeomKind, size: &Vec3, mass: f64, shell: bool) -> Vec3 {
    let (radius, length) = (size.x, 2.0 * size.y);
    let squares = size.component_mul(size);
    match (kind, shell) {
        (GeomKind::Plane, _) => Vec3::zeros(),
        (GeomKind::Sphere, false) => Vec3::repeat(2.0 / 5.0 * mass * radius.powi(2)),
        (GeomKind::Sphere, true) => Vec3::repeat(2.0 / 3.0 * mass * radius.powi(2)),
        (GeomKind::Box, false) => from_second_moments(&(squares * (mass / 3.0))),
        (GeomKind::Box, true) => box_shell(size, mass),
        (GeomKind::Ellipsoid, false) => from_second_moments(&(squares * (mass / 5.0))),
        (GeomKind::Ellipsoid, true) => ellipsoid_shell(size, mass),
        (GeomKind::Cylinder, false) => {
            let across = mass * (3.0 * radius.powi(2) + length.powi(2)) / 12.0;
            Vec3::new(across, across, mass * radius.powi(2) / 2.0)
        }
        (GeomKind::Cylinder, true) => cylinder_shell(radius, length, mass),
        (GeomKind::Capsule, false) => capsule_solid(radius, length, mass),
        (GeomKind::Capsule, true) => capsule_shell(radius, length, mass),
    }
}

/// Moments of inertia from the second moments S = ∫ (x², y², z²) dm: Iₓ = S_y + S_z and so on.
fn from_second_moments(s: &Vec3) -> Vec3 {
    Vec3::new(s.y + s.z, s.x + s.z, s.x + s.y)
}

/// Six uniform faces. The two faces across x carry mₓ = M bc/(ab + bc + ca); with the half-sizes a, b, c
///
///     ∫ x² dm = a² (mₓ + (m_y + m_z)/3)
fn box_shell(size: &Vec3, mass: f64) -> Vec3 {
    let areas = Vec3::new(size.y * size.z, size.z * size.x, size.x * size.y);
    let faces = areas * (mass / areas.sum());
    let s = Vec3::from_fn(|i, _| size[i].powi(2) * (faces[i] + (faces.sum() - faces[i]) / 3.0));
    from_second_moments(&s)
}

/// A tube and two discs, by area: tube L, each disc r/2.
///
///     I_z = M_t r² + M_d r²/2,   Iₓ = M_t (r²/2 + L²/12) + M_d (r²/4 + L²/4)
fn cylinder_shell(radius: f64, length: f64, mass: f64) -> Vec3 {
    let tube = mass * length / (length + radius);
    let discs = mass - tube;
    let (r2, l2) = (radius.powi(2), length.powi(2));
    let across = tube * (r2 / 2.0 + l2 / 12.0) + discs * (r2 + l2) / 4.0;
    Vec3::new(across, across, tube * r2 + discs * r2 / 2.0)
}

/// A cylinder (mass M_c) between two half balls (together M_s = M · 4r/(4r + 3L)).
///
///     Iₓ = M_c (3r² + L²)/12 + 2/5 M_s r² + M_s L (3r + 2L)/8,   I_z = M_c r²/2 + 2/5 M_s r²
fn capsule_solid(radius: f64, length: f64, mass: f64) -> Vec3 {
    let ball = mass * 4.0 * radius / (4.0 * radius + 3.0 * length);
    let tube = mass - ball;
    let (r2, l2) = (radius.powi(2), length.powi(2));
    let centred = 2.0 / 5.0 * ball * r2;
    let across = tube * (3.0 * r2 + l2) / 12.0 + centred + ball * length * (3.0 * radius + 2.0 * length) / 8.0;
    Vec3::new(across, across, tube * r2 / 2.0 + centred)
}

/// A tube (M_c) between two half spheres (together M_s, by area); a half sphere's centre of mass is r/2 away.
///
///     Iₓ = M_c (6r² + L²)/12 + 2/3 M_s r² + M_s ((L/2 + r/2)² − (r/2)²),   I_z = M_c r² + 2/3 M_s r²
fn capsule_shell(radius: f64, length: f64, mass: f64) -> Vec3 {
    let sphere = mass * 2.0 * radius / (2.0 * radius + length);
    let tube = mass - sphere;
    let (r2, l2) = (radius.powi(2), length.powi(2));
    let centred = 2.0 / 3.0 * sphere * r2;
    let shifted = sphere * ((0.5 * (length + radius)).powi(2) - (0.5 * radius).powi(2));
    let across = tube * (6.0 * r2 + l2) / 12.0 + centred + shifted;
    Vec3::new(across, across, tube * r2 + centred)
}

/// The layer between two solid ellipsoids, the outer larger by ε = 1 µm in each half-size, as MuJoCo defines it.
///
/// With V = abc and S_x = V a² the layer's second moment is ΔS/ΔV · M/5. The differences are written out, since
/// subtracting nearly equal numbers would lose ten digits:
///
///     ΔV = ε (ab + bc + ca) + ε² (a + b + c) + ε³,   ΔSₓ = a² ΔV + (V + ΔV)(2aε + ε²)
fn ellipsoid_shell(size: &Vec3, mass: f64) -> Vec3 {
    const E: f64 = 1e-6;
    let (a, b, c) = (size.x, size.y, size.z);
    let dv = E * (a * b + b * c + c * a) + E * E * (a + b + c) + E * E * E;
    let outer = a * b * c + dv;
    let s = size.map(|x| mass / 5.0 * (x * x + outer / dv * (2.0 * x * E + E * E)));
    from_second_moments(&s)
}
