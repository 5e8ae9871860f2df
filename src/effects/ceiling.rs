//! A receiver that saturates: its output for an echo and for the speckle of the echo.
//!
//! The output for a power u is h(u) = u·(1 + (u/P_sat)^p)^(−1/p). A fast receiver applies h to the mean of ℓ of
//! the L looks at a time. It turns a mean P̄ into M = E h(u), with u from the Gamma distribution of ℓ looks about P̄, and
//! the relative deviation 1/√L of the speckle into β/√L, with β = √ℓ·sd h(u)/M. A gain control slower than
//! a chirp acts on the mean alone: M = h(P̄), β = 1. The output for a received power P is then M·(P/P̄)^β. It has that
//! mean and that deviation to first order, and can be inverted.

/// Number of looks from which speckle is neglected.
const STEADY: f64 = 1e4;
/// Nodes of an integral over the speckle.
const NODES: usize = 40;
/// Reach of these nodes, in standard deviations of the speckle.
const REACH: f64 = 8.0;
/// Least β, so that the output can be inverted.
const LEAST_PASSED: f64 = 0.01;

/// The saturation of a receiver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ceiling {
    /// Saturation power P_sat, W; infinite for a linear receiver.
    pub saturation_w: f64,
    /// Exponent p: the larger, the sharper the onset.
    pub knee: f64,
    /// 1 for a fast receiver, 0 for one that acts on the mean alone; values between interpolate.
    pub at_once: f64,
    /// Looks averaged before the saturation, as ln ℓ/ln L: from 0 for single looks to 1 for all.
    pub averaged: f64,
}

/// A ceiling for the speckle of one receiver.
#[derive(Clone, Debug, PartialEq)]
pub struct SaturationCurve {
    ln_saturation: f64,
    /// ln(M/P_sat) and β over ln(P̄/P_sat), from [`FIRST`] in steps of [`STEP`]; empty for a linear receiver.
    knots: Vec<[f64; 2]>,
}

/// First ln(P̄/P_sat) of the table; below it the receiver is linear.
const FIRST: f64 = -14.0;
/// Last ln(P̄/P_sat) of the table; above it the output is constant.
const LAST: f64 = 12.0;
/// Step of the table in ln(P̄/P_sat), whose interpolation errs by 0.002 dB.
const STEP: f64 = 0.05;

/// The mean and the speckle at the output of the receiver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Output {
    /// ln M.
    pub ln_mean: f64,
    /// Factor β, above 0, on a small relative deviation from the mean.
    pub slope: f64,
}

impl Ceiling {
    /// No saturation.
    pub const NONE: Ceiling =
        Ceiling { saturation_w: f64::INFINITY, knee: 1.0, at_once: 1.0, averaged: 1.0 };

    /// The saturation curve for speckle of this number of looks.
    pub fn over(self, looks: f64) -> SaturationCurve {
        let ln_saturation = self.saturation_w.ln();
        if ln_saturation == f64::INFINITY {
            return SaturationCurve { ln_saturation, knots: Vec::new() };
        }
        let speckle = Speckle::new(looks.powf(self.averaged));
        let count = ((LAST - FIRST) / STEP) as usize;
        let ln_means = (0..=count).map(|k| FIRST + STEP * k as f64);
        let knots = ln_means.map(|ln_mean| self.knot(&speckle, ln_mean)).collect();
        SaturationCurve { ln_saturation, knots }
    }

    /// ln(M/P_sat) and β at ln(P̄/P_sat).
    fn knot(&self, speckle: &Speckle, ln_mean: f64) -> [f64; 2] {
        let mean = ln_mean.exp();
        let slow = self.held(mean);
        let (held, slope) = if speckle.nodes.is_empty() {
            (slow, (slow / mean).powf(self.knee))
        } else {
            self.held_speckle(speckle, mean)
        };
        let at_once = self.at_once;
        let ln_held = at_once * held.ln() + (1.0 - at_once) * slow.ln();
        [ln_held, (1.0 - at_once * (1.0 - slope)).max(LEAST_PASSED)]
    }

    /// E h(u) and β, in units of P_sat.
    fn held_speckle(&self, speckle: &Speckle, mean: f64) -> (f64, f64) {
        let held = speckle.nodes.iter().map(|(x, weight)| (self.held(mean * x), weight));
        let [first, second] = held.fold([0.0; 2], |[first, second], (held, weight)| {
            [first + weight * held, second + weight * held * held]
        });
        let share = (second / (first * first) - 1.0).max(0.0).sqrt();
        (first, share / speckle.sd)
    }

    /// h(u) in units of P_sat.
    fn held(&self, power: f64) -> f64 {
        power * (1.0 + power.powf(self.knee)).powf(-1.0 / self.knee)
    }
}

impl SaturationCurve {
    /// The mean of the output and β, from ln of the mean power, W.
    pub fn of(&self, ln_mean: f64) -> Output {
        let below = ln_mean - self.ln_saturation - FIRST;
        let (true, [_, .., last]) = (below > 0.0, &self.knots[..]) else {
            return Output { ln_mean, slope: 1.0 };
        };
        let cell = (below / STEP) as usize;
        let [a, b] = [cell, cell + 1].map(|k| self.knots.get(k).unwrap_or(last));
        let t = (below / STEP - cell as f64).min(1.0);
        let [ln_held, slope] = [0, 1].map(|k| (1.0 - t) * a[k] + t * b[k]);
        Output { ln_mean: self.ln_saturation + ln_held, slope }
    }

