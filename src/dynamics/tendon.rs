//! Tendons: lengths that depend on the position, their moment arms, and the forces along them.
//!
//!     fixed     L = Σ coef q                                 J = coef
//!     spatial   L = Σ |p' − p| / divisor over its segments,  J = Σ uᵀ (J_p' − J_p) / divisor
//!
//! with u the direction of a segment from p to p'. On a geom that it winds round the way has no moment arm: both ends of the
//! arc move with the geom, and the way is shortest. J q̇ is the rate of the length, Jᵀ f what a pull f does.
//!
//! A row of J is kept in blocks, one for each tree that the tendon touches ([`Block`]).
//!
//! Source: MuJoCo 4.0 manual, Computation › Passive forces; XML reference › tendon; checked by running MuJoCo 4.0.0.

use super::blocks::Block;
use super::carried::carried;
use super::spatial::lin;
use super::wrap::{Shape, wrap};
use crate::data::Data;
use crate::math::{Vec3, mat};
use crate::model::{Model, Path, Tendon, Waypoint};

/// Lengths, velocities and rows of J of all tendons.
///
/// Reads: qpos, qvel, poses, cdof. Writes: ten_length, ten_velocity, ten_j.
pub fn tendons(model: &Model, qpos: &[f64], qvel: &[f64], data: &mut Data) {
    let mut rows = std::mem::take(&mut data.ten_j);
    rows.fill(0.0);
    for (i, tendon) in model.tendons.iter().enumerate() {
        data.ten_length[i] = match &tendon.path {
            Path::Fixed(parts) => {
                for &(j, coef) in parts {
                    add(&data.plan.tendons[i], &mut rows, model.joints[j].dofadr, coef);
                }
                parts.iter().map(|&(j, coef)| coef * qpos[model.joints[j].qposadr]).sum()
            }
            Path::Spatial(points) => {
                let mut length = 0.0;
                each_segment(model, data, points, |s| {
                    length += s.length / s.divisor;
                    if let Some(u) = s.direction() {
                        for (end, sign) in [(0, -1.0), (1, 1.0)] {
                            let scale = sign / s.divisor;
                            super::each_column(model, data, s.bodies[end], &s.points[end], |d, column| {
                                add(&data.plan.tendons[i], &mut rows, d, scale * lin(&column).dot(&u));
                            });
                        }
                    }
                });
                length
            }
        };
        data.ten_velocity[i] = product(&data.plan.tendons[i], &rows, qvel);
    }
    data.ten_j = rows;
}

/// Adds to the number of a dof.
fn add(blocks: &[Block], rows: &mut [f64], dof: usize, x: f64) {
    if let Some(block) = blocks.iter().find(|block| block.dofs.contains(&dof)) {
        rows[block.at + dof - block.dofs.start] += x;
    }
}

/// A row times a vector over all dofs.
pub fn product(blocks: &[Block], rows: &[f64], v: &[f64]) -> f64 {
    let of = |block: &Block| {
        let row = &rows[block.at..block.at + block.dofs.len()];
        row.iter().zip(&v[block.dofs.clone()]).map(|(j, v)| j * v).sum::<f64>()
    };
    blocks.iter().map(of).sum()
}

/// out += f Jᵀ, over all dofs.
pub fn push(blocks: &[Block], rows: &[f64], f: f64, out: &mut [f64]) {
    for block in blocks {
        let row = &rows[block.at..block.at + block.dofs.len()];
        out[block.dofs.clone()].iter_mut().zip(row).for_each(|(out, j)| *out += f * j);
    }
}

/// A straight part of a spatial tendon, or an arc on a geom, whose ends belong to one body.
#[derive(Clone, Copy, Debug)]
pub struct Segment {
    /// The bodies that its ends move with.
    pub bodies: [usize; 2],
    /// Its ends, world, m.
    pub points: [Vec3; 2],
    /// m
    pub length: f64,
    /// That of its branch.
    pub divisor: f64,
}

