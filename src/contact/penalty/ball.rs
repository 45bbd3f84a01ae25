//! A ball that touches one thing that never moves: the law's forces by formulas.
//!
//! Of a ball of mass m, radius R and moment of inertia I, whose centre is its centre of mass, a force along the normal n (into
//! the ball) turns nothing, one across it moves nothing along it, and a torque about n does neither. So the equations of
//! [`super`] fall apart. With a₀ and v of the ball's surface at the contact, α₀ and ω, accelerations without constraints, and h
//! the timestep, all in SI units:
//!
//!     N = max(0, (a_ref − n·a₀) / (R_n + 1/m))                                  R_n = (1 − d)/d A, softness
//!     τ = −n·(α₀ + ω/h) / (ε λ_w + 1/I)         within μ_spin N
//!     A f + B g = −s,   s = a₀ + v/h            |f| within μ N                  A = ε λ + 1/m + R²/I
//!     B f + C g = −r,   r = n × (α₀ + ω/h)      |g| within μ_roll N             B = R/I,  C = ε λ_w + 1/I
//!
//! f is friction across n, s and r what slides and rolls across n, and g = n × τ_roll. A force at its limit opposes its slip at the
//! end of the step instead of stopping it. A, B and C are numbers, not matrices: where one of the two forces is at its limit and
//! the other is not, eliminating the other leaves a slip of known direction. Where both are, they are found in turns (least squares
//! by blocks; each turn leaves at most B²/(A C) of the error, which is 1/(1 + I/(m R²))).
//!
//! Nothing is needed of the last step.

use super::{Coefficients, SLIP};
use crate::contact::Task;
use crate::contact::impedance::{impedance, regularisation};
use crate::contact::islands::Alone;
use crate::data::Contact;
use crate::dynamics::spatial::{ang, join, lin};
use crate::math::{Vec3, Vec6};
use crate::model::{Mix, Model};

/// Whether the formulas are for contacts of that mix: friction is the same in all directions.
pub fn has(model: &Model, mix: &Mix) -> bool {
    let [first, second, _, roll_1, roll_2] = mix.friction;
    first == second && (mix.condim < 6 || roll_1 == roll_2) && !model.opt.flags.diagexact
}

/// The acceleration of the ball's mover. Writes the contact's forces.
#[inline(always)]
pub fn push(task: &Task, own: &Coefficients, alone: &Alone, contact: &mut Contact) -> Vec6 {
    let Task { model, settings, data, .. } = *task;
    let mover = &data.movers[model.trees[alone.tree].bodies.start];
    let geom = &model.geoms[contact.geom[alone.side] as usize];
    let [weight, turned_weight] = model.bodies[geom.body].invweight0;
    let (per_mass, per_inertia, per_step) = (mover.minv[0], mover.minv[3], 1.0 / settings.timestep);
    let sign = if alone.side == 1 { 1.0 } else { -1.0 };
    let n = contact.frame.row(0).transpose() * sign;
    let radius = geom.size.x;
    let arm = n * -radius;

    let (w, alpha) = (mover.axes * ang(&mover.vel), mover.axes * ang(&mover.acc));
    let (v, a) = (lin(&mover.vel) + w.cross(&arm), lin(&mover.acc) + alpha.cross(&arm));
    let (v_n, a_n) = (n.dot(&v), n.dot(&a));

    let r = contact.dist - own.margin;
    let d = impedance(&own.solimp, r);
    let softness = regularisation(d, weight) * own.stiffening;
    let normal = ((own.spring.acceleration(d, r, v_n) - a_n) / (softness + per_mass)).max(0.0);
    contact.force[0] = normal;
    let (mut force, mut torque) = (n * normal, Vec3::zeros());
    let dim = model.mixes[contact.mix as usize].condim;
    if dim > 1 {
        let slip = a + v * per_step - n * (a_n + v_n * per_step);
        let met = weight + turned_weight * (contact.pos - mover.com).norm_squared();
        let stick = SLIP * met + per_mass + radius * radius * per_inertia;
        let turn = alpha + w * per_step;
        let limit = own.friction[0] * normal;
        let f = if dim < 6 {
            within(slip / -stick, limit)
        } else {
            let pair = Pair { a: stick, b: radius * per_inertia, c: SLIP * turned_weight + per_inertia };
            let (f, g) = pair.solve(&slip, &n.cross(&turn), limit, own.friction[3] * normal);
            let roll = g.cross(&n);
            (1..3).for_each(|k| contact.force[3 + k] = sign * contact.frame.row(k).transpose().dot(&roll));
            torque += roll;
            f
        };
        (1..3).for_each(|k| contact.force[k] = sign * contact.frame.row(k).transpose().dot(&f));
        force += f;
        torque += arm.cross(&f);
        if dim > 3 {
            let limit = own.friction[2] * normal;
            let spin = (-n.dot(&turn) / (SLIP * turned_weight + per_inertia)).max(-limit).min(limit);
            contact.force[3] = spin;
            torque += n * spin;
        }
    }
    mover.acc + join(&(force * per_mass), &(mover.axes.tr_mul(&torque) * per_inertia))
}

