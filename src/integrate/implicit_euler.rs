use super::{Integrator, displace};
use crate::contact::disjoint_sets::DisjointSets;
use crate::data::Data;
use crate::dynamics::free;
use crate::dynamics::spatial::{ang, lin};
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
    // (1 − h L)⁻¹,   L = [0, 1; −ω², −2ζω]
    amplification: Some(|s, h| {
        let (k, c) = (h * h * s.stiffness(), h * s.damping());
        let det = 1.0 + c + k;
        [[(1.0 + c) / det, h / det], [-h * s.stiffness() / det, 1.0 / det]]
    }),
};

/// Scratch of Newton's method.
#[derive(Clone, Debug, Default)]
struct Newton {
    /// The end of the step, as guessed.
    trial: Option<State>,
    /// Unknown velocity, residual, Newton step (nv each).
    v: Vec<f64>,
    residual: Vec<f64>,
    step: Vec<f64>,
    shifted: Vec<f64>,
    /// By how much each velocity is shifted to differentiate (nv).
    shifts: Vec<f64>,
    /// What a residual is measured by, a number a tree, √J.
    scales: Vec<f64>,
    /// ∂g/∂v of one island, row-major.
    jacobian: Vec<f64>,
    islands: Islands,
}

/// Newton steps at most. Smooth forces need three or four, each kink of friction about one more.
const MAX_ITERATIONS: usize = 40;
/// Evaluations at most of one line search: enough to halve a step down to rounding.
const MAX_TRIALS: usize = 50;
/// Residual at which the velocity counts as solved, relative to what a step changes of it (and to [`INERT`] of itself).
const TOLERANCE: f64 = 1e-12;
/// Residual up to which the last guess is as good as solved: rounding in stiff contacts leaves that much.
const GOOD_ENOUGH: f64 = 1e-5;
/// Part of the velocity that counts like a change of it: its rounding must stay below the tolerance.
const INERT: f64 = 1e-2;
/// A shorter step is taken if the slope that is left along it is more than this share of that at its start.
const SHARE: f64 = 0.5;
/// Shift for differences, relative to what smooth forces change of the velocity in a step: a hundredth of the widths
/// over which contact laws let their forces switch sign or on.
const SHIFT: f64 = 1e-5;
/// The same relative to the velocity itself: far above its rounding.
const LEAST_SHIFT: f64 = 1e-8;

/// Backward Euler: find the velocity v' at the end of the step with
///
///     g(v') = v' − v − h qacc(q ⊕ h v', v') = 0,     then  v ← v', q ← q ⊕ h v'
///
/// by Newton's method. The Jacobian ∂g/∂v' = 1 − h ∂qacc/∂v − h² ∂qacc/∂q contains everything that pushes:
/// contacts found where the step ends, springs, gyroscopic forces. It is taken by forward differences; dofs that
/// no contact couples are shifted at the same time.
///
/// M g is the gradient of an incremental potential (kinetic energy of v' − v, plus the potential energy at the end of
/// the step, plus h times what is dissipated), as far as forces have potentials. Friction and contacts that switch on
/// make it bend, and a full Newton step may jump from one side of the bend to the other for ever. So each step d is
/// shortened to where the slope dᵀ M g along it is nearly zero. In this measure metres and radians, heavy and light
/// compare.
///
/// Where no v' is found, since a force jumps, the step takes the forces at the last guess:
/// v ← v + h qacc(q ⊕ h v', v'). Such steps are counted.
///
/// Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, §IV.8; incremental potential:
/// M. Ortiz, L. Stainier, The variational formulation of viscoplastic constitutive updates (1999).
fn advance(model: &Model, method: &Method, state: &mut State, data: &mut Data) {
    let h = method.timestep;
    let mut newton = std::mem::take(data.scratch.get::<Newton>());
    let mut trial = newton.trial.take().unwrap_or_else(|| state.clone());
    trial.copy_from(state);
    trial.time += h;
    newton.v.clone_from(&state.qvel);
    residual(model, method, state, &newton.v, &mut trial, data, &mut newton.residual);
    newton.measure(model, h, state, data);
    let mut size = newton.size(model, data);
    for _ in 0..MAX_ITERATIONS {
        if size <= TOLERANCE {
            break;
        }
        newton.islands.find(model, data);
        differentiate(model, method, state, &mut newton, &mut trial, data);
        let Some(next) = search(model, method, state, &mut newton, &mut trial, data) else { break };
        let last = std::mem::replace(&mut size, next);
        // What rounding leaves of a stiff contact, or a contact solver's tolerance, no further step removes.
        if last <= GOOD_ENOUGH && next > 0.1 * last {
            break;
        }
    }
    // Once more at the answer, so that `data` shows the end of the step.
    residual(model, method, state, &newton.v, &mut trial, data, &mut newton.residual);
    let solved = newton.size(model, data) <= GOOD_ENOUGH;
    if !solved {
        data.unsolved += 1;
        for (v, g) in newton.v.iter_mut().zip(&newton.residual) {
            *v -= g;
        }
        trial.qpos.copy_from_slice(&state.qpos);
        displace(model, &mut trial.qpos, &newton.v, h);
    }
    state.remember(method.contact.start, data);
    state.qvel.copy_from_slice(&newton.v);
    state.qpos.copy_from_slice(&trial.qpos);
    state.time += h;
    newton.trial = Some(trial);
    *data.scratch.get() = newton;
}

