//! Loads a scene from a string, steps it, pushes a crate, changes gravity and friction, reads forces by name, saves, and
//! goes two ways from there.

use penny::Simulation;

pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut sim = Simulation::from_xml(include_str!("../scene.xml"))?;
    sim.step_n(500)?;
    let [.., up] = sim.contact_force("crate", "ground")?;
    println!("the ground carries {up:.2} N of a crate of {} kg", sim.body("crate")?.mass());

    // The force acts at the crate's middle.
    let middle = sim.body("crate")?.center_of_mass();
    sim.push("crate", [15.0, 0.0, 0.0], middle)?;
    let here = sim.save();
    for friction in [1.0, 0.2] {
        sim.restore(&here)?;
        for geom in ["crate", "ground"] {
            sim.set_friction(geom, [friction, 0.005, 0.0001])?;
        }
        sim.step_n(250)?;
        println!("friction {friction}: {:+.3} m/s after half a second", sim.body("crate")?.velocity()[0]);
    }
    sim.restore(&here)?;
    sim.clear_forces();
    sim.set_gravity([0.0, 0.0, -1.62])?;
    sim.set_law("mujoco")?;
    sim.step_n(500)?;
    println!("on the moon it weighs {:.2} N", sim.body("crate")?.contact_force()[2]);
    Ok(())
}
