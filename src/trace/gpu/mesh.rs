//! A mesh in the memory of a graphics processor, and the closest hits of rays on it.

use rayon::prelude::*;

use super::device::{Device, Flight, Tree};
use super::error::GpuError;
use super::packed::{self, NOTHING};
use crate::frames::{Global, Ray};
use crate::trace::bvh::Bvh;
use crate::trace::facet::met;
use crate::trace::hit::Hit;

/// Rays of one call of the device: enough to occupy it, and not so many that a driver thinks it hangs.
pub(super) const RAYS_AT_ONCE: u64 = 1 << 20;

/// A graphics processor.
pub struct Gpu {
    pub(super) device: Device,
}

/// A mesh in the memory of a graphics processor.
pub struct GpuMesh<'a> {
    pub(super) gpu: &'a Gpu,
    pub(super) bvh: &'a Bvh<'a>,
    /// None of a mesh without area.
    pub(super) tree: Option<Tree>,
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
    pub fn hold<'a>(&'a self, bvh: &'a Bvh<'a>) -> Result<GpuMesh<'a>, GpuError> {
        let boxes = bvh.boxes();
        let hold = || self.device.hold(&packed::nodes(boxes), &packed::corners(boxes, bvh.mesh()));
        let tree = (!boxes.facets.is_empty()).then(hold).transpose()?;
        Ok(GpuMesh { gpu: self, bvh, tree })
    }
}

impl<'a> GpuMesh<'a> {
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
    pub(super) fn each<T: Send>(
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
pub(super) fn in_turns<T>(
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
