//! A scene.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use matdb::effects::EffectList;
use matdb::files::{folder_of, write_all};
use matdb::formats::ply::write_mesh;
use matdb::geometry::Mesh;
use matdb::scene::change::apply;
use matdb::scene::{self, GivenMaterials, GivenMeshes, KeyChange, SceneFile, read_text};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyString, PyTuple};
use toml::{Table, Value};

use crate::effect::{Effect, refuse_taken};
use crate::error::{UsageError, no_choice, raised, warn};
use crate::json::{of_text, text_of, to_python};
use crate::material::{Material, law_file};
use crate::numbers;
use crate::own::{dict_of, refuse_forked};

/// Radar, scan and target. It never changes; `replace` makes another.
///
/// Parameters
/// ----------
/// meshes : dict of str to mesh
///     Meshes in m by name: `(vertices, facets)` of shapes (n, 3) and (k, 3), a mesh of trimesh or of Open3D, or the name of a
///     file or a built-in mesh. Or a dict with such a `mesh` and the other keys of `[[mesh]]`, as in `{"mesh": head,
///     "translation_m": [0, 1.1, 0]}`.
/// materials : str, Material or dict of these by str, optional
///     The material of all meshes, or of each by its name. Without it `region` says what is made of what. A scene keeps a
///     `Material` that it is given, whatever a database has; its regions call it `given:NAME`.
/// name : str, optional
/// **tables
///     Everything else that a scene file has: `seed=7`, `radar={"scan": {...}}`, `spot={"rays": 64}`, `region=[...]`.
///
/// Raises
/// ------
/// matdb.SceneError
///     What the file of such a scene would be refused for.
#[pyclass(frozen, module = "matdb")]
pub(crate) struct Scene {
    /// The scene file's text, with what was replaced.
    text: String,
    path: PathBuf,
    scene: scene::Scene,
    /// Meshes that are in no file.
    given: Arc<GivenMeshes>,
    /// Effects of the program's own, with the values of their parameters by name.
    effects: Vec<(Py<Effect>, Py<PyDict>)>,
}

/// Where the file of a scene would be that is in no file.
const NO_FILE: &str = "scene.toml";

/// What the names of meshes and materials begin with that a program gives.
const GIVEN: &str = "given:";

impl Scene {
    fn of_text(
        text: String,
        path: &Path,
        given: Arc<GivenMeshes>,
        materials: GivenMaterials,
    ) -> Result<Scene, matdb::error::Error> {
        let file = parse(&text, path)?;
        let scene = scene::Scene::resolve_given(file, path, &given)?;
        let scene = scene::Scene { given: materials, ..scene };
        Ok(Scene { text, path: path.to_owned(), scene, given, effects: Vec::new() })
    }

    /// This scene with another text. Its meshes are loaded only where the text says other things of meshes or regions.
    fn with_text(
        &self,
        py: Python<'_>,
        text: String,
        materials: GivenMaterials,
    ) -> PyResult<Scene> {
        refuse_forked()?;
        let made = py.detach(|| -> Result<scene::Scene, matdb::error::Error> {
            let scene = self.scene.replace(parse(&text, &self.path)?, &self.path, &self.given)?;
            Ok(scene::Scene { given: materials, ..scene })
        });
        let scene = made.map_err(raised)?;
        let (path, given) = (self.path.clone(), self.given.clone());
        Ok(Scene { text, path, scene, given, effects: self.effects_again(py) })
    }

    /// This scene with another text and another file in the same folder.
    pub(crate) fn with_file(
        &self,
        text: String,
        path: PathBuf,
    ) -> Result<Scene, matdb::error::Error> {
        let scene = self.scene.replace(parse(&text, &path)?, &path, &self.given)?;
        Ok(Scene { text, path, scene, given: self.given.clone(), effects: Vec::new() })
    }

    fn table(&self) -> PyResult<Table> {
        let unreadable = |error: toml::de::Error| UsageError::new_err(error.to_string());
        self.text.parse().map_err(unreadable)
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
        let (mut table, mut materials) = (self.table()?, self.scene.given.clone());
        for (key, value) in changes {
            let key: String = key.extract()?;
            set(&mut table, &key, toml_value(&key, &value, &mut materials)?)?;
        }
        self.with_text(py, table.to_string(), materials)
    }

    pub(crate) fn name(&self) -> &str {
        &self.scene.file.name
    }

