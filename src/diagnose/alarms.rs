//! Chirps that see no target: their silence, and what noise alone made them report.
//!
//! A receiver reports the strongest of the n cells of its gate, if that reaches the threshold T. Of noise N with L looks it
//! is below y with the probability G(y)ⁿ, where G is that of one cell. A false alarm y then has the density n·g(y)·G(y)ⁿ⁻¹ in
//! ln y, and silence has G(T)ⁿ. Where no gate is declared, n is the most likely one, so that only the powers of false alarms
//! tell N: a cloud without any may have been cleaned, and its silence is no evidence.

use super::observation::{DB, ReceiverLimits};
use crate::effects::Receiver;
use crate::fit::gamma_law::GammaLaw;

/// Power over the threshold above which a detection is no false alarm: it would be far beyond the tail of any noise
/// that is mostly below.
pub(super) const MOST_OVER_THRESHOLD: f64 = 4.0;
/// Share of detections among false alarms that noise did not make, and their density in ln power.
const OUTLIERS: f64 = 1e-3;
const OUTLIER_DENSITY: f64 = 1.0 / 1.4;
/// Noise, as a share of the threshold, where none is declared.
const LEAST_NOISE: f64 = 1e-3;
/// Most cells of a gate.
const MOST_CELLS: f64 = 1e6;
/// Gain in ln likelihood of another noise level from which false alarms are not those of the model's.
const UNLIKE: f64 = 12.0;
/// Difference from their law from which false alarms are something else, and the size that each then stands for, dB.
const OFF_THEIR_LAW: f64 = 2.3;
const OUTLYING_DB: f64 = 10.0;
/// Gain in ln likelihood from which on false alarms determine another level of noise.
const TOLD: f64 = 5.0;
/// Levels of noise that are tried, dB over the model's.
const LEVELS_DB: std::ops::RangeInclusive<i32> = -12..=12;

/// What chirps that see no target report.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Alarms {
    /// Powers of false alarms, W.
    pub powers_w: Vec<f64>,
    /// How many others lie near the target by chance, and are among the strays.
    pub near_target: f64,
    /// Number of chirps that stay silent.
    pub silent: usize,
    /// Looks of the noise.
    pub looks: f64,
    /// Range cells of the gate; none where it is not declared.
    pub cells: Option<f64>,
    /// How much they count: 1, or less beside a sample of the chirps on the target.
    pub weight: f64,
}

/// No chirps.
pub(super) static NONE: Alarms = Alarms {
    powers_w: Vec::new(),
    near_target: 0.0,
    silent: 0,
    looks: 1.0,
    cells: None,
    weight: 1.0,
};

impl Alarms {
    /// The same beside one of `every` chirps on the target.
    pub(super) fn beside_sample(&self, every: usize) -> Alarms {
        Alarms { weight: self.weight / every as f64, ..self.clone() }
    }

    /// ln likelihood under a receiver.
    pub(super) fn ln_p(&self, receiver: &Receiver, limits: ReceiverLimits) -> f64 {
        if self.silent == 0 && self.powers_w.is_empty() {
            return 0.0;
        }
        let cell = self.cell(receiver, limits);
        let cells = self.cells(&cell, limits.threshold_w);
        if cells <= 0.0 {
            return 0.0;
        }
        let mut sum = cells * self.silent as f64 * cell.ln_below(limits.threshold_w);
        for power_w in &self.powers_w {
            let density = cell.ln_density(*power_w) + cells.ln();
            let p = (density + (cells - 1.0) * cell.ln_below(*power_w)).exp();
            sum += ((1.0 - OUTLIERS) * p + OUTLIERS * OUTLIER_DENSITY).ln();
        }
        self.weight * sum
    }

    /// How many of some detections near the target are more than chance has.
    pub(super) fn beyond_chance(&self, near_target: usize) -> usize {
        let expected = self.near_target + 3.0 * self.near_target.sqrt();
        near_target.saturating_sub(expected.round() as usize)
    }

