//! Conserved quantities: energy and momentum. Not part of a step.

use super::{inertia, spatial, tendon};
use crate::data::Data;
use crate::math::Vec3;
use crate::model::Model;
use crate::state::State;

/// J
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// ½ Σ V·I V of all bodies, and of armatures.
    pub kinetic: f64,
    /// Gravity, from the world's origin upwards, and springs.
    pub potential: f64,
}

/// Of all that moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Momentum {
    /// kg m/s
    pub linear: Vec3,
    /// About the centre of mass of all that moves, kg m²/s.
    pub angular: Vec3,
}

/// Energy of all that moves.
///
///     T = ½ Σ V·I V + ½ Σ armature q̇²,   U = −Σ m g·x_com + ½ Σ k (stretch)²
///
/// Tendons have both, too: ½ armature L̇², as far as M has it, and the energy of their springs.
///
/// Brings the kinematics in `data` to the state.
pub fn energy(model: &Model, state: &State, data: &mut Data) -> Energy {
    update(model, state, data);
    let mut energy = Energy::default();
    for (t, tree) in model.trees.iter().enumerate() {
        if let Some(free) = &tree.free {
            let vel = &data.movers[tree.bodies.start].vel;
            let w = spatial::ang(vel);
            energy.kinetic +=
                0.5 * (free.mass * spatial::lin(vel).norm_squared() + w.dot(&free.inertia.component_mul(&w)));
            continue;
        }
        for b in data.plan.links_of(t).iter().map(|link| link.body) {
            energy.kinetic += 0.5 * data.cvel[b].dot(&data.cinert[b].mul(&data.cvel[b]));
        }
        for d in tree.dofs.clone() {
            energy.kinetic += 0.5 * model.dofs[d].armature * state.qvel[d] * state.qvel[d];
        }
    }
    if model.opt.flags.gravity {
        for (b, body) in model.bodies.iter().enumerate().filter(|(_, body)| body.tree.is_some()) {
            energy.potential -= body.mass * model.opt.gravity.dot(&super::xipos(model, data, b));
        }
    }
    for &j in &data.plan.springs {
        let joint = &model.joints[j];
        let (stretch, n) = super::passive::stretch(model, joint, &state.qpos);
        energy.potential += 0.5 * joint.stiffness * stretch[..n].iter().map(|s| s * s).sum::<f64>();
    }
    if !model.tendons.is_empty() {
        tendon::tendons(model, &state.qpos, &state.qvel, data);
        energy.kinetic += tendon::kinetic_energy(model, &state.qvel, data);
        for (i, tendon) in model.tendons.iter().enumerate() {
            if model.opt.flags.spring {
                energy.potential += tendon::energy(tendon, data.ten_length[i]);
            }
        }
    }
    energy
}

/// Potential energy in gravity of what stands in no tree: MuJoCo's `e_potential` has it, too, J.
///
/// The kinematics in `data` have to be those of the state.
pub fn potential_of_fixed(model: &Model, data: &Data) -> f64 {
    let fixed = model.bodies.iter().enumerate().skip(1).filter(|(_, body)| body.tree.is_none() && body.mass != 0.0);
    let weights = fixed.map(|(b, body)| -body.mass * model.opt.gravity.dot(&super::xipos(model, data, b)));
    if model.opt.flags.gravity { weights.sum() } else { 0.0 }
}

/// Momentum of a state. Brings the kinematics in `data` to the state.
pub fn momentum(model: &Model, state: &State, data: &mut Data) -> Momentum {
    update(model, state, data);
    // About the world's origin first.
    let (mut mass, mut moment) = (0.0, Vec3::zeros());
    let (mut linear, mut angular) = (Vec3::zeros(), Vec3::zeros());
    for (t, tree) in model.trees.iter().enumerate() {
        let root = tree.bodies.start;
        if let Some(free) = &tree.free {
            let mover = &data.movers[root];
            let p = free.mass * spatial::lin(&mover.vel);
            mass += free.mass;
            moment += free.mass * mover.com;
            linear += p;
            angular += mover.com.cross(&p) + mover.axes * free.inertia.component_mul(&spatial::ang(&mover.vel));
            continue;
        }
        for b in data.plan.links_of(t).iter().map(|link| link.body) {
            let p = data.cinert[b].mul(&data.cvel[b]);
            mass += data.cinert[b].mass;
            moment += data.cinert[b].moment + data.cinert[b].mass * data.xpos[root];
            linear += spatial::lin(&p);
            angular += spatial::ang(&p) + data.xpos[root].cross(&spatial::lin(&p));
        }
    }
    if mass > 0.0 {
        angular -= (moment / mass).cross(&linear);
    }
    Momentum { linear, angular }
}

/// Poses, inertias and velocities at the state.
fn update(model: &Model, state: &State, data: &mut Data) {
    super::mocap(model, state, data);
    super::kinematics(model, &state.qpos, data);
    for (t, tree) in model.trees.iter().enumerate() {
        let root = tree.bodies.start;
        match &tree.free {
            Some(free) => {
                let qvel = &state.qvel[tree.dofs.clone()];
                data.movers[root].vel = super::free::velocity(free, qvel, &data.xmat[root]);
            }
            None => {
                inertia::links(model, t, data);
                super::bias::velocities(model, t, &state.qvel, data);
            }
        }
    }
}
