//! What `report.json` of a cloud holds.

use serde::Serialize;

use crate::diagnose::{Base, BaseValue, MeshPose, Report, Value};
use crate::report::choice::UntriedEffect;
use crate::units::dbm_from_watts;

/// A diagnosis of a cloud, with levels in dBm, and the effects that it did not try.
#[derive(Serialize)]
pub struct CloudRecord<'a> {
    /// The diagnosis.
    #[serde(flatten)]
    pub report: &'a Report,
    base: BaseRecord<'a>,
    not_tried: &'a [UntriedEffect],
}

impl<'a> CloudRecord<'a> {
    pub(super) fn new(report: &'a Report, not_tried: &'a [UntriedEffect]) -> CloudRecord<'a> {
        CloudRecord { report, base: BaseRecord::new(&report.base), not_tried }
    }
}

/// The model that the effects are added to, with levels in dBm.
#[derive(Serialize)]
pub(super) struct BaseRecord<'a> {
    parameters: &'a [BaseValue],
    /// Null for a radar that was calibrated.
    level_db: Option<Value>,
    looks: f64,
    threshold_dbm: f64,
    /// Null for a receiver without noise.
    noise_dbm: Option<f64>,
    range_sd_m: f64,
    pose: &'a [MeshPose],
    converged: bool,
}

impl<'a> BaseRecord<'a> {
    pub fn new(base: &'a Base) -> BaseRecord<'a> {
        BaseRecord {
            parameters: &base.parameters,
            level_db: base.level_db,
            looks: base.looks,
            threshold_dbm: dbm_from_watts(base.threshold_w),
            noise_dbm: (base.noise_w > 0.0).then(|| dbm_from_watts(base.noise_w)),
            range_sd_m: base.range_sd_m,
            pose: &base.pose,
            converged: base.converged,
        }
    }
}
