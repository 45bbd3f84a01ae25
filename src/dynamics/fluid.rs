//! Forces of a medium on bodies: each as a box of the same mass and inertia, or geom by geom as [`ellipsoid`]s.
//!
//! Source: MuJoCo 4.0 manual, Computation › Passive forces › Fluid forces.

use std::f64::consts::PI;

use super::ellipsoid::{self, Drag};
use super::spatial::{ang, join, lin};
use crate::data::Data;
use crate::math::{MIN_VAL, Mat3, Vec3, Vec6, mat};
use crate::model::{Body, Fluid, Geom, GeomKind, Model};

/// Drag of the medium.
///
/// Reads: poses, cdof, qvel. Writes: qfrc_fluid (nv). Adds it to: qfrc_passive.
pub fn drag(model: &Model, qvel: &[f64], data: &mut Data) {
    let mut forces = std::mem::take(&mut data.qfrc_fluid);
    forces.fill(0.0);
    for &b in &data.plan.fluid {
        each_shape(model, data, qvel, b, |point, axes, drag| {
            let wrench = join(&(axes * drag.force), &(axes * drag.torque));
            super::each_column(model, data, b, point, |d, column| forces[d] += column.dot(&wrench));
        });
    }
    for (passive, f) in data.qfrc_passive.iter_mut().zip(&forces) {
        *passive += f;
    }
    data.qfrc_fluid = forces;
}

/// Hands on how the forces of the medium on a tree's dofs change with its velocities: dof, other dof, ∂force/∂velocity.
///
///     ∂qfrc/∂q̇ = Σ Jᵀ B J,   B derivative of the drag by the velocity, or its symmetric part
///
/// Source: MuJoCo 4.0 manual, Computation › Numerical integration; `implicitfast` takes the symmetric part, but for a lone
/// body on a free joint.
pub fn slopes(
    model: &Model,
    t: usize,
    qvel: &[f64],
    data: &Data,
    symmetric: bool,
    mut take: impl FnMut(usize, usize, f64),
) {
    for &b in data.plan.fluid.iter().filter(|b| model.trees[t].bodies.contains(b)) {
        each_shape(model, data, qvel, b, |point, axes, drag| {
            let [[vv, vw], [wv, ww]] = drag.slopes;
            let half = |a: Mat3, b: Mat3| if symmetric { 0.5 * (a + b.transpose()) } else { a };
            let (vv, vw, wv, ww) = (half(vv, vv), half(vw, wv), half(wv, vw), half(ww, ww));
            let local = |c: &Vec6| (axes.tr_mul(&lin(c)), axes.tr_mul(&ang(c)));
            super::each_column(model, data, b, point, |e, c| {
                let (v, w) = local(&c);
                let (force, torque) = (vv * v + vw * w, wv * v + ww * w);
                super::each_column(model, data, b, point, |d, c| {
                    let (v, w) = local(&c);
                    take(d, e, force.dot(&v) + torque.dot(&w));
                });
            });
        });
    }
}

/// Hands on the shapes as which a body feels the medium: a point and axes, and the drag in these axes.
fn each_shape(model: &Model, data: &Data, qvel: &[f64], b: usize, mut take: impl FnMut(&Vec3, &Mat3, &Drag)) {
    let body = &model.bodies[b];
    let opt = &model.opt;
    let moving = |point: &Vec3, axes: &Mat3| {
        let mut twist = Vec6::zeros();
        super::each_column(model, data, b, point, |d, column| twist += column * qvel[d]);
        (axes.tr_mul(&(lin(&twist) - opt.wind)), axes.tr_mul(&ang(&twist)))
    };
    let mut shaped = false;
    for geom in &model.geoms[body.geoms.clone()] {
        let Some(fluid) = &geom.fluid else { continue };
        shaped = true;
        let (point, axes) = (data.xpos[b] + data.xmat[b] * geom.pos, data.xmat[b] * mat(&geom.quat));
        let (v, w) = moving(&point, &axes);
        take(&point, &axes, &ellipsoid::drag(fluid, &semiaxes(geom), opt.density, opt.viscosity, &v, &w));
    }
    if !shaped {
        let (point, axes) = (super::xipos(model, data, b), data.xmat[b] * mat(&body.iquat));
        let (v, w) = moving(&point, &axes);
        take(&point, &axes, &on_box(&widths(body), opt.density, opt.viscosity, &v, &w));
    }
}

/// Semi-axes (m) of the ellipsoid as which a geom feels the medium.
pub fn semiaxes(geom: &Geom) -> Vec3 {
    let size = geom.size;
    match geom.kind {
        GeomKind::Sphere => Vec3::repeat(size.x),
        GeomKind::Capsule => Vec3::new(size.x, size.x, size.y + size.x),
        GeomKind::Cylinder => Vec3::new(size.x, size.x, size.y),
        GeomKind::Box | GeomKind::Ellipsoid | GeomKind::Plane => size,
    }
}

