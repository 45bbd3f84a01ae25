//! Implicit Euler: v and q at the end of the step, with all forces taken there, contacts included.

use super::{DampedSpring, Integrator, Matrix2, displace};
use crate::collision;
use crate::contact::tangent::{self, Tangent};
use crate::data::Data;
use crate::dynamics::spatial::{ang, lin};
use crate::dynamics::{self, actuation, free};
use crate::forward::{Method, forward};
use crate::model::Model;
use crate::sensors;
use crate::state::State;

/// The record.
pub const METHOD: Integrator = Integrator {
    name: "implicit-euler",
    mjcf: &[],
    order: 1,
    about: "all forces, contacts included, are those at the end of the step; Newton's method",
    implicit: true,
    implicit_dampers: super::Dampers::JointsAndActuators,
    advance,
    amplification: Some(amplification),
    estimate: None,
};

/// (1 − h L)⁻¹,   L = [0, 1; −ω², −2ζω]
pub(super) fn amplification(s: &DampedSpring, h: f64) -> Matrix2 {
    let (k, c) = (h * h * s.stiffness(), h * s.damping());
    let det = 1.0 + c + k;
    [[(1.0 + c) / det, h / det], [-h * s.stiffness() / det, 1.0 / det]]
}

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
    /// (v' − v)/h (nv).
    a: Vec<f64>,
    /// By how much each velocity is shifted to differentiate smooth forces (nv).
    shifts: Vec<f64>,
    /// What a residual is measured by, a number a tree, √J.
    scales: Vec<f64>,
    /// M and 1 − h ∂qacc_smooth/∂v' of each tree, row-major, one after the other.
    inertia: Vec<f64>,
    smooth: Vec<f64>,
    tangent: Tangent,
    /// Evaluations of the residual in this step.
    evaluations: usize,
}

/// Evaluations of the residual at most in one step; few steps need ten. With the differences of smooth forces, one a
/// dof of the largest tree every [`REFRESH`] iterations, this bounds the work of a step.
const MAX_EVALUATIONS: usize = 60;
/// Newton steps for which the derivatives of smooth forces are good.
const REFRESH: usize = 8;
/// Residual at which the velocity counts as solved, relative to what a step changes of it (and to [`INERT`] of itself).
const TOLERANCE: f64 = 1e-12;
/// Residual up to which the last guess is as good as solved: rounding in stiff contacts leaves that much.
const GOOD_ENOUGH: f64 = 1e-5;
/// Part of the velocity that counts like a change of it: its rounding must stay below the tolerance.
const INERT: f64 = 1e-2;
/// A step is taken if it leaves no more than this share of the residual.
const LESS: f64 = 0.9;
/// Otherwise a shorter one is taken if the slope that is left along it is more than this share of that at its start.
const SHARE: f64 = 0.5;
/// Shift for differences, relative to what smooth forces change of the velocity in a step.
const SHIFT: f64 = 1e-5;
/// The same relative to the velocity itself: far above its rounding.
const LEAST_SHIFT: f64 = 1e-8;

