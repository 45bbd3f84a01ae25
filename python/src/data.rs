//! `MjData`: state and results under MuJoCo's names.

use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

use penny::contact::tangent;
use penny::data::{Data, JointRowKind, TieKind};
use penny::forward::{self, Method, StepError};
use penny::math::{Mat3, Vec3, Vec6};
use penny::model::{JointKind, Model};
use penny::quantities;
use penny::sensors;
use penny::state::State;
use pyo3::exceptions::{PyAttributeError, PyIndexError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::array::Array;
use crate::contact::Contacts;
use crate::data_fields::{FIELDS, QACC};
use crate::model::{MjModel, assign, lacking};
use crate::values::Values;

/// The engine's side: it knows no Python.
pub struct Core {
    pub model: Arc<Model>,
    pub method: Method,
    pub state: State,
    /// The state to which `data` belong: after a step that in which it began.
    pub at: State,
    pub data: Data,
    /// For what would change `data`.
    pub scratch: Option<Data>,
    /// Of the last [`Core::inverse`] (nv).
    pub qfrc_inverse: Vec<f64>,
    /// The accelerations were given to that, and are not those that the law finds.
    pub inverted: bool,
}

impl Core {
    pub fn new(model: Arc<Model>, method: Method) -> Core {
        let state = State::new(&model);
        let data = Data::new(&model);
        let qfrc_inverse = vec![0.0; model.nv];
        Core { at: state.clone(), state, data, model, method, scratch: None, qfrc_inverse, inverted: false }
    }

    /// Takes n steps.
    ///
    /// Errors: at the first step that fails.
    pub fn step(&mut self, n: usize) -> Result<(), StepError> {
        let Core { model, method, state, at, data, inverted, .. } = self;
        *inverted = false;
        for i in 0..n {
            // The first one, too: if that fails, `at` is what was wrong already.
            if i + 1 == n || i == 0 {
                at.time = state.time;
                at.qpos.copy_from_slice(&state.qpos);
                at.qvel.copy_from_slice(&state.qvel);
                at.act.copy_from_slice(&state.act);
            }
            forward::step(model, method, state, data)?;
        }
        Ok(())
    }

    /// Of a step that failed: MuJoCo's number of the warning (`mjtWarning`), and of what index.
    pub fn beyond(&self) -> Option<(usize, usize)> {
        let Core { model, state, at, data, .. } = self;
        if data.counts.crowded > 0 {
            return Some((1, model.pairs.most_contacts));
        }
        let lists =
            [(6, &state.ctrl), (3, &at.qpos), (4, &at.qvel), (5, &data.qacc), (3, &state.qpos), (4, &state.qvel)];
        // MuJoCo's mjMAXVAL.
        let bad = |x: &f64| x.is_nan() || x.abs() > 1e10;
        lists.into_iter().find_map(|(kind, list)| Some((kind, list.iter().position(bad)?)))
    }

    /// Brings everything up to the state; nothing moves.
    pub fn forward(&mut self) {
        let Core { model, method, state, at, data, inverted, .. } = self;
        *inverted = false;
        data.counts.crowded = 0;
        at.copy_from(state);
        forward::forward(model, method, state, data);
        sensors::sense(model, method.contact, state, data);
    }

    /// What the joints must exert, beside passive forces and constraints, for the accelerations `qacc` (nv) at the state.
    pub fn inverse(&mut self, qacc: &[f64]) {
        self.forward();
        self.inverted = true;
        let Core { model, method, state, data, qfrc_inverse, .. } = self;
        tangent::constrain_at(model, &method.settings(), state, qacc, data);
        data.qacc.copy_from_slice(qacc);
        let (mass, bias) = (quantities::inertia_matrix(model, data), quantities::bias(model, state, data));
        for (i, force) in qfrc_inverse.iter_mut().enumerate() {
            let row = &mass[i * model.nv..(i + 1) * model.nv];
            let inertia: f64 = row.iter().zip(qacc).map(|(m, a)| m * a).sum();
            *force = inertia + bias[i] - data.qfrc_passive[i] - data.qfrc_constraint[i];
        }
        sensors::sense(model, method.contact, state, data);
    }

    /// Anchor (m) and unit axis of each joint in the world.
    pub fn joint_frames(&self, mut each: impl FnMut(Vec3, Vec3)) {
        for (j, joint) in self.model.joints.iter().enumerate() {
            let free = self.model.bodies[joint.body].tree.is_some_and(|t| self.model.trees[t].free.is_some());
            match joint.kind {
                // A free joint is at its body's origin; its axis, which means nothing, is MuJoCo's.
                JointKind::Free => each(self.data.xpos[joint.body], Vec3::z()),
                _ if free => each(self.data.xpos[joint.body], joint.axis),
                _ => each(self.data.xanchor[j], self.data.xaxis[j]),
            }
        }
    }

    /// Place (m) and axes of each camera.
    pub fn cameras(&self, mut each: impl FnMut(Vec3, Mat3)) {
        if self.model.cameras.is_empty() {
            return;
        }
        let start = Data::new(&self.model);
        for i in 0..self.model.cameras.len() {
            let (pos, axes) = penny::quantities::camera(&self.model, &start, &self.data, i);
            each(pos, axes);
        }
    }

    /// How many scalar constraint rows there are: equalities, dry friction, limits, contacts.
    pub fn rows(&self) -> [usize; 4] {
        let Data { joint_rows, ties, contacts, .. } = &self.data;
        let of = |kinds: &[TieKind]| ties.iter().filter(|t| kinds.contains(&t.kind)).map(|t| t.dim).sum::<usize>();
        let dry = joint_rows.iter().filter(|r| r.kind == JointRowKind::DryFriction).count();
        let limits = joint_rows.len() - dry + of(&[TieKind::LowerLimit, TieKind::UpperLimit]);
        let touching = contacts.iter().map(|c| crate::contact::rows(&self.model, c)).sum();
        [of(&[TieKind::Equality]), dry + of(&[TieKind::DryFriction]), limits, touching]
    }
}

/// The arrays that are read before a step and written after it.
const LISTS: [&str; 10] = [
    "qpos", "qvel", "act", "ctrl", "qacc_warmstart", "qfrc_applied", "xfrc_applied", "mocap_pos", "mocap_quat",
    "eq_active",
];

struct Lists {
    qpos: Array<f64>,
    qvel: Array<f64>,
    act: Array<f64>,
    ctrl: Array<f64>,
    warmstart: Array<f64>,
    qfrc: Array<f64>,
    xfrc: Array<f64>,
    mocap_pos: Array<f64>,
    mocap_quat: Array<f64>,
    eq_active: Array<bool>,
}

impl Lists {
    fn new(py: Python, m: &Model) -> PyResult<Lists> {
        let list = |n: usize| Array::new(py, vec![0.0; n], &[n]);
        let table = |n: usize, k: usize| Array::new(py, vec![0.0; n * k], &[n, k]);
        Ok(Lists {
            qpos: list(m.nq)?,
            qvel: list(m.nv)?,
            act: list(m.na)?,
            ctrl: list(m.actuators.len())?,
            warmstart: list(m.nv)?,
            qfrc: list(m.nv)?,
            xfrc: table(m.bodies.len(), 6)?,
            mocap_pos: table(m.mocap.len(), 3)?,
            mocap_quat: table(m.mocap.len(), 4)?,
            eq_active: Array::new(py, vec![false; m.equalities.len()], &[m.equalities.len()])?,
        })
    }

    /// The i-th of [`LISTS`].
    fn object<'py>(&self, py: Python<'py>, i: usize) -> Bound<'py, PyAny> {
        let Lists { qpos, qvel, act, ctrl, warmstart, qfrc, xfrc, mocap_pos, mocap_quat, eq_active } = self;
        match [qpos, qvel, act, ctrl, warmstart, qfrc, xfrc, mocap_pos, mocap_quat].get(i) {
            Some(numbers) => numbers.object(py).into_any(),
            None => eq_active.object(py).into_any(),
        }
    }
}

