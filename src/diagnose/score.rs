//! The error of predictions, and the error of a correct model.
//!
//! A detection is compared, in dB, with E[dB | detected]; the rms residual of a correct model is the
//! standard deviation of dB about it. Both are integrals over Gamma(L, 1/L) above the threshold,
//! tabulated over ln(T/mean).

use serde::Serialize;
use statrs::function::gamma::ln_gamma;

use super::folds::Folds;
use super::likelihood::{Likelihood, Mean};
pub(super) use super::observation::DB;
use super::observation::ReceiverLimits;
use super::problem::Problem;
use super::shared::ALONE;
use crate::effects::Prediction;

/// Errors below this multiple of the noise floor count as at the floor, with no excess to explain.
pub(super) const AT_THE_FLOOR: f64 = 1.05;

/// The score of a prediction at one shot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Score {
    /// ln p times the weight of the shot.
    pub ln_p: f64,
    /// ln p of the shot by itself.
    pub whole_ln_p: f64,
    /// Geometric mean of the power of a detection, W: exp E[ln P | detected].
    pub expected_w: f64,
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
    /// Its standard error over small patches of the target, dB.
    pub rmse_se_db: f64,
    /// Mean residual over detections, dB.
    pub bias_db: f64,
    /// Its standard error over small patches of the target, dB.
    pub bias_se_db: f64,
    /// Mean ln p of all shots, the censored ones included.
    pub log_score: f64,
    /// Share of detections within the central half of their distribution.
    pub coverage_50: f64,
    /// Share of detections within the central 90 % of their distribution.
    pub coverage_90: f64,
    /// Brier score of the probability of a detection, over all shots.
    pub brier: f64,
    /// The rmse of a correct model, dB.
    pub noise_floor_db: f64,
}

/// Mean and variance of ln(y/mean) above a threshold, tabulated over ln(T/mean).
pub(super) struct MomentTable {
    knots: Vec<[f64; 2]>,
}

/// Ends of the table in ln(T/mean).
const FIRST: f64 = -8.0;
const LAST: f64 = 6.0;
const CELLS: usize = 560;
/// Steps of an integral for a table, and of one for a single shot.
const STEPS: usize = 400;
const FEW_STEPS: usize = 60;
/// Lowest mean below the threshold that counts, in e-folds.
const FARTHEST: f64 = 100.0;

impl MomentTable {
    /// The table of a number of looks.
    pub fn new(looks: f64) -> MomentTable {
        let mut knots = Vec::with_capacity(CELLS + 1);
        for k in 0..=CELLS {
            knots.push(moments_above(
                looks,
                FIRST + (LAST - FIRST) * k as f64 / CELLS as f64,
                STEPS,
                |x| x,
            ));
        }
        MomentTable { knots }
    }

    /// Mean and variance of ln(y/mean) above ln(T/mean).
    pub fn at(&self, ln_threshold: f64) -> [f64; 2] {
        let x = (ln_threshold.clamp(FIRST, LAST) - FIRST) / (LAST - FIRST) * CELLS as f64;
        let cell = (x as usize).min(CELLS - 1);
        let t = x - cell as f64;
        let [a, b] = [cell, cell + 1].map(|k| self.knots.get(k).copied().unwrap_or_default());
        // Far above the mean, detections lie close to the threshold.
        let beyond = (ln_threshold - LAST).max(0.0);
        [(1.0 - t) * a[0] + t * b[0] + beyond, (1.0 - t) * a[1] + t * b[1]]
    }
}

/// Mean and variance of ln(y/mean) above ln(T/mean) for a number of looks without a table.
fn moments(looks: f64, ln_threshold: f64) -> [f64; 2] {
    let [mean, variance] = moments_above(looks, ln_threshold.clamp(FIRST, LAST), STEPS, |x| x);
    [mean + (ln_threshold - LAST).max(0.0), variance]
}

/// Mean and variance of a function of ln(y/mean) above a threshold, by the midpoint rule from the threshold or, where that
/// is lower, from where the density begins.
fn moments_above(looks: f64, ln_threshold: f64, steps: usize, of: impl Fn(f64) -> f64) -> [f64; 2] {
    let reach = 12.0 / looks.sqrt().min(looks);
    let from = ln_threshold.max(-reach);
    let to = (from + 1.0 / looks).max(0.0) + 6.0 / looks.sqrt().max(1.0);
    let width = (to - from) / steps as f64;
    let constant = looks * looks.ln() - ln_gamma(looks);
    let ln_density = |x: f64| constant + looks * (x - x.exp());
    let top = ln_density(from.max(0.0));
    let mut sums = [0.0; 3];
    for step in 0..steps {
        let x = from + (step as f64 + 0.5) * width;
        let weight = (ln_density(x) - top).exp();
        let value = of(x);
        for (sum, power) in sums.iter_mut().zip([1.0, value, value * value]) {
            *sum += weight * power;
        }
    }
    let mean = sums[1] / sums[0];
    [mean, (sums[2] / sums[0] - mean * mean).max(0.0)]
}

