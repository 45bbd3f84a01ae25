//! The convex problem that MuJoCo's contact model poses, and Newton's method for it.
//!
//!     a = argmin ½ (a − a₀)ᵀ M (a − a₀) + Σ s(J a − a_ref)
//!
//! a₀ is the acceleration without constraints, s the cost of each constraint ([`cost`](super::cost)). The cost is
//! strongly convex, so there is one minimum, whatever the start; the constraint forces are f = −∂s/∂x there.
//!
//! Source: MuJoCo 4.0 manual, Computation › Solver › Primal problem, Algorithms.

use super::cost::{Cone, Spread, Zone};
use crate::data::Outcome;

/// One cone of constraint: a contact, a joint limit, or the dry friction of a degree of freedom.
#[derive(Clone, Copy, Debug, Default)]
pub struct Constraint {
    pub cone: Cone,
    /// J v, m/s and rad/s.
    pub velocity: [f64; 6],
    /// Inverse masses that the normal, sliding, spinning and rolling meet, or estimates of them: 1/kg, 1/kg, 1/(kg m²)
    /// twice. What a residual is measured by.
    pub inverse: [f64; 4],
    /// −a_ref: x = J a + bias.
    pub bias: [f64; 6],
    /// J a − a_ref at the current a, and its change J p along the search direction.
    pub x: Spread,
    pub y: Spread,
    /// J a of an acceleration that is known, m/s² and rad/s²; see [`super::tangent`].
    pub rate: [f64; 6],
    /// −∂s/∂x at `x`: N, N m.
    pub force: [f64; 6],
    pub zone: Zone,
    /// Normal force, and by how much it differed from `cone.limit`, when that was last changed, N.
    pub last: [f64; 2],
}

impl Constraint {
    /// Takes J v into x or y.
    #[inline]
    pub fn set(&mut self, into: Into, mut product: [f64; 6]) {
        if self.cone.frozen > 0 {
            product[self.cone.dim - self.cone.frozen..].fill(0.0);
        }
        match into {
            Into::X => {
                (0..self.cone.dim).for_each(|k| product[k] += self.bias[k]);
                self.cone.spread(&product, &mut self.x);
            }
            Into::Y => self.cone.spread(&product, &mut self.y),
        }
    }

    /// The force −∂s/∂x at the acceleration `rate`; the normal force there limits Coulomb friction.
    pub fn respond(&mut self) {
        self.set(Into::X, self.rate);
        self.cone.limit = self.cone.d[0] * (-self.x[0]).max(0.0);
        self.zone = self.cone.cost(&self.x, &mut self.force).1;
    }
}

/// Which of a constraint's vectors a product with J goes to.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Into {
    /// x = J v + bias
    X,
    /// y = J v
    Y,
}

/// The M and J of a problem: one free body in arrays of fixed size, or an island of many bodies.
pub trait Space {
    type Vector: AsRef<[f64]> + AsMut<[f64]>;
    /// out = M v
    fn multiply_m(&self, v: &Self::Vector, out: &mut Self::Vector);
    /// v = M⁻¹ v
    fn divide_m(&self, v: &mut Self::Vector);
    fn trace_m(&self) -> f64;
    fn multiply_j(&self, v: &Self::Vector, into: Into, constraints: &mut [Constraint]);
    /// g −= Jᵀ f
    fn subtract_forces(&self, constraints: &[Constraint], g: &mut Self::Vector);
    /// p = −H⁻¹ g with H = M + Jᵀ s'' J
    fn newton(&mut self, constraints: &[Constraint], g: &Self::Vector, p: &mut Self::Vector);
}

/// Vectors of the problem: accelerations in m/s² and rad/s², forces in N and N m.
#[derive(Clone, Debug, Default)]
pub struct Vectors<V> {
    /// a₀, acceleration without constraints.
    pub smooth: V,
    /// a; the start (warm start) on entry, the minimum at the end.
    pub a: V,
    /// M (a − a₀): at the minimum the constraints' generalized force.
    pub pull: V,
    pub gradient: V,
    pub p: V,
    pub mp: V,
}

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub struct Stop {
    /// On gradient and predicted improvement, both divided by the trace of M; 0 means to rounding.
    pub tolerance: f64,
    pub iterations: usize,
    /// Whether `a` holds a start worth trying.
    pub warm: bool,
}

#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// What [`evaluate`] finds.
struct Point {
    /// Σ s(x)
    cost: f64,
    /// No constraint has moved to another piece of its cost.
    same: bool,
    /// All these pieces are quadratic.
    quadratic: bool,
}

/// Evaluates all constraints at `a`.
#[inline]
fn evaluate<S: Space>(space: &S, a: &S::Vector, constraints: &mut [Constraint]) -> Point {
    space.multiply_j(a, Into::X, constraints);
    forces(constraints)
}

