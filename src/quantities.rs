//! What MuJoCo's `mjData` lists and no step needs: to look at and to compare, not on the way of a step.
//!
//! Six-vectors are MuJoCo's: **angular part first**, world axes, about the centre of mass of the tree that the body
//! belongs to ([`reference()`]). All of it belongs to the state that `data` was computed for by
//! [`forward`](crate::forward::forward). Source: MuJoCo 4.0 manual, Computation › General framework; compared with
//! MuJoCo 4.0.0 quantity by quantity in `python/tests/test_data.py`.

use crate::contact::Law;
use crate::data::Data;
use crate::dynamics::links::NONE;
use crate::dynamics::spatial::{Inertia, ang, at, cross_force, join};
use crate::dynamics::{self, actuation, xipos};
use crate::math::{MIN_VAL, Mat3, Sym3, Vec3, Vec6, mat};
use crate::model::{Actuator, CameraMode, Model, Path, Transmission};
use crate::sensors::{Motion, each_wrench};
use crate::state::State;

/// A six-vector in MuJoCo's order: angular part, linear part.
pub type Spatial = [f64; 6];

/// Motions and forces of all bodies, one entry a body; see [`motions`].
#[derive(Clone, Debug, Default)]
pub struct Motions {
    /// Twist, rad/s and m/s.
    pub cvel: Vec<Spatial>,
    /// Acceleration (rad/s², m/s²), as if gravity were one of the frame: −g for what rests.
    pub cacc: Vec<Spatial>,
    /// Torque and force (N m, N) of contacts, equalities, spatial tendons and `xfrc_applied`; none on the world.
    pub cfrc_ext: Vec<Spatial>,
    /// Torque and force that the parent exerts on the body and all that hangs on it.
    pub cfrc_int: Vec<Spatial>,
}

fn spatial(v: &Vec6) -> Spatial {
    [v[3], v[4], v[5], v[0], v[1], v[2]]
}

/// The body below the world on which a body hangs (`body_rootid`).
pub fn root(model: &Model, mut body: usize) -> usize {
    while model.bodies[body].parent != 0 {
        body = model.bodies[body].parent;
    }
    body
}

/// Mass of each body and all that hangs on it, kg.
pub fn subtree_mass(model: &Model) -> Vec<f64> {
    let mut mass: Vec<f64> = model.bodies.iter().map(|b| b.mass).collect();
    for b in (1..mass.len()).rev() {
        mass[model.bodies[b].parent] += mass[b];
    }
    mass
}

/// Centre of mass of each body and all that hangs on it, m; of what has no mass, of the body's inertial frame.
pub fn subtree_com(model: &Model, data: &Data) -> Vec<Vec3> {
    let mut mass: Vec<f64> = model.bodies.iter().map(|b| b.mass).collect();
    let mut com: Vec<Vec3> = (0..mass.len()).map(|b| mass[b] * xipos(model, data, b)).collect();
    for b in (0..mass.len()).rev() {
        let (parent, moment, own) = (model.bodies[b].parent, com[b], mass[b]);
        if b > 0 {
            com[parent] += moment;
            mass[parent] += own;
        }
        com[b] = if own < MIN_VAL { xipos(model, data, b) } else { moment / own };
    }
    com
}

/// The point about which the six-vectors of each body are taken: the centre of mass of its whole tree, m.
pub fn reference(model: &Model, data: &Data) -> Vec<Vec3> {
    let com = subtree_com(model, data);
    (0..com.len()).map(|b| com[root(model, b)]).collect()
}

/// The inertia of a body about a point, world axes.
fn inertia(model: &Model, data: &Data, body: usize, about: &Vec3) -> Inertia {
    let b = &model.bodies[body];
    let axes: Mat3 = data.xmat[body] * mat(&b.iquat);
    Inertia::new(b.mass, &(xipos(model, data, body) - about), &Sym3::from_principal(&b.inertia, &axes))
}

/// Inertia of each body about its reference point (`cinert`): xx yy zz xy xz yz (kg m²), m·offset (kg m), m (kg).
pub fn cinert(model: &Model, data: &Data) -> Vec<[f64; 10]> {
    let reference = reference(model, data);
    let of = |b: usize| {
        let Inertia { mass, moment, about } = inertia(model, data, b, &reference[b]);
        [about.xx, about.yy, about.zz, about.xy, about.xz, about.yz, moment.x, moment.y, moment.z, mass]
    };
    // As in MuJoCo the world has none.
    (0..model.bodies.len()).map(|b| if b == 0 { [0.0; 10] } else { of(b) }).collect()
}

