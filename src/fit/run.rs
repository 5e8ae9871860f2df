//! A fit from its settings: checks what is given, then searches.

use super::coordinates::{Coordinates, LOOKS};
use super::error::FitError;
use super::result::FitResult;
use super::settings::{Fit, Method};
use crate::brdf::Brdf;
use crate::measure::curve::{Curve, Row};

impl Fit {
    /// Fits a model to a curve, starting at the model as given.
    ///
    /// # Errors
    /// A setting, a start or a row without a meaning, a curve without detections or with fewer than
    /// unknowns. Whatever else the data cannot tell is in the [verdict](FitResult::verdict).
    pub fn run(&self, start: &Brdf, curve: &Curve) -> Result<FitResult, FitError> {
        self.validate()?;
        check_rows(&curve.rows)?;
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
            0 => Err(FitError::AllCensored { rows: curve.rows.len() }),
            // As many as unknowns are met exactly, and nothing is left to judge the errors by.
            detected if detected <= unknowns => Err(FitError::TooFewRows { detected, unknowns }),
            _ => Ok(FitResult::new(self, coordinates, curve)),
        }
    }
}

fn check_rows(rows: &[Row]) -> Result<(), FitError> {
    if rows.is_empty() {
        return Err(FitError::Empty);
    }
    let angle = 0.0..=std::f64::consts::FRAC_PI_2;
    for (index, row) in rows.iter().enumerate() {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        let checks = [
            ("theta_rad", row.theta_rad, angle.contains(&row.theta_rad), "not from 0 to π/2"),
            (
                "theta_sd_rad",
                row.theta_sd_rad,
                angle.contains(&row.theta_sd_rad),
                "not from 0 to π/2",
            ),
            ("sigma0", row.sigma0, positive(row.sigma0), "not above 0"),
            ("power_w", row.power_w, positive(row.power_w), "not above 0"),
        ];
        for (name, value, good, wanted) in checks {
            if !good {
                return Err(FitError::Row { row: index, name, value, wanted });
            }
        }
    }
    Ok(())
}
