//! Which paths of a chirp are one echo to a receiver, and which of several echoes it reports.
//!
//! Echoes within a range cell add up. A surface is one echo, however far a slope spreads its rays in range: what one
//! layer of a target returns parts only at a gap of a cell, and layers part where their mean ranges lie a cell apart.

use std::ops::Range;

use super::path::{Path, sum};
use crate::radar::{Detection, Returns};

/// An echo as a receiver measures it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Measured {
    pub detection: Detection,
    /// Phase of its beat, rad, −π to π; none where it is not asked for.
    pub phase_rad: Option<f64>,
}

/// A detection, and the paths that may have caused it, by their places in the list of a chirp.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Seen {
    pub measured: Measured,
    pub paths: Range<usize>,
}

/// Sorts the paths of a chirp by the echoes that they are parts of, the nearest first, and returns the places of each
/// echo's paths.
pub(super) fn separate(paths: &mut [Path], cell_m: f64) -> Vec<Range<usize>> {
    // One surface in front of or behind the same sheets.
    let layer = |path: &Path| (path.surfaces, path.sheets);
    paths.sort_by(|a, b| layer(a).cmp(&layer(b)).then(a.range_m.total_cmp(&b.range_m)));
    let is_near = |a: &Path, b: &Path| layer(a) == layer(b) && b.range_m - a.range_m < cell_m;
    let mut surfaces: Vec<Vec<Path>> = paths.chunk_by(is_near).map(<[Path]>::to_vec).collect();
    // Surfaces whose mean ranges fall into one cell are one echo.
    surfaces.sort_by(|a, b| sum(a).range_m.total_cmp(&sum(b).range_m));
    let mut echoes: Vec<Vec<Path>> = Vec::new();
    for surface in surfaces {
        match echoes.last_mut() {
            Some(last) if sum(&surface).range_m - sum(last).range_m < cell_m => {
                last.extend(surface);
            }
            _ => echoes.push(surface),
        }
    }
    let mut first = 0;
    let mut places = Vec::with_capacity(echoes.len());
    for echo in echoes {
        paths[first..first + echo.len()].copy_from_slice(&echo);
        places.push(first..first + echo.len());
        first += echo.len();
    }
    places
}

/// Keeps the echoes that a receiver reports; `seen` has them by range.
pub(super) fn choose(seen: &mut Vec<Seen>, returns: Returns, threshold_w: f64) {
    let strongest = |seen: &[Seen]| {
        let powers = seen.iter().map(|seen| seen.measured.detection.power_w).enumerate();
        powers.reduce(|a, b| if b.1 > a.1 { b } else { a }).map(|(place, _)| place)
    };
    let is_detected = |seen: &Seen| seen.measured.detection.power_w >= threshold_w;
    let kept = match returns {
        Returns::All => return,
        Returns::First => seen.iter().position(is_detected).or_else(|| strongest(seen)),
        Returns::Strongest => strongest(seen),
    };
    if let Some(kept) = kept {
        seen.swap(0, kept);
        seen.truncate(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Point;
    use crate::trace::Hit;

    fn path(sheets: u8, range_m: f64, power_w: f64) -> Path {
        let hit = Hit { facet: 0, range_m, point: Point::new(0.0, 0.0, 0.0), cos_theta: 1.0 };
        Path {
            range_m,
            power_w,
            hit,
            sheets,
            passed_share: 1.0,
            delay_m: 0.0,
            pieces: [0; 2],
            surfaces: 1,
            azimuth_rad: 0.0,
            specular_share: 0.0,
            coherent_share: 0.0,
        }
    }

    /// Ranges and powers of the echoes.
    fn echoes(mut paths: Vec<Path>) -> Vec<(f64, f64)> {
        let places = separate(&mut paths, 0.011);
        assert_eq!(places.last().map(|last| last.end), Some(paths.len()));
        places.into_iter().map(|place| sum(&paths[place])).map(|d| (d.range_m, d.power_w)).collect()
    }

    #[test]
    fn echoes_part_at_a_cell() {
        assert_eq!(
            echoes(vec![path(1, 8.0111, 1.0), path(0, 8.0, 2.0)]),
            [(8.0, 2.0), (8.0111, 1.0)]
        );
        let one = echoes(vec![path(1, 8.009, 1.0), path(0, 8.0, 2.0)]);
        assert!(one.len() == 1 && one[0].1 == 3.0 && (one[0].0 - 8.003).abs() < 1e-12, "{one:?}");
    }

    #[test]
    fn a_slope_is_one_echo_and_what_lies_behind_it_another() {
        // A spot on a slope: both layers spread over 50 mm, 20 mm apart.
        let on_slope = |sheets| {
            (0..26).map(move |ray| {
                path(sheets, 8.0 + 0.002 * f64::from(ray) + 0.02 * f64::from(sheets), 1.0)
            })
        };
        let found = echoes(on_slope(0).chain(on_slope(1)).collect());
        assert_eq!(found.len(), 2, "{found:?}");
        assert!((found[1].0 - found[0].0 - 0.02).abs() < 1e-12);
        // An edge in depth parts one layer.
        assert_eq!(echoes(vec![path(0, 8.0, 1.0), path(0, 8.2, 1.0)]).len(), 2);
    }

    #[test]
    fn a_receiver_reports_the_strongest_the_first_or_all() {
        let seen = |power_w: f64| Seen {
            measured: Measured { detection: Detection { range_m: 8.0, power_w }, phase_rad: None },
            paths: 0..1,
        };
        let powers = |returns| {
            let mut echoes = vec![seen(0.1), seen(2.0), seen(3.0)];
            choose(&mut echoes, returns, 1.0);
            echoes.iter().map(|echo| echo.measured.detection.power_w).collect::<Vec<_>>()
        };
        assert_eq!(powers(Returns::Strongest), [3.0]);
        assert_eq!(powers(Returns::First), [2.0]);
        assert_eq!(powers(Returns::All), [0.1, 2.0, 3.0]);
        let mut weak = vec![seen(0.1), seen(0.2)];
        choose(&mut weak, Returns::First, 1.0);
        assert_eq!(weak, [seen(0.2)]);
    }
}
