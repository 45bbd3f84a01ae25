//! Equalities, and limits and dry friction of tendons: constraints whose rows of J reach over whole trees.
//!
//!     joint      r = y − y₀ − p(x − x₀)                       J = e_y − p' e_x,   p(x) = a₀ + a₁ x + … + a₄ x⁴
//!     tendon     the same with lengths                        J = J_y − p' J_x
//!     connect    r = p₁ − p₂                                  J = J_p₁ − J_p₂             three rows
//!     weld       the same, and t · vec(q₂⁻¹ q₁)               its rate, t torquescale     three more
//!     limit      r = L − lower − margin,  upper − L − margin  J = ±J_L
//!     friction   r = 0                                        J = J_L
//!
//! Under every law that has them an equality is a spring and a damper of its `solref` and `solimp`, which push and pull:
//! f = (a_ref − J a)/R with a_ref = −B v − K d r, as a joint's limit that has two sides. d belongs to the norm of r; of
//! `connect` and `weld` a_ref also has −J̇ q̇, so that J a − a_ref is r̈ + B ṙ + K d r itself.
//!
//! Source: MuJoCo 4.0 manual, Computation › Constraint model › Equality; checked by running MuJoCo 4.0.0.

use super::Settings;
use super::impedance::{self, Reference};
use crate::data::{Data, Tie, TieKind};
use crate::dynamics;
use crate::dynamics::blocks::Block;
use crate::dynamics::carried::carried;
use crate::dynamics::plan::rows_of;
use crate::dynamics::spatial::{ang, lin};
use crate::dynamics::tendon;
use crate::math::{Quat, Vec3};
use crate::model::{Anchor, Equality, EqualityKind, Model, Path};
use crate::state::State;

type Quaternion = nalgebra::Quaternion<f64>;

/// Finds equalities that hold, then dry friction, then limits of tendons, in MuJoCo's order; none whose rows are zero or rounding,
/// such as a limit of a tendon within one body, or to a point of a hinge's axis: no force of it would move anything, and what is
/// needed against the rounding of 1e-17 m would be beyond all numbers. (MuJoCo leaves out exact zeros.)
///
/// Reads: poses, cdof, tendons. Writes: ties (all but the forces), eq_j.
pub fn find(model: &Model, settings: &Settings, state: &State, data: &mut Data) {
    data.ties.clear();
    if data.plan.equality {
        for (i, equality) in model.equalities.iter().enumerate() {
            if state.eq_active[i] && !data.plan.equalities[i].is_empty() {
                let tie = equal(model, settings, state, data, i, equality);
                data.ties.push(tie);
            }
        }
    }
    let Data { plan, ties, ten_length, .. } = data;
    for &i in plan.dry_tendons.iter().filter(|i| !plan.tendons[**i].is_empty()) {
        ties.push(along(model, settings, i, TieKind::DryFriction, 0.0));
    }
    for &i in plan.limited_tendons.iter().filter(|i| !plan.tendons[**i].is_empty()) {
        let tendon = &model.tendons[i];
        let Some([low, high]) = tendon.range else { continue };
        let ends = [(TieKind::LowerLimit, ten_length[i] - low), (TieKind::UpperLimit, high - ten_length[i])];
        for (kind, dist) in ends.into_iter().filter(|(_, dist)| *dist < tendon.margin) {
            ties.push(along(model, settings, i, kind, dist - tendon.margin));
        }
    }
    let mut found = std::mem::take(&mut data.ties);
    found.retain(|tie| {
        let (blocks, numbers) = rows(data, tie);
        let all = blocks.iter().flat_map(|b| &numbers[b.at..][..tie.dim * b.dofs.len()]);
        let most = all.fold(0.0f64, |most, x| most.max(x.abs()));
        // Where nothing is small no rounding is looked for.
        most > 1e-6 || most > rounding(model, data, tie)
    });
    data.ties = found;
}

