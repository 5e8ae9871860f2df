//! Scan × target × materials → detections. Plain values in and out: no files, no database.

mod cloud;
mod image;
mod spot;

use glam::DVec3;
use rayon::prelude::*;
use thiserror::Error;

use crate::brdf::Scattering;
use crate::frames::{Direction, Global, Point, Ray};
use crate::geometry::Mesh;
use crate::radar::{Chirps, Field, Link, Radar, RadarFrames};
use crate::trace::Hit;
use crate::units::dbm_from_watts;

pub use cloud::cloud_table;
pub use image::{CHANNELS, power_image};
pub use spot::Footprints;

/// One chirp that met a surface.
///
/// With one ray per chirp everything is of that ray. With more, power is their mean, range and point
/// lie on the beam's axis at the mean range weighted by power, and facet, region and incidence are
/// those of the strongest ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Echo {
    /// Chirp number, from 0 or as an explicit scan gives it.
    pub chirp: u32,
    /// Where the chirp met the surface: range R, point, facet, incidence.
    pub hit: Hit,
    /// Standard deviation of the incidence over the rays of the spot, rad; 0 for a single ray.
    pub theta_sd_rad: f64,
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
         target frame; {way_out}"
    )]
    Miss {
        /// Where the scan looks.
        scan: Field,
        /// Where the target is.
        target: Field,
        /// What to do.
        way_out: &'static str,
    },
}

impl Scan {
    /// The echoes that the radar reports: those at or above the threshold.
    pub fn detections(&self) -> impl Iterator<Item = &Echo> {
        self.echoes.iter().filter(|echo| echo.power_dbm >= self.threshold_dbm)
    }
}

/// Traces every chirp of a scan with `rays_per_chirp` rays, one or more. `done` is told how many
/// chirps are finished.
///
/// # Errors
/// When no ray meets the mesh.
pub fn trace(
    radar: &Radar,
    chirps: &Chirps,
    mesh: &Mesh,
    rays_per_chirp: usize,
    done: &(dyn Fn(usize) + Sync),
) -> Result<Footprints, RenderError> {
    let footprints = spot::trace(radar, chirps, mesh, rays_per_chirp.max(1), done);
    if footprints.hits.iter().all(Option::is_none) {
        return Err(miss(&radar.frames(), chirps, mesh));
    }
    Ok(footprints)
}

/// Turns hits into echoes: `region_of_facet` indexes `surfaces`, one scattering law per region.
///
/// The result is the same for any number of threads.
pub fn shade(
    radar: &Radar,
    chirps: &Chirps,
    footprints: &Footprints,
    region_of_facet: &[u16],
    surfaces: &[&dyn Scattering],
) -> Scan {
    let target_from_global = radar.frames().global_from_target.inverse();
    let link = Link::new(radar);
    let region = |hit: &Hit| region_of_facet[hit.facet as usize];
    let power_w = |hit: &Hit| power_w(&link, hit, surfaces[usize::from(region(hit))]);
    let echo = |(chirp, hits): (usize, &[Option<Hit>])| {
        let seen = Seen::new(hits, power_w)?;
        let hit = match hits.len() {
            1 => seen.strongest,
            _ => seen.on_the_axis(&chirps.rays[chirp]),
        };
        let in_target = target_from_global * hit.point;
        Some(Echo {
            chirp: chirps.number[chirp],
            hit,
            theta_sd_rad: seen.theta_sd_rad,
            xt_m: in_target.xyz.x,
            yt_m: in_target.xyz.y,
            region: region(&hit),
            power_dbm: dbm_from_watts(seen.power_w),
        })
    };
    Scan {
        chirps: chirps.rays.len(),
        echoes: footprints.chirps().enumerate().filter_map(echo).collect(),
        threshold_dbm: radar.threshold_dbm,
    }
}

/// What the rays of one chirp saw together.
struct Seen {
    strongest: Hit,
    range_m: f64,
    theta_sd_rad: f64,
    power_w: f64,
}

impl Seen {
    /// `None` when no ray met anything.
    fn new(rays: &[Option<Hit>], power_w: impl Fn(&Hit) -> f64) -> Option<Seen> {
        let hits: Vec<(Hit, f64)> = rays.iter().flatten().map(|hit| (*hit, power_w(hit))).collect();
        let mut strongest = *hits.first()?;
        for &(hit, power_w) in &hits[1..] {
            if power_w > strongest.1 {
                strongest = (hit, power_w);
            }
        }
        let count = hits.len() as f64;
        let sum_w: f64 = hits.iter().map(|(_, power_w)| power_w).sum();
        let range_m = match sum_w > 0.0 {
            true => hits.iter().map(|(hit, power_w)| hit.range_m * power_w).sum::<f64>() / sum_w,
            false => hits.iter().map(|(hit, _)| hit.range_m).sum::<f64>() / count,
        };
        let mean_rad = hits.iter().map(|(hit, _)| hit.theta_rad()).sum::<f64>() / count;
        let square = |(hit, _): &(Hit, f64)| (hit.theta_rad() - mean_rad).powi(2);
        Some(Seen {
            strongest: strongest.0,
            range_m,
            theta_sd_rad: (hits.iter().map(square).sum::<f64>() / count).sqrt(),
            power_w: sum_w / rays.len() as f64,
        })
    }

