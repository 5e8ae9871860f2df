//! Measured clouds, registered to a scene and reduced to a curve.

use std::path::{Path, PathBuf};

use matdb::error::Error;
use matdb::files::write_all;
use matdb::material::Observation;
use matdb::measure::{CloudReading, Reduction, Registration, Start};
use matdb::report::{MeasurementReport, MeasurementRequest};
use matdb::setup::{read_cloud, read_pose};
use numpy::PyArray1;
use pyo3::prelude::*;

use crate::error::raised;
use crate::json::to_python;
use crate::scene::Scene;

/// A measured cloud at its place on the target, and its curve.
#[pyclass(frozen, module = "matdb")]
pub(crate) struct Measurement {
    report: MeasurementReport,
    name: String,
}

/// Registers a measured cloud to a scene, and reduces it to a curve of backscatter over the angle of incidence.
///
/// Parameters
/// ----------
/// cloud : str or os.PathLike
///     The cloud's file: `.ply`, `.csv`, `.xyz`, `.pcd`, `.las` or `.laz`.
/// scene : Scene
///     What was measured.
/// region : str, optional
///     Only this region of the scene.
/// pose : str or os.PathLike, default none
///     `auto`, or a `pose.json`; the place of the scene unless stated.
///
/// Returns
/// -------
/// Measurement
#[pyfunction]
#[pyo3(signature = (cloud, scene, *, region = None, pose = None))]
pub(crate) fn measure(
    py: Python<'_>,
    cloud: PathBuf,
    scene: &Scene,
    region: Option<&str>,
    pose: Option<PathBuf>,
) -> PyResult<Measurement> {
    let measured = py.detach(|| {
        let start = match pose {
            None => Start::default(),
            Some(word) if word == Path::new("auto") => Start::Automatic,
            Some(file) => Start::Given(read_pose(&file)?),
        };
        let request = MeasurementRequest {
            cloud_file: &cloud,
            cloud: &read_cloud(&cloud, &CloudReading::default())?,
            scene_file: scene.path(),
            scene: scene.scene(),
            registration: Registration { start, keep_given: true, ..Registration::default() },
            region,
            reduction: Reduction::default(),
        };
        let name = scene.scene().file.name.clone();
        request.run().map(|report| Measurement { report, name })
    });
    measured.map_err(raised::<Error>)
}

impl Measurement {
    fn column<'py>(
        &self,
        py: Python<'py>,
        value: impl Fn(&Observation) -> f64,
    ) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.report.reduced.curve.observations.iter().map(value))
    }
}

/// A ratio in dB; NaN for none.
fn level_db(ratio: Option<f64>) -> f64 {
    ratio.map_or(f64::NAN, |ratio| 10.0 * ratio.log10())
}

#[pymethods]
impl Measurement {
    /// Angle of incidence of each chirp of the curve, degrees: float64 (n,).
    #[getter]
    fn theta_deg<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.column(py, |row| row.theta_i_rad.to_degrees())
    }

    /// Backscatter of each chirp, dB: float64 (n,), NaN where nothing was detected.
    #[getter]
    fn sigma0_db<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.column(py, |row| level_db(row.sigma0))
    }

    /// Backscatter below which nothing would have been detected, dB: float64 (n,), NaN where that is not known.
    #[getter]
    fn threshold_db<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.column(py, |row| level_db(row.threshold_sigma0))
    }

    /// Pose with its covariance, how the registration ended, and what became of the points, as `pose.json` has it.
    #[getter]
    fn record<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.report.record)
    }

    /// What a person should not overlook, a sentence each.
    #[getter]
    fn notices(&self) -> Vec<String> {
        self.report.notices.clone()
    }

    /// Writes the files that `matdb measure` writes, all or none.
    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        py.detach(|| write_all(&folder, &self.report.files)).map_err(raised)
    }

    fn __len__(&self) -> usize {
        self.report.reduced.curve.observations.len()
    }

    fn __repr__(&self) -> String {
        format!("<matdb.Measurement of {}: {} chirps>", self.name, self.__len__())
    }
}
