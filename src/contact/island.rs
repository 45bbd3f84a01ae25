//! An island: trees that constraints hold together, and their constraints, assembled for a contact law.
//!
//! Unknowns are the accelerations of the island's trees one after the other: six in the coordinates of its mover for a
//! free body (see [`Mover`]), qacc for any other tree. A tree of fewer than six degrees of freedom
//! is padded to six, so that nearly all loops have a fixed length; the padding has unit inertia and no rows.
//!
//!     M a = M a₀ + Jᵀ f        a₀: acceleration without constraints; J: rows of all constraints; f: their forces

use super::block_cholesky::BlockCholesky;
use super::cost::Curvature;

use super::newton::{self, Constraint, Into, Space, Vectors};
use crate::data::Outcome;
use crate::data::{Contact, Data, JointRow, Mover};
use crate::dynamics;
use crate::dynamics::links;
use crate::dynamics::spatial::{ang, lin};
use crate::math::{Vec3, divide_ldl, factor_ldl, vec3};
use crate::model::{FreeBody, Model, Tree};

/// Unknowns of a free body, and of every smaller tree with its padding.
pub const SIX: usize = 6;
pub type Row = [f64; SIX];

/// One tree of the island.
#[derive(Clone, Copy, Debug)]
pub struct Unit {
    pub tree: usize,
    /// Place in the island's vectors, number of unknowns with padding, and without.
    pub at: usize,
    pub n: usize,
    pub dofs: usize,
    /// Where its dofs begin among those of the island, without padding.
    first: usize,
    /// Index of the tree's first body.
    body: usize,
    free: bool,
}

/// The part of a constraint's rows that belongs to one tree: `dim` rows of `n` numbers.
#[derive(Clone, Copy, Debug, Default)]
pub struct Part {
    unit: usize,
    at: usize,
    n: usize,
    /// Start of the first row in `jac`.
    start: usize,
}

/// Where the parts of a constraint lie, and where their products go in H.
#[derive(Clone, Copy, Debug, Default)]
struct Parts {
    parts: [Part; 2],
    count: usize,
    diagonal: [usize; 2],
    /// Block of the two parts, and which of them has its rows: the tree that is eliminated first.
    off: usize,
    first: usize,
}

/// What a constraint stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// Index into `data.contacts`.
    Contact(usize),
    /// Index into `data.joint_rows`.
    Joint(usize),
}

#[derive(Clone, Debug, Default)]
pub struct Island {
    pub units: Vec<Unit>,
    /// What the constraints stand for, one by one.
    pub sources: Vec<Source>,
    pub constraints: Vec<Constraint>,
    pub vectors: Vectors<Vec<f64>>,
    /// Velocity: of the mover, or qvel.
    velocity: Vec<f64>,
    parts: Vec<Parts>,
    /// Numbers of all rows; those from `used` on are left over from larger islands.
    jac: Vec<f64>,
    used: usize,
    blocks: BlockCholesky,
    /// C J of one constraint.
    product: Vec<f64>,
    /// J of one constraint over the dofs of its trees.
    rows: [Vec<f64>; 2],
}

/// Unknowns of a tree of that many degrees of freedom.
fn padded(dofs: usize) -> usize {
    dofs.max(SIX)
}

impl Island {
    /// Makes room for all trees in one island, with that many contacts and rows of joints.
    pub fn reserve(&mut self, model: &Model, contacts: usize, joints: usize) {
        let widths = || model.trees.iter().map(|t| padded(t.dofs.len()));
        let (size, widest) = (widths().sum(), widths().max().unwrap_or(0));
        let constraints = contacts + joints;
        self.units.reserve(model.trees.len());
        self.constraints.reserve(constraints);
        self.sources.reserve(constraints);
        self.parts.reserve(constraints);
        self.jac.reserve((contacts * model.plan.condim * 2 + joints) * widest);
        self.product.reserve(6 * widest);
        let v = &mut self.vectors;
        for vector in [&mut v.smooth, &mut v.a, &mut v.pull, &mut v.gradient, &mut v.p, &mut v.mp, &mut self.velocity] {
            vector.reserve(size);
        }
        self.blocks.reserve(model.trees.len(), size);
    }

    pub fn reset(&mut self) {
        self.units.clear();
        self.sources.clear();
        self.parts.clear();
        self.velocity.clear();
        self.vectors.smooth.clear();
        self.used = 0;
    }

