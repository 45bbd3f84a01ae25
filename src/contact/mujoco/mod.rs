//! MuJoCo's contact model: soft constraints, posed as a convex problem and solved by Newton's method.
//!
//! [`rows`] says what each constraint asks for, [`cone`] what it costs to deny it, [`solver`] finds the
//! accelerations that cost least. Bodies that do not influence one another are solved apart: a small tree, such as a
//! free body, that touches only what never moves in [`lone`], all others as an [`island`].
//!
//! With `tolerance` 0 accelerations and the forces of each contact are MuJoCo's to rounding.
//!
//! Source: MuJoCo 4.0 manual, Computation › Constraint model and Constraint solver; formulas re-checked against
//! 4.0.0 by running it.

pub mod blocks;
pub mod cone;
pub mod efc;
pub mod island;
pub mod lone;
pub mod rows;
pub mod solver;

use std::mem;

use crate::contact::describe::{self, Description};
use crate::contact::forest::Forest;
use crate::contact::{Law, impedance};
use crate::data::{Contact, Data, Mover};
use crate::dynamics;
use crate::forward::Method;
use crate::math::{Vec3, Vec6, vec3};
use crate::model::{FreeBody, Model, Tree};
use crate::state::{Start, State};
use island::Island;
use lone::{Dense, Diagonal, Lone, SIX};
use rows::{DofRow, Recipe};
use solver::{Constraint, Outcome, Stop, Vectors};

pub static LAW: Law = Law {
    name: "mujoco",
    about: "MuJoCo's soft constraints: the same forces as MuJoCo to rounding, by Newton's method on a convex problem",
    joints: true,
    start: Start::Acceleration,
    solve,
    friction: |_, mix| mix.friction,
    describe: |ask| Description { creep: Some(describe::soft_creep(ask)), ..describe::soft(ask) },
    unlike: None,
};

/// What the law keeps from step to step: nothing that matters, but buffers.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    /// Timestep for which `recipes` (one per mix of the model) were made.
    timestep: f64,
    implicit: bool,
    recipes: Vec<Recipe>,
    /// Rows of one small tree.
    constraints: Vec<Constraint>,
    jac: Vec<[[f64; 6]; 6]>,
    dof_rows: Vec<DofRow>,
    groups: Groups,
    island: Island,
}

/// Which trees influence one another, and the constraints of each island.
#[derive(Clone, Debug, Default)]
struct Groups {
    forest: Forest,
    /// Number of each tree within its island.
    unit: Vec<usize>,
    /// Trees, contacts and dof rows by island; the lowest tree of an island is its number.
    trees: Sorted,
    contacts: Sorted,
    dofs: Sorted,
}

/// Items by group: those of group g are `items[start[g]..start[g + 1]]`, in their old order.
#[derive(Clone, Debug, Default)]
struct Sorted {
    start: Vec<usize>,
    items: Vec<usize>,
}

impl Sorted {
    /// Sorts the items 0, 1, … by `group`; those of none are left out.
    fn sort(&mut self, groups: usize, items: usize, mut group: impl FnMut(usize) -> Option<usize>) {
        self.start.clear();
        self.start.resize(groups + 2, 0);
        for g in (0..items).filter_map(&mut group) {
            self.start[g + 2] += 1;
        }
        for g in 2..groups + 2 {
            self.start[g] += self.start[g - 1];
        }
        self.items.clear();
        self.items.resize(self.start[groups + 1], 0);
        for item in 0..items {
            if let Some(g) = group(item) {
                self.items[self.start[g + 1]] = item;
                self.start[g + 1] += 1;
            }
        }
    }

    fn of(&self, group: usize) -> &[usize] {
        &self.items[self.start[group]..self.start[group + 1]]
    }
}

/// Principal masses of a tree that is a free body: kg three times, then kg m².
fn masses(tree: &Tree) -> Option<[f64; 6]> {
    tree.free.as_ref().map(|f| [f.mass, f.mass, f.mass, f.inertia.x, f.inertia.y, f.inertia.z])
}

