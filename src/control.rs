//! Steps whose size follows the error: short where the motion changes suddenly, long where it does not.
//!
//!     take a step h;  e its estimated error, over the tolerance
//!     e ≤ 1: keep it,   h ← h · 0.9 e^(−0.7/p) e₀^(0.4/p)       e₀ that of the step before
//!     e > 1: take it back,   h ← h · 0.9 e^(−1/p)
//!
//! The error is the integrator's own estimate. Where things touch under a law whose friction stops the slip by the end of a
//! step, the force itself depends on the step, and the estimate cannot see that: there the step is taken once whole and once
//! in two halves, and the error is how far these ends are apart; the halves are kept. So it is where a step is so long that
//! MuJoCo's `refsafe` makes contacts softer than they are.
//!
//! p is the order of the estimate in h: a proportional-integral controller. A contact that begins inside a step makes its
//! error large, so that steps shrink until the beginning is bracketed, and grow again behind it. A step that is taken back
//! leaves nothing behind: the state is what it was, bit for bit.
//!
//! An error is a length: positions in m, angles (rad) times the size of what they turn, velocities times the time that they
//! have to act, at most the rest of the run. No step may move anything by more than half the smallest body's size, so that
//! none passes through another unseen.
//!
//! Source: K. Gustafsson, ACM Transactions on Mathematical Software 17 (1991), 533–554; G. Söderlind, Numerical Algorithms 31
//! (2002), 281–310.

mod dense;

use std::fmt;

use self::dense::Dense;
use crate::data::Data;
use crate::dynamics;
use crate::forward::{StepError, step};
use crate::integrate::difference;
use crate::method::{Integrator, Method};
use crate::model::{Body, GeomKind, JointKind, Model};
use crate::state::State;

/// A run by steps of controlled error.
///
/// The steps do not depend on the times at which one looks: a look inside a step is read off a polynomial (`dense`).
#[derive(Clone, Debug)]
pub struct Controlled<'m> {
    model: &'m Model,
    method: Method,
    estimate: fn(&mut Data) -> &[f64],
    /// Of a step, m.
    tolerance: f64,
    /// End of the run, s.
    end: f64,
    /// Least step, s.
    least: f64,
    /// Half the size of the smallest thing that can be passed through, m.
    thin: f64,
    /// The longest step in which all constraints are as stiff as the scene says, s.
    safe: f64,
    /// Whether a constraint acted in the last step.
    touched: bool,
    /// m per unit of each dof (nv).
    sizes: Vec<f64>,
    /// Where the last step began, where it led, and the step to try next, s.
    before: State,
    state: State,
    /// The end of a whole step that is compared with two halves, and how far it is from there: q, then v (2 nv).
    whole: State,
    apart: Vec<f64>,
    next: f64,
    /// The last step's error over the tolerance.
    last: f64,
    data: Data,
    /// For looks.
    look: Data,
    dense: Dense,
    /// Evaluations that looks took.
    looks: usize,
    effort: Effort,
}

/// What a run of controlled steps took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Effort {
    /// Steps kept.
    pub steps: usize,
    /// Steps taken back.
    pub rejected: usize,
    /// Steps kept although their error was too large, since they could not be shorter.
    pub forced: usize,
    /// Evaluations of the accelerations, looks left out.
    pub evaluations: usize,
}

/// Why a controlled run ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Failed {
    /// The shortest step could not be taken.
    Step(StepError),
    /// This many steps are not enough; the time that was reached, s.
    TooManySteps(usize, f64),
    /// The integrator does not estimate its error.
    NoEstimate(&'static str),
    /// The tolerance is not above zero, m.
    Tolerance(f64),
    /// A time that was asked for, and from when to when one can ask, s.
    Outside(f64, [f64; 2]),
}

