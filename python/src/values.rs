//! Numbers with the type and shape that MuJoCo gives them.

use numpy::PyArrayDyn;
use pyo3::prelude::*;

use crate::array::Array;

/// NumPy's type of an array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Type {
    /// float64
    Real,
    /// float32
    Single,
    /// int32
    Int,
    /// bool
    Flag,
}

/// An array of any of these types. On Penny's side its numbers are f64, which holds all of them exactly.
pub enum Values {
    Real(Array<f64>),
    Single(Array<f32>),
    Int(Array<i32>),
    Flag(Array<bool>),
}

/// The same work for every type of array.
macro_rules! each {
    ($values:expr, $array:ident => $work:expr) => {
        match $values {
            Values::Real($array) => $work,
            Values::Single($array) => $work,
            Values::Int($array) => $work,
            Values::Flag($array) => $work,
        }
    };
}

impl Values {
    pub fn new(py: Python, kind: Type, values: &[f64], shape: &[usize]) -> PyResult<Values> {
        Ok(match kind {
            Type::Real => Values::Real(Array::new(py, values.to_vec(), shape)?),
            Type::Single => Values::Single(Array::new(py, values.iter().map(|x| *x as f32).collect(), shape)?),
            Type::Int => Values::Int(Array::new(py, values.iter().map(|x| *x as i32).collect(), shape)?),
            Type::Flag => Values::Flag(Array::new(py, values.iter().map(|x| *x != 0.0).collect(), shape)?),
        })
    }

    pub fn object<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        each!(self, a => a.object(py).into_any())
    }

    pub fn lock(&self, py: Python) -> PyResult<()> {
        each!(self, a => a.lock(py))
    }

    pub fn held(&self, py: Python) -> bool {
        each!(self, a => a.held(py))
    }

    pub fn read(&self, py: Python) -> Vec<f64> {
        match self {
            Values::Real(a) => a.values(py),
            Values::Single(a) => a.values(py).into_iter().map(f64::from).collect(),
            Values::Int(a) => a.values(py).into_iter().map(f64::from).collect(),
            Values::Flag(a) => a.values(py).into_iter().map(f64::from).collect(),
        }
    }

    pub fn write(&self, py: Python, values: &[f64]) {
        match self {
            Values::Real(a) => a.write(py, values),
            Values::Single(a) => a.write(py, &values.iter().map(|x| *x as f32).collect::<Vec<_>>()),
            Values::Int(a) => a.write(py, &values.iter().map(|x| *x as i32).collect::<Vec<_>>()),
            Values::Flag(a) => a.write(py, &values.iter().map(|x| *x != 0.0).collect::<Vec<_>>()),
        }
    }
}

/// A new array of Python's own.
pub fn fresh<'py>(py: Python<'py>, kind: Type, values: &[f64], shape: &[usize]) -> PyResult<Bound<'py, PyAny>> {
    Ok(Values::new(py, kind, values, shape)?.object(py))
}

/// Copies numbers into an array that was given, whatever its strides.
///
/// Errors: `TypeError` where it has another number of elements, or cannot be written.
pub fn fill(name: &str, array: &Bound<PyArrayDyn<f64>>, values: &[f64]) -> PyResult<()> {
    use numpy::{PyArrayMethods, PyUntypedArrayMethods};
    let wrong = pyo3::exceptions::PyTypeError::new_err;
    if array.len() != values.len() {
        return Err(wrong(format!("{name} should have {} numbers, not {}", values.len(), array.len())));
    }
    let mut out = array.try_readwrite().map_err(|e| wrong(format!("{name} cannot be written: {e}")))?;
    out.as_array_mut().iter_mut().zip(values).for_each(|(to, from)| *to = *from);
    Ok(())
}
