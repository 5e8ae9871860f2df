//! What a model leaves: randomised quantile residuals, and tests of their scatter, of what neighbours
//! have in common, and of outliers.
//!
//! A detected shot has u = F(y), a censored one u uniform below F(T), and z = Φ⁻¹(u) is standard normal
//! if the model is right (Dunn & Smyth 1996, DOI 10.1080/10618600.1996.10474708). The mean of z² − 1 is
//! looked at as a whole and, less that, binned over each covariate; Q = Σ n·(mean)² is compared with its law under random signs of whole
//! patches, which keeps whatever neighbouring shots share. A patch whose shots all lean to one side
//! cannot be told so: maps are therefore of cells larger than a patch. Every strength must reach a
//! declared size, too: with thousands of shots everything is significant. The means themselves are
//! looked at by `field.rs`.

use std::collections::HashMap;

use rayon::prelude::*;
use serde::Serialize;
use statrs::function::erf::{erfc, erfc_inv};
use statrs::function::gamma::digamma;

use super::covariates::{Covariate, quantiles};
use super::field::Structure;
use super::folds::Folds;
use super::likelihood::{Declared, Likelihood};
use super::score::DB;
use super::shots::Observation;
use crate::effects::{MeanEcho, Prediction, Shot};
use crate::radar::random::{Key, Purpose};

/// Bins of a covariate, with as many shots each.
const BINS: usize = 12;
/// Standard deviations beyond which a shot is an outlier, the share of them that is no news, and the
/// size that one of them stands for, dB.
const OUTLYING: f64 = 4.5;
const OUTLIERS: f64 = 1e-3;
const OUTLYING_DB: f64 = 10.0;
/// Third moment of z from which its law is called lopsided, how far out it is looked at, and how rare it
/// must be by chance. A Gamma law of 8 looks taken for a log-normal one, or the other way, has 0.3.
const LOPSIDED: f64 = 0.2;
const LOPSIDED_REACH: f64 = 3.5;
const LOPSIDED_BY_CHANCE: f64 = 1e-6;
/// The scatter as a covariate of its own, and the beginning of the scatter over others.
const SPREAD: &str = "spread";
/// Side of a cell of the map, in patches.
const MAP_CELL: f64 = 2.0;

/// Structure that a model leaves.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Unexplained {
    /// What it goes with; `spread` where the scatter is another one everywhere, `spread over …` where it, and not
    /// the level, goes with something.
    pub covariate: String,
    /// Root mean square over the shots of what goes with it, beyond chance, dB.
    pub strength_db: f64,
    /// Probability of so much by chance, not corrected for the number of tests.
    pub p_value: f64,
}

/// Settings of the tests.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tests {
    pub seed: u64,
    pub draws: usize,
    pub block_m: f64,
    /// Chance that any test of a complete model is called significant.
    pub family_error: f64,
    pub least_size_db: f64,
}

/// z of every shot.
pub(super) fn z(
    prediction: &Prediction,
    declared: Declared,
    observations: &[Observation],
    seed: u64,
) -> Vec<f64> {
    let likelihood = Likelihood::new(prediction, declared);
    let one = |(shot, seen): (usize, &Observation)| {
        let level_w = seen.power_w.unwrap_or(declared.threshold_w);
        let key = Key { seed, chirp: shot as u64, sub_ray: 3, purpose: Purpose::Fit };
        let part = if seen.power_w.is_some() { 1.0 } else { key.draws().uniform() };
        let u = part * likelihood.below(shot, level_w);
        -std::f64::consts::SQRT_2 * erfc_inv(2.0 * u.clamp(1e-9, 1.0 - 1e-9))
    };
    observations.iter().enumerate().map(one).collect()
}

/// Standard deviation of ln y of L looks in dB: 10/ln 10·√ψ′(L).
pub(super) fn speckle_sd_db(looks: f64) -> f64 {
    let h = 1e-4 * looks;
    DB * ((digamma(looks + h) - digamma(looks - h)) / (2.0 * h)).max(0.0).sqrt()
}

