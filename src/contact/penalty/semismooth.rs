//! Newton's method on the law's own equations.
//!
//! The equations are smooth but for the kinks between their pieces: whether a contact pushes, whether it sticks or slips.
//! Within the pieces the method converges quadratically. [`solve`] takes the pieces anew from where each step ends, which is
//! quick and may cycle; [`descend`] shortens steps that lead no nearer; [`follow`] goes from one piece to the next.
//!
//! Source: P. Alart, A. Curnier, A mixed formulation for frictional contact problems prone to Newton like solution methods,
//! Comput. Methods Appl. Mech. Engrg. 92 (1991), 353–375; T. De Luca, F. Facchinei, C. Kanzow, A semismooth equation approach to
//! the solution of nonlinear complementarity problems, Math. Program. 75 (1996), 407–439, for shorter steps; R. M. Chamberlain,
//! M. J. D. Powell, C. Lemaréchal, H. C. Pedersen, The watchdog technique for forcing convergence in algorithms for constrained
//! optimization, Math. Program. Study 16 (1982), 1–17.

use super::super::Task;
use super::super::block_factor::Shape;
use super::super::cost::Kind;
use super::super::curvature::Curvature;
use super::super::island::Island;
use super::super::newton::Constraint;
use super::TOLERANCE;
use super::residual::{Piece, Slip, accelerate, judge, lacks, linearise, misfit, norm, residual, scaled, slips};
use crate::data::Outcome;

/// Takes at most `most` steps from the forces that the constraints have, as long as each leaves at most half of the least
/// residual so far. Out: the forces, and in `p` what they do.
///
/// In: `least` what the first step has to halve.
pub fn solve(task: &Task, island: &mut Island, mut least: f64, most: usize) -> Outcome {
    let mut outcome = Outcome { iterations: 0, residual: least };
    while outcome.iterations < most {
        outcome.iterations += 1;
        island.constraints.iter_mut().for_each(|c| c.piece = Piece::of_wish(c));
        step(task, island);
        outcome.residual = judge(island);
        if outcome.residual <= TOLERANCE || outcome.residual > 0.5 * least || outcome.residual == f64::INFINITY {
            break;
        }
        least = outcome.residual;
    }
    outcome
}

/// Takes at most `most` steps from the forces that the constraints have, each as long as it lessens what the forces lack: the
/// whole of it, a half or a quarter. The first that lessens nothing is taken whole all the same, over a kink, and counts if those
/// after it come out below (a watchdog). Out: the forces that lack least, and in `p` what they do.
///
/// The watchdog is worth 12,944 linear systems instead of 15,214 in 500 steps of 2 ms of the heap of 30 shapes that `penny bench`
/// has, 21.7 a step instead of 22.2 of twelve random heaps; two such steps in a row instead of one are worth nothing more.
///
/// In: `residual` of these forces, with `change` and `p`.
pub fn descend(task: &Task, island: &mut Island, residual: f64, most: usize) -> Outcome {
    let mut outcome = Outcome { iterations: 0, residual };
    let mut least = lack(&island.constraints);
    // What was lacking before a step that lessened nothing.
    let mut before = None;
    while outcome.iterations < most {
        outcome.iterations += 1;
        for c in &mut island.constraints {
            c.start_here();
            c.piece = Piece::of_wish(c);
        }
        let Island { w, p, .. } = island;
        w.copy_from_slice(p);
        step(task, island);
        outcome.residual = judge(island);
        let (mut part, mut left) = (1.0, lack(&island.constraints));
        let lessens = |part: f64, left: f64| left <= (1.0 - LESSENED * part) * least;
        while outcome.residual > TOLERANCE && !lessens(part, left) && part > SHORTEST {
            part *= 0.5;
            outcome.residual = stretch(island, 0.5);
            left = lack(&island.constraints);
        }
        if outcome.residual <= TOLERANCE {
            return outcome;
        }
        if !lessens(part, left) {
            if before.is_some() {
                break;
            }
            before = Some(least);
            island.keep(|c| c.start);
            outcome.residual = stretch(island, 1.0 / part);
            left = lack(&island.constraints);
        }
        least = left;
        before = before.filter(|before| least >= *before);
    }
    if before.is_some() {
        island.take_kept();
        accelerate(island);
        outcome.residual = misfit(island);
    }
    outcome
}

