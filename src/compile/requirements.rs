//! What a scene requires, as data: `penny explain` prints it, tests assert it.

use std::collections::BTreeSet;

use crate::collision::collider;
use crate::model::{Dof, GeomKind, Joint, Parts, Requirements};

pub fn requirements(model: &Parts) -> Requirements {
    let springs = model.opt.flags.spring;
    let dampers = model.opt.flags.damper;
    let joints = |has: &dyn Fn(&Joint) -> bool| model.joints.iter().filter(|j| has(j)).count();
    let any = |joint: &Joint, has: fn(&Dof) -> bool| model.dofs[joint.dofadr..][..joint.kind.nv()].iter().any(has);
    let articulated = model.trees.iter().filter(|t| t.free.is_none());
    let constraint = model.opt.flags.constraint;
    Requirements {
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
        dampers: joints(&|j| dampers && any(j, |d| d.damping != 0.0)),
        frictionloss: joints(&|j| model.opt.flags.frictionloss && constraint && any(j, |d| d.frictionloss > 0.0)),
        armature: joints(&|j| any(j, |d| d.armature != 0.0)),
        tendons: model.tendons.len(),
        equalities: if model.opt.flags.equality && constraint { model.equalities.len() } else { 0 },
        actuators: if model.opt.flags.actuation { model.actuators.len() } else { 0 },
    }
}

fn colliding_geoms(model: &Parts) -> Vec<usize> {
    let listed = model.pairs.listed.iter().flat_map(|p| p.geom);
    let mut geoms: Vec<usize> = listed.chain(model.pairs.swept.iter().copied()).collect();
    geoms.sort_unstable();
    geoms.dedup();
    geoms
}

/// The shapes that can meet: those of the listed pairs, and all combinations of the swept kinds.
fn colliders(model: &Parts) -> Vec<[GeomKind; 2]> {
    let kind = |g: usize| model.geoms[g].kind;
    let mut found: Vec<[GeomKind; 2]> = Vec::new();
    for pair in &model.pairs.listed {
        let kinds = pair.geom.map(kind);
        if !found.contains(&kinds) {
            found.push(kinds);
        }
    }
    let mut found: BTreeSet<[GeomKind; 2]> = found.into_iter().collect();
    let mut swept: Vec<GeomKind> = model.pairs.swept.iter().map(|&g| kind(g)).collect();
    swept.sort_unstable();
    swept.dedup();
    for (i, &a) in swept.iter().enumerate() {
        found.extend(swept[i..].iter().map(|&b| [a, b]).filter(|&[a, b]| collider(a, b).is_some()));
    }
    found.into_iter().collect()
}
