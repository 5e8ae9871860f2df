//! Drawing a pattern: one ray per chirp.

use glam::DVec3;
use rayon::prelude::*;

use super::chirps::Chirps;
use super::explicit;
use super::pattern::{Explicit, Pattern};
use crate::frames::{Direction, Global, Point, Ray, target_z_m};
use crate::radar::error::RadarError;
use crate::radar::f5::{Domain, F5};
use crate::radar::frames::RadarFrames;
use crate::radar::mirror::{Mirror, MirrorAngles};
use crate::radar::settings::Radar;

impl Chirps {
    /// The chirps of a radar's pattern; `read` fetches an explicit pattern's file by its path.
    ///
    /// # Errors
    /// When the pattern cannot be drawn or its file cannot be used.
    pub fn draw(
        radar: &Radar,
        read: impl Fn(&str) -> Result<Vec<u8>, String>,
    ) -> Result<Chirps, RadarError> {
        match &radar.scan {
            Pattern::Elliptical(pattern) => {
                let angles = pattern.angles(&radar.mirror(), radar.optics.ellipse_height_m);
                let rays = through_mirror(radar, &angles)?;
                Ok(Chirps::timed(radar, rays, angles))
            }
            Pattern::Raster(pattern) => Chirps::through(radar, &pattern.target_points_m()),
            Pattern::AngularRaster(pattern) => Ok(Chirps::towards(radar, &pattern.directions())),
            Pattern::Lissajous(pattern) => Chirps::through(radar, &pattern.target_points_m()),
            Pattern::Spiral(pattern) => Chirps::through(radar, &pattern.target_points_m()),
            Pattern::Rays(Explicit { file, complete }) => {
                let chirps = explicit::rays(file, &fetch(file, read)?)?;
                Ok(Chirps { only_detected: !complete, ..chirps })
            }
            Pattern::Angles(Explicit { file, complete }) => {
                let mut chirps = explicit::angles(file, &fetch(file, read)?)?;
                chirps.rays = through_mirror(radar, &chirps.mirror)?;
                Ok(Chirps { only_detected: !complete, ..chirps })
            }
        }
    }

    /// Chirps without a mirror through points of the target plane, m.
    fn through(radar: &Radar, points_m: &[[f64; 2]]) -> Result<Chirps, RadarError> {
        let rays = through_points(&radar.frames(), points_m)?;
        Ok(Chirps::timed(radar, rays, Vec::new()))
    }

    /// Chirps without a mirror in directions of the target frame.
    fn towards(radar: &Radar, directions: &[DVec3]) -> Chirps {
        let frames = radar.frames();
        let (origin, turn) = (frames.origin(), frames.global_from_target.rotation());
        let rays = directions.iter().filter_map(|direction| {
            Some(Ray { origin, direction: Direction::new(turn * *direction)? })
        });
        Chirps::timed(radar, rays.collect(), Vec::new())
    }

    /// Chirps numbered from 0, one period apart.
    fn timed(radar: &Radar, rays: Vec<Ray<Global>>, mirror: Vec<MirrorAngles>) -> Chirps {
        Chirps {
            number: (0..rays.len() as u32).collect(),
            time_s: (0..rays.len()).map(|n| n as f64 * radar.chirp_period_s).collect(),
            rays,
            mirror,
            only_detected: false,
            notices: Vec::new(),
        }
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
        let pattern_range_m = self.frames().pattern_range_m;
        Domain { gamma_rad, range_m: [0.75, 1.25].map(|share| share * pattern_range_m) }
    }
}

/// Rays through points of the target plane at the range of the pattern.
fn through_points(
    frames: &RadarFrames,
    points: &[[f64; 2]],
) -> Result<Vec<Ray<Global>>, RadarError> {
    let origin = frames.origin();
    let mut rays = Vec::with_capacity(points.len());
    for (chirp, &[xt_m, yt_m]) in points.iter().enumerate() {
        let range_m = frames.pattern_range_m;
        let direction = target_z_m(xt_m, yt_m, range_m, frames.reflector_centre)
            .map(|zt_m| frames.global_from_target * Point::new(xt_m, yt_m, zt_m))
            .and_then(|point| origin.towards(point))
            .ok_or(RadarError::OutOfReach { chirp, xt_m, yt_m, range_m })?;
        rays.push(Ray { origin, direction });
    }
    Ok(rays)
}

/// Rays of mirror angles: equation (1) at the range of the pattern, then (2) to (4).
fn through_mirror(radar: &Radar, angles: &[MirrorAngles]) -> Result<Vec<Ray<Global>>, RadarError> {
    let f5 = radar.f5(radar.f5_domain(angles))?;
    let frames = radar.frames();
    let target_point_m = |angles: &MirrorAngles| f5.target_point_m(*angles, frames.pattern_range_m);
    let points: Vec<[f64; 2]> = angles.par_iter().map(target_point_m).collect();
    through_points(&frames, &points)
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
    use crate::radar::scan::{Field, PATTERN_RANGE_M, Raster, Spiral};

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
        let refused =
            draw(Pattern::Rays(Explicit { file: "rays.csv".into(), complete: true })).unwrap_err();
        assert!(refused.to_string().contains("rays.csv"), "{refused}");
    }
}
