//! The input of an alignment: the mesh, the rays of the scan, and the measured points with their rays.

use glam::DVec3;

use super::cloud::Cloud;
use super::icp::{Gap, median};
use super::tracer::{Intersection, RaySet, Tracer};
use crate::frames::{Global, Pose, Ray};
use crate::geometry::Mesh;

/// Surfaces at a flatter angle give no useful range: cosine of 80°.
const FLATTEST_COS: f64 = 0.173_648;
/// A beam is taken to be off sideways by this share of its error in range, so that a steep surface
/// does not outweigh all others.
const SIDEWAYS_SHARE: f64 = 0.5;

/// Mesh, scan and measurement.
pub(super) struct View<'a> {
    pub tracer: Tracer<'a>,
    pub chirps: RaySet<'a>,
    pub point_rays: RaySet<'a>,
    pub points: Vec<DVec3>,
    /// Median of the measured points by axis: turns are about it.
    pub pivot: DVec3,
    /// Median distance of the points from the pivot, m.
    pub length_m: f64,
}

impl<'a> View<'a> {
    /// `point_rays` are the rays of the cloud's points.
    pub fn new(
        mesh: &'a Mesh,
        chirps: &'a [Ray<Global>],
        cloud: &Cloud,
        point_rays: &'a [Ray<Global>],
    ) -> View<'a> {
        let points: Vec<DVec3> = cloud.points().iter().map(|point| point.point.xyz).collect();
        let pivot = median_point(&points);
        // A thousandth of a spot: only coinciding points are nearer, and a length divides.
        const LEAST_M: f64 = 1e-5;
        let length_m = median(points.iter().map(|p| p.distance(pivot))).max(LEAST_M);
        let tracer = Tracer::new(mesh);
        let (chirps, point_rays) = (RaySet::new(mesh, chirps), RaySet::new(mesh, point_rays));
        View { tracer, chirps, point_rays, points, pivot, length_m }
    }

    /// Gaps along the measured rays, one per point; `None` where the ray misses, is too flat, or
    /// the gap is wider than `reach_m`. Sizes and gradients are divided by how steep the surface is.
    pub fn ray_gaps(&self, pose: &Pose<Global, Global>, reach_m: f64) -> Vec<Option<RayGap>> {
        let seen = self.tracer.scan(pose, &self.point_rays);
        seen.iter()
            .zip(self.point_rays.rays())
            .zip(&self.points)
            .map(|((seen, ray), point)| RayGap::new((*seen)?, ray, *point, reach_m))
            .collect()
    }
}

/// A gap along a measured ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RayGap {
    pub gap: Gap,
    /// Measured minus modelled range, m.
    pub range_error_m: f64,
}

impl RayGap {
    /// The gap of a measured point on its ray; `None` where the surface is too flat or the gap wider than `reach_m`.
    fn new(seen: Intersection, ray: &Ray<Global>, point: DVec3, reach_m: f64) -> Option<RayGap> {
        let Intersection { hit, normal } = seen;
        let range_error_m = (point - ray.origin.xyz).dot(ray.direction.xyz()) - hit.range_m;
        if hit.cos_theta < FLATTEST_COS || range_error_m.abs() > reach_m {
            return None;
        }
        let tan2 = 1.0 / (hit.cos_theta * hit.cos_theta) - 1.0;
        let steep = (1.0 + SIDEWAYS_SHARE * SIDEWAYS_SHARE * tan2).sqrt();
        let gradient = normal / normal.dot(ray.direction.xyz()) / steep;
        let gap = Gap { at: hit.point.xyz, gradient, size_m: range_error_m / steep };
        Some(RayGap { gap, range_error_m })
    }
}

/// Median of each coordinate: a few points far off do not move it.
pub(crate) fn median_point(points: &[DVec3]) -> DVec3 {
    let medians = std::array::from_fn(|axis| median(points.iter().map(|point| point[axis])));
    DVec3::from_array(medians)
}
