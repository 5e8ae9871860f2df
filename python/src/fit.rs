//! Fits of models to curves.

use std::path::PathBuf;

use matdb::adopt::{FitMethod, FitOutcome, FitRequest, FitSubject};
use matdb::error::Error;
use matdb::fit::FitResult;
use matdb::setup;
use matdb::units::{db_from_ratio, watts_from_dbm};
use numpy::{PyArray1, PyArray2, PyArrayLike1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::json;

use crate::database::Database;
use crate::error::{no_choice, raised};
use crate::json::to_python;
use crate::material::sigma0_db;
use crate::measure::Instrument;

/// A model that was fitted to a curve.
#[pyclass(frozen, module = "matdb")]
pub(crate) struct Fit {
    pub(crate) result: FitResult,
    pub(crate) subject: FitSubject,
    pub(crate) fit_name: String,
    /// What a curve was measured with that was measured here.
    pub(crate) measured: Option<Instrument>,
    notices: Vec<String>,
}

/// Other names of models.
const ALSO: [(&str, &str); 2] = [
    ("cook-torrance + blinn-phong", "mixture"),
    ("cook-torrance-ggx + blinn-phong", "mixture-ggx"),
];

/// A curve to fit: by name, or as it was measured with a radar.
pub(crate) enum What<'a> {
    Named(&'a str),
    Curve(Box<FitSubject>, Instrument),
}

/// How to fit, as Python says it.
pub(crate) struct Request<'a, 'py> {
    pub(crate) model: Option<&'a str>,
    pub(crate) method: &'a str,
    pub(crate) curve: Option<&'a str>,
    pub(crate) fixed: Option<&'a Bound<'py, PyDict>>,
    pub(crate) looks: Option<f64>,
    pub(crate) noise_dbm: Option<f64>,
    pub(crate) starts: Option<usize>,
    pub(crate) seed: Option<u64>,
}

impl Request<'_, '_> {
    /// Fits; materials are looked for in a database.
    pub(crate) fn run(
        &self,
        py: Python<'_>,
        what: What<'_>,
        db: Option<&Database>,
    ) -> PyResult<Fit> {
        let Request { curve, looks, noise_dbm, starts, seed, .. } = *self;
        let method = match self.method {
            "censored" => FitMethod::Censored,
            "tls" => FitMethod::Tls,
            "tls-tail" => FitMethod::TlsTail,
            "mse" => FitMethod::Mse,
            other => return Err(no_choice("method", other, "censored, tls, tls-tail or mse")),
        };
        let fixed = self.fixed.map_or(Ok(Vec::new()), |fixed| {
            let held = fixed.iter().map(|(path, value)| Ok((path.extract()?, value.extract()?)));
            held.collect::<PyResult<Vec<(String, f64)>>>()
        })?;
        let own = |name: &str| ALSO.into_iter().find(|(other, _)| *other == name);
        let model = self.model.map(|name| own(name).map_or(name, |(_, own)| own));
        let database = db.map_or_else(|| setup::Database::new(None), Database::database);
        let fitted = py.detach(|| {
            // Without a database, one that happens to lie in the working directory is not read.
            let store = db.map(|_| database.read()).transpose()?.flatten();
            let (name, given) = match what {
                What::Named(name) => (name, None),
                What::Curve(subject, instrument) => ("", Some((*subject, instrument))),
            };
            let usual = FitRequest::new(name);
            let request = FitRequest {
                model,
                method,
                curve,
                fixed,
                looks,
                noise_w: noise_dbm.map(watts_from_dbm),
                starts: starts.unwrap_or(usual.starts),
                seed: seed.unwrap_or(usual.seed),
                ..usual
            };
            let (checked, measured) = match given {
                None => (request.check(store.as_ref())?, None),
                Some((subject, instrument)) => {
                    (request.check_subject(subject, store.as_ref())?, Some(instrument))
                }
            };
            let (notices, fit_name) = (checked.notices.clone(), checked.fit_name.clone());
            drop(store);
            let FitOutcome { subject, result, refusal, .. } = checked.run(&database)?;
            let fit = Fit { result, subject, fit_name, measured, notices };
            refusal.map_or(Ok(fit), Err)
        });
        fitted.map_err(raised::<Error>)
    }
}

/// Fits a scattering model to a curve, on all cores. Nothing is stored.
///
/// Parameters
/// ----------
/// what : str or os.PathLike
///     A curve's CSV file, or `NAME` or `NAME@REVISION` of a material with a curve.
/// db : Database, optional
///     Where materials are looked for; without it, and for those that it does not have, the built-in ones.
/// model : str, optional
///     A model or a material, where the search starts; what the material renders, else `mixture`, unless stated.
/// method : str, default "censored"
///     `censored`, `tls`, `tls-tail` (which takes the exponent of the tail as `fixed`) or `mse`.
/// curve : str, optional
///     Curve of the material; the longest unless stated.
/// fixed : dict of str to float, optional
///     Parameters that are held, by path.
/// looks : float, optional
///     Looks of the speckle; found by the fit unless stated.
/// noise_dbm : float, optional
///     Thermal noise in each chirp, dBm.
/// starts, seed : int, optional
///     Points that the search starts from, and their seed.
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
#[pyo3(signature = (what, *, db = None, model = None, method = "censored", curve = None, fixed = None, looks = None,
                    noise_dbm = None, starts = None, seed = None))]
#[expect(clippy::too_many_arguments, reason = "each is a keyword in Python")]
pub(crate) fn fit(
    py: Python<'_>,
    what: PathBuf,
    db: Option<&Database>,
    model: Option<&str>,
    method: &str,
    curve: Option<&str>,
    fixed: Option<&Bound<'_, PyDict>>,
    looks: Option<f64>,
    noise_dbm: Option<f64>,
    starts: Option<usize>,
    seed: Option<u64>,
) -> PyResult<Fit> {
    let request = Request { model, method, curve, fixed, looks, noise_dbm, starts, seed };
    request.run(py, What::Named(&what.to_string_lossy()), db)
}

#[pymethods]
impl Fit {
    /// Values of the parameters by path, in their own units.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let values = PyDict::new(py);
        for parameter in self.result.model.parameters() {
            values.set_item(parameter.path, parameter.value)?;
        }
        Ok(values)
    }

    /// Names of the fitted numbers, in the order of `covariance`.
    #[getter]
    fn names(&self) -> Vec<&str> {
        self.result.estimates.iter().map(|one| one.name.as_str()).collect()
    }

    /// Covariance of the fitted numbers: float64 (n, n), 0 for those at a bound, without directions that the curve does
    /// not determine.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        Ok(PyArray2::from_vec2(py, &self.result.covariance)?)
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
    fn verdict(&self) -> Vec<String> {
        self.result.verdict.iter().map(ToString::to_string).collect()
    }

    /// What a person should not overlook of the curve, a sentence each.
    #[getter]
    fn notices(&self) -> Vec<String> {
        self.notices.clone()
    }

    /// Backscatter of the fitted law, dB, as `Material.sigma0_db`.
    fn sigma0_db<'py>(
        &self,
        py: Python<'py>,
        theta_deg: PyArrayLike1<'py, f64, numpy::AllowTypeChange>,
    ) -> Bound<'py, PyArray1<f64>> {
        sigma0_db(py, &self.result.model, &theta_deg)
    }

    /// All numbers with their deviations, as `matdb fit --json` prints them.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let mut record = json!(self.result);
        record["sentences"] = json!(self.verdict());
        to_python(py, &record)
    }

    fn __repr__(&self) -> String {
        format!("<matdb.Fit of {} to {}>", self.fit_name, self.subject.label)
    }
}
