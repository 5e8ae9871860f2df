//! Why a scene cannot be loaded.

use std::path::{Path, PathBuf};

use thiserror::Error;

use super::regions::RegionError;
use crate::formats::FormatError;
use crate::geometry::mesh::MeshError;
use crate::radar::RadarError;

/// Why a scene cannot be loaded.
#[derive(Debug, Error)]
pub enum SceneError {
    /// A file that cannot be read.
    #[error("cannot read {}: {reason}; check the path{hint}", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// What the system says.
        reason: std::io::Error,
        /// Where the path came from.
        hint: &'static str,
    },
    /// The scene file does not follow its format.
    #[error("{}: {error}", file.display())]
    Format {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        error: FormatError,
    },
    /// The radar cannot exist.
    #[error("{}: {error}", file.display())]
    Radar {
        /// The scene file.
        file: PathBuf,
        /// What is wrong.
        error: RadarError,
    },
    /// Facets cannot be assigned.
    #[error("{}: {error}", file.display())]
    Region {
        /// The scene file.
        file: PathBuf,
        /// What is wrong.
        error: RegionError,
    },
    /// Something else in the scene file has no meaning.
    #[error("{}: {place}: {problem}; {way_out}", file.display())]
    Value {
        /// The scene file.
        file: PathBuf,
        /// Where in it.
        place: String,
        /// What is wrong.
        problem: String,
        /// What to do.
        way_out: String,
    },
    /// A mesh is too large, or has nothing to hit.
    #[error("{}: {error}", file.display())]
    Mesh {
        /// The mesh file.
        file: PathBuf,
        /// What is wrong.
        error: MeshError,
    },
}

impl SceneError {
    /// The file that it is about.
    pub fn file(&self) -> &Path {
        match self {
            SceneError::Unreadable { file, .. }
            | SceneError::Format { file, .. }
            | SceneError::Radar { file, .. }
            | SceneError::Region { file, .. }
            | SceneError::Value { file, .. }
            | SceneError::Mesh { file, .. } => file,
        }
    }
}
