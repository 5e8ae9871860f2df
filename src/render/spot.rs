//! Sub-rays: equation (7), the integral over the spot, by samples of its Gaussian.
//!
//! The antenna receives as it sends, so that the integrand of (7) is weighted by the square of the
//! beam's irradiance u, exp(−4r²/w²). Sampling that weight itself leaves a plain mean:
//! P = (1/N)·Σ P_j with each P_j from equation (11). Sample j of N stands at the share (j + ½)/N of the
//! weight from the axis, and at the golden angle from its neighbour, so that radius and azimuth are
//! both stratified. Each ray stands at right angles on the beam's curved wavefront.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::edges;
use super::surface::Orientation;
use crate::frames::{Global, Ray};
use crate::radar::scan::PATTERN_RANGE_M;
use crate::radar::{Beam, GaussianBeam, Radar, Section};
use crate::trace::{Hit, ScanGeometry, TraceError, Tracer};

/// 1/φ: successive multiples of it are spread evenly over 0 to 1.
pub(super) const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Where a ray meets the target, and how the surface lies there if effects have moved it.
pub(super) type Intersection = (Option<Hit>, Option<Orientation>);

/// What the rays of every chirp met. Kept, it can be shaded again with other materials.
#[derive(Clone, Debug, PartialEq)]
pub struct Footprints {
    /// Rays per chirp N.
    pub rays_per_chirp: usize,
    /// N entries per chirp; for N = 1 the ray along the beam's axis.
    pub hits: Vec<Option<Hit>>,
    /// Range, m, at which the axis of each chirp's beam meets the target, and its spot is laid out.
    pub axis_range_m: Vec<Option<f64>>,
    /// For each chirp the distance in the target plane to the nearest edge in depth, m, at most
    /// three spots.
    pub edge_m: Vec<f64>,
    /// How the surface lies at each of `hits` that effects have moved; empty where none do.
    pub orientations: Vec<Option<Orientation>>,
    /// What the rays meet behind one sheet, behind two, and so on; empty where nothing lets them through.
    pub behind: Vec<Behind>,
    /// Number of rays that end at a sheet, because they have passed as many as they may.
    pub ended: usize,
}

/// What the rays of every chirp meet behind a number of sheets.
#[derive(Clone, Debug, PartialEq)]
pub struct Behind {
    /// N entries per chirp, as those in front.
    pub hits: Vec<Option<Hit>>,
    /// For each chirp the distance in the target plane to the nearest edge in depth of what lies here, m.
    pub edge_m: Vec<f64>,
}

impl Footprints {
    /// Distance of every chirp from an edge in depth of what lies behind so many sheets, m.
    pub(super) fn edge_m_behind(&self, sheets: u8) -> &[f64] {
        let behind = usize::from(sheets).checked_sub(1).and_then(|layer| self.behind.get(layer));
        behind.map_or(&self.edge_m, |behind| &behind.edge_m)
    }

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
    let rays = Rays { geometry: *geometry, samples: samples(rays_per_chirp) };
    let (hits, axis_range_m) = rays.intersections(done, |_, _, hit| hit, |hit| *hit)?;
    let edge_m = edge_distances_m(geometry, &hits, rays_per_chirp);
    let (orientations, behind) = (Vec::new(), Vec::new());
    Ok(Footprints { rays_per_chirp, hits, axis_range_m, edge_m, orientations, behind, ended: 0 })
}

/// As [`trace`], but every hit first passes through `place(chirp, ray, hit)`, which may move or drop it.
pub(super) fn trace_moved(
    geometry: &ScanGeometry,
    rays_per_chirp: usize,
    done: &(dyn Fn(usize) + Sync),
    place: impl Fn(usize, &Ray<Global>, Option<Hit>) -> Intersection + Sync,
) -> Result<Footprints, TraceError> {
    let rays = Rays { geometry: *geometry, samples: samples(rays_per_chirp) };
    let (placed, axis_range_m) = rays.intersections(done, place, |placed| placed.0)?;
    let (hits, mut orientations): (Vec<_>, Vec<_>) = placed.into_iter().unzip();
    if orientations.iter().all(Option::is_none) {
        orientations = Vec::new();
    }
    let edge_m = edge_distances_m(geometry, &hits, rays_per_chirp);
    let behind = Vec::new();
    Ok(Footprints { rays_per_chirp, hits, axis_range_m, edge_m, orientations, behind, ended: 0 })
}

