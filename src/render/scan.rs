//! Renders a scan: from its rays to its echoes.

use rayon::prelude::*;

use super::behind::trace_behind;
use super::detect::Detector;
use super::echo::{Echo, Echoes};
use super::effect_scan::{self, EffectScan};
use super::error::RenderError;
use super::observer::Observer;
use super::paths::{Paths, of_antennas};
use super::setup::Setup;
use super::spot::{self, Footprints};
use super::tones::Beats;
use crate::frames::{Global, Point};
use crate::radar::{Field, SpeckleForm};
use crate::trace::{ScanGeometry, winding_number};

/// The echoes of one scan at one antenna.
#[derive(Clone, Debug, PartialEq)]
pub struct Scan {
    /// Number of chirps sent.
    pub chirps: usize,
    /// Number of chirps that hit the target.
    pub hits: usize,
    /// The echoes of all chirps that hit the target, of any power, and false alarms, in the order of transmission, those
    /// of one chirp by range.
    pub echoes: Vec<Echo>,
    /// Echoes below this power are not detected, W.
    pub threshold_w: f64,
    /// Mean thermal power in a range cell, W; `None` for a receiver without noise.
    pub noise_w: Option<f64>,
}

impl Scan {
    /// The echoes at or above the threshold, which the radar reports.
    pub fn detections(&self) -> impl Iterator<Item = &Echo> {
        self.echoes.iter().filter(|echo| echo.power_w >= self.threshold_w)
    }
}

/// Traces `rays_per_chirp` rays, one or more, for every chirp of a scan. `done` is called repeatedly with the number of
/// chirps that were finished since the last call.
///
/// # Errors
/// When no ray hits the mesh, or when the tracer does not accept the rays or fails.
pub fn trace(
    geometry: &ScanGeometry,
    rays_per_chirp: usize,
    done: &(dyn Fn(usize) + Sync),
) -> Result<Footprints, RenderError> {
    check_hits(spot::trace(geometry, rays_per_chirp.max(1), done)?, geometry)
}

/// As [`trace`], with the target where the effects of the setup place it, and with what lies behind its sheets.
///
/// # Errors
/// When no ray hits the mesh, when the tracer does not accept the rays or fails, or when an effect would be counted
/// twice.
pub fn trace_placed(
    setup: &Setup,
    rays_per_chirp: usize,
    done: &(dyn Fn(usize) + Sync),
) -> Result<Footprints, RenderError> {
    let geometry = &setup.geometry;
    let rays = rays_per_chirp.max(1);
    effect_scan::check(setup, rays, Observer::Radar)?;
    let moving = setup.effects.filter(|model| model.moves_target());
    let footprints = match moving.and_then(|_| EffectScan::new(setup, Observer::Radar)) {
        None => spot::trace(geometry, rays, done),
        Some(effects) => {
            spot::trace_moved(geometry, rays, done, |chirp, ray, hit| effects.meet(chirp, ray, hit))
        }
    };
    let mut footprints = check_hits(footprints?, geometry)?;
    if setup.has_sheets() {
        trace_behind(setup, &mut footprints);
    }
    Ok(footprints)
}

/// Fails if no ray of a scan hits the target.
fn check_hits(footprints: Footprints, geometry: &ScanGeometry) -> Result<Footprints, RenderError> {
    if footprints.hits.iter().all(Option::is_none) {
        return Err(miss(geometry));
    }
    Ok(footprints)
}

/// Computes the echoes at an antenna from the hits of [`trace`], or of [`trace_placed`] for a setup with effects or sheets. `done`
/// is called repeatedly with the number of chirps that were finished since the last call.
///
/// The result does not depend on the number of threads.
///
/// # Errors
/// When the antenna stands inside the target, a path is too long for the receiver's sampling,
/// a receiver gets several paths of undeclared phases, or an effect would be counted twice.
pub fn shade(
    setup: &Setup,
    footprints: &Footprints,
    observer: Observer,
    done: &(dyn Fn(usize) + Sync),
) -> Result<Scan, RenderError> {
    match shade_each(setup, footprints, &[observer], done) {
        Ok(mut scans) => Ok(scans.swap_remove(0)),
        Err((_, error)) => Err(error),
    }
}

