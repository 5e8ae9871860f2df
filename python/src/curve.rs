//! What a law lacks to explain a curve.

use std::path::{Path, PathBuf, absolute};

use matdb::adopt::FitSubject;
use matdb::error::Error;
use matdb::files::read_small;
use matdb::formats::ColumnNames;
use matdb::measure::Curve;
use matdb::report::{CurveAnswer, CurveRequest, curve_law, curve_terms, terms_not_asked};
use matdb::setup::find_material;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::json;

use crate::cloud::column_names;
use crate::database::Database;
use crate::diagnose::Diagnosis;
use crate::error::{raised, warn};
use crate::fit::What;
use crate::numbers::seed;
use crate::own::refuse_inside;

/// Finds the effects that a scattering law lacks to explain a measured curve.
///
/// Parameters
/// ----------
/// what : Measurement, Material, str or os.PathLike
///     A curve that was measured, a material with a curve or its name, `NAME` or `NAME@REVISION`, or the file of a curve: the CSV
///     of `matdb measure`, a table in the plane of incidence (`theta_i_deg,theta_s_deg,brdf_per_sr`), or a `.bsdf`.
/// db : Database, optional
///     Where materials are looked for; without it, and for those that it does not have, the built-in ones.
/// model : str, optional
///     Law that the curve is compared with; one GGX lobe over Lambert unless stated.
/// noise_db : float, optional
///     Noise of the levels, dB; from repeats, the file, or neighbouring angles unless stated.
/// effects : list of str, optional
///     Names of the effects to try; all unless stated. `matdb.effects()` lists them.
/// curve : str, optional
///     Curve of the material; the longest unless stated.
/// columns : dict of str to str, optional
///     Our names for columns of the file, as in `{"inc": "theta_deg"}`; `-` passes one over.
/// seed : int, default 0
///
/// Returns
/// -------
/// Diagnosis
///
/// Raises
/// ------
/// matdb.DiagnoseError
///     Too few levels, or no noise to compare the law with.
///
/// Warns
/// -----
/// UserWarning
///     Levels that are not used.
#[pyfunction]
#[pyo3(signature = (what, *, db = None, model = None, noise_db = None, effects = Vec::new(), curve = None, columns = None,
                    seed = 0))]
#[expect(clippy::too_many_arguments, reason = "each is a keyword in Python")]
pub(crate) fn diagnose_curve(
    py: Python<'_>,
    what: What,
    db: Option<&Database>,
    model: Option<&str>,
    noise_db: Option<f64>,
    effects: Vec<String>,
    curve: Option<&str>,
    columns: Option<&Bound<'_, PyDict>>,
    #[pyo3(from_py_with = seed)] seed: u64,
) -> PyResult<Diagnosis> {
    let has_columns = columns.is_some();
    let columns = columns.map_or(Ok(ColumnNames::default()), column_names)?;
    refuse_inside()?;
    let diagnosed = py.detach(|| {
        let law = model.map(curve_law).transpose()?;
        let effects = curve_terms(&effects)?;
        let (name, levels) = levels_of(&what, curve, db)?;
        if has_columns && matches!(what, What::Measured(_) | What::Material(_)) {
            return Err(ignored("columns", "a file"));
        }
        let path = Path::new(&name);
        let (columns, law) = (&columns, law.as_ref());
        let request = CurveRequest { path, columns, law, noise_db, effects: &effects, seed };
        let (report, notices) = match &levels {
            Levels::File(bytes) => request.diagnose(bytes)?,
            Levels::Curve(curve) => request.diagnose_curve(curve, &[])?,
        };
        let not_tried = &terms_not_asked(&effects);
        let answer = CurveAnswer { report: &report, name: &name, model, seed, not_tried };
        let files = answer.files()?;
        let page = files.iter().find(|(name, _)| name == "report.html");
        let diagnosis = Diagnosis {
            record: json!(answer.record()),
            page: page.map(|(_, page)| page.clone()).unwrap_or_default(),
            files,
            from: PathBuf::new(),
            read: absolute(path).into_iter().filter(|whole| whole.is_file()).collect(),
            stored: Vec::new(),
            scenes_after: Vec::new(),
        };
        Ok((diagnosis, notices))
    });
    let (diagnosis, notices) = diagnosed.map_err(raised::<Error>)?;
    warn(py, &notices)?;
    Ok(diagnosis)
}

/// The refusal of a keyword that would do nothing.
pub(crate) fn ignored(keyword: &str, of: &str) -> Error {
    let problem = format!("{keyword} is for {of}");
    Error::Usage { problem, way_out: "leave it out".to_owned() }
}

/// Where the levels of a curve come from.
enum Levels {
    /// The bytes of its file.
    File(Vec<u8>),
    /// A curve of a material.
    Curve(Curve),
}

/// The path of a curve or a name in its place, and its levels.
fn levels_of(
    what: &What,
    curve: Option<&str>,
    db: Option<&Database>,
) -> Result<(String, Levels), Error> {
    let subject = match what {
        What::Named(name) => {
            let path = Path::new(name);
            if name.ends_with(".csv") || name.ends_with(".bsdf") || path.is_file() {
                if curve.is_some() {
                    return Err(ignored("curve", "a material"));
                }
                return Ok((name.clone(), Levels::File(read_small(path)?)));
            }
            let store = db.map_or(Ok(None), Database::read)?;
            FitSubject::of_material(name, curve, find_material(store.as_ref(), name, "")?)?
        }
        What::Measured(_) if curve.is_some() => return Err(ignored("curve", "a material")),
        What::Measured(measured) => {
            let (subject, _) = measured.get().subject();
            // What it saves is rounded.
            return Ok((subject.label, Levels::File(subject.curve.write())));
        }
        What::Material(material) => {
            let found = material.get().found().clone();
            FitSubject::of_material(&found.material.slug.to_string(), curve, found)?
        }
    };
    Ok((subject.label, Levels::Curve(subject.curve)))
}
