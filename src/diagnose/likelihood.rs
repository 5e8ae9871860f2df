//! The likelihood of the observations under a prediction.
//!
//! A detected power y has the density of Gamma(L, (μ + N)/L) in ln y, L the looks of its chirp: those of the speckle, and more
//! where a part of the echo does not speckle ([`Receiver::looks_of`](crate::effects::Receiver::looks_of)). A chirp without a detection has the
//! probability of staying below the threshold T, or below the false alarm that was reported instead. Both apply before
//! a receiver that saturates. Where tilts vary at random the likelihood is averaged over them. Ranges are normal about the predicted
//! ones. One in ten thousand chirps is an outlier of any power, so that a silhouette that the mesh misses
//! costs a bounded amount.

use std::borrow::Cow;

use rayon::prelude::*;

use super::observation::{Observation, ReceiverLimits};
use super::shared::SharedSpeckle;
use crate::effects::Prediction;
use crate::fit::gamma_law::{GammaLaw, LnProbability};
use crate::lanes::{exp_all, ln_all};

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

/// Shots that one task evaluates.
const SHOTS_PER_TASK: usize = 256;

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
    /// ln of the looks, and d ln p/d ln looks.
    pub ln_looks: f64,
    pub looks_slope: f64,
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

    /// The mean power of a shot with thermal noise, its looks, and its weight, for every tilt.
    pub fn means(&self, shot: usize) -> impl Iterator<Item = Mean> {
        let Likelihood { prediction, declared, .. } = self;
        let (floor_w, noise_w) = (NOTHING * declared.threshold_w, prediction.receiver.noise_w);
        prediction.powers_w(shot).map(move |(power_w, weight)| Mean {
            ln_mean: (power_w + noise_w).max(floor_w).ln(),
            looks: prediction.looks(shot, power_w),
            weight,
        })
    }

    /// The part of every shot.
    pub fn terms(&self, observations: &[Observation]) -> Vec<Term> {
        let tasks = observations.par_chunks(SHOTS_PER_TASK).enumerate();
        let terms = tasks.map(|(task, some)| {
            let seen: Vec<_> = (task * SHOTS_PER_TASK..).zip(some.iter().copied()).collect();
            self.terms_of(&seen)
        });
        terms.collect::<Vec<_>>().concat()
    }

    /// The part of each of some shots. Exponentials and logarithms are taken of all shots at once, in vector
    /// instructions.
    pub fn terms_of(&self, seen: &[(usize, Observation)]) -> Vec<Term> {
        let Likelihood { prediction, declared, .. } = *self;
        let mut ln_seen: Vec<f64> = seen.iter().map(|(_, seen)| seen.level_w(declared)).collect();
        ln_all(&mut ln_seen);
        // The law of every power for every tilt.
        let floor_w = NOTHING * declared.threshold_w;
        let powers = seen.iter().map(|(shot, _)| prediction.powers_w(*shot));
        let tilts = powers.clone().next().map_or(1, Iterator::count);
        let noise_w = prediction.receiver.noise_w;
        let mut ln_means: Vec<f64> =
            powers.flatten().map(|(power_w, _)| (power_w + noise_w).max(floor_w)).collect();
        ln_all(&mut ln_means);
        let mut laws = Vec::with_capacity(ln_means.len());
        let mut ln_entered = Vec::with_capacity(ln_means.len());
        for (ln_means, ((shot, seen), ln_seen)) in
            ln_means.chunks_exact(tilts).zip(seen.iter().zip(&ln_seen))
        {
            for (ln_mean, (power_w, _)) in ln_means.iter().zip(prediction.powers_w(*shot)) {
                let law = self.law(prediction.looks(*shot, power_w));
                let entered = self.entered(*ln_mean, *ln_seen);
                ln_entered.push(entered[0]);
                laws.push(match seen.power_w {
                    Some(_) => detected(&law, entered, *ln_mean),
                    None => law.below(entered[0], *ln_mean),
                });
            }
        }
        let mut p_of_tilts: Vec<f64> = laws.iter().map(|law| law.value).collect();
        exp_all(&mut p_of_tilts);
        // Their means over the tilts.
        let mut powers = Vec::with_capacity(seen.len());
        for (place, (shot, seen)) in seen.iter().enumerate() {
            let (mut mean, tilts) = (OfPower::default(), place * tilts..(place + 1) * tilts);
            let weights = prediction.powers_w(*shot).map(|(_, weight)| weight);
            for ((law, p), weight) in
                laws[tilts.clone()].iter().zip(&p_of_tilts[tilts]).zip(weights)
            {
                mean.add((1.0 - OUTLIERS) * weight * p, weight, law);
            }
            mean.p += OUTLIERS * if seen.power_w.is_some() { OUTLIER_DENSITY } else { 0.5 };
            powers.push(mean);
        }
        let mut ln_p: Vec<f64> = powers.iter().map(|power| power.p).collect();
        ln_all(&mut ln_p);
        if tilts > 1 {
            ln_means = seen.iter().map(|(shot, _)| prediction.mean_w(*shot).max(floor_w)).collect();
            ln_all(&mut ln_means);
            let means = ln_means.iter().zip(&ln_seen);
            ln_entered =
                means.map(|(ln_mean, ln_seen)| self.entered(*ln_mean, *ln_seen)[0]).collect();
        }
        let ranges = self.ranges(seen);
        let lost = ln_seen.iter().zip(ln_entered).map(|(ln_seen, ln_entered)| ln_entered - ln_seen);
        let each = seen.iter().zip(lost).zip(ln_means).zip(powers).zip(ln_p).zip(ranges);
        each.map(|(((((&(shot, _), lost), ln_mean), power), ln_p), range)| {
            let weight = self.shared.weight(shot);
            let arrived = prediction.arrived.get(shot).copied().flatten();
            let looks = prediction.looks(shot, arrived.map_or(0.0, |arrived| arrived.power_w));
            let most_pull = MOST_PULL * looks.sqrt();
            Term {
                ln_p: weight * ln_p + range.ln_p,
                ln_mean: ln_mean - lost,
                slope: weight * power.slope / power.p,
                pull: weight * power.pull.clamp(-most_pull, most_pull),
                bend: weight * power.bend / power.p,
                ln_looks: looks.ln(),
                looks_slope: weight * power.looks_slope / power.p,
                ln_range: range.ln_p,
                range_m: arrived.map_or(0.0, |arrived| arrived.range_m),
                range_slope: range.slope,
                range_bend: range.bend,
                weight,
            }
        })
        .collect()
    }

    /// Probability that the power of a shot stays below a level, W.
    pub fn below(&self, shot: usize, level_w: f64) -> f64 {
        self.means(shot).map(|mean| mean.weight * self.below_of(&mean, level_w)).sum()
    }

    /// Probability that a power of this mean is detected.
    pub fn chance(&self, mean: &Mean) -> f64 {
        1.0 - self.below_of(mean, self.declared.threshold_w)
    }

    /// Probability that a power of this mean stays below a level, W.
    fn below_of(&self, mean: &Mean, level_w: f64) -> f64 {
        let [ln_entered, _] = self.entered(mean.ln_mean, level_w.ln());
        self.law(mean.looks).below(ln_entered, mean.ln_mean).value.exp()
    }

    /// The law of so many looks.
    fn law(&self, looks: f64) -> Cow<'_, GammaLaw> {
        if looks == self.law.looks() {
            Cow::Borrowed(&self.law)
        } else {
            Cow::Owned(GammaLaw::for_limits(looks, 1))
        }
    }

    /// ln of the power at the input of the receiver whose output is `ln_seen`, and the slope of the output by
    /// the input.
    fn entered(&self, ln_mean: f64, ln_seen: f64) -> [f64; 2] {
        let [ln_ratio, slope] = self.prediction.saturating.entered(ln_mean, ln_seen);
        [ln_mean + ln_ratio, slope]
    }

    /// ln p of the range of each shot; 0 where none is to be used.
    fn ranges(&self, seen: &[(usize, Observation)]) -> Vec<OfRange> {
        let Likelihood { prediction, declared, .. } = *self;
        let sd_m = declared.range_sd_m;
        // How far a range is off, and how far the near and the stray ones spread, in standard deviations.
        let off = seen.iter().map(|(shot, seen)| {
            let arrived = prediction.arrived.get(*shot).copied().flatten()?;
            let off = declared.range_off_m(&arrived, seen)? / sd_m;
            let spread = arrived.spread_m / sd_m;
            Some((off, (UNSURE * spread).hypot(1.0), STRAY_WIDTH.max(spread)))
        });
        let off: Vec<Option<(f64, f64, f64)>> = off.collect();
        let (mut near, mut stray): (Vec<f64>, Vec<f64>) = off
            .iter()
            .map(|off| off.unwrap_or((0.0, 1.0, 1.0)))
            .map(|(off, near, stray)| {
                [near, stray].map(|width| -0.5 * (off / width).powi(2)).into()
            })
            .unzip();
        exp_all(&mut near);
        exp_all(&mut stray);
        let mut found: Vec<OfRange> = Vec::with_capacity(seen.len());
        for (off, (near, stray)) in off.iter().zip(near.iter().zip(&stray)) {
            let Some((off, width, stray_width)) = *off else {
                found.push(OfRange { p: 1.0, ..OfRange::default() });
                continue;
            };
            let near = (1.0 - STRAY_RANGES) / width * near;
            let stray = STRAY_RANGES / stray_width * stray;
            let p = (near + stray).max(f64::MIN_POSITIVE);
            let weight = (near / width.powi(2) + stray / stray_width.powi(2)) / p;
            let (slope, bend) = (weight * off / sd_m, weight / (sd_m * sd_m));
            found.push(OfRange { p, slope, bend, ..OfRange::default() });
        }
        let mut ln_p: Vec<f64> = found.iter().map(|range| range.p).collect();
        ln_all(&mut ln_p);
        found.iter_mut().zip(ln_p).for_each(|(range, ln_p)| range.ln_p = ln_p);
        found
    }
}