impl fmt::Display for Failed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Failed::Step(error) => error.fmt(f),
            Failed::TooManySteps(steps, time) => write!(f, "{steps} steps reach only {time} s"),
            Failed::NoEstimate(name) => write!(f, "{name} has no estimate of its error"),
            Failed::Tolerance(x) => write!(f, "a tolerance of {x} m: it has to be above zero"),
            Failed::Outside(time, [from, to]) => write!(f, "{time} s is not between {from} s and {to} s"),
        }
    }
}

impl std::error::Error for Failed {}

/// Part of a run that a step takes at least.
const LEAST: f64 = 1e-11;
/// What a next step is aimed at, and the bounds of its growth.
const SAFETY: f64 = 0.9;
const GROWTH: [f64; 2] = [0.1, 5.0];
/// A velocity's error acts for this long at most, s.
const MEMORY: f64 = 1.0;

impl<'m> Controlled<'m> {
    /// A run from a state to the time `end` (s) with errors of a step up to `tolerance` (m).
    ///
    /// `method.timestep` is the step that is tried first, s.
    ///
    /// Errors: [`Failed::NoEstimate`]; [`Failed::Tolerance`]; [`Failed::Step`] where timestep or state do not suit the model.
    pub fn new(
        model: &'m Model,
        method: &Method,
        start: &State,
        tolerance: f64,
        end: f64,
    ) -> Result<Controlled<'m>, Failed> {
        let Integrator { name, estimate, .. } = method.integrator;
        let estimate = estimate.ok_or(Failed::NoEstimate(name))?;
        start.suits(model).map_err(|wrong| Failed::Step(StepError::State(wrong)))?;
        if tolerance.is_nan() || tolerance <= 0.0 {
            return Err(Failed::Tolerance(tolerance));
        }
        let length = end - start.time;
        if !(method.timestep > 0.0 && length >= 0.0) {
            return Err(Failed::Step(StepError::Timestep(method.timestep.min(length))));
        }
        let mut data = Data::new(model);
        let sizes = sizes(model, &start.qpos, &mut data);
        Ok(Controlled {
            model,
            method: *method,
            estimate,
            tolerance,
            end,
            least: LEAST * length.max(f64::MIN_POSITIVE),
            thin: thinnest(model),
            safe: safe(model),
            touched: false,
            sizes,
            before: start.clone(),
            state: start.clone(),
            whole: start.clone(),
            apart: vec![0.0; 2 * model.nv],
            next: method.timestep,
            last: 1.0,
            look: data.clone(),
            dense: Dense::default(),
            looks: 0,
            data,
            effort: Effort::default(),
        })
    }

    /// Where the last step led: at or behind the time that was asked for last.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Where the last step began.
    pub fn before(&self) -> &State {
        &self.before
    }

    /// Whether a constraint acted in the last step, at its ends or between them.
    pub fn touched(&self) -> bool {
        self.touched
    }

    /// Law and integrator of its steps.
    pub fn method(&self) -> &Method {
        &self.method
    }

    /// The step that will be tried next, s.
    pub fn next_step(&self) -> f64 {
        self.next
    }

    /// What the last step found; poses and forces are those at its last evaluation.
    pub fn data(&self) -> &Data {
        &self.data
    }

    /// What the run took so far.
    pub fn effort(&self) -> Effort {
        self.effort
    }

    /// Evaluations of the accelerations that looks took: two for each step that was looked into.
    pub fn looks(&self) -> usize {
        self.looks
    }

    /// The state at a time between the last one asked for and the end, s.
    ///
    /// Errors: [`Failed::Outside`]; [`Failed::Step`]; [`Failed::TooManySteps`] where `most` steps in all do not reach it.
    pub fn at(&mut self, time: f64, most: usize) -> Result<State, Failed> {
        // The end is a sum of steps: it may differ from what is asked for by rounding.
        let end = self.end.max(self.state.time) * (1.0 + f64::EPSILON);
        if !(self.before.time <= time && time <= end) {
            return Err(Failed::Outside(time, [self.before.time, self.end]));
        }
        let time = time.min(self.end.max(self.state.time));
        while self.state.time < time {
            if self.effort.steps + self.effort.rejected >= most {
                return Err(Failed::TooManySteps(most, self.state.time));
            }
            self.advance()?;
        }
        if time == self.state.time {
            return Ok(self.state.clone());
        }
        let Controlled { model, method, before, state, look, dense, looks, .. } = self;
        let mut found = before.clone();
        if time > before.time {
            *looks += dense.enter(model, method, [before, state], look);
            dense.at(model, time, state, &mut found);
        }
        Ok(found)
    }

    /// One step whose error is within the tolerance, or the shortest one.
    ///
    /// Errors: [`Failed::Step`] where the shortest step fails.
    pub fn advance(&mut self) -> Result<(), Failed> {
        // The local error of a method of order p grows with h^(p + 1), its estimate with one power less.
        let order = f64::from(self.method.integrator.order);
        self.before.copy_from(&self.state);
        let kept = [self.data.unsolved, self.data.unconverged];
        loop {
            let left = self.end - self.before.time;
            let mut timestep = self.next.min(self.longest());
            // The last two steps are alike, rather than one long and one tiny.
            if timestep >= left {
                timestep = left;
            } else if 2.0 * timestep > left {
                timestep = 0.5 * left;
            }
            let shortest = timestep <= self.least;
            let (error, touches) = match self.try_step(timestep) {
                // What begins to touch in so long a step would be softer than the scene says, or not felt at all.
                Ok(true) if !self.touched && timestep > self.safe && !shortest => (f64::INFINITY, true),
                Ok(touches) => (self.error(left.min(MEMORY)) / self.tolerance, touches),
                Err(StepError::Diverged(_) | StepError::Crowded { .. }) if !shortest => (f64::INFINITY, self.touched),
                Err(error) => return Err(Failed::Step(error)),
            };
            if error <= 1.0 || shortest {
                let error = error.clamp(1e-10, 1e10);
                let factor = SAFETY * error.powf(-0.7 / order) * self.last.powf(0.4 / order);
                self.next = timestep * factor.clamp(GROWTH[0], GROWTH[1]);
                self.effort.steps += 1;
                self.effort.forced += usize::from(error > 1.0);
                self.last = error.max(1e-4);
                self.touched = touches;
                return Ok(());
            }
            self.effort.rejected += 1;
            [self.data.unsolved, self.data.unconverged] = kept;
            self.state.copy_from(&self.before);
            // Where it is not a number, too.
            let factor = SAFETY * error.powf(-1.0 / order);
            self.next = (timestep * if factor > GROWTH[0] { factor.min(SAFETY) } else { GROWTH[0] }).max(self.least);
        }
    }

    /// Takes a step (s) from `before`, and leaves its estimated error in `apart`. Out: whether a constraint acts in it.
    fn try_step(&mut self, timestep: f64) -> Result<bool, StepError> {
        let Controlled { model, method, estimate, data, state, whole, apart, safe, .. } = self;
        let mut take = |timestep: f64, state: &mut State, evaluations: &mut usize| {
            let outcome = step(model, &Method { timestep, ..*method }, state, data);
            *evaluations += data.counts.forwards;
            apart.copy_from_slice(estimate(data));
            let free = data.contacts.is_empty() && data.joint_rows.is_empty() && data.ties.is_empty();
            outcome.map(|()| [data.counts.constrained(), !free])
        };
        let evaluations = &mut self.effort.evaluations;
        // What begins or ends inside the step the estimate sees; what lasts to its last evaluation it may not. With halves for both a
        // ball that bounces to rest under `penalty` (20 s, 0.1 mm) costs five times as much: 2.5 million evaluations.
        let [touches, lasts] = take(timestep, state, evaluations)?;
        if !(lasts && (method.contact.by_timestep || timestep > *safe)) {
            return Ok(touches);
        }
        std::mem::swap(whole, state);
        state.copy_from(&self.before);
        take(0.5 * timestep, state, evaluations)?;
        take(0.5 * timestep, state, evaluations)?;
        state.time = whole.time;
        let (position, velocity) = apart.split_at_mut(model.nv);
        difference(model, &state.qpos, &whole.qpos, position);
        velocity.iter_mut().zip(state.qvel.iter().zip(&whole.qvel)).for_each(|(d, (a, b))| *d = a - b);
        Ok(touches)
    }

    /// The last step's error, m.
    fn error(&self, time: f64) -> f64 {
        let Controlled { apart, sizes, .. } = self;
        let (position, velocity) = apart.split_at(sizes.len());
        let errors = position.iter().zip(velocity).zip(sizes).map(|((q, v), size)| size * q.abs().max(time * v.abs()));
        // Written so that what is not a number counts as large.
        errors.fold(0.0, |most, e| if e <= most { most } else { e })
    }

    /// The longest step that nothing can pass through anything in, s.
    fn longest(&self) -> f64 {
        let speeds = self.before.qvel.iter().zip(&self.sizes).map(|(v, size)| size * v.abs());
        (self.thin / speeds.fold(0.0, f64::max)).max(self.least)
    }
}

