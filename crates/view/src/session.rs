//! A simulation that someone plays with: it takes whole steps, each under the inputs that hold for it, and writes
//! the inputs down. It knows steps, not frames or clocks, so any frame rate gives the same bits.

use super::energy_balance::{self, EnergyBalance};
use super::fnv::Fnv;
use super::log::{Change, Input, Log, Start, VERSION};
use penny::control::{Controlled, Failed};
use penny::data::Data;
use penny::forward::{Method, StepError, forward, step};
use penny::integrate::Integrator;
use penny::math::{MIN_MU, Quat, Vec3, Vec6};
use penny::model::{Model, Parts};
use penny::state::State;
use penny::{contact, integrate};

/// Where a session's scene came from.
#[derive(Clone, Debug, Default)]
pub struct Source {
    pub path: String,
    pub hash: String,
    pub seed: u64,
    /// The file's text, if it includes no others: a recorded session carries it.
    pub text: Option<String>,
}

pub struct Session {
    /// The scene as loaded; `model` is the same with what the player changed.
    original: Model,
    pub model: Model,
    pub method: Method,
    pub state: State,
    pub data: Data,
    pub source: Source,
    /// Steps taken.
    pub steps: u64,
    /// Energy and impulse put in and lost since the last [`Session::restart`].
    pub balance: EnergyBalance,
    /// Error that a step may have, m; 0 where it is one step of the integrator.
    accuracy: f64,
    /// The controlled step to try next, s.
    next: Option<f64>,
    begin: State,
    begin_method: Method,
    inputs: Vec<Input>,
    previous: Poses,
    current: Poses,
}

/// Controlled steps that one step may take.
const MOST_PARTS: usize = 10_000;

/// Position and orientation of every body.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Poses {
    pub pos: Vec<Vec3>,
    pub quat: Vec<Quat>,
}

impl Poses {
    fn of(data: &Data) -> Poses {
        Poses { pos: data.xpos.clone(), quat: data.xquat.clone() }
    }

    /// Between two poses: `t` = 0 is `a`, 1 is `b`. Straight lines, shortest turns.
    pub fn between(a: &Poses, b: &Poses, t: f64) -> Poses {
        if a.pos.len() != b.pos.len() {
            return b.clone();
        }
        let pos = a.pos.iter().zip(&b.pos).map(|(a, b)| a.lerp(b, t)).collect();
        let turn = |(a, b): (&Quat, &Quat)| a.try_slerp(b, t, 1e-9).unwrap_or(*b);
        Poses { pos, quat: a.quat.iter().zip(&b.quat).map(turn).collect() }
    }
}

impl Session {
    pub fn new(model: Model, method: Method, state: State, source: Source) -> Session {
        let mut data = Data::new(&model);
        let balance = EnergyBalance::new(&model, &state, &mut data);
        let poses = Poses::of(&data);
        Session {
            original: model.clone(),
            model,
            method,
            accuracy: 0.0,
            next: None,
            begin: state.clone(),
            begin_method: method,
            state,
            data,
            source,
            steps: 0,
            balance,
            inputs: Vec::new(),
            previous: poses.clone(),
            current: poses,
        }
    }

    /// The session that a log describes, before its first step.
    ///
    /// Errors: one sentence if the log is of another scene or asks for what this program does not have.
    pub fn from_log(log: &Log, model: Model, hash: &str) -> Result<Session, String> {
        if log.scene_hash != hash {
            return Err(format!("`{}` is not the file that this session was recorded with", log.scene));
        }
        let state = restored(&model, &log.start)?;
        let method = Method {
            contact: law(&log.contact)?,
            integrator: integrator(&log.integrator)?,
            timestep: positive(log.timestep)?,
            rounds: log.rounds.max(1),
        };
        let source =
            Source { path: log.scene.clone(), hash: hash.to_owned(), seed: log.seed, text: log.scene_text.clone() };
        Ok(Session::new(model, method, state, source))
    }

