//! Bytes to plain data and back. Nothing here knows a radar, a scene or a material.
//!
//! Every reader takes the bytes of a whole file and is total: any input gives a value or a
//! [`FormatError`] that says where and how to mend it. No reader allocates more than a small
//! multiple of the bytes it was given, whatever a header claims.

pub mod axis;
pub mod csv;
pub mod drawing;
pub mod exr;
pub mod figure;
pub mod text;

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
