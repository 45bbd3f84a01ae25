//! The scenes that `penny bench` measures when none are named.

use super::{Case, Failure, Source};
use penny::state::State;

/// A sphere, a box, the tutorial's disk, a T-shape; many spheres apart from one another; a stack.
pub fn all() -> Result<Vec<Case>, Failure> {
    let disk = include_str!("disk.xml").to_owned();
    let mut cases = vec![
        case("sphere rolling", spheres(1), Some(&[1.0, 0.0, 0.0, 0.0, 10.0, 0.0]))?,
        case("box at rest", boxes(1), None)?,
        case("disk (models/disk.xml, spinning)", disk, Some(&[2.0, 0.0, 0.0, 0.0, 10.0, 0.0]))?,
        case("T-shape at rest", tee(), None)?,
        case("stack of 10 boxes", boxes(10), None)?,
    ];
    for n in [10, 100, 1000] {
        cases.push(case(&format!("{n} spheres"), spheres(n), None)?);
    }
    Ok(cases)
}

fn case(name: &str, text: String, qvel: Option<&[f64]>) -> Result<Case, Failure> {
    let model = penny::parse(name, &text).map_err(|f| Failure::Problem(f.to_string()))?.model;
    let mut start = State::new(&model);
    if let Some(qvel) = qvel {
        start.qvel.copy_from_slice(qvel);
    }
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

/// A T that lies on its back.
fn tee() -> String {
    let geoms = r#"<geom type="box" pos="0 0.125 0" size="0.2 0.05 0.05" mass="0.5"/>
                   <geom type="box" pos="0 -0.125 0" size="0.05 0.2 0.05" mass="0.5"/>"#;
    on_a_plane(&format!(r#"<body pos="0 0 0.051"><freejoint/>{geoms}</body>"#))
}
