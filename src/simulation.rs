//! One way in: a scene that is stepped, read and changed by name.

use std::fmt;
use std::path::Path;
use std::sync::Arc;

use crate::compile::{Invalid, label};
use crate::contact;
use crate::data::{Contact, Data};
use crate::dynamics::energy::{self, Energy};
use crate::dynamics::{self, spatial};
use crate::forward::{self, Method, StepError};
use crate::integrate;
use crate::math::{Mat3, Vec3, Vec6};
use crate::mjcf::{Failure, nearest};
use crate::model::{Model, Parts};
use crate::sensors;
use crate::state::{State, WrongState};

/// A scene that runs: model, method, state and what follows from them.
///
///     let mut sim = Simulation::from_xml(text)?;
///     sim.step_n(500)?;
///     let [.., z] = sim.body("ball")?.position();
///
/// Units are SI: m, s, kg, rad, N. Vectors are in world axes unless something else is said, quaternions are (w, x, y, z).
///
/// As in MuJoCo, what is read after [`step`](Simulation::step) other than `qpos`, `qvel` and `time` (poses, contacts, forces)
/// belongs to the beginning of that step, or to what its integrator evaluated last ([`step`](crate::forward::step)): it is what
/// moved the state to where it now is. [`forward`](Simulation::forward) brings it up to date.
#[derive(Clone, Debug)]
pub struct Simulation {
    model: Arc<Model>,
    method: Method,
    state: State,
    data: Data,
    /// Why a [`Batch`](crate::Batch) no longer steps it, until it begins anew.
    pub(crate) stopped: Option<StepError>,
}

impl Simulation {
    /// Reads a file and compiles it, with the contact law, integrator and timestep that it names.
    ///
    /// Errors: everything that is wrong with the file, each problem with its place; `Display` prints them.
    pub fn from_path(path: impl AsRef<Path>) -> Result<Simulation, Failure> {
        let model = crate::load(path.as_ref())?.model;
        let method = Method::of(&model);
        Ok(Simulation::new(model, method))
    }

    /// The same from the text of a file.
    ///
    /// Errors: as [`from_path`](Simulation::from_path).
    pub fn from_xml(text: &str) -> Result<Simulation, Failure> {
        let model = crate::parse("scene.xml", text)?.model;
        let method = Method::of(&model);
        Ok(Simulation::new(model, method))
    }

    /// A compiled scene under a method, at rest in `qpos0`.
    pub fn new(model: Model, method: Method) -> Simulation {
        let (state, data) = (State::new(&model), Data::new(&model));
        let mut sim = Simulation { model: Arc::new(model), method, state, data, stopped: None };
        sim.forward();
        sim
    }

    /// Takes one step.
    ///
    /// Errors: see [`StepError`].
    pub fn step(&mut self) -> Result<(), StepError> {
        forward::step(&self.model, &self.method, &mut self.state, &mut self.data)
    }

    /// Takes n steps.
    ///
    /// Errors: at the first step that fails, see [`StepError`].
    pub fn step_n(&mut self, n: usize) -> Result<(), StepError> {
        (0..n).try_for_each(|_| self.step())
    }

    /// Brings poses, contacts, forces, accelerations and sensors up to the state; nothing moves.
    ///
    /// A state whose lists have wrong lengths is left alone: the next step says so. Where there are more contacts than the scene may
    /// have, none is kept: `data().counts.crowded` is then above zero, and the next step fails.
    pub fn forward(&mut self) {
        if self.state.suits(&self.model).is_ok() {
            self.data.counts.crowded = 0;
            forward::forward(&self.model, &self.method, &self.state, &mut self.data);
            sensors::sense(&self.model, self.method.contact, &self.state, &mut self.data);
        }
    }

    /// The scene at rest in `qpos0`, at time 0, without controls and applied forces.
    pub fn reset(&mut self) {
        self.state = State::new(&self.model);
        self.begin();
    }

