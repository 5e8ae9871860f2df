//! The revisions of a material: when each was made, by which command, and what changed.

use serde::Serialize;

use crate::catalogue::Diff;
use crate::error::Error;
use crate::material::{Activity, Material};
use crate::setup::{Database, find_material, unknown_material};
use crate::store::Store;

/// A revision and what made it.
#[derive(Clone, Debug, Serialize)]
pub struct RevisionRecord {
    /// Its number, from 1.
    pub revision: u32,
    /// When it was added: UTC, ISO 8601, to the second.
    pub added_at: String,
    /// Version of the program that added it.
    pub program_version: String,
    /// [`Material::content_hash`] when it was added.
    pub content_hash: String,
    /// The command that made it and its inputs; `None` where an older program did not record it.
    pub activity: Option<Activity>,
    /// What differs from the revision before, in a line.
    pub changed: String,
}

/// All revisions of a material, oldest first.
///
/// # Errors
/// A name that the database does not have; a database that cannot be read.
pub fn revision_records(name: &str, database: &Database) -> Result<Vec<RevisionRecord>, Error> {
    let store = database.read()?;
    let mut records = Vec::new();
    if let (Some(store), Ok(slug)) = (&store, name.parse()) {
        let mut last: Option<Material> = None;
        for summary in store.history(&slug)? {
            let Some(stored) = store.get(&slug, Some(summary.revision))? else { continue };
            let changed = match &last {
                None => "first".to_owned(),
                Some(last) => Diff::new(last, &stored.material).line(),
            };
            records.push(RevisionRecord {
                revision: stored.revision,
                added_at: stored.added_at,
                program_version: stored.program_version,
                content_hash: stored.content_hash,
                activity: stored.activity,
                changed,
            });
            last = Some(stored.material);
        }
    }
    if records.is_empty() {
        return Err(no_revisions(name, store.as_ref(), database)?);
    }
    Ok(records)
}

/// Why there is nothing to tell.
fn no_revisions(name: &str, store: Option<&Store>, database: &Database) -> Result<Error, Error> {
    match find_material(store, name, "") {
        Ok(_) if name.contains('@') => Ok(Error::usage(
            format!("`{name}` is one revision"),
            "give the bare name; `matdb show` shows one revision",
        )),
        Ok(_) => Ok(Error::usage(
            format!("`{name}` is built in and not in {}", database.path().display()),
            format!("`matdb add {name}` begins its history"),
        )),
        Err(_) => unknown_material(store, name, ""),
    }
}
