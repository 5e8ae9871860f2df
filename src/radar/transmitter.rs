//! What a real transmitter adds to the beat signal: leakage into the receiver, phase noise, and a sweep that is not
//! linear. All raise the floor beside a strong echo, where the skin next to a mirror is weak.
//!
//! A transmitter whose phase is off by φ(t) turns the beat of an echo that is late by τ by φ(t) − φ(t − τ).
//!
//! - Leakage is an echo of its own, with its power, range and side lobes.
//! - Phase noise of an oscillator that runs freely has the density L(f) = L₁·(f₁/f)², as a power in 1 Hz over that of the
//!   carrier on either side of it. Around the echo it leaves the pedestal 4·sin²(π·f·τ)·L(f): for f far below 1/τ the flat
//!   4π²·τ²·L₁·f₁² (range correlation: Budge and Burt 1993, "Range correlation effects in radars"). In a bin of the
//!   spectrum its power is that times the noise bandwidth of the window, B_n.
//! - A sweep whose frequency is off by Δf·cos(2π·m·t/T) has φ = (Δf·T/m)·sin(2π·m·t/T). The beat is turned by
//!   β·cos(2π·m·(t − τ/2)/T) with β = 2·(Δf·T/m)·sin(π·m·τ/T): paired echoes at m range cells on either side of the echo,
//!   each with J₁²(β) of its power, and others at multiples of m.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use num_complex::Complex;
use rustfft::{Fft, FftPlanner};
use serde::{Deserialize, Serialize};

use super::chirp::{AliasError, Chirp, Return};
use super::error::{RadarError, in_range};
use super::random::Draws;
use crate::units::{SPEED_OF_LIGHT_M_PER_S, ratio_from_db, watts_from_dbm};

/// Power that goes straight from the transmitter to the receiver.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Leakage {
    /// Its power, dBm, from −300 to 100.
    pub power_dbm: f64,
    /// The range of an echo that is as late, m, from 0 to the unambiguous range.
    pub range_m: f64,
}

/// Phase noise that falls by 20 dB per decade.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PhaseNoise {
    /// L₁: density on one side of the carrier, dBc/Hz, from −250 to 0.
    pub level_dbc_per_hz: f64,
    /// f₁: offset from the carrier at which it holds, Hz, from 1 to 1e9.
    pub offset_hz: f64,
}

/// A ripple of the sweep's frequency.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SweepRipple {
    /// Δf: largest error of the frequency, Hz, from 0 to 1e12.
    pub frequency_error_hz: f64,
    /// m: cycles of the ripple in a sweep, from 0.1 to 1e5.
    pub cycles: f64,
}

impl Leakage {
    pub(super) fn validate(&self) -> Result<(), RadarError> {
        let checks = [
            ("receiver.leakage.power_dbm", self.power_dbm, (-300.0, 100.0)),
            ("receiver.leakage.range_m", self.range_m, (0.0, 1e6)),
        ];
        checks.into_iter().try_for_each(in_range)
    }
}

impl PhaseNoise {
    pub(super) fn validate(&self) -> Result<(), RadarError> {
        let checks = [
            ("receiver.phase_noise.level_dbc_per_hz", self.level_dbc_per_hz, (-250.0, 0.0)),
            ("receiver.phase_noise.offset_hz", self.offset_hz, (1.0, 1e9)),
        ];
        checks.into_iter().try_for_each(in_range)
    }

    /// L(f), 1/Hz.
    pub fn density_per_hz(&self, offset_hz: f64) -> f64 {
        ratio_from_db(self.level_dbc_per_hz) * (self.offset_hz / offset_hz).powi(2)
    }
}

impl SweepRipple {
    pub(super) fn validate(&self) -> Result<(), RadarError> {
        let checks = [
            ("receiver.sweep_ripple.frequency_error_hz", self.frequency_error_hz, (0.0, 1e12)),
            ("receiver.sweep_ripple.cycles", self.cycles, (0.1, 1e5)),
        ];
        checks.into_iter().try_for_each(in_range)
    }

    /// β: largest turn of the beat of an echo that is late by τ, s, in rad.
    pub fn turn_rad(&self, chirp: &Chirp, delay_s: f64) -> f64 {
        let phase_rad = self.frequency_error_hz * chirp.duration_s / self.cycles;
        2.0 * phase_rad * (PI * self.cycles * delay_s / chirp.duration_s).sin()
    }
}

