//! Measured clouds, registered to a scene and reduced to a curve.

use std::path::PathBuf;

use matdb::adopt::FitSubject;
use matdb::error::Error;
use matdb::files::write_all;
use matdb::material::{Observation, SourceKind};
use matdb::measure::{Curve, Metric, Reduction, Registration, Start};
use matdb::report::{MeasurementReport, MeasurementRequest};
use matdb::units::{db_from_ratio, dbm_from_watts, watts_from_dbm};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyCapsule, PyDict, PyTuple};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::arrow::{Column, stream};
use crate::cloud::CloudLike;
use crate::error::{UsageError, no_choice, raised};
use crate::json::{of_text, text_of, to_python};
use crate::own::refuse_inside;
use crate::pose::PoseLike;
use crate::scene::SceneLike;
use crate::words::in_python;

/// A measured cloud at its place on the target, and its curve.
#[pyclass(frozen, module = "matdb")]
pub(crate) struct Measurement {
    facts: Facts,
    files: Vec<(String, Vec<u8>)>,
}

/// What is known of a measurement, but for its files.
#[derive(Serialize, Deserialize)]
struct Facts {
    curve: Curve,
    record: Value,
    notices: Vec<String>,
    name: String,
    instrument: Instrument,
}

/// What a curve was measured with.
#[derive(Clone, Serialize, Deserialize)]
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
/// pose : sequence of float, str or os.PathLike, optional
///     Rough pose of the target after that of the scene: x, y, z in m and turns about x, y, z in degrees, a `pose.json`, or
///     `auto`. The place of the scene unless stated.
/// refine : bool, default False
///     Whether the found pose is used even where the points agree with the given one.
/// keep_pose : bool, default False
///     Whether the given pose is taken as it is.
/// metric : str, default "along-ray"
///     What the registration minimises: gaps `along-ray`, distances `point-to-plane` or, as in the paper, `point-to-point`.
/// edge_margin_m : float, optional
///     What is nearer than this to an edge or another region is left out, m; a spot unless stated.
/// exact_mesh : bool, default False
///     Whether the target is the facets of the mesh, as in a rendered cloud.
///
/// Returns
/// -------
/// Measurement
#[pyfunction]
#[pyo3(signature = (cloud, scene, *, region = None, pose = None, refine = false, keep_pose = false,
                    metric = "along-ray", edge_margin_m = None, exact_mesh = false))]
#[expect(clippy::too_many_arguments, reason = "each is a keyword in Python")]
pub(crate) fn measure(
    py: Python<'_>,
    cloud: CloudLike,
    scene: SceneLike,
    region: Option<&str>,
    pose: Option<PoseLike>,
    refine: bool,
    keep_pose: bool,
    metric: &str,
    edge_margin_m: Option<f64>,
    exact_mesh: bool,
) -> PyResult<Measurement> {
    let registration = match metric {
        "along-ray" => Registration::default(),
        "point-to-plane" => {
            Registration { metric: Metric::PointToPlane, ..Registration::default() }
        }
        "point-to-point" => Registration::paper(),
        other => {
            return Err(no_choice("metric", other, "along-ray, point-to-plane or point-to-point"));
        }
    };
    if refine && keep_pose {
        return Err(UsageError::new_err(
            "a pose is refined or kept; leave refine or keep_pose out",
        ));
    }
    if keep_pose && matches!(pose, Some(PoseLike::Automatic)) {
        return Err(UsageError::new_err(
            "there is no pose to keep; give pose=(x, y, z, rx, ry, rz) in place of \"auto\"",
        ));
    }
    if let Some(margin_m) = edge_margin_m.filter(|margin_m| !(0.0..=1.0).contains(margin_m)) {
        let problem = format!("edge_margin_m = {margin_m} is not a margin; give 0 to 1");
        return Err(UsageError::new_err(problem));
    }
    let scene = scene.scene(py)?;
    let scene = scene.get();
    refuse_inside()?;
    let measured = py.detach(|| {
        let start = pose.map_or(Ok(Start::default()), |pose| pose.start())?;
        let request = MeasurementRequest {
            cloud_file: cloud.path(),
            cloud: &*cloud.read()?,
            scene_file: scene.path(),
            scene: scene.scene(),
            registration: Registration {
                start,
                keep_given: !refine,
                keep: keep_pose,
                ..registration
            },
            region,
            reduction: Reduction { edge_margin_m, exact_mesh, ..Reduction::default() },
        };
        let (name, radar) = (scene.scene().file.name.clone(), scene.scene().radar());
        let instrument = Instrument {
            kind: if cloud.is_simulated() { SourceKind::Synthetic } else { SourceKind::Measured },
            name: radar.preset.clone(),
            frequency_hz: radar.centre_frequency_ghz * 1e9,
            threshold_w: watts_from_dbm(radar.threshold_dbm),
        };
        let MeasurementReport { reduced, record, files, notices, .. } = request.run()?;
        let facts = Facts { curve: reduced.curve, record, notices, name, instrument };
        let files = files.into_iter().map(|(name, bytes)| (name.to_owned(), bytes)).collect();
        Ok(Measurement { facts, files })
    });
    measured.map_err(raised::<Error>)
}