/// The coefficients of an ellipsoid with its virtual mass and inertia over the density of the medium.
///
///     κᵢ = ∫ rᵢ rⱼ rₖ / √((rᵢ² + λ)³ (rⱼ² + λ) (rₖ² + λ)) dλ,   m_i = V κᵢ/(2 − κᵢ)
///     I_i = V/5 (rⱼ² − rₖ²)² (κₖ − κⱼ) / (2 (rⱼ² − rₖ²) + (rⱼ² + rₖ²)(κⱼ − κₖ))
///
/// Source: MuJoCo 4.0 manual, Computation › Fluid forces › Added mass (Tuckerman 1925).
pub fn virtual_inertia(coef: [f64; 5], r: &Vec3) -> Fluid {
    let volume = 4.0 / 3.0 * PI * r.product();
    let of = |i: usize| [i, (i + 1) % 3, (i + 2) % 3];
    let kappa = Vec3::from_fn(|i, _| added_mass(of(i).map(|k| r[k])));
    let virtual_mass = kappa.map(|k| volume * k / (2.0 - k).max(MIN_VAL));
    let virtual_inertia = Vec3::from_fn(|i, _| {
        let [_, j, k] = of(i);
        let (less, sum) = (r[j] * r[j] - r[k] * r[k], r[j] * r[j] + r[k] * r[k]);
        let below = 2.0 * less + sum * (kappa[j] - kappa[k]);
        if below.abs() < MIN_VAL { 0.0 } else { volume / 5.0 * less * less * (kappa[k] - kappa[j]) / below }
    });
    Fluid { coef, virtual_mass, virtual_inertia }
}

/// κ of the first axis, by the 15 points of Kronrod in x with λ = (r₁³ r₂ r₃)^(2/5) x³/(1 − x)²; points and weights have
/// MuJoCo's eight digits, and so has the integral.
fn added_mass([x, y, z]: [f64; 3]) -> f64 {
    const POINTS: [f64; 8] = [0.00427231, 0.02544604, 0.06756779, 0.12923441, 0.20695638, 0.29707742, 0.39610752, 0.5];
    const WEIGHTS: [f64; 8] =
        [0.01146766, 0.03154605, 0.05239501, 0.07032663, 0.08450236, 0.09517529, 0.10221647, 0.10474107];
    let scale = (x * x * x * y * z).powf(0.4);
    let at = |p: f64| {
        let rest = 1.0 - p;
        let lambda = scale * p.powi(3) / rest.powi(2);
        let rate = scale * (3.0 * p * p * rest * rest + 2.0 * p.powi(3) * rest) / rest.powi(4);
        let [a, b, c] = [x, y, z].map(|r| 1.0 + lambda / (r * r));
        rate / (a * (a * b * c).sqrt())
    };
    let both = |(p, w): (&f64, &f64)| if *p == 0.5 { w * at(*p) } else { w * (at(*p) + at(1.0 - p)) };
    POINTS.iter().zip(&WEIGHTS).map(both).sum::<f64>() / (x * x)
}

/// Full widths (m) of the box that has a body's mass and inertia.
fn widths(body: &Body) -> Vec3 {
    let sum = body.inertia.sum();
    body.inertia.map(|i| ((sum - 2.0 * i).max(MIN_VAL) / body.mass * 6.0).sqrt())
}

/// Drag of a box, v and ω in the axes of the body's inertial frame:
///
///     b_x = √(6 (I_y + I_z − I_x)/m)                        full widths of the box
///     f = −3 π β d v − ½ ρ b_y b_z |v_x| v_x                β viscosity, d mean of the widths, ρ density
///     τ = −π β d³ ω − ρ b_x (b_y⁴ + b_z⁴) |ω_x| ω_x / 64    and so on for y and z
fn on_box(b: &Vec3, density: f64, viscosity: f64, v: &Vec3, w: &Vec3) -> Drag {
    let mean = b.sum() / 3.0;
    let (push, turn) = (3.0 * PI * mean * viscosity, PI * mean.powi(3) * viscosity);
    let (mut force, mut torque) = (-push * v, -turn * w);
    let (mut by_v, mut by_w) = (Vec3::repeat(-push), Vec3::repeat(-turn));
    for i in 0..3 {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let (area, moment) = (density * b[j] * b[k], density * b[i] * (b[j].powi(4) + b[k].powi(4)));
        force[i] -= 0.5 * area * v[i].abs() * v[i];
        torque[i] -= moment * w[i].abs() * w[i] / 64.0;
        by_v[i] -= area * v[i].abs();
        by_w[i] -= moment * w[i].abs() / 32.0;
    }
    let none = Mat3::zeros();
    Drag { force, torque, slopes: [[Mat3::from_diagonal(&by_v), none], [none, Mat3::from_diagonal(&by_w)]] }
}
