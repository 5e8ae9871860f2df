//! Traces rays that share an origin by rasterisation: the facets are drawn into a picture seen from the origin, and
//! no hierarchy is built.
//!
//! In the picture a ray is a point (u, v) and a facet a triangle. Three linear forms over (u, v) say whether the ray
//! passes through the facet, and a fourth gives the inverse depth. The rays are sorted once into a grid
//! ([`Fan`]). Then each facet is tested against the rays of the cells that its bounding box touches.
//!
//! - **f32 searches.** Every form has a bound of its rounding (`patches.rs`), for a facet of 1 cm at 8 m a few
//!   micrometres from an edge. If a ray passes inside by more than this bound, and nearer than every facet before by
//!   more than the bound on inverse depth, the hit is certain.
//! - **f64 decides** the other rays, about one in some hundreds, by the test of the hierarchy (`facet.rs`). It is
//!   watertight, and among equally near facets the one with the smallest number wins.
//! - Range and angle are bit for bit those of the hierarchy.
//! - Facets behind the origin are skipped. Facets that cross the plane of the origin, or come too near to it for the
//!   projection, get a hierarchy of their own if any ray may hit them.
//!
//! The hits do not depend on the order of the facets: f32 records only what is certain, and f64 orders the rest by
//! range and number. So the work may be split by rays or by facets, with the same result on any number of threads.

mod band;
mod fan;
mod lanes;
mod patches;
mod picture;
#[cfg(test)]
mod tests;

use std::ops::Range;

use rayon::prelude::*;

use super::bvh::Bvh;
use super::facet::plane_hits;
use super::hit::{Hit, allocate_hits};
use crate::frames::{Global, Ray};
use crate::geometry::Mesh;
use crate::lanes::{Wide, widest};
use band::Band;
use lanes::LANES;
use patches::{NONE, blocks};
use picture::Picture;

pub use fan::{Fan, NoFan};

/// Facets that one task assigns to bands.
const FACETS_PER_TASK: usize = 8192;

/// Up to this number all rays fit into the cache of every thread, and the work is split by facets.
const FEW_RAYS: usize = 1 << 16;

/// Above this number of facets per ray, lists of facets cost more than testing all rays in every thread.
const MANY_FACETS_PER_RAY: usize = 8;

/// Parts of the facets per thread, if the work is split by facets.
const PARTS_PER_THREAD: usize = 2;

/// Bands of the grid per thread, if the work is split by rays; more bands balance the load better.
const BANDS_PER_THREAD: usize = 4;

impl Fan<'_> {
    /// Finds the closest hit of every ray on a mesh, in the order of the rays; among equally near facets, the one with
    /// the smallest number.
    pub fn closest(&self, mesh: &Mesh) -> Vec<Option<Hit>> {
        // Inside the thread pool, since every parallel step from outside would have to wake it.
        rayon::scope(|_| self.nearest_hits(mesh))
    }

    fn nearest_hits(&self, mesh: &Mesh) -> Vec<Option<Hit>> {
        let picture = Picture::new(self, mesh);
        let nearest = nearest_facets(&picture);
        let left_out = picture.left_out();
        let bvh = (!left_out.is_empty()).then(|| Bvh::over(mesh, left_out));
        let mut hits = allocate_hits(self.rays.len());
        let blocks = self.rays.par_chunks(LANES).zip(self.order.place_of.par_chunks(LANES));
        let blocks = blocks.zip(hits.par_chunks_mut(LANES)).with_min_len(64);
        blocks.for_each(|((rays, places), hits)| {
            widest(BlockIntersection { mesh, rays, places, nearest: &nearest, hits });
            if let Some(bvh) = &bvh {
                let behind = rays.iter().map(|ray| bvh.closest(ray));
                hits.iter_mut().zip(behind).for_each(|(hit, other)| *hit = nearer_hit(*hit, other));
            }
        });
        hits
    }
}

/// Computes the hits of up to [`LANES`] rays on the nearest facets at their places.
struct BlockIntersection<'a> {
    mesh: &'a Mesh,
    rays: &'a [Ray<Global>],
    places: &'a [u32],
    nearest: &'a [u32],
    hits: &'a mut [Option<Hit>],
}

