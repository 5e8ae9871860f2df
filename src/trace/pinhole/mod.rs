//! Rays that share their origin: a scan as a picture. No hierarchy is built.
//!
//! Seen from the origin a ray is a point (u, v) and a facet its perspective picture: whether the one lies
//! in the other is told by three linear forms, and inverse depth is a fourth. The rays are sorted once into
//! a grid ([`Fan`]); then the facets are walked, each over the cells that its box touches.
//!
//! - **f32 finds.** Differences from the facet's first corner come before products, and every form has a bound
//!   of its rounding (`patches.rs`): for a facet of 1 cm at 8 m some micrometres beside an edge. A ray farther than
//!   that inside, and nearer by more than the bound on inverse depth than what it has met so far, is decided.
//! - **f64 decides** the rest, one ray in some hundreds, by the rule of the hierarchy: edge volumes that are exact negatives for
//!   neighbours, so that nothing slips between, and of equally near facets the one with the smallest number.
//! - Range and angle are those of the hierarchy, bit for bit.
//! - Facets behind the origin are passed over. Those that cross its plane, or come so near to it
//!   that their picture is of no use, have a hierarchy of their own, if they are in the field at all.
//!
//! What a ray meets first does not depend on the order of the facets: f32 notes what is certain, and f64
//! orders the rest by range and number. So the work may be shared by rays or by facets, and the result is the
//! same on any number of threads.

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
use super::facet::met_by;
use super::hit::{Hit, no_hits};
use super::wide::{Wide, widest};
use crate::frames::{Global, Ray};
use crate::geometry::Mesh;
use band::Band;
use lanes::LANES;
use patches::{NONE, blocks};
use picture::Picture;

pub use fan::{Fan, NoFan};

/// Facets that are shared out to bands at once.
const FACETS_PER_TASK: usize = 8192;

/// So few rays that every thread can have all of them in its cache, and work is shared by facets.
const FEW_RAYS: usize = 1 << 16;

/// Of more facets than this for each ray their lists would cost more than a second look at the rays.
const MANY_FACETS_PER_RAY: usize = 8;

/// Shares of the facets for every thread, where there are few rays.
const SHARES_PER_THREAD: usize = 2;

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
        let mut hits = no_hits(self.rays.len());
        let blocks = self.rays.par_chunks(LANES).zip(self.sorted.place_of.par_chunks(LANES));
        let blocks = blocks.zip(hits.par_chunks_mut(LANES)).with_min_len(64);
        blocks.for_each(|((rays, places), hits)| {
            widest(Meeting { mesh, rays, places, nearest: &nearest, hits });
            if let Some(bvh) = &bvh {
                let behind = rays.iter().map(|ray| bvh.closest(ray));
                hits.iter_mut().zip(behind).for_each(|(hit, other)| *hit = nearer(*hit, other));
            }
        });
        hits
    }
}

/// Up to [`LANES`] rays that meet the facets at their places.
struct Meeting<'a> {
    mesh: &'a Mesh,
    rays: &'a [Ray<Global>],
    places: &'a [u32],
    nearest: &'a [u32],
    hits: &'a mut [Option<Hit>],
}

impl Wide for Meeting<'_> {
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
            met_by(self.mesh, facets, rays, self.hits);
        }
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
    let (facets, rays) = (picture.mesh.facets.len(), picture.fan.rays.len());
    let are_few = rays <= FEW_RAYS || facets / MANY_FACETS_PER_RAY > rays;
    match rayon::current_num_threads() {
        1 => shared_by_facets(picture, 1),
        threads if are_few => shared_by_facets(picture, SHARES_PER_THREAD * threads),
        threads => shared_by_rays(picture, BANDS_PER_THREAD * threads),
    }
}

/// Every task has all rays and some of the facets.
fn shared_by_facets(picture: &Picture, shares: usize) -> Vec<u32> {
    let (facets, rows) = (picture.mesh.facets.len(), picture.fan.sorted.grid.rows);
    let cut = |share: usize| (share * facets / shares) as u32;
    let among = |share| Band::new(picture, 0..rows).walked(cut(share)..cut(share + 1));
    let found = (0..shares).into_par_iter().map(among).reduce_with(Band::nearer);
    found.map_or(Vec::new(), Band::facets)
}

/// Every task has some of the rays and the facets that reach among them.
fn shared_by_rays(picture: &Picture, bands: usize) -> Vec<u32> {
    let facets = picture.mesh.facets.len();
    let cuts = cuts(picture.fan, bands);
    let tasks: Vec<Vec<Vec<u32>>> = (0..facets.div_ceil(FACETS_PER_TASK))
        .into_par_iter()
        .map(|task| {
            let [first, end] =
                [task, task + 1].map(|task| (task * FACETS_PER_TASK).min(facets) as u32);
            widest(Sharing { picture, cuts: &cuts, facets: first..end })
        })
        .collect();
    let band = |number: usize| {
        let facets = tasks.iter().flat_map(|bands| bands[number].iter().copied());
        Band::new(picture, cuts[number]..cuts[number + 1]).walked(facets).facets()
    };
    (0..cuts.len() - 1).into_par_iter().flat_map_iter(band).collect()
}

/// Rows at which bands of about equally many rays begin, and the end.
fn cuts(fan: &Fan, bands: usize) -> Vec<usize> {
    let (grid, rays) = (&fan.sorted.grid, fan.rays.len());
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
struct Sharing<'a> {
    picture: &'a Picture<'a>,
    cuts: &'a [usize],
    facets: Range<u32>,
}

impl Wide for Sharing<'_> {
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
