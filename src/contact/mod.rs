//! Contact laws: depth and rate in, force out. The list [`ALL`] is the only place that knows their names.

pub mod impedance;

use crate::data::Data;
use crate::forward::Method;
use crate::model::Model;
use crate::state::State;

/// A contact law.
pub struct Law {
    /// CLI name.
    pub name: &'static str,
    /// One line for `--help`, plots and docs.
    pub about: &'static str,
    /// Reads `data.contacts`, `data.movers`, `data.qacc_smooth`; writes `data.qacc`, `data.qfrc_constraint` and
    /// the forces in `data.contacts`.
    pub solve: fn(&Model, &Method, &State, &mut Data),
}

pub const ALL: &[&Law] = &[];

/// The law of that name.
pub fn by_name(name: &str) -> Option<&'static Law> {
    ALL.iter().copied().find(|law| law.name == name)
}
