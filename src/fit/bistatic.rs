//! Fits a model to scattering that was measured in any pairs of directions, by least squares in dB.
//!
//! Goniophotometers measure f(i, o) with a steady error and without a threshold: the cost is
//! Σ (10·lg f_model(i, o) − 10·lg f)². Unlike the fit of a radar's curve it models no speckle, no
//! missing detections and no angle error. The residual beyond the repeatability is the error of the model.

use nalgebra::DVector;
use serde::Serialize;

use super::by_parts::ByParts;
use super::coordinates::{Coordinates, frequencies};
use super::error::FitError;
use super::minimise::{Local, Minimise, Stop, step_each};
use crate::brdf::{Brdf, Scattering};
use crate::frames::{Direction, Surface};
use crate::units::db_from_ratio;

/// One measured value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Towards the source.
    pub i: Direction<Surface>,
    /// Towards the receiver.
    pub o: Direction<Surface>,
    /// f(i, o), 1/sr, above 0.
    pub f_per_sr: f64,
}

/// Settings of a bistatic fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bistatic {
    /// Points that the search starts from, 1 to 1000: the given model first, then drawn around it.
    pub starts: usize,
    /// Seed of the drawn starts.
    pub seed: u64,
}

impl Default for Bistatic {
    fn default() -> Self {
        Bistatic { starts: 8, seed: 0 }
    }
}

/// The result of a bistatic fit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BistaticResult {
    /// The fitted model.
    pub model: Brdf,
    /// Root mean square of model over measurement, dB.
    pub rms_db: f64,
    /// Whether the search ended at an optimum.
    pub converged: bool,
    /// Why it ended.
    pub stop: Stop,
    /// Starts that came within 1 % of the best rms.
    pub agreeing_starts: usize,
}

/// Level of a model that scatters nothing, dB.
const NOTHING_DB: f64 = -200.0;
const SEARCH: Minimise = Minimise { iterations: 300, tolerance: 1e-6, patience: usize::MAX };
/// Step of the derivatives in the search.
const STEP: f64 = 1e-6;

impl Bistatic {
    /// Fits a model, starting at it as given.
    ///
    /// # Errors
    /// A start out of range, a sample that is not above 0, fewer samples than unknowns.
    pub fn run(&self, start: &Brdf, samples: &[Sample]) -> Result<BistaticResult, FitError> {
        let coordinates = Coordinates::of_pairs(start, &frequencies(start), &[], Some(1.0))?;
        self.validate(samples, coordinates.len())?;
        let bounds = [coordinates.lower(), coordinates.upper()];
        // The rms of every start with where it ended, the given start first.
        let mut found = Vec::new();
        for number in 0..self.starts {
            let start = match number {
                0 => coordinates.start(),
                _ => coordinates.drawn(self.seed, number),
            };
            let end = SEARCH.run_with(
                &start,
                [&bounds[0], &bounds[1]],
                |at| half_squares(&levels_db(&coordinates.model(at), samples), samples),
                |at| local(&coordinates, samples, at),
            );
            found.push(((2.0 * end.local.value / samples.len() as f64).sqrt(), end));
        }
        let Some((rms_db, best)) = found.iter().min_by(|(a, _), (b, _)| a.total_cmp(b)) else {
            return Err(FitError::Empty);
        };
        Ok(BistaticResult {
            model: coordinates.model(&best.at),
            rms_db: *rms_db,
            converged: best.converged(),
            stop: best.stop,
            agreeing_starts: found.iter().filter(|(rms, _)| *rms <= 1.01 * rms_db).count(),
        })
    }

    fn validate(&self, samples: &[Sample], unknowns: usize) -> Result<(), FitError> {
        if !(1..=1000).contains(&self.starts) {
            let value = self.starts as f64;
            return Err(FitError::Setting { name: "starts", value, min: 1.0, max: 1000.0 });
        }
        if samples.is_empty() {
            return Err(FitError::Empty);
        }
        if unknowns == 0 {
            return Err(FitError::NothingFree);
        }
        let detected = samples.len();
        if detected < unknowns {
            return Err(FitError::TooFewRows { detected, unknowns });
        }
        for (row, &Sample { f_per_sr: value, .. }) in samples.iter().enumerate() {
            if !(value.is_finite() && value > 0.0) {
                return Err(FitError::Row { row, name: "f_per_sr", value, wanted: "not above 0" });
            }
        }
        Ok(())
    }
}