/// As [`shade`], at each of several antennas. What the radar lights is traced once for all of them; `done` hears of every
/// chirp once for each.
///
/// # Errors
/// The place in `observers` of the first antenna that has an error of [`shade`], and the error.
pub fn shade_each(
    setup: &Setup,
    footprints: &Footprints,
    observers: &[Observer],
    done: &(dyn Fn(usize) + Sync),
) -> Result<Vec<Scan>, (usize, RenderError)> {
    let (mut detectors, mut antennas) = (Vec::new(), Vec::new());
    for (place, &observer) in observers.iter().enumerate() {
        let (detector, paths) =
            prepared(setup, footprints, observer).map_err(|error| (place, error))?;
        detectors.push(detector);
        antennas.push(paths);
    }
    let target_from_global = setup.geometry.radar.frames().global_from_target.inverse();
    let echoes = observers.iter().zip(&detectors);
    let echoes: Vec<Echoes> = echoes
        .map(|(&observer, detector)| Echoes {
            setup,
            footprints,
            observer,
            detector,
            target_from_global,
        })
        .collect();
    let found = of_antennas(&antennas, done, |antenna, chirp, hits, of_chirp, found| {
        let mut seen = Vec::new();
        detectors[antenna].observe(chirp, of_chirp, &mut seen)?;
        echoes[antenna].append(chirp, hits, of_chirp, &seen, found);
        Ok::<(), RenderError>(())
    });
    let hits = footprints.chirps().filter(|hits| hits.iter().any(Option::is_some)).count();
    let scans = found.into_iter().zip(&detectors).enumerate();
    let scans = scans.map(|(place, (echoes, detector))| {
        Ok(Scan {
            chirps: setup.geometry.chirps.rays.len(),
            hits,
            echoes: echoes.map_err(|error| (place, error))?,
            threshold_w: detector.threshold_w(),
            noise_w: detector.noise_w(),
        })
    });
    scans.collect()
}

/// The receiver of an antenna, and the paths to it.
fn prepared<'a>(
    setup: &'a Setup<'a>,
    footprints: &'a Footprints,
    observer: Observer,
) -> Result<(Detector<'a>, Paths<'a>), RenderError> {
    check(setup, footprints, observer)?;
    let effects = EffectScan::new(setup, observer);
    let detector = Detector::new(setup, observer, effects.as_ref(), footprints)?;
    Ok((detector, Paths::new(setup, observer, footprints, effects)))
}

/// Computes the sampled beat signals of a scan at an antenna, chirp after chirp; those of a chirp are empty without a
/// `[radar.receiver]`.
///
/// # Errors
/// When the antenna stands inside the target, a receiver gets several paths of undeclared phases, or an effect would be
/// counted twice. The iterator gives an error for a chirp with a path that is too long for the sampling.
pub fn beat_signals<'a>(
    setup: &'a Setup<'a>,
    footprints: &'a Footprints,
    observer: Observer,
) -> Result<impl Iterator<Item = Result<Beats, RenderError>> + use<'a>, RenderError> {
    let (detector, paths) = prepared(setup, footprints, observer)?;
    let hits = footprints.hits.chunks(footprints.rays_per_chirp.max(1));
    Ok(hits
        .enumerate()
        .map(move |(chirp, hits)| detector.beats(chirp, &paths.of_chirp(chirp, hits))))
}

/// Checks the setup before anything is computed.
fn check(setup: &Setup, footprints: &Footprints, observer: Observer) -> Result<(), RenderError> {
    effect_scan::check(setup, footprints.rays_per_chirp, observer)?;
    if let Observer::Receiver { position, .. } = observer {
        check_walls(setup, position)?;
    }
    if setup.geometry.radar.receiver.is_some()
        && (footprints.rays_per_chirp > 1 || setup.bounce.is_some())
    {
        return match (setup.geometry.radar.speckle, setup.speckle_form(footprints.rays_per_chirp)) {
            (None, _) => Err(RenderError::Phases),
            (Some(_), SpeckleForm::Law) => Err(RenderError::LawOfTones),
            (Some(_), SpeckleForm::Scatterers | SpeckleForm::Independent) => Ok(()),
        };
    }
    Ok(())
}

/// Refuses a receiver and a radar of which one is inside a closed mesh that the other is outside of. A room around both
/// does not count.
fn check_walls(setup: &Setup, receiver: Point<Global>) -> Result<(), RenderError> {
    let radar = setup.geometry.radar.frames().origin();
    let [around_receiver, around_radar] =
        [receiver, radar].map(|point| winding_number(setup.geometry.bvh.mesh(), point));
    // A winding number is 0 outside and 1 inside a closed mesh, and a fraction near an open one.
    if (around_receiver - around_radar).abs() <= 0.75 {
        return Ok(());
    }
    let (antenna, key, at) = if around_receiver.abs() > around_radar.abs() {
        ("receiver", "position_m", receiver)
    } else {
        let key = if setup.geometry.radar.position_m.is_some() {
            "position_m, or the target"
        } else {
            "reflector_centre_m, or the target"
        };
        ("radar", key, radar)
    };
    let [x_m, y_m, z_m] = at.xyz.to_array();
    Err(RenderError::Inside { antenna, key, x_m, y_m, z_m })
}

