//! From a beat signal to a range and a power.
//!
//! Window → zero padding → Fourier transform → power spectrum |X_k|²/(Σw)², so that a single return
//! of power P at a bin's centre reads P → strongest peak in the range gate → parabola through the
//! logarithms of three bins → threshold. A bin is c/2B of range, over the zero padding.
//!
//! Thermal noise is white over the sampling rate N/T, kTF·N/T in each complex sample, which leaves
//! kTF·B_n in each bin with B_n the window's noise bandwidth over the sweep's duration.
//!
//! Averaged over L looks, the power of noise in a bin is Gamma(L, N₀/L). A false alarm is a peak of
//! it over the threshold T. With u = L·T/N₀ the spectrum of windowed noise, looked at between the
//! bins too, crosses the threshold upwards 2√(πv)·u^(L−½)·e⁻ᵘ/Γ(L) times for each bin of the unpadded
//! spectrum, where v is the variance of n/N under w² (Rice 1945,
//! DOI 10.1002/j.1538-7305.1945.tb00453.x, for L = 1; Sharpe 1978, Adv. Appl. Probab. 10, 373, for
//! any L).
//! Crossings so rare are a Poisson process, which gives P_fa over a gate, and so T.

use std::sync::Arc;

use num_complex::Complex;
use rustfft::{Fft, FftPlanner};
use serde::{Deserialize, Serialize};

use super::chirp::{AliasError, Chirp, Return};
use super::error::{RadarError, in_range};
use super::random::Draws;
use super::transmitter::{Leakage, PhaseNoise, SweepRipple, Transmitter};
use super::window::{self, Window};
use crate::units::{ratio_from_db, watts_from_dbm};

/// Boltzmann's constant, J/K; exact.
pub const BOLTZMANN_J_PER_K: f64 = 1.380_649e-23;

/// How a beat signal is turned into a detection.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Receiver {
    /// Window before the transform. Hann: assumed.
    pub window: Window,
    /// Length of the transform over that of the signal, from 1 to 16. 2: assumed; the table at
    /// [`RangeProcessor::detect`] says what it buys.
    pub zero_padding: usize,
    /// Noise figure F, dB, from 0 to 100. 20: assumed; mixers at 300 GHz have 10 to 25.
    pub noise_figure_db: f64,
    /// Temperature that the noise figure refers to, K, from 0 to 1e5. 290: its definition. 0 makes
    /// a receiver without noise.
    pub temperature_k: f64,
    /// Probability, from 1e-15 to 0.5, that a gate full of thermal noise gives a detection; it then
    /// replaces the radar's threshold. Kept to about 4 % of itself with a zero padding of 2 or more;
    /// without padding the parabola overshoots, and alarms are 10 to 20 % more frequent than asked
    /// (100 000 chirps, P_fa 0.01). None: assumed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub false_alarm_probability: Option<f64>,
    /// Nearest and farthest range of a detection, m; none for all that is unambiguous. None:
    /// assumed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gate_m: Option<[f64; 2]>,
    /// Leakage of the transmitter into the receiver. None: assumed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub leakage: Option<Leakage>,
    /// Phase noise of the transmitter. None: assumed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub phase_noise: Option<PhaseNoise>,
    /// A sweep that is not linear. None: assumed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sweep_ripple: Option<SweepRipple>,
}

/// What a chirp gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detection {
    /// Range, m.
    pub range_m: f64,
    /// Power, W, with whatever noise it holds.
    pub power_w: f64,
}

/// A receiver made ready for one kind of chirp. Any number of threads can share it.
#[derive(Clone)]
pub struct RangeProcessor {
    transmitter: Transmitter,
    /// The window's samples over their sum.
    weights: Vec<f64>,
    transform: Arc<dyn Fft<f64>>,
    bin_m: f64,
    resolution_m: f64,
    gate_bins: [usize; 2],
    noise_per_sample_w: f64,
    noise_per_bin_w: f64,
    threshold_w: f64,
    side_lobe_ratio: f64,
}

impl Default for Receiver {
    fn default() -> Self {
        Receiver {
            window: Window::Hann,
            zero_padding: 2,
            noise_figure_db: 20.0,
            temperature_k: 290.0,
            false_alarm_probability: None,
            gate_m: None,
            leakage: None,
            phase_noise: None,
            sweep_ripple: None,
        }
    }
}

