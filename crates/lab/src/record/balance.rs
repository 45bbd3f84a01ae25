//! Where a run's energy went: the work of actuators, dampers, the medium, gravity compensation and contacts.
//!
//!     E(t) − E(0) = W_actuators + W_dampers + W_medium + W_lift + W_constraints + drift
//!
//! E is kinetic energy, weight and springs of what moves; v and v' are the velocities before and after a step.
//!
//!     first order:   W = h f·(v + v')/2           f the force of the step: the exact change of kinetic energy at constant M
//!     higher order:  W = h (f·v + f'·v')/2        f' the force of the step's last stage, f that of the step before
//!
//! What the integrator itself adds or loses is left as drift, and with it the error of these sums: of second order.

use std::ops::Range;

use penny::data::{Data, JointRowKind, TieKind};
use penny::dynamics::tendon;
use penny::integrate::{Dampers, Integrator};
use penny::math::{Vec3, Vec6};
use penny::model::Model;
use penny::state::State;

/// Work done on what moves since the start, J.
#[derive(Clone, Debug)]
pub struct Balance {
    pub actuators: f64,
    /// Dampers of joints and tendons.
    pub dampers: f64,
    /// Drag of the medium, and what its wind drives.
    pub medium: f64,
    /// Compensation of gravity (`gravcomp`), where no actuator bears it.
    pub lift: f64,
    /// All contacts, limits, dry friction and equalities.
    pub constraints: f64,
    /// Friction of contacts and dry friction of joints and tendons: the part of `constraints` that is certainly lost. From the speeds at
    /// which surfaces slide at the beginning of each step.
    pub friction: f64,
    before: Vec<f64>,
    dampers_of: Dampers,
    /// The integrator looks at the forces at the end of the step.
    at_end: bool,
    /// Powers at the end of the last step, where an integrator of higher order sums by them, W.
    powers: Option<Option<[f64; PARTS]>>,
}

/// Parts of the sum: actuators, dampers, medium, gravity compensation, constraints.
const PARTS: usize = 5;

impl Balance {
    pub fn new(model: &Model, integrator: &Integrator) -> Balance {
        let powers = (integrator.order > 1).then_some(None);
        Balance {
            actuators: 0.0,
            dampers: 0.0,
            medium: 0.0,
            lift: 0.0,
            constraints: 0.0,
            friction: 0.0,
            before: vec![0.0; model.nv],
            dampers_of: integrator.implicit_dampers,
            at_end: integrator.implicit,
            powers,
        }
    }

    /// Before a step.
    pub fn before(&mut self, state: &State) {
        self.before.copy_from_slice(&state.qvel);
    }

    /// After that step of `h` (s), with the forces that it left in `data`.
    pub fn after(&mut self, model: &Model, state: &State, data: &Data, h: f64) {
        let before = &self.before;
        let mean = |d: usize| 0.5 * (before[d] + state.qvel[d]);
        // A higher order has its last forces at the end of the step.
        let speed = |d: usize| if self.powers.is_some() { state.qvel[d] } else { mean(d) };
        let power = |force: &[f64]| force.iter().enumerate().map(|(d, f)| f * speed(d)).sum::<f64>();
        let mut now = [0.0; PARTS];
        if !model.actuators.is_empty() {
            now[0] = power(&data.qfrc_actuator);
            if self.dampers_of == Dampers::JointsAndActuators && !self.at_end {
                now[0] += self.implicit_gains(model, state, data);
            }
        }
        if model.opt.flags.damper && model.requires.dampers > 0 {
            let acts = |d: usize| match self.dampers_of {
                _ if self.powers.is_some() => state.qvel[d],
                Dampers::None => before[d],
                Dampers::Joints | Dampers::JointsAndActuators => state.qvel[d],
            };
            now[1] = -model.dofs.iter().enumerate().map(|(d, dof)| dof.damping * acts(d) * speed(d)).sum::<f64>();
        }
        if model.opt.flags.damper && !data.plan.pulling_tendons.is_empty() {
            now[1] += self.tendon_dampers(model, state, data);
        }
        if model.opt.medium() {
            now[2] = power(&data.qfrc_fluid);
        }
        if !data.plan.gravcomp.is_empty() {
            let borne = |d: usize| model.joints[model.dofs[d].joint].actgravcomp;
            let own = data.qfrc_gravcomp.iter().enumerate().filter(|(d, _)| !borne(*d));
            now[3] = own.map(|(d, f)| f * speed(d)).sum();
        }
        if !data.contacts.is_empty() || !data.joint_rows.is_empty() || !data.ties.is_empty() {
            now[4] = power(&data.qfrc_constraint);
            let dry = data.joint_rows.iter().filter(|row| row.kind == JointRowKind::DryFriction);
            let of_joints = dry.map(|row| row.force * mean(row.dof)).sum::<f64>();
            let dry = data.ties.iter().filter(|tie| tie.kind == TieKind::DryFriction);
            let of_tendons = dry.map(|tie| tie.force[0] * along(data, tie.index, mean)).sum::<f64>();
            self.friction += h * (contact_friction(data) + of_joints + of_tendons);
        }
        let work = match &mut self.powers {
            Some(last) => {
                // Before the first step no powers are known.
                let before = last.replace(now).unwrap_or(now);
                std::array::from_fn(|i| 0.5 * h * (before[i] + now[i]))
            }
            None => now.map(|p| h * p),
        };
        let [actuators, dampers, medium, lift, constraints] = work;
        self.actuators += actuators;
        self.dampers += dampers;
        self.medium += medium;
        self.lift += lift;
        self.constraints += constraints;
    }

