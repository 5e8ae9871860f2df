//! The distance of each chirp of a scan from the nearest edge in depth.
//!
//! An edge lies between two neighbouring chirps if only one of them hits the target, or
//! if their ranges differ by more than a spot diameter plus a slope of 60°. The edge is assumed halfway
//! between them, so that distances are accurate to about one spacing of the scan.

use std::ops::Range;

use glam::DVec2;
use rayon::prelude::*;

/// Steepest slope of a surface that is not an edge, tan 60°.
const STEEPEST: f64 = 1.732_050_807_568_877_2;

/// Chirps at most this many mean spacings apart are neighbours.
const NEIGHBOURHOOD: f64 = 2.5;

/// Chirps per task.
const CHIRPS_PER_TASK: usize = 512;

/// Distance of every chirp from the nearest edge in the target plane, m, at most `reach_m`.
///
/// Each chirp is a point of the target plane, m, and a range, m, which is `None` for a miss. `spot_m` is the
/// diameter of the spot.
pub(super) fn distances_m(chirps: &[(DVec2, Option<f64>)], spot_m: f64, reach_m: f64) -> Vec<f64> {
    let spacing_m = spacing_m(chirps);
    let near_m = NEIGHBOURHOOD * spacing_m;
    let mut distinct = thin_out(chirps, spacing_m / 4.0);
    let cells = Cells::sort(&mut distinct, |chirp| chirp.0, near_m);
    let places: Vec<DVec2> = distinct.iter().map(|chirp| chirp.0).collect();
    // Most neighbours differ by less than a spot, which needs their ranges alone.
    let ranges_m: Vec<f64> =
        distinct.iter().map(|chirp| chirp.1.unwrap_or(f64::INFINITY)).collect();
    let nearest_across = |number: usize| {
        let (here, here_m) = (places[number], ranges_m[number]);
        let mut nearest: Option<(f64, usize)> = None;
        for others in cells.near(here) {
            let steps = ranges_m[others.clone()].iter().map(|there_m| (here_m - there_m).abs());
            // That of two that miss is no number.
            for (other, _) in others.zip(steps).filter(|(_, step_m)| *step_m > spot_m) {
                let distance_m2 = places[other].distance_squared(here);
                if distance_m2 <= near_m * near_m
                    && nearest.is_none_or(|(nearest_m2, _)| distance_m2 < nearest_m2)
                    && is_across(distinct[number], distinct[other], spot_m)
                {
                    nearest = Some((distance_m2, other));
                }
            }
        }
        nearest.map(|(_, other)| other)
    };
    let across: Vec<Option<usize>> = (0..places.len())
        .into_par_iter()
        .with_min_len(CHIRPS_PER_TASK)
        .map(nearest_across)
        .collect();
    // Only pairs that are nearest to each other: between others there is a chirp of the same side.
    let mut edges: Vec<DVec2> = Vec::new();
    for (chirp, other) in across.iter().enumerate() {
        if let Some(other) = *other
            && across[other] == Some(chirp)
        {
            edges.push(0.5 * (places[chirp] + places[other]));
        }
    }
    // Cells smaller than the spacing would mostly be empty.
    let cells = Cells::sort(&mut edges, |edge| *edge, reach_m.max(spacing_m));
    let distance_m = |chirp: &(DVec2, Option<f64>)| {
        let mut least_m2 = f64::INFINITY;
        for near in cells.near(chirp.0) {
            for edge in &edges[near] {
                least_m2 = least_m2.min(edge.distance_squared(chirp.0));
            }
        }
        least_m2.sqrt().min(reach_m)
    };
    chirps.par_iter().with_min_len(CHIRPS_PER_TASK).map(distance_m).collect()
}

/// Keeps the first chirp of each small cell, so that many chirps at one place cost no more than one.
fn thin_out(chirps: &[(DVec2, Option<f64>)], side_m: f64) -> Vec<(DVec2, Option<f64>)> {
    let frame = Frame::around(chirps.iter().map(|chirp| chirp.0), side_m);
    let mut is_taken = vec![false; frame.columns * frame.rows];
    let is_first = |chirp: &&(DVec2, Option<f64>)| {
        frame.number_at(chirp.0).is_some_and(|cell| !std::mem::replace(&mut is_taken[cell], true))
    };
    chirps.iter().filter(is_first).copied().collect()
}