    fn effects_again(&self, py: Python<'_>) -> Vec<(Py<Effect>, Py<PyDict>)> {
        let effects = self.effects.iter();
        effects.map(|(effect, values)| (effect.clone_ref(py), values.clone_ref(py))).collect()
    }

    /// Its effects of the program's own.
    pub(crate) fn own_effects(&self, py: Python<'_>) -> PyResult<EffectList> {
        let effects = self.effects.iter();
        effects.map(|(effect, values)| effect.get().with_values(values.bind(py))).collect()
    }

    pub(crate) fn chirps(&self) -> usize {
        self.scene.chirps.rays.len()
    }
}

/// The file of a scene of its text.
fn parse(text: &str, path: &Path) -> Result<SceneFile, scene::SceneError> {
    let at = |error| scene::SceneError::Format { file: path.to_owned(), error };
    SceneFile::parse(text).map_err(at)
}

/// A scene as an argument: itself, or its file.
pub(crate) enum SceneLike {
    Scene(Py<Scene>),
    File(PathBuf),
}

impl<'py> FromPyObject<'_, 'py> for SceneLike {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<SceneLike> {
        if let Ok(scene) = given.cast::<Scene>() {
            return Ok(SceneLike::Scene(scene.to_owned().unbind()));
        }
        let given = given.extract().map(SceneLike::File);
        given.map_err(|_| PyTypeError::new_err("give a matdb.Scene, or the path of a scene file"))
    }
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
///
/// Raises
/// ------
/// matdb.SceneError
///     A file that is not there, or is no scene.
#[pyfunction]
pub(crate) fn load_scene(py: Python<'_>, path: PathBuf) -> PyResult<Scene> {
    refuse_forked()?;
    let load = || Scene::of_text(read_text(&path)?, &path, Arc::default(), GivenMaterials::new());
    py.detach(load).map_err(raised::<matdb::error::Error>)
}

