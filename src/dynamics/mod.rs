//! Dynamics without contact: one file a pass.
//!
//! A free body takes the closed forms of [`free`]; every other tree goes through kinematics, inertia matrix
//! (composite rigid bodies), bias forces (recursive Newton–Euler) and one solve, in three numbers a body where it moves
//! in one plane. A tree that only slides, or whose dofs do not feel one another ([`uncoupled`]), has a constant inertia matrix
//! and constant bias forces: they are computed once.

pub(crate) mod actuation;
pub(crate) mod bias;
pub(crate) mod blocks;
pub(crate) mod carried;
mod ellipsoid;
pub mod energy;
pub(crate) mod factor;
pub(crate) mod fluid;
pub(crate) mod free;
pub(crate) mod inertia;
pub(crate) mod kinematics;
pub(crate) mod links;
pub(crate) mod passive;
pub(crate) mod plan;
pub(crate) mod planar;
pub(crate) mod plane;
pub mod spatial;
pub mod tendon;
pub(crate) mod uncoupled;
pub(crate) mod wrap;

use crate::data::Data;
use crate::math::{Vec3, Vec6, mat, quat};
pub use links::joints_of;

use crate::model::Model;
use crate::state::State;

/// Computes what no step has to: poses of what never moves, axes, inertia and bias of trees that only slide.
pub fn prepare(model: &Model, data: &mut Data) {
    prepare_poses(model, data);
    kinematics(model, &model.qpos0, data);
    let (gravity, at_rest) = (gravity(model), vec![0.0; model.nv]);
    for (t, tree) in model.trees.iter().enumerate() {
        let body = tree.bodies.start;
        if let Some(free) = &tree.free {
            data.movers[body].minv = free::prepare(free);
            continue;
        }
        let uncoupled = data.plan.uncoupled[t].is_some();
        if uncoupled || !tree.rotates {
            inertia_matrix(model, t, data);
            bias::bias(model, t, &gravity, &at_rest, data);
        }
        if let Some(uncoupled) = &data.plan.uncoupled[t] {
            let rows = data.plan.pattern.rows(&tree.dofs);
            data.movers[body].minv = uncoupled.prepare(rows.iter().map(|row| data.qm_rows[row.diagonal()]));
        }
    }
    tendon::tendons(model, &model.qpos0, &at_rest, data);
}

/// Poses of what never moves, and axes of trees that only slide.
pub fn prepare_poses(model: &Model, data: &mut Data) {
    for b in (1..model.bodies.len()).filter(|&b| model.bodies[b].tree.is_none()) {
        kinematics::weld(model, b, data);
    }
    let still = plan::touching(model, false);
    kinematics::geoms(&still, &data.xpos, &data.xmat, &mut data.geom_xpos, &mut data.geom_xmat);
    for tree in model.trees.iter().filter(|tree| tree.free.is_none() && !tree.rotates) {
        kinematics::sliding_axes(model, tree, data);
    }
}

/// Where everything that moves is.
///
/// Reads:  qpos. Writes: xpos, xquat, xmat, xanchor, xaxis, geom_xpos, geom_xmat; com and axes of the movers.
pub fn kinematics(model: &Model, qpos: &[f64], data: &mut Data) {
    for (t, tree) in model.trees.iter().enumerate() {
        match &tree.free {
            Some(free) => free::place(model, t, free, qpos, data),
            None => kinematics::articulated(model, t, qpos, data),
        }
    }
    kinematics::geoms(&data.plan.posed, &data.xpos, &data.xmat, &mut data.geom_xpos, &mut data.geom_xmat);
}

/// Forces and acceleration without contact.
///
///     M qacc_smooth = qfrc_smooth = qfrc_passive + qfrc_actuator + qfrc_applied + Jᵀ xfrc_applied − qfrc_bias
///
/// Reads:  state, kinematics. Writes: qfrc_passive, qfrc_actuator, qacc_smooth and, as if nothing else pushed,
///         qacc; vel of the movers, acc of free bodies; for other trees also qm_rows, qld, qfrc_bias, qfrc_smooth.
pub fn smooth(model: &Model, state: &State, data: &mut Data) {
    if !model.tendons.is_empty() {
        tendon::tendons(model, &state.qpos, &state.qvel, data);
        tendon::rates(model, &state.qvel, data);
    }
    passive::passive(model, &state.qpos, &state.qvel, data);
    actuation::actuate(model, state, data);
    let applied = !state.xfrc_applied.is_empty() || !state.qfrc_applied.is_empty();
    let pushed = !model.actuators.is_empty() || applied;
    let gravity = gravity(model);
    for (t, tree) in model.trees.iter().enumerate() {
        match &tree.free {
            Some(free) => {
                let wrench = pushed.then(|| free::wrench(model, tree, free, state, data));
                free::accelerate(model, t, free, &gravity, wrench, &state.qvel, data);
            }
            None => articulated(model, t, &gravity, state, data),
        }
    }
}

