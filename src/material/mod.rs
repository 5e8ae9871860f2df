//! A material as a plain value: what is known of it, from whom, and how it scatters.
//!
//! Inside are SI units, linear σ⁰ and radians. [`mod@file`] reads and writes the form people edit;
//! [`builtin`] holds the catalogue that comes with the program.

pub mod builtin;
pub mod file;
mod slug;

use std::io;

use serde::Serialize;
use serde_json::ser::{CompactFormatter, Formatter, Serializer};
use thiserror::Error;

use crate::brdf::{Brdf, ParameterError, Tabulated, TabulatedError};

pub use slug::Slug;

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
}

/// Where numbers come from.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Source {
    /// Key within the material.
    pub key: String,
    /// How the numbers came to be.
    pub kind: SourceKind,
    /// Citation or, for our own numbers, how they were made.
    pub title: String,
    /// Digital object identifier, without a resolver in front.
    pub doi: Option<String>,
    /// Address, where there is no DOI.
    pub url: Option<String>,
    /// SPDX identifier of the licence of the source's data.
    pub licence: Option<String>,
    /// What was taken and how it was turned into our numbers.
    pub note: Option<String>,
}

/// How numbers came to be. The four are never mixed up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SourceKind {
    /// Somebody measured this.
    Measured,
    /// A publication states it.
    Literature,
    /// A physical model computed it from other numbers.
    Modelled,
    /// Chosen so that something plausible can be rendered; nobody measured it.
    Synthetic,
}

impl SourceKind {
    /// The word that files and the database use.
    pub fn as_str(self) -> &'static str {
        match self {
            SourceKind::Measured => "measured",
            SourceKind::Literature => "literature",
            SourceKind::Modelled => "modelled",
            SourceKind::Synthetic => "synthetic",
        }
    }
}

/// What a curve was measured with.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Instrument {
    /// Key within the material.
    pub key: String,
    /// Name.
    pub name: String,
    /// Centre frequency, Hz.
    pub centre_frequency_hz: f64,
    /// Bandwidth, Hz.
    pub bandwidth_hz: Option<f64>,
    /// Polarisation, such as `VV`.
    pub polarisation: Option<String>,
    /// Anything a reader must know: stand-off, spot, calibration target.
    pub note: Option<String>,
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
}

/// What an observation says of the true value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, serde::Deserialize)]
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
}

/// Covariance of some of a model's parameters.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Covariance {
    /// Paths of the parameters.
    pub parameters: Vec<String>,
    /// Symmetric, positive diagonal, row by row, in the parameters' units.
    pub matrix: Vec<Vec<f64>>,
}

/// Why a material cannot be kept.
#[derive(Debug, Error, PartialEq)]
pub enum MaterialError {
    /// A parameter outside its range.
    #[error("fit `{fit}`: {error}")]
    Parameter {
        /// Name of the fit.
        fit: String,
        /// What is wrong.
        error: ParameterError,
    },
    /// A curve that cannot be rendered, though it is asked for.
    #[error("curve `{curve}` cannot be rendered: {error}")]
    Curve {
        /// Name of the curve.
        curve: String,
        /// What is wrong.
        error: TabulatedError,
    },
    /// A key or name that refers to nothing.
    #[error("{place} refers to {what} `{name}`, which is not defined; define it or name one of: {}", known.join(", "))]
    Dangling {
        /// Where the reference stands.
        place: String,
        /// What it should name.
        what: &'static str,
        /// The name.
        name: String,
        /// What there is.
        known: Vec<String>,
    },
    /// The same name twice.
    #[error("{what} `{name}` is defined twice; rename one")]
    Twice {
        /// What is named.
        what: &'static str,
        /// The name.
        name: String,
    },
    /// A value that has no meaning.
    #[error("{place}: {problem}; {way_out}")]
    Value {
        /// Where.
        place: String,
        /// What is wrong.
        problem: String,
        /// What to do.
        way_out: String,
    },
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
            return Err(self.dangling("render", "a fit or curve", &self.render, self.renderable()));
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

    /// Checks names, references, ranges and values.
    pub fn validate(&self) -> Result<(), MaterialError> {
        self.check_text()?;
        self.check_limits()?;
        unique("source", self.sources.iter().map(|s| s.key.as_str()))?;
        unique("instrument", self.instruments.iter().map(|i| i.key.as_str()))?;
        unique("fit or curve", self.renderable().iter().map(String::as_str))?;
        self.instruments.iter().try_for_each(Instrument::validate)?;
        self.curves.iter().try_for_each(|curve| self.check_curve(curve))?;
        self.fits.iter().try_for_each(|fit| self.check_fit(fit))?;
        self.scattering().map(|_| ())
    }

