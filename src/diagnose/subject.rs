//! What a diagnosis starts from, and whether it is enough.

use super::alarms::Alarms;
use super::error::DiagnoseError;
use super::folds::Folds;
use super::matching::Stray;
use super::observation::{Observation, ReceiverLimits};
use super::report::MeshPose;
use super::settings::{LEAST_BLOCKS, LEAST_DETECTIONS};
use crate::brdf::Brdf;
use crate::effects::{Effect, Receiver, Shot, Stage};

/// Share of detections that may lie below the threshold by the rounding of a file.
const MOST_BELOW: f64 = 0.01;
/// Powers below this ratio to the threshold are below it.
const BELOW: f64 = 0.999;
/// Numbers of looks with a speckle distribution.
const LOOKS: std::ops::RangeInclusive<f64> = 0.1..=1e4;

/// What a diagnosis starts from: everything declared of the scan.
#[derive(Clone, Copy)]
pub struct Subject<'a> {
    /// Instrument and target of each scan: of one, or of several of one target.
    pub stages: &'a [Stage<'a>],
    /// Scattering model of each region, where the refit begins.
    pub laws: &'a [Brdf],
    /// Declared effects of each scan, at fixed values.
    pub at_work: &'a [&'a [(&'a dyn Effect, Vec<f64>)]],
    /// The receiver without effects; its looks lie between 0.1 and 10⁴.
    pub receiver: Receiver,
    /// Threshold and range error.
    pub declared: ReceiverLimits,
    /// Every chirp that meets the target, scan after scan.
    pub shots: &'a [Shot],
    /// The observation of each shot.
    pub observations: &'a [Observation],
    /// Detections of each scan that belong to no shot and are no false alarms.
    pub strays: &'a [Vec<Stray>],
    /// What the chirps of each scan report that see no target.
    pub alarms: &'a [Alarms],
    /// Poses of the meshes, for the report.
    pub pose: &'a [MeshPose],
}

impl Subject<'_> {
    /// Refuses data that are too few or contradict the declarations.
    pub(super) fn check(&self, folds: &Folds) -> Result<(), DiagnoseError> {
        let (observations, shots) = (self.observations.len(), self.shots.len());
        if observations != shots {
            return Err(DiagnoseError::Unmatched { observations, shots });
        }
        if !LOOKS.contains(&self.receiver.looks) {
            return Err(DiagnoseError::Looks { looks: self.receiver.looks });
        }
        let detected = self.detected();
        if detected < LEAST_DETECTIONS {
            return Err(DiagnoseError::TooFew { detected });
        }
        let threshold_w = self.declared.threshold_w;
        let powers_w = self.observations.iter().filter_map(|seen| seen.power_w);
        let below = powers_w.filter(|power_w| *power_w < BELOW * threshold_w).count();
        if below as f64 > MOST_BELOW * detected as f64 {
            return Err(DiagnoseError::Threshold { below, detected, threshold_w });
        }
        if folds.blocks < LEAST_BLOCKS {
            return Err(DiagnoseError::TooSmall { blocks: folds.blocks });
        }
        Ok(())
    }

    /// Number of shots with a detection.
    pub(super) fn detected(&self) -> usize {
        self.observations.iter().filter(|seen| seen.power_w.is_some()).count()
    }
}
