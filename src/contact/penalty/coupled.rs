//! Trees that touch each other, and trees with joints: blocks take turns, each with the others' forces given.
//!
//! A block is all contacts between the same two trees; its normals are solved together. A joint limit is a normal
//! of its own, dry friction of a joint a friction of its own with a fixed limit. Every turn starts from the last
//! step's forces, so that a stack at rest needs one.

use super::drive::{Recipes, eigenvalues, friction, inverse_mass, piece};
use super::{Block, Blocks};
use crate::contact::mujoco::rows::{DofRow, dry_friction, limits};
use crate::contact::rows::Rows;
use crate::contact::{complementarity, surface_points};
use crate::data::Data;
use crate::forward::Method;
use crate::model::Model;
use crate::state::State;

type Six = [f64; 6];

/// Turns of normals and friction per round.
const SWEEPS: usize = 4;

#[derive(Clone, Debug, Default)]
pub struct Coupled {
    rows: Rows,
    entries: Vec<Entry>,
    /// Entries of each block.
    blocks: Vec<std::ops::Range<usize>>,
    a: Vec<f64>,
    b: Vec<f64>,
    f: Vec<f64>,
    pushes: Vec<bool>,
    factor: Vec<f64>,
}

/// A contact, a joint limit or a joint with dry friction.
#[derive(Clone, Copy, Debug)]
struct Entry {
    source: Source,
    /// Number of rows.
    dim: usize,
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
/// qacc and qfrc_constraint of the trees involved.
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
        self.blocks.clear();
        for block in blocks.all.iter().filter(|b| !b.lone) {
            self.add_contacts(model, state, recipes, blocks, block, data);
        }
        self.add_joints(model, method, state, data);
        data.counts.rows += self.entries.iter().map(|e| e.dim).sum::<usize>();

        // All of the last step's forces act from the start.
        for e in 0..self.entries.len() {
            for k in 0..self.entries[e].dim {
                self.rows.push_force(e, k, self.entries[e].force[k]);
            }
        }
        for _ in 0..method.rounds * SWEEPS {
            for b in 0..self.blocks.len() {
                data.counts.solves += self.normals(b);
            }
            for e in 0..self.entries.len() {
                self.slip(method, e);
            }
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
        state: &State,
        recipes: &Recipes,
        blocks: &Blocks,
        block: &Block,
        data: &Data,
    ) {
        let start = self.entries.len();
        for &c in &blocks.order[block.range()] {
            let contact = &data.contacts[c as usize];
            let recipe = recipes.of(contact);
            let e = self.entries.len();
            let rows = &mut self.rows;
            rows.push(model, &state.qvel, data, contact, recipe.dim, surface_points(contact, model));
            let inverse =
                if model.opt.flags.diagexact { rows.compliance(e, 0, e, 0) } else { inverse_mass(model, contact) };
            let (reference, softness) = recipe.normal(contact.dist, rows.velocity(e, 0), inverse);
            self.entries.push(Entry {
                source: Source::Contact(c),
                dim: recipe.dim,
                force: contact.force,
                reference,
                softness,
                per_limit: recipe.per_limit,
                stiff: eigenvalues(recipe.dim, |k, l| rows.compliance(e, k, e, l)).map(|x| 1.0 / x),
            });
        }
        self.blocks.push(start..self.entries.len());
    }

    /// Joint limits and dry friction, all in the field's words: a limit is MuJoCo's row, dry friction stops the
    /// joint if `frictionloss` suffices.
    fn add_joints(&mut self, model: &Model, method: &Method, state: &State, data: &Data) {
        let mut add = |row: DofRow, source: Source| {
            let e = self.entries.len();
            self.rows.push_joint(model, &state.qvel, data, row.dof, &row.entries[..row.n]);
            let inverse = self.rows.compliance(e, 0, e, 0);
            self.entries.push(Entry {
                source,
                dim: 1,
                force: [0.0; 6],
                reference: -row.constraint.bias[0],
                softness: 1.0 / row.constraint.cone.d[0],
                per_limit: [1.0 / row.constraint.cone.mu[0]; 5],
                stiff: [1.0 / inverse; 3],
            });
            if source == Source::Limit {
                self.blocks.push(e..e + 1);
            }
        };
        let (h, plan) = (method.timestep, &data.plan);
        limits(model, &plan.limited, h, &state.qpos, &state.qvel, |row| add(row, Source::Limit));
        dry_friction(model, &plan.dry, h, &state.qvel, |row| add(row, Source::Dry));
    }

    /// Solves for the normal forces of a block, all other forces given.
    fn normals(&mut self, block: usize) -> usize {
        let range = self.blocks[block].clone();
        let n = range.len();
        if self.b.len() < n {
            self.a.resize(n * n, 0.0);
            self.factor.resize(n * n, 0.0);
            self.b.resize(n, 0.0);
            self.f.resize(n, 0.0);
            self.pushes.resize(n, true);
        }
        for (i, e) in range.clone().enumerate() {
            self.b[i] = self.entries[e].reference - self.rows.acceleration(e, 0);
        }
        for (i, e) in range.clone().enumerate() {
            for (j, g) in range.clone().take(i + 1).enumerate() {
                let a = self.rows.compliance(e, 0, g, 0);
                self.a[i * n + j] = a;
                self.a[j * n + i] = a;
                // The block's present forces are part of the acceleration: take them out.
                self.b[i] += a * self.entries[g].force[0];
                if j < i {
                    self.b[j] += a * self.entries[e].force[0];
                }
            }
            self.a[i * n + i] += self.entries[e].softness;
        }
        let (a, f) = (&self.a[..n * n], &mut self.f[..n]);
        let solves = complementarity::solve(a, &self.b[..n], f, &mut self.pushes[..n], &mut self.factor[..n * n]);
        for (i, e) in range.enumerate() {
            let force = &mut self.entries[e].force[0];
            self.rows.push_force(e, 0, self.f[i] - *force);
            *force = self.f[i];
        }
        solves
    }

    /// Lets the friction of an entry oppose slip, the normal given. Rolling and spinning come before sliding.
    fn slip(&mut self, method: &Method, e: usize) {
        let Entry { source, dim, force, per_limit, stiff, .. } = self.entries[e];
        match source {
            Source::Dry => self.slip_piece::<1>(method, e, 0, 1.0, [per_limit[0]], stiff[0]),
            Source::Limit => {}
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
        let velocity = std::array::from_fn(|k| self.rows.velocity(e, first + k));
        let acceleration = std::array::from_fn(|k| self.rows.acceleration(e, first + k));
        let next = friction::<N>(method, normal, per_limit, stiff, force, velocity, acceleration);
        for k in 0..N {
            self.rows.push_force(e, first + k, next[k] - force[k]);
            self.entries[e].force[first + k] = next[k];
        }
    }
}
