//! The effects that a diagnosis tried, as a material keeps them: found or not.

use crate::diagnose::{Candidate, FoundEffect, Report, ResidualStructure};
use crate::material::{Finding, FindingVerdict};

/// The findings of a diagnosis: effects that were found, effects that were tried and not found, and trends that
/// no effect explains.
pub(super) fn findings(
    report: &Report,
    fit_before: Option<&str>,
    fit_after: Option<&str>,
    source: &str,
) -> Vec<Finding> {
    let mut blank = Finding {
        effect: String::new(),
        verdict: FindingVerdict::Found,
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
    let mut findings: Vec<Finding> = Vec::new();
    for effect in &report.effects {
        findings.push(found(effect, blank.clone()));
    }
    blank.verdict = FindingVerdict::NotFound;
    for candidate in report.not_found() {
        // Of several clouds one effect may be tried for each.
        if findings.iter().all(|known| known.effect != candidate.name) {
            findings.push(not_found(candidate, blank.clone()));
        }
    }
    blank.verdict = FindingVerdict::Unexplained;
    for trend in &report.unexplained {
        findings.push(unexplained(trend, blank.clone()));
    }
    findings
}

fn found(effect: &FoundEffect, blank: Finding) -> Finding {
    Finding {
        effect: effect.name.to_owned(),
        gain: finite(effect.evidence.gain),
        placebo_gain: finite(effect.evidence.placebo_gain),
        score_difference: finite(effect.evidence.held_out_gain),
        score_difference_sd: finite(effect.evidence.held_out_se),
        size_db: finite(effect.evidence.size_db),
        confusable_with: effect.class.iter().map(|name| (*name).to_owned()).collect(),
        ..blank
    }
}

fn not_found(candidate: &Candidate, blank: Finding) -> Finding {
    Finding {
        effect: candidate.name.to_owned(),
        gain: finite(candidate.gain),
        placebo_gain: candidate.placebo_gain.and_then(finite),
        score_difference: candidate.held_out.and_then(|[gain, _]| finite(gain)),
        score_difference_sd: candidate.held_out.and_then(|[_, error]| finite(error)),
        size_db: finite(candidate.size_db),
        ..blank
    }
}

fn unexplained(trend: &ResidualStructure, blank: Finding) -> Finding {
    Finding {
        effect: trend.covariate.clone(),
        p: finite(trend.p_value).map(|p| p.clamp(0.0, 1.0)),
        size_db: finite(trend.strength_db),
        ..blank
    }
}

/// Files have no word for infinity.
fn finite(number: f64) -> Option<f64> {
    Some(number).filter(|number| number.is_finite())
}