/// Goes along the Newton step as far as it leads downhill. Out: the size of the residual there; `None` if nowhere.
///
/// Reads and writes v and residual.
fn search(
    model: &Model,
    method: &Method,
    start: &State,
    newton: &mut Newton,
    trial: &mut State,
    data: &mut Data,
) -> Option<f64> {
    let Newton { v, residual: g, step, shifted, .. } = newton;
    let slope = |g: &[f64], d: &[f64], data: &Data| product(model, data, d, g);
    let mut first = slope(g, step, data);
    let downhill = first < 0.0;
    if !downhill {
        // No way down: take the forces as they are.
        step.iter_mut().zip(g.iter()).for_each(|(d, g)| *d = -g);
        first = slope(g, step, data);
    }
    // The slope is negative at `low` and positive at `high`.
    let ((mut low, mut at_low), (mut high, mut at_high)) = ((0.0, first), (f64::INFINITY, 0.0));
    let mut share = 1.0;
    for i in 0..MAX_TRIALS {
        shifted.clear();
        shifted.extend(v.iter().zip(step.iter()).map(|(v, d)| v + share * d));
        residual(model, method, start, shifted, trial, data, g);
        let now = slope(g, step, data);
        if now <= SHARE * first.abs() && (now >= SHARE * first || high.is_infinite()) {
            break;
        }
        if now < 0.0 {
            (low, at_low) = (share, now)
        } else {
            (high, at_high) = (share, now)
        }
        // By turns where a straight line through both would end, and half way.
        share = if i % 2 == 0 { low - at_low * (high - low) / (at_high - at_low) } else { 0.5 * (low + high) };
        if !(share > low && share < high) || high - low < 1e-15 {
            break;
        }
    }
    let moved = shifted.iter().zip(v.iter()).any(|(a, b)| a != b);
    std::mem::swap(v, shifted);
    moved.then(|| newton.size(model, data))
}

/// g(v) = v − v₀ − h qacc(q₀ ⊕ h v, v).
fn residual(
    model: &Model,
    method: &Method,
    start: &State,
    v: &[f64],
    trial: &mut State,
    data: &mut Data,
    g: &mut Vec<f64>,
) {
    trial.qpos.copy_from_slice(&start.qpos);
    displace(model, &mut trial.qpos, v, method.timestep);
    trial.qvel.copy_from_slice(v);
    forward(model, method, trial, data);
    g.clear();
    g.extend((0..v.len()).map(|i| v[i] - start.qvel[i] - method.timestep * data.qacc[i]));
}

impl Newton {
    /// What is large and what is small in this step.
    ///
    /// Reads: the start of the step, accelerations at the first guess. Writes: shifts, scales.
    fn measure(&mut self, model: &Model, h: f64, start: &State, data: &Data) {
        let Newton { shifts, scales, .. } = self;
        let norm = |t: usize, x: &[f64]| product_of_tree(model, data, t, x, x).sqrt();
        shifts.clear();
        shifts.resize(model.nv, 0.0);
        scales.clear();
        for (t, tree) in model.trees.iter().enumerate() {
            let dofs = tree.dofs.clone();
            let speed = norm(t, &start.qvel[dofs.clone()]);
            let smooth = h * norm(t, &data.qacc_smooth[dofs.clone()]);
            scales.push(INERT * speed + smooth + h * norm(t, &data.qacc[dofs.clone()]));
            for i in 0..dofs.len() {
                shifts[dofs.start + i] = (SHIFT * smooth + LEAST_SHIFT * speed) / own_inertia(model, data, t, i).sqrt();
            }
        }
        // A tree at rest that nothing pushes yet may be hit by another.
        let all: f64 = scales.iter().sum();
        for (t, tree) in model.trees.iter().enumerate() {
            scales[t] += 1e-6 * all;
            for (i, d) in tree.dofs.clone().enumerate() {
                if shifts[d] == 0.0 {
                    shifts[d] = LEAST_SHIFT * scales[t] / own_inertia(model, data, t, i).sqrt();
                }
            }
        }
    }

