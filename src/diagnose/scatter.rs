//! Tests of the scatter about the means: as a whole, over each covariate, and over the target plane.
//!
//! The mean of z² − 1 is tested as a whole and, less that, in bins of each covariate. Q = Σ n·(mean)² is
//! compared with its distribution under random signs of whole patches, which keeps any correlation of neighbouring
//! shots. This cannot detect a patch whose shots all lean to one side, and maps have cells larger than a patch for that
//! reason. Every strength must also reach a declared size: with thousands of shots everything is significant.

use super::covariates::{Covariate, quantiles};
use super::folds::{Folds, square};
use super::residual::{ResidualStructure, scatter_db};
use crate::effects::{Prediction, Shot};
use crate::radar::random::{Key, Purpose};

/// Bins of a covariate, with equal numbers of shots.
const BINS: usize = 12;
/// The scatter as a covariate of its own, and the beginning of the name of the scatter over others.
const SPREAD: &str = "spread";
/// Side of a cell of the map, in patches.
const MAP_CELL: f64 = 2.0;

/// Settings of the tests.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tests {
    pub seed: u64,
    pub draws: usize,
    pub block_m: f64,
    /// Probability that any test of a complete model is significant.
    pub family_error: f64,
    pub least_size_db: f64,
}

/// The shots in bins of one covariate.
struct Bins {
    /// None for one bin of all shots.
    over: Option<&'static str>,
    bin: Vec<usize>,
}

impl Tests {
    /// Every test that exceeds chance and the least size.
    pub fn run(
        &self,
        z: &[f64],
        shots: &[Shot],
        prediction: &Prediction,
        covariates: &[Covariate],
        folds: &Folds,
    ) -> Vec<ResidualStructure> {
        // A spread s times the declared one has z² of mean s²: half of the excess is that of s.
        let whole: Vec<f64> = z.iter().map(|z| z * z - 1.0).collect();
        let mean = whole.iter().sum::<f64>() / whole.len().max(1) as f64;
        // An excess of all shots is not reported again for every covariate.
        let centred: Vec<f64> = whole.iter().map(|square| square - mean).collect();
        let bins = self.bins(shots, covariates);
        let limit = self.family_error / (bins.len() as f64).max(1.0);
        let sd_db = scatter_db(prediction);
        let mut found = Vec::new();
        for (number, Bins { over, bin }) in (0..).zip(&bins) {
            let (squares, covariate) = match over {
                None => (&whole, SPREAD.to_owned()),
                Some(name) => (&centred, format!("{SPREAD} over {name}")),
            };
            let (excess, p_value) = self.test(squares, bin, folds, number);
            let strength_db = 0.5 * sd_db * excess;
            if p_value <= limit && strength_db >= self.least_size_db {
                found.push(ResidualStructure { covariate, strength_db, p_value });
            }
        }
        found
    }

    /// Root mean square of the bins' means beyond chance, and its probability by chance.
    fn test(&self, values: &[f64], bin: &[usize], folds: &Folds, number: u64) -> (f64, f64) {
        // Sums of every patch over its shots in every bin.
        let bins = bin.iter().max().map_or(0, |most| most + 1);
        let mut sums = vec![vec![0.0; bins]; folds.blocks];
        let mut counts = vec![0.0; bins];
        for ((value, &bin), &block) in values.iter().zip(bin).zip(&folds.block) {
            sums[block][bin] += value;
            counts[bin] += 1.0;
        }
        // Q as observed, and with a random sign of every patch.
        let seen = q(&sums, &counts, &vec![1.0; folds.blocks]);
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
            let drawn = q(&sums, &counts, &signs);
            by_chance += drawn / self.draws as f64;
            above += usize::from(drawn >= seen);
        }
        let excess = ((seen - by_chance) / values.len().max(1) as f64).max(0.0).sqrt();
        (excess, (above + 1) as f64 / (self.draws + 1) as f64)
    }

    /// Bins of every covariate, of the target plane, and one of all shots.
    fn bins(&self, shots: &[Shot], covariates: &[Covariate]) -> Vec<Bins> {
        let mut bins = Vec::new();
        for covariate in covariates {
            bins.push(Bins { over: Some(covariate.name), bin: quantile_bins(&covariate.values) });
        }
        bins.push(Bins { over: Some("map"), bin: self.map(shots) });
        bins.push(Bins { over: None, bin: vec![0; shots.len()] });
        bins
    }

    /// Cells of the target plane.
    fn map(&self, shots: &[Shot]) -> Vec<usize> {
        let side_m = MAP_CELL * self.block_m;
        let cell_of_shot: Vec<[i64; 2]> = shots.iter().map(|shot| square(shot, side_m)).collect();
        let mut cells = cell_of_shot.clone();
        cells.sort_unstable();
        cells.dedup();
        cell_of_shot.iter().map(|cell| cells.binary_search(cell).unwrap_or(0)).collect()
    }
}

/// Σ n·(mean)² over bins, from the sums of every patch, each with a sign, and the numbers n of shots.
fn q(sums: &[Vec<f64>], counts: &[f64], signs: &[f64]) -> f64 {
    let mut total = vec![0.0; counts.len()];
    for (sums, sign) in sums.iter().zip(signs) {
        total.iter_mut().zip(sums).for_each(|(total, sum)| *total += sign * sum);
    }
    let bins = total.iter().zip(counts);
    bins.map(|(total, count)| total * total / f64::max(*count, 1.0)).sum()
}

/// Bins of equal numbers of shots; equal values share a bin.
fn quantile_bins(values: &[f64]) -> Vec<usize> {
    let ends = quantiles(values, BINS);
    let inner = ends.get(1..ends.len().saturating_sub(1)).unwrap_or_default();
    values.iter().map(|value| inner.partition_point(|end| end <= value)).collect()
}
