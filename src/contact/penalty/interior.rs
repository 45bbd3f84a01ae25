//! An interior-point method for the law's equations: from no guess at all, in a number of linear systems that hardly grows with
//! the number of contacts.
//!
//! Of each constraint let n be the normal force and s a friction over its coefficients; y = x + R n and ζ = σ + R s (σ slip times
//! coefficients, R = 1/D) what is left of the motion beyond the softness of the law; t ≥ |ζ|. The law says
//!
//!     n ≥ 0,  y ≥ 0,  n y = 0         |s| ≤ n,  |ζ| ≤ t,  n t + s·ζ = 0,  n ζ + t s = 0
//!
//! (a friction is at its limit and against the slip, or there is no slip). With τ > 0 in place of two of the zeros,
//!
//!     n y = τ                         n t + s·ζ = τ,  n ζ + t s = 0
//!
//! normals push a little before they touch, friction turns softly, and all is smooth. Newton's method, kept within the
//! inequalities, goes along these solutions while τ shrinks. First each step aims at τ = 0; how much of it the inequalities
//! allow says which τ to aim at, and what the step lacked is added to the right-hand side (Mehrotra's predictor and corrector).
//! The equations of friction are symmetrised by Nesterov and Todd's scaling W of (n, s) and (t, ζ), W² (t, ζ) = (n, s).
//!
//! In them n is the normal force of the solution itself, no limit that was given before. That makes the system unsymmetric, and
//! the path of solutions may turn back in τ. There steps get shorter and shorter, because the matrix is singular on the way: the
//! method then leaves the path by a step across, and begins anew from there.
//!
//! Source: S. Mehrotra, On the implementation of a primal–dual interior point method, SIAM J. Optim. 2 (1992), 575–601;
//! L. Vandenberghe, The CVXOPT linear and quadratic cone program solvers (2010), for the scaling.

use std::ops::Range;

use super::super::Task;
use super::super::block_factor::Shape;
use super::super::cost::{Cone, GROUPS, Kind};
use super::super::curvature::Curvature;
use super::super::island::Island;
use super::super::newton::Constraint;
use super::residual::{norm, residual};
use super::{MOST, TOLERANCE, semismooth};
use crate::data::Outcome;

/// Where a constraint is within the inequalities, beside its force, and how that changes along the step, beside
/// [`Constraint::change`].
#[derive(Clone, Copy, Debug, Default)]
pub struct Interior {
    y: f64,
    change_y: f64,
    groups: [Group; 3],
}

/// The same of a group of friction.
#[derive(Clone, Copy, Debug, Default)]
struct Group {
    /// (t, ζ)
    motion: [f64; 3],
    change: [f64; 3],
    /// δt = t₀ + tᵤ·(δn, δζ)
    t: f64,
    slope: [f64; 3],
}

