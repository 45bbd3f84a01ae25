//! `MjModel`: the compiled scene under MuJoCo's names.

use std::collections::HashMap;
use std::path::Path;
use std::sync::{Arc, OnceLock};

use penny::forward::Method;
use penny::mjcf;
use penny::model::Model;
use pyo3::exceptions::{PyAttributeError, PyIndexError, PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::model_fields::{FIELDS, SIZES};
use crate::option::{self, MjOption, Vectors, Watch};
use crate::values::{Type, Values, fresh};

/// A compiled scene, under MuJoCo's names. `MjModel.from_xml_path` and `MjModel.from_xml_string` make one.
///
/// Arrays are NumPy's, with MuJoCo's shapes. What is written into one takes effect at the next step, under every contact
/// law, and what follows from it is found anew, as if `mj_setConst` had been called. Arrays that cannot be changed without
/// compiling a new scene (kinds, ids, numbers of things) are read-only.
#[pyclass(name = "MjModel", module = "penny", weakref)]
pub struct MjModel {
    pub model: Arc<Model>,
    pub method: Method,
    pub opt: Py<MjOption>,
    /// Of `opt`, and the vectors that the model has.
    watch: Arc<Watch>,
    vectors: Vectors,
    /// The file, its text, and what it says of pictures.
    pub source: Arc<Source>,
    /// By field: what was asked for.
    arrays: Vec<Option<Values>>,
    /// Fields that somebody may write, and the numbers that the model has there.
    watched: Vec<(usize, Vec<f64>)>,
    stat: Option<Py<PyAny>>,
    vis: Option<Py<PyAny>>,
}

/// Where a scene comes from.
pub struct Source {
    pub name: String,
    /// The main file first.
    pub files: Vec<(String, String)>,
    /// Warnings, as text.
    pub warnings: String,
    /// Attributes of `<visual><global>` and `<visual><map>`.
    pub global: Vec<(String, String)>,
    pub map: Vec<(String, String)>,
    /// Those of `<statistic>`.
    pub statistic: Vec<(String, String)>,
}

/// A failure of reading as Python's: the text shows every problem with its place.
pub fn scene_error(py: Python, failure: &mjcf::Failure) -> PyErr {
    let text = failure.to_string();
    match crate::tools::scene_error_type(py) {
        Ok(kind) => {
            let problems = crate::tools::problems(py, &failure.document, &failure.problems);
            match problems.and_then(|problems| kind.call1((text.trim_end(), problems))) {
                Ok(error) => PyErr::from_value(error),
                Err(error) => error,
            }
        }
        Err(error) => error,
    }
}

fn index_of(name: &str) -> Option<usize> {
    static BY_NAME: OnceLock<HashMap<&'static str, usize>> = OnceLock::new();
    BY_NAME.get_or_init(|| FIELDS.iter().enumerate().map(|(i, f)| (f.name, i)).collect()).get(name).copied()
}

impl MjModel {
    pub fn new(py: Python, scene: penny::Scene) -> PyResult<MjModel> {
        let document = &scene.document;
        let attributes = |n: &mjcf::NodeId| {
            let list = document.attributes(*n).iter();
            list.map(|a| (a.name.to_string(), a.value.to_string())).collect::<Vec<_>>()
        };
        let root = document.root().map(|root| document.node(root).children.clone()).unwrap_or_default();
        let named = |n: &mjcf::NodeId, name: &str| document.node(*n).name == name;
        let visual = |name: &'static str| {
            let parts = root.iter().filter(|n| named(n, "visual")).flat_map(|n| &document.node(*n).children);
            parts.filter(|n| named(n, name)).flat_map(attributes).collect::<Vec<_>>()
        };
        let (global, map) = (visual("global"), visual("map"));
        let statistic = root.iter().filter(|n| document.node(**n).name == "statistic").flat_map(attributes).collect();
        let source = Source {
            name: scene.model.name.clone(),
            files: document.files.iter().map(|f| (f.name.clone(), f.text.to_string())).collect(),
            warnings: mjcf::render(document, &scene.warnings, false),
            global,
            map,
            statistic,
        };
        MjModel::of(py, scene.model, Arc::new(source), None)
    }

    pub fn of(py: Python, model: Model, source: Arc<Source>, opt: Option<&MjOption>) -> PyResult<MjModel> {
        let mut method = Method::of(&model);
        // Whoever imports this module as `mujoco` expects MuJoCo's law; `opt.law` has the others.
        method.contact = penny::contact::by_name("mujoco").unwrap_or(penny::contact::default());
        let opt = match opt {
            Some(opt) => {
                method = opt.method;
                opt.copy(py)?
            }
            None => MjOption::of(py, &model, method)?,
        };
        Ok(MjModel {
            vectors: option::vectors(&model),
            watch: opt.watch.clone(),
            model: Arc::new(model),
            method,
            opt: Py::new(py, opt)?,
            source,
            arrays: FIELDS.iter().map(|_| None).collect(),
            watched: Vec::new(),
            stat: None,
            vis: None,
        })
    }

    /// Takes up what was written into the arrays and `opt`.
    ///
    /// Errors: `ValueError` for what the scene cannot be; the array then has the old numbers again.
    pub fn sync(&mut self, py: Python) -> PyResult<()> {
        if self.watch.changed(py, &self.vectors) {
            let now = self.watch.now(py);
            self.opt.bind(py).borrow().apply(py, &now, &mut self.model, &mut self.method)?;
            self.vectors = now;
        }
        if !self.watched.is_empty() {
            self.take_up(py)?;
        }
        Ok(())
    }

    fn take_up(&mut self, py: Python) -> PyResult<()> {
        let same = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits());
        let mut changes: Vec<(usize, usize, Vec<f64>)> = Vec::new();
        let mut written = Vec::new();
        let arrays = &self.arrays;
        self.watched.retain(|(field, before)| {
            let Some(array) = &arrays[*field] else { return false };
            let now = array.read(py);
            if !same(&now, before) {
                let width = before.len() / FIELDS[*field].per.rows(&self.model).max(1);
                for (i, (now, before)) in now.chunks(width).zip(before.chunks(width)).enumerate() {
                    if !same(now, before) {
                        changes.push((*field, i, now.to_vec()));
                    }
                }
                written.push(*field);
            }
            // Nobody can write what nobody holds.
            array.held(py)
        });
        if changes.is_empty() {
            return Ok(());
        }
        // Last what actuators give to joints and tendons, which the edit finds anew from what these have.
        changes.sort_by_key(|(field, ..)| FIELDS[*field].name.starts_with("actuator_"));
        let mut refused = None;
        let result = Arc::make_mut(&mut self.model).edit(|parts| {
            for (field, row, values) in &changes {
                let Some(set) = FIELDS[*field].set else { continue };
                if let Err(why) = set(parts, *row, values) {
                    refused.get_or_insert(format!("{}[{row}]: {why}", FIELDS[*field].name));
                }
            }
        });
        // What is derived follows, and where nothing was taken the old numbers are back.
        for (field, array) in self.arrays.iter().enumerate() {
            if let Some(array) = array.as_ref() {
                array.write(py, &FIELDS[field].numbers(&self.model));
            }
        }
        let model = &self.model;
        for (field, before) in &mut self.watched {
            *before = FIELDS[*field].numbers(model);
        }
        let names = || written.iter().map(|f| FIELDS[*f].name).collect::<Vec<_>>().join(", ");
        result.map_err(|why| PyValueError::new_err(format!("{}: {why}", names())))?;
        refused.map_or(Ok(()), |why| Err(PyValueError::new_err(why)))
    }

    /// The array of a field.
    fn array<'py>(&mut self, py: Python<'py>, i: usize) -> PyResult<Bound<'py, PyAny>> {
        let field = &FIELDS[i];
        let array = match &self.arrays[i] {
            Some(array) => array,
            None => {
                let values = field.numbers(&self.model);
                let array = Values::new(py, field.kind, &values, &field.shape(&self.model))?;
                if field.set.is_none() {
                    array.lock(py)?;
                }
                self.arrays[i].insert(array)
            }
        };
        if field.set.is_some() && !self.watched.iter().any(|(of, _)| *of == i) {
            self.watched.push((i, array.read(py)));
        }
        Ok(array.object(py).into_any())
    }

    /// The model itself.
    pub fn model_of(slf: &Bound<MjModel>) -> PyResult<Py<MjModel>> {
        Ok(slf.clone().unbind())
    }

    /// How many things of a kind there are.
    pub fn count(&self, kind: &str) -> usize {
        let m = &self.model;
        match kind {
            "body" => m.bodies.len(),
            "jnt" => m.joints.len(),
            "geom" => m.geoms.len(),
            "site" => m.sites.len(),
            "actuator" => m.actuators.len(),
            "sensor" => m.sensors.len(),
            "key" => m.keyframes.len(),
            "cam" => m.cameras.len(),
            "tendon" => m.tendons.len(),
            "eq" => m.equalities.len(),
            _ => 0,
        }
    }

    /// The names of all things of a kind.
    pub fn names(&self, kind: &str) -> Option<Vec<&str>> {
        let m = &self.model;
        fn list<T>(of: &[T], name: fn(&T) -> &String) -> Option<Vec<&str>> {
            Some(of.iter().map(|x| name(x).as_str()).collect())
        }
        match kind {
            "body" => {
                let mut names = list(&m.bodies, |b| &b.name);
                if let Some(world) = names.as_mut().and_then(|n| n.first_mut()) {
                    *world = "world";
                }
                names
            }
            "jnt" => list(&m.joints, |j| &j.name),
            "geom" => list(&m.geoms, |g| &g.name),
            "site" => list(&m.sites, |s| &s.name),
            "actuator" => list(&m.actuators, |a| &a.name),
            "sensor" => list(&m.sensors, |s| &s.name),
            "key" => list(&m.keyframes, |k| &k.name),
            "cam" => list(&m.cameras, |c| &c.name),
            "tendon" => list(&m.tendons, |t| &t.name),
            "eq" => list(&m.equalities, |e| &e.name),
            _ => None,
        }
    }

    /// All names, each with a zero after it: the model's own first; and where those of a kind begin.
    fn name_buffer(&self, kind: Option<&str>) -> (Vec<u8>, Option<Vec<f64>>) {
        let mut buffer = [self.model.name.as_bytes(), &[0]].concat();
        let mut places = None;
        for list in ["body", "jnt", "geom", "site", "cam", "eq", "tendon", "actuator", "sensor", "key"] {
            let names = self.names(list).unwrap_or_default();
            let of = names.iter().map(|name| {
                let at = buffer.len() as f64;
                buffer.extend(name.as_bytes());
                buffer.push(0);
                at
            });
            let of: Vec<f64> = of.collect();
            if kind == Some(list) {
                places = Some(of);
            }
        }
        (buffer, places)
    }

    /// The number of a thing, given by it or by its name.
    ///
    /// Errors: `KeyError`, `IndexError`.
    pub fn find(&self, kind: &str, which: &Bound<PyAny>) -> PyResult<usize> {
        if let Ok(name) = which.cast::<pyo3::types::PyString>() {
            let name = name.to_cow()?;
            let names = self.names(kind).unwrap_or_default();
            return names.iter().position(|n| **n == name && !name.is_empty()).ok_or_else(|| {
                let near = mjcf::nearest(&name, names.iter().copied());
                let hint = near.map(|near| format!(". Did you mean '{near}'?")).unwrap_or_default();
                let mut valid: Vec<_> = names.iter().filter(|n| !n.is_empty()).map(|n| format!("'{n}'")).collect();
                valid.sort_unstable();
                PyKeyError::new_err(format!("Invalid name '{name}'. Valid names: [{}]{hint}", valid.join(", ")))
            });
        }
        let i: isize = which.extract()?;
        let n = self.count(kind) as isize;
        if !(0..n).contains(&i) {
            return Err(PyIndexError::new_err(format!("Invalid index {i}. Valid indices from 0 to {}", n - 1)));
        }
        Ok(i as usize)
    }
}