    fn check_text(&self) -> Result<(), MaterialError> {
        let texts = [("name", &self.name), ("class", &self.class), ("licence", &self.licence)];
        let fields = texts
            .into_iter()
            .map(|(place, text)| (place.to_owned(), text))
            .chain(self.sources.iter().map(|s| (format!("source `{}`: title", s.key), &s.title)));
        for (place, text) in fields {
            if text.trim().is_empty() {
                return Err(value(&place, "is empty", "fill it in"));
            }
        }
        if self.sources.is_empty() {
            return Err(value("material", "has no source", "add a [[source]] table"));
        }
        Ok(())
    }

    fn check_limits(&self) -> Result<(), MaterialError> {
        let ascending = |[low, high]: [f64; 2], least: f64, most: f64| {
            low >= least && high <= most && low <= high
        };
        if !ascending(self.frequency_hz, f64::MIN_POSITIVE, f64::MAX) {
            let problem = "must be two positive frequencies, the lower first";
            return Err(value("frequency_ghz", problem, "mend the range"));
        }
        if !ascending(self.theta_rad, 0.0, std::f64::consts::FRAC_PI_2) {
            let problem = "must be two angles from 0 to 90, the smaller first";
            return Err(value("theta_deg", problem, "mend the range"));
        }
        Ok(())
    }

    fn check_curve(&self, curve: &Curve) -> Result<(), MaterialError> {
        let place = format!("curve `{}`", curve.name);
        self.check_source(&place, &curve.source)?;
        if let Some(key) = &curve.instrument
            && !self.instruments.iter().any(|i| i.key == *key)
        {
            let known = self.instruments.iter().map(|i| i.key.clone()).collect();
            return Err(self.dangling(&place, "an instrument", key, known));
        }
        if curve.observations.is_empty() {
            return Err(value(&place, "has no observation", "give it at least one row"));
        }
        for (row, observation) in curve.observations.iter().enumerate() {
            observation.validate(&format!("{place}, observation {}", row + 1))?;
        }
        Ok(())
    }

    fn check_fit(&self, fit: &Fit) -> Result<(), MaterialError> {
        let place = format!("fit `{}`", fit.name);
        let known: Vec<String> = fit.model.parameters().into_iter().map(|p| p.path).collect();
        fit.model
            .validate()
            .map_err(|error| MaterialError::Parameter { fit: fit.name.clone(), error })?;
        self.check_source(&place, &fit.source)?;
        if let Some(curve) =
            fit.curve.as_ref().filter(|c| !self.curves.iter().any(|k| k.name == **c))
        {
            let known = self.curves.iter().map(|c| c.name.clone()).collect();
            return Err(self.dangling(&place, "a curve", curve, known));
        }
        for (path, source) in &fit.parameter_sources {
            self.check_source(&format!("{place}, parameter `{path}`"), source)?;
            if !known.contains(path) {
                return Err(self.dangling(&place, "a parameter", path, known));
            }
        }
        if !fit.parameter_sources.is_sorted_by(|a, b| a.0 < b.0) {
            let problem = "the sources of parameters are not sorted, or one is given twice";
            return Err(value(&place, problem, "give each path once, in alphabetical order"));
        }
        fit.covariance.as_ref().map_or(Ok(()), |covariance| covariance.validate(&place, &known))
    }

    fn check_source(&self, place: &str, key: &str) -> Result<(), MaterialError> {
        if self.sources.iter().any(|s| s.key == key) {
            return Ok(());
        }
        let known = self.sources.iter().map(|s| s.key.clone()).collect();
        Err(self.dangling(place, "a source", key, known))
    }

    fn renderable(&self) -> Vec<String> {
        let fits = self.fits.iter().map(|f| f.name.clone());
        fits.chain(self.curves.iter().map(|c| c.name.clone())).collect()
    }

    fn dangling(
        &self,
        place: &str,
        what: &'static str,
        name: &str,
        known: Vec<String>,
    ) -> MaterialError {
        MaterialError::Dangling { place: place.to_owned(), what, name: name.to_owned(), known }
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
    /// The curve as a scattering model: its backscatter points, sorted by angle, equal angles
    /// averaged in linear σ⁰. A censored point enters at its threshold, which bounds the true value.
    ///
    /// # Errors
    /// When fewer than two angles are left.
    pub fn tabulated(&self) -> Result<Tabulated, MaterialError> {
        let mut points: Vec<(f64, f64)> = self
            .observations
            .iter()
            .filter(|o| o.is_retro())
            .filter_map(|o| Some((o.theta_i_rad, o.sigma0.or(o.threshold_sigma0)?)))
            .collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let merged: Vec<(f64, f64)> = points
            .chunk_by(|a, b| b.0 - a.0 < SAME_ANGLE_RAD)
            .map(|same| (same[0].0, same.iter().map(|p| p.1).sum::<f64>() / same.len() as f64))
            .collect();
        Tabulated::new(&merged)
            .map_err(|error| MaterialError::Curve { curve: self.name.clone(), error })
    }
}

impl Observation {
    /// Whether source and receiver were in the same direction.
    pub fn is_retro(&self) -> bool {
        self.theta_i_rad == self.theta_r_rad && self.delta_phi_rad == 0.0
    }

