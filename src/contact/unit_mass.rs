//! Coordinates in which every tree has unit mass, and the ways between them and the dofs.
//!
//!     M = Sᵀ S,   w = S (a − a₀),   W = J S⁻¹:      M (a − a₀) = Jᵀ f  ⇔  w = Wᵀ f,    J a = J a₀ + W w
//!
//! a₀ is the acceleration without constraints. The inertia is gone, and with it the products with M and M⁻¹.
//!
//!     free body:   S = diag(√m, √m, √m, √I₁, √I₂, √I₃) on the acceleration of its mover
//!     other tree:  S = √D L with M = Lᵀ D L, the factor that the smooth dynamics has left, on qacc
//!
//! Vectors of a tree are padded with zeros to an even length, at least six. `scale` is the inverse of S's diagonal.

use super::rows::{Row, SIX};
use crate::data::{Data, Mover};
use crate::dynamics::factor::by_length;
use crate::math::{Vec3, vec3};
use crate::model::{FreeBody, Model, Tree};

/// Unknowns of a tree of that many degrees of freedom.
pub fn padded(dofs: usize) -> usize {
    dofs.max(SIX).next_multiple_of(2)
}

/// The inverse of S's diagonal for a tree that is not a free body, appended to `out`.
pub fn scale(data: &Data, tree: &Tree, out: &mut Vec<f64>) {
    out.extend(data.plan.pattern.rows(&tree.dofs).iter().map(|row| data.qld[row.diagonal()].sqrt()));
}

/// w = S (a − a₀) on a tree's dofs.
fn multiply(data: &Data, tree: &Tree, scale: &[f64], a: &[f64], smooth: &[f64], w: &mut [f64]) {
    let pattern = &data.plan.pattern;
    let change = |k: usize| a[k] - smooth[k];
    for (k, row) in pattern.rows(&tree.dofs).iter().enumerate() {
        let (l, way) = (&data.qld[row.entries()], pattern.beside_diagonal(row));
        let mut sum = change(k);
        by_length!(way.len(), n => for (l, entry) in l[..n].iter().zip(&way[..n]) {
            sum += l * change(entry.column);
        });
        w[k] = sum / scale[k];
    }
}

/// Jᵀ f = Sᵀ w, on a tree's dofs: also a row of W back to one of J.
fn multiply_transposed(data: &Data, tree: &Tree, scale: &[f64], w: &[f64], out: &mut [f64]) {
    let pattern = &data.plan.pattern;
    out.fill(0.0);
    for (k, row) in pattern.rows(&tree.dofs).iter().enumerate() {
        let (l, way) = (&data.qld[row.entries()], pattern.beside_diagonal(row));
        let x = w[k] / scale[k];
        by_length!(way.len(), n => for (l, entry) in l[..n].iter().zip(&way[..n]) {
            out[entry.column] += l * x;
        });
        out[k] += x;
    }
}

/// w of a guess of qacc.
pub fn of_qacc(data: &Data, t: usize, tree: &Tree, scale: &[f64], smooth: &[f64], qacc: &[f64], w: &mut [f64]) {
    match &tree.free {
        Some(free) => {
            let a = acceleration_of_mover(t, free, tree, data, qacc);
            (0..SIX).for_each(|i| w[i] = (a[i] - smooth[i]) / scale[i]);
        }
        None => multiply(data, tree, scale, qacc, smooth, w),
    }
}

/// A row of W as a row of J over the tree's dofs; w likewise as a generalized force.
pub fn on_dofs(data: &Data, tree: &Tree, scale: &[f64], row: &[f64], out: &mut [f64]) {
    match &tree.free {
        Some(free) => {
            let wrench: Row = std::array::from_fn(|i| row[i] / scale[i]);
            out.copy_from_slice(&force_on_free_joint(free, tree, data, &wrench));
        }
        None => multiply_transposed(data, tree, scale, row, out),
    }
}

/// Puts what the constraints do to a tree where it belongs: the one place that does so, for every law.
///
///     qacc = a₀ + S⁻¹ w,     qfrc_constraint = Sᵀ w        (= Jᵀ f at a solution)
pub fn finish(model: &Model, data: &mut Data, tree: usize, scale: &[f64], smooth: &[f64], w: &[f64]) {
    let t = &model.trees[tree];
    if let Some(free) = &t.free {
        let change: Row = std::array::from_fn(|i| scale[i] * w[i]);
        let a = std::array::from_fn(|i| smooth[i] + change[i]);
        finish_free(free, data.plan.aligned[tree], t, data, &a, &change);
        return;
    }
    let mut qfrc = std::mem::take(&mut data.qfrc_constraint);
    multiply_transposed(data, t, scale, w, &mut qfrc[t.dofs.clone()]);
    data.qfrc_constraint = qfrc;
    let Data { qacc, qld, plan, .. } = data;
    let x = &mut qacc[t.dofs.clone()];
    // S⁻¹ = L⁻¹ √D⁻¹
    for (k, row) in plan.pattern.rows(&t.dofs).iter().enumerate() {
        let (l, way) = (&qld[row.entries()], plan.pattern.beside_diagonal(row));
        let mut sum = scale[k] * w[k];
        by_length!(way.len(), n => for (l, entry) in l[..n].iter().zip(&way[..n]) {
            sum -= l * x[entry.column];
        });
        x[k] = sum;
    }
    x.iter_mut().zip(smooth).for_each(|(x, s)| *x += s);
}

