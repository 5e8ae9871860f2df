//! Rows for the tests of pictures.

use crate::diagnose::Row;
use crate::frames::Point;

/// Shots 4 mm apart in a square of 0.4 m, with what is unknown at each place, dB.
pub(in crate::report) fn square(unknown_db: impl Fn(f64, f64) -> f64) -> Vec<Row> {
    let at_m = |i: u32| 0.004 * f64::from(i);
    let places = (0..10_000).map(|i| (at_m(i % 100), at_m(i / 100)));
    places.map(|(x, y)| Row { xt_m: x, yt_m: y, unknown_db: unknown_db(x, y), ..row() }).collect()
}

/// A shot with usual values.
pub(in crate::report) fn row() -> Row {
    Row {
        scan: 0,
        chirp: 0,
        observed_w: Some(1e-9),
        before_w: 1e-9,
        after_w: 1e-9,
        z_before: 0.0,
        z_after: 0.0,
        fold: 0,
        theta_rad: 0.2,
        azimuth_rad: 0.0,
        range_m: 8.0,
        measured_range_m: Some(8.0),
        point: Some(Point::new(0.0, 1.1, 0.0)),
        rank: None,
        range_residual_m: Some(0.0),
        xt_m: 0.0,
        yt_m: 0.0,
        edge_m: 0.048,
        time_s: 0.0,
        region: 0,
        unknown_db: 0.0,
    }
}