/// A transmitter ready to send one kind of chirp.
#[derive(Clone)]
pub(super) struct Transmitter {
    pub chirp: Chirp,
    pub leakage: Option<Leakage>,
    pub phase_noise: Option<PhaseNoise>,
    pub ripple: Option<SweepRipple>,
    to_time: Arc<dyn Fft<f64>>,
}

impl Transmitter {
    /// A transmitter of this chirp with these faults.
    pub fn new(
        chirp: Chirp,
        leakage: Option<Leakage>,
        phase_noise: Option<PhaseNoise>,
        ripple: Option<SweepRipple>,
    ) -> Transmitter {
        let to_time = FftPlanner::new().plan_fft_inverse(chirp.samples);
        Transmitter { chirp, leakage, phase_noise, ripple, to_time }
    }

    /// The beat signal of the returns of one sweep, √W.
    pub fn beat_signal(
        &self,
        returns: &[Return],
        draws: &mut Draws,
    ) -> Result<Vec<Complex<f64>>, AliasError> {
        let mut all = returns.to_vec();
        all.extend(self.leakage.map(|Leakage { power_dbm, range_m }| Return {
            range_m,
            amplitude_sqrt_w: Complex::from(watts_from_dbm(power_dbm).sqrt()),
        }));
        if self.phase_noise.is_none() && self.ripple.is_none() {
            return self.chirp.beat_signal(&all);
        }
        let spectrum = self.phase_noise.map(|noise| self.phase_spectrum_rad(noise, draws));
        let mut signal = vec![Complex::ZERO; self.chirp.samples];
        for echo in all {
            let beat = self.chirp.beat_signal(&[echo])?;
            let delay_s = 2.0 * echo.range_m / SPEED_OF_LIGHT_M_PER_S;
            let turns_rad = self.turns_rad(delay_s, spectrum.as_deref());
            for ((sum, beat), turn_rad) in signal.iter_mut().zip(beat).zip(turns_rad) {
                *sum += beat * Complex::cis(turn_rad);
            }
        }
        Ok(signal)
    }

    /// φ(t) − φ(t − τ) at every sample, rad.
    fn turns_rad(&self, delay_s: f64, spectrum_rad: Option<&[Complex<f64>]>) -> Vec<f64> {
        let Chirp { samples, duration_s, .. } = self.chirp;
        let mut turns_rad = vec![0.0; samples];
        if let Some(spectrum_rad) = spectrum_rad {
            let mut turns = spectrum_rad.to_vec();
            for (bin, turn) in turns.iter_mut().enumerate() {
                let offset_hz = self.offset_hz(bin);
                *turn *= 1.0 - Complex::cis(-TAU * offset_hz * delay_s);
            }
            self.to_time.process(&mut turns);
            turns_rad.iter_mut().zip(turns).for_each(|(sum, turn)| *sum += turn.re);
        }
        if let Some(ripple) = self.ripple {
            let largest_rad = ripple.turn_rad(&self.chirp, delay_s);
            for (n, sum) in turns_rad.iter_mut().enumerate() {
                let time_s = (n as f64 / samples as f64 - 0.5) * duration_s;
                let angle_rad = TAU * ripple.cycles * (time_s - 0.5 * delay_s) / duration_s;
                *sum += largest_rad * angle_rad.cos();
            }
        }
        turns_rad
    }

    /// The Fourier coefficients of the phase of one sweep, rad: circular Gaussian with the mean square L(f)/T on either
    /// side. The sweep is taken as periodic, which a window hides.
    fn phase_spectrum_rad(&self, noise: PhaseNoise, draws: &mut Draws) -> Vec<Complex<f64>> {
        let count = self.chirp.samples;
        let mut spectrum_rad = vec![Complex::ZERO; count];
        for bin in 1..count.div_ceil(2) {
            let density_s = noise.density_per_hz(self.offset_hz(bin)) / self.chirp.duration_s;
            let coefficient_rad = draws.complex_gaussian() * density_s.sqrt();
            spectrum_rad[bin] = coefficient_rad;
            spectrum_rad[count - bin] = coefficient_rad.conj();
        }
        spectrum_rad
    }

