//! Joints, their limits and their actuators as springs and dampers: k, c, ω, ζ, rest, sag.
//!
//! A slide or hinge with the mass (or inertia) m that it moves in `qpos0`:
//!
//!     m q̈ = k_j (q₀ − q) − c_j q̇ + Σ gear f,     f = gain ctrl + b₀ + b₁ gear q + b₂ gear q̇
//!
//! so an actuator adds the stiffness −gear² b₁ and the damping −gear² b₂: kp and kv of a position servo.

use crate::names;
use penny::contact::constants;
use penny::data::Data;
use penny::dynamics;
use penny::forward::{self, Method};
use penny::model::{Actuator, Joint, JointKind, Mix, Model};
use penny::state::State;

/// What drives and holds one slide or hinge; m is kg or kg m², k N/m or N m/rad, c N s/m or N m s/rad.
#[derive(Clone, Debug)]
pub struct Coordinate {
    pub joint: usize,
    pub mass: f64,
    pub joint_stiffness: f64,
    pub joint_damping: f64,
    /// The actuators of this joint; none where actuation is disabled.
    pub servos: Vec<Servo>,
}

/// What an actuator adds to the stiffness and the damping of its joint, its gear included.
#[derive(Clone, Debug)]
pub struct Servo {
    pub actuator: usize,
    pub stiffness: f64,
    pub damping: f64,
}

/// `None` for ball and free joints.
pub fn coordinate(model: &Model, joint: usize) -> Option<Coordinate> {
    let j = &model.joints[joint];
    if !matches!(j.kind, JointKind::Slide | JointKind::Hinge) {
        return None;
    }
    let dof = &model.dofs[j.dofadr];
    let servo = |(actuator, a): (usize, &Actuator)| {
        let [stiffness, damping] = [1, 2].map(|bias| a.gear[0].powi(2) * -a.bias[bias]);
        let drives = a.transmission.joint() == Some(joint) && model.opt.flags.actuation;
        drives.then_some(Servo { actuator, stiffness, damping })
    };
    Some(Coordinate {
        joint,
        mass: 1.0 / dof.invweight0,
        joint_stiffness: if model.opt.flags.spring { j.stiffness } else { 0.0 },
        joint_damping: if model.opt.flags.damper { dof.damping } else { 0.0 },
        servos: model.actuators.iter().enumerate().filter_map(servo).collect(),
    })
}

impl Coordinate {
    pub fn stiffness(&self) -> f64 {
        self.joint_stiffness + self.servo_stiffness()
    }

    pub fn damping(&self) -> f64 {
        self.joint_damping + self.servo_damping()
    }

    pub fn servo_stiffness(&self) -> f64 {
        self.servos.iter().map(|s| s.stiffness).sum()
    }

    pub fn servo_damping(&self) -> f64 {
        self.servos.iter().map(|s| s.damping).sum()
    }

    /// √(k/m), rad/s
    pub fn omega(&self) -> f64 {
        (self.stiffness() / self.mass).sqrt()
    }

    /// c/(2 √(k m))
    pub fn zeta(&self) -> f64 {
        self.damping() / (2.0 * (self.stiffness() * self.mass).sqrt())
    }

    /// "joint x", or the servo that holds it: "servo of joint x".
    pub fn name(&self, model: &Model) -> String {
        let joint = format!("joint {}", names::joint(model, self.joint));
        // The one that gives most of what holds it.
        let most = |gives: fn(&Servo) -> f64| self.servos.iter().rev().max_by(|a, b| gives(a).total_cmp(&gives(b)));
        let held = if self.servo_stiffness() > self.joint_stiffness {
            most(|s| s.stiffness)
        } else if self.servo_damping() > self.joint_damping {
            most(|s| s.damping)
        } else {
            None
        };
        held.map_or(joint.clone(), |servo| format!("{} of {joint}", names::actuator(model, servo.actuator)))
    }
}

/// The force that weight, less what `gravcomp` takes of it, puts on each dof at a state, N or N m (nv): what a servo has
/// to hold.
pub fn weights(model: &Model, method: &Method, state: &State) -> Vec<f64> {
    let (mut data, mut resting) = (Data::new(model), state.clone());
    resting.qvel.fill(0.0);
    forward::forward(model, method, &resting, &mut data);
    let mut weights: Vec<f64> = data.qfrc_bias.iter().map(|f| -f).collect();
    let g = dynamics::gravity(model);
    if !data.plan.gravcomp.is_empty() {
        weights.iter_mut().zip(&data.qfrc_gravcomp).for_each(|(weight, lift)| *weight += lift);
    }
    for tree in &model.trees {
        if let Some(free) = &tree.free {
            for (i, dof) in tree.dofs.clone().take(3).enumerate() {
                weights[dof] = free.mass * g[i];
            }
        }
    }
    weights
}

/// Whether limits of joints and tendons do anything.
pub(super) fn limits_act(model: &Model) -> bool {
    model.opt.flags.constraint && model.opt.flags.limit
}

