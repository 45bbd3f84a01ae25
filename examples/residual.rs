//! How well the default law's equations are solved: what is left of them in every step of every scene in models/, at a
//! quarter of the scene's timestep, at it, and at four times it.
//!
//!     cargo run --release --example residual

use std::error::Error;

use penny::contact;
use penny::data::Data;
use penny::forward::{Method, ROUNDS, step};
use penny::integrate;
use penny::state::State;

/// s
const TIME: f64 = 3.0;

fn main() -> Result<(), Box<dyn Error>> {
    let mut files: Vec<_> = std::fs::read_dir("models")?.map(|e| e.map(|e| e.path())).collect::<Result<_, _>>()?;
    files.sort();
    let (mut residuals, mut solves, mut most) = (Vec::new(), 0, 0);
    for file in files.iter().filter(|f| f.extension().is_some_and(|e| e == "xml")) {
        let text = std::fs::read_to_string(file)?;
        let model = penny::parse(&file.display().to_string(), &text).map_err(|e| e.to_string())?.model;
        let integrator = integrate::by_name(&model.opt.integrator).ok_or("an integrator that Penny does not have")?;
        for factor in [0.25, 1.0, 4.0] {
            let timestep = factor * model.opt.timestep;
            let method = Method { contact: contact::default(), integrator, timestep, rounds: ROUNDS };
            let (mut state, mut data) = (State::new(&model), Data::new(&model));
            while state.time < TIME {
                if let Err(diverged) = step(&model, &method, &mut state, &mut data) {
                    println!("{} at {timestep} s: {diverged}", file.display());
                    break;
                }
                if !data.contacts.is_empty() || !data.joint_rows.is_empty() {
                    residuals.push(data.solver.residual);
                    solves += data.counts.solves;
                    most = most.max(data.solver.iterations);
                }
            }
        }
    }
    residuals.sort_by(f64::total_cmp);
    let part = |share: f64| residuals[((residuals.len() - 1) as f64 * share) as usize];
    println!(
        "{} steps with contacts, {:.2} linear systems a step, at most {most} in an island",
        residuals.len(),
        solves as f64 / residuals.len() as f64
    );
    println!("residual: median {:.1e}, 99.9 % below {:.1e}, largest {:.1e}", part(0.5), part(0.999), part(1.0));
    Ok(())
}
