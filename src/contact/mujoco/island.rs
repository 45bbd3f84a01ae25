//! Trees that constraints hold together, solved as one problem with sparse blocks.
//!
//! Unknowns are the accelerations of the island's trees one after the other: six in the coordinates of its mover
//! for a free body, qacc for any other tree.

use super::blocks::Blocks;
use super::cone::Curvature;
use super::rows::{self, DofRow, Recipe};
use super::solver::{self, Constraint, Into, Outcome, Space, Stop, Vectors};
use crate::data::{Contact, Data};
use crate::dynamics;
use crate::math::Vec6;
use crate::model::Model;

/// One tree of the island.
#[derive(Clone, Copy, Debug)]
pub struct Unit {
    pub tree: usize,
    /// Place in the island's vectors, and number of unknowns.
    pub at: usize,
    pub n: usize,
}

/// The part of a constraint's rows that belongs to one tree: `dim` rows of `n` numbers.
#[derive(Clone, Copy, Debug, Default)]
struct Part {
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

#[derive(Clone, Debug, Default)]
pub struct Island {
    pub units: Vec<Unit>,
    pub constraints: Vec<Constraint>,
    pub vectors: Vectors<Vec<f64>>,
    parts: Vec<Parts>,
    /// Numbers of all rows; those from `used` on are left over from larger islands.
    jac: Vec<f64>,
    used: usize,
    blocks: Blocks,
    /// Twists of a point per dof of a tree.
    columns: Vec<Vec6>,
    /// C J of one constraint.
    product: Vec<f64>,
}

impl Island {
    /// Makes room for all trees in one island, with that many contacts and rows of joints.
    pub fn reserve(&mut self, model: &Model, contacts: usize, joints: usize) {
        let trees = model.trees.len();
        let widest = model.trees.iter().map(|t| t.dofs.len()).max().unwrap_or(0);
        let constraints = contacts + joints;
        self.units.reserve(trees);
        self.constraints.reserve(constraints);
        self.parts.reserve(constraints);
        self.jac.reserve((contacts * model.plan.condim * 2 + joints) * widest);
        self.columns.reserve(widest);
        self.product.reserve(6 * widest);
        let v = &mut self.vectors;
        for vector in [&mut v.smooth, &mut v.a, &mut v.pull, &mut v.gradient, &mut v.p, &mut v.mp] {
            vector.reserve(model.nv);
        }
        self.blocks.reserve(trees, model.nv);
    }

    pub fn reset(&mut self) {
        self.units.clear();
        self.constraints.clear();
        self.parts.clear();
        self.used = 0;
    }

    /// Room for the rows of a part, with whatever numbers were there.
    fn part(&mut self, unit: usize, rows: usize) -> Part {
        let Unit { at, n, .. } = self.units[unit];
        let start = self.used;
        self.used += rows * n;
        if self.jac.len() < self.used {
            self.jac.resize(self.used, 0.0);
        }
        Part { unit, at, n, start }
    }

    /// Adds a tree; returns its number in the island.
    pub fn add_tree(&mut self, model: &Model, tree: usize) -> usize {
        let at = self.units.last().map_or(0, |u| u.at + u.n);
        self.units.push(Unit { tree, at, n: model.trees[tree].dofs.len() });
        self.units.len() - 1
    }

    /// Gives all vectors their length and reads a₀ and the start.
    ///
    /// Reads: `data.movers`, `data.qacc_smooth`, `warm` (nv).
    pub fn start(&mut self, model: &Model, data: &Data, warm: &[f64]) {
        let v = &mut self.vectors;
        let size = self.units.last().map_or(0, |u| u.at + u.n);
        for vector in [&mut v.smooth, &mut v.a, &mut v.pull, &mut v.gradient, &mut v.p, &mut v.mp] {
            vector.resize(size, 0.0);
        }
        for unit in &self.units {
            let tree = &model.trees[unit.tree];
            let (smooth, a) = (&mut v.smooth[unit.at..][..unit.n], &mut v.a[unit.at..][..unit.n]);
            let warm = &warm[tree.dofs.clone()];
            if let Some(free) = &tree.free {
                let body = tree.bodies.start;
                smooth.copy_from_slice(data.movers[body].acc.as_slice());
                a.copy_from_slice(&super::to_mover(free, &data.movers[body], &data.xpos[body], warm));
            } else {
                smooth.copy_from_slice(&data.qacc_smooth[tree.dofs.clone()]);
                a.copy_from_slice(warm);
            }
        }
    }

