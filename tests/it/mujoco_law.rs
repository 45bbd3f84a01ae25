//! The `mujoco` contact law against MuJoCo 4.0.0 (tests/golden/mujoco_law.json), and against itself.

use std::fmt::Write;

use penny::contact::mujoco::{self, efc};
use penny::data::Data;
use penny::forward::{Method, forward, step};
use penny::model::{Cone, Model};
use penny::state::State;
use penny::{compile, integrate, mjcf};
use serde::Deserialize;

use crate::sim::Sim;

#[derive(Deserialize)]
struct Golden {
    scenes: Vec<Case>,
    extremes: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    name: String,
    xml: String,
    qvel: Option<Vec<f64>>,
    ctrl: Option<Vec<f64>>,
    every: usize,
    steps: usize,
    /// On qpos over the whole run.
    tolerance: f64,
    qpos: Vec<Vec<f64>>,
    qvel_end: Vec<f64>,
    states: Vec<Snapshot>,
}

#[derive(Deserialize)]
struct Snapshot {
    qpos: Vec<f64>,
    qvel: Vec<f64>,
    qacc: Vec<f64>,
    qfrc_constraint: Vec<f64>,
    nefc: usize,
    contact_force: Vec<[f64; 6]>,
    #[serde(rename = "efc_J")]
    jac: Option<Vec<f64>>,
    #[serde(rename = "efc_R")]
    r: Option<Vec<f64>>,
    #[serde(rename = "efc_aref")]
    aref: Option<Vec<f64>>,
    #[serde(rename = "efc_force")]
    force: Option<Vec<f64>>,
}

/// m/s²
const GRAVITY: f64 = 9.81;

fn golden() -> Golden {
    serde_json::from_str(include_str!("../golden/mujoco_law.json")).expect("the golden file is JSON of this form")
}

fn load(xml: &str) -> Model {
    let loaded = mjcf::parse("scene.xml", xml).unwrap_or_else(|failure| panic!("{failure}"));
    compile::compile(&loaded.document, &loaded.spec).unwrap_or_else(|p| panic!("{p:?}\n{xml}")).0
}

fn method(model: &Model) -> Method {
    let integrator = integrate::by_name(&model.opt.integrator).expect("golden scenes use supported integrators");
    Method { contact: &mujoco::LAW, integrator, timestep: model.opt.timestep, rounds: penny::forward::ROUNDS }
}

fn start(model: &Model, case: &Case) -> (State, Data) {
    let mut state = State::new(model);
    if let Some(qvel) = &case.qvel {
        state.qvel.copy_from_slice(qvel);
    }
    if let Some(ctrl) = &case.ctrl {
        state.ctrl.copy_from_slice(ctrl);
    }
    (state, Data::new(model))
}

fn size(a: &[f64]) -> f64 {
    a.iter().fold(0.0, |m, x| x.abs().max(m))
}

fn difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).fold(0.0, |m, (a, b)| if (a - b).is_nan() { f64::INFINITY } else { (a - b).abs().max(m) })
}

/// Appends a line to the report unless `ours` is `theirs` within `tolerance` of its largest number, or of `scale`:
/// the size of the numbers that it is a difference of.
fn check(report: &mut String, what: &str, ours: &[f64], theirs: &[f64], scale: f64, tolerance: f64) {
    if ours.len() != theirs.len() {
        writeln!(report, "{what}: {} numbers, MuJoCo has {}", ours.len(), theirs.len()).unwrap();
        return;
    }
    let relative = difference(ours, theirs) / size(theirs).max(scale);
    if relative > tolerance {
        writeln!(report, "{what}: {relative:.1e} off").unwrap();
    }
}

