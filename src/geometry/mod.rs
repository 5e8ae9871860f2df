//! Plain geometric data: no files, no radar, no materials.

pub mod mesh;
pub mod raster;

pub use mesh::{FacetLabels, Mesh};
pub use raster::Raster;
