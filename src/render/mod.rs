//! Scan × target × materials → detections. Plain values in and out: no files, no database.

mod cloud;
mod image;

use glam::DVec3;
use rayon::prelude::*;
use thiserror::Error;

use crate::brdf::Scattering;
use crate::frames::{Direction, Point};
use crate::geometry::Mesh;
use crate::radar::{Chirps, Field, Link, Radar, RadarFrames};
use crate::trace::{Hit, closest_hits};
use crate::units::dbm_from_watts;

pub use cloud::cloud_table;
pub use image::{CHANNELS, power_image};

/// One chirp that met a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Echo {
    /// Chirp number, from 0.
    pub chirp: u32,
    /// Where the ray met the surface: range R, point, facet, incidence.
    pub hit: Hit,
    /// x in the target frame, m.
    pub xt_m: f64,
    /// y in the target frame, m.
    pub yt_m: f64,
    /// Region of the facet.
    pub region: u16,
    /// Received power, dBm; −∞ when nothing comes back.
    pub power_dbm: f64,
}

/// What one scan gave.
#[derive(Clone, Debug, PartialEq)]
pub struct Scan {
    /// Number of chirps sent.
    pub chirps: usize,
    /// Chirps that met a surface, in the order they were sent, whatever their power.
    pub echoes: Vec<Echo>,
    /// Echoes below this power are not detected, dBm.
    pub threshold_dbm: f64,
}

/// Why there is nothing to render.
#[derive(Debug, Error, PartialEq)]
pub enum RenderError {
    /// No ray meets the target.
    #[error(
        "no chirp of the scan hits the target: at 8 m the scan covers {scan}, the target lies at {target} of the \
         target frame; move the mesh with translation_m or the radar with radar.primary_focus_m"
    )]
    Miss {
        /// Where the scan looks.
        scan: Field,
        /// Where the target is.
        target: Field,
    },
}

impl Scan {
    /// The echoes that the radar reports: those at or above the threshold.
    pub fn detections(&self) -> impl Iterator<Item = &Echo> {
        self.echoes.iter().filter(|echo| echo.power_dbm >= self.threshold_dbm)
    }
}

/// Traces every chirp of a scan. `done` is told how many chirps are finished.
///
/// # Errors
/// When no ray meets the mesh.
pub fn trace(
    radar: &Radar,
    chirps: &Chirps,
    mesh: &Mesh,
    done: &(dyn Fn(usize) + Sync),
) -> Result<Vec<Option<Hit>>, RenderError> {
    let hits = closest_hits(mesh, &chirps.rays, done);
    if hits.iter().all(Option::is_none) {
        return Err(miss(&radar.frames(), chirps, mesh));
    }
    Ok(hits)
}

/// Turns hits into echoes: `region_of_facet` indexes `surfaces`, one scattering law per region.
///
/// Hits can be kept and shaded again with other materials. The result is the same for any number of
/// threads.
pub fn shade(
    radar: &Radar,
    chirps: &Chirps,
    hits: &[Option<Hit>],
    region_of_facet: &[u16],
    surfaces: &[&dyn Scattering],
) -> Scan {
    let target_from_global = radar.frames().global_from_target.inverse();
    let link = Link::new(radar);
    let echo = |(chirp, hit): (usize, &Option<Hit>)| {
        let hit = (*hit)?;
        let region = region_of_facet[hit.facet as usize];
        let in_target = target_from_global * hit.point;
        Some(Echo {
            chirp: chirps.number[chirp],
            hit,
            xt_m: in_target.xyz.x,
            yt_m: in_target.xyz.y,
            region,
            power_dbm: dbm_from_watts(power_w(&link, &hit, surfaces[usize::from(region)])),
        })
    };
    Scan {
        chirps: hits.len(),
        echoes: hits.par_iter().enumerate().filter_map(echo).collect(),
        threshold_dbm: radar.threshold_dbm,
    }
}

/// Equation (11) at a hit: the surface is lit and seen from the same direction.
fn power_w(link: &Link, hit: &Hit, surface: &dyn Scattering) -> f64 {
    let retro = Direction::from_angles(hit.theta_rad(), 0.0);
    link.power_w(hit.range_m, hit.cos_theta, surface.f_per_sr(retro, retro))
}

fn miss(frames: &RadarFrames, chirps: &Chirps, mesh: &Mesh) -> RenderError {
    let target_from_global = frames.global_from_target.inverse();
    let in_target = |&vertex: &DVec3| (target_from_global * Point::from(vertex)).xyz.truncate();
    let target = Field::around(mesh.vertices.iter().map(in_target));
    RenderError::Miss { scan: chirps.field(frames), target }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::Lambert;
    use crate::scene::solids;

    fn chirps(radar: &Radar) -> Chirps {
        Chirps::draw(radar, |_| Err("no file".to_owned())).unwrap()
    }

    #[test]
    fn a_plate_at_eight_metres_returns_the_hand_computed_power() {
        let radar = Radar::default();
        let mut mesh = solids::plate(2.0, 2.0);
        for vertex in &mut mesh.vertices {
            vertex.y += 1.1;
        }
        let lambert = Lambert { albedo: 0.5 };
        let regions = vec![0; mesh.facets.len()];
        let chirps = chirps(&radar);
        let hits = trace(&radar, &chirps, &mesh, &|_| {}).unwrap();
        let scan = shade(&radar, &chirps, &hits, &regions, &[&lambert]);
        assert_eq!(scan.echoes.len(), 18_529);
        for echo in &scan.echoes {
            // P = 7 − 15 + 10·lg(0.196 · 0.5/π) − 20·lg R + 20·lg cos θ, with R = 8/cos θ.
            let cos = 8.0 / echo.hit.range_m;
            let expected = -8.0 + 10.0 * (0.196 * 0.5 / std::f64::consts::PI).log10()
                - 20.0 * echo.hit.range_m.log10()
                + 20.0 * cos.log10();
            assert!((echo.power_dbm - expected).abs() < 1e-9);
        }
    }

    #[test]
    fn a_target_beside_the_field_of_view_is_an_error() {
        let mut mesh = solids::plate(0.1, 0.1);
        for vertex in &mut mesh.vertices {
            vertex.x += 3.0;
        }
        let radar = Radar::default();
        let missed = trace(&radar, &chirps(&radar), &mesh, &|_| {}).unwrap_err();
        assert!(missed.to_string().contains("x 2.950 to 3.050"), "{missed}");
    }
}
