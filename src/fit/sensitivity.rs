//! How ln σ⁰ answers to each coordinate.

use nalgebra::DVector;
use rayon::prelude::*;

use super::coordinates::{Coordinates, LOOKS};
use super::table::Table;

/// Step in the search: its square is the relative error of a central difference.
const STEP: f64 = 1e-4;

/// d ln σ⁰/du at every knot, for each coordinate; none for the looks, which do not move σ⁰.
pub(super) fn derivatives(coordinates: &Coordinates, at: &DVector<f64>) -> Vec<Option<Table>> {
    let (lower, upper) = (coordinates.lower(), coordinates.upper());
    let derivative = |index: usize| {
        let moved = |step: f64| {
            let mut there = at.clone();
            there[index] = (at[index] + step).max(lower[index]).min(upper[index]);
            (there[index], Table::new(&coordinates.model(&there)))
        };
        let ((high, above), (low, below)) = (moved(STEP), moved(-STEP));
        above.difference(&below, high - low)
    };
    let is_looks = |index: usize| coordinates.list.get(index).is_some_and(|c| c.name == LOOKS);
    (0..at.len())
        .into_par_iter()
        .map(|index| (!is_looks(index)).then(|| derivative(index)))
        .collect()
}
