//! Compares a stored fit with a new one: the model that is rendered, the numbers and their uncertainty, and the
//! sentences. The tolerances follow from the new fit alone.

use crate::brdf::{Brdf, ThroughBeam};
use crate::fit::coordinates::{DIFFUSE_LEVEL, LOOKS, SPECULAR_LEVEL};
use crate::fit::interval::DEVIATE_95;
use crate::fit::result::FitResult;
use crate::fit::verdict::Finding;
use crate::material::{self, Aspect, CrossValidation, Estimate, FitReport, Goodness, Observation};
use crate::measure::curve::Curve;

/// How far ln likelihoods, or half sums of squares, of two searches for one optimum may differ: where
/// they stopped, and rounding, relative. One standard deviation of a number is half a unit.
const SAME_OBJECTIVE: f64 = 0.01;
const ROUNDING: f64 = 1e-6;
/// How far numbers may, in the standard deviations of the new fit.
const SAME_NUMBER_SD: f64 = 0.1;
/// How far standard deviations of two searches for one optimum may differ, relative.
const SAME_SD: f64 = 0.05;
/// How far sums over the rows may, relative and in dB.
const SAME_SUM: f64 = 0.02;
const SAME_LEVEL_DB: f64 = 0.005;
/// How far numbers in sentences may, relative and absolute.
const SAME_WORDS: [f64; 2] = [0.02, 0.01];
/// How near to its limit a finding may be there or not.
const BORDERLINE: f64 = 0.05;
/// Angles at which two models are compared.
const ANGLES: u32 = 32;

/// What differs, a sentence each.
pub(super) fn compare(stored: &material::Fit, found: &FitResult, curve: &Curve) -> Vec<String> {
    let Some(report) = &stored.report else { return Vec::new() };
    let new =
        found.stored(&stored.name, stored.curve.as_deref().unwrap_or_default(), &stored.source);
    let Some(new_report) = &new.report else { return Vec::new() };
    let mut differences = Vec::new();
    let gap = (report.objective - found.objective).abs();
    if gap.is_nan() || gap > SAME_OBJECTIVE + ROUNDING * report.objective.abs() {
        differences.push(format!(
            "its objective is stored as {:.4}, and a new fit reaches {:.4}",
            report.objective, found.objective
        ));
    }
    differences.extend(estimates(report, found));
    differences.extend(model(stored, found, curve));
    differences.extend(covariances(stored, &new, found));
    differences.extend(settings(stored, report, new_report, &new.estimator));
    differences.extend(goodness(&report.goodness, &new_report.goodness));
    differences.extend(report.held_out.as_ref().and_then(|old| held_out(old, found, curve)));
    differences.extend(verdict(&report.verdict, &found.verdict));
    differences
}

/// The numbers of the report, their deviations and intervals.
fn estimates(report: &FitReport, found: &FitResult) -> Vec<String> {
    if report.estimates.len() != found.estimates.len()
        || report.estimates.iter().any(|stored| found.estimate(&stored.name).is_none())
    {
        return vec!["its report lists other numbers than a new fit finds".to_owned()];
    }
    let pairs = report.estimates.iter().filter_map(|e| Some((e, found.estimate(&e.name)?)));
    pairs.flat_map(|(stored, new)| estimate(stored, new)).collect()
}

fn estimate(stored: &Estimate, new: &Estimate) -> Vec<String> {
    let mut differences = Vec::new();
    let name = &stored.name;
    let (Some(old_sd), Some(sd)) = (stored.sd, new.sd) else {
        if stored.sd.is_some() != new.sd.is_some() {
            differences.push(format!(
                "{name} has a deviation either as stored or in a new fit, but not in both"
            ));
        }
        return differences;
    };
    differences.extend(number(name, stored.value, new.value, sd));
    if !is_near(old_sd, sd, SAME_SD * sd) {
        differences.push(format!(
            "the deviation of {name} is stored as {old_sd:.4e}, and a new fit gives {sd:.4e}"
        ));
    }
    let same = match (stored.interval_95, new.interval_95) {
        (Some(old), Some([low, high])) => {
            let step = SAME_NUMBER_SD * sd.max((high - low) / (2.0 * DEVIATE_95));
            std::iter::zip(old, [low, high]).all(|(old, new)| is_near(old, new, step))
        }
        (old, new) => old.is_none() && new.is_none(),
    };
    if !same {
        differences.push(format!("the interval of {name} is not the one that a new fit gives"));
    }
    differences
}

