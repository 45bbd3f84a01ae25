//! Which trees influence one another through constraints, and the constraints of each island.

use super::disjoint_sets::DisjointSets;
use super::free_bodies::{FreeBodies, Room};
use super::ties;
use crate::data::{Contact, Data};
use crate::math::Vec6;
use crate::model::{Mix, Model};

/// Which trees constraints hold together.
#[derive(Clone, Debug, Default)]
pub struct Islands {
    sets: DisjointSets,
    /// Contacts that push each tree, where balls are looked for.
    touched: Vec<u32>,
    /// The balls that are no island's.
    pub alone: Vec<Alone>,
    /// Whether `trees` says that every tree is an island of its own.
    apart: bool,
    /// Number of each tree within its island, once [`Islands::number`] has counted it.
    pub unit: Vec<usize>,
    /// Trees, contacts that push, joint rows and ties by island; the lowest tree of an island is its number.
    trees: Grouped,
    contacts: Grouped,
    joints: Grouped,
    ties: Grouped,
}

/// A ball and the one contact that pushes it.
#[derive(Clone, Copy, Debug)]
pub struct Alone {
    /// Its tree.
    pub tree: usize,
    /// Index into `data.contacts`.
    pub contact: usize,
    /// Which of the two geoms is the ball.
    pub side: usize,
}

/// Asks `push` for the acceleration of each ball, of which it writes the contact's forces; in: what a law has for each mix.
#[inline(always)]
pub fn push_each<T>(
    alone: &[Alone],
    of_mix: &[T],
    contacts: &mut [Contact],
    room: &mut Room,
    push: impl Fn(&T, &Alone, &mut Contact) -> Vec6,
) {
    for ball in alone {
        let contact = &mut contacts[ball.contact];
        room.acceleration[ball.tree] = push(&of_mix[contact.mix as usize], ball, contact);
    }
}

/// Items by group: those of group g are `items[start[g]..start[g + 1]]`, in their old order.
#[derive(Clone, Debug, Default)]
struct Grouped {
    /// The group of each item.
    label: Vec<u32>,
    start: Vec<usize>,
    items: Vec<usize>,
}

/// Of no group.
const NONE: u32 = u32::MAX;

impl Grouped {
    fn reserve(&mut self, groups: usize, items: usize) {
        self.label.reserve(items);
        self.start.reserve(groups + 2);
        self.items.reserve(items);
    }

    /// Labels the items and sorts them.
    fn group(&mut self, groups: usize, label: impl Iterator<Item = u32>) {
        self.label.clear();
        self.label.extend(label);
        self.sort(groups);
    }

    /// Sorts items by their labels (counting sort); those without are left out.
    fn sort(&mut self, groups: usize) {
        let Grouped { label: labels, start, items } = self;
        start.clear();
        start.resize(groups + 2, 0);
        for &g in labels.iter().filter(|g| **g != NONE) {
            start[g as usize + 2] += 1;
        }
        for g in 2..groups + 2 {
            start[g] += start[g - 1];
        }
        items.clear();
        items.resize(start[groups + 1], 0);
        for (item, &g) in labels.iter().enumerate().filter(|(_, g)| **g != NONE) {
            let place = &mut start[g as usize + 1];
            items[*place] = item;
            *place += 1;
        }
    }

    /// All of them in the first and only group.
    fn one_group(&mut self, items: impl Iterator<Item = usize>) {
        self.items.clear();
        self.items.extend(items);
        self.start.clear();
        self.start.extend([0, self.items.len()]);
    }

    /// Nothing in any group.
    fn empty(&mut self) {
        self.start.clear();
    }

    #[inline(always)]
    fn of(&self, group: usize) -> &[usize] {
        if self.start.is_empty() { &[] } else { &self.items[self.start[group]..self.start[group + 1]] }
    }
}

impl Islands {
    /// Whether room was made for this model's trees.
    pub fn fit(&self, model: &Model) -> bool {
        self.unit.len() == model.trees.len()
    }

    /// Makes room for all trees, and so many contacts and joint rows.
    pub fn reserve(&mut self, model: &Model, contacts: usize, joints: usize, ties: usize) {
        let trees = model.trees.len();
        self.sets.reset(trees);
        self.unit.resize(trees, 0);
        self.touched.reserve(trees);
        self.alone.reserve(trees.min(contacts));
        self.trees.reserve(trees, trees);
        self.contacts.reserve(trees, contacts);
        self.joints.reserve(trees, joints);
        self.ties.reserve(trees, ties);
    }

    /// Finds the balls ([`Plan::balls`](crate::dynamics::plan::Plan::balls)) that are pushed by one contact only, with what
    /// never moves, if it is one that `may` be left out of the islands.
    pub fn set_balls_apart(&mut self, model: &Model, data: &Data, may: impl Fn(&Mix) -> bool) {
        let Islands { touched, alone, .. } = self;
        alone.clear();
        touched.clear();
        touched.resize(model.trees.len(), 0);
        for (contact, c) in data.contacts.iter().enumerate().filter(|(_, c)| c.pushes(model)) {
            let (tree, side) = match c.body.map(|b| model.bodies[b as usize].tree) {
                [Some(tree), None] => (tree, 0),
                [None, Some(tree)] => (tree, 1),
                both => {
                    both.into_iter().flatten().for_each(|t| touched[t] += 1);
                    continue;
                }
            };
            touched[tree] += 1;
            if touched[tree] == 1 && data.plan.balls[tree] && may(&model.mixes[c.mix as usize]) {
                alone.push(Alone { tree, contact, side });
            }
        }
        alone.retain(|ball| touched[ball.tree] == 1);
    }