/// Chirps whose spots are laid out together.
const CHIRPS_PER_TASK: usize = 64;

/// The rays of a scan.
struct Rays<'a> {
    geometry: ScanGeometry<'a>,
    samples: Vec<DVec2>,
}

impl Rays<'_> {
    /// What `place(chirp, ray, hit)` gives for every ray of every chirp, and the range on each axis, m;
    /// `hit_of` reads the hit of a place.
    ///
    /// The rays along the axes come first: their ranges say how wide the spots are.
    fn intersections<T: Default + Send + Sync>(
        &self,
        done: &(dyn Fn(usize) + Sync),
        place: impl Fn(usize, &Ray<Global>, Option<Hit>) -> T + Sync,
        hit_of: impl Fn(&T) -> Option<Hit> + Sync,
    ) -> Result<(Vec<T>, Vec<Option<f64>>), TraceError> {
        let axes = &self.geometry.chirps.rays;
        let hits = self.geometry.closest(axes)?;
        let on_axis = axes.par_iter().zip(hits).enumerate();
        let on_axis: Vec<T> = on_axis.map(|(chirp, (ray, hit))| place(chirp, ray, hit)).collect();
        let ranges_m: Vec<Option<f64>> =
            on_axis.iter().map(|placed| hit_of(placed).map(|hit| hit.range_m)).collect();
        if self.samples.len() == 1 {
            done(axes.len());
            return Ok((on_axis, ranges_m));
        }
        let count = self.samples.len();
        let chirps = (self.geometry.tracer.rays_at_once() / count).max(1);
        let mut all: Vec<T> =
            (0..axes.len() * count).into_par_iter().map(|_| T::default()).collect();
        let tasks = all.chunks_mut(chirps * count).zip(ranges_m.chunks(chirps)).enumerate();
        let tasks: Vec<_> = tasks.collect();
        // A graphics processor takes one list after the other.
        let in_turn = matches!(self.geometry.tracer, Tracer::Gpu(_));
        let tasks_together = if in_turn { tasks.len() } else { 1 };
        let tasks = tasks.into_par_iter().with_min_len(tasks_together);
        tasks.try_for_each(|(task, (all, ranges_m))| {
            // Whoever hears of it may stop here: the other tasks begin all the same.
            done(0);
            self.spots(task * chirps, ranges_m, all, &place)?;
            done(ranges_m.len());
            Ok::<(), TraceError>(())
        })?;
        Ok((all, ranges_m))
    }

    /// Puts in `all` what `place` gives for all rays of the chirps from `first` on, from the ranges on their axes, m.
    fn spots<T: Send>(
        &self,
        first: usize,
        ranges_m: &[Option<f64>],
        all: &mut [T],
        place: &(impl Fn(usize, &Ray<Global>, Option<Hit>) -> T + Sync),
    ) -> Result<(), TraceError> {
        let (beam, count) = (Beam::new(self.geometry.radar), self.samples.len());
        let chirps = (first..first + ranges_m.len()).into_par_iter().zip(ranges_m);
        let spots = chirps.with_min_len(CHIRPS_PER_TASK).map(|(chirp, &range_m)| {
            Spot::met(&beam, &self.geometry.chirps.rays[chirp], range_m, chirp)
        });
        let spots: Vec<Spot> = spots.collect();
        let mut rays = vec![None; all.len()];
        let of_spots = rays.par_chunks_mut(count).with_min_len(CHIRPS_PER_TASK).zip(&spots);
        of_spots.for_each(|(rays, spot)| {
            rays.iter_mut().zip(&self.samples).for_each(|(ray, &at)| *ray = spot.ray(at));
        });
        // The tracer takes only the rays that exist.
        let given: Vec<Ray<Global>> = rays.iter().flatten().copied().collect();
        let mut hits = self.geometry.closest_of_spots(&given, count)?.into_iter();
        let hits: Vec<Option<Hit>> =
            rays.iter().map(|ray| ray.and_then(|_| hits.next().flatten())).collect();
        let placed =
            all.par_chunks_mut(count).zip(rays.par_chunks(count).zip(hits.par_chunks(count)));
        placed.enumerate().with_min_len(CHIRPS_PER_TASK).for_each(
            |(chirp, (all, (rays, hits)))| {
                for (placed, (ray, &hit)) in all.iter_mut().zip(rays.iter().zip(hits)) {
                    if let Some(ray) = ray {
                        *placed = place(first + chirp, ray, hit);
                    }
                }
            },
        );
        Ok(())
    }
}

