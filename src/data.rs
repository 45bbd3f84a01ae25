//! What follows from `(Model, State)`: scratch of a step and results to look at afterwards.
//!
//! Nothing here has to be saved. There is room for all contacts that a scene can have from the start, so that no step
//! allocates after the first. Per-body arrays are indexed like `model.bodies`.

use std::any::{Any, TypeId};

use crate::collision::Scratch;
use crate::contact::impedance::Reference;
use crate::dynamics::plan::Plan;
use crate::dynamics::plane;
use crate::dynamics::spatial::Inertia;
use crate::math::{Mat3, Quat, Vec3, Vec6};
use crate::model::Model;

/// Results of the last step or [`forward`](crate::forward::forward), and the buffers that it worked in; see the module.
#[derive(Clone, Debug, Default)]
pub struct Data {
    /// What a step of this model has to compute.
    pub plan: Plan,
    /// [`Model::revision`] of the model that all this was prepared for.
    pub revision: u64,

    // Kinematics: poses in the world.
    /// Origin of each body, m.
    pub xpos: Vec<Vec3>,
    /// Orientation of each body.
    pub xquat: Vec<Quat>,
    /// The same as a matrix: columns are the body's axes.
    pub xmat: Vec<Mat3>,
    /// Anchor of each joint, m.
    pub xanchor: Vec<Vec3>,
    /// Axis of each joint, unit vector.
    pub xaxis: Vec<Vec3>,
    /// Centres of the geoms that take part in collisions, m; others are never computed.
    pub geom_xpos: Vec<Vec3>,
    /// Their axes, as columns.
    pub geom_xmat: Vec<Mat3>,
    /// How each body that has joints moves, as one rigid body (indexed by body; see [`Mover`]).
    pub movers: Vec<Mover>,

    // Smooth dynamics.
    /// Bias force c of M a + c = force: Coriolis, centrifugal and gravity (nv).
    pub qfrc_bias: Vec<f64>,
    /// Springs and dampers (nv).
    pub qfrc_passive: Vec<f64>,
    /// Actuators (nv).
    pub qfrc_actuator: Vec<f64>,
    /// Drag of the medium (nv).
    pub qfrc_fluid: Vec<f64>,
    /// Compensation of gravity (nv).
    pub qfrc_gravcomp: Vec<f64>,
    /// What changes an actuator's force: its control or activation.
    pub actuator_input: Vec<f64>,
    /// Rates of the activations (na), 1/s.
    pub act_dot: Vec<f64>,
    /// ∂length/∂q of actuators that do not act on a joint's axes, rows of nv at `plan.moments`.
    pub moments: Vec<f64>,
    /// Length of each tendon, m.
    pub ten_length: Vec<f64>,
    /// Its rate, m/s.
    pub ten_velocity: Vec<f64>,
    /// ∂length/∂q of each tendon, in blocks: `plan.tendons` says where.
    pub ten_j: Vec<f64>,
    /// Whether the forces of actuators on a tendon are bounded by its `actuatorfrcrange`.
    pub ten_bounded: Vec<bool>,
    /// Rate of the velocity at q̈ = 0 of tendons with inertia, m/s².
    pub ten_rate: Vec<f64>,
    /// That of the method, s.
    pub timestep: f64,
    /// The force of each actuator before its gear, N or N m.
    pub actuator_force: Vec<f64>,
    /// All forces but those of constraints: passive + actuator + applied − bias (nv). Free trees have none here,
    /// nor in `qfrc_bias`: their acceleration has a closed form.
    pub qfrc_smooth: Vec<f64>,
    /// Acceleration without contact and other constraint forces (nv).
    pub qacc_smooth: Vec<f64>,
    /// Inertia matrix without what is zero, rows as in [`factor`](crate::dynamics::factor); free trees have none.
    /// [`dense_m`](crate::dynamics::dense_m) writes it out.
    pub qm_rows: Vec<f64>,
    /// Its factor, in the same layout.
    pub qld: Vec<f64>,

    // Scratch of trees that are not free bodies: six-vectors in world axes about the tree's first body.
    /// Twist that each dof causes (nv).
    pub cdof: Vec<Vec6>,
    /// Twist of each body.
    pub cvel: Vec<Vec6>,
    /// Acceleration of each body with joints. Here and below such a body counts as one with what is welded to it.
    pub cacc: Vec<Vec6>,
    /// Force on it.
    pub cfrc: Vec<Vec6>,
    /// Its inertia.
    pub cinert: Vec<Inertia>,
    /// Its inertia with all that hangs on it.
    pub crb: Vec<Inertia>,
    /// The same of trees that move in a plane.
    pub planar: plane::Scratch,
    /// Scratch of the integrators.
    pub stages: Stages,

