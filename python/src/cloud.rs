//! Measured points, of arrays or of a file.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use matdb::adopt::input;
use matdb::error::Error;
use matdb::files::read_whole;
use matdb::formats::{ColumnNames, PointTable};
use matdb::material::{Input, Scale};
use matdb::measure::{self, CloudPoint, CloudReading, PowerUnit};
use matdb::setup::read_cloud;
use matdb::units::dbm_from_watts;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyCapsule, PyDict, PyTuple};

use crate::arrow::{Column, stream};
use crate::error::{UsageError, no_choice, raised};
use crate::numbers;
use crate::scan::Scan;
use crate::scene::Scene;
use crate::words::in_python;

/// Name of a cloud that is in no file.
const POINTS: &str = "points";

/// Detections: a place and a power each, in the global frame.
#[pyclass(frozen, module = "matdb")]
pub(crate) struct Cloud {
    cloud: measure::Cloud,
}

/// A cloud as an argument: points, or their file.
pub(crate) enum CloudLike {
    Cloud(Py<Cloud>),
    /// What the radar of a rendering measured.
    Simulated(Py<Cloud>),
    File(PathBuf),
}

impl<'py> FromPyObject<'_, 'py> for CloudLike {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<CloudLike> {
        if let Ok(cloud) = given.cast::<Cloud>() {
            return Ok(CloudLike::Cloud(cloud.to_owned().unbind()));
        }
        if let Ok(scan) = given.cast::<Scan>() {
            return Ok(CloudLike::Simulated(Py::new(given.py(), scan.get().points(given.py())?)?));
        }
        let given = given.extract().map(CloudLike::File);
        given.map_err(|_| {
            PyTypeError::new_err("give a matdb.Cloud, a matdb.Scan or the path of a file")
        })
    }
}

impl CloudLike {
    /// The file, or a name in its place.
    pub(crate) fn path(&self) -> &Path {
        match self {
            CloudLike::Cloud(_) | CloudLike::Simulated(_) => Path::new(POINTS),
            CloudLike::File(path) => path,
        }
    }

    pub(crate) fn is_simulated(&self) -> bool {
        matches!(self, CloudLike::Simulated(_))
    }

    /// The points.
    pub(crate) fn read(&self) -> Result<Cow<'_, measure::Cloud>, Error> {
        match self {
            CloudLike::Cloud(cloud) | CloudLike::Simulated(cloud) => {
                Ok(Cow::Borrowed(&cloud.get().cloud))
            }
            CloudLike::File(path) => read_cloud(path, &CloudReading::default()).map(Cow::Owned),
        }
    }

    /// What the points are, for a record; `path` is their file or a name in its place.
    pub(crate) fn input(&self, path: &Path) -> Result<Input, Error> {
        let bytes = match self {
            CloudLike::Cloud(cloud) | CloudLike::Simulated(cloud) => {
                let points = cloud.get().cloud.points().iter();
                let numbers = points.flat_map(|point| {
                    let [x, y, z] = point.point.xyz.to_array();
                    [x, y, z, point.power_w, point.range_m.unwrap_or(f64::NAN)]
                });
                numbers.flat_map(f64::to_le_bytes).collect()
            }
            CloudLike::File(file) => read_whole(file)?,
        };
        Ok(input(path, &bytes))
    }
}

impl Cloud {
    /// The detections of a table, which has the columns of a file.
    pub(crate) fn of_columns(columns: Vec<(String, Vec<f64>)>) -> Result<Cloud, Error> {
        let cloud = CloudReading::default().read_table(PointTable::of_columns(columns));
        let cloud = cloud.map_err(|error| Error::Cloud { file: PathBuf::from(POINTS), error })?;
        Ok(Cloud { cloud })
    }
}

