//! A model in outline: the least and the greatest σ⁰ in each degree of incidence, rounded outwards to
//! half a decibel. These 180 bytes suffice to say that one model is farther from a curve than another,
//! without computing either.
//!
//! A model is sampled every quarter of a degree, a measured curve also at each of its points. Between
//! two samples a smooth model leaves their levels by less than a quarter of the step between neighbours (a
//! parabola through them by an eighth), and a curve does not leave them at all.

use std::ops::RangeInclusive;

use super::models::{Brdf, Tabulated};
use super::scattering::{Scattering, ScatteringModel};
use crate::units::db_from_ratio;

/// Degrees of incidence, from 0.
pub const DEGREES: usize = 90;
const SAMPLES_PER_DEGREE: usize = 4;
/// Levels are kept in these steps, dB.
const STEP_DB: f64 = 0.5;
/// The lowest level that is distinguished from silence, dB.
const LOWEST_DB: f64 = -90.0;
/// Of a greatest level: nothing comes back at all. Of a least one: anything lower, or nothing.
const SILENT: u8 = 0;
/// Of a greatest level: anything higher.
const HIGHER: u8 = u8::MAX;

/// Least and greatest σ⁰ of a model in each degree of incidence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outline([[u8; 2]; DEGREES]);

/// An angle of incidence, rad, and the level there, dB.
type Sample = (f64, f64);

impl Outline {
    /// Of a model; `None` of a sum with a measured curve in it, which need not be smooth between samples.
    pub fn new(model: &Brdf) -> Option<Outline> {
        let samples = match model {
            Brdf::Tabulated(curve) => samples_of_curve(curve),
            model if model.has_curve() => return None,
            model => samples(|theta_rad| db_from_ratio(model.sigma0(theta_rad))),
        };
        let mut outline = Outline([[SILENT; 2]; DEGREES]);
        for (degree, ends) in outline.0.iter_mut().enumerate() {
            // A neighbour more on either side: an angle may be rounded into the next degree.
            let margin = 1.0 / SAMPLES_PER_DEGREE as f64;
            let [from, to] = [degree as f64 - margin, degree as f64 + 1.0 + margin]
                .map(|theta_deg| theta_deg.to_radians());
            let start = samples.partition_point(|sample| sample.0 < from - ROUNDING_RAD);
            let end = samples.partition_point(|sample| sample.0 <= to + ROUNDING_RAD);
            *ends = samples.get(start..end).map_or([SILENT, HIGHER], codes);
        }
        Some(outline)
    }

    /// Least and greatest level in these degrees, dB; `None` where nothing comes back. The least is −∞
    /// where some of it may be silent, the greatest +∞ where it is not known.
    pub fn ends_db(&self, degrees: RangeInclusive<usize>) -> Option<[f64; 2]> {
        let Some(cells) = self.0.get(degrees) else {
            return Some([f64::NEG_INFINITY, f64::INFINITY]);
        };
        let [mut low, mut high] = [HIGHER, SILENT];
        for cell in cells {
            [low, high] = [low.min(cell[0]), high.max(cell[1])];
        }
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

/// The level of a code, dB.
fn level_db(code: u8) -> f64 {
    LOWEST_DB + STEP_DB * (f64::from(code) - 1.0)
}

/// Angles nearer than this are one.
const ROUNDING_RAD: f64 = 1e-12;

fn samples(level_db: impl Fn(f64) -> f64) -> Vec<Sample> {
    let angles = (0..=DEGREES * SAMPLES_PER_DEGREE)
        .map(|sample| (sample as f64 / SAMPLES_PER_DEGREE as f64).to_radians());
    angles.map(|theta_rad| (theta_rad, level_db(theta_rad))).collect()
}

fn samples_of_curve(curve: &Tabulated) -> Vec<Sample> {
    let mut samples = samples(|theta_rad| curve.sigma0_db(theta_rad));
    samples.extend(curve.points());
    samples.sort_by(|a, b| a.0.total_cmp(&b.0));
    samples
}

/// Codes of the least and the greatest level of neighbouring samples and of what lies between them.
fn codes(samples: &[Sample]) -> [u8; 2] {
    let (mut low_db, mut high_db) = (f64::INFINITY, f64::NEG_INFINITY);
    for &(_, level_db) in samples {
        // A level that is not a number could be anything.
        if level_db.is_nan() {
            return [SILENT, HIGHER];
        }
        (low_db, high_db) = (low_db.min(level_db), high_db.max(level_db));
    }
    // The largest finite step between neighbours bounds how far the model leaves their levels.
    let steps_db = samples.windows(2).map(|pair| match pair {
        [a, b] => (a.1 - b.1).abs(),
        _ => 0.0,
    });
    let beyond_db = 0.25 * steps_db.filter(|step_db| step_db.is_finite()).fold(0.0, f64::max);
    let (low_db, high_db) = (low_db - beyond_db, high_db + beyond_db);
    if high_db == f64::NEG_INFINITY {
        return [SILENT, SILENT];
    }
    // Float to integer saturates.
    [code(low_db).floor() as u8, (code(high_db).ceil() as u8).max(1)]
}

/// The inverse of [`level_db`], as a real number.
fn code(level_db: f64) -> f64 {
    (level_db - LOWEST_DB) / STEP_DB + 1.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::Lambert;

    fn holds(outline: &Outline, model: &Brdf, theta_deg: f64) {
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
            let outline = Outline::new(&model).unwrap();
            for step in 0..9000 {
                holds(&outline, &model, f64::from(step) * 0.01 + 0.003);
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
        let outline = Outline::new(&model).unwrap();
        for step in 0..90_000 {
            holds(&outline, &model, f64::from(step) * 0.001);
        }
        assert_eq!(outline.ends_db(70..=80), None);
    }

    #[test]
    fn what_was_kept_is_read_again() {
        let outline = Outline::new(&Brdf::Lambert(Lambert { albedo: 0.5 })).unwrap();
        assert_eq!(Outline::from_bytes(&outline.to_bytes()), Some(outline));
        assert_eq!(Outline::from_bytes(&outline.to_bytes()[1..]), None);
        assert_eq!(outline.ends_db(80..=120), Some([f64::NEG_INFINITY, f64::INFINITY]));
    }
}
