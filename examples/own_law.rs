//! A contact law of one's own, outside the library: Hunt and Crossley's.
//!
//!     F = k d^1.5 (1 + c v)         N; d depth in m, v speed of approach in m/s; no tension: F ≥ 0
//!
//! The spring is Hertz's (two spheres), and the damper grows with the depth, so that the force begins at zero, unlike
//! that of a spring-damper. Little of the energy of a slow impact is lost: e ≈ 1 − (2/3) c v.
//! Friction is Coulomb's, −μ F tanh(α v_t), as in the `tutorial` law.
//!
//! To make it a law of the program, put this file into `src/contact/` and its record into `contact::ALL`.
//!
//! Source: K. H. Hunt, F. R. E. Crossley, Coefficient of restitution interpreted as damping in vibroimpact, Journal of
//! Applied Mechanics 42 (1975), 440–445; there λ = k c.
//!
//!     cargo run --release --example own_law

#[path = "own/hunt_crossley.rs"]
mod hunt_crossley;

use penny::contact::Law;
use penny::data::Data;
use penny::forward::{Method, step};
use penny::integrate;
use penny::state::State;
use penny_lab::explain;

/// The same law, from a record that says nothing of itself.
static SILENT: Law = Law { name: "silent", describe: penny::contact::describe::nothing, ..hunt_crossley::LAW };

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let ball = r#"<mujoco><worldbody><geom type="plane" size="1 1 1"/>
        <body pos="0 0 0.3"><freejoint/><geom size="0.1" mass="1"/></body></worldbody></mujoco>"#;
    let model = penny::parse("ball.xml", ball).map_err(|failure| failure.to_string())?.model;
    let integrator = integrate::by_name("semi-implicit-euler").ok_or("no such integrator")?;
    for contact in [&hunt_crossley::LAW, &SILENT] {
        let method = Method { contact, integrator, timestep: 1e-3, rounds: penny::forward::ROUNDS };
        let touch = explain::touches(&model).swap_remove(0);
        let meaning = explain::meaning(&model, &method, &touch, 0.1);
        println!(
            "{}: {}\n  formulas {:?}\n  measured {:?}",
            contact.name, contact.about, meaning.formulas, meaning.measured
        );
        let limit = explain::probe::largest_timestep(&model, &method, &touch);
        println!("  largest stable timestep at rest {:.4} s", limit.ok_or("nothing yields")?);
        let (mut state, mut data) = (State::new(&model), Data::new(&model));
        for _ in 0..5000 {
            step(&model, &method, &mut state, &mut data)?;
        }
        println!("  after 5 s the ball is {:.3} mm deep\n", 1e3 * (0.1 - state.qpos[2]));
    }
    Ok(())
}
