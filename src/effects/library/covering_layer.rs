//! A layer over part of the target, such as clothing: −loss/cos θ dB beyond a line across the field of
//! view, which is a plane through the radar, or within an oval outline, a cone from the radar.

use crate::effects::effect::{About, Conflict, Effect, EffectParameter, Level};
use crate::effects::place::{Place, along_m, cells_with_shots};
use crate::effects::shot::{Shot, Stage};
use crate::units::ratio_from_db;

pub(crate) struct CoveringLayer;

/// Sides of the cells in which a search for an oval begins, m.
const OVALS_M: [f64; 2] = [0.1, 0.2];
/// Least cos θ: a flat layer seen edge-on is as deep as it is wide.
const LEAST_COS_THETA: f64 = 0.02;

/// Share of the loss by which its mean may be off: cloth is uneven, and its outline is no oval.
const FORM_ERROR: f64 = 0.1;

const PARAMETERS: [EffectParameter; 10] = [
    EffectParameter::new("loss_db", "dB", [0.0, 30.0], 0.0, 0.5),
    EffectParameter::new("boundary_m", "m", [-3.0, 3.0], 0.0, 0.02),
    EffectParameter::new("direction_deg", "deg", [-360.0, 360.0], 90.0, 5.0),
    EffectParameter::new("centre_x_m", "m", [-3.0, 3.0], 0.0, 0.02),
    EffectParameter::new("centre_y_m", "m", [-3.0, 3.0], 0.0, 0.02),
    EffectParameter::new("length_m", "m", [0.01, OPEN_M], OPEN_M, 0.02),
    EffectParameter::new("width_m", "m", [0.01, OPEN_M], OPEN_M, 0.02),
    EffectParameter::new("turn_deg", "deg", [-360.0, 360.0], 0.0, 10.0),
    EffectParameter::new("thicker_x_per_m", "1/m", [-20.0, 20.0], 0.0, 0.5),
    EffectParameter::new("thicker_y_per_m", "1/m", [-20.0, 20.0], 0.0, 0.5),
];

/// Largest factor, and one over it the smallest, by which the thickness of a layer may differ from that in its middle.
const MOST_UNEVEN: f64 = 5.0;

/// Half axis of an outline that is none, m.
const OPEN_M: f64 = 100.0;

/// How far within an oval a place of the target plane lies, m: along the ray from its centre.
fn within_m(shot: &Shot, [x_m, y_m]: [f64; 2], half_m: [f64; 2], turn_deg: f64) -> f64 {
    let (sin, cos) = turn_deg.to_radians().sin_cos();
    let [x, y] = [shot.xt_m - x_m, shot.yt_m - y_m];
    let [along, across] = [x * cos + y * sin, y * cos - x * sin];
    let share = (along / half_m[0]).hypot(across / half_m[1]);
    if share > 1e-9 { along.hypot(across) * (1.0 / share - 1.0) } else { half_m[0].min(half_m[1]) }
}

/// Share of a Gaussian spot beyond an edge that its centre has passed by `beyond_m`; the normal
/// integral by the logistic function, within 0.01.
pub(super) fn share_of_spot(beyond_m: f64, diameter_m: f64) -> f64 {
    let sd_m = diameter_m.max(1e-6) / (8.0 * std::f64::consts::LN_2).sqrt();
    1.0 / (1.0 + (-1.702 * beyond_m / sd_m).exp())
}

const ABOUT: About = About {
    name: "covering-layer",
    level: Level::Scene,
    description: "Part of the target is covered, as by clothing, which the wave crosses twice. The loss grows \
         with the way through the layer, as 1/cos θ. The layer lies on the far side of a straight line across \
         the field of view, or within an oval. The line lies boundary_m from the field's centre, in a direction \
         counted from x_t towards y_t, and the layer lies beyond it. An oval takes its place where length_m and width_m are \
         given: half axes about its centre, the first turned from x_t towards y_t. From there its thickness changes by these \
         shares per metre.",
    signature: "The power drops at an edge and stays low behind it, more so at large angles. A foreign \
         patch has the same offset at all angles; a gain over the field and a \
         drift change without an edge. A layer over everything cannot be told from the calibration.",
    parameters: &PARAMETERS,
    conflicts: &[Conflict::OF_BACKSCATTER],
    has_one_form: false,
};

impl Effect for CoveringLayer {
    fn about(&self) -> &About {
        &ABOUT
    }