/// State and results of a model, under MuJoCo's names.
///
/// As in MuJoCo, what follows from the state (`xpos`, `qacc`, `contact` …) belongs after `mj_step` to the beginning of that
/// step. It is computed when it is asked for, and an array that somebody keeps is brought up to date by every call.
#[pyclass(name = "MjData", module = "penny", dict, weakref)]
pub struct MjData {
    pub core: Core,
    model: Py<MjModel>,
    lists: Lists,
    /// By field: what was asked for, and the version that it has.
    arrays: Vec<Option<(Values, u64)>>,
    /// Fields that somebody may hold.
    held: Vec<usize>,
    /// One more whenever the engine has worked.
    version: u64,
    contacts: Option<(Py<Contacts>, u64)>,
    /// Once it was asked for, or there was one.
    warning: Option<Py<PyAny>>,
}

fn index_of(name: &str) -> Option<usize> {
    static BY_NAME: OnceLock<HashMap<&'static str, usize>> = OnceLock::new();
    BY_NAME.get_or_init(|| FIELDS.iter().enumerate().map(|(i, f)| (f.name, i)).collect()).get(name).copied()
}

/// A failed step as Python's error.
pub fn step_error(py: Python, error: &StepError) -> PyErr {
    match crate::tools::step_error_type(py) {
        Ok(kind) => match kind.call1((error.to_string(),)) {
            Ok(error) => PyErr::from_value(error),
            Err(error) => error,
        },
        Err(error) => error,
    }
}

