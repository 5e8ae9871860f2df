//! A model in outline: the least and the greatest σ⁰ in each degree of incidence, in steps of half a
//! decibel outwards. Enough to say that a model is farther from a curve than another without computing
//! it, in 180 bytes.
//!
//! A model is looked at every quarter of a degree, a measured curve at each of its points, too. Between
//! two looks a smooth model leaves their levels by less than a quarter of the step between neighbours (a
//! parabola through them by an eighth), and a curve does not leave them at all.

use std::ops::RangeInclusive;

use super::models::{Brdf, Tabulated};
use super::scattering::{Scattering, ScatteringModel};
use crate::units::db_from_ratio;

/// Degrees of incidence, from 0.
pub const DEGREES: usize = 90;
const LOOKS_PER_DEGREE: usize = 4;
/// Levels are kept in these steps, dB.
const STEP_DB: f64 = 0.5;
/// The lowest level that is told from silence below it, dB.
const LOWEST_DB: f64 = -90.0;
/// Of a greatest level: nothing comes back at all. Of a least one: anything lower, or nothing.
const SILENT: u8 = 0;
/// Of a greatest level: anything higher.
const HIGHER: u8 = u8::MAX;

/// Least and greatest σ⁰ of a model in each degree of incidence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outline([[u8; 2]; DEGREES]);

/// A level at an angle of incidence, rad and dB.
type Look = (f64, f64);

impl Outline {
    /// Of a model; `None` of a sum with a measured curve in it, which need not be smooth between looks.
    pub fn new(model: &Brdf) -> Option<Outline> {
        let looks = match model {
            Brdf::Tabulated(curve) => looks_at_curve(curve),
            model if model.has_curve() => return None,
            model => looks(|theta_rad| db_from_ratio(model.sigma0(theta_rad))),
        };
        let mut outline = Outline([[SILENT; 2]; DEGREES]);
        for (degree, ends) in outline.0.iter_mut().enumerate() {
            // A neighbour more on either side: an angle may be rounded into the next degree.
            let margin = 1.0 / LOOKS_PER_DEGREE as f64;
            let [from, to] = [degree as f64 - margin, degree as f64 + 1.0 + margin]
                .map(|theta_deg| theta_deg.to_radians());
            let start = looks.partition_point(|look| look.0 < from - ROUNDING_RAD);
            let end = looks.partition_point(|look| look.0 <= to + ROUNDING_RAD);
            *ends = looks.get(start..end).map_or([SILENT, HIGHER], codes);
        }
        Some(outline)
    }

    /// Least and greatest level in these degrees, dB; `None` where nothing comes back. The least is −∞
    /// where some of it may be silent, the greatest +∞ where it is not known.
    pub fn ends_db(&self, degrees: RangeInclusive<usize>) -> Option<[f64; 2]> {
        let Some(cells) = self.0.get(degrees) else {
            return Some([f64::NEG_INFINITY, f64::INFINITY]);
        };
        let ends = |[low, high]: [u8; 2], cell: &[u8; 2]| [low.min(cell[0]), high.max(cell[1])];
        let [low, high] = cells.iter().fold([HIGHER, SILENT], ends);
        let level_db = |code: u8| LOWEST_DB + STEP_DB * (f64::from(code) - 1.0);
        let low_db = if low == SILENT { f64::NEG_INFINITY } else { level_db(low) };
        match high {
            SILENT => None,
            HIGHER => Some([low_db, f64::INFINITY]),
            code => Some([low_db, level_db(code)]),
        }
    }

    /// As it is kept.
    pub fn to_bytes(&self) -> Vec<u8> {
        self.0.as_flattened().to_vec()
    }

    /// From what [`Outline::to_bytes`] gives; `None` from anything else.
    pub fn from_bytes(bytes: &[u8]) -> Option<Outline> {
        match bytes.as_chunks() {
            (cells, []) => Some(Outline(cells.try_into().ok()?)),
            _ => None,
        }
    }

    /// Whether no level differs from that of another one by more than what another machine's rounding
    /// makes: one step.
    pub fn is_like(&self, other: &Outline) -> bool {
        std::iter::zip(self.0.as_flattened(), other.0.as_flattened())
            .all(|(a, b)| a.abs_diff(*b) <= 1)
    }
}

