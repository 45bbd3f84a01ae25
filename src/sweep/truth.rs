//! Closed forms that a scene can name: `<custom><text name="penny.truth" data="NAME"/>`.
//!
//! Each is a record: the exact number, from the compiled scene and its start; what to look at after every step; and
//! how these signals become one number to compare with the exact one.

use super::Case;
use super::formulas::{
    SlideToRoll, elliptic_k, euler_disk, free_period, rolling_acceleration, rolling_plate, top_precession,
};
use crate::contact::constants;
use crate::contact::impedance::clamp;
use crate::data::Data;
use crate::dynamics::energy;
use crate::forward::{Diverged, Method, step};
use crate::math::{Vec3, mat, quat, vec3};
use crate::model::{GeomKind, Model};
use crate::state::State;

/// A closed form.
pub struct Truth {
    /// Value of `penny.truth`.
    pub name: &'static str,
    /// What is measured, with its unit.
    pub quantity: &'static str,
    pub about: &'static str,
    /// `None` where the scene is not of the kind that the formula is about.
    pub exact: fn(&Case, &Method) -> Option<f64>,
    pub signal: fn(&mut View) -> f64,
    pub reduce: Reduce,
}

/// What a signal can look at.
pub struct View<'a> {
    pub case: &'a Case,
    pub method: &'a Method,
    pub state: &'a State,
    /// Of the step that led here: its contacts and their forces.
    pub data: &'a Data,
    /// For quantities at the new state.
    pub scratch: &'a mut Data,
}

/// How a signal over time becomes one number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reduce {
    Last,
    /// Over the steps, without the start.
    Mean,
    /// Mean slope over the second half of the run.
    Rate,
    /// First time at or below this, between two steps by a straight line.
    Until(f64),
    /// Mean time between passages through zero upwards.
    Period,
}