impl Receiver {
    /// Checks every setting against the range in which it has a meaning.
    ///
    /// # Errors
    /// The first setting out of range, by name.
    pub fn validate(&self) -> Result<(), RadarError> {
        let [near_m, far_m] = self.gate_m.unwrap_or([0.0, 1.0]);
        let checks = [
            ("receiver.zero_padding", self.zero_padding as f64, (1.0, 16.0)),
            ("receiver.noise_figure_db", self.noise_figure_db, (0.0, 100.0)),
            ("receiver.temperature_k", self.temperature_k, (0.0, 1e5)),
            ("receiver.gate_m[0]", near_m, (0.0, 1e6)),
            ("receiver.gate_m[1]", far_m, (near_m, 1e6)),
            (
                "receiver.false_alarm_probability",
                self.false_alarm_probability.unwrap_or(0.1),
                (1e-15, 0.5),
            ),
        ];
        checks.into_iter().try_for_each(in_range)?;
        self.leakage.map_or(Ok(()), |leakage| leakage.validate())?;
        self.phase_noise.map_or(Ok(()), |noise| noise.validate())?;
        self.sweep_ripple.map_or(Ok(()), |ripple| ripple.validate())
    }
}

impl RangeProcessor {
    /// Plans the transform and works out noise and threshold, once for all chirps.
    ///
    /// Each detection averages `looks` profiles. `threshold_dbm` holds where the receiver names no
    /// probability of false alarms.
    ///
    /// # Errors
    /// A setting of the receiver or the chirp that is out of range.
    pub fn new(
        receiver: &Receiver,
        chirp: &Chirp,
        threshold_dbm: f64,
        looks: u32,
    ) -> Result<RangeProcessor, RadarError> {
        receiver.validate()?;
        chirp.validate()?;
        let window = receiver.window.samples(chirp.samples);
        let length = chirp.samples * receiver.zero_padding;
        let bin_m = chirp.range_resolution_m() / receiver.zero_padding as f64;
        let gate_bins = gate_bins(receiver.gate_m, bin_m, length);
        let density_w_per_hz =
            BOLTZMANN_J_PER_K * receiver.temperature_k * ratio_from_db(receiver.noise_figure_db);
        let noise_per_bin_w =
            density_w_per_hz * window::noise_bandwidth_bins(&window) / chirp.duration_s;
        let searched = (gate_bins[1] + 1).saturating_sub(gate_bins[0]);
        let natural_bins = searched as f64 / receiver.zero_padding as f64;
        let threshold_w = match receiver.false_alarm_probability {
            None => watts_from_dbm(threshold_dbm),
            Some(probability) => {
                let crossings = natural_bins * crossings_per_bin(&window);
                noise_per_bin_w * threshold_over_noise(probability, crossings, looks.max(1))
            }
        };
        let Receiver { leakage, phase_noise, sweep_ripple, .. } = *receiver;
        let gain: f64 = window.iter().sum();
        Ok(RangeProcessor {
            transmitter: Transmitter::new(*chirp, leakage, phase_noise, sweep_ripple),
            transform: FftPlanner::new().plan_fft_forward(length),
            resolution_m: receiver.window.half_power_width_bins() * chirp.range_resolution_m(),
            noise_per_sample_w: density_w_per_hz * chirp.sample_rate_hz(),
            weights: window.into_iter().map(|sample| sample / gain).collect(),
            bin_m,
            gate_bins,
            noise_per_bin_w,
            threshold_w,
            side_lobe_ratio: receiver.window.side_lobe_ratio(),
        })
    }

    /// Mean thermal power in each bin, kTF·B_n, W.
    pub fn noise_per_bin_w(&self) -> f64 {
        self.noise_per_bin_w
    }

    /// Least power of a detection, W.
    pub fn threshold_w(&self) -> f64 {
        self.threshold_w
    }

    /// Range from one bin of [`profile_w`](Self::profile_w) to the next, m.
    pub fn bin_m(&self) -> f64 {
        self.bin_m
    }

    /// Half-power width of a return in range: c/2B, broadened by the window, m.
    pub fn resolution_m(&self) -> f64 {
        self.resolution_m
    }

    /// The beat signal of the returns of one chirp, √W, with the faults of the transmitter.
    ///
    /// # Errors
    /// When a return or the leakage lies outside the unambiguous range, by how much.
    pub fn beat_signal(
        &self,
        returns: &[Return],
        draws: &mut Draws,
    ) -> Result<Vec<Complex<f64>>, AliasError> {
        self.transmitter.beat_signal(returns, draws)
    }