    // Contacts.
    /// The contacts, in MuJoCo's order.
    pub contacts: Vec<Contact>,
    /// Scratch of collision detection.
    pub detect: Scratch,
    /// Joint limits that are near, and dry friction: dry friction first.
    pub joint_rows: Vec<JointRow>,
    /// Equalities that hold, then dry friction and limits that are near of tendons.
    pub ties: Vec<Tie>,
    /// Rows of J of the equalities, in blocks: `plan.equalities` says where.
    pub eq_j: Vec<f64>,

    // Result.
    /// Acceleration (nv).
    pub qacc: Vec<f64>,
    /// Generalized force of all constraints: contacts, limits, dry friction and equalities (nv).
    pub qfrc_constraint: Vec<f64>,
    /// What the scene's sensors measured, one after the other: see [`crate::sensors`].
    pub sensordata: Vec<f64>,
    /// What the last step did.
    pub counts: Counts,
    /// Of the last solve for contact forces: most linear systems of an island, largest residual that was left.
    pub solver: Outcome,
    /// Steps so far whose equation an implicit integrator could not solve.
    pub unsolved: usize,
    /// Steps so far whose contact forces were left with a residual that counts.
    pub unconverged: usize,

    /// What contact laws and integrators keep.
    pub scratch: Scratchpad,
}

/// Buffers that a law or an integrator keeps from step to step, one of each type: nothing that matters.
///
/// A clone begins empty.
#[derive(Default)]
pub struct Scratchpad(Vec<(TypeId, Box<dyn Any + Send + Sync>)>);

impl Scratchpad {
    /// The entry of type T, made when it is first asked for.
    #[inline]
    pub fn get<T: Any + Default + Send + Sync>(&mut self) -> &mut T {
        let at = self.0.iter().position(|(kind, _)| *kind == TypeId::of::<T>());
        let at = at.unwrap_or_else(|| self.add::<T>());
        // It is that type: found or made so.
        self.0[at].1.downcast_mut().unwrap_or_else(|| unreachable!())
    }

    /// Where the new entry is.
    #[cold]
    fn add<T: Any + Default + Send + Sync>(&mut self) -> usize {
        self.0.push((TypeId::of::<T>(), Box::<T>::default()));
        self.0.len() - 1
    }

    /// Takes the entry of type T out, for a while in which the rest of the data is needed too; a new one if there is none.
    pub fn take<T: Any + Default + Send + Sync>(&mut self) -> Box<T> {
        let at = self.0.iter().position(|(kind, _)| *kind == TypeId::of::<T>());
        at.and_then(|at| self.0.swap_remove(at).1.downcast().ok()).unwrap_or_default()
    }

    /// Puts it back.
    pub fn put<T: Any + Send + Sync>(&mut self, entry: Box<T>) {
        self.0.push((TypeId::of::<T>(), entry));
    }
}

impl Clone for Scratchpad {
    fn clone(&self) -> Scratchpad {
        Scratchpad::default()
    }
}

impl std::fmt::Debug for Scratchpad {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "Scratchpad({})", self.0.len())
    }
}

/// A body as the contact laws see it: a twist at the centre of mass of the rigid body it belongs to.
///
/// Linear part in world axes; angular part in `axes`, the principal axes of a free body (so that its inverse
/// inertia is the diagonal `minv`) and the world's axes otherwise.
#[derive(Clone, Copy, Debug)]
pub struct Mover {
    /// Centre of mass, world, m.
    pub com: Vec3,
    /// Columns are the axes in which angular parts are expressed.
    pub axes: Mat3,
    /// Velocity: m/s, rad/s.
    pub vel: Vec6,
    /// J(com)·qacc_smooth of a free body, or one that is uncoupled: m/s², rad/s². Without the J̇·qvel term, as in MuJoCo.
    pub acc: Vec6,
    /// Diagonal of the inverse inertia of a free body, or one that is uncoupled (1/kg, 1/(kg m²)); unused for other bodies.
    pub minv: Vec6,
}

impl Default for Mover {
    fn default() -> Mover {
        Mover {
            com: Vec3::zeros(),
            axes: Mat3::identity(),
            vel: Vec6::zeros(),
            acc: Vec6::zeros(),
            minv: Vec6::zeros(),
        }
    }
}

