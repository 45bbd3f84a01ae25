use super::{Integrator, displace};
use crate::contact::forest::Forest;
use crate::data::Data;
use crate::forward::{Method, forward};
use crate::model::Model;
use crate::state::State;

pub const METHOD: Integrator = Integrator {
    name: "implicit-euler",
    mjcf: &[],
    order: 1,
    about: "all forces, contacts included, are those at the end of the step; Newton's method",
    implicit: true,
    advance,
};

/// Scratch of Newton's method.
#[derive(Clone, Debug, Default)]
pub struct Newton {
    /// The end of the step, as guessed.
    trial: Option<State>,
    /// Unknown velocity, residual, Newton step (nv each).
    v: Vec<f64>,
    residual: Vec<f64>,
    step: Vec<f64>,
    shifted: Vec<f64>,
    /// ∂g/∂v of one island, row-major.
    jacobian: Vec<f64>,
    islands: Islands,
}

/// Iterations before the best guess so far is taken. Smooth forces need three or four.
const MAX_ITERATIONS: usize = 30;
/// Residual at which the velocity counts as solved, relative to 1 m/s or the largest velocity.
const TOLERANCE: f64 = 1e-13;

/// Backward Euler: find the velocity v' at the end of the step with
///
///     g(v') = v' − v − h qacc(q ⊕ h v', v') = 0,     then  v ← v', q ← q ⊕ h v'
///
/// by Newton's method. The Jacobian ∂g/∂v' = 1 − h ∂qacc/∂v − h² ∂qacc/∂q contains everything that pushes:
/// contacts found where the step ends, springs, gyroscopic forces. It is taken by forward differences; dofs that
/// no contact couples are shifted at the same time. A step that does not reduce |g| is halved. Where a law jumps
/// (the course's sign(ω) at ω = 0) no v' may solve g = 0: then the best guess stands.
///
/// Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, §IV.8.
fn advance(model: &Model, method: &Method, state: &mut State, data: &mut Data) {
    let h = method.timestep;
    let mut newton = std::mem::take(&mut data.newton);
    let mut trial = newton.trial.take().unwrap_or_else(|| state.clone());
    trial.copy_from(state);
    trial.time += h;
    newton.v.clone_from(&state.qvel);
    let mut norm = residual(model, method, state, &newton.v, &mut trial, data, &mut newton.residual);
    let scale = 1.0 + largest(&state.qvel);
    for _ in 0..MAX_ITERATIONS {
        if norm <= TOLERANCE * scale {
            break;
        }
        newton.islands.find(model, data);
        differentiate(model, method, state, &mut newton, &mut trial, data);
        // Full step first, then shorter ones.
        let (mut share, mut improved) = (1.0, false);
        for _ in 0..8 {
            newton.shifted.clear();
            newton.shifted.extend(newton.v.iter().zip(&newton.step).map(|(v, dv)| v + share * dv));
            let next = residual(model, method, state, &newton.shifted, &mut trial, data, &mut newton.residual);
            if next < norm {
                std::mem::swap(&mut newton.v, &mut newton.shifted);
                (norm, improved) = (next, true);
                break;
            }
            share *= 0.5;
        }
        if !improved {
            break;
        }
    }
    // Once more at the answer, so that `data` shows the end of the step.
    residual(model, method, state, &newton.v, &mut trial, data, &mut newton.residual);
    state.remember(method, data);
    state.qvel.copy_from_slice(&trial.qvel);
    state.qpos.copy_from_slice(&trial.qpos);
    state.time += h;
    newton.trial = Some(trial);
    data.newton = newton;
}

/// g(v) = v − v₀ − h qacc(q₀ ⊕ h v, v); returns its largest element.
fn residual(
    model: &Model,
    method: &Method,
    start: &State,
    v: &[f64],
    trial: &mut State,
    data: &mut Data,
    g: &mut Vec<f64>,
) -> f64 {
    trial.qpos.copy_from_slice(&start.qpos);
    displace(model, &mut trial.qpos, v, method.timestep);
    trial.qvel.copy_from_slice(v);
    forward(model, method, trial, data);
    g.clear();
    g.extend((0..v.len()).map(|i| v[i] - start.qvel[i] - method.timestep * data.qacc[i]));
    largest(g)
}