#[pymethods]
impl Scene {
    #[new]
    #[pyo3(signature = (*, meshes, materials = None, name = None, **tables))]
    fn new(
        py: Python<'_>,
        meshes: &Bound<'_, PyDict>,
        materials: Option<&Bound<'_, PyAny>>,
        name: Option<&str>,
        tables: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Scene> {
        refuse_forked()?;
        let (mut table, mut own) = (Table::new(), GivenMaterials::new());
        for (key, value) in tables.into_iter().flatten() {
            let key: String = key.extract()?;
            set(&mut table, &key, toml_value(&key, &value, &mut own)?)?;
        }
        if let Some(name) = name {
            table.insert("name".to_owned(), name.into());
        }
        let (mut entries, mut regions, mut given) = (Vec::new(), Vec::new(), GivenMeshes::new());
        for (name, mesh) in meshes {
            let name: String = name.extract()?;
            entries.push(Value::Table(mesh_entry(&name, &mesh, &mut given, &mut own)?));
            if let Some(materials) = materials {
                regions.push(Value::Table(region_of(&name, materials, &mut own)?));
            }
        }
        table.insert("mesh".to_owned(), entries.into());
        if materials.is_some() && table.insert("region".to_owned(), regions.into()).is_some() {
            return Err(UsageError::new_err(
                "both materials and region are given; give one of them",
            ));
        }
        let (text, given) = (table.to_string(), Arc::new(given));
        py.detach(|| Scene::of_text(text, Path::new(NO_FILE), given, own)).map_err(raised)
    }

    /// A scene of a text of a scene file. Relative paths in it start from the folder of `path`.
    #[staticmethod]
    fn from_text(py: Python<'_>, text: String, path: PathBuf) -> PyResult<Scene> {
        refuse_forked()?;
        let made = || Scene::of_text(text, &path, Arc::default(), GivenMaterials::new());
        py.detach(made).map_err(raised)
    }

    /// Its name.
    #[getter("name")]
    fn name_in_python(&self) -> &str {
        self.name()
    }

    /// Number of chirps of its scan.
    #[getter("chirps")]
    fn chirps_in_python(&self) -> usize {
        self.chirps()
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

    /// This scene with other values of keys, as `matdb render --set` has them: `{"mesh.body.rotation_deg": [0, 20, 0]}`. A table
    /// in a list has its name there; an effect that is not there is added.
    ///
    /// Parameters
    /// ----------
    /// changes : dict of str to value
    ///
    /// Raises
    /// ------
    /// matdb.SceneError
    ///     A mesh, region or receiver that is not there, and what a file would be refused for.
    fn with_changes(&self, py: Python<'_>, changes: &Bound<'_, PyAny>) -> PyResult<Scene> {
        let (mut table, mut own) = (self.table()?, self.scene.given.clone());
        let at = |error| raised(scene::SceneError::Format { file: self.path.clone(), error });
        for (key, value) in &dict_of(changes)? {
            let key: String = key.extract()?;
            let change = KeyChange::new(&key, toml_value(&key, &value, &mut own)?).map_err(at)?;
            apply(&mut table, &[change]).map_err(at)?;
        }
        self.with_text(py, table.to_string(), own)
    }

    /// This scene with other materials of its regions, by their names. Meshes are not loaded again.
    ///
    /// Parameters
    /// ----------
    /// materials : dict of str to str or Material
    fn with_materials(&self, py: Python<'_>, materials: &Bound<'_, PyDict>) -> PyResult<Scene> {
        let (mut table, mut own) = (self.table()?, self.scene.given.clone());
        for (region, material) in materials {
            let region: String = region.extract()?;
            let material = toml_value("material", &material, &mut own)?;
            let entries = table.get_mut("region").and_then(Value::as_array_mut);
            let is_it =
                |entry: &&mut Value| entry.get("name").and_then(Value::as_str) == Some(&region);
            let Some(entry) = entries.into_iter().flatten().find(is_it) else {
                return Err(no_choice("region", &region, &self.regions().join(", ")));
            };
            entry["material"] = material;
        }
        self.with_text(py, table.to_string(), own)
    }

    /// This scene with effects of one's own, beside those that it has. `render`, `compare` and `diagnose` apply them; no file of
    /// the scene says them.
    ///
    /// Parameters
    /// ----------
    /// effects : dict of Effect to dict of str to float
    ///     The values of the parameters of each; those that are not named are absent. An effect that the scene has gets others.
    fn with_effects(&self, py: Python<'_>, effects: &Bound<'_, PyAny>) -> PyResult<Scene> {
        let mut own = self.effects_again(py);
        for (effect, values) in &dict_of(effects)? {
            let effect = effect.cast::<Effect>().map_err(|_| {
                PyTypeError::new_err(
                    "with_effects takes {effect: {parameter: value}} of matdb.Effect",
                )
            })?;
            let values = dict_of(&values)?;
            effect.get().with_values(&values)?;
            own.retain(|(other, _)| !other.is(effect));
            refuse_taken(effect.get().name(), own.iter().map(|(other, _)| other.get().name()))?;
            own.push((effect.clone().unbind(), values.unbind()));
        }
        Ok(Scene {
            effects: own,
            ..self.with_text(py, self.text.clone(), self.scene.given.clone())?
        })
    }

    fn __repr__(&self) -> String {
        let facets = self.scene.target.mesh.facets.len();
        let own: String = self
            .effects
            .iter()
            .map(|(effect, _)| format!(", with {}", effect.get().name()))
            .collect();
        format!("<matdb.Scene {}: {} chirps, {facets} facets{own}>", self.name(), self.chirps())
    }

    /// Writes its file, with the meshes that are in no file beside it as PLY, and the laws of the materials that it was
    /// given as `material-NAME.toml`, which `Database.add` takes.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        for (effect, _) in &self.effects {
            let name = effect.get().name();
            warn(
                py,
                &[format!(
                    "the file does not say effect `{name}`, which is a function of the program"
                )],
            )?;
        }
        let (mut table, mut files) = (self.table()?, Vec::new());
        for (number, entry) in entries(&mut table, "mesh").enumerate() {
            let mesh = given(entry, "file").and_then(|name| self.given.get(name));
            if let Some(mesh) = mesh {
                let file = format!("mesh-{number}.ply");
                files.push((file.clone(), write_mesh(mesh)));
                entry["file"] = file.into();
            }
        }
        for (key, material) in &self.scene.given {
            let name = &material.slug;
            files.push((format!("material-{name}.toml"), law_file(material)?));
            for entry in entries(&mut table, "region") {
                if entry.get("material").and_then(Value::as_str) == Some(key) {
                    entry["material"] = name.as_str().into();
                }
            }
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        files.push((name, table.to_string().into_bytes()));
        py.detach(|| write_all(folder_of(&path), &files)).map_err(raised)
    }

    /// A scene of its parts, as pickle makes one.
    #[staticmethod]
    fn _of_parts(
        py: Python<'_>,
        text: String,
        path: PathBuf,
        given: &Bound<'_, PyDict>,
        materials: &str,
        effects: Vec<(Py<Effect>, Py<PyDict>)>,
    ) -> PyResult<Scene> {
        refuse_forked()?;
        let mut meshes = GivenMeshes::new();
        for (name, mesh) in given {
            meshes.insert(name.extract()?, mesh_of(&mesh)?);
        }
        let materials = of_text(materials)?;
        let made = py.detach(|| Scene::of_text(text, &path, Arc::new(meshes), materials));
        Ok(Scene { effects, ..made.map_err(raised)? })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, own) = (slf.py(), slf.get());
        let given = PyDict::new(py);
        for (name, mesh) in own.given.iter() {
            let vertices = mesh.vertices.iter().flat_map(|vertex| vertex.to_array());
            let vertices = PyArray1::from_iter(py, vertices).reshape([mesh.vertices.len(), 3])?;
            let facets = PyArray1::from_iter(py, mesh.facets.iter().flatten().copied());
            given.set_item(name, (vertices, facets.reshape([mesh.facets.len(), 3])?))?;
        }
        let materials = text_of(&own.scene.given)?;
        let parts = (&own.text, &own.path, given, materials, own.effects_again(py));
        (slf.get_type().getattr("_of_parts")?, parts).into_pyobject(py)
    }
}