pub const ALL: &[Truth] = &[
    Truth {
        name: "fall",
        quantity: "height [m]",
        about: "z = z₀ + v₀ t − ½ g t²",
        exact: |case, _| Some(height(case) + v0(case)[2] * case.seconds + 0.5 * g(case).z * case.seconds.powi(2)),
        signal: |v| v.state.qpos[2],
        reduce: Reduce::Last,
    },
    Truth {
        name: "fall-steps",
        quantity: "height [m]",
        about: "semi-implicit Euler: z = z₀ + v₀ n h − g h² n (n + 1)/2",
        exact: |case, method| {
            let (h, n) = (method.timestep, (case.seconds / method.timestep).round());
            Some(height(case) + v0(case)[2] * h * n + g(case).z * h * h * n * (n + 1.0) / 2.0)
        },
        signal: |v| v.state.qpos[2],
        reduce: Reduce::Last,
    },
    Truth {
        name: "spring",
        quantity: "position [m or rad]",
        about: "x = e^(−ζωt) (x₀ cos ω_d t + (v₀ + ζωx₀)/ω_d sin ω_d t),  ω_d = ω √(1 − ζ²)",
        exact: |case, _| spring(case).and_then(|s| s.position(case.seconds)),
        signal: |v| v.state.qpos[0],
        reduce: Reduce::Last,
    },
    Truth {
        name: "dry-spring",
        quantity: "position [m]",
        about: "dry friction F takes 2 F/k of the amplitude in half a swing",
        exact: |case, _| {
            let spring = spring(case)?;
            let lost = 2.0 * case.model.dofs[0].frictionloss / spring.stiffness;
            Some(-(case.start.qpos[0].abs() - lost) * case.start.qpos[0].signum())
        },
        signal: |v| v.state.qpos[0],
        reduce: Reduce::Last,
    },
    Truth {
        name: "pendulum-period",
        quantity: "period [s]",
        about: "T = (4/ω₀) K(sin θ₀/2),  ω₀² = m g l/I",
        exact: |case, _| {
            let body = case.model.bodies.iter().find(|b| !b.dofs.is_empty())?;
            let l = body.ipos.norm();
            let swing = body.inertia.x + body.mass * l * l;
            let omega = (body.mass * g(case).norm() * l / swing).sqrt();
            Some(4.0 / omega * elliptic_k((0.5 * case.start.qpos[0]).sin()))
        },
        signal: |v| v.state.qpos[0],
        reduce: Reduce::Period,
    },
    Truth {
        name: "slide-to-roll-speed",
        quantity: "speed [m/s]",
        about: "v = v₀/(1 + k)",
        exact: |case, _| Some(slide_to_roll(case)?.end_speed()),
        signal: |v| v.state.qvel[0],
        reduce: Reduce::Last,
    },
    Truth {
        name: "slip-end",
        quantity: "time at which slip falls to 1 mm/s [s]",
        about: "t = v₀ k/((1 + k) μ g)",
        exact: |case, _| {
            let slide = slide_to_roll(case)?;
            Some(slide.slip_end() * (1.0 - SLIP / slide.v0))
        },
        signal: |v| v.state.qvel[0] - ball(v.case).map_or(0.0, |b| b.radius) * v.state.qvel[4],
        reduce: Reduce::Until(SLIP),
    },
    Truth {
        name: "slide-to-roll-path",
        quantity: "path [m]",
        about: "x = ½ (v₀ + v) t* + v (t − t*)",
        exact: |case, _| Some(slide_to_roll(case)?.path(case.seconds)),
        signal: |v| v.state.qpos[0],
        reduce: Reduce::Last,
    },
    Truth {
        name: "incline",
        quantity: "acceleration [m/s²]",
        about: "rolls: a = g sin θ/(1 + k); slips: a = g (sin θ − μ cos θ)",
        exact: |case, _| {
            let b = ball(case)?;
            Some(rolling_acceleration(g(case).x, -g(case).z, b.k, b.friction[0]))
        },
        signal: |v| v.state.qvel[0],
        reduce: Reduce::Rate,
    },
    Truth {
        name: "push",
        quantity: "acceleration [m/s²]",
        about: "rolls: a = F/(m (1 + k)); slips: a = F/m − μ g",
        exact: |case, _| {
            let b = ball(case)?;
            let push = case.start.ctrl.first()? / b.mass;
            Some(rolling_acceleration(push, -g(case).z, b.k, b.friction[0]))
        },
        signal: |v| v.state.qvel[0],
        reduce: Reduce::Rate,
    },
    Truth {
        name: "rolling-resistance",
        quantity: "acceleration [m/s²]",
        about: "a = −δ g/(R (1 + k))",
        exact: |case, _| {
            let b = ball(case)?;
            Some(b.friction[3] * g(case).z / (b.radius * (1.0 + b.k)))
        },
        signal: |v| v.state.qvel[0],
        reduce: Reduce::Rate,
    },
    Truth {
        name: "spin-down",
        quantity: "angular acceleration [rad/s²]",
        about: "α = −μ_spin m g/I",
        exact: |case, _| {
            let b = ball(case)?;
            Some(b.friction[2] * b.mass * g(case).z / (b.k * b.mass * b.radius * b.radius))
        },
        signal: |v| v.state.qvel[5],
        reduce: Reduce::Rate,
    },
    Truth {
        name: "restitution",
        quantity: "speed after a bounce at 1 m/s [m/s]",
        about: "e = exp(−(ζ/√(1 − ζ²)) (π − atan2(2ζ√(1 − ζ²), 1 − 2ζ²)))",
        exact: |case, _| {
            let [stiffness, damping] = case.model.mixes.first()?.solref.map(|x| -x);
            Some(-constants::restitution(damping / (2.0 * stiffness.sqrt())) * v0(case)[2])
        },
        signal: |v| v.state.qvel[2],
        reduce: Reduce::Last,
    },
    Truth {
        name: "collision",
        quantity: "speed of the ball that was hit [m/s]",
        about: "v = 2 m₁/(m₁ + m₂) v₀",
        exact: |case, _| {
            let [m1, m2] = [case.model.bodies.get(1)?.mass, case.model.bodies.get(2)?.mass];
            Some(2.0 * m1 / (m1 + m2) * case.start.qvel[0])
        },
        signal: |v| v.state.qvel[1],
        reduce: Reduce::Last,
    },
    Truth {
        name: "cradle",
        quantity: "speed of the last ball [m/s]",
        about: "v = v₀",
        exact: |case, _| case.start.qvel.first().copied(),
        signal: |v| v.state.qvel.last().copied().unwrap_or(0.0),
        reduce: Reduce::Last,
    },
    Truth {
        name: "rest-depth",
        quantity: "depth [m]",
        about: "r = (1 − d) g (τζ)²/n, constant impedance, n equal contacts",
        exact: |case, _| {
            let mix = case.model.mixes.first()?;
            let (d, points) = (clamp(&mix.solimp)[1], if lowest(case)?.0 == GeomKind::Box { 4.0 } else { 1.0 });
            Some((1.0 - d) * -g(case).z * (mix.solref[0] * mix.solref[1]).powi(2) / points)
        },
        signal: |v| lowest(v.case).map_or(0.0, |(_, half)| half - v.state.qpos[2]),
        reduce: Reduce::Last,
    },
    Truth {
        name: "creep",
        quantity: "speed [m/s]",
        about: "a block sticks if tan θ ≤ μ",
        exact: |case, _| (g(case).x <= -mu(case)? * g(case).z).then_some(0.0),
        signal: |v| v.state.qvel[0],
        reduce: Reduce::Last,
    },
    Truth {
        name: "block-acceleration",
        quantity: "acceleration [m/s²]",
        about: "a = g (sin θ − μ cos θ)",
        exact: |case, _| block_acceleration(case),
        signal: |v| v.state.qvel[0],
        reduce: Reduce::Rate,
    },
    Truth {
        name: "block-path",
        quantity: "path [m]",
        about: "x = ½ g (sin θ − μ cos θ) t²",
        exact: |case, _| Some(0.5 * block_acceleration(case)? * case.seconds.powi(2)),
        signal: |v| v.state.qpos[0],
        reduce: Reduce::Last,
    },
    Truth {
        name: "block-path-steps",
        quantity: "path [m]",
        about: "x = ½ g (sin θ − μ cos θ) t (t + h), the sum of semi-implicit Euler's steps",
        exact: |case, method| Some(0.5 * block_acceleration(case)? * case.seconds * (case.seconds + method.timestep)),
        signal: |v| v.state.qpos[0],
        reduce: Reduce::Last,
    },
    Truth {
        name: "contact-share",
        quantity: "share of the steps in contact",
        about: "what slides without being thrown stays in contact",
        exact: |_, _| Some(1.0),
        signal: |v| f64::from(normal_force(v.data) > 0.0),
        reduce: Reduce::Mean,
    },
    Truth {
        name: "friction-ratio",
        quantity: "F_t/F_n, 0 where nothing touches",
        about: "F_t = μ F_n",
        exact: |case, _| mu(case),
        signal: |v| {
            let tangential: f64 = v.data.contacts.iter().map(|c| c.force[1].hypot(c.force[2])).sum();
            let normal = normal_force(v.data);
            if normal > 0.0 { tangential / normal } else { 0.0 }
        },
        reduce: Reduce::Mean,
    },
    Truth {
        name: "stop-path",
        quantity: "path [m]",
        about: "x = v₀²/(2 μ g)",
        exact: |case, _| Some(v0(case)[0].powi(2) / (-2.0 * mu(case)? * g(case).z)),
        signal: |v| v.state.qpos[0],
        reduce: Reduce::Last,
    },
    Truth {
        name: "stop-path-steps",
        quantity: "path [m]",
        about: "x = h n (v₀ − μ g h (n + 1)/2), n = ⌊v₀/(μ g h)⌋, the sum of semi-implicit Euler's steps",
        exact: |case, method| {
            let slower = -mu(case)? * g(case).z * method.timestep;
            let n = (v0(case)[0] / slower).floor();
            Some(method.timestep * n * (v0(case)[0] - 0.5 * slower * (n + 1.0)))
        },
        signal: |v| v.state.qpos[0],
        reduce: Reduce::Last,
    },
    Truth {
        name: "stop-time",
        quantity: "time at which the speed falls to 1 mm/s [s]",
        about: "t = v₀/(μ g)",
        exact: |case, _| Some((v0(case)[0] - SLIP) / (-mu(case)? * g(case).z)),
        signal: |v| v.state.qvel[0],
        reduce: Reduce::Until(SLIP),
    },
    Truth {
        name: "topple",
        quantity: "1 if it tipped",
        about: "a block tips if tan θ > b/h",
        exact: |case, _| {
            let size = case.model.geoms.iter().find(|geom| geom.kind == GeomKind::Box)?.size;
            Some(f64::from(g(case).x > -g(case).z * size.x / size.z))
        },
        signal: |v| f64::from(mat(&quat(&v.state.qpos[3..7]))[(2, 2)] < 0.7),
        reduce: Reduce::Last,
    },
    Truth {
        name: "load-share",
        quantity: "share of the load on the lower edge",
        about: "½ (1 + tan θ h/b)",
        exact: |case, _| {
            let size = case.model.geoms.iter().find(|geom| geom.kind == GeomKind::Box)?.size;
            Some(0.5 * (1.0 - g(case).x / g(case).z * size.z / size.x))
        },
        signal: |v| {
            let below = |c: &&crate::data::Contact| c.pos.x > v.state.qpos[0];
            let downhill: f64 = v.data.contacts.iter().filter(below).map(|c| c.force[0]).sum();
            let total = normal_force(v.data);
            if total > 0.0 { downhill / total } else { 0.0 }
        },
        reduce: Reduce::Last,
    },
    Truth {
        name: "free-energy",
        quantity: "relative gain of energy",
        about: "a free body keeps its energy",
        exact: |_, _| Some(0.0),
        signal: |v| {
            let kinetic = |state: &State, data: &mut Data| energy::energy(&v.case.model, state, data).kinetic;
            kinetic(v.state, v.scratch) / kinetic(&v.case.start, v.scratch) - 1.0
        },
        reduce: Reduce::Last,
    },
    Truth {
        name: "free-momentum",
        quantity: "relative change of angular momentum",
        about: "a free body keeps its angular momentum",
        exact: |_, _| Some(0.0),
        signal: |v| {
            let momentum = |state: &State, data: &mut Data| energy::momentum(&v.case.model, state, data).angular;
            let before = momentum(&v.case.start, v.scratch);
            (momentum(v.state, v.scratch) - before).norm() / before.norm()
        },
        reduce: Reduce::Last,
    },
    Truth {
        name: "free-period",
        quantity: "period [s]",
        about: "T = 4 K(k)/p about the middle axis",
        exact: |case, _| {
            let inertia = case.model.bodies.get(1)?.inertia;
            let w = v0(case);
            // The inertial frame of the scene is the body's.
            Some(free_period([inertia.x, inertia.y, inertia.z], [w[3], w[4], w[5]]))
        },
        signal: |v| v.state.qvel[4],
        reduce: Reduce::Period,
    },
    Truth {
        name: "top-period",
        quantity: "period of precession [s]",
        about: "I₁ Ω² cos θ − I₃ ω₃ Ω + m g l = 0",
        exact: |case, _| {
            let body = case.model.bodies.get(1)?;
            let l = body.ipos.norm();
            let theta = axis(&case.start.qpos[0..4]).z.acos();
            let transverse = body.inertia.x + body.mass * l * l;
            let moment = body.mass * g(case).norm() * l;
            let omega = top_precession(transverse, body.inertia.z, case.start.qvel[2], moment, theta);
            Some(2.0 * std::f64::consts::PI / omega)
        },
        signal: |v| axis(&v.state.qpos[0..4]).y,
        reduce: Reduce::Period,
    },
    Truth {
        name: "euler-disk",
        quantity: "period [s]",
        about: "Ω² sin α = 4 g/a for a thin disk",
        exact: |case, _| {
            let (body, geom) =
                (case.model.bodies.get(1)?, case.model.geoms.iter().find(|g| g.kind == GeomKind::Cylinder)?);
            let tilt = axis(&case.start.qpos[3..7]).z.acos();
            let weight = body.mass * g(case).norm();
            let omega = euler_disk([geom.size.x, geom.size.y], [body.inertia.x, body.inertia.z], weight, tilt);
            Some(2.0 * std::f64::consts::PI / omega)
        },
        signal: |v| axis(&v.state.qpos[3..7]).y,
        reduce: Reduce::Period,
    },
    Truth {
        name: "rolling-plate",
        quantity: "mean squared error of velocity [m²/s²]",
        about: "SimBenchmark's rolling test",
        exact: |case, _| plate_and_balls(case).map(|_| 0.0),
        signal: |v| plate_and_balls(v.case).map_or(f64::NAN, |a| velocity_error(v, a)),
        reduce: Reduce::Mean,
    },
];