impl Measurement {
    /// The curve, to be fitted.
    pub(crate) fn subject(&self) -> (FitSubject, Instrument) {
        let Facts { curve, instrument, .. } = &self.facts;
        (FitSubject::of_curve(curve.clone(), "curve"), instrument.clone())
    }

    fn column<'py>(
        &self,
        py: Python<'py>,
        value: impl Fn(&Observation) -> f64,
    ) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.facts.curve.observations.iter().map(value))
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

    /// Fits a scattering model to the curve: `matdb.fit` with this curve and the same keywords.
    #[pyo3(signature = (model = None, **settings))]
    fn fit<'py>(
        slf: &Bound<'py, Self>,
        model: Option<Bound<'py, PyAny>>,
        settings: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = slf.py();
        let keywords = settings.map_or_else(|| Ok(PyDict::new(py)), |settings| settings.copy())?;
        keywords.set_item("model", model)?;
        py.import("matdb")?.getattr("fit")?.call((slf,), Some(&keywords))
    }

    /// A copy of the curve as a table of pyarrow: `theta_deg`, `theta_sd_deg`, `sigma0_db`, `threshold_db`, `power_dbm`,
    /// `range_m`, `chirp`, `xt_m` and `yt_m`. What a chirp lacks, such as a level where nothing was detected, is null.
    fn to_arrow<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("matdb._extras")?.call_method1("to_arrow", (slf,))
    }

    /// A copy of the curve by the Arrow C stream interface, as `to_arrow`.
    #[pyo3(signature = (requested_schema = None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        let _ = requested_schema;
        let rows = &self.facts.curve.observations;
        let number = |name, value: fn(&Observation) -> Option<f64>| {
            Column::of_f64(name, rows.iter().map(|row| value(row).unwrap_or(f64::NAN)))
        };
        let columns = vec![
            number("theta_deg", |row| Some(row.theta_i_rad.to_degrees())),
            number("theta_sd_deg", |row| row.theta_sd_rad.map(f64::to_degrees)),
            number("sigma0_db", |row| row.sigma0.map(db_from_ratio)),
            number("threshold_db", |row| row.threshold_sigma0.map(db_from_ratio)),
            // That of a silent chirp is a limit.
            number("power_dbm", |row| row.sigma0.and(row.power_w).map(dbm_from_watts)),
            number("range_m", |row| row.range_m),
            Column::of_u32("chirp", rows.iter().map(|row| row.chirp)),
            number("xt_m", |row| row.target_m.map(|[x_m, _]| x_m)),
            number("yt_m", |row| row.target_m.map(|[_, y_m]| y_m)),
        ];
        stream(py, columns)
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
        to_python(py, &self.facts.record)
    }

    /// Where the target stands: rotation, shift and their deviations, as `record` has it.
    #[getter]
    fn pose<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.record(py)?.get_item("pose")
    }

    /// What a person should not overlook, a sentence each.
    #[getter]
    fn notices(&self) -> Vec<String> {
        self.facts.notices.iter().map(|notice| in_python(notice)).collect()
    }

    /// Writes the files that `matdb measure` writes, all or none.
    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        py.detach(|| write_all(&folder, &self.files)).map_err(raised)
    }

    fn __len__(&self) -> usize {
        self.facts.curve.observations.len()
    }

    fn __repr__(&self) -> String {
        format!("<matdb.Measurement of {}: {} chirps>", self.facts.name, self.__len__())
    }

    /// A measurement of its parts, as pickle makes one.
    #[staticmethod]
    fn _of_parts(facts: &str, files: Vec<(String, Bound<'_, PyBytes>)>) -> PyResult<Measurement> {
        let files = files.into_iter().map(|(name, bytes)| (name, bytes.as_bytes().to_vec()));
        Ok(Measurement { facts: of_text(facts)?, files: files.collect() })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, Measurement { facts, files }) = (slf.py(), slf.get());
        let files = files.iter().map(|(name, bytes)| (name, PyBytes::new(py, bytes)));
        let parts = (text_of(facts)?, Vec::from_iter(files));
        (slf.get_type().getattr("_of_parts")?, parts).into_pyobject(py)
    }
}
