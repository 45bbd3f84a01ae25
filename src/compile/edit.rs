//! A compiled scene is changed: numbers, not its structure. What follows from them is found anew.

use std::fmt;

use super::{invweight, layout, masses, pairs, requirements, ties};
use crate::dynamics::fluid;
use crate::model::{Model, Parts, Path, Waypoint};

/// Why a change of a model was not taken. The model is as it was.
#[derive(Clone, Debug, PartialEq)]
pub struct Invalid {
    what: String,
}

impl fmt::Display for Invalid {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.what)
    }
}

impl std::error::Error for Invalid {}

impl Invalid {
    pub(crate) fn new(what: impl Into<String>) -> Invalid {
        Invalid { what: what.into() }
    }
}

/// `Err` with a text.
fn invalid<T>(what: impl Into<String>) -> Result<T, Invalid> {
    Err(Invalid::new(what))
}

impl Model {
    /// Changes numbers of the scene; the next step takes them up, under every law.
    ///
    /// What follows from what was changed is found anew: free bodies from the masses of their bodies, `invweight0`, the
    /// parameters of contacts from those of geoms (a `<pair>` keeps its own), bounding spheres, what a step needs. What is derived
    /// but changed directly (`mixes`, `invweight0`) stays until what it is derived from changes.
    ///
    ///     model.edit(|m| m.opt.gravity.z = -1.62)?;
    ///     model.edit(|m| m.geoms[floor].friction[0] = 0.2)?;
    ///
    /// Errors: [`Invalid`] if a number is not finite or has a sign that it cannot have, if nothing would hold a joint's
    /// motion (no mass), or if the structure was changed (number of bodies, kinds, which geoms can touch): a new scene has
    /// to be compiled for that. The model then stays as it was.
    pub fn edit(&mut self, change: impl FnOnce(&mut Parts)) -> Result<(), Invalid> {
        let before = self.clone();
        change(self.parts_mut());
        let settled = same_structure(&before, self).and_then(|()| sound(self)).and_then(|()| settle(&before, self));
        match settled {
            Ok(()) => self.revise(),
            Err(_) => *self = before,
        }
        settled
    }
}

/// What follows from the numbers.
fn settle(before: &Parts, model: &mut Model) -> Result<(), Invalid> {
    let parts = model.parts_mut();
    if parts.geoms != before.geoms || parts.opt.contact_override != before.opt.contact_override {
        for geom in &mut parts.geoms {
            geom.rbound = layout::bounding_radius(geom.kind, &geom.size);
            let coef = geom.fluid.as_ref().map(|fluid| fluid.coef);
            geom.fluid = coef.map(|coef| fluid::virtual_inertia(coef, &fluid::semiaxes(geom)).into());
        }
        parts.mixes = pairs::remix(&parts.geoms, parts.opt.contact_override, &mut parts.pairs, &parts.mixes);
    }
    let inert = |m: &Parts| m.tendons.iter().map(|t| t.armature).collect::<Vec<_>>();
    let heavy = |m: &Parts| {
        let bodies = m.bodies.iter().map(|b| (b.mass, b.inertia, b.ipos, b.iquat, b.pos, b.quat));
        (bodies.collect::<Vec<_>>(), m.dofs.iter().map(|d| d.armature).collect::<Vec<_>>(), m.qpos0.clone(), inert(m))
    };
    let same = heavy(parts) == heavy(before);
    let medium = parts.opt.medium();
    let pulled: Vec<usize> = parts
        .tendons
        .iter()
        .filter(|t| t.acts())
        .flat_map(|t| t.bodies(&parts.joints, &parts.sites, &parts.geoms))
        .filter_map(|b| parts.bodies[b].tree)
        .collect();
    for (t, tree) in parts.trees.iter_mut().enumerate() {
        if medium || pulled.contains(&t) {
            tree.free = None;
        } else if tree.free.is_some() {
            tree.free = masses::free_body(tree, &parts.bodies, &parts.joints, &parts.dofs);
        }
    }
    parts.requires = requirements::requirements(parts);
    match if same { Ok(()) } else { invweight::fill(model) } {
        Ok(()) => {
            if !same {
                ties::weigh(model);
            }
            Ok(())
        }
        Err(dof) => {
            invalid(format!("dof {dof} would move nothing: masses and inertias of what it moves are too small"))
        }
    }
}

