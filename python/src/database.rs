//! A database of materials.

use std::path::{Path, PathBuf, absolute};

use matdb::adopt::{
    CatalogueImport, CheckReport, CurveOrigin, DatabaseCheck, FitStorage, FitSubject,
    FittedMaterial, NewMaterials, Withdrawal, publish, remove_materials,
};
use matdb::catalogue::exchange::{Details, Export, Format};
use matdb::catalogue::{About, Citable, Credit, Diff, Rank, references};
use matdb::error::Error;
use matdb::files::{folder_of, read_small, write_all};
use matdb::fit::model_names;
use matdb::formats::ColumnNames;
use matdb::material::{Slug, SourceKind, builtin};
use matdb::measure::Curve;
use matdb::report::{
    ExportReport, ExportRequest, MaterialList, MaterialSearch, NeighbourSearch, Prediction,
    revision_records,
};
use matdb::setup::{self, MaterialRevision, find_material};
use matdb::store::{Filter, Store};
use matdb::units::watts_from_dbm;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use serde_json::json;

use crate::cloud::column_names;
use crate::error::{UsageError, no_choice, raised, warn};
use crate::fit::Fit;
use crate::interrupt::interruptible;
use crate::json::to_python;
use crate::material::Material;
use crate::measure::Measurement;
use crate::own::refuse_inside;

/// A database of materials: a SQLite file. Built-in materials are found, too, where the file does not have them.
///
/// It holds no connection: each call opens the file, so that it may be pickled and used from any thread.
#[pyclass(frozen, module = "matdb")]
pub(crate) struct Database {
    /// As it was given.
    given: PathBuf,
    /// The same, from the root.
    whole: PathBuf,
}

impl Database {
    /// The file: as it was given, unless the program has gone to another folder since.
    fn path(&self) -> &Path {
        let is_here = absolute(&self.given).is_ok_and(|whole| whole == self.whole);
        if is_here { &self.given } else { &self.whole }
    }

    /// The file, if somebody has made it.
    pub(crate) fn read(&self) -> Result<Option<Store>, Error> {
        Ok(Store::open_existing(self.path())?)
    }

    fn store(&self) -> PyResult<Option<Store>> {
        self.read().map_err(raised)
    }

    /// A material of the file, or a built-in one.
    fn find(&self, py: Python<'_>, name: &str) -> PyResult<MaterialRevision> {
        py.detach(|| find_material(self.read()?.as_ref(), name, "")).map_err(raised)
    }

    pub(crate) fn database(&self) -> setup::Database {
        setup::Database::new(Some(self.path()))
    }

    /// Stores a fit under the name of a material.
    fn add_fit(
        &self,
        py: Python<'_>,
        name: &str,
        fit: &Fit,
        given: Details,
        keep_render: bool,
    ) -> PyResult<Vec<String>> {
        if fit.is_own() {
            let problem = "a fit of a function of a program cannot be stored; save the Material at the parameters of \
                           the fit, material.at(**fit.parameters).save(path), and add that file";
            return Err(UsageError::new_err(problem));
        }
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
        let storage = FitStorage { material: Some(name.to_owned()), keep_render, origin };
        let Fit { subject, fit, .. } = fit;
        let fitted = FittedMaterial { subject, fit, details, storage };
        let stored = py.detach(|| fitted.store(&self.database())).map_err(raised)?;
        if stored.curve_is_open {
            let sentence =
                "the fit leaves the curve open somewhere: scenes go on rendering what they did";
            warn(py, &[sentence.to_owned()])?;
        }
        Ok(vec![format!("{}@{}", stored.material, stored.revision)])
    }
}

/// How numbers came to be, by its word.
fn source_kind(word: &str) -> PyResult<SourceKind> {
    let known = "measured, literature, modelled or synthetic";
    serde_json::from_value(json!(word)).map_err(|_| no_choice("kind", word, known))
}

