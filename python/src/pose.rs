//! Where a target stood.

use std::path::PathBuf;

use matdb::error::Error;
use matdb::frames::{Global, Pose};
use matdb::measure::Start;
use matdb::setup::{pose_of_numbers, read_pose};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use crate::error::UsageError;

/// A pose as an argument.
pub(crate) enum PoseLike {
    Automatic,
    File(PathBuf),
    Given(Pose<Global, Global>),
}

const WANTED: &str = "give (x, y, z) in m, (x, y, z, rx, ry, rz) with degrees, or a pose.json";

impl<'py> FromPyObject<'_, 'py> for PoseLike {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<PoseLike> {
        if let Ok(path) = given.extract::<PathBuf>() {
            let is_automatic = path.as_os_str() == "auto";
            return Ok(if is_automatic { PoseLike::Automatic } else { PoseLike::File(path) });
        }
        let numbers: Vec<f64> = given.extract().map_err(|_| PyTypeError::new_err(WANTED))?;
        let pose = pose_of_numbers(&numbers);
        let problem = || UsageError::new_err(format!("{numbers:?} is not a pose; {WANTED}"));
        pose.map(PoseLike::Given).ok_or_else(problem)
    }
}

impl PoseLike {
    /// Where a registration starts.
    pub(crate) fn start(&self) -> Result<Start, Error> {
        match self {
            PoseLike::Automatic => Ok(Start::Automatic),
            PoseLike::File(path) => read_pose(path).map(Start::Given),
            PoseLike::Given(pose) => Ok(Start::Given(*pose)),
        }
    }
}
