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
//! **One round** is the normals with the friction of the step before, then friction with these normals. Both
//! start from the last step's forces, so that in steady motion one round is exact. A free body that touches only
//! one plane is solved on its own (`lone`); trees that touch each other take turns (`coupled`), and
//! `rounds` buys accuracy.

mod coupled;
mod drive;
mod lone;

use super::Law;
use crate::data::{Contact, Data};
use crate::dynamics::free;
use crate::forward::Method;
use crate::model::Model;
use crate::state::{State, Warm};

pub static LAW: Law = Law {
    name: "penalty",
    about: "spring-dampers from solref and solimp, normals solved together, Coulomb friction",
    solve,
};

/// What the law keeps between steps to avoid allocation; nothing in it carries over but the recipes.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    recipes: drive::Recipes,
    blocks: Blocks,
    lone: lone::Lone,
    coupled: coupled::Coupled,
}

fn solve(model: &Model, method: &Method, state: &State, data: &mut Data) {
    let Data { penalty, contacts, movers, xmat, qacc, counts, .. } = data;
    let Scratch { recipes, blocks, lone, .. } = penalty;
    recipes.refresh(model, method.timestep);
    recall(&state.warm, contacts);
    blocks.sort(model, contacts);
    qacc.copy_from_slice(&data.qacc_smooth);
    data.qfrc_constraint.fill(0.0);

    let mut coupled = data.plan.joint_rows();
    for block in &blocks.all {
        let tree = &model.trees[block.trees[0] as usize];
        let (true, Some(free)) = (block.lone, &tree.free) else {
            coupled = true;
            continue;
        };
        let root = tree.bodies.start;
        let order = &blocks.order[block.range()];
        let recipe = recipes.of(&contacts[order[0] as usize]);
        let change = lone.solve(model, method, recipe, order, &movers[root], contacts, counts);
        let change = free::generalized(free, &xmat[root], &change);
        for (qacc, change) in qacc[tree.dofs.clone()].iter_mut().zip(change.iter()) {
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
        if let Some(at) = rest.iter().position(same) {
            contact.force = rest[at].force;
            rest = &rest[at + 1..];
        }
    }
}

/// The step's contacts, those between the same two trees together.
#[derive(Clone, Debug, Default)]
struct Blocks {
    /// Indices into `data.contacts`.
    order: Vec<u32>,
    all: Vec<Block>,
    /// Number of blocks that each tree is part of.
    of_tree: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Block {
    start: u32,
    end: u32,
    /// The trees that touch, the lower first; `NONE` for what never moves.
    trees: [u32; 2],
    /// One free body that touches nothing else that moves, all contacts of one mix and in one frame.
    lone: bool,
}

const NONE: u32 = u32::MAX;

impl Block {
    fn range(&self) -> std::ops::Range<usize> {
        self.start as usize..self.end as usize
    }
}

impl Blocks {
    fn sort(&mut self, model: &Model, contacts: &[Contact]) {
        let trees = |c: u32| {
            let [a, b] = contacts[c as usize].body.map(|b| model.bodies[b as usize].tree.map_or(NONE, |t| t as u32));
            if a <= b { [a, b] } else { [b, a] }
        };
        // Found but not yet within the margin: no force.
        let pushes = |c: &u32| contacts[*c as usize].dist < model.mixes[contacts[*c as usize].mix as usize].margin;
        self.order.clear();
        self.order.extend((0..contacts.len() as u32).filter(pushes));
        if !self.order.is_sorted_by_key(|&c| trees(c)) {
            self.order.sort_by_key(|&c| (trees(c), c));
        }
        self.all.clear();
        self.of_tree.clear();
        self.of_tree.resize(model.trees.len(), 0);
        for (i, &c) in self.order.iter().enumerate() {
            let pair = trees(c);
            match self.all.last_mut() {
                Some(last) if last.trees == pair => last.end += 1,
                _ => {
                    self.all.push(Block { start: i as u32, end: i as u32 + 1, trees: pair, lone: false });
                    for t in pair.into_iter().filter(|&t| t != NONE) {
                        self.of_tree[t as usize] += 1;
                    }
                }
            }
        }
        for block in &mut self.all {
            let [a, b] = block.trees;
            let apart = b == NONE && self.of_tree[a as usize] == 1 && model.trees[a as usize].free.is_some();
            let own = &self.order[block.range()];
            let first = &contacts[own[0] as usize];
            let alike = |c: &Contact| c.mix == first.mix && c.frame == first.frame;
            block.lone = apart && own[1..].iter().all(|&c| alike(&contacts[c as usize]));
        }
    }
}
