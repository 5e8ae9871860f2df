//! Measured points, of arrays or of a file.

use std::path::{Path, PathBuf};

use matdb::adopt::input;
use matdb::error::Error;
use matdb::files::read_whole;
use matdb::frames::Point;
use matdb::material::Input;
use matdb::measure::{self, CloudPoint, CloudReading};
use matdb::setup::read_cloud;
use matdb::units::{dbm_from_watts, watts_from_dbm};
use numpy::{AllowTypeChange, PyArray1, PyArray2, PyArrayLike1, PyArrayLike2, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::error::raised;

/// Name of a cloud that is in no file.
const POINTS: &str = "points";

/// Detections: a place and a power each, in the global frame.
#[pyclass(frozen, module = "matdb")]
pub(crate) struct Cloud {
    cloud: measure::Cloud,
}

/// A cloud as an argument: points, or their file.
#[derive(FromPyObject)]
pub(crate) enum CloudLike {
    Cloud(Py<Cloud>),
    File(PathBuf),
}

impl CloudLike {
    /// The file, or a name in its place.
    pub(crate) fn path(&self) -> &Path {
        match self {
            CloudLike::Cloud(_) => Path::new(POINTS),
            CloudLike::File(path) => path,
        }
    }

    pub(crate) fn is_file(&self) -> bool {
        matches!(self, CloudLike::File(_))
    }

    /// The points.
    pub(crate) fn read(&self) -> Result<measure::Cloud, Error> {
        match self {
            CloudLike::Cloud(cloud) => Ok(cloud.get().cloud.clone()),
            CloudLike::File(path) => read_cloud(path, &CloudReading::default()),
        }
    }

    /// What the points are, for a record.
    pub(crate) fn input(&self) -> Result<Input, Error> {
        let bytes = match self {
            CloudLike::Cloud(cloud) => {
                let points = cloud.get().cloud.points().iter();
                let numbers = points.flat_map(|point| {
                    let [x, y, z] = point.point.xyz.to_array();
                    [x, y, z, point.power_w, point.range_m.unwrap_or(f64::NAN)]
                });
                numbers.flat_map(f64::to_le_bytes).collect()
            }
            CloudLike::File(path) => read_whole(path)?,
        };
        Ok(input(self.path(), &bytes))
    }
}

#[pymethods]
impl Cloud {
    /// Detections of arrays.
    ///
    /// Parameters
    /// ----------
    /// xyz_m : array_like, (n, 3)
    ///     Places in the global frame, m.
    /// power_dbm : array_like, (n,)
    ///     Received power, dBm.
    /// chirp : array_like of int, (n,), optional
    ///     Numbers of the chirps; without them each point is of the chirp in whose direction it lies.
    /// range_m : array_like, (n,), optional
    ///     Measured ranges, m; without them those of the places.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     Arrays whose lengths differ.
    /// matdb.Error
    ///     No point, numbers that are not finite, and powers that nothing receives.
    #[new]
    #[pyo3(signature = (xyz_m, power_dbm, *, chirp = None, range_m = None))]
    fn new<'py>(
        xyz_m: PyArrayLike2<'py, f64, AllowTypeChange>,
        power_dbm: PyArrayLike1<'py, f64, AllowTypeChange>,
        chirp: Option<PyArrayLike1<'py, u32, AllowTypeChange>>,
        range_m: Option<PyArrayLike1<'py, f64, AllowTypeChange>>,
    ) -> PyResult<Cloud> {
        let (places, powers) = (xyz_m.as_array(), power_dbm.as_array());
        let (chirps, ranges) =
            (chirp.as_ref().map(|one| one.as_array()), range_m.as_ref().map(|one| one.as_array()));
        let count = powers.len();
        let lengths =
            [Some(places.nrows()), chirps.map(|one| one.len()), ranges.map(|one| one.len())];
        if places.ncols() != 3 || lengths.into_iter().flatten().any(|length| length != count) {
            let shape = places.shape();
            return Err(PyValueError::new_err(format!(
                "xyz_m has the shape {shape:?} and power_dbm {count} values; give (n, 3) and n of everything else"
            )));
        }
        let points = (0..count).map(|row| CloudPoint {
            chirp: chirps.map(|one| one[row]),
            point: Point::new(places[[row, 0]], places[[row, 1]], places[[row, 2]]),
            range_m: ranges.map(|one| one[row]),
            power_w: watts_from_dbm(powers[row]),
        });
        let cloud = measure::Cloud::new(points.collect());
        let failed = |error| raised(Error::Cloud { file: PathBuf::from(POINTS), error });
        Ok(Cloud { cloud: cloud.map_err(failed)? })
    }

    /// The detections of a file: `.ply`, `.csv`, `.xyz`, `.pcd`, `.las` or `.laz`.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Cloud> {
        let cloud = py.detach(|| read_cloud(&path, &CloudReading::default()));
        Ok(Cloud { cloud: cloud.map_err(raised)? })
    }

    /// Places in the global frame, m: float64 (n, 3).
    #[getter]
    fn xyz_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let points = self.cloud.points();
        let flat = PyArray1::from_iter(py, points.iter().flat_map(|one| one.point.xyz.to_array()));
        flat.reshape([points.len(), 3])
    }

    /// Received power, dBm: float64 (n,).
    #[getter]
    fn power_dbm<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.cloud.points().iter().map(|one| dbm_from_watts(one.power_w)))
    }

    /// What a person should not overlook, a sentence each.
    #[getter]
    fn notices(&self) -> Vec<String> {
        self.cloud.notices.clone()
    }

    fn __len__(&self) -> usize {
        self.cloud.points().len()
    }

    fn __repr__(&self) -> String {
        format!("<matdb.Cloud: {} points>", self.__len__())
    }
}