    /// Adds a tree with its velocity and its acceleration without constraints; returns its number in the island.
    ///
    /// Reads: movers, qacc_smooth, qvel.
    pub fn add_tree(&mut self, model: &Model, data: &Data, qvel: &[f64], tree: usize) -> usize {
        let t = &model.trees[tree];
        let (at, dofs, body) = (self.velocity.len(), t.dofs.len(), t.bodies.start);
        let n = padded(dofs);
        let first = self.units.last().map_or(0, |u| u.first + u.dofs);
        self.units.push(Unit { tree, at, n, dofs, first, body, free: t.free.is_some() });
        if t.free.is_some() {
            let mover = &data.movers[body];
            self.velocity.extend_from_slice(mover.vel.as_slice());
            self.vectors.smooth.extend_from_slice(mover.acc.as_slice());
        } else {
            self.velocity.extend_from_slice(&qvel[t.dofs.clone()]);
            self.vectors.smooth.extend_from_slice(&data.qacc_smooth[t.dofs.clone()]);
            self.velocity.resize(at + n, 0.0);
            self.vectors.smooth.resize(at + n, 0.0);
        }
        self.units.len() - 1
    }

    /// Gives all vectors their length. Comes after the trees.
    pub fn start(&mut self) {
        let size = self.velocity.len();
        let v = &mut self.vectors;
        for vector in [&mut v.a, &mut v.pull, &mut v.gradient, &mut v.p, &mut v.mp] {
            vector.resize(size, 0.0);
        }
    }

    /// Room for the rows of a part, filled with zeros unless the caller writes them all.
    fn part(&mut self, unit: usize, rows: usize) -> Part {
        let Unit { at, n, free, .. } = self.units[unit];
        let start = self.used;
        self.used += rows * n;
        if self.jac.len() < self.used {
            self.jac.resize(self.used, 0.0);
        }
        if !free {
            self.jac[start..self.used].fill(0.0);
        }
        Part { unit, at, n, start }
    }

    /// Adds a contact of `dim` directions: normal, two tangents, spin about the normal, roll about the tangents.
    ///
    ///     v_k = J_k · velocity     along n, t₁, t₂ at the point of contact (m/s), about n, t₁, t₂ (rad/s)
    ///
    /// In: `units` the island's numbers of the trees of its two bodies; `points` where each body is touched, world, m.
    pub fn add_contact(
        &mut self,
        model: &Model,
        data: &Data,
        index: usize,
        dim: usize,
        units: [Option<usize>; 2],
        points: [Vec3; 2],
    ) {
        let contact = &data.contacts[index];
        let mut parts = Parts::default();
        for (side, sign) in [(0, -1.0), (1, 1.0)] {
            let Some(unit) = units[side] else { continue };
            if parts.count == 1 && parts.parts[0].unit == unit {
                // Both bodies belong to the same tree: one set of rows, their difference.
                self.add_tree_rows(model, data, contact, side, sign, points[side], parts.parts[0], dim);
                continue;
            }
            let part = self.part(unit, dim);
            let Unit { body, free, .. } = self.units[unit];
            if free {
                let jac = self.jac[part.start..self.used].as_chunks_mut::<SIX>().0;
                free_rows(contact, &data.movers[body], sign, &points[side], jac);
            } else {
                self.add_tree_rows(model, data, contact, side, sign, points[side], part, dim);
            }
            parts.parts[parts.count] = part;
            parts.count += 1;
        }
        self.push(Source::Contact(index), parts, dim);
    }

    fn push(&mut self, source: Source, parts: Parts, dim: usize) {
        let (i, velocity) = (self.sources.len(), self.products(&parts, dim, &self.velocity));
        if self.constraints.len() == i {
            self.constraints.push(Constraint::default());
        }
        let c = &mut self.constraints[i];
        (c.cone.dim, c.cone.frozen, c.zone, c.velocity) = (dim, 0, 0, velocity);
        self.sources.push(source);
        self.parts.push(parts);
    }

    /// Comes after all constraints: what is left over from a larger island goes. (What an island of the same size left is
    /// overwritten number by number, which is quicker than to make it anew.)
    pub fn finish_assembly(&mut self) {
        self.constraints.truncate(self.sources.len());
    }

    /// Products of a constraint's rows with a vector of the island.
    #[inline]
    fn products(&self, parts: &Parts, dim: usize, v: &[f64]) -> [f64; 6] {
        let mut sum = [0.0; 6];
        for part in &parts.parts[..parts.count] {
            let (rows, v) = (&self.jac[part.start..][..dim * part.n], &v[part.at..][..part.n]);
            add_products(rows, v, &mut sum);
        }
        sum
    }

    /// Number of scalar rows.
    pub fn rows(&self) -> usize {
        self.constraints.iter().map(|c| c.cone.dim).sum()
    }

    /// J a₀ of constraint i, m/s² and rad/s².
    pub fn smooth_accelerations(&self, i: usize) -> [f64; 6] {
        self.products(&self.parts[i], self.constraints[i].cone.dim, &self.vectors.smooth)
    }

    /// J a of constraint i, m/s² and rad/s².
    pub fn accelerations(&self, i: usize) -> [f64; 6] {
        self.products(&self.parts[i], self.constraints[i].cone.dim, &self.vectors.a)
    }

