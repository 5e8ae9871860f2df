//! Which format a mesh file has, by its extension.

use super::error::FormatError;
use super::{obj, ply, stl};
use crate::geometry::Mesh;

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
    /// When the bytes are not a file of the format, by their place; [`FormatError::Mesh`] when the mesh has no facets or a
    /// facet with a corner that is not finite.
    pub fn read(self, bytes: &[u8]) -> Result<Mesh, FormatError> {
        let mesh = match self {
            MeshFormat::Ply => ply::read_mesh(bytes),
            MeshFormat::Obj => obj::read_mesh(bytes),
            MeshFormat::Stl => stl::read_mesh(bytes),
        }?;
        let mesh = mesh.without_removed_vertices();
        mesh.validate()?;
        Ok(mesh)
    }
}
