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
//! start from the last step's forces, so that in steady motion one round is exact. Trees that touch only what
//! never moves need one round; trees that touch each other take turns, and `rounds` buys accuracy.

use super::impedance::{Reference, clamp, impedance, regularisation};
use super::rows::Rows;
use super::{Law, complementarity, surface_points};
use crate::data::{Contact, Data};
use crate::forward::Method;
use crate::model::{Cone, Mix, Model};
use crate::state::{State, Warm};

pub static LAW: Law = Law {
    name: "penalty",
    about: "spring-dampers from solref and solimp, normals solved together, Coulomb friction",
    solve,
};

/// Scratch of the law; see [`solve`].
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    /// One entry per contact.
    drives: Vec<Drive>,
    /// Contacts sorted into blocks: those between the same two trees stand together.
    order: Vec<u32>,
    blocks: Vec<Block>,
    /// Number of blocks that a tree is part of.
    blocks_of: Vec<u32>,
    // For the normals of one block.
    a: Vec<f64>,
    b: Vec<f64>,
    f: Vec<f64>,
    pushes: Vec<bool>,
    factor: Vec<f64>,
}

/// What drives one contact.
#[derive(Clone, Copy, Debug)]
struct Drive {
    /// a_ref of the normal, m/s².
    reference: f64,
    /// R of the normal, 1/kg.
    softness: f64,
    /// Largest force or torque along each friction row per normal force: two sliding (1), spinning (m), two
    /// rolling (m).
    limits: [f64; 5],
    /// Compliance λ of the sliding, spinning and rolling blocks.
    lambda: [f64; 3],
}

/// Contacts between the same two trees: `order[start..end]`.
#[derive(Clone, Copy, Debug)]
struct Block {
    start: u32,
    end: u32,
}

/// ε of friction under an implicit integrator.
const IMPLICIT_SLIP: f64 = 1e-3;

/// Directions of friction: first row and number of rows of sliding, spinning, rolling.
const FRICTIONS: [(usize, usize); 3] = [(1, 2), (3, 1), (4, 2)];

fn solve(model: &Model, method: &Method, state: &State, data: &mut Data) {
    let mut rows = std::mem::take(&mut data.rows);
    let mut scratch = std::mem::take(&mut data.penalty);

    // Rows, references and the last step's forces.
    rows.begin(model, &state.qvel, data);
    scratch.drives.clear();
    let mut warm = state.warm.iter().peekable();
    for c in 0..data.contacts.len() {
        let contact = data.contacts[c];
        let mix = &model.mixes[contact.mix as usize];
        // Found but not yet within the margin: no force.
        let dim = if contact.dist < mix.margin { mix.condim } else { 0 };
        rows.push(model, data, &contact, dim, surface_points(&contact, model));
        data.counts.rows += dim;
        scratch.drives.push(drive(model, method, &rows, c, &contact, mix));
        if dim > 0
            && let Some(last) = recall(&mut warm, &contact)
        {
            data.contacts[c].force = last.force;
        }
    }
    scratch.sort_into_blocks(&rows);

    // Start from the last step's friction, and from its normals where blocks hang together.
    for block in 0..scratch.blocks.len() {
        let first = if scratch.is_alone(block, &rows) { 1 } else { 0 };
        for &c in scratch.contacts_of(block) {
            let c = c as usize;
            for k in first..rows.contacts[c].dim {
                rows.push_force(c, k, data.contacts[c].force[k]);
            }
            if first == 1 {
                data.contacts[c].force[0] = 0.0;
            }
        }
    }

    for _ in 0..method.rounds {
        for block in 0..scratch.blocks.len() {
            scratch.normals(block, &mut rows, data);
        }
        for block in 0..scratch.blocks.len() {
            scratch.friction(block, method, &mut rows, &mut data.contacts);
        }
    }
    rows.finish(model, data);
    data.rows = rows;
    data.penalty = scratch;
}

/// The remembered force of a contact. Both lists have MuJoCo's contact order, so one walk along both finds all;
/// a contact whose feature is new in its pair starts from nothing.
fn recall<'a>(warm: &mut std::iter::Peekable<std::slice::Iter<'a, Warm>>, contact: &Contact) -> Option<&'a Warm> {
    let mut ahead = warm.clone();
    while let Some(last) = ahead.next() {
        if last.geom == contact.geom && last.feature == contact.feature {
            *warm = ahead;
            return Some(last);
        }
    }
    None
}

fn drive(model: &Model, method: &Method, rows: &Rows, c: usize, contact: &Contact, mix: &Mix) -> Drive {
    let mut drive = Drive { reference: 0.0, softness: 0.0, limits: mix.friction, lambda: [0.0; 3] };
    let dim = rows.contacts[c].dim;
    if dim == 0 {
        return drive;
    }
    let solimp = clamp(&mix.solimp);
    let r = contact.dist - mix.margin;
    let d = impedance(&solimp, r);
    let spring = Reference::new(&mix.solref, &solimp, method.timestep, model.opt.flags.refsafe);
    drive.reference = spring.acceleration(d, r, rows.velocity(c, 0));
    let inverse_mass = if model.opt.flags.diagexact {
        rows.compliance(c, 0, c, 0)
    } else {
        contact.body.iter().map(|&b| model.bodies[b as usize].invweight0[0]).sum()
    };
    drive.softness = regularisation(d, inverse_mass);
    if model.opt.cone == Cone::Pyramidal && dim > 1 {
        let mu2 = mix.friction[0] * mix.friction[0] / model.opt.impratio;
        drive.softness *= mu2 * (1.0 + mix.friction[0] * mix.friction[0]) / (dim - 1) as f64;
    }
    for ((first, count), lambda) in FRICTIONS.into_iter().zip(&mut drive.lambda) {
        if first < dim {
            *lambda = largest_eigenvalue(rows, c, first, count);
        }
    }
    drive
}

