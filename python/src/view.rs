//! Things by name: `m.body('x')`, `d.joint('y').qpos`.

use pyo3::exceptions::PyAttributeError;
use pyo3::prelude::*;
use pyo3::types::PySlice;

use crate::data::MjData;
use crate::model::{MjModel, assign};

/// One body, joint, geom … of a model or data: its rows of all arrays. What is written to them is written to the arrays.
#[pyclass(name = "View", module = "penny", frozen)]
pub struct View {
    of: Py<PyAny>,
    model: Py<MjModel>,
    in_model: bool,
    kind: &'static str,
    index: usize,
}

/// What an array has rows for.
enum Rows {
    /// The thing itself.
    Own,
    /// Its degrees of freedom.
    Dofs,
    /// Its numbers in qpos.
    Positions,
    /// Its numbers in sensordata.
    Data,
    /// Its numbers in act.
    Activation,
}

impl View {
    /// The array that has an attribute, and which of its rows.
    fn place(&self, name: &str) -> Option<(String, Rows)> {
        let own = |array: String| Some((array, Rows::Own));
        if self.in_model {
            return match (self.kind, name) {
                ("jnt", "bodyid" | "damping" | "armature" | "frictionloss" | "invweight0" | "parentid" | "jntid") => {
                    Some((format!("dof_{name}"), Rows::Dofs))
                }
                ("jnt", "qpos0" | "qpos_spring") => Some((name.to_owned(), Rows::Positions)),
                _ => own(format!("{}_{name}", self.kind)),
            };
        }
        match (self.kind, name) {
            ("body", _) | ("jnt", "xanchor" | "xaxis") | ("actuator", "ctrl") => own(name.to_owned()),
            ("jnt", "qpos") => Some((name.to_owned(), Rows::Positions)),
            ("jnt", _) => Some((name.to_owned(), Rows::Dofs)),
            ("sensor", "data") => Some(("sensordata".to_owned(), Rows::Data)),
            ("actuator", "act" | "act_dot") => Some((name.to_owned(), Rows::Activation)),
            ("geom" | "site" | "cam" | "actuator", _) => own(format!("{}_{name}", self.kind)),
            _ => None,
        }
    }

    fn get<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let lacking = || {
            let side = if self.in_model { "MjModel" } else { "MjData" };
            PyAttributeError::new_err(format!("{side} has no `{name}` of a {}", self.kind))
        };
        let (array, rows) = self.place(name).ok_or_else(lacking)?;
        let array = self.of.bind(py).getattr(array.as_str()).map_err(|_| lacking())?;
        let slice = |start: usize, n: usize| PySlice::new(py, start as isize, (start + n) as isize, 1);
        match rows {
            Rows::Own => {
                let flat: usize = array.getattr("ndim")?.extract()?;
                if flat == 1 { array.get_item(slice(self.index, 1)) } else { array.get_item(self.index) }
            }
            Rows::Dofs | Rows::Positions => {
                let model = &self.model.bind(py).borrow().model;
                let joint = &model.joints[self.index];
                let (start, n) = match rows {
                    Rows::Dofs => (joint.dofadr, joint.kind.nv()),
                    _ => (joint.qposadr, joint.kind.nq()),
                };
                array.get_item(slice(start, n))
            }
            Rows::Data => {
                let model = &self.model.bind(py).borrow().model;
                let sensor = &model.sensors[self.index];
                array.get_item(slice(sensor.adr, sensor.kind.dim()))
            }
            Rows::Activation => {
                let act = self.model.bind(py).borrow().model.actuators[self.index].act;
                array.get_item(slice(act.unwrap_or(0), usize::from(act.is_some())))
            }
        }
    }
}

#[pymethods]
impl View {
    /// Its number.
    #[getter]
    fn id(&self) -> usize {
        self.index
    }

    /// Its name; empty if it has none.
    #[getter]
    fn name(&self, py: Python) -> String {
        let model = self.model.bind(py).borrow();
        model.names(self.kind).and_then(|names| names.get(self.index).map(|n| (*n).to_owned())).unwrap_or_default()
    }

    fn __getattr__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        self.get(py, name)
    }

    fn __setattr__(&self, py: Python, name: &str, value: &Bound<PyAny>) -> PyResult<()> {
        assign(&self.get(py, name)?, value)
    }

    fn __repr__(&self, py: Python) -> String {
        let side = if self.in_model { "model" } else { "data" };
        format!("<penny {side}: {} {} '{}'>", self.kind, self.index, self.name(py))
    }
}

/// Methods that look things up by name or number; without either, the first.
macro_rules! views {
    ($class:ident, $in_model:literal; $($name:ident: $kind:literal,)*) => {
        #[pymethods]
        impl $class {$(
            /// One of them by name or number, with its rows of all arrays.
            ///
            /// Errors: `KeyError` for a name, `IndexError` for a number that there is not.
            #[pyo3(signature = (name_or_id=None))]
            fn $name<'py>(slf: &Bound<'py, $class>, name_or_id: Option<&Bound<'py, PyAny>>) -> PyResult<View> {
                let py = slf.py();
                let model = $class::model_of(slf);
                let zero = 0i32.into_pyobject(py)?.into_any();
                let index = model.bind(py).borrow().find($kind, name_or_id.unwrap_or(&zero))?;
                Ok(View { of: slf.clone().into_any().unbind(), model, in_model: $in_model, kind: $kind, index })
            }
        )*}
    };
}

views! { MjModel, true;
    body: "body", joint: "jnt", jnt: "jnt", geom: "geom", site: "site", actuator: "actuator", sensor: "sensor",
    key: "key", keyframe: "key", camera: "cam", cam: "cam",
}

views! { MjData, false;
    body: "body", joint: "jnt", jnt: "jnt", geom: "geom", site: "site", actuator: "actuator", sensor: "sensor",
    camera: "cam", cam: "cam",
}