/// From MuJoCo's own states the same rows, forces and accelerations: one evaluation, so errors cannot grow.
#[test]
fn one_step_from_mujocos_states() {
    let mut report = String::new();
    let mut compared = 0;
    for case in golden().scenes {
        let model = load(&case.xml);
        let method = method(&model);
        let (mut state, mut data) = start(&model, &case);
        for (i, there) in case.states.iter().enumerate() {
            let label = |what: &str| format!("{} state {i} {what}", case.name);
            state.qpos.copy_from_slice(&there.qpos);
            state.qvel.copy_from_slice(&there.qvel);
            forward(&model, &method, &state, &mut data);
            let rows = efc::list(&model, &method.settings(), &state, &data);
            if rows.len() != there.nefc {
                writeln!(report, "{}: {} rows, MuJoCo has {}", label(""), rows.len(), there.nefc).unwrap();
                continue;
            }
            compared += 1;
            check(&mut report, &label("qacc"), &data.qacc, &there.qacc, GRAVITY, 1e-9);
            check(&mut report, &label("qfrc_constraint"), &data.qfrc_constraint, &there.qfrc_constraint, 0.01, 1e-9);
            let ours: Vec<f64> = data.contacts.iter().flat_map(|c| c.force).collect();
            let mut theirs = there.contact_force.concat();
            if let [a, b] = &data.contacts[..]
                && (a.dist - b.dist).abs() < 1e-15
                && difference(&ours[..6], &theirs[..6]) > difference(&ours[..6], &theirs[6..])
            {
                // Which end of a level cylinder comes first is the last bit of its axis.
                theirs.rotate_left(6);
            }
            check(&mut report, &label("contact forces"), &ours, &theirs, 0.01, 1e-9);
            if let (Some(jac), Some(r), Some(aref), Some(force)) = (&there.jac, &there.r, &there.aref, &there.force) {
                let column = |f: fn(&efc::Row) -> f64| rows.iter().map(f).collect::<Vec<f64>>();
                let ours: Vec<f64> = rows.iter().flat_map(|row| row.jac.clone()).collect();
                check(&mut report, &label("efc_J"), &ours, jac, 0.0, 1e-12);
                check(&mut report, &label("efc_R"), &column(|r| r.r), r, 0.0, 1e-9);
                check(&mut report, &label("efc_aref"), &column(|r| r.aref), aref, GRAVITY, 1e-9);
                check(&mut report, &label("efc_force"), &column(|r| r.force), force, 0.01, 1e-9);
            }
        }
    }
    assert!(report.is_empty(), "\n{report}");
    assert!(compared > 300, "only {compared} states compared");
}

/// Runs a case; the first sample beyond the tolerance, or the largest difference.
fn run(case: &Case) -> Result<f64, String> {
    let model = load(&case.xml);
    let method = method(&model);
    let (mut state, mut data) = start(&model, case);
    let mut worst: f64 = 0.0;
    for i in 1..=case.steps {
        step(&model, &method, &mut state, &mut data).map_err(|d| format!("{}: {d:?}", case.name))?;
        if i % case.every == 0 {
            let off = difference(&state.qpos, &case.qpos[i / case.every - 1]);
            worst = worst.max(off);
            if off > case.tolerance {
                return Err(format!("{}: qpos {off:.1e} off after step {i}", case.name));
            }
        }
    }
    // Velocities of the run's end: a hundredfold, as contacts turn 1e-12 m of depth into 1e-10 m/s.
    let off = difference(&state.qvel, &case.qvel_end);
    if off > 100.0 * case.tolerance {
        return Err(format!("{}: qvel {off:.1e} off at the end", case.name));
    }
    Ok(worst)
}

fn run_all(cases: &[Case]) {
    let report: Vec<String> = cases.iter().filter_map(|case| run(case).err()).collect();
    assert!(report.is_empty(), "\n{}", report.join("\n"));
}

/// Soft damped contact forgets small differences, so whole runs agree to rounding (1e-10 leaves 1e4 of headroom over
/// what a prototype reached; 1e-8 for the ill-conditioned disk).
#[test]
fn whole_runs() {
    run_all(&golden().scenes);
}