/// The twist that each dof causes (`cdof`, nv).
pub fn cdof(model: &Model, data: &Data) -> Vec<Spatial> {
    let reference = reference(model, data);
    let mut all = vec![[0.0; 6]; model.nv];
    for b in 1..model.bodies.len() {
        let own = &model.bodies[b].dofs;
        dynamics::each_column(model, data, b, &reference[b], |d, column| {
            if own.contains(&d) {
                all[d] = spatial(&column);
            }
        });
    }
    all
}

/// Twists, accelerations and forces of all bodies.
///
///     cfrc_int_b = I_b A_b + V_b ×* I_b V_b − cfrc_ext_b + Σ cfrc_int_child
///
/// Reads: qvel, xfrc_applied, qacc and contacts with the forces of this law.
pub fn motions(model: &Model, law: &Law, state: &State, data: &Data) -> Motions {
    let (motion, reference) = (Motion::of(model, state, data), reference(model, data));
    let n = model.bodies.len();
    let moved = |v: &[Vec6], b: usize| at(&v[b], &(reference[b] - motion.origin[b]));
    let (vel, acc): (Vec<_>, Vec<_>) = (0..n).map(|b| (moved(&motion.vel, b), moved(&motion.acc, b))).unzip();
    let ext = external(model, law, state, data, &reference);
    let mut int = vec![Vec6::zeros(); n];
    for b in 1..n {
        let inertia = inertia(model, data, b, &reference[b]);
        int[b] = inertia.mul(&acc[b]) + cross_force(&vel[b], &inertia.mul(&vel[b])) - ext[b];
    }
    for b in (1..n).rev() {
        let force = int[b];
        int[model.bodies[b].parent] += force;
    }
    let all = |list: &[Vec6]| list.iter().map(spatial).collect();
    Motions { cvel: all(&vel), cacc: all(&acc), cfrc_ext: all(&ext), cfrc_int: all(&int) }
}

/// Force and torque of contacts, equalities, spatial tendons and `xfrc_applied` on each body about its reference point.
fn external(model: &Model, law: &Law, state: &State, data: &Data, reference: &[Vec3]) -> Vec<Vec6> {
    let mut sum = vec![Vec6::zeros(); model.bodies.len()];
    each_wrench(model, law, state, data, |b, point, f, n| {
        if b > 0 {
            sum[b] += join(f, &(n + (point - reference[b]).cross(f)));
        }
    });
    sum
}

/// ∂length/∂q of a tendon (nv).
pub fn tendon_row(model: &Model, data: &Data, tendon: usize) -> Vec<f64> {
    let mut row = vec![0.0; model.nv];
    dynamics::tendon::push(&data.plan.tendons[tendon], &data.ten_j, 1.0, &mut row);
    row
}

/// The inertia matrix, dense, nv × nv, row by row.
///
///     M = Σ Jᵀ I J + armature        J of a body's centre of mass, I its inertia there; of tendons armature Lᵀ L
///
/// Reads: poses, tendons.
pub fn inertia_matrix(model: &Model, data: &Data) -> Vec<f64> {
    let nv = model.nv;
    let mut m = vec![0.0; nv * nv];
    for b in (1..model.bodies.len()).filter(|&b| model.bodies[b].tree.is_some()) {
        let com = xipos(model, data, b);
        let inertia = inertia(model, data, b, &com);
        let mut columns = Vec::new();
        dynamics::each_column(model, data, b, &com, |d, column| columns.push((d, column)));
        for (i, column) in &columns {
            let momentum = inertia.mul(column);
            for (j, other) in &columns {
                m[i * nv + j] += other.dot(&momentum);
            }
        }
    }
    for (d, dof) in model.dofs.iter().enumerate() {
        m[d * nv + d] += dof.armature;
    }
    for (t, tendon) in model.tendons.iter().enumerate().filter(|(_, tendon)| tendon.armature != 0.0) {
        // As in MuJoCo only between dofs of which one carries the other.
        let row = tendon_row(model, data, t);
        for i in 0..nv {
            let mut j = i;
            while j != NONE {
                let more = tendon.armature * row[i] * row[j];
                m[i * nv + j] += more;
                if i != j {
                    m[j * nv + i] += more;
                }
                j = data.plan.dof_parent[j];
            }
        }
    }
    m
}

