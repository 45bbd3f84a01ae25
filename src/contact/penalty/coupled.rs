//! Trees that touch each other, and trees with joints.
//!
//! Contacts and joint limits that hang together form an island. The normals of an island are solved at once, as
//! long as there are not too many of them: if each pair of trees took its turn instead, with the others' forces
//! given, a stack of three would be unstable at timesteps of 6 ms. In larger islands every pair of trees takes its
//! turn. Where all meet in one body, as the balls on a tray, their matrix is a [`Star`], which costs little. Friction
//! takes turns in any case, contact by contact, in alternating order. A joint limit is a normal of its own, dry
//! friction of a joint a friction of its own with a fixed limit.
//!
//! All start from the last step's forces. Turns are what makes normals and friction agree: with two of them a stack
//! of three starts to rock at timesteps of 8 ms, with four it rests to rounding at 15 ms. Stopping early where
//! forces hardly change saves nothing: what is left of the rocking grows until contact points come and go.

use std::ops::Range;

use super::drive::{Recipes, friction, inverse_mass, piece};
use super::{Block, Blocks};
use crate::contact::complementarity::{Complementarity, Matrix, Spoke, Star};
use crate::contact::forest::Forest;
use crate::contact::mujoco::rows::{DofRow, dry_friction, limits};
use crate::contact::rows::{NONE, Rows, eigenvalues};
use crate::contact::surface_points;
use crate::data::Data;
use crate::forward::Method;
use crate::model::Model;
use crate::state::State;

type Six = [f64; 6];

/// Turns of normals and friction per round.
const TURNS: usize = 4;

/// The same for a star with a hub so heavy that friction at one contact hardly stirs the others: to the balls it is as
/// good as the ground, and one turn is enough, as for a lone body. A light hub needs them all: nine balls that roll on a
/// tray a hundred times lighter than each shake it at 0.5 m/s with two turns and steps of 10 ms, at 0.1 m/s with four.
const STAR_TURNS: usize = 1;

/// The same where a contact is new and has no friction of the last step to start from.
const COLD_TURNS: usize = 12;

/// What share of each compliance a heavy hub leaves to the other body, at least.
const HEAVY: f64 = 0.75;

/// Most normals that are solved at once.
const MOST_AT_ONCE: usize = 64;

/// Fewest normals for which a star is quicker than a dense matrix.
const FEWEST_SPOKES: usize = 6;

/// Least part of a spoke's compliance that must be its own: where it is small, b − u y leaves few digits.
const OWN_SHARE: f64 = 1e-3;

#[derive(Clone, Debug, Default)]
pub struct Coupled {
    rows: Rows,
    entries: Vec<Entry>,
    forest: Forest,
    /// All entries, those of an island together; and those of them that have a normal.
    members: Vec<u32>,
    normals: Vec<u32>,
    islands: Vec<Island>,
    groups: Vec<Group>,
    /// A of each group's normals, one after the other: dense ones, and stars.
    a: Vec<f64>,
    spokes: Vec<Spoke>,
    b: Vec<f64>,
    f: Vec<f64>,
    /// A f
    answer: Vec<f64>,
    solver: Complementarity,
}

/// What hangs together: `members[start..end]`, and the groups of its normals.
#[derive(Clone, Debug)]
struct Island {
    members: Range<usize>,
    groups: Range<usize>,
}

/// Normals that are solved at once: a range of `normals`, and where their A is (R added).
#[derive(Clone, Debug)]
struct Group {
    normals: Range<usize>,
    form: Form,
}

#[derive(Clone, Copy, Debug)]
enum Form {
    /// From `a[at]` on.
    Dense { at: usize },
    /// From `spokes[at]` on. `steady`: the hub is far heavier than each thing it touches.
    Star { at: usize, minv: Six, steady: bool },
}

