//! A scattering model with numbers in it, and where each of them comes from.

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use super::report::{Estimate, FitReport};
use crate::brdf::{Brdf, Parameter, ScatteringModel};

/// A scattering model with numbers in it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fit {
    /// Name, unique among the material's curves and fits.
    pub name: String,
    /// The model and its values.
    pub model: Brdf,
    /// How the values were found: `stated` when the sources give them.
    pub estimator: String,
    /// The curve that was fitted, if one was.
    pub curve: Option<String>,
    /// Whose lobes the model has.
    #[serde(default, skip_serializing_if = "Lobes::is_of_both")]
    pub lobes: Lobes,
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

/// Name of the divergence of the beam among the numbers that a fit was given.
pub const BEAM: &str = "beam_rad";

/// Whose lobes a model has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Lobes {
    /// Of radar and surface together, as they were seen: a beam must not widen them again.
    #[default]
    RadarAndSurface,
    /// Of the surface alone: every beam sees them wider, by its own divergence.
    Surface,
}

impl Lobes {
    /// The word that files and the database use.
    pub fn as_str(self) -> &'static str {
        match self {
            Lobes::RadarAndSurface => "radar-and-surface",
            Lobes::Surface => "surface",
        }
    }

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Lobes::RadarAndSurface => "lobes of radar and surface together",
            Lobes::Surface => "lobes of the surface alone",
        }
    }

    /// Whose lobes a law has that was stated with these. A smooth mirror has no lobe of its own, and a law that is one
    /// says itself whether its width is that of a beam.
    pub fn of(self, law: &Brdf) -> Lobes {
        let is_mirror = law.is_smooth() || law.has_smooth_mirror();
        if is_mirror { Lobes::Surface } else { self }
    }

    /// Width of a law's narrowest lobe, rad, where its lobes include the beam that saw them, so that no beam widens them
    /// again; infinite without a lobe. None where its lobes are its own.
    pub fn seen_lobe_rad(self, law: &Brdf) -> Option<f64> {
        let includes_beam = self.of(law).is_of_both();
        includes_beam.then(|| law.lobe_rad(0.0).unwrap_or(f64::INFINITY))
    }

    /// Whether they are of radar and surface together.
    pub fn is_of_both(&self) -> bool {
        *self == Lobes::RadarAndSurface
    }
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

/// One number of a fit.
#[derive(Clone, Debug, PartialEq)]
pub struct FitNumber {
    /// As [`name`](Estimate::name) of an estimate.
    pub name: String,
    /// Its place among [`FitReport::estimates`]; none where it was not searched for.
    pub estimate: Option<usize>,
    /// Its value, in `unit`.
    pub value: f64,
    /// UCUM code.
    pub unit: &'static str,
    /// As [`sd`](Estimate::sd) of an estimate.
    pub sd: Option<f64>,
    /// As [`interval_95`](Estimate::interval_95) of an estimate.
    pub interval_95: Option<[f64; 2]>,
    /// Where the value comes from.
    pub chosen_by: ChosenBy,
    /// Whether the search stopped at an end of its range.
    pub is_at_bound: bool,
}

/// Where a number of a fit comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChosenBy {
    /// It was searched for in the data.
    Data,
    /// It was set beforehand.
    Hand,
    /// Another would do as well: the data determine it only inside a product.
    Convention,
}

impl ChosenBy {
    /// The word that the database uses.
    pub fn as_str(self) -> &'static str {
        match self {
            ChosenBy::Data => "data",
            ChosenBy::Hand => "hand",
            ChosenBy::Convention => "convention",
        }
    }
}

impl Fit {
    /// The [`estimator`](Fit::estimator) of values that were not fitted.
    pub const STATED: &str = "stated";

    /// The levels S and R of a mixture, of which alone backscatter tells; none for another model and where the data told k.
    pub fn identified_products(&self) -> Option<[f64; 2]> {
        let told = self.report.as_ref().is_some_and(|report| report.estimate("k").is_some());
        self.model.identified_products().filter(|_| !told)
    }

    /// Divergence of the beam with which the curve was fitted, rad; none for a fit without one, or without a report.
    pub fn beam_rad(&self) -> Option<f64> {
        let given = &self.report.as_ref()?.given;
        given.iter().find(|given| given.name == BEAM).map(|given| given.value)
    }

    /// Whose lobes the model has, in words; none of a model without a lobe.
    pub fn lobes_words(&self) -> Option<&'static str> {
        let has_lobe = !self.model.lobe_widths().is_empty();
        has_lobe.then(|| self.lobes.words())
    }

    /// Whether its values come of its curve.
    pub fn is_fitted(&self) -> bool {
        self.curve.is_some() && self.estimator != Fit::STATED
    }

    /// Every parameter of the model and then what else was found, by the report of the fit; empty without a
    /// report.
    pub fn numbers(&self) -> Vec<FitNumber> {
        let Some(report) = &self.report else { return Vec::new() };
        let parameters = self.model.parameters();
        let mut numbers: Vec<FitNumber> =
            parameters.iter().map(|parameter| FitNumber::of_parameter(parameter, report)).collect();
        for (place, estimate) in report.estimates.iter().enumerate() {
            if !parameters.iter().any(|parameter| parameter.path == estimate.name) {
                numbers.push(FitNumber::of_estimate(place, estimate));
            }
        }
        numbers
    }
}

impl FitNumber {
    /// Whether the data determine the number by itself: its interval is known and the search did not stop at an end.
    pub fn is_identified(&self) -> bool {
        self.sd.is_some() && self.interval_95.is_some() && !self.is_at_bound
    }

    /// A parameter of the model, by the report of the fit.
    fn of_parameter(parameter: &Parameter, report: &FitReport) -> FitNumber {
        let Parameter { path, value, min, max, .. } = parameter;
        let place = report.estimates.iter().position(|estimate| estimate.name == *path);
        let estimate = place.and_then(|place| report.estimates.get(place));
        // Ranges may have been narrowed by hand.
        let ends = [format!("{path}.min"), format!("{path}.max")];
        let is_at_narrowed_end =
            report.given.iter().any(|given| ends.contains(&given.name) && given.value == *value);
        FitNumber {
            name: path.clone(),
            estimate: place,
            value: *value,
            unit: parameter.unit,
            sd: estimate.and_then(|estimate| estimate.sd),
            interval_95: estimate.and_then(|estimate| estimate.interval_95),
            chosen_by: match estimate {
                Some(_) => ChosenBy::Data,
                None if report.is_by_convention(path) => ChosenBy::Convention,
                None => ChosenBy::Hand,
            },
            is_at_bound: estimate.is_some() && ([min, max].contains(&value) || is_at_narrowed_end),
        }
    }

    /// What was found besides the parameters of the model.
    fn of_estimate(place: usize, estimate: &Estimate) -> FitNumber {
        FitNumber {
            name: estimate.name.clone(),
            estimate: Some(place),
            value: estimate.value,
            unit: "1",
            sd: estimate.sd,
            interval_95: estimate.interval_95,
            chosen_by: ChosenBy::Data,
            is_at_bound: false,
        }
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