/// What the joints must exert so that qacc = 0, free bodies included (`qfrc_bias`, nv).
///
///     free body, r from its origin to its centre of mass:
///     f = m (ω × (ω × r) − g),   τ = Rᵀ (r × f + ω × I ω)
pub fn bias(model: &Model, state: &State, data: &Data) -> Vec<f64> {
    let mut bias = data.qfrc_bias.clone();
    let gravity = dynamics::gravity(model);
    for tree in &model.trees {
        let Some(free) = &tree.free else { continue };
        let axes = data.xmat[tree.bodies.start];
        let w = axes * Vec3::from_column_slice(&state.qvel[tree.dofs.start + 3..tree.dofs.end]);
        let (r, principal) = (axes * free.com, axes * free.axes);
        let spin = principal * free.inertia.component_mul(&principal.tr_mul(&w));
        let f = free.mass * (w.cross(&w.cross(&r)) - gravity);
        let torque = axes.tr_mul(&(r.cross(&f) + w.cross(&spin)));
        bias[tree.dofs.clone()].copy_from_slice(join(&f, &torque).as_slice());
    }
    bias
}

/// Forces of all but constraints, free bodies included (`qfrc_smooth`, nv): M qacc_smooth.
pub fn smooth(model: &Model, data: &Data) -> Vec<f64> {
    let mut smooth = data.qfrc_smooth.clone();
    if model.trees.iter().all(|tree| tree.free.is_none()) {
        return smooth;
    }
    let m = inertia_matrix(model, data);
    for tree in model.trees.iter().filter(|tree| tree.free.is_some()) {
        for i in tree.dofs.clone() {
            smooth[i] = tree.dofs.clone().map(|j| m[i * model.nv + j] * data.qacc_smooth[j]).sum();
        }
    }
    smooth
}

/// Length and velocity of each actuator's transmission (`actuator_length`, `actuator_velocity`).
pub fn actuators(model: &Model, state: &State, data: &Data) -> (Vec<f64>, Vec<f64>) {
    let length = |i| actuation::length(model, state, data, i);
    let velocity = |i| actuation::velocity(model, state, data, i);
    (0..model.actuators.len()).map(|i| (length(i), velocity(i))).unzip()
}

/// The rows ∂length/∂q of all actuators as MuJoCo 4.0 stores them: of each the dofs that its transmission reaches, in order,
/// and their entries; of a site or a slider-crank without those that are zero.
pub fn moments(model: &Model, state: &State, data: &mut Data) -> Vec<Vec<(usize, f64)>> {
    let row = |(i, actuator): (usize, &Actuator)| {
        let row = actuator_moment(model, state, data, i);
        let all = !matches!(actuator.transmission, Transmission::Site { .. } | Transmission::SliderCrank { .. });
        let entries = moment_dofs(model, actuator.transmission).into_iter().map(|dof| (dof, row[dof]));
        entries.filter(|(_, entry)| all || *entry != 0.0).collect()
    };
    model.actuators.iter().enumerate().map(row).collect()
}

/// Numbers that [`moments`] can have (MuJoCo's `nJmom`).
pub fn moment_room(model: &Model) -> usize {
    model.actuators.iter().map(|actuator| moment_dofs(model, actuator.transmission).len()).sum()
}

