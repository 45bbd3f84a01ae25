//! How a model is computed: contact law, integrator, timestep.

use std::fmt;

use crate::contact::{Law, Settings};
use crate::data::Data;
use crate::model::Model;
use crate::state::State;

/// How a model is computed: the same model runs under every method.
#[derive(Clone, Copy)]
pub struct Method {
    /// The contact law.
    pub contact: &'static Law,
    /// The integrator.
    pub integrator: &'static Integrator,
    /// s
    pub timestep: f64,
    /// Newton steps that the `penalty` law takes at most, in each island; see [`ROUNDS`].
    pub rounds: usize,
}

/// What [`Method::rounds`] is without a wish: far more than a scene needs.
pub const ROUNDS: usize = 100;

impl fmt::Debug for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Method { contact, integrator, timestep, rounds } = self;
        write!(f, "Method({}, {}, {timestep} s, {rounds} rounds)", contact.name, integrator.name)
    }
}

impl Method {
    /// What the contact laws need to know of it.
    pub fn settings(&self) -> Settings {
        let &Method { contact: law, timestep, rounds, integrator } = self;
        Settings { law, timestep, rounds, implicit: integrator.implicit }
    }
}

/// An integrator.
pub struct Integrator {
    /// CLI name.
    pub name: &'static str,
    /// MJCF keywords that select it.
    pub mjcf: &'static [&'static str],
    /// Global order on smooth systems; a test measures it.
    pub order: u8,
    /// One line for `--help`, plots and docs.
    pub about: &'static str,
    /// The contact law is asked for the forces at the end of the step: velocities are then not extrapolated.
    pub implicit: bool,
    /// Whose dampers act by the velocity at the end of the step.
    pub implicit_dampers: Dampers,
    /// One step of `method.timestep`: advances time, qpos, qvel and the warm starts.
    pub advance: fn(&Model, &Method, &mut State, &mut Data),
    /// What a step h (s) makes of a damped spring: (x, v) ← A(h) (x, v), row by row. `None`: the method gives no formula,
    /// and theory says nothing about its timestep.
    pub amplification: Option<fn(&DampedSpring, h: f64) -> Matrix2>,
    /// An estimate of what the last step erred, as far as positions and velocities go (2 nv: of q along the dofs, m or rad,
    /// then of v). `None`: the method has none, and its steps cannot be [`controlled`](crate::control).
    pub estimate: Option<fn(&mut Data) -> &[f64]>,
}

/// Dampers that an integrator takes implicitly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dampers {
    /// None of them.
    None,
    /// Those of joints.
    Joints,
    /// Those of joints, and the velocity gains of actuators.
    JointsAndActuators,
}

/// A 2 × 2 matrix, row by row.
pub type Matrix2 = [[f64; 2]; 2];

/// A damped spring of unit mass, as theory asks an integrator about it.
///
///     v̇ = −ω² x − 2 ζ ω v
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DampedSpring {
    /// rad/s
    pub omega: f64,
    /// Damping ratio.
    pub zeta: f64,
    /// Its damper is a joint's, which some integrators take implicitly; contacts' dampers are explicit.
    pub joint: bool,
}

impl DampedSpring {
    /// ω², 1/s²
    pub fn stiffness(&self) -> f64 {
        self.omega * self.omega
    }
    /// 2 ζ ω, 1/s
    pub fn damping(&self) -> f64 {
        2.0 * self.zeta * self.omega
    }
}
