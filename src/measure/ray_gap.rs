//! How far a measured point lies from the surface along its ray, and how the range moves with the surface.

use glam::DVec3;

use super::icp::Gap;
use super::tracer::Intersection;
use crate::frames::{Global, Ray};

/// Surfaces at a flatter angle give no useful range: cosine of 80°.
const FLATTEST_COS: f64 = 0.173_648;
/// A beam is taken to be off sideways by this share of its error in range, so that a steep surface
/// does not outweigh all others.
const SIDEWAYS_SHARE: f64 = 0.5;

/// A gap along a measured ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RayGap {
    pub gap: Gap,
    /// Measured minus modelled range, m.
    pub range_error_m: f64,
}

impl RayGap {
    /// The gap of a measured point on its ray.
    pub fn on_axis(
        seen: Intersection,
        ray: &Ray<Global>,
        point: DVec3,
        reach_m: f64,
    ) -> Option<RayGap> {
        let Intersection { hit, normal } = seen;
        let range_error_m = (point - ray.origin.xyz).dot(ray.direction.xyz()) - hit.range_m;
        let gradient = normal / normal.dot(ray.direction.xyz());
        RayGap::new(hit.point.xyz, gradient, hit.cos_theta, range_error_m, reach_m)
    }

    /// A gap at a place of the surface, of which the range shrinks by `gradient` per metre of motion; `None` where the
    /// surface is too flat or the gap wider than `reach_m`.
    pub fn new(
        at: DVec3,
        gradient: DVec3,
        cos_theta: f64,
        range_error_m: f64,
        reach_m: f64,
    ) -> Option<RayGap> {
        if cos_theta < FLATTEST_COS || range_error_m.abs() > reach_m {
            return None;
        }
        let tan2 = 1.0 / (cos_theta * cos_theta) - 1.0;
        let steep = (1.0 + SIDEWAYS_SHARE * SIDEWAYS_SHARE * tan2).sqrt();
        let gap = Gap { at, gradient: gradient / steep, size_m: range_error_m / steep };
        Some(RayGap { gap, range_error_m })
    }
}
