//! Errors of the library as one tree of exceptions.

use std::path::Path;

use pyo3::exceptions::PyException;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use pyo3::{PyErr, create_exception};

use crate::words::in_python;

create_exception!(
    matdb,
    Error,
    PyException,
    "Anything that matdb refuses: one sentence with the place and the way out. `file` is the file that it is about, and `hint` \
     the way out; None where there is none."
);
create_exception!(
    matdb,
    UsageError,
    Error,
    "A request that means nothing, or asks for what there is not."
);
create_exception!(matdb, SceneError, Error, "A scene cannot be loaded.");
create_exception!(matdb, MaterialError, Error, "A material cannot be read, or is not there.");
create_exception!(matdb, StoreError, Error, "The database refused.");
create_exception!(matdb, RenderError, Error, "A scene cannot be rendered.");
create_exception!(matdb, FileError, Error, "A file or folder cannot be read or written.");
create_exception!(matdb, CloudError, Error, "A measured cloud cannot be used.");
create_exception!(matdb, FitError, Error, "A curve cannot be fitted.");
create_exception!(matdb, DiagnoseError, Error, "Nothing can be said about a cloud or a curve.");
create_exception!(matdb, CatalogueError, Error, "A catalogue cannot be published or taken over.");

/// The exception for an error of the library, with the sentence of the command line and keywords in the place of its flags.
pub(crate) fn raised<Refused: Into<matdb::error::Error>>(error: Refused) -> PyErr {
    let error = error.into();
    Python::attach(|py| exception(py, &error).unwrap_or_else(|failed| failed))
}

fn exception(py: Python<'_>, error: &matdb::error::Error) -> PyResult<PyErr> {
    use matdb::error::Error as E;
    let sentence = in_python(&matdb::cli::message(error));
    let hint = sentence.rsplit_once("; ").map(|(_, hint)| hint.to_owned());
    let kind = match error {
        // This one is a KeyError, too.
        E::UnknownMaterial { .. } => py.import("matdb._errors")?.getattr("UnknownMaterialError")?,
        E::Scene(_) | E::Radar(_) | E::Effect { .. } => py.get_type::<SceneError>().into_any(),
        E::Render { .. } => py.get_type::<RenderError>().into_any(),
        E::Material(_) | E::MaterialFile(_) => py.get_type::<MaterialError>().into_any(),
        E::Store(_) | E::NoDatabase { .. } => py.get_type::<StoreError>().into_any(),
        E::Files(_) => py.get_type::<FileError>().into_any(),
        E::Cloud { .. } | E::Registration(_) | E::Reduction(_) | E::Calibration { .. } => {
            py.get_type::<CloudError>().into_any()
        }
        E::Fit { .. } | E::NotConverged { .. } | E::CurveFile { .. } | E::Observation { .. } => {
            py.get_type::<FitError>().into_any()
        }
        E::Diagnose(_) | E::CurveDiagnosis { .. } => py.get_type::<DiagnoseError>().into_any(),
        E::Catalogue(_) | E::Exchange(_) | E::About(_) => {
            py.get_type::<CatalogueError>().into_any()
        }
        E::Usage { .. } => py.get_type::<UsageError>().into_any(),
        _ => py.get_type::<Error>().into_any(),
    };
    let raised = kind.call1((sentence,))?;
    raised.setattr("file", file_of(error))?;
    raised.setattr("hint", hint)?;
    Ok(PyErr::from_value(raised))
}

/// The file that an error is about.
fn file_of(error: &matdb::error::Error) -> Option<&Path> {
    use matdb::error::Error as E;
    match error {
        E::Render { scene: file, .. }
        | E::Cloud { file, .. }
        | E::Calibration { file, .. }
        | E::CurveFile { file, .. }
        | E::NoDatabase { path: file }
        | E::Unstored { report: file, .. } => Some(file),
        E::Files(error) => Some(&error.path),
        E::Scene(error) => Some(error.file()),
        _ => None,
    }
}

/// The refusal of a word that is none of a few.
pub(crate) fn no_choice(key: &str, given: &str, known: &str) -> PyErr {
    UsageError::new_err(format!("{key} = {given:?} is not known; give {known}"))
}

/// Says what a person should not overlook.
pub(crate) fn warn(py: Python<'_>, notices: &[String]) -> PyResult<()> {
    let warnings = py.import("warnings")?;
    for notice in notices {
        let words = PyTuple::new(py, [in_python(notice).into_pyobject(py)?])?;
        warnings.call_method1("warn", words)?;
    }
    Ok(())
}