    /// Adds the rows of a contact; `units` are the island's numbers of the trees of its two bodies.
    pub fn add_contact(
        &mut self,
        model: &Model,
        data: &Data,
        qvel: &[f64],
        contact: &Contact,
        recipe: &Recipe,
        units: [Option<usize>; 2],
    ) {
        let dim = recipe.dim();
        let mut parts = Parts::default();
        for (side, sign) in [(0, -1.0), (1, 1.0)] {
            let Some(unit) = units[side] else { continue };
            if parts.count == 1 && parts.parts[0].unit == unit {
                // Both bodies belong to the same tree: one set of rows, their difference.
                self.add_tree_rows(model, data, contact, side, sign, parts.parts[0], dim);
                continue;
            }
            let part = self.part(unit, dim);
            let tree = &model.trees[self.units[unit].tree];
            let jac = &mut self.jac[part.start..self.used];
            if tree.free.is_some() {
                rows::free_rows(contact, &data.movers[tree.bodies.start], sign, jac.as_chunks_mut::<6>().0);
            } else {
                jac.fill(0.0);
                self.add_tree_rows(model, data, contact, side, sign, part, dim);
            }
            parts.parts[parts.count] = part;
            parts.count += 1;
        }
        let v = self.products(&parts, dim, |tree| match &model.trees[tree].free {
            Some(_) => data.movers[model.trees[tree].bodies.start].vel.as_slice(),
            None => &qvel[model.trees[tree].dofs.clone()],
        });
        let inverse = if model.opt.flags.diagexact {
            let mut room = std::mem::take(&mut self.product);
            let inverse = recipe.exact(|e| self.exact_inverse(model, data, &parts, e, &mut room));
            self.product = room;
            inverse
        } else {
            rows::inverse_mass(model, contact)
        };
        let mut constraint = Constraint::default();
        recipe.fill(contact.dist, inverse, &v, &mut constraint);
        recipe.switch_on(contact.dist, &mut constraint, || {
            self.products(&parts, dim, |tree| match &model.trees[tree].free {
                Some(_) => data.movers[model.trees[tree].bodies.start].acc.as_slice(),
                None => &data.qacc_smooth[model.trees[tree].dofs.clone()],
            })
        });
        self.constraints.push(constraint);
        self.parts.push(parts);
    }

    /// Velocities or accelerations of a contact's rows, those of each tree given.
    fn products<'a>(&self, parts: &Parts, dim: usize, of_tree: impl Fn(usize) -> &'a [f64]) -> [f64; 6] {
        let mut sum = [0.0; 6];
        for part in &parts.parts[..parts.count] {
            let x = of_tree(self.units[part.unit].tree);
            for k in 0..dim {
                sum[k] += dot(self.row(part, k), x);
            }
        }
        sum
    }

    /// Adds ± frame · J of one side's body to the rows of a part.
    fn add_tree_rows(
        &mut self,
        model: &Model,
        data: &Data,
        contact: &Contact,
        side: usize,
        sign: f64,
        part: Part,
        dim: usize,
    ) {
        self.columns.clear();
        self.columns.resize(part.n, Vec6::zeros());
        dynamics::jacobian(model, data, contact.body[side] as usize, &contact.pos, &mut self.columns);
        let Island { columns, jac, .. } = self;
        rows::tree_rows(contact, columns, sign, dim, |k, j, value| jac[part.start + k * part.n + j] += value);
    }

