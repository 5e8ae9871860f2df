//! What a model leaves: randomised quantile residuals and directed tests of them.
//!
//! A detected look has u = F(y), a censored one u uniform below F(T), and z = Φ⁻¹(u) is standard normal
//! if the model is right (Dunn & Smyth 1996, DOI 10.1080/10618600.1996.10474708). The mean of z and of
//! z² − 1 is binned over each covariate; Q = Σ n·(mean)² is compared with its law under random
//! signs of whole patches, which keeps whatever neighbouring looks share. A patch whose looks
//! all lean to one side cannot be told so: maps are therefore of cells larger than a patch. A bin's
//! strength must reach a declared size, too: with thousands of looks everything is significant.

use serde::Serialize;
use statrs::function::erf::erfc_inv;
use statrs::function::gamma::digamma;

use super::folds::Folds;
use super::likelihood::{Declared, Likelihood};
use super::looks::Observation;
use super::score::DB;
use crate::effects::{Look, Prediction};
use crate::radar::random::{Key, Purpose};

/// Bins of a covariate, with as many looks each.
const BINS: usize = 12;
/// Side of a cell of the map, in patches.
const MAP_CELL: f64 = 2.0;

/// Structure that a model leaves.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Unexplained {
    /// What it goes with; `spread over …` where the scatter and not the level does.
    pub covariate: String,
    /// Root mean square over the looks of what goes with it, beyond chance, dB.
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

/// z of every look.
pub(super) fn z(
    prediction: &Prediction,
    declared: Declared,
    observations: &[Observation],
    seed: u64,
) -> Vec<f64> {
    let likelihood = Likelihood::new(prediction, declared);
    let one = |(look, seen): (usize, &Observation)| {
        let level_w = seen.power_w.unwrap_or(declared.threshold_w);
        let key = Key { seed, chirp: look as u64, sub_ray: 3, purpose: Purpose::Fit };
        let part = if seen.power_w.is_some() { 1.0 } else { key.draws().uniform() };
        let u = part * likelihood.below(look, level_w);
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
        looks: &[Look],
        prediction: &Prediction,
        folds: &Folds,
    ) -> Vec<Unexplained> {
        let squares: Vec<f64> = z.iter().map(|z| z * z - 1.0).collect();
        let bins = self.bins(looks, prediction);
        let limit = self.family_error / (2.0 * bins.len() as f64).max(1.0);
        let sd_db = speckle_sd_db(prediction.receiver.looks);
        let mut found = Vec::new();
        for (number, (name, bin)) in bins.iter().enumerate() {
            // A spread s times the declared one has z² of mean s²: half of the excess is that of s.
            let kinds = [(name.clone(), z, 1.0), (format!("spread over {name}"), &squares, 0.5)];
            for (kind, (covariate, values, scale)) in kinds.into_iter().enumerate() {
                let (excess, p_value) = self.test(values, bin, folds, (2 * number + kind) as u64);
                let strength_db = scale * sd_db * excess;
                if p_value <= limit && strength_db >= self.least_size_db {
                    found.push(Unexplained { covariate, strength_db, p_value });
                }
            }
        }
        found.sort_by(|a, b| b.strength_db.total_cmp(&a.strength_db));
        found
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

    /// Bin of every look by every covariate that varies.
    fn bins(&self, looks: &[Look], prediction: &Prediction) -> Vec<(String, Vec<usize>)> {
        let centre = |pick: fn(&Look) -> f64| {
            let ends = looks
                .iter()
                .map(pick)
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)]);
            0.5 * (ends[0] + ends[1])
        };
        let (x0, y0) = (centre(|look| look.xt_m), centre(|look| look.yt_m));
        let of_look = |name: &str, pick: &dyn Fn(&Look) -> f64| {
            (name.to_owned(), quantile_bins(&looks.iter().map(pick).collect::<Vec<_>>()))
        };
        let powers: Vec<f64> =
            prediction.arrived.iter().map(|a| a.map_or(0.0, |a| a.power_w)).collect();
        let mut bins = vec![
            of_look("theta", &|look| look.hit.theta_rad()),
            of_look("azimuth", &|look| look.azimuth_rad),
            of_look("range", &|look| look.hit.range_m),
            of_look("x_t", &|look| look.xt_m),
            of_look("y_t", &|look| look.yt_m),
            of_look("distance from centre", &|look| (look.xt_m - x0).hypot(look.yt_m - y0)),
            of_look("distance from edge", &|look| look.edge_m),
            of_look("progress", &|look| look.progress),
            ("predicted power".to_owned(), quantile_bins(&powers)),
            ("region".to_owned(), looks.iter().map(|look| usize::from(look.region)).collect()),
            ("map".to_owned(), self.map(looks)),
        ];
        bins.retain(|(_, bin)| bin.iter().any(|b| Some(b) != bin.first()));
        bins
    }

    fn map(&self, looks: &[Look]) -> Vec<usize> {
        let side_m = MAP_CELL * self.block_m;
        let cell = |look: &Look| [look.xt_m, look.yt_m].map(|x| (x / side_m).floor() as i64);
        let mut cells: Vec<[i64; 2]> = looks.iter().map(cell).collect();
        let of_look = cells.clone();
        cells.sort_unstable();
        cells.dedup();
        of_look.iter().map(|cell| cells.binary_search(cell).unwrap_or(0)).collect()
    }
}

/// Bins of equal numbers of looks; equal values share a bin.
fn quantile_bins(values: &[f64]) -> Vec<usize> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let edges: Vec<f64> =
        (1..BINS).filter_map(|k| sorted.get(k * sorted.len() / BINS)).copied().collect();
    values.iter().map(|value| edges.iter().filter(|edge| *edge <= value).count()).collect()
}
