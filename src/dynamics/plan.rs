//! What a step of a model has to compute: found once, so that a step does nothing else.

use std::ops::Range;

use super::blocks::{Block, blocks};
use super::factor::Pattern;
use super::links::{Link, Mount, NONE, links, mount, orientations};
use super::plane::Plane;
use super::uncoupled::Uncoupled;
use crate::math::{MIN_VAL, Mat3, Vec3, mat};
use crate::model::{Actuator, EqualityKind, FreeBody, GeomKind, Joint, JointKind, Model, Tendon, Transmission, Tree};

#[derive(Clone, Debug, Default)]
pub struct Plan {
    /// Geoms that move and can touch something.
    pub posed: Vec<Posed>,
    /// Joints with a spring.
    pub springs: Vec<usize>,
    /// Dofs with a damper.
    pub dampers: Vec<usize>,
    /// Whether a tree has dampers, and whether it has dampers or actuators that depend on velocity (by tree).
    pub damped: Vec<bool>,
    pub implicit: Vec<bool>,
    /// Where in `moments` the row of an actuator is that does not act on a joint's axes.
    pub moments: Vec<Option<usize>>,
    /// Bodies whose weight is compensated, and dofs whose actuators bear that.
    pub gravcomp: Vec<usize>,
    pub borne: Vec<usize>,
    /// Dofs where the sum of actuator forces is bounded.
    pub force_ranges: Vec<(usize, [f64; 2])>,
    /// Bodies that feel the medium.
    pub fluid: Vec<usize>,
    /// Trees that a row of J of each tendon touches, and of each equality.
    pub tendons: Vec<Vec<Block>>,
    pub equalities: Vec<Vec<Block>>,
    /// Numbers of all these rows.
    pub tendon_numbers: usize,
    pub equality_numbers: usize,
    /// Tendons that have a spring or a damper, that have inertia, that have limits, that have dry friction.
    pub pulling_tendons: Vec<usize>,
    pub inert_tendons: Vec<usize>,
    pub limited_tendons: Vec<usize>,
    pub dry_tendons: Vec<usize>,
    /// Tendons along which the sum of actuator forces is bounded.
    pub tendon_ranges: Vec<(usize, [f64; 2])>,
    /// Whether equalities hold.
    pub equality: bool,
    /// Whether M of a tree is diagonal whatever its position, so that implicit integrators take no more of it (by tree).
    pub simple: Vec<bool>,
    /// Trees of one body whose dofs do not feel one another (by tree).
    pub uncoupled: Vec<Option<Uncoupled>>,
    /// Whether the inertia matrix of a tree varies: joints turn it, or a tendon has inertia (by tree).
    pub varies: Vec<bool>,
    /// What is placed from outside: bodies with what is welded to them, and their geoms that can touch something.
    pub mocap: Vec<usize>,
    pub mocap_geoms: Vec<Posed>,
    /// Whether semi-implicit Euler has dampers to treat implicitly.
    pub eulerdamp: bool,
    /// Joints with limits, and dofs with dry friction: they need a contact law even without contacts.
    pub limited: Vec<usize>,
    pub dry: Vec<usize>,
    /// Free bodies whose frame is at the centre of mass and along the principal axes (by tree).
    pub aligned: Vec<bool>,
    /// Balls: free bodies that turn alike about all axes, touch with spheres about the centre of mass only (not so large that I is less
    /// than a tenth of m R²), and are held by no joint or tie (by tree; empty without any).
    pub balls: Vec<bool>,
    /// The next dof towards the root of the tree, or [`NONE`].
    pub dof_parent: Vec<usize>,
    /// Where the inertia matrices of trees that are not free bodies have entries.
    pub pattern: Pattern,
    /// How each body hangs on its parent.
    pub mounts: Vec<Mount>,
    /// Bodies with joints, one tree after another; free bodies need none.
    links: Vec<Link>,
    links_of: Vec<Range<usize>>,
    /// Trees that turn, in one plane only, and are not uncoupled (by tree).
    pub planes: Vec<Option<Plane>>,
    /// Bodies without joints, in the same order.
    welded: Vec<usize>,
    welded_in: Vec<Range<usize>>,
}

/// A geom with its pose in its body.
#[derive(Clone, Copy, Debug)]
pub struct Posed {
    pub geom: usize,
    pub body: usize,
    pub pos: Vec3,
    pub mat: Mat3,
    /// Its origin, and its axes, are the body's.
    pub centred: bool,
    pub aligned: bool,
}

