//! Contact laws: depth and rate in, force out. The list [`ALL`] is the only place that knows their names.

pub mod complementarity;
pub mod constants;
pub mod describe;
pub mod forest;
pub mod impedance;
pub mod mujoco;
pub mod penalty;
pub mod pointwise;
pub mod rows;
pub mod tutorial;

use self::describe::{Ask, Description, Unlike};
use crate::data::{Contact, Data};
use crate::forward::Method;
use crate::math::Vec3;
use crate::model::{Mix, Model};
use crate::state::{Start, State};

/// A contact law.
pub struct Law {
    /// CLI name.
    pub name: &'static str,
    /// One line for `--help`, plots and docs.
    pub about: &'static str,
    /// Whether it also enforces joint limits and dry friction of joints.
    pub joints: bool,
    /// What of the last step it starts from.
    pub start: Start,
    /// Reads `data.contacts`, `data.movers`, `data.qacc_smooth`; writes `data.qacc`, `data.qfrc_constraint` and
    /// the forces in `data.contacts`.
    pub solve: fn(&Model, &Method, &State, &mut Data),
    /// Coefficients of friction that it uses for a mix: two sliding (1), spinning (m), two rolling (m).
    pub friction: fn(&Model, &Mix) -> [f64; 5],
    /// What it makes of a contact, as far as it has formulas; [`describe::nothing`] if it has none.
    pub describe: fn(&Ask) -> Description,
    /// How its forces differ from MuJoCo's; `None` gives no reason.
    pub unlike: Option<Unlike>,
}

/// The default comes first.
pub const ALL: &[&Law] = &[&penalty::LAW, &mujoco::LAW, &tutorial::LAW];

/// The law of scenes that name none.
pub fn default() -> &'static Law {
    ALL[0]
}

/// The law of that name.
pub fn by_name(name: &str) -> Option<&'static Law> {
    ALL.iter().copied().find(|law| law.name == name)
}

/// Where friction acts on each side's body: at a moving body's own surface if the other one never moves, midway
/// between two moving bodies, so that action equals reaction. World, m.
///
/// A sphere that has sunk in by 0.4 mm thus rolls on its full radius.
pub fn surface_points(contact: &Contact, model: &Model) -> [Vec3; 2] {
    let moves = contact.body.map(|b| model.bodies[b as usize].tree.is_some());
    if moves[0] && moves[1] {
        return [contact.pos; 2];
    }
    let half = contact.frame.row(0).transpose() * (0.5 * contact.dist);
    [contact.pos - half, contact.pos + half]
}