    /// Finds the islands: trees joined by contacts that push, and by ties.
    ///
    /// Reads: contacts, joint_rows, ties.
    pub fn find(&mut self, model: &Model, data: &Data) {
        if model.trees.len() == 1 {
            self.all_in_one(model, data);
            return;
        }
        let mut joined = false;
        self.join_contacts(model, data, &mut joined);
        for tie in &data.ties {
            let (blocks, _) = ties::rows(data, tie);
            for pair in blocks.windows(2) {
                self.join(pair[0].tree, pair[1].tree, model, &mut joined);
            }
        }
        self.group_all(model, data, joined);
    }

    /// Joins the two trees of each contact that pushes, and labels it with one of them; not those of balls that are alone.
    fn join_contacts(&mut self, model: &Model, data: &Data, joined: &mut bool) {
        self.contacts.label.clear();
        let mut next_alone = 0;
        // Contacts of the same two bodies mostly follow one another.
        let (mut bodies, mut of_bodies) = ([u32::MAX; 2], NONE);
        for (i, c) in data.contacts.iter().enumerate() {
            let alone = self.alone.get(next_alone).is_some_and(|alone| alone.contact == i);
            next_alone += usize::from(alone);
            let label = if c.pushes(model) && !alone {
                if c.body != bodies {
                    let [a, b] = c.body.map(|b| model.bodies[b as usize].tree);
                    if let (Some(a), Some(b)) = (a, b)
                        && a != b
                    {
                        self.join(a, b, model, joined);
                    }
                    (bodies, of_bodies) = (c.body, a.or(b).map_or(NONE, |t| t as u32));
                }
                of_bodies
            } else {
                NONE
            };
            self.contacts.label.push(label);
        }
    }

    #[inline(always)]
    fn join(&mut self, a: usize, b: usize, model: &Model, joined: &mut bool) {
        if !*joined {
            self.sets.reset(model.trees.len());
            *joined = true;
        }
        self.sets.union(a, b);
    }

    /// [`Islands::find`] for one tree.
    fn all_in_one(&mut self, model: &Model, data: &Data) {
        let shared = self.alone.is_empty();
        let contacts = data.contacts.iter().enumerate().filter(|(_, c)| shared && c.pushes(model)).map(|(i, _)| i);
        if !self.apart {
            self.trees.one_group(0..1);
            self.apart = true;
        }
        self.contacts.one_group(contacts);
        self.joints.one_group(0..data.joint_rows.len());
        self.ties.one_group(0..data.ties.len());
    }

    /// Puts all trees into one island, which has the number 0.
    pub fn find_one(&mut self, model: &Model, data: &Data) {
        self.sets.reset(model.trees.len());
        (1..model.trees.len()).for_each(|t| self.sets.union(0, t));
        self.join_contacts(model, data, &mut true);
        self.group_all(model, data, true);
    }

    fn group_all(&mut self, model: &Model, data: &Data, joined: bool) {
        let Islands { sets, apart, trees, contacts, joints, ties, .. } = self;
        let count = model.trees.len();
        if joined || !*apart {
            trees.group(count, (0..count).map(|t| if joined { sets.find(t) as u32 } else { t as u32 }));
            *apart = !joined;
        }
        if joined {
            let island = |t: &mut u32| *t = trees.label[*t as usize];
            contacts.label.iter_mut().filter(|t| **t != NONE).for_each(island);
        }
        contacts.sort(count);
        let label = |t: Option<usize>| t.map_or(NONE, |t| trees.label[t]);
        if data.joint_rows.is_empty() {
            joints.empty();
        } else {
            joints.group(count, data.joint_rows.iter().map(|r| label(model.bodies[model.dofs[r.dof].body].tree)));
        }
        if data.ties.is_empty() {
            ties.empty();
        } else {
            let first = |tie| ties::rows(data, tie).0.first().map(|block| block.tree);
            ties.group(count, data.ties.iter().map(|tie| label(first(tie))));
        }
    }

    /// Whether no constraint acts in an island.
    #[inline]
    pub fn idle(&self, group: usize) -> bool {
        self.contacts.of(group).is_empty() && self.joints.of(group).is_empty() && self.ties.of(group).is_empty()
    }

    /// An island of free bodies, or of bodies that are uncoupled, where nothing acts but contacts.
    #[inline]
    pub fn free_bodies(&self, model: &Model, data: &Data, group: usize) -> Option<FreeBodies<'_>> {
        let trees = self.trees.of(group);
        let alone = self.joints.of(group).is_empty() && self.ties.of(group).is_empty();
        let free = alone && trees.iter().all(|&t| model.trees[t].free.is_some() || data.plan.uncoupled[t].is_some());
        free.then(|| FreeBodies { trees, contacts: self.contacts.of(group) })
    }

    /// Trees, contacts and joint rows of an island: indices into the model's trees and into `data`.
    #[inline]
    pub fn group(&self, group: usize) -> (&[usize], &[usize], &[usize]) {
        (self.trees.of(group), self.contacts.of(group), self.joints.of(group))
    }

    /// Ties of an island: indices into `data.ties`.
    pub fn ties(&self, group: usize) -> &[usize] {
        self.ties.of(group)
    }

    /// Asks `add` for the number of each tree of the island.
    pub fn number(&mut self, group: usize, mut add: impl FnMut(usize) -> usize) {
        for &t in self.trees.of(group) {
            self.unit[t] = add(t);
        }
    }
}