/// Lists and kinds have to stay.
fn same_structure(before: &Parts, now: &Parts) -> Result<(), Invalid> {
    let lists = |m: &Parts| {
        let nothing_else =
            [m.bodies.len(), m.joints.len(), m.dofs.len(), m.geoms.len(), m.actuators.len(), m.trees.len()];
        let sensors: Vec<_> = m.sensors.iter().map(|s| (s.kind, s.object, s.reference, s.adr)).collect();
        (m.nq, m.nv, m.qpos0.len(), nothing_else, m.sites.len(), m.nsensordata, sensors)
    };
    let bodies = |m: &Parts| {
        let of = |b: &crate::model::Body| (b.parent, b.weld, b.tree, b.joints.clone(), b.dofs.clone(), b.geoms.clone());
        m.bodies.iter().map(of).collect::<Vec<_>>()
    };
    let joints = |m: &Parts| {
        m.joints.iter().map(|j| (j.kind, j.body, j.qposadr, j.dofadr, j.range.is_some())).collect::<Vec<_>>()
    };
    let dofs = |m: &Parts| m.dofs.iter().map(|d| (d.joint, d.body)).collect::<Vec<_>>();
    let geoms = |m: &Parts| m.geoms.iter().map(|g| (g.kind, g.body, g.contype, g.conaffinity)).collect::<Vec<_>>();
    let actuators = |m: &Parts| m.actuators.iter().map(|a| (a.kind, a.transmission, a.act)).collect::<Vec<_>>();
    let tendons = |m: &Parts| m.tendons.iter().map(|t| (t.path.clone(), t.range.is_some())).collect::<Vec<_>>();
    let equalities = |m: &Parts| m.equalities.iter().map(|e| std::mem::discriminant(&e.kind)).collect::<Vec<_>>();
    let same = lists(before) == lists(now)
        && bodies(before) == bodies(now)
        && joints(before) == joints(now)
        && dofs(before) == dofs(now)
        && geoms(before) == geoms(now)
        && actuators(before) == actuators(now)
        && tendons(before) == tendons(now)
        && equalities(before) == equalities(now);
    if same {
        return Ok(());
    }
    invalid(
        "bodies, joints, geoms and actuators, their kinds and what can touch what cannot be changed: compile a new scene",
    )
}

/// Numbers have to be finite, and some of them not negative.
fn sound(m: &Parts) -> Result<(), Invalid> {
    let finite = |what: &str, numbers: &[f64]| match numbers.iter().find(|x| !x.is_finite()) {
        Some(x) => invalid(format!("{what} cannot be {x}")),
        None => Ok(()),
    };
    let not_negative = |what: &str, numbers: &[f64]| match numbers.iter().find(|x| !(x.is_finite() && **x >= 0.0)) {
        Some(x) => invalid(format!("{what} cannot be {x}")),
        None => Ok(()),
    };
    finite("gravity", m.opt.gravity.as_slice())?;
    if !(m.opt.timestep.is_finite() && m.opt.timestep > 0.0) {
        return invalid(format!("the timestep cannot be {} s: it is above zero", m.opt.timestep));
    }
    not_negative("density, viscosity", &[m.opt.density, m.opt.viscosity])?;
    finite("wind", m.opt.wind.as_slice())?;
    not_negative("impratio, tolerance", &[m.opt.impratio, m.opt.tolerance])?;
    for body in &m.bodies {
        not_negative(&format!("the mass of body `{}`", body.name), &[body.mass])?;
        not_negative(&format!("the inertia of body `{}`", body.name), body.inertia.as_slice())?;
        finite(&format!("the place of body `{}`", body.name), body.pos.as_slice())?;
    }
    for dof in &m.dofs {
        not_negative("damping, armature, frictionloss", &[dof.damping, dof.armature, dof.frictionloss])?;
    }
    for joint in &m.joints {
        finite(&format!("stiffness and springref of joint `{}`", joint.name), &[joint.stiffness, joint.springref])?;
        finite(&format!("the limits of joint `{}`", joint.name), &joint.range.unwrap_or_default())?;
    }
    for geom in &m.geoms {
        let name = &geom.name;
        not_negative(&format!("the friction of geom `{name}`"), &geom.friction)?;
        not_negative(&format!("size, solmix of geom `{name}`"), &[geom.size.x, geom.size.y, geom.size.z, geom.solmix])?;
        let numbers = [&geom.solref[..], &geom.solimp, &[geom.margin, geom.gap]].concat();
        finite(&format!("solref, solimp, margin, gap of geom `{name}`"), &numbers)?;
        directions(geom.condim)?;
    }
    for mix in &m.mixes {
        not_negative("friction", &mix.friction)?;
        finite("solref, solimp", &[&mix.solref[..], &mix.solreffriction, &mix.solimp].concat())?;
        directions(mix.condim)?;
    }
    for actuator in &m.actuators {
        finite(&format!("gear, gain and bias of actuator `{}`", actuator.name), &actuator.gear)?;
        finite(&format!("gear, gain and bias of actuator `{}`", actuator.name), &actuator.bias)?;
    }
    for tendon in &m.tendons {
        let name = &tendon.name;
        not_negative(&format!("frictionloss, armature of tendon `{name}`"), &[tendon.frictionloss, tendon.armature])?;
        let springs = [tendon.stiffness, tendon.damping].concat();
        finite(
            &format!("stiffness, damping, springlength of tendon `{name}`"),
            &[&springs[..], &tendon.lengthspring].concat(),
        )?;
        finite(&format!("the limits of tendon `{name}`"), &tendon.range.unwrap_or_default())?;
        if tendon.armature != 0.0
            && matches!(&tendon.path, Path::Spatial(p) if p.iter().any(|p| matches!(p, Waypoint::Geom { .. })))
        {
            return invalid(format!("tendon `{name}` goes round a geom: it cannot have armature"));
        }
    }
    for equality in &m.equalities {
        let numbers = [&equality.solref[..], &equality.solimp].concat();
        finite(&format!("solref, solimp of equality `{}`", equality.name), &numbers)?;
    }
    finite("qpos0", &m.qpos0)
}

fn directions(condim: usize) -> Result<(), Invalid> {
    if matches!(condim, 1 | 3 | 4 | 6) { Ok(()) } else { invalid(format!("condim is 1, 3, 4 or 6, not {condim}")) }
}
