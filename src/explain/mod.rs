//! What the contacts of a scene mean in SI units: numbers for `penny explain` and `penny run`, never for a step.

pub mod probe;
pub mod rehearsal;

use crate::collision::{Hits, Placed};
use crate::contact::constants::{self, Carried, Spring};
use crate::contact::tutorial;
use crate::data::Data;
use crate::dynamics;
use crate::forward::{self, Method};
use crate::math::{Mat3, Vec3, Vec6, mat};
use crate::model::{GeomKind, Model, Pair};
use crate::state::State;

/// Two geoms that can touch, and how.
#[derive(Clone, Debug)]
pub struct Touch {
    /// Lower kind first.
    pub geom: [usize; 2],
    pub mix: usize,
    /// Contact points when they lie flat on each other; the weight is shared by them.
    pub points: usize,
    /// Mass that the pair puts against each other along the normal, kg; see [`constants::effective_mass`].
    pub mass: f64,
    /// Inverse mass that MuJoCo's model assumes (diagApprox), over the true one.
    pub estimate: f64,
    /// Stiffest way in which the points together can press on their bodies, as a mass: 1 / (points · A) with the
    /// largest inverse mass A of a point, kg. A bound, used for the timestep of the `tutorial` law.
    pub lightest: f64,
    /// Whether one of the two never moves, so that the other can rest on it.
    pub rests: bool,
}

impl Touch {
    /// Spring of all points together in the `penalty` and `mujoco` laws, at rest and pressed hard.
    pub fn springs(&self, model: &Model, timestep: f64) -> [Spring; 2] {
        let mix = &model.mixes[self.mix];
        let carried = Carried { mass: self.mass, softness: self.softness(model) };
        let hard = mix.solimp[2].max(1.0);
        [self.rest_depth(model, timestep), hard]
            .map(|depth| constants::spring(mix, carried, depth, timestep, model.opt.flags.refsafe))
    }

    /// Spring of one point in the `tutorial` law; its mass is its share of the mass carried.
    pub fn tutorial_spring(&self, model: &Model, timestep: f64) -> Spring {
        let estimate = self.estimate / self.mass;
        let (k, c) = tutorial::spring_damper(model, &model.mixes[self.mix], estimate, timestep);
        Spring { mass: self.mass / self.points as f64, k, c }
    }

    /// How deep one rests on the other under its weight in the `penalty` and `mujoco` laws, m.
    pub fn rest_depth(&self, model: &Model, timestep: f64) -> f64 {
        let (gravity, refsafe) = (weight(model), model.opt.flags.refsafe);
        constants::rest_depth(&model.mixes[self.mix], self.softness(model), gravity, timestep, refsafe)
    }

    /// Speed at which it creeps down a `slope` (rad) that it should stick to, in the `mujoco` law, m/s.
    pub fn creep(&self, model: &Model, timestep: f64, slope: f64) -> f64 {
        let scene = constants::Scene {
            cone: model.opt.cone,
            impratio: model.opt.impratio,
            gravity: weight(model),
            timestep,
            refsafe: model.opt.flags.refsafe,
        };
        let depth = self.rest_depth(model, timestep);
        constants::creep(&model.mixes[self.mix], &scene, self.estimate, self.points, depth, slope)
    }

    fn softness(&self, model: &Model) -> f64 {
        let mix = &model.mixes[self.mix];
        constants::softness(mix, model.opt.cone, model.opt.impratio, self.estimate, self.points)
    }
}

/// Size of gravity, m/s².
pub fn weight(model: &Model) -> f64 {
    dynamics::gravity(model).norm()
}

/// All pairs of a scene that are known in advance (a scene of very many geoms finds the others as it runs) and can give
/// way along their normal: a contact that nothing yields to has no spring.
pub fn touches(model: &Model, method: &Method) -> Vec<Touch> {
    let state = State::new(model);
    let mut data = Data::new(model);
    // Brings poses and the factors of the inertia matrices to qpos0.
    forward::forward(model, method, &state, &mut data);
    let touches = model.pairs.listed.iter().map(|pair| touch(model, &data, pair));
    touches.filter(|touch| touch.mass.is_finite()).collect()
}

