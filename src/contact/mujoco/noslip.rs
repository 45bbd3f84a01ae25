//! Friction once more, without its regularisation: MuJoCo's NoSlip solver, a pass of projected Gauss-Seidel behind
//! Newton's method.
//!
//!     min over f_j   ½ fᵀ A f + fᵀ b,     A = J M⁻¹ Jᵀ,   b = J a₀ − a_ref
//!
//! block by block, everything else held: dry friction of a joint or tendon within its largest force; of a pyramidal contact
//! each two edges n ± μⱼtⱼ, whose sum stays; of an elliptic contact all friction at once within the cone over the normal
//! force, Σ (fⱼ/μⱼ)² ≤ n². Normal forces, limits and equalities stay what they are. What results minimises nothing as a
//! whole: bodies no longer creep, and forces need not be those of any law.
//!
//! A sweep takes dry friction first, then contacts, in MuJoCo's order; sweeps end after `noslip_iterations`, or where one
//! improves the sum above by less than `noslip_tolerance` times the trace of M. The bounds on small numbers are MuJoCo's,
//! because the result of a sweep that has not converged depends on how it is taken.
//!
//! Source: MuJoCo 4.0 manual, Computation › Solver algorithms › NoSlip; order and bounds checked by running MuJoCo 4.0.0.

use crate::contact::Task;
use crate::contact::cost::Kind;
use crate::contact::island::{Island, Source};
use crate::math::MIN_VAL;

/// The least inverse mass of a row.
const LEAST: f64 = 1e-10;
/// A block that makes matters worse by more than this is taken back, m/s² N.
const WORSE: f64 = 1e-10;
/// Newton steps towards the edge of a cone, and the overshoot (N²) and the step at which they end.
const STEPS: usize = 20;
const NEAR: f64 = 1e-10;

type Block = [[f64; 5]; 5];

/// Sweeps over the friction of an island whose forces Newton's method has found.
///
/// Reads:  constraints evaluated at the minimum. Writes: their forces, w = Wᵀ f.
pub fn sweep(task: &Task, island: &mut Island) {
    let opt = &task.model.opt;
    let scale = 1.0 / island.trace_at_origin(task.model, task.data);
    island.push_forces();
    let mut improvement = 0.0;
    for c in &mut island.constraints {
        // The forces of a pyramid's edges, in place of what Newton's method no longer needs.
        let width = c.cone.width();
        if c.cone.kind == Kind::Pyramid {
            (0..width).for_each(|edge| c.y[edge] = -c.cone.d[0] * c.x[edge].min(0.0));
        } else {
            c.y[..6].copy_from_slice(&c.force);
        }
        // What the regularisation of all rows had cost.
        let d =
            |k: usize| if matches!(c.cone.kind, Kind::TwoSided | Kind::Ellipse) { c.cone.d[k] } else { c.cone.d[0] };
        improvement += (0..width).filter(|&k| c.y[k] != 0.0).map(|k| 0.5 * c.y[k] * c.y[k] / d(k)).sum::<f64>();
    }
    for _ in 0..opt.noslip_iterations {
        for of_joints in [true, false] {
            for i in 0..island.sources.len() {
                let joint = matches!(island.sources[i], Source::Joint(_));
                if island.constraints[i].cone.kind == Kind::Dry && joint == of_joints {
                    improvement += dry(island, i);
                }
            }
        }
        for i in 0..island.sources.len() {
            improvement += match island.constraints[i].cone.kind {
                Kind::Pyramid => pyramid(island, i),
                Kind::Ellipse => ellipse(island, i),
                _ => 0.0,
            };
        }
        if improvement * scale < opt.noslip_tolerance {
            break;
        }
        improvement = 0.0;
    }
}

/// Dry friction: f ← f − x/A, within the largest force. Out: the improvement.
fn dry(island: &mut Island, i: usize) -> f64 {
    let (x, a) = (island.acceleration(i)[0], island.block(i)[0][0].max(MIN_VAL));
    let c = &mut island.constraints[i];
    let loss = c.cone.mu[0];
    let force = (c.force[0] - x / a).clamp(-loss, loss);
    let change = force - c.force[0];
    c.force[0] = force;
    island.push_change(i, &[change, 0.0, 0.0, 0.0, 0.0, 0.0]);
    -(0.5 * change * change * a + change * x)
}

/// A pyramidal contact, two opposite edges after the others. Out: the improvement.
///
///     f± = m ± y,   m fixed:   y = −(m (A₊₊ − A₋₋) + b₊ − b₋) / (A₊₊ + A₋₋ − 2 A₊₋)   within ±m
fn pyramid(island: &mut Island, i: usize) -> f64 {
    let rows = island.block(i);
    let mut improvement = 0.0;
    for j in 1..island.constraints[i].cone.dim {
        let x = island.acceleration(i);
        let c = &mut island.constraints[i];
        let mu = c.cone.mu[j];
        let (square, cross) = (mu * mu * rows[j][j], mu * rows[0][j]);
        let a = [
            [(rows[0][0] + 2.0 * cross + square).max(LEAST), rows[0][0] - square],
            [rows[0][0] - square, (rows[0][0] - 2.0 * cross + square).max(LEAST)],
        ];
        let x = [x[0] + mu * x[j], x[0] - mu * x[j]];
        let old = [c.y[2 * j - 2], c.y[2 * j - 1]];
        let b: [f64; 2] = std::array::from_fn(|k| x[k] - a[k][0] * old[0] - a[k][1] * old[1]);
        let middle = 0.5 * (old[0] + old[1]);
        let curvature = a[0][0] + a[1][1] - a[0][1] - a[1][0];
        let y = if curvature < MIN_VAL {
            0.0
        } else {
            // Not `clamp`: where the forces are no numbers, the step says so.
            (-(middle * (a[0][0] - a[1][1]) + b[0] - b[1]) / curvature).max(-middle).min(middle)
        };
        let d = [middle + y - old[0], middle - y - old[1]];
        let cost = 0.5 * (d[0] * (a[0][0] * d[0] + a[0][1] * d[1]) + d[1] * (a[1][0] * d[0] + a[1][1] * d[1]))
            + (d[0] * x[0] + d[1] * x[1]);
        if cost > WORSE {
            continue;
        }
        improvement -= cost;
        (c.y[2 * j - 2], c.y[2 * j - 1]) = (middle + y, middle - y);
        let mut change = [0.0; 6];
        (change[0], change[j]) = (d[0] + d[1], mu * (d[0] - d[1]));
        (0..6).for_each(|k| c.force[k] += change[k]);
        island.push_change(i, &change);
    }
    improvement
}

