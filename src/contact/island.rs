//! An island: trees that constraints hold together, and their constraints, assembled for a contact law.
//!
//! Unknowns are the accelerations of the island's trees one after the other, relative to those without constraints and in
//! coordinates of unit mass ([`super::unit_mass`]):
//!
//!     w = Wᵀ f,     J a = J a₀ + W w        W: rows of all constraints; f: their forces

use super::Task;
use super::block_factor::{BlockFactor, Shape};
use super::chains::Chains;
use super::curvature::Curvature;
use super::newton::{Constraint, dot};
use super::rows::{Part, Parts, Row, Rows, SIX, dot_six};
use super::six::Six;
use super::ties;
use super::unit_mass::{self, padded};
use crate::data::{Contact, Data, Mover, Outcome};
use crate::dynamics;
use crate::dynamics::factor::Pattern;
use crate::dynamics::links;
use crate::dynamics::spatial::{ang, join, lin};
use crate::math::Vec3;
use crate::model::Model;

/// One tree of the island.
#[derive(Clone, Copy, Debug)]
pub struct Unit {
    /// Index of the tree.
    pub tree: usize,
    /// Where its unknowns begin in the island's vectors.
    pub at: usize,
    /// Unknowns, with padding.
    pub n: usize,
    /// Degrees of freedom.
    pub dofs: usize,
    /// Where its dofs begin among those of the island, without padding.
    first: usize,
    /// Index of the tree's first body.
    body: usize,
    free: bool,
}

/// What a constraint stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// Index into `data.contacts`.
    Contact(usize),
    /// Index into `data.joint_rows`.
    Joint(usize),
    /// Index into `data.ties`.
    Tie(usize),
}

/// Trees that constraints hold together, and the problem that they pose.
#[derive(Clone, Debug, Default)]
pub struct Island {
    /// Its trees.
    pub units: Vec<Unit>,
    /// What the constraints stand for, one by one.
    pub sources: Vec<Source>,
    /// Its contacts, limits, dry friction and equalities.
    pub constraints: Vec<Constraint>,
    /// The solution w = S (a − a₀): an acceleration in coordinates of unit mass ([`super::unit_mass`]).
    pub w: Vec<f64>,
    /// Gradient of the cost.
    pub gradient: Vec<f64>,
    /// Search direction, a change of w; under `penalty` also what given forces do, Wᵀ f.
    pub p: Vec<f64>,
    /// Velocity: of the mover, or qvel.
    velocity: Vec<f64>,
    /// Acceleration without constraints: of the mover, or qacc_smooth.
    smooth: Vec<f64>,
    /// Inverse of S's diagonal; see [`super::unit_mass`].
    scale: Vec<f64>,
    rows: Rows,
    blocks: BlockFactor,
    /// Instead of blocks, where there are six unknowns.
    six: Six,
    /// In place of rows and blocks, where every constraint acts on one chain of the island's only tree.
    chains: Chains,
    chained: bool,
    /// C of each constraint in H = 1 + Wᵀ C W.
    pub curvatures: Vec<Curvature>,
    /// Unknowns of [`super::penalty::interior`].
    pub interior: Vec<super::penalty::interior::Interior>,
    /// Forces of the constraints that a search may come back to.
    pub kept: Vec<[f64; 6]>,
    /// Whether `blocks` have the structure of this island: a good start needs none.
    analysed: bool,
    /// Vectors over the dofs of one tree, for rows of J and for products.
    on_dofs: Vec<Vec<f64>>,
    product: Vec<f64>,
    columns: Vec<[f64; 6]>,
}

/// Degrees of freedom of a tree up to which its columns of J are on the stack.
const SHORT: usize = 16;