    /// Everything needed to play this session again.
    pub fn log(&self) -> Log {
        Log {
            penny_run: VERSION,
            scene: self.source.path.clone(),
            scene_hash: self.source.hash.clone(),
            scene_text: self.source.text.clone(),
            seed: self.source.seed,
            contact: self.begin_method.contact.name.to_owned(),
            integrator: self.begin_method.integrator.name.to_owned(),
            timestep: self.begin_method.timestep,
            rounds: self.begin_method.rounds,
            start: Start::of(&self.begin),
            steps: self.steps,
            inputs: self.inputs.clone(),
        }
    }

    /// Changes something from the next step on, and writes it down.
    ///
    /// Errors: one sentence if that cannot be; then nothing is changed.
    pub fn change(&mut self, change: Change) -> Result<(), String> {
        self.apply(&change)?;
        // The last word on a push before a step is the one that counts.
        if let Change::Push { body, .. } = change {
            let same =
                |i: &Input| i.step == self.steps && matches!(i.change, Change::Push { body: b, .. } if b == body);
            self.inputs.retain(|i| !same(i));
        }
        self.inputs.push(Input { step: self.steps, change });
        Ok(())
    }

    /// Pushes a body with a force (N) and a torque (N m) at its centre of mass, until told otherwise. Written down
    /// only if it is new.
    pub fn push(&mut self, body: usize, wrench: Vec6) -> Result<(), String> {
        if self.pushed(body) == wrench {
            return Ok(());
        }
        self.change(Change::Push { body, wrench: wrench.into() })
    }

    /// The force and torque that push a body now.
    pub fn pushed(&self, body: usize) -> Vec6 {
        self.state.xfrc_applied.get(body).copied().unwrap_or_else(Vec6::zeros)
    }

    /// Error that a step may have, m; 0 where it is one step of the integrator.
    pub fn accuracy(&self) -> f64 {
        self.accuracy
    }

    /// Takes one step, or as many controlled ones as its accuracy asks for.
    ///
    /// Errors: [`Failed`]; the state is then back before the step.
    pub fn step(&mut self) -> Result<(), Failed> {
        let before = self.state.clone();
        let twists = energy_balance::twists(&self.model, &self.data);
        let outcome = if self.accuracy > 0.0 {
            self.controlled()
        } else {
            step(&self.model, &self.method, &mut self.state, &mut self.data).map_err(Failed::Step)
        };
        if let Err(error) = outcome {
            self.state = before;
            self.data = Data::new(&self.model);
            self.balance.revalue(&self.model, &self.state, &mut self.data);
            return Err(error);
        }
        self.steps += 1;
        self.balance.book(&self.model, self.method.timestep, &twists, &self.state, &mut self.data);
        std::mem::swap(&mut self.previous, &mut self.current);
        self.current.pos.clone_from(&self.data.xpos);
        self.current.quat.clone_from(&self.data.xquat);
        Ok(())
    }

    /// Controlled steps for the time of one; `data` has poses and forces at its beginning, as after a step.
    fn controlled(&mut self) -> Result<(), Failed> {
        let h = self.method.timestep;
        let end = self.state.time + h;
        forward(&self.model, &self.method, &self.state, &mut self.data);
        let method = Method { timestep: self.next.unwrap_or(h).min(h), ..self.method };
        let mut run = Controlled::new(&self.model, &method, &self.state, self.accuracy, end)?;
        let state = run.at(end, MOST_PARTS)?;
        self.next = Some(run.next_step());
        self.state = State { time: end, ..state };
        Ok(())
    }

    /// Poses between the last two steps; `t` = 1 is now.
    pub fn poses(&self, t: f64) -> Poses {
        Poses::between(&self.previous, &self.current, t.clamp(0.0, 1.0))
    }

