//! The frequency-modulated chirp and the beat signal of its echoes.
//!
//! A linear sweep over B in time T about f_c has the phase 2π(f_c t + B t²/2T) for |t| ≤ T/2. An
//! echo from range R comes back late by τ = 2R/c. Mixed with what is being sent (homodyne, "stretch
//! processing": Caputi 1971, DOI 10.1109/TAES.1971.310366), it leaves
//!
//! s(t) = a · exp j(2π f_b t + 4πR f_c/c − πBτ²/T + φ₀),  f_b = Bτ/T = 2BR/(cT).
//!
//! The third term is the residual video phase. It is kept: it is part of the exact phase, and costs
//! nothing. What is left out is the part τ/T of the sweep in which sent and received chirp do not
//! overlap (5·10⁻⁴ at 8 m and 100 µs). Curvature of the sweep and phase noise are in
//! [`transmitter`](super::transmitter).
//!
//! Sampling is complex (I and Q). All of 0 … N/T is then usable, and the unambiguous range is
//! cN/2B; real sampling would halve it and add the noise of the image band.

use num_complex::Complex;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::error::{RadarError, in_range};
use super::tone::{Signal, Tone};
use crate::units::SPEED_OF_LIGHT_M_PER_S;

/// One sweep and its sampling.
///
/// Ranges are geometric: the refractive index of air, 1.0003, is taken as 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chirp {
    /// Centre frequency f_c, Hz, from 1e9 to 1e13. 300e9: paper.
    pub centre_frequency_hz: f64,
    /// Swept bandwidth B, Hz, from 1e6 to twice the centre frequency. 27e9: see
    /// [`Radar`](super::Radar).
    pub bandwidth_hz: f64,
    /// Duration T of the sweep, s, from 1e-9 to 1. 100e-6: assumed, half of the chirp period.
    pub duration_s: f64,
    /// Complex samples N in a sweep, from 8 to 2²⁰. 4096: assumed; 22.7 m are then unambiguous, and
    /// the sampling rate N/T is 41 MHz.
    pub samples: usize,
    /// φ₀: phase of every beat at zero range, rad. 0: assumed; only differences of phase are seen.
    pub start_phase_rad: f64,
}

/// How a sweep is sampled, as scene files write it; its band is the radar's.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ChirpEntry {
    /// Duration T of the sweep, s, from 1e-9 to the chirp period. 100e-6: assumed, half of it.
    pub duration_s: f64,
    /// Complex samples N in a sweep, from 8 to 2²⁰. 4096: assumed.
    pub samples: usize,
}

impl Default for ChirpEntry {
    fn default() -> Self {
        let Chirp { duration_s, samples, .. } = Chirp::default();
        ChirpEntry { duration_s, samples }
    }
}

/// An echo: where it comes from and how strong it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Return {
    /// One-way range, m.
    pub range_m: f64,
    /// Complex amplitude a in √W; |a|² is the received power, and its phase is that of the
    /// reflection alone.
    pub amplitude_sqrt_w: Complex<f64>,
}

/// A return that the sampling would put at another range.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error(
    "a return at {range_m:.3} m is {:.3} m outside the unambiguous range of 0 to {max_range_m:.3} m \
     and would appear at {apparent_range_m:.3} m; give radar.chirp.samples = {samples_needed} or more, \
     or move what returns it",
    excess_m(*range_m, *max_range_m)
)]
pub struct AliasError {
    /// Where the return is, m.
    pub range_m: f64,
    /// First range that is ambiguous, m.
    pub max_range_m: f64,
    /// Where it would be seen, m.
    pub apparent_range_m: f64,
    /// Samples of a chirp that would tell it apart.
    pub samples_needed: usize,
}

fn excess_m(range_m: f64, max_range_m: f64) -> f64 {
    if range_m < 0.0 { -range_m } else { range_m - max_range_m }
}

impl Default for Chirp {
    fn default() -> Self {
        Chirp {
            centre_frequency_hz: 300e9,
            bandwidth_hz: 27e9,
            duration_s: 100e-6,
            samples: 4096,
            start_phase_rad: 0.0,
        }
    }
}