impl MjData {
    /// Reads what Python wrote into the state.
    ///
    /// Errors: `TypeError` if the data are those of another model.
    pub fn pull(&mut self, py: Python, m: &mut MjModel) -> PyResult<()> {
        m.sync(py)?;
        let Core { model, method, state, at, .. } = &mut self.core;
        if !Arc::ptr_eq(model, &m.model) {
            let other = pyo3::exceptions::PyTypeError::new_err;
            let size = |m: &Model| (m.nq, m.nv, m.na, m.bodies.len(), m.actuators.len(), m.mocap.len(), m.nsensordata);
            if size(model) != size(&m.model) {
                return Err(other("these data belong to another model"));
            }
            *model = m.model.clone();
        }
        *method = m.method;
        let Lists { qpos, qvel, act, ctrl, warmstart, qfrc, xfrc, mocap_pos, mocap_quat, eq_active } = &self.lists;
        eq_active.read(py, &mut state.eq_active);
        qpos.read(py, &mut state.qpos);
        qvel.read(py, &mut state.qvel);
        act.read(py, &mut state.act);
        ctrl.read(py, &mut state.ctrl);
        warmstart.read(py, &mut state.qacc_warmstart);
        mocap_pos.read(py, state.mocap_pos.as_flattened_mut());
        mocap_quat.read(py, state.mocap_quat.as_flattened_mut());
        if qfrc.is_zero(py) {
            state.qfrc_applied.clear();
        } else {
            state.qfrc_applied.resize(qfrc.len(), 0.0);
            qfrc.read(py, &mut state.qfrc_applied);
        }
        if xfrc.is_zero(py) {
            state.xfrc_applied.clear();
            at.xfrc_applied.clear();
        } else {
            state.xfrc_applied = xfrc.values(py).chunks_exact(6).map(Vec6::from_column_slice).collect();
            at.xfrc_applied.clone_from(&state.xfrc_applied);
        }
        Ok(())
    }

    /// Shows Python the state that the engine has left.
    pub fn push(&mut self, py: Python) {
        let Lists { qpos, qvel, act, warmstart, .. } = &self.lists;
        let state = &self.core.state;
        qpos.write(py, &state.qpos);
        qvel.write(py, &state.qvel);
        act.write(py, &state.act);
        warmstart.write(py, &state.qacc_warmstart);
        self.fresh(py);
    }

