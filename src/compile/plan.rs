//! What a scene requires, as data: `penny explain` prints it, tests assert it.

use std::collections::BTreeSet;

use crate::collision::{collider, exact};
use crate::model::{GeomKind, Joint, Model, Plan};

pub fn plan(model: &Model) -> Plan {
    let springs = model.opt.flags.spring;
    let dampers = model.opt.flags.damper;
    let joints = |has: &dyn Fn(&Joint) -> bool| model.joints.iter().filter(|j| has(j)).count();
    let dof = |joint: &Joint| &model.dofs[joint.dofadr];
    let articulated = model.trees.iter().filter(|t| t.free.is_none());
    let constraint = model.opt.flags.constraint;
    Plan {
        moving_bodies: model.bodies.iter().filter(|b| b.tree.is_some()).count(),
        free_trees: model.trees.iter().filter(|t| t.free.is_some()).count(),
        articulated_trees: articulated.clone().count(),
        rotating_trees: model.trees.iter().filter(|t| t.rotates).count(),
        largest_matrix: articulated.map(|t| t.dofs.len()).max().unwrap_or(0),
        coupled: model.trees.iter().any(|t| t.bodies.clone().filter(|&b| model.bodies[b].weld == b).count() > 1),
        pairs: model.pairs.listed.len(),
        swept: model.pairs.swept.len(),
        colliders: colliders(model),
        colliding_geoms: colliding_geoms(model),
        condim: model.mixes.iter().map(|m| m.condim).max().unwrap_or(0),
        limits: joints(&|j| j.range.is_some() && model.opt.flags.limit && constraint),
        springs: joints(&|j| j.stiffness != 0.0 && springs),
        dampers: joints(&|j| dof(j).damping != 0.0 && dampers),
        frictionloss: joints(&|j| dof(j).frictionloss > 0.0 && model.opt.flags.frictionloss && constraint),
        armature: joints(&|j| dof(j).armature != 0.0),
        actuators: if model.opt.flags.actuation { model.actuators.len() } else { 0 },
    }
}

fn colliding_geoms(model: &Model) -> Vec<usize> {
    let listed = model.pairs.listed.iter().flat_map(|p| p.geom);
    let geoms: BTreeSet<usize> = listed.chain(model.pairs.swept.iter().copied()).collect();
    geoms.into_iter().collect()
}

/// The shapes that can meet: those of the listed pairs, and all combinations of the swept kinds.
fn colliders(model: &Model) -> Vec<[GeomKind; 2]> {
    let kind = |g: usize| model.geoms[g].kind;
    let mut found: BTreeSet<[GeomKind; 2]> = model.pairs.listed.iter().map(|p| p.geom.map(kind)).collect();
    let swept: BTreeSet<GeomKind> = model.pairs.swept.iter().map(|&g| kind(g)).collect();
    for &a in &swept {
        found.extend(swept.range(a..).map(|&b| [a, b]).filter(|&[a, b]| collider(a, b).is_some()));
    }
    found.into_iter().collect()
}

impl Plan {
    /// The plan in words: what is computed, and what is not needed.
    pub fn describe(&self, model: &Model) -> Vec<String> {
        let mut lines = Vec::new();
        lines.push(match self.moving_bodies {
            0 => "nothing moves".into(),
            n => format!("{} of {} move, in {}", count(n, "body", "bodies"), model.bodies.len() - 1, self.trees()),
        });
        lines.push(match (self.pairs, self.swept) {
            (0, 0) => "no contacts: nothing can touch".into(),
            (pairs, 0) => format!("{} can touch: {}", count(pairs, "pair of geoms", "pairs of geoms"), self.shapes()),
            (pairs, swept) => {
                format!("{swept} geoms searched for pairs in each step, {pairs} pairs listed: {}", self.shapes())
            }
        });
        let inexact: Vec<String> = self.colliders.iter().filter(|[a, b]| !exact(*a, *b)).map(names).collect();
        if !inexact.is_empty() {
            lines.push(format!("contact points may differ from MuJoCo's: {}", inexact.join(", ")));
        }
        if self.condim > 0 {
            lines.push(format!("contacts with condim up to {}: {}", self.condim, directions(self.condim)));
        }
        let features = [
            (self.limits, "joint limit", "joint limits"),
            (self.springs, "spring", "springs"),
            (self.dampers, "damper", "dampers"),
            (self.frictionloss, "joint with dry friction", "joints with dry friction"),
            (self.armature, "joint with armature", "joints with armature"),
            (self.actuators, "actuator", "actuators"),
        ];
        let present: Vec<String> = features.iter().filter(|f| f.0 > 0).map(|f| count(f.0, f.1, f.2)).collect();
        if !present.is_empty() {
            lines.push(present.join(", "));
        }
        lines
    }

    fn trees(&self) -> String {
        let mut parts = Vec::new();
        if self.free_trees > 0 {
            parts.push(format!("{} (closed form)", count(self.free_trees, "free tree", "free trees")));
        }
        if self.articulated_trees > 0 {
            let coupling = if self.coupled { "joints couple bodies" } else { "no joints couple bodies" };
            let trees = count(self.articulated_trees, "tree on joints", "trees on joints");
            parts.push(format!("{trees} (inertia matrix up to {0} × {0}; {coupling})", self.largest_matrix));
        }
        if self.rotating_trees == 0 {
            parts.push("nothing turns".into());
        }
        parts.join(", ")
    }

    fn shapes(&self) -> String {
        self.colliders.iter().map(names).collect::<Vec<_>>().join(", ")
    }
}

/// "plane–box"
fn names([a, b]: &[GeomKind; 2]) -> String {
    format!("{}–{}", super::layout::shape(*a), super::layout::shape(*b))
}

fn count(n: usize, one: &str, many: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { many })
}

fn directions(condim: usize) -> &'static str {
    match condim {
        1 => "normal force only",
        3 => "normal force and sliding friction",
        4 => "normal force, sliding and torsional friction",
        _ => "normal force, sliding, torsional and rolling friction",
    }
}