    /// The strongest hit, moved to where the radar believes it: on the beam's axis.
    fn on_the_axis(&self, axis: &Ray<Global>) -> Hit {
        let point = Point::from(axis.origin.xyz + self.range_m * axis.direction.xyz());
        Hit { range_m: self.range_m, point, ..self.strongest }
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
    let scan = chirps.field(frames);
    // Sixty times the paper's target: surely a mesh in millimetres.
    const HUGE_M: f64 = 100.0;
    let ahead = |ray: &Ray<Global>| {
        let along = |&v: &DVec3| (v - ray.origin.xyz).dot(ray.direction.xyz());
        mesh.vertices.iter().any(|vertex| along(vertex) > 0.0)
    };
    let way_out = if target.sides_m().into_iter().any(|side_m| side_m > HUGE_M) {
        "is the mesh in millimetres? give it scale = 0.001"
    } else if !chirps.rays.first().is_some_and(ahead) {
        "it stands behind the radar: move it with translation_m or turn the radar with radar.alpha_deg"
    } else {
        "move the mesh with translation_m or the radar with radar.primary_focus_m"
    };
    RenderError::Miss { scan, target, way_out }
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
        let hits = trace(&radar, &chirps, &mesh, 1, &|_| {}).unwrap();
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
        let missed = trace(&radar, &chirps(&radar), &mesh, 1, &|_| {}).unwrap_err();
        assert!(missed.to_string().contains("x 2.950 to 3.050"), "{missed}");
    }

    /// Mean power, W, and echoes of a plate with many rays per chirp.
    fn shaded(mesh: &Mesh, rays: usize, surface: &dyn Scattering) -> Scan {
        let radar = Radar::default();
        let chirps = chirps(&radar);
        let footprints = trace(&radar, &chirps, mesh, rays, &|_| {}).unwrap();
        shade(&radar, &chirps, &footprints, &vec![0; mesh.facets.len()], &[surface])
    }

    #[test]
    fn on_a_large_plate_the_spot_changes_nothing() {
        let mut mesh = solids::plate(2.0, 2.0);
        mesh.vertices.iter_mut().for_each(|vertex| vertex.y += 1.1);
        let lambert = Lambert { albedo: 0.5 };
        let (one, many) = (shaded(&mesh, 1, &lambert), shaded(&mesh, 64, &lambert));
        for (a, b) in std::iter::zip(&one.echoes, &many.echoes) {
            assert!((a.power_dbm - b.power_dbm).abs() < 1e-3, "{a:?} {b:?}");
            assert!((a.hit.range_m - b.hit.range_m).abs() < 1e-4);
        }
    }

    #[test]
    fn a_straight_edge_through_the_spot_halves_the_power() {
        // A half plane that ends at x = 0: the error function of the distance to the edge.
        let mut mesh = solids::plate(2.0, 2.0);
        mesh.vertices.iter_mut().for_each(|vertex| *vertex += DVec3::new(1.0, 1.1, 0.0));
        let lambert = Lambert { albedo: 0.5 };
        let scan = shaded(&mesh, 400, &lambert);
        let full_dbm = scan.echoes.iter().map(|e| e.power_dbm).fold(f64::NEG_INFINITY, f64::max);
        let on_the_edge: Vec<&Echo> = scan.echoes.iter().filter(|e| e.xt_m.abs() < 3e-4).collect();
        assert!(on_the_edge.len() > 5);
        for echo in on_the_edge {
            // Off the centre the beam is as bright; only cos θ and R tell, below 0.03 dB.
            let lost_db = full_dbm - echo.power_dbm;
            assert!((lost_db - 10.0 * 2f64.log10()).abs() < 0.3, "{lost_db}");
        }
    }

    #[test]
    fn more_rays_converge() {
        let mut mesh = solids::icosphere(0.05, 4);
        mesh.vertices.iter_mut().for_each(|vertex| vertex.y += 1.1);
        let rough = |i: Direction<crate::frames::Surface>, _| (-(1.0 - i.cos_theta()) / 0.02).exp();
        let mean_w = |rays: usize| {
            let scan = shaded(&mesh, rays, &rough);
            scan.echoes.iter().map(|e| crate::units::watts_from_dbm(e.power_dbm)).sum::<f64>()
        };
        let finest = mean_w(1024);
        let error = |rays: usize| (mean_w(rays) / finest - 1.0).abs();
        assert!(error(16) < 0.05 && error(128) < 0.01, "{} {}", error(16), error(128));
    }
}