/// Slip that counts as none, m/s.
const SLIP: f64 = 1e-3;

/// The closed form of that name.
pub fn by_name(name: &str) -> Option<&'static Truth> {
    ALL.iter().find(|t| t.name == name)
}

/// The closed form that a scene names.
pub fn of(model: &Model) -> Option<&str> {
    model.texts.get("penny.truth").map(String::as_str)
}

impl Truth {
    /// Runs the case and measures.
    pub fn measure(&self, case: &Case, method: &Method) -> Result<f64, Diverged> {
        let (mut state, mut data, mut scratch) = (case.start.clone(), Data::new(&case.model), Data::new(&case.model));
        let steps = (case.seconds / method.timestep).round() as usize;
        let mut reducer = Reducer::new(self.reduce, steps);
        for i in 0..=steps {
            if i > 0 {
                step(&case.model, method, &mut state, &mut data)?;
            }
            let (state, data, scratch) = (&state, &data, &mut scratch);
            let signal = (self.signal)(&mut View { case, method, state, data, scratch });
            reducer.push(i, state.time - case.start.time, signal);
        }
        Ok(reducer.result())
    }
}

/// Takes the signal step by step.
struct Reducer {
    reduce: Reduce,
    steps: usize,
    last: [f64; 2],
    half: [f64; 2],
    sum: f64,
    /// First and last passage, and how many.
    passages: ([f64; 2], usize),
}

