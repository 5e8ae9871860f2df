//! Rays that share their origin: a scan as a picture. No hierarchy is built.
//!
//! Seen from the origin a ray is a point (u, v) and a facet its perspective picture: whether the one lies
//! in the other is told by three linear forms, and inverse depth is a fourth. The rays are sorted once into
//! a grid ([`Fan`]); then the facets are walked, each over the cells that its box touches.
//!
//! - **f32 finds.** Differences from the facet's first corner come before products, and every form has a bound
//!   of its rounding (`picture.rs`): for a facet of 1 cm at 8 m some micrometres beside an edge. A ray farther than
//!   that inside, and nearer by more than the bound on inverse depth than what it has met so far, is decided.
//! - **f64 decides** the rest, one ray in some hundreds, by the rule of the hierarchy: edge volumes that are exact negatives for
//!   neighbours, so that nothing slips between, and of equally near facets the one with the smallest number.
//! - Range and angle are those of the hierarchy, bit for bit.
//! - Facets behind the origin are passed over. Those that cross its plane, or come so near to it
//!   that their picture is of no use, have a hierarchy of their own, if they are in the field at all.
//!
//! Every ray sees the facets in ascending order however the work is shared, so that the result is the same
//! on any number of threads.

mod band;
mod fan;
mod lanes;
mod picture;
#[cfg(test)]
mod tests;

use rayon::prelude::*;

use super::facet::{measured, plane_m};
use super::{Bvh, Hit};
use crate::frames::{Global, Ray};
use crate::geometry::Mesh;
use band::Band;
use lanes::widest;
use picture::Picture;

pub use fan::{Fan, NoFan};

/// Unit roundoff of f32, 2⁻²⁴.
const ROUNDING: f32 = f32::EPSILON / 2.0;

/// No facet.
const NONE: u32 = u32::MAX;

/// Facets of one task.
const FACETS_PER_TASK: usize = 8192;

/// Bands of the grid for every thread: more of them share the work more evenly.
const BANDS_PER_THREAD: usize = 4;

impl Fan<'_> {
    /// The closest hits of all rays on a mesh, in their order; of equally near facets the one with the
    /// smallest number.
    pub fn closest(&self, mesh: &Mesh) -> Vec<Option<Hit>> {
        // Within the pool: from outside, every step would wake it anew.
        rayon::scope(|_| self.nearest_hits(mesh))
    }

    fn nearest_hits(&self, mesh: &Mesh) -> Vec<Option<Hit>> {
        let picture = Picture::new(self, mesh);
        let nearest = nearest(&picture);
        let left_out = picture.left_out();
        let bvh = (!left_out.is_empty()).then(|| Bvh::over(mesh, left_out));
        let hit = |(ray, &place): (&Ray<Global>, &u32)| {
            let in_picture = match nearest[place as usize] {
                NONE => None,
                facet => plane_m(mesh, facet as usize, ray)
                    .map(|range_m| measured(mesh, facet, ray, range_m)),
            };
            nearer(in_picture, bvh.as_ref().and_then(|bvh| bvh.closest(ray)))
        };
        self.rays.par_iter().zip(&self.place_of).with_min_len(1024).map(hit).collect()
    }
}

fn nearer(a: Option<Hit>, b: Option<Hit>) -> Option<Hit> {
    let key = |hit: &Hit| (hit.range_m, hit.facet);
    match (a, b) {
        (Some(a), Some(b)) => Some(if key(&b) < key(&a) { b } else { a }),
        (a, b) => a.or(b),
    }
}

/// The nearest facet of the ray at every place, or [`NONE`].
fn nearest(picture: &Picture) -> Vec<u32> {
    let facets = picture.mesh.facets.len();
    let rows = picture.fan.grid.rows;
    let threads = rayon::current_num_threads();
    if threads == 1 {
        let mut band = Band::new(picture, 0..rows);
        widest(&mut band, 0..facets as u32);
        return band.facets();
    }
    let cuts = cuts(picture.fan, BANDS_PER_THREAD * threads);
    let tasks: Vec<Vec<Vec<u32>>> = (0..facets.div_ceil(FACETS_PER_TASK))
        .into_par_iter()
        .map(|task| {
            let first = task * FACETS_PER_TASK;
            shared_out(picture, &cuts, first..facets.min(first + FACETS_PER_TASK))
        })
        .collect();
    let band = |number: usize| {
        let mut band = Band::new(picture, cuts[number]..cuts[number + 1]);
        widest(&mut band, tasks.iter().flat_map(|bands| bands[number].iter().copied()));
        band.facets()
    };
    (0..cuts.len() - 1).into_par_iter().flat_map_iter(band).collect()
}

/// Rows at which bands of about equally many rays begin, and the end.
fn cuts(fan: &Fan, bands: usize) -> Vec<usize> {
    let (grid, rays) = (&fan.grid, fan.rays.len());
    let mut cuts = vec![0];
    for row in 1..grid.rows {
        if grid.row_start(row) * bands >= cuts.len() * rays {
            cuts.push(row);
        }
    }
    cuts.push(grid.rows);
    cuts
}

/// For every band the facets that reach into it, in ascending order.
fn shared_out(picture: &Picture, cuts: &[usize], facets: std::ops::Range<usize>) -> Vec<Vec<u32>> {
    let mut bands = vec![Vec::new(); cuts.len() - 1];
    let band_of = |row: usize| cuts.partition_point(|&cut| cut <= row) - 1;
    for facet in facets.start as u32..facets.end as u32 {
        if let Some(patch) = picture.patch(facet) {
            let [first, last] = patch.rows.map(band_of);
            bands[first..=last].iter_mut().for_each(|band| band.push(facet));
        }
    }
    bands
}
