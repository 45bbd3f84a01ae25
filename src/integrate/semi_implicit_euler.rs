use super::{Integrator, add_scaled, displace};
use crate::data::Data;
use crate::dynamics::inertia;
use crate::forward::{Method, forward};
use crate::model::Model;
use crate::state::State;

pub const METHOD: Integrator = Integrator {
    name: "semi-implicit-euler",
    mjcf: &["Euler"],
    order: 1,
    about: "new velocity moves, old force accelerates; joint damping implicit",
    implicit: false,
    advance,
};

/// Semi-implicit Euler, joint damping D implicit.
///
///     (M + h D) dv = h (qfrc_smooth + qfrc_constraint),   v ← v + dv,   q ← q ⊕ h v
///
/// Without damping, or with the flag `eulerdamp` off, dv = h qacc.
/// Source: MuJoCo 4.0 manual, Computation › Numerical integration.
fn advance(model: &Model, method: &Method, state: &mut State, data: &mut Data) {
    let h = method.timestep;
    forward(model, method, state, data);
    state.remember(data);
    for (t, tree) in model.trees.iter().enumerate() {
        let dofs = tree.dofs.clone();
        let damped = data.plan.damped[t] && model.opt.flags.eulerdamp;
        if damped {
            damp(model, t, h, data);
        }
        let acc = if damped { &data.stages.acc[dofs.clone()] } else { &data.qacc[dofs.clone()] };
        add_scaled(&mut state.qvel[dofs], h, acc);
    }
    displace(model, &mut state.qpos, &state.qvel, h);
    state.time += h;
}

/// (M + h D)⁻¹ (qfrc_smooth + qfrc_constraint) of one tree, D the joint damping.
///
/// Writes: acc and qh of the stages, in the places of the tree.
fn damp(model: &Model, t: usize, h: f64, data: &mut Data) {
    let dofs = model.trees[t].dofs.clone();
    let (n, adr) = (dofs.len(), data.m_adr[t]);
    let Data { qm, plan, stages, qfrc_smooth, qfrc_constraint, .. } = data;
    let qh = &mut stages.qh[adr..adr + n * n];
    qh.copy_from_slice(&qm[adr..adr + n * n]);
    let acc = &mut stages.acc[dofs.clone()];
    for (i, d) in dofs.clone().enumerate() {
        qh[i * (n + 1)] += h * model.dofs[d].damping;
        acc[i] = qfrc_smooth[d] + qfrc_constraint[d];
    }
    inertia::factor(qh, n, dofs.start, &plan.dof_parent);
    inertia::solve(qh, n, dofs.start, &plan.dof_parent, acc);
}
