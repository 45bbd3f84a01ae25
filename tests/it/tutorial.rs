//! The tutorial law against an independent transcription of each algorithm of the course.
//!
//! The course's plane is (x, y) with θ counterclockwise; Penny's is (x, z) with a hinge about y, so θ = −qpos[2].

use crate::penalty::distance;
use crate::sim::Sim;
use penny::contact::tutorial;
use penny::data::Data;
use penny::forward::{Method, step};
use penny::state::State;

const K: f64 = 4000.0;
const C: f64 = 30.0;
const MU: f64 = 0.5;
const ALPHA: f64 = 20.0;
const H: f64 = 1e-3;
const G: f64 = 9.81;

fn scene(geom_defaults: &str, joints: &str, geoms: &str) -> String {
    format!(
        r#"<mujoco><option timestep="0.001"/><default><geom friction="{MU} 0 0.02" {geom_defaults}/></default>
        <custom>
          <numeric name="penny.k" data="{K}"/><numeric name="penny.c" data="{C}"/>
          <numeric name="penny.alpha" data="{ALPHA}"/><text name="penny.contact" data="tutorial"/>
        </custom>
        <worldbody><geom type="plane" size="5 5 .1"/><body pos="0 0 1">{joints}{geoms}</body></worldbody></mujoco>"#
    )
}

const PLANAR: &str =
    r#"<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/><joint type="hinge" axis="0 1 0"/>"#;

/// CONTACTFORCE of the course: force on a point at height `y` that moves with `v`.
fn contact_force(k: f64, c: f64, y: f64, v: [f64; 2]) -> [f64; 2] {
    if y >= 0.0 {
        return [0.0, 0.0];
    }
    let normal = k * -y + c * (-v[1]).max(0.0);
    [-MU * normal * (ALPHA * v[0]).tanh(), normal]
}

/// A planar rigid body of the course.
struct Planar {
    m: f64,
    i: f64,
    p: [f64; 2],
    v: [f64; 2],
    theta: f64,
    omega: f64,
}

impl Planar {
    /// Algorithms 2 and 3: forces at every vertex below ground; each stands for `count` contact points.
    fn step_vertices(&mut self, vertices: &[[f64; 2]], count: f64) {
        let (s, co) = self.theta.sin_cos();
        let (mut force, mut torque) = ([0.0, -self.m * G], 0.0);
        for c in vertices {
            let r = [co * c[0] - s * c[1], s * c[0] + co * c[1]];
            let v = [self.v[0] - self.omega * r[1], self.v[1] + self.omega * r[0]];
            let f = contact_force(count * K, count * C, self.p[1] + r[1], v);
            force = [force[0] + f[0], force[1] + f[1]];
            torque += r[0] * f[1] - r[1] * f[0];
        }
        self.advance(force, torque);
    }

    fn advance(&mut self, force: [f64; 2], torque: f64) {
        for k in 0..2 {
            self.v[k] += force[k] / self.m * H;
            self.p[k] += self.v[k] * H;
        }
        self.omega += torque / self.i * H;
        self.theta += self.omega * H;
    }

    fn compare(&self, sim: &Sim, step: usize) {
        let ours = [sim.state.qpos[0], sim.state.qpos[1] + 1.0, -sim.state.qpos[2]];
        for (ours, theirs) in ours.into_iter().zip([self.p[0], self.p[1], self.theta]) {
            assert!((ours - theirs).abs() < 1e-12, "step {step}: {ours} against {theirs}");
        }
    }
}

