//! The rays along which a cloud was measured, and the chirps that they belong to.
//!
//! A point with a chirp's number was measured along a line from where that chirp started. A point without one belongs
//! to the chirp whose ray it lies on; rays may start at different places. Where it lies on none, its line is from the
//! place at which all rays start, or from the main reflector's centre (paper, Sec. V-B).

use std::collections::{HashMap, HashSet};

use glam::DVec3;
use rayon::prelude::*;

use super::cloud::{Cloud, CloudPoint};
use super::error::RegistrationError;
use super::icp::bulk_sd_m;
use super::nearest::Nearest;
use crate::frames::{Global, Point, Ray};
use crate::radar::{Chirps, Radar};

/// A median range further off than this betrays a wrong frame, m: some noise is less, a table's
/// corner is more.
const RANGE_MISMATCH_M: f64 = 0.02;

/// The ray of each point of a cloud.
pub struct PointRays {
    /// From where its chirp started to the point.
    pub rays: Vec<Ray<Global>>,
    /// Numbers of the chirps; `None` for a point without a number that lies on no ray of the scan.
    pub chirps: Vec<Option<u32>>,
    /// Indices in the scan of the chirps without a point: of their number, or without a number and on their ray.
    pub silent: Vec<usize>,
}

impl PointRays {
    /// Finds the rays of a cloud.
    ///
    /// # Errors
    /// When ranges or chirp numbers contradict the positions: the cloud is of another frame, unit, scan
    /// or radar.
    pub fn of(
        cloud: &Cloud,
        radar: &Radar,
        chirps: &Chirps,
    ) -> Result<PointRays, RegistrationError> {
        let scan = Scan::new(radar, chirps);
        let index_of: HashMap<u32, usize> = chirps.number.iter().copied().zip(0..).collect();
        let indices: Vec<Option<usize>> = cloud
            .points()
            .par_iter()
            .map(|point| match point.chirp {
                Some(chirp) => index_of.get(&chirp).copied(),
                None => scan.chirp_through(point.point),
            })
            .collect();
        let mut rays = Vec::with_capacity(indices.len());
        for (number, (point, index)) in std::iter::zip(cloud.points(), &indices).enumerate() {
            let origin = index.map_or(scan.origin, |index| chirps.rays[index].origin);
            let direction = origin.towards(point.point);
            let direction = direction.ok_or(RegistrationError::AtTheRadar { point: number })?;
            rays.push(Ray { origin, direction });
        }
        check_ranges(cloud, &rays)?;
        check_chirps(cloud, radar, chirps, &indices)?;
        let numbers = std::iter::zip(cloud.points(), &indices)
            .map(|(point, index)| point.chirp.or(index.map(|index| chirps.number[index])));
        Ok(PointRays { chirps: numbers.collect(), silent: scan.silent(cloud), rays })
    }
}

/// The rays of a scan, by where they start.
struct Scan<'c> {
    chirps: &'c Chirps,
    bundles: Vec<Bundle>,
    /// Largest angle between a ray and a point on it, rad.
    near_rad: f64,
    /// Where the line to a point begins that lies on no ray.
    origin: Point<Global>,
}

/// Rays that start at one place.
struct Bundle {
    origin: Point<Global>,
    /// Indices of its chirps in the scan.
    chirps: Vec<usize>,
    directions: Directions,
}

impl<'c> Scan<'c> {
    fn new(radar: &Radar, chirps: &'c Chirps) -> Scan<'c> {
        let mut of_origin: HashMap<[u64; 3], usize> = HashMap::new();
        let mut bundles: Vec<(Point<Global>, Vec<usize>)> = Vec::new();
        for (index, ray) in chirps.rays.iter().enumerate() {
            let key = ray.origin.xyz.to_array().map(f64::to_bits);
            let at = *of_origin.entry(key).or_insert(bundles.len());
            if at == bundles.len() {
                bundles.push((ray.origin, Vec::new()));
            }
            bundles[at].1.push(index);
        }
        let origin = match bundles[..] {
            [(only, _)] => only,
            _ => radar.frames().origin(),
        };
        let bundles = bundles.into_iter().map(|(origin, indices)| {
            let directions = indices.iter().map(|index| chirps.rays[*index].direction.xyz());
            Bundle { origin, directions: Directions::new(directions.collect()), chirps: indices }
        });
        // An eighth of a spot: far below the distance of two chirps of a scan.
        let near_rad = radar.spot_fwhm_m() / 8.0 / radar.frames().pattern_range_m;
        Scan { chirps, bundles: bundles.collect(), near_rad, origin }
    }

    /// The chirp whose ray a point lies on, by its index.
    fn chirp_through(&self, point: Point<Global>) -> Option<usize> {
        let mut nearest = (None, f64::INFINITY);
        for Bundle { origin, chirps, directions } in &self.bundles {
            let Some(direction) = origin.towards(point) else { continue };
            let Some((at, off_rad)) = directions.nearest(direction.xyz()) else { continue };
            let off_m = off_rad * origin.distance_m(point);
            if off_rad <= self.near_rad && off_m < nearest.1 {
                nearest = (Some(chirps[at]), off_m);
            }
        }
        nearest.0
    }

    /// Indices of the chirps of which no point has the number and no point without one lies on the ray.
    fn silent(&self, cloud: &Cloud) -> Vec<usize> {
        let numbers: HashSet<u32> = cloud.points().iter().filter_map(|point| point.chirp).collect();
        let unnumbered: Vec<Point<Global>> =
            cloud.points().iter().filter(|p| p.chirp.is_none()).map(|p| p.point).collect();
        let mut silent: Vec<usize> = self
            .bundles
            .par_iter()
            .flat_map_iter(|bundle| {
                let towards = unnumbered.iter().filter_map(|point| bundle.origin.towards(*point));
                let points = Directions::new(towards.map(|direction| direction.xyz()).collect());
                let is_silent = |index: &usize| {
                    let along = self.chirps.rays[*index].direction.xyz();
                    let on_ray = points.nearest(along).is_some_and(|(_, off)| off <= self.near_rad);
                    !on_ray && !numbers.contains(&self.chirps.number[*index])
                };
                bundle.chirps.iter().copied().filter(is_silent).collect::<Vec<usize>>()
            })
            .collect();
        silent.sort_unstable();
        silent
    }
}

/// Directions among which the nearest is asked for.
struct Directions {
    directions: Vec<DVec3>,
    /// Where they are many.
    tree: Option<Nearest>,
}

impl Directions {
    fn new(directions: Vec<DVec3>) -> Directions {
        /// Below, a loop is faster than to plant a tree and to climb it.
        const MANY: usize = 16;
        let tree = if directions.len() < MANY { None } else { Nearest::new(&directions) };
        Directions { directions, tree }
    }

