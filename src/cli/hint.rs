//! Errors with the flags of their ways out: the library speaks of settings, the program of flags.

use super::console::readable;
use crate::catalogue::CatalogueError;
use crate::catalogue::exchange::{Detail, ExchangeError};
use crate::diagnose::curve::CurveDiagnoseError;
use crate::error::Error;
use crate::files::FilesError;

/// An error as the program shows it: one sentence, with the flags that lead out of it.
pub fn message(error: &Error) -> String {
    let text = match error {
        Error::Exchange(ExchangeError::Missing { file, missing }) => {
            format!("{file} does not say all that an entry needs; add {}", flags(missing))
        }
        Error::Missing { what, missing } => format!("{what} needs more; add {}", flags(missing)),
        Error::Detail { detail, problem, way_out } => {
            format!("--{} {problem}; {way_out}", detail.noun())
        }
        Error::Files(files) if files.way_out == FilesError::OTHER_FOLDER => format!("{error} (-o)"),
        Error::NoDatabase { .. } => format!("{error} (--db, $MATDB)"),
        Error::NotConverged { .. } => format!("{error} (--fix, --starts, --model)"),
        Error::CurveDiagnosis { error: CurveDiagnoseError::Noiseless, .. } => {
            format!("{error} (--noise-db)")
        }
        Error::Catalogue(CatalogueError::NoLicence { .. }) => format!("{error} (--about FILE)"),
        error => error.to_string(),
    };
    readable(&text)
}

/// The flags of details, each with an example.
fn flags(details: &[Detail]) -> String {
    let mut flags = Vec::new();
    for detail in details {
        let (noun, example) = (detail.noun(), detail.example());
        let quote = if example.contains(' ') { "\"" } else { "" };
        flags.push(format!("--{noun} {quote}{example}{quote}"));
    }
    flags.join(", ")
}

/// The error with another way out, where it says one in words.
pub(super) fn or_else(error: Error, way_out: &str) -> Error {
    match error {
        Error::Usage { problem, way_out: first } => {
            Error::Usage { problem, way_out: format!("{first}, or {way_out}") }
        }
        error => error,
    }
}
