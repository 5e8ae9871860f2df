//! Windows: how a beat signal is faded in and out before its Fourier transform.
//!
//! Sums of cosines, w_n = Σ (−1)ᵏ a_k cos(2πkn/N), with the coefficients and figures of merit of
//! Harris 1978 (DOI 10.1109/PROC.1978.10837, table I). The sum of the samples is the coherent gain;
//! the noise bandwidth, in bins, is N Σw² / (Σw)².

use std::f64::consts::{PI, TAU};

use serde::{Deserialize, Serialize};

use crate::units::ratio_from_db;

/// A window. Each row of the table is coherent gain, noise bandwidth and half-power width in bins,
/// and the highest sidelobe in dB.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Window {
    /// None at all. 1.00, 1.00, 0.89, −13.
    Rectangular,
    /// Raised cosine. 0.50, 1.50, 1.44, −32.
    #[default]
    Hann,
    /// Raised cosine on a pedestal. 0.54, 1.36, 1.30, −43.
    Hamming,
    /// Four terms, least sidelobes. 0.36, 2.00, 1.90, −92.
    BlackmanHarris,
}

impl Window {
    /// Every window.
    pub const ALL: [Window; 4] =
        [Window::Rectangular, Window::Hann, Window::Hamming, Window::BlackmanHarris];

    fn coefficients(self) -> &'static [f64] {
        match self {
            Window::Rectangular => &[1.0],
            Window::Hann => &[0.5, 0.5],
            Window::Hamming => &[0.54, 0.46],
            Window::BlackmanHarris => &[0.358_75, 0.488_29, 0.141_28, 0.011_68],
        }
    }

    /// The samples w_n for n from 0 to `count` − 1; of period `count`, as a Fourier transform wants.
    pub fn samples(self, count: usize) -> Vec<f64> {
        (0..count).map(|n| self.sample(TAU * n as f64 / count as f64)).collect()
    }

    /// Σ (−1)ᵏ a_k cos(kα) at the angle α = 2πn/N, rad.
    fn sample(self, angle_rad: f64) -> f64 {
        let terms = self.coefficients().iter().enumerate();
        terms.map(|(k, a)| a * (k as f64 * (angle_rad + PI)).cos()).sum()
    }

    /// Offset of the first zero of the transform from its top, in bins, for many samples.
    pub fn first_zero_bins(self) -> f64 {
        self.coefficients().len() as f64
    }

    /// Power of the highest side lobe over that of the main lobe, rounded up.
    pub fn side_lobe_ratio(self) -> f64 {
        let level_db = match self {
            Window::Rectangular => -13.0,
            Window::Hann => -31.0,
            Window::Hamming => -42.0,
            Window::BlackmanHarris => -91.0,
        };
        ratio_from_db(level_db)
    }

    /// Full width of the main lobe at half power, in bins, for many samples.
    pub fn half_power_width_bins(self) -> f64 {
        let half = 0.5 * self.transform(0.0).powi(2);
        // Every main lobe falls from its top to its first zero, which is beyond half a bin and a
        // half-power point below two bins.
        let (mut inside, mut outside) = (0.0, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (inside + outside);
            let above = self.transform(middle).powi(2) > half;
            *(if above { &mut inside } else { &mut outside }) = middle;
        }
        inside + outside
    }

    /// Fourier transform of the centred window at an offset in bins.
    fn transform(self, bins: f64) -> f64 {
        let mut sum = 0.0;
        for (k, a) in self.coefficients().iter().enumerate() {
            let k = k as f64;
            sum += a * (0.5 * (sinc(bins - k) + sinc(bins + k)));
        }
        sum
    }
}

/// sin(πu)/(πu).
fn sinc(u: f64) -> f64 {
    if u == 0.0 { 1.0 } else { (PI * u).sin() / (PI * u) }
}

/// Mean of the window's samples: the amplitude that a tone at a bin's centre keeps.
pub fn coherent_gain(samples: &[f64]) -> f64 {
    samples.iter().sum::<f64>() / samples.len() as f64
}

