//! A database of materials.

use std::path::PathBuf;

use matdb::adopt::NewMaterials;
use matdb::catalogue::exchange::Details;
use matdb::material::{Slug, builtin};
use matdb::report::MaterialSearch;
use matdb::setup::{self, find_material};
use matdb::store::Store;
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;

use crate::error::{MaterialError, raised};
use crate::json::to_python;
use crate::material::Material;

/// A database of materials: a SQLite file. Built-in materials are found, too, where the file does not have them.
///
/// It holds no connection: each call opens the file, so that it may be pickled and used from any thread.
#[pyclass(frozen, module = "matdb")]
pub(crate) struct Database {
    path: PathBuf,
}

impl Database {
    /// The file, if somebody has made it.
    pub(crate) fn store(&self) -> PyResult<Option<Store>> {
        Store::open_existing(&self.path).map_err(raised)
    }

    fn database(&self) -> setup::Database {
        setup::Database::new(Some(&self.path))
    }
}

/// Opens a database. The first material that is added makes the file.
///
/// Parameters
/// ----------
/// path : str or os.PathLike, default "matdb.sqlite"
///     The file.
#[pyfunction]
#[pyo3(signature = (path = PathBuf::from(setup::USUAL_DATABASE)))]
pub(crate) fn open(path: PathBuf) -> PyResult<Database> {
    let database = Database { path };
    // A file of another program is refused at once.
    database.store()?;
    Ok(database)
}

#[pymethods]
impl Database {
    /// The file.
    #[getter]
    fn path(&self) -> &PathBuf {
        &self.path
    }

    /// Names of the materials in the file, sorted. Those that are built in come on top: `matdb.Database.builtin()`.
    fn names(&self) -> PyResult<Vec<String>> {
        let Some(store) = self.store()? else { return Ok(Vec::new()) };
        let listed = store.list().map_err(raised)?;
        Ok(listed.into_iter().map(|line| line.slug.to_string()).collect())
    }

    /// Names of the built-in materials, sorted.
    #[staticmethod]
    fn builtin() -> Vec<&'static str> {
        builtin::names().collect()
    }

    fn __len__(&self) -> PyResult<usize> {
        Ok(self.names()?.len())
    }

    fn __iter__(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        Ok(self.names()?.into_pyobject(py)?.try_iter()?.into_any().unbind())
    }

    fn __contains__(&self, name: &str) -> PyResult<bool> {
        let (Some(store), Ok(slug)) = (self.store()?, name.parse::<Slug>()) else {
            return Ok(false);
        };
        store.holds(&slug).map_err(raised)
    }

    /// A material by `NAME` or `NAME@REVISION`, from the file or built in.
    fn __getitem__(&self, py: Python<'_>, name: &str) -> PyResult<Material> {
        match find_material(self.store()?.as_ref(), name, "") {
            Ok(found) => Ok(Material::new(found)),
            Err(error) => {
                let raised = raised(error);
                // A mapping raises KeyError for a key that it does not have.
                Err(if raised.is_instance_of::<MaterialError>(py) {
                    PyKeyError::new_err(raised.value(py).to_string())
                } else {
                    raised
                })
            }
        }
    }

    /// Adds built-in materials by name, and those of files or folders: `material.toml`, or a format of others.
    ///
    /// Parameters
    /// ----------
    /// *names : str
    ///     Built-in materials.
    /// files : list of path, optional
    ///     Files, or folders with a `material.toml` each.
    ///
    /// Returns
    /// -------
    /// list of str
    ///     `NAME@REVISION` of each.
    #[pyo3(signature = (*names, files = Vec::new()))]
    fn add(
        &self,
        py: Python<'_>,
        names: Vec<String>,
        files: Vec<PathBuf>,
    ) -> PyResult<Vec<String>> {
        py.detach(|| {
            let database = self.database();
            let given = Details::default();
            let new = NewMaterials::read(&names, &files, &given, &database)?;
            let added = new.store(&database)?;
            Ok(added
                .iter()
                .map(|added| format!("{}@{}", added.slug, added.added.revision()))
                .collect())
        })
        .map_err(raised::<matdb::error::Error>)
    }

    /// The materials with these words, the best first: a dictionary each, as `matdb search --json` prints.
    #[pyo3(signature = (words, *, most = 20))]
    fn search<'py>(&self, py: Python<'py>, words: &str, most: u32) -> PyResult<Bound<'py, PyAny>> {
        let hits = py.detach(|| MaterialSearch { words, most }.run(&self.database()));
        to_python(py, &hits.map_err(raised)?)
    }

    fn __repr__(&self) -> PyResult<String> {
        Ok(format!("<matdb.Database {}: {} materials>", self.path.display(), self.names()?.len()))
    }

    fn __reduce__(slf: &Bound<'_, Self>) -> PyResult<(Py<PyAny>, (PathBuf,))> {
        let open = slf.py().import("matdb")?.getattr("open")?;
        Ok((open.unbind(), (slf.get().path.clone(),)))
    }
}