impl Tests {
    /// Every test that finds more than chance and more than the least size, strongest first.
    pub fn run(
        &self,
        z: &[f64],
        shots: &[Shot],
        prediction: &Prediction,
        covariates: &[Covariate],
        folds: &Folds,
    ) -> Vec<Unexplained> {
        // A spread s times the declared one has z² of mean s²: half of the excess is that of s.
        let whole: Vec<f64> = z.iter().map(|z| z * z - 1.0).collect();
        let mean = whole.iter().sum::<f64>() / whole.len().max(1) as f64;
        // What all shots have alike is not said of every covariate again.
        let centred: Vec<f64> = whole.iter().map(|square| square - mean).collect();
        let bins = self.bins(shots, covariates);
        let limit = self.family_error / (bins.len() as f64).max(1.0);
        let sd_db = speckle_sd_db(prediction.receiver.looks);
        let found = bins.iter().zip(0..).filter_map(|((name, bin), number)| {
            let (squares, covariate) = match name {
                None => (&whole, SPREAD.to_owned()),
                Some(name) => (&centred, format!("{SPREAD} over {name}")),
            };
            let (excess, p_value) = self.test(squares, bin, folds, number);
            let strength_db = 0.5 * sd_db * excess;
            let counts = p_value <= limit && strength_db >= self.least_size_db;
            counts.then_some(Unexplained { covariate, strength_db, p_value })
        });
        found.collect()
    }

    /// Root mean square of the bins' means beyond chance, and the probability of so much by chance.
    fn test(&self, values: &[f64], bin: &[usize], folds: &Folds, number: u64) -> (f64, f64) {
        let bins = bin.iter().max().map_or(0, |most| most + 1);
        let mut sums = vec![vec![0.0; bins]; folds.blocks];
        let mut counts = vec![0.0; bins];
        for ((value, &bin), &block) in values.iter().zip(bin).zip(&folds.block) {
            sums[block][bin] += value;
            counts[bin] += 1.0;
        }
        let q = |signs: &dyn Fn(usize) -> f64| {
            let mut total = vec![0.0; bins];
            for (block, sums) in sums.iter().enumerate() {
                let sign = signs(block);
                total.iter_mut().zip(sums).for_each(|(total, sum)| *total += sign * sum);
            }
            let share = |(total, count): (&f64, &f64)| total * total / f64::max(*count, 1.0);
            total.iter().zip(&counts).map(share).sum::<f64>()
        };
        let seen = q(&|_| 1.0);
        let (mut above, mut by_chance) = (0usize, 0.0);
        for draw in 0..self.draws {
            let key = Key {
                seed: self.seed,
                chirp: draw as u64,
                sub_ray: 16 + number,
                purpose: Purpose::Fit,
            };
            let mut draws = key.draws();
            let signs: Vec<f64> =
                (0..folds.blocks).map(|_| if draws.uniform() < 0.5 { -1.0 } else { 1.0 }).collect();
            let drawn = q(&|block| signs[block]);
            by_chance += drawn / self.draws as f64;
            above += usize::from(drawn >= seen);
        }
        let excess = ((seen - by_chance) / values.len().max(1) as f64).max(0.0).sqrt();
        (excess, (above + 1) as f64 / (self.draws + 1) as f64)
    }

    /// Bin of every shot by every covariate, and one for all.
    fn bins(
        &self,
        shots: &[Shot],
        covariates: &[Covariate],
    ) -> Vec<(Option<&'static str>, Vec<usize>)> {
        let of = |c: &Covariate| (Some(c.name), quantile_bins(&c.values));
        let mut bins: Vec<_> = covariates.iter().map(of).collect();
        bins.push((Some("map"), self.map(shots)));
        bins.push((None, vec![0; shots.len()]));
        bins
    }