/// A free joint's acceleration in the coordinates of its mover.
///
///     a_com = a + α × (com − x),   angular part Pᵀα      with α in the body's frame, P its principal axes
fn to_mover(free: &FreeBody, mover: &Mover, xpos: &Vec3, qacc: &[f64]) -> [f64; 6] {
    let turn = free.axes.tr_mul(&vec3(&qacc[3..6]));
    let linear = vec3(&qacc[..3]) + (mover.axes * turn).cross(&(mover.com - xpos));
    [linear.x, linear.y, linear.z, turn.x, turn.y, turn.z]
}

/// The inverse of [`to_mover`].
fn from_mover(free: &FreeBody, mover: &Mover, xpos: &Vec3, a: &[f64], qacc: &mut [f64]) {
    let turn = vec3(&a[3..6]);
    let linear = vec3(&a[..3]) - (mover.axes * turn).cross(&(mover.com - xpos));
    qacc[..3].copy_from_slice(linear.as_slice());
    qacc[3..6].copy_from_slice((free.axes * turn).as_slice());
}

/// Generalized force of a free joint from the wrench on its mover.
fn force_from_mover(free: &FreeBody, mover: &Mover, xpos: &Vec3, pull: &[f64], qfrc: &mut [f64]) {
    let force = vec3(&pull[..3]);
    let about_origin = mover.axes.tr_mul(&(mover.com - xpos).cross(&force));
    qfrc[..3].copy_from_slice(force.as_slice());
    qfrc[3..6].copy_from_slice((free.axes * (vec3(&pull[3..6]) + about_origin)).as_slice());
}

/// The row of a free joint's dof in the coordinates of its mover: qacc_i as a function of the mover's acceleration.
fn dof_in_mover(free: &FreeBody, mover: &Mover, xpos: &Vec3, dof: usize) -> [f64; 6] {
    let mut row = [0.0; 6];
    if dof < 3 {
        row[dof] = 1.0;
        // a_i = a_com,i − ((P α) × l)_i = … + α · Pᵀ(e_i × l)
        let turn = mover.axes.tr_mul(&Vec3::ith(dof, 1.0).cross(&(mover.com - xpos)));
        row[3..].copy_from_slice(turn.as_slice());
    } else {
        row[3..].copy_from_slice(free.axes.row(dof - 3).transpose().as_slice());
    }
    row
}

/// Solves for the accelerations under contacts, joint limits and dry friction.
///
/// Reads:  contacts, movers, qacc_smooth, qm, qacc_warmstart. Writes: qacc, qfrc_constraint, the contacts' forces.
fn solve(model: &Model, method: &Method, state: &State, data: &mut Data) {
    data.qacc.copy_from_slice(&data.qacc_smooth);
    data.qfrc_constraint.fill(0.0);
    data.solver = Outcome::default();
    if !model.opt.flags.constraint {
        return;
    }
    // A pointer moves, not the buffers.
    let mut scratch = data.mujoco.take().unwrap_or_default();
    scratch.prepare(model, method, data);
    let mut dof_rows = mem::take(&mut scratch.dof_rows);
    dof_rows.clear();
    rows::of_joints(model, data, method.timestep, state, |row| dof_rows.push(row));
    if single(model) {
        scratch.solve_lone(model, state, data, 0, None, dof_rows.iter());
    } else {
        scratch.solve_islands(model, state, data, &dof_rows);
    }
    scratch.dof_rows = dof_rows;
    data.mujoco = Some(scratch);
}

/// Whether there is one small tree and nothing else.
fn single(model: &Model) -> bool {
    model.trees.len() == 1 && small(&model.trees[0])
}

fn small(tree: &Tree) -> bool {
    tree.dofs.len() <= SIX
}

impl Scratch {
    /// Makes what depends on model and method only, and room for as many contacts as `data` has.
    fn prepare(&mut self, model: &Model, method: &Method, data: &Data) {
        let (timestep, implicit) = (method.timestep, method.integrator.implicit);
        if self.timestep == timestep && self.implicit == implicit {
            return;
        }
        (self.timestep, self.implicit) = (timestep, implicit);
        let onset = impedance::onset(implicit, timestep, dynamics::gravity(model).norm());
        self.recipes = model.mixes.iter().map(|mix| Recipe::new(mix, model, timestep, onset)).collect();
        let contacts = data.contacts.capacity();
        // A limited joint may be near both its ends.
        let joints = data.plan.dry.len() + 2 * data.plan.limited.len();
        self.dof_rows.reserve(joints);
        self.constraints.reserve(contacts + joints);
        self.jac.reserve(contacts + joints);
        if !single(model) {
            self.groups.dofs.items.reserve(joints);
            self.groups.contacts.items.reserve(contacts);
            self.island.reserve(model, contacts, joints);
        }
    }

