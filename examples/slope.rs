//! Contact forces of a box on a slope: weight against normal and friction force, and how far the friction is from its
//! cone. `cargo run --example slope`
//!
//!     N = m g cos θ,   F = m g sin θ while it sticks, μ m g cos θ while it slides

use penny::Simulation;

fn scene(degrees: f64) -> String {
    format!(
        r#"<mujoco><option timestep="0.001" cone="elliptic"/><worldbody>
        <geom name="slope" type="plane" size="5 5 0.1" euler="0 {degrees} 0" friction="0.5 0.005 0.0001"/>
        <body name="box" euler="0 {degrees} 0" pos="{} 0 {}"><freejoint/>
          <geom name="box" type="box" size="0.1 0.1 0.05" mass="2" friction="0.5 0.005 0.0001"/></body>
        </worldbody></mujoco>"#,
        0.05 * degrees.to_radians().sin(),
        0.05 * degrees.to_radians().cos()
    )
}

/// Normal and friction force (N) of the box after half a second, and the part of the friction cone that it uses.
fn forces(degrees: f64) -> Result<[f64; 3], Box<dyn std::error::Error>> {
    let mut sim = Simulation::from_xml(&scene(degrees))?;
    sim.step_n(500)?;
    let [mut normal, mut friction] = [0.0; 2];
    let mut mu = 0.0;
    for touch in sim.contacts() {
        normal += touch.normal_force();
        friction += touch.friction_force();
        mu = touch.friction_coefficient();
    }
    Ok([normal, friction, friction / (mu * normal)])
}

pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("  slope   normal   m g cos θ   friction   m g sin θ   of the cone");
    for degrees in [0.0, 10.0, 20.0, 25.0, 30.0, 40.0] {
        let [normal, friction, used] = forces(degrees)?;
        let (sin, cos) = f64::to_radians(degrees).sin_cos();
        let weight = 2.0 * 9.81;
        let state = if used > 0.999 { "slides" } else { "sticks" };
        println!(
            "{degrees:6.0}° {normal:7.3} N {:9.3} N {friction:8.3} N {:9.3} N {:9.1} %  {state}",
            weight * cos,
            weight * sin,
            100.0 * used
        );
        assert!((normal - weight * cos).abs() < 1e-3 * weight, "the ground carries the box");
        let expected = (weight * sin).min(0.5 * weight * cos);
        assert!((friction - expected).abs() < 1e-3 * weight, "Coulomb's law");
    }
    Ok(())
}
