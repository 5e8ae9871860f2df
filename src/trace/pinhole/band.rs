//! The search for the nearest facet of every ray in some rows of the grid.

use std::ops::Range;

use super::lanes::{Form, LANES, Nearest, ROUNDING};
use super::patches::{Cells, Forms, NONE, Patches, blocks};
use super::picture::Picture;
use crate::lanes::{Wide, widest};
use crate::trace::facet::{Line, range_to_plane_m};

/// The rays of some rows of the grid, with the nearest of the facets that have been tested so far.
pub(super) struct Band<'a> {
    picture: &'a Picture<'a>,
    rows: Range<usize>,
    /// Place of its first ray in the lists of the fan.
    first: usize,
    /// Bounds of the nearest inverse depth of every ray, 1/m, and its facet; one block longer than the rays.
    low: Vec<f32>,
    high: Vec<f32>,
    facet: Vec<u32>,
}

impl<'a> Band<'a> {
    pub fn new(picture: &'a Picture, rows: Range<usize>) -> Band<'a> {
        let [first, end] = [rows.start, rows.end].map(|row| picture.fan.order.grid.row_start(row));
        let count = end - first + LANES;
        let [low, high] = [(); 2].map(|()| vec![f32::NEG_INFINITY; count]);
        Band { picture, rows, first, low, high, facet: vec![NONE; count] }
    }

    /// The band after tests of more facets, given in ascending order.
    pub fn with_facets(mut self, facets: impl Iterator<Item = u32>) -> Band<'a> {
        widest(Walk { band: &mut self, facets });
        self
    }

    /// Merges with a band of the same rows that has tested other facets.
    pub fn merge(mut self, other: Band<'a>) -> Band<'a> {
        for own in 0..self.facet.len() - LANES {
            let facet = other.facet[own];
            if facet == NONE || other.high[own] < self.low[own] {
                continue;
            }
            if other.low[own] > self.high[own] {
                (self.low[own], self.high[own], self.facet[own]) =
                    (other.low[own], other.high[own], facet);
            } else {
                self.decide(facet, self.first + own);
            }
        }
        self
    }

    /// The nearest facet of every ray, or [`NONE`].
    pub fn into_facets(mut self) -> Vec<u32> {
        self.facet.truncate(self.facet.len() - LANES);
        self.facet
    }

    /// Tests facets, given in ascending order.
    #[inline(always)]
    fn test_facets(&mut self, facets: impl Iterator<Item = u32>) {
        let grid = &self.picture.fan.order.grid;
        for block in blocks(facets) {
            let patches = self.picture.patches(&block);
            let forms = patches.forms(grid);
            for lane in patches.seen() {
                self.test_facet(block[lane], &patches, &forms, lane);
            }
        }
    }

    /// Tests a facet against the rays of the cells that its box touches.
    #[inline(always)]
    fn test_facet(&mut self, facet: u32, patches: &Patches, forms: &Forms, lane: usize) {
        if !forms.has_area(lane) && self.picture.mesh.is_degenerate(facet as usize) {
            return;
        }
        let (cells, form) = (patches.cells(lane), forms.of(lane));
        let mut is_unsure = false;
        for (place, count) in self.blocks(cells) {
            is_unsure |= self.record(facet, &form, place, count);
        }
        // After the loop, because a call inside it would keep the values out of the registers.
        if is_unsure {
            self.settle(facet, &form, cells);
        }
    }

    /// Records a facet for those of the first `count` rays from a place on of which it is certainly the nearest. Returns
    /// whether f32 cannot decide others.
    #[inline(always)]
    fn record(&mut self, facet: u32, form: &Form, place: usize, count: usize) -> bool {
        let (order, own, count) = (&self.picture.fan.order, place - self.first, count as f32);
        let (Some(u), Some(v)) = (lanes(&order.u, place), lanes(&order.v, place)) else {
            return false;
        };
        let (Some(low), Some(high), Some(best)) = (
            lanes_mut(&mut self.low, own),
            lanes_mut(&mut self.high, own),
            lanes_mut(&mut self.facet, own),
        ) else {
            return false;
        };
        match form.evaluate(u, v, low, count) {
            Some(values) => form.record(facet, &values, Nearest { low, high, facet: best }, count),
            None => false,
        }
    }

    /// Decides in f64 the rays of a facet that f32 cannot.
    #[cold]
    #[inline(never)]
    fn settle(&mut self, facet: u32, form: &Form, cells: Cells) {
        let order = &self.picture.fan.order;
        for (start, count) in self.blocks(cells) {
            for place in start..start + count.min(LANES) {
                let (at, own) = ([order.u[place], order.v[place]], place - self.first);
                if self.facet[own] != facet && form.may_meet(at, self.low[own]) {
                    self.decide(facet, place);
                }
            }
        }
    }

    /// Decides in f64 whether a facet is the nearest of one ray.
    fn decide(&mut self, facet: u32, place: usize) {
        let Picture { fan, mesh, .. } = *self.picture;
        let ray = &fan.rays[fan.order.ray_at[place] as usize];
        let Some(range_m) = Line::new(ray).range_to_facet_m(mesh, facet as usize) else { return };
        let own = place - self.first;
        let so_far = self.facet[own];
        let nearest_m = match so_far {
            NONE => None,
            facet => range_to_plane_m(mesh, facet as usize, ray),
        };
        if nearest_m.is_none_or(|nearest_m| (range_m, facet) < (nearest_m, so_far)) {
            let per_m = 1.0 / (range_m * (fan.frame * ray.direction.xyz()).z);
            let bound = |sign: f64| (per_m * (1.0 + sign * 4.0 * f64::from(ROUNDING))) as f32;
            (self.low[own], self.high[own], self.facet[own]) = (bound(-1.0), bound(1.0), facet);
        }
    }

    /// The blocks of the rays in some cells: first place, and number of rays from there to the end of the row.
    #[inline(always)]
    fn blocks(&self, cells: Cells) -> impl Iterator<Item = (usize, usize)> + use<'a> {
        let grid = &self.picture.fan.order.grid;
        let Cells { columns: [left, right], rows: [first, last] } = cells;
        (first.max(self.rows.start)..(last + 1).min(self.rows.end)).flat_map(move |row| {
            let [start, end] = grid.places(row, left, right);
            (start..end).step_by(LANES).map(move |place| (place, end - place))
        })
    }
}

/// Tests facets against the rays of a band.
struct Walk<'a, 'b, I> {
    band: &'a mut Band<'b>,
    facets: I,
}

impl<I: Iterator<Item = u32>> Wide for Walk<'_, '_, I> {
    type Answer = ();

    #[inline(always)]
    fn run(self) {
        self.band.test_facets(self.facets);
    }
}

fn lanes<T>(list: &[T], at: usize) -> Option<&[T; LANES]> {
    list.get(at..)?.first_chunk()
}

fn lanes_mut<T>(list: &mut [T], at: usize) -> Option<&mut [T; LANES]> {
    list.get_mut(at..)?.first_chunk_mut()
}
