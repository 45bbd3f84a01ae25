//! Contact rows: how a unit force along one direction of a contact moves the trees it touches.
//!
//! Every contact law works on the same picture. A contact has up to six directions (normal, two tangents,
//! spin about the normal, roll about the tangents). Direction k has a row J_k of the contact Jacobian, so that
//!
//!     velocity along k      v_k = J_k · vel
//!     acceleration along k  a_k = J_k · acc          (J̇ qvel is omitted, as in MuJoCo)
//!     a force f along k     acc += M⁻¹ J_kᵀ f
//!
//! Rows come in *sixes*, chunks `[f64; 6]`, so that the loops have a fixed length. A free tree is one six: its
//! twist at the centre of mass, linear part in world axes, angular part in principal axes, in which M is
//! diagonal. An articulated tree of nv degrees of freedom is its `qvel`, padded with zeros to ⌈nv/6⌉ sixes.

use std::ops::Range;

use crate::data::{Contact, Data, Mover};
use crate::dynamics;
use crate::dynamics::spatial::join;
use crate::math::{Vec3, Vec6};
use crate::model::{Model, Tree};

pub type Six = [f64; 6];

#[derive(Clone, Debug, Default)]
pub struct Rows {
    /// Velocity and acceleration of every tree, in sixes; tree t has `sixes[t]`.
    pub vel: Vec<Six>,
    pub acc: Vec<Six>,
    sixes: Vec<Range<u32>>,
    all: Vec<Row>,
    /// One entry per contact or joint row, in the order they were pushed.
    pub contacts: Vec<ContactRows>,
    /// Trees that a contact touches.
    touched: Vec<bool>,
    /// How articulated trees answer to a push on one of their bodies; see [`Response`]. One a dof of the tree, from
    /// `response[body]` on; [`NONE`] where there is none yet.
    responses: Vec<Response>,
    response: Vec<u32>,
    /// Scratch: Jacobian columns of one body, and M⁻¹ Jᵀ.
    columns: Vec<Vec6>,
    answers: Vec<Vec6>,
    dense: Vec<f64>,
}

/// One six of a row.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    /// J
    j: Six,
    /// J M⁻¹
    m: Six,
}

/// What a wrench on a body (N, N m, about the origin of the tree's first body) means to one dof of its tree: the
/// generalized force that it causes there is `force` · wrench, the acceleration `acceleration` · wrench.
#[derive(Clone, Copy, Debug)]
struct Response {
    force: Six,
    acceleration: Six,
}

/// The rows of one contact. The first part belongs to the tree of lower index; the second is empty where the
/// other geom never moves (or moves with the same tree).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactRows {
    pub parts: [Part; 2],
    /// Number of rows: 1, 3, 4 or 6.
    pub dim: usize,
}

/// Where the rows of a contact act on one tree.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Part {
    /// Index of the tree; `NONE` for an empty part.
    pub tree: u32,
    /// First six of row 0 in `all`; row k follows k·len later.
    start: u32,
    /// Sixes per row.
    len: u32,
    /// First six of the tree in `vel` and `acc`.
    at: u32,
}

pub const NONE: u32 = u32::MAX;

const EMPTY: Part = Part { tree: NONE, start: 0, len: 0, at: 0 };

/// a · b, even and odd places apart: two numbers in a register.
#[inline(always)]
pub fn dot(a: &Six, b: &Six) -> f64 {
    (a[0] * b[0] + a[2] * b[2] + a[4] * b[4]) + (a[1] * b[1] + a[3] * b[3] + a[5] * b[5])
}

fn dots<'a>(a: impl Iterator<Item = &'a Six>, b: impl Iterator<Item = &'a Six>) -> f64 {
    a.zip(b).map(|(a, b)| dot(a, b)).sum()
}

impl Part {
    #[inline(always)]
    fn row(&self, k: usize) -> Range<usize> {
        let start = self.start as usize + k * self.len as usize;
        start..start + self.len as usize
    }
    #[inline(always)]
    fn tree_sixes(&self) -> Range<usize> {
        self.at as usize..(self.at + self.len) as usize
    }
}

impl Rows {
    /// Forgets the last step's rows.
    pub fn begin(&mut self, model: &Model) {
        if self.sixes.len() != model.trees.len() {
            self.lay_out(model);
        }
        self.all.clear();
        self.contacts.clear();
        self.touched.fill(false);
        self.responses.clear();
        self.response.fill(NONE);
    }