/// Evaluates all constraints α y further on.
///
/// Where x is but the softness of a stiff contact, R f, its digits would drown in J a and a_ref if it were
/// computed anew; counted on it keeps them, and Newton's steps go on to shrink.
#[inline]
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

/// g = M (a − a₀) − Jᵀ f; returns its norm.
#[inline]
fn gradient<S: Space>(space: &S, v: &mut Vectors<S::Vector>, constraints: &[Constraint]) -> f64 {
    v.gradient.as_mut().copy_from_slice(v.pull.as_ref());
    space.subtract_forces(constraints, &mut v.gradient);
    dot(v.gradient.as_ref(), v.gradient.as_ref()).sqrt()
}

/// pull = M (a − a₀), by way of `p`.
#[inline]
fn pull<S: Space>(space: &S, v: &mut Vectors<S::Vector>) {
    for ((d, a), smooth) in v.p.as_mut().iter_mut().zip(v.a.as_ref()).zip(v.smooth.as_ref()) {
        *d = a - smooth;
    }
    space.multiply_m(&v.p, &mut v.pull);
}

/// a₀ + M⁻¹ Jᵀ f: the acceleration that the constraints' forces cause, into `v.mp`.
#[inline]
pub fn accelerate<S: Space>(space: &S, v: &mut Vectors<S::Vector>, constraints: &[Constraint]) {
    v.mp.as_mut().fill(0.0);
    space.subtract_forces(constraints, &mut v.mp);
    space.divide_m(&mut v.mp);
    for (a, smooth) in v.mp.as_mut().iter_mut().zip(v.smooth.as_ref()) {
        *a = smooth - *a;
    }
}

/// Minimises the cost. On return `v.a` is the minimum and `v.pull` M (a − a₀); constraints hold their forces.
///
/// A warm start that is good enough is taken as it is: the cost has at least the curvature M, hence
/// cost(a) − min ≤ ½ gᵀ M⁻¹ g, and no matrix need be built. (With tolerance 0 nothing is good enough.)
pub fn minimise<S: Space>(
    space: &mut S,
    v: &mut Vectors<S::Vector>,
    constraints: &mut [Constraint],
    stop: &Stop,
) -> Outcome {
    let scale = 1.0 / space.trace_m();
    let norm;
    if stop.warm {
        pull(space, v);
        let from_constraints = evaluate(space, &v.a, constraints).cost;
        let warm_norm = scale * gradient(space, v, constraints);
        if warm_norm < stop.tolerance {
            v.mp.as_mut().copy_from_slice(v.gradient.as_ref());
            space.divide_m(&mut v.mp);
            if 0.5 * scale * dot(v.gradient.as_ref(), v.mp.as_ref()) < stop.tolerance {
                return Outcome { iterations: 0, residual: warm_norm };
            }
        }
        let warm = from_constraints + 0.5 * dot(v.pull.as_ref(), v.p.as_ref());
        let cold = evaluate(space, &v.smooth, constraints).cost;
        if warm < cold {
            evaluate(space, &v.a, constraints);
            norm = warm_norm;
        } else {
            norm = start_at_smooth(space, v, constraints) * scale;
        }
    } else {
        evaluate(space, &v.smooth, constraints);
        norm = start_at_smooth(space, v, constraints) * scale;
    }
    descend(space, v, constraints, stop, scale, norm)
}

/// Starts from a₀, where `constraints` have been evaluated; returns the norm of the gradient.
fn start_at_smooth<S: Space>(space: &S, v: &mut Vectors<S::Vector>, constraints: &[Constraint]) -> f64 {
    v.a.as_mut().copy_from_slice(v.smooth.as_ref());
    v.pull.as_mut().fill(0.0);
    gradient(space, v, constraints)
}

/// Evaluates the constraints at `v.a`: where [`iterate`] begins.
pub fn begin<S: Space>(space: &S, v: &mut Vectors<S::Vector>, constraints: &mut [Constraint]) {
    evaluate(space, &v.a, constraints);
    pull(space, v);
    gradient(space, v, constraints);
}

/// The same, at the x that the constraints have, after a change of their costs.
pub fn refresh<S: Space>(space: &S, v: &mut Vectors<S::Vector>, constraints: &mut [Constraint]) {
    forces(constraints);
    gradient(space, v, constraints);
}

