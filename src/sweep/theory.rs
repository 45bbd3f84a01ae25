//! How large a timestep may be: the spectral radius of each integrator's map of a damped spring.
//!
//!     ẍ = −ω² x − 2 ζ ω ẋ,   (x, v) ← A(h) (x, v),   stable if no eigenvalue of A is beyond the unit circle
//!
//! Source: Hairer, Wanner, Solving Ordinary Differential Equations II, §IV.2.

use crate::explain;
use crate::forward::Method;
use crate::integrate::Integrator;
use crate::model::{JointKind, Model};

/// A damped spring in a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Spring {
    /// rad/s
    pub omega: f64,
    /// Damping ratio.
    pub zeta: f64,
    /// Its damper is a joint's, which most integrators take implicitly; contacts' dampers are explicit.
    pub joint: bool,
    /// "joint x", "contact of ball and ground"
    pub name: String,
}

/// The map of one step, row by row; `None` for an integrator that this module does not know.
///
///     explicit Euler            [1, h; −hω², 1 − 2ζωh]
///     semi-implicit Euler       v′ = (v − hω²x − e)/(1 + i), x′ = x + h v′, with e = 2ζωh v or i = 2ζωh
///     implicit Euler            (1 − h L)⁻¹,   L = [0, 1; −ω², −2ζω]
///     Runge–Kutta 4             1 + hL + (hL)²/2 + (hL)³/6 + (hL)⁴/24
fn map(integrator: &str, spring: &Spring, h: f64) -> Option<[[f64; 2]; 2]> {
    let (k, c) = (spring.omega * spring.omega, 2.0 * spring.zeta * spring.omega);
    Some(match integrator {
        "explicit-euler" => [[1.0, h], [-h * k, 1.0 - h * c]],
        "semi-implicit-euler" | "implicitfast" => {
            let (explicit, implicit) = if spring.joint { (0.0, h * c) } else { (h * c, 0.0) };
            let v = [-h * k / (1.0 + implicit), (1.0 - explicit) / (1.0 + implicit)];
            [[1.0 + h * v[0], h * v[1]], v]
        }
        "implicit-euler" => {
            let det = 1.0 + h * c + h * h * k;
            [[(1.0 + h * c) / det, h / det], [-h * k / det, 1.0 / det]]
        }
        "rk4" => {
            let l = [[0.0, h], [-h * k, -h * c]];
            let mut term = [[1.0, 0.0], [0.0, 1.0]];
            let mut sum = term;
            for n in 1..=4 {
                term = product(term, l).map(|row| row.map(|x| x / f64::from(n)));
                for (s, t) in sum.iter_mut().flatten().zip(term.iter().flatten()) {
                    *s += t;
                }
            }
            sum
        }
        _ => return None,
    })
}

fn product(a: [[f64; 2]; 2], b: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    a.map(|row| [row[0] * b[0][0] + row[1] * b[1][0], row[0] * b[0][1] + row[1] * b[1][1]])
}

/// The largest absolute eigenvalue of one step's map.
pub fn radius(integrator: &str, spring: &Spring, h: f64) -> Option<f64> {
    let [[a, b], [c, d]] = map(integrator, spring, h)?;
    let (half, det) = (0.5 * (a + d), a * d - b * c);
    let square = half * half - det;
    Some(if square > 0.0 { half.abs() + square.sqrt() } else { det.sqrt() })
}

/// Above this a map counts as growing: more than rounding.
const GROWS: f64 = 1.0 + 1e-12;

/// The largest timestep up to which the spring is stable: infinite if every one is, 0 if none is.
///
/// Out: s; `None` for an unknown integrator.
pub fn limit(integrator: &Integrator, spring: &Spring) -> Option<f64> {
    let grows = |h: f64| radius(integrator.name, spring, h).map(|r| r > GROWS);
    let (first, last) = (1e-4 / spring.omega, 1e4 / spring.omega);
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

/// The springs of a scene's joints and of its contacts at rest.
pub fn springs(model: &Model, method: &Method) -> Vec<Spring> {
    let mut found = joint_springs(model);
    for touch in explain::touches(model, method) {
        let name = |g: usize| match model.geoms[g].name.as_str() {
            "" => format!("geom {g}"),
            name => name.to_owned(),
        };
        let spring = match method.contact.name {
            "tutorial" => touch.tutorial_spring(model, method.timestep),
            _ => touch.springs(model, method.timestep)[0],
        };
        let name = format!("contact of {} and {}", name(touch.geom[0]), name(touch.geom[1]));
        found.push(Spring { omega: spring.omega(), zeta: spring.zeta(), joint: false, name });
    }
    found
}

/// The springs of slide and hinge joints, each with the inertia that it moves in `qpos0`, and of the dampers alone.
pub fn joint_springs(model: &Model) -> Vec<Spring> {
    let single = |j: &&crate::model::Joint| matches!(j.kind, JointKind::Slide | JointKind::Hinge) && j.stiffness > 0.0;
    let spring = |j: &crate::model::Joint| {
        let dof = &model.dofs[j.dofadr];
        let mass = 1.0 / dof.invweight0;
        let omega = (j.stiffness / mass).sqrt();
        let name = if j.name.is_empty() { format!("joint of body {}", j.body) } else { format!("joint {}", j.name) };
        Spring { omega, zeta: dof.damping / (2.0 * (j.stiffness * mass).sqrt()), joint: true, name }
    };
    model.joints.iter().filter(single).map(spring).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate;

    fn spring(zeta: f64, joint: bool) -> Spring {
        Spring { omega: 50.0, zeta, joint, name: String::new() }
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

    #[test]
    fn every_integrator_has_a_map() {
        for integrator in integrate::ALL {
            assert!(limit(integrator, &spring(0.1, true)).is_some(), "{}", integrator.name);
        }
    }
}
