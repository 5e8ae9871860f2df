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

/// One ray per point, from where its chirp started; from the main reflector's centre where the chirp
/// is not known.
///
/// # Errors
/// When ranges or chirp numbers contradict the positions: the cloud is of another frame, unit, scan
/// or radar.
pub fn sights(
    cloud: &Cloud,
    radar: &Radar,
    chirps: &Chirps,
) -> Result<Vec<Ray<Global>>, RegistrationError> {
    let ray_of_chirp: HashMap<u32, &Ray<Global>> =
        std::iter::zip(chirps.number.iter().copied(), &chirps.rays).collect();
    let chirp_ray = |point: &CloudPoint| ray_of_chirp.get(&point.chirp?).copied();
    let centre = radar.frames().origin();
    let sight = |(number, point): (usize, &CloudPoint)| {
        let origin = chirp_ray(point).map_or(centre, |ray| ray.origin);
        let direction = origin.towards(point.point);
        let direction = direction.ok_or(RegistrationError::AtTheRadar { point: number })?;
        Ok(Ray { origin, direction })
    };
    let sights: Vec<Ray<Global>> =
        cloud.points().iter().enumerate().map(sight).collect::<Result<_, _>>()?;
    check_ranges(cloud, &sights)?;
    check_chirps(cloud, radar, chirp_ray)?;
    Ok(sights)
}

fn check_ranges(cloud: &Cloud, sights: &[Ray<Global>]) -> Result<(), RegistrationError> {
    let off_m = std::iter::zip(cloud.points(), sights)
        .filter_map(|(point, ray)| Some(ray.origin.distance_m(point.point) - point.range_m?));
    let typical_m = bulk_sd_m(off_m);
    match typical_m > RANGE_MISMATCH_M {
        true => Err(RegistrationError::RangesDisagree { typical_m }),
        false => Ok(()),
    }
}

/// Each point must lie within half a spot of its chirp's ray.
fn check_chirps<'c>(
    cloud: &Cloud,
    radar: &Radar,
    chirp_ray: impl Fn(&CloudPoint) -> Option<&'c Ray<Global>>,
) -> Result<(), RegistrationError> {
    let numbered = cloud.points().iter().filter(|point| point.chirp.is_some()).count();
    let beside_m = |point: &CloudPoint| Some(distance_m(chirp_ray(point)?, point.point));
    let near_m = 0.5 * radar.spot_diameter_m;
    let near = cloud.points().iter().filter_map(beside_m).filter(|m| *m <= near_m).count();
    match 2 * near < numbered {
        true => Err(RegistrationError::ChirpsDisagree { off: numbered - near, numbered }),
        false => Ok(()),
    }
}

/// Distance of a point from a ray's line, m.
fn distance_m(ray: &Ray<Global>, point: Point<Global>) -> f64 {
    let from_origin: DVec3 = point.xyz - ray.origin.xyz;
    from_origin.cross(ray.direction.xyz()).length()
}
