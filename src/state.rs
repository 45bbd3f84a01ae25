//! All that is needed to resume a simulation bit for bit.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::data::{Contact, Data, JointRow, JointRowKind, TieKind};
use crate::math::{Vec6, wxyz};
use crate::model::{Keyframe, Model};

/// Time, positions, velocities, controls, applied forces, and what the solvers start from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct State {
    /// s
    pub time: f64,
    /// (nq)
    pub qpos: Vec<f64>,
    /// (nv)
    pub qvel: Vec<f64>,
    /// (number of actuators)
    pub ctrl: Vec<f64>,
    /// Activations of actuators (na).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub act: Vec<f64>,
    /// Places of the mocap bodies, in the order of [`Parts::mocap`](crate::model::Parts), m.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub mocap_pos: Vec<[f64; 3]>,
    /// Their orientations, w x y z.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub mocap_quat: Vec<[f64; 4]>,
    /// Which equalities hold, in the order of [`Parts::equalities`](crate::model::Parts).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub eq_active: Vec<bool>,
    /// Force (N) and torque (N m) on each body at its centre of mass, world axes (nbody); or empty: none.
    #[serde(with = "wrenches")]
    pub xfrc_applied: Vec<Vec6>,
    /// Force along each dof, N or N m (nv); or empty: none. Of a free joint as in `qvel`: force at the body's origin in
    /// world axes, torque in the body's.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub qfrc_applied: Vec<f64>,
    /// Acceleration of the last step (nv): where the `mujoco` law's solver starts. Other laws leave it alone.
    pub qacc_warmstart: Vec<f64>,
    /// Forces of the constraints in the last step: where the `penalty` law starts.
    pub warm: Vec<Warm>,
}

/// The force of one contact, limit, dry friction or equality, remembered by what it is, not by its place in the list.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Warm {
    /// What it belongs to.
    pub key: Key,
    /// Normal, two tangential (N); torsional, two rolling (N m); in the contact's frame. Of a joint the first, N or N m.
    pub force: [f64; 6],
}

/// What a force is remembered by.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Key {
    /// Two geoms, and which corner, end or edge point of theirs touches.
    Contact([u32; 2], u32),
    /// Index of the dof, and which of its rows.
    Joint(usize, JointRowKind),
    /// Index of the equality or tendon, and which of its rows.
    Tie(usize, TieKind),
}

/// What a step leaves for the contact law of the next one; see [`State::remember`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// Every step begins anew.
    Nothing,
    /// `qacc_warmstart`
    Acceleration,
    /// `warm`
    Forces,
}

/// A list of a state does not have the length that the model asks for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WrongState {
    /// `qpos`, `qvel` …
    pub list: &'static str,
    /// Its length.
    pub has: usize,
    /// What it should be.
    pub wants: usize,
}

impl fmt::Display for WrongState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let WrongState { list, has, wants } = self;
        write!(f, "{list} has {has} numbers where the model has {wants}: it is not a state of this model")
    }
}

impl std::error::Error for WrongState {}

impl State {
    /// The scene at rest in `qpos0`.
    pub fn new(model: &Model) -> State {
        State {
            time: 0.0,
            qpos: model.qpos0.clone(),
            qvel: vec![0.0; model.nv],
            ctrl: vec![0.0; model.actuators.len()],
            act: vec![0.0; model.na],
            mocap_pos: model.mocap.iter().map(|&b| model.bodies[b].pos.into()).collect(),
            mocap_quat: model.mocap.iter().map(|&b| wxyz(&model.bodies[b].quat)).collect(),
            eq_active: model.equalities.iter().map(|e| e.active).collect(),
            xfrc_applied: Vec::new(),
            qfrc_applied: Vec::new(),
            qacc_warmstart: vec![0.0; model.nv],
            warm: Vec::new(),
        }
    }

    /// The state of a keyframe.
    pub fn at(model: &Model, key: &Keyframe) -> State {
        let Keyframe { time, qpos, qvel, ctrl, act, mocap_pos, mocap_quat, .. } = key.clone();
        State { time, qpos, qvel, ctrl, act, mocap_pos, mocap_quat, ..State::new(model) }
    }

    /// Whether its lists have the lengths that a model asks for.
    ///
    /// Errors: the first list that does not.
    #[inline]
    pub fn suits(&self, model: &Model) -> Result<(), WrongState> {
        let off = self.lengths(model).into_iter().fold(0, |off, (_, has, wants)| off | (has ^ wants));
        if off == 0 { Ok(()) } else { Err(self.misfit(model)) }
    }

    #[cold]
    fn misfit(&self, model: &Model) -> WrongState {
        let (list, has, wants) =
            self.lengths(model).into_iter().find(|(_, has, wants)| has != wants).unwrap_or_default();
        WrongState { list, has, wants }
    }

