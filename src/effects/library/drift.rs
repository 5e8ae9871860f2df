//! Slow change of transmitted power or gain along the scan: with p the share that is over,
//! slope·(p − ½) + wave_sin·sin(2πnp) + wave_cos·cos(2πnp) dB.

use std::f64::consts::TAU;

use crate::effects::effect::{About, Effect, EffectParameter, Level};
use crate::effects::shot::{Shot, Stage};
use crate::units::ratio_from_db;

pub(crate) struct Drift;

const ABOUT: About = About {
    name: "drift",
    level: Level::Instrument,
    description: "The transmitted power or the receiver's gain changes slowly while the scan runs: a slope and \
         one slow wave, in dB.",
    signature: "The residual follows the number of the chirp. Where the scan goes slowly from one edge of \
         the field to the other, time and height rise together, as in a gain over the field; but that \
         is even about the centre, and places that the mirror passes twice show only drift. Ranges \
         stay right, which motion does not leave.",
    parameters: &[
        EffectParameter::new("slope_db", "dB", [-20.0, 20.0], 0.0, 0.3),
        EffectParameter::new("wave_sin_db", "dB", [-10.0, 10.0], 0.0, 0.3),
        EffectParameter::new("wave_cos_db", "dB", [-10.0, 10.0], 0.0, 0.3),
        EffectParameter::new("waves_per_scan", "1", [0.3, 5.0], 1.0, 0.1),
    ],
    conflicts: &[],
};

impl Effect for Drift {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn starts(&self, _stage: &Stage, _shots: &[Shot]) -> Vec<Vec<f64>> {
        [0.5, 1.0, 1.5, 2.0, 3.0].map(|waves| vec![0.3, 0.3, 0.3, waves]).to_vec()
    }

    fn depends_on_time(&self) -> bool {
        true
    }

    fn gain(&self, values: &[f64], _: &Stage, shot: &Shot) -> f64 {
        let &[slope_db, sin_db, cos_db, waves] = values else { return 1.0 };
        let (sin, cos) = (TAU * waves * shot.progress).sin_cos();
        ratio_from_db(slope_db * (shot.progress - 0.5) + sin_db * sin + cos_db * cos)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, db};

    fn gain_db(values: [f64; 4], progress: f64) -> f64 {
        let bench = Bench::plate();
        db(Drift.gain(&values, &bench.stage(), &Shot { progress, ..bench.shots[0] }))
    }

    #[test]
    fn a_slope_is_the_difference_between_the_ends() {
        let slope = [2.0, 0.0, 0.0, 1.0];
        assert!((gain_db(slope, 1.0) - gain_db(slope, 0.0) - 2.0).abs() < 1e-9);
        assert!(gain_db(slope, 0.5).abs() < 1e-12);
    }

    #[test]
    fn a_wave_has_its_amplitude_a_quarter_period_on() {
        assert!((gain_db([0.0, 1.5, 0.0, 2.0], 0.125) - 1.5).abs() < 1e-9);
        assert!((gain_db([0.0, 0.0, 1.5, 2.0], 0.25) + 1.5).abs() < 1e-9);
    }
}