    /// Adds `factor` Jᵀ F J to the island's matrix over its trees' dofs (row-major, no padding).
    ///
    /// In: `slopes` F of each constraint, dim × dim.
    pub fn add_tangent(
        &mut self,
        model: &Model,
        data: &Data,
        factor: f64,
        slopes: &[[[f64; 6]; 6]],
        matrix: &mut [f64],
    ) {
        let n = self.units.last().map_or(0, |u| u.first + u.dofs);
        let (mut rows, mut product) = (std::mem::take(&mut self.rows), std::mem::take(&mut self.product));
        for ((c, parts), slope) in self.constraints.iter().zip(&self.parts).zip(slopes) {
            let dim = c.cone.dim;
            let parts = &parts.parts[..parts.count];
            for (part, rows) in parts.iter().zip(&mut rows) {
                self.rows_of_dofs(model, data, part, dim, rows);
            }
            for (right, right_rows) in parts.iter().zip(&rows) {
                let Unit { first: column, dofs: width, .. } = self.units[right.unit];
                // F J
                product.clear();
                product.resize(dim * width, 0.0);
                for k in 0..dim {
                    for l in (0..dim).filter(|&l| slope[k][l] != 0.0) {
                        add(
                            &mut product[k * width..][..width],
                            factor * slope[k][l],
                            &right_rows[l * width..][..width],
                        );
                    }
                }
                for (left, left_rows) in parts.iter().zip(&rows) {
                    let Unit { first, dofs: height, .. } = self.units[left.unit];
                    for k in 0..dim {
                        for (i, j) in left_rows[k * height..][..height].iter().enumerate().filter(|(_, j)| **j != 0.0) {
                            add(&mut matrix[(first + i) * n + column..][..width], *j, &product[k * width..][..width]);
                        }
                    }
                }
            }
        }
        (self.rows, self.product) = (rows, product);
    }

    /// The first `dim` rows of a part over the tree's dofs, without padding.
    fn rows_of_dofs(&self, model: &Model, data: &Data, part: &Part, dim: usize, out: &mut Vec<f64>) {
        let unit = &self.units[part.unit];
        let tree = &model.trees[unit.tree];
        out.clear();
        for k in 0..dim {
            let row = self.row(part, k);
            match &tree.free {
                Some(free) => out.extend_from_slice(&force_on_free_joint(free, tree, data, row)),
                None => out.extend_from_slice(&row[..unit.dofs]),
            }
        }
    }

    /// Adds ± frame · J of one side's body to the rows of a part: of the dofs between the body and the root only.
    fn add_tree_rows(
        &mut self,
        model: &Model,
        data: &Data,
        contact: &Contact,
        side: usize,
        sign: f64,
        point: Vec3,
        part: Part,
        dim: usize,
    ) {
        let body = contact.body[side] as usize;
        let Some(t) = model.bodies[body].tree else { return };
        let (first, arm) = (model.trees[t].dofs.start, point - data.xpos[model.trees[t].bodies.start]);
        let frame = contact.frame * sign;
        let mut dof = dynamics::last_dof(model, body);
        while dof != links::NONE {
            let twist = &data.cdof[dof];
            let (along, about) = (frame * (lin(twist) + ang(twist).cross(&arm)), frame * ang(twist));
            let column = &mut self.jac[part.start + dof - first..];
            for k in 0..dim {
                column[k * part.n] += if k < 3 { along[k] } else { about[k - 3] };
            }
            dof = data.plan.dof_parent[dof];
        }
    }

    /// Adds a row of a tree's dofs: a joint limit or dry friction.
    pub fn add_joint_row(&mut self, model: &Model, data: &Data, index: usize, unit: usize) {
        let row = &data.joint_rows[index];
        let part = self.part(unit, 1);
        let tree = &model.trees[self.units[unit].tree];
        let jac = &mut self.jac[part.start..self.used];
        match &tree.free {
            Some(free) => jac.copy_from_slice(&row_of_mover(free, tree, data, row)),
            None => jac[row.dof - tree.dofs.start..][..row.n].copy_from_slice(&row.entries[..row.n]),
        }
        self.push(Source::Joint(index), Parts { parts: [part, Part::default()], count: 1, ..Parts::default() }, 1);
    }

    /// J M⁻¹ Jᵀ of the row e₀ J₀ + e₁ J₁ of constraint i, 1/kg.
    pub fn inverse_mass(&mut self, model: &Model, data: &Data, i: usize, e: [f64; 2]) -> f64 {
        let mut room = std::mem::take(&mut self.product);
        let mut sum = 0.0;
        for part in &self.parts[i].parts[..self.parts[i].count] {
            room.clear();
            for _ in 0..2 {
                room.extend(self.row(part, 0).iter().map(|j| e[0] * j));
            }
            let (row, divided) = room.split_at_mut(part.n);
            if e[1] != 0.0 {
                add(row, e[1], self.row(part, 1));
                divided.copy_from_slice(row);
            }
            divide_unit(model, data, &self.units[part.unit], divided);
            sum += dot(row, divided);
        }
        self.product = room;
        sum
    }