    /// The state of a keyframe, by name or number.
    ///
    /// Errors: [`Unknown`] if there is no such keyframe.
    pub fn reset_to<'a>(&mut self, key: impl Into<Ref<'a>>) -> Result<(), Unknown> {
        let found = find("keyframe", key.into(), self.model.keyframes.iter().map(|k| k.name.as_str()))?;
        self.state = State::at(&self.model, &self.model.keyframes[found]);
        self.begin();
        Ok(())
    }

    /// A copy of the whole state: with it, and the same model, a run continues with the same bits.
    pub fn save(&self) -> State {
        self.state.clone()
    }

    /// Goes back to a state that was saved, here or in another simulation of the same model.
    ///
    /// Errors: [`WrongState`] if it is not a state of this model.
    pub fn restore(&mut self, state: &State) -> Result<(), WrongState> {
        state.suits(&self.model)?;
        self.state.copy_from(state);
        self.begin();
        Ok(())
    }

    /// A new run from the state.
    fn begin(&mut self) {
        self.stopped = None;
        self.forward();
    }

    /// The compiled scene.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Contact law, integrator, timestep.
    pub fn method(&self) -> &Method {
        &self.method
    }

    /// Time, positions, velocities, controls, applied forces.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The same to be written; what is read from the simulation follows with the next step or
    /// [`forward`](Simulation::forward).
    pub fn state_mut(&mut self) -> &mut State {
        &mut self.state
    }

    /// What the last step or [`forward`](Simulation::forward) has found.
    pub fn data(&self) -> &Data {
        &self.data
    }

    /// s
    pub fn time(&self) -> f64 {
        self.state.time
    }

    /// Kinetic and potential energy, J, of the state as it is now; NaN if it is not a state of this model. Poses and velocities of
    /// bodies that are read afterwards are those of now, too.
    pub fn energy(&mut self) -> Energy {
        if self.state.suits(&self.model).is_err() {
            return Energy { kinetic: f64::NAN, potential: f64::NAN };
        }
        self.data.follow(&self.model);
        energy::energy(&self.model, &self.state, &mut self.data)
    }
}

/// Changes while it runs, with effect at the next step. A change of the model brings what is read up to date, as
/// [`forward`](Simulation::forward) does.
impl Simulation {
    /// The contact law of that name.
    ///
    /// Errors: [`Unknown`]; it names the nearest.
    pub fn set_law(&mut self, name: &str) -> Result<(), Unknown> {
        let found = find("contact law", Ref::Name(name), contact::ALL.iter().map(|law| law.name))?;
        self.method.contact = contact::ALL[found];
        Ok(())
    }

    /// The integrator of that name, or MJCF keyword. It is the [`method`](Simulation::method)'s; `model().opt.integrator`
    /// stays what the scene begins with.
    ///
    /// Errors: [`Unknown`]; it names the nearest.
    pub fn set_integrator(&mut self, name: &str) -> Result<(), Unknown> {
        if let Some(known) = integrate::by_name(name) {
            self.method.integrator = known;
            return Ok(());
        }
        find("integrator", Ref::Name(name), integrate::ALL.iter().map(|i| i.name)).map(drop)
    }

    /// In: s. It is the [`method`](Simulation::method)'s; `model().opt.timestep` stays what the scene begins with.
    ///
    /// Errors: [`StepError::Timestep`] if it is not above zero and finite.
    pub fn set_timestep(&mut self, h: f64) -> Result<(), StepError> {
        if !(h > 0.0 && h.is_finite()) {
            return Err(StepError::Timestep(h));
        }
        self.method.timestep = h;
        Ok(())
    }

    /// In: m/s².
    ///
    /// Errors: [`Invalid`] if a number is not finite.
    pub fn set_gravity(&mut self, gravity: [f64; 3]) -> Result<(), Invalid> {
        self.edit(|m| m.opt.gravity = gravity.into())
    }

