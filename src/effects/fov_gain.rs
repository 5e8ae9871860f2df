//! Gain that changes with the distance ρ from the centre of the field of view: edge_db·(ρ/0.5 m)² dB.

use super::{Effect, EffectParameter, Level, Shot, Stage};
use crate::units::ratio_from_db;

/// The effect `fov-gain`.
pub(super) struct FovGain;

/// Distance at which the gain is the parameter's, m.
const EDGE_M: f64 = 0.5;

impl Effect for FovGain {
    fn name(&self) -> &'static str {
        "fov-gain"
    }

    fn level(&self) -> Level {
        Level::Instrument
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        const PARAMETERS: [EffectParameter; 1] =
            [EffectParameter::new("edge_db", "dB", [-30.0, 30.0], 0.0, 0.5)];
        &PARAMETERS
    }

    fn description(&self) -> &'static str {
        "The antenna's gain is not the same over the field of view: it changes with the square of \
         the distance from the centre."
    }

    fn signature(&self) -> &'static str {
        "The residual grows or falls in rings about the centre of the field of view, whatever is \
         looked at. On a convex target that stands in the middle, angle and distance from the centre \
         rise together and the exponent of the diffuse lobe hides it: a second target off the centre \
         tells them apart."
    }

    fn starts(&self, _stage: &Stage, _looks: &[Shot]) -> Vec<Vec<f64>> {
        vec![vec![-1.0], vec![1.0]]
    }

    fn gain(&self, values: &[f64], _: &Stage, look: &Shot) -> f64 {
        let &[edge_db] = values else { return 1.0 };
        // Beyond the reach of any field of view the square must not run away.
        let off_centre = (look.xt_m.powi(2) + look.yt_m.powi(2)) / (EDGE_M * EDGE_M);
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
            let look = Shot { xt_m, yt_m, ..bench.looks[0] };
            db(FovGain.gain(&[-3.0], &bench.stage(), &look))
        };
        assert!((at(0.3, -0.4) + 3.0).abs() < 1e-9);
        assert!((at(0.0, 0.25) + 0.75).abs() < 1e-9);
        assert_eq!(at(0.0, 0.0), 0.0);
    }
}