/// Reads an editable array's value from whatever was assigned: NumPy does the work, and complains.
pub fn assign(array: &Bound<PyAny>, value: &Bound<PyAny>) -> PyResult<()> {
    array.set_item(array.py().Ellipsis(), value)
}

#[pymethods]
impl MjModel {
    /// Reads and compiles a file.
    ///
    /// Errors: `penny.SceneError` (a `ValueError`) with every problem of the file, each with its place.
    #[staticmethod]
    #[pyo3(signature = (filename, assets=None))]
    fn from_xml_path(py: Python, filename: std::path::PathBuf, assets: Option<&Bound<PyDict>>) -> PyResult<MjModel> {
        no_assets(assets)?;
        let scene = py.detach(|| penny::load(Path::new(&filename)));
        MjModel::new(py, scene.map_err(|failure| scene_error(py, &failure))?)
    }

    /// The same from text.
    #[staticmethod]
    #[pyo3(signature = (xml, assets=None))]
    fn from_xml_string(py: Python, xml: &str, assets: Option<&Bound<PyDict>>) -> PyResult<MjModel> {
        no_assets(assets)?;
        let scene = py.detach(|| penny::parse("scene.xml", xml));
        MjModel::new(py, scene.map_err(|failure| scene_error(py, &failure))?)
    }