/// The error of a scan that misses its target: field of view, extent of the target, and the likeliest remedy.
fn miss(geometry: &ScanGeometry) -> RenderError {
    let (chirps, mesh) = (geometry.chirps, geometry.bvh.mesh());
    let frames = geometry.radar.frames();
    let target_from_global = frames.global_from_target.inverse();
    let vertices = mesh.vertices.iter();
    let in_target = vertices.map(|&vertex| (target_from_global * Point::from(vertex)).xyz);
    let target = Field::around(in_target.map(|vertex| vertex.truncate()));
    let scan = chirps.field(&frames);
    // Sixty times the size of the paper's target indicates a mesh in millimetres.
    const HUGE_M: f64 = 100.0;
    let is_ahead = chirps.rays.first().is_some_and(|ray| {
        let mut to_vertices = mesh.vertices.iter().map(|vertex| vertex - ray.origin.xyz);
        to_vertices.any(|to_vertex| to_vertex.dot(ray.direction.xyz()) > 0.0)
    });
    let is_placed = geometry.radar.position_m.is_some();
    let way_out = if target.sides_m().into_iter().any(|side_m| side_m > HUGE_M) {
        "is the mesh in millimetres? give it scale = 0.001"
    } else if is_placed {
        "move the mesh with translation_m, or let the radar look at it with radar.look_at_m"
    } else if !is_ahead {
        "it stands behind the radar: move it with translation_m or turn the radar with radar.alpha_deg"
    } else {
        "move the mesh with translation_m or the radar with radar.primary_focus_m"
    };
    RenderError::Miss { scan, target, way_out }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{LN_2, PI};

    use glam::DVec3;

    use super::*;
    use crate::brdf::{Lambert, Scattering};
    use crate::frames::Direction;
    use crate::geometry::Mesh;
    use crate::radar::{Chirps, Radar};
    use crate::render::Surface;
    use crate::scene::solids;
    use crate::trace::Bvh;
    use crate::units::{db_from_ratio, dbm_from_watts};

    fn chirps(radar: &Radar) -> Chirps {
        Chirps::draw(radar, |_| Err("no file".to_owned())).unwrap()
    }

    #[test]
    fn a_plate_at_eight_metres_returns_the_hand_computed_power() {
        let mut mesh = solids::plate(2.0, 2.0);
        for vertex in &mut mesh.vertices {
            vertex.y += 1.1;
        }
        let lambert = Lambert { albedo: 0.5 };
        let scan = shaded(&mesh, 1, &lambert);
        assert_eq!(scan.echoes.len(), 18_529);
        for echo in &scan.echoes {
            // P = 7 − 12.5 + 10·lg(λ²/(πw²) · 0.5/π) + 20·lg cos θ, with w₀ from 16 mm, half as wide again at
            // 0.5 m from the centre, and z = R − 8 m from its focus.
            let wavelength_m = 299_792_458.0 / 300e9;
            let off_m2 = echo.xt_m.powi(2) + echo.yt_m.powi(2);
            // The beam aims at the point of its axis at 8 m, which lies in front of the plate.
            let cos = 8.0 / echo.range_m;
            let waist_m = 0.016 / (2.0 * LN_2).sqrt() * (1.0 + 0.5 * off_m2 * cos * cos / 0.25);
            let zeta = (echo.range_m - 8.0) * wavelength_m / (PI * waist_m * waist_m);
            let radius_m2 = waist_m * waist_m * (1.0 + zeta * zeta);
            let expected = -5.5
                + db_from_ratio(wavelength_m * wavelength_m / (PI * radius_m2) * 0.5 / PI)
                + 20.0 * cos.log10();
            assert!((dbm_from_watts(echo.power_w) - expected).abs() < 1e-9);
        }
    }

    #[test]
    fn a_target_beside_the_field_of_view_is_an_error() {
        let mut mesh = solids::plate(0.1, 0.1);
        for vertex in &mut mesh.vertices {
            vertex.x += 3.0;
        }
        let radar = Radar::default();
        let (chirps, bvh) = (chirps(&radar), Bvh::new(&mesh));
        let missed = trace(&ScanGeometry::new(&radar, &chirps, &bvh, &[]), 1, &|_| {}).unwrap_err();
        assert!(missed.to_string().contains("x 2.950 to 3.050"), "{missed}");
    }

    /// The scan of a mesh with many rays per chirp.
    fn shaded(mesh: &Mesh, rays: usize, surface: &dyn Scattering) -> Scan {
        shaded_regions(mesh, rays, &vec![0; mesh.facets.len()], &[Surface::new(surface)])
    }

    /// The same of a mesh of several regions.
    fn shaded_regions(mesh: &Mesh, rays: usize, regions: &[u16], surfaces: &[Surface]) -> Scan {
        let radar = Radar::default();
        let chirps = chirps(&radar);
        let bvh = Bvh::new(mesh);
        let geometry = ScanGeometry::new(&radar, &chirps, &bvh, regions);
        let footprints = trace(&geometry, rays, &|_| {}).unwrap();
        let setup = Setup::new(geometry, surfaces);
        shade(&setup, &footprints, Observer::Radar, &|_| {}).unwrap()
    }

    #[test]
    fn facets_of_regions_in_turn_have_each_the_law_of_its_own() {
        let mut mesh = solids::icosphere(0.3, 3);
        mesh.vertices.iter_mut().for_each(|vertex| vertex.y += 1.1);
        let (dull, own) = (Lambert { albedo: 0.5 }, |i: Direction<_>, _| 0.3 * i.cos_theta());
        let regions: Vec<u16> = (0..mesh.facets.len()).map(|facet| facet as u16 % 2).collect();
        let surfaces = [Surface::new(&dull), Surface::new(&own)];
        let both = shaded_regions(&mesh, 1, &regions, &surfaces).echoes;
        let alone = [&dull as &dyn Scattering, &own].map(|law| shaded(&mesh, 1, law).echoes);
        assert!(both.len() > 500);
        for (place, echo) in both.iter().enumerate() {
            let region = usize::from(echo.truth.unwrap().region);
            assert_eq!(region, echo.truth.unwrap().hit.facet as usize % 2);
            assert_eq!(echo.power_w, alone[region][place].power_w);
        }
    }

    #[test]
    fn on_a_large_plate_the_spot_changes_nothing() {
        let mut mesh = solids::plate(2.0, 2.0);
        mesh.vertices.iter_mut().for_each(|vertex| vertex.y += 1.1);
        let lambert = Lambert { albedo: 0.5 };
        let (one, many) = (shaded(&mesh, 1, &lambert), shaded(&mesh, 64, &lambert));
        for (a, b) in std::iter::zip(&one.echoes, &many.echoes) {
            let [a_dbm, b_dbm] = [a, b].map(|echo| dbm_from_watts(echo.power_w));
            assert!((a_dbm - b_dbm).abs() < 1e-3, "{a:?} {b:?}");
            assert!((a.range_m - b.range_m).abs() < 1e-4);
        }
    }

    #[test]
    fn a_straight_edge_through_the_spot_halves_the_power() {
        // A half plane that ends at x = 0: the error function of the distance to the edge.
        let mut mesh = solids::plate(2.0, 2.0);
        mesh.vertices.iter_mut().for_each(|vertex| *vertex += DVec3::new(1.0, 1.1, 0.0));
        let lambert = Lambert { albedo: 0.5 };
        let scan = shaded(&mesh, 400, &lambert);
        let mut whole = solids::plate(4.0, 4.0);
        whole.vertices.iter_mut().for_each(|vertex| *vertex += DVec3::new(0.0, 1.1, 0.0));
        let whole = shaded(&whole, 400, &lambert).echoes;
        let on_the_edge: Vec<&Echo> = scan.echoes.iter().filter(|e| e.xt_m.abs() < 3e-4).collect();
        assert!(on_the_edge.len() > 5);
        for echo in on_the_edge {
            let whole_w = whole.iter().find(|e| e.chirp == echo.chirp).unwrap().power_w;
            let lost_db = db_from_ratio(whole_w / echo.power_w);
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
            scan.echoes.iter().map(|e| e.power_w).sum::<f64>()
        };
        let finest = mean_w(1024);
        let error = |rays: usize| (mean_w(rays) / finest - 1.0).abs();
        assert!(error(16) < 0.05 && error(128) < 0.01, "{} {}", error(16), error(128));
    }
}
