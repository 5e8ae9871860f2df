//! Randomised quantile residuals of a model, and tests of them that need no covariate: the correlation of
//! neighbours, outliers, the shape of the distribution, the steps of the powers.
//!
//! A detected shot has u = F(y), a censored one u uniform below F(T), and z = Φ⁻¹(u) is standard normal
//! under a correct model (Dunn & Smyth 1996, DOI 10.1080/10618600.1996.10474708). The scatter is tested in
//! `scatter.rs`, the means in `field.rs`.

use std::collections::HashMap;
use std::f64::consts::SQRT_2;

use rayon::prelude::*;
use serde::Serialize;
use statrs::function::erf::{erfc, erfc_inv};
use statrs::function::gamma::digamma;

use super::evidence::Candidate;
use super::field::Structure;
use super::folds::square;
use super::likelihood::Likelihood;
use super::observation::{Observation, ReceiverLimits};
use super::score::DB;
use super::shared::{ALONE, SharedSpeckle};
use crate::effects::{MeanEcho, Prediction, Shot};
use crate::radar::random::{Key, Purpose};

/// Standard deviations beyond which a shot is an outlier.
const OUTLYING: f64 = 4.5;
/// Share of outliers that is normal.
const OUTLIERS: f64 = 1e-3;
/// Size that an outlier stands for, dB.
const OUTLYING_DB: f64 = 10.0;
/// Third moment of z from which its distribution counts as skewed. A Gamma distribution of 8 looks taken for a
/// log-normal one, or the reverse, has 0.3.
const SKEWED: f64 = 0.2;
/// Largest |z| in that moment.
const SKEWED_REACH: f64 = 3.5;
/// Probability by chance below which skewness is reported.
const SKEWED_BY_CHANCE: f64 = 1e-6;
/// Least error by steps of the power that is reported, dB.
const LEAST_STEPS_DB: f64 = 0.1;

/// Beginning of the name of what may be an effect.
pub const MAY_BE: &str = "may be ";

/// Structure that a model does not explain.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ResidualStructure {
    /// The covariate it depends on; [`MAY_BE`] and an effect that a stronger one may hide; `spread` where the scatter differs everywhere, `spread over …` where the scatter,
    /// and not the level, depends on a covariate.
    pub covariate: String,
    /// Root mean square over the shots beyond chance, dB.
    pub strength_db: f64,
    /// Probability by chance, not corrected for the number of tests.
    pub p_value: f64,
}

/// z of every shot.
pub(super) fn z(
    prediction: &Prediction,
    declared: ReceiverLimits,
    observations: &[Observation],
    seed: u64,
) -> Vec<f64> {
    let likelihood = Likelihood::new(prediction, declared, &ALONE);
    let mut all = Vec::with_capacity(observations.len());
    for (shot, seen) in observations.iter().enumerate() {
        let level_w = seen.level_w(declared);
        let key = Key { seed, chirp: shot as u64, sub_ray: 3, purpose: Purpose::Fit };
        let part = if seen.power_w.is_some() { 1.0 } else { key.draws().uniform() };
        let u = part * likelihood.below(shot, level_w);
        all.push(-SQRT_2 * erfc_inv(2.0 * u.clamp(1e-9, 1.0 - 1e-9)));
    }
    all
}

/// Scatter by speckle of the powers of a prediction's shots as they leave the receiver, root mean square, dB.
pub(super) fn scatter_db(prediction: &Prediction) -> f64 {
    let Prediction { arrived, receiver, saturating, .. } = prediction;
    let alike_db = speckle_sd_db(receiver.looks);
    let is_alike = |echo: &MeanEcho| echo.coherent_share <= 0.0;
    if saturating.is_linear() && arrived.iter().flatten().all(is_alike) {
        return alike_db;
    }
    let of_shot = |(shot, echo): (usize, &Option<MeanEcho>)| {
        let Some(echo) = echo else { return alike_db };
        let ln_mean = (echo.power_w + receiver.noise_w).ln();
        let [_, slope] = saturating.output(ln_mean, 0.0);
        let looks = prediction.looks(shot, echo.power_w);
        slope * if is_alike(echo) { alike_db } else { speckle_sd_db(looks) }
    };
    let squares = arrived.iter().enumerate().map(|shot| of_shot(shot).powi(2));
    (squares.sum::<f64>() / arrived.len().max(1) as f64).sqrt()
}

/// Standard deviation of ln y of L looks in dB: 10/ln 10·√ψ′(L).
fn speckle_sd_db(looks: f64) -> f64 {
    let h = 1e-4 * looks;
    DB * ((digamma(looks + h) - digamma(looks - h)) / (2.0 * h)).max(0.0).sqrt()
}

