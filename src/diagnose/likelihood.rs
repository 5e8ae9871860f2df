//! The likelihood of the observations under a prediction.
//!
//! A detected power y has the density of Gamma(L, (μ + N)/L) in ln y. A chirp without a detection has the
//! probability of staying below the threshold T. Both apply before a receiver that saturates. Where
//! tilts vary at random the likelihood is averaged over them. Ranges are normal about the predicted
//! ones. One in ten thousand chirps is an outlier of any power, so that a silhouette that the mesh misses
//! costs a bounded amount.

use super::observation::{Observation, ReceiverLimits};
use super::shared::SharedSpeckle;
use crate::effects::{MeanEcho, Prediction};
use crate::fit::gamma_law::{GammaLaw, LnProbability};

/// Share of outliers among chirps.
const OUTLIERS: f64 = 1e-4;
/// Their density in ln power, as wide as 60 dB.
const OUTLIER_DENSITY: f64 = 1.0 / 13.8;
/// Largest score of a shot in the search for a start, in standard deviations.
const MOST_PULL: f64 = 4.0;
/// Share of outliers among ranges.
const STRAY_RANGES: f64 = 0.01;
/// How much wider than the others these spread, at least.
const STRAY_WIDTH: f64 = 10.0;
/// Uncertainty of the mean range over several paths, as a share of their spread: a few rays stand for all, and
/// speckle changes their weights.
const UNSURE: f64 = 0.1;
/// Mean power where rays miss, as a share of the threshold: never detected.
const NOTHING: f64 = 1e-9;

/// The likelihood under one prediction.
pub(super) struct Likelihood<'a> {
    prediction: &'a Prediction,
    declared: ReceiverLimits,
    shared: &'a SharedSpeckle,
    law: GammaLaw,
}

/// The part of one chirp in the likelihood.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Term {
    /// ln p.
    pub ln_p: f64,
    /// ln(μ + N) over all tilts, less the loss of the observation in a saturating receiver.
    pub ln_mean: f64,
    /// d ln p/d ln mean.
    pub slope: f64,
    /// d ln p/d ln mean without outliers, limited to [`MOST_PULL`] standard deviations.
    pub pull: f64,
    /// −d² ln p/d(ln mean)², never negative.
    pub bend: f64,
    /// The part of the range in `ln_p`.
    pub ln_range: f64,
    /// Predicted range, m; 0 where nothing arrives.
    pub range_m: f64,
    /// d ln p/d range, 1/m.
    pub range_slope: f64,
    /// −d² ln p/d range², 1/m², never negative.
    pub range_bend: f64,
    /// Share of an independent observation that its power is. What is said of the power is multiplied by it.
    pub weight: f64,
}