impl Reducer {
    fn new(reduce: Reduce, steps: usize) -> Reducer {
        Reducer { reduce, steps, last: [0.0; 2], half: [0.0; 2], sum: 0.0, passages: ([f64::INFINITY; 2], 0) }
    }

    fn push(&mut self, i: usize, time: f64, value: f64) {
        if i > 0 {
            self.sum += value;
            let [t, before] = self.last;
            let passed = match self.reduce {
                Reduce::Period => (before < 0.0 && value >= 0.0).then_some(0.0),
                Reduce::Until(limit) => (value <= limit && self.passages.1 == 0).then_some(limit),
                _ => None,
            };
            if let Some(level) = passed {
                let at = t + (before - level) / (before - value) * (time - t);
                let (ends, count) = &mut self.passages;
                *ends = if *count == 0 { [at; 2] } else { [ends[0], at] };
                *count += 1;
            }
        }
        self.last = [time, value];
        // The sample that the second half begins with.
        if i == self.steps.div_ceil(2) {
            self.half = self.last;
        }
    }

    fn result(&self) -> f64 {
        let ([first, last], count) = self.passages;
        match self.reduce {
            Reduce::Last => self.last[1],
            Reduce::Mean => self.sum / self.steps as f64,
            Reduce::Rate => (self.last[1] - self.half[1]) / (self.last[0] - self.half[0]),
            Reduce::Until(_) => first,
            Reduce::Period if count > 1 => (last - first) / (count - 1) as f64,
            Reduce::Period => f64::INFINITY,
        }
    }
}