    /// Shows Python all of the state.
    pub fn push_all(&mut self, py: Python) {
        let Lists { ctrl, qfrc, xfrc, mocap_pos, mocap_quat, eq_active, .. } = &self.lists;
        let state = &self.core.state;
        let or_zero = |v: &[f64], n: usize| if v.is_empty() { vec![0.0; n] } else { v.to_vec() };
        let wrenches: Vec<f64> = state.xfrc_applied.iter().flat_map(|w| w.iter().copied()).collect();
        ctrl.write(py, &state.ctrl);
        eq_active.write(py, &state.eq_active);
        qfrc.write(py, &or_zero(&state.qfrc_applied, qfrc.len()));
        xfrc.write(py, &or_zero(&wrenches, xfrc.len()));
        mocap_pos.write(py, state.mocap_pos.as_flattened());
        mocap_quat.write(py, state.mocap_quat.as_flattened());
        self.push(py);
    }

    /// The same, and everything found anew where the model has changed: contacts refer to the model as it was.
    pub fn follow(&mut self, py: Python, m: &mut MjModel) -> PyResult<()> {
        self.pull(py, m)?;
        if self.core.data.revision != self.core.model.revision() {
            self.core.forward();
            self.fresh(py);
        }
        Ok(())
    }

    /// The engine has worked: arrays that are held get their new numbers now, the others when they are asked for.
    pub fn fresh(&mut self, py: Python) {
        self.version += 1;
        if self.held.is_empty() {
            return;
        }
        let mut held = std::mem::take(&mut self.held);
        held.retain(|&i| {
            let keep = self.arrays[i].as_ref().is_some_and(|(array, _)| array.held(py));
            if keep {
                self.update(py, i);
            }
            keep
        });
        self.held = held;
    }

    /// `qacc` with what was written into its array since the engine worked.
    pub fn qacc_written(&self, py: Python) -> Vec<f64> {
        match &self.arrays[QACC] {
            Some((array, version)) if *version == self.version => array.read(py),
            _ => self.core.data.qacc.clone(),
        }
    }

    fn update(&mut self, py: Python, i: usize) {
        let mut numbers = Vec::new();
        (FIELDS[i].get)(&mut self.core, &mut numbers);
        if let Some((array, version)) = &mut self.arrays[i] {
            array.write(py, &numbers);
            *version = self.version;
        }
    }

    /// The array of a field with the numbers of now.
    pub fn array<'py>(&mut self, py: Python<'py>, i: usize) -> PyResult<Bound<'py, PyAny>> {
        let current = match &self.arrays[i] {
            Some((_, version)) => *version == self.version,
            None => {
                let shape = FIELDS[i].shape(&self.core.model);
                let zeros = vec![0.0; shape.iter().product()];
                self.arrays[i] = Some((Values::new(py, FIELDS[i].kind, &zeros, &shape)?, 0));
                false
            }
        };
        if !current {
            self.update(py, i);
        }
        if !self.held.contains(&i) {
            self.held.push(i);
        }
        match &self.arrays[i] {
            Some((array, _)) => Ok(array.object(py)),
            None => unreachable!(),
        }
    }
}

#[pymethods]
impl MjData {
    /// The model at rest in `qpos0`, everything that follows from it computed.
    #[new]
    fn new(py: Python, model: &Bound<MjModel>) -> PyResult<MjData> {
        let mut m = model.try_borrow_mut()?;
        m.sync(py)?;
        let mut core = Core::new(m.model.clone(), m.method);
        core.forward();
        let lists = Lists::new(py, &m.model)?;
        let arrays = FIELDS.iter().map(|_| None).collect();
        let model = model.clone().unbind();
        let mut data =
            MjData { core, model, lists, arrays, held: Vec::new(), version: 1, contacts: None, warning: None };
        data.push_all(py);
        Ok(data)
    }

