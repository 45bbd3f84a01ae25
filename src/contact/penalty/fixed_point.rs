//! The safe way to the forces: convex problems with given limits of friction, and limits that follow the normal forces.

use super::super::Task;
use super::super::cost::Kind;
use super::super::island::Island;
use super::super::newton::{self, Constraint};
use super::residual::residual;
use super::{TOLERANCE, semismooth};
use crate::data::Outcome;

/// Solves from the forces that the constraints have, with at most `rounds` linear systems. Out: the forces, and in `p` what
/// they do. Where the rounds were too few, these are the forces of the last convex problem that was solved, with friction that
/// was softer or had limits that follow too late: bodies creep, but friction brakes, whereas the forces that stiff friction has
/// at a guess may be anything.
///
/// In: `tries`, how many steps of [`semismooth`] are tried each time the pieces have settled; 0: the limits alone follow.
/// `softly`: friction is softer first.
pub fn solve(task: &Task, island: &mut Island, rounds: usize, tries: usize, softly: bool) -> Outcome {
    let mut outcome = Outcome { iterations: 0, residual: residual(island) };
    island.w.copy_from_slice(&island.p);
    limit(&mut island.constraints, false);
    newton::begin(island);
    let softened = if softly { soften(task, island, rounds) } else { (0, false) };
    outcome.iterations += softened.0;
    let (mut solved, mut follows) = (softened.1, false);
    while outcome.iterations < rounds {
        outcome.iterations += 1;
        let Some(settled) = newton::iterate(task, island) else { break };
        if settled {
            island.constraints.iter_mut().for_each(|c| c.start = c.force);
            solved = true;
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
    if solved {
        island.constraints.iter_mut().for_each(|c| c.force = c.start);
    }
    outcome.residual = residual(island);
    if !solved {
        // A guess, but each lies deeper than the one before.
        let Island { w, p, .. } = island;
        p.copy_from_slice(w);
    }
    outcome
}

/// Goes near the solution with friction that is softer by [`SOFTEST`], and then less and less: the kinks of stiff friction,
/// where Newton's method stops each step, are in the right places then. Out: the linear systems that it took, and whether one
/// of the problems was solved: `start` has its forces.
fn soften(task: &Task, island: &mut Island, rounds: usize) -> (usize, bool) {
    let scale = |island: &mut Island, factor: f64| {
        for c in &mut island.constraints {
            let first = usize::from(c.cone.kind == Kind::Coulomb);
            if matches!(c.cone.kind, Kind::Coulomb | Kind::Dry) {
                (first..c.cone.dim).for_each(|k| c.cone.d[k] *= factor);
            }
        }
        newton::refresh(island);
    };
    let (mut iterations, mut solved) = (0, false);
    scale(island, 10f64.powi(-SOFTEST));
    for _ in 0..SOFTEST {
        while iterations < rounds {
            iterations += 1;
            match newton::iterate(task, island) {
                Some(false) => continue,
                Some(true) => {
                    island.constraints.iter_mut().for_each(|c| c.start = c.force);
                    solved = true;
                    limit(&mut island.constraints, false);
                }
                None => {}
            }
            break;
        }
        scale(island, 10.0);
    }
    (iterations, solved)
}

/// Powers of ten by which friction is softer at first: about as stiff as normals are. A bin of 300 balls, whose convex problem
/// Newton's method does not solve in 130 steps from the last forces, takes seven to thirty for each power.
const SOFTEST: i32 = 4;

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
