//! Closest hits on a graphics processor: any rays, by any Vulkan driver. Feature `gpu`.
//!
//! The device walks the hierarchy of [`Bvh`], one invocation for each ray (`closest.wgsl`). A picture of
//! the rays, as in the pinhole, would serve one origin only; a walk serves the scans of many poses, receivers and
//! bounces alike, in one call, and on a device it is the build that is slow, which [`GpuMesh`] keeps.
//!
//! - **The device finds**, in f32 with bounds of its rounding. It names a facet when the ray surely passes
//!   through it, and surely nearer than through any other; it says that there is none when there surely is none.
//! - **The processor decides** in f64 the rays of which the device is not sure: those that pass near
//!   an edge, and those that meet two facets at almost the same range. For all it measures range and angle.
//!
//! So the hits are those of the hierarchy, bit for bit, on any device. What comes back of them is the device's where
//! whole scans are wanted and f32 will do (`echo.rs`), else the processor's.

#[cfg(feature = "gpu")]
mod device;
#[cfg(not(feature = "gpu"))]
#[path = "no_device.rs"]
mod device;
mod echo;
mod error;
mod mesh;
mod packed;

pub use echo::{EchoTracer, RAYS_PER_SHARE, Share};
pub use error::GpuError;
pub use mesh::{Answer, Gpu, GpuMesh};
pub use packed::Cone;

#[cfg(all(test, feature = "gpu"))]
mod tests {
    use super::Gpu;

    /// An adapter with buffers of at most so many bytes; `None`, with a word about it, where there is none.
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
