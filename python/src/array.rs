//! NumPy arrays through which numbers are exchanged with the engine: the only `unsafe` code of Penny.
//!
//! The engine's numbers stay in its own memory, and NumPy's in NumPy's. They are copied from one to the other at the
//! beginning and at the end of a call, while Python's global lock is held; in between the engine works without the lock.
//! So a view stays valid as long as anybody holds it, and what another thread writes during a step cannot be half read.
//!
//! Why `unsafe`: NumPy gives no safe access without the bookkeeping of borrows, which costs more than a small step. An
//! [`Array`] is given its memory by Rust: NumPy does not own it, so it can neither be resized nor freed as long as the
//! array lives, which the handle sees to. Pointer and length therefore never change. No reference to the memory is ever
//! made, only copies, by one thread at a time.
#![allow(unsafe_code)]

use std::ptr;

use numpy::ndarray::{ArrayD, IxDyn};
use numpy::{Element, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;

/// An array of Python's whose numbers come from the engine, or go there.
pub struct Array<T: Element + Copy> {
    handle: Py<PyArrayDyn<T>>,
    at: *mut T,
    len: usize,
}

// SAFETY: `at` is only used where a `Python` token proves that this thread holds the lock.
unsafe impl<T: Element + Copy> Send for Array<T> {}
// SAFETY: as above.
unsafe impl<T: Element + Copy> Sync for Array<T> {}

impl<T: Element + Copy + PartialEq> Array<T> {
    /// In: as many values as the shape asks for, in C order.
    pub fn new(py: Python, values: Vec<T>, shape: &[usize]) -> PyResult<Array<T>> {
        let wrong = |e| pyo3::exceptions::PyValueError::new_err(format!("{e}"));
        let array = ArrayD::from_shape_vec(IxDyn(shape), values).map_err(wrong)?;
        let handle = PyArrayDyn::from_owned_array(py, array);
        let (at, len) = (handle.data(), handle.len());
        Ok(Array { handle: handle.unbind(), at, len })
    }

    /// As Python sees it.
    pub fn object<'py>(&self, py: Python<'py>) -> Bound<'py, PyArrayDyn<T>> {
        self.handle.bind(py).clone()
    }

    /// Makes it one that cannot be written.
    pub fn lock(&self, py: Python) -> PyResult<()> {
        self.handle.bind(py).getattr("flags")?.setattr("writeable", false)
    }

    /// Whether anybody but the owner of this handle can see it, or a view of it.
    pub fn held(&self, py: Python) -> bool {
        // SAFETY: the handle is alive.
        unsafe { pyo3::ffi::Py_REFCNT(self.handle.bind(py).as_ptr()) > 1 }
    }

    /// Copies its numbers out, as many as both have.
    pub fn read(&self, _: Python, out: &mut [T]) {
        // SAFETY: see the module. `out` is memory of Rust's, so the two do not overlap.
        unsafe { copy(self.at, out.as_mut_ptr(), self.len.min(out.len())) }
    }

    /// Whether its numbers are these, as many as both have.
    pub fn same(&self, _: Python, numbers: &[T]) -> bool {
        // SAFETY: see the module; one number at a time is copied.
        numbers.iter().take(self.len).enumerate().all(|(i, x)| unsafe { ptr::read(self.at.add(i)) } == *x)
    }

    /// Copies numbers in, as many as both have.
    pub fn write(&self, _: Python, values: &[T]) {
        // SAFETY: see the module. `values` is memory of Rust's, so the two do not overlap.
        unsafe { copy(values.as_ptr(), self.at, self.len.min(values.len())) }
    }

    /// All its numbers.
    pub fn values(&self, py: Python) -> Vec<T>
    where
        T: Default,
    {
        let mut out = vec![T::default(); self.len];
        self.read(py, &mut out);
        out
    }

    /// How many numbers it has.
    pub fn len(&self) -> usize {
        self.len
    }
}

/// Copies n numbers. Most arrays of most models are empty, and have no call of `memcpy`.
///
/// SAFETY: `from` and `to` are n numbers each, and do not overlap.
#[inline]
unsafe fn copy<T: Copy>(from: *const T, to: *mut T, n: usize) {
    match n {
        0 => {}
        // SAFETY: of the caller.
        1 => unsafe { ptr::write(to, ptr::read(from)) },
        // SAFETY: of the caller.
        n => unsafe { ptr::copy_nonoverlapping(from, to, n) },
    }
}

impl Array<f64> {
    /// Whether all its numbers are zero.
    pub fn is_zero(&self, _: Python) -> bool {
        // Without a branch in it several numbers are looked at together; the shift drops the sign.
        // SAFETY: see the module; one number at a time is copied.
        (0..self.len).fold(0, |bits, i| bits | unsafe { ptr::read(self.at.add(i)) }.to_bits() << 1) == 0
    }
}