    /// A sentence about a step that failed.
    pub fn failure(&self, error: &Failed) -> String {
        let Failed::Step(StepError::Diverged(d)) = error else { return error.to_string() };
        let body = &self.model.bodies[d.body].name;
        format!(
            "the simulation diverged at {:.4} s: {}[{}] of `{body}` is {:e}; try a smaller timestep",
            d.time, d.quantity, d.index, d.value
        )
    }

    /// Hash of the bits of time, positions and velocities: equal if two sessions are in the same state.
    pub fn state_hash(&self) -> String {
        let numbers = std::iter::once(&self.state.time).chain(&self.state.qpos).chain(&self.state.qvel);
        Fnv::of(numbers.flat_map(|x| x.to_bits().to_le_bytes())).to_string()
    }

    /// Where it has come to, in one line.
    pub fn summary(&self) -> String {
        let place = self.model.trees.first().map_or_else(String::new, |tree| {
            let (body, p) = (&self.model.bodies[tree.bodies.start], self.data.xpos[tree.bodies.start]);
            format!(", {} at {:.4} {:.4} {:.4}", body.name, p.x, p.y, p.z)
        });
        format!("{} steps, {:.4} s{place}, state {}", self.steps, self.state.time, self.state_hash())
    }

    /// Speed of a body's centre of mass, m/s.
    pub fn speed(&self, body: usize) -> f64 {
        energy_balance::twists(&self.model, &self.data).get(body).map_or(0.0, |t| t.fixed_rows::<3>(0).norm())
    }

    /// Centre of mass of a body, m, and its velocity, m/s.
    pub fn motion(&self, body: usize) -> (Vec3, Vec3) {
        let twist = energy_balance::twists(&self.model, &self.data)[body];
        (energy_balance::com(&self.model, &self.data, body), twist.fixed_rows::<3>(0).into_owned())
    }

    /// Back to where the session began, under the method and with the changes of now.
    pub fn restart(&mut self) -> Result<(), String> {
        self.change(Change::State(Start::of(&self.begin)))
    }

    /// The scene as its file has it, without the player's changes.
    pub fn original(&self) -> &Model {
        &self.original
    }

    fn edit(&mut self, how: impl FnOnce(&mut Parts)) -> Result<(), String> {
        self.model.edit(how).map_err(|e| e.to_string())
    }

    fn apply(&mut self, change: &Change) -> Result<(), String> {
        match change {
            Change::Push { body, wrench } => {
                let n = self.model.bodies.len();
                if *body == 0 || *body >= n || wrench.iter().any(|w| !w.is_finite()) {
                    return Err(format!("a push needs a body that exists and finite numbers, not body {body}"));
                }
                self.state.xfrc_applied.resize(n, Vec6::zeros());
                self.state.xfrc_applied[*body] = Vec6::from(*wrench);
                if self.state.xfrc_applied.iter().all(|w| *w == Vec6::zeros()) {
                    self.state.xfrc_applied.clear();
                }
                return Ok(());
            }
            Change::Contact(name) => self.method.contact = law(name)?,
            Change::Integrator(name) => {
                self.method.integrator = integrator(name)?;
                // Without an estimate nothing can be controlled.
                self.accuracy *= f64::from(u8::from(self.method.integrator.estimate.is_some()));
            }
            Change::Accuracy(tolerance) => {
                let Integrator { name, estimate, .. } = self.method.integrator;
                if !(tolerance.is_finite() && *tolerance >= 0.0) {
                    return Err(format!("an accuracy is a length in m, or 0 for none, not {tolerance}"));
                }
                if *tolerance > 0.0 && estimate.is_none() {
                    return Err(format!("{name} does not estimate its error: {} do", controllable()));
                }
                self.accuracy = *tolerance;
            }
            Change::Timestep(h) => self.method.timestep = positive(*h)?,
            Change::Rounds(n) => self.method.rounds = (*n).max(1),
            Change::Gravity(g) => {
                let g = Vec3::from(finite(*g)?);
                self.edit(|m| m.opt.gravity = g)?;
            }
            Change::Solref(solref) => {
                let solref = finite(*solref)?;
                self.edit(|m| {
                    m.mixes.iter_mut().for_each(|m| (m.solref, m.solreffriction) = (solref, solref));
                    m.tutorial.follow_solref();
                })?;
            }
            Change::Friction(friction) => {
                let [slide, spin, roll] = finite(*friction)?.map(|f| f.max(MIN_MU));
                self.edit(|m| {
                    m.mixes.iter_mut().for_each(|m| m.friction = [slide, slide, spin, roll, roll]);
                    m.tutorial.follow_friction();
                })?;
            }
            Change::State(start) => {
                let pushes = std::mem::take(&mut self.state.xfrc_applied);
                self.state = State { xfrc_applied: pushes, ..restored(&self.model, start)? };
            }
        }
        self.next = None;
        // What a step has prepared may depend on what was changed.
        self.data = Data::new(&self.model);
        self.balance.revalue(&self.model, &self.state, &mut self.data);
        if matches!(change, Change::State(_)) {
            self.balance = EnergyBalance::new(&self.model, &self.state, &mut self.data);
            self.current = Poses::of(&self.data);
            self.previous = self.current.clone();
        }
        Ok(())
    }
}

