//! The covariance of a registered pose.
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

use super::freedom::Untold;
use super::icp::{Gap, NormalEquations, jacobian};

/// Side of a cell, three spots of the paper's radar, m.
const CELL_M: f64 = 0.05;
/// With fewer cells the shared errors cannot be estimated.
const LEAST_CELLS: usize = 30;

/// The uncertainty of a pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Uncertainty {
    /// Covariance of shift (m) and turn (rad) about the pivot; along untold twists that of the size of the target.
    pub covariance: [[f64; 6]; 6],
    /// The part of the told twists.
    pub told: [[f64; 6]; 6],
    /// Factor on the variance for shared errors, 1 or more.
    pub widened: f64,
    /// Twists that the points do not tell.
    pub untold: Untold,
}

/// The covariance of the pose from the gaps that were used, where their squares are least. `are_shared`: whether neighbours may
/// share errors.
pub(super) fn uncertainty(
    gaps: &[Gap],
    pivot: DVec3,
    length_m: f64,
    are_shared: bool,
) -> Uncertainty {
    let equations = NormalEquations::new(gaps.iter().map(|gap| (*gap, 1.0)), pivot, length_m);
    let freedom = gaps.len().saturating_sub(6).max(1) as f64;
    let variance_m2 = gaps.iter().map(|gap| gap.size_m * gap.size_m).sum::<f64>() / freedom;
    let eigen = SymmetricEigen::new(equations.information);
    let widened =
        if are_shared { widening(gaps, pivot, length_m, variance_m2, &eigen) } else { 1.0 };
    let untold = Untold::of(&equations.information, (variance_m2 * widened).sqrt(), length_m);
    let mut told = Matrix6::zeros();
    for (value, axis) in std::iter::zip(eigen.eigenvalues.iter(), eigen.eigenvectors.column_iter())
    {
        let axis = axis.into_owned();
        if untold.tells(&axis) {
            told += axis * axis.transpose() * (variance_m2 * widened / value);
        }
    }
    let of_size = untold.twists.iter().map(|twist| twist * twist.transpose() * length_m.powi(2));
    let covariance = told + of_size.sum::<Matrix6<f64>>();
    // Turns were scaled by the length.
    let per_m = 1.0 / length_m;
    let unit = [1.0, 1.0, 1.0, per_m, per_m, per_m];
    let [covariance, told] = [covariance, told].map(|scaled| {
        std::array::from_fn(|i| std::array::from_fn(|j| scaled[(i, j)] * unit[i] * unit[j]))
    });
    Uncertainty { covariance, told, widened, untold }
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
    let mut ratios = Vec::new();
    for (value, axis) in std::iter::zip(eigen.eigenvalues.iter(), eigen.eigenvectors.column_iter())
    {
        if *value > 1e-9 * best {
            let shared: f64 = cells.values().map(|pull| axis.dot(pull).powi(2)).sum();
            ratios.push(correction * shared / (variance_m2 * value));
        }
    }
    let mean = ratios.iter().sum::<f64>() / ratios.len().max(1) as f64;
    mean.max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::random::{Draws, Key, Purpose};

    const SD_M: f64 = 2e-3;

    fn normal(draws: &mut Draws) -> f64 {
        draws.complex_gaussian().re * std::f64::consts::SQRT_2
    }

    /// Sixteen points in each of 400 cells of a bumpy wall; `shared` of the variance is the cell's.
    fn wall(shared: f64) -> Vec<Gap> {
        let key = Key { seed: 8, chirp: 0, sub_ray: 0, purpose: Purpose::Noise };
        let mut draws = key.draws();
        let mut gaps = Vec::new();
        for cell in 0..400 {
            let corner = DVec3::new(f64::from(cell % 20), f64::from(cell / 20), 0.0) * CELL_M;
            let common = normal(&mut draws) * shared.sqrt();
            for _ in 0..16 {
                let inside = DVec3::new(draws.uniform(), draws.uniform(), draws.uniform());
                let lean = DVec3::new(normal(&mut draws), normal(&mut draws), 2.0);
                let own = normal(&mut draws) * (1.0 - shared).sqrt();
                let at = corner + CELL_M * inside;
                let gradient = lean.normalize();
                gaps.push(Gap { at, gradient, size_m: SD_M * (common + own) });
            }
        }
        gaps
    }

    #[test]
    fn independent_errors_give_the_textbooks_covariance() {
        let gaps = wall(0.0);
        let known = uncertainty(&gaps, DVec3::splat(0.5), 0.4, true);
        // The mean of six χ² ratios over 400 cells scatters by some 3 %.
        assert!(known.widened < 1.1, "{}", known.widened);
        // z: σ² over Σ n_z², with n_z² = 4/(4 + χ²₂), on average 0.72.
        let sd_m = known.covariance[2][2].sqrt();
        let expected_m = SD_M / (0.72 * gaps.len() as f64).sqrt();
        assert!((sd_m / expected_m - 1.0).abs() < 0.1, "{sd_m} {expected_m}");
        assert!(known.untold.twists.is_empty() && known.told == known.covariance);
    }

    #[test]
    fn errors_that_neighbours_share_widen_it() {
        // With n points a cell and a correlation ρ a common pull grows by 1 + (n − 1)·ρ = 8.5; leaning
        // normals share less of it: along x and y the signs differ.
        let known = uncertainty(&wall(0.5), DVec3::splat(0.5), 0.4, true);
        assert!((3.0..8.5).contains(&known.widened), "{}", known.widened);
    }

    #[test]
    fn nothing_at_all_is_known_of_nothing() {
        let known = uncertainty(&[], DVec3::ZERO, 0.4, true);
        assert_eq!(known.untold.twists.len(), 6);
        assert!((known.covariance[0][0] - 0.16).abs() < 1e-12);
    }
}
