//! What a model lacks.

use std::path::{Path, PathBuf};

use matdb::adopt::{CheckedRequest, CloudRequest, Earlier, Publication, input};
use matdb::diagnose::Report;
use matdb::effects::{Effect, find};
use matdb::error::Error;
use matdb::files::{folder_of, write_all};
use matdb::material::Input;
use matdb::setup::{self, ReadyScene};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use serde_json::{Value, json};

use crate::cloud::CloudLike;
use crate::database::Database;
use crate::error::{UsageError, raised};
use crate::interrupt::interruptible;
use crate::json::to_python;
use crate::scene::{Scene, SceneLike};

/// Name and bytes of a file.
type File = (String, Vec<u8>);

/// What was diagnosed, as it was then: a cloud, and the scene that was measured with its materials.
struct Subject {
    cloud: PathBuf,
    ready: ReadyScene,
    scene_text: String,
    /// Names and hashes of cloud and scene.
    given: Vec<Input>,
    /// Those to try; all where there are none.
    effects: Vec<&'static dyn Effect>,
    seed: u64,
    controls: bool,
}

/// What a scene lacks to explain a cloud.
#[pyclass(frozen, module = "matdb")]
pub(crate) struct Diagnosis {
    subject: Subject,
    found: Report,
    record: Value,
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
/// effects : list of str, optional
///     Names of the effects to try; all unless stated.
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
#[pyo3(signature = (cloud, scene, *, db = None, effects = Vec::new(), seed = 0, controls = true))]
pub(crate) fn diagnose(
    py: Python<'_>,
    cloud: CloudLike,
    scene: SceneLike,
    db: Option<&Database>,
    effects: Vec<String>,
    seed: u64,
    controls: bool,
) -> PyResult<Diagnosis> {
    let (scene, database) = (scene.scene(py)?, db.map(Database::database));
    let effects = effects.iter().map(|name| {
        let unknown = || UsageError::new_err(format!("there is no effect `{name}` of clouds"));
        find(name).ok_or_else(unknown)
    });
    let effects = effects.collect::<PyResult<Vec<_>>>()?;
    let answer = interruptible(py, |stop| {
        let subject =
            Subject::new(&cloud, scene.get(), database.as_ref(), effects, seed, controls)?;
        let checked = subject.check(Path::new(""))?;
        let clouds = checked.read_clouds(|_, _| Ok(cloud.read()?.into_owned()))?;
        let found = checked.diagnose(&clouds, &|_| stop.check())?;
        let notices = checked.notices();
        let record = json!(publication(&checked, &found, &notices).report().record());
        drop(checked);
        Ok(Diagnosis { subject, found, record })
    })?;
    answer.map_err(raised::<Error>)
}

impl Subject {
    fn new(
        cloud: &CloudLike,
        scene: &Scene,
        database: Option<&setup::Database>,
        effects: Vec<&'static dyn Effect>,
        seed: u64,
        controls: bool,
    ) -> Result<Subject, Error> {
        let store = database.map(setup::Database::read).transpose()?.flatten();
        let ready = ReadyScene::new(scene.scene().clone(), scene.path(), store.as_ref())?;
        let scene_text = scene.own_text().to_owned();
        let given = vec![cloud.input()?, input(scene.path(), scene_text.as_bytes())];
        let cloud = cloud.path().to_owned();
        Ok(Subject { cloud, ready, scene_text, given, effects, seed, controls })
    }

    /// The request, with its report in a folder.
    fn check<'a>(&'a self, folder: &'a Path) -> Result<CheckedRequest<'a>, Error> {
        let request = CloudRequest {
            cloud: &self.cloud,
            scene: &self.ready.path,
            further: &[],
            receiver: None,
            effects: &self.effects,
            material: None,
            seed: self.seed,
            controls: self.controls,
            folder,
            add: false,
        };
        let checked = request.check_ready(self.ready.clone(), self.scene_text.clone(), None)?;
        Ok(CheckedRequest { given: self.given.clone(), ..checked })
    }
}

/// The files and words of a diagnosis.
fn publication<'a>(
    checked: &'a CheckedRequest,
    report: &'a Report,
    notices: &'a [String],
) -> Publication<'a> {
    let words = ["matdb".to_owned(), "matdb diagnose".to_owned()];
    Publication::new(checked, report, notices, words)
}

impl Diagnosis {
    /// The files of its report, for a folder, and what an earlier one left there.
    fn files(&self, folder: &Path) -> Result<(Vec<File>, Earlier), Error> {
        let checked = self.subject.check(folder)?;
        checked.check_output()?;
        let notices = checked.notices();
        let files = publication(&checked, &self.found, &notices).files()?;
        Ok((files, Earlier::in_folder(folder, &checked.request.inputs())))
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
        let written = py.detach(|| {
            let checked = self.subject.check(folder_of(&path))?;
            let notices = checked.notices();
            let page = publication(&checked, &self.found, &notices).page_alone()?;
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            Ok(write_all(folder_of(&path), &[(name, page)])?)
        });
        written.map_err(raised::<Error>)
    }

    /// Writes the files that `matdb diagnose` writes, all or none, in the place of those of an earlier diagnosis.
    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        let written = py.detach(|| {
            let (files, earlier) = self.files(&folder)?;
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
}