impl Island {
    /// Makes room for all trees in one island, with that many contacts, rows of joints and ties, whose rows have this many
    /// numbers.
    pub fn reserve(
        &mut self,
        model: &Model,
        pattern: &Pattern,
        contacts: usize,
        joints: usize,
        ties: usize,
        numbers: usize,
    ) {
        let widths = || model.trees.iter().map(|t| padded(t.dofs.len()));
        let (size, widest) = (widths().sum(), widths().max().unwrap_or(0));
        let constraints = contacts + joints + ties;
        self.units.reserve(model.trees.len());
        self.constraints.reserve(constraints);
        self.sources.reserve(constraints);
        self.interior.reserve(constraints);
        self.kept.reserve(constraints);
        self.curvatures.reserve(constraints);
        self.chains.reserve(contacts + joints, (contacts + joints) * widest, model.requires.condim, pattern);
        self.rows.reserve(constraints, (contacts * model.requires.condim * 2 + joints) * widest + numbers, widest);
        let Island { w, gradient, p, velocity, smooth, scale, .. } = self;
        for vector in [w, gradient, p, velocity, smooth, scale] {
            vector.reserve(size);
        }
        self.columns.reserve(widest);
        self.on_dofs.resize(2, Vec::new());
        self.on_dofs.iter_mut().for_each(|v| v.reserve(6 * widest));
        self.blocks.reserve(model.trees.len(), size);
    }

    /// Empties it.
    ///
    /// In: whether every constraint that follows acts on one chain of the one tree that follows, which is no free body.
    pub fn reset(&mut self, chained: bool) {
        let Island { units, sources, velocity, smooth, scale, .. } = self;
        units.clear();
        sources.clear();
        for vector in [velocity, smooth, scale] {
            vector.clear();
        }
        self.rows.reset();
        self.chains.reset();
        self.chained = chained;
        self.analysed = false;
    }

    /// Adds a tree with its velocity and its acceleration without constraints; returns its number in the island.
    ///
    /// Reads: movers, qacc_smooth, qld, qvel.
    pub fn add_tree(&mut self, model: &Model, data: &Data, qvel: &[f64], tree: usize) -> usize {
        let t = &model.trees[tree];
        let (at, dofs, body) = (self.velocity.len(), t.dofs.len(), t.bodies.start);
        let n = padded(dofs);
        let first = self.units.last().map_or(0, |u| u.first + u.dofs);
        self.units.push(Unit { tree, at, n, dofs, first, body, free: t.free.is_some() });
        let Island { velocity, smooth, scale, .. } = self;
        if t.free.is_some() {
            let mover = &data.movers[body];
            velocity.extend_from_slice(mover.vel.as_slice());
            smooth.extend_from_slice(mover.acc.as_slice());
            scale.extend(mover.minv.iter().map(|m| m.sqrt()));
        } else {
            velocity.extend_from_slice(&qvel[t.dofs.clone()]);
            smooth.extend_from_slice(&data.qacc_smooth[t.dofs.clone()]);
            unit_mass::scale(data, t, scale);
            velocity.resize(at + n, 0.0);
            smooth.resize(at + n, 0.0);
            scale.resize(at + n, 1.0);
        }
        self.units.len() - 1
    }

    /// Gives all vectors their length. Comes after the trees.
    pub fn start(&mut self) {
        let size = self.velocity.len();
        for vector in [&mut self.w, &mut self.gradient, &mut self.p] {
            vector.resize(size, 0.0);
        }
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
        if self.chained {
            self.add_chain(model, data, index, dim, units, points);
            return;
        }
        let contact = &data.contacts[index];
        let mut parts = Parts::new(dim);
        let (mut velocity, mut smooth) = ([0.0; 6], [0.0; 6]);
        for (side, sign) in [(0, -1.0), (1, 1.0)] {
            let Some(unit) = units[side] else { continue };
            let Unit { at, n, body, free, .. } = self.units[unit];
            if free {
                let part = self.rows.room(unit, at, n, dim);
                let rows = self.rows.of_mut(&part, dim).as_chunks_mut::<SIX>().0;
                free_rows(contact, &data.movers[body], sign, &points[side], rows);
                let six = |v: &[f64]| v[at..].first_chunk::<SIX>().copied().unwrap_or_default();
                let [v, a, scale] = [six(&self.velocity), six(&self.smooth), six(&self.scale)];
                for ((row, velocity), smooth) in rows.iter_mut().zip(&mut velocity).zip(&mut smooth) {
                    *velocity += dot_six(row, &v);
                    *smooth += dot_six(row, &a);
                    (0..SIX).for_each(|i| row[i] *= scale[i]);
                }
                parts.push(part);
                continue;
            }
            if parts.list().first().is_some_and(|part| part.unit == unit) {
                // Both bodies belong to the same tree: one set of rows, their difference.
                continue;
            }
            let part = self.rows.room(unit, at, n, dim);
            let both = side == 0 && units[1] == Some(unit);
            let sides = [(side, sign, points[side]), (1, 1.0, points[1])];
            let sides = &sides[..1 + usize::from(both)];
            if dim <= 3 {
                self.add_tree_rows::<3>(model, data, contact, sides, &part, dim, &mut velocity, &mut smooth);
            } else {
                self.add_tree_rows::<6>(model, data, contact, sides, &part, dim, &mut velocity, &mut smooth);
            }
            parts.push(part);
        }
        self.push(Source::Contact(index), parts, dim, velocity, smooth);
    }

