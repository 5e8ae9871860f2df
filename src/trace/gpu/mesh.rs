//! A mesh in the memory of a graphics processor, and the closest hits of rays on it.

use rayon::prelude::*;

use super::device::{Device, Flight, Tree};
use super::error::GpuError;
use super::packed::{self, NOTHING};
use crate::frames::{Global, Ray};
use crate::trace::bvh::Bvh;
use crate::trace::facet::plane_hit;
use crate::trace::hit::Hit;

/// Most rays per call of the device: enough to occupy it, and few enough that no driver takes it for hung.
pub(super) const RAYS_AT_ONCE: u64 = 1 << 20;

/// A graphics processor.
pub struct Gpu {
    pub(super) device: Device,
}

/// A mesh in the memory of a graphics processor.
pub struct GpuMesh<'a> {
    pub(super) gpu: &'a Gpu,
    pub(super) bvh: &'a Bvh<'a>,
    /// `None` for a mesh without area.
    pub(super) tree: Option<Tree>,
}

/// The answer of the device for one ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// The ray hits no facet.
    Nothing,
    /// The ray hits this facet first.
    Facet(u32),
    /// f32 cannot decide.
    Unsure,
}

impl Gpu {
    /// Opens the fastest kind of adapter: discrete before integrated before virtual before software.
    ///
    /// # Errors
    /// When there is no adapter, or the program was built without the feature `gpu`.
    pub fn new() -> Result<Gpu, GpuError> {
        Gpu::limited(u64::MAX)
    }

    /// As [`new`](Self::new), with buffers of at most `buffer_bytes`: for smaller meshes and fewer rays per call.
    ///
    /// # Errors
    /// When there is no adapter, or the program was built without the feature `gpu`.
    pub fn limited(buffer_bytes: u64) -> Result<Gpu, GpuError> {
        Device::open(buffer_bytes).map(|device| Gpu { device })
    }

    /// The adapter's name.
    pub fn adapter(&self) -> &str {
        self.device.adapter()
    }

    /// Copies a mesh and its hierarchy to the device. The hierarchy is built if necessary.
    ///
    /// # Errors
    /// When they exceed the device's memory.
    pub fn hold<'a>(&'a self, bvh: &'a Bvh<'a>) -> Result<GpuMesh<'a>, GpuError> {
        let boxes = bvh.boxes();
        let hold = || self.device.hold(&packed::nodes(boxes), &packed::corners(boxes, bvh.mesh()));
        let tree = (!boxes.facets.is_empty()).then(hold).transpose()?;
        Ok(GpuMesh { gpu: self, bvh, tree })
    }
}

impl<'a> GpuMesh<'a> {
    /// The hierarchy in the device's memory.
    pub fn bvh(&self) -> &'a Bvh<'a> {
        self.bvh
    }

    /// Finds the closest hit of every ray, in the order of the rays; among equally near facets, the one with the
    /// smallest number.
    ///
    /// # Errors
    /// When the device stops working or has no memory for the rays.
    pub fn closest(&self, rays: &[Ray<Global>]) -> Result<Vec<Option<Hit>>, GpuError> {
        self.map_answers(rays, |ray, answer| match answer {
            Answer::Nothing => None,
            Answer::Unsure => self.bvh.closest(ray),
            Answer::Facet(facet) => {
                let hit = plane_hit(self.bvh.mesh(), facet, ray);
                hit.or_else(|| self.bvh.closest(ray))
            }
        })
    }

    /// The answers of the device alone, without a decision in f64.
    ///
    /// # Errors
    /// When the device stops working or has no memory for the rays.
    pub fn answers(&self, rays: &[Ray<Global>]) -> Result<Vec<Answer>, GpuError> {
        self.map_answers(rays, |_, answer| answer)
    }

    /// Traces rays on the device and maps every ray and its answer by `then`.
    pub(super) fn map_answers<T: Send>(
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
        pipeline(rays, at_once, launch, |rays, flight| {
            let answers = self.gpu.device.land(flight)?;
            let each = rays.par_iter().zip(answers).with_min_len(1024);
            all.par_extend(each.map(|(ray, code)| then(ray, answer(code))));
            Ok(())
        })?;
        Ok(all)
    }
}

/// Launches items on the device in batches of `at_once`, and lands each batch while the device works on the next.
pub(super) fn pipeline<T>(
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
