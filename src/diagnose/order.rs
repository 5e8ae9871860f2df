//! A test of the order of the chirps: whether residuals swing with the chirp number.
//!
//! The residuals, of silent chirps too, have at their places among the chirps a spectrum that is flat under a correct model:
//! each line over the mean of its neighbours follows an exponential law. A line far above is a swing in time, which covariates
//! of place and angle do not show.
//!
//! Chirps that share speckle have a spectrum with lines at the turns of the mirror. It is the transform of what pairs of
//! shots share by the distance of their chirp numbers, at one level, over a flat level for the rest. Both levels are the
//! likeliest (Whittle), and each line counts over the level of its place. Speckle of which chirps have no part
//! to themselves, on an even grid, has levels between its lines that this does not follow.

use std::f64::consts::LN_2;

use num_complex::Complex;

use super::residual::ResidualStructure;
use super::shared::SharedSpeckle;
use super::spectrum::{level, transform, weights};
use crate::effects::Shot;

/// Lines on either side of one that its level is taken from, but for the nearest.
const AROUND: usize = 60;
const NEAREST: usize = 2;
/// Variance of a mean of exponential numbers over that of their mean by the median.
const OF_MEDIAN: f64 = 0.48;
/// Chance of the strongest of all lines below which it is reported.
const CHANCE: f64 = 1e-4;
/// Most places per chirp on the target: beyond them chirps are too few in their order.
const MOST_PLACES: usize = 64;
/// Largest residual that counts, in standard deviations.
const MOST: f64 = 3.5;
/// Least level of a line, as a share of the mean: of the shared part a transform may be below 0 by rounding.
const LEAST: f64 = 1e-3;

/// The strongest swing, if chance does not explain it. `sd_db`: scatter of a correct model, dB.
pub(super) fn swing(
    z: &[f64],
    shots: &[Shot],
    shared: &SharedSpeckle,
    sd_db: f64,
) -> Option<ResidualStructure> {
    let count = z.len() as f64;
    let inner: Vec<f64> = z.iter().map(|z| z.clamp(-MOST, MOST)).collect();
    let mean = inner.iter().sum::<f64>() / count;
    let first = shots.iter().map(|shot| shot.chirp).min()?;
    let last = shots.iter().map(|shot| shot.chirp).max()?;
    let places = (last - first) as usize + 1;
    if places > MOST_PLACES * shots.len() {
        return None;
    }
    let mut signal = vec![0.0; places];
    for (shot, z) in shots.iter().zip(&inner) {
        signal[(shot.chirp - first) as usize] += z - mean;
    }
    let lines: Vec<f64> = lines_of(&signal).map(|line| line.norm_sqr() / count).collect();
    if lines.len() <= 2 * AROUND {
        return None;
    }
    let background = if shared.is_any() {
        let by_lag = shared.by_lag(shots, places);
        let of_shared: Vec<f64> =
            lines_of(&by_lag).map(|line| (line.re / count).max(LEAST)).collect();
        let weights = weights(&lines, &of_shared);
        of_shared.iter().map(|shared| level(weights, *shared)).collect()
    } else {
        vec![1.0; lines.len()]
    };
    let flat: Vec<f64> = lines.iter().zip(&background).map(|(line, level)| line / level).collect();
    let found = (0..flat.len()).map(|line| (line, Line::of(&flat, line)));
    let (place, strongest) = found.min_by(|a, b| a.1.chance.total_cmp(&b.1.chance))?;
    let p_value = (flat.len() as f64 * strongest.chance).min(1.0);
    // A swing of amplitude a in z has a line of n·a²/4.
    let beyond = background[place] * (strongest.power - strongest.level).max(0.0);
    let strength_db = sd_db * (2.0 * beyond / count).sqrt();
    let covariate = "order of the chirps".to_owned();
    (p_value < CHANCE).then_some(ResidualStructure { covariate, strength_db, p_value })
}

/// The lines of a signal's spectrum, but for its mean and the highest of an even number of places, which is real.
fn lines_of(signal: &[f64]) -> impl Iterator<Item = Complex<f64>> {
    transform(signal).into_iter().skip(1).take(signal.len().saturating_sub(1) / 2)
}

/// A line of the spectrum.
struct Line {
    power: f64,
    /// Mean power of its neighbours, by their median.
    level: f64,
    /// Probability of as much power by chance.
    chance: f64,
}

impl Line {
    fn of(lines: &[f64], line: usize) -> Line {
        let around = (line.saturating_sub(AROUND)..(line + AROUND + 1).min(lines.len()))
            .filter(|other| other.abs_diff(line) > NEAREST);
        let mut levels: Vec<f64> = around.map(|other| lines[other]).collect();
        let middle = levels.len() / 2;
        let (_, median, _) = levels.select_nth_unstable_by(middle, f64::total_cmp);
        let level = median.max(f64::MIN_POSITIVE) / LN_2;
        // The level of m lines by their median is as uncertain as a mean of 0.48·m.
        let known = OF_MEDIAN * levels.len() as f64;
        let chance = (-known * (lines[line] / level / known).ln_1p()).exp();
        Line { power: lines[line], level, chance }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::shared::ALONE;
    use crate::radar::random::{Key, Purpose};
    use crate::radar::{Chirps, Radar};

    /// The swing that is found in residuals with one of this amplitude and a period in chirps.
    fn found(amplitude: f64, period: f64, seed: u64) -> Option<ResidualStructure> {
        let radar = Radar::default();
        let chirps = Chirps::draw(&radar, |_| Err("no file".to_owned())).unwrap();
        let shots: Vec<Shot> = (0..4000).map(|index| Shot::missed(&chirps, index, 0.0)).collect();
        let z = |index: usize| {
            let key = Key { seed, chirp: index as u64, sub_ray: 0, purpose: Purpose::Fit };
            let phase = std::f64::consts::TAU * index as f64 / period;
            key.draws().gaussian() + amplitude * phase.sin()
        };
        let z: Vec<f64> = (0..shots.len()).map(z).collect();
        swing(&z, &shots, &ALONE, 2.3)
    }

    #[test]
    fn a_swing_is_found_with_its_strength_and_noise_is_none() {
        for (seed, period) in [(1, 7.3), (2, 310.0), (3, 1500.0)] {
            let swing = found(0.25, period, seed).unwrap();
            // A period that does not divide the scan loses up to two thirds of its line to others.
            let share = swing.strength_db / (2.3 * 0.25 / 2f64.sqrt());
            assert!((0.6..1.2).contains(&share), "{period}: {swing:?}");
        }
        assert!((10..110).all(|seed| found(0.0, 10.0, seed).is_none()));
    }

    #[test]
    fn few_chirps_or_chirps_far_apart_have_no_order() {
        assert!(swing(&[], &[], &ALONE, 2.3).is_none());
        let radar = Radar::default();
        let chirps = Chirps::draw(&radar, |_| Err("no file".to_owned())).unwrap();
        let apart: Vec<Shot> =
            [0, u32::MAX].map(|chirp| Shot { chirp, ..Shot::missed(&chirps, 0, 0.0) }).to_vec();
        assert!(swing(&[3.0, -3.0], &apart, &ALONE, 2.3).is_none());
    }
}
