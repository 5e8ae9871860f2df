//! Counter-keyed randomness: a draw is a function of (seed, chirp, sub-ray, purpose) and of nothing
//! else, so that any number of threads in any order gives the same bytes.
//!
//! The four numbers, 64 bits each, are the 256-bit key of the ChaCha stream cipher with 8 rounds
//! (Bernstein 2008, "ChaCha, a variant of Salsa20"). Distinct keys therefore never share a stream,
//! and nothing is hashed. This is the only file that knows which generator is used.

use num_complex::Complex;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, Gamma, Poisson, StandardNormal};

/// What a stream of draws is for. Two purposes never share a draw.
///
/// The numbers are part of a scan's reproducibility: append, never renumber.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u64)]
pub enum Purpose {
    /// Thermal noise of the receiver.
    Noise = 1,
    /// Speckle of a return.
    Speckle = 2,
    /// Height of a rough surface under a sub-ray, which turns its phase.
    SurfacePhase = 4,
    /// Where a surface sends a ray on to a second one.
    Bounce = 5,
    /// Error of a range.
    Range = 6,
    /// Starting points of a fit and the randomised part of its residuals.
    Fit = 7,
    /// Tilt of the surface's normal under a chirp.
    Tilt = 8,
    /// Blocks of a bootstrap.
    Bootstrap = 9,
    /// Amplitudes of the scatterers of a surface.
    Scatterers = 10,
    /// Places of these scatterers.
    Placement = 11,
    /// What varies between the scans of a data set.
    DataSet = 12,
}

/// Names one stream of draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Key {
    /// The seed of the scan.
    pub seed: u64,
    /// Chirp number, from 0.
    pub chirp: u64,
    /// Number of the ray within the chirp's spot, from 0.
    pub sub_ray: u64,
    /// What the draws are for.
    pub purpose: Purpose,
}

/// A stream of draws, always the same for the same key.
#[derive(Debug)]
pub struct Draws {
    generator: ChaCha8Rng,
}

impl Key {
    /// The stream of this key, from its first draw.
    ///
    /// ```
    /// use matdb::radar::random::{Key, Purpose};
    /// let key = Key { seed: 1, chirp: 7, sub_ray: 0, purpose: Purpose::Speckle };
    /// assert_eq!(key.draws().uniform(), key.draws().uniform());
    /// ```
    pub fn draws(self) -> Draws {
        let words = [self.seed, self.chirp, self.sub_ray, self.purpose as u64];
        let mut key = [0; 32];
        for (bytes, word) in std::iter::zip(key.chunks_exact_mut(8), words) {
            bytes.copy_from_slice(&word.to_le_bytes());
        }
        Draws { generator: ChaCha8Rng::from_seed(key) }
    }
}

impl Draws {
    /// A number from 0 (included) to 1 (excluded), all alike.
    pub fn uniform(&mut self) -> f64 {
        self.generator.random()
    }

    /// A circular complex Gaussian of zero mean and unit variance: E|z|² = 1.
    pub fn complex_gaussian(&mut self) -> Complex<f64> {
        let (re, im) = (self.gaussian(), self.gaussian());
        Complex::new(re, im) * std::f64::consts::FRAC_1_SQRT_2
    }

    /// A Gaussian of zero mean and unit variance.
    pub fn gaussian(&mut self) -> f64 {
        StandardNormal.sample(&mut self.generator)
    }

    /// A Gamma variate of shape `looks` and mean 1, which has the variance 1/`looks`.
    ///
    /// Exactly 1 for infinitely many looks; NaN where `looks` is not above 0.
    pub fn gamma(&mut self, looks: f64) -> f64 {
        if looks == f64::INFINITY {
            return 1.0;
        }
        Gamma::new(looks, 1.0 / looks).map_or(f64::NAN, |law| law.sample(&mut self.generator))
    }

    /// A Poisson count, as a whole number in an `f64`; 0 where `mean` is not above 0.
    pub fn poisson(&mut self, mean: f64) -> f64 {
        Poisson::new(mean).map_or(0.0, |law| law.sample(&mut self.generator))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEY: Key = Key { seed: 42, chirp: 3, sub_ray: 1, purpose: Purpose::Speckle };

    fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
        let count = values.len() as f64;
        values.sum::<f64>() / count
    }

    /// Regularised lower incomplete gamma function P(a, x) for whole and half a, upwards from
    /// P(1, x) = 1 − e⁻ˣ or P(½, x) = erf √x by P(a + 1, x) = P(a, x) − xᵃe⁻ˣ/Γ(a + 1).
    fn incomplete_gamma(a: f64, x: f64) -> f64 {
        let half = a.fract() != 0.0;
        let (mut order, mut value) =
            if half { (0.5, erf(x.sqrt())) } else { (1.0, 1.0 - (-x).exp()) };
        let mut factor = if half { 0.5 * std::f64::consts::PI.sqrt() } else { 1.0 };
        while order < a {
            value -= x.powf(order) * (-x).exp() / factor;
            order += 1.0;
            factor *= order;
        }
        value
    }

