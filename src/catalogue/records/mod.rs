//! Records of a publication in the formats of repositories and search engines.

mod changes;
mod citation;
mod context;
mod data_package;
mod linked;

pub(super) use linked::licence_record;

use super::about::About;
use super::api::Index;
use super::error::CatalogueError;
use super::folder::Folder;
use super::layout::ZENODO;
use super::schema;
use super::tables::WrittenTable;
use context::Context;

/// Writes all records; every other file but the list of hashes must be in the folder already. Returns whether other
/// data had the same version there.
pub(super) fn write(
    folder: &mut Folder,
    about: &About,
    index: &Index,
    tables: &[WrittenTable],
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