    /// Power of the dampers of tendons, W.
    ///
    ///     f = −(a u + b u |u| + c u³),   P = f J·v̄
    ///
    /// u: rate of the length, at the beginning of the step; where the integrator takes dampers implicitly, f goes on to the
    /// rate at its end along its slope, of each tree for itself.
    fn tendon_dampers(&self, model: &Model, state: &State, data: &Data) -> f64 {
        let end = |d: usize| state.qvel[d];
        let at_end = self.powers.is_some() || self.at_end;
        let mut power = 0.0;
        for &i in &data.plan.pulling_tendons {
            let tendon = &model.tendons[i];
            let mean = |d: usize| if self.powers.is_some() { end(d) } else { 0.5 * (self.before[d] + end(d)) };
            let [a, b, c] = tendon.damping;
            let rate = along(data, i, |d| if at_end { end(d) } else { self.before[d] });
            power -= rate * (a + b * rate.abs() + c * rate * rate) * along(data, i, mean);
            if !at_end && self.dampers_of == Dampers::JointsAndActuators {
                let slope = tendon::damping(tendon, rate);
                let change = |d: usize| end(d) - self.before[d];
                for block in &data.plan.tendons[i] {
                    let of_tree = |v: &dyn Fn(usize) -> f64| of_block(data, block.at, block.dofs.clone(), v);
                    power += slope * of_tree(&change) * of_tree(&mean);
                }
            }
        }
        power
    }

    /// What the velocity gains of actuators do by the velocity at the end of a step instead of that at its beginning, W.
    fn implicit_gains(&self, model: &Model, state: &State, data: &Data) -> f64 {
        let mut power = 0.0;
        for (i, actuator) in model.actuators.iter().enumerate() {
            let force = data.actuator_force[i];
            // At the end of its force range an actuator has no gain.
            if actuator.forcerange.is_some_and(|[low, high]| force <= low || force >= high) {
                continue;
            }
            let Some(joint) = actuator.transmission.joint().map(|j| &model.joints[j]) else { continue };
            let gain = actuator.bias[2] + actuator.gain[2] * data.actuator_input[i];
            let gears = || actuator.gear.iter().take(joint.kind.nv()).zip(joint.dofadr..);
            let change: f64 = gears().map(|(g, d)| g * (state.qvel[d] - self.before[d])).sum();
            let mean: f64 = gears().map(|(g, d)| 0.5 * g * (state.qvel[d] + self.before[d])).sum();
            power += gain * change * mean;
        }
        power
    }

    /// All work that is accounted for, J.
    pub fn total(&self) -> f64 {
        self.actuators + self.dampers + self.medium + self.lift + self.constraints
    }
}

/// J v of a tendon, m/s. Reads: ten_j.
fn along(data: &Data, tendon: usize, velocity: impl Fn(usize) -> f64) -> f64 {
    data.plan.tendons[tendon].iter().map(|block| of_block(data, block.at, block.dofs.clone(), &velocity)).sum()
}

/// The part of one tree.
fn of_block(data: &Data, at: usize, dofs: Range<usize>, velocity: impl Fn(usize) -> f64) -> f64 {
    data.ten_j[at..].iter().zip(dofs).map(|(j, d)| j * velocity(d)).sum()
}

/// Power of all contacts' friction, W: below 0 it takes energy.
///
///     P = Σ f_t·(v₁ − v₀) + τ·(ω₁ − ω₀)      of the second body against the first, at the point of contact
fn contact_friction(data: &Data) -> f64 {
    let mut power = 0.0;
    for contact in data.contacts.iter().filter(|c| c.force[0] != 0.0) {
        let twist = |side: usize| {
            let mover = &data.movers[contact.body[side] as usize];
            let part = |v: &Vec6, i: usize| Vec3::new(v[i], v[i + 1], v[i + 2]);
            let angular = mover.axes * part(&mover.vel, 3);
            (part(&mover.vel, 0) + angular.cross(&(contact.pos - mover.com)), angular)
        };
        let [(v0, w0), (v1, w1)] = [twist(0), twist(1)];
        let (slip, turn) = (contact.frame * (v1 - v0), contact.frame * (w1 - w0));
        let [_, t1, t2, spin, roll1, roll2] = contact.force;
        power += t1 * slip.y + t2 * slip.z + spin * turn.x + roll1 * turn.y + roll2 * turn.z;
    }
    power
}