    /// Beyond a line; within an oval; and within one of uneven thickness.
    fn members(&self) -> &'static [&'static [usize]] {
        &[&[0, 1, 2], &[0, 3, 4, 5, 6, 7], &[0, 3, 4, 5, 6, 7, 8, 9]]
    }

    fn form_error(&self, parameter: usize, values: &[f64]) -> f64 {
        if PARAMETERS[parameter].name == "loss_db" { FORM_ERROR * values[parameter] } else { 0.0 }
    }

    /// Lines that cut off a third and two thirds of the shots, from four sides, and ovals that lie on the target.
    fn starts(&self, _stage: &Stage, shots: &[Shot]) -> Vec<Vec<f64>> {
        let mut starts = Vec::new();
        for direction_deg in [0.0, 90.0, 180.0, 270.0] {
            let mut along_m: Vec<f64> =
                shots.iter().map(|shot| along_m(shot, direction_deg)).collect();
            along_m.sort_by(f64::total_cmp);
            for share in [1.0 / 3.0, 2.0 / 3.0] {
                let boundary_m = along_m.get((share * along_m.len() as f64) as usize).copied();
                let boundary_m = boundary_m.unwrap_or(0.0).clamp(-3.0, 3.0);
                let line = [1.0, boundary_m, direction_deg, 0.0, 0.0, OPEN_M, OPEN_M];
                starts.push(line.into_iter().chain([0.0; 3]).collect());
            }
        }
        let ovals = cells_with_shots(shots, OVALS_M).into_iter().map(|([x_m, y_m], side_m)| {
            let [x_m, y_m] = [x_m, y_m].map(|centre_m| centre_m.clamp(-3.0, 3.0));
            let oval = [1.0, PARAMETERS[1].absent, 90.0, x_m, y_m, side_m, side_m];
            oval.into_iter().chain([0.0; 3]).collect()
        });
        starts.extend(ovals);
        starts
    }

    fn place(&self, values: &[f64]) -> Option<Place> {
        let &[_, off_m, direction_deg, x_m, y_m, length_m, width_m, ..] = values else {
            return None;
        };
        if length_m.min(width_m) < OPEN_M {
            return Some(Place::Round { x_m, y_m, radius_m: length_m.max(width_m) });
        }
        Some(Place::Beyond { off_m, direction_deg })
    }

    fn gain(&self, values: &[f64], stage: &Stage, shot: &Shot) -> f64 {
        let &[
            loss_db,
            boundary_m,
            direction_deg,
            x_m,
            y_m,
            length_m,
            width_m,
            turn_deg,
            by_x,
            by_y,
        ] = values
        else {
            return 1.0;
        };
        if loss_db == 0.0 {
            return 1.0;
        }
        let thicker = 1.0 + by_x * (shot.xt_m - x_m) + by_y * (shot.yt_m - y_m);
        let loss_db = loss_db * thicker.clamp(1.0 / MOST_UNEVEN, MOST_UNEVEN);
        let left = ratio_from_db(-loss_db / shot.hit.cos_theta.max(LEAST_COS_THETA));
        let beyond_m = if length_m.min(width_m) < OPEN_M {
            within_m(shot, [x_m, y_m], [length_m, width_m], turn_deg)
        } else {
            along_m(shot, direction_deg) - boundary_m
        };
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
        let line = [1.5, 0.1, 90.0, 0.0, 0.0, OPEN_M, OPEN_M, 0.0, 0.0, 0.0];
        db(CoveringLayer.gain(&line, &bench.stage(), &shot))
    }

    #[test]
    fn an_oval_covers_what_lies_within_it() {
        let bench = Bench::plate();
        let gain_db = |xt_m: f64, yt_m: f64| {
            let shot = Shot { xt_m, yt_m, ..bench.shots[0] };
            // 0.4 m along the diagonal, 0.1 m across it.
            let oval = [2.0, 0.0, 90.0, 0.1, 0.2, 0.4, 0.1, 45.0, 0.0, 0.0];
            let there = CoveringLayer.gain(&oval, &bench.stage(), &shot);
            db(there) * shot.hit.cos_theta
        };
        for (xt_m, yt_m, expected_db) in
            [(0.1, 0.2, -2.0), (0.33, 0.43, -2.0), (0.22, 0.08, 0.0), (0.43, 0.53, 0.0)]
        {
            let found = gain_db(xt_m, yt_m);
            assert!((found - expected_db).abs() < 1e-3, "{xt_m} {yt_m}: {found}");
        }
        // On the outline half of a spot is covered.
        let half = 0.1 + 0.4 / 2f64.sqrt();
        assert!((gain_db(half, half + 0.1) + 0.89).abs() < 0.05, "{}", gain_db(half, half + 0.1));
    }

    #[test]
    fn a_layer_may_be_thicker_to_one_side_and_is_never_a_gain() {
        let bench = Bench::plate();
        for (xt_m, expected_db) in [(0.1, -2.0), (0.2, -3.0), (0.0, -1.0), (-0.2, -0.4)] {
            let shot = Shot { xt_m, yt_m: 0.2, ..bench.shots[0] };
            let uneven = [2.0, 0.0, 90.0, 0.1, 0.2, 0.6, 0.6, 0.0, 5.0, 0.0];
            let found = db(CoveringLayer.gain(&uneven, &bench.stage(), &shot));
            assert!((found * shot.hit.cos_theta - expected_db).abs() < 1e-3, "{xt_m}: {found}");
        }
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
