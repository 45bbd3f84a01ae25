//! Newton's method on the law's own equations.
//!
//! The equations are smooth but for the kinks between their pieces: whether a contact pushes, whether it sticks or slips.
//! Within the pieces the method converges quadratically; started on the last step's forces it mostly needs no linear
//! system, or one. It has nothing that would make it converge from afar: then [`super::fixed_point`] takes over.
//!
//! Source: P. Alart, A. Curnier, A mixed formulation for frictional contact problems prone to Newton like solution methods,
//! Comput. Methods Appl. Mech. Engrg. 92 (1991), 353–375.

use super::super::block_factor::Shape;
use super::super::curvature::Curvature;
use super::super::island::Island;
use super::TOLERANCE;
use super::residual::{accelerate, linearise, misfit};
use crate::data::Outcome;

/// Takes at most `most` steps from the forces that the constraints have, as long as each leaves at most half of the least
/// residual so far. Out: the forces, and in `p` what they do.
///
/// In: `least` what the first step has to halve; infinite where forces of another step, with other contacts, begin.
pub fn solve(island: &mut Island, mut least: f64, most: usize) -> Outcome {
    let mut outcome = Outcome { iterations: 0, residual: least };
    while outcome.iterations < most {
        outcome.iterations += 1;
        step(island);
        outcome.residual = misfit(island);
        if outcome.residual <= TOLERANCE || outcome.residual > 0.5 * least || outcome.residual == f64::INFINITY {
            break;
        }
        least = outcome.residual;
    }
    outcome
}

/// One linear system: w' = w + δw = Wᵀ (f + δf), δf = e − C W δw. Reads w in `p`, and leaves it there;
/// needs `gradient`.
fn step(island: &mut Island) {
    island.curvatures.clear();
    let mut shape = Shape::Symmetric;
    for c in &mut island.constraints {
        let curvature;
        (curvature, c.change) = linearise(c);
        if let Curvature::Full(full) = &curvature
            && (1..c.cone.dim).any(|k| full[k][0] != 0.0)
        {
            shape = Shape::General;
        }
        island.curvatures.push(curvature);
    }
    island.gradient.copy_from_slice(&island.p);
    island.add_to_p(|c| &c.change);
    island.factor(shape);
    island.divide_p();
    island.constraints.iter_mut().for_each(|c| (0..c.cone.dim).for_each(|k| c.force[k] += c.change[k]));
    for _ in 0..REFINEMENTS {
        let Island { gradient: w, p, .. } = island;
        w.iter_mut().zip(p).for_each(|(w, p)| *w += *p);
        island.multiply_p(|c, curvature, product| {
            let less = curvature.times(&product, c.cone.dim);
            (0..c.cone.dim).for_each(|k| c.force[k] -= less[k]);
        });
        accelerate(island);
        // What stiff rows have left of w' = Wᵀ f'.
        let Island { gradient: w, p, .. } = island;
        let (mut off, mut size) = (0.0f64, 0.0f64);
        for (w, p) in w.iter().zip(&*p) {
            (off, size) = (off.max((p - w).abs()), size.max(p.abs()));
        }
        if off.is_nan() || off <= ROUNDING * size {
            return;
        }
        p.iter_mut().zip(w).for_each(|(p, w)| *p -= *w);
        island.divide_p();
    }
    accelerate(island);
}

/// Solutions of one linear system at most, each with what the one before has left (iterative refinement): stiff rows, whose C is
/// up to 1e13 times the inertia under tiny friction, cost as many digits.
const REFINEMENTS: usize = 4;

/// What is left of a linear system at its solution, relative to w: some hundred times the rounding of sums.
const ROUNDING: f64 = 1e-13;
