//! Cross-validation: how well a fit predicts rows that it has not seen. Neighbouring chirps illuminate nearly the same
//! place, so that whole blocks of them are held out, one fold after another, and the standard error of the score is that
//! of blocks.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::DVector;

use super::goodness::residuals_db;
use super::likelihood::Likelihood;
use super::result::FitResult;
use super::settings::Method;
use crate::material::{Aspect, CrossValidation, Observation};
use crate::measure::curve::Curve;
use crate::radar::random::{Key, Purpose};

/// Parts that are held out one after another.
const FOLDS: usize = 5;
/// Blocks along the longer side of what was scanned, and how many must hold something.
const ACROSS: f64 = 8.0;
const LEAST_SQUARES: usize = 2 * FOLDS;
/// Blocks of consecutive chirps where the places on the target are not known.
const RUNS: usize = 20;

impl FitResult {
    /// Fits the curve again without each fifth of its blocks, and evaluates every fit on that fifth. Blocks
    /// are squares on the target where the rows have places; runs of consecutive chirps of a scan;
    /// single rows of a sweep of the angle, of which a run would be a whole range of angles; and the rows of each pair of
    /// directions where source and receiver were in two.
    ///
    /// `None` where there are fewer blocks than parts, where a part leaves too few detections for the fit,
    /// or where a fit does not converge.
    pub fn hold_out(&self, curve: &Curve) -> Option<CrossValidation> {
        let Blocks { of, block_of_row, block_m } = Blocks::new(&curve.observations);
        let blocks = block_of_row.iter().max().map_or(0, |most| most + 1);
        if blocks < FOLDS {
            return None;
        }
        let mut sizes = vec![0; blocks];
        block_of_row.iter().for_each(|&block| sizes[block] += 1);
        let fold_of_block = deal(&sizes, FOLDS, self.fit.seed);
        let (mut scores, mut squares_db) = (vec![0.0; blocks], Vec::new());
        for fold in 0..FOLDS {
            let (mut kept, mut unseen, mut block_of_unseen) = (Vec::new(), Vec::new(), Vec::new());
            for (row, &block) in curve.observations.iter().zip(&block_of_row) {
                if fold_of_block[block] == fold {
                    unseen.push(*row);
                    block_of_unseen.push(block);
                } else {
                    kept.push(*row);
                }
            }
            let at = self.fitted_to(kept)?;
            for (block, ln_p) in block_of_unseen.into_iter().zip(self.ln_p(&at, &unseen)) {
                scores[block] += ln_p;
            }
            let residuals_db = residuals_db(&self.fit, &self.coordinates, &at, &unseen);
            squares_db.extend(residuals_db.into_iter().map(|residual| residual.powi(2)));
        }
        let [score, score_sd] = mean(&scores, &sizes);
        let has_law = self.fit.method == Method::Censored;
        Some(CrossValidation {
            folds: FOLDS as u32,
            blocks: u32::try_from(blocks).unwrap_or(u32::MAX),
            blocks_of: of.to_owned(),
            block_m,
            score: has_law.then_some(score),
            score_sd: has_law.then_some(score_sd),
            rms_db: (squares_db.iter().sum::<f64>() / squares_db.len().max(1) as f64).sqrt(),
            fold_hash: fold_hash(block_of_row.iter().map(|&block| fold_of_block[block])),
        })
    }

    /// The optimum for these rows alone, searched from the optimum for all rows.
    fn fitted_to(&self, rows: Vec<Observation>) -> Option<DVector<f64>> {
        let detected = rows.iter().filter(|row| !row.is_censored()).count();
        let best = (detected > self.coordinates.len())
            .then(|| self.fit.nearest_optimum(&self.coordinates, &rows, &self.at))?;
        best.converged().then_some(best.at)
    }

    /// ln p of each row; nothing for least squares.
    fn ln_p(&self, at: &DVector<f64>, rows: &[Observation]) -> Vec<f64> {
        match self.fit.method {
            Method::Censored => Likelihood::new(&self.coordinates, rows, self.noise_w).ln_p(at),
            Method::Mse { .. } | Method::Tls { .. } => Vec::new(),
        }
    }
}

/// Which rows are neighbours.
struct Blocks {
    /// What they are: `squares`, `runs` or `points`.
    of: &'static str,
    /// Block of every row, numbered from 0 without gaps.
    block_of_row: Vec<usize>,
    /// Side of squares, m.
    block_m: Option<f64>,
}

