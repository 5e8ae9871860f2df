//! How a range receiver reads an echo that spreads over its range cells.
//!
//! Its power is that of the strongest peak of the spectrum. Of an echo whose paths spread in range a peak holds a part, and it is the
//! strongest of several cells with speckles of their own: it has less power than the echo, and scatters less. Both are drawn with
//! the receiver's own processing, once for a normal distribution of the ranges.

use num_complex::Complex;
use rayon::prelude::*;

use crate::radar::random::{Key, Purpose};
use crate::radar::{Chirp, Radar, RadarError, RangeProcessor, Receiver, Return};

/// Spreads of which peaks are drawn: in cells of c/2B, in proportion to the squares of 0, 1, 2 …
const KNOTS: usize = 11;
const MOST_CELLS: f64 = 4.0;
/// Draws of a spread for one look, and the fewest: at four looks the mean is then right to 1 %, and the looks to 4 %, and
/// those of a narrow echo are exact.
const DRAWS: f64 = 6000.0;
const LEAST_DRAWS: usize = 500;
/// Tones that stand for a spread, and how far they reach, in standard deviations.
const TONES: usize = 33;
const REACH: f64 = 3.0;
/// Samples of the drawn sweep. In cells the answer does not depend on their number.
const SAMPLES: usize = 64;
/// Place of the middle of an echo, in cells: between two bins, far from either end of the sweep's ranges.
const MIDDLE: f64 = 32.3;
/// Padding beyond which peaks change no more.
const MOST_PADDING: usize = 4;
/// Distances at which the response is kept, per cell, and how many.
const PER_CELL: f64 = 4.0;
const RESPONSES: usize = 33;

/// The reading of echoes that spread in range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RangeCell {
    /// Length of a cell c/2B, m.
    cell_m: f64,
    /// Power of the peak over that of the echo, and looks of the peak over those of the speckle, over the spread.
    knots: [[f64; 2]; KNOTS],
    /// Power at the peak of a return by another one, by their distance.
    responses: [f64; RESPONSES],
}

impl RangeCell {
    /// The reading by the range receiver of a radar; `None` where it has none.
    ///
    /// # Errors
    /// A setting of the receiver that is out of range.
    pub fn of(radar: &Radar) -> Result<Option<RangeCell>, RadarError> {
        let Some(receiver) = radar.receiver else { return Ok(None) };
        let zero_padding = receiver.zero_padding.min(MOST_PADDING);
        let quiet = Receiver {
            window: receiver.window,
            temperature_k: 0.0,
            zero_padding,
            ..Receiver::default()
        };
        let chirp = Chirp { samples: SAMPLES, ..radar.chirp() };
        let looks = radar.speckle.map_or(1, |speckle| speckle.looks as usize).max(1);
        let spectra =
            Spectra { processor: RangeProcessor::new(&quiet, &chirp, 0.0, 1)?, chirp, looks };
        let knots = std::array::from_fn(|knot| match knot {
            0 => [1.0, 1.0],
            _ => spectra.peak(spread_cells(knot)),
        });
        Ok(Some(RangeCell {
            cell_m: chirp.range_resolution_m(),
            knots,
            responses: spectra.responses(),
        }))
    }

    /// Power of the peak over that of an echo of this spread, m, and factor on the looks of its speckle.
    pub fn peak(&self, spread_m: f64) -> [f64; 2] {
        let place = (spread_m / self.cell_m / MOST_CELLS).max(0.0).sqrt() * (KNOTS - 1) as f64;
        interpolated(&self.knots, place)
    }

    /// Share of a return's power that a peak this far from it, m, holds.
    pub fn response(&self, apart_m: f64) -> f64 {
        let place = apart_m.abs() / self.cell_m * PER_CELL;
        if place >= (RESPONSES - 1) as f64 {
            return 0.0;
        }
        let [share] = interpolated(&self.responses.map(|share| [share]), place);
        share
    }
}

/// The spread of a knot, in cells.
fn spread_cells(knot: usize) -> f64 {
    MOST_CELLS * (knot as f64 / (KNOTS - 1) as f64).powi(2)
}

/// The values at a place between knots; beyond the last, those of the last.
fn interpolated<const N: usize>(knots: &[[f64; N]], place: f64) -> [f64; N] {
    let low = (place as usize).min(knots.len() - 2);
    let share = (place - low as f64).min(1.0);
    std::array::from_fn(|k| (1.0 - share) * knots[low][k] + share * knots[low + 1][k])
}

/// Draws spectra by a receiver without noise.
struct Spectra {
    processor: RangeProcessor,
    chirp: Chirp,
    looks: usize,
}

impl Spectra {
    /// The spectrum of a return of 1 W so many cells from the middle.
    fn of_tone(&self, cells: f64) -> Vec<Complex<f64>> {
        let range_m = (MIDDLE + cells) * self.chirp.range_resolution_m();
        let tone = Return { range_m, amplitude_sqrt_w: Complex::ONE };
        // No range within the sweep's is an error.
        self.processor.spectrum(&self.chirp.beat_signal(&[tone]).unwrap_or_default())
    }

    /// The same with its phase at the bin nearest to the middle turned to 0, so that tones near it add up there.
    fn in_phase(&self, cells: f64) -> Vec<Complex<f64>> {
        let mut spectrum = self.of_tone(cells);
        let turn =
            spectrum.get(self.middle_bin()).map_or(Complex::ONE, |one| Complex::cis(-one.arg()));
        spectrum.iter_mut().for_each(|amplitude| *amplitude *= turn);
        spectrum
    }

