//! A database of materials.

use std::path::PathBuf;

use matdb::adopt::{
    CatalogueImport, CheckReport, CurveOrigin, DatabaseCheck, FitStorage, FittedMaterial,
    NewMaterials, Withdrawal, remove_materials,
};
use matdb::catalogue::exchange::{Details, Export, Format};
use matdb::catalogue::{About, Citable, Credit, Diff, Rank, publish, references};
use matdb::error::Error;
use matdb::files::{folder_of, read_small, write_all};
use matdb::material::{Slug, builtin};
use matdb::report::{
    ExportReport, ExportRequest, MaterialSearch, NeighbourSearch, Prediction, revision_records,
};
use matdb::setup::{self, MaterialRevision, find_material};
use matdb::store::{Filter, Store};
use matdb::units::watts_from_dbm;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use serde_json::json;

use crate::error::{UsageError, no_choice, raised, warn};
use crate::fit::Fit;
use crate::interrupt::interruptible;
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
    pub(crate) fn read(&self) -> Result<Option<Store>, Error> {
        Ok(Store::open_existing(&self.path)?)
    }

    fn store(&self) -> PyResult<Option<Store>> {
        self.read().map_err(raised)
    }

    /// A material of the file, or a built-in one.
    fn find(&self, py: Python<'_>, name: &str) -> PyResult<MaterialRevision> {
        py.detach(|| find_material(self.read()?.as_ref(), name, "")).map_err(raised)
    }

    pub(crate) fn database(&self) -> setup::Database {
        setup::Database::new(Some(&self.path))
    }

    /// Stores a fit under the name of a material.
    fn add_fit(
        &self,
        py: Python<'_>,
        name: &str,
        fit: &Fit,
        given: Details,
    ) -> PyResult<Vec<String>> {
        let slug = name.parse::<Slug>();
        let slug = slug.map_err(|error| UsageError::new_err(error.to_string()))?;
        let own = fit.measured.as_ref();
        let details = Details {
            slug: Some(slug),
            kind: given.kind.or(own.map(|one| one.kind)),
            instrument: given.instrument.or_else(|| own.map(|one| one.name.clone())),
            frequency_hz: given.frequency_hz.or(own.map(|one| one.frequency_hz)),
            threshold_w: given.threshold_w.or(own.map(|one| one.threshold_w)),
            ..given
        };
        let Details { kind, source, licence, instrument, frequency_hz, threshold_w, .. } =
            details.clone();
        let origin =
            CurveOrigin { kind, title: source, licence, instrument, frequency_hz, threshold_w };
        let storage = FitStorage { material: Some(name.to_owned()), keep_render: false, origin };
        let Fit { subject, result, fit_name, .. } = fit;
        let fitted = FittedMaterial { subject, result, fit_name, details, storage };
        let stored = py.detach(|| fitted.store(&self.database())).map_err(raised)?;
        if stored.curve_is_open {
            let sentence =
                "the fit leaves the curve open somewhere: scenes go on rendering what they did";
            warn(py, &[sentence.to_owned()])?;
        }
        Ok(vec![format!("{}@{}", stored.material, stored.revision)])
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

    /// A material by `NAME` or `NAME@REVISION`, from the file or built in. `in` and `len` are of the file alone.
    fn __getitem__(&self, py: Python<'_>, name: &str) -> PyResult<Material> {
        self.find(py, name).map(Material::new)
    }

    /// Adds built-in materials by name, and those of files or folders: `material.toml`, or a format of others. Or a fit
    /// under the name of a material, which is made where it is not there: `db.add("my-skin", fit, source="My bench, 2026",
    /// licence="CC-BY-4.0")`.
    ///
    /// Parameters
    /// ----------
    /// *names : str
    ///     Built-in materials; or the name of one material and its `Fit`.
    /// files : list of path, optional
    ///     Files, or folders with a `material.toml` each.
    /// name : str, optional
    ///     Name of the material of a file of others.
    /// source, licence : str, optional
    ///     Of the curve of a fit or of a file of others: who measured it, when and how, and the SPDX expression of its licence.
    /// kind : str, optional
    ///     How the curve came to be: `measured`, `literature`, `modelled` or `synthetic`. That of `measure` is `measured`
    ///     unless stated, and `synthetic` of a `Scan`.
    /// material_class, description : str, optional
    ///     Of a new material; the class of one of a fit is `sample` unless stated.
    /// instrument : str, optional
    /// frequency_ghz, threshold_dbm : float, optional
    ///     What the curve was measured with; that of the scene that it was measured in unless stated.
    ///
    /// Returns
    /// -------
    /// list of str
    ///     `NAME@REVISION` of each.
    ///
    /// Raises
    /// ------
    /// matdb.Error
    ///     What an entry lacks, and details for which there is no place. Nothing is stored then.
    ///
    /// Warns
    /// -----
    /// UserWarning
    ///     What is not known of a material, and what may be a slip.
    #[pyo3(signature = (*names, files = Vec::new(), name = None, source = None, licence = None, kind = None,
                        material_class = None, description = None, instrument = None, frequency_ghz = None,
                        threshold_dbm = None))]
    #[expect(clippy::too_many_arguments, reason = "each is a keyword in Python")]
    fn add(
        &self,
        py: Python<'_>,
        names: &Bound<'_, PyTuple>,
        files: Vec<PathBuf>,
        name: Option<String>,
        source: Option<String>,
        licence: Option<String>,
        kind: Option<&str>,
        material_class: Option<String>,
        description: Option<String>,
        instrument: Option<String>,
        frequency_ghz: Option<f64>,
        threshold_dbm: Option<f64>,
    ) -> PyResult<Vec<String>> {
        let wrong = |error| UsageError::new_err(format!("kind: {error}"));
        let kind = kind.map(|kind| serde_json::from_value(json!(kind))).transpose();
        let slug = name.as_deref().map(str::parse::<Slug>).transpose();
        let given = Details {
            slug: slug.map_err(|error| UsageError::new_err(error.to_string()))?,
            class: material_class,
            description,
            kind: kind.map_err(wrong)?,
            source,
            licence,
            instrument,
            frequency_hz: frequency_ghz.map(|ghz| ghz * 1e9),
            threshold_w: threshold_dbm.map(watts_from_dbm),
            ..Details::default()
        };
        if let Ok((name, fit)) = names.extract::<(String, Bound<'_, Fit>)>() {
            if !files.is_empty() || given.slug.is_some() {
                let problem =
                    "a fit is added alone, under the name before it; leave files and name out";
                return Err(UsageError::new_err(problem));
            }
            return self.add_fit(py, &name, fit.get(), given);
        }
        if files.is_empty() && given != Details::default() {
            let problem = "details belong to a file or a fit; give one, or leave the details out";
            return Err(UsageError::new_err(problem));
        }
        let names: Vec<String> = names.extract()?;
        let stored = py.detach(|| {
            let database = self.database();
            let new = NewMaterials::read(&names, &files, &given, &database)?;
            Ok((new.store(&database)?, new.notices))
        });
        let (added, mut notices) = stored.map_err(raised::<Error>)?;
        notices.extend(added.iter().flat_map(|one| one.notice.clone()));
        warn(py, &notices)?;
        Ok(added.iter().map(|one| format!("{}@{}", one.slug, one.added.revision())).collect())
    }

    /// The materials with these words, the best first: a dictionary each, as `matdb search --json` prints.
    #[pyo3(signature = (words, *, most = 20))]
    fn search<'py>(&self, py: Python<'py>, words: &str, most: u32) -> PyResult<Bound<'py, PyAny>> {
        let hits = py.detach(|| MaterialSearch { words, most }.run(&self.database()));
        to_python(py, &hits.map_err(raised)?)
    }

    /// The revisions of a material, oldest first: a dictionary each, as `matdb history --json` prints.
    fn history<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let records = py.detach(|| revision_records(name, &self.database()));
        to_python(py, &records.map_err(raised)?)
    }

    /// What the rendered law of a material says at angles of incidence, with a 95 % band, as `matdb predict --json` prints it.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     `NAME` or `NAME@REVISION`.
    /// angles_deg : sequence of float
    ///     From 0 to below 90.
    fn predict<'py>(
        &self,
        py: Python<'py>,
        name: &str,
        angles_deg: Vec<f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        if let Some(wrong) = angles_deg.iter().find(|angle| !(0.0..90.0).contains(*angle)) {
            return Err(UsageError::new_err(format!("{wrong}° is not from 0 to below 90")));
        }
        let found = self.find(py, name)?;
        let MaterialRevision { material, revision } = &found;
        let prediction = py.detach(|| Prediction::new(material, *revision, &angles_deg));
        to_python(py, &prediction.map_err(raised)?)
    }

    /// What differs between two materials or revisions, as `matdb diff --json` prints it.
    fn diff<'py>(&self, py: Python<'py>, before: &str, after: &str) -> PyResult<Bound<'py, PyAny>> {
        let found = py.detach(|| {
            let store = self.read()?;
            let [before, after] =
                [before, after].map(|name| find_material(store.as_ref(), name, ""));
            Ok((before?.material, after?.material))
        });
        let (before, after) = found.map_err(raised::<Error>)?;
        to_python(py, &py.detach(|| Diff::new(&before, &after)))
    }

    /// How to cite a material: `text`, `bibtex`, `csl`, and the `references` of its data.
    fn cite<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let store = self.store()?;
        let found = find_material(store.as_ref(), name, "").map_err(raised)?;
        let stored = found.stored(store.as_ref()).map_err(raised)?;
        let credit = stored.as_ref().map_or(Credit::BuiltIn, Credit::of);
        let year = stored.as_ref().and_then(|stored| credit.year(stored));
        let material = &found.material;
        let citable = Citable { material, revision: found.revision, year, credit };
        let record = json!({
            "text": citable.text(),
            "bibtex": citable.bibtex(),
            "csl": citable.csl(),
            "references": references(material),
        });
        to_python(py, &record)
    }

    /// The materials nearest to the longest curve of a material, as `matdb near --json` prints them.
    ///
    /// Parameters
    /// ----------
    /// material : str
    ///     `NAME` or `NAME@REVISION`.
    /// measured_at_ghz : float, optional
    ///     Frequency of the curve, GHz; that of its instrument unless stated.
    /// shape : bool, default False
    ///     Rank by shape, for a curve of unknown level.
    /// most : int, default 10
    ///     How many at most.
    #[pyo3(signature = (material, *, measured_at_ghz = None, shape = false, most = 10))]
    fn near<'py>(
        &self,
        py: Python<'py>,
        material: &str,
        measured_at_ghz: Option<f64>,
        shape: bool,
        most: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let report = py.detach(|| {
            let store = Store::open_existing(&self.path)?;
            let frequency_hz = measured_at_ghz.map(|ghz| ghz * 1e9);
            let search = NeighbourSearch::of_material(material, frequency_hz, store.as_ref())?;
            let rank = if shape { Rank::Shape } else { Rank::Level };
            let is_refused = search.illumination.relative && !shape;
            let filter = Filter::default();
            (!is_refused).then(|| search.run(store.as_ref(), &filter, rank, most)).transpose()
        });
        let relative = "the levels of the curve are relative; rank by shape (shape=True)";
        let report = report.map_err(raised::<Error>)?;
        to_python(py, &report.ok_or_else(|| UsageError::new_err(relative))?)
    }

    /// Withdraws a material; it and its revisions stay. Returns the revision that says so.
    ///
    /// Parameters
    /// ----------
    /// name : str
    /// reason : str
    ///     Why, in a sentence.
    /// superseded_by : str, optional
    ///     Name of the material that replaces it.
    #[pyo3(signature = (name, reason, *, superseded_by = None))]
    fn withdraw(
        &self,
        py: Python<'_>,
        name: String,
        reason: String,
        superseded_by: Option<String>,
    ) -> PyResult<u32> {
        let withdrawal = Withdrawal { name, reason, superseded_by };
        let done = py.detach(|| withdrawal.store(&self.database()));
        let (_, revision) = done.map_err(raised)?;
        Ok(revision)
    }

    /// Removes materials with all their revisions. Returns `slug` and number of `revisions` of each.
    #[pyo3(signature = (*names))]
    fn remove<'py>(&self, py: Python<'py>, names: Vec<String>) -> PyResult<Bound<'py, PyAny>> {
        let removed = py.detach(|| remove_materials(&names, &self.database()));
        to_python(py, &removed.map_err(raised)?)
    }

    /// Writes a material to a file of another format. Returns the files and what the format cannot hold, as
    /// `matdb export --json` prints it.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     `NAME` or `NAME@REVISION`.
    /// path : str or os.PathLike
    ///     The file; tables that belong to it get its name.
    /// format : str
    ///     `csv`, `universal-brdf`, `open-material`, `mitsuba` or `sionna`.
    /// curve : str, optional
    ///     Name of the curve of `csv`.
    #[pyo3(signature = (name, path, *, format, curve = None))]
    fn export<'py>(
        &self,
        py: Python<'py>,
        name: &str,
        path: PathBuf,
        format: &str,
        curve: Option<&str>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let format = match format {
            "csv" => Format::Csv,
            "universal-brdf" => Format::UniversalBrdf,
            "open-material" => Format::OpenMaterial,
            "mitsuba" => Format::Mitsuba,
            "sionna" => Format::Sionna,
            other => {
                let known = "csv, universal-brdf, open-material, mitsuba or sionna";
                return Err(no_choice("format", other, known));
            }
        };
        let request = ExportRequest { material: name, format, curve, output: &path };
        let export = py.detach(|| {
            let store = Store::open_existing(&self.path)?;
            let ExportReport { export, .. } = request.run(store.as_ref())?;
            write_all(folder_of(&path), &export.files)?;
            Ok(export)
        });
        let Export { files, lost } = export.map_err(raised::<Error>)?;
        let written: Vec<PathBuf> =
            files.iter().map(|(name, _)| path.with_file_name(name)).collect();
        to_python(py, &json!({ "files": written, "lost": lost }))
    }

    /// Writes all materials as a static site with data, as `matdb publish` does. Returns what it says with `--json`.
    ///
    /// Parameters
    /// ----------
    /// folder : str or os.PathLike
    /// about : str or os.PathLike, optional
    ///     `about.toml` with title, people and licence; that of the publication there unless stated.
    #[pyo3(signature = (folder, *, about = None))]
    fn publish<'py>(
        &self,
        py: Python<'py>,
        folder: PathBuf,
        about: Option<PathBuf>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let published = py.detach(|| {
            let Some(store) = Store::open_existing(&self.path)? else {
                return Err(Error::NoDatabase { path: self.path.clone() });
            };
            let about = match &about {
                None => About::of_publication(&folder).unwrap_or_default(),
                Some(path) => {
                    let text = String::from_utf8_lossy(&read_small(path)?).into_owned();
                    About::parse(&path.display().to_string(), &text)?
                }
            };
            Ok(publish(&store, &about, &folder, |_| ())?)
        });
        to_python(py, &published.map_err(raised::<Error>)?)
    }

    /// Verifies a published catalogue and adds all of what is new, or nothing. Returns what was done, as
    /// `matdb import --json` prints it.
    ///
    /// Parameters
    /// ----------
    /// bundle : str or os.PathLike
    ///     A published folder, or its `catalogue.sqlite`.
    /// prefix : str, optional
    ///     What stands before the names of materials that differ from those of the same name here.
    /// dry_run : bool, default False
    ///     Whether nothing is written.
    #[pyo3(signature = (bundle, *, prefix = None, dry_run = false))]
    fn import_catalogue<'py>(
        &self,
        py: Python<'py>,
        bundle: PathBuf,
        prefix: Option<&str>,
        dry_run: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let import = CatalogueImport { bundle: &bundle, prefix, dry_run };
        let imported = py.detach(|| import.run(&self.database()));
        to_python(py, &imported.map_err(raised)?)
    }

    /// Verifies the whole database and makes its fits again, as `matdb check --json` prints it. What is wrong is in
    /// `findings`. Ctrl-C ends it, but for a repair.
    ///
    /// Parameters
    /// ----------
    /// repair : bool, default False
    ///     Whether what can be repaired is repaired first, after the file was copied.
    #[pyo3(signature = (*, repair = false))]
    fn check<'py>(&self, py: Python<'py>, repair: bool) -> PyResult<Bound<'py, PyAny>> {
        let check = DatabaseCheck { repair };
        let report: Result<CheckReport, _> = interruptible(py, |stop| {
            check.run(&self.database(), &mut |_| {
                if !repair {
                    stop.check()
                }
            })
        })?;
        to_python(py, &report.map_err(raised)?)
    }

    fn __repr__(&self) -> PyResult<String> {
        Ok(format!("<matdb.Database {}: {} materials>", self.path.display(), self.names()?.len()))
    }

    fn __reduce__(slf: &Bound<'_, Self>) -> PyResult<(Py<PyAny>, (PathBuf,))> {
        let open = slf.py().import("matdb")?.getattr("open")?;
        Ok((open.unbind(), (slf.get().path.clone(),)))
    }
}