/// Distance of every chirp to the nearest edge in depth, m, by its first ray, which is the nearest to its axis.
pub(super) fn edge_distances_m(
    geometry: &ScanGeometry,
    hits: &[Option<Hit>],
    rays_per_chirp: usize,
) -> Vec<f64> {
    const SPOTS: f64 = 3.0;
    let ScanGeometry { radar, chirps, .. } = geometry;
    let ranges_m = hits.chunks(rays_per_chirp).map(|hits| hits.first()?.map(|hit| hit.range_m));
    let shots: Vec<_> = chirps.target_points_m(&radar.frames()).zip(ranges_m).collect();
    edges::distances_m(&shots, radar.spot_fwhm_m(), SPOTS * radar.spot_fwhm_m())
}

/// So many rays for each of some axes, through the spot that its beam has at a range, m. A ray that cannot be laid out is the
/// axis again.
pub(crate) fn spot_rays(
    radar: &Radar,
    axes: impl Iterator<Item = (Ray<Global>, f64)>,
    rays_per_spot: usize,
) -> Vec<Ray<Global>> {
    let (beam, samples) = (Beam::new(radar), samples(rays_per_spot));
    let mut rays = Vec::new();
    for (number, (axis, range_m)) in axes.enumerate() {
        let spot = Spot::met(&beam, &axis, Some(range_m), number);
        rays.extend(samples.iter().map(|&sample| spot.ray(sample).unwrap_or(axis)));
    }
    rays
}

/// The rays through the spot of one chirp.
#[derive(Clone, Copy)]
pub(super) struct Spot {
    pub axis: Ray<Global>,
    /// The beam along it.
    pub beam: GaussianBeam,
    /// The beam where its axis meets the target.
    pub section: Section,
    /// Where each coordinate of one of [`samples`] leads from the axis, m.
    pub across_m: [DVec3; 2],
}

impl Spot {
    /// As wide as the beam where its axis meets the target, or at 8 m. The number of the chirp turns the
    /// pattern, so that neighbouring chirps do not repeat it.
    pub fn met(beam: &Beam, axis: &Ray<Global>, range_m: Option<f64>, chirp: usize) -> Spot {
        let spot = Spot::of_one_ray(beam, axis, range_m);
        let (right, up) = across(axis.direction.xyz());
        let (sin, cos) = (TAU * (chirp as f64 * GOLDEN).fract()).sin_cos();
        let across = [cos * right + sin * up, cos * up - sin * right];
        Spot { across_m: across.map(|unit| spot.section.radius_m * unit), ..spot }
    }

    /// As [`met`](Self::met), for the axis as its only ray.
    pub fn of_one_ray(beam: &Beam, axis: &Ray<Global>, range_m: Option<f64>) -> Spot {
        let beam = beam.along(axis);
        let section = beam.section(range_m.unwrap_or(PATTERN_RANGE_M));
        Spot { axis: *axis, beam, section, across_m: [DVec3::ZERO; 2] }
    }

    /// Divergence of the beam, rad, at a distance along it, m, for a spot of so many rays: many stand on the
    /// curved wavefront, which is a part of it, and a single one does not.
    pub fn divergence_rad(&self, rays: usize, range_m: f64) -> f64 {
        match rays {
            1 => self.beam.divergence_rad(),
            _ => self.beam.section(range_m).divergence_rad(),
        }
    }

    /// The ray of one of [`samples`]; the one in the middle is the axis.
    pub fn ray(&self, sample: DVec2) -> Option<Ray<Global>> {
        if sample == DVec2::ZERO {
            return Some(self.axis);
        }
        let [right_m, up_m] = self.across_m;
        self.section.ray(&self.axis, sample.x * right_m + sample.y * up_m)
    }
}

