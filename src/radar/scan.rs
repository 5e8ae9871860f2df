//! Scan patterns: where each chirp looks (paper, Sec. II-B and III-B).

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use super::preset::Check;
use super::{Radar, RadarError};
use crate::frames::{Global, Point, Ray, target_z_m};

/// Range at which a pattern is drawn in the target plane, m (paper, Sec. III-B).
pub const PATTERN_RANGE_M: f64 = 8.0;

/// Where the rays go.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "pattern", rename_all = "kebab-case")]
pub enum Pattern {
    /// An ellipse drawn fast and carried slowly upwards, figure 1(a) of the paper.
    Elliptical(Elliptical),
}

/// The mechanical scan of the paper: a spinning mirror draws an ellipse, a slow tilt carries it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Elliptical {
    /// Number of chirps N_r, at most 10 million. 18 529: paper, Sec. III-D.
    pub chirps: usize,
    /// Horizontal axis of the ellipse at 8 m, m. 0.5: paper.
    pub ellipse_width_m: f64,
    /// Vertical axis of the ellipse at 8 m, m. 0.4: paper.
    pub ellipse_height_m: f64,
    /// Height of the field of view at 8 m, m. 0.9: paper.
    pub field_height_m: f64,
    /// Turns of the mirror during one scan. 80: assumed, it spaces the spots evenly, about 6 mm
    /// along and across.
    pub turns: f64,
}

impl Default for Elliptical {
    fn default() -> Self {
        Elliptical {
            chirps: 18_529,
            ellipse_width_m: 0.5,
            ellipse_height_m: 0.4,
            field_height_m: 0.9,
            turns: 80.0,
        }
    }
}

impl Default for Pattern {
    fn default() -> Self {
        Pattern::Elliptical(Elliptical::default())
    }
}

impl Pattern {
    /// Points of the target plane at 8 m, one per chirp, m.
    pub fn target_points_m(&self) -> Vec<[f64; 2]> {
        match self {
            Pattern::Elliptical(ellipse) => ellipse.target_points_m(),
        }
    }

    /// Width and height of the field of view at 8 m, centred on the target frame's origin, m.
    pub fn field_m(&self) -> [f64; 2] {
        match self {
            Pattern::Elliptical(e) => [e.ellipse_width_m, e.field_height_m],
        }
    }

    /// Number of chirps N_r.
    pub fn chirps(&self) -> usize {
        match self {
            Pattern::Elliptical(ellipse) => ellipse.chirps,
        }
    }

    pub(super) fn checks(&self) -> Vec<Check> {
        let Pattern::Elliptical(e) = self;
        vec![
            ("scan.chirps", e.chirps as f64, (1.0, 1e7)),
            ("scan.ellipse_width_m", e.ellipse_width_m, (1e-4, 100.0)),
            ("scan.ellipse_height_m", e.ellipse_height_m, (1e-4, 100.0)),
            ("scan.field_height_m", e.field_height_m, (e.ellipse_height_m, 100.0)),
            ("scan.turns", e.turns, (0.0, 1e6)),
        ]
    }
}

impl Elliptical {
    fn target_points_m(&self) -> Vec<[f64; 2]> {
        let travel_m = self.field_height_m - self.ellipse_height_m;
        (0..self.chirps)
            .map(|chirp| {
                let progress = (chirp as f64 + 0.5) / self.chirps as f64;
                let (sin, cos) = (TAU * self.turns * progress).sin_cos();
                [
                    0.5 * self.ellipse_width_m * cos,
                    0.5 * self.ellipse_height_m * sin + travel_m * (progress - 0.5),
                ]
            })
            .collect()
    }
}

impl Radar {
    /// One ray per chirp, from the centre of the main reflector through the pattern at R = 8 m.
    ///
    /// # Errors
    /// [`RadarError::OutOfReach`] when equation (2) has no real root for a chirp.
    pub fn rays(&self) -> Result<Vec<Ray<Global>>, RadarError> {
        let frames = self.frames();
        let origin = frames.origin();
        let ray = |(chirp, [xt_m, yt_m]): (usize, [f64; 2])| {
            let range_m = PATTERN_RANGE_M;
            target_z_m(xt_m, yt_m, range_m, frames.reflector_centre)
                .and_then(|zt_m| {
                    origin.towards(frames.global_from_target * Point::new(xt_m, yt_m, zt_m))
                })
                .map(|direction| Ray { origin, direction })
                .ok_or(RadarError::OutOfReach { chirp, xt_m, yt_m, range_m })
        };
        self.scan.target_points_m().into_iter().enumerate().map(ray).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ellipse_fills_the_papers_field_of_view() {
        let points = Pattern::default().target_points_m();
        assert_eq!(points.len(), 18_529);
        let largest = |axis: usize| points.iter().map(|p| p[axis].abs()).fold(0.0, f64::max);
        // Half a spot: the last turn peaks a little before the tilt ends.
        const HALF_SPOT_M: f64 = 0.008;
        assert!((largest(0) - 0.25).abs() < HALF_SPOT_M);
        assert!((largest(1) - 0.45).abs() < HALF_SPOT_M);
    }

    #[test]
    fn every_ray_starts_at_the_reflector_and_crosses_its_point() {
        let radar = Radar::default();
        let rays = radar.rays().unwrap();
        let first = radar.scan.target_points_m()[0];
        let frames = radar.frames();
        let at_8m: Point<Global> =
            (rays[0].origin.xyz + PATTERN_RANGE_M * rays[0].direction.xyz()).into();
        let in_target = frames.global_from_target.inverse() * at_8m;
        assert!((in_target.xyz.truncate() - glam::DVec2::from(first)).length() < 1e-12);
    }

    #[test]
    fn a_scan_beyond_the_reach_of_the_range_is_refused() {
        let ellipse = Elliptical { ellipse_width_m: 40.0, ..Default::default() };
        let radar = Radar { scan: Pattern::Elliptical(ellipse), ..Default::default() };
        assert!(matches!(radar.rays(), Err(RadarError::OutOfReach { .. })));
    }
}
