//! What a closed form needs from a scene, if it is of the kind that the form is about. Slopes are gravity that leans
//! along x; bodies start upright.

use super::{SLIP, View};
use crate::sweep::Case;
use crate::sweep::formulas::{SlideToRoll, rolling_plate};
use penny::collision::detect;
use penny::data::Data;
use penny::dynamics::{self, energy};
use penny::forward::Method;
use penny::math::{Vec3, mat, quat, vec3};
use penny::model::{Dof, FreeBody, GeomKind, Joint, JointKind};
use penny::state::State;

pub fn g(case: &Case) -> Vec3 {
    penny::dynamics::gravity(&case.model)
}

/// Whether nothing moves at the start.
pub fn rests(case: &Case) -> bool {
    v0(case).iter().all(|v| *v == 0.0)
}

/// Whether weight acts straight down.
pub fn level(case: &Case) -> bool {
    let g = g(case);
    g.x == 0.0 && g.y == 0.0 && g.z < 0.0
}

pub fn weightless(case: &Case) -> bool {
    g(case).norm() == 0.0
}

pub fn contactless(case: &Case) -> bool {
    case.model.requires.pairs + case.model.requires.swept == 0
}

/// The first body, if it is free and its frame sits at its centre of mass: qpos and qvel begin with it.
pub fn free(case: &Case) -> Option<&FreeBody> {
    let free = case.model.trees.first()?.free.as_ref()?;
    (free.com.norm() < 1e-12).then_some(free)
}

/// A free body that turns.
pub fn tumbling(case: &Case) -> Option<&FreeBody> {
    let turns = |_: &&FreeBody| v0(case)[3..6].iter().any(|w| *w != 0.0);
    free(case).filter(turns).filter(|_| weightless(case) && contactless(case))
}

/// What falls: where its height is in qpos, height and velocity at the start.
pub struct Falling<'a> {
    pub case: &'a Case,
    pub qpos: usize,
    pub z0: f64,
    pub v0: f64,
}

pub fn falling(case: &Case) -> Option<Falling<'_>> {
    let model = &case.model;
    let undamped = |d: &Dof| d.damping == 0.0 && d.frictionloss == 0.0 && d.armature == 0.0;
    let unsprung = |j: &Joint| j.stiffness == 0.0;
    let up = |j: &&Joint| j.kind == JointKind::Slide && j.axis == Vec3::z();
    let alone = model.trees.first()?.bodies.len() == 1 && model.joints.iter().all(|j| j.kind == JointKind::Slide);
    let (qpos, dof) = match free(case) {
        Some(_) => (2, 2),
        None => model.joints.iter().find(up).filter(|_| alone).map(|j| (j.qposadr, j.dofadr))?,
    };
    let fits = model.trees.len() == 1 && model.joints.iter().all(unsprung) && model.dofs.iter().all(undamped);
    fits.then(|| Falling { case, qpos, z0: case.start.qpos[qpos], v0: v0(case)[dof] })
}

impl Falling<'_> {
    /// The height, unless something touches there.
    pub fn lands_not(&self, height: f64) -> Option<f64> {
        let (model, mut state) = (&self.case.model, self.case.start.clone());
        state.qpos[self.qpos] = height;
        let mut data = Data::new(model);
        dynamics::kinematics(model, &state.qpos, &mut data);
        detect(model, &mut data);
        data.contacts.is_empty().then_some(height)
    }
}

/// One body on one hinge.
pub struct Pendulum {
    /// About the hinge, kg m².
    pub inertia: f64,
    /// m g l, N m
    pub moment: f64,
}

pub fn pendulum(case: &Case) -> Option<Pendulum> {
    let (joint, dof) = (case.model.joints.first()?, case.model.dofs.first()?);
    let body = &case.model.bodies[joint.body];
    let lever = body.ipos - joint.pos;
    let l = (lever - joint.axis * joint.axis.dot(&lever)).norm();
    // A single joint: its inverse inertia at the start is exact.
    let p = Pendulum { inertia: 1.0 / dof.invweight0, moment: body.mass * g(case).norm() * l };
    // What the start has over the lowest place says whether that place is at 0 and the hinge is level.
    let (mut hanging, mut data) = (case.start.clone(), Data::new(&case.model));
    let potential = |state: &State, data: &mut Data| energy::energy(&case.model, state, data).potential;
    let above = potential(&case.start, &mut data);
    hanging.qpos[0] = 0.0;
    let above = above - potential(&hanging, &mut data);
    let swings = (above - p.moment * (1.0 - case.start.qpos[0].cos())).abs() < 1e-9 * p.moment;
    let alone = case.model.nv == 1 && case.model.trees[0].bodies.len() == 1 && joint.kind == JointKind::Hinge;
    let free = joint.stiffness == 0.0 && dof.damping == 0.0 && dof.frictionloss == 0.0 && joint.range.is_none();
    (alone && free && swings && contactless(case) && rests(case) && case.start.qpos[0] != 0.0).then_some(p)
}