    fn lay_out(&mut self, model: &Model) {
        let mut next = 0;
        self.sixes.clear();
        for tree in &model.trees {
            let len = tree.dofs.len().div_ceil(6) as u32;
            self.sixes.push(next..next + len);
            next += len;
        }
        self.vel = vec![[0.0; 6]; next as usize];
        self.acc = vec![[0.0; 6]; next as usize];
        self.touched = vec![false; model.trees.len()];
        self.response = vec![NONE; model.bodies.len()];
        let widest = model.trees.iter().map(|t| t.dofs.len()).max().unwrap_or(0);
        self.columns = vec![Vec6::zeros(); widest];
        self.answers = vec![Vec6::zeros(); widest];
        self.dense = vec![0.0; widest];
    }

    /// Reads velocity and smooth acceleration of a tree when its first row comes.
    fn touch(&mut self, t: usize, tree: &Tree, qvel: &[f64], data: &Data) {
        if std::mem::replace(&mut self.touched[t], true) {
            return;
        }
        let at = self.sixes[t].start as usize;
        if tree.free.is_some() {
            let mover = &data.movers[tree.bodies.start];
            self.vel[at] = mover.vel.into();
            self.acc[at] = mover.acc.into();
        } else {
            for (i, dof) in tree.dofs.clone().enumerate() {
                self.vel[at + i / 6][i % 6] = qvel[dof];
                self.acc[at + i / 6][i % 6] = data.qacc_smooth[dof];
            }
        }
    }

    /// Appends the rows of a contact: `dim` directions, the sliding ones taken at `points[side]` on the body of
    /// that side (world, m).
    pub fn push(&mut self, model: &Model, qvel: &[f64], data: &Data, contact: &Contact, dim: usize, points: [Vec3; 2]) {
        let tree_of = |side: usize| model.bodies[contact.body[side] as usize].tree;
        let mut parts = [EMPTY; 2];
        let mut used = 0;
        // The lower tree first; the force acts with + on side 1 and with − on side 0.
        let sides =
            if tree_of(1).is_none() || (tree_of(0).is_some() && tree_of(0) < tree_of(1)) { [0, 1] } else { [1, 0] };
        for side in sides {
            let Some(t) = tree_of(side) else { continue };
            self.touch(t, &model.trees[t], qvel, data);
            let sign = if side == 1 { 1.0 } else { -1.0 };
            if used == 1 && parts[0].tree == t as u32 {
                self.fill(model, data, t, contact, side, sign, dim, points[side], parts[0].start as usize);
                continue;
            }
            let (start, sixes) = (self.all.len(), self.sixes[t].clone());
            parts[used] = Part { tree: t as u32, start: start as u32, len: sixes.len() as u32, at: sixes.start };
            if model.trees[t].free.is_some() {
                let mover = &data.movers[model.trees[t].bodies.start];
                self.all.extend((0..dim).map(|k| free_row(contact, mover, sign, &(points[side] - mover.com), k)));
            } else {
                self.all.resize(start + dim * sixes.len(), Row::default());
                self.fill(model, data, t, contact, side, sign, dim, points[side], start);
            }
            used += 1;
        }
        self.contacts.push(ContactRows { parts, dim });
    }

    /// Adds one side's share of the rows of an articulated tree, which start at six `start`.
    ///
    /// A direction d at a point whose arm is a pushes as the wrench (d, a × d), or (0, d) if it is an angle.
    fn fill(
        &mut self,
        model: &Model,
        data: &Data,
        t: usize,
        contact: &Contact,
        side: usize,
        sign: f64,
        dim: usize,
        point: Vec3,
        start: usize,
    ) {
        let (len, nv) = (self.sixes[t].len(), model.trees[t].dofs.len());
        let first = self.response(model, data, t, contact.body[side] as usize);
        let arm = point - data.xpos[model.trees[t].bodies.start];
        for k in 0..dim {
            let d = contact.frame.row(k % 3).transpose() * sign;
            let wrench = if k < 3 { join(&d, &arm.cross(&d)) } else { join(&Vec3::zeros(), &d) }.into();
            let rows = &mut self.all[start + k * len..][..len];
            for (row, responses) in rows.iter_mut().zip(self.responses[first..][..nv].chunks(6)) {
                for ((j, m), response) in row.j.iter_mut().zip(&mut row.m).zip(responses) {
                    *j += dot(&response.force, &wrench);
                    *m += dot(&response.acceleration, &wrench);
                }
            }
        }
    }

    /// Where the responses of a body begin, which are found when the first contact needs them.
    fn response(&mut self, model: &Model, data: &Data, t: usize, body: usize) -> usize {
        if self.response[body] == NONE {
            let tree = &model.trees[t];
            let (columns, answers) = (&mut self.columns[..tree.dofs.len()], &mut self.answers[..tree.dofs.len()]);
            dynamics::jacobian(model, data, body, &data.xpos[tree.bodies.start], columns);
            answers.copy_from_slice(columns);
            dynamics::solve_m(model, data, t, answers);
            self.response[body] = self.responses.len() as u32;
            let pair = |(j, m): (&Vec6, &Vec6)| Response { force: (*j).into(), acceleration: (*m).into() };
            self.responses.extend(columns.iter().zip(&*answers).map(pair));
        }
        self.response[body] as usize
    }