    /// Adds the thermal noise of one chirp to its beat signal.
    pub fn add_noise(&self, signal: &mut [Complex<f64>], draws: &mut Draws) {
        let amplitude_sqrt_w = self.noise_per_sample_w.sqrt();
        for sample in signal {
            *sample += draws.complex_gaussian() * amplitude_sqrt_w;
        }
    }

    /// The power spectrum over range, W, from 0 in steps of [`bin_m`](Self::bin_m).
    ///
    /// A signal of another length than the chirp's is cut or filled with silence.
    pub fn profile_w(&self, signal: &[Complex<f64>]) -> Vec<f64> {
        self.spectrum(signal).iter().map(Complex::norm_sqr).collect()
    }

    /// The spectrum over range, √W, whose squares are [`profile_w`](Self::profile_w).
    pub fn spectrum(&self, signal: &[Complex<f64>]) -> Vec<Complex<f64>> {
        let mut windowed = vec![Complex::ZERO; self.transform.len()];
        for (bin, (sample, weight)) in windowed.iter_mut().zip(signal.iter().zip(&self.weights)) {
            *bin = sample * weight;
        }
        let mut spectrum = vec![Complex::ZERO; windowed.len()];
        let mut scratch = vec![Complex::ZERO; self.transform.get_outofplace_scratch_len()];
        self.transform.process_outofplace_with_scratch(&mut windowed, &mut spectrum, &mut scratch);
        spectrum
    }

    /// Phase of the beat in the middle of the sweep at a peak of a spectrum, rad, −π to π.
    ///
    /// Samples count from the start of the sweep, half a turn before its middle for every natural bin of range.
    pub fn phase_rad(&self, spectrum: &[Complex<f64>], range_m: f64) -> f64 {
        let bin = (range_m / self.bin_m).round().max(0.0) as usize;
        let natural = bin as f64 * self.weights.len() as f64 / spectrum.len() as f64;
        let start = Complex::cis(std::f64::consts::PI * natural);
        spectrum.get(bin).map_or(0.0, |at_peak| (at_peak * start).arg())
    }

    /// The strongest peak in the gate, if it reaches the threshold.
    ///
    /// The peak is a bin above its neighbours; the flank of a return outside the gate is none. For
    /// a single return without noise and 27 GHz, the largest errors of range (µm) and power (dB)
    /// over all positions between bins are:
    ///
    /// | window | padding 1 | padding 2 | padding 4 |
    /// |---|---|---|---|
    /// | Rectangular | 930, 2.8 | 58, 0.29 | 6, 0.012 |
    /// | Hann | 90, 0.33 | 9.1, 0.014 | 1.1, 0.0009 |
    /// | Hamming | 90, 0.4 | 9.3, 0.018 | 1.2, 0.0011 |
    /// | Blackman–Harris | 18, 0.032 | 2.2, 0.002 | 0.3, 0.0002 |
    pub fn detect(&self, signal: &[Complex<f64>]) -> Option<Detection> {
        self.peak(&self.profile_w(signal)).filter(|peak| peak.power_w >= self.threshold_w)
    }

    /// The strongest peak of a profile in the gate, whatever its power.
    pub fn peak(&self, profile_w: &[f64]) -> Option<Detection> {
        Some(self.interpolate(profile_w, self.strongest_peak(profile_w)?))
    }

    /// Every peak of a profile in the gate at or above the threshold, the nearest first. What could be a side lobe of the
    /// strongest, from its window, is left out.
    pub fn peaks(&self, profile_w: &[f64]) -> Vec<Detection> {
        /// Side lobes are seen between the bins, and add up with what else is there.
        const MARGIN: f64 = 1.25;
        let Some(strongest) = self.peak(profile_w) else { return Vec::new() };
        let side_lobe_w = MARGIN * self.side_lobe_ratio * strongest.power_w;
        // A side lobe is so narrow that a neighbour may fall on its zero, and the parabola then lies far above it.
        let bins = self.bins_of_peaks(profile_w).filter(|&k| profile_w[k] >= side_lobe_w);
        let peaks = bins.map(|k| self.interpolate(profile_w, k));
        peaks.filter(|peak| peak.power_w >= self.threshold_w).collect()
    }

