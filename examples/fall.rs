//! Loads a scene, steps it for a second, and prints where the body is: `cargo run --example fall`.

use penny::contact;
use penny::data::Data;
use penny::forward::{Method, step};
use penny::integrate;
use penny::state::State;

const SCENE: &str = r#"
<mujoco>
  <worldbody>
    <geom name="ground" type="plane" size="5 5 0.1"/>
    <body name="ball" pos="0 0 1">
      <freejoint/>
      <geom name="ball" type="sphere" size="0.1" solref="0.02 0.3"/>
    </body>
  </worldbody>
</mujoco>"#;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let model = penny::parse("scene.xml", SCENE)?.model;
    let method = Method {
        contact: contact::by_name("penalty").ok_or("no such law")?,
        integrator: integrate::by_name("semi-implicit-euler").ok_or("no such integrator")?,
        timestep: model.opt.timestep,
        rounds: penny::forward::ROUNDS,
    };
    let mut state = State::new(&model);
    let mut data = Data::new(&model);
    while state.time < 1.0 {
        for _ in 0..50 {
            step(&model, &method, &mut state, &mut data)?;
        }
        println!("{:.1} s: height {:.4} m, speed {:+.3} m/s", state.time, state.qpos[2], state.qvel[2]);
    }
    Ok(())
}
