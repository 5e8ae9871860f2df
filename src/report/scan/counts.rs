//! What became of the chirps of a rendering, by antenna and by region of the target.

use serde::Serialize;

use crate::brdf::Layered;
use crate::geometry::Raster;
use crate::render::{Scan, Sheet};
use crate::scene::Scene;
use crate::setup::ReadyScene;
use crate::units::dbm_from_watts;

/// A region of the target.
#[derive(Serialize)]
pub struct RegionRecord<'a> {
    /// Its name.
    pub name: &'a str,
    /// Index into `materials`.
    pub material: u16,
    /// Its layers in air, where it lets a part of the wave through.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sheet: Option<&'a Layered>,
    /// Its facets.
    pub facets: usize,
    /// Chirps that meet it.
    pub hits: usize,
    /// Those of them at or above the threshold.
    pub detections: usize,
    /// The strongest of these, dBm.
    pub strongest_dbm: Option<f64>,
}

/// What became of the chirps of a scan at one antenna.
#[derive(Clone, Copy, Serialize)]
pub struct Counts {
    /// Chirps of the scan.
    pub chirps: usize,
    /// Chirps that meet the target.
    pub hits: usize,
    /// Echoes and false alarms at or above the threshold.
    pub detections: usize,
    /// Detections that no surface caused.
    pub false_alarms: usize,
    /// Echoes and false alarms below the threshold.
    pub below_threshold: usize,
    /// Chirps that miss the target.
    pub misses: usize,
    /// Detections outside the image.
    pub outside_image: usize,
    /// Facets without an area.
    pub degenerate_facets: usize,
}

/// Powers of the detections, dBm.
#[derive(Clone, Copy, Serialize)]
pub struct PowerRange {
    /// The weakest.
    pub weakest: f64,
    /// The median.
    pub median: f64,
    /// The strongest.
    pub strongest: f64,
}

impl Counts {
    pub(super) fn new(scene: &Scene, scan: &Scan, image: &Raster) -> Counts {
        let Scan { chirps, hits, .. } = *scan;
        let detections = scan.detections().count();
        let false_alarms = scan.detections().filter(|echo| echo.truth.is_none()).count();
        Counts {
            chirps,
            hits,
            detections,
            false_alarms,
            below_threshold: scan.echoes.len() - detections,
            misses: chirps - hits,
            outside_image: scan.detections().filter(|e| !image.contains(e.xt_m, e.yt_m)).count(),
            degenerate_facets: scene.target.meshes.iter().map(|m| m.degenerate_facets).sum(),
        }
    }
}

impl PowerRange {
    pub(super) fn new(scan: &Scan) -> Option<PowerRange> {
        let mut powers: Vec<f64> =
            scan.detections().map(|echo| dbm_from_watts(echo.power_w)).collect();
        powers.sort_by(f64::total_cmp);
        let (weakest, strongest) = (*powers.first()?, *powers.last()?);
        Some(PowerRange { weakest, median: powers[powers.len() / 2], strongest })
    }
}

/// The regions of a scene with what the radar received of them.
pub(super) fn regions<'a>(ready: &'a ReadyScene, scan: &Scan) -> Vec<RegionRecord<'a>> {
    let regions = ready.scene.target.regions.iter().zip(&ready.sheets);
    let mut regions: Vec<RegionRecord> = std::iter::zip(regions, &ready.material_of_region)
        .map(|((region, sheet), &material)| RegionRecord {
            name: &region.name,
            material,
            sheet: sheet.as_ref().map(Sheet::stack),
            facets: region.facets,
            hits: 0,
            detections: 0,
            strongest_dbm: None,
        })
        .collect();
    for truth in scan.echoes.iter().filter_map(|echo| echo.truth) {
        regions[usize::from(truth.region)].hits += 1;
    }
    for echo in scan.detections() {
        let Some(truth) = echo.truth else { continue };
        let region = &mut regions[usize::from(truth.region)];
        region.detections += 1;
        let power_dbm = dbm_from_watts(echo.power_w);
        region.strongest_dbm =
            Some(region.strongest_dbm.map_or(power_dbm, |strongest| strongest.max(power_dbm)));
    }
    regions
}
