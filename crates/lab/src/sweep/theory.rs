//! How large a timestep may be: the spectral radius of each integrator's map of a damped spring.
//!
//!     ẍ = −ω² x − 2 ζ ω ẋ,   (x, v) ← A(h) (x, v),   stable if no eigenvalue of A is beyond the unit circle
//!
//! Source: Hairer, Wanner, Solving Ordinary Differential Equations II, §IV.2.

use crate::explain;
use crate::names;
use penny::contact::describe::Ask;
use penny::forward::Method;
use penny::integrate::{DampedSpring, Dampers, Integrator, Matrix2};
use penny::model::Model;

/// A damped spring in a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Spring {
    /// rad/s
    pub omega: f64,
    /// Damping ratio.
    pub zeta: f64,
    /// Its damper is a joint's, which most integrators take implicitly; contacts' dampers are explicit.
    pub joint: bool,
    /// Its damper is mostly an actuator's velocity gain, which few integrators take implicitly.
    pub servo: bool,
    /// The damper acts on approach only, v < 0.
    pub approach_only: bool,
    /// "joint x", "contact of ball and ground"
    pub name: String,
}

impl Spring {
    fn damped(&self, integrator: &Integrator) -> DampedSpring {
        let joint = self.joint || (self.servo && integrator.implicit_dampers == Dampers::JointsAndActuators);
        DampedSpring { omega: self.omega, zeta: self.zeta, joint }
    }
}

/// By how much a step multiplies a displacement in the long run; `None` if the integrator gives no amplification.
///
/// A linear spring: the largest absolute eigenvalue of the step's map. Where the damper acts on approach only see
/// [`switched`].
pub fn radius(integrator: &Integrator, spring: &Spring, h: f64) -> Option<f64> {
    let map = |zeta: f64| integrator.amplification.map(|a| a(&DampedSpring { zeta, ..spring.damped(integrator) }, h));
    let damped = map(spring.zeta)?;
    if !spring.approach_only || spring.zeta == 0.0 {
        return Some(eigenvalue(&damped));
    }
    Some(switched(&damped, &map(0.0)?, integrator.implicit))
}

/// The largest absolute eigenvalue.
fn eigenvalue([[a, b], [c, d]]: &Matrix2) -> f64 {
    let (half, det) = (0.5 * (a + d), a * d - b * c);
    let square = half * half - det;
    if square > 0.0 { half.abs() + square.sqrt() } else { det.sqrt() }
}