fn number(name: &str, stored: f64, new: f64, sd: f64) -> Option<String> {
    (!is_near(stored, new, SAME_NUMBER_SD * sd))
        .then(|| format!("{name} is stored as {stored:.4e}, and a new fit gives {new:.4e}"))
}

/// What is rendered: the numbers of the model, and its level at the angles of the detections.
fn model(stored: &material::Fit, found: &FitResult, curve: &Curve) -> Vec<String> {
    let mut differences = Vec::new();
    for new in found.estimates.iter().filter(|new| new.name != LOOKS) {
        let Some(value) = value(&stored.model, &new.name) else {
            differences.push(format!("its model has no {}", new.name));
            continue;
        };
        let wrong = new.sd.and_then(|sd| number(&new.name, value, new.value, sd));
        differences.extend(wrong.map(|wrong| format!("in its model {wrong}")));
    }
    for (path, held) in &found.fit.fixed {
        if value(&stored.model, path) != Some(*held) {
            differences.push(format!("its model has another {path} than the fixed one"));
        }
    }
    if differences.is_empty() {
        differences.extend(level(stored, found, curve));
    }
    differences
}

fn value(model: &Brdf, name: &str) -> Option<f64> {
    match (name, model.identified_products()) {
        (SPECULAR_LEVEL, Some([s, _])) => Some(s),
        (DIFFUSE_LEVEL, Some([_, r])) => Some(r),
        _ => model.parameters().into_iter().find(|p| p.path == name).map(|p| p.value),
    }
}

/// Compares σ⁰ of the two models where there are detections: numbers that the data determine only together must still
/// give the same curve.
fn level(stored: &material::Fit, found: &FitResult, curve: &Curve) -> Option<String> {
    const NEPER_PER_DB: f64 = std::f64::consts::LN_10 / 10.0;
    // As many directions as numbers, each as far off as a number may be.
    let directions = (found.estimates.len() as f64).sqrt();
    let seen = ThroughBeam { law: &stored.model, beam_rad: stored.beam_rad().unwrap_or(0.0) };
    for aspect in aspects(curve) {
        let band = found.band_of(aspect);
        let sd = (band.high / band.mid).ln() / DEVIATE_95;
        let step = SAME_NUMBER_SD * directions * sd + SAME_LEVEL_DB * NEPER_PER_DB;
        if !is_near(aspect.sigma0(&seen).ln(), band.mid.ln(), step) {
            let theta_deg = aspect.theta_i_rad.to_degrees();
            return Some(format!(
                "its model has another level at {theta_deg:.1}° than that of a new fit"
            ));
        }
    }
    None
}

/// Aspects evenly over the angles of the detections; some of the detections' own where not all are backscatter.
fn aspects(curve: &Curve) -> Vec<Aspect> {
    let seen: Vec<Aspect> = curve.detected().map(Observation::aspect).collect();
    if seen.iter().any(|aspect| !aspect.is_retro()) {
        return seen.iter().copied().step_by(seen.len().div_ceil(ANGLES as usize)).collect();
    }
    let (mut low_rad, mut high_rad) = (f64::INFINITY, 0.0f64);
    for aspect in &seen {
        low_rad = low_rad.min(aspect.theta_i_rad);
        high_rad = high_rad.max(aspect.theta_i_rad);
    }
    let step_rad = (high_rad - low_rad) / f64::from(ANGLES);
    (0..=ANGLES).map(|angle| Aspect::retro(low_rad + f64::from(angle) * step_rad)).collect()
}

