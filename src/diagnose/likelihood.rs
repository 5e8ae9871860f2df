//! How probable what was seen is under a prediction.
//!
//! A detected power y has the density of Gamma(L, (μ + N)/L) in ln y, a chirp that saw nothing the
//! probability of staying below the threshold T. Tilts that vary at random shift ln μ by slope·t, t
//! normal, to first order, and the likelihood is averaged over t by five nodes of Gauss–Hermite. The
//! first order is not enough within a tilt's size of normal incidence. Ranges are normal about the
//! predicted ones. A share of one in ten thousand of all chirps may be anything, so that a
//! silhouette that the mesh misses costs a bounded amount.

use crate::effects::Prediction;
use crate::fit::gamma_law::{GammaLaw, LnProbability};

use super::looks::Observation;

/// Share of chirps that no model explains.
const OUTLIERS: f64 = 1e-4;
/// Their density in ln power, as wide as 60 dB.
const OUTLIER_DENSITY: f64 = 1.0 / 13.8;
/// Standard deviations of the score of a look that count at most where a start is sought.
const MOST_PULL: f64 = 4.0;
/// Share of ranges that no model explains, and how much wider than the rest these are.
const STRAY_RANGES: f64 = 0.01;
const STRAY_WIDTH: f64 = 10.0;
/// Nodes and weights of five-point Gauss–Hermite quadrature over the standard normal law.
const NODES: [(f64, f64); 5] = [
    (-2.856_970_013_872_806, 0.011_257_411_327_721),
    (-1.355_626_179_974_266, 0.222_075_922_005_613),
    (0.0, 0.533_333_333_333_333),
    (1.355_626_179_974_266, 0.222_075_922_005_613),
    (2.856_970_013_872_806, 0.011_257_411_327_721),
];
/// A mean so far below the threshold that nothing is ever detected, for rays that miss.
const NOTHING: f64 = 1e-9;

/// What is declared of the receiver and no effect changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Declared {
    /// Least power of a detection, W.
    pub threshold_w: f64,
    /// Standard deviation of a range, m; 0 where ranges are not to be used.
    pub range_sd_m: f64,
}

/// A law made ready for one prediction.
pub(super) struct Likelihood<'a> {
    prediction: &'a Prediction,
    declared: Declared,
    law: GammaLaw,
}

/// One chirp's part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Term {
    /// ln p.
    pub ln_p: f64,
    /// ln(μ + N) without tilt.
    pub ln_mean: f64,
    /// d ln p/d ln mean.
    pub slope: f64,
    /// The same as if there were no outliers, but no more than [`MOST_PULL`] standard deviations.
    pub pull: f64,
    /// −d² ln p/d(ln mean)², never negative.
    pub bend: f64,
    /// Predicted range, m; 0 where nothing arrives.
    pub range_m: f64,
    /// d ln p/d range, 1/m, and −d² ln p/d range², 1/m², never negative.
    pub range_slope: f64,
    pub range_bend: f64,
}

