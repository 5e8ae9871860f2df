//! Chirps that see no target: their silence, and what noise alone made them report.
//!
//! Noise N with L looks is below y in one cell of the gate with the probability G(y), of density g(y) in ln y. In all n cells it
//! is below the threshold T with G(T)ⁿ, the probability of silence. What else is reported has these densities:
//!
//! | `returns` | density of a false alarm y |
//! |---|---|
//! | `strongest` | n·g(y)·G(y)ⁿ⁻¹ |
//! | `first` | (1 − G(T)ⁿ)·g(y)/(1 − G(T)): every cell above T is as likely to be the first |
//! | `all` | n·g(y)/G(T), beside G(T)ⁿ of every chirp: the cells above T are independent |
//!
//! A false alarm near the target is not told from an echo beside its edge. A chirp that misses and has one there is left out, and
//! what the others report is divided by the probability G(T)ⁿ + a·(1 − G(T)ⁿ) of having none, a the share of the gate away from
//! the target.
//!
//! Where no gate is declared, n is the most likely one, so that only the powers of false alarms
//! tell N: a cloud without any may have been cleaned, and its silence is no evidence.

use serde::Serialize;

use super::observation::{DB, ReceiverLimits};
use crate::effects::{Receiver, Shot};
use crate::fit::gamma_law::GammaLaw;
use crate::radar::Returns;

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
    /// Length of the gate near the target, m, on average of the chirps that miss it: false alarms there are among the strays.
    pub near_m: f64,
    /// Number of false alarms of chirps that meet the target, where only the first detection is reported: an echo ends
    /// the search, so that they do not tell the noise.
    pub of_target: usize,
    /// Chirps that miss the target and report one, and its range, m.
    pub of_misses: Vec<(Shot, f64)>,
    /// Number of chirps that miss the target and stay silent.
    pub silent_misses: usize,
    /// Powers of echoes that noise stayed below, W, where a chirp reports its strongest detection: a false alarm that is
    /// stronger would stand in place of the echo.
    pub stronger_w: Vec<f64>,
    /// Number of chirps that stay silent; of all chirps where all detections are reported.
    pub silent: usize,
    /// Which detections of a chirp are reported.
    pub returns: Returns,
    /// Looks of the noise.
    pub looks: f64,
    /// Range cells of the gate; none where it is not declared.
    pub cells: Option<f64>,
    /// Length of a range cell, m.
    pub cell_m: f64,
    /// How much they count: 1, or less beside a sample of the chirps on the target.
    pub weight: f64,
}

/// Detections that count as false alarms, of chirps without an echo.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct FalseAlarms {
    /// How many there are. Where a chirp reports its first detection, those of chirps that meet the target are not among
    /// them.
    pub counted: usize,
    /// How many the declared noise makes on average; none without a declared gate.
    pub expected: Option<f64>,
}

impl FalseAlarms {
    /// Those of two clouds.
    pub(super) fn and(self, other: FalseAlarms) -> FalseAlarms {
        let expected = self.expected.zip(other.expected).map(|(a, b)| a + b);
        FalseAlarms { counted: self.counted + other.counted, expected }
    }
}

impl Alarms {
    /// The same beside one of `every` chirps on the target.
    pub(super) fn beside_sample(&self, every: usize) -> Alarms {
        Alarms { weight: self.weight / every as f64, ..self.clone() }
    }

    /// ln likelihood under a receiver.
    pub(super) fn ln_p(&self, receiver: &Receiver, limits: ReceiverLimits) -> f64 {
        if self.silent == 0 && self.powers_w.is_empty() && self.stronger_w.is_empty() {
            return 0.0;
        }
        let cell = self.cell(receiver, limits);
        let Gate { cells, away } = self.gate(&cell, limits.threshold_w);
        if cells <= 0.0 {
            return 0.0;
        }
        let ln_silent = cell.ln_below(limits.threshold_w);
        let mut sum = cells * (self.silent as f64 * ln_silent + away * self.ln_stronger(&cell));
        let misses = (self.silent_misses + self.of_misses.len()) as f64;
        sum -= misses * kept(away, cells * ln_silent).ln();
        for power_w in &self.powers_w {
            let beside_density = match self.returns {
                Returns::Strongest => (away * cells).ln() + (cells - 1.0) * cell.ln_below(*power_w),
                Returns::First => ln_complement(cells * ln_silent) - ln_complement(ln_silent),
                Returns::All => cells.ln() - ln_silent,
            };
            let p = (cell.ln_density(*power_w) + beside_density).exp();
            sum += ((1.0 - OUTLIERS) * p + OUTLIERS * OUTLIER_DENSITY).ln();
        }
        self.weight * sum
    }