/// One contact point of the current step.
#[derive(Clone, Copy, Debug)]
pub struct Contact {
    /// The two geoms.
    pub geom: [u32; 2],
    /// The bodies that move with the two geoms (`Body::weld`; 0 for what never moves).
    pub body: [u32; 2],
    /// Index into `model.mixes`.
    pub mix: u32,
    /// Which corner, edge or end of the two touches: the same from step to step.
    pub feature: u32,
    /// m; negative in penetration.
    pub dist: f64,
    /// Midway between the surfaces, world, m.
    pub pos: Vec3,
    /// Rows: normal (from geom 0 to geom 1), two tangents.
    pub frame: Mat3,
    /// Force on geom 1: normal, two tangential (N); torsional, two rolling (N m); in `frame`. Zero until the
    /// contact law has run.
    pub force: [f64; 6],
}

impl Contact {
    /// Whether it pushes, or is merely near.
    #[inline]
    pub fn pushes(&self, model: &Model) -> bool {
        self.dist < model.mixes[self.mix as usize].margin
    }
}

/// A row of J on the dofs of one joint: a limit that is near, or dry friction of one dof.
#[derive(Clone, Copy, Debug)]
pub struct JointRow {
    /// Limit or dry friction.
    pub kind: JointRowKind,
    /// Index of the joint.
    pub joint: usize,
    /// First dof, index into qvel, and how many there are: three for a ball joint.
    pub dof: usize,
    /// How many dofs its row has.
    pub n: usize,
    /// J: −axis of a ball joint, ±1 of a limit, 1 of dry friction.
    pub entries: [f64; 3],
    /// r: distance from the limit less the margin, m or rad; negative beyond.
    pub violation: f64,
    /// d(r)
    pub impedance: f64,
    /// Spring and damper of the row.
    pub reference: Reference,
    /// MuJoCo's estimate of J M⁻¹ Jᵀ: `invweight0`, 1/kg or 1/(kg m²).
    pub inverse: f64,
    /// Largest dry friction, N or N m.
    pub loss: f64,
    /// N or N m, positive away from the limit. Zero until the contact law has run.
    pub force: f64,
}

/// A constraint whose rows of J reach over whole trees: an equality, or a limit or the dry friction of a tendon.
#[derive(Clone, Copy, Debug)]
pub struct Tie {
    /// What it is.
    pub kind: TieKind,
    /// Index of the equality or of the tendon.
    pub index: usize,
    /// Number of rows: 1, of a `connect` 3, of a `weld` 6.
    pub dim: usize,
    /// Of a limit: +1 at the lower end, −1 at the upper end. Otherwise 1.
    pub sign: f64,
    /// r of each row, m or rad times torquescale; of a limit less the margin, negative beyond.
    pub violation: [f64; 6],
    /// J̇ q̇ of the rows of a `connect` or `weld`, m/s²; of others 0, as in MuJoCo.
    pub drift: [f64; 6],
    /// d(r), of all rows the same: r is the norm of an equality's violation.
    pub impedance: f64,
    /// Spring and damper of the rows.
    pub reference: Reference,
    /// MuJoCo's estimates of J M⁻¹ Jᵀ: of the first three rows, and of the last three of a weld.
    pub inverse: [f64; 2],
    /// Largest dry friction, N.
    pub loss: f64,
    /// Along the rows of J, N and N m. Zero until the contact law has run.
    pub force: [f64; 6],
}

/// What a [`Tie`] is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum TieKind {
    /// An equality.
    Equality,
    /// `frictionloss` of a tendon.
    DryFriction,
    /// `range[0]` of a tendon.
    LowerLimit,
    /// `range[1]` of a tendon.
    UpperLimit,
}

/// What a row of a joint stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum JointRowKind {
    /// `frictionloss`
    DryFriction,
    /// `range[0]`
    LowerLimit,
    /// The only one of a ball joint.
    UpperLimit,
}

/// What a solve did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Newton iterations, each one linear system.
    pub iterations: usize,
    /// What is left of the equations. `mujoco`: |g| / √(trace of M), m/s², of the gradient g in coordinates in which
    /// every mass is 1; no less than MuJoCo's own. `penalty`: see [`residual`](crate::contact::penalty::residual::residual). 0 where
    /// the forces are formulas.
    pub residual: f64,
}

impl Outcome {
    /// The outcome of one solve after another.
    pub(crate) fn then(self, next: Outcome) -> Outcome {
        Outcome { iterations: self.iterations + next.iterations, residual: next.residual }
    }
}

/// What a step did: proof that it did no more than the scene requires.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Geom pairs handed to a collider.
    pub pairs: usize,
    /// Contacts found.
    pub contacts: usize,
    /// Searches for contacts that found more than the scene may have, and so kept none.
    pub crowded: usize,
    /// Scalar constraint rows set up (contact directions, limits, dry friction, equalities).
    pub rows: usize,
    /// Linear systems solved by the contact law.
    pub solves: usize,
    /// Evaluations of the forces (RK4 has four a step).
    pub forwards: usize,
    /// Of these, unless they are an implicit integrator's search, with contact forces left with a residual that counts.
    pub unconverged: usize,
}