/// The samples of the first chirp's spot, in radii w of the beam; a single one is on the axis.
pub(super) fn samples(count: usize) -> Vec<DVec2> {
    if count == 1 {
        return vec![DVec2::ZERO];
    }
    let samples = (0..count).map(|sample| {
        radius(sample, count) * DVec2::from_angle(TAU * (sample as f64 * GOLDEN).fract())
    });
    samples.collect()
}

/// Distance of a sample from the axis, in radii w of the beam.
fn radius(sample: usize, count: usize) -> f64 {
    // The share of the two-way weight exp(−4r²/w²) within r is 1 − exp(−4r²/w²).
    0.5 * (-(1.0 - share(sample, count)).ln()).sqrt()
}

/// The share of the two-way weight that lies nearer to the axis than a sample.
fn share(sample: usize, count: usize) -> f64 {
    (sample as f64 + 0.5) / count as f64
}

/// The share of the sent power, one way, that falls on each sample of a spot.
///
/// Samples are drawn from the two-way weight u², and light falls by u: their ratio goes as
/// exp(2r²/w²) = 1/√(1 − share).
pub(super) fn lit_shares(count: usize) -> Vec<f64> {
    let ratios: Vec<f64> =
        (0..count).map(|sample| 1.0 / (1.0 - share(sample, count)).sqrt()).collect();
    let sum: f64 = ratios.iter().sum();
    ratios.into_iter().map(|ratio| ratio / sum).collect()
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
    use crate::radar::Radar;

    const RANGE_M: f64 = 8.3;

    /// The spot of a chirp towards the middle of the target plane.
    fn spot(chirp: usize) -> Spot {
        let radar = Radar::default();
        let origin = radar.frames().origin();
        let direction = origin.towards(Point::new(0.0, 1.1, 0.0)).unwrap();
        Spot::met(&Beam::new(&radar), &Ray { origin, direction }, Some(RANGE_M), chirp)
    }

    /// Where a ray passes the plane across the axis at the spot's range, m.
    fn place_m(spot: &Spot, ray: &Ray<Global>) -> DVec3 {
        let forward = spot.axis.direction.xyz();
        let middle = spot.axis.origin.xyz + RANGE_M * forward;
        let from = ray.origin.xyz - middle;
        from - from.dot(forward) / ray.direction.xyz().dot(forward) * ray.direction.xyz()
    }

    fn radii(count: usize) -> Vec<f64> {
        let spot = spot(3);
        let radius = |sample| place_m(&spot, &spot.ray(sample).unwrap()).length();
        samples(count).into_iter().map(|s| radius(s) / spot.section.radius_m).collect()
    }

    #[test]
    fn half_the_two_way_weight_lies_within_its_half_width() {
        // exp(−4r²/w²) = ½ at r = w·√(ln 2)/2.
        let half = 0.5 * std::f64::consts::LN_2.sqrt();
        assert_eq!(radii(1000).iter().filter(|r| **r < half).count(), 500);
    }

    #[test]
    fn the_samples_have_the_second_moment_of_the_two_way_weight() {
        // ⟨r²⟩ = w²/4.
        let mean = radii(4000).iter().map(|r| r * r).sum::<f64>() / 4000.0;
        assert!((mean / 0.25 - 1.0).abs() < 2e-3, "{mean}");
    }

    #[test]
    fn the_samples_weighed_by_what_lights_them_have_that_of_the_beam() {
        let shares = lit_shares(4000);
        assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        // ⟨r²⟩ = w²/2; the singular weight of the outermost ring leaves a few per cent.
        let mean: f64 = radii(4000).iter().zip(&shares).map(|(r, share)| r * r * share).sum();
        assert!((mean / 0.5 - 1.0).abs() < 0.1, "{mean}");
    }

    #[test]
    fn the_samples_are_centred() {
        let spot = spot(0);
        let rays = samples(1000).into_iter().filter_map(|sample| spot.ray(sample));
        let sum = rays.fold(DVec3::ZERO, |sum, ray| sum + place_m(&spot, &ray));
        assert!(sum.length() / 1000.0 < spot.section.radius_m / 100.0);
    }

    #[test]
    fn a_single_ray_is_the_axis() {
        let spot = spot(5);
        assert_eq!(
            samples(1).into_iter().map(|s| spot.ray(s)).collect::<Vec<_>>(),
            [Some(spot.axis)]
        );
    }
}
