//! Why a material is refused.

use thiserror::Error;

use crate::brdf::{ParameterError, TabulatedError};

/// Why a material cannot be kept.
#[derive(Debug, Error, PartialEq)]
pub enum MaterialError {
    /// A parameter outside its range.
    #[error("fit `{fit}`: {error}")]
    Parameter {
        /// Name of the fit.
        fit: String,
        /// What is wrong.
        error: ParameterError,
    },
    /// A curve that cannot be rendered, though it is asked for.
    #[error("curve `{curve}` cannot be rendered: {error}")]
    Curve {
        /// Name of the curve.
        curve: String,
        /// What is wrong.
        error: TabulatedError,
    },
    /// A key or name that refers to nothing.
    #[error("{place} refers to {what} `{name}`, which is not defined; {}", define(known))]
    Dangling {
        /// Where the reference stands.
        place: String,
        /// What it should name.
        what: &'static str,
        /// The name.
        name: String,
        /// What there is.
        known: Vec<String>,
    },
    /// The same name twice.
    #[error("{what} `{name}` is defined twice; rename one")]
    Twice {
        /// What is named.
        what: &'static str,
        /// The name.
        name: String,
    },
    /// A value that has no meaning.
    #[error("{place}: {problem}; {way_out}")]
    Value {
        /// Where.
        place: String,
        /// What is wrong.
        problem: String,
        /// What to do.
        way_out: String,
    },
}

fn define(known: &[String]) -> String {
    match known {
        [] => "define it, or leave the reference out".to_owned(),
        _ => format!("define it or name one of: {}", known.join(", ")),
    }
}

/// Refuses a value that has no meaning.
pub(super) fn value(place: &str, problem: &str, way_out: &str) -> MaterialError {
    MaterialError::Value {
        place: place.to_owned(),
        problem: problem.to_owned(),
        way_out: way_out.to_owned(),
    }
}

/// Refuses a key or name that refers to nothing.
pub(super) fn dangling(
    place: &str,
    what: &'static str,
    name: &str,
    known: Vec<String>,
) -> MaterialError {
    MaterialError::Dangling { place: place.to_owned(), what, name: name.to_owned(), known }
}
