//! A [`State`] as bytes, and back: bit for bit, on every machine.
//!
//! | bytes | what |
//! |---|---|
//! | 8 | `penny\0\0` and the version of the format, 3 |
//! | 8 | time |
//! | 8 + 8 n | each of qpos, qvel, ctrl, act, qacc_warmstart, qfrc_applied: its length n, and its numbers |
//! | 8 + 8 n | each of mocap_pos, mocap_quat: how many numbers n, and the numbers |
//! | 8 + 8 n | eq_active: how many equalities n, and 1 or 0 for each |
//! | 8 + 48 n | xfrc_applied: the number of bodies n (or 0), six numbers each |
//! | 8 + 72 n | warm: the number of remembered forces n; what each belongs to (three whole numbers), six numbers |
//!
//! Numbers are IEEE 754 binary64, whole numbers have 64 bits; both little-endian.

use std::fmt;

use crate::data::{JointRowKind, TieKind};
use crate::math::Vec6;
use crate::state::{Key, State, Warm};

const MAGIC: [u8; 8] = *b"penny\0\0\x03";

/// The bytes are no saved state, or not all of one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Damaged {
    /// They do not begin as a state does.
    Foreign,
    /// They end too early, or go on after the end.
    Length,
    /// A number that says what comes next says something that there is not.
    Content,
}

impl fmt::Display for Damaged {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Damaged::Foreign => "this is not a state saved by Penny, or it is one of a later version",
            Damaged::Length => "the saved state is incomplete, or something follows it",
            Damaged::Content => "the saved state is damaged",
        })
    }
}

impl std::error::Error for Damaged {}

const TIES: [TieKind; 4] = [TieKind::Equality, TieKind::DryFriction, TieKind::LowerLimit, TieKind::UpperLimit];
/// What the key of a tie begins with.
const IS_TIE: u64 = u64::MAX - 1;
const KINDS: [JointRowKind; 3] = [JointRowKind::DryFriction, JointRowKind::LowerLimit, JointRowKind::UpperLimit];

impl State {
    /// All of it, to be kept or sent; see [`from_bytes`](State::from_bytes).
    pub fn to_bytes(&self) -> Vec<u8> {
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
        let mut bytes = MAGIC.to_vec();
        let mut whole = |n: u64, numbers: &[f64]| {
            bytes.extend(n.to_le_bytes());
            numbers.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
        };
        whole(time.to_bits(), &[]);
        for list in [qpos, qvel, ctrl, act, qacc_warmstart, qfrc_applied] {
            whole(list.len() as u64, list);
        }
        for list in [mocap_pos.as_flattened(), mocap_quat.as_flattened()] {
            whole(list.len() as u64, list);
        }
        whole(eq_active.len() as u64, &[]);
        eq_active.iter().for_each(|active| whole(u64::from(*active), &[]));
        whole(xfrc_applied.len() as u64, &[]);
        for wrench in xfrc_applied {
            wrench.iter().for_each(|x| whole(x.to_bits(), &[]));
        }
        whole(warm.len() as u64, &[]);
        for Warm { key, force } in warm {
            let key = match *key {
                Key::Contact([a, b], feature) => [u64::from(a), u64::from(b), u64::from(feature)],
                Key::Joint(dof, kind) => {
                    [u64::MAX, dof as u64, KINDS.iter().position(|k| *k == kind).unwrap_or_default() as u64]
                }
                Key::Tie(index, kind) => {
                    [IS_TIE, index as u64, TIES.iter().position(|k| *k == kind).unwrap_or_default() as u64]
                }
            };
            key.into_iter().chain(force.map(f64::to_bits)).for_each(|n| whole(n, &[]));
        }
        bytes
    }

    /// The state that [`to_bytes`](State::to_bytes) was asked for. Whether it belongs to a model [`State::suits`] tells.
    ///
    /// Errors: [`Damaged`].
    pub fn from_bytes(bytes: &[u8]) -> Result<State, Damaged> {
        let rest = bytes.strip_prefix(&MAGIC).ok_or(Damaged::Foreign)?;
        let (words, odd) = rest.as_chunks::<8>();
        if !odd.is_empty() {
            return Err(Damaged::Length);
        }
        let mut words = Words(words);
        let time = words.number()?;
        let [qpos, qvel, ctrl, act] = [words.list()?, words.list()?, words.list()?, words.list()?];
        let [qacc_warmstart, qfrc_applied] = [words.list()?, words.list()?];
        let [places, turns] = [words.list()?, words.list()?];
        let (mocap_pos, []) = places.as_chunks() else { return Err(Damaged::Content) };
        let (mocap_quat, []) = turns.as_chunks() else { return Err(Damaged::Content) };
        let eq_active = (0..words.count(1)?).map(|_| words.flag()).collect::<Result<Vec<_>, Damaged>>()?;
        let xfrc_applied =
            (0..words.count(6)?).map(|_| Ok(Vec6::from(words.numbers()?))).collect::<Result<Vec<_>, Damaged>>()?;
        let warm = (0..words.count(9)?)
            .map(|_| Ok(Warm { key: words.key()?, force: words.numbers()? }))
            .collect::<Result<Vec<_>, Damaged>>()?;
        if !words.0.is_empty() {
            return Err(Damaged::Length);
        }
        let (mocap_pos, mocap_quat) = (mocap_pos.to_vec(), mocap_quat.to_vec());
        Ok(State {
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
        })
    }
}

/// What is not read yet.
struct Words<'a>(&'a [[u8; 8]]);

impl Words<'_> {
    fn whole(&mut self) -> Result<u64, Damaged> {
        let (first, rest) = self.0.split_first().ok_or(Damaged::Length)?;
        self.0 = rest;
        Ok(u64::from_le_bytes(*first))
    }

    fn number(&mut self) -> Result<f64, Damaged> {
        self.whole().map(f64::from_bits)
    }

    fn flag(&mut self) -> Result<bool, Damaged> {
        match self.whole()? {
            0 => Ok(false),
            1 => Ok(true),
            _ => Err(Damaged::Content),
        }
    }

    fn numbers(&mut self) -> Result<[f64; 6], Damaged> {
        let mut all = [0.0; 6];
        for x in &mut all {
            *x = self.number()?;
        }
        Ok(all)
    }

    /// How many items of that many words follow: no more than there are bytes for.
    fn count(&mut self, words: usize) -> Result<usize, Damaged> {
        let n = usize::try_from(self.whole()?).map_err(|_| Damaged::Length)?;
        if n.checked_mul(words).is_some_and(|n| n <= self.0.len()) { Ok(n) } else { Err(Damaged::Length) }
    }

    fn list(&mut self) -> Result<Vec<f64>, Damaged> {
        (0..self.count(1)?).map(|_| self.number()).collect()
    }

    fn key(&mut self) -> Result<Key, Damaged> {
        let small = |n: u64| u32::try_from(n).map_err(|_| Damaged::Content);
        match [self.whole()?, self.whole()?, self.whole()?] {
            [u64::MAX, dof, kind] => {
                let dof = usize::try_from(dof).map_err(|_| Damaged::Content)?;
                let kind = KINDS.get(kind as usize).ok_or(Damaged::Content)?;
                Ok(Key::Joint(dof, *kind))
            }
            [IS_TIE, index, kind] => {
                let index = usize::try_from(index).map_err(|_| Damaged::Content)?;
                let kind = TIES.get(kind as usize).ok_or(Damaged::Content)?;
                Ok(Key::Tie(index, *kind))
            }
            [a, b, feature] => Ok(Key::Contact([small(a)?, small(b)?], small(feature)?)),
        }
    }
}