/// A contact, a joint limit or a joint with dry friction.
#[derive(Clone, Copy, Debug)]
struct Entry {
    source: Source,
    /// Number of rows.
    dim: usize,
    /// Velocity/h of the friction rows.
    drift: Six,
    force: Six,
    /// a_ref and R of the normal.
    reference: f64,
    softness: f64,
    /// Normal force per limit of the friction rows; of dry friction the inverse of its own, 1/N or 1/(N m).
    per_limit: [f64; 5],
    /// 1/λ of the sliding, spinning and rolling rows; infinite for rows that nothing can move.
    stiff: [f64; 3],
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Source {
    /// Index into `data.contacts`.
    Contact(u32),
    Limit,
    Dry,
}

/// Solves all blocks that are not lone, joint limits and dry friction.
///
/// Reads: state, movers, qacc_smooth, contacts (with the last step's forces). Writes: forces of the contacts,
/// qacc and qfrc_constraint of the trees involved. Not inlined: the loop over lone bodies stays small.
#[inline(never)]
pub fn solve(model: &Model, method: &Method, state: &State, data: &mut Data) {
    let mut scratch = std::mem::take(&mut data.penalty);
    scratch.coupled.solve(model, method, state, &scratch.recipes, &scratch.blocks, data);
    data.penalty = scratch;
}

impl Coupled {
    fn solve(
        &mut self,
        model: &Model,
        method: &Method,
        state: &State,
        recipes: &Recipes,
        blocks: &Blocks,
        data: &mut Data,
    ) {
        self.rows.begin(model);
        self.entries.clear();
        for block in blocks.all.iter().filter(|b| !b.lone) {
            self.add_contacts(model, method, state, recipes, block, data);
        }
        self.add_joints(model, method, state, data);
        data.counts.rows += self.entries.iter().map(|e| e.dim).sum::<usize>();
        self.find_islands(model, data);

        // All of the last step's forces act from the start.
        for e in 0..self.entries.len() {
            let Entry { dim, force, .. } = &self.entries[e];
            self.rows.push_forces(e, 0, &force[..*dim]);
        }
        for i in 0..self.islands.len() {
            data.counts.solves += self.settle(method, i);
        }
        for entry in &self.entries {
            if let Source::Contact(c) = entry.source {
                data.contacts[c as usize].force = entry.force;
            }
        }
        self.rows.finish(model, data);
    }
}

impl Coupled {
    fn add_contacts(
        &mut self,
        model: &Model,
        method: &Method,
        state: &State,
        recipes: &Recipes,
        block: &Block,
        data: &Data,
    ) {
        let per_step = 1.0 / method.timestep;
        for c in block.contacts() {
            let contact = &data.contacts[c];
            let recipe = recipes.of(contact);
            if !recipe.reaches(contact) {
                continue;
            }
            let e = self.entries.len();
            let rows = &mut self.rows;
            rows.push(model, &state.qvel, data, contact, recipe.dim, surface_points(contact, model));
            let inverse =
                if model.opt.flags.diagexact { rows.own_compliance(e, 0, 0) } else { inverse_mass(model, contact) };
            let velocity = rows.velocities(e);
            let d = recipe.impedance(contact.dist);
            self.entries.push(Entry {
                source: Source::Contact(c as u32),
                dim: recipe.dim,
                drift: velocity.map(|v| v * per_step),
                force: contact.force,
                reference: recipe.reference(d, contact.dist, velocity[0]),
                softness: recipe.softness(d, inverse),
                per_limit: recipe.per_limit,
                stiff: eigenvalues(recipe.dim, |k, l| rows.own_compliance(e, k, l)).map(|x| 1.0 / x),
            });
        }
    }

    /// Joint limits and dry friction, all in the field's words: a limit is MuJoCo's row, dry friction stops the
    /// joint if `frictionloss` suffices.
    fn add_joints(&mut self, model: &Model, method: &Method, state: &State, data: &Data) {
        let mut add = |row: DofRow, source: Source| {
            let e = self.entries.len();
            self.rows.push_joint(model, &state.qvel, data, row.dof, &row.entries[..row.n]);
            let inverse = self.rows.own_compliance(e, 0, 0);
            let velocity = self.rows.velocities(e)[0];
            self.entries.push(Entry {
                source,
                dim: 1,
                drift: [velocity / method.timestep, 0.0, 0.0, 0.0, 0.0, 0.0],
                force: [0.0; 6],
                reference: -row.constraint.bias[0],
                softness: 1.0 / row.constraint.cone.d[0],
                per_limit: [1.0 / row.constraint.cone.mu[0]; 5],
                stiff: [1.0 / inverse; 3],
            });
        };
        let (h, plan) = (method.timestep, &data.plan);
        limits(model, &plan.limited, h, &state.qpos, &state.qvel, |row| add(row, Source::Limit));
        dry_friction(model, &plan.dry, h, &state.qvel, |row| add(row, Source::Dry));
    }

