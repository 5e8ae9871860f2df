//! Sheets that return and let through more than they receive.
//!
//! What layers reflect, let through and absorb adds up to 1. A law that says by itself what a sheet returns knows
//! nothing of what passes, and the two together can exceed what arrives.

use super::sheet::Sheet;
use crate::brdf::{ALBEDO_SLACK, incidences_rad};

/// A sheet with gain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SheetGain {
    /// The incidence at which it is largest, rad.
    pub theta_rad: f64,
    /// What the sheet returns there in all directions, over what it receives.
    pub returned: f64,
    /// What passes there, over what it receives.
    pub passed: f64,
}

impl SheetGain {
    /// The largest gain of a sheet between two angles of incidence, rad; none where all that leaves it is at most what
    /// it receives.
    pub fn of(sheet: &Sheet, range_rad: [f64; 2]) -> Option<SheetGain> {
        let gains = incidences_rad(range_rad).into_iter().map(|theta_rad| SheetGain {
            theta_rad,
            returned: sheet.albedo(theta_rad),
            passed: sheet.transmittance(theta_rad.cos()),
        });
        let found = gains.filter(|gain| gain.total() > 1.0 + ALBEDO_SLACK);
        found.max_by(|a, b| a.total().total_cmp(&b.total()))
    }

    fn total(&self) -> f64 {
        self.returned + self.passed
    }

    /// The gain as the end of a sentence about a sheet.
    pub fn words(&self) -> String {
        let [returned, passed, more] =
            [self.returned, self.passed, self.total() - 1.0].map(|share| 100.0 * share);
        format!(
            "returns {returned:.0} % of what it receives at an incidence of {:.0}° and lets {passed:.0} % pass, {more:.0} % too \
             much",
            self.theta_rad.to_degrees()
        )
    }
}
