//! Speckle: what many scatterers of unknown phase in one resolution cell do to its intensity.
//!
//! Fully developed, averaged over L looks, the intensity is multiplied by a Gamma(L, 1/L) variate
//! (Goodman 2007, "Speckle Phenomena in Optics", ch. 3 and 5). In decibels that is an offset of
//! 10/ln 10 · (ψ(L) − ln L) and a standard deviation of 10/ln 10 · √ψ′(L). With a coherent part K
//! times as strong as the diffuse one, the phasor is √(K/(K+1)) + z/√(K+1) with z circular Gaussian,
//! and its intensity Rician. Every factor has the mean 1.

use num_complex::Complex;
use serde::{Deserialize, Serialize};

use super::error::{RadarError, in_range};
use super::random::Draws;

/// Statistics of a speckled return. The default is fully developed speckle in a single look.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Speckle {
    /// Independent looks L averaged in one detection, from 0.1 to 1e6; not necessarily whole.
    /// 1: assumed; the paper averages no chirps.
    pub looks: f64,
    /// K: power of the coherent part over that of the diffuse part, from 0 to 1e9. 0: assumed.
    pub coherent_ratio: f64,
}

impl Default for Speckle {
    fn default() -> Self {
        Speckle { looks: 1.0, coherent_ratio: 0.0 }
    }
}

impl Speckle {
    /// Checks every setting against the range in which it has a meaning.
    ///
    /// # Errors
    /// The first setting out of range, by name.
    pub fn validate(&self) -> Result<(), RadarError> {
        let checks = [
            ("speckle.looks", self.looks, (0.1, 1e6)),
            ("speckle.coherent_ratio", self.coherent_ratio, (0.0, 1e9)),
        ];
        checks.into_iter().try_for_each(in_range)
    }

    /// Factor on a power, of mean 1.
    ///
    /// The mean of L intensities |√K + z|² is a Gamma variate whose shape is L plus a Poisson count
    /// of mean LK; with K = 0 it is the Gamma(L, 1/L) of developed speckle.
    pub fn intensity_factor(&self, draws: &mut Draws) -> f64 {
        let shape = self.looks + draws.poisson(self.looks * self.coherent_ratio);
        shape * draws.gamma(shape) / (self.looks * (1.0 + self.coherent_ratio))
    }

    /// Factor on an amplitude, of mean square 1: one look, whatever [`looks`](Self::looks) says.
    pub fn phasor(&self, draws: &mut Draws) -> Complex<f64> {
        let diffuse = 1.0 / (1.0 + self.coherent_ratio);
        (1.0 - diffuse).sqrt() + draws.complex_gaussian() * diffuse.sqrt()
    }

    /// Standard deviation of the intensity over its mean, √((1 + 2K)/L)/(1 + K); 1/√L without a
    /// coherent part.
    pub fn contrast(&self) -> f64 {
        ((1.0 + 2.0 * self.coherent_ratio) / self.looks).sqrt() / (1.0 + self.coherent_ratio)
    }
}

/// Mean of the decibels of developed speckle of L looks, less the decibels of its mean: −2.51 for
/// one look, towards 0 for many.
pub fn mean_offset_db(looks: f64) -> f64 {
    DB_PER_NEPER * (digamma(looks) - looks.ln())
}

/// Standard deviation of the decibels of developed speckle of L looks: 5.57 for one look.
pub fn standard_deviation_db(looks: f64) -> f64 {
    DB_PER_NEPER * trigamma(looks).sqrt()
}

/// Decibels of a power ratio e.
const DB_PER_NEPER: f64 = 10.0 / std::f64::consts::LN_10;

/// Below this argument the recurrences climb; above it the asymptotic series are good to 1e-13.
const LARGE: f64 = 12.0;

/// ψ(x) for x > 0: ψ(x) = ψ(x + 1) − 1/x up to a large x, then the asymptotic series (Abramowitz and
/// Stegun 6.3.18).
fn digamma(x: f64) -> f64 {
    if x < LARGE {
        return digamma(x + 1.0) - 1.0 / x;
    }
    let y = 1.0 / (x * x);
    let series = y * (1.0 / 12.0 - y * (1.0 / 120.0 - y * (1.0 / 252.0 - y * (1.0 / 240.0))));
    x.ln() - 0.5 / x - series
}