/// Makes a step this many times as long. Out: the residual.
fn stretch(island: &mut Island, by: f64) -> f64 {
    let Island { w, p, constraints, .. } = island;
    p.iter_mut().zip(w).for_each(|(p, w)| *p = *w + by * (*p - *w));
    for c in constraints {
        (0..c.cone.dim).for_each(|k| c.force[k] = c.start[k] + by * (c.force[k] - c.start[k]));
        c.stretch_x(by);
    }
    judge(island)
}

/// Of a step of [`descend`]. Without a watchdog, in 500 steps of a falling heap of 30 shapes, a quarter takes 18,955 linear systems,
/// a sixteenth 19,457, a hundredth 20,965; whole steps only, as many as lead nearer, 22,321.
const SHORTEST: f64 = 0.25;

/// A step leads nearer if it lessens by this what a linear equation would let it lessen (Armijo's rule): in the same heap, with a
/// sixteenth as the shortest step, 1e-4 takes 19,948 systems instead of 19,457, and 0.3 22,333.
const LESSENED: f64 = 0.1;

/// What all forces lack together, the root of the sum of squares, m/s²: smooth within the pieces, and smaller along Newton's step.
fn lack(constraints: &[Constraint]) -> f64 {
    constraints.iter().flat_map(lacks).map(|lack| lack * lack).sum::<f64>().sqrt()
}

/// Follows the solution from the last step's forces to this step's, with at most `most` linear systems. Out: the forces, and
/// in `p` what they do.
///
/// The last step's forces solve the equations under accelerations a₀ that differ a little from what they are now, on the
/// pieces that these forces are on. While a₀ goes to what it is, in a straight line, the solution goes along a straight line
/// until a constraint reaches the end of its piece: a normal no longer pushes, or does; a friction reaches its limit, or sticks
/// again. From there it goes on along another. (Exactly so where friction slips in one direction only, as in a plane; where
/// it turns, nearly.)
///
/// Source: the principle is Lemke's; R. W. Cottle, J.-S. Pang, R. E. Stone, The Linear Complementarity Problem (1992), §4.4.
pub fn follow(task: &Task, island: &mut Island, most: usize) -> Outcome {
    let mut outcome = Outcome { iterations: 0, residual: f64::INFINITY };
    island.constraints.iter_mut().for_each(|c| c.piece = Piece::of_forces(c));
    while outcome.iterations < most {
        outcome.iterations += 1;
        island.constraints.iter_mut().for_each(Constraint::start_here);
        let Island { w, p, .. } = island;
        w.copy_from_slice(p);
        step(task, island);
        outcome.residual = judge(island);
        if outcome.residual <= TOLERANCE || outcome.residual == f64::INFINITY {
            break;
        }
        let share = first_end(&island.constraints);
        if share >= 1.0 {
            break;
        }
        // Back to the end of the piece.
        let Island { w, p, constraints, .. } = island;
        p.iter_mut().zip(w).for_each(|(p, w)| *p = *w + share * (*p - *w));
        for c in constraints.iter_mut() {
            // Whatever ends there at once, in a scene with symmetries.
            let mut crosses = [false; 4];
            ends(c, |own, what| {
                let place = match what {
                    What::Normal => 0,
                    What::Group(i) => 1 + i,
                };
                crosses[place] = own <= share + SAME;
            });
            advance(c, share);
            c.stretch_x(share);
            if crosses[0] {
                cross(c, What::Normal);
            } else {
                (0..3).filter(|i| crosses[1 + i]).for_each(|i| cross(c, What::Group(i)));
            }
        }
    }
    outcome
}

