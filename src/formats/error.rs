//! Why a file's bytes could not be read.

use thiserror::Error;

/// Why a file's bytes could not be read.
#[derive(Debug, Error, PartialEq)]
pub enum FormatError {
    /// The bytes do not follow the format.
    #[error("{place}: {problem}; {way_out}")]
    Malformed {
        /// Where: a line, a byte offset, an element and its number.
        place: String,
        /// What is wrong there.
        problem: String,
        /// What the user can do about it.
        way_out: String,
    },
    /// The format was read, but what it holds is not a usable mesh.
    #[error(transparent)]
    Mesh(#[from] crate::geometry::mesh::MeshError),
}

impl FormatError {
    /// A malformed place in a file.
    pub fn at(
        place: impl Into<String>,
        problem: impl Into<String>,
        way_out: impl Into<String>,
    ) -> FormatError {
        FormatError::Malformed {
            place: place.into(),
            problem: problem.into(),
            way_out: way_out.into(),
        }
    }
}