impl Plan {
    pub fn new(model: &Model) -> Plan {
        let flags = &model.opt.flags;
        let damps = |dof: usize| flags.damper && model.dofs[dof].damping != 0.0;
        let damped: Vec<bool> = model.trees.iter().map(|t| t.dofs.clone().any(damps)).collect();
        let mut implicit = damped.clone();
        for actuator in model.actuators.iter().filter(|a| flags.actuation && a.depends_on_velocity()) {
            for body in actuator.transmission.bodies(&model.joints, &model.sites, &model.geoms, &model.tendons) {
                if let Some(tree) = model.bodies[body].tree {
                    implicit[tree] = true;
                }
            }
        }
        let mut rows = 0;
        let moment = |actuator: &Actuator| {
            let turned = |j: usize| matches!(model.joints[j].kind, JointKind::Ball | JointKind::Free);
            let plain = match actuator.transmission {
                Transmission::Joint(_) => true,
                Transmission::JointInParent(j) => !turned(j),
                Transmission::Site { .. } | Transmission::Tendon(_) | Transmission::SliderCrank { .. } => false,
            };
            (!plain).then(|| {
                rows += 1;
                (rows - 1) * model.nv
            })
        };
        let moments = model.actuators.iter().map(moment).collect();
        // As in MuJoCo no passive force is left without springs and dampers.
        let weightless = flags.gravity && model.opt.gravity != Vec3::zeros() && (flags.spring || flags.damper);
        // MuJoCo counts the bodies whose `gravcomp` is above 0, and without one compensates none.
        let compensates = weightless && model.bodies.iter().any(|body| body.gravcomp > 0.0);
        let gravcomp: Vec<usize> =
            (1..model.bodies.len()).filter(|&b| compensates && model.bodies[b].gravcomp != 0.0).collect();
        let dragged = |b: &usize| model.bodies[*b].tree.is_some() && model.bodies[*b].mass >= MIN_VAL;
        let in_medium = model.opt.medium() && (flags.spring || flags.damper);
        let fluid: Vec<usize> = (1..model.bodies.len()).filter(|b| in_medium && dragged(b)).collect();
        fluid.iter().filter_map(|b| model.bodies[*b].tree).for_each(|tree| implicit[tree] = true);
        let (mut tendon_numbers, mut equality_numbers) = (0, 0);
        let tendons: Vec<Vec<Block>> = model
            .tendons
            .iter()
            .map(|tendon| {
                let bodies = tendon.bodies(&model.joints, &model.sites, &model.geoms).into_iter();
                blocks(model, bodies.filter_map(|b| model.bodies[b].tree), 1, &mut tendon_numbers)
            })
            .collect();
        for (blocks, tendon) in tendons.iter().zip(&model.tendons) {
            if flags.damper && tendon.damping != [0.0; 3] {
                blocks.iter().for_each(|block| implicit[block.tree] = true);
            }
        }
        let equalities = model
            .equalities
            .iter()
            .map(|equality| {
                let trees = tied_trees(model, &equality.kind, &tendons).into_iter();
                blocks(model, trees, rows_of(&equality.kind), &mut equality_numbers)
            })
            .collect();
        let mut inert = vec![false; model.trees.len()];
        for (blocks, _) in tendons.iter().zip(&model.tendons).filter(|(_, tendon)| tendon.armature != 0.0) {
            blocks.iter().for_each(|block| inert[block.tree] = true);
        }
        let tendons_that = |has: &dyn Fn(&Tendon) -> bool| {
            (0..model.tendons.len()).filter(|&i| has(&model.tendons[i])).collect::<Vec<_>>()
        };
        let pulls = |t: &Tendon| flags.spring && t.stiffness != [0.0; 3] || flags.damper && t.damping != [0.0; 3];
        let borne = |d: &usize| !gravcomp.is_empty() && model.joints[model.dofs[*d].joint].actgravcomp;
        let borne = (0..model.nv).filter(borne).collect();
        let force_range = |joint: &Joint| Some((joint.dofadr, joint.actfrcrange?));
        let limits = flags.constraint && flags.limit;
        let dry = flags.constraint && flags.frictionloss;
        let posed = touching(model, true);
        let balls = balls(model, &posed, tendons.iter().chain(&equalities).flatten());
        let dof_parent = dof_parents(model);
        let with_matrix = model.trees.iter().filter(|t| t.free.is_none()).map(|t| &t.dofs);
        let welded = |b: &usize| model.bodies[*b].weld != *b;
        let (mut links, links_of) = by_tree(model, |tree| links(model, tree));
        let turned = orientations(model);
        let (mut uncoupled, mut planes, mut varies) = (Vec::new(), Vec::new(), Vec::new());
        for ((tree, links_of), inert) in model.trees.iter().zip(&links_of).zip(&inert) {
            let links = &mut links[links_of.clone()];
            let own = if *inert { None } else { Uncoupled::of(model, tree, links, &turned) };
            let turns = tree.free.is_none() && tree.rotates && own.is_none();
            planes.push(turns.then(|| Plane::of(model, tree, &turned, links)).flatten());
            varies.push(turns || *inert);
            uncoupled.push(own);
        }
        let (welded, welded_in) = by_tree(model, |tree| tree.bodies.clone().filter(welded).collect());
        Plan {
            posed,
            springs: (0..model.joints.len()).filter(|&j| flags.spring && model.joints[j].stiffness != 0.0).collect(),
            dampers: (0..model.nv).filter(|&d| damps(d)).collect(),
            moments,
            gravcomp,
            borne,
            force_ranges: model.joints.iter().filter_map(force_range).collect(),
            fluid,
            pulling_tendons: tendons_that(&pulls),
            inert_tendons: tendons_that(&|t| t.armature != 0.0),
            limited_tendons: tendons_that(&|t| limits && t.range.is_some()),
            dry_tendons: tendons_that(&|t| dry && t.frictionloss > 0.0),
            tendon_ranges: (0..tendons.len()).filter_map(|i| Some((i, model.tendons[i].actfrcrange?))).collect(),
            tendons,
            equalities,
            tendon_numbers,
            equality_numbers,
            equality: flags.constraint && flags.equality && !model.equalities.is_empty(),
            simple: (0..model.trees.len()).map(|t| simple(model, &model.trees[t]) && !inert[t]).collect(),
            uncoupled,
            varies,
            mocap: mocap(model),
            mocap_geoms: touching(model, false).into_iter().filter(|g| model.bodies[g.body].weld != 0).collect(),
            // As in MuJoCo, what only drives (a damping below zero) is explicit.
            eulerdamp: flags.eulerdamp && model.dofs.iter().any(|dof| flags.damper && dof.damping > 0.0),
            damped,
            implicit,
            limited: (0..model.joints.len()).filter(|&j| limits && model.joints[j].range.is_some()).collect(),
            dry: (0..model.nv).filter(|&d| dry && model.dofs[d].frictionloss > 0.0).collect(),
            aligned: model.trees.iter().map(aligned).collect(),
            balls,
            pattern: Pattern::new(with_matrix, &dof_parent),
            dof_parent,
            mounts: (0..model.bodies.len()).map(|b| mount(model, b)).collect(),
            links,
            links_of,
            planes,
            welded,
            welded_in,
        }
    }
}

