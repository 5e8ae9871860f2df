//! A receiver that saturates: its output for an echo and for the speckle of the echo.
//!
//! The output for a power u is h(u) = P_sat·(1 − (1 + (u/P_sat)ᵖ/q)^(−q))^(1/p). A power P of L looks, whose mean is P̄,
//! comes out as
//!
//! - h(P̄)·P/P̄ of a gain control slower than a chirp, which passes the speckle as it is;
//! - h(P) of a fast receiver behind the average of the looks;
//! - the average of h over the looks, of a fast receiver before it. It is no function of P. What stands for it is the output
//!   with the rank among outputs that P has among powers ([`Ranked`]): both have the same distribution.
//!
//! What lies between these is between their logarithms.

use std::sync::{Arc, OnceLock};

use super::onset::{Onset, OnsetTable, cubic};
use super::ranked::Ranked;

/// Number of looks from which speckle is neglected.
const STEADY: f64 = 1e4;
/// Nodes of an integral over the speckle.
const NODES: usize = 40;
/// Reach of these nodes, in standard deviations of the speckle.
const REACH: f64 = 8.0;
/// Least share of a relative deviation of P that passes, so that the output can be inverted.
const LEAST_PASSED: f64 = 0.003;
/// Greatest |ln(P/P̄)| that is told from its output.
const FARTHEST: f64 = 30.0;

/// The saturation of a receiver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ceiling {
    /// Saturation power P_sat, W; infinite for a linear receiver.
    pub saturation_w: f64,
    /// Exponent p: the larger, the sharper the onset.
    pub knee: f64,
    /// Exponent q: the larger, the faster the output comes to its ceiling.
    pub approach: f64,
    /// 1 for a fast receiver, 0 for one that acts on the mean alone; values between interpolate.
    pub at_once: f64,
    /// 1 for a fast receiver behind the average of the looks, 0 for one before it; values between interpolate.
    pub averaged: f64,
}

/// A ceiling for the speckle of one receiver.
#[derive(Clone, Debug)]
pub struct SaturationCurve {
    ceiling: Ceiling,
    looks: f64,
    ln_saturation: f64,
    onset: OnsetTable,
    /// The output where single looks saturate; `None` where they do not, or where one is all.
    single: Option<Arc<Ranked>>,
    /// ln(M/P_sat) of the mean output M and its slope by ln(P̄/P_sat), from [`FIRST`] in steps of [`STEP`].
    means: OnceLock<Vec<[f64; 2]>>,
}

/// First ln(P̄/P_sat) of the table of means; below it the receiver is linear.
const FIRST: f64 = -14.0;
/// Last ln(P̄/P_sat) of the table; above it the output is constant.
const LAST: f64 = 12.0;
/// Step of the table in ln(P̄/P_sat). Between its nodes cubics err by 0.0002 dB.
const STEP: f64 = 0.125;

impl Ceiling {
    /// No saturation.
    pub const NONE: Ceiling = Ceiling {
        saturation_w: f64::INFINITY,
        knee: 1.0,
        approach: 1.0,
        at_once: 1.0,
        averaged: 1.0,
    };

    /// The saturation curve for speckle of this number of looks.
    pub fn over(self, looks: f64) -> SaturationCurve {
        let ln_saturation = self.saturation_w.ln();
        let is_of_single_looks = ln_saturation < f64::INFINITY
            && self.at_once > 0.0
            && self.averaged < 1.0
            && looks < STEADY;
        let single = is_of_single_looks.then(|| Ranked::of(self.onset(), looks)).flatten();
        let onset = OnsetTable::new(self.onset());
        SaturationCurve {
            ceiling: self,
            looks,
            ln_saturation,
            onset,
            single,
            means: OnceLock::new(),
        }
    }

    fn onset(self) -> Onset {
        Onset { knee: self.knee, approach: self.approach }
    }

    /// Shares of a receiver slower than a chirp, of one behind the average of the looks, and of one before it.
    fn shares(self) -> [f64; 3] {
        let Ceiling { at_once, averaged, .. } = self;
        [1.0 - at_once, at_once * averaged, at_once * (1.0 - averaged)]
    }
}

impl SaturationCurve {
    /// Whether nothing saturates.
    pub fn is_linear(&self) -> bool {
        self.ln_saturation == f64::INFINITY
    }

    /// ln of the mean output, W, from ln of the mean power, W.
    pub fn ln_mean(&self, ln_mean: f64) -> f64 {
        if self.is_linear() {
            return ln_mean;
        }
        if self.looks >= STEADY {
            return self.output(ln_mean, 0.0)[0];
        }
        let below = ln_mean - self.ln_saturation - FIRST;
        if below <= 0.0 {
            return ln_mean;
        }
        let means = self.means.get_or_init(|| self.all_means());
        let place = (below / STEP).min((means.len() - 1) as f64);
        self.ln_saturation + cubic(means, STEP, place)[0]
    }