/// Solves from no forces, with at most `rounds` linear systems. Out: the forces, and in `p` what they do.
pub fn solve(task: &Task, island: &mut Island, rounds: usize) -> Outcome {
    let mut outcome = Outcome { iterations: 0, residual: f64::INFINITY };
    island.w.fill(0.0);
    take_x(island);
    let tau = island.constraints.iter().map(largest).fold(0.0, f64::max);
    if tau == 0.0 {
        // Nothing is to be done: every x is 0.
        island.constraints.iter_mut().for_each(|c| c.force = [0.0; 6]);
        outcome.residual = residual(island);
        return outcome;
    }
    let mut inner = std::mem::take(&mut island.interior);
    begin(&mut island.constraints, &mut inner, tau);
    let (mut tried, mut shorts, mut least) = (1.0, 0, f64::INFINITY);
    while outcome.iterations < rounds {
        outcome.iterations += 1;
        direction(task, island, &mut inner, None);
        let allowed = furthest(&island.constraints, &inner).min(1.0);
        let (gap, left) = gaps(&island.constraints, &inner, allowed);
        // Mehrotra takes the third power: that needs 27,233 linear systems in 700 steps of a heap of 30 shapes, the square 26,872.
        direction(task, island, &mut inner, Some(gap * (left / gap).powi(2)));
        let part = (WITHIN * furthest(&island.constraints, &inner)).min(1.0);
        shorts = if part < SHORT { shorts + 1 } else { 0 };
        if shorts == 2 {
            // Across, no further than the accelerations are large.
            let Island { w, p, .. } = &mut *island;
            let size = |v: &[f64]| v.iter().fold(0.0f64, |most, x| most.max(x.abs()));
            let part = (size(w) / size(p)).min(1.0);
            w.iter_mut().zip(&*p).for_each(|(w, p)| *w += part * p);
            take_x(island);
            begin(&mut island.constraints, &mut inner, AGAIN * gap);
            shorts = 0;
            continue;
        }
        advance(island, &mut inner, part);
        outcome.residual = residual(island);
        if outcome.residual < least {
            least = outcome.residual;
            island.keep(|c| c.force);
        }
        if !outcome.residual.is_finite() {
            // Nearer to an inequality than numbers can tell.
            break;
        }
        if outcome.residual <= TOLERANCE {
            break;
        }
        island.constraints.iter_mut().for_each(|c| c.start = c.force);
        if outcome.residual < 0.1 * tried {
            tried = outcome.residual;
            let tries = MOST.min(rounds - outcome.iterations);
            outcome = outcome.then(semismooth::solve(task, island, outcome.residual, tries));
            if outcome.residual <= TOLERANCE {
                break;
            }
            island.constraints.iter_mut().for_each(|c| c.force = c.start);
        }
        take_x(island);
    }
    if least.is_finite() && !(0.0..=TOLERANCE).contains(&outcome.residual) {
        island.take_kept();
        outcome.residual = residual(island);
    }
    island.interior = inner;
    outcome
}

/// Part of the way to the nearest inequality that is taken. Of 100 steps in which 60 balls are pressed together in a bin 4 stay
/// unsolved with it and 8 with 0.9, and a falling heap of 30 shapes takes 19,500 linear systems in 500 steps instead of 21,200.
const WITHIN: f64 = 0.99;

/// Two steps shorter than this part of what they should be are a path that turns back. In the same bin, with 0.9 of the way, 5 stay
/// unsolved with 0.1, 6 with 0.03.
const SHORT: f64 = 0.1;

/// How far back along τ it begins anew: in the same bin, with 0.9 of the way, 5 stay unsolved with 10, 7 with
/// 100, 38 with 1.
const AGAIN: f64 = 10.0;

/// x at w.
fn take_x(island: &mut Island) {
    let Island { w, p, .. } = island;
    p.copy_from_slice(w);
    island.multiply_p(|c, _, product| {
        let x = c.at(product);
        c.y[..6].copy_from_slice(&x);
    });
}

/// The groups of friction of a constraint that can act: number, rows, stiffness D.
fn groups(cone: &Cone) -> impl Iterator<Item = (usize, Range<usize>, f64)> {
    let (kind, dim, d) = (cone.kind, cone.dim, cone.d);
    let dry = (kind == Kind::Dry).then_some((0, 0..1, d[0]));
    let coulomb = GROUPS.into_iter().enumerate().map(move |(i, rows)| (i, rows.clone(), d[rows.start]));
    dry.into_iter().chain(coulomb.filter(move |(_, rows, d)| kind == Kind::Coulomb && rows.end <= dim && *d != 0.0))
}

/// The coefficient of a row; the force of dry friction is no multiple of one.
fn mu(cone: &Cone, k: usize) -> f64 {
    if cone.kind == Kind::Dry { 1.0 } else { cone.mu[k] }
}

/// Two numbers, of the rows of a group.
fn two(rows: &Range<usize>, of: impl Fn(usize) -> f64) -> [f64; 2] {
    let mut out = [0.0; 2];
    out.iter_mut().zip(rows.clone()).for_each(|(out, k)| *out = of(k));
    out
}

