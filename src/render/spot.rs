//! Sub-rays: equation (7), the integral over the spot, by samples of its Gaussian.
//!
//! The integrand of (7) is weighted by the beam's intensity. Sampling that weight itself leaves a
//! plain mean: P = (1/N)·Σ P_j with each P_j from equation (11). Sample j of N stands at the share
//! (j + ½)/N of the beam's power from its axis, and at the golden angle from its neighbour, so that
//! radius and azimuth are both stratified.

use std::f64::consts::{LN_2, TAU};

use glam::DVec3;
use rayon::prelude::*;

use super::acting::{Facing, Meeting};
use super::edges;
use crate::frames::{Direction, Global, Ray};
use crate::radar::scan::PATTERN_RANGE_M;
use crate::radar::{Beam, Chirps, Radar};
use crate::trace::{Bvh, Hit};

/// 1/φ: successive multiples of it are spread evenly over 0 to 1.
pub(super) const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// What the rays of every chirp met. Kept, it can be shaded again with other materials.
#[derive(Clone, Debug, PartialEq)]
pub struct Footprints {
    /// Rays per chirp N.
    pub rays_per_chirp: usize,
    /// N entries per chirp; for N = 1 the ray along the beam's axis.
    pub hits: Vec<Option<Hit>>,
    /// For each chirp the distance in the target plane to the nearest edge in depth, m, at most
    /// three spots.
    pub edge_m: Vec<f64>,
    /// How the surface lies at each of `hits` that effects have moved; empty where none do.
    pub facings: Vec<Option<Facing>>,
}

impl Footprints {
    /// The hits of each chirp.
    pub fn chirps(&self) -> impl IndexedParallelIterator<Item = &[Option<Hit>]> {
        self.hits.par_chunks(self.rays_per_chirp.max(1))
    }
}

/// Traces N rays for every chirp; `done` is told how many chirps are finished.
pub(super) fn trace(
    radar: &Radar,
    chirps: &Chirps,
    bvh: &Bvh,
    rays_per_chirp: usize,
    done: &(dyn Fn(usize) + Sync),
) -> Footprints {
    let meet = |_, ray: &Ray<Global>| bvh.closest(ray);
    let hits = meetings(radar, chirps, rays_per_chirp, done, meet, |hit| *hit);
    let edge_m = edge_distances_m(radar, chirps, &hits, rays_per_chirp);
    Footprints { rays_per_chirp, hits, edge_m, facings: Vec::new() }
}

/// The same, had the rays of every chirp, by its number, met what `meet` says.
pub(super) fn trace_moved(
    radar: &Radar,
    chirps: &Chirps,
    rays_per_chirp: usize,
    done: &(dyn Fn(usize) + Sync),
    meet: impl Fn(usize, &Ray<Global>) -> Meeting + Sync,
) -> Footprints {
    let met = meetings(radar, chirps, rays_per_chirp, done, meet, |met| met.0);
    let (hits, mut facings): (Vec<_>, Vec<_>) = met.into_iter().unzip();
    if facings.iter().all(Option::is_none) {
        facings = Vec::new();
    }
    let edge_m = edge_distances_m(radar, chirps, &hits, rays_per_chirp);
    Footprints { rays_per_chirp, hits, edge_m, facings }
}

/// What the rays of every chirp meet, by `meet`; `hit` is where.
fn meetings<T: Default + Send>(
    radar: &Radar,
    chirps: &Chirps,
    rays_per_chirp: usize,
    done: &(dyn Fn(usize) + Sync),
    meet: impl Fn(usize, &Ray<Global>) -> T + Sync,
    hit: impl Fn(&T) -> Option<Hit> + Sync,
) -> Vec<T> {
    const CHIRPS_PER_TASK: usize = 256;
    let beam = Beam::new(radar);
    let chirp = |(number, axis): (usize, &Ray<Global>)| {
        let met = meet(number, axis);
        if rays_per_chirp == 1 {
            return vec![met];
        }
        // The spot is as wide as the beam where its axis meets the target, or at 8 m.
        let range_m = hit(&met).map_or(PATTERN_RANGE_M, |hit| hit.range_m);
        let tangent = beam.diameter_along_m(axis, range_m) / range_m;
        let sub_ray = |ray: Option<Ray<Global>>| ray.map_or(T::default(), |ray| meet(number, &ray));
        sub_rays(axis, tangent, number, rays_per_chirp).map(sub_ray).collect()
    };
    chirps
        .rays
        .par_chunks(CHIRPS_PER_TASK)
        .enumerate()
        .flat_map_iter(|(task, rays)| {
            let first = task * CHIRPS_PER_TASK;
            let met: Vec<T> =
                rays.iter().enumerate().flat_map(|(i, ray)| chirp((first + i, ray))).collect();
            done(rays.len());
            met
        })
        .collect()
}

