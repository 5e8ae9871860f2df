//! The chirps that are held out together: patches of the target plane, never single chirps.
//!
//! Neighbouring spots overlap, so that a chirp between two others of the fit does not test it.

use std::collections::BTreeMap;

use crate::effects::Shot;
use crate::fit::held_out::deal;

/// Cells on a side of a patch, over which standard errors are taken.
const CELLS: f64 = 3.0;
/// The same where neighbours share speckle.
const CELLS_OF_SHARED: f64 = 2.0;

/// A scan in patches, and the patches in folds.
#[derive(Clone, Debug, PartialEq)]
pub struct Folds {
    /// Patch of every shot.
    pub block: Vec<usize>,
    /// Fold of every shot.
    pub fold: Vec<usize>,
    /// Number of patches.
    pub blocks: usize,
    /// Number of folds.
    pub folds: usize,
    /// Cell of every shot, narrower than a patch.
    cell: Vec<usize>,
    /// Number of cells.
    cells: usize,
}

impl Folds {
    /// Square patches of side `block_m`, m, dealt out to `folds` folds of about equal numbers of shots.
    pub fn new(shots: &[Shot], block_m: f64, folds: usize, seed: u64) -> Folds {
        Folds::with_cells(shots, block_m, folds, seed, CELLS)
    }

    /// As [`new`](Self::new), for shots that share speckle, whose standard errors need wider cells.
    pub(super) fn of_shared(shots: &[Shot], block_m: f64, folds: usize, seed: u64) -> Folds {
        Folds::with_cells(shots, block_m, folds, seed, CELLS_OF_SHARED)
    }

    fn with_cells(
        shots: &[Shot],
        block_m: f64,
        folds: usize,
        seed: u64,
        cells_per_side: f64,
    ) -> Folds {
        let folds = folds.max(2);
        let side_m = block_m.max(1e-6);
        let mut members: BTreeMap<[i64; 2], Vec<usize>> = BTreeMap::new();
        for (index, shot) in shots.iter().enumerate() {
            members.entry(square(shot, side_m)).or_default().push(index);
        }
        let members: Vec<Vec<usize>> = members.into_values().collect();
        let sizes: Vec<usize> = members.iter().map(Vec::len).collect();
        let fold_of_block = deal(&sizes, folds, seed);
        let (mut block, mut fold) = (vec![0; shots.len()], vec![0; shots.len()]);
        for (number, (indices, fold_of_block)) in members.iter().zip(fold_of_block).enumerate() {
            for &index in indices {
                (block[index], fold[index]) = (number, fold_of_block);
            }
        }
        // The cells of the standard errors, numbered as they first occur.
        let mut numbers = BTreeMap::new();
        let mut cell = Vec::with_capacity(shots.len());
        for shot in shots {
            let next = numbers.len();
            cell.push(*numbers.entry(square(shot, side_m / cells_per_side)).or_insert(next));
        }
        Folds { block, fold, blocks: members.len(), folds, cell, cells: numbers.len() }
    }

    /// Whether a fold holds a shot out.
    pub(super) fn holds_out(&self, fold: usize, shot: usize) -> bool {
        self.fold.get(shot) == Some(&fold)
    }

    /// The patches of some of the shots.
    pub(super) fn part(&self, shots: std::ops::Range<usize>) -> Folds {
        let [block, fold, cell] =
            [&self.block, &self.fold, &self.cell].map(|of| of[shots.clone()].to_vec());
        Folds { block, fold, cell, ..*self }
    }

    /// Sum of one number per shot, and its standard error over cells. The cells are smaller
    /// than the patches of the folds: a local effect would lie in one patch and have no standard error.
    pub fn sum(&self, values: &[f64]) -> [f64; 2] {
        sum_by_cell(values, &self.cell, self.cells)
    }

    /// The same over whole patches: products of residuals that share speckle are alike beyond a cell.
    pub(super) fn sum_over_patches(&self, values: &[f64]) -> [f64; 2] {
        sum_by_cell(values, &self.block, self.blocks)
    }

    /// Sum of one number per shot over each cell.
    pub(super) fn cell_sums(&self, values: &[f64]) -> Vec<f64> {
        sums_by_cell(values, &self.cell, self.cells)
    }
}

/// Sum of the values, and its standard error over cells; `cell` is the cell of each value, below `cells`.
pub(super) fn sum_by_cell(values: &[f64], cell: &[usize], cells: usize) -> [f64; 2] {
    let sums = sums_by_cell(values, cell, cells);
    let count = sums.len().max(2) as f64;
    let total: f64 = sums.iter().sum();
    let variance = sums.iter().map(|s| (s - total / count).powi(2)).sum::<f64>() / (count - 1.0);
    [total, (count * variance).sqrt()]
}

fn sums_by_cell(values: &[f64], cell: &[usize], cells: usize) -> Vec<f64> {
    let mut sums = vec![0.0; cells];
    for (value, &cell) in values.iter().zip(cell) {
        sums[cell] += value;
    }
    sums
}

/// The square of a grid over the target plane in which a shot lies.
pub(super) fn square(shot: &Shot, side_m: f64) -> [i64; 2] {
    [shot.yt_m, shot.xt_m].map(|x| (x / side_m).floor() as i64)
}
