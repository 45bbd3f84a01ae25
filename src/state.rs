//! All that is needed to resume a simulation bit for bit.

use crate::data::Data;
use crate::math::Vec6;
use crate::model::Model;

#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// s
    pub time: f64,
    /// (nq)
    pub qpos: Vec<f64>,
    /// (nv)
    pub qvel: Vec<f64>,
    /// (number of actuators)
    pub ctrl: Vec<f64>,
    /// Force (N) and torque (N m) on each body at its centre of mass, world axes (nbody); or empty: none.
    pub xfrc_applied: Vec<Vec6>,
    /// Acceleration of the last step (nv): where the `mujoco` law's solver starts. Other laws leave it alone.
    pub qacc_warmstart: Vec<f64>,
    /// Contact forces of the last step: where the `penalty` law starts.
    pub warm: Vec<Warm>,
}

/// The force of one contact, remembered by what touches, not by its place in the list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Warm {
    pub geom: [u32; 2],
    /// Which corner, end or edge point touches.
    pub feature: u32,
    /// Normal, two tangential (N); torsional, two rolling (N m); in the contact's frame.
    pub force: [f64; 6],
}

/// What a step leaves for the contact law of the next one; see [`State::remember`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    Nothing,
    Acceleration,
    Forces,
}

impl State {
    /// The scene at rest in `qpos0`.
    pub fn new(model: &Model) -> State {
        State {
            time: 0.0,
            qpos: model.qpos0.clone(),
            qvel: vec![0.0; model.nv],
            ctrl: vec![0.0; model.actuators.len()],
            xfrc_applied: Vec::new(),
            qacc_warmstart: vec![0.0; model.nv],
            warm: Vec::new(),
        }
    }

    /// Becomes a copy of `other` without allocating anew.
    pub fn copy_from(&mut self, other: &State) {
        let State { time, qpos, qvel, ctrl, xfrc_applied, qacc_warmstart, warm } = self;
        *time = other.time;
        qpos.clone_from(&other.qpos);
        qvel.clone_from(&other.qvel);
        ctrl.clone_from(&other.ctrl);
        xfrc_applied.clone_from(&other.xfrc_applied);
        qacc_warmstart.clone_from(&other.qacc_warmstart);
        warm.clone_from(&other.warm);
    }

    /// Keeps what the next step's contact law starts from, and nothing else.
    ///
    /// Reads: qacc, contacts.
    pub fn remember(&mut self, start: Start, data: &Data) {
        self.warm.clear();
        match start {
            Start::Nothing => {}
            Start::Acceleration => self.qacc_warmstart.copy_from_slice(&data.qacc),
            Start::Forces => {
                self.warm.reserve(data.contacts.capacity());
                self.warm.extend(data.contacts.iter().map(|c| Warm {
                    geom: c.geom,
                    feature: c.feature,
                    force: c.force,
                }));
            }
        }
    }
}
