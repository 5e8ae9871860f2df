//! Columns by name.

use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyCapsule, PyDict, PyList, PyTuple};

use crate::arrow::{Column, stream};

/// Columns by name, of one length: a mapping of names to arrays, which nobody may write. `pyarrow.table`,
/// `polars.DataFrame` and `pandas.DataFrame.from_arrow` take it, too.
#[pyclass(frozen, mapping, module = "matdb")]
pub(crate) struct Table {
    columns: Py<PyDict>,
}

impl Table {
    pub(crate) fn new(columns: Py<PyDict>) -> Table {
        Table { columns }
    }
}

#[pymethods]
impl Table {
    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        self.columns.bind(py).as_any().get_item(name)
    }

    /// Number of columns.
    fn __len__(&self, py: Python<'_>) -> usize {
        self.columns.bind(py).len()
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(self.columns.bind(py).try_iter()?.into_any())
    }

    fn __contains__(&self, py: Python<'_>, name: &Bound<'_, PyAny>) -> PyResult<bool> {
        self.columns.bind(py).contains(name)
    }

    /// The column of a name, else `default`.
    #[pyo3(signature = (name, default = None, /))]
    fn get<'py>(
        &self,
        py: Python<'py>,
        name: &Bound<'py, PyAny>,
        default: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Option<Bound<'py, PyAny>>> {
        Ok(self.columns.bind(py).get_item(name)?.or(default))
    }

    /// Names of the columns.
    fn keys<'py>(&self, py: Python<'py>) -> Bound<'py, PyList> {
        self.columns.bind(py).keys()
    }

    /// The columns.
    fn values<'py>(&self, py: Python<'py>) -> Bound<'py, PyList> {
        self.columns.bind(py).values()
    }

    /// Names and columns.
    fn items<'py>(&self, py: Python<'py>) -> Bound<'py, PyList> {
        self.columns.bind(py).items()
    }

    /// A copy as a table of pyarrow. NaN is null.
    fn to_arrow<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("matdb._extras")?.call_method1("to_arrow", (slf,))
    }

    /// A copy by the Arrow C stream interface. NaN is null.
    #[pyo3(signature = (requested_schema = None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        let _ = requested_schema;
        let columns = self.columns.bind(py).iter();
        stream(py, columns.map(|(name, values)| column(&name, &values)).collect::<PyResult<_>>()?)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let columns = self.columns.bind(py);
        let rows = columns.values().iter().next().map_or(Ok(0), |first| first.len())?;
        let names: Vec<String> = columns.keys().extract()?;
        Ok(format!("<matdb.Table of {rows} rows: {}>", names.join(", ")))
    }

    /// A table of its columns, as pickle makes one.
    #[staticmethod]
    fn _of_columns(columns: Py<PyDict>) -> Table {
        Table { columns }
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let parts = (&slf.get().columns,);
        (slf.get_type().getattr("_of_columns")?, parts).into_pyobject(slf.py())
    }
}

/// A copy of an array.
fn column(name: &Bound<'_, PyAny>, values: &Bound<'_, PyAny>) -> PyResult<Column> {
    let name: String = name.extract()?;
    if let Ok(values) = values.cast::<PyArray1<f64>>() {
        return Ok(Column::of_f64(&name, values.to_vec()?));
    }
    if let Ok(values) = values.cast::<PyArray1<f32>>() {
        return Ok(Column::of_f32(&name, values.to_vec()?));
    }
    if let Ok(values) = values.cast::<PyArray1<u32>>() {
        return Ok(Column::of_u32(&name, values.to_vec()?.into_iter().map(Some)));
    }
    Ok(Column::of_i32(&name, values.cast::<PyArray1<i32>>()?.to_vec()?))
}
