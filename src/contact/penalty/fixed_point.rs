//! The safe way to the forces: convex problems with given limits of friction, and limits that follow the normal forces.

use super::super::Task;
use super::super::cost::Kind;
use super::super::island::Island;
use super::super::newton::{self, Constraint};
use super::residual::residual;
use super::{TOLERANCE, semismooth};
use crate::data::Outcome;

/// Solves from the forces that the constraints have, with at most `rounds` linear systems. Out: the forces, and in `p` what
/// they do.
///
/// In: `tries`, how many steps of [`semismooth`] are tried each time the pieces have settled; 0: the limits alone follow.
pub fn solve(task: &Task, island: &mut Island, rounds: usize, tries: usize) -> Outcome {
    let mut outcome = Outcome { iterations: 0, residual: residual(island) };
    island.w.copy_from_slice(&island.p);
    limit(&mut island.constraints, false);
    newton::begin(island);
    let mut follows = false;
    while outcome.iterations < rounds {
        outcome.iterations += 1;
        let Some(settled) = newton::iterate(task, island) else { break };
        if settled {
            outcome.residual = residual(island);
            if outcome.residual <= TOLERANCE {
                return outcome;
            }
            // The pieces may be right now.
            let next = semismooth::solve(task, island, outcome.residual, tries.min(rounds - outcome.iterations));
            outcome = Outcome { iterations: outcome.iterations + next.iterations, ..next };
            if outcome.residual <= TOLERANCE {
                return outcome;
            }
            // Back to the forces of the convex problem: the limits follow them.
            newton::refresh(island);
            limit(&mut island.constraints, follows);
            newton::refresh(island);
        }
        follows = settled;
    }
    outcome.residual = residual(island);
    outcome
}

/// Lets the limits of friction L follow the normal forces n: L ← n, a fixed-point iteration.
///
/// Where one such change `follows` another, on the same pieces of the cost, a secant through both finds where it leads
/// (Anderson acceleration of depth one):
///
///     r = n − L,   β = r·Δr/|Δr|²,   L ← n − β Δn          Δ: change since the last time;  −10 ≤ β ≤ 1
///
/// Source: H. Walker, P. Ni, Anderson acceleration for fixed-point iterations, SIAM J. Numer. Anal. 49 (2011).
fn limit(constraints: &mut [Constraint], follows: bool) {
    let (mut along, mut square) = (0.0, 0.0);
    let limited = |c: &&Constraint| c.cone.kind != Kind::TwoSided;
    for c in constraints.iter().filter(limited) {
        let residual = c.force[0] - c.cone.limit;
        let change = residual - c.last[1];
        along += residual * change;
        square += change * change;
    }
    let beta = if follows && square > 0.0 { (along / square).clamp(-10.0, 1.0) } else { 0.0 };
    for c in constraints {
        let (n, residual) = (c.force[0], c.force[0] - c.cone.limit);
        c.cone.limit = (n - beta * (n - c.last[0])).max(0.0);
        c.last = [n, residual];
    }
}
