//! Slow change of transmitted power or gain along the scan: with p the share that is over,
//! slope·(p − ½) + Σ curve_k·P_k(2p − 1) + wave_sin·sin(2πnp) + wave_cos·cos(2πnp) dB.
//!
//! P_k are Legendre's polynomials, of which the slope is the first: orthogonal over the scan, so that none makes up for
//! another. They follow a gain that warms up and bends. A wave has at least one period where it is searched: a slower one
//! is nearly a slope, and the two would cancel each other.

use std::f64::consts::TAU;

use crate::effects::effect::{About, Effect, EffectParameter, Level};
use crate::effects::shot::{Shot, Stage};
use crate::units::ratio_from_db;

pub(crate) struct Drift;

/// Fewest waves of a scan in a search.
const FEWEST_WAVES: f64 = 1.0;
/// Position of the number of waves.
const WAVES: usize = 3;

const PARAMETERS: [EffectParameter; 11] = [
    EffectParameter::new("slope_db", "dB", [-20.0, 20.0], 0.0, 0.3),
    EffectParameter::new("wave_sin_db", "dB", [-10.0, 10.0], 0.0, 0.3),
    EffectParameter::new("wave_cos_db", "dB", [-10.0, 10.0], 0.0, 0.3),
    EffectParameter::new("waves_per_scan", "1", [0.3, 5.0], 1.0, 0.1),
    curve("curve2_db"),
    curve("curve3_db"),
    curve("curve4_db"),
    curve("curve5_db"),
    curve("curve6_db"),
    curve("curve7_db"),
    curve("curve8_db"),
];

const fn curve(name: &'static str) -> EffectParameter {
    EffectParameter::new(name, "dB", [-10.0, 10.0], 0.0, 0.3)
}

/// Σ c_k·P_k(x) for k = 2, 3, ... by the recurrence k·P_k = (2k − 1)·x·P_(k−1) − (k − 1)·P_(k−2).
fn curved(coefficients: &[f64], x: f64) -> f64 {
    let (mut before, mut last, mut sum) = (1.0, x, 0.0);
    for (coefficient, k) in coefficients.iter().zip((2..).map(f64::from)) {
        (before, last) = (last, ((2.0 * k - 1.0) * x * last - (k - 1.0) * before) / k);
        sum += coefficient * last;
    }
    sum
}

const ABOUT: About = About {
    name: "drift",
    level: Level::Instrument,
    description: "The transmitted power or the receiver's gain changes slowly while the scan runs. With p for \
         the share of it that is over it changes by slope_db·(p − ½), in dB. A gain that warms up or bends adds Legendre's \
         polynomials of 2p − 1, of degree 2 to 8: curve2_db·P₂ and so on. A periodic one adds a wave: its sine and cosine are 0 \
         and 1 as the scan begins.",
    signature: "The residual follows the number of the chirp. Where the scan goes slowly from one edge of \
         the field to the other, time and height rise together, as in a gain over the field; but that \
         is even about the centre, and places that the mirror passes twice show only drift. Ranges \
         stay right, which motion does not leave.",
    parameters: &PARAMETERS,
    conflicts: &[],
    has_one_form: false,
};

impl Effect for Drift {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn summary(&self, values: &[f64]) -> Option<String> {
        const STEPS: u32 = 500;
        let path = (0..=STEPS).map(|step| gain_db(values, f64::from(step) / f64::from(STEPS)));
        let span_db = path.clone().reduce(f64::max)? - path.reduce(f64::min)?;
        Some(format!("a gain that spans {span_db:.1} dB over the scan"))
    }

    /// A slope; bent; with a wave; any smooth curve.
    fn members(&self) -> &'static [&'static [usize]] {
        &[&[0], &[0, 4, 5], &[0, 1, 2, WAVES], &[0, 4, 5, 6, 7, 8, 9, 10]]
    }

    fn searched(&self, parameter: usize) -> [f64; 2] {
        let EffectParameter { min, max, .. } = PARAMETERS[parameter];
        [if parameter == WAVES { FEWEST_WAVES } else { min }, max]
    }

    fn starts(&self, _stage: &Stage, _shots: &[Shot]) -> Vec<Vec<f64>> {
        let absent = PARAMETERS.map(|known| known.absent);
        let mut starts = vec![absent.to_vec(); 5];
        for (start, waves) in starts.iter_mut().skip(1).zip([1.0, 1.5, 2.0, 3.0]) {
            start[1..=WAVES].copy_from_slice(&[0.3, 0.3, waves]);
        }
        starts.iter_mut().for_each(|start| start[0] = 0.3);
        starts
    }

    fn depends_on_time(&self) -> bool {
        true
    }

    fn gain(&self, values: &[f64], _: &Stage, shot: &Shot) -> f64 {
        ratio_from_db(gain_db(values, shot.progress))
    }
}