/// Plays a log: gives the session each input before the step that it belongs to.
pub struct Player {
    log: Log,
    next: usize,
}

impl Player {
    pub fn new(log: Log) -> Player {
        Player { log, next: 0 }
    }

    pub fn log(&self) -> &Log {
        &self.log
    }

    pub fn finished(&self, session: &Session) -> bool {
        session.steps >= self.log.steps
    }

    /// Applies the inputs of the session's next step.
    ///
    /// Errors: one sentence if an input cannot be (a damaged log).
    pub fn feed(&mut self, session: &mut Session) -> Result<(), String> {
        while let Some(input) = self.log.inputs.get(self.next).filter(|i| i.step <= session.steps) {
            session.change(input.change.clone())?;
            self.next += 1;
        }
        Ok(())
    }
}

fn restored(model: &Model, start: &Start) -> Result<State, String> {
    let mut state = start.whole.as_deref().cloned().unwrap_or_else(|| State::new(model));
    let fits =
        start.qpos.len() == model.nq && start.qvel.len() == model.nv && start.ctrl.len() == model.actuators.len();
    if !fits
        || state.suits(model).is_err()
        || start.qpos.iter().chain(&start.qvel).chain(&start.ctrl).any(|x| !x.is_finite())
    {
        return Err("the recorded state does not fit this scene".to_owned());
    }
    state.time = start.time;
    state.qpos.clone_from(&start.qpos);
    state.qvel.clone_from(&start.qvel);
    state.ctrl.clone_from(&start.ctrl);
    Ok(state)
}

fn law(name: &str) -> Result<&'static contact::Law, String> {
    contact::by_name(name).ok_or_else(|| format!("there is no contact law `{name}`"))
}

fn integrator(name: &str) -> Result<&'static integrate::Integrator, String> {
    integrate::by_name(name).ok_or_else(|| format!("there is no integrator `{name}`"))
}

/// The integrators that estimate their error.
fn controllable() -> String {
    let names: Vec<&str> = integrate::ALL.iter().filter(|i| i.estimate.is_some()).map(|i| i.name).collect();
    names.join(" and ")
}

fn positive(timestep: f64) -> Result<f64, String> {
    let fine = timestep.is_finite() && timestep > 0.0;
    fine.then_some(timestep).ok_or_else(|| format!("a timestep must be above 0 s, not {timestep}"))
}

fn finite<const N: usize>(numbers: [f64; N]) -> Result<[f64; N], String> {
    let fine = numbers.iter().all(|x| x.is_finite());
    fine.then_some(numbers).ok_or_else(|| format!("{numbers:?} must be finite"))
}
