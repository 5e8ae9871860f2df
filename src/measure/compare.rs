//! Compares a simulated scan with a measured one: pixel by pixel, and along a line (paper, Figs. 10
//! to 15).

use super::cloud::Cloud;
use crate::geometry::Raster;
use crate::geometry::raster::Channel;
use crate::radar::{Chirps, Radar};
use crate::render::{Echo, Scan};

/// Agreement of two power images on one grid, in dB: a residual is a ratio of powers.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Agreement {
    /// Pixels with power in both.
    pub both: usize,
    /// Pixels with power in the measured image alone.
    pub only_measured: usize,
    /// Pixels with power in the simulated image alone.
    pub only_simulated: usize,
    /// Mean of simulated less measured over the pixels of both, dB; NaN without any.
    pub bias_db: f64,
    /// Root mean square of that difference, dB.
    pub rmse_db: f64,
    /// Median of its size, dB.
    pub median_size_db: f64,
}

/// A horizontal stripe of the global frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Height of its middle, m.
    pub y_m: f64,
    /// Its height, m.
    pub width_m: f64,
}

/// Converts a measured cloud to a scan, so that it can be drawn like a simulated one. Its echoes have no known cause.
pub fn measured_scan(radar: &Radar, chirps: &Chirps, cloud: &Cloud) -> Scan {
    let frames = radar.frames();
    let (origin, target_from_global) = (frames.origin(), frames.global_from_target.inverse());
    let mut echoes = Vec::with_capacity(cloud.points().len());
    for (number, point) in cloud.points().iter().enumerate() {
        let in_target = target_from_global * point.point;
        echoes.push(Echo {
            rank: 1,
            chirp: point.chirp.unwrap_or(number as u32),
            point: point.point,
            range_m: point.range_m.unwrap_or(origin.distance_m(point.point)),
            xt_m: in_target.xyz.x,
            yt_m: in_target.xyz.y,
            power_w: point.power_w,
            phase_rad: None,
            truth: None,
        });
    }
    Scan {
        chirps: chirps.rays.len(),
        hits: cloud.points().len(),
        echoes,
        threshold_w: 0.0,
        noise_w: None,
    }
}

/// Simulated less measured power, dB, as channel `difference_db` (NaN where either has none), and the
/// agreement. Both images must be on the same grid, as [`power_image`](crate::render::power_image)
/// draws them for one scene.
pub fn difference(measured: &Raster, simulated: &Raster) -> (Raster, Agreement) {
    let [measured_dbm, simulated_dbm] = [measured, simulated].map(power_dbm);
    let values: Vec<f32> =
        std::iter::zip(measured_dbm, simulated_dbm).map(|(m, s)| s - m).collect();
    let both: Vec<f64> = values.iter().filter(|v| v.is_finite()).map(|&v| f64::from(v)).collect();
    let mut sizes: Vec<f64> = both.iter().map(|d| d.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let count = both.len() as f64;
    let agreement = Agreement {
        both: both.len(),
        only_measured: count_of_first(measured_dbm, simulated_dbm),
        only_simulated: count_of_first(simulated_dbm, measured_dbm),
        bias_db: both.iter().sum::<f64>() / count,
        rmse_db: (both.iter().map(|d| d * d).sum::<f64>() / count).sqrt(),
        median_size_db: sizes.get(sizes.len() / 2).copied().unwrap_or(f64::NAN),
    };
    let channel = Channel { name: "difference_db".to_owned(), values };
    let raster = Raster { channels: vec![channel], ..measured.clone() };
    (raster, agreement)
}

fn power_dbm(raster: &Raster) -> &[f32] {
    raster.channel("power_dbm").unwrap_or_default()
}

/// Pixels that have power in the first image alone.
fn count_of_first(first_dbm: &[f32], second_dbm: &[f32]) -> usize {
    let pixels = std::iter::zip(first_dbm, second_dbm);
    pixels.filter(|(first, second)| first.is_finite() && !second.is_finite()).count()
}

/// The detections within a line from left to right: x in the global frame, m, and received power, W.
pub fn power_along(scan: &Scan, line: Line) -> Vec<(f64, f64)> {
    let mut points: Vec<(f64, f64)> = scan
        .detections()
        .filter(|echo| (echo.point.xyz.y - line.y_m).abs() <= 0.5 * line.width_m)
        .map(|echo| (echo.point.xyz.x, echo.power_w))
        .collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Point;
    use crate::measure::cloud::CloudPoint;

    fn raster(values: [f32; 4]) -> Raster {
        let channels = vec![Channel { name: "power_dbm".to_owned(), values: values.to_vec() }];
        Raster { width: 2, height: 2, x_min_m: 0.0, y_min_m: 0.0, pixel_m: 1.0, channels }
    }

    #[test]
    fn pixels_of_both_give_the_error_and_the_others_are_counted() {
        let measured = raster([-50.0, -60.0, f32::NAN, -70.0]);
        let simulated = raster([-47.0, -61.0, -50.0, f32::NAN]);
        let (image, found) = difference(&measured, &simulated);
        assert_eq!((found.both, found.only_measured, found.only_simulated), (2, 1, 1));
        assert!((found.bias_db - 1.0).abs() < 1e-9);
        assert!((found.rmse_db - 5f64.sqrt()).abs() < 1e-9);
        assert_eq!(image.channel("difference_db").unwrap()[0], 3.0);
    }

    #[test]
    fn images_without_a_common_pixel_have_no_error() {
        let (_, found) = difference(&raster([f32::NAN; 4]), &raster([-50.0; 4]));
        assert_eq!(found.both, 0);
        assert!(found.rmse_db.is_nan() && found.bias_db.is_nan());
    }

    #[test]
    fn a_line_holds_what_lies_within_it_from_left_to_right() {
        let radar = Radar::default();
        let point = |x, y, power_w| CloudPoint {
            chirp: None,
            point: Point::new(x, y, 0.0),
            range_m: None,
            power_w,
        };
        let points = vec![point(0.1, 1.105, 1e-7), point(-0.1, 1.095, 1e-8), point(0.0, 1.2, 1e-9)];
        let cloud = Cloud::new(points).unwrap();
        let scan = measured_scan(&radar, &Chirps::default(), &cloud);
        let line = power_along(&scan, Line { y_m: 1.1, width_m: 0.02 });
        assert_eq!(line, [(-0.1, 1e-8), (0.1, 1e-7)]);
        assert!((scan.echoes[2].yt_m - 0.1).abs() < 1e-12);
        assert!((scan.echoes[2].range_m - 8.0f64.hypot(0.1)).abs() < 1e-12);
    }
}