    /// Change of the data of these chirps by another level of noise, dB; none where they hardly tell it.
    pub(super) fn size_db(&self, [before, after]: [&Receiver; 2], limits: ReceiverLimits) -> f64 {
        if before.noise_w <= 0.0 || after.noise_w <= 0.0 {
            return 0.0;
        }
        let [ln_before, ln_after] = [before, after].map(|receiver| self.ln_p(receiver, limits));
        if ln_after - ln_before < TOLD {
            0.0
        } else {
            DB * (after.noise_w / before.noise_w).ln().abs()
        }
    }

    fn cell(&self, receiver: &Receiver, limits: ReceiverLimits) -> Cell {
        let ln_noise = receiver.noise_w.max(LEAST_NOISE * limits.threshold_w).ln();
        Cell { law: GammaLaw::new(self.looks), ln_noise }
    }

    /// The number of cells that count: the likeliest, or those of a declared gate less its part near the target, where false
    /// alarms count as strays.
    fn cells(&self, cell: &Cell, threshold_w: f64) -> f64 {
        let count = self.powers_w.len() as f64;
        if let Some(cells) = self.cells {
            return if count > 0.0 { cells * count / (count + self.near_target) } else { cells };
        }
        let ln_silent = self.silent as f64 * cell.ln_below(threshold_w);
        let ln_all: f64 = ln_silent + self.powers_w.iter().map(|y| cell.ln_below(*y)).sum::<f64>();
        (count / -ln_all.min(-f64::MIN_POSITIVE)).min(MOST_CELLS)
    }

    /// √n times the largest difference between the distribution of the powers and that of false alarms of a
    /// receiver: beyond 2.3 once in 50 000 times by chance (Kolmogorov and Smirnov); 0 for few.
    fn off_their_law(&self, receiver: &Receiver, limits: ReceiverLimits) -> f64 {
        const FEW: usize = 20;
        if self.powers_w.len() < FEW {
            return 0.0;
        }
        let threshold_w = limits.threshold_w;
        let cell = self.cell(receiver, limits);
        let cells = self.cells(&cell, threshold_w);
        let mut sorted = self.powers_w.clone();
        sorted.sort_by(f64::total_cmp);
        // Probabilities of a higher power, which keep their digits in the tail.
        let above = |power_w: f64| -(cells * cell.ln_below(power_w)).exp_m1();
        let [all, beyond] = [threshold_w, MOST_OVER_THRESHOLD * threshold_w].map(above);
        let count = sorted.len() as f64;
        let mut largest = 0.0f64;
        for (number, power_w) in sorted.iter().enumerate() {
            let expected = ((all - above(*power_w)) / (all - beyond)).clamp(0.0, 1.0);
            let [low, high] = [number, number + 1].map(|number| number as f64 / count);
            let off = (expected - low).abs().max((high - expected).abs());
            // A noise so low that none is expected explains none.
            largest = largest.max(if off.is_finite() { off } else { 1.0 });
        }
        count.sqrt() * largest
    }

    /// How far the noise of the likeliest level is from that of a receiver, dB, and what that gains in ln p, or how
    /// unlikely their powers are; `None` where the receiver's is likely enough.
    pub(super) fn unlike(&self, receiver: &Receiver, limits: ReceiverLimits) -> Option<[f64; 2]> {
        let at = |db: i32| {
            let noise_w = receiver.noise_w * 10f64.powf(f64::from(db) / 10.0);
            Receiver { noise_w, ..*receiver }
        };
        let ln_p = |db: i32| self.ln_p(&at(db), limits);
        let best = LEVELS_DB.max_by(|a, b| ln_p(*a).total_cmp(&ln_p(*b))).unwrap_or(0);
        let gain = ln_p(best) - ln_p(0);
        // No level makes the powers of something else those of noise.
        let off = self.off_their_law(&at(best), limits);
        if off > OFF_THEIR_LAW {
            let share = self.powers_w.len() as f64 / (self.powers_w.len() + self.silent) as f64;
            return Some([OUTLYING_DB * share.sqrt(), 2.0 * off * off]);
        }
        (gain > UNLIKE).then_some([f64::from(best.abs()), gain])
    }
}

