//! Labelled data sets.

use std::path::{Path, PathBuf};

use matdb::dataset::{Dataset as Planned, DatasetRun};
use matdb::error::Error;
use pyo3::prelude::*;

use crate::database::Database;
use crate::error::{UsageError, raised, warn};
use crate::interrupt::{Stop, interruptible};
use crate::json::to_python;

/// A planned data set: many labelled scans of a scene in which something varies.
///
/// Its folder has everything that scans are made of. A scan depends on the plan and its own number, and on nothing else: the
/// bytes are the same for any number of threads, machines and interruptions.
#[pyclass(frozen, module = "matdb")]
pub(crate) struct Dataset {
    folder: PathBuf,
    name: String,
    scans: u32,
    shards: u32,
}

impl Dataset {
    fn of(planned: &Planned) -> Dataset {
        let plan = planned.plan();
        Dataset {
            folder: planned.folder().to_owned(),
            name: plan.name.clone(),
            scans: plan.scans,
            shards: plan.shards,
        }
    }

    fn make<'py>(
        &self,
        py: Python<'py>,
        part: Option<[u32; 2]>,
        progress: Option<&Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let made = interruptible(py, |stop| -> Result<DatasetRun, Error> {
            let planned = Planned::open(&self.folder)?;
            planned.run(part, &|now| hear(stop, progress, [now.done, now.of]))
        })?;
        to_python(py, &made.map_err(raised)?)
    }
}

/// Says how far the work is.
fn hear(stop: &Stop, progress: Option<&Py<PyAny>>, [done, of]: [u32; 2]) {
    stop.check();
    if let Some(progress) = progress {
        crate::own::called(|py| progress.call1(py, (done, of)).map(drop));
    }
}

/// Plans a labelled data set, or opens one that was planned.
///
/// Parameters
/// ----------
/// what : str or os.PathLike
///     The specification, a TOML file, or the folder of a plan.
/// folder : str or os.PathLike, optional
///     Folder of the data set that is planned; created if needed.
/// db : Database, optional
///     Where materials are looked for; without it, and for those that it does not have, the built-in ones.
///
/// Returns
/// -------
/// Dataset
///
/// Raises
/// ------
/// matdb.Error
///     A specification that cannot be, and a folder with another plan or with other files.
#[pyfunction]
#[pyo3(signature = (what, folder = None, *, db = None))]
pub(crate) fn dataset(
    py: Python<'_>,
    what: PathBuf,
    folder: Option<PathBuf>,
    db: Option<&Database>,
) -> PyResult<Dataset> {
    let planned = interruptible(py, |_| -> Result<Planned, Error> {
        let store = db.map_or(Ok(None), Database::read)?;
        match &folder {
            Some(folder) => Planned::make_plan(&what, folder, store.as_ref()),
            None => Planned::open(&what),
        }
    })?;
    Ok(Dataset::of(&planned.map_err(raised)?))
}

#[pymethods]
impl Dataset {
    /// Its folder.
    #[getter]
    fn folder(&self) -> &Path {
        &self.folder
    }

    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    /// Number of its shards, each of which is made as a whole or not at all.
    #[getter]
    fn shards(&self) -> u32 {
        self.shards
    }

    /// What was found out before the first scan: `seconds_per_scan` of one core, `bytes_per_scan`, the names behind the labels
    /// (`classes`), the splits, and the files that scans are made of.
    #[getter]
    fn plan<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let planned = py.detach(|| Planned::open(&self.folder)).map_err(raised)?;
        to_python(py, planned.plan())
    }

    fn __len__(&self) -> usize {
        self.scans as usize
    }

    fn __repr__(&self) -> String {
        let Dataset { name, scans, shards, folder } = self;
        format!("<matdb.Dataset {name}: {scans} scans, {shards} shards in {}>", folder.display())
    }

    fn __reduce__(slf: &Bound<'_, Self>) -> PyResult<(Py<PyAny>, (PathBuf,))> {
        let open = slf.py().import("matdb")?.getattr("dataset")?;
        let folder = std::path::absolute(&slf.get().folder)?;
        Ok((open.unbind(), (folder,)))
    }

    /// Makes the shards that are missing, on all cores or on a cluster. Ctrl-C ends it; what is done stays.
    ///
    /// Parameters
    /// ----------
    /// progress : callable, optional
    ///     Called with the numbers of scans that are done and that this call makes; with `ray`, of shards.
    /// ray : str, optional
    ///     Address of a Ray cluster: `"auto"` for the one that this process is part of, or else one of this machine. A task makes a
    ///     shard.
    /// shared : bool, default False
    ///     With `ray`, whether all nodes see the folder under this path. Otherwise they get the plan, and send the files back.
    ///
    /// Returns
    /// -------
    /// dict
    ///     Numbers of `shards` and `scans` that were made, and of `missing` shards.
    ///
    /// Raises
    /// ------
    /// matdb.Error
    ///     A disk that is too small, a machine that gives other bytes than the one that planned, a scan that cannot be made.
    #[pyo3(signature = (*, progress = None, ray = None, shared = false))]
    fn run<'py>(
        slf: &Bound<'py, Self>,
        progress: Option<Py<PyAny>>,
        ray: Option<&str>,
        shared: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = slf.py();
        if let Some(address) = ray {
            let on_ray = py.import("matdb._ray")?.getattr("run")?;
            return on_ray.call1((slf, address, shared, progress));
        }
        if shared {
            return Err(UsageError::new_err("shared is for ray; leave it out"));
        }
        slf.get().make(py, None, progress.as_ref())
    }

    /// Makes what is missing of one of several equal parts.
    ///
    /// Parameters
    /// ----------
    /// number : int
    ///     The part, from 0.
    /// of : int
    ///     Number of parts, at most that of the shards.
    ///
    /// Returns
    /// -------
    /// dict
    ///     As of `run`.
    fn shard<'py>(&self, py: Python<'py>, number: u32, of: u32) -> PyResult<Bound<'py, PyAny>> {
        self.make(py, Some([number, of]), None)
    }

    /// The shards that are missing or damaged, from 0.
    fn missing(&self, py: Python<'_>) -> PyResult<Vec<u32>> {
        let found = interruptible(py, |_| -> Result<_, Error> {
            Ok(Planned::open(&self.folder)?.missing())
        })?;
        found.map_err(raised)
    }

    /// Writes `croissant.json`, `README.md`, and the boxes in the forms of COCO and of Pascal VOC, for a data set that is complete.
    ///
    /// Returns
    /// -------
    /// list of str
    ///     The files.
    ///
    /// Warns
    /// -----
    /// UserWarning
    ///     A specification without a licence.
    fn publish(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        let published =
            interruptible(py, |_| -> Result<_, Error> { Planned::open(&self.folder)?.publish() })?;
        let published = published.map_err(raised)?;
        warn(py, &published.notices)?;
        Ok(published.files)
    }

    /// Reads every file, and removes temporary ones that interrupted work has left.
    ///
    /// Returns
    /// -------
    /// dict
    ///     `complete`, the numbers of `shards`, of those `done` and of their `scans`, and `problems`, a sentence each.
    fn check<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let found = interruptible(py, |_| -> Result<_, Error> {
            Ok(Planned::open(&self.folder)?.check())
        })?;
        to_python(py, &found.map_err(raised)?)
    }
}