/// Parts of a step that differ by rounding.
const SAME: f64 = 1e-12;

/// What ends a piece.
#[derive(Clone, Copy)]
enum What {
    Normal,
    Group(usize),
}

/// The part of the way from `start` to `force` on which the first piece ends; more than 1 if none does.
fn first_end(constraints: &[Constraint]) -> f64 {
    let mut first = f64::INFINITY;
    constraints.iter().for_each(|c| ends(c, |share, _| first = first.min(share)));
    first
}

/// Hands out where the piece of a constraint ends.
fn ends(c: &Constraint, mut end: impl FnMut(f64, What)) {
    // Where a quantity that may not be negative is zero.
    let zero = |from: f64, to: f64| if to < 0.0 { from.max(0.0) / (from.max(0.0) - to) } else { f64::INFINITY };
    let Constraint { cone, y: x, force, start, piece, .. } = c;
    if cone.kind == Kind::TwoSided {
        return;
    }
    let dry = cone.kind == Kind::Dry;
    if !dry {
        end(if piece.pushes { zero(start[0], force[0]) } else { zero(piece.slack, x[0]) }, What::Normal);
        if !piece.pushes {
            return;
        }
    }
    let limits = if dry { [cone.mu[0]; 2] } else { [start[0], force[0]] };
    for (i, slip) in piece.slips.iter().enumerate() {
        let Some((from, to, stiff)) = friction(c, i) else { break };
        let share = match slip {
            Some(slip) => zero(slip.slack, next_slack(c, i, slip, stiff, limits[1])),
            None => leaves(from, to, limits),
        };
        end(share, What::Group(i));
    }
}

/// Friction of a group over its coefficients at the start and at the end, and D; dry friction is the first group of its
/// constraint.
fn friction(c: &Constraint, i: usize) -> Option<([f64; 2], [f64; 2], f64)> {
    if c.cone.kind == Kind::Dry {
        return (i == 0).then_some(([c.start[0], 0.0], [c.force[0], 0.0], c.cone.d[0]));
    }
    let group = c.cone.groups().nth(i)?;
    Some((scaled(&c.start, &c.cone, &group), scaled(&c.force, &c.cone, &group), c.cone.d[group.start]))
}

/// How much more than its force lets it a friction slips, at the end of the step.
fn next_slack(c: &Constraint, i: usize, slip: &Slip, stiff: f64, limit: f64) -> f64 {
    let sigma = match c.cone.groups().nth(i) {
        Some(group) => slips(&c.y, &c.cone, &group),
        None => [c.y[0], 0.0],
    };
    -(slip.u[0] * sigma[0] + slip.u[1] * sigma[1]) - limit / stiff
}

/// The part of the way on which |s| reaches the limit, both straight; more than 1 if it does not.
fn leaves(from: [f64; 2], to: [f64; 2], limits: [f64; 2]) -> f64 {
    let (change, growth) = ([to[0] - from[0], to[1] - from[1]], limits[1] - limits[0]);
    // |s + α δs|² = (n + α δn)²
    let a = change[0] * change[0] + change[1] * change[1] - growth * growth;
    let b = from[0] * change[0] + from[1] * change[1] - limits[0] * growth;
    let c = from[0] * from[0] + from[1] * from[1] - limits[0] * limits[0];
    if c >= 0.0 {
        return if b > 0.0 {
            0.0
        } else if a > 0.0 {
            -2.0 * b / a
        } else {
            f64::INFINITY
        };
    }
    // c < 0: the zero that is not negative, without cancellation.
    let root = b * b - a * c;
    if root < 0.0 {
        return f64::INFINITY;
    }
    let share = if b >= 0.0 { -c / (b + root.sqrt()) } else { (root.sqrt() - b) / a };
    if share >= 0.0 { share } else { f64::INFINITY }
}