/// Noise bandwidth in bins, N Σw² / (Σw)²; 1 for no window, larger for any other.
pub fn noise_bandwidth_bins(samples: &[f64]) -> f64 {
    let energy: f64 = samples.iter().map(|w| w * w).sum();
    energy / samples.len() as f64 / coherent_gain(samples).powi(2)
}

/// Variance of n/N under the weight w_n²: how far in time the window spreads its energy. It sets
/// how quickly the spectrum of noise changes from bin to bin.
pub fn energy_spread(samples: &[f64]) -> f64 {
    let [energy, first, second] = [0, 1, 2].map(|power| moment(samples, power));
    second / energy - (first / energy).powi(2)
}

/// Σ w_n² (n/N)^power.
fn moment(samples: &[f64], power: i32) -> f64 {
    let terms = samples.iter().enumerate();
    terms.map(|(n, w)| w * w * (n as f64 / samples.len() as f64).powi(power)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Harris 1978, table I: coherent gain, noise bandwidth and half-power width in bins; all to
    /// two figures behind the point.
    const HARRIS: [(Window, f64, f64, f64); 4] = [
        (Window::Rectangular, 1.0, 1.0, 0.89),
        (Window::Hann, 0.5, 1.5, 1.44),
        (Window::Hamming, 0.54, 1.36, 1.30),
        (Window::BlackmanHarris, 0.36, 2.0, 1.90),
    ];
    const ROUNDING: f64 = 0.006;

    #[test]
    fn figures_of_merit_match_the_published_table() {
        for (window, gain, bandwidth, width) in HARRIS {
            let samples = window.samples(4096);
            assert!((coherent_gain(&samples) - gain).abs() < ROUNDING, "{window:?}");
            assert!((noise_bandwidth_bins(&samples) - bandwidth).abs() < ROUNDING, "{window:?}");
            let found = window.half_power_width_bins();
            assert!((found - width).abs() < ROUNDING, "{window:?}: {found}");
        }
    }

    #[test]
    fn no_side_lobe_is_higher_than_stated_and_none_begins_before_the_first_zero() {
        for window in Window::ALL {
            let top = window.transform(0.0).powi(2);
            let power = |bins: f64| window.transform(bins).powi(2) / top;
            let zero = window.first_zero_bins();
            assert!(window.transform(zero).abs() < 1e-15, "{window:?}");
            assert!((0..1000).all(|k| window.transform(1e-3 * f64::from(k) * zero) > 0.0));
            let lobes = (0..20_000).map(|k| power(zero + 1e-3 * f64::from(k)));
            let highest = lobes.fold(0.0, f64::max);
            let stated = window.side_lobe_ratio();
            assert!(highest < stated && highest > 0.6 * stated, "{window:?}: {highest}");
        }
    }

    #[test]
    fn a_window_starts_low_and_peaks_in_the_middle() {
        for window in Window::ALL {
            let samples = window.samples(64);
            assert!((samples[32] - 1.0).abs() < 1e-12, "{window:?}");
            assert!((1..64).all(|n| (samples[n] - samples[64 - n]).abs() < 1e-12));
            assert!(samples.iter().all(|&w| w > -1e-12 && w < 1.0 + 1e-12));
        }
        assert!(Window::Hann.samples(64)[0].abs() < 1e-12);
    }

    #[test]
    fn energy_spread_has_its_closed_forms() {
        // ∫x²dx over ±½.
        let rectangular = energy_spread(&Window::Rectangular.samples(4096));
        assert!((rectangular - 1.0 / 12.0).abs() < 1e-6, "{rectangular}");
        // cos⁴(πx) = 3/8 + cos(2πx)/2 + cos(4πx)/8, and ∫x²cos(2πkx)dx over ±½ = (−1)ᵏ/(2π²k²).
        let hann = 1.0 / 12.0 + (-0.5 + 0.125 / 4.0) / (2.0 * PI * PI) / 0.375;
        let found = energy_spread(&Window::Hann.samples(4096));
        assert!((found - hann).abs() < 1e-6, "{found} {hann}");
    }
}
