//! What real files hold, one topic of tests/golden each: against MuJoCo 4.0.0 from random states, under its three
//! integrators.

use std::collections::BTreeMap;

use penny::contact::mujoco;
use penny::data::Data;
use penny::forward::{Method, ROUNDS, forward, step};
use penny::integrate::{self, Integrator};
use penny::math::{Vec3, wxyz};
use penny::model::{Anchor, EqualityKind, Geom, Model};
use penny::sensors;
use penny::state::State;
use serde::Deserialize;

use crate::sim::Sim;

type Numbers = BTreeMap<String, Vec<f64>>;

/// A scene as tests/golden/topics/scenes.py writes it.
#[derive(Deserialize)]
struct Golden {
    name: String,
    xml: String,
    names: BTreeMap<String, Vec<String>>,
    compiled: Numbers,
    samples: Vec<Sample>,
    rollouts: Vec<Rollout>,
    /// Error that is allowed in place of 1e-12.
    loose: Option<f64>,
}

#[derive(Deserialize)]
struct Sample {
    #[serde(flatten)]
    start: Start,
    forward: Numbers,
    steps: BTreeMap<String, Numbers>,
}

#[derive(Deserialize)]
struct Rollout {
    #[serde(flatten)]
    start: Start,
    every: usize,
    runs: BTreeMap<String, Vec<Numbers>>,
}

#[derive(Deserialize)]
struct Start {
    qpos: Vec<f64>,
    qvel: Vec<f64>,
    #[serde(default)]
    ctrl: Vec<f64>,
    #[serde(default)]
    act: Vec<f64>,
    #[serde(default)]
    mocap_pos: Vec<f64>,
    #[serde(default)]
    mocap_quat: Vec<f64>,
}

impl Start {
    fn state(&self, model: &Model) -> State {
        let mut state = State::new(model);
        state.qpos.clone_from(&self.qpos);
        state.qvel.clone_from(&self.qvel);
        state.ctrl.clone_from(&self.ctrl);
        state.act.clone_from(&self.act);
        state.mocap_pos = self.mocap_pos.as_chunks().0.to_vec();
        state.mocap_quat = self.mocap_quat.as_chunks().0.to_vec();
        state
    }
}

fn method(integrator: &'static Integrator, model: &Model) -> Method {
    Method { contact: &mujoco::LAW, integrator, timestep: model.opt.timestep, rounds: ROUNDS }
}

fn flat(vectors: impl Iterator<Item = Vec3>) -> Vec<f64> {
    vectors.flat_map(|v| [v.x, v.y, v.z]).collect()
}

/// Equal to `tolerance` times the largest number (at least 1).
#[track_caller]
fn close(what: &str, ours: &[f64], theirs: &[f64], tolerance: f64) {
    assert_eq!(ours.len(), theirs.len(), "{what}: count");
    let scale = theirs.iter().fold(1.0_f64, |s, x| s.max(x.abs()));
    for (i, (a, b)) in ours.iter().zip(theirs).enumerate() {
        assert!((a - b).abs() <= tolerance * scale, "{what}[{i}]: {a:e}, not {b:e}; off by {:e}", a - b);
    }
}

fn names(model: &Model, kind: &str) -> Option<Vec<String>> {
    Some(match kind {
        "body" => model.bodies.iter().map(|b| b.name.clone()).collect(),
        "joint" => model.joints.iter().map(|j| j.name.clone()).collect(),
        "geom" => model.geoms.iter().map(|g| g.name.clone()).collect(),
        "site" => model.sites.iter().map(|s| s.name.clone()).collect(),
        "sensor" => model.sensors.iter().map(|s| s.name.clone()).collect(),
        "actuator" => model.actuators.iter().map(|a| a.name.clone()).collect(),
        _ => return None,
    })
}

fn compiled(model: &Model, what: &str) -> Vec<f64> {
    match what {
        "body_pos" => flat(model.bodies.iter().map(|b| b.pos)),
        "body_quat" => model.bodies.iter().flat_map(|b| wxyz(&b.quat)).collect(),
        "geom_pos" => flat(model.geoms.iter().map(|g| g.pos)),
        "geom_quat" => model.geoms.iter().flat_map(|g| wxyz(&g.quat)).collect(),
        "actuator_biasprm" => padded(model.actuators.iter().map(|a| a.bias)),
        "actuator_ctrlrange" => model.actuators.iter().flat_map(|a| a.ctrlrange.unwrap_or_default()).collect(),
        "actuator_actrange" => model.actuators.iter().flat_map(|a| a.actrange.unwrap_or_default()).collect(),
        "tendon_length0" => model.tendons.iter().map(|t| t.length0).collect(),
        "tendon_lengthspring" => model.tendons.iter().flat_map(|t| t.lengthspring).collect(),
        "tendon_invweight0" => model.tendons.iter().map(|t| t.invweight0).collect(),
        "eq_data" => model.equalities.iter().flat_map(|e| eq_data(&e.kind)).collect(),
        "geom_fluid" => model.geoms.iter().flat_map(geom_fluid).collect(),
        "jnt_stiffness" => model.joints.iter().map(|j| j.stiffness).collect(),
        "dof_damping" => model.dofs.iter().map(|d| d.damping).collect(),
        "dof_invweight0" => model.dofs.iter().map(|d| d.invweight0).collect(),
        _ => panic!("{what}"),
    }
}

