//! `MjData.efc_*`: the rows of the constraints as MuJoCo lists them, as they are when they are asked for.
//!
//!     force = −∂s/∂x at x = J q̈ − aref,    D = 1/R

use penny::contact::mujoco::efc::{self, Row};
use pyo3::exceptions::PyNotImplementedError;
use pyo3::prelude::*;

use crate::data::MjData;
use crate::values::{Type, fresh};

impl MjData {
    /// Errors: `NotImplementedError` where they are not those of MuJoCo's law at the accelerations that it found.
    fn rows(&self) -> PyResult<Vec<Row>> {
        let core = &self.core;
        let law = core.method.contact.name;
        let why = if law != "mujoco" {
            format!("under the law `{law}`")
        } else if core.model.opt.noslip_iterations > 0 {
            "with noslip_iterations".to_owned()
        } else if core.inverted {
            "after mj_inverse".to_owned()
        } else {
            return Ok(efc::list(&core.model, &core.method.settings(), &core.at, &core.data));
        };
        Err(PyNotImplementedError::new_err(format!("efc_*: Penny does not list rows {why}")))
    }

    fn numbers<'py>(&self, py: Python<'py>, of: impl Fn(&Row) -> f64) -> PyResult<Bound<'py, PyAny>> {
        let numbers: Vec<f64> = self.rows()?.iter().map(of).collect();
        fresh(py, Type::Real, &numbers, &[numbers.len()])
    }
}

#[pymethods]
impl MjData {
    /// Jacobian, dense and row after row whatever `opt.jacobian` is: (nefc nv). J qvel are the rows' velocities.
    #[getter]
    fn efc_J<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let numbers: Vec<f64> = self.rows()?.into_iter().flat_map(|row| row.jac).collect();
        fresh(py, Type::Real, &numbers, &[numbers.len()])
    }

    /// Regularisation (nefc), 1/kg (1/(kg m²)).
    #[getter]
    fn efc_R<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.numbers(py, |row| row.r)
    }

    /// Its inverse (nefc), kg (kg m²).
    #[getter]
    fn efc_D<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.numbers(py, |row| 1.0 / row.r)
    }

    /// Reference acceleration (nefc), m/s² (rad/s²).
    #[getter]
    fn efc_aref<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.numbers(py, |row| row.aref)
    }

    /// Forces (nefc), N (N m).
    #[getter]
    fn efc_force<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.numbers(py, |row| row.force)
    }

    /// Velocities J qvel (nefc), m/s (rad/s).
    #[getter]
    fn efc_vel<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.numbers(py, |row| row.jac.iter().zip(&self.core.at.qvel).map(|(j, v)| j * v).sum())
    }
}