impl<'a> Likelihood<'a> {
    pub fn new(
        prediction: &'a Prediction,
        declared: ReceiverLimits,
        shared: &'a SharedSpeckle,
    ) -> Likelihood<'a> {
        let law = GammaLaw::new(prediction.receiver.looks);
        Likelihood { prediction, declared, shared, law }
    }

    /// ln of the mean power of a shot with thermal noise, and its weight, for every tilt.
    pub fn ln_means(&self, shot: usize) -> impl Iterator<Item = (f64, f64)> {
        let floor_w = NOTHING * self.declared.threshold_w;
        let noise_w = self.prediction.receiver.noise_w;
        let powers = self.prediction.powers_w(shot);
        powers.map(move |(power_w, weight)| ((power_w + noise_w).max(floor_w).ln(), weight))
    }

    /// ln of the mean over all tilts.
    fn ln_mean(&self, shot: usize) -> f64 {
        self.prediction.mean_w(shot).max(NOTHING * self.declared.threshold_w).ln()
    }

    /// The part of one chirp.
    pub fn term(&self, shot: usize, seen: &Observation) -> Term {
        let ln_seen = seen.power_w.unwrap_or(self.declared.threshold_w).ln();
        let (mut p, mut slope, mut bend, mut pull) = (0.0, 0.0, 0.0, 0.0);
        for (ln_mean, weight) in self.ln_means(shot) {
            let law = match seen.power_w {
                Some(_) => self.detected(ln_seen, ln_mean),
                None => self.limited(ln_seen, ln_mean),
            };
            let part = (1.0 - OUTLIERS) * weight * law.value.exp();
            p += part;
            slope += part * law.by_ln_mean;
            pull += weight * law.by_ln_mean;
            bend += part * law.bend;
        }
        let anything = if seen.power_w.is_some() { OUTLIER_DENSITY } else { 0.5 };
        let most = MOST_PULL * self.prediction.receiver.looks.sqrt();
        let pull = pull.clamp(-most, most);
        p += OUTLIERS * anything;
        let ln_mean = self.ln_mean(shot);
        let lost = self.entered(ln_mean, ln_seen).0 - ln_seen;
        let arrived = self.prediction.arrived.get(shot).copied().flatten();
        let range_m = arrived.map_or(0.0, |arrived| arrived.range_m);
        let ranged = arrived.and_then(|arrived| self.range(&arrived, seen));
        let [ln_range, range_slope, range_bend] = ranged.unwrap_or_default();
        let weight = self.shared.weight(shot);
        Term {
            ln_p: weight * p.ln() + ln_range,
            ln_mean: ln_mean - lost,
            slope: weight * slope / p,
            pull: weight * pull,
            bend: weight * bend / p,
            ln_range,
            range_m,
            range_slope,
            range_bend,
            weight,
        }
    }

    /// Probability that the power of a shot stays below a level, W.
    pub fn below(&self, shot: usize, level_w: f64) -> f64 {
        self.ln_means(shot)
            .map(|(ln_mean, weight)| weight * self.limited(level_w.ln(), ln_mean).value.exp())
            .sum()
    }

    /// Probability that a power of this mean is detected.
    pub fn chance(&self, ln_mean: f64) -> f64 {
        1.0 - self.limited(self.declared.threshold_w.ln(), ln_mean).value.exp()
    }

    /// ln density of a detected power per unit of ln power.
    fn detected(&self, ln_power: f64, ln_mean: f64) -> LnProbability {
        let (ln_power, slope) = self.entered(ln_mean, ln_power);
        let law = self.law.detected(ln_power, ln_mean);
        LnProbability { value: law.value - slope.ln(), ..law }
    }

    /// ln probability that the power stays below a limit.
    fn limited(&self, ln_limit: f64, ln_mean: f64) -> LnProbability {
        self.law.below(self.entered(ln_mean, ln_limit).0, ln_mean)
    }

    /// ln of the power at the input of the receiver whose output is `ln_seen`, and the slope of the output by
    /// the input.
    fn entered(&self, ln_mean: f64, ln_seen: f64) -> (f64, f64) {
        let passed = self.prediction.saturating.of(ln_mean);
        (ln_mean + (ln_seen - passed.ln_mean) / passed.slope, passed.slope)
    }

    /// ln p of a range, its slope and its curvature by the predicted range; `None` where no
    /// range is to be used.
    fn range(&self, arrived: &MeanEcho, seen: &Observation) -> Option<[f64; 3]> {
        let sd_m = self.declared.range_sd_m;
        let x = self.declared.range_off_m(arrived, seen)? / sd_m;
        let spread = arrived.spread_m / sd_m;
        let (width, stray_width) = ((UNSURE * spread).hypot(1.0), STRAY_WIDTH.max(spread));
        let bell = |share: f64, width: f64| share / width * (-0.5 * (x / width).powi(2)).exp();
        let (near, stray) = (bell(1.0 - STRAY_RANGES, width), bell(STRAY_RANGES, stray_width));
        let p = (near + stray).max(f64::MIN_POSITIVE);
        let weight = (near / width.powi(2) + stray / stray_width.powi(2)) / p;
        Some([p.ln(), weight * x / sd_m, weight / (sd_m * sd_m)])
    }
}