fn touch(model: &Model, data: &Data, pair: &Pair) -> Touch {
    let kinds = pair.geom.map(|g| model.geoms[g].kind);
    let bodies = pair.geom.map(|g| model.geoms[g].body);
    let (normal, hits) = approach(model, data, pair);
    let centre = bodies.map(|b| inverse_mass(model, data, b, &dynamics::xipos(model, data, b), &normal));
    let inverse = centre[0] + centre[1];
    let estimate: f64 = bodies.map(|b| model.bodies[b].invweight0[0]).iter().sum();
    let at_points = hits.iter().map(|p| bodies.map(|b| inverse_mass(model, data, b, p, &normal)).iter().sum());
    let stiffest = at_points.fold(inverse, f64::max);
    let points = points_when_flat(kinds);
    Touch {
        geom: pair.geom,
        mix: pair.mix,
        points,
        mass: 1.0 / inverse,
        estimate: estimate / inverse,
        lightest: 1.0 / (points as f64 * stiffest),
        rests: bodies.iter().any(|&b| model.bodies[b].tree.is_none()),
    }
}

/// Contact points of two shapes that lie on each other the way they come to rest: a box on its face, a cylinder or a
/// capsule on its side.
fn points_when_flat(kinds: [GeomKind; 2]) -> usize {
    match kinds {
        [GeomKind::Plane | GeomKind::Box, GeomKind::Box] => 4,
        [GeomKind::Plane, GeomKind::Cylinder | GeomKind::Capsule] => 2,
        _ => 1,
    }
}

/// The direction in which two geoms press, and the points of the second that a plane would touch, in `qpos0`.
fn approach(model: &Model, data: &Data, pair: &Pair) -> (Vec3, Vec<Vec3>) {
    let pose = |g: usize| {
        let geom = &model.geoms[g];
        let rotation = data.xmat[geom.body] * mat(&geom.quat);
        (data.xpos[geom.body] + data.xmat[geom.body] * geom.pos, rotation)
    };
    let [a, b] = pair.geom;
    if model.geoms[a].kind != GeomKind::Plane {
        let down = dynamics::gravity(model);
        return (down.try_normalize(0.0).unwrap_or(Vec3::z()), Vec::new());
    }
    let ((a_pos, a_mat), (b_pos, b_mat)) = (pose(a), pose(b));
    fn placed<'a>(size: &'a Vec3, pos: &'a Vec3, mat: &'a Mat3) -> Placed<'a> {
        Placed { size, pos, mat }
    }
    let mut hits = Hits::default();
    let (plane, shape) = (placed(&model.geoms[a].size, &a_pos, &a_mat), placed(&model.geoms[b].size, &b_pos, &b_mat));
    (pair.collider)(&plane, &shape, f64::INFINITY, &mut hits);
    (a_mat.column(2).into_owned(), hits.as_slice().iter().map(|h| h.pos - h.normal * (0.5 * h.dist)).collect())
}

/// Inverse mass of a body against a push at a point.
///
///     A = J M⁻¹ Jᵀ,   J the row of the point's motion along `normal`
///
/// Out: 1/kg; 0 for what cannot move. Reads: kinematics and factored inertia matrices.
fn inverse_mass(model: &Model, data: &Data, body: usize, point: &Vec3, normal: &Vec3) -> f64 {
    let Some(t) = model.bodies[body].tree else { return 0.0 };
    let tree = &model.trees[t];
    if let Some(free) = &tree.free {
        let mover = &data.movers[tree.bodies.start];
        let turn = mover.axes.tr_mul(&(point - mover.com).cross(normal));
        return 1.0 / free.mass + turn.component_mul(&turn).component_div(&free.inertia).sum();
    }
    let mut columns = vec![Vec6::zeros(); tree.dofs.len()];
    dynamics::jacobian(model, data, body, point, &mut columns);
    let row: Vec<f64> = columns.iter().map(|c| c.fixed_rows::<3>(0).dot(normal)).collect();
    let mut x = row.clone();
    dynamics::solve_m(model, data, t, &mut x);
    row.iter().zip(&x).map(|(a, b)| a * b).sum()
}