/// Growth a step of a spring whose damper acts on approach only.
///
///     z ← A_c z  while v < 0 (approach),     z ← A_0 z  otherwise (rebound),     z = (x, v)
///
/// Both maps agree where v = 0, and a z twice as large goes the same way at twice the size. So what counts is the
/// growth over a whole cycle, approach and rebound; steps do not fit into cycles, so it is the mean over many:
///
///     ρ = (|z_n| / |z_m|)^(1/(n − m)),     m, n the first and last passage from rebound to approach
///
/// Sizes are measured so that A_0 alone changes them by the same factor in every step, √det A_0: |z|² = zᵀ Q z with
/// A_0ᵀ Q A_0 = det A_0 · Q, if A_0 turns (complex eigenvalues). A spring that never swings settles on a direction, and
/// ρ is the mean over its last steps.
///
/// For explicit Euler and small ζ: A_0 grows by √(1 + ω²h²) in all steps and the damper takes e^(−ζωh) in half of
/// them, so h = ζ/ω is the limit, half of that of a damper that acts both ways.
///
/// An implicit method takes the damper by the velocity at the end of its step. Where a step has several stages, the
/// velocity at its start decides here for all of them.
fn switched(damped: &Matrix2, free: &Matrix2, implicit: bool) -> f64 {
    // Written out: a build for development does not inline `map`, and there are millions of these.
    let apply = |[[a, b], [c, d]]: &Matrix2, [x, v]: [f64; 2]| [a * x + b * v, c * x + d * v];
    let [[a, b], [c, d]] = *free;
    // The invariant ellipse of A_0; a circle if it does not turn.
    let turns = (a - d) * (a - d) + 4.0 * b * c < 0.0;
    let q = if turns { [-c / b, (a - d) / b] } else { [1.0, 0.0] };
    let size = |z: [f64; 2]| (q[0] * z[0] * z[0] + q[1] * z[0] * z[1] + z[1] * z[1]).sqrt();
    // In units of time in which x and v compare.
    let scale = q[0].sqrt().recip();
    let mut largest: f64 = 0.0;
    // At rest, displaced either way; the second only matters where the first never swings.
    for mut z in [[scale, 0.0], [-scale, 0.0]] {
        // Logarithm of the growth so far, and a factor on it that is kept apart for speed.
        let (mut log, mut factor) = (0.0, 1.0);
        let (mut passages, mut first, mut last) = (0, (0, 0.0), (0, 0.0));
        for i in 1..=MOST_STEPS {
            let mut next = apply(if z[1] < 0.0 { damped } else { free }, z);
            if implicit {
                let end = apply(damped, z);
                next = if end[1] < 0.0 { end } else { apply(free, z) };
            }
            let now = size(next);
            if now == 0.0 {
                break;
            }
            factor *= now;
            let passes = z[1] >= 0.0 && next[1] < 0.0;
            if passes || i == MOST_STEPS / 2 || i == MOST_STEPS || !(1e-100..1e100).contains(&factor) {
                log += f64::ln(factor);
                factor = 1.0;
            }
            let before = std::mem::replace(&mut z, [next[0] / now, next[1] / now]);
            if passes {
                last = (i, log);
                first = if passages == 0 { last } else { first };
                passages += 1;
            } else if passages == 0 && i == MOST_STEPS / 2 {
                // So far it does not swing: the mean from here on.
                first = (i, log);
            } else if passages < 2 && i == MOST_STEPS {
                last = (i, log);
            }
            if passages == CYCLES {
                break;
            }
            let still = (z[0] - before[0]).abs() <= 1e-15 * scale && (z[1] - before[1]).abs() <= 1e-15;
            if passages == 0 && still {
                // On a direction that it keeps.
                (first, last) = ((0, 0.0), (1, now.ln()));
                break;
            }
        }
        if last.0 > first.0 {
            largest = largest.max(f64::exp((last.1 - first.1) / (last.0 - first.0) as f64));
        }
        if passages == CYCLES {
            break;
        }
    }
    largest
}

/// Passages from rebound to approach that a mean is taken over, and steps at most: two cycles at h ω = 1e-4.
const CYCLES: usize = 32;
const MOST_STEPS: usize = 150_000;

/// Above this a map counts as growing: more than rounding.
pub const GROWS: f64 = 1.0 + 1e-12;

/// The largest timestep up to which the spring is stable: infinite if every one is, 0 if none is.
///
/// Out: s; `None` if the integrator gives no amplification.
pub fn limit(integrator: &Integrator, spring: &Spring) -> Option<f64> {
    let grows = |h: f64| radius(integrator, spring, h).map(|r| r > GROWS);
    // A hundredth of where a light or a heavy damper limits explicit methods, h ω = ζ and 1/ζ. Of a damper that acts both
    // ways a smaller one costs nothing.
    let light = if spring.approach_only { 1e-2 * spring.zeta.min(spring.zeta.recip()) } else { 0.0 };
    let (first, last) = (light.max(1e-4) / spring.omega, 1e4 / spring.omega);
    if grows(first)? {
        return Some(0.0);
    }
    let mut good = first;
    let mut bad = loop {
        let next = good * 1.05;
        if next > last {
            return Some(f64::INFINITY);
        }
        if grows(next)? {
            break next;
        }
        good = next;
    };
    while bad / good > 1.0 + 1e-9 {
        let middle = (good * bad).sqrt();
        if grows(middle)? { bad = middle } else { good = middle }
    }
    Some(good)
}

