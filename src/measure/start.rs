//! The rough pose from which a registration starts: by hand, or the best of some guesses.

use std::f64::consts::TAU;

use glam::DVec3;

use super::coarse;
use super::error::RegistrationError;
use super::settings::{Registration, Start};
use super::view::{View, median_point};
use crate::frames::{Global, Pose};

/// Yaws that are tried, around the full circle.
const YAWS: usize = 12;
/// Along the rays a gap counts no more than this, m.
const WORST_M: f64 = 0.05;

pub(super) fn rough_pose(
    view: &View,
    settings: &Registration,
) -> Result<Pose<Global, Global>, RegistrationError> {
    let pose = match settings.start {
        Start::Given(pose) => return Ok(pose),
        Start::Automatic => guesses(view)
            .filter_map(|guess| improved(view, settings, guess))
            .min_by(|a, b| a.0.total_cmp(&b.0)),
    };
    pose.map(|(_, pose)| pose).ok_or(RegistrationError::NothingInView)
}

/// Every yaw at every place.
fn guesses<'v>(view: &'v View) -> impl Iterator<Item = Pose<Global, Global>> + 'v {
    let middle = view.tracer.middle();
    let yaws = (0..YAWS).map(|step| TAU * step as f64 / YAWS as f64);
    yaws.flat_map(move |yaw_rad| {
        let turn = Pose::<Global, Global>::from_euler_xyz(DVec3::Y * yaw_rad, DVec3::ZERO);
        [middle, view.pivot].map(|to| {
            let from = (turn * crate::frames::Point::from(middle)).xyz;
            Pose::new(turn.rotation(), to - from)
        })
    })
}

/// A guess after a coarse alignment, and its mean error along the rays, m.
fn improved(
    view: &View,
    settings: &Registration,
    guess: Pose<Global, Global>,
) -> Option<(f64, Pose<Global, Global>)> {
    let quick = Registration { max_scans: 3, max_steps: 10, coarse_points: 500, ..*settings };
    let placed = onto_the_cloud(view, guess)?;
    let pose = coarse::align(view, &quick, placed, settings.still_m).ok()?.pose;
    let gaps = view.ray_gaps(&pose, WORST_M);
    let errors_m = gaps.iter().map(|gap| gap.map_or(WORST_M, |gap| gap.range_error_m.abs()));
    Some((errors_m.sum::<f64>() / gaps.len().max(1) as f64, pose))
}

/// Shifts a guess until the middle of the scanned part of the mesh is at the middle of the cloud.
fn onto_the_cloud(view: &View, mut pose: Pose<Global, Global>) -> Option<Pose<Global, Global>> {
    // A shift changes the scanned part, and so its middle, but this converges fast.
    const SHIFTS: usize = 3;
    for _ in 0..SHIFTS {
        let seen = view.tracer.scan(&pose, &view.chirps).into_iter().flatten();
        let places: Vec<DVec3> = seen.map(|seen| seen.hit.point.xyz).collect();
        if places.is_empty() {
            return None;
        }
        let shift_m = view.pivot - median_point(&places);
        pose = Pose::new(pose.rotation(), pose.translation_m() + shift_m);
    }
    Some(pose)
}
