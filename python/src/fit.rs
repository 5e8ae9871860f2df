//! Fits of models to curves.

use std::path::PathBuf;

use matdb::adopt::{FitMethod, FitOutcome, FitRequest};
use matdb::error::Error;
use matdb::fit::FitResult;
use matdb::setup;
use matdb::units::watts_from_dbm;
use numpy::{PyArray1, PyArrayLike1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::json;

use crate::database::Database;
use crate::error::raised;
use crate::json::to_python;
use crate::material::sigma0_db;

/// A model that was fitted to a curve.
#[pyclass(frozen, module = "matdb")]
pub(crate) struct Fit {
    result: FitResult,
    label: String,
    notices: Vec<String>,
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
///     `censored`, `tls`, `tls-tail` or `mse`.
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
    let method = match method {
        "censored" => FitMethod::Censored,
        "tls" => FitMethod::Tls,
        "tls-tail" => FitMethod::TlsTail,
        "mse" => FitMethod::Mse,
        other => {
            let known = "censored, tls, tls-tail and mse";
            let problem = format!("there is no method `{other}`; there are {known}");
            return Err(PyValueError::new_err(problem));
        }
    };
    let fixed = fixed.map_or(Ok(Vec::new()), |fixed| {
        let held = fixed.iter().map(|(path, value)| Ok((path.extract()?, value.extract()?)));
        held.collect::<PyResult<Vec<(String, f64)>>>()
    })?;
    let what = what.to_string_lossy();
    let database = db.map_or_else(|| setup::Database::new(None), Database::database);
    let fitted = py.detach(|| {
        let usual = FitRequest::new(&what);
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
        // Without a database, one that happens to lie in the working directory is not read.
        let store = db.map(|_| database.read()).transpose()?.flatten();
        let checked = request.check(store.as_ref())?;
        let notices = checked.notices.clone();
        drop(store);
        let FitOutcome { subject, result, refusal, .. } = checked.run(&database)?;
        refusal.map_or(Ok(Fit { result, label: subject.label, notices }), Err)
    });
    fitted.map_err(raised::<Error>)
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
        format!("<matdb.Fit of {}>", self.label)
    }
}
