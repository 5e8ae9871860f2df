//! A material that must not be used any more.

use super::provenance::activity;
use crate::error::Error;
use crate::material::{Material, Slug, Status};
use crate::setup::{Database, find_material, unknown_material};
use crate::store::Store;

/// That a material is withdrawn or superseded, and why.
#[derive(Clone, Debug)]
pub struct Withdrawal {
    /// Name of the material.
    pub name: String,
    /// Why, in a sentence.
    pub reason: String,
    /// Name of the better one that replaces it.
    pub superseded_by: Option<String>,
}

impl Withdrawal {
    /// Stores the status as a new revision of the material; the material and its revision.
    ///
    /// # Errors
    /// A material that is not in the database; a successor that is not known; a database that cannot be written.
    pub fn store(&self, database: &Database) -> Result<(Material, u32), Error> {
        // Opening for reading first: a database that is not there must not be made by this.
        let known = database.read()?;
        let stored = match (&known, self.name.parse::<Slug>()) {
            (Some(store), Ok(slug)) => store.get(&slug, None)?,
            _ => None,
        };
        let Some(stored) = stored else {
            find_material(known.as_ref(), &self.name, "")?;
            return Err(Error::usage(
                format!("`{}` is not in {}", self.name, database.path().display()),
                "give the bare name of one that `matdb list` shows",
            ));
        };
        let reason = self.reason.clone();
        let status = match &self.superseded_by {
            None => Status::Withdrawn { reason },
            Some(by) => {
                Status::Superseded { by: find_successor(known.as_ref(), &self.name, by)?, reason }
            }
        };
        drop(known);
        let material = Material { status, ..stored.material };
        let mut store = database.write()?;
        store.record(activity("withdraw", &[])?);
        let added = store.add([&material])?;
        let revision = added.first().map_or(stored.revision, |added| added.revision());
        Ok((material, revision))
    }
}

/// The name of the better one, which must be known.
fn find_successor(store: Option<&Store>, name: &str, by: &str) -> Result<Slug, Error> {
    const ASKED_BY: &str = "the successor: ";
    let error = match find_material(store, by, ASKED_BY) {
        Ok(found) if found.material.slug.as_str() == by => return Ok(found.material.slug),
        Ok(_) => unknown_material(store, by, ASKED_BY)?,
        Err(error) => error,
    };
    match error {
        // The nearest name is often that of the one which is withdrawn.
        Error::UnknownMaterial { asked_by, name: wanted, way_out }
            if way_out.contains(&format!("`{name}`")) =>
        {
            let way_out = "add that one first, with `matdb add --from FILE`".to_owned();
            Err(Error::UnknownMaterial { asked_by, name: wanted, way_out })
        }
        error => Err(error),
    }
}
