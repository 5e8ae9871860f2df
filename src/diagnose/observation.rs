//! The record of a chirp, and the declared properties of the receiver.

use crate::effects::MeanEcho;
use crate::frames::{Global, Point};

/// dB in one e-fold.
pub(super) const DB: f64 = 10.0 / std::f64::consts::LN_10;

/// The record of one chirp that meets the target.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Observation {
    /// Received power, W; `None` where nothing was detected.
    pub power_w: Option<f64>,
    /// Range, m; `None` where nothing was detected or the cloud has no range.
    pub range_m: Option<f64>,
    /// Where the cloud has the detection; `None` where nothing was detected, or where the record is simulated.
    pub point: Option<Point<Global>>,
    /// Place of the detection among those of its chirp, by power: 1 is the strongest; `None` where nothing was detected, or where
    /// chirps report one detection at most.
    pub rank: Option<u32>,
    /// Power that an echo without a detection stayed below, W: that of a false alarm which was reported instead, or
    /// 1 MW where a nearer detection ended the chirp; `None` for the threshold.
    pub limit_w: Option<f64>,
}

/// Power that no echo reaches, W: a chirp that a nearer detection has ended says nothing of the target.
pub(super) const NO_LIMIT_W: f64 = 1e6;

impl Observation {
    /// A detection.
    pub(super) fn detected(power_w: f64, range_m: Option<f64>) -> Observation {
        Observation { power_w: Some(power_w), range_m, ..Observation::default() }
    }

    /// Power that an echo without a detection stayed below, W.
    pub(super) fn limit_w(&self, declared: ReceiverLimits) -> f64 {
        self.limit_w.unwrap_or(declared.threshold_w)
    }

    /// Received power, or the one that the echo stayed below, W.
    pub(super) fn level_w(&self, declared: ReceiverLimits) -> f64 {
        self.power_w.unwrap_or(self.limit_w(declared))
    }
}

/// Declared properties of the receiver that no effect changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReceiverLimits {
    /// Least power of a detection, W.
    pub threshold_w: f64,
    /// Standard deviation of a range, m; 0 where ranges are not to be used.
    pub range_sd_m: f64,
}

impl ReceiverLimits {
    /// Measured less expected range, m; `None` where either is missing or ranges are not to be used.
    pub(super) fn range_off_m(&self, arrived: &MeanEcho, seen: &Observation) -> Option<f64> {
        let range_m = seen.range_m.filter(|_| self.range_sd_m > 0.0 && arrived.range_m > 0.0)?;
        Some(range_m - arrived.range_m)
    }
}
