//! A material.

use std::path::PathBuf;

use matdb::brdf::{Brdf, Scattering};
use matdb::files::{folder_of, write_all};
use matdb::fit::{OwnLaw, OwnParameter};
use matdb::material::{MaterialError, SampledMaterial, Slug, file};
use matdb::setup::MaterialRevision;
use matdb::units::db_from_ratio;
use numpy::PyArray1;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::error::{UsageError, no_choice, raised, warn};
use crate::interrupt::Stop;
use crate::json::{of_text, text_of, to_python};
use crate::numbers;
use crate::own::{self, dict_of};

/// A material in one revision; or one of a function, for exploration.
///
/// The function is sampled once, at 1025 angles from 0 to 89.99 degrees and, where the curve between them is more than 0.01 dB off,
/// at up to 16385. Scenes render the curve: speed is that of any other material. `sampling_error_db` says how far the curve is
/// off at most, up to 89 degrees. From the angle on from which the function gives -inf or NaN, nothing comes back.
///
/// Parameters
/// ----------
/// name : str
///     Short name: small letters, digits and hyphens.
/// sigma0_db : callable
///     Takes an array of angles of incidence, degrees, and the parameters by name, and gives sigma0 at each angle, dB.
/// parameters : dict of str to tuple, optional
///     Free numbers of the function, `(start, low, high)`: the material has those of the start, and `fit` finds others.
///
/// Warns
/// -----
/// UserWarning
///     A function that no curve follows to 0.01 dB, such as a step.
#[pyclass(frozen, module = "matdb")]
pub(crate) struct Material {
    found: MaterialRevision,
    sampling_error_db: Option<f64>,
    function: Option<OwnFunction>,
}

/// A function of a program with its parameters.
struct OwnFunction {
    function: Py<PyAny>,
    parameters: Vec<OwnParameter>,
}

impl OwnFunction {
    fn clone_ref(&self, py: Python<'_>) -> (Py<PyAny>, Vec<OwnParameter>) {
        (self.function.clone_ref(py), self.parameters.clone())
    }
}

/// Why a function is no material.
enum Refused {
    ByPython(PyErr),
    ByMaterial(MaterialError),
}

impl From<MaterialError> for Refused {
    fn from(error: MaterialError) -> Refused {
        Refused::ByMaterial(error)
    }
}

impl Material {
    pub(crate) fn new(found: MaterialRevision) -> Material {
        Material { found, sampling_error_db: None, function: None }
    }

    pub(crate) fn found(&self) -> &MaterialRevision {
        &self.found
    }

    /// The material of a function at the starts of its parameters.
    fn sampled(
        py: Python<'_>,
        name: &str,
        sigma0_db: &Bound<'_, PyAny>,
        own: Vec<OwnParameter>,
    ) -> PyResult<Material> {
        let starts: Vec<f64> = own.iter().map(|parameter| parameter.start).collect();
        let start = named(py, &own, &starts)?;
        let slug: Slug = name.parse().map_err(|problem: String| UsageError::new_err(problem))?;
        let sampled = SampledMaterial::new(slug, |angles_deg| {
            levels_db(sigma0_db, &start, angles_deg).map_err(Refused::ByPython)
        });
        let sampled = sampled.map_err(|refused| match refused {
            Refused::ByPython(error) => error,
            Refused::ByMaterial(error) => raised(error),
        });
        let SampledMaterial { material, error_db, error_at_deg } = sampled?;
        if error_db > 0.01 {
            let notice = format!(
                "{name}: between its samples the curve is up to {error_db:.2} dB off the function, at {error_at_deg:.2}°: the \
                 function has a step there, or changes faster than the samples show"
            );
            warn(py, &[notice])?;
        }
        let found = MaterialRevision { material, revision: None };
        let function = Some(OwnFunction { function: sigma0_db.clone().unbind(), parameters: own });
        Ok(Material { found, sampling_error_db: Some(error_db), function })
    }

    /// Its function with free parameters.
    fn own_function(&self) -> PyResult<&OwnFunction> {
        let own = self.function.as_ref().filter(|own| !own.parameters.is_empty());
        own.ok_or_else(|| {
            UsageError::new_err(format!(
                "{} has no parameters to fit; give it some, as in Material(name, function, parameters={{\"m\": (0.1, 0.01, 1)}}), or \
                 name a model",
                self.name()
            ))
        })
    }

    /// Warns where the curve of its function at these values of its parameters is off the function.
    pub(crate) fn warn_at(&self, py: Python<'_>, values: &[(String, f64)]) -> PyResult<()> {
        let (function, mut own) = self.own_function()?.clone_ref(py);
        for (parameter, (_, value)) in own.iter_mut().zip(values) {
            parameter.start = *value;
        }
        Material::sampled(py, self.name(), function.bind(py), own).map(|_| ())
    }