/// How a geom feels a medium, as MuJoCo has it.
fn geom_fluid(geom: &Geom) -> Vec<f64> {
    match geom.fluid.as_deref() {
        None => vec![0.0; 12],
        Some(fluid) => [1.0]
            .into_iter()
            .chain(fluid.coef)
            .chain(fluid.virtual_mass.iter().copied())
            .chain(fluid.virtual_inertia.iter().copied())
            .collect(),
    }
}

/// The numbers of a `connect` or `weld` as MuJoCo has them.
fn eq_data(kind: &EqualityKind) -> [f64; 12] {
    let mut out = [0.0; 12];
    let (anchors, scale) = match kind {
        EqualityKind::Connect(anchors) => (*anchors, 0.0),
        EqualityKind::Weld { anchors: [first, second], torquescale, .. } => ([*second, *first], *torquescale),
        _ => return out,
    };
    out[10] = scale;
    for (i, anchor) in anchors.iter().enumerate() {
        if let Anchor::Body { pos, quat, .. } = anchor {
            out[3 * i..3 * i + 3].copy_from_slice(pos.as_slice());
            if i == 1 && matches!(kind, EqualityKind::Weld { .. }) {
                out[6..10].copy_from_slice(&wxyz(quat));
            }
        }
    }
    out
}

/// Three parameters as MuJoCo has them, in a row of ten.
fn padded(parameters: impl Iterator<Item = [f64; 3]>) -> Vec<f64> {
    parameters.flat_map(|[a, b, c]| [a, b, c, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]).collect()
}

fn computed(data: &Data, what: &str) -> Vec<f64> {
    match what {
        "sensordata" => data.sensordata.clone(),
        "xpos" => flat(data.xpos.iter().copied()),
        "actuator_force" => data.actuator_force.clone(),
        "qacc" => data.qacc.clone(),
        "act_dot" => data.act_dot.clone(),
        "ten_length" => data.ten_length.clone(),
        "ten_velocity" => data.ten_velocity.clone(),
        "qfrc_passive" => data.qfrc_passive.clone(),
        "qfrc_actuator" => data.qfrc_actuator.clone(),
        _ => panic!("{what}"),
    }
}

fn end(state: &State, data: &Data, what: &str) -> Vec<f64> {
    match what {
        "sensordata" => data.sensordata.clone(),
        "qpos" => state.qpos.clone(),
        "qvel" => state.qvel.clone(),
        "act" => state.act.clone(),
        _ => panic!("{what}"),
    }
}

/// Compiled numbers and one step to 1e-12, rollouts to 1e-9: numbers are sums of some dozens of products, and none of
/// these motions amplifies rounding by more than a thousand.
fn check(golden: &str) {
    let golden: Vec<Golden> = serde_json::from_str(golden).expect("golden data");
    for Golden { name, xml, names: theirs, compiled: numbers, samples, rollouts, loose } in golden {
        let digits = loose.unwrap_or(1e-12);
        let model = penny::parse("test.xml", &xml).unwrap_or_else(|failure| panic!("{name}: {failure}")).model;
        for (kind, theirs) in &theirs {
            if let Some(ours) = names(&model, kind) {
                assert_eq!(&ours, theirs, "{name}: names of kind {kind}");
            }
        }
        for (what, theirs) in &numbers {
            close(&format!("{name}: {what}"), &compiled(&model, what), theirs, 1e-12);
        }
        for Sample { start, forward: forces, steps } in &samples {
            let mut data = Data::new(&model);
            let method = |name: &str| method(integrate::by_name(name).expect("an integrator"), &model);
            let state = start.state(&model);
            forward(&model, &method("rk4"), &state, &mut data);
            sensors::sense(&model, &mujoco::LAW, &state, &mut data);
            for (what, theirs) in forces {
                close(&format!("{name}: {what}"), &computed(&data, what), theirs, digits);
            }
            for (integrator, ends) in steps {
                let (mut state, mut data) = (start.state(&model), Data::new(&model));
                step(&model, &method(integrator), &mut state, &mut data).expect("a step");
                for (what, theirs) in ends {
                    close(&format!("{name}, {integrator}: {what}"), &end(&state, &data, what), theirs, digits);
                }
            }
        }
        for Rollout { start, every, runs } in &rollouts {
            for (integrator, ends) in runs {
                let method = method(integrate::by_name(integrator).expect("an integrator"), &model);
                let (mut state, mut data) = (start.state(&model), Data::new(&model));
                for ends in ends {
                    for _ in 0..*every {
                        step(&model, &method, &mut state, &mut data).expect("a step");
                    }
                    for (what, theirs) in ends {
                        let what_ = format!("{name}, {integrator}, t = {:.2}: {what}", state.time);
                        close(&what_, &end(&state, &data, what), theirs, 1e-9);
                    }
                }
            }
        }
    }
}