    /// The model that these data belong to.
    #[getter]
    fn model(&self, py: Python) -> Py<MjModel> {
        self.model.clone_ref(py)
    }

    /// Simulated time, s.
    #[getter]
    fn time(&self) -> f64 {
        self.core.state.time
    }

    /// Number of contacts, those that are merely near included.
    #[getter]
    fn ncon(&self) -> usize {
        self.core.data.contacts.len()
    }

    /// Number of scalar constraint rows.
    #[getter]
    fn nefc(&self) -> usize {
        self.core.rows().iter().sum()
    }

    /// Those of dry friction.
    #[getter]
    fn nf(&self) -> usize {
        self.core.rows()[1]
    }

    /// Those of equalities.
    #[getter]
    fn ne(&self) -> usize {
        self.core.rows()[0]
    }

    /// Those of limits.
    #[getter]
    fn nl(&self) -> usize {
        self.core.rows()[2]
    }

    /// How often a run went wrong, and of what the last time: see `MjWarningStatList`.
    #[getter(warning)]
    fn warning_list(&mut self, py: Python) -> PyResult<Py<PyAny>> {
        self.warnings(py).map(|list| list.clone_ref(py))
    }

    /// All contacts of the last step or `mj_forward`.
    #[getter]
    fn contact(&mut self, py: Python) -> PyResult<Py<Contacts>> {
        match &self.contacts {
            Some((contacts, version)) if *version == self.version => Ok(contacts.clone_ref(py)),
            _ => {
                let contacts = Py::new(py, Contacts::of(&self.core))?;
                self.contacts = Some((contacts.clone_ref(py), self.version));
                Ok(contacts)
            }
        }
    }

    /// The arrays of the state stand in the instance's own dictionary from their first use on, where Python finds them
    /// without asking.
    fn __getattr__<'py>(slf: &Bound<'py, MjData>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let py = slf.py();
        if let Some(i) = LISTS.iter().position(|list| *list == name) {
            let array = slf.try_borrow()?.lists.object(py, i);
            slf.getattr("__dict__")?.cast_into::<PyDict>()?.set_item(name, &array)?;
            return Ok(array);
        }
        Err(lacking("MjData", name, FIELDS.iter().map(|f| f.name).chain(LISTS)))
    }

    fn __setattr__(slf: &Bound<MjData>, name: &str, value: &Bound<PyAny>) -> PyResult<()> {
        if name == "time" {
            slf.try_borrow_mut()?.core.state.time = value.extract()?;
            return Ok(());
        }
        if LISTS.contains(&name) || index_of(name).is_some() {
            return assign(&slf.getattr(name)?, value);
        }
        if slf.hasattr(name)? {
            return Err(PyAttributeError::new_err(format!("`{name}` of MjData cannot be set")));
        }
        Err(lacking("MjData", name, FIELDS.iter().map(|f| f.name).chain(LISTS)))
    }

    fn __dir__(slf: &Bound<MjData>) -> PyResult<Vec<String>> {
        let own = slf.get_type().dir()?.iter().map(|n| n.extract()).collect::<PyResult<Vec<String>>>()?;
        let fields = LISTS.iter().copied();
        Ok(own.into_iter().chain(fields.map(str::to_owned)).collect())
    }

    fn __copy__(slf: &Bound<MjData>) -> PyResult<Py<MjData>> {
        let (py, model) = (slf.py(), slf.try_borrow()?.model.clone_ref(slf.py()));
        MjData::duplicate(slf, model.bind(py))
    }

    fn __deepcopy__<'py>(slf: &Bound<'py, MjData>, memo: &Bound<'py, PyAny>) -> PyResult<Py<MjData>> {
        let (py, model) = (slf.py(), slf.try_borrow()?.model.clone_ref(slf.py()));
        let copied = py.import("copy")?.getattr("deepcopy")?.call1((model, memo))?;
        MjData::duplicate(slf, copied.cast::<MjModel>()?)
    }

    fn __reduce__<'py>(slf: &Bound<'py, MjData>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("penny._pickle")?.getattr("reduce_data")?.call1((slf,))
    }

    fn __repr__(&self) -> String {
        let Core { state, data, .. } = &self.core;
        format!("<penny.MjData at {} s: {} contacts>", state.time, data.contacts.len())
    }

    /// The state as bytes, for `pickle`: everything that the next step begins with.
    fn _state(slf: &Bound<MjData>) -> PyResult<Vec<u8>> {
        let py = slf.py();
        let model = slf.try_borrow()?.model.clone_ref(py);
        let mut data = slf.try_borrow_mut()?;
        data.follow(py, &mut model.bind(py).borrow_mut())?;
        Ok(data.core.state.to_bytes())
    }

    /// Goes to a state of [`_state`](MjData::_state).
    fn _restore(&mut self, py: Python, bytes: &[u8]) -> PyResult<()> {
        let wrong = |why: String| pyo3::exceptions::PyValueError::new_err(why);
        let state = State::from_bytes(bytes).map_err(|e| wrong(e.to_string()))?;
        state.suits(&self.core.model).map_err(|e| wrong(e.to_string()))?;
        self.core.state = state;
        self.core.forward();
        self.push_all(py);
        Ok(())
    }
}