// What the formulas need from a scene. Slopes are gravity that leans along x; bodies start upright.

fn g(case: &Case) -> Vec3 {
    crate::dynamics::gravity(&case.model)
}

fn height(case: &Case) -> f64 {
    case.start.qpos[2]
}

fn v0(case: &Case) -> &[f64] {
    &case.start.qvel
}

/// The axis of a body: its third.
fn axis(wxyz: &[f64]) -> Vec3 {
    mat(&quat(wxyz)).column(2).into()
}

/// Sliding friction of the first contact.
fn mu(case: &Case) -> Option<f64> {
    case.model.mixes.first().map(|mix| mix.friction[0])
}

/// A round free body on a plane.
struct Ball {
    mass: f64,
    radius: f64,
    /// I/(m R²)
    k: f64,
    friction: [f64; 5],
}

fn ball(case: &Case) -> Option<Ball> {
    let tree = case.model.trees.first()?;
    let free = tree.free.as_ref()?;
    let geom = case.model.geoms.iter().find(|geom| geom.body == tree.bodies.start && geom.kind == GeomKind::Sphere)?;
    let radius = geom.size.x;
    let k = free.inertia.y / (free.mass * radius * radius);
    Some(Ball { mass: free.mass, radius, k, friction: case.model.mixes.first()?.friction })
}

