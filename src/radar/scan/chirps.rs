//! The chirps of a scan: one ray each, and when.

use glam::DVec2;

use crate::frames::{Global, Point, Ray};
use crate::radar::frames::RadarFrames;
use crate::radar::mirror::MirrorAngles;

/// The chirps of a scan, in the order they are sent. All lists have one entry per chirp.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chirps {
    /// Number of the chirp: from 0, or as an explicit file gives it.
    pub number: Vec<u32>,
    /// Time of the chirp, s; 0 throughout where it is not known.
    pub time_s: Vec<f64>,
    /// Where it looks.
    pub rays: Vec<Ray<Global>>,
    /// The mirror's angles, for scans that a mirror makes; empty otherwise.
    pub mirror: Vec<MirrorAngles>,
    /// Whether these are only the chirps that were detected, and nothing is known of the silent ones.
    pub only_detected: bool,
    /// What a person should know of the file the chirps came from.
    pub notices: Vec<String>,
}

/// A rectangle of the target plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Field {
    /// Smallest x_t and y_t, m.
    pub min_m: [f64; 2],
    /// Largest x_t and y_t, m.
    pub max_m: [f64; 2],
}

impl Chirps {
    /// Share of the scan that is over at every chirp, 0 to 1: by time, or by its place where no two
    /// chirps differ in time.
    ///
    /// ```
    /// let chirps = matdb::radar::Chirps { time_s: vec![2.0, 6.0, 5.0], ..Default::default() };
    /// assert_eq!(chirps.progress(), [0.0, 1.0, 0.75]);
    /// ```
    pub fn progress(&self) -> Vec<f64> {
        let first = self.time_s.iter().copied().fold(f64::INFINITY, f64::min);
        let last = self.time_s.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if last > first {
            return self.time_s.iter().map(|time_s| (time_s - first) / (last - first)).collect();
        }
        let most = self.rays.len().saturating_sub(1).max(1) as f64;
        (0..self.rays.len()).map(|index| index as f64 / most).collect()
    }

    /// Whether chirps differ in time, so that a dependence on time can be found.
    pub fn is_timed(&self) -> bool {
        self.time_s.windows(2).any(|pair| pair[0] != pair[1])
    }

    /// (x_t, y_t) of each ray at the range of the pattern from its origin, m.
    pub fn target_points_m(&self, frames: &RadarFrames) -> impl Iterator<Item = DVec2> {
        let target_from_global = frames.global_from_target.inverse();
        let range_m = frames.pattern_range_m;
        self.rays.iter().map(move |ray| {
            let point = Point::from(ray.origin.xyz + range_m * ray.direction.xyz());
            (target_from_global * point).xyz.truncate()
        })
    }

    /// The rectangle that holds all of [`Chirps::target_points_m`].
    pub fn field(&self, frames: &RadarFrames) -> Field {
        Field::around(self.target_points_m(frames))
    }
}

impl Field {
    /// The smallest field that holds all points, m.
    pub fn around(points_m: impl Iterator<Item = DVec2>) -> Field {
        let empty = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let (min, max) = points_m.fold(empty, |(min, max), p| (min.min(p), max.max(p)));
        Field { min_m: min.to_array(), max_m: max.to_array() }
    }

    /// Width and height, m.
    pub fn sides_m(&self) -> [f64; 2] {
        [0, 1].map(|axis| self.max_m[axis] - self.min_m[axis])
    }
}

impl std::fmt::Display for Field {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let ([left, low], [right, high]) = (self.min_m, self.max_m);
        write!(f, "x {left:.3} to {right:.3} m and y {low:.3} to {high:.3} m")
    }
}