/// Whether an edge lies between two chirps.
pub(super) fn is_across(a: (DVec2, Option<f64>), b: (DVec2, Option<f64>), spot_m: f64) -> bool {
    match (a.1, b.1) {
        (Some(here_m), Some(there_m)) => {
            (here_m - there_m).abs() > spot_m + STEEPEST * a.0.distance(b.0)
        }
        (None, None) => false,
        _ => true,
    }
}

/// Mean spacing of the chirps, m: the side of a square with a chirp's share of the area, or its share of a line.
pub(super) fn spacing_m(chirps: &[(DVec2, Option<f64>)]) -> f64 {
    let min = chirps.iter().fold(DVec2::INFINITY, |min, chirp| min.min(chirp.0));
    let max = chirps.iter().fold(DVec2::NEG_INFINITY, |max, chirp| max.max(chirp.0));
    let (sides_m, count) = ((max - min).max(DVec2::splat(1e-6)), chirps.len().max(1) as f64);
    (sides_m.x * sides_m.y / count).sqrt().max(sides_m.max_element() / count)
}

/// A rectangle of square cells.
pub(super) struct Frame {
    side_m: f64,
    /// The corner of least x and y, m.
    corner: DVec2,
    pub columns: usize,
    pub rows: usize,
}

impl Frame {
    /// The smallest rectangle of cells with side `side_m` around points; points that are not finite do not count.
    pub fn around(points: impl Iterator<Item = DVec2>, side_m: f64) -> Frame {
        let bounds = points.filter(|point| point.is_finite()).fold(None, |bounds, point| {
            let (least, most): (DVec2, DVec2) = bounds.unwrap_or((point, point));
            Some((least.min(point), most.max(point)))
        });
        let Some((corner, most)) = bounds else {
            return Frame { side_m, corner: DVec2::ZERO, columns: 0, rows: 0 };
        };
        let frame = Frame { side_m, corner, columns: 0, rows: 0 };
        let [columns, rows] = frame.cell(most).map(|last| last as usize + 1);
        Frame { columns, rows, ..frame }
    }

    /// Column and row of a point, counted from the corner.
    fn cell(&self, point: DVec2) -> [i32; 2] {
        ((point - self.corner) / self.side_m).floor().to_array().map(|x| x as i32)
    }

    /// Number of the cell that contains a point; `None` outside.
    pub fn number_at(&self, point: DVec2) -> Option<usize> {
        let [column, row] = self.cell(point);
        point.is_finite().then(|| self.number(column, row))?
    }

    /// Number of a cell, counted column after column; `None` outside.
    pub fn number(&self, column: i32, row: i32) -> Option<usize> {
        let within = |at: i32, count: usize| usize::try_from(at).ok().filter(|&at| at < count);
        Some(within(column, self.columns)? * self.rows + within(row, self.rows)?)
    }
}

/// Square cells that points are sorted into, for searches within the side of a cell.
struct Cells {
    frame: Frame,
    /// First point of each cell, and the number of all.
    starts: Vec<u32>,
}

impl Cells {
    /// Sorts items with a place by their cells, column after column. Those in no cell go.
    fn sort<T: Copy>(items: &mut Vec<T>, place: impl Fn(&T) -> DVec2, side_m: f64) -> Cells {
        let frame = Frame::around(items.iter().map(&place), side_m);
        let within = |item: &T| Some((frame.number_at(place(item))?, *item));
        let mut cells: Vec<(usize, T)> = items.iter().filter_map(within).collect();
        cells.sort_by_key(|(cell, _)| *cell);
        let mut starts = vec![0; frame.columns * frame.rows + 1];
        cells.iter().for_each(|&(cell, _)| starts[cell + 1] += 1);
        for cell in 1..starts.len() {
            starts[cell] += starts[cell - 1];
        }
        *items = cells.into_iter().map(|(_, item)| item).collect();
        Cells { frame, starts }
    }

    /// The points in the cell of a place and in its eight neighbours, which include all within one side of it, as ranges of the
    /// sorted points.
    fn near(&self, place: DVec2) -> [Range<usize>; 3] {
        let [column, row] = self.frame.cell(place);
        let low = row.saturating_sub(1).max(0);
        let high = row.saturating_add(1).min(self.frame.rows as i32 - 1);
        [-1, 0, 1].map(|aside| self.in_column(column.saturating_add(aside), low, high))
    }

