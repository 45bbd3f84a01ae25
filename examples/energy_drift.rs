//! How well each integrator keeps the energy of a motion that should keep it: 20 s of a tumbling box and of a
//! pendulum. Both are written below, so that nothing but the integrator matters; the pendulum is quicker than that of
//! `models/pendulum.xml`, and turns over.
//!
//!     cargo run --release --example energy_drift

use penny::data::Data;
use penny::dynamics::energy::energy;
use penny::forward::{Method, step};
use penny::model::Model;
use penny::state::State;
use penny::{contact, integrate};

const BOX: &str = r#"<mujoco><option gravity="0 0 0"/><worldbody>
  <body><freejoint/><geom type="box" size="0.1 0.2 0.3"/></body></worldbody></mujoco>"#;
const PENDULUM: &str = r#"<mujoco><worldbody>
  <body><joint axis="0 1 0"/><geom type="capsule" size="0.03" fromto="0 0 0 0 0 -0.5"/></body></worldbody></mujoco>"#;

fn main() {
    let box_velocity: &[f64] = &[0.0, 0.0, 0.0, 0.2, 9.0, 0.1];
    let pendulum_velocity: &[f64] = &[7.0];
    // Nothing touches here: any contact law will do.
    let any_law = contact::ALL[0];
    println!("change of the total energy over 20 s, relative to the kinetic energy at the start\n");
    println!("{:22}{:>10}{:>16}{:>16}", "", "timestep", "tumbling box", "pendulum");
    for integrator in integrate::ALL {
        for timestep in [0.01, 0.002] {
            let drift = |xml, qvel| {
                let model = penny::parse("scene.xml", xml).expect("these scenes are fine").model;
                let method = Method { contact: any_law, integrator, timestep, rounds: penny::forward::ROUNDS };
                match drift(&model, &method, qvel) {
                    Some(drift) => format!("{drift:+.1e}"),
                    None => "diverged".to_owned(),
                }
            };
            let (tumbling, swinging) = (drift(BOX, box_velocity), drift(PENDULUM, pendulum_velocity));
            println!("{:22}{timestep:>10}{tumbling:>16}{swinging:>16}", integrator.name);
        }
    }
}

fn drift(model: &Model, method: &Method, qvel: &[f64]) -> Option<f64> {
    let (mut state, mut data) = (State::new(model), Data::new(model));
    state.qvel.copy_from_slice(qvel);
    let start = energy(model, &state, &mut data);
    for _ in 0..(20.0 / method.timestep).round() as usize {
        step(model, method, &mut state, &mut data).ok()?;
    }
    let end = energy(model, &state, &mut data);
    Some((end.kinetic + end.potential - start.kinetic - start.potential) / start.kinetic)
}