    /// The largest residual of a tree, relative to its scale. NaN if there is one.
    fn size(&self, model: &Model, data: &Data) -> f64 {
        let of_tree = |(t, scale): (usize, &f64)| {
            let g = &self.residual[model.trees[t].dofs.clone()];
            let norm = product_of_tree(model, data, t, g, g).sqrt();
            if norm == 0.0 { 0.0 } else { norm / scale }
        };
        // Not `f64::max`, which would hide a NaN.
        self.scales.iter().enumerate().map(of_tree).fold(0.0, |most, x| if x <= most { most } else { x })
    }
}

/// xᵀ M y, J if both are velocities.
fn product(model: &Model, data: &Data, x: &[f64], y: &[f64]) -> f64 {
    let of_tree = |t: usize| {
        let dofs = model.trees[t].dofs.clone();
        product_of_tree(model, data, t, &x[dofs.clone()], &y[dofs])
    };
    (0..model.trees.len()).map(of_tree).sum()
}

/// The same for one tree, `x` and `y` holding its dofs.
fn product_of_tree(model: &Model, data: &Data, t: usize, x: &[f64], y: &[f64]) -> f64 {
    let tree = &model.trees[t];
    if let Some(free) = &tree.free {
        let xmat = &data.xmat[tree.bodies.start];
        let [a, b] = [x, y].map(|x| free::velocity(free, x, xmat));
        let turn = ang(&a).component_mul(&free.inertia).dot(&ang(&b));
        return free.mass * lin(&a).dot(&lin(&b)) + turn;
    }
    let rows = data.qm[data.m_adr[t]..].chunks_exact(x.len());
    rows.zip(x).map(|(row, x)| x * row.iter().zip(y).map(|(m, y)| m * y).sum::<f64>()).sum()
}

/// M_ii of dof i of a tree.
fn own_inertia(model: &Model, data: &Data, t: usize, i: usize) -> f64 {
    match &model.trees[t].free {
        Some(_) => {
            let mut unit = [0.0; 6];
            unit[i] = 1.0;
            product_of_tree(model, data, t, &unit, &unit)
        }
        None => data.qm[data.m_adr[t] + i * (model.trees[t].dofs.len() + 1)],
    }
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
    let Newton { v, residual: g, step, shifted, shifts, jacobian, islands, .. } = newton;
    jacobian.clear();
    jacobian.resize(islands.starts.windows(2).map(|w| (w[1] - w[0]) * (w[1] - w[0])).sum(), 0.0);
    for k in 0..islands.largest() {
        shifted.clone_from(v);
        for island in islands.iter().filter(|island| island.len() > k) {
            // The way it pushes.
            shifted[island[k]] -= shifts[island[k]].copysign(g[island[k]]);
        }
        residual(model, method, start, shifted, trial, data, step);
        let mut block = 0;
        for island in islands.iter() {
            let n = island.len();
            if n > k {
                for (i, &dof) in island.iter().enumerate() {
                    jacobian[block + i * n + k] = (step[dof] - g[dof]) / (shifted[island[k]] - v[island[k]]);
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
    sets: DisjointSets,
    /// All trees, those of one island together.
    trees: Vec<usize>,
    dofs: Vec<usize>,
    /// Island i is `dofs[starts[i]..starts[i + 1]]`.
    starts: Vec<usize>,
}

impl Islands {
    fn find(&mut self, model: &Model, data: &Data) {
        let Islands { sets, trees, dofs, starts } = self;
        sets.reset(model.trees.len());
        for contact in &data.contacts {
            if let [Some(a), Some(b)] = contact.body.map(|b| model.bodies[b as usize].tree) {
                sets.union(a, b);
            }
        }
        trees.clear();
        trees.extend(0..model.trees.len());
        trees.sort_unstable_by_key(|&t| (sets.find(t), t));
        dofs.clear();
        starts.clear();
        for &t in trees.iter() {
            // The lowest tree of an island comes first.
            if sets.find(t) == t {
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