    fn strongest_peak(&self, profile_w: &[f64]) -> Option<usize> {
        self.bins_of_peaks(profile_w).max_by(|&a, &b| profile_w[a].total_cmp(&profile_w[b]))
    }

    fn bins_of_peaks(&self, profile_w: &[f64]) -> impl Iterator<Item = usize> {
        let [first, last] = self.gate_bins;
        (first..=last).filter(|&k| {
            let [before, after] = neighbours(profile_w, k);
            profile_w[k] >= before && profile_w[k] > after
        })
    }

    /// Top of the parabola through the logarithms of a peak and its neighbours.
    fn interpolate(&self, profile_w: &[f64], peak: usize) -> Detection {
        let [before, after] = neighbours(profile_w, peak).map(f64::ln);
        let top = profile_w[peak].ln();
        let offset_bins = 0.5 * (before - after) / (before - 2.0 * top + after);
        // Silence in a neighbour has no logarithm; the bin itself is then the best answer.
        let offset_bins = if offset_bins.is_finite() { offset_bins } else { 0.0 };
        let rise = if offset_bins == 0.0 { 0.0 } else { 0.25 * (after - before) * offset_bins };
        Detection { range_m: (peak as f64 + offset_bins) * self.bin_m, power_w: (top + rise).exp() }
    }
}

/// First and last bin of a gate; an empty span, last before first, where the gate holds none.
fn gate_bins(gate_m: Option<[f64; 2]>, bin_m: f64, length: usize) -> [usize; 2] {
    let Some([near_m, far_m]) = gate_m else { return [0, length - 1] };
    [(near_m / bin_m).ceil() as usize, ((far_m / bin_m).floor() as usize).min(length - 1)]
}

/// Power in the bins before and after; the spectrum is a circle.
fn neighbours(profile_w: &[f64], k: usize) -> [f64; 2] {
    let count = profile_w.len();
    [profile_w[(k + count - 1) % count], profile_w[(k + 1) % count]]
}

/// 2√(πv): upward crossings in a bin of the unpadded spectrum, over u^(L−½)·e⁻ᵘ/Γ(L).
fn crossings_per_bin(window: &[f64]) -> f64 {
    2.0 * (std::f64::consts::PI * window::energy_spread(window)).sqrt()
}

