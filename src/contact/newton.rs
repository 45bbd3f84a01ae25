//! The convex problem that MuJoCo's contact model poses, and Newton's method for it.
//!
//!     a = argmin ½ (a − a₀)ᵀ M (a − a₀) + Σ s(J a − a_ref)
//!
//! a₀ is the acceleration without constraints, s the cost of each constraint ([`cost`](super::cost)). The cost is
//! strongly convex, so there is one minimum, whatever the start; the constraint forces are f = −∂s/∂x there. In the
//! coordinates of [`super::unit_mass`] it is
//!
//!     w = argmin ½ |w|² + Σ s(x),     x = W w + J a₀ − a_ref,     gradient w − Wᵀ f,     H = 1 + Wᵀ s'' W
//!
//! Source: MuJoCo 4.0 manual, Computation › Solver › Primal problem, Algorithms.

use super::Task;
use super::block_factor::Shape;
use super::cost::{Cone, Kind, Spread, Zone};
use super::island::Island;
use super::penalty::residual::Piece;
use crate::data::Outcome;

/// One constraint: a contact, a limit, dry friction or an equality.
#[derive(Clone, Copy, Debug, Default)]
pub struct Constraint {
    /// Its cost function.
    pub cone: Cone,
    /// J v, m/s and rad/s.
    pub velocity: [f64; 6],
    /// J a₀, m/s² and rad/s².
    pub smooth: [f64; 6],
    /// Inverse masses that the normal, sliding, spinning and rolling meet, or estimates of them: 1/kg, 1/kg, 1/(kg m²)
    /// twice. What a residual is measured by.
    pub inverse: [f64; 4],
    /// −a_ref
    pub bias: [f64; 6],
    /// J a₀ − a_ref: x where there are no forces; see [`Constraint::begin`].
    pub offset: [f64; 6],
    /// J a − a_ref at the current a; under `penalty`, which has that in `y`, where a step begins.
    pub x: Spread,
    /// Change of x along the search direction; under `penalty` x itself.
    pub y: Spread,
    /// J a of an acceleration that is known, m/s² and rad/s²; see [`super::tangent`].
    pub rate: [f64; 6],
    /// −∂s/∂x at `x`: N, N m.
    pub force: [f64; 6],
    /// The force before a step, for methods that go back.
    pub start: [f64; 6],
    /// What it lacks, for methods that know it.
    pub change: [f64; 6],
    /// The piece of the cost on which x is.
    pub zone: Zone,
    /// The piece of the `penalty` law's equations on which the force is.
    pub piece: Piece,
}

impl Constraint {
    /// Takes what x is without forces, once the bias is known.
    pub fn begin(&mut self) {
        self.offset = self.beyond_bias(self.smooth);
        (0..6).for_each(|k| self.offset[k] += self.bias[k]);
    }

    /// Keeps where a step of `penalty` begins: its force, and in `x` the x that this law has in `y`.
    pub fn start_here(&mut self) {
        self.start = self.force;
        self.x = self.y;
    }

    /// Makes the change of that x as many times as large.
    pub fn stretch_x(&mut self, by: f64) {
        (0..self.cone.dim).for_each(|k| self.y[k] = self.x[k] + by * (self.y[k] - self.x[k]));
    }

    /// An acceleration without the rows that do not feel it.
    #[inline]
    pub fn beyond_bias(&self, mut a: [f64; 6]) -> [f64; 6] {
        if self.cone.frozen > 0 {
            a[self.cone.dim - self.cone.frozen..].fill(0.0);
        }
        a
    }

    /// x from W w, without edges.
    #[inline]
    pub fn at(&self, product: [f64; 6]) -> [f64; 6] {
        let product = self.beyond_bias(product);
        std::array::from_fn(|k| product[k] + self.offset[k])
    }

    /// Takes W w into x.
    #[inline]
    fn take_x(&mut self, product: [f64; 6]) {
        let x = self.at(product);
        self.cone.spread(&x, &mut self.x);
    }

