//! The findings on a fit, from its rows, its numbers and their uncertainty.

use super::coordinates::{DIFFUSE_LEVEL, LOOKS, MOST_LOOKS, SPECULAR_LEVEL};
use super::goodness::correlation_of_neighbours;
use super::interval::DEVIATE_95;
use super::result::FitResult;
use super::search::SearchResult;
use super::settings::Method;
use super::uncertainty::Uncertainty;
use super::verdict::Finding;
use crate::brdf::{Brdf, Excess, ParameterError};
use crate::formats::words::significant;
use crate::material::{Estimate, Illumination, Observation};
use crate::measure::Curve;

/// Correlation from which two numbers are reported as hard to distinguish.
const CORRELATED: f64 = 0.95;
/// Kolmogorov's distance times √rows that chance exceeds once in a hundred times.
const KOLMOGOROV_1_PERCENT: f64 = 1.63;
/// Deviation of a normal number that chance exceeds once in a thousand times, and detections of which the correlation of
/// neighbours is normal enough for it.
const NORMAL_1_IN_1000: f64 = 3.09;
const LEAST_NEIGHBOURS: usize = 20;
/// Detections for each fitted number below which the model is not tested, and in all.
const ROWS_PER_NUMBER: usize = 3;
const LEAST_ROWS: usize = 12;
/// The split where the method has none, degrees.
const SPLIT_DEG: f64 = 6.0;

/// The findings on a fit to a curve.
pub(super) fn judge(result: &FitResult, found: &SearchResult, curve: &Curve) -> Vec<Finding> {
    let rows = curve.observations.as_slice();
    let range = result.model.validate();
    let mut findings = Vec::new();
    // Out of range k follows from the levels and was not chosen.
    if let Some(k) = result.gauge_k.filter(|_| range.is_ok()) {
        findings.push(Finding::Gauge { k });
    }
    if !result.converged {
        findings.push(Finding::NotConverged { stop: result.stop });
    }
    let (agreeing, starts) = (result.agreeing_starts, result.fit.starts);
    // The likelihood's starts are to find its optima; that they end apart is a failure where it is more than chance.
    if result.fit.method != Method::Censored && 2 * agreeing < starts {
        findings.push(Finding::StartsDisagree { agreeing, starts });
    }
    findings.extend(judge_rows(result, rows));
    let Illumination { relative, only_detected, .. } = curve.illumination;
    findings.extend(relative.then_some(Finding::Relative));
    if only_detected && result.fit.method != Method::Censored {
        findings.push(Finding::CutIgnored);
    }
    findings.extend(judge_numbers(result, found));
    if let Some(beam_rad) = result.fit.beam_rad {
        judge_widths(result, found, beam_rad, &mut findings);
    }
    if !relative {
        findings.extend(judge_energy(result, rows));
    }
    if let Err(ParameterError { path, value, .. }) = range {
        let value = significant(value, 4);
        let held = result.fit.fixed.iter().map(|(path, _)| path.clone()).collect();
        findings.retain(|finding| !is_level_at_bound(finding));
        findings.push(Finding::OutOfRange { problem: format!("{path} would be {value}"), held });
    }
    let looks = result.estimate(LOOKS).and_then(|looks| Some((looks.value, looks.interval_95?)));
    if let Some((looks, [_, high])) = looks
        && result.fit.method == Method::Censored
        && high < 1.0
    {
        findings.push(Finding::MoreThanSpeckle { looks });
    }
    if scatters_less_than_any_speckle(result) {
        return findings;
    }
    findings.extend(judge_neighbours(result, rows));
    let limit = KOLMOGOROV_1_PERCENT / f64::from(result.goodness.rows.max(1)).sqrt();
    let ks_distance = result.goodness.ks_distance;
    if result.fit.method == Method::Censored && ks_distance > limit {
        findings.push(Finding::PoorFit { ks_distance, limit });
    }
    findings
}

/// Whether a level of a mixture stopped at its bound: where the model is out of range, that says the same.
fn is_level_at_bound(finding: &Finding) -> bool {
    match finding {
        Finding::AtBound { name, .. } => [SPECULAR_LEVEL, DIFFUSE_LEVEL].contains(&name.as_str()),
        _ => false,
    }
}

/// Whether the levels scatter less about the model than the most looks leave: of levels without noise no law of speckle
/// says whether a model explains them, and what is left of them is rounding.
fn scatters_less_than_any_speckle(result: &FitResult) -> bool {
    let looks = result.estimate(LOOKS).map_or(0.0, |looks| looks.value);
    looks >= 0.999 * MOST_LOOKS && result.goodness.z_variance < 1.0
}

/// That residuals of neighbouring angles are alike.
fn judge_neighbours(result: &FitResult, rows: &[Observation]) -> Option<Finding> {
    let FitResult { fit, coordinates, at, .. } = result;
    let detected = rows.iter().filter(|row| !row.is_censored()).count();
    if fit.method != Method::Censored || detected < LEAST_NEIGHBOURS {
        return None;
    }
    let correlation = correlation_of_neighbours(fit, coordinates, at, rows);
    let limit = NORMAL_1_IN_1000 / (detected as f64).sqrt();
    (correlation > limit).then_some(Finding::NeighboursAlike { correlation, limit })
}