/// A frequency, Hz, of one in GHz.
fn frequency_hz(ghz: f64) -> PyResult<f64> {
    /// Visible light: what lies above was not meant in GHz.
    const HIGHEST_GHZ: f64 = 1e6;
    if ghz > 0.0 && ghz <= HIGHEST_GHZ {
        return Ok(ghz * 1e9);
    }
    Err(UsageError::new_err(format!("{ghz} GHz is not a frequency; give one above 0, such as 300")))
}

/// The conditions on materials that several functions take as keywords.
fn filter_of(given: Option<&Bound<'_, PyDict>>) -> PyResult<Filter> {
    let mut filter = Filter::default();
    for (key, value) in given.into_iter().flatten() {
        let key: String = key.extract()?;
        match key.as_str() {
            "frequency_ghz" => {
                let ghz: Option<f64> = value.extract()?;
                filter.frequency_hz = ghz.map(frequency_hz).transpose()?;
            }
            "tag" => filter.tag = value.extract()?,
            "kind" => {
                let word: Option<String> = value.extract()?;
                filter.kind = word.as_deref().map(source_kind).transpose()?;
            }
            "material_class" => filter.class = value.extract()?,
            "fitted" => filter.fitted = value.extract()?,
            "status" => {
                let word: Option<String> = value.extract()?;
                let is_known = |word: &str| ["active", "superseded", "withdrawn"].contains(&word);
                if let Some(word) = word.as_deref().filter(|word| !is_known(word)) {
                    return Err(no_choice("status", word, "active, superseded or withdrawn"));
                }
                filter.status = word;
            }
            other => {
                return Err(PyTypeError::new_err(format!(
                    "unexpected keyword {other:?}; materials are chosen by frequency_ghz, tag, kind, material_class, fitted \
                     and status"
                )));
            }
        }
    }
    Ok(filter)
}

/// A curve whose neighbours are wanted.
fn curve_of(
    given: &Bound<'_, PyAny>,
    columns: Option<&Bound<'_, PyDict>>,
    frequency_hz: Option<f64>,
) -> PyResult<NeighbourSearch> {
    if let Ok(measured) = given.cast::<Measurement>() {
        let (FitSubject { curve, .. }, instrument) = measured.get().subject();
        let Curve { observations, illumination } = curve;
        let frequency_hz = frequency_hz.or(Some(instrument.frequency_hz));
        return Ok(NeighbourSearch { observations, illumination, frequency_hz, own: None });
    }
    let path: PathBuf = given
        .extract()
        .map_err(|_| PyTypeError::new_err("give a matdb.Measurement or the file of a curve"))?;
    let columns = columns.map_or(Ok(ColumnNames::default()), column_names)?;
    let bytes = read_small(&path).map_err(raised)?;
    let (curve, notices) = Curve::read_as(&bytes, &columns)
        .map_err(|error| raised(Error::CurveFile { file: path, error }))?;
    warn(given.py(), &notices)?;
    let Curve { observations, illumination } = curve;
    Ok(NeighbourSearch { observations, illumination, frequency_hz, own: None })
}

/// Checks a published catalogue, and fits again what it holds, as `matdb verify --json` prints it. What is wrong is in
/// `problems`.
///
/// Parameters
/// ----------
/// bundle : str or os.PathLike
///     A published folder, or a database.
///
/// Returns
/// -------
/// dict
#[pyfunction]
pub(crate) fn verify<'py>(py: Python<'py>, bundle: PathBuf) -> PyResult<Bound<'py, PyAny>> {
    refuse_inside()?;
    let verified = py.detach(|| matdb::adopt::verify(&bundle));
    to_python(py, &verified.map_err(raised)?)
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
    if path.as_os_str().is_empty() {
        let problem = "the name of the database is empty; give a file, such as matdb.sqlite";
        return Err(UsageError::new_err(problem));
    }
    let whole = absolute(&path).map_err(PyErr::from)?;
    let database = Database { given: path, whole };
    // A file of another program is refused at once.
    database.store()?;
    Ok(database)
}

