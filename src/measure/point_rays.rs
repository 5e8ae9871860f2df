//! The lines along which a cloud was measured: from the main reflector's centre through each point
//! (paper, Sec. V-B).

use std::collections::HashMap;

use glam::DVec3;

use super::cloud::{Cloud, CloudPoint};
use super::error::RegistrationError;
use super::icp::bulk_sd_m;
use crate::frames::{Global, Point, Ray};
use crate::radar::{Chirps, Radar};

/// A median range further off than this betrays a wrong frame, m: some noise is less, a table's
/// corner is more.
const RANGE_MISMATCH_M: f64 = 0.02;

/// The rays of a scan by the numbers of their chirps.
struct ScanRays<'c> {
    of_chirp: HashMap<u32, &'c Ray<Global>>,
}

impl<'c> ScanRays<'c> {
    fn new(chirps: &'c Chirps) -> ScanRays<'c> {
        ScanRays { of_chirp: std::iter::zip(chirps.number.iter().copied(), &chirps.rays).collect() }
    }

    /// The ray of a point's chirp; none for a point without a number and for a chirp that was not sent.
    fn of(&self, point: &CloudPoint) -> Option<&'c Ray<Global>> {
        self.of_chirp.get(&point.chirp?).copied()
    }
}

/// One ray per point, from where its chirp started; from the main reflector's centre where the chirp
/// is not known.
///
/// # Errors
/// When ranges or chirp numbers contradict the positions: the cloud is of another frame, unit, scan
/// or radar.
pub fn rays_to_points(
    cloud: &Cloud,
    radar: &Radar,
    chirps: &Chirps,
) -> Result<Vec<Ray<Global>>, RegistrationError> {
    let rays = ScanRays::new(chirps);
    let centre = radar.frames().origin();
    let mut point_rays = Vec::with_capacity(cloud.points().len());
    for (number, point) in cloud.points().iter().enumerate() {
        let origin = rays.of(point).map_or(centre, |ray| ray.origin);
        let direction = origin.towards(point.point);
        let direction = direction.ok_or(RegistrationError::AtTheRadar { point: number })?;
        point_rays.push(Ray { origin, direction });
    }
    check_ranges(cloud, &point_rays)?;
    check_chirps(cloud, radar, &rays)?;
    Ok(point_rays)
}

fn check_ranges(cloud: &Cloud, point_rays: &[Ray<Global>]) -> Result<(), RegistrationError> {
    let off_m = std::iter::zip(cloud.points(), point_rays)
        .filter_map(|(point, ray)| Some(ray.origin.distance_m(point.point) - point.range_m?));
    let typical_m = bulk_sd_m(off_m);
    if typical_m > RANGE_MISMATCH_M {
        return Err(RegistrationError::RangesDisagree { typical_m });
    }
    Ok(())
}

/// Most points must lie within half a spot of their chirps' rays.
fn check_chirps(cloud: &Cloud, radar: &Radar, rays: &ScanRays) -> Result<(), RegistrationError> {
    let near_m = 0.5 * radar.spot_fwhm_m();
    let (mut numbered, mut near) = (0, 0);
    for point in cloud.points().iter().filter(|point| point.chirp.is_some()) {
        numbered += 1;
        near +=
            usize::from(rays.of(point).is_some_and(|ray| distance_m(ray, point.point) <= near_m));
    }
    if 2 * near < numbered {
        return Err(RegistrationError::ChirpsDisagree { off: numbered - near, numbered });
    }
    Ok(())
}

/// Distance of a point from a ray's line, m.
fn distance_m(ray: &Ray<Global>, point: Point<Global>) -> f64 {
    let from_origin: DVec3 = point.xyz - ray.origin.xyz;
    from_origin.cross(ray.direction.xyz()).length()
}