    /// Adds a row of a tree's dofs: a joint limit or dry friction.
    pub fn add_dof_row(&mut self, model: &Model, data: &Data, row: &DofRow, unit: usize) {
        let part = self.part(unit, 1);
        let tree = &model.trees[self.units[unit].tree];
        let (first, entries) = (row.dof - tree.dofs.start, &row.entries[..row.n]);
        let jac = &mut self.jac[part.start..self.used];
        match &tree.free {
            Some(_) => jac.copy_from_slice(&super::dof_row(tree, data, row)),
            None => {
                jac.fill(0.0);
                jac[first..first + row.n].copy_from_slice(entries);
            }
        }
        self.parts.push(Parts { parts: [part, Part::default()], count: 1, ..Parts::default() });
        self.constraints.push(row.constraint);
    }

    /// Minimises the cost from the start of the vectors.
    pub fn solve(&mut self, model: &Model, data: &Data, stop: &Stop) -> Outcome {
        let (mut problem, vectors, constraints) = self.problem(model, data);
        solver::minimise(&mut problem, vectors, constraints, stop)
    }

    /// Row k of constraint i, as parts: tree and numbers.
    pub fn split_row(&self, i: usize, k: usize) -> Vec<(usize, &[f64])> {
        let parts = &self.parts[i];
        parts.parts[..parts.count].iter().map(|p| (self.units[p.unit].tree, self.row(p, k))).collect()
    }

    fn row(&self, part: &Part, k: usize) -> &[f64] {
        &self.jac[part.start + k * part.n..][..part.n]
    }

    /// J M⁻¹ Jᵀ of the row e₀ J₀ + e₁ J₁, 1/kg. `room` is scratch: the row, and M⁻¹ times it.
    fn exact_inverse(&self, model: &Model, data: &Data, parts: &Parts, e: [f64; 2], room: &mut Vec<f64>) -> f64 {
        let mut sum = 0.0;
        for part in &parts.parts[..parts.count] {
            room.clear();
            for _ in 0..2 {
                room.extend(self.row(part, 0).iter().map(|j| e[0] * j));
            }
            let (row, divided) = room.split_at_mut(part.n);
            if e[1] != 0.0 {
                add(row, e[1], self.row(part, 1));
                divided.copy_from_slice(row);
            }
            divide_tree(model, data, &self.units[part.unit], divided);
            sum += dot(row, divided);
        }
        sum
    }
}

#[inline]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    if let (Ok(a), Ok(b)) = (<&[f64; 6]>::try_from(a), <&[f64; 6]>::try_from(b)) {
        // Free bodies, nearly always.
        return (a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3]) + (a[4] * b[4] + a[5] * b[5]);
    }
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// y += factor x
#[inline]
fn add(y: &mut [f64], factor: f64, x: &[f64]) {
    if let (Ok(y), Ok(x)) = (<&mut [f64; 6]>::try_from(&mut *y), <&[f64; 6]>::try_from(x)) {
        for i in 0..6 {
            y[i] += factor * x[i];
        }
        return;
    }
    y.iter_mut().zip(x).for_each(|(y, x)| *y += factor * x);
}

/// x = M⁻¹ x for one tree.
fn divide_tree(model: &Model, data: &Data, unit: &Unit, x: &mut [f64]) {
    let tree = &model.trees[unit.tree];
    if tree.free.is_some() {
        let minv = &data.movers[tree.bodies.start].minv;
        x.iter_mut().zip(minv.iter()).for_each(|(x, w)| *x *= w);
    } else {
        dynamics::solve_m(model, data, unit.tree, x);
    }
}

/// The island as the solver sees it.
pub struct Problem<'a> {
    pub model: &'a Model,
    pub data: &'a Data,
    pub units: &'a [Unit],
    parts: &'a mut [Parts],
    jac: &'a [f64],
    blocks: &'a mut Blocks,
    product: &'a mut Vec<f64>,
    /// Whether `blocks` and the places in `parts` are this island's: a good warm start needs neither.
    analysed: bool,
}