/// Change of the gain where a share of the scan is over, dB.
fn gain_db(values: &[f64], progress: f64) -> f64 {
    let [slope_db, sin_db, cos_db, waves, curves @ ..] = values else { return 0.0 };
    let mut gain_db = slope_db * (progress - 0.5) + curved(curves, 2.0 * progress - 1.0);
    if *sin_db != 0.0 || *cos_db != 0.0 {
        let (sin, cos) = (TAU * waves * progress).sin_cos();
        gain_db += sin_db * sin + cos_db * cos;
    }
    gain_db
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::effects::testing::{Bench, db};
    use crate::effects::{entry, resolve};

    fn gain_db(named: &[(usize, f64)], progress: f64) -> f64 {
        let mut values = PARAMETERS.map(|known| known.absent);
        named.iter().for_each(|(place, value)| values[*place] = *value);
        let bench = Bench::plate();
        db(Drift.gain(&values, &bench.stage(), &Shot { progress, ..bench.shots[0] }))
    }

    #[test]
    fn a_slope_is_the_difference_between_the_ends() {
        let slope = [(0, 2.0)];
        assert!((gain_db(&slope, 1.0) - gain_db(&slope, 0.0) - 2.0).abs() < 1e-9);
        assert!(gain_db(&slope, 0.5).abs() < 1e-12);
    }

    #[test]
    fn a_wave_has_its_amplitude_a_quarter_period_on() {
        assert!((gain_db(&[(1, 1.5), (WAVES, 2.0)], 0.125) - 1.5).abs() < 1e-9);
        assert!((gain_db(&[(2, 1.5), (WAVES, 2.0)], 0.25) + 1.5).abs() < 1e-9);
    }

    /// P₂ = (3x² − 1)/2, P₃ = (5x³ − 3x)/2, and every P_k(1) = 1.
    #[test]
    fn the_curves_are_legendres_polynomials() {
        assert!((gain_db(&[(4, 2.0)], 0.75) + 0.25).abs() < 1e-9);
        assert!((gain_db(&[(5, 2.0)], 0.75) + 0.875).abs() < 1e-9);
        for place in 4..PARAMETERS.len() {
            assert!((gain_db(&[(place, 2.0)], 1.0) - 2.0).abs() < 1e-9);
        }
    }

    /// Products of the terms of a member over the scan, over their norms, without the mean, which is a level.
    fn gram(used: &[usize], waves: f64) -> DMatrix<f64> {
        const STEPS: usize = 4_000;
        let of_term = |&place: &usize| {
            let mut values = [0.0; PARAMETERS.len()];
            (values[place], values[WAVES]) = (1.0, waves);
            let path = (0..STEPS).map(|k| super::gain_db(&values, (k as f64 + 0.5) / STEPS as f64));
            let path = DVector::from_iterator(STEPS, path);
            let mean = path.mean();
            path.add_scalar(-mean).normalize()
        };
        let terms: Vec<DVector<f64>> =
            used.iter().filter(|place| **place != WAVES).map(of_term).collect();
        DMatrix::from_fn(terms.len(), terms.len(), |i, j| terms[i].dot(&terms[j]))
    }

    #[test]
    fn slope_and_curves_are_orthogonal() {
        let gram = gram(Drift.members()[3], 1.0);
        assert!((gram - DMatrix::identity(8, 8)).amax() < 1e-4);
    }

    /// The smallest eigenvalue is the factor on the information: 0.22 at one wave, 0.001 at the 0.3 that a scene may state.
    #[test]
    fn no_wave_of_a_search_makes_up_for_the_slope() {
        let least = |waves: f64| gram(&[0, 1, 2], waves).symmetric_eigenvalues().min();
        assert!(least(0.3) < 0.002);
        let [from, to] = Drift.searched(WAVES);
        for k in 0..=80 {
            let waves = from + (to - from) * f64::from(k) / 80.0;
            assert!(least(waves) > 0.2, "{waves}: {}", least(waves));
        }
    }

    /// A gain of 3 dB that settles with a time constant of a tenth of the scan.
    #[test]
    fn few_curves_make_any_warm_up() {
        const STEPS: usize = 400;
        let used = Drift.members()[3];
        let progress = |row: usize| (row as f64 + 0.5) / STEPS as f64;
        let matrix = DMatrix::from_fn(STEPS, used.len() + 1, |row, column| {
            let mut values = [0.0; PARAMETERS.len()];
            match column.checked_sub(1) {
                Some(term) => values[used[term]] = 1.0,
                None => return 1.0,
            }
            super::gain_db(&values, progress(row))
        });
        let path = DVector::from_fn(STEPS, |row, _| 3.0 * (-progress(row) / 0.1).exp());
        let found = matrix.clone().svd(true, true).solve(&path, 1e-12).unwrap();
        let off_db = (matrix * found - path).amax();
        assert!(off_db < 0.01, "{off_db}");
    }

    #[test]
    fn at_rest_it_is_exactly_nothing() {
        for progress in [0.0, 0.3, 1.0] {
            assert_eq!(gain_db(&[], progress), 0.0);
        }
        let slow_wave = [0.3, 1.0, -1.0, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let written = entry(&Drift, &slow_wave);
        assert_eq!(resolve(&[written], Level::Instrument).unwrap()[0].1, slow_wave);
    }
}