/// A joint limit as a spring of MuJoCo's kind: the limit's mass is what its row moves. `None` without one that acts.
pub fn limit_spring(model: &Model, joint: usize, timestep: f64) -> Option<constants::Spring> {
    let j = &model.joints[joint];
    j.range.filter(|_| limits_act(model))?;
    let mass = 1.0 / model.dofs[j.dofadr].invweight0;
    Some(pressed_hard(model, j.solref_limit, j.solimp_limit, mass, timestep))
}

/// What `solref` and `solimp` mean for a mass at a timestep (s), where the impedance is at its end.
pub(super) fn pressed_hard(
    model: &Model,
    solref: [f64; 2],
    solimp: [f64; 5],
    mass: f64,
    timestep: f64,
) -> constants::Spring {
    let (mix, carried) = (limit_mix(solref, solimp), constants::Carried { mass, softness: 1.0 });
    constants::spring(&mix, carried, mix.solimp[2].max(1.0), timestep, model.opt.flags.refsafe)
}

/// How far a joint goes beyond its limit under a steady force (N or N m), m or rad.
pub fn limit_depth(model: &Model, joint: usize, force: f64, timestep: f64) -> f64 {
    let j = &model.joints[joint];
    let mass = 1.0 / model.dofs[j.dofadr].invweight0;
    let mix = limit_mix(j.solref_limit, j.solimp_limit);
    constants::rest_depth(&mix, 1.0, force / mass, timestep, model.opt.flags.refsafe)
}

fn limit_mix(solref: [f64; 2], solimp: [f64; 5]) -> Mix {
    Mix { condim: 1, friction: [0.0; 5], solref, solreffriction: solref, solimp, margin: 0.0, gap: 0.0 }
}

/// Energy that actuators with constant controls have still to give, as a potential, J: with it, a scene that is driven is
/// judged as one that is not. What their velocity gains take is not in it.
///
///     U(l) = −∫ clamp(gain ctrl + b₀ + b₁ l) dl,     l = gear q
pub fn actuator_potential(model: &Model, state: &State) -> f64 {
    if !model.opt.flags.actuation {
        return 0.0;
    }
    let mut sum = 0.0;
    for (i, a) in model.actuators.iter().enumerate() {
        let Some(j) = simple(model, a) else { continue };
        let length = a.gear[0] * state.qpos[j.qposadr];
        let constant = a.gain[0] * crate::record::clamped(model, i, state.ctrl[i]) + a.bias[0];
        let [low, high] = a.forcerange.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        let slope = a.bias[1];
        if slope == 0.0 {
            sum -= constant.clamp(low, high) * length;
            continue;
        }
        // ∫ clamp(u) du / b₁, u = constant + b₁ l
        let u = constant + slope * length;
        let integral = match u {
            u if u < low => low * u - 0.5 * low * low,
            u if u > high => high * u - 0.5 * high * high,
            u => 0.5 * u * u,
        };
        sum -= integral / slope;
    }
    sum
}

/// Whether all actuators have a potential: a scene in which some have none gains energy that nobody can account for.
pub fn have_potential(model: &Model) -> bool {
    !model.opt.flags.actuation || model.actuators.iter().all(|a| simple(model, a).is_some())
}

/// The slide or hinge of an actuator that has a potential: without dynamics, and with a gain that does not vary.
fn simple<'a>(model: &'a Model, a: &Actuator) -> Option<&'a Joint> {
    let j = &model.joints[a.transmission.joint()?];
    let single = matches!(j.kind, JointKind::Slide | JointKind::Hinge);
    (single && a.act.is_none() && a.gain[1..] == [0.0; 2]).then_some(j)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_servo_is_a_spring_and_its_potential_gives_its_force() {
        let text = r#"<mujoco><compiler angle="radian"/><worldbody><body><joint name="roll" axis="0 0 1"/>
            <inertial pos="0 0 0" mass="0.4" diaginertia="4e-4 4e-4 4e-4"/></body></worldbody>
            <actuator><position name="servo" joint="roll" kp="400" kv="4" gear="2" forcerange="-9 9"/></actuator></mujoco>"#;
        let model = penny::parse("servo.xml", text).unwrap_or_else(|e| panic!("{e}")).model;
        let servo = coordinate(&model, 0).expect("a hinge");
        assert!((servo.omega() - (4.0 * 400.0 / 4e-4f64).sqrt()).abs() < 1e-6 * servo.omega());
        assert!((servo.damping() - 16.0).abs() < 1e-12 && servo.name(&model) == "servo of joint roll");
        let mut state = State::new(&model);
        state.ctrl[0] = 0.01;
        for q in [-0.1, 0.0, 0.004, 0.2] {
            let at = |q: f64| {
                let mut state = state.clone();
                state.qpos[0] = q;
                actuator_potential(&model, &state)
            };
            let force = -(at(q + 1e-6) - at(q - 1e-6)) / 2e-6;
            let right = 2.0 * (400.0 * (0.01 - 2.0 * q)).clamp(-9.0, 9.0);
            assert!((force - right).abs() < 1e-5, "{q}: {force} {right}");
        }
    }
}