    /// Reads a guess of qacc into `vectors.a`.
    pub fn guess(&mut self, model: &Model, data: &Data, qacc: &[f64]) {
        for unit in &self.units {
            let tree = &model.trees[unit.tree];
            let (a, qacc) = (&mut self.vectors.a[unit.at..][..unit.n], &qacc[tree.dofs.clone()]);
            match &tree.free {
                Some(free) => a.copy_from_slice(&acceleration_of_mover(free, tree, data, qacc)),
                None => {
                    a[unit.dofs..].fill(0.0);
                    a[..unit.dofs].copy_from_slice(qacc);
                }
            }
        }
    }

    /// Row k of constraint i, tree by tree.
    pub fn split_row(&self, i: usize, k: usize) -> Vec<(usize, &[f64])> {
        let parts = &self.parts[i];
        let of = |p: &Part| (self.units[p.unit].tree, &self.row(p, k)[..self.units[p.unit].dofs]);
        parts.parts[..parts.count].iter().map(of).collect()
    }

    fn row(&self, part: &Part, k: usize) -> &[f64] {
        &self.jac[part.start + k * part.n..][..part.n]
    }

    /// Puts accelerations and forces where they belong: the one place that does so, for every law.
    ///
    ///     qacc = a,     qfrc_constraint = M (a − a₀)        (= Jᵀ f at a solution)
    ///
    /// Writes: qacc and qfrc_constraint of the island's trees, forces of its contacts and joint rows.
    pub fn finish(&mut self, model: &Model, data: &mut Data) {
        for unit in &self.units {
            let tree = &model.trees[unit.tree];
            let place = unit.at..unit.at + unit.dofs;
            let (a, smooth) = (&self.vectors.a[place.clone()], &self.vectors.smooth[place]);
            match &tree.free {
                Some(free) => {
                    let six = |x: &[f64]| std::array::from_fn(|i| x[i]);
                    let aligned = data.plan.aligned[unit.tree];
                    finish_free(free, aligned, tree, data, &six(a), &six(smooth));
                }
                None => {
                    let (dofs, n) = (tree.dofs.clone(), unit.dofs);
                    data.qacc[dofs.clone()].copy_from_slice(a);
                    let m = &data.qm[data.m_adr[unit.tree]..][..n * n];
                    for (qfrc, row) in data.qfrc_constraint[dofs].iter_mut().zip(m.chunks_exact(n)) {
                        *qfrc = row.iter().zip(a.iter().zip(smooth)).map(|(m, (a, s))| m * (a - s)).sum();
                    }
                }
            }
        }
        for (c, source) in self.constraints.iter().zip(&self.sources) {
            match *source {
                Source::Contact(i) => {
                    let force = &mut data.contacts[i].force;
                    *force = [0.0; 6];
                    force[..c.cone.dim].copy_from_slice(&c.force[..c.cone.dim]);
                }
                Source::Joint(i) => data.joint_rows[i].force = c.force[0],
            }
        }
    }
}

/// Rows of a contact for one side that is a free body, in the coordinates of its mover.
///
///     J₀..₂ = ± [n, Aᵀ(r × n)],   J₃..₅ = ± [0, Aᵀn]      with n the rows of the frame, r from the COM, A the axes
///
/// In: `sign` −1 for the body of geom 0, +1 for that of geom 1.
#[inline]
fn free_rows(contact: &Contact, mover: &Mover, sign: f64, point: &Vec3, jac: &mut [Row]) {
    let lever = point - mover.com;
    let dim = jac.len();
    for (k, row) in jac.iter_mut().enumerate().take(3) {
        let n = contact.frame.row(k).transpose() * sign;
        let turn = mover.axes.tr_mul(&lever.cross(&n));
        *row = [n.x, n.y, n.z, turn.x, turn.y, turn.z];
    }
    for k in 3..dim {
        let turn = mover.axes.tr_mul(&contact.frame.row(k - 3).transpose()) * sign;
        jac[k] = [0.0, 0.0, 0.0, turn.x, turn.y, turn.z];
    }
}