    fn map(&self, shots: &[Shot]) -> Vec<usize> {
        let side_m = MAP_CELL * self.block_m;
        let cell = |shot: &Shot| [shot.xt_m, shot.yt_m].map(|x| (x / side_m).floor() as i64);
        let mut cells: Vec<[i64; 2]> = shots.iter().map(cell).collect();
        let of_shot = cells.clone();
        cells.sort_unstable();
        cells.dedup();
        of_shot.iter().map(|cell| cells.binary_search(cell).unwrap_or(0)).collect()
    }
}

/// Bins of equal numbers of shots; equal values share a bin.
fn quantile_bins(values: &[f64]) -> Vec<usize> {
    let ends = quantiles(values, BINS);
    let inner = ends.get(1..ends.len().saturating_sub(1)).unwrap_or_default();
    values.iter().map(|value| inner.partition_point(|end| end <= value)).collect()
}

/// What neighbouring shots have in common, though their noise is their own: the root mean square of a
/// structure that no field needs to resolve, dB, and how often chance makes as much.
///
/// Neighbours are one to two spots apart, beyond the reach of a speckle that two spots share.
pub(super) fn of_neighbours(
    z: &[f64],
    shots: &[Shot],
    spot_m: f64,
    sd_db: f64,
    folds: &Folds,
) -> Unexplained {
    let cell = |shot: &Shot| [shot.xt_m, shot.yt_m].map(|x| (x / (2.0 * spot_m)).floor() as i64);
    let mut members: HashMap<[i64; 2], Vec<usize>> = HashMap::new();
    for (index, shot) in shots.iter().enumerate() {
        members.entry(cell(shot)).or_default().push(index);
    }
    let shared = |(shot, z_here): (&Shot, &f64)| {
        let [i, j] = cell(shot);
        let near = (-1..=1).flat_map(|di| (-1..=1).map(move |dj| [i + di, j + dj]));
        let near = near.filter_map(|at| members.get(&at)).flatten();
        let apart_m = |other: &Shot| (other.xt_m - shot.xt_m).hypot(other.yt_m - shot.yt_m);
        let zs = near.filter_map(|&index| {
            let other = shots.get(index)?;
            let counts = (spot_m..2.0 * spot_m).contains(&apart_m(other));
            z.get(index).filter(|_| counts)
        });
        let (sum, count) = zs.fold((0.0, 0.0), |(s, n), z| (s + z, n + 1.0));
        if count > 0.0 { z_here * sum / count } else { 0.0 }
    };
    let products: Vec<f64> = shots.par_iter().zip(z).map(shared).collect();
    let [sum, se] = folds.sum(&products);
    let covariance = sum / shots.len().max(1) as f64;
    let strength_db = sd_db * covariance.max(0.0).sqrt();
    let p_value = 0.5 * erfc(sum / se.max(f64::MIN_POSITIVE) / std::f64::consts::SQRT_2);
    Unexplained { covariate: "neighbourhood".to_owned(), strength_db, p_value }
}

/// How many shots lie beyond [`OUTLYING`] standard deviations in power.
pub(super) fn wild(z: &[f64]) -> usize {
    z.iter().filter(|z| z.abs() > OUTLYING).count()
}

/// Shots that no spread explains: beyond [`OUTLYING`] standard deviations in power or in range, or with
/// a detection far off the target.
pub(super) fn outliers(
    z: &[f64],
    prediction: &Prediction,
    declared: Declared,
    observations: &[Observation],
    false_alarms: usize,
) -> Option<Unexplained> {
    let count = z.len().max(1) as f64;
    let wild = wild(z);
    let off = |(seen, arrived): (&Observation, &Option<MeanEcho>)| {
        let arrived = arrived.as_ref()?;
        let sd_m = declared.range_sd_m.hypot(arrived.spread_m);
        (declared.range_off_m(arrived, seen)?.abs() > OUTLYING * sd_m).then_some(())
    };
    let strays = observations.iter().zip(&prediction.arrived).filter_map(off).count();
    // Strays are not among the shots.
    let found = [
        (wild, count, "outlying powers"),
        (strays, count, "outlying ranges"),
        (false_alarms, count + false_alarms as f64, "stray detections"),
    ];
    let (number, of, covariate) = found.into_iter().max_by_key(|(number, ..)| *number)?;
    let share = number as f64 / of;
    // A thousandth of all chirps may be anything.
    let expected = OUTLIERS * count;
    let p_value = (0.5 * erfc((number as f64 - expected) / (2.0 * expected).sqrt())).max(1e-300);
    let strength_db = OUTLYING_DB * share.sqrt();
    (share > 3.0 * OUTLIERS && number >= 10).then(|| Unexplained {
        covariate: covariate.to_owned(),
        strength_db,
        p_value,
    })
}