impl Chirp {
    /// Checks every setting against the range in which it has a meaning.
    ///
    /// # Errors
    /// The first setting out of range, by name.
    pub fn validate(&self) -> Result<(), RadarError> {
        let two_carriers_hz = 2.0 * self.centre_frequency_hz;
        let checks = [
            ("chirp.centre_frequency_hz", self.centre_frequency_hz, (1e9, 1e13)),
            ("chirp.bandwidth_hz", self.bandwidth_hz, (1e6, two_carriers_hz)),
            ("chirp.duration_s", self.duration_s, (1e-9, 1.0)),
            ("chirp.samples", self.samples as f64, (8.0, 1_048_576.0)),
            ("chirp.start_phase_rad", self.start_phase_rad, (-1e3, 1e3)),
        ];
        checks.into_iter().try_for_each(in_range)
    }

    /// c/2B, m: the range that turns the beat by one cycle over the sweep.
    pub fn range_resolution_m(&self) -> f64 {
        SPEED_OF_LIGHT_M_PER_S / (2.0 * self.bandwidth_hz)
    }

    /// First ambiguous range of complex sampling, cN/2B, m.
    pub fn max_range_m(&self) -> f64 {
        self.samples as f64 * self.range_resolution_m()
    }

    /// Rate of the complex samples N/T, Hz; also the bandwidth of the noise that they hold.
    pub fn sample_rate_hz(&self) -> f64 {
        self.samples as f64 / self.duration_s
    }

    /// Beat frequency f_b = 2BR/(cT), Hz.
    pub fn beat_frequency_hz(&self, range_m: f64) -> f64 {
        range_m / self.range_resolution_m() / self.duration_s
    }

    /// Phase of the beat in the middle of the sweep, rad, not wrapped.
    pub fn phase_rad(&self, range_m: f64) -> f64 {
        use std::f64::consts::{PI, TAU};
        let delay_s = 2.0 * range_m / SPEED_OF_LIGHT_M_PER_S;
        let residual_video_rad = PI * self.bandwidth_hz * delay_s * delay_s / self.duration_s;
        TAU * self.centre_frequency_hz * delay_s - residual_video_rad + self.start_phase_rad
    }

    /// Samples of the beat signal of several returns, √W, at t = (n/N − ½)T.
    ///
    /// No returns give silence.
    ///
    /// # Errors
    /// When a return lies outside the unambiguous range, by how much.
    pub fn beat_signal(&self, returns: &[Return]) -> Result<Vec<Complex<f64>>, AliasError> {
        let mut signal = Signal::silence(self.samples);
        for echo in returns {
            self.check_range(echo.range_m)?;
            signal.add(self.tone(echo));
        }
        Ok(signal.samples())
    }

    /// Whether a return at a range keeps its place.
    ///
    /// # Errors
    /// When it lies outside the unambiguous range, by how much.
    pub fn check_range(&self, range_m: f64) -> Result<(), AliasError> {
        let max_range_m = self.max_range_m();
        if (0.0..max_range_m).contains(&range_m) {
            return Ok(());
        }
        Err(AliasError {
            range_m,
            max_range_m,
            apparent_range_m: range_m.rem_euclid(max_range_m),
            samples_needed: (range_m / self.range_resolution_m()).floor() as usize + 1,
        })
    }

