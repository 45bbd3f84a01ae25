//! Where the energy went: work put in by pushes, lost to sliding, spinning and rolling, and to impacts.

use penny::data::Data;
use penny::dynamics::{self, energy, spatial};
use penny::math::{Mat3, Vec3, Vec6};
use penny::model::Model;
use penny::state::State;

/// Sums since the start, from step to step.
///
/// A step holds its forces constant while velocities go from v₀ to v₁, so with semi-implicit Euler a force F does
/// exactly the work h F·(v₀ + v₁)/2. Other integrators evaluate forces several times a step; there the split is
/// right to first order in h, the total is exact.
#[derive(Clone, Debug, Default)]
pub struct EnergyBalance {
    /// Energy at the start and now, J.
    pub start: energy::Energy,
    pub now: energy::Energy,
    /// Work of pushes, J, and their impulse, N s.
    pub work: f64,
    pub impulse: Vec3,
    /// Lost to friction that opposes slip, J.
    pub sliding: f64,
    /// Lost to torsional and to rolling friction, J.
    pub spinning: f64,
    pub rolling: f64,
}

/// Velocity of each body's centre of mass (m/s) and its angular velocity (rad/s), world axes.
pub type Twists = Vec<Vec6>;

impl EnergyBalance {
    pub fn new(model: &Model, state: &State, data: &mut Data) -> EnergyBalance {
        let start = energy::energy(model, state, data);
        EnergyBalance { start, now: start, ..EnergyBalance::default() }
    }

    /// Energy that is gone: what was there and was put in, less what is there. J.
    pub fn lost(&self) -> f64 {
        self.start.kinetic + self.start.potential + self.work - self.now.kinetic - self.now.potential
    }

    /// What is lost and not to friction: impacts, joint damping, and the integrator's own error. J.
    pub fn other(&self) -> f64 {
        self.lost() - self.sliding - self.spinning - self.rolling
    }

    /// The player has changed what energy is worth (gravity): that is neither work nor loss. Brings `data` to the state.
    pub fn revalue(&mut self, model: &Model, state: &State, data: &mut Data) {
        let now = energy::energy(model, state, data);
        self.start.kinetic += now.kinetic - self.now.kinetic;
        self.start.potential += now.potential - self.now.potential;
        self.now = now;
    }

    /// Books the step that ended in `state`; `before` are the twists at its beginning, `data` is as it left it.
    pub fn book(&mut self, model: &Model, h: f64, before: &Twists, state: &State, data: &mut Data) {
        let contacts = std::mem::take(&mut data.contacts);
        let coms: Vec<Vec3> = (0..model.bodies.len()).map(|b| com(model, data, b)).collect();
        self.now = energy::energy(model, state, data);
        let after = twists(model, data);
        let mean: Twists = before.iter().zip(&after).map(|(a, b)| 0.5 * (a + b)).collect();
        for (body, wrench) in state.xfrc_applied.iter().enumerate() {
            self.work += h * wrench.dot(&mean[body]);
            self.impulse += h * spatial::lin(wrench);
        }
        for contact in &contacts {
            let velocity = |side: usize| {
                let b = contact.body[side] as usize;
                let (v, w) = (spatial::lin(&mean[b]), spatial::ang(&mean[b]));
                (v + w.cross(&(contact.pos - coms[b])), w)
            };
            let ((v0, w0), (v1, w1)) = (velocity(0), velocity(1));
            let (slip, turn) = (contact.frame * (v1 - v0), contact.frame * (w1 - w0));
            let f = &contact.force;
            self.sliding -= h * (f[1] * slip.y + f[2] * slip.z);
            self.spinning -= h * f[3] * turn.x;
            self.rolling -= h * (f[4] * turn.y + f[5] * turn.z);
        }
        data.contacts = contacts;
    }
}

/// Centre of mass of a body, as the kinematics in `data` have it.
pub fn com(model: &Model, data: &Data, body: usize) -> Vec3 {
    data.xpos[body] + data.xmat[body] * model.bodies[body].ipos
}

/// How all bodies move, as the last [`energy::energy`] has found it.
pub fn twists(model: &Model, data: &Data) -> Twists {
    (0..model.bodies.len()).map(|body| dynamics::twist(model, data, body)).collect()
}

/// Linear and angular velocity of a body at its centre of mass in a state. Brings `data` to it.
pub fn velocity(model: &Model, state: &State, data: &mut Data, body: usize) -> (Vec3, Vec3) {
    energy::energy(model, state, data);
    let twist = twists(model, data)[body];
    (spatial::lin(&twist), spatial::ang(&twist))
}

/// The world's axes as a contact force in `frame` and its torque: force (N) on the second geom.
pub fn contact_force(frame: &Mat3, force: &[f64; 6]) -> (Vec3, Vec3) {
    let axis = |row: usize| frame.row(row).transpose();
    (axis(0) * force[0], axis(1) * force[1] + axis(2) * force[2])
}