/// One Newton step with line search. Out: whether it left every constraint on its piece of the cost, or was no more than
/// rounding; `None` where nothing leads further down.
pub fn iterate<S: Space>(space: &mut S, v: &mut Vectors<S::Vector>, constraints: &mut [Constraint]) -> Option<bool> {
    let energy = dot(v.pull.as_ref(), v.a.as_ref()) - dot(v.pull.as_ref(), v.smooth.as_ref());
    space.newton(constraints, &v.gradient, &mut v.p);
    let decrement = -dot(v.gradient.as_ref(), v.p.as_ref());
    if decrement.is_nan() || decrement <= 0.0 {
        return None;
    }
    for (a, p) in v.a.as_mut().iter_mut().zip(v.p.as_ref()) {
        *a += p;
    }
    space.multiply_j(&v.p, Into::Y, constraints);
    let point = evaluate_further(1.0, constraints);
    let mut same = point.same;
    let tiny = decrement <= TINY * energy;
    if !(tiny || point.same && point.quadratic)
        && let Some(back) = line_search(space, v, constraints, decrement)
    {
        same &= evaluate_further(back, constraints).same;
    }
    pull(space, v);
    gradient(space, v, constraints);
    Some(same || tiny)
}

/// Part of (a − a₀)ᵀ M (a − a₀) below which the Newton decrement is so small that a step is taken in full: slopes along it
/// would be rounding.
const TINY: f64 = 1e-20;

/// Newton's method from `v.a`, where `constraints`, `v.pull` and `v.gradient` have been evaluated.
fn descend<S: Space>(
    space: &mut S,
    v: &mut Vectors<S::Vector>,
    constraints: &mut [Constraint],
    stop: &Stop,
    scale: f64,
    mut norm: f64,
) -> Outcome {
    let exact = stop.tolerance == 0.0;
    let (mut iterations, mut same, mut last) = (0, false, f64::INFINITY);
    while iterations < stop.iterations && !(norm < stop.tolerance || norm == 0.0) {
        space.newton(constraints, &v.gradient, &mut v.p);
        iterations += 1;
        // gᵀ H⁻¹ g, twice the improvement that a quadratic would give. Below zero, or small and no longer shrinking on
        // the same pieces of the cost, it is rounding.
        let decrement = -dot(v.gradient.as_ref(), v.p.as_ref());
        let stuck = same && decrement > 0.25 * last && scale * decrement < ROUNDING;
        if decrement.is_nan() || decrement <= 0.0 || (exact && stuck) {
            break;
        }
        // Most steps can be taken in full.
        for (a, p) in v.a.as_mut().iter_mut().zip(v.p.as_ref()) {
            *a += p;
        }
        space.multiply_j(&v.p, Into::Y, constraints);
        let mut point = evaluate_further(1.0, constraints);
        if !(point.same && point.quadratic)
            && let Some(back) = line_search(space, v, constraints, decrement)
        {
            point = Point { same: false, ..evaluate_further(back, constraints) };
        }
        pull(space, v);
        norm = scale * gradient(space, v, constraints);
        // A full step that stays on quadratic pieces ends at the minimum; to rounding, if the step before did too.
        let arrived = point.same && point.quadratic;
        if (arrived && (same || !exact)) || 0.5 * scale * decrement < stop.tolerance {
            break;
        }
        same = point.same;
        last = decrement;
    }
    Outcome { iterations, residual: norm }
}

/// Shortens the full step that has been taken to a + α p, where α minimises the cost along p.
///
///     φ'(α) = pᵀ M (a + α p − a₀) + Σ ∂s(x + α y)/∂α = 0
///
/// φ' only grows, so Newton's method within a bracket finds its zero. One percent of φ'(0) is near enough: the
/// outer iteration does the rest.
///
/// In:  `v.a`, `constraints` after the full step, `v.pull` before it; `decrement` = −φ'(0).
/// Out: α − 1, by which `v.a` has been moved along p; `None` if the full step was right after all.
fn line_search<S: Space>(
    space: &S,
    v: &mut Vectors<S::Vector>,
    constraints: &[Constraint],
    decrement: f64,
) -> Option<f64> {
    space.multiply_m(&v.p, &mut v.mp);
    let linear = dot(v.p.as_ref(), v.pull.as_ref());
    let square = dot(v.p.as_ref(), v.mp.as_ref());
    // φ' and φ'', counted from the full step.
    let slope = |alpha: f64| {
        let (mut first, mut second) = (linear + alpha * square, square);
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
    for (a, p) in v.a.as_mut().iter_mut().zip(v.p.as_ref()) {
        *a += (alpha - 1.0) * p;
    }
    Some(alpha - 1.0)
}

/// Promised improvements, in (m/s²)², that may be rounding: Newton's method cannot be slow so near the minimum.
const ROUNDING: f64 = 1e-12;
const MAX_LINE_SEARCH: usize = 50;
const LINE_SEARCH_TOLERANCE: f64 = 0.01;