/// The tables of this name.
fn entries<'a>(table: &'a mut Table, name: &str) -> impl Iterator<Item = &'a mut Value> {
    table.get_mut(name).and_then(Value::as_array_mut).into_iter().flatten()
}

/// The name of what a program gave under a key of an entry.
fn given<'a>(entry: &'a Value, key: &str) -> Option<&'a str> {
    entry.get(key).and_then(Value::as_str)?.strip_prefix(GIVEN)
}

/// The entry of a mesh; one that is in no file goes into `given`.
fn mesh_entry(
    name: &str,
    mesh: &Bound<'_, PyAny>,
    given: &mut GivenMeshes,
    materials: &mut GivenMaterials,
) -> PyResult<Table> {
    let mut entry = Table::new();
    let mut mesh = mesh.clone();
    if let Ok(keys) = mesh.cast::<PyDict>() {
        let own = keys.get_item("mesh")?;
        let own =
            own.ok_or_else(|| UsageError::new_err(format!("meshes[{name:?}] has no `mesh`")))?;
        for (key, value) in keys {
            let key: String = key.extract()?;
            if key != "mesh" {
                entry.insert(key.clone(), toml_value(&key, &value, materials)?);
            }
        }
        mesh = own;
    }
    let file = match mesh.extract::<PathBuf>() {
        Ok(path) => path.to_string_lossy().into_owned(),
        Err(_) => {
            let own = mesh_of(&mesh)?;
            own.validate()
                .map_err(|error| UsageError::new_err(format!("meshes[{name:?}]: {error}")))?;
            given.insert(name.to_owned(), own);
            format!("{GIVEN}{name}")
        }
    };
    entry.insert("name".to_owned(), name.into());
    entry.insert("file".to_owned(), file.into());
    Ok(entry)
}

/// The region of a mesh.
fn region_of(
    mesh: &str,
    materials: &Bound<'_, PyAny>,
    own: &mut GivenMaterials,
) -> PyResult<Table> {
    let material = if let Ok(materials) = materials.cast::<PyDict>() {
        let material = materials.get_item(mesh)?;
        material.ok_or_else(|| {
            UsageError::new_err(format!("materials has nothing for mesh {mesh:?}"))
        })?
    } else {
        materials.clone()
    };
    let material = toml_value("material", &material, own)?;
    Ok([("name", mesh.into()), ("mesh", mesh.into()), ("material", material)]
        .into_iter()
        .map(|(key, value)| (key.to_owned(), value))
        .collect())
}