    /// Sorts the entries into islands and their normals into groups, and forms A of every group.
    fn find_islands(&mut self, model: &Model, data: &Data) {
        let Coupled { rows, entries, forest, members, normals, islands, groups, a, spokes, .. } = self;
        forest.reset(model.trees.len());
        for entry in &rows.contacts {
            if let [first, second] = entry.parts.map(|p| p.tree)
                && second != NONE
            {
                forest.join(first as usize, second as usize);
            }
        }
        let trees = |e: u32| rows.contacts[e as usize].parts.map(|p| p.tree);
        members.clear();
        members.extend(0..entries.len() as u32);
        members.sort_unstable_by_key(|&e| (forest.find(trees(e)[0] as usize), e));
        normals.clear();
        islands.clear();
        groups.clear();
        a.clear();
        spokes.clear();
        let mut start = 0;
        while start < members.len() {
            let island = forest.find(trees(members[start])[0] as usize);
            let others = |e: &u32| forest.find(trees(*e)[0] as usize) != island;
            let end = members[start..].iter().position(others).map_or(members.len(), |n| start + n);
            let (first_normal, first_group) = (normals.len(), groups.len());
            normals.extend(members[start..end].iter().filter(|&&e| entries[e as usize].source != Source::Dry));
            let at_once = normals.len() - first_normal <= MOST_AT_ONCE;
            let alike = |e: &u32, f: &u32| at_once || trees(*e) == trees(*f);
            let mut from = first_normal;
            for group in normals[first_normal..].chunk_by(alike) {
                let form = add_star(model, data, rows, entries, group, spokes)
                    .unwrap_or_else(|| add_matrix(rows, entries, group, a));
                groups.push(Group { normals: from..from + group.len(), form });
                from += group.len();
            }
            islands.push(Island { members: start..end, groups: first_group..groups.len() });
            start = end;
        }
    }

    /// Lets the normals and the friction of an island take turns. Returns the number of systems solved.
    fn settle(&mut self, method: &Method, island: usize) -> usize {
        let Island { members, groups } = self.islands[island].clone();
        let mut solves = 0;
        let steady =
            matches!(self.groups[groups.start..groups.end], [Group { form: Form::Star { steady: true, .. }, .. }]);
        let (mut turn, mut turns) = (0, method.rounds * if steady { STAR_TURNS } else { TURNS });
        if method.integrator.implicit {
            // Its steps need forces that follow from their end alone, not from the last step's.
            turns = method.rounds * COLD_TURNS;
        }
        while turn < turns {
            let mut starts = false;
            // One group's matrix stays in the solver; several take turns there.
            let again = turn > 0 && groups.len() == 1;
            for group in groups.clone() {
                let (n, new) = self.solve_normals(group, again);
                solves += n;
                starts |= new;
            }
            if turn == 0 && starts {
                turns = method.rounds * COLD_TURNS;
            }
            for k in members.clone() {
                // In alternating order: otherwise the last contact would always have the last word.
                let k = if turn % 2 == 0 { k } else { members.start + members.end - 1 - k };
                self.slip(method, self.members[k] as usize);
            }
            turn += 1;
        }
        solves
    }

    /// Solves for the normal forces of a group, all other forces given. Returns the number of systems solved, and
    /// whether a contact pushes that did not before.
    fn solve_normals(&mut self, group: usize, again: bool) -> (usize, bool) {
        let Coupled { rows, entries, normals, groups, a, spokes, b, f, answer, solver, .. } = self;
        let group = &groups[group];
        let normals = &normals[group.normals.clone()];
        let n = normals.len();
        let matrix = match group.form {
            Form::Dense { at } => Matrix::Dense(&a[at..at + n * n]),
            Form::Star { at, minv, .. } => Matrix::Star(Star { spokes: &spokes[at..at + n], minv }),
        };
        f.clear();
        f.extend(normals.iter().map(|&e| entries[e as usize].force[0]));
        answer.resize(n, 0.0);
        matrix.times(f, answer);
        b.clear();
        for (answer, &e) in answer.iter().zip(normals) {
            let entry = &entries[e as usize];
            // The present forces are part of the acceleration: take them out. R is no part of it.
            let [acceleration] = rows.accelerations(e as usize, 0);
            b.push(entry.reference - acceleration + answer - entry.softness * entry.force[0]);
        }
        let solves = solver.solve(matrix, b, f, again);
        let mut starts = false;
        for (&e, f) in normals.iter().zip(f.iter()) {
            let Entry { force, dim, .. } = &mut entries[e as usize];
            rows.push_forces(e as usize, 0, &[*f - force[0]]);
            starts |= *dim > 1 && force[0] == 0.0 && *f > 0.0;
            force[0] = *f;
        }
        (solves, starts)
    }