    /// One small tree against what never moves. `which` are its contacts, all of them if `None`.
    fn solve_lone<'a>(
        &mut self,
        model: &Model,
        state: &State,
        data: &mut Data,
        t: usize,
        which: Option<&[usize]>,
        dof_rows: impl ExactSizeIterator<Item = &'a DofRow>,
    ) {
        let tree = &model.trees[t];
        let count = which.map_or(data.contacts.len(), <[usize]>::len);
        let most = dof_rows.len() + count;
        if self.constraints.len() < most {
            self.constraints.resize(most, Constraint::default());
            self.jac.resize(most, [[0.0; 6]; 6]);
        }
        let joints = dof_rows.len();
        for (i, row) in dof_rows.enumerate() {
            self.jac[i][0] = dof_row(tree, data, row);
            self.constraints[i] = row.constraint;
        }
        let mut used = joints;
        for i in 0..count {
            let contact = &data.contacts[which.map_or(i, |w| w[i])];
            let recipe = &self.recipes[contact.mix as usize];
            if recipe.active(contact.dist) {
                let (c, jac) = (&mut self.constraints[used], &mut self.jac[used]);
                match &tree.free {
                    Some(_) => fill_free(model, data, tree, contact, recipe, jac, c),
                    None => fill_tree(model, state, data, t, contact, recipe, jac, c),
                }
                used += 1;
            }
        }
        if used == 0 {
            return;
        }
        let (constraints, jac) = (&mut self.constraints[..used], &self.jac[..used]);
        let mut v = Vectors::<[f64; 6]>::default();
        let warm = &state.qacc_warmstart[tree.dofs.clone()];
        let (body, n) = (tree.bodies.start, tree.dofs.len());
        let outcome;
        if let (Some(free), Some(m)) = (&tree.free, masses(tree)) {
            let (mover, xpos) = (&data.movers[body], &data.xpos[body]);
            v.smooth = mover.acc.into();
            v.a = to_mover(free, mover, xpos, warm);
            outcome = solver::minimise(&mut Lone { m: Diagonal(m), jac }, &mut v, constraints, &stop(model));
            from_mover(free, mover, xpos, &v.a, &mut data.qacc[tree.dofs.clone()]);
            force_from_mover(free, mover, xpos, &v.pull, &mut data.qfrc_constraint[tree.dofs.clone()]);
        } else {
            v.smooth[..n].copy_from_slice(&data.qacc_smooth[tree.dofs.clone()]);
            v.a[..n].copy_from_slice(warm);
            let m = Dense { n, qm: &data.qm[data.m_adr[t]..][..n * n] };
            outcome = solver::minimise(&mut Lone { m, jac }, &mut v, constraints, &stop(model));
            data.qacc[tree.dofs.clone()].copy_from_slice(&v.a[..n]);
            data.qfrc_constraint[tree.dofs.clone()].copy_from_slice(&v.pull[..n]);
        }
        let mut next = constraints[joints..].iter();
        for i in 0..count {
            let contact = &mut data.contacts[which.map_or(i, |w| w[i])];
            let recipe = &self.recipes[contact.mix as usize];
            set_force(contact, recipe, &mut next);
        }
        record(data, outcome, used_rows(constraints));
    }

    fn solve_islands(&mut self, model: &Model, state: &State, data: &mut Data, dof_rows: &[DofRow]) {
        let mut groups = mem::take(&mut self.groups);
        groups.find(model, &data.contacts, &self.recipes, dof_rows);
        for root in 0..model.trees.len() {
            let (trees, contacts, dofs) = (groups.trees.of(root), groups.contacts.of(root), groups.dofs.of(root));
            if contacts.is_empty() && dofs.is_empty() {
                continue;
            }
            if trees.len() == 1 && small(&model.trees[root]) {
                self.solve_lone(model, state, data, root, Some(contacts), dofs.iter().map(|&d| &dof_rows[d]));
            } else {
                self.solve_island(model, state, data, &mut groups.unit, [trees, contacts, dofs], dof_rows);
            }
        }
        self.groups = groups;
    }

    /// An island of several trees, or of one that is not a free body.
    fn solve_island(
        &mut self,
        model: &Model,
        state: &State,
        data: &mut Data,
        unit: &mut [usize],
        [trees, contacts, dofs]: [&[usize]; 3],
        dof_rows: &[DofRow],
    ) {
        let island = &mut self.island;
        island.reset();
        for &t in trees {
            unit[t] = island.add_tree(model, t);
        }
        for &d in dofs {
            let tree = tree_of_dof(model, dof_rows[d].dof);
            island.add_dof_row(model, data, &dof_rows[d], unit[tree]);
        }
        for &i in contacts {
            let contact = &data.contacts[i];
            let units = contact.body.map(|b| model.bodies[b as usize].tree.map(|t| unit[t]));
            island.add_contact(model, data, &state.qvel, contact, &self.recipes[contact.mix as usize], units);
        }
        island.start(model, data, &state.qacc_warmstart);
        let outcome = island.solve(model, data, &stop(model));
        for u in &island.units {
            let tree = &model.trees[u.tree];
            let (a, pull) = (&island.vectors.a[u.at..][..u.n], &island.vectors.pull[u.at..][..u.n]);
            let body = tree.bodies.start;
            let qfrc = &mut data.qfrc_constraint[tree.dofs.clone()];
            let qacc = &mut data.qacc[tree.dofs.clone()];
            if let Some(free) = &tree.free {
                from_mover(free, &data.movers[body], &data.xpos[body], a, qacc);
                force_from_mover(free, &data.movers[body], &data.xpos[body], pull, qfrc);
            } else {
                qacc.copy_from_slice(a);
                qfrc.copy_from_slice(pull);
            }
        }
        for (&i, c) in contacts.iter().zip(&island.constraints[dofs.len()..]) {
            data.contacts[i].force = force_of(c);
        }
        let rows = used_rows(&island.constraints);
        record(data, outcome, rows);
    }
}