    /// Options: timestep, gravity, integrator, Penny's contact law `law` …
    #[getter]
    fn opt(&self, py: Python) -> Py<MjOption> {
        self.opt.clone_ref(py)
    }

    /// What pictures are scaled by: `extent` and `center`, of `<statistic>` or Penny's own measure.
    #[getter]
    fn stat(slf: &Bound<MjModel>) -> PyResult<Py<PyAny>> {
        let py = slf.py();
        if let Some(stat) = &slf.borrow().stat {
            return Ok(stat.clone_ref(py));
        }
        let given = slf.borrow().source.statistic.clone();
        let stat = py.import("penny._visual")?.getattr("MjStatistic")?.call1((slf, given))?.unbind();
        slf.borrow_mut().stat = Some(stat.clone_ref(py));
        Ok(stat)
    }

    /// What pictures look like: `vis.global_` with `offwidth`, `offheight`, `fovy`.
    #[getter]
    fn vis(slf: &Bound<MjModel>) -> PyResult<Py<PyAny>> {
        let py = slf.py();
        if let Some(vis) = &slf.borrow().vis {
            return Ok(vis.clone_ref(py));
        }
        let (global, map) = (slf.borrow().source.global.clone(), slf.borrow().source.map.clone());
        let vis = py.import("penny._visual")?.getattr("MjVisual")?.call1((global, map))?.unbind();
        slf.borrow_mut().vis = Some(vis.clone_ref(py));
        Ok(vis)
    }

