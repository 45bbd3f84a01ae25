//! Closed forms that a scene can name: `<custom><text name="penny.truth" data="NAME"/>`.
//!
//! Each is a record: the exact number, from the compiled scene and its start; what to look at after every step; and
//! how these signals become one number to compare with the exact one.

mod scene;

use self::scene::*;
use super::Case;
use super::formulas::{SlideToRoll, elliptic_k, euler_disk, free_period, rolling_acceleration, top_precession};
use penny::contact::constants;
use penny::contact::impedance::clamp;
use penny::data::Data;
use penny::dynamics::energy;
use penny::forward::{Method, StepError, step};
use penny::math::{mat, quat};
use penny::model::{GeomKind, JointKind, Model};
use penny::state::State;

/// A closed form.
pub struct Truth {
    /// Value of `penny.truth`.
    pub name: &'static str,
    /// What is measured, with its unit.
    pub quantity: &'static str,
    pub about: &'static str,
    /// The scenes that it is about; "the same": as the one before.
    pub needs: &'static str,
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
        needs: "a free body, or one that slides along z, that touches nothing within --time",
        exact: |case, _| {
            let f = falling(case)?;
            f.lands_not(f.z0 + f.v0 * case.seconds + 0.5 * g(case).z * case.seconds.powi(2))
        },
        signal: |v| falling(v.case).map_or(f64::NAN, |f| v.state.qpos[f.qpos]),
        reduce: Reduce::Last,
    },
    Truth {
        name: "fall-steps",
        quantity: "height [m]",
        about: "semi-implicit Euler: z = z₀ + v₀ n h − g h² n (n + 1)/2",
        needs: "the same, under semi-implicit Euler",
        exact: |case, method| {
            let (h, n) = (method.timestep, (case.seconds / method.timestep).round());
            let f = falling(case)?;
            f.lands_not(f.z0 + f.v0 * h * n + g(case).z * h * h * n * (n + 1.0) / 2.0)
        },
        signal: |v| falling(v.case).map_or(f64::NAN, |f| v.state.qpos[f.qpos]),
        reduce: Reduce::Last,
    },
    Truth {
        name: "spring",
        quantity: "position [m or rad]",
        about: "x = e^(−ζωt) (x₀ cos ω_d t + (v₀ + ζωx₀)/ω_d sin ω_d t),  ω_d = ω √(1 − ζ²)",
        needs: "one joint with a spring about 0 and ζ < 1, without gravity",
        exact: |case, _| spring(case).and_then(|s| s.position(case.seconds)),
        signal: |v| v.state.qpos[0],
        reduce: Reduce::Last,
    },
    Truth {
        name: "dry-spring",
        quantity: "position [m]",
        about: "dry friction F takes 2 F/k of the amplitude in half a swing",
        needs: "one joint with spring and frictionloss, pulled out, without gravity; --time of half a swing",
        exact: |case, _| {
            let spring = spring(case)?;
            let lost = 2.0 * case.model.dofs[0].frictionloss / spring.stiffness;
            let half = (case.seconds * spring.omega / std::f64::consts::PI - 1.0).abs() < 1e-9;
            let swings = lost > 0.0 && spring.x0.abs() > lost && spring.v0 == 0.0 && spring.zeta == 0.0;
            (half && swings).then_some(-(case.start.qpos[0].abs() - lost) * case.start.qpos[0].signum())
        },
        signal: |v| v.state.qpos[0],
        reduce: Reduce::Last,
    },
    Truth {
        name: "pendulum-period",
        quantity: "period [s]",
        about: "T = (4/ω₀) K(sin θ₀/2),  ω₀² = m g l/I",
        needs: "one body on one hinge, angle 0 where it hangs, let go at rest; --time of two periods or more",
        exact: |case, _| {
            let p = pendulum(case)?;
            let omega = (p.moment / p.inertia).sqrt();
            Some(4.0 / omega * elliptic_k((0.5 * case.start.qpos[0]).sin()))
        },
        signal: |v| v.state.qpos[0],
        reduce: Reduce::Period,
    },
    Truth {
        name: "slide-to-roll-speed",
        quantity: "speed [m/s]",
        about: "v = v₀/(1 + k)",
        needs: "a sphere on a free joint and level ground that slides along x without spin, condim 3 or 4; \
                --time past the slip",
        exact: |case, method| Some(slide_to_roll(case, method)?.end_speed()),
        signal: |v| v.state.qvel[0],
        reduce: Reduce::Last,
    },
    Truth {
        name: "slip-end",
        quantity: "time at which slip falls to 1 mm/s [s]",
        about: "t = v₀ k/((1 + k) μ g)",
        needs: "the same",
        exact: |case, method| {
            let slide = slide_to_roll(case, method)?;
            (slide.v0 > SLIP).then_some(slide.slip_end() * (1.0 - SLIP / slide.v0))
        },
        signal: |v| v.state.qvel[0] - ball(v.case, v.method).map_or(0.0, |b| b.radius) * v.state.qvel[4],
        reduce: Reduce::Until(SLIP),
    },
    Truth {
        name: "slide-to-roll-path",
        quantity: "path [m]",
        about: "x = ½ (v₀ + v) t* + v (t − t*)",
        needs: "the same",
        exact: |case, method| Some(slide_to_roll(case, method)?.path(case.seconds)),
        signal: |v| v.state.qpos[0],
        reduce: Reduce::Last,
    },
    Truth {
        name: "incline",
        quantity: "acceleration [m/s²]",
        about: "rolls: a = g sin θ/(1 + k); slips: a = g (sin θ − μ cos θ)",
        needs: "a sphere on a free joint, from rest; gravity that leans along x",
        exact: |case, method| {
            let b = ball(case, method).filter(|_| rests(case) && g(case).x > 0.0)?;
            Some(rolling_acceleration(g(case).x, -g(case).z, b.k, b.friction[0]))
        },
        signal: |v| v.state.qvel[0],
        reduce: Reduce::Rate,
    },
    Truth {
        name: "push",
        quantity: "acceleration [m/s²]",
        about: "rolls: a = F/(m (1 + k)); slips: a = F/m − μ g",
        needs: "a sphere on a free joint and level ground, from rest; one motor that pushes it along x",
        exact: |case, method| {
            let b = ball(case, method).filter(|_| rests(case) && level(case))?;
            let motor = case.model.actuators.first().filter(|_| case.model.actuators.len() == 1)?;
            let push = motor.gear[0] * case.start.ctrl.first()? / b.mass;
            Some(rolling_acceleration(push, -g(case).z, b.k, b.friction[0]))
        },
        signal: |v| v.state.qvel[0],
        reduce: Reduce::Rate,
    },
    Truth {
        name: "rolling-resistance",
        quantity: "acceleration [m/s²]",
        about: "a = −δ g/(R (1 + k))",
        needs: "a sphere on level ground, condim 6, that starts along x and rolls in the second half of --time; \
                free, or with slides along x and z and a hinge about y",
        exact: |case, method| {
            let (b, spin) = roller(case, method)?;
            let slide = SlideToRoll { v0: v0(case)[0], k: b.k, braking: -b.friction[0] * g(case).z };
            let rolls = (spin * b.radius - slide.v0).abs() < 1e-9 * slide.v0;
            let early = rolls || spin == 0.0 && slide.slip_end() < 0.5 * case.seconds;
            let a = b.friction[3] * g(case).z / (b.radius * (1.0 + b.k));
            let fits =
                slide.v0 > 0.0 && b.condim == 6 && level(case) && early && slide.end_speed() + a * case.seconds > 0.0;
            fits.then_some(a)
        },
        signal: |v| v.state.qvel[0],
        reduce: Reduce::Rate,
    },
    Truth {
        name: "spin-down",
        quantity: "angular acceleration [rad/s²]",
        about: "α = −μ_spin m g/I",
        needs: "a sphere on a free joint and level ground, condim 4 or 6, that spins about z for all of --time",
        exact: |case, method| {
            let b = ball(case, method).filter(|b| level(case) && b.condim >= 4)?;
            let slower = b.friction[2] * b.mass * g(case).z / (b.k * b.mass * b.radius * b.radius);
            (v0(case)[5] + slower * case.seconds > 0.0).then_some(slower)
        },
        signal: |v| v.state.qvel[5],
        reduce: Reduce::Rate,
    },
    Truth {
        name: "restitution",
        quantity: "speed after a bounce at 1 m/s [m/s]",
        about: "e = exp(−(ζ/√(1 − ζ²)) (π − atan2(2ζ√(1 − ζ²), 1 − 2ζ²)))",
        needs: "a sphere on a free joint that falls on the ground without gravity; solref in its negative form, ζ < 1",
        exact: |case, method| {
            ball(case, method).filter(|_| weightless(case) && v0(case)[2] < 0.0)?;
            let [stiffness, damping] = case.model.mixes.first()?.solref.map(|x| -x);
            (stiffness > 0.0 && damping >= 0.0 && damping * damping < 4.0 * stiffness).then_some(())?;
            Some(-constants::restitution(damping / (2.0 * stiffness.sqrt())) * v0(case)[2])
        },
        signal: |v| v.state.qvel[2],
        reduce: Reduce::Last,
    },
    Truth {
        name: "collision",
        quantity: "speed of the ball that was hit [m/s]",
        about: "v = 2 m₁/(m₁ + m₂) v₀",
        needs: "two bodies that slide along x, the first hits the second, without gravity; solref without damping",
        exact: |case, _| {
            let [m1, m2] = row(case)?[..] else { return None };
            Some(2.0 * m1 / (m1 + m2) * case.start.qvel[0])
        },
        signal: |v| v.state.qvel[1],
        reduce: Reduce::Last,
    },
    Truth {
        name: "cradle",
        quantity: "speed of the last ball [m/s]",
        about: "v = v₀",
        needs: "equal bodies in a row that slide along x, the first moves, without gravity; solref without damping",
        exact: |case, _| {
            let masses = row(case)?;
            masses.iter().all(|m| *m == masses[0]).then_some(case.start.qvel[0])
        },
        signal: |v| v.state.qvel.last().copied().unwrap_or(0.0),
        reduce: Reduce::Last,
    },
    Truth {
        name: "rest-depth",
        quantity: "depth [m]",
        about: "r = (1 − d) g (τζ)²/n, constant impedance, n equal contacts",
        needs: "a sphere, or a box on its face, that lies still on a free joint; solref in its positive form, \
                solimp with d0 = dwidth",
        exact: |case, _| {
            free(case).filter(|_| rests(case) && level(case))?;
            let mix = case.model.mixes.first().filter(|m| m.solref[0] > 0.0 && m.solimp[0] == m.solimp[1])?;
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
        needs: "a box on a free joint, at rest; gravity that leans along x, but too little to make it slide",
        exact: |case, method| (still_block(case, method)? <= 0.0).then_some(0.0),
        signal: |v| v.state.qvel[0],
        reduce: Reduce::Last,
    },
    Truth {
        name: "block-acceleration",
        quantity: "acceleration [m/s²]",
        about: "a = g (sin θ − μ cos θ)",
        needs: "a box on a free joint, from rest; gravity that leans along x, enough to make it slide",
        exact: |case, method| sliding_block(case, method),
        signal: |v| v.state.qvel[0],
        reduce: Reduce::Rate,
    },
    Truth {
        name: "block-path",
        quantity: "path [m]",
        about: "x = ½ g (sin θ − μ cos θ) t²",
        needs: "the same",
        exact: |case, method| Some(0.5 * sliding_block(case, method)? * case.seconds.powi(2)),
        signal: |v| v.state.qpos[0],
        reduce: Reduce::Last,
    },
    Truth {
        name: "block-path-steps",
        quantity: "path [m]",
        about: "x = ½ g (sin θ − μ cos θ) t (t + h), the sum of semi-implicit Euler's steps",
        needs: "the same, under semi-implicit Euler",
        exact: |case, method| {
            Some(0.5 * sliding_block(case, method)? * case.seconds * (case.seconds + method.timestep))
        },
        signal: |v| v.state.qpos[0],
        reduce: Reduce::Last,
    },
    Truth {
        name: "contact-share",
        quantity: "share of the steps in contact",
        about: "what slides without being thrown stays in contact",
        needs: "the same",
        exact: |case, method| sliding_block(case, method).map(|_| 1.0),
        signal: |v| f64::from(normal_force(v.data) > 0.0),
        reduce: Reduce::Mean,
    },
    Truth {
        name: "friction-ratio",
        quantity: "F_t/F_n, 0 where nothing touches",
        about: "F_t = μ F_n",
        needs: "the same",
        exact: |case, method| sliding_block(case, method).and(mu(case, method)),
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
        needs: "a box on a free joint that slides along x on level ground; --time until it has stopped",
        exact: |case, method| Some(v0(case)[0].powi(2) / (2.0 * stopping_block(case, method)?)),
        signal: |v| v.state.qpos[0],
        reduce: Reduce::Last,
    },
    Truth {
        name: "stop-path-steps",
        quantity: "path [m]",
        about: "x = h n (v₀ − μ g h (n + 1)/2), n = ⌊v₀/(μ g h)⌋, the sum of semi-implicit Euler's steps",
        needs: "the same, under semi-implicit Euler",
        exact: |case, method| {
            let slower = stopping_block(case, method)? * method.timestep;
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
        needs: "the same",
        exact: |case, method| Some((v0(case)[0] - SLIP) / stopping_block(case, method)?),
        signal: |v| v.state.qvel[0],
        reduce: Reduce::Until(SLIP),
    },
    Truth {
        name: "topple",
        quantity: "1 if it tipped",
        about: "a block tips if tan θ > b/h",
        needs: "a box on a free joint, from rest; gravity that leans along x, too little to make it slide",
        exact: |case, method| {
            let size = block(case).filter(|_| still_block(case, method).is_some_and(|a| a <= 0.0))?;
            Some(f64::from(g(case).x > -g(case).z * size.x / size.z))
        },
        signal: |v| f64::from(mat(&quat(&v.state.qpos[3..7]))[(2, 2)] < 0.7),
        reduce: Reduce::Last,
    },
    Truth {
        name: "load-share",
        quantity: "share of the load on the lower edge",
        about: "½ (1 + tan θ h/b)",
        needs: "the same, and too little to make it tip",
        exact: |case, method| {
            let size = block(case).filter(|_| still_block(case, method).is_some_and(|a| a <= 0.0))?;
            let share = 0.5 * (1.0 - g(case).x / g(case).z * size.z / size.x);
            (share < 1.0).then_some(share)
        },
        signal: |v| {
            let below = |c: &&penny::data::Contact| c.pos.x > v.state.qpos[0];
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
        needs: "a free body that turns, without gravity and contacts",
        exact: |case, _| tumbling(case).map(|_| 0.0),
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
        needs: "the same",
        exact: |case, _| tumbling(case).map(|_| 0.0),
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
        needs: "a free body with moments of inertia I₁ < I₂ < I₃ that turns mostly about the second, \
                without gravity and contacts; --time of two periods or more",
        exact: |case, _| {
            let inertia = tumbling(case)?.inertia;
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
        needs: "a symmetric body on a ball joint, with the spin of a slow steady precession; \
                --time of two periods or more",
        exact: |case, _| {
            let body = case.model.bodies.get(1)?;
            (case.model.joints.first()?.kind == JointKind::Ball && case.model.nv == 3).then_some(())?;
            (body.inertia.x == body.inertia.y).then_some(())?;
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
        needs: "a cylinder on a free joint that rolls on its edge about its resting centre; \
                --time of two periods or more",
        exact: |case, _| {
            free(case)?;
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
        needs: "a free plate, pushed by a motor, with free balls on it",
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
    /// The exact number for a case.
    ///
    /// Errors: a sentence that says what the closed form needs, and the scene or its run is not.
    pub fn of(&self, case: &Case, method: &Method) -> Result<f64, String> {
        // The nearest before it that says more than "the same".
        let own = ALL.iter().position(|t| t.name == self.name).unwrap_or(0);
        let full = ALL[..=own].iter().rev().map(|t| t.needs).find(|n| !n.starts_with("the same")).unwrap_or(self.needs);
        let exact = (self.exact)(case, method).filter(|x| x.is_finite());
        let exact = exact.ok_or_else(|| format!("the closed form `{}` is about {full}: this run is not", self.name))?;
        if self.reduce == Reduce::Period && case.seconds < 2.0 * exact {
            let [time, period] = [case.seconds, exact].map(crate::plot::number);
            return Err(format!("a period takes {period} s and --time only {time} s: give it two periods or more"));
        }
        Ok(exact)
    }

    /// Runs the case and measures.
    pub fn measure(&self, case: &Case, method: &Method) -> Result<f64, StepError> {
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

#[cfg(test)]
mod tests {
    #[test]
    fn the_reader_accepts_these_closed_forms_and_no_others() {
        let names: Vec<&str> = super::ALL.iter().map(|truth| truth.name).collect();
        assert_eq!(names, penny::mjcf::PENNY_TRUTHS);
    }
}
