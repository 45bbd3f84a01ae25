//! The constraint rows as MuJoCo lists them (`efc_J`, `efc_R`, `efc_aref`, `efc_force`): equalities, dry friction, limits,
//! of joints before those of tendons, contacts; a pyramid's edges one by one. To look at and to compare, not on the way of a step.

use crate::contact::cost::Kind;
use crate::contact::island::{Island, Source};
use crate::contact::newton::{self, Stop};
use crate::contact::{Settings, Task, assemble_all};
use crate::data::{Data, JointRowKind, Scratchpad, TieKind};
use crate::model::Model;
use crate::state::State;

/// One scalar row.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Jacobian (nv): J qvel is the row's velocity.
    pub jac: Vec<f64>,
    /// Regularisation R, 1/kg (1/(kg m²) for an angle).
    pub r: f64,
    /// Reference acceleration, m/s² (rad/s²).
    pub aref: f64,
    /// N (N m)
    pub force: f64,
}

/// All rows at the state that `data` was computed for by [`forward`](crate::forward::forward) with this law.
pub fn list(model: &Model, settings: &Settings, state: &State, data: &Data) -> Vec<Row> {
    let task = Task { model, settings, state, data };
    let mut island = Island::default();
    assemble_all(&task, &mut island);
    super::pose(&task, &mut Scratchpad::default(), &mut island);
    island.guess(model, data, &data.qacc);
    // The forces of stiff edges cannot be had from qacc alone, they would drown in its last digits: from there on, Newton.
    newton::minimise(&task, &mut island, &Stop { warm: true, ..super::stop(model) });
    let mut order: Vec<usize> = (0..island.sources.len()).collect();
    order.sort_by_key(|&i| place(data, island.sources[i]));
    let mut list = Vec::new();
    for i in order {
        let c = &island.constraints[i];
        let jac: Vec<Vec<f64>> = (0..c.cone.dim).map(|k| island.row_of_dofs(model, data, i, k)).collect();
        // e₀ times the first component plus e₁ times the j-th.
        let edge = |j: usize, slope: f64, x: f64| Row {
            jac: jac[0].iter().zip(&jac[j]).map(|(n, t)| n + slope * t).collect(),
            r: 1.0 / c.cone.d[0],
            aref: -(c.bias[0] + slope * c.bias[j]),
            force: -c.cone.d[0] * x.min(0.0),
        };
        match c.cone.kind {
            Kind::Pyramid => {
                for j in 1..c.cone.dim {
                    list.extend([edge(j, c.cone.mu[j], c.x[2 * j - 2]), edge(j, -c.cone.mu[j], c.x[2 * j - 1])]);
                }
            }
            _ => list.extend((0..c.cone.dim).map(|k| Row {
                jac: jac[k].clone(),
                r: 1.0 / c.cone.d[k],
                aref: -c.bias[k],
                force: c.force[k],
            })),
        }
    }
    list
}

/// Where in MuJoCo's list the rows of a constraint are.
fn place(data: &Data, source: Source) -> u8 {
    match source {
        Source::Tie(i) => match data.ties[i].kind {
            TieKind::Equality => 0,
            TieKind::DryFriction => 2,
            TieKind::LowerLimit | TieKind::UpperLimit => 4,
        },
        Source::Joint(i) if data.joint_rows[i].kind == JointRowKind::DryFriction => 1,
        Source::Joint(_) => 3,
        Source::Contact(_) => 5,
    }
}