/// What rounding may leave in the rows of a tie that moves nothing, m: of a spatial tendon, a `connect` or a `weld` 1e-13 of where it
/// is, at least of 1 m.
fn rounding(model: &Model, data: &Data, tie: &Tie) -> f64 {
    let of_tendon = |t: usize| match &model.tendons[t].path {
        Path::Fixed(_) => 0.0,
        Path::Spatial(points) => {
            let mut far = 1.0f64;
            tendon::each_segment(model, data, points, |s| {
                s.points.iter().for_each(|p| far = far.max(p.amax()));
            });
            1e-13 * far
        }
    };
    let equality = (tie.kind == TieKind::Equality).then(|| &model.equalities[tie.index].kind);
    match equality {
        None => of_tendon(tie.index),
        Some(EqualityKind::Joint { .. }) => 0.0,
        Some(EqualityKind::Tendon { tendons: (first, second), .. }) => {
            of_tendon(*first).max(second.map_or(0.0, of_tendon))
        }
        Some(EqualityKind::Connect(anchors) | EqualityKind::Weld { anchors, .. }) => {
            1e-13 * anchors.iter().map(|a| place(model, data, a).1.amax()).fold(1.0, f64::max)
        }
    }
}

/// The rows of J of a tie: its blocks, and the numbers that these point into. Each block holds one row after the other.
pub fn rows<'a>(data: &'a Data, tie: &Tie) -> (&'a [Block], &'a [f64]) {
    match tie.kind {
        TieKind::Equality => (&data.plan.equalities[tie.index], &data.eq_j),
        _ => (&data.plan.tendons[tie.index], &data.ten_j),
    }
}

/// A row along a tendon: a limit or dry friction.
fn along(model: &Model, settings: &Settings, index: usize, kind: TieKind, violation: f64) -> Tie {
    let tendon = &model.tendons[index];
    let dry = kind == TieKind::DryFriction;
    let (solref, solimp) = match dry {
        true => (&tendon.solref_friction, &tendon.solimp_friction),
        false => (&tendon.solref_limit, &tendon.solimp_limit),
    };
    let solimp = impedance::clamp(solimp);
    Tie {
        kind,
        index,
        dim: 1,
        sign: if kind == TieKind::UpperLimit { -1.0 } else { 1.0 },
        violation: [violation, 0.0, 0.0, 0.0, 0.0, 0.0],
        drift: [0.0; 6],
        impedance: impedance::impedance(&solimp, violation),
        reference: Reference::new(solref, &solimp, settings.timestep, model.opt.flags.refsafe),
        inverse: [tendon.invweight0, 0.0],
        loss: if dry { tendon.frictionloss } else { 0.0 },
        force: [0.0; 6],
    }
}

