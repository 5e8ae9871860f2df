//! Fits of models to curves.

use std::path::PathBuf;

use matdb::adopt::{FitMethod, FitOutcome, FitRequest, FitSubject, NewFit};
use matdb::error::Error;
use matdb::fit::OwnParameter;
use matdb::formats::ColumnNames;
use matdb::material::FitReport;
use matdb::setup;
use matdb::units::{db_from_ratio, watts_from_dbm};
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::cloud::column_names;
use crate::curve::ignored;
use crate::database::Database;
use crate::error::{no_choice, raised};
use crate::interrupt::interruptible;
use crate::json::{of_text, text_of, to_python};
use crate::material::{Material, sigma0_db};
use crate::measure::{Instrument, Measurement};
use crate::numbers::seed_if_any;
use crate::own::or_unwind;
use crate::words::in_python;

/// A model that was fitted to a curve.
#[pyclass(frozen, module = "matdb")]
#[derive(Serialize, Deserialize)]
pub(crate) struct Fit {
    pub(crate) fit: NewFit,
    pub(crate) subject: FitSubject,
    /// What a curve was measured with that was measured here.
    pub(crate) measured: Option<Instrument>,
    /// The parameters of a function of the program, with the values that were found or held.
    #[serde(default)]
    own: Option<Vec<(String, f64)>>,
    record: Value,
    notices: Vec<String>,
}

/// Other names of models.
const ALSO: [(&str, &str); 2] = [
    ("cook-torrance + blinn-phong", "mixture"),
    ("cook-torrance-ggx + blinn-phong", "mixture-ggx"),
];

/// A model as an argument.
pub(crate) enum ModelLike {
    Named(String),
    Function(Py<Material>),
}

impl<'py> FromPyObject<'_, 'py> for ModelLike {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<ModelLike> {
        if let Ok(material) = given.cast::<Material>() {
            return Ok(ModelLike::Function(material.to_owned().unbind()));
        }
        let name = given.extract().map(ModelLike::Named);
        name.map_err(|_| {
            PyTypeError::new_err(
                "model is a name, or a matdb.Material of a function with parameters",
            )
        })
    }
}

/// A curve to fit as an argument.
pub(crate) enum What {
    Named(String),
    Measured(Py<Measurement>),
    Material(Py<Material>),
}

impl<'py> FromPyObject<'_, 'py> for What {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<What> {
        if let Ok(measured) = given.cast::<Measurement>() {
            return Ok(What::Measured(measured.to_owned().unbind()));
        }
        if let Ok(material) = given.cast::<Material>() {
            return Ok(What::Material(material.to_owned().unbind()));
        }
        let name = given.extract::<PathBuf>().map_err(|_| {
            PyTypeError::new_err(
                "give a matdb.Measurement, a matdb.Material, its name, or the file of a curve",
            )
        });
        Ok(What::Named(name?.to_string_lossy().into_owned()))
    }
}

/// Fits a scattering model to a curve, on all cores. Nothing is stored.
///
/// Parameters
/// ----------
/// what : Measurement, Material, str or os.PathLike
///     A curve that was measured, a material with a curve or its name, `NAME` or `NAME@REVISION`, or a curve's CSV file.
/// db : Database, optional
///     Where materials are looked for; without it, and for those that it does not have, the built-in ones.
/// model : str or Material, optional
///     A model or a material, where the search starts; what the material renders, else `mixture`, unless stated. Of a
///     `Material` of a function the parameters are found; a database cannot keep such a fit.
/// method : str, default "censored"
///     `censored`, `tls`, `tls-tail` (which takes the exponent of the tail as `fixed`) or `mse`.
/// curve : str, optional
///     Curve of the material; the longest unless stated.
/// columns : dict of str to str, optional
///     Our names for columns of the file, as in `{"inc": "theta_deg"}`; `-` passes one over.
/// fixed : dict of str to float, optional
///     Parameters that are held, by path.
/// looks : float, optional
///     Looks of the speckle; found by the fit unless stated.
/// noise_dbm : float, optional
///     Thermal noise in each chirp, dBm.
/// theta_sd_deg, level_sd_db : float, optional
///     Standard deviations of the angle, degrees, and of the level, dB, for `tls`; that of the curve, and that of speckle of one
///     look, unless stated.
/// split_deg : float, optional
///     Angle between the specular and the diffuse piece of `mse`, degrees; 6 unless stated.
/// starts, seed : int, optional
///     Points that the search starts from, and their seed.
/// fit_name : str, optional
///     Its name in a material; `MODEL-METHOD` unless stated.
///
/// Returns
/// -------
/// Fit
///
/// Raises
/// ------
/// matdb.Error
///     A curve, material, model or parameter that is not known; a search that fails.
#[pyfunction]
#[pyo3(signature = (what, *, db = None, model = None, method = "censored", curve = None, columns = None, fixed = None,
                    looks = None, noise_dbm = None, theta_sd_deg = None, level_sd_db = None, split_deg = None,
                    starts = None, seed = None, fit_name = None))]
