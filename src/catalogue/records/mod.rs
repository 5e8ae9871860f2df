//! What a publication says of itself in the forms that repositories and search engines read.

mod changes;
mod citation;
mod data_package;
mod linked;

pub(super) use linked::licence_record;

use super::api::Index;
use super::tables::Written;
use super::{About, CatalogueError, Folder, schema};

/// What Zenodo reads.
pub(super) const ZENODO: &str = ".zenodo.json";

/// What every record is made from.
pub(super) struct Context<'a> {
    pub about: &'a About,
    /// When the newest entry was added: UTC, ISO 8601.
    pub date: Option<&'a str>,
    pub materials: usize,
}

impl<'a> Context<'a> {
    /// The date without the time.
    fn day(&self) -> Option<&'a str> {
        self.date?.get(..10)
    }
}

/// Writes all records; everything else but the list of hashes stands in the folder already. Whether other data
/// had the same version there.
pub(super) fn write(
    folder: &mut Folder,
    about: &About,
    index: &Index,
    tables: &[Written],
) -> Result<bool, CatalogueError> {
    for (path, schema) in schema::files() {
        folder.write(path, schema.as_bytes())?;
    }
    let is_reused = changes::write(folder, index)?;
    let context = Context { about, date: index.date.as_deref(), materials: index.materials.len() };
    folder.write("CITATION.cff", citation::cff(&context).as_bytes())?;
    if let Some(record) = citation::zenodo(&context) {
        pretty(folder, ZENODO, &record)?;
    }
    pretty(folder, "dataset.jsonld", &linked::dataset(&context, folder.sums()))?;
    pretty(
        folder,
        "datapackage.json",
        &data_package::package(&context, index, tables, folder.sums()),
    )?;
    pretty(folder, "ro-crate-metadata.json", &linked::crate_metadata(&context, folder.sums()))?;
    Ok(is_reused)
}

fn pretty(
    folder: &mut Folder,
    path: &str,
    value: &serde_json::Value,
) -> Result<(), CatalogueError> {
    folder.write(path, format!("{value:#}\n").as_bytes())
}

/// The files that a record lists one by one, with their kind: not those of single materials, which the
/// index names.
fn listed(path: &str) -> Option<&'static str> {
    let ending = path.rsplit('.').next().unwrap_or_default();
    let is_data = path.starts_with("tables/") || path == "api/v1/index.json";
    match (path, ending) {
        ("catalogue.sqlite", _) => Some("application/vnd.sqlite3"),
        (_, "csv") if is_data => Some("text/csv"),
        (_, "parquet") if is_data => Some("application/vnd.apache.parquet"),
        (_, "json") if is_data => Some("application/json"),
        _ => None,
    }
}
