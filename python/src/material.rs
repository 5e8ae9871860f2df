//! A material.

use matdb::brdf::{Brdf, Scattering};
use matdb::setup::MaterialRevision;
use matdb::units::db_from_ratio;
use numpy::{PyArray1, PyArrayLike1};
use pyo3::prelude::*;

use crate::error::raised;
use crate::json::to_python;

/// A material in one revision.
#[pyclass(frozen, module = "matdb")]
pub(crate) struct Material {
    found: MaterialRevision,
}

impl Material {
    pub(crate) fn new(found: MaterialRevision) -> Material {
        Material { found }
    }
}

/// Backscatter of a law at angles in degrees, dB.
pub(crate) fn sigma0_db<'py>(
    py: Python<'py>,
    law: &Brdf,
    theta_deg: &PyArrayLike1<'py, f64, numpy::AllowTypeChange>,
) -> Bound<'py, PyArray1<f64>> {
    let angles_deg = theta_deg.as_array();
    let levels_db =
        angles_deg.iter().map(|theta_deg| db_from_ratio(law.sigma0(theta_deg.to_radians())));
    PyArray1::from_iter(py, levels_db)
}

#[pymethods]
impl Material {
    /// Short name.
    #[getter]
    fn name(&self) -> &str {
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
    fn sigma0_db<'py>(
        &self,
        py: Python<'py>,
        theta_deg: PyArrayLike1<'py, f64, numpy::AllowTypeChange>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let law = self.found.material.scattering().map_err(raised)?;
        Ok(sigma0_db(py, &law, &theta_deg))
    }

    /// All that is known of it, as `matdb show --json` prints it.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.found.material)
    }

    fn __repr__(&self) -> String {
        let name = match self.found.revision {
            Some(revision) => format!("{}@{revision}", self.name()),
            None => format!("{}, built in", self.name()),
        };
        format!("<matdb.Material {name}: {}>", self.title())
    }
}
