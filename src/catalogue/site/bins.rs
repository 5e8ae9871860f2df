//! A curve by steps of the angle: what a reader without the picture needs.

use serde::Serialize;

use super::words::grouped;
use crate::formats::words::{decibels, percent};
use crate::material::{Censor, Curve, Observation};
use crate::measure::statistics::{self, Median};
use crate::units::db_from_ratio;

/// Width of a step, °.
const STEP_DEG: f64 = 5.0;

/// One step.
#[derive(Debug, PartialEq, Serialize)]
pub(super) struct Bin {
    range: String,
    points: String,
    censored: String,
    median: String,
}

/// Every step of a curve that holds a point in backscatter.
pub(super) fn bins(curve: &Curve) -> Vec<Bin> {
    let mut points: Vec<&Observation> =
        curve.observations.iter().filter(|o| o.is_retro()).collect();
    points.sort_by(|a, b| a.theta_i_rad.total_cmp(&b.theta_i_rad));
    points.chunk_by(|a, b| step(a) == step(b)).filter_map(bin).collect()
}

fn step(o: &Observation) -> u32 {
    // Degrees of a file come back from radians a little off.
    ((o.theta_i_rad.to_degrees() + 1e-9) / STEP_DEG) as u32
}

fn bin(points: &[&Observation]) -> Option<Bin> {
    let low_deg = f64::from(step(points.first()?)) * STEP_DEG;
    let censored = points.iter().filter(|o| o.censor != Censor::None).count();
    Some(Bin {
        range: format!("{low_deg:.0}–{:.0}", low_deg + STEP_DEG),
        points: grouped(points.len()),
        censored: percent(censored, points.len()),
        median: median(points),
    })
}

/// The median in words, as the table of statistics has it.
fn median(points: &[&Observation]) -> String {
    match statistics::median(points.iter().copied()) {
        Median::At(sigma0) => decibels(db_from_ratio(sigma0)),
        Median::Below(sigma0) => format!("< {}", decibels(db_from_ratio(sigma0))),
        Median::Unknown => "not known".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Illumination;

    fn point(theta_deg: f64, sigma0: Option<f64>) -> Observation {
        Observation::backscatter(theta_deg.to_radians(), sigma0, Some(0.01))
    }

    fn rows(levels: &[Option<f64>]) -> Vec<Bin> {
        let observations = levels.iter().map(|level| point(55.0, *level)).collect();
        bins(&Curve {
            name: "a".into(),
            source: "s".into(),
            instrument: None,
            session: None,
            illumination: Illumination::default(),
            observations,
        })
    }

    #[test]
    fn a_median_below_the_threshold_is_said_to_be_below() {
        let of = |levels: &[Option<f64>]| rows(levels).remove(0).median;
        assert_eq!(of(&[Some(0.1), Some(1.0), Some(1.0)]), "0.0");
        assert_eq!(of(&[None, Some(0.1), Some(1.0)]), "−10.0");
        assert_eq!(of(&[None, None, Some(1.0)]), "< −20.0");
        // What may lie above or below the detections shares its weight among what lies lower.
        assert_eq!(of(&[None, Some(0.001), Some(0.005)]), "−30.0");
    }

    #[test]
    fn steps_count_what_was_not_seen() {
        let bin = rows(&[None, Some(0.1), Some(0.1), Some(0.1)]).remove(0);
        assert_eq!((bin.range.as_str(), bin.censored.as_str()), ("55–60", "25.0 %"));
    }
}