/// (n, s), where `force` is a constraint's force or its change.
fn scaled(cone: &Cone, force: &[f64; 6], rows: &Range<usize>, limit: f64) -> [f64; 3] {
    let s = two(rows, |k| force[k] / mu(cone, k));
    [limit, s[0], s[1]]
}

/// The limit of friction n and its change.
fn limit(c: &Constraint) -> [f64; 2] {
    if c.cone.kind == Kind::Dry { [c.cone.mu[0], 0.0] } else { [c.force[0], c.change[0]] }
}

/// Whether it has a normal force that pushes only.
fn pushes(cone: &Cone) -> bool {
    matches!(cone.kind, Kind::OneSided | Kind::Coulomb)
}

/// What n y would be, N m/s², at the force that stops the constraint and the acceleration that this force causes; or that of
/// friction, or of a row of an equality.
fn largest(c: &Constraint) -> f64 {
    let mut most = if pushes(&c.cone) { c.y[0] * c.y[0] / c.inverse[0] } else { 0.0 };
    if c.cone.kind == Kind::TwoSided {
        let rows = (0..c.cone.dim).filter(|k| c.y[*k] != 0.0);
        most = rows.map(|k| c.y[k] * c.y[k] / c.inverse[k / 3]).fold(0.0, f64::max);
    }
    for (i, rows, _) in groups(&c.cone) {
        let inverse = if c.cone.kind == Kind::Dry { c.inverse[0] } else { c.inverse[1 + i] };
        let x = two(&rows, |k| c.y[k]);
        most = most.max((x[0] * x[0] + x[1] * x[1]) / inverse);
    }
    most
}

/// Puts all constraints where they answer to their x under τ, nearly.
fn begin(constraints: &mut [Constraint], inner: &mut Vec<Interior>, tau: f64) {
    inner.resize(constraints.len(), Interior::default());
    for (c, inner) in constraints.iter_mut().zip(inner) {
        *inner = Interior::default();
        c.force = [0.0; 6];
        match c.cone.kind {
            Kind::TwoSided => (0..c.cone.dim).for_each(|k| c.force[k] = -c.cone.d[k] * c.y[k]),
            Kind::Dry => {}
            _ => {
                // n (x + n/D) = τ
                let (half, product) = (0.5 * c.cone.d[0] * c.y[0], c.cone.d[0] * tau);
                let root = (half * half + product).sqrt();
                c.force[0] = if half <= 0.0 { root - half } else { product / (root + half) };
                inner.y = tau / c.force[0];
            }
        }
        let n = limit(c)[0];
        for (i, rows, stiff) in groups(&c.cone) {
            // ζ is the part of σ that friction leaves: n ζ = −t s, ζ = σ + s/D, t = τ/2n + √((τ/2n)² + ζ²)
            let sigma = two(&rows, |k| mu(&c.cone, k) * c.y[k]);
            let t = |zeta: f64| 0.5 * tau / n + (0.25 * tau * tau / (n * n) + zeta * zeta).sqrt();
            let length = norm(sigma);
            let mut zeta = (length - n / stiff).max(0.1 * length);
            (0..3).for_each(|_| zeta = length / (1.0 + n / (stiff * t(zeta))));
            let share = if length > 0.0 { zeta / length } else { 0.0 };
            inner.groups[i].motion = [t(zeta), share * sigma[0], share * sigma[1]];
            for (k, sigma) in rows.zip(sigma) {
                c.force[k] = -mu(&c.cone, k) * n * share * sigma / t(zeta);
            }
        }
    }
}