    /// Appends one row on the dofs of a joint: a limit or dry friction.
    ///
    /// In: `entries` of J from dof `dof` on.
    pub fn push_joint(&mut self, model: &Model, qvel: &[f64], data: &Data, dof: usize, entries: &[f64]) {
        let Some(t) = model.bodies[model.dofs[dof].body].tree else { return };
        let tree = &model.trees[t];
        self.touch(t, tree, qvel, data);
        let len = self.sixes[t].len();
        let start = self.all.len();
        self.all.resize(start + len, Row::default());
        let dense = &mut self.dense[..tree.dofs.len()];
        dense.fill(0.0);
        let at = dof - tree.dofs.start;
        dense[at..at + entries.len()].copy_from_slice(entries);
        let row = &mut self.all[start..];
        dense.iter().enumerate().for_each(|(i, x)| row[i / 6].j[i % 6] = *x);
        dynamics::solve_m(model, data, t, dense);
        dense.iter().enumerate().for_each(|(i, x)| row[i / 6].m[i % 6] = *x);
        let part = Part { tree: t as u32, start: start as u32, len: len as u32, at: self.sixes[t].start };
        self.contacts.push(ContactRows { parts: [part, EMPTY], dim: 1 });
    }

    /// Velocities along all directions of contact c, m/s and rad/s; zero beyond its last.
    #[inline(always)]
    pub fn velocities(&self, c: usize) -> Six {
        let ContactRows { parts, dim } = &self.contacts[c];
        let mut sum = [0.0; 6];
        for part in parts {
            for (k, sum) in sum.iter_mut().enumerate().take(*dim) {
                match part.len {
                    0 => {}
                    1 => *sum += dot(&self.all[part.start as usize + k].j, &self.vel[part.at as usize]),
                    _ => *sum += dots(self.all[part.row(k)].iter().map(|r| &r.j), self.vel[part.tree_sixes()].iter()),
                }
            }
        }
        sum
    }

    /// Accelerations along N directions of contact c, from `first` on, with the forces pushed so far: m/s², rad/s².
    #[inline(always)]
    pub fn accelerations<const N: usize>(&self, c: usize, first: usize) -> [f64; N] {
        // Even and odd places apart: two numbers in a register.
        let mut sum = [[0.0; 2]; N];
        for part in &self.contacts[c].parts {
            match part.len {
                0 => {}
                // A free body: the common case, without a loop over sixes.
                1 => {
                    let (rows, x) = (&self.all[part.start as usize + first..][..N], &self.acc[part.at as usize]);
                    for k in 0..N {
                        for i in 0..6 {
                            sum[k][i % 2] += rows[k].j[i] * x[i];
                        }
                    }
                }
                _ => {
                    for k in 0..N {
                        let row = self.all[part.row(first + k)].iter().map(|r| &r.j);
                        sum[k][0] += dots(row, self.acc[part.tree_sixes()].iter());
                    }
                }
            }
        }
        sum.map(|s| s[0] + s[1])
    }

    /// Whether a tree feels both contacts.
    #[inline(always)]
    pub fn meet(&self, c: usize, e: usize) -> bool {
        let ([a, b], [x, y]) = (self.contacts[c].parts.map(|p| p.tree), self.contacts[e].parts.map(|p| p.tree));
        a == x || a == y || b != NONE && (b == x || b == y)
    }

    /// A_kl = J_k M⁻¹ J_lᵀ between direction k of contact c and direction l of contact e; zero if no tree feels both.
    #[inline(always)]
    pub fn compliance(&self, c: usize, k: usize, e: usize, l: usize) -> f64 {
        let mut sum = 0.0;
        for a in &self.contacts[c].parts {
            for b in self.contacts[e].parts.iter().filter(|b| b.tree == a.tree) {
                sum += self.product(a, k, b, l);
            }
        }
        sum
    }

    /// A_kl of one contact with itself.
    #[inline(always)]
    pub fn own_compliance(&self, c: usize, k: usize, l: usize) -> f64 {
        let [a, b] = &self.contacts[c].parts;
        self.product(a, k, a, l) + self.product(b, k, b, l)
    }

    /// J_k M⁻¹ J_lᵀ of two parts on the same tree.
    #[inline(always)]
    fn product(&self, a: &Part, k: usize, b: &Part, l: usize) -> f64 {
        match a.len {
            0 => 0.0,
            1 => dot(&self.all[a.start as usize + k].j, &self.all[b.start as usize + l].m),
            _ => dots(self.all[a.row(k)].iter().map(|r| &r.j), self.all[b.row(l)].iter().map(|r| &r.m)),
        }
    }