/// A free joint's acceleration in the coordinates of its mover.
///
///     a_com = a + α × (com − x),   angular part Pᵀα      with α in the body's frame, P its principal axes
fn acceleration_of_mover(free: &FreeBody, tree: &Tree, data: &Data, qacc: &[f64]) -> Row {
    let (mover, xpos) = (&data.movers[tree.bodies.start], &data.xpos[tree.bodies.start]);
    let turn = free.axes.tr_mul(&vec3(&qacc[3..6]));
    let linear = vec3(&qacc[..3]) + (mover.axes * turn).cross(&(mover.com - xpos));
    [linear.x, linear.y, linear.z, turn.x, turn.y, turn.z]
}

/// qacc and qfrc_constraint of a free joint from its mover's acceleration, with and without constraints.
///
///     F = m (a − a₀),  τ = I (α − α₀)        about the centre of mass, τ in principal axes
pub fn finish_free(free: &FreeBody, aligned: bool, tree: &Tree, data: &mut Data, a: &Row, smooth: &Row) {
    let (mover, body) = (&data.movers[tree.bodies.start], tree.bodies.start);
    let change: Row = std::array::from_fn(|i| a[i] - smooth[i]);
    let force = vec3(&change[..3]) * free.mass;
    let torque = vec3(&change[3..]).component_mul(&free.inertia);
    let (qacc, qfrc) = (&mut data.qacc[tree.dofs.clone()], &mut data.qfrc_constraint[tree.dofs.clone()]);
    qfrc[..3].copy_from_slice(force.as_slice());
    if aligned {
        qacc.copy_from_slice(a);
        qfrc[3..].copy_from_slice(torque.as_slice());
        return;
    }
    let lever = mover.com - data.xpos[body];
    let turn = vec3(&a[3..]);
    let origin = vec3(&a[..3]) - (mover.axes * turn).cross(&lever);
    qacc[..3].copy_from_slice(origin.as_slice());
    qacc[3..].copy_from_slice((free.axes * turn).as_slice());
    let about_origin = torque + mover.axes.tr_mul(&lever.cross(&force));
    qfrc[3..].copy_from_slice((free.axes * about_origin).as_slice());
}

/// A generalized force on a free joint from the wrench on its mover; a row of J is transformed likewise.
pub fn force_on_free_joint(free: &FreeBody, tree: &Tree, data: &Data, wrench: &[f64]) -> Row {
    let (mover, xpos) = (&data.movers[tree.bodies.start], &data.xpos[tree.bodies.start]);
    let force = vec3(&wrench[..3]);
    let about_origin = free.axes * (vec3(&wrench[3..6]) + mover.axes.tr_mul(&(mover.com - xpos).cross(&force)));
    [force.x, force.y, force.z, about_origin.x, about_origin.y, about_origin.z]
}

/// A row of a free joint's dofs in the coordinates of its mover.
///
///     qacc_i = a_com,i − ((P α) × l)_i = … + α · Pᵀ(e_i × l) for i < 3,   qacc_i = (axes α)_i for the others
fn row_of_mover(free: &FreeBody, tree: &Tree, data: &Data, row: &JointRow) -> Row {
    let (mover, xpos) = (&data.movers[tree.bodies.start], &data.xpos[tree.bodies.start]);
    let mut out = [0.0; SIX];
    for (i, entry) in row.entries.iter().enumerate().take(row.n) {
        let dof = row.dof + i - tree.dofs.start;
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

/// out += J v, J with rows as long as v.
#[inline]
fn add_products(rows: &[f64], v: &[f64], out: &mut [f64; 6]) {
    if let Ok(v) = <&Row>::try_from(v) {
        for (out, row) in out.iter_mut().zip(rows.as_chunks::<SIX>().0) {
            *out += dot_six(row, v);
        }
    } else {
        for (out, row) in out.iter_mut().zip(rows.chunks_exact(v.len())) {
            *out += dot(row, v);
        }
    }
}

#[inline]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    if let (Ok(a), Ok(b)) = (<&Row>::try_from(a), <&Row>::try_from(b)) {
        return dot_six(a, b);
    }
    // Two sums: an addition need not wait for the one before.
    let (pairs, rest) = a.as_chunks::<2>();
    let (b_pairs, b_rest) = b.as_chunks::<2>();
    let mut sum = [0.0; 2];
    for (a, b) in pairs.iter().zip(b_pairs) {
        sum[0] += a[0] * b[0];
        sum[1] += a[1] * b[1];
    }
    sum[0] + sum[1] + rest.iter().zip(b_rest).map(|(a, b)| a * b).sum::<f64>()
}

#[inline(always)]
pub fn dot_six(a: &Row, b: &Row) -> f64 {
    (a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3]) + (a[4] * b[4] + a[5] * b[5])
}

/// y += factor x
#[inline]
fn add(y: &mut [f64], factor: f64, x: &[f64]) {
    if let (Ok(y), Ok(x)) = (<&mut Row>::try_from(&mut *y), <&Row>::try_from(x)) {
        for i in 0..SIX {
            y[i] += factor * x[i];
        }
        return;
    }
    y.iter_mut().zip(x).for_each(|(y, x)| *y += factor * x);
}