/// The friction of an elliptic contact. Out: the improvement.
fn ellipse(island: &mut Island, i: usize) -> f64 {
    let (rows, x) = (island.block(i), island.acceleration(i));
    let c = &mut island.constraints[i];
    let n = c.cone.dim - 1;
    let mut a: Block = std::array::from_fn(|k| std::array::from_fn(|l| rows[k + 1][l + 1]));
    (0..n).for_each(|k| a[k][k] = a[k][k].max(LEAST));
    let product = |v: &[f64; 5]| -> [f64; 5] { std::array::from_fn(|k| (0..n).map(|l| a[k][l] * v[l]).sum()) };
    let old: [f64; 5] = std::array::from_fn(|k| c.force[k + 1]);
    let moved = product(&old);
    let b: [f64; 5] = std::array::from_fn(|k| x[k + 1] - moved[k]);
    let mu: [f64; 5] = std::array::from_fn(|k| c.cone.mu[k + 1]);
    let normal = c.force[0];
    let new = if normal < MIN_VAL { [0.0; 5] } else { within_cone(&a, &b, &mu, normal, n) };
    let d: [f64; 5] = std::array::from_fn(|k| if k < n { new[k] - old[k] } else { 0.0 });
    let bent = product(&d);
    let cost: f64 = (0..n).map(|k| d[k] * (0.5 * bent[k] + x[k + 1])).sum();
    if cost > WORSE {
        return 0.0;
    }
    c.force[1..=n].copy_from_slice(&new[..n]);
    let mut change = [0.0; 6];
    change[1..].copy_from_slice(&d);
    island.push_change(i, &change);
    -cost
}

/// argmin ½ fᵀ A f + fᵀ b within Σ (fₖ/μₖ)² ≤ n², by Newton's method on the multiplier λ:
///
///     v(λ) = −(Ã + λ)⁻¹ b̃,   Ãₖₗ = μₖ Aₖₗ μₗ,   b̃ₖ = μₖ bₖ,   fₖ = μₖ vₖ;    λ ← λ + (v² − n²) / (2 vᵀ (Ã + λ)⁻¹ v)
///
/// On the edge of the cone, f is drawn out to it. Where Ã is singular, there is none.
fn within_cone(a: &Block, b: &[f64; 5], mu: &[f64; 5], normal: f64, n: usize) -> [f64; 5] {
    let (mut lambda, mut v) = (0.0, [0.0; 5]);
    for _ in 0..STEPS {
        let mut l: Block = std::array::from_fn(|k| std::array::from_fn(|i| a[k][i] * mu[k] * mu[i]));
        (0..n).for_each(|k| l[k][k] += lambda);
        if !factor(&mut l, n) {
            return [0.0; 5];
        }
        v = divide(&l, std::array::from_fn(|k| -b[k] * mu[k]), n);
        let over = square(&v, n) - normal * normal;
        if over < NEAR {
            break;
        }
        let bent = divide(&l, v, n);
        let step = over / (2.0 * (0..n).map(|k| v[k] * bent[k]).sum::<f64>());
        if step < NEAR {
            break;
        }
        lambda += step;
    }
    // Small coefficients make small steps: they may end far outside.
    if lambda != 0.0 || square(&v, n) > normal * normal {
        let out = (normal * normal / square(&v, n).max(MIN_VAL)).sqrt();
        v.iter_mut().for_each(|v| *v *= out);
    }
    std::array::from_fn(|k| v[k] * mu[k])
}

fn square(v: &[f64; 5], n: usize) -> f64 {
    v[..n].iter().map(|v| v * v).sum()
}

/// L of L Lᵀ in place; says whether the matrix is positive definite.
fn factor(l: &mut Block, n: usize) -> bool {
    for j in 0..n {
        let pivot = l[j][j] - (0..j).map(|k| l[j][k] * l[j][k]).sum::<f64>();
        if pivot < LEAST {
            return false;
        }
        l[j][j] = pivot.sqrt();
        for i in j + 1..n {
            l[i][j] = (l[i][j] - (0..j).map(|k| l[i][k] * l[j][k]).sum::<f64>()) / l[j][j];
        }
    }
    true
}

/// (L Lᵀ)⁻¹ v
fn divide(l: &Block, mut v: [f64; 5], n: usize) -> [f64; 5] {
    for i in 0..n {
        v[i] = (v[i] - (0..i).map(|k| l[i][k] * v[k]).sum::<f64>()) / l[i][i];
    }
    for i in (0..n).rev() {
        v[i] = (v[i] - (i + 1..n).map(|k| l[k][i] * v[k]).sum::<f64>()) / l[i][i];
    }
    v
}