/// T/N₀ at which noise averaged over `looks` raises an alarm with a probability.
fn threshold_over_noise(probability: f64, crossings: f64, looks: u32) -> f64 {
    let shape = f64::from(looks);
    let ln_gamma: f64 = (2..looks).map(|k| f64::from(k).ln()).sum();
    // −ln of the probability that nothing is above the threshold: neither at once nor by crossing.
    let alarms = |u: f64| {
        let density = ((shape - 1.0) * u.ln() - u - ln_gamma).exp();
        // Q(L, u) = e⁻ᵘ·Σ uᵏ/k!, from its last term down.
        let mut term = density;
        let mut above = 0.0;
        for k in (0..looks).rev() {
            above += term;
            term *= f64::from(k) / u;
        }
        crossings * density * u.sqrt() - (-above).ln_1p()
    };
    let asked = -(-probability).ln_1p();
    // The law falls from its mode on, and no probability that is accepted lies below it.
    let (mut low, mut high) = (shape, shape + 1e3 + 10.0 * shape);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if alarms(middle) > asked { low = middle } else { high = middle }
    }
    high / shape
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::random::{Key, Purpose};
    use crate::units::{db_from_ratio, dbm_from_watts};

    const POWER_W: f64 = 1e-9;
    const SHORT: Chirp = Chirp {
        centre_frequency_hz: 300e9,
        bandwidth_hz: 27e9,
        duration_s: 100e-6,
        samples: 64,
        start_phase_rad: 0.0,
    };
    const NOISELESS: Receiver = Receiver {
        window: Window::Hann,
        zero_padding: 2,
        noise_figure_db: 0.0,
        temperature_k: 0.0,
        false_alarm_probability: None,
        gate_m: None,
        leakage: None,
        phase_noise: None,
        sweep_ripple: None,
    };

    fn processor(receiver: &Receiver, chirp: &Chirp) -> RangeProcessor {
        RangeProcessor::new(receiver, chirp, -200.0, 1).unwrap()
    }

    fn echo(range_m: f64) -> Return {
        Return { range_m, amplitude_sqrt_w: Complex::new(POWER_W.sqrt(), 0.0) }
    }

    fn noise(chirp: u64) -> Draws {
        Key { seed: 9, chirp, sub_ray: 0, purpose: Purpose::Noise }.draws()
    }

    /// The table at [`RangeProcessor::detect`].
    const ERRORS: [(Window, [[f64; 2]; 3]); 4] = [
        (Window::Rectangular, [[930.0, 2.8], [58.0, 0.29], [6.0, 0.012]]),
        (Window::Hann, [[90.0, 0.33], [9.1, 0.014], [1.1, 0.0009]]),
        (Window::Hamming, [[90.0, 0.4], [9.3, 0.018], [1.2, 0.0011]]),
        (Window::BlackmanHarris, [[18.0, 0.032], [2.2, 0.002], [0.3, 0.0002]]),
    ];

    /// Largest errors of range (µm) and power (dB) over positions between two bins.
    fn worst_errors(receiver: &Receiver, chirp: &Chirp) -> [f64; 2] {
        let processor = processor(receiver, chirp);
        let middle_m = 0.4 * chirp.max_range_m();
        let errors = (0..200).map(|i| {
            let range_m = middle_m + chirp.range_resolution_m() * i as f64 / 200.0;
            let found = processor.detect(&chirp.beat_signal(&[echo(range_m)]).unwrap()).unwrap();
            let error_um = 1e6 * (found.range_m - range_m).abs();
            [error_um, db_from_ratio(found.power_w / POWER_W).abs()]
        });
        errors.fold([0.0, 0.0], |[a, b], [x, y]| [f64::max(a, x), f64::max(b, y)])
    }

    #[test]
    fn two_returns_are_two_peaks_and_a_side_lobe_is_none() {
        let chirp = Chirp { samples: 256, ..SHORT };
        let processor = RangeProcessor::new(&NOISELESS, &chirp, -100.0, 1).unwrap();
        let peaks = |returns: &[Return]| {
            processor.peaks(&processor.profile_w(&chirp.beat_signal(returns).unwrap()))
        };
        let ranges_m = |found: &[Detection]| found.iter().map(|d| d.range_m).collect::<Vec<_>>();
        // At −31.5 dB the first side lobe of Hann's window is far above the threshold.
        assert_eq!(peaks(&[echo(0.5)]).len(), 1);
        let weak = Return { amplitude_sqrt_w: echo(0.0).amplitude_sqrt_w * 0.1, ..echo(0.53) };
        let found = ranges_m(&peaks(&[echo(0.5), weak]));
        assert!(found.len() == 2 && (found[1] - 0.53).abs() < 1e-3, "{found:?}");
    }

    #[test]
    fn errors_between_bins_stay_within_the_documented_table() {
        let chirp = Chirp { samples: 256, ..SHORT };
        for (window, row) in ERRORS {
            for (zero_padding, [range_um, power_db]) in std::iter::zip([1, 2, 4], row) {
                let receiver = Receiver { window, zero_padding, ..NOISELESS };
                let [found_um, found_db] = worst_errors(&receiver, &chirp);
                assert!(found_um <= range_um, "{window:?} × {zero_padding}: {found_um} µm");
                assert!(found_db <= power_db, "{window:?} × {zero_padding}: {found_db} dB");
            }
        }
    }

    #[test]
    fn the_default_is_good_to_micrometres_at_eight_metres() {
        let chirp = Chirp::default();
        let processor = processor(&Receiver::default(), &chirp);
        let found = processor.detect(&chirp.beat_signal(&[echo(8.001_234)]).unwrap()).unwrap();
        assert!((found.range_m - 8.001_234).abs() < 9.1e-6, "{found:?}");
        assert!(db_from_ratio(found.power_w / POWER_W).abs() < 0.014, "{found:?}");
    }

    #[test]
    fn a_return_at_a_bin_reads_its_power_through_every_window() {
        for window in Window::ALL {
            let receiver = Receiver { window, ..NOISELESS };
            let processor = processor(&receiver, &SHORT);
            let signal = SHORT.beat_signal(&[echo(20.0 * SHORT.range_resolution_m())]).unwrap();
            let profile_w = processor.profile_w(&signal);
            assert!((profile_w[40] / POWER_W - 1.0).abs() < 1e-9, "{window:?}");
        }
    }

    #[test]
    fn the_half_power_width_is_that_of_the_window() {
        // Read off a spectrum padded 16 times, linearly between its bins.
        const READING_BINS: f64 = 0.01;
        for window in Window::ALL {
            let receiver = Receiver { window, zero_padding: 16, ..NOISELESS };
            let processor = processor(&receiver, &SHORT);
            let signal = SHORT.beat_signal(&[echo(20.0 * SHORT.range_resolution_m())]).unwrap();
            let profile_w = processor.profile_w(&signal);
            let last = (320..).find(|&k| profile_w[k + 1] < 0.5 * POWER_W).unwrap();
            let part = (profile_w[last] - 0.5 * POWER_W) / (profile_w[last] - profile_w[last + 1]);
            let width_bins = 2.0 * ((last - 320) as f64 + part) / 16.0;
            assert!((width_bins - window.half_power_width_bins()).abs() < READING_BINS);
            let width_m = width_bins * SHORT.range_resolution_m();
            assert!((processor.resolution_m() / width_m - 1.0).abs() < READING_BINS);
        }
    }

    /// Peaks above half the power of either of two equal returns in quadrature, which is the mean
    /// over their phase difference.
    fn peaks_of_two(separation_cells: f64) -> usize {
        let processor = processor(&Receiver { zero_padding: 16, ..NOISELESS }, &SHORT);
        let near_m = 20.0 * SHORT.range_resolution_m();
        let far_m = near_m + separation_cells * SHORT.range_resolution_m();
        let turn_rad = SHORT.phase_rad(near_m) - SHORT.phase_rad(far_m);
        let mut far = echo(far_m);
        far.amplitude_sqrt_w *= Complex::cis(turn_rad + std::f64::consts::FRAC_PI_2);
        let profile_w = processor.profile_w(&SHORT.beat_signal(&[echo(near_m), far]).unwrap());
        let triples = profile_w.windows(3);
        triples.filter(|p| p[1] > 0.5 * POWER_W && p[1] >= p[0] && p[1] > p[2]).count()
    }

    #[test]
    fn one_and_a_half_cells_are_resolved_and_half_a_cell_is_not() {
        assert_eq!(peaks_of_two(1.5), 2);
        assert_eq!(peaks_of_two(0.5), 1);
    }

    #[test]
    fn thermal_noise_reads_its_closed_form() {
        const CHIRPS: u64 = 1000;
        for window in Window::ALL {
            let receiver = Receiver { window, zero_padding: 1, ..Receiver::default() };
            let processor = processor(&receiver, &SHORT);
            let total: f64 = (0..CHIRPS)
                .map(|chirp| {
                    let mut signal = vec![Complex::ZERO; 64];
                    processor.add_noise(&mut signal, &mut noise(chirp));
                    processor.profile_w(&signal).iter().sum::<f64>() / 64.0
                })
                .sum();
            let ratio = total / CHIRPS as f64 / processor.noise_per_bin_w();
            // By Parseval the mean is one of 64 000 exponential powers weighted by w²: its standard
            // deviation is below √(2/64 000).
            assert!((ratio - 1.0).abs() < 5.0 * (2.0f64 / 64e3).sqrt(), "{window:?}: {ratio}");
        }
        // −174 dBm/Hz (−173.975) + 20 dB + 10 kHz · 1.5 (41.761 dB)
        let processor = processor(&Receiver::default(), &Chirp::default());
        let noise_dbm = dbm_from_watts(processor.noise_per_bin_w());
        assert!((noise_dbm + 112.214).abs() < 0.01, "{noise_dbm}");
    }

    fn false_alarms(receiver: &Receiver, looks: u32, chirps: u64) -> u64 {
        let processor = RangeProcessor::new(receiver, &SHORT, 0.0, looks).unwrap();
        let profile_w = |look: u64| {
            let mut signal = vec![Complex::ZERO; SHORT.samples];
            processor.add_noise(&mut signal, &mut noise(look));
            processor.profile_w(&signal)
        };
        let alarm = |chirp: &u64| {
            let first = chirp * u64::from(looks);
            let mut mean_w = vec![0.0; 2 * SHORT.samples];
            for look in first..first + u64::from(looks) {
                let shares = profile_w(look).into_iter().map(|w| w / f64::from(looks));
                mean_w.iter_mut().zip(shares).for_each(|(sum, share)| *sum += share);
            }
            processor.peak(&mean_w).is_some_and(|peak| peak.power_w >= processor.threshold_w())
        };
        (0..chirps).filter(alarm).count() as u64
    }

    #[test]
    fn false_alarms_come_as_often_as_asked() {
        const CHIRPS: u64 = 20_000;
        for (window, probability) in
            [(Window::Hann, 1e-2), (Window::BlackmanHarris, 1e-2), (Window::Hann, 1e-3)]
        {
            let false_alarm_probability = Some(probability);
            let receiver = Receiver { window, false_alarm_probability, ..Receiver::default() };
            for looks in [1, 4] {
                let expected = probability * CHIRPS as f64;
                let found = false_alarms(&receiver, looks, CHIRPS) as f64;
                // Four standard deviations of a binomial count.
                let gap = (found - expected).abs();
                assert!(gap < 4.0 * expected.sqrt(), "{window:?}, {looks} looks: {found}");
            }
        }
    }

    #[test]
    fn the_threshold_tends_to_that_of_one_look() {
        // One bin and no crossings: −ln P_fa.
        assert!((threshold_over_noise(1e-6, 0.0, 1) + 1e-6f64.ln()).abs() < 1e-5);
        // 100 crossings or so cost ln 100.
        let many = threshold_over_noise(1e-6, 100.0, 1);
        assert!((many - (100.0 * many.sqrt() / 1e-6).ln()).abs() < 0.01, "{many}");
        // A thousand looks leave hardly more than the mean.
        let calm = threshold_over_noise(1e-6, 100.0, 1000);
        assert!(calm > 1.0 && calm < 1.3, "{calm}");
    }

    #[test]
    fn what_is_weak_silent_or_outside_the_gate_is_no_detection() {
        let chirp = Chirp { samples: 2048, ..SHORT };
        let signal = chirp.beat_signal(&[echo(8.0)]).unwrap();
        let above = |receiver: &Receiver, threshold_dbm| {
            RangeProcessor::new(receiver, &chirp, threshold_dbm, 1).unwrap().detect(&signal)
        };
        let detect = |receiver: &Receiver| above(receiver, dbm_from_watts(POWER_W) - 20.0);
        assert!(detect(&NOISELESS).is_some());
        let power_dbm = dbm_from_watts(POWER_W);
        assert!(above(&NOISELESS, power_dbm - 0.1).is_some());
        assert!(above(&NOISELESS, power_dbm + 0.1).is_none());
        let gated = |gate_m| Receiver { gate_m: Some(gate_m), ..NOISELESS };
        assert!(detect(&gated([7.0, 9.0])).is_some());
        // The edge of this gate is on the flank of the return, only 4 dB below its peak.
        assert!(detect(&gated([8.005, 9.0])).is_none());
        assert!(detect(&gated([8.0001, 8.0002])).is_none());
        assert!(detect(&gated([100.0, 200.0])).is_none());
        let processor = processor(&NOISELESS, &chirp);
        assert_eq!(processor.detect(&[Complex::ZERO; 2048]), None);
        assert_eq!(processor.detect(&[]), None);
    }

    #[test]
    fn a_strong_return_outside_the_gate_hides_none_within() {
        let mut strong = echo(0.06);
        strong.amplitude_sqrt_w *= 30.0;
        let receiver =
            Receiver { window: Window::BlackmanHarris, gate_m: Some([0.08, 0.3]), ..NOISELESS };
        let processor = processor(&receiver, &SHORT);
        let signal = SHORT.beat_signal(&[strong, echo(0.2)]).unwrap();
        let found = processor.detect(&signal).unwrap();
        assert!((found.range_m - 0.2).abs() < 20e-6, "{found:?}");
    }

    #[test]
    fn a_setting_without_meaning_is_named() {
        let refused = |receiver: Receiver| {
            RangeProcessor::new(&receiver, &SHORT, 0.0, 1).err().unwrap().to_string()
        };
        let text = refused(Receiver { zero_padding: 0, ..NOISELESS });
        assert!(text.contains("receiver.zero_padding = 0"), "{text}");
        let text = refused(Receiver { gate_m: Some([5.0, 4.0]), ..NOISELESS });
        assert!(text.contains("receiver.gate_m[1] = 4"), "{text}");
        let never = Receiver { false_alarm_probability: Some(0.0), ..NOISELESS };
        assert!(refused(never).contains("false_alarm_probability"));
        let silent = Chirp { samples: 0, ..SHORT };
        assert!(RangeProcessor::new(&NOISELESS, &silent, 0.0, 1).is_err());
    }
}
