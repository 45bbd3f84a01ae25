//! The largest stable timestep, measured: a point on a contact's spring, with each law and integrator as they are.
//!
//! A formula would be another one for each integrator and law (`constants::semi_implicit_limit` is one). Instead a
//! small scene is simulated: one body that can only move along the normal, at rest on a plane with the contact's
//! parameters, displaced by a nanometre or less. If that displacement grows, the step is too large.

use penny::contact::constants::Spring;
use penny::contact::describe::{Ask, Touch};
use penny::data::Data;
use penny::dynamics;
use penny::forward::{Method, forward, step};
use penny::math::Vec3;
use penny::model::{Cone, Model, Parts};
use penny::state::State;

/// Timesteps above this are not tried, s.
pub const LARGEST: f64 = 1.0;
const STEPS: usize = 3000;
/// This many steps in a row near rest are enough.
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
    let scene = scene(model, touch, touch.lightest)?;
    let stable = |h: f64| stable(&scene, &Method { timestep: h, ..*method });
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

/// The springs that the contact may be: the law's own, or else the one that it shows when it is tried.
fn springs(model: &Model, method: &Method, touch: &Touch) -> Vec<Spring> {
    let ask = Ask { model, touch, timestep: method.timestep, slope: 0.0 };
    let description = (method.contact.describe)(&ask);
    let mass = |s: Spring| if description.each_point { touch.lightest } else { s.mass };
    match description.springs {
        Some(springs) => springs.map(|s| Spring { mass: mass(s), ..s }).to_vec(),
        None => {
            let shown = |m: Measured| Spring { mass: touch.lightest, ..m.spring };
            measure(model, method, touch).map(shown).into_iter().collect()
        }
    }
}

/// A body that can only move along the normal, on one contact point of the pair, and carries `mass` (kg). `None` if the
/// pair cannot be put so.
///
/// What a law derives from the pair's estimated inverse mass is as in the scene itself: A of the body here is
/// 1/`mass`, its estimate that of the whole pair. With `mass` = [`Touch::lightest`] the body is the stiffest way to
/// press on it; with [`Touch::share`] it rests as deep as the pair does.
fn scene(model: &Model, touch: &Touch, mass: f64) -> Option<Model> {
    let mix = &model.mixes[touch.mix];
    let cone = if model.opt.cone == Cone::Elliptic { "elliptic" } else { "pyramidal" };
    let join = |numbers: &[f64]| numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    let text = format!(
        r#"<mujoco>
          <option gravity="0 0 -{GRAVITY}" cone="{cone}" impratio="{}"><flag refsafe="{}"/></option>
          <default><geom condim="{}" friction="{}" solref="{}" solimp="{}"/></default>
          <worldbody>
            <geom type="plane" size="1 1 1"/>
            <body pos="0 0 0.01"><joint type="slide" axis="0 0 1"/><geom type="sphere" size="0.01" mass="1"/></body>
          </worldbody>
        </mujoco>"#,
        model.opt.impratio,
        if model.opt.flags.refsafe { "enable" } else { "disable" },
        mix.condim,
        join(&[mix.friction[0], mix.friction[2], mix.friction[3]]),
        join(&mix.solref),
        join(&mix.solimp),
    );
    let mut scene = penny::parse("probe.xml", &text).ok()?.model;
    // The reader knows no bodies as light as the end of a stick.
    let lighter = |m: &mut Parts| (m.bodies[1].mass, m.bodies[1].inertia) = (mass, m.bodies[1].inertia * mass);
    scene.edit(lighter).ok()?;
    let estimates = |m: &mut Parts| {
        m.bodies[1].invweight0 = [touch.estimate / touch.mass; 2];
        m.dofs[0].invweight0 = 1.0 / mass;
        m.tutorial = model.tutorial.clone();
    };
    scene.edit(estimates).ok()?;
    Some(scene)
}

/// What a law does with a contact, found by trying.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Of one contact point at rest with its share of the mass: k = ∂F/∂d, and c = −∂F/∂v for approach.
    pub spring: Spring,
    /// The damper acts on approach only: on the way out ∂F/∂v = 0.
    pub approach_only: bool,
    /// m
    pub rest_depth: f64,
    /// Share of the speed that is given back at [`IMPACT`], without weight.
    pub restitution: f64,
}

/// Speed of the impact of [`Measured::restitution`], m/s.
pub const IMPACT: f64 = 1.0;
/// Differences for slopes: relative to the depth at rest, and to the speed √(k/m) · depth.
const SMALL: f64 = 1e-4;
/// The step of an impact is halved until what comes back changes by less than this.
const SETTLED: f64 = 1e-4;