    /// Its lists, their lengths, and what the model asks for.
    #[inline(always)]
    fn lengths(&self, model: &Model) -> [(&'static str, usize, usize); 10] {
        let pushes = if self.xfrc_applied.is_empty() { 0 } else { model.bodies.len() };
        let forces = if self.qfrc_applied.is_empty() { 0 } else { model.nv };
        [
            ("qpos", self.qpos.len(), model.nq),
            ("qvel", self.qvel.len(), model.nv),
            ("ctrl", self.ctrl.len(), model.actuators.len()),
            ("act", self.act.len(), model.na),
            ("mocap_pos", self.mocap_pos.len(), model.mocap.len()),
            ("mocap_quat", self.mocap_quat.len(), model.mocap.len()),
            ("eq_active", self.eq_active.len(), model.equalities.len()),
            ("qacc_warmstart", self.qacc_warmstart.len(), model.nv),
            ("xfrc_applied", self.xfrc_applied.len(), pushes),
            ("qfrc_applied", self.qfrc_applied.len(), forces),
        ]
    }

    /// Becomes a copy of `other` without allocating anew.
    pub fn copy_from(&mut self, other: &State) {
        let State {
            time,
            qpos,
            qvel,
            ctrl,
            act,
            mocap_pos,
            mocap_quat,
            eq_active,
            xfrc_applied,
            qfrc_applied,
            qacc_warmstart,
            warm,
        } = self;
        *time = other.time;
        qpos.clone_from(&other.qpos);
        qvel.clone_from(&other.qvel);
        ctrl.clone_from(&other.ctrl);
        act.clone_from(&other.act);
        mocap_pos.clone_from(&other.mocap_pos);
        mocap_quat.clone_from(&other.mocap_quat);
        eq_active.clone_from(&other.eq_active);
        xfrc_applied.clone_from(&other.xfrc_applied);
        qfrc_applied.clone_from(&other.qfrc_applied);
        qacc_warmstart.clone_from(&other.qacc_warmstart);
        warm.clone_from(&other.warm);
    }

    /// Keeps what the next step's contact law starts from, and nothing else.
    ///
    /// Reads: qacc, or the forces of contacts, joint rows and ties.
    pub fn remember(&mut self, start: Start, data: &Data) {
        self.warm.clear();
        match start {
            Start::Nothing => {}
            Start::Acceleration => self.qacc_warmstart.copy_from_slice(&data.qacc),
            Start::Forces => {
                self.warm.reserve(data.contacts.capacity() + data.joint_rows.capacity() + data.ties.capacity());
                self.warm.extend(data.contacts.iter().map(|c| Warm { key: contact_key(c), force: c.force }));
                let joint = |row: &JointRow| Warm { key: joint_key(row), force: [row.force, 0.0, 0.0, 0.0, 0.0, 0.0] };
                self.warm.extend(data.joint_rows.iter().map(joint));
                self.warm
                    .extend(data.ties.iter().map(|tie| Warm { key: Key::Tie(tie.index, tie.kind), force: tie.force }));
            }
        }
    }

    /// Gives contacts that push, joint rows and ties the forces that the last step remembered for them; new ones start from
    /// nothing.
    pub fn recall(&self, model: &Model, data: &mut Data) {
        let mut memory = Memory { warm: &self.warm, next: 0 };
        for contact in &mut data.contacts {
            let remembered = memory.force(contact_key(contact));
            // What no longer pushes has no force, and no law is asked about it.
            contact.force = if contact.pushes(model) { remembered } else { [0.0; 6] };
        }
        for row in &mut data.joint_rows {
            [row.force, ..] = memory.force(joint_key(row));
        }
        for tie in &mut data.ties {
            tie.force = memory.force(Key::Tie(tie.index, tie.kind));
        }
    }
}

/// Remembered forces, and where the next one that is asked for probably is: all lists have MuJoCo's order, so one walk along
/// them finds all.
///
/// Only points of one pair can change places, when another is the deeper; the later one then starts from nothing, which costs
/// work and changes no result. To search the whole list for it was measured: a step of the tutorial's disk, on two points that are
/// equally deep but for rounding, takes 2.1 µs instead of 0.6, because a force that differs by rounding is then kept on either.
struct Memory<'a> {
    warm: &'a [Warm],
    next: usize,
}

impl Memory<'_> {
    #[inline(always)]
    fn force(&mut self, key: Key) -> [f64; 6] {
        if self.warm.get(self.next).is_none_or(|warm| warm.key != key) && !self.find(key) {
            return [0.0; 6];
        }
        self.next += 1;
        self.warm[self.next - 1].force
    }

    /// Looks for a key further on; `next` stays where it was if there is none.
    #[cold]
    fn find(&mut self, key: Key) -> bool {
        let found = self.warm.iter().skip(self.next).position(|warm| warm.key == key);
        self.next += found.unwrap_or(0);
        found.is_some()
    }
}

fn contact_key(contact: &Contact) -> Key {
    Key::Contact(contact.geom, contact.feature)
}

fn joint_key(row: &JointRow) -> Key {
    Key::Joint(row.dof, row.kind)
}

/// Six-vectors as lists of six numbers.
mod wrenches {
    use serde::{Deserialize, Deserializer, Serializer};

    use crate::math::Vec6;

    pub fn serialize<S: Serializer>(wrenches: &[Vec6], serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(wrenches.iter().map(|w| <[f64; 6]>::from(*w)))
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Vec6>, D::Error> {
        Ok(Vec::<[f64; 6]>::deserialize(deserializer)?.into_iter().map(Vec6::from).collect())
    }
}
