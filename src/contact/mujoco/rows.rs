//! Constraint rows: what a contact, a joint limit or dry friction asks of the accelerations.
//!
//! A contact of dimension `dim` has rows normal, two tangential, torsional, two rolling. Joint limits and dry
//! friction have one row each.

use super::cone::Kind;
use super::solver::Constraint;
use crate::contact::impedance::{self, Reference};
use crate::data::{Contact, Data, Mover};
use crate::math::{Vec3, Vec6};
use crate::model::{Cone, Mix, Model};
use crate::state::State;

/// What all contacts of a mix have in common.
#[derive(Clone, Copy, Debug)]
pub struct Recipe {
    kind: Kind,
    dim: usize,
    mu: [f64; 6],
    /// D of each row over D of the normal (elliptic).
    weight: [f64; 6],
    /// Inverse mass of the row that sets R, over that of the normal: the first edge of a pyramid is n + μ₁t₁.
    slant: f64,
    /// R over that of this row.
    softening: f64,
    solimp: [f64; 5],
    normal: Reference,
    /// B of the friction rows, 1/s.
    damping: f64,
    margin: f64,
    /// Depth over which it switches on, m.
    onset: f64,
}

impl Recipe {
    /// Regularisation of a contact's rows, from that of the normal R₀ = (1 − d)/d A:
    ///
    ///     elliptic:   R₁ = R₀ / impratio,  Rⱼ = R₁ μ₁²/μⱼ²,  μ̃ = μ₁ √(R₁/R₀)
    ///     pyramidal:  R  = 2 μ̃² (1 − d)/d A (1 + μ₁²)   for every edge n ± μⱼtⱼ
    ///
    /// In:     `timestep` in s; `onset` in m, see [`impedance::onset`].
    /// Source: MuJoCo 4.0 manual, Computation › Solver › Friction cones; the factors by experiment.
    pub fn new(mix: &Mix, model: &Model, timestep: f64, onset: f64) -> Recipe {
        let opt = &model.opt;
        let kind = match opt.cone {
            _ if mix.condim == 1 => Kind::OneSided,
            Cone::Pyramidal => Kind::Pyramid,
            Cone::Elliptic => Kind::Ellipse,
        };
        let regular = mix.friction[0] / opt.impratio.sqrt();
        let mut mu = [0.0; 6];
        let mut weight = [1.0; 6];
        mu[1..].copy_from_slice(&mix.friction);
        for j in 1..6 {
            weight[j] = mu[j] * mu[j] / (regular * regular);
        }
        let (mut slant, mut softening) = (1.0, 1.0);
        match kind {
            Kind::Ellipse => mu[0] = regular,
            Kind::Pyramid => {
                slant = 1.0 + mu[1] * mu[1];
                softening = 2.0 * regular * regular;
            }
            _ => {}
        }
        let solimp = impedance::clamp(&mix.solimp);
        let reference = |solref| Reference::new(solref, &solimp, timestep, opt.flags.refsafe);
        // The edges of a pyramid mix normal and friction, so its friction has no reference of its own.
        let own = kind == Kind::Ellipse && (mix.solreffriction[0] > 0.0) == (mix.solreffriction[1] > 0.0);
        let friction = if own { &mix.solreffriction } else { &mix.solref };
        Recipe {
            kind,
            dim: mix.condim,
            mu,
            weight,
            slant,
            softening,
            solimp,
            normal: reference(&mix.solref),
            damping: reference(friction).damping,
            margin: mix.margin,
            onset,
        }
    }

    /// Whether a contact at that distance pushes.
    pub fn active(&self, dist: f64) -> bool {
        dist < self.margin
    }

    pub fn dim(&self) -> usize {
        self.dim
    }

    /// Fills cone and bias of a contact's constraint.
    ///
    ///     r = dist − margin,   x₀ = J₀ a + B v₀ + K d(r) r,   xⱼ = Jⱼ a + B v_j
    ///
    /// In: `dist` in m; `inverse` A of the normal, 1/kg (of the pyramid's first edge over `slant` with
    ///     `diagexact`); `v` the rows' velocities J·qvel, m/s and rad/s.
    #[inline]
    pub fn fill(&self, dist: f64, inverse: f64, v: &[f64; 6], c: &mut Constraint) {
        let r = dist - self.margin;
        let d = impedance::impedance(&self.solimp, r);
        let stiff = 1.0 / (impedance::regularisation(d, inverse * self.slant) * self.softening);
        c.cone.kind = self.kind;
        c.cone.dim = self.dim;
        c.cone.mu = self.mu;
        c.cone.d[0] = stiff;
        c.bias[0] = -self.normal.acceleration(d, r, v[0]);
        for j in 1..self.dim {
            c.cone.d[j] = stiff * self.weight[j];
            c.bias[j] = self.damping * v[j];
        }
        c.zone = 0;
    }