impl Plan {
    /// Whether there are limits or dry friction of joints.
    pub fn joint_rows(&self) -> bool {
        !self.limited.is_empty() || !self.dry.is_empty()
    }

    /// Whether there are equalities, or limits or dry friction of tendons.
    pub fn ties(&self) -> bool {
        self.equality || !self.limited_tendons.is_empty() || !self.dry_tendons.is_empty()
    }

    /// Equalities, and rows that tendons can have at the same time.
    pub fn most_ties(&self, model: &Model) -> usize {
        model.equalities.len() + 2 * self.limited_tendons.len() + self.dry_tendons.len()
    }

    /// The bodies of a tree that have joints, parents first.
    pub fn links_of(&self, tree: usize) -> &[Link] {
        &self.links[self.links_of[tree].clone()]
    }

    /// The bodies of a tree that are welded to another.
    pub fn welded_in(&self, tree: usize) -> &[usize] {
        &self.welded[self.welded_in[tree].clone()]
    }
}

/// A lone body in the frame of its inertia whose joints are at its origin and along its axes, none but the last of them turning.
///
/// Source: MuJoCo 4.0 manual, XML reference › body › simple; by experiment, its parent is the world or stands directly in it, and what
/// slides comes before what turns.
pub fn simple(model: &Model, tree: &Tree) -> bool {
    let body = &model.bodies[tree.bodies.start];
    let joints = &model.joints[body.joints.clone()];
    let along_axis = |j: &Joint| j.axis.iter().filter(|x| **x != 0.0).count() == 1;
    let centred = |j: &Joint| match j.kind {
        // Its six dofs are taken as they are.
        JointKind::Free => false,
        JointKind::Ball => j.pos == Vec3::zeros(),
        JointKind::Slide | JointKind::Hinge => j.pos == Vec3::zeros() && along_axis(j),
    };
    tree.bodies.len() == 1
        && model.bodies[body.parent].parent == 0
        && body.ipos == Vec3::zeros()
        && body.iquat.w.abs() == 1.0
        && joints.iter().all(centred)
        && joints.iter().rev().skip(1).all(|j| j.kind == JointKind::Slide)
}

