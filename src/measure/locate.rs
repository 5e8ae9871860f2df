//! Where a radar stood, from the places of its points and their ranges: the place from which every point is as far as its
//! range says.

use glam::{DMat3, DVec3};

use super::cloud::Cloud;
use crate::frames::{Global, Point};

/// Where the radar stood.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadarPlace {
    /// The place.
    pub position: Point<Global>,
    /// Root mean square of distance less range, m.
    pub rms_m: f64,
}

/// Why the ranges of a cloud do not tell where the radar stood.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum LocateError {
    /// Too few ranges.
    #[error(
        "{ranges} of the points have a range, and {LEAST} are needed to find where the radar stood"
    )]
    Few {
        /// Points with a range.
        ranges: usize,
    },
    /// Two places are as good.
    #[error("the ranges suit two places, {} and {}", at(*first), at(*second))]
    Two {
        /// A place.
        first: Point<Global>,
        /// Another.
        second: Point<Global>,
    },
    /// No place suits the ranges.
    #[error(
        "from no place are the points as far as their ranges say: the best is off by {:.0} mm rms", 1e3 * rms_m
    )]
    None {
        /// Root mean square of distance less range, m.
        rms_m: f64,
    },
}

/// Ranges that are enough.
const LEAST: usize = 10;
/// A wider spread is of another frame or unit, m.
const WIDEST_RMS_M: f64 = 0.05;

/// A place in words.
fn at(place: Point<Global>) -> String {
    let [x, y, z] = place.xyz.to_array();
    format!("{x:.3},{y:.3},{z:.3}")
}

/// Finds where the radar of a cloud stood, by Gauss–Newton from both sides of the points along each axis.
///
/// # Errors
/// Too few ranges, ranges that suit two places, as they do where all points lie in a plane, or none.
///
/// ```
/// use matdb::frames::Point;
/// use matdb::measure::{Cloud, CloudPoint, radar_place};
/// let radar = Point::new(0.5, 1.0, 4.0);
/// let points = (0..20).map(|k| {
///     let turn = f64::from(k);
///     let point = Point::new(0.3 * turn.cos(), 1.0 + 0.3 * turn.sin(), 0.1 * (3.0 * turn).sin());
///     CloudPoint { chirp: None, point, range_m: Some(radar.distance_m(point)), power_w: 1e-9 }
/// });
/// let place = radar_place(&Cloud::new(points.collect())?)?;
/// assert!(place.position.distance_m(radar) < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn radar_place(cloud: &Cloud) -> Result<RadarPlace, LocateError> {
    let points = cloud.points().iter();
    let ranged: Vec<(DVec3, f64)> =
        points.filter_map(|point| Some((point.point.xyz, point.range_m?))).collect();
    if ranged.len() < LEAST {
        return Err(LocateError::Few { ranges: ranged.len() });
    }
    let count = ranged.len() as f64;
    let middle = ranged.iter().map(|(point, _)| *point).sum::<DVec3>() / count;
    let range_m = ranged.iter().map(|(_, range_m)| range_m).sum::<f64>() / count;
    let mut found: Vec<RadarPlace> = [DVec3::X, DVec3::Y, DVec3::Z]
        .into_iter()
        .flat_map(|axis| [middle + range_m * axis, middle - range_m * axis])
        .filter_map(|start| settle(&ranged, start))
        .collect();
    found.sort_by(|a, b| a.rms_m.total_cmp(&b.rms_m));
    let Some(&best) = found.first() else { return Err(LocateError::None { rms_m: f64::NAN }) };
    if best.rms_m > WIDEST_RMS_M {
        return Err(LocateError::None { rms_m: best.rms_m });
    }
    // As good but for chance, and elsewhere.
    let as_good = best.rms_m * (1.0 + 3.0 / count.sqrt()) + 1e-6;
    let is_other = |place: &&RadarPlace| {
        place.rms_m <= as_good && place.position.distance_m(best.position) > 0.01 * range_m
    };
    match found.iter().find(is_other) {
        None => Ok(best),
        Some(other) => Err(LocateError::Two { first: best.position, second: other.position }),
    }
}

/// The place that a search from `start` ends at; none where it does not end.
fn settle(ranged: &[(DVec3, f64)], start: DVec3) -> Option<RadarPlace> {
    const MOST_STEPS: usize = 200;
    const STILL_M: f64 = 1e-10;
    let mut at = start;
    let mut damping = 1e-3;
    let mut sum = sum_of_squares(ranged, at);
    for _ in 0..MOST_STEPS {
        let (mut normal, mut gradient) = (DMat3::ZERO, DVec3::ZERO);
        for (point, range_m) in ranged {
            let from = at - *point;
            let distance_m = from.length().max(1e-9);
            let along = from / distance_m;
            normal += DMat3::from_cols(along * along.x, along * along.y, along * along.z);
            gradient += along * (distance_m - range_m);
        }
        let largest = normal.x_axis.x + normal.y_axis.y + normal.z_axis.z;
        let step =
            (normal + DMat3::from_diagonal(DVec3::splat(damping * largest))).inverse() * gradient;
        if !step.is_finite() {
            return None;
        }
        let next_sum = sum_of_squares(ranged, at - step);
        if next_sum <= sum {
            at -= step;
            sum = next_sum;
            damping = f64::max(0.1 * damping, 1e-12);
            if step.length() < STILL_M {
                break;
            }
        } else {
            damping *= 10.0;
            if damping > 1e9 {
                break;
            }
        }
    }
    let rms_m = (sum / ranged.len() as f64).sqrt();
    Some(RadarPlace { position: at.into(), rms_m })
}

fn sum_of_squares(ranged: &[(DVec3, f64)], at: DVec3) -> f64 {
    ranged.iter().map(|(point, range_m)| (at.distance(*point) - range_m).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::CloudPoint;
    use crate::measure::synthetic::mannequin;

    #[test]
    fn the_radar_of_a_scan_is_found_through_its_noise() {
        let scan = mannequin(2e-3, 1);
        let place = radar_place(&scan.cloud).unwrap();
        // The points lie where noisy ranges put them, so that only rounding is left.
        assert!(place.position.distance_m(scan.radar.frames().origin()) < 1e-6, "{place:?}");
    }

    #[test]
    fn ranges_that_tell_no_place_say_why() {
        let radar = Point::new(0.2, 0.1, 3.0);
        let cloud = |flat: f64, extra_m: f64, count: i32| {
            let points = (0..count).map(|k| {
                let turn = f64::from(k);
                let point = Point::new(
                    0.3 * turn.cos(),
                    0.3 * (1.7 * turn).sin(),
                    flat * (3.0 * turn).sin(),
                );
                let range_m = radar.distance_m(point) + extra_m * (5.0 * turn).sin();
                CloudPoint { chirp: None, point, range_m: Some(range_m), power_w: 1e-9 }
            });
            Cloud::new(points.collect()).unwrap()
        };
        assert!(matches!(radar_place(&cloud(0.1, 0.0, 5)), Err(LocateError::Few { ranges: 5 })));
        assert!(matches!(radar_place(&cloud(0.0, 0.0, 50)), Err(LocateError::Two { .. })));
        assert!(matches!(radar_place(&cloud(0.1, 0.5, 50)), Err(LocateError::None { .. })));
        let near = radar_place(&cloud(0.1, 0.002, 500)).unwrap();
        assert!(near.position.distance_m(radar) < 0.05 && (near.rms_m - 0.0014).abs() < 2e-4);
    }
}