/// A free joint's acceleration in the coordinates of its mover.
///
///     a_com = a + α × (com − x),   angular part Pᵀα      with α in the body's frame, P its principal axes
#[inline]
pub fn acceleration_of_mover(t: usize, free: &FreeBody, tree: &Tree, data: &Data, qacc: &[f64]) -> Row {
    if let (true, Ok(qacc)) = (data.plan.aligned[t], Row::try_from(qacc)) {
        return qacc;
    }
    let (mover, xpos) = (&data.movers[tree.bodies.start], &data.xpos[tree.bodies.start]);
    let turn = free.axes.tr_mul(&vec3(&qacc[3..6]));
    let linear = vec3(&qacc[..3]) + (mover.axes * turn).cross(&(mover.com - xpos));
    [linear.x, linear.y, linear.z, turn.x, turn.y, turn.z]
}

/// qacc and qfrc_constraint of a free joint from its mover's acceleration and the part of it that constraints cause.
///
///     F = m (a − a₀),  τ = I (α − α₀)        about the centre of mass, τ in principal axes
#[inline(always)]
pub fn finish_free(free: &FreeBody, aligned: bool, tree: &Tree, data: &mut Data, a: &Row, change: &Row) {
    let (mover, body) = (&data.movers[tree.bodies.start], tree.bodies.start);
    let (m, inertia) = (free.mass, &free.inertia);
    let wrench: Row = std::array::from_fn(|i| change[i] * [m, m, m, inertia.x, inertia.y, inertia.z][i]);
    let (qacc, qfrc) = (&mut data.qacc[tree.dofs.clone()], &mut data.qfrc_constraint[tree.dofs.clone()]);
    if aligned {
        qacc.copy_from_slice(a);
        qfrc.copy_from_slice(&wrench);
        return;
    }
    let (force, torque) = (vec3(&wrench[..3]), vec3(&wrench[3..]));
    qfrc[..3].copy_from_slice(force.as_slice());
    let lever = mover.com - data.xpos[body];
    let turn = vec3(&a[3..]);
    let origin = vec3(&a[..3]) - (mover.axes * turn).cross(&lever);
    qacc[..3].copy_from_slice(origin.as_slice());
    qacc[3..].copy_from_slice((free.axes * turn).as_slice());
    let about_origin = torque + mover.axes.tr_mul(&lever.cross(&force));
    qfrc[3..].copy_from_slice((free.axes * about_origin).as_slice());
}

/// A generalized force on a free joint from the wrench on its mover; a row of J is transformed likewise.
fn force_on_free_joint(free: &FreeBody, tree: &Tree, data: &Data, wrench: &[f64]) -> Row {
    let (mover, xpos) = (&data.movers[tree.bodies.start], &data.xpos[tree.bodies.start]);
    let force = vec3(&wrench[..3]);
    let about_origin = free.axes * (vec3(&wrench[3..6]) + mover.axes.tr_mul(&(mover.com - xpos).cross(&force)));
    [force.x, force.y, force.z, about_origin.x, about_origin.y, about_origin.z]
}

/// A row of a free joint's dofs, from its dof `first` on, in the coordinates of its mover.
///
///     qacc_i = a_com,i − ((P α) × l)_i = … + α · Pᵀ(e_i × l) for i < 3,   qacc_i = (axes α)_i for the others
pub fn row_of_mover(free: &FreeBody, tree: &Tree, data: &Data, first: usize, entries: &[f64]) -> Row {
    let (mover, xpos): (&Mover, _) = (&data.movers[tree.bodies.start], &data.xpos[tree.bodies.start]);
    let mut out = [0.0; SIX];
    for (i, entry) in entries.iter().enumerate() {
        let dof = first + i - tree.dofs.start;
        let turn = if dof < 3 {
            out[dof] += entry;
            mover.axes.tr_mul(&Vec3::ith(dof, 1.0).cross(&(mover.com - xpos)))
        } else {
            free.axes.row(dof - 3).transpose()
        };
        (0..3).for_each(|j| out[3 + j] += entry * turn[j]);
    }
    out
}