    /// Lets a contact that only just switches on ask for a share s of the change of acceleration, so that its forces
    /// are that share of what they would be. A no-op under explicit integrators.
    ///
    ///     x = J a + s bias − (1 − s) J a_smooth
    ///
    /// In: `smooth` gives the rows' accelerations J·a_smooth, m/s² and rad/s².
    #[inline]
    pub fn switch_on(&self, dist: f64, c: &mut Constraint, smooth: impl FnOnce() -> [f64; 6]) {
        let share = impedance::share(self.margin - dist, self.onset);
        if share < 1.0 {
            for (bias, a) in c.bias.iter_mut().zip(smooth()) {
                *bias = share * *bias - (1.0 - share) * a;
            }
        }
    }

    /// What A of the normal must be replaced by so that the row that sets R has its exact J M⁻¹ Jᵀ.
    ///
    /// In: `inverse(e)` the inverse mass seen by the row e₀ J₀ + e₁ J₁.
    pub fn exact(&self, mut inverse: impl FnMut([f64; 2]) -> f64) -> f64 {
        match self.kind {
            Kind::Pyramid => inverse([1.0, self.mu[1]]) / self.slant,
            _ => inverse([1.0, 0.0]),
        }
    }
}

/// Sum of the inverse masses that MuJoCo attributes to the two bodies of a contact at `qpos0`, 1/kg.
pub fn inverse_mass(model: &Model, contact: &Contact) -> f64 {
    let of = |side: usize| model.bodies[model.geoms[contact.geom[side] as usize].body].invweight0[0];
    of(0) + of(1)
}

/// Rows of a contact for one side that is a free body, in the coordinates of its mover.
///
///     J₀..₂ = ± [n, Aᵀ(r × n)],   J₃..₅ = ± [0, Aᵀn]      with n the rows of the frame, r from the COM, A the axes
///
/// In: `sign` −1 for the body of geom 0, +1 for that of geom 1.
#[inline]
pub fn free_rows(contact: &Contact, mover: &Mover, sign: f64, jac: &mut [[f64; 6]]) {
    let dim = jac.len();
    let lever = contact.pos - mover.com;
    for k in 0..dim.min(3) {
        let n = contact.frame.row(k).transpose() * sign;
        let turn = mover.axes.tr_mul(&lever.cross(&n));
        jac[k] = [n.x, n.y, n.z, turn.x, turn.y, turn.z];
    }
    for k in 3..dim {
        let turn = mover.axes.tr_mul(&contact.frame.row(k - 3).transpose()) * sign;
        jac[k] = [0.0, 0.0, 0.0, turn.x, turn.y, turn.z];
    }
}

/// Rows of a contact for one side, in the dofs of its tree: ± frame · J. Calls `add` with row, dof and number.
///
/// In: `columns` J of the contact point ([`dynamics::jacobian`](crate::dynamics::jacobian)).
#[inline]
pub fn tree_rows(contact: &Contact, columns: &[Vec6], sign: f64, dim: usize, mut add: impl FnMut(usize, usize, f64)) {
    for (j, column) in columns.iter().enumerate() {
        let linear = contact.frame * Vec3::new(column[0], column[1], column[2]) * sign;
        for k in 0..dim.min(3) {
            add(k, j, linear[k]);
        }
        if dim > 3 {
            let angular = contact.frame * Vec3::new(column[3], column[4], column[5]) * sign;
            for k in 3..dim {
                add(k, j, angular[k - 3]);
            }
        }
    }
}

/// A row of a tree's dofs with up to three entries: −axis of a ball joint, ±1 of a limit, 1 of dry friction.
#[derive(Clone, Copy, Debug)]
pub struct DofRow {
    /// First dof, index into qvel.
    pub dof: usize,
    pub n: usize,
    pub entries: [f64; 3],
    pub constraint: Constraint,
}

