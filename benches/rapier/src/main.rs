//! A step of Penny beside one of rapier, on the same scenes, measured alternately on one core.
//!
//!     cargo run --release --manifest-path benches/rapier/Cargo.toml [-- SCENE.xml ...]
//!
//! Without files, the scenes of `penny bench`. rapier reads them with its own MJCF loader, keeps joints as multibodies, and takes
//! Penny's timestep; it computes in f32, with its default of four solver iterations, and nothing may fall asleep. Both measure the
//! second simulated second, in which most scenes have come to rest. What is told beside the times is how far each is from rest
//! and how deep the deepest contact is, since a quick answer may be a wrong one.

#[path = "../../../crates/cli/src/bench/scenes.rs"]
mod scenes;

use std::fmt;
use std::path::Path;
use std::time::Instant;

use penny::Simulation;
use penny::contact;
use penny::forward::Method;
use penny::model::Model;
use penny::state::State;
use rapier3d::prelude::*;
use rapier3d_mjcf::{MjcfLoaderOptions, MjcfMultibodyOptions, MjcfRobot};

/// A scene and how it starts, as [`scenes`] makes them.
struct Case {
    name: String,
    source: Source,
    model: Model,
    start: State,
}

enum Source {
    Text(String),
}

#[derive(Debug)]
enum Failure {
    Problem(String),
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Failure::Problem(why) = self;
        f.write_str(why)
    }
}

impl std::error::Error for Failure {}

/// From when on the steps are measured, and for how long: simulated time, s.
const WINDOW: [f64; 2] = [1.0, 2.0];
/// How often each is measured; the least counts.
const TIMES: usize = 5;

fn main() -> anyhow::Result<()> {
    let files: Vec<String> = std::env::args().skip(1).collect();
    let cases =
        if files.is_empty() { scenes::all()? } else { files.iter().map(|f| read(f)).collect::<Result<_, _>>()? };
    println!("| scene | law | Penny | rapier | times its speed | Penny: speed, depth | rapier: speed, depth |");
    println!("|---|---|---|---|---|---|---|");
    for case in &cases {
        for law in ["penalty", "mujoco"] {
            println!("{}", compare(case, law)?);
        }
    }
    Ok(())
}

fn read(file: &str) -> anyhow::Result<Case> {
    let text = std::fs::read_to_string(file)?;
    let scene = penny::load(Path::new(file)).map_err(|failure| anyhow::anyhow!("{failure}"))?;
    let start = State::new(&scene.model);
    Ok(Case { name: file.to_owned(), source: Source::Text(text), model: scene.model, start })
}

fn compare(case: &Case, law: &str) -> anyhow::Result<String> {
    let (mut own, mut other) = ([f64::INFINITY; 2], [[0.0; 2]; 2]);
    for _ in 0..TIMES {
        let mut penny = Penny::new(case, law);
        let mut rapier = Rapier::new(case)?;
        let steps = WINDOW.map(|time| (time / penny.0.method().timestep).round() as usize);
        for (i, engine) in [&mut penny as &mut dyn Engine, &mut rapier].into_iter().enumerate() {
            (0..steps[0]).for_each(|_| engine.step());
            let begun = Instant::now();
            (steps[0]..steps[1]).for_each(|_| engine.step());
            own[i] = own[i].min(begun.elapsed().as_secs_f64() / (steps[1] - steps[0]) as f64);
            other[i] = engine.state();
        }
    }
    let us = own.map(|seconds| format!("{:.2} µs", 1e6 * seconds));
    let state = other.map(|[speed, depth]| format!("{speed:.1e} m/s, {:.3} mm", 1e3 * depth));
    let [name, faster] = [case.name.clone(), format!("{:.2}", own[1] / own[0])];
    Ok(format!("| {name} | {law} | {} | {} | {faster} | {} | {} |", us[0], us[1], state[0], state[1]))
}

/// What is measured.
trait Engine {
    fn step(&mut self);
    /// Largest speed of a body, m/s, and depth of a contact, m.
    fn state(&mut self) -> [f64; 2];
}

struct Penny(Simulation);

impl Penny {
    fn new(case: &Case, law: &str) -> Penny {
        let mut method = Method::of(&case.model);
        method.contact = contact::by_name(law).expect("a law of the list");
        method.integrator = penny::integrate::by_name("semi-implicit-euler").expect("an integrator of the list");
        let mut sim = Simulation::new(case.model.clone(), method);
        *sim.state_mut() = case.start.clone();
        Penny(sim)
    }
}

impl Engine for Penny {
    fn step(&mut self) {
        self.0.step().expect("a step");
    }

    fn state(&mut self) -> [f64; 2] {
        let data = self.0.data();
        let speed = |m: &penny::data::Mover| (m.vel[0] * m.vel[0] + m.vel[1] * m.vel[1] + m.vel[2] * m.vel[2]).sqrt();
        let deepest = data.contacts.iter().fold(0.0, |deep: f64, c| deep.max(-c.dist));
        [data.movers.iter().map(speed).fold(0.0, f64::max), deepest]
    }
}

struct Rapier(PhysicsWorld);

impl Rapier {
    fn new(case: &Case) -> anyhow::Result<Rapier> {
        let Source::Text(text) = &case.source;
        let options = MjcfLoaderOptions { skip_plane_geoms: false, ..MjcfLoaderOptions::default() };
        let (robot, _) = MjcfRobot::from_str(text, options, ".")?;
        let mut world = PhysicsWorld::new();
        let PhysicsWorld { bodies, colliders, impulse_joints, multibody_joints, .. } = &mut world;
        let options = MjcfMultibodyOptions::default();
        robot.insert_using_multibody_joints(bodies, colliders, multibody_joints, impulse_joints, options);
        let g = case.model.opt.gravity;
        world.gravity = Vector::new(g.x as f32, g.y as f32, g.z as f32);
        world.integration_parameters.dt = case.model.opt.timestep as f32;
        let start: Vec<f32> = case.start.qvel.iter().map(|v| *v as f32).collect();
        let mut first = true;
        for (_, body) in world.bodies.iter_mut().filter(|(_, body)| body.is_dynamic()) {
            *body.activation_mut() = RigidBodyActivation::cannot_sleep();
            // Of all scenes with speed at the start only one body has it, and its frame is the world's.
            if std::mem::take(&mut first) && start.len() == 6 {
                body.set_linvel(Vector::new(start[0], start[1], start[2]), true);
                body.set_angvel(Vector::new(start[3], start[4], start[5]), true);
            }
        }
        Ok(Rapier(world))
    }
}

impl Engine for Rapier {
    fn step(&mut self) {
        self.0.step();
    }

    fn state(&mut self) -> [f64; 2] {
        let speed = self.0.bodies.iter().map(|(_, body)| body.linvel().length() as f64).fold(0.0, f64::max);
        let contacts = self.0.narrow_phase.contact_pairs().flat_map(|pair| pair.manifolds());
        let deepest = contacts.flat_map(|m| m.points.iter()).fold(0.0, |deep: f64, point| deep.max(-point.dist as f64));
        [speed, deepest]
    }
}
