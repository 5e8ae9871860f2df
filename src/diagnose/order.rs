//! A test of the order of the chirps: whether residuals swing with the chirp number.
//!
//! The residuals of the detections, at their places among the chirps, have a spectrum that is flat under a correct model:
//! each line over its neighbours' median follows an exponential law. A line far above is a swing in time, which covariates
//! of place and angle do not show. Chirps that share speckle have lines at the turns of the mirror, and are not tested.

use std::f64::consts::LN_2;

use num_complex::Complex;
use rustfft::FftPlanner;

use super::observation::Observation;
use super::residual::ResidualStructure;
use super::shared::SharedSpeckle;
use crate::effects::Shot;

/// Lines on either side of one that its level is taken from, but for the nearest.
const AROUND: usize = 60;
const NEAREST: usize = 2;
/// Chance of the strongest of all lines below which it is reported. The level has an error of its own.
const CHANCE: f64 = 1e-5;
/// Most places per detection: beyond them chirps are too few in their order.
const MOST_PLACES: usize = 64;
/// Largest residual that counts, in standard deviations.
const MOST: f64 = 3.5;

/// The strongest swing, if chance does not explain it. `sd_db`: scatter of a correct model, dB.
pub(super) fn swing(
    z: &[f64],
    shots: &[Shot],
    observations: &[Observation],
    shared: &SharedSpeckle,
    sd_db: f64,
) -> Option<ResidualStructure> {
    if shared.is_any() {
        return None;
    }
    let seen = shots.iter().zip(observations).zip(z);
    let seen = seen.filter(|((_, observation), _)| observation.power_w.is_some());
    let detected: Vec<(u32, f64)> =
        seen.map(|((shot, _), z)| (shot.chirp, z.clamp(-MOST, MOST))).collect();
    let count = detected.len() as f64;
    let mean = detected.iter().map(|(_, z)| z).sum::<f64>() / count;
    let first = detected.iter().map(|(chirp, _)| *chirp).min()?;
    let last = detected.iter().map(|(chirp, _)| *chirp).max()?;
    let places = (last - first) as usize + 1;
    if places > MOST_PLACES * detected.len() {
        return None;
    }
    let mut signal = vec![Complex::from(0.0); places];
    for (chirp, z) in &detected {
        signal[(chirp - first) as usize] += z - mean;
    }
    FftPlanner::new().plan_fft_forward(places).process(&mut signal);
    let lines: Vec<f64> =
        signal.iter().skip(1).take(places / 2).map(|line| line.norm_sqr() / count).collect();
    let over = |line: usize| {
        let around = (line.saturating_sub(AROUND)..(line + AROUND + 1).min(lines.len()))
            .filter(|other| other.abs_diff(line) > NEAREST);
        let mut levels: Vec<f64> = around.map(|other| lines[other]).collect();
        let middle = levels.len() / 2;
        let (_, median, _) = levels.select_nth_unstable_by(middle, f64::total_cmp);
        (lines[line], lines[line] * LN_2 / median.max(f64::MIN_POSITIVE))
    };
    if lines.len() <= 2 * AROUND {
        return None;
    }
    let [power, ratio] = (0..lines.len())
        .map(over)
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(power, ratio)| [power, ratio])?;
    let p_value = (lines.len() as f64 * (-ratio).exp()).min(1.0);
    // A swing of amplitude a in z has a line of n·a²/4.
    let strength_db = sd_db * (2.0 * (power - power / ratio).max(0.0) / count).sqrt();
    let covariate = "order of the chirps".to_owned();
    (p_value < CHANCE).then_some(ResidualStructure { covariate, strength_db, p_value })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::shared::ALONE;
    use crate::radar::random::{Key, Purpose};
    use crate::radar::{Chirps, Radar};

    /// The swing that is found in residuals of so many standard deviations with a period of so many chirps; each fifth
    /// chirp is silent.
    fn found(amplitude: f64, period: f64, seed: u64) -> Option<ResidualStructure> {
        let radar = Radar::default();
        let chirps = Chirps::draw(&radar, |_| Err("no file".to_owned())).unwrap();
        let shots: Vec<Shot> = (0..4000).map(|index| Shot::missed(&chirps, index, 0.0)).collect();
        let seen =
            |index: usize| Observation { power_w: (!index.is_multiple_of(5)).then_some(1e-9), range_m: None };
        let observations: Vec<Observation> = (0..shots.len()).map(seen).collect();
        let z = |index: usize| {
            let key = Key { seed, chirp: index as u64, sub_ray: 0, purpose: Purpose::Fit };
            let phase = std::f64::consts::TAU * index as f64 / period;
            key.draws().gaussian() + amplitude * phase.sin()
        };
        let z: Vec<f64> = (0..shots.len()).map(z).collect();
        swing(&z, &shots, &observations, &ALONE, 2.3)
    }

    #[test]
    fn a_swing_is_found_with_its_strength_and_noise_is_none() {
        for (seed, period) in [(1, 7.3), (2, 310.0), (3, 1500.0)] {
            let swing = found(0.2, period, seed).unwrap();
            // A period that does not divide the scan loses up to two thirds of its line to others.
            let share = swing.strength_db / (2.3 * 0.2 / 2f64.sqrt());
            assert!((0.6..1.2).contains(&share), "{period}: {swing:?}");
        }
        assert!((10..60).all(|seed| found(0.0, 10.0, seed).is_none()));
    }
}
