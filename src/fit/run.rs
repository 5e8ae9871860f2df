//! A fit from its settings: checks what is given, then searches.

use super::coordinates::{Coordinates, LOOKS};
use super::error::FitError;
use super::result::FitResult;
use super::settings::{Fit, Method};
use crate::brdf::Brdf;
use crate::material::Observation;
use crate::measure::curve::{Curve, backscatter_level};

impl Fit {
    /// Fits a model to a curve, starting at the model as given.
    ///
    /// # Errors
    /// A setting, a start or a row without a meaning, a curve without detections or with fewer than
    /// unknowns. Whatever else the data cannot tell is in the [verdict](FitResult::verdict).
    pub fn run(&self, start: &Brdf, curve: &Curve) -> Result<FitResult, FitError> {
        self.validate()?;
        check_rows(&curve.observations)?;
        let looks = match self.method {
            Method::Censored => self.looks,
            Method::Mse { .. } | Method::Tls { .. } => Some(self.looks.unwrap_or(1.0)),
        };
        let coordinates = Coordinates::new(start, &self.fixed, &self.bounds, looks)?;
        let unknowns = coordinates.len();
        if coordinates.list.iter().all(|c| c.name == LOOKS) {
            return Err(FitError::NothingFree);
        }
        match curve.detected().count() {
            0 => Err(FitError::AllCensored { rows: curve.observations.len() }),
            // As many as unknowns are met exactly, and nothing is left to judge the errors by.
            detected if detected <= unknowns => Err(FitError::TooFewRows { detected, unknowns }),
            _ => Ok(FitResult::new(self, coordinates, curve)),
        }
    }
}

fn check_rows(rows: &[Observation]) -> Result<(), FitError> {
    if rows.is_empty() {
        return Err(FitError::Empty);
    }
    rows.iter().enumerate().try_for_each(|(index, row)| check_row(index, row))
}

/// Refuses a row that is not backscatter or has a number without a meaning; `row` counts from 0.
fn check_row(row: usize, observation: &Observation) -> Result<(), FitError> {
    const QUARTER_RAD: f64 = std::f64::consts::FRAC_PI_2;
    let theta_sd_rad = observation.theta_sd_rad.unwrap_or(0.0);
    for (name, value) in [("theta_rad", observation.theta_i_rad), ("theta_sd_rad", theta_sd_rad)] {
        if !(0.0..=QUARTER_RAD).contains(&value) {
            return Err(FitError::Row { row, name, value, wanted: "not from 0 to π/2" });
        }
    }
    let sigma0 = backscatter_level(row, observation)?;
    for (name, value) in [("sigma0", sigma0), ("power_w", observation.power_w.unwrap_or(sigma0))] {
        if !(value.is_finite() && value > 0.0) {
            return Err(FitError::Row { row, name, value, wanted: "not above 0" });
        }
    }
    Ok(())
}
