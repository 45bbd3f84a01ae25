//! The law; see `own_law.rs`.

use penny::contact::constants::{self, Spring};
use penny::contact::describe::{Ask, Creep, Description, Unlike};
use penny::contact::island::Island;
use penny::contact::{Law, Lever, Task, pointwise};
use penny::data::Outcome;
use penny::data::Scratchpad;
use penny::state::Start;

pub static LAW: Law = Law {
    name: "hunt-crossley",
    about: "Hertz's spring with a damper that grows with depth: k d^1.5 (1 + c v)",
    joints: false,
    start: Start::Nothing,
    by_timestep: false,
    nearer: "",
    lever: Lever::Surface,
    solve,
    pose: None,
    shortcut: None,
    balls: None,
    friction: |_, mix| mix.friction,
    describe,
    unlike: Some(Unlike {
        normal: |_, _| "hunt-crossley is k d^1.5 (1 + c v), without solref and solimp".to_owned(),
        friction: "hunt-crossley's is −μ F tanh(α v), MuJoCo's a damper",
    }),
};

/// k, N/m^1.5: a ball of 1 kg rests 2.1 mm deep.
const STIFFNESS: f64 = 1e5;
/// c, s/m
const DAMPING: f64 = 0.3;
/// α, s/m
const ALPHA: f64 = 50.0;

fn solve(task: &Task, _: &mut Scratchpad, island: &mut Island) -> Outcome {
    pointwise::solve(task, island, |point| {
        let [v, slip_1, slip_2, ..] = point.velocity;
        let normal = (STIFFNESS * point.depth.powf(1.5) * (1.0 - DAMPING * v)).max(0.0);
        let slip = slip_1.hypot(slip_2).max(f64::MIN_POSITIVE);
        let friction = -point.mix.friction[0] * normal * (ALPHA * slip).tanh() / slip;
        [normal, friction * slip_1, friction * slip_2, 0.0, 0.0, 0.0]
    })
}

/// Small motions about rest, and creep.
///
///     depth at rest d₀ = (m g / k)^(2/3),   ∂F/∂d = 1.5 k √d₀,   ∂F/∂v = m g c
///
/// There is no one restitution: it depends on the speed.
fn describe(ask: &Ask) -> Description {
    let mass = ask.touch.share();
    let weight = mass * ask.gravity();
    let depth = (weight / STIFFNESS).powf(2.0 / 3.0);
    let spring = Spring { mass, k: 1.5 * STIFFNESS * depth.sqrt(), c: weight * DAMPING };
    let mu = ask.model.mixes[ask.touch.mix].friction[0];
    Description {
        springs: Some([spring; 2]),
        each_point: true,
        rest_depth: Some(depth),
        creep: Some(constants::tutorial_creep(mu, ALPHA, ask.slope).map_or(Creep::Slides, Creep::At)),
        ..Description::default()
    }
}
