//! What a step of a model has to compute: found once, so that a step does nothing else.

use crate::math::{Mat3, Vec3, mat};
use crate::model::{Model, Tree};

/// No dof.
pub const NONE: usize = usize::MAX;

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
    /// Whether semi-implicit Euler has dampers to treat implicitly.
    pub eulerdamp: bool,
    /// Joints with limits, and dofs with dry friction: they need a contact law even without contacts.
    pub limited: Vec<usize>,
    pub dry: Vec<usize>,
    /// Free bodies whose frame is at the centre of mass and along the principal axes (by tree).
    pub aligned: Vec<bool>,
    /// The next dof towards the root of the tree, or [`NONE`].
    pub dof_parent: Vec<usize>,
}

/// A geom with its pose in its body.
#[derive(Clone, Copy, Debug)]
pub struct Posed {
    pub geom: usize,
    pub body: usize,
    pub pos: Vec3,
    pub mat: Mat3,
    /// Its axes and origin are the body's.
    pub aligned: bool,
}

impl Plan {
    pub fn new(model: &Model) -> Plan {
        let flags = &model.opt.flags;
        let damps = |dof: usize| flags.damper && model.dofs[dof].damping != 0.0;
        let damped: Vec<bool> = model.trees.iter().map(|t| t.dofs.clone().any(damps)).collect();
        let mut implicit = damped.clone();
        for actuator in model.actuators.iter().filter(|a| flags.actuation && a.bias[2] != 0.0) {
            if let Some(tree) = model.bodies[model.joints[actuator.joint].body].tree {
                implicit[tree] = true;
            }
        }
        let limits = flags.constraint && flags.limit;
        let dry = flags.constraint && flags.frictionloss;
        Plan {
            posed: touching(model, true),
            springs: (0..model.joints.len()).filter(|&j| flags.spring && model.joints[j].stiffness != 0.0).collect(),
            dampers: (0..model.nv).filter(|&d| damps(d)).collect(),
            eulerdamp: flags.eulerdamp && damped.contains(&true),
            damped,
            implicit,
            limited: (0..model.joints.len()).filter(|&j| limits && model.joints[j].range.is_some()).collect(),
            dry: (0..model.nv).filter(|&d| dry && model.dofs[d].frictionloss > 0.0).collect(),
            aligned: model.trees.iter().map(aligned).collect(),
            dof_parent: dof_parents(model),
        }
    }
}

impl Plan {
    /// Whether there are limits or dry friction.
    pub fn joint_rows(&self) -> bool {
        !self.limited.is_empty() || !self.dry.is_empty()
    }
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
            Posed { geom, body: g.body, pos: g.pos, mat, aligned: g.pos == Vec3::zeros() && mat == Mat3::identity() }
        })
        .collect()
}

fn aligned(tree: &Tree) -> bool {
    tree.free.as_ref().is_some_and(|free| free.com == Vec3::zeros() && free.axes == Mat3::identity())
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
