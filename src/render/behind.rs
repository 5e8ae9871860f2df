//! What rays meet behind sheets: they go straight on, since a thin sheet does not refract them.

use glam::DVec2;
use rayon::prelude::*;

use super::setup::Setup;
use super::sheet::{Passage, Sheet};
use super::spot::{Behind, Footprints, Spot, edge_distances_m, samples};
use crate::frames::{Direction, Global, Point, Ray};
use crate::radar::Beam;
use crate::trace::{Hit, ScanGeometry};

/// Distance from a surface at which a ray starts, m, so that it does not hit the same surface again. It is far above
/// the rounding of f64 and far below a wavelength.
pub(super) const LIFT_M: f64 = 1e-7;

/// Rays that go on together: those of a spot nearly coincide.
const RAYS_PER_TASK: usize = 64;

/// Adds to the footprints what lies behind the sheets that their rays meet.
pub(super) fn trace_behind(setup: &Setup, footprints: &mut Footprints) {
    let geometry = &setup.geometry;
    let count = footprints.rays_per_chirp;
    let rays = SpotRays::new(geometry, &*footprints);
    let chirps = (RAYS_PER_TASK / count).max(1);
    for _ in 0..setup.most_sheets {
        let front = footprints.behind.last().map_or(&footprints.hits, |behind| &behind.hits);
        let mut hits = vec![None; front.len()];
        let tasks = hits.par_chunks_mut(chirps * count).zip(front.par_chunks(chirps * count));
        tasks.enumerate().for_each(|(task, (hits, front))| {
            rays.meet_behind(setup, task * chirps, front, hits);
        });
        if hits.iter().all(Option::is_none) {
            return;
        }
        let edge_m = edge_distances_m(geometry, &hits, count);
        footprints.behind.push(Behind { hits, edge_m });
    }
    let last = footprints.behind.last().map_or(&footprints.hits, |behind| &behind.hits);
    footprints.ended = last.iter().flatten().filter(|hit| setup.sheet(hit.facet).is_some()).count();
}

/// The ray that goes on behind a hit.
pub(super) fn onward(hit: &Hit, direction: Direction<Global>) -> Ray<Global> {
    Ray { origin: Point::from(hit.point.xyz + LIFT_M * direction.xyz()), direction }
}

/// The way of a ray through the sheet that it hits.
pub(super) fn passage(
    setup: &Setup,
    sheet: &Sheet,
    hit: &Hit,
    direction: Direction<Global>,
) -> Passage {
    let along = direction.xyz();
    let normal = setup.geometry.bvh.mesh().area_normal(hit.facet as usize).normalize_or(along);
    sheet.passage(along, normal)
}

/// The rays of all chirps, by the numbers of their hits.
struct SpotRays<'a> {
    axes: &'a [Ray<Global>],
    beam: Beam,
    axis_range_m: Vec<Option<f64>>,
    samples: Vec<DVec2>,
}

impl<'a> SpotRays<'a> {
    fn new(geometry: &ScanGeometry<'a>, footprints: &Footprints) -> SpotRays<'a> {
        SpotRays {
            axes: &geometry.chirps.rays,
            beam: Beam::new(geometry.radar),
            axis_range_m: footprints.axis_range_m.clone(),
            samples: samples(footprints.rays_per_chirp),
        }
    }

    /// Finds what the rays of the chirps from `first` on hit behind the sheets that they hit in front.
    fn meet_behind(
        &self,
        setup: &Setup,
        first: usize,
        front: &[Option<Hit>],
        hits: &mut [Option<Hit>],
    ) {
        let count = self.samples.len();
        let (mut through, mut rays) = (Vec::new(), Vec::new());
        for (chirp, front) in (first..).zip(front.chunks(count)) {
            let mut spot = None;
            for (sample, hit) in front.iter().enumerate() {
                let Some(hit) = hit.filter(|hit| setup.sheet(hit.facet).is_some()) else {
                    continue;
                };
                let spot = spot.get_or_insert_with(|| self.spot(chirp));
                if let Some(ray) = spot.ray(self.samples[sample]) {
                    through.push(((chirp - first) * count + sample, hit.range_m + LIFT_M));
                    rays.push(onward(&hit, ray.direction));
                }
            }
        }
        if rays.is_empty() {
            return;
        }
        let behind = setup.geometry.bvh.closest_of_spots(&rays, count);
        for ((place, passed_m), hit) in through.into_iter().zip(behind) {
            hits[place] = hit.map(|hit| Hit { range_m: passed_m + hit.range_m, ..hit });
        }
    }

    fn spot(&self, chirp: usize) -> Spot {
        Spot::met(&self.beam, &self.axes[chirp], self.axis_range_m[chirp], chirp)
    }
}

/// Where a ray ends.
pub(super) struct Way {
    /// The surface that it meets; `None` where it gets as far as it should.
    pub hit: Option<Hit>,
    /// The sheets on the way.
    pub passage: Passage,
}

/// Follows a ray through sheets to the first surface nearer than `until_m` that stops it.
pub(super) fn follow(setup: &Setup, mut ray: Ray<Global>, until_m: f64) -> Way {
    let (mut way, mut passed_m) = (Passage::FREE, 0.0);
    loop {
        let hit = setup.geometry.bvh.closest(&ray);
        let hit = hit.map(|hit| Hit { range_m: passed_m + hit.range_m, ..hit });
        let Some(hit) = hit.filter(|hit| hit.range_m < until_m) else {
            return Way { hit: None, passage: way };
        };
        match setup.sheet(hit.facet) {
            Some(sheet) if usize::from(way.sheets) < setup.most_sheets => {
                way = way.then(passage(setup, sheet, &hit, ray.direction));
                passed_m = hit.range_m + LIFT_M;
                ray = onward(&hit, ray.direction);
            }
            _ => return Way { hit: Some(hit), passage: way },
        }
    }
}