/// Largest eigenvalue of the block of A that belongs to `count` (1 or 2) rows of contact c.
fn largest_eigenvalue(rows: &Rows, c: usize, first: usize, count: usize) -> f64 {
    let a = rows.compliance(c, first, c, first);
    if count == 1 {
        return a;
    }
    let b = rows.compliance(c, first + 1, c, first + 1);
    let off = rows.compliance(c, first, c, first + 1);
    0.5 * (a + b) + (0.25 * (a - b) * (a - b) + off * off).sqrt()
}

impl Scratch {
    fn sort_into_blocks(&mut self, rows: &Rows) {
        let key = |c: u32| rows.contacts[c as usize].parts.map(|p| p.tree);
        self.order.clear();
        self.order.extend((0..rows.contacts.len() as u32).filter(|&c| rows.contacts[c as usize].dim > 0));
        if !self.order.is_sorted_by_key(|&c| key(c)) {
            self.order.sort_by_key(|&c| (key(c), c));
        }
        self.blocks.clear();
        self.blocks_of.clear();
        self.blocks_of.resize(rows.trees(), 0);
        let mut start = 0;
        for end in 1..=self.order.len() {
            if end == self.order.len() || key(self.order[end]) != key(self.order[start]) {
                self.blocks.push(Block { start: start as u32, end: end as u32 });
                for tree in key(self.order[start]) {
                    if let Some(count) = self.blocks_of.get_mut(tree as usize) {
                        *count += 1;
                    }
                }
                start = end;
            }
        }
    }

    fn contacts_of(&self, block: usize) -> &[u32] {
        &self.order[self.blocks[block].start as usize..self.blocks[block].end as usize]
    }

    /// Whether no tree of the block is part of another one: then its normals have a direct solution.
    fn is_alone(&self, block: usize, rows: &Rows) -> bool {
        let first = self.contacts_of(block)[0] as usize;
        rows.contacts[first].parts.iter().all(|p| self.blocks_of.get(p.tree as usize).is_none_or(|&n| n == 1))
    }

    /// Solves for the normal forces of a block, all other forces given.
    fn normals(&mut self, block: usize, rows: &mut Rows, data: &mut Data) {
        let Block { start, end } = self.blocks[block];
        let order = &self.order[start as usize..end as usize];
        let n = order.len();
        if self.b.len() < n {
            self.a.resize(n * n, 0.0);
            self.factor.resize(n * n, 0.0);
            self.b.resize(n, 0.0);
            self.f.resize(n, 0.0);
            self.pushes.resize(n, true);
        }
        for (i, &c) in order.iter().enumerate() {
            let c = c as usize;
            for (j, &e) in order[..=i].iter().enumerate() {
                let a = rows.compliance(c, 0, e as usize, 0);
                self.a[i * n + j] = a;
                self.a[j * n + i] = a;
            }
            self.b[i] = self.drives[c].reference - rows.acceleration(c, 0);
        }
        for i in 0..n {
            // The block's present forces are part of the acceleration: take them out.
            self.b[i] += (0..n).map(|j| self.a[i * n + j] * data.contacts[order[j] as usize].force[0]).sum::<f64>();
            self.pushes[i] = true;
        }
        for i in 0..n {
            self.a[i * n + i] += self.drives[order[i] as usize].softness;
        }
        data.counts.solves += complementarity::solve(
            &self.a[..n * n],
            &self.b[..n],
            &mut self.f[..n],
            &mut self.pushes[..n],
            &mut self.factor[..n * n],
        );
        for (i, &c) in order.iter().enumerate() {
            let force = &mut data.contacts[c as usize].force[0];
            rows.push_force(c as usize, 0, self.f[i] - *force);
            *force = self.f[i];
        }
    }

    /// Lets the friction of a block oppose slip, the normals given.
    fn friction(&self, block: usize, method: &Method, rows: &mut Rows, contacts: &mut [Contact]) {
        let h = method.timestep;
        let implicit = method.integrator.implicit;
        for &c in self.contacts_of(block) {
            let c = c as usize;
            let drive = &self.drives[c];
            // Rolling and spinning first: sliding has the last word on the slip.
            for ((first, count), lambda) in FRICTIONS.into_iter().zip(drive.lambda).rev() {
                if first >= rows.contacts[c].dim || lambda <= 0.0 {
                    continue;
                }
                let normal = contacts[c].force[0];
                let mut next = [0.0; 2];
                let mut share = [0.0; 2];
                for k in 0..count {
                    let v = rows.velocity(c, first + k);
                    next[k] = if implicit {
                        -v / (IMPLICIT_SLIP * h * lambda)
                    } else {
                        let slip = v + h * rows.acceleration(c, first + k);
                        contacts[c].force[first + k] - slip / (h * lambda)
                    };
                    share[k] = next[k] / drive.limits[first + k - 1];
                }
                // Inside the ellipse with half-axes μ_k f_n, or on it.
                let size = share[0].hypot(share[1]);
                let scale = if size > normal { normal / size } else { 1.0 };
                for k in 0..count {
                    let force = &mut contacts[c].force[first + k];
                    rows.push_force(c, first + k, next[k] * scale - *force);
                    *force = next[k] * scale;
                }
            }
        }
    }
}
