//! Thermal noise and range error as plain laws, for scans that skip the beat signal.
//!
//! An echo of power P in noise of power N has the complex amplitude √P·a + √N·w with w circular
//! Gaussian. Under speckle of L looks a is Gaussian too, and the mean of L such powers is
//! Gamma(L, (P + N)/L); without speckle it is |√P + √N·w|². The full chain of
//! [`RangeProcessor`](super::RangeProcessor) does the same by its samples.

use serde::{Deserialize, Serialize};

use super::error::{RadarError, in_range};
use super::random::Draws;
use super::speckle::Speckle;

/// Noise of a detection.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Noise {
    /// Thermal power N in the cell of an echo, dBm, from −300 to 100. −112: kTF·B_n of the default
    /// receiver.
    pub level_dbm: f64,
    /// Standard deviation of a range, m, from 0 to 10. 0.001: assumed.
    pub range_sd_m: f64,
}

impl Default for Noise {
    fn default() -> Self {
        Noise { level_dbm: -112.0, range_sd_m: 0.001 }
    }
}

impl Noise {
    /// Checks every setting against the range in which it has a meaning.
    ///
    /// # Errors
    /// The first setting out of range, by name.
    pub fn validate(&self) -> Result<(), RadarError> {
        let checks = [
            ("noise.level_dbm", self.level_dbm, (-300.0, 100.0)),
            ("noise.range_sd_m", self.range_sd_m, (0.0, 10.0)),
        ];
        checks.into_iter().try_for_each(in_range)
    }
}

/// A power, W, as it is measured: `mean_w` with its speckle, in noise of mean `noise_w`.
pub fn measured_w(mean_w: f64, noise_w: f64, speckle: Option<Speckle>, draws: &mut Draws) -> f64 {
    let Some(Speckle { looks, coherent_ratio }) = speckle else {
        return (mean_w.sqrt() + draws.complex_gaussian() * noise_w.sqrt()).norm_sqr();
    };
    // Diffuse echo and noise are one Gaussian; beside it the coherent part keeps its power.
    let coherent_w = mean_w * coherent_ratio / (1.0 + coherent_ratio);
    let gaussian_w = mean_w - coherent_w + noise_w;
    if gaussian_w <= 0.0 {
        return coherent_w;
    }
    let together = Speckle { looks, coherent_ratio: coherent_w / gaussian_w };
    (coherent_w + gaussian_w) * together.intensity_factor(draws)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::random::{Key, Purpose};

    const COUNT: u64 = 40_000;

    /// Mean and standard deviation of measured powers.
    fn moments(mean_w: f64, noise_w: f64, speckle: Option<Speckle>) -> [f64; 2] {
        let mut draws = Key { seed: 3, chirp: 0, sub_ray: 0, purpose: Purpose::Noise }.draws();
        let powers: Vec<f64> =
            (0..COUNT).map(|_| measured_w(mean_w, noise_w, speckle, &mut draws)).collect();
        let mean = powers.iter().sum::<f64>() / COUNT as f64;
        let variance = powers.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / COUNT as f64;
        [mean, variance.sqrt()]
    }

    #[test]
    fn powers_add_and_spread_as_their_laws_say() {
        // Rice: variance N² + 2PN. Gamma: (P + N)²/L. With a coherent part C: (G² + 2CG)/L.
        let developed = |looks| Some(Speckle { looks, coherent_ratio: 0.0 });
        let partial = Some(Speckle { looks: 4.0, coherent_ratio: 1.0 });
        for (speckle, sd) in [
            (None, (0.25f64 + 2.0 * 0.5).sqrt()),
            (developed(1.0), 1.5),
            (developed(4.0), 0.75),
            (partial, ((1.0f64 + 2.0 * 0.5) / 4.0).sqrt()),
        ] {
            let [mean, found] = moments(1.0, 0.5, speckle);
            assert!((mean - 1.5).abs() < 5.0 * sd / (COUNT as f64).sqrt(), "{speckle:?}: {mean}");
            assert!((found / sd - 1.0).abs() < 0.05, "{speckle:?}: {found} is not {sd}");
        }
    }

    #[test]
    fn without_noise_and_speckle_a_power_stays_as_it_is() {
        let [mean, deviation] = moments(2.0, 0.0, None);
        assert!((mean - 2.0).abs() < 1e-12 && deviation < 1e-12);
        let silent = Some(Speckle::default());
        assert_eq!(moments(0.0, 0.0, silent), [0.0, 0.0]);
    }
}
