//! A place of another material: a change in dB within a round or oval outline along the surface.

use glam::DVec3;

use super::covering_layer::share_of_spot;
use crate::effects::effect::{About, Effect, EffectParameter, Level};
use crate::effects::place::{Place, cells_with_shots};
use crate::effects::shot::{Shot, Stage};
use crate::frames::{Direction, Global, Point, Ray};
use crate::radar::scan::PATTERN_RANGE_M;
use crate::units::ratio_from_db;

pub(crate) struct ForeignPatch;

const PARAMETERS: [EffectParameter; 8] = [
    EffectParameter::new("level_db", "dB", [-30.0, 30.0], 0.0, 0.5),
    EffectParameter::new("centre_x_m", "m", [-3.0, 3.0], 0.0, 0.01),
    EffectParameter::new("centre_y_m", "m", [-3.0, 3.0], 0.0, 0.01),
    EffectParameter::new("radius_m", "m", [0.005, 1.0], 0.05, 0.01),
    EffectParameter::new("fade_m", "m", [0.0, 0.1], 0.016, 0.004),
    EffectParameter::new("tilted_db", "dB", [-30.0, 30.0], 0.0, 1.0),
    EffectParameter::new("oval", "1", [-0.6, 0.6], 0.0, 0.1),
    EffectParameter::new("slant", "1", [-0.6, 0.6], 0.0, 0.1),
];

/// Sides of the cells where a search begins, m.
const SIDES_M: [f64; 2] = [0.05, 0.12];
/// Levels where it begins, dB.
const LEVELS_DB: [f64; 2] = [1.0, -1.0];

/// Share of the radius by which its centre and itself may be off: an outline with lobes of 15 %, or cut by an edge, has its middle
/// elsewhere. Two of these errors cover what was seen.
const FORM_ERROR: f64 = 0.1;

/// Distance, in widths of the fade, beyond which at most 10⁻⁵ of the level remains.
const FADED: f64 = 3.0;

/// The place of the target that a radar at `origin` sees at a place of the field of view, m; one 8 m away where its ray
/// misses.
fn centre(stage: &Stage, origin: Point<Global>, [x_m, y_m]: [f64; 2]) -> DVec3 {
    let aimed = stage.geometry.radar.frames().global_from_target * Point::new(x_m, y_m, 0.0);
    let Some(direction) = Direction::new(aimed.xyz - origin.xyz) else { return aimed.xyz };
    let hit = stage.geometry.bvh.closest(&Ray { origin, direction });
    hit.map_or(origin.xyz + PATTERN_RANGE_M * direction.xyz(), |hit| hit.point.xyz)
}

/// The outline of a patch and its level.
struct Patch {
    level_db: f64,
    centre_m: [f64; 2],
    radius_m: f64,
    fade_m: f64,
    tilted_db: f64,
    oval: f64,
    slant: f64,
}

impl Patch {
    /// None where the patch is absent.
    fn new(values: &[f64]) -> Option<Patch> {
        let &[level_db, x_m, y_m, radius_m, fade_m, tilted_db, oval, slant] = values else {
            return None;
        };
        let centre_m = [x_m, y_m];
        let is_there = level_db != 0.0 || tilted_db != 0.0;
        is_there.then_some(Patch { level_db, centre_m, radius_m, fade_m, tilted_db, oval, slant })
    }

    /// The gain of a shot; `centre` gives the place of the centre on the target for an origin of rays.
    fn gain(&self, stage: &Stage, shot: &Shot, centre: impl FnOnce(Point<Global>) -> DVec3) -> f64 {
        let [x_m, y_m] = [self.centre_m[0] - shot.xt_m, self.centre_m[1] - shot.yt_m];
        let (sin, cos) = (2.0 * (-y_m).atan2(-x_m)).sin_cos();
        let radius_m = self.radius_m * (self.oval * cos + self.slant * sin).exp();
        // The shot is at least this far from the ray of the centre.
        let frames = stage.geometry.radar.frames();
        let axes = frames.global_from_target.rotation();
        let aside = x_m * axes.x_axis + y_m * axes.y_axis;
        let beside_m = aside.reject_from_normalized(shot.ray.direction.xyz()).length()
            * shot.hit.range_m
            / frames.pattern_range_m;
        if beside_m > radius_m + FADED * self.fade_m {
            return 1.0;
        }
        // The centre belongs to the target, wherever that has moved.
        let on_target = (shot.target.inverse() * shot.hit.point).xyz;
        let apart_m = on_target.distance(centre(shot.ray.origin));
        let share = share_of_spot(radius_m - apart_m, self.fade_m);
        let sin2_theta = 1.0 - shot.hit.cos_theta.powi(2);
        1.0 + share * (ratio_from_db(self.level_db + self.tilted_db * sin2_theta) - 1.0)
    }
}

