//! The closest intersection of each ray with a mesh.
//!
//! [`Fan`] traces rays of one origin, as a scan has them, without building a hierarchy. [`Bvh`] traces any rays by a
//! hierarchy of boxes, those of a spot together, and [`Gpu`] does so on a graphics processor. All of them search in
//! f32, and decide and measure in f64. [`Tracer`] chooses among them. [`brute`], the naive loop over all facets, is their test oracle.
//!
//! The mesh must pass [`Mesh::validate`](crate::geometry::Mesh::validate) and lie within 100 km of the origin, where
//! f32 is precise enough. Facets without area are never hit.

mod boxes;
pub mod brute;
mod bundle;
mod bvh;
mod eightfold;
mod facet;
mod gpu;
mod hit;
mod inside;
mod local_frame;
mod pinhole;
mod scan;
#[cfg(test)]
mod testing;
mod tracer;

pub use bvh::Bvh;
pub use gpu::{Answer, Gpu, GpuError, GpuMesh};
pub(crate) use gpu::{Cone, EchoTracer, Piece, RAYS_PER_SHARE, Share};
pub use hit::Hit;
pub use inside::winding_number;
pub use local_frame::LocalFrame;
pub use pinhole::{Fan, NoFan};
pub use scan::ScanGeometry;
pub use tracer::{TraceError, Tracer, closest};
