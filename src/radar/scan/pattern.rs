//! Scan patterns as scene files name them (paper, Sec. II-B and III-B).

use std::f64::consts::TAU;

use glam::DVec3;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

use crate::radar::error::Check;
use crate::radar::mirror::{Mirror, MirrorAngles};

/// Reads a pattern; without the key `pattern` it is the elliptical one.
pub(in crate::radar) fn read<'de, D: Deserializer<'de>>(from: D) -> Result<Pattern, D::Error> {
    let mut table = toml::Table::deserialize(from)?;
    table.entry("pattern").or_insert("elliptical".into());
    table.try_into().map_err(|error: toml::de::Error| D::Error::custom(error.message()))
}

/// Where the rays go.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "pattern", rename_all = "kebab-case")]
pub enum Pattern {
    /// An ellipse drawn fast and carried slowly upwards, figure 1(a) of the paper.
    Elliptical(Elliptical),
    /// Lines from left to right.
    Raster(Raster),
    /// Lines from left to right, evenly spaced in angle.
    AngularRaster(AngularRaster),
    /// Two sines.
    Lissajous(Lissajous),
    /// Outwards from the middle, evenly dense.
    Spiral(Spiral),
    /// A CSV of rays in the global frame: `chirp,time_s,ox_m,oy_m,oz_m,dx,dy,dz`.
    Rays(Explicit),
    /// A CSV of mirror angles: `chirp,time_s,gamma_rad,phi_rad`.
    Angles(Explicit),
}

/// The mechanical scan of the paper: the spinning mirror draws its ellipse, a slow tilt carries it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Elliptical {
    /// Number of chirps N_r, at most 10 million. 18 529: paper, Sec. III-D.
    pub chirps: usize,
    /// Height of the field of view at 8 m, m. 0.9: paper.
    pub field_height_m: f64,
    /// Turns of the mirror during one scan. 80: assumed, it spaces the spots evenly, about 6 mm
    /// along and across.
    pub turns: f64,
}

/// Lines from left to right and, every other one, back; from the bottom to the top.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Raster {
    /// Number of lines.
    pub lines: usize,
    /// Chirps on each line.
    pub chirps_per_line: usize,
    /// Width at 8 m, m.
    pub width_m: f64,
    /// Height at 8 m, m.
    pub height_m: f64,
}

/// Lines from left to right and, every other one, back; from the bottom to the top: directions about the line of sight.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AngularRaster {
    /// Number of lines.
    pub lines: usize,
    /// Chirps on each line.
    pub chirps_per_line: usize,
    /// Azimuth of the first and the last chirp of a line, degrees, to the right of the line of sight.
    pub azimuth_deg: [f64; 2],
    /// Elevation of the first and the last line, degrees, above the line of sight.
    pub elevation_deg: [f64; 2],
}

/// x and y swing as sines of their own frequencies.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Lissajous {
    /// Number of chirps.
    pub chirps: usize,
    /// Width at 8 m, m.
    pub width_m: f64,
    /// Height at 8 m, m.
    pub height_m: f64,
    /// Swings in x during one scan.
    pub x_cycles: f64,
    /// Swings in y during one scan.
    pub y_cycles: f64,
    /// Phase of x at the start, degrees.
    pub phase_deg: f64,
}

/// A spiral whose radius grows as the square root of time, so that the density is even.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Spiral {
    /// Number of chirps.
    pub chirps: usize,
    /// Diameter at 8 m, m.
    pub diameter_m: f64,
    /// Turns from the middle to the rim.
    pub turns: f64,
}

/// Chirps from a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Explicit {
    /// Path of the CSV, relative to the scene's folder.
    pub file: String,
    /// Whether it has every chirp, so that one without a detection was silent. false: only chirps that were detected.
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    pub complete: bool,
}

fn yes() -> bool {
    true
}

fn is_yes(yes: &bool) -> bool {
    *yes
}

impl Default for Elliptical {
    fn default() -> Self {
        Elliptical { chirps: 18_529, field_height_m: 0.9, turns: 80.0 }
    }
}

impl Default for Raster {
    fn default() -> Self {
        Raster { lines: 181, chirps_per_line: 101, width_m: 0.5, height_m: 0.9 }
    }
}

impl Default for AngularRaster {
    /// The field of view of [`Raster`].
    fn default() -> Self {
        AngularRaster {
            lines: 181,
            chirps_per_line: 101,
            azimuth_deg: [-1.8, 1.8],
            elevation_deg: [-3.2, 3.2],
        }
    }
}

