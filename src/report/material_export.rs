//! A material in a format of others.

use std::path::Path;

use crate::catalogue::Credit;
use crate::catalogue::exchange::{Export, Format, Subject, export};
use crate::error::Error;
use crate::material::Material;
use crate::setup::{MaterialRevision, find_material, later_status_warning, status_warning};
use crate::store::Store;

/// What is exported, and as what.
#[derive(Clone, Copy, Debug)]
pub struct ExportRequest<'a> {
    /// The material, `NAME` or `NAME@REVISION`.
    pub material: &'a str,
    /// The format.
    pub format: Format,
    /// Name of the curve; `None` for what scenes render, else the one that was fitted.
    pub curve: Option<&'a str>,
    /// The file that will be written; tables that belong to it get its name.
    pub output: &'a Path,
}

/// The files of an export, and what a person should know of them.
pub struct ExportReport {
    /// The files and what they cannot hold.
    pub export: Export,
    /// That the material is withdrawn or superseded.
    pub notice: Option<String>,
}

impl ExportRequest<'_> {
    /// Encodes the files.
    ///
    /// # Errors
    /// A material or a curve that is not known; a file without a name; a material that the format cannot hold.
    pub fn run(&self, store: Option<&Store>) -> Result<ExportReport, Error> {
        let found = find_material(store, self.material, "")?;
        let stored = found.stored(store)?;
        let MaterialRevision { material, revision } = &found;
        self.check_curve(material)?;
        let Some(name) = self.output.file_name().and_then(|name| name.to_str()) else {
            return Err(Error::usage(
                format!("{} names no file", self.output.display()),
                "name one with -o, such as -o paint.brdf",
            ));
        };
        let subject = Subject {
            material,
            revision: *revision,
            added_at: stored.as_ref().map(|stored| stored.added_at.as_str()),
            origin: stored.as_ref().and_then(|stored| Credit::of(stored).origin()),
            curve: self.curve,
        };
        let export = export(&subject, self.format, name)?;
        let later = later_status_warning(store, &material.slug, *revision)?;
        Ok(ExportReport { export, notice: later.or_else(|| status_warning(material)) })
    }

    fn check_curve(&self, material: &Material) -> Result<(), Error> {
        let names: Vec<&str> = material.curves.iter().map(|curve| curve.name.as_str()).collect();
        match self.curve {
            Some(name) if !names.contains(&name) => Err(Error::usage(
                format!("`{}` has no curve `{name}`", self.material),
                if names.is_empty() {
                    "leave --curve out: its model is written".to_owned()
                } else {
                    format!("there are: {}", names.join(", "))
                },
            )),
            _ => Ok(()),
        }
    }
}