    /// Adds a row of a tree's dofs: a joint limit or dry friction.
    pub fn add_joint_row(&mut self, model: &Model, data: &Data, index: usize, unit: usize) {
        let row = &data.joint_rows[index];
        if self.chained {
            self.add_joint_chain(model, data, index);
            return;
        }
        let Unit { tree, at, n, .. } = self.units[unit];
        let (part, tree) = (self.rows.room(unit, at, n, 1), &model.trees[tree]);
        let jac = self.rows.of_mut(&part, 1);
        match &tree.free {
            Some(free) => {
                jac.copy_from_slice(&unit_mass::row_of_mover(free, tree, data, row.dof, &row.entries[..row.n]))
            }
            None => {
                jac.fill(0.0);
                jac[row.dof - tree.dofs.start..][..row.n].copy_from_slice(&row.entries[..row.n]);
            }
        }
        let place = at..at + n;
        let (jac, scale) = (self.rows.of_mut(&part, 1), &self.scale[place.clone()]);
        let product = |v: &[f64]| jac.iter().zip(v).map(|(j, v)| j * v).sum::<f64>();
        let one = |x: f64| [x, 0.0, 0.0, 0.0, 0.0, 0.0];
        let (velocity, smooth) = (one(product(&self.velocity[place.clone()])), one(product(&self.smooth[place])));
        if tree.free.is_none() {
            let (columns, _) = jac.as_chunks_mut::<1>();
            data.plan.pattern.reduce(&tree.dofs, &data.qld, columns);
        }
        jac.iter_mut().zip(scale).for_each(|(j, s)| *j *= s);
        let mut parts = Parts::new(1);
        parts.push(part);
        self.push(Source::Joint(index), parts, 1, velocity, smooth);
    }

    /// Adds the rows of a tie: an equality, or a limit or the dry friction of a tendon.
    ///
    /// In: `unit` the island's number of a tree.
    pub fn add_tie(&mut self, model: &Model, data: &Data, index: usize, unit: impl Fn(usize) -> usize) {
        let tie = &data.ties[index];
        let (blocks, numbers) = ties::rows(data, tie);
        let mut parts = Parts::new(tie.dim);
        let (mut velocity, mut smooth) = ([0.0; 6], [0.0; 6]);
        for block in blocks {
            let unit = unit(block.tree);
            let Unit { at, n, dofs, .. } = self.units[unit];
            let (part, tree) = (self.rows.room(unit, at, n, tie.dim), &model.trees[block.tree]);
            let written = numbers[block.at..].chunks_exact(dofs);
            for (k, (row, own)) in self.rows.of_mut(&part, tie.dim).chunks_exact_mut(n).zip(written).enumerate() {
                match &tree.free {
                    Some(free) => {
                        row.copy_from_slice(&unit_mass::row_of_mover(free, tree, data, block.dofs.start, own));
                    }
                    None => {
                        row[..dofs].copy_from_slice(own);
                        row[dofs..].fill(0.0);
                    }
                }
                row.iter_mut().for_each(|j| *j *= tie.sign);
                let product = |v: &[f64]| row.iter().zip(v).map(|(j, v)| j * v).sum::<f64>();
                velocity[k] += product(&self.velocity[at..at + n]);
                smooth[k] += product(&self.smooth[at..at + n]);
                if tree.free.is_none() {
                    data.plan.pattern.reduce(&tree.dofs, &data.qld, row.as_chunks_mut::<1>().0);
                }
                row.iter_mut().zip(&self.scale[at..at + n]).for_each(|(j, s)| *j *= s);
            }
            if parts.is_full() {
                self.rows.push_more(&mut parts, part);
            } else {
                parts.push(part);
            }
        }
        self.push(Source::Tie(index), parts, tie.dim, velocity, smooth);
    }

