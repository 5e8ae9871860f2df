//! Derivatives of ln σ⁰ by each coordinate.

use nalgebra::DVector;
use rayon::prelude::*;

use super::coordinates::{Coordinates, LOOKS};
use super::table::{Aspects, Table};

/// Step in the search: about the relative error of a one-sided difference, far above that of its rounding.
const STEP: f64 = 1e-6;

/// d ln σ⁰/du at the aspects for each coordinate; `here` is the table at the point. `None` for the looks, which do
/// not change σ⁰.
pub(super) fn derivatives(
    coordinates: &Coordinates,
    at: &DVector<f64>,
    aspects: &Aspects,
    here: &Table,
) -> Vec<Option<Table>> {
    let upper = coordinates.upper();
    (0..at.len())
        .into_par_iter()
        .map(|index| {
            if coordinates.list.get(index).is_some_and(|c| c.name == LOOKS) {
                return None;
            }
            let step = if at[index] + STEP > upper[index] { -STEP } else { STEP };
            let mut there = at.clone();
            there[index] += step;
            Some(coordinates.table(&there, aspects).difference(here, step))
        })
        .collect()
}
