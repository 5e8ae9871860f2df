//! What is fitted: a curve of a file or of a material.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::brdf::Brdf;
use crate::error::Error;
use crate::files::{FilesError, WayOut, read_small};
use crate::formats::ColumnNames;
use crate::material;
use crate::measure::Curve;
use crate::setup::{MaterialRevision, find_material};
use crate::store::Store;

/// A curve and where it comes from.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FitSubject {
    /// The file or the material, as it was named.
    pub wanted: String,
    /// The file, or the material and its curve.
    pub label: String,
    /// Name of the curve within a material.
    pub curve_name: String,
    /// Its points.
    pub curve: Curve,
    /// The material that has the curve; `None` for a file.
    pub found: Option<MaterialRevision>,
    /// The file; `None` for a curve of a material.
    pub file: Option<PathBuf>,
    /// What a person should know of the file.
    pub notices: Vec<String>,
}

impl FitSubject {
    /// Reads the curve of a CSV file, or finds that of a material, `NAME` or `NAME@REVISION`. `curve` names the
    /// curve of the material, by default the longest, or the name under which that of a file is to be stored, by
    /// default the file's. `columns` are our names for the columns of a file.
    ///
    /// # Errors
    /// A file that cannot be read; a material or a curve that is not known.
    pub fn open(
        wanted: &str,
        curve: Option<&str>,
        columns: &ColumnNames,
        store: Option<&Store>,
    ) -> Result<FitSubject, Error> {
        let path = Path::new(wanted);
        if wanted.ends_with(".csv") || wanted.ends_with(".bsdf") || path.is_file() {
            FitSubject::of_file(path, curve, columns)
        } else {
            FitSubject::of_material(wanted, curve, find_material(store, wanted, "")?)
        }
    }

    /// A curve that is in no file and no material yet, with a name for it.
    pub fn of_curve(curve: Curve, name: &str) -> FitSubject {
        FitSubject {
            wanted: name.to_owned(),
            label: name.to_owned(),
            curve_name: name.to_owned(),
            curve,
            found: None,
            file: None,
            notices: Vec::new(),
        }
    }

    fn of_file(
        path: &Path,
        curve: Option<&str>,
        columns: &ColumnNames,
    ) -> Result<FitSubject, Error> {
        let label = path.display().to_string();
        let bytes = read_small(path).map_err(|error| FilesError {
            way_out: WayOut::Words("check the path, or name a material"),
            ..error
        })?;
        let (points, notices) = Curve::read_as(&bytes, columns)
            .map_err(|error| Error::CurveFile { file: path.to_owned(), error })?;
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        Ok(FitSubject {
            wanted: label.clone(),
            label,
            curve_name: curve.unwrap_or(&stem).to_owned(),
            curve: points,
            found: None,
            file: Some(path.to_owned()),
            notices,
        })
    }

    /// The longest curve of a material, or the one of this name; `wanted` is how the material was named.
    ///
    /// # Errors
    /// A material without such a curve.
    pub fn of_material(
        wanted: &str,
        curve: Option<&str>,
        found: MaterialRevision,
    ) -> Result<FitSubject, Error> {
        let curves = &found.material.curves;
        let chosen = match curve {
            Some(name) => curves.iter().find(|known| known.name == name),
            None => found.material.longest_curve(),
        };
        let Some(chosen) = chosen else {
            return Err(no_curve(found.material.slug.as_str(), curve, curves));
        };
        let label = format!("{wanted}, curve {}", chosen.name);
        let points = Curve::of_material(chosen)
            .map_err(|error| Error::Observation { curve: label.clone(), error })?;
        Ok(FitSubject {
            wanted: wanted.to_owned(),
            label,
            curve_name: chosen.name.clone(),
            curve: points,
            found: Some(found),
            file: None,
            notices: Vec::new(),
        })
    }

    /// The model of the fit that scenes render of the material, if it has parameters.
    pub fn rendered_model(&self) -> Option<Brdf> {
        let material = &self.found.as_ref()?.material;
        let rendered = material.fits.iter().find(|fit| fit.name == material.render)?;
        Some(rendered.model.clone()).filter(|model| !model.parameters().is_empty())
    }

    /// Root mean square of the rows' angle deviations, rad.
    pub fn theta_sd_rad(&self) -> f64 {
        let rows = &self.curve.observations;
        let squares: f64 = rows.iter().map(|row| row.theta_sd_rad.unwrap_or(0.0).powi(2)).sum();
        (squares / rows.len().max(1) as f64).sqrt()
    }
}

fn no_curve(slug: &str, wanted: Option<&str>, curves: &[material::Curve]) -> Error {
    let names: Vec<&str> = curves.iter().map(|curve| curve.name.as_str()).collect();
    let (problem, way_out) = match (wanted, names.as_slice()) {
        (Some(name), [_, ..]) => {
            (format!("`{slug}` has no curve `{name}`"), format!("there are: {}", names.join(", ")))
        }
        _ => (
            format!("`{slug}` has no curve that could be fitted"),
            "fit the curve of a file, and store it in the material with its kind and its source"
                .to_owned(),
        ),
    };
    Error::usage(problem, way_out)
}
