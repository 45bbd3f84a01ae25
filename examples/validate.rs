//! The validation table: closed forms, how far MuJoCo is from each, and each of Penny's contact laws; and what a step
//! of each costs. MuJoCo's numbers are recorded (`tests/golden/generate.py validation`), Penny's are measured now.
//!
//!     cargo run --release --example validate

use penny::contact;
use penny_lab::plot::number;
use penny_lab::sweep::validation::{Ready, Record};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let records: Vec<Record> = serde_json::from_str(include_str!("../tests/golden/validation.json"))?;
    println!("{:52} {:>11}   {:^31}   {:^31}", "", "", "off by", "ns per step");
    print!("{:52} {:>11}", "closed form, in its unit", "truth");
    for _ in 0..2 {
        print!("   {:>10}", "MuJoCo");
        contact::ALL.iter().for_each(|law| print!(" {:>10}", law.name));
    }
    println!();
    for record in &records {
        let ready = record.ready()?;
        println!("{}", line(record, &ready)?);
    }
    println!("\nEach at the scene's own integrator and timestep. inf: the run diverged, or never came there.");
    Ok(())
}

fn line(record: &Record, ready: &Ready) -> Result<String, String> {
    let off = |value: f64| match (value - record.exact).abs() {
        error if error < 1e-13 => "0".to_owned(),
        error => number(error),
    };
    let mut errors = vec![off(record.mujoco)];
    let mut costs = vec![format!("{:.0}", record.measured_ns)];
    for law in contact::ALL {
        let method = ready.method(law).ok_or_else(|| format!("{}: unknown integrator", record.name))?;
        errors.push(off(ready.value(&method)));
        costs.push(format!("{:.0}", ready.cost(&method)));
    }
    let cells = |list: &[String]| list.iter().map(|cell| format!("{cell:>10}")).collect::<Vec<_>>().join(" ");
    Ok(format!("{:52} {:11.6}   {}   {}", record.name, record.exact, cells(&errors), cells(&costs)))
}
