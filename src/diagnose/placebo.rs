//! An effect that is none: waves over the target plane, of random direction, length and phase.
//!
//! What it gains is what as many free numbers gain by following noise, or whatever else is missing.

use crate::effects::{About, Effect, EffectParameter, Level, Shot, Stage};
use crate::radar::random::{Key, Purpose};

/// Most numbers of a placebo.
const MOST: usize = 6;
const KNOB: EffectParameter =
    EffectParameter { name: "wave_db", unit: "dB", min: -10.0, max: 10.0, absent: 0.0, step: 0.2 };
static KNOBS: [EffectParameter; MOST] = [KNOB; MOST];
/// Shortest and longest wave, m.
const WAVES_M: [f64; 2] = [0.2, 1.0];

/// Gains in dB that swing over the target plane.
pub(super) struct Placebo {
    /// Phase, rad, and its slopes by x_t and y_t, rad/m.
    waves: Vec<[f64; 3]>,
    about: About,
}

const ABOUT: About = About {
    name: "placebo",
    level: Level::Instrument,
    description: "A control: random waves that stand for no physics.",
    signature: "What as many free numbers gain by chance.",
    parameters: &KNOBS,
    conflicts: &[],
};

impl Placebo {
    /// With up to six numbers.
    pub fn new(numbers: usize, seed: u64) -> Placebo {
        let mut draws = Key { seed, chirp: 0, sub_ray: 2, purpose: Purpose::Fit }.draws();
        let wave = |_| {
            let [shortest, longest] = WAVES_M;
            let length_m = shortest * (longest / shortest).powf(draws.uniform());
            let [turn, phase] = [0, 1].map(|_| std::f64::consts::TAU * draws.uniform());
            let rate = std::f64::consts::TAU / length_m;
            [phase, rate * turn.cos(), rate * turn.sin()]
        };
        let waves: Vec<[f64; 3]> = (0..numbers.clamp(1, MOST)).map(wave).collect();
        let parameters = KNOBS.get(..waves.len()).unwrap_or(&KNOBS);
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
        let wave = |([phase, kx, ky], db): (&[f64; 3], &f64)| {
            db * (phase + kx * shot.xt_m + ky * shot.yt_m).cos()
        };
        10f64.powf(0.1 * self.waves.iter().zip(values).map(wave).sum::<f64>())
    }
}