/// Algorithm 1: a point mass falls on its contact height, here the radius of its sphere.
#[test]
fn point_mass_follows_algorithm_1() {
    let joints = r#"<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>"#;
    let mut sim = Sim::new(&scene("", joints, r#"<geom type="sphere" size="0.1" mass="2"/>"#));
    sim.state.qvel.copy_from_slice(&[1.5, 0.0]);
    let (mut p, mut v) = ([0.0, 1.0], [1.5, 0.0]);
    for step in 0..3000 {
        let f = contact_force(K, C, p[1] - 0.1, v);
        for (k, f) in [f[0], f[1] - 2.0 * G].into_iter().enumerate() {
            v[k] += f / 2.0 * H;
            p[k] += v[k] * H;
        }
        sim.step();
        assert!((sim.state.qpos[0] - p[0]).abs() < 1e-12, "step {step}: x {} against {}", sim.state.qpos[0], p[0]);
        assert!(
            (sim.state.qpos[1] + 1.0 - p[1]).abs() < 1e-12,
            "step {step}: z {} against {}",
            sim.state.qpos[1] + 1.0,
            p[1]
        );
    }
}

/// Algorithm 2: the four corners of a box. In space every corner of the plane's box exists twice.
#[test]
fn box_follows_algorithm_2() {
    let mut sim = Sim::new(&scene("", PLANAR, r#"<geom type="box" size="0.2 0.1 0.1" mass="1"/>"#));
    sim.state.qpos[2] = -0.3;
    sim.state.qvel.copy_from_slice(&[1.0, 0.0, -2.0]);
    let i = 1.0 / 12.0 * (0.4f64.powi(2) + 0.2f64.powi(2));
    let mut body = Planar { m: 1.0, i, p: [0.0, 1.0], v: [1.0, 0.0], theta: 0.3, omega: 2.0 };
    let corners = [[-0.2, -0.1], [0.2, -0.1], [-0.2, 0.1], [0.2, 0.1]];
    for step in 0..1000 {
        body.step_vertices(&corners, 2.0);
        sim.step();
        body.compare(&sim, step);
    }
}

/// Algorithm 3: a T of two boxes; total mass, centre of mass and inertia about it from the course's formulas.
///
/// The body's origin is the centre of mass, as in the course: one step of Euler's method at another point of the
/// body is another step, by O(h²).
#[test]
fn compound_body_follows_algorithm_3() {
    let (bar, stem) = (-0.1, 0.15);
    let com = (1.5 * bar + 1.0 * stem) / 2.5;
    assert!(f64::abs(com) < 1e-15);
    let geoms = format!(
        r#"<geom type="box" pos="0 0 {bar}" size="0.3 0.1 0.05" mass="1.5"/>
        <geom type="box" pos="0 0 {stem}" size="0.05 0.1 0.2" mass="1"/>"#
    );
    let mut sim = Sim::new(&scene("", PLANAR, &geoms));
    sim.state.qpos[2] = -0.4;
    let part = |m: f64, w: f64, h: f64, y: f64| m / 12.0 * (w * w + h * h) + m * (y - com) * (y - com);
    let i = part(1.5, 0.6, 0.1, bar) + part(1.0, 0.1, 0.4, stem);
    let mut vertices = vec![];
    for (w, h, y) in [(0.3, 0.05, bar), (0.05, 0.2, stem)] {
        for (a, b) in [(-w, -h), (w, -h), (-w, h), (w, h)] {
            vertices.push([a, y + b - com]);
        }
    }
    let mut body = Planar { m: 2.5, i, p: [0.0, 1.0], v: [0.0; 2], theta: 0.4, omega: 0.0 };
    for step in 0..1000 {
        body.step_vertices(&vertices, 2.0);
        sim.step();
        body.compare(&sim, step);
    }
}

/// Algorithm 4: one contact point below the centre, sliding and rolling friction.
#[test]
fn circle_follows_algorithm_4() {
    let inertial = r#"<inertial pos="0 0 0" mass="1" diaginertia="0.02 0.02 0.02"/>"#;
    let sphere = format!(r#"{inertial}<geom type="sphere" size="0.2"/>"#);
    let mut sim = Sim::new(&scene(r#"condim="6""#, PLANAR, &sphere));
    sim.state.qvel.copy_from_slice(&[2.0, 0.0, 3.0]);
    let mut body = Planar { m: 1.0, i: 0.02, p: [0.0, 1.0], v: [2.0, 0.0], theta: 0.0, omega: -3.0 };
    for step in 0..1000 {
        let r = [0.0, -0.2];
        let v = [body.v[0] - body.omega * r[1], body.v[1] + body.omega * r[0]];
        let f = contact_force(K, C, body.p[1] + r[1], v);
        let roll = if body.omega == 0.0 { 0.0 } else { 0.02 * f[1] * body.omega.signum() };
        body.advance([f[0], f[1] - G], r[0] * f[1] - r[1] * f[0] - roll);
        sim.step();
        body.compare(&sim, step);
    }
}

/// Rest depth m g/k; and without gravity, a damper that works on approach only bounces with
/// e = exp(−ζ/√(1−ζ²) arccos ζ): damped to the lowest point, then a free half-swing out.
#[test]
fn rest_depth_and_restitution_are_the_closed_forms() {
    let joints = r#"<joint type="slide" axis="0 0 1"/>"#;
    let sphere = r#"<geom type="sphere" size="0.1" mass="1"/>"#;
    let mut sim = Sim::new(&scene("", joints, sphere));
    sim.run(20.0);
    let depth = 0.1 - (1.0 + sim.state.qpos[0]);
    assert!((depth / (G / K) - 1.0).abs() < 1e-9, "depth {depth}, m g/k {}", G / K);

    for zeta in [0.05, 0.2, 0.5, 0.9] {
        let c = 2.0 * zeta * K.sqrt();
        let xml = scene("", joints, sphere)
            .replace(r#"timestep="0.001""#, r#"timestep="0.00001" gravity="0 0 0""#)
            .replace(&format!(r#"name="penny.c" data="{C}""#), &format!(r#"name="penny.c" data="{c}""#));
        let mut sim = Sim::new(&xml);
        sim.state.qpos[0] = -0.89;
        sim.state.qvel[0] = -1.0;
        sim.run(0.2);
        let expected = (-zeta / (1.0 - zeta * zeta).sqrt() * zeta.acos()).exp();
        // First-order integrator: error of a few h ω.
        assert!((sim.state.qvel[0] - expected).abs() < 2e-3, "ζ {zeta}: {} against {expected}", sim.state.qvel[0]);
    }
}

/// The torque's sign jumps at rest. Backward Euler has to find the torque that just ends the spin.
#[test]
fn an_implicit_step_ends_a_spin_without_chatter() {
    let text = r#"<mujoco><default><geom condim="4" friction="0 .01 0"/></default>
        <custom><text name="penny.contact" data="tutorial"/></custom>
        <worldbody><geom type="plane" size="5 5 .1"/>
        <body pos="0 0 .1"><freejoint/><geom size=".1" mass="1"/></body></worldbody></mujoco>"#;
    let model = penny::parse("spin.xml", text).unwrap_or_else(|e| panic!("{e}")).model;
    let integrator = penny::integrate::by_name("implicit-euler").expect("an integrator");
    let method = Method { contact: &tutorial::LAW, integrator, timestep: H, rounds: penny::forward::ROUNDS };
    let (mut state, mut data) = (State::new(&model), Data::new(&model));
    state.qvel[5] = 1.0;
    // It slows by mu m g / I = 24.5 rad/s^2 and stops after 41 ms.
    for _ in 0..500 {
        step(&model, &method, &mut state, &mut data).expect("a step");
    }
    assert!(state.qvel[5].abs() < 1e-6, "{} rad/s", state.qvel[5]);
    assert!((state.qpos[2] - 0.1).abs() < 0.01, "z {}", state.qpos[2]);
    assert_eq!(data.unsolved, 0);
}

/// A contact's spring is that of the body which touches, as `explain` says: also where that body is welded to the one with the joints,
/// for which MuJoCo's estimate of what it weighs is another.
#[test]
fn what_is_welded_to_a_body_touches_as_that_body_would() {
    let boxes = "<geom type='box' size='.1 .15 .2' mass='2'/>";
    let rest = |inside: &str, joints: &str| {
        let text = format!(
            "<mujoco><option timestep='.001'/><worldbody><geom type='plane' size='9 9 1'/>
             <body pos='0 0 .21'>{joints}{inside}</body></worldbody></mujoco>"
        );
        let mut sim = Sim::law(&text, "tutorial");
        sim.run(0.5);
        sim.state.qpos
    };
    // The closed form for free bodies, and the general way.
    for joints in ["<freejoint/>", "<joint type='slide' axis='0 0 1'/><joint axis='0 1 0'/>"] {
        let off = distance(&rest(boxes, joints), &rest(&format!("<body>{boxes}</body>"), joints));
        assert!(off < 1e-9, "{joints}: {off:e} m");
    }
}