/// Both covariances: of all numbers found, and of the parameters.
fn covariances(stored: &material::Fit, new: &material::Fit, found: &FitResult) -> Option<String> {
    let sds: Vec<f64> = found.estimates.iter().map(|e| e.sd.unwrap_or(0.0)).collect();
    let parameters = match (&stored.covariance, &new.covariance) {
        (Some(old), Some(new)) => {
            let estimates = new.parameters.iter().map(|path| found.estimate(path));
            let sds: Vec<f64> = estimates.map(|e| e.and_then(|e| e.sd).unwrap_or(0.0)).collect();
            old.parameters == new.parameters && is_same_matrix(&old.matrix, &new.matrix, &sds)
        }
        (old, new) => old.is_none() && new.is_none(),
    };
    let report = match (&stored.report, &new.report) {
        (Some(old), Some(new)) => is_same_matrix(&old.covariance, &new.covariance, &sds),
        _ => true,
    };
    (!parameters || !report)
        .then(|| "its covariance is not the one that a new fit gives".to_owned())
}

/// Rows and columns of numbers without a deviation are not compared: they say how these vary with others, on a scale that
/// the data leave open.
fn is_same_matrix(old: &[Vec<f64>], new: &[Vec<f64>], sds: &[f64]) -> bool {
    is_square(old, sds.len())
        && is_square(new, sds.len())
        && std::iter::zip(old, new).zip(sds).all(|((old, new), row_sd)| {
            let mut cells = std::iter::zip(old, new).zip(sds);
            cells.all(|((old, new), sd)| {
                let scale = row_sd * sd;
                scale == 0.0 || is_near(*old, *new, 2.0 * SAME_SD * scale)
            })
        })
}

fn is_square(matrix: &[Vec<f64>], size: usize) -> bool {
    matrix.len() == size && matrix.iter().all(|row| row.len() == size)
}

/// The score on points that took no part in the fit, if there is one.
fn held_out(old: &CrossValidation, found: &FitResult, curve: &Curve) -> Option<String> {
    let is_same = found.hold_out(curve).is_some_and(|new| is_same_score(old, &new));
    (!is_same)
        .then(|| "its score on held-out points is not the one that a new fit gives".to_owned())
}

fn is_same_score(old: &CrossValidation, new: &CrossValidation) -> bool {
    let sd = new.score_sd.unwrap_or(0.0);
    are_near(old.score, new.score, SAME_NUMBER_SD * sd)
        && are_near(old.score_sd, new.score_sd, SAME_SD * sd)
        && is_near(old.rms_db, new.rms_db, SAME_LEVEL_DB)
        && (old.folds, old.blocks, &old.blocks_of, old.block_m, &old.fold_hash)
            == (new.folds, new.blocks, &new.blocks_of, new.block_m, &new.fold_hash)
}

/// What was set, and whether the search came to an end.
fn settings(
    stored: &material::Fit,
    old: &FitReport,
    new: &FitReport,
    estimator: &str,
) -> Vec<String> {
    let scale = new.singular_values.first().copied().unwrap_or(1.0);
    let same_values = old.singular_values.len() == new.singular_values.len()
        && std::iter::zip(&old.singular_values, &new.singular_values)
            .all(|(old, new)| is_near(*old, *new, SAME_SD * scale));
    let looks_sd = new.estimate(LOOKS).and_then(|e| e.sd);
    let looks_step = SAME_NUMBER_SD * looks_sd.unwrap_or(0.0) + SAME_SUM * new.looks.unwrap_or(0.0);
    let same_looks = are_near(old.looks, new.looks, looks_step);
    let checks = [
        ("estimator", stored.estimator == estimator && old.method == new.method),
        ("settings", old.given == new.given && old.noise_w == new.noise_w),
        ("choice of k", old.gauge == new.gauge),
        ("looks", same_looks),
        ("singular values", same_values),
        ("end of the search", old.converged == new.converged),
    ];
    let wrong = checks.into_iter().filter(|(_, same)| !same);
    wrong.map(|(what, _)| format!("its {what}: the report and a new fit differ")).collect()
}

/// How far a level of this size may differ, dB.
fn step_db(size_db: f64) -> f64 {
    SAME_SUM * size_db.abs() + SAME_LEVEL_DB
}

