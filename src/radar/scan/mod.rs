//! A scan: one ray per chirp, and when.

mod explicit;
mod pattern;

use glam::DVec2;
use rayon::prelude::*;

use super::f5::{Domain, F5};
use super::mirror::{Mirror, MirrorAngles};
use super::{Radar, RadarError, RadarFrames};
use crate::frames::{Global, Point, Ray, target_z_m};

pub(in crate::radar) use pattern::read as read_pattern;
pub use pattern::{Elliptical, Explicit, Lissajous, Pattern, Raster, Spiral};

/// Range at which a pattern is drawn in the target plane, m (paper, Sec. III-B).
pub const PATTERN_RANGE_M: f64 = 8.0;

/// The chirps of a scan, in the order they are sent. All lists have one entry per chirp.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chirps {
    /// Number of the chirp: from 0, or as an explicit file gives it.
    pub number: Vec<u32>,
    /// Time of the chirp, s; 0 throughout where nobody knows.
    pub time_s: Vec<f64>,
    /// Where it looks.
    pub rays: Vec<Ray<Global>>,
    /// The mirror's angles, for scans that a mirror makes; empty otherwise.
    pub mirror: Vec<MirrorAngles>,
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

    /// Whether chirps differ in time, so that what goes with time can be told.
    pub fn is_timed(&self) -> bool {
        self.time_s.windows(2).any(|pair| pair[0] != pair[1])
    }

    /// The chirps of a radar's pattern; `read` fetches an explicit pattern's file by its path.
    ///
    /// # Errors
    /// When the pattern cannot be drawn or its file cannot be used.
    pub fn draw(
        radar: &Radar,
        read: impl Fn(&str) -> Result<Vec<u8>, String>,
    ) -> Result<Chirps, RadarError> {
        let points = |points: Vec<[f64; 2]>| {
            let rays = through_points(&radar.frames(), &points)?;
            Ok(Chirps::timed(radar, rays, Vec::new()))
        };
        match &radar.scan {
            Pattern::Elliptical(pattern) => {
                let angles = pattern.angles(&radar.mirror(), radar.optics.ellipse_height_m);
                let rays = through_mirror(radar, &angles)?;
                Ok(Chirps::timed(radar, rays, angles))
            }
            Pattern::Raster(pattern) => points(pattern.target_points_m()),
            Pattern::Lissajous(pattern) => points(pattern.target_points_m()),
            Pattern::Spiral(pattern) => points(pattern.target_points_m()),
            Pattern::Rays(Explicit { file }) => explicit::rays(file, &fetch(file, read)?),
            Pattern::Angles(Explicit { file }) => {
                let mut chirps = explicit::angles(file, &fetch(file, read)?)?;
                chirps.rays = through_mirror(radar, &chirps.mirror)?;
                Ok(chirps)
            }
        }
    }

    /// Chirps numbered from 0, one period apart.
    fn timed(radar: &Radar, rays: Vec<Ray<Global>>, mirror: Vec<MirrorAngles>) -> Chirps {
        Chirps {
            number: (0..rays.len() as u32).collect(),
            time_s: (0..rays.len()).map(|n| n as f64 * radar.chirp_period_s).collect(),
            rays,
            mirror,
            notices: Vec::new(),
        }
    }

    /// (x_t, y_t) of each ray at 8 m from its origin, m.
    pub fn target_points_m(&self, frames: &RadarFrames) -> impl Iterator<Item = DVec2> {
        let target_from_global = frames.global_from_target.inverse();
        self.rays.iter().map(move |ray| {
            let point = Point::from(ray.origin.xyz + PATTERN_RANGE_M * ray.direction.xyz());
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

impl Radar {
    /// The scanning mirror.
    pub fn mirror(&self) -> Mirror {
        Mirror::new(self.optics, self.frames().reflector_centre)
    }

    /// The polynomial of equation (1): the given one, or one fitted to the optics.
    ///
    /// # Errors
    /// When the optics have none.
    pub fn f5(&self, domain: Domain) -> Result<F5, RadarError> {
        match &self.f5 {
            Some(own) => Ok(own.clone()),
            None => Ok(F5::fit(&self.mirror(), domain)?),
        }
    }

    /// Angles and ranges at which [`Radar::f5`] must hold for these chirps: a quarter nearer and
    /// farther than the pattern's range.
    pub fn f5_domain(&self, angles: &[MirrorAngles]) -> Domain {
        // Without any tilt a milliradian keeps the fit well posed.
        let gamma_rad = angles.iter().map(|a| a.gamma_rad.abs()).fold(1e-3, f64::max);
        Domain { gamma_rad, range_m: [0.75, 1.25].map(|share| share * PATTERN_RANGE_M) }
    }
}

/// Rays through points of the target plane at R = 8 m.
fn through_points(
    frames: &RadarFrames,
    points: &[[f64; 2]],
) -> Result<Vec<Ray<Global>>, RadarError> {
    let origin = frames.origin();
    let ray = |(chirp, &[xt_m, yt_m]): (usize, &[f64; 2])| {
        let range_m = PATTERN_RANGE_M;
        target_z_m(xt_m, yt_m, range_m, frames.reflector_centre)
            .map(|zt_m| frames.global_from_target * Point::new(xt_m, yt_m, zt_m))
            .and_then(|point| origin.towards(point))
            .map(|direction| Ray { origin, direction })
            .ok_or(RadarError::OutOfReach { chirp, xt_m, yt_m, range_m })
    };
    points.iter().enumerate().map(ray).collect()
}

/// Rays of mirror angles: equation (1) at R = 8 m, then (2) to (4).
fn through_mirror(radar: &Radar, angles: &[MirrorAngles]) -> Result<Vec<Ray<Global>>, RadarError> {
    let f5 = radar.f5(radar.f5_domain(angles))?;
    let points: Vec<[f64; 2]> =
        angles.par_iter().map(|&angles| f5.target_point_m(angles, PATTERN_RANGE_M)).collect();
    through_points(&radar.frames(), &points)
}

fn fetch(
    file: &str,
    read: impl Fn(&str) -> Result<Vec<u8>, String>,
) -> Result<Vec<u8>, RadarError> {
    read(file).map_err(|reason| RadarError::Unreadable { file: file.to_owned(), reason })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn draw(scan: Pattern) -> Result<Chirps, RadarError> {
        Chirps::draw(&Radar { scan, ..Default::default() }, |_| Err("no file".to_owned()))
    }

    #[test]
    fn the_ellipse_fills_the_papers_field_of_view() {
        let radar = Radar::default();
        let chirps = draw(Pattern::default()).unwrap();
        assert_eq!((chirps.rays.len(), chirps.mirror.len()), (18_529, 18_529));
        let Field { min_m, max_m } = chirps.field(&radar.frames());
        // A spot.
        const NEAR_M: f64 = 0.016;
        for (found, expected) in
            [(min_m[0], -0.25), (max_m[0], 0.25), (min_m[1], -0.45), (max_m[1], 0.45)]
        {
            assert!((found - expected).abs() < NEAR_M, "{found} is not {expected}");
        }
    }

    #[test]
    fn every_ray_starts_at_the_reflector_and_crosses_its_point() {
        let raster = Raster::default();
        let points = raster.target_points_m();
        let chirps = draw(Pattern::Raster(raster)).unwrap();
        let frames = Radar::default().frames();
        for (ray, point) in std::iter::zip(&chirps.rays, points) {
            assert_eq!(ray.origin, frames.origin());
            let at_8m = Point::from(ray.origin.xyz + PATTERN_RANGE_M * ray.direction.xyz());
            let in_target = frames.global_from_target.inverse() * at_8m;
            assert!(in_target.xyz.truncate().distance(point.into()) < 1e-12);
        }
    }

    #[test]
    fn chirps_are_one_period_apart() {
        let chirps = draw(Pattern::Spiral(Spiral::default())).unwrap();
        let period_s = Radar::default().chirp_period_s;
        assert!((chirps.time_s[1000] - 1000.0 * period_s).abs() < 1e-12);
    }

    #[test]
    fn a_scan_beyond_the_reach_of_the_range_is_refused() {
        let raster = Raster { width_m: 40.0, ..Default::default() };
        assert!(matches!(draw(Pattern::Raster(raster)), Err(RadarError::OutOfReach { .. })));
    }

    #[test]
    fn an_explicit_scan_needs_its_file() {
        let refused = draw(Pattern::Rays(Explicit { file: "rays.csv".into() })).unwrap_err();
        assert!(refused.to_string().contains("rays.csv"), "{refused}");
    }
}