    /// Takes W p into y.
    #[inline]
    fn take_y(&mut self, product: [f64; 6]) {
        let y = self.beyond_bias(product);
        self.cone.spread(&y, &mut self.y);
    }

    /// The force −∂s/∂x at the acceleration `rate`; the normal force there limits Coulomb friction.
    pub fn respond(&mut self) {
        let x = self.beyond_bias(self.rate);
        self.cone.spread(&std::array::from_fn(|k| x[k] + self.bias[k]), &mut self.x);
        self.cone.limit = self.cone.d[0] * (-self.x[0]).max(0.0);
        self.zone = self.cone.cost(&self.x, &mut self.force).1;
    }
}

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub struct Stop {
    /// On what is left of the gradient ([`residual`], m/s²) and on the predicted improvement over the trace of M, (m/s²)²; 0 means to
    /// rounding.
    pub tolerance: f64,
    /// Newton steps at most.
    pub iterations: usize,
    /// Whether `w` holds a start worth trying.
    pub warm: bool,
}

/// Σ aᵢ bᵢ
#[inline(always)]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// What an evaluation finds.
struct Point {
    /// Σ s(x)
    cost: f64,
    /// No constraint has moved to another piece of its cost.
    same: bool,
    /// All these pieces are quadratic.
    quadratic: bool,
}

/// Evaluates all constraints at w.
fn evaluate(island: &mut Island) -> Point {
    island.multiply_w(Constraint::take_x);
    forces(&mut island.constraints)
}

/// Evaluates all constraints at w = 0, without forces.
fn evaluate_smooth(constraints: &mut [Constraint]) -> Point {
    constraints.iter_mut().for_each(|c| c.take_x([0.0; 6]));
    forces(constraints)
}

/// Σ s(x) at w = 0, where the constraints are not.
fn cost_of_smooth(constraints: &[Constraint]) -> f64 {
    let cost = |c: &Constraint| {
        let mut x = [0.0; 10];
        c.cone.spread(&c.at([0.0; 6]), &mut x);
        c.cone.cost(&x, &mut [0.0; 6]).0
    };
    constraints.iter().map(cost).sum()
}

/// Evaluates all constraints α y further on.
///
/// Where x is but the softness of a stiff contact, R f, its digits would drown in J a and a_ref if it were
/// computed anew; counted on it keeps them, and Newton's steps go on to shrink.
fn evaluate_further(alpha: f64, constraints: &mut [Constraint]) -> Point {
    for c in constraints.iter_mut() {
        for k in 0..c.cone.width() {
            c.x[k] += alpha * c.y[k];
        }
    }
    forces(constraints)
}

/// Forces and cost of all constraints at their x.
#[inline]
fn forces(constraints: &mut [Constraint]) -> Point {
    let mut point = Point { cost: 0.0, same: true, quadratic: true };
    for c in constraints {
        let (cost, zone) = c.cone.cost(&c.x, &mut c.force);
        point.cost += cost;
        point.same &= zone == c.zone;
        point.quadratic &= c.cone.is_quadratic(zone);
        c.zone = zone;
    }
    point
}

/// Minimises the cost. On return `w` is the minimum; constraints hold their forces.
///
/// A warm start that is good enough is taken, and led nearer if it leaves more than [`LEFT`]; no matrix need be built. (With tolerance
/// 0 nothing is good enough.)
pub fn minimise(task: &Task, island: &mut Island, stop: &Stop) -> Outcome {
    let Task { model, data, .. } = *task;
    island.constraints.iter_mut().for_each(Constraint::begin);
    let scale = 1.0 / island.trace(model, data);
    if stop.warm {
        let from_constraints = evaluate(island).cost;
        let left = residual(island, scale);
        if left < stop.tolerance {
            if left > LEFT * stop.tolerance {
                lean(island);
            }
            return Outcome { iterations: 0, residual: left };
        }
        if from_constraints + 0.5 * dot(&island.w, &island.w) < cost_of_smooth(&island.constraints) {
            return descend(task, island, stop, scale, left);
        }
    }
    island.w.fill(0.0);
    evaluate_smooth(&mut island.constraints);
    let guesses = usize::from(stop.iterations > 0 && guess(task, island));
    let left = residual(island, scale);
    let outcome = descend(task, island, &Stop { iterations: stop.iterations - guesses, ..*stop }, scale, left);
    Outcome { iterations: outcome.iterations + guesses, ..outcome }
}

