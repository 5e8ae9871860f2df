//! What a diagnosis tried, as a material keeps it: found or not.

use super::words::not_found;
use crate::diagnose::{Candidate, Found, Report, Unexplained};
use crate::material::{Finding, FindingVerdict};

/// What was found, what was tried and not found, and what no effect explains.
pub(super) fn findings(
    report: &Report,
    fit_before: Option<&str>,
    fit_after: Option<&str>,
    source: &str,
) -> Vec<Finding> {
    let bare = |effect: &str, verdict: FindingVerdict| Finding {
        effect: effect.to_owned(),
        verdict,
        fit_before: fit_before.map(str::to_owned),
        fit_after: fit_after.map(str::to_owned),
        gain: None,
        placebo_gain: None,
        p: None,
        score_difference: None,
        score_difference_sd: None,
        size_db: None,
        rms_before_db: finite(report.error.before.rmse_db),
        rms_after_db: finite(report.error.after.rmse_db),
        confusable_with: Vec::new(),
        source: source.to_owned(),
    };
    let found = |effect: &Found| Finding {
        gain: finite(effect.evidence.gain),
        placebo_gain: finite(effect.evidence.placebo_gain),
        score_difference: finite(effect.evidence.held_out_gain),
        score_difference_sd: finite(effect.evidence.held_out_se),
        size_db: finite(effect.evidence.size_db),
        confusable_with: effect.class.iter().map(|name| (*name).to_owned()).collect(),
        ..bare(effect.name, FindingVerdict::Found)
    };
    let absent = |tried: &Candidate| Finding {
        gain: finite(tried.gain),
        placebo_gain: tried.placebo_gain.and_then(finite),
        score_difference: tried.held_out.and_then(|[gain, _]| finite(gain)),
        score_difference_sd: tried.held_out.and_then(|[_, error]| finite(error)),
        size_db: finite(tried.size_db),
        ..bare(tried.name, FindingVerdict::NotFound)
    };
    let unexplained = |left: &Unexplained| Finding {
        p: finite(left.p_value).map(|p| p.clamp(0.0, 1.0)),
        size_db: finite(left.strength_db),
        ..bare(&left.covariate, FindingVerdict::Unexplained)
    };
    let mut all: Vec<Finding> = report.effects.iter().map(found).collect();
    all.extend(not_found(report).map(absent));
    all.extend(report.unexplained.iter().map(unexplained));
    all
}

fn finite(number: f64) -> Option<f64> {
    Some(number).filter(|number| number.is_finite())
}