/// The step, into `p` and the constraints: towards τ = 0 if it is not given, with a matrix of its own; or else to that τ, with the
/// same matrix, corrected by what the step before would lack.
///
///     δf = e − C δx,     (1 + Wᵀ C W) δw = Wᵀ (f + e) − w
fn direction(task: &Task, island: &mut Island, inner: &mut [Interior], to: Option<f64>) {
    if to.is_none() {
        island.curvatures.clear();
    }
    for (c, inner) in island.constraints.iter_mut().zip(&mut *inner) {
        let (curvature, e) = linearise(c, inner, to);
        c.change = std::array::from_fn(|k| c.force[k] + e[k]);
        if to.is_none() {
            island.curvatures.push(curvature);
        }
    }
    island.add_to_p(|c| &c.change);
    let Island { w, p, .. } = &mut *island;
    p.iter_mut().zip(w).for_each(|(p, w)| *p -= *w);
    if to.is_none() {
        island.factor(task, Shape::General);
    }
    island.divide_p(task);
    let mut inner = inner.iter_mut();
    island.multiply_p(|c, curvature, mut product| {
        product[c.cone.dim - c.cone.frozen..].fill(0.0);
        let less = curvature.times(&product, c.cone.dim);
        (0..6).for_each(|k| c.change[k] -= c.force[k] + less[k]);
        let Some(inner) = inner.next() else { return };
        inner.change_y = product[0] + c.change[0] / c.cone.d[0];
        let dn = limit(c)[1];
        for (i, rows, stiff) in groups(&c.cone) {
            let zeta = two(&rows, |k| mu(&c.cone, k) * product[k] + c.change[k] / mu(&c.cone, k) / stiff);
            let Group { t, slope, .. } = inner.groups[i];
            let t = t + slope[0] * dn + slope[1] * zeta[0] + slope[2] * zeta[1];
            inner.groups[i].change = [t, zeta[0], zeta[1]];
        }
    });
}

/// C and e of one constraint.
fn linearise(c: &Constraint, inner: &mut Interior, to: Option<f64>) -> (Curvature, [f64; 6]) {
    let Constraint { cone, force, y: x, .. } = c;
    let (mut e, mut diagonal, mut normal, mut turn) = ([0.0; 6], [0.0; 6], [0.0; 6], [0.0; 2]);
    if cone.kind == Kind::TwoSided {
        (0..cone.dim).for_each(|k| e[k] = -(cone.d[k] * x[k] + force[k]));
        return (Curvature::Diagonal(cone.d), e);
    }
    let [n, dn] = limit(c);
    if pushes(cone) {
        // y δn + n (δx + δn/D) = τ − n y
        let over = inner.y + n / cone.d[0];
        e[0] = (to.map_or(0.0, |tau| tau - dn * inner.change_y) - n * inner.y) / over;
        diagonal[0] = n / over;
    }
    for (i, rows, stiff) in groups(cone) {
        let group = &mut inner.groups[i];
        let scaling = Scaling::new(scaled(cone, force, &rows, n), group.motion);
        let both = scaling.times(group.motion);
        let mut lacks = product(both, both).map(|x| -x);
        if let Some(tau) = to {
            let change = scaled(cone, &c.change, &rows, dn);
            let more = product(scaling.divide(change), scaling.times(group.change));
            (0..3).for_each(|k| lacks[k] -= more[k]);
            lacks[0] += tau;
        }
        // (δn, δs) = r − W² (δt, δζ), solved for δt; then δs = s₀ + u δn − S δζ
        let r = scaling.times(quotient(lacks, both));
        let Scaling { square, mean, .. } = scaling;
        let first = square * (mean[0] * mean[0] + mean[1] * mean[1] + mean[2] * mean[2]);
        let u = [1, 2].map(|k| 2.0 * square * mean[0] * mean[k] / first);
        (group.t, group.slope) = (r[0] / first, [-1.0 / first, -u[0], -u[1]]);
        let spread = |j: usize, k: usize| {
            f64::from(u8::from(j == k)) * square - 2.0 * square * square * mean[1 + j] * mean[1 + k] / first
        };
        // δζ = δσ + δs/D: (1 + S/D) δs = s₀ + u δn − S δσ
        let [a, b, d] = [1.0 + spread(0, 0) / stiff, spread(0, 1) / stiff, 1.0 + spread(1, 1) / stiff];
        let solve = |v: [f64; 2]| [d * v[0] - b * v[1], a * v[1] - b * v[0]].map(|v| v / (a * d - b * b));
        let still = solve([r[1] - u[0] * r[0], r[2] - u[1] * r[0]]);
        let follows = solve(u);
        let columns = [0, 1].map(|k| solve([spread(0, k), spread(1, k)]));
        for (j, k) in rows.clone().enumerate() {
            e[k] = mu(cone, k) * still[j];
            if pushes(cone) {
                e[k] += mu(cone, k) * follows[j] * e[0];
                normal[k] = mu(cone, k) * follows[j] * diagonal[0];
            }
            if cone.frozen == 0 {
                diagonal[k] = mu(cone, k) * mu(cone, k) * columns[j][j];
            }
        }
        if cone.frozen == 0 && rows.len() == 2 {
            turn[usize::from(rows.start > 1)] = mu(cone, rows.start) * mu(cone, rows.start + 1) * columns[0][1];
        }
    }
    (Curvature::Limited { diagonal, normal, turn }, e)
}

