//! Every chirp of a scan against the target.
//!
//! The scan pattern is known, so that every chirp is traced. A chirp that meets the target without a detection is
//! evidence, too: its power stayed below the threshold.

use glam::DVec3;
use rayon::prelude::*;

use super::error::DiagnoseError;
use crate::effects::{Shot, Stage};
use crate::frames::{Direction, Pose};
use crate::radar::Chirps;
use crate::render::{LocalFrame, trace};
use crate::trace::{Hit, ScanGeometry};

/// Traces the shot of every chirp of the stage that meets the target, along the axis of the beam.
///
/// # Errors
/// When no chirp does.
pub fn trace_shots(stage: &Stage) -> Result<Vec<Shot>, DiagnoseError> {
    let ScanGeometry { radar, chirps, .. } = stage.geometry;
    let footprints = trace(&stage.geometry, 1, &|_| {})?;
    let places: Vec<_> = chirps.target_points_m(&radar.frames()).collect();
    let progress = chirps.progress();
    let shots = (0..chirps.rays.len()).into_par_iter().filter_map(|index| {
        let hit = (*footprints.hits.get(index)?)?;
        let place = places.get(index)?;
        let edge_m = footprints.edge_m.get(index).copied().unwrap_or(0.0);
        let missed = missed_shot(chirps, &progress, index)?;
        Some(Shot { xt_m: place.x, yt_m: place.y, edge_m, ..on_target(stage, hit, missed) })
    });
    Ok(shots.collect())
}

/// A shot with its intersection.
fn on_target(stage: &Stage, hit: Hit, shot: Shot) -> Shot {
    let region = stage.geometry.region_of_facet.get(hit.facet as usize).copied().unwrap_or(0);
    let grain = stage.grain_of_region.get(usize::from(region)).copied().unwrap_or(DVec3::Y);
    let back = -shot.ray.direction.xyz();
    let frame = LocalFrame::new(stage.geometry.bvh.mesh(), &hit, back, grain);
    let towards: Direction<_> = frame.local(back);
    let [x, y, _] = towards.xyz().to_array();
    Shot { hit, normal: frame.normal, azimuth_rad: y.atan2(x), region, ..shot }
}

/// The shot of a chirp that does not meet the target; `progress`: that of every chirp through the scan.
pub(super) fn missed_shot(chirps: &Chirps, progress: &[f64], index: usize) -> Option<Shot> {
    let ray = *chirps.rays.get(index)?;
    let hit = Hit { facet: u32::MAX, range_m: 0.0, point: ray.origin, cos_theta: 1.0 };
    Some(Shot {
        chirp: *chirps.number.get(index)?,
        time_s: chirps.time_s.get(index).copied().unwrap_or(0.0),
        progress: *progress.get(index)?,
        ray,
        hit,
        normal: -ray.direction.xyz(),
        target: Pose::NONE,
        azimuth_rad: 0.0,
        region: 0,
        xt_m: 0.0,
        yt_m: 0.0,
        edge_m: 0.0,
    })
}