impl Segment {
    /// From the first end to the second, where they do not move together.
    pub fn direction(&self) -> Option<Vec3> {
        let along = self.points[1] - self.points[0];
        let length = along.norm();
        // As in MuJoCo, a segment without length points along x.
        let unit = if length < crate::math::MIN_VAL { Vec3::x() } else { along / length };
        (self.bodies[0] != self.bodies[1]).then_some(unit)
    }
}

/// Hands out the segments of a spatial tendon one after the other. Reads: poses.
pub fn each_segment(model: &Model, data: &Data, points: &[Waypoint], mut take: impl FnMut(Segment)) {
    let place = |s: usize| {
        let site = &model.sites[s];
        (site.body, data.xpos[site.body] + data.xmat[site.body] * site.pos)
    };
    let (mut divisor, mut last, mut obstacle) = (1.0, None, None);
    for &point in points {
        match point {
            Waypoint::Pulley(by) => (divisor, last) = (by, None),
            Waypoint::Geom { geom, side } => obstacle = Some((geom, side)),
            Waypoint::Site(s) => {
                let here = place(s);
                if let Some((body, start)) = last {
                    let touch = obstacle.and_then(|(g, side)| {
                        let side = side.map(|s: usize| place(s).1);
                        wrap(&shape(model, data, g), [start, here.1], side).map(|touch| (model.geoms[g].body, touch))
                    });
                    let mut part = |bodies, points: [Vec3; 2], length: Option<f64>| {
                        let length = length.unwrap_or_else(|| (points[1] - points[0]).norm());
                        take(Segment { bodies, points, length, divisor });
                    };
                    match touch {
                        None => part([body, here.0], [start, here.1], None),
                        Some((geom, touch)) => {
                            part([body, geom], [start, touch.points[0]], None);
                            part([geom; 2], touch.points, Some(touch.length));
                            part([geom, here.0], [touch.points[1], here.1], None);
                        }
                    }
                }
                (last, obstacle) = (Some(here), None);
            }
        }
    }
}

fn shape(model: &Model, data: &Data, g: usize) -> Shape {
    let geom = &model.geoms[g];
    let axes = data.xmat[geom.body];
    Shape {
        pos: data.xpos[geom.body] + axes * geom.pos,
        axes: axes * mat(&geom.quat),
        radius: geom.size.x,
        cylinder: geom.kind == crate::model::GeomKind::Cylinder,
    }
}

/// The pull of springs and dampers, as a force that lengthens.
///
///     f = −(a x + b x² + c x³) − (a v + b v |v| + c v³)      x stretch beyond `lengthspring`, zero between its two lengths
///
/// Reads: ten_length, ten_velocity.
pub fn passive(model: &Model, data: &Data, i: usize) -> f64 {
    let (tendon, flags) = (&model.tendons[i], &model.opt.flags);
    let (x, v) = (stretch(tendon, data.ten_length[i]), data.ten_velocity[i]);
    let [a, b, c] = if flags.spring { tendon.stiffness } else { [0.0; 3] };
    let [d, e, f] = if flags.damper { tendon.damping } else { [0.0; 3] };
    -x * (a + x * (b + x * c)) - v * (d + e * v.abs() + f * v * v)
}

/// ∂/∂v of a damper's pull, N s/m.
pub fn damping(tendon: &Tendon, v: f64) -> f64 {
    let [a, b, c] = tendon.damping;
    -(a + 2.0 * b * v.abs() + 3.0 * c * v * v)
}

/// How far a spring is stretched beyond where it is slack (m); negative where it is too short.
fn stretch(tendon: &Tendon, length: f64) -> f64 {
    let [low, high] = tendon.lengthspring;
    if length > high {
        length - high
    } else if length < low {
        length - low
    } else {
        0.0
    }
}

