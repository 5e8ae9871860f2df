//! Traces rays on a graphics processor, by any Vulkan driver. Feature `gpu`.
//!
//! The device traverses the hierarchy of [`Bvh`](super::Bvh), one invocation per ray (`closest.wgsl`). Unlike the
//! picture of a fan, a traversal serves scans of many poses, receivers and second-order paths in one call. Its slow
//! part is the upload of the hierarchy, which [`GpuMesh`] does once.
//!
//! - **The device searches** in f32, with bounds of its rounding. It names a facet if the ray certainly passes
//!   through it, and certainly nearer than through any other. It reports a miss if the ray certainly misses everything.
//! - **The CPU decides** the other rays in f64: those near an edge, and those with two facets at almost
//!   the same range. It computes the range and angle of every hit.
//!
//! So the hits are bit for bit those of the hierarchy, on any device. Where f32 is precise enough, the device can also
//! add up the echoes of whole scans (`echo.rs`).

#[cfg(feature = "gpu")]
mod device;
#[cfg(not(feature = "gpu"))]
#[path = "no_device.rs"]
mod device;
mod echo;
mod error;
mod mesh;
mod packed;

pub use echo::{EchoTracer, Piece, RAYS_PER_SHARE, Share};
pub use error::GpuError;
pub use mesh::{Answer, Gpu, GpuMesh};
pub use packed::Cone;

#[cfg(all(test, feature = "gpu"))]
mod tests {
    use super::Gpu;

    /// An adapter with buffers of at most `buffer_bytes`. Without an adapter it prints the reason and returns `None`.
    pub fn gpu(buffer_bytes: u64) -> Option<Gpu> {
        match Gpu::limited(buffer_bytes) {
            Ok(gpu) => Some(gpu),
            Err(error) => {
                assert!(
                    std::env::var_os("MATDB_NEED_GPU").is_none(),
                    "MATDB_NEED_GPU is set: {error}"
                );
                eprintln!("skipped: {error}");
                None
            }
        }
    }
}
