//! How far each look of a scan is from the nearest edge in depth.
//!
//! Two neighbouring looks are on two sides of an edge when only one of them meets the target, or
//! when their ranges differ by more than a spot and a slope of 60° explain. The edge is taken halfway
//! between them, so that a distance is good to about one spacing of the scan.

use glam::DVec2;
use rayon::prelude::*;

/// Slope of a surface, as tan 60°, from which on its own range is an edge.
const STEEPEST: f64 = 1.732_050_807_568_877_2;

/// Looks at most this many mean spacings apart are neighbours.
const NEIGHBOURHOOD: f64 = 2.5;

/// Distance of every look to the nearest edge in the target plane, m, but at most `reach_m`.
///
/// `looks` are points of the target plane, m, and the ranges there, m; none where nothing is met.
/// `spot_m` is the spot's diameter.
pub(super) fn distances_m(looks: &[(DVec2, Option<f64>)], spot_m: f64, reach_m: f64) -> Vec<f64> {
    let spacing_m = spacing_m(looks);
    let near_m = NEIGHBOURHOOD * spacing_m;
    let all_places: Vec<DVec2> = looks.iter().map(|look| look.0).collect();
    let looks = apart(looks, spacing_m / 4.0);
    let places: Vec<DVec2> = looks.iter().map(|look| look.0).collect();
    let cells = Cells::new(&places, near_m);
    let nearest_across = |number: usize, near: &[u32]| {
        let distance_m2 = |other: &usize| places[*other].distance_squared(places[number]);
        let is_edge = |other: &usize| {
            distance_m2(other) <= near_m * near_m && is_across(looks[number], looks[*other], spot_m)
        };
        let others = near.iter().map(|&other| other as usize).filter(is_edge);
        others.min_by(|a, b| distance_m2(a).total_cmp(&distance_m2(b)))
    };
    let across: Vec<Option<usize>> = cells.map_near(&cells, nearest_across);
    // Only pairs that are nearest to each other; others see past a look on their own side.
    let edge = |(look, other): (usize, &Option<usize>)| {
        let other = (*other)?;
        (across[other] == Some(look)).then(|| 0.5 * (places[look] + places[other]))
    };
    let edges: Vec<DVec2> = across.iter().enumerate().filter_map(edge).collect();
    let distance_m = |number: usize, near: &[u32]| {
        let distance_m2 = |&edge: &u32| edges[edge as usize].distance_squared(all_places[number]);
        let within = near.iter().map(distance_m2).filter(|&m2| m2 <= reach_m * reach_m);
        within.fold(f64::INFINITY, f64::min).sqrt().min(reach_m)
    };
    Cells::new(&all_places, reach_m).map_near(&Cells::new(&edges, reach_m), distance_m)
}

/// One look of each small cell, the first, so that looks on top of each other cost no more than one.
fn apart(looks: &[(DVec2, Option<f64>)], cell_m: f64) -> Vec<(DVec2, Option<f64>)> {
    let places: Vec<DVec2> = looks.iter().map(|look| look.0).collect();
    let cells = Cells::new(&places, cell_m);
    let mut first: Vec<u32> = cells.occupied().map(|points| points[0].1).collect();
    first.sort_unstable();
    first.into_iter().map(|number| looks[number as usize]).collect()
}

fn is_across(a: (DVec2, Option<f64>), b: (DVec2, Option<f64>), spot_m: f64) -> bool {
    match (a.1, b.1) {
        (Some(here_m), Some(there_m)) => {
            (here_m - there_m).abs() > spot_m + STEEPEST * a.0.distance(b.0)
        }
        (None, None) => false,
        _ => true,
    }
}

/// Side of the square that a look has to itself, m; along a line, its share of the line.
fn spacing_m(looks: &[(DVec2, Option<f64>)]) -> f64 {
    let min = looks.iter().fold(DVec2::INFINITY, |min, look| min.min(look.0));
    let max = looks.iter().fold(DVec2::NEG_INFINITY, |max, look| max.max(look.0));
    let (sides_m, count) = ((max - min).max(DVec2::splat(1e-6)), looks.len().max(1) as f64);
    (sides_m.x * sides_m.y / count).sqrt().max(sides_m.max_element() / count)
}

/// Points sorted into square cells, for look-ups within one cell's side.
struct Cells {
    /// The cell and the number of each point, in this order.
    sorted: Vec<([i64; 2], u32)>,
}

impl Cells {
    fn new(points: &[DVec2], side_m: f64) -> Cells {
        let cell = |point: &DVec2| (point / side_m).floor().to_array().map(|x| x as i64);
        let mut sorted: Vec<_> = points.iter().map(cell).zip(0..).collect();
        sorted.par_sort_unstable();
        Cells { sorted }
    }

    /// The points of each cell that has any.
    fn occupied(&self) -> impl Iterator<Item = &[([i64; 2], u32)]> {
        self.sorted.chunk_by(|a, b| a.0 == b.0)
    }

    /// Points in a cell and in the eight around it.
    fn around(&self, [column, row]: [i64; 2]) -> Vec<u32> {
        let in_column = |aside: i64| {
            let [first, last] =
                [-1, 1].map(|up| [column.saturating_add(aside), row.saturating_add(up)]);
            let start = self.sorted.partition_point(|point| point.0 < first);
            let end = self.sorted.partition_point(|point| point.0 <= last);
            self.sorted[start..end].iter().map(|point| point.1)
        };
        [-1, 0, 1].into_iter().flat_map(in_column).collect()
    }

    /// A value for every point, by its number and those of `others`, in cells of the same size, that
    /// may be within one side of it.
    fn map_near<T: Clone + Default + Send>(
        &self,
        others: &Cells,
        value: impl Fn(usize, &[u32]) -> T + Sync,
    ) -> Vec<T> {
        let cells: Vec<&[([i64; 2], u32)]> = self.occupied().collect();
        let in_cell = |points: &&[([i64; 2], u32)]| {
            let near = others.around(points[0].0);
            points.iter().map(|&(_, number)| value(number as usize, &near)).collect()
        };
        let values: Vec<Vec<T>> = cells.par_iter().map(in_cell).collect();
        let mut by_number = vec![T::default(); self.sorted.len()];
        for (&(_, number), value) in self.sorted.iter().zip(values.into_iter().flatten()) {
            by_number[number as usize] = value;
        }
        by_number
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
    fn a_slope_is_no_edge_and_a_lone_look_has_none() {
        let slope = looks(|p| Some(8.0 + 1.5 * p.x));
        assert!(distances_m(&slope, SPOT_M, 0.05).iter().all(|&m| m == 0.05));
        assert_eq!(distances_m(&[(DVec2::ZERO, Some(8.0))], SPOT_M, 0.05), [0.05]);
        assert!(distances_m(&[], SPOT_M, 0.05).is_empty());
    }
}