impl Blocks {
    fn new(rows: &[Observation]) -> Blocks {
        if rows.iter().any(|row| !row.is_retro()) {
            return Blocks::aspects(rows);
        }
        let places: Option<Vec<[f64; 2]>> = rows.iter().map(|row| row.target_m).collect();
        places.and_then(|places| Blocks::squares(&places)).unwrap_or_else(|| Blocks::in_time(rows))
    }

    fn squares(places: &[[f64; 2]]) -> Option<Blocks> {
        let side_m = extent_m(places) / ACROSS;
        let squares: Vec<[i64; 2]> =
            places.iter().map(|at| at.map(|x| (x / side_m).floor() as i64)).collect();
        let different: BTreeSet<[i64; 2]> = squares.iter().copied().collect();
        let numbers: BTreeMap<[i64; 2], usize> = different.into_iter().zip(0..).collect();
        let block_of_row = squares.iter().map(|square| numbers[square]).collect();
        (side_m > 0.0 && numbers.len() >= LEAST_SQUARES).then_some(Blocks {
            of: "squares",
            block_of_row,
            block_m: Some(side_m),
        })
    }

    /// One for each pair of directions.
    fn aspects(rows: &[Observation]) -> Blocks {
        let mut different: Vec<Aspect> = rows.iter().map(Observation::aspect).collect();
        different.sort_by(Aspect::in_order);
        different.dedup_by(|a, b| a.in_order(b).is_eq());
        let mut block_of_row = Vec::with_capacity(rows.len());
        for row in rows {
            let own = row.aspect();
            block_of_row.push(different.partition_point(|other| other.in_order(&own).is_lt()));
        }
        Blocks { of: "points", block_of_row, block_m: None }
    }

    fn in_time(rows: &[Observation]) -> Blocks {
        let mut in_time: Vec<usize> = (0..rows.len()).collect();
        in_time.sort_by_key(|&row| rows[row].chirp.map_or(row, |chirp| chirp as usize));
        let angles_rad: Vec<f64> = in_time.iter().map(|&row| rows[row].theta_i_rad).collect();
        let is_sweep = angles_rad.is_sorted() || angles_rad.iter().rev().is_sorted();
        let blocks = if is_sweep { rows.len() } else { RUNS.min(rows.len()) };
        let mut block_of_row = vec![0; rows.len()];
        for (place, &row) in in_time.iter().enumerate() {
            block_of_row[row] = place * blocks / rows.len();
        }
        Blocks { of: if is_sweep { "points" } else { "runs" }, block_of_row, block_m: None }
    }
}

/// The longer side of what places cover, m.
fn extent_m(places: &[[f64; 2]]) -> f64 {
    let (mut min, mut max) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for at in places {
        for axis in 0..2 {
            min[axis] = min[axis].min(at[axis]);
            max[axis] = max[axis].max(at[axis]);
        }
    }
    (max[0] - min[0]).max(max[1] - min[1])
}

/// Deals blocks of these sizes to folds, in an order drawn from the seed, each to the emptiest: the fold
/// of every block.
pub(crate) fn deal(sizes: &[usize], folds: usize, seed: u64) -> Vec<usize> {
    let mut order = Vec::with_capacity(sizes.len());
    for block in 0..sizes.len() {
        let key = Key { seed, chirp: block as u64, sub_ray: 1, purpose: Purpose::Fit };
        order.push((key.draws().uniform(), block));
    }
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut filled, mut fold_of_block) = (vec![0; folds], vec![0; sizes.len()]);
    for (_, block) in order {
        let (emptiest, _) = filled.iter().enumerate().min_by_key(|f| *f.1).unwrap_or((0, &0));
        fold_of_block[block] = emptiest;
        filled[emptiest] += sizes[block];
    }
    fold_of_block
}

/// Mean of rows from the sums over their blocks, and its standard error over blocks.
fn mean(sums: &[f64], sizes: &[usize]) -> [f64; 2] {
    let rows: usize = sizes.iter().sum();
    let (rows, blocks) = (rows.max(1) as f64, sums.len().max(2) as f64);
    let mean = sums.iter().sum::<f64>() / rows;
    let off = std::iter::zip(sums, sizes).map(|(sum, &size)| (sum - mean * size as f64).powi(2));
    [mean, (blocks / (blocks - 1.0) * off.sum::<f64>()).sqrt() / rows]
}

fn fold_hash(fold_of_row: impl Iterator<Item = usize>) -> String {
    let mut hasher = blake3::Hasher::new();
    fold_of_row.for_each(|fold| {
        hasher.update(&(fold as u64).to_le_bytes());
    });
    hasher.finalize().to_hex().to_string()
}

#[cfg(test)]
mod tests {
    use super::super::models::model;
    use super::super::settings::Fit;
    use super::super::twin::{Twin, mixture};
    use super::*;