    /// Writes the rows of a contact on a tree that is not a free body, for one side or for both, and adds J v and J a₀: D
    /// rows side by side, dof by dof between the body and the root.
    fn add_tree_rows<const D: usize>(
        &mut self,
        model: &Model,
        data: &Data,
        contact: &Contact,
        sides: &[(usize, f64, Vec3)],
        part: &Part,
        dim: usize,
        velocity: &mut [f64; 6],
        smooth: &mut [f64; 6],
    ) {
        let Unit { tree, dofs, body: root, .. } = self.units[part.unit];
        let tree = &model.trees[tree];
        let mut columns = [[0.0; D]; SHORT];
        self.columns.clear();
        let columns = match columns.get_mut(..dofs) {
            Some(columns) => columns,
            None => {
                self.columns.resize(dofs, [0.0; 6]);
                let long = self.columns.as_flattened_mut();
                &mut long.as_chunks_mut::<D>().0[..dofs]
            }
        };
        for &(side, sign, point) in sides {
            let (arm, frame) = (point - data.xpos[root], contact.frame * sign);
            let mut dof = dynamics::last_dof(model, contact.body[side] as usize);
            while dof != links::NONE {
                let (twist, column) = (&data.cdof[dof], &mut columns[dof - tree.dofs.start]);
                let along = frame * (lin(twist) + ang(twist).cross(&arm));
                (0..3).for_each(|k| column[k] += along[k]);
                if D > 3 {
                    let about = frame * ang(twist);
                    (3..D).for_each(|k| column[k] += about[k - 3]);
                }
                dof = data.plan.dof_parent[dof];
            }
        }
        let vectors = self.velocity[part.at..].iter().zip(&self.smooth[part.at..]);
        for (column, (v, a)) in columns.iter().zip(vectors).filter(|(column, _)| **column != [0.0; D]) {
            for k in 0..D.min(dim) {
                velocity[k] += column[k] * v;
                smooth[k] += column[k] * a;
            }
        }
        data.plan.pattern.reduce(&tree.dofs, &data.qld, columns);
        let rows = self.rows.of_mut(part, dim);
        rows.fill(0.0);
        for (dof, (column, scale)) in columns.iter().zip(&self.scale[part.at..]).enumerate() {
            if *column != [0.0; D] {
                (0..D.min(dim)).for_each(|k| rows[k * part.n + dof] = column[k] * scale);
            }
        }
    }

    /// [`Island::add_contact`] where every constraint acts on one chain.
    ///
    ///     J_k,j = [n_k, r × n_k] · S_j,   [0, n_k] · S_j for k ≥ 3      S_j: twist of dof j, r: from its origin
    fn add_chain(
        &mut self,
        model: &Model,
        data: &Data,
        index: usize,
        dim: usize,
        units: [Option<usize>; 2],
        points: [Vec3; 2],
    ) {
        let contact = &data.contacts[index];
        let (side, sign) = if units[0].is_some() { (0, -1.0) } else { (1, 1.0) };
        let Unit { tree, body: root, .. } = self.units[0];
        let dofs = &model.trees[tree].dofs;
        let way = data.plan.pattern.way(dynamics::last_dof(model, contact.body[side] as usize));
        let arm = points[side] - data.xpos[root];
        let wrench = |k: usize| {
            let along = contact.frame.row(k % 3).transpose() * sign;
            if k < 3 { join(&along, &arm.cross(&along)) } else { join(&Vec3::zeros(), &along) }
        };
        let Island { chains, velocity: v, smooth: a, scale, .. } = self;
        let [velocity, smooth] = if let Some(plane) = &data.plan.planes[tree] {
            let wrenches: [_; 6] = std::array::from_fn(|k| if k < dim { plane.twist(&wrench(k)) } else { [0.0; 3] });
            let axes = &data.planar.axes[dofs.clone()];
            chains.push(way, &wrenches[..dim], |j| &axes[j], v, a)
        } else {
            let wrenches: [_; 6] = std::array::from_fn(|k| if k < dim { wrench(k).into() } else { [0.0; 6] });
            let twists = &data.cdof[dofs.clone()];
            chains.push(way, &wrenches[..dim], |j| &twists[j].data.0[0], v, a)
        };
        chains.scale_last(&data.qld, scale);
        self.push_constraint(Source::Contact(index), dim, velocity, smooth);
    }

