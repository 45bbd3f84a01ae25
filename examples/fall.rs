//! A ball falls and bounces: a scene from a string, steps, and where the ball is. `cargo run --example fall`

use penny::Simulation;

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

pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut sim = Simulation::from_xml(SCENE)?;
    while sim.time() < 1.0 {
        sim.step_n(50)?;
        let ball = sim.body("ball")?;
        println!("{:.1} s: height {:.4} m, speed {:+.3} m/s", sim.time(), ball.position()[2], ball.velocity()[2]);
    }
    Ok(())
}
