//! Extremes: stiff and heavy things, falls, bounces without end, long runs. Prints the rows of docs/accuracy.md, "Long runs and
//! extremes".

use std::error::Error;

use penny::contact;
use penny::state::State;
use penny_lab::accuracy::{self, Choice, Refusal};
use penny_lab::explain::Budget;
use penny_lab::sweep::Case;
use penny_lab::sweep::trajectory::distance;

/// m; the last serves as the truth of the others.
const WANTED: [f64; 4] = [1e-2, 1e-4, 1e-6, 1e-8];
/// Real time of a search, s.
const SEARCH: f64 = 60.0;
const GROUND: &str = r#"<mujoco><worldbody><geom type="plane" size="1 1 1"/>"#;
const END: &str = "</worldbody></mujoco>";

pub fn print() -> Result<(), Box<dyn Error>> {
    for law in ["mujoco", "penalty"] {
        let ball = r#"<joint type="slide" axis="0 0 1"/><geom size="0.1""#;
        let fall = format!(
            r#"{GROUND}<body pos="0 0 100.1">{ball} mass="1" solref="-1e9 0" solimp="0.99 0.99 0.001"/></body>{END}"#
        );
        row("a fall from 100 m onto 1e9 N/m", law, &case(&fall, 9.0)?);
        let ground = GROUND.replace("/>", r#" solref="-1e6 -100"/>"#);
        let bounces =
            format!(r#"{ground}<body pos="0 0 0.6">{ball} mass="1" solref="-1e6 -100" condim="1"/></body>{END}"#);
        row("bounces that become shorter and shorter", law, &case(&bounces, 20.0)?);
        for mass in [1e3, 1e6] {
            let pile = format!(
                r#"{GROUND}<body pos="0 0 0.1">{ball} mass="1" condim="1"/></body><body pos="0 0 0.31">{ball}
                mass="{mass}" condim="1"/></body>{END}"#
            );
            row(&format!("1 kg under {mass} kg"), law, &case(&pile, 0.2)?);
        }
    }
    springs()?;
    let sleeping = r#"<mujoco><worldbody><body><joint type="ball"/><geom type="ellipsoid" size="0.1 0.1 0.05" pos="0 0 0.1"
        mass="1" contype="0" conaffinity="0"/></body></worldbody></mujoco>"#;
    let mut top = case(sleeping, 600.0)?;
    top.start.qvel.copy_from_slice(&[0.0, 0.0, 100.0]);
    row("a top that sleeps upright", "penalty", &top);
    let top = std::fs::read_to_string("models/top.xml")?;
    row("models/top.xml, ten minutes", "penalty", &case(&top, 600.0)?);
    Ok(())
}

fn case(text: &str, seconds: f64) -> Result<Case, Box<dyn Error>> {
    let model = penny::parse("extreme", text).map_err(|e| e.to_string())?.model;
    Ok(Case { start: State::new(&model), model, seconds })
}

fn choose(case: &Case, law: &str, wanted: f64) -> Option<Result<Choice, Refusal>> {
    Some(accuracy::choose(case, contact::by_name(law)?, wanted, &Budget::seconds(SEARCH)))
}

/// What each accuracy takes, and how far it is from the finest that is had.
fn row(name: &str, law: &str, case: &Case) {
    let all = WANTED.map(|wanted| choose(case, law, wanted));
    let finest = all.iter().rev().find_map(|found| found.as_ref()?.as_ref().ok());
    for (wanted, found) in WANTED.iter().zip(&all) {
        match found {
            Some(Ok(choice)) => {
                let apart = finest.and_then(|finest| distance(&case.model, &choice.samples, &finest.samples));
                let (apart, by) = (apart.unwrap_or(f64::NAN), choice.method.integrator.name);
                let [error, trial] = [format!("{:.1e}", choice.error), choice.trial.to_string()];
                println!(
                    "{name}, {law}, {wanted:.0e} m: {apart:.1e} m off, promised {error}, {trial} evaluations, {by}"
                );
            }
            Some(Err(refusal)) => println!("{name}, {law}, {wanted:.0e} m: refused after {}: {refusal}", refusal.trial),
            None => println!("{name}: no law {law}"),
        }
    }
}

/// A mass on springs of 1e-2 to 1e10 N/m: x = x₀ cos √(k/m) t.
fn springs() -> Result<(), Box<dyn Error>> {
    for wanted in &WANTED[..3] {
        let (mut worst, mut most, mut refused) = (0.0f64, 0, 0);
        for exponent in -2..=10 {
            let k = 10f64.powi(exponent);
            let seconds = (20.0 / k.sqrt()).min(1.0);
            let spring = format!(
                r#"<mujoco><option gravity="0 0 0"/><worldbody><body><joint type="slide" axis="1 0 0" stiffness="{k}"/>
                <geom size="0.1" mass="1" contype="0" conaffinity="0"/></body></worldbody></mujoco>"#
            );
            let mut case = case(&spring, seconds)?;
            case.start.qpos[0] = 0.1;
            match choose(&case, "penalty", *wanted) {
                Some(Ok(choice)) => {
                    worst = worst.max((choice.end.qpos[0] - 0.1 * (k.sqrt() * seconds).cos()).abs());
                    most = most.max(choice.trial);
                }
                _ => refused += 1,
            }
        }
        println!("springs, {wanted:.0e} m: {worst:.1e} m off at most, {most} evaluations at most, {refused} refused");
    }
    Ok(())
}