    /// Friction coefficients of a geom: sliding (1), torsional (m), rolling (m).
    ///
    /// A contact of two geoms of the same priority takes the larger of the two, coefficient by coefficient; a `<pair>` has
    /// its own. Numerics of the scene that would overrule it under the `tutorial` law (`penny.mu`, `penny.mu_roll`) are
    /// dropped.
    ///
    /// Errors: [`Change::Unknown`] for the geom, [`Change::Invalid`] for numbers that are negative or not finite, and where the
    /// scene overrides what geoms say (`<flag override>`).
    pub fn set_friction<'a>(&mut self, geom: impl Into<Ref<'a>>, friction: [f64; 3]) -> Result<(), Change> {
        let geom = self.geom_that_counts("friction", geom.into())?;
        Ok(self.edit(|m| {
            m.geoms[geom].friction = friction;
            m.tutorial.follow_friction();
        })?)
    }

    /// `solref` of a geom: (time constant in s, damping ratio), or (−stiffness, −damping).
    ///
    /// Contacts take the mean of both geoms, weighted by `solmix`, or that of the geom of higher priority. Numerics of the
    /// scene that would overrule it under the `tutorial` law (`penny.k`, `penny.c`) are dropped.
    ///
    /// Errors: [`Change::Unknown`] for the geom, [`Change::Invalid`] for numbers that are not finite, or of which one is above
    /// zero and the other is not, and where the scene overrides what geoms say.
    pub fn set_solref<'a>(&mut self, geom: impl Into<Ref<'a>>, solref: [f64; 2]) -> Result<(), Change> {
        let geom = self.geom_that_counts("solref", geom.into())?;
        Ok(self.edit(|m| {
            m.geoms[geom].solref = solref;
            m.tutorial.follow_solref();
        })?)
    }

    /// Mass of a body, kg; its moments of inertia change in proportion.
    ///
    /// Errors: [`Change::Unknown`] for the body, [`Change::Invalid`] for a mass with which nothing could move, that is negative
    /// or not finite, and for a body that no joint moves.
    pub fn set_mass<'a>(&mut self, body: impl Into<Ref<'a>>, mass: f64) -> Result<(), Change> {
        let body = self.moving("a mass", body.into())?;
        finite("a mass", &[mass])?;
        let before = self.model.bodies[body].mass;
        if before <= 0.0 {
            return Ok(self.edit(|m| m.bodies[body].mass = mass)?);
        }
        Ok(self.edit(|m| {
            m.bodies[body].mass = mass;
            m.bodies[body].inertia *= mass / before;
        })?)
    }

    /// Any other number of the model; see [`Model::edit`].
    ///
    /// Errors: [`Invalid`]; the model is then as it was. Contact law, integrator and timestep are the
    /// [`method`](Simulation::method)'s: a change of what the scene begins with is refused.
    pub fn edit(&mut self, change: impl FnOnce(&mut Parts)) -> Result<(), Invalid> {
        Arc::make_mut(&mut self.model).edit_if(change, |before, now| {
            let set = if now.opt.timestep != before.opt.timestep {
                "the timestep is the method's: change it by `set_timestep`"
            } else if now.opt.integrator != before.opt.integrator {
                "the integrator is the method's: change it by `set_integrator`"
            } else if now.contact_law() != before.contact_law() {
                "the contact law is the method's: change it by `set_law`"
            } else {
                return Ok(());
            };
            Err(Invalid::new(set))
        })?;
        // What was found refers to the model as it was: contacts, to the numbers of their parameters.
        self.forward();
        Ok(())
    }

    /// Sets the control of an actuator; the unit is what the actuator makes of it (N, rad, m …).
    ///
    /// Errors: [`Change::Unknown`] for the actuator, [`Change::Invalid`] for a number that is not finite, and where the state is
    /// not one of this model.
    pub fn set_ctrl<'a>(&mut self, actuator: impl Into<Ref<'a>>, ctrl: f64) -> Result<(), Change> {
        let found = find("actuator", actuator.into(), self.model.actuators.iter().map(|a| a.name.as_str()))?;
        finite("a control", &[ctrl])?;
        self.suited()?;
        self.state.ctrl[found] = ctrl;
        Ok(())
    }

    /// Adds a force (N) that acts on a body at a point of the world (m), in every step until
    /// [`clear_forces`](Simulation::clear_forces).
    ///
    ///     F ← F + f,   T ← T + (point − com) × f
    ///
    /// The point is where it is now, as are poses that are read afterwards; later the force acts on the same place relative to the
    /// centre of mass, in world axes.
    ///
    /// Errors: [`Change::Unknown`] for the body, [`Change::Invalid`] for a number that is not finite, for a body that no joint
    /// moves, and where the state is not one of this model.
    pub fn push<'a>(&mut self, body: impl Into<Ref<'a>>, force: [f64; 3], point: [f64; 3]) -> Result<(), Change> {
        let body = self.moving("a force", body.into())?;
        finite("a force", &force)?;
        finite("a point", &point)?;
        self.suited()?;
        self.data.follow(&self.model);
        dynamics::kinematics(&self.model, &self.state.qpos, &mut self.data);
        let force = Vec3::from(force);
        let arm = Vec3::from(point) - dynamics::xipos(&self.model, &self.data, body);
        self.state.xfrc_applied.resize(self.model.bodies.len(), Vec6::zeros());
        self.state.xfrc_applied[body] += spatial::join(&force, &arm.cross(&force));
        Ok(())
    }

    /// Takes back all that [`push`](Simulation::push) has added.
    pub fn clear_forces(&mut self) {
        self.state.xfrc_applied.clear();
    }

    fn suited(&self) -> Result<(), Invalid> {
        self.state.suits(&self.model).map_err(|wrong| Invalid::new(wrong.to_string()))
    }
}