/// [`smooth`] for one tree that is not a free body. Not inlined: the loop over free bodies stays small.
#[inline(never)]
fn articulated(model: &Model, t: usize, gravity: &Vec3, state: &State, data: &mut Data) {
    let tree = &model.trees[t];
    let (bodies, dofs) = (tree.bodies.clone(), tree.dofs.clone());
    if let Some(plane) = data.plan.planes[t] {
        bias::velocities(model, t, &state.qvel, data);
        planar::bias(model, t, &plane, gravity, &state.qvel, data);
    } else if data.plan.varies[t] {
        inertia::links(model, t, data);
        bias::bias(model, t, gravity, &state.qvel, data);
    } else {
        bias::velocities(model, t, &state.qvel, data);
    }
    tendon::add_bias(model, t, data);
    for d in dofs.clone() {
        data.qfrc_smooth[d] = data.qfrc_passive[d] + data.qfrc_actuator[d] - data.qfrc_bias[d];
    }
    if !state.qfrc_applied.is_empty() {
        dofs.clone().for_each(|d| data.qfrc_smooth[d] += state.qfrc_applied[d]);
    }
    for b in bodies.clone().take(state.xfrc_applied.len().saturating_sub(bodies.start)) {
        actuation::apply(model, b, &state.xfrc_applied[b], data);
    }
    let Data { plan, movers, qfrc_smooth, qacc_smooth, qacc, .. } = data;
    if let Some(uncoupled) = &plan.uncoupled[t] {
        let mover = &mut movers[bodies.start];
        mover.acc = mover.minv.component_mul(&uncoupled.motion(&qfrc_smooth[dofs.clone()]));
        uncoupled.on_dofs(&mover.acc, &mut qacc_smooth[dofs.clone()]);
        uncoupled.on_dofs(&mover.acc, &mut qacc[dofs]);
        return;
    }
    data.qacc_smooth[dofs.clone()].copy_from_slice(&data.qfrc_smooth[dofs.clone()]);
    if !data.plan.varies[t] {
        data.plan.pattern.solve(&dofs, &data.qld, &mut data.qacc_smooth[dofs.clone()]);
    } else {
        if data.plan.planes[t].is_some() {
            planar::matrix(model, t, data);
        } else {
            inertia::matrix(model, t, data);
        }
        tendon::add_inertia(model, t, data);
        factor_m(model, t, data);
        data.plan.pattern.substitute(&dofs, &data.qld, &mut data.qacc_smooth[dofs.clone()]);
    }
    data.qacc[dofs.clone()].copy_from_slice(&data.qacc_smooth[dofs]);
}

/// Reads: qm_rows. Writes: qld. Reduces: qacc_smooth.
fn factor_m(model: &Model, t: usize, data: &mut Data) {
    let (dofs, Data { qm_rows, qld, plan, qacc_smooth, .. }) = (&model.trees[t].dofs, data);
    let block = plan.pattern.block(dofs);
    qld[block.clone()].copy_from_slice(&qm_rows[block]);
    plan.pattern.factor(dofs, qld, &mut qacc_smooth[dofs.clone()]);
}

/// Jacobian of a point of a body: column j is the twist of the point when dof j of the body's tree moves.
///
///     [velocity at `point`, angular velocity] = Σ_j out_j q̇_j        (world axes)
///
/// Columns are those of the tree's dofs; dofs that do not move the body get zero.
/// In: `point` in the world, m. Out: m or 1 a unit of q, and rad. Reads: kinematics.
pub fn jacobian(model: &Model, data: &Data, body: usize, point: &Vec3, out: &mut [Vec6]) {
    let Some(t) = model.bodies[body].tree else { return };
    let dofs = &model.trees[t].dofs;
    out[..dofs.len()].fill(Vec6::zeros());
    each_column(model, data, body, point, |d, twist| out[d - dofs.start] = twist);
}