/// Energy of a tendon's spring, J.
///
///     U = a x²/2 + b x³/3 + c x⁴/4
pub fn energy(tendon: &Tendon, length: f64) -> f64 {
    let ([a, b, c], x) = (tendon.stiffness, stretch(tendon, length));
    x * x * (a / 2.0 + x * (b / 3.0 + x * c / 4.0))
}

/// Adds the inertia of tendons to M: armature JᵀJ, as far as M has entries. What couples two branches, or two trees, is
/// left out, as in MuJoCo.
///
/// Writes: qm_rows. Comes before M is factored.
pub fn add_inertia(model: &Model, t: usize, data: &mut Data) {
    for k in 0..data.plan.inert_tendons.len() {
        let i = data.plan.inert_tendons[k];
        let armature = model.tendons[i].armature;
        let Data { plan, ten_j, qm_rows, .. } = data;
        let Some(block) = plan.tendons[i].iter().find(|block| block.tree == t) else { continue };
        let n = block.dofs.len();
        let j = &ten_j[block.at..block.at + n];
        for (k, row) in plan.pattern.rows(&block.dofs).iter().enumerate().filter(|(k, _)| j[*k] != 0.0) {
            for (m, entry) in qm_rows[row.entries()].iter_mut().zip(plan.pattern.entries(row)) {
                *m += armature * j[k] * j[entry.column];
            }
        }
    }
}

/// Kinetic energy of tendons' inertia, as far as M has it, J: see [`add_inertia`]. Reads: ten_j.
pub fn kinetic_energy(model: &Model, qvel: &[f64], data: &Data) -> f64 {
    let mut energy = 0.0;
    for &i in &data.plan.inert_tendons {
        for block in &data.plan.tendons[i] {
            let j = &data.ten_j[block.at..block.at + block.dofs.len()];
            let moved = |k: usize| j[k] * qvel[block.dofs.start + k];
            for (k, row) in data.plan.pattern.rows(&block.dofs).iter().enumerate() {
                let way = data.plan.pattern.entries(row).iter().map(|entry| moved(entry.column)).sum::<f64>();
                energy += model.tendons[i].armature * moved(k) * (way - 0.5 * moved(k));
            }
        }
    }
    energy
}

/// Rates J̇ q̇ of the velocities of tendons that have inertia, where q̈ = 0.
///
///     J̇ q̇ = Σ ((|v|² − (u·v)²)/l + u·a) / divisor      v, a: velocity and acceleration of one end less those of the other
///
/// Reads: cdof, qvel, poses. Writes: ten_rate.
pub fn rates(model: &Model, qvel: &[f64], data: &mut Data) {
    for k in 0..data.plan.inert_tendons.len() {
        let i = data.plan.inert_tendons[k];
        let Path::Spatial(points) = &model.tendons[i].path else { continue };
        let mut rate = 0.0;
        each_segment(model, data, points, |s| {
            let Some(u) = s.direction() else { return };
            let [start, end] = [0, 1].map(|end| carried(model, data, qvel, s.bodies[end], &s.points[end]));
            let (v, a) = (end.velocity - start.velocity, end.acceleration - start.acceleration);
            let length = s.length.max(crate::math::MIN_VAL);
            rate += ((v.norm_squared() - u.dot(&v).powi(2)) / length + u.dot(&a)) / s.divisor;
        });
        data.ten_rate[i] = rate;
    }
}

/// Adds the bias force of tendons' inertia, armature Jᵀ (J̇ q̇), to that of a tree.
///
/// Reads: ten_rate, ten_j. Adds to: qfrc_bias.
pub fn add_bias(model: &Model, t: usize, data: &mut Data) {
    let Data { plan, ten_j, ten_rate, qfrc_bias, .. } = data;
    for &i in &plan.inert_tendons {
        let Some(block) = plan.tendons[i].iter().position(|block| block.tree == t) else { continue };
        push(&plan.tendons[i][block..=block], ten_j, model.tendons[i].armature * ten_rate[i], qfrc_bias);
    }
}
