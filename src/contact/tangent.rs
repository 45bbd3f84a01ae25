//! Constraint forces at accelerations that are known, and how they change with the velocity: what an implicit step needs.
//!
//! Backward Euler knows the acceleration that belongs to a guess v' of the velocity at the end of the step,
//! a = (v' − v)/h. Then the forces of a law are formulas, one a constraint, and nothing need be solved for them. Where
//! v' solves the step, they are the forces that the law's solution has there.

use super::island::{Island, Source};
use super::{Law, Scratch, Settings, Task, assemble, find_rows};
use crate::data::{Data, JointRowKind, Outcome, Scratchpad, TieKind};
use crate::model::Model;
use crate::state::State;

/// Shift for differences, relative to the numbers that are shifted: half of their digits.
const SHIFT: f64 = 1e-8;
/// The least shift, m/s or rad/s: for what is at rest.
const LEAST_SHIFT: f64 = 1e-14;

/// The islands, and how much their constraint forces oppose a change of velocity.
#[derive(Clone, Debug, Default)]
pub struct Tangent {
    /// All dofs, those of one island together, tree by tree.
    pub dofs: Vec<usize>,
    /// Island i is `dofs[starts[i]..starts[i + 1]]`.
    pub starts: Vec<usize>,
    /// The trees of all islands in the same order, and where the dofs of each begin in `dofs`.
    pub trees: Vec<(usize, usize)>,
    /// −h ∂(Jᵀ f)/∂v' of each island, row-major, kg (kg m, kg m²).
    pub blocks: Vec<f64>,
    /// Forces of an island's constraints, and their derivatives ∂f/∂(J v').
    forces: Vec<[f64; 6]>,
    slopes: Vec<[[f64; 6]; 6]>,
    /// By how much the velocities of each constraint are shifted to differentiate.
    shifts: Vec<f64>,
}

/// Forces of all constraints at the accelerations `a` (nv), each by its own formula, and what they do; beside it
/// [`super::constrain`] finds the accelerations as well.
///
/// Reads:  state, kinematics, contacts, qacc_smooth. Writes: qacc, qfrc_constraint, forces of contacts and joint rows.
pub fn constrain_at(model: &Model, settings: &Settings, state: &State, a: &[f64], data: &mut Data) {
    data.qfrc_constraint.fill(0.0);
    data.solver = Outcome::default();
    find_rows(model, settings, state, data);
    if data.contacts.is_empty() && data.joint_rows.is_empty() && data.ties.is_empty() {
        return;
    }
    let mut pad = std::mem::take(&mut data.scratch);
    let Scratch { islands, island, own, .. } = Scratch::of(&mut pad, model, data);
    islands.find(model, data);
    for group in 0..model.trees.len() {
        let (_, contacts, joints) = islands.group(group);
        if contacts.is_empty() && joints.is_empty() && islands.ties(group).is_empty() {
            continue;
        }
        let task = Task { model, settings, state, data };
        assemble(&task, islands, group, island, false);
        island.take_rates(model, data, a);
        respond(settings.law, &task, own, island);
        island.push_forces();
        data.counts.rows += island.row_count();
        island.finish(model, data);
    }
    data.scratch = pad;
}

/// How the forces that [`constrain_at`] has just found change with the velocity v' at the end of the step:
///
///     ∂(Jᵀ f)/∂v' = Jᵀ F J,     F = ∂f/∂(J v')
///
/// F, a small matrix a constraint, contains all that v' changes of it: velocity by 1, acceleration by 1/h, distance by h.
/// It is taken by differences of the law's formula, exact but for half of the digits. J counts as constant; forces at a
/// lever that turns within the step are h² f/r smaller than inertia.
///
/// Reads:  state, kinematics, contacts, joint_rows.
pub fn tangent(model: &Model, settings: &Settings, state: &State, a: &[f64], data: &mut Data, tangent: &mut Tangent) {
    let Tangent { dofs, starts, trees, blocks, forces, slopes, shifts } = tangent;
    dofs.clear();
    starts.clear();
    trees.clear();
    blocks.clear();
    starts.push(0);
    let mut pad = std::mem::take(&mut data.scratch);
    let Scratch { islands, island, own, .. } = Scratch::of(&mut pad, model, data);
    islands.find(model, data);
    for group in 0..model.trees.len() {
        let (members, contacts, joints) = islands.group(group);
        if members.is_empty() {
            continue;
        }
        let first = dofs.len();
        for &t in members {
            trees.push((t, dofs.len()));
            dofs.extend(model.trees[t].dofs.clone());
        }
        starts.push(dofs.len());
        let (at, n) = (blocks.len(), dofs.len() - first);
        blocks.resize(at + n * n, 0.0);
        if contacts.is_empty() && joints.is_empty() && islands.ties(group).is_empty() {
            continue;
        }
        assemble(&Task { model, settings, state, data }, islands, group, island, false);
        island.take_rates(model, data, a);
        differentiate(model, settings, state, data, own, island, forces, slopes, shifts);
        island.add_tangent(model, data, -settings.timestep, slopes, &mut blocks[at..]);
    }
    data.scratch = pad;
}