/// Scores of the shots that are `wanted`, with their numbers.
pub(super) fn scores(
    problem: &Problem,
    prediction: &Prediction,
    wanted: impl Fn(usize) -> bool,
) -> Vec<(usize, Score)> {
    let Problem { declared, observations, shared, .. } = *problem;
    let likelihood = Likelihood::new(prediction, declared, shared);
    let alone = Likelihood::new(prediction, declared, &ALONE);
    let table = MomentTable::new(prediction.receiver.looks);
    let seen = observations.iter().copied().enumerate().filter(|(shot, _)| wanted(*shot));
    let seen: Vec<_> = seen.collect();
    let terms = likelihood.terms_of(&seen);
    let whole = if shared.is_any() { alone.terms_of(&seen) } else { terms.clone() };
    let mut scores = Vec::with_capacity(seen.len());
    for ((shot, seen), (term, whole)) in seen.into_iter().zip(terms.iter().zip(&whole)) {
        let [mean, variance] = detected_moments(&likelihood, &table, prediction, declared, shot);
        let missed = likelihood.below(shot, seen.limit_w(declared));
        let share = seen
            .power_w
            .map(|power_w| (likelihood.below(shot, power_w) - missed) / (1.0 - missed).max(1e-300));
        let score = Score {
            ln_p: term.ln_p,
            whole_ln_p: whole.ln_p,
            expected_w: mean.exp(),
            variance_db2: DB * DB * variance,
            residual_db: seen.power_w.map(|power_w| DB * (power_w.ln() - mean)),
            chance: 1.0 - missed,
            share,
        };
        scores.push((shot, score));
    }
    scores
}

/// Mean and variance of ln y given a detection, averaged over tilts.
fn detected_moments(
    likelihood: &Likelihood,
    table: &MomentTable,
    prediction: &Prediction,
    declared: ReceiverLimits,
    shot: usize,
) -> [f64; 2] {
    let ln_threshold = declared.threshold_w.ln();
    let mut sums = [0.0; 3];
    for one in likelihood.means(shot) {
        let Mean { ln_mean, looks, weight } = one;
        // Detections far above their mean lie at the threshold.
        let ln_mean = ln_mean.max(ln_threshold - FARTHEST);
        let saturating = &prediction.saturating;
        let [from, _] = saturating.entered(ln_mean, ln_threshold);
        let [mean, variance] = if saturating.is_linear() {
            let is_tabulated = looks == prediction.receiver.looks;
            let [mean, variance] = if is_tabulated { table.at(from) } else { moments(looks, from) };
            [ln_mean + mean, variance]
        } else {
            let output = |x| saturating.output(ln_mean, x)[0];
            moments_above(looks, from.clamp(FIRST, LAST), FEW_STEPS, output)
        };
        let chance = if weight == 1.0 { 1.0 } else { likelihood.chance(&one) };
        let weight = weight * chance.max(1e-300);
        for (sum, part) in sums.iter_mut().zip([1.0, mean, variance + mean * mean]) {
            *sum += weight * part;
        }
    }
    let mean = sums[1] / sums[0];
    [mean, (sums[2] / sums[0] - mean * mean).max(0.0)]
}

/// The errors of a model from its scores.
pub(super) fn errors(scores: &[Score], folds: &Folds) -> Errors {
    let residuals_db: Vec<f64> = scores.iter().filter_map(|score| score.residual_db).collect();
    let bias_db = mean(residuals_db.iter().copied());
    let square_db2 = mean(residuals_db.iter().map(|r| r * r));
    let square_se_db2 = standard_error(scores, folds, |r| r * r - square_db2);
    let detected = scores.iter().filter(|score| score.residual_db.is_some());
    Errors {
        rmse_db: square_db2.sqrt(),
        rmse_se_db: square_se_db2 / (2.0 * square_db2.sqrt().max(f64::MIN_POSITIVE)),
        bias_db,
        bias_se_db: standard_error(scores, folds, |r| r - bias_db),
        log_score: mean(scores.iter().map(|score| score.whole_ln_p)),
        coverage_50: coverage(scores, 0.5),
        coverage_90: coverage(scores, 0.9),
        brier: mean(scores.iter().map(|score| {
            (score.chance - f64::from(u8::from(score.residual_db.is_some()))).powi(2)
        })),
        noise_floor_db: mean(detected.map(|score| score.variance_db2)).sqrt(),
    }
}

/// Mean of some numbers; 0 of none.
fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), x| (sum + x, count + 1.0));
    sum / f64::max(count, 1.0)
}

/// Share of detections within the central part of their distribution.
fn coverage(scores: &[Score], central: f64) -> f64 {
    let shares = scores.iter().filter_map(|score| score.share);
    mean(shares.map(|share| f64::from(u8::from((share - 0.5).abs() <= 0.5 * central))))
}

/// Standard error over cells of a mean over detections.
fn standard_error(scores: &[Score], folds: &Folds, off: impl Fn(f64) -> f64) -> f64 {
    let count = scores.iter().filter(|score| score.residual_db.is_some()).count().max(1);
    let off: Vec<f64> = scores.iter().map(|score| score.residual_db.map_or(0.0, &off)).collect();
    folds.sum(&off)[1] / count as f64
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
            let [m, v] = MomentTable::new(looks).at(ln_threshold);
            // Five standard errors of the mean; the variance of heavy tails within 3 %.
            assert!((m - mean).abs() < 5.0 * (variance / n).sqrt(), "{looks}: {m} {mean}");
            assert!((v / variance - 1.0).abs() < 0.03, "{looks}: {v} {variance}");
        }
    }
}
