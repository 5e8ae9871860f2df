//! Numbers and arrays of them as arguments.

use pyo3::exceptions::{PyOverflowError, PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::error::UsageError;

/// A seed as an argument.
pub(crate) fn seed(given: &Bound<'_, PyAny>) -> PyResult<u64> {
    given.extract().map_err(|error: PyErr| {
        if !error.is_instance_of::<PyOverflowError>(given.py()) {
            return error;
        }
        let most = u64::MAX;
        let problem =
            format!("seed = {given} is out of range; give a whole number from 0 to {most}");
        UsageError::new_err(problem)
    })
}

/// The same, or None.
pub(crate) fn seed_if_any(given: &Bound<'_, PyAny>) -> PyResult<Option<u64>> {
    if given.is_none() { Ok(None) } else { seed(given).map(Some) }
}

/// An array of what is given, float64; what a mask hides is NaN.
pub(crate) fn array<'py>(name: &str, given: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let numpy = given.py().import("numpy")?;
    let masked = numpy.getattr("ma")?;
    let is_masked: bool = masked.call_method1("isMaskedArray", (given,))?.extract()?;
    let plain = if is_masked {
        let floats = given.call_method1("astype", ("float64",))?;
        floats.call_method1("filled", (f64::NAN,))?
    } else {
        numpy.call_method1("asarray", (given,))?
    };
    let kind = plain.getattr("dtype")?;
    let is_real = ["f", "i", "u", "O"].contains(&kind.getattr("kind")?.extract::<&str>()?);
    if !is_real {
        return Err(PyTypeError::new_err(format!(
            "{name} has values of type {kind}; give real numbers"
        )));
    }
    numpy.call_method1("asarray", (plain, "float64"))
}

/// The numbers of an array of one dimension; one number alone is such an array, too.
pub(crate) fn line(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let array = array(name, given)?;
    let shape = array.getattr("shape")?;
    if shape.len()? > 1 {
        let problem = format!("{name} has the shape {shape}; give an array of one dimension");
        return Err(PyValueError::new_err(problem));
    }
    array.call_method0("ravel")?.call_method0("tolist")?.extract()
}

/// The rows of an array of three columns.
pub(crate) fn rows(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<[f64; 3]>> {
    let array = array(name, given)?;
    let shape = array.getattr("shape")?;
    let Ok((_, 3)) = shape.extract::<(usize, usize)>() else {
        let problem = format!("{name} has the shape {shape}; give (n, 3)");
        return Err(PyValueError::new_err(problem));
    };
    array.call_method0("tolist")?.extract()
}
