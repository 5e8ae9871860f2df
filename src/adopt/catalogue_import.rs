//! Another laboratory's catalogue into the database.

use std::path::Path;

use super::provenance::activity;
use crate::catalogue::{Import, ImportSummary, MaterialPlan, Outcome};
use crate::error::Error;
use crate::report::CATALOGUE_VIEW;
use crate::setup::Database;

/// What is taken over, and how.
#[derive(Clone, Copy, Debug)]
pub struct CatalogueImport<'a> {
    /// A published folder, or its `catalogue.sqlite`.
    pub bundle: &'a Path,
    /// What stands before the names of materials that differ from those of the same name here; without it these are
    /// conflicts and not added.
    pub prefix: Option<&'a str>,
    /// Whether this is a trial that writes nothing.
    pub dry_run: bool,
}

impl CatalogueImport<'_> {
    /// Verifies the catalogue and adds all of what is new, or nothing.
    ///
    /// # Errors
    /// A catalogue that is damaged or cannot be read; a database that cannot be written.
    pub fn run(&self, database: &Database) -> Result<ImportSummary, Error> {
        let import = Import::open(publication(self.bundle), CATALOGUE_VIEW)?;
        // The database that is asked for may be made by this.
        let ours = if database.path().exists() { database.read()? } else { None };
        let materials = import.plan(ours.as_ref(), self.prefix)?;
        drop(ours);
        if !self.dry_run && materials.iter().any(is_new) {
            let mut store = database.write()?;
            import.take(&mut store, &materials, &activity("import", &[&import.database()])?)?;
        }
        let unstated = import.without_footprint(&materials)?;
        let notices = Vec::from_iter(unstated.first().map(|first| {
            let others = match unstated.len() - 1 {
                0 => String::new(),
                more => format!(" (and {more} more)"),
            };
            format!(
                "the footprint with which it was reduced is not stated of the curve of {first}{others}: its levels \
                 are compared as they are"
            )
        }));
        Ok(ImportSummary { dry_run: self.dry_run, materials, notices })
    }
}

fn is_new(plan: &MaterialPlan) -> bool {
    matches!(plan.outcome, Outcome::Added { .. } | Outcome::Continued { .. })
}

/// The publication that a database lies in: it says whose it is, and has its hash.
fn publication(bundle: &Path) -> &Path {
    match bundle.parent() {
        Some(folder) if bundle.ends_with("catalogue.sqlite") && bundle.is_file() => {
            let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
            if folder.join("SHA256SUMS").is_file() { folder } else { bundle }
        }
        _ => bundle,
    }
}