/// Finds the gradient. Out: its norm over √(trace of M), m/s².
///
/// MuJoCo's norm, of the gradient in the coordinates of the dofs and over the trace, is no larger: the trace is at least the largest
/// eigenvalue of M.
fn residual(island: &mut Island, scale: f64) -> f64 {
    island.take_gradient();
    (scale * dot(&island.gradient, &island.gradient)).sqrt()
}

/// What a warm start that is good enough may leave of the tolerance as it is. More is lessened by a step of steepest descent: else it
/// would stay while the bodies move on, and grow. Of 1,000 steps of a box at rest, a T and a stack of ten, 102, 84 and 100 then need
/// a Newton step. With descents from 0, 0.01, 0.1 and 0.3 of the tolerance on box and T need none, the stack 23, 24, 31 and 27, for a
/// descent in all steps or, with 0.1, in one of ten of the box and T and four of seven of the stack.
pub const LEFT: f64 = 0.1;

/// A step of steepest descent, −g α, to where the cost is least if no constraint leaves its piece:
///
///     α = g·g / (g·g + yᵀ s'' y),     y = W g
///
/// Forces stay as they are.
fn lean(island: &mut Island) {
    island.p.copy_from_slice(&island.gradient);
    island.multiply_p(|c, _, product| c.take_y(product));
    let Island { w, p, constraints, .. } = island;
    let square = dot(p, p);
    let second: f64 = constraints.iter().map(|c| c.cone.along(&c.x, &c.y, 0.0).1).sum();
    w.iter_mut().zip(p).for_each(|(w, p)| *w -= square / (square + second) * *p);
}

/// Where to start without a warm start, at w = 0 or further on: where pyramids slip, at the least cost of the edges alone that
/// will then carry force ([`Cone::likely`](super::cost::Cone::likely)). Out: whether a linear system was solved.
///
/// In: w = 0, and constraints evaluated there. Out: constraints evaluated at `w`.
///
/// Newton's method, which begins with all edges that x violates, drops the others one by one: the tutorial's disk, spinning on
/// the ground, takes 6.7 steps with contacts from w = 0 and 2.0 from there.
fn guess(task: &Task, island: &mut Island) -> bool {
    let mut slips = false;
    for i in 0..island.constraints.len() {
        let pyramid = island.constraints[i].cone.kind == Kind::Pyramid;
        let inverse = if pyramid { island.inverse_masses(i) } else { [0.0; 6] };
        let c = &mut island.constraints[i];
        let likely = c.cone.likely(&c.x, &inverse);
        slips |= likely.is_some();
        c.y = likely.unwrap_or(c.x);
    }
    if !slips {
        return false;
    }
    island.curvatures.clear();
    for c in &mut island.constraints {
        island.curvatures.push(c.cone.curvature(&c.y));
        c.cone.cost(&c.y, &mut c.force);
    }
    island.add_to_p(|c| &c.force);
    island.factor(task, Shape::Symmetric);
    island.divide_p(task);
    let cold: f64 = island.constraints.iter_mut().map(|c| c.cone.cost(&c.x, &mut c.force).0).sum();
    let point = advance(island);
    if point.cost + 0.5 * dot(&island.w, &island.w) < cold {
        return true;
    }
    island.w.fill(0.0);
    evaluate_smooth(&mut island.constraints);
    true
}

/// p = −H⁻¹ g. Out: the Newton decrement gᵀ H⁻¹ g, twice the improvement that a quadratic would give.
fn step(task: &Task, island: &mut Island) -> f64 {
    island.p.iter_mut().zip(&island.gradient).for_each(|(p, g)| *p = -g);
    island.curvatures.clear();
    island.curvatures.extend(island.constraints.iter().map(|c| c.cone.curvature(&c.x)));
    island.factor(task, Shape::Symmetric);
    island.divide_p(task);
    -dot(&island.gradient, &island.p)
}

