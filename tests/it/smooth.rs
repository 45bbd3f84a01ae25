//! Motion without contact: against MuJoCo stage by stage, against itself in other words, and against exactness.

use penny::contact::{Law, Lever, describe};
use penny::data::Data;
use penny::dynamics::energy::{energy, momentum};
use penny::dynamics::{dense_m, jacobian, kinematics, smooth, solve_m, xipos};
use penny::forward::{Method, StepError, forward, step};
use penny::integrate::{self, Integrator, displace};
use penny::math::{Mat3, Vec3, Vec6, mat};
use penny::model::Model;
use penny::state::{Start, State};
use serde_json::Value;

/// Scenes here touch nothing: this law must never be asked.
const NO_LAW: Law = Law {
    name: "none",
    about: "",
    joints: true,
    start: Start::Nothing,
    by_timestep: false,
    nearer: "",
    lever: Lever::Midpoint,
    solve: |_, _, _| panic!("a contact law ran without contacts"),
    pose: None,
    shortcut: None,
    balls: None,
    friction: |_, mix| mix.friction,
    describe: describe::nothing,
    unlike: None,
};

fn model(xml: &str) -> Model {
    match penny::parse("test.xml", xml) {
        Ok(scene) => scene.model,
        Err(failure) => panic!("{:?}", failure.problems),
    }
}

fn method(integrator: &'static Integrator, timestep: f64) -> Method {
    Method { contact: &NO_LAW, integrator, timestep, rounds: penny::forward::ROUNDS }
}

fn golden() -> Value {
    serde_json::from_str(include_str!("../golden/smooth.json")).unwrap()
}