/// ½Σ of squared residuals in dB.
fn local(coordinates: &Coordinates, samples: &[Sample], at: &DVector<f64>) -> Local {
    let upper = coordinates.upper();
    let directions: Vec<_> = samples.iter().map(|sample| [sample.i, sample.o]).collect();
    let by_parts = ByParts::new(&coordinates.model(at), &directions);
    let here = levels_of_db(&by_parts.f_per_sr());
    let moved = step_each(at, &upper, STEP, |there| {
        let there = by_parts.moved_to(&coordinates.model(there), &directions);
        levels_of_db(&there.f_per_sr())
    });
    let mut sum = Local::zero(at.len());
    for (row, (sample, level_db)) in samples.iter().zip(&here).enumerate() {
        let residual = level_db - db_from_ratio(sample.f_per_sr);
        let jacobian: Vec<f64> =
            moved.iter().map(|(step, there)| (there[row] - level_db) / step).collect();
        sum.add(residual, 1.0, &jacobian);
    }
    sum.value = half_squares(&here, samples);
    sum
}

/// ½Σ of squared residuals of levels, dB².
fn half_squares(levels_db: &[f64], samples: &[Sample]) -> f64 {
    let residuals =
        samples.iter().zip(levels_db).map(|(sample, db)| db - db_from_ratio(sample.f_per_sr));
    residuals.map(|residual| 0.5 * residual * residual).sum()
}

/// Levels of a model in the directions of the samples, dB.
fn levels_db(model: &Brdf, samples: &[Sample]) -> Vec<f64> {
    let of_samples = samples.iter().map(|sample| model.f_per_sr(sample.i, sample.o));
    levels_of_db(&of_samples.collect::<Vec<f64>>())
}

fn levels_of_db(f_per_sr: &[f64]) -> Vec<f64> {
    f_per_sr.iter().map(|f_per_sr| db_from_ratio(*f_per_sr).max(NOTHING_DB)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{CookTorrance, Distribution, Lambert, Shadowing, Sum};

    fn lobe_and_floor(f_lambda: f64, m: f64, albedo: f64) -> Brdf {
        let lobe = CookTorrance {
            f_lambda,
            m,
            m_across: None,
            distribution: Distribution::Ggx,
            shadowing: Shadowing::Separable,
        };
        Brdf::Sum(Sum { parts: vec![Brdf::Lambert(Lambert { albedo }), Brdf::CookTorrance(lobe)] })
    }

    fn scan(truth: &Brdf) -> Vec<Sample> {
        let directions = (-80..=80).flat_map(|o: i32| [10.0, 30.0, 50.0].map(|i: f64| (i, o)));
        directions
            .map(|(i_deg, o_deg)| {
                let i = Direction::from_angles(i_deg.to_radians(), std::f64::consts::PI);
                let o = Direction::from_angles(f64::from(o_deg).to_radians(), 0.0);
                Sample { i, o, f_per_sr: truth.f_per_sr(i, o) }
            })
            .collect()
    }

    #[test]
    fn a_lobe_over_a_floor_is_found_from_a_bistatic_scan() {
        let truth = lobe_and_floor(0.03, 0.3, 0.04);
        let start = lobe_and_floor(0.1, 0.15, 0.2);
        let found = Bistatic::default().run(&start, &scan(&truth)).unwrap();
        assert!(found.converged && found.rms_db < 1e-3, "{found:?}");
        for (a, b) in found.model.parameters().iter().zip(truth.parameters()) {
            assert!((a.value / b.value - 1.0).abs() < 1e-3, "{a:?} {b:?}");
        }
    }

    #[test]
    fn samples_without_a_meaning_are_refused() {
        let truth = lobe_and_floor(0.03, 0.3, 0.04);
        let mut samples = scan(&truth);
        assert_eq!(Bistatic::default().run(&truth, &[]), Err(FitError::Empty));
        let few = Bistatic::default().run(&truth, &samples[..2]);
        assert_eq!(few, Err(FitError::TooFewRows { detected: 2, unknowns: 3 }));
        samples[4].f_per_sr = f64::NAN;
        let message = Bistatic::default().run(&truth, &samples).unwrap_err().to_string();
        assert!(message.contains("row 4") && message.contains("f_per_sr"), "{message}");
        let none = Bistatic { starts: 0, ..Bistatic::default() };
        assert!(none.run(&truth, &samples).unwrap_err().to_string().contains("fit.starts"));
    }
}