    fn erf(x: f64) -> f64 {
        const STEPS: usize = 400;
        let h = x / STEPS as f64;
        let sum: f64 = (0..STEPS).map(|i| (-((i as f64 + 0.5) * h).powi(2)).exp()).sum();
        2.0 / std::f64::consts::PI.sqrt() * h * sum
    }

    /// Kolmogorov's distance between sorted samples and a cumulative law.
    fn distance(samples: &[f64], law: impl Fn(f64) -> f64) -> f64 {
        let n = samples.len() as f64;
        let gaps = samples.iter().enumerate().map(|(i, &x)| {
            let cdf = law(x);
            (cdf - i as f64 / n).abs().max(((i + 1) as f64 / n - cdf).abs())
        });
        gaps.fold(0.0, f64::max)
    }

    #[test]
    fn a_key_names_its_stream_for_ever() {
        // A change here is a change of every seeded scan: it belongs in the changelog.
        let mut draws = KEY.draws();
        let first = [draws.uniform(), draws.uniform()];
        assert_eq!(first, [0.102_083_804_839_073_98, 0.211_840_779_515_922_62]);
    }

    #[test]
    fn streams_of_neighbouring_keys_are_uncorrelated() {
        const COUNT: usize = 20_000;
        let neighbours = [
            Key { seed: 43, ..KEY },
            Key { chirp: 4, ..KEY },
            Key { sub_ray: 2, ..KEY },
            Key { purpose: Purpose::Noise, ..KEY },
        ];
        for other in neighbours {
            let (mut a, mut b) = (KEY.draws(), other.draws());
            let product = (0..COUNT).map(|_| 12.0 * (a.uniform() - 0.5) * (b.uniform() - 0.5));
            // Five standard deviations of the mean of uncorrelated products of unit variance.
            assert!(mean(product).abs() < 5.0 / (COUNT as f64).sqrt(), "{other:?}");
        }
    }

    #[test]
    fn first_draws_of_successive_keys_are_uniform_and_uncorrelated() {
        const COUNT: u64 = 20_000;
        let first: Vec<f64> =
            (0..COUNT).map(|chirp| Key { chirp, ..KEY }.draws().uniform()).collect();
        let lagged = first.windows(2).map(|w| 12.0 * (w[0] - 0.5) * (w[1] - 0.5));
        assert!(mean(lagged).abs() < 5.0 / (COUNT as f64).sqrt());
        let mut sorted = first;
        sorted.sort_by(f64::total_cmp);
        // Kolmogorov: 1.95/√n is passed once in a thousand.
        assert!(distance(&sorted, |x| x) < 1.95 / (COUNT as f64).sqrt());
    }

    #[test]
    fn the_complex_gaussian_is_circular_with_unit_variance() {
        const COUNT: usize = 50_000;
        let mut draws = KEY.draws();
        let z: Vec<Complex<f64>> = (0..COUNT).map(|_| draws.complex_gaussian()).collect();
        let bound = 5.0 / (COUNT as f64).sqrt();
        assert!(mean(z.iter().map(|z| z.re)).abs() < bound);
        assert!(mean(z.iter().map(|z| z.im)).abs() < bound);
        assert!((mean(z.iter().map(|z| z.norm_sqr())) - 1.0).abs() < bound);
        // The pseudo-variance E z² vanishes, and |z|² is exponential: E|z|⁴ = 2.
        assert!(mean(z.iter().map(|z| (z * z).re)).abs() < bound);
        assert!(mean(z.iter().map(|z| (z * z).im)).abs() < bound);
        assert!((mean(z.iter().map(|z| z.norm_sqr().powi(2))) - 2.0).abs() < 5.0 * bound);
    }

    #[test]
    fn gamma_follows_its_law() {
        const COUNT: usize = 10_000;
        for looks in [0.5, 1.0, 1.5, 4.0, 8.0] {
            let mut draws = KEY.draws();
            let mut samples: Vec<f64> = (0..COUNT).map(|_| draws.gamma(looks)).collect();
            let mean_of = mean(samples.iter().copied());
            let variance = mean(samples.iter().map(|x| (x - 1.0).powi(2)));
            let sd = (1.0 / looks / COUNT as f64).sqrt();
            assert!((mean_of - 1.0).abs() < 5.0 * sd, "looks {looks}: mean {mean_of}");
            // The variance of the variance is (2 + 6/L)/L² over the count.
            let sd = ((2.0 + 6.0 / looks) / COUNT as f64).sqrt() / looks;
            assert!((variance - 1.0 / looks).abs() < 5.0 * sd, "looks {looks}: {variance}");
            samples.sort_by(f64::total_cmp);
            let gap = distance(&samples, |x| incomplete_gamma(looks, looks * x));
            assert!(gap < 1.95 / (COUNT as f64).sqrt(), "looks {looks}: {gap}");
        }
    }

    #[test]
    fn laws_without_a_meaning_are_total() {
        let mut draws = KEY.draws();
        assert_eq!(draws.gamma(f64::INFINITY), 1.0);
        assert!(draws.gamma(0.0).is_nan() && draws.gamma(f64::NAN).is_nan());
        assert_eq!(draws.poisson(0.0), 0.0);
        assert_eq!(draws.poisson(-1.0), 0.0);
    }
}
