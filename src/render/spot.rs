//! Sub-rays: equation (7), the integral over the spot, by samples of its Gaussian.
//!
//! The integrand of (7) is weighted by the beam's intensity. Sampling that weight itself leaves a
//! plain mean: P = (1/N)·Σ P_j with each P_j from equation (11). Sample j of N stands at the share
//! (j + ½)/N of the beam's power from its axis, and at the golden angle from its neighbour, so that
//! radius and azimuth are both stratified.

use std::f64::consts::{LN_2, TAU};

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::edges;
use super::surface::Facing;
use crate::frames::{Direction, Global, Ray};
use crate::radar::Beam;
use crate::radar::scan::PATTERN_RANGE_M;
use crate::trace::{Hit, ScanGeometry, TraceError};

/// 1/φ: successive multiples of it are spread evenly over 0 to 1.
pub(super) const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Where a ray meets the target, and how the surface lies there if effects have moved it.
pub(super) type Intersection = (Option<Hit>, Option<Facing>);

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

/// Traces N rays for every chirp; calls `done` with the number of chirps that have been finished.
pub(super) fn trace(
    geometry: &ScanGeometry,
    rays_per_chirp: usize,
    done: &(dyn Fn(usize) + Sync),
) -> Result<Footprints, TraceError> {
    let rays = Rays { geometry: *geometry, rays_per_chirp };
    let hits = rays.intersections(done, |_, _, hit| hit, |hit| *hit)?;
    let edge_m = edge_distances_m(geometry, &hits, rays_per_chirp);
    Ok(Footprints { rays_per_chirp, hits, edge_m, facings: Vec::new() })
}

/// As [`trace`], but every hit first passes through `place(chirp, ray, hit)`, which may move or drop it.
pub(super) fn trace_moved(
    geometry: &ScanGeometry,
    rays_per_chirp: usize,
    done: &(dyn Fn(usize) + Sync),
    place: impl Fn(usize, &Ray<Global>, Option<Hit>) -> Intersection + Sync,
) -> Result<Footprints, TraceError> {
    let rays = Rays { geometry: *geometry, rays_per_chirp };
    let placed = rays.intersections(done, place, |placed| placed.0)?;
    let (hits, mut facings): (Vec<_>, Vec<_>) = placed.into_iter().unzip();
    if facings.iter().all(Option::is_none) {
        facings = Vec::new();
    }
    let edge_m = edge_distances_m(geometry, &hits, rays_per_chirp);
    Ok(Footprints { rays_per_chirp, hits, edge_m, facings })
}

/// The rays of a scan.
#[derive(Clone, Copy)]
struct Rays<'a> {
    geometry: ScanGeometry<'a>,
    rays_per_chirp: usize,
}

impl Rays<'_> {
    /// What `place(chirp, ray, hit)` gives for every ray of every chirp; `hit_of` reads its hit.
    ///
    /// The rays along the axes come first: their ranges say how wide the spots are.
    fn intersections<T: Default + Send + Sync>(
        &self,
        done: &(dyn Fn(usize) + Sync),
        place: impl Fn(usize, &Ray<Global>, Option<Hit>) -> T + Sync,
        hit_of: impl Fn(&T) -> Option<Hit> + Sync,
    ) -> Result<Vec<T>, TraceError> {
        /// Rays that are traced at once: enough to share the walk over the facets, few enough to hold.
        const RAYS_PER_TURN: usize = 1 << 18;
        let axes = &self.geometry.chirps.rays;
        let hits = self.geometry.closest(axes)?;
        let on_axis = axes.par_iter().zip(hits).enumerate();
        let on_axis: Vec<T> = on_axis.map(|(chirp, (ray, hit))| place(chirp, ray, hit)).collect();
        if self.rays_per_chirp == 1 {
            done(axes.len());
            return Ok(on_axis);
        }
        let turn = (RAYS_PER_TURN / self.rays_per_chirp).max(1);
        let mut all = Vec::with_capacity(axes.len() * self.rays_per_chirp);
        for (number, on_axis) in on_axis.chunks(turn).enumerate() {
            let ranges_m: Vec<Option<f64>> =
                on_axis.iter().map(|placed| hit_of(placed).map(|hit| hit.range_m)).collect();
            all.extend(self.spots(number * turn, &ranges_m, &place)?);
            done(on_axis.len());
        }
        Ok(all)
    }

    /// What `place` gives for all rays of the chirps from `first` on, from the ranges on their axes.
    fn spots<T: Default + Send>(
        &self,
        first: usize,
        ranges_m: &[Option<f64>],
        place: impl Fn(usize, &Ray<Global>, Option<Hit>) -> T + Sync,
    ) -> Result<Vec<T>, TraceError> {
        let beam = Beam::new(self.geometry.radar);
        let count = self.rays_per_chirp;
        let spots = ranges_m.par_iter().enumerate().flat_map_iter(|(offset, &range_m)| {
            let chirp = first + offset;
            let axis = &self.geometry.chirps.rays[chirp];
            let spot = Spot::met(&beam, axis, range_m, chirp, count);
            (0..count).map(move |sample| spot.ray(sample))
        });
        let rays: Vec<Option<Ray<Global>>> = spots.collect();
        // The tracer takes only the rays that exist.
        let given: Vec<Ray<Global>> = rays.iter().flatten().copied().collect();
        let mut hits = self.geometry.closest(&given)?.into_iter();
        let hits: Vec<Option<Hit>> =
            rays.iter().map(|ray| ray.and_then(|_| hits.next().flatten())).collect();
        let placed = rays.into_par_iter().zip(hits).enumerate().map(|(number, (ray, hit))| {
            ray.map_or(T::default(), |ray| place(first + number / count, &ray, hit))
        });
        Ok(placed.collect())
    }
}

