//! Errors of the library as one tree of exceptions.

use pyo3::exceptions::PyException;
use pyo3::{PyErr, create_exception};

create_exception!(
    matdb,
    Error,
    PyException,
    "Anything that matdb refuses: one sentence with the place and the way out."
);
create_exception!(matdb, UsageError, Error, "What was asked for cannot be.");
create_exception!(matdb, SceneError, Error, "A scene cannot be loaded.");
create_exception!(matdb, MaterialError, Error, "A material cannot be read, or is not there.");
create_exception!(matdb, StoreError, Error, "The database refused.");
create_exception!(matdb, RenderError, Error, "A scene cannot be rendered.");
create_exception!(matdb, FileError, Error, "A file or folder cannot be read or written.");

/// The exception for an error of the library, with the sentence of the command line.
pub(crate) fn raised<Refused: Into<matdb::error::Error>>(error: Refused) -> PyErr {
    use matdb::error::Error as E;
    let error = error.into();
    let sentence = matdb::cli::message(&error);
    match error {
        E::Scene(_) | E::Radar(_) | E::Effect { .. } => SceneError::new_err(sentence),
        E::Render { .. } => RenderError::new_err(sentence),
        E::Material(_) | E::MaterialFile(_) | E::UnknownMaterial { .. } => {
            MaterialError::new_err(sentence)
        }
        E::Store(_) | E::NoDatabase { .. } => StoreError::new_err(sentence),
        E::Files(_) => FileError::new_err(sentence),
        E::Usage { .. } => UsageError::new_err(sentence),
        _ => Error::new_err(sentence),
    }
}