fn slide_to_roll(case: &Case) -> Option<SlideToRoll> {
    let b = ball(case)?;
    Some(SlideToRoll { v0: v0(case)[0], k: b.k, braking: -b.friction[0] * g(case).z })
}

fn block_acceleration(case: &Case) -> Option<f64> {
    Some(g(case).x + mu(case)? * g(case).z)
}

/// Kind and half height of the first body's geom.
fn lowest(case: &Case) -> Option<(GeomKind, f64)> {
    let geom = case.model.geoms.iter().find(|geom| geom.body == 1)?;
    Some((geom.kind, if geom.kind == GeomKind::Box { geom.size.z } else { geom.size.x }))
}

fn normal_force(data: &Data) -> f64 {
    data.contacts.iter().map(|c| c.force[0]).sum()
}

/// One joint with a spring, started at `x0` with `v0`.
struct Spring {
    stiffness: f64,
    omega: f64,
    zeta: f64,
    x0: f64,
    v0: f64,
}

fn spring(case: &Case) -> Option<Spring> {
    let (joint, dof) = (case.model.joints.first()?, case.model.dofs.first()?);
    // A single joint: its inverse inertia at the start is exact.
    let mass = 1.0 / dof.invweight0;
    let (x0, v0) = (case.start.qpos[0] - joint.springref, case.start.qvel[0]);
    let omega = (joint.stiffness / mass).sqrt();
    let zeta = dof.damping / (2.0 * (joint.stiffness * mass).sqrt());
    Some(Spring { stiffness: joint.stiffness, omega, zeta, x0, v0 })
}

impl Spring {
    fn position(&self, t: f64) -> Option<f64> {
        let damped = self.omega * (1.0 - self.zeta * self.zeta).sqrt();
        let rate = self.zeta * self.omega;
        let swing = self.x0 * (damped * t).cos() + (self.v0 + rate * self.x0) / damped * (damped * t).sin();
        (self.zeta < 1.0).then_some((-rate * t).exp() * swing)
    }
}

/// Acceleration vectors of SimBenchmark's plate (the first body, pushed by the first actuator) and of its balls.
fn plate_and_balls(case: &Case) -> Option<[Vec3; 2]> {
    let [plate, ball] = [case.model.trees.first()?.free.as_ref()?, case.model.trees.get(1)?.free.as_ref()?];
    let radius = case.model.geoms.iter().find(|g| g.kind == GeomKind::Sphere)?.size.x;
    let push = vec3(&case.model.actuators.first()?.gear) * *case.start.ctrl.first()?;
    let friction = case.model.geoms.iter().find(|g| g.kind == GeomKind::Box)?.friction[0];
    let n = (case.model.trees.len() - 1) as f64;
    let k = ball.inertia.y / (ball.mass * radius * radius);
    let speeds = rolling_plate(plate.mass, ball.mass, n, push.norm(), friction, -g(case).z, k);
    Some(speeds.map(|a| a * push.normalize()))
}

fn velocity_error(v: &View, [plate, ball]: [Vec3; 2]) -> f64 {
    let t = v.state.time - v.case.start.time;
    let away = |i: usize, a: Vec3| (vec3(&v.state.qvel[6 * i..]) - a * t).norm_squared();
    let n = v.case.model.trees.len() - 1;
    away(0, plate) + (1..=n).map(|i| away(i, ball)).sum::<f64>() / n as f64
}
