//! Measured clouds, registered to a scene and reduced to a curve.

use std::path::{Path, PathBuf};

use matdb::adopt::FitSubject;
use matdb::error::Error;
use matdb::files::write_all;
use matdb::material::{Observation, SourceKind};
use matdb::measure::{Reduction, Registration, Start};
use matdb::report::{MeasurementReport, MeasurementRequest};
use matdb::setup::read_pose;
use matdb::units::{db_from_ratio, watts_from_dbm};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::cloud::CloudLike;
use crate::database::Database;
use crate::error::raised;
use crate::fit::{Fit, Request, What};
use crate::json::to_python;
use crate::scene::SceneLike;

/// A measured cloud at its place on the target, and its curve.
#[pyclass(frozen, module = "matdb")]
pub(crate) struct Measurement {
    report: MeasurementReport,
    name: String,
    instrument: Instrument,
}

/// What a curve was measured with.
#[derive(Clone)]
pub(crate) struct Instrument {
    pub(crate) kind: SourceKind,
    pub(crate) name: String,
    pub(crate) frequency_hz: f64,
    pub(crate) threshold_w: f64,
}

/// Registers a measured cloud to a scene, and reduces it to a curve of backscatter over the angle of incidence.
///
/// Parameters
/// ----------
/// cloud : Cloud, Scan, str or os.PathLike
///     The cloud, that of a rendering, or its file: `.ply`, `.csv`, `.xyz`, `.pcd`, `.las` or `.laz`.
/// scene : Scene, str or os.PathLike
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
    cloud: CloudLike,
    scene: SceneLike,
    region: Option<&str>,
    pose: Option<PathBuf>,
) -> PyResult<Measurement> {
    let scene = scene.scene(py)?;
    let scene = scene.get();
    let measured = py.detach(|| {
        let start = match pose {
            None => Start::default(),
            Some(word) if word == Path::new("auto") => Start::Automatic,
            Some(file) => Start::Given(read_pose(&file)?),
        };
        let request = MeasurementRequest {
            cloud_file: cloud.path(),
            cloud: &*cloud.read()?,
            scene_file: scene.path(),
            scene: scene.scene(),
            registration: Registration { start, keep_given: true, ..Registration::default() },
            region,
            reduction: Reduction::default(),
        };
        let (name, radar) = (scene.scene().file.name.clone(), scene.scene().radar());
        let instrument = Instrument {
            kind: if cloud.is_simulated() { SourceKind::Synthetic } else { SourceKind::Measured },
            name: radar.preset.clone(),
            frequency_hz: radar.centre_frequency_ghz * 1e9,
            threshold_w: watts_from_dbm(radar.threshold_dbm),
        };
        request.run().map(|report| Measurement { report, name, instrument })
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
    ratio.map_or(f64::NAN, db_from_ratio)
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

    /// Fits a scattering model to the curve, as `matdb.fit` does.
    #[pyo3(signature = (model = None, *, db = None, method = "censored", fixed = None, looks = None, noise_dbm = None,
                        starts = None, seed = None))]
    #[expect(clippy::too_many_arguments, reason = "each is a keyword in Python")]
    fn fit(
        &self,
        py: Python<'_>,
        model: Option<&str>,
        db: Option<&Database>,
        method: &str,
        fixed: Option<&Bound<'_, PyDict>>,
        looks: Option<f64>,
        noise_dbm: Option<f64>,
        starts: Option<usize>,
        seed: Option<u64>,
    ) -> PyResult<Fit> {
        let request = Request { model, method, curve: None, fixed, looks, noise_dbm, starts, seed };
        let subject = FitSubject::of_curve(self.report.reduced.curve.clone(), "curve");
        request.run(py, What::Curve(Box::new(subject), self.instrument.clone()), db)
    }

    /// The curve over the angle of incidence, on axes of matplotlib.
    #[pyo3(signature = (ax = None))]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        ax: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("matdb._plots")?.call_method1("measurement", (slf, ax))
    }

    /// Pose with its covariance, how the registration ended, and what became of the points, as `pose.json` has it.
    #[getter]
    fn record<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.report.record)
    }

    /// Where the target stands: rotation, shift and their deviations, as `record` has it.
    #[getter]
    fn pose<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.record(py)?.get_item("pose")
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
