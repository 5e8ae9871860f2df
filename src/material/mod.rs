//! A material as a plain value: what is known of it, from whom, and how it scatters.
//!
//! Inside are SI units, linear σ⁰ and radians. [`mod@file`] reads and writes the form people edit;
//! [`builtin`] holds the catalogue that comes with the program.

pub mod builtin;
mod check;
mod composition;
pub mod file;
mod finding;
pub mod form;
mod instrument;
mod provenance;
mod reach;
mod report;
mod slug;
mod status;
mod texts;

use std::io;

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use serde_json::ser::{CompactFormatter, Formatter, Serializer};

use crate::brdf::{Brdf, Tabulated};
use crate::formats::EffectEntry;

pub use check::MaterialError;
pub use composition::{Layer, Permittivity, Roughness};
pub use finding::{Finding, FindingVerdict};
pub use instrument::{Geometry, Instrument, Scale};
pub use provenance::{
    Activity, Citation, Input, Making, Origin, Session, SessionPose, Source, SourceKind,
    USUAL_TITLE,
};
pub use reach::Reach;
pub use report::{ChosenBy, Estimate, FitReport, Given, Goodness, HeldOut, Told};
pub use slug::Slug;
pub use status::Status;
pub use texts::{LONGEST_TEXT_BYTES, is_turning, turns_the_line};

/// One revision of a material.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Material {
    /// Short name that commands and scenes use.
    pub slug: Slug,
    /// Full name.
    pub name: String,
    /// Kind of stuff: `metal`, `polymer`, `paint`, `tissue`, `textile`, `glass` …
    pub class: String,
    /// What it is and what is not known of it.
    pub description: String,
    /// SPDX identifier of the licence under which this entry may be passed on.
    pub licence: String,
    /// Free words to find it by.
    pub tags: Vec<String>,
    /// Lowest and highest frequency for which the numbers are claimed, Hz.
    pub frequency_hz: [f64; 2],
    /// Smallest and largest angle of incidence for which they are claimed, rad.
    pub theta_rad: [f64; 2],
    /// Which fit or curve a scene renders.
    pub render: String,
    /// Where numbers come from; everything below refers to these by key.
    pub sources: Vec<Source>,
    /// What curves were measured with.
    pub instruments: Vec<Instrument>,
    /// Scattering curves.
    pub curves: Vec<Curve>,
    /// Scattering models with their parameters.
    pub fits: Vec<Fit>,
    /// Physical effects beyond the scattering model, each once.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<EffectEntry>,
    /// Whether it may still be used.
    #[serde(skip_serializing_if = "Status::is_active")]
    pub status: Status,
    /// How the surface was made: rolled, sanded with grit 120, sprayed …
    #[serde(skip_serializing_if = "Option::is_none")]
    pub finish: Option<String>,
    /// What is not known, a sentence each.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub unknown: Vec<String>,
    /// How rough the outer surface is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roughness: Option<Roughness>,
    /// What it is made of, the outermost layer first.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub layers: Vec<Layer>,
    /// Permittivities of its substances.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub permittivities: Vec<Permittivity>,
    /// Sittings in which its curves were measured.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sessions: Vec<Session>,
    /// What diagnoses tried to explain it with.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub findings: Vec<Finding>,
}

/// A scattering curve: observations in the order of the file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Curve {
    /// Name, unique among the material's curves and fits.
    pub name: String,
    /// Key of its source.
    pub source: String,
    /// Key of the instrument; none for a curve that nobody measured.
    pub instrument: Option<String>,
    /// Key of the session in which it was measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub session: Option<String>,
    /// The points.
    pub observations: Vec<Observation>,
}

/// One point of a curve. In backscatter θ_r = θ_i and Δφ = 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Observation {
    /// Angle of incidence, rad.
    pub theta_i_rad: f64,
    /// Angle of reflection, rad.
    pub theta_r_rad: f64,
    /// Azimuth between the two, rad.
    pub delta_phi_rad: f64,
    /// σ⁰ as a ratio; `None` exactly when censored.
    pub sigma0: Option<f64>,
    /// Whether, and on which side, the value is only a bound.
    pub censor: Censor,
    /// Detection limit that applied, σ⁰ as a ratio.
    pub threshold_sigma0: Option<f64>,
    /// Standard deviation of each of the two tilts of the normal against the ray, rad, 0 to π/2.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub theta_sd_rad: Option<f64>,
    /// Received power, W, above 0; of a left-censored point the least that would have been detected.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub power_w: Option<f64>,
    /// Range R, m, 0 or more.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range_m: Option<f64>,
    /// Number of the chirp.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chirp: Option<u32>,
    /// Place on the target, (x_t, y_t) of the frame `St`, m; of a silent chirp where its ray meets the mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_m: Option<[f64; 2]>,
}