impl Counts {
    /// Whether anything touched, or a limit, dry friction or equality acted, in any evaluation of the forces.
    pub fn constrained(&self) -> bool {
        self.contacts + self.rows > 0
    }
}

/// Scratch of the integrators.
#[derive(Clone, Debug, Default)]
pub struct Stages {
    /// State at the start of the step.
    pub qpos: Vec<f64>,
    /// Velocity at the start of the step (nv).
    pub qvel: Vec<f64>,
    /// How positions change during a stage (nv).
    pub rate: Vec<f64>,
    /// Weighted sums over the stages (nv), or the acceleration that an implicit update uses.
    pub vel: Vec<f64>,
    /// Weighted sum of accelerations (nv).
    pub acc: Vec<f64>,
    /// Activations at the start of the step, and the weighted sum of their rates (na).
    pub act: Vec<f64>,
    /// Rate of the activations.
    pub act_dot: Vec<f64>,
    /// Factor of an implicit update's matrix, layout of `qld`.
    pub qh: Vec<f64>,
}

impl Stages {
    fn new(nq: usize, nv: usize, na: usize, size: usize) -> Stages {
        Stages {
            qpos: vec![0.0; nq],
            qvel: vec![0.0; nv],
            rate: vec![0.0; nv],
            vel: vec![0.0; nv],
            acc: vec![0.0; nv],
            act: vec![0.0; na],
            act_dot: vec![0.0; na],
            qh: vec![0.0; size],
        }
    }
}

impl Data {
    /// Buffers for poses of a model; nothing in them yet.
    pub(crate) fn posed(model: &Model) -> Data {
        let (n, joints, geoms) = (model.bodies.len(), model.joints.len(), model.geoms.len());
        // Free bodies have no use for the axes of their dofs.
        let axes = if model.trees.iter().all(|tree| tree.free.is_some()) { 0 } else { model.nv };
        Data {
            plan: Plan::new(model),
            revision: model.revision(),
            xpos: vec![Vec3::zeros(); n],
            xquat: vec![Quat::identity(); n],
            xmat: vec![Mat3::identity(); n],
            xanchor: vec![Vec3::zeros(); joints],
            xaxis: vec![Vec3::zeros(); joints],
            geom_xpos: vec![Vec3::zeros(); geoms],
            geom_xmat: vec![Mat3::identity(); geoms],
            movers: vec![Mover::default(); n],
            timestep: model.opt.timestep,
            cdof: vec![Vec6::zeros(); axes],
            ..Data::default()
        }
    }

    /// Buffers for a model; nothing in them yet.
    pub(crate) fn blank(model: &Model) -> Data {
        let n = model.bodies.len();
        let zeros = vec![0.0; model.nv];
        let posed = Data::posed(model);
        let plan = &posed.plan;
        let entries = plan.pattern.size();
        let moments = vec![0.0; model.nv * plan.moments.iter().flatten().count()];
        let (ten_j, eq_j) = (vec![0.0; plan.tendon_numbers], vec![0.0; plan.equality_numbers]);
        let of_tendons = vec![0.0; model.tendons.len()];
        Data {
            qfrc_bias: zeros.clone(),
            qfrc_passive: zeros.clone(),
            qfrc_actuator: zeros.clone(),
            qfrc_fluid: zeros.clone(),
            qfrc_gravcomp: zeros.clone(),
            actuator_input: vec![0.0; model.actuators.len()],
            act_dot: vec![0.0; model.na],
            moments,
            ten_length: of_tendons.clone(),
            ten_velocity: of_tendons.clone(),
            ten_j,
            ten_rate: of_tendons,
            ten_bounded: vec![false; model.tendons.len()],
            actuator_force: vec![0.0; model.actuators.len()],
            qfrc_smooth: zeros.clone(),
            qacc_smooth: zeros.clone(),
            qm_rows: vec![0.0; entries],
            qld: vec![0.0; entries],
            cdof: vec![Vec6::zeros(); model.nv],
            cvel: vec![Vec6::zeros(); n],
            cacc: vec![Vec6::zeros(); n],
            cfrc: vec![Vec6::zeros(); n],
            cinert: vec![Inertia::default(); n],
            crb: vec![Inertia::default(); n],
            planar: plane::Scratch::new(model),
            stages: Stages::new(model.nq, model.nv, model.na, entries),
            eq_j,
            qacc: zeros.clone(),
            qfrc_constraint: zeros,
            sensordata: vec![0.0; model.nsensordata],
            ..posed
        }
    }
}
