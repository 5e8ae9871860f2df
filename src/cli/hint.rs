//! Flags that the way out of an error needs: the library speaks of settings, and here are their names.

use crate::error::Error;

/// The error with another way out, where it says one in words.
pub(super) fn or_else(error: Error, way_out: &str) -> Error {
    match error {
        Error::Usage { problem, way_out: first } => {
            Error::Usage { problem, way_out: format!("{first}, or {way_out}") }
        }
        error => error,
    }
}