/// Which angles lack a detection, and which rows the method does not use.
fn judge_rows(result: &FitResult, rows: &[Observation]) -> Vec<Finding> {
    let mut findings = Vec::new();
    let split_deg = match result.fit.method {
        Method::Mse { split_rad } => split_rad.to_degrees(),
        _ => SPLIT_DEG,
    };
    let detected: Vec<&Observation> = rows.iter().filter(|row| !row.is_censored()).collect();
    let tilts_deg = detected.iter().map(|row| row.aspect().half_angle_rad().to_degrees());
    let near = tilts_deg.filter(|tilt_deg| *tilt_deg < split_deg).count();
    let is_mixture = matches!(result.model, Brdf::Mixture(_));
    if is_mixture && near == 0 {
        findings.push(Finding::NoSpecularRows { below_deg: split_deg });
    }
    if is_mixture && near == detected.len() {
        findings.push(Finding::NoDiffuseRows { above_deg: split_deg });
    }
    let unknowns = result.estimates.len();
    if detected.len() < LEAST_ROWS.max(ROWS_PER_NUMBER * unknowns) {
        findings.push(Finding::FewRows { detected: detected.len(), unknowns });
    }
    let censored = rows.len() - detected.len();
    if result.fit.method != Method::Censored && censored > 0 {
        findings.push(Finding::CensoredIgnored { censored, rows: rows.len() });
    }
    findings
}

/// Replaces what is said of the width of a lobe that the beam does not resolve: one within its error of zero.
fn judge_widths(
    result: &FitResult,
    found: &SearchResult,
    beam_rad: f64,
    findings: &mut Vec<Finding>,
) {
    for name in result.model.lobe_widths() {
        let place = result.estimates.iter().position(|estimate| estimate.name == name);
        let Some((place, coordinate)) =
            place.and_then(|place| Some((place, result.coordinates.list.get(place)?)))
        else {
            continue;
        };
        let Estimate { value, sd, interval_95, .. } = result.estimates[place];
        let is_open_below = found.profiles.get(place).is_some_and(|ends| {
            ends.is_some_and(|[low, _]| low.open && coordinate.value(low.at) == coordinate.min)
        });
        let is_within_its_error = sd.is_some_and(|sd| value < DEVIATE_95 * sd);
        let is_unseen = sd.is_none() && (value == coordinate.min || value < beam_rad);
        if !(is_open_below || is_within_its_error || is_unseen) {
            continue;
        }
        findings.retain(|finding| match finding {
            Finding::AtBound { name: of, value } | Finding::OpenInterval { name: of, value } => {
                *of != name || *value != coordinate.min
            }
            Finding::Unconstrained { name: of } => *of != name,
            _ => true,
        });
        let below = interval_95.map(|[_, high]| high);
        findings.push(Finding::NotResolved { name, below, beam_rad });
    }
}

/// That the model reflects more than it receives at an angle of the rows.
fn judge_energy(result: &FitResult, rows: &[Observation]) -> Option<Finding> {
    let last_rad = rows.iter().map(|row| row.theta_i_rad).fold(0.0, f64::max);
    let Excess { theta_rad, albedo } = Excess::of(&result.model, [0.0, last_rad])?;
    Some(Finding::TooMuch { theta_deg: theta_rad.to_degrees(), albedo })
}

/// Which numbers the data do not determine, or only with others.
fn judge_numbers(result: &FitResult, found: &SearchResult) -> Vec<Finding> {
    let estimates = &result.estimates;
    let uncertainty = &found.uncertainty;
    let mut findings = Vec::new();
    for group in &uncertainty.together {
        findings.push(match group.as_slice() {
            [one] => Finding::Unconstrained { name: name(estimates, *one) },
            _ => Finding::OnlyTogether {
                names: group.iter().map(|&index| name(estimates, index)).collect(),
            },
        });
    }
    for &index in &uncertainty.loose {
        findings.push(Finding::Unconstrained { name: name(estimates, index) });
    }
    let pairs = estimates.iter().zip(&result.coordinates.list);
    for ((estimate, coordinate), _) in pairs.zip(&uncertainty.bounded).filter(|(_, held)| **held) {
        let value = coordinate.nearer_bound(estimate.value);
        findings.push(Finding::AtBound { name: estimate.name.clone(), value });
    }
    findings.extend(judge_correlations(estimates, uncertainty));
    for (index, profile) in found.profiles.iter().enumerate() {
        for end in profile.iter().flatten().filter(|end| end.open) {
            let coordinate = result.coordinates.list.get(index);
            let value = coordinate.map_or(f64::NAN, |coordinate| coordinate.value(end.at));
            findings.push(Finding::OpenInterval { name: name(estimates, index), value });
        }
    }
    findings
}

fn judge_correlations(estimates: &[Estimate], uncertainty: &Uncertainty) -> Vec<Finding> {
    let mut findings = Vec::new();
    let known: Vec<usize> =
        (0..estimates.len()).filter(|&index| uncertainty.is_identified(index)).collect();
    for (place, &a) in known.iter().enumerate() {
        for &b in &known[place + 1..] {
            let scale = uncertainty.deviation(a) * uncertainty.deviation(b);
            let correlation = uncertainty.covariance[(a, b)] / scale;
            if correlation.abs() > CORRELATED {
                let names = [name(estimates, a), name(estimates, b)];
                findings.push(Finding::HardToTellApart { names, correlation });
            }
        }
    }
    findings
}

fn name(estimates: &[Estimate], index: usize) -> String {
    estimates.get(index).map_or("", |estimate| &estimate.name).to_owned()
}