/// ψ′(x) for x > 0, in the same way (Abramowitz and Stegun 6.4.12).
fn trigamma(x: f64) -> f64 {
    if x < LARGE {
        return trigamma(x + 1.0) + 1.0 / (x * x);
    }
    let y = 1.0 / (x * x);
    let series = y * (1.0 / 6.0 - y * (1.0 / 30.0 - y * (1.0 / 42.0 - y * (1.0 / 30.0))));
    (1.0 + 0.5 / x + series) / x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::random::{Key, Purpose};
    use crate::units::db_from_ratio;

    const COUNT: usize = 20_000;

    fn draws(chirp: u64) -> Draws {
        Key { seed: 5, chirp, sub_ray: 0, purpose: Purpose::Speckle }.draws()
    }

    fn mean_and_deviation(values: &[f64]) -> [f64; 2] {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / values.len() as f64;
        [mean, variance.sqrt()]
    }

    /// Looks, offset and standard deviation, dB.
    const PUBLISHED_DB: [(f64, f64, f64); 4] =
        [(1.0, -2.51, 5.57), (2.0, -1.17, 3.49), (4.0, -0.57, 2.31), (8.0, -0.28, 1.59)];

    #[test]
    fn decibels_have_their_closed_forms() {
        for (looks, offset_db, deviation_db) in PUBLISHED_DB {
            assert!((mean_offset_db(looks) - offset_db).abs() < 0.01, "{looks}");
            assert!((standard_deviation_db(looks) - deviation_db).abs() < 0.01, "{looks}");
        }
    }

    #[test]
    fn psi_matches_its_special_values() {
        const EULER_GAMMA: f64 = 0.577_215_664_901_532_9;
        let pi2 = std::f64::consts::PI.powi(2);
        assert!((digamma(1.0) + EULER_GAMMA).abs() < 1e-12);
        assert!((digamma(0.5) + EULER_GAMMA + 2.0 * std::f64::consts::LN_2).abs() < 1e-12);
        assert!((trigamma(1.0) - pi2 / 6.0).abs() < 1e-12);
        assert!((trigamma(0.5) - pi2 / 2.0).abs() < 1e-12);
    }

    #[test]
    fn samples_have_the_stated_decibels_and_contrast() {
        for (looks, ..) in PUBLISHED_DB {
            let speckle = Speckle { looks, ..Speckle::default() };
            let mut draws = draws(looks as u64);
            let factors: Vec<f64> =
                (0..COUNT).map(|_| speckle.intensity_factor(&mut draws)).collect();
            let levels_db: Vec<f64> = factors.iter().map(|&x| db_from_ratio(x)).collect();
            let [mean_db, deviation_db] = mean_and_deviation(&levels_db);
            let bound_db = 5.0 * standard_deviation_db(looks) / (COUNT as f64).sqrt();
            assert!((mean_db - mean_offset_db(looks)).abs() < bound_db, "{looks}: {mean_db}");
            // The decibels are skewed, which widens the law of their deviation less than twice.
            let gap_db = (deviation_db - standard_deviation_db(looks)).abs();
            assert!(gap_db < 2.0 * bound_db, "{looks}: {deviation_db}");
            let [mean, deviation] = mean_and_deviation(&factors);
            assert!((deviation / mean * looks.sqrt() - 1.0).abs() < 0.05, "{looks}");
        }
    }

    #[test]
    fn a_coherent_part_calms_the_speckle() {
        for coherent_ratio in [0.0, 0.5, 4.0, 100.0] {
            for looks in [1.0, 2.5] {
                let speckle = Speckle { looks, coherent_ratio };
                let mut draws = draws(100);
                let factors: Vec<f64> =
                    (0..COUNT).map(|_| speckle.intensity_factor(&mut draws)).collect();
                let [mean, deviation] = mean_and_deviation(&factors);
                let bound = 5.0 * speckle.contrast() / (COUNT as f64).sqrt();
                assert!((mean - 1.0).abs() < bound, "{speckle:?}: {mean}");
                assert!((deviation / speckle.contrast() - 1.0).abs() < 0.05, "{speckle:?}");
            }
        }
    }

    #[test]
    fn phasors_and_intensities_follow_one_law() {
        let speckle = Speckle { looks: 1.0, coherent_ratio: 3.0 };
        let (mut some, mut other) = (draws(1), draws(2));
        let mut powers: Vec<f64> =
            (0..COUNT).map(|_| speckle.phasor(&mut some).norm_sqr()).collect();
        let mut factors: Vec<f64> =
            (0..COUNT).map(|_| speckle.intensity_factor(&mut other)).collect();
        powers.sort_by(f64::total_cmp);
        factors.sort_by(f64::total_cmp);
        // Two-sample Kolmogorov–Smirnov: 1.95·√(2/n) is passed once in a thousand.
        let below = |x: f64| factors.partition_point(|&f| f <= x) as f64 / COUNT as f64;
        let gap = powers
            .iter()
            .enumerate()
            .map(|(i, &x)| (below(x) - i as f64 / COUNT as f64).abs())
            .fold(0.0, f64::max);
        assert!(gap < 1.95 * (2.0 / COUNT as f64).sqrt(), "{gap}");
    }

    #[test]
    fn a_setting_without_meaning_is_named() {
        let error = Speckle { looks: 0.0, ..Speckle::default() }.validate().unwrap_err();
        assert!(error.to_string().contains("speckle.looks = 0"), "{error}");
        assert!(Speckle { coherent_ratio: -1.0, ..Speckle::default() }.validate().is_err());
        Speckle::default().validate().unwrap();
    }
}
