//! Functions of the program that the work calls.

use std::cell::Cell;
use std::panic::resume_unwind;
use std::sync::OnceLock;

use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::UsageError;
use crate::numbers;

thread_local! {
    /// Whether this thread is in a function of the program.
    static IS_INSIDE: Cell<bool> = const { Cell::new(false) };
}

/// The process that loaded the module.
static PROCESS: OnceLock<u32> = OnceLock::new();

/// Notes the process that loads the module.
pub(crate) fn note_process() {
    PROCESS.get_or_init(std::process::id);
}

/// Refuses work of a process that was forked: it has none of the threads that would do it.
pub(crate) fn refuse_forked() -> PyResult<()> {
    if PROCESS.get().is_some_and(|loaded_by| *loaded_by != std::process::id()) {
        let problem = "this process was forked after matdb was loaded, and lacks its threads; start processes anew, as by \
                       multiprocessing.get_context(\"spawn\")";
        return Err(UsageError::new_err(problem));
    }
    Ok(())
}

/// The same, and work that a function of the program asks for which the work calls: it would wait for the threads that wait for
/// it.
pub(crate) fn refuse_inside() -> PyResult<()> {
    refuse_forked()?;
    if IS_INSIDE.get() {
        let problem = "a function of an effect or of a law is called by the work, and cannot render, fit or diagnose itself; \
                       compute it before";
        return Err(UsageError::new_err(problem));
    }
    Ok(())
}

/// The numbers, dB, that a function of the program gives for so many of something. One number stands for all.
pub(crate) fn levels_db<'py>(
    function: &Bound<'py, PyAny>,
    of: impl IntoPyObject<'py>,
    named: &Bound<'py, PyDict>,
    (count, what): (usize, &str),
) -> PyResult<Vec<f64>> {
    let of = of.into_bound_py_any(function.py())?;
    let given = function.call((of,), Some(named))?;
    if given.is_none() {
        let problem = format!("the function gives None for {count} {what}; return numbers in dB");
        return Err(UsageError::new_err(problem));
    }
    let array = numbers::array("what the function gives", &given)?;
    let shape = array.getattr("shape")?;
    match shape.extract::<Vec<usize>>()?[..] {
        [] => Ok(vec![array.extract()?; count]),
        [length] if length == count => array.call_method0("tolist")?.extract(),
        _ => Err(UsageError::new_err(format!(
            "the function gives an array of the shape {shape} for {count} {what}; give one number for each, or one for all"
        ))),
    }
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
