//! Where the goal is, when it counts, and when the ball may be pushed.

use crate::random::Random;
use crate::session::Session;
use penny::math::Vec3;
use penny::model::{JointKind, Model};
use penny::state::State;

/// The goal lies in the plane x = `line` and is scored towards +x.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rules {
    /// Body and radius of the ball.
    pub ball: usize,
    pub radius: f64,
    /// m
    pub line: f64,
    /// Half the distance between the posts and the height of the bar (their inner edges), m.
    pub half_width: f64,
    pub height: f64,
}

/// How a round ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    Goal,
    /// Over the line, but not through the goal.
    Wide,
    /// The ball stopped, or time ran out.
    Stopped,
}

impl Outcome {
    pub fn name(self) -> &'static str {
        match self {
            Outcome::Goal => "goal",
            Outcome::Wide => "wide",
            Outcome::Stopped => "stopped",
        }
    }
}

/// The ball may be pushed while all of it is at least this far from the line, m.
pub const FAIR: f64 = 1.0;

impl Rules {
    /// Reads `<custom><numeric name="penny.goal" data="line half-width height"/>` and the body `ball`.
    pub fn of(model: &Model) -> Option<Rules> {
        let [line, half_width, height] = model.numerics.get("penny.goal")?[..] else { return None };
        let ball = model.bodies.iter().position(|b| b.name == "ball")?;
        let geom = model.bodies[ball].geoms.clone().next()?;
        Some(Rules { ball, radius: model.geoms[geom].size.x, line, half_width, height })
    }

    /// The ball's centre after the last step.
    pub fn centre(&self, session: &Session) -> Vec3 {
        session.data.xpos[self.ball]
    }

    /// From the ball's nearest point to the line, m; negative once it touches the line.
    pub fn distance(&self, centre: &Vec3) -> f64 {
        self.line - (centre.x + self.radius)
    }

    pub fn may_push(&self, centre: &Vec3) -> bool {
        self.distance(centre) >= FAIR
    }

    /// Whether the ball's step from `before` to `now` decides the round.
    ///
    /// The round is decided at the moment when the whole ball is over the line, x − r = line, found on the straight
    /// line between the two centres: a goal if its centre is then between the posts and under the bar.
    pub fn decide(&self, before: &Vec3, now: &Vec3) -> Option<Outcome> {
        let over = |p: &Vec3| p.x - self.radius - self.line;
        let (a, b) = (over(before), over(now));
        if a >= 0.0 || b < 0.0 {
            return None;
        }
        let at = before.lerp(now, a / (a - b));
        let inside = at.y.abs() < self.half_width && at.z < self.height;
        Some(if inside { Outcome::Goal } else { Outcome::Wide })
    }

    /// Gives the ball the teammate's pass: rolling without slip, from a side, at a speed.
    ///
    ///     ω = ẑ × v / r
    pub fn pass(&self, model: &Model, seed: u64, state: &mut State) {
        let mut random = Random(seed);
        let body = &model.bodies[self.ball];
        let joint = &model.joints[body.joints.start];
        let (q, v) = (joint.qposadr, joint.dofadr);
        if joint.kind != JointKind::Free {
            // Slides along x and z, hinge about y: rolling towards the goal, ω_y = v / r.
            let speed = random.between(0.4, 1.6);
            state.qpos[q] += random.between(-1.0, 0.0);
            state.qvel[v] = speed;
            state.qvel[v + 2] = speed / self.radius;
            return;
        }
        let side = if random.between(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 };
        let from = Vec3::new(self.line - random.between(3.5, 6.0), side * random.between(3.5, 4.5), self.radius);
        let to = Vec3::new(self.line - random.between(2.5, 4.5), 0.0, self.radius);
        let velocity = (to - from).normalize() * random.between(2.6, 4.2);
        state.qpos[q..q + 3].copy_from_slice(from.as_slice());
        state.qvel[v..v + 3].copy_from_slice(velocity.as_slice());
        let spin = Vec3::z().cross(&velocity) / self.radius;
        state.qvel[v + 3..v + 6].copy_from_slice(spin.as_slice());
    }
}
