//! A controller that balances a pole on a cart: reads joints by name, writes a control, step by step.
//! `cargo run --example cart_pole`
//!
//!     F = 3.2 x + 5.5 v + 44 θ + 9 ω        N; x cart (m), θ pole from the upright (rad)
//!
//! The gains put all four poles of the linearised system into the left half-plane.

use penny::Simulation;

const SCENE: &str = r#"
<mujoco>
  <option timestep="0.002"/>
  <worldbody>
    <body name="cart">
      <joint name="rail" type="slide" axis="1 0 0"/>
      <geom type="box" size="0.15 0.1 0.05" mass="1"/>
      <body name="pole">
        <joint name="hinge" type="hinge" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 0 0 0.8" size="0.02" mass="0.2"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="motor" joint="rail"/></actuator>
</mujoco>"#;

pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut sim = Simulation::from_xml(SCENE)?;
    // The pole leans by 0.2 rad.
    sim.state_mut().qpos[1] = 0.2;
    let mut furthest = 0.0f64;
    while sim.time() < 12.0 {
        let [x, v, theta, omega] = {
            let (rail, hinge) = (sim.joint("rail")?, sim.joint("hinge")?);
            [rail.qpos()[0], rail.qvel()[0], hinge.qpos()[0], hinge.qvel()[0]]
        };
        furthest = furthest.max(x.abs());
        sim.set_ctrl("motor", 3.2 * x + 5.5 * v + 44.0 * theta + 9.0 * omega)?;
        if sim.state().time.rem_euclid(2.0) < 0.002 {
            println!("{:4.1} s: cart {x:+.4} m, pole {:+.3}°", sim.time(), theta.to_degrees());
        }
        sim.step()?;
    }
    let (x, theta) = (sim.joint("rail")?.qpos()[0], sim.joint("hinge")?.qpos()[0]);
    println!("the cart went {furthest:.2} m at most; at the end {x:+.5} m, {:+.5}°", theta.to_degrees());
    assert!(x.abs() < 0.01 && theta.abs() < 1e-3, "balanced");
    Ok(())
}
