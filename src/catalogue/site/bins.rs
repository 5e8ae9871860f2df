//! A curve by steps of the angle: what a reader without the picture needs.

use serde::Serialize;

use super::words::{decibels, grouped, percent};
use crate::material::{Censor, Curve, Observation};
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

/// The middle one, in words when only a bound of it is known. Bounds that lie on the wrong side of
/// everything else leave it open.
fn median(points: &[&Observation]) -> String {
    let ends = |o: &&Observation| match (o.sigma0, o.threshold_sigma0, o.censor) {
        (Some(sigma0), ..) => [sigma0, sigma0],
        (None, Some(bound), Censor::Left) => [0.0, bound],
        (None, Some(bound), _) => [bound, f64::INFINITY],
        (None, None, _) => [0.0, f64::INFINITY],
    };
    let middle = |end: usize| {
        let mut levels: Vec<f64> = points.iter().map(|o| ends(o)[end]).collect();
        levels.sort_by(f64::total_cmp);
        levels.get((levels.len().max(1) - 1) / 2).copied().unwrap_or(f64::NAN)
    };
    let [low_db, high_db] = [middle(0), middle(1)].map(db_from_ratio);
    match (low_db.is_finite(), high_db.is_finite()) {
        (true, true) if high_db - low_db < 0.05 => decibels(low_db),
        (true, true) => format!("{} to {}", decibels(low_db), decibels(high_db)),
        (false, true) => format!("< {}", decibels(high_db)),
        (true, false) => format!("> {}", decibels(low_db)),
        (false, false) => "not told".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(theta_deg: f64, sigma0: Option<f64>) -> Observation {
        Observation {
            theta_i_rad: theta_deg.to_radians(),
            theta_r_rad: theta_deg.to_radians(),
            delta_phi_rad: 0.0,
            sigma0,
            censor: if sigma0.is_some() { Censor::None } else { Censor::Left },
            threshold_sigma0: Some(0.01),
            theta_sd_rad: None,
            power_w: None,
            range_m: None,
            chirp: None,
        }
    }

    fn rows(levels: &[Option<f64>]) -> Vec<Bin> {
        let observations = levels.iter().map(|level| point(55.0, *level)).collect();
        bins(&Curve { name: "a".into(), source: "s".into(), instrument: None, session: None, observations })
    }

    #[test]
    fn a_median_below_the_threshold_is_said_to_be_below() {
        let of = |levels: &[Option<f64>]| rows(levels).remove(0).median;
        assert_eq!(of(&[Some(0.1), Some(1.0), Some(1.0)]), "0.0");
        assert_eq!(of(&[None, Some(0.1), Some(1.0)]), "−10.0");
        assert_eq!(of(&[None, None, Some(1.0)]), "< −20.0");
        // A detection under another point's threshold may or may not be the middle one.
        assert_eq!(of(&[None, Some(0.001), Some(0.005)]), "−30.0 to −23.0");
    }

    #[test]
    fn steps_count_what_was_not_seen() {
        let bin = rows(&[None, Some(0.1), Some(0.1), Some(0.1)]).remove(0);
        assert_eq!((bin.range.as_str(), bin.censored.as_str()), ("55–60", "25.0 %"));
    }
}
