//! What a medium exerts on a moving ellipsoid.
//!
//! r semi-axes, v and ω velocity less the wind in its axes, ρ density and β viscosity, V volume, m_A and I_A virtual mass
//! and inertia over ρ. With the area that it shows to the flow, and the normal n of the section that shows it,
//!
//!     aᵢ = (rⱼ rₖ)²,   N = Σ aᵢ vᵢ²,   D = Σ aᵢ² vᵢ²,   A = π √(D/N),   n = a ∘ v
//!
//! force and torque are sums of
//!
//!     added mass   f = ρ m_A∘v × ω,             g = ρ m_A∘v × v + ρ I_A∘ω × ω
//!     Magnus       f = C_M ρ V ω × v
//!     Kutta        f = C_K ρ A N/(|v| D) (n × v) × v
//!     drag         f = −(6π β r̄ + ρ |v| (C_blunt A + C_slender (A_max − A))) v
//!                  g = −(8π β r̄³ + ρ |μ∘ω|) ω,  μᵢ = C_angular Iᵢ + C_slender (I_max − Iᵢ),  Iᵢ = 8π/15 rᵢ max(rⱼ, rₖ)⁴
//!
//! Source: MuJoCo 4.0 manual, Computation › Fluid forces › Ellipsoid model (G. Novati); I_max = 8π/15 r_mid r_max⁴ by
//! experiment.

use std::f64::consts::PI;

use crate::math::{MIN_VAL, Mat3, Vec3, cross};
use crate::model::Fluid;

/// Force (N) and torque (N m), and how they change with v and ω.
#[derive(Clone, Copy, Debug)]
pub struct Drag {
    pub force: Vec3,
    pub torque: Vec3,
    /// ∂f/∂v, ∂f/∂ω, ∂g/∂v, ∂g/∂ω
    pub slopes: [[Mat3; 2]; 2],
}

/// In: `r` semi-axes, m; density, kg/m³; viscosity, Pa s; velocities in the ellipsoid's axes.
pub fn drag(fluid: &Fluid, r: &Vec3, density: f64, viscosity: f64, v: &Vec3, w: &Vec3) -> Drag {
    let [blunt, slender, angular, kutta, magnus] = fluid.coef;
    let (rho, volume, mean) = (density, 4.0 / 3.0 * PI * r.product(), r.sum() / 3.0);
    let (most, least) = (r.max(), r.min());
    let middle = r.sum() - most - least;
    let speed = v.norm();

    // Added mass.
    let (mass, inertia) = (fluid.virtual_mass * rho, fluid.virtual_inertia * rho);
    let (p, l) = (mass.component_mul(v), inertia.component_mul(w));
    let mut force = p.cross(w);
    let mut torque = p.cross(v) + l.cross(w);
    let (mass, inertia) = (Mat3::from_diagonal(&mass), Mat3::from_diagonal(&inertia));
    let mut slopes = [[-cross(w) * mass, cross(&p)], [cross(&p) - cross(v) * mass, cross(&l) - cross(w) * inertia]];

    // Magnus.
    let lift = magnus * rho * volume;
    force += lift * w.cross(v);
    slopes[0][0] += lift * cross(w);
    slopes[0][1] -= lift * cross(v);

    // The area shown, and its gradient.
    let a = Vec3::from_fn(|i, _| (r[(i + 1) % 3] * r[(i + 2) % 3]).powi(2));
    let n = a.component_mul(v);
    let (num, den) = (n.dot(v), n.norm_squared());
    let area = PI * (den / num.max(MIN_VAL)).sqrt();
    let moving = num > MIN_VAL && speed > MIN_VAL;
    let (num_rate, den_rate) = (2.0 * n, 2.0 * a.component_mul(&n));
    let area_rate = if moving { 0.5 * area * (den_rate / den - num_rate / num) } else { Vec3::zeros() };

    // Kutta: (n × v) × v = v (n·v) − n (v·v).
    let share = num / (speed * den).max(MIN_VAL);
    let size = kutta * rho * area * share;
    let direction = v * num - n * speed * speed;
    force += size * direction;
    if moving {
        let size_rate = size * (area_rate / area + num_rate / num - v / (speed * speed) - den_rate / den);
        let turn = Mat3::from_diagonal(&Vec3::repeat(num)) + v * num_rate.transpose()
            - Mat3::from_diagonal(&(a * speed * speed))
            - 2.0 * n * v.transpose();
        slopes[0][0] += direction * size_rate.transpose() + size * turn;
    }

    // Drag.
    let shown = blunt * area + slender * (PI * most * middle - area);
    let linear = 6.0 * PI * viscosity * mean + rho * speed * shown;
    force -= linear * v;
    slopes[0][0] -= Mat3::from_diagonal(&Vec3::repeat(linear));
    if moving {
        slopes[0][0] -= v * (rho * (shown / speed * v + speed * (blunt - slender) * area_rate)).transpose();
    }
    let largest = 8.0 / 15.0 * PI * middle * most.powi(4);
    let resist = Vec3::from_fn(|i, _| {
        let own = 8.0 / 15.0 * PI * r[i] * r[(i + 1) % 3].max(r[(i + 2) % 3]).powi(4);
        angular * own + slender * (largest - own)
    });
    let against = resist.component_mul(w);
    let turning = 8.0 * PI * viscosity * mean.powi(3) + rho * against.norm();
    torque -= turning * w;
    slopes[1][1] -= Mat3::from_diagonal(&Vec3::repeat(turning));
    if against.norm() > MIN_VAL {
        slopes[1][1] -= w * (resist.component_mul(&against) * (rho / against.norm())).transpose();
    }
    Drag { force, torque, slopes }
}