/// The largest stable timesteps of the springs of joints and tendons and of their limits, pressed hard, by name, s; infinite
/// where every one is stable.
pub fn limits(model: &Model, integrator: &Integrator) -> Vec<(String, f64)> {
    let mut found: Vec<(String, f64)> = Vec::new();
    let mut add = |at: &dyn Fn(f64) -> Option<Spring>| {
        let limit = limit_of_soft(integrator, at);
        found.extend(at(0.0).zip(limit).map(|(spring, limit)| (spring.name, limit)));
    };
    for spring in joint_springs(model) {
        add(&|_| Some(spring.clone()));
    }
    for joint in 0..model.joints.len() {
        add(&|h| joint_limit(model, joint, h));
    }
    for tendon in 0..model.tendons.len() {
        add(&|h| tendon_spring(model, tendon, h));
        add(&|h| tendon_limit(model, tendon, h));
    }
    found
}

/// [`limit`] of a spring that REFSAFE makes softer with longer steps, from what it is at each: infinite where it is softer
/// before it would be too stiff.
fn limit_of_soft(integrator: &Integrator, at: &dyn Fn(f64) -> Option<Spring>) -> Option<f64> {
    let hard = at(0.0)?;
    let found = limit(integrator, &hard)?;
    let holds = found.is_finite() && at(found).is_some_and(|spring| spring == hard);
    Some(if holds { found } else { f64::INFINITY })
}

/// The springs of a scene's joints, and of its contacts at rest as far as the law has a formula for them.
pub fn springs(model: &Model, method: &Method) -> Vec<Spring> {
    let mut found = joint_springs(model);
    for touch in explain::touches(model) {
        let name = |g: usize| names::geom(model, g);
        let ask = Ask { model, touch: &touch, timestep: method.timestep, slope: 0.0 };
        let description = (method.contact.describe)(&ask);
        let Some([rest, _]) = description.springs else { continue };
        found.push(Spring {
            omega: rest.omega(),
            zeta: rest.zeta(),
            joint: false,
            servo: false,
            approach_only: description.approach_only,
            name: format!("contact of {} and {}", name(touch.geom[0]), name(touch.geom[1])),
        });
    }
    found
}

/// The springs and dampers of slide and hinge joints, each with what its actuators add to it.
pub fn joint_springs(model: &Model) -> Vec<Spring> {
    let spring = |j: usize| {
        let coordinate = explain::joints::coordinate(model, j)?;
        let (k, c) = (coordinate.stiffness(), coordinate.damping());
        let servo = coordinate.servo_damping() > coordinate.joint_damping;
        let spring = damped(coordinate.mass, k, c, coordinate.name(model))?;
        (k > 0.0 || servo).then_some(Spring { joint: !servo, servo, ..spring })
    };
    (0..model.joints.len()).filter_map(spring).collect()
}

/// Integrators take the dampers of tendons as they take actuators'.
fn tendon_spring(model: &Model, index: usize, timestep: f64) -> Option<Spring> {
    let [spring, _] = explain::ties::tendon(model, index, timestep);
    Some(Spring { servo: true, ..of_tie(spring?)? })
}

fn tendon_limit(model: &Model, index: usize, timestep: f64) -> Option<Spring> {
    let [_, limit] = explain::ties::tendon(model, index, timestep);
    of_tie(limit?)
}

fn of_tie(tie: explain::ties::Tie) -> Option<Spring> {
    damped(tie.spring.mass, tie.spring.k, tie.spring.c, tie.name)
}

fn joint_limit(model: &Model, joint: usize, timestep: f64) -> Option<Spring> {
    let spring = explain::joints::limit_spring(model, joint, timestep)?;
    damped(spring.mass, spring.k, spring.c, format!("the limit of joint {}", names::joint(model, joint)))
}

