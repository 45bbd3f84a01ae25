//! A parameter study: how far a puck slides, for ten friction coefficients and each contact law, against the closed form.
//! `cargo run --example study`
//!
//!     s = v²/(2 μ g)

use penny::{Simulation, contact};

const SCENE: &str = r#"
<mujoco>
  <option timestep="0.001" cone="elliptic" impratio="100"/>
  <worldbody>
    <geom name="ice" type="plane" size="20 20 0.1" friction="0.01 0.005 0.0001"/>
    <body name="puck" pos="0 0 0.02">
      <freejoint/>
      <geom name="puck" type="box" size="0.1 0.1 0.02" mass="0.5"/>
    </body>
  </worldbody>
</mujoco>"#;

pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (v, g) = (2.0, 9.81);
    let names: Vec<String> = contact::ALL.iter().map(|law| format!("{:>10}", law.name)).collect();
    println!("    μ   v²/(2 μ g)  {}", names.join(" "));
    let mut sim = Simulation::from_xml(SCENE)?;
    // At rest on the ice, once for all.
    sim.step_n(1000)?;
    let rest = sim.save();
    for i in 1..=10 {
        let mu = 0.1 * f64::from(i);
        sim.set_friction("puck", [mu, 0.005, 0.0001])?;
        let exact = v * v / (2.0 * mu * g);
        print!("{mu:5.1} {exact:10.4} m");
        for law in contact::ALL {
            sim.restore(&rest)?;
            sim.set_law(law.name)?;
            sim.state_mut().qvel[0] = v;
            let start = sim.state().qpos[0];
            while sim.state().qvel[0] > 1e-3 {
                sim.step()?;
            }
            let slid = sim.state().qpos[0] - start;
            print!(" {slid:8.4} m");
            assert!((slid / exact - 1.0).abs() < 0.1, "{}: {slid} m at μ = {mu}", law.name);
        }
        println!();
    }
    Ok(())
}
