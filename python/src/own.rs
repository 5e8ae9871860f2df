//! Functions of the program that the work calls.

use std::cell::Cell;
use std::panic::resume_unwind;

use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::UsageError;

thread_local! {
    /// Whether this thread is in a function of the program.
    static IS_INSIDE: Cell<bool> = const { Cell::new(false) };
}

/// Refuses work that a function of the program asks for which the work calls: it would wait for the threads that wait for it.
pub(crate) fn refuse_inside() -> PyResult<()> {
    if IS_INSIDE.get() {
        let problem = "a function of an effect or of a law is called by the work, and cannot render, fit or diagnose itself; \
                       compute it before";
        return Err(UsageError::new_err(problem));
    }
    Ok(())
}

/// The numbers, dB, that a function of the program gives for `count` of something. One number stands for all.
pub(crate) fn levels_db<'py>(
    function: &Bound<'py, PyAny>,
    of: impl IntoPyObject<'py>,
    named: &Bound<'py, PyDict>,
    count: usize,
) -> PyResult<Vec<f64>> {
    let numpy = function.py().import("numpy")?;
    let of = of.into_bound_py_any(function.py())?;
    let levels_db =
        numpy.call_method1("asarray", (function.call((of,), Some(named))?, "float64"))?;
    numpy.call_method1("broadcast_to", (levels_db, count))?.call_method0("tolist")?.extract()
}

/// What a function of the program gives that the work calls. The work cannot refuse: it unwinds with the error, as Ctrl-C
/// unwinds it.
pub(crate) fn called<T>(call: impl FnOnce(Python<'_>) -> PyResult<T>) -> T {
    let before = IS_INSIDE.replace(true);
    let given = Python::attach(call);
    IS_INSIDE.set(before);
    or_unwind(given)
}

/// What was given. Work that has no way to refuse unwinds with the error.
pub(crate) fn or_unwind<T>(given: PyResult<T>) -> T {
    given.unwrap_or_else(|raised| resume_unwind(Box::new(raised)))
}

/// A dictionary of a mapping.
pub(crate) fn dict_of<'py>(mapping: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyDict>> {
    Ok(mapping.py().get_type::<PyDict>().call1((mapping,))?.cast_into()?)
}