/// Rows and constraint of a contact between a free body and what never moves.
#[inline]
fn fill_free(
    model: &Model,
    data: &Data,
    tree: &Tree,
    contact: &Contact,
    recipe: &Recipe,
    jac: &mut [[f64; 6]; 6],
    c: &mut Constraint,
) {
    let body = tree.bodies.start;
    let mover = &data.movers[body];
    let sign = if contact.body[1] as usize == body { 1.0 } else { -1.0 };
    rows::free_rows(contact, mover, sign, &mut jac[..recipe.dim()]);
    let inverse = if model.opt.flags.diagexact {
        recipe.exact(|e| (0..6).map(|i| (e[0] * jac[0][i] + e[1] * jac[1][i]).powi(2) * mover.minv[i]).sum())
    } else {
        rows::inverse_mass(model, contact)
    };
    let rows = &jac[..recipe.dim()];
    recipe.fill(contact.dist, inverse, &products(rows, mover.vel.as_slice()), c);
    recipe.switch_on(contact.dist, c, || products(rows, mover.acc.as_slice()));
}

/// Rows and constraint of a contact of a small tree that is not a free body.
#[inline]
fn fill_tree(
    model: &Model,
    state: &State,
    data: &Data,
    t: usize,
    contact: &Contact,
    recipe: &Recipe,
    jac: &mut [[f64; 6]; 6],
    c: &mut Constraint,
) {
    let (dofs, dim) = (&model.trees[t].dofs, recipe.dim());
    let mut columns = [Vec6::zeros(); SIX];
    *jac = [[0.0; 6]; 6];
    for (side, sign) in [(0, -1.0), (1, 1.0)] {
        let body = contact.body[side] as usize;
        if model.bodies[body].tree.is_some() {
            dynamics::jacobian(model, data, body, &contact.pos, &mut columns);
            rows::tree_rows(contact, &columns[..dofs.len()], sign, dim, |k, j, value| jac[k][j] += value);
        }
    }
    let inverse = if model.opt.flags.diagexact {
        recipe.exact(|e| {
            let row: [f64; 6] = std::array::from_fn(|i| e[0] * jac[0][i] + e[1] * jac[1][i]);
            let mut divided = row;
            dynamics::solve_m(model, data, t, &mut divided[..dofs.len()]);
            row.iter().zip(&divided).map(|(a, b)| a * b).sum()
        })
    } else {
        rows::inverse_mass(model, contact)
    };
    recipe.fill(contact.dist, inverse, &products(&jac[..dim], &state.qvel[dofs.clone()]), c);
    recipe.switch_on(contact.dist, c, || products(&jac[..dim], &data.qacc_smooth[dofs.clone()]));
}