/// Tries the law of `method` on one point of the pair. `None` where it does not hold a weight.
pub fn measure(model: &Model, method: &Method, touch: &Touch) -> Option<Measured> {
    let mass = touch.share();
    let scene = scene(model, touch, mass)?;
    let (mut state, mut data) = (State::new(&scene), Data::new(&scene));
    let rest = rest(&scene, method, &mut state, &mut data);
    let depth = -rest;
    if !(depth > 0.0 && depth < 100.0) {
        return None;
    }
    let mut force = |depth: f64, v: f64| {
        (state.qpos[0], state.qvel[0]) = (-depth, v);
        forward(&scene, method, &state, &mut data);
        mass * (data.qacc[0] + GRAVITY)
    };
    let k = (force(depth * (1.0 + SMALL), 0.0) - force(depth * (1.0 - SMALL), 0.0)) / (2.0 * SMALL * depth);
    let v = SMALL * (k / mass).sqrt() * depth;
    let still = force(depth, 0.0);
    let [approach, rebound] = [-v, v].map(|v| (force(depth, v) - still) / -v);
    let spring = Spring { mass, k, c: approach.max(0.0) };
    let approach_only = rebound.abs() < 1e-3 * approach;
    Some(Measured { spring, approach_only, rest_depth: depth, restitution: impact(&scene, method, &spring)? })
}

/// Share of the speed [`IMPACT`] that comes back, in ever smaller steps.
fn impact(scene: &Model, method: &Method, spring: &Spring) -> Option<f64> {
    let mut weightless = scene.clone();
    weightless.edit(|m| m.opt.flags.gravity = false).ok()?;
    let bounce = |timestep: f64| {
        let method = Method { timestep, ..*method };
        let (mut state, mut data) = (State::new(scene), Data::new(&weightless));
        state.qvel[0] = -IMPACT;
        for _ in 0..MOST_OF_AN_IMPACT {
            step(&weightless, &method, &mut state, &mut data).ok()?;
            if state.qvel[0] > 0.0 && state.qpos[0] > 0.0 {
                return Some(state.qvel[0] / IMPACT);
            }
        }
        Some(0.0)
    };
    let mut timestep = 0.05 / spring.omega();
    let mut last = bounce(timestep);
    for _ in 0..10 {
        timestep *= 0.5;
        let next = bounce(timestep);
        match (last, next) {
            (Some(a), Some(b)) if (a - b).abs() < SETTLED => return next,
            _ => last = next,
        }
    }
    last
}

const MOST_OF_AN_IMPACT: usize = 200_000;

/// Rest that is none: a body hops on the ground for ever.
///
/// Inside the ground a spring ω holds the body at a depth r; outside, only the weight acts, a whole step at a time.
/// Whoever leaves the ground for n steps comes back with n g h less speed than it left with, whatever height it had:
///
///     v_in = n g h − u,   u = e v_in     ⇒   v_in = n g h / (1 + e),   depth up to about v_in/ω
///
/// with u the speed at which it leaves and e the restitution. To leave the ground again it must swing up by more than
/// r: so it hops for ever if e g h is more than about ω r, and settles if it is less. With K d r = g (1 − d)/d a soft
/// contact of MuJoCo's kind has ω r ≪ √(g r): it hops where r is below about g h², the fall of one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hop {
    /// Where the law holds the weight, m deep.
    pub rest: f64,
    /// What it does instead: m deep, from least (below 0 it is off the ground) to most.
    pub depth: [f64; 2],
    /// g h², m
    pub fall: f64,
}

/// Whether a body that is dropped on the pair's ground still hops after thousands of steps, under the law, integrator and timestep of `method`. `None` if it comes to rest.
pub fn hop(model: &Model, method: &Method, touch: &Touch) -> Option<Hop> {
    if !touch.rests || dynamics::gravity(model).norm() == 0.0 {
        return None;
    }
    let mut scene = scene(model, touch, touch.share())?;
    scene.edit(|m| m.opt.gravity = Vec3::new(0.0, 0.0, -dynamics::gravity(model).norm())).ok()?;
    let [rest, low, high] = settle(&scene, method)?;
    if low >= 0.0 || high - low <= 0.1 * rest {
        return None;
    }
    let fall = dynamics::gravity(model).norm() * method.timestep * method.timestep;
    Some(Hop { rest, depth: [low, high], fall })
}

/// The largest timestep by halving at which [`hop`] finds rest, s. `None` if none of those tried.
pub fn calm_timestep(model: &Model, method: &Method, touch: &Touch) -> Option<f64> {
    let smaller = (1..=HALVINGS).map(|n| method.timestep * 0.5f64.powi(n));
    smaller.into_iter().find(|&timestep| hop(model, &Method { timestep, ..*method }, touch).is_none())
}

/// Height that a body is dropped from, in falls g h² of one step: it comes in at 14 g h, and hops for several n.
const DROP: f64 = 100.0;
/// Steps in which a body has to come to rest; the last quarter is looked at.
const SETTLING: usize = 8000;
/// Timesteps tried below one at which it hops.
const HALVINGS: i32 = 8;

/// Depth at rest, and the least and the most depth at the end of a long run, m. `None` if the run diverges.
fn settle(scene: &Model, method: &Method) -> Option<[f64; 3]> {
    let (mut state, mut data) = (State::new(scene), Data::new(scene));
    let rest = -rest(scene, method, &mut state, &mut data);
    let mut state = State::new(scene);
    state.qpos[0] = DROP * dynamics::gravity(scene).norm() * method.timestep * method.timestep;
    let mut depth = [f64::INFINITY, f64::NEG_INFINITY];
    for i in 0..SETTLING {
        step(scene, method, &mut state, &mut data).ok()?;
        if 4 * i >= 3 * SETTLING {
            depth = [depth[0].min(-state.qpos[0]), depth[1].max(-state.qpos[0])];
        }
    }
    Some([rest, depth[0], depth[1]])
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
