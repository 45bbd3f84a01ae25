//! `set_mjcb_control`: a function of Python's that sets the controls in every step, once everything at its state is known.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use penny::integrate;
use pyo3::exceptions::PyNotImplementedError;
use pyo3::prelude::*;

use crate::data::MjData;
use crate::model::MjModel;

/// One for all models, as in MuJoCo.
static CONTROL: Mutex<Option<Py<PyAny>>> = Mutex::new(None);
/// Whether there is one: all that a step asks.
static IS_SET: AtomicBool = AtomicBool::new(false);

/// Calls `callback(m, d)` in every step, `mj_forward` and `mj_step1` of every model; `None`: no more.
#[pyfunction]
pub fn set_mjcb_control(callback: Option<Py<PyAny>>) {
    let Ok(mut control) = CONTROL.lock() else { return };
    IS_SET.store(callback.is_some(), Relaxed);
    *control = callback;
}

/// That function, or `None`.
#[pyfunction]
pub fn get_mjcb_control(py: Python) -> Option<Py<PyAny>> {
    CONTROL.lock().ok()?.as_ref().map(|callback| callback.clone_ref(py))
}

/// Where there is such a function: everything at the state, and then the function. Out: whether there is.
///
/// Errors: those of the function; `NotImplementedError` for RK4, whose stages would each ask it.
pub fn control(py: Python, m: &Bound<MjModel>, d: &Bound<MjData>) -> PyResult<bool> {
    if !IS_SET.load(Relaxed) {
        return Ok(false);
    }
    let Some(callback) = get_mjcb_control(py) else { return Ok(false) };
    let mut data = d.try_borrow_mut()?;
    data.pull(py, &mut m.borrow_mut())?;
    if data.core.method.integrator.name == integrate::rk4::METHOD.name {
        return Err(PyNotImplementedError::new_err("mjcb_control: Penny asks it once a step, which is not RK4's way"));
    }
    data.core.forward();
    data.fresh(py);
    // The function reads and writes them.
    drop(data);
    callback.call1(py, (m, d))?;
    Ok(true)
}