/// Backward Euler: find the velocity v' at the end of the step with
///
///     g(v') = v' − v − h qacc(q ⊕ h v', v', a) = 0,   a = (v' − v)/h,     then  v ← v', q ← q ⊕ h v'
///
/// by Newton's method. Contact laws whose forces depend on the acceleration take a for it: at the solution it is the
/// acceleration, and nothing need be solved before ([`crate::contact::tangent`]). The Jacobian,
///
///     M ∂g/∂v' = M (1 − h ∂qacc_smooth/∂v') − h Jᵀ F J,     F = ∂f/∂(J v')
///
/// contains what springs, gyroscopic forces and the formula of every contact do with position and velocity at the end of
/// the step. How M and J turn with the position is left out: Newton's steps are exact but for h² f/r beside M.
///
/// M g is the gradient of an incremental potential (kinetic energy of v' − v, plus the potential energy at the end of
/// the step, plus h times what is dissipated), as far as forces have potentials. Friction and contacts that switch on
/// make it bend, and a full Newton step may jump from one side of the bend to the other for ever. So each step d is
/// shortened to where the slope dᵀ M g along it is nearly zero, unless the residual shrinks anyway: Coulomb friction,
/// which follows the normal force, has no potential. In this measure metres and radians, heavy and light compare.
///
/// Where no v' is found within [`MAX_EVALUATIONS`], since a force jumps, the step takes the forces at the last guess,
/// those that the law finds for it: v ← v + h qacc(q ⊕ h v', v'). Such steps are counted.
///
/// Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, §IV.8; incremental potential:
/// M. Ortiz, L. Stainier, The variational formulation of viscoplastic constitutive updates (1999).
pub(super) fn advance(model: &Model, method: &Method, state: &mut State, data: &mut Data) {
    let h = method.timestep;
    let mut newton = std::mem::take(data.scratch.get::<Newton>());
    let mut trial = newton.trial.take().unwrap_or_else(|| state.clone());
    trial.copy_from(state);
    trial.time += h;
    // Controls do not change in a step, so the activations at its end are known.
    actuation::rates(model, state, data);
    actuation::advance(model, &data.act_dot, h, &mut trial.act);
    data.timestep = h;
    dynamics::mocap(model, state, data);
    newton.v.clone_from(&state.qvel);
    newton.evaluations = 0;
    newton.evaluate(model, method, state, &mut trial, data, false);
    newton.measure(model, h, state, data);
    let mut size = newton.size(model, data);
    let mut iterations = 0;
    while size > TOLERANCE && newton.evaluations < MAX_EVALUATIONS {
        newton.direct(model, method, state, &mut trial, data, iterations % REFRESH == 0);
        if iterations == 0 {
            newton.measure_step(model, data);
        }
        iterations += 1;
        let Some(next) = newton.search(model, method, state, &mut trial, data) else {
            // `data` shows what was tried last.
            newton.evaluate(model, method, state, &mut trial, data, false);
            break;
        };
        let last = std::mem::replace(&mut size, next);
        // It no longer converges: rounding.
        if last <= GOOD_ENOUGH && next > 0.1 * last {
            break;
        }
    }
    // Also where it is NaN.
    let solved = size <= GOOD_ENOUGH;
    if !solved {
        data.unsolved += 1;
        displace_from(model, state, &newton.v, h, &mut trial);
        forward(model, method, &trial, data);
        for ((v, before), a) in newton.v.iter_mut().zip(&state.qvel).zip(&data.qacc) {
            *v = before + h * a;
        }
        displace_from(model, state, &newton.v, h, &mut trial);
    }
    sensors::sense(model, method.contact, &trial, data);
    state.remember(method.contact.start, data);
    state.qvel.copy_from_slice(&newton.v);
    state.qpos.copy_from_slice(&trial.qpos);
    state.act.copy_from_slice(&trial.act);
    state.time += h;
    newton.trial = Some(trial);
    *data.scratch.get() = newton;
}

/// q ⊕ h v and v, from the start of the step.
fn displace_from(model: &Model, start: &State, v: &[f64], h: f64, trial: &mut State) {
    trial.qpos.copy_from_slice(&start.qpos);
    displace(model, &mut trial.qpos, v, h);
    trial.qvel.copy_from_slice(v);
}

impl Newton {
    /// g(v), at `v` or at `shifted`.
    ///
    /// Writes: residual, and in `data` the end of the step.
    fn evaluate(
        &mut self,
        model: &Model,
        method: &Method,
        start: &State,
        trial: &mut State,
        data: &mut Data,
        shifted: bool,
    ) {
        let Newton { v, shifted: other, a, residual, evaluations, .. } = self;
        let (v, h) = (if shifted { &*other } else { &*v }, method.timestep);
        *evaluations += 1;
        data.counts.forwards += 1;
        displace_from(model, start, v, h, trial);
        a.clear();
        a.extend(v.iter().zip(&start.qvel).map(|(v, before)| (v - before) / h));
        dynamics::kinematics(model, &trial.qpos, data);
        collision::detect(model, data);
        dynamics::smooth(model, trial, data);
        tangent::constrain_at(model, &method.settings(), trial, a, data);
        residual.clear();
        residual.extend((0..v.len()).map(|i| v[i] - start.qvel[i] - h * data.qacc[i]));
    }