/// Takes the full step p.
fn advance(island: &mut Island) -> Point {
    island.w.iter_mut().zip(&island.p).for_each(|(w, p)| *w += p);
    island.multiply_p(|c, _, product| c.take_y(product));
    evaluate_further(1.0, &mut island.constraints)
}

/// Newton's method from w, where constraints and gradient have been evaluated.
fn descend(task: &Task, island: &mut Island, stop: &Stop, scale: f64, mut left: f64) -> Outcome {
    let exact = stop.tolerance == 0.0;
    let (mut iterations, mut same, mut last) = (0, false, f64::INFINITY);
    while iterations < stop.iterations && !(left < stop.tolerance || left == 0.0) {
        let decrement = step(task, island);
        iterations += 1;
        // Below zero, or small and no longer shrinking on the same pieces of the cost, it is rounding.
        let stuck = same && decrement > 0.25 * last && scale * decrement < ROUNDING;
        if decrement.is_nan() || decrement <= 0.0 || (exact && stuck) {
            break;
        }
        // Most steps can be taken in full.
        let mut point = advance(island);
        if !(point.same && point.quadratic)
            && let Some(back) = line_search(island, decrement)
        {
            point = Point { same: false, ..evaluate_further(back, &mut island.constraints) };
        }
        left = residual(island, scale);
        // A full step that stays on quadratic pieces ends at the minimum; to rounding, if the step before did too.
        let arrived = point.same && point.quadratic;
        if (arrived && (same || !exact)) || 0.5 * scale * decrement < stop.tolerance {
            break;
        }
        same = point.same;
        last = decrement;
    }
    Outcome { iterations, residual: left }
}

/// Shortens the full step that has been taken to w + α p, where α minimises the cost along p.
///
///     φ'(α) = pᵀ (w + α p) + Σ ∂s(x + α y)/∂α = 0
///
/// φ' only grows, so Newton's method within a bracket finds its zero. One percent of φ'(0) is near enough: the
/// outer iteration does the rest.
///
/// In:  w and the constraints after the full step; `decrement` = −φ'(0).
/// Out: α − 1, by which w has been moved along p; `None` if the full step was right after all.
fn line_search(island: &mut Island, decrement: f64) -> Option<f64> {
    let Island { w, p, constraints, .. } = island;
    let (linear, square) = (dot(p, w), dot(p, p));
    // φ' and φ'', counted from the full step.
    let slope = |alpha: f64| {
        let (mut first, mut second) = (linear + (alpha - 1.0) * square, square);
        for c in constraints.iter() {
            let (f, s) = c.cone.along(&c.x, &c.y, alpha - 1.0);
            first += f;
            second += s;
        }
        (first, second)
    };
    let (mut low, mut high, mut alpha) = (0.0, f64::INFINITY, 1.0);
    for _ in 0..MAX_LINE_SEARCH {
        let (first, second) = slope(alpha);
        if first.abs() <= LINE_SEARCH_TOLERANCE * decrement {
            break;
        }
        if first < 0.0 {
            low = alpha;
        } else {
            high = alpha;
        }
        let next = alpha - first / second;
        alpha = if next > low && next < high { next } else { 0.5 * (low + high.min(2.0 * low + 1.0)) };
        if !(low < alpha && alpha < high) {
            break;
        }
    }
    if alpha == 1.0 {
        return None;
    }
    w.iter_mut().zip(p).for_each(|(w, p)| *w += (alpha - 1.0) * *p);
    Some(alpha - 1.0)
}

/// Promised improvements, in (m/s²)², that may be rounding: Newton's method cannot be slow so near the minimum.
const ROUNDING: f64 = 1e-12;
const MAX_LINE_SEARCH: usize = 50;
const LINE_SEARCH_TOLERANCE: f64 = 0.01;
