//! What a model lacks.

use std::path::{Path, PathBuf, absolute};

use matdb::adopt::{
    CheckedRequest, CloudRequest, Earlier, LoadedScene, Publication, PublicationResult,
    check_folder, input, moved_scene, program, scene_of_each,
};
use matdb::diagnose::Report;
use matdb::effects::{EffectList, find};
use matdb::error::Error;
use matdb::files::{folder_of, write_all};
use matdb::material::Input;
use matdb::report::EffectHelp;
use matdb::setup::ReadyScene;
use matdb::store::Store;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyList, PyTuple};
use serde_json::{Value, json};

use crate::cloud::CloudLike;
use crate::database::Database;
use crate::effect::{Effect, refuse_taken};
use crate::error::{UsageError, raised, warn};
use crate::interrupt::interruptible;
use crate::json::{of_text, text_of, to_python};
use crate::numbers::seed;
use crate::scene::{Scene, SceneLike};

/// Name and bytes of a file.
type File = (String, Vec<u8>);

/// What a scene lacks to explain a cloud, or a law to explain a curve.
#[pyclass(frozen, module = "matdb")]
pub(crate) struct Diagnosis {
    pub(crate) record: Value,
    /// The report as one page that stands alone.
    pub(crate) page: Vec<u8>,
    /// The files for a folder. Scenes among them name others as seen from `from`.
    pub(crate) files: Vec<File>,
    /// The folder in which the diagnosis was made.
    pub(crate) from: PathBuf,
    /// Clouds and scenes, and the files that the scenes name.
    pub(crate) read: Vec<PathBuf>,
    /// Materials that were stored, with their revisions.
    pub(crate) stored: Vec<String>,
    /// The scenes with what was found and stored.
    pub(crate) scenes_after: Vec<Py<Scene>>,
}

/// One argument, or a list of several.
pub(crate) struct Several<T>(Vec<T>);

impl<'py, T> FromPyObject<'_, 'py> for Several<T>
where
    T: for<'a> FromPyObject<'a, 'py, Error = PyErr>,
{
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Several<T>> {
        if !given.is_instance_of::<PyList>() && !given.is_instance_of::<PyTuple>() {
            return Ok(Several(vec![given.extract()?]));
        }
        let items = given.try_iter()?.map(|item| item?.extract());
        Ok(Several(items.collect::<PyResult<_>>()?))
    }
}

/// Finds the physical effects that a scene lacks to explain a measured cloud, on all cores. Ctrl-C ends it.
///
/// Parameters
/// ----------
/// cloud : Cloud, Scan, str or os.PathLike, or a list of them
///     The measured cloud, with a row of each detection. Several clouds of the same target, of other poses or antennas or
///     repeats, get one joint answer.
/// scene : Scene, str or os.PathLike, or a list of them
///     The scene that was measured: one for each cloud in the same order, or one for all.
/// db : Database, optional
///     Where materials are looked for; without it, and for those that it does not have, the built-in ones.
/// receiver : str, optional
///     The receiver of the scene that the cloud is of; the radar itself unless stated.
/// effects : list of str, optional
///     Names of the effects to try; all unless stated. `matdb.effects()` lists them.
/// own_effects : list of Effect, optional
///     Effects of one's own, which are tried as well. The scene that is found does not declare them.
/// seed : int, default 0
/// controls : bool, default True
///     Whether controls are computed, which take as long as the diagnosis.
/// add : bool, default False
///     Whether `db` stores what was found, and what was tried and not found, as new revisions of the materials: all of it or
///     nothing, as `matdb diagnose --add` does. No file is written but the database: `scenes_after` are the changed scenes.
/// material : str, optional
///     The only material that receives what is found; all of the scene with 100 chirps or more unless stated.
///
/// Returns
/// -------
/// Diagnosis
///
/// Raises
/// ------
/// matdb.DiagnoseError
///     Too few data, or data that are not of this scene.
/// matdb.StoreError
///     With `add`, what could not be stored. The error's `diagnosis` is the answer all the same.
///
/// Warns
/// -----
/// UserWarning
///     Clouds that contradict each other, of which nothing is stored; with `add`, what is not stored, and materials that stay as
///     they were.
#[pyfunction]
#[pyo3(signature = (cloud, scene, *, db = None, receiver = None, effects = Vec::new(), own_effects = Vec::new(), seed = 0,
                    controls = true, add = false, material = None))]