/// The part of the step on which all inequalities hold; may be more than 1.
fn furthest(constraints: &[Constraint], inner: &[Interior]) -> f64 {
    let mut most = f64::INFINITY;
    for (c, inner) in constraints.iter().zip(inner) {
        let [n, dn] = limit(c);
        if pushes(&c.cone) {
            most = most.min(positive(n, dn)).min(positive(inner.y, inner.change_y));
        }
        for (i, rows, _) in groups(&c.cone) {
            let Group { motion, change, .. } = inner.groups[i];
            let (force, of_force) = (scaled(&c.cone, &c.force, &rows, n), scaled(&c.cone, &c.change, &rows, dn));
            most = most.min(within(force, of_force)).min(within(motion, change));
        }
    }
    most
}

/// The first α > 0 at which x + α δx is nothing.
fn positive(x: f64, change: f64) -> f64 {
    if change < 0.0 { -x / change } else { f64::INFINITY }
}

/// The first α > 0 at which u + α δu leaves the cone.
fn within(u: [f64; 3], change: [f64; 3]) -> f64 {
    let dot = |u: [f64; 3], v: [f64; 3]| u[0] * v[0] - u[1] * v[1] - u[2] * v[2];
    // a α² + 2 b α + c = 0
    let (a, b, c) = (dot(change, change), dot(u, change), determinant(u).max(0.0));
    let root = b * b - a * c;
    match root.sqrt() {
        _ if root < 0.0 => f64::INFINITY,
        root if b <= 0.0 => c / (root - b),
        root if a < 0.0 => -(b + root) / a,
        _ => f64::INFINITY,
    }
}

/// The mean of n y and n t + s·ζ, now and after a part of the step.
fn gaps(constraints: &[Constraint], inner: &[Interior], part: f64) -> (f64, f64) {
    let (mut now, mut then, mut count) = (0.0, 0.0, 0.0);
    let mut add = |u: [f64; 3], du: [f64; 3], v: [f64; 3], dv: [f64; 3]| {
        now += (0..3).map(|k| u[k] * v[k]).sum::<f64>();
        then += (0..3).map(|k| (u[k] + part * du[k]) * (v[k] + part * dv[k])).sum::<f64>();
        count += 1.0;
    };
    for (c, inner) in constraints.iter().zip(inner) {
        let [n, dn] = limit(c);
        if pushes(&c.cone) {
            add([n, 0.0, 0.0], [dn, 0.0, 0.0], [inner.y, 0.0, 0.0], [inner.change_y, 0.0, 0.0]);
        }
        for (i, rows, _) in groups(&c.cone) {
            let Group { motion, change, .. } = inner.groups[i];
            add(scaled(&c.cone, &c.force, &rows, n), scaled(&c.cone, &c.change, &rows, dn), motion, change);
        }
    }
    (now / count, then.max(0.0) / count)
}

