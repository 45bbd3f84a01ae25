//! The closed forms: what the penalty law makes of them, beside MuJoCo's recorded values.

use std::sync::LazyLock;

use penny::contact;
use penny::sweep::truth;
use penny::sweep::validation::Record;

static RECORDS: LazyLock<Vec<Record>> =
    LazyLock::new(|| serde_json::from_str(include_str!("../golden/validation.json")).expect("validation.json"));

/// Error of a law on a case, by the case's own integrator and timestep.
fn error(record: &Record, law: &str) -> f64 {
    let ready = record.ready().unwrap_or_else(|e| panic!("{}: {e}", record.name));
    let method = ready.method(contact::by_name(law).expect("law")).expect("integrator");
    (ready.value(&method) - record.exact).abs()
}

fn record(name: &str) -> &'static Record {
    RECORDS.iter().find(|r| r.name == name).unwrap_or_else(|| panic!("no case `{name}`"))
}

#[test]
fn formulas_agree_with_their_second_implementation() {
    assert!(RECORDS.len() >= 20);
    for record in &*RECORDS {
        let ready = record.ready().unwrap_or_else(|e| panic!("{}: {e}", record.name));
        let method = ready.method(contact::ALL[0]).expect("integrator");
        let exact = (ready.truth.exact)(&ready.case, &method).unwrap_or_else(|| panic!("{} does not fit", record.name));
        // Two formulas in other orders of operations: rounding, at most a hundred ulps.
        assert!((exact - record.exact).abs() <= 1e-12 * exact.abs(), "{}: {exact} {}", record.name, record.exact);
    }
}

#[test]
fn every_closed_form_has_a_case() {
    for truth in truth::ALL {
        assert!(RECORDS.iter().any(|r| r.truth == truth.name), "{} has none", truth.name);
    }
}

/// Cases in which the penalty law is farther from the truth than MuJoCo is. They stay in the table. In each, two errors
/// of MuJoCo's cancel in part, of which Penny has only the one that both share:
///
/// - Paths: semi-implicit Euler moves with the speed at the end of each step, h/2 times the change of speed too far.
///   Against the sum of such steps (`… by steps`) the law is ten times closer than MuJoCo, whose friction is too small.
/// - Share: the soft contacts let the block tilt by 1.3e-4 rad. MuJoCo's friction acts inside the overlap, 0.05 mm off.
const MISSES: &[&str] =
    &["block that slides at 35°: path", "block that stops: path", "block on 15°: share of the load downhill"];

#[test]
fn the_penalty_law_is_at_least_as_close_as_mujoco_but_for_the_known_misses() {
    let mut misses = Vec::new();
    for record in &*RECORDS {
        let theirs = (record.mujoco - record.exact).abs();
        // Equal but for rounding, which grows with the number of steps (up to 1e5).
        if !MISSES.contains(&record.name.as_str()) && error(record, "penalty") > theirs * (1.0 + 1e-6) + 1e-10 {
            misses.push(record.name.as_str());
        }
    }
    assert!(misses.is_empty(), "new misses: {misses:?}");
}

#[test]
fn the_penalty_law_is_ten_times_closer_where_mujoco_is_wrong() {
    for name in [
        "sphere: end of slip",
        "disk: end of slip",
        "hoop: end of slip",
        "block that sticks at 20°: speed",
        "rolling resistance, 0.0001 m",
        "block that slides at 35°: in contact",
        "block that slides at 35°: F_t/F_n",
        "block that slides at 35°: path by steps",
        "block that stops: path by steps",
        "SimBenchmark's rolling: velocity error squared",
    ] {
        let (ours, theirs) = (error(record(name), "penalty"), (record(name).mujoco - record(name).exact).abs());
        assert!(ours * 10.0 <= theirs, "{name}: {ours:e}, MuJoCo {theirs:e}");
    }
    // A creep of 1e-3 mm/s is what the issue of a sticking box allows.
    assert!(error(record("block that sticks at 20°: speed"), "penalty") <= 1e-6);
    // RaiSim reaches 4e-7 in its authors' benchmark.
    assert!(error(record("SimBenchmark's rolling: velocity error squared"), "penalty") <= 4e-7);
}

#[test]
fn the_mujoco_law_measures_what_mujoco_does() {
    for record in &*RECORDS {
        let mut ready = record.ready().unwrap_or_else(|e| panic!("{}: {e}", record.name));
        // As recorded.
        (ready.case.model.opt.tolerance, ready.case.model.opt.iterations) = (0.0, 100);
        let method = ready.method(contact::by_name("mujoco").expect("law")).expect("integrator");
        let value = ready.value(&method);
        let scale = record.mujoco.abs().max(record.exact.abs());
        assert!((value - record.mujoco).abs() <= 1e-6 * scale + 1e-9, "{}: {value} {}", record.name, record.mujoco);
    }
}