/// How far a unit of each dof moves what it carries, m per m or per rad (nv).
///
/// Of an angle that is the reach of what hangs on the joint, in the position `qpos`.
pub fn sizes(model: &Model, qpos: &[f64], data: &mut Data) -> Vec<f64> {
    dynamics::kinematics(model, qpos, data);
    let mut sizes = vec![1.0; model.nv];
    for (j, joint) in model.joints.iter().enumerate() {
        let turns = match joint.kind {
            JointKind::Slide => continue,
            JointKind::Free => joint.dofadr + 3..joint.dofadr + 6,
            JointKind::Ball => joint.dofadr..joint.dofadr + 3,
            JointKind::Hinge => joint.dofadr..joint.dofadr + 1,
        };
        let anchor = if joint.kind == JointKind::Free { data.xpos[joint.body] } else { data.xanchor[j] };
        let mut carried = vec![false; model.bodies.len()];
        let mut reach = 0.0f64;
        for (b, body) in model.bodies.iter().enumerate().skip(joint.body) {
            carried[b] = b == joint.body || carried[body.parent];
            if carried[b] {
                reach = reach.max((data.xpos[b] - anchor).norm() + extent(model, body));
            }
        }
        sizes[turns].fill(reach);
    }
    sizes
}

/// From a body's frame to its farthest point, m; its gyration radius where that is larger.
pub fn extent(model: &Model, body: &Body) -> f64 {
    let geoms = model.geoms[body.geoms.clone()].iter().map(|g| g.pos.norm() + g.rbound);
    let gyration = if body.mass > 0.0 { (body.inertia.max() / body.mass).sqrt() } else { 0.0 };
    geoms.fold(gyration, f64::max)
}