    /// The law of its function, of which `fit` finds the parameters. Where the function fails, the work that calls it unwinds
    /// with the error.
    pub(crate) fn law(&self, stop: Stop) -> PyResult<OwnLaw> {
        let (function, own) =
            Python::attach(|py| Ok::<_, PyErr>(self.own_function()?.clone_ref(py)))?;
        let law = OwnLaw::new(own.clone(), move |values, angles_deg| {
            stop.check();
            own::called(|py| {
                let named = named(py, &own, values)?;
                let levels_db = levels_db(function.bind(py), &named, angles_deg)?;
                check_levels(&named, angles_deg, &levels_db)?;
                Ok(levels_db)
            })
        });
        law.map_err(|error| UsageError::new_err(error.to_string()))
    }
}

/// Backscatter of a law at angles in degrees, dB.
pub(crate) fn sigma0_db<'py>(
    law: &Brdf,
    theta_deg: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let angles_deg = numbers::line("theta_deg", theta_deg)?;
    if let Some(outside) = angles_deg.iter().find(|angle| !(0.0..=90.0).contains(*angle)) {
        let problem =
            format!("{outside}° is out of the range; give angles of incidence from 0 to 90");
        return Err(UsageError::new_err(problem));
    }
    let levels_db =
        angles_deg.iter().map(|theta_deg| db_from_ratio(law.sigma0(theta_deg.to_radians())));
    Ok(PyArray1::from_iter(theta_deg.py(), levels_db))
}

/// Values of parameters by name.
fn named<'py>(
    py: Python<'py>,
    parameters: &[OwnParameter],
    values: &[f64],
) -> PyResult<Bound<'py, PyDict>> {
    let named = PyDict::new(py);
    for (parameter, value) in parameters.iter().zip(values) {
        named.set_item(&parameter.name, value)?;
    }
    Ok(named)
}

/// A parameter with its start and its range.
fn parameter(name: String, given: &Bound<'_, PyAny>) -> PyResult<OwnParameter> {
    let numbers = given
        .extract::<(f64, f64, f64)>()
        .map_err(|_| PyTypeError::new_err(format!("parameters[{name:?}] is (start, low, high)")));
    let (start, min, max) = numbers?;
    if !(min.is_finite() && max.is_finite() && min < max) {
        return Err(UsageError::new_err(format!(
            "parameters[{name:?}] = {given}: {min} to {max} is no range; give (start, low, high)"
        )));
    }
    Ok(OwnParameter { name, min, max, start })
}