    /// Frequency of a bin of the spectrum, Hz, below 0 in its upper half.
    fn offset_hz(&self, bin: usize) -> f64 {
        let count = self.chirp.samples;
        let signed = if 2 * bin < count { bin as f64 } else { bin as f64 - count as f64 };
        signed / self.chirp.duration_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::random::{Key, Purpose};
    use crate::radar::{RangeProcessor, Receiver, Window};
    use crate::units::db_from_ratio;

    const CHIRP: Chirp = Chirp {
        centre_frequency_hz: 300e9,
        bandwidth_hz: 27e9,
        duration_s: 100e-6,
        samples: 1024,
        start_phase_rad: 0.0,
    };
    const POWER_W: f64 = 1e-6;

    fn draws(chirp: u64) -> Draws {
        Key { seed: 2, chirp, sub_ray: 0, purpose: Purpose::Noise }.draws()
    }

    /// An echo in the middle of a bin of the unpadded spectrum.
    fn echo(bin: usize, power_w: f64) -> Return {
        let range_m = bin as f64 * CHIRP.range_resolution_m();
        Return { range_m, amplitude_sqrt_w: Complex::from(power_w.sqrt()) }
    }

    fn quiet(window: Window) -> Receiver {
        Receiver { window, zero_padding: 1, temperature_k: 0.0, ..Receiver::default() }
    }

    fn profile_w(receiver: &Receiver, returns: &[Return], chirp: u64) -> Vec<f64> {
        let processor = RangeProcessor::new(receiver, &CHIRP, -200.0, 1).unwrap();
        processor.profile_w(&processor.beat_signal(returns, &mut draws(chirp)).unwrap())
    }

    /// Bessel's J_n by its integral, (1/π)·∫cos(nx − β·sin x) dx over half a turn.
    fn bessel(order: f64, beta: f64) -> f64 {
        const STEPS: u32 = 2000;
        let angle = |step: u32| PI * (f64::from(step) + 0.5) / f64::from(STEPS);
        (0..STEPS).map(|s| (order * angle(s) - beta * angle(s).sin()).cos()).sum::<f64>()
            / f64::from(STEPS)
    }

    #[test]
    fn a_rippled_sweep_gives_paired_echoes() {
        // The echo at 3.33 m is late by 22 ns: β = 2π·Δf·τ.
        for frequency_error_hz in [1e5, 2e6, 1e7] {
            let ripple = SweepRipple { frequency_error_hz, cycles: 40.0 };
            let receiver = Receiver { sweep_ripple: Some(ripple), ..quiet(Window::Rectangular) };
            let profile_w = profile_w(&receiver, &[echo(600, POWER_W)], 0);
            let delay_s = 2.0 * echo(600, POWER_W).range_m / SPEED_OF_LIGHT_M_PER_S;
            let beta = ripple.turn_rad(&CHIRP, delay_s);
            assert!((beta / (TAU * frequency_error_hz * delay_s) - 1.0).abs() < 1e-3, "{beta}");
            for (bin, order) in [(600, 0.0), (640, 1.0), (560, 1.0), (680, 2.0), (520, 2.0)] {
                let expected = bessel(order, beta).powi(2);
                let found = profile_w[bin] / POWER_W;
                assert!((found - expected).abs() < 1e-9 + 1e-6 * expected, "{bin}: {found}");
            }
        }
    }

    #[test]
    fn the_turn_is_the_difference_of_two_phases() {
        let ripple = SweepRipple { frequency_error_hz: 3e6, cycles: 7.5 };
        let transmitter = Transmitter::new(CHIRP, None, None, Some(ripple));
        let size_rad = ripple.frequency_error_hz * CHIRP.duration_s / ripple.cycles;
        let phase_rad = |t_s: f64| size_rad * (TAU * ripple.cycles * t_s / CHIRP.duration_s).sin();
        let delay_s = 53e-9;
        for (n, turn_rad) in transmitter.turns_rad(delay_s, None).into_iter().enumerate() {
            let t_s = (n as f64 / 1024.0 - 0.5) * CHIRP.duration_s;
            let expected_rad = phase_rad(t_s) - phase_rad(t_s - delay_s);
            assert!((turn_rad - expected_rad).abs() < 1e-9, "{n}: {turn_rad} {expected_rad}");
        }
    }

    #[test]
    fn phase_noise_leaves_its_pedestal() {
        const SWEEPS: u64 = 300;
        let noise = PhaseNoise { level_dbc_per_hz: -85.0, offset_hz: 1e5 };
        let receiver = Receiver { phase_noise: Some(noise), ..quiet(Window::Hann) };
        let mut mean_w = vec![0.0; CHIRP.samples];
        for sweep in 0..SWEEPS {
            let profile_w = profile_w(&receiver, &[echo(500, POWER_W)], sweep);
            mean_w.iter_mut().zip(profile_w).for_each(|(sum, w)| *sum += w / SWEEPS as f64);
        }
        let delay_s = 2.0 * echo(500, POWER_W).range_m / SPEED_OF_LIGHT_M_PER_S;
        for away in [40usize, 150, 400] {
            let offset_hz = away as f64 / CHIRP.duration_s;
            let expected = 4.0
                * (PI * offset_hz * delay_s).sin().powi(2)
                * noise.density_per_hz(offset_hz)
                * 1.5
                / CHIRP.duration_s;
            let around = [500 - away, 500 + away].map(|bin| &mean_w[bin - 10..=bin + 10]);
            let found = around.iter().flat_map(|bins| bins.iter()).sum::<f64>() / 42.0 / POWER_W;
            // Powers of 42 bins, of which the window joins three to one, from 300 sweeps: 1.5 % and five of that.
            assert!((found / expected - 1.0).abs() < 0.08, "{away}: {found} {expected}");
        }
        // Far below 1/τ it is flat: 4π²·τ²·L₁·f₁².
        let flat =
            4.0 * (PI * delay_s * noise.offset_hz).powi(2) * ratio_from_db(noise.level_dbc_per_hz);
        let near = 4.0 * (PI * 1e5 * delay_s).sin().powi(2) * noise.density_per_hz(1e5);
        assert!((near / flat - 1.0).abs() < 1e-4);
    }

    #[test]
    fn noise_beside_a_mirror_hides_the_skin_behind_it() {
        let noise = PhaseNoise { level_dbc_per_hz: -70.0, offset_hz: 1e5 };
        let skin_w = 1e-13;
        let clean = quiet(Window::BlackmanHarris);
        let noisy = Receiver { phase_noise: Some(noise), ..clean };
        for (receiver, is_seen) in [(clean, true), (noisy, false)] {
            let profile_w = profile_w(&receiver, &[echo(500, POWER_W), echo(530, skin_w)], 1);
            let beside_w: f64 = profile_w[535..600].iter().sum::<f64>() / 65.0;
            assert_eq!(db_from_ratio(skin_w / beside_w) > 10.0, is_seen, "{beside_w}");
        }
    }

    #[test]
    fn leakage_is_an_echo_at_its_range() {
        let leakage = Leakage { power_dbm: -40.0, range_m: 20.0 * CHIRP.range_resolution_m() };
        let receiver = Receiver { leakage: Some(leakage), ..quiet(Window::Hann) };
        let profile_w = profile_w(&receiver, &[], 0);
        assert!((profile_w[20] / 1e-7 - 1.0).abs() < 1e-9);
        let outside = Leakage { range_m: 6.0, ..leakage };
        let receiver = Receiver { leakage: Some(outside), ..receiver };
        let processor = RangeProcessor::new(&receiver, &CHIRP, -200.0, 1).unwrap();
        assert!(processor.beat_signal(&[], &mut draws(0)).is_err());
    }

    #[test]
    fn without_faults_the_beat_is_the_chirp_s() {
        let processor = RangeProcessor::new(&quiet(Window::Hann), &CHIRP, -200.0, 1).unwrap();
        let returns = [echo(100, POWER_W), echo(230, 3e-9)];
        let found = processor.beat_signal(&returns, &mut draws(0)).unwrap();
        assert_eq!(found, CHIRP.beat_signal(&returns).unwrap());
    }

    #[test]
    fn a_setting_without_meaning_is_named() {
        let text = |receiver: Receiver| receiver.validate().unwrap_err().to_string();
        let leakage = Some(Leakage { power_dbm: 200.0, range_m: 0.1 });
        assert!(text(Receiver { leakage, ..Receiver::default() }).contains("leakage.power_dbm"));
        let phase_noise = Some(PhaseNoise { level_dbc_per_hz: 3.0, offset_hz: 1e5 });
        let loud = Receiver { phase_noise, ..Receiver::default() };
        assert!(text(loud).contains("phase_noise.level_dbc_per_hz = 3"));
        let sweep_ripple = Some(SweepRipple { frequency_error_hz: 1e6, cycles: 0.0 });
        let still = Receiver { sweep_ripple, ..Receiver::default() };
        assert!(text(still).contains("sweep_ripple.cycles = 0"));
    }
}