/// Half the smallest size of a geom that can touch another, m; planes cannot be passed through.
pub fn thinnest(model: &Model) -> f64 {
    let geoms = model.requires.colliding_geoms.iter().map(|&g| &model.geoms[g]);
    let sized = geoms.filter(|g| g.kind != GeomKind::Plane);
    let least = |size: &[f64]| size.iter().copied().filter(|s| *s > 0.0).fold(f64::INFINITY, f64::min);
    sized.map(|g| least(g.size.as_slice())).fold(f64::INFINITY, f64::min)
}

/// Half the shortest time constant of the model's constraints, s: in longer steps `refsafe` makes them softer.
pub fn safe(model: &Model) -> f64 {
    if !model.opt.flags.refsafe {
        return f64::INFINITY;
    }
    let contacts = model.mixes.iter().flat_map(|m| [m.solref, m.solreffriction]);
    let joints = model.joints.iter().flat_map(|j| [j.solref_limit, j.solref_friction]);
    let tendons = model.tendons.iter().flat_map(|t| [t.solref_limit, t.solref_friction]);
    let all = contacts.chain(joints).chain(tendons).chain(model.equalities.iter().map(|e| e.solref));
    0.5 * all.map(|[time, _]| time).filter(|time| *time > 0.0).fold(f64::INFINITY, f64::min)
}
