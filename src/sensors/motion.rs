//! How every body moves and is accelerated, and what its parent exerts on it: the passes that several sensors share.

use crate::contact::{self, Law, ties};
use crate::data::{Data, TieKind};
use crate::dynamics::bias::carrier;
use crate::dynamics::spatial::{Inertia, ang, at, cross_force, cross_motion, join, lin};
use crate::dynamics::{self, tendon, xipos};
use crate::kind::SensorKind;
use crate::math::{Sym3, Vec3, Vec6, mat};
use crate::model::{Model, Path, Transmission};
use crate::state::State;

/// Six-vectors of each body, in world axes about `origin` of its tree: the place of its first body; the world's origin
/// for what never moves.
#[derive(Clone, Debug, Default)]
pub struct Motion {
    pub origin: Vec<Vec3>,
    /// Twist.
    pub vel: Vec<Vec6>,
    /// Acceleration as if gravity were one of the frame: its linear part is −g for what rests.
    pub acc: Vec<Vec6>,
    /// What the parent exerts on the body and all that hangs on it.
    pub force: Vec<Vec6>,
}

impl Motion {
    /// Velocities and accelerations at a state that `data` was computed for.
    pub fn of(model: &Model, state: &State, data: &Data) -> Motion {
        let mut motion = Motion::default();
        motion.velocities(model, state, data);
        motion.accelerations(model, state, data);
        motion
    }

    /// Computes as much as the scene's sensors need.
    pub fn update(&mut self, model: &Model, law: &Law, state: &State, data: &Data) {
        use SensorKind::*;
        let any = |kinds: &[SensorKind]| model.sensors.iter().any(|s| kinds.contains(&s.kind));
        let force = any(&[Force, Torque]);
        let acceleration = force || any(&[Accelerometer, FrameLinAcc, FrameAngAcc]);
        if acceleration || any(&[Velocimeter, Gyro, FrameLinVel, FrameAngVel, SubtreeLinVel, SubtreeAngMom]) {
            self.velocities(model, state, data);
        }
        if acceleration {
            self.accelerations(model, state, data);
        }
        if force {
            self.forces(model, law, state, data);
        }
    }

    /// Velocity (m/s) of the point of a body that is now at `point`, and angular velocity (rad/s). World axes.
    pub fn velocity_at(&self, body: usize, point: &Vec3) -> (Vec3, Vec3) {
        let v = at(&self.vel[body], &(point - self.origin[body]));
        (lin(&v), ang(&v))
    }

    /// Acceleration (m/s²) of that point less gravity, and angular acceleration (rad/s²).
    ///
    ///     a_p = A + α × r + ω × v_p        r from the origin to the point
    pub fn acceleration_at(&self, body: usize, point: &Vec3) -> (Vec3, Vec3) {
        let (v, w) = self.velocity_at(body, point);
        let a = at(&self.acc[body], &(point - self.origin[body]));
        (lin(&a) + w.cross(&v), ang(&a))
    }

    fn velocities(&mut self, model: &Model, state: &State, data: &Data) {
        let n = model.bodies.len();
        let Motion { origin, vel, .. } = self;
        origin.resize(n, Vec3::zeros());
        vel.resize(n, Vec6::zeros());
        for (t, tree) in model.trees.iter().enumerate() {
            let root = tree.bodies.start;
            let qvel = &state.qvel[tree.dofs.clone()];
            let free = tree.free.is_some().then(|| {
                let w = data.xmat[root] * Vec3::new(qvel[3], qvel[4], qvel[5]);
                join(&Vec3::new(qvel[0], qvel[1], qvel[2]), &w)
            });
            for b in model.trees[t].bodies.clone() {
                origin[b] = data.xpos[root];
                vel[b] = free.unwrap_or(data.cvel[b]);
            }
        }
    }

    /// As [`dynamics::bias`], with qacc:
    ///
    ///     A_b = A_parent + Σ (V × S_j q̇_j + S_j q̈_j),   A_world = −g
    fn accelerations(&mut self, model: &Model, state: &State, data: &Data) {
        let rest = join(&-dynamics::gravity(model), &Vec3::zeros());
        let Motion { vel, acc, .. } = self;
        acc.clear();
        acc.resize(model.bodies.len(), rest);
        for tree in &model.trees {
            let root = tree.bodies.start;
            if tree.free.is_some() {
                let qacc = &data.qacc[tree.dofs.clone()];
                let alpha = data.xmat[root] * Vec3::new(qacc[3], qacc[4], qacc[5]);
                // qacc holds the acceleration of the origin, A that of whatever passes there.
                let linear = Vec3::new(qacc[0], qacc[1], qacc[2]) - ang(&vel[root]).cross(&lin(&vel[root]));
                tree.bodies.clone().for_each(|b| acc[b] = rest + join(&linear, &alpha));
                continue;
            }
            for b in tree.bodies.clone() {
                let body = &model.bodies[b];
                let (mut v, mut a) = match model.bodies[body.parent].tree {
                    Some(_) => (vel[body.parent], acc[body.parent]),
                    None => (Vec6::zeros(), rest),
                };
                for joint in &model.joints[body.joints.clone()] {
                    let dofs = joint.dofadr..joint.dofadr + joint.kind.nv();
                    let along = |rates: &[f64]| dofs.clone().map(|d| data.cdof[d] * rates[d]).sum::<Vec6>();
                    let moved = along(&state.qvel);
                    a += cross_motion(&carrier(joint, &state.qvel, &v), &moved) + along(&data.qacc);
                    v += moved;
                }
                acc[b] = a;
            }
        }
    }

