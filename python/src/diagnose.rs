//! What a model lacks.

use std::path::{Path, PathBuf, absolute};

use matdb::adopt::{
    CheckedRequest, CloudRequest, Earlier, Publication, check_folder, input, moved_scene,
};
use matdb::effects::{EffectList, find};
use matdb::error::Error;
use matdb::files::{folder_of, write_all};
use matdb::report::EffectHelp;
use matdb::setup::{self, ReadyScene};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyTuple};
use serde_json::{Value, json};

use crate::cloud::CloudLike;
use crate::database::Database;
use crate::effect::Effect;
use crate::error::{UsageError, raised};
use crate::interrupt::interruptible;
use crate::json::{of_text, text_of, to_python};
use crate::scene::{Scene, SceneLike};

/// Name and bytes of a file.
type File = (String, Vec<u8>);

/// What a scene lacks to explain a cloud.
#[pyclass(frozen, module = "matdb")]
pub(crate) struct Diagnosis {
    record: Value,
    /// The report as one page that stands alone.
    page: Vec<u8>,
    /// The files for a folder. Scenes among them name others as seen from `from`.
    files: Vec<File>,
    /// The folder in which the diagnosis was made.
    from: PathBuf,
    /// Cloud and scene, and the files that the scene names.
    read: Vec<PathBuf>,
}

/// Finds the physical effects that a scene lacks to explain a measured cloud, on all cores. Ctrl-C ends it.
///
/// Parameters
/// ----------
/// cloud : Cloud, Scan, str or os.PathLike
///     The measured cloud, with a row of each detection.
/// scene : Scene, str or os.PathLike
///     The scene that was measured.
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
///
/// Returns
/// -------
/// Diagnosis
///
/// Raises
/// ------
/// matdb.DiagnoseError
///     Too few data, or data that are not of this scene.
#[pyfunction]
#[pyo3(signature = (cloud, scene, *, db = None, receiver = None, effects = Vec::new(), own_effects = Vec::new(), seed = 0, controls = true))]
#[expect(clippy::too_many_arguments, reason = "each is a keyword in Python")]
pub(crate) fn diagnose(
    py: Python<'_>,
    cloud: CloudLike,
    scene: SceneLike,
    db: Option<&Database>,
    receiver: Option<&str>,
    effects: Vec<String>,
    own_effects: Vec<Py<Effect>>,
    seed: u64,
    controls: bool,
) -> PyResult<Diagnosis> {
    let (scene, database) = (scene.scene(py)?, db.map(Database::database));
    let effects = effects.iter().map(|name| {
        let unknown = || UsageError::new_err(format!("there is no effect `{name}` of clouds"));
        find(name).ok_or_else(unknown)
    });
    let effects = effects.collect::<PyResult<Vec<_>>>()?;
    let own: Vec<_> = own_effects.iter().map(|effect| effect.get().effect()).collect();
    for (number, effect) in own.iter().enumerate() {
        if own[..number].iter().any(|other| other.name() == effect.name()) {
            let problem = format!("two effects are called {}", effect.name());
            return Err(UsageError::new_err(format!("{problem}; give one another name")));
        }
    }
    let scene = scene.get();
    let declared = scene.own_effects(py)?;
    let answer = interruptible(py, |stop| {
        let request = CloudRequest {
            cloud: cloud.path(),
            scene: scene.path(),
            further: &[],
            receiver,
            effects: &effects,
            own_effects: &own,
            material: None,
            seed,
            controls,
            folder: Path::new(""),
            add: false,
        };
        let checked = check(request, scene, declared, database.as_ref())?;
        let given = vec![cloud.input()?, input(scene.path(), scene.own_text().as_bytes())];
        let checked = CheckedRequest { given, ..checked };
        let clouds = checked.read_clouds(|_, _| Ok(cloud.read()?.into_owned()))?;
        let found = checked.diagnose(&clouds, &|_| stop.check())?;
        let notices = checked.notices();
        let words = ["matdb".to_owned(), "matdb diagnose".to_owned()];
        let publication = Publication::new(&checked, &found, &notices, words);
        let whole = |path: PathBuf| absolute(&path).unwrap_or(path);
        Ok(Diagnosis {
            record: json!(publication.report().record()),
            page: publication.page_alone()?,
            files: publication.files()?,
            from: whole(PathBuf::from(".")),
            read: checked.files_read().into_iter().map(whole).collect(),
        })
    })?;
    answer.map_err(raised::<Error>)
}

/// The request, of a scene with its materials.
fn check<'a>(
    request: CloudRequest<'a>,
    scene: &Scene,
    declared: EffectList,
    database: Option<&setup::Database>,
) -> Result<CheckedRequest<'a>, Error> {
    let store = database.map(setup::Database::read).transpose()?.flatten();
    let ready = ReadyScene::new(scene.scene().clone(), scene.path(), store.as_ref())?;
    request.check_ready(
        ready.with_own_effects(declared),
        scene.own_text().to_owned(),
        store.as_ref(),
    )
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
    ) -> PyResult<Diagnosis> {
        let files = files.into_iter().map(|(name, bytes)| (name, bytes.as_bytes().to_vec()));
        Ok(Diagnosis {
            record: of_text(record)?,
            page: page.as_bytes().to_vec(),
            files: files.collect(),
            from: from_folder,
            read,
        })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, Diagnosis { record, page, files, from, read }) = (slf.py(), slf.get());
        let files = files.iter().map(|(name, bytes)| (name, PyBytes::new(py, bytes)));
        let page = PyBytes::new(py, page);
        let parts = (text_of(record)?, page, Vec::from_iter(files), from, read);
        (slf.get_type().getattr("_of_parts")?, parts).into_pyobject(py)
    }
}
