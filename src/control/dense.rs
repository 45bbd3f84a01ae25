//! Where a run was inside a step: a polynomial through position, velocity and acceleration at both of its ends.
//!
//!     r(s) = the quintic with  r(0) = 0,  r'(0) = h v₀,  r''(0) = h² a₀,    r(1) = q₁ ⊖ q₀,  r'(1) = h v₁,  r''(1) = h² a₁
//!     q(s) = q₀ ⊕ r(s),   v(s) = r'(s)/h
//!
//! Of a rotation r is a rotation vector: the rates at its end are those of the vector, k = dexp⁻¹(r, ω) and its derivative,
//! and back ω = dexp(r, k). The error is of sixth order in the step, as a fifth-order method's own.
//!
//! Source: E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, §II.6.

use crate::data::Data;
use crate::forward::{Method, forward};
use crate::integrate::{dexp, dexp_inv, difference, displace};
use crate::math::vec3;
use crate::model::{JointKind, Model};
use crate::state::State;

/// The ends of a step: what the polynomials follow from.
#[derive(Clone, Debug, Default)]
pub struct Dense {
    /// From where to where, s; both 0 before the first.
    span: [f64; 2],
    /// r(1), and r' and r'' at 0 and at 1 (nv each).
    way: Vec<f64>,
    rates: [Vec<f64>; 2],
    bends: [Vec<f64>; 2],
    /// h times the rates of the activations (na).
    act: [Vec<f64>; 2],
    out: Vec<f64>,
}

impl Dense {
    /// Evaluates the accelerations at both ends of a step, unless they are known. Out: how many evaluations that took.
    pub fn enter(&mut self, model: &Model, method: &Method, ends: [&State; 2], data: &mut Data) -> usize {
        let span = ends.map(|end| end.time);
        if span == self.span {
            return 0;
        }
        self.span = span;
        let h = span[1] - span[0];
        self.way.resize(model.nv, 0.0);
        difference(model, &ends[1].qpos, &ends[0].qpos, &mut self.way);
        for (i, end) in ends.into_iter().enumerate() {
            forward(model, &Method { timestep: h, ..*method }, end, data);
            self.rates[i].clear();
            self.rates[i].extend(end.qvel.iter().map(|v| h * v));
            self.bends[i].clear();
            self.bends[i].extend(data.qacc.iter().map(|a| h * h * a));
            self.act[i].clear();
            self.act[i].extend(data.act_dot.iter().map(|rate| h * rate));
        }
        // The rates of a rotation's vector, and how they change: a difference over a small turn.
        for spin in spins(model) {
            let [r, omega, alpha] = [&self.way, &self.rates[1], &self.bends[1]].map(|x| vec3(&x[spin..]));
            let k = dexp_inv(&r, &omega);
            let part = SMALL / k.norm().max(SMALL);
            let ahead = dexp_inv(&(r + part * k), &(omega + part * alpha));
            let behind = dexp_inv(&(r - part * k), &(omega - part * alpha));
            self.rates[1][spin..spin + 3].copy_from_slice(k.as_slice());
            self.bends[1][spin..spin + 3].copy_from_slice(((ahead - behind) / (2.0 * part)).as_slice());
        }
        2
    }

    /// The state at a time inside the step, s; `state` is that at its beginning, and becomes it.
    pub fn at(&mut self, model: &Model, time: f64, end: &State, state: &mut State) {
        let h = self.span[1] - self.span[0];
        let s = (time - self.span[0]) / h;
        let numbers = |i: usize| [self.way[i], self.rates[0][i], self.rates[1][i], self.bends[0][i], self.bends[1][i]];
        self.out.clear();
        self.out.extend((0..model.nv).map(|i| quintic(s, numbers(i))[0]));
        state.qvel.iter_mut().enumerate().for_each(|(i, v)| *v = quintic(s, numbers(i))[1] / h);
        for spin in spins(model) {
            let omega = dexp(&vec3(&self.out[spin..]), &vec3(&state.qvel[spin..]));
            state.qvel[spin..spin + 3].copy_from_slice(omega.as_slice());
        }
        displace(model, &mut state.qpos, &self.out, 1.0);
        // Cubic: activations have no second derivative here.
        for (i, act) in state.act.iter_mut().enumerate() {
            let [d0, d1, way] = [self.act[0][i], self.act[1][i], end.act[i] - *act];
            *act += s * (d0 + s * (3.0 * way - 2.0 * d0 - d1 + s * (d0 + d1 - 2.0 * way)));
        }
        state.time = time;
    }
}

/// A turn over which rates are compared, rad.
const SMALL: f64 = 1e-4;

/// The first dof of each rotation in space.
fn spins(model: &Model) -> impl Iterator<Item = usize> + '_ {
    model.joints.iter().filter_map(|joint| match joint.kind {
        JointKind::Free => Some(joint.dofadr + 3),
        JointKind::Ball => Some(joint.dofadr),
        JointKind::Slide | JointKind::Hinge => None,
    })
}

/// r and r' at s, from r(1), r'(0), r'(1), r''(0), r''(1); r(0) = 0.
///
///     r = d₀ s + b₀ s²/2 + s³ (c₃ + c₄ s + c₅ s²)
fn quintic(s: f64, [way, d0, d1, b0, b1]: [f64; 5]) -> [f64; 2] {
    let [p, v, a] = [way - d0 - 0.5 * b0, d1 - d0 - b0, b1 - b0];
    let [c3, c4, c5] = [10.0 * p - 4.0 * v + 0.5 * a, -15.0 * p + 7.0 * v - a, 6.0 * p - 3.0 * v + 0.5 * a];
    let r = s * (d0 + s * (0.5 * b0 + s * (c3 + s * (c4 + s * c5))));
    [r, d0 + s * (b0 + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)))]
}