/// The residual that neighbouring shots share, though their noise is independent: the root mean square of a
/// structure too fine for any field, dB, and its probability by chance.
///
/// Neighbours are up to six spots farther apart than `from_m`, up to which they may share speckle. In the first spot what they share
/// is positive. Farther on it may be negative: waves a few spots long share nothing over their whole length, and speckle shares
/// nothing in any part of it. `sum_of`: sum of one number per shot with its standard error.
pub(super) fn of_neighbours(
    z: &[f64],
    shots: &[Shot],
    [from_m, spot_m]: [f64; 2],
    sd_db: f64,
    sum_of: impl Fn(&[f64]) -> [f64; 2],
) -> ResidualStructure {
    let farthest_m = from_m + RINGS as f64 * spot_m;
    let mut members: HashMap<[i64; 2], Vec<usize>> = HashMap::new();
    for (index, shot) in shots.iter().enumerate() {
        members.entry(square(shot, farthest_m)).or_default().push(index);
    }
    let neighbours = Neighbours { z, shots, members, from_m, spot_m };
    let products: Vec<[f64; RINGS]> =
        (0..shots.len()).into_par_iter().map(|index| neighbours.products(index)).collect();
    let mut found =
        ResidualStructure { covariate: "neighbourhood".to_owned(), strength_db: 0.0, p_value: 1.0 };
    for ring in 0..RINGS {
        let of_ring: Vec<f64> = products.iter().map(|rings| rings[ring]).collect();
        let [sum, se] = sum_of(&of_ring);
        let [sum, sides] = if ring == 0 { [sum, 1.0] } else { [sum.abs(), 2.0] };
        let chance = 0.5 * sides * erfc(sum / se.max(f64::MIN_POSITIVE) / SQRT_2);
        let p_value = (RINGS as f64 * chance).min(1.0);
        if p_value < found.p_value {
            let covariance = sum.max(0.0) / shots.len().max(1) as f64;
            found.p_value = p_value;
            found.strength_db = sd_db * covariance.sqrt();
        }
    }
    found
}

/// Rings, each a spot wide, in which neighbours are compared.
const RINGS: usize = 6;

/// Residuals of shots in squares as wide as the farthest ring.
struct Neighbours<'a> {
    z: &'a [f64],
    shots: &'a [Shot],
    members: HashMap<[i64; 2], Vec<usize>>,
    from_m: f64,
    spot_m: f64,
}

impl Neighbours<'_> {
    /// Residual of a shot times the mean residual in each ring about it. A pair counts once, so that products are
    /// independent where residuals are, and twice as much.
    fn products(&self, index: usize) -> [f64; RINGS] {
        let shot = &self.shots[index];
        let [i, j] = square(shot, self.from_m + RINGS as f64 * self.spot_m);
        let (mut sums, mut counts) = ([0.0; RINGS], [0.0; RINGS]);
        for (di, dj) in (-1..=1).flat_map(|di| (-1..=1).map(move |dj| (di, dj))) {
            for &other in self.members.get(&[i + di, j + dj]).into_iter().flatten() {
                let Shot { xt_m, yt_m, scan, sheets, .. } = self.shots[other];
                let beyond_m = (xt_m - shot.xt_m).hypot(yt_m - shot.yt_m) - self.from_m;
                let ring = (beyond_m / self.spot_m).floor();
                let is_alike = (scan, sheets) == (shot.scan, shot.sheets);
                if is_alike && ring >= 0.0 && ring < RINGS as f64 {
                    let ring = ring as usize;
                    counts[ring] += 1.0;
                    if other > index {
                        sums[ring] += self.z[other];
                    }
                }
            }
        }
        std::array::from_fn(|ring| 2.0 * self.z[index] * sums[ring] / f64::max(counts[ring], 1.0))
    }
}

/// Number of shots beyond [`OUTLYING`] standard deviations in power.
pub(super) fn outlying_powers(z: &[f64]) -> usize {
    z.iter().filter(|z| z.abs() > OUTLYING).count()
}

/// Number of ranges beyond [`OUTLYING`] standard deviations.
fn outlying_ranges(
    prediction: &Prediction,
    declared: ReceiverLimits,
    observations: &[Observation],
) -> usize {
    let mut count = 0;
    for (seen, arrived) in observations.iter().zip(&prediction.arrived) {
        let Some(arrived) = arrived else { continue };
        let sd_m = declared.range_sd_m.hypot(arrived.spread_m);
        let off_m = declared.range_off_m(arrived, seen);
        count += usize::from(off_m.is_some_and(|off_m| off_m.abs() > OUTLYING * sd_m));
    }
    count
}