pub fn v0(case: &Case) -> &[f64] {
    &case.start.qvel
}

/// The axis of a body: its third.
pub fn axis(wxyz: &[f64]) -> Vec3 {
    mat(&quat(wxyz)).column(2).into()
}

/// Sliding friction of the first contact, as the contact law has it.
pub fn mu(case: &Case, method: &Method) -> Option<f64> {
    case.model.mixes.first().map(|mix| (method.contact.friction)(&case.model, mix)[0])
}

/// A round free body on a plane.
pub struct Ball {
    pub mass: f64,
    pub radius: f64,
    /// I/(m R²)
    pub k: f64,
    /// Coefficients that the contact law uses.
    pub friction: [f64; 5],
    pub condim: usize,
}

pub fn ball(case: &Case, method: &Method) -> Option<Ball> {
    let free = free(case)?;
    sphere(case, method, free.mass, free.inertia.y)
}

/// A body that is a sphere, with its moment about y.
pub fn sphere(case: &Case, method: &Method, mass: f64, inertia: f64) -> Option<Ball> {
    let body = case.model.trees.first()?.bodies.start;
    let radius = case.model.geoms.iter().find(|geom| geom.body == body && geom.kind == GeomKind::Sphere)?.size.x;
    let mix = case.model.mixes.first()?;
    let friction = (method.contact.friction)(&case.model, mix);
    Some(Ball { mass, radius, k: inertia / (mass * radius * radius), friction, condim: mix.condim })
}

/// A ball that moves along x, free or in the plane, and its spin about y.
pub fn roller(case: &Case, method: &Method) -> Option<(Ball, f64)> {
    if let Some(ball) = ball(case, method) {
        return Some((ball, v0(case)[4]));
    }
    let [x, z, turn] = &case.model.joints[..] else { return None };
    let slides = [x, z].iter().all(|j| j.kind == JointKind::Slide) && x.axis == Vec3::x() && z.axis == Vec3::z();
    let turns = turn.kind == JointKind::Hinge && turn.axis.y.abs() == 1.0;
    let one = case.model.trees.len() == 1 && case.model.trees[0].bodies.len() == 1;
    (slides && turns && one).then_some(())?;
    let ball = sphere(case, method, case.model.bodies[turn.body].mass, 1.0 / case.model.dofs[turn.dofadr].invweight0)?;
    Some((ball, turn.axis.y * v0(case)[turn.dofadr]))
}

pub fn slide_to_roll(case: &Case, method: &Method) -> Option<SlideToRoll> {
    let b = ball(case, method).filter(|b| level(case) && [3, 4].contains(&b.condim))?;
    let slide = SlideToRoll { v0: v0(case)[0], k: b.k, braking: -b.friction[0] * g(case).z };
    let straight = slide.v0 > 0.0 && v0(case)[3..6].iter().all(|w| *w == 0.0);
    (straight && slide.slip_end() < case.seconds).then_some(slide)
}

/// Half lengths of the first body, if it is a box and free.
pub fn block(case: &Case) -> Option<Vec3> {
    free(case)?;
    Some(case.model.geoms.iter().find(|geom| geom.body == 1 && geom.kind == GeomKind::Box)?.size)
}

/// Pull down the slope less the most that friction can do, of a block at rest, m/s².
pub fn still_block(case: &Case, method: &Method) -> Option<f64> {
    block(case).filter(|_| rests(case) && g(case).z < 0.0)?;
    Some(g(case).x + mu(case, method)? * g(case).z)
}

/// Acceleration of a block that begins to slide.
pub fn sliding_block(case: &Case, method: &Method) -> Option<f64> {
    still_block(case, method).filter(|a| *a > 0.0)
}