#[expect(clippy::too_many_arguments, reason = "each is a keyword in Python")]
pub(crate) fn diagnose(
    py: Python<'_>,
    cloud: Several<CloudLike>,
    scene: Several<SceneLike>,
    db: Option<&Database>,
    receiver: Option<&str>,
    effects: Vec<String>,
    own_effects: Vec<Py<Effect>>,
    #[pyo3(from_py_with = seed)] seed: u64,
    controls: bool,
    add: bool,
    material: Option<&str>,
) -> PyResult<Diagnosis> {
    if add && db.is_none() {
        return Err(UsageError::new_err("add = True needs a database; give db = matdb.open()"));
    }
    let scenes = scene.0.into_iter().map(|scene| scene.scene(py)).collect::<PyResult<Vec<_>>>()?;
    let (clouds, names) = (&cloud.0, &names(&cloud.0));
    let scenes: Vec<&Scene> = scenes.iter().map(Py::get).collect();
    let scenes = &scene_of_each(&scenes, clouds.len()).map_err(raised)?;
    let pairs = std::iter::zip(names, scenes).map(|(name, scene)| (&**name, scene.path()));
    let pairs: Vec<(&Path, &Path)> = pairs.collect();
    let [(first, first_scene), further @ ..] = &pairs[..] else {
        return Err(UsageError::new_err("there is no cloud; give one or more"));
    };
    let effects = effects.iter().map(|name| {
        let unknown = || UsageError::new_err(format!("there is no effect `{name}` of clouds"));
        find(name).ok_or_else(unknown)
    });
    let effects = effects.collect::<PyResult<Vec<_>>>()?;
    let own: Vec<_> = own_effects.iter().map(|effect| effect.get().effect()).collect();
    for (number, effect) in own.iter().enumerate() {
        refuse_taken(effect.name(), own[..number].iter().map(|other| other.name()))?;
    }
    let declared =
        scenes.iter().map(|scene| scene.own_effects(py)).collect::<PyResult<Vec<_>>>()?;
    if add && declared.iter().any(|effects| !effects.is_empty()) {
        let problem = "what is found beside effects of one's own cannot be stored; diagnose without add, or without them";
        return Err(UsageError::new_err(problem));
    }
    let request = CloudRequest {
        cloud: first,
        scene: first_scene,
        further,
        receiver,
        effects: &effects,
        own_effects: &own,
        material,
        seed,
        controls,
        folder: Path::new(""),
        add,
    };
    let answer = interruptible(py, |stop| {
        let checked = check(request, scenes, declared, db)?;
        let checked = CheckedRequest { given: inputs(clouds, names, scenes)?, ..checked };
        let read = checked.read_clouds(|path, _| {
            let named = std::iter::zip(names, clouds).find(|(name, _)| *name == path);
            let cloud = named.map_or(&clouds[0], |(_, cloud)| cloud);
            Ok(cloud.read()?.into_owned())
        })?;
        let report = checked.diagnose(&read, &|_| stop.check())?;
        Ok((checked, report))
    })?;
    let (checked, report) = answer.map_err(raised::<Error>)?;
    let published = py.detach(|| publish(&checked, &report, scenes, db)).map_err(raised)?;
    let Published { answer, scenes_after, notices, refusal } = published;
    let scenes_after = scenes_after.into_iter().map(|scene| Py::new(py, scene));
    let answer = Diagnosis { scenes_after: scenes_after.collect::<PyResult<_>>()?, ..answer };
    let Err(refusal) = refusal.map_or_else(|| warn(py, &notices), |error| Err(raised(error)))
    else {
        return Ok(answer);
    };
    // The work is done, and is not lost with what could not be stored, or with a warning that raises.
    refusal.value(py).setattr("diagnosis", Py::new(py, answer)?)?;
    Err(refusal)
}

/// A diagnosis with what became of it.
struct Published {
    answer: Diagnosis,
    /// Its scenes with what was found, where that was stored.
    scenes_after: Vec<Scene>,
    /// What a person should not overlook.
    notices: Vec<String>,
    /// Why nothing was stored though it was asked for.
    refusal: Option<Error>,
}

/// The files of clouds, or names in their place, each another one.
fn names(clouds: &[CloudLike]) -> Vec<PathBuf> {
    let mut names = Vec::new();
    for (number, cloud) in (1..).zip(clouds) {
        let name = cloud.path();
        let is_plain = clouds.len() == 1 || matches!(cloud, CloudLike::File(_));
        let numbered = || PathBuf::from(format!("{}-{number}", name.display()));
        names.push(if is_plain { name.to_owned() } else { numbered() });
    }
    names
}

