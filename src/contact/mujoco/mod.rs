//! MuJoCo's contact model: soft constraints, posed as a convex problem and solved by Newton's method.
//!
//! [`rows`] says what each constraint asks for, [`cone`] what it costs to deny it, [`solver`] finds the
//! accelerations that cost least. Bodies that do not influence one another are solved apart: a free body that
//! touches only what never moves in [`free`], all others as an [`island`].
//!
//! Source: MuJoCo 4.0 manual, Computation › Constraint model and Constraint solver; formulas re-checked against
//! 4.0.0 by running it.

pub mod blocks;
pub mod cone;
pub mod efc;
pub mod free;
pub mod island;
pub mod rows;
pub mod solver;

use std::mem;

use crate::contact::Law;
use crate::contact::forest::Forest;
use crate::data::{Contact, Data, Mover};
use crate::forward::Method;
use crate::math::{Vec3, vec3};
use crate::model::{FreeBody, Model, Tree};
use crate::state::State;
use free::Free;
use island::Island;
use rows::Recipe;
use solver::{Constraint, Outcome, Stop, Vectors};

pub static LAW: Law = Law {
    name: "mujoco",
    about: "MuJoCo's soft constraints: the same forces as MuJoCo to rounding, by Newton's method on a convex problem",
    solve,
};

/// What the law keeps from step to step: nothing that matters, but buffers.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    /// Timestep for which `recipes` (one per mix of the model) were made.
    timestep: f64,
    recipes: Vec<Recipe>,
    /// Rows of one free body.
    constraints: Vec<Constraint>,
    jac: Vec<[[f64; 6]; 6]>,
    dof_rows: Vec<rows::DofRow>,
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
    scratch.prepare(model, method.timestep, data);
    if single(model, data) {
        scratch.solve_free(model, state, data, 0, None);
    } else {
        scratch.solve_islands(model, method, state, data);
    }
    data.mujoco = Some(scratch);
}

/// Whether there is one body only, free, and nothing but contacts can hold it.
fn single(model: &Model, data: &Data) -> bool {
    model.trees.len() == 1 && model.trees[0].free.is_some() && !data.plan.joint_rows()
}

impl Scratch {
    /// Makes what depends on model and timestep only, and room for as many contacts as `data` has.
    fn prepare(&mut self, model: &Model, timestep: f64, data: &Data) {
        if self.timestep == timestep {
            return;
        }
        self.timestep = timestep;
        self.recipes = model.mixes.iter().map(|mix| Recipe::new(mix, model, timestep)).collect();
        let contacts = data.contacts.capacity();
        self.constraints.reserve(contacts);
        self.jac.reserve(contacts);
        if !single(model, data) {
            // A limited joint may be near both its ends.
            let joints = data.plan.dry.len() + 2 * data.plan.limited.len();
            self.dof_rows.reserve(joints);
            self.groups.dofs.items.reserve(joints);
            self.groups.contacts.items.reserve(contacts);
            self.island.reserve(model, contacts, joints);
        }
    }

    /// One free body against what never moves. `which` are its contacts, all of them if `None`.
    fn solve_free(&mut self, model: &Model, state: &State, data: &mut Data, t: usize, which: Option<&[usize]>) {
        let tree = &model.trees[t];
        let (Some(free), Some(m)) = (&tree.free, masses(tree)) else { return };
        let body = tree.bodies.start;
        let mover = &data.movers[body];
        let count = which.map_or(data.contacts.len(), <[usize]>::len);
        if self.constraints.len() < count {
            self.constraints.resize(count, Constraint::default());
            self.jac.resize(count, [[0.0; 6]; 6]);
        }
        let mut used = 0;
        for i in 0..count {
            let contact = &data.contacts[which.map_or(i, |w| w[i])];
            let recipe = &self.recipes[contact.mix as usize];
            if !recipe.active(contact.dist) {
                continue;
            }
            let (c, jac) = (&mut self.constraints[used], &mut self.jac[used]);
            used += 1;
            let sign = if contact.body[1] as usize == body { 1.0 } else { -1.0 };
            rows::free_rows(contact, mover, sign, &mut jac[..recipe.dim()]);
            let mut v = [0.0; 6];
            for (v, row) in v.iter_mut().zip(jac.iter()).take(recipe.dim()) {
                *v = row.iter().zip(mover.vel.iter()).map(|(j, v)| j * v).sum();
            }
            let inverse = if model.opt.flags.diagexact {
                recipe.exact(|e| (0..6).map(|i| (e[0] * jac[0][i] + e[1] * jac[1][i]).powi(2) / m[i]).sum())
            } else {
                rows::inverse_mass(model, contact)
            };
            recipe.fill(contact.dist, inverse, &v, c);
        }
        if used == 0 {
            return;
        }
        let constraints = &mut self.constraints[..used];
        let warm = &state.qacc_warmstart[tree.dofs.clone()];
        let mut v = Vectors::<[f64; 6]> {
            smooth: mover.acc.into(),
            a: to_mover(free, mover, &data.xpos[body], warm),
            ..Vectors::default()
        };
        let mut space = Free { m, jac: &self.jac[..used] };
        let outcome = solver::minimise(&mut space, &mut v, constraints, &stop(model));
        from_mover(free, mover, &data.xpos[body], &v.a, &mut data.qacc[tree.dofs.clone()]);
        force_from_mover(free, mover, &data.xpos[body], &v.pull, &mut data.qfrc_constraint[tree.dofs.clone()]);
        let mut next = constraints.iter();
        for i in 0..count {
            let contact = &mut data.contacts[which.map_or(i, |w| w[i])];
            let recipe = &self.recipes[contact.mix as usize];
            set_force(contact, recipe, &mut next);
        }
        record(data, outcome, used_rows(constraints));
    }

    fn solve_islands(&mut self, model: &Model, method: &Method, state: &State, data: &mut Data) {
        let mut dof_rows = mem::take(&mut self.dof_rows);
        dof_rows.clear();
        rows::of_joints(model, data, method.timestep, state, |row| dof_rows.push(row));
        let mut groups = mem::take(&mut self.groups);
        groups.find(model, &data.contacts, &self.recipes, &dof_rows);
        for root in 0..model.trees.len() {
            let (trees, contacts, dofs) = (groups.trees.of(root), groups.contacts.of(root), groups.dofs.of(root));
            if contacts.is_empty() && dofs.is_empty() {
                continue;
            }
            if trees.len() == 1 && dofs.is_empty() && model.trees[root].free.is_some() {
                self.solve_free(model, state, data, root, Some(contacts));
            } else {
                self.solve_island(model, state, data, &mut groups.unit, [trees, contacts, dofs], &dof_rows);
            }
        }
        self.groups = groups;
        self.dof_rows = dof_rows;
    }

    /// An island of several trees, or of one that is not a free body.
    fn solve_island(
        &mut self,
        model: &Model,
        state: &State,
        data: &mut Data,
        unit: &mut [usize],
        [trees, contacts, dofs]: [&[usize]; 3],
        dof_rows: &[rows::DofRow],
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
        let (mut problem, vectors, constraints) = island.problem(model, data);
        let outcome = solver::minimise(&mut problem, vectors, constraints, &stop(model));
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
    fn find(&mut self, model: &Model, contacts: &[Contact], recipes: &[Recipe], dof_rows: &[rows::DofRow]) {
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