impl MjData {
    fn warnings(&mut self, py: Python) -> PyResult<&Py<PyAny>> {
        let list = match self.warning.take() {
            Some(list) => list,
            None => py.import("penny._warning")?.getattr("MjWarningStatList")?.call0()?.unbind(),
        };
        Ok(self.warning.insert(list))
    }

    /// Counts what left the numbers in a step that failed.
    pub fn warn(&mut self, py: Python) -> PyResult<()> {
        match self.core.beyond() {
            Some(found) => self.warnings(py)?.call_method1(py, "_note", found).map(|_| ()),
            None => Ok(()),
        }
    }

    /// Its counts become those of others, or 0.
    pub fn set_warnings(&mut self, py: Python, of: Option<&MjData>) -> PyResult<()> {
        let other = of.and_then(|data| data.warning.as_ref());
        if other.is_none() && self.warning.is_none() {
            return Ok(());
        }
        self.warnings(py)?.call_method1(py, "_set", (other,)).map(|_| ())
    }

    fn duplicate(slf: &Bound<MjData>, model: &Bound<MjModel>) -> PyResult<Py<MjData>> {
        let py = slf.py();
        let own = slf.try_borrow()?.model.clone_ref(py);
        let mut this = slf.try_borrow_mut()?;
        this.follow(py, &mut own.bind(py).borrow_mut())?;
        let mut copy = MjData::new(py, model)?;
        copy.core.state.copy_from(&this.core.state);
        copy.core.at.copy_from(&this.core.at);
        copy.core.data = this.core.data.clone();
        copy.core.qfrc_inverse.clone_from(&this.core.qfrc_inverse);
        copy.core.inverted = this.core.inverted;
        // The copied model has a revision of its own, and its data must not be prepared anew: what they hold is wanted.
        copy.core.data.revision = copy.core.model.revision();
        copy.set_warnings(py, Some(&this))?;
        copy.push_all(py);
        Py::new(py, copy)
    }

    /// The model of the data.
    pub fn model_of(slf: &Bound<MjData>) -> PyResult<Py<MjModel>> {
        Ok(slf.try_borrow()?.model.clone_ref(slf.py()))
    }

    pub fn contact_at(&self, id: isize) -> PyResult<&penny::data::Contact> {
        let contacts = &self.core.data.contacts;
        let found = usize::try_from(id).ok().and_then(|i| contacts.get(i));
        found.ok_or_else(|| PyIndexError::new_err(format!("contact {id}: there are {}", contacts.len())))
    }
}