/// The request, of scenes with their materials.
fn check<'a>(
    request: CloudRequest<'a>,
    scenes: &[&Scene],
    declared: Vec<EffectList>,
    db: Option<&Database>,
) -> Result<CheckedRequest<'a>, Error> {
    let store = db.map_or(Ok(None), Database::read)?;
    let scenes = std::iter::zip(scenes, declared);
    let mut loaded = scenes.map(|(scene, declared)| loaded(scene, declared, store.as_ref()));
    let first = loaded.next().transpose()?;
    let first = first.ok_or_else(|| Error::Usage {
        problem: "there is no scene".to_owned(),
        way_out: "give one for all clouds, or one for each".to_owned(),
    })?;
    request.check_ready(first, loaded.collect::<Result<_, _>>()?)
}

/// A scene with its materials and with its effects of the program's own.
fn loaded(
    scene: &Scene,
    declared: EffectList,
    store: Option<&Store>,
) -> Result<LoadedScene, Error> {
    let (path, text) = (scene.path().to_owned(), scene.own_text().to_owned());
    let ready = ReadyScene::new(scene.scene().clone(), &path, store)?;
    let ready = ready.with_own_effects(declared);
    Ok(LoadedScene { path, ready, text })
}

/// What clouds and scenes are made of, each once and in the order of the command line.
fn inputs(clouds: &[CloudLike], names: &[PathBuf], scenes: &[&Scene]) -> Result<Vec<Input>, Error> {
    let mut known: Vec<(&Path, Input)> = Vec::new();
    for ((cloud, name), scene) in clouds.iter().zip(names).zip(scenes) {
        let of_cloud = cloud.input(name)?;
        let path = scene.path();
        for one in [(&**name, of_cloud), (path, input(path, scene.own_text().as_bytes()))] {
            if !known.contains(&one) {
                known.push(one);
            }
        }
    }
    Ok(known.into_iter().map(|(_, input)| input).collect())
}

/// The answer. What was found is stored, if that was asked for.
fn publish(
    checked: &CheckedRequest,
    report: &Report,
    scenes: &[&Scene],
    db: Option<&Database>,
) -> Result<Published, Error> {
    let notices = checked.notices();
    let database = db.map(Database::database);
    let program = database.as_ref().map_or_else(|| "matdb".to_owned(), program);
    let command = format!("{program} diagnose");
    let words = [program, command];
    let publication = Publication::new(checked, report, &notices, words.clone());
    let contradiction = publication.report().contradiction();
    let (record, page) = (json!(publication.report().record()), publication.page_alone()?);
    let wanted = database.filter(|_| checked.request.add && contradiction.is_none());
    let mut said = Vec::from_iter(contradiction);
    let stored = wanted.map(|database| {
        let of_files = Publication::new(checked, report, &notices, words).with_scenes_in_folder();
        let stored = store_found(&of_files, &database, scenes)?;
        Ok((stored, of_files.notices()))
    });
    let (published, scenes_after, refusal) = match stored {
        Some(Ok(((published, scenes_after), of_storing))) => {
            said.extend(of_storing);
            (published, scenes_after, None)
        }
        not_stored => {
            if checked.request.add {
                said.extend(publication.notices());
            }
            let files = publication.files()?;
            let published = PublicationResult { files, ..PublicationResult::default() };
            (published, Vec::new(), not_stored.and_then(Result::err))
        }
    };
    let whole = |path: PathBuf| absolute(&path).unwrap_or(path);
    let answer = Diagnosis {
        record,
        page,
        files: published.files,
        from: whole(PathBuf::from(".")),
        read: checked.files_read().into_iter().map(whole).collect(),
        stored: published.stored,
        scenes_after: Vec::new(),
    };
    Ok(Published { answer, scenes_after, notices: said, refusal })
}

/// Stores what was found, and makes of each scene the one with it.
fn store_found(
    publication: &Publication,
    database: &matdb::setup::Database,
    scenes: &[&Scene],
) -> Result<(PublicationResult, Vec<Scene>), Error> {
    let places = publication.cloud_of_each_scene();
    publication.store(&mut database.write()?, |_, beside| {
        let mut after = Vec::new();
        for ((folder, files), place) in beside.iter().zip(places) {
            for (name, text) in files {
                let text = String::from_utf8_lossy(text).into_owned();
                after.push(scenes[place].with_file(text, folder.join(name))?);
            }
        }
        Ok(after)
    })
}

/// The physical effects that `diagnose` looks for: what each is, how it shows, and its numbers, as `matdb effects --json` prints
/// them.
///
/// Parameters
/// ----------
/// name : str, optional
///     Only those of this name.
///
/// Returns
/// -------
/// list of dict
#[pyfunction]
#[pyo3(signature = (name = None))]
pub(crate) fn effects<'py>(py: Python<'py>, name: Option<&str>) -> PyResult<Bound<'py, PyAny>> {
    let mut all = EffectHelp::all();
    all.retain(|effect| name.is_none_or(|name| effect.name == name));
    match name {
        Some(name) if all.is_empty() => {
            let problem = format!("there is no effect `{name}`; matdb.effects() lists them");
            Err(UsageError::new_err(problem))
        }
        _ => to_python(py, &all),
    }
}

