//! Measured clouds against a rendering, and against a calibration target.

use std::path::PathBuf;

use matdb::error::Error;
use matdb::files::write_all;
use matdb::frames::Pose;
use matdb::measure::Calibration;
use matdb::measure::Start;
use matdb::measure::compare::Line;
use matdb::report::{self, CalibrationReport};
use matdb::setup::{ReadyScene, absolute};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use serde_json::Value;

use crate::cloud::CloudLike;
use crate::database::Database;
use crate::error::{UsageError, raised};
use crate::interrupt::interruptible;
use crate::json::to_python;
use crate::pose::PoseLike;
use crate::scene::SceneLike;

/// A measured image beside a simulated one.
#[pyclass(frozen, module = "matdb")]
pub(crate) struct Comparison {
    comparison: report::Comparison,
    record: Value,
}

/// Renders the mean power of a scene and compares it with a cloud that was measured of it.
///
/// Parameters
/// ----------
/// cloud : Cloud, Scan, str or os.PathLike
/// scene : Scene, str or os.PathLike
///     With the materials to judge.
/// db : Database, optional
///     Where materials are looked for; without it, and for those that it does not have, the built-in ones.
/// pose : sequence of float, str or os.PathLike, optional
///     Where the target stood: the `pose.json` of a measurement, or x, y, z in m and turns about x, y, z in degrees.
/// fit : str, optional
///     Name of a fit of the materials to render in place of what they render.
///
/// Returns
/// -------
/// Comparison
#[pyfunction]
#[pyo3(signature = (cloud, scene, *, db = None, pose = None, fit = None))]
pub(crate) fn compare(
    py: Python<'_>,
    cloud: CloudLike,
    scene: SceneLike,
    db: Option<&Database>,
    pose: Option<PoseLike>,
    fit: Option<&str>,
) -> PyResult<Comparison> {
    let scene = scene.scene(py)?;
    let scene = scene.get();
    let effects = scene.own_effects(py)?;
    let compared = interruptible(py, |_| {
        let store = db.map_or(Ok(None), Database::read)?;
        let pose = match pose.map(|pose| pose.start()).transpose()? {
            None => Pose::NONE,
            Some(Start::Given(pose)) => pose,
            Some(Start::Automatic) => {
                let problem = "pose = \"auto\" needs a registration".to_owned();
                let way_out = "measure with it, and give the pose.json that it saves".to_owned();
                return Err(Error::Usage { problem, way_out });
            }
        };
        let mut ready =
            ReadyScene::new_mean(scene.scene().clone(), scene.path(), pose, store.as_ref())?;
        ready = ready.with_own_effects(effects);
        drop(store);
        if let Some(name) = fit {
            ready.choose_fit(name)?;
        }
        let unstated = ready.check_footprints()?;
        let cloud_path = cloud.path();
        let cloud = absolute(cloud.read()?.into_owned(), cloud_path)?;
        let comparison = report::Comparison::new(&ready, &cloud)?;
        let notices = [cloud.notices, ready.notices(), Vec::from_iter(unstated)].concat();
        let record = comparison.record(cloud_path, scene.path(), &notices);
        Ok(Comparison { comparison, record })
    })?;
    compared.map_err(raised::<Error>)
}

/// Calibrates the beam of a radar by a cloud of a plate, a sphere or a trihedral: what `matdb calibrate --json` prints.
///
/// Parameters
/// ----------
/// cloud : Cloud, Scan, str or os.PathLike
/// scene : Scene, str or os.PathLike
///     Radar, scan and a single target, such as `builtin:calibration-plate`.
/// db : Database, optional
///     As for `compare`.
/// within_db : float, default 20
///     Only points within this of the peak are used.
///
/// Returns
/// -------
/// dict
#[pyfunction]
#[pyo3(signature = (cloud, scene, *, db = None, within_db = Calibration::default().within_db))]
pub(crate) fn calibrate<'py>(
    py: Python<'py>,
    cloud: CloudLike,
    scene: SceneLike,
    db: Option<&Database>,
    within_db: f64,
) -> PyResult<Bound<'py, PyAny>> {
    if !(6.0..=60.0).contains(&within_db) {
        let problem = format!("within_db = {within_db} is not a span; give dB from 6 to 60");
        return Err(UsageError::new_err(problem));
    }
    let scene = scene.scene(py)?;
    let scene = scene.get();
    let effects = scene.own_effects(py)?;
    let record = interruptible(py, |_| -> Result<Value, Error> {
        let store = db.map_or(Ok(None), Database::read)?;
        let ready = ReadyScene::new(scene.scene().clone(), scene.path(), store.as_ref())?;
        let ready = ready.with_own_effects(effects);
        drop(store);
        let path = cloud.path();
        let cloud = absolute(cloud.read()?.into_owned(), path)?;
        let report = CalibrationReport::new(&ready, &cloud, path, Calibration { within_db })?;
        let notices = [cloud.notices, ready.notices(), report.notices()].concat();
        Ok(report.record(path, scene.path(), &notices))
    })?;
    to_python(py, &record.map_err(raised)?)
}

impl Comparison {
    fn image<'py>(
        &self,
        py: Python<'py>,
        raster: &matdb::geometry::Raster,
        channel: &str,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let values = raster.channel(channel).unwrap_or_default().to_vec();
        PyArray1::from_vec(py, values).reshape([raster.height, raster.width])
    }
}

#[pymethods]
impl Comparison {
    /// Measured power, dBm: float32 (rows, columns), NaN where nothing was detected.
    #[getter]
    fn measured_dbm<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        self.image(py, &self.comparison.images[0], "power_dbm")
    }

    /// Simulated power, dBm, as `measured_dbm`.
    #[getter]
    fn simulated_dbm<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        self.image(py, &self.comparison.images[1], "power_dbm")
    }

    /// How far both agree, and what a person should not overlook, as `error.json` has it.
    #[getter]
    fn record<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.record)
    }

    /// Writes the files that `matdb compare` writes; the line scan is of a stripe at the height `y_m`.
    #[pyo3(signature = (folder, *, y_m = 1.1, width_m = 0.02))]
    fn save(&self, py: Python<'_>, folder: PathBuf, y_m: f64, width_m: f64) -> PyResult<()> {
        let written = py.detach(|| {
            let line = Line { y_m, width_m };
            Ok(write_all(&folder, &self.comparison.files(line, &self.record)?)?)
        });
        written.map_err(raised::<Error>)
    }

    /// The measured picture, the simulated one and their difference, for a notebook.
    fn _repr_png_(&self) -> PyResult<Vec<u8>> {
        self.comparison.images_png().map_err(raised)
    }

    fn __repr__(&self) -> String {
        let agreement = &self.comparison.agreement;
        format!(
            "<matdb.Comparison of {}: simulated less measured {:.2} dB, rms {:.2} dB>",
            self.comparison.title, agreement.bias_db, agreement.rmse_db
        )
    }
}
