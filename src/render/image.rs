//! Detections on a regular grid of the target plane.

use std::ops::Range;

use num_complex::Complex;
use rayon::prelude::*;

use super::echo::Echo;
use super::scan::Scan;
use crate::geometry::Raster;
use crate::geometry::raster::Channel;
use crate::radar::Field;
use crate::units::dbm_from_watts;

/// Names of the channels of a power image, in order.
pub const CHANNELS: [&str; 5] = ["power_dbm", "range_m", "incidence_deg", "material", "count"];

/// Number of bands of rows that are filled in parallel.
const BANDS: usize = 16;

/// A detection, its contribution to every pixel of its spot, and the pixels that the spot may cover.
struct Splat<'a> {
    echo: &'a Echo,
    power_w: f64,
    /// Incidence angle, rad; `None` for a false alarm.
    incidence_rad: Option<f64>,
    material: Option<u16>,
    /// Columns that its spot may cover.
    columns: Range<usize>,
    /// Rows that its spot may cover, counted from the top.
    rows: Range<usize>,
}

/// Weighted sums over the detections whose spots cover a pixel.
#[derive(Clone, Copy, Default)]
struct Pixel {
    weight: f64,
    power_w: f64,
    range_m: f64,
    incidence_rad: f64,
    /// Total weight of the detections that are not false alarms.
    known_weight: f64,
    nearest_weight: f64,
    material: Option<u16>,
    /// Of the nearest detection, √W.
    amplitude: Option<Complex<f64>>,
    count: u32,
}

/// Draws the power image of a scan: the channels [`CHANNELS`] over x_t and y_t, NaN where nothing was detected.
///
/// A pixel is the mean of the detections whose spots cover it, each with a Gaussian weight whose full width at half
/// maximum is the spot's diameter. Power is averaged in watts. `material` is the index of the material of the nearest
/// detection; with phases, `real_sqrt_w` and `imaginary_sqrt_w` are its amplitude, √W. `count` is the number of detections. Of several echoes of one chirp the strongest is drawn. The grid covers `field`, the field of view at 8 m, and a margin of
/// half a spot.
pub fn power_image(
    scan: &Scan,
    field: Field,
    spot_m: f64,
    material_of_region: &[u16],
    pixel_m: f64,
) -> Raster {
    let mut raster = grid(field, spot_m, pixel_m);
    let mut pixels = vec![Pixel::default(); raster.width * raster.height];
    let detections: Vec<&Echo> = scan.detections().filter(|echo| echo.rank == 1).collect();
    let splats = detections.par_iter();
    let splats: Vec<Splat> =
        splats.map(|&echo| Splat::new(echo, &raster, spot_m, material_of_region)).collect();
    // Every band adds up its detections in the order of the scan, so that the sums do not depend on the threads.
    let band_rows = raster.height.div_ceil(BANDS);
    let of_bands = by_bands(&splats, band_rows);
    let bands = pixels.par_chunks_mut(raster.width * band_rows).enumerate();
    bands.zip(of_bands).for_each(|((band, pixels), splats)| {
        let first = band * band_rows;
        for splat in splats {
            for (index, distance_m) in splat.covered(&raster, spot_m, first..first + band_rows) {
                let weight = (-4.0 * std::f64::consts::LN_2 * (distance_m / spot_m).powi(2)).exp();
                pixels[index - first * raster.width].add(splat, weight);
            }
        }
    });
    let with_phases = detections.iter().any(|echo| echo.phase_rad.is_some());
    raster.channels = channels(&pixels, with_phases);
    raster
}

/// An empty raster that covers a field and half a spot around it. Pixel edges are multiples of the pixel's side.
fn grid(field: Field, spot_m: f64, pixel_m: f64) -> Raster {
    // Excess of the field over the edge of a pixel, in pixels, that counts as rounding.
    const HAIR: f64 = 1e-6;
    let first = field.min_m.map(|min_m| ((min_m - spot_m / 2.0) / pixel_m + HAIR).floor());
    let end = field.max_m.map(|max_m| ((max_m + spot_m / 2.0) / pixel_m - HAIR).ceil());
    let [width, height] = [0, 1].map(|axis| (end[axis] - first[axis]).max(1.0) as usize);
    let [x_min_m, y_min_m] = first.map(|first| first * pixel_m);
    Raster { width, height, x_min_m, y_min_m, pixel_m, channels: Vec::new() }
}

