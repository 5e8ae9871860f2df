//! Where something unknown is strongest in the target plane.

use super::raster::{empty, filled, pixel_m};
use crate::diagnose::Row;
use crate::formats::words::{fixed, signed};

/// A place in the target plane where something unknown is strong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// x, m.
    pub x_m: f64,
    /// y, m.
    pub y_m: f64,
    /// Power that the model lacks there, in the mean of a pixel, dB.
    pub db: f64,
}

/// Most places that are reported.
const MOST_PLACES: usize = 3;
/// Least distance between two of them, pixels.
const APART: f64 = 4.0;
/// Least strength of a place as a share of the strongest.
const AS_STRONG: f64 = 0.5;

/// Where the unknown is strongest, the strongest first; empty where nothing is unknown.
pub(super) fn strongest(rows: &[Row], spot_m: f64) -> Vec<Peak> {
    let pixel_m = pixel_m(rows, spot_m);
    let map = filled(&empty(rows, pixel_m), rows, |row| Some(row.unknown_db));
    let values = map.channels.first().map_or(&[][..], |channel| &channel.values);
    let mut peaks = Vec::new();
    for (index, &db) in values.iter().enumerate() {
        if db.abs() > 0.0 {
            peaks.push(Peak {
                x_m: map.x_min_m + (0.5 + (index % map.width) as f64) * pixel_m,
                y_m: map.y_min_m + (map.height as f64 - 0.5 - (index / map.width) as f64) * pixel_m,
                db: f64::from(db),
            });
        }
    }
    peaks.sort_by(|a, b| b.db.abs().total_cmp(&a.db.abs()));
    let mut places: Vec<Peak> = Vec::new();
    for peak in peaks {
        let is_weak = places.first().is_some_and(|p| peak.db.abs() < AS_STRONG * p.db.abs());
        if places.len() == MOST_PLACES || is_weak {
            break;
        }
        if places.iter().all(|other| peak.distance_m(other) >= APART * pixel_m) {
            places.push(peak);
        }
    }
    places
}

impl Peak {
    fn distance_m(&self, other: &Peak) -> f64 {
        (self.x_m - other.x_m).hypot(self.y_m - other.y_m)
    }
}

/// The places in a clause; `None` where there are none.
pub(super) fn words(places: &[Peak]) -> Option<String> {
    if places.is_empty() {
        return None;
    }
    let mut words = Vec::new();
    for Peak { x_m, y_m, db } in places {
        let (x, y) = (fixed(*x_m, 2), fixed(*y_m, 2));
        words.push(format!("{} dB at x = {x} m, y = {y} m", signed(*db, 1)));
    }
    Some(format!("strongest in the target plane: {}", words.join("; ")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::cloud::testing::{row, square};

    #[test]
    fn the_strongest_places_are_apart() {
        let rows = square(|x_m, y_m| match [x_m, y_m].map(|at| at < 0.02) {
            [true, true] => 4.0,
            [false, true] if x_m > 0.36 => -3.0,
            _ => 0.2,
        });
        let places = strongest(&rows, 0.016);
        let [first, second] = places[..] else { panic!("{places:?}") };
        assert!(first.db > 3.0 && first.x_m < 0.03 && first.y_m < 0.03, "{first:?}");
        assert!(second.db < -2.0 && second.x_m > 0.35 && second.y_m < 0.03, "{second:?}");
        assert_eq!(strongest(&[row()], 0.016), []);
        assert_eq!(words(&[]), None);
    }
}
