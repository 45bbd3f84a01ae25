//! An integrator of one's own, outside the library: velocity Verlet.
//!
//!     q′ = q ⊕ h (v + ½ h a),   v′ = v + ½ h (a + a′),   a = a(q, v),   a′ = a(q′, v + h a)
//!
//! For forces that do not depend on velocity this is Störmer and Verlet's method: symplectic, of second order, stable up
//! to h ω = 2. Forces that do (dampers, friction, gyroscopic ones) are asked at a predicted velocity. Sensors and activations
//! of actuators are left out.
//!
//! To make it an integrator of the program, put its record into `src/integrate/` and into `integrate::ALL`.
//!
//! Source: L. Verlet, Physical Review 159 (1967), 98; the predicted velocity: R. D. Groot, P. B. Warren, Journal of
//! Chemical Physics 107 (1997), 4423, λ = 1.
//!
//!     cargo run --release --example own_integrator

#[path = "own/verlet.rs"]
mod verlet;

use penny::contact;
use penny::data::Data;
use penny::forward::{Method, step};
use penny::state::State;
use penny_lab::sweep::theory;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let spring = r#"<mujoco><option gravity="0 0 0"/><worldbody><body>
        <joint name="spring" type="slide" axis="1 0 0" stiffness="100"/>
        <geom size="0.1" mass="1" contype="0" conaffinity="0"/></body></worldbody></mujoco>"#;
    let model = penny::parse("spring.xml", spring).map_err(|failure| failure.to_string())?.model;
    let limit = theory::limit(&verlet::METHOD, &theory::joint_springs(&model)[0]).ok_or("no amplification")?;
    println!("{}: stable up to {limit:.4} s on a spring of 10 rad/s (2/ω = 0.2 s)", verlet::METHOD.name);
    for timestep in [0.02, 0.01, 0.005] {
        let method = Method {
            contact: contact::default(),
            integrator: &verlet::METHOD,
            timestep,
            rounds: penny::forward::ROUNDS,
        };
        let (mut state, mut data) = (State::new(&model), Data::new(&model));
        state.qpos[0] = 1.0;
        for _ in 0..(1.0 / timestep).round() as usize {
            step(&model, &method, &mut state, &mut data)?;
        }
        println!("h = {timestep}: error after 1 s {:.1e}", (state.qpos[0] - 10f64.cos()).abs());
    }
    Ok(())
}