/// Looking things up.
impl Simulation {
    /// A body by name or number; 0 is the world.
    ///
    /// Errors: [`Unknown`]; it names the nearest.
    pub fn body<'a>(&self, body: impl Into<Ref<'a>>) -> Result<Body<'_>, Unknown> {
        Ok(Body { sim: self, index: self.body_index(body.into())? })
    }

    /// A geom by name or number.
    ///
    /// Errors: [`Unknown`]; it names the nearest.
    pub fn geom<'a>(&self, geom: impl Into<Ref<'a>>) -> Result<Geom<'_>, Unknown> {
        Ok(Geom { sim: self, index: self.geom_index(geom.into())? })
    }

    /// A joint by name or number.
    ///
    /// Errors: [`Unknown`]; it names the nearest.
    pub fn joint<'a>(&self, joint: impl Into<Ref<'a>>) -> Result<Joint<'_>, Unknown> {
        let index = find("joint", joint.into(), self.model.joints.iter().map(|j| j.name.as_str()))?;
        Ok(Joint { sim: self, index })
    }

    /// A site by name or number.
    ///
    /// Errors: [`Unknown`]; it names the nearest.
    pub fn site<'a>(&self, site: impl Into<Ref<'a>>) -> Result<Site<'_>, Unknown> {
        let index = find("site", site.into(), self.model.sites.iter().map(|s| s.name.as_str()))?;
        Ok(Site { sim: self, index })
    }

    /// What a sensor measured at the beginning of the last step, or at the last [`forward`](Simulation::forward); units as
    /// [`SensorKind`](crate::kind::SensorKind) says.
    ///
    /// Errors: [`Unknown`]; it names the nearest.
    pub fn sensor<'a>(&self, sensor: impl Into<Ref<'a>>) -> Result<&[f64], Unknown> {
        let index = find("sensor", sensor.into(), self.model.sensors.iter().map(|s| s.name.as_str()))?;
        let sensor = &self.model.sensors[index];
        Ok(&self.data.sensordata[sensor.adr..sensor.adr + sensor.kind.dim()])
    }

    /// All contacts, with their forces.
    pub fn contacts(&self) -> impl ExactSizeIterator<Item = Touch<'_>> {
        self.data.contacts.iter().map(|contact| Touch { sim: self, contact })
    }

    /// The force of all contacts between two geoms on the one named first, N.
    ///
    /// Errors: [`Unknown`] for either.
    pub fn contact_force<'a>(&self, on: impl Into<Ref<'a>>, from: impl Into<Ref<'a>>) -> Result<[f64; 3], Unknown> {
        let (on, from) = (self.geom_index(on.into())?, self.geom_index(from.into())?);
        let force = |touch: Touch| match touch.geoms() {
            [a, b] if a == from && b == on => Vec3::from(touch.force()),
            [a, b] if a == on && b == from => -Vec3::from(touch.force()),
            _ => Vec3::zeros(),
        };
        Ok(self.contacts().map(force).sum::<Vec3>().into())
    }

    fn body_index(&self, body: Ref) -> Result<usize, Unknown> {
        find("body", body, self.model.bodies.iter().map(|b| b.name.as_str()))
    }

    /// A body that moves, by joints of its own or of a body that it is attached to.
    fn moving(&self, what: &str, body: Ref) -> Result<usize, Change> {
        let index = self.body_index(body)?;
        let body = &self.model.bodies[index];
        if body.tree.is_none() {
            let body = label("body", &body.name, index);
            return Err(Invalid::new(format!("{what} has no effect on {body}: no joint moves it")).into());
        }
        Ok(index)
    }

    /// A geom, if contacts take their parameters from geoms.
    fn geom_that_counts(&self, what: &str, geom: Ref) -> Result<usize, Change> {
        let index = self.geom_index(geom)?;
        if self.model.opt.contact_override.is_some() {
            let geom = label("geom", &self.model.geoms[index].name, index);
            let why = "the scene overrides it for all contacts; change `opt.contact_override` by `edit`";
            return Err(Invalid::new(format!("the {what} of {geom} has no effect: {why}")).into());
        }
        Ok(index)
    }

    fn geom_index(&self, geom: Ref) -> Result<usize, Unknown> {
        find("geom", geom, self.model.geoms.iter().map(|g| g.name.as_str()))
    }
}