    /// ln of the probability that one cell stays below all echoes.
    fn ln_stronger(&self, cell: &Cell) -> f64 {
        self.stronger_w.iter().map(|echo_w| cell.ln_below(*echo_w)).sum()
    }

    /// How many there are, and how many noise of a receiver makes in the declared gate.
    pub(super) fn counted(&self, receiver: &Receiver, limits: ReceiverLimits) -> FalseAlarms {
        let counted = self.powers_w.len();
        let cell = self.cell(receiver, limits);
        let ln_silent = cell.ln_below(limits.threshold_w);
        let Gate { cells, away } = self.gate(&cell, limits.threshold_w);
        let expected = match self.returns {
            Returns::All => -cells * self.silent as f64 * ln_silent.exp_m1(),
            _ => {
                let over = self.stronger_w.iter().map(|y| (cells * cell.ln_below(*y)).exp_m1());
                let silent = (self.silent + counted) as f64 / kept(away, cells * ln_silent);
                -away * (silent * (cells * ln_silent).exp_m1() + over.sum::<f64>())
            }
        };
        FalseAlarms { counted, expected: self.cells.map(|_| expected.max(0.0)) }
    }

    /// Number of false alarms, also of those that tell no noise.
    pub(super) fn count(&self) -> usize {
        self.powers_w.len() + self.of_target
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

    /// The gate: as declared, or of the likeliest number of cells, none of them near the target.
    fn gate(&self, cell: &Cell, threshold_w: f64) -> Gate {
        let Some(cells) = self.cells else {
            return Gate { cells: self.likely_cells(cell, threshold_w), away: 1.0 };
        };
        let away = 1.0 - self.gate_m().map_or(0.0, |gate_m| share_near(self.near_m, gate_m));
        match self.returns {
            Returns::Strongest => Gate { cells, away },
            // Each cell for itself.
            Returns::First | Returns::All => Gate { cells: away * cells, away: 1.0 },
        }
    }

    /// Length of the gate, m: as declared, or at least that over which false alarms lie, whose ranges are all alike; none where
    /// neither tells it.
    pub(super) fn gate_m(&self) -> Option<f64> {
        const LEAST: usize = 10;
        let count = self.of_misses.len();
        let ranges_m = self.of_misses.iter().map(|(_, range_m)| *range_m);
        let nearest_m = ranges_m.clone().fold(f64::INFINITY, f64::min);
        let span_m = ranges_m.fold(0.0, f64::max) - nearest_m;
        let by_alarms_m =
            if count < LEAST { 0.0 } else { span_m * (count + 1) as f64 / (count - 1) as f64 };
        let declared_m = self.cells.map_or(0.0, |cells| cells * self.cell_m);
        Some(declared_m.max(by_alarms_m)).filter(|length_m| *length_m > 0.0)
    }

    /// How many false alarms lie near the target by chance, where others do not.
    pub(super) fn near_target(&self) -> f64 {
        self.of_misses.len() as f64 * self.gate_m().map_or(0.0, |gate_m| odds(self.near_m, gate_m))
    }

    /// The likeliest number of cells.
    fn likely_cells(&self, cell: &Cell, threshold_w: f64) -> f64 {
        let count = self.powers_w.len() as f64;
        let ln_below = cell.ln_below(threshold_w).min(-f64::MIN_POSITIVE);
        let silent = self.silent as f64;
        let cells = match self.returns {
            Returns::Strongest => {
                let ln_alarms: f64 = self.powers_w.iter().map(|y| cell.ln_below(*y)).sum();
                let ln_all = silent * ln_below + ln_alarms + self.ln_stronger(cell);
                -count / ln_all.min(-f64::MIN_POSITIVE)
            }
            Returns::First => -(count / silent.max(f64::MIN_POSITIVE)).ln_1p() / ln_below,
            Returns::All => -count / (silent * ln_below).min(-f64::MIN_POSITIVE),
        };
        cells.min(MOST_CELLS)
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
        let Gate { cells, .. } = self.gate(&cell, threshold_w);
        let mut sorted = self.powers_w.clone();
        sorted.sort_by(f64::total_cmp);
        // Of the strongest of all cells, or of one of them.
        let cells = if self.returns == Returns::Strongest { cells } else { 1.0 };
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

/// How many of some detections are more than chance has where it is expected to have so many.
pub(super) fn beyond_chance(count: usize, expected: f64) -> usize {
    count.saturating_sub((expected + 3.0 * expected.sqrt()).round() as usize)
}

/// Largest share of a gate near the target: none tells the noise.
const MOST_NEAR: f64 = 0.999;

/// Share of a gate that lies near the target.
fn share_near(near_m: f64, gate_m: f64) -> f64 {
    (near_m / gate_m).min(MOST_NEAR)
}

/// How many false alarms lie near the target where one lies elsewhere in the gate.
pub(super) fn odds(near_m: f64, gate_m: f64) -> f64 {
    let share = share_near(near_m, gate_m);
    share / (1.0 - share)
}

/// Range cells of a gate, and the share of them away from the target.
struct Gate {
    cells: f64,
    away: f64,
}

/// Probability that a chirp which misses has no false alarm near the target, where no cell reports one with e^ln_silent.
fn kept(away: f64, ln_silent: f64) -> f64 {
    1.0 + (1.0 - away) * ln_silent.exp_m1()
}

/// ln(1 − eˣ), x < 0.
fn ln_complement(x: f64) -> f64 {
    (-x.exp_m1()).max(f64::MIN_POSITIVE).ln()
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
    use crate::radar::{Chirps, Radar};

    const LIMITS: ReceiverLimits = ReceiverLimits { threshold_w: 1e-9, range_sd_m: 0.0 };

    fn receiver(noise_w: f64) -> Receiver {
        Receiver { looks: 4.0, noise_w, ..Receiver::LINEAR }
    }

    const RETURNS: [Returns; 3] = [Returns::Strongest, Returns::First, Returns::All];

    /// Chirps that report some of 40 cells.
    fn drawn(noise_w: f64, seed: u64, returns: Returns) -> Alarms {
        let mut alarms = Alarms { weight: 1.0, looks: 4.0, returns, ..Alarms::default() };
        for chirp in 0..4000 {
            let mut draws = Key { seed, chirp, sub_ray: 0, purpose: Purpose::Fit }.draws();
            let cells = (0..40).map(|_| noise_w * draws.gamma(4.0));
            let mut above: Vec<f64> = cells.filter(|y| *y >= LIMITS.threshold_w).collect();
            alarms.silent += usize::from(above.is_empty() || returns == Returns::All);
            if returns == Returns::Strongest {
                above.sort_by(|a, b| b.total_cmp(a));
            }
            above.truncate(if returns == Returns::All { 40 } else { 1 });
            alarms.powers_w.extend(above);
        }
        alarms
    }

    #[test]
    fn false_alarms_tell_the_noise() {
        let levels = [(3.2e-10, 1), (3.6e-10, 2), (4e-10, 3)];
        for (returns, (noise_w, seed)) in
            RETURNS.iter().flat_map(|returns| levels.map(|level| (*returns, level)))
        {
            let alarms = drawn(noise_w, seed, returns);
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
            // A declared gate predicts their number, to within four standard deviations.
            let gate = Alarms { cells: Some(40.0), ..alarms.clone() };
            let FalseAlarms { counted, expected } = gate.counted(&receiver(noise_w), LIMITS);
            let expected = expected.unwrap();
            let off = (counted as f64 - expected) / expected.sqrt();
            assert!(off.abs() < 4.0, "{returns:?}: {counted} {expected}");
            assert_eq!(alarms.counted(&receiver(noise_w), LIMITS).expected, None);
        }
    }

    /// Chirps that miss the target, of whose false alarms a quarter lies near it and is left out. Many chirps have one.
    #[test]
    fn false_alarms_near_the_target_do_not_count() {
        let noise_w = 4.6e-10;
        let mut alarms = drawn(noise_w, 5, Returns::Strongest);
        assert!(alarms.powers_w.len() > alarms.silent / 2, "{}", alarms.powers_w.len());
        (alarms.cells, alarms.silent_misses) = (Some(40.0), alarms.silent);
        let mut number = 0;
        alarms.powers_w.retain(|_| {
            number += 1;
            number % 4 != 0
        });
        (alarms.cell_m, alarms.near_m) = (0.01, 0.1);
        let chirps = Chirps::draw(&Radar::default(), |_| Err("no file".to_owned())).unwrap();
        let shot = Shot::missed(&chirps, 0, 0.0);
        alarms.of_misses = vec![(shot, 8.0); alarms.powers_w.len()];
        // A declared gate tells the part near the target, however few false alarms there are.
        let few = Alarms { of_misses: vec![(shot, 8.0); 3], ..alarms.clone() };
        assert!((few.near_target() - 1.0).abs() < 1e-9);
        assert_eq!(Alarms { cells: None, ..few }.near_target(), 0.0);
        let ln_p = |step: &i32| {
            let noise_w = noise_w * 10f64.powf(f64::from(*step) / 1000.0);
            alarms.ln_p(&receiver(noise_w), LIMITS)
        };
        let best = (-50..=50).max_by(|a, b| ln_p(a).total_cmp(&ln_p(b))).unwrap();
        assert!(best.abs() <= 6, "{best} hundredths of a dB");
        let FalseAlarms { counted, expected } = alarms.counted(&receiver(noise_w), LIMITS);
        let off = (counted as f64 - expected.unwrap()) / expected.unwrap().sqrt();
        assert!(off.abs() < 3.0, "{counted} {expected:?}");
    }

    /// Chirps on a target whose echoes are about as strong as the noise, of which the stronger is reported.
    #[test]
    fn echoes_tell_that_noise_stayed_below() {
        let (noise_w, echo_w) = (4e-10, 1.2e-9);
        let mut alarms = drawn(noise_w, 9, Returns::Strongest);
        for chirp in 4000..10_000 {
            let mut draws = Key { seed: 9, chirp, sub_ray: 0, purpose: Purpose::Fit }.draws();
            let strongest_w = (0..40).map(|_| noise_w * draws.gamma(4.0)).fold(0.0, f64::max);
            let echo_w = echo_w * draws.gamma(4.0);
            match f64::max(echo_w, strongest_w) {
                most_w if most_w < LIMITS.threshold_w => alarms.silent += 1,
                _ if echo_w >= strongest_w => alarms.stronger_w.push(echo_w),
                _ => alarms.powers_w.push(strongest_w),
            }
        }
        alarms.cells = Some(40.0);
        let off_db = |alarms: &Alarms| {
            let ln_p = |step: &i32| {
                let noise_w = noise_w * 10f64.powf(f64::from(*step) / 1000.0);
                alarms.ln_p(&receiver(noise_w), LIMITS)
            };
            let best = (-100..=100).max_by(|a, b| ln_p(a).total_cmp(&ln_p(b))).unwrap();
            f64::from(best) / 100.0
        };
        // Some 2 000 false alarms tell the noise to 0.02 dB; without the echoes it seems to be higher.
        let alone = Alarms { stronger_w: Vec::new(), ..alarms.clone() };
        let [with_db, without_db] = [&alarms, &alone].map(off_db);
        assert!(with_db.abs() < 0.06 && without_db > with_db + 0.03, "{with_db} {without_db}");
        let FalseAlarms { counted, expected } = alarms.counted(&receiver(noise_w), LIMITS);
        let off = (counted as f64 - expected.unwrap()) / expected.unwrap().sqrt();
        assert!(off.abs() < 4.0, "{counted} {expected:?}");
    }

    /// What a gate reports is less likely under the law of another kind of return.
    #[test]
    fn each_kind_of_return_has_its_own_law() {
        let noise_w = 4e-10;
        for (seed, returns) in (4..).zip(RETURNS) {
            let alarms = Alarms { cells: Some(40.0), ..drawn(noise_w, seed, returns) };
            let own = alarms.ln_p(&receiver(noise_w), LIMITS);
            for other in [Returns::Strongest, Returns::First].into_iter().filter(|o| *o != returns)
            {
                let as_other = Alarms { returns: other, ..alarms.clone() };
                let other_ln_p = as_other.ln_p(&receiver(noise_w), LIMITS);
                assert!(own > other_ln_p + 1.0, "{returns:?} {other:?}: {own} {other_ln_p}");
            }
        }
    }

    #[test]
    fn false_alarms_change_the_data_by_a_level_that_they_tell() {
        let noise_w = 4e-10;
        let alarms = drawn(noise_w, 7, Returns::Strongest);
        let size_db =
            |from_w: f64, to_w: f64| alarms.size_db([&receiver(from_w), &receiver(to_w)], LIMITS);
        assert!((size_db(0.5 * noise_w, noise_w) - 2f64.log10() * 10.0).abs() < 1e-9);
        // From the true level to another one, from none, and where nothing is reported, they tell none.
        assert_eq!(size_db(noise_w, 0.5 * noise_w), 0.0);
        assert_eq!(size_db(0.0, noise_w), 0.0);
        let silent = Alarms { powers_w: Vec::new(), ..alarms.clone() };
        let both = [0.5 * noise_w, noise_w].map(receiver);
        assert_eq!(silent.size_db([&both[0], &both[1]], LIMITS), 0.0);
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
        assert_eq!(Alarms::default().ln_p(&receiver(1e-10), LIMITS), 0.0);
    }
}
