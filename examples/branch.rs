//! Saves a state, and goes many ways from it: a ball is kicked at a wall in nine directions, the one that comes to rest
//! nearest to a mark is kicked again. `cargo run --example branch`

use penny::Simulation;
use penny::state::State;

const SCENE: &str = r#"
<mujoco>
  <worldbody>
    <geom name="floor" type="plane" size="5 5 0.1" condim="6" friction="0.8 0.005 0.02"/>
    <geom name="wall" type="box" pos="2 0 0.2" size="0.05 2 0.2"/>
    <body name="ball" pos="0 0 0.1">
      <freejoint/>
      <geom name="ball" type="sphere" size="0.1" mass="0.4" condim="6" friction="0.8 0.005 0.02"/>
    </body>
  </worldbody>
</mujoco>"#;

const MARK: [f64; 2] = [1.0, 2.8];

/// Where the ball is five seconds after a kick of 4 m/s.
fn kick(sim: &mut Simulation, from: &State, angle: f64) -> Result<[f64; 2], Box<dyn std::error::Error>> {
    sim.restore(from)?;
    (sim.state_mut().qvel[0], sim.state_mut().qvel[1]) = (4.0 * angle.cos(), 4.0 * angle.sin());
    sim.step_n(2500)?;
    let [x, y, _] = sim.body("ball")?.position();
    Ok([x, y])
}

pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut sim = Simulation::from_xml(SCENE)?;
    sim.step_n(500)?;
    // Kept as bytes, as in a file.
    let saved = sim.save().to_bytes();
    let from = State::from_bytes(&saved)?;
    let off = |at: &[f64; 2]| (at[0] - MARK[0]).hypot(at[1] - MARK[1]);
    let mut best = (f64::INFINITY, 0.0, [0.0; 2]);
    for i in 0..9 {
        let angle = f64::from(10 * i).to_radians();
        let at = kick(&mut sim, &from, angle)?;
        println!("{:3}°: rests at {:+.3}, {:+.3} m, {:.3} m off the mark", 10 * i, at[0], at[1], off(&at));
        if off(&at) < best.0 {
            best = (off(&at), angle, at);
        }
    }
    let again = kick(&mut sim, &from, best.1)?;
    println!("again {:.0}°: the same bits: {}", best.1.to_degrees(), again == best.2);
    assert_eq!(again, best.2, "the same state and the same steps have the same bits");
    Ok(())
}