/// The noise in one range cell.
struct Cell {
    law: GammaLaw,
    ln_noise: f64,
}

impl Cell {
    /// ln G.
    fn ln_below(&self, power_w: f64) -> f64 {
        self.law.below(power_w.ln(), self.ln_noise).value
    }

    /// ln g, per unit of ln power.
    fn ln_density(&self, power_w: f64) -> f64 {
        self.law.detected(power_w.ln(), self.ln_noise).value
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::random::{Key, Purpose};

    const LIMITS: ReceiverLimits = ReceiverLimits { threshold_w: 1e-9, range_sd_m: 0.0 };

    fn receiver(noise_w: f64) -> Receiver {
        Receiver { looks: 4.0, noise_w, ..Receiver::LINEAR }
    }

    /// Chirps that report the strongest of 40 cells.
    fn drawn(noise_w: f64, seed: u64) -> Alarms {
        let mut alarms = Alarms { weight: 1.0, looks: 4.0, ..Alarms::default() };
        for chirp in 0..4000 {
            let mut draws = Key { seed, chirp, sub_ray: 0, purpose: Purpose::Fit }.draws();
            let cells = (0..40).map(|_| noise_w * draws.gamma(4.0));
            let strongest_w = cells.fold(0.0, f64::max);
            if strongest_w >= LIMITS.threshold_w {
                alarms.powers_w.push(strongest_w);
            } else {
                alarms.silent += 1;
            }
        }
        alarms
    }

    #[test]
    fn false_alarms_tell_the_noise() {
        for (noise_w, seed) in [(3.2e-10, 1), (3.6e-10, 2), (4e-10, 3)] {
            let alarms = drawn(noise_w, seed);
            assert!(alarms.powers_w.len() > 100, "{}", alarms.powers_w.len());
            let ln_p = |db: i32| {
                let noise_w = noise_w * 10f64.powf(f64::from(db) / 20.0);
                alarms.ln_p(&receiver(noise_w), LIMITS)
            };
            let best = (-8..=8).max_by(|a, b| ln_p(*a).total_cmp(&ln_p(*b))).unwrap();
            assert!(best.abs() <= 1, "{noise_w}: {best} half dB");
            assert_eq!(alarms.unlike(&receiver(noise_w), LIMITS), None);
            let [off_db, _] = alarms.unlike(&receiver(0.5 * noise_w), LIMITS).unwrap();
            assert!((2.0..=4.0).contains(&off_db), "{off_db}");
        }
    }

    /// Echoes of something of any strength, as of clutter that the scene does not have.
    #[test]
    fn what_noise_did_not_make_is_no_false_alarm() {
        let mut alarms = Alarms { silent: 4000, weight: 1.0, looks: 4.0, ..Alarms::default() };
        alarms.powers_w = (0..300).map(|k| 1e-9 * 4f64.powf(f64::from(k) / 300.0)).collect();
        for noise_w in [0.0, 1e-11, 3e-10] {
            assert!(alarms.unlike(&receiver(noise_w), LIMITS).is_some(), "{noise_w}");
        }
    }

    #[test]
    fn silence_of_a_declared_gate_bounds_the_noise() {
        let unknown = Alarms { silent: 4000, weight: 1.0, looks: 4.0, ..Alarms::default() };
        assert_eq!(unknown.ln_p(&receiver(4e-10), LIMITS), 0.0);
        let silent = Alarms { cells: Some(1.0), ..unknown };
        let [low, high] = [1e-11, 4e-10].map(|noise_w| silent.ln_p(&receiver(noise_w), LIMITS));
        assert!(low > -1.0 && high < -30.0, "{low} {high}");
        assert_eq!(NONE.ln_p(&receiver(1e-10), LIMITS), 0.0);
    }
}
