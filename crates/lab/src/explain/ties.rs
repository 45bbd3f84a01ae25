//! Tendons and equalities as springs and dampers: k, c, ω, ζ, with the mass that MuJoCo takes for what they move.
//!
//!     m = 1 / (J M⁻¹ Jᵀ)      of tendons at `qpos0`; of equalities the sum of the inverse masses of what they hold

use super::joints::{limits_act, pressed_hard};
use crate::names;
use penny::contact::constants::Spring;
use penny::contact::mujoco;
use penny::data::{Data, TieKind};
use penny::forward::{self, Method};
use penny::model::{Equality, EqualityKind, Model};
use penny::state::State;

/// A spring and damper of a tie.
#[derive(Clone, Debug)]
pub struct Tie {
    /// "spring of tendon x", "limit of tendon x", "weld x".
    pub name: String,
    /// Of what turns: kg m², N m/rad, N m s/rad; else kg, N/m, N s/m.
    pub turns: bool,
    pub spring: Spring,
}

/// The springs, dampers and limits of tendons, and the equalities that hold in a state; of a weld what holds its positions.
pub fn ties(model: &Model, method: &Method, state: &State) -> Vec<Tie> {
    let tendons = (0..model.tendons.len()).flat_map(|i| tendon(model, i, method.timestep));
    let mut found: Vec<Tie> = tendons.flatten().collect();
    let mut data = Data::new(model);
    forward::forward(model, &Method { contact: &mujoco::LAW, ..*method }, state, &mut data);
    for tie in data.ties.iter().filter(|tie| tie.kind == TieKind::Equality && tie.inverse[0] > 0.0) {
        let equality = &model.equalities[tie.index];
        let turns = match &equality.kind {
            EqualityKind::Joint { joints: (joint, _), .. } => model.joints[*joint].kind.name() == "hinge",
            _ => false,
        };
        let spring = pressed_hard(model, equality.solref, equality.solimp, 1.0 / tie.inverse[0], method.timestep);
        found.push(Tie { name: name(equality, tie.index), turns, spring });
    }
    found
}

/// The spring and damper of a tendon, and its limit at a timestep (s).
pub fn tendon(model: &Model, index: usize, timestep: f64) -> [Option<Tie>; 2] {
    let tendon = &model.tendons[index];
    if tendon.invweight0 <= 0.0 {
        return [None, None];
    }
    let (mass, flags) = (1.0 / tendon.invweight0, &model.opt.flags);
    let k = if flags.spring { tendon.stiffness[0] } else { 0.0 };
    let c = if flags.damper { tendon.damping[0] } else { 0.0 };
    let tie = |what: &str, spring: Spring| {
        let name = format!("{what} of tendon {}", names::tendon(model, index));
        Tie { name, turns: false, spring }
    };
    let limit = || pressed_hard(model, tendon.solref_limit, tendon.solimp_limit, mass, timestep);
    [
        (k != 0.0 || c != 0.0).then(|| tie("spring", Spring { mass, k, c })),
        (tendon.range.is_some() && limits_act(model)).then(|| tie("limit", limit())),
    ]
}

fn name(equality: &Equality, index: usize) -> String {
    let kind = match equality.kind {
        EqualityKind::Joint { .. } => "joint equality",
        EqualityKind::Tendon { .. } => "tendon equality",
        EqualityKind::Connect(_) => "connect",
        EqualityKind::Weld { .. } => "weld",
    };
    if equality.name.is_empty() { format!("{kind} {index}") } else { format!("{kind} {}", equality.name) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use penny::integrate;

    /// A mass m on a tendon of coefficient 2: it moves as m/4. Two masses that a joint equality holds: as m₁ m₂/(m₁ + m₂).
    #[test]
    fn tendons_and_equalities_are_springs_of_their_masses() {
        let text = r#"<mujoco><worldbody><body><joint name="x" type="slide"/><geom size=".1" mass="2"/></body>
            <body><joint name="y" type="slide"/><geom size=".1" mass="6"/></body></worldbody>
            <tendon><fixed name="t" stiffness="50" damping="3" range="-1 1" solreflimit="-800 -30" solimplimit="0.9 0.9 0.1">
              <joint joint="x" coef="2"/></fixed></tendon>
            <equality><joint name="e" joint1="x" joint2="y" solref="-1000 -20" solimp="0.8 0.8 0.1"/></equality></mujoco>"#;
        let model = penny::parse("ties.xml", text).unwrap_or_else(|e| panic!("{e}")).model;
        let integrator = integrate::ALL[0];
        let method = Method { contact: &mujoco::LAW, integrator, timestep: 0.002, rounds: 1 };
        let ties = ties(&model, &method, &State::new(&model));
        let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-12;
        let check = |i: usize, name: &str, [mass, k, c]: [f64; 3]| {
            let Tie { name: own, spring: s, .. } = &ties[i];
            assert!(own == name && near(s.mass, mass) && near(s.k, k) && near(s.c, c), "{own} {s:?}");
        };
        check(0, "spring of tendon t", [0.5, 50.0, 3.0]);
        // The direct form: K = 800/d², B = 30/d; k = m d² K, c = m d B.
        check(1, "limit of tendon t", [0.5, 0.5 * 800.0, 0.5 * 30.0]);
        check(2, "joint equality e", [1.5, 1.5 * 1000.0, 1.5 * 20.0]);
    }
}