/// The Newton step −(∂g/∂v)⁻¹ g, island by island.
fn differentiate(
    model: &Model,
    method: &Method,
    start: &State,
    newton: &mut Newton,
    trial: &mut State,
    data: &mut Data,
) {
    let Newton { v, residual: g, step, shifted, jacobian, islands, .. } = newton;
    jacobian.clear();
    jacobian.resize(islands.starts.windows(2).map(|w| (w[1] - w[0]) * (w[1] - w[0])).sum(), 0.0);
    let shift = |v: f64| 1e-7 * v.abs().max(1.0);
    for k in 0..islands.largest() {
        shifted.clone_from(v);
        for island in islands.iter().filter(|island| island.len() > k) {
            shifted[island[k]] += shift(v[island[k]]);
        }
        residual(model, method, start, shifted, trial, data, step);
        let mut block = 0;
        for island in islands.iter() {
            let n = island.len();
            if n > k {
                for (i, &dof) in island.iter().enumerate() {
                    jacobian[block + i * n + k] = (step[dof] - g[dof]) / shift(v[island[k]]);
                }
            }
            block += n * n;
        }
    }
    let mut block = 0;
    for island in islands.iter() {
        let n = island.len();
        shifted.clear();
        shifted.extend(island.iter().map(|&dof| -g[dof]));
        solve(&mut jacobian[block..block + n * n], shifted);
        for (&dof, x) in island.iter().zip(shifted.iter()) {
            step[dof] = *x;
        }
        block += n * n;
        data.counts.solves += 1;
    }
}

fn largest(x: &[f64]) -> f64 {
    // Not `f64::max`, which would hide a NaN.
    x.iter().fold(0.0, |most, x| if x.abs() <= most { most } else { x.abs() })
}

/// x ← A⁻¹ x by Gaussian elimination with row pivoting; A (row-major) is overwritten.
fn solve(a: &mut [f64], x: &mut [f64]) {
    let n = x.len();
    for k in 0..n {
        let pivot = (k..n).max_by(|&i, &j| a[i * n + k].abs().total_cmp(&a[j * n + k].abs())).unwrap_or(k);
        if pivot != k {
            (0..n).for_each(|j| a.swap(k * n + j, pivot * n + j));
            x.swap(k, pivot);
        }
        for i in k + 1..n {
            let factor = a[i * n + k] / a[k * n + k];
            if factor != 0.0 {
                (k + 1..n).for_each(|j| a[i * n + j] -= factor * a[k * n + j]);
                x[i] -= factor * x[k];
            }
        }
    }
    for i in (0..n).rev() {
        let sum: f64 = (i + 1..n).map(|j| a[i * n + j] * x[j]).sum();
        x[i] = (x[i] - sum) / a[i * n + i];
    }
}

/// The dofs that contacts couple, group by group.
#[derive(Clone, Debug, Default)]
struct Islands {
    forest: Forest,
    /// All trees, those of one island together.
    trees: Vec<usize>,
    dofs: Vec<usize>,
    /// Island i is `dofs[starts[i]..starts[i + 1]]`.
    starts: Vec<usize>,
}

impl Islands {
    fn find(&mut self, model: &Model, data: &Data) {
        let Islands { forest, trees, dofs, starts } = self;
        forest.reset(model.trees.len());
        for contact in &data.contacts {
            if let [Some(a), Some(b)] = contact.body.map(|b| model.bodies[b as usize].tree) {
                forest.join(a, b);
            }
        }
        trees.clear();
        trees.extend(0..model.trees.len());
        trees.sort_unstable_by_key(|&t| (forest.find(t), t));
        dofs.clear();
        starts.clear();
        for &t in trees.iter() {
            // The lowest tree of an island comes first.
            if forest.find(t) == t {
                starts.push(dofs.len());
            }
            dofs.extend(model.trees[t].dofs.clone());
        }
        starts.push(dofs.len());
    }

    fn iter(&self) -> impl Iterator<Item = &[usize]> {
        self.starts.windows(2).map(|w| &self.dofs[w[0]..w[1]])
    }

    fn largest(&self) -> usize {
        self.iter().map(<[usize]>::len).max().unwrap_or(0)
    }
}
