//! `MjData.contact`: the contacts as they were when they were asked for.

use penny::data::Contact;
use penny::math::Vec3;
use penny::model::{Cone, Model};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::types::PySlice;

use crate::data::Core;
use crate::model::lacking;
use crate::values::{Type, fresh};

/// A contact with the numbers that MuJoCo lists.
#[derive(Clone)]
struct Numbers {
    contact: Contact,
    mix: penny::model::Mix,
    impratio: f64,
    efc: i32,
}

/// How many scalar rows a contact has.
pub fn rows(model: &Model, contact: &Contact) -> usize {
    if !contact.pushes(model) {
        return 0;
    }
    match (model.mixes[contact.mix as usize].condim, model.opt.cone) {
        (1, _) => 1,
        (n, Cone::Pyramidal) => 2 * (n - 1),
        (n, Cone::Elliptic) => n,
    }
}

/// A list of contacts: `len`, index, slice, and arrays over all of them (`contact.geom`, `contact.dist` …).
#[pyclass(name = "MjContactList", module = "penny", frozen)]
pub struct Contacts {
    list: Vec<Numbers>,
}

/// One contact.
#[pyclass(name = "MjContact", module = "penny", frozen)]
pub struct MjContact {
    numbers: Numbers,
}

/// Name, numbers in a row (0: one, without a dimension of its own), type, and the numbers.
type Field = (&'static str, usize, Type, fn(&Numbers) -> Vec<f64>);
const FIELDS: &[Field] = &[
    ("dist", 0, Type::Real, |n| vec![n.contact.dist]),
    ("pos", 3, Type::Real, |n| n.contact.pos.as_slice().to_vec()),
    ("frame", 9, Type::Real, frame),
    ("includemargin", 0, Type::Real, |n| vec![n.mix.margin]),
    ("friction", 5, Type::Real, |n| n.mix.friction.to_vec()),
    ("solref", 2, Type::Real, |n| n.mix.solref.to_vec()),
    ("solimp", 5, Type::Real, |n| n.mix.solimp.to_vec()),
    ("mu", 0, Type::Real, |n| vec![if n.mix.condim > 1 { n.mix.friction[0] / n.impratio.sqrt() } else { 0.0 }]),
    ("dim", 0, Type::Int, |n| vec![n.mix.condim as f64]),
    ("geom1", 0, Type::Int, |n| vec![f64::from(n.contact.geom[0])]),
    ("geom2", 0, Type::Int, |n| vec![f64::from(n.contact.geom[1])]),
    ("geom", 2, Type::Int, |n| n.contact.geom.map(f64::from).to_vec()),
    ("exclude", 0, Type::Int, |n| vec![f64::from(n.efc < 0)]),
    ("efc_address", 0, Type::Int, |n| vec![f64::from(n.efc)]),
];

/// Normal and two tangents, row by row. Without friction no law needs tangents, and here MuJoCo's are made.
fn frame(n: &Numbers) -> Vec<f64> {
    let mut frame = n.contact.frame;
    if n.mix.condim == 1 {
        frame = penny::collision::frame(&frame.row(0).transpose(), &Vec3::zeros());
    }
    frame.transpose().as_slice().to_vec()
}

fn find(class: &str, name: &str) -> PyResult<&'static Field> {
    FIELDS.iter().find(|f| f.0 == name).ok_or_else(|| lacking(class, name, FIELDS.iter().map(|f| f.0)))
}

impl Contacts {
    pub fn of(core: &Core) -> Contacts {
        let [equalities, dry, limits, _] = core.rows();
        let mut next = (equalities + dry + limits) as i32;
        let model = &core.model;
        let list = core.data.contacts.iter().map(|contact| {
            let rows = rows(model, contact) as i32;
            let efc = if rows > 0 { next } else { -1 };
            next += rows;
            let mix = model.mixes[contact.mix as usize].clone();
            Numbers { contact: *contact, mix, impratio: model.opt.impratio, efc }
        });
        Contacts { list: list.collect() }
    }
}

#[pymethods]
impl Contacts {
    fn __len__(&self) -> usize {
        self.list.len()
    }

    fn __getitem__<'py>(&self, py: Python<'py>, index: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let n = self.list.len() as isize;
        if let Ok(slice) = index.cast::<PySlice>() {
            let slice = slice.indices(n)?;
            let which = (0..slice.slicelength as isize).map(|k| (slice.start + k * slice.step) as usize);
            let list = which.filter_map(|i| self.list.get(i).cloned()).collect();
            return Ok(Bound::new(py, Contacts { list })?.into_any());
        }
        let i: isize = index.extract()?;
        let at = if i < 0 { i + n } else { i };
        match usize::try_from(at).ok().and_then(|i| self.list.get(i)) {
            Some(numbers) => Ok(Bound::new(py, MjContact { numbers: numbers.clone() })?.into_any()),
            None => Err(PyIndexError::new_err(format!("contact {i}: there are {n}"))),
        }
    }

    fn __getattr__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let (_, width, kind, get) = find("MjContactList", name)?;
        let numbers: Vec<f64> = self.list.iter().flat_map(get).collect();
        let n = self.list.len();
        fresh(py, *kind, &numbers, &if *width == 0 { vec![n] } else { vec![n, *width] })
    }

    fn __dir__(&self) -> Vec<&'static str> {
        FIELDS.iter().map(|f| f.0).collect()
    }

    fn __repr__(&self) -> String {
        format!("<penny.MjContactList: {} contacts>", self.list.len())
    }
}

#[pymethods]
impl MjContact {
    fn __getattr__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let (_, width, kind, get) = find("MjContact", name)?;
        let numbers = get(&self.numbers);
        match (width, kind) {
            (0, Type::Int) => Ok((numbers[0] as i64).into_pyobject(py)?.into_any()),
            (0, _) => Ok(numbers[0].into_pyobject(py)?.into_any()),
            _ => fresh(py, *kind, &numbers, &[*width]),
        }
    }

    fn __dir__(&self) -> Vec<&'static str> {
        FIELDS.iter().map(|f| f.0).collect()
    }

    fn __repr__(&self) -> String {
        let Contact { geom: [a, b], dist, .. } = &self.numbers.contact;
        format!("<penny.MjContact: geoms {a} and {b}, {dist:.3e} m>")
    }
}

/// Force and torque of a contact in its frame (N, N m), as `mj_contactForce` gives it.
pub fn force(core: &Core, contact: &Contact) -> [f64; 6] {
    if contact.pushes(&core.model) { contact.force } else { [0.0; 6] }
}
