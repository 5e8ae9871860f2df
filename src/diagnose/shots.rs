//! Every chirp of a scan against the target.
//!
//! The scan pattern is known, so that every chirp is traced. A chirp that meets the target without a detection is
//! evidence, too: its power stayed below the threshold.
//!
//! Of a target with sheets a chirp has an echo for each surface that a receiver parts, and each is a shot: its field of
//! speckle is its own. A chirp that reports one of them says of the others what they stayed below (`matching.rs`).

use rayon::prelude::*;

use super::error::DiagnoseError;
use super::unresolved::Unresolved;
use crate::brdf::Brdf;
use crate::effects::{Model, Receiver, Shot, Stage, shot_at};
use crate::render::{Layer, Setup, layers, trace, trace_placed};
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

/// The shots of every echo along the axes of the stage's beam, for a target with sheets, and what else each of them holds.
/// `laws` are those of which the setup's surfaces are made.
///
/// # Errors
/// When no chirp meets the target.
pub(super) fn trace_layers(
    stage: &Stage,
    setup: &Setup,
    laws: &[Brdf],
) -> Result<(Vec<Shot>, Unresolved), DiagnoseError> {
    let footprints = trace_placed(setup, 1, &|_| {})?;
    let ScanGeometry { radar, chirps, .. } = stage.geometry;
    let (laws, effects) = (laws.to_vec(), Vec::new());
    let bare = Model { laws, receiver: Receiver::LINEAR, effects, level: 1.0 };
    let progress = chirps.progress();
    let places: Vec<_> = chirps.target_points_m(&radar.frames()).collect();
    let (mut shots, mut unresolved) = (Vec::new(), Unresolved::default());
    for (index, echoes) in layers(setup, &footprints).into_iter().enumerate() {
        let (missed, place) = (Shot::missed(chirps, index, progress[index]), places[index]);
        let missed = Shot { xt_m: place.x, yt_m: place.y, ..missed };
        for mut echo in echoes {
            echo.sort_by(|a, b| b.power_w.total_cmp(&a.power_w));
            let parts: Vec<Shot> =
                echo.iter().map(|layer| shot_of(stage, &bare, &missed, layer)).collect();
            if let [strongest, others @ ..] = &parts[..] {
                unresolved.add(strongest, others);
                shots.push(*strongest);
            }
        }
    }
    Ok((shots, unresolved))
}

/// The shot of a surface: what the renderer says of its echo over what its law alone would.
fn shot_of(stage: &Stage, bare: &Model, missed: &Shot, layer: &Layer) -> Shot {
    let Layer { hit, sheets, edge_m, .. } = *layer;
    let shot = Shot { edge_m, sheets, ..shot_at(stage, missed, hit) };
    let bare_w = bare.arrived(stage, &shot).power_w;
    let by_sheets = if bare_w > 0.0 { layer.power_w / bare_w } else { 0.0 };
    Shot { by_sheets, longer_m: layer.range_m - hit.range_m, ..shot }
}
