//! Forces of a medium on bodies: each as a box of the same mass and inertia.
//!
//! Source: MuJoCo 4.0 manual, Computation › Passive forces › Fluid forces › Inertia model.

use std::f64::consts::PI;

use super::spatial::{ang, join, lin};
use crate::data::Data;
use crate::math::{MIN_VAL, Vec3, Vec6, mat};
use crate::model::{Body, Model};

/// Drag of the medium, in the axes of a body's inertial frame, v and ω those of the body less the wind:
///
///     b_x = √(6 (I_y + I_z − I_x)/m)                        full widths of the box
///     f = −3 π β d v − ½ ρ b_y b_z |v_x| v_x                β viscosity, d mean of the widths, ρ density
///     τ = −π β d³ ω − ρ b_x (b_y⁴ + b_z⁴) |ω_x| ω_x / 64    and so on for y and z
///
/// Reads: poses, cdof, qvel. Writes: qfrc_fluid (nv). Adds it to: qfrc_passive.
pub fn drag(model: &Model, qvel: &[f64], data: &mut Data) {
    let mut forces = std::mem::take(&mut data.qfrc_fluid);
    forces.fill(0.0);
    for &b in &data.plan.fluid {
        let body = &model.bodies[b];
        let com = super::xipos(model, data, b);
        let mut twist = Vec6::zeros();
        super::each_column(model, data, b, &com, |d, column| twist += column * qvel[d]);
        let axes = data.xmat[b] * mat(&body.iquat);
        let (v, w) = (axes.tr_mul(&(lin(&twist) - model.opt.wind)), axes.tr_mul(&ang(&twist)));
        let (force, torque) = on_box(&widths(body), model.opt.density, model.opt.viscosity, &v, &w);
        let wrench = join(&(axes * force), &(axes * torque));
        super::each_column(model, data, b, &com, |d, column| forces[d] += column.dot(&wrench));
    }
    for (passive, f) in data.qfrc_passive.iter_mut().zip(&forces) {
        *passive += f;
    }
    data.qfrc_fluid = forces;
}

/// Full widths (m) of the box that has a body's mass and inertia.
fn widths(body: &Body) -> Vec3 {
    let sum = body.inertia.sum();
    body.inertia.map(|i| ((sum - 2.0 * i).max(MIN_VAL) / body.mass * 6.0).sqrt())
}

fn on_box(b: &Vec3, density: f64, viscosity: f64, v: &Vec3, w: &Vec3) -> (Vec3, Vec3) {
    let mean = b.sum() / 3.0;
    let mut force = -3.0 * PI * mean * viscosity * v;
    let mut torque = -PI * mean.powi(3) * viscosity * w;
    for i in 0..3 {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        force[i] -= 0.5 * density * b[j] * b[k] * v[i].abs() * v[i];
        torque[i] -= density * b[i] * (b[j].powi(4) + b[k].powi(4)) * w[i].abs() * w[i] / 64.0;
    }
    (force, torque)
}