/// Forces of the island's constraints at the velocities and accelerations of their rows.
fn respond(law: &Law, task: &Task, own: &mut Scratchpad, island: &mut Island) {
    match law.pose {
        Some(pose) => {
            pose(task, own, island);
            island.constraints.iter_mut().for_each(|c| c.respond());
        }
        None => _ = (law.solve)(task, own, island),
    }
}

/// F of each constraint of an island, into `slopes`.
fn differentiate(
    model: &Model,
    settings: &Settings,
    state: &State,
    data: &mut Data,
    own: &mut Scratchpad,
    island: &mut Island,
    forces: &mut Vec<[f64; 6]>,
    slopes: &mut Vec<[[f64; 6]; 6]>,
    shifts: &mut Vec<f64>,
) {
    let (law, h) = (settings.law, settings.timestep);
    respond(law, &Task { model, settings, state, data }, own, island);
    forces.clear();
    forces.extend(island.constraints.iter().map(|c| c.force));
    slopes.clear();
    slopes.resize(forces.len(), [[0.0; 6]; 6]);
    // Numbers, whatever their units: what is small beside them would drown in their rounding.
    let sum = |x: &[f64]| x.iter().map(|x| x.abs()).sum::<f64>();
    shifts.clear();
    shifts.extend(
        island.constraints.iter().map(|c| LEAST_SHIFT + SHIFT * (sum(&c.velocity) + h * (sum(&c.rate) + sum(&c.bias)))),
    );
    let widest = island.constraints.iter().map(|c| c.cone.dim).max().unwrap_or(0);
    for k in 0..widest {
        // Deeper, where a contact that has only just been touched pushes.
        island.shift(data, k, h, -1.0, shifts);
        respond(law, &Task { model, settings, state, data }, own, island);
        for (i, c) in island.constraints.iter().enumerate().filter(|(_, c)| k < c.cone.dim) {
            for row in 0..c.cone.dim {
                slopes[i][row][k] = (forces[i][row] - c.force[row]) / shifts[i];
            }
        }
        island.shift(data, k, h, 1.0, shifts);
    }
}

impl Island {
    /// Takes the accelerations of all rows, J a, from those of the dofs.
    fn take_rates(&mut self, model: &Model, data: &Data, a: &[f64]) {
        self.guess(model, data, a);
        self.multiply_w(|c, product| c.rate = std::array::from_fn(|k| product[k] + c.smooth[k]));
    }

    /// Shifts row k of every constraint: its velocity by that of `shifts` times `sign`, and what depends on it.
    fn shift(&mut self, data: &mut Data, k: usize, h: f64, sign: f64, shifts: &[f64]) {
        for ((c, source), shift) in self.constraints.iter_mut().zip(&self.sources).zip(shifts) {
            let change = sign * shift;
            c.velocity[k] += change;
            c.rate[k] += change / h;
            match *source {
                Source::Contact(i) if k == 0 => data.contacts[i].dist += h * change,
                Source::Joint(i) if k == 0 && data.joint_rows[i].kind != JointRowKind::DryFriction => {
                    data.joint_rows[i].violation += h * change;
                }
                Source::Tie(i) if k < c.cone.dim && data.ties[i].kind != TieKind::DryFriction => {
                    data.ties[i].violation[k] += h * change;
                }
                _ => {}
            }
        }
    }
}