/// Distance of every chirp to the nearest edge in depth, m, by its first ray, which is the nearest to its axis.
fn edge_distances_m(
    geometry: &ScanGeometry,
    hits: &[Option<Hit>],
    rays_per_chirp: usize,
) -> Vec<f64> {
    const SPOTS: f64 = 3.0;
    let ScanGeometry { radar, chirps, .. } = geometry;
    let ranges_m = hits.chunks(rays_per_chirp).map(|hits| hits.first()?.map(|hit| hit.range_m));
    let shots: Vec<_> = chirps.target_points_m(&radar.frames()).zip(ranges_m).collect();
    edges::distances_m(&shots, radar.spot_diameter_m, SPOTS * radar.spot_diameter_m)
}

/// The rays through the spot of one chirp.
#[derive(Clone, Copy)]
pub(super) struct Spot {
    pub axis: Ray<Global>,
    /// Unit vectors at right angles to the axis.
    right: DVec3,
    up: DVec3,
    /// Diameter over range.
    tangent: f64,
    /// Turns the pattern, so that neighbouring chirps do not repeat it.
    chirp: usize,
    count: usize,
}

impl Spot {
    /// As wide as the beam where its axis meets the target, or at 8 m; a single ray is the axis.
    pub fn met(
        beam: &Beam,
        axis: &Ray<Global>,
        range_m: Option<f64>,
        chirp: usize,
        count: usize,
    ) -> Spot {
        let range_m = range_m.unwrap_or(PATTERN_RANGE_M);
        let tangent = match count {
            1 => 0.0,
            _ => beam.diameter_along_m(axis, range_m) / range_m,
        };
        Spot::new(axis, tangent, chirp, count)
    }

    fn new(axis: &Ray<Global>, tangent: f64, chirp: usize, count: usize) -> Spot {
        let (right, up) = across(axis.direction.xyz());
        Spot { axis: *axis, right, up, tangent, chirp, count }
    }

    /// The ray of a sample.
    pub fn ray(&self, sample: usize) -> Option<Ray<Global>> {
        let Spot { axis: Ray { origin, direction }, right, up, tangent, chirp, count } = *self;
        let radius = 0.5 * tangent * radius(sample, count);
        let turn = TAU * ((chirp + sample) as f64 * GOLDEN).fract();
        let aside = radius * (turn.cos() * right + turn.sin() * up);
        Direction::new(direction.xyz() + aside).map(|direction| Ray { origin, direction })
    }

    /// What the coordinates of one of [`samples`] add to the axis's unit vector.
    pub fn across(&self) -> [DVec3; 2] {
        let Spot { right, up, tangent, chirp, .. } = *self;
        let (sin, cos) = (TAU * (chirp as f64 * GOLDEN).fract()).sin_cos();
        [cos * right + sin * up, cos * up - sin * right].map(|unit| 0.5 * tangent * unit)
    }
}

/// The samples of the first chirp's spot, in halves of its diameter.
pub(super) fn samples(count: usize) -> Vec<DVec2> {
    let place =
        |sample| radius(sample, count) * DVec2::from_angle(TAU * (sample as f64 * GOLDEN).fract());
    (0..count).map(place).collect()
}

/// Distance of a sample from the axis, in halves of the spot's diameter.
fn radius(sample: usize, count: usize) -> f64 {
    let share = (sample as f64 + 0.5) / count as f64;
    // The share of a Gaussian's power within r is 1 − 2^(−(2r/D)²).
    (-(1.0 - share).ln() / LN_2).sqrt()
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
        let spot = Spot::new(&axis(), 0.016 / 8.0, 3, count);
        (0..count)
            .map(|sample| {
                let direction = spot.ray(sample).unwrap().direction.xyz();
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
        let spot = Spot::new(&axis(), 0.002, 0, 1000);
        let rays = (0..1000).filter_map(|sample| spot.ray(sample));
        let sum = rays.fold(DVec3::ZERO, |sum, ray| sum + ray.direction.xyz());
        assert!((sum / 1000.0).truncate().length() < 0.002 / 100.0);
    }

    #[test]
    fn the_samples_are_those_of_the_rays() {
        let spot = Spot::new(&axis(), 0.002, 12_345, 100);
        let [right, up] = spot.across();
        for (number, sample) in samples(100).into_iter().enumerate() {
            let aside = sample.x * right + sample.y * up;
            let expected = Direction::<Global>::new(axis().direction.xyz() + aside).unwrap();
            let found = spot.ray(number).unwrap().direction;
            assert!(found.xyz().distance(expected.xyz()) < 1e-13);
        }
    }
}