    fn all_means(&self) -> Vec<[f64; 2]> {
        let of_all = Speckle::new(self.looks);
        let of_each = if self.single.is_some() { Speckle::new(1.0) } else { of_all.clone() };
        let count = ((LAST - FIRST) / STEP).round() as usize;
        let ln_means = (0..=count).map(|k| FIRST + STEP * k as f64);
        let all = ln_means.map(|at| {
            self.mixed(|kind| match kind {
                0 => self.onset.held(at),
                1 => of_all.mean_output(&self.onset, at),
                _ => of_each.mean_output(&self.onset, at),
            })
        });
        all.collect()
    }

    /// The mean of two numbers over the kinds of receiver, by their shares.
    fn mixed(&self, of_kind: impl Fn(usize) -> [f64; 2]) -> [f64; 2] {
        let mut sum = [0.0; 2];
        for (kind, share) in self.ceiling.shares().into_iter().enumerate() {
            if share > 0.0 {
                sum.iter_mut().zip(of_kind(kind)).for_each(|(sum, value)| *sum += share * value);
            }
        }
        sum
    }

    /// ln of the output, W, and its slope by ln P, for a power P, as ln(P/P̄), of which the mean P̄, W, is given by its
    /// logarithm.
    pub fn output(&self, ln_mean: f64, ln_ratio: f64) -> [f64; 2] {
        if self.is_linear() {
            return [ln_mean + ln_ratio, 1.0];
        }
        let mean = ln_mean - self.ln_saturation;
        let [ln_out, slope] = self.output_of(mean, self.onset.held(mean)[0], ln_ratio);
        [self.ln_saturation + ln_out, slope]
    }

    /// [`SaturationCurve::output`] in units of P_sat, where that of the mean is known.
    fn output_of(&self, ln_mean: f64, held_mean: f64, ln_ratio: f64) -> [f64; 2] {
        let averaged = || self.onset.held(ln_mean + ln_ratio);
        let slow = [held_mean + ln_ratio, 1.0];
        let single = || self.single.as_ref().and_then(|ranked| ranked.output(ln_mean, ln_ratio));
        let [ln_out, slope] = self.mixed(|kind| match kind {
            0 => slow,
            1 => averaged(),
            _ => single().unwrap_or_else(averaged),
        });
        // The rest passes as of a slow receiver.
        let least = LEAST_PASSED * self.ceiling.at_once;
        [ln_out + least * (slow[0] - ln_out), slope + least * (1.0 - slope)]
    }

    /// ln(P/P̄) of the power P whose output, W, is given by its logarithm, and the slope there.
    pub fn entered(&self, ln_mean: f64, ln_output: f64) -> [f64; 2] {
        if self.is_linear() {
            return [ln_output - ln_mean, 1.0];
        }
        let mean = ln_mean - self.ln_saturation;
        let held_mean = self.onset.held(mean)[0];
        let sought = ln_output - self.ln_saturation;
        // The output rises with P: Newton's steps, or halves of the interval where they leave it.
        let (mut low, mut high, mut at) = (f64::NEG_INFINITY, f64::INFINITY, 0.0);
        let mut slope = 1.0;
        for _ in 0..60 {
            let [output, slope_here] = self.output_of(mean, held_mean, at);
            slope = slope_here;
            let next = at + (sought - output) / slope;
            (low, high) = if next > at { (at, high) } else { (low, at) };
            let is_within = low <= next && next <= high;
            let next = if is_within { next } else { 0.5 * (low + high) };
            let next = next.clamp(-FARTHEST, FARTHEST);
            let is_there = (next - at).abs() < 1e-6;
            at = next;
            if is_there {
                break;
            }
        }
        [at, slope]
    }

    /// The output, W, for a received power, W, whose mean is `mean_w`, W.
    pub fn passed_w(&self, mean_w: f64, power_w: f64) -> f64 {
        if self.is_linear() || mean_w <= 0.0 || power_w <= 0.0 {
            return power_w;
        }
        self.output(mean_w.ln(), (power_w / mean_w).ln())[0].exp()
    }

    /// Relative change of the mean output per small relative change of the mean `mean_w`, W.
    pub fn passes(&self, mean_w: f64) -> f64 {
        const STEP: f64 = 0.01;
        if self.is_linear() {
            return 1.0;
        }
        let [more, less] = [STEP, -STEP].map(|step| self.ln_mean(mean_w.ln() + step));
        (more - less) / (2.0 * STEP)
    }
}

impl PartialEq for SaturationCurve {
    fn eq(&self, other: &SaturationCurve) -> bool {
        (self.ceiling, self.looks) == (other.ceiling, other.looks)
    }
}