/// Goes back to a part of the step.
fn advance(c: &mut Constraint, share: f64) {
    let limit = if c.cone.kind == Kind::Dry { c.cone.mu[0] } else { c.force[0] };
    for i in 0..c.piece.slips.len() {
        let (Some(slip), Some((_, _, stiff))) = (c.piece.slips[i], friction(c, i)) else { continue };
        let next = next_slack(c, i, &slip, stiff, limit);
        c.piece.slips[i] = Some(Slip { slack: (slip.slack + share * (next - slip.slack)).max(0.0), ..slip });
    }
    c.piece.slack = (c.piece.slack + share * (c.y[0] - c.piece.slack)).max(0.0);
    for k in 0..c.cone.dim {
        c.force[k] = c.start[k] + share * (c.force[k] - c.start[k]);
    }
}

/// On the next piece.
fn cross(c: &mut Constraint, what: What) {
    match what {
        What::Normal => {
            let pushes = !c.piece.pushes;
            c.piece = Piece { pushes, ..Piece::default() };
            c.force = [0.0; 6];
            if pushes {
                // A friction whose limit is still nothing.
                for i in 0..c.cone.groups().count() {
                    c.piece.slips[i] = touching(c, i);
                }
            }
        }
        What::Group(i) => {
            let s = match c.cone.groups().nth(i) {
                Some(group) => scaled(&c.force, &c.cone, &group),
                None => [c.force[0], 0.0],
            };
            let length = norm(s);
            c.piece.slips[i] = match c.piece.slips[i] {
                Some(_) => None,
                None if length > 0.0 => Some(Slip { u: s.map(|s| s / length), slack: 0.0 }),
                None => touching(c, i),
            };
        }
    }
}

/// How a group without force slips.
fn touching(c: &Constraint, i: usize) -> Option<Slip> {
    let group = c.cone.groups().nth(i)?;
    let sigma = slips(&c.y, &c.cone, &group);
    let slack = norm(sigma);
    (slack > 0.0 && c.cone.d[group.start] != 0.0).then(|| Slip { u: sigma.map(|s| -s / slack), slack })
}

/// One linear system: w' = w + δw = Wᵀ (f + δf), δf = e − C W δw. Reads w in `p` and x in `y`, and leaves them there;
/// needs `gradient`.
fn step(task: &Task, island: &mut Island) {
    island.curvatures.clear();
    let mut shape = Shape::Symmetric;
    for c in &mut island.constraints {
        let curvature;
        (curvature, c.change) = linearise(c);
        if let Curvature::Limited { normal, .. } = &curvature
            && *normal != [0.0; 6]
        {
            shape = Shape::General;
        }
        island.curvatures.push(curvature);
    }
    island.gradient.copy_from_slice(&island.p);
    island.add_to_p(|c| &c.change);
    island.factor(task, shape);
    island.divide_p(task);
    island.constraints.iter_mut().for_each(|c| (0..c.cone.dim).for_each(|k| c.force[k] += c.change[k]));
    for _ in 0..REFINEMENTS {
        let Island { gradient: w, p, .. } = island;
        w.iter_mut().zip(p).for_each(|(w, p)| *w += *p);
        island.multiply_p(|c, curvature, product| {
            let less = curvature.times(&product, c.cone.dim);
            (0..c.cone.dim).for_each(|k| c.force[k] -= less[k]);
            let product = c.beyond_bias(product);
            (0..c.cone.dim).for_each(|k| c.y[k] += product[k]);
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
        island.divide_p(task);
    }
    residual(island);
}

/// Solutions of one linear system at most, each with what the one before has left (iterative refinement): stiff rows, whose C is
/// up to 1e13 times the inertia under tiny friction, cost as many digits.
const REFINEMENTS: usize = 4;

/// What is left of a linear system at its solution, relative to w: some hundred times the rounding of sums. Gymnasium's robots that lie
/// still need no refinement for it; walker2d, falling, takes 3 % fewer instructions with 1e-12 and 5 % fewer with 1e-11.
const ROUNDING: f64 = 1e-13;
