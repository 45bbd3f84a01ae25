//! From keys and mouse to a force and a torque on a body.

use super::energy_balance;
use super::session::Session;
use penny::math::{Vec3, Vec6};

/// Strength of each kind of push, in multiples of what suits the pushed body.
const PUSH: f64 = 1.0;
const STRONG: f64 = 4.0;
/// A kick changes the speed by this much, m/s; with Shift by `STRONG_KICK`.
const KICK: f64 = 5.0;
const STRONG_KICK: f64 = 12.0;
/// Time that a foot stays on a ball, s.
const KICK_TIME: f64 = 0.01;
/// A mouse spring's frequency, rad/s; it is critically damped.
const SPRING: f64 = 12.0;

/// What the player's hands do now.
#[derive(Clone, Debug)]
pub struct Controls {
    /// Body that the keys push; 0 is none.
    pub body: usize,
    /// Horizontal direction of the keys in the world, length 0 or 1.
    pub direction: Vec3,
    pub strong: bool,
    /// Turning about the vertical axis: −1, 0 or 1.
    pub turn: f64,
    pub grab: Option<Grab>,
    kick: Option<Kick>,
}

/// A point of a body, held by the mouse.
#[derive(Clone, Copy, Debug)]
pub struct Grab {
    pub body: usize,
    /// In the body's frame, m.
    pub point: Vec3,
    /// Where the mouse wants it, world, m.
    pub to: Vec3,
}

/// An impulse, given as a constant force over some steps.
#[derive(Clone, Copy, Debug)]
struct Kick {
    force: Vec3,
    steps: usize,
}

impl Controls {
    pub fn new(body: usize) -> Controls {
        Controls { body, direction: Vec3::zeros(), strong: false, turn: 0.0, grab: None, kick: None }
    }

    pub fn idle(&self) -> bool {
        self.direction == Vec3::zeros() && self.turn == 0.0 && self.grab.is_none() && self.kick.is_none()
    }

    /// Starts a kick along `heading` (unit): the impulse m Δv, spread over about 10 ms.
    ///
    ///     F = m Δv / (n h)   over n = max(1, round(10 ms / h)) steps
    pub fn kick(&mut self, session: &Session, heading: &Vec3) {
        let change = if self.strong { STRONG_KICK } else { KICK };
        let impulse = heading * (mass(session, self.body) * change);
        let steps = (KICK_TIME / session.method.timestep).round().max(1.0);
        self.kick = Some(Kick { force: impulse / (steps * session.method.timestep), steps: steps as usize });
    }

    /// The pushes of the next step: bodies and their forces and torques.
    pub fn wrenches(&mut self, session: &mut Session) -> [(usize, Vec6); 2] {
        let mut keys = Vec6::zeros();
        if self.body > 0 && self.body < session.model.bodies.len() {
            let weight = mass(session, self.body) * session.model.opt.gravity.norm().max(1.0);
            let strength = if self.strong { STRONG } else { PUSH };
            let mut force = self.direction * (0.5 * strength * weight);
            if let Some(kick) = &mut self.kick {
                force += kick.force;
                kick.steps -= 1;
                if kick.steps == 0 {
                    self.kick = None;
                }
            }
            let torque = Vec3::z() * (self.turn * strength * 0.1 * weight * reach(session, self.body));
            keys.fixed_rows_mut::<3>(0).copy_from(&force);
            keys.fixed_rows_mut::<3>(3).copy_from(&torque);
        }
        match &self.grab {
            Some(grab) if grab.body == self.body => [(self.body, keys + spring(session, grab)), (0, Vec6::zeros())],
            Some(grab) => [(self.body, keys), (grab.body, spring(session, grab))],
            None => [(self.body, keys), (0, Vec6::zeros())],
        }
    }
}

/// Critically damped spring between a body's point and the mouse, with the mass of the body.
///
///     F = m ω² (to − p) − 2 m ω v_p,   torque = (p − com) × F
fn spring(session: &mut Session, grab: &Grab) -> Vec6 {
    let (v, w) = energy_balance::velocity(&session.model, &session.state, &mut session.data, grab.body);
    let body = &session.model.bodies[grab.body];
    let (pos, mat) = (session.data.xpos[grab.body], session.data.xmat[grab.body]);
    let (point, com) = (pos + mat * grab.point, pos + mat * body.ipos);
    let m = mass(session, grab.body);
    let force = (grab.to - point) * (m * SPRING * SPRING) - (v + w.cross(&(point - com))) * (2.0 * m * SPRING);
    let torque = (point - com).cross(&force);
    Vec6::new(force.x, force.y, force.z, torque.x, torque.y, torque.z)
}

/// Mass of all that moves with a body on its own joints, kg.
fn mass(session: &Session, body: usize) -> f64 {
    let Some(b) = session.model.bodies.get(body) else { return 0.0 };
    let tree = b.tree.map(|t| session.model.trees[t].bodies.clone());
    tree.map_or(b.mass, |bodies| session.model.bodies[bodies].iter().map(|b| b.mass).sum())
}

/// Radius of a body's largest geom, m.
fn reach(session: &Session, body: usize) -> f64 {
    let geoms = session.model.bodies[body].geoms.clone();
    session.model.geoms[geoms].iter().map(|g| g.rbound).fold(0.0, f64::max)
}