    /// The bin nearest to the middle.
    fn middle_bin(&self) -> usize {
        (MIDDLE * self.chirp.range_resolution_m() / self.processor.bin_m()).round() as usize
    }

    /// Mean power of the peak of an echo of 1 W with this spread, W, and its looks over those of the speckle.
    fn peak(&self, spread_cells: f64) -> [f64; 2] {
        let at = |tone: usize| 2.0 * REACH * (tone as f64 / (TONES - 1) as f64 - 0.5);
        let places: Vec<f64> = (0..TONES).map(at).collect();
        let weights: Vec<f64> = places.iter().map(|x| (-0.5 * x * x).exp()).collect();
        let sum: f64 = weights.iter().sum();
        let tones: Vec<(f64, Vec<Complex<f64>>)> = std::iter::zip(&places, &weights)
            .map(|(x, weight)| ((weight / sum).sqrt(), self.in_phase(x * spread_cells)))
            .collect();
        let count = ((DRAWS / (self.looks as f64).sqrt()) as usize).max(LEAST_DRAWS);
        let drawn: Vec<[f64; 2]> =
            (0..count).into_par_iter().map(|draw| self.drawn_peak(&tones, draw)).collect();
        // What the peaks of few draws are off, the echoes are, too.
        let [peak, echo] = [0, 1].map(|which| moments(drawn.iter().map(|powers| powers[which])));
        [peak[0] / echo[0], peak[1] / echo[1]]
    }

    /// Power of the strongest peak of one draw, W, and of its echo without a spread.
    fn drawn_peak(&self, tones: &[(f64, Vec<Complex<f64>>)], draw: usize) -> [f64; 2] {
        let key = Key { seed: 0, chirp: draw as u64, sub_ray: 9, purpose: Purpose::Fit };
        let (mut draws, mut profile_w) = (key.draws(), vec![0.0; tones[0].1.len()]);
        let mut echo_w = 0.0;
        for _ in 0..self.looks {
            let mut spectrum: Vec<Complex<f64>> = vec![Complex::ZERO; profile_w.len()];
            let mut whole: Complex<f64> = Complex::ZERO;
            for (level, tone) in tones {
                let amplitude = *level * draws.complex_gaussian();
                whole += amplitude;
                spectrum.iter_mut().zip(tone).for_each(|(sum, one)| *sum += amplitude * one);
            }
            echo_w += whole.norm_sqr() / self.looks as f64;
            for (power_w, amplitude) in profile_w.iter_mut().zip(spectrum) {
                *power_w += amplitude.norm_sqr() / self.looks as f64;
            }
        }
        [self.processor.peak(&profile_w).map_or(0.0, |peak| peak.power_w), echo_w]
    }

    fn responses(&self) -> [f64; RESPONSES] {
        // A return that lies on the bin has its peak there.
        let bin = self.middle_bin();
        let on_bin = bin as f64 * self.processor.bin_m() / self.chirp.range_resolution_m() - MIDDLE;
        std::array::from_fn(|step| {
            let spectrum = self.of_tone(on_bin + step as f64 / PER_CELL);
            spectrum.get(bin).map_or(0.0, |amplitude| amplitude.norm_sqr())
        })
    }
}

/// Mean of some powers, and the looks of their scatter.
fn moments(powers: impl ExactSizeIterator<Item = f64> + Clone) -> [f64; 2] {
    let count = powers.len() as f64;
    let mean = powers.clone().sum::<f64>() / count;
    let variance = powers.map(|power| (power - mean).powi(2)).sum::<f64>() / count;
    [mean, mean * mean / variance.max(f64::MIN_POSITIVE)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::Speckle;

    fn cell(looks: f64) -> RangeCell {
        let speckle = Some(Speckle { looks, ..Speckle::default() });
        let receiver = Some(Receiver { zero_padding: 4, ..Receiver::default() });
        let radar = Radar { receiver, speckle, ..Radar::default() };
        RangeCell::of(&radar).unwrap().unwrap()
    }

    /// Hann's window: the transform of one return is sinc(x)/(1 − x²) of its top, in cells.
    #[test]
    fn the_response_is_that_of_the_window() {
        let cell = cell(4.0);
        assert!((cell.response(0.0) - 1.0).abs() < 1e-3);
        for cells in [0.5, 1.5, 2.5f64] {
            let x = std::f64::consts::PI * cells;
            let expected = (x.sin() / x / (1.0 - cells * cells)).powi(2);
            let found = cell.response(cells * cell.cell_m);
            assert!((found - expected).abs() < 2e-3, "{cells}: {found} {expected}");
        }
        assert_eq!(cell.response(20.0 * cell.cell_m), 0.0);
    }

    #[test]
    fn a_narrow_echo_is_read_whole_and_a_wide_one_loses_and_calms() {
        for looks in [1.0, 4.0] {
            let cell = cell(looks);
            assert_eq!(cell.peak(0.0), [1.0, 1.0]);
            let [narrow, calm] = cell.peak(0.04 * cell.cell_m);
            assert!((narrow - 1.0).abs() < 0.02 && (calm - 1.0).abs() < 0.03, "{narrow} {calm}");
            let mut before = [1.0, 0.9];
            for cells in [0.64, 1.44, 2.56, 4.0] {
                let [power, looks] = cell.peak(cells * cell.cell_m);
                assert!(power < before[0] && looks > before[1], "{cells}: {power} {looks}");
                before = [power, looks];
            }
            // A single cell holds the share of the mean profile's top, and the strongest of several more.
            let [power, _] = cell.peak(2.0 * cell.cell_m);
            assert!((0.29..0.6).contains(&power), "{power}");
        }
    }
}