/// Principal masses of a free body: kg three times, then kg m².
fn masses(free: &FreeBody) -> Row {
    [free.mass, free.mass, free.mass, free.inertia.x, free.inertia.y, free.inertia.z]
}

/// x = M⁻¹ x for one tree.
fn divide_unit(model: &Model, data: &Data, unit: &Unit, x: &mut [f64]) {
    if unit.free {
        let minv = &data.movers[unit.body].minv;
        x.iter_mut().zip(minv.iter()).for_each(|(x, w)| *x *= w);
    } else {
        dynamics::solve_m(model, data, unit.tree, &mut x[..unit.dofs]);
    }
}

/// Several trees, or one of many degrees of freedom, as Newton's method sees them.
pub struct Many<'a> {
    model: &'a Model,
    data: &'a Data,
    units: &'a [Unit],
    parts: &'a mut [Parts],
    jac: &'a [f64],
    blocks: &'a mut BlockCholesky,
    product: &'a mut Vec<f64>,
    /// Whether `blocks` and the places in `parts` are this island's: a good start needs neither.
    analysed: bool,
}

/// One tree of at most six degrees of freedom: arrays of fixed size.
pub struct One<'a> {
    model: &'a Model,
    data: &'a Data,
    unit: Unit,
    parts: &'a [Parts],
    jac: &'a [Row],
}

/// What a law does with an island, in arrays of fixed size or of any: it leaves the accelerations in `a`, the forces in
/// the constraints.
pub trait Solve {
    type Outcome;
    fn solve<S: Space>(
        self,
        space: &mut S,
        v: &mut Vectors<S::Vector>,
        constraints: &mut [Constraint],
    ) -> Self::Outcome;
}

/// Lets the forces that the constraints have act: all that a law of springs and dampers has to do.
pub struct Push;

impl Solve for Push {
    type Outcome = Outcome;

    fn solve<S: Space>(self, space: &mut S, v: &mut Vectors<S::Vector>, constraints: &mut [Constraint]) -> Outcome {
        newton::accelerate(space, v, constraints);
        v.a.as_mut().copy_from_slice(v.mp.as_ref());
        Outcome::default()
    }
}

impl Island {
    /// Lets `law` solve the island.
    pub fn solve<L: Solve>(&mut self, model: &Model, data: &Data, law: L) -> L::Outcome {
        let Island { units, constraints, vectors, parts, jac, blocks, product, .. } = self;
        if let [unit] = units[..]
            && unit.n == SIX
        {
            let mut v = Vectors::<Row>::default();
            v.smooth.copy_from_slice(&vectors.smooth);
            v.a.copy_from_slice(&vectors.a);
            let mut one = One { model, data, unit, parts, jac: jac.as_chunks().0 };
            let outcome = law.solve(&mut one, &mut v, constraints);
            vectors.a.copy_from_slice(&v.a);
            return outcome;
        }
        let mut many = Many { model, data, units, parts, jac, blocks, product, analysed: false };
        law.solve(&mut many, vectors, constraints)
    }
}

impl One<'_> {
    /// Rows of constraint i.
    #[inline(always)]
    fn rows(&self, i: usize, dim: usize) -> &[Row] {
        &self.jac[self.parts[i].parts[0].start / SIX..][..dim]
    }

    /// Lower triangle of M, with ones on the diagonal of the padding.
    fn matrix(&self) -> [Row; SIX] {
        let mut m = [[0.0; SIX]; SIX];
        let n = self.unit.dofs;
        if let Some(free) = &self.model.trees[self.unit.tree].free {
            let masses = masses(free);
            (0..SIX).for_each(|i| m[i][i] = masses[i]);
            return m;
        }
        (n..SIX).for_each(|i| m[i][i] = 1.0);
        let qm = &self.data.qm[self.data.m_adr[self.unit.tree]..][..n * n];
        for (row, qm) in m.iter_mut().zip(qm.chunks_exact(n)) {
            row[..n].copy_from_slice(qm);
        }
        m
    }
}

