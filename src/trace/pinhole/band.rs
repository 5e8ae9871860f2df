//! Some rows of the grid, and the nearest facet of every ray there.

use std::ops::Range;

use super::lanes::{Form, LANES, Nearest};
use super::picture::{Patch, Picture};
use super::{NONE, ROUNDING};
use crate::trace::facet::{crossing_m, plane_m};

/// The nearest facets of the rays of some rows.
///
/// What a ray sees depends on the order of the facets and on nothing else: bands may be cut anywhere.
pub(super) struct Band<'a> {
    picture: &'a Picture<'a>,
    rows: Range<usize>,
    /// The first place of its rays in the fan's lists.
    first: usize,
    /// For every ray bounds of the nearest inverse depth, 1/m, and its facet; a block more at the end.
    low: Vec<f32>,
    high: Vec<f32>,
    facet: Vec<u32>,
}

impl<'a> Band<'a> {
    pub fn new(picture: &'a Picture, rows: Range<usize>) -> Band<'a> {
        let [first, end] = [rows.start, rows.end].map(|row| picture.fan.grid.row_start(row));
        let count = end - first + LANES;
        let [low, high] = [(); 2].map(|()| vec![f32::NEG_INFINITY; count]);
        Band { picture, rows, first, low, high, facet: vec![NONE; count] }
    }

    /// Facets in ascending order; may be called again with higher ones.
    #[inline(always)]
    pub fn walk(&mut self, facets: impl Iterator<Item = u32>) {
        for facet in facets {
            if let Some(patch) = self.picture.patch(facet) {
                self.meet(facet, &patch);
            }
        }
    }

    /// The nearest facet of every ray, in the order of the fan's lists.
    pub fn facets(mut self) -> Vec<u32> {
        self.facet.truncate(self.facet.len() - LANES);
        self.facet
    }

    #[inline(always)]
    fn meet(&mut self, facet: u32, patch: &Patch) {
        let grid = &self.picture.fan.grid;
        let ([first, last], [left, right]) = (patch.rows, patch.columns);
        let (mut form, mut has_area) = (None, None);
        for row in first.max(self.rows.start)..(last + 1).min(self.rows.end) {
            let [start, end] = grid.places(row, left, right);
            if start == end {
                continue;
            }
            let form = form.get_or_insert_with(|| {
                let form = patch.form(grid.cell, grid.reach);
                has_area = patch.has_area(&form).then_some(true);
                form
            });
            for place in (start..end).step_by(LANES) {
                self.block(facet, form, place, end - place, &mut has_area);
            }
        }
    }

    /// Up to [`LANES`] rays from a place on.
    #[inline(always)]
    fn block(
        &mut self,
        facet: u32,
        form: &Form,
        place: usize,
        count: usize,
        has_area: &mut Option<bool>,
    ) {
        let (fan, own, count) = (self.picture.fan, place - self.first, count as f32);
        let (Some(u), Some(v)) = (lanes(&fan.u, place), lanes(&fan.v, place)) else { return };
        let (Some(low), Some(high), Some(best)) = (
            lanes_mut(&mut self.low, own),
            lanes_mut(&mut self.high, own),
            lanes_mut(&mut self.facet, own),
        ) else {
            return;
        };
        let Some(seen) = form.see(u, v, low, count) else { return };
        let mesh = self.picture.mesh;
        if !*has_area.get_or_insert_with(|| !mesh.is_degenerate(facet as usize)) {
            return;
        }
        let nearest = Nearest { low, high, facet: best };
        if let Some(open) = form.note(facet, &seen, nearest, count) {
            let open = std::iter::zip(place.., open).filter(|&(_, open)| open == 1);
            open.for_each(|(place, _)| self.settle(facet, place));
        }
    }

    /// Decides in f64 what f32 cannot tell.
    #[cold]
    fn settle(&mut self, facet: u32, place: usize) {
        let Picture { fan, mesh, .. } = *self.picture;
        let ray = &fan.rays[fan.ray_at[place] as usize];
        let Some(range_m) = crossing_m(mesh, facet as usize, ray) else { return };
        let own = place - self.first;
        let so_far = self.facet[own];
        let nearest_m = match so_far {
            NONE => None,
            facet => plane_m(mesh, facet as usize, ray),
        };
        if nearest_m.is_none_or(|nearest_m| (range_m, facet) < (nearest_m, so_far)) {
            let per_m = 1.0 / (range_m * (fan.frame * ray.direction.xyz()).z);
            let bound = |sign: f64| (per_m * (1.0 + sign * 4.0 * f64::from(ROUNDING))) as f32;
            (self.low[own], self.high[own], self.facet[own]) = (bound(-1.0), bound(1.0), facet);
        }
    }
}

fn lanes<T>(list: &[T], at: usize) -> Option<&[T; LANES]> {
    list.get(at..)?.first_chunk()
}

fn lanes_mut<T>(list: &mut [T], at: usize) -> Option<&mut [T; LANES]> {
    list.get_mut(at..)?.first_chunk_mut()
}
