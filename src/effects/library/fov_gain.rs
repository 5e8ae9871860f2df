//! Gain that changes over the field of view: a polynomial of low order in (u, v) = (x_t, y_t)/0.5 m, in dB.

use crate::effects::effect::{About, Effect, EffectParameter, Level};
use crate::effects::shot::{Shot, Stage};
use crate::units::ratio_from_db;

pub(crate) struct FovGain;

/// Distance from the centre at which a term has its full value, m.
const EDGE_M: f64 = 0.5;
/// Largest distance, in edges: beyond the reach of any field of view a polynomial must not run away.
const MOST: f64 = 3.2;
/// Largest gain or loss, dB.
const MOST_DB: f64 = 300.0;

const PARAMETERS: [EffectParameter; 6] = [
    EffectParameter::new("edge_db", "dB", [-30.0, 30.0], 0.0, 0.5),
    EffectParameter::new("slope_x_db", "dB", [-30.0, 30.0], 0.0, 0.5),
    EffectParameter::new("slope_y_db", "dB", [-30.0, 30.0], 0.0, 0.5),
    EffectParameter::new("oval_db", "dB", [-30.0, 30.0], 0.0, 0.5),
    EffectParameter::new("twist_db", "dB", [-30.0, 30.0], 0.0, 0.5),
    EffectParameter::new("steep_db", "dB", [-30.0, 30.0], 0.0, 0.5),
];

const ABOUT: About = About {
    name: "fov-gain",
    level: Level::Instrument,
    description: "The antenna's gain is not the same over the field of view. With (u, v) for the place over 0.5 m it \
         changes by edge_db·(u² + v²), in dB. A pattern off the centre adds slope_x_db·u + slope_y_db·v, one that is \
         not round oval_db·(u² − v²) + twist_db·2uv, a steep one steep_db·(u² + v²)².",
    signature: "The residual grows or falls in rings about the centre of the field of view, whatever is \
         looked at. On a convex target that stands in the middle, angle and distance from the centre \
         rise together and the exponent of the diffuse lobe hides it: a second target off the centre \
         tells them apart.",
    parameters: &PARAMETERS,
    conflicts: &[],
    has_one_form: false,
};

impl Effect for FovGain {
    fn about(&self) -> &About {
        &ABOUT
    }

    /// Round; round with a slope; and also oval and steep.
    fn members(&self) -> &'static [&'static [usize]] {
        &[&[0], &[0, 1, 2], &[0, 1, 2, 3, 4, 5]]
    }

    fn starts(&self, _stage: &Stage, _shots: &[Shot]) -> Vec<Vec<f64>> {
        let start = |edge_db| [edge_db, 0.0, 0.0, 0.0, 0.0, 0.0].to_vec();
        [-1.0, 1.0].map(start).to_vec()
    }

    fn gain(&self, values: &[f64], _: &Stage, shot: &Shot) -> f64 {
        let &[edge_db, slope_x_db, slope_y_db, oval_db, twist_db, steep_db] = values else {
            return 1.0;
        };
        let off = (shot.xt_m.hypot(shot.yt_m) / EDGE_M).max(f64::MIN_POSITIVE);
        let within = off.min(MOST) / off / EDGE_M;
        let [u, v] = [shot.xt_m * within, shot.yt_m * within];
        let square = u * u + v * v;
        let gain_db = edge_db * square
            + (slope_x_db * u + slope_y_db * v)
            + (oval_db * (u * u - v * v) + 2.0 * twist_db * u * v)
            + steep_db * square * square;
        ratio_from_db(gain_db.clamp(-MOST_DB, MOST_DB))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, db};

    #[test]
    fn each_term_has_its_value_at_the_edge() {
        let bench = Bench::plate();
        let gain_db = |term: usize, xt_m: f64, yt_m: f64| {
            let mut values = [0.0; 6];
            values[term] = 2.0;
            let shot = Shot { xt_m, yt_m, ..bench.shots[0] };
            db(FovGain.gain(&values, &bench.stage(), &shot))
        };
        let slant = EDGE_M / 2f64.sqrt();
        for (term, xt_m, yt_m, expected) in [
            (0, EDGE_M, 0.0, 2.0),
            (0, 0.0, 0.5 * EDGE_M, 0.5),
            (1, -EDGE_M, 0.1, -2.0),
            (2, 0.1, EDGE_M, 2.0),
            (3, 0.0, EDGE_M, -2.0),
            (4, slant, slant, 2.0),
            (5, 0.0, 0.5 * EDGE_M, 0.125),
            (5, 40.0, 0.0, 2.0 * MOST.powi(4)),
            (0, 40.0, 0.0, 2.0 * MOST.powi(2)),
        ] {
            let found = gain_db(term, xt_m, yt_m);
            assert!((found - expected).abs() < 1e-9 * expected.abs().max(1.0), "{term}: {found}");
        }
    }
}
