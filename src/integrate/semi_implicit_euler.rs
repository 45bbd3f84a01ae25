//! Semi-implicit Euler, MuJoCo's `Euler`: v ← v + h a, then q ← q ⊕ h v; dampers of joints implicit.

use super::{DampedSpring, Integrator, Matrix2, add_scaled, displace};
use crate::data::Data;
use crate::dynamics::actuation;
use crate::forward::{Method, begin};
use crate::model::Model;
use crate::state::State;

/// The record.
pub const METHOD: Integrator = Integrator {
    name: "semi-implicit-euler",
    mjcf: &["Euler"],
    order: 1,
    about: "velocity by the old force, then position by the new velocity; joint damping implicit",
    implicit: false,
    implicit_dampers: super::Dampers::Joints,
    advance,
    amplification: Some(amplification),
    estimate: None,
};

/// Joint dampers implicit, those of contacts explicit.
///
///     v′ = (v − hω²x − e) / (1 + i),   x′ = x + h v′,   with e = 2ζωh v or i = 2ζωh
pub fn amplification(spring: &DampedSpring, h: f64) -> Matrix2 {
    let damping = h * spring.damping();
    let (explicit, implicit) = if spring.joint { (0.0, damping) } else { (damping, 0.0) };
    let v = [-h * spring.stiffness() / (1.0 + implicit), (1.0 - explicit) / (1.0 + implicit)];
    [[1.0 + h * v[0], h * v[1]], v]
}

/// Semi-implicit Euler, joint damping D implicit.
///
///     (M + h D) dv = h (qfrc_smooth + qfrc_constraint),   v ← v + dv,   q ← q ⊕ h v
///
/// Without damping, or with the flag `eulerdamp` off, dv = h qacc.
/// Source: MuJoCo 4.0 manual, Computation › Numerical integration.
fn advance(model: &Model, method: &Method, state: &mut State, data: &mut Data) {
    let h = method.timestep;
    begin(model, method, state, data);
    if data.plan.eulerdamp {
        damped_acceleration(model, h, data);
        add_scaled(&mut state.qvel, h, &data.stages.acc);
    } else {
        add_scaled(&mut state.qvel, h, &data.qacc);
    }
    displace(model, &mut state.qpos, &state.qvel, h);
    actuation::advance(model, &data.act_dot, h, &mut state.act);
    state.time += h;
}

/// qacc of trees without dampers, (M + h D)⁻¹ (qfrc_smooth + qfrc_constraint) of the others.
///
/// Writes: acc and qh of the stages.
fn damped_acceleration(model: &Model, h: f64, data: &mut Data) {
    let Data { qm_rows, plan, stages, qacc, qfrc_smooth, qfrc_constraint, .. } = data;
    stages.acc.copy_from_slice(qacc);
    for (tree, _) in model.trees.iter().zip(&plan.damped).filter(|(_, damped)| **damped) {
        let (pattern, block) = (&plan.pattern, plan.pattern.block(&tree.dofs));
        let (qh, acc) = (&mut stages.qh, &mut stages.acc[tree.dofs.clone()]);
        qh[block.clone()].copy_from_slice(&qm_rows[block]);
        for (i, row) in pattern.rows(&tree.dofs).iter().enumerate() {
            let d = tree.dofs.start + i;
            qh[row.diagonal()] += h * model.dofs[d].damping;
            acc[i] = qfrc_smooth[d] + qfrc_constraint[d];
        }
        pattern.factor(&tree.dofs, qh, acc);
        pattern.substitute(&tree.dofs, qh, acc);
    }
}
