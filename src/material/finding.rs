//! Effects that a diagnosis tried on a material, found or not.

use serde::{Deserialize, Serialize};

use super::error::{MaterialError, value};
use super::number_check::NumberCheck;

/// One thing that a diagnosis tried, whether it was found or not.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Finding {
    /// The effect, or the covariate of a structure that no effect explains.
    pub effect: String,
    /// What came of it.
    pub verdict: FindingVerdict,
    /// Name of the fit that it began with; none for one that is not stored.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fit_before: Option<String>,
    /// Name of the fit with everything that was found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fit_after: Option<String>,
    /// Gain in ln likelihood by the effect.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gain: Option<f64>,
    /// The largest gain of something meaningless with as many numbers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub placebo_gain: Option<f64>,
    /// Probability of so much by chance, 0 to 1, for one test alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub p: Option<f64>,
    /// Gain in ln p of what was held out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub score_difference: Option<f64>,
    /// Its standard error, 0 or more.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub score_difference_sd: Option<f64>,
    /// Root mean square of what it changes in the powers, dB, 0 or more.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size_db: Option<f64>,
    /// Root mean square error on held-out data without what was found, dB, 0 or more.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rms_before_db: Option<f64>,
    /// Root mean square error on held-out data with what was found, dB, 0 or more.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rms_after_db: Option<f64>,
    /// Effects that predict these data as well.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub confusable_with: Vec<String>,
    /// Key of the source, which says of what data this is.
    pub source: String,
}

/// What came of trying an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FindingVerdict {
    /// It is there.
    Found,
    /// It was tried, and these data do not show it.
    NotFound,
    /// Structure that no effect explains.
    Unexplained,
}

impl FindingVerdict {
    /// The word that files and the database use.
    pub fn as_str(self) -> &'static str {
        match self {
            FindingVerdict::Found => "found",
            FindingVerdict::NotFound => "not-found",
            FindingVerdict::Unexplained => "unexplained",
        }
    }
}

impl Finding {
    pub(super) fn validate(&self, place: &str) -> Result<(), MaterialError> {
        let check = NumberCheck::new(place);
        if self.effect.trim().is_empty() {
            return Err(value(place, "names no effect", "say what was tried in `effect`"));
        }
        check.finite("the gain", self.gain.into_iter().chain(self.placebo_gain))?;
        check.finite("the difference of scores", self.score_difference)?;
        check.not_negative("the deviation of the score", self.score_difference_sd)?;
        check.not_negative("the size", self.size_db)?;
        check.not_negative("the error", self.rms_before_db.into_iter().chain(self.rms_after_db))?;
        if self.p.is_some_and(|p| !(0.0..=1.0).contains(&p)) {
            return Err(value(place, "p is not between 0 and 1", "mend it or leave it out"));
        }
        Ok(())
    }
}