/// ln density of a detected power per unit of ln power, from what entered a receiver and the slope of its output.
fn detected(law: &GammaLaw, [ln_entered, slope]: [f64; 2], ln_mean: f64) -> LnProbability {
    let law = law.detected(ln_entered, ln_mean);
    let ln_slope = if slope == 1.0 { 0.0 } else { slope.ln() };
    LnProbability { value: law.value - ln_slope, ..law }
}

/// The mean of a power, with thermal noise.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mean {
    /// ln of it, in W.
    pub ln_mean: f64,
    /// Looks of its law.
    pub looks: f64,
    /// Probability of the tilt under which it is this.
    pub weight: f64,
}

/// The probability of a power, averaged over tilts, with p times its derivatives.
#[derive(Clone, Copy, Default)]
struct OfPower {
    p: f64,
    slope: f64,
    pull: f64,
    bend: f64,
    looks_slope: f64,
}

impl OfPower {
    /// Adds the law of one tilt, of a probability with the weight and of the weight alone.
    fn add(&mut self, p: f64, weight: f64, law: &LnProbability) {
        self.p += p;
        self.slope += p * law.by_ln_mean;
        self.pull += weight * law.by_ln_mean;
        self.bend += p * law.bend;
        self.looks_slope += p * law.by_ln_looks;
    }
}

/// The probability of a range, its slope and its curvature by the predicted range.
#[derive(Clone, Copy, Default)]
struct OfRange {
    p: f64,
    ln_p: f64,
    slope: f64,
    bend: f64,
}