    /// The output, W, for a received power, W, whose mean is `mean_w`, W.
    pub fn passed_w(&self, mean_w: f64, power_w: f64) -> f64 {
        if self.knots.is_empty() || mean_w <= 0.0 || power_w <= 0.0 {
            return power_w;
        }
        let Output { ln_mean, slope } = self.of(mean_w.ln());
        (ln_mean + slope * (power_w / mean_w).ln()).exp()
    }

    /// Relative change of the mean output per small relative change of the mean `mean_w`, W.
    pub fn passes(&self, mean_w: f64) -> f64 {
        const STEP: f64 = 0.01;
        let [more, less] = [STEP, -STEP].map(|step| self.of(mean_w.ln() + step).ln_mean);
        (more - less) / (2.0 * STEP)
    }
}

/// Powers of ℓ looks over their mean, with their weights, by the midpoint rule over ln u.
struct Speckle {
    /// Empty without fluctuation.
    nodes: Vec<(f64, f64)>,
    sd: f64,
}

impl Speckle {
    fn new(looks: f64) -> Speckle {
        if looks >= STEADY {
            return Speckle { nodes: Vec::new(), sd: 0.0 };
        }
        let reach = REACH / looks.sqrt();
        let (from, to) = (-reach, reach.ln_1p());
        let node = |k: usize| {
            let t = from + (to - from) * (k as f64 + 0.5) / NODES as f64;
            (t.exp(), (looks * (t - t.exp() + 1.0)).exp())
        };
        let nodes: Vec<(f64, f64)> = (0..NODES).map(node).collect();
        let sum: f64 = nodes.iter().map(|(_, weight)| weight).sum();
        let mean: f64 = nodes.iter().map(|(x, weight)| x * weight).sum::<f64>() / sum;
        let nodes: Vec<(f64, f64)> =
            nodes.into_iter().map(|(x, weight)| (x / mean, weight / sum)).collect();
        let variance: f64 = nodes.iter().map(|(x, weight)| weight * (x - 1.0).powi(2)).sum();
        Speckle { nodes, sd: variance.sqrt() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::random::{Key, Purpose};

    const LOOKS: f64 = 4.0;

    #[test]
    fn a_linear_receiver_changes_nothing() {
        let linear = Ceiling::NONE.over(LOOKS);
        assert_eq!(linear.passed_w(1e-9, 3e-9), 3e-9);
        assert_eq!(linear.of(-20.0).slope, 1.0);
        // Far below its saturation power a receiver is linear, too.
        let high = Ceiling { saturation_w: 1.0, ..Ceiling::NONE }.over(LOOKS);
        assert!((high.passed_w(1e-9, 3e-9) / 3e-9 - 1.0).abs() < 1e-6);
    }

    #[test]
    fn between_the_knots_the_curve_is_kept() {
        let ceiling = Ceiling { saturation_w: 1.0, knee: 4.0, ..Ceiling::NONE };
        let (table, speckle) = (ceiling.over(LOOKS), Speckle::new(LOOKS));
        for k in 0..400 {
            let ln_mean = -10.0 + STEP * (f64::from(k) + 0.5);
            let [ln_held, _] = ceiling.knot(&speckle, ln_mean);
            let off_db = 10.0 / std::f64::consts::LN_10 * (table.of(ln_mean).ln_mean - ln_held);
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
        let passed = ceiling.over(f64::INFINITY).of(2e-7f64.ln());
        assert!((passed.ln_mean - (1e-7 * ceiling.held(2.0)).ln()).abs() < 3e-4);
        assert!((passed.slope - 0.2).abs() < 3e-4);
    }

    /// Mean and relative deviation of what passes, by draws.
    fn drawn(ceiling: &Ceiling, mean_w: f64) -> [f64; 2] {
        let at_a_time = LOOKS.powf(ceiling.averaged);
        let times = (LOOKS / at_a_time).round() as usize;
        let mut draws = Key { seed: 8, chirp: 0, sub_ray: 0, purpose: Purpose::Speckle }.draws();
        let mut one = || {
            let held = (0..times).map(|_| ceiling.held(mean_w / 1e-7 * draws.gamma(at_a_time)));
            1e-7 * held.sum::<f64>() / times as f64
        };
        let count = 200_000;
        let powers: Vec<f64> = (0..count).map(|_| one()).collect();
        let mean = powers.iter().sum::<f64>() / count as f64;
        let variance = powers.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / count as f64;
        [mean, variance.sqrt() / mean]
    }

    #[test]
    fn mean_and_deviation_are_those_of_draws() {
        for averaged in [0.0, 1.0] {
            for (knee, mean_w) in [(1.0, 0.3e-7f64), (1.0, 3e-7), (2.5, 1e-7), (2.5, 10e-7)] {
                let ceiling = Ceiling { saturation_w: 1e-7, knee, at_once: 1.0, averaged };
                let passed = ceiling.over(LOOKS).of(mean_w.ln());
                let [mean, deviation] = drawn(&ceiling, mean_w);
                // 200 000 draws determine it to a fifth of a percent.
                assert!((passed.ln_mean.exp() / mean - 1.0).abs() < 2e-3, "{ceiling:?} {mean_w}");
                let expected = (deviation * LOOKS.sqrt()).max(LEAST_PASSED);
                assert!((passed.slope / expected - 1.0).abs() < 0.02, "{ceiling:?} {mean_w}");
            }
        }
    }
}
