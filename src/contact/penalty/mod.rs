//! Penny's own law: MuJoCo's spring and damper at each contact, Coulomb friction that opposes slip.
//!
//! **Normals.** One contact pushes with the force that MuJoCo's model gives it,
//!
//!     f_n = max(0, (a_ref − a_u) / (A + R))          N
//!
//! with A = J M⁻¹ Jᵀ the inverse mass along the normal (1/kg), a_u = J·acc the acceleration without this force,
//! a_ref = −B v_n − K d r the one that spring and damper ask for, and R the softness ([`super::impedance`]).
//! Several contacts share a body: then A is a matrix, and its off-diagonal part is what keeps a box from
//! rocking. All contacts between the same two trees are solved together ([`super::complementarity`]).
//! In pyramidal scenes MuJoCo's normals are stiffer: R is multiplied by μ²(1 + μ²)/(condim − 1) there
//! (the rest state of 2(condim − 1) pyramid edges). Penny does the same, so that resting depths agree.
//!
//! **Friction** is Coulomb's law on velocities: the slip at the end of the step, s = v_t + h a_t, is stopped if
//! the force needed stays within the limit, otherwise the force has the limit's size and opposes the slip:
//!
//!     f_t ← clip(f_t − s / (h λ), μ f_n)
//!
//! with h the timestep and λ the largest eigenvalue of the 2 × 2 block of A (1/kg): a step by a scalar keeps the
//! direction of the slip. Spinning (μ_spin, m) and rolling (μ_roll, m) likewise, each with its own limit. The
//! normal force does not feel the slip, so that sliding contacts do not hop, as MuJoCo's do.
//!
//! Under an implicit integrator the law is asked for the force at a velocity that is already that of the end of
//! the step. Then friction is a function of that velocity alone: a steep line through zero, clipped to the limit,
//!
//!     f_t = clip(−v_t / (ε h λ), μ f_n),     ε = 1e-3        (a body at rest on a slope creeps by ε h g sin θ)
//!
//! Normals then switch on over a small depth ([`super::impedance::onset`]).
//!
//! **One round** is the normals with the friction of the step before, then friction with these normals. Both
//! start from the last step's forces, so that in steady motion one round is exact; contacts that are new have no such
//! start, and get more rounds, as do implicit integrators, whose equation must not depend on the step before. A free
//! body that touches only one plane is solved on its own (`lone`); trees that touch each other take turns (`coupled`),
//! and `rounds` buys accuracy.

mod coupled;
mod drive;
mod lone;

use self::drive::Recipes;
use super::Law;
use super::complementarity::Complementarity;
use super::describe::{self, Creep, Description, Unlike};
use crate::data::{Contact, Data, Meeting};
use crate::dynamics::free;
use crate::forward::Method;
use crate::model::Model;
use crate::state::{Start, State, Warm};

pub static LAW: Law = Law {
    name: "penalty",
    about: "spring-dampers from solref and solimp, normals solved together, Coulomb friction",
    joints: true,
    start: Start::Forces,
    solve,
    friction: |_, mix| mix.friction,
    describe: |ask| Description {
        // Its friction acts on the velocity at the end of the step.
        creep: Some(if ask.slides(ask.model.mixes[ask.touch.mix].friction[0]) { Creep::Slides } else { Creep::Sticks }),
        ..describe::soft(ask)
    },
    unlike: Some(Unlike {
        normal: |_, _| "MuJoCo finds all forces of an island together, penalty in turns (--rounds)".to_owned(),
        friction: "MuJoCo softens friction (its R) and lets it change the normal force, penalty does neither",
    }),
};

/// What the law keeps between steps to avoid allocation; nothing in it carries over but the recipes.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    recipes: Recipes,
    blocks: Blocks,
    solver: Complementarity,
    coupled: coupled::Coupled,
}

fn solve(model: &Model, method: &Method, state: &State, data: &mut Data) {
    let Data { plan, penalty, contacts, meetings, movers, xmat, qacc, counts, .. } = data;
    let Scratch { recipes, blocks, solver, .. } = penalty;
    recipes.refresh(model, method);
    recall(&state.warm, contacts);
    blocks.sort(model, recipes, contacts, meetings);
    data.qfrc_constraint.fill(0.0);

    let mut coupled = plan.joint_rows();
    for block in &blocks.all {
        let t = block.trees.0;
        let (true, Some(free)) = (block.lone, &model.trees[t].free) else {
            coupled = true;
            continue;
        };
        let contacts = &mut contacts[block.contacts()];
        let (dofs, root) = (model.trees[t].dofs.clone(), model.trees[t].bodies.start);
        let task = lone::Task { model, method, recipe: recipes.of(&contacts[0]), mover: &movers[root] };
        let (change, rows, solves) = task.solve(contacts, solver);
        counts.rows += rows;
        counts.solves += solves;
        let change = if plan.aligned[t] { change } else { free::generalized(free, &xmat[root], &change) };
        for (qacc, change) in qacc[dofs].iter_mut().zip(change.iter()) {
            *qacc += change;
        }
    }
    if coupled {
        coupled::solve(model, method, state, data);
    }
}

/// Gives every contact the force that the last step remembered for it; new ones start from nothing.
///
/// Both lists have MuJoCo's contact order, so one walk along both finds all.
fn recall(warm: &[Warm], contacts: &mut [Contact]) {
    let mut rest = warm;
    for contact in contacts {
        let same = |w: &Warm| w.geom == contact.geom && w.feature == contact.feature;
        // Mostly the next one is it.
        let at = if rest.first().is_some_and(same) { Some(0) } else { rest.iter().position(same) };
        if let Some(at) = at {
            contact.force = rest[at].force;
            rest = &rest[at + 1..];
        }
    }
}

/// The meetings some of whose contacts push, those between the same two trees one after the other.
#[derive(Clone, Debug, Default)]
struct Blocks {
    all: Vec<Block>,
    /// Number of blocks that each tree is part of.
    of_tree: Vec<u32>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Block {
    /// The lower tree, then the other; none where that geom never moves.
    trees: (usize, Option<usize>),
    start: u32,
    end: u32,
    /// One free body that touches nothing else that moves, all contacts of one mix and in one frame.
    lone: bool,
}

impl Block {
    fn contacts(&self) -> std::ops::Range<usize> {
        self.start as usize..self.end as usize
    }
}

impl Blocks {
    fn sort(&mut self, model: &Model, recipes: &Recipes, contacts: &[Contact], meetings: &[Meeting]) {
        let Blocks { all, of_tree } = self;
        all.clear();
        of_tree.clear();
        of_tree.resize(model.trees.len(), 0);
        for &Meeting { body, start, end, alike } in meetings {
            let met = &contacts[start as usize..end as usize];
            let trees = match body.map(|b| model.bodies[b as usize].tree) {
                [Some(a), Some(b)] => (a.min(b), Some(a.max(b))),
                [Some(t), None] | [None, Some(t)] => (t, None),
                [None, None] => continue,
            };
            if !met.iter().any(|c| recipes.of(c).reaches(c)) {
                continue;
            }
            of_tree[trees.0] += 1;
            trees.1.into_iter().for_each(|t| of_tree[t] += 1);
            let free = trees.1.is_none() && model.trees[trees.0].free.is_some();
            all.push(Block { trees, start, end, lone: free && alike && met.len() <= lone::MOST });
        }
        all.sort_unstable();
        for block in all {
            block.lone &= of_tree[block.trees.0] == 1;
        }
    }
}
