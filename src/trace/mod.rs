//! Closest hits of rays on a mesh.
//!
//! [`Fan`] finds what rays of one origin meet, as the rays of a scan are, and builds nothing for it. [`Bvh`]
//! takes any ray and finds facets with boxes; a [`Gpu`] does the same with many rays at once. All look in
//! f32 and decide and measure in f64; [`brute`] is the naive loop that judges them, and [`Tracer`] chooses.
//! All take any mesh that passes [`Mesh::validate`](crate::geometry::Mesh::validate) and lies within
//! 100 km, where f32 does its work; facets without area are never hit.

mod boxes;
pub mod brute;
mod bvh;
mod eightfold;
mod facet;
mod gpu;
mod hit;
mod inside;
mod pinhole;
mod scan;
mod tracer;
mod wide;

pub use bvh::Bvh;
pub use gpu::{Answer, Gpu, GpuError, GpuMesh};
pub(crate) use gpu::{Cone, EchoTracer, RAYS_PER_SHARE, Share};
pub use hit::Hit;
pub use inside::winding_number;
pub use pinhole::{Fan, NoFan};
pub use scan::ScanGeometry;
pub use tracer::{TraceError, Tracer, closest};
