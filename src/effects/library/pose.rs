//! A target that does not stand where the scene says: turned about the middle of the shots, by roll,
//! pitch and yaw about the fixed axes x, y, z, and then shifted.

use glam::DVec3;

use crate::effects::effect::{About, Conflict, Effect, EffectParameter, Level};
use crate::effects::shot::{Shot, Stage};
use crate::effects::twist::{Twist, placed, twists};
use crate::frames::{Global, Pose as FramePose};

/// From where the scene has the target to where it stands.
type Motion = FramePose<Global, Global>;

pub(crate) struct Pose;

const SHIFT_M: [f64; 2] = [-0.2, 0.2];
const TURN_DEG: [f64; 2] = [-20.0, 20.0];
const PARAMETERS: [EffectParameter; 6] = [
    EffectParameter::new("translation_x_m", "m", SHIFT_M, 0.0, 2e-3),
    EffectParameter::new("translation_y_m", "m", SHIFT_M, 0.0, 2e-3),
    EffectParameter::new("translation_z_m", "m", SHIFT_M, 0.0, 2e-3),
    EffectParameter::new("rotation_x_deg", "deg", TURN_DEG, 0.0, 0.5),
    EffectParameter::new("rotation_y_deg", "deg", TURN_DEG, 0.0, 0.5),
    EffectParameter::new("rotation_z_deg", "deg", TURN_DEG, 0.0, 0.5),
];

/// Shift, m, and roll, pitch and yaw, deg.
fn shift_and_turn(values: &[f64]) -> Option<[DVec3; 2]> {
    let &[x, y, z, roll, pitch, yaw] = values else { return None };
    Some([DVec3::new(x, y, z), DVec3::new(roll, pitch, yaw)])
}

const ABOUT: About = About {
    name: "pose",
    level: Level::Scene,
    description: "The target stands elsewhere than the scene says: shifted along the global axes and turned \
         about the middle of what the scan has hit.",
    signature: "The ranges are off, smoothly over the surface, and so are the powers where the angle is \
         wrong: too strong on one side of the brightest place and too weak on the other. Edges have \
         hits where none should be. Motion does the same, but changes along the scan.",
    parameters: &PARAMETERS,
    conflicts: &[Conflict::OF_MOTION, Conflict::OF_SHEETS],
    has_one_form: true,
};

impl Effect for Pose {
    fn about(&self) -> &About {
        &ABOUT
    }

    /// At the pose of the scene: the ranges lead a search from there.
    fn starts(&self, _stage: &Stage, _shots: &[Shot]) -> Vec<Vec<f64>> {
        vec![vec![0.0; PARAMETERS.len()]]
    }

    fn moves(&self) -> bool {
        true
    }

    fn twists(&self, values: &[f64], _: &Stage, _: &Shot) -> Vec<Twist> {
        let all = shift_and_turn(values).map(|[shift_m, turn_deg]| twists(shift_m, turn_deg));
        all.map_or(Vec::new(), Vec::from)
    }

    fn vectors(&self) -> &'static [(&'static str, [usize; 3])] {
        &[("translation_m", [0, 1, 2]), ("rotation_deg", [3, 4, 5])]
    }

    fn motion(&self, values: &[f64], stage: &Stage, _: &Shot) -> Option<Motion> {
        let [shift_m, turn_deg] = shift_and_turn(values)?;
        let rests = shift_m == DVec3::ZERO && turn_deg == DVec3::ZERO;
        (!rests).then(|| placed(stage.middle, shift_m, turn_deg))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::Bench;

    #[test]
    fn a_shift_towards_the_radar_shortens_the_range() {
        let bench = Bench::plate();
        for shot in &bench.shots {
            let found = bench.moved(&Pose, &[0.0, 0.0, 0.01, 0.0, 0.0, 0.0], shot).unwrap();
            let shorter_m = shot.hit.range_m - found.hit.range_m;
            assert!((shorter_m * shot.hit.cos_theta - 0.01).abs() < 1e-9);
            assert!((found.hit.point.xyz.z - 0.01).abs() < 1e-9);
        }
    }

    #[test]
    fn a_turn_leaves_the_middle_and_tilts_the_normal() {
        let bench = Bench::plate();
        let shot =
            bench.shots.iter().min_by(|a, b| a.hit.range_m.total_cmp(&b.hit.range_m)).unwrap();
        let found = bench.moved(&Pose, &[0.0, 0.0, 0.0, 5.0, 0.0, 0.0], shot).unwrap();
        // The plate turns about its middle, half a row of rays away at most.
        assert!((found.hit.range_m - shot.hit.range_m).abs() < 2e-3);
        let tilt_deg = found.normal.dot(shot.normal).acos().to_degrees();
        assert!((tilt_deg - 5.0).abs() < 1e-6);
        assert!((found.normal.dot(-found.ray.direction.xyz()) - found.hit.cos_theta).abs() < 1e-12);
    }

    #[test]
    fn what_has_moved_out_of_the_way_is_missed() {
        let bench = Bench::plate();
        let edge = bench.shots.iter().max_by(|a, b| a.xt_m.total_cmp(&b.xt_m)).unwrap();
        assert!(bench.moved(&Pose, &[-0.2, 0.0, 0.0, 0.0, 0.0, 0.0], edge).is_none());
    }
}