/// Hands on the twist of a point of a body for each dof that moves it.
pub fn each_column(model: &Model, data: &Data, body: usize, point: &Vec3, mut column: impl FnMut(usize, Vec6)) {
    let Some(t) = model.bodies[body].tree else { return };
    let tree = &model.trees[t];
    let root = tree.bodies.start;
    let arm = point - data.xpos[root];
    if tree.free.is_some() {
        for i in 0..3 {
            let axis = data.xmat[root].column(i).into_owned();
            column(tree.dofs.start + i, Vec6::ith(i, 1.0));
            column(tree.dofs.start + 3 + i, spatial::join(&axis.cross(&arm), &axis));
        }
        return;
    }
    let mut d = last_dof(model, body);
    while d != links::NONE {
        column(d, spatial::at(&data.cdof[d], &arm));
        d = data.plan.dof_parent[d];
    }
}

/// Puts the mocap bodies, and what is welded to them, where the state says.
///
/// Reads: mocap_pos, mocap_quat. Writes: xpos, xquat, xmat, geom_xpos, geom_xmat of what is placed so.
pub fn mocap(model: &Model, state: &State, data: &mut Data) {
    for i in 0..data.plan.mocap.len() {
        let b = data.plan.mocap[i];
        match model.mocap.binary_search(&b) {
            Ok(m) => {
                data.xpos[b] = state.mocap_pos[m].into();
                data.xquat[b] = quat(&state.mocap_quat[m]);
                data.xmat[b] = mat(&data.xquat[b]);
            }
            Err(_) => kinematics::weld(model, b, data),
        }
    }
    let Data { plan, xpos, xmat, geom_xpos, geom_xmat, .. } = data;
    kinematics::geoms(&plan.mocap_geoms, xpos, xmat, geom_xpos, geom_xmat);
}

/// M of a tree that is not a free body, and its factor.
///
/// Reads: kinematics. Writes: qm_rows, qld; qacc_smooth is no longer one.
pub fn inertia_matrix(model: &Model, t: usize, data: &mut Data) {
    inertia::links(model, t, data);
    inertia::matrix(model, t, data);
    tendon::add_inertia(model, t, data);
    factor_m(model, t, data);
}

/// M of a tree that is not a free body as a dense matrix, row-major, kg (kg m²). Not for a step. Reads: qm_rows.
pub fn dense_m(model: &Model, data: &Data, tree: usize) -> Vec<f64> {
    let mut out = vec![0.0; model.trees[tree].dofs.len().pow(2)];
    inertia::dense(model, data, tree, &mut out);
    out
}

/// x ← M⁻¹ x for a tree that is not a free body; `x` holds the tree's dofs, in one column or several side by side.
pub fn solve_m<T: factor::Column>(model: &Model, data: &Data, tree: usize, x: &mut [T]) {
    data.plan.pattern.solve(&model.trees[tree].dofs, &data.qld, x);
}

/// Gravity, m/s²; zero where the flag switches it off.
pub fn gravity(model: &Model) -> Vec3 {
    if model.opt.flags.gravity { model.opt.gravity } else { Vec3::zeros() }
}

/// How a body moves: velocity of its centre of mass (m/s) and angular velocity (rad/s), world axes.
///
/// Reads: kinematics, and the velocities that [`smooth`] has found.
pub fn twist(model: &Model, data: &Data, body: usize) -> Vec6 {
    let Some(tree) = model.bodies[body].tree else { return Vec6::zeros() };
    let root = model.trees[tree].bodies.start;
    let (v, w, at) = if model.trees[tree].free.is_some() {
        let mover = &data.movers[root];
        (spatial::lin(&mover.vel), mover.axes * spatial::ang(&mover.vel), mover.com)
    } else {
        (spatial::lin(&data.cvel[body]), spatial::ang(&data.cvel[body]), data.xpos[root])
    };
    spatial::join(&(v + w.cross(&(xipos(model, data, body) - at))), &w)
}

/// Centre of mass of a body in the world, m.
pub fn xipos(model: &Model, data: &Data, body: usize) -> Vec3 {
    data.xpos[body] + data.xmat[body] * model.bodies[body].ipos
}

/// The last dof that moves a body, [`links::NONE`] if nothing does.
pub fn last_dof(model: &Model, body: usize) -> usize {
    let dofs = &model.bodies[model.bodies[body].weld].dofs;
    if dofs.is_empty() { links::NONE } else { dofs.end - 1 }
}