/// Scalar rows of an equality.
pub fn rows_of(kind: &EqualityKind) -> usize {
    match kind {
        EqualityKind::Joint { .. } | EqualityKind::Tendon { .. } => 1,
        EqualityKind::Connect(_) => 3,
        EqualityKind::Weld { .. } => 6,
    }
}

/// The trees that an equality ties.
fn tied_trees(model: &Model, kind: &EqualityKind, tendons: &[Vec<Block>]) -> Vec<usize> {
    let of_body = |b: usize| model.bodies[b].tree;
    match kind {
        EqualityKind::Joint { joints: (a, b), .. } => {
            [Some(*a), *b].into_iter().flatten().filter_map(|j| of_body(model.joints[j].body)).collect()
        }
        EqualityKind::Tendon { tendons: (a, b), .. } => {
            [Some(*a), *b].into_iter().flatten().flat_map(|t| tendons[t].iter().map(|block| block.tree)).collect()
        }
        EqualityKind::Connect(anchors) | EqualityKind::Weld { anchors, .. } => {
            anchors.iter().filter_map(|anchor| of_body(anchor.place(&model.sites).0)).collect()
        }
    }
}

/// One list of what every tree that is not a free body has, and which part of it is whose.
fn by_tree<T>(model: &Model, of: impl Fn(&Tree) -> Vec<T>) -> (Vec<T>, Vec<Range<usize>>) {
    let mut all = Vec::new();
    let mut part = |tree: &Tree| {
        let start = all.len();
        if tree.free.is_none() {
            all.extend(of(tree));
        }
        start..all.len()
    };
    let parts = model.trees.iter().map(&mut part).collect();
    (all, parts)
}

/// The geoms that take part in collisions and move, or that take part and do not.
pub fn touching(model: &Model, moving: bool) -> Vec<Posed> {
    let mut used = vec![false; model.geoms.len()];
    for pair in &model.pairs.listed {
        used[pair.geom[0]] = true;
        used[pair.geom[1]] = true;
    }
    for &g in &model.pairs.swept {
        used[g] = true;
    }
    let moves = |g: usize| model.bodies[model.geoms[g].body].tree.is_some();
    (0..used.len())
        .filter(|&g| used[g] && moves(g) == moving)
        .map(|geom| {
            let g = &model.geoms[geom];
            let mat = mat(&g.quat);
            Posed {
                geom,
                body: g.body,
                pos: g.pos,
                mat,
                centred: g.pos == Vec3::zeros(),
                aligned: mat == Mat3::identity(),
            }
        })
        .collect()
}

/// Mocap bodies and what is welded to them, parents first.
fn mocap(model: &Model) -> Vec<usize> {
    let placed = |b: &usize| model.bodies[*b].tree.is_none() && model.bodies[*b].weld != 0;
    (1..model.bodies.len()).filter(placed).collect()
}

fn aligned(tree: &Tree) -> bool {
    tree.free.as_ref().is_some_and(|free| free.com == Vec3::zeros() && free.axes == Mat3::identity())
}

/// See [`Plan::balls`]. In: what ties hold.
fn balls<'a>(model: &Model, posed: &[Posed], tied: impl Iterator<Item = &'a Block>) -> Vec<bool> {
    let even = |free: &FreeBody| free.inertia == Vec3::from_element(free.inertia.x);
    let alone = |tree: &Tree| tree.bodies.len() == 1 && tree.dofs.clone().all(|d| model.dofs[d].frictionloss == 0.0);
    let may = |tree: &Tree| aligned(tree) && tree.free.as_ref().is_some_and(even) && alone(tree);
    let mut balls: Vec<bool> = model.trees.iter().map(may).collect();
    tied.for_each(|block| balls[block.tree] = false);
    for placed in posed {
        let (geom, tree) = (&model.geoms[placed.geom], model.bodies[placed.body].tree);
        if let Some((tree, free)) = tree.and_then(|t| Some((t, model.trees[t].free.as_ref()?))) {
            let spread = free.inertia.x >= 0.1 * free.mass * geom.size.x * geom.size.x;
            balls[tree] &= placed.centred && geom.kind == GeomKind::Sphere && spread;
        }
    }
    if balls.contains(&true) { balls } else { Vec::new() }
}

fn dof_parents(model: &Model) -> Vec<usize> {
    (0..model.nv)
        .map(|dof| {
            let body = &model.bodies[model.dofs[dof].body];
            if dof > body.dofs.start {
                return dof - 1;
            }
            // The last dof of the nearest ancestor that has any: `weld` skips the bodies that have none.
            let parent = &model.bodies[model.bodies[body.parent].weld];
            if parent.dofs.is_empty() { NONE } else { parent.dofs.end - 1 }
        })
        .collect()
}