#[pymethods]
impl Cloud {
    /// Detections of arrays.
    ///
    /// Parameters
    /// ----------
    /// xyz_m : array_like, (n, 3)
    ///     Places in the global frame, m. Points with NaN are left out.
    /// power_dbm : array_like, (n,)
    ///     Received power, dBm.
    /// chirp : array_like of int, (n,), optional
    ///     Numbers of the chirps; a point without one, or with NaN, is of the chirp in whose direction it lies.
    /// range_m : array_like, (n,), optional
    ///     Measured ranges, m; those of the places without them, or where they are NaN.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     Arrays whose lengths differ.
    /// matdb.Error
    ///     No point, numbers that are not finite, powers in watts, and powers that nothing receives.
    #[new]
    #[pyo3(signature = (xyz_m, power_dbm, *, chirp = None, range_m = None))]
    fn new<'py>(
        py: Python<'py>,
        xyz_m: &Bound<'py, PyAny>,
        power_dbm: &Bound<'py, PyAny>,
        chirp: Option<&Bound<'py, PyAny>>,
        range_m: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Cloud> {
        let places = numbers::rows("xyz_m", xyz_m)?;
        let others = [("power_dbm", Some(power_dbm)), ("chirp", chirp), ("range_m", range_m)];
        let mut columns = Vec::new();
        for (name, values) in others {
            if let Some(values) = values {
                columns.push((name.to_owned(), numbers::line(name, values)?));
            }
        }
        if columns.iter().any(|(_, values)| values.len() != places.len()) {
            let lengths =
                columns.iter().map(|(name, values)| format!("{name} ({},)", values.len()));
            return Err(PyValueError::new_err(format!(
                "the shapes differ: xyz_m ({}, 3), {}; give (n, 3) and n of everything else",
                places.len(),
                lengths.collect::<Vec<_>>().join(", ")
            )));
        }
        for (axis, name) in ["x_m", "y_m", "z_m"].into_iter().enumerate() {
            columns.push((name.to_owned(), places.iter().map(|place| place[axis]).collect()));
        }
        py.detach(|| Cloud::of_columns(columns)).map_err(raised)
    }

    /// The detections of a file: `.ply`, `.csv`, `.xyz`, `.pcd`, `.las` or `.laz`.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    /// unit : str, default "m"
    ///     Unit of the places where the columns do not name it: `m` or `mm`.
    /// power : str, default "dbm"
    ///     Unit of the power where the column does not name it: `dbm`, `w`, `relative` (dB of an unknown level) or `counts`.
    /// columns : dict of str to str, optional
    ///     Our names for columns of the file, as in `{"Intensity": "power_dbm"}`; `-` passes one over.
    /// target_frame_of : Scene, optional
    ///     The scene in whose target frame the places are; in the global frame without it.
    #[staticmethod]
    #[pyo3(signature = (path, *, unit = "m", power = "dbm", columns = None, target_frame_of = None))]
    fn load(
        py: Python<'_>,
        path: PathBuf,
        unit: &str,
        power: &str,
        columns: Option<&Bound<'_, PyDict>>,
        target_frame_of: Option<&Scene>,
    ) -> PyResult<Cloud> {
        let reading = CloudReading {
            metres_per_unit: match unit {
                "m" => 1.0,
                "mm" => 1e-3,
                other => return Err(no_choice("unit", other, "m or mm")),
            },
            power: match power {
                "dbm" => PowerUnit::Dbm,
                "w" => PowerUnit::Watt,
                "relative" => PowerUnit::RelativeDb,
                "counts" => PowerUnit::Counts,
                other => return Err(no_choice("power", other, "dbm, w, relative or counts")),
            },
            columns: columns.map_or(Ok(ColumnNames::default()), column_names)?,
            global_from_target: target_frame_of
                .map(|scene| scene.scene().radar().frames().global_from_target),
        };
        let cloud = py.detach(|| read_cloud(&path, &reading)).map_err(raised)?;
        Ok(Cloud { cloud })
    }