/// An equality. Writes: its rows of eq_j.
fn equal(model: &Model, settings: &Settings, state: &State, data: &mut Data, index: usize, equality: &Equality) -> Tie {
    let mut numbers = std::mem::take(&mut data.eq_j);
    let blocks = &data.plan.equalities[index];
    for block in blocks {
        numbers[block.at..block.at + rows_of(&equality.kind) * block.dofs.len()].fill(0.0);
    }
    let (mut violation, mut drift) = ([0.0; 6], [0.0; 6]);
    let inverse = match &equality.kind {
        EqualityKind::Joint { joints: (first, second), polycoef } => {
            let joint = |j: usize| &model.joints[j];
            let moved = |j: usize| state.qpos[joint(j).qposadr] - model.qpos0[joint(j).qposadr];
            let (slope, value) = polynomial(polycoef, second.map(moved));
            violation[0] = moved(*first) - value;
            add(blocks, &mut numbers, joint(*first).dofadr, 0, 1.0);
            let mut inverse = model.dofs[joint(*first).dofadr].invweight0;
            if let Some(second) = *second {
                add(blocks, &mut numbers, joint(second).dofadr, 0, -slope);
                inverse += model.dofs[joint(second).dofadr].invweight0;
            }
            [inverse, 0.0]
        }
        EqualityKind::Tendon { tendons: (first, second), polycoef } => {
            let stretch = |t: usize| data.ten_length[t] - model.tendons[t].length0;
            let (slope, value) = polynomial(polycoef, second.map(stretch));
            violation[0] = stretch(*first) - value;
            let mut inverse = 0.0;
            for (t, scale) in [Some((*first, 1.0)), second.map(|t| (t, -slope))].into_iter().flatten() {
                for of in &data.plan.tendons[t] {
                    for d in of.dofs.clone() {
                        let j = data.ten_j[of.at + d - of.dofs.start];
                        add(blocks, &mut numbers, d, 0, scale * j);
                    }
                }
                inverse += model.tendons[t].invweight0;
            }
            [inverse, 0.0]
        }
        EqualityKind::Connect(anchors) => {
            (violation, drift) = hold(model, data, &state.qvel, anchors, 0.0, &mut numbers, blocks);
            inverse_of(model, anchors)
        }
        EqualityKind::Weld { anchors, torquescale, .. } => {
            (violation, drift) = hold(model, data, &state.qvel, anchors, *torquescale, &mut numbers, blocks);
            inverse_of(model, anchors)
        }
    };
    data.eq_j = numbers;
    let solimp = impedance::clamp(&equality.solimp);
    let size = violation.iter().map(|r| r * r).sum::<f64>().sqrt();
    Tie {
        kind: TieKind::Equality,
        index,
        dim: rows_of(&equality.kind),
        sign: 1.0,
        violation,
        drift,
        impedance: impedance::impedance(&solimp, size),
        reference: Reference::new(&equality.solref, &solimp, settings.timestep, model.opt.flags.refsafe),
        inverse,
        loss: 0.0,
        force: [0.0; 6],
    }
}

/// p'(x) and p(x); without x they are those of a constant.
fn polynomial(a: &[f64; 5], x: Option<f64>) -> (f64, f64) {
    let Some(x) = x else { return (0.0, a[0]) };
    let (mut slope, mut value) = (0.0, 0.0);
    for a in a.iter().rev() {
        slope = slope * x + value;
        value = value * x + a;
    }
    (slope, value)
}

/// Adds to the number of a dof in a row.
fn add(blocks: &[Block], numbers: &mut [f64], dof: usize, row: usize, x: f64) {
    if let Some(block) = blocks.iter().find(|block| block.dofs.contains(&dof)) {
        numbers[block.at + row * block.dofs.len() + dof - block.dofs.start] += x;
    }
}

/// Sums of what MuJoCo takes for the inverse masses and inertias of the two bodies.
fn inverse_of(model: &Model, anchors: &[Anchor; 2]) -> [f64; 2] {
    let of = anchors.map(|anchor| model.bodies[anchor.place(&model.sites).0].invweight0);
    [of[0][0] + of[1][0], of[0][1] + of[1][1]]
}

/// Where an anchor is: its body, its place, its orientation. World.
pub fn place(model: &Model, data: &Data, anchor: &Anchor) -> (usize, Vec3, Quat) {
    let (body, pos, quat) = anchor.place(&model.sites);
    (body, data.xpos[body] + data.xmat[body] * pos, data.xquat[body] * quat)
}