const ABOUT: About = About {
    name: "foreign-patch",
    level: Level::Scene,
    description: "A place on the target is of another material and returns level_db more than the rest, and \
         tilted_db·sin²θ more where it is met at an angle. \
         Its centre is on the surface at the given x_t and y_t of the field of view. The radius is the straight \
         distance from the centre. It grows by the factor exp(oval·cos 2φ + slant·sin 2φ) in the direction φ of the field of \
         view, counted from x_t towards y_t. Its edge is as soft as one seen by a spot of the diameter fade_m.",
    signature: "The residual has one compact spot on the surface with a sharp outline. The loss of a \
         covering layer grows as 1/cos θ; multiple bounces \
         brighten places too, but concave ones, and with longer ranges.",
    parameters: &PARAMETERS,
    conflicts: &[],
    has_one_form: false,
};

impl Effect for ForeignPatch {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn form_error(&self, parameter: usize, values: &[f64]) -> f64 {
        match (PARAMETERS[parameter].name, Patch::new(values)) {
            ("centre_x_m" | "centre_y_m" | "radius_m", Some(patch)) => FORM_ERROR * patch.radius_m,
            _ => 0.0,
        }
    }

    /// The cells of two grids over the target that hold a shot, brighter and darker.
    fn starts(&self, _stage: &Stage, shots: &[Shot]) -> Vec<Vec<f64>> {
        let mut starts = Vec::new();
        for (middle_m, side_m) in cells_with_shots(shots, SIDES_M) {
            let [x, y] = middle_m.map(|centre_m| centre_m.clamp(-3.0, 3.0));
            let (radius_m, fade_m) = ((0.5 * side_m).clamp(0.02, 0.3), PARAMETERS[4].absent);
            starts.extend(LEVELS_DB.map(|db| vec![db, x, y, radius_m, fade_m, 0.0, 0.0, 0.0]));
        }
        starts
    }

    /// Round with one level; and oval with a level that changes with the angle.
    fn members(&self) -> &'static [&'static [usize]] {
        &[&[0, 1, 2, 3, 4], &[0, 1, 2, 3, 4, 5, 6, 7]]
    }

    fn place(&self, values: &[f64]) -> Option<Place> {
        let &[_, x_m, y_m, radius_m, ..] = values else { return None };
        Some(Place::Round { x_m, y_m, radius_m })
    }

    fn gain(&self, values: &[f64], stage: &Stage, shot: &Shot) -> f64 {
        let Some(patch) = Patch::new(values) else { return 1.0 };
        patch.gain(stage, shot, |origin| centre(stage, origin, patch.centre_m))
    }

    /// Shots of one origin share the centre.
    fn multiply_gains(
        &self,
        values: &[f64],
        stage: &Stage,
        shots: &[Option<&Shot>],
        gains: &mut [f64],
    ) {
        let Some(patch) = Patch::new(values) else { return };
        let mut latest: Option<(Point<Global>, DVec3)> = None;
        for (gain, shot) in gains.iter_mut().zip(shots) {
            let Some(shot) = shot else { continue };
            *gain *= patch.gain(stage, shot, |origin| match latest {
                Some((known, centre)) if known == origin => centre,
                _ => {
                    let centre = centre(stage, origin, patch.centre_m);
                    latest = Some((origin, centre));
                    centre
                }
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, db};

    #[test]
    fn only_what_lies_within_the_radius_changes() {
        let bench = Bench::plate();
        let (bare, with) = (
            bench.bare(),
            bench.with(&ForeignPatch, &[4.0, 0.05, -0.1, 0.06, 0.016, 0.0, 0.0, 0.0]),
        );
        let mut seen = [0; 2];
        for ((shot, bare), with) in bench.shots.iter().zip(&bare).zip(&with) {
            let apart_m = (shot.xt_m - 0.05).hypot(shot.yt_m + 0.1);
            let change_db = db(with.power_w / bare.power_w);
            // The plate is seen within 3° of its normal; three spots from the edge all is settled.
            if apart_m < 0.02 {
                seen[0] += 1;
                assert!((change_db - 4.0).abs() < 0.01, "{change_db}");
            } else if apart_m > 0.11 {
                seen[1] += 1;
                assert!(change_db.abs() < 0.01, "{change_db}");
            }
        }
        assert!(seen[0] > 0 && seen[1] > 100, "{seen:?}");
    }

    #[test]
    fn searches_begin_on_the_target() {
        let bench = Bench::plate();
        let starts = ForeignPatch.starts(&bench.stage(), &bench.shots);
        for sign in [1.0, -1.0] {
            assert!(starts.iter().filter(|start| start[0] * sign > 0.0).count() >= 12);
        }
        assert!(starts.iter().all(|start| start[1].abs() < 0.25 && start[2].abs() < 0.25));
    }
}