    /// Places in the global frame, m: float64 (n, 3).
    #[getter]
    fn xyz_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let points = self.cloud.points();
        let flat = PyArray1::from_iter(py, points.iter().flat_map(|one| one.point.xyz.to_array()));
        flat.reshape([points.len(), 3])
    }

    /// Received power, dBm: float64 (n,). Where `is_relative`, the strongest has 0.
    #[getter]
    fn power_dbm<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.cloud.points().iter().map(|one| dbm_from_watts(one.power_w)))
    }

    /// Whether the powers are known up to a common factor only.
    #[getter]
    fn is_relative(&self) -> bool {
        self.cloud.scale == Scale::Relative
    }

    /// Numbers of the chirps: float64 (n,), NaN where there is none.
    #[getter]
    fn chirp<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let points = self.cloud.points().iter();
        PyArray1::from_iter(py, points.map(|one| one.chirp.map_or(f64::NAN, f64::from)))
    }

    /// Measured ranges, m: float64 (n,), NaN where there is none.
    #[getter]
    fn range_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let points = self.cloud.points().iter();
        PyArray1::from_iter(py, points.map(|one| one.range_m.unwrap_or(f64::NAN)))
    }

    /// What a person should not overlook, a sentence each.
    #[getter]
    fn notices(&self) -> Vec<String> {
        self.cloud.notices.iter().map(|notice| in_python(notice)).collect()
    }

    /// A copy as a table of pyarrow: `x_m`, `y_m`, `z_m`, `power_dbm` (`power_db` where `is_relative`), `chirp` and `range_m`.
    /// What a point lacks is null.
    fn to_arrow<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("matdb._extras")?.call_method1("to_arrow", (slf,))
    }

    /// A copy by the Arrow C stream interface, as `to_arrow`.
    #[pyo3(signature = (requested_schema = None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        let _ = requested_schema;
        let points = self.cloud.points();
        let number =
            |name, value: fn(&CloudPoint) -> f64| Column::of_f64(name, points.iter().map(value));
        let power = if self.is_relative() { "power_db" } else { "power_dbm" };
        let columns = vec![
            number("x_m", |one| one.point.xyz.x),
            number("y_m", |one| one.point.xyz.y),
            number("z_m", |one| one.point.xyz.z),
            number(power, |one| dbm_from_watts(one.power_w)),
            Column::of_u32("chirp", points.iter().map(|one| one.chirp)),
            number("range_m", |one| one.range_m.unwrap_or(f64::NAN)),
        ];
        stream(py, columns)
    }

    fn __len__(&self) -> usize {
        self.cloud.points().len()
    }

    fn __repr__(&self) -> String {
        format!("<matdb.Cloud: {} points>", self.__len__())
    }

    /// A cloud of the columns of a file, as pickle makes one.
    #[staticmethod]
    fn _of_columns(columns: Vec<(String, Bound<'_, PyArray1<f64>>)>) -> PyResult<Cloud> {
        let columns = columns.into_iter().map(|(name, values)| Ok((name, values.to_vec()?)));
        Cloud::of_columns(columns.collect::<PyResult<_>>()?).map_err(raised)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, own) = (slf.py(), slf.get());
        let points = own.cloud.points().iter();
        let power = if own.is_relative() { "power_counts" } else { "power_w" };
        let column =
            |value: fn(&CloudPoint) -> f64| PyArray1::from_iter(py, points.clone().map(value));
        let columns = vec![
            ("x_m", column(|one| one.point.xyz.x)),
            ("y_m", column(|one| one.point.xyz.y)),
            ("z_m", column(|one| one.point.xyz.z)),
            (power, column(|one| one.power_w)),
            ("chirp", own.chirp(py)),
            ("range_m", own.range_m(py)),
        ];
        (slf.get_type().getattr("_of_columns")?, (columns,)).into_pyobject(py)
    }
}

/// Our names for columns, by theirs.
pub(crate) fn column_names(names: &Bound<'_, PyDict>) -> PyResult<ColumnNames> {
    if names.is_empty() {
        return Ok(ColumnNames::default());
    }
    let mut pairs = Vec::new();
    for (theirs, ours) in names {
        pairs.push(format!("{}={}", theirs.extract::<String>()?, ours.extract::<String>()?));
    }
    pairs
        .join(",")
        .parse()
        .map_err(|error: matdb::formats::FormatError| UsageError::new_err(error.to_string()))
}