/// Velocities of rows, J · vel, or accelerations.
#[inline]
fn products(jac: &[[f64; 6]], vel: &[f64]) -> [f64; 6] {
    let mut v = [0.0; 6];
    for (v, row) in v.iter_mut().zip(jac) {
        *v = row.iter().zip(vel).map(|(j, v)| j * v).sum();
    }
    v
}

/// A row of a tree's dofs as a row of its unknowns.
fn dof_row(tree: &Tree, data: &Data, row: &DofRow) -> [f64; 6] {
    let mut out = [0.0; 6];
    for (i, entry) in row.entries.iter().enumerate().take(row.n) {
        let dof = row.dof + i - tree.dofs.start;
        match &tree.free {
            Some(free) => {
                let body = tree.bodies.start;
                let unit = dof_in_mover(free, &data.movers[body], &data.xpos[body], dof);
                (0..6).for_each(|j| out[j] += entry * unit[j]);
            }
            None => out[dof] = *entry,
        }
    }
    out
}

fn stop(model: &Model) -> Stop {
    let opt = &model.opt;
    Stop { tolerance: opt.tolerance, iterations: opt.iterations, warm: opt.flags.warmstart }
}

fn used_rows(constraints: &[Constraint]) -> usize {
    constraints.iter().map(|c| c.cone.dim).sum()
}

fn record(data: &mut Data, outcome: Outcome, rows: usize) {
    data.counts.rows += rows;
    data.counts.solves += outcome.iterations;
    data.solver.iterations = data.solver.iterations.max(outcome.iterations);
    data.solver.residual = data.solver.residual.max(outcome.residual);
}

fn force_of(c: &Constraint) -> [f64; 6] {
    let mut force = [0.0; 6];
    force[..c.cone.dim].copy_from_slice(&c.force[..c.cone.dim]);
    force
}

/// Gives a contact the force of the next constraint, if the contact is active.
fn set_force<'a>(contact: &mut Contact, recipe: &Recipe, constraints: &mut impl Iterator<Item = &'a Constraint>) {
    if recipe.active(contact.dist)
        && let Some(c) = constraints.next()
    {
        contact.force = force_of(c);
    }
}

fn tree_of_dof(model: &Model, dof: usize) -> usize {
    model.bodies[model.dofs[dof].body].tree.unwrap_or(0)
}

impl Groups {
    /// Finds the islands: trees joined by active contacts.
    fn find(&mut self, model: &Model, contacts: &[Contact], recipes: &[Recipe], dof_rows: &[DofRow]) {
        let Groups { forest, unit, trees, contacts: by_island, dofs } = self;
        let count = model.trees.len();
        forest.reset(count);
        unit.resize(count, 0);
        let tree = |body: u32| model.bodies[body as usize].tree;
        let active = |c: &Contact| recipes[c.mix as usize].active(c.dist);
        for c in contacts.iter().filter(|c| active(c)) {
            if let [Some(a), Some(b)] = c.body.map(tree) {
                forest.join(a, b);
            }
        }
        trees.sort(count, count, |t| Some(forest.find(t)));
        by_island.sort(count, contacts.len(), |i| {
            let c = &contacts[i];
            c.body.iter().find_map(|&b| tree(b)).filter(|_| active(c)).map(|t| forest.find(t))
        });
        dofs.sort(count, dof_rows.len(), |i| Some(forest.find(tree_of_dof(model, dof_rows[i].dof))));
    }
}
