//! The largest stable timestep, measured: a point on a contact's spring, with each law and integrator as they are.
//!
//! A formula would be another one for each integrator and law (`constants::semi_implicit_limit` is one). Instead a
//! small scene is simulated: one body that can only move along the normal, at rest on a plane with the contact's
//! parameters, displaced by a nanometre or less. If that displacement grows, the step is too large.

use crate::contact::constants::Spring;
use crate::data::Data;
use crate::explain::Touch;
use crate::forward::{Method, forward, step};
use crate::model::{Cone, Model};
use crate::state::State;

/// Timesteps above this are not tried, s.
pub const LARGEST: f64 = 1.0;
const STEPS: usize = 3000;
/// So many steps in a row near rest are enough.
const CALM: usize = 30;
/// Semi-implicit Euler swings to 1/√(1 − (hω/2)²) of a displacement: ten times, half a percent below its limit.
const TRANSIENT: f64 = 20.0;
/// Factor between the halves of a run from which a displacement counts as growing.
const GROWS: f64 = 1.05;
/// m
const DISPLACEMENT: f64 = 1e-9;
/// Rest depth below which a contact counts as rigid, m.
const RIGID: f64 = 1e-12;
/// m/s²; the weight decides how deep it rests, and with it the impedance.
const GRAVITY: f64 = 9.81;

/// The largest timestep at which the pair alone, along its normal, does not shake itself apart under the law and
/// integrator of `method`; [`LARGEST`] where none of those tried is too large, 0 where every one is.
///
/// Out: s.
pub fn largest_timestep(model: &Model, method: &Method, touch: &Touch) -> Option<f64> {
    scene(model, method, touch)?;
    let stable = |h: f64| {
        let method = Method { timestep: h, ..*method };
        scene(model, &method, touch).is_some_and(|scene| stable(&scene, &method))
    };
    // REFSAFE softens contacts as the step grows, so stability can come back: look for the first step that fails.
    let mut good = certain(model, method, touch);
    if undamped(model, method, touch) && !stable(good) {
        return Some(0.0);
    }
    let mut bad = loop {
        let next = good * 1.25;
        if next >= LARGEST {
            return Some(LARGEST);
        }
        if !stable(next) {
            break next;
        }
        good = next;
    };
    while bad / good > 1.005 {
        let middle = (good * bad).sqrt();
        if stable(middle) { good = middle } else { bad = middle }
    }
    Some(good)
}

/// A timestep at which every integrator is stable that is stable at all: a small part of the time scales of spring and
/// damper, s. A spring without damper, or the other way round, has fewer of them.
fn certain(model: &Model, method: &Method, touch: &Touch) -> f64 {
    let scales = |s: &Spring| [1.0 / s.omega(), s.mass / s.c, s.c / s.k];
    let all = springs(model, method, touch).into_iter().flat_map(|s| scales(&s));
    all.filter(|s| s.is_finite() && *s > 0.0).fold(LARGEST, f64::min) * 0.02
}

fn undamped(model: &Model, method: &Method, touch: &Touch) -> bool {
    springs(model, method, touch).iter().any(|s| s.c == 0.0)
}

/// The springs that the contact may be.
fn springs(model: &Model, method: &Method, touch: &Touch) -> Vec<Spring> {
    if method.contact.name == "tutorial" {
        return vec![Spring { mass: touch.lightest, ..touch.tutorial_spring(model, method.timestep) }];
    }
    touch.springs(model, method.timestep).to_vec()
}

/// The body on its spring. `None` if the pair cannot be put so (nothing of it moves).
fn scene(model: &Model, method: &Method, touch: &Touch) -> Option<Model> {
    let mix = &model.mixes[touch.mix];
    // A body of 1 kg, whatever the true mass: only k/m and c/m count. The tutorial's k and c belong to each of the
    // points that together push the lightest part of the body; where solref gives them, they follow the timestep.
    let point = touch.tutorial_spring(model, method.timestep);
    let per_kilogram = |x: f64| Some(x / touch.lightest);
    let cone = if model.opt.cone == Cone::Elliptic { "elliptic" } else { "pyramidal" };
    let join = |numbers: &[f64]| numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    let numeric = |name: &str, value: Option<f64>| {
        value.map(|v| format!(r#"<numeric name="penny.{name}" data="{v}"/>"#)).unwrap_or_default()
    };
    let tutorial = &model.tutorial;
    let text = format!(
        r#"<mujoco>
          <option gravity="0 0 -{GRAVITY}" cone="{cone}" impratio="{}"><flag refsafe="{}"/></option>
          <custom>{}{}{}</custom>
          <default><geom condim="{}" friction="{}" solref="{}" solimp="{}"/></default>
          <worldbody>
            <geom type="plane" size="1 1 1"/>
            <body pos="0 0 0.01"><joint type="slide" axis="0 0 1"/><geom type="sphere" size="0.01" mass="1"/></body>
          </worldbody>
        </mujoco>"#,
        model.opt.impratio,
        if model.opt.flags.refsafe { "enable" } else { "disable" },
        numeric("k", per_kilogram(point.k)),
        numeric("c", per_kilogram(point.c)),
        numeric("alpha", tutorial.alpha),
        mix.condim,
        join(&[mix.friction[0], mix.friction[2], mix.friction[3]]),
        join(&mix.solref),
        join(&mix.solimp),
    );
    crate::parse("probe.xml", &text).ok().map(|scene| scene.model)
}

/// Whether a displacement from rest does not grow: neither far beyond its size, nor by [`GROWS`] from the first half
/// of the steps to the second.
///
/// A contact so rigid that it rests no deeper than [`RIGID`], or than a small part of a step's fall g h², cannot be
/// displaced within the contact: it leaves it and falls back. It is stable if it goes no higher than a few falls.
fn stable(scene: &Model, method: &Method) -> bool {
    let mut state = State::new(scene);
    let mut data = Data::new(scene);
    let rest = rest(scene, method, &mut state, &mut data);
    let fall = GRAVITY * method.timestep * method.timestep;
    let rigid = -rest < RIGID.max(1e-4 * fall);
    let (displacement, bound) = if rigid {
        (fall, 10.0 * fall.max(RIGID))
    } else {
        let small = DISPLACEMENT.min(-0.01 * rest);
        (small, TRANSIENT * small)
    };
    state.qpos[0] = rest + displacement;
    let (mut before, mut highest, mut calm) = (displacement, 0.0, 0);
    for i in 0..STEPS {
        if step(scene, method, &mut state, &mut data).is_err() {
            return false;
        }
        // Upwards only: a slow fall into the contact may be deep and is no sign of anything.
        let now = state.qpos[0] - rest;
        let most = if i < STEPS / 2 { &mut before } else { &mut highest };
        *most = f64::max(*most, now);
        calm = if now.abs() < 0.1 * displacement { calm + 1 } else { 0 };
        if calm == CALM {
            return true;
        }
        if now > 1e3 * bound {
            return false;
        }
    }
    highest < bound && (rigid || highest < GROWS * before)
}

/// Where the law holds the weight: qpos at which nothing accelerates, by bisection.
fn rest(scene: &Model, method: &Method, state: &mut State, data: &mut Data) -> f64 {
    let (mut low, mut high) = (-1e3, 0.0);
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return middle;
        }
        state.qpos[0] = middle;
        forward(scene, method, state, data);
        if data.qacc[0] > 0.0 { low = middle } else { high = middle }
    }
}