    /// Newton–Euler, from the leaves to the roots:
    ///
    ///     F_b = I_b A_b + V_b ×* I_b V_b − contacts − equalities − spatial tendons − applied + Σ F_child
    fn forces(&mut self, model: &Model, law: &Law, state: &State, data: &Data) {
        let Motion { origin, vel, acc, force } = self;
        force.clear();
        for (b, body) in model.bodies.iter().enumerate() {
            let com = xipos(model, data, b) - origin[b];
            let axes = data.xmat[b] * mat(&body.iquat);
            let inertia = Inertia::new(body.mass, &com, &Sym3::from_principal(&body.inertia, &axes));
            force.push(inertia.mul(&acc[b]) + cross_force(&vel[b], &inertia.mul(&vel[b])));
        }
        // The world's force is what holds its children: it has no parent to which it could pass on what touches it. As MuJoCo's.
        each_wrench(model, law, state, data, |b, point, f, n| {
            if b != 0 {
                force[b] -= join(f, &(n + (point - origin[b]).cross(f)));
            }
        });
        for b in (1..model.bodies.len()).rev() {
            let (parent, f) = (model.bodies[b].parent, force[b]);
            force[parent] += join(&lin(&f), &(ang(&f) + (origin[b] - origin[parent]).cross(&lin(&f))));
        }
    }
}

/// Hands on what acts on bodies but weight and joints: contacts, equalities, spatial tendons, `xfrc_applied`.
///
/// To `push`: body, place (m), force (N), torque (N m), world axes.
pub fn each_wrench(
    model: &Model,
    law: &Law,
    state: &State,
    data: &Data,
    mut push: impl FnMut(usize, &Vec3, &Vec3, &Vec3),
) {
    for contact in &data.contacts {
        let [f, n] = [0, 3].map(|i| contact.frame.tr_mul(&Vec3::from_column_slice(&contact.force[i..i + 3])));
        let bodies = contact.geom.map(|g| model.geoms[g as usize].body);
        let points = contact::points_of(model, law, contact);
        push(bodies[0], &points[0], &-f, &-n);
        push(bodies[1], &points[1], &f, &n);
    }
    for tie in data.ties.iter().filter(|tie| tie.kind == TieKind::Equality) {
        for (body, point, f, n) in ties::wrench(model, data, tie).into_iter().flatten() {
            push(body, &point, &f, &n);
        }
    }
    for (i, tendon) in model.tendons.iter().enumerate() {
        let Path::Spatial(points) = &tendon.path else { continue };
        let pull = pull(model, data, i);
        tendon::each_segment(model, data, points, |s| {
            if let Some(u) = s.direction() {
                let f = u * (pull / s.divisor);
                push(s.bodies[0], &s.points[0], &-f, &Vec3::zeros());
                push(s.bodies[1], &s.points[1], &f, &Vec3::zeros());
            }
        });
    }
    for (b, wrench) in state.xfrc_applied.iter().enumerate() {
        push(b, &xipos(model, data, b), &lin(wrench), &ang(wrench));
    }
}

/// What acts along a spatial tendon, as a force that lengthens, N: spring, damper, actuators, limits, dry friction,
/// equalities, inertia.
fn pull(model: &Model, data: &Data, i: usize) -> f64 {
    let tendon = &model.tendons[i];
    let mut pull = tendon::passive(model, data, i);
    if model.opt.flags.actuation {
        for (actuator, force) in model.actuators.iter().zip(&data.actuator_force) {
            if actuator.transmission == Transmission::Tendon(i) {
                pull += actuator.gear[0] * force;
            }
        }
    }
    for tie in &data.ties {
        pull +=
            ties::pulls(model, data, tie).into_iter().flatten().filter(|(t, _)| *t == i).map(|(_, f)| f).sum::<f64>();
    }
    if tendon.armature != 0.0 {
        let rate = tendon::product(&data.plan.tendons[i], &data.ten_j, &data.qacc);
        pull -= tendon.armature * (rate + data.ten_rate[i]);
    }
    pull
}
