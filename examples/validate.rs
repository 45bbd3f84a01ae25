//! The validation table: closed forms, MuJoCo's error, and the error of each of Penny's contact laws.
//!
//!     cargo run --release --example validate

use penny::contact;
use penny::sweep::validation::Record;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let records: Vec<Record> = serde_json::from_str(include_str!("../tests/golden/validation.json"))?;
    print!("{:52} {:>12} {:>10}", "", "truth", "MuJoCo");
    for law in contact::ALL {
        print!(" {:>10}", law.name);
    }
    println!();
    for record in &records {
        let ready = record.ready()?;
        print!("{:52} {:12.6} {:10.1e}", record.name, record.exact, record.mujoco - record.exact);
        for law in contact::ALL {
            let method = ready.method(law).ok_or("unknown integrator")?;
            let exact = (ready.truth.exact)(&ready.case, &method).ok_or("the scene does not fit its closed form")?;
            if (exact - record.exact).abs() > 1e-9 * record.exact.abs() {
                print!("!!{exact}");
            }
            print!(" {:10.1e}", ready.value(&method) - exact);
        }
        println!();
    }
    Ok(())
}
