//! Things by name: `m.body('x')`, `d.joint('y').qpos`.

use std::borrow::Cow;

use numpy::{PyUntypedArray, PyUntypedArrayMethods};
use penny::quantities;
use pyo3::exceptions::PyAttributeError;
use pyo3::prelude::*;
use pyo3::types::PySlice;

use crate::data::{Core, MjData};
use crate::model::{MjModel, assign};
use crate::values::{Type, Values};

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
    fn name(&self, py: Python) -> String {
        let model = self.model.bind(py).borrow();
        model.names(self.kind).and_then(|names| names.get(self.index).map(|n| (*n).to_owned())).unwrap_or_default()
    }

    /// The array that has an attribute, and which of its rows.
    fn place<'n>(&self, name: &'n str) -> Option<(Cow<'n, str>, Rows)> {
        let own = |array: String| Some((Cow::Owned(array), Rows::Own));
        if self.in_model {
            return match (self.kind, name) {
                ("jnt", "bodyid" | "damping" | "armature" | "frictionloss" | "invweight0" | "parentid" | "jntid") => {
                    Some((Cow::Owned(format!("dof_{name}")), Rows::Dofs))
                }
                ("jnt", "qpos0" | "qpos_spring") => Some((Cow::Borrowed(name), Rows::Positions)),
                _ => own(format!("{}_{name}", self.kind)),
            };
        }
        match (self.kind, name) {
            ("body", _) | ("jnt", "xanchor" | "xaxis") | ("actuator", "ctrl") => Some((Cow::Borrowed(name), Rows::Own)),
            ("jnt", "qpos") => Some((Cow::Borrowed(name), Rows::Positions)),
            ("jnt", _) => Some((Cow::Borrowed(name), Rows::Dofs)),
            ("sensor", "data") => Some((Cow::Borrowed("sensordata"), Rows::Data)),
            ("actuator", "act" | "act_dot") => Some((Cow::Borrowed(name), Rows::Activation)),
            ("tendon", "length" | "velocity") => own(format!("ten_{name}")),
            ("geom" | "site" | "cam" | "actuator" | "eq", _) => own(format!("{}_{name}", self.kind)),
            _ => None,
        }
    }

    /// ∂length/∂q of an actuator (nv), a copy: by name it is not sparse.
    fn moment<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let mut data = self.of.bind(py).cast::<MjData>()?.try_borrow_mut()?;
        let Core { model, at, data: engine, .. } = &mut data.core;
        let row = quantities::actuator_moment(model, at, engine, self.index);
        let values = Values::new(py, Type::Real, &row, &[row.len()])?;
        values.lock(py)?;
        Ok(values.object(py))
    }

    fn get<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        if (self.in_model, self.kind, name) == (false, "actuator", "moment") {
            return self.moment(py);
        }
        let lacking = || {
            let side = if self.in_model { "MjModel" } else { "MjData" };
            PyAttributeError::new_err(format!("{side} has no `{name}` of a {}", self.kind))
        };
        let (array, rows) = self.place(name).ok_or_else(lacking)?;
        let array = self.of.bind(py).getattr(array.as_ref()).map_err(|_| lacking())?;
        let slice = |start: usize, n: usize| PySlice::new(py, start as isize, (start + n) as isize, 1);
        match rows {
            Rows::Own => {
                if array.cast::<PyUntypedArray>()?.ndim() == 1 {
                    array.get_item(slice(self.index, 1))
                } else {
                    array.get_item(self.index)
                }
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
    /// `id`, `name` (empty if it has none), and its rows of the arrays. All of it here: a look-up that fails before this one
    /// is asked would cost more than the row.
    fn __getattribute__<'py>(slf: &Bound<'py, View>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let py = slf.py();
        match name {
            "id" => Ok(slf.get().index.into_pyobject(py)?.into_any()),
            "name" => Ok(slf.get().name(py).into_pyobject(py)?.into_any()),
            _ if name.starts_with("__") => {
                let object = py.get_type::<PyAny>();
                object.call_method1("__getattribute__", (slf, name))
            }
            _ => slf.get().get(py, name),
        }
    }

    fn __setattr__(&self, py: Python, name: &str, value: &Bound<PyAny>) -> PyResult<()> {
        assign(&self.get(py, name)?, value)
    }

    fn __repr__(&self, py: Python) -> String {
        let side = if self.in_model { "model" } else { "data" };
        format!("<penny {side}: {} {} '{}'>", self.kind, self.index, self.name(py))
    }
}

/// Methods that look things up by name or number.
macro_rules! views {
    ($class:ident, $in_model:literal; $($name:ident: $kind:literal,)*) => {
        #[pymethods]
        impl $class {$(
            /// One of them by name or number, with its rows of all arrays.
            ///
            /// Errors: `KeyError` for a name, `IndexError` for a number that there is not; without either `KeyError`, which
            /// lists the names.
            #[pyo3(signature = (name_or_id=None))]
            fn $name<'py>(slf: &Bound<'py, $class>, name_or_id: Option<&Bound<'py, PyAny>>) -> PyResult<View> {
                let py = slf.py();
                let model = $class::model_of(slf)?;
                let none = "".into_pyobject(py)?.into_any();
                let index = model.bind(py).borrow().find($kind, name_or_id.unwrap_or(&none))?;
                Ok(View { of: slf.clone().into_any().unbind(), model, in_model: $in_model, kind: $kind, index })
            }
        )*}
    };
}

views! { MjModel, true;
    body: "body", joint: "jnt", jnt: "jnt", geom: "geom", site: "site", actuator: "actuator", sensor: "sensor",
    key: "key", keyframe: "key", camera: "cam", cam: "cam", tendon: "tendon", equality: "eq", eq: "eq",
}

views! { MjData, false;
    body: "body", joint: "jnt", jnt: "jnt", geom: "geom", site: "site", actuator: "actuator", sensor: "sensor",
    camera: "cam", cam: "cam", tendon: "tendon", ten: "tendon",
}
