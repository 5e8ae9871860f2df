//! What a model lacks.

use std::path::PathBuf;

use matdb::adopt::{CloudRequest, Earlier, Publication};
use matdb::error::Error;
use matdb::files::write_all;
use matdb::measure::CloudReading;
use matdb::setup::read_cloud;
use pyo3::prelude::*;
use serde_json::{Value, json};

use crate::database::Database;
use crate::error::raised;
use crate::json::to_python;

/// Finds the physical effects that a scene lacks to explain a measured cloud, and writes a report of them.
///
/// Parameters
/// ----------
/// cloud : str or os.PathLike
///     The measured cloud, with a row of each detection.
/// scene : str or os.PathLike
///     The file of the scene that was measured.
/// folder : str or os.PathLike
///     Where `report.html`, `report.json` and the scene with what was found are written.
/// db : Database, optional
///     Where materials are looked for; without it, and for those that it does not have, the built-in ones.
/// seed : int, default 0
/// controls : bool, default True
///     Whether controls are computed, which take as long as the diagnosis.
///
/// Returns
/// -------
/// dict
///     What `matdb diagnose --json` prints: `verdict`, `effects` with their numbers, errors before and after.
///
/// Raises
/// ------
/// matdb.Error
///     Too few data, or data that are not of this scene.
#[pyfunction]
#[pyo3(signature = (cloud, scene, folder, *, db = None, seed = 0, controls = true))]
pub(crate) fn diagnose<'py>(
    py: Python<'py>,
    cloud: PathBuf,
    scene: PathBuf,
    folder: PathBuf,
    db: Option<&Database>,
    seed: u64,
    controls: bool,
) -> PyResult<Bound<'py, PyAny>> {
    let database = db.map(Database::database);
    let record = py.detach(|| -> Result<Value, Error> {
        let request = CloudRequest {
            cloud: &cloud,
            scene: &scene,
            further: &[],
            receiver: None,
            effects: &[],
            material: None,
            seed,
            controls,
            folder: &folder,
            add: false,
        };
        let store = database.map(|database| database.read()).transpose()?.flatten();
        let checked = request.check(store.as_ref())?;
        let notices = checked.notices();
        let clouds = checked.read_clouds(|path, _| read_cloud(path, &CloudReading::default()))?;
        let report = checked.diagnose(&clouds, &|_| ())?;
        let words = ["matdb".to_owned(), "matdb diagnose".to_owned()];
        let publication = Publication::new(&checked, &report, &notices, words);
        let earlier = Earlier::in_folder(&folder, &checked.request.inputs());
        let files = publication.files()?;
        write_all(&folder, &files)?;
        earlier.remove_all_but(&files);
        Ok(json!(publication.report().record()))
    });
    to_python(py, &record.map_err(raised)?)
}
