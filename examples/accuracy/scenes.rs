//! The scenes: those in `models/`, twenty trees of joints with actuators, and twenty heaps of things that touch.

use std::error::Error;
use std::fmt::Write;

use penny::state::State;
use penny::{Failure, Scene};
use penny_lab::sweep::Case;

/// Random scenes of a kind.
const RANDOM: usize = 20;

/// All cases: name, and the scene for this many seconds.
pub fn all(seconds: f64) -> Result<Vec<(String, Case)>, Box<dyn Error>> {
    let mut files: Vec<_> = std::fs::read_dir("models")?.map(|e| e.map(|e| e.path())).collect::<Result<_, _>>()?;
    files.retain(|f| f.extension().is_some_and(|e| e == "xml"));
    files.sort();
    let mut scenes = Vec::new();
    for file in files {
        let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        scenes.push((name, penny::load(&file)));
    }
    let random = |name: String, text: String| (name.clone(), penny::parse(&name, &text));
    scenes.extend((0..RANDOM).map(|i| random(format!("joints-{i}"), joints(&mut Random(i as u64)))));
    scenes.extend((0..RANDOM).map(|i| random(format!("contact-{i}"), contact(&mut Random(1000 + i as u64)))));
    let case = |(name, scene): (String, Result<Scene, Failure>)| {
        let scene = scene.map_err(|e| format!("{name}: {e}"))?;
        let mut start = State::new(&scene.model);
        start.ctrl.iter_mut().enumerate().for_each(|(i, ctrl)| *ctrl = 0.3 + 0.2 * i as f64);
        Ok((name, Case { start, model: scene.model, seconds }))
    };
    scenes.into_iter().map(case).collect()
}

/// Numbers that are the same on every machine: SplitMix64.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) as f64 / u64::MAX as f64
    }

    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Evenly distributed in its logarithm.
    fn scale(&mut self, low: f64, high: f64) -> f64 {
        self.within(low.ln(), high.ln()).exp()
    }

    fn below(&mut self, n: usize) -> usize {
        (self.unit() * n as f64) as usize % n
    }
}

/// A chain of one to five hinges, slides and balls with springs and dampers over three decades, half of them driven.
fn joints(random: &mut Random) -> String {
    let links = 1 + random.below(5);
    let (mut open, mut close, mut actuators) = (String::new(), String::new(), String::new());
    for i in 0..links {
        let kind = ["hinge", "hinge", "slide", "ball"][random.below(4)];
        let axis = ["1 0 0", "0 1 0", "0 0 1", "0.6 0.8 0"][random.below(4)];
        let axis = if kind == "ball" { String::new() } else { format!(" axis=\"{axis}\"") };
        let (stiffness, damping) = (random.scale(0.3, 300.0), random.scale(0.01, 1.0));
        let length = random.within(0.1, 0.4);
        let at = if i == 0 { 0.0 } else { -0.3 };
        let _ = write!(
            open,
            r#"<body pos="0 0 {at}"><joint name="j{i}" type="{kind}"{axis} stiffness="{stiffness}" damping="{damping}"/>
            <geom type="capsule" fromto="0 0 0 {} 0 {}" size="0.03" density="1000" contype="0" conaffinity="0"/>"#,
            random.within(-0.1, 0.1),
            -length
        );
        close += "</body>";
        if kind != "ball" && random.unit() < 0.5 {
            let gain = random.scale(0.5, 50.0);
            actuators += &match random.below(3) {
                0 => format!(r#"<motor joint="j{i}" gear="{gain}"/>"#),
                1 => format!(r#"<position joint="j{i}" kp="{gain}"/>"#),
                _ => format!(r#"<velocity joint="j{i}" kv="{}"/>"#, 0.1 * gain),
            };
        }
    }
    format!("<mujoco><worldbody>{open}{close}</worldbody><actuator>{actuators}</actuator></mujoco>")
}

/// One to four things of any shape, thrown on the ground.
fn contact(random: &mut Random) -> String {
    let mut bodies = String::new();
    for i in 0..1 + random.below(4) {
        let size = random.within(0.05, 0.15);
        let (kind, sizes) = match random.below(5) {
            0 => ("box", format!("{size} {} {}", 0.8 * size, 0.6 * size)),
            1 => ("capsule", format!("{} {size}", 0.5 * size)),
            2 => ("cylinder", format!("{size} {}", 0.7 * size)),
            3 => ("ellipsoid", format!("{size} {} {}", 0.8 * size, 0.7 * size)),
            _ => ("sphere", format!("{size}")),
        };
        let _ = write!(
            bodies,
            r#"<body pos="{} {} {}" euler="{} {} 0"><freejoint/><geom type="{kind}" size="{sizes}" density="{}"
            friction="{} 0.005 0.0001" solref="{} {}" condim="{}"/></body>"#,
            random.within(-0.3, 0.3),
            random.within(-0.3, 0.3),
            0.3 + 0.4 * i as f64,
            random.within(-40.0, 40.0),
            random.within(-40.0, 40.0),
            random.scale(200.0, 5000.0),
            random.within(0.2, 1.0),
            random.scale(0.005, 0.05),
            random.within(0.5, 1.5),
            [1, 3, 4, 6][random.below(4)],
        );
    }
    format!(r#"<mujoco><worldbody><geom type="plane" size="5 5 1"/>{bodies}</worldbody></mujoco>"#)
}
