//! A curve → the parameters of a scattering model, and what the curve cannot tell apart.
//!
//! A detected power of chirp i follows Gamma(L, μ_i/L), L looks of speckle on the mean
//! μ_i = σ⁰(t_i) + noise; a chirp without a detection says that this power stayed below a threshold. The
//! default [`Method::Censored`] maximises the likelihood of both, averaged over the true angle
//! t_i. The paper's least squares in decibels are there for comparison: they cannot see the missing
//! chirps, and speckle in decibels is not of zero mean.
//!
//! ```
//! use matdb::brdf::{Brdf, Lambert};
//! use matdb::fit::Fit;
//! use matdb::measure::curve::Curve;
//! let curve = Curve::read(b"theta_deg,sigma0_db\n0,0.1\n20,-0.7\n40,-2.2\n60,-6.1\n")?;
//! let fit = Fit { looks: Some(100.0), ..Fit::default() };
//! let found = fit.run(&Brdf::Lambert(Lambert { albedo: 0.5 }), &curve)?;
//! assert!(found.converged && (found.estimates[0].value - 0.25).abs() < 0.03);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod again;
mod angle;
pub mod bistatic;
pub(crate) mod coordinates;
pub(crate) mod gamma_law;
mod goodness;
pub(crate) mod held_out;
mod interval;
mod least_squares;
mod likelihood;
pub(crate) mod minimise;
mod models;
mod result;
mod search;
mod sensitivity;
mod stored;
mod table;
#[cfg(test)]
mod twin;
pub(crate) mod uncertainty;
mod verdict;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::brdf::{Brdf, ParameterError};
use crate::measure::curve::{Curve, Row};
use crate::units::shown;

pub use goodness::Goodness;
pub(crate) use goodness::normal_share;
pub use minimise::Stop;
pub use models::{model, model_names};
pub use result::{Band, Estimate, FitResult};
pub use stored::stored_band;
pub use verdict::Finding;

use coordinates::Coordinates;

/// How a curve is turned into parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Least squares in dB in two pieces: specular parameters below the split, then, these frozen, the
    /// diffuse ones above it.
    Mse {
        /// Where the specular piece ends, rad, from 0 to π/2; the paper's is 6°.
        split_rad: f64,
    },
    /// Orthogonal distance in (θ, dB), all parameters at once. With α among
    /// [`fixed`](Fit::fixed) it is the paper's fit with a tail set by hand.
    Tls {
        /// Standard deviation of θ, rad, from 0 (exact) to π/2.
        theta_sd_rad: f64,
        /// Standard deviation of the level, dB, above 0 and up to 100.
        level_sd_db: f64,
    },
    /// Gamma likelihood of detections, probability of missing ones, averaged over the angle error.
    #[default]
    Censored,
}

/// Settings of a fit. The default is the censored likelihood with everything free.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Fit {
    /// How.
    pub method: Method,
    /// Parameters held at a value, by path.
    pub fixed: Vec<(String, f64)>,
    /// Narrower ranges, by the name that [`Estimate::name`] gives, in the parameter's unit.
    pub bounds: Vec<(String, [f64; 2])>,
    /// Looks L of the speckle, from 0.1 to 1e4; estimated where none. Least squares needs none.
    pub looks: Option<f64>,
    /// Mean thermal power in each chirp, W, 0 or more; none for a receiver without noise. Least squares
    /// does not use it.
    pub noise_w: Option<f64>,
    /// Points that the search starts from, 1 to 1000: the given model first, then drawn around it.
    pub starts: usize,
    /// Seed of the drawn starts and of the randomised residuals.
    pub seed: u64,
}

impl Default for Fit {
    fn default() -> Self {
        let (fixed, bounds) = (Vec::new(), Vec::new());
        Fit {
            method: Method::Censored,
            fixed,
            bounds,
            looks: None,
            noise_w: None,
            starts: 4,
            seed: 0,
        }
    }
}

/// A fit that cannot be tried.
#[derive(Debug, Error, PartialEq)]
pub enum FitError {
    /// No rows.
    #[error("the curve has no rows; give it at least one for each free parameter")]
    Empty,
    /// Upper limits only.
    #[error(
        "all {rows} rows are censored and give only upper limits; measure nearer or add detections"
    )]
    AllCensored {
        /// How many.
        rows: usize,
    },
    /// As many unknowns as detections, or more.
    #[error(
        "{detected} detections cannot give {unknowns} unknowns and their errors; fix parameters or add rows"
    )]
    TooFewRows {
        /// Detections.
        detected: usize,
        /// Numbers to find.
        unknowns: usize,
    },
    /// A row without a meaning.
    #[error("row {row} (from 0) has {name} = {}, {wanted}; correct or remove it", shown(*value))]
    Row {
        /// Which.
        row: usize,
        /// Its field.
        name: &'static str,
        /// The value.
        value: f64,
        /// What it should be.
        wanted: &'static str,
    },
    /// A name that the model does not have.
    #[error(
        "the model has no free `{name}`; `fixed` takes the model's paths, `bounds` what is fitted"
    )]
    UnknownParameter {
        /// The name.
        name: String,
    },
    /// Bounds outside the range or upside down.
    #[error(
        "bounds of {name} are {} and {}; give the smaller first, both from {} to {}",
        shown(*min), shown(*max), shown(range[0]), shown(range[1])
    )]
    Bounds {
        /// Whose.
        name: String,
        /// Lower.
        min: f64,
        /// Upper.
        max: f64,
        /// What is allowed.
        range: [f64; 2],
    },
    /// A setting out of range.
    #[error("fit.{name} = {} is out of range; give a value from {} to {}", shown(*value), shown(*min), shown(*max))]
    Setting {
        /// Its name.
        name: &'static str,
        /// The value.
        value: f64,
        /// Smallest.
        min: f64,
        /// Largest.
        max: f64,
    },
    /// A start or fixed value out of range.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// A model without free parameters.
    #[error("nothing is left to fit; free a parameter or choose a model that has some")]
    NothingFree,
}

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
        if coordinates.list.iter().all(|c| c.name == coordinates::LOOKS) {
            return Err(FitError::NothingFree);
        }
        match curve.detected().count() {
            0 => Err(FitError::AllCensored { rows: curve.rows.len() }),
            // As many as unknowns are met exactly, and nothing is left to judge the errors by.
            detected if detected <= unknowns => Err(FitError::TooFewRows { detected, unknowns }),
            _ => Ok(FitResult::new(self, coordinates, curve)),
        }
    }

    fn validate(&self) -> Result<(), FitError> {
        const QUARTER: f64 = std::f64::consts::FRAC_PI_2;
        let method = match self.method {
            Method::Mse { split_rad } => vec![("method.split_rad", split_rad, 0.0, QUARTER)],
            Method::Tls { theta_sd_rad, level_sd_db } => vec![
                ("method.theta_sd_rad", theta_sd_rad, 0.0, QUARTER),
                ("method.level_sd_db", level_sd_db, 1e-6, 100.0),
            ],
            Method::Censored => Vec::new(),
        };
        let settings = [
            ("looks", self.looks.unwrap_or(1.0), 0.1, 1e4),
            ("noise_w", self.noise_w.unwrap_or(0.0), 0.0, 1e3),
            ("starts", self.starts as f64, 1.0, 1000.0),
        ];
        for (name, value, min, max) in settings.into_iter().chain(method) {
            if !(min..=max).contains(&value) {
                return Err(FitError::Setting { name, value, min, max });
            }
        }
        Ok(())
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