    /// Number of the nearest, and the angle to it, rad, where that is small.
    fn nearest(&self, direction: DVec3) -> Option<(usize, f64)> {
        if let Some(tree) = &self.tree {
            return Some(tree.find(direction));
        }
        let off = self.directions.iter().map(|other| other.distance(direction)).enumerate();
        off.min_by(|a, b| a.1.total_cmp(&b.1))
    }
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

/// Most points with a number must lie within half a spot of their chirps' rays.
fn check_chirps(
    cloud: &Cloud,
    radar: &Radar,
    chirps: &Chirps,
    indices: &[Option<usize>],
) -> Result<(), RegistrationError> {
    let near_m = 0.5 * radar.spot_fwhm_m();
    let (mut numbered, mut near) = (0, 0);
    for (number, (CloudPoint { chirp, point, .. }, index)) in
        std::iter::zip(cloud.points(), indices).enumerate()
    {
        if let (Some(chirp), None) = (*chirp, *index) {
            return Err(RegistrationError::NoSuchChirp { point: number, chirp });
        }
        numbered += usize::from(chirp.is_some());
        let ray = index.filter(|_| chirp.is_some()).map(|index| &chirps.rays[index]);
        near += usize::from(ray.is_some_and(|ray| distance_m(ray, *point) <= near_m));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Direction;

    /// `lines` rays side by side along −z, 2 cm apart, that start at as many places, or all at one.
    fn scan(lines: u32, apart: bool) -> Chirps {
        let at = |number: u32| DVec3::new(0.02 * f64::from(number), 1.0, 0.0);
        let ray = |number: u32| {
            let origin =
                if apart { at(number) + 2.0 * DVec3::Z } else { DVec3::new(0.0, 1.0, 2.0) };
            let direction = Direction::new(at(number) - origin).unwrap();
            Ray { origin: origin.into(), direction }
        };
        Chirps {
            number: (0..lines).collect(),
            time_s: vec![0.0; lines as usize],
            rays: (0..lines).map(ray).collect(),
            ..Chirps::default()
        }
    }

    /// One point on each second ray, without its number.
    fn cloud(chirps: &Chirps) -> Cloud {
        let points = chirps.rays.iter().step_by(2).map(|ray| CloudPoint {
            chirp: None,
            point: (ray.origin.xyz + 1.9 * ray.direction.xyz()).into(),
            range_m: Some(1.9),
            power_w: 1e-9,
        });
        Cloud::new(points.collect()).unwrap()
    }

    #[test]
    fn a_point_belongs_to_the_ray_that_it_lies_on() {
        for lines in [5, 60] {
            for apart in [false, true] {
                let chirps = scan(lines, apart);
                let found = PointRays::of(&cloud(&chirps), &Radar::default(), &chirps).unwrap();
                let expected: Vec<Option<u32>> = (0..lines).step_by(2).map(Some).collect();
                assert_eq!(found.chirps, expected);
                assert_eq!(found.silent, (1..lines as usize).step_by(2).collect::<Vec<_>>());
                for (ray, number) in std::iter::zip(&found.rays, (0..lines as usize).step_by(2)) {
                    assert_eq!(ray.origin, chirps.rays[number].origin);
                }
            }
        }
    }

    #[test]
    fn a_point_beside_all_rays_has_no_chirp() {
        let chirps = scan(5, true);
        let mut points = cloud(&chirps).points().to_vec();
        points[1].point = Point::new(0.05, 1.5, 0.1);
        points[1].range_m = None;
        let found =
            PointRays::of(&Cloud::new(points).unwrap(), &Radar::default(), &chirps).unwrap();
        assert_eq!(found.chirps, [Some(0), None, Some(4)]);
        assert_eq!(found.silent, [1, 2, 3]);
        assert_eq!(found.rays[1].origin, Radar::default().frames().origin());
    }
}