fn goodness(old: &Goodness, new: &Goodness) -> Vec<String> {
    // Residuals of a curve without noise are steps of the search, and follow no law.
    let step = SAME_SUM + SAME_LEVEL_DB / new.rms_db.max(f64::MIN_POSITIVE);
    let speckle = are_near(old.speckle_db, new.speckle_db, step_db(new.speckle_db.unwrap_or(0.0)));
    let checks = [
        ("rms_db", is_near(old.rms_db, new.rms_db, step_db(new.rms_db))),
        ("mean_db", is_near(old.mean_db, new.mean_db, step_db(new.rms_db))),
        ("speckle_db", speckle),
        ("z_mean", is_near(old.z_mean, new.z_mean, step)),
        ("z_variance", is_near(old.z_variance, new.z_variance, step * new.z_variance.max(1.0))),
        ("ks_distance", is_near(old.ks_distance, new.ks_distance, step)),
        ("rows", old.rows == new.rows),
    ];
    let wrong = checks.into_iter().filter(|(_, same)| !same);
    wrong.map(|(what, _)| format!("its {what} is not the one that a new fit gives")).collect()
}

/// The sentences. How many starts agree depends on where the search began, and is not compared.
fn verdict(stored: &[String], found: &[Finding]) -> Vec<String> {
    let mut differences = Vec::new();
    for sentence in stored.iter().filter(|s| !s.contains("starts reached the best fit")) {
        if !found.iter().any(|finding| is_same_sentence(sentence, &finding.to_string())) {
            differences.push(format!("its verdict says what a new fit does not: {sentence}"));
        }
    }
    for finding in found.iter().filter(|finding| !is_borderline(finding)) {
        let said = finding.to_string();
        if !stored.iter().any(|sentence| is_same_sentence(sentence, &said)) {
            differences.push(format!("its verdict does not say: {said}"));
        }
    }
    differences
}

/// Whether a finding is so near to its limit that another search may miss it.
fn is_borderline(finding: &Finding) -> bool {
    match finding {
        // A report of an earlier program does not speak of energy, few rows, more than speckle and neighbours.
        Finding::StartsDisagree { .. }
        | Finding::NeighboursAlike { .. }
        | Finding::TooMuch { .. }
        | Finding::FewRows { .. }
        | Finding::MoreThanSpeckle { .. } => true,
        Finding::PoorFit { ks_distance, limit } => *ks_distance < (1.0 + BORDERLINE) * limit,
        Finding::HardToTellApart { correlation, .. } => correlation.abs() < 0.96,
        _ => false,
    }
}

/// Whether two sentences are the same but for the last digits of their numbers.
fn is_same_sentence(old: &str, new: &str) -> bool {
    let (old, new) = (parts(old), parts(new));
    let [relative, absolute] = SAME_WORDS;
    old.len() == new.len()
        && std::iter::zip(&old, &new).all(|(old, new)| match (old.parse(), new.parse()) {
            (Ok(old), Ok(new)) => is_near(old, new, relative * f64::abs(new) + absolute),
            _ => old == new,
        })
}

/// A sentence cut where numbers begin and end.
fn parts(sentence: &str) -> Vec<String> {
    let mut parts: Vec<String> = Vec::new();
    let mut was_number = None;
    for letter in sentence.chars() {
        let is_number = letter.is_ascii_digit() || letter == '.';
        if was_number != Some(is_number) {
            parts.push(String::new());
            was_number = Some(is_number);
        }
        if let Some(part) = parts.last_mut() {
            part.push(letter);
        }
    }
    parts
}

/// Whether two numbers are near, or both are missing.
fn are_near(a: Option<f64>, b: Option<f64>, step: f64) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => is_near(a, b, step),
        (a, b) => a.is_none() && b.is_none(),
    }
}

/// Whether two numbers differ by no more than `step` and rounding; false for NaN.
fn is_near(a: f64, b: f64, step: f64) -> bool {
    (a - b).abs() <= step + ROUNDING * b.abs()
}