/// By the first ray of each chirp, which is the nearest to its axis.
fn edge_distances_m(
    radar: &Radar,
    chirps: &Chirps,
    hits: &[Option<Hit>],
    rays_per_chirp: usize,
) -> Vec<f64> {
    const SPOTS: f64 = 3.0;
    let ranges_m = hits.chunks(rays_per_chirp).map(|hits| hits.first()?.map(|hit| hit.range_m));
    let looks: Vec<_> = chirps.target_points_m(&radar.frames()).zip(ranges_m).collect();
    edges::distances_m(&looks, radar.spot_diameter_m, SPOTS * radar.spot_diameter_m)
}

/// Rays through the spot; `tangent` is its diameter over the range, `chirp` turns the pattern so
/// that neighbouring chirps do not repeat it.
fn sub_rays(
    axis: &Ray<Global>,
    tangent: f64,
    chirp: usize,
    count: usize,
) -> impl Iterator<Item = Option<Ray<Global>>> {
    let forward = axis.direction.xyz();
    let (right, up) = across(forward);
    let origin = axis.origin;
    (0..count).map(move |sample| {
        let share = (sample as f64 + 0.5) / count as f64;
        // The share of a Gaussian's power within r is 1 − 2^(−(2r/D)²).
        let radius = 0.5 * tangent * (-(1.0 - share).ln() / LN_2).sqrt();
        let turn = TAU * ((chirp + sample) as f64 * GOLDEN).fract();
        let aside = radius * (turn.cos() * right + turn.sin() * up);
        Direction::new(forward + aside).map(|direction| Ray { origin, direction })
    })
}

/// Two unit vectors across a third, all at right angles.
fn across(forward: DVec3) -> (DVec3, DVec3) {
    let right = forward.any_orthonormal_vector();
    (right, forward.cross(right))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Point;

    fn axis() -> Ray<Global> {
        let origin = Point::new(0.0, 0.0, 8.0);
        Ray { origin, direction: origin.towards(Point::new(0.0, 0.0, 0.0)).unwrap() }
    }

    fn radii_m(count: usize) -> Vec<f64> {
        sub_rays(&axis(), 0.016 / 8.0, 3, count)
            .map(|ray| {
                let direction = ray.unwrap().direction.xyz();
                8.0 * direction.x.hypot(direction.y) / -direction.z
            })
            .collect()
    }

    #[test]
    fn half_the_power_lies_within_the_spot_s_diameter() {
        let within = radii_m(1000).iter().filter(|r| **r < 0.008).count();
        assert_eq!(within, 500);
    }

    #[test]
    fn the_samples_have_the_gaussian_s_second_moment() {
        // ⟨r²⟩ = D²/(4·ln 2) for an intensity that falls to half at D/2.
        let mean = radii_m(4000).iter().map(|r| r * r).sum::<f64>() / 4000.0;
        let expected = 0.016f64.powi(2) / (4.0 * LN_2);
        assert!((mean / expected - 1.0).abs() < 2e-3, "{mean} is not {expected}");
    }

    #[test]
    fn the_samples_are_centred() {
        let sum = sub_rays(&axis(), 0.002, 0, 1000)
            .flatten()
            .fold(DVec3::ZERO, |sum, ray| sum + ray.direction.xyz());
        assert!((sum / 1000.0).truncate().length() < 0.002 / 100.0);
    }
}