#[expect(clippy::too_many_arguments, reason = "each is a keyword in Python")]
pub(crate) fn fit(
    py: Python<'_>,
    what: What,
    db: Option<&Database>,
    model: Option<ModelLike>,
    method: &str,
    curve: Option<&str>,
    columns: Option<&Bound<'_, PyDict>>,
    fixed: Option<&Bound<'_, PyDict>>,
    looks: Option<f64>,
    noise_dbm: Option<f64>,
    theta_sd_deg: Option<f64>,
    level_sd_db: Option<f64>,
    split_deg: Option<f64>,
    starts: Option<usize>,
    #[pyo3(from_py_with = seed_if_any)] seed: Option<u64>,
    fit_name: Option<&str>,
) -> PyResult<Fit> {
    let method = match method {
        "censored" => FitMethod::Censored,
        "tls" => FitMethod::Tls,
        "tls-tail" => FitMethod::TlsTail,
        "mse" => FitMethod::Mse,
        other => return Err(no_choice("method", other, "censored, tls, tls-tail or mse")),
    };
    let fixed = fixed.map_or(Ok(Vec::new()), |fixed| {
        let held = fixed.iter().map(|(path, value)| Ok((path.extract()?, value.extract()?)));
        held.collect::<PyResult<Vec<(String, f64)>>>()
    })?;
    let (given_curve, given_columns) = (curve.is_some(), columns.is_some());
    let columns = columns.map_or(Ok(ColumnNames::default()), column_names)?;
    let useless = match &what {
        What::Named(_) => None,
        What::Measured(_) if given_curve => Some("curve"),
        What::Measured(_) | What::Material(_) => given_columns.then_some("columns"),
    };
    if let Some(keyword) = useless {
        return Err(raised(ignored(keyword, "the name of a material or of a file")));
    }
    let own_model = match &model {
        Some(ModelLike::Function(material)) => Some(material.get()),
        Some(ModelLike::Named(_)) | None => None,
    };
    let model = model.as_ref().and_then(ModelLike::name);
    let database = db.map_or_else(|| setup::Database::new(None), Database::database);
    let fitted = interruptible(py, |stop| {
        let own = own_model.map(|own| (own.name(), or_unwind(own.law(stop.clone()))));
        // Without a database, one that happens to lie in the working directory is not read.
        let store = db.map(|_| database.read()).transpose()?.flatten();
        let usual = FitRequest::new("");
        let request = FitRequest {
            model,
            own: own.as_ref().map(|(name, law)| (*name, law)),
            method,
            curve,
            columns,
            fixed,
            looks,
            noise_w: noise_dbm.map(watts_from_dbm),
            theta_sd_rad: theta_sd_deg.map(f64::to_radians),
            level_sd_db,
            split_rad: split_deg.map_or(usual.split_rad, f64::to_radians),
            starts: starts.unwrap_or(usual.starts),
            seed: seed.unwrap_or(usual.seed),
            fit_name,
            ..usual
        };
        let (checked, measured) = match &what {
            What::Named(name) => {
                let request = FitRequest { what: name, ..request };
                (request.check(store.as_ref())?, None)
            }
            What::Measured(measured) => {
                let (subject, instrument) = measured.get().subject();
                (request.check_subject(subject, store.as_ref())?, Some(instrument))
            }
            What::Material(material) => {
                let found = material.get().found().clone();
                let name = found.material.slug.to_string();
                let subject = FitSubject::of_material(&name, curve, found)?;
                (request.check_subject(subject, store.as_ref())?, None)
            }
        };
        let notices = checked.notices.clone();
        drop(store);
        let FitOutcome { subject, result, fit, refusal, .. } = checked.run(&database)?;
        let mut record = json!(result);
        record["sentences"] = json!(fit.fit.report.as_ref().map(|report| &report.verdict));
        let values = own.as_ref().map(|(_, law)| {
            let value = |parameter: &OwnParameter| {
                let name = &parameter.name;
                let held = result.fit.fixed.iter().find(|(fixed, _)| fixed == name);
                let found = || result.estimate(name).map(|estimate| estimate.value);
                let value = held.map(|(_, value)| *value).or_else(found);
                (name.clone(), value.unwrap_or(parameter.start))
            };
            law.parameters().iter().map(value).collect()
        });
        let fitted = Fit { fit, subject, measured, own: values, record, notices };
        refusal.map_or(Ok(fitted), Err)
    })?;
    let fitted = fitted.map_err(raised::<Error>)?;
    if let (Some(own), Some(values)) = (own_model, &fitted.own) {
        own.warn_at(py, values)?;
    }
    Ok(fitted)
}