/// Angles nearer than this are one.
const ROUNDING_RAD: f64 = 1e-12;

fn looks(level_db: impl Fn(f64) -> f64) -> Vec<Look> {
    let theta_rad = |look: usize| (look as f64 / LOOKS_PER_DEGREE as f64).to_radians();
    let angles = (0..=DEGREES * LOOKS_PER_DEGREE).map(theta_rad);
    angles.map(|theta_rad| (theta_rad, level_db(theta_rad))).collect()
}

fn looks_at_curve(curve: &Tabulated) -> Vec<Look> {
    let mut looks = looks(|theta_rad| curve.sigma0_db(theta_rad));
    looks.extend(curve.points());
    looks.sort_by(|a, b| a.0.total_cmp(&b.0));
    looks
}

fn codes(looks: &[Look]) -> [u8; 2] {
    let steps = looks.windows(2).map(|pair| match pair {
        [a, b] => (a.1 - b.1).abs(),
        _ => 0.0,
    });
    let beyond = 0.25 * steps.filter(|step| step.is_finite()).fold(0.0, f64::max);
    let levels = || looks.iter().map(|look| look.1);
    let (low, high) = (
        levels().fold(f64::INFINITY, f64::min) - beyond,
        levels().fold(f64::NEG_INFINITY, f64::max) + beyond,
    );
    // What is no number could be anything.
    if levels().any(f64::is_nan) {
        return [SILENT, HIGHER];
    }
    let steps = |level_db: f64| (level_db - LOWEST_DB) / STEP_DB + 1.0;
    // Float to integer saturates.
    let low = steps(low).floor() as u8;
    match high == f64::NEG_INFINITY {
        true => [SILENT, SILENT],
        false => [low, (steps(high).ceil() as u8).max(1)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::Lambert;

    fn holds(model: &Brdf, theta_deg: f64) {
        let outline = Outline::new(model).unwrap();
        let degree = (theta_deg as usize).min(DEGREES - 1);
        let level_db = db_from_ratio(model.sigma0(theta_deg.to_radians()));
        match outline.ends_db(degree..=degree) {
            None => assert_eq!(level_db, f64::NEG_INFINITY, "{model:?} at {theta_deg}"),
            Some([low, high]) => {
                // Far less than what a search allows for.
                let ends = low - 1e-9..=high + 1e-9;
                assert!(ends.contains(&level_db), "{model:?} at {theta_deg}: {level_db}");
            }
        }
    }

    #[test]
    fn every_model_stays_within_its_outline_and_a_flat_one_fills_it() {
        for model in crate::brdf::models::tests::every_model() {
            if model.has_curve() && !matches!(model, Brdf::Tabulated(_)) {
                assert_eq!(Outline::new(&model), None);
                continue;
            }
            for step in 0..9000 {
                holds(&model, f64::from(step) * 0.01 + 0.003);
            }
        }
        let chalk = Outline::new(&Brdf::Lambert(Lambert { albedo: 0.5 })).unwrap();
        let [low, high] = chalk.ends_db(0..=0).unwrap();
        assert!(low >= 2.5 && high <= 3.5, "10 lg 2 between {low} and {high}");
    }

    #[test]
    fn a_rugged_curve_that_ends_in_silence_stays_within_its_outline() {
        let points: Vec<(f64, f64)> =
            (1..600).map(|k| (0.0017 * f64::from(k), f64::from(1 + k * 37 % 101))).collect();
        let curve = Tabulated::new(&points).unwrap().silent_from(60f64.to_radians()).unwrap();
        let model = Brdf::Tabulated(curve);
        for step in 0..90_000 {
            holds(&model, f64::from(step) * 0.001);
        }
        assert_eq!(Outline::new(&model).unwrap().ends_db(70..=80), None);
    }

    #[test]
    fn what_was_kept_is_read_again() {
        let outline = Outline::new(&Brdf::Lambert(Lambert { albedo: 0.5 })).unwrap();
        assert_eq!(Outline::from_bytes(&outline.to_bytes()), Some(outline));
        assert_eq!(Outline::from_bytes(&outline.to_bytes()[1..]), None);
        assert_eq!(outline.ends_db(80..=120), Some([f64::NEG_INFINITY, f64::INFINITY]));
    }
}
