//! Every chirp of a scan against the target.
//!
//! The scan pattern is known, so that every chirp is traced. A chirp that meets the target without a detection is
//! evidence, too: its power stayed below the threshold.

use rayon::prelude::*;

use super::error::DiagnoseError;
use crate::effects::{Shot, Stage, shot_at};
use crate::render::trace;
use crate::trace::ScanGeometry;

/// Traces the shot of every chirp of the stage that meets the target, along the axis of the beam.
///
/// # Errors
/// When no chirp does.
pub fn trace_shots(stage: &Stage) -> Result<Vec<Shot>, DiagnoseError> {
    let ScanGeometry { radar, chirps, .. } = stage.geometry;
    let footprints = trace(&stage.geometry, 1, &|_| {})?;
    let progress = chirps.progress();
    let places: Vec<_> = chirps.target_points_m(&radar.frames()).collect();
    let shots = places.par_iter().enumerate().filter_map(|(index, place)| {
        let hit = footprints.hits[index]?;
        let edge_m = footprints.edge_m[index];
        let missed = Shot::missed(chirps, index, progress[index]);
        let shot = Shot { xt_m: place.x, yt_m: place.y, edge_m, ..missed };
        Some(shot_at(stage, &shot, hit))
    });
    Ok(shots.collect())
}