/// Calls `emit` with the rows of dry friction, then with those of joint limits.
pub fn of_joints(model: &Model, data: &Data, timestep: f64, state: &State, mut emit: impl FnMut(DofRow)) {
    dry_friction(model, &data.plan.dry, timestep, &state.qvel, &mut emit);
    limits(model, &data.plan.limited, timestep, &state.qpos, &state.qvel, &mut emit);
}

/// Calls `emit` with the row of every dof that has dry friction.
///
///     x = q̈ + B q̇,   R = (1 − d0)/d0 A
///
/// Source: MuJoCo 4.0 manual, Computation › Constraint model › Friction loss.
pub fn dry_friction(model: &Model, dofs: &[usize], timestep: f64, qvel: &[f64], mut emit: impl FnMut(DofRow)) {
    for &dof in dofs {
        let d = &model.dofs[dof];
        let joint = &model.joints[d.joint];
        let solimp = impedance::clamp(&joint.solimp_friction);
        let reference = Reference::new(&joint.solref_friction, &solimp, timestep, model.opt.flags.refsafe);
        let mut constraint = Constraint::default();
        constraint.cone.kind = Kind::Dry;
        constraint.cone.dim = 1;
        let r = impedance::regularisation(impedance::impedance(&solimp, 0.0), d.invweight0);
        constraint.cone.d[0] = 1.0 / r;
        constraint.cone.mu[0] = d.frictionloss;
        constraint.bias[0] = reference.damping * qvel[dof];
        emit(DofRow { dof, n: 1, entries: [1.0, 0.0, 0.0], constraint });
    }
}

/// Calls `emit` with the row of every joint limit that is nearer than the joint's margin.
///
///     slide, hinge:  dist = q − lower, J = 1;   dist = upper − q, J = −1
///     ball:          dist = range − |θ|, J = −θ/|θ|      with θ the rotation vector
///
/// Source: MuJoCo 4.0 manual, Computation › Constraint model › Limit.
pub fn limits(
    model: &Model,
    joints: &[usize],
    timestep: f64,
    qpos: &[f64],
    qvel: &[f64],
    mut emit: impl FnMut(DofRow),
) {
    for &index in joints {
        let joint = &model.joints[index];
        let Some(range) = joint.range else { continue };
        let mut push = |dist: f64, entries: [f64; 3]| {
            if dist >= joint.margin {
                return;
            }
            let solimp = impedance::clamp(&joint.solimp_limit);
            let reference = Reference::new(&joint.solref_limit, &solimp, timestep, model.opt.flags.refsafe);
            let n = joint.kind.nv();
            let v: f64 = (0..n).map(|i| entries[i] * qvel[joint.dofadr + i]).sum();
            let r = dist - joint.margin;
            let d = impedance::impedance(&solimp, r);
            let mut constraint = Constraint::default();
            constraint.cone.kind = Kind::OneSided;
            constraint.cone.dim = 1;
            constraint.cone.d[0] = 1.0 / impedance::regularisation(d, model.dofs[joint.dofadr].invweight0);
            constraint.bias[0] = -reference.acceleration(d, r, v);
            emit(DofRow { dof: joint.dofadr, n, entries, constraint });
        };
        let q = &qpos[joint.qposadr..];
        if joint.kind.nv() == 1 {
            push(q[0] - range[0], [1.0, 0.0, 0.0]);
            push(range[1] - q[0], [-1.0, 0.0, 0.0]);
        } else {
            let (axis, angle) = axis_angle(&q[..4]);
            push(range[0].max(range[1]) - angle, [-axis.x, -axis.y, -axis.z]);
        }
    }
}

/// Unit axis and angle in [0, π] of a quaternion [w, x, y, z]; axis x where there is no rotation.
fn axis_angle(q: &[f64]) -> (Vec3, f64) {
    let v = Vec3::new(q[1], q[2], q[3]);
    let sin = v.norm();
    if sin < crate::math::MIN_VAL {
        return (Vec3::x(), 0.0);
    }
    let angle = 2.0 * sin.atan2(q[0]);
    let axis = v / sin;
    if angle > std::f64::consts::PI { (-axis, std::f64::consts::TAU - angle) } else { (axis, angle) }
}