/// Deceleration μ g of a block that slides on level ground and stops in time.
pub fn stopping_block(case: &Case, method: &Method) -> Option<f64> {
    block(case).filter(|_| level(case))?;
    let slower = -mu(case, method)? * g(case).z;
    (v0(case)[0] > SLIP && v0(case)[0] < slower * case.seconds).then_some(slower)
}

/// Masses of bodies that slide along x, of which only the first moves; their contacts give all back.
pub fn row(case: &Case) -> Option<Vec<f64>> {
    let model = &case.model;
    let along = |j: &Joint| j.kind == JointKind::Slide && j.axis == Vec3::x();
    let each = model.trees.iter().all(|tree| tree.bodies.len() == 1 && tree.dofs.len() == 1);
    let springy = model.mixes.first()?.solref;
    let starts = v0(case).first().is_some_and(|v| *v > 0.0) && v0(case)[1..].iter().all(|v| *v == 0.0);
    let fits = weightless(case) && each && starts && springy[0] < 0.0 && springy[1] == 0.0 && model.nv > 1;
    (fits && model.joints.iter().all(along)).then(|| model.bodies[1..].iter().map(|b| b.mass).collect())
}

/// Kind and half height of the first body's geom.
pub fn lowest(case: &Case) -> Option<(GeomKind, f64)> {
    let geom = case.model.geoms.iter().find(|geom| geom.body == 1)?;
    Some((geom.kind, if geom.kind == GeomKind::Box { geom.size.z } else { geom.size.x }))
}

pub fn normal_force(data: &Data) -> f64 {
    data.contacts.iter().map(|c| c.force[0]).sum()
}

/// One joint with a spring, started at `x0` with `v0`.
pub struct Spring {
    pub stiffness: f64,
    pub omega: f64,
    pub zeta: f64,
    pub x0: f64,
    pub v0: f64,
}

pub fn spring(case: &Case) -> Option<Spring> {
    let (joint, dof) = (case.model.joints.first()?, case.model.dofs.first()?);
    let single = case.model.nv == 1 && matches!(joint.kind, JointKind::Slide | JointKind::Hinge);
    (single && joint.stiffness > 0.0 && joint.springref == 0.0 && weightless(case)).then_some(())?;
    // A single joint: its inverse inertia at the start is exact.
    let mass = 1.0 / dof.invweight0;
    let (x0, v0) = (case.start.qpos[0] - joint.springref, case.start.qvel[0]);
    let omega = (joint.stiffness / mass).sqrt();
    let zeta = dof.damping / (2.0 * (joint.stiffness * mass).sqrt());
    Some(Spring { stiffness: joint.stiffness, omega, zeta, x0, v0 })
}

impl Spring {
    pub fn position(&self, t: f64) -> Option<f64> {
        let damped = self.omega * (1.0 - self.zeta * self.zeta).sqrt();
        let rate = self.zeta * self.omega;
        let swing = self.x0 * (damped * t).cos() + (self.v0 + rate * self.x0) / damped * (damped * t).sin();
        (self.zeta < 1.0).then_some((-rate * t).exp() * swing)
    }
}

/// Acceleration vectors of SimBenchmark's plate (the first body, pushed by the first actuator) and of its balls.
pub fn plate_and_balls(case: &Case) -> Option<[Vec3; 2]> {
    let [plate, ball] = [case.model.trees.first()?.free.as_ref()?, case.model.trees.get(1)?.free.as_ref()?];
    case.model.trees.iter().all(|tree| tree.free.is_some()).then_some(())?;
    let radius = case.model.geoms.iter().find(|g| g.kind == GeomKind::Sphere)?.size.x;
    let push = vec3(&case.model.actuators.first()?.gear) * *case.start.ctrl.first()?;
    let friction = case.model.geoms.iter().find(|g| g.kind == GeomKind::Box)?.friction[0];
    let n = (case.model.trees.len() - 1) as f64;
    let k = ball.inertia.y / (ball.mass * radius * radius);
    let speeds = rolling_plate(plate.mass, ball.mass, n, push.norm(), friction, -g(case).z, k);
    Some(speeds.map(|a| a * push.normalize()))
}

pub fn velocity_error(v: &View, [plate, ball]: [Vec3; 2]) -> f64 {
    let t = v.state.time - v.case.start.time;
    let away = |i: usize, a: Vec3| (vec3(&v.state.qvel[6 * i..]) - a * t).norm_squared();
    let n = v.case.model.trees.len() - 1;
    away(0, plate) + (1..=n).map(|i| away(i, ball)).sum::<f64>() / n as f64
}