/// Steps of 1e-5 s to 1 s, stiffness beyond what a step can follow, mass ratios to 1e6, impratio 1e-2 to 1e4.
#[test]
fn extremes() {
    run_all(&golden().extremes);
}

fn ball_scene(option: &str) -> String {
    format!(
        r#"<mujoco><option {option}/><worldbody><geom type="plane" size="9 9 1"/>
        <body pos="0 0 .0999"><freejoint/><geom size=".1"/></body></worldbody></mujoco>"#
    )
}

fn settle(xml: &str, steps: usize) -> (Model, Method, State, Data) {
    let model = load(xml);
    let method = method(&model);
    let mut state = State::new(&model);
    let mut data = Data::new(&model);
    for _ in 0..steps {
        step(&model, &method, &mut state, &mut data).expect("the scene is stable");
    }
    (model, method, state, data)
}

/// At the minimum the gradient vanishes: M (a − a₀) is what the rows' forces add up to.
#[test]
fn rows_times_forces_are_the_constraint_force() {
    for case in golden().scenes.iter() {
        let model = load(&case.xml);
        let method = method(&model);
        let (mut state, mut data) = start(&model, case);
        for there in &case.states {
            state.qpos.copy_from_slice(&there.qpos);
            state.qvel.copy_from_slice(&there.qvel);
            forward(&model, &method, &state, &mut data);
            let mut sum = vec![0.0; model.nv];
            for row in efc::list(&model, &method.settings(), &state, &data) {
                sum.iter_mut().zip(&row.jac).for_each(|(s, j)| *s += j * row.force);
            }
            let off = difference(&sum, &data.qfrc_constraint) / size(&sum).max(1.0);
            assert!(off < 1e-9, "{}: gradient {off:.1e}", case.name);
        }
    }
}

/// One minimum, whatever the start.
#[test]
fn a_warm_start_changes_nothing_but_the_work() {
    for case in golden().scenes.iter().filter(|c| c.seconds_are_short()) {
        let mut model = load(&case.xml);
        let method = method(&model);
        let (mut state, mut data) = start(&model, case);
        let Some(there) = case.states.last() else { continue };
        state.qpos.copy_from_slice(&there.qpos);
        state.qvel.copy_from_slice(&there.qvel);
        let mut solve = |model: &Model, warm: &[f64]| {
            state.qacc_warmstart.copy_from_slice(warm);
            forward(model, &method, &state, &mut data);
            data.qacc.clone()
        };
        let zeros = vec![0.0; model.nv];
        let cold = solve(&model, &zeros);
        let warm = solve(&model, &cold);
        let astray: Vec<f64> = (0..model.nv).map(|i| 50.0 * (i as f64 + 1.0).sin()).collect();
        let lost = solve(&model, &astray);
        model.edit(|m| m.opt.flags.warmstart = false).expect("a flag");
        let none = solve(&model, &zeros);
        for (name, other) in [("its own solution", &warm), ("a wrong start", &lost), ("none", &none)] {
            let off = difference(&cold, other) / size(&cold).max(1.0);
            assert!(off < 1e-10, "{}: {off:.1e} from {name}", case.name);
        }
    }
}

impl Case {
    fn seconds_are_short(&self) -> bool {
        !self.name.starts_with("disk")
    }
}