    /// [`Island::add_joint_row`] likewise.
    fn add_joint_chain(&mut self, model: &Model, data: &Data, index: usize) {
        let row = &data.joint_rows[index];
        let dofs = &model.trees[self.units[0].tree].dofs;
        self.chains.push_joint(data.plan.pattern.way(row.dof + row.n - 1), &row.entries[..row.n]);
        let place = row.dof - dofs.start..row.dof - dofs.start + row.n;
        let product = |v: &[f64]| [dot(&row.entries, &v[place.clone()]), 0.0, 0.0, 0.0, 0.0, 0.0];
        let (velocity, smooth) = (product(&self.velocity), product(&self.smooth));
        self.chains.scale_last(&data.qld, &self.scale);
        self.push_constraint(Source::Joint(index), 1, velocity, smooth);
    }

    fn push(&mut self, source: Source, parts: Parts, dim: usize, velocity: [f64; 6], smooth: [f64; 6]) {
        self.push_constraint(source, dim, velocity, smooth);
        self.rows.push(parts);
    }

    fn push_constraint(&mut self, source: Source, dim: usize, velocity: [f64; 6], smooth: [f64; 6]) {
        let i = self.sources.len();
        if self.constraints.len() == i {
            self.constraints.push(Constraint::default());
        }
        let c = &mut self.constraints[i];
        (c.cone.dim, c.cone.frozen, c.zone, c.velocity, c.smooth) = (dim, 0, 0, velocity, smooth);
        self.sources.push(source);
    }

    /// Comes after all constraints: what is left over from a larger island goes. (What an island of the same size left is
    /// overwritten number by number, which is quicker than to make it anew.)
    pub fn finish_assembly(&mut self) {
        self.constraints.truncate(self.sources.len());
    }

    /// Number of scalar rows.
    pub fn row_count(&self) -> usize {
        self.constraints.iter().map(|c| c.cone.dim).sum()
    }

    /// J M⁻¹ Jᵀ of the row e₀ J₀ + e₁ J₁ of constraint i, 1/kg.
    pub fn inverse_mass(&self, i: usize, e: [f64; 2]) -> f64 {
        let dim = self.constraints[i].cone.dim;
        if self.chained {
            return self.chains.square(i, e);
        }
        let of_part = |part: &Part| {
            let (first, rest) = self.rows.of(part, dim).split_at(part.n);
            let second = rest.iter().copied().chain(std::iter::repeat(0.0));
            first.iter().zip(second).map(|(a, b)| (e[0] * a + e[1] * b).powi(2)).sum::<f64>()
        };
        self.rows.parts(i).map(of_part).sum()
    }

    /// J M⁻¹ Jᵀ of row k of constraint i, 1/kg.
    pub fn inverse_mass_of_row(&self, i: usize, k: usize) -> f64 {
        if self.chained {
            return self.chains.squares(i)[k];
        }
        let dim = self.constraints[i].cone.dim;
        let square = |part: &Part| self.rows.of(part, dim)[k * part.n..][..part.n].iter().map(|x| x * x).sum::<f64>();
        self.rows.parts(i).map(square).sum()
    }