impl Diagnosis {
    /// Its files for a folder.
    fn files_for(&self, folder: &Path) -> Result<Vec<File>, Error> {
        let files = self.files.iter().map(|(name, bytes)| {
            let is_scene = name.starts_with("after") && name.ends_with(".toml");
            let moved = || moved_scene(bytes, &self.from, folder);
            Ok((name.clone(), if is_scene { moved()? } else { bytes.clone() }))
        });
        files.collect()
    }

    fn value<'py>(&self, py: Python<'py>, path: &str) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, self.record.pointer(path).unwrap_or(&Value::Null))
    }
}

#[pymethods]
impl Diagnosis {
    /// What was found, in a word: `explained`, `no-missing-effect`, `unexplained` and others.
    #[getter]
    fn verdict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.value(py, "/verdict")
    }

    /// The effects that the scene lacks, each with its numbers and its evidence.
    #[getter]
    fn effects<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.value(py, "/effects")
    }

    /// Errors on parts of the scan that took no part in a fit, without the effects.
    #[getter]
    fn before<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.value(py, "/error/before")
    }

    /// The same with the effects.
    #[getter]
    fn after<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.value(py, "/error/after")
    }

    /// Materials that were stored, as `NAME@REVISION`; empty without `add`.
    #[getter]
    fn stored(&self) -> &[String] {
        &self.stored
    }

    /// The scenes with what was found and stored, each once: with the effects of the scene and of the radar, and the new revisions
    /// of the materials. Render them with the database. Empty without `add`, and where nothing was found.
    #[getter]
    fn scenes_after(&self, py: Python<'_>) -> Vec<Py<Scene>> {
        self.scenes_after.iter().map(|scene| scene.clone_ref(py)).collect()
    }

    /// All of it, as `report.json` has it.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.record)
    }

    /// Writes the report for a person as one page that stands alone.
    fn report(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        py.detach(|| write_all(folder_of(&path), &[(name, self.page.clone())])).map_err(raised)
    }

    /// Writes the files that `matdb diagnose` writes, all or none, in the place of those of an earlier diagnosis. Its page
    /// names them without the folder.
    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        let written = py.detach(|| {
            let files = self.files_for(&folder)?;
            let read: Vec<&Path> = self.read.iter().map(PathBuf::as_path).collect();
            let inputs = files.iter().map(|(name, _)| name).filter(|name| name.ends_with(".toml"));
            check_folder(&folder, &read, &inputs.cloned().collect::<Vec<_>>())?;
            let earlier = Earlier::in_folder(&folder, &read);
            write_all(&folder, &files)?;
            earlier.remove_all_but(&files);
            Ok(())
        });
        written.map_err(raised::<Error>)
    }

    fn __repr__(&self) -> PyResult<String> {
        let verdict = self.record["verdict"].as_str();
        let verdict = verdict.ok_or_else(|| PyRuntimeError::new_err("no verdict"))?;
        let effects = self.record["effects"].as_array().into_iter().flatten();
        let names: Vec<&str> = effects.filter_map(|one| one["name"].as_str()).collect();
        Ok(format!("<matdb.Diagnosis: {verdict} {}>", names.join(", ")).replace(" >", ">"))
    }

    /// A diagnosis of its parts, as pickle makes one.
    #[staticmethod]
    fn _of_parts(
        record: &str,
        page: &Bound<'_, PyBytes>,
        files: Vec<(String, Bound<'_, PyBytes>)>,
        from_folder: PathBuf,
        read: Vec<PathBuf>,
        stored: Vec<String>,
        scenes_after: Vec<Py<Scene>>,
    ) -> PyResult<Diagnosis> {
        let files = files.into_iter().map(|(name, bytes)| (name, bytes.as_bytes().to_vec()));
        Ok(Diagnosis {
            record: of_text(record)?,
            page: page.as_bytes().to_vec(),
            files: files.collect(),
            from: from_folder,
            read,
            stored,
            scenes_after,
        })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, own) = (slf.py(), slf.get());
        let Diagnosis { record, page, files, from, read, stored, .. } = own;
        let files = files.iter().map(|(name, bytes)| (name, PyBytes::new(py, bytes)));
        let page = PyBytes::new(py, page);
        let (files, scenes_after) = (Vec::from_iter(files), own.scenes_after(py));
        let parts = (text_of(record)?, page, files, from, read, stored, scenes_after);
        (slf.get_type().getattr("_of_parts")?, parts).into_pyobject(py)
    }
}
