//! What the radar looks at: meshes, where they stand, and which facets are made of what.

pub mod builtin;
pub mod change;
mod error;
pub mod file;
mod load;
pub mod mannequin;
mod read;
mod receivers;
mod reference;
pub mod regions;
pub mod solids;
mod target;

pub use change::KeyChange;
pub use error::SceneError;
pub use file::{BounceEntry, SceneFile};
pub use load::{GivenMaterials, Scene};
pub(crate) use read::read_regular;
pub use read::read_text;
pub use reference::{ReferenceShape, ReferenceTarget};
pub use regions::RegionError;
pub use target::{BUILTIN_MESHES, GivenMeshes, MeshReport, Region, Target, file_mesh, placed_mesh};