    /// J M⁻¹ Jᵀ of each row of constraint i, 1/kg and 1/(kg m²).
    pub fn inverse_masses(&self, i: usize) -> [f64; 6] {
        if self.chained {
            return self.chains.squares(i);
        }
        let dim = self.constraints[i].cone.dim;
        let mut sum = [0.0; 6];
        for part in self.rows.parts(i) {
            let rows = self.rows.of(part, dim);
            if part.n == SIX {
                let rows = rows.as_chunks::<SIX>().0;
                sum.iter_mut().zip(rows).for_each(|(sum, row)| *sum += dot_six(row, row));
            } else {
                sum.iter_mut().zip(rows.chunks_exact(part.n)).for_each(|(sum, row)| *sum += dot(row, row));
            }
        }
        sum
    }

    /// J M⁻¹ Jᵀ among the rows of constraint i, 1/kg. Not where constraints act on chains.
    pub fn block(&self, i: usize) -> [[f64; 6]; 6] {
        let dim = self.constraints[i].cone.dim;
        let mut block = [[0.0; 6]; 6];
        for part in self.rows.parts(i) {
            let row = |k: usize| &self.rows.of(part, dim)[k * part.n..][..part.n];
            (0..dim).for_each(|k| (0..dim).for_each(|l| block[k][l] += dot(row(k), row(l))));
        }
        block
    }

    /// x = J a − a_ref of constraint i at w. Not where constraints act on chains.
    pub fn acceleration(&self, i: usize) -> [f64; 6] {
        self.constraints[i].at(self.rows.products_of(i, &self.w))
    }

    /// w += Wᵀ f of constraint i alone. Not where constraints act on chains.
    pub fn push_change(&mut self, i: usize, force: &[f64; 6]) {
        let Island { rows, constraints, w, .. } = self;
        let dim = constraints[i].cone.dim;
        for part in rows.parts(i) {
            let (numbers, w) = (rows.of(part, dim), &mut w[part.at..][..part.n]);
            for (row, f) in numbers.chunks_exact(part.n).zip(force).filter(|(_, f)| **f != 0.0) {
                w.iter_mut().zip(row).for_each(|(w, row)| *w += f * row);
            }
        }
    }

    /// Reads a guess of qacc into w.
    pub fn guess(&mut self, model: &Model, data: &Data, qacc: &[f64]) {
        for unit in &self.units {
            let (tree, place) = (&model.trees[unit.tree], unit.at..unit.at + unit.n);
            let (scale, smooth) = (&self.scale[place.clone()], &self.smooth[place.clone()]);
            let w = &mut self.w[place];
            w[unit.dofs..].fill(0.0);
            unit_mass::of_qacc(data, unit.tree, tree, scale, smooth, &qacc[tree.dofs.clone()], w);
        }
    }

    /// w = Wᵀ f: lets the forces that the constraints have act. All that a law of springs and dampers has to do.
    pub fn push_forces(&mut self) -> Outcome {
        let Island { rows, chains, chained, constraints, w, .. } = self;
        add_forces(rows, chains, *chained, constraints.iter().map(|c| &c.force), w);
        Outcome::default()
    }

    /// gradient = w − Wᵀ f
    pub fn take_gradient(&mut self) {
        let Island { gradient, rows, chains, chained, constraints, w, .. } = self;
        add_forces(rows, chains, *chained, constraints.iter().map(|c| &c.force), gradient);
        gradient.iter_mut().zip(w).for_each(|(g, w)| *g = *w - *g);
    }

    /// W w, handed out constraint by constraint.
    #[inline]
    pub fn multiply_w(&mut self, mut take: impl FnMut(&mut Constraint, [f64; 6])) {
        let Island { rows, chains, chained, constraints, w, .. } = self;
        multiply(rows, chains, *chained, w, |i, product| take(&mut constraints[i], product));
    }

    /// W p, handed out constraint by constraint.
    #[inline]
    pub fn multiply_p(&mut self, mut take: impl FnMut(&mut Constraint, &Curvature, [f64; 6])) {
        let Island { rows, chains, chained, constraints, p, curvatures, .. } = self;
        multiply(rows, chains, *chained, p, |i, product| {
            take(&mut constraints[i], curvatures.get(i).unwrap_or(&Curvature::Zero), product)
        });
    }

    /// p = Wᵀ of something that each constraint has, such as its force.
    #[inline]
    pub fn add_to_p(&mut self, of: impl Fn(&Constraint) -> &[f64; 6]) {
        let Island { rows, chains, chained, constraints, p, .. } = self;
        add_forces(rows, chains, *chained, constraints.iter().map(of), p);
    }

