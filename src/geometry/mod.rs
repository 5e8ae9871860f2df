//! Plain geometric data: no files, no radar, no materials.

pub mod mesh;
pub mod raster;
pub mod surface_nets;
#[cfg(test)]
pub(crate) mod checks;

pub use mesh::{FacetLabels, Mesh};
pub use raster::Raster;
pub use surface_nets::surface_nets;