    /// Goes along the Newton step as far as it leads downhill. Out: the size of the residual there; `None` if nowhere.
    ///
    /// Reads and writes v and residual.
    fn search(
        &mut self,
        model: &Model,
        method: &Method,
        start: &State,
        trial: &mut State,
        data: &mut Data,
    ) -> Option<f64> {
        let slope = |newton: &Newton, data: &Data| product(model, data, &newton.step, &newton.residual);
        let before = self.size(model, data);
        let mut first = slope(self, data);
        let downhill = first < 0.0;
        if !downhill {
            // No way down: take the forces as they are.
            self.step.iter_mut().zip(&self.residual).for_each(|(d, g)| *d = -g);
            first = slope(self, data);
        }
        // The slope is negative at `low` and positive at `high`.
        let (mut low, mut high, mut higher) = ((0.0, first), (f64::INFINITY, 0.0), (f64::INFINITY, 0.0));
        let zero = |a: (f64, f64), b: (f64, f64)| a.0 - a.1 * (b.0 - a.0) / (b.1 - a.1);
        let mut share = 1.0;
        let mut i = 0;
        loop {
            self.shifted.clear();
            self.shifted.extend(self.v.iter().zip(&self.step).map(|(v, d)| v + share * d));
            self.evaluate(model, method, start, trial, data, true);
            let (now, size) = (slope(self, data), self.size(model, data));
            if size <= LESS * before {
                break;
            }
            // What was being tried may be far off; and what rounding leaves of a stiff contact no shorter step removes.
            if self.evaluations >= MAX_EVALUATIONS || before <= GOOD_ENOUGH {
                return None;
            }
            if now <= SHARE * first.abs() && (now >= SHARE * first || high.0.is_infinite()) {
                break;
            }
            if now < 0.0 {
                low = (share, now);
            } else {
                (higher, high) = (high, (share, now));
            }
            // By turns: where a straight line through both would end, half way, and where one through the last two beyond
            // the zero would, which finds it beside the kink of a contact that hardly gives way.
            share = match i % 3 {
                0 => zero(low, high),
                2 if higher.0.is_finite() => zero(high, higher),
                _ => 0.5 * (low.0 + high.0),
            };
            if !(share > low.0 && share < high.0) {
                share = 0.5 * (low.0 + high.0);
            }
            if !(share > low.0 && share < high.0) || high.0 - low.0 < 1e-15 {
                break;
            }
            i += 1;
        }
        let moved = self.shifted != self.v;
        std::mem::swap(&mut self.v, &mut self.shifted);
        moved.then(|| self.size(model, data))
    }

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
            scales.push(INERT * speed + smooth);
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