/// Takes a part of the step.
fn advance(island: &mut Island, inner: &mut [Interior], part: f64) {
    let Island { w, p, constraints, .. } = island;
    w.iter_mut().zip(p).for_each(|(w, p)| *w += part * *p);
    for (c, inner) in constraints.iter_mut().zip(inner) {
        (0..c.cone.dim).for_each(|k| c.force[k] += part * c.change[k]);
        inner.y += part * inner.change_y;
        for Group { motion, change, .. } in &mut inner.groups {
            (0..3).for_each(|k| motion[k] += part * change[k]);
        }
    }
}

/// Nesterov and Todd's scaling W of two points of the cone, W² v = u:
///
///     W² = β² (2 m mᵀ − J),   W = β (2 a aᵀ − J),   J = diag(1, −1, −1),   a = (m + e₀)/√(2 (m₀ + 1))
///
/// with m between u and J v, each divided by the root of its determinant, and β² the root of the determinants' ratio.
#[derive(Clone, Copy, Debug)]
struct Scaling {
    /// β²
    square: f64,
    /// m
    mean: [f64; 3],
    /// a
    half: [f64; 3],
}

impl Scaling {
    fn new(u: [f64; 3], v: [f64; 3]) -> Scaling {
        let (du, dv) = (determinant(u).sqrt(), determinant(v).sqrt());
        let (u, v) = (u.map(|x| x / du), v.map(|x| x / dv));
        let over = 1.0 / (2.0 * (1.0 + u[0] * v[0] + u[1] * v[1] + u[2] * v[2])).sqrt();
        let [a, b] = [1, 2].map(|k| (u[k] - v[k]) * over);
        let mean = [(1.0 + a * a + b * b).sqrt(), a, b];
        let scale = 1.0 / (2.0 * (mean[0] + 1.0)).sqrt();
        Scaling { square: du / dv, mean, half: [(mean[0] + 1.0) * scale, a * scale, b * scale] }
    }

    /// W x
    fn times(&self, x: [f64; 3]) -> [f64; 3] {
        let (a, beta) = (self.half, self.square.sqrt());
        let dot = 2.0 * (a[0] * x[0] + a[1] * x[1] + a[2] * x[2]);
        [beta * (dot * a[0] - x[0]), beta * (dot * a[1] + x[1]), beta * (dot * a[2] + x[2])]
    }

    /// W⁻¹ x
    fn divide(&self, x: [f64; 3]) -> [f64; 3] {
        let (a, beta) = (self.half, self.square.sqrt());
        let dot = 2.0 * (a[0] * x[0] - a[1] * x[1] - a[2] * x[2]);
        [(dot * a[0] - x[0]) / beta, (x[1] - dot * a[1]) / beta, (x[2] - dot * a[2]) / beta]
    }
}

/// u₀² − |u₁|²
fn determinant(u: [f64; 3]) -> f64 {
    let length = norm([u[1], u[2]]);
    (u[0] - length) * (u[0] + length)
}

/// The product of the cone's algebra, u ∘ v = (u·v, u₀ v₁ + v₀ u₁).
fn product(u: [f64; 3], v: [f64; 3]) -> [f64; 3] {
    [u[0] * v[0] + u[1] * v[1] + u[2] * v[2], u[0] * v[1] + v[0] * u[1], u[0] * v[2] + v[0] * u[2]]
}

/// x with v ∘ x = u.
fn quotient(u: [f64; 3], v: [f64; 3]) -> [f64; 3] {
    let x = (v[0] * u[0] - v[1] * u[1] - v[2] * u[2]) / determinant(v);
    [x, (u[1] - v[1] * x) / v[0], (u[2] - v[2] * x) / v[0]]
}
