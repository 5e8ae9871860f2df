//! A placebo: waves over the target plane, of random direction, length and phase.
//!
//! It gains what as many free parameters gain by following noise, or anything else that is missing.

use std::f64::consts::TAU;

use crate::effects::{About, Effect, EffectParameter, Level, Shot, Stage};
use crate::radar::random::{Key, Purpose};

/// Most parameters of a placebo.
const MOST: usize = 6;
const WAVE: EffectParameter =
    EffectParameter { name: "wave_db", unit: "dB", min: -10.0, max: 10.0, absent: 0.0, step: 0.2 };
static WAVES: [EffectParameter; MOST] = [WAVE; MOST];
/// Shortest and longest wave, m.
const WAVES_M: [f64; 2] = [0.2, 1.0];

/// Gain in dB as a sum of waves over the target plane.
pub(super) struct Placebo {
    /// Phase, rad, and its slopes by x_t and y_t, rad/m.
    waves: Vec<[f64; 3]>,
    about: About,
}

const ABOUT: About = About {
    name: "placebo",
    level: Level::Instrument,
    description: "A control: random waves without a physical meaning.",
    signature: "The gain of as many free parameters by chance.",
    parameters: &WAVES,
    conflicts: &[],
    has_one_form: false,
};

impl Placebo {
    /// A placebo with up to six parameters.
    pub fn new(numbers: usize, seed: u64) -> Placebo {
        let mut draws = Key { seed, chirp: 0, sub_ray: 2, purpose: Purpose::Fit }.draws();
        let [shortest_m, longest_m] = WAVES_M;
        let mut waves = Vec::new();
        for _ in 0..numbers.clamp(1, MOST) {
            let length_m = shortest_m * (longest_m / shortest_m).powf(draws.uniform());
            let [turn, phase] = [0, 1].map(|_| TAU * draws.uniform());
            let rate = TAU / length_m;
            waves.push([phase, rate * turn.cos(), rate * turn.sin()]);
        }
        let parameters = WAVES.get(..waves.len()).unwrap_or(&WAVES);
        Placebo { waves, about: About { parameters, ..ABOUT } }
    }
}

impl Effect for Placebo {
    fn about(&self) -> &About {
        &self.about
    }

    fn starts(&self, _stage: &Stage, _shots: &[Shot]) -> Vec<Vec<f64>> {
        vec![vec![0.0; self.waves.len()]]
    }

    fn gain(&self, values: &[f64], _: &Stage, shot: &Shot) -> f64 {
        let waves = self.waves.iter().zip(values);
        let sum_db: f64 = waves
            .map(|([phase, kx, ky], db)| db * (phase + kx * shot.xt_m + ky * shot.yt_m).cos())
            .sum();
        10f64.powf(0.1 * sum_db)
    }
}
