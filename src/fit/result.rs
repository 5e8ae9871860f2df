//! The result of a fit: the model, its numbers with their uncertainty, and what is needed to repeat the fit.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::coordinates::Coordinates;
use super::interval::DEVIATE_95;
use super::minimise::Stop;
use super::sensitivity::derivatives;
use super::settings::Fit;
use super::table::{Aspects, Table};
use super::verdict::Finding;
use crate::brdf::{Brdf, ThroughBeam};
use crate::material::{Aspect, CrossValidation, Estimate, Goodness};

/// A 95 % band of the fitted mean σ⁰.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Band {
    /// Lower end, a pure number.
    pub low: f64,
    /// The fit.
    pub mid: f64,
    /// Upper end.
    pub high: f64,
}

/// The result of a fit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FitResult {
    /// The settings.
    pub fit: Fit,
    /// The fitted model, with the k of [`gauge_k`](Self::gauge_k).
    pub model: Brdf,
    /// k as chosen where only the products S and R were found; `None` for other models.
    pub gauge_k: Option<f64>,
    /// The fitted numbers.
    pub estimates: Vec<Estimate>,
    /// Covariance of the fitted numbers, in the order of `estimates`, without the directions that the data do not
    /// determine; rows and columns of those at a bound are 0.
    pub covariance: Vec<Vec<f64>>,
    /// Singular values of the information, scaled to a unit diagonal, largest first; a millionth
    /// of the first is an unseen direction.
    pub singular_values: Vec<f64>,
    /// Looks L: given or estimated; `None` for least squares.
    pub looks: Option<f64>,
    /// Thermal power used, W.
    pub noise_w: f64,
    /// ln likelihood per unit of ln power (default method), else half the sum of scaled squares, negative.
    pub objective: f64,
    /// How well the rows are explained.
    pub goodness: Goodness,
    /// How well the fit predicts rows that took no part in it, as [`FitResult::hold_out`] returns; none until then.
    pub held_out: Option<CrossValidation>,
    /// Whether the search ended at an optimum.
    pub converged: bool,
    /// Why it ended.
    pub stop: Stop,
    /// Steps of the best start.
    pub iterations: usize,
    /// Starts that reached the best fit.
    pub agreeing_starts: usize,
    /// Findings that limit the use of the fit.
    pub verdict: Vec<Finding>,
    /// Hash (BLAKE3, hexadecimal) of the rows as numbers.
    pub data_hash: String,
    /// Version of this crate.
    pub version: &'static str,
    #[serde(skip)]
    pub(super) coordinates: Coordinates,
    #[serde(skip)]
    pub(super) at: DVector<f64>,
    #[serde(skip)]
    pub(super) covariance_searched: DMatrix<f64>,
}

impl FitResult {
    /// The fitted mean σ⁰ at an angle, as the beam of the curve sees it, with its 95 % band, by the delta method on ln σ⁰.
    ///
    /// Directions that the data do not determine and numbers at a bound do not widen it.
    pub fn band(&self, theta_rad: f64) -> Band {
        self.band_of(Aspect::retro(theta_rad))
    }

    /// The same in any aspect.
    pub fn band_of(&self, aspect: Aspect) -> Band {
        let (angles, places) = Aspects::of(&[aspect]);
        let here = self.coordinates.table(&self.at, &angles);
        let by = derivatives(&self.coordinates, &self.at, &angles, &here);
        let slope =
            |table: &Option<Table>| table.as_ref().map_or(0.0, |table| table.at(&places[0]));
        let slopes = DVector::from_iterator(self.at.len(), by.iter().map(slope));
        let variance = slopes.dot(&(&self.covariance_searched * &slopes));
        let factor = (DEVIATE_95 * variance.max(0.0).sqrt()).exp();
        let beam_rad = self.fit.beam_rad.unwrap_or(0.0);
        let mid = aspect.sigma0(&ThroughBeam { law: &self.model, beam_rad });
        Band { low: mid / factor, mid, high: mid * factor }
    }

    /// A fitted number by its name.
    pub fn estimate(&self, name: &str) -> Option<&Estimate> {
        self.estimates.iter().find(|estimate| estimate.name == name)
    }
}
