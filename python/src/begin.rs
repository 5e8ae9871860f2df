//! Files to begin with: a radar as pictures and tables, and new scenes and materials.

use std::path::PathBuf;

use matdb::error::Error;
use matdb::files::{folder_of, write_all};
use matdb::frames::{Global, Point};
use matdb::material::Slug;
use matdb::report::RadarReport;
use matdb::setup::{self, NewScene, write_new};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyTuple};
use serde_json::Value;

use crate::cloud::CloudLike;
use crate::error::{UsageError, raised, warn};
use crate::json::{of_text, text_of, to_python};
use crate::scene::{Scene, load_scene};
use crate::words::in_python;

/// The scan of a radar, its spot and the polynomial of its mirror.
#[pyclass(frozen, module = "matdb")]
pub(crate) struct Radar {
    record: Value,
    files: Vec<(String, Vec<u8>)>,
    notices: Vec<String>,
}

/// Shows a radar: where each chirp looks, how wide its spot is, and the polynomial of its mirror.
///
/// Parameters
/// ----------
/// radar : Scene, str or os.PathLike
///     A scene with the radar, its file, or the name of a preset such as `upm-300ghz`.
///
/// Returns
/// -------
/// Radar
///
/// Raises
/// ------
/// matdb.SceneError
///     A preset that is not known, or a radar that cannot exist.
#[pyfunction]
pub(crate) fn radar(py: Python<'_>, radar: &Bound<'_, PyAny>) -> PyResult<Radar> {
    let scene = radar.cast::<Scene>().ok().map(|scene| scene.get());
    let name = if scene.is_some() {
        PathBuf::new()
    } else {
        let refused = |_| {
            PyTypeError::new_err("give a matdb.Scene, the path of a scene file or a preset's name")
        };
        radar.extract::<PathBuf>().map_err(refused)?
    };
    let shown = py.detach(|| {
        let report = match scene {
            Some(scene) => RadarReport::of_scene(scene.scene())?,
            None => RadarReport::open(&name.to_string_lossy())?,
        };
        let files = report.files()?.into_iter().map(|(name, bytes)| (name.to_owned(), bytes));
        let (record, notices) = (report.record(), report.chirps.notices.clone());
        Ok(Radar { record, files: files.collect(), notices })
    });
    shown.map_err(raised::<Error>)
}

#[pymethods]
impl Radar {
    /// All that is known of it, as `matdb radar --json` prints it, but for the folder.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.record)
    }

    /// What a person should not overlook, a sentence each.
    #[getter]
    fn notices(&self) -> Vec<String> {
        self.notices.iter().map(|notice| in_python(notice)).collect()
    }

    /// Writes the files that `matdb radar` writes, all or none: `scan.csv` with the ray of each chirp, `spot.csv`, pictures of
    /// both, and `f5.toml` with the coefficients of the polynomial.
    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        py.detach(|| write_all(&folder, &self.files)).map_err(raised)
    }

    /// The picture of its scan, for a notebook.
    fn _repr_png_(&self) -> &[u8] {
        let scan = self.files.iter().find(|(name, _)| name == "scan.png");
        scan.map_or(&[], |(_, bytes)| bytes)
    }

    fn __repr__(&self) -> String {
        let preset = self.record["radar"]["preset"].as_str().unwrap_or_default();
        format!("<matdb.Radar {preset}: {} chirps>", self.record["chirps"])
    }

    /// A radar of its parts, as pickle makes one.
    #[staticmethod]
    fn _of_parts(
        record: &str,
        files: Vec<(String, Bound<'_, PyBytes>)>,
        notices: Vec<String>,
    ) -> PyResult<Radar> {
        let files = files.into_iter().map(|(name, bytes)| (name, bytes.as_bytes().to_vec()));
        Ok(Radar { record: of_text(record)?, files: files.collect(), notices })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, Radar { record, files, notices }) = (slf.py(), slf.get());
        let files = files.iter().map(|(name, bytes)| (name, PyBytes::new(py, bytes)));
        let parts = (text_of(record)?, Vec::from_iter(files), notices);
        (slf.get_type().getattr("_of_parts")?, parts).into_pyobject(py)
    }
}