/// What an observation says of the true value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Censor {
    /// It was measured.
    None,
    /// It lies below the threshold.
    Left,
    /// It lies above the threshold.
    Right,
}

impl Censor {
    /// The word that files and the database use.
    pub fn as_str(self) -> &'static str {
        match self {
            Censor::None => "none",
            Censor::Left => "left",
            Censor::Right => "right",
        }
    }
}

/// A scattering model with numbers in it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fit {
    /// Name, unique among the material's curves and fits.
    pub name: String,
    /// The model and its values.
    pub model: Brdf,
    /// How the values were found: `stated` when the sources give them.
    pub estimator: String,
    /// The curve that was fitted, if one was.
    pub curve: Option<String>,
    /// Key of the source of every parameter that has none of its own.
    pub source: String,
    /// Parameters with a source of their own, by path, sorted.
    pub parameter_sources: Vec<(String, String)>,
    /// Covariance of the values; none when they carry no uncertainty.
    pub covariance: Option<Covariance>,
    /// What a fit of the curve said of itself; none for values that were stated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub report: Option<FitReport>,
}

/// Covariance of some of a model's parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Covariance {
    /// Paths of the parameters.
    pub parameters: Vec<String>,
    /// Symmetric and positive definite, row by row, in the parameters' units.
    pub matrix: Vec<Vec<f64>>,
}

impl Material {
    /// The scattering that a scene renders.
    ///
    /// # Errors
    /// When `render` names nothing, or a curve that cannot be interpolated.
    pub fn scattering(&self) -> Result<Brdf, MaterialError> {
        if let Some(fit) = self.fits.iter().find(|f| f.name == self.render) {
            return Ok(fit.model.clone());
        }
        let Some(curve) = self.curves.iter().find(|c| c.name == self.render) else {
            return Err(check::dangling(
                "render",
                "a fit or curve",
                &self.render,
                self.renderable(),
            ));
        };
        curve.tabulated().map(Brdf::Tabulated)
    }

    /// The source of the numbers that a scene renders.
    pub fn render_kind(&self) -> Option<SourceKind> {
        let fits = self.fits.iter().map(|f| (&f.name, &f.source));
        let curves = self.curves.iter().map(|c| (&c.name, &c.source));
        let key = fits.chain(curves).find(|(name, _)| **name == self.render)?.1;
        self.sources.iter().find(|s| s.key == *key).map(|s| s.kind)
    }

    /// What is said of a model that goes with a curve in place of its source's kind: nobody measured the
    /// model itself; none without a curve.
    pub fn kind_words(&self, fit: &Fit) -> Option<String> {
        let curve = self.curves.iter().find(|curve| Some(&curve.name) == fit.curve.as_ref())?;
        let source = self.sources.iter().find(|source| source.key == curve.source)?;
        Some(source.kind.words_beside(fit.is_fitted()))
    }

    /// The same of what scenes render; none of a curve, and of a model without one.
    pub fn rendered_words(&self) -> Option<String> {
        self.kind_words(self.fits.iter().find(|fit| fit.name == self.render)?)
    }

    /// How far a frequency, Hz, lies outside [`frequency_hz`](Material::frequency_hz), Hz; 0 within.
    pub fn frequency_outside_hz(&self, frequency_hz: f64) -> f64 {
        reach::outside(self.frequency_hz, frequency_hz)
    }

    /// Hash of everything in the material: equal exactly when nothing differs.
    ///
    /// Databases keep it: a field added later must serialise to nothing while it is empty, or what
    /// was stored before no longer matches its hash.
    pub fn content_hash(&self) -> String {
        let mut json = Vec::new();
        // Serialising a tree of plain structs into memory has no way to fail.
        let _ = self.serialize(&mut Serializer::with_formatter(&mut json, OneZero));
        blake3::hash(&json).to_hex().to_string()
    }

    fn renderable(&self) -> Vec<String> {
        let fits = self.fits.iter().map(|f| f.name.clone());
        fits.chain(self.curves.iter().map(|c| c.name.clone())).collect()
    }
}

/// Angles nearer than this, rad, differ by rounding only.
const SAME_ANGLE_RAD: f64 = 1e-12;

/// Writes −0 as 0: the two are equal, so they must hash alike.
struct OneZero;

impl Formatter for OneZero {
    fn write_f64<W: ?Sized + io::Write>(&mut self, writer: &mut W, value: f64) -> io::Result<()> {
        CompactFormatter.write_f64(writer, value + 0.0)
    }
}

