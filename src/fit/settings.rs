//! Settings of a fit and their ranges.

use serde::{Deserialize, Serialize};

use super::error::FitError;

/// Name of the looks of the speckle among the numbers of a fit.
pub(crate) const LOOKS: &str = "looks";

/// Estimator of the parameters.
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
    /// The estimator.
    pub method: Method,
    /// Parameters fixed at a value, by path.
    pub fixed: Vec<(String, f64)>,
    /// Narrower ranges, by the name that [`Estimate::name`](crate::material::Estimate::name) gives, in the parameter's unit.
    pub bounds: Vec<(String, [f64; 2])>,
    /// Looks L of the speckle, from 0.1 to 1e4; `None` to estimate them. Least squares does not use them.
    pub looks: Option<f64>,
    /// Divergence of the beam with which the curve was measured, rad, from 10⁻⁶ to π/2: the model is then that of the
    /// surface alone, and the beam widens its lobes. `None`: they are those of radar and surface together.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub beam_rad: Option<f64>,
    /// Mean thermal power in each chirp, W, 0 or more; none for a receiver without noise. Least squares
    /// does not use it.
    pub noise_w: Option<f64>,
    /// Points that the search starts from, 1 to 1000: the given model, then the best among all shapes of its lobes, then
    /// points drawn around it.
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
            beam_rad: None,
            noise_w: None,
            starts: 4,
            seed: 0,
        }
    }
}

impl Fit {
    /// Refuses a setting outside its range.
    pub(super) fn validate(&self) -> Result<(), FitError> {
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
            ("beam_rad", self.beam_rad.unwrap_or(1e-6), 1e-6, QUARTER),
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