impl Default for Lissajous {
    fn default() -> Self {
        Lissajous {
            chirps: 18_529,
            width_m: 0.5,
            height_m: 0.9,
            x_cycles: 83.0,
            y_cycles: 47.0,
            phase_deg: 90.0,
        }
    }
}

impl Default for Spiral {
    fn default() -> Self {
        Spiral { chirps: 18_529, diameter_m: 0.5, turns: 60.0 }
    }
}

impl Default for Pattern {
    fn default() -> Self {
        Pattern::Elliptical(Elliptical::default())
    }
}

impl Pattern {
    pub(in crate::radar) fn checks(&self) -> Vec<Check> {
        let chirps = |name, count: usize| (name, count as f64, (1.0, 1e7));
        let size = |name, size_m| (name, size_m, (1e-4, 100.0));
        let turns = |name, turns| (name, turns, (0.0, 1e6));
        match self {
            Pattern::Elliptical(e) => vec![
                chirps("scan.chirps", e.chirps),
                size("scan.field_height_m", e.field_height_m),
                turns("scan.turns", e.turns),
            ],
            Pattern::Raster(r) => vec![
                chirps("scan.lines", r.lines),
                chirps("scan.chirps_per_line", r.chirps_per_line),
                chirps(
                    "scan.lines × scan.chirps_per_line",
                    r.lines.saturating_mul(r.chirps_per_line),
                ),
                size("scan.width_m", r.width_m),
                size("scan.height_m", r.height_m),
            ],
            Pattern::AngularRaster(r) => {
                let angle = |name, degrees: f64, most: f64| (name, degrees, (-most, most));
                vec![
                    chirps("scan.lines", r.lines),
                    chirps("scan.chirps_per_line", r.chirps_per_line),
                    chirps(
                        "scan.lines × scan.chirps_per_line",
                        r.lines.saturating_mul(r.chirps_per_line),
                    ),
                    angle("scan.azimuth_deg[0]", r.azimuth_deg[0], 180.0),
                    angle("scan.azimuth_deg[1]", r.azimuth_deg[1], 180.0),
                    angle("scan.elevation_deg[0]", r.elevation_deg[0], 90.0),
                    angle("scan.elevation_deg[1]", r.elevation_deg[1], 90.0),
                ]
            }
            Pattern::Lissajous(l) => vec![
                chirps("scan.chirps", l.chirps),
                size("scan.width_m", l.width_m),
                size("scan.height_m", l.height_m),
                turns("scan.x_cycles", l.x_cycles),
                turns("scan.y_cycles", l.y_cycles),
                ("scan.phase_deg", l.phase_deg, (-360.0, 360.0)),
            ],
            Pattern::Spiral(s) => vec![
                chirps("scan.chirps", s.chirps),
                size("scan.diameter_m", s.diameter_m),
                turns("scan.turns", s.turns),
            ],
            Pattern::Rays(_) | Pattern::Angles(_) => Vec::new(),
        }
    }
}

/// The middle of each of `count` equal parts of 0 to 1.
fn progress(count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(move |step| (step as f64 + 0.5) / count as f64)
}

impl Elliptical {
    /// The matrix Ω: tilt and rotation of the mirror for each chirp.
    pub(super) fn angles(&self, mirror: &Mirror, ellipse_height_m: f64) -> Vec<MirrorAngles> {
        let travel_m = (self.field_height_m - ellipse_height_m).max(0.0);
        let tilt_rad = mirror.tilt_for_height_rad(0.5 * travel_m);
        progress(self.chirps)
            .map(|progress| MirrorAngles {
                gamma_rad: (2.0 * progress - 1.0) * tilt_rad,
                phi_rad: TAU * self.turns * progress,
            })
            .collect()
    }
}

impl Raster {
    pub(super) fn target_points_m(&self) -> Vec<[f64; 2]> {
        let mut points_m = Vec::with_capacity(self.lines * self.chirps_per_line);
        for (number, y) in progress(self.lines).enumerate() {
            for x in progress(self.chirps_per_line) {
                // Every other line runs backwards.
                let along = if number.is_multiple_of(2) { x } else { 1.0 - x };
                points_m.push([self.width_m * (along - 0.5), self.height_m * (y - 0.5)]);
            }
        }
        points_m
    }
}

