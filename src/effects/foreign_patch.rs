//! A round place with another material: so many dB within a radius along the surface.

use super::covering_layer::share_of_spot;
use super::{Effect, Knob, Level, Place, Shot, Stage};
use crate::frames::{Direction, Ray};
use crate::radar::scan::PATTERN_RANGE_M;
use crate::units::ratio_from_db;

/// The effect `foreign-patch`.
pub(super) struct ForeignPatch;

const KNOBS: [Knob; 5] = [
    Knob::new("level_db", "dB", [-30.0, 30.0], 0.0, 0.5),
    Knob::new("centre_x_m", "m", [-3.0, 3.0], 0.0, 0.01),
    Knob::new("centre_y_m", "m", [-3.0, 3.0], 0.0, 0.01),
    Knob::new("radius_m", "m", [0.005, 1.0], 0.05, 0.01),
    Knob::new("fade_m", "m", [0.0, 0.1], 0.016, 0.004),
];

/// Sides of the cells where a search begins, m, and most of them along an edge of the target.
const SIDES_M: [f64; 2] = [0.05, 0.12];
const MOST_CELLS: usize = 20;
/// Levels where it begins, dB.
const LEVELS_DB: [f64; 2] = [1.0, -1.0];

/// Where the fading has ended, in its widths: no more than 10⁻⁵ of the level is left there.
const FADED: f64 = 3.0;

/// Distance of a look from the centre on the target, m; infinite where it is more than `far_m`, which costs
/// no ray.
fn apart_m(stage: &Stage, look: &Shot, [x_m, y_m]: [f64; 2], far_m: f64) -> f64 {
    let axes = stage.geometry.radar.frames().global_from_target.rotation();
    let aside = (x_m - look.xt_m) * axes.x_axis + (y_m - look.yt_m) * axes.y_axis;
    // Beside the ray of the centre by as much at least.
    let forward = look.ray.direction.xyz();
    let beside_m =
        aside.reject_from_normalized(forward).length() * look.hit.range_m / PATTERN_RANGE_M;
    let towards = Direction::new(PATTERN_RANGE_M * forward + aside);
    let Some(direction) = towards.filter(|_| beside_m <= far_m) else { return f64::INFINITY };
    // The centre belongs to the target, wherever that has moved.
    let ray = Ray { origin: look.ray.origin, direction };
    let centre = match stage.geometry.bvh.closest(&ray) {
        Some(hit) => hit.point.xyz,
        None => ray.origin.xyz + look.hit.range_m * direction.xyz(),
    };
    (look.target.inverse() * look.hit.point).xyz.distance(centre)
}

/// Least and largest of some numbers; zeros when there are none.
fn span(values: impl Iterator<Item = f64> + Clone) -> [f64; 2] {
    let (least, most) = (values.clone().reduce(f64::min), values.reduce(f64::max));
    [least.unwrap_or(0.0), most.unwrap_or(0.0)]
}

impl Effect for ForeignPatch {
    fn name(&self) -> &'static str {
        "foreign-patch"
    }

    fn level(&self) -> Level {
        Level::Scene
    }

    fn knobs(&self) -> &'static [Knob] {
        &KNOBS
    }

    fn is(&self) -> &'static str {
        "A round place on the target is of another material, that returns more or less by so many \
         dB. Its centre is on the surface where the field of view has these x_t and y_t; its radius is the \
         straight way from there, over the edge of which it fades as under a spot of that diameter."
    }

    fn shows(&self) -> &'static str {
        "The residual has one compact spot on the surface, at any angle, with a sharp outline. A \
         covering layer ends at a straight line and its loss grows with the angle; multiple bounces \
         brighten places too, but concave ones, and with longer ranges."
    }

    /// The cells of two grids over the target that hold a look, brighter and darker.
    fn starts(&self, _stage: &Stage, looks: &[Shot]) -> Vec<Vec<f64>> {
        let [left, right] = span(looks.iter().map(|look| look.xt_m));
        let [low, high] = span(looks.iter().map(|look| look.yt_m));
        let inside = |centre_m: f64| centre_m.clamp(-3.0, 3.0);
        let mut starts = Vec::new();
        for side_m in SIDES_M {
            let count = |length_m: f64| ((length_m / side_m).ceil() as usize).clamp(1, MOST_CELLS);
            let (columns, rows) = (count(right - left), count(high - low));
            let (width, height) = ((right - left) / columns as f64, (high - low) / rows as f64);
            let cells = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
            for (column, row) in cells {
                let [x, y] =
                    [left + (column as f64 + 0.5) * width, low + (row as f64 + 0.5) * height];
                let radius_m = (0.5 * side_m).clamp(0.02, 0.3);
                if looks.iter().any(|l| (l.xt_m - x).hypot(l.yt_m - y) < radius_m) {
                    let fade_m = KNOBS[4].absent;
                    starts.extend(
                        LEVELS_DB.map(|db| vec![db, inside(x), inside(y), radius_m, fade_m]),
                    );
                }
            }
        }
        starts
    }

    fn place(&self, values: &[f64]) -> Option<Place> {
        let &[_, x_m, y_m, radius_m, _] = values else { return None };
        Some(Place::Round { x_m, y_m, radius_m })
    }

    fn gain(&self, values: &[f64], stage: &Stage, look: &Shot) -> f64 {
        let &[level_db, x_m, y_m, radius_m, fade_m] = values else { return 1.0 };
        if level_db == 0.0 {
            return 1.0;
        }
        let apart_m = apart_m(stage, look, [x_m, y_m], radius_m + FADED * fade_m);
        let share = share_of_spot(radius_m - apart_m, fade_m);
        1.0 + share * (ratio_from_db(level_db) - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, db};

    #[test]
    fn only_what_lies_within_the_radius_changes() {
        let bench = Bench::plate();
        let (bare, with) =
            (bench.bare(), bench.with(&ForeignPatch, &[4.0, 0.05, -0.1, 0.06, 0.016]));
        let mut seen = [0; 2];
        for ((look, bare), with) in bench.looks.iter().zip(&bare).zip(&with) {
            let apart_m = (look.xt_m - 0.05).hypot(look.yt_m + 0.1);
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
        let starts = ForeignPatch.starts(&bench.stage(), &bench.looks);
        for sign in [1.0, -1.0] {
            assert!(starts.iter().filter(|start| start[0] * sign > 0.0).count() >= 12);
        }
        assert!(starts.iter().all(|start| start[1].abs() < 0.25 && start[2].abs() < 0.25));
    }
}