impl Wide for BlockIntersection<'_> {
    type Answer = ();

    #[inline(always)]
    fn run(self) {
        let mut facets = [NONE; LANES];
        for (facet, &place) in facets.iter_mut().zip(self.places) {
            *facet = self.nearest[place as usize];
        }
        if facets != [NONE; LANES] {
            let mut rays = [&self.rays[0]; LANES];
            rays.iter_mut().zip(self.rays).for_each(|(lane, ray)| *lane = ray);
            plane_hits(self.mesh, facets, rays, self.hits);
        }
    }
}

/// The nearer of two hits; of equally near ones the one with the smaller number of its facet.
fn nearer_hit(a: Option<Hit>, b: Option<Hit>) -> Option<Hit> {
    let key = |hit: &Hit| (hit.range_m, hit.facet);
    match (a, b) {
        (Some(a), Some(b)) => Some(if key(&b) < key(&a) { b } else { a }),
        (a, b) => a.or(b),
    }
}

/// The nearest facet of the ray at every place, or [`NONE`].
fn nearest_facets(picture: &Picture) -> Vec<u32> {
    let (facets, rays) = (picture.mesh.facets.len(), picture.fan.rays.len());
    let are_few = rays <= FEW_RAYS || facets / MANY_FACETS_PER_RAY > rays;
    match rayon::current_num_threads() {
        1 => split_by_facets(picture, 1),
        threads if are_few => split_by_facets(picture, PARTS_PER_THREAD * threads),
        threads => split_by_rays(picture, BANDS_PER_THREAD * threads),
    }
}

/// Nearest facets by tasks that test all rays against a part of the facets each.
fn split_by_facets(picture: &Picture, parts: usize) -> Vec<u32> {
    let (facets, rows) = (picture.mesh.facets.len(), picture.fan.order.grid.rows);
    let cut = |part: usize| (part * facets / parts) as u32;
    let bands = (0..parts)
        .into_par_iter()
        .map(|part| Band::new(picture, 0..rows).with_facets(cut(part)..cut(part + 1)));
    bands.reduce_with(Band::merge).map_or(Vec::new(), Band::into_facets)
}

/// Nearest facets by tasks that test a band of the rays against the facets that reach into it each.
fn split_by_rays(picture: &Picture, bands: usize) -> Vec<u32> {
    let facets = picture.mesh.facets.len();
    let cuts = band_starts(picture.fan, bands);
    let tasks: Vec<Vec<Vec<u32>>> = (0..facets.div_ceil(FACETS_PER_TASK))
        .into_par_iter()
        .map(|task| {
            let [first, end] =
                [task, task + 1].map(|task| (task * FACETS_PER_TASK).min(facets) as u32);
            widest(BandAssignment { picture, cuts: &cuts, facets: first..end })
        })
        .collect();
    let band = |number: usize| {
        let facets = tasks.iter().flat_map(|bands| bands[number].iter().copied());
        Band::new(picture, cuts[number]..cuts[number + 1]).with_facets(facets).into_facets()
    };
    (0..cuts.len() - 1).into_par_iter().flat_map_iter(band).collect()
}

/// First rows of bands with about equal numbers of rays, and the number of rows as the end of the last.
fn band_starts(fan: &Fan, bands: usize) -> Vec<usize> {
    let (grid, rays) = (&fan.order.grid, fan.rays.len());
    let mut cuts = vec![0];
    for row in 1..grid.rows {
        if grid.row_start(row) * bands >= cuts.len() * rays {
            cuts.push(row);
        }
    }
    cuts.push(grid.rows);
    cuts
}

/// Assigns facets to bands: for every band the facets that reach into it, in ascending order.
struct BandAssignment<'a> {
    picture: &'a Picture<'a>,
    cuts: &'a [usize],
    facets: Range<u32>,
}

impl Wide for BandAssignment<'_> {
    type Answer = Vec<Vec<u32>>;

    #[inline(always)]
    fn run(self) -> Vec<Vec<u32>> {
        let mut bands = vec![Vec::new(); self.cuts.len() - 1];
        let band_of = |row: usize| self.cuts.partition_point(|&cut| cut <= row) - 1;
        for block in blocks(self.facets) {
            let patches = self.picture.patches(&block);
            for lane in patches.seen() {
                let [first, last] = patches.cells(lane).rows.map(band_of);
                bands[first..=last].iter_mut().for_each(|band| band.push(block[lane]));
            }
        }
        bands
    }
}
