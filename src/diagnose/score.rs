//! How far predictions are from what was seen, and how far a perfect model's would be.
//!
//! A detection is compared, in dB, with E[dB | detected], and a perfect model is off by the
//! standard deviation of dB about it. Both are integrals over Gamma(L, 1/L) above the threshold, done
//! once for a table of ln(T/mean).

use serde::Serialize;
use statrs::function::gamma::ln_gamma;

use super::folds::Folds;
use super::likelihood::{Declared, Likelihood};
use super::shots::Observation;
use crate::effects::Prediction;
use crate::units::dbm_from_watts;

/// Times the noise floor below which an error has no excess to explain a share of.
pub(super) const AT_THE_FLOOR: f64 = 1.05;

/// dB in one e-fold.
pub(super) const DB: f64 = 10.0 / std::f64::consts::LN_10;

/// One shot, predicted without having been fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scored {
    /// ln p.
    pub ln_p: f64,
    /// E[dBm | detected].
    pub expected_dbm: f64,
    /// Var[dB | detected].
    pub variance_db2: f64,
    /// Detected minus expected, dB; none where nothing was detected.
    pub residual_db: Option<f64>,
    /// Probability of a detection.
    pub chance: f64,
    /// Probability, given a detection, of less power than was detected.
    pub share: Option<f64>,
}

/// The error of a model over held-out shots.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Errors {
    /// Root mean square over detections about E[dB | detected], dB.
    pub rmse_db: f64,
    /// Its standard error, by how small patches of the target differ, dB.
    pub rmse_se_db: f64,
    /// Mean of the same, dB.
    pub bias_db: f64,
    /// Its standard error, likewise, dB.
    pub bias_se_db: f64,
    /// Mean ln p of all shots, the censored ones included.
    pub log_score: f64,
    /// Share of detections within the central half of their law.
    pub coverage_50: f64,
    /// The same of the central 90 %.
    pub coverage_90: f64,
    /// Brier score of the probability of a detection, over all shots.
    pub brier: f64,
    /// The rmse of a model that is right, dB.
    pub noise_floor_db: f64,
}

/// Mean and variance of ln y over a tabulated threshold.
pub(super) struct Above {
    knots: Vec<[f64; 2]>,
}

const FIRST: f64 = -8.0;
const LAST: f64 = 6.0;
const CELLS: usize = 560;
/// A mean so many e-folds below the threshold is as good as none.
const FARTHEST: f64 = 100.0;

impl Above {
    /// For L looks.
    pub fn new(looks: f64) -> Above {
        let knot =
            |k: usize| moments_above(looks, FIRST + (LAST - FIRST) * k as f64 / CELLS as f64);
        Above { knots: (0..=CELLS).map(knot).collect() }
    }

    /// Mean and variance of ln(y/mean) above ln(T/mean).
    pub fn at(&self, ln_threshold: f64) -> [f64; 2] {
        let x = (ln_threshold.clamp(FIRST, LAST) - FIRST) / (LAST - FIRST) * CELLS as f64;
        let cell = (x as usize).min(CELLS - 1);
        let t = x - cell as f64;
        let [a, b] = [cell, cell + 1].map(|k| self.knots.get(k).copied().unwrap_or_default());
        // So far above the mean, what is detected lies close to the threshold.
        let beyond = (ln_threshold - LAST).max(0.0);
        [(1.0 - t) * a[0] + t * b[0] + beyond, (1.0 - t) * a[1] + t * b[1]]
    }
}

/// By the midpoint rule over ln y, from the threshold or where nothing lies below.
fn moments_above(looks: f64, ln_threshold: f64) -> [f64; 2] {
    const STEPS: usize = 400;
    let reach = 12.0 / looks.sqrt().min(looks);
    let from = ln_threshold.max(-reach);
    let to = (from + 1.0 / looks).max(0.0) + 6.0 / looks.sqrt().max(1.0);
    let width = (to - from) / STEPS as f64;
    let constant = looks * looks.ln() - ln_gamma(looks);
    let ln_density = |x: f64| constant + looks * (x - x.exp());
    let top = ln_density(from.max(0.0));
    let mut sums = [0.0; 3];
    for step in 0..STEPS {
        let x = from + (step as f64 + 0.5) * width;
        let weight = (ln_density(x) - top).exp();
        for (sum, power) in sums.iter_mut().zip([1.0, x, x * x]) {
            *sum += weight * power;
        }
    }
    let mean = sums[1] / sums[0];
    [mean, (sums[2] / sums[0] - mean * mean).max(0.0)]
}