/// A body of a simulation.
#[derive(Clone, Copy)]
pub struct Body<'s> {
    sim: &'s Simulation,
    index: usize,
}

impl Body<'_> {
    /// Its number in `model.bodies`.
    pub fn index(&self) -> usize {
        self.index
    }
    /// Its name; empty if it has none.
    pub fn name(&self) -> &str {
        &self.sim.model.bodies[self.index].name
    }
    /// kg
    pub fn mass(&self) -> f64 {
        self.sim.model.bodies[self.index].mass
    }
    /// Origin of its frame, m.
    pub fn position(&self) -> [f64; 3] {
        self.sim.data.xpos[self.index].into()
    }
    /// Orientation of its frame: unit quaternion (w, x, y, z).
    pub fn orientation(&self) -> [f64; 4] {
        crate::math::wxyz(&self.sim.data.xquat[self.index])
    }
    /// Centre of mass, m.
    pub fn center_of_mass(&self) -> [f64; 3] {
        dynamics::xipos(&self.sim.model, &self.sim.data, self.index).into()
    }
    /// Velocity of the centre of mass, m/s.
    pub fn velocity(&self) -> [f64; 3] {
        spatial::lin(&dynamics::twist(&self.sim.model, &self.sim.data, self.index)).into()
    }
    /// rad/s
    pub fn angular_velocity(&self) -> [f64; 3] {
        spatial::ang(&dynamics::twist(&self.sim.model, &self.sim.data, self.index)).into()
    }
    /// The force of all its contacts on it, N.
    pub fn contact_force(&self) -> [f64; 3] {
        let geoms = &self.sim.model.bodies[self.index].geoms;
        let force = |touch: Touch| {
            let [a, b] = touch.geoms().map(|g| f64::from(u8::from(geoms.contains(&g))));
            Vec3::from(touch.force()) * (b - a)
        };
        self.sim.contacts().map(force).sum::<Vec3>().into()
    }
}

/// A geom of a simulation.
#[derive(Clone, Copy)]
pub struct Geom<'s> {
    sim: &'s Simulation,
    index: usize,
}

