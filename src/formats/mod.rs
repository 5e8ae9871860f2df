//! Bytes to plain data and back. Nothing here knows a radar, a scene or a material.
//!
//! Every reader takes the bytes of a whole file and is total: any input gives a value or a
//! [`FormatError`] that says where and how to mend it. No reader allocates more than a small
//! multiple of the bytes it was given, whatever a header claims.

pub mod csv;
pub mod effect;
pub mod exr;
pub mod figure;
pub mod npy;
pub mod obj;
pub mod ply;
pub mod stl;
pub mod text;

use glam::DVec3;
use thiserror::Error;

use crate::geometry::Mesh;

pub use effect::EffectEntry;

/// The formats a mesh can be read from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFormat {
    /// Stanford polygons, see [`ply`].
    Ply,
    /// Wavefront objects, see [`obj`].
    Obj,
    /// Stereolithography, see [`stl`].
    Stl,
}

impl MeshFormat {
    /// The format that a file's extension stands for, in upper or lower case and without the dot.
    ///
    /// ```
    /// use matdb::formats::MeshFormat;
    /// assert_eq!(MeshFormat::from_extension("PLY"), Some(MeshFormat::Ply));
    /// assert_eq!(MeshFormat::from_extension("gltf"), None);
    /// ```
    pub fn from_extension(extension: &str) -> Option<MeshFormat> {
        match extension.to_ascii_lowercase().as_str() {
            "ply" => Some(MeshFormat::Ply),
            "obj" => Some(MeshFormat::Obj),
            "stl" => Some(MeshFormat::Stl),
            _ => None,
        }
    }

    /// Reads a whole file and checks that the mesh can be used. Coordinates stay in the file's unit.
    ///
    /// # Errors
    ///
    /// See the format's `read_mesh`; and [`FormatError::Mesh`] when the mesh has no facets or a
    /// vertex that is not finite.
    pub fn read(self, bytes: &[u8]) -> Result<Mesh, FormatError> {
        let mesh = match self {
            MeshFormat::Ply => ply::read_mesh(bytes),
            MeshFormat::Obj => obj::read_mesh(bytes),
            MeshFormat::Stl => stl::read_mesh(bytes),
        }?;
        mesh.validate()?;
        Ok(mesh)
    }
}

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

/// The point that the first three words spell; further words are left alone.
fn point<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<DVec3> {
    let mut coordinate = || words.next()?.parse::<f64>().ok();
    Some(DVec3::new(coordinate()?, coordinate()?, coordinate()?))
}

/// Enough of a file's text to recognise it by, quoted.
fn excerpt(text: &str) -> String {
    const LONGEST_CHARS: usize = 60;
    format!("{:?}", text.chars().take(LONGEST_CHARS).collect::<String>())
}