impl Curve {
    /// The curve as a scattering model: its detections in backscatter, sorted by angle, equal angles
    /// averaged in linear σ⁰. Where only left-censored points follow, nothing comes back.
    ///
    /// # Errors
    /// When detections at fewer than two angles are left, or a point is right-censored: its true
    /// value is not known and no bound would render it.
    pub fn tabulated(&self) -> Result<Tabulated, MaterialError> {
        let retro = || self.observations.iter().filter(|o| o.is_retro());
        if retro().any(|o| o.censor == Censor::Right) {
            let place = format!("curve `{}`", self.name);
            let way_out = "fit a model to it and render that";
            return Err(check::value(&place, "has points above the instrument's range", way_out));
        }
        let mut points: Vec<(f64, f64)> =
            retro().filter_map(|o| Some((o.theta_i_rad, o.sigma0?))).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let merged: Vec<(f64, f64)> = points
            .chunk_by(|a, b| b.0 - a.0 < SAME_ANGLE_RAD)
            .map(|same| (same[0].0, same.iter().map(|p| p.1).sum::<f64>() / same.len() as f64))
            .collect();
        let last_rad = merged.last().map_or(0.0, |point| point.0);
        let silent_rad = retro()
            .filter(|o| o.censor == Censor::Left && o.theta_i_rad > last_rad + SAME_ANGLE_RAD)
            .map(|o| o.theta_i_rad)
            .min_by(f64::total_cmp);
        Tabulated::new(&merged)
            .and_then(|curve| match silent_rad {
                Some(theta_rad) => curve.silent_from(theta_rad),
                None => Ok(curve),
            })
            .map_err(|error| MaterialError::Curve { curve: self.name.clone(), error })
    }
}

impl Observation {
    /// A point of backscatter of which no more is known than its σ⁰ or, without one, the limit that it
    /// stayed below.
    pub fn backscatter(theta_rad: f64, sigma0: Option<f64>, threshold_sigma0: Option<f64>) -> Self {
        Observation {
            theta_i_rad: theta_rad,
            theta_r_rad: theta_rad,
            delta_phi_rad: 0.0,
            sigma0,
            censor: if sigma0.is_some() { Censor::None } else { Censor::Left },
            threshold_sigma0,
            theta_sd_rad: None,
            power_w: None,
            range_m: None,
            chirp: None,
            target_m: None,
        }
    }

    /// A point of backscatter with the σ⁰ that was measured or, where it is censored, the limit that it stayed below.
    pub fn of_level(theta_rad: f64, sigma0: f64, is_censored: bool) -> Self {
        let (level, limit) = if is_censored { (None, Some(sigma0)) } else { (Some(sigma0), None) };
        Observation::backscatter(theta_rad, level, limit)
    }

    /// The measured σ⁰, or the limit of a censored point; none where the point has neither.
    pub fn level_sigma0(&self) -> Option<f64> {
        if self.is_censored() { self.threshold_sigma0 } else { self.sigma0 }
    }

    /// Whether the true σ⁰ is known only to lie below or above the limit.
    pub fn is_censored(&self) -> bool {
        self.censor != Censor::None
    }

    /// Whether source and receiver were in the same direction.
    pub fn is_retro(&self) -> bool {
        self.theta_i_rad == self.theta_r_rad && self.delta_phi_rad == 0.0
    }
}

impl Fit {
    /// The [`estimator`](Fit::estimator) of values that nobody fitted.
    pub const STATED: &str = "stated";

    /// Whether its values come of its curve.
    pub fn is_fitted(&self) -> bool {
        self.curve.is_some() && self.estimator != Fit::STATED
    }
}

impl Covariance {
    /// Standard deviation of a parameter, in its unit; `None` when it has no row here.
    pub fn standard_deviation(&self, path: &str) -> Option<f64> {
        let row = self.parameters.iter().position(|p| p == path)?;
        Some(self.matrix.get(row)?.get(row)?.sqrt())
    }

    /// Whether the matrix is square, symmetric, finite and positive definite.
    pub fn is_sound(&self) -> bool {
        let n = self.parameters.len();
        if self.matrix.len() != n || self.matrix.iter().any(|row| row.len() != n) {
            return false;
        }
        let matrix = DMatrix::from_fn(n, n, |i, j| self.matrix[i][j]);
        let deviations: Vec<f64> = matrix.diagonal().iter().map(|v| v.sqrt()).collect();
        // As correlations, so that units do not matter; rounding in a file may reach a little past 1.
        let correlations = DMatrix::from_fn(n, n, |i, j| {
            let slack = if i == j { 1e-9 } else { 0.0 };
            matrix[(i, j)] / (deviations[i] * deviations[j]) + slack
        });
        matrix == matrix.transpose()
            && deviations.iter().all(|d| *d > 0.0 && d.is_finite())
            && correlations.cholesky().is_some()
    }
}