impl Space for One<'_> {
    type Vector = Row;

    #[inline]
    fn multiply_m(&self, v: &Row, out: &mut Row) {
        if let Some(free) = &self.model.trees[self.unit.tree].free {
            let m = masses(free);
            *out = std::array::from_fn(|i| m[i] * v[i]);
            return;
        }
        let m = self.matrix();
        *out = std::array::from_fn(|i| dot_six(&m[i], v));
    }

    #[inline]
    fn divide_m(&self, v: &mut Row) {
        divide_unit(self.model, self.data, &self.unit, v);
    }

    fn trace_m(&self) -> f64 {
        let m = self.matrix();
        (0..self.unit.dofs).map(|i| m[i][i]).sum()
    }

    #[inline]
    fn multiply_j(&self, v: &Row, into: Into, constraints: &mut [Constraint]) {
        for (i, c) in constraints.iter_mut().enumerate() {
            let mut product = [0.0; 6];
            for (product, row) in product.iter_mut().zip(self.rows(i, c.cone.dim)) {
                *product = dot_six(row, v);
            }
            c.set(into, product);
        }
    }

    #[inline]
    fn subtract_forces(&self, constraints: &[Constraint], g: &mut Row) {
        for (i, c) in constraints.iter().enumerate() {
            for (row, f) in self.rows(i, c.cone.dim).iter().zip(&c.force) {
                (0..SIX).for_each(|i| g[i] -= f * row[i]);
            }
        }
    }

    fn newton(&mut self, constraints: &[Constraint], g: &Row, p: &mut Row) {
        let mut h = self.matrix();
        for (i, c) in constraints.iter().enumerate() {
            let curvature = c.cone.curvature(&c.x);
            if !matches!(curvature, Curvature::Zero) {
                add_curvature(&curvature, self.rows(i, c.cone.dim), &mut h);
            }
        }
        factor_ldl(&mut h);
        *p = g.map(|g| -g);
        divide_ldl(&h, p);
    }
}

/// H += Jᵀ C J. Of H only the lower triangle counts; rows are added in pairs of numbers, as the machine does.
#[inline]
fn add_curvature(curvature: &Curvature, jac: &[Row], h: &mut [Row; SIX]) {
    for (k, row) in jac.iter().enumerate() {
        let Some(product) = curvature.times(k, jac) else { continue };
        for i in 0..SIX {
            for j in 0..(i | 1) + 1 {
                h[i][j] += row[i] * product[j];
            }
        }
    }
}

impl Many<'_> {
    /// Principal masses of a free body, or nothing.
    fn masses(&self, unit: &Unit) -> Option<Row> {
        self.model.trees[unit.tree].free.as_ref().map(masses)
    }

    /// Inertia matrix of a tree that is not a free body, without padding.
    fn qm(&self, unit: &Unit) -> &[f64] {
        &self.data.qm[self.data.m_adr[unit.tree]..][..unit.dofs * unit.dofs]
    }
}

impl Space for Many<'_> {
    type Vector = Vec<f64>;

    fn multiply_m(&self, v: &Vec<f64>, out: &mut Vec<f64>) {
        for unit in self.units {
            let (v, out) = (&v[unit.at..][..unit.n], &mut out[unit.at..][..unit.n]);
            match self.masses(unit) {
                Some(m) => (0..SIX).for_each(|i| out[i] = m[i] * v[i]),
                None => {
                    out[unit.dofs..].fill(0.0);
                    for (out, row) in out.iter_mut().zip(self.qm(unit).chunks_exact(unit.dofs)) {
                        *out = dot(row, &v[..unit.dofs]);
                    }
                }
            }
        }
    }

    fn divide_m(&self, v: &mut Vec<f64>) {
        for unit in self.units {
            divide_unit(self.model, self.data, unit, &mut v[unit.at..][..unit.n]);
        }
    }

    fn trace_m(&self) -> f64 {
        let trace = |unit: &Unit| match self.masses(unit) {
            Some(m) => m.iter().sum(),
            None => self.qm(unit).iter().step_by(unit.dofs + 1).sum::<f64>(),
        };
        self.units.iter().map(trace).sum()
    }

    fn multiply_j(&self, v: &Vec<f64>, into: Into, constraints: &mut [Constraint]) {
        for (c, parts) in constraints.iter_mut().zip(&*self.parts) {
            let mut product = [0.0; 6];
            for part in &parts.parts[..parts.count] {
                let (rows, v) = (&self.jac[part.start..][..c.cone.dim * part.n], &v[part.at..][..part.n]);
                add_products(rows, v, &mut product);
            }
            c.set(into, product);
        }
    }

    fn subtract_forces(&self, constraints: &[Constraint], g: &mut Vec<f64>) {
        for (c, parts) in constraints.iter().zip(&*self.parts) {
            for part in &parts.parts[..parts.count] {
                let (rows, g) = (&self.jac[part.start..][..c.cone.dim * part.n], &mut g[part.at..][..part.n]);
                if let Ok(g) = <&mut Row>::try_from(&mut *g) {
                    for (row, f) in rows.as_chunks::<SIX>().0.iter().zip(&c.force) {
                        (0..SIX).for_each(|i| g[i] -= f * row[i]);
                    }
                } else {
                    for (row, f) in rows.chunks_exact(part.n).zip(&c.force).filter(|(_, f)| **f != 0.0) {
                        add(g, -f, row);
                    }
                }
            }
        }
    }

    fn newton(&mut self, constraints: &[Constraint], g: &Vec<f64>, p: &mut Vec<f64>) {
        if !self.analysed {
            self.analyse();
            self.analysed = true;
        }
        self.fill_hessian(constraints);
        self.blocks.factor();
        p.iter_mut().zip(g).for_each(|(p, g)| *p = -g);
        self.blocks.divide(p);
    }
}

