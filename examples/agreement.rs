//! How far each contact law is from MuJoCo 4.0.0 in the scenes of tests/golden/penalty.json.
//!
//!     cargo run --release --example agreement
//!
//! A position is compared in all samples of the run, a velocity at its end.

use penny::contact;
use penny::data::Data;
use penny::forward::{Method, step};
use penny::integrate;
use penny::state::State;
use serde::Deserialize;

#[derive(Deserialize)]
struct Golden {
    rollouts: Vec<Rollout>,
}

#[derive(Deserialize)]
struct Rollout {
    name: String,
    xml: String,
    start: Vec<f64>,
    /// Steps between samples.
    every: usize,
    qpos: Vec<Vec<f64>>,
    qvel: Vec<Vec<f64>>,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let golden: Golden = serde_json::from_str(include_str!("../tests/golden/penalty.json"))?;
    print!("{:42}", "largest |Δqpos|, and |Δqvel| at the end");
    for law in contact::ALL {
        print!("{:>20}", law.name);
    }
    println!();
    for rollout in &golden.rollouts {
        print!("{:42}", rollout.name);
        for law in contact::ALL {
            let [position, velocity] = off(rollout, law)?;
            print!("{:>20}", format!("{position:.0e}  {velocity:.0e}"));
        }
        println!();
    }
    Ok(())
}

/// Differences from MuJoCo of position (m, rad) and velocity (m/s, rad/s).
fn off(rollout: &Rollout, law: &'static contact::Law) -> Result<[f64; 2], Box<dyn std::error::Error>> {
    let mut model = penny::parse("scene.xml", &rollout.xml)?.model;
    // As MuJoCo was run: to rounding.
    model.edit(|m| (m.opt.tolerance, m.opt.iterations) = (0.0, 100))?;
    let integrator = integrate::by_name(&model.opt.integrator).ok_or("no such integrator")?;
    let method = Method { contact: law, integrator, timestep: model.opt.timestep, rounds: penny::forward::ROUNDS };
    let (mut state, mut data) = (State::new(&model), Data::new(&model));
    if !rollout.start.is_empty() {
        state.qvel.copy_from_slice(&rollout.start);
    }
    let difference = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let mut position: f64 = 0.0;
    for qpos in &rollout.qpos[1..] {
        for _ in 0..rollout.every {
            step(&model, &method, &mut state, &mut data)?;
        }
        position = position.max(difference(&state.qpos, qpos));
    }
    let velocity = rollout.qvel.last().map_or(0.0, |qvel| difference(&state.qvel, qvel));
    Ok([position, velocity])
}