impl<'a> Likelihood<'a> {
    pub fn new(prediction: &'a Prediction, declared: Declared) -> Likelihood<'a> {
        Likelihood { prediction, declared, law: GammaLaw::new(prediction.receiver.looks) }
    }

    /// ln of the mean power of a look and its weight for every tilt.
    pub fn ln_means(&self, look: usize) -> Vec<(f64, f64)> {
        let receiver = &self.prediction.receiver;
        let arrived = self.prediction.arrived.get(look).copied().flatten();
        let floor_w = NOTHING * self.declared.threshold_w;
        let power_w = arrived.map_or(0.0, |a| a.power_w).max(0.0);
        let mean = |factor: f64| (power_w * factor + receiver.noise_w).max(floor_w).ln();
        let slope = self.prediction.slope_per_rad.get(look).copied().unwrap_or(0.0);
        let spread = slope * receiver.tilt_sd_rad;
        if spread == 0.0 {
            return vec![(mean(1.0), 1.0)];
        }
        NODES.iter().map(|(t, weight)| (mean((spread * t).exp()), *weight)).collect()
    }

    /// Mean power of a look with thermal noise, W.
    pub fn mean_w(&self, look: usize) -> f64 {
        let means = self.ln_means(look);
        means.iter().map(|(ln_mean, weight)| weight * ln_mean.exp()).sum()
    }

    /// How much of a relative fluctuation of a look's power the receiver passes.
    pub fn passes(&self, look: usize) -> f64 {
        let arrived = self.prediction.arrived.get(look).copied().flatten();
        self.prediction.receiver.passes(arrived.map_or(0.0, |arrived| arrived.power_w))
    }

    /// One chirp's part of the likelihood.
    pub fn term(&self, look: usize, seen: &Observation) -> Term {
        let (means, passes) = (self.ln_means(look), self.passes(look));
        let (mut p, mut slope, mut bend, mut pull) = (0.0, 0.0, 0.0, 0.0);
        for &(ln_mean, weight) in &means {
            let law = match seen.power_w {
                Some(power_w) => self.detected(power_w, ln_mean, passes),
                None => self.limited(self.declared.threshold_w, ln_mean, passes),
            };
            let part = (1.0 - OUTLIERS) * weight * law.value.exp();
            p += part;
            slope += part * law.by_ln_mean;
            pull += weight * law.by_ln_mean;
            bend += part * law.bend;
        }
        let anything = if seen.power_w.is_some() { OUTLIER_DENSITY } else { 0.5 };
        let most = MOST_PULL * self.prediction.receiver.looks.sqrt() / passes;
        let pull = pull.clamp(-most, most);
        p += OUTLIERS * anything;
        let ln_mean = means.get(means.len() / 2).map_or(0.0, |mean| mean.0);
        let arrived = self.prediction.arrived.get(look).copied().flatten();
        let range_m = arrived.map_or(0.0, |arrived| arrived.range_m);
        let [ln_range, range_slope, range_bend] = self.range(range_m, seen);
        Term {
            ln_p: p.ln() + ln_range,
            ln_mean,
            slope: slope / p,
            pull,
            bend: bend / p,
            range_m,
            range_slope,
            range_bend,
        }
    }

    /// Probability that the power of a look stays below a level, W.
    pub fn below(&self, look: usize, level_w: f64) -> f64 {
        let passes = self.passes(look);
        let part = |(ln_mean, weight): &(f64, f64)| {
            weight * self.limited(level_w, *ln_mean, passes).value.exp()
        };
        self.ln_means(look).iter().map(part).sum()
    }

    /// Probability that a power of this mean is detected where so much of a fluctuation passes.
    pub fn chance(&self, ln_mean: f64, passes: f64) -> f64 {
        1.0 - self.limited(self.declared.threshold_w, ln_mean, passes).value.exp()
    }

    /// ln density of a detected power per unit of ln power: what the receiver has held down is ln y's
    /// distance from ln mean.
    fn detected(&self, power_w: f64, ln_mean: f64, passes: f64) -> LnProbability {
        let law = self.law.detected(ln_mean + (power_w.ln() - ln_mean) / passes, ln_mean);
        LnProbability { value: law.value - passes.ln(), ..held_down(law, passes) }
    }

    /// ln probability that the power stays below a limit.
    fn limited(&self, limit_w: f64, ln_mean: f64, passes: f64) -> LnProbability {
        held_down(self.law.below(ln_mean + (limit_w.ln() - ln_mean) / passes, ln_mean), passes)
    }

    /// ln p of a range, its slope and its curvature by the predicted range.
    fn range(&self, predicted_m: f64, seen: &Observation) -> [f64; 3] {
        let sd_m = self.declared.range_sd_m;
        let Some(range_m) = seen.range_m.filter(|_| sd_m > 0.0 && predicted_m > 0.0) else {
            return [0.0; 3];
        };
        let x = (range_m - predicted_m) / sd_m;
        let bell = |x: f64| (-0.5 * x * x).exp();
        let near = (1.0 - STRAY_RANGES) * bell(x);
        let stray = STRAY_RANGES / STRAY_WIDTH * bell(x / STRAY_WIDTH);
        let p = (near + stray).max(f64::MIN_POSITIVE);
        let weight = (near + stray / STRAY_WIDTH.powi(2)) / p;
        [p.ln(), weight * x / sd_m, weight / (sd_m * sd_m)]
    }
}

/// The derivatives where a step of ln mean is so much larger against what fluctuates.
fn held_down(law: LnProbability, passes: f64) -> LnProbability {
    let by_ln_mean = law.by_ln_mean / passes;
    LnProbability { by_ln_mean, bend: law.bend / (passes * passes), ..law }
}