/// A force, shortened to its limit.
#[inline(always)]
fn within(force: Vec3, limit: f64) -> Vec3 {
    let square = force.norm_squared();
    if square > limit * limit { force * (limit / square.sqrt()) } else { force }
}

/// Two forces across the normal that meet the same mass: A f + B g = −s, B f + C g = −r.
struct Pair {
    a: f64,
    b: f64,
    c: f64,
}

impl Pair {
    /// f and g within their limits.
    fn solve(&self, s: &Vec3, r: &Vec3, f_limit: f64, g_limit: f64) -> (Vec3, Vec3) {
        let Pair { a, b, c } = *self;
        // What each does where the other, within its limit, stops what it opposes.
        let det = a * c - b * b;
        let (f_free, g_free) = ((r * b - s * c) / det, (s * b - r * a) / det);
        let (f, g) = (within(f_free, f_limit), within(g_free, g_limit));
        if f == f_free && g == g_free {
            return (f, g);
        }
        if f != f_free {
            let g = (r + f * b) / -c;
            if g.norm_squared() <= g_limit * g_limit {
                return (f, g);
            }
        }
        if g != g_free {
            let f = (s + g * b) / -a;
            if f.norm_squared() <= f_limit * f_limit {
                return (f, g);
            }
        }
        self.in_turns(s, r, g, f_limit, g_limit)
    }

    /// Each in turn, the other as it is, until they change no more.
    #[cold]
    fn in_turns(&self, s: &Vec3, r: &Vec3, mut g: Vec3, f_limit: f64, g_limit: f64) -> (Vec3, Vec3) {
        let Pair { a, b, c } = *self;
        let mut f = Vec3::zeros();
        for _ in 0..TURNS {
            let last = g;
            f = within((s + g * b) / -a, f_limit);
            g = within((r + f * b) / -c, g_limit);
            if (g - last).norm_squared() <= 1e-32 * g.norm_squared() {
                break;
            }
        }
        (f, g)
    }
}

/// Enough for 1e-17 where I is a tenth of m R², which [`Plan::balls`](crate::dynamics::plan::Plan::balls) asks for: 1.1⁻⁴¹⁰. In the random
/// scenes of tests/it/contact_forces.rs three quarters take five turns or fewer, 3 % more than ten, none more than thirty.
const TURNS: usize = 410;

#[cfg(test)]
mod tests {
    use super::*;

    /// Both stick, either slips, both slip, with slips in unlike directions: as in turns from nothing.
    #[test]
    fn pairs_of_forces_are_those_found_in_turns() {
        let mut seed = 1_u64;
        let mut number = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut kinds = [0; 4];
        for _ in 0..2000 {
            let spread = 0.1 + 0.9 * number();
            let (radius, per_mass) = (0.01 + number(), 0.1 + number());
            let per_inertia = per_mass / (spread * radius * radius);
            let pair = Pair { a: per_mass + radius * radius * per_inertia, b: radius * per_inertia, c: per_inertia };
            let mut across = |size: f64| Vec3::new(number() - 0.5, number() - 0.5, 0.0) * size;
            let (s, r) = (across(20.0), across(20.0 / radius));
            let limits = [10.0 * number() / per_mass, 10.0 * radius * number() / per_mass];
            let (f, g) = pair.solve(&s, &r, limits[0], limits[1]);
            let (f_turn, g_turn) = pair.in_turns(&s, &r, Vec3::zeros(), limits[0], limits[1]);
            let off = [(f - f_turn).norm() / limits[0], (g - g_turn).norm() / limits[1]];
            assert!(off.iter().all(|off| *off < 1e-12), "{off:?}");
            let at_limit = [(f, limits[0]), (g, limits[1])].map(|(f, limit)| usize::from(f.norm() > 0.999 * limit));
            kinds[2 * at_limit[0] + at_limit[1]] += 1;
        }
        assert!(kinds.iter().all(|kind| *kind > 50), "{kinds:?}");
    }
}