impl Many<'_> {
    /// Finds where the constraints' products go in H.
    fn analyse(&mut self) {
        self.blocks.reset(self.units.iter().map(|u| u.n));
        for p in self.parts.iter().filter(|p| p.count == 2) {
            self.blocks.connect(p.parts[0].unit, p.parts[1].unit);
        }
        self.blocks.analyse();
        for p in &mut *self.parts {
            for i in 0..p.count {
                p.diagonal[i] = self.blocks.place(p.parts[i].unit, p.parts[i].unit).0;
            }
            if p.count == 2 {
                let swapped;
                (p.off, swapped) = self.blocks.place(p.parts[0].unit, p.parts[1].unit);
                p.first = usize::from(swapped);
            }
        }
    }

    /// H = M + Jᵀ s'' J
    fn fill_hessian(&mut self, constraints: &[Constraint]) {
        self.blocks.values().fill(0.0);
        for (u, unit) in self.units.iter().enumerate() {
            let (at, _) = self.blocks.place(u, u);
            let (n, dofs) = (unit.n, unit.dofs);
            if let Some(m) = self.masses(unit) {
                (0..SIX).for_each(|i| self.blocks.values()[at + i * 7] = m[i]);
                continue;
            }
            let qm = &self.data.qm[self.data.m_adr[unit.tree]..][..dofs * dofs];
            let block = &mut self.blocks.values()[at..at + n * n];
            for (row, qm) in block.chunks_exact_mut(n).zip(qm.chunks_exact(dofs)) {
                row[..dofs].copy_from_slice(qm);
            }
            (dofs..n).for_each(|i| block[i * n + i] = 1.0);
        }
        for (i, c) in constraints.iter().enumerate() {
            self.add_curvature(c, &self.parts[i].clone());
        }
    }

    /// H += Jᵀ C J of one constraint.
    fn add_curvature(&mut self, c: &Constraint, parts: &Parts) {
        let curvature = c.cone.curvature(&c.x);
        if matches!(curvature, Curvature::Zero) {
            return;
        }
        let dim = c.cone.dim;
        for right in 0..parts.count {
            let part = &parts.parts[right];
            multiply_curvature(&curvature, &self.jac[part.start..][..dim * part.n], dim, part.n, self.product);
            let values = self.blocks.values();
            let own = &self.jac[part.start..][..dim * part.n];
            add_product(&mut values[parts.diagonal[right]..], own, self.product, dim, part.n, part.n);
            if parts.count == 2 && right != parts.first {
                let left = &parts.parts[parts.first];
                let other = &self.jac[left.start..][..dim * left.n];
                add_product(&mut values[parts.off..], other, self.product, dim, left.n, part.n);
            }
        }
    }
}

/// out = C J
fn multiply_curvature(curvature: &Curvature, jac: &[f64], dim: usize, n: usize, out: &mut Vec<f64>) {
    out.clear();
    out.resize(dim * n, 0.0);
    if n == SIX {
        let jac = jac.as_chunks::<SIX>().0;
        for (k, out) in out.as_chunks_mut::<SIX>().0.iter_mut().enumerate() {
            *out = curvature.times(k, jac).unwrap_or_default();
        }
        return;
    }
    let full = curvature.matrix();
    for (out, full) in out.chunks_exact_mut(n).zip(&full) {
        for (row, factor) in jac.chunks_exact(n).zip(full) {
            if *factor != 0.0 {
                out.iter_mut().zip(row).for_each(|(out, j)| *out += factor * j);
            }
        }
    }
}

/// C += Aᵀ B with A dim × ni, B dim × nj.
fn add_product(c: &mut [f64], a: &[f64], b: &[f64], dim: usize, ni: usize, nj: usize) {
    if (ni, nj) == (SIX, SIX) {
        // Free bodies, nearly always: rows of fixed length.
        let (rows, b) = (c[..36].as_chunks_mut::<SIX>().0, b.as_chunks::<SIX>().0);
        for (a, b) in a.as_chunks::<SIX>().0.iter().zip(b) {
            for (row, factor) in rows.iter_mut().zip(a) {
                for (value, b) in row.iter_mut().zip(b) {
                    *value += factor * b;
                }
            }
        }
        return;
    }
    for k in 0..dim {
        for i in 0..ni {
            let factor = a[k * ni + i];
            if factor != 0.0 {
                for j in 0..nj {
                    c[i * nj + j] += factor * b[k * nj + j];
                }
            }
        }
    }
}