    /// Lets the friction of an entry oppose slip, the normal given. Rolling and spinning come before sliding.
    fn slip(&mut self, method: &Method, e: usize) {
        let Entry { source, dim, force, per_limit, stiff, .. } = self.entries[e];
        match source {
            Source::Limit => {}
            Source::Dry => self.slip_piece::<1>(method, e, 0, 1.0, [per_limit[0]], stiff[0]),
            Source::Contact(_) => {
                if dim >= 6 {
                    self.slip_piece::<2>(method, e, 4, force[0], piece(&per_limit, 3), stiff[2]);
                }
                if dim >= 4 {
                    self.slip_piece::<1>(method, e, 3, force[0], piece(&per_limit, 2), stiff[1]);
                }
                if dim >= 3 {
                    self.slip_piece::<2>(method, e, 1, force[0], piece(&per_limit, 0), stiff[0]);
                }
            }
        }
    }

    fn slip_piece<const N: usize>(
        &mut self,
        method: &Method,
        e: usize,
        first: usize,
        normal: f64,
        per_limit: [f64; N],
        stiff: f64,
    ) {
        if !stiff.is_finite() {
            return;
        }
        let force: [f64; N] = piece(&self.entries[e].force, first);
        let drift = piece(&self.entries[e].drift, first);
        let acceleration = self.rows.accelerations(e, first);
        let next = friction::<N>(method, normal, per_limit, stiff, force, drift, acceleration);
        let change: [f64; N] = std::array::from_fn(|k| next[k] - force[k]);
        self.rows.push_forces(e, first, &change);
        self.entries[e].force[first..first + N].copy_from_slice(&next);
    }
}

/// Appends A + R of a group's normals as a star, if they feel each other through one free body only, the hub: each of
/// them touches it, and what else they touch is touched by none of the others.
fn add_star(
    model: &Model,
    data: &Data,
    rows: &Rows,
    entries: &[Entry],
    group: &[u32],
    spokes: &mut Vec<Spoke>,
) -> Option<Form> {
    let [first, .., last] = group else { return None };
    let trees = |e: &u32| rows.contacts[*e as usize].parts.map(|p| p.tree);
    let hub = trees(first).into_iter().find(|t| trees(last).contains(t) && *t != NONE)?;
    let tree = &model.trees[hub as usize];
    // Contacts between the same two trees follow one another.
    let twice = group.windows(2).any(|w| trees(&w[0])[1] != NONE && trees(&w[0]) == trees(&w[1]));
    if group.len() < FEWEST_SPOKES || tree.free.is_none() || twice {
        return None;
    }
    let (at, mut steady) = (spokes.len(), true);
    for &e in group {
        let spoke = rows.split(e as usize, hub).and_then(|(u, share)| {
            let own = share + entries[e as usize].softness;
            let whole = rows.own_compliance(e as usize, 0, 0);
            // What never moves has no share, and nothing that the hub could stir.
            steady &= share == 0.0 || share > HEAVY * whole;
            (own > OWN_SHARE * whole).then_some(Spoke { u, own, inverse: 1.0 / own })
        });
        let Some(spoke) = spoke else {
            spokes.truncate(at);
            return None;
        };
        spokes.push(spoke);
    }
    Some(Form::Star { at, minv: data.movers[tree.bodies.start].minv.into(), steady })
}

/// Appends A + R of a group's normals, row by row.
fn add_matrix(rows: &Rows, entries: &[Entry], group: &[u32], a: &mut Vec<f64>) -> Form {
    let (at, n) = (a.len(), group.len());
    a.resize(at + n * n, 0.0);
    for (i, &e) in group.iter().enumerate() {
        for (j, &g) in group[..i].iter().enumerate().filter(|(_, g)| rows.meet(e as usize, **g as usize)) {
            let x = rows.compliance(e as usize, 0, g as usize, 0);
            a[at + i * n + j] = x;
            a[at + j * n + i] = x;
        }
        a[at + i * n + i] = rows.own_compliance(e as usize, 0, 0) + entries[e as usize].softness;
    }
    Form::Dense { at }
}