/// ln of the powers of ℓ looks over their mean, with their weights, by the midpoint rule.
#[derive(Clone)]
struct Speckle {
    nodes: Vec<(f64, f64)>,
}

impl Speckle {
    fn new(looks: f64) -> Speckle {
        let reach = REACH / looks.sqrt();
        let (from, to) = (-reach, reach.ln_1p());
        let node = |k: usize| {
            let t = from + (to - from) * (k as f64 + 0.5) / NODES as f64;
            (t, (looks * (t - t.exp() + 1.0)).exp())
        };
        let nodes: Vec<(f64, f64)> = (0..NODES).map(node).collect();
        let sum: f64 = nodes.iter().map(|(_, weight)| weight).sum();
        let mean: f64 = nodes.iter().map(|(t, weight)| t.exp() * weight).sum::<f64>() / sum;
        Speckle {
            nodes: nodes.into_iter().map(|(t, weight)| (t - mean.ln(), weight / sum)).collect(),
        }
    }

    /// ln of the mean output of a power, and its slope by ln of the mean power.
    fn mean_output(&self, onset: &OnsetTable, ln_mean: f64) -> [f64; 2] {
        let (mut sum, mut rise) = (0.0, 0.0);
        for (ln_ratio, weight) in &self.nodes {
            let [ln_held, slope] = onset.held(ln_mean + ln_ratio);
            let output = weight * ln_held.exp();
            sum += output;
            rise += slope * output;
        }
        [sum.ln(), rise / sum]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::random::{Draws, Key, Purpose};

    const LOOKS: f64 = 4.0;

    #[test]
    fn a_linear_receiver_changes_nothing() {
        let linear = Ceiling::NONE.over(LOOKS);
        assert_eq!(linear.passed_w(1e-9, 3e-9), 3e-9);
        assert_eq!(linear.ln_mean(-20.0), -20.0);
        // Far below its saturation power a receiver is linear, too.
        let high = Ceiling { saturation_w: 1.0, ..Ceiling::NONE }.over(LOOKS);
        assert!((high.passed_w(1e-9, 3e-9) / 3e-9 - 1.0).abs() < 1e-6);
    }

    #[test]
    fn between_the_knots_the_curve_is_kept() {
        let ceiling = Ceiling { saturation_w: 1.0, knee: 4.0, at_once: 0.0, ..Ceiling::NONE };
        let table = ceiling.over(LOOKS);
        for k in 0..400 {
            let ln_mean = -10.0 + STEP * (f64::from(k) + 0.5);
            let off_db = crate::effects::testing::db(
                (table.ln_mean(ln_mean) - ceiling.onset().held(ln_mean)[0]).exp(),
            );
            assert!(off_db.abs() < 2e-3, "{ln_mean}: {off_db} dB");
        }
    }

    #[test]
    fn a_slow_gain_control_keeps_the_fluctuation() {
        let slow = Ceiling { saturation_w: 1e-7, at_once: 0.0, ..Ceiling::NONE }.over(LOOKS);
        // A mean at the saturation leaves at half of it, and so does twice that at twice the half.
        assert!((slow.passed_w(1e-7, 1e-7) - 0.5e-7).abs() < 2e-11);
        assert!((slow.passed_w(1e-7, 2e-7) - 1.0e-7).abs() < 4e-11);
        assert!((slow.passes(1e-7) - 0.5).abs() < 1e-2);
    }

    #[test]
    fn without_speckle_the_slope_is_that_of_the_ceiling() {
        let ceiling = Ceiling { saturation_w: 1e-7, knee: 2.0, ..Ceiling::NONE };
        let curve = ceiling.over(f64::INFINITY);
        let [ln_output, slope] = curve.output(2e-7f64.ln(), 0.0);
        assert!((ln_output - (2e-7 / 5f64.sqrt()).ln()).abs() < 1e-7);
        assert!((slope - 0.2 - LEAST_PASSED * 0.8).abs() < 1e-5);
    }

    /// An output, by its definition.
    fn drawn(ceiling: &Ceiling, looks: u32, mean_w: f64, draws: &mut Draws) -> f64 {
        let held = |power_w: f64| {
            let ratio = power_w / ceiling.saturation_w;
            power_w / (1.0 + ratio.powf(ceiling.knee)).powf(1.0 / ceiling.knee)
        };
        if ceiling.averaged == 1.0 {
            return held(mean_w * draws.gamma(f64::from(looks)));
        }
        (0..looks).map(|_| held(mean_w * draws.gamma(1.0))).sum::<f64>() / f64::from(looks)
    }

    /// Mean and ranks of outputs are those of the definition, for echoes far below the ceiling and far above.
    #[test]
    fn outputs_have_the_law_of_draws() {
        const COUNT: usize = 100_000;
        let mut draws = Key { seed: 8, chirp: 0, sub_ray: 0, purpose: Purpose::Speckle }.draws();
        for (looks, averaged) in [(1, 0.0), (2, 0.0), (4, 0.0), (4, 1.0), (9, 0.0)] {
            for (knee, mean_w) in [(1.0, 0.1e-7f64), (1.3, 1e-7), (1.3, 10e-7), (2.5, 3e-7)] {
                let ceiling = Ceiling { saturation_w: 1e-7, knee, averaged, ..Ceiling::NONE };
                let curve = ceiling.over(f64::from(looks));
                let mut outputs: Vec<f64> =
                    (0..COUNT).map(|_| drawn(&ceiling, looks, mean_w, &mut draws)).collect();
                outputs.sort_by(f64::total_cmp);
                // The draws determine the mean to a third of a percent at most.
                let mean = outputs.iter().sum::<f64>() / COUNT as f64;
                let off = curve.ln_mean(mean_w.ln()).exp() / mean - 1.0;
                assert!(off.abs() < 0.01, "{ceiling:?} {looks} {mean_w}: {off}");
                // Ranks of draws are off by 0.005 (Kolmogorov) with a probability of 1 %.
                for k in (0..COUNT).step_by(COUNT / 50).skip(1) {
                    let [ln_ratio, slope] = curve.entered(mean_w.ln(), outputs[k].ln());
                    if slope < 20.0 * LEAST_PASSED {
                        continue;
                    }
                    let of_power = statrs::function::gamma::gamma_lr(
                        f64::from(looks),
                        f64::from(looks) * ln_ratio.exp(),
                    );
                    let off = of_power - k as f64 / COUNT as f64;
                    assert!(off.abs() < 0.02, "{ceiling:?} {looks} {mean_w} {k}: {off}");
                }
            }
        }
    }

    #[test]
    fn mean_and_deviation_are_those_of_draws() {
        const COUNT: usize = 200_000;
        let mut draws = Key { seed: 8, chirp: 1, sub_ray: 0, purpose: Purpose::Speckle }.draws();
        let moments = |powers: &[f64]| {
            let mean = powers.iter().sum::<f64>() / COUNT as f64;
            let variance = powers.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / COUNT as f64;
            [mean, variance.sqrt() / mean]
        };
        for averaged in [0.0, 1.0] {
            for (knee, mean_w) in [(1.0, 0.3e-7f64), (1.0, 3e-7), (2.5, 1e-7), (2.5, 10e-7)] {
                let ceiling = Ceiling { saturation_w: 1e-7, knee, averaged, ..Ceiling::NONE };
                let curve = ceiling.over(LOOKS);
                let defined: Vec<f64> =
                    (0..COUNT).map(|_| drawn(&ceiling, 4, mean_w, &mut draws)).collect();
                let passed: Vec<f64> = (0..COUNT)
                    .map(|_| curve.passed_w(mean_w, mean_w * draws.gamma(LOOKS)))
                    .collect();
                let [[mean, deviation], [own, own_deviation]] =
                    [moments(&defined), moments(&passed)];
                // 200 000 draws determine the mean to a fifth of a percent.
                assert!(
                    (curve.ln_mean(mean_w.ln()).exp() / mean - 1.0).abs() < 2e-3,
                    "{ceiling:?}"
                );
                assert!((own / mean - 1.0).abs() < 4e-3, "{ceiling:?} {mean_w}: {own} {mean}");
                let off = own_deviation / deviation - 1.0;
                assert!(off.abs() < 0.02, "{ceiling:?} {mean_w}: {own_deviation} {deviation}");
            }
        }
    }

    #[test]
    fn what_came_out_is_led_back_to_what_went_in() {
        for (averaged, knee) in [(0.0, 1.0), (0.4, 1.5), (1.0, 4.0)] {
            let ceiling =
                Ceiling { saturation_w: 1e-7, knee, approach: 2.0, at_once: 0.9, averaged };
            let curve = ceiling.over(LOOKS);
            for (ln_mean, ln_ratio) in [(-20.0, -3.0), (-16.1, 0.7), (-14.0, 1.5), (-12.0, -6.0)] {
                let [ln_output, slope] = curve.output(ln_mean, ln_ratio);
                let [back, same] = curve.entered(ln_mean, ln_output);
                assert!((back - ln_ratio).abs() < 1e-6, "{ceiling:?} {ln_ratio}: {back}");
                assert!((same - slope).abs() < 1e-6);
                let more = curve.output(ln_mean, ln_ratio + 1e-5)[0];
                assert!(((more - ln_output) / 1e-5 / slope - 1.0).abs() < 1e-3);
            }
        }
    }
}
