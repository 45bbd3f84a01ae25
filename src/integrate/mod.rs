//! Integrators. The list [`ALL`] is the only place that knows their names.

use crate::data::Data;
use crate::forward::Method;
use crate::model::Model;
use crate::state::State;

pub struct Integrator {
    /// CLI name.
    pub name: &'static str,
    /// MJCF keywords that select it.
    pub mjcf: &'static [&'static str],
    /// Global order on smooth systems; a test measures it.
    pub order: u8,
    /// One line for `--help`, plots and docs.
    pub about: &'static str,
    /// One step of `method.timestep`: advances time, qpos, qvel and the warm starts.
    pub advance: fn(&Model, &Method, &mut State, &mut Data),
}

pub const ALL: &[&Integrator] = &[];

/// The integrator of that CLI name or MJCF keyword.
pub fn by_name(name: &str) -> Option<&'static Integrator> {
    ALL.iter().copied().find(|i| i.name == name || i.mjcf.contains(&name))
}
