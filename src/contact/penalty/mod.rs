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
//! start from the last step's forces, so that in steady motion one round is exact; contacts that are new have no such
//! start, and get more rounds. A free body that touches only one plane is solved on its own (`lone`); trees that touch
//! each other take turns (`coupled`), and `rounds` buys accuracy.

mod coupled;
mod drive;
mod lone;

use super::Law;
use super::complementarity::Complementarity;
use crate::data::{Contact, Data};
use crate::dynamics::free;
use crate::forward::Method;
use crate::model::{GeomKind, Model};
use crate::state::{State, Warm};

pub static LAW: Law = Law {
    name: "penalty",
    about: "spring-dampers from solref and solimp, normals solved together, Coulomb friction",
    joints: true,
    solve,
};

/// What the law keeps between steps to avoid allocation; nothing in it carries over but the recipes.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    recipes: drive::Recipes,
    blocks: Blocks,
    solver: Complementarity,
    coupled: coupled::Coupled,
}

fn solve(model: &Model, method: &Method, state: &State, data: &mut Data) {
    let Data { plan, penalty, contacts, movers, xmat, qacc, counts, .. } = data;
    let Scratch { recipes, blocks, solver, .. } = penalty;
    recipes.refresh(model, method.timestep);
    recall(&state.warm, contacts);
    blocks.sort(model, recipes, contacts);
    data.qfrc_constraint.fill(0.0);

    let mut coupled = plan.joint_rows();
    for block in &blocks.all {
        let tree = &model.trees[block.trees[0] as usize];
        let (true, Some(free)) = (block.lone, &tree.free) else {
            coupled = true;
            continue;
        };
        let root = tree.bodies.start;
        let touches = &blocks.touches[block.range()];
        let recipe = recipes.of(&contacts[touches[0].contact as usize]);
        let task = lone::Task { model, method, recipe, touches, mover: &movers[root] };
        let (change, solves) = task.solve(contacts, solver);
        counts.rows += recipe.dim * touches.len();
        counts.solves += solves;
        let aligned = plan.aligned[block.trees[0] as usize];
        let change = if aligned { change } else { free::generalized(free, &xmat[root], &change) };
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
        // Mostly the next one is it.
        let at = if rest.first().is_some_and(same) { Some(0) } else { rest.iter().position(same) };
        if let Some(at) = at {
            contact.force = rest[at].force;
            rest = &rest[at + 1..];
        }
    }
}

/// The step's contacts that push, those between the same two trees together.
#[derive(Clone, Debug, Default)]
struct Blocks {
    touches: Vec<Touch>,
    all: Vec<Block>,
    /// Number of blocks that each tree is part of.
    of_tree: Vec<u32>,
}

/// A contact, after the trees that it touches: as one number, the lower tree in front, then 1 + the other, or 0 for what
/// never moves. (So contacts come in order from the start, unless several bodies touch both that and each other.)
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Touch {
    trees: u64,
    /// Index into `data.contacts`.
    contact: u32,
}

#[derive(Clone, Copy, Debug)]
struct Block {
    start: u32,
    end: u32,
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
    fn sort(&mut self, model: &Model, recipes: &drive::Recipes, contacts: &[Contact]) {
        self.touches.clear();
        let mut sorted = true;
        let (mut bodies, mut trees) = ([NONE; 2], 0);
        for (i, c) in (0..).zip(contacts) {
            if bodies != c.body {
                bodies = c.body;
                let [a, b] = bodies.map(|b| model.bodies[b as usize].tree.map_or(NONE, |t| t as u32));
                let next = u64::from(a.min(b)) << 32 | u64::from(a.max(b).wrapping_add(1));
                sorted &= trees <= next;
                trees = next;
            }
            // Found but not yet within the margin: no force.
            if c.dist < recipes.of(c).margin {
                self.touches.push(Touch { trees, contact: i });
            }
        }
        if !sorted {
            self.touches.sort_unstable();
        }
        self.all.clear();
        self.of_tree.clear();
        self.of_tree.resize(model.trees.len(), 0);
        let mut start = 0;
        while let Some(first) = self.touches.get(start) {
            let mut end = start + 1;
            let mut same = true;
            let contact = &contacts[first.contact as usize];
            while let Some(next) = self.touches.get(end).filter(|t| t.trees == first.trees) {
                same &= alike(model, contact, &contacts[next.contact as usize]);
                end += 1;
            }
            let trees = [(first.trees >> 32) as u32, (first.trees as u32).wrapping_sub(1)];
            for t in trees.into_iter().filter(|&t| t != NONE) {
                self.of_tree[t as usize] += 1;
            }
            let free = trees[1] == NONE && model.trees[trees[0] as usize].free.is_some();
            let lone = free && same && end - start <= lone::MOST;
            self.all.push(Block { start: start as u32, end: end as u32, trees, lone });
            start = end;
        }
        for block in &mut self.all {
            block.lone &= self.of_tree[block.trees[0] as usize] == 1;
        }
    }
}

/// Whether two contacts of a body share their mix and their frame. Those with one plane do.
fn alike(model: &Model, a: &Contact, b: &Contact) -> bool {
    let plane = |c: &Contact| model.geoms[c.geom[0] as usize].kind == GeomKind::Plane;
    a.geom == b.geom && plane(a) || a.mix == b.mix && a.frame == b.frame
}