fn floats(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
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

fn state(model: &Model, sample: &Value) -> State {
    let mut state = State::new(model);
    state.qpos = floats(&sample["qpos"]);
    state.qvel = floats(&sample["qvel"]);
    if let Some(ctrl) = sample.get("ctrl") {
        state.ctrl = floats(ctrl);
        state.xfrc_applied = floats(&sample["xfrc"]).chunks(6).map(Vec6::from_column_slice).collect();
    }
    state
}

/// Every scene of the golden file with each of its random states.
fn each_sample(mut check: impl FnMut(&str, &Model, &State, &Value)) {
    for scene in golden()["scenes"].as_array().unwrap() {
        let model = model(scene["xml"].as_str().unwrap());
        for sample in scene["samples"].as_array().unwrap() {
            check(scene["name"].as_str().unwrap(), &model, &state(&model, sample), sample);
        }
    }
}

/// What MuJoCo computes at a state. The numbers are sums of a few dozen products: 1e-12 is a thousand roundings.
#[test]
fn forces_and_inertia_are_mujocos() {
    each_sample(|name, model, state, sample| {
        let mut data = Data::new(model);
        forward(model, &method(&integrate::semi_implicit_euler::METHOD, 0.005), state, &mut data);
        let expect = |what: &str, ours: &[f64]| close(&format!("{name}: {what}"), ours, &floats(&sample[what]), 1e-12);
        let flat = |v: &[Vec3]| v.iter().flat_map(|p| p.iter().copied().collect::<Vec<_>>()).collect::<Vec<f64>>();
        expect("xpos", &flat(&data.xpos));
        let rows = data.xmat.iter().flat_map(|m| m.transpose().iter().copied().collect::<Vec<_>>());
        expect("xmat", &rows.collect::<Vec<_>>());
        expect("xipos", &flat(&(0..model.bodies.len()).map(|b| xipos(model, &data, b)).collect::<Vec<_>>()));
        expect("qacc", &data.qacc);
        expect("qfrc_passive", &data.qfrc_passive);
        expect("qfrc_actuator", &data.qfrc_actuator);
        let (theirs_m, theirs_bias) = (floats(&sample["qM"]), floats(&sample["qfrc_bias"]));
        for (t, tree) in model.trees.iter().enumerate().filter(|(_, tree)| tree.free.is_none()) {
            let (n, first) = (tree.dofs.len(), tree.dofs.start);
            close(
                &format!("{name}: qfrc_bias"),
                &data.qfrc_bias[tree.dofs.clone()],
                &theirs_bias[tree.dofs.clone()],
                1e-12,
            );
            let m = dense_m(model, &data, t);
            for i in 0..n {
                let row = (first + i) * model.nv + first;
                close(&format!("{name}: qM row {i}"), &m[i * n..][..n], &theirs_m[row..row + n], 1e-12);
            }
        }
        let ours = energy(model, state, &mut data);
        let mut theirs = floats(&sample["energy"]);
        theirs.swap(0, 1);
        close(&format!("{name}: kinetic, potential energy"), &[ours.kinetic, ours.potential], &theirs, 1e-12);
        let ours = momentum(model, state, &mut data);
        expect("linear", ours.linear.as_slice());
        expect("angular", ours.angular.as_slice());
    });
}

#[test]
fn one_step_is_mujocos() {
    each_sample(|name, model, start, sample| {
        for (integrator, end) in sample["steps"].as_object().unwrap() {
            let integrator = integrate::by_name(integrator).unwrap();
            let (mut state, mut data) = (start.clone(), Data::new(model));
            step(model, &method(integrator, model.opt.timestep), &mut state, &mut data).unwrap();
            let what = format!("{name}, {}", integrator.name);
            close(&format!("{what}: qpos"), &state.qpos, &floats(&end["qpos"]), 1e-12);
            close(&format!("{what}: qvel"), &state.qvel, &floats(&end["qvel"]), 1e-12);
        }
    });
}

/// 3 s at 1 ms: 3000 steps of rounding, which none of these motions amplifies by more than a thousand.
#[test]
fn three_seconds_are_mujocos() {
    for rollout in golden()["rollouts"].as_array().unwrap() {
        let model = model(rollout["xml"].as_str().unwrap());
        for (name, states) in rollout["runs"].as_object().unwrap() {
            let integrator = integrate::by_name(name).unwrap();
            let (mut state, mut data) = (state(&model, rollout), Data::new(&model));
            for end in states.as_array().unwrap() {
                for _ in 0..500 {
                    step(&model, &method(integrator, model.opt.timestep), &mut state, &mut data).unwrap();
                }
                let what = format!("{}, {name}, t = {:.1}", rollout["name"], state.time);
                close(&format!("{what}: qpos"), &state.qpos, &floats(&end["qpos"]), 1e-10);
                close(&format!("{what}: qvel"), &state.qvel, &floats(&end["qvel"]), 1e-10);
            }
        }
    }
}

/// J q̇ against the central difference of positions along q̇: its error is h² times third derivatives (1e-10),
/// plus rounding over h (1e-11).
#[test]
fn jacobian_is_the_derivative_of_kinematics() {
    each_sample(|name, model, state, _| {
        let (mut data, h) = (Data::new(model), 1e-5);
        let (mut ahead, mut behind) = (state.qpos.clone(), state.qpos.clone());
        displace(model, &mut ahead, &state.qvel, h);
        displace(model, &mut behind, &state.qvel, -h);
        let local = Vec3::new(0.3, -0.2, 0.1);
        for b in (0..model.bodies.len()).filter(|&b| model.bodies[b].tree.is_some()) {
            let mut pose = |q: &[f64]| {
                kinematics(model, q, &mut data);
                (data.xpos[b] + data.xmat[b] * local, data.xmat[b])
            };
            let ((p1, r1), (p0, r0)) = (pose(&ahead), pose(&behind));
            let (point, rot) = pose(&state.qpos);
            let spin = (r1 - r0) * rot.transpose() / (2.0 * h);
            let dofs = model.trees[model.bodies[b].tree.unwrap()].dofs.clone();
            let mut columns = vec![Vec6::zeros(); dofs.len()];
            jacobian(model, &data, b, &point, &mut columns);
            let ours: Vec6 = columns.iter().zip(&state.qvel[dofs]).map(|(c, v)| c * *v).sum();
            let v = (p1 - p0) / (2.0 * h);
            let theirs = [v.x, v.y, v.z, spin[(2, 1)], spin[(0, 2)], spin[(1, 0)]];
            close(&format!("{name}: body {b}"), ours.as_slice(), &theirs, 1e-8);
        }
    });
}

/// M from composite bodies against M = Σ Jᵀ I J + armature, body by body; and M⁻¹ against M.
#[test]
fn inertia_matrix_is_the_sum_over_bodies() {
    each_sample(|name, model, state, _| {
        let mut data = Data::new(model);
        smooth_at(model, state, &mut data);
        for (t, tree) in model.trees.iter().enumerate().filter(|(_, tree)| tree.free.is_none()) {
            let n = tree.dofs.len();
            let mut sum = vec![0.0; n * n];
            let mut columns = vec![Vec6::zeros(); n];
            for b in tree.bodies.clone() {
                let body = &model.bodies[b];
                jacobian(model, &data, b, &xipos(model, &data, b), &mut columns);
                let axes = data.xmat[b] * mat(&body.iquat);
                let inertia = axes * Mat3::from_diagonal(&body.inertia) * axes.transpose();
                for i in 0..n {
                    for j in 0..n {
                        let (a, c) = (columns[i], columns[j]);
                        let turn = a.fixed_rows::<3>(3).dot(&(inertia * c.fixed_rows::<3>(3)));
                        sum[i * n + j] += body.mass * a.fixed_rows::<3>(0).dot(&c.fixed_rows::<3>(0)) + turn;
                    }
                }
            }
            for i in 0..n {
                sum[i * n + i] += model.dofs[tree.dofs.start + i].armature;
            }
            let qm = dense_m(model, &data, t);
            close(&format!("{name}: M"), &qm, &sum, 1e-12);
            let x: Vec<f64> = (0..n).map(|i| 1.0 + i as f64).collect();
            let mut solved: Vec<f64> = (0..n).map(|i| (0..n).map(|j| qm[i * n + j] * x[j]).sum()).collect();
            solve_m(model, &data, t, &mut solved);
            // The condition number of these matrices is below 1e4.
            close(&format!("{name}: M⁻¹ M x"), &solved, &x, 1e-11);
        }
    });
}

fn smooth_at(model: &Model, state: &State, data: &mut Data) {
    kinematics(model, &state.qpos, data);
    smooth(model, state, data);
}

/// A free body by the general path: its inertia matrix built, factored and solved.
#[test]
fn closed_form_of_a_free_body_is_the_general_path() {
    each_sample(|name, model, start, _| {
        let mut general = model.clone();
        if model.trees.iter().all(|t| t.free.is_none()) {
            return;
        }
        general.edit(|m| m.trees.iter_mut().for_each(|tree| tree.free = None)).expect("the general way");
        let (mut data, mut other) = (Data::new(model), Data::new(&general));
        smooth_at(model, start, &mut data);
        smooth_at(&general, start, &mut other);
        for tree in model.trees.iter().filter(|t| t.free.is_some()) {
            let b = tree.bodies.start;
            // The general path's movers are bodies, not what is welded together: compare where they are the same.
            if tree.bodies.len() == 1 {
                let (ours, theirs) = (&data.movers[b], &other.movers[b]);
                close(&format!("{name}: com"), ours.com.as_slice(), theirs.com.as_slice(), 1e-13);
                let turned = data.movers[b].axes * Vec3::new(ours.vel[3], ours.vel[4], ours.vel[5]);
                let vel = [ours.vel[0], ours.vel[1], ours.vel[2], turned.x, turned.y, turned.z];
                close(&format!("{name}: velocity of the mover"), &vel, theirs.vel.as_slice(), 1e-12);
            }
        }
        for integrator in integrate::ALL {
            let (mut ours, mut theirs) = (start.clone(), start.clone());
            step(model, &method(integrator, 0.005), &mut ours, &mut data).unwrap();
            step(&general, &method(integrator, 0.005), &mut theirs, &mut other).unwrap();
            close(&format!("{name}, {}: qpos", integrator.name), &ours.qpos, &theirs.qpos, 1e-12);
            close(&format!("{name}, {}: qvel", integrator.name), &ours.qvel, &theirs.qvel, 1e-12);
        }
    });
}

/// A tree that moves in an oblique plane, computed as one that moves in space.
#[test]
fn in_a_plane_three_numbers_do_for_six() {
    let model = model(
        r#"<mujoco><worldbody><body pos="0 0 1" euler="20 30 40">
            <joint type="slide" axis="1 0 0.3"/><joint type="slide" axis="0 0 1" damping="2"/>
            <joint axis="0 1 0" pos="0.1 0.3 0.2" armature="0.01"/><geom type="box" size="0.1 0.2 0.3" euler="10 20 30"/>
            <body pos="0.2 0.1 -0.3" euler="0 50 0"><joint axis="0 -1 0" pos="0 0.2 0.1" damping="0.1"/>
              <geom type="box" size="0.1 0.2 0.05" pos="0.2 0.1 0"/>
              <body pos="0 0 0.4" euler="40 0 0"><geom type="capsule" size="0.05 0.2"/></body></body>
            <body pos="-0.2 0 -0.3"><joint axis="0 1 0"/><geom type="box" size="0.3 0.02 0.05"/></body>
        </body></worldbody></mujoco>"#,
    );
    let mut start = State::new(&model);
    start.qpos.copy_from_slice(&[0.1, -0.2, 0.7, 2.0, -0.4]);
    start.qvel.copy_from_slice(&[1.0, 2.0, -3.0, 4.0, 5.0]);
    let (mut data, mut other) = (Data::new(&model), Data::new(&model));
    assert!(data.plan.planes[0].is_some(), "the plane was not seen");
    other.plan.planes.fill(None);
    smooth_at(&model, &start, &mut data);
    smooth_at(&model, &start, &mut other);
    close("M", &data.qm_rows, &other.qm_rows, 1e-13);
    close("bias", &data.qfrc_bias, &other.qfrc_bias, 1e-12);
    close("acceleration", &data.qacc_smooth, &other.qacc_smooth, 1e-11);
}

/// A pendulum on a ball joint that starts in a plane of symmetry swings as on a hinge.
#[test]
fn ball_in_a_plane_is_a_hinge() {
    let pendulum = |joint: &str| {
        let geom = r#"<geom type="capsule" size="0.03" fromto="0 0 0 0 0 -0.5" contype="0" conaffinity="0"/>"#;
        model(&format!("<mujoco><worldbody><body pos='0 0 1'>{joint}{geom}</body></worldbody></mujoco>"))
    };
    let (hinge, ball) = (pendulum(r#"<joint axis="0 1 0"/>"#), pendulum(r#"<joint type="ball"/>"#));
    for integrator in integrate::ALL {
        let method = method(integrator, 0.002);
        let (mut a, mut b) = (State::new(&hinge), State::new(&ball));
        let (mut da, mut db) = (Data::new(&hinge), Data::new(&ball));
        (a.qvel[0], b.qvel[1]) = (4.0, 4.0);
        for _ in 0..1000 {
            step(&hinge, &method, &mut a, &mut da).unwrap();
            step(&ball, &method, &mut b, &mut db).unwrap();
        }
        let angle = 2.0 * b.qpos[2].atan2(b.qpos[0]);
        let turns = ((a.qpos[0] - angle) / std::f64::consts::TAU).round() * std::f64::consts::TAU;
        // Rounding of a thousand steps of a stable swing.
        close(integrator.name, &[angle + turns, b.qvel[1]], &[a.qpos[0], a.qvel[0]], 1e-11);
    }
}

const FLYING: &str = r#"<mujoco><default><geom contype="0" conaffinity="0"/></default><worldbody>
  <body pos="0 0 1"><joint axis="0 1 0" stiffness="3"/><geom type="capsule" size="0.03" fromto="0 0 0 0 0 -0.5"/>
    <body pos="0 0 -0.5"><joint type="ball"/><geom type="box" size="0.1 0.05 0.2" pos="0.1 0 -0.2"/></body></body>
  <body pos="2 0 1"><freejoint/><geom type="box" size="0.1 0.2 0.3" pos="0.05 0 0"/></body>
</worldbody></mujoco>"#;

fn fly(model: &Model, integrator: &'static Integrator, steps: usize) -> State {
    let mut state = State::new(model);
    state.qvel.iter_mut().enumerate().for_each(|(i, v)| *v = 2.0 - 0.7 * i as f64);
    let mut data = Data::new(model);
    for _ in 0..steps {
        step(model, &method(integrator, 0.4 / steps as f64), &mut state, &mut data).unwrap();
    }
    state
}

fn distance(a: &State, b: &State) -> f64 {
    a.qpos.iter().zip(&b.qpos).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
}

/// Halving the step divides the error by 2^order, over joints, rotations and a free flight at once.
#[test]
fn integrators_have_the_order_they_declare() {
    let model = model(FLYING);
    let truth = fly(&model, &integrate::rk4::METHOD, 4000);
    for integrator in integrate::ALL {
        // Fourth order needs large steps to stay above rounding, first order small ones to be asymptotic.
        let steps = if integrator.order > 2 { 100 } else { 1600 };
        let errors = [1, 2].map(|k| distance(&fly(&model, integrator, k * steps), &truth));
        let order = (errors[0] / errors[1]).log2();
        let declared = f64::from(integrator.order);
        assert!((order - declared).abs() <= 0.2, "{}: order {order:.2}, not {declared} ({errors:?})", integrator.name);
    }
}

/// Without gravity a floating mechanism keeps momentum and energy; RK4 at 1 ms, spins of a few rad/s, errs by
/// (h ω)⁴ a second.
#[test]
fn floating_mechanism_keeps_momentum_and_energy() {
    let golden = golden();
    let scenes = golden["scenes"].as_array().unwrap();
    let scene = scenes.iter().find(|s| s["name"] == "floating").unwrap();
    let xml = scene["xml"].as_str().unwrap().replace("damping=\"0.1\"", "");
    let mut model = model(&xml);
    model.edit(|m| m.opt.gravity = Vec3::zeros()).expect("finite");
    let (mut state, mut data) = (state(&model, &scene["samples"][0]), Data::new(&model));
    let (e0, p0) = (energy(&model, &state, &mut data), momentum(&model, &state, &mut data));
    for _ in 0..1000 {
        step(&model, &method(&integrate::rk4::METHOD, 0.001), &mut state, &mut data).unwrap();
    }
    let (e1, p1) = (energy(&model, &state, &mut data), momentum(&model, &state, &mut data));
    close("energy", &[e1.kinetic + e1.potential], &[e0.kinetic + e0.potential], 1e-8);
    close("linear momentum", p1.linear.as_slice(), p0.linear.as_slice(), 1e-9);
    close("angular momentum", p1.angular.as_slice(), p0.angular.as_slice(), 1e-9);
}

/// What cannot move or turn is left alone by a step: marks put into its results survive.
#[test]
fn a_step_leaves_alone_what_cannot_move() {
    let model = model(
        r#"<mujoco><worldbody><geom type="plane" size="1 1 1"/><body pos="0 0 -9"><geom size="0.1"/></body>
        <body pos="0 0 1"><joint type="slide" axis="0 0 1"/><geom size="0.1"/></body></worldbody></mujoco>"#,
    );
    let (mut state, mut data) = (State::new(&model), Data::new(&model));
    let mark = Mat3::identity() * 7.0;
    (data.xmat[1], data.xmat[2], data.geom_xpos[0]) = (mark, mark, Vec3::x());
    data.qm_rows[0] = 42.0;
    step(&model, &method(&integrate::rk4::METHOD, 0.001), &mut state, &mut data).unwrap();
    assert_eq!((data.xmat[1], data.xmat[2], data.geom_xpos[0]), (mark, mark, Vec3::x()), "static poses recomputed");
    assert_eq!(data.qm_rows[0], 42.0, "a constant inertia matrix was recomputed");
    assert_eq!(data.counts.forwards, 4);
}

#[test]
fn divergence_names_the_culprit() {
    let model = model(
        r#"<mujoco><worldbody><body pos="0 0 1"><freejoint/><geom size="0.1"/></body>
        <body pos="3 0 1"><joint type="slide"/><geom size="0.1"/></body></worldbody></mujoco>"#,
    );
    let method = method(&integrate::semi_implicit_euler::METHOD, 0.001);
    let (mut state, mut data) = (State::new(&model), Data::new(&model));
    step(&model, &method, &mut state, &mut data).unwrap();
    state.qvel[6] = 1e14;
    let StepError::Diverged(diverged) = step(&model, &method, &mut state, &mut data).unwrap_err() else { panic!() };
    assert_eq!((diverged.body, diverged.quantity, diverged.index, diverged.contact), (2, "qpos", 7, None));
    state.qvel[1] = f64::NAN;
    let StepError::Diverged(diverged) = step(&model, &method, &mut state, &mut data).unwrap_err() else { panic!() };
    assert_eq!((diverged.body, diverged.quantity, diverged.index), (1, "qpos", 1));
}

/// `implicit` is `implicitfast` for free bodies; MuJoCo's derivative for coupled joints is not in Penny.
#[test]
fn implicit_is_refused_where_it_would_differ() {
    let scene =
        |xml: &str| penny::parse("test.xml", &xml.replace("<mujoco>", "<mujoco><option integrator='implicit'/>"));
    assert!(scene("<mujoco><worldbody><body><freejoint/><geom size='1'/></body></worldbody></mujoco>").is_ok());
    let failure = scene(FLYING).unwrap_err();
    assert_eq!(failure.problems.iter().map(|p| p.kind.code()).collect::<Vec<_>>(), ["unsupported"]);
}
