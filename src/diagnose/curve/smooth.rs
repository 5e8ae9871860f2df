//! Structure that no term explains: a smooth curve over an angle, of unknown origin.
//!
//! Hat functions over a covariate, with a penalty on bends, are fitted to the residual at the angles of the fit
//! and must predict the residual at the others.

use nalgebra::{DMatrix, DVector};

use super::points::{Kind, Point};

/// Hats over a covariate.
const HATS: usize = 9;
/// Prior standard deviation of a bend from hat to hat, dB.
const BEND_DB: f64 = 1.0;

/// An angle that a residual can depend on.
#[derive(Clone, Copy)]
pub(super) struct Covariate {
    pub name: &'static str,
    pub of: fn(&Point) -> f64,
}

/// The covariates of a curve.
pub(super) fn covariates(kind: Kind) -> &'static [Covariate] {
    match kind {
        Kind::Backscatter => &[Covariate { name: "theta", of: |p| p.theta_i_rad }],
        Kind::InPlane => &[
            Covariate { name: "theta_s - theta_i", of: |p| p.theta_s_rad - p.theta_i_rad },
            Covariate { name: "theta_s + theta_i", of: |p| p.theta_s_rad + p.theta_i_rad },
            Covariate { name: "theta_s", of: |p| p.theta_s_rad },
            Covariate { name: "theta_i", of: |p| p.theta_i_rad },
        ],
    }
}

/// A smooth curve over a covariate.
pub(super) struct Smooth {
    from: f64,
    step: f64,
    hats: DVector<f64>,
}

impl Smooth {
    /// A curve over a range, fitted to pairs of covariate and residual, dB, that scatter by `scale_db`.
    pub fn fit(pairs: &[(f64, f64)], [from, to]: [f64; 2], scale_db: f64) -> Smooth {
        let step = ((to - from) / (HATS - 1) as f64).max(1e-12);
        let mut smooth = Smooth { from, step, hats: DVector::zeros(HATS) };
        let mut normal = DMatrix::zeros(HATS, HATS);
        let mut right = DVector::zeros(HATS);
        for &(x, residual_db) in pairs {
            let near = smooth.near(x);
            for (a, weight_a) in near {
                right[a] += weight_a * residual_db;
                for (b, weight_b) in near {
                    normal[(a, b)] += weight_a * weight_b;
                }
            }
        }
        let penalty = (scale_db / BEND_DB).powi(2);
        for middle in 1..HATS - 1 {
            let bend = [(middle - 1, 1.0), (middle, -2.0), (middle + 1, 1.0)];
            for (a, weight_a) in bend {
                for (b, weight_b) in bend {
                    normal[(a, b)] += penalty * weight_a * weight_b;
                }
            }
        }
        // A small ridge: 0 where the pairs do not even determine a line.
        for k in 0..HATS {
            normal[(k, k)] += 1e-6 + 1e-3 * penalty;
        }
        if let Some(factor) = normal.cholesky() {
            smooth.hats = factor.solve(&right);
        }
        smooth
    }

    /// Its value, dB.
    pub fn at(&self, x: f64) -> f64 {
        self.near(x).into_iter().map(|(hat, weight)| weight * self.hats[hat]).sum()
    }

    /// The two hats at a place and their weights.
    fn near(&self, x: f64) -> [(usize, f64); 2] {
        let place = ((x - self.from) / self.step).clamp(0.0, (HATS - 1) as f64);
        let left = (place.floor() as usize).min(HATS - 2);
        let share = place - left as f64;
        [(left, 1.0 - share), (left + 1, share)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smooth_curve_is_met_and_a_gap_is_bridged() {
        let truth = |x: f64| 0.5 * (2.0 * x).sin();
        let all = (0..200).map(|k| f64::from(k) / 100.0).map(|x| (x, truth(x)));
        let pairs: Vec<(f64, f64)> = all.filter(|(x, _)| !(0.9..1.1).contains(x)).collect();
        let smooth = Smooth::fit(&pairs, [0.0, 2.0], 0.1);
        for x in [0.1, 0.5, 1.0, 1.6] {
            assert!((smooth.at(x) - truth(x)).abs() < 0.05, "{x}: {}", smooth.at(x));
        }
    }
}