    fn placed(mut curve: Curve) -> Curve {
        for (index, row) in curve.observations.iter_mut().enumerate() {
            row.target_m = Some([(index % 40) as f64 * 0.01, (index / 40) as f64 * 0.01]);
        }
        curve
    }

    #[test]
    fn a_right_law_scores_as_well_on_what_it_has_not_seen() {
        let curve = placed(Twin { rows: 1600, ..Twin::default() }.curve(5));
        let fit = Fit { starts: 1, looks: Some(1.0), ..Fit::default() };
        let found = fit.run(&mixture(0.1, 3.0, 0.02, 0.004), &curve).unwrap();
        let held = found.hold_out(&curve).unwrap();
        assert_eq!((held.folds, held.blocks, held.block_m), (5, 81, Some(0.39 / 8.0)));
        let (seen, score) = (found.objective / 1600.0, held.score.unwrap());
        // One part in 1600 for each of four numbers, twice over.
        assert!(score < seen && seen - score < 0.02, "{seen} {held:?}");
        assert!((held.rms_db / found.goodness.rms_db - 1.0).abs() < 0.02, "{held:?}");
        let sd = held.score_sd.unwrap();
        assert!((0.01..0.1).contains(&sd), "{sd}");
        assert_eq!(found.hold_out(&curve), Some(held));
    }

    #[test]
    fn without_places_whole_runs_of_chirps_are_held_out() {
        let curve = Twin { rows: 24, ..Twin::default() }.curve(7);
        let fit = Fit { starts: 1, looks: Some(1.0), ..Fit::default() };
        let found = fit.run(&model("lambert").unwrap(), &curve).unwrap();
        let held = found.hold_out(&curve).unwrap();
        assert_eq!((held.blocks, held.blocks_of.as_str(), held.block_m), (20, "runs", None));
        assert!(held.score.unwrap() < found.objective / 24.0, "{held:?} {found:?}");
    }

    #[test]
    fn of_a_sweep_single_points_are_held_out_and_no_range_of_angles() {
        let mut curve = Twin { rows: 400, ..Twin::default() }.curve(7);
        curve.observations.sort_by(|a, b| a.theta_i_rad.total_cmp(&b.theta_i_rad));
        for (chirp, row) in (0u32..).zip(&mut curve.observations) {
            row.chirp = Some(chirp);
        }
        let fit = Fit { starts: 1, looks: Some(1.0), ..Fit::default() };
        let found = fit.run(&mixture(0.1, 3.0, 0.02, 0.004), &curve).unwrap();
        let held = found.hold_out(&curve).unwrap();
        assert_eq!((held.blocks, held.blocks_of.as_str()), (400, "points"));
        assert!((held.rms_db / found.goodness.rms_db - 1.0).abs() < 0.03, "{held:?}");
    }

    #[test]
    fn a_few_places_are_no_squares_and_fewer_blocks_than_parts_no_score() {
        let mut curve = Twin { rows: 100, ..Twin::default() }.curve(7);
        for (index, row) in curve.observations.iter_mut().enumerate() {
            row.target_m = Some([(index % 2) as f64, 0.0]);
        }
        let fit = Fit { starts: 1, looks: Some(1.0), ..Fit::default() };
        let found = fit.run(&model("lambert").unwrap(), &curve).unwrap();
        assert_eq!(found.hold_out(&curve).unwrap().blocks_of, "runs");
        curve.observations.truncate(4);
        assert_eq!(found.hold_out(&curve), None);
    }

    #[test]
    fn least_squares_has_an_error_in_decibels_and_no_score() {
        let curve = Twin { rows: 300, ..Twin::default() }.curve(3);
        let method = Method::Tls { theta_sd_rad: 0.05, level_sd_db: 5.6 };
        let fit = Fit { method, starts: 1, ..Fit::default() };
        let held = fit.run(&model("mixture").unwrap(), &curve).unwrap().hold_out(&curve).unwrap();
        assert_eq!((held.score, held.score_sd), (None, None));
        assert!((4.0..8.0).contains(&held.rms_db), "{held:?}");
    }

    #[test]
    fn blocks_go_to_the_emptiest_fold() {
        let sizes = [7, 1, 1, 1, 1, 1, 1, 1];
        let folds = deal(&sizes, 2, 3);
        let filled = |fold: usize| -> usize {
            std::iter::zip(sizes, &folds).filter(|(_, f)| **f == fold).map(|(size, _)| size).sum()
        };
        assert_eq!((filled(0) + filled(1), filled(0).abs_diff(filled(1)) <= 6), (14, true));
        assert_eq!(deal(&sizes, 2, 3), folds);
    }
}