/// Writes the scene of your own measurement, and beside it a CSV of the ray to each point, unless one of them is there.
///
/// Parameters
/// ----------
/// cloud : Cloud, Scan, str or os.PathLike
///     What was measured.
/// mesh : str or os.PathLike
///     Mesh of the target: a `.ply`, `.obj` or `.stl` file, or `builtin:NAME`.
/// path : str or os.PathLike, default "scene.toml"
///     Scene file to write.
/// radar_at_m : sequence of float, (3,), optional
///     Where the radar stood, m, in the frame of the cloud; found from the ranges unless stated.
/// look_at_m : sequence of float, (3,), optional
///     The middle of the radar's field of view, m, where its spot is narrowest; the middle of the points unless stated.
/// frequency_ghz : float, default 300
///     Centre frequency of the radar, GHz.
///
/// Returns
/// -------
/// Scene
///     The scene of the file. Its power, loss and beam are those of the preset until the file says yours.
///
/// Raises
/// ------
/// matdb.UsageError
///     A file that is there, and a place of the radar that is not known or contradicts the ranges.
///
/// Warns
/// -----
/// UserWarning
///     A place of the radar that is in doubt, and a mesh that is elsewhere.
#[pyfunction]
#[pyo3(signature = (cloud, mesh, path = PathBuf::from("scene.toml"), *, radar_at_m = None, look_at_m = None,
                    frequency_ghz = 300.0))]
pub(crate) fn new_scene(
    py: Python<'_>,
    cloud: CloudLike,
    mesh: PathBuf,
    path: PathBuf,
    radar_at_m: Option<[f64; 3]>,
    look_at_m: Option<[f64; 3]>,
    frequency_ghz: f64,
) -> PyResult<Scene> {
    let radar_at = place("radar_at_m", radar_at_m)?;
    let look_at = place("look_at_m", look_at_m)?;
    let made = py.detach(|| {
        let own = cloud.read()?;
        let new = NewScene {
            cloud_file: cloud.path(),
            cloud: &own,
            mesh: &mesh.to_string_lossy(),
            scene_file: &path,
            radar_at,
            look_at,
            frequency_ghz,
        };
        let made = new.make()?;
        write_new(folder_of(&path), &made.files)?;
        Ok([own.notices.clone(), made.notices].concat())
    });
    warn(py, &made.map_err(raised::<Error>)?)?;
    load_scene(py, path)
}

/// A place that a person gave.
fn place(key: &str, given: Option<[f64; 3]>) -> PyResult<Option<Point<Global>>> {
    let is_place = |xyz_m: [f64; 3]| xyz_m.iter().all(|m| m.is_finite() && m.abs() <= 1e4);
    match given {
        Some(xyz_m) if !is_place(xyz_m) => Err(UsageError::new_err(format!(
            "{key} = {xyz_m:?} is not a place; give (x, y, z) in m, within 10 km"
        ))),
        given => Ok(given.map(|[x_m, y_m, z_m]| Point::new(x_m, y_m, z_m))),
    }
}

/// Writes a folder with a complete, commented `material.toml` and the curve that it names, unless one of them is there. Once
/// its numbers are yours, `Database.add` takes it: `db.add(files=["my-paint"])`.
///
/// Parameters
/// ----------
/// name : str
///     Short name of the material: small letters, digits and hyphens.
/// folder : str or os.PathLike, optional
///     Folder to write; the name unless stated.
///
/// Returns
/// -------
/// pathlib.Path
///     The folder.
///
/// Raises
/// ------
/// matdb.UsageError
///     A name that no material can have, and a file that is there.
#[pyfunction]
#[pyo3(signature = (name, folder = None))]
pub(crate) fn new_material(
    py: Python<'_>,
    name: &str,
    folder: Option<PathBuf>,
) -> PyResult<PathBuf> {
    let slug: Slug = name.parse().map_err(|problem: String| UsageError::new_err(problem))?;
    let folder = folder.unwrap_or_else(|| PathBuf::from(name));
    py.detach(|| write_new(&folder, &setup::new_material(&slug))).map_err(raised)?;
    Ok(folder)
}
