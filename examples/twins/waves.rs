//! A smooth random field in space: plane waves in random directions.

use std::f64::consts::TAU;

use glam::DVec3;
use matdb::radar::random::Draws;

use super::target::direction;

/// So many that the field is nearly Gaussian and no single wave shows.
const WAVES: usize = 24;

/// A field with mean 0 and variance 1.
pub struct Waves {
    /// Wave vectors, rad/m, and phases, rad.
    waves: Vec<(DVec3, f64)>,
}

impl Waves {
    /// Wavelengths between two, m, evenly in their logarithm.
    pub fn new(random: &mut Draws, [shortest_m, longest_m]: [f64; 2]) -> Waves {
        let mut waves = Vec::new();
        for _ in 0..WAVES {
            let length_m = shortest_m * (longest_m / shortest_m).powf(random.uniform());
            waves.push((TAU / length_m * direction(random), TAU * random.uniform()));
        }
        Waves { waves }
    }

    /// The field at a point.
    pub fn at(&self, point: DVec3) -> f64 {
        let sum: f64 = self.waves.iter().map(|(wave, phase)| (wave.dot(point) + phase).sin()).sum();
        sum * (2.0 / WAVES as f64).sqrt()
    }

    /// Gradient of a height that is a sum of the same waves, each as steep as every other: mean square 1 along
    /// any direction.
    pub fn slope(&self, point: DVec3) -> DVec3 {
        let sum: DVec3 = self
            .waves
            .iter()
            .map(|(wave, phase)| wave.normalize() * (wave.dot(point) + phase).cos())
            .sum();
        sum * (6.0 / WAVES as f64).sqrt()
    }
}
