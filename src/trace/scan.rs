//! The geometry of a scan: instrument, chirps and target.

use super::bvh::Bvh;
use super::hit::Hit;
use super::tracer::{TraceError, Tracer};
use crate::frames::{Global, Ray};
use crate::radar::{Chirps, Radar};

/// The geometry of a scan: the instrument, its chirps, the target and the tracer.
#[derive(Clone, Copy)]
pub struct ScanGeometry<'a> {
    /// The instrument.
    pub radar: &'a Radar,
    /// One ray per chirp.
    pub chirps: &'a Chirps,
    /// The target as the scene places it.
    pub bvh: &'a Bvh<'a>,
    /// Traces the rays of the scan. All other rays, such as those of second-order paths, use `bvh`.
    pub tracer: Tracer<'a>,
    /// Region of every facet: an index into the surfaces of the scan.
    pub region_of_facet: &'a [u16],
}

impl<'a> ScanGeometry<'a> {
    /// A scan with the tracer [`Tracer::Automatic`].
    pub fn new(
        radar: &'a Radar,
        chirps: &'a Chirps,
        bvh: &'a Bvh<'a>,
        region_of_facet: &'a [u16],
    ) -> ScanGeometry<'a> {
        ScanGeometry { radar, chirps, bvh, tracer: Tracer::Automatic, region_of_facet }
    }

    /// Traces rays with the tracer of the scan: the closest hit of each, in their order.
    ///
    /// # Errors
    /// When the rays do not suit the tracer, or when the graphics processor fails or holds another hierarchy.
    pub fn closest(&self, rays: &[Ray<Global>]) -> Result<Vec<Option<Hit>>, TraceError> {
        self.tracer.closest(self.bvh, rays)
    }

    /// As [`closest`](Self::closest), for the rays of spots, one spot after the other.
    ///
    /// # Errors
    /// Those of [`closest`](Self::closest).
    pub fn closest_of_spots(
        &self,
        rays: &[Ray<Global>],
        rays_per_spot: usize,
    ) -> Result<Vec<Option<Hit>>, TraceError> {
        self.tracer.closest_of_spots(self.bvh, rays, rays_per_spot)
    }
}