#[pymethods]
impl Database {
    /// The file.
    #[getter(path)]
    fn file(&self) -> &Path {
        self.path()
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
    /// material_class, title, description : str, optional
    ///     Of a new material; the class of one of a fit is `sample` unless stated, and the title its name.
    /// tags : list of str, optional
    ///     Words to find a new material by.
    /// authors : list of str, optional
    ///     Who measured or wrote the source, as in `Doe, Jane`.
    /// year : int, optional
    ///     Year of the source.
    /// curve : str, optional
    ///     Name of the curve of a file of others; that of the file unless stated.
    /// columns : dict of str to str, optional
    ///     Our names for columns of a CSV file, as in `{"inc": "theta_deg"}`; `-` passes one over.
    /// model : str, optional
    ///     Model that is fitted to the curve of a file of others and rendered in its place.
    /// keep_render : bool, default False
    ///     Whether scenes go on rendering what they did, where a fit is added.
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
                        material_class = None, title = None, description = None, tags = Vec::new(), authors = Vec::new(),
                        year = None, curve = None, columns = None, model = None, instrument = None, frequency_ghz = None,
                        threshold_dbm = None, keep_render = false))]
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
        title: Option<String>,
        description: Option<String>,
        tags: Vec<String>,
        authors: Vec<String>,
        year: Option<u16>,
        curve: Option<String>,
        columns: Option<&Bound<'_, PyDict>>,
        model: Option<String>,
        instrument: Option<String>,
        frequency_ghz: Option<f64>,
        threshold_dbm: Option<f64>,
        keep_render: bool,
    ) -> PyResult<Vec<String>> {
        let kind = kind.map(source_kind).transpose()?;
        let model = model.map(|name| match matdb::fit::model(&name) {
            Some(start) => Ok((name, start)),
            None => Err(no_choice("model", &name, &model_names().collect::<Vec<_>>().join(", "))),
        });
        let slug = name.as_deref().map(str::parse::<Slug>).transpose();
        let given = Details {
            slug: slug.map_err(|error| UsageError::new_err(error.to_string()))?,
            name: title,
            class: material_class,
            description,
            tags,
            authors,
            year,
            curve,
            columns: columns.map_or(Ok(ColumnNames::default()), column_names)?,
            model: model.transpose()?,
            kind,
            source,
            licence,
            instrument,
            frequency_hz: frequency_ghz.map(|ghz| ghz * 1e9),
            threshold_w: threshold_dbm.map(watts_from_dbm),
        };
        if let Ok((name, fit)) = names.extract::<(String, Bound<'_, Fit>)>() {
            if !files.is_empty() || given.slug.is_some() {
                let problem =
                    "a fit is added alone, under the name before it; leave files and name out";
                return Err(UsageError::new_err(problem));
            }
            return self.add_fit(py, &name, fit.get(), given, keep_render);
        }
        if files.is_empty() && given != Details::default() {
            let problem = "details belong to a file or a fit; give one, or leave the details out";
            return Err(UsageError::new_err(problem));
        }
        if names.iter().any(|one| one.is_instance_of::<Material>()) {
            let problem =
                "a Material is added as a file: material.save(path), and then db.add(files=[path])";
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

    /// The materials of the file, sorted by name: a dictionary each, as `matdb list --json` prints.
    ///
    /// Parameters
    /// ----------
    /// most : int, optional
    ///     How many at most; all unless stated.
    /// **filter
    ///     What must hold of them: `frequency_ghz` at which their numbers are claimed, a `tag`, the `kind` of what scenes render
    ///     (`measured`, `literature`, `modelled` or `synthetic`), the `material_class`, whether one is `fitted` to a curve, and
    ///     the `status` (`active`, `superseded` or `withdrawn`).
    #[pyo3(signature = (*, most = None, **filter))]
    fn materials<'py>(
        &self,
        py: Python<'py>,
        most: Option<u32>,
        filter: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let filter = filter_of(filter)?;
        let list = py.detach(|| {
            let store = self.read()?;
            MaterialList::new(&filter, most.unwrap_or(u32::MAX), store.as_ref())
        });
        let list = list.map_err(raised)?;
        to_python(py, &list.rows.iter().map(|row| &row.summary).collect::<Vec<_>>())
    }

    /// The materials with these words, the best first: a dictionary each, as `matdb search --json` prints.
    ///
    /// Parameters
    /// ----------
    /// words : str
    ///     All of them must be there; the last may be a beginning.
    /// most : int, default 20
    ///     How many at most.
    /// **filter
    ///     As for `materials`: `db.search("paint", frequency_ghz=300)`.
    #[pyo3(signature = (words, *, most = 20, **filter))]
    fn search<'py>(
        &self,
        py: Python<'py>,
        words: &str,
        most: u32,
        filter: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let filter = &filter_of(filter)?;
        let hits = py.detach(|| MaterialSearch { words, filter, most }.run(&self.database()));
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

    /// The materials nearest to a curve, as `matdb near --json` prints them.
    ///
    /// Parameters
    /// ----------
    /// material : str, optional
    ///     The longest curve of this material, `NAME` or `NAME@REVISION`.
    /// curve : Measurement, str or os.PathLike, optional
    ///     A curve that was measured, or its CSV file, in place of a material.
    /// columns : dict of str to str, optional
    ///     Our names for columns of the file, as in `{"inc": "theta_deg"}`; `-` passes one over.
    /// measured_at_ghz : float, optional
    ///     Frequency of the curve, GHz; that of its instrument unless stated.
    /// shape : bool, default False
    ///     Rank by shape, for a curve of unknown level.
    /// most : int, default 10
    ///     How many at most.
    /// **filter
    ///     As for `materials`.
    #[pyo3(signature = (material = None, *, curve = None, columns = None, measured_at_ghz = None, shape = false, most = 10,
                        **filter))]
    #[expect(clippy::too_many_arguments, reason = "each is a keyword in Python")]
    fn near<'py>(
        &self,
        py: Python<'py>,
        material: Option<&str>,
        curve: Option<&Bound<'py, PyAny>>,
        columns: Option<&Bound<'py, PyDict>>,
        measured_at_ghz: Option<f64>,
        shape: bool,
        most: usize,
        filter: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let filter = filter_of(filter)?;
        let frequency_hz = measured_at_ghz.map(frequency_hz).transpose()?;
        let given = match (material, curve) {
            (Some(_), None) => None,
            (None, Some(curve)) => Some(curve_of(curve, columns, frequency_hz)?),
            _ => return Err(UsageError::new_err("give a material, or a curve")),
        };
        refuse_inside()?;
        let report = py.detach(|| {
            let store = Store::open_existing(self.path())?;
            let name = material.unwrap_or_default();
            let search = match given {
                Some(search) => search,
                None => NeighbourSearch::of_material(name, frequency_hz, store.as_ref())?,
            };
            let rank = if shape { Rank::Shape } else { Rank::Level };
            let is_refused = search.illumination.relative && !shape;
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
    ///     `csv`, `parquet` (of a wheel that was built with it), `universal-brdf`, `open-material`, `mitsuba` or `sionna`.
    /// curve : str, optional
    ///     Name of the curve; what scenes render, else the one that was fitted, unless stated.
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
            "parquet" => Format::Parquet,
            "universal-brdf" => Format::UniversalBrdf,
            "open-material" => Format::OpenMaterial,
            "mitsuba" => Format::Mitsuba,
            "sionna" => Format::Sionna,
            other => {
                let known = "csv, parquet, universal-brdf, open-material, mitsuba or sionna";
                return Err(no_choice("format", other, known));
            }
        };
        let request = ExportRequest { material: name, format, curve, output: &path };
        let export = py.detach(|| {
            let store = Store::open_existing(self.path())?;
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
        refuse_inside()?;
        let published = py.detach(|| {
            let Some(store) = Store::open_existing(self.path())? else {
                return Err(Error::NoDatabase { path: self.path().to_owned() });
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
        Ok(format!("<matdb.Database {}: {} materials>", self.path().display(), self.names()?.len()))
    }

    fn __reduce__(slf: &Bound<'_, Self>) -> PyResult<(Py<PyAny>, (PathBuf,))> {
        let open = slf.py().import("matdb")?.getattr("open")?;
        Ok((open.unbind(), (slf.get().path().to_owned(),)))
    }
}