    /// Keeps forces of the constraints: those that they have, or have had.
    pub fn keep(&mut self, of: impl Fn(&Constraint) -> [f64; 6]) {
        self.kept.clear();
        self.kept.extend(self.constraints.iter().map(of));
    }

    /// Gives the constraints the forces that were kept last.
    pub fn take_kept(&mut self) {
        self.constraints.iter_mut().zip(&self.kept).for_each(|(c, kept)| c.force = *kept);
    }

    /// Factors H = 1 + Wᵀ C W.
    pub fn factor(&mut self, task: &Task, shape: Shape) {
        let Island { units, rows, chains, chained, blocks, six, analysed, curvatures, p, .. } = self;
        if *chained {
            chains.factor(&task.data.plan.pattern, &task.model.trees[units[0].tree].dofs, curvatures, shape);
            return;
        }
        if p.len() == SIX {
            rows.fill_six(curvatures, six, shape);
            six.factor(shape);
            return;
        }
        if !*analysed {
            rows.analyse(blocks, units.iter().map(|u| u.n));
            *analysed = true;
        }
        rows.fill(curvatures, blocks, shape);
        blocks.factor();
    }

    /// p ← H⁻¹ p
    pub fn divide_p(&mut self, task: &Task) {
        let Island { units, chains, chained, blocks, six, p, .. } = self;
        if *chained {
            chains.divide(&task.data.plan.pattern, &task.model.trees[units[0].tree].dofs, p);
            return;
        }
        match <&mut Row>::try_from(&mut p[..]) {
            Ok(p) => six.divide(p),
            Err(_) => blocks.divide(p),
        }
    }

    /// Trace of M, over which MuJoCo takes the gradient to compare it with its tolerance.
    pub fn trace(&self, model: &Model, data: &Data) -> f64 {
        let of_unit = |unit: &Unit| {
            if unit.free {
                return self.scale[unit.at..][..SIX].iter().map(|s| 1.0 / (s * s)).sum();
            }
            let rows = data.plan.pattern.rows(&model.trees[unit.tree].dofs);
            rows.iter().map(|row| data.qm_rows[row.diagonal()]).sum::<f64>()
        };
        self.units.iter().map(of_unit).sum()
    }

    /// The same with free bodies' M about their origins, as MuJoCo has it: 2 m c² more than about the centre of mass.
    pub fn trace_at_origin(&self, model: &Model, data: &Data) -> f64 {
        let free = |unit: &Unit| model.trees[unit.tree].free.as_ref();
        let more = self.units.iter().filter_map(free).map(|free| 2.0 * free.mass * free.com.norm_squared());
        self.trace(model, data) + more.sum::<f64>()
    }

    /// Row k of J of constraint i over all dofs (nv). Not where constraints act on chains.
    pub fn row_of_dofs(&self, model: &Model, data: &Data, i: usize, k: usize) -> Vec<f64> {
        let mut out = vec![0.0; model.nv];
        for part in self.rows.parts(i) {
            let (tree, row) = (&model.trees[self.units[part.unit].tree], self.rows.of(part, k + 1));
            let scale = &self.scale[part.at..][..part.n];
            unit_mass::on_dofs(data, tree, scale, &row[k * part.n..], &mut out[tree.dofs.clone()]);
        }
        out
    }