/// A spring with an explicit damper; a damper alone as one with a spring so soft that it limits no step: where the damper
/// is explicit, h < 2 m/c (h ω = 3e-4); where it is implicit, what limits is beyond all that [`limit`] tries.
fn damped(mass: f64, k: f64, c: f64, name: String) -> Option<Spring> {
    let omega = if k > 0.0 { (k / mass).sqrt() } else { 1.5e-4 * c / mass };
    let zeta = c / (2.0 * mass * omega);
    (omega > 0.0).then_some(Spring { omega, zeta, joint: false, servo: false, approach_only: false, name })
}

#[cfg(test)]
mod tests {
    use super::*;
    use penny::integrate;

    fn spring(zeta: f64, joint: bool) -> Spring {
        Spring { omega: 50.0, zeta, joint, servo: false, approach_only: false, name: String::new() }
    }

    fn scaled(name: &str, zeta: f64, joint: bool) -> f64 {
        let integrator = integrate::by_name(name).unwrap_or_else(|| panic!("{name}"));
        limit(integrator, &spring(zeta, joint)).unwrap_or_else(|| panic!("{name}")) * 50.0
    }

    #[test]
    fn limits_are_the_textbooks() {
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-6 * b, "{a} {b}");
        near(scaled("semi-implicit-euler", 0.0, true), 2.0);
        near(scaled("semi-implicit-euler", 0.2, false), 2.0 * (1.04f64.sqrt() - 0.2));
        // Implicit damping: (hω)² < 4 + 4 ζ h ω.
        near(scaled("implicitfast", 0.2, true), 2.0 * (1.04f64.sqrt() + 0.2));
        near(scaled("rk4", 0.0, true), 8f64.sqrt());
        near(scaled("explicit-euler", 0.2, true), 0.4);
        assert_eq!(scaled("explicit-euler", 0.0, true), 0.0);
        assert_eq!(scaled("implicit-euler", 0.0, true), f64::INFINITY);
    }

    /// A limit by theory, and where runs of the map with its switch, step by step, begin to grow.
    #[test]
    fn a_damper_on_approach_only_halves_explicit_eulers_limit() {
        let integrator = integrate::by_name("explicit-euler").expect("an integrator");
        for zeta in [0.01, 0.05, 0.2] {
            let spring = Spring { approach_only: true, ..spring(zeta, false) };
            let limit = limit(integrator, &spring).expect("a limit") * spring.omega;
            // ζ, up to the next order in ζ.
            assert!((limit / zeta - 1.0).abs() < 2.0 * zeta, "{zeta}: {limit}");
            let grows = |h: f64| {
                let (mut x, mut v) = (1.0, 0.0);
                let mut highest = [0.0; 2];
                for i in 0..200_000 {
                    let damping = if v < 0.0 { 2.0 * zeta * v } else { 0.0 };
                    (x, v) = (x + h * v, v - h * (x + damping));
                    let half = &mut highest[usize::from(i > 100_000)];
                    *half = f64::max(*half, x);
                }
                highest[1] > highest[0]
            };
            assert!(!grows(0.99 * limit) && grows(1.01 * limit), "{zeta}: {limit}");
        }
        // An undamped rebound alone neither grows nor shrinks under a symplectic method.
        let integrator = integrate::by_name("semi-implicit-euler").expect("an integrator");
        let spring = Spring { approach_only: true, ..spring(0.2, false) };
        let limit = limit(integrator, &spring).expect("a limit") * spring.omega;
        assert!(limit > 2.0 * (1.04f64.sqrt() - 0.2) && limit < 2.0, "{limit}");
    }

    #[test]
    fn an_integrator_without_amplification_has_no_limit_by_theory() {
        static UNKNOWN: Integrator = Integrator { amplification: None, ..integrate::rk4::METHOD };
        assert_eq!(limit(&UNKNOWN, &spring(0.1, true)), None);
    }
}
