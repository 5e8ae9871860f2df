//! The input of an alignment: the mesh, the rays of the scan, and the measured points with their rays.

use glam::DVec3;

use super::cloud::Cloud;
use super::icp::median;
use super::ray_gap::RayGap;
use super::spots::{SpotRays, Spots};
use super::tracer::{RaySet, Tracer};
use crate::frames::{Global, Pose, Ray};
use crate::geometry::Mesh;

/// Mesh, scan and measurement.
pub(super) struct View<'a> {
    pub tracer: Tracer<'a>,
    pub chirps: RaySet<'a>,
    pub point_rays: RaySet<'a>,
    /// The rays over the beams, where echoes are of whole spots.
    spots: Option<Spots<'a>>,
    pub points: Vec<DVec3>,
    /// Median of the measured points by axis: turns are about it.
    pub pivot: DVec3,
    /// Median distance of the points from the pivot, m.
    pub length_m: f64,
}

impl<'a> View<'a> {
    /// `point_rays` are the rays of the cloud's points, and `spot_rays` those over their beams.
    pub fn new(
        mesh: &'a Mesh,
        chirps: &'a [Ray<Global>],
        cloud: &Cloud,
        point_rays: &'a [Ray<Global>],
        spot_rays: Option<&'a SpotRays>,
    ) -> View<'a> {
        let points: Vec<DVec3> = cloud.points().iter().map(|point| point.point.xyz).collect();
        let pivot = median_point(&points);
        // A thousandth of a spot: only coinciding points are nearer, and a length divides.
        const LEAST_M: f64 = 1e-5;
        let length_m = median(points.iter().map(|p| p.distance(pivot))).max(LEAST_M);
        let tracer = Tracer::new(mesh);
        let (chirps, point_rays) = (RaySet::new(mesh, chirps), RaySet::new(mesh, point_rays));
        let spots = spot_rays.map(|rays| Spots::new(mesh, rays));
        View { tracer, chirps, point_rays, spots, points, pivot, length_m }
    }

    /// Gaps along the measured rays, one per point; `None` where the ray misses, is too flat, or
    /// the gap is wider than `reach_m`. Sizes and gradients are divided by how steep the surface is.
    pub fn ray_gaps(&self, pose: &Pose<Global, Global>, reach_m: f64) -> Vec<Option<RayGap>> {
        if let Some(spots) = &self.spots {
            let axes = self.point_rays.rays();
            return spots.gaps(&self.tracer, pose, axes, &self.points, reach_m);
        }
        let seen = self.tracer.scan(pose, &self.point_rays);
        seen.iter()
            .zip(self.point_rays.rays())
            .zip(&self.points)
            .map(|((seen, ray), point)| RayGap::on_axis((*seen)?, ray, *point, reach_m))
            .collect()
    }
}

/// Median of each coordinate: a few points far off do not move it.
pub(crate) fn median_point(points: &[DVec3]) -> DVec3 {
    let medians = std::array::from_fn(|axis| median(points.iter().map(|point| point[axis])));
    DVec3::from_array(medians)
}
