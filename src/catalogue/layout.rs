//! Names of the files of a publication.

use crate::files::FolderContent;

/// The list of hashes, which tells a publication from another folder.
pub(super) const SUMS: &str = "SHA256SUMS";

/// The database.
pub(super) const DATABASE: &str = "catalogue.sqlite";

/// Title, people and licence of the catalogue.
pub(super) const ABOUT: &str = "about.json";

/// The index of all materials, which every publication has.
pub(super) const INDEX: &str = "api/v1/index.json";

/// The folder with a file for each material.
pub(super) const MATERIALS: &str = "api/v1/materials/";

/// The page of all materials in three dimensions.
pub(super) const VIEW: &str = "view.html";

/// The record that Zenodo reads.
pub(super) const ZENODO: &str = ".zenodo.json";

/// What else may stand in a published folder: it belongs to version control and to web hosts.
pub(super) const KEPT: [&str; 3] = [".git", ".nojekyll", "CNAME"];

/// What of a published folder matters when a new publication replaces it.
pub(super) const CONTENT: FolderContent = FolderContent { kept: &KEPT, proof: SUMS };

/// The file of a material.
pub(super) fn material_path(slug: &str) -> String {
    format!("{MATERIALS}{slug}.json")
}

/// The CSV of a table.
pub(super) fn csv_path(table: &str) -> String {
    format!("tables/{table}.csv")
}

/// The media type of a file that records list one by one. The files of single materials are not among them: the
/// index lists those.
pub(super) fn listed_media_type(path: &str) -> Option<&'static str> {
    let ending = path.rsplit('.').next().unwrap_or_default();
    let is_data = path.starts_with("tables/") || path == INDEX;
    match ending {
        _ if path == DATABASE => Some("application/vnd.sqlite3"),
        "csv" if is_data => Some("text/csv"),
        "parquet" if is_data => Some("application/vnd.apache.parquet"),
        "json" if is_data => Some("application/json"),
        _ => None,
    }
}
