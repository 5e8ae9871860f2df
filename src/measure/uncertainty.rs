//! How well a pose is known.
//!
//! With independent errors the covariance of the least-squares pose is σ²(JᵀJ)⁻¹. Neighbouring
//! points share errors: their spots overlap, and they lie on the same facets. So the sum of JᵀeeᵀJ is
//! also taken over cells of space instead of over points (Liang and Zeger 1986,
//! DOI 10.1093/biomet/73.1.13), and the covariance is widened by the ratio of the two, averaged over
//! the six directions, where it is above 1. Errors shared over more than a cell, such as those of the
//! mesh's size, stay invisible.

use std::collections::BTreeMap;

use glam::DVec3;
use nalgebra::{Matrix6, SymmetricEigen, Vector6};

use super::icp::{Gap, NormalEquations, jacobian};

/// Side of a cell, three spots of the paper's radar, m.
const CELL_M: f64 = 0.05;
/// Fewer cells do not tell how errors are shared.
const LEAST_CELLS: usize = 30;
/// A direction known worse than this is not known, m.
const UNKNOWN_SD_M: f64 = 5e-3;

/// What is known of a pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Uncertainty {
    /// Covariance of shift (m) and turn (rad) about the pivot.
    pub covariance: [[f64; 6]; 6],
    /// By what the variance was widened for shared errors, 1 or more.
    pub widened: f64,
    /// Directions in which the target does not tell its pose, in words.
    pub unknown: Vec<String>,
}

/// The covariance from the gaps that were used, at their least.
pub(super) fn uncertainty(gaps: &[Gap], pivot: DVec3, length_m: f64) -> Uncertainty {
    let equations = NormalEquations::new(gaps.iter().map(|gap| (*gap, 1.0)), pivot, length_m);
    let freedom = gaps.len().saturating_sub(6).max(1) as f64;
    let variance_m2 = gaps.iter().map(|gap| gap.size_m * gap.size_m).sum::<f64>() / freedom;
    let eigen = SymmetricEigen::new(equations.information);
    let widened = widening(gaps, pivot, length_m, variance_m2, &eigen);
    let mut scaled = Matrix6::zeros();
    let mut unknown = Vec::new();
    // A thousandth of a point's information: rounding of a plane's zero is far below.
    let least = 1e-3;
    for (value, axis) in std::iter::zip(eigen.eigenvalues.iter(), eigen.eigenvectors.column_iter())
    {
        let told_m2 = variance_m2 * widened / value.max(0.0);
        let blind = *value < least;
        // What is not told may be anything up to the size of the target.
        let variance_m2 =
            if blind { length_m * length_m } else { told_m2.min(length_m * length_m) };
        if blind || told_m2.sqrt() > UNKNOWN_SD_M {
            unknown.push(in_words(&axis.into_owned(), variance_m2.sqrt()));
        }
        scaled += axis * axis.transpose() * variance_m2;
    }
    let unit = |axis: usize| if axis < 3 { 1.0 } else { 1.0 / length_m };
    let covariance =
        std::array::from_fn(|i| std::array::from_fn(|j| scaled[(i, j)] * unit(i) * unit(j)));
    Uncertainty { covariance, widened, unknown }
}

/// Variance with errors shared within cells over variance with independent errors.
fn widening(
    gaps: &[Gap],
    pivot: DVec3,
    length_m: f64,
    variance_m2: f64,
    eigen: &SymmetricEigen<f64, nalgebra::Const<6>>,
) -> f64 {
    let mut cells: BTreeMap<[i64; 3], Vector6<f64>> = BTreeMap::new();
    for gap in gaps {
        let cell = (gap.at / CELL_M).floor().to_array().map(|index| index as i64);
        let pull = jacobian(gap, pivot, length_m) * gap.size_m;
        *cells.entry(cell).or_insert_with(Vector6::zeros) += pull;
    }
    if cells.len() < LEAST_CELLS || variance_m2 == 0.0 {
        return 1.0;
    }
    let correction = cells.len() as f64 / (cells.len() - 6) as f64;
    let best = eigen.eigenvalues.max();
    let told = |value: f64| value > 1e-9 * best;
    let ratios: Vec<f64> =
        std::iter::zip(eigen.eigenvalues.iter(), eigen.eigenvectors.column_iter())
            .filter(|(value, _)| told(**value))
            .map(|(value, axis)| {
                let shared: f64 = cells.values().map(|pull| axis.dot(pull).powi(2)).sum();
                correction * shared / (variance_m2 * value)
            })
            .collect();
    let mean = ratios.iter().sum::<f64>() / ratios.len().max(1) as f64;
    mean.max(1.0)
}

/// A direction of the six by its largest parts.
fn in_words(axis: &Vector6<f64>, sd_m: f64) -> String {
    const NAMES: [&str; 6] = [
        "a shift along x",
        "a shift along y",
        "a shift along z",
        "a turn about x",
        "a turn about y",
        "a turn about z",
    ];
    // Parts below a third hardly change the direction.
    let large = std::iter::zip(axis.iter(), NAMES).filter(|(part, _)| part.abs() > 0.33);
    let names: Vec<&str> = large.map(|(_, name)| name).collect();
    format!(
        "the target does not tell {}: standard deviation {:.0} mm",
        names.join(" with "),
        1e3 * sd_m
    )
}