/// Scatter of another form than the declared law's, such as a speckle that is not Gamma: z is lopsided,
/// though no mean and no spread is wrong. Its third moment is 0 under the model, with the standard
/// deviation √(6/n); the displacement that it means is (z² − 1)/6 of it (Cornish and Fisher).
pub(super) fn lopsided(z: &[f64], sd_db: f64) -> Option<Unexplained> {
    // A few shots far out are told as outliers.
    let inner: Vec<f64> = z.iter().map(|z| z.clamp(-LOPSIDED_REACH, LOPSIDED_REACH)).collect();
    let count = inner.len().max(1) as f64;
    let mean = inner.iter().sum::<f64>() / count;
    let third = inner.iter().map(|z| (z - mean).powi(3)).sum::<f64>() / count;
    let chance = erfc(third.abs() / (6.0 / count).sqrt() / std::f64::consts::SQRT_2);
    (third.abs() > LOPSIDED && chance < LOPSIDED_BY_CHANCE).then(|| Unexplained {
        covariate: "form of the scatter".to_owned(),
        strength_db: sd_db * std::f64::consts::SQRT_2 * third.abs() / 6.0,
        p_value: chance,
    })
}

/// Powers in coarse steps, as of a converter with too few bits: their step, dB.
pub(super) fn steps(observations: &[Observation]) -> Option<Unexplained> {
    let powers = observations.iter().filter_map(|seen| seen.power_w);
    let mut powers: Vec<f64> = powers.map(|power_w| DB * power_w.ln()).collect();
    powers.sort_by(f64::total_cmp);
    let span_db = powers.last()? - powers.first()?;
    let count = powers.len();
    powers.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
    let step_db = span_db / powers.len().max(2) as f64;
    // A uniform error of a step has the standard deviation step/√12.
    let strength_db = step_db / 12f64.sqrt();
    (powers.len() * 10 < count && strength_db >= 0.1).then(|| Unexplained {
        covariate: "steps of the power".to_owned(),
        strength_db,
        p_value: 0.0,
    })
}

/// Structure of the means that a field has found: what goes with each covariate, the larger parts.
pub(super) fn of_field(structure: &Structure) -> Vec<Unexplained> {
    let [gain, se] = structure.gain;
    let p_value = 0.5 * erfc(gain / se / std::f64::consts::SQRT_2);
    let most_db = structure.parts_db.first().map_or(0.0, |part| part.1);
    let large = structure.parts_db.iter().filter(|part| part.1 >= 0.5 * most_db).take(3);
    let share = structure.size_db / most_db.max(f64::MIN_POSITIVE);
    large
        .map(|(name, part_db)| Unexplained {
            covariate: (*name).to_owned(),
            strength_db: share * part_db,
            p_value,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_law_of_another_form_is_told_and_a_normal_one_is_not() {
        let z = |shot: u64| {
            let key = Key { seed: 4, chirp: shot, sub_ray: 9, purpose: Purpose::Fit };
            key.draws().gaussian()
        };
        let normal: Vec<f64> = (0..10_000).map(z).collect();
        assert_eq!(lopsided(&normal, 2.0), None);
        // About as lopsided as ln y of a Gamma law of 8 looks: the third moment is six times 0.06.
        let bent: Vec<f64> = normal.iter().map(|z| z - 0.06 * (z * z - 1.0)).collect();
        let found = lopsided(&bent, 2.0).unwrap();
        assert!((found.strength_db - 2.0 * 2f64.sqrt() * 0.06).abs() < 0.03, "{found:?}");
    }
}