impl Geom<'_> {
    /// Its number in `model.geoms`.
    pub fn index(&self) -> usize {
        self.index
    }
    /// Its name; empty if it has none.
    pub fn name(&self) -> &str {
        &self.sim.model.geoms[self.index].name
    }
    /// Its centre, m.
    pub fn position(&self) -> [f64; 3] {
        let (geom, data) = (&self.sim.model.geoms[self.index], &self.sim.data);
        (data.xpos[geom.body] + data.xmat[geom.body] * geom.pos).into()
    }
    /// Unit quaternion (w, x, y, z).
    pub fn orientation(&self) -> [f64; 4] {
        let geom = &self.sim.model.geoms[self.index];
        crate::math::wxyz(&(self.sim.data.xquat[geom.body] * geom.quat))
    }
}

/// A site of a simulation.
#[derive(Clone, Copy)]
pub struct Site<'s> {
    sim: &'s Simulation,
    index: usize,
}

impl Site<'_> {
    /// Its number in `model.sites`.
    pub fn index(&self) -> usize {
        self.index
    }
    /// Its name; empty if it has none.
    pub fn name(&self) -> &str {
        &self.sim.model.sites[self.index].name
    }
    /// Its centre, m.
    pub fn position(&self) -> [f64; 3] {
        let (site, data) = (&self.sim.model.sites[self.index], &self.sim.data);
        (data.xpos[site.body] + data.xmat[site.body] * site.pos).into()
    }
    /// Unit quaternion (w, x, y, z).
    pub fn orientation(&self) -> [f64; 4] {
        let site = &self.sim.model.sites[self.index];
        crate::math::wxyz(&(self.sim.data.xquat[site.body] * site.quat))
    }
}

/// A joint of a simulation.
#[derive(Clone, Copy)]
pub struct Joint<'s> {
    sim: &'s Simulation,
    index: usize,
}

impl Joint<'_> {
    /// Its number in `model.joints`.
    pub fn index(&self) -> usize {
        self.index
    }
    /// Its name; empty if it has none.
    pub fn name(&self) -> &str {
        &self.sim.model.joints[self.index].name
    }
    /// Its part of `qpos`: one number (m or rad), four of a ball joint, seven of a free joint; empty where the state has too
    /// few.
    pub fn qpos(&self) -> &[f64] {
        let joint = &self.sim.model.joints[self.index];
        self.sim.state.qpos.get(joint.qposadr..joint.qposadr + joint.kind.nq()).unwrap_or_default()
    }
    /// Its part of `qvel`: one number (m/s or rad/s), three of a ball joint, six of a free joint; empty where the state has too
    /// few.
    pub fn qvel(&self) -> &[f64] {
        self.sim.state.qvel.get(self.dofs()).unwrap_or_default()
    }
    /// Forces of contacts, limits, dry friction and equalities on its degrees of freedom, N or N m.
    pub fn constraint_force(&self) -> &[f64] {
        &self.sim.data.qfrc_constraint[self.dofs()]
    }
    /// Forces of actuators on its degrees of freedom, N or N m.
    pub fn actuator_force(&self) -> &[f64] {
        &self.sim.data.qfrc_actuator[self.dofs()]
    }
    fn dofs(&self) -> std::ops::Range<usize> {
        let joint = &self.sim.model.joints[self.index];
        joint.dofadr..joint.dofadr + joint.kind.nv()
    }
}

/// A contact of a simulation.
#[derive(Clone, Copy)]
pub struct Touch<'s> {
    sim: &'s Simulation,
    contact: &'s Contact,
}

