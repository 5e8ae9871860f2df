//! Gain that changes with the distance ρ from the centre of the field of view: edge_db·(ρ/0.5 m)² dB.

use crate::effects::effect::{About, Effect, EffectParameter, Level};
use crate::effects::shot::{Shot, Stage};
use crate::units::ratio_from_db;

pub(crate) struct FovGain;

/// Distance from the centre at which the gain is `edge_db`, m.
const EDGE_M: f64 = 0.5;

const ABOUT: About = About {
    name: "fov-gain",
    level: Level::Instrument,
    description: "The antenna's gain is not the same over the field of view: it changes with the square of \
         the distance from the centre.",
    signature: "The residual grows or falls in rings about the centre of the field of view, whatever is \
         looked at. On a convex target that stands in the middle, angle and distance from the centre \
         rise together and the exponent of the diffuse lobe hides it: a second target off the centre \
         tells them apart.",
    parameters: &[EffectParameter::new("edge_db", "dB", [-30.0, 30.0], 0.0, 0.5)],
    conflicts: &[],
};

impl Effect for FovGain {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn starts(&self, _stage: &Stage, _shots: &[Shot]) -> Vec<Vec<f64>> {
        vec![vec![-1.0], vec![1.0]]
    }

    fn gain(&self, values: &[f64], _: &Stage, shot: &Shot) -> f64 {
        let &[edge_db] = values else { return 1.0 };
        // Beyond the reach of any field of view the square must not run away.
        let off_centre = (shot.xt_m.powi(2) + shot.yt_m.powi(2)) / (EDGE_M * EDGE_M);
        ratio_from_db(edge_db * off_centre.min(10.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, db};

    #[test]
    fn three_db_are_lost_at_half_a_metre_and_none_in_the_centre() {
        let bench = Bench::plate();
        let at = |xt_m, yt_m| {
            let shot = Shot { xt_m, yt_m, ..bench.shots[0] };
            db(FovGain.gain(&[-3.0], &bench.stage(), &shot))
        };
        assert!((at(0.3, -0.4) + 3.0).abs() < 1e-9);
        assert!((at(0.0, 0.25) + 0.75).abs() < 1e-9);
        assert_eq!(at(0.0, 0.0), 0.0);
    }
}