/// For each band of `band_rows` rows the detections whose spots may reach into it, in order.
fn by_bands<'a, 'e>(splats: &'a [Splat<'e>], band_rows: usize) -> [Vec<&'a Splat<'e>>; BANDS] {
    let mut of_bands = [const { Vec::new() }; BANDS];
    for splat in splats {
        let bands = splat.rows.start / band_rows..splat.rows.end.div_ceil(band_rows);
        bands.for_each(|band| of_bands[band].push(splat));
    }
    of_bands
}

impl<'a> Splat<'a> {
    fn new(echo: &'a Echo, raster: &Raster, spot_m: f64, material_of_region: &[u16]) -> Splat<'a> {
        let [rows, columns] = raster.span_near([echo.xt_m, echo.yt_m], spot_m / 2.0);
        Splat {
            echo,
            power_w: echo.power_w,
            incidence_rad: echo.truth.map(|truth| truth.hit.theta_rad()),
            material: echo.truth.map(|truth| material_of_region[usize::from(truth.region)]),
            columns,
            rows,
        }
    }

    /// The pixels in some rows whose centres lie within the spot, with their distances from its centre, m.
    fn covered(
        &self,
        raster: &Raster,
        spot_m: f64,
        rows: Range<usize>,
    ) -> impl Iterator<Item = (usize, f64)> {
        let rows = self.rows.start.max(rows.start)..self.rows.end.min(rows.end);
        let place = [self.echo.xt_m, self.echo.yt_m];
        raster.pixels_near(place, spot_m / 2.0, [rows, self.columns.clone()])
    }
}

impl Pixel {
    fn add(&mut self, splat: &Splat, weight: f64) {
        self.weight += weight;
        self.power_w += weight * splat.power_w;
        self.range_m += weight * splat.echo.range_m;
        self.count += 1;
        if let Some(incidence_rad) = splat.incidence_rad {
            self.known_weight += weight;
            self.incidence_rad += weight * incidence_rad;
        }
        if weight > self.nearest_weight {
            self.nearest_weight = weight;
            self.material = splat.material;
            let echo = splat.echo;
            self.amplitude =
                echo.phase_rad.map(|phase_rad| Complex::from_polar(echo.power_w.sqrt(), phase_rad));
        }
    }
}

/// A part of an amplitude.
type Part = fn(Complex<f64>) -> f64;
/// The channels of a nearest detection's amplitude, for scans with phases.
const AMPLITUDE: [(&str, Part); 2] =
    [("real_sqrt_w", |amplitude| amplitude.re), ("imaginary_sqrt_w", |amplitude| amplitude.im)];

fn channels(pixels: &[Pixel], with_phases: bool) -> Vec<Channel> {
    let values: [fn(&Pixel) -> f64; 5] = [
        |p| dbm_from_watts(p.power_w / p.weight),
        |p| p.range_m / p.weight,
        |p| (p.incidence_rad / p.known_weight).to_degrees(),
        |p| p.material.map_or(f64::NAN, f64::from),
        |p| f64::from(p.count),
    ];
    let mut channels = Vec::new();
    for (name, value) in CHANNELS.into_iter().zip(values) {
        let values = pixels.iter().map(|p| if p.count == 0 { f32::NAN } else { value(p) as f32 });
        channels.push(Channel { name: name.to_owned(), values: values.collect() });
    }
    if with_phases {
        for (name, part) in AMPLITUDE {
            let values = pixels.iter().map(|p| p.amplitude.map_or(f32::NAN, |a| part(a) as f32));
            channels.push(Channel { name: name.to_owned(), values: values.collect() });
        }
    }
    channels
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Point;
    use crate::render::Truth;
    use crate::trace::Hit;
    use crate::units::watts_from_dbm;

    fn echo(xt_m: f64, yt_m: f64, power_dbm: f64) -> Echo {
        let point = Point::new(xt_m, yt_m, 0.0);
        let hit = Hit { facet: 0, range_m: 8.0, point, cos_theta: 0.5 };
        let truth = Truth {
            hit,
            mean_power_w: watts_from_dbm(power_dbm),
            region: 0,
            theta_sd_rad: 0.0,
            azimuth_rad: 0.0,
            sheets: 0,
            passed_share: 1.0,
            surfaces: 1,
            specular_share: 0.0,
            edge_m: 0.0,
        };
        let power_w = watts_from_dbm(power_dbm);
        Echo {
            chirp: 0,
            point,
            range_m: 8.0,
            xt_m,
            yt_m,
            power_w,
            phase_rad: None,
            rank: 1,
            truth: Some(truth),
        }
    }

    fn image(echoes: Vec<Echo>) -> Raster {
        let scan =
            Scan { chirps: 0, hits: 0, echoes, threshold_w: watts_from_dbm(-77.0), noise_w: None };
        let field = Field { min_m: [-0.25, -0.45], max_m: [0.25, 0.45] };
        power_image(&scan, field, 0.016, &[3], 0.004)
    }

    #[test]
    fn the_grid_covers_the_field_of_view_and_half_a_spot() {
        let raster = image(vec![]);
        // 0.258 m and 0.458 m are 64.5 and 114.5 pixels.
        assert_eq!((raster.width, raster.height), (130, 230));
        assert!((raster.x_min_m + 0.26).abs() < 1e-12);
        assert!(raster.channels.iter().all(|c| c.values.iter().all(|v| v.is_nan())));
    }

    #[test]
    fn one_detection_fills_its_spot_with_its_own_values() {
        let raster = image(vec![echo(0.1, -0.2, -50.0)]);
        let power = raster.channel("power_dbm").unwrap();
        let mut filled = 0;
        for row in 0..raster.height {
            for column in 0..raster.width {
                let distance = (raster.x_m(column) - 0.1).hypot(raster.y_m(row) + 0.2);
                let value = power[row * raster.width + column];
                assert_eq!(distance <= 0.008, value.is_finite());
                if value.is_finite() {
                    filled += 1;
                    assert!((value + 50.0).abs() < 1e-4);
                }
            }
        }
        // The area of the spot over that of a pixel: π·8²/4² = 12.6.
        assert!((10..=15).contains(&filled), "{filled}");
        let value = |name| raster.channel(name).unwrap().iter().find(|v| v.is_finite()).copied();
        assert_eq!(value("material"), Some(3.0));
        assert_eq!(value("count"), Some(1.0));
        assert!((value("incidence_deg").unwrap() - 60.0).abs() < 1e-4);
    }

    #[test]
    fn a_false_alarm_has_power_and_range_and_nothing_else() {
        let raster = image(vec![Echo { truth: None, ..echo(0.1, -0.2, -50.0) }]);
        let known = |name| raster.channel(name).unwrap().iter().any(|v| v.is_finite());
        assert!(known("power_dbm") && known("range_m") && known("count"));
        assert!(!known("material") && !known("incidence_deg"));
    }

    #[test]
    fn power_is_averaged_in_watts() {
        let raster = image(vec![echo(0.0, 0.002, -40.0), echo(0.004, 0.002, -60.0)]);
        // Half way between two equal weights: 10·lg((10⁻⁴ + 10⁻⁶)/2) = −42.967 dBm.
        let (row, column) = (114, 65);
        assert!((raster.x_m(column) - 0.002).abs() < 1e-12);
        assert!((raster.y_m(row) - 0.002).abs() < 1e-12);
        let value = raster.channel("power_dbm").unwrap()[row * raster.width + column];
        assert!((f64::from(value) + 42.967).abs() < 1e-3, "{value}");
    }

    #[test]
    fn of_several_echoes_of_a_chirp_the_strongest_is_drawn() {
        let weaker = Echo { rank: 2, ..echo(0.0, 0.0, -60.0) };
        let raster = image(vec![weaker, echo(0.0, 0.0, -40.0)]);
        let drawn = raster.channel("power_dbm").unwrap().iter().filter(|value| value.is_finite());
        assert!(
            drawn.clone().count() > 0 && drawn.clone().all(|value| (value + 40.0).abs() < 1e-4)
        );
    }

    #[test]
    fn what_is_below_the_threshold_or_outside_leaves_no_trace() {
        let raster =
            image(vec![echo(0.0, 0.0, -77.1), echo(5.0, 0.0, -40.0), echo(0.0, -9.0, -40.0)]);
        assert!(raster.channels[0].values.iter().all(|v| v.is_nan()));
    }
}
