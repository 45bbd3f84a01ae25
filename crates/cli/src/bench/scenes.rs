//! The scenes that `penny bench` measures when none are named.

use super::{Case, Failure, Source};
use penny::state::State;

/// A sphere, a box, the tutorial's disk, a T-shape; a stack and a pile; what has joints; many spheres apart from one another.
pub fn all() -> Result<Vec<Case>, Failure> {
    let disk = include_str!("disk.xml").to_owned();
    let mut cases = vec![
        case("sphere rolling", spheres(1), |s| s.qvel = vec![1.0, 0.0, 0.0, 0.0, 10.0, 0.0])?,
        case("box at rest", boxes(1), |_| ())?,
        case("disk (models/disk.xml, spinning)", disk, |s| s.qvel = vec![2.0, 0.0, 0.0, 0.0, 10.0, 0.0])?,
        case("T-shape at rest", tee(), |_| ())?,
        case("stack of 10 boxes", boxes(10), |_| ())?,
        case("pile of 30", pile(30), |_| ())?,
        case("arm of three joints", arm(), |_| ())?,
        case("walker with four legs, lying", walker(), |_| ())?,
        case("car on four wheels, driving", car(), |s| s.ctrl.fill(20.0))?,
    ];
    for n in [10, 100, 1000] {
        cases.push(case(&format!("{n} spheres"), spheres(n), |_| ())?);
    }
    Ok(cases)
}

fn case(name: &str, text: String, begin: impl FnOnce(&mut State)) -> Result<Case, Failure> {
    let model = penny::parse(name, &text).map_err(|f| Failure::Problem(f.to_string()))?.model;
    let mut start = State::new(&model);
    begin(&mut start);
    Ok(Case { name: name.to_owned(), source: Source::Text(text), model, start })
}

/// A plane and these bodies.
fn on_a_plane(bodies: &str) -> String {
    format!(r#"<mujoco><worldbody><geom type="plane" size="50 50 1"/>{bodies}</worldbody></mujoco>"#)
}

/// Spheres of 10 cm on a square grid, half a metre apart.
fn spheres(n: usize) -> String {
    let side = (n as f64).sqrt().ceil() as usize;
    let one = |i: usize| {
        let (x, y) = ((i % side) as f64 * 0.5, (i / side) as f64 * 0.5);
        format!(r#"<body pos="{x} {y} 0.101"><freejoint/><geom size="0.1" mass="1"/></body>"#)
    };
    on_a_plane(&(0..n).map(one).collect::<String>())
}

/// Boxes of 20 cm on one another, a millimetre apart.
fn boxes(n: usize) -> String {
    let one = |i: usize| {
        let z = 0.101 + 0.201 * i as f64;
        format!(r#"<body pos="0 0 {z}"><freejoint/><geom type="box" size="0.1 0.1 0.1" mass="1"/></body>"#)
    };
    on_a_plane(&(0..n).map(one).collect::<String>())
}

/// Boxes, spheres and capsules that fall on one heap: five a layer, each layer turned against the one below.
fn pile(n: usize) -> String {
    let one = |i: usize| {
        let angle = 0.4 * std::f64::consts::TAU * i as f64 + 0.3 * (i / 5) as f64;
        let (x, y, z) = (0.15 * angle.cos(), 0.15 * angle.sin(), 0.15 + 0.25 * (i / 5) as f64);
        let geom = match i % 3 {
            0 => r#"type="box" size="0.08 0.06 0.05""#,
            1 => r#"type="sphere" size="0.07""#,
            _ => r#"type="capsule" size="0.05 0.06""#,
        };
        format!(r#"<body pos="{x} {y} {z}" euler="{i} 40 70"><freejoint/><geom {geom} mass="1"/></body>"#)
    };
    on_a_plane(&(0..n).map(one).collect::<String>())
}

/// An arm on a table that servos hold out, in the air.
fn arm() -> String {
    let link = |name: &str, axis: &str, inner: &str| {
        format!(
            r#"<body pos="0.3 0 0"><joint name="{name}" axis="{axis}" damping="0.5"/>
               <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.03"/>{inner}</body>"#
        )
    };
    let links = link("shoulder", "0 0 1", &link("elbow", "0 1 0", &link("wrist", "0 1 0", "")));
    let servo = |joint: &str| format!(r#"<position joint="{joint}" kp="100"/>"#);
    let servos: String = ["shoulder", "elbow", "wrist"].map(servo).concat();
    format!(
        r#"<mujoco><worldbody><geom type="plane" size="50 50 1"/><body pos="0 0 1">{links}</body></worldbody>
           <actuator>{servos}</actuator></mujoco>"#
    )
}

/// A body on four legs of two joints, without drive: it falls and lies.
fn walker() -> String {
    let leg = |(x, y): (f64, f64)| {
        format!(
            r#"<body pos="{x} {y} 0"><joint axis="0 1 0" range="-60 60" damping="0.5" armature="0.01"/>
               <geom type="capsule" fromto="0 0 0 0 0 -0.2" size="0.03"/>
               <body pos="0 0 -0.2"><joint axis="0 1 0" range="-90 0" damping="0.5" armature="0.01"/>
               <geom type="capsule" fromto="0 0 0 0 0 -0.2" size="0.03"/></body></body>"#
        )
    };
    let legs = [(0.2, 0.15), (0.2, -0.15), (-0.2, 0.15), (-0.2, -0.15)].map(leg).concat();
    on_a_plane(&format!(r#"<body pos="0 0 0.5"><freejoint/><geom type="box" size="0.25 0.12 0.05"/>{legs}</body>"#))
}

/// A car whose four wheels are driven.
fn car() -> String {
    let wheel = |(i, (x, y)): (usize, (f64, f64))| {
        format!(
            r#"<body pos="{x} {y} -0.1" euler="90 0 0"><joint name="{i}" axis="0 0 1" damping="0.01"/>
               <geom type="cylinder" size="0.1 0.03" mass="0.3"/></body>"#
        )
    };
    let places = [(0.25, 0.2), (0.25, -0.2), (-0.25, 0.2), (-0.25, -0.2)];
    let wheels: String = places.into_iter().enumerate().map(wheel).collect();
    let motors: String = (0..4).map(|i| format!(r#"<velocity joint="{i}" kv="0.5"/>"#)).collect();
    format!(
        r#"<mujoco><worldbody><geom type="plane" size="50 50 1"/><body pos="0 0 0.201"><freejoint/>
           <geom type="box" size="0.3 0.15 0.05" mass="3"/>{wheels}</body></worldbody><actuator>{motors}</actuator></mujoco>"#
    )
}

/// A T that lies on its back.
fn tee() -> String {
    let geoms = r#"<geom type="box" pos="0 0.125 0" size="0.2 0.05 0.05" mass="0.5"/>
                   <geom type="box" pos="0 -0.125 0" size="0.05 0.2 0.05" mass="0.5"/>"#;
    on_a_plane(&format!(r#"<body pos="0 0 0.051"><freejoint/>{geoms}</body>"#))
}