/// The most frequent kind of outlier, if there are more than chance has: in power, in range, or a detection far off
/// the target or beside an edge of it.
pub(super) fn outliers(
    z: &[f64],
    prediction: &Prediction,
    declared: ReceiverLimits,
    observations: &[Observation],
    [off_target, past_the_spot]: [usize; 2],
) -> Option<ResidualStructure> {
    let count = z.len().max(1) as f64;
    // Stray detections are not among the shots.
    let kinds = [
        (outlying_powers(z), count, "outlying powers"),
        (outlying_ranges(prediction, declared, observations), count, "outlying ranges"),
        (off_target, count + off_target as f64, "stray detections"),
        (past_the_spot, count + past_the_spot as f64, "detections beside an edge"),
    ];
    let (number, of, covariate) = kinds.into_iter().max_by_key(|(number, ..)| *number)?;
    let share = number as f64 / of;
    let expected = OUTLIERS * count;
    let p_value = (0.5 * erfc((number as f64 - expected) / (2.0 * expected).sqrt())).max(1e-300);
    let strength_db = OUTLYING_DB * share.sqrt();
    (share > 3.0 * OUTLIERS && number >= 10).then(|| ResidualStructure {
        covariate: covariate.to_owned(),
        strength_db,
        p_value,
    })
}

/// Name of the test of the shape of the scatter.
pub(super) const FORM_OF_SCATTER: &str = "form of the scatter";

/// Scatter of another shape than declared, such as a speckle that is not Gamma: z is skewed
/// although mean and spread are right. Its third moment is 0 under the model, with the standard
/// deviation √(6/n), n the number of independent shots with its scatter; the corresponding displacement is (z² − 1)/6 of it (Cornish and Fisher).
pub(super) fn skewness(z: &[f64], shared: &SharedSpeckle, sd_db: f64) -> Option<ResidualStructure> {
    // Single shots far out count as outliers.
    let inner: Vec<f64> = z.iter().map(|z| z.clamp(-SKEWED_REACH, SKEWED_REACH)).collect();
    let count = inner.len().max(1) as f64;
    let mean = inner.iter().sum::<f64>() / count;
    let third = inner.iter().map(|z| (z - mean).powi(3)).sum::<f64>() / count;
    let chance = erfc(third.abs() / (6.0 / shared.count_of_cubes(z.len())).sqrt() / SQRT_2);
    (third.abs() > SKEWED && chance < SKEWED_BY_CHANCE).then(|| ResidualStructure {
        covariate: FORM_OF_SCATTER.to_owned(),
        strength_db: sd_db * SQRT_2 * third.abs() / 6.0,
        p_value: chance,
    })
}

/// Powers in coarse steps, as from a converter with few bits.
pub(super) fn steps(observations: &[Observation]) -> Option<ResidualStructure> {
    let powers = observations.iter().filter_map(|seen| seen.power_w);
    let mut powers: Vec<f64> = powers.map(|power_w| DB * power_w.ln()).collect();
    powers.sort_by(f64::total_cmp);
    let span_db = powers.last()? - powers.first()?;
    let count = powers.len();
    powers.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
    let step_db = span_db / powers.len().max(2) as f64;
    // A uniform error of a step has the standard deviation step/√12.
    let strength_db = step_db / 12f64.sqrt();
    (powers.len() * 10 < count && strength_db >= LEAST_STEPS_DB).then(|| ResidualStructure {
        covariate: "steps of the power".to_owned(),
        strength_db,
        p_value: 0.0,
    })
}

/// An effect that may be real beside a stronger one.
pub(super) fn may_be(effect: &Candidate) -> ResidualStructure {
    let Candidate { name, size_db: strength_db, held_out, .. } = *effect;
    let p_value = held_out.map_or(1.0, |[gain, se]| 0.5 * erfc(gain / se / SQRT_2));
    ResidualStructure { covariate: format!("{MAY_BE}{name}"), strength_db, p_value }
}

/// Structure of the means that a field has found: the covariates with the largest parts.
pub(super) fn of_field(structure: &Structure) -> Vec<ResidualStructure> {
    let [gain, se] = structure.gain;
    let p_value = 0.5 * erfc(gain / se / SQRT_2);
    let most_db = structure.parts_db.first().map_or(0.0, |part| part.1);
    let large = structure.parts_db.iter().filter(|part| part.1 >= 0.5 * most_db).take(3);
    let share = structure.size_db / most_db.max(f64::MIN_POSITIVE);
    large
        .map(|(name, part_db)| ResidualStructure {
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
    fn a_skewed_distribution_is_reported_and_a_normal_one_is_not() {
        let mut normal = Vec::new();
        for shot in 0..10_000 {
            let key = Key { seed: 4, chirp: shot, sub_ray: 9, purpose: Purpose::Fit };
            normal.push(key.draws().gaussian());
        }
        assert_eq!(skewness(&normal, &ALONE, 2.0), None);
        // About as skewed as ln y of a Gamma distribution of 8 looks: the third moment is six times 0.06.
        let bent: Vec<f64> = normal.iter().map(|z| z - 0.06 * (z * z - 1.0)).collect();
        let found = skewness(&bent, &ALONE, 2.0).unwrap();
        assert!((found.strength_db - 2.0 * 2f64.sqrt() * 0.06).abs() < 0.03, "{found:?}");
    }
}