#[test]
fn a_body_at_rest_costs_no_iteration_with_a_tolerance_and_some_without() {
    // With rolling friction there is no formula.
    let scene = |option: &str| ball_scene(option).replace("<geom size", "<geom condim='6' size");
    let (_, _, _, data) = settle(&scene(r#"tolerance="1e-8""#), 1000);
    assert_eq!((data.counts.contacts, data.solver.iterations), (1, 0));
    assert!(data.solver.residual < 1e-8);
    let (_, _, _, data) = settle(&scene(r#"tolerance="0""#), 20);
    assert!(data.solver.iterations > 0);
    assert!(data.solver.residual < 1e-15, "residual {:e}", data.solver.residual);
}

#[test]
fn iterations_are_bounded_by_the_option() {
    let golden = golden();
    let case = golden.scenes.iter().find(|c| c.name == "ten spheres elliptic").expect("a golden scene");
    let mut model = load(&case.xml);
    model.edit(|m| m.opt.iterations = 1).expect("a number");
    let method = method(&model);
    let (mut state, mut data) = start(&model, case);
    for _ in 0..100 {
        step(&model, &method, &mut state, &mut data).expect("one iteration a step is rough, but holds");
        assert!(data.solver.iterations <= 1);
    }
}

/// Rest depth of a sphere, K d(r)|r| = q (1 − d)/d g, from the behaviour of one contact in closed form: q is 1 for
/// an elliptic cone and μ²(1 + μ²)/(condim − 1) for a pyramid.
#[test]
fn a_ball_sinks_as_deep_as_the_closed_form_says() {
    for (option, q) in [(r#"cone="elliptic""#, 1.0), (r#"cone="pyramidal""#, 1.0)] {
        let (model, _, state, _) = settle(&ball_scene(&format!(r#"{option} tolerance="0""#)), 3000);
        let mix = &model.mixes[0];
        let solimp = penny::contact::impedance::clamp(&mix.solimp);
        let k = penny::contact::impedance::Reference::new(&mix.solref, &solimp, 0.002, true).stiffness;
        let depth = 0.1 - state.qpos[2];
        let d = penny::contact::impedance::impedance(&solimp, depth);
        let asks = q * (1.0 - d) / d * 9.81;
        assert!((k * d * depth / asks - 1.0).abs() < 1e-9, "{option}: depth {depth:e}");
        assert_eq!(model.opt.cone == Cone::Elliptic, option.contains("elliptic"));
    }
}

/// A scene far away must not change a bit of the result: islands are solved apart.
#[test]
fn islands_do_not_notice_one_another() {
    let pair = |x: f64| {
        format!(
            r#"<body pos="{x} 0 .12"><freejoint/><geom size=".1"/></body>
            <body pos="{x} .03 .31"><freejoint/><geom type="box" size=".1 .1 .08"/></body>"#
        )
    };
    let scene = |bodies: String| {
        format!(r#"<mujoco><worldbody><geom type="plane" size="9 9 1"/>{bodies}</worldbody></mujoco>"#)
    };
    let (_, _, alone, _) = settle(&scene(pair(0.0)), 300);
    let (_, _, both, _) = settle(&scene(pair(0.0) + &pair(4.0)), 300);
    assert_eq!(alone.qpos, both.qpos[..14]);
    assert_ne!(alone.qpos[2], 0.12);
}

/// The NoSlip solver's steps towards the edge of a tiny cone are tiny: where they end before it, the friction is drawn to it.
#[test]
fn friction_without_slip_stays_within_a_tiny_cone() {
    let xml = r#"<mujoco><option cone="elliptic" noslip_iterations="1"/><default><geom type="box" friction="0"/></default>
        <worldbody>
          <body pos="0.148 -0.033 0.224" quat="0.831 0.866 0.451 0.334">
            <joint axis="0.245 0.010 0.601" type="slide"/><joint type="ball"/>
            <geom size="0.079 0.071 0.053" pos="-0.018 0.079 -0.047" quat="-0.583 -0.670 -0.981 -0.208"/>
          </body>
          <body pos="0.193753 0.128456 0.076952" quat="-0.837265 0.515623 0.00960611 -0.0416039">
            <geom size="0.0525 0.0776 0.1287" pos="-0.0395 -0.0581 -0.0532" quat="-0.613 -0.660 0.243 0.652"/>
          </body>
        </worldbody></mujoco>"#;
    let mut sim = Sim::law(xml, "mujoco");
    sim.step();
    for contact in &sim.data.contacts {
        let [normal, x, y, ..] = contact.force;
        assert!(x.hypot(y) <= 1.0001e-5 * normal, "{:?}", contact.force);
    }
    assert!(sim.data.contacts.iter().any(|contact| contact.force[0] > 1.0));
}
