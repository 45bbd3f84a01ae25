//! A body and all that hangs on it, as one system.

use super::motion::Motion;
use crate::data::Data;
use crate::dynamics::xipos;
use crate::kind::SensorKind;
use crate::math::{Vec3, mat};
use crate::model::Model;

/// Centre of mass (m), its velocity (m/s), angular momentum about it (kg m²/s). World axes.
///
///     c = Σ mᵢ xᵢ / m,   v = Σ mᵢ vᵢ / m,   L = Σ Rᵢ Iᵢ Rᵢᵀ ωᵢ + (xᵢ − c) × mᵢ (vᵢ − v)
pub fn measure(model: &Model, data: &Data, motion: &Motion, kind: SensorKind, root: usize, out: &mut [f64]) {
    let bodies = || root..end(model, root);
    let mass: f64 = bodies().map(|b| model.bodies[b].mass).sum();
    let mean = |of: &dyn Fn(usize) -> Vec3, without_mass: Vec3| {
        let sum: Vec3 = bodies().map(|b| model.bodies[b].mass * of(b)).sum();
        if mass > crate::math::MIN_VAL { sum / mass } else { without_mass }
    };
    let velocity = |b: usize| motion.velocity_at(b, &xipos(model, data, b));
    let com = || mean(&|b| xipos(model, data, b), xipos(model, data, root));
    // As in MuJoCo, what has no mass has no velocity.
    let vel = || mean(&|b| velocity(b).0, Vec3::zeros());
    let result = match kind {
        SensorKind::SubtreeCom => com(),
        SensorKind::SubtreeLinVel => vel(),
        _ => {
            let (com, vel) = (com(), vel());
            bodies()
                .map(|b| {
                    let body = &model.bodies[b];
                    let axes = data.xmat[b] * mat(&body.iquat);
                    let (v, w) = velocity(b);
                    let spin = axes * body.inertia.component_mul(&axes.tr_mul(&w));
                    spin + body.mass * (xipos(model, data, b) - com).cross(&(v - vel))
                })
                .sum()
        }
    };
    out.copy_from_slice(result.as_slice());
}

/// Bodies are numbered depth first: what hangs on one follows it.
fn end(model: &Model, root: usize) -> usize {
    let hangs = |&b: &usize| {
        let mut ancestor = b;
        while ancestor > root {
            ancestor = model.bodies[ancestor].parent;
        }
        ancestor == root
    };
    (root + 1..model.bodies.len()).take_while(hangs).last().map_or(root + 1, |last| last + 1)
}
