//! The contacts of a scene as it is written, one line each: the two geoms, distance, point and normal.
//!
//!     cargo run --release --example contacts scene.xml
//!
//! Numbers have all their digits: `tests/collision/pairs.py` compares them with MuJoCo's.

use std::io::Write;

use penny::collision::detect;
use penny::data::Data;
use penny::dynamics::kinematics;
use penny::state::State;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("name a scene")?;
    let model = penny::load(path.as_ref()).map_err(|failure| failure.to_string())?.model;
    let state = State::new(&model);
    let mut data = Data::new(&model);
    kinematics(&model, &state.qpos, &mut data);
    detect(&model, &mut data);
    let mut out = std::io::BufWriter::new(std::io::stdout().lock());
    for c in &data.contacts {
        let normal = c.frame.row(0);
        write!(out, "{} {} {:e}", c.geom[0], c.geom[1], c.dist)?;
        for x in c.pos.iter().chain(normal.iter()) {
            write!(out, " {x:e}")?;
        }
        writeln!(out)?;
    }
    Ok(())
}
