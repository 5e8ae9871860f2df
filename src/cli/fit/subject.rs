//! What is fitted: a curve of a file or of a material.

use std::path::{Path, PathBuf};

use super::Args;
use crate::brdf::Brdf;
use crate::error::Error;
use crate::files::{FilesError, read_small};
use crate::material;
use crate::measure::curve::Curve;
use crate::setup::{MaterialRevision, find_material};
use crate::store::Store;

/// A curve and where it comes from.
pub(super) struct Subject {
    /// As the user named it.
    pub label: String,
    /// Name of the curve within a material.
    pub curve_name: String,
    pub curve: Curve,
    /// The material whose curve it is; `None` for a file.
    pub found: Option<MaterialRevision>,
    /// The file, if it is one.
    pub file: Option<PathBuf>,
}

impl Subject {
    pub fn find(args: &Args, store: Option<&Store>) -> Result<Subject, Error> {
        let path = Path::new(&args.what);
        match args.what.ends_with(".csv") || path.is_file() {
            true => Subject::of_file(args, path),
            false => Subject::of_material(args, find_material(store, &args.what, "")?),
        }
    }

    fn of_file(args: &Args, path: &Path) -> Result<Subject, Error> {
        let label = path.display().to_string();
        let bytes = read_small(path).map_err(|error| FilesError {
            way_out: "check the path, or name a material",
            ..error
        })?;
        let refused = |error| Error::CurveFile { file: path.to_owned(), error };
        let curve = Curve::read(&bytes).map_err(refused)?;
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let curve_name = args.curve.clone().unwrap_or(stem);
        Ok(Subject { label, curve_name, curve, found: None, file: Some(path.to_owned()) })
    }

    fn of_material(args: &Args, found: MaterialRevision) -> Result<Subject, Error> {
        let slug = &found.material.slug;
        let curves = &found.material.curves;
        let longest = || curves.iter().rev().max_by_key(|curve| curve.observations.len());
        let named = |name: &String| curves.iter().find(|curve| curve.name == *name);
        let Some(curve) = args.curve.as_ref().map_or_else(longest, named) else {
            return Err(no_curve(args, slug.as_str(), curves));
        };
        let label = format!("{}, curve {}", args.what, curve.name);
        let fail = |error| Error::Observation { curve: label.clone(), error };
        let rows = Curve::from_observations(&curve.observations).map_err(fail)?;
        let curve_name = curve.name.clone();
        Ok(Subject { label, curve_name, curve: rows, found: Some(found), file: None })
    }

    /// The model of the material's rendered fit, if it renders one.
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

fn no_curve(args: &Args, slug: &str, curves: &[material::Curve]) -> Error {
    let names: Vec<&str> = curves.iter().map(|curve| curve.name.as_str()).collect();
    let (problem, way_out) = match (&args.curve, names.as_slice()) {
        (Some(name), [_, ..]) => {
            (format!("`{slug}` has no curve `{name}`"), format!("there are: {}", names.join(", ")))
        }
        _ => (
            format!("`{slug}` has no curve that could be fitted"),
            format!("fit a file: `matdb fit curve.csv --save {slug} --kind … --source …`"),
        ),
    };
    Error::Usage { problem, way_out }
}
