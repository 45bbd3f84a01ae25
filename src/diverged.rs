//! A run that left the numbers in which a simulation can mean anything: what is found of it, and where.

use std::fmt;

use crate::data::{Contact, Data};
use crate::model::Model;
use crate::state::State;

/// A position, velocity or acceleration, or the pose of a mocap body, that is not finite, or beyond 1e10 (MuJoCo's bound).
#[derive(Clone, Debug, PartialEq)]
pub struct Diverged {
    /// s
    pub time: f64,
    /// Index of the body.
    pub body: usize,
    /// `qpos`, `qvel`, `qacc`, `mocap_pos` or `mocap_quat`.
    pub quantity: &'static str,
    /// Index of the number in that quantity.
    pub index: usize,
    /// SI, as the quantity has it: m or rad, and per s or s².
    pub value: f64,
    /// The deepest contact of that body at the time: index into `data.contacts`.
    pub contact: Option<usize>,
}

/// Without the model: names of body and contact are the command line's to add.
impl fmt::Display for Diverged {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Diverged { time, quantity, index, value, body, .. } = self;
        write!(f, "the run diverged at {time:.6} s: {quantity}[{index}] of body {body} is {value:.3e}")
    }
}

impl std::error::Error for Diverged {}

/// MuJoCo's bound on positions, velocities and accelerations.
const HUGE: f64 = 1e10;

/// A sum of squares is quick to find, and is neither infinite nor NaN if no number is. Only if it is large, look closer.
pub(crate) fn sane(numbers: &[f64]) -> bool {
    // Four sums: an addition need not wait for the one before.
    let (fours, rest) = numbers.as_chunks::<4>();
    let mut sum = [0.0; 4];
    for four in fours {
        (0..4).for_each(|k| sum[k] += four[k] * four[k]);
    }
    let square = sum.iter().sum::<f64>() + rest.iter().map(|x| x * x).sum::<f64>();
    square <= HUGE * HUGE || numbers.iter().all(|x| x.abs() <= HUGE)
}

/// Says which number left the bounds, and whose it is.
#[cold]
pub(crate) fn diverged(model: &Model, state: &State, data: &Data) -> Diverged {
    let quantities = [
        ("qpos", &state.qpos[..]),
        ("qvel", &state.qvel),
        ("qacc", &data.qacc),
        ("mocap_pos", state.mocap_pos.as_flattened()),
        ("mocap_quat", state.mocap_quat.as_flattened()),
    ];
    let (quantity, index, value) = quantities
        .into_iter()
        .find_map(|(name, x)| Some(name).zip(x.iter().position(|x| !sane(&[*x]))).map(|(n, i)| (n, i, x[i])))
        .unwrap_or(("qpos", 0, f64::NAN));
    let body = match quantity {
        "qpos" => model.joints.iter().rev().find(|j| j.qposadr <= index).map_or(0, |j| j.body),
        "mocap_pos" => model.mocap[index / 3],
        "mocap_quat" => model.mocap[index / 4],
        _ => model.dofs[index].body,
    };
    let of_body = |c: &Contact| c.body.contains(&(body as u32));
    let deepest = |a: &usize, b: &usize| data.contacts[*a].dist.total_cmp(&data.contacts[*b].dist);
    let contact = (0..data.contacts.len()).filter(|&c| of_body(&data.contacts[c])).min_by(deepest);
    Diverged { time: state.time, body, quantity, index, value, contact }
}