impl Island {
    /// Splits into the problem, its vectors and its constraints.
    fn problem<'a>(
        &'a mut self,
        model: &'a Model,
        data: &'a Data,
    ) -> (Problem<'a>, &'a mut Vectors<Vec<f64>>, &'a mut [Constraint]) {
        let Island { units, constraints, vectors, parts, jac, blocks, product, .. } = self;
        (Problem { model, data, units, parts, jac, blocks, product, analysed: false }, vectors, constraints)
    }
}

impl Problem<'_> {
    /// Principal masses of a free body: kg, kg m².
    fn masses(&self, unit: &Unit) -> Option<[f64; 6]> {
        super::masses(&self.model.trees[unit.tree])
    }
    /// Inertia matrix of a tree that is not a free body.
    fn qm(&self, unit: &Unit) -> &[f64] {
        &self.data.qm[self.data.m_adr[unit.tree]..][..unit.n * unit.n]
    }
}

impl Space for Problem<'_> {
    type Vector = Vec<f64>;

    fn multiply_m(&self, v: &Vec<f64>, out: &mut Vec<f64>) {
        for unit in self.units {
            let (v, out) = (&v[unit.at..][..unit.n], &mut out[unit.at..][..unit.n]);
            match self.masses(unit) {
                Some(m) => (0..6).for_each(|i| out[i] = m[i] * v[i]),
                None => {
                    for (out, row) in out.iter_mut().zip(self.qm(unit).chunks_exact(unit.n)) {
                        *out = dot(row, v);
                    }
                }
            }
        }
    }

    fn divide_m(&self, v: &mut Vec<f64>) {
        for unit in self.units {
            divide_tree(self.model, self.data, unit, &mut v[unit.at..][..unit.n]);
        }
    }

    fn trace_m(&self) -> f64 {
        let trace = |unit: &Unit| match self.masses(unit) {
            Some(m) => m.iter().sum(),
            None => self.qm(unit).iter().step_by(unit.n + 1).sum::<f64>(),
        };
        self.units.iter().map(trace).sum()
    }

    fn multiply_j(&self, v: &Vec<f64>, into: Into, constraints: &mut [Constraint]) {
        for (c, parts) in constraints.iter_mut().zip(&*self.parts) {
            let mut product = [0.0; 6];
            for (k, sum) in product.iter_mut().enumerate().take(c.cone.dim) {
                for part in &parts.parts[..parts.count] {
                    *sum += dot(&self.jac[part.start + k * part.n..][..part.n], &v[part.at..][..part.n]);
                }
            }
            c.set(into, product);
        }
    }

    fn subtract_forces(&self, constraints: &[Constraint], g: &mut Vec<f64>) {
        for (c, parts) in constraints.iter().zip(&*self.parts) {
            for part in &parts.parts[..parts.count] {
                for k in 0..c.cone.dim {
                    let row = &self.jac[part.start + k * part.n..][..part.n];
                    add(&mut g[part.at..][..part.n], -c.force[k], row);
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

impl Problem<'_> {
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
            let n = unit.n;
            match self.masses(unit) {
                Some(m) => (0..6).for_each(|i| self.blocks.values()[at + i * 7] = m[i]),
                None => self.blocks.values()[at..at + n * n]
                    .copy_from_slice(&self.data.qm[self.data.m_adr[unit.tree]..][..n * n]),
            }
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
    if n == 6 {
        let jac = jac.as_chunks::<6>().0;
        for (k, out) in out.as_chunks_mut::<6>().0.iter_mut().enumerate() {
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
    if (ni, nj) == (6, 6) {
        // Free bodies, nearly always: rows of fixed length.
        let (rows, b) = (c[..36].as_chunks_mut::<6>().0, b.as_chunks::<6>().0);
        for (a, b) in a.as_chunks::<6>().0.iter().zip(b) {
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