    /// The beat of one return.
    fn tone(&self, echo: &Return) -> Tone {
        let cycles = self.beat_frequency_hz(echo.range_m) * self.duration_s;
        let first_rad = self.phase_rad(echo.range_m) - std::f64::consts::PI * cycles;
        Tone {
            first: echo.amplitude_sqrt_w * Complex::cis(first_rad),
            step_rad: std::f64::consts::TAU * cycles / self.samples as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn echo(range_m: f64) -> Return {
        Return { range_m, amplitude_sqrt_w: Complex::new(2.0, 0.0) }
    }

    #[test]
    fn the_default_has_the_numbers_of_its_documentation() {
        let chirp = Chirp::default();
        chirp.validate().unwrap();
        assert!((chirp.range_resolution_m() - 5.5517e-3).abs() < 1e-7);
        assert!((chirp.max_range_m() - 22.74).abs() < 0.01);
        assert!((chirp.sample_rate_hz() - 40.96e6).abs() < 1.0);
        // 2 · 27 GHz · 8 m / (c · 100 µs)
        assert!((chirp.beat_frequency_hz(8.0) - 14.409_97e6).abs() < 10.0);
    }

    #[test]
    fn samples_follow_the_difference_of_two_sweeps() {
        // The oracle: phase sent now less phase sent a delay ago, without expanding the square.
        let chirp = Chirp { samples: 64, ..Chirp::default() };
        let sent_rad = |t_s: f64| {
            let slope = chirp.bandwidth_hz / chirp.duration_s;
            std::f64::consts::TAU * (chirp.centre_frequency_hz * t_s + 0.5 * slope * t_s * t_s)
        };
        let range_m = 0.2345;
        let delay_s = 2.0 * range_m / SPEED_OF_LIGHT_M_PER_S;
        let signal = chirp.beat_signal(&[echo(range_m)]).unwrap();
        for (n, sample) in signal.iter().enumerate() {
            let t_s = (n as f64 / 64.0 - 0.5) * chirp.duration_s;
            let exact = 2.0 * Complex::cis(sent_rad(t_s) - sent_rad(t_s - delay_s));
            // The oracle subtracts phases of 1e8 rad.
            assert!((sample - exact).norm() < 1e-6, "{n}: {sample} {exact}");
        }
    }

    #[test]
    fn a_quarter_wavelength_turns_the_echo_round() {
        let chirp = Chirp::default();
        let quarter_m = 0.25 * SPEED_OF_LIGHT_M_PER_S / chirp.centre_frequency_hz;
        let turned_rad = chirp.phase_rad(8.0 + quarter_m) - chirp.phase_rad(8.0);
        // The residual video phase adds some 1e-4 rad.
        assert!((turned_rad - std::f64::consts::PI).abs() < 1e-3, "{turned_rad}");
    }

    #[test]
    fn returns_add_and_keep_their_power() {
        let chirp = Chirp::default();
        let one = chirp.beat_signal(&[echo(8.0)]).unwrap();
        assert!(one.iter().all(|s| (s.norm_sqr() - 4.0).abs() < 1e-9));
        let other = chirp.beat_signal(&[echo(3.0)]).unwrap();
        let both = chirp.beat_signal(&[echo(8.0), echo(3.0)]).unwrap();
        assert!((0..4096).all(|n| (both[n] - one[n] - other[n]).norm() < 1e-9));
        assert!(chirp.beat_signal(&[]).unwrap().iter().all(|s| s.norm() == 0.0));
    }

    #[test]
    fn an_aliased_return_is_named_with_its_excess() {
        let chirp = Chirp::default();
        let error = chirp.beat_signal(&[echo(8.0), echo(25.0)]).unwrap_err();
        assert_eq!(
            error.to_string(),
            "a return at 25.000 m is 2.260 m outside the unambiguous range of 0 to 22.740 m and \
             would appear at 2.260 m; give radar.chirp.samples = 4504 or more, or move what returns it"
        );
        let error = chirp.beat_signal(&[echo(-0.25)]).unwrap_err();
        assert!(error.to_string().contains("is 0.250 m outside"), "{error}");
        assert!(chirp.beat_signal(&[echo(f64::NAN)]).is_err());
    }

    #[test]
    fn an_aliased_return_would_have_appeared_where_the_error_says() {
        let chirp = Chirp::default();
        let max_m = chirp.max_range_m();
        let beats = |range_m| {
            (0..5).map(move |n| {
                let cycles = chirp.beat_frequency_hz(range_m) * chirp.duration_s;
                Complex::cis(std::f64::consts::TAU * cycles * n as f64 / 4096.0)
            })
        };
        let gap = std::iter::zip(beats(max_m + 2.0), beats(2.0)).map(|(a, b)| (a - b).norm());
        assert!(gap.fold(0.0, f64::max) < 1e-9);
    }

    #[test]
    fn a_setting_without_meaning_is_named() {
        let error = Chirp { samples: 4, ..Chirp::default() }.validate().unwrap_err();
        assert!(error.to_string().contains("chirp.samples = 4"), "{error}");
        assert!(Chirp { duration_s: f64::NAN, ..Chirp::default() }.validate().is_err());
        assert!(Chirp { bandwidth_hz: 700e9, ..Chirp::default() }.validate().is_err());
    }
}
