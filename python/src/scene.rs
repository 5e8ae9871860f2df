//! A scene.

use std::path::{Path, PathBuf};

use matdb::scene::{self, SceneFile, read_text};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyString};

use crate::error::{UsageError, raised};
use crate::json::to_python;

/// Radar, scan and target. It never changes; `replace` makes another.
#[pyclass(frozen, module = "matdb")]
pub(crate) struct Scene {
    /// The scene file's text, with what was replaced.
    text: String,
    pub(crate) path: PathBuf,
    pub(crate) scene: scene::Scene,
}

impl Scene {
    fn new(text: String, path: &Path) -> Result<Scene, matdb::error::Error> {
        let at = |error| scene::SceneError::Format { file: path.to_owned(), error };
        let scene = scene::Scene::resolve(SceneFile::parse(&text).map_err(at)?, path)?;
        Ok(Scene { text, path: path.to_owned(), scene })
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn own_text(&self) -> &str {
        &self.text
    }

    pub(crate) fn scene(&self) -> &scene::Scene {
        &self.scene
    }

    /// This scene with other values: `radar__spot__rays` stands for `rays` under `[radar.spot]`.
    pub(crate) fn with(&self, py: Python<'_>, changes: &Bound<'_, PyDict>) -> PyResult<Scene> {
        let unreadable = |error: toml::de::Error| UsageError::new_err(error.to_string());
        let mut table: toml::Table = self.text.parse().map_err(unreadable)?;
        for (key, value) in changes {
            let key: String = key.extract()?;
            set(&mut table, &key, toml_value(&key, &value)?)?;
        }
        let text = table.to_string();
        py.detach(|| Scene::new(text, &self.path)).map_err(raised)
    }
}

/// A scene as an argument: itself, or its file.
#[derive(FromPyObject)]
pub(crate) enum SceneLike {
    Scene(Py<Scene>),
    File(PathBuf),
}

impl SceneLike {
    pub(crate) fn scene(self, py: Python<'_>) -> PyResult<Py<Scene>> {
        match self {
            SceneLike::Scene(scene) => Ok(scene),
            SceneLike::File(path) => Py::new(py, load_scene(py, path)?),
        }
    }
}

/// Loads a scene.
///
/// Parameters
/// ----------
/// path : str or os.PathLike
///     A scene file, or `builtin:NAME`.
#[pyfunction]
pub(crate) fn load_scene(py: Python<'_>, path: PathBuf) -> PyResult<Scene> {
    py.detach(|| Scene::new(read_text(&path)?, &path)).map_err(raised::<matdb::error::Error>)
}

#[pymethods]
impl Scene {
    /// A scene of a text of a scene file. Relative paths in it start from the folder of `path`.
    #[staticmethod]
    fn from_text(py: Python<'_>, text: String, path: PathBuf) -> PyResult<Scene> {
        py.detach(|| Scene::new(text, &path)).map_err(raised)
    }

    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        &self.scene.file.name
    }

    /// Number of chirps of its scan.
    #[getter]
    fn chirps(&self) -> usize {
        self.scene.chirps.rays.len()
    }

    /// Names of its regions.
    #[getter]
    fn regions(&self) -> Vec<String> {
        self.scene.target.regions.iter().map(|region| region.name.clone()).collect()
    }

    /// All that its file says, defaults included.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.scene.file)
    }

    /// Text of its file.
    #[getter]
    fn text(&self) -> &str {
        &self.text
    }

    /// This scene with other values. `radar__spot__rays=64` sets `rays` under `[radar.spot]`.
    #[pyo3(signature = (**changes))]
    fn replace(&self, py: Python<'_>, changes: Option<&Bound<'_, PyDict>>) -> PyResult<Scene> {
        self.with(py, changes.unwrap_or(&PyDict::new(py)))
    }

    fn __repr__(&self) -> String {
        let facets = self.scene.target.mesh.facets.len();
        format!("<matdb.Scene {}: {} chirps, {facets} facets>", self.name(), self.chirps())
    }

    fn __reduce__(slf: &Bound<'_, Self>) -> PyResult<(Py<PyAny>, (String, PathBuf))> {
        let scene = slf.get();
        let make = slf.py().import("matdb")?.getattr("Scene")?.getattr("from_text")?;
        Ok((make.unbind(), (scene.text.clone(), scene.path.clone())))
    }
}

/// Sets a value in a table of tables.
fn set(table: &mut toml::Table, key: &str, value: toml::Value) -> PyResult<()> {
    match key.split_once("__") {
        None => {
            table.insert(key.to_owned(), value);
            Ok(())
        }
        Some((outer, rest)) => {
            let inner = table.entry(outer).or_insert_with(|| toml::Table::new().into());
            match inner.as_table_mut() {
                Some(inner) => set(inner, rest, value),
                None => Err(UsageError::new_err(format!(
                    "`{outer}` of the scene is no table; give it whole, as {outer}=..."
                ))),
            }
        }
    }
}

/// A value of Python as one of TOML.
fn toml_value(key: &str, value: &Bound<'_, PyAny>) -> PyResult<toml::Value> {
    if value.is_instance_of::<PyBool>() {
        Ok(value.extract::<bool>()?.into())
    } else if value.is_instance_of::<PyInt>() {
        Ok(value.extract::<i64>()?.into())
    } else if value.is_instance_of::<PyFloat>() {
        Ok(value.extract::<f64>()?.into())
    } else if value.is_instance_of::<PyString>() {
        Ok(value.extract::<String>()?.into())
    } else if let Ok(dict) = value.cast::<PyDict>() {
        let mut table = toml::Table::new();
        for (name, value) in dict {
            let name: String = name.extract()?;
            let value = toml_value(&name, &value)?;
            table.insert(name, value);
        }
        Ok(table.into())
    } else if let Ok(items) = value.try_iter() {
        let values: PyResult<Vec<toml::Value>> =
            items.map(|item| toml_value(key, &item?)).collect();
        Ok(values?.into())
    } else if let Ok(number) = value.extract::<f64>() {
        // A number of numpy.
        Ok(number.into())
    } else {
        Err(PyTypeError::new_err(format!("a scene has no such value as {key}={value}")))
    }
}