/// The dofs that a transmission reaches, in order.
fn moment_dofs(model: &Model, transmission: Transmission) -> Vec<usize> {
    let of_joint = |j: usize| model.joints[j].dofadr..model.joints[j].dofadr + model.joints[j].kind.nv();
    let mut dofs: Vec<usize> = match transmission {
        Transmission::Joint(j) | Transmission::JointInParent(j) => of_joint(j).collect(),
        Transmission::Tendon(t) if let Path::Fixed(parts) = &model.tendons[t].path => {
            parts.iter().flat_map(|(j, _)| of_joint(*j)).collect()
        }
        _ => {
            let bodies = transmission.bodies(&model.joints, &model.sites, &model.geoms, &model.tendons).into_iter();
            let above = |body: usize| std::iter::successors(Some(body), |b| (*b != 0).then(|| model.bodies[*b].parent));
            bodies.flat_map(above).flat_map(|body| model.bodies[body].dofs.clone()).collect()
        }
    };
    dofs.sort_unstable();
    match transmission {
        // What moves both of its sites moves nothing between them.
        Transmission::Site { reference: Some(_), .. } => {
            dofs.chunk_by(|a, b| a == b).filter(|alike| alike.len() == 1).map(|alike| alike[0]).collect()
        }
        _ => {
            dofs.dedup();
            dofs
        }
    }
}

/// The row ∂length/∂q of an actuator (nv).
pub fn actuator_moment(model: &Model, state: &State, data: &mut Data, actuator: usize) -> Vec<f64> {
    actuation::moment(model, state, data, actuator)
}

/// Velocity of the centre of mass (m/s) of each body and all that hangs on it, and their angular momentum about it
/// (kg m²/s).
///
///     v = Σ mᵢ vᵢ / m,   L = Σ Iᵢ ωᵢ + (xᵢ − c) × mᵢ (vᵢ − v)
pub fn subtree_momentum(model: &Model, state: &State, data: &Data) -> [Vec<Vec3>; 2] {
    let (motion, com, mass) = (Motion::of(model, state, data), subtree_com(model, data), subtree_mass(model));
    let n = model.bodies.len();
    let own: Vec<(Vec3, Vec3)> = (0..n).map(|b| motion.velocity_at(b, &xipos(model, data, b))).collect();
    // Momentum of each subtree first, and its angular momentum about the world's origin.
    let mut linear: Vec<Vec3> = (0..n).map(|b| model.bodies[b].mass * own[b].0).collect();
    let mut angular: Vec<Vec3> = (0..n)
        .map(|b| {
            let x = xipos(model, data, b);
            ang(&inertia(model, data, b, &x).mul(&join(&own[b].0, &own[b].1))) + x.cross(&linear[b])
        })
        .collect();
    for b in (1..n).rev() {
        let (parent, p, l) = (model.bodies[b].parent, linear[b], angular[b]);
        linear[parent] += p;
        angular[parent] += l;
    }
    for b in 0..n {
        angular[b] -= com[b].cross(&linear[b]);
        linear[b] = if mass[b] < MIN_VAL { Vec3::zeros() } else { linear[b] / mass[b] };
    }
    [linear, angular]
}

/// Where a camera is (m) and its axes, as columns: right, up, and against its line of sight.
///
///     track:       axes and offset from the body as they are in `qpos0`
///     targetbody:  z = (camera − target) / |…|,   x = ẑ_world × z / |…|,   y = z × x
///
/// In: `start`, what [`Data::new`] finds: the poses in `qpos0`.
pub fn camera(model: &Model, start: &Data, data: &Data, camera: usize) -> (Vec3, Mat3) {
    let camera = &model.cameras[camera];
    let body = camera.body;
    let fixed = |data: &Data| (data.xpos[body] + data.xmat[body] * camera.pos, data.xmat[body] * mat(&camera.quat));
    let com = |data: &Data, body: usize| subtree_com(model, data)[body];
    let looking = |at: Vec3| {
        let (pos, _) = fixed(data);
        let z = (pos - at).try_normalize(MIN_VAL).unwrap_or_else(Vec3::z);
        let x = Vec3::z().cross(&z).try_normalize(MIN_VAL).unwrap_or_else(Vec3::x);
        (pos, Mat3::from_columns(&[x, z.cross(&x), z]))
    };
    match (camera.mode, camera.target) {
        (CameraMode::Track, _) => {
            let (pos, axes) = fixed(start);
            (data.xpos[body] + pos - start.xpos[body], axes)
        }
        (CameraMode::TrackCom, _) => {
            let (pos, axes) = fixed(start);
            (com(data, body) + pos - com(start, body), axes)
        }
        (CameraMode::TargetBody, Some(target)) => looking(data.xpos[target]),
        (CameraMode::TargetBodyCom, Some(target)) => looking(com(data, target)),
        _ => fixed(data),
    }
}