    /// Adds `factor` Jᵀ F J to the island's matrix over its trees' dofs (row-major, no padding). Not where constraints act on
    /// chains.
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
        let (mut rows, mut product) = (std::mem::take(&mut self.on_dofs), std::mem::take(&mut self.product));
        for (i, slope) in slopes.iter().enumerate() {
            let dim = self.constraints[i].cone.dim;
            let count = self.rows.parts(i).count();
            if rows.len() < count {
                rows.resize(count, Vec::new());
            }
            for (part, out) in self.rows.parts(i).zip(&mut rows) {
                let Unit { tree, dofs, .. } = self.units[part.unit];
                out.resize(dim * dofs, 0.0);
                let scale = &self.scale[part.at..][..part.n];
                for (row, out) in self.rows.of(part, dim).chunks_exact(part.n).zip(out.chunks_exact_mut(dofs)) {
                    unit_mass::on_dofs(data, &model.trees[tree], scale, row, out);
                }
            }
            for (right, right_rows) in self.rows.parts(i).zip(&rows) {
                let Unit { first: column, dofs: width, .. } = self.units[right.unit];
                // F J
                product.clear();
                product.resize(dim * width, 0.0);
                for k in 0..dim {
                    for l in (0..dim).filter(|&l| slope[k][l] != 0.0) {
                        let (out, row) = (&mut product[k * width..][..width], &right_rows[l * width..][..width]);
                        out.iter_mut().zip(row).for_each(|(out, j)| *out += factor * slope[k][l] * j);
                    }
                }
                for (left, left_rows) in self.rows.parts(i).zip(&rows) {
                    let Unit { first, dofs: height, .. } = self.units[left.unit];
                    for k in 0..dim {
                        for (i, j) in left_rows[k * height..][..height].iter().enumerate().filter(|(_, j)| **j != 0.0) {
                            let out = &mut matrix[(first + i) * n + column..][..width];
                            out.iter_mut().zip(&product[k * width..]).for_each(|(out, p)| *out += j * p);
                        }
                    }
                }
            }
        }
        (self.on_dofs, self.product) = (rows, product);
    }

    /// Puts accelerations and forces where they belong.
    ///
    /// Writes: qacc and qfrc_constraint of the island's trees, forces of its contacts and joint rows.
    pub fn finish(&mut self, model: &Model, data: &mut Data) {
        for unit in &self.units {
            let place = unit.at..unit.at + unit.n;
            let Island { scale, smooth, w, .. } = &*self;
            unit_mass::finish(model, data, unit.tree, &scale[place.clone()], &smooth[place.clone()], &w[place]);
        }
        for (c, source) in self.constraints.iter().zip(&self.sources) {
            match *source {
                Source::Contact(i) => {
                    let force = &mut data.contacts[i].force;
                    *force = c.force;
                    force[c.cone.dim..].fill(0.0);
                }
                Source::Joint(i) => data.joint_rows[i].force = c.force[0],
                Source::Tie(i) => {
                    let force = &mut data.ties[i].force;
                    *force = c.force;
                    force[c.cone.dim..].fill(0.0);
                }
            }
        }
    }
}

/// w = Wᵀ f
#[inline]
fn add_forces<'a>(
    rows: &Rows,
    chains: &Chains,
    chained: bool,
    forces: impl Iterator<Item = &'a [f64; 6]>,
    w: &mut [f64],
) {
    w.fill(0.0);
    if chained { chains.add_forces(forces, w) } else { rows.add_forces(forces, w) }
}

/// W v, handed out constraint by constraint.
#[inline]
fn multiply(rows: &Rows, chains: &Chains, chained: bool, v: &[f64], take: impl FnMut(usize, [f64; 6])) {
    if chained { chains.multiply(v, take) } else { rows.multiply(v, take) }
}

/// Rows of J of a contact for one side that is a free body, in the coordinates of its mover.
///
///     J₀..₂ = ± [n, Aᵀr × Aᵀn],   J₃..₅ = ± [0, Aᵀn]      with n the rows of the frame, r from the COM, A the axes
///
/// In: `sign` −1 for the body of geom 0, +1 for that of geom 1.
#[inline]
fn free_rows(contact: &Contact, mover: &Mover, sign: f64, point: &Vec3, jac: &mut [Row]) {
    let lever = mover.axes.tr_mul(&(point - mover.com));
    let frame = contact.frame * sign;
    let turned = frame * mover.axes;
    let dim = jac.len();
    for (k, row) in jac.iter_mut().enumerate().take(3) {
        let (n, turn) = (frame.row(k), lever.cross(&turned.row(k).transpose()));
        *row = [n[0], n[1], n[2], turn.x, turn.y, turn.z];
    }
    for k in 3..dim {
        let turn = turned.row(k - 3);
        jac[k] = [0.0, 0.0, 0.0, turn[0], turn[1], turn[2]];
    }
}
