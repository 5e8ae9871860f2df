//! Reading the files of a publication, with limits to their size.

use std::fs;
use std::path::Path;

use serde::de::DeserializeOwned;

use super::about::About;
use super::api::{LARGEST_MATERIAL_BYTES, SCHEMA_VERSION};
use super::layout::{ABOUT, INDEX};

/// Largest database or table that is read, bytes.
pub const LARGEST_TABLE_BYTES: u64 = 64 << 30;
/// Largest file of any other kind, bytes.
pub const LARGEST_FILE_BYTES: u64 = 1 << 30;

/// A file of a publication as JSON; else why it cannot be read.
pub(super) fn read<T: DeserializeOwned>(bundle: &Path, path: &str) -> Result<T, String> {
    let place = bundle.join(path);
    let limit = if path == INDEX { LARGEST_FILE_BYTES } else { LARGEST_MATERIAL_BYTES };
    let size = fs::metadata(&place).map_err(|reason| reason.to_string())?.len();
    if size > limit {
        return Err("is too large to read".to_owned());
    }
    let bytes = fs::read(place).map_err(|reason| reason.to_string())?;
    serde_json::from_slice(&bytes).map_err(|error| error.to_string())
}

/// Title, people and licence of a publication.
pub(super) fn about(bundle: &Path) -> Result<About, String> {
    read(bundle, ABOUT).map_err(|what| format!("{ABOUT}: {what}"))
}

/// Whether a newer program published this, so that its files may hold what this one does not understand.
pub(super) fn is_newer(bundle: &Path) -> bool {
    #[derive(serde::Deserialize)]
    struct Version {
        schema_version: u32,
    }
    read::<Version>(bundle, INDEX).is_ok_and(|found| found.schema_version > SCHEMA_VERSION)
}
