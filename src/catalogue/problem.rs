//! What is wrong with a publication or a database.

use std::fmt;

use serde::Serialize;

/// Something that is not as it should be.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Problem {
    /// The file, or the material and its revision.
    pub place: String,
    /// What is wrong.
    pub problem: String,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.problem)
    }
}

pub(super) fn problem(place: impl Into<String>, problem: impl fmt::Display) -> Problem {
    Problem { place: place.into(), problem: problem.to_string() }
}