    /// The points in the rows from `low` to `high` of a column.
    fn in_column(&self, column: i32, low: i32, high: i32) -> Range<usize> {
        match (self.frame.number(column, low), self.frame.number(column, high)) {
            (Some(first), Some(last)) if low <= high => {
                self.starts[first] as usize..self.starts[last + 1] as usize
            }
            _ => 0..0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPOT_M: f64 = 0.016;
    const STEP_M: f64 = 0.005;

    /// Looks on a square grid, with ranges by place.
    fn looks(range_m: impl Fn(DVec2) -> Option<f64>) -> Vec<(DVec2, Option<f64>)> {
        let place = |i: usize| DVec2::new((i % 60) as f64, (i / 60) as f64) * STEP_M;
        (0..3600).map(place).map(|p| (p, range_m(p))).collect()
    }

    #[test]
    fn a_step_and_a_rim_are_edges_to_half_a_spacing() {
        for behind in [Some(8.1), None] {
            let looks = looks(|p| if p.x < 0.1501 { Some(8.0) } else { behind });
            for ((place, _), found_m) in looks.iter().zip(distances_m(&looks, SPOT_M, 0.05)) {
                let expected_m = (place.x - 0.1525).abs().min(0.05);
                assert!((found_m - expected_m).abs() <= 0.5 * STEP_M, "{place}: {found_m}");
            }
        }
    }

    #[test]
    fn a_line_of_looks_sees_the_edges_that_it_crosses() {
        let place = |i: usize| DVec2::new(1e-3 * i as f64, 0.0);
        let range_m = |x: f64| (x > 0.1005 && x < 0.2995).then_some(8.0);
        let looks: Vec<_> = (0..400).map(place).map(|p| (p, range_m(p.x))).collect();
        for ((place, _), found_m) in looks.iter().zip(distances_m(&looks, SPOT_M, 0.05)) {
            let nearest_m = (place.x - 0.1005).abs().min((place.x - 0.2995).abs()).min(0.05);
            assert!((found_m - nearest_m).abs() <= 1e-3, "{place}: {found_m}");
        }
    }

    #[test]
    fn looks_on_top_of_each_other_cost_no_more_than_one() {
        let staring = vec![(DVec2::ONE, Some(8.0)); 1_000_000];
        assert!(distances_m(&staring, SPOT_M, 0.05).iter().all(|&m| m == 0.05));
    }

    #[test]
    fn cells_know_every_point_within_a_side() {
        let mut state = 1u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let points: Vec<DVec2> = (0..400).map(|_| DVec2::new(next(), 2.0 * next())).collect();
        for side_m in [0.03, 0.2, 5.0] {
            let mut sorted: Vec<(DVec2, usize)> = points.iter().copied().zip(0..).collect();
            let cells = Cells::sort(&mut sorted, |point| point.0, side_m);
            for place in points.iter().map(|point| *point + 0.3 * DVec2::new(next(), next())) {
                let within = |number: &usize| points[*number].distance(place) <= side_m;
                let near = cells.near(place).into_iter().flat_map(|near| &sorted[near]);
                let mut found: Vec<usize> =
                    near.map(|(_, number)| *number).filter(within).collect();
                found.sort();
                assert!((0..points.len()).filter(within).eq(found), "{place} {side_m}");
            }
        }
    }

    #[test]
    fn places_without_end_are_no_cells() {
        let mut looks = looks(|_| Some(8.0));
        for far in [f64::NAN, f64::INFINITY, 1e300, -1e14] {
            looks.push((DVec2::new(far, 0.0), None));
            assert_eq!(distances_m(&looks, SPOT_M, 0.05).len(), looks.len());
        }
    }

    #[test]
    fn a_slope_is_no_edge_and_a_lone_look_has_none() {
        let slope = looks(|p| Some(8.0 + 1.5 * p.x));
        assert!(distances_m(&slope, SPOT_M, 0.05).iter().all(|&m| m == 0.05));
        assert_eq!(distances_m(&[(DVec2::ZERO, Some(8.0))], SPOT_M, 0.05), [0.05]);
        assert!(distances_m(&[], SPOT_M, 0.05).is_empty());
    }
}
