//! A layer over part of the target, such as clothing: −loss/cos θ dB beyond a line across the field of
//! view, which is a plane through the radar.

use crate::effects::effect::{About, Effect, EffectParameter, Level};
use crate::effects::place::{Place, along_m};
use crate::effects::shot::{Shot, Stage};
use crate::units::ratio_from_db;

pub(crate) struct CoveringLayer;

/// Least cos θ: a flat layer seen edge-on is as deep as it is wide.
const LEAST_COS_THETA: f64 = 0.02;

/// Share of a Gaussian spot beyond an edge that its centre has passed by `beyond_m`; the normal
/// integral by the logistic function, within 0.01.
pub(super) fn share_of_spot(beyond_m: f64, diameter_m: f64) -> f64 {
    let sd_m = diameter_m.max(1e-6) / (8.0 * std::f64::consts::LN_2).sqrt();
    1.0 / (1.0 + (-1.702 * beyond_m / sd_m).exp())
}

const ABOUT: About = About {
    name: "covering-layer",
    level: Level::Scene,
    description: "Part of the target is covered, as by clothing, which the wave crosses twice: a loss that \
         grows with the way through the layer, as 1/cos θ, on the far side of a straight line across \
         the field of view. The line lies boundary_m from the field's centre, in a direction counted \
         from x_t towards y_t, and the layer lies beyond it.",
    signature: "The power drops at a line and stays low on one side, more so at large angles. A foreign \
         patch has a closed outline and the same offset at all angles; a gain over the field and a \
         drift change without an edge. A layer over everything cannot be told from the calibration.",
    parameters: &[
        EffectParameter::new("loss_db", "dB", [0.0, 30.0], 0.0, 0.5),
        EffectParameter::new("boundary_m", "m", [-3.0, 3.0], 0.0, 0.02),
        EffectParameter::new("direction_deg", "deg", [-360.0, 360.0], 90.0, 5.0),
    ],
    conflicts: &[],
};

impl Effect for CoveringLayer {
    fn about(&self) -> &About {
        &ABOUT
    }

    /// Lines that cut off a third and two thirds of the shots, from four sides.
    fn starts(&self, _stage: &Stage, shots: &[Shot]) -> Vec<Vec<f64>> {
        let mut starts = Vec::new();
        for direction_deg in [0.0, 90.0, 180.0, 270.0] {
            let mut along_m: Vec<f64> =
                shots.iter().map(|shot| along_m(shot, direction_deg)).collect();
            along_m.sort_by(f64::total_cmp);
            for share in [1.0 / 3.0, 2.0 / 3.0] {
                let boundary_m = along_m.get((share * along_m.len() as f64) as usize).copied();
                let boundary_m = boundary_m.unwrap_or(0.0).clamp(-3.0, 3.0);
                starts.push(vec![1.0, boundary_m, direction_deg]);
            }
        }
        starts
    }

    fn place(&self, values: &[f64]) -> Option<Place> {
        let &[_, off_m, direction_deg] = values else { return None };
        Some(Place::Beyond { off_m, direction_deg })
    }

    fn gain(&self, values: &[f64], stage: &Stage, shot: &Shot) -> f64 {
        let &[loss_db, boundary_m, direction_deg] = values else { return 1.0 };
        let left = ratio_from_db(-loss_db / shot.hit.cos_theta.max(LEAST_COS_THETA));
        let beyond_m = along_m(shot, direction_deg) - boundary_m;
        let section = stage.beam(shot).section(shot.hit.range_m);
        1.0 - (1.0 - left) * share_of_spot(beyond_m, section.two_way_fwhm_m())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, db};

    fn gain_db(yt_m: f64, theta_deg: f64) -> f64 {
        let bench = Bench::plate();
        let mut shot = Shot { yt_m, ..bench.shots[0] };
        shot.hit.cos_theta = theta_deg.to_radians().cos();
        db(CoveringLayer.gain(&[1.5, 0.1, 90.0], &bench.stage(), &shot))
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