impl AngularRaster {
    /// Directions in the target frame, whose z goes back along the line of sight.
    pub(super) fn directions(&self) -> Vec<DVec3> {
        let mut directions = Vec::with_capacity(self.lines * self.chirps_per_line);
        for (number, line) in steps(self.lines).enumerate() {
            let (up, ahead) = between(self.elevation_deg, line).to_radians().sin_cos();
            for step in steps(self.chirps_per_line) {
                // Every other line runs backwards.
                let along = if number.is_multiple_of(2) { step } else { 1.0 - step };
                let (right, on) = between(self.azimuth_deg, along).to_radians().sin_cos();
                directions.push(DVec3::new(ahead * right, up, -ahead * on));
            }
        }
        directions
    }
}

/// From 0 to 1 in `count` steps, both ends among them; the middle for one.
fn steps(count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(move |step| if count == 1 { 0.5 } else { step as f64 / (count - 1) as f64 })
}

fn between([from, to]: [f64; 2], share: f64) -> f64 {
    from + share * (to - from)
}

impl Lissajous {
    pub(super) fn target_points_m(&self) -> Vec<[f64; 2]> {
        progress(self.chirps)
            .map(|t| {
                let x_rad = TAU * self.x_cycles * t + self.phase_deg.to_radians();
                let y_rad = TAU * self.y_cycles * t;
                [0.5 * self.width_m * x_rad.sin(), 0.5 * self.height_m * y_rad.sin()]
            })
            .collect()
    }
}

impl Spiral {
    pub(super) fn target_points_m(&self) -> Vec<[f64; 2]> {
        progress(self.chirps)
            .map(|t| {
                let (sin, cos) = (TAU * self.turns * t.sqrt()).sin_cos();
                let radius_m = 0.5 * self.diameter_m * t.sqrt();
                [radius_m * cos, radius_m * sin]
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn largest(points: &[[f64; 2]], axis: usize) -> f64 {
        points.iter().map(|p| p[axis].abs()).fold(0.0, f64::max)
    }

    #[test]
    fn every_pattern_fills_its_size() {
        // Half a spot.
        const NEAR_M: f64 = 0.008;
        for (points, [width_m, height_m]) in [
            (Raster::default().target_points_m(), [0.5, 0.9]),
            (Lissajous::default().target_points_m(), [0.5, 0.9]),
            (Spiral::default().target_points_m(), [0.5, 0.5]),
        ] {
            assert!(points.len() > 18_000);
            assert!((largest(&points, 0) - 0.5 * width_m).abs() < NEAR_M);
            assert!((largest(&points, 1) - 0.5 * height_m).abs() < NEAR_M);
        }
    }

    #[test]
    fn a_raster_turns_round_at_the_end_of_a_line() {
        let points =
            Raster { lines: 2, chirps_per_line: 2, width_m: 4.0, height_m: 4.0 }.target_points_m();
        assert_eq!(points, [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]);
    }

    #[test]
    fn an_angular_raster_goes_from_angle_to_angle() {
        let raster = AngularRaster {
            lines: 3,
            chirps_per_line: 2,
            azimuth_deg: [-30.0, 90.0],
            elevation_deg: [0.0, 90.0],
        };
        let directions = raster.directions();
        let expected = [
            DVec3::new(-0.5, 0.0, -0.75_f64.sqrt()),
            DVec3::X,
            DVec3::new(0.5_f64.sqrt(), 0.5_f64.sqrt(), 0.0),
        ];
        for (found, expected) in std::iter::zip(&directions, expected) {
            assert!(found.distance(expected) < 1e-12, "{found}");
        }
        assert!(directions[4].distance(DVec3::Y) < 1e-12 && directions.len() == 6);
        let one = AngularRaster { lines: 1, chirps_per_line: 1, ..raster };
        let middle =
            DVec3::new(0.5 * 0.5_f64.sqrt(), 0.5_f64.sqrt(), -0.75_f64.sqrt() * 0.5_f64.sqrt());
        assert!(one.directions()[0].distance(middle) < 1e-12);
    }

    #[test]
    fn a_spiral_is_evenly_dense() {
        let points = Spiral::default().target_points_m();
        let within = |radius_m: f64| points.iter().filter(|[x, y]| x.hypot(*y) < radius_m).count();
        let quarter = within(0.125) as f64 / points.len() as f64;
        assert!((quarter - 0.25).abs() < 0.001, "{quarter}");
    }
}