impl Touch<'_> {
    /// Numbers of the two geoms.
    pub fn geoms(&self) -> [usize; 2] {
        self.contact.geom.map(|g| g as usize)
    }
    /// Their names; empty where they have none.
    pub fn names(&self) -> [&str; 2] {
        self.geoms().map(|g| self.sim.model.geoms[g].name.as_str())
    }
    /// Midway between the two surfaces, m.
    pub fn position(&self) -> [f64; 3] {
        self.contact.pos.into()
    }
    /// Unit vector from the first geom to the second.
    pub fn normal(&self) -> [f64; 3] {
        self.contact.frame.row(0).transpose().into()
    }
    /// Penetration, m; negative where the two are apart.
    pub fn penetration(&self) -> f64 {
        -self.contact.dist
    }
    /// N, not negative.
    pub fn normal_force(&self) -> f64 {
        self.contact.force[0]
    }
    /// Size of the friction force, N.
    pub fn friction_force(&self) -> f64 {
        self.contact.force[1].hypot(self.contact.force[2])
    }
    /// Sliding friction coefficient, under the simulation's law.
    pub fn friction_coefficient(&self) -> f64 {
        (self.sim.method.contact.friction)(&self.sim.model, &self.sim.model.mixes[self.contact.mix as usize])[0]
    }
    /// Force on the second geom, N.
    pub fn force(&self) -> [f64; 3] {
        let frame: &Mat3 = &self.contact.frame;
        let [n, s, t, ..] = self.contact.force;
        frame.tr_mul(&Vec3::new(n, s, t)).into()
    }
    /// Torque on the second geom about the point of contact, N m: spinning and rolling friction.
    pub fn torque(&self) -> [f64; 3] {
        let [.., spin, roll1, roll2] = self.contact.force;
        self.contact.frame.tr_mul(&Vec3::new(spin, roll1, roll2)).into()
    }
}

/// A name or a number: what the methods of [`Simulation`] look things up by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ref<'a> {
    /// As the file has it.
    Name(&'a str),
    /// Place in the model's list.
    Index(usize),
}

impl<'a> From<&'a str> for Ref<'a> {
    fn from(name: &'a str) -> Ref<'a> {
        Ref::Name(name)
    }
}

impl<'a> From<&'a String> for Ref<'a> {
    fn from(name: &'a String) -> Ref<'a> {
        Ref::Name(name)
    }
}

impl From<usize> for Ref<'_> {
    fn from(index: usize) -> Self {
        Ref::Index(index)
    }
}

/// There is nothing of that name or number.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unknown {
    /// "body", "geom" …
    pub what: &'static str,
    /// The name or number that was asked for.
    pub name: String,
    /// The nearest name that there is, if one is near.
    pub nearest: Option<String>,
}

impl fmt::Display for Unknown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "there is no {} `{}`", self.what, self.name)?;
        match &self.nearest {
            Some(nearest) => write!(f, ": did you mean `{nearest}`?"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for Unknown {}

/// Why a change was not made.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// There is nothing of that name.
    Unknown(Unknown),
    /// The number cannot be taken.
    Invalid(Invalid),
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Change::Unknown(unknown) => unknown.fmt(f),
            Change::Invalid(invalid) => invalid.fmt(f),
        }
    }
}

impl std::error::Error for Change {}

impl From<Unknown> for Change {
    fn from(unknown: Unknown) -> Change {
        Change::Unknown(unknown)
    }
}

impl From<Invalid> for Change {
    fn from(invalid: Invalid) -> Change {
        Change::Invalid(invalid)
    }
}

fn find<'n>(
    what: &'static str,
    wanted: Ref,
    names: impl ExactSizeIterator<Item = &'n str> + Clone,
) -> Result<usize, Unknown> {
    let found = match wanted {
        Ref::Name(name) => names.clone().position(|n| n == name && !name.is_empty()),
        Ref::Index(index) => (index < names.len()).then_some(index),
    };
    found.ok_or_else(|| match wanted {
        Ref::Name(name) => {
            let near = nearest(name, names.filter(|n| !n.is_empty())).map(str::to_owned);
            Unknown { what, name: name.to_owned(), nearest: near }
        }
        Ref::Index(index) => Unknown { what, name: index.to_string(), nearest: None },
    })
}

fn finite(what: &str, numbers: &[f64]) -> Result<(), Invalid> {
    match numbers.iter().find(|x| !x.is_finite()) {
        Some(x) => Err(Invalid::new(format!("{what} cannot be {x}"))),
        None => Ok(()),
    }
}