    /// Lets what the first Newton step changes count like velocity: contact forces at the first guess, which does not give
    /// way, are many times too large to be a measure.
    fn measure_step(&mut self, model: &Model, data: &Data) {
        for ((t, tree), scale) in model.trees.iter().enumerate().zip(&mut self.scales) {
            let step = &self.step[tree.dofs.clone()];
            *scale += INERT * product_of_tree(model, data, t, step, step).sqrt();
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

    /// The Newton step −(M ∂g/∂v)⁻¹ M g, island by island.
    ///
    /// Reads: v, residual, and in `data` the end of the step that belongs to them.
    fn direct(
        &mut self,
        model: &Model,
        method: &Method,
        start: &State,
        trial: &mut State,
        data: &mut Data,
        refresh: bool,
    ) {
        tangent::tangent(model, &method.settings(), trial, &self.a, data, &mut self.tangent);
        self.weigh(model, data);
        if refresh {
            self.differentiate_smooth(model, method, start, trial, data);
        }
        let Newton {
            residual: g,
            step,
            shifted: x,
            inertia,
            smooth,
            tangent: Tangent { dofs, starts, trees, blocks, .. },
            ..
        } = self;
        let squares = |t: usize| model.trees[..t].iter().map(|tree| tree.dofs.len().pow(2)).sum::<usize>();
        let mut block = 0;
        let mut trees = trees.iter().peekable();
        for w in starts.windows(2) {
            let (first, island) = (w[0], &dofs[w[0]..w[1]]);
            let n = island.len();
            let matrix = &mut blocks[block..block + n * n];
            x.clear();
            x.resize(n, 0.0);
            while let Some((t, at)) = trees.next_if(|(_, at)| *at < first + n) {
                let (dofs, place) = (model.trees[*t].dofs.clone(), at - first);
                let size = dofs.len();
                let m = &inertia[squares(*t)..][..size * size];
                let s = &smooth[squares(*t)..][..size * size];
                for i in 0..size {
                    for k in (0..size).filter(|k| m[i * size + k] != 0.0) {
                        let row = &mut matrix[(place + i) * n + place..][..size];
                        row.iter_mut().zip(&s[k * size..]).for_each(|(a, s)| *a += m[i * size + k] * s);
                        x[place + i] -= m[i * size + k] * g[dofs.start + k];
                    }
                }
            }
            solve(matrix, x);
            island.iter().zip(x.iter()).for_each(|(&dof, x)| step[dof] = *x);
            block += n * n;
            data.counts.solves += 1;
        }
    }

    /// M of all trees, into `inertia`.
    fn weigh(&mut self, model: &Model, data: &Data) {
        self.inertia.clear();
        for (t, tree) in model.trees.iter().enumerate() {
            let size = tree.dofs.len();
            if tree.free.is_none() {
                let at = self.inertia.len();
                self.inertia.resize(at + size * size, 0.0);
                dynamics::inertia::dense(model, data, t, &mut self.inertia[at..]);
                continue;
            }
            let unit = |i: usize| -> [f64; 6] { std::array::from_fn(|j| f64::from(i == j)) };
            let entries = (0..36).map(|k| product_of_tree(model, data, t, &unit(k / 6), &unit(k % 6)));
            self.inertia.extend(entries);
        }
    }

    /// 1 − h ∂qacc_smooth/∂v' of all trees at v, by forward differences: no contacts, all trees at the same time.
    ///
    /// Reads: qacc_smooth at v. `data` is then that of another velocity.
    fn differentiate_smooth(
        &mut self,
        model: &Model,
        method: &Method,
        start: &State,
        trial: &mut State,
        data: &mut Data,
    ) {
        let Newton { v, shifted, step: before, shifts, smooth, .. } = self;
        let h = method.timestep;
        before.clone_from(&data.qacc_smooth);
        smooth.clear();
        smooth.resize(model.trees.iter().map(|tree| tree.dofs.len().pow(2)).sum(), 0.0);
        for k in 0..model.trees.iter().map(|tree| tree.dofs.len()).max().unwrap_or(0) {
            shifted.clone_from(v);
            for tree in model.trees.iter().filter(|tree| k < tree.dofs.len()) {
                shifted[tree.dofs.start + k] += shifts[tree.dofs.start + k];
            }
            displace_from(model, start, shifted, h, trial);
            dynamics::kinematics(model, &trial.qpos, data);
            dynamics::smooth(model, trial, data);
            let mut at = 0;
            for tree in &model.trees {
                let (size, dofs) = (tree.dofs.len(), tree.dofs.clone());
                if k < size {
                    let shift = shifted[dofs.start + k] - v[dofs.start + k];
                    for (i, d) in dofs.enumerate() {
                        let slope = if shift == 0.0 { 0.0 } else { (data.qacc_smooth[d] - before[d]) / shift };
                        smooth[at + i * size + k] = f64::from(i == k) - h * slope;
                    }
                }
                at += size * size;
            }
        }
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
    let pattern = &data.plan.pattern;
    let mut sum = 0.0;
    for (k, row) in pattern.rows(&tree.dofs).iter().enumerate() {
        for (m, entry) in data.qm_rows[row.entries()].iter().zip(pattern.entries(row)) {
            let i = entry.column;
            sum += m * if i == k { x[k] * y[k] } else { x[k] * y[i] + x[i] * y[k] };
        }
    }
    sum
}

/// M_ii of dof i of a tree.
fn own_inertia(model: &Model, data: &Data, t: usize, i: usize) -> f64 {
    match &model.trees[t].free {
        Some(_) => {
            let mut unit = [0.0; 6];
            unit[i] = 1.0;
            product_of_tree(model, data, t, &unit, &unit)
        }
        None => data.qm_rows[data.plan.pattern.rows(&model.trees[t].dofs)[i].diagonal()],
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