    /// The normal of contact c, divided: its row on tree t, a free body, and J M⁻¹ Jᵀ on the other one, if there is one.
    /// `None` if it does not touch t.
    pub fn split(&self, c: usize, t: u32) -> Option<(Six, f64)> {
        let parts = &self.contacts[c].parts;
        let side = parts.iter().position(|p| p.tree == t)?;
        let other = &parts[1 - side];
        Some((self.all[parts[side].start as usize].j, self.product(other, 0, other, 0)))
    }

    /// Adds forces along the directions of contact c from `first` on: acc += M⁻¹ J_kᵀ f_k.
    #[inline(always)]
    pub fn push_forces(&mut self, c: usize, first: usize, force: &[f64]) {
        for part in &self.contacts[c].parts {
            match part.len {
                0 => {}
                1 => {
                    let rows = &self.all[part.start as usize + first..][..force.len()];
                    let mut acc = self.acc[part.at as usize];
                    for (row, f) in rows.iter().zip(force) {
                        (0..6).for_each(|i| acc[i] += row.m[i] * f);
                    }
                    self.acc[part.at as usize] = acc;
                }
                _ => {
                    for (k, f) in force.iter().enumerate() {
                        let row = &self.all[part.row(first + k)];
                        for (acc, row) in self.acc[part.tree_sixes()].iter_mut().zip(row) {
                            (0..6).for_each(|i| acc[i] += row.m[i] * f);
                        }
                    }
                }
            }
        }
    }

    /// Turns the accelerations of the trees that have rows into `data.qacc`, and the change of acceleration of trees
    /// that are not free bodies into the force behind it:
    ///
    ///     qfrc_constraint = M (qacc − qacc_smooth)
    pub fn finish(&self, model: &Model, data: &mut Data) {
        for (t, tree) in model.trees.iter().enumerate() {
            if !self.touched[t] {
                continue;
            }
            let at = self.sixes[t].start as usize;
            let dofs = tree.dofs.clone();
            if let Some(free) = &tree.free {
                let mover = &data.movers[tree.bodies.start];
                let change = Vec6::from(self.acc[at]) - mover.acc;
                let spin = change.fixed_rows::<3>(3).into_owned();
                let lin =
                    change.fixed_rows::<3>(0) - (mover.axes * spin).cross(&(mover.com - data.xpos[tree.bodies.start]));
                let ang = free.axes * spin;
                for i in 0..3 {
                    data.qacc[dofs.start + i] += lin[i];
                    data.qacc[dofs.start + 3 + i] += ang[i];
                }
            } else {
                for (i, dof) in dofs.clone().enumerate() {
                    data.qacc[dof] = self.acc[at + i / 6][i % 6];
                }
                let inertia = &data.qm[data.m_adr[t]..];
                for (i, dof) in dofs.clone().enumerate() {
                    let row = &inertia[i * dofs.len()..(i + 1) * dofs.len()];
                    let change = dofs.clone().map(|d| data.qacc[d] - data.qacc_smooth[d]);
                    data.qfrc_constraint[dof] = row.iter().zip(change).map(|(m, a)| m * a).sum();
                }
            }
        }
    }
}

/// Row k of a contact on a free body.
///
/// In: `arm` from the centre of mass to the point where the sliding directions are taken, m.
#[inline(always)]
fn free_row(contact: &Contact, mover: &Mover, sign: f64, arm: &Vec3, k: usize) -> Row {
    let d = contact.frame.row(k % 3).transpose() * sign;
    let (lin, ang) =
        if k < 3 { (d, mover.axes.tr_mul(&arm.cross(&d))) } else { (Vec3::zeros(), mover.axes.tr_mul(&d)) };
    let j = [lin.x, lin.y, lin.z, ang.x, ang.y, ang.z];
    Row { j, m: std::array::from_fn(|i| j[i] * mover.minv[i]) }
}

/// Largest eigenvalue of A on the sliding, spinning and rolling rows, as far as there are any.
///
/// In: `a(k, l)` the element of A between rows k and l.
#[inline(always)]
pub fn eigenvalues(dim: usize, a: impl Fn(usize, usize) -> f64) -> [f64; 3] {
    let pair = |k: usize| largest_eigenvalue(a(k, k), a(k + 1, k + 1), a(k, k + 1));
    [if dim >= 3 { pair(1) } else { 0.0 }, if dim >= 4 { a(3, 3) } else { 0.0 }, if dim >= 6 { pair(4) } else { 0.0 }]
}

/// Largest eigenvalue of the symmetric matrix with diagonal `a`, `b` and off-diagonal `off`.
#[inline(always)]
pub fn largest_eigenvalue(a: f64, b: f64, off: f64) -> f64 {
    0.5 * (a + b) + (0.25 * (a - b) * (a - b) + off * off).sqrt()
}