    /// What is valid in the file but probably not meant, as text; empty if there is nothing.
    #[getter]
    fn warnings(&self) -> String {
        self.source.warnings.clone()
    }

    /// The contact law that the scene itself names, or `None`.
    #[getter]
    fn scene_law(&self) -> Option<String> {
        self.model.contact_law().map(str::to_owned)
    }

    fn __getattr__(&mut self, py: Python, name: &str) -> PyResult<Py<PyAny>> {
        if let Some(i) = index_of(name) {
            return Ok(self.array(py, i)?.unbind());
        }
        if name == "names" {
            return Ok(PyBytes::new(py, &self.name_buffer(None).0).into_any().unbind());
        }
        if let Some(kind) = name.strip_prefix("name_").and_then(|n| n.strip_suffix("adr")) {
            let (_, places) = self.name_buffer(Some(kind));
            if let Some(places) = places {
                return Ok(fresh(py, Type::Int, &places, &[places.len()])?.unbind());
            }
        }
        if let Some((_, size)) = SIZES.iter().find(|(size, _)| *size == name) {
            return Ok(size(&self.model).into_pyobject(py)?.into_any().unbind());
        }
        Err(lacking("MjModel", name, FIELDS.iter().map(|f| f.name)))
    }

    fn __setattr__(slf: &Bound<MjModel>, name: &str, value: &Bound<PyAny>) -> PyResult<()> {
        let py = slf.py();
        if let Some(i) = index_of(name) {
            let array = slf.borrow_mut().array(py, i)?;
            return assign(&array, value);
        }
        if slf.hasattr(name)? {
            return Err(PyAttributeError::new_err(format!("`{name}` of MjModel cannot be set")));
        }
        Err(lacking("MjModel", name, FIELDS.iter().map(|f| f.name)))
    }

    fn __dir__(slf: &Bound<MjModel>) -> PyResult<Vec<String>> {
        let own = slf.get_type().dir()?.iter().map(|n| n.extract()).collect::<PyResult<Vec<String>>>()?;
        let fields = FIELDS.iter().map(|f| f.name).chain(SIZES.iter().map(|(name, _)| *name));
        Ok(own.into_iter().chain(fields.map(str::to_owned)).collect())
    }

    fn __copy__(slf: &Bound<MjModel>) -> PyResult<MjModel> {
        let py = slf.py();
        let mut this = slf.borrow_mut();
        this.sync(py)?;
        let opt = this.opt.borrow(py);
        MjModel::of(py, (*this.model).clone(), this.source.clone(), Some(&opt))
    }

    fn __deepcopy__(slf: &Bound<MjModel>, _memo: &Bound<PyAny>) -> PyResult<MjModel> {
        MjModel::__copy__(slf)
    }

    /// The text of the scene, and what was changed since.
    fn __reduce__<'py>(slf: &Bound<'py, MjModel>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("penny._pickle")?.getattr("reduce_model")?.call1((slf,))
    }

    /// The files of the scene as they were read: (name, text), the main file first.
    #[getter]
    fn files(&self) -> Vec<(String, String)> {
        self.source.files.clone()
    }

    fn __repr__(&self) -> String {
        let m = &self.model;
        let name = if m.name.is_empty() { "without a name" } else { &m.name };
        let (bodies, nv, geoms) = (m.bodies.len() - 1, m.nv, m.geoms.len());
        format!("<penny.MjModel {name}: {bodies} bodies, {nv} degrees of freedom, {geoms} geoms>")
    }
}

fn no_assets(assets: Option<&Bound<PyDict>>) -> PyResult<()> {
    match assets {
        Some(assets) if !assets.is_empty() => Err(pyo3::exceptions::PyNotImplementedError::new_err(
            "`assets`: Penny reads included files from their folder; it has no meshes or textures",
        )),
        _ => Ok(()),
    }
}

/// An attribute that there is not, with the nearest that there is.
pub fn lacking<'a>(class: &str, name: &str, known: impl Iterator<Item = &'a str>) -> PyErr {
    let hint = match mjcf::nearest(name, known) {
        Some(near) => format!("did you mean `{near}`?"),
        None => "MuJoCo may have it, Penny has not".to_owned(),
    };
    PyAttributeError::new_err(format!("{class} has no attribute `{name}`: {hint}"))
}
