//! A scene under a method, for tests that only want to step it.

use penny::data::Data;
use penny::forward::{Method, step};
use penny::model::Model;
use penny::state::State;

pub struct Sim {
    pub model: Model,
    pub method: Method,
    pub state: State,
    pub data: Data,
}

impl Sim {
    /// The scene's own law and integrator.
    pub fn new(xml: &str) -> Sim {
        let model = penny::parse("test.xml", xml).unwrap_or_else(|failure| panic!("{failure}\n{xml}")).model;
        let law = model.contact_law().unwrap_or("penalty").to_owned();
        let integrator = model.opt.integrator.clone();
        Sim::with(model, &law, &integrator)
    }

    pub fn law(xml: &str, law: &str) -> Sim {
        let sim = Sim::new(xml);
        let integrator = sim.method.integrator.name;
        Sim::with(sim.model, law, integrator)
    }

    pub fn with(model: Model, law: &str, integrator: &str) -> Sim {
        let method = Method {
            contact: penny::contact::by_name(law).expect("law"),
            integrator: penny::integrate::by_name(integrator).expect("integrator"),
            timestep: model.opt.timestep,
            rounds: penny::forward::ROUNDS,
        };
        let (state, data) = (State::new(&model), Data::new(&model));
        Sim { model, method, state, data }
    }

    pub fn step(&mut self) {
        if let Err(diverged) = step(&self.model, &self.method, &mut self.state, &mut self.data) {
            panic!("{diverged:?}");
        }
    }

    pub fn run(&mut self, seconds: f64) {
        for _ in 0..(seconds / self.method.timestep).round() as usize {
            self.step();
        }
    }
}