#[test]
fn replicas_are_mujocos() {
    check(include_str!("../golden/replicate.json"));
}

#[test]
fn sensors_are_mujocos() {
    check(include_str!("../golden/sensors.json"));
}

#[test]
fn actuators_and_mocap_bodies_are_mujocos() {
    check(include_str!("../golden/actuation.json"));
}

#[test]
fn drag_of_a_medium_is_mujocos() {
    check(include_str!("../golden/fluid.json"));
}

#[test]
fn tendons_are_mujocos() {
    check(include_str!("../golden/tendons.json"));
}

#[test]
fn equalities_are_mujocos() {
    check(include_str!("../golden/equality.json"));
}

#[test]
fn friction_without_slip_is_mujocos() {
    check(include_str!("../golden/noslip.json"));
}

/// Two motors on a tendon, one with a range of its own: the tendon's comes first, as in MuJoCo 4.0.0.
#[test]
fn a_tendon_bounds_its_actuators_before_their_own_ranges_do() {
    let mut sim = Sim::law(
        r#"<mujoco><worldbody><body><joint name="j"/><geom size=".1"/></body></worldbody>
        <tendon><fixed name="t" actuatorfrcrange="-2 3"><joint joint="j" coef="1"/></fixed></tendon>
        <actuator><motor tendon="t" forcerange="-1 1"/><motor tendon="t"/></actuator></mujoco>"#,
        "mujoco",
    );
    sim.state.ctrl = vec![5.0, 5.0];
    sim.step();
    assert_eq!(sim.data.actuator_force, [1.0, 1.5]);
}

/// A force sensor on the world gives what holds an arm to it, and not what rests on its floor.
#[test]
fn the_world_bears_what_hangs_on_it() {
    let mut sim = Sim::law(
        r#"<mujoco><worldbody><site name="wall" pos="0 0 1"/><geom type="plane" size="1 1 1"/>
        <body pos="0 0 1"><joint axis="0 1 0" damping="1e6"/><geom type="box" size=".1 .1 .1" pos=".5 0 0" mass="2"/></body>
        <body pos="0 0.5 0.0999"><freejoint/><geom size=".1" mass="7"/></body></worldbody>
        <sensor><force site="wall"/><torque site="wall"/></sensor></mujoco>"#,
        "mujoco",
    );
    sim.run(0.1);
    assert!(!sim.data.contacts.is_empty());
    // MuJoCo 4.0.0 has this force, too. Its torque mixes the centres of mass of the trees: here 7.63 −2.18 0.
    let mujoco = [0.0, 0.0, 19.62, 0.0, -9.81, 0.0];
    close("force and torque", &sim.data.sensordata, &mujoco, 1e-4);
}

/// Disabled actuators have no velocity, and their activations stay where they are, as in MuJoCo 4.0.0.
#[test]
fn disabled_actuators_do_nothing() {
    let mut sim = Sim::law(
        r#"<mujoco><option><flag actuation="disable"/></option>
        <worldbody><body><joint name="j"/><geom size=".1"/></body></worldbody>
        <actuator><motor name="m" joint="j" gear="2"/>
        <general joint="j" dyntype="integrator" actrange="-.1 .1"/></actuator>
        <sensor><actuatorpos actuator="m"/><actuatorvel actuator="m"/></sensor></mujoco>"#,
        "mujoco",
    );
    (sim.state.qpos, sim.state.qvel, sim.state.act) = (vec![0.3], vec![1.0], vec![0.7]);
    sim.step();
    assert_eq!((&sim.data.sensordata[..], &sim.state.act[..]), (&[0.6, 0.0][..], &[0.7][..]));
}

/// What has no mass has no velocity of its centre of mass: a frame that only carries sites, as in MuJoCo 4.0.0.
#[test]
fn a_subtree_without_mass_has_no_velocity() {
    let mut sim = Sim::law(
        r#"<mujoco><worldbody><body><joint/><geom size=".1" pos=".3 0 0"/><body name="mount" pos="1 0 0"><site/></body></body></worldbody>
        <sensor><subtreelinvel body="mount"/></sensor></mujoco>"#,
        "mujoco",
    );
    sim.state.qvel = vec![1.0];
    sim.step();
    assert_eq!(sim.data.sensordata, [0.0; 3]);
}

/// A control that is NaN ends the run: it counted as the lower end of the actuator's range.
#[test]
fn a_control_that_is_no_number_ends_the_run() {
    for bounds in ["ctrlrange='-1 1'", "forcerange='-1 1'", "ctrlrange='-1 1' dyntype='integrator' actrange='-1 1'"] {
        let mut sim = Sim::law(
            &format!(
                "<mujoco><worldbody><body><joint name='j' actuatorfrcrange='-1 1'/><geom size='.1'/></body></worldbody>
                <actuator><general joint='j' {bounds}/></actuator></mujoco>"
            ),
            "mujoco",
        );
        sim.state.ctrl = vec![f64::NAN];
        let ended =
            (0..3).any(|_| penny::forward::step(&sim.model, &sim.method, &mut sim.state, &mut sim.data).is_err());
        assert!(ended, "{bounds}");
    }
}
