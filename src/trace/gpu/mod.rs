//! Closest hits on a graphics processor: any rays, by any Vulkan driver. Feature `gpu`.
//!
//! The device walks the hierarchy of [`Bvh`], one invocation for each ray (`closest.wgsl`). A picture of
//! the rays, as in the pinhole, would serve one origin only; a walk serves the scans of many poses, receivers and
//! bounces alike, in one call, and on a device it is the build that is slow, which [`Held`] keeps.
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
mod echo;
#[cfg(not(feature = "gpu"))]
mod no_device;
mod packed;

use rayon::prelude::*;
use thiserror::Error;

use super::facet::met;
use super::{Bvh, Hit};
use crate::frames::{Global, Ray};
use packed::NOTHING;

#[cfg(feature = "gpu")]
use device::{Device, Flight, Table, Tree};
#[cfg(not(feature = "gpu"))]
use no_device::{Device, Flight, Table, Tree};

pub use echo::{Cone, Lit, RAYS_PER_SHARE, Share};

/// Rays of one call of the device: enough to occupy it, and not so many that a driver thinks it hangs.
const RAYS_AT_ONCE: u64 = 1 << 20;

/// Why a graphics processor does not trace.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum GpuError {
    /// The program was built without it.
    #[error(
        "this matdb was built without the tracer `gpu`; build it with `--features gpu`, or leave the choice to \
         the program"
    )]
    NotBuilt,
    /// No driver, or none that can compute.
    #[error("the tracer `gpu` finds no adapter with a Vulkan driver: {reason}")]
    NoAdapter {
        /// What the search says.
        reason: String,
    },
    /// The mesh and its hierarchy are larger than the device takes.
    #[error(
        "the mesh takes {needed} bytes in one buffer of `{adapter}`, which has room for {most}; use the tracer `bvh`"
    )]
    TooLarge {
        /// The device.
        adapter: String,
        /// Bytes that are needed.
        needed: u64,
        /// Bytes that it has.
        most: u64,
    },
    /// More materials, or more rays in a spot, than the device takes.
    #[error(
        "the materials and spots of the scans take {needed} bytes in one buffer of `{adapter}`, which has room for \
         {most}; give fewer scans at once"
    )]
    TooMany {
        /// The device.
        adapter: String,
        /// Bytes that are needed.
        needed: u64,
        /// Bytes that it has.
        most: u64,
    },
    /// The device's memory is in use.
    #[error("`{adapter}` has no memory left for {needed} bytes; use the tracer `bvh`")]
    Full {
        /// The device.
        adapter: String,
        /// Bytes that were asked for.
        needed: u64,
    },
    /// It stopped.
    #[error("`{adapter}` stopped working: {reason}; try again, or use the tracer `bvh`")]
    Lost {
        /// The device.
        adapter: String,
        /// What the driver says.
        reason: String,
    },
    /// It holds another mesh.
    #[error("the tracer `gpu` holds another mesh than the one that is traced; hold this one")]
    OtherMesh,
}

/// A graphics processor.
pub struct Gpu {
    device: Device,
}

/// A mesh in the memory of a graphics processor.
pub struct Held<'a> {
    gpu: &'a Gpu,
    bvh: &'a Bvh<'a>,
    /// None of a mesh without area.
    tree: Option<Tree>,
}

/// What the device says of a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// It meets no facet.
    Nothing,
    /// It meets this facet first.
    Facet(u32),
    /// f32 cannot tell.
    Unsure,
}

impl Gpu {
    /// The fastest kind of adapter that there is: discrete before integrated before virtual before software.
    ///
    /// # Errors
    /// When there is none, or the program was built without the feature `gpu`.
    pub fn new() -> Result<Gpu, GpuError> {
        Gpu::limited(u64::MAX)
    }

    /// The same, whose buffers have at most so many bytes each: smaller meshes, and fewer rays at once.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn limited(buffer_bytes: u64) -> Result<Gpu, GpuError> {
        Device::open(buffer_bytes).map(|device| Gpu { device })
    }

    /// The adapter's name.
    pub fn adapter(&self) -> &str {
        self.device.adapter()
    }

    /// Takes a mesh and its hierarchy over; that is built if it is not yet.
    ///
    /// # Errors
    /// When the device has no room for them.
    pub fn hold<'a>(&'a self, bvh: &'a Bvh<'a>) -> Result<Held<'a>, GpuError> {
        let boxes = bvh.boxes();
        let hold = || self.device.hold(&packed::nodes(boxes), &packed::corners(boxes, bvh.mesh()));
        let tree = (!boxes.facets.is_empty()).then(hold).transpose()?;
        Ok(Held { gpu: self, bvh, tree })
    }
}

impl<'a> Held<'a> {
    /// The hierarchy that is held.
    pub fn bvh(&self) -> &'a Bvh<'a> {
        self.bvh
    }

    /// The closest hits of all rays, in their order; of equally near facets the one with the smallest
    /// number.
    ///
    /// # Errors
    /// When the device stops working or has no memory for the rays.
    pub fn closest(&self, rays: &[Ray<Global>]) -> Result<Vec<Option<Hit>>, GpuError> {
        self.each(rays, |ray, answer| match answer {
            Answer::Nothing => None,
            Answer::Unsure => self.bvh.closest(ray),
            Answer::Facet(facet) => {
                let hit = met(self.bvh.mesh(), facet, ray);
                hit.or_else(|| self.bvh.closest(ray))
            }
        })
    }

    /// What the device says by itself.
    ///
    /// # Errors
    /// As [`closest`](Self::closest).
    pub fn answers(&self, rays: &[Ray<Global>]) -> Result<Vec<Answer>, GpuError> {
        self.each(rays, |_, answer| answer)
    }

    /// What becomes of the answer to every ray.
    fn each<T: Send>(
        &self,
        rays: &[Ray<Global>],
        then: impl Fn(&Ray<Global>, Answer) -> T + Sync,
    ) -> Result<Vec<T>, GpuError> {
        let Some(tree) = &self.tree else {
            return Ok(rays.iter().map(|ray| then(ray, Answer::Nothing)).collect());
        };
        let boxes = self.bvh.boxes();
        let mut all = Vec::with_capacity(rays.len());
        let answer = |code: u32| match (code, boxes.facets.get(code as usize)) {
            (NOTHING, _) => Answer::Nothing,
            (_, Some(&facet)) => Answer::Facet(facet),
            (_, None) => Answer::Unsure,
        };
        let at_once = self.gpu.device.rays_at_once(RAYS_AT_ONCE);
        let launch = |rays: &[_]| self.gpu.device.launch(tree, &packed::aims(boxes, rays));
        in_turns(rays, at_once, launch, |rays, flight| {
            let answers = self.gpu.device.land(flight)?;
            let each = rays.par_iter().zip(answers).with_min_len(1024);
            all.par_extend(each.map(|(ray, code)| then(ray, answer(code))));
            Ok(())
        })?;
        Ok(all)
    }
}

/// The device has the next items while the processor sees to these.
fn in_turns<T>(
    items: &[T],
    at_once: usize,
    launch: impl Fn(&[T]) -> Result<Flight, GpuError>,
    mut land: impl FnMut(&[T], Flight) -> Result<(), GpuError>,
) -> Result<(), GpuError> {
    let mut flying = None;
    for items in items.chunks(at_once) {
        let next = launch(items)?;
        if let Some((items, flight)) = flying.replace((items, next)) {
            land(items, flight)?;
        }
    }
    flying.map_or(Ok(()), |(items, flight)| land(items, flight))
}

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
