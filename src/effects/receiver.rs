//! The receiver: noise, speckle and saturation.

use super::ceiling::{Ceiling, SaturationCurve};
use crate::radar::Radar;

/// Most looks of a law of powers: their spread is 0.04 dB.
pub(crate) const MOST_LOOKS: f64 = 1e4;
/// Coherent shares up to here count as none: they narrow the law of a power by half a percent.
pub(super) const LEAST_COHERENT: f64 = 0.1;

/// The distribution of received powers about their mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// Looks L of the speckle.
    pub looks: f64,
    /// Most looks of an echo that speckles in part.
    pub most_looks: f64,
    /// Mean thermal power, W.
    pub noise_w: f64,
    /// Standard deviation of each of the two random tilts of the normal under a chirp, rad.
    pub tilt_sd_rad: f64,
    /// The saturation.
    pub ceiling: Ceiling,
}

impl Receiver {
    /// A receiver without speckle, noise, tilts and saturation.
    pub const LINEAR: Receiver = Receiver {
        looks: f64::INFINITY,
        most_looks: MOST_LOOKS,
        noise_w: 0.0,
        tilt_sd_rad: 0.0,
        ceiling: Ceiling::NONE,
    };

    /// Looks of developed speckle whose power has the mean and the variance of an echo of which the share c of the mean, with
    /// noise, is coherent: L/(1 − c²).
    ///
    /// One look has the amplitude √C + z, z circular Gaussian of mean square G = μ − C. Its power C + 2√C·Re z + |z|² has the
    /// variance 2CG + G² = μ² − C², since Re z and |z|² are not correlated. Over L looks that is μ²(1 − c²)/L, and Gamma's is
    /// μ²/L. A share of less than a tenth counts as none, beyond which c² starts from 0. `more`: factor on the looks.
    pub fn looks_of(&self, coherent_share: f64, more: f64) -> f64 {
        const LEAST2: f64 = LEAST_COHERENT * LEAST_COHERENT;
        let share2 = coherent_share * coherent_share;
        let wave = if share2 > LEAST2 {
            (1.0 - LEAST2) / (1.0 - share2).max(f64::MIN_POSITIVE)
        } else {
            1.0
        };
        let looks = more * wave * self.looks;
        looks.min(self.most_looks.max(self.looks))
    }

    /// The saturation curve for its speckle.
    pub fn saturating(&self) -> SaturationCurve {
        self.ceiling.over(self.looks)
    }

    /// The receiver that a radar declares: its speckle (infinitely many looks if it has none), and the
    /// thermal noise of its `[radar.noise]`.
    pub fn declared(radar: &Radar) -> Receiver {
        Receiver {
            looks: radar.speckle.map_or(f64::INFINITY, |speckle| speckle.looks),
            noise_w: radar.noise_w(),
            ..Receiver::LINEAR
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::random::{Key, Purpose};

    /// Looks L/(1 − c²) give Gamma's variance to what is drawn: a constant phasor and a circular Gaussian field, over L looks.
    #[test]
    fn a_wave_beside_speckle_narrows_it_as_draws_do() {
        const COUNT: usize = 100_000;
        for (looks, share) in [(1, 0.0), (1, 0.5), (1, 0.9), (4, 0.3), (4, 0.7)] {
            let mut draws =
                Key { seed: 6, chirp: 0, sub_ray: 0, purpose: Purpose::Speckle }.draws();
            let mut one = || {
                let waves = (0..looks).map(|_| {
                    let field = draws.complex_gaussian() * f64::sqrt(1.0 - share);
                    (field + f64::sqrt(share)).norm_sqr()
                });
                waves.sum::<f64>() / f64::from(looks)
            };
            let powers: Vec<f64> = (0..COUNT).map(|_| one()).collect();
            let mean = powers.iter().sum::<f64>() / COUNT as f64;
            let variance = powers.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / COUNT as f64;
            let receiver = Receiver { looks: f64::from(looks), ..Receiver::LINEAR };
            let found = receiver.looks_of(share, 1.0);
            // The draws determine the variance to 1 %; what counts as no share takes another 1 %.
            assert!((found * variance - 1.0).abs() < 0.03, "{looks} {share}: {found} {variance}");
        }
    }

    #[test]
    fn small_shares_are_none_and_a_mirror_has_an_end() {
        let receiver = Receiver { looks: 4.0, ..Receiver::LINEAR };
        assert_eq!(receiver.looks_of(LEAST_COHERENT, 1.0), 4.0);
        assert!((receiver.looks_of(LEAST_COHERENT + 1e-6, 1.0) / 4.0 - 1.0).abs() < 1e-6);
        assert_eq!(receiver.looks_of(1.0, 1.0), MOST_LOOKS);
        // What is judged with much speckle has it everywhere.
        assert_eq!(Receiver { most_looks: 4.0, ..receiver }.looks_of(0.9, 1.0), 4.0);
    }
}