/// Violation, drift and rows of a `connect` (t = 0), or with a torquescale t of a `weld`, W = ω₁ − ω₂ as a quaternion:
///
///     r = t vec(q₂⁻¹ q₁),   ṙ = ½ t vec(q₂⁻¹ W q₁),   J̇ q̇ = ½ t vec(q₂⁻¹ (Ẇ + ½ W ω₁ − ½ ω₂ W) q₁)
fn hold(
    model: &Model,
    data: &Data,
    qvel: &[f64],
    anchors: &[Anchor; 2],
    torquescale: f64,
    numbers: &mut [f64],
    blocks: &[Block],
) -> ([f64; 6], [f64; 6]) {
    let [(b1, p1, q1), (b2, p2, q2)] = [0, 1].map(|i| place(model, data, &anchors[i]));
    let turned = |x: Quaternion| (*q2.conjugate().quaternion() * x * *q1.quaternion()).imag() * (0.5 * torquescale);
    let six = |a: Vec3, b: Vec3| [a.x, a.y, a.z, b.x, b.y, b.z];
    for (body, point, sign) in [(b1, p1, 1.0), (b2, p2, -1.0)] {
        dynamics::each_column(model, data, body, &point, |d, column| {
            let moved = lin(&column) * sign;
            (0..3).for_each(|k| add(blocks, numbers, d, k, moved[k]));
            if torquescale != 0.0 {
                let moved = turned(Quaternion::from_imag(ang(&column) * sign));
                (0..3).for_each(|k| add(blocks, numbers, d, 3 + k, moved[k]));
            }
        });
    }
    let [first, second] = [(b1, p1), (b2, p2)].map(|(body, point)| carried(model, data, qvel, body, &point));
    let [w1, w2] = [first, second].map(|c| Quaternion::from_imag(c.spin));
    let (w, rate) = (w1 - w2, Quaternion::from_imag(first.turn - second.turn));
    let violation = six(p1 - p2, (q2.conjugate() * q1).imag() * torquescale);
    let drift = six(first.acceleration - second.acceleration, turned(rate + (w * w1 - w2 * w) * 0.5));
    (violation, drift)
}

/// Force (N) and torque (N m) that a `connect` or `weld` exerts on its first anchor's body at that anchor, and the
/// opposite on the second's: with the place of each. World.
///
///     J = ∂r/∂q:   τ = ½ t q₂ f q₁⁻¹ (its vector part)
pub fn wrench(model: &Model, data: &Data, tie: &Tie) -> Option<[(usize, Vec3, Vec3, Vec3); 2]> {
    let (anchors, torquescale) = match &model.equalities[tie.index].kind {
        EqualityKind::Connect(anchors) => (anchors, 0.0),
        EqualityKind::Weld { anchors, torquescale, .. } => (anchors, *torquescale),
        _ => return None,
    };
    let [(b1, p1, q1), (b2, p2, q2)] = [0, 1].map(|i| place(model, data, &anchors[i]));
    let force = Vec3::from_column_slice(&tie.force[..3]);
    let turning = Quaternion::from_imag(Vec3::from_column_slice(&tie.force[3..]) * (0.5 * torquescale));
    let torque = (*q2.quaternion() * turning * *q1.conjugate().quaternion()).imag();
    Some([(b1, p1, force, torque), (b2, p2, -force, -torque)])
}

/// Tendons along which a tie pulls: index, and force that lengthens, N.
pub fn pulls(model: &Model, data: &Data, tie: &Tie) -> [Option<(usize, f64)>; 2] {
    let f = tie.force[0];
    if tie.kind != TieKind::Equality {
        return [Some((tie.index, tie.sign * f)), None];
    }
    let EqualityKind::Tendon { tendons: (first, second), polycoef } = &model.equalities[tie.index].kind else {
        return [None; 2];
    };
    let (slope, _) = polynomial(polycoef, second.map(|t| data.ten_length[t] - model.tendons[t].length0));
    [Some((*first, f)), second.map(|t| (t, -slope * f))]
}

/// J v of a tie's rows.
pub fn velocity(data: &Data, tie: &Tie, v: &[f64]) -> [f64; 6] {
    let (blocks, numbers) = rows(data, tie);
    if tie.dim == 1 {
        return [tie.sign * tendon::product(blocks, numbers, v), 0.0, 0.0, 0.0, 0.0, 0.0];
    }
    let mut out = [0.0; 6];
    for block in blocks {
        let n = block.dofs.len();
        for (out, row) in out.iter_mut().zip(numbers[block.at..].chunks_exact(n)).take(tie.dim) {
            *out += row.iter().zip(&v[block.dofs.clone()]).map(|(j, v)| j * v).sum::<f64>();
        }
    }
    out
}