impl ModelLike {
    /// Its name, of those of models in papers, too.
    fn name(&self) -> Option<&str> {
        let ModelLike::Named(name) = self else { return None };
        let own = ALSO.into_iter().find(|(other, _)| other == name);
        Some(own.map_or(name, |(_, own)| own))
    }
}

impl Fit {
    /// Whether it is of a function of the program, which no database can keep.
    pub(crate) fn is_own(&self) -> bool {
        self.own.is_some()
    }

    fn report(&self) -> Option<&FitReport> {
        self.fit.fit.report.as_ref()
    }
}

#[pymethods]
impl Fit {
    /// Its name in a material that it is added to.
    #[getter]
    fn name(&self) -> &str {
        &self.fit.fit.name
    }

    /// Values of the parameters by path, in their own units.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let values = PyDict::new(py);
        for (name, value) in self.own.iter().flatten() {
            values.set_item(name, value)?;
        }
        for parameter in self.fit.fit.model.parameters() {
            values.set_item(parameter.path, parameter.value)?;
        }
        Ok(values)
    }

    /// Names of the fitted numbers, in the order of `covariance`.
    #[getter]
    fn names(&self) -> Vec<&str> {
        let estimates = self.report().into_iter().flat_map(|report| &report.estimates);
        estimates.map(|one| one.name.as_str()).collect()
    }

    /// Covariance of the fitted numbers: float64 (n, n), 0 for those at a bound, without directions that the curve does
    /// not determine.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows = self.report().map_or(&[][..], |report| &report.covariance);
        Ok(PyArray2::from_vec2(py, rows)?)
    }

    /// The curve and the fitted law over it, on axes of matplotlib.
    #[pyo3(signature = (ax = None))]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        ax: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("matdb._plots")?.call_method1("fit", (slf, ax))
    }

    /// Whether each level of the curve is backscatter, and source and receiver in one direction: bool (n,).
    #[getter]
    fn is_retro<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        PyArray1::from_iter(py, self.subject.curve.observations.iter().map(|row| row.is_retro()))
    }

    /// Angles of incidence of the curve, degrees: float64 (n,).
    #[getter]
    fn theta_deg<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let rows = self.subject.curve.observations.iter();
        PyArray1::from_iter(py, rows.map(|row| row.theta_i_rad.to_degrees()))
    }

    /// Levels of the curve, dB: float64 (n,), NaN where nothing was detected.
    #[getter]
    fn levels_db<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let rows = self.subject.curve.observations.iter();
        PyArray1::from_iter(py, rows.map(|row| row.sigma0.map_or(f64::NAN, db_from_ratio)))
    }

    /// What limits the use of the fit, a sentence each: what the curve cannot tell apart, and bounds that were met.
    #[getter]
    fn verdict(&self) -> Vec<&str> {
        let sentences = self.report().into_iter().flat_map(|report| &report.verdict);
        sentences.map(String::as_str).collect()
    }

    /// What a person should not overlook of the curve, a sentence each.
    #[getter]
    fn notices(&self) -> Vec<String> {
        self.notices.iter().map(|notice| in_python(notice)).collect()
    }

    /// Backscatter of the fitted law, dB, as `Material.sigma0_db`.
    fn sigma0_db<'py>(&self, theta_deg: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        sigma0_db(&self.fit.fit.model, theta_deg)
    }

    /// All numbers with their deviations, as `matdb fit --json` prints them.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.record)
    }

    fn __repr__(&self) -> String {
        format!("<matdb.Fit of {} to {}>", self.name(), self.subject.label)
    }

    /// A fit of its text, as pickle makes one.
    #[staticmethod]
    fn _of_text(text: &str) -> PyResult<Fit> {
        of_text(text)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let text = text_of(slf.get())?;
        (slf.get_type().getattr("_of_text")?, (text,)).into_pyobject(slf.py())
    }
}