/// The parameters of a function.
fn own_parameters(given: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<OwnParameter>> {
    let given = given.into_iter().flatten();
    let own = given.map(|(name, range)| parameter(name.extract()?, &range));
    checked(own.collect::<PyResult<Vec<OwnParameter>>>()?)
}

/// These parameters, unless a range is empty or a start outside.
fn checked(own: Vec<OwnParameter>) -> PyResult<Vec<OwnParameter>> {
    let law = OwnLaw::new(own.clone(), |_, _| Vec::new());
    law.map(|_| own).map_err(|error| UsageError::new_err(error.to_string()))
}

/// The file of a material with the law alone that scenes render of it.
pub(crate) fn law_file(material: &matdb::material::Material) -> PyResult<Vec<u8>> {
    let alone = material.with_law_alone().map_err(raised)?;
    let text = file::write(&alone).map_err(|error| UsageError::new_err(error.to_string()))?;
    Ok(text.into_bytes())
}

/// The levels that a function gives at some angles, dB.
fn levels_db(
    function: &Bound<'_, PyAny>,
    named: &Bound<'_, PyDict>,
    angles_deg: &[f64],
) -> PyResult<Vec<f64>> {
    let of = PyArray1::from_slice(function.py(), angles_deg);
    own::levels_db(function, of, named, (angles_deg.len(), "angles"))
}

/// Refuses levels that are no law: no numbers, or levels after there were none.
fn check_levels(named: &Bound<'_, PyDict>, angles_deg: &[f64], levels_db: &[f64]) -> PyResult<()> {
    let mut is_silent = false;
    for (angle_deg, &level_db) in angles_deg.iter().zip(levels_db) {
        let is_none = level_db == f64::NEG_INFINITY;
        if level_db.is_nan() || level_db == f64::INFINITY || (is_silent && !is_none) {
            return Err(UsageError::new_err(format!(
                "the function gives {level_db} dB at {angle_deg:.4}° with {named}; narrow the ranges of the parameters, or give \
                 finite levels, and -inf from the angle on from which nothing comes back"
            )));
        }
        is_silent |= is_none;
    }
    Ok(())
}

#[pymethods]
impl Material {
    #[new]
    #[pyo3(signature = (name, sigma0_db, *, parameters = None))]
    fn of_function(
        py: Python<'_>,
        name: &str,
        sigma0_db: &Bound<'_, PyAny>,
        parameters: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Material> {
        let parameters = parameters.map(dict_of).transpose()?;
        Material::sampled(py, name, sigma0_db, own_parameters(parameters.as_ref())?)
    }

    /// The material of the same function with other values of its parameters, such as those of a fit.
    #[pyo3(signature = (**parameters))]
    fn at(&self, py: Python<'_>, parameters: Option<&Bound<'_, PyDict>>) -> PyResult<Material> {
        let (function, mut own) = self.own_function()?.clone_ref(py);
        for (name, value) in parameters.into_iter().flatten() {
            let name: String = name.extract()?;
            let known: Vec<String> = own.iter().map(|parameter| parameter.name.clone()).collect();
            let Some(parameter) = own.iter_mut().find(|parameter| parameter.name == name) else {
                return Err(no_choice("parameter", &name, &known.join(", ")));
            };
            parameter.start = value.extract()?;
        }
        Material::sampled(py, self.name(), function.bind(py), checked(own)?)
    }

    /// How far the curve of a function is off midway between its samples, dB; None for other materials.
    #[getter]
    fn sampling_error_db(&self) -> Option<f64> {
        self.sampling_error_db
    }

    /// Short name.
    #[getter]
    pub(crate) fn name(&self) -> &str {
        self.found.material.slug.as_str()
    }

    /// Full name.
    #[getter]
    fn title(&self) -> &str {
        &self.found.material.name
    }

    /// Its revision in the database; None for a built-in material that is not in it.
    #[getter]
    fn revision(&self) -> Option<u32> {
        self.found.revision
    }

    /// Class, such as `polymer`.
    #[getter]
    fn material_class(&self) -> &str {
        &self.found.material.class
    }

    /// Licence of its data, as an SPDX identifier.
    #[getter]
    fn licence(&self) -> &str {
        &self.found.material.licence
    }

    /// How what scenes render of it came to be: `measured`, `literature`, `modelled` or `synthetic`.
    #[getter]
    fn kind(&self) -> Option<&'static str> {
        self.found.material.render_kind().map(|kind| kind.as_str())
    }

    /// Hash of its content, BLAKE3.
    #[getter]
    fn content_hash(&self) -> String {
        self.found.material.content_hash()
    }

    /// Backscatter sigma0 = 4 pi f cos^2(theta) of the law that scenes render, dB.
    ///
    /// Parameters
    /// ----------
    /// theta_deg : array_like, shape (n,)
    ///     Angles of incidence, degrees, from 0 to 90.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray, shape (n,), float64
    fn sigma0_db<'py>(&self, theta_deg: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let law = self.found.material.scattering().map_err(raised)?;
        sigma0_db(&law, theta_deg)
    }

    /// All that is known of it, as `matdb show --json` prints it.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.found.material)
    }

    /// Backscatter over the angle of incidence, on axes of matplotlib.
    #[pyo3(signature = (ax = None))]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        ax: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("matdb._plots")?.call_method1("material", (slf, ax))
    }

    /// A material of its text, as pickle makes one.
    #[staticmethod]
    fn _of_text(
        text: &str,
        sampling_error_db: Option<f64>,
        function: Option<(Py<PyAny>, Bound<'_, PyDict>)>,
    ) -> PyResult<Material> {
        let function = match function {
            None => None,
            Some((function, parameters)) => {
                let parameters = own_parameters(Some(&parameters))?;
                Some(OwnFunction { function, parameters })
            }
        };
        Ok(Material { found: of_text(text)?, sampling_error_db, function })
    }

    /// Writes the law that scenes render as a file, which `Database.add` and `matdb add` take.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let bytes = law_file(&self.found.material)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        py.detach(|| write_all(folder_of(&path), &[(name, bytes)])).map_err(raised)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let Material { found, sampling_error_db, function } = slf.get();
        // A function without parameters is in the samples, and many cannot be pickled.
        let own = function.as_ref().filter(|own| !own.parameters.is_empty());
        let function = match own {
            None => None,
            Some(OwnFunction { function, parameters: own }) => {
                let parameters = PyDict::new(slf.py());
                for OwnParameter { name, min, max, start } in own {
                    parameters.set_item(name, (start, min, max))?;
                }
                Some((function, parameters))
            }
        };
        let parts = (text_of(found)?, *sampling_error_db, function);
        (slf.get_type().getattr("_of_text")?, parts).into_pyobject(slf.py())
    }

    fn __repr__(&self) -> String {
        let name = match (self.found.revision, self.sampling_error_db) {
            (Some(revision), _) => format!("{}@{revision}", self.name()),
            (None, None) => format!("{}, built in", self.name()),
            (None, Some(_)) => return format!("<matdb.Material {}, of a function>", self.name()),
        };
        format!("<matdb.Material {name}: {}>", self.title())
    }
}
