//! Which trees influence one another through constraints, and the constraints of each island.

use super::disjoint_sets::DisjointSets;
use crate::data::{Contact, Data};
use crate::model::Model;

#[derive(Clone, Debug, Default)]
pub struct Islands {
    sets: DisjointSets,
    /// Number of each tree within its island, once [`Islands::number`] has counted it.
    pub unit: Vec<usize>,
    /// Trees, contacts that push, and joint rows by island; the lowest tree of an island is its number.
    trees: Grouped,
    contacts: Grouped,
    joints: Grouped,
}

/// Items by group: those of group g are `items[start[g]..start[g + 1]]`, in their old order.
#[derive(Clone, Debug, Default)]
struct Grouped {
    start: Vec<usize>,
    items: Vec<usize>,
}

impl Grouped {
    fn reserve(&mut self, groups: usize, items: usize) {
        self.start.reserve(groups + 2);
        self.items.reserve(items);
    }

    /// Sorts the items 0, 1, … by `group` (counting sort); those of none are left out.
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

impl Islands {
    pub fn reserve(&mut self, model: &Model, contacts: usize, joints: usize) {
        let trees = model.trees.len();
        self.sets.reset(trees);
        self.unit.resize(trees, 0);
        self.trees.reserve(trees, trees);
        self.contacts.reserve(trees, contacts);
        self.joints.reserve(trees, joints);
    }

    /// Finds the islands: trees joined by contacts that push.
    ///
    /// Reads: contacts, joint_rows.
    pub fn find(&mut self, model: &Model, data: &Data) {
        let count = model.trees.len();
        self.sets.reset(count);
        for c in &data.contacts {
            if let [Some(a), Some(b)] = c.body.map(|b| model.bodies[b as usize].tree)
                && a != b
                && pushes(model, c)
            {
                self.sets.union(a, b);
            }
        }
        self.group_all(model, data);
    }

    /// Puts all trees into one island, which has the number 0.
    pub fn find_one(&mut self, model: &Model, data: &Data) {
        self.sets.reset(model.trees.len());
        (1..model.trees.len()).for_each(|t| self.sets.union(0, t));
        self.group_all(model, data);
    }

    fn group_all(&mut self, model: &Model, data: &Data) {
        let Islands { sets, trees, contacts, joints, .. } = self;
        let count = model.trees.len();
        let tree = |body: u32| model.bodies[body as usize].tree;
        trees.sort(count, count, |t| Some(sets.find(t)));
        contacts.sort(count, data.contacts.len(), |i| {
            let c = &data.contacts[i];
            let any = tree(c.body[0]).or(tree(c.body[1])).filter(|_| pushes(model, c));
            any.map(|t| sets.find(t))
        });
        joints.sort(count, data.joint_rows.len(), |i| {
            model.bodies[model.dofs[data.joint_rows[i].dof].body].tree.map(|t| sets.find(t))
        });
    }

    /// Trees, contacts and joint rows of an island: indices into the model's trees and into `data`.
    pub fn group(&self, group: usize) -> (&[usize], &[usize], &[usize]) {
        (self.trees.of(group), self.contacts.of(group), self.joints.of(group))
    }

    /// Asks `add` for the number of each tree of the island.
    pub fn number(&mut self, group: usize, mut add: impl FnMut(usize) -> usize) {
        for &t in self.trees.of(group) {
            self.unit[t] = add(t);
        }
    }
}

/// Whether a contact pushes, or is merely near.
fn pushes(model: &Model, contact: &Contact) -> bool {
    contact.dist < model.mixes[contact.mix as usize].margin
}