/// Scores the shots for which `wanted` holds.
pub(super) fn scored(
    prediction: &Prediction,
    declared: Declared,
    observations: &[Observation],
    wanted: &dyn Fn(usize) -> bool,
) -> Vec<(usize, Scored)> {
    let likelihood = Likelihood::new(prediction, declared);
    let above = Above::new(prediction.receiver.looks);
    let one = |(shot, seen): (usize, &Observation)| {
        let below = |level_w: f64| likelihood.below(shot, level_w);
        let [mean, variance] = detected_moments(&likelihood, &above, prediction, declared, shot);
        let expected_dbm = DB * mean + dbm_from_watts(1.0);
        let missed = below(declared.threshold_w);
        let share = |power_w: f64| (below(power_w) - missed) / (1.0 - missed).max(1e-300);
        Scored {
            ln_p: likelihood.term(shot, seen).ln_p,
            expected_dbm,
            variance_db2: DB * DB * variance,
            residual_db: seen.power_w.map(|power_w| dbm_from_watts(power_w) - expected_dbm),
            chance: 1.0 - missed,
            share: seen.power_w.map(share),
        }
    };
    let shots = observations.iter().enumerate().filter(|(shot, _)| wanted(*shot));
    shots.map(|(shot, seen)| (shot, one((shot, seen)))).collect()
}

/// Mean and variance of ln y given a detection, over the tilts.
fn detected_moments(
    likelihood: &Likelihood,
    above: &Above,
    prediction: &Prediction,
    declared: Declared,
    shot: usize,
) -> [f64; 2] {
    let ln_threshold = declared.threshold_w.ln();
    let mut sums = [0.0; 3];
    for (ln_mean, weight) in likelihood.ln_means(shot) {
        // What is detected where nothing is expected lies at the threshold.
        let passed = prediction.saturating.of(ln_mean.max(ln_threshold - FARTHEST));
        let [mean, variance] = above.at((ln_threshold - passed.ln_mean) / passed.slope);
        let variance = passed.slope * passed.slope * variance;
        let chance = if weight == 1.0 { 1.0 } else { likelihood.chance(ln_mean) };
        let (mean, weight) = (passed.ln_mean + passed.slope * mean, weight * chance.max(1e-300));
        for (sum, part) in sums.iter_mut().zip([1.0, mean, variance + mean * mean]) {
            *sum += weight * part;
        }
    }
    let mean = sums[1] / sums[0];
    [mean, (sums[2] / sums[0] - mean * mean).max(0.0)]
}

/// Sums up shots.
pub(super) fn errors(scored: &[Scored], folds: &Folds) -> Errors {
    let mean = |values: &mut dyn Iterator<Item = f64>| {
        let (sum, count) = values.fold((0.0, 0.0), |(s, n), x| (s + x, n + 1.0));
        sum / f64::max(count, 1.0)
    };
    let detected = || scored.iter().filter_map(|s| Some((s, s.residual_db?)));
    let inside = |central: f64| {
        let within = move |share: f64| (share - 0.5).abs() <= 0.5 * central;
        mean(&mut scored.iter().filter_map(|s| s.share).map(|s| f64::from(u8::from(within(s)))))
    };
    let brier = |s: &Scored| (s.chance - f64::from(u8::from(s.residual_db.is_some()))).powi(2);
    let bias_db = mean(&mut detected().map(|(_, r)| r));
    let square_db2 = mean(&mut detected().map(|(_, r)| r * r));
    let count = detected().count().max(1) as f64;
    let standard_error = |off: &dyn Fn(f64) -> f64| {
        let off: Vec<f64> = scored.iter().map(|s| s.residual_db.map_or(0.0, off)).collect();
        folds.sum(&off)[1] / count
    };
    let square_se_db2 = standard_error(&|r| r * r - square_db2);
    Errors {
        rmse_db: square_db2.sqrt(),
        rmse_se_db: square_se_db2 / (2.0 * square_db2.sqrt().max(f64::MIN_POSITIVE)),
        bias_db,
        bias_se_db: standard_error(&|r| r - bias_db),
        log_score: mean(&mut scored.iter().map(|s| s.ln_p)),
        coverage_50: inside(0.5),
        coverage_90: inside(0.9),
        brier: mean(&mut scored.iter().map(brier)),
        noise_floor_db: mean(&mut detected().map(|(s, _)| s.variance_db2)).sqrt(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::random::{Key, Purpose};

    #[test]
    fn moments_above_a_threshold_are_those_of_draws() {
        for (looks, ln_threshold) in [(1.0, -8.0), (1.0, -0.5), (4.0, 0.3), (8.0, -1.0)] {
            let mut draws =
                Key { seed: 5, chirp: 0, sub_ray: 0, purpose: Purpose::Speckle }.draws();
            let x: Vec<f64> = (0..200_000)
                .map(|_| draws.gamma(looks).ln())
                .filter(|x| *x > ln_threshold)
                .collect();
            let n = x.len() as f64;
            let mean = x.iter().sum::<f64>() / n;
            let variance = x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
            let [m, v] = Above::new(looks).at(ln_threshold);
            // Five standard errors of the mean; the variance of heavy tails within 3 %.
            assert!((m - mean).abs() < 5.0 * (variance / n).sqrt(), "{looks}: {m} {mean}");
            assert!((v / variance - 1.0).abs() < 0.03, "{looks}: {v} {variance}");
        }
    }
}