    fn validate(&self, place: &str) -> Result<(), MaterialError> {
        let quarter = 0.0..=std::f64::consts::FRAC_PI_2;
        if !quarter.contains(&self.theta_i_rad) || !quarter.contains(&self.theta_r_rad) {
            return Err(value(place, "the angle is not within 0–90°", "mend the angle"));
        }
        if !self.delta_phi_rad.is_finite() {
            return Err(value(place, "the azimuth is not finite", "mend the angle"));
        }
        let positive = |x: f64| x > 0.0 && x.is_finite();
        if [self.sigma0, self.threshold_sigma0].into_iter().flatten().any(|x| !positive(x)) {
            return Err(value(place, "σ⁰ is not a positive number", "give a finite level in dB"));
        }
        match (self.censor, self.sigma0, self.threshold_sigma0) {
            (Censor::None, None, _) => {
                Err(value(place, "has neither a value nor a censor code", "fill in one of them"))
            }
            (Censor::Left | Censor::Right, Some(_), _) => {
                Err(value(place, "is censored and has a value", "leave one of them out"))
            }
            (Censor::Left | Censor::Right, None, None) => {
                Err(value(place, "is censored without a threshold", "fill in threshold_db"))
            }
            _ => Ok(()),
        }
    }
}

impl Instrument {
    fn validate(&self) -> Result<(), MaterialError> {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        if positive(self.centre_frequency_hz) && self.bandwidth_hz.is_none_or(positive) {
            return Ok(());
        }
        let place = format!("instrument `{}`", self.key);
        Err(value(&place, "frequency and bandwidth must be positive", "mend the number"))
    }
}

impl Covariance {
    fn validate(&self, place: &str, known: &[String]) -> Result<(), MaterialError> {
        let n = self.parameters.len();
        let place = format!("{place}, covariance");
        if n == 0 {
            return Err(value(&place, "names no parameter", "name some or leave it out"));
        }
        if let Some(stranger) = self.parameters.iter().find(|p| !known.contains(p)) {
            let problem = format!("`{stranger}` is not a parameter of the model");
            return Err(value(
                &place,
                &problem,
                &format!("the parameters are {}", known.join(", ")),
            ));
        }
        unique("covariance parameter", self.parameters.iter().map(String::as_str))?;
        if self.matrix.len() != n || self.matrix.iter().any(|row| row.len() != n) {
            let problem = format!("the matrix is not {n} × {n}");
            return Err(value(&place, &problem, "give a row and a column per parameter"));
        }
        let at = |i: usize, j: usize| self.matrix[i][j];
        let pairs = || (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
        // A correlation beyond 1 is the commonest slip; rounding in a file may reach a little past.
        let sound = pairs().all(|(i, j)| {
            at(i, j).is_finite()
                && at(i, j) == at(j, i)
                && at(i, j).powi(2) <= at(i, i) * at(j, j) * (1.0 + 1e-6)
                && at(i, i) >= 0.0
        });
        if sound {
            return Ok(());
        }
        let problem = "the matrix is not a covariance";
        Err(value(&place, problem, "it must be symmetric with correlations within −1 and 1"))
    }

    /// Standard deviation of a parameter, in its unit; `None` when it has no row here.
    pub fn standard_deviation(&self, path: &str) -> Option<f64> {
        let row = self.parameters.iter().position(|p| p == path)?;
        Some(self.matrix.get(row)?.get(row)?.sqrt())
    }
}

fn unique<'a>(
    what: &'static str,
    names: impl Iterator<Item = &'a str>,
) -> Result<(), MaterialError> {
    let mut seen = std::collections::HashSet::new();
    for name in names {
        if name.is_empty() {
            return Err(value(what, "has an empty name", "name it"));
        }
        if !seen.insert(name) {
            return Err(MaterialError::Twice { what, name: name.to_owned() });
        }
    }
    Ok(())
}

fn value(place: &str, problem: &str, way_out: &str) -> MaterialError {
    MaterialError::Value {
        place: place.to_owned(),
        problem: problem.to_owned(),
        way_out: way_out.to_owned(),
    }
}
