//! The shots of a scan as pixels of the target plane.

use crate::diagnose::Row;
use crate::geometry::Raster;
use crate::geometry::raster::Channel;

/// Name of the only channel.
pub(in crate::report) const CHANNEL: &str = "residual";

/// Shots in a pixel, in the mean, from which speckle does not hide the rest.
const SHOTS_PER_PIXEL: f64 = 8.0;

/// A value of a shot; none where it has no such value.
pub(super) type Pick = fn(&Row) -> Option<f64>;

/// The target plane of a radar.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    /// Diameter of the spot, m.
    pub spot_m: f64,
    /// Range of the plane, m.
    pub range_m: f64,
}

/// Side of a pixel, m: a spot, or more where the scan is sparse.
pub(super) fn pixel_m(rows: &[Row], spot_m: f64) -> f64 {
    let mut cells: Vec<[i64; 2]> = Vec::with_capacity(rows.len());
    for row in rows {
        cells.push([row.xt_m, row.yt_m].map(|x| (x / spot_m).floor() as i64));
    }
    cells.sort_unstable();
    cells.dedup();
    let shots = rows.len() as f64 / cells.len().max(1) as f64;
    let pixel_m = spot_m * (SHOTS_PER_PIXEL / shots.max(1e-3)).sqrt().max(1.0);
    // Whole millimetres, so that a caption states it exactly.
    (1e3 * pixel_m).round().max(1.0) * 1e-3
}

/// A raster without channels around all shots.
pub(super) fn empty(rows: &[Row], pixel_m: f64) -> Raster {
    let (x_min_m, width) = axis(rows.iter().map(|row| row.xt_m), pixel_m);
    let (y_min_m, height) = axis(rows.iter().map(|row| row.yt_m), pixel_m);
    Raster { width, height, x_min_m, y_min_m, pixel_m, channels: Vec::new() }
}

/// First edge, m, and number of the pixels along an axis.
fn axis(values_m: impl Iterator<Item = f64>, pixel_m: f64) -> (f64, usize) {
    // What a scan of a metre needs many times over; a stray shot must not ask for more memory.
    const MOST_PIXELS: f64 = 1000.0;
    let [mut low_m, mut high_m] = [f64::INFINITY, f64::NEG_INFINITY];
    for value_m in values_m.filter(|x| x.is_finite()) {
        (low_m, high_m) = (low_m.min(value_m), high_m.max(value_m));
    }
    // A pixel more at each side keeps the target off the frame.
    let first = (low_m / pixel_m).floor() - 1.0;
    let count = ((high_m / pixel_m).floor() - first + 2.0).clamp(1.0, MOST_PIXELS);
    (first * pixel_m, count as usize)
}

/// The mean of a value over the shots of every pixel; NaN where there is none.
pub(super) fn filled(empty: &Raster, rows: &[Row], pick: Pick) -> Raster {
    let mut sums = vec![(0.0, 0u32); empty.width * empty.height];
    for row in rows {
        let column = ((row.xt_m - empty.x_min_m) / empty.pixel_m).floor();
        let up = ((row.yt_m - empty.y_min_m) / empty.pixel_m).floor();
        let is_inside =
            (0.0..empty.width as f64).contains(&column) && (0.0..empty.height as f64).contains(&up);
        let Some(value) = pick(row).filter(|_| is_inside) else { continue };
        let index = (empty.height - 1 - up as usize) * empty.width + column as usize;
        if let Some((sum, count)) = sums.get_mut(index) {
            (*sum, *count) = (*sum + value, *count + 1);
        }
    }
    let values = sums.into_iter().map(|(sum, count)| (sum / f64::from(count)) as f32).collect();
    let channels = vec![Channel { name: CHANNEL.to_owned(), values }];
    Raster { channels, ..empty.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::cloud::testing::row;

    #[test]
    fn a_pixel_is_the_mean_of_its_shots_and_upright() {
        let at = |xt_m, yt_m, observed_w| Row { xt_m, yt_m, observed_w, ..row() };
        let rows =
            [at(0.005, 0.005, Some(1.0)), at(0.006, 0.004, Some(2.0)), at(0.035, 0.025, None)];
        let around = empty(&rows, 0.01);
        assert_eq!((around.width, around.height), (6, 5));
        let map = filled(&around, &rows, |row| row.observed_w);
        let values = map.channel(CHANNEL).unwrap();
        // The lowest row but the margin's is the last but one.
        assert_eq!(values[3 * 6 + 1], 1.5);
        assert_eq!(values.iter().filter(|v| v.is_nan()).count(), 29);
    }

    #[test]
    fn a_sparse_scan_has_larger_pixels() {
        let mut sides_m = Vec::new();
        for step_m in [0.004, 0.016] {
            let mut rows = Vec::new();
            for i in 0..10_000 {
                let (xt_m, yt_m) = (step_m * f64::from(i % 100), step_m * f64::from(i / 100));
                rows.push(Row { xt_m, yt_m, ..row() });
            }
            sides_m.push(pixel_m(&rows, 0.016));
        }
        assert_eq!(sides_m[0], 0.016);
        assert!((sides_m[1] / 0.016 - 8f64.sqrt()).abs() < 0.1);
    }
}
