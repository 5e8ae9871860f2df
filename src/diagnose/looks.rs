//! From a scan and a measured cloud to what every chirp has seen.
//!
//! The scan pattern is known, so that every chirp is traced against the target. One that should have
//! hit and gave no detection is evidence too: its power stayed below the threshold.

use std::collections::HashMap;

use rayon::prelude::*;

use super::DiagnoseError;
use crate::effects::{Look, Stage};
use crate::frames::{Direction, Pose};
use crate::measure::cloud::{Cloud, CloudPoint};
use crate::radar::{Chirps, Radar};
use crate::render::{LocalFrame, trace};
use crate::units::watts_from_dbm;

/// What one chirp that should hit the target has seen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Observation {
    /// Received power, W; `None` where nothing was detected.
    pub power_w: Option<f64>,
    /// Range, m; `None` where nothing was detected or the cloud does not tell.
    pub range_m: Option<f64>,
}

/// A cloud sorted by the looks of its scan.
#[derive(Clone, Debug, PartialEq)]
pub struct Matched {
    /// One for each look.
    pub observations: Vec<Observation>,
    /// Detections of chirps that meet no target, or far from where they meet it.
    pub false_alarms: usize,
}

/// One look, along the axis of the beam, for every chirp that meets the target.
///
/// # Errors
/// When no chirp does.
pub fn looks(stage: &Stage, radar: &Radar, chirps: &Chirps) -> Result<Vec<Look>, DiagnoseError> {
    let footprints = trace(radar, chirps, stage.bvh, 1, &|_| {})?;
    let places: Vec<_> = chirps.target_points_m(&radar.frames()).collect();
    let look = |index: usize| {
        let hit = (*footprints.hits.get(index)?)?;
        let ray = *chirps.rays.get(index)?;
        let region = stage.region_of_facet.get(hit.facet as usize).copied().unwrap_or(0);
        let grain = stage.grain_of_region.get(usize::from(region)).copied();
        let back = -ray.direction.xyz();
        let frame = LocalFrame::new(stage.bvh.mesh(), &hit, back, grain.unwrap_or(glam::DVec3::Y));
        let towards: Direction<_> = frame.local(back);
        let [x, y, _] = towards.xyz().to_array();
        let place = places.get(index)?;
        Some(Look {
            chirp: *chirps.number.get(index)?,
            time_s: chirps.time_s.get(index).copied().unwrap_or(0.0),
            progress: chirps.progress(index),
            ray,
            hit,
            normal: frame.normal,
            target: Pose::NONE,
            azimuth_rad: y.atan2(x),
            region,
            xt_m: place.x,
            yt_m: place.y,
            edge_m: footprints.edge_m.get(index).copied().unwrap_or(0.0),
        })
    };
    Ok((0..chirps.rays.len()).into_par_iter().filter_map(look).collect())
}

/// Sorts a cloud by the looks. A detection further than `gate_m` from where its chirp meets the target
/// is a false alarm, and its chirp then counts as one that saw nothing.
///
/// # Errors
/// When a point has no chirp number.
pub fn matched(cloud: &Cloud, looks: &[Look], gate_m: f64) -> Result<Matched, DiagnoseError> {
    let index_of_chirp: HashMap<u32, usize> =
        looks.iter().enumerate().map(|(index, look)| (look.chirp, index)).collect();
    let mut observations = vec![Observation::default(); looks.len()];
    let mut false_alarms = 0;
    for (number, point) in cloud.points().iter().enumerate() {
        let chirp = point.chirp.ok_or(DiagnoseError::Unnumbered { point: number })?;
        let index = index_of_chirp.get(&chirp).copied();
        let seen = index.and_then(|index| Some((looks.get(index)?, observations.get_mut(index)?)));
        match seen {
            Some((look, observation)) if off_m(point, look) <= gate_m => {
                let range_m = Some(range_m(point, look));
                let power_w = Some(watts_from_dbm(point.power_dbm));
                *observation = Observation { power_w, range_m };
            }
            _ => false_alarms += 1,
        }
    }
    Ok(Matched { observations, false_alarms })
}

fn range_m(point: &CloudPoint, look: &Look) -> f64 {
    point.range_m.unwrap_or_else(|| look.ray.origin.distance_m(point.point))
}

fn off_m(point: &CloudPoint, look: &Look) -> f64 {
    (range_m(point, look) - look.hit.range_m).abs()
}