/// A mesh of arrays, or of a library that has them.
fn mesh_of(given: &Bound<'_, PyAny>) -> PyResult<Mesh> {
    let refused = || {
        PyTypeError::new_err(
            "a mesh is (vertices, facets) of shapes (n, 3) and (k, 3), a mesh of trimesh or Open3D, or a path",
        )
    };
    let (vertices, facets) = match given.extract::<(Bound<'_, PyAny>, Bound<'_, PyAny>)>() {
        Ok(parts) => parts,
        Err(_) => {
            let facets = given.getattr("faces").or_else(|_| given.getattr("triangles"));
            (given.getattr("vertices").map_err(|_| refused())?, facets.map_err(|_| refused())?)
        }
    };
    let [vertices, facets] =
        [vertices, facets].map(|one| numbers::rows("a mesh", &one).map_err(|_| refused()));
    let mut mesh = Mesh::default();
    mesh.vertices.extend(vertices?.into_iter().map(DVec3::from_array));
    for (number, corners) in facets?.into_iter().enumerate() {
        if corners.iter().any(|one| one.fract() != 0.0 || !(0.0..4e9).contains(one)) {
            let problem = format!(
                "facet {number} has the corners {corners:?}, which are no numbers of vertices"
            );
            return Err(UsageError::new_err(problem));
        }
        mesh.facets.push(corners.map(|one| one as u32));
    }
    Ok(mesh)
}

/// Sets a value in a table of tables.
fn set(table: &mut Table, key: &str, value: Value) -> PyResult<()> {
    match key.split_once("__") {
        None => {
            table.insert(key.to_owned(), value);
            Ok(())
        }
        Some((outer, rest)) => {
            let inner = table.entry(outer).or_insert_with(|| Table::new().into());
            match inner.as_table_mut() {
                Some(inner) => set(inner, rest, value),
                None => Err(UsageError::new_err(format!(
                    "`{outer}` of the scene is not a table; give it whole, as {outer}=..."
                ))),
            }
        }
    }
}

/// Levels of tables and lists in a value; a scene has a handful.
const MOST_LEVELS: usize = 32;

/// A value of Python as one of TOML. A material goes into `materials`, and its name there stands for it.
fn toml_value(
    key: &str,
    value: &Bound<'_, PyAny>,
    materials: &mut GivenMaterials,
) -> PyResult<Value> {
    nested_value(key, value, materials, MOST_LEVELS)
}

/// The same within another value, with so many levels more at most.
fn nested_value(
    key: &str,
    value: &Bound<'_, PyAny>,
    materials: &mut GivenMaterials,
    levels: usize,
) -> PyResult<Value> {
    let Some(levels) = levels.checked_sub(1) else {
        let problem = format!("{key} has more than {MOST_LEVELS} levels, or contains itself");
        return Err(UsageError::new_err(problem));
    };
    if let Ok(material) = value.cast::<Material>() {
        let material = &material.get().found().material;
        let name = format!("{GIVEN}{}", material.slug);
        if materials.get(&name).is_some_and(|known| known != material) {
            let problem = format!("two materials of the scene are called {}", material.slug);
            return Err(UsageError::new_err(format!("{problem}; give one another name")));
        }
        materials.insert(name.clone(), material.clone());
        return Ok(name.into());
    }
    if value.is_instance_of::<PyBool>() {
        Ok(value.extract::<bool>()?.into())
    } else if value.is_instance_of::<PyInt>() {
        Ok(value.extract::<i64>()?.into())
    } else if value.is_instance_of::<PyFloat>() {
        Ok(value.extract::<f64>()?.into())
    } else if value.is_instance_of::<PyString>() {
        Ok(value.extract::<String>()?.into())
    } else if let Ok(dict) = value.cast::<PyDict>() {
        let mut table = Table::new();
        for (name, value) in dict {
            let name: String = name.extract()?;
            let value = nested_value(&name, &value, materials, levels)?;
            table.insert(name, value);
        }
        Ok(table.into())
    } else if let Ok(path) = value.call_method0("__fspath__") {
        Ok(path.extract::<String>()?.into())
    } else if value.hasattr("tolist")? {
        // Numbers and arrays of numpy.
        nested_value(key, &value.call_method0("tolist")?, materials, levels)
    } else if let Ok(items) = value.try_iter() {
        let values = items.map(|item| nested_value(key, &item?, materials, levels));
        Ok(values.collect::<PyResult<Vec<Value>>>()?.into())
    } else {
        Err(PyTypeError::new_err(format!("a scene has no such value as {key}={value}")))
    }
}
