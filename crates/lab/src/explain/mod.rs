//! What the contacts of a scene mean in SI units: numbers for `penny explain` and `penny run`, never for a step.

mod budget;
pub mod joints;
pub mod loads;
pub mod probe;
pub mod ties;
pub mod trial_run;

pub use budget::Budget;
use penny::collision::{self, Hits, Placed, collider};
pub use penny::contact::describe::Touch;
use penny::contact::describe::{Ask, Description};
use penny::data::Data;
use penny::dynamics;
use penny::forward::Method;
use penny::math::{Mat3, Vec3, Vec6, mat};
use penny::model::{Bound, GeomKind, Model, Pair};
use penny::state::State;

/// Size of gravity, m/s².
pub fn weight(model: &Model) -> f64 {
    dynamics::gravity(model).norm()
}

/// What a law makes of a contact: by its formulas, and by trying it where it gives none.
#[derive(Clone, Debug)]
pub struct Meaning {
    /// What the law says of itself.
    pub formulas: Description,
    /// What it does; only where it says nothing of its spring or its depth at rest.
    pub measured: Option<probe::Measured>,
}

/// What the law of `method` makes of a contact, on a slope of `slope` (rad) where that matters.
pub fn meaning(model: &Model, method: &Method, touch: &Touch, slope: f64) -> Meaning {
    let formulas = (method.contact.describe)(&Ask { model, touch, timestep: method.timestep, slope });
    let silent = formulas.springs.is_none() || formulas.rest_depth.is_none() || formulas.restitution.is_none();
    Meaning { measured: silent.then(|| probe::measure(model, method, touch)).flatten(), formulas }
}

/// How deep a contact goes under a load, by the law of `method`: as under gravity at which its mass weighs that much, m.
pub fn depth_under(model: &Model, method: &Method, touch: &Touch, load: f64) -> Option<f64> {
    let mut heavy = model.clone();
    let g = dynamics::gravity(model).try_normalize(0.0).unwrap_or(-Vec3::z()) * (load / touch.mass);
    heavy.edit(|m| (m.opt.gravity, m.opt.flags.gravity) = (g, true)).ok()?;
    (method.contact.describe)(&Ask { model: &heavy, touch, timestep: method.timestep, slope: 0.0 }).rest_depth
}

/// All pairs of a scene that are known in advance (a scene of very many geoms finds the others as it runs) and can give
/// way along their normal: a contact that nothing yields to has no spring.
pub fn touches(model: &Model) -> Vec<Touch> {
    known(model).into_iter().filter(|touch| touch.mass.is_finite()).collect()
}

/// The pairs that [`touches`] leaves out: a push along the normal at the centre of mass moves neither.
pub fn unyielding(model: &Model) -> Vec<Touch> {
    known(model).into_iter().filter(|touch| !touch.mass.is_finite()).collect()
}

fn known(model: &Model) -> Vec<Touch> {
    let state = State::new(model);
    let mut data = Data::new(model);
    // Poses and the factors of the inertia matrices at qpos0.
    dynamics::mocap(model, &state, &mut data);
    dynamics::kinematics(model, &state.qpos, &mut data);
    dynamics::smooth(model, &state, &mut data);
    model.pairs.listed.iter().map(|pair| touch(model, &data, pair)).collect()
}

/// Rows of three or more movable bodies that touch one another at the start, each as their indices: where a blow along
/// the row is shared out among all of them at once, since all springs yield together. Stacks are none: what is in a row
/// along gravity carries weight.
///
/// Touching is a gap below a thousandth of the smaller body's radius.
pub fn rows_in_touch(model: &Model, state: &State) -> Vec<Vec<usize>> {
    let near = |pair: &Pair| {
        let radii = pair.geom.map(|g| model.geoms[g].rbound).into_iter().filter(|r| *r > 0.0);
        1e-3 * radii.fold(f64::INFINITY, f64::min)
    };
    let mut wide = model.clone();
    let widened = wide.edit(|m| {
        for pair in &mut m.pairs.listed {
            let gap = near(pair);
            pair.bound = Bound::None;
            let mix = &mut m.mixes[pair.mix];
            mix.margin = if gap.is_finite() { mix.margin.max(gap) } else { mix.margin };
        }
    });
    if widened.is_err() {
        return Vec::new();
    }
    let mut data = Data::new(&wide);
    dynamics::kinematics(&wide, &state.qpos, &mut data);
    collision::detect(&wide, &mut data);
    // Two bodies that move apart, and the direction from the first to the second.
    let down = dynamics::gravity(model).try_normalize(0.0).unwrap_or(Vec3::zeros());
    let tree = |b: u32| model.bodies[b as usize].tree;
    let mut edges: Vec<(usize, usize, Vec3)> = Vec::new();
    for c in &data.contacts {
        let normal = c.frame.row(0).transpose();
        let [a, b] = c.body.map(|b| b as usize);
        let apart = c.body.map(tree).iter().all(Option::is_some) && tree(c.body[0]) != tree(c.body[1]);
        if apart && normal.dot(&down).abs() < 0.9 && !edges.iter().any(|e| (e.0, e.1) == (a, b)) {
            edges.push((a, b, normal));
        }
    }
    let mut rows: Vec<Vec<usize>> = Vec::new();
    for (i, e) in edges.iter().enumerate() {
        for f in &edges[i + 1..] {
            // In a row: they share a body, and go on in the same direction.
            let shared = [(e.1, f.0, 1.0), (e.0, f.1, 1.0), (e.0, f.0, -1.0), (e.1, f.1, -1.0)];
            let onward = |(x, y, sign): &(usize, usize, f64)| x == y && sign * e.2.dot(&f.2) > 0.7;
            if !shared.iter().any(onward) {
                continue;
            }
            let mut row: Vec<usize> = vec![e.0, e.1, f.0, f.1];
            let (joined, apart): (Vec<_>, Vec<_>) = rows.into_iter().partition(|r| r.iter().any(|b| row.contains(b)));
            row.extend(joined.into_iter().flatten());
            row.sort_unstable();
            row.dedup();
            rows = apart;
            rows.push(row);
        }
    }
    rows
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
    let turns = |b: usize| model.bodies[b].tree.is_some_and(|t| model.trees[t].rotates);
    // What never turns comes down as it stands.
    let stands = !hits.is_empty() && !bodies.iter().any(|&b| turns(b));
    let points = if stands { lowest(&hits, &normal) } else { points_when_flat(kinds) };
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

/// How many points are as low as the lowest, but for rounding.
fn lowest(hits: &[Vec3], normal: &Vec3) -> usize {
    let heights: Vec<f64> = hits.iter().map(|p| p.dot(normal)).collect();
    let least = heights.iter().copied().fold(f64::INFINITY, f64::min);
    heights.iter().filter(|h| **h - least < 1e-9).count()
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
    if let Some(touch) = collider(pair.kind[0], pair.kind[1]) {
        touch(&plane, &shape, f64::INFINITY, &mut hits);
    }
    (a_mat.column(2).into_owned(), hits.as_slice().iter().map(|h| h.pos + h.normal * (0.5 * h.dist)).collect())
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
