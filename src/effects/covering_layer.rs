//! A layer over part of the target, such as clothing: −loss/cos θ dB beyond a line across the field of
//! view, which is a plane through the radar.

use super::{Effect, Knob, Level, Place, Shot, Stage};
use crate::units::ratio_from_db;

/// The effect `covering-layer`.
pub(super) struct CoveringLayer;

const KNOBS: [Knob; 3] = [
    Knob::new("loss_db", "dB", [0.0, 30.0], 0.0, 0.5),
    Knob::new("boundary_m", "m", [-3.0, 3.0], 0.0, 0.02),
    Knob::new("direction_deg", "deg", [-360.0, 360.0], 90.0, 5.0),
];

/// A flat layer seen along itself is as deep as it is wide.
const LEAST_COS_THETA: f64 = 0.02;

/// How far a look lies from the field's centre, m, along `direction_deg` from x_t towards y_t.
pub(super) fn along_m(look: &Shot, direction_deg: f64) -> f64 {
    let (sin, cos) = direction_deg.to_radians().sin_cos();
    look.xt_m * cos + look.yt_m * sin
}

/// Share of a Gaussian spot beyond an edge that its centre has passed by `beyond_m`; the normal
/// integral by the logistic function, within 0.01.
pub(super) fn share_of_spot(beyond_m: f64, diameter_m: f64) -> f64 {
    let sd_m = diameter_m.max(1e-6) / (8.0 * std::f64::consts::LN_2).sqrt();
    1.0 / (1.0 + (-1.702 * beyond_m / sd_m).exp())
}

impl Effect for CoveringLayer {
    fn name(&self) -> &'static str {
        "covering-layer"
    }

    fn level(&self) -> Level {
        Level::Scene
    }

    fn knobs(&self) -> &'static [Knob] {
        &KNOBS
    }

    fn is(&self) -> &'static str {
        "Part of the target is covered, as by clothing, which the wave crosses twice: a loss that \
         grows with the way through the layer, as 1/cos θ, on the far side of a straight line across \
         the field of view. The line lies so far from the field's centre, in a direction counted \
         from x_t towards y_t, and the layer beyond it."
    }

    fn shows(&self) -> &'static str {
        "The power drops at a line and stays low on one side, more so at large angles. A foreign \
         patch has a closed outline and the same offset at all angles; a gain over the field and a \
         drift change without an edge. A layer over everything cannot be told from the calibration."
    }

    /// Lines that cut off a third and two thirds of the looks, from four sides.
    fn starts(&self, _stage: &Stage, looks: &[Shot]) -> Vec<Vec<f64>> {
        let line = |direction_deg: f64, share: f64| {
            let mut along: Vec<f64> = looks.iter().map(|l| along_m(l, direction_deg)).collect();
            along.sort_by(f64::total_cmp);
            let boundary_m = along.get((share * along.len() as f64) as usize).copied();
            vec![1.0, boundary_m.unwrap_or(0.0).clamp(-3.0, 3.0), direction_deg]
        };
        let sides = [0.0, 90.0, 180.0, 270.0];
        sides
            .iter()
            .flat_map(|&side| [1.0 / 3.0, 2.0 / 3.0].map(|share| line(side, share)))
            .collect()
    }

    fn place(&self, values: &[f64]) -> Option<Place> {
        let &[_, off_m, direction_deg] = values else { return None };
        Some(Place::Beyond { off_m, direction_deg })
    }

    fn gain(&self, values: &[f64], stage: &Stage, look: &Shot) -> f64 {
        let &[loss_db, boundary_m, direction_deg] = values else { return 1.0 };
        let left = ratio_from_db(-loss_db / look.hit.cos_theta.max(LEAST_COS_THETA));
        let beyond_m = along_m(look, direction_deg) - boundary_m;
        1.0 - (1.0 - left) * share_of_spot(beyond_m, stage.geometry.radar.spot_diameter_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, db};

    fn gain_db(yt_m: f64, theta_deg: f64) -> f64 {
        let bench = Bench::plate();
        let mut look = Shot { yt_m, ..bench.looks[0] };
        look.hit.cos_theta = theta_deg.to_radians().cos();
        db(CoveringLayer.gain(&[1.5, 0.1, 90.0], &bench.stage(), &look))
    }

    #[test]
    fn the_loss_goes_as_the_way_through_the_layer() {
        assert!((gain_db(0.3, 0.0) + 1.5).abs() < 1e-9);
        assert!((gain_db(0.3, 60.0) + 3.0).abs() < 1e-9);
    }

    #[test]
    fn it_lies_beyond_its_line_only() {
        assert!(gain_db(-0.1, 60.0).abs() < 1e-9);
        assert!((gain_db(0.1, 0.0) - db((1.0 + 10f64.powf(-0.15)) / 2.0)).abs() < 1e-9);
    }
}
